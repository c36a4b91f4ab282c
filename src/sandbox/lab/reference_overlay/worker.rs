//! The thread that the reference overlays live on.

use super::{
    bodies::{Comparison, Moment, ReferenceBodies, Seen},
    pace::{Pace, fitting},
};
use crate::solver::World;
use bevy::ecs::entity::Entity;
use std::{
    io,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver, Sender},
    },
    thread,
    time::Instant,
};

/// A thread at work; it ends when this is dropped.
#[derive(Debug)]
pub struct Worker {
    moments: Sender<Arc<Moment>>,
    comparisons: Mutex<Receiver<Comparison>>,
    stop: Arc<AtomicBool>,
}

impl Worker {
    /// Begins reference overlays of the bodies of a world, those that `entities` name in their order, of as many
    /// as keep pace where `room` seconds are there for each tick. The first comparison is of where
    /// they begin.
    ///
    /// # Errors
    /// When the system refuses to start a thread.
    pub fn start(world: World, entities: Vec<Entity>, room: f64) -> io::Result<Self> {
        let (moments, orders) = mpsc::channel();
        let (news, comparisons) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        thread::Builder::new()
            .name("reference_overlay".to_owned())
            .spawn(move || {
                let stopped = || stopped.load(Ordering::Relaxed);
                live(world, &entities, room, &orders, &news, stopped);
            })?;
        Ok(Self {
            moments,
            comparisons: Mutex::new(comparisons),
            stop,
        })
    }

    /// Lets the reference overlays do a tick. Returns whether anybody listens.
    pub fn send(&self, moment: Arc<Moment>) -> bool {
        self.moments.send(moment).is_ok()
    }

    /// What has been compared since the last time.
    pub fn comparisons(&self) -> Vec<Comparison> {
        let comparisons = self.comparisons.lock();
        let comparisons = comparisons.unwrap_or_else(PoisonError::into_inner);
        comparisons.try_iter().collect()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The life of the thread: until nobody sends or listens any more.
fn live(
    mut world: World,
    entities: &[Entity],
    room: f64,
    moments: &Receiver<Arc<Moment>>,
    news: &Sender<Comparison>,
    stopped: impl Fn() -> bool,
) {
    let (count, tick) = fitting(&world, room);
    world.bodies.truncate(count);
    let mut pace = Pace::new(tick, &world.settings, room);
    let settings = pace.settings(&world.settings);
    if stopped() {
        return;
    }
    let mut references = ReferenceBodies::begin(&world, entities, settings);
    let bodies = world.bodies.iter().zip(entities);
    let start: Vec<Seen> = bodies
        .map(|(body, &entity)| Seen {
            body: entity,
            effects: body.effects,
            positions: body.particles.positions.clone(),
            asleep: body.asleep,
        })
        .collect();
    let mut comparison = references.compare(world.tick, settings.substeps.get(), &start);
    drop((world, start));
    while news.send(comparison).is_ok() {
        let Ok(moment) = moments.recv() else {
            return;
        };
        if stopped() {
            return;
        }
        let started = Instant::now();
        pace.follow(&moment.settings, moment.room);
        let settings = pace.settings(&moment.settings);
        let stepped = references.follow(&moment, settings);
        comparison = references.compare(moment.tick, settings.substeps.get(), &moment.bodies);
        if stepped {
            let spent = started.elapsed().as_secs_f64();
            pace.observe(spent, &moment.settings, moment.room);
        }
    }
}
