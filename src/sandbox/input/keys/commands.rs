//! Carries out the commands of the keys.
//!
//! Commands that the panel also offers are sent as a [`Request`]; the others change or command the
//! view.

use crate::sandbox::state::{
    keep::KeepRequest,
    request::{Request, Requested},
    selection::{Scope, Selection},
    spawn::SpawnPlace,
};
use bevy::{ecs::system::SystemParam, prelude::*};

use super::Command;
use crate::{
    sandbox::state::view::{LastGrab, ViewCommand, ViewSettings},
    simulation::{Pins, SimulationClock, SimulationSettings},
};

/// The state that commands read and change.
#[derive(SystemParam)]
pub(super) struct Commander<'w, 's> {
    view: ResMut<'w, ViewSettings>,
    clock: Res<'w, SimulationClock>,
    settings: Res<'w, SimulationSettings>,
    selection: Res<'w, Selection>,
    grab: Res<'w, LastGrab>,
    pins: Query<'w, 's, &'static Pins>,
    requests: MessageWriter<'w, Requested>,
    commands: MessageWriter<'w, ViewCommand>,
}

impl Commander<'_, '_> {
    pub(super) fn carry_out(&mut self, command: Command) {
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
            Command::Drop => self.ask(Request::Spawn(SpawnPlace::Pointer)),
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
            Command::PlainPicture => self.ask(Request::Keep(KeepRequest::PlainPicture)),
            Command::Save => self.ask(Request::Keep(KeepRequest::Save)),
            Command::Record => self.ask(Request::Keep(KeepRequest::Record)),
            Command::Film => self.ask(Request::Film),
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

    fn pin(&mut self) {
        if let Some(grab) = self.grab.0 {
            let pinned = self
                .pins
                .get(grab.body)
                .is_ok_and(|pins| pins.contains(&grab.vertex));
            self.ask(Request::Pin(!pinned));
        }
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
