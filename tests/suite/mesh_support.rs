//! Shared by the tests of meshes: small surfaces, and properties of any body's shape.

use glam::{DVec3, Vec3};
use pliant::{
    mesh::{
        BuildOptions, FileMesh, SoftMesh, SurfaceMesh, boundary_triangles, build, edges,
        surface_volume, tetrahedra_volume,
    },
    solver::RestShape,
};

/// A cube of side 1 around the origin, of twelve triangles that face outwards.
pub fn cube() -> SurfaceMesh {
    let vertices = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5)
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    SurfaceMesh {
        vertices,
        triangles: quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        notes: Vec::new(),
    }
}

/// The surface, moved and scaled.
pub fn placed(mut surface: SurfaceMesh, scale: f64, center: DVec3) -> SurfaceMesh {
    for p in &mut surface.vertices {
        *p = *p * scale + center;
    }
    surface
}

/// Two surfaces as one mesh.
pub fn both(mut a: SurfaceMesh, b: SurfaceMesh) -> SurfaceMesh {
    let base = a.vertices.len() as u32;
    a.vertices.extend(b.vertices);
    a.triangles
        .extend(b.triangles.iter().map(|t| t.map(|i| i + base)));
    a
}

/// The surface with inverted orientation.
pub fn inward(mut surface: SurfaceMesh) -> SurfaceMesh {
    surface.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    surface
}

/// A surface filled with this number of cells.
pub fn filled(surface: SurfaceMesh, cells: u32) -> SoftMesh {
    build(FileMesh::Surface(surface), &with_cells(cells)).expect("a surface that can be filled")
}

pub fn with_cells(cells: u32) -> BuildOptions {
    BuildOptions {
        cells: Some(cells),
        ..BuildOptions::default()
    }
}

pub fn positions(shape: &RestShape) -> Vec<DVec3> {
    shape.vertices.iter().map(|p| p.as_dvec3()).collect()
}

pub fn volume(shape: &RestShape) -> f64 {
    tetrahedra_volume(&positions(shape), &shape.tetrahedra)
}

pub fn has_note(mesh: &SoftMesh, part: &str) -> bool {
    mesh.notes.iter().any(|note| note.contains(part))
}

/// Invariants of every solid mesh: finite, in range, no inverted elements, edges and boundary
/// derived from the tetrahedra, no unused vertices, a closed boundary.
pub fn assert_sound_solid(shape: &RestShape) {
    assert!(shape.vertices.iter().all(|p| p.is_finite()));
    assert!(!shape.tetrahedra.is_empty());
    let vertices = positions(shape);
    let mut used = vec![false; vertices.len()];
    for t in &shape.tetrahedra {
        t.iter().for_each(|i| used[*i as usize] = true);
        assert!(
            tetrahedra_volume(&vertices, &[*t]) > 0.0,
            "{t:?} is inside out"
        );
    }
    assert!(used.iter().all(|used| *used), "a vertex is unused");
    assert_eq!(shape.edges, edges(&shape.tetrahedra, &[]));
    assert_eq!(shape.triangles, boundary_triangles(&shape.tetrahedra));
    let inside = volume(shape);
    let around = surface_volume(&vertices, &shape.triangles);
    // Both are sums in f64 of the same terms.
    assert!(
        (inside - around).abs() <= 1e-9 * inside,
        "{inside} {around}"
    );
}

/// The smallest angle between two faces of a tetrahedron [°].
pub fn smallest_dihedral(shape: &RestShape) -> f64 {
    let vertices = positions(shape);
    let mut smallest = f64::INFINITY;
    for t in &shape.tetrahedra {
        let corners = t.map(|i| vertices[i as usize]);
        for [i, j, k, l] in [
            [0, 1, 2, 3],
            [0, 2, 1, 3],
            [0, 3, 1, 2],
            [1, 2, 0, 3],
            [1, 3, 0, 2],
            [2, 3, 0, 1],
        ] {
            let along = (corners[j] - corners[i]).normalize();
            let across = |m: usize| (corners[m] - corners[i]).reject_from(along);
            smallest = smallest.min(across(k).angle_between(across(l)));
        }
    }
    smallest.to_degrees()
}

/// The skin of a body at rest.
pub fn skin_at_rest(mesh: &SoftMesh) -> Vec<Vec3> {
    let skin = mesh.skin.as_ref().expect("a filled surface has a skin");
    let mut out = Vec::new();
    skin.deform_with(|i| mesh.shape.vertices[i.index()], &mut out);
    out
}
