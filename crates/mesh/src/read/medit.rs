//! Medit `.mesh`, as ASCII: vertices, tetrahedra, triangles and quadrilaterals; other sections are
//! ignored.
//!
//! Reference: Frey, "MEDIT: An interactive mesh visualization software" (2001), section 5.

use glam::DVec3;

use super::text::{Word, Words, decode};
use crate::{FileMesh, MeshError};

pub fn read(file: &str, bytes: &[u8]) -> Result<FileMesh, MeshError> {
    let text = decode(file, bytes)?;
    let mut words = Words::new(file, &text);
    let first = words.next();
    if first.text != Some("MeshVersionFormatted") {
        return Err(first.wrong("MeshVersionFormatted, with which a Medit file begins"));
    }
    words.next().whole("the version")?;
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut tetrahedra: Vec<[u32; 4]> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let end = loop {
        let section = words.next();
        match section.text {
            None | Some("End") => break section,
            Some("Dimension") => dimension(words.next())?,
            Some("Vertices") => {
                for _ in 0..words.next().whole("the number of vertices")? {
                    vertices.push(words.point()?);
                    words.next().get("a vertex's reference")?;
                }
            }
            Some("Tetrahedra") => {
                elements(&mut words, vertices.len(), |t| tetrahedra.push(t))?;
            }
            Some("Triangles") => {
                elements(&mut words, vertices.len(), |t| triangles.push(t))?;
            }
            Some("Quadrilaterals") => {
                elements(&mut words, vertices.len(), |[a, b, c, d]| {
                    triangles.extend([[a, b, c], [a, c, d]]);
                })?;
            }
            Some(name) if name.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                pass_over(&mut words, name)?;
            }
            Some(_) => return Err(section.wrong("a section, such as Vertices")),
        }
    };
    if tetrahedra.is_empty() && triangles.is_empty() {
        return Err(end.wrong("a section Tetrahedra or Triangles with some"));
    }
    Ok(FileMesh::of_either(
        vertices,
        tetrahedra,
        triangles,
        Vec::new(),
    ))
}

fn dimension(word: Word) -> Result<(), MeshError> {
    if word.text == Some("3") {
        Ok(())
    } else {
        Err(word.wrong("dimension 3"))
    }
}

fn elements<const N: usize>(
    words: &mut Words,
    vertices: usize,
    mut push: impl FnMut([u32; N]),
) -> Result<(), MeshError> {
    for _ in 0..words.next().whole("the number of elements")? {
        let mut corners = [0; N];
        for corner in &mut corners {
            *corner = words.next().index("vertex", 1, vertices)?;
        }
        words.next().get("an element's reference")?;
        push(corners);
    }
    Ok(())
}

/// Skips a section: a count and as many lines.
fn pass_over(words: &mut Words, name: &str) -> Result<(), MeshError> {
    let what = format!("the number of lines of {name}");
    for _ in 0..words.next().whole(&what)? {
        words.next().get(&format!("a line of {name}"))?;
        words.skip_line();
    }
    Ok(())
}
