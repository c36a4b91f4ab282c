//! The direct solver as an effect.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

/// Solves the body [directly](crate::direct) instead of by Gauss–Seidel.
///
/// ```
/// use pliant_solver::{Direct, Effects};
///
/// let effects = Effects { direct: Some(Direct), ..Effects::default() };
/// # assert_ne!(effects, Effects::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Clone, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Direct;

/// As text, it has no parameters; in snapshots it is a number of eight bytes, which is 0.
#[derive(Serialize, Deserialize)]
#[serde(rename = "Direct", deny_unknown_fields)]
struct Text {}

impl Serialize for Direct {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match to.is_human_readable() {
            true => Text {}.serialize(to),
            false => 0.0_f64.serialize(to),
        }
    }
}

impl<'de> Deserialize<'de> for Direct {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        if from.is_human_readable() {
            return Text::deserialize(from).map(|_| Self);
        }
        match f64::deserialize(from)? {
            0.0 => Ok(Self),
            _ => Err(D::Error::custom("a direct solver with a tolerance")),
        }
    }
}
