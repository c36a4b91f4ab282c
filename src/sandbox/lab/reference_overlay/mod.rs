//! The reference overlay: steps an f64 reference with smaller substeps for each body, with the same
//! grab, colliders and settings, and measures the distance between the two.
//!
//! The references are stepped on a separate thread ([`Follower`]). After each tick it receives the
//! inputs of that tick and the positions of the bodies, steps the references through the same tick,
//! and sends back their distances. Bodies and references are thus only compared at the same tick.
//! If the thread does not keep up, the clock is [held](SimulationClock::held) until it has caught
//! up: the simulation slows down, but no frame waits.
//!
//! While the overlay is off there is no [`ReferenceOverlay`], no thread, and no system in the
//! schedule of a tick.

pub mod bodies;
pub mod distance;
mod follow;
pub mod form;
pub mod pace;
mod ticks;

pub use follow::Follower;

use crate::{
    sandbox::state::selection::{Scope, Selection},
    simulation::{SimulationClock, StepSchedule, StepSystems, plain::lasting_bodies},
};
use bevy::{ecs::schedule::ScheduleCleanupPolicy, prelude::*};
use bodies::{Comparison, Moment};
use distance::Trail;
use std::sync::Arc;
use ticks::{begin, observe};

/// Commands of the reference overlay.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceCommand {
    /// Switch it on or off.
    Toggle,
    /// Restart from the current state of the bodies.
    Again,
}

/// State of the reference overlay while it is on.
#[derive(Resource, Debug, Default)]
pub struct ReferenceOverlay {
    follower: Option<Follower>,
    /// All bodies when the references were started, to detect added and removed bodies.
    bodies: Vec<Entity>,
    /// Number of bodies that could have had a reference.
    candidates: usize,
    /// The selection when the references were started.
    chosen: Scope,
    /// The tick at which the references were started.
    began: u64,
    /// The last tick that was sent.
    sent: Option<Arc<Moment>>,
    /// The previous and the latest comparison.
    compared: [Option<Comparison>; 2],
    /// Number of references at the start.
    count: usize,
    /// Root mean square distance at the start [m].
    outset: f64,
    trail: Trail,
    /// Smoothed fraction of frames in which ticks were held.
    held: f32,
    /// Reason why there is no reference although the overlay is on.
    trouble: Option<String>,
}

/// Weight of a frame in the smoothed fraction of held frames.
const NOTICED: f32 = 0.05;

impl ReferenceOverlay {
    /// The latest comparison.
    #[must_use]
    pub fn compared(&self) -> Option<&Comparison> {
        self.compared[1].as_ref()
    }

    /// Distances over the last ticks.
    #[must_use]
    pub fn trail(&self) -> &Trail {
        &self.trail
    }

    /// Number of references at the start, and number of bodies that could have had one.
    #[must_use]
    pub const fn bodies(&self) -> (usize, usize) {
        (self.count, self.candidates)
    }

    /// Root mean square distance to the bodies at the start [m].
    #[must_use]
    pub const fn outset(&self) -> f64 {
        self.outset
    }

    /// Reason why there is no reference, if an error occurred.
    #[must_use]
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Whether the simulation is slowed down to wait for the references.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.held > 0.2
    }

    /// Offset of the reference from each particle [m], interpolated by `fraction`, 0 to 1, from
    /// the previous comparison to the latest; `None` if the body has no reference.
    pub fn gaps(&self, body: Entity, fraction: f32) -> Option<impl Iterator<Item = Vec3>> {
        let [before, now] = self.compared.each_ref().map(|comparison| {
            let mut gaps = comparison.as_ref()?.gaps.iter();
            gaps.find(|(other, _)| *other == body).map(|(_, gap)| gap)
        });
        let now = now?;
        let before = before.unwrap_or(now);
        Some(
            before
                .iter()
                .zip(now)
                .map(move |(a, b)| a.lerp(*b, fraction)),
        )
    }

    /// Number of ticks that the references are behind.
    fn behind(&self) -> u64 {
        let sent = self.sent.as_ref().map_or(self.began, |moment| moment.tick);
        let done = self
            .compared()
            .map_or(self.began, |comparison| comparison.tick);
        sent.saturating_sub(done)
    }

    /// Clears the state, so that the references are started again.
    fn again(&mut self) {
        *self = Self {
            held: self.held,
            ..Self::default()
        };
    }
}

/// The system of the reference overlay in the schedule of a tick.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ReferenceSystems;

/// Adds the reference overlay; [`form`] draws it.
pub struct ReferenceOverlayPlugin;

impl Plugin for ReferenceOverlayPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Selection>()
            .add_message::<ReferenceCommand>()
            .add_systems(
                Update,
                (
                    carry_out.run_if(on_message::<ReferenceCommand>),
                    attend.run_if(resource_exists::<ReferenceOverlay>),
                )
                    .chain(),
            );
    }
}

fn carry_out(world: &mut World) {
    let commands: Vec<_> = world
        .resource_mut::<Messages<ReferenceCommand>>()
        .drain()
        .collect();
    for command in commands {
        match (command, world.contains_resource::<ReferenceOverlay>()) {
            (ReferenceCommand::Again, _) => {
                if let Some(mut reference_overlay) = world.get_resource_mut::<ReferenceOverlay>() {
                    reference_overlay.again();
                }
            }
            (ReferenceCommand::Toggle, false) => {
                world.init_resource::<ReferenceOverlay>();
                let observe = observe
                    .in_set(ReferenceSystems)
                    .after(StepSystems::Substeps)
                    .before(StepSystems::End);
                let mut schedules = world.resource_mut::<Schedules>();
                schedules.add_systems(StepSchedule, observe);
            }
            (ReferenceCommand::Toggle, true) => {
                world.remove_resource::<ReferenceOverlay>();
                world.resource_mut::<SimulationClock>().held = false;
                world.schedule_scope(StepSchedule, |world, schedule| {
                    // The set exists: its system was added with the reference overlay.
                    let _removed = schedule.remove_systems_in_set(
                        ReferenceSystems,
                        world,
                        ScheduleCleanupPolicy::RemoveSystemsOnly,
                    );
                });
            }
        }
    }
}

/// Once per frame: receives comparisons, starts the references if necessary, and holds the clock
/// while they are behind.
fn attend(world: &mut World) {
    let bodies = lasting_bodies(world);
    let scope = world.resource::<Selection>().0.clone();
    world.resource_scope(|world, mut reference_overlay: Mut<ReferenceOverlay>| {
        let comparisons = reference_overlay
            .follower
            .as_ref()
            .map(Follower::comparisons);
        for comparison in comparisons.into_iter().flatten() {
            if reference_overlay.compared().is_none() {
                reference_overlay.outset = comparison.distance.rms;
                reference_overlay.count = comparison.gaps.len();
            }
            reference_overlay.trail.push(comparison.distance);
            reference_overlay.compared.swap(0, 1);
            reference_overlay.compared[1] = Some(comparison);
        }
        let strange = scope != Scope::All
            && scope != reference_overlay.chosen
            && !reference_overlay.follows(&scope);
        if strange || reference_overlay.bodies != bodies {
            reference_overlay.again();
        }
        let mut clock = world.resource_mut::<SimulationClock>();
        // One tick may be pending: the references are stepped in parallel with the bodies.
        clock.held = reference_overlay.behind() > 1;
        let now = if clock.held { 1.0 } else { 0.0 };
        reference_overlay.held += (now - reference_overlay.held) * NOTICED;
        let between = !clock.mid_tick();
        if reference_overlay.follower.is_none() && reference_overlay.trouble.is_none() && between {
            begin(world, &mut reference_overlay);
        }
    });
}

impl ReferenceOverlay {
    fn follows(&self, scope: &Scope) -> bool {
        let gaps = self.compared().map(|comparison| &comparison.gaps);
        gaps.is_none_or(|gaps| {
            scope
                .keys()
                .all(|key| gaps.iter().any(|(body, _)| body.to_bits() == key))
        })
    }
}
