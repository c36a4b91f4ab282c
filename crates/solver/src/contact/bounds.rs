//! Bounding balls of motion, axis-aligned boxes, and queries for overlapping boxes.

use super::closest::Kind;
use crate::lanes::{Instructions, Lanes, SimdWork};
use fearless_simd::{f32x8, prelude::*, u32x8};
use glam::{DVec3, UVec3, Vec3A};
use std::ops::Range;

/// A ball [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    pub center: Vec3A,
    pub radius: f32,
}

impl Ball {
    /// The ball of radius 0 at the origin.
    pub const ORIGIN: Self = Self {
        center: Vec3A::ZERO,
        radius: 0.0,
    };

    /// Bounds a straight motion, enlarged by `more` [m].
    pub fn around(from: DVec3, displacement: DVec3, more: f32) -> Self {
        Self {
            center: (from + displacement * 0.5).as_vec3a(),
            radius: 0.5 * displacement.length() as f32 + more,
        }
    }

    /// Maximum distance of points of another ball from the center [m].
    pub fn farthest(self, other: Self) -> f32 {
        (self.center - other.center).length() + other.radius
    }

    /// Whether it contains all of another ball.
    pub fn contains(self, other: Self) -> bool {
        self.farthest(other) <= self.radius
    }

    /// Minkowski sum with another ball.
    pub fn plus(self, other: Self) -> Self {
        Self {
            center: self.center + other.center,
            radius: self.radius + other.radius,
        }
    }

    /// Minkowski difference with another ball.
    pub fn minus(self, other: Self) -> Self {
        Self {
            center: self.center - other.center,
            radius: self.radius + other.radius,
        }
    }

    /// Bounding box.
    pub fn bounds(self) -> Bounds {
        Bounds {
            low: self.center - self.radius,
            high: self.center + self.radius,
        }
    }
}

/// Whether the bounding boxes of two primitives with these corners, those of the second displaced,
/// are closer than `reach` [m].
pub fn boxes_meet(kind: Kind, corners: [Vec3A; 4], displaced: Vec3A, reach: f32) -> bool {
    let around = |corners: &[Vec3A]| {
        let all = corners.iter().map(|&at| Bounds::around(at, at));
        all.fold(Bounds::EMPTY, Bounds::with)
    };
    let (first, second) = corners.split_at(kind.split());
    let by = Bounds::around(displaced, displaced);
    around(first)
        .grown(reach)
        .meets(&around(second).displaced(&by))
}

/// A box [m]; by default the empty one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub low: Vec3A,
    pub high: Vec3A,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Self = Self {
        low: Vec3A::INFINITY,
        high: Vec3A::NEG_INFINITY,
    };

    /// Bounds two points.
    pub fn around(a: Vec3A, b: Vec3A) -> Self {
        Self {
            low: a.min(b),
            high: a.max(b),
        }
    }

    /// Expanded by `by` on all sides [m].
    pub fn grown(self, by: f32) -> Self {
        Self {
            low: self.low - by,
            high: self.high + by,
        }
    }

    /// Union of two boxes.
    pub fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Whether a point lies in it.
    pub fn contains(&self, at: Vec3A) -> bool {
        self.low.cmple(at).all() && at.cmple(self.high).all()
    }

    /// Whether two boxes overlap.
    pub fn meets(&self, other: &Self) -> bool {
        (self.low.cmple(other.high) & self.high.cmpge(other.low)).all()
    }

    /// Bounds a point of this box displaced by a vector of another.
    pub fn displaced(self, by: &Self) -> Self {
        Self {
            low: self.low + by.low,
            high: self.high + by.high,
        }
    }

    /// Its center [m].
    pub fn center(&self) -> Vec3A {
        (self.low + self.high) * 0.5
    }

    fn half(&self) -> Vec3A {
        (self.high - self.low) * 0.5
    }
}

/// Boxes as columns, for comparing another box with all of them, eight at once. Faster than a
/// [`Grid`] for up to some hundred boxes.
#[derive(Debug, Default)]
pub struct Columns {
    eights: Vec<Eight>,
}

/// Eight boxes.
#[derive(Debug)]
struct Eight {
    /// Lower bounds along x, y and z, and upper ones [m].
    boxes: [[f32; 8]; 6],
    /// Up to three vertices of what is in each.
    vertices: [[u32; 8]; 3],
}

impl Columns {
    /// Stores boxes, with the vertices of what is in them, if boxes that share one are to be left out.
    pub fn fill(&mut self, boxes: &[Bounds], vertices: Option<&[[u32; 3]]>) {
        self.eights.clear();
        self.eights
            .extend(boxes.chunks(8).enumerate().map(|(number, some)| {
                // Padding that overlaps nothing.
                let mut eight = Eight {
                    boxes: [[f32::INFINITY; 8]; 6],
                    vertices: [[u32::MAX; 8]; 3],
                };
                for (place, each) in some.iter().enumerate() {
                    for axis in 0..3 {
                        eight.boxes[axis][place] = each.low[axis];
                        eight.boxes[axis + 3][place] = each.high[axis];
                    }
                }
                let vertices = vertices.map_or(&[][..], |all| &all[8 * number..]);
                for (place, each) in vertices.iter().take(8).enumerate() {
                    for (column, &vertex) in eight.vertices.iter_mut().zip(each) {
                        column[place] = vertex;
                    }
                }
                eight
            }));
    }

    /// Adds to `hits` the pairs of a query, by its number, and a box that it overlaps, both in
    /// their order; with the vertices of the queries, only those that share none. Where the queries are
    /// the boxes themselves, each pair only once.
    pub fn near(
        &self,
        (queries, vertices): (&[Bounds], Option<&[[u32; 3]]>),
        are_same: bool,
        instructions: Instructions,
        hits: &mut Vec<[u32; 2]>,
    ) {
        instructions.run(Overlaps {
            eights: &self.eights,
            queries,
            vertices,
            are_same,
            hits,
        });
    }
}

/// Compares boxes with all others, eight at once.
struct Overlaps<'a> {
    eights: &'a [Eight],
    queries: &'a [Bounds],
    vertices: Option<&'a [[u32; 3]]>,
    are_same: bool,
    hits: &'a mut Vec<[u32; 2]>,
}

impl SimdWork for Overlaps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        for (number, query) in (0..).zip(self.queries) {
            let low = [
                f32x8::splat(simd, query.low.x),
                f32x8::splat(simd, query.low.y),
                f32x8::splat(simd, query.low.z),
            ];
            let high = [
                f32x8::splat(simd, query.high.x),
                f32x8::splat(simd, query.high.y),
                f32x8::splat(simd, query.high.z),
            ];
            let own = self.vertices.map(|all| all[number as usize]);
            let first = if self.are_same { number / 8 } else { 0 };
            for (eight, columns) in (first..).zip(&self.eights[first as usize..]) {
                let [x, y, z, to_x, to_y, to_z] = &columns.boxes;
                let along_x = f32x8::from_slice(simd, x).simd_le(high[0])
                    & f32x8::from_slice(simd, to_x).simd_ge(low[0]);
                let along_y = f32x8::from_slice(simd, y).simd_le(high[1])
                    & f32x8::from_slice(simd, to_y).simd_ge(low[1]);
                let along_z = f32x8::from_slice(simd, z).simd_le(high[2])
                    & f32x8::from_slice(simd, to_z).simd_ge(low[2]);
                let mut overlaps = (along_x & along_y & along_z).to_bitmask();
                if overlaps != 0
                    && let Some([a, b, c]) = own
                {
                    for vertices in &columns.vertices {
                        let all = u32x8::from_slice(simd, vertices);
                        let shared = all.simd_eq(u32x8::splat(simd, a))
                            | all.simd_eq(u32x8::splat(simd, b))
                            | all.simd_eq(u32x8::splat(simd, c));
                        overlaps &= !shared.to_bitmask();
                    }
                }
                if self.are_same && eight == first {
                    // Those after it.
                    overlaps &= !1 << (number % 8);
                }
                while overlaps != 0 {
                    self.hits
                        .push([number, eight * 8 + overlaps.trailing_zeros()]);
                    overlaps &= overlaps - 1;
                }
            }
        }
    }
}

/// Maximum number of grid cells per box.
const CELLS: u32 = 16;

/// Boxes in the grid cells that contain their centers.
#[derive(Debug, Default)]
pub struct Grid {
    /// Start of the range of each cell, and the end of the last.
    starts: Vec<u32>,
    items: Vec<u32>,
    cells: Vec<u32>,
    low: Vec3A,
    per_length: Vec3A,
    count: UVec3,
    reach: Vec3A,
}

impl Grid {
    /// Sorts boxes into cells for queries with boxes of about this size [m].
    pub fn fill(&mut self, boxes: &[Bounds], query: f32) {
        let mut centers = Bounds::EMPTY;
        let mut extent = 0.0;
        self.reach = Vec3A::ZERO;
        for each in boxes {
            let center = each.center();
            centers = centers.with(Bounds::around(center, center));
            self.reach = self.reach.max(each.half());
            extent += f64::from(each.half().max_element());
        }
        if boxes.is_empty() {
            centers = Bounds::around(Vec3A::ZERO, Vec3A::ZERO);
        }
        let mean = (2.0 * extent / boxes.len().max(1) as f64) as f32;
        let size = centers.high - centers.low;
        let mut cell = (mean + query).max(size.max_element() * 1e-3);
        let max_cells = (boxes.len() as u32 * CELLS).max(64);
        let count = |cell: f32| {
            let along = |length: f32| (length / cell) as u32 + 1;
            UVec3::new(along(size.x), along(size.y), along(size.z))
        };
        while cell > 0.0 && count(cell).element_product() > max_cells {
            cell *= 1.25;
        }
        self.low = centers.low;
        (self.count, self.per_length) = if cell > 0.0 {
            (count(cell), Vec3A::splat(1.0 / cell))
        } else {
            (UVec3::ONE, Vec3A::ZERO)
        };
        self.cells.clear();
        for each in boxes {
            let cell = self.cell(each.center());
            self.cells.push(self.number(cell));
        }
        self.starts.clear();
        self.starts
            .resize(self.count.element_product() as usize + 1, 0);
        for &cell in &self.cells {
            self.starts[cell as usize + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.items.clear();
        self.items.resize(boxes.len(), 0);
        // In reverse, so that the boxes of a cell stay in order and `starts` ends up correct.
        for (item, &cell) in self.cells.iter().enumerate().rev() {
            let end = &mut self.starts[cell as usize + 1];
            *end -= 1;
            self.items[*end as usize] = item as u32;
        }
        // Each entry has become the start of the cell before it: shift by one.
        self.starts.rotate_left(1);
        if let Some(last) = self.starts.last_mut() {
            *last = boxes.len() as u32;
        }
    }

    /// Visits the boxes that may overlap another, by rows of cells.
    pub fn near(&self, query: &Bounds, mut visit: impl FnMut(u32)) {
        let low = self.cell(query.low - self.reach);
        let high = self.cell(query.high + self.reach);
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let row = self.row(UVec3::new(low.x, y, z), high.x);
                for &item in &self.items[row] {
                    visit(item);
                }
            }
        }
    }

    fn row(&self, first: UVec3, last: u32) -> Range<usize> {
        let start = self.number(first) as usize;
        let end = start + (last - first.x) as usize;
        self.starts[start] as usize..self.starts[end + 1] as usize
    }

    fn cell(&self, point: Vec3A) -> UVec3 {
        // Casts saturate at 0: points outside belong to the border cells.
        let at = (point - self.low) * self.per_length;
        UVec3::new(at.x as u32, at.y as u32, at.z as u32).min(self.count - 1)
    }

    fn number(&self, cell: UVec3) -> u32 {
        (cell.z * self.count.y + cell.y) * self.count.x + cell.x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pairs_of_boxes_that_overlap_are_found() {
        let mut seed = 7_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        let mut grid = Grid::default();
        let mut columns = Columns::default();
        for (count, size) in [(0, 0.1), (1, 0.1), (40, 0.5), (300, 0.05), (300, 0.0)] {
            let mut boxes = |count| -> Vec<Bounds> {
                (0..count)
                    .map(|i| {
                        let at = Vec3A::new(noise(), noise(), noise() * 0.1);
                        // One in ten is large, as an outlier.
                        let size = if i % 10 == 9 { size * 8.0 } else { size };
                        Bounds::around(at, at + Vec3A::new(noise(), noise(), noise()) * size)
                    })
                    .collect()
            };
            let (some, others) = (boxes(count), boxes(50));
            grid.fill(&some, size);
            let mut pairs = 0;
            for other in &others {
                let mut found = Vec::new();
                grid.near(other, |item| {
                    if some[item as usize].meets(other) {
                        found.push(item);
                    }
                });
                found.sort_unstable();
                let expected = some.iter().zip(0..).filter(|(it, _)| it.meets(other));
                let expected: Vec<u32> = expected.map(|(_, item)| item).collect();
                assert_eq!(found, expected);
                pairs += expected.len();
            }
            columns.fill(&some, None);
            for instructions in Instructions::all() {
                let mut hits = Vec::new();
                columns.near((&others, None), false, instructions, &mut hits);
                let queries = others.iter().zip(0..);
                let expected = queries.flat_map(|(other, query)| {
                    let overlapping = some.iter().zip(0..).filter(|(it, _)| it.meets(other));
                    overlapping.map(move |(_, item)| [query, item])
                });
                assert_eq!(hits, expected.collect::<Vec<[u32; 2]>>());
            }
            // Boxes of edges along a chain, each with the others: once, and not with neighbors.
            let ends: Vec<_> = (0..some.len() as u32).map(|i| [i, i + 1, i + 1]).collect();
            columns.fill(&some, Some(&ends));
            for instructions in Instructions::all() {
                let mut hits = Vec::new();
                columns.near((&some, Some(&ends)), true, instructions, &mut hits);
                let places = 0..some.len();
                let expected = places.clone().flat_map(|a| {
                    let (some, after) = (&some, places.clone().skip(a + 2));
                    let overlapping = after.filter(move |&b| some[a].meets(&some[b]));
                    overlapping.map(move |b| [a as u32, b as u32])
                });
                assert_eq!(hits, expected.collect::<Vec<[u32; 2]>>());
            }
            assert!(pairs > 0 || count < 2 || size == 0.0, "no pair of {count}");
        }
    }
}
