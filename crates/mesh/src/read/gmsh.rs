//! Gmsh `.msh`, format 2.2 and 4.1, as ASCII: `$Nodes` and `$Elements`; other sections are ignored.
//!
//! Tetrahedra, triangles and quadrilaterals are imported; higher-order elements by their corners.
//! Reference: the Gmsh manual, sections "MSH file format" and "MSH file format version 2 (Legacy)".

use std::collections::BTreeMap;

use glam::DVec3;

use super::text::{Word, Words, decode};
use crate::{FileMesh, MeshError};

pub fn read(file: &str, bytes: &[u8]) -> Result<FileMesh, MeshError> {
    // A binary file declares its format in text at the top and is not UTF-8 after that.
    let text = decode(file, bytes).map_err(|not_text| {
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(64)]);
        let format = version(&mut Words::new(file, &head));
        match format {
            Err(refused) if head.starts_with("$MeshFormat") => refused,
            _ => not_text,
        }
    })?;
    let mut words = Words::new(file, &text);
    let version = version(&mut words)?;
    let mut reader = Reader {
        version,
        ..Reader::default()
    };
    let end = loop {
        let section = words.next();
        match section.text {
            None => break section,
            Some("$Nodes") => reader.nodes(&mut words)?,
            Some("$Elements") => reader.elements(&mut words)?,
            Some(name) if name.starts_with('$') => pass_over(&mut words, name)?,
            Some(_) => return Err(section.wrong("a section, such as $Nodes")),
        }
    };
    reader.finish(end)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Version {
    #[default]
    Legacy,
    Current,
}

fn version(words: &mut Words) -> Result<Version, MeshError> {
    expect(words, "$MeshFormat")?;
    let number = words.next();
    let version = match number.text {
        Some("2" | "2.0" | "2.1" | "2.2") => Version::Legacy,
        Some("4.1") => Version::Current,
        _ => return Err(number.wrong("version 2.2 or 4.1: save it as one of these")),
    };
    let kind = words.next();
    if kind.text != Some("0") {
        return Err(kind.wrong("0, for ASCII: binary files are not supported, so save it as ASCII"));
    }
    words.skip_line();
    expect(words, "$EndMeshFormat")?;
    Ok(version)
}

fn expect(words: &mut Words, keyword: &str) -> Result<(), MeshError> {
    let word = words.next();
    if word.text == Some(keyword) {
        Ok(())
    } else {
        Err(word.wrong(keyword))
    }
}

fn pass_over(words: &mut Words, section: &str) -> Result<(), MeshError> {
    let end = section.replacen('$', "$End", 1);
    loop {
        let word = words.next();
        if word.get(&end)? == end {
            return Ok(());
        }
    }
}

#[derive(Default)]
struct Reader {
    version: Version,
    vertices: Vec<DVec3>,
    /// Vertex index by node tag.
    by_tag: BTreeMap<u64, u32>,
    tetrahedra: Vec<[u32; 4]>,
    triangles: Vec<[u32; 3]>,
    other_elements: usize,
    of_higher_order: usize,
}

impl Reader {
    fn nodes(&mut self, words: &mut Words) -> Result<(), MeshError> {
        match self.version {
            Version::Legacy => {
                for _ in 0..words.next().whole("the number of nodes")? {
                    let tag = words.next();
                    tag.whole("the number of a node")?;
                    let point = words.point()?;
                    self.node(tag, point)?;
                }
            }
            Version::Current => {
                let blocks = words.next().whole("the number of blocks of nodes")?;
                words.skip_line();
                for _ in 0..blocks {
                    words.next().whole("the dimension of a block of nodes")?;
                    words.next().get("the number of an entity")?;
                    words.next().get("whether nodes are parametric")?;
                    let count = words.next().whole("the number of nodes in the block")?;
                    let mut tags = Vec::new();
                    for _ in 0..count {
                        let tag = words.next();
                        tag.whole("the number of a node")?;
                        tags.push(tag);
                    }
                    for tag in tags {
                        let point = words.point()?;
                        words.skip_line();
                        self.node(tag, point)?;
                    }
                }
            }
        }
        expect(words, "$EndNodes")
    }

    fn node(&mut self, tag: Word, point: DVec3) -> Result<(), MeshError> {
        let number = tag.whole("the number of a node")?;
        let index = self.vertices.len() as u32;
        if self.by_tag.insert(number, index).is_some() {
            return Err(tag.wrong("a node that was not given before"));
        }
        self.vertices.push(point);
        Ok(())
    }

    fn elements(&mut self, words: &mut Words) -> Result<(), MeshError> {
        match self.version {
            Version::Legacy => {
                for _ in 0..words.next().whole("the number of elements")? {
                    words.next().whole("the number of an element")?;
                    let kind = words.next().whole("the type of an element")?;
                    for _ in 0..words.next().whole("the number of tags")? {
                        words.next().get("a tag")?;
                    }
                    self.element(kind, words)?;
                }
            }
            Version::Current => {
                let blocks = words.next().whole("the number of blocks of elements")?;
                words.skip_line();
                for _ in 0..blocks {
                    words.next().whole("the dimension of a block of elements")?;
                    words.next().get("the number of an entity")?;
                    let kind = words.next().whole("the type of the block's elements")?;
                    let count = words.next().whole("the number of elements in the block")?;
                    for _ in 0..count {
                        words.next().whole("the number of an element")?;
                        self.element(kind, words)?;
                    }
                }
            }
        }
        expect(words, "$EndElements")
    }

    /// Nodes of an element. Its corners come first, whatever its order.
    fn element(&mut self, kind: u64, words: &mut Words) -> Result<(), MeshError> {
        match kind {
            2 | 9 => {
                let triangle = self.corners(words)?;
                self.triangles.push(triangle);
            }
            3 | 10 | 16 => {
                let [a, b, c, d] = self.corners(words)?;
                self.triangles.extend([[a, b, c], [a, c, d]]);
            }
            4 | 11 => {
                let tetrahedron = self.corners(words)?;
                self.tetrahedra.push(tetrahedron);
            }
            // Points and lines are common in these files and ignored without a note.
            1 | 8 | 15 => {}
            _ => self.other_elements += 1,
        }
        self.of_higher_order += usize::from(matches!(kind, 9 | 10 | 11 | 16));
        words.skip_line();
        Ok(())
    }

    fn corners<const N: usize>(&self, words: &mut Words) -> Result<[u32; N], MeshError> {
        let mut corners = [0; N];
        for corner in &mut corners {
            let word = words.next();
            let node = self.by_tag.get(&word.whole("the number of a node")?);
            *corner = *node.ok_or_else(|| word.wrong("the number of a node in $Nodes"))?;
        }
        Ok(corners)
    }

    fn finish(self, end: Word) -> Result<FileMesh, MeshError> {
        if self.tetrahedra.is_empty() && self.triangles.is_empty() {
            return Err(end.wrong(format!(
                "$Elements with tetrahedra or triangles ({} of other kinds are not supported)",
                self.other_elements
            )));
        }
        let mut notes = Vec::new();
        if self.other_elements > 0 {
            notes.push(format!(
                "elements other than tetrahedra and triangles ignored: {}",
                self.other_elements
            ));
        }
        if self.of_higher_order > 0 {
            notes.push(format!(
                "higher-order elements reduced to their corners: {}",
                self.of_higher_order
            ));
        }
        Ok(FileMesh::of_either(
            self.vertices,
            self.tetrahedra,
            self.triangles,
            notes,
        ))
    }
}
