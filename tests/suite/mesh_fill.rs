//! Surfaces filled with tetrahedra, and the skin that follows them.

use glam::{DVec3, Quat, Vec3};
use pliant::mesh::{
    Anchor, BuildOptions, FileMesh, SoftMesh, SurfaceMesh, build, component_of_each, surface_volume,
};
use pliant::scene::asset;
use pliant::solver::{Particles, Topology};

use super::mesh_support::{
    assert_sound_solid, both, cube, filled, has_note, inward, placed, skin_at_rest,
    smallest_dihedral, volume,
};

/// The built-in surfaces, one meter long, with the fewest cells of a series that need no more for
/// their volume.
fn assets() -> Vec<(&'static str, SurfaceMesh, SoftMesh)> {
    let fill = |surface: &SurfaceMesh, cells| {
        let options = BuildOptions {
            size: Some(1.0),
            cells: Some(cells),
            ..BuildOptions::default()
        };
        build(FileMesh::Surface(surface.clone()), &options).expect("it can be filled")
    };
    asset::ASSETS
        .iter()
        .filter_map(|asset| match asset::load(asset.name).expect(asset.name) {
            FileMesh::Surface(surface) => Some((asset.name, surface)),
            FileMesh::Tetrahedra(_) | FileMesh::Curves(_) => None,
        })
        .map(|(name, surface)| {
            let mut tries = [12, 18, 27, 40]
                .map(|cells| fill(&surface, cells))
                .into_iter();
            let body = tries.find(|body| !has_note(body, "use more cells"));
            (name, surface, body.expect(name))
        })
        .collect()
}

fn longest_side(vertices: &[DVec3]) -> f64 {
    let low = vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = vertices
        .iter()
        .copied()
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    (high - low).max_element()
}

/// The volume of a surface from the fraction of a box's points that lie inside it, by winding
/// number: an independent and slow method for surfaces that are open or self-intersecting.
fn sampled_volume(surface: &SurfaceMesh, samples: u32) -> f64 {
    let low = surface
        .vertices
        .iter()
        .copied()
        .fold(DVec3::INFINITY, DVec3::min);
    let high = surface
        .vertices
        .iter()
        .copied()
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    let cell = (high - low) / f64::from(samples);
    let mut inside = 0;
    for i in 0..samples.pow(3) {
        let at = DVec3::new(
            f64::from(i % samples),
            f64::from(i / samples % samples),
            f64::from(i / samples / samples),
        );
        let point = low + (at + 0.5) * cell;
        let angle: f64 = surface
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| surface.vertices[i as usize] - point);
                let [la, lb, lc] = [a.length(), b.length(), c.length()];
                let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
                2.0 * a.dot(b.cross(c)).atan2(below)
            })
            .sum();
        inside += u32::from(angle.abs() > 2.0 * std::f64::consts::PI);
    }
    f64::from(inside) * cell.element_product()
}

#[test]
fn the_built_in_surfaces_are_filled_within_5_percent_of_their_volume() {
    for (name, surface, body) in assets() {
        assert_sound_solid(&body.shape);
        // The lattice's paper proves 10.7°.
        assert!(smallest_dihedral(&body.shape) > 10.7, "{name}");
        let exact = match name {
            // Open, with overlapping parts; 32 samples per side determine its volume to about 1 %.
            "teapot" => sampled_volume(&surface, 32),
            // Closed, or with holes smaller than a thousandth of its area.
            _ => surface_volume(&surface.vertices, &surface.triangles),
        };
        let error = volume(&body.shape) / (exact / longest_side(&surface.vertices).powi(3)) - 1.0;
        assert!(error.abs() < 0.05, "{name}: {error}");
    }
}

#[test]
fn no_part_of_a_built_in_surface_is_lost_or_cut_off() {
    for (name, _, body) in assets() {
        let pieces = component_of_each(body.shape.vertices.len(), &body.shape.tetrahedra);
        assert!(
            pieces.iter().all(|piece| *piece == 0),
            "{name} is in pieces"
        );
        assert!(!has_note(&body, "too far"), "{name}: {:?}", body.notes);
    }
    // The bunny's ears are thinner than an eighth of its size.
    let options = BuildOptions {
        size: Some(1.0),
        cells: Some(8),
        ..BuildOptions::default()
    };
    let bunny = asset::load("bunny").expect("the bunny");
    let coarse = build(bunny, &options).expect("the bunny in eight cells");
    let pieces = component_of_each(coarse.shape.vertices.len(), &coarse.shape.tetrahedra);
    assert!(pieces.iter().all(|piece| *piece == 0));
    assert!(!has_note(&coarse, "too far"), "{:?}", coarse.notes);
    assert!(has_note(&coarse, "more volume"), "{:?}", coarse.notes);
}

#[test]
fn a_skin_at_rest_is_the_surface_that_was_given() {
    for (name, surface, body) in assets() {
        // Welding removes vertices, so that the order is only known for a clean mesh.
        if name != "bunny" {
            continue;
        }
        let low = surface
            .vertices
            .iter()
            .copied()
            .fold(DVec3::INFINITY, DVec3::min);
        let high = surface
            .vertices
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        let scale = 1.0 / longest_side(&surface.vertices);
        for (given, drawn) in surface.vertices.iter().zip(skin_at_rest(&body)) {
            let expected = (*given - (low + high) / 2.0) * scale;
            // Four products of a weight up to 4 and a position up to 1/2, each rounded to f32.
            assert!(
                expected.distance(drawn.as_dvec3()) < 1e-6,
                "{expected} {drawn}"
            );
        }
    }
}

/// Particles of a body are numbered otherwise than the vertices of its mesh; its skin follows them.
#[test]
fn a_skin_follows_the_particles_of_a_body_of_any_size() {
    let shift = Vec3::new(3.0, -2.0, 1.0);
    let mut is_renumbered = false;
    for (name, _, body) in assets() {
        let at_rest = skin_at_rest(&body);
        let skin = body.skin.as_ref().expect("a skin");
        let topology = Topology::new(body.shape.clone()).expect("sound");
        is_renumbered |= topology.particles() > 2048;
        let mut particles = Particles::at_rest(topology.rest.iter().copied());
        particles.translate(shift.as_dvec3());
        let mut moved = Vec::new();
        skin.deform(&topology, &particles, &mut moved);
        for (rest, moved) in at_rest.iter().zip(&moved) {
            let expected = *rest + shift;
            assert!(
                expected.distance(*moved) < 1e-5,
                "{name}: {expected} {moved}"
            );
        }
    }
    assert!(is_renumbered, "a large body is among them");
}

#[test]
fn weights_sum_to_one_are_bounded_and_move_rigidly() {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 2.0);
    let shift = Vec3::new(3.0, -2.0, 1.0);
    for (name, _, body) in assets() {
        let skin = body.skin.as_ref().expect("a skin");
        for anchor in &skin.anchors {
            let sum: f64 = anchor.weights.iter().map(|w| f64::from(*w)).sum();
            // One weight is adjusted so that the sum is 1: half an ulp of a weight up to 4.
            assert!(
                (sum - 1.0).abs() <= 4.0 * f64::from(f32::EPSILON),
                "{name}: {anchor:?}"
            );
            assert!(anchor.weights.iter().all(|w| w.abs() <= Anchor::MAX_WEIGHT));
            assert!(
                anchor
                    .vertices
                    .iter()
                    .all(|p| p.index() < body.shape.vertices.len())
            );
        }
        let at_rest = skin_at_rest(&body);
        let mut moved = Vec::new();
        skin.deform_with(
            |i| turn * body.shape.vertices[i.index()] + shift,
            &mut moved,
        );
        for (rest, moved) in at_rest.iter().zip(&moved) {
            let expected = turn * *rest + shift;
            assert!(
                expected.distance(*moved) < 1e-5,
                "{name}: {expected} {moved}"
            );
        }
        let vertices = skin.anchors.len() as u32;
        assert!(skin.triangles.iter().flatten().all(|i| *i < vertices));
    }
}

#[test]
fn deforming_again_reuses_the_buffer() {
    let body = filled(cube(), 4);
    let skin = body.skin.as_ref().expect("a skin");
    let mut out = Vec::new();
    skin.deform_with(|i| body.shape.vertices[i.index()], &mut out);
    let (place, room) = (out.as_ptr(), out.capacity());
    skin.deform_with(|i| body.shape.vertices[i.index()] * 2.0, &mut out);
    assert_eq!((out.as_ptr(), out.capacity(), out.len()), (place, room, 8));
}

#[test]
fn a_cube_is_filled_exactly_and_the_same_way_twice() {
    let body = filled(cube(), 4);
    assert_sound_solid(&body.shape);
    // Its faces lie on the lattice, so that only edges that cross them at right angles are cut.
    assert!((volume(&body.shape) - 1.0).abs() < 1e-6);
    let particles = body.shape.vertices.len();
    let tetrahedra = body.shape.tetrahedra.len();
    let note = format!(
        "filled with 4 cells along the longest side: {particles} particles, {tetrahedra} tetrahedra, \
         the volume of the surface"
    );
    assert_eq!(body.notes, [note]);
    assert_eq!(body, filled(cube(), 4));
}

#[test]
fn an_open_box_is_closed_with_a_note() {
    let mut open = cube();
    open.triangles.truncate(10);
    let body = filled(open, 8);
    assert_sound_solid(&body.shape);
    assert!(
        has_note(&body, "open (4 boundary edges)"),
        "{:?}",
        body.notes
    );
    // Where the winding number exceeds one half, which by symmetry is up to the missing side; the
    // lattice locates that to half a cell, a sixteenth.
    let volume = volume(&body.shape);
    assert!((volume - 1.0).abs() < 1.0 / 16.0, "{volume}");
}

#[test]
fn a_sheet_cannot_be_filled_and_the_reason_says_what_to_do() {
    let mut sheet = cube();
    sheet.triangles.truncate(2);
    let error = build(FileMesh::Surface(sheet), &BuildOptions::default()).expect_err("a sheet");
    let text = error.to_string();
    assert!(
        text.contains("4 boundary edges") && text.contains("shell"),
        "{text}"
    );
}

#[test]
fn a_surface_that_faces_inwards_is_turned() {
    let body = filled(inward(cube()), 4);
    assert!(
        has_note(&body, "12 inward-facing triangles flipped"),
        "{:?}",
        body.notes
    );
    assert_eq!(body.shape, filled(cube(), 4).shape);
    let mut one = cube();
    one.triangles[7].swap(0, 1);
    let body = filled(one, 4);
    assert!(
        has_note(&body, "1 inward-facing triangle flipped"),
        "{:?}",
        body.notes
    );
    assert_eq!(body.shape, filled(cube(), 4).shape);
}

#[test]
fn a_cavity_stays_empty_and_a_second_body_that_faces_inwards_is_turned() {
    let hollow = both(cube(), inward(placed(cube(), 0.5, DVec3::ZERO)));
    let body = filled(hollow, 16);
    assert_sound_solid(&body.shape);
    assert!(
        (volume(&body.shape) / 0.875 - 1.0).abs() < 0.02,
        "{}",
        volume(&body.shape)
    );
    let beside = both(cube(), inward(placed(cube(), 1.0, DVec3::X * 2.0)));
    let body = filled(beside, 12);
    assert!(has_note(&body, "2 disconnected pieces"), "{:?}", body.notes);
    assert!(
        (volume(&body.shape) / 2.0 - 1.0).abs() < 0.02,
        "{}",
        volume(&body.shape)
    );
}

#[test]
fn overlapping_volumes_are_filled_once() {
    let crossed = both(cube(), placed(cube(), 1.0, DVec3::splat(0.5)));
    let body = filled(crossed, 12);
    assert_sound_solid(&body.shape);
    // Two unit cubes that overlap by an eighth.
    assert!(
        (volume(&body.shape) / 1.875 - 1.0).abs() < 0.05,
        "{}",
        volume(&body.shape)
    );
}

#[test]
fn tiny_pieces_are_left_out_with_a_note() {
    let dusty = both(cube(), placed(cube(), 0.02, DVec3::X * 5.0));
    let body = filled(dusty, 24);
    assert!(
        has_note(&body, "1 piece of less than 1 % of the volume removed"),
        "{:?}",
        body.notes
    );
    // Twenty cells from the cube: clamped to its nearest corner instead of extrapolated.
    assert!(
        has_note(&body, "8 vertices of the surface too far"),
        "{:?}",
        body.notes
    );
    let nearest = body
        .shape
        .vertices
        .iter()
        .map(|p| p.x)
        .fold(f32::MIN, f32::max);
    assert!(skin_at_rest(&body).iter().all(|p| p.x <= nearest + 1e-6));
}

#[test]
fn a_surface_that_branches_is_filled_with_a_note() {
    // Two cubes with a common face, which both contain.
    let mut pair = both(cube(), placed(cube(), 1.0, DVec3::X));
    pair.notes.clear();
    let body = filled(pair, 8);
    assert!(has_note(&body, "non-manifold"), "{:?}", body.notes);
    assert!(
        (volume(&body.shape) / 2.0 - 1.0).abs() < 0.05,
        "{}",
        volume(&body.shape)
    );
}

#[test]
fn a_part_thinner_than_a_cell_stays_connected() {
    // A cube with a spike made of three of its sides.
    let mut spiked = cube();
    spiked.vertices.push(DVec3::new(3.5, 0.0, 0.0));
    spiked.triangles.truncate(10);
    spiked
        .triangles
        .extend([[1, 3, 8], [3, 7, 8], [7, 5, 8], [5, 1, 8]]);
    let body = filled(spiked, 10);
    assert_sound_solid(&body.shape);
    let pieces = component_of_each(body.shape.vertices.len(), &body.shape.tetrahedra);
    assert!(pieces.iter().all(|piece| *piece == 0));
    assert!(!has_note(&body, "too far"), "{:?}", body.notes);
}
