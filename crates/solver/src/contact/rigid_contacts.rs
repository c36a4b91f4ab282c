//! Contacts of rigid bodies: their passes, and rows with the ground and with colliders.

use super::{
    between::Between,
    contacts::Contacts,
    manifold::Touch,
    rigid::{Rigid, restore_shape},
    row::{ContactPart, ContactRow, NO_INDEX, Plane},
    tangible::Tangible,
};
use crate::{
    RigidSurface, Substep,
    colliders::{collider::SweptCollider, shape::Exit},
    topology::features::Features,
};
use glam::DVec3;
use std::mem::take;

/// Reach of a contact with the ground or a collider beyond the predicted motion, as a fraction of
/// the mean edge: the body may turn towards it within a substep.
const REACH: f64 = 0.1;

impl Contacts {
    /// Begins a substep of the rigid bodies.
    pub(super) fn begin_rigid(&mut self, bodies: &[impl Tangible]) {
        for rigid in &mut self.rigids {
            rigid.begin(&bodies[rigid.body]);
        }
    }

    /// Begins a pass, from where the particles are now; one that moves rigid bodies, if so. A grab has moved single
    /// ones of these: it moves the whole body, as they are pulled to the best fit of its shape.
    pub(super) fn begin_pass(&mut self, bodies: &mut [impl Tangible], moves_rigid: bool) {
        for rigid in self.rigids.iter_mut().filter(|_| moves_rigid) {
            let body = &mut bodies[rigid.body];
            if body.effects().grab.is_some() && rigid.is_movable() {
                restore_shape(body);
            }
            rigid.begin_pass(body, |i| body.now(i));
        }
        for it in &mut self.active {
            it.now = match bodies.get(it.body as usize) {
                Some(body) => body.now(it.particle as usize),
                None => self.ends[it.vertex as usize],
            };
        }
    }

    /// Moves the particles of the rigid bodies after a pass.
    pub(super) fn end_pass(&self, bodies: &mut [impl Tangible]) {
        for rigid in &self.rigids {
            rigid.write_back(&mut bodies[rigid.body]);
        }
    }

    /// Separates rigid bodies from what is closer than its distance, after the last iteration and before truncation.
    pub(crate) fn lift(&mut self, bodies: &mut [impl Tangible]) {
        if self.rows.iter().flatten().any(ContactRow::is_rigid) {
            self.begin_pass(bodies, true);
            let Self {
                rows,
                active,
                rigids,
                ..
            } = self;
            self.rigid_rows.lift(rows, active, rigids);
            self.write_back(bodies);
            self.end_pass(bodies);
        }
    }

    /// Takes the displacement by separation out of velocities, after the last stage.
    pub(crate) fn drop_lift(&mut self, bodies: &mut [impl Tangible]) {
        for rigid in &mut self.rigids {
            let body = &mut bodies[rigid.body];
            rigid.drop_lift(body);
        }
        for it in &mut self.active {
            let lift = take(&mut it.parts[ContactPart::Lift as usize]);
            if lift != DVec3::ZERO
                && let Some(body) = bodies.get_mut(it.body as usize)
            {
                body.accelerate(it.particle as usize, -lift);
            }
        }
    }

    /// Begins to change velocities, at the end of a substep.
    pub(super) fn begin_bounce(&mut self, bodies: &[impl Tangible]) {
        for rigid in &mut self.rigids {
            let body = &bodies[rigid.body];
            rigid.begin_pass(body, |i| body.start(i));
        }
    }

    /// Changes the velocities of the particles of the rigid bodies.
    pub(super) fn end_bounce(&self, bodies: &mut [impl Tangible]) {
        for rigid in &self.rigids {
            if rigid.has_moved() {
                let body = &mut bodies[rigid.body];
                for i in 0..body.topology().particles() {
                    body.accelerate(i, rigid.displacement_at(body.start(i)));
                }
            }
        }
    }

    /// Creates rows of rigid bodies with the ground and with spheres, boxes and capsules.
    pub(super) fn make_fixed_rows(
        &mut self,
        bodies: &[impl Tangible],
        colliders: &[SweptCollider],
        step: &Substep,
    ) {
        let h = f64::from(step.h);
        let first = self.rows[Between::Bodies as usize].len();
        for number in 0..self.rigids.len() {
            let Rigid { body, member, .. } = self.rigids[number];
            if !self.rigids[number].is_movable() {
                continue;
            }
            let member = &self.members[member];
            let effects = bodies[body].effects();
            let recovery = effects.contact.map_or(0.0, |it| it.params().recovery(h));
            let reach = REACH * f64::from(member.surface.mean_edge);
            for v in member.vertices() {
                let (start, end) = (self.starts[v], self.ends[v]);
                let near = reach + 1.5 * (end - start).length();
                let mut add = |plane: Plane| {
                    let place = &mut self.places[v];
                    if *place == NO_INDEX {
                        *place = self.active.len() as u32;
                        self.active.push(member.active(v as u32, [start, end], 0.0));
                    }
                    let row = ContactRow::fixed(*place, &plane, &self.active, &self.rigids);
                    self.rows[Between::Bodies as usize].push(row);
                };
                let is_corner = |it: &Features| it.is_corner[v - member.first];
                if let Some(ground) = effects.ground
                    && member.features().is_none_or(is_corner)
                {
                    let gap = start.y - f64::from(ground.height.get());
                    if gap < near {
                        add(Plane {
                            surface: RigidSurface::Ground,
                            normal: DVec3::Y,
                            height: f64::from(ground.height.get()),
                            gap,
                            carried: DVec3::ZERO,
                            friction: ground.friction.into(),
                            restitution: ground.restitution.into(),
                            recovery,
                        });
                    }
                }
                let Some(collide) = effects.collide else {
                    continue;
                };
                for (number, collider) in (0..).zip(colliders) {
                    let SweptCollider { shape, from, to } = collider;
                    let carried = |x: DVec3| to.apply(x) - from.apply(x);
                    let before = from.undo(start);
                    let gap = shape.distance(before);
                    let moved = carried(before).length();
                    if gap > near + moved {
                        continue;
                    }
                    let after = to.undo(end);
                    let Exit { normal, depth } = shape
                        .exit(before, after, 0.0)
                        .unwrap_or_else(|| shape.approach(after, 0.0));
                    let surface = after + normal * depth;
                    let normal = to.rotation * normal;
                    add(Plane {
                        surface: RigidSurface::Collider(number),
                        normal,
                        height: normal.dot(to.apply(surface)),
                        gap,
                        carried: carried(surface),
                        friction: collide.friction.into(),
                        restitution: collide.restitution.into(),
                        recovery,
                    });
                }
            }
        }
        let all = &mut self.rows[Between::Bodies as usize];
        let touches = &mut self.rigid_pairs.touches;
        touches.clear();
        touches.extend(all[first..].iter().map(|row| Touch {
            of: row.rigids[0],
            normal: row.normal(),
            point: row.point(&self.active),
            error: row.predicted_error(),
            distance: 0.0,
        }));
        let mut kept = self.manifolds.keep(touches).iter();
        let mut number = 0;
        all.retain(|_| {
            number += 1;
            number <= first || kept.next().copied().unwrap_or(true)
        });
    }
}
