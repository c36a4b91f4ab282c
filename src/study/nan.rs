//! Serialization of numbers that may not be finite. JSON cannot represent them, so they are written
//! as null.

use serde::{Deserialize, Deserializer};

/// Reads a number; null becomes NaN.
pub fn number<'de, D: Deserializer<'de>>(input: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(input)?.unwrap_or(f64::NAN))
}

/// Reads numbers; null becomes NaN.
pub fn numbers<'de, D: Deserializer<'de>>(input: D) -> Result<Vec<f64>, D::Error> {
    let read = Vec::<Option<f64>>::deserialize(input)?.into_iter();
    Ok(read.map(|number| number.unwrap_or(f64::NAN)).collect())
}
