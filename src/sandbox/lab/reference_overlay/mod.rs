//! The reference overlay: beside each running body its reference in double precision with smaller substeps, under
//! the same hand, colliders and settings, and how far the two are from each other.
//!
//! References live on a thread of their own ([`Follower`]). After each tick it is told what was in force
//! in that tick and where the bodies are; it takes the reference overlays through the same tick, and tells how
//! far from the bodies they come out. So bodies and reference overlays are only ever compared at the same tick.
//! Where the thread does not keep pace the clock is [held](SimulationClock::held) until it has
//! caught up: time goes slower, and no frame waits.
//!
//! While there is no reference overlay there is no [`ReferenceOverlay`], no thread, and no system in the schedule of a
//! tick.

pub mod bodies;
pub mod distance;
mod follow;
pub mod form;
pub mod pace;
mod ticks;

pub use follow::Follower;

use crate::{
    sandbox::state::selection::{Scope, Selection},
    simulation::{SimulationClock, StepSchedule, StepSystems, plain::bodies_in_order},
};
use bevy::{ecs::schedule::ScheduleCleanupPolicy, prelude::*};
use bodies::{Comparison, Moment};
use distance::Trail;
use std::sync::Arc;
use ticks::{begin, observe};

/// What is asked of the reference overlay.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceCommand {
    /// Let there be one, or none.
    Toggle,
    /// Begin again from where the bodies are now.
    Again,
}

/// The reference overlays that there are.
#[derive(Resource, Debug, Default)]
pub struct ReferenceOverlay {
    follower: Option<Follower>,
    /// All bodies when the reference overlays began, so that it is noticed when some come or go.
    bodies: Vec<Entity>,
    /// The bodies that could have had a reference overlay.
    asked: usize,
    /// The body that was shown alone when the reference overlays began, if one was.
    chosen: Scope,
    /// The tick at which they began.
    began: u64,
    /// What was sent last.
    sent: Option<Arc<Moment>>,
    /// The comparison before the last, and the last.
    compared: [Option<Comparison>; 2],
    /// How many reference overlays began.
    count: usize,
    /// Root mean square distance at which they began [m].
    outset: f64,
    trail: Trail,
    /// Share of the last frames in which ticks were held.
    held: f32,
    /// Why there is none although one is wanted.
    trouble: Option<String>,
}

/// How quickly it is noticed that frames are held, and forgotten: a share of each frame.
const NOTICED: f32 = 0.05;

impl ReferenceOverlay {
    /// The last comparison.
    #[must_use]
    pub fn compared(&self) -> Option<&Comparison> {
        self.compared[1].as_ref()
    }

    /// Distances over the last ticks.
    #[must_use]
    pub fn trail(&self) -> &Trail {
        &self.trail
    }

    /// How many bodies had a reference overlay when they began, and how many could have had one.
    #[must_use]
    pub const fn bodies(&self) -> (usize, usize) {
        (self.count, self.asked)
    }

    /// Root mean square distance from the bodies at which they began [m].
    #[must_use]
    pub const fn outset(&self) -> f64 {
        self.outset
    }

    /// Why there is none, if something went wrong.
    #[must_use]
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Whether bodies wait for their reference overlays, so that time goes slower.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.held > 0.2
    }

    /// How far each particle's reference overlay is from it [m], a `share` of the way from the last tick but
    /// one to the last; nothing if the body has no reference overlay.
    pub fn gaps(&self, body: Entity, share: f32) -> Option<impl Iterator<Item = Vec3>> {
        let [before, now] = self.compared.each_ref().map(|comparison| {
            let mut gaps = comparison.as_ref()?.gaps.iter();
            gaps.find(|(other, _)| *other == body).map(|(_, gap)| gap)
        });
        let now = now?;
        let before = before.unwrap_or(now);
        Some(before.iter().zip(now).map(move |(a, b)| a.lerp(*b, share)))
    }

    /// Ticks that the bodies have done and the reference overlays have not.
    fn behind(&self) -> u64 {
        let sent = self.sent.as_ref().map_or(self.began, |moment| moment.tick);
        let done = self
            .compared()
            .map_or(self.began, |comparison| comparison.tick);
        sent.saturating_sub(done)
    }

    /// Forgets what there is, so that it begins anew.
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

/// Lets there be reference overlays; [`form`] draws them.
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
                    // The set is there: its system came with the reference overlay.
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

/// Once a frame: hears of the reference overlays, begins them where they are to begin, and holds the clock
/// while they are behind.
fn attend(world: &mut World) {
    let bodies = bodies_in_order(world);
    let scope = world.resource::<Selection>().0;
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
        let strange = match scope {
            Scope::Body(_) if scope != reference_overlay.chosen => {
                !reference_overlay.follows(scope)
            }
            _ => false,
        };
        if strange || reference_overlay.bodies != bodies {
            reference_overlay.again();
        }
        let mut clock = world.resource_mut::<SimulationClock>();
        // One tick may be under way: the reference overlays' thread works while the bodies' does.
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
    fn follows(&self, scope: Scope) -> bool {
        let gaps = self.compared().map(|comparison| &comparison.gaps);
        gaps.is_none_or(|gaps| {
            gaps.iter()
                .any(|(body, _)| scope == Scope::Body(body.to_bits()))
        })
    }
}
