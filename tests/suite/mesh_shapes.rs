//! Twenty surfaces as users bring them (thin limbs, holes, shells, several parts), filled with the
//! cells that are chosen for them, and dropped.

use crate::mesh_support::{both, cube, inward, placed};
use glam::{DMat3, DQuat, DVec3};
use pliant::{
    mesh::SurfaceMesh,
    output::warnings::warnings,
    scene::{Scene, run::run},
};
use std::{
    f64::consts::{PI, TAU},
    fmt::Write,
    fs,
    path::Path,
};

/// Points around an axis or along a tube.
const AROUND: u32 = 24;

/// A closed grid of points, `rings` × [`AROUND`]; open ends are capped.
fn tube(rings: u32, closed: bool, point: impl Fn(u32, f64) -> DVec3) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    for ring in 0..rings {
        let angles = (0..AROUND).map(|i| TAU * f64::from(i) / f64::from(AROUND));
        mesh.vertices.extend(angles.map(|angle| point(ring, angle)));
    }
    let at = |ring: u32, i: u32| (ring % rings) * AROUND + i % AROUND;
    for ring in 0..if closed { rings } else { rings - 1 } {
        for i in 0..AROUND {
            let [a, b] = [at(ring, i), at(ring, i + 1)];
            let [c, d] = [at(ring + 1, i + 1), at(ring + 1, i)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    if !closed {
        for i in 1..AROUND - 1 {
            mesh.triangles.push([at(0, 0), at(0, i + 1), at(0, i)]);
            let last = rings - 1;
            mesh.triangles
                .push([at(last, 0), at(last, i), at(last, i + 1)]);
        }
    }
    mesh
}

/// A surface of revolution around y, from radii and heights.
fn lathe(profile: &[(f64, f64)]) -> SurfaceMesh {
    tube(profile.len() as u32, false, |ring, angle| {
        let (radius, height) = profile[ring as usize];
        DVec3::new(radius * angle.sin(), height, radius * angle.cos())
    })
}

fn ball(radius: f64) -> SurfaceMesh {
    let profile: Vec<_> = (0..=16)
        .map(|i| {
            let angle = PI * (f64::from(i) / 16.0 - 0.5);
            (radius * angle.cos().max(1e-3), radius * angle.sin())
        })
        .collect();
    lathe(&profile)
}

/// A tube of constant radius along a closed or open curve.
fn along(rings: u32, closed: bool, radius: f64, curve: impl Fn(f64) -> DVec3) -> SurfaceMesh {
    let last = f64::from(if closed { rings } else { rings - 1 });
    let mut up = DVec3::Y;
    let frames: Vec<_> = (0..rings)
        .map(|ring| {
            let t = f64::from(ring) / last;
            let along = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
            let across = up - along * up.dot(along);
            up = match across.length() > 1e-6 {
                true => across.normalize(),
                false => along.any_orthonormal_vector(),
            };
            (curve(t), DMat3::from_cols(up.cross(along), up, along))
        })
        .collect();
    tube(rings, closed, |ring, angle| {
        let (center, frame) = frames[ring as usize];
        center + frame * DVec3::new(angle.cos(), angle.sin(), 0.0) * radius
    })
}

fn torus(major: f64, minor: f64) -> SurfaceMesh {
    along(48, true, minor, |t| {
        DVec3::new((TAU * t).cos(), 0.0, (TAU * t).sin()) * major
    })
}

fn block(x: f64, y: f64, z: f64) -> SurfaceMesh {
    let mut block = cube();
    for p in &mut block.vertices {
        *p *= DVec3::new(x, y, z);
    }
    block
}

fn at(surface: SurfaceMesh, x: f64, y: f64, z: f64) -> SurfaceMesh {
    placed(surface, 1.0, DVec3::new(x, y, z))
}

fn turned(mut surface: SurfaceMesh, axis: DVec3, degrees: f64) -> SurfaceMesh {
    let rotation = DQuat::from_axis_angle(axis, degrees.to_radians());
    for p in &mut surface.vertices {
        *p = rotation * *p;
    }
    surface
}

fn all(parts: impl IntoIterator<Item = SurfaceMesh>) -> SurfaceMesh {
    parts.into_iter().reduce(both).expect("a part")
}

fn shapes() -> Vec<(&'static str, SurfaceMesh)> {
    let legs = |x: f64, z: f64, thick: f64, long: f64| {
        let corners = [(x, z), (x, -z), (-x, z), (-x, -z)];
        all(corners.map(|(x, z)| at(block(thick, long, thick), x, -0.5 * long, z)))
    };
    let capsule = |radius: f64| along(16, false, radius, |t| DVec3::Y * (t - 0.5));
    let helix = |t: f64| {
        let angle = 3.0 * TAU * t;
        DVec3::new(0.4 * angle.cos(), t, 0.4 * angle.sin())
    };
    let trefoil = |t: f64| {
        let a = TAU * t;
        let [x, y] = [
            a.sin() + 2.0 * (2.0 * a).sin(),
            a.cos() - 2.0 * (2.0 * a).cos(),
        ];
        DVec3::new(x, y, -(3.0 * a).sin()) / 3.0
    };
    vec![
        ("cube", cube()),
        ("ball", ball(0.5)),
        ("plate", block(1.0, 0.06, 1.0)),
        ("slender rod", block(0.05, 1.0, 0.05)),
        ("cone", lathe(&[(0.4, 0.0), (0.2, 0.5), (0.01, 1.0)])),
        ("thick torus", torus(0.4, 0.15)),
        ("thin torus", torus(0.5, 0.04)),
        (
            "linked tori",
            both(
                torus(0.4, 0.1),
                turned(at(torus(0.4, 0.1), 0.4, 0.0, 0.0), DVec3::X, 90.0),
            ),
        ),
        ("hollow ball", both(ball(0.5), inward(ball(0.4)))),
        (
            "bowl",
            lathe(&[
                (0.01, 0.0),
                (0.3, 0.05),
                (0.5, 0.4),
                (0.46, 0.4),
                (0.27, 0.1),
                (0.01, 0.05),
            ]),
        ),
        (
            "vase",
            lathe(&[
                (0.2, 0.0),
                (0.35, 0.3),
                (0.12, 0.8),
                (0.2, 1.0),
                (0.17, 1.0),
                (0.08, 0.8),
                (0.3, 0.3),
                (0.01, 0.06),
            ]),
        ),
        (
            "dumbbell",
            all([
                at(ball(0.25), 0.0, 0.5, 0.0),
                at(ball(0.25), 0.0, -0.5, 0.0),
                capsule(0.06),
            ]),
        ),
        ("hourglass", lathe(&[(0.3, 0.0), (0.05, 0.5), (0.3, 1.0)])),
        (
            "animal",
            all([
                block(1.0, 0.4, 0.35),
                at(legs(0.4, 0.12, 0.08, 0.5), 0.0, -0.15, 0.0),
                at(ball(0.2), 0.6, 0.3, 0.0),
            ]),
        ),
        (
            "star",
            all((0..6).map(|i| {
                turned(
                    lathe(&[(0.12, 0.0), (0.08, 0.3), (0.01, 0.6)]),
                    DVec3::Z,
                    60.0 * f64::from(i),
                )
            })),
        ),
        (
            "jack",
            all([
                capsule(0.08),
                turned(capsule(0.08), DVec3::X, 90.0),
                turned(capsule(0.08), DVec3::Z, 90.0),
            ]),
        ),
        ("trefoil knot", along(120, true, 0.1, trefoil)),
        ("spring", along(120, false, 0.06, helix)),
        (
            "chair",
            all([
                block(0.5, 0.06, 0.5),
                legs(0.21, 0.21, 0.06, 0.5),
                at(block(0.5, 0.6, 0.06), 0.0, 0.3, -0.22),
            ]),
        ),
        (
            "comb",
            all((0..8)
                .map(|i| {
                    at(
                        block(0.05, 0.4, 0.05),
                        -0.42 + 0.12 * f64::from(i),
                        -0.2,
                        0.0,
                    )
                })
                .chain([block(1.0, 0.12, 0.05)])),
        ),
        (
            "three balls",
            all([0.0, 0.5, 1.0].map(|x| at(ball(0.2), x, 0.3 * x, 0.0))),
        ),
    ]
}

/// A scene file with the shape as an OBJ file beside it: stiff edges, no cells, no substeps.
fn scene(folder: &Path, name: &str, surface: &SurfaceMesh, world: &str) -> Scene {
    let file = name.replace(' ', "_") + ".obj";
    let mut obj = String::new();
    for p in &surface.vertices {
        writeln!(obj, "v {} {} {}", p.x, p.y, p.z).expect("a string");
    }
    for t in &surface.triangles {
        let [a, b, c] = t.map(|i| i + 1);
        writeln!(obj, "f {a} {b} {c}").expect("a string");
    }
    fs::write(folder.join(&file), obj).expect("a writable folder");
    let text = format!(
        r#"Scene(
            title: "{name}", look_at: "It falls and comes to rest.", {world}
            bodies: [(
                name: "{name}", mesh: (file: "{file}", size: 0.5), position: (0, 0.85, 0),
                effects: (stretch: (compliance: 1e-5), volume: (), ground: ()),
            )],
            acceptance: (seconds: 3, checks: [NoInverted, Volume(0.01), Above(-1e-3)]),
        )"#
    );
    let mut scene = Scene::parse(name, &text).expect("a sound scene");
    scene.folder = folder.to_owned();
    scene
}

#[test]
fn shapes_of_any_kind_are_accepted_with_the_cells_and_substeps_chosen_for_them() {
    let folder = std::env::temp_dir().join(format!("pliant-shapes-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a writable folder");
    let mut failed = Vec::new();
    for (name, surface) in shapes() {
        let scene = scene(&folder, name, &surface, "");
        let built = scene.build().expect("a surface that can be filled");
        let notes = built.notes.join("\n");
        let body = &built.world.bodies[0];
        let particles = format!(": {} particles", body.particles.len());
        assert!(
            notes.contains("cells along the longest side") && notes.contains(&particles),
            "{notes}"
        );
        assert!(
            notes.contains(": substeps set to ") && notes.contains("(not given in the file)"),
            "{notes}"
        );
        assert!(body.particles.len() <= 2000, "{name}: {notes}");
        let substeps = built.world.settings.substeps.get();
        assert!((20..=40).contains(&substeps), "{name}: {substeps}");
        let done = run(&built, &scene.run_options(), |_| ()).expect("it runs");
        if !done.accepted() {
            failed.push(format!("{name}: {}\n{notes}", done.reasons.join(", ")));
        }
    }
    fs::remove_dir_all(&folder).expect("it was made here");
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn substeps_that_are_given_are_kept_and_what_they_leave_is_said() {
    let folder = std::env::temp_dir().join(format!("pliant-shape-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a writable folder");
    let star = shapes().into_iter().find(|(name, _)| *name == "star");
    let (name, surface) = star.expect("a star");
    let scene = scene(&folder, name, &surface, "world: (substeps: 10),");
    let built = scene.build().expect("a surface that can be filled");
    assert_eq!(built.world.settings.substeps.get(), 10);
    let done = run(&built, &scene.run_options(), |_| ()).expect("it runs");
    let warnings = warnings(&done).join("\n");
    for part in [
        "'star' has",
        "tetrahedra inverted: try --set substeps=20",
        "the solver holds",
        "softer materials",
    ] {
        assert!(warnings.contains(part), "“{part}” is not in: {warnings}");
    }
    fs::remove_dir_all(&folder).expect("it was made here");
}

#[test]
fn substeps_are_chosen_for_what_was_filled_and_no_more_is_said_than_is_known() {
    let folder = std::env::temp_dir().join(format!("pliant-choice-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a writable folder");
    let star = shapes().into_iter().find(|(name, _)| *name == "star");
    let (name, surface) = star.expect("a star");
    // Writes the file.
    scene(&folder, name, &surface, "");
    let star = |world: &str, mesh: &str, effects: &str| {
        let text = format!(
            r#"Scene(title: "t", look_at: "l", {world} acceptance: (seconds: 1, checks: []), bodies: [(
                name: "body", mesh: (file: "{mesh}", size: 0.5), effects: ({effects}))])"#
        );
        let mut scene = Scene::parse("star", &text).expect("a sound scene");
        scene.folder.clone_from(&folder);
        let built = scene.build().expect("a body");
        let substeps = built.world.settings.substeps.get();
        (substeps, built.notes.join("\n"), scene)
    };
    let (substeps, notes, open) = star("", "star.obj", "stretch: (), volume: ()");
    assert_eq!(substeps, 40, "rigid edges need the most");
    assert!(!notes.contains("as soft as set"), "{notes}");
    let again: Scene = open.to_text().expect("RON").parse().expect("a scene");
    assert!(open.chooses_substeps && again.chooses_substeps);
    assert_eq!(again.bodies, open.bodies);
    let soft = "stretch: (compliance: 1e-5), volume: ()";
    for (world, mesh, effects, substeps, is_soft) in [
        ("", "star.obj", soft, 40, true),
        ("", "star.obj", "neo_hookean: ()", 20, false),
        (
            "world: (rate: 600),",
            "star.obj",
            "stretch: (), volume: ()",
            10,
            false,
        ),
        ("world: (iterations: 20),", "star.obj", soft, 40, false),
        (
            "",
            "star.obj",
            "stretch: (axial_stiffness: 1e9), volume: ()",
            40,
            true,
        ),
        // A rope, and tetrahedra of a file.
        ("", "coil", "stretch: (compliance: 1e-5)", 10, false),
        ("", "bunny_coarse", soft, 10, false),
    ] {
        let (chosen, notes, _) = star(world, mesh, effects);
        assert_eq!(chosen, substeps, "{world} {mesh} {effects}: {notes}");
        assert_eq!(notes.contains("as soft as set"), is_soft, "{notes}");
    }
    fs::remove_dir_all(&folder).expect("it was made here");
}
