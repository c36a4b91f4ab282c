//! Repairs that do not change the shape: coincident vertices, degenerate elements, repeated
//! elements, unused vertices, inverted tetrahedra.
//!
//! Works on meshes of unit size, so tolerances are relative. Each repair adds a note.

use std::collections::BTreeMap;

use glam::DVec3;

use super::elements::{sorted, tetrahedron_volume};

/// Vertices closer than this, relative to the size of the mesh, are merged. It is above the
/// rounding of a file written with six digits and far below any detail of a mesh of a million
/// triangles (1e-3).
const WELD: f64 = 1e-6;
/// A tetrahedron is flat below this volume, relative to the cube of its longest edge; a regular one
/// has 0.118. Below it, heights are within the rounding of f32 positions.
const FLAT: f64 = 1e-6;

/// A count with its noun in the singular or plural.
pub(super) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// Merges coincident vertices and updates the elements. Returns the vertex that each became.
pub(super) fn weld<const N: usize>(
    vertices: &[DVec3],
    elements: &mut [[u32; N]],
    notes: &mut Vec<String>,
) -> Vec<u32> {
    let cell = |p: DVec3| (p / (2.0 * WELD)).floor().as_i64vec3().to_array();
    let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    let mut stands_for: Vec<u32> = Vec::with_capacity(vertices.len());
    let mut welded = 0;
    for (index, &p) in vertices.iter().enumerate() {
        // The tolerance reaches into at most two cells along each axis.
        let (low, high) = (cell(p - WELD), cell(p + WELD));
        let mut found = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let there = cells.get(&[x, y, z]).into_iter().flatten();
                    let near = |other: &&u32| vertices[**other as usize].distance(p) <= WELD;
                    let candidate = there.copied().filter(|other| near(&other)).min();
                    found = match (found, candidate) {
                        (Some(a), Some(b)) => Some(u32::min(a, b)),
                        (a, b) => a.or(b),
                    };
                }
            }
        }
        if found.is_none() {
            cells.entry(cell(p)).or_default().push(index as u32);
        } else {
            welded += 1;
        }
        stands_for.push(found.unwrap_or(index as u32));
    }
    for corner in elements.iter_mut().flatten() {
        *corner = stands_for[*corner as usize];
    }
    if welded > 0 {
        notes.push(format!(
            "{} welded",
            counted(welded, "duplicate vertex", "duplicate vertices")
        ));
    }
    stands_for
}

/// Removes vertices that no element uses and renumbers the rest. Returns the new number of each.
pub(super) fn keep_used<const N: usize>(
    vertices: &mut Vec<DVec3>,
    elements: &mut [[u32; N]],
) -> Vec<Option<u32>> {
    let mut used = vec![false; vertices.len()];
    for corner in elements.iter().flatten() {
        used[*corner as usize] = true;
    }
    let mut next = 0;
    let renumbered: Vec<Option<u32>> = used
        .iter()
        .map(|used| {
            let own = next;
            next += u32::from(*used);
            used.then_some(own)
        })
        .collect();
    for corner in elements.iter_mut().flatten() {
        // It is used here.
        *corner = renumbered[*corner as usize].unwrap_or_default();
    }
    let mut used = used.into_iter();
    vertices.retain(|_| used.next() == Some(true));
    renumbered
}

/// Removes segments without length and repeated ones.
pub(super) fn clean_segments(segments: &mut Vec<[u32; 2]>, notes: &mut Vec<String>) {
    let before = segments.len();
    segments.retain(|[a, b]| a != b);
    if segments.len() < before {
        let empty = counted(before - segments.len(), "segment", "segments");
        notes.push(format!("{empty} without length removed"));
    }
    drop_repeated(segments, ("repeated segment", "repeated segments"), notes);
}

/// Removes repeated elements, regardless of the order of their corners.
fn drop_repeated<const N: usize>(
    elements: &mut Vec<[u32; N]>,
    (one, several): (&str, &str),
    notes: &mut Vec<String>,
) {
    let mut by_corners: Vec<([u32; N], usize)> =
        elements.iter().map(|e| sorted(*e)).zip(0..).collect();
    by_corners.sort_unstable();
    let mut first = vec![true; elements.len()];
    for pair in by_corners.windows(2) {
        if pair[0].0 == pair[1].0 {
            first[pair[1].1] = false;
        }
    }
    let before = elements.len();
    let mut first = first.into_iter();
    elements.retain(|_| first.next() == Some(true));
    if elements.len() < before {
        let repeated = counted(before - elements.len(), one, several);
        notes.push(format!("{repeated} removed"));
    }
}

/// Removes triangles without area and repeated triangles.
pub(super) fn clean_triangles(
    vertices: &[DVec3],
    triangles: &mut Vec<[u32; 3]>,
    notes: &mut Vec<String>,
) {
    let before = triangles.len();
    triangles.retain(|t| {
        let [a, b, c] = t.map(|i| vertices[i as usize]);
        let longest = (b - a)
            .length_squared()
            .max((c - b).length_squared())
            .max((a - c).length_squared());
        let distinct = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        distinct && (b - a).cross(c - a).length() > f64::EPSILON * longest
    });
    if triangles.len() < before {
        let flat = counted(
            before - triangles.len(),
            "zero-area triangle",
            "zero-area triangles",
        );
        notes.push(format!("{flat} removed"));
    }
    drop_repeated(
        triangles,
        ("duplicate triangle", "duplicate triangles"),
        notes,
    );
}

/// Removes flat and repeated tetrahedra, and reorients inverted ones.
pub(super) fn clean_tetrahedra(
    vertices: &[DVec3],
    tetrahedra: &mut Vec<[u32; 4]>,
    notes: &mut Vec<String>,
) {
    let before = tetrahedra.len();
    tetrahedra.retain(|t| {
        let corners = t.map(|i| vertices[i as usize]);
        let longest = (0..4)
            .flat_map(|k| (0..k).map(move |l| (k, l)))
            .map(|(k, l)| corners[k].distance(corners[l]))
            .fold(0.0, f64::max);
        tetrahedron_volume(corners).abs() > FLAT * longest * longest * longest
    });
    if tetrahedra.len() < before {
        let flat = counted(
            before - tetrahedra.len(),
            "flat tetrahedron",
            "flat tetrahedra",
        );
        notes.push(format!("{flat} removed"));
    }
    drop_repeated(
        tetrahedra,
        ("duplicate tetrahedron", "duplicate tetrahedra"),
        notes,
    );
    let mut turned = 0;
    for t in tetrahedra.iter_mut() {
        if tetrahedron_volume(t.map(|i| vertices[i as usize])) < 0.0 {
            t.swap(2, 3);
            turned += 1;
        }
    }
    if turned > 0 {
        let turned = counted(turned, "inverted tetrahedron", "inverted tetrahedra");
        notes.push(format!("{turned} reoriented"));
    }
}
