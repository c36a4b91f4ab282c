//! Physical groups of Gmsh files as parts: which elements they have, in all versions of the format,
//! and what is said of unknown, empty and damaged ones.

use crate::mesh_support::volume;
use glam::DVec3;
use pliant::mesh::{BuildOptions, FileMesh, build, read::Parts};
use std::{
    io,
    time::{Duration, Instant},
};

/// How the numbers of a file are written.
#[derive(Debug, Clone, Copy)]
pub enum Numbers {
    Text,
    Binary {
        big_endian: bool,
        /// Bytes of a `size_t`.
        size: usize,
    },
}

const LITTLE: Numbers = Numbers::Binary {
    big_endian: false,
    size: 8,
};

struct Writer {
    bytes: Vec<u8>,
    numbers: Numbers,
    version: &'static str,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
    }

    /// The end of a line of numbers.
    fn end(&mut self) {
        if let Numbers::Text = self.numbers {
            self.text("\n");
        }
    }

    fn number(&mut self, mut little: Vec<u8>, text: &str) {
        match self.numbers {
            Numbers::Text => self.text(&format!("{text} ")),
            Numbers::Binary { big_endian, .. } => {
                if big_endian {
                    little.reverse();
                }
                self.bytes.extend(little);
            }
        }
    }

    fn wide(&mut self, values: &[i64], width: usize) {
        for value in values {
            self.number(value.to_le_bytes()[..width].to_vec(), &value.to_string());
        }
    }

    fn ints(&mut self, values: &[i64]) {
        self.wide(values, 4);
    }

    fn sizes(&mut self, values: &[i64]) {
        let width = match self.numbers {
            Numbers::Text => 8,
            Numbers::Binary { size, .. } => size,
        };
        self.wide(values, width);
    }

    /// Numbers of elements and nodes.
    fn tags(&mut self, values: &[i64]) {
        match self.version {
            "4.1" => self.sizes(values),
            _ => self.ints(values),
        }
    }

    fn reals(&mut self, values: &[f64]) {
        for value in values {
            self.number(value.to_le_bytes().to_vec(), &value.to_string());
        }
    }
}

/// Elements of an entity: its dimension and number, their type and their nodes.
type Element = (i64, i64, i64, Vec<i64>);

/// Number of a node of two unit cubes side by side.
fn node([x, y, z]: [usize; 3]) -> i64 {
    (1 + x + 3 * (y + 2 * z)) as i64
}

fn place(node: usize) -> [f64; 3] {
    [node % 3, node / 3 % 2, node / 6].map(|x| x as f64)
}

/// The six tetrahedra of a cube (Kuhn's), half of them inside out.
fn tetrahedra(x: usize) -> Vec<Vec<i64>> {
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let path = |order: [usize; 3]| {
        let mut at = [x, 0, 0];
        let mut corners = vec![node(at)];
        for axis in order {
            at[axis] += 1;
            corners.push(node(at));
        }
        corners
    };
    orders.map(path).to_vec()
}

/// A line, the two ends, two cubes of tetrahedra in turns, and a hexahedron.
fn elements() -> Vec<Element> {
    let mut all = vec![(1, 4, 1, vec![node([0, 0, 0]), node([1, 0, 0])])];
    for (entity, x) in [(7, 0), (8, 2)] {
        let [a, b, c, d] = [[x, 0, 0], [x, 1, 0], [x, 1, 1], [x, 0, 1]].map(node);
        all.extend([vec![a, b, c], vec![a, c, d]].map(|nodes| (2, entity, 2, nodes)));
    }
    let (left, right) = (tetrahedra(0), tetrahedra(1));
    for (left, right) in left.chunks(2).zip(right.chunks(2)) {
        all.extend(left.iter().map(|nodes| (3, 1, 4, nodes.clone())));
        all.extend(right.iter().map(|nodes| (3, 2, 4, nodes.clone())));
    }
    all.push((3, 3, 5, (1..=8).collect()));
    all
}

/// Groups of an entity. In format 2, the first is that of its elements.
fn groups_of(dimension: i64, entity: i64) -> &'static [i64] {
    match (dimension, entity) {
        (1, 4) => &[4],
        (2, 7) => &[1],
        (2, 8) => &[2],
        (3, 1) => &[1, 3],
        // Elements are reversed.
        (3, 2) => &[-2, 3],
        (3, 3) => &[5],
        _ => &[],
    }
}

const STEEL: &str = "steel #1, 5 µm";

/// Two cubes side by side, of a group with a name and of one without, with groups of lines, triangles
/// and a hexahedron.
pub fn cubes(version: &'static str, numbers: Numbers) -> Vec<u8> {
    let mut to = Writer {
        bytes: Vec::new(),
        numbers,
        version,
    };
    let (kind, size) = match numbers {
        Numbers::Text => (0, 8),
        Numbers::Binary { size, .. } => (1, if version == "4.1" { size } else { 8 }),
    };
    to.text(&format!("$MeshFormat\n{version} {kind} {size}\n"));
    if let Numbers::Binary { .. } = numbers {
        to.ints(&[1]);
        to.text("\n");
    }
    to.text(&format!(
        "$EndMeshFormat\n$PhysicalNames\n6\n1 4 \"edge\"\n2 1 \"inlet\"\n3 1 \"{STEEL}\"\n\
         3 3 \"all\"\n3 5 \"bricks\"\n3 6 \"none\"\n$EndPhysicalNames\n"
    ));
    if version != "2.2" {
        entities(&mut to);
    }
    nodes(&mut to);
    to.text("$Elements\n");
    match version {
        "2.2" => elements_of_2(&mut to),
        _ => elements_of_4(&mut to),
    }
    to.text("\n$EndElements\n");
    to.bytes
}

fn entities(to: &mut Writer) {
    to.text("$Entities\n");
    let all: [&[i64]; 4] = [&[1], &[4], &[7, 8], &[1, 2, 3]];
    to.sizes(&all.map(|of| of.len() as i64));
    to.end();
    for (dimension, numbers) in (0..).zip(all) {
        for &number in numbers {
            to.ints(&[number]);
            let reals = if dimension == 0 && to.version == "4.1" {
                3
            } else {
                6
            };
            to.reals(&vec![0.5; reals]);
            let groups = groups_of(dimension, number);
            to.sizes(&[groups.len() as i64]);
            to.ints(groups);
            if dimension > 0 {
                to.sizes(&[2]);
                to.ints(&[1, -7]);
            }
            to.end();
        }
    }
    to.text("\n$EndEntities\n");
}

fn nodes(to: &mut Writer) {
    to.text("$Nodes\n");
    let all: Vec<i64> = (1..=12).collect();
    match to.version {
        "2.2" => to.text("12\n"),
        "4.0" => {
            to.sizes(&[1, 12]);
            to.end();
            to.ints(&[1, 3, 0]);
            to.sizes(&[12]);
            to.end();
        }
        _ => {
            to.sizes(&[1, 12, 1, 12]);
            to.end();
            to.ints(&[3, 1, 0]);
            to.sizes(&[12]);
            to.end();
            to.sizes(&all);
            to.end();
        }
    }
    for (index, number) in all.iter().enumerate() {
        if to.version != "4.1" {
            to.ints(&[*number]);
        }
        to.reals(&place(index));
        to.end();
    }
    to.text("\n$EndNodes\n");
}

fn elements_of_2(to: &mut Writer) {
    to.text(&format!("{}\n", elements().len()));
    for (number, (dimension, entity, kind, nodes)) in (1..).zip(elements()) {
        match to.numbers {
            Numbers::Text => to.ints(&[number, kind, 2]),
            Numbers::Binary { .. } => to.ints(&[kind, 1, 2, number]),
        }
        to.ints(&[groups_of(dimension, entity)[0], entity]);
        to.ints(&nodes);
        to.end();
    }
}

fn elements_of_4(to: &mut Writer) {
    let all = elements();
    let blocks = || all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    let count = all.len() as i64;
    to.sizes(&[blocks().count() as i64, count]);
    if to.version == "4.1" {
        to.sizes(&[1, count]);
    }
    to.end();
    let mut numbers = 1..;
    for block in blocks() {
        let (dimension, entity, kind, _) = block[0];
        match to.version {
            "4.1" => to.ints(&[dimension, entity, kind]),
            _ => to.ints(&[entity, dimension, kind]),
        }
        to.sizes(&[block.len() as i64]);
        to.end();
        for (_, _, _, nodes) in block {
            to.tags(&[numbers.next().expect("without end")]);
            to.tags(nodes);
            to.end();
        }
    }
}

/// All versions, as text and in both orders of bytes.
pub fn files() -> Vec<(&'static str, Numbers)> {
    let mut all = Vec::new();
    for version in ["2.2", "4.0", "4.1"] {
        let big = Numbers::Binary {
            big_endian: true,
            size: 8,
        };
        all.extend([Numbers::Text, LITTLE, big].map(|numbers| (version, numbers)));
    }
    // On Windows, counts of format 4.0 have four bytes.
    let narrow = Numbers::Binary {
        big_endian: false,
        size: 4,
    };
    all.extend([("4.0", narrow), ("4.1", narrow)]);
    all
}

fn nothing(_: &str) -> io::Result<Vec<u8>> {
    Err(io::ErrorKind::NotFound.into())
}

fn parts(file: &[u8]) -> Parts {
    Parts::of_bytes("cubes.msh", file, &nothing).expect("two cubes")
}

fn text(version: &'static str) -> String {
    String::from_utf8(cubes(version, Numbers::Text)).expect("text")
}

/// Corners of the elements, and how many vertices there are.
fn corners(mesh: &FileMesh) -> (Vec<Vec<[f64; 3]>>, usize) {
    let elements: Vec<&[u32]> = match mesh {
        FileMesh::Surface(it) => it.triangles.iter().map(|it| &it[..]).collect(),
        FileMesh::Tetrahedra(it) => it.tetrahedra.iter().map(|it| &it[..]).collect(),
        FileMesh::Curves(it) => it.segments.iter().map(|it| &it[..]).collect(),
    };
    let vertices = mesh.vertices();
    let at = |corner: &u32| vertices[*corner as usize].to_array();
    let elements = elements.iter().map(|it| it.iter().map(at).collect());
    (elements.collect(), vertices.len())
}

/// Those of the entity that [`elements`] has.
fn given(dimension: i64, entity: i64) -> Vec<Vec<[f64; 3]>> {
    let all = elements().into_iter();
    let of_entity = all.filter(|it| (it.0, it.1) == (dimension, entity));
    let at = |node: i64| place(node as usize - 1);
    of_entity
        .map(|it| it.3.into_iter().map(at).collect())
        .collect()
}

#[test]
fn a_physical_group_is_its_elements_in_every_version_of_the_format() {
    for (version, numbers) in files() {
        let what = format!("{version}, {numbers:?}");
        let parts = parts(&cubes(version, numbers));
        let part = |name: &str| corners(&parts.part(name).expect(&what));
        // The number of a group without a name comes after names, and means the volume, as there are
        // tetrahedra of this number.
        assert_eq!(part(STEEL), (given(3, 1), 8), "{what}");
        assert_eq!(part("2"), (given(3, 2), 8), "{what}");
        assert_eq!(part("inlet"), (given(2, 7), 4), "{what}");
        let (whole, vertices) = corners(parts.whole());
        assert_eq!((whole.len(), vertices), (12, 12), "{what}");
        let mut both = [part(STEEL).0, part("2").0].concat();
        let mut all = whole.clone();
        let order = |list: &mut Vec<Vec<[f64; 3]>>| {
            list.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        };
        order(&mut both);
        order(&mut all);
        assert_eq!(both, all, "{what}");
        if version == "2.2" {
            assert_eq!(parts.names(), [STEEL, "inlet", "2"], "{what}");
        } else {
            assert_eq!(parts.names(), [STEEL, "all", "inlet", "2"], "{what}");
            assert_eq!(part("all"), (whole, 12), "an entity in two groups: {what}");
        }
    }
}

/// A group of triangles is a surface, and reversed elements are mended.
#[test]
fn bodies_of_groups_fit_together() {
    let parts = parts(&cubes("4.1", LITTLE));
    let options = BuildOptions {
        bounds: Some(parts.bounds()),
        ..BuildOptions::default()
    };
    for (name, x) in [(STEEL, -0.5), ("2", 0.5)] {
        let body = build(parts.part(name).expect(name), &options).expect(name);
        // Six sixths, each rounded once.
        let off = (volume(&body.shape) - 1.0).abs();
        assert!(off < 1e-14, "{name}: off by {off}");
        let vertices = body.shape.vertices.iter().map(|p| p.as_dvec3());
        assert_eq!(vertices.sum::<DVec3>() / 8.0, DVec3::X * x);
    }
    assert!(matches!(
        parts.part("inlet").expect("two triangles"),
        FileMesh::Surface(_)
    ));
}

#[test]
fn a_surface_of_the_name_of_a_volume_is_not_in_its_part() {
    for version in ["2.2", "4.0", "4.1"] {
        let file = text(version).replace("inlet", STEEL);
        assert_eq!(
            corners(&parts(file.as_bytes()).part(STEEL).expect(version)),
            (given(3, 1), 8)
        );
    }
    // A name comes before a number.
    let file = text("2.2").replace("inlet", "2");
    let two = parts(file.as_bytes()).part("2").expect("two triangles");
    assert_eq!(corners(&two).0, given(2, 7));
}

#[test]
fn unknown_groups_and_those_without_usable_elements_are_named() {
    let complaint = |file: &[u8], name: &str| {
        let error = parts(file).part(name).expect_err(name);
        error.to_string()
    };
    for version in ["2.2", "4.0", "4.1"] {
        let file = cubes(version, LITTLE);
        // The number of a group with a name, and that of an entity.
        for name in ["steel", "1", "8", "-2", ""] {
            let message = complaint(&file, name);
            let expected = format!("cubes.msh: unknown part “{name}”; expected one of: “{STEEL}”,");
            assert!(message.starts_with(&expected), "{message}");
            assert!(message.ends_with("“inlet”, “2”"), "{message}");
        }
        for name in ["edge", "bricks", "none"] {
            let message = complaint(&file, name);
            let expected = format!("cubes.msh: the part “{name}” has no mesh");
            assert!(message.starts_with(&expected), "{message}");
        }
    }
    let none = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
                $Elements\n2\n1 2 2 0 1 1 2 3\n2 2 0 1 2 3\n$EndElements\n";
    let message = complaint(none.as_bytes(), "0");
    assert!(
        message.starts_with("cubes.msh: the file has no named parts"),
        "{message}"
    );
}

/// What only the groups need does not keep a mesh from being read.
#[test]
fn damaged_groups_are_an_error_only_for_parts() {
    for (version, from, to, expected) in [
        (
            "2.2",
            "1 4 \"edge\"",
            "1 4 edge",
            "cubes.msh:6: found '4', expected the name of a physical group in quotation marks",
        ),
        (
            "2.2",
            "$PhysicalNames\n6",
            "$PhysicalNames\n4000000000",
            "cubes.msh:12: found '$EndPhysicalNames', expected the dimension of a physical group",
        ),
        (
            "4.0",
            "1 1 2 3 \n",
            "1 1 2 4000000000 \n",
            "found '$EndEntities', expected the number of an entity",
        ),
        (
            "4.1",
            "0.5 1 4 2 1 -7",
            "0.5 -1 4 2 1 -7",
            "found '-1', expected the number of physical groups, a whole number from 0",
        ),
    ] {
        let file = text(version);
        assert!(file.contains(from), "{from}");
        let whole = parts(file.as_bytes());
        let damaged = parts(file.replacen(from, to, 1).as_bytes());
        assert_eq!(damaged.whole(), whole.whole());
        assert_eq!(damaged.names(), [""; 0]);
        let message = damaged.part(STEEL).expect_err("damaged").to_string();
        assert!(message.contains(expected), "{message}");
        assert!(
            message.starts_with("the physical groups cannot be read: cubes.msh:"),
            "{message}"
        );
    }
}

/// Their elements belong to other entities than those of the groups.
#[test]
fn a_mesh_with_partitions_has_no_parts() {
    let file = text("4.1");
    let section = "$PartitionedEntities\n1\n0\n0 0 0 0\n$EndPartitionedEntities\n";
    let end = "$EndEntities\n";
    let partitioned = parts(file.replacen(end, &format!("{end}{section}"), 1).as_bytes());
    assert_eq!(partitioned.whole(), parts(file.as_bytes()).whole());
    let message = partitioned
        .part(STEEL)
        .expect_err("partitioned")
        .to_string();
    assert!(
        message.contains("$PartitionedEntities") && message.contains("Unpartition"),
        "{message}"
    );
}

/// Each of many damaged sections would be read to the end of the file.
#[test]
fn many_damaged_sections_are_read_in_a_time_in_proportion() {
    let file = cubes("4.1", LITTLE);
    let at = file.windows(6).position(|part| part == b"$Nodes");
    let (before, after) = file.split_at(at.expect("nodes"));
    let damaged = [
        &b"$Entities\n"[..],
        &[[0xff; 7].as_slice(), &[0x7f]].concat(),
        &[0; 24],
        b"\n$EndEntities\n",
    ]
    .concat();
    let file = [before, &damaged.repeat(50_000), after].concat();
    let start = Instant::now();
    let parts = parts(&file);
    let passed = start.elapsed();
    assert_eq!(corners(parts.whole()).0.len(), 12);
    // 3 MB: milliseconds, or minutes if they are read through for each section.
    assert!(passed < Duration::from_secs(10), "{passed:?}");
}
