//! The effects of a body in a scene file: those of the crate as fields, those of an app by name.

use crate::{
    effect::{
        OwnEffect, OwnEffectError, OwnEffects,
        own::{options, to_text},
    },
    solver::{self, Effects},
    suggestion::{similar_of, with_similar},
};
use ron::{de::Deserializer as Ron, extensions::Extensions, value::RawValue};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, DeserializeSeed, MapAccess, Visitor},
    ser::{self, SerializeStruct},
};
use std::{cell::RefCell, fmt, mem};

macro_rules! named_by_a_scene {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        named_by_a_scene! {
            $grabbed
            $($($kind1 $field1 $does1;)*)*
            $($($kind2 $field2 $does2;)*)*
            $($($kind3 $field3 $does3;)*)*
        }
    };
    ($grabbed:ident $($kind:ident $field:ident $does:literal;)*) => {
        /// The effects that a scene file may contain.
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct SceneEffects {
            $(#[doc = $does] pub $field: Option<solver::$kind>,)*
            /// Effects of an app, in the order in which they act. In a file they stand among the
            /// others, by their names.
            pub own: Vec<OwnEffect>,
        }

        /// Names of the effects of the crate in scene files.
        const NAMES: &[&str] = &[$(stringify!($field),)*];

        impl SceneEffects {
            /// Names of the effects that are present, in the order of the solver.
            #[must_use]
            pub fn names(&self) -> Vec<&'static str> {
                let mut names = Vec::new();
                $(if self.$field.is_some() {
                    names.push(stringify!($field));
                })*
                names.extend(self.own.iter().map(OwnEffect::name));
                names
            }

            /// Each effect that is present, with its parameters in the syntax of scene files.
            ///
            /// # Errors
            /// Errors of RON, which do not occur for valid effects.
            pub fn to_texts(&self) -> Result<Vec<(&'static str, String)>, ron::Error> {
                let mut texts = Vec::new();
                $(if let Some(effect) = &self.$field {
                    texts.push((stringify!($field), to_text(effect)?));
                })*
                let own = self.own.iter();
                texts.extend(own.map(|effect| (effect.name(), effect.text().to_owned())));
                Ok(texts)
            }

            /// Reads the value of an effect of the crate; false if the name is of an app's.
            fn read_field<'de, A: MapAccess<'de>>(
                &mut self,
                name: &str,
                map: &mut A,
            ) -> Result<bool, A::Error> {
                match name {
                    $(stringify!($field) => self.$field = map.next_value()?,)*
                    _ => return Ok(false),
                }
                Ok(true)
            }
        }

        impl Serialize for SceneEffects {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let count = NAMES.len() + self.own.len();
                let mut fields = serializer.serialize_struct(STRUCT, count)?;
                $(fields.serialize_field(stringify!($field), &self.$field)?;)*
                for effect in &self.own {
                    let text = RawValue::from_ron(effect.text()).map_err(ser::Error::custom)?;
                    fields.serialize_field(effect.name(), text)?;
                }
                fields.end()
            }
        }

        impl From<Effects> for SceneEffects {
            /// Without the grab.
            fn from(effects: Effects) -> Self {
                Self {
                    $($field: effects.$field,)*
                    own: Vec::new(),
                }
            }
        }

        impl From<&SceneEffects> for Effects {
            /// Those of the crate.
            fn from(effects: &SceneEffects) -> Self {
                Self {
                    $($field: effects.$field,)*
                    $grabbed: None,
                }
            }
        }
    };
}

solver::effects!(named_by_a_scene);

/// Name of the struct in files.
const STRUCT: &str = "SceneEffects";

impl<'de> Deserialize<'de> for SceneEffects {
    /// Effects of an app are known within [`parse_with`](super::parse_with).
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct(STRUCT, NAMES, OfBody)
    }
}

/// Reads the effects of a body.
struct OfBody;

impl<'de> Visitor<'de> for OfBody {
    type Value = SceneEffects;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the effects of a body")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<SceneEffects, A::Error> {
        let (known, extensions) = known();
        let mut effects = SceneEffects::default();
        let mut before = Vec::new();
        while let Some(name) = map.next_key_seed(NameOf(&known))? {
            if before.contains(&name) {
                let message = format!("duplicate effect `{name}`");
                return Err(de::Error::custom(message));
            }
            if !effects.read_field(&name, &mut map)? {
                effects
                    .own
                    .extend(own(&known, extensions, &name, map.next_value()?)?);
            }
            before.push(name);
        }
        known.sort(&mut effects.own);
        Ok(effects)
    }
}

/// Reads the name of an effect that is known.
struct NameOf<'a>(&'a OwnEffects);

impl<'de> DeserializeSeed<'de> for NameOf<'_> {
    type Value = String;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<String, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for NameOf<'_> {
    type Value = String;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the name of an effect")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<String, E> {
        let mut all = NAMES.iter().copied().chain(self.0.names());
        if all.any(|known| known == name) {
            return Ok(name.to_owned());
        }
        let all = || NAMES.iter().copied().chain(self.0.names());
        let valid: Vec<_> = all().map(|known| format!("`{known}`")).collect();
        Err(E::custom(format!(
            "unknown effect `{name}`{}; expected one of {}; for an effect of your app, add its plugin \
             with `EffectPlugin::saved`",
            similar_of(name, all()),
            valid.join(", ")
        )))
    }
}

/// Parses an effect of an app; nothing if the file says `None` and that is no value of the effect, as of
/// an `enum` with a variant of this name.
fn own<E: de::Error>(
    known: &OwnEffects,
    extensions: Extensions,
    name: &str,
    raw: &RawValue,
) -> Result<Option<OwnEffect>, E> {
    let text = raw.get_ron();
    let effect = known.read_with(name, text, extensions).transpose();
    if matches!(effect, Err(OwnEffectError::Syntax { .. })) && text.trim() == "None" {
        return Ok(None);
    }
    effect.map_err(|error| {
        let message = E::custom(&error);
        note_error(name, text, error);
        message
    })
}

thread_local! {
    /// What is read on this thread. Serde passes no context to the effects of a body, which are
    /// deep inside of a scene.
    static READING: RefCell<Option<Reading>> = const { RefCell::new(None) };
}

/// The text that is read.
struct Reading {
    known: OwnEffects,
    /// What the text enables.
    extensions: Extensions,
    /// Address of the text.
    start: usize,
    error: Option<ErrorInEffect>,
}

/// An error in the parameters of an effect of an app.
struct ErrorInEffect {
    /// Bytes of the text before the parameters.
    offset: usize,
    name: String,
    error: OwnEffectError,
}

fn known() -> (OwnEffects, Extensions) {
    READING.with_borrow(|reading| match reading {
        Some(it) => (it.known.clone(), it.extensions),
        None => (OwnEffects::default(), Extensions::empty()),
    })
}

fn note_error(name: &str, text: &str, error: OwnEffectError) {
    READING.with_borrow_mut(|reading| {
        if let Some(reading) = reading {
            reading.error = Some(ErrorInEffect {
                offset: (text.as_ptr() as usize).saturating_sub(reading.start),
                name: name.to_owned(),
                error,
            });
        }
    });
}

/// Puts back what was read before, also after a panic.
struct PutBack(Option<Reading>);

impl Drop for PutBack {
    fn drop(&mut self) {
        READING.set(self.0.take());
    }
}

/// Place and cause of an error in a text: line and column from 1, and a message.
pub(super) type Place = (usize, usize, String);

/// Parses a text in which bodies may have these effects of an app.
pub(super) fn read<T: de::DeserializeOwned>(known: &OwnEffects, text: &str) -> Result<T, Place> {
    let attributes = Ron::from_str_with_options(text, &options());
    let reading = Reading {
        known: known.clone(),
        // An error in them is that of the whole text.
        extensions: attributes.map_or(Extensions::empty(), |it| it.extensions()),
        start: text.as_ptr() as usize,
        error: None,
    };
    let _before = PutBack(READING.replace(Some(reading)));
    let result = options().from_str(text);
    let inner = READING.with_borrow_mut(|it| it.as_mut().and_then(|it| mem::take(&mut it.error)));
    result.map_err(|error| match inner {
        Some(inner) => inner.place(text),
        None => {
            let start = error.span.start;
            (start.line, start.col, with_similar(&error.code))
        }
    })
}

impl ErrorInEffect {
    /// Where it is in the whole text.
    fn place(self, text: &str) -> Place {
        let before = text.get(..self.offset).unwrap_or_default();
        let line = before.matches('\n').count();
        let column = before.chars().rev().take_while(|c| *c != '\n').count();
        let in_effect = |message: String| format!("{}: {message}", self.name);
        match self.error {
            OwnEffectError::Syntax {
                line: 1,
                column: inner,
                message,
            } => (line + 1, column + inner, in_effect(message)),
            OwnEffectError::Syntax {
                line: inner,
                column,
                message,
            } => (line + inner, column, in_effect(message)),
            error => (line + 1, column + 1, in_effect(error.to_string())),
        }
    }
}
