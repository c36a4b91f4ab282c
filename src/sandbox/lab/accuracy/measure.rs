//! Measurements on a background thread.

use crate::{
    sandbox::lab::worker::Worker,
    solver::{Body, World, modes::Modes},
    study::{Choice, Goal, ProbeNews, ProbePoint, Setting, choose, probe},
};
use std::{io, ops::ControlFlow};

/// Simulated time of each run [s].
pub const SECONDS: f64 = 0.5;

/// Iterations per tick of the costliest setting of a survey.
const MAX_ITERATIONS: u32 = 128;

/// Task of the thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Measures many settings for the diagram.
    Survey,
    /// Searches for the setting that meets a goal.
    Reach(Goal),
}

/// Messages of the thread.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// Completed fraction of the work, from 0 to 1.
    Progress(f32),
    /// Stiffest and softest vibration mode of the bodies.
    Modes(Modes),
    /// A setting was measured, or its time was updated.
    Point(ProbePoint),
    /// The chosen setting; `None` if the body diverged at all settings.
    Chosen(Option<Choice>),
    /// Reason why the measurement failed.
    Failed(String),
    /// The thread has finished.
    Ended,
}

/// Starts a thread that measures a copy of a world.
///
/// # Errors
/// An I/O error if the thread cannot be started.
pub fn measure(world: World, task: Task) -> io::Result<Worker<News>> {
    Worker::start("what accuracy costs", move |reporter| {
        let tell = |news: ProbeNews| {
            let news = match news {
                ProbeNews::Progress(fraction) => News::Progress(fraction as f32),
                ProbeNews::Point(point) => News::Point(point),
            };
            match reporter.tell(news) {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        };
        if let (Task::Survey, Some(modes)) = (task, modes(&world)) {
            reporter.tell(News::Modes(modes));
        }
        let last = match task {
            Task::Survey => probe(&world, SECONDS, &survey(&world), tell).map(|_| None),
            Task::Reach(goal) => {
                let chosen = choose(&world, SECONDS, goal, tell);
                chosen.map(|choice| Some(News::Chosen(choice)))
            }
        };
        let last = last.unwrap_or_else(|error| Some(News::Failed(error.to_string())));
        if last.is_none_or(|news| reporter.tell(news)) {
            reporter.tell(News::Ended);
        }
    })
}

/// The stiffest and the softest mode of all bodies.
fn modes(world: &World) -> Option<Modes> {
    let of = |body: &Body| Modes::of(&body.topology, &body.particles, &body.effects);
    let all = world.bodies.iter().filter_map(of);
    all.reduce(Modes::and)
}

/// The setting of the world itself, and powers of two around it.
fn survey(world: &World) -> Vec<Setting> {
    let here = Setting::xpbd(
        world.settings.substeps.get(),
        world.settings.iterations.get(),
    );
    let powers = |most: u32| (0..=most.ilog2()).map(|power| 1 << power);
    let grid = powers(16).flat_map(|iterations| {
        powers(MAX_ITERATIONS / iterations).map(move |substeps| Setting::xpbd(substeps, iterations))
    });
    let mut settings: Vec<_> = grid.filter(|setting| *setting != here).collect();
    // The current setting first, then in ascending order of cost, so that the diagram fills early.
    settings.sort_by_key(|setting| setting.substeps * setting.iterations);
    settings.insert(0, here);
    settings
}
