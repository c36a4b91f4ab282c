//! Records the impulses of colliders that are meshes, and of the ground and all colliders on rigid
//! bodies.

use super::{
    between::Between,
    contacts::{Contacts, Member, Owner},
    row::{ContactRow, NO_INDEX},
    tangible::Tangible,
};
use crate::{RigidSurface, particles::surface_force::Push};

impl Contacts {
    /// Records the contacts of a substep, with restitution, on the bodies that record them.
    pub(super) fn record(&self, bodies: &mut [impl Tangible]) {
        if !bodies.iter().any(Tangible::records_contacts) {
            return;
        }
        let kinds = [Between::Bodies, Between::Colliders];
        let rows = kinds.iter().flat_map(|kind| &self.rows[*kind as usize]);
        for row in rows.filter(|row| row.acts()) {
            let Some(surface) = self.surface_of(row) else {
                continue;
            };
            let (normal, impulse) = row.total_impulse(self.h);
            for (corner, weight) in row.weighted_corners() {
                let it = &self.active[corner as usize];
                let Some(body) = bodies.get_mut(it.body as usize) else {
                    continue;
                };
                if weight != 0.0 && body.records_contacts() {
                    let push = Push {
                        surface,
                        impulse: impulse * weight,
                        normal: normal * weight.abs(),
                    };
                    body.record(it.particle as usize, push);
                }
            }
        }
    }

    /// The rigid surface of a contact; `None` between bodies.
    fn surface_of(&self, row: &ContactRow) -> Option<RigidSurface> {
        if row.plane().is_some() {
            return row.plane();
        }
        let ends = row.ends().map(|corner| &self.active[corner as usize]);
        let collider = ends.into_iter().find(|it| it.body == NO_INDEX)?;
        // Members are in the order of their vertices.
        let starts_before = |member: &Member| member.first <= collider.vertex as usize;
        let place = self.members.partition_point(starts_before).checked_sub(1)?;
        match self.members[place].owner {
            Owner::Collider(number) => Some(RigidSurface::Collider(number as u32)),
            Owner::Body(_) => None,
        }
    }
}
