//! Charts of surfaces that are a graph over a plane at rest, as cloth is.
//!
//! A chart gives each vertex a place in the plane. A map x of a convex part of the plane with
//!
//! d·R Dx d ≥ σ|d|² for all d, everywhere, with one 2×3 matrix R of norm at most 1,
//!
//! keeps any two of its points p and q at a distance of at least σ|p − q|: integrate (p − q)·R Dx (p − q) from
//! one to the other. So two patches that lie in such a part do not touch, without a look at their elements: two
//! elements that share no vertex are apart in the plane by at least the smallest height of a triangle.

use super::{components::Components, patches::Patch};
use glam::{DVec2, DVec3, Vec3};
use std::{iter, ops::Range};

/// Smallest cosine of the angle between a triangle and the plane of its chart.
const STEEPEST: f64 = 0.2;

/// Patches whose boxes are apart by at most this fraction of the size of one are neighbors.
const NEIGHBORS: f64 = 0.5;

/// Points beyond a side by this fraction of the lengths involved lie on it.
const ROUNDING: f64 = 2e-6;

/// A chart of the patches of a surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chart {
    /// By patch; without triangles where there is none.
    pub patches: Vec<ChartPatch>,
    /// Patches that are neighbors in the plane, and each with itself, in ascending order.
    pairs: Vec<ChartPair>,
    /// Patches whose triangles lie between those of a pair.
    between: Vec<u32>,
}

/// Triangles of a patch with their places in the plane, by eight; what is missing of the last is repeated.
#[derive(Debug, Clone, Default)]
pub(crate) struct ChartPatch {
    pub eights: Vec<EightTriangles>,
}

/// Eight triangles with their places in the plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EightTriangles {
    /// Indices of each corner into the vertices of the patch.
    pub corners: [[u32; 8]; 3],
    /// Inverse of the matrix of two sides, by its elements row by row [1/m].
    pub inverse: [[f32; 8]; 4],
}

/// Two patches that may be shown not to touch.
#[derive(Debug, Clone)]
pub(crate) struct ChartPair {
    pub patches: [u32; 2],
    between: Range<usize>,
    /// Two of their elements without a common vertex are apart by at least this in the plane [m].
    pub height: f32,
}

/// What is needed of a patch, or of a component in it, to find its pairs.
struct Part {
    patch: u32,
    component: u32,
    /// Whether the patch has nothing of other components: only then are its derivatives known.
    is_whole: bool,
    low: DVec2,
    high: DVec2,
    /// Places of the corners of its triangles.
    triangles: Vec<[DVec2; 3]>,
    /// Those of triangles at sides that have not exactly one other triangle, which come first.
    border: Vec<[DVec2; 3]>,
    /// The corners of its convex hull, counterclockwise.
    hull: Vec<DVec2>,
    height: f64,
}

impl Chart {
    /// Of a surface with these vertices [m], triangles and patches.
    pub fn of(rest: &[Vec3], triangles: &[[u32; 3]], patches: &[Patch]) -> Self {
        let components = components(rest.len(), triangles);
        let places = places(rest, triangles, &components);
        let mut sides: Vec<[u32; 2]> = triangles.iter().flat_map(sides).collect();
        sides.sort_unstable();
        let of_patch = |(number, patch)| Part::all((number, patch), &components, &places, &sides);
        let mut parts: Vec<_> = (0..).zip(patches).flat_map(of_patch).collect();
        let mut chart = Self {
            patches: vec![ChartPatch::default(); patches.len()],
            ..Self::default()
        };
        for part in parts.iter().filter(|part| part.is_whole) {
            let number = part.patch as usize;
            chart.patches[number] = ChartPatch::of(&patches[number], &places);
        }
        parts.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
        let widths = parts.iter().map(|part| part.high.x - part.low.x);
        let widest = widths.fold(0.0, f64::max);
        for (place, one) in parts.iter().enumerate() {
            let more = NEIGHBORS * (one.high - one.low).max_element();
            let near = |other: &&Part| other.low.x <= one.high.x + more;
            for other in parts[place..].iter().take_while(near) {
                let grown = [other.low - more, other.high + more];
                if one.is_whole && other.is_whole && one.meets(grown, other.component) {
                    chart.add([one, other], &parts, widest);
                }
            }
        }
        chart.pairs.sort_unstable_by_key(|pair| pair.patches);
        chart
    }

    /// Adds two patches if every straight line between their points lies in the surface. All parts are sorted by
    /// where they begin along x, and are at most this wide [m].
    fn add(&mut self, [one, other]: [&Part; 2], all: &[Part], widest: f64) {
        let around = [one.low.min(other.low), one.high.max(other.high)];
        let extent = (around[1] - around[0]).length();
        let hull = convex_hull(one.hull.iter().chain(&other.hull).copied());
        let is_between = |part: &Part| {
            let mut triangles = part.triangles.iter();
            part.meets(around, one.component) && triangles.any(|it| cut(it, &hull, extent))
        };
        let first = all.partition_point(|part| part.low.x < around[0].x - widest);
        let near = all[first..].iter();
        let near = near.take_while(|part| part.low.x <= around[1].x);
        let between: Vec<_> = near.filter(|part| is_between(part)).collect();
        let is_outside = |[from, to, third]: &[DVec2; 3]| {
            let along = *to - *from;
            let allowed = -ROUNDING * along.length() * extent;
            let mut corners = hull.iter();
            corners.any(|at| along.perp_dot(*at - *from) < allowed)
                && cut(&[*from, *to, *third], &hull, extent)
        };
        // The surface does not overlap itself here, if it does not in one point.
        let [x, y, z] = one.triangles[0];
        let center = (x + y + z) / 3.0;
        let covering = between.iter().flat_map(|part| &part.triangles);
        let covering = covering.filter(|triangle| contains(triangle, center));
        let mut border = between.iter().flat_map(|part| &part.border);
        let are_known = between.iter().all(|part| part.is_whole);
        if !are_known || border.any(is_outside) || covering.count() != 1 {
            return;
        }
        let first = self.between.len();
        self.between.extend(between.iter().map(|part| part.patch));
        let heights = between.iter().map(|part| part.height);
        let [a, b] = [one.patch, other.patch];
        self.pairs.push(ChartPair {
            patches: [a.min(b), a.max(b)],
            between: first..self.between.len(),
            height: heights.fold(f64::INFINITY, f64::min) as f32,
        });
    }

    /// Index of two patches, in ascending order, among the pairs that may be shown not to touch.
    pub fn find(&self, patches: [u32; 2]) -> Option<u32> {
        let found = self.pairs.binary_search_by_key(&patches, |it| it.patches);
        found.ok().map(|place| place as u32)
    }

    /// Number of pairs.
    #[cfg(test)]
    pub fn pairs(&self) -> u32 {
        self.pairs.len() as u32
    }

    /// One of the pairs, and the patches whose triangles lie between their points.
    pub fn pair(&self, number: u32) -> (&ChartPair, &[u32]) {
        let pair = &self.pairs[number as usize];
        (pair, &self.between[pair.between.clone()])
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let patches = self.patches.iter();
        let triangles = patches.map(|patch| size_of_val(&patch.eights[..]));
        triangles.sum::<usize>() + size_of_val(&self.pairs[..]) + size_of_val(&self.between[..])
    }
}

impl ChartPatch {
    fn of(patch: &Patch, places: &[DVec2]) -> Self {
        let mut all = patch.triangles.iter().copied().cycle();
        let eights = (0..patch.triangles.len().div_ceil(8)).map(|_| {
            let mut eight = EightTriangles {
                corners: [[0; 8]; 3],
                inverse: [[0.0; 8]; 4],
            };
            for (lane, corners) in (0..8).zip(all.by_ref()) {
                let [a, b, c] = corners.map(|it| places[patch.vertices[it as usize] as usize]);
                let (u, v) = (b - a, c - a);
                let inverse = [v.y, -v.x, -u.y, u.x].map(|it| (it / u.perp_dot(v)) as f32);
                for (column, corner) in eight.corners.iter_mut().zip(corners) {
                    column[lane] = corner;
                }
                for (column, element) in eight.inverse.iter_mut().zip(inverse) {
                    column[lane] = element;
                }
            }
            eight
        });
        Self {
            eights: eights.collect(),
        }
    }
}

impl Part {
    /// Those of a patch, one for each component that is a graph over a plane.
    fn all(
        (number, patch): (u32, &Patch),
        components: &[u32],
        places: &[DVec2],
        sides_of_all: &[[u32; 2]],
    ) -> Vec<Self> {
        let of = |place: &u32| components[patch.vertices[*place as usize] as usize];
        let mut found: Vec<_> = patch.triangles.iter().map(|[a, ..]| of(a)).collect();
        found.sort_unstable();
        found.dedup();
        let mut of_all = patch.vertices.iter().map(|&it| components[it as usize]);
        let is_whole = of_all.all(|it| found == [it]);
        found.retain(|&component| places[component as usize].is_finite());
        let part = |component| {
            let own = patch.triangles.iter().filter(|[a, ..]| of(a) == component);
            let own = own.map(|it| it.map(|place| patch.vertices[place as usize]));
            let all = patch.vertices.iter().copied();
            let all = all.filter(|&it| components[it as usize] == component);
            Self::of(
                (number, component, is_whole),
                own,
                all,
                places,
                sides_of_all,
            )
        };
        found.into_iter().map(part).collect()
    }

    /// Of these triangles and vertices.
    fn of(
        (patch, component, is_whole): (u32, u32, bool),
        triangles: impl Iterator<Item = [u32; 3]> + Clone,
        vertices: impl Iterator<Item = u32> + Clone,
        places: &[DVec2],
        sides_of_all: &[[u32; 2]],
    ) -> Self {
        let at = |vertex: u32| places[vertex as usize];
        let triangles = || triangles.clone();
        let all = vertices.map(at);
        let height = |corners: [DVec2; 3]| {
            let [a, b, c] = corners;
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            (b - a).perp_dot(c - a) / longest
        };
        let border = triangles().flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]);
        let is_one = |side: [u32; 2]| {
            let end = sides_of_all.partition_point(|it| *it <= side);
            end - sides_of_all.partition_point(|it| *it < side) == 1
        };
        let border = border.filter(|&[a, b, _]| !is_one([a, b]) || !is_one([b, a]));
        Self {
            patch,
            component,
            is_whole,
            low: all.clone().fold(DVec2::INFINITY, DVec2::min),
            high: all.clone().fold(DVec2::NEG_INFINITY, DVec2::max),
            hull: convex_hull(all),
            triangles: triangles().map(|it| it.map(at)).collect(),
            border: border.map(|it| it.map(at)).collect(),
            height: triangles()
                .map(|it| height(it.map(at)))
                .fold(f64::INFINITY, f64::min),
        }
    }

    fn meets(&self, others: [DVec2; 2], component: u32) -> bool {
        self.component == component && overlap([self.low, self.high], others)
    }
}

fn overlap([low, high]: [DVec2; 2], [other_low, other_high]: [DVec2; 2]) -> bool {
    (low.cmple(other_high) & high.cmpge(other_low)).all()
}

fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Whether a triangle contains a point, or has it on its border.
fn contains(&[a, b, c]: &[DVec2; 3], point: DVec2) -> bool {
    let allowed = -ROUNDING * (b - a).perp_dot(c - a);
    [[a, b], [b, c], [c, a]]
        .iter()
        .all(|&[from, to]| (to - from).perp_dot(point - from) >= allowed)
}

/// The corners of the convex hull of some points, counterclockwise.
fn convex_hull(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut points: Vec<_> = points.collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let mut hull: Vec<DVec2> = Vec::new();
    // The lower side from left to right, then the upper one back.
    let back = points.iter().rev().skip(1);
    let mut least = 1;
    for (number, &point) in points.iter().chain(back).enumerate() {
        if number == points.len() {
            least = hull.len();
        }
        while let [.., a, b] = hull[..]
            && hull.len() > least
            && (b - a).perp_dot(point - b) <= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    }
    hull.pop();
    hull
}

/// Whether the inside of a triangle has points in common with that of a convex polygon of this size [m].
fn cut(triangle: &[DVec2; 3], polygon: &[DVec2], size: f64) -> bool {
    let apart = |a: DVec2, b: DVec2, others: &[DVec2]| {
        let (along, allowed) = (b - a, ROUNDING * (b - a).length() * size);
        others.iter().all(|&at| along.perp_dot(at - a) <= allowed)
    };
    let ends = |points: &[DVec2], number: usize| {
        let next = (number + 1) % points.len();
        (points[number], points[next])
    };
    let is_side = |points: &[DVec2], others: &[DVec2]| {
        (0..points.len()).any(|number| {
            let (a, b) = ends(points, number);
            apart(a, b, others)
        })
    };
    !is_side(polygon, triangle) && !is_side(triangle, polygon)
}

/// The connected component of each vertex, by its first vertex.
fn components(vertices: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let all = Components::of(vertices, iter::empty(), triangles, iter::empty());
    let mut first: Vec<u32> = (0..vertices as u32).collect();
    for part in (0..all.count()).map(|number| all.part(number)) {
        for &vertex in part {
            first[vertex as usize] = part[0];
        }
    }
    first
}

/// Places of all vertices in the plane of their component; none of one that is no graph over a plane.
fn places(rest: &[Vec3], triangles: &[[u32; 3]], components: &[u32]) -> Vec<DVec2> {
    let mut normals = vec![DVec3::ZERO; rest.len()];
    let normal = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|it| rest[it as usize].as_dvec3());
        (b - a).cross(c - a)
    };
    let component = |triangle: &[u32; 3]| components[triangle[0] as usize] as usize;
    for triangle in triangles {
        normals[component(triangle)] += normal(triangle);
    }
    let mut axes: Vec<_> = normals.iter().map(|it| it.try_normalize()).collect();
    for triangle in triangles {
        let up = &mut axes[component(triangle)];
        let own = normal(triangle);
        *up = up.filter(|up| up.dot(own) > STEEPEST * own.length());
    }
    let place = |(at, &component): (&Vec3, &u32)| {
        let (x, y) = axes[component as usize]?.any_orthonormal_pair();
        Some(DVec2::new(x.dot(at.as_dvec3()), y.dot(at.as_dvec3())))
    };
    let places = rest.iter().zip(components).map(place);
    places.map(|it| it.unwrap_or(DVec2::NAN)).collect()
}
