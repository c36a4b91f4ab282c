//! Ground contact in lanes.

use super::ground::Ground;
use crate::{
    ContactMultiplier, Friction, Height,
    colliders::rise::rise,
    effects::body_effect::BodyPass,
    kernel::each::{ParticlePass, Question},
    lanes::{Columns, Doubles, Floats, Lanes, Vectors},
};
use fearless_simd::prelude::*;

/// Whether a particle is below the ground and can move, by the operations of one particle after the
/// other; for bodies without radii.
#[derive(Clone, Copy)]
pub(super) struct Below(pub Height);

impl Below {
    #[inline(always)]
    fn mask<L: Lanes>(&self, position: &Columns<L>, moved: &Vectors<L>) -> MaskOf<L, Floats<L>> {
        let is_below = ((position[1] - self.0.get()) + moved[1]).simd_lt(0.0);
        is_below & position[3].simd_gt(0.0)
    }
}

/// A mask for numbers of type `F`.
type MaskOf<L, F> = <F as SimdBase<L>>::Mask;

impl Question for Below {
    #[inline(always)]
    fn holds<L: Lanes>(&self, position: &Columns<L>, moved: &Vectors<L>) -> bool {
        self.mask::<L>(position, moved).any_true()
    }
}

/// A pass of the [`Ground`] in lanes, with the bits of one particle after the other for finite
/// displacements. Terms that are 0 for a vertical normal are left out; where one turns −0 into +0, 0 is
/// added instead.
#[derive(Clone, Copy)]
pub(super) struct Lift {
    below: Below,
    /// Fraction of the depth by which what starts below the ground rises.
    rise: f64,
    friction: f64,
}

impl Lift {
    /// Of a pass that nothing is kept of; `None` with radii or restitution.
    pub fn of(ground: &Ground, kept: &[ContactMultiplier], pass: &BodyPass) -> Option<Self> {
        let is_plain = kept.is_empty() && pass.topology.radii.is_empty();
        let friction = match pass.is_frictionless {
            true => Friction::NONE,
            false => ground.friction,
        };
        (is_plain && ground.restitution.get() == 0.0).then(|| Self {
            below: Below(ground.height),
            rise: rise(pass.h),
            friction: friction.into(),
        })
    }

    /// Displacements of particles at heights y [m] that have `moved` and `began` [m], and where they
    /// have changed.
    #[inline(always)]
    fn lifted<L: Lanes>(
        &self,
        simd: L,
        y: Doubles<L>,
        moved: [Doubles<L>; 3],
        began: [Doubles<L>; 3],
    ) -> ([Doubles<L>; 3], MaskOf<L, Doubles<L>>) {
        let zero = Doubles::<L>::splat(simd, 0.0);
        let one = Doubles::<L>::splat(simd, 1.0);
        let base = y - f64::from(self.below.0.get());
        let below = -base;
        let rising = -below * (1.0 - self.rise);
        let surface = below.simd_gt(zero).select(rising, zero);
        let depth = surface - (base + moved[1]);
        let slip = [(moved[0] - began[0]) + 0.0, (moved[2] - began[2]) + 0.0];
        let size = (slip[0] * slip[0] + slip[1] * slip[1]).sqrt();
        let limit = depth * self.friction;
        let held = size.simd_le(limit).select(one, limit / size);
        let lifted = [
            moved[0] + (zero - slip[0] * held),
            moved[1] + depth,
            moved[2] + (zero - slip[1] * held),
        ];
        (lifted, depth.simd_gt(zero))
    }
}

impl ParticlePass for Lift {
    #[inline(always)]
    fn act<L: Lanes>(
        &self,
        simd: L,
        position: &Columns<L>,
        moved: &mut Vectors<L>,
        carry: &mut Vectors<L>,
    ) -> u64 {
        let is_below = self.below.mask::<L>(position, moved);
        if !is_below.any_true() {
            return 0;
        }
        let y = position[1].widen();
        let [mx, my, mz] = [moved[0].widen(), moved[1].widen(), moved[2].widen()];
        let [cx, cy, cz] = [carry[0].widen(), carry[1].widen(), carry[2].widen()];
        let (low, low_acts) = self.lifted(simd, y.0, [mx.0, my.0, mz.0], [cx.0, cy.0, cz.0]);
        let (high, high_acts) = self.lifted(simd, y.1, [mx.1, my.1, mz.1], [cx.1, cy.1, cz.1]);
        let acts = is_below & low_acts.narrow(high_acts);
        for axis in 0..3 {
            let lifted = low[axis].narrow(high[axis]);
            moved[axis] = acts.select(lifted, moved[axis]);
            carry[axis] = acts.select(carry[axis] + 0.0, carry[axis]);
        }
        acts.to_bitmask()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Body, Density, Instructions, Particles, RestShape, Threads, Topology,
        effects::body_effect::BodyEffect, kernel::random::Draws,
    };
    use glam::{Vec3, vec3};
    use std::sync::Arc;

    /// A pass in lanes has the bits of one particle after the other, which a pass has whose multipliers
    /// are kept: above, on and below the ground, at rest, in motion, and pinned; with zeros of either
    /// sign.
    #[test]
    fn lanes_have_the_bits_of_one_particle_after_the_other() {
        let points = (0..103).map(|i| vec3(i as f32, 0.0, 0.0));
        let shape = RestShape {
            vertices: points.collect(),
            edges: (1..103).map(|i| [i - 1, i]).collect(),
            ..RestShape::default()
        };
        let topology = Arc::new(Topology::new(shape).expect("a sound rope"));
        let body = Body::new("rope", Arc::clone(&topology), Density::of(1.0));
        let threads = Threads::default();
        let mut draws = Draws::new([7]);
        let mut acted = 0;
        for friction in [0.0, 0.5, 10.0] {
            for height in [0.0, -0.3, 1000.0] {
                let ground = Ground {
                    height: Height::of(height),
                    friction: Friction::of(friction),
                    ..Ground::default()
                };
                let mut start = body.particles.clone();
                for i in 0..start.positions.len() {
                    let mut draw = |size: f64| match draws.next() {
                        it if it < 0.1 => 0.0,
                        it if it < 0.2 => -0.0,
                        it => ((it - 0.6) * size) as f32,
                    };
                    let place = vec3(draw(1.0), height + draw(0.02), draw(1.0));
                    let weight = if i % 7 == 0 { 0.0 } else { 1.0 };
                    start.positions[i] = place.extend(weight);
                    start.displacements[i] = vec3(draw(0.02), draw(0.02), draw(0.02)).extend(0.0);
                    start.carry[i] = vec3(draw(1e-7), draw(1e-7), draw(1e-7)).extend(0.0);
                }
                let pass = |instructions, kept: &mut [ContactMultiplier]| {
                    let mut particles: Particles = start.clone();
                    let pass = BodyPass {
                        topology: &topology,
                        first: 0,
                        colliders: &[],
                        sides: &[],
                        gravity: Vec3::NEG_Y,
                        seconds: 1e-3,
                        h: 1e-3,
                        compliant: 1e-3,
                        relaxation: 1.0,
                        substep: (0, 1),
                        iteration: (0, 1),
                        is_frictionless: false,
                        rolling_resistance: 0.0,
                        instructions,
                        threads: &threads,
                    };
                    let touched = ground.solve(kept, particles.as_part(), &pass);
                    let bits = [&particles.displacements, &particles.carry]
                        .map(|column| column.iter().map(|it| it.to_array().map(f32::to_bits)))
                        .map(Iterator::collect::<Vec<_>>);
                    (touched, bits)
                };
                let mut kept = vec![ContactMultiplier::default(); start.positions.len()];
                let expected = pass(Instructions::default(), &mut kept);
                acted += kept.iter().filter(|it| it.normal > 0.0).count();
                for instructions in Instructions::all() {
                    assert_eq!(
                        pass(instructions, &mut []),
                        expected,
                        "{}",
                        instructions.name()
                    );
                }
            }
        }
        assert!(acted > 200, "{acted} contacts");
    }
}
