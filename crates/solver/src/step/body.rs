//! A body without Bevy: topology, particles, and the effects that it carries.

use crate::{
    Density, EffectStates, Effects, Factors, ForceKind, Mass, Particles, Stitches, Topology,
    VertexIndex,
    advance::{NotFinite, Solve, Stage, StepContext, Stepper},
    rest::RestTimer,
};
use glam::{Vec3, Vec4};
use std::sync::Arc;

/// Where a body went wrong, so that it was taken out of the simulation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quarantine {
    /// The first particle that was not finite, by its vertex of the rest shape.
    pub vertex: VertexIndex,
    /// The stage or effect that made it so.
    pub stage: &'static str,
}

/// The stage of a [`Quarantine`] whose body was given what is not finite.
pub const INPUT: &str = "input";

/// The stage of a [`Quarantine`] that none of the solver's own made.
pub const USER: &str = "a user's system";

/// The stage of a [`Quarantine`] that none of the body's own made, of a body that touches others or itself.
pub const CONTACT: &str = "contact";

/// A soft body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// What users call it.
    pub name: String,
    /// The immutable part, shared with its copies.
    pub topology: Arc<Topology>,
    /// The state.
    pub particles: Particles,
    /// Mass per measure.
    pub density: Density,
    /// Masses on top of that, by vertex of the rest shape.
    pub added_mass: Vec<(VertexIndex, Mass)>,
    /// Vertices of the rest shape that do not move.
    pub pins: Vec<VertexIndex>,
    /// What the body does.
    pub effects: Effects,
    /// What they keep.
    pub states: EffectStates,
    /// Its stitches, broken ones too.
    pub stitches: Stitches,
    /// What it is solved with directly, if it is.
    pub factors: Factors,
    /// How long it has been still.
    pub rest: RestTimer,
    /// Whether it sleeps.
    pub asleep: bool,
    /// Set when the body turned non-finite.
    pub quarantine: Option<Quarantine>,
    /// The state at the start of the tick; nothing but positions before the first.
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
            factors: Factors::default(),
            rest: RestTimer::default(),
            asleep: false,
            quarantine: None,
        };
        body.update_masses();
        body
    }

    /// Brings inverse masses in line with density, added masses and pins. To be called after one
    /// of them was changed.
    pub fn update_masses(&mut self) {
        set_inverse_masses(
            &mut self.particles.positions,
            &self.topology,
            self.density,
            &self.added_mass,
            &self.pins,
        );
    }

    /// Moves the whole body by `offset` [m].
    pub fn translate(&mut self, offset: Vec3) {
        self.particles.translate(offset.as_dvec3());
        let start = &mut self.tick_start.positions;
        start.clone_from(&self.particles.positions);
    }

    /// Gives every particle that can move the same velocity [m/s].
    pub fn set_velocity(&mut self, velocity: Vec3) {
        for i in 0..self.particles.len() {
            if self.particles.positions[i].w > 0.0 {
                self.particles.set_velocity(i, velocity);
            }
        }
    }

    /// Starts a tick: makes room for multipliers, looks at the input, and remembers positions.
    pub fn begin_tick(&mut self) {
        if let Some(particle) = self.particles.first_not_finite() {
            freeze(&mut self.particles, &self.tick_start.positions);
            self.quarantine = Some(Quarantine {
                vertex: self.topology.vertex(particle),
                stage: INPUT,
            });
        }
        self.stepper().prepare(true);
        self.tick_start.clone_from(&self.particles);
    }

    /// The body as it is stepped.
    pub fn stepper(&mut self) -> Stepper<'_> {
        Stepper {
            topology: &mut self.topology,
            particles: &mut self.particles,
            effects: &self.effects,
            states: &mut self.states,
            stitches: &mut self.stitches,
            factors: &mut self.factors,
        }
    }

    /// All substeps of a tick. A body that is no longer finite is frozen where the tick began: what
    /// the substeps before the bad one made is finite, but as a rule already torn apart.
    pub fn advance(&mut self, context: &StepContext) {
        let substeps = 0..context.settings.substeps.get();
        if let Err(error) = self.stepper().advance(substeps, context) {
            self.quarantine = Some(self.find_cause(error, USER, context));
            freeze(&mut self.particles, &self.tick_start.positions);
        }
    }

    /// Ends a tick of `seconds` under gravity [m/s²]; true if the body has been still for long enough to sleep.
    pub fn end_tick(
        &mut self,
        seconds: f64,
        gravity: Vec3,
        settings: &crate::rest::SleepSettings,
    ) -> bool {
        if let Some(grab) = &mut self.effects.grab {
            self.rest.reset();
            grab.from = grab.target;
            return false;
        }
        let ways = (
            &self.tick_start.positions[..],
            &self.particles.positions[..],
        );
        self.rest
            .observe(ways, seconds as f32, gravity.length(), settings)
    }

    /// Falls asleep.
    pub fn fall_asleep(&mut self) {
        self.asleep = true;
        self.particles.stop();
        self.tick_start.clone_from(&self.particles);
    }

    /// Wakes.
    pub fn wake(&mut self) {
        self.asleep = false;
        self.rest.reset();
    }

    /// Does a tick that went wrong again up to the substep in which it did, and that stage by stage, to
    /// name the first particle and the stage that did it; the particle of the error, and the `other` stage, if it was
    /// none of them.
    #[must_use]
    pub fn find_cause(
        &self,
        error: NotFinite,
        other: &'static str,
        context: &StepContext,
    ) -> Quarantine {
        let mut again = self.clone();
        again.particles.clone_from(&self.tick_start);
        again.stepper().prepare(true);
        let spoilt_by = |stage, body: &Self| {
            body.particles
                .first_not_finite()
                .map(|particle| Quarantine {
                    vertex: body.topology.vertex(particle),
                    stage,
                })
        };
        let step = context.settings.substep(error.substep);
        // What was broken or flowed in the tick is so from its start: the same substep need not come
        // out to the bit.
        if again.stepper().advance(0..error.substep, context).is_ok() {
            let mut stepper = again.stepper();
            stepper.begin(&step, context);
            for kind in ForceKind::ALL {
                let stage = Stage::Force(kind);
                // Only the last stage looks for what is not finite.
                let _ = again.stepper().stage(stage, &step, 0, context);
                if let Some(found) = spoilt_by(stage.name(), &again) {
                    return found;
                }
            }
            let _ = again.stepper().stage(Stage::Presolve, &step, 0, context);
            if let Some(found) = spoilt_by(Stage::Presolve.name(), &again) {
                return found;
            }
            let solve = Solve::of(&self.effects, !self.stitches.is_empty(), step.method);
            for (stage, iteration) in solve.stages(step) {
                let _ = again.stepper().stage(stage, &step, iteration, context);
                if let Some(found) = spoilt_by(stage.name(), &again) {
                    return found;
                }
            }
        }
        Quarantine {
            vertex: self.topology.vertex(error.particle),
            stage: other,
        }
    }
}

/// Puts particles back to a state that was finite, at rest.
pub fn freeze(particles: &mut Particles, finite: &[Vec4]) {
    particles.positions.copy_from_slice(finite);
    particles.settle();
}

/// Writes 1/m into w: mass from density and added masses [kg], 0 for pins and for particles that
/// no element gives a mass.
pub fn set_inverse_masses(
    positions: &mut [Vec4],
    topology: &Topology,
    density: Density,
    added: &[(VertexIndex, Mass)],
    pins: &[VertexIndex],
) {
    for (x, measure) in positions.iter_mut().zip(topology.measure()) {
        x.w = measure * density.get();
    }
    for &(vertex, mass) in added {
        if let Some(x) = positions.get_mut(topology.particle(vertex)) {
            x.w += mass.get();
        }
    }
    for x in positions.iter_mut() {
        let inverse = 1.0 / x.w;
        x.w = if inverse.is_finite() { inverse } else { 0.0 };
    }
    for &pin in pins {
        if let Some(x) = positions.get_mut(topology.particle(pin)) {
            x.w = 0.0;
        }
    }
}
