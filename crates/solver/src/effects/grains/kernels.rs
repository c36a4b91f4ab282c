//! Contacts of grains in blocks of eight that share no grain, one per lane.

use crate::{
    kernel::arithmetic::{Arithmetic, cross, dot},
    lanes::{Floats, Lanes, SimdWork, Vectors, WIDTH},
};
use fearless_simd::{f32x4, prelude::*};
use glam::Vec4;

/// Grains closer than this fraction of their distance count as touching for cohesion.
pub const TOUCHING: f32 = 0.01;

/// Limits of the multipliers in a pass.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Coefficients of static and of kinetic friction.
    pub friction: [f32; 2],
    /// Largest pull of a touching pair, Fh² [kg·m].
    pub cohesion: f32,
    /// Whether friction of earlier passes no longer counts.
    pub releases_friction: bool,
    /// Coefficient of rolling resistance.
    pub rolling: f32,
}

/// What the rotation of eight pairs of grains needs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Roll {
    /// 1/r of the grains [1/m].
    pub curvatures: [[f32; WIDTH]; 2],
    /// Multiplier of rolling resistance [kg·m²]; over h², a torque.
    torque: [[f32; WIDTH]; 3],
}

/// Eight contacts.
#[derive(Debug, Clone, Copy, Default)]
pub struct Block {
    /// Places of the grains in the columns of the piece. Unused lanes refer to the last one, which has no
    /// mass.
    pub places: [[u32; WIDTH]; 2],
    /// Inverse masses [1/kg].
    pub weights: [[f32; WIDTH]; 2],
    normal: [[f32; WIDTH]; 3],
    /// Distance at the start of the substep beyond that to maintain [m].
    gap: [f32; WIDTH],
    /// λₙ and λₜ [kg·m].
    push: [f32; WIDTH],
    friction: [[f32; WIDTH]; 3],
    /// Slip before the substep that friction has not taken back yet [m]. Without it, what a pass
    /// leaves would be lost, and piles would creep.
    anchor: [[f32; WIDTH]; 3],
}

/// What passes do not need of eight contacts: separate, so that they read less.
#[derive(Debug, Clone, Copy, Default)]
pub struct Start {
    /// Sum of the radii [m].
    pub distance: [f32; WIDTH],
    /// 1 if the grains touch at the start of the substep, otherwise 0; for cohesion.
    touches: [f32; WIDTH],
    /// Vector between the grains at the start of the last substep [m].
    apart: [[f32; WIDTH]; 3],
}

impl Block {
    /// With unused lanes only, whose grains are at this place.
    pub fn unused(place: usize) -> Self {
        Self {
            places: [[place as u32; WIDTH]; 2],
            ..Self::default()
        }
    }
}

/// The rows of a column, two lanes in each: k and k + 4.
#[inline(always)]
fn rows<L: Lanes>(simd: L, column: &[Vec4], places: &[u32; WIDTH]) -> [Floats<L>; 4] {
    simd.rows(
        #[inline(always)]
        |lane| f32x4::simd_from(simd, column[places[lane] as usize].to_array()),
    )
}

/// The part of a vector across the normal.
#[inline(always)]
fn tangential<F: Arithmetic>(normal: &[F; 3], [x, y, z]: [F; 3]) -> [F; 3] {
    let along = dot(normal, &[x, y, z]);
    [
        x - normal[0] * along,
        y - normal[1] * along,
        z - normal[2] * along,
    ]
}

#[inline(always)]
fn sum<F: Arithmetic>(a: &[F; 3], b: &[F; 3]) -> [F; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// 1/x where x is positive, otherwise 0.
#[inline(always)]
fn inverse<L: Lanes>(simd: L, x: Floats<L>) -> Floats<L> {
    let zero = simd.number(0.0);
    let one = simd.number(1.0);
    let is_some = x.simd_gt(zero);
    is_some.select(one / is_some.select(x, one), zero)
}

/// The vectors at eight places.
#[inline(always)]
fn vectors<L: Lanes>(simd: L, column: &[Vec4], places: &[u32; WIDTH]) -> Vectors<L> {
    let [x, y, z, _] = simd.transpose(rows(simd, column, places));
    [x, y, z]
}

/// mr²/I of a ball.
const LEVER: f32 = crate::effects::rigid::response::LEVER as f32;

/// What pairs of grains that rotate want to reach: that they neither slip nor roll on each other.
///
/// With the impulse p of friction, the torque τ, c = 5/2 (w₁/r₁ − w₂/r₂), W_ρ = 5/2 (w₁/r₁² + w₂/r₂²)
/// and W_t = 7/2 (w₁ + w₂), the slip s and the relative rotation ρ become
///
/// s + W_t p + c n × τ and ρ − c n × p + W_ρ τ.
///
/// Both are solved together; with a torque beyond its limit, only the first one.
struct NoSlip<'a, L: Lanes> {
    normal: &'a Vectors<L>,
    weights: &'a [Floats<L>; 2],
    /// Without rotation [m].
    slip: Vectors<L>,
    /// Friction of earlier passes [kg·m].
    held: &'a Vectors<L>,
    /// Limits of friction [kg·m], and of the torque over the reduced radius r₁r₂/(r₁ + r₂) [kg·m].
    limits: [Floats<L>; 2],
}

impl<L: Lanes> NoSlip<'_, L> {
    /// The impulse of friction [kg·m], not limited yet, and the change of the torque.
    #[inline(always)]
    fn reach(
        self,
        simd: L,
        turns: &[Vec4],
        (block, roll): (&Block, &mut Roll),
    ) -> (Vectors<L>, Vectors<L>) {
        let Self {
            normal,
            weights: [w0, w1],
            slip,
            held: friction,
            limits: [max_friction, max_torque],
        } = self;
        let zero = simd.number(0.0);
        let one = simd.number(1.0);
        let load = |column: &[f32; WIDTH]| simd.load(column);
        let [k0, k1] = roll.curvatures.each_ref().map(load);
        let [a, b] = block.places.map(|places| vectors(simd, turns, &places));
        let rolled = cross(&sum(&a, &b), normal);
        let slip: Vectors<L> = tangential(normal, std::array::from_fn(|k| slip[k] - rolled[k]));
        let turned: Vectors<L> = std::array::from_fn(|k| a[k] * k0 - b[k] * k1);
        let mixed = (*w0 * k0 - *w1 * k1) * LEVER;
        let of_turn = inverse(simd, (*w0 * k0 * k0 + *w1 * k1 * k1) * LEVER);
        let of_slip = (*w0 + *w1) * (1.0 + LEVER);
        // The mixed term takes at most 5/2 (w₁ + w₂) of it.
        let both = inverse(simd, of_slip - mixed * mixed * of_turn);
        let across = cross(normal, &turned);
        // What friction can do of it.
        let all: Vectors<L> =
            std::array::from_fn(|k| friction[k] + (across[k] * mixed * of_turn - slip[k]) * both);
        let size = dot(&all, &all).sqrt();
        let over = size.simd_gt(max_friction);
        let scale = over.select(max_friction / over.select(size, one), one);
        let by: Vectors<L> = std::array::from_fn(|k| all[k] * scale - friction[k]);
        let behind = cross(normal, &by);
        let held = roll.torque.each_ref().map(load);
        let wanted: Vectors<L> =
            std::array::from_fn(|k| held[k] + (behind[k] * mixed - turned[k]) * of_turn);
        let size = dot(&wanted, &wanted).sqrt();
        let most = max_torque * inverse(simd, k0 + k1);
        let over = size.simd_gt(most);
        let scale = over.select(most / over.select(size, one), one);
        let mut change = [zero; 3];
        for k in 0..3 {
            let torque = wanted[k] * scale;
            change[k] = torque - held[k];
            torque.store_slice(&mut roll.torque[k]);
        }
        let bent = cross(normal, &change);
        let of_slip = inverse(simd, of_slip);
        let p = std::array::from_fn(|k| zero - (slip[k] + bent[k] * mixed) * of_slip);
        (p, change)
    }
}

/// Turns the grains of eight pairs by n × p, p being the impulse of friction, and by a torque.
#[inline(always)]
fn turn<L: Lanes>(
    simd: L,
    turns: &mut [Vec4],
    (block, roll): (&Block, &Roll),
    by: &Vectors<L>,
    torque: &Vectors<L>,
) {
    let load = |column: &[f32; WIDTH]| simd.load(column);
    for side in 0..2 {
        let [weight, curvature] = [&block.weights[side], &roll.curvatures[side]].map(load);
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let places = &block.places[side];
        let before = rows(simd, turns, places);
        let change = std::array::from_fn(|k| torque[k] * curvature * sign - by[k]);
        add(simd, turns, (places, before), change, weight * LEVER);
    }
}

/// Multipliers begin a substep at this fraction of their last values, as far as the pairs are the
/// same. Most of the load is the same in all substeps, which halves the overlap in a pile. With all
/// of it the pile jitters: its grains have ten times the speed.
const WARM: f32 = 0.5;

/// Normals and gaps; multipliers and anchors from those of the last substep.
pub struct Begin<'a> {
    pub blocks: &'a mut [Block],
    pub starts: &'a mut [Start],
    pub rolls: &'a mut [Roll],
    /// Positions, carries and rotations of the places [m].
    pub positions: &'a [Vec4],
    pub carries: &'a [Vec4],
    pub turns: &'a [Vec4],
    /// Distance by which overlapping grains separate at most [m].
    pub recovery: f32,
    /// Coefficient of static friction.
    pub friction: f32,
}

impl SimdWork for Begin<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            blocks,
            starts,
            rolls,
            positions,
            carries,
            turns,
            ..
        } = self;
        let zero = simd.number(0.0);
        let one = simd.number(1.0);
        for (number, (block, start)) in blocks.iter_mut().zip(starts).enumerate() {
            let [a, b] = block.places.map(|places| rows(simd, positions, &places));
            let [c, d] = block.places.map(|places| rows(simd, carries, &places));
            let apart = std::array::from_fn(|k| (a[k] - b[k]) + (c[k] - d[k]));
            let [x, y, z, _] = simd.transpose(apart);
            let length = dot(&[x, y, z], &[x, y, z]).sqrt();
            let has_direction = length.simd_gt(zero);
            let inverse = has_direction.select(one / has_direction.select(length, one), zero);
            let distance = simd.load(&start.distance);
            let kept = distance.min(length + self.recovery);
            let normal = [x * inverse, y * inverse, z * inverse];
            for (to, along) in block.normal.iter_mut().zip(normal) {
                along.store_slice(to);
            }
            (length - kept).store_slice(&mut block.gap);
            let touches = length.simd_lt(distance * (1.0 + TOUCHING));
            touches.select(one, zero).store_slice(&mut start.touches);
            let load = |column: &[f32; WIDTH]| simd.load(column);
            let push = load(&block.push);
            let friction = block.friction.each_ref().map(load);
            let slip: Vectors<L> = std::array::from_fn(|k| {
                load(&block.anchor[k]) + ([x, y, z][k] - load(&start.apart[k]))
            });
            let friction = tangential(&normal, friction);
            let slip = match rolls.get_mut(number) {
                None => tangential(&normal, slip),
                Some(roll) => {
                    for torque in &mut roll.torque {
                        (load(torque) * WARM).store_slice(torque);
                    }
                    let [a, b] = block.places.map(|places| vectors(simd, turns, &places));
                    let rolled = cross(&sum(&a, &b), &normal);
                    tangential(&normal, std::array::from_fn(|k| slip[k] - rolled[k]))
                }
            };
            let size = dot(&slip, &slip).sqrt();
            let weight = load(&block.weights[0]) + load(&block.weights[1]);
            // What friction can take back in a substep.
            let most = push.max(zero) * weight * self.friction;
            let over = size.simd_gt(most);
            let scale = over.select(most / over.select(size, one), one);
            (push * WARM).store_slice(&mut block.push);
            for k in 0..3 {
                (friction[k] * WARM).store_slice(&mut block.friction[k]);
                (slip[k] * scale).store_slice(&mut block.anchor[k]);
                [x, y, z][k].store_slice(&mut start.apart[k]);
            }
        }
    }
}

/// Contacts, with the columns of their grains.
pub struct Piece<'a> {
    pub blocks: &'a mut [Block],
    /// One for each block.
    pub starts: &'a [Start],
    /// One for each block, if the grains rotate.
    pub rolls: &'a mut [Roll],
    /// Displacements in the substep [m] in xyz.
    pub motions: &'a mut [Vec4],
    /// Displacements of the surface by rotation in the substep [m], if the grains rotate.
    pub turns: &'a mut [Vec4],
}

/// Moves grains by the multipliers.
pub struct Warm<'a>(pub Piece<'a>);

impl SimdWork for Warm<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Piece {
            blocks,
            rolls,
            motions,
            turns,
            ..
        } = self.0;
        let zero = simd.number(0.0);
        for (number, block) in blocks.iter_mut().enumerate() {
            let load = |column: &[f32; WIDTH]| simd.load(column);
            let push = load(&block.push);
            if !push.simd_ne(zero).any_true() {
                continue;
            }
            let normal = block.normal.each_ref().map(load);
            let weights = block.weights.each_ref().map(load);
            let friction = block.friction.each_ref().map(load);
            let impulse: Vectors<L> = std::array::from_fn(|k| normal[k] * push + friction[k]);
            let of_a = rows(simd, motions, &block.places[0]);
            let of_b = rows(simd, motions, &block.places[1]);
            add(simd, motions, (&block.places[0], of_a), impulse, weights[0]);
            add(
                simd,
                motions,
                (&block.places[1], of_b),
                impulse,
                zero - weights[1],
            );
            if let Some(roll) = rolls.get(number) {
                let torque = roll.torque.each_ref().map(load);
                turn(
                    simd,
                    turns,
                    (block, roll),
                    &cross(&normal, &friction),
                    &torque,
                );
            }
        }
    }
}

/// A pass over the contacts of grains that rotate or do not; sets `acts` if one of them acts.
pub struct Pass<'a, const ROLLS: bool> {
    pub piece: Piece<'a>,
    pub limits: Limits,
    pub acts: &'a mut bool,
}

impl<const ROLLS: bool> SimdWork for Pass<'_, ROLLS> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Piece {
            blocks,
            starts,
            rolls,
            motions,
            turns,
        } = self.piece;
        let Limits {
            friction: [sticks, slides],
            cohesion,
            releases_friction,
            rolling,
        } = self.limits;
        let zero = simd.number(0.0);
        let one = simd.number(1.0);
        for (number, block) in blocks.iter_mut().enumerate() {
            let of_a = rows(simd, motions, &block.places[0]);
            let of_b = rows(simd, motions, &block.places[1]);
            let [x, y, z, _] = simd.transpose(std::array::from_fn(|k| of_a[k] - of_b[k]));
            let load = |column: &[f32; WIDTH]| simd.load(column);
            let normal = block.normal.each_ref().map(load);
            let weights = block.weights.each_ref().map(load);
            let weight = weights[0] + weights[1];
            let inverse = inverse(simd, weight);
            let before = load(&block.push);
            let pull = match cohesion > 0.0 {
                true => load(&starts[number].touches) * cohesion,
                false => zero,
            };
            let along = dot(&normal, &[x, y, z]);
            let error = load(&block.gap) + along;
            let push = (before - error * inverse).max(zero - pull);
            let change = push - before;
            if !(push.simd_ne(zero) | before.simd_ne(zero)).any_true() {
                continue;
            }
            *self.acts = true;
            push.store_slice(&mut block.push);
            let held = match releases_friction {
                true => [zero; 3],
                false => block.friction.each_ref().map(load),
            };
            let anchor = block.anchor.each_ref().map(load);
            let slip = tangential(&normal, [x, y, z]);
            let pressed = push + pull;
            let mut torque = [zero; 3];
            let wanted: Vectors<L> = if ROLLS {
                let wanted = NoSlip {
                    normal: &normal,
                    weights: &weights,
                    slip: std::array::from_fn(|k| anchor[k] + slip[k]),
                    held: &held,
                    limits: [pressed * sticks, pressed * rolling],
                };
                let p;
                (p, torque) = wanted.reach(simd, turns, (block, &mut rolls[number]));
                std::array::from_fn(|k| held[k] + p[k])
            } else {
                std::array::from_fn(|k| held[k] - (anchor[k] + slip[k]) * inverse)
            };
            let size = dot(&wanted, &wanted).sqrt();
            let slips = size.simd_gt(pressed * sticks);
            let scale = slips.select(pressed * slides / slips.select(size, one), one);
            let mut impulse = [zero; 3];
            let mut along = [zero; 3];
            for k in 0..3 {
                let after = wanted[k] * scale;
                along[k] = after - held[k];
                impulse[k] = normal[k] * change + along[k];
                after.store_slice(&mut block.friction[k]);
            }
            if ROLLS {
                let by = cross(&normal, &along);
                turn(simd, turns, (block, &rolls[number]), &by, &torque);
            }
            add(simd, motions, (&block.places[0], of_a), impulse, weights[0]);
            add(
                simd,
                motions,
                (&block.places[1], of_b),
                impulse,
                zero - weights[1],
            );
        }
    }
}

/// Writes the motions at eight places, moved by an impulse times their weights.
#[inline(always)]
fn add<L: Lanes>(
    simd: L,
    motions: &mut [Vec4],
    (places, before): (&[u32; WIDTH], [Floats<L>; 4]),
    impulse: Vectors<L>,
    weight: Floats<L>,
) {
    let [x, y, z] = impulse;
    let by = simd.transpose([x * weight, y * weight, z * weight, simd.number(0.0)]);
    for k in 0..WIDTH / 2 {
        simd.split(
            before[k] + by[k],
            #[inline(always)]
            |quarter, motion| {
                motions[places[4 * quarter + k] as usize] = Vec4::from_array(motion.into());
            },
        );
    }
}
