//! `pliant scenes`.

use super::say::say_line;
use crate::scene::{Scene, registry::SCENES};
use clap::Args;
use serde_json::json;
#[cfg(feature = "window")]
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Lists the built-in scenes.
///
/// Example: pliant scenes --json
#[derive(Debug, Args)]
pub struct Scenes {
    /// Print a JSON array of objects with name, group, title, look_at, bodies and seconds
    #[arg(long)]
    json: bool,

    /// Write the pictures of the scene browser into this folder, as NAME.png (needs a graphics
    /// adapter, but no display)
    #[cfg(feature = "window")]
    #[arg(long, value_name = "FOLDER", conflicts_with = "json")]
    pictures: Option<PathBuf>,

    /// With --pictures: only these scenes
    #[cfg(feature = "window")]
    #[arg(value_name = "SCENE", requires = "pictures")]
    only: Vec<String>,
}

impl Scenes {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        #[cfg(feature = "window")]
        if let Some(folder) = &self.pictures {
            return pictures(folder, &self.only);
        }
        let mut rows = Vec::new();
        for builtin in SCENES {
            let scene = Scene::load(builtin.name)?.scene;
            if self.json {
                rows.push(json!({
                    "name": builtin.name,
                    "group": builtin.group.title(),
                    "title": scene.title,
                    "look_at": scene.look_at,
                    "bodies": scene.bodies.len(),
                    "seconds": scene.acceptance.seconds,
                }));
            } else {
                say_line(format_args!("{:<20} {}", builtin.name, scene.look_at))?;
            }
        }
        if self.json {
            say_line(serde_json::to_string_pretty(&rows)?)?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Renders each scene at the moment that the registry names.
#[cfg(feature = "window")]
fn pictures(folder: &Path, only: &[String]) -> anyhow::Result<ExitCode> {
    use super::run::now;
    use crate::{
        sandbox::app::picture,
        scene::{
            SceneError, registry,
            run::{RunOptions, headless, prepare, run_in},
        },
    };
    use std::ops::ControlFlow;
    if let Some(name) = only.iter().find(|name| registry::find(name).is_none()) {
        return Err(SceneError::Unknown {
            name: name.clone(),
            valid: registry::names(),
            files: Vec::new(),
        }
        .into());
    }
    if !folder.is_dir() {
        anyhow::bail!(
            "cannot write pictures: the folder {} does not exist",
            folder.display()
        );
    }
    let wanted = |name: &str| only.is_empty() || only.iter().any(|other| other == name);
    for builtin in SCENES.iter().filter(|builtin| wanted(builtin.name)) {
        let built = Scene::load(builtin.name)?.scene.build()?;
        let options = RunOptions {
            seconds: Some(builtin.moment),
            ..RunOptions::default()
        };
        let mut app = headless(&built);
        prepare(&mut app, &options)?;
        run_in(&mut app, &options, |_, _| ControlFlow::Continue(()));
        let built = now(&mut app, &built)?;
        let path = folder.join(builtin.name).with_extension("png");
        picture::thumbnail(&built, built.camera, &path)?;
        say_line(path.display())?;
    }
    Ok(ExitCode::SUCCESS)
}
