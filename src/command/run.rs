//! `pliant run`.

mod ablate;

use super::{
    interrupt::{Interrupt, STOPPED},
    outputs::{Outputs, STANDARD_OUTPUT, check_extension},
    say::{FAILED, counted, notes_text, say, say_line},
    threads::ThreadsOption,
};
use crate::{
    effect::OwnEffects,
    output::{csv, json, plot, warnings::warnings},
    recording::{About, Recorder, Snapshot, is_snapshot},
    scene::{
        Acceptance, BuiltScene, CurrentScene, Scene, SceneError,
        overrides::Override,
        run::{Run, RunOptions, headless, prepare, run_in},
    },
    simulation::EnergyLedger,
};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    time::Duration,
};

/// Runs a scene without a window and checks its acceptance criteria.
///
/// The exit code is 1 if a criterion fails.
///
/// Example: pliant run jelly_cube --set substeps=20 --set stretch.compliance=1e-5 --csv cube.csv
///
/// Example: pliant run jelly_cube --seconds 1 --snapshot cube.snap, then pliant run --from
/// cube.snap
///
/// Example: pliant run cloth_lab --ablate
#[derive(Debug, Args)]
pub struct RunScene {
    /// Name of a built-in scene (see `pliant scenes`), or path of a scene file, snapshot or mesh
    #[arg(required_unless_present = "from")]
    scene: Option<String>,

    /// Continue from a snapshot, bit-identical to an uninterrupted run. Checks only that the state
    /// is finite and that pins do not move
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    from: Option<PathBuf>,

    /// Simulated time [s]; defaults to that of the scene, and to 5 s for a snapshot
    #[arg(long, value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,

    /// Set a world setting (substeps, iterations, rate, gravity_x, gravity_y, gravity_z, …), or a
    /// parameter of an effect on all bodies that carry it, as in stretch.compliance=1e-5
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<Override>,

    #[command(flatten)]
    threads: ThreadsOption,

    /// Write a snapshot of the final state, for --from or to be opened in the window
    #[arg(long, value_name = "FILE")]
    snapshot: Option<PathBuf>,

    /// Write a recording for `pliant replay`
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,

    /// Write the statistics of every tick as CSV; - for the standard output, instead of the summary
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write a plot of the run as SVG
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,

    /// Write an image of the final state (needs a graphics adapter, but no display)
    #[cfg(feature = "window")]
    #[arg(long, value_name = "FILE.png")]
    screenshot: Option<PathBuf>,

    /// Let an output replace a file that the run reads, such as its scene
    #[arg(long)]
    overwrite: bool,

    /// Track the sources and sinks of energy. Steps take about three times as long
    #[arg(long)]
    ledger: bool,

    /// Run the scene with and without each of its effects: what each costs, and how far the bodies
    /// end elsewhere without it, after 2 s or --seconds. Close other programs
    #[arg(long, conflicts_with_all = ["snapshot", "record", "csv", "plot", "ledger"])]
    #[cfg_attr(feature = "window", arg(conflicts_with = "screenshot"))]
    ablate: bool,

    /// Print one JSON object instead of a text summary
    #[arg(long)]
    json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e6 => Ok(seconds),
        _ => Err("expected a number of seconds above 0 and at most 1e6".to_owned()),
    }
}

impl RunScene {
    pub fn run(self, own: &OwnEffects) -> anyhow::Result<ExitCode> {
        let threads = self.threads.start()?;
        if self.ablate {
            return self.ablate(threads, own);
        }
        self.check_outputs(&[])?;
        let (current, built, acceptance) = self.open(own)?;
        self.check_outputs(&current.scene.mesh_files())?;
        let options = RunOptions {
            seconds: self.seconds,
            set: self.set.clone(),
            threads: Some(threads),
            ledger: self.ledger,
            contacts: self.json,
            acceptance,
        };
        let mut app = headless(&built);
        prepare(&mut app, &options)?;
        if let Some(path) = &self.record {
            Recorder::create(path)?.install(&mut app);
            Recorder::scene_opened(app.world_mut(), About::from(&current));
        }
        let bar = progress_bar();
        let interrupt = Interrupt::watch();
        let done = run_in(&mut app, &options, |fraction, _| {
            bar.set_position((fraction * 1000.0) as u64);
            interrupt.flow()
        });
        let notes = [&built.notes[..], &done.notes].concat();
        bar.finish_and_clear();
        interrupt.release();
        Recorder::end(app.world_mut());
        if let Some(recorder) = app.world().get_resource::<Recorder>()
            && let Some(reason) = recorder.failure()
        {
            anyhow::bail!(
                "{}: the recording failed: {reason}",
                recorder.path().display()
            );
        }
        if let Some(path) = &self.snapshot {
            Snapshot::take(app.world_mut(), About::from(&current))?.write(path)?;
        }
        let is_csv_printed = self.prints_csv();
        if let Some(path) = self.csv.as_ref().filter(|_| !is_csv_printed) {
            csv::write(path, &done.history)?;
        }
        if let Some(path) = &self.plot {
            plot::write(path, &self.title(&current.scene.title), &done.history)?;
        }
        #[cfg(feature = "window")]
        if let Some(path) = &self.screenshot {
            let built = now(&mut app, &built)?;
            let size = bevy::math::UVec2::new(1280, 800);
            crate::sandbox::app::picture::picture(&built, built.camera, path, size)?;
        }
        if is_csv_printed {
            let text = csv::text(&done.history).map_err(|error| anyhow::anyhow!("{error}"))?;
            say(String::from_utf8_lossy(&text))?;
        } else if self.json {
            let mut summary = json::run(&current.name, &done);
            summary["notes"] = notes.into();
            say_line(serde_json::to_string_pretty(&summary)?)?;
        } else {
            say(notes_text(&notes) + &in_words(&current.scene.title, &done))?;
        }
        Ok(match done.accepted() {
            true => ExitCode::SUCCESS,
            false if done.stopped => ExitCode::from(STOPPED),
            false => ExitCode::from(FAILED),
        })
    }
}

/// The scene of an app in its current state, for pictures: bodies may have appeared, disappeared and
/// torn.
#[cfg(feature = "window")]
pub(super) fn now(app: &mut bevy::app::App, built: &BuiltScene) -> anyhow::Result<BuiltScene> {
    let about = About {
        camera: built.camera,
        ..About::default()
    };
    Ok(BuiltScene {
        frame: built.frame,
        ..Snapshot::take(app.world_mut(), about)?.built
    })
}

impl RunScene {
    /// Title of a scene with what is set otherwise.
    fn title(&self, scene: &str) -> String {
        let set = self.set.iter();
        let set: Vec<_> = set.map(|it| format!("{}={}", it.name, it.value)).collect();
        match set.is_empty() {
            true => scene.to_owned(),
            false => format!("{scene}: {}", set.join(", ")),
        }
    }

    /// Loads and builds the scene or snapshot, with its acceptance criteria.
    fn open(
        &self,
        own: &OwnEffects,
    ) -> anyhow::Result<(CurrentScene, BuiltScene, Option<Acceptance>)> {
        let named = self.scene.as_deref().map(Path::new);
        let from = self
            .from
            .as_deref()
            .or(named.filter(|path| is_snapshot(path)));
        if let Some(path) = from {
            let snapshot = Snapshot::read_with(path, own)?;
            return Ok((snapshot.scene(), snapshot.built, None));
        }
        let current = Scene::load_with(self.scene.as_deref().unwrap_or_default(), own)?;
        let built = build(&current.scene)?;
        let acceptance = Some(current.scene.acceptance.clone());
        Ok((current, built, acceptance))
    }

    /// Whether the standard output is for CSV.
    fn prints_csv(&self) -> bool {
        let csv = self.csv.as_ref();
        csv.is_some_and(|file| file.as_os_str() == STANDARD_OUTPUT)
    }

    /// Checks the output files, before anything runs. `meshes` are the mesh files of the scene.
    fn check_outputs(&self, meshes: &[PathBuf]) -> anyhow::Result<()> {
        check_extension("--plot", self.plot.as_ref(), "plots are written", "svg")?;
        let mut outputs = Outputs::default();
        outputs.output("--csv", self.csv.as_ref());
        outputs.output("--plot", self.plot.as_ref());
        outputs.output("--snapshot", self.snapshot.as_ref());
        outputs.output("--record", self.record.as_ref());
        #[cfg(feature = "window")]
        {
            let image = self.screenshot.as_ref();
            check_extension("--screenshot", image, "images are written", "png")?;
            outputs.output("--screenshot", image);
        }
        outputs.refuse_standard_output(&["--snapshot", "--record"])?;
        if self.prints_csv() && self.json {
            anyhow::bail!("--csv - and --json both write to the standard output; use one of them");
        }
        if let Some(scene) = &self.scene {
            outputs.input("the scene", scene);
        }
        if let Some(snapshot) = &self.from {
            outputs.input("the snapshot", snapshot);
        }
        for mesh in meshes {
            outputs.input("a mesh of the scene", mesh);
        }
        outputs.check(Some(self.overwrite))
    }
}

/// Builds a scene. Shows a message if the output is a terminal, as a large scene takes seconds.
pub fn build(scene: &Scene) -> Result<BuiltScene, SceneError> {
    let spinner = ProgressBar::new_spinner().with_message("building the scene");
    spinner.enable_steady_tick(Duration::from_millis(100));
    let built = scene.build();
    spinner.finish_and_clear();
    built
}

/// Progress bar of a long run; hidden if the output is not a terminal.
pub fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent} % · {eta} left") {
        bar.set_style(style);
    }
    bar
}

/// Warnings as text, one per line.
fn warnings_text(run: &Run) -> String {
    let warnings = warnings(run).into_iter();
    warnings.map(|it| format!("warning: {it}\n")).collect()
}

/// The energy ledger as text.
fn ledger_text(ledger: &EnergyLedger) -> String {
    let rows = ledger.rows().into_iter();
    let rows: Vec<_> = rows
        .map(|(name, energy)| format!("{name} {energy:+.6}"))
        .collect();
    format!(
        "energy change {:+.6} J: {} (J; balance error {:+.1e})\n",
        ledger.change(),
        rows.join(", "),
        ledger.gap(),
    )
}

/// The summary as text.
pub fn in_words(title: &str, run: &Run) -> String {
    let last = run.history.last().cloned().unwrap_or_default();
    let constraints: Vec<_> = last
        .constraints
        .iter()
        .map(|(effect, count)| format!("{count} {effect}"))
        .collect();
    let verdict = if run.accepted() && run.criteria == 0 {
        "accepted, but by no criteria: there are none. The state is finite, and no pin moved"
            .to_owned()
    } else if run.accepted() {
        "accepted".to_owned()
    } else if run.stopped {
        format!("stopped before {} s: acceptance not checked", run.seconds)
    } else {
        format!("failed:\n  {}", run.reasons.join("\n  "))
    };
    let times = run.median_times();
    format!(
        "{title}: {:.3} s in {} of {} and {}\n\
         {} ({} asleep), {}, constraints: {}\n\
         {:.3} ms per tick in the solver (median, {}; measuring {:.3}, ECS {:.3}), energy {:.6} J, {}residual {:.2e}\n\
         {}{}state {:016x}, {verdict}\n",
        last.time,
        counted(last.tick as usize, "tick"),
        counted(run.settings.substeps.get() as usize, "substep"),
        counted(run.settings.iterations.get() as usize, "iteration"),
        match last.bodies {
            1 => "1 body".to_owned(),
            count => format!("{count} bodies"),
        },
        last.asleep,
        counted(last.particles, "particle"),
        constraints.join(", "),
        times.solver,
        counted(run.world.threads.count(), "thread"),
        times.measuring,
        times.ecs,
        last.energy(),
        last.volume_error.map_or_else(String::new, |error| format!(
            "volume error {:.3} %, ",
            error * 100.0
        )),
        last.residual,
        warnings_text(run),
        run.ledger.as_ref().map(ledger_text).unwrap_or_default(),
        run.state_hash,
    )
}
