//! The twin: the whole method again, in scalar f64, as plain as a page of a textbook.
//!
//! No colours, no lanes, no threads, no care for speed. Errors of the fast solver are measured
//! against it, and each of its kernels is tested against it. It takes rest values, masses and the
//! order of constraints from the fast bodies, so that both solve the same equations.

use crate::{
    Effects, ElasticKind, Leads, Matching, Pressure, Repair, Settings, ShapeMatching, StitchEnd,
    Stitches, Substep, SurfacePoint, Topology,
    contact::{Collider, ColliderShape, Pose},
    effects::{
        pressure::Walls,
        shape_matching::{self, Place},
        tethers,
    },
    elastic::{Elastic, Point, Row, Visit},
    force::{Force, Moment, Mote, VisitForces},
    history::SHARE,
    kernel::block::DEPENDENT,
    method::{Averaging, Masses},
    repair::{Motes, Repairable},
    spin::{Motion, is_free},
};
use glam::{DVec3, Vec4};
use std::{cell::Cell, sync::Arc};

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
    /// The elastic effects, pressure and the forces; others of these are not looked at.
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
    /// λ of the constraints of each elastic effect; empty before the first sweep.
    pub lambdas: [Vec<f64>; ElasticKind::COUNT],
    /// λ of the pressure.
    pub walls: Walls,
    /// The regions whose shapes are matched: their one formula is in `f64`, and the fast solver has it too.
    pub matching: Matching,
    /// What of it is under repair.
    repair: Repair,
    /// What [steps of second order](crate::history) need of the substep before.
    past: Past,
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
struct Sweep {
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
    /// The same world in f64. Sleep and quarantine are left out: the twin always steps all.
    #[must_use]
    pub fn of(world: &crate::World) -> Self {
        Self {
            settings: world.settings,
            bodies: world.bodies.iter().map(Body::of).collect(),
            colliders: world.colliders.clone(),
            time: world.time,
            keeps_multipliers: false,
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
        let h = self.settings.substep_seconds();
        let gravity = self.settings.gravity.as_dvec3();
        for index in 0..substeps {
            let start = self.time + h * f64::from(index);
            let share = f64::from(index + 1) / f64::from(substeps);
            let step = self.settings.substep(index);
            for body in &mut self.bodies {
                let (whole, end) = (h, start + h);
                if index == 0 {
                    body.look_for_damage(&self.settings);
                }
                body.draw(h);
                let h = if self.settings.order.get() == 2 && !self.keeps_multipliers {
                    let colliders = self.colliders.iter();
                    let swept = colliders.map(|collider| {
                        (
                            collider.shape,
                            collider.pose_at(start),
                            collider.pose_at(end),
                        )
                    });
                    body.look_back(whole, gravity, swept)
                } else {
                    whole
                };
                let spin = body.spin(&self.settings);
                body.push_by_forces(Moment { time: start, h });
                if let Some(kept) = step.method.keeps_speed() {
                    for v in &mut body.v {
                        *v = (*v + gravity * h) * f64::from(kept) - gravity * h;
                    }
                }
                body.presolve(h, gravity);
                if self.keeps_multipliers && !step.method.is_rigid() {
                    body.pull();
                }
                for iteration in 0..step.sweeps() {
                    let anew = iteration == 0 && !self.keeps_multipliers;
                    body.sweep(&step, h, iteration, anew);
                    let ends = (iteration == 0, iteration + 1 == step.sweeps());
                    body.solve_stitches(&self.colliders, end, h, ends);
                    body.solve_tethers();
                    body.solve_grab(h, share, f64::from(substeps), iteration == 0);
                    for _ in 0..step.contacts_after(iteration) {
                        body.solve_ground(h, gravity);
                        for collider in &self.colliders {
                            let (from, to) = (collider.pose_at(start), collider.pose_at(end));
                            body.solve_collider(h, gravity, collider.shape, &from, &to);
                        }
                    }
                }
                body.postsolve(h);
                if let Some(spin) = spin.filter(|_| !body.past.touched) {
                    body.turn_to(spin);
                }
                body.stiffen();
                body.flow(start + h, h);
            }
        }
        for hold in self.bodies.iter_mut().filter_map(|body| body.grab.as_mut()) {
            hold.from = hold.target;
        }
        self.time += self.settings.tick_seconds();
    }
}

impl Motes for Body {
    fn inverse_mass(&self, i: usize) -> f64 {
        self.w[i]
    }

    fn position(&self, i: usize) -> DVec3 {
        self.x[i]
    }

    fn velocity(&self, i: usize) -> DVec3 {
        self.v[i]
    }

    fn shift(&mut self, i: usize, by: DVec3) {
        self.x[i] += by;
    }

    fn accelerate(&mut self, i: usize, change: DVec3) {
        self.v[i] += change;
    }
}

impl Body {
    /// The same body in f64.
    #[must_use]
    pub fn of(body: &crate::Body) -> Self {
        let particles = &body.particles;
        let each = 0..particles.len();
        let mut twin = Self {
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
            lambdas: Default::default(),
            walls: Walls::default(),
            matching: Matching::default(),
            repair: Repair::default(),
            past: Past::default(),
        };
        twin.carry(&body.effects);
        twin
    }

    /// Carries these effects from now on, and no others.
    pub fn carry(&mut self, effects: &Effects) {
        self.effects = *effects;
        self.tethers.clear();
        if let Some(tethers) = effects.tethers {
            let places = self.x.iter().zip(&self.w);
            let places: Vec<Vec4> = places.map(|(x, &w)| x.as_vec3().extend(w as f32)).collect();
            let most = 1.0 + f64::from(tethers.slack);
            let leads = Leads::of(&self.topology, &places);
            let ways = leads.ways().map(|(i, pin, way)| (i, pin, way * most));
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

    /// Lets forces from outside act, one after the other.
    fn push_by_forces(&mut self, moment: Moment) {
        struct Act<'a>(&'a mut Body, Moment);
        impl VisitForces for Act<'_> {
            fn visit<F: Force>(&mut self, force: &F) {
                let Body {
                    topology, x, v, w, ..
                } = &mut *self.0;
                let v = Cell::from_mut(&mut v[..]).as_slice_of_cells();
                let at = |i: u32| Mote {
                    x: x[i as usize],
                    v: v[i as usize].get(),
                    w: w[i as usize],
                };
                force.act(topology, self.1, at, |i, change| {
                    if w[i as usize] > 0.0 {
                        v[i as usize].set(v[i as usize].get() + change);
                    }
                });
            }
        }
        let effects = self.effects;
        effects.visit_forces(&mut Act(self, moment));
    }

    /// Begins a substep of `h` seconds by BDF2, or, at contacts and where there is no past, by implicit
    /// Euler; returns its length as the latter has it.
    fn look_back(
        &mut self,
        h: f64,
        gravity: DVec3,
        swept: impl Iterator<Item = (ColliderShape, Pose, Pose)> + Clone,
    ) -> f64 {
        let heights = [self.ground.map(|(height, ..)| height), self.sticky_ground];
        let height = heights.into_iter().flatten().reduce(f64::max);
        let meets = (0..self.x.len()).filter(|&i| self.w[i] > 0.0).any(|i| {
            let (from, to) = (self.x[i], self.x[i] + (self.v[i] + gravity * h) * h);
            height.is_some_and(|height| from.y.min(to.y) <= height)
                || self.collide.is_some()
                    && swept.clone().any(|(shape, start, end)| {
                        exit(shape, start.undo(from), end.undo(to)).is_some()
                    })
        });
        let past = std::mem::take(&mut self.past);
        let unwritten = (0..self.x.len()).filter(|&i| self.w[i] > 0.0).all(|i| {
            let way = self.x[i] - self.p[i];
            (way - self.v[i] * past.seconds).length() <= 1e-5 * way.length()
        });
        let now = (self.x.clone(), self.v.clone());
        let mut seconds = h;
        if let Some((x, v)) = past.state
            && !meets
            && !past.touched
            && past.h == h
            && unwritten
        {
            for i in (0..self.x.len()).filter(|&i| self.w[i] > 0.0) {
                self.x[i] = (self.x[i] * 4.0 - x[i]) / 3.0;
                self.v[i] = (self.v[i] * 4.0 - v[i]) / 3.0;
            }
            seconds = h * SHARE;
        }
        self.past = Past {
            state: Some(now),
            seconds,
            h,
            touched: false,
        };
        seconds
    }

    fn presolve(&mut self, h: f64, gravity: DVec3) {
        for i in 0..self.x.len() {
            self.p[i] = self.x[i];
            self.from[i] = self.x[i];
            if self.w[i] > 0.0 {
                self.v[i] += gravity * h;
                self.x[i] += self.v[i] * h;
            } else {
                self.v[i] = DVec3::ZERO;
            }
            if let Some(height) = self.sticky_ground
                && self.x[i].y < height
                && self.w[i] > 0.0
            {
                self.x[i] = self.p[i];
                self.x[i].y = height;
                self.past.touched = true;
            }
        }
    }

    /// Angular momentum that is to be kept in a substep, if it is: see [`spin`](crate::spin).
    fn spin(&mut self, settings: &Settings) -> Option<DVec3> {
        self.past.touched = false;
        let asked = settings.keep_spin.get() == 1 && settings.order.get() == 1;
        let free = asked
            && settings.method.keeps_speed().is_none()
            && is_free(&self.effects, &self.stitches.0)
            && self.w.iter().all(|w| *w > 0.0);
        free.then(|| self.motion().angular)
    }

    /// Finds damaged elements at the start of a tick, see [`repair`](crate::repair).
    fn look_for_damage(&mut self, settings: &Settings) {
        let mut repair = std::mem::take(&mut self.repair);
        let topology = Arc::clone(&self.topology);
        if let Some(body) = Repairable::of(&self.effects, &topology, settings) {
            repair.look(&body, settings.tick_seconds(), self);
            self.repair = repair;
        }
    }

    fn draw(&mut self, h: f64) {
        let mut repair = std::mem::take(&mut self.repair);
        repair.draw(&Arc::clone(&self.topology), h, self);
        self.repair = repair;
    }

    fn stiffen(&mut self) {
        let mut repair = std::mem::take(&mut self.repair);
        if self.past.touched {
            repair.touch();
        }
        repair.stiffen(self);
        self.repair = repair;
    }

    fn motion(&self) -> Motion {
        Motion::of(|i| (1.0 / self.w[i], self.x[i], self.v[i]), self.x.len())
    }

    /// Turns all velocities alike, to this angular momentum.
    fn turn_to(&mut self, angular: DVec3) {
        let motion = self.motion();
        let turn = motion.turn_to(angular);
        for (v, x) in self.v.iter_mut().zip(&self.x) {
            *v += turn.cross(*x - motion.center);
        }
    }

    fn postsolve(&mut self, h: f64) {
        for i in 0..self.x.len() {
            self.v[i] = (self.x[i] - self.p[i]) / h;
        }
    }

    /// Lets rest values flow at the end of a substep, if it is time to.
    fn flow(&mut self, time: f64, h: f64) {
        if let Some(plasticity) = self.effects.plasticity
            && let Some(seconds) = plasticity.due(time, h)
        {
            plasticity.flow_plainly(&self.effects, &mut self.topology, &self.x, seconds);
        }
    }

    /// Moves every particle by what the multipliers that are there pull: w ∇C λ.
    fn pull(&mut self) {
        struct Pull<'a>(&'a mut Body);
        impl Visit for Pull<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                self.0.pull_by(effect);
            }
        }
        let effects = self.effects;
        effects.visit(&mut Pull(self));
        if effects.shape_matching.is_some() {
            let at = |i: u32| place(&self.x, &self.p, &self.w, i);
            let moves = self.matching.pull(&self.topology, at);
            go(&mut self.x, moves);
        }
        if let (Some(_), Ok(enclosure)) = (effects.pressure, self.topology.enclosure()) {
            let at = |i: u32| self.x[i as usize];
            // There is nothing yet in the first substep.
            self.walls.gradients.resize(self.x.len(), DVec3::ZERO);
            enclosure.volume_and_gradients(&self.topology, at, &mut self.walls.gradients);
            self.blow(self.walls.multiplier);
        }
    }

    /// Moves every particle by w ∇V λ.
    fn blow(&mut self, lambda: f64) {
        let all = self.x.iter_mut().zip(&self.w).zip(&self.walls.gradients);
        for ((x, w), gradient) in all {
            *x += *gradient * (w * lambda);
        }
    }

    fn pull_by<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let topology = Arc::clone(&self.topology);
        let lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        let elements = E::elements(&topology).corners().enumerate();
        for ((index, corners), lambda) in elements.zip(lambdas.chunks_exact(M)) {
            let rows = effect.rows(&topology, index, self.points(corners));
            self.push(corners, &rows, lambda);
        }
        self.lambdas[E::KIND as usize] = lambdas;
    }

    /// One sweep over the constraints of all elastic effects by XPBD, and of pressure; λ starts at 0
    /// with the first sweep of a substep.
    pub fn solve_elastic(&mut self, h: f64, first: bool) {
        self.visit_elastic(Sweep {
            h,
            first,
            share: 1.0,
            averaging: None,
        });
    }

    /// Sweep number `iteration` of a substep by its method.
    fn sweep(&mut self, step: &Substep, h: f64, iteration: u32, first: bool) {
        self.visit_elastic(Sweep {
            h: step.method.compliant_seconds(h),
            first,
            share: step.method.share().into(),
            averaging: step.averaging(iteration),
        });
    }

    fn visit_elastic(&mut self, sweep: Sweep) {
        struct Solve<'a>(&'a mut Body, Sweep);
        impl Visit for Solve<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                match self.1.averaging {
                    Some(averaging) => self.0.average(effect, self.1, averaging),
                    None => self.0.solve_by(effect, self.1),
                }
            }
        }
        let effects = self.effects;
        effects.visit(&mut Solve(self, sweep));
        if let Some(effect) = &effects.shape_matching {
            let Sweep {
                h, first, share, ..
            } = sweep;
            let sweep = shape_matching::Sweep { h, first, share };
            self.match_shapes(effect, sweep);
        }
        if let Some(pressure) = effects.pressure {
            self.solve_pressure(&pressure, sweep.h, sweep.first);
        }
    }

    /// One sweep over the regions whose shapes are matched.
    fn match_shapes(&mut self, effect: &ShapeMatching, sweep: shape_matching::Sweep) {
        let at = |i: u32| place(&self.x, &self.p, &self.w, i);
        let moves = self.matching.sweep(&self.topology, effect, sweep, at);
        go(&mut self.x, moves);
    }

    /// One sweep of pressure.
    pub fn solve_pressure(&mut self, pressure: &Pressure, h: f64, first: bool) {
        let topology = Arc::clone(&self.topology);
        let Ok(enclosure) = topology.enclosure() else {
            return;
        };
        if first {
            self.walls.multiplier = 0.0;
        }
        let (at, weight) = (|i: u32| self.x[i as usize], |i: usize| self.w[i]);
        let body = (&*topology, enclosure);
        let change = self.walls.sweep(pressure, body, at, weight, h);
        self.blow(change);
    }

    /// Moves every particle to the mean of where the constraints of an effect would have it, each by
    /// itself and all from where particles are now.
    fn average<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        Sweep { h, first, .. }: Sweep,
        Averaging { own_weight, masses }: Averaging,
    ) {
        let topology = Arc::clone(&self.topology);
        let mut lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        if first {
            lambdas.clear();
        }
        lambdas.resize(E::KIND.multipliers(&topology), 0.0);
        let gamma = f64::from(effect.damping().get()) / h;
        let mut sums = vec![(DVec3::ZERO, 0.0); self.x.len()];
        let elements = E::elements(&topology).corners().enumerate();
        for ((index, corners), lambda) in elements.zip(lambdas.chunks_exact(M)) {
            let mut points = self.points(corners);
            let lightest = points.iter().map(|point| point.w).fold(0.0, f64::max);
            for point in &mut points {
                point.w = match masses {
                    Masses::Own => point.w,
                    Masses::Equal => 1.0,
                    Masses::PinsLikeOthers if point.w > 0.0 => point.w,
                    Masses::PinsLikeOthers => lightest,
                };
            }
            let rows = effect.rows(&topology, index, points);
            let way = corners.map(|i| self.x[i as usize] - self.p[i as usize]);
            let change = xpbd(&rows, points.map(|point| point.w), way, lambda, gamma, h);
            for (corner, i) in corners.into_iter().enumerate() {
                let (sum, count) = &mut sums[i as usize];
                for (row, change) in rows.iter().zip(change) {
                    *sum += row.gradients[corner] * (points[corner].w * change);
                }
                *count += 1.0;
            }
        }
        for ((x, w), (sum, count)) in self.x.iter_mut().zip(&self.w).zip(sums) {
            if *w > 0.0 && count > 0.0 {
                *x += sum / (count + f64::from(own_weight));
            }
        }
        self.lambdas[E::KIND as usize] = lambdas;
    }

    /// One sweep over the constraints of one effect by XPBD.
    pub fn solve<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        h: f64,
        first: bool,
    ) {
        let sweep = Sweep {
            h,
            first,
            share: 1.0,
            averaging: None,
        };
        self.solve_by(effect, sweep);
    }

    fn solve_by<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        Sweep {
            h, first, share, ..
        }: Sweep,
    ) {
        let topology = Arc::clone(&self.topology);
        let mut lambdas = std::mem::take(&mut self.lambdas[E::KIND as usize]);
        if first {
            lambdas.clear();
        }
        lambdas.resize(E::KIND.multipliers(&topology), 0.0);
        let gamma = f64::from(effect.damping().get()) / h;
        let elements = E::elements(&topology).corners().enumerate();
        for ((index, corners), lambda) in elements.zip(lambdas.chunks_exact_mut(M)) {
            let points = self.points(corners);
            let rows = effect.rows(&topology, index, points);
            let way = corners.map(|i| self.x[i as usize] - self.p[i as usize]);
            let change = xpbd(&rows, points.map(|point| point.w), way, lambda, gamma, h);
            let change = change.map(|change| change * share);
            for (lambda, change) in lambda.iter_mut().zip(change) {
                *lambda += change;
            }
            self.push(corners, &rows, &change);
        }
        self.lambdas[E::KIND as usize] = lambdas;
    }

    fn points<const N: usize>(&self, corners: [u32; N]) -> [Point; N] {
        corners.map(|i| i as usize).map(|i| Point {
            x: self.x[i],
            w: self.w[i],
            rest: self.topology.rest[i].as_dvec3(),
        })
    }

    /// Moves the particles of an element by w ∇C λ.
    fn push<const N: usize>(&mut self, corners: [u32; N], rows: &[Row<N>], lambdas: &[f64]) {
        for (row, lambda) in rows.iter().zip(lambdas) {
            for (i, gradient) in corners.into_iter().zip(row.gradients) {
                self.x[i as usize] += gradient * (self.w[i as usize] * lambda);
            }
        }
    }

    /// One sweep over its stitches, the first or the last of a substep of `h` seconds that ends at
    /// `time`.
    fn solve_stitches(
        &mut self,
        colliders: &[Collider],
        time: f64,
        h: f64,
        (first, last): (bool, bool),
    ) {
        let (stitches, lambdas) = &mut self.stitches;
        if first {
            lambdas.clear();
        }
        lambdas.resize(stitches.all().len(), DVec3::ZERO);
        let mut breaks = Vec::new();
        for ((index, stitch), lambda) in stitches.all().iter().enumerate().zip(lambdas) {
            let mut ends = vec![(&stitch.point, 1.0)];
            let mut fixed = DVec3::ZERO;
            match &stitch.to {
                _ if stitch.broken => continue,
                StitchEnd::Point(other) => ends.push((other, -1.0)),
                StitchEnd::Collider { number, place } => match colliders.get(*number as usize) {
                    Some(it) => fixed = it.pose_at(time).apply(place.as_dvec3()),
                    None => continue,
                },
            }
            let terms = ends.iter().flat_map(|&(point, sign)| {
                let terms = point.terms();
                terms.map(move |(i, b)| (i as usize, sign * f64::from(b)))
            });
            let terms: Vec<_> = terms.collect();
            let d = terms.iter().fold(-fixed, |d, &(i, b)| d + self.x[i] * b);
            let weight: f64 = terms.iter().map(|&(i, b)| b * b * self.w[i]).sum();
            if weight == 0.0 {
                continue;
            }
            let alpha = f64::from(stitch.compliance) / (h * h);
            let change = -(d + *lambda * alpha) / (weight + alpha);
            *lambda += change;
            for (i, b) in terms {
                self.x[i] += change * (b * self.w[i]);
            }
            if last && lambda.length() > f64::from(stitch.strength) * h * h {
                breaks.push(index);
            }
        }
        for index in breaks {
            stitches.break_at(index);
        }
    }

    fn solve_tethers(&mut self) {
        for &(i, pin, length) in &self.tethers {
            let pin = self.x[pin];
            self.x[i] = pin + tethers::held(self.x[i] - pin, length);
        }
    }

    fn solve_grab(&mut self, h: f64, share: f64, substeps: f64, first: bool) {
        let Some(mut hold) = self.grab else { return };
        if first {
            hold.multiplier = 0.0;
        }
        let place = |points: &[DVec3]| {
            hold.point.terms().fold(DVec3::ZERO, |sum, (i, b)| {
                sum + points[i as usize] * f64::from(b)
            })
        };
        let travel = hold.target - hold.from;
        let held = place(&self.x);
        let d = held - (hold.from + travel * share);
        let weight: f64 = hold
            .point
            .terms()
            .map(|(i, b)| f64::from(b) * f64::from(b) * self.w[i as usize])
            .sum();
        if weight > 0.0 && d.length() > 0.0 {
            let direction = d / d.length();
            // The held point as one particle of the inverse mass `weight`.
            let spring = Row {
                error: d.length(),
                gradients: [direction],
                compliance: hold.compliance,
                scale: 1.0,
                least: 0.0,
            };
            let way = held - place(&self.p) - travel / substeps;
            let gamma = hold.damping / h;
            let [change] = xpbd(&[spring], [weight], [way], &[hold.multiplier], gamma, h);
            let limit = hold.max_force * h * h;
            let next = (hold.multiplier + change).clamp(-limit, limit);
            for (i, b) in hold.point.terms() {
                let push = (next - hold.multiplier) * f64::from(b);
                self.x[i as usize] += direction * (self.w[i as usize] * push);
            }
            hold.multiplier = next;
        }
        self.grab = Some(hold);
    }

    fn solve_ground(&mut self, h: f64, gravity: DVec3) {
        let Some((height, friction, restitution)) = self.ground else {
            return;
        };
        for i in 0..self.x.len() {
            let approach = (self.x[i] - self.p[i]).y / h;
            let bounces = restitution > 0.0 && approach < -2.0 * h * gravity.length();
            let below = if bounces {
                0.0
            } else {
                (height - self.from[i].y).max(0.0)
            };
            let left = below * (1.0 - (h / UP_OVER).min(1.0));
            let depth = height - left - self.x[i].y;
            if depth > 0.0 && self.w[i] > 0.0 {
                let surface = (friction, restitution, gravity.length());
                self.respond(i, h, surface, DVec3::Y, depth, DVec3::ZERO);
            }
        }
    }

    fn solve_collider(
        &mut self,
        h: f64,
        gravity: DVec3,
        shape: ColliderShape,
        from: &Pose,
        to: &Pose,
    ) {
        let Some((friction, restitution)) = self.collide else {
            return;
        };
        for i in 0..self.x.len() {
            if self.w[i] == 0.0 {
                continue;
            }
            let (start, end) = (from.undo(self.p[i]), to.undo(self.x[i]));
            if let Some((normal, depth)) = exit(shape, start, end) {
                let touched = end + normal * depth;
                let carried = to.apply(touched) - from.apply(touched);
                let surface = (friction, restitution, gravity.length());
                self.respond(i, h, surface, to.rotation * normal, depth, carried);
            }
        }
    }

    /// Out of the surface, slip shortened by µ times the depth, and a bounce.
    fn respond(
        &mut self,
        i: usize,
        h: f64,
        (friction, restitution, gravity): (f64, f64, f64),
        normal: DVec3,
        depth: f64,
        carried: DVec3,
    ) {
        self.past.touched = true;
        let approach = (self.x[i] - self.p[i] - carried).dot(normal) / h;
        self.x[i] += normal * depth;
        let slip = (self.x[i] - self.p[i] - carried).reject_from_normalized(normal);
        let hold = friction * depth;
        self.x[i] -= if slip.length() <= hold {
            slip
        } else {
            slip * (hold / slip.length())
        };
        if restitution > 0.0 && approach < -2.0 * h * gravity {
            let leave = -restitution * approach * h + carried.dot(normal);
            let now = (self.x[i] - self.p[i]).dot(normal);
            self.p[i] += normal * (now - leave);
        }
    }
}

fn place(x: &[DVec3], p: &[DVec3], w: &[f64], i: u32) -> Place {
    let i = i as usize;
    Place {
        x: x[i],
        p: p[i],
        w: w[i],
    }
}

fn go(x: &mut [DVec3], moves: &[DVec3]) {
    for (x, by) in x.iter_mut().zip(moves) {
        *x += by;
    }
}

/// Δλ of XPBD's equation 26 with γ = τ/h, for all equations of an element together; `way` is x − p.
fn xpbd<const N: usize, const M: usize>(
    rows: &[Row<N>; M],
    w: [f64; N],
    way: [DVec3; N],
    lambda: &[f64],
    gamma: f64,
    h: f64,
) -> [f64; M] {
    let alpha = |i: usize| rows[i].compliance / (h * h);
    let weight = |i: usize, j: usize| -> f64 {
        let both = rows[i].gradients.iter().zip(rows[j].gradients);
        both.zip(w).map(|((a, b), w)| w * a.dot(b)).sum()
    };
    let mut matrix = [[0.0; M]; M];
    let mut right = [0.0; M];
    for i in 0..M {
        let moved: f64 = rows[i]
            .gradients
            .iter()
            .zip(way)
            .map(|(g, d)| g.dot(d))
            .sum();
        right[i] = -(rows[i].error + alpha(i) * lambda[i] + gamma * moved);
        matrix[i] = std::array::from_fn(|j| (1.0 + gamma) * weight(i, j));
        matrix[i][i] = (1.0 + gamma) * weight(i, i).max(rows[i].least) + alpha(i);
    }
    let free = |i: usize| weight(i, i) > 0.0;
    eliminate(matrix, right, free, rows.map(|row| row.least))
}

/// Solves a symmetric system by elimination. Leaves out the equations that are not `free` to be
/// solved, and those that say what the ones before them have said.
fn eliminate<const M: usize>(
    mut matrix: [[f64; M]; M],
    mut right: [f64; M],
    free: impl Fn(usize) -> bool,
    least: [f64; M],
) -> [f64; M] {
    let mut inverse = [0.0; M];
    for i in 0..M {
        let whole = matrix[i][i];
        for j in 0..i {
            let factor = matrix[i][j] * inverse[j];
            right[i] -= factor * right[j];
            let above = matrix[j];
            for (entry, above) in matrix[i].iter_mut().zip(above).skip(j + 1) {
                *entry -= factor * above;
            }
        }
        matrix[i][i] = matrix[i][i].max(least[i]);
        if free(i) && matrix[i][i] > whole * f64::from(DEPENDENT) {
            inverse[i] = 1.0 / matrix[i][i];
        }
    }
    let mut solution = [0.0; M];
    for i in (0..M).rev() {
        let known: f64 = (i + 1..M).map(|j| matrix[i][j] * solution[j]).sum();
        solution[i] = (right[i] - known) * inverse[i];
    }
    solution
}

/// Normal and depth for a point that went from `from` to `to`, in the collider's frame; how it is
/// chosen is told at [`ColliderShape::exit`].
fn exit(shape: ColliderShape, from: DVec3, to: DVec3) -> Option<(DVec3, f64)> {
    let step = to - from;
    let nearest = (distance(shape, to) < 0.0).then(|| nearest_exit(shape, to));
    if nearest.is_some_and(|(normal, _)| normal.dot(step) <= 0.0) {
        return nearest;
    }
    let entry = if distance(shape, from) < 0.0 {
        let (normal, depth) = nearest_exit(shape, from);
        Some((from + normal * depth, normal))
    } else {
        enter(shape, from, step)
            .filter(|&t| t <= 1.0)
            .map(|t| from + step * t)
            .map(|entry| (entry, nearest_exit(shape, entry).0))
    };
    let entered = entry
        .filter(|(_, normal)| normal.dot(step) < 0.0)
        .map(|(entry, normal)| (normal, normal.dot(entry - to)))
        .filter(|&(_, depth)| depth > 0.0);
    entered.or(nearest)
}

fn distance(shape: ColliderShape, x: DVec3) -> f64 {
    match shape {
        ColliderShape::Box { size } => {
            let q = x.abs() - size.as_dvec3() / 2.0;
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
        }
        ColliderShape::Sphere { radius } => x.length() - f64::from(radius),
        ColliderShape::Capsule { radius, length } => {
            (x - on_axis(x, length)).length() - f64::from(radius)
        }
    }
}

fn nearest_exit(shape: ColliderShape, x: DVec3) -> (DVec3, f64) {
    match shape {
        ColliderShape::Box { size } => {
            let gaps = size.as_dvec3() / 2.0 - x.abs();
            let axis = if gaps.y <= gaps.x && gaps.y <= gaps.z {
                DVec3::Y
            } else if gaps.x <= gaps.z {
                DVec3::X
            } else {
                DVec3::Z
            };
            let side = if x.dot(axis) < 0.0 { -1.0 } else { 1.0 };
            (axis * side, gaps.dot(axis))
        }
        ColliderShape::Sphere { radius } => round_exit(x, f64::from(radius), DVec3::Y),
        ColliderShape::Capsule { radius, length } => {
            round_exit(x - on_axis(x, length), f64::from(radius), DVec3::X)
        }
    }
}

fn round_exit(x: DVec3, radius: f64, any: DVec3) -> (DVec3, f64) {
    let distance = x.length();
    let normal = if distance > 0.0 { x / distance } else { any };
    (normal, radius - distance)
}

fn on_axis(x: DVec3, length: f32) -> DVec3 {
    let half = f64::from(length) / 2.0;
    DVec3::new(0.0, x.y.clamp(-half, half), 0.0)
}

fn enter(shape: ColliderShape, from: DVec3, step: DVec3) -> Option<f64> {
    match shape {
        ColliderShape::Sphere { radius } => enter_sphere(from, step, f64::from(radius)),
        ColliderShape::Box { size } => enter_box(from, step, size.as_dvec3() / 2.0),
        ColliderShape::Capsule { radius, length } => {
            let (radius, half) = (f64::from(radius), f64::from(length) / 2.0);
            let flat = DVec3::new(1.0, 0.0, 1.0);
            let end = DVec3::new(0.0, half, 0.0);
            enter_sphere(from * flat, step * flat, radius)
                .filter(|t| (from.y + t * step.y).abs() <= half)
                .or_else(|| {
                    [end, -end]
                        .into_iter()
                        .filter_map(|end| enter_sphere(from - end, step, radius))
                        .reduce(f64::min)
                })
        }
    }
}

fn enter_sphere(from: DVec3, step: DVec3, radius: f64) -> Option<f64> {
    let (a, b) = (step.length_squared(), from.dot(step));
    let discriminant = b * b - a * (from.length_squared() - radius * radius);
    (a > 0.0 && discriminant >= 0.0 && b < 0.0).then(|| ((-b - discriminant.sqrt()) / a).max(0.0))
}

fn enter_box(from: DVec3, step: DVec3, half: DVec3) -> Option<f64> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        if step[axis] == 0.0 {
            if from[axis].abs() > half[axis] {
                return None;
            }
        } else {
            let sides = [-half[axis], half[axis]].map(|side| (side - from[axis]) / step[axis]);
            enter = enter.max(sides[0].min(sides[1]));
            leave = leave.min(sides[0].max(sides[1]));
        }
    }
    (enter <= leave && leave >= 0.0).then_some(enter.max(0.0))
}
