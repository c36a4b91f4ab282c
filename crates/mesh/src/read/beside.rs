//! Files that a mesh file refers to.

use std::io;

/// Reads a file next to the mesh file, by name.
pub type Beside<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + 'a;
