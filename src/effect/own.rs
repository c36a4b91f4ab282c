//! Effects of an app in files: by their names, with their parameters as text.

use super::{Effect, EffectPlugin, EffectPlugins, EffectRegistry, registry::say_missing};
use crate::suggestion::with_similar;
use bevy::{ecs::world::DeferredWorld, prelude::*};
use ron::{Options, error::SpannedError, extensions::Extensions, ser::PrettyConfig};
use serde::{Serialize, de::DeserializeOwned};
use std::{
    collections::BTreeSet,
    fmt,
    sync::{Mutex, PoisonError},
};

/// The effects of an app that scene files, snapshots and recordings may contain, in the order in
/// which they act. None by default.
///
/// Functions that read files without an app take them; [`EffectRegistry::own`] returns those of a
/// running app.
///
/// ```
/// # use bevy::prelude::*;
/// # use pliant::effect::*;
/// # use serde::{Deserialize, Serialize};
/// #[derive(Component, Serialize, Deserialize)]
/// struct Breeze {
///     acceleration: f32, // m/s²
/// }
/// # impl Effect for Breeze {
/// #     const NAME: &'static str = "breeze";
/// #     const TITLE: &'static str = "Breeze";
/// #     const SUMMARY: &'static str = "Pushes a body along x.";
/// #     type State = ();
/// # }
///
/// let own = OwnEffects::default().with::<Breeze>();
/// let text = r#"Scene(
///     title: "Breeze",
///     look_at: "It drifts.",
///     bodies: [(
///         name: "cube",
///         primitive: Box(size: (1, 1, 1), cells: (2, 2, 2)),
///         effects: (stretch: (), breeze: (acceleration: 2)),
///     )],
///     acceptance: (seconds: 1, checks: []),
/// )"#;
/// let scene = pliant::scene::Scene::parse_with("breeze.ron", text, &own)?;
/// let mut app = pliant::scene::run::headless(&scene.build()?); // with the plugin of `Breeze`
/// let breeze = app.world_mut().query::<&Breeze>().single(app.world())?;
/// assert_eq!(breeze.acceleration, 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnEffects(Vec<OwnKind>);

/// An effect of an app, with its functions without its type.
#[derive(Clone, Copy)]
pub(super) struct OwnKind {
    name: &'static str,
    add_plugin: fn(&mut App),
    /// Parses a text of a file with these extensions of RON, and writes it as it is stored.
    normalized: fn(&str, Extensions) -> Result<String, OwnEffectError>,
    read: fn(&EntityRef) -> Option<Result<String, OwnEffectError>>,
    insert: fn(&mut EntityWorldMut, &str),
    remove: fn(&mut EntityWorldMut),
    /// Whether it has a state besides the component.
    has_state: bool,
}

/// An effect of an app on a body, as files contain it.
#[derive(Clone, PartialEq)]
pub struct OwnEffect {
    kind: OwnKind,
    text: String,
}

/// Why the text of an effect of an app is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OwnEffectError {
    /// It cannot be parsed.
    #[error("{line}:{column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Found and expected syntax.
        message: String,
    },
    /// It was parsed, and cannot be written.
    #[error("it cannot be written: {0}")]
    Write(ron::Error),
    /// It was written, and the text cannot be parsed again.
    #[error(
        "it is written as `{text}`, which cannot be read back: {message}; its `Serialize` and `Deserialize` \
         must agree"
    )]
    ReadBack {
        /// The written parameters.
        text: String,
        /// Place, found and expected syntax.
        message: String,
    },
}

/// Effects of which the log has said that they are not kept: moments are taken in each tick.
static SAID: Mutex<BTreeSet<&str>> = Mutex::new(BTreeSet::new());

impl OwnKind {
    /// The functions of an effect.
    ///
    /// # Panics
    /// If the effect is of the crate, or its name is no identifier.
    pub(super) fn of<E: Effect + Serialize + DeserializeOwned>() -> Self {
        let name = E::NAME;
        assert!(
            !EffectPlugins::NAMES.contains(&name),
            "the effect “{name}” is built in, and is saved already; give an effect of your own \
             another name"
        );
        let mut letters = name.chars();
        let starts = letters
            .next()
            .is_some_and(|first| first.is_ascii_alphabetic());
        assert!(
            starts && letters.all(|c| c.is_ascii_alphanumeric() || c == '_'),
            "the effect “{name}” cannot be saved: scene files need a name of ASCII letters, digits \
             and underscores that begins with a letter"
        );
        Self {
            name,
            add_plugin: |app| {
                app.add_plugins(EffectPlugin::<E>::default().saved());
            },
            normalized: |text, extensions| {
                let options = options().with_default_extension(extensions);
                let effect: E = options
                    .from_str(text)
                    .map_err(|error| OwnEffectError::Syntax {
                        line: error.span.start.line,
                        column: error.span.start.col,
                        message: with_similar(&error.code),
                    })?;
                to_readable_text(&effect)
            },
            read: |body| body.get::<E>().map(to_readable_text),
            insert: |body, text| match from_text::<E>(text) {
                Ok(effect) => {
                    body.insert(effect);
                    let entity = body.id();
                    body.world_scope(|world| say_missing::<E>(DeferredWorld::from(world), entity));
                }
                Err(error) => log::error!("{name} was not added: {error}", name = E::NAME),
            },
            remove: |body| {
                body.remove::<E>();
            },
            has_state: size_of::<E::State>() > 0,
        }
    }
}

impl PartialEq for OwnKind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl fmt::Debug for OwnKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl OwnEffects {
    /// The same with another effect, which acts after these.
    ///
    /// # Panics
    /// If there is one of its name already, the crate has one of its name, or the name is no
    /// identifier.
    #[must_use]
    pub fn with<E: Effect + Serialize + DeserializeOwned>(mut self) -> Self {
        assert!(
            !self.names().any(|name| name == E::NAME),
            "there is an effect called “{}” already; give this one another name",
            E::NAME
        );
        self.0.push(OwnKind::of::<E>());
        self
    }

    /// The effects of an app that has these kinds.
    pub(super) fn of(kinds: impl Iterator<Item = OwnKind>) -> Self {
        Self(kinds.collect())
    }

    /// Names of the effects.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|kind| kind.name)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds the plugins of these effects to an app that does not have them.
    pub fn add_to(&self, app: &mut App) {
        for kind in &self.0 {
            let registry = app.world().get_resource::<EffectRegistry>();
            if registry.is_none_or(|registry| registry.get(kind.name).is_none()) {
                (kind.add_plugin)(app);
            }
        }
    }

    /// Those of these effects that a body carries.
    ///
    /// # Errors
    /// The name of an effect whose component cannot be written as text, or not read back from it, and
    /// the error.
    pub fn of_body(
        &self,
        body: &EntityRef,
    ) -> Result<Vec<OwnEffect>, (&'static str, OwnEffectError)> {
        let carried = self.0.iter().filter_map(|kind| {
            let text = (kind.read)(body)?;
            let effect = text.map(|text| OwnEffect { kind: *kind, text });
            Some(effect.map_err(|error| (kind.name, error)))
        });
        carried.collect()
    }

    /// The same for a body of an app. An effect whose text cannot be written or read back is left out,
    /// and the log says so once.
    pub(crate) fn of_entity(&self, body: &EntityRef) -> Vec<OwnEffect> {
        let carried = self.0.iter().filter_map(|kind| match (kind.read)(body)? {
            Ok(text) => Some(OwnEffect { kind: *kind, text }),
            Err(error) => {
                let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
                if said.insert(kind.name) {
                    log::error!("{} of body {} is not kept: {error}", kind.name, body.id());
                }
                None
            }
        });
        carried.collect()
    }

    /// Gives a body these effects, with a new state, and removes all others of this list that can be
    /// written.
    pub(crate) fn set(&self, body: &mut EntityWorldMut, effects: &[OwnEffect]) {
        for kind in &self.0 {
            match effects.iter().find(|effect| effect.kind == *kind) {
                Some(effect) => {
                    if kind.has_state {
                        (kind.remove)(body);
                    }
                    effect.insert(body);
                }
                None if (kind.read)(&EntityRef::from(&*body)).is_some_and(|it| it.is_err()) => {}
                None => (kind.remove)(body),
            }
        }
    }

    /// An effect from its parameters as text; `None` if there is none of this name.
    #[must_use]
    pub fn read(&self, name: &str, text: &str) -> Option<Result<OwnEffect, OwnEffectError>> {
        self.read_with(name, text, Extensions::empty())
    }

    /// The same with the extensions of RON that the file enables.
    pub(crate) fn read_with(
        &self,
        name: &str,
        text: &str,
        extensions: Extensions,
    ) -> Option<Result<OwnEffect, OwnEffectError>> {
        let kind = *self.0.iter().find(|kind| kind.name == name)?;
        let text = (kind.normalized)(text, extensions);
        Some(text.map(|text| OwnEffect { kind, text }))
    }

    /// Sorts effects of a body in the order of this list.
    pub(crate) fn sort(&self, effects: &mut [OwnEffect]) {
        effects.sort_by_key(|effect| self.names().position(|name| name == effect.name()));
    }
}

impl OwnEffect {
    /// An effect with the parameters of a component.
    ///
    /// # Errors
    /// If it cannot be written as text, or not read back from it.
    ///
    /// # Panics
    /// As [`OwnEffects::with`].
    pub fn new<E: Effect + Serialize + DeserializeOwned>(
        effect: &E,
    ) -> Result<Self, OwnEffectError> {
        Ok(Self {
            kind: OwnKind::of::<E>(),
            text: to_readable_text(effect)?,
        })
    }

    /// Its name.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.kind.name
    }

    /// Its parameters in the syntax of scene files, in one line.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Inserts the component. An app without the plugin of the effect is told that the component does
    /// nothing, with [`EffectUnfit`](super::EffectUnfit) and in the log.
    pub fn insert(&self, body: &mut EntityWorldMut) {
        (self.kind.insert)(body, &self.text);
    }
}

impl fmt::Debug for OwnEffect {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.kind.name, self.text)
    }
}

/// The options of scene files.
pub(crate) fn options() -> Options {
    Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// The parameters of an effect in one line.
pub(crate) fn to_text(effect: &impl Serialize) -> Result<String, ron::Error> {
    let line = PrettyConfig::new()
        .new_line("")
        .indentor("")
        .separator(" ")
        .compact_structs(true);
    options().to_string_pretty(effect, line)
}

/// The same, if it can be read back.
fn to_readable_text<E: Serialize + DeserializeOwned>(effect: &E) -> Result<String, OwnEffectError> {
    let text = to_text(effect).map_err(OwnEffectError::Write)?;
    match from_text::<E>(&text) {
        Ok(_) => Ok(text),
        Err(error) => {
            let message = error.to_string();
            Err(OwnEffectError::ReadBack { text, message })
        }
    }
}

fn from_text<E: DeserializeOwned>(text: &str) -> Result<E, SpannedError> {
    options().from_str(text)
}
