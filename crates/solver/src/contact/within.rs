//! Bodies within a closed collider, which neither cross it nor touch it.
//!
//! Contacts keep surfaces on the sides that they are on, and would keep such a body within. Each
//! connected part of a body, and each particle by itself otherwise, as a grain, leaves to the side on
//! which it is nearest to the surface, at the recovery speed. Until it is out, contacts of it with the
//! collider are left out.

use super::{
    closed_mesh::ClosedMesh,
    contacts::{Contacts, Member, Owner},
    tangible::Tangible,
    tangle::{Crossed, Extent, Tangle},
};
use std::collections::BTreeMap;

impl Contacts {
    /// Finds the parts of bodies within closed colliders, where either may have got there, and the body
    /// does not cross the collider.
    pub(super) fn find_within(
        &mut self,
        bodies: &[impl Tangible],
        crossed: &BTreeMap<[u32; 2], Crossed>,
    ) {
        let mut found = Vec::new();
        let mut meshes = std::mem::take(&mut self.closed);
        for (b, collider) in (0..).zip(&self.members) {
            if !collider.is_collider() || !collider.surface.is_closed() {
                continue;
            }
            let known = &mut meshes[b as usize];
            if collider.is_stepped {
                *known = None;
            }
            for (a, member) in (0..b).zip(&self.members) {
                let may_be_within = self.may_cross[a as usize] || self.teleported[b as usize];
                if let Owner::Body(body) = member.owner
                    && may_be_within
                    && member.between(collider).is_some()
                    && !crossed.contains_key(&[a, b])
                {
                    let mesh = known.get_or_insert_with(|| self.mesh(collider));
                    let at = |i: u32| bodies[body].start(i as usize);
                    let parts = mesh.parts_within(bodies[body].topology(), at);
                    found.extend(parts.into_iter().map(|part| Tangle {
                        members: [a, b],
                        direction: mesh.way_out(&part, at),
                        extent: Extent::Part(part),
                        multiplier: 0.0,
                    }));
                }
            }
        }
        self.closed = meshes;
        self.tangles.extend(found);
    }

    fn mesh(&self, member: &Member) -> ClosedMesh {
        let at = |corner: u32| self.starts[member.first + corner as usize];
        let triangles = member.surface.triangles.iter();
        ClosedMesh::new(triangles.map(|it| it.map(at)).collect())
    }
}
