//! The scale of the interface: follows the setting, or the size of the window.
//!
//! Changes the scale factor of the window and not only of egui, so that everything that is drawn
//! over the picture and the pointer stay in the same logical pixels.

use crate::sandbox::state::{
    display::{DisplayChange, DisplaySettings, SCALE_STEPS, automatic_scale},
    request::{Request, RequestSystems, Requested},
};
use bevy::{
    input::{
        ButtonState,
        keyboard::{Key, KeyboardInput},
    },
    prelude::*,
    window::PrimaryWindow,
};

/// The scale that is chosen automatically for the window.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct InterfaceScale {
    /// Physical pixels per logical pixel.
    pub automatic: f32,
}

impl Default for InterfaceScale {
    fn default() -> Self {
        Self { automatic: 1.0 }
    }
}

/// Scales the interface.
pub struct ScalePlugin;

impl Plugin for ScalePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<DisplaySettings>()
            .init_resource::<InterfaceScale>()
            .add_message::<Requested>()
            .add_systems(First, scale)
            .add_systems(Update, keys.before(RequestSystems));
    }
}

fn scale(
    settings: Res<DisplaySettings>,
    mut scale: ResMut<InterfaceScale>,
    window: Option<Single<&mut Window, With<PrimaryWindow>>>,
) {
    let Some(mut window) = window else {
        return;
    };
    let system = window.resolution.base_scale_factor();
    let automatic = automatic_scale(window.physical_size(), system);
    scale.set_if_neq(InterfaceScale { automatic });
    let wanted = settings.scale.unwrap_or(automatic);
    if window.scale_factor() != wanted {
        window.resolution.set_scale_factor_override(Some(wanted));
    }
}

/// Ctrl with plus, minus and 0.
fn keys(
    mut pressed: MessageReader<KeyboardInput>,
    held: Res<ButtonInput<KeyCode>>,
    settings: Res<DisplaySettings>,
    scale: Res<InterfaceScale>,
    mut requests: MessageWriter<Requested>,
) {
    let control = held.any_pressed([KeyCode::ControlLeft, KeyCode::ControlRight]);
    for input in pressed.read() {
        if !control || input.state != ButtonState::Pressed {
            continue;
        }
        let Key::Character(sign) = &input.logical_key else {
            continue;
        };
        let now = settings.scale.unwrap_or(scale.automatic);
        let wanted = match sign.as_str() {
            "+" | "=" => Some(step(now, true)),
            "-" => Some(step(now, false)),
            "0" => None,
            _ => continue,
        };
        requests.write(Requested(Request::Display(DisplayChange::Scale(wanted))));
    }
}

/// The next larger or smaller scale that is offered, or the same.
fn step(now: f32, larger: bool) -> f32 {
    let mut steps = SCALE_STEPS.into_iter();
    let found = if larger {
        steps.find(|step| *step > now)
    } else {
        steps.rfind(|step| *step < now)
    };
    found.unwrap_or(now)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_go_through_the_offered_scales_and_stop_at_the_ends() {
        assert_eq!(step(1.0, true), 1.25);
        assert_eq!(step(1.1, false), 1.0);
        assert_eq!(step(2.0, true), 2.0);
        assert_eq!(step(1.0, false), 1.0);
    }
}
