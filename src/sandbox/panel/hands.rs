//! Rows of the panel for grabbing and shooting.

use super::{
    Panel,
    model::{PanelModel, Parameter},
    parameter::{self, Edit},
    section::{self, RowButton},
};
use crate::sandbox::{
    state::{
        hands::{Hands, HandsChange, RADII, SPEEDS, STIFFNESSES, Shot},
        request::Request,
    },
    ui::track::{Spread, Track},
};
use bevy_egui::egui::Ui;
use std::ops::RangeInclusive;

/// Radius and stiffness of the grab.
pub(super) fn grab(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let (hands, usual) = (model.hands, Hands::default());
    let radius = number(
        ("radius", "Grab radius", "m"),
        "Brush radius in the rest shape, for grab, pin and unpin. 0: one point.",
        Track::new(wide(&RADII), Spread::Linear),
        (hands.radius, usual.radius),
    );
    row(ui, panel, "hands.radius", &radius, HandsChange::Radius);
    let stiffness = number(
        ("stiffness", "Grab stiffness", "×"),
        "Relative stiffness of the mouse spring. 1: lifting the body stretches it by 5 % of the \
         body's size.",
        Track::new(wide(&STIFFNESSES), Spread::Logarithmic),
        (hands.stiffness, usual.stiffness),
    );
    row(
        ui,
        panel,
        "hands.stiffness",
        &stiffness,
        HandsChange::Stiffness,
    );
}

/// What is shot, and how fast.
pub(super) fn shooting(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let (hands, usual) = (model.hands, Hands::default());
    let buttons = [
        RowButton {
            selected: hands.shot == Shot::Ball,
            ..RowButton::new(
                "shot.ball",
                "Shoot a ball",
                "The key X shoots a ball of half the size towards the pointer",
            )
        },
        RowButton {
            selected: hands.shot == Shot::Chosen,
            ..RowButton::new(
                "shot.chosen",
                "Shoot the body",
                "The key X shoots the chosen body towards the pointer",
            )
        },
    ];
    match section::button_row(ui, panel, &buttons) {
        Some(0) => panel.ask(Request::Hands(HandsChange::Shot(Shot::Ball))),
        Some(_) => panel.ask(Request::Hands(HandsChange::Shot(Shot::Chosen))),
        None => {}
    }
    let speed = number(
        ("speed", "Speed", "m/s"),
        "Speed of bodies that are shot (X)",
        Track::new(wide(&SPEEDS), Spread::Logarithmic),
        (hands.speed, usual.speed),
    );
    row(ui, panel, "hands.speed", &speed, HandsChange::Speed);
}

fn wide(range: &RangeInclusive<f32>) -> RangeInclusive<f64> {
    f64::from(*range.start())..=f64::from(*range.end())
}

fn number(
    (name, title, unit): (&'static str, &'static str, &'static str),
    help: &'static str,
    track: Track,
    (value, usual): (f32, f32),
) -> Parameter {
    // The shortest decimals that give the number, without digits of the conversion.
    let exact = |value: f32| {
        value
            .to_string()
            .parse()
            .unwrap_or_else(|_| f64::from(value))
    };
    Parameter {
        name,
        title,
        unit,
        help,
        track,
        value: exact(value),
        spread: None,
        original: Some(exact(usual)),
        choices: &[],
        changed: value != usual,
        unusual: false,
    }
}

fn row(
    ui: &mut Ui,
    panel: &mut Panel,
    name: &str,
    parameter: &Parameter,
    change: impl Fn(f64) -> HandsChange,
) {
    let value = match parameter::row(ui, panel, (name, None), parameter) {
        Some(Edit::Set(value)) => Some(value),
        Some(Edit::Reset) => parameter.original,
        None => None,
    };
    if let Some(value) = value {
        panel.ask(Request::Hands(change(value)));
    }
}
