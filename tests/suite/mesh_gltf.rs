//! glTF and GLB: buffers, transforms, and positions of errors.

use std::io;

use glam::DVec3;
use pliant::mesh::{FileMesh, MeshError, SurfaceMesh, read, surface_volume};

/// A tetrahedron: four positions (48 bytes), then twelve indices of two bytes (24 bytes).
fn buffer() -> Vec<u8> {
    let positions = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let indices = [0_u16, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let positions = positions.iter().flatten().flat_map(|x| x.to_le_bytes());
    positions
        .chain(indices.iter().flat_map(|i| i.to_le_bytes()))
        .collect()
}

/// The tetrahedron as JSON; `uri` is the buffer's `uri` entry with a trailing comma.
fn json(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"translation":[10,0,0],"children":[1]}},{{"mesh":0,"scale":[2,2,2]}}],
"meshes":[{{"name":"Body","primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],
"buffers":[{{{uri}"byteLength":72}}]}}"#
    )
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |three: &[u8]| {
        let bits = three.iter().fold(0, |bits, b| bits << 8 | u32::from(*b));
        [18, 12, 6, 0].map(|shift| LETTERS[(bits >> shift & 63) as usize] as char)
    };
    // The buffer's length is a multiple of three.
    bytes.chunks_exact(3).flat_map(group).collect()
}

fn with_data_uri() -> String {
    let data = base64(&buffer());
    json(&format!(
        r#""uri":"data:application/octet-stream;base64,{data}","#
    ))
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((length as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

fn beside(name: &str) -> io::Result<Vec<u8>> {
    match name {
        "my buffer.bin" => Ok(buffer()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

fn parse(name: &str, bytes: impl AsRef<[u8]>) -> Result<FileMesh, MeshError> {
    read::bytes(name, bytes.as_ref(), &beside)
}

fn surface(name: &str, bytes: impl AsRef<[u8]>) -> SurfaceMesh {
    match parse(name, bytes) {
        Ok(FileMesh::Surface(surface)) => surface,
        other => panic!("{name} is no surface: {other:?}"),
    }
}

#[test]
fn buffers_are_found_in_the_text_in_the_glb_and_beside() {
    let escaped = json(r#""uri":"my%20buffer.bin","#);
    for mesh in [
        surface("a.gltf", with_data_uri()),
        surface("a.glb", glb(&json(""), &buffer())),
        surface("a.gltf", escaped),
    ] {
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
        // Scaled by two in its own node, then moved by ten in the parent node.
        let far = DVec3::X * 10.0;
        let expected = [
            far,
            far + DVec3::X * 2.0,
            far + DVec3::Y * 2.0,
            far + DVec3::Z * 2.0,
        ];
        assert_eq!(mesh.vertices, expected);
    }
}

#[test]
fn a_mirrored_node_keeps_triangles_facing_outwards() {
    let mirrored = with_data_uri().replace("[2,2,2]", "[-2,2,2]");
    let mesh = surface("a.gltf", mirrored);
    // 8/6, from eight times the volume of a unit corner.
    assert!((surface_volume(&mesh.vertices, &mesh.triangles) - 8.0 / 6.0).abs() < 1e-12);
}

#[test]
fn a_mesh_with_two_nodes_is_loaded_twice() {
    let twice = with_data_uri()
        .replace(r#""nodes":[0]"#, r#""nodes":[0,2]"#)
        .replace(r#""scale":[2,2,2]}]"#, r#""scale":[2,2,2]},{"mesh":0}]"#);
    let mesh = surface("a.gltf", twice);
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (8, 8));
    assert_eq!(mesh.triangles[4], [4, 6, 5]);
}

#[test]
fn strips_fans_and_bare_positions_are_triangles_too() {
    let with = |more: &str| {
        let text = with_data_uri().replace(r#""indices":1}"#, &format!("{more}}}"));
        surface("a.gltf", text).triangles
    };
    assert_eq!(with(r#""mode":5"#), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(with(r#""mode":6"#), [[0, 1, 2], [0, 2, 3]]);
    let text = with_data_uri().replace(
        r#""indices":1}"#,
        r#""mode":1},{"attributes":{"POSITION":0},"indices":1}"#,
    );
    let mesh = surface("a.gltf", text);
    assert_eq!(mesh.triangles.len(), 4);
    assert!(
        mesh.notes[0].contains("primitives of points or lines ignored: 1"),
        "{:?}",
        mesh.notes
    );
}

#[test]
fn gltf_errors_name_the_mesh_and_the_primitive() {
    let text = with_data_uri();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    let mut nan = buffer();
    nan[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut wild = buffer();
    wild[50] = 77;
    for (bytes, place, part) in [
        (String::new().into_bytes(), "the JSON", ""),
        (b"{}".to_vec(), "the JSON", ""),
        (
            with(r#""count":12"#, r#""count":11"#).into(),
            "mesh 0 'Body', primitive 0",
            "11 indices",
        ),
        (
            with(r#""count":12"#, r#""count":4000000000"#).into(),
            "mesh 0 'Body', primitive 0",
            "accessor 1 says 4000000000 items",
        ),
        (
            with(
                r#""byteOffset":48,"byteLength":24"#,
                r#""byteOffset":4000000000,"byteLength":4000000000"#,
            )
            .into(),
            "mesh 0 'Body', primitive 0",
            "not in its buffer",
        ),
        (
            with(r#""componentType":5123"#, r#""componentType":5126"#).into(),
            "mesh 0 'Body', primitive 0",
            "not unsigned whole numbers",
        ),
        (with(r#""POSITION":0"#, r#""NORMAL":0"#).into(), "", ""),
        (
            with("byteLength\":72", "byteLength\":73").into(),
            "buffer 0",
            "has 72 bytes; expected 73",
        ),
        (with("base64,", "base64,!").into(), "buffer 0", "base64"),
        (
            with(r#""children":[1]"#, r#""children":[1,1]"#).into(),
            "node 1",
            "a tree",
        ),
        (
            with(r#""children":[1]"#, r#""children":[0]"#).into(),
            "node 0",
            "a tree",
        ),
        (
            with(r#""mesh":0,"#, "").into(),
            "the scene",
            "no triangles: no node of it shows a mesh, of 1 in the file",
        ),
        (
            with(r#""indices":1"#, r#""indices":1,"mode":0"#).into(),
            "the scene",
            "no triangles: only points or lines, in 1 of its primitives",
        ),
        (
            br#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"Camera"}]}"#.to_vec(),
            "the scene",
            "no triangles: the file has no meshes",
        ),
        (
            with(
                r#"{"asset""#,
                r#"{"extensionsRequired":["KHR_draco_mesh_compression"],"asset""#,
            )
            .into(),
            "",
            "KHR_draco_mesh_compression",
        ),
        (
            json(r#""uri":"../secret","#).into(),
            "buffer 0",
            "'../secret'",
        ),
        (
            json(r#""uri":"http://x/y","#).into(),
            "buffer 0",
            "'http://x/y'",
        ),
        (
            json(r#""uri":"gone.bin","#).into(),
            "gone.bin",
            "cannot be read",
        ),
        (json("").into(), "buffer 0", "no binary data"),
        (
            glb(&json(""), &nan),
            "mesh 0 'Body', primitive 0",
            "vertex 1 is at",
        ),
        (
            glb(&json(""), &wild),
            "mesh 0 'Body', primitive 0",
            "the index 77, but only 4 vertices",
        ),
        (
            glb(&json(""), &buffer())[..200].to_vec(),
            "the GLB container",
            "of JSON, but ends after 180",
        ),
        (
            b"glTF\x02\0\0\0".to_vec(),
            "the GLB container",
            "ends after 8 bytes",
        ),
        (
            b"glTF\x01\0\0\0".to_vec(),
            "the GLB container",
            "version 1; expected 2",
        ),
    ] {
        let error = parse("a.gltf", &bytes).expect_err(part).to_string();
        assert!(
            error.contains("a.gltf") && error.contains(place) && error.contains(part),
            "{error}"
        );
    }
}

/// The tetrahedron with something in place of a part of its text, in a GLB.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let text = json("");
    assert!(text.contains(from), "{from}");
    glb(&text.replacen(from, to, 1), &buffer())
}

#[test]
fn what_concerns_looks_and_motion_keeps_no_mesh_from_being_read() {
    let expected = surface("a.glb", glb(&json(""), &buffer()));
    let required = [
        "KHR_lights_punctual",
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "KHR_materials_unlit",
        "KHR_animation_pointer",
        "KHR_mesh_quantization",
    ];
    for name in required {
        let extensions =
            format!(r#"{{"extensionsUsed":["{name}"],"extensionsRequired":["{name}"],"asset""#);
        let found = surface("a.glb", changed(r#"{"asset""#, &extensions));
        assert_eq!(found, expected, "{name}");
    }
    for (from, to) in [
        (
            r#""POSITION":0"#,
            r#""POSITION":0,"_TEMPERATURE":0,"NORMAL":99"#,
        ),
        (r#""indices":1"#, r#""indices":1,"material":7"#),
        (r#","min":[0,0,0],"max":[1,1,1]"#, ""),
        (
            r#"{"asset""#,
            r#"{"textures":[{}],"materials":[{"alphaMode":"x"}],"asset""#,
        ),
        (
            r#"{"asset""#,
            r#"{"animations":[{"channels":[{"sampler":9,"target":{"path":"pointer"}}],"samplers":[]}],"asset""#,
        ),
        (r#""mesh":0,"#, r#""mesh":0,"skin":3,"camera":4,"#),
    ] {
        assert_eq!(surface("a.glb", changed(from, to)), expected, "{to}");
    }
}

#[test]
fn compressed_meshes_are_refused_with_the_name_of_the_compression() {
    for (name, words) in [
        ("KHR_draco_mesh_compression", "Draco"),
        ("EXT_meshopt_compression", "Meshopt"),
        ("KHR_meshopt_compression", "Meshopt"),
        ("VENDOR_everything_else", "not known"),
    ] {
        let extensions = format!(r#"{{"extensionsRequired":["{name}"],"asset""#);
        let error = parse("a.glb", changed(r#"{"asset""#, &extensions)).expect_err(name);
        let error = error.to_string();
        assert!(error.contains(name) && error.contains(words), "{error}");
        assert!(error.contains("export it without"), "{error}");
    }
}

/// Positions in whole numbers of 8 and 16 bits, each as they are and as fractions.
#[test]
fn quantized_positions_are_read_in_every_encoding() {
    for (component, width, most) in [
        (5120, 1, 127),
        (5121, 1, 255),
        (5122, 2, 32767),
        (5123, 2, 65535),
    ] {
        for normalized in [false, true] {
            let stored: i64 = if normalized { most } else { 50 };
            let mut binary = Vec::new();
            for corner in [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]] {
                // A vertex begins at a multiple of four bytes.
                for number in corner.into_iter().chain([0]) {
                    let bytes = (number * stored).to_le_bytes();
                    binary.extend_from_slice(&bytes[..width]);
                }
            }
            let stride = 4 * width;
            let indices = [0_u16, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
            binary.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
            let text = format!(
                r#"{{"extensionsRequired":["KHR_mesh_quantization"],"asset":{{"version":"2.0"}},
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":{component},"normalized":{normalized},"count":4,"type":"VEC3"}},
{{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":{},"byteStride":{stride}}},{{"buffer":0,"byteOffset":{},"byteLength":24}}],
"buffers":[{{"byteLength":{}}}]}}"#,
                4 * stride,
                4 * stride,
                binary.len(),
            );
            let found = surface("a.glb", glb(&text, &binary));
            let side: f64 = if normalized { 1.0 } else { 50.0 };
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|it| it * side);
            assert_eq!(found.vertices, corners, "{component}, {normalized}");
        }
    }
}
