//! A body without Bevy: topology, particles and effects.

use crate::{
    Controls, Density, EffectStates, Effects, ForceKind, Mass, Particles, Settings, Stitches,
    Topology, VertexIndex,
    advance::{NotFinite, Solve, Stage, StepContext, Stepper},
    direct::DirectWorkspace,
    rest::{Calm, RestTimer, SleepSettings},
    step::{
        masses::{Masses, set_inverse_masses},
        renew::Attached,
    },
    topology::{Renewed, Torn},
};
use glam::Vec3;
use std::sync::Arc;

/// Cause of a divergence, for which the body was taken out of the simulation.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Quarantine {
    /// First non-finite particle, by its vertex of the rest shape.
    pub vertex: VertexIndex,
    /// Stage or effect that caused it.
    pub stage: &'static str,
}

impl Quarantine {
    /// [Stage](Self::stage) of a body with non-finite input.
    pub const INPUT: &str = "input";

    /// [Stage](Self::stage) of a body for whose divergence no stage of the solver was the cause.
    pub const USER: &str = "a user's system";

    /// [Stage](Self::stage) of a body with contact for whose divergence no stage of its own was the
    /// cause.
    pub const CONTACT: &str = "contact";

    /// The same for a body without contact that stitches join to another.
    pub const JOINTS: &str = "stitches";

    /// The cause, by the first non-finite vertex and the stage.
    #[must_use]
    pub const fn new(vertex: VertexIndex, stage: &'static str) -> Self {
        Self { vertex, stage }
    }
}

/// A soft body.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{Body, Density, RestShape, Topology, Volume};
/// use std::sync::Arc;
///
/// let shape = RestShape {
///     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z], // m
///     tetrahedra: vec![[0, 1, 2, 3]],
///     ..RestShape::default()
/// };
/// let topology = Arc::new(Topology::new(shape)?);
/// let mut body = Body::new("tetrahedron", topology, Density::of(1000.0)); // kg/m³
/// body.effects.volume = Some(Volume::default());
/// body.update_masses(); // after changes of density, added masses and pins
/// # Ok::<(), pliant_solver::TopologyError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name shown to users.
    pub name: String,
    /// The immutable part, shared between copies.
    pub topology: Arc<Topology>,
    /// The state.
    pub particles: Particles,
    /// Mass per measure.
    pub density: Density,
    /// Additional masses, by vertex of the rest shape.
    pub added_mass: Vec<(VertexIndex, Mass)>,
    /// Fixed vertices of the rest shape.
    pub pins: Vec<VertexIndex>,
    /// Effects of the body.
    pub effects: Effects,
    /// States of the effects.
    pub states: EffectStates,
    /// Its stitches, including broken ones.
    pub stitches: Stitches,
    /// Data of the direct solver, if it is used.
    pub direct: DirectWorkspace,
    /// What an app does to it; by default nothing. See [`control`](Self::control).
    pub controls: Option<Box<Controls>>,
    /// Duration of rest.
    pub rest: RestTimer,
    /// When it sleeps; by default as the [world](crate::World::sleep) says.
    pub sleep: Option<SleepSettings>,
    /// Whether the body sleeps.
    pub asleep: bool,
    /// Set when the body diverged.
    pub quarantine: Option<Quarantine>,
    /// State at the start of the tick; only positions before the first one.
    pub tick_start: Particles,
}

impl Body {
    /// A body at rest in its rest shape, without effects.
    #[must_use]
    pub fn new(name: impl Into<String>, topology: Arc<Topology>, density: Density) -> Self {
        let particles = Particles::at_rest(topology.rest.iter().copied());
        let mut body = Self {
            name: name.into(),
            tick_start: particles.only_positions(),
            particles,
            topology,
            density,
            added_mass: Vec::new(),
            pins: Vec::new(),
            effects: Effects::default(),
            states: EffectStates::default(),
            stitches: Stitches::default(),
            direct: DirectWorkspace::default(),
            controls: None,
            rest: RestTimer::default(),
            sleep: None,
            asleep: false,
            quarantine: None,
        };
        body.update_masses();
        body
    }

    /// Updates inverse masses from density, added masses and pins. Must be called after a change of
    /// these.
    pub fn update_masses(&mut self) {
        set_inverse_masses(
            &mut self.particles.positions,
            &self.topology,
            self.density,
            &self.added_mass,
            &self.pins,
        );
    }

    /// What an app does to it, to be set: forces, impulses, targets of pins, grabs.
    ///
    /// ```
    /// use glam::Vec3;
    /// use pliant_solver::{Body, Density, ExternalForce, RestShape, Topology};
    /// use std::sync::Arc;
    ///
    /// let shape = RestShape {
    ///     vertices: vec![Vec3::ZERO, Vec3::X], // m
    ///     edges: vec![[0, 1]],
    ///     ..RestShape::default()
    /// };
    /// let mut rope = Body::new("rope", Arc::new(Topology::new(shape)?), Density::of(0.1));
    /// rope.control().force = Some(ExternalForce::on_whole(Vec3::X * 2.0)); // N
    /// # Ok::<(), pliant_solver::TopologyError>(())
    /// ```
    pub fn control(&mut self) -> &mut Controls {
        self.controls.get_or_insert_default()
    }

    /// Moves the whole body by `offset` [m].
    pub fn translate(&mut self, offset: Vec3) {
        self.particles.translate(offset.as_dvec3());
        let start = &mut self.tick_start.positions;
        start.clone_from(&self.particles.positions);
    }

    /// Sets the velocity of every movable particle [m/s].
    pub fn set_velocity(&mut self, velocity: Vec3) {
        for i in 0..self.particles.len() {
            if self.particles.positions[i].w > 0.0 {
                self.particles.set_velocity(i, velocity);
            }
        }
    }

    /// Begins a tick: applies an impulse, puts a body with an input that is not sound into quarantine, allocates
    /// multipliers, and stores the state at the start. Multipliers of elastic effects are kept for measurements, or not.
    pub fn begin_tick(&mut self, keeps_multipliers: bool) {
        if self.is_active()
            && let Some(impulse) = self.controls.as_mut().and_then(|it| it.impulse.take())
        {
            impulse.apply(&mut self.particles);
        }
        if let Some(particle) = self.particles.first_unfit(self.topology.particles()) {
            self.particles.restore_at_rest(&self.tick_start.positions);
            self.quarantine = Some(Quarantine {
                vertex: self.topology.vertex(particle),
                stage: Quarantine::INPUT,
            });
        }
        self.stepper().prepare(keeps_multipliers);
        self.states.recorded.clear_forces();
        self.tick_start.clone_from(&self.particles);
    }

    /// Borrows the body for stepping.
    pub fn stepper(&mut self) -> Stepper<'_> {
        Stepper {
            topology: &mut self.topology,
            particles: &mut self.particles,
            effects: &self.effects,
            states: &mut self.states,
            stitches: &mut self.stitches,
            direct: &mut self.direct,
            controls: &mut self.controls,
        }
    }

    /// Puts a body that has diverged into quarantine, where it was at the start of the tick. The stage is
    /// `other` if none of the body caused it.
    pub(crate) fn fail(&mut self, error: NotFinite, other: &'static str, context: &StepContext) {
        self.quarantine = Some(self.find_cause(error, other, context));
        self.particles.restore_at_rest(&self.tick_start.positions);
        self.states.forget_contacts();
    }

    /// Tears the body where it is above its limits, at the end of a tick; returns what has become of
    /// its particles, if it was torn.
    pub fn tear(&mut self, settings: &Settings) -> Option<Torn> {
        self.split(|stepper, masses, start| stepper.tear(masses, start, settings))
    }

    /// Cuts the body between ticks; returns what has become of its particles, if the cut hit it.
    /// [`World::cut`](crate::World::cut) also updates stitches of other bodies to it.
    pub fn cut(&mut self, cut: &crate::Cut) -> Option<Torn> {
        self.split(|stepper, masses, start| stepper.cut(cut, masses, start))
    }

    fn split(
        &mut self,
        by: impl FnOnce(&mut Stepper, Masses, &mut Particles) -> Option<Torn>,
    ) -> Option<Torn> {
        let (mut start, added, pins) = (
            std::mem::take(&mut self.tick_start),
            std::mem::take(&mut self.added_mass),
            std::mem::take(&mut self.pins),
        );
        let masses = Masses {
            density: self.density,
            added: &added,
            pins: &pins,
        };
        let torn = by(&mut self.stepper(), masses, &mut start);
        (self.tick_start, self.added_mass, self.pins) = (start, added, pins);
        if let Some(torn) = &torn {
            if let Some(grab) = &mut self.effects.grab {
                grab.point = torn.point(&grab.point);
            }
            if let Some(controls) = &mut self.controls {
                controls.follow(|point| Some(torn.point(point)));
            }
        }
        torn
    }

    /// Adds and removes grains at the end of a tick; returns what has become of the particles, if
    /// there were any changes.
    pub fn renew(&mut self, settings: &Settings) -> Option<Renewed> {
        let (mut start, mut added, mut pins) = (
            std::mem::take(&mut self.tick_start),
            std::mem::take(&mut self.added_mass),
            std::mem::take(&mut self.pins),
        );
        let (density, attached) = (
            self.density,
            Attached {
                added: &mut added,
                pins: &mut pins,
            },
        );
        let mut stepper = self.stepper();
        let renewed = stepper.renew(density, attached, &mut start, settings);
        (self.tick_start, self.added_mass, self.pins) = (start, added, pins);
        if let Some(renewed) = &renewed {
            if let Some(grab) = &mut self.effects.grab {
                match renewed.point(&grab.point) {
                    Some(point) => grab.point = point,
                    None => self.effects.grab = None,
                }
            }
            if let Some(controls) = &mut self.controls {
                controls.follow(|point| renewed.point(point));
            }
        }
        renewed
    }

    /// Whether the body has been at rest for long enough to sleep, at the end of a tick of `seconds` under
    /// gravity [m/s²], in a world with these settings.
    pub(crate) fn is_still(
        &mut self,
        seconds: f64,
        gravity: Vec3,
        settings: &SleepSettings,
    ) -> bool {
        let is_held = self.controls.as_ref().is_some_and(|it| it.hold_awake());
        if self.effects.grab.is_some() || is_held {
            self.rest.reset();
            return false;
        }
        let emitter = self.effects.emitter;
        let turns = self.effects.rod.is_some_and(|rod| rod.turns());
        if turns || emitter.is_some_and(|it| it.is_active(self.particles.len())) {
            self.rest.reset();
            return false;
        }
        let positions = (
            &self.tick_start.positions[..],
            &self.particles.positions[..],
        );
        let calm = Calm {
            topology: &self.topology,
            effects: &self.effects,
            is_touched: self.states.is_touched,
            gravity: gravity.length(),
        };
        let pace = (seconds as f32, gravity.length());
        let calm = |speed| calm.holds(positions, pace.0, speed);
        let settings = self.sleep.as_ref().unwrap_or(settings);
        self.rest.observe(positions, pace, calm, settings)
    }

    /// Puts the body to sleep.
    pub fn fall_asleep(&mut self) {
        self.asleep = true;
        self.particles.stop();
        self.tick_start.clone_from(&self.particles);
    }

    /// Wakes the body.
    pub fn wake(&mut self) {
        self.asleep = false;
        self.rest.reset();
    }

    /// Repeats a failed tick up to the failing substep, and that one stage by stage, to identify
    /// the first particle and the stage. Returns the particle of the error and the `other` stage if
    /// none of them caused it.
    fn find_cause(
        &self,
        error: NotFinite,
        other: &'static str,
        context: &StepContext,
    ) -> Quarantine {
        let mut replay = self.clone();
        replay.particles.clone_from(&self.tick_start);
        replay.stepper().prepare(true);
        let diverged_after = |stage, body: &Self| {
            body.particles
                .first_not_finite()
                .map(|particle| Quarantine {
                    vertex: body.topology.vertex(particle),
                    stage,
                })
        };
        let step = context.settings.substep(error.substep);
        // Stitches that broke and plastic flow in the tick are present from its start: the repeated
        // substep may differ.
        let earlier = 0..error.substep;
        if earlier.is_empty() || replay.stepper().advance(earlier, context).is_ok() {
            let mut stepper = replay.stepper();
            stepper.begin(&step, context);
            let forces = ForceKind::ALL.map(Stage::Force);
            for stage in std::iter::once(Stage::External).chain(forces) {
                // Only the last stage checks for non-finite values.
                let _ = replay.stepper().stage(stage, &step, 0, context);
                if let Some(found) = diverged_after(stage.name(), &replay) {
                    return found;
                }
            }
            for stage in std::iter::once(Stage::Presolve).chain(Stage::prediction()) {
                let _ = replay.stepper().stage(stage, &step, 0, context);
                if let Some(found) = diverged_after(stage.name(), &replay) {
                    return found;
                }
            }
            let outside = replay.stepper().outside();
            let solve = Solve::of(&self.effects, outside, step.method);
            for (stage, iteration) in solve.stages(step) {
                let _ = replay.stepper().stage(stage, &step, iteration, context);
                if let Some(found) = diverged_after(stage.name(), &replay) {
                    return found;
                }
            }
        }
        Quarantine {
            vertex: self.topology.vertex(error.particle),
            stage: other,
        }
    }

    /// The bodies that are in two states of a scene, by their names; equal names in order. Emitters
    /// and sinks add and remove bodies.
    #[must_use]
    pub fn in_both<'a>(one: &'a [Self], other: &'a [Self]) -> Vec<(&'a Self, &'a Self)> {
        let mut later = other;
        let pairs = one.iter().filter_map(|body| {
            let place = later.iter().position(|it| it.name == body.name)?;
            let found = &later[place];
            later = &later[place + 1..];
            Some((body, found))
        });
        pairs.collect()
    }
}
