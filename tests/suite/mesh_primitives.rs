//! Primitives: their properties, and rejected parameters.

use std::{collections::BTreeMap, f64::consts::PI};

use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant::mesh::{Diagonals, MeshError, Primitive};

use super::mesh_support::{assert_sound_solid, smallest_dihedral, volume};

fn read(ron: &str) -> Primitive {
    ron::from_str(ron).expect("a primitive in RON")
}

#[test]
fn solids_are_sound_and_hold_their_volume_at_the_default_resolution() {
    for (ron, exact) in [
        ("Box(size: (1.0, 2.0, 3.0))", 6.0),
        ("Sphere(radius: 0.5)", PI / 6.0),
        ("Torus(major: 0.3, minor: 0.1)", 2.0 * PI * PI * 0.3 * 0.01),
        (
            "Torus(major: 0.3, minor: 0.28)",
            2.0 * PI * PI * 0.3 * 0.28 * 0.28,
        ),
        ("Cylinder(radius: 0.2, height: 1.0)", PI * 0.04),
        ("Cylinder(radius: 0.2, height: 0.01)", PI * 0.0004),
    ] {
        let shape = read(ron).build().expect(ron).shape;
        assert_sound_solid(&shape);
        let error = volume(&shape) / exact - 1.0;
        assert!(error.abs() < 0.05, "{ron}: {error}");
        // The box has its own subdivision: five tetrahedra per cell have angles of at least 54.7°
        // when its cells are cubes; here they are three times as long as wide. The smallest angles
        // are in the thick torus.
        assert!(smallest_dihedral(&shape) > 3.0, "{ron}");
    }
}

/// From the top downwards, with segments of equal length.
#[test]
fn a_coil_is_a_helix() {
    let coil = read("Coil(radius: 0.1, height: 0.2, turns: 3, segments: 48)");
    let shape = coil.build().expect("a coil").shape;
    assert_eq!((shape.vertices.len(), shape.edges.len()), (49, 48));
    assert_eq!(shape.vertices[0], Vec3::new(0.1, 0.1, 0.0));
    // The chord of a sixteenth of a turn, and its share of the height.
    let chord: f64 = 0.2 * (PI / 16.0).sin();
    let expected = chord.hypot(0.2 / 48.0);
    for &[a, b] in &shape.edges {
        let [a, b] = [a, b].map(|i| shape.vertices[i as usize].as_dvec3());
        // Coordinates of f32 near 0.1 m.
        assert!((a.distance(b) - expected).abs() < 4e-8);
        assert!((DVec3::new(b.x, 0.0, b.z).length() - 0.1).abs() < 2e-8);
    }
    assert!((shape.vertices[48] - Vec3::new(0.1, -0.1, 0.0)).length() < 1e-7);
}

#[test]
fn a_box_fills_its_size_exactly_whatever_its_cells() {
    for cells in [UVec3::ONE, UVec3::new(1, 2, 3), UVec3::new(4, 3, 2)] {
        let size = Vec3::new(0.5, 0.25, 2.0);
        let shape = Primitive::Box { size, cells }.build().expect("a box").shape;
        assert_sound_solid(&shape);
        assert_eq!(shape.tetrahedra.len() as u32, 5 * cells.element_product());
        // Sixteen-bit fractions of sizes that are powers of two: rounding of f32 thirds at most.
        assert!((volume(&shape) - 0.25).abs() < 1e-6);
        let high = shape.vertices.iter().copied().fold(Vec3::MIN, Vec3::max);
        assert_eq!(high, size / 2.0);
    }
}

#[test]
fn a_finer_ball_is_nearer_to_its_volume() {
    let error = |cells| {
        let ball = Primitive::Sphere { radius: 1.0, cells }
            .build()
            .expect("a ball");
        assert_sound_solid(&ball.shape);
        // The bound of the lattice's paper.
        assert!(smallest_dihedral(&ball.shape) > 10.7);
        1.0 - volume(&ball.shape) / (4.0 / 3.0 * PI)
    };
    // Flat faces on a curved surface: the error falls with the square of their size.
    assert!(error(8) < 0.03 && error(16) < 0.01 && error(32) < 0.0025);
    assert!(error(32) > 0.0);
}

#[test]
fn a_cloth_of_20_cells_has_441_particles_800_triangles_and_1240_edges() {
    for diagonals in [Diagonals::OneWay, Diagonals::Alternating] {
        for (shear, edges) in [(false, 1240), (true, 1640)] {
            let cloth = Primitive::Cloth {
                size: Vec2::splat(10.0),
                cells: UVec2::splat(20),
                diagonals,
                shear,
            };
            let shape = cloth.build().expect("a cloth").shape;
            assert_eq!(shape.vertices.len(), 441);
            assert_eq!(shape.triangles.len(), 800);
            assert_eq!(shape.edges.len(), edges);
            assert!(shape.tetrahedra.is_empty());
            assert!(shape.edges.is_sorted() && shape.edges.iter().all(|[a, b]| a < b));
            assert_eq!(shape.vertices[0], Vec3::new(-5.0, 0.0, -5.0));
            assert_eq!(shape.vertices[20], Vec3::new(5.0, 0.0, -5.0));
            for t in &shape.triangles {
                let [a, b, c] = t.map(|i| shape.vertices[i as usize]);
                assert!((b - a).cross(c - a).y > 0.0, "{t:?} faces down");
            }
        }
    }
}

#[test]
fn a_rope_is_a_chain_of_edges_along_x() {
    let rope = read("Rope(length: 2.0, segments: 4)")
        .build()
        .expect("a rope");
    let x: Vec<f32> = rope.shape.vertices.iter().map(|p| p.x).collect();
    assert_eq!(x, [-1.0, -0.5, 0.0, 0.5, 1.0]);
    assert_eq!(rope.shape.edges, [[0, 1], [1, 2], [2, 3], [3, 4]]);
    assert!(rope.shape.triangles.is_empty() && rope.skin.is_none());
}

/// Each ring is a regular polygon; all of the surface faces outwards, and only its two rims are
/// open.
#[test]
fn a_tube_is_open_at_both_ends_and_faces_outwards() {
    let (radius, height) = (0.5_f64, 2.0_f64);
    for cells in [3, 8] {
        let text = format!("Tube(radius: {radius}, height: {height}, cells: ({cells}, 4))");
        let shape = read(&text).build().expect("a tube").shape;
        assert_eq!(shape.vertices.len(), 5 * cells);
        assert_eq!(shape.triangles.len(), 2 * 4 * cells);
        let at = |v: u32| shape.vertices[v as usize].as_dvec3();
        let mut area = 0.0;
        let mut sides = BTreeMap::<[u32; 2], usize>::new();
        for &[a, b, c] in &shape.triangles {
            let normal = (at(b) - at(a)).cross(at(c) - at(a));
            let out = (at(a) + at(b) + at(c)) * DVec3::new(1.0, 0.0, 1.0);
            assert!(normal.dot(out) > 0.0, "faces inwards");
            area += 0.5 * normal.length();
            for [a, b] in [[a, b], [b, c], [c, a]] {
                *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let around = 2.0 * radius * (PI / cells as f64).sin() * cells as f64;
        // Rounding of positions: 1e-7 of a meter.
        assert!((area - around * height).abs() < 1e-5, "{area} m²");
        let open = sides.values().filter(|count| **count == 1).count();
        assert_eq!(open, 2 * cells);
    }
}

#[test]
fn a_size_that_is_no_length_is_refused_by_name() {
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-9, 1e9] {
        for (primitive, name) in [
            (
                Primitive::Sphere {
                    radius: bad,
                    cells: 8,
                },
                "radius",
            ),
            (
                Primitive::Rope {
                    length: bad,
                    segments: 1,
                },
                "length",
            ),
            (
                Primitive::Cylinder {
                    radius: 1.0,
                    height: bad,
                    cells: 8,
                },
                "height",
            ),
            (
                Primitive::Torus {
                    major: 1.0,
                    minor: bad,
                    cells: 8,
                },
                "minor",
            ),
            (
                Primitive::Box {
                    size: Vec3::new(1.0, bad, 1.0),
                    cells: UVec3::ONE,
                },
                "size.y",
            ),
        ] {
            let error = primitive.build().expect_err("no length").to_string();
            assert!(
                error.starts_with(name) && error.contains(&bad.to_string()),
                "{error}"
            );
            assert!(error.contains("1e-7 m"), "{error}");
        }
    }
}

#[test]
fn too_few_and_too_many_cells_are_refused_before_anything_is_allocated() {
    for ron in [
        "Box(size: (1.0, 1.0, 1.0), cells: (1, 0, 1))",
        "Sphere(radius: 1.0, cells: 3)",
        "Torus(major: 1.0, minor: 0.1, cells: 1)",
        "Cylinder(radius: 1.0, height: 1.0, cells: 0)",
        "Cloth(size: (1.0, 1.0), cells: (0, 1))",
        "Rope(length: 1.0, segments: 0)",
        "Coil(radius: 1.0, height: 1.0, segments: 0)",
        "Coil(radius: 1.0, height: 1.0, turns: 0.0)",
        "Coil(radius: 0.0, height: 1.0)",
    ] {
        let error = read(ron).build().expect_err(ron);
        assert!(
            matches!(error, MeshError::Parameter { .. }),
            "{ron}: {error}"
        );
    }
    for ron in [
        "Box(size: (1.0, 1.0, 1.0), cells: (4294967295, 4294967295, 4294967295))",
        "Sphere(radius: 1.0, cells: 4294967295)",
        "Torus(major: 1.0, minor: 0.1, cells: 4294967295)",
        "Torus(major: 1e7, minor: 1e-7)",
        "Cylinder(radius: 1.0, height: 1.0, cells: 4294967295)",
        "Cylinder(radius: 1e-7, height: 1e7)",
        "Cloth(size: (1.0, 1.0), cells: (4294967295, 4294967295))",
        "Rope(length: 1.0, segments: 4294967295)",
    ] {
        let error = read(ron).build().expect_err(ron);
        assert!(
            matches!(error, MeshError::TooLarge { .. }),
            "{ron}: {error}"
        );
        assert!(error.to_string().contains("use fewer cells"), "{error}");
    }
}

#[test]
fn a_torus_whose_tube_leaves_no_hole_is_refused() {
    let error = read("Torus(major: 1.0, minor: 1.0)")
        .build()
        .expect_err("no hole");
    assert!(
        error.to_string().starts_with("minor = 1 is out of range"),
        "{error}"
    );
}

#[test]
fn a_misspelt_field_is_refused_in_ron() {
    let error = ron::from_str::<Primitive>("Sphere(radius: 1.0, cels: 4)").expect_err("misspelt");
    assert!(error.to_string().contains("cels"), "{error}");
}
