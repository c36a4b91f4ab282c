//! Makes the triangles of a surface face outwards, and counts what keeps it from being closed.
//!
//! Triangles that share an edge are made to agree; then each connected piece that encloses a
//! negative volume is turned, unless it is the wall of a cavity. A piece that cannot agree with
//! itself (a Möbius strip) stays as it is. Each thing done is a note.

use std::collections::VecDeque;

use glam::DVec3;

use super::{clean::counted, enclosure::winding_number};

/// How the triangles of a surface meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Borders {
    /// Edges of one triangle only: the rims of holes.
    pub open: usize,
    /// Edges of three triangles or more.
    pub branching: usize,
}

/// One side of a triangle: its ends in ascending order, whether the triangle runs along it
/// backwards, and the triangle.
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

/// Counts the edges where a surface is not closed or branches.
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

/// Turns triangles so that they face outwards, as far as that is defined.
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

/// Turns triangles so that neighbours agree with the first of their piece. Returns the piece of each
/// triangle, the number of pieces, and which triangles were turned.
fn agree(triangles: &mut [[u32; 3]]) -> (Vec<usize>, usize, Vec<bool>) {
    let sides = sides(triangles);
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); triangles.len()];
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, forth, a), (_, back, b)] = *same {
            neighbours[a].push((b, forth == back));
            neighbours[b].push((a, forth == back));
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
            for &(neighbour, opposed) in &neighbours[triangle] {
                if piece[neighbour] == usize::MAX {
                    piece[neighbour] = pieces;
                    turned[neighbour] = turned[triangle] != opposed;
                    queue.push_back(neighbour);
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

/// Triangles that agree on which side is out.
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

    /// Whether the cones from the piece's centroid to its triangles have a negative volume, one that
    /// is not nearly zero beside that of a ball of the same area: a nearly flat piece faces nowhere.
    fn faces_inwards(&self) -> bool {
        let (mut area, mut moment) = (0.0, DVec3::ZERO);
        for [a, b, c] in &self.triangles {
            let own = (b - a).cross(c - a).length() * 0.5;
            area += own;
            moment += (a + b + c) * (own / 3.0);
        }
        let centre = moment / area;
        let cones = self.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|corner| corner - centre);
            a.dot(b.cross(c)) / 6.0
        });
        cones.sum::<f64>() < -1e-3 * area * area.sqrt()
    }
}

/// Whether a piece lies inside of the others, so that its triangles face inwards rightly.
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
