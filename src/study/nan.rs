//! Numbers that may not be finite, in JSON, which has none such: they are written as null.

use serde::{Deserialize, Deserializer};

/// Reads a number, or null as one that is none.
pub fn number<'de, D: Deserializer<'de>>(input: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(input)?.unwrap_or(f64::NAN))
}

/// Reads numbers, and nulls as what is none.
pub fn numbers<'de, D: Deserializer<'de>>(input: D) -> Result<Vec<f64>, D::Error> {
    let read = Vec::<Option<f64>>::deserialize(input)?.into_iter();
    Ok(read.map(|number| number.unwrap_or(f64::NAN)).collect())
}
