//! Wavefront OBJ: `v` and `f`; everything else is ignored.
//!
//! Polygons are split into triangle fans from their first corner. A corner may be `v`, `v/vt`,
//! `v//vn` or `v/vt/vn`; a negative index is relative to the last vertex so far.

use glam::DVec3;

use super::text::{Word, Words, decode};
use crate::{FileMesh, MeshError, SurfaceMesh};

pub fn read(file: &str, bytes: &[u8]) -> Result<FileMesh, MeshError> {
    let mut words = Words::new(file, decode(file, bytes)?);
    let mut surface = SurfaceMesh::default();
    let mut other_elements = 0_usize;
    let end = loop {
        let keyword = words.next();
        match keyword.text {
            Some("v") => surface.vertices.push(words.point()?),
            Some("f") => face(&mut words, keyword, &mut surface)?,
            Some("l" | "p" | "curv" | "surf") => other_elements += 1,
            Some(_) => {}
            None => break keyword,
        }
        skip(&mut words);
    };
    if surface.triangles.is_empty() {
        return Err(end.wrong("a face: a line with f and three vertices or more"));
    }
    if other_elements > 0 {
        let note = format!("points, lines, curves or patches ignored: {other_elements}");
        surface.notes.push(note);
    }
    Ok(FileMesh::Surface(surface))
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

fn skip(words: &mut Words) {
    while next_in_line(words).is_some_and(|word| word.text.is_some()) {}
}

fn face(words: &mut Words, keyword: Word, surface: &mut SurfaceMesh) -> Result<(), MeshError> {
    let mut corners = Vec::with_capacity(4);
    while let Some(word) = next_in_line(words) {
        corners.push(corner(word, &surface.vertices)?);
    }
    if corners.len() < 3 {
        return Err(keyword.wrong(format!(
            "a face of three vertices or more; this one has {}",
            corners.len()
        )));
    }
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
