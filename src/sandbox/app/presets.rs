//! Files of the user's presets: one for each in the folder `presets` beside the settings, in the
//! syntax of scene files.
//!
//! A file that cannot be read is reported and left alone. Without settings, presets last until the
//! window closes.

use super::bodies::{self, report};
use crate::{
    effect::OwnEffects,
    file as whole_file,
    sandbox::{
        state::{
            presets::{Preset, Presets},
            selection::Scope,
        },
        ui::message::Notices,
    },
    scene::{self, BodyParameters, Material, SceneEffects, SceneError},
    simulation::SoftBody,
    solver::{Density, topology::Dimension},
};
use bevy::{platform::dirs::preferences_dir, prelude::*};
use serde::Deserialize;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Folder of the presets; `None` without settings.
#[derive(Resource, Debug, Default)]
pub struct PresetFolder(Option<PathBuf>);

/// Loads the presets of the settings folder.
pub fn load(world: &mut World) {
    let folder = preferences_dir().map(|folder| folder.join("pliant").join("presets"));
    let own = bodies::own_effects(world);
    let presets = folder.as_deref().map(|folder| read_all(folder, &own));
    let (presets, errors) = presets.unwrap_or_default();
    world.insert_resource(PresetFolder(folder));
    world.insert_resource(Presets(presets));
    for error in errors {
        let text = format!("Preset ignored: {error}");
        world.resource_mut::<Notices>().warn(text);
    }
}

/// Saves the parameters of the first body of a scope under a name, and replaces a preset of this
/// name.
pub fn save(world: &mut World, scope: &Scope, name: &str) {
    let name = name.trim();
    let Some(body) = bodies::bodies(world, scope).first().copied() else {
        let text = "Nothing to save: the scene has no bodies";
        world.resource_mut::<Notices>().info(text);
        return;
    };
    if name.is_empty() {
        let text = "Preset is not saved: type a name first";
        world.resource_mut::<Notices>().warn(text);
        return;
    }
    if Material::all().iter().any(|it| it.title == name) {
        let text =
            format!("Preset is not saved: {name} is a built-in material; choose another name");
        world.resource_mut::<Notices>().warn(text);
        return;
    }
    let (Some(parameters), Some(topology)) =
        (bodies::parameters(world, body), world.get::<SoftBody>(body))
    else {
        return;
    };
    let parameters = match parameters {
        Ok(parameters) => parameters,
        Err(error) => {
            let text = format!("Preset is not saved: {error}");
            world.resource_mut::<Notices>().warn(text);
            return;
        }
    };
    let preset = Preset {
        name: name.to_owned(),
        dimension: topology.dimension,
        parameters,
    };
    let folder = world.get_resource::<PresetFolder>();
    let folder = folder.and_then(|folder| folder.0.clone());
    if let Some(folder) = folder {
        if let Some(path) = other_file(&folder, name, &bodies::own_effects(world)) {
            let text = format!(
                "Preset is not saved: {} has another content, which would be lost; choose another name",
                path.display()
            );
            world.resource_mut::<Notices>().warn(text);
            return;
        }
        if let Err(error) = write(&folder, &preset) {
            let text = format!("cannot save the preset in {}: {error}", folder.display());
            report(world, &text);
            return;
        }
    } else {
        let text = "Settings are off: the preset lasts until the window closes";
        world.resource_mut::<Notices>().info(text);
    }
    let of = bodies::name_of(world, body);
    let mut presets = world.resource_mut::<Presets>();
    presets.retain(|other| other.name != preset.name);
    presets.push(preset);
    presets.sort_by(|a, b| a.name.cmp(&b.name));
    let text = format!("Saved preset {name} from {of}");
    world.resource_mut::<Notices>().info(text);
}

/// Applies a preset to the bodies of a scope for which it is.
pub fn apply(world: &mut World, scope: &Scope, name: &str) {
    let presets = world.resource::<Presets>();
    let Some(preset) = presets.iter().find(|it| it.name == name).cloned() else {
        return;
    };
    let mut fitting = bodies::bodies(world, scope);
    fitting.retain(|body| {
        let topology = world.get::<SoftBody>(*body);
        topology.is_some_and(|topology| topology.dimension == preset.dimension)
    });
    if !fitting.is_empty() {
        let scope = Scope::of(fitting.iter().map(|body| body.to_bits()));
        bodies::apply(world, &scope, &preset.parameters);
    }
}

/// Deletes a preset and its file.
pub fn delete(world: &mut World, name: &str) {
    let folder = world.get_resource::<PresetFolder>();
    let folder = folder.and_then(|folder| folder.0.clone());
    let own = bodies::own_effects(world);
    for path in folder.map(|folder| files(&folder)).unwrap_or_default() {
        let is_it = read(&path, &own).is_ok_and(|preset| preset.name == name);
        if is_it && let Err(error) = fs::remove_file(&path) {
            let text = format!("cannot delete {}: {error}", path.display());
            report(world, &text);
            return;
        }
    }
    world.resource_mut::<Presets>().retain(|it| it.name != name);
}

/// The file of a preset. Characters that file systems treat specially are replaced by their code.
fn file(folder: &Path, name: &str) -> PathBuf {
    let mut stem = String::new();
    for c in name.chars() {
        if c.is_alphanumeric() || c == ' ' || c == '-' {
            stem.push(c);
        } else {
            stem.push_str(&format!("_{:x}_", u32::from(c)));
        }
    }
    folder.join(format!("{stem}.ron"))
}

/// The file of a name if it is there and no preset of this name, as one of a program with other effects.
fn other_file(folder: &Path, name: &str, own: &OwnEffects) -> Option<PathBuf> {
    let path = file(folder, name);
    let is_it = || read(&path, own).is_ok_and(|preset| preset.name == name);
    (path.exists() && !is_it()).then_some(path)
}

const DIMENSIONS: [(&str, Dimension); 4] = [
    ("solid", Dimension::Solid),
    ("cloth", Dimension::Sheet),
    ("rope", Dimension::Line),
    ("grains", Dimension::Grains),
];

/// The content of a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    name: String,
    /// `solid`, `cloth` or `rope`.
    body: String,
    #[serde(default)]
    density: Option<Density>,
    effects: SceneEffects,
}

fn write(folder: &Path, preset: &Preset) -> io::Result<()> {
    let body = DIMENSIONS
        .iter()
        .find(|(_, it)| *it == preset.dimension)
        .map_or("", |(word, _)| word);
    let text = preset.parameters.to_text().map_err(io::Error::other)?;
    let name = &preset.name;
    fs::create_dir_all(folder)?;
    let text = format!("(\nname: {name:?},\nbody: {body:?},\n{text})\n");
    whole_file::replace(&file(folder, name), text.as_bytes())
}

/// The files in the folder, in the order of their names.
fn files(folder: &Path) -> Vec<PathBuf> {
    // There is no folder before the first preset is saved.
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "ron"));
    paths.sort();
    paths
}

fn read_all(folder: &Path, own: &OwnEffects) -> (Vec<Preset>, Vec<String>) {
    let (mut presets, mut errors) = (Vec::new(), Vec::new());
    for path in files(folder) {
        match read(&path, own) {
            Ok(preset) => presets.push(preset),
            Err(error) => errors.push(error),
        }
    }
    presets.sort_by(|a: &Preset, b| a.name.cmp(&b.name));
    (presets, errors)
}

fn read(path: &Path, own: &OwnEffects) -> Result<Preset, String> {
    let shown = path.display().to_string();
    let text = fs::read_to_string(path).map_err(|error| format!("{shown}: {error}"))?;
    let stored: Stored =
        scene::parse_with(&shown, &text, own).map_err(|error: SceneError| error.to_string())?;
    let dimension = DIMENSIONS.iter().find(|(word, _)| *word == stored.body);
    let Some(&(_, dimension)) = dimension else {
        return Err(format!(
            "{shown}: body is “{}”, but must be solid, cloth, rope or grains",
            stored.body
        ));
    };
    Ok(Preset {
        name: stored.name,
        dimension,
        parameters: BodyParameters {
            density: stored.density,
            effects: stored.effects,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preset_is_read_back_from_its_file_and_a_broken_file_is_reported() {
        let folder = std::env::temp_dir().join(format!("pliant presets {}", std::process::id()));
        let parameters = "density: 0.5, effects: (stretch: (compliance: 1e-4), wind: ())";
        let preset = Preset {
            name: "My \"cloth\" 1/2".to_owned(),
            dimension: Dimension::Sheet,
            parameters: BodyParameters::parse("test", parameters).expect("sound"),
        };
        write(&folder, &preset).expect("the temporary folder is writable");
        let broken = folder.join("broken.ron");
        fs::write(&broken, "(name: \"x\", body: \"gas\", effects: ())").expect("writable");
        let of_another = file(&folder, "Breezy");
        fs::write(
            &of_another,
            "(name: \"Breezy\", body: \"cloth\", effects: (breeze: ()))",
        )
        .expect("writable");
        let (presets, errors) = read_all(&folder, &OwnEffects::default());
        let other = |name| other_file(&folder, name, &OwnEffects::default());
        assert_eq!(other("Breezy"), Some(of_another));
        assert_eq!([other("My \"cloth\" 1/2"), other("New")], [None, None]);
        fs::remove_dir_all(&folder).expect("it was created");
        assert_eq!(presets, [preset]);
        assert_eq!(errors.len(), 2, "{errors:?}");
        assert!(errors[0].contains("unknown effect `breeze`"), "{errors:?}");
        assert!(
            errors[1].contains("must be solid, cloth, rope or grains"),
            "{errors:?}"
        );
    }
}
