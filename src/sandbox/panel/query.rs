//! The words of a search.

use super::model::Parameter;

/// The words of a search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Query(Vec<String>);

impl Query {
    /// The words of a text; `None` without any.
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        let text = text.to_lowercase();
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        (!words.is_empty()).then_some(Self(words))
    }

    /// Whether every word is part of one of the texts.
    #[must_use]
    pub fn matches(&self, texts: &[&str]) -> bool {
        let texts: Vec<String> = texts.iter().map(|text| text.to_lowercase()).collect();
        let found = |word: &String| texts.iter().any(|text| text.contains(word));
        self.0.iter().all(found)
    }

    /// Whether a parameter matches by its name, its title or its description.
    #[must_use]
    pub fn finds(&self, parameter: &Parameter) -> bool {
        self.matches(&[parameter.name, parameter.title, parameter.help])
    }
}
