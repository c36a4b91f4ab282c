//! Balls around motion, axis-aligned boxes, and all pairs of boxes that overlap.

use super::closest::Kind;
use glam::{DVec3, UVec3, Vec3A};
use std::ops::Range;

/// A ball [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    pub center: Vec3A,
    pub radius: f32,
}

impl Ball {
    /// Nothing but the origin.
    pub const ORIGIN: Self = Self {
        center: Vec3A::ZERO,
        radius: 0.0,
    };

    /// Around a straight way, and so much more [m].
    pub fn around(from: DVec3, way: DVec3, more: f32) -> Self {
        Self {
            center: (from + way * 0.5).as_vec3a(),
            radius: 0.5 * way.length() as f32 + more,
        }
    }

    /// How far points of another are from the center at most [m].
    pub fn farthest(self, other: Self) -> f32 {
        (self.center - other.center).length() + other.radius
    }

    /// Whether all of another is inside.
    pub fn contains(self, other: Self) -> bool {
        self.farthest(other) <= self.radius
    }

    /// All sums of a point of this ball and one of another.
    pub fn plus(self, other: Self) -> Self {
        Self {
            center: self.center + other.center,
            radius: self.radius + other.radius,
        }
    }

    /// All differences of a point of this ball and one of another.
    pub fn minus(self, other: Self) -> Self {
        Self {
            center: self.center - other.center,
            radius: self.radius + other.radius,
        }
    }

    /// The box around it.
    pub fn bounds(self) -> Bounds {
        Bounds {
            low: self.center - self.radius,
            high: self.center + self.radius,
        }
    }
}

/// Whether boxes around two primitives with corners at these places, those of the second displaced, are closer than
/// `reach` [m].
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

/// Distance of two primitives with corners at these places, those of the second displaced [m].
pub fn distance(kind: Kind, corners: [Vec3A; 4], displaced: Vec3A) -> f64 {
    let mut corners = corners.map(|at| at.as_dvec3());
    for corner in &mut corners[kind.split()..] {
        *corner += displaced.as_dvec3();
    }
    kind.distance(corners)
}

/// A box [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub low: Vec3A,
    pub high: Vec3A,
}

impl Bounds {
    /// Holds nothing.
    pub const EMPTY: Self = Self {
        low: Vec3A::INFINITY,
        high: Vec3A::NEG_INFINITY,
    };

    /// Around two points.
    pub fn around(a: Vec3A, b: Vec3A) -> Self {
        Self {
            low: a.min(b),
            high: a.max(b),
        }
    }

    /// Grown by `by` on all sides [m].
    pub fn grown(self, by: f32) -> Self {
        Self {
            low: self.low - by,
            high: self.high + by,
        }
    }

    /// Around two boxes.
    pub fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Whether two boxes share a point.
    pub fn meets(&self, other: &Self) -> bool {
        (self.low.cmple(other.high) & self.high.cmpge(other.low)).all()
    }

    /// Where a point of this box can be that is displaced by a vector of another.
    pub fn displaced(self, by: &Self) -> Self {
        Self {
            low: self.low + by.low,
            high: self.high + by.high,
        }
    }

    fn center(&self) -> Vec3A {
        (self.low + self.high) * 0.5
    }

    fn half(&self) -> Vec3A {
        (self.high - self.low) * 0.5
    }
}

/// A few boxes as columns, to compare another with all of them: for some hundred that is faster than a [`Grid`], as
/// eight are compared at once.
#[derive(Debug, Default)]
pub struct Columns {
    /// Lower bounds along x, y and z, and upper ones, of eight boxes.
    eights: Vec<[[f32; 8]; 6]>,
}

impl Columns {
    /// Takes boxes in.
    pub fn fill(&mut self, boxes: &[Bounds]) {
        self.eights.clear();
        self.eights.extend(boxes.chunks(8).map(|some| {
            // What is not there overlaps nothing.
            let mut columns = [[f32::INFINITY; 8]; 6];
            for (place, each) in some.iter().enumerate() {
                for axis in 0..3 {
                    columns[axis][place] = each.low[axis];
                    columns[axis + 3][place] = each.high[axis];
                }
            }
            columns
        }));
    }

    /// Visits the boxes that overlap another, in their order.
    pub fn near(&self, query: &Bounds, mut visit: impl FnMut(u32)) {
        let (low, high) = (query.low.to_array(), query.high.to_array());
        for (eight, [lx, ly, lz, hx, hy, hz]) in (0..).zip(&self.eights) {
            // Largest of the distances along the axes, below or at 0 where boxes overlap: minima and maxima are what
            // compilers put into lanes.
            let mut apart = [0.0_f32; 8];
            for i in 0..8 {
                let x = (lx[i] - high[0]).max(low[0] - hx[i]);
                let y = (ly[i] - high[1]).max(low[1] - hy[i]);
                let z = (lz[i] - high[2]).max(low[2] - hz[i]);
                apart[i] = x.max(y).max(z);
            }
            if apart.iter().all(|&apart| apart > 0.0) {
                continue;
            }
            for (place, _) in (0..).zip(apart).filter(|(_, apart)| *apart <= 0.0) {
                visit(eight * 8 + place);
            }
        }
    }
}

/// Cells of a grid per box at most.
const CELLS: u32 = 16;

/// Boxes by the cells of a grid in which their centers are.
#[derive(Debug, Default)]
pub struct Grid {
    /// Where the boxes of each cell begin, and where those of the last one end.
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
        let mut whole = Bounds::EMPTY;
        let mut extent = 0.0;
        self.reach = Vec3A::ZERO;
        for each in boxes {
            let center = each.center();
            whole = whole.with(Bounds::around(center, center));
            self.reach = self.reach.max(each.half());
            extent += f64::from(each.half().max_element());
        }
        if boxes.is_empty() {
            whole = Bounds::around(Vec3A::ZERO, Vec3A::ZERO);
        }
        let mean = (2.0 * extent / boxes.len().max(1) as f64) as f32;
        let size = whole.high - whole.low;
        let mut cell = (mean + query).max(size.max_element() * 1e-3);
        let most = (boxes.len() as u32 * CELLS).max(64);
        let count = |cell: f32| {
            let along = |length: f32| (length / cell) as u32 + 1;
            UVec3::new(along(size.x), along(size.y), along(size.z))
        };
        while cell > 0.0 && count(cell).element_product() > most {
            cell *= 1.25;
        }
        self.low = whole.low;
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
        // From the last to the first, so that those of a cell stay in their order and starts end up right.
        for (item, &cell) in self.cells.iter().enumerate().rev() {
            let end = &mut self.starts[cell as usize + 1];
            *end -= 1;
            self.items[*end as usize] = item as u32;
        }
        // Each entry has become the start of the cell before it: put them one down.
        self.starts.rotate_left(1);
        if let Some(last) = self.starts.last_mut() {
            *last = boxes.len() as u32;
        }
    }

    /// Visits the boxes that may overlap another, row of cells by row of cells.
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
        // Casts stop at 0: what is outside belongs to the border.
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
                        // One in ten is large, to be an outlier.
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
                columns.fill(&some);
                found.clear();
                columns.near(other, |item| found.push(item));
                assert_eq!(found, expected);
                pairs += expected.len();
            }
            assert!(pairs > 0 || count < 2 || size == 0.0, "no pair of {count}");
        }
    }
}
