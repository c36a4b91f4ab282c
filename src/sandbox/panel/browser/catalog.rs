//! The scenes that the browser lists: those that are built in, read from their files once, and the
//! files that were opened.

use bevy::prelude::*;

use crate::{
    effect::EffectRegistry,
    sandbox::state::event::SceneLoaded,
    scene::{
        CurrentScene, Scene,
        registry::{BuiltinScene, Group, SCENES},
    },
};

/// A scene of the browser.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneEntry {
    /// Name by which it is opened: that of a built-in scene, or the path of a file.
    pub name: String,
    /// Title.
    pub title: String,
    /// Description.
    pub note: String,
    /// Its group; `None` for a file.
    pub group: Option<Group>,
    /// Titles of the effects of its bodies, separated by commas.
    pub effects: String,
    /// What the search compares, in lower case.
    words: String,
}

impl SceneEntry {
    /// An entry from its texts; `effects` are names and titles.
    #[must_use]
    pub fn new(
        (name, title, note): (&str, &str, &str),
        group: Option<Group>,
        effects: &[(&str, &str)],
    ) -> Self {
        let titles: Vec<&str> = effects.iter().map(|(_, title)| *title).collect();
        let names: Vec<&str> = effects.iter().map(|(name, _)| *name).collect();
        let effects = titles.join(", ");
        let names = names.join(" ");
        Self {
            words: format!("{name} {title} {note} {effects} {names}").to_lowercase(),
            name: name.to_owned(),
            title: title.to_owned(),
            note: note.to_owned(),
            group,
            effects,
        }
    }

    /// Whether every word of a query is part of the name, the title, the description, or the name
    /// or title of an effect.
    #[must_use]
    pub fn matches(&self, query: &str) -> bool {
        let query = query.to_lowercase();
        query
            .split_whitespace()
            .all(|word| self.words.contains(word))
    }

    fn of(name: &str, scene: &Scene, group: Option<Group>, registry: &EffectRegistry) -> Self {
        let mut effects: Vec<(&str, &str)> = registry
            .iter()
            .filter(|info| {
                let carries = |name: &&str| *name == info.name;
                let mut bodies = scene.bodies.iter();
                bodies.any(|body| body.effects.names().iter().any(carries))
            })
            .map(|info| (info.name, info.title))
            .collect();
        if scene.bodies.iter().any(|body| body.material.is_some()) {
            effects.push(("material", "Material"));
        }
        if scene.bodies.iter().any(|body| !body.stitches.is_empty()) {
            effects.push(("stitches", "Stitches"));
        }
        Self::new((name, &scene.title, &scene.look_at), group, &effects)
    }

    fn builtin(builtin: &BuiltinScene, registry: &EffectRegistry) -> Self {
        let group = Some(builtin.group);
        match builtin.text.parse::<Scene>() {
            Ok(scene) => Self::of(builtin.name, &scene, group, registry),
            // A scene that cannot be read is still listed; opening it shows the error.
            Err(error) => {
                let name = builtin.name;
                Self::new((name, name, &error.to_string()), group, &[])
            }
        }
    }
}

/// All scenes of the browser, ordered by group.
#[derive(Resource, Debug, Clone, Default)]
pub struct Catalog {
    builtin: Vec<SceneEntry>,
    files: Vec<SceneEntry>,
}

/// Maximum number of files that are listed.
const MAX_FILES: usize = 12;

impl Catalog {
    /// The scenes, in order: built-in ones by group, then files, the last one first.
    pub fn entries(&self) -> Vec<SceneEntry> {
        self.builtin.iter().chain(&self.files).cloned().collect()
    }

    /// Reads the built-in scenes, unless it was done before.
    pub(super) fn read(&mut self, registry: &EffectRegistry) {
        if self.builtin.is_empty() {
            let entries = SCENES.iter();
            self.builtin = entries
                .map(|builtin| SceneEntry::builtin(builtin, registry))
                .collect();
            self.builtin.sort_by_key(|entry| entry.group);
        }
    }

    fn add_file(&mut self, entry: SceneEntry) {
        self.files.retain(|other| other.name != entry.name);
        self.files.insert(0, entry);
        self.files.truncate(MAX_FILES);
    }
}

/// Lists a file that was opened.
pub(super) fn remember_files(
    mut loaded: MessageReader<SceneLoaded>,
    scene: Option<Res<CurrentScene>>,
    registry: Res<EffectRegistry>,
    mut catalog: ResMut<Catalog>,
) {
    let opened = loaded.read().any(|scene| scene.error.is_none());
    if let Some(scene) = scene.filter(|scene| opened && scene.path.is_some()) {
        let entry = SceneEntry::of(&scene.name, &scene.scene, None, &registry);
        catalog.add_file(entry);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str) -> SceneEntry {
        let effects = [("self_contact", "Self-contact"), ("bend", "Bend")];
        let texts = (name, "Folds", "A strip of cloth is let down.");
        SceneEntry::new(texts, Some(Group::Cloth), &effects)
    }

    #[test]
    fn a_query_matches_name_title_note_and_effects_word_by_word() {
        let entry = entry("my_folds");
        for query in ["", "FOLDS", "strip", "self_contact", "bend cloth", " my_ "] {
            assert!(entry.matches(query), "{query}");
        }
        for query in ["balloon", "bend balloon"] {
            assert!(!entry.matches(query), "{query}");
        }
    }

    #[test]
    fn the_last_opened_file_is_listed_first_and_only_once() {
        let mut catalog = Catalog::default();
        for name in ["a.ron", "b.ron", "a.ron"] {
            catalog.add_file(entry(name));
        }
        let names: Vec<String> = catalog.entries().into_iter().map(|it| it.name).collect();
        assert_eq!(names, ["a.ron", "b.ron"]);
    }
}
