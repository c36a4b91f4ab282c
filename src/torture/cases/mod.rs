//! The table of cases.

mod change;
mod common;
mod company;
mod contact;
mod effects;
mod elements;
mod load;
mod meshes;
mod recovery;
mod sameness;
mod time;
mod touch;

use super::{Case, TortureError};

/// All cases, in the order of the table.
pub const CASES: &[Case] = &[
    recovery::SQUASHED,
    recovery::POINT,
    recovery::LINE,
    recovery::SHUFFLED,
    recovery::MIRRORED,
    recovery::INSIDE_OUT,
    recovery::TENFOLD,
    elements::ELEMENT,
    elements::EDGE,
    effects::EFFECTS,
    sameness::SAME,
    sameness::ORDER,
    sameness::FAR,
    meshes::MESHES,
    load::MASSES,
    load::STIFFNESSES,
    load::EXTREMES,
    load::IMPOSSIBLE,
    time::STEPS,
    time::FINE,
    time::SETTLES,
    time::HOUR,
    contact::PLATES,
    contact::STRUCK,
    contact::DRAGGED,
    contact::OVERLAP,
    touch::COLLIDE,
    touch::FOLDED,
    touch::TWISTED,
    touch::PINCHED,
    touch::OVERLAPPING,
    touch::STACK,
    touch::KNOT,
    touch::HAIR_KNOT,
    change::TORN,
    change::BURIED,
    change::SPRAYED,
    company::NOT_FINITE,
    company::CROWD,
];

impl Case {
    /// The case with this name.
    ///
    /// # Errors
    /// [`TortureError::NoCase`] with the valid names.
    pub fn named(name: &str) -> Result<&'static Self, TortureError> {
        let found = CASES.iter().find(|case| case.name == name);
        found.ok_or_else(|| TortureError::NoCase {
            name: name.to_owned(),
            valid: CASES
                .iter()
                .map(|case| case.name)
                .collect::<Vec<_>>()
                .join(", "),
        })
    }
}
