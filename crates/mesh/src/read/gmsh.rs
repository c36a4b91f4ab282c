//! Gmsh `.msh`, formats 2.2, 4.0 and 4.1, as text and binary: `$Nodes` and `$Elements`, and the
//! physical groups of `$PhysicalNames` and `$Entities` as parts; other sections are ignored.
//!
//! Tetrahedra, triangles and quadrilaterals are imported; higher-order elements by their corners.
//! Reference: the Gmsh manual, sections "MSH file format", "MSH file format version 4.0" and
//! "MSH file format version 2 (Legacy)".

use std::{collections::BTreeMap, mem::take};

use glam::DVec3;

use super::{
    parts::{Counts, Parts},
    text::{Words, decode},
};
use crate::{FileMesh, MeshError};
use groups::Groups;
use source::{Binary, Source, Width};

mod groups;
mod source;

/// Note about what is ignored.
const IGNORED: &str = "elements other than tetrahedra and triangles ignored";

pub fn read(file: &str, bytes: &[u8]) -> Result<Parts, MeshError> {
    // The head is text in binary files too.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(256)]);
    let format = match Format::read(&mut Words::new(file, &head)) {
        Ok(format) if format.binary => {
            let mut ends = (0..bytes.len()).filter(|at| bytes[*at] == b'\n');
            let at = ends.nth(1).map_or(bytes.len(), |end| end + 1);
            let source = Binary::new(file, bytes, at, format.size)?;
            let read = Reader::new(format.version).read(file, Source::Binary(source));
            if format.version != Version::Four || read.is_ok() {
                return read;
            }
            // Format 4.0 has counts as wide as `unsigned long`, which has four bytes on Windows, and
            // does not say so.
            let source = Binary::new(file, bytes, at, 4)?;
            let narrow = Reader::new(format.version).read(file, Source::Binary(source));
            return narrow.or(read);
        }
        other => other,
    };
    let text = decode(file, bytes).map_err(|not_text| match format {
        // A refused format says more than the byte that is no text.
        Err(refused) if head.starts_with("$MeshFormat") => refused,
        _ => not_text,
    })?;
    let mut words = Words::new(file, &text);
    let format = Format::read(&mut words)?;
    Reader::new(format.version).read(file, Source::text(file, words))
}

/// Longest name of a section. Finding its end takes time in proportion to its length.
const MAX_NAME_LENGTH: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    /// 2.0 to 2.2.
    Two,
    /// 4.0: a node's number beside its coordinates.
    Four,
    /// 4.1: the numbers of a block of nodes before their coordinates.
    FourOne,
}

struct Format {
    version: Version,
    binary: bool,
    /// Bytes of a `size_t`.
    size: u64,
}

impl Format {
    fn read(words: &mut Words) -> Result<Self, MeshError> {
        let word = words.next();
        if word.text != Some("$MeshFormat") {
            return Err(word.wrong("$MeshFormat"));
        }
        let number = words.next();
        let version = match number.text {
            Some("2" | "2.0" | "2.1" | "2.2") => Version::Two,
            Some("4" | "4.0") => Version::Four,
            Some("4.1") => Version::FourOne,
            _ => return Err(number.wrong("version 2.2, 4.0 or 4.1: save it as one of these")),
        };
        let kind = words.next();
        let binary = match kind.text {
            Some("0") => false,
            Some("1") => true,
            _ => return Err(kind.wrong("0, for text, or 1, for binary")),
        };
        let size = words.next();
        // Before 4.1, the number is that of a coordinate's bytes.
        let size = match (binary, size.text) {
            (true, Some("4")) if version == Version::FourOne => 4,
            (true, Some("8")) => 8,
            (true, _) => return Err(size.wrong("8, the bytes of a number")),
            (false, _) => 8,
        };
        words.skip_line();
        Ok(Self {
            version,
            binary,
            size,
        })
    }
}

struct Reader {
    version: Version,
    vertices: Vec<DVec3>,
    /// Vertex index by node tag.
    by_tag: BTreeMap<u64, u32>,
    tetrahedra: Vec<[u32; 4]>,
    triangles: Vec<[u32; 3]>,
    other_elements: usize,
    of_higher_order: usize,
    groups: Groups,
}

impl Reader {
    fn new(version: Version) -> Self {
        Self {
            version,
            vertices: Vec::new(),
            by_tag: BTreeMap::new(),
            tetrahedra: Vec::new(),
            triangles: Vec::new(),
            other_elements: 0,
            of_higher_order: 0,
            groups: Groups::default(),
        }
    }

    fn read(mut self, file: &str, mut source: Source) -> Result<Parts, MeshError> {
        end_of_section(&mut source, "$EndMeshFormat")?;
        while let Some(section) = source.section() {
            match section {
                "$Nodes" => self.nodes(&mut source)?,
                "$Elements" => self.elements(&mut source)?,
                "$PhysicalNames" => self.groups.names(&mut source)?,
                "$Entities" if self.version != Version::Two => {
                    let points_in_boxes = self.version == Version::Four;
                    self.groups.entities(&mut source, points_in_boxes)?;
                }
                "$PartitionedEntities" => self.groups.partitioned(&mut source)?,
                name if name.starts_with('$') && name.len() <= MAX_NAME_LENGTH => {
                    source.pass(&name.replacen('$', "$End", 1))?
                }
                _ => return Err(source.wrong("a section, such as $Nodes")),
            }
        }
        self.finish(file, &source)
    }

    fn nodes(&mut self, source: &mut Source) -> Result<(), MeshError> {
        if self.version == Version::Two {
            for _ in 0..source.written("the number of nodes")? {
                self.tag(source, Width::Int)?;
                self.point(source)?;
            }
            return end_of_section(source, "$EndNodes");
        }
        let blocks = self.blocks(source, "nodes")?;
        for _ in 0..blocks {
            // 4.0 gives the number of the entity before its dimension.
            let numbers = match self.version {
                Version::FourOne => [
                    "the dimension of a block of nodes",
                    "the number of an entity",
                ],
                _ => [
                    "the number of an entity",
                    "the dimension of a block of nodes",
                ],
            };
            let first = source.int(numbers[0])?;
            let second = source.int(numbers[1])?;
            let dimension = if self.version == Version::FourOne {
                first
            } else {
                second
            };
            let parametric = source.int("whether nodes are parametric")? != 0;
            // Parameters follow the coordinates, one for each dimension of the entity.
            let parameters = if parametric {
                dimension.clamp(0, 3) as u64
            } else {
                0
            };
            let count = source.whole(Width::Size, "the number of nodes in the block")?;
            if self.version == Version::FourOne {
                for _ in 0..count {
                    self.tag(source, Width::Size)?;
                }
            }
            for _ in 0..count {
                if self.version == Version::Four {
                    self.tag(source, Width::Int)?;
                }
                self.point(source)?;
                source.skip_rest(8 * parameters, "the parameters of a node")?;
            }
        }
        end_of_section(source, "$EndNodes")
    }

    /// Counts at the start of a section of format 4; returns the number of blocks.
    fn blocks(&self, source: &mut Source, of: &str) -> Result<u64, MeshError> {
        let blocks = source.whole(Width::Size, &format!("the number of blocks of {of}"))?;
        // The number of all nodes or elements; in 4.1 also their least and greatest number.
        let others = if self.version == Version::FourOne {
            3
        } else {
            1
        };
        source.skip_rest(
            others * source.bytes_of(Width::Size),
            &format!("the number of {of}"),
        )?;
        Ok(blocks)
    }

    /// Number of the next node. Its coordinates follow in the same order.
    fn tag(&mut self, source: &mut Source, width: Width) -> Result<(), MeshError> {
        let number = source.whole(width, "the number of a node")?;
        let index = self.by_tag.len() as u32;
        match self.by_tag.insert(number, index) {
            None => Ok(()),
            Some(_) => Err(source.wrong("a node that was not given before")),
        }
    }

    fn point(&mut self, source: &mut Source) -> Result<(), MeshError> {
        let x = source.real("the x coordinate")?;
        let y = source.real("the y coordinate")?;
        let z = source.real("the z coordinate")?;
        self.vertices.push(DVec3::new(x, y, z));
        Ok(())
    }

    fn elements(&mut self, source: &mut Source) -> Result<(), MeshError> {
        match self.version {
            Version::Two => self.elements_of_2(source)?,
            Version::Four => self.elements_of_4(source, Width::Int)?,
            Version::FourOne => self.elements_of_4(source, Width::Size)?,
        }
        end_of_section(source, "$EndElements")
    }

    /// Text: number, type and tags of each element. Binary: the number last, and one type, count
    /// of elements and count of tags for several elements.
    fn elements_of_2(&mut self, source: &mut Source) -> Result<(), MeshError> {
        const TYPE: &str = "the type of an element";
        const TAGS: &str = "the number of tags";
        let count = source.written("the number of elements")?;
        let mut read = 0;
        while read < count {
            if source.is_binary() {
                let kind = element_type(source, TYPE)?;
                let following = source.whole(Width::Int, "the number of elements of this type")?;
                if following == 0 || following > count - read {
                    return Err(source.wrong(format!("from 1 to {} elements", count - read)));
                }
                let tags = source.whole(Width::Int, TAGS)?;
                for _ in 0..following {
                    source.int("the number of an element")?;
                    let group = if tags > 0 {
                        source.int("the physical group of an element")?
                    } else {
                        0
                    };
                    let others = tags.saturating_sub(1);
                    source.skip_rest(4 * others, "the tags of an element")?;
                    self.element_of_group(group, kind, source)?;
                }
                read += following;
            } else {
                source.whole(Width::Int, "the number of an element")?;
                let kind = element_type(source, TYPE)?;
                let mut group = 0;
                for tag in 0..source.whole(Width::Int, TAGS)? {
                    let number = source.int("a tag")?;
                    if tag == 0 {
                        group = number;
                    }
                }
                self.element_of_group(group, kind, source)?;
                read += 1;
            }
        }
        Ok(())
    }

    /// An element of format 2. Its first tag is its physical group, 0 for none.
    fn element_of_group(
        &mut self,
        group: i64,
        kind: u64,
        source: &mut Source,
    ) -> Result<(), MeshError> {
        let start = self.counts();
        self.element(kind, source, Width::Int)?;
        if group != 0 {
            let elements = start..self.counts();
            self.groups
                .add_to_group(dimension_of(kind), group, elements);
        }
        Ok(())
    }

    fn elements_of_4(&mut self, source: &mut Source, width: Width) -> Result<(), MeshError> {
        for _ in 0..self.blocks(source, "elements")? {
            let first = source.int("the dimension or the number of an entity")?;
            let second = source.int("the dimension or the number of an entity")?;
            let (dimension, entity) = match self.version {
                Version::FourOne => (first, second),
                _ => (second, first),
            };
            let start = self.counts();
            let kind = element_type(source, "the type of the block's elements")?;
            let count = source.whole(Width::Size, "the number of elements in the block")?;
            for _ in 0..count {
                source.whole(width, "the number of an element")?;
                self.element(kind, source, width)?;
            }
            let elements = start..self.counts();
            self.groups.add_to_entity(dimension, entity, elements);
        }
        Ok(())
    }

    /// Nodes of an element. Its corners come first, whatever its order.
    fn element(&mut self, kind: u64, source: &mut Source, width: Width) -> Result<(), MeshError> {
        let corners = match kind {
            2 | 9 | 20..=25 => {
                let triangle = self.corners(source, width)?;
                self.triangles.push(triangle);
                3
            }
            3 | 10 | 16 | 36..=39 => {
                let [a, b, c, d] = self.corners(source, width)?;
                self.triangles.extend([[a, b, c], [a, c, d]]);
                4
            }
            4 | 11 | 29..=31 => {
                let tetrahedron = self.corners(source, width)?;
                self.tetrahedra.push(tetrahedron);
                4
            }
            // Points and lines are common in these files and ignored without a note.
            1 | 8 | 15 | 26..=28 => 0,
            _ => {
                self.other_elements += 1;
                0
            }
        };
        self.of_higher_order += usize::from(corners > 0 && kind > 4);
        // A line of text has an end, whatever the element.
        let rest = nodes_of(kind).map_or(0, |nodes| nodes - corners);
        source.skip_rest(rest * source.bytes_of(width), "the nodes of an element")
    }

    fn corners<const N: usize>(
        &self,
        source: &mut Source,
        width: Width,
    ) -> Result<[u32; N], MeshError> {
        let mut corners = [0; N];
        for corner in &mut corners {
            let number = source.whole(width, "the number of a node")?;
            let node = self.by_tag.get(&number);
            *corner = *node.ok_or_else(|| source.wrong("the number of a node in $Nodes"))?;
        }
        Ok(corners)
    }

    /// The place in the file, in elements.
    fn counts(&self) -> Counts {
        Counts {
            tetrahedra: self.tetrahedra.len(),
            triangles: self.triangles.len(),
            ignored: self.other_elements,
            ..Counts::default()
        }
    }

    fn finish(mut self, file: &str, end: &Source) -> Result<Parts, MeshError> {
        if self.tetrahedra.is_empty() && self.triangles.is_empty() {
            return Err(end.wrong(format!(
                "$Elements with tetrahedra or triangles ({} of other kinds are not supported)",
                self.other_elements
            )));
        }
        let mut notes = Vec::new();
        if self.of_higher_order > 0 {
            notes.push(format!(
                "higher-order elements reduced to their corners: {}",
                self.of_higher_order
            ));
        }
        let named = self.groups.named(notes.clone(), IGNORED);
        if self.other_elements > 0 {
            notes.insert(0, format!("{IGNORED}: {}", self.other_elements));
        }
        let beside_tetrahedra = match self.tetrahedra.is_empty() {
            true => Vec::new(),
            false => take(&mut self.triangles),
        };
        Ok(Parts {
            file: file.into(),
            whole: FileMesh::of_either(self.vertices, self.tetrahedra, self.triangles, notes),
            triangles: beside_tetrahedra,
            segments: Vec::new(),
            named: Some(named),
        })
    }
}

fn end_of_section(source: &mut Source, keyword: &str) -> Result<(), MeshError> {
    if source.section() == Some(keyword) {
        Ok(())
    } else {
        Err(source.wrong(keyword))
    }
}

/// Type of an element. In a binary file, one that is not known cannot be skipped.
fn element_type(source: &mut Source, expected: &str) -> Result<u64, MeshError> {
    let kind = source.whole(Width::Int, expected)?;
    match source.is_binary() && nodes_of(kind).is_none() {
        true => Err(source.wrong(format!("{expected} that is known"))),
        false => Ok(kind),
    }
}

/// Dimension of an element, by its type; 3 for those that are not known.
fn dimension_of(kind: u64) -> i64 {
    match kind {
        15 => 0,
        1 | 8 | 26..=28 => 1,
        2 | 3 | 9 | 10 | 16 | 20..=25 | 36..=39 => 2,
        _ => 3,
    }
}

/// Number of nodes of an element, by its type ("Node ordering" and `GmshDefines.h` of Gmsh).
fn nodes_of(kind: u64) -> Option<u64> {
    Some(match kind {
        15 => 1,
        1 => 2,
        2 | 8 => 3,
        3 | 4 | 26 => 4,
        7 | 27 => 5,
        6 | 9 | 28 => 6,
        5 | 16 => 8,
        10 | 20 => 9,
        11 | 21 => 10,
        22 => 12,
        19 => 13,
        14 => 14,
        18 | 23 | 24 => 15,
        13 => 18,
        17 | 29 => 20,
        25 => 21,
        12 => 27,
        36 => 16,
        37 => 25,
        38 => 36,
        39 => 12,
        30 => 35,
        31 => 56,
        92 => 64,
        93 => 125,
        _ => return None,
    })
}
