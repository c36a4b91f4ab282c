//! The thread that steps the f64 references along with the simulation.

use super::{
    bodies::{Comparison, Moment, ReferenceBodies, Seen},
    pace::{Pace, fitting},
};
use crate::{
    sandbox::lab::worker::{Reporter, Worker},
    solver::World,
};
use bevy::ecs::entity::Entity;
use std::{
    io,
    sync::{
        Arc,
        mpsc::{self, Receiver, Sender},
    },
    time::Instant,
};

/// Handle of the thread of the references.
#[derive(Debug)]
pub struct Follower {
    moments: Sender<Arc<Moment>>,
    worker: Worker<Comparison>,
}

impl Follower {
    /// Starts references of the bodies of a world, which belong to `entities` in the same order: as
    /// many as can keep up with `room` seconds per tick. The first comparison is of the initial
    /// state.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start(world: World, entities: Vec<Entity>, room: f64) -> io::Result<Self> {
        let (moments, orders) = mpsc::channel();
        let worker = Worker::start("reference overlay", move |reporter| {
            live(world, &entities, room, &orders, reporter);
        })?;
        Ok(Self { moments, worker })
    }

    /// Sends a tick to the references. Returns whether the thread is running.
    pub fn send(&self, moment: Arc<Moment>) -> bool {
        self.moments.send(moment).is_ok()
    }

    /// Comparisons since the last call.
    pub fn comparisons(&self) -> Vec<Comparison> {
        self.worker.news()
    }
}

/// Main loop of the thread. Ends when the other side of either channel is dropped.
fn live(
    mut world: World,
    entities: &[Entity],
    room: f64,
    moments: &Receiver<Arc<Moment>>,
    reporter: &Reporter<Comparison>,
) {
    let (count, tick) = fitting(&world, room);
    world.bodies.truncate(count);
    let mut pace = Pace::new(tick, &world.settings, room);
    let settings = pace.settings(&world.settings);
    if reporter.is_stopped() {
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
    while reporter.tell(comparison) {
        let Ok(moment) = moments.recv() else {
            return;
        };
        if reporter.is_stopped() {
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
