//! Corrupted mesh files of every format: any bytes give a mesh or an error that names the file,
//! without a panic, and with memory in proportion to the file.

use crate::fuzz_support::{Edit, broken, edits, fuzz, in_proportion};
use crate::mesh_groups;
use crate::mesh_read::binary_gmsh;
use pliant::mesh::{
    BuildOptions, FileMesh, MeshError, SoftMesh, SurfaceMesh, Treatment, build, read,
};
use proptest::prelude::*;
use std::io;

const TEXTS: [(&str, &str); 6] = [
    (
        "a.obj",
        "o A\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng b c\nf 1 3 2\nf 1 2 4\no A b\nf -4/1 -1//2 3/1/1\ng\nf 2 3 4\nl 1 2\n",
    ),
    (
        "a.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n2\n1 2 1 0 1 2 3\n2 4 1 0 1 2 3 4\n$EndElements\n",
    ),
    (
        "b.msh",
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n",
    ),
    (
        "a.mesh",
        "MeshVersionFormatted 1\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nCorners 1\n1\nTetrahedra 1\n1 2 3 4 0\nEnd\n",
    ),
    ("a.node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n"),
    (
        "a.gltf",
        r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"name":"A","children":[1]},{"name":"B","mesh":0}],"meshes":[{"name":"C","primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":36,"byteStride":12},{"buffer":0,"byteOffset":36,"byteLength":3}],"buffers":[{"uri":"b.bin","byteLength":39}]}"#,
    ),
];
const ELE: &str = "1 4 0\n0 0 1 2 3\n";

/// Three positions, then the indices 0, 1 and 2.
fn buffer() -> Vec<u8> {
    [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .chain([0, 1, 2])
        .collect()
}

/// A GLB container with a JSON chunk and the buffer.
fn glb(json: &str) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = buffer();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |number: usize| u32::try_from(number).expect("small").to_le_bytes();
    let chunk = |kind: &[u8], data: &[u8]| [&word(data.len()), kind, data].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &binary)].concat();
    [b"glTF", &word(2)[..], &word(12 + chunks.len()), &chunks].concat()
}

/// A complete file of each format. A TetGen pair is read by either name, so that both get
/// corrupted.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let texts = TEXTS.map(|(name, text)| (name, text.as_bytes().to_vec()));
    let json = TEXTS[5].1.replace("\"uri\":\"b.bin\",", "");
    let others = [("a.ele", ELE.into()), ("a.glb", glb(&json))];
    let binary = ["2.2", "4.0", "4.1"].map(|version| ("a.msh", binary_gmsh(version, false, 8)));
    let groups = mesh_groups::files().into_iter();
    let groups = groups.map(|(version, numbers)| ("a.msh", mesh_groups::cubes(version, numbers)));
    let all = texts.into_iter().chain(binary).chain(groups);
    all.chain(others).collect()
}

fn beside(name: &str) -> io::Result<Vec<u8>> {
    match name {
        "a.ele" => Ok(ELE.into()),
        "a.node" => Ok(TEXTS[4].1.into()),
        "b.bin" => Ok(buffer()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

/// Limit on the memory for reading: a constant, and bytes per byte of the file. A value of two
/// bytes in a JSON, `0,`, takes 32 bytes in memory; growing a list doubles it while the old one
/// still exists; and lists with accessors and meshes are examined in a copy.
const READING: (u64, u64) = (64 << 10, 128);

/// Limit on the memory for building from it, filled with 3 cells, or 5 with the surrounding ones:
/// 216 corners, 125 centers and 1500 tetrahedra of the lattice, each in several tables.
const BUILDING: (u64, u64) = (1 << 20, 2048);

fn read_in_proportion(name: &str, bytes: &[u8]) -> Result<FileMesh, MeshError> {
    let mesh = in_proportion(bytes.len(), READING, || read::bytes(name, bytes, &beside));
    if let Err(error) = &mesh {
        let message = error.to_string();
        let names_it = ["a.", "b."].iter().any(|file| message.contains(file));
        assert!(names_it, "no file is named: {message}");
        assert!(message.len() < 1000 + 2 * bytes.len(), "{message}");
        if let MeshError::Text { line, .. } = error {
            let lines = 1 + bytes.iter().filter(|byte| **byte == b'\n').count();
            let other = ELE.lines().count().max(TEXTS[4].1.lines().count()) + 1;
            assert!((1..=lines.max(other)).contains(line), "{message}");
        }
    }
    mesh
}

fn build_in_proportion(
    length: usize,
    mesh: FileMesh,
    treatment: Treatment,
) -> Result<SoftMesh, MeshError> {
    let options = BuildOptions {
        size: Some(1.0),
        cells: Some(3),
        treatment,
        ..BuildOptions::default()
    };
    in_proportion(length, BUILDING, || build(mesh, &options))
}

/// Reads and, if that succeeds, builds; the result of reading must be valid.
fn survives(name: &str, bytes: &[u8]) {
    let Ok(mesh) = read_in_proportion(name, bytes) else {
        return;
    };
    is_valid(&mesh);
    for treatment in [Treatment::Fill, Treatment::Shell] {
        if let Ok(body) = build_in_proportion(bytes.len(), mesh.clone(), treatment) {
            assert!(body.shape.vertices.iter().all(|p| p.is_finite()));
        }
    }
    let parts = read::Parts::of_bytes(name, bytes, &beside).expect("it can be read");
    assert_eq!(parts.whole(), &mesh);
    for part in parts.names() {
        let part = parts.part(part).expect("a part with a mesh");
        assert!(!part.vertices().is_empty());
        is_valid(&part);
    }
}

fn is_valid(mesh: &FileMesh) {
    let vertices = mesh.vertices();
    let indices: Vec<u32> = match mesh {
        FileMesh::Surface(it) => it.triangles.iter().flatten().copied().collect(),
        FileMesh::Tetrahedra(it) => it.tetrahedra.iter().flatten().copied().collect(),
        FileMesh::Curves(it) => it.segments.iter().flatten().copied().collect(),
    };
    assert!(vertices.iter().all(|p| p.is_finite()));
    assert!(indices.iter().all(|i| (*i as usize) < vertices.len()));
}

#[test]
fn the_files_are_valid_before_they_are_corrupted() {
    for (name, file) in files() {
        read::bytes(name, &file, &beside).expect(name);
    }
}

#[test]
fn every_file_survives_being_cut_anywhere() {
    for (name, file) in files() {
        for end in 0..file.len() {
            survives(name, &file[..end]);
        }
    }
}

#[test]
fn a_broken_mesh_file_is_a_mesh_or_an_error_that_names_it() {
    let files = files();
    let values = (0..files.len(), edits());
    fuzz("mesh files", 20_000, &values, |(which, edits)| {
        let (name, file) = &files[which];
        survives(name, &broken(file, &edits));
    });
}

/// The binary parts of a GLB container: lengths, kinds, positions, indices.
#[test]
fn a_broken_container_is_a_mesh_or_an_error_that_names_it() {
    let (name, file) = files().pop().expect("the last is a GLB");
    let values = prop::collection::vec(any::<(prop::sample::Index, u32)>(), 1..3);
    fuzz("containers", 500, &values, |edits| {
        let edits = edits.into_iter().map(|(at, to)| Edit::Binary(at, to));
        survives(name, &broken(&file, &edits.collect::<Vec<_>>()));
    });
}

/// A glTF scene may reference one mesh many times, and primitives may share data: a file of m nodes
/// and n vertices represents m · n vertices.
#[test]
fn a_mesh_with_too_many_instances_is_refused_before_it_fills_memory() {
    let vertices = 3999;
    let nodes = 8000;
    let list = |item: &dyn Fn(usize) -> String| {
        let items: Vec<String> = (0..nodes).map(item).collect();
        items.join(",")
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],"bufferViews":[{{"buffer":0,"byteLength":{length}}}],"buffers":[{{"uri":"b.bin","byteLength":{length}}}]}}"#,
        list(&|node| node.to_string()),
        list(&|_| "{\"mesh\":0}".into()),
        length = 12 * vertices,
    );
    let read = || {
        read::bytes("many.gltf", json.as_bytes(), &|_| {
            Ok(vec![0; 12 * vertices])
        })
    };
    let error = in_proportion(json.len() + 12 * vertices, (300 << 20, 128), read)
        .expect_err("32 million vertices");
    let message = error.to_string();
    for part in ["many.gltf", "mesh 0, primitive 0", "vertices"] {
        assert!(message.contains(part), "“{part}” is not in “{message}”");
    }
}

/// Unused vertices and duplicate elements take no more memory than others.
#[test]
fn repeated_elements_are_built_with_memory_in_proportion() {
    let mut mesh = SurfaceMesh::default();
    let FileMesh::Surface(one) =
        read::bytes("a.obj", TEXTS[0].1.as_bytes(), &beside).expect("whole")
    else {
        panic!("an OBJ file is a surface");
    };
    for _ in 0..5000 {
        let first = u32::try_from(mesh.vertices.len()).expect("few");
        mesh.vertices.extend(&one.vertices);
        let triangles = one.triangles.iter();
        mesh.triangles
            .extend(triangles.map(|t| t.map(|i| first + i)));
    }
    let length = mesh.vertices.len() * 24 + mesh.triangles.len() * 12;
    for treatment in [Treatment::Fill, Treatment::Shell] {
        // Whether it can be built is irrelevant here.
        let _ = build_in_proportion(length, FileMesh::Surface(mesh.clone()), treatment);
    }
}
