//! Forces of the ground and of colliders on a body, added up over the substeps of a tick.
//!
//! A contact changes the velocity of a particle by Δv = Δ(u − c)/h. The impulse m Δv of each pass is
//! added to that of the surface, so that the sum over a tick is exact whatever the passes do:
//! friction and restitution are included, and particles that touch several surfaces. Motion into a
//! mesh or a rigid body that is cut off (see [`contact`](crate::contact)) is not.

use glam::DVec3;
use std::collections::BTreeMap;

/// The ground of a body, or a collider.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RigidSurface {
    /// The plane of [`Ground`](crate::Ground) or [`StickyGround`](crate::StickyGround).
    Ground,
    /// A collider, by its index.
    Collider(u32),
}

/// What a surface has done to a body in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SurfaceForce {
    /// The surface.
    pub surface: RigidSurface,
    /// Force on the body, the mean over the tick [N]: normal forces, friction and the impulses of
    /// restitution.
    pub force: DVec3,
    /// Sum of the normal forces on all particles, the mean over the tick [N].
    pub normal_force: f64,
    /// Number of particles that touched it in the tick, at least 1.
    pub particles: u32,
    /// Mean position of these particles at the end of the tick, weighted by their normal forces [m].
    pub point: DVec3,
}

/// Impulse of a surface on a particle in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Push {
    pub surface: RigidSurface,
    /// All of it [N·s].
    pub impulse: DVec3,
    /// Sum of its parts along the normals [N·s].
    pub normal: f64,
}

/// Impulses of all surfaces that a particle has touched in a tick.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Pushes(Vec<Push>);

impl Pushes {
    /// Adds an impulse.
    pub fn add(&mut self, push: Push) {
        match self.0.iter_mut().find(|it| it.surface == push.surface) {
            Some(sum) => {
                sum.impulse += push.impulse;
                sum.normal += push.normal;
            }
            None => self.0.push(push),
        }
    }

    /// Adds a change of u − c [m] by a surface with this outward normal, for a particle of an
    /// inverse mass [1/kg] in a substep of `h` seconds.
    pub fn displaced(
        &mut self,
        surface: RigidSurface,
        (change, normal): (DVec3, DVec3),
        (inverse_mass, h): (f32, f32),
    ) {
        let impulse = change / (f64::from(inverse_mass) * f64::from(h));
        self.add(Push {
            surface,
            impulse,
            normal: impulse.dot(normal),
        });
    }
}

/// Recorded contacts of a body; one pointer in bodies without.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Recorded(Option<Box<Lists>>);

#[derive(Debug, Clone, PartialEq, Default)]
struct Lists {
    /// Impulses on each particle in the tick so far; empty unless contacts are recorded.
    pushes: Vec<Pushes>,
    /// Forces in the last tick, sorted by surface.
    forces: Vec<SurfaceForce>,
}

impl Recorded {
    /// Impulses on each particle in the tick so far; empty unless contacts are recorded.
    pub fn pushes(&mut self) -> &mut [Pushes] {
        self.0.as_mut().map_or(&mut [], |lists| &mut lists.pushes)
    }

    /// Forces in the last tick, sorted by surface.
    pub fn forces(&self) -> &[SurfaceForce] {
        self.0.as_ref().map_or(&[], |lists| &lists.forces)
    }

    /// Turns the impulses on particles at these positions [m] into means over the `seconds` of a tick.
    pub fn end_tick(&mut self, position: impl Fn(usize) -> DVec3, seconds: f64) {
        let Some(lists) = &mut self.0 else {
            return;
        };
        lists.forces.clear();
        let mut sums = BTreeMap::new();
        for (i, Pushes(pushes)) in lists.pushes.iter_mut().enumerate() {
            for push in pushes.drain(..) {
                let sum = sums.entry(push.surface).or_insert(SurfaceForce {
                    surface: push.surface,
                    force: DVec3::ZERO,
                    normal_force: 0.0,
                    particles: 0,
                    point: position(i),
                });
                let weight = push.normal.max(0.0);
                sum.force += push.impulse;
                sum.normal_force += weight;
                sum.particles += 1;
                // A running mean stays among the particles, also far from the origin.
                if sum.normal_force > 0.0 {
                    sum.point += (position(i) - sum.point) * (weight / sum.normal_force);
                }
            }
        }
        let mean = |sum: SurfaceForce| SurfaceForce {
            force: sum.force / seconds,
            normal_force: sum.normal_force / seconds,
            ..sum
        };
        lists.forces.extend(sums.into_values().map(mean));
    }

    /// Forgets the contacts of a tick that failed.
    pub fn clear(&mut self) {
        if let Some(lists) = &mut self.0 {
            lists.pushes.clear();
            lists.forces.clear();
        }
    }

    /// Forgets the forces of the last tick.
    pub fn clear_forces(&mut self) {
        if let Some(lists) = &mut self.0 {
            lists.forces.clear();
        }
    }

    /// Allocates impulses for a number of particles, or forgets all if contacts are not recorded.
    pub fn prepare(&mut self, particles: usize, is_recorded: bool) {
        if !is_recorded {
            self.0 = None;
            return;
        }
        let lists = self.0.get_or_insert_default();
        if lists.pushes.len() != particles {
            lists.pushes = vec![Pushes::default(); particles];
        }
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        let Some(Lists { pushes, forces }) = self.0.as_deref() else {
            return 0;
        };
        let each = pushes.iter();
        let each = each.map(|Pushes(pushes)| pushes.capacity() * size_of::<Push>());
        size_of::<Lists>()
            + size_of_val(&pushes[..])
            + size_of_val(&forces[..])
            + each.sum::<usize>()
    }
}
