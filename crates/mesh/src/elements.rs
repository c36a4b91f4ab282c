//! Quantities that follow from indices (edges, boundary, connected components) and enclosed
//! volumes.
//!
//! All results are sorted or in order of first appearance, never in hash order.

use glam::DVec3;

/// Unique edges of tetrahedra and triangles, smaller index first, sorted.
pub fn edges(tetrahedra: &[[u32; 4]], triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    const OF_TETRAHEDRON: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    const OF_TRIANGLE: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
    let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
    let of_tetrahedra = tetrahedra
        .iter()
        .flat_map(|t| OF_TETRAHEDRON.map(|[a, b]| ordered(t[a], t[b])));
    let of_triangles = triangles
        .iter()
        .flat_map(|t| OF_TRIANGLE.map(|[a, b]| ordered(t[a], t[b])));
    let mut edges: Vec<_> = of_tetrahedra.chain(of_triangles).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Faces that belong to exactly one tetrahedron, counter-clockwise from outside if the tetrahedra
/// have positive volume. Sorted by their smallest indices.
pub fn boundary_triangles(tetrahedra: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces: Vec<([u32; 3], [u32; 3])> = tetrahedra
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, c, b], [a, b, d], [a, d, c], [b, c, d]])
        .map(|face| (sorted(face), face))
        .collect();
    faces.sort_unstable();
    faces
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|same| match same {
            [(_, face)] => Some(*face),
            _ => None,
        })
        .collect()
}

/// Corners of an element in ascending order: equal for all permutations of the element.
pub(super) fn sorted<const N: usize>(mut corners: [u32; N]) -> [u32; N] {
    corners.sort_unstable();
    corners
}

/// Disjoint-set forest.
pub(super) struct Pieces {
    parent: Vec<u32>,
}

impl Pieces {
    /// Every item starts as a set of its own.
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    /// Representative of the set that contains an item.
    pub fn first_of(&mut self, mut thing: u32) -> u32 {
        while self.parent[thing as usize] != thing {
            let above = self.parent[self.parent[thing as usize] as usize];
            self.parent[thing as usize] = above;
            thing = above;
        }
        thing
    }

    /// Merges two sets; returns whether they were distinct.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.first_of(a), self.first_of(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a != b
    }
}

/// Component number of each element. Elements that share a vertex belong to one component;
/// components are numbered from 0 in order of first appearance.
pub fn component_of_each<const N: usize>(vertices: usize, elements: &[[u32; N]]) -> Vec<u32> {
    let mut pieces = Pieces::new(vertices);
    for element in elements {
        for &corner in &element[1..] {
            pieces.join(element[0], corner);
        }
    }
    let mut number = vec![u32::MAX; vertices];
    let mut next = 0;
    elements
        .iter()
        .map(|element| {
            let slot = &mut number[pieces.first_of(element[0]) as usize];
            if *slot == u32::MAX {
                *slot = next;
                next += 1;
            }
            *slot
        })
        .collect()
}

/// Elements of the largest component by element count (the first one on a tie), in their order.
pub fn largest_component<const N: usize>(vertices: usize, elements: &[[u32; N]]) -> Vec<[u32; N]> {
    let component = component_of_each(vertices, elements);
    let mut sizes = vec![0_usize; component.iter().max().map_or(0, |last| *last as usize + 1)];
    for &piece in &component {
        sizes[piece as usize] += 1;
    }
    let most = sizes.iter().max().copied().unwrap_or(0);
    let largest = sizes.iter().position(|size| *size == most);
    let belongs = |piece: u32| Some(piece as usize) == largest;
    elements
        .iter()
        .zip(&component)
        .filter_map(|(element, &piece)| belongs(piece).then_some(*element))
        .collect()
}

/// Signed volume of a tetrahedron, (b−a)×(c−a)·(d−a) / 6, in the cube of the positions' unit.
pub(super) fn tetrahedron_volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Sum of the signed volumes of tetrahedra, in the cube of the positions' unit.
///
/// # Panics
/// If an index is out of range.
pub fn tetrahedra_volume(vertices: &[DVec3], tetrahedra: &[[u32; 4]]) -> f64 {
    tetrahedra
        .iter()
        .map(|t| tetrahedron_volume(t.map(|i| vertices[i as usize])))
        .sum()
}

/// Volume enclosed by a closed surface, in the cube of the positions' unit; negative if its
/// triangles face inwards. Volume enclosed twice counts twice. For an open surface the result is
/// the volume of the cone from its first vertex, which is of little use.
///
/// # Panics
/// If an index is out of range.
pub fn surface_volume(vertices: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    // Relative to a vertex of the surface, so that distance from the origin costs no precision.
    let Some(apex) = triangles.first().map(|t| vertices[t[0] as usize]) else {
        return 0.0;
    };
    triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| vertices[i as usize] - apex);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}
