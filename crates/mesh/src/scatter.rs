//! Points that cover a surface evenly.

use glam::DVec3;
use std::{cmp::Reverse, collections::BinaryHeap};

use super::MeshError;
use pliant_solver::RestShape;

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Root {
    /// Its position [m].
    pub(crate) at: DVec3,
    /// The unit normal there, interpolated between the vertices.
    pub(crate) normal: DVec3,
}

/// The triangles of a surface that face up within an angle.
pub(crate) struct Surface {
    triangles: Vec<Triangle>,
    /// Total area [m²].
    area: f64,
}

struct Triangle {
    corners: [DVec3; 3],
    /// Unit normals of the surface at the corners, or zero.
    normals: [DVec3; 3],
    /// Unit normal.
    normal: DVec3,
    /// Area of this and all before [m²].
    area_until: f64,
}

/// Candidates per point that is kept, as Yuksel recommends.
const CANDIDATES: u32 = 5;

impl Surface {
    /// The triangles of a shape whose normals are within `coverage` degrees of up. Those without area
    /// are ignored.
    pub(crate) fn new(shape: &RestShape, coverage: f64) -> Result<Self, MeshError> {
        if shape.triangles.is_empty() {
            return Err(MeshError::unusable(
                "the scalp has no triangles on which hair could grow",
                "use a mesh or a part with faces, or a primitive with a surface, such as `Sphere`",
            ));
        }
        let corners = |triangle: &[u32; 3]| triangle.map(|i| shape.vertices[i as usize].as_dvec3());
        let across = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        // Weighted by area.
        let mut normals = vec![DVec3::ZERO; shape.vertices.len()];
        for triangle in &shape.triangles {
            let normal = across(corners(triangle));
            for &corner in triangle {
                normals[corner as usize] += normal;
            }
        }
        // Vertices are rounded to f32.
        let lowest = libm::cos(coverage.to_radians()) - 1e-6;
        let mut area = 0.0;
        let mut has_area = false;
        let mut triangles = Vec::new();
        for triangle in &shape.triangles {
            let corners = corners(triangle);
            let across = across(corners);
            let Some(normal) = across.try_normalize() else {
                continue;
            };
            has_area = true;
            if normal.y < lowest {
                continue;
            }
            area += 0.5 * across.length();
            triangles.push(Triangle {
                corners,
                normals: triangle.map(|i| normals[i as usize].normalize_or_zero()),
                normal,
                area_until: area,
            });
        }
        match (has_area, triangles.is_empty()) {
            (false, _) => Err(MeshError::unusable(
                "all triangles of the scalp have zero area",
                "use triangles with three distinct corners that are not collinear",
            )),
            (true, true) => Err(MeshError::unusable(
                format!("no triangle of the scalp faces up within {coverage}°"),
                "raise `coverage`, or turn the mesh: +y is up before the rotation of the body",
            )),
            (true, false) => Ok(Self { triangles, area }),
        }
    }

    /// This many points that cover the surface evenly, in the order of its triangles.
    pub(crate) fn roots(&self, count: u32) -> Vec<Root> {
        // The largest distance that this many points of a plane could keep.
        let spacing = (self.area / (2.0 * 3.0_f64.sqrt() * f64::from(count))).sqrt();
        thin(&self.candidates(count), count as usize, 2.0 * spacing)
    }

    /// Stratified by area; within triangles by the R2 sequence (Roberts, 2018).
    fn candidates(&self, count: u32) -> Vec<Root> {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        let number = u64::from(count) * u64::from(CANDIDATES);
        let mut place = 0;
        let candidate = |i: u64| {
            let until = (i as f64 + 0.5) / number as f64 * self.area;
            while place + 1 < self.triangles.len() && self.triangles[place].area_until < until {
                place += 1;
            }
            let [u, v] = STEPS.map(|step| (0.5 + (i as f64 + 1.0) * step).fract());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            self.triangles[place].root([1.0 - u - v, u, v])
        };
        (0..number).map(candidate).collect()
    }
}

impl Triangle {
    fn root(&self, weights: [f64; 3]) -> Root {
        let mean = |corners: &[DVec3; 3]| -> DVec3 {
            let terms = corners.iter().zip(weights);
            terms.map(|(corner, weight)| *corner * weight).sum()
        };
        // At a sharp fold the interpolated normal may point into the surface.
        let normal = mean(&self.normals).try_normalize();
        let normal = normal.filter(|normal| normal.dot(self.normal) > 0.0);
        Root {
            at: mean(&self.corners),
            normal: normal.unwrap_or(self.normal),
        }
    }
}

/// Removes points, always one with the closest neighbors, until `count` are left: those closer than
/// `reach` [m] on the same side of the surface count.
fn thin(all: &[Root], count: usize, reach: f64) -> Vec<Root> {
    let cells = Cells::new(all, reach);
    let weight = |i: usize, j: usize| {
        let near = (1.0 - all[i].at.distance(all[j].at) / reach).max(0.0);
        let square = near * near;
        let fourth = square * square;
        fourth * fourth
    };
    let neighbors = |i: usize| {
        let others = cells.around(all[i].at);
        others.filter(move |&j| j != i && all[i].normal.dot(all[j].normal) > 0.0)
    };
    let mut weights: Vec<f64> = (0..all.len())
        .map(|i| neighbors(i).map(|j| weight(i, j)).sum())
        .collect();
    // Weights are not negative, so that their bits are in their order.
    let entry = |i: usize, weights: &[f64]| (weights[i].to_bits(), Reverse(i));
    let mut heap: BinaryHeap<_> = (0..all.len()).map(|i| entry(i, &weights)).collect();
    let mut kept = vec![true; all.len()];
    let mut left = all.len();
    while left > count
        && let Some((bits, Reverse(i))) = heap.pop()
    {
        // Weights only fall, so that an old one is too high.
        if weights[i].to_bits() != bits {
            heap.push(entry(i, &weights));
            continue;
        }
        kept[i] = false;
        left -= 1;
        for j in neighbors(i).filter(|&j| kept[j]) {
            weights[j] = (weights[j] - weight(i, j)).max(0.0);
        }
    }
    let both = all.iter().zip(kept);
    both.filter(|(_, kept)| *kept)
        .map(|(root, _)| *root)
        .collect()
}

/// Points by the cells of a grid.
struct Cells {
    /// Cell and number of each point, sorted.
    points: Vec<([i64; 3], usize)>,
    size: f64,
}

impl Cells {
    fn new(points: &[Root], size: f64) -> Self {
        let cells = points.iter().map(|root| cell(root.at, size));
        let mut points: Vec<_> = cells.zip(0..).collect();
        points.sort_unstable();
        Self { points, size }
    }

    /// The points in the cell of a position and in those around it.
    fn around(&self, at: DVec3) -> impl Iterator<Item = usize> {
        let [x, y, z] = cell(at, self.size);
        let columns = (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| (x, y)));
        columns.flat_map(move |(x, y)| {
            let start = self.points.partition_point(|it| it.0 < [x, y, z - 1]);
            let column = self.points[start..].iter();
            column
                .take_while(move |it| it.0 <= [x, y, z + 1])
                .map(|it| it.1)
        })
    }
}

fn cell(at: DVec3, size: f64) -> [i64; 3] {
    /// Farther away, coordinates do not tell cells apart.
    const LAST: f64 = 1e18;
    let cells = (at / size).floor().to_array();
    cells.map(|x| x.clamp(-LAST, LAST) as i64)
}
