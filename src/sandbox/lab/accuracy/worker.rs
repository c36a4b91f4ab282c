//! The thread that measures while the window goes on.

use crate::{
    solver::{Body, World, modes::Modes},
    study::{Choice, Goal, ProbeNews, ProbePoint, Setting, choose, probe},
};
use std::{
    io,
    ops::ControlFlow,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver},
    },
    thread,
};

/// For how long the scene is continued [s].
pub const SECONDS: f64 = 0.5;

/// Sweeps a tick of the costliest setting of a survey.
const MAX_SWEEPS: u32 = 128;

/// What the thread is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Many settings, for the diagram.
    Survey,
    /// The one that meets a goal.
    Reach(Goal),
}

/// What the thread has to tell.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// The share of the work that is done, from 0 to 1.
    Share(f32),
    /// How fast the bodies swing by themselves.
    Modes(Modes),
    /// A setting was measured, for the first time or better than before.
    Point(ProbePoint),
    /// What was chosen; nothing if no setting held the body together.
    Chosen(Option<Choice>),
    /// It could not be done.
    Failed(String),
    /// It is over.
    Ended,
}

/// A thread at work; it stops when this is dropped.
#[derive(Debug)]
pub struct Worker {
    news: Mutex<Receiver<News>>,
    stop: Arc<AtomicBool>,
}

impl Worker {
    /// Begins with a copy of a world.
    ///
    /// # Errors
    /// When the system refuses to start a thread.
    pub fn start(world: World, task: Task) -> io::Result<Self> {
        let (sender, news) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        thread::Builder::new()
            .name("what accuracy costs".to_owned())
            .spawn(move || {
                let tell = |news: ProbeNews| {
                    let news = match news {
                        ProbeNews::Share(share) => News::Share(share as f32),
                        ProbeNews::Point(point) => News::Point(point),
                    };
                    if stopped.load(Ordering::Relaxed) || sender.send(news).is_err() {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                };
                if let (Task::Survey, Some(modes)) = (task, modes(&world)) {
                    let _heard = sender.send(News::Modes(modes));
                }
                let last = match task {
                    Task::Survey => probe(&world, SECONDS, &survey(&world), tell).map(|_| None),
                    Task::Reach(goal) => {
                        let chosen = choose(&world, SECONDS, goal, tell);
                        chosen.map(|choice| Some(News::Chosen(choice)))
                    }
                };
                let last = last.unwrap_or_else(|error| Some(News::Failed(error.to_string())));
                // Whoever asked may be gone.
                let _heard = last.map(|news| sender.send(news));
                let _heard = sender.send(News::Ended);
            })?;
        Ok(Self {
            news: Mutex::new(news),
            stop,
        })
    }

    /// What has been found since the last time.
    pub fn news(&self) -> Vec<News> {
        let news = self.news.lock().unwrap_or_else(PoisonError::into_inner);
        news.try_iter().collect()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The stiffest and the softest mode of all bodies.
fn modes(world: &World) -> Option<Modes> {
    let of = |body: &Body| Modes::of(&body.topology, &body.particles, &body.effects);
    let all = world.bodies.iter().filter_map(of);
    all.reduce(|a, b| Modes {
        stiffest: a.stiffest.max(b.stiffest),
        softest: match (a.softest, b.softest) {
            (Some(a), Some(b)) => Some(a.min(b)),
            _ => None,
        },
    })
}

/// The setting of the world itself, and powers of two around it.
fn survey(world: &World) -> Vec<Setting> {
    let here = Setting::xpbd(
        world.settings.substeps.get(),
        world.settings.iterations.get(),
    );
    let powers = |most: u32| (0..=most.ilog2()).map(|power| 1 << power);
    let grid = powers(16).flat_map(|iterations| {
        powers(MAX_SWEEPS / iterations).map(move |substeps| Setting::xpbd(substeps, iterations))
    });
    let mut settings: Vec<_> = grid.filter(|setting| *setting != here).collect();
    // From the cheapest on, so that the diagram fills soon; and what is on screen before all.
    settings.sort_by_key(|setting| setting.substeps * setting.iterations);
    settings.insert(0, here);
    settings
}
