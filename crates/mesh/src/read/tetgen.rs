//! TetGen: points in a `.node` file, tetrahedra in the `.ele` file of the same name.
//!
//! Numbering starts at 0 or 1, as given by the first point. Attributes and markers are ignored;
//! tetrahedra with ten nodes are imported by their corners. Reference: Si, TetGen manual 1.5,
//! section 5.

use glam::DVec3;

use super::{
    beside::Beside,
    text::{Words, decode},
};
use crate::{FileMesh, MeshError, TetMesh};

/// Reads a pair, given the name and the bytes of either file.
pub fn read(file: &str, bytes: &[u8], beside: &Beside) -> Result<FileMesh, MeshError> {
    let (stem, ending) = file.rsplit_once('.').unwrap_or((file, ""));
    let is_node = ending.eq_ignore_ascii_case("node");
    // In upper case if the requested extension is.
    let shouted = ending.chars().all(|c| c.is_ascii_uppercase());
    let other = match (is_node, shouted) {
        (true, false) => "ele",
        (true, true) => "ELE",
        (false, false) => "node",
        (false, true) => "NODE",
    };
    let other = format!("{stem}.{other}");
    let name = other.rsplit(['/', '\\']).next().unwrap_or(&other);
    let other_bytes = beside(name).map_err(|source| MeshError::Unreadable {
        file: other.clone(),
        source,
    })?;
    let (node, ele) = if is_node {
        ((file, bytes), (other.as_str(), other_bytes.as_slice()))
    } else {
        ((other.as_str(), other_bytes.as_slice()), (file, bytes))
    };
    let (vertices, base) = nodes(node.0, node.1)?;
    let tetrahedra = elements(ele.0, ele.1, base, vertices.len())?;
    Ok(FileMesh::Tetrahedra(TetMesh {
        vertices,
        tetrahedra,
        notes: Vec::new(),
    }))
}

/// Points, and the number of the first one.
fn nodes(file: &str, bytes: &[u8]) -> Result<(Vec<DVec3>, u64), MeshError> {
    let text = decode(file, bytes)?;
    let mut words = Words::new(file, &text);
    let count = words.next().whole("the number of points")?;
    let dimension = words.next();
    if dimension.text != Some("3") {
        return Err(dimension.wrong("3, the number of coordinates"));
    }
    words.skip_line();
    let mut vertices = Vec::new();
    let mut base = 0;
    for index in 0..count {
        let word = words.next();
        let number = word.whole("the number of a point")?;
        if index == 0 && number <= 1 {
            base = number;
        }
        if number != base + index {
            return Err(word.wrong(match index {
                0 => "0 or 1, the number of the first point".into(),
                _ => format!("{}, the number of the next point", base + index),
            }));
        }
        vertices.push(words.point()?);
        words.skip_line();
    }
    Ok((vertices, base))
}

fn elements(
    file: &str,
    bytes: &[u8],
    base: u64,
    vertices: usize,
) -> Result<Vec<[u32; 4]>, MeshError> {
    let text = decode(file, bytes)?;
    let mut words = Words::new(file, &text);
    let number = words.next();
    let count = number.whole("the number of tetrahedra")?;
    if count == 0 {
        return Err(number.wrong("one tetrahedron at least"));
    }
    let corners = words.next();
    if !matches!(corners.text, Some("4" | "10")) {
        return Err(corners.wrong("4 or 10, the number of nodes of a tetrahedron"));
    }
    words.skip_line();
    let mut tetrahedra = Vec::new();
    for _ in 0..count {
        words.next().whole("the number of a tetrahedron")?;
        let mut corners = [0; 4];
        for corner in &mut corners {
            *corner = words.next().index("point", base, vertices)?;
        }
        tetrahedra.push(corners);
        words.skip_line();
    }
    Ok(tetrahedra)
}
