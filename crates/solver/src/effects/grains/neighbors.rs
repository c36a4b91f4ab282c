//! Finds the pairs of grains that may touch until one of them has moved too far.
//!
//! Grains are sorted into the cells of a grid, layer by layer along its longest axis. The order of the
//! cells is also the order of all columns of the contacts, so that grains that touch are close in memory,
//! wherever they come from. Many grains are cut into slabs of some layers, for several threads.

use crate::{
    Threads,
    lanes::{Instructions, Lanes, SimdWork, WIDTH},
    particles::Part,
};
use fearless_simd::{f32x8, prelude::*};
use glam::{DVec3, UVec3, Vec3, Vec4};
use std::ops::Range;

/// Distance that a grain may move before pairs are found again, as fractions of its radius: at
/// least, and at most. Larger values find more pairs less often.
const MARGIN: [f32; 2] = [0.2, 1.5];

/// Maximum number of substeps for which pairs are found. A tick of a collapsing column took a third
/// longer with pairs for all of its 20 substeps; fewer than 10 were no faster.
const SUBSTEPS: u32 = 10;

/// Margin for motion that contacts add, as a multiple of the predicted motion in a substep.
const HORIZON: f32 = 1.2;

/// Pairs of grains that may touch, per grain of a dense packing.
pub const PAIRS_PER_GRAIN: usize = 5;

/// Maximum number of grid cells per grain.
const CELLS: u32 = 4;

/// The grid covers the mean position ± this multiple of the mean absolute deviation, at most; grains
/// outside belong to the cells of its border. So one that has flown far away does not make the cells
/// of the others large.
const SPREAD: f64 = 4.0;

/// Minimum number of grains in a slab, and of layers of cells: a pair rarely spans more than two slabs.
/// Fewer under Miri, which is too slow for more.
const SLAB: usize = if cfg!(miri) { 16 } else { 1024 };
const LAYERS: usize = if cfg!(miri) { 1 } else { 4 };

/// A range of slots, and the pairs found for them.
#[derive(Debug, Clone, Default)]
pub struct Slab {
    /// The slots.
    pub slots: Range<usize>,
    /// With those of the slabs before and after it.
    near: Range<usize>,
    /// Pairs of two of its slots.
    pub inside: Vec<[u32; 2]>,
    /// Pairs with a slot of the slab before, and of the next one.
    pub across: [Vec<[u32; 2]>; 2],
    /// Pairs with other slots.
    pub beyond: Vec<[u32; 2]>,
}

impl Slab {
    fn lists(&self) -> [&Vec<[u32; 2]>; 4] {
        let [before, next] = &self.across;
        [&self.inside, before, next, &self.beyond]
    }

    /// Where a pair with another slot belongs.
    fn list(&mut self, other: usize) -> &mut Vec<[u32; 2]> {
        if self.slots.contains(&other) {
            &mut self.inside
        } else if self.near.contains(&other) {
            &mut self.across[usize::from(other >= self.slots.end)]
        } else {
            &mut self.beyond
        }
    }
}

/// Pairs of grains that may touch.
#[derive(Debug, Clone, Default)]
pub struct Neighbors {
    /// The grain of each slot, in the order of the cells.
    pub order: Vec<u32>,
    /// Consecutive ranges of slots.
    pub slabs: Vec<Slab>,
    /// Position of each slot when pairs were found [m].
    found_at: Vec<Vec3>,
    /// Distance that each may move from there, relative to the mean motion [m].
    margins: Vec<f32>,
    /// Mean position of all grains then [m].
    mean_found_at: DVec3,
    /// Mean position at the start of the current substep, and mean predicted motion in it [m].
    mean: DVec3,
    mean_motion: DVec3,
    /// Start of the range of each cell, and the end of the last.
    starts: Vec<u32>,
    cells: Vec<u32>,
    /// Coordinates of each slot along the axes of the grid when pairs were found, and its reach, the sum
    /// of its radius and its margin [m]; with some more at the end that are infinitely far away.
    columns: [Vec<f32>; 4],
}

/// Grid that covers most grains.
struct Grid {
    /// The axes of the world along which it is numbered; it is longest along the last one.
    axes: [usize; 3],
    low: Vec3,
    per_length: f32,
    count: UVec3,
}

impl Grid {
    /// Coordinates along its axes.
    fn coordinates(&self, x: Vec3) -> Vec3 {
        Vec3::from_array(self.axes.map(|axis| x[axis]))
    }

    /// Cell of a point, given by its coordinates along the axes.
    fn cell(&self, x: Vec3) -> UVec3 {
        // Casts saturate at 0.
        let at = (x - self.low) * self.per_length;
        UVec3::new(at.x as u32, at.y as u32, at.z as u32).min(self.count - 1)
    }

    fn number(&self, cell: UVec3) -> usize {
        ((cell.z * self.count.y + cell.y) * self.count.x + cell.x) as usize
    }
}

impl Neighbors {
    /// Measures the mean motion at the beginning of a substep.
    pub fn follow(&mut self, part: &Part) {
        let (mut sum, mut motions) = (DVec3::ZERO, DVec3::ZERO);
        for (i, x) in part.positions.iter().enumerate() {
            sum += x.truncate().as_dvec3();
            motions += motion(part, i).as_dvec3();
        }
        let count = part.positions.len().max(1) as f64;
        (self.mean, self.mean_motion) = (sum / count, motions / count);
    }

    /// Whether no grain leaves its margin in this substep.
    pub fn are_valid(&self, part: &Part) -> bool {
        let drift = (self.mean - self.mean_found_at + self.mean_motion).as_vec3();
        let slots = self.order.iter().zip(&self.found_at).zip(&self.margins);
        let mut valid = true;
        for ((&grain, &found_at), &margin) in slots {
            let i = grain as usize;
            let way = (part.positions[i].truncate() - found_at)
                + (part.displacements[i].truncate() - drift);
            valid &= way.length_squared() <= margin * margin;
        }
        valid
    }

    /// Finds pairs; `substeps` are left in the tick.
    pub fn find(
        &mut self,
        part: &Part,
        radii: &[f32],
        substeps: u32,
        (threads, instructions): (&Threads, Instructions),
    ) {
        let count = part.positions.len();
        let at = |i: usize| part.positions[i].truncate();
        let mean_motion = self.mean_motion.as_vec3();
        self.mean_found_at = self.mean;
        let margin = |i: usize| {
            let way = (motion(part, i) - mean_motion).length();
            let expected = HORIZON * way * substeps.min(SUBSTEPS) as f32;
            let [least, most] = MARGIN.map(|fraction| fraction * radii[i]);
            expected.clamp(least, most).max(HORIZON * way)
        };
        let grid = self.grid(part, radii);
        self.cells.clear();
        self.starts.clear();
        self.starts
            .resize(grid.count.element_product() as usize + 1, 0);
        for i in 0..count {
            let cell = grid.number(grid.cell(grid.coordinates(at(i))));
            self.cells.push(cell as u32);
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.order.clear();
        self.order.resize(count, 0);
        // In reverse, so that the grains of a cell stay in order.
        for (grain, &cell) in self.cells.iter().enumerate().rev() {
            let end = &mut self.starts[cell as usize + 1];
            *end -= 1;
            self.order[*end as usize] = grain as u32;
        }
        // Each entry has become the start of the cell before it.
        self.starts.rotate_left(1);
        if let Some(last) = self.starts.last_mut() {
            *last = count as u32;
        }
        self.found_at.clear();
        self.margins.clear();
        self.columns.iter_mut().for_each(Vec::clear);
        for &grain in &self.order {
            let i = grain as usize;
            let margin = margin(i);
            self.found_at.push(at(i));
            self.margins.push(margin);
            let [x, y, z] = grid.coordinates(at(i)).to_array();
            let values = [x, y, z, radii[i] + margin];
            for (column, value) in self.columns.iter_mut().zip(values) {
                column.push(value);
            }
        }
        for column in &mut self.columns {
            column.resize(count + WIDTH, f32::INFINITY);
        }
        self.cut(&grid);
        let Self {
            slabs,
            columns,
            starts,
            ..
        } = self;
        // A pair is found in about the time of a projection.
        let projections = PAIRS_PER_GRAIN * count;
        threads.distribute(slabs.iter_mut(), projections, &|slab| {
            instructions.run(FindPairs {
                slab,
                columns,
                starts,
                grid: &grid,
            });
        });
    }

    /// Cuts the slots into slabs of the same number, and assigns them to their neighbors.
    fn cut(&mut self, grid: &Grid) {
        let slots = self.order.len();
        let layers = grid.count.z as usize;
        let count = (slots / SLAB).min(layers / LAYERS).max(1);
        self.slabs.resize_with(count, Slab::default);
        let start = |k: usize| slots * k.min(count) / count;
        for (k, slab) in self.slabs.iter_mut().enumerate() {
            slab.slots = start(k)..start(k + 1);
            slab.near = start(k.saturating_sub(1))..start(k + 2);
        }
    }

    /// Number of pairs.
    pub fn pairs(&self) -> usize {
        let lists = self.slabs.iter().flat_map(Slab::lists);
        lists.map(Vec::len).sum()
    }

    /// A grid whose cells are about as large as the reach of a typical grain.
    fn grid(&self, part: &Part, radii: &[f32]) -> Grid {
        let count = part.positions.len().max(1) as f64;
        let (mut deviation, mut radius) = (DVec3::ZERO, 0.0);
        let mut low = Vec3::INFINITY;
        let mut high = Vec3::NEG_INFINITY;
        for (x, &r) in part.positions.iter().zip(radii) {
            let x = x.truncate();
            deviation += (x.as_dvec3() - self.mean).abs();
            radius += f64::from(r);
            low = low.min(x);
            high = high.max(x);
        }
        let spread = deviation / count * SPREAD;
        low = low.max((self.mean - spread).as_vec3());
        high = high.min((self.mean + spread).as_vec3()).max(low);
        let size = high - low;
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| size[a].total_cmp(&size[b]));
        let mut cell = (2.0 * (1.0 + MARGIN[0]) * (radius / count) as f32)
            .max(1e-3 * size.max_element())
            .max(f32::MIN_POSITIVE);
        let cells = |cell: f32| {
            let along = |length: f32| (length / cell) as u32 + 1;
            UVec3::new(along(size.x), along(size.y), along(size.z))
        };
        let most = (CELLS * part.positions.len() as u32).max(64);
        while cells(cell).element_product() > most {
            cell *= 1.25;
        }
        let along = |of: UVec3| UVec3::from_array(axes.map(|axis| of[axis]));
        Grid {
            axes,
            low: Vec3::from_array(axes.map(|axis| low[axis])),
            per_length: 1.0 / cell,
            count: along(cells(cell)),
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.order[..])
            + self.pairs() * size_of::<[u32; 2]>()
            + size_of_val(&self.found_at[..])
            + size_of_val(&self.margins[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.cells[..])
            + self
                .columns
                .iter()
                .map(|it| size_of_val(&it[..]))
                .sum::<usize>()
    }
}

/// Finds the pairs of each slot of a slab with slots of shorter reach, and of equal reach after it.
struct FindPairs<'a> {
    slab: &'a mut Slab,
    columns: &'a [Vec<f32>; 4],
    starts: &'a [u32],
    grid: &'a Grid,
}

impl SimdWork for FindPairs<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let [xs, ys, zs, reaches] = self.columns;
        let slab = self.slab;
        let slots = slab.slots.clone();
        slab.inside.clear();
        slab.across.iter_mut().for_each(Vec::clear);
        slab.beyond.clear();
        for slot in slots.clone() {
            let at = Vec3::new(xs[slot], ys[slot], zs[slot]);
            let reach = reaches[slot];
            let low = self.grid.cell(at - 2.0 * reach);
            let high = self.grid.cell(at + 2.0 * reach);
            let [x, y, z] = at.to_array().map(|along| f32x8::splat(simd, along));
            let own = f32x8::splat(simd, reach);
            for cell_z in low.z..=high.z {
                for cell_y in low.y..=high.y {
                    let row = |cell_x| self.grid.number(UVec3::new(cell_x, cell_y, cell_z));
                    let first = self.starts[row(low.x)] as usize;
                    let end = self.starts[row(high.x) + 1] as usize;
                    for others in (first..end).step_by(WIDTH) {
                        let eight = |column: &[f32]| {
                            f32x8::from_slice(simd, &column[others..others + WIDTH])
                        };
                        let (dx, dy, dz) = (eight(xs) - x, eight(ys) - y, eight(zs) - z);
                        let of_others = eight(reaches);
                        let limit = of_others + own;
                        let near = (dx * dx + dy * dy + dz * dz).simd_le(limit * limit);
                        let mut found = (near & of_others.simd_le(own)).to_bitmask();
                        while found != 0 {
                            let other = others + found.trailing_zeros() as usize;
                            found &= found - 1;
                            if other < end && (other > slot || reaches[other] < reach) {
                                slab.list(other).push([slot as u32, other as u32]);
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Displacement of a grain in the current substep [m].
fn motion(part: &Part, i: usize) -> Vec3 {
    let moved: Vec4 = part.displacements[i] - part.carry[i];
    moved.truncate()
}
