//! The f64 reference: the whole method again, in scalar f64, as plain as a page of a textbook.
//!
//! No colors, no lanes, no threads, no care for speed. Errors of the fast solver are measured
//! against it, and each of its kernels is tested against it. It takes rest values, masses and the
//! order of constraints from the fast bodies, so that both solve the same equations.
//!
//! **Independent** of the fast solver are the three stages, the projection of constraints with multipliers and damping,
//! averaged passes, the ground, colliders, stitches, hands and second-order steps.
//!
//! **Shared** with it are the equations of elastic effects ([rows](crate::elastic::Elastic::rows), which kernels do not
//! use), forces, where a grab is, shape matching, what pressure knows of its walls, the nearest pins of tethers, poses of colliders,
//! contacts between bodies, and repair. An error in these shows in both alike, so that they are tested against finite differences and closed
//! forms.

mod elastic;
mod motion;

use crate::{
    Contacts, Effects, ElasticKind, Repair, Settings, Stitches, Substep, Topology,
    contact::{Collider, pairs::Between},
    effects::{
        body_effect::{BodyPhase, ReferenceParticles, ReferencePass},
        body_kinds::{BodyEffectKind, ReferenceStates},
    },
    force::Moment,
    method::Averaging,
    step::together::are_needed,
};
use glam::DVec3;
use std::sync::Arc;

/// Bodies and colliders in f64.
#[derive(Debug, Clone)]
pub struct World {
    /// Gravity, rate, substeps, iterations.
    pub settings: Settings,
    /// The bodies.
    pub bodies: Vec<Body>,
    /// The colliders.
    pub colliders: Vec<Collider>,
    /// Time since the start [s].
    pub time: f64,
    /// Whether each substep begins with the multipliers that the last one ended with, and with what
    /// they pull, instead of with none; not by default. Where such a world rests, C + αλ/h² = 0 and
    /// forces balance, however few the sweeps: the equilibrium of the equations, not of the solver.
    pub keeps_multipliers: bool,
    /// Contacts between bodies.
    contacts: Contacts,
}

/// A body in f64.
#[derive(Debug, Clone)]
pub struct Body {
    /// Constraints, rest values and rest positions.
    pub topology: Arc<Topology>,
    /// Positions x [m].
    pub x: Vec<DVec3>,
    /// Positions at the start of the substep p [m]; a bounce lowers them.
    pub p: Vec<DVec3>,
    /// The same as they were before any bounce [m].
    from: Vec<DVec3>,
    /// Velocities v [m/s].
    pub v: Vec<DVec3>,
    /// Inverse masses w [1/kg], 0 for pins.
    pub w: Vec<f64>,
    /// The effects that it carries, but for stitches.
    pub effects: Effects,
    /// What is kept of those without elements, and the stitches.
    states: ReferenceStates,
    /// λ of the constraints of each elastic effect; empty before the first sweep.
    pub lambdas: [Vec<f64>; ElasticKind::COUNT],
    /// What of it is under repair.
    repair: Repair,
    /// What [steps of second order](crate::history) need of the substep before.
    past: Past,
    /// Length of the substep under way as implicit Euler has it [s].
    h: f64,
    /// Angular momentum that is to be kept in it, if it is [kg·m²/s].
    spin: Option<DVec3>,
}

/// What a body was one substep ago.
#[derive(Debug, Clone, Default)]
struct Past {
    /// Positions and velocities then; none at first.
    state: Option<(Vec<DVec3>, Vec<DVec3>)>,
    /// Length of that substep as implicit Euler has it [s].
    seconds: f64,
    /// Length of a substep [s].
    h: f64,
    /// Whether something was touched in it.
    touched: bool,
}

/// A sweep over the constraints of elastic effects.
#[derive(Clone, Copy)]
struct Pass {
    /// Length of the substep that compliance and damping are taken for [s].
    h: f64,
    /// Whether multipliers begin anew.
    first: bool,
    /// How much of its way a constraint goes.
    share: f64,
    /// How ways are averaged, if they are.
    averaging: Option<Averaging>,
}

impl World {
    /// The same world in f64. Sleep and quarantine are left out: all bodies are always stepped.
    #[must_use]
    pub fn of(world: &crate::World) -> Self {
        Self {
            settings: world.settings,
            bodies: world.bodies.iter().map(Body::of).collect(),
            colliders: world.colliders.clone(),
            time: world.time,
            keeps_multipliers: false,
            contacts: Contacts::default(),
        }
    }

    /// Moves particles until what is stiff for a substep is satisfied, and leaves velocities alone.
    ///
    /// A solver that does too little leaves rigid constraints violated. One with smaller steps that
    /// goes on from there would close them in its first step, h, and make a speed of C/h of it.
    pub fn project(&mut self, sweeps: u32) {
        let h = self.settings.substep_seconds();
        for body in &mut self.bodies {
            body.p.clone_from(&body.x);
            let compliant = self.settings.method.compliant_seconds(h);
            for _ in 0..sweeps {
                body.solve_elastic(compliant, true);
                body.solve_effect(
                    BodyEffectKind::Tethers,
                    &ReferencePass::alone(compliant, true),
                );
                // What is below the ground by as little as this is thrown out of it as fast.
                for (x, w) in body.x.iter_mut().zip(&body.w) {
                    if let Some(ground) = body.effects.ground
                        && *w > 0.0
                    {
                        x.y = x.y.max(ground.height.into());
                    }
                }
            }
            body.p.clone_from(&body.x);
        }
    }

    /// A tick of 1/rate seconds.
    pub fn tick(&mut self) {
        let substeps = self.settings.substeps.get();
        for index in 0..substeps {
            self.substep(&self.settings.substep(index));
        }
        for grab in self
            .bodies
            .iter_mut()
            .filter_map(|body| body.effects.grab.as_mut())
        {
            grab.from = grab.target;
        }
        self.time += self.settings.tick_seconds();
    }
}

impl World {
    fn substep(&mut self, step: &Substep) {
        let Self {
            settings,
            bodies,
            colliders,
            time,
            keeps_multipliers,
            contacts,
        } = self;
        let whole = settings.substep_seconds();
        let gravity = settings.gravity.as_dvec3();
        let start = *time + whole * f64::from(step.index);
        let end = start + whole;
        let colliders: Vec<_> = colliders
            .iter()
            .map(|it| (it.shape, it.pose_at(start), it.pose_at(end)))
            .collect();
        for body in &mut *bodies {
            body.h = whole;
        }
        let touch = are_needed(bodies.iter().map(|body| (&body.effects, true)));
        if touch {
            contacts.begin(bodies, step);
        }
        let pass = |h: f64, iteration: u32| ReferencePass {
            colliders: &colliders,
            gravity,
            h,
            compliant: step.method.compliant_seconds(h),
            share: step.method.share().into(),
            substep: (step.index, step.count),
            iteration: (iteration, step.sweeps()),
            is_anew: iteration == 0 && !*keeps_multipliers,
        };
        for (place, body) in bodies.iter_mut().enumerate() {
            let is_near = touch && contacts.is_near(place);
            if step.index == 0 {
                body.look_for_damage(settings);
            }
            body.draw(whole);
            body.h = if settings.order.get() == 2 && !*keeps_multipliers {
                body.look_back(whole, gravity, is_near, &colliders)
            } else {
                whole
            };
            let h = body.h;
            body.spin = body.spin(settings);
            body.push_by_forces(Moment { time: start, h });
            if let Some(kept) = step.method.keeps_speed() {
                for v in &mut body.v {
                    *v = (*v + gravity * h) * f64::from(kept) - gravity * h;
                }
            }
            body.presolve(h, gravity);
            body.solve_effects(BodyPhase::Prediction, &pass(h, 0));
            if *keeps_multipliers && !step.method.is_rigid() {
                body.pull();
            }
        }
        for iteration in 0..step.sweeps() {
            for body in &mut *bodies {
                let pass = pass(body.h, iteration);
                body.sweep(step, pass.compliant, iteration, pass.is_anew);
                body.solve_effects(BodyPhase::Iteration, &pass);
                body.solve_effects(BodyPhase::IterationEnd, &pass);
            }
            for _ in 0..step.contacts_after(iteration) {
                if touch {
                    contacts.solve(bodies, Between::Bodies);
                    contacts.solve(bodies, Between::Itself);
                }
                for body in &mut *bodies {
                    let pass = pass(body.h, iteration);
                    body.solve_effects(BodyPhase::Contact, &pass);
                }
            }
        }
        if touch {
            contacts.truncate(bodies, step);
        }
        for body in &mut *bodies {
            let h = body.h;
            body.postsolve(h);
            let spin = body.spin.take();
            if let Some(spin) = spin.filter(|_| !body.past.touched) {
                body.turn_to(spin);
            }
            body.resist_rolling(h);
            body.stiffen();
            body.flow(start + h, h);
        }
        if touch {
            contacts.end(bodies, step);
        }
    }
}

impl Body {
    /// The same body in f64.
    #[must_use]
    pub fn of(body: &crate::Body) -> Self {
        let particles = &body.particles;
        let each = 0..particles.len();
        let mut own = Self {
            topology: Arc::clone(&body.topology),
            x: each.clone().map(|i| particles.position(i)).collect(),
            p: each
                .clone()
                .map(|i| particles.position(i) - particles.motion(i))
                .collect(),
            from: each.clone().map(|i| particles.position(i)).collect(),
            v: each.map(|i| particles.velocity_f64(i)).collect(),
            w: body
                .particles
                .positions
                .iter()
                .map(|x| f64::from(x.w))
                .collect(),
            effects: Effects::default(),
            states: ReferenceStates {
                stitches: (body.stitches.clone(), Vec::new()),
                ..ReferenceStates::default()
            },
            lambdas: Default::default(),
            repair: Repair::default(),
            past: Past::default(),
            h: 0.0,
            spin: None,
        };
        own.carry(&body.effects);
        own
    }

    /// Carries these effects from now on, and no others.
    pub fn carry(&mut self, effects: &Effects) {
        self.effects = *effects;
        self.states
            .prepare(effects, &self.topology, &self.x, &self.w);
    }

    /// Its stitches, broken ones too.
    #[must_use]
    pub fn stitches(&self) -> &Stitches {
        &self.states.stitches.0
    }

    /// A pass of all effects without elements that act in a phase.
    fn solve_effects(&mut self, phase: BodyPhase, pass: &ReferencePass) {
        for &kind in BodyEffectKind::ALL {
            if kind.phase() == phase {
                self.solve_effect(kind, pass);
            }
        }
    }

    /// A pass of one of them.
    fn solve_effect(&mut self, kind: BodyEffectKind, pass: &ReferencePass) {
        let effects = self.effects;
        let (states, particles) = self.split();
        states.solve((&effects, kind), particles, pass);
    }

    /// What effects without elements keep, and the particles as they have them.
    fn split(&mut self) -> (&mut ReferenceStates, ReferenceParticles<'_>) {
        let particles = ReferenceParticles {
            topology: &self.topology,
            x: &mut self.x,
            p: &mut self.p,
            from: &self.from,
            w: &self.w,
            touched: &mut self.past.touched,
        };
        (&mut self.states, particles)
    }
}

impl ReferencePass<'_> {
    /// The only pass of a substep of `h` seconds, without colliders, and without gravity.
    fn alone(h: f64, is_anew: bool) -> Self {
        Self {
            colliders: &[],
            gravity: DVec3::ZERO,
            h,
            compliant: h,
            share: 1.0,
            substep: (0, 1),
            iteration: (0, 1),
            is_anew,
        }
    }
}
