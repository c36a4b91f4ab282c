//! `pliant` without a command: opens the window, or runs the default scene headless if no window
//! can be opened.

use super::{
    CommandLine,
    run::{build, in_words},
    say::{FAILED, notes_text, say, say_line},
    threads::ThreadsOption,
};
use crate::{
    effect::OwnEffects,
    output::{csv, plot},
    recording::{Snapshot, is_snapshot, open_with},
    scene::{
        Scene, SceneError, name,
        registry::SCENES,
        run::{RunOptions, run},
    },
    solver::Threads,
    suggestion::similar_of,
};
use clap::{Args, CommandFactory};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// What the window opens with.
#[derive(Debug, Args)]
pub struct Window {
    /// Name of a built-in scene (see `pliant scenes`), or path of a scene file, snapshot or mesh
    /// (OBJ, glTF, Gmsh, TetGen, Medit), to open in the window; defaults to the last scene
    scene: Option<String>,

    #[command(flatten)]
    threads: ThreadsOption,

    /// Size of the window in pixels, as in 1280x800
    #[cfg(feature = "window")]
    #[arg(long, value_parser = size)]
    size: Option<(u32, u32)>,

    /// Write the events of the window as JSON lines, for scripted tests and demos; the window then
    /// closes without asking about unsaved changes
    #[cfg(feature = "window")]
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,

    /// Record all actions on the simulation, for `pliant replay FILE`
    #[cfg(feature = "window")]
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,

    /// Do not load or save settings (scene, window size, panel)
    #[cfg(feature = "window")]
    #[arg(long)]
    no_settings: bool,
}

#[cfg(feature = "window")]
fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(width, height)| {
        let side = |text: &str| {
            text.parse()
                .ok()
                .filter(|side| (200..=16_384).contains(side))
        };
        Some((side(width)?, side(height)?))
    });
    sides.ok_or_else(|| {
        "expected a size like 1280x800, each side from 200 to 16384 pixels".to_owned()
    })
}

impl Window {
    #[cfg(feature = "window")]
    pub fn run(self, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        use super::outputs::Outputs;
        use crate::{
            recording::Recorder,
            sandbox::{SandboxOptions, run},
        };
        let threads = self.threads.start()?;
        let mut outputs = Outputs::default();
        outputs.output("--record", self.record.as_ref());
        outputs.output("--journal", self.journal.as_ref());
        outputs.refuse_standard_output(&["--record", "--journal"])?;
        if let Some(scene) = &self.scene {
            outputs.input("the scene", scene);
        }
        for mesh in self.check_scene(own)? {
            outputs.input("a mesh of the scene", mesh);
        }
        outputs.check(None)?;
        if let Some(path) = &self.record {
            // Checked here, before the window opens and the scene runs.
            drop(Recorder::create(path)?);
        }
        let options = SandboxOptions {
            scene: self.scene.clone(),
            own_effects: own.clone(),
            journal: self.journal.clone(),
            record: self.record.clone(),
            no_settings: self.no_settings,
            size: self.size.map(Into::into),
            threads: Some(threads.clone()),
        };
        match run(&options) {
            Ok(exit) if exit.is_success() => Ok(ExitCode::SUCCESS),
            Ok(_) => Ok(ExitCode::from(FAILED)),
            Err(reason) => self.without_window(&reason.to_string(), own, threads),
        }
    }

    #[cfg(not(feature = "window"))]
    pub fn run(self, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        let threads = self.threads.start()?;
        self.check_scene(own)?;
        self.without_window(
            "this program was built without the window (feature `window`)",
            own,
            threads,
        )
    }

    /// Checks that the scene can be opened, so that an error appears here and not in the window.
    /// Returns its mesh files.
    fn check_scene(&self, own: &OwnEffects) -> anyhow::Result<Vec<PathBuf>> {
        if let Some(name) = &self.scene
            && !is_snapshot(Path::new(name))
        {
            let current = Scene::load_with(name, own).map_err(in_context)?;
            build(&current.scene)?;
            return Ok(current.scene.mesh_files());
        } else if let Some(name) = &self.scene {
            Snapshot::read_with(Path::new(name), own)?;
        }
        Ok(Vec::new())
    }

    /// Prints why the window cannot be opened, and runs the scene without it.
    fn without_window(
        &self,
        reason: &str,
        own: &OwnEffects,
        threads: Threads,
    ) -> anyhow::Result<ExitCode> {
        let name = self.scene.as_deref().unwrap_or(SCENES[0].name);
        say_line(format_args!(
            "No window: {reason}. Running {name} without a window, as `pliant run {name}` does."
        ))?;
        let (current, built) = open_with(name, own)?;
        let options = RunOptions {
            threads: Some(threads),
            ..current.scene.run_options()
        };
        let done = run(&built, &options, |_| ())?;
        let notes = [&built.notes[..], &done.notes].concat();
        say(notes_text(&notes) + &in_words(&current.scene.title, &done))?;
        let folder = folder()?;
        let (figures, picture) = (folder.join("run.csv"), folder.join("run.svg"));
        csv::write(&figures, &done.history)?;
        plot::write(&picture, &current.scene.title, &done.history)?;
        say_line(format_args!(
            "Statistics of every tick and a plot: {}",
            folder.display()
        ))?;
        Ok(if done.accepted() {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(FAILED)
        })
    }
}

/// The error for the first word of a command line that is neither a command nor a scene nor a file.
pub fn unknown_word(word: &str) -> Option<anyhow::Error> {
    let mut program = CommandLine::command();
    program.build();
    let is_command = program.find_subcommand(word).is_some();
    let error = name::unknown(word).filter(|_| !is_command && !word.starts_with('-'));
    error.map(in_context)
}

/// An error of the scene of the window. An unknown one may be a misspelled command, scene or file.
fn in_context(error: SceneError) -> anyhow::Error {
    let SceneError::Unknown { name, valid, files } = &error else {
        return anyhow::Error::new(error).context("cannot open the scene");
    };
    let program = CommandLine::command();
    let commands: Vec<&str> = program.get_subcommands().map(|it| it.get_name()).collect();
    let files = files.iter().map(String::as_str);
    let all = commands
        .iter()
        .copied()
        .chain(valid.split(", "))
        .chain(files);
    anyhow::anyhow!(
        "no such command, scene or file: “{name}”{}; expected a command ({}; see `pliant --help`), the path of a scene, \
         snapshot or mesh, or a built-in scene: {valid}",
        similar_of(name, all),
        commands.join(", ")
    )
}

/// Folder for the output files: in the current folder if possible, otherwise among temporary files.
fn folder() -> std::io::Result<PathBuf> {
    let here = std::env::current_dir()?.join("pliant-run");
    if std::fs::create_dir_all(&here).is_ok() {
        return Ok(here);
    }
    let elsewhere = std::env::temp_dir().join("pliant-run");
    std::fs::create_dir_all(&elsewhere)?;
    Ok(elsewhere)
}
