//! Forces, prediction and velocities, and the steps around the stages.

use super::{Body, Past};
use crate::{
    Effects, Settings, Stitches, Topology,
    colliders::{
        collider::SweptCollider,
        inside::{WayOut, side},
    },
    contact::Tangible,
    effects::{free::free_parts, rigid::reference::exit},
    force::Force,
    force::Moment,
    force::Mote,
    force::VisitForces,
    history::STEP_FRACTION,
    kernel::moments::Moments,
    repair::{OneByOne, ParticleAccess, Repairable},
    rolling::GroundContact,
    spin::Motion,
};
use glam::DVec3;
use std::{cell::Cell, sync::Arc};

impl ParticleAccess for Body {
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

impl Tangible for Body {
    fn topology(&self) -> &Topology {
        &self.topology
    }

    fn effects(&self) -> &Effects {
        &self.effects
    }

    fn number(&self) -> u32 {
        self.number
    }

    fn stitches(&self) -> &Stitches {
        Self::stitches(self)
    }

    fn stitches_mut(&mut self) -> &mut Stitches {
        &mut self.states.stitches.0
    }

    fn takes_part(&self) -> bool {
        true
    }

    fn is_stepped(&self) -> bool {
        true
    }

    fn inverse_mass(&self, i: usize) -> f64 {
        self.w[i]
    }

    fn start(&self, i: usize) -> DVec3 {
        self.x[i]
    }

    fn now(&self, i: usize) -> DVec3 {
        self.x[i]
    }

    fn motion(&self, i: usize) -> DVec3 {
        self.v[i] * self.h
    }

    fn shift(&mut self, i: usize, by: DVec3) {
        self.x[i] += by;
    }

    fn is_repaired(&self) -> bool {
        !self.repair.is_empty()
    }

    fn began(&self, i: usize) -> DVec3 {
        self.p[i]
    }

    fn shift_start(&mut self, i: usize, by: DVec3) {
        self.p[i] += by;
    }

    fn accelerate(&mut self, i: usize, by: DVec3) {
        self.v[i] += by / self.h;
    }

    fn touch(&mut self) {
        self.past.touched = true;
    }
}

impl Body {
    /// Applies external forces, one after the other.
    pub(super) fn push_by_forces(&mut self, moment: Moment) {
        struct Act<'a>(&'a mut Body, Moment);
        impl VisitForces for Act<'_> {
            fn visit<F: Force>(&mut self, force: &F) {
                let Body {
                    topology,
                    effects,
                    x,
                    v,
                    w,
                    ..
                } = &mut *self.0;
                let weight = effects.force_weights(topology);
                let v = Cell::from_mut(&mut v[..]).as_slice_of_cells();
                let at = |i: u32| Mote {
                    x: x[i as usize],
                    v: v[i as usize].get(),
                    w: w[i as usize],
                };
                force.act(topology, self.1, at, |i, change| {
                    let weight = weight(i);
                    if w[i as usize] > 0.0 && weight > 0.0 {
                        v[i as usize].set(v[i as usize].get() + change * weight);
                    }
                });
            }
        }
        let effects = self.effects;
        effects.visit_forces(&mut Act(self, moment));
    }

    /// Begins a substep of `h` seconds by BDF2, or by implicit Euler at contacts and where no
    /// previous state exists; returns its length for implicit Euler.
    pub(super) fn begin_second_order(
        &mut self,
        h: f64,
        gravity: DVec3,
        is_near: bool,
        swept: &[SweptCollider],
    ) -> f64 {
        let heights = [
            self.effects.ground.map(|ground| ground.height.get()),
            self.effects.sticky_ground.map(|ground| ground.height.get()),
        ];
        let height = heights
            .into_iter()
            .flatten()
            .reduce(f32::max)
            .map(f64::from);
        let meets = (0..self.x.len()).filter(|&i| self.w[i] > 0.0).any(|i| {
            let (from, to) = (self.x[i], self.x[i] + (self.v[i] + gravity * h) * h);
            let radius = f64::from(self.topology.radius(i));
            height.is_some_and(|height| from.y.min(to.y) - radius <= height)
                || self.effects.collide.is_some()
                    && swept.iter().any(|it| {
                        let (from, to) = (it.from.undo(from), it.to.undo(to));
                        exit(&it.shape, from, to, radius).is_some()
                    })
        });
        let past = std::mem::take(&mut self.past);
        let unwritten = (0..self.x.len()).filter(|&i| self.w[i] > 0.0).all(|i| {
            let displacement = self.x[i] - self.p[i];
            (displacement - self.v[i] * past.seconds).length() <= 1e-5 * displacement.length()
        });
        let now = (self.x.clone(), self.v.clone());
        let mut seconds = h;
        if let Some((x, v)) = past.state
            && !meets
            && !is_near
            && !past.touched
            && past.h == h
            && unwritten
        {
            for i in (0..self.x.len()).filter(|&i| self.w[i] > 0.0) {
                self.x[i] = (self.x[i] * 4.0 - x[i]) / 3.0;
                self.v[i] = (self.v[i] * 4.0 - v[i]) / 3.0;
            }
            seconds = h * STEP_FRACTION;
        }
        self.past = Past {
            state: Some(now),
            seconds,
            h,
            touched: false,
        };
        seconds
    }

    pub(super) fn presolve(&mut self, h: f64, gravity: DVec3) {
        self.states.begin(&self.effects, self.x.len());
        for i in 0..self.x.len() {
            self.p[i] = self.x[i];
            self.from[i] = self.x[i];
            if self.w[i] > 0.0 {
                self.v[i] += gravity * h;
                self.x[i] += self.v[i] * h;
            } else {
                self.v[i] = DVec3::ZERO;
            }
        }
    }

    /// Finds damaged elements at the start of a tick, see [`repair`](crate::repair).
    pub(super) fn check_damage(&mut self, settings: &Settings) {
        let mut repair = std::mem::take(&mut self.repair);
        let topology = Arc::clone(&self.topology);
        if let Some(body) = Repairable::of(&self.effects, &topology, settings) {
            repair.check(&body, settings.tick_seconds(), self, &OneByOne);
            self.repair = repair;
        }
    }

    /// Finds the parts that keep their angular momentum.
    pub(super) fn find_free_parts(&mut self, settings: &Settings) {
        self.free_parts = match settings.keeps_spin() {
            true => free_parts(&self.effects, &self.topology, |i| self.w[i as usize] > 0.0),
            false => Vec::new(),
        };
    }

    /// Finds the sides to which it leaves the colliders that it is in.
    pub(super) fn find_sides(&mut self, colliders: &[SweptCollider]) {
        self.sides.clear();
        if self.effects.collide.is_none() || !self.topology.radii.is_empty() {
            return;
        }
        for (number, collider) in (0..).zip(colliders) {
            let moving = (0..self.x.len()).filter(|&i| self.w[i] > 0.0);
            let local = moving.map(|i| collider.from.undo(self.x[i]));
            if let Some(direction) = side(&collider.shape, local) {
                self.sides.push(WayOut {
                    collider: number,
                    direction,
                });
            }
        }
    }

    pub(super) fn move_repaired(&mut self, h: f64) {
        let mut repair = std::mem::take(&mut self.repair);
        repair.move_regions(&Arc::clone(&self.topology), h, self);
        self.repair = repair;
    }

    pub(super) fn end_repair(&mut self) {
        let mut repair = std::mem::take(&mut self.repair);
        if self.past.touched {
            repair.touch();
        }
        repair.make_rigid(self);
        self.repair = repair;
    }

    pub(super) fn motion(&self) -> Motion {
        Motion::of(|i| (1.0 / self.w[i], self.x[i], self.v[i]), self.x.len())
    }

    /// Takes back what internal constraints have done to the angular momentum of the parts that can
    /// rotate freely; before, the particles were at `before` [m]. See [`spin`](crate::spin).
    pub(super) fn turn_back(&mut self, before: &[DVec3]) {
        for part in &self.free_parts {
            let mut sums = Moments::<f64>::default();
            for &i in part {
                let i = i as usize;
                sums.add(Moments::of(
                    1.0 / self.w[i],
                    self.from[i],
                    self.x[i] - before[i],
                ));
            }
            if let Some((angle, center)) = sums.turn_back() {
                for &i in part {
                    self.x[i as usize] += angle.cross(self.from[i as usize] - center);
                }
            }
        }
    }

    pub(super) fn postsolve(&mut self, h: f64) {
        for i in 0..self.x.len() {
            self.v[i] = (self.x[i] - self.p[i]) / h;
        }
    }

    /// Ends a substep with [rolling resistance](crate::rolling) of the ground.
    pub(super) fn resist_rolling(&mut self, h: f64) {
        let Some(ground) = self.effects.rolling_ground() else {
            return;
        };
        let mut contact = GroundContact::default();
        for (i, pushed) in self.states.ground.iter().enumerate() {
            if pushed.normal > 0.0 {
                contact.add(1.0 / self.w[i], self.x[i], pushed.normal, pushed.friction);
            }
        }
        if self.w.contains(&0.0) {
            return;
        }
        if let Some((turn, center)) = contact.resist(&ground, &self.motion(), h) {
            for (v, x) in self.v.iter_mut().zip(&mut self.x) {
                let change = turn.cross(*x - center);
                *v -= change;
                *x -= change * h;
            }
        }
    }

    /// Applies plastic flow at the end of a substep, if it is due.
    pub(super) fn flow(&mut self, time: f64, h: f64) {
        if let Some(plasticity) = self.effects.plasticity
            && let Some(seconds) = plasticity.due(time, h)
        {
            plasticity.flow_plainly(&self.effects, &mut self.topology, &self.x, seconds);
        }
    }
}
