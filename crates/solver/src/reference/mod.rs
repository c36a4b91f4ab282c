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
//! use), forces, shape matching, what pressure knows of its walls, the nearest pins of tethers, poses of colliders,
//! contacts between bodies, and repair. An error in these shows in both alike, so that they are tested against finite differences and closed
//! forms.

mod contact;
mod elastic;
mod holds;
mod motion;

use contact::Pushed;

use crate::{
    Contacts, Effects, ElasticKind, Repair, Settings, ShapeMatchingState, Stitches, Substep,
    SurfacePoint, TetherTargets, Topology,
    contact::{Collider, pairs::Between},
    effects::pressure::PressureState,
    force::Moment,
    method::Averaging,
    step::together::are_needed,
};
use glam::{DVec3, Vec4};
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
    /// The elastic effects, pressure, the forces and contacts of bodies; others of these are not looked at.
    pub effects: Effects,
    /// Tethers, if there are any: particle, pin, and how far it may be from it [m].
    pub tethers: Vec<(usize, usize, f64)>,
    /// Its stitches, and λ of each.
    pub stitches: (Stitches, Vec<DVec3>),
    /// A hold, if there is one.
    pub grab: Option<Hold>,
    /// Ground, if there is one: height [m], µ, e.
    pub ground: Option<(f64, f64, f64)>,
    /// Height of a ground that sticks [m], if there is one.
    pub sticky_ground: Option<f64>,
    /// Friction µ and restitution e against colliders, if the body meets them.
    pub collide: Option<(f64, f64)>,
    /// What the ground and colliders have done in the substep under way, particle by particle.
    rigid: (Vec<Pushed>, Vec<Pushed>),
    /// λ of the constraints of each elastic effect; empty before the first sweep.
    pub lambdas: [Vec<f64>; ElasticKind::COUNT],
    /// λ of the pressure.
    pub pressure_state: PressureState,
    /// The regions whose shapes are matched: their one formula is in `f64`, and the fast solver has it too.
    pub matching: ShapeMatchingState,
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

/// A grab.
#[derive(Debug, Clone, Copy)]
pub struct Hold {
    point: SurfacePoint,
    target: DVec3,
    from: DVec3,
    compliance: f64,
    damping: f64,
    max_force: f64,
    multiplier: f64,
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

/// See the fast solver's constant of the same name.
const UP_OVER: f64 = 0.4;

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
                body.solve_tethers();
                // What is below the ground by as little as this is thrown out of it as fast.
                for (x, w) in body.x.iter_mut().zip(&body.w) {
                    if let Some((height, ..)) = body.ground
                        && *w > 0.0
                    {
                        x.y = x.y.max(height);
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
        for hold in self.bodies.iter_mut().filter_map(|body| body.grab.as_mut()) {
            hold.from = hold.target;
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
        let substeps = settings.substeps.get();
        let whole = settings.substep_seconds();
        let gravity = settings.gravity.as_dvec3();
        let start = *time + whole * f64::from(step.index);
        let end = start + whole;
        let share = f64::from(step.index + 1) / f64::from(substeps);
        for body in &mut *bodies {
            body.h = whole;
        }
        let touch = are_needed(bodies.iter().map(|body| (&body.effects, true)));
        if touch {
            contacts.begin(bodies, step);
        }
        for (place, body) in bodies.iter_mut().enumerate() {
            let is_near = touch && contacts.is_near(place);
            if step.index == 0 {
                body.look_for_damage(settings);
            }
            body.draw(whole);
            body.h = if settings.order.get() == 2 && !*keeps_multipliers {
                let swept = colliders.iter().map(|collider| {
                    (
                        collider.shape,
                        collider.pose_at(start),
                        collider.pose_at(end),
                    )
                });
                body.look_back(whole, gravity, is_near, swept)
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
            if *keeps_multipliers && !step.method.is_rigid() {
                body.pull();
            }
        }
        for iteration in 0..step.sweeps() {
            let anew = iteration == 0 && !*keeps_multipliers;
            let ends = (iteration == 0, iteration + 1 == step.sweeps());
            for body in &mut *bodies {
                let h = body.h;
                body.sweep(step, h, iteration, anew);
                body.solve_stitches(colliders, end, h, ends);
                body.solve_tethers();
                body.solve_grab(h, share, f64::from(substeps), iteration == 0);
            }
            for _ in 0..step.contacts_after(iteration) {
                if touch {
                    contacts.solve(bodies, Between::Bodies);
                    contacts.solve(bodies, Between::Itself);
                }
                for body in &mut *bodies {
                    let h = body.h;
                    body.solve_ground(h, gravity);
                    for (number, collider) in colliders.iter().enumerate() {
                        let (from, to) = (collider.pose_at(start), collider.pose_at(end));
                        let shape = (number, collider.shape);
                        body.solve_collider(h, gravity, shape, (&from, &to));
                    }
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
            tethers: Vec::new(),
            stitches: (body.stitches.clone(), Vec::new()),
            grab: None,
            ground: None,
            sticky_ground: None,
            collide: None,
            rigid: Default::default(),
            lambdas: Default::default(),
            pressure_state: PressureState::default(),
            matching: ShapeMatchingState::default(),
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
        self.tethers.clear();
        if let Some(tethers) = effects.tethers {
            let places = self.x.iter().zip(&self.w);
            let places: Vec<Vec4> = places.map(|(x, &w)| x.as_vec3().extend(w as f32)).collect();
            let most = 1.0 + f64::from(tethers.slack);
            let tether_targets = TetherTargets::of(&self.topology, &places);
            let ways = tether_targets
                .ways()
                .map(|(i, pin, way)| (i, pin, way * most));
            self.tethers.extend(ways);
        }
        if let Some(effect) = &effects.shape_matching {
            self.matching.update(&self.topology, effect);
        }
        self.grab = effects.grab.map(|grab| Hold {
            point: grab.point,
            target: grab.target.as_dvec3(),
            from: grab.from.as_dvec3(),
            compliance: grab.compliance.into(),
            damping: grab.damping.into(),
            max_force: grab.max_force.into(),
            multiplier: 0.0,
        });
        self.ground = effects.ground.map(|ground| {
            let height = f64::from(ground.height);
            (height, ground.friction.into(), ground.restitution.into())
        });
        self.sticky_ground = effects.sticky_ground.map(|ground| f64::from(ground.height));
        self.collide = effects
            .collide
            .map(|collide| (collide.friction.into(), collide.restitution.into()));
    }
}
