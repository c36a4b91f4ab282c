//! Wavefront OBJ: `v` with `f`, or with `l` in a file without faces; everything else is ignored.
//!
//! Polygons are split into triangle fans from their first corner. A corner may be `v`, `v/vt`,
//! `v//vn` or `v/vt/vn`; a negative index is relative to the last vertex so far. Objects (`o`) and
//! groups (`g`) are parts, each up to the next of its kind.

use glam::DVec3;
use std::borrow::Cow;

use super::{
    parts::{Counts, Label, Named, Part, Parts},
    text::{Word, Words, decode},
};
use crate::{CurveMesh, FileMesh, MeshError, SurfaceMesh};

/// Note about what is ignored.
const IGNORED: &str = "points, lines, curves or patches ignored";

pub fn read(file: &str, bytes: &[u8]) -> Result<Parts, MeshError> {
    let text = decode(file, bytes)?;
    let mut words = Words::new(file, &text);
    let mut surface = SurfaceMesh::default();
    let mut segments = Vec::new();
    let (mut curves, mut other_elements) = (0_usize, 0_usize);
    let mut parts: Vec<Part> = Vec::new();
    // The object and the groups of the next element, and where they begin.
    let mut open = [None, None];
    let end = loop {
        let keyword = words.next();
        let counts = Counts {
            triangles: surface.triangles.len(),
            segments: segments.len(),
            lines: curves,
            ignored: other_elements,
            ..Counts::default()
        };
        match keyword.text {
            Some("v") => surface.vertices.push(words.point()?),
            Some("f") => face(&mut words, keyword, &mut surface)?,
            Some("l") => {
                let corners = corners(
                    &mut words,
                    keyword,
                    &surface,
                    "a line of two vertices or more",
                    2,
                )?;
                segments.extend(corners.windows(2).map(|w| [w[0], w[1]]));
                curves += 1;
            }
            Some("p" | "curv" | "surf") => other_elements += 1,
            Some(kind @ ("o" | "g")) => {
                let is_group = kind == "g";
                let name = match is_group {
                    true => words_in_line(&mut words).into(),
                    false => Cow::Borrowed(words.rest_of_line()),
                };
                let label = (!name.is_empty()).then(|| match is_group {
                    true => Label::Groups((&*name).into()),
                    false => Label::Object((&*name).into()),
                });
                let open = &mut open[usize::from(is_group)];
                close(open, counts, &mut parts);
                *open = label.map(|label| (label, counts));
            }
            Some(_) => {}
            None => {
                for part in &mut open {
                    close(part, counts, &mut parts);
                }
                break keyword;
            }
        }
        skip(&mut words);
    };
    let has_faces = !surface.triangles.is_empty();
    if !has_faces && segments.is_empty() {
        return Err(end.wrong(missing(surface.vertices.len(), other_elements)));
    }
    if has_faces {
        other_elements += curves;
    }
    if other_elements > 0 {
        surface.notes.push(format!("{IGNORED}: {other_elements}"));
    }
    let (whole, segments) = if has_faces {
        (FileMesh::Surface(surface), segments)
    } else {
        let curves = CurveMesh {
            vertices: surface.vertices,
            segments,
            notes: surface.notes,
        };
        (FileMesh::Curves(curves), Vec::new())
    };
    Ok(Parts {
        file: file.into(),
        whole,
        triangles: Vec::new(),
        segments,
        named: Some(Named {
            parts,
            notes: Vec::new(),
            ignored: IGNORED,
            problem: None,
        }),
    })
}

/// What a file without geometry lacks.
fn missing(vertices: usize, other_elements: usize) -> String {
    let vertices = match vertices {
        0 => "no vertices (v)".to_owned(),
        1 => "1 vertex".to_owned(),
        _ => format!("{vertices} vertices"),
    };
    let others = match other_elements {
        0 => String::new(),
        _ => format!(", only {other_elements} of points, curves or patches, which are not read"),
    };
    format!(
        "a face (f with three vertices or more) or a line (l with two): the file has {vertices}, and neither{others}"
    )
}

/// Ends a part.
fn close(open: &mut Option<(Label, Counts)>, end: Counts, parts: &mut Vec<Part>) {
    if let Some((label, start)) = open.take() {
        let elements = vec![start..end];
        parts.push(Part { label, elements });
    }
}

/// Next word of a line; a backslash at the end continues the line.
fn next_in_line<'a>(words: &mut Words<'a>) -> Option<Word<'a>> {
    match words.next_in_line() {
        Some(Word {
            text: Some("\\"), ..
        }) => Some(words.next()),
        word => word,
    }
}

/// The rest of a line and of those that continue it, with a space between words.
fn words_in_line(words: &mut Words) -> String {
    let mut all = String::new();
    while let Some(word) = next_in_line(words) {
        let space = if all.is_empty() { "" } else { " " };
        all.extend([space, word.text.unwrap_or_default()]);
    }
    all
}

fn skip(words: &mut Words) {
    while next_in_line(words).is_some_and(|word| word.text.is_some()) {}
}

/// The vertices that the rest of a line refers to.
fn corners(
    words: &mut Words,
    keyword: Word,
    surface: &SurfaceMesh,
    what: &str,
    min: usize,
) -> Result<Vec<u32>, MeshError> {
    let mut corners = Vec::with_capacity(4);
    while let Some(word) = next_in_line(words) {
        corners.push(corner(word, &surface.vertices)?);
    }
    if corners.len() < min {
        return Err(keyword.wrong(format!("{what}; this one has {}", corners.len())));
    }
    Ok(corners)
}

fn face(words: &mut Words, keyword: Word, surface: &mut SurfaceMesh) -> Result<(), MeshError> {
    let corners = corners(
        words,
        keyword,
        surface,
        "a face of three vertices or more",
        3,
    )?;
    let fan = corners[1..].windows(2).map(|w| [corners[0], w[0], w[1]]);
    surface.triangles.extend(fan);
    Ok(())
}

fn corner(word: Word, vertices: &[DVec3]) -> Result<u32, MeshError> {
    let count = vertices.len();
    let text = word.get("a vertex")?;
    let index = text.split('/').next().and_then(|v| v.parse::<i64>().ok());
    let from_zero = match index {
        Some(index @ 1..) => usize::try_from(index - 1).ok(),
        Some(index @ ..=-1) => usize::try_from(index.unsigned_abs())
            .ok()
            .and_then(|back| count.checked_sub(back)),
        _ => None,
    };
    from_zero
        .filter(|index| *index < count)
        .and_then(|index| u32::try_from(index).ok())
        .ok_or_else(|| {
            word.wrong(format!(
                "a vertex from 1 to {count}, or from -{count} to -1 counted from the last"
            ))
        })
}
