//! Mesh files in text formats: accepted input, and positions of errors.

use std::io;

use glam::{DVec3, Vec3};
use pliant::mesh::{BuildOptions, FileMesh, MeshError, SurfaceMesh, TetMesh, build, read};
use pliant::scene::asset;

fn nothing(_: &str) -> io::Result<Vec<u8>> {
    Err(io::ErrorKind::NotFound.into())
}

fn parse(name: &str, text: &str) -> Result<FileMesh, MeshError> {
    read::bytes(name, text.as_bytes(), &nothing)
}

fn surface(name: &str, text: &str) -> SurfaceMesh {
    match parse(name, text) {
        Ok(FileMesh::Surface(surface)) => surface,
        other => panic!("{name} is no surface: {other:?}"),
    }
}

fn tetrahedra(name: &str, text: &str) -> TetMesh {
    match parse(name, text) {
        Ok(FileMesh::Tetrahedra(mesh)) => mesh,
        other => panic!("{name} holds no tetrahedra: {other:?}"),
    }
}

/// Each text must be rejected at the given line, with all the parts in the message.
fn refused(name: &str, cases: &[(&str, usize, &[&str])]) {
    for (text, line, parts) in cases {
        let error = parse(name, text).expect_err(text).to_string();
        let place = format!("{name}:{line}: ");
        assert!(
            error.starts_with(&place),
            "{error}\nshould start with {place} in\n{text}"
        );
        for part in *parts {
            assert!(error.contains(part), "{error}\nshould contain {part}");
        }
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn obj_faces_are_read_in_all_their_forms() {
    for face in [
        "1 2 3",
        "1/9 2/9 3/9",
        "1//9 2//9 3//9",
        "1/9/9 2/9/9 3/9/9",
        "-3 -2 -1",
        "1 \\\n2 3",
    ] {
        let text =
            format!("# a comment\nmtllib x\n{TRIANGLE}vn 0 0 1\ng a b\nf {face} # end\ns 1\n");
        let mesh = surface("a.obj", &text);
        assert_eq!(mesh.triangles, [[0, 1, 2]], "{face}");
        assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    }
}

#[test]
fn obj_polygons_are_split_and_lines_noted() {
    let mesh = surface(
        "a.OBJ",
        &format!("{TRIANGLE}v 1 1 0\nv 2 2 0 1\nf 1 2 5 4 3\nl 1 2\n"),
    );
    assert_eq!(mesh.triangles, [[0, 1, 4], [0, 4, 3], [0, 3, 2]]);
    assert_eq!(mesh.notes.len(), 1);
}

/// A file of lines without faces: each line is a curve, and coincident vertices are joined. A
/// closed curve repeats its first vertex.
#[test]
fn obj_lines_without_faces_become_ropes() {
    let text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 0 0\nv 2 2 0\nl 1 2 3\nl 5 -2 4\n";
    let Ok(FileMesh::Curves(curves)) = parse("a.obj", text) else {
        panic!("no curves");
    };
    assert_eq!(curves.segments, [[0, 1], [1, 2], [4, 3], [3, 3]]);
    let body = build(FileMesh::Curves(curves), &BuildOptions::default()).expect("a rope");
    let shape = body.shape;
    assert_eq!(shape.edges, [[0, 1], [1, 2], [2, 0]]);
    assert_eq!(
        shape.vertices,
        [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]].map(Vec3::from)
    );
    assert!(shape.triangles.is_empty() && shape.tetrahedra.is_empty());
    assert_eq!(body.notes.len(), 2, "{:?}", body.notes);
}

#[test]
fn obj_errors_point_at_the_word() {
    let t = TRIANGLE;
    refused(
        "bad.obj",
        &[
            ("", 1, &["an empty file"]),
            (" \n\n", 1, &["an empty file"]),
            (
                "v 0 0 0\n",
                1,
                &["the end of the file", "1 vertex, and neither"],
            ),
            (
                "# star\nmtllib star.mtl\no star\n",
                3,
                &["a face (f", "a line (l", "no vertices (v)"],
            ),
            (
                &format!("{t}p 1\np 2\n"),
                5,
                &["3 vertices, and neither", "2 of points, curves or patches"],
            ),
            ("v 0 0\nv 1 0 0\n", 2, &["'v'", "the z coordinate"]),
            ("v 0 zero 0\n", 1, &["'zero'", "the y coordinate", "finite"]),
            ("\nv 0 nan 0\n", 2, &["'nan'", "finite"]),
            ("v 0 1e999 0\n", 1, &["'1e999'", "finite"]),
            ("v inf 0 0\n", 1, &["'inf'"]),
            (
                &format!("{t}f 1 2 4\n"),
                4,
                &["'4'", "a vertex from 1 to 3"],
            ),
            (&format!("{t}f 1 2 0\n"), 4, &["'0'", "from 1 to 3"]),
            (&format!("{t}f 1 2 -4\n"), 4, &["'-4'", "from -3 to -1"]),
            (&format!("{t}f 1 2 x/1\n"), 4, &["'x/1'"]),
            (
                &format!("{t}l 1\n"),
                4,
                &["'l'", "two vertices or more", "one has 1"],
            ),
            (
                &format!("{t}f 1 2\n"),
                4,
                &["'f'", "three vertices or more", "2"],
            ),
            (
                &format!("{t}f 1 2 99999999999999999999\n"),
                4,
                &["from 1 to 3"],
            ),
            (&format!("{t}f 1 2 \\"), 4, &["the end of the file"]),
        ],
    );
}

#[test]
fn text_in_latin_1_is_read_and_what_is_no_text_is_found_by_line() {
    let text = b"# Stra\xdfenbahn\no K\xf6rper\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let read = read::bytes("a.obj", text, &nothing).expect("a triangle with a comment");
    assert!(matches!(read, FileMesh::Surface(mesh) if mesh.triangles.len() == 1));
    for (text, wrong) in [
        (&b"v 0 0 0\nv 0 0 \xff\n"[..], "2: found '\u{ff}'"),
        (b"v 0 0 0\nv 0 0 \0\n", "2: found the byte 0x00"),
        (b"\xff\xfev\0 \0", "1: found text in UTF-16"),
    ] {
        let error = read::bytes("a.obj", text, &nothing).expect_err("no text");
        let error = error.to_string();
        assert!(error.starts_with(&format!("a.obj:{wrong}")), "{error}");
    }
}

const MSH_2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"a\"\n$EndPhysicalNames\n\
    $Nodes\n4\n7 0 0 0\n8 1 0 0\n9 0 1 0\n1000000 0 0 1\n$EndNodes\n\
    $Elements\n3\n1 15 2 0 1 7\n2 2 2 0 1 7 8 9\n3 4 2 0 1 7 8 9 1000000\n$EndElements\n";
const MSH_4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
    $Nodes\n2 4 7 1000000\n0 1 0 1\n7\n0 0 0\n3 1 1 3\n8\n9\n1000000\n1 0 0 0.5 0 0\n0 1 0 0 0.5 0\n0 0 1 0 0 0.5\n$EndNodes\n\
    $Elements\n2 2 1 2\n2 1 2 1\n1 7 8 9\n3 1 4 1\n2 7 8 9 1000000\n$EndElements\n";

#[test]
fn gmsh_2_2_and_4_1_are_read_with_sparse_numbers() {
    for text in [MSH_2, MSH_4] {
        let mesh = tetrahedra("a.msh", text);
        assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
        assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
    }
}

#[test]
fn gmsh_without_tetrahedra_is_a_surface_and_higher_orders_give_their_corners() {
    let text = MSH_2.replace("3 4 2 0 1 7 8 9 1000000", "3 3 0 7 8 9 1000000");
    assert_eq!(
        surface("a.msh", &text).triangles,
        [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    );
    let ten = MSH_2.replace(
        "3 4 2 0 1 7 8 9 1000000",
        "3 11 0 7 8 9 1000000 7 7 7 7 7 7",
    );
    let mesh = tetrahedra("a.msh", &ten);
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
    assert!(mesh.notes[0].contains("higher-order"), "{:?}", mesh.notes);
}

#[test]
fn gmsh_errors_point_at_the_word() {
    let in_2 = |from: &str, to: &str| MSH_2.replacen(from, to, 1);
    let in_4 = |from: &str, to: &str| MSH_4.replacen(from, to, 1);
    let cut = |text: &str, at: &str| text[..text.find(at).expect(at)].to_owned();
    refused(
        "bad.msh",
        &[
            ("", 1, &["an empty file"]),
            ("solid x\n", 1, &["'solid'", "$MeshFormat"]),
            (
                &in_2("2.2 0 8", "1.0 0 8"),
                2,
                &["'1.0'", "2.2, 4.0 or 4.1"],
            ),
            (&in_2("2.2 0 8", "2.2 2 8"), 2, &["'2'", "for binary"]),
            (
                &in_2("8 1 0 0", "8 1 0 nan"),
                11,
                &["'nan'", "the z coordinate"],
            ),
            (
                &in_2("8 1 0 0", "7 1 0 0"),
                11,
                &["'7'", "not given before"],
            ),
            (
                &in_2("7 8 9 1000000", "7 8 9 10"),
                19,
                &["'10'", "in $Nodes"],
            ),
            (
                &in_2("$Nodes\n4", "$Nodes\n4000000000"),
                14,
                &["'$EndNodes'", "the number of a node"],
            ),
            (
                &in_2("$Nodes\n4", "$Nodes\n-4"),
                9,
                &["'-4'", "the number of nodes"],
            ),
            (
                &in_2("$Nodes\n4", "$Nodes\n3"),
                13,
                &["'1000000'", "$EndNodes"],
            ),
            (
                &in_2("$Elements\n3", "$Elements\n4000000000"),
                20,
                &["'$EndElements'"],
            ),
            (
                &cut(MSH_2, "0 1 7 8 9 1000000"),
                19,
                &["the end of the file"],
            ),
            (
                &cut(MSH_2, "$Elements"),
                14,
                &["the end of the file", "$Elements"],
            ),
            (
                &cut(MSH_2, "$EndPhysicalNames"),
                6,
                &["the end of the file", "$EndPhysicalNames"],
            ),
            (
                &in_4("3 1 1 3", "3 1 1 4000000000"),
                13,
                &["'0'", "a node that was not given before"],
            ),
            (
                &in_4("3 1 4 1", "3 1 4 2"),
                23,
                &["'$EndElements'", "the number of an element"],
            ),
            (
                &in_4("2 7 8 9 1000000", "2 7 8 9"),
                23,
                &["'$EndElements'", "the number of a node"],
            ),
            (
                &cut(MSH_4, "0 0 1 0 0 0.5"),
                14,
                &["the end of the file", "the x coordinate"],
            ),
        ],
    );
    let only_hexahedra = in_2(
        "2 2 2 0 1 7 8 9\n3 4 2 0 1 7 8 9 1000000",
        "2 5 0 7 8 9 7 7 8 9 7\n3 15 0 7",
    );
    refused(
        "bad.msh",
        &[(
            &only_hexahedra,
            20,
            &["tetrahedra or triangles", "1 of other kinds"],
        )],
    );
}

/// Numbers of a binary file of Gmsh.
#[derive(Clone, Copy)]
enum Data<'a> {
    Text(&'a str),
    Ints(&'a [i32]),
    /// Four bytes before format 4.1, in which their width is given at the top.
    Tags(&'a [i32]),
    Sizes(&'a [i32]),
    Reals(&'a [f64]),
}

/// Bytes of a file, with the order of bytes and the width of `size_t` and of tags.
fn binary(parts: &[Data], big_endian: bool, size: usize, tag: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut number = |mut little: Vec<u8>| {
        if big_endian {
            little.reverse();
        }
        bytes.extend(little);
    };
    let wide = |value: i32, width| i64::from(value).to_le_bytes()[..width].to_vec();
    for part in parts {
        match part {
            Data::Text(text) => text.bytes().for_each(|byte| number(vec![byte])),
            Data::Ints(ints) => ints.iter().for_each(|int| number(wide(*int, 4))),
            Data::Tags(tags) => tags.iter().for_each(|int| number(wide(*int, tag))),
            Data::Sizes(sizes) => sizes.iter().for_each(|int| number(wide(*int, size))),
            Data::Reals(reals) => {
                (reals.iter()).for_each(|real| number(real.to_le_bytes().to_vec()));
            }
        }
    }
    bytes
}

/// The tetrahedron of [`MSH_2`] and [`MSH_4`] in the three binary formats, beside a hexahedron, a
/// line and a section of unknown content.
pub fn binary_gmsh(version: &str, big_endian: bool, size: usize) -> Vec<u8> {
    use Data::{Ints, Reals, Sizes, Tags, Text};
    let head = format!("$MeshFormat\n{version} 1 {size}\n");
    let begin = [
        Text(&head),
        Ints(&[1]),
        Text("\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"a b\"\n$EndPhysicalNames\n$Entities\n"),
        Ints(&[-1, 0x0a24]),
        Text("\n$EndEntities\n$Nodes\n"),
    ];
    let (nodes, elements): (&[Data], &[Data]) = match version {
        "2.2" => (
            &[
                Text("4\n"),
                Ints(&[7]),
                Reals(&[0.0, 0.0, 0.0]),
                Ints(&[8]),
                Reals(&[1.0, 0.0, 0.0]),
                Ints(&[9]),
                Reals(&[0.0, 1.0, 0.0]),
                Ints(&[1_000_000]),
                Reals(&[0.0, 0.0, 1.0]),
            ],
            &[
                Text("4\n"),
                Ints(&[1, 2, 2, 1, -5, 5, 7, 8, 2, 5, 5, 8, 9]),
                Ints(&[5, 1, 0, 3, 7, 8, 9, 7, 7, 8, 9, 7]),
                Ints(&[4, 1, 1, 4, 5, 7, 8, 9, 1_000_000]),
            ],
        ),
        "4.0" => (
            &[
                Sizes(&[2, 4]),
                Ints(&[-1, 0, 0]),
                Sizes(&[1]),
                Ints(&[7]),
                Reals(&[0.0, 0.0, 0.0]),
                Ints(&[1, 2, 1]),
                Sizes(&[3]),
                Ints(&[8]),
                Reals(&[1.0, 0.0, 0.0, 0.5, 0.5]),
                Ints(&[9]),
                Reals(&[0.0, 1.0, 0.0, 0.5, 0.5]),
                Ints(&[1_000_000]),
                Reals(&[0.0, 0.0, 1.0, 0.5, 0.5]),
            ],
            &[
                Sizes(&[2, 2]),
                Ints(&[1, 3, 5]),
                Sizes(&[1]),
                Tags(&[3, 7, 8, 9, 7, 7, 8, 9, 7]),
                Ints(&[1, 3, 4]),
                Sizes(&[1]),
                Tags(&[4, 7, 8, 9, 1_000_000]),
            ],
        ),
        _ => (
            &[
                Sizes(&[2, 4, 7, 1_000_000]),
                Ints(&[0, -1, 0]),
                Sizes(&[1, 7]),
                Reals(&[0.0, 0.0, 0.0]),
                Ints(&[3, 1, 1]),
                Sizes(&[3, 8, 9, 1_000_000]),
                Reals(&[1.0, 0.0, 0.0, 0.5, 0.5, 0.5]),
                Reals(&[0.0, 1.0, 0.0, 0.5, 0.5, 0.5]),
                Reals(&[0.0, 0.0, 1.0, 0.5, 0.5, 0.5]),
            ],
            &[
                Sizes(&[2, 2, 3, 4]),
                Ints(&[3, 1, 5]),
                Sizes(&[1]),
                Tags(&[3, 7, 8, 9, 7, 7, 8, 9, 7]),
                Ints(&[3, 1, 4]),
                Sizes(&[1]),
                Tags(&[4, 7, 8, 9, 1_000_000]),
            ],
        ),
    };
    let between = [Text("\n$EndNodes\n$Elements\n")];
    let parts = [
        &begin,
        nodes,
        &between,
        elements,
        &[Text("\n$EndElements\n")],
    ]
    .concat();
    let tag = if version == "4.1" { size } else { 4 };
    binary(&parts, big_endian, size, tag)
}

#[test]
fn binary_gmsh_files_of_each_version_and_order_of_bytes_are_read() {
    for (version, size) in [("2.2", 8), ("4.0", 8), ("4.1", 8), ("4.1", 4)] {
        for big_endian in [false, true] {
            let bytes = binary_gmsh(version, big_endian, size);
            match read::bytes("a.msh", &bytes, &nothing) {
                Ok(FileMesh::Tetrahedra(mesh)) => {
                    assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
                    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
                    assert_eq!(mesh.notes.len(), 1, "{:?}", mesh.notes);
                }
                other => panic!("{version}, big endian {big_endian}, {size}: {other:?}"),
            }
        }
    }
}

#[test]
fn errors_of_a_binary_gmsh_file_name_the_byte() {
    let error = |bytes: &[u8]| {
        let read = read::bytes("a.msh", bytes, &nothing);
        read.expect_err("damaged").to_string()
    };
    let head = b"$MeshFormat\n4.1 1 8\n";
    for (version, cut, expected) in [
        (
            "2.2",
            "$EndNodes",
            "byte 239: found the end of the file, expected $EndNodes",
        ),
        ("4.0", "\n$EndElements", "expected $EndElements"),
        (
            "4.1",
            "$EndEntities",
            "byte 104: found the end of the file, expected $EndEntities",
        ),
    ] {
        let bytes = binary_gmsh(version, false, 8);
        let place = bytes
            .windows(cut.len())
            .position(|part| part == cut.as_bytes());
        let text = error(&bytes[..place.expect(cut)]);
        assert!(
            text.starts_with("a.msh: byte ") && text.contains(expected),
            "{text}"
        );
    }
    // Cut anywhere, there is a mesh or an error; a mesh only where the elements are complete.
    let whole = binary_gmsh("4.1", true, 8);
    for end in 0..whole.len() - "$EndElements\n".len() {
        let _ = error(&whole[..end]);
    }
    for (at, to, expected) in [
        (0, 0, "a.msh:1: found the byte 0x00"),
        (12, b'5', "version 2.2, 4.0 or 4.1"),
        (16, b'2', "'2', expected 0, for text, or 1, for binary"),
        (18, b'3', "'3', expected 8, the bytes of a number"),
        (
            head.len(),
            7,
            "a.msh: byte 20: found the bytes [07, 00, 00, 00]",
        ),
    ] {
        let mut bytes = binary_gmsh("4.1", false, 8);
        bytes[at] = to;
        let text = error(&bytes);
        assert!(text.contains(expected), "{text}");
    }
    let mut bytes = binary_gmsh("4.1", false, 8);
    let nodes = bytes
        .windows(7)
        .position(|part| part == b"$Nodes\n")
        .expect("nodes")
        + 7;
    bytes[nodes..nodes + 8].copy_from_slice(&(-4_i64).to_le_bytes());
    let text = error(&bytes);
    let place = format!("a.msh: byte {nodes}: found -4, expected the number of blocks of nodes");
    assert!(text.starts_with(&place), "{text}");
}

#[test]
fn gmsh_4_0_from_windows_has_counts_of_four_bytes() {
    let bytes = binary_gmsh("4.0", false, 4);
    // The number at the top is that of a coordinate's bytes.
    let text = [
        &b"$MeshFormat\n4.0 1 8"[..],
        &bytes["$MeshFormat\n4.0 1 4".len()..],
    ]
    .concat();
    let mesh = read::bytes("a.msh", &text, &nothing).expect("a tetrahedron");
    assert!(matches!(mesh, FileMesh::Tetrahedra(mesh) if mesh.tetrahedra == [[0, 1, 2, 3]]));
}

#[test]
fn gmsh_4_0_is_read_as_text() {
    let text = "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Nodes\n2 4\n1 0 0 1\n7 0 0 0\n-1 2 1 3\n8 1 0 0 .5 .5\n\
        9 0 1 0 .5 .5\n10 0 0 1 .5 .5\n$EndNodes\n$Elements\n1 1\n1 3 4 1\n2 7 8 9 10\n$EndElements\n";
    let mesh = tetrahedra("a.msh", text);
    assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
}

const MEDIT: &str = "MeshVersionFormatted 2\n# comment\nDimension\n3\nVertices\n4\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n\
    Corners 1\n1\nTriangles 1\n1 3 2 0\nTetrahedra\n1\n1 2 3 4 0\nEnd\n";

#[test]
fn medit_is_read() {
    let mesh = tetrahedra("a.mesh", MEDIT);
    assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
    let hull = MEDIT.replace("Tetrahedra\n1\n1 2 3 4 0", "Quadrilaterals\n1\n1 2 3 4 0");
    assert_eq!(
        surface("a.mesh", &hull).triangles,
        [[0, 2, 1], [0, 1, 2], [0, 2, 3]]
    );
}

#[test]
fn medit_errors_point_at_the_word() {
    let with = |from: &str, to: &str| MEDIT.replacen(from, to, 1);
    refused(
        "bad.mesh",
        &[
            ("", 1, &["an empty file"]),
            ("Vertices\n", 1, &["'Vertices'", "MeshVersionFormatted"]),
            (&with("\n3\n", "\n2\n"), 4, &["'2'", "dimension 3"]),
            (
                &with("1 2 3 4 0", "1 2 3 5 0"),
                17,
                &["'5'", "a vertex from 1 to 4"],
            ),
            (
                &with("1 2 3 4 0", "0 2 3 4 0"),
                17,
                &["'0'", "a vertex from 1 to 4"],
            ),
            (
                &with("0 1 0 1", "0 NaN 0 1"),
                9,
                &["'NaN'", "the y coordinate"],
            ),
            (
                &with("Vertices\n4", "Vertices\n4294967296"),
                11,
                &["'Corners'", "the x coordinate"],
            ),
            (
                &with("Tetrahedra\n1", "Tetrahedra\n2"),
                18,
                &["'End'", "a vertex"],
            ),
            (
                &with("Tetrahedra\n1\n1 2 3 4 0\nEnd\n", "Tetrahedra\n1\n1 2"),
                17,
                &["the end of the file"],
            ),
            (&with("Corners 1", "7 1"), 11, &["'7'", "a section"]),
            (
                &with("Tetrahedra\n1\n1 2 3 4 0", "").replace("Triangles 1\n1 3 2 0", ""),
                15,
                &["'End'", "Tetrahedra or Triangles"],
            ),
        ],
    );
}

const NODE: &str =
    "# points\n4 3 1 1\n0 0 0 0 5.5 1\n1 1 0 0 5.5 1\n2 0 1 0 5.5 1 # third\n3 0 0 1 5.5 1\n";
const ELE: &str = "1 4 1\n0 0 1 2 3 9\n";

/// Reads one file of a TetGen pair, with the other beside it.
fn pair(name: &str, node: &str, ele: &str) -> Result<FileMesh, MeshError> {
    let own = if name.ends_with("node") { node } else { ele };
    read::bytes(name, own.as_bytes(), &|beside| match beside {
        "a.node" => Ok(node.into()),
        "a.ele" => Ok(ele.into()),
        _ => nothing(beside),
    })
}

#[test]
fn a_tetgen_pair_is_read_by_either_name_from_0_or_from_1() {
    let from_1 = "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
    for name in ["some/where/a.node", "some/where/a.ele"] {
        for (node, ele) in [(NODE, ELE), (from_1, "1 10 0\n1 1 2 3 4 1 1 1 1 1 1\n")] {
            let Ok(FileMesh::Tetrahedra(mesh)) = pair(name, node, ele) else {
                panic!("{name} is not read");
            };
            assert_eq!(mesh.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
            assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
        }
    }
}

#[test]
fn tetgen_errors_name_the_file_of_the_pair_that_is_wrong() {
    let node = |from: &str, to: &str| NODE.replacen(from, to, 1);
    for (node, ele, start, part) in [
        (
            node("4 3 1 1", "4 2 1 1").as_str(),
            ELE,
            "a.node:2: found '2'",
            "coordinates",
        ),
        (
            &node("4 3 1 1", "4000000000 3 1 1"),
            ELE,
            "a.node:6: found the end of the file",
            "a point",
        ),
        (
            &node("0 0 0 0 5.5 1", "5 0 0 0 5.5 1"),
            ELE,
            "a.node:3: found '5'",
            "0 or 1",
        ),
        (
            &node("1 1 0 0", "2 1 0 0"),
            ELE,
            "a.node:4: found '2'",
            "1, the number of the next",
        ),
        (
            &node("1 1 0 0", "1 1 inf 0"),
            ELE,
            "a.node:4: found 'inf'",
            "the y coordinate",
        ),
        ("", ELE, "a.node:1: found an empty file", "a mesh"),
        (
            NODE,
            "1 4 1\n0 0 1 2 4 9\n",
            "a.ele:2: found '4'",
            "a point from 0 to 3",
        ),
        (NODE, "1 5 1\n", "a.ele:1: found '5'", "4 or 10"),
        (NODE, "0 4 1\n", "a.ele:1: found '0'", "one tetrahedron"),
        (
            NODE,
            "2 4 1\n0 0 1 2 3 9\n",
            "a.ele:2: found the end of the file",
            "a tetrahedron",
        ),
    ] {
        let error = pair("a.node", node, ele).expect_err(start).to_string();
        assert!(error.starts_with(start) && error.contains(part), "{error}");
    }
    let error = parse("a.node", NODE).expect_err("alone");
    assert!(matches!(error, MeshError::Unreadable { .. }));
    assert!(error.to_string().starts_with("a.ele: "), "{error}");
}

#[test]
fn an_unknown_ending_and_a_missing_file_are_named() {
    for name in ["mesh.stl", "obj", "mesh", ""] {
        let error = parse(name, "v 0 0 0").expect_err(name);
        assert!(matches!(error, MeshError::UnknownFormat { .. }), "{error}");
    }
    let missing = std::env::temp_dir().join("pliant-no-such-file.obj");
    let error = read::file(&missing).expect_err("missing").to_string();
    assert!(
        error.contains("pliant-no-such-file.obj: cannot be read"),
        "{error}"
    );
}

#[test]
fn built_in_meshes_are_found_by_name() {
    for asset in asset::ASSETS {
        asset::load(asset.name).expect(asset.name);
    }
    assert!(asset::ASSETS.is_sorted_by_key(|asset| asset.name));
    let error = asset::load("rabbit").expect_err("no rabbit").to_string();
    assert!(
        error.contains("'rabbit'") && error.contains("bunny, "),
        "{error}"
    );
}
