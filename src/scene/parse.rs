//! Parses the format of scene files.

use super::{SceneError, effects};
use crate::effect::OwnEffects;
use serde::de::DeserializeOwned;

/// Parses the text of any file in the format of scene files; `file` is its name in error messages.
///
/// # Errors
/// [`SceneError::Syntax`] with line, column and what was expected.
pub fn parse<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, SceneError> {
    parse_with(file, text, &OwnEffects::default())
}

/// The same for a file with effects of an app.
///
/// # Errors
/// As [`parse`].
pub fn parse_with<T: DeserializeOwned>(
    file: &str,
    text: &str,
    own: &OwnEffects,
) -> Result<T, SceneError> {
    effects::read(own, text).map_err(|(line, column, message)| SceneError::Syntax {
        file: file.to_owned(),
        line,
        column,
        message,
    })
}
