//! Embeds a fine surface in coarse tetrahedra.
//!
//! Each vertex is anchored to the nearby tetrahedron that contains it, or otherwise to the one with
//! the smallest negative barycentric coordinate, which keeps the weights small. Candidates come
//! from a grid. Both meshes are of unit size.

use glam::{DMat3, DVec3, IVec3};
use pliant_solver::VertexIndex;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::Anchor;

/// Search radius, in additional cells, after the first tetrahedra were found, where the point is
/// farther outside of them than the given tolerance.
const FARTHER: [(f64, i32); 2] = [(0.0, 1), (1.0, 3)];

/// A tetrahedron with its inverse matrix for barycentric coordinates.
struct Element {
    corners: [DVec3; 4],
    /// Maps a position relative to the last corner to the weights of the first three.
    to_weights: DMat3,
}

impl Element {
    fn new(corners: [DVec3; 4]) -> Self {
        let [a, b, c, d] = corners;
        Self {
            corners,
            to_weights: DMat3::from_cols(a - d, b - d, c - d).inverse(),
        }
    }

    fn weights(&self, point: DVec3) -> [f64; 4] {
        let [u, v, w] = (self.to_weights * (point - self.corners[3])).to_array();
        [u, v, w, 1.0 - u - v - w]
    }

    fn low(&self) -> DVec3 {
        self.corners.into_iter().fold(DVec3::INFINITY, DVec3::min)
    }

    fn high(&self) -> DVec3 {
        self.corners
            .into_iter()
            .fold(DVec3::NEG_INFINITY, DVec3::max)
    }
}

/// Tetrahedra by the grid cells that their bounding boxes touch. Cells have the size of a
/// tetrahedron.
struct Grid {
    low: DVec3,
    cell: f64,
    count: IVec3,
    /// Start of the range of each cell in `inside`, with one more entry at the end.
    starts: Vec<u32>,
    inside: Vec<u32>,
}

impl Grid {
    fn new(elements: &[Element]) -> Self {
        let low = elements
            .iter()
            .map(Element::low)
            .fold(DVec3::INFINITY, DVec3::min);
        let high = elements
            .iter()
            .map(Element::high)
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        let sizes = elements.iter().map(|e| (e.high() - e.low()).max_element());
        // Lower limit, so that a few tiny tetrahedra do not make a grid of many empty cells.
        let cell =
            (sizes.sum::<f64>() / elements.len() as f64).max((high - low).max_element() / 256.0);
        let mut grid = Self {
            low,
            cell,
            count: ((high - low) / cell).floor().as_ivec3() + 1,
            starts: Vec::new(),
            inside: Vec::new(),
        };
        let mut touched: Vec<(u32, u32)> = Vec::new();
        for (number, element) in (0..).zip(elements) {
            for cell in cells(grid.cell_of(element.low()), grid.cell_of(element.high())) {
                touched.push((grid.index(cell), number));
            }
        }
        touched.sort_unstable();
        let total = grid.count.element_product() as usize;
        grid.starts = vec![0; total + 1];
        for (at, _) in &touched {
            grid.starts[*at as usize + 1] += 1;
        }
        for at in 0..total {
            grid.starts[at + 1] += grid.starts[at];
        }
        grid.inside = touched.into_iter().map(|(_, number)| number).collect();
        grid
    }

    /// Cell of a point, or the nearest cell.
    fn cell_of(&self, point: DVec3) -> IVec3 {
        ((point - self.low) / self.cell)
            .floor()
            .as_ivec3()
            .clamp(IVec3::ZERO, self.count - 1)
    }

    fn index(&self, cell: IVec3) -> u32 {
        (cell.x + self.count.x * (cell.y + self.count.y * cell.z)) as u32
    }

    /// Tetrahedra that touch cells within `reach` of a cell; may contain duplicates.
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

/// Anchors of points in tetrahedra (at least one), and the number of points that are too far from
/// all of them to be anchored in place: these are moved to the nearest corner.
///
/// Points and vertices are in the same unit of length.
#[must_use]
pub fn embed(
    points: &[DVec3],
    vertices: &[DVec3],
    tetrahedra: &[[u32; 4]],
) -> (Vec<Anchor>, usize) {
    let elements: Vec<Element> = tetrahedra
        .iter()
        .map(|t| Element::new(t.map(|i| vertices[i as usize])))
        .collect();
    let grid = Grid::new(&elements);
    let lost = AtomicUsize::new(0);
    let anchors = points
        .par_iter()
        .map_init(Vec::new, |near, &point| {
            let cell = grid.cell_of(point);
            let mut reach = 0;
            grid.near(cell, reach, near);
            while near.is_empty() {
                reach += 1;
                grid.near(cell, reach, near);
            }
            let mut best = least_outside(near, &elements, point);
            // The nearest one may be a sliver with large weights: search farther.
            for (bearable, farther) in FARTHER {
                if best.0 > bearable {
                    grid.near(cell, reach + farther, near);
                    best = least_outside(near, &elements, point);
                }
            }
            let (_, mut tetrahedron, mut weights) = best;
            let limit = f64::from(Anchor::MAX_WEIGHT);
            if weights.iter().any(|w| w.abs() > limit) {
                lost.fetch_add(1, Ordering::Relaxed);
                (tetrahedron, weights) = nearest_corner(near, &elements, point);
            }
            Anchor {
                vertices: tetrahedra[tetrahedron as usize].map(VertexIndex),
                weights: rounded(weights),
            }
        })
        .collect();
    (anchors, lost.into_inner())
}

/// Finds the candidate (at least one is required) with the smallest negative weight for a point.
/// Returns its distance outside, its index, and the weights. The first one wins a tie.
fn least_outside(candidates: &[u32], elements: &[Element], point: DVec3) -> (f64, u32, [f64; 4]) {
    let mut best = (f64::INFINITY, u32::MAX, [0.0; 4]);
    for &candidate in candidates {
        let weights = elements[candidate as usize].weights(point);
        let outside = weights.iter().fold(0.0, |most: f64, w| most.max(-w));
        if (outside, candidate) < (best.0, best.1) {
            best = (outside, candidate, weights);
        }
    }
    best
}

/// The candidate with the corner nearest to a point, and the weights of that corner.
fn nearest_corner(candidates: &[u32], elements: &[Element], point: DVec3) -> (u32, [f64; 4]) {
    let mut best = (f64::INFINITY, u32::MAX, 0);
    for &candidate in candidates {
        for (corner, place) in elements[candidate as usize].corners.iter().enumerate() {
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

/// Rounds to f32 with the sum kept at 1: the largest weight absorbs the remainder.
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
