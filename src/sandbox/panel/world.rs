//! The section of the world: speed, iterations, rate, gravity and threads, and the throughput of the
//! solver. Folded, it shows what differs from the defaults of the program.

use crate::sandbox::state::request::Request;
use bevy_egui::egui::{Align, Layout, RichText, Ui};

use super::{
    Panel,
    model::{PanelModel, Parameter},
    parameter::{self, Edit},
    query::Query,
    section::{self, folded_section},
};
use crate::sandbox::{
    panel::figures::millions,
    ui::{
        theme,
        track::{Spread, Track},
    },
};

/// Shown if only one thread is available.
const ONE_THREAD: &str = if cfg!(feature = "parallel") {
    "One thread: this machine has one core."
} else {
    "One thread: this program was built without the feature `parallel`."
};

/// Draws the rows of the world settings, named `world.<name>` among the widget rectangles.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    folded_section(ui, panel, "World", |ui, panel, is_open| {
        let speed = speed(model);
        if is_open || speed.unusual {
            speed_row(ui, panel, &speed);
        }
        let rest = model.settings.iter().filter(|it| it.name != SUBSTEPS);
        for setting in rest.filter(|it| is_open || it.unusual) {
            row(ui, panel, setting);
        }
        if is_open {
            match &model.threads {
                Some(threads) => threads_row(ui, panel, threads),
                None => section::note(ui, ONE_THREAD),
            }
            projections(ui, panel, model);
        }
    });
}

/// The setting that is [always in sight](super::essentials).
const SUBSTEPS: &str = "substeps";

/// Draws the row of the substeps.
pub fn substeps(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    if let Some(setting) = model.settings.iter().find(|it| it.name == SUBSTEPS) {
        row(ui, panel, setting);
    }
}

/// The speed of the clock as a parameter.
fn speed(model: &PanelModel) -> Parameter {
    let value = model.clock.speed;
    Parameter {
        choices: &[],
        name: "speed",
        title: "Speed",
        unit: "×",
        help: "Simulated seconds per second of real time. It changes only the playback, not the \
               result.",
        track: Track::new(0.01..=4.0, Spread::Logarithmic),
        value,
        spread: None,
        original: Some(1.0),
        changed: value != 1.0,
        unusual: value != 1.0,
    }
}

fn speed_row(ui: &mut Ui, panel: &mut Panel, speed: &Parameter) {
    if let Some(edit) = parameter::row(ui, panel, ("speed", None), speed) {
        panel.ask(Request::Speed(match edit {
            Edit::Set(value) => value,
            Edit::Reset => 1.0,
        }));
    }
}

/// Draws the settings that match a search, and returns whether there are any.
pub fn found(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let speed = Some(speed(model)).filter(|it| query.finds(it));
    let settings = model.settings.iter().filter(|it| query.finds(it));
    let settings = settings.filter(|it| it.name != SUBSTEPS);
    let settings: Vec<_> = settings.collect();
    let threads = model.threads.as_ref().filter(|it| query.finds(it));
    let any = speed.is_some() || !settings.is_empty() || threads.is_some();
    if any {
        section::heading(ui, "World");
        if let Some(speed) = speed {
            speed_row(ui, panel, &speed);
        }
        for setting in settings {
            row(ui, panel, setting);
        }
        if let Some(threads) = threads {
            threads_row(ui, panel, threads);
        }
    }
    any
}

fn row(ui: &mut Ui, panel: &mut Panel, setting: &Parameter) {
    let name = format!("world.{}", setting.name);
    if let Some(edit) = parameter::row(ui, panel, (&name, Some(setting.name)), setting) {
        panel.ask(Request::Setting {
            name: setting.name,
            value: match edit {
                Edit::Set(value) => Some(value),
                Edit::Reset => None,
            },
        });
    }
}

fn threads_row(ui: &mut Ui, panel: &mut Panel, threads: &Parameter) {
    if let Some(edit) = parameter::row(ui, panel, ("world.threads", None), threads) {
        panel.ask(Request::Threads(match edit {
            Edit::Set(value) => Some(value),
            Edit::Reset => None,
        }));
    }
}

/// A read-only figure in the column of the entries.
fn projections(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let row = ui.horizontal(|ui| {
        ui.set_min_height(theme::ROW);
        ui.label("Projections");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add_space(parameter::RESET + theme::GAP);
            let figure = millions(model.projections);
            ui.label(RichText::new(figure).small().color(theme::of(ui).strong));
        });
    });
    panel.note("world.projections", &row.response, ui);
    section::hint(ui, &row.response, |ui| {
        ui.set_max_width(280.0);
        ui.label(RichText::new("Projections [million/s]").strong());
        ui.label(
            "Constraint projections per second of solver time: the constraints of awake bodies, \
             times substeps, times iterations, divided by the time of a tick.",
        );
        ui.weak(
            "The open panel profiles the parts of a tick, which takes a little time. Hide it (H) \
             and read the figure in the status line for the undisturbed rate.",
        );
    });
}
