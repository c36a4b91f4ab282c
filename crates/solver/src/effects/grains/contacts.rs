//! Contacts of grains in blocks of eight that share no grain, one per lane.

use super::{TOUCHING, neighbors::Neighbors};
use crate::{
    lanes::{Instructions, Lanes, SimdWork, Vectors, WIDTH},
    particles::Part,
};
use fearless_simd::{f32x4, f32x8, prelude::*};
use glam::Vec4;

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
#[derive(Debug, Clone, Copy)]
struct Roll {
    /// 1/r of the grains [1/m].
    curvatures: [[f32; WIDTH]; 2],
    /// Multiplier of rolling resistance [kg·m²]; over h², a torque.
    torque: [[f32; WIDTH]; 3],
}

/// Eight contacts. Unused lanes refer to a slot after the last one, which has no mass.
#[derive(Debug, Clone, Copy)]
struct Block {
    slots: [[u32; WIDTH]; 2],
    /// Inverse masses [1/kg].
    weights: [[f32; WIDTH]; 2],
    /// Sum of the radii [m].
    distance: [f32; WIDTH],
    normal: [[f32; WIDTH]; 3],
    /// Distance at the start of the substep beyond that to maintain [m].
    gap: [f32; WIDTH],
    /// 1 if the grains touch at the start of the substep, otherwise 0.
    touches: [f32; WIDTH],
    /// λₙ and λₜ [kg·m].
    push: [f32; WIDTH],
    friction: [[f32; WIDTH]; 3],
    /// Slip before the substep that friction has not taken back yet [m]. Without it, what a pass
    /// leaves would be lost, and piles would creep.
    anchor: [[f32; WIDTH]; 3],
    /// Vector between the grains at the start of the last substep [m].
    apart: [[f32; WIDTH]; 3],
}

/// Contacts of all pairs.
#[derive(Debug, Clone, Default)]
pub struct Contacts {
    blocks: Vec<Block>,
    /// Whether the grains rotate.
    rotates: bool,
    /// One for each block, if they do.
    rolls: Vec<Roll>,
    pairs: usize,
    /// Whether the multipliers have not moved the grains in the current substep yet.
    is_new: bool,
    /// Per slot, displacement in the substep [m] in xyz.
    motions: Vec<Vec4>,
    /// Per slot, displacement of the surface by rotation in the substep [m], if the grains rotate.
    turns: Vec<Vec4>,
    /// Positions and carries of the slots [m].
    starts: Vec<Vec4>,
    carries: Vec<Vec4>,
    /// Colors that the contacts of each slot have.
    taken: Vec<u128>,
    colors: Vec<u8>,
    places: Vec<u32>,
}

/// Multipliers begin a substep at this fraction of their last values, as far as the pairs are the
/// same. Most of the load is the same in all substeps, which halves the overlap in a pile. With all
/// of it the pile jitters: its grains have ten times the speed.
const WARM: f32 = 0.5;

/// Number of colors; contacts beyond have a block each.
const COLORS: usize = 128;

impl Contacts {
    /// Whether the blocks are those of the particles, which rotate or do not.
    pub fn fit(&self, part: &Part) -> bool {
        self.rotates != part.spins.is_empty()
    }

    /// Number of pairs.
    pub fn pairs(&self) -> usize {
        self.pairs
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
            + size_of_val(&self.rolls[..])
            + size_of_val(&self.motions[..])
            + size_of_val(&self.turns[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.carries[..])
            + size_of_val(&self.taken[..])
            + size_of_val(&self.colors[..])
    }

    /// Assigns the pairs to blocks: greedily to the first color that neither grain has, and by
    /// eight of a color.
    pub fn assign(&mut self, neighbors: &Neighbors, part: &Part, radii: &[f32]) {
        let slots = neighbors.order.len();
        self.pairs = neighbors.pairs.len();
        self.taken.clear();
        self.taken.resize(slots, 0);
        self.colors.clear();
        let mut counts = [0_usize; COLORS + 1];
        for pair in &neighbors.pairs {
            let [a, b] = pair.map(|slot| slot as usize);
            let free = !(self.taken[a] | self.taken[b]);
            let color = free.trailing_zeros() as usize;
            if color < COLORS {
                self.taken[a] |= 1 << color;
                self.taken[b] |= 1 << color;
            }
            self.colors.push(color as u8);
            counts[color] += 1;
        }
        // First lane of each color.
        self.places.clear();
        let mut next = 0;
        for count in &counts[..COLORS] {
            self.places.push(next);
            next += count.next_multiple_of(WIDTH) as u32;
        }
        self.places.push(next);
        next += (counts[COLORS] * WIDTH) as u32;
        let none = Block {
            slots: [[slots as u32; WIDTH]; 2],
            weights: [[0.0; WIDTH]; 2],
            distance: [0.0; WIDTH],
            normal: [[0.0; WIDTH]; 3],
            gap: [0.0; WIDTH],
            touches: [0.0; WIDTH],
            push: [0.0; WIDTH],
            friction: [[0.0; WIDTH]; 3],
            anchor: [[0.0; WIDTH]; 3],
            apart: [[0.0; WIDTH]; 3],
        };
        self.blocks.clear();
        self.blocks.resize(next as usize / WIDTH, none);
        self.rolls.clear();
        self.rotates = !part.spins.is_empty();
        if self.rotates {
            let none = Roll {
                curvatures: [[0.0; WIDTH]; 2],
                torque: [[0.0; WIDTH]; 3],
            };
            self.rolls.resize(self.blocks.len(), none);
        }
        for (pair, &color) in neighbors.pairs.iter().zip(&self.colors) {
            let place = &mut self.places[color as usize];
            let number = *place as usize / WIDTH;
            let block = &mut self.blocks[number];
            let lane = *place as usize % WIDTH;
            *place += if usize::from(color) < COLORS {
                1
            } else {
                WIDTH as u32
            };
            let grains = pair.map(|slot| neighbors.order[slot as usize] as usize);
            for side in 0..2 {
                block.slots[side][lane] = pair[side];
                block.weights[side][lane] = part.positions[grains[side]].w;
            }
            block.distance[lane] = radii[grains[0]] + radii[grains[1]];
            if let Some(roll) = self.rolls.get_mut(number) {
                for side in 0..2 {
                    roll.curvatures[side][lane] = 1.0 / radii[grains[side]];
                }
            }
        }
    }

    /// Reads the rotations in a substep of `h` seconds.
    fn load_turns(&mut self, neighbors: &Neighbors, part: &Part, h: f32) {
        self.turns.clear();
        if self.rotates {
            let turns = neighbors.order.iter();
            self.turns
                .extend(turns.map(|&grain| part.spins[grain as usize] * h));
            self.turns.push(Vec4::ZERO);
        }
    }

    /// Begins a substep: normals and gaps from the positions at its start. Overlapping grains
    /// separate by at most `recovery` [m]; `friction` is the static coefficient, `h` the length of the
    /// substep [s].
    pub fn begin(
        &mut self,
        neighbors: &Neighbors,
        part: &Part,
        (recovery, friction, h): (f32, f32, f32),
        instructions: Instructions,
    ) {
        self.is_new = true;
        self.load_turns(neighbors, part, h);
        self.starts.clear();
        self.carries.clear();
        for &grain in &neighbors.order {
            self.starts.push(part.positions[grain as usize]);
            self.carries.push(part.carry[grain as usize]);
        }
        self.starts.push(Vec4::ZERO);
        self.carries.push(Vec4::ZERO);
        instructions.run(Begin {
            contacts: self,
            recovery,
            friction,
        });
    }

    /// One pass over all contacts; returns whether one of them acts.
    pub fn solve(
        &mut self,
        neighbors: &Neighbors,
        part: Part,
        (limits, h): (Limits, f32),
        instructions: Instructions,
    ) -> bool {
        self.load_turns(neighbors, &part, h);
        self.motions.clear();
        let motions = neighbors.order.iter().map(|&grain| {
            let i = grain as usize;
            part.displacements[i] - part.carry[i]
        });
        self.motions.extend(motions);
        self.motions.push(Vec4::ZERO);
        let mut acts = false;
        if std::mem::take(&mut self.is_new) {
            instructions.run(Start { contacts: self });
        }
        let acts_too = &mut acts;
        match self.rotates {
            false => instructions.run(Pass::<false> {
                contacts: self,
                limits,
                acts: acts_too,
            }),
            true => instructions.run(Pass::<true> {
                contacts: self,
                limits,
                acts: acts_too,
            }),
        }
        if acts {
            for (&grain, &turn) in neighbors.order.iter().zip(&self.turns) {
                let spin = &mut part.spins[grain as usize];
                *spin = (turn / h).with_w(spin.w);
            }
            for (&grain, &motion) in neighbors.order.iter().zip(&self.motions) {
                let i = grain as usize;
                let carry = part.carry[i];
                if motion != part.displacements[i] - carry {
                    part.displacements[i] = motion + carry;
                }
            }
        }
        acts
    }
}

/// The rows of a column, two lanes in each: k and k + 4.
#[inline(always)]
fn rows<L: Lanes>(simd: L, column: &[Vec4], slots: &[u32; WIDTH]) -> [f32x8<L>; 4] {
    let mut rows = [f32x8::splat(simd, 0.0); 4];
    for (k, row) in rows.iter_mut().enumerate() {
        let low = column[slots[k] as usize].to_array();
        let high = column[slots[k + WIDTH / 2] as usize].to_array();
        *row = simd.combine_f32x4(f32x4::simd_from(simd, low), f32x4::simd_from(simd, high));
    }
    rows
}

#[inline(always)]
fn dot<L: Lanes>(a: &Vectors<L>, b: &Vectors<L>) -> f32x8<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The part of a vector across the normal.
#[inline(always)]
fn tangential<L: Lanes>(normal: &Vectors<L>, [x, y, z]: Vectors<L>) -> Vectors<L> {
    let along = dot(normal, &[x, y, z]);
    [
        x - normal[0] * along,
        y - normal[1] * along,
        z - normal[2] * along,
    ]
}

#[inline(always)]
fn cross<L: Lanes>(a: &Vectors<L>, b: &Vectors<L>) -> Vectors<L> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn sum<L: Lanes>(a: &Vectors<L>, b: &Vectors<L>) -> Vectors<L> {
    std::array::from_fn(|k| a[k] + b[k])
}

/// 1/x where x is positive, otherwise 0.
#[inline(always)]
fn inverse<L: Lanes>(simd: L, x: f32x8<L>) -> f32x8<L> {
    let zero = f32x8::splat(simd, 0.0);
    let one = f32x8::splat(simd, 1.0);
    let is_some = x.simd_gt(zero);
    is_some.select(one / is_some.select(x, one), zero)
}

/// The vectors of eight slots.
#[inline(always)]
fn vectors<L: Lanes>(simd: L, column: &[Vec4], slots: &[u32; WIDTH]) -> Vectors<L> {
    let [x, y, z, _] = simd.transpose(rows(simd, column, slots));
    [x, y, z]
}

/// mr²/I of a ball.
const LEVER: f32 = crate::contact::LEVER as f32;

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
    weights: &'a [f32x8<L>; 2],
    /// Without rotation [m].
    slip: Vectors<L>,
    /// Friction of earlier passes [kg·m].
    held: &'a Vectors<L>,
    /// Limits of friction [kg·m], and of the torque over the reduced radius r₁r₂/(r₁ + r₂) [kg·m].
    limits: [f32x8<L>; 2],
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
        let zero = f32x8::splat(simd, 0.0);
        let one = f32x8::splat(simd, 1.0);
        let load = |column: &[f32; WIDTH]| f32x8::from_slice(simd, column);
        let [k0, k1] = roll.curvatures.each_ref().map(load);
        let [a, b] = block.slots.map(|slots| vectors(simd, turns, &slots));
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
            roll.torque[k] = torque.into();
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
    let load = |column: &[f32; WIDTH]| f32x8::from_slice(simd, column);
    for side in 0..2 {
        let [weight, curvature] = [&block.weights[side], &roll.curvatures[side]].map(load);
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let slots = &block.slots[side];
        let before = rows(simd, turns, slots);
        let change = std::array::from_fn(|k| torque[k] * curvature * sign - by[k]);
        add(simd, turns, (slots, before), change, weight * LEVER);
    }
}

/// Normals and gaps; multipliers and anchors from those of the last substep.
struct Begin<'a> {
    contacts: &'a mut Contacts,
    recovery: f32,
    friction: f32,
}

impl SimdWork for Begin<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Contacts {
            blocks,
            rolls,
            turns,
            starts,
            carries,
            ..
        } = self.contacts;
        let zero = f32x8::splat(simd, 0.0);
        let one = f32x8::splat(simd, 1.0);
        for (number, block) in blocks.iter_mut().enumerate() {
            let [a, b] = block.slots.map(|slots| rows(simd, starts, &slots));
            let [c, d] = block.slots.map(|slots| rows(simd, carries, &slots));
            let apart = std::array::from_fn(|k| (a[k] - b[k]) + (c[k] - d[k]));
            let [x, y, z, _] = simd.transpose(apart);
            let length = dot(&[x, y, z], &[x, y, z]).sqrt();
            let has_direction = length.simd_gt(zero);
            let inverse = has_direction.select(one / has_direction.select(length, one), zero);
            let distance = f32x8::from_slice(simd, &block.distance);
            let kept = distance.min(length + self.recovery);
            let normal = [x * inverse, y * inverse, z * inverse];
            for (to, along) in block.normal.iter_mut().zip(normal) {
                *to = along.into();
            }
            block.gap = (length - kept).into();
            let touches = length.simd_lt(distance * (1.0 + TOUCHING));
            block.touches = touches.select(one, zero).into();
            let load = |column: &[f32; WIDTH]| f32x8::from_slice(simd, column);
            let push = load(&block.push);
            let friction = block.friction.each_ref().map(load);
            let slip: Vectors<L> = std::array::from_fn(|k| {
                load(&block.anchor[k]) + ([x, y, z][k] - load(&block.apart[k]))
            });
            let friction = tangential(&normal, friction);
            let slip = match rolls.get_mut(number) {
                None => tangential(&normal, slip),
                Some(roll) => {
                    for torque in &mut roll.torque {
                        *torque = (load(torque) * WARM).into();
                    }
                    let [a, b] = block.slots.map(|slots| vectors(simd, turns, &slots));
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
            block.push = (push * WARM).into();
            for k in 0..3 {
                block.friction[k] = (friction[k] * WARM).into();
                block.anchor[k] = (slip[k] * scale).into();
                block.apart[k] = [x, y, z][k].into();
            }
        }
    }
}

/// Moves grains by the multipliers.
struct Start<'a> {
    contacts: &'a mut Contacts,
}

impl SimdWork for Start<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Contacts {
            blocks,
            rolls,
            motions,
            turns,
            ..
        } = self.contacts;
        let zero = f32x8::splat(simd, 0.0);
        for (number, block) in blocks.iter_mut().enumerate() {
            let load = |column: &[f32; WIDTH]| f32x8::from_slice(simd, column);
            let push = load(&block.push);
            if !push.simd_ne(zero).any_true() {
                continue;
            }
            let normal = block.normal.each_ref().map(load);
            let weights = block.weights.each_ref().map(load);
            let friction = block.friction.each_ref().map(load);
            let impulse: Vectors<L> = std::array::from_fn(|k| normal[k] * push + friction[k]);
            let of_a = rows(simd, motions, &block.slots[0]);
            let of_b = rows(simd, motions, &block.slots[1]);
            add(simd, motions, (&block.slots[0], of_a), impulse, weights[0]);
            add(
                simd,
                motions,
                (&block.slots[1], of_b),
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

/// A pass over all contacts; whether grains rotate.
struct Pass<'a, const ROLLS: bool> {
    contacts: &'a mut Contacts,
    limits: Limits,
    acts: &'a mut bool,
}

impl<const ROLLS: bool> SimdWork for Pass<'_, ROLLS> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Contacts {
            blocks,
            rolls,
            motions,
            turns,
            ..
        } = self.contacts;
        let Limits {
            friction: [sticks, slides],
            cohesion,
            releases_friction,
            rolling,
        } = self.limits;
        let zero = f32x8::splat(simd, 0.0);
        let one = f32x8::splat(simd, 1.0);
        for (number, block) in blocks.iter_mut().enumerate() {
            let of_a = rows(simd, motions, &block.slots[0]);
            let of_b = rows(simd, motions, &block.slots[1]);
            let [x, y, z, _] = simd.transpose(std::array::from_fn(|k| of_a[k] - of_b[k]));
            let load = |column: &[f32; WIDTH]| f32x8::from_slice(simd, column);
            let normal = block.normal.each_ref().map(load);
            let weights = block.weights.each_ref().map(load);
            let weight = weights[0] + weights[1];
            let inverse = inverse(simd, weight);
            let before = load(&block.push);
            let pull = load(&block.touches) * cohesion;
            let along = dot(&normal, &[x, y, z]);
            let error = load(&block.gap) + along;
            let push = (before - error * inverse).max(zero - pull);
            let change = push - before;
            if !(push.simd_ne(zero) | before.simd_ne(zero)).any_true() {
                continue;
            }
            *self.acts = true;
            block.push = push.into();
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
                block.friction[k] = after.into();
            }
            if ROLLS {
                let by = cross(&normal, &along);
                turn(simd, turns, (block, &rolls[number]), &by, &torque);
            }
            add(simd, motions, (&block.slots[0], of_a), impulse, weights[0]);
            add(
                simd,
                motions,
                (&block.slots[1], of_b),
                impulse,
                zero - weights[1],
            );
        }
    }
}

/// Writes the motions of eight slots, moved by an impulse times their weights.
#[inline(always)]
fn add<L: Lanes>(
    simd: L,
    motions: &mut [Vec4],
    (slots, before): (&[u32; WIDTH], [f32x8<L>; 4]),
    impulse: Vectors<L>,
    weight: f32x8<L>,
) {
    let [x, y, z] = impulse;
    let by = simd.transpose([x * weight, y * weight, z * weight, f32x8::splat(simd, 0.0)]);
    for k in 0..WIDTH / 2 {
        let (low, high) = simd.split_f32x8(before[k] + by[k]);
        motions[slots[k] as usize] = Vec4::from_array(low.into());
        motions[slots[k + WIDTH / 2] as usize] = Vec4::from_array(high.into());
    }
}
