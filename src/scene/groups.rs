//! The groups of a body in a scene file: a map from names to selected vertices, in the order of the
//! file.

use super::VertexSelection;
use crate::solver::GroupName;
use serde::{
    Deserializer, Serializer,
    de::{Error, MapAccess, Visitor},
};
use std::fmt;

/// Names and vertices of the groups of a body.
type Groups = Vec<(GroupName, Vec<VertexSelection>)>;

/// Writes a map.
pub fn serialize<S: Serializer>(
    groups: &[(GroupName, Vec<VertexSelection>)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(groups.iter().map(|(name, selected)| (name, selected)))
}

/// Reads a map of different names.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Groups, D::Error> {
    deserializer.deserialize_map(InOrder)
}

struct InOrder;

impl<'de> Visitor<'de> for InOrder {
    type Value = Groups;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("groups of vertices, as in {\"sail\": [Top(0.3)]}")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Groups, A::Error> {
        let mut groups = Groups::new();
        while let Some(name) = map.next_key::<GroupName>()? {
            if name.is_empty() {
                return Err(A::Error::custom("a group needs a name of 1 to 31 bytes"));
            }
            if groups.iter().any(|(other, _)| *other == name) {
                return Err(A::Error::custom(format!(
                    "the group “{name}” is there twice"
                )));
            }
            groups.push((name, map.next_value()?));
        }
        Ok(groups)
    }
}
