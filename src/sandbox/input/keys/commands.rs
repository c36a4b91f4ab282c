//! Carries out the commands of the keys.
//!
//! Commands that the panel also offers are sent as a [`Request`]; the others change or command the
//! view.

use crate::sandbox::state::{
    request::{Request, Requested},
    selection::{Scope, Selection},
    spawn::{MAX_BODIES, SpawnPlace},
};
use bevy::{ecs::system::SystemParam, prelude::*};
use std::time::{Duration, Instant};

use super::Command;
use crate::{
    sandbox::{
        input::pointer::Pointer,
        state::view::{HoveredPin, LastGrab, ViewCommand, ViewSettings},
    },
    simulation::{Pins, SimulationClock, SimulationSettings, SoftBody},
};

/// Shortest real time between two bodies of the rain of a held key.
const POUR: Duration = Duration::from_millis(150);

/// The rain of a held key.
#[derive(Debug, Default)]
pub(super) struct Pour {
    number: u32,
    last: Option<Instant>,
}

/// The state that commands read and change.
#[derive(SystemParam)]
pub(super) struct Commander<'w, 's> {
    view: ResMut<'w, ViewSettings>,
    clock: Res<'w, SimulationClock>,
    settings: Res<'w, SimulationSettings>,
    selection: Res<'w, Selection>,
    grab: Res<'w, LastGrab>,
    pointer: Res<'w, Pointer>,
    hovered_pin: Res<'w, HoveredPin>,
    bodies: Query<'w, 's, (&'static Pins, &'static SoftBody)>,
    pour: Local<'s, Pour>,
    requests: MessageWriter<'w, Requested>,
    commands: MessageWriter<'w, ViewCommand>,
}

impl Commander<'_, '_> {
    /// Carries out a command, of a key that was pressed or is held (`repeat`).
    pub(super) fn carry_out(&mut self, command: Command, repeat: bool) {
        match command {
            Command::Pause => self.ask(Request::Pause(!self.clock.paused)),
            Command::Step => self.ask(Request::Step),
            Command::StepBack => self.ask(Request::StepBack),
            Command::Undo => self.ask(Request::Undo),
            Command::Redo => self.ask(Request::Redo),
            Command::Restart => self.ask(Request::Restart),
            Command::Slow => {
                let slow = self.clock.speed < 1.0;
                self.ask(Request::Speed(if slow { 1.0 } else { 0.1 }));
            }
            Command::NextScene => self.ask(Request::NextScene),
            Command::PreviousScene => self.ask(Request::PreviousScene),
            Command::Pin => self.pin(),
            Command::UnpinAll => self.ask(Request::UnpinAll),
            Command::Drop if repeat => self.pour(),
            Command::Drop => self.ask(Request::Spawn(SpawnPlace::Pointer)),
            Command::Shoot => self.ask(Request::Spawn(SpawnPlace::Shot)),
            Command::Remove => self.ask(Request::Remove),
            Command::Softer => self.compliance(true),
            Command::Stiffer => self.compliance(false),
            Command::MoreSubsteps => self.substeps(true),
            Command::FewerSubsteps => self.substeps(false),
            Command::FrameAll => {
                self.commands.write(ViewCommand::FrameAll);
            }
            Command::Screenshot => {
                self.commands.write(ViewCommand::Screenshot);
            }
            Command::Contacts => self.view.contacts = !self.view.contacts,
            Command::Wireframe => self.view.wireframe = !self.view.wireframe,
            Command::Tetrahedra => self.view.tetrahedra = !self.view.tetrahedra,
            Command::Answers => self.view.answers = !self.view.answers,
            Command::SolverView => self.view.solver = self.view.solver.next(),
            Command::Accuracy => self.ask(Request::Accuracy),
            Command::Gallery => self.ask(Request::Gallery),
            Command::ReferenceOverlay => self.ask(Request::ReferenceOverlay),
            Command::Panel => self.view.panel_visible = !self.view.panel_visible,
            Command::Help => self.view.help_visible = !self.view.help_visible,
            Command::Close => self.view.help_visible = false,
        }
    }

    fn ask(&mut self, request: Request) {
        self.requests.write(Requested(request));
    }

    /// Pins or unpins the held point, the pin or the point under the pointer, or the point that was
    /// held last.
    fn pin(&mut self) {
        let held = self.grab.0.filter(|grab| grab.held);
        let held = held.map(|grab| (grab.body, grab.vertex));
        let hit = self.pointer.hit.filter(|_| !self.pointer.over_panel);
        let hit = hit.and_then(|hit| {
            let (_, topology) = self.bodies.get(hit.body).ok()?;
            Some((hit.body, topology.numbering.vertex(hit.point.nearest())))
        });
        let last = self.grab.0.map(|grab| (grab.body, grab.vertex));
        let Some((body, vertex)) = held.or(self.hovered_pin.0).or(hit).or(last) else {
            return;
        };
        let pins = self.bodies.get(body);
        let pinned = !pins.is_ok_and(|(pins, _)| pins.contains(&vertex));
        self.ask(Request::PinVertex {
            body,
            vertex,
            pinned,
        });
    }

    /// Drops one of many bodies, unless the last one fell too recently.
    fn pour(&mut self) {
        if self.pour.last.is_some_and(|last| last.elapsed() < POUR) {
            return;
        }
        self.pour.last = Some(Instant::now());
        if self.bodies.iter().count() >= MAX_BODIES {
            return;
        }
        self.pour.number = self.pour.number.wrapping_add(1);
        self.ask(Request::Spawn(SpawnPlace::Pour(self.pour.number)));
    }

    fn compliance(&mut self, softer: bool) {
        let held = self.grab.0.filter(|grab| grab.held);
        let scope = held.map_or(self.selection.0, |grab| Scope::Body(grab.body.to_bits()));
        self.ask(Request::Soften { scope, softer });
    }

    fn substeps(&mut self, more: bool) {
        let substeps = self.settings.substeps.get();
        let wanted = if more {
            substeps.saturating_add(1)
        } else {
            substeps.saturating_sub(1).max(1)
        };
        self.ask(Request::Setting {
            name: "substeps",
            value: Some(f64::from(wanted)),
        });
    }
}
