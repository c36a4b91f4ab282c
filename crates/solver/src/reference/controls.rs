//! What an app does to a body of the reference.

use super::Body;
use crate::{
    Grab, Grabs, SurfacePoint,
    effects::{
        body_effect::{BodyEffect, ReferencePass},
        grab::ReferenceGrab,
        grabs::is_sound,
    },
};
use glam::Vec3;
use std::mem::take;

impl Body {
    /// Applies an impulse at the beginning of a tick.
    pub(super) fn strike(&mut self) {
        if let Some(impulse) = self.controls.impulse.take() {
            self.accelerate_by(impulse.whole, &impulse.points, 1.0);
        }
    }

    /// Applies the force of an app for `h` seconds.
    pub(super) fn push_by_app(&mut self, h: f64) {
        if let Some(force) = take(&mut self.controls.force) {
            self.accelerate_by(force.whole, &force.points, h);
            self.controls.force = Some(force);
        }
    }

    /// A force [N] on the whole body and forces at points, for some time [s].
    fn accelerate_by(&mut self, whole: Vec3, points: &[(SurfacePoint, Vec3)], seconds: f64) {
        let masses = self.w.iter().filter(|w| **w > 0.0).map(|w| 1.0 / w);
        let mass: f64 = masses.sum();
        for (v, w) in self.v.iter_mut().zip(&self.w) {
            if *w > 0.0 {
                *v += whole.as_dvec3() * (seconds / mass);
            }
        }
        for (point, force) in points.iter().filter(|(it, _)| it.fits(self.x.len())) {
            for (particle, weight) in point.terms() {
                let i = particle.index();
                self.v[i] += force.as_dvec3() * (f64::from(weight) * self.w[i] * seconds);
            }
        }
    }

    /// Moves pins by their part of the way in a substep, with its number and their count.
    pub(super) fn move_pins(&mut self, (substep, substeps): (u32, u32)) {
        let targets = self.controls.targets.as_ref();
        // The last one of a vertex counts: it moves the pin all the way that is left.
        for (vertex, target) in targets.into_iter().flat_map(|it| &it.0) {
            if vertex.index() < self.x.len() && target.is_finite() {
                let i = self.topology.particle(*vertex);
                if self.w[i] == 0.0 {
                    let way = target.as_dvec3() - self.p[i];
                    self.x[i] = self.p[i] + way / f64::from(substeps - substep);
                }
            }
        }
    }

    /// Prepares the grabs of an app.
    pub(super) fn prepare_grabs(&mut self) {
        let grabs: Vec<Grab> = self.grabs();
        self.grab_states.resize_with(grabs.len(), Default::default);
        for (grab, state) in grabs.iter().zip(&mut self.grab_states) {
            if is_sound(grab, self.x.len()) {
                grab.prepare_reference(state, &self.topology, &self.x, &self.w);
            }
        }
    }

    /// Pulls by the grabs of an app, in an iteration.
    pub(super) fn pull_by_grabs(&mut self, pass: &ReferencePass) {
        let mut states: Vec<ReferenceGrab> = take(&mut self.grab_states);
        for (grab, state) in self.grabs().iter().zip(&mut states) {
            if is_sound(grab, self.x.len()) {
                let (_, particles) = self.split();
                grab.solve_reference(state, particles, pass);
            }
        }
        self.grab_states = states;
    }

    fn grabs(&self) -> Vec<Grab> {
        let grabs = self.controls.grabs.iter().flat_map(Grabs::iter);
        grabs.copied().collect()
    }
}
