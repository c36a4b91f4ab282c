//! Orients the triangles of a surface outwards and counts the defects that keep it from being
//! closed.
//!
//! Triangles that share an edge are oriented consistently; then each connected component with a
//! negative volume is flipped, unless it is the wall of a cavity. A non-orientable component (a
//! Möbius strip) stays unchanged. Each change adds a note.

use std::collections::VecDeque;

use glam::DVec3;

use super::{clean::counted, enclosure::winding_number};

/// Edge defects of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Borders {
    /// Boundary edges (of one triangle): rims of holes.
    pub open: usize,
    /// Edges of three or more triangles.
    pub branching: usize,
}

/// One side of a triangle: its ends in ascending order, whether the triangle traverses it in
/// reverse, and the triangle.
type Side = ([u32; 2], bool, usize);

fn sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let mut sides: Vec<Side> = triangles
        .iter()
        .enumerate()
        .flat_map(|(triangle, &[a, b, c])| {
            [[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], a > b, triangle))
        })
        .collect();
    sides.sort_unstable();
    sides
}

/// Counts boundary and branching edges.
pub(super) fn borders(triangles: &[[u32; 3]]) -> Borders {
    let mut borders = Borders {
        open: 0,
        branching: 0,
    };
    for same in sides(triangles).chunk_by(|a, b| a.0 == b.0) {
        match same.len() {
            1 => borders.open += 1,
            2 => {}
            _ => borders.branching += 1,
        }
    }
    borders
}

/// Orients triangles outwards, as far as that is defined.
pub(super) fn face_outwards(
    vertices: &[DVec3],
    triangles: &mut [[u32; 3]],
    notes: &mut Vec<String>,
) {
    let (piece, pieces, mut turned) = agree(triangles);
    let mut of_piece: Vec<Piece> = (0..pieces).map(|_| Piece::default()).collect();
    for (triangle, piece) in triangles.iter().zip(&piece) {
        of_piece[*piece].add(triangle.map(|i| vertices[i as usize]));
    }
    let inward: Vec<bool> = (0..pieces)
        .map(|number| of_piece[number].faces_inwards() && !is_cavity(&of_piece, number))
        .collect();
    for (index, triangle) in triangles.iter_mut().enumerate() {
        if inward[piece[index]] {
            triangle.swap(1, 2);
            turned[index] = !turned[index];
        }
    }
    let turned = turned.iter().filter(|turned| **turned).count();
    if turned > 0 {
        let turned = counted(turned, "inward-facing triangle", "inward-facing triangles");
        notes.push(format!("{turned} flipped"));
    }
}

/// Flips triangles for consistency with the first one of their component. Returns the component of
/// each triangle, the number of components, and which triangles were flipped.
fn agree(triangles: &mut [[u32; 3]]) -> (Vec<usize>, usize, Vec<bool>) {
    let sides = sides(triangles);
    let mut neighbors: Vec<Vec<(usize, bool)>> = vec![Vec::new(); triangles.len()];
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, forth, a), (_, back, b)] = *same {
            neighbors[a].push((b, forth == back));
            neighbors[b].push((a, forth == back));
        }
    }
    let mut piece = vec![usize::MAX; triangles.len()];
    let mut turned = vec![false; triangles.len()];
    let mut pieces = 0;
    let mut queue = VecDeque::new();
    for seed in 0..triangles.len() {
        if piece[seed] != usize::MAX {
            continue;
        }
        piece[seed] = pieces;
        queue.push_back(seed);
        while let Some(triangle) = queue.pop_front() {
            for &(neighbor, opposed) in &neighbors[triangle] {
                if piece[neighbor] == usize::MAX {
                    piece[neighbor] = pieces;
                    turned[neighbor] = turned[triangle] != opposed;
                    queue.push_back(neighbor);
                }
            }
        }
        pieces += 1;
    }
    for (triangle, turned) in triangles.iter_mut().zip(&turned) {
        if *turned {
            triangle.swap(1, 2);
        }
    }
    (piece, pieces, turned)
}

/// A component of consistently oriented triangles.
struct Piece {
    triangles: Vec<[DVec3; 3]>,
    low: DVec3,
    high: DVec3,
}

impl Default for Piece {
    fn default() -> Self {
        Self {
            triangles: Vec::new(),
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
        }
    }
}

impl Piece {
    fn add(&mut self, triangle: [DVec3; 3]) {
        for corner in triangle {
            self.low = self.low.min(corner);
            self.high = self.high.max(corner);
        }
        self.triangles.push(triangle);
    }

    /// Whether the cones from the centroid to the triangles have a clearly negative volume,
    /// relative to a ball of the same area: a nearly flat component has no outside.
    fn faces_inwards(&self) -> bool {
        let (mut area, mut moment) = (0.0, DVec3::ZERO);
        for [a, b, c] in &self.triangles {
            let own = (b - a).cross(c - a).length() * 0.5;
            area += own;
            moment += (a + b + c) * (own / 3.0);
        }
        let center = moment / area;
        let cones = self.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|corner| corner - center);
            a.dot(b.cross(c)) / 6.0
        });
        cones.sum::<f64>() < -1e-3 * area * area.sqrt()
    }
}

/// Whether a component lies inside of the others, so that its triangles rightly face inwards.
fn is_cavity(pieces: &[Piece], number: usize) -> bool {
    let Some(&[point, ..]) = pieces[number].triangles.first() else {
        return false;
    };
    let around = |other: &Piece| point.cmpge(other.low).all() && point.cmple(other.high).all();
    let winding: f64 = pieces
        .iter()
        .enumerate()
        .filter(|(other, piece)| *other != number && around(piece))
        .map(|(_, piece)| winding_number(piece.triangles.iter().copied(), point).abs())
        .sum();
    winding > 0.5
}
