//! Solves the contacts of rigid bodies until they hold.
//!
//! A soft body gives way within itself, and one pass over its contacts in each iteration is enough. In a stack of
//! rigid bodies each contact carries all that is above, and what a pass leaves over would be a velocity: the stack
//! would creep, sway and fall. The rows of each island, bodies that contacts join, are projected in passes of both
//! directions until they hardly change, each pass accelerated as a step of conjugate gradients. Within a tick, the
//! first pass of a substep begins with the multipliers of the one before.
//!
//! After the iterations, surfaces that are too close are separated in the same way. This is no velocity: it is
//! taken out of it at the end of the substep, so that a stack does not jump.
//!
//! Source: Silcowitz, Niebe and Erleben, *A Nonsmooth Nonlinear Conjugate Gradient Method for Interactive Contact
//! Force Problems* (2010).

use super::{
    between::KINDS,
    manifold::SAME,
    rigid::{Motion, Rigid},
    row::{Active, ContactPart, ContactRow, NO_INDEX},
};
use crate::topology::union::root;
use glam::DVec3;

/// Largest number of passes over an island after an iteration.
const MAX_PASSES: usize = 64;

/// A row holds when a pass moves its points by less than this fraction of what the largest force of the island
/// moves its own.
const HOLDS: f64 = 1e-4;

/// Multipliers along the normal and two directions perpendicular to it [kg·m].
type Multipliers = [f64; 3];

/// A row of a rigid body while it is solved.
#[derive(Debug, Clone, Copy)]
struct Solved {
    /// Kind of contact of its row, and its index.
    row: [u32; 2],
    /// The lowest index of the bodies of its island.
    island: u32,
    /// Indices of the rigid bodies of either side; that of one that does not move where there is none.
    rigids: [u32; 2],
    /// Inverse mass of either; of the second, negative [1/kg].
    inverse_masses: [f64; 2],
    /// The normal and two directions perpendicular to it.
    directions: [DVec3; 3],
    /// Of each direction and side: arm × direction, and its product with the inverse inertia; of the second side,
    /// negative.
    levers: [[DVec3; 2]; 3],
    turns: [[DVec3; 2]; 3],
    /// Corners that do not belong to rigid bodies and can move, with their weights, and their number.
    soft: [(u32, f64); 4],
    soft_count: usize,
    /// C and the slip of the others when the pass began [m].
    errors: [f64; 3],
    /// α/h² [1/kg].
    compliance: f64,
    /// W along the normal, and the largest W perpendicular to it [1/kg].
    weights: [f64; 2],
    friction: [f64; 2],
    /// λₙ besides what is solved for [kg·m].
    held: f64,
    multipliers: Multipliers,
}

/// A row of two rigid surfaces at the end of a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// In ascending order, and the place of the row among all.
    bodies: [u32; 2],
    place: u32,
    normal: DVec3,
    point: DVec3,
    /// Along the normal, and perpendicular to it [kg·m].
    along: f64,
    friction: DVec3,
}

/// What moves in a pass: rigid bodies, and particles of others.
struct Moving<'a> {
    rigids: &'a mut [Motion],
    active: &'a mut [Active],
}

/// Buffers, reused, and the rows of the substep before.
#[derive(Debug, Default)]
pub(super) struct RigidRows {
    solved: Vec<Solved>,
    /// Parents of bodies in islands.
    roots: Vec<u32>,
    motions: Vec<Motion>,
    changes: Vec<Multipliers>,
    search: Vec<Multipliers>,
    /// In ascending order of the bodies.
    kept: Vec<Kept>,
}

impl RigidRows {
    /// A tick begins: it does not depend on the one before.
    pub fn begin_tick(&mut self) {
        self.kept.clear();
    }

    /// The rows of the last substep.
    pub fn kept(&mut self) -> &mut Vec<Kept> {
        &mut self.kept
    }

    /// A substep has ended.
    pub fn keep(&mut self, rows: &[Vec<ContactRow>; KINDS], active: &[Active]) {
        self.kept.clear();
        let hard = rows
            .iter()
            .flatten()
            .filter(|it| it.is_rigid() && !it.is_soft());
        let acting = (0..).zip(hard.filter(|it| it.acts()));
        self.kept.extend(acting.map(|(place, row)| {
            let (bodies, sign) = sorted(row.bodies(active));
            Kept {
                bodies,
                place,
                normal: row.normal() * sign,
                point: row.point(active),
                along: row.normal_multiplier,
                friction: row.friction_multiplier * sign,
            }
        }));
        self.kept.sort_unstable_by_key(|it| (it.bodies, it.place));
    }

    /// Solves the rows of rigid bodies.
    pub fn solve(
        &mut self,
        rows: &mut [Vec<ContactRow>; KINDS],
        active: &mut [Active],
        rigids: &mut [Rigid],
    ) {
        self.collect(rows, active, rigids);
        self.begin(rows, active);
        let mut moving = Moving {
            rigids: &mut self.motions,
            active,
        };
        for solved in self.solved.chunk_by_mut(|a, b| a.island == b.island) {
            iterate(solved, &mut moving, (&mut self.changes, &mut self.search));
        }
        for it in &self.solved {
            let row = it.row_of_mut(rows);
            let [along, t, s] = it.multipliers;
            let friction = it.impulse([0.0, t, s]);
            let change = friction - row.friction_multiplier;
            row.credit(ContactPart::Friction, change, moving.active, rigids);
            (row.normal_multiplier, row.friction_multiplier) = (along, friction);
        }
        for (rigid, motion) in rigids.iter_mut().zip(&*moving.rigids) {
            rigid.motion = *motion;
        }
    }

    /// Separates surfaces of rigid bodies that are too close, without friction.
    pub fn lift(
        &mut self,
        rows: &mut [Vec<ContactRow>; KINDS],
        active: &mut [Active],
        rigids: &mut [Rigid],
    ) {
        self.collect(rows, active, rigids);
        let mut moving = Moving {
            rigids: &mut self.motions,
            active,
        };
        for solved in self.solved.chunk_by_mut(|a, b| a.island == b.island) {
            for it in &mut *solved {
                let row = it.row_of_mut(rows);
                [it.held, ..] = it.multipliers;
                it.multipliers = [0.0; 3];
                it.errors[0] += row.distance - row.lifted;
                it.friction = [0.0; 2];
            }
            if solved.iter().any(|it| it.error(0, &moving) < 0.0) {
                iterate(solved, &mut moving, (&mut self.changes, &mut self.search));
            }
        }
        for it in &self.solved {
            if it.multipliers != [0.0; 3] {
                let by = it.impulse(it.multipliers);
                let row = it.row_of_mut(rows);
                row.credit(ContactPart::Lift, by, moving.active, rigids);
            }
        }
        for (rigid, motion) in rigids.iter_mut().zip(&*moving.rigids) {
            rigid.motion = *motion;
        }
    }

    /// Collects the rows of rigid bodies by their islands.
    fn collect(&mut self, rows: &[Vec<ContactRow>; KINDS], active: &[Active], rigids: &[Rigid]) {
        self.solved.clear();
        for (kind, rows) in (0..).zip(rows) {
            for (number, row) in (0..).zip(rows) {
                if row.is_rigid() {
                    self.solved
                        .push(Solved::of([kind, number], row, active, rigids));
                }
            }
        }
        self.find_islands(rows, active, rigids);
        self.motions.clear();
        self.motions.extend(rigids.iter().map(|it| it.motion));
        self.motions.push(Motion::default());
    }

    /// Joins what contacts may join in the substep, and brings the rows of each island together.
    fn find_islands(
        &mut self,
        rows: &[Vec<ContactRow>; KINDS],
        active: &[Active],
        rigids: &[Rigid],
    ) {
        let Self { solved, roots, .. } = self;
        let bodies = active.iter().filter(|it| it.body != NO_INDEX);
        let count = bodies.map(|it| it.body + 1).max().unwrap_or(0);
        roots.clear();
        roots.extend(0..count);
        let movable = |one: &Solved| {
            let bodies = one.row_of(rows).bodies(active);
            [0, 1].map(|side| {
                let is_movable = match rigids.get(one.rigids[side] as usize) {
                    Some(rigid) => rigid.is_movable(),
                    None => bodies[side] != NO_INDEX && one.soft_count > 0,
                };
                is_movable.then_some(bodies[side])
            })
        };
        for one in &*solved {
            if let [Some(a), Some(b)] = movable(one) {
                let [a, b] = [a, b].map(|it| root(roots, it));
                roots[a.max(b) as usize] = a.min(b);
            }
        }
        for one in &mut *solved {
            let first = movable(one).into_iter().flatten().next();
            one.island = first.map_or(NO_INDEX, |it| root(roots, it));
        }
        solved.sort_unstable_by_key(|it| (it.island, it.row));
    }

    /// Begins with the multipliers of the substep before, in its first pass.
    fn begin(&mut self, rows: &[Vec<ContactRow>; KINDS], active: &mut [Active]) {
        let kept = &mut self.kept;
        for one in &mut self.solved {
            let row = one.row_of(rows);
            if row.is_soft() {
                continue;
            }
            let (bodies, sign) = sorted(row.bodies(active));
            let normal = row.normal() * sign;
            let point = row.point(active);
            let first = kept.partition_point(|it| it.bodies < bodies);
            let of_both = kept[first..]
                .iter_mut()
                .take_while(|it| it.bodies == bodies);
            let same = of_both.filter(|it| it.along > 0.0 && it.normal.dot(normal) > SAME);
            let nearest = same.min_by(|a, b| {
                let [a, b] = [a, b].map(|it| it.point.distance_squared(point));
                a.total_cmp(&b)
            });
            if let Some(nearest) = nearest {
                let friction = nearest.friction * sign;
                let [_, t, s] = one.directions;
                let by = [nearest.along, t.dot(friction), s.dot(friction)];
                nearest.along = 0.0;
                let rigids = &mut self.motions;
                let mut moving = Moving { rigids, active };
                if one.error(0, &moving).is_finite() {
                    one.add(by, &mut moving);
                }
            }
        }
        kept.clear();
    }
}

/// Indices of bodies in ascending order, and whether they were: 1 or −1.
fn sorted([a, b]: [u32; 2]) -> ([u32; 2], f64) {
    match a <= b {
        true => ([a, b], 1.0),
        false => ([b, a], -1.0),
    }
}

/// Passes over the rows of an island until they hold.
fn iterate(
    solved: &mut [Solved],
    moving: &mut Moving,
    (changes, search): (&mut Vec<Multipliers>, &mut Vec<Multipliers>),
) {
    search.clear();
    search.resize(solved.len(), [0.0; 3]);
    let mut square_before = f64::INFINITY;
    for count in 1..=MAX_PASSES {
        changes.clear();
        changes.extend(solved.iter().map(|it| it.multipliers));
        for it in solved.iter_mut().rev() {
            it.solve(moving);
        }
        for it in &mut *solved {
            it.solve(moving);
        }
        let (mut square, mut change, mut largest) = (0.0, 0.0_f64, 0.0_f64);
        for (it, before) in solved.iter().zip(&mut *changes) {
            let [n, t, s] = [0, 1, 2].map(|i| it.multipliers[i] - before[i]);
            *before = [n, t, s];
            let across = t * t + s * s;
            square += n * n + across;
            let [along, perpendicular] = it.weights;
            change = change
                .max(n.abs() * along)
                .max(across.sqrt() * perpendicular);
            largest = largest.max((it.multipliers[0] + it.held) * along);
        }
        if change <= HOLDS * largest || count == MAX_PASSES {
            return;
        }
        let part = square / square_before;
        let part = if part < 1.0 { part } else { 0.0 };
        square_before = square;
        for ((it, search), by) in solved.iter_mut().zip(&mut *search).zip(&*changes) {
            let further = search.map(|it| it * part);
            if further != [0.0; 3] {
                it.add(further, moving);
            }
            *search = [0, 1, 2].map(|i| further[i] + by[i]);
        }
    }
}

impl Solved {
    fn of(number: [u32; 2], row: &ContactRow, active: &[Active], rigids: &[Rigid]) -> Self {
        let mut soft = [(NO_INDEX, 0.0); 4];
        let mut soft_count = 0;
        let (mut base, mut start) = (DVec3::ZERO, row.carried);
        for (corner, weight) in row.weighted_corners() {
            let it = &active[corner as usize];
            start += it.start * weight;
            if it.inverse_mass > 0.0 && weight != 0.0 {
                soft[soft_count] = (corner, weight);
                soft_count += 1;
            } else {
                base += it.now * weight;
            }
        }
        let n = row.normal();
        let t = n.any_orthonormal_vector();
        let directions = [n, t, n.cross(t)];
        let mut levers = [[DVec3::ZERO; 2]; 3];
        let mut turns = levers;
        let mut inverse_masses = [0.0; 2];
        let mut numbers = [rigids.len() as u32; 2];
        let soft_weight = row.soft_inverse_mass();
        let [mut tt, mut ss, mut ts] = [soft_weight, soft_weight, 0.0];
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let number = row.rigids[side];
            let Some(rigid) = rigids.get(number as usize) else {
                continue;
            };
            numbers[side] = number;
            inverse_masses[side] = sign * rigid.inverse_mass();
            for (direction, (lever, turn)) in
                directions.iter().zip(levers.iter_mut().zip(&mut turns))
            {
                lever[side] = row.arms[side].cross(*direction) * sign;
                turn[side] = rigid.turned_by(lever[side]);
            }
            let [_, of_t, of_s] = levers.map(|it| it[side]);
            let [_, by_t, by_s] = turns.map(|it| it[side]);
            tt += rigid.inverse_mass() + of_t.dot(by_t);
            ss += rigid.inverse_mass() + of_s.dot(by_s);
            ts += of_t.dot(by_s);
        }
        let largest = 0.5 * (tt + ss) + (0.25 * (tt - ss) * (tt - ss) + ts * ts).sqrt();
        let [_, t, s] = directions;
        Self {
            row: number,
            island: 0,
            rigids: numbers,
            inverse_masses,
            directions,
            levers,
            turns,
            soft,
            soft_count,
            errors: [
                n.dot(base) - row.distance,
                t.dot(base - start),
                s.dot(base - start),
            ],
            compliance: row.compliance,
            weights: [row.inverse_mass, largest],
            friction: row.friction,
            held: 0.0,
            multipliers: [
                row.normal_multiplier,
                t.dot(row.friction_multiplier),
                s.dot(row.friction_multiplier),
            ],
        }
    }

    fn row_of<'a>(&self, rows: &'a [Vec<ContactRow>; KINDS]) -> &'a ContactRow {
        let [kind, number] = self.row;
        &rows[kind as usize][number as usize]
    }

    fn row_of_mut<'a>(&self, rows: &'a mut [Vec<ContactRow>; KINDS]) -> &'a mut ContactRow {
        let [kind, number] = self.row;
        &mut rows[kind as usize][number as usize]
    }

    /// C, or the slip along one of the directions perpendicular to the normal [m].
    #[inline(always)]
    fn error(&self, direction: usize, moving: &Moving) -> f64 {
        let along = self.directions[direction];
        let [a, b] = self.rigids.map(|it| &moving.rigids[it as usize]);
        let [lever_a, lever_b] = self.levers[direction];
        let mut error = self.errors[direction]
            + along.dot(a.shift - b.shift)
            + lever_a.dot(a.turn)
            + lever_b.dot(b.turn);
        for &(corner, weight) in &self.soft[..self.soft_count] {
            error += along.dot(moving.active[corner as usize].now) * weight;
        }
        error
    }

    /// Projects the constraint.
    #[inline]
    fn solve(&mut self, moving: &mut Moving) {
        let error = self.error(0, moving);
        // A diverged body must not affect the bodies that it touches.
        if !error.is_finite() {
            return;
        }
        let [along, t, s] = self.multipliers;
        let [weight, across] = self.weights;
        let left = error + self.compliance * (along + self.held);
        let change = (-left / (weight + self.compliance)).max(-along);
        if change != 0.0 {
            self.add([change, 0.0, 0.0], moving);
        }
        if self.friction[0] == 0.0 || self.multipliers[0] == 0.0 && [t, s] == [0.0; 2] {
            return;
        }
        let [sticks, slides] = self.friction.map(|it| it * self.multipliers[0]);
        let mut friction = [
            t - self.error(1, moving) / across,
            s - self.error(2, moving) / across,
        ];
        let square = friction[0] * friction[0] + friction[1] * friction[1];
        if square > sticks * sticks {
            let part = slides / square.sqrt();
            friction = friction.map(|it| it * part);
        }
        let change = [friction[0] - t, friction[1] - s];
        if change.iter().all(|it| it.is_finite()) {
            self.add([0.0, change[0], change[1]], moving);
        }
    }

    /// The impulse of multipliers [kg·m].
    fn impulse(&self, [n, t, s]: Multipliers) -> DVec3 {
        self.directions[0] * n + self.directions[1] * t + self.directions[2] * s
    }

    /// Adds to its multipliers, and moves the bodies.
    #[inline(always)]
    fn add(&mut self, by: Multipliers, moving: &mut Moving) {
        for (multiplier, by) in self.multipliers.iter_mut().zip(by) {
            *multiplier += by;
        }
        let impulse = self.impulse(by);
        let [turn_n, turn_t, turn_s] = self.turns;
        for side in [0, 1] {
            let rigid = &mut moving.rigids[self.rigids[side] as usize];
            rigid.shift += impulse * self.inverse_masses[side];
            rigid.turn += turn_n[side] * by[0] + turn_t[side] * by[1] + turn_s[side] * by[2];
        }
        for &(corner, weight) in &self.soft[..self.soft_count] {
            let it = &mut moving.active[corner as usize];
            it.now += impulse * (weight * it.inverse_mass);
        }
    }
}
