//! The f64 reference: the whole method in plain scalar f64.
//!
//! No colors, no lanes, no threads, no optimization. Errors of the fast solver are measured against
//! it, and each kernel is tested against it. Rest values, masses and the order of constraints are
//! taken from the fast bodies, so that both solve the same equations.
//!
//! **Independent** of the fast solver are the three stages, the projection of constraints with
//! multipliers and damping, averaged passes, the ground, colliders, stitches, grabs and
//! second-order steps.
//!
//! **Shared** with it are the equations of elastic effects ([rows](crate::elastic::Elastic::rows),
//! which kernels do not use), forces, positions of grabs, shape matching, volume and gradients for
//! pressure, the nearest pins of tethers, poses of colliders, contacts and stitches between bodies, and repair.
//! An error in these affects both equally, so they are tested against finite differences and closed
//! forms.

mod controls;
mod elastic;
mod emission;
mod motion;
mod renew;
mod tear;

use crate::{
    Collider, Contacts, Controls, Effects, ElasticKind, Emission, Grabs, Grains, RodState,
    SegmentState, Settings, Stitches, Substep, Threads, Topology,
    colliders::inside::WayOut,
    contact::Between,
    effects::{
        body_effect::{BodyPhase, ReferenceParticles, ReferencePass},
        body_kinds::{BodyEffectKind, ReferenceStates},
        grab::ReferenceGrab,
    },
    force::Moment,
    layout::order::Direction,
    method::Averaging,
    repair::Repair,
    step::{
        joints::{self, Joined},
        together::must_step_together,
    },
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
    /// Whether each substep starts with the multipliers of the previous one, applied to the
    /// particles, instead of zero; default false. When such a world is at rest, C + αλ/h² = 0 and
    /// forces balance, however few the iterations: this is the equilibrium of the equations, not of
    /// the solver.
    pub keeps_multipliers: bool,
    /// Contacts between bodies.
    contacts: Contacts,
}

/// A body in f64.
#[derive(Debug, Clone)]
pub struct Body {
    /// Number of the body in its world, from 0.
    number: u32,
    /// Constraints, rest values and rest positions.
    pub topology: Arc<Topology>,
    /// Positions x [m].
    pub x: Vec<DVec3>,
    /// Positions at the start of the substep p [m]; restitution lowers them.
    pub p: Vec<DVec3>,
    /// Positions at the start of the substep without restitution [m].
    from: Vec<DVec3>,
    /// Velocities v [m/s].
    pub v: Vec<DVec3>,
    /// Inverse masses w [1/kg], 0 for pins.
    pub w: Vec<f64>,
    /// Radius times angular velocity of grains that rotate [m/s]; empty for others.
    pub spins: Vec<DVec3>,
    /// Effects of the body, except stitches.
    pub effects: Effects,
    /// What an app does to it.
    pub controls: Controls,
    /// State of the grabs of an app.
    grab_states: Vec<ReferenceGrab>,
    /// State of effects without elements, and the stitches.
    states: ReferenceStates,
    /// λ of the constraints of each elastic effect; empty before the first iteration.
    pub lambdas: [Vec<f64>; ElasticKind::COUNT],
    /// What determines its masses.
    masses: tear::Masses,
    /// What its emitter has emitted.
    emission: Emission,
    /// The sides to which it leaves colliders that it began the tick in.
    sides: Vec<WayOut>,
    /// The parts that keep their angular momentum in the tick.
    free_parts: Vec<Vec<u32>>,
    /// Repair state.
    repair: Repair,
    /// State of the previous substep for [second-order steps](crate::History).
    past: Past,
    /// Length of the current substep for implicit Euler [s].
    h: f64,
}

/// State of a body one substep ago.
#[derive(Debug, Clone, Default)]
struct Past {
    /// Its positions and velocities; `None` at first.
    state: Option<(Vec<DVec3>, Vec<DVec3>)>,
    /// Length of that substep for implicit Euler [s].
    seconds: f64,
    /// Length of a substep [s].
    h: f64,
    /// Whether the body touched something in it.
    touched: bool,
}

/// An iteration over the constraints of elastic effects.
#[derive(Clone, Copy)]
struct Pass {
    /// Length of the substep for compliance and damping [s].
    h: f64,
    /// Whether multipliers start at zero.
    first: bool,
    /// Direction in which it goes through the constraints.
    direction: Direction,
    /// Fraction of the correction that constraints apply.
    relaxation: f64,
    /// Averaging of corrections, if any.
    averaging: Option<Averaging>,
}

impl World {
    /// The same world in f64. Sleeping and quarantine are left out: all bodies are always stepped.
    #[must_use]
    pub fn of(world: &crate::World) -> Self {
        Self {
            settings: world.settings,
            bodies: (0..)
                .zip(&world.bodies)
                .map(|(number, body)| Body {
                    number,
                    ..Body::of(body)
                })
                .collect(),
            colliders: world.colliders.clone(),
            time: world.time,
            keeps_multipliers: false,
            contacts: Contacts::default(),
        }
    }

    /// Moves particles until constraints that are stiff on the scale of a substep are satisfied,
    /// without changing velocities.
    ///
    /// A solver with low accuracy leaves rigid constraints violated. A solver with smaller steps h
    /// that continues from there would close them in its first step, with a velocity of C/h.
    pub fn project(&mut self, iterations: u32) {
        let h = self.settings.substep_seconds();
        for body in &mut self.bodies {
            body.p.clone_from(&body.x);
            let compliant = self.settings.method.compliant_seconds(h);
            for _ in 0..iterations {
                body.solve_elastic(compliant, true);
                body.solve_effect(
                    BodyEffectKind::Tethers,
                    &ReferencePass::alone(compliant, true),
                );
                // Even such a small depth below the ground would be corrected with the same
                // velocity.
                for (x, w) in body.x.iter_mut().zip(&body.w) {
                    if let Some(ground) = body.effects.ground
                        && *w > 0.0
                    {
                        x.y = x.y.max(ground.height.get().into());
                    }
                }
            }
            body.p.clone_from(&body.x);
        }
    }

    /// A tick of 1/rate seconds.
    pub fn tick(&mut self) {
        let substeps = self.settings.substeps.get();
        self.contacts.begin_tick();
        self.bodies.iter_mut().for_each(Body::strike);
        for index in 0..substeps {
            self.substep(&self.settings.substep(index));
        }
        for place in 0..self.bodies.len() {
            let torn = self.bodies[place].tear(&self.settings);
            let renewed = self.bodies[place].renew(&self.settings);
            let all = self.bodies.iter_mut();
            let all = all.map(|body| &mut body.states.stitches.0);
            joints::follow(all, place as u32, torn.as_ref(), renewed.as_ref());
        }
        let seconds = self.settings.tick_seconds() as f32;
        for body in &mut self.bodies {
            let grabs = body.controls.grabs.iter_mut().flat_map(Grabs::iter_mut);
            for grab in grabs.chain(&mut body.effects.grab) {
                grab.end_tick(None, seconds);
            }
        }
        self.emit();
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
        let colliders: Vec<_> = colliders.iter().map(|it| it.sweep(start, end)).collect();
        let has_meshes = colliders.iter().any(|it| it.shape.mesh().is_some());
        for body in &mut *bodies {
            body.h = whole;
        }
        let of_bodies = bodies.iter().map(|body| (body.number, body.stitches()));
        let joined = Joined::of(of_bodies, bodies.len());
        let effects = bodies.iter().map(|body| (&body.effects, true));
        let touch = must_step_together(effects, &joined, has_meshes);
        if touch {
            contacts.begin(bodies, &colliders, step, &Threads::default());
        }
        let pass = |h: f64, iteration: u32| ReferencePass {
            colliders: &colliders,
            gravity,
            seconds: whole,
            h,
            compliant: step.method.compliant_seconds(h),
            relaxation: step.method.relaxation().into(),
            substep: (step.index, step.count),
            iteration: (iteration, step.total_iterations()),
            is_anew: iteration == 0 && !*keeps_multipliers,
        };
        for (place, body) in bodies.iter_mut().enumerate() {
            let is_near = touch && contacts.is_near(place) || joined.contains(body.number);
            if step.index == 0 {
                body.check_damage(settings);
                body.find_sides(&colliders);
                body.find_free_parts(settings);
            }
            body.move_repaired(whole);
            body.h = if settings.order.get() == 2 && !*keeps_multipliers {
                body.begin_second_order(whole, gravity, is_near, &colliders)
            } else {
                whole
            };
            let h = body.h;
            body.past.touched = false;
            body.push_by_app(h);
            body.push_by_forces(Moment {
                time: start,
                h,
                gravity,
            });
            if let Some(kept) = step.method.keeps_speed() {
                body.spins
                    .iter_mut()
                    .for_each(|spin| *spin *= f64::from(kept));
                for v in &mut body.v {
                    *v = (*v + gravity * h) * f64::from(kept) - gravity * h;
                }
            }
            body.presolve(h, gravity);
            body.move_pins((step.index, step.count));
            body.solve_effects(BodyPhase::Prediction, &pass(h, 0));
            if *keeps_multipliers && !step.method.is_rigid() {
                body.pull();
            }
        }
        for iteration in 0..step.total_iterations() {
            for body in &mut *bodies {
                let pass = pass(body.h, iteration);
                let is_kept =
                    !body.free_parts.is_empty() && body.h == whole && body.repair.is_empty();
                let before = is_kept.then(|| body.x.clone());
                body.iterate(step, &pass);
                if let Some(before) = before {
                    body.turn_back(&before);
                }
                body.solve_effects(BodyPhase::Iteration, &pass);
            }
            joints::solve(bodies, step, iteration);
            for body in &mut *bodies {
                body.pull_by_grabs(&pass(body.h, iteration));
                body.solve_effects(BodyPhase::IterationEnd, &pass(body.h, iteration));
            }
            for _ in 0..step.contacts_after(iteration) {
                if touch {
                    contacts.separate(bodies);
                    contacts.solve(bodies, Between::Bodies);
                    contacts.solve(bodies, Between::Itself);
                }
                for body in &mut *bodies {
                    let pass = pass(body.h, iteration);
                    body.solve_effects(BodyPhase::Contact, &pass);
                }
                if touch {
                    contacts.solve(bodies, Between::Colliders);
                }
            }
        }
        if touch {
            contacts.lift(bodies);
            contacts.truncate(bodies, step, &Threads::default());
        }
        for body in &mut *bodies {
            let h = body.h;
            body.postsolve(h);
            body.resist_rolling(h);
            body.end_repair();
            body.flow(start + h, h);
        }
        if touch {
            contacts.return_momentum(bodies);
            contacts.drop_lift(bodies);
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
            number: 0,
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
            spins: body
                .particles
                .spins
                .iter()
                .map(|spin| spin.truncate().as_dvec3())
                .collect(),
            effects: Effects::default(),
            controls: body.controls.as_deref().cloned().unwrap_or_default(),
            grab_states: Vec::new(),
            states: ReferenceStates {
                stitches: (body.stitches.clone(), Vec::new()),
                rod: body.effects.rod.map_or_else(RodState::default, |rod| {
                    RodState::resumed(&rod, &body.topology, &body.particles.segments)
                }),
                ..ReferenceStates::default()
            },
            lambdas: Default::default(),
            masses: tear::Masses {
                density: body.density,
                added: body.added_mass.clone(),
                pins: body.pins.clone(),
            },
            emission: body.particles.emission.clone(),
            sides: Vec::new(),
            free_parts: Vec::new(),
            repair: Repair::default(),
            past: Past::default(),
            h: 0.0,
        };
        own.carry(&body.effects);
        own
    }

    /// Replaces the effects.
    pub fn carry(&mut self, effects: &Effects) {
        self.effects = *effects;
        let rotating = effects.grains.filter(Grains::rotates);
        let count = rotating.map_or(0, |_| self.topology.radii.len());
        if self.spins.len() != count {
            self.spins = vec![DVec3::ZERO; count];
        }
        for (spin, w) in self.spins.iter_mut().zip(&self.w) {
            if *w == 0.0 {
                *spin = DVec3::ZERO;
            }
        }
        self.states
            .prepare(effects, &self.topology, &self.x, &self.w);
        self.prepare_grabs();
    }

    /// Its stitches, including broken ones.
    #[must_use]
    pub fn stitches(&self) -> &Stitches {
        &self.states.stitches.0
    }

    /// Whether it touched something in the last substep, or is stitched to something.
    #[must_use]
    pub fn is_touched(&self) -> bool {
        self.past.touched || self.stitches().lead_outside()
    }

    /// The segments of its rod, in the order of
    /// [`Particles::segments`](crate::Particles::segments); empty without one.
    #[must_use]
    pub fn segments(&self) -> Vec<SegmentState> {
        self.states.rod.segments()
    }

    /// A pass of all effects without elements in a phase.
    fn solve_effects(&mut self, phase: BodyPhase, pass: &ReferencePass) {
        for &kind in BodyEffectKind::ALL {
            let is_rigid = phase == BodyPhase::Contact && self.effects.is_rigid();
            if kind.phase() == phase && !kind.is_internal() && !is_rigid {
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

    /// State of effects without elements, and the particles in their form.
    fn split(&mut self) -> (&mut ReferenceStates, ReferenceParticles<'_>) {
        let grains = self.effects.grains.as_ref();
        let rolling = grains.map(|grains| grains.rolling_resistance.get().into());
        let particles = ReferenceParticles {
            topology: &self.topology,
            x: &mut self.x,
            p: &mut self.p,
            from: &self.from,
            w: &self.w,
            spins: &mut self.spins,
            sides: &self.sides,
            rolling_resistance: rolling.unwrap_or(0.0),
            touched: &mut self.past.touched,
        };
        (&mut self.states, particles)
    }
}

impl ReferencePass<'_> {
    /// The only pass of a substep of `h` seconds, without colliders and gravity.
    fn alone(h: f64, is_anew: bool) -> Self {
        Self {
            colliders: &[],
            gravity: DVec3::ZERO,
            seconds: h,
            h,
            compliant: h,
            relaxation: 1.0,
            substep: (0, 1),
            iteration: (0, 1),
            is_anew,
        }
    }
}
