//! The section of the world: substeps, iterations, rate, gravity and threads, and the throughput of
//! the solver.

use crate::sandbox::state::request::Request;
use bevy_egui::egui::{Align, Layout, RichText, Ui};

use super::{
    Panel,
    model::{PanelModel, Parameter},
    parameter::{self, Edit},
    search::Query,
    section::{self, RowButton, section},
};
use crate::sandbox::{panel::figures::millions, ui::theme};

/// Shown if only one thread is available.
const ONE_THREAD: &str = if cfg!(feature = "parallel") {
    "One thread: this machine has one core."
} else {
    "One thread: this program was built without the feature `parallel`."
};

/// Draws the rows of the world settings, named `world.<name>` among the widget rectangles.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "World", |ui, panel| {
        for setting in &model.settings {
            row(ui, panel, setting);
        }
        match &model.threads {
            Some(threads) => threads_row(ui, panel, threads),
            None => section::note(ui, ONE_THREAD),
        }
        projections(ui, panel, model);
        accuracy(ui, panel);
    });
}

/// Draws the settings that match a search, and returns whether there are any.
pub fn found(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let settings = model.settings.iter().filter(|it| query.finds(it));
    let settings: Vec<_> = settings.collect();
    let threads = model.threads.as_ref().filter(|it| query.finds(it));
    let accuracy_found = query.matches(&["Accuracy vs. cost error"]);
    let any = !settings.is_empty() || threads.is_some() || accuracy_found;
    if any {
        section::heading(ui, "World");
        for setting in settings {
            row(ui, panel, setting);
        }
        if let Some(threads) = threads {
            threads_row(ui, panel, threads);
        }
        if accuracy_found {
            accuracy(ui, panel);
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

fn accuracy(ui: &mut Ui, panel: &mut Panel) {
    let button = RowButton::new(
        "world.accuracy",
        "Accuracy vs. cost",
        "Measure error and time per tick at many settings, in the background (A)",
    );
    if section::button_row(ui, panel, &[button]).is_some() {
        panel.ask(Request::Accuracy);
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
