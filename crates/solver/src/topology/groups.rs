//! Named groups of the particles of a body.

use super::{
    index::{ParticleIndex, VertexIndex},
    input::TopologyError,
    numbering::Numbering,
};
use serde::{Deserialize, Serialize};
use std::{fmt, sync::Arc};

/// Maximum number of bytes of a name.
const MAX_BYTES: usize = 31;

/// Maximum number of groups of a body: one for each bit of a `u32`.
pub(super) const MAX_GROUPS: usize = u32::BITS as usize;

/// The name of a group of vertices: at most 31 bytes of UTF-8 without control characters. The empty
/// name, the default, stands for the whole body.
///
/// Stored in place, so that the parameters of an effect that contain it are copied like numbers.
///
/// ```
/// use pliant_solver::GroupName;
///
/// const SAIL: GroupName = GroupName::of("sail");
/// assert_eq!(GroupName::new("sail"), Ok(SAIL));
/// assert_eq!(SAIL.as_str(), "sail");
/// assert!(GroupName::new(&"a".repeat(32)).is_err());
/// assert!(GroupName::default().is_empty());
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct GroupName {
    bytes: [u8; MAX_BYTES],
    length: u8,
}

/// A text that is not the name of a group.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "“{0}” cannot be the name of a group; expected at most 31 bytes without control characters"
)]
pub struct InvalidGroupName(pub String);

impl GroupName {
    /// The name with this text.
    ///
    /// # Errors
    /// [`InvalidGroupName`] for more than 31 bytes and for control characters.
    pub fn new(text: &str) -> Result<Self, InvalidGroupName> {
        if text.len() > MAX_BYTES || text.chars().any(char::is_control) {
            return Err(InvalidGroupName(text.to_owned()));
        }
        Ok(Self::copied(text))
    }

    /// A literal name.
    ///
    /// # Panics
    /// For more than 31 bytes, and for control characters of ASCII; in a constant, that is an error of
    /// the compiler.
    #[must_use]
    pub const fn of(text: &str) -> Self {
        assert!(text.len() <= MAX_BYTES, "more than 31 bytes");
        let mut i = 0;
        while i < text.len() {
            assert!(
                !text.as_bytes()[i].is_ascii_control(),
                "a control character"
            );
            i += 1;
        }
        Self::copied(text)
    }

    const fn copied(text: &str) -> Self {
        let mut bytes = [0; MAX_BYTES];
        let mut i = 0;
        while i < text.len() {
            bytes[i] = text.as_bytes()[i];
            i += 1;
        }
        Self {
            bytes,
            length: text.len() as u8,
        }
    }

    /// The text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let bytes = &self.bytes[..usize::from(self.length)];
        // Copied from a text.
        core::str::from_utf8(bytes).unwrap_or_default()
    }

    /// Whether it stands for the whole body.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }
}

impl fmt::Debug for GroupName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(formatter)
    }
}

impl fmt::Display for GroupName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(formatter)
    }
}

impl TryFrom<&str> for GroupName {
    type Error = InvalidGroupName;

    fn try_from(text: &str) -> Result<Self, InvalidGroupName> {
        Self::new(text)
    }
}

impl TryFrom<String> for GroupName {
    type Error = InvalidGroupName;

    fn try_from(text: String) -> Result<Self, InvalidGroupName> {
        Self::new(&text)
    }
}

impl From<GroupName> for String {
    fn from(name: GroupName) -> Self {
        name.as_str().to_owned()
    }
}

/// A named group of vertices of a [`RestShape`](crate::RestShape).
///
/// ```
/// use pliant_solver::{Group, GroupName};
///
/// let corner = Group {
///     name: GroupName::of("corner"),
///     vertices: vec![0, 1],
/// };
/// assert_eq!(corner.name.as_str(), "corner");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// Its name, not empty, once in a body.
    pub name: GroupName,
    /// Its vertices, in any order.
    pub vertices: Vec<u32>,
}

/// The groups of a body: a bit for each of them in a word per particle, and nothing without groups.
/// Copies of a particle are in the groups of their origin.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Groups {
    names: Arc<[GroupName]>,
    /// Bits of each particle; empty without groups.
    bits: Arc<[u32]>,
}

impl Groups {
    /// The groups of a shape with this number of vertices.
    pub(super) fn new(
        groups: &[Group],
        numbering: &Numbering,
        vertices: usize,
    ) -> Result<Self, TopologyError> {
        if groups.is_empty() {
            return Ok(Self::default());
        }
        if groups.len() > MAX_GROUPS {
            return Err(TopologyError::TooManyGroups(groups.len()));
        }
        let mut bits = vec![0; vertices];
        for (index, Group { name, vertices: of }) in groups.iter().enumerate() {
            if name.is_empty() {
                return Err(TopologyError::UnnamedGroup(index));
            }
            if groups[..index].iter().any(|other| other.name == *name) {
                return Err(TopologyError::RepeatedGroup(*name));
            }
            for &vertex in of {
                if vertex as usize >= vertices {
                    return Err(TopologyError::GroupVertex {
                        group: *name,
                        vertex,
                        vertices,
                    });
                }
                bits[numbering.particle(VertexIndex(vertex)).index()] |= 1 << index;
            }
        }
        Ok(Self {
            names: groups.iter().map(|group| group.name).collect(),
            bits: bits.into(),
        })
    }

    /// Their names, in the order of the shape.
    #[must_use]
    pub fn names(&self) -> &[GroupName] {
        &self.names
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Whether there is a group of this name.
    #[must_use]
    pub fn contains(&self, name: GroupName) -> bool {
        self.names.contains(&name)
    }

    /// Whether each particle is in a group: all are in that of the empty name, and none is in a group
    /// that does not exist.
    pub fn membership(&self, name: GroupName) -> impl Fn(u32) -> bool + use<'_> {
        let place = self.names.iter().position(|other| *other == name);
        let bit = place.map_or(0, |place| 1 << place);
        move |particle| {
            name.is_empty()
                || self
                    .bits
                    .get(particle as usize)
                    .is_some_and(|bits| bits & bit != 0)
        }
    }

    /// The particles of a group, ascending; none of a group that does not exist.
    pub fn particles(&self, name: GroupName) -> impl Iterator<Item = ParticleIndex> + use<'_> {
        let is_in = self.membership(name);
        (0..self.bits.len() as u32)
            .filter(move |&particle| is_in(particle))
            .map(ParticleIndex)
    }

    /// The groups with their vertices, ascending.
    pub(super) fn of_vertices(&self, numbering: &Numbering) -> Vec<Group> {
        let group = |name: &GroupName| {
            let particles = self.particles(*name);
            let mut vertices: Vec<u32> = particles.map(|it| numbering.vertex(it).0).collect();
            vertices.sort_unstable();
            Group {
                name: *name,
                vertices,
            }
        };
        self.names.iter().map(group).collect()
    }

    /// The groups of particles that come from these ones; those that come from none are in none.
    pub(super) fn carried(&self, sources: impl Iterator<Item = Option<u32>>) -> Self {
        if self.is_empty() {
            return Self::default();
        }
        let of = |source: Option<u32>| source.map_or(0, |source| self.bits[source as usize]);
        Self {
            names: Arc::clone(&self.names),
            bits: sources.map(of).collect(),
        }
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.names[..]) + size_of_val(&self.bits[..])
    }
}
