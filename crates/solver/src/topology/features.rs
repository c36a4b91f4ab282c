//! Where a rigid surface can touch others first, and around what its points lie.
//!
//! Two polyhedra touch at a corner of one and a face of the other, or at two sharp edges. Edges within a
//! flat face, and vertices within a face or along a straight edge, touch nothing before others do.

use glam::{DVec3, Vec3};

/// Sine of an angle between two faces, or between two edges, below which they are flat or straight: for edges of
/// 1 m, a corner is off by less than 0.1 mm, less than the smallest gap that contacts keep.
const FLAT: f64 = 1e-4;

/// Sharp features of a surface, and the neighbors of its vertices.
#[derive(Debug, Clone, Default)]
pub(crate) struct Features {
    /// Of each surface vertex: whether it is a corner.
    pub is_corner: Vec<bool>,
    /// The sharp edges, in ascending order.
    sharp: Vec<[u32; 2]>,
    /// Index of the first of the triangles around each vertex, and the number of all.
    first: Vec<u32>,
    /// The other two vertices of each.
    around: Vec<[u32; 2]>,
}

impl Features {
    /// Of a surface with these vertices [m], edges in ascending order, and triangles.
    pub fn of(rest: &[Vec3], edges: &[[u32; 2]], triangles: &[[u32; 3]]) -> Self {
        let count = rest.len();
        let mut first = vec![0; count + 1];
        for &vertex in triangles.iter().flatten() {
            first[vertex as usize + 1] += 1;
        }
        for vertex in 0..count {
            first[vertex + 1] += first[vertex];
        }
        let mut next = first.clone();
        let mut around = vec![[0; 2]; 3 * triangles.len()];
        for &[a, b, c] in triangles {
            for (vertex, others) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                let place = &mut next[vertex as usize];
                around[*place as usize] = others;
                *place += 1;
            }
        }
        let mut features = Self {
            is_corner: Vec::new(),
            sharp: Vec::new(),
            first,
            around,
        };
        let at = |vertex: u32| rest[vertex as usize].as_dvec3();
        let sharp = edges.iter().copied();
        features.sharp = sharp
            .filter(|&edge| features.is_sharp_edge(edge, at))
            .collect();
        let mut directions = vec![Vec::new(); count];
        for &[a, b] in &features.sharp {
            directions[a as usize].push((at(b) - at(a)).normalize_or_zero());
            directions[b as usize].push((at(a) - at(b)).normalize_or_zero());
        }
        let is_straight = |[a, b]: [DVec3; 2]| a.dot(b) < 0.0 && a.cross(b).length() < FLAT;
        let is_corner = directions.iter().map(|edges| match edges[..] {
            [] => triangles.is_empty(),
            [a, b] => !is_straight([a, b]),
            _ => true,
        });
        features.is_corner = is_corner.collect();
        features
    }

    /// Whether an edge is sharp.
    pub fn is_sharp(&self, [a, b]: [u32; 2]) -> bool {
        self.sharp.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.is_corner[..])
            + size_of_val(&self.sharp[..])
            + size_of_val(&self.first[..])
            + size_of_val(&self.around[..])
    }

    /// The other vertices of the triangles around a vertex.
    fn around(&self, vertex: u32) -> &[[u32; 2]] {
        let [first, end] = [0, 1].map(|next| self.first[vertex as usize + next] as usize);
        &self.around[first..end]
    }

    /// The third vertices of the triangles at an edge.
    fn opposite(&self, [a, b]: [u32; 2]) -> impl Iterator<Item = u32> + Clone {
        let all = self.around(a).iter();
        all.filter_map(move |&[c, d]| match () {
            () if c == b => Some(d),
            () if d == b => Some(c),
            () => None,
        })
    }

    /// Whether its triangles are not two in a plane.
    fn is_sharp_edge(&self, [a, b]: [u32; 2], at: impl Fn(u32) -> DVec3) -> bool {
        let mut opposite = self.opposite([a, b]);
        let (Some(c), Some(d), None) = (opposite.next(), opposite.next(), opposite.next()) else {
            return true;
        };
        let edge = at(b) - at(a);
        let [n, m] = [c, d].map(|it| edge.cross(at(it) - at(a)).normalize_or_zero());
        // On either side of the edge, the normals point in opposite directions; a triangle without area has none.
        n.dot(m) >= 0.0 || n.cross(m).length() >= FLAT
    }

    /// Whether all vertices around a point are above it. `corners` are those of an element, with their weights at
    /// the point.
    pub fn is_lowest(
        &self,
        corners: impl Iterator<Item = (u32, f64)>,
        is_above: impl Fn(u32) -> bool,
    ) -> bool {
        let mut of = corners.filter(|&(_, weight)| weight != 0.0).map(|(v, _)| v);
        match [of.next(), of.next(), of.next()] {
            [Some(vertex), None, _] => self.around(vertex).iter().flatten().all(|&it| is_above(it)),
            [Some(a), Some(b), None] => self.opposite([a, b]).all(is_above),
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Surface, *};

    /// A cube whose upper face has a vertex in its middle, and one in the middle of a side.
    fn cube() -> Surface {
        let corners =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32));
        let more = [Vec3::new(0.5, 0.5, 1.0), Vec3::new(0.5, 0.0, 1.0)];
        let points: Vec<_> = corners.chain(more).collect();
        let triangles = [
            [0, 2, 1],
            [1, 2, 3],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
            [2, 6, 3],
            [3, 6, 7],
            [0, 1, 9],
            [1, 5, 9],
            [0, 9, 4],
            [8, 4, 9],
            [8, 9, 5],
            [8, 5, 7],
            [8, 7, 6],
            [8, 6, 4],
        ];
        Surface::of_triangles(&points, &triangles)
    }

    #[test]
    fn what_is_flat_or_straight_touches_nothing_first() {
        let surface = cube();
        let features = surface.features();
        for (vertex, is_corner) in features.is_corner.iter().enumerate() {
            assert_eq!(*is_corner, vertex < 8, "vertex {vertex}");
        }
        assert_eq!(
            features.sharp.len(),
            13,
            "twelve edges, one of them in two parts"
        );
    }

    #[test]
    fn a_point_is_lowest_where_all_around_it_are_above() {
        let surface = cube();
        let features = surface.features();
        let along = |direction: DVec3, corners: &[(u32, f64)]| {
            let at = |vertex: u32| surface.rest[vertex as usize].as_dvec3();
            let point: DVec3 = corners.iter().map(|&(v, weight)| at(v) * weight).sum();
            let is_above = |vertex: u32| (at(vertex) - point).dot(direction) >= 0.0;
            features.is_lowest(corners.iter().copied(), is_above)
        };
        // All of the cube is below its upper face, and inwards of two faces that meet.
        let (down, inwards) = (DVec3::NEG_Z, DVec3::Y);
        for corners in [
            &[(8, 1.0)][..],
            &[(9, 1.0)],
            &[(4, 0.5), (9, 0.5)],
            &[(8, 0.2), (9, 0.2), (5, 0.6)],
        ] {
            assert!(along(down, corners), "{corners:?}");
        }
        assert!(along(inwards, &[(9, 1.0)]) && along(down + inwards, &[(9, 1.0)]));
        assert!(
            !along(inwards, &[(8, 1.0)]),
            "the upper face goes on outwards"
        );
        assert!(!along(down - inwards, &[(9, 1.0)]), "as does the side");
    }
}
