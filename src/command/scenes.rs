//! `pliant scenes`.

use super::say_line;
use clap::Args;
use pliant::scene::{Scene, registry::SCENES};
use serde_json::json;
use std::process::ExitCode;

/// Lists the built-in scenes.
///
/// Example: pliant scenes --json
#[derive(Debug, Args)]
pub struct Scenes {
    /// Print a JSON array of objects with name, title, look_at, bodies and seconds
    #[arg(long)]
    json: bool,
}

impl Scenes {
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let mut rows = Vec::new();
        for builtin in SCENES {
            let scene = Scene::load(builtin.name)?.scene;
            if self.json {
                rows.push(json!({
                    "name": builtin.name,
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
