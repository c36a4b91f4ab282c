//! The parameters of a body as text, in the syntax of a body in a scene file: for the clipboard and
//! for presets.
//!
//! ```
//! use pliant::scene::BodyParameters;
//!
//! let text = "density: 930, effects: (stretch: (compliance: 1e-4), volume: ())";
//! let parameters = BodyParameters::parse("clipboard", text)?;
//! assert!(parameters.effects.stretch.is_some());
//! assert_eq!(BodyParameters::parse("again", &parameters.to_text()?)?, parameters);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::{SceneEffects, SceneError, parse::parse_with};
use crate::{effect::OwnEffects, solver::Density};
use serde::Deserialize;

/// Density and effects of a body, with all parameters.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyParameters {
    /// Mass per measure: kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope; `None` keeps that of
    /// the body.
    #[serde(default)]
    pub density: Option<Density>,
    /// The effects.
    pub effects: SceneEffects,
}

impl BodyParameters {
    /// Parses the fields `density` and `effects` as they stand in a body of a scene file, with or
    /// without parentheses around them; `source` is their name in error messages.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] with line, column and what was expected.
    pub fn parse(source: &str, text: &str) -> Result<Self, SceneError> {
        Self::parse_with(source, text, &OwnEffects::default())
    }

    /// The same for parameters with effects of an app.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_with(source: &str, text: &str, own: &OwnEffects) -> Result<Self, SceneError> {
        let bare = text.trim_start();
        if bare.starts_with('(') {
            return parse_with(source, text, own);
        }
        // On a line of its own, the parenthesis shifts no column.
        parse_with(source, &format!("(\n{text}\n)"), own).map_err(|error| match error {
            SceneError::Syntax {
                file,
                line,
                column,
                message,
            } => {
                let lines = text.lines().count().max(1);
                SceneError::Syntax {
                    file,
                    line: line.saturating_sub(1).clamp(1, lines),
                    column,
                    message,
                }
            }
            other => other,
        })
    }

    /// The text that [`BodyParameters::parse`] reads, which can also be pasted into a body of a
    /// scene file.
    ///
    /// # Errors
    /// Errors of RON, which do not occur for valid parameters.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        let mut text = String::new();
        if let Some(density) = self.density {
            text.push_str(&format!("density: {:?},\n", density.get()));
        }
        text.push_str("effects: (\n");
        for (name, parameters) in self.effects.to_texts()? {
            text.push_str(&format!("    {name}: {parameters},\n"));
        }
        text.push_str("),\n");
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "density: 0.25,
effects: (
    stretch: (compliance: 0.0001, damping: 0.02),
    volume: (compliance: 0.000001),
    ground: (),
),
";

    #[test]
    fn parameters_survive_writing_and_reading() {
        let parameters = BodyParameters::parse("test", TEXT).expect("sound");
        assert_eq!(parameters.effects.names(), ["stretch", "volume", "ground"]);
        let written = parameters.to_text().expect("sound");
        let read = BodyParameters::parse("test", &written).expect(&written);
        assert_eq!(read, parameters, "{written}");
        let framed = format!("({written})");
        assert_eq!(BodyParameters::parse("test", &framed).ok(), Some(read));
    }

    #[test]
    fn the_text_can_be_pasted_into_a_scene_file() {
        let parameters = BodyParameters::parse("test", TEXT).expect("sound");
        let pasted = parameters.to_text().expect("sound");
        let scene = format!(
            "Scene(
                title: \"t\",
                look_at: \"l\",
                bodies: [(
                    name: \"cloth\",
                    primitive: Cloth(size: (1, 1), cells: (4, 4)),
                    {pasted}
                )],
                acceptance: (seconds: 1, checks: []),
            )"
        );
        let scene = super::super::Scene::parse("scene", &scene).expect(&scene);
        assert_eq!(scene.bodies[0].effects, parameters.effects);
        assert_eq!(scene.bodies[0].density, parameters.density);
    }

    #[test]
    fn an_error_names_the_line_of_the_text_and_what_is_wrong() {
        let wrong = TEXT.replace("damping: 0.02", "dampening: 0.02");
        let error = BodyParameters::parse("the clipboard", &wrong).expect_err("a wrong name");
        let error = error.to_string();
        assert!(error.starts_with("the clipboard:3:"), "{error}");
        assert!(error.contains("dampening"), "{error}");
        for text in ["", "hello", "effects: (stretch: (compliance: -1))"] {
            assert!(BodyParameters::parse("test", text).is_err(), "{text}");
        }
    }
}
