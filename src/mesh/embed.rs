//! Hangs a fine surface on coarse tetrahedra.
//!
//! Each vertex takes, of the tetrahedra near it, the one that holds it or that it is least outside
//! of, measured in barycentric coordinates, so that its weights are as small as they can be. Near is
//! found with a grid. Both meshes are of unit size.

use glam::{DVec3, IVec3};

use super::{Anchor, elements::tetrahedron_volume};

/// Cells of the grid along the longest side of the tetrahedra.
const CELLS: f64 = 24.0;
/// How many more cells around are searched once the first tetrahedra are met, if the point is more
/// outside of them than is bearable.
const FARTHER: [(f64, i32); 2] = [(0.0, 2), (1.0, 6)];

/// Tetrahedra by the cells of a grid that their boxes touch.
struct Grid {
    low: DVec3,
    cell: f64,
    count: IVec3,
    /// Where the tetrahedra of each cell start in `inside`; one more at the end.
    starts: Vec<u32>,
    inside: Vec<u32>,
}

impl Grid {
    fn new(corners: &[[DVec3; 4]]) -> Self {
        let low = corners
            .iter()
            .flatten()
            .fold(DVec3::INFINITY, |m, p| m.min(*p));
        let high = corners
            .iter()
            .flatten()
            .fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
        let cell = (high - low).max_element() / CELLS;
        let count = ((high - low) / cell).floor().as_ivec3() + 1;
        let mut grid = Self {
            low,
            cell,
            count,
            starts: Vec::new(),
            inside: Vec::new(),
        };
        let mut touched: Vec<(u32, u32)> = Vec::new();
        for (index, tetrahedron) in corners.iter().enumerate() {
            let first = tetrahedron
                .iter()
                .copied()
                .fold(DVec3::INFINITY, DVec3::min);
            let last = tetrahedron
                .iter()
                .copied()
                .fold(DVec3::NEG_INFINITY, DVec3::max);
            for cell in cells(grid.cell_of(first), grid.cell_of(last)) {
                touched.push((grid.index(cell), index as u32));
            }
        }
        touched.sort_unstable();
        let total = count.element_product() as u32;
        grid.starts = (0..=total)
            .map(|cell| touched.partition_point(|(at, _)| *at < cell) as u32)
            .collect();
        grid.inside = touched
            .into_iter()
            .map(|(_, tetrahedron)| tetrahedron)
            .collect();
        grid
    }

    /// The cell of a point, or the one nearest to it.
    fn cell_of(&self, point: DVec3) -> IVec3 {
        ((point - self.low) / self.cell)
            .floor()
            .as_ivec3()
            .clamp(IVec3::ZERO, self.count - 1)
    }

    fn index(&self, cell: IVec3) -> u32 {
        (cell.x + self.count.x * (cell.y + self.count.y * cell.z)) as u32
    }

    /// The tetrahedra that touch cells at most `reach` away from a cell; some come more than once.
    fn near(&self, cell: IVec3, reach: i32, out: &mut Vec<u32>) {
        out.clear();
        let low = (cell - reach).max(IVec3::ZERO);
        let high = (cell + reach).min(self.count - 1);
        for cell in cells(low, high) {
            let at = self.index(cell) as usize;
            out.extend(&self.inside[self.starts[at] as usize..self.starts[at + 1] as usize]);
        }
    }
}

fn cells(low: IVec3, high: IVec3) -> impl Iterator<Item = IVec3> {
    (low.z..=high.z).flat_map(move |z| {
        (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| IVec3::new(x, y, z)))
    })
}

/// Anchors of points in tetrahedra, of which there must be one at least, and how many of the points
/// are too far from all of them to be held in place: those are moved to the nearest corner.
pub(super) fn embed(
    points: &[DVec3],
    vertices: &[DVec3],
    tetrahedra: &[[u32; 4]],
) -> (Vec<Anchor>, usize) {
    let corners: Vec<[DVec3; 4]> = tetrahedra
        .iter()
        .map(|t| t.map(|i| vertices[i as usize]))
        .collect();
    let grid = Grid::new(&corners);
    let mut near = Vec::new();
    let mut lost = 0;
    let anchors = points
        .iter()
        .map(|&point| {
            let cell = grid.cell_of(point);
            let mut reach = 0;
            grid.near(cell, reach, &mut near);
            while near.is_empty() {
                reach += 1;
                grid.near(cell, reach, &mut near);
            }
            let mut best = least_outside(&near, &corners, point);
            // The nearest may be a sliver, in which weights are large: look behind it.
            for (bearable, farther) in FARTHER {
                if best.0 > bearable {
                    grid.near(cell, reach + farther, &mut near);
                    best = least_outside(&near, &corners, point);
                }
            }
            let (_, mut tetrahedron, mut weights) = best;
            let limit = f64::from(Anchor::MAX_WEIGHT);
            if weights.iter().any(|w| w.abs() > limit) {
                lost += 1;
                (tetrahedron, weights) = nearest_corner(&near, &corners, point);
            }
            Anchor {
                particles: tetrahedra[tetrahedron as usize],
                weights: rounded(weights),
            }
        })
        .collect();
    (anchors, lost)
}

/// Of the candidates, of which there must be one, the one with the smallest negative weight for a
/// point: how far the point is outside, which it is, and the weights. Of equals the first.
fn least_outside(candidates: &[u32], corners: &[[DVec3; 4]], point: DVec3) -> (f64, u32, [f64; 4]) {
    let mut best = (f64::INFINITY, u32::MAX, [0.0; 4]);
    for &candidate in candidates {
        let weights = barycentric(corners[candidate as usize], point);
        let outside = weights.iter().fold(0.0, |most: f64, w| most.max(-w));
        if (outside, candidate) < (best.0, best.1) {
            best = (outside, candidate, weights);
        }
    }
    best
}

fn barycentric([a, b, c, d]: [DVec3; 4], point: DVec3) -> [f64; 4] {
    let whole = tetrahedron_volume([a, b, c, d]);
    let u = tetrahedron_volume([point, b, c, d]) / whole;
    let v = tetrahedron_volume([a, point, c, d]) / whole;
    let w = tetrahedron_volume([a, b, point, d]) / whole;
    [u, v, w, 1.0 - u - v - w]
}

/// Of the candidates the one with the corner nearest to a point, and weights that mean that corner.
fn nearest_corner(candidates: &[u32], corners: &[[DVec3; 4]], point: DVec3) -> (u32, [f64; 4]) {
    let mut best = (f64::INFINITY, u32::MAX, 0);
    for &candidate in candidates {
        for (corner, place) in corners[candidate as usize].iter().enumerate() {
            let distance = place.distance_squared(point);
            if (distance, candidate, corner) < best {
                best = (distance, candidate, corner);
            }
        }
    }
    let mut weights = [0.0; 4];
    weights[best.2] = 1.0;
    (best.1, weights)
}

/// Rounded to f32 so that they still sum to 1: the largest weight takes what rounding left.
fn rounded(weights: [f64; 4]) -> [f32; 4] {
    let mut rounded = weights.map(|w| w as f32);
    let largest = (0..4).fold(0, |l, k| if rounded[k] > rounded[l] { k } else { l });
    let others: f64 = (0..4)
        .filter(|k| *k != largest)
        .map(|k| f64::from(rounded[k]))
        .sum();
    rounded[largest] = (1.0 - others) as f32;
    rounded
}
