//! Broken files: whatever the bytes, a mesh or an error, never a panic.

use std::io;

use pliant::mesh::{BuildOptions, FileMesh, Treatment, build, read};
use proptest::prelude::*;

const VALID: [(&str, &str); 6] = [
    (
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf -4/1 -1//2 3/1/1\nf 2 3 4\n",
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
        r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":36,"byteStride":12},{"buffer":0,"byteOffset":36,"byteLength":3}],"buffers":[{"uri":"b.bin","byteLength":39}]}"#,
    ),
];
const ELE: &str = "1 4 0\n0 0 1 2 3\n";

/// What files are made of, and what breaks them.
const WORDS: [&str; 14] = [
    "-1",
    "0",
    "1",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "1e308",
    "-1e-310",
    "nan",
    "\\\n",
    "#",
    "\n",
    "\"",
    "é",
];

fn beside(name: &str) -> io::Result<Vec<u8>> {
    match name {
        "a.ele" => Ok(ELE.into()),
        // Three positions, then the indices 0, 1 and 2.
        "b.bin" => Ok([0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .chain([0, 1, 2])
            .collect()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

/// Reads and, if that works, builds; the result of reading must be sound.
fn survives(name: &str, bytes: &[u8]) {
    let Ok(mesh) = read::bytes(name, bytes, &beside) else {
        return;
    };
    let (vertices, indices): (_, Vec<u32>) = match &mesh {
        FileMesh::Surface(m) => (&m.vertices, m.triangles.iter().flatten().copied().collect()),
        FileMesh::Tetrahedra(m) => (
            &m.vertices,
            m.tetrahedra.iter().flatten().copied().collect(),
        ),
    };
    assert!(vertices.iter().all(|p| p.is_finite()));
    assert!(indices.iter().all(|i| (*i as usize) < vertices.len()));
    for treatment in [Treatment::Fill, Treatment::Shell] {
        let options = BuildOptions {
            size: Some(1.0),
            cells: Some(3),
            treatment,
        };
        if let Ok(body) = build(mesh.clone(), &options) {
            assert!(body.shape.vertices.iter().all(|p| p.is_finite()));
        }
    }
}

#[test]
fn the_files_that_are_broken_here_are_whole_at_first() {
    for (name, text) in VALID {
        read::bytes(name, text.as_bytes(), &beside).expect(name);
    }
}

#[test]
fn every_file_survives_being_cut_anywhere() {
    for (name, text) in VALID {
        for end in 0..text.len() {
            survives(name, &text.as_bytes()[..end]);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_file_with_bytes_or_words_changed_never_panics(
        which in 0..VALID.len(),
        bytes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        words in prop::collection::vec((any::<prop::sample::Index>(), 0..WORDS.len()), 0..4),
        end in any::<prop::sample::Index>(),
        cut in prop::bool::weighted(0.2),
    ) {
        let (name, text) = VALID[which];
        let mut words_of: Vec<&str> = text.split_inclusive([' ', '\n', ',', ':']).collect();
        for (place, word) in words {
            let place = place.index(words_of.len());
            words_of.insert(place + 1, " ");
            words_of[place] = WORDS[word];
        }
        let mut file = words_of.concat().into_bytes();
        for (place, byte) in bytes {
            let place = place.index(file.len());
            file[place] = byte;
        }
        if cut {
            file.truncate(end.index(file.len()));
        }
        survives(name, &file);
    }
}
