//! Forces between two bodies, added up over the substeps of a tick.

use super::row::{Active, ContactRow};
use glam::DVec3;

/// What two bodies that touched in a tick have done to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PairContact {
    /// Places of the bodies among those that are stepped together, in ascending order.
    pub bodies: [u32; 2],
    /// Mean force on the first one over the substeps of the tick so far [N]: normal forces, friction
    /// and the impulses of restitution.
    pub force: DVec3,
    /// Mean sum of the normal forces of all contacts of the two [N].
    pub normal_force: f64,
}

/// Sums over the substeps of a tick.
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    /// By bodies, in ascending order; forces are not divided by the substeps.
    pairs: Vec<PairContact>,
    substeps: u32,
}

impl Sums {
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.substeps = 0;
    }

    /// Adds the contacts of a substep of `h` seconds between bodies, and those that touch without a force.
    pub fn add(
        &mut self,
        rows: &[ContactRow],
        h: f64,
        (active, touching): (&[Active], &[[u32; 2]]),
    ) {
        self.substeps += 1;
        for &bodies in touching {
            self.place(bodies);
        }
        // Contacts of two bodies follow each other for the most part.
        let mut last = 0;
        // Rigid bodies have their contacts with ground and colliders among them.
        let between = rows.iter().filter(|row| !row.is_fixed());
        for row in between.filter(|row| row.acts()) {
            let [a, b] = row.bodies(active);
            let (bodies, sign) = if a <= b {
                ([a, b], 1.0)
            } else {
                ([b, a], -1.0)
            };
            if self.pairs.get(last).is_none_or(|it| it.bodies != bodies) {
                last = self.place(bodies);
            }
            let (normal, impulse) = row.total_impulse(h);
            self.pairs[last].normal_force += normal / h;
            self.pairs[last].force += impulse * (sign / h);
        }
    }

    /// Place of two bodies, in ascending order, among the pairs.
    fn place(&mut self, bodies: [u32; 2]) -> usize {
        let place = self.pairs.binary_search_by_key(&bodies, |it| it.bodies);
        place.unwrap_or_else(|place| {
            let new = PairContact {
                bodies,
                force: DVec3::ZERO,
                normal_force: 0.0,
            };
            self.pairs.insert(place, new);
            place
        })
    }

    /// Removes the sums; returns the number of substeps.
    pub fn take(&mut self, each: impl FnMut(PairContact)) -> u32 {
        self.pairs.drain(..).for_each(each);
        std::mem::take(&mut self.substeps)
    }

    /// The means so far.
    pub fn means(&self) -> impl Iterator<Item = PairContact> {
        let part = 1.0 / f64::from(self.substeps.max(1));
        self.pairs.iter().map(move |it| PairContact {
            force: it.force * part,
            normal_force: it.normal_force * part,
            ..*it
        })
    }
}
