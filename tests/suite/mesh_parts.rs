//! Named parts of mesh files: which elements a name means, where the bodies of parts are, and what is
//! said of unknown names.

use glam::{DVec3, Vec3};
use pliant::{
    mesh::{Bounds, BuildOptions, FileMesh, MeshError, SoftMesh, Treatment, build, read::Parts},
    scene::{MeshSpec, PartBounds, Scene, save::Definition},
    solver::Body,
};
use std::{fs, io, path::PathBuf};

/// Objects with a triangle each, at x = 0, 1, 2 and so on; `{}` in a text is replaced by one.
fn obj(text: &str) -> String {
    let mut places = 0..;
    let pieces: Vec<&str> = text.split("{}").collect();
    let (last, others) = pieces.split_last().expect("one piece or more");
    let mut file = String::new();
    for piece in others {
        let x: u32 = places.next().expect("without end");
        file += &format!("{piece}v {x} 0 0\nv {x} 1 0\nv {x} 0 1\nf -3 -2 -1\n");
    }
    file + last
}

fn parts(name: &str, text: &str) -> Parts {
    Parts::of_bytes(name, text.as_bytes(), &beside).expect(name)
}

fn beside(name: &str) -> io::Result<Vec<u8>> {
    let tetrahedron = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let positions = tetrahedron.iter().flatten().flat_map(|x| x.to_le_bytes());
    let indices = [0_u8, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    match name {
        "t.bin" => Ok(positions.chain(indices).collect()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

/// A glTF file with these nodes; the first is the only one of the scene. Mesh 0, a tetrahedron, has
/// the name “Leg”, mesh 1 is of points, and mesh 2 has no name.
fn gltf(nodes: &str) -> String {
    let tetrahedron = r#"{"attributes":{"POSITION":0},"indices":1}"#;
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
"meshes":[{{"name":"Leg","primitives":[{tetrahedron}]}},
{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":0}}]}},{{"primitives":[{tetrahedron}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}}],
"buffers":[{{"uri":"t.bin","byteLength":60}}]}}"#
    )
}

/// A table: two legs that share a mesh, and a plate without a name of its mesh.
fn table() -> String {
    gltf(
        r#"{"name":"Table","translation":[10,0,0],"children":[1,4,5]},
{"name":"Legs","children":[2,3]},
{"name":"Left","mesh":0},
{"name":"Right, “odd” №\u0007","mesh":0,"translation":[3,0,0],"scale":[2,2,2]},
{"name":"Plate","mesh":2,"translation":[0,5,0],"children":[6]},
{"name":"Marks","mesh":1},
{"name":"Plate","mesh":2,"translation":[0,1,0]}"#,
    )
}

/// First and last x of the vertices, and the number of elements.
fn extent(mesh: &FileMesh) -> (f64, f64, usize) {
    let x = mesh.vertices().iter().map(|p| p.x);
    let (low, high) = x.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let elements = match mesh {
        FileMesh::Surface(it) => it.triangles.len(),
        FileMesh::Tetrahedra(it) => it.tetrahedra.len(),
        FileMesh::Curves(it) => it.segments.len(),
    };
    (low, high, elements)
}

fn part(parts: &Parts, name: &str) -> (f64, f64, usize) {
    extent(&parts.part(name).expect(name))
}

fn complaint(parts: &Parts, name: &str) -> String {
    parts.part(name).expect_err(name).to_string()
}

#[test]
fn a_node_is_its_mesh_with_all_transforms_above() {
    let parts = parts("table.gltf", &table());
    assert_eq!(part(&parts, "Left"), (10.0, 11.0, 4));
    assert_eq!(
        part(&parts, "Right, “odd” №\u{7}"),
        (13.0, 15.0, 4),
        "moved by 13 and scaled by 2"
    );
    assert_eq!(
        part(&parts, "Legs"),
        (10.0, 15.0, 8),
        "a node without a mesh is those below it"
    );
    assert_eq!(
        part(&parts, "Leg"),
        (10.0, 15.0, 8),
        "a mesh is all nodes that show it"
    );
    assert_eq!(part(&parts, "Table").2, 16);
    let plate = parts.part("Plate").expect("a plate, twice");
    assert_eq!(extent(&plate).2, 8);
    let y = plate.vertices().iter().map(|p| p.y);
    assert_eq!(y.fold(0.0, f64::max), 7.0, "below the other plate");
    let right = "Right, “odd” №\u{7}";
    assert_eq!(
        parts.names(),
        ["Table", "Legs", "Left", right, "Plate", "Leg"]
    );
    assert_eq!(parts.whole().vertices().len(), 16);
}

/// An empty node, or an object without faces, does not hide the mesh or group of its name.
#[test]
fn a_part_without_a_mesh_hides_no_other_of_its_name() {
    let parts = parts("shadow.obj", &obj("o Leg\no Rest\ng Leg\n{}"));
    assert_eq!(parts.names(), ["Rest", "Leg"]);
    assert_eq!(part(&parts, "Leg"), part(&parts, "Rest"));
}

#[test]
fn a_name_above_and_below_counts_elements_once() {
    let parts = parts(
        "a.gltf",
        &gltf(
            r#"{"name":"Arm","children":[1,2]},{"name":"Arm","children":[3]},{"mesh":0},{"name":"Arm","mesh":2}"#,
        ),
    );
    assert_eq!(part(&parts, "Arm").2, 8);
}

#[test]
fn objects_of_obj_are_parts_and_groups_where_no_object_has_the_name() {
    let text = obj(
        "{}o Left Leg#1 # a comment\n{}{}g legs Plate \\\nfeet\no Plate\n{}g\n{}o Left Leg#1\n{}",
    );
    let parts = parts("table.obj", &text);
    assert_eq!(
        part(&parts, "Left Leg#1"),
        (1.0, 5.0, 3),
        "both of the name"
    );
    assert_eq!(
        part(&parts, "Plate"),
        (3.0, 4.0, 2),
        "the object, not the group"
    );
    assert_eq!(part(&parts, "legs"), (3.0, 3.0, 1));
    assert_eq!(parts.names(), ["Left Leg#1", "Plate", "legs", "feet"]);
    assert_eq!(extent(parts.whole()).2, 6);
}

#[test]
fn lines_of_a_part_without_faces_become_ropes() {
    let text =
        obj("o Plate\n{}l 1 2\no Rope\nv 9 0 0\nv 9 1 0\nv 9 2 0\nl 4 5 6\np 1\no Spot\np 1\n");
    let parts = parts("table.obj", &text);
    let rope = parts.part("Rope").expect("a rope");
    assert_eq!(extent(&rope), (9.0, 9.0, 2));
    let FileMesh::Curves(rope) = rope else {
        panic!("no rope: {rope:?}");
    };
    assert_eq!(rope.notes, ["points, lines, curves or patches ignored: 1"]);
    let FileMesh::Surface(plate) = parts.part("Plate").expect("a plate") else {
        panic!("no plate");
    };
    assert_eq!(plate.notes, ["points, lines, curves or patches ignored: 1"]);
    let FileMesh::Surface(whole) = parts.whole() else {
        panic!("no surface");
    };
    assert_eq!(whole.notes, ["points, lines, curves or patches ignored: 4"]);
    assert_eq!(parts.names(), ["Plate", "Rope"]);
    assert!(complaint(&parts, "Spot").contains("the part “Spot” has no mesh"));
}

#[test]
fn unknown_names_are_answered_with_those_of_the_file() {
    let few = parts("table.gltf", &table());
    assert_eq!(
        complaint(&few, "left"),
        "table.gltf: unknown part “left”; expected one of: “Table”, “Legs”, “Left”, \
         “Right, “odd” №\u{fffd}”, “Plate”, “Leg”"
    );
    assert!(complaint(&few, "Marks").contains("the part “Marks” has no mesh"));
    let many: String = (0..14)
        .map(|number| format!("o part{number}\n{{}}"))
        .collect();
    let many = parts("many.obj", &obj(&many));
    let message = complaint(&many, "part20");
    assert!(
        message.ends_with("“part8”, “part9” and 4 more"),
        "{message}"
    );
    assert!(matches!(many.part(""), Err(MeshError::UnknownPart { .. })));
    let none = parts("plain.obj", &obj("g \n{}"));
    assert!(complaint(&none, "leg").contains("plain.obj: the file has no named parts"));
    let medit = "MeshVersionFormatted 1\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n";
    let medit = parts("a.mesh", medit);
    assert_eq!(medit.names(), [""; 0]);
    let message = complaint(&medit, "leg");
    assert!(
        message.contains("this format has no named parts"),
        "{message}"
    );
}

fn cloth(parts: &Parts, name: &str, keep_place: bool, size: Option<f32>) -> SoftMesh {
    let options = BuildOptions {
        size,
        bounds: keep_place.then(|| parts.bounds()),
        treatment: Treatment::Shell,
        ..BuildOptions::default()
    };
    build(parts.part(name).expect(name), &options).expect(name)
}

fn box_of(mesh: &SoftMesh) -> (Vec3, Vec3) {
    let vertices = || mesh.shape.vertices.iter().copied();
    (
        vertices().reduce(Vec3::min).expect("a mesh"),
        vertices().reduce(Vec3::max).expect("a mesh"),
    )
}

#[test]
fn parts_in_the_bounds_of_their_file_fit_together() {
    let parts = parts("table.gltf", &table());
    let bounds = parts.bounds();
    assert_eq!(
        (bounds.center, bounds.size),
        (DVec3::new(12.5, 3.5, 1.0), 7.0)
    );
    let left = cloth(&parts, "Left", true, None);
    assert_eq!(
        box_of(&left),
        (Vec3::new(-2.5, -3.5, -1.0), Vec3::new(-1.5, -2.5, 0.0))
    );
    // The file is scaled, and the part with it.
    let small = cloth(&parts, "Left", true, Some(0.7));
    let (low, high) = box_of(&small);
    assert!(low.distance(Vec3::new(-0.25, -0.35, -0.1)) < 1e-7, "{low}");
    assert!(high.distance(Vec3::new(-0.15, -0.25, 0.0)) < 1e-7, "{high}");
    // In its own bounds, it is centered and has the size.
    let alone = cloth(&parts, "Left", false, Some(0.7));
    assert_eq!(box_of(&alone), (Vec3::splat(-0.35), Vec3::splat(0.35)));
}

#[test]
fn parts_that_are_too_far_away_or_too_small_in_their_bounds_are_refused() {
    let text = obj("o Near\n{}") + "o Far\nv 5000 0 0\nv 5000 1 0\nv 5000 0 1\nf -3 -2 -1\n";
    let parts = parts("far.obj", &text);
    for (name, size, expected) in [
        ("Far", None, "is 2500 m from the center of its bounds"),
        (
            "Near",
            Some(1e-5),
            "0.00001 m, with 0.000000002 m for this mesh",
        ),
    ] {
        let options = BuildOptions {
            size,
            bounds: Some(parts.bounds()),
            treatment: Treatment::Shell,
            ..BuildOptions::default()
        };
        let error = build(parts.part(name).expect(name), &options).expect_err(name);
        let error = error.to_string();
        assert!(error.contains(expected), "{error}");
    }
    let near = parts.bounds();
    for bounds in [
        Bounds { size: 0.0, ..near },
        Bounds {
            size: f64::INFINITY,
            ..near
        },
        Bounds {
            center: DVec3::new(f64::NAN, 0.0, 0.0),
            ..near
        },
    ] {
        let options = BuildOptions {
            size: Some(1.0),
            bounds: Some(bounds),
            treatment: Treatment::Shell,
            ..BuildOptions::default()
        };
        let error = build(parts.part("Near").expect("a part"), &options).expect_err("no bounds");
        assert!(
            error.to_string().contains("finite and larger than 0"),
            "{error}"
        );
    }
}

/// A folder with the table, removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let folder =
            std::env::temp_dir().join(format!("pliant-parts-{test}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        fs::write(folder.join("table.gltf"), table()).expect("a file");
        fs::write(folder.join("t.bin"), beside("t.bin").expect("a buffer")).expect("a file");
        Self(folder)
    }

    fn scene(&self, mesh: &str, collider: &str) -> Scene {
        let text = format!(
            "Scene(title: \"A table\", look_at: \"It stands.\", bodies: [\
             (name: \"left\", mesh: (file: \"table.gltf\", {mesh}), position: (0, 1, 0)),\
             (name: \"plate\", mesh: (file: \"table.gltf\", part: \"Plate\", treatment: Shell))],\
             colliders: [(shape: Mesh(file: \"table.gltf\", {collider}))],\
             acceptance: (seconds: 1, checks: []))"
        );
        let mut scene: Scene = text.parse().expect("a scene");
        scene.folder.clone_from(&self.0);
        scene
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn low_of(body: &Body) -> Vec3 {
    let positions = body.particles.positions.iter().map(|p| p.truncate());
    positions.reduce(Vec3::min).expect("a body")
}

const LEFT: &str = "part: \"Left\", treatment: Shell";

#[test]
fn bodies_and_colliders_of_a_scene_are_parts_in_their_places() {
    let folder = Folder::new("scene");
    let scene = folder.scene(LEFT, "part: \"Legs\", size: 14");
    let built = scene.build().expect("it builds");
    let low = low_of(&built.world.bodies[0]);
    assert_eq!(low, Vec3::new(-2.5, -2.5, -1.0), "1 m above its place");
    let mesh = built.world.colliders[0].shape.mesh().expect("a mesh");
    let x = mesh.vertices().iter().map(|p| p.x);
    let high = x.fold(f32::NEG_INFINITY, f32::max);
    assert_eq!(high, 5.0, "twice as large as the file");
    // Alone.
    let scene = folder.scene(
        &format!("{LEFT}, bounds: Part, size: 0.2"),
        "part: \"Legs\"",
    );
    let built = scene.build().expect("it builds");
    let low = low_of(&built.world.bodies[0]);
    assert!(low.distance(Vec3::new(-0.1, 0.9, -0.1)) < 1e-6, "{low}");
}

#[test]
fn a_scene_suggests_the_part_that_was_meant() {
    let folder = Folder::new("suggestion");
    let scene = folder.scene("part: \"left\"", "part: \"Legs\"");
    let message = scene.build().expect_err("unknown").to_string();
    assert!(message.contains("body “left”"), "{message}");
    assert!(
        message.ends_with("“Leg” (did you mean “Left”?)"),
        "{message}"
    );
    let scene = folder.scene(LEFT, "part: \"Lges\"");
    let message = scene.build().expect_err("unknown").to_string();
    assert!(message.contains("collider 1: "), "{message}");
    assert!(message.ends_with("(did you mean “Legs”?)"), "{message}");
}

#[test]
fn a_saved_scene_keeps_its_parts() {
    let folder = Folder::new("save");
    let mesh = format!("{LEFT}, bounds: Part, size: 0.2");
    let scene = folder.scene(&mesh, "part: \"Legs\", bounds: Part");
    let built = scene.build().expect("it builds");
    let elsewhere = folder.0.join("saved");
    let saved = Definition::new(&scene, &built).save(&built, &elsewhere);
    let text = saved.expect("it can be saved").scene.to_text();
    let again: Scene = text.expect("a text").parse().expect("it reads back");
    let spec = again.bodies[0].mesh.as_ref().expect("a mesh");
    assert_eq!(
        spec,
        &MeshSpec {
            file: spec.file.clone(),
            part: Some("Left".into()),
            bounds: PartBounds::Part,
            size: Some(0.2),
            cells: None,
            treatment: Treatment::Shell,
        }
    );
    let rebuilt = again.build().expect("it builds");
    assert_eq!(rebuilt.world.colliders, built.world.colliders);
    for (body, other) in rebuilt.world.bodies.iter().zip(&built.world.bodies) {
        assert_eq!(body.particles.positions, other.particles.positions);
    }
}
