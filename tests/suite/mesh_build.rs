//! From a parsed mesh to a body: placed, scaled, repaired, or rejected.

use glam::{DVec3, Vec3};
use pliant::mesh::{
    BuildOptions, FileMesh, MAX_CELLS, MeshError, SurfaceMesh, TetMesh, Treatment, build,
};

use super::mesh_support::{assert_sound_solid, cube, filled, has_note, placed, volume, with_cells};

fn shell() -> BuildOptions {
    BuildOptions {
        treatment: Treatment::Shell,
        ..BuildOptions::default()
    }
}

fn corner() -> TetMesh {
    TetMesh {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        tetrahedra: vec![[0, 1, 2, 3]],
        notes: Vec::new(),
    }
}

#[test]
fn tiny_huge_and_far_surfaces_are_filled_alike() {
    let unit = filled(cube(), 5);
    for (scale, center) in [
        (1e-6, DVec3::ZERO),
        (1e6, DVec3::ZERO),
        (1.0, DVec3::new(1e4, -2e4, 3e4)),
        (1e-3, DVec3::splat(10.0)),
    ] {
        let body = filled(placed(cube(), scale, center), 5);
        assert_eq!(body.shape.tetrahedra, unit.shape.tetrahedra);
        for (p, q) in body.shape.vertices.iter().zip(&unit.shape.vertices) {
            // Far from the origin, f64 has an error of 1e-12 of a size; f32 rounds to 6e-8 of it.
            let difference = (p.as_dvec3() / scale).distance(q.as_dvec3());
            assert!(difference < 1e-6, "{scale} {center}: {difference}");
        }
    }
}

#[test]
fn the_longest_side_gets_the_requested_size() {
    let options = BuildOptions {
        size: Some(0.3),
        cells: Some(10),
        ..BuildOptions::default()
    };
    let long = SurfaceMesh {
        vertices: cube()
            .vertices
            .iter()
            .map(|p| *p * DVec3::new(2.0, 5.0, 1.0))
            .collect(),
        ..cube()
    };
    let body = build(FileMesh::Surface(long), &options).expect("a box");
    let high = body
        .shape
        .vertices
        .iter()
        .copied()
        .fold(Vec3::MIN, Vec3::max);
    // Its sides are 10, 4 and 2 cells, so that they coincide with the lattice; f32 rounds once.
    assert!(high.distance(Vec3::new(0.06, 0.15, 0.03)) < 1e-7, "{high}");
    assert!((volume(&body.shape) / (0.3 * 0.12 * 0.06) - 1.0).abs() < 1e-5);
}

#[test]
fn a_shell_is_the_surface_itself() {
    let body = build(FileMesh::Surface(cube()), &shell()).expect("a shell");
    assert_eq!(body.shape.vertices.len(), 8);
    assert_eq!(body.shape.triangles, cube().triangles);
    // Twelve sides and six diagonals.
    assert_eq!(body.shape.edges.len(), 18);
    assert!(body.shape.tetrahedra.is_empty() && body.skin.is_none());
    let body = build(FileMesh::Tetrahedra(corner()), &shell()).expect("a shell");
    assert_eq!((body.shape.triangles.len(), body.shape.edges.len()), (4, 6));
}

#[test]
fn a_soup_of_triangles_is_welded() {
    let soup = SurfaceMesh {
        vertices: cube()
            .triangles
            .iter()
            .flatten()
            .map(|i| cube().vertices[*i as usize] + DVec3::splat(f64::from(*i) * 1e-8))
            .collect(),
        triangles: (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        notes: Vec::new(),
    };
    let body = build(FileMesh::Surface(soup), &shell()).expect("a shell");
    assert_eq!(body.shape.vertices.len(), 8);
    assert!(
        has_note(&body, "28 duplicate vertices welded"),
        "{:?}",
        body.notes
    );
}

#[test]
fn elements_left_out_of_a_surface_are_counted() {
    let mut messy = cube();
    messy
        .vertices
        .extend([DVec3::splat(f64::NAN), DVec3::splat(0.1)]);
    let in_a_line = messy.vertices.len() as u32;
    messy
        .vertices
        .push((messy.vertices[0] + messy.vertices[1]) / 2.0);
    messy
        .triangles
        .extend([[0, 1, 1], [0, in_a_line, 1], [2, 0, 3]]);
    let body = build(FileMesh::Surface(messy), &shell()).expect("a shell");
    assert!(
        has_note(&body, "2 unused vertices removed"),
        "{:?}",
        body.notes
    );
    assert!(
        has_note(&body, "2 zero-area triangles removed"),
        "{:?}",
        body.notes
    );
    assert!(
        has_note(&body, "1 duplicate triangle removed"),
        "{:?}",
        body.notes
    );
    assert_eq!(body.shape.triangles.len(), 12);
    assert_eq!(body.shape.vertices.len(), 8);
}

#[test]
fn tetrahedra_are_turned_and_flat_ones_left_out_with_notes() {
    let mut mesh = corner();
    mesh.vertices
        .extend([DVec3::NEG_Z, DVec3::splat(9.0), DVec3::new(0.5, 0.5, 0.0)]);
    // The second is inverted, the third flat, the fourth a duplicate of the first; vertex 5 is
    // unused.
    mesh.tetrahedra
        .extend([[0, 1, 2, 4], [0, 1, 2, 6], [3, 2, 1, 0]]);
    let body = build(FileMesh::Tetrahedra(mesh), &BuildOptions::default()).expect("two tetrahedra");
    assert_sound_solid(&body.shape);
    assert_eq!(body.shape.tetrahedra.len(), 2);
    assert_eq!(body.shape.vertices.len(), 5);
    for note in [
        "1 flat tetrahedron removed",
        "1 duplicate tetrahedron removed",
        "1 inverted tetrahedron reoriented",
        "1 unused vertex removed",
    ] {
        assert!(has_note(&body, note), "{note}: {:?}", body.notes);
    }
    assert!((volume(&body.shape) - 1.0 / 3.0).abs() < 1e-6);
}

#[test]
fn options_out_of_range_are_refused_with_the_range() {
    for cells in [0, 1, MAX_CELLS + 1] {
        let error = build(FileMesh::Surface(cube()), &with_cells(cells)).expect_err("no count");
        assert!(
            error.to_string().starts_with(&format!("cells = {cells} ")),
            "{error}"
        );
    }
    for size in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-9, 1e9] {
        let options = BuildOptions {
            size: Some(size),
            ..BuildOptions::default()
        };
        let error = build(FileMesh::Surface(cube()), &options).expect_err("no size");
        assert!(
            matches!(error, MeshError::Parameter { name: "size", .. }),
            "{error}"
        );
    }
    // A file in its own unit, with numbers that cannot be meters.
    let error = build(
        FileMesh::Surface(placed(cube(), 1e12, DVec3::ZERO)),
        &with_cells(4),
    );
    assert!(
        error
            .expect_err("too large")
            .to_string()
            .contains("set the size")
    );
}

#[test]
fn empty_flat_and_invalid_meshes_are_refused() {
    let refused = |surface: SurfaceMesh, part: &str| {
        for options in [BuildOptions::default(), shell()] {
            let error = build(FileMesh::Surface(surface.clone()), &options).expect_err(part);
            assert!(error.to_string().contains(part), "{error}");
        }
    };
    refused(SurfaceMesh::default(), "no triangle");
    refused(placed(cube(), 0.0, DVec3::ONE), "no extent");
    let mut nan = cube();
    nan.vertices[3].y = f64::NAN;
    refused(nan, "vertex 3 is at");
    let mut wrong = cube();
    wrong.triangles[5][1] = 8;
    refused(wrong, "triangle 5 refers to vertex 8");
    let mut line = cube();
    line.vertices.iter_mut().for_each(|p| *p *= DVec3::X);
    refused(line, "all triangles of the mesh have zero area");
    let mut flat = corner();
    flat.vertices[3] = DVec3::new(1.0, 1.0, 0.0);
    let error = build(FileMesh::Tetrahedra(flat), &BuildOptions::default()).expect_err("flat");
    assert!(
        error
            .to_string()
            .contains("all tetrahedra of the mesh have zero volume"),
        "{error}"
    );
}

#[test]
fn options_have_defaults_in_ron() {
    let options: BuildOptions = ron::from_str("(cells: Some(9))").expect("options");
    assert_eq!(options, with_cells(9));
    assert!(ron::from_str::<BuildOptions>("(sells: Some(9))").is_err());
}
