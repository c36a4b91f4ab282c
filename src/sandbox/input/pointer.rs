//! Ownership of the pointer: the panel, the camera, a body, or none.
//!
//! Decided when the first button is pressed and kept until all buttons are released, so that no
//! order of presses moves the camera while a body or the panel is in use, or vice versa. This
//! module only decides; the drag and the camera read [`Pointer`] and act only while they own it.

use super::collider_cast::{self, ColliderHit};
use crate::{
    render::{Drawn, SoftBodyRayCast},
    sandbox::{
        render::{camera::OrbitCamera, overlay::Screen, pin_marks},
        state::collider::shown_pose,
        state::{
            look::HiddenBody,
            spawn::Spawn,
            view::{Hovered, HoveredPin, ViewSettings},
        },
    },
    simulation::{Pins, SimulationClock, SoftBody, SoftBodyHit},
    solver::{Collider, SurfacePoint, VertexIndex},
};
use bevy::{
    input::mouse::{AccumulatedMouseScroll, MouseScrollUnit},
    prelude::*,
    window::{CursorMoved, PrimaryWindow},
};
use bevy_egui::{EguiContext, PrimaryEguiContext, egui::Pos2};

/// Owner of the pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PointerOwner {
    /// None: no button is down, or it was pressed where nothing responds.
    #[default]
    None,
    /// The panel, or another egui area.
    Panel,
    /// The camera: it orbits or pans.
    Camera,
    /// A body: it is being dragged.
    Body(Entity),
    /// A collider: it is being dragged, or one of its handles.
    Collider(Entity),
    /// The scissors: a stroke cuts bodies.
    Scissors,
    /// None until all buttons are released: a gesture has ended (or began where nothing responds)
    /// with a button still down.
    Spent,
}

/// Target under the pointer at the moment of a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Under {
    /// The panel, or another egui area that wants the pointer.
    Panel,
    /// A body.
    Body(Entity),
    /// A collider.
    Collider(Entity),
    /// The floor or the backdrop.
    Stage,
    /// Anything but the panel, with Shift held.
    Blades,
}

/// Button states of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Buttons {
    /// The left button is down, or was pressed in this frame.
    pub left: bool,
    /// The right or middle button is down, or was pressed in this frame.
    pub other: bool,
    /// A button was pressed in this frame.
    pub pressed: bool,
}

impl PointerOwner {
    /// The owner after a frame with these buttons and this target under the pointer.
    #[must_use]
    pub fn next(self, buttons: Buttons, under: Under) -> Self {
        if !buttons.left && !buttons.other {
            return Self::None;
        }
        match self {
            Self::None if buttons.pressed => match (under, buttons) {
                (Under::Panel, _) => Self::Panel,
                (
                    Under::Body(body),
                    Buttons {
                        left: true,
                        other: false,
                        ..
                    },
                ) => Self::Body(body),
                (
                    Under::Collider(collider),
                    Buttons {
                        left: true,
                        other: false,
                        ..
                    },
                ) => Self::Collider(collider),
                (
                    Under::Blades,
                    Buttons {
                        left: true,
                        other: false,
                        ..
                    },
                ) => Self::Scissors,
                (_, Buttons { left: false, .. }) => Self::Camera,
                _ => Self::Spent,
            },
            // It was released, but another button is still down.
            Self::Body(_) | Self::Collider(_) | Self::Scissors if !buttons.left => Self::Spent,
            owner => owner,
        }
    }
}

/// State of the pointer in the sandbox.
#[derive(Resource, Debug, Default)]
pub struct Pointer {
    /// The owner.
    pub owner: PointerOwner,
    /// The body that the ray hits; `None` while the pointer has an owner.
    pub hit: Option<SoftBodyHit>,
    /// Position in the window [logical px]; it may be outside while a button is down.
    pub position: Option<Vec2>,
    /// Its ray into the scene.
    pub ray: Option<Ray3d>,
    /// Where bodies are added: its ray, or that through the middle of the free part of the window
    /// while it is over the panel.
    pub aim: Option<Ray3d>,
    /// Whether it is over the panel or another egui area.
    pub over_panel: bool,
    /// The collider that the ray hits in front of the bodies; `None` while the pointer has an owner.
    pub collider: Option<ColliderHit>,
    /// Wheel steps of this frame that egui does not use; positive is away from the user.
    pub wheel: f32,
}

/// The collider whose handle is under the pointer, and takes precedence over bodies.
#[derive(Resource, Debug, Default)]
pub struct HoveredHandle {
    /// The collider.
    pub hovered: Option<Entity>,
}

/// Systems that update the pointer, in `Update`; systems that act on it run after them.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PointerSystems;

/// Systems of [`PointerSystems`] that find out what is under the pointer.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LocateSystems;

/// Systems of [`PointerSystems`] that decide who owns the pointer.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct OwnSystems;

/// Updates [`Pointer`].
pub struct PointerPlugin;

impl Plugin for PointerPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Pointer>()
            .init_resource::<Hovered>()
            .init_resource::<HoveredPin>()
            .init_resource::<HoveredHandle>()
            .init_resource::<Spawn>()
            .add_systems(
                Update,
                (
                    locate.in_set(LocateSystems),
                    own.in_set(OwnSystems).after(LocateSystems),
                )
                    .in_set(PointerSystems),
            );
    }
}

/// Distance from a rope's axis within which a press grabs it [logical px].
const REACH: f32 = 8.0;

fn locate(
    mut pointer: ResMut<Pointer>,
    mut moved: MessageReader<CursorMoved>,
    window: Single<(Entity, &Window), With<PrimaryWindow>>,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    bodies: SoftBodyRayCast,
    hidden: Query<(), With<HiddenBody>>,
    (pinned, colliders): (
        Query<(Entity, &SoftBody, &Pins, &Drawn), Without<HiddenBody>>,
        Query<(Entity, &Collider)>,
    ),
    clock: Res<SimulationClock>,
    mut hovered_pin: ResMut<HoveredPin>,
) {
    let (entity, window) = *window;
    // While a button is down, the window system also reports positions outside the window, which
    // `Window::cursor_position` would drop.
    let reported = moved
        .read()
        .filter(|m| m.window == entity)
        .last()
        .map(|m| m.position);
    let kept = if pointer.owner == PointerOwner::None {
        window.cursor_position()
    } else {
        pointer.position
    };
    pointer.position = reported.or(kept);
    let (camera, eye) = *camera;
    pointer.ray = pointer
        .position
        .and_then(|at| camera.viewport_to_world(eye, at).ok());
    pointer.hit = match (pointer.owner, pointer.ray) {
        (PointerOwner::None, Some(ray)) => {
            let per_pixel = pixel_size(camera, window.height());
            bodies.cast_among(ray, REACH * per_pixel, |body| !hidden.contains(body))
        }
        _ => None,
    };
    if pointer.owner != PointerOwner::None {
        pointer.collider = None;
        return;
    }
    pointer.collider = pointer.ray.and_then(|ray| {
        let hit = collider_cast::nearest(
            ray,
            |it| shown_pose(it, clock.time(), &clock),
            colliders.iter(),
        );
        let body = pointer.hit.map_or(f32::INFINITY, |hit| hit.distance);
        hit.filter(|hit| hit.distance < body)
    });
    let pin = pointer.position.zip(pointer.ray).and_then(|(at, ray)| {
        let screen = Screen { camera, eye };
        let at = Pos2::new(at.x, at.y);
        pin_under(at, ray, pointer.hit, &screen, pinned.iter())
    });
    hovered_pin.set_if_neq(HoveredPin(pin.map(|(hit, vertex)| (hit.body, vertex))));
    if let Some((hit, _)) = pin {
        pointer.hit = Some(hit);
    }
}

/// The pin that is nearest to the pointer, unless a body hides it.
fn pin_under<'a>(
    at: Pos2,
    ray: Ray3d,
    surface: Option<SoftBodyHit>,
    screen: &Screen,
    bodies: impl Iterator<Item = (Entity, &'a SoftBody, &'a Pins, &'a Drawn)>,
) -> Option<(SoftBodyHit, VertexIndex)> {
    let mut best: Option<(f32, SoftBodyHit, VertexIndex)> = None;
    for (entity, body, pins, drawn) in bodies {
        for &vertex in pins.iter() {
            let particle = body.numbering.particle(vertex);
            let Some(place) = drawn.particles.get(particle.index()) else {
                continue;
            };
            let position = place.truncate();
            let beside = screen
                .at(position)
                .and_then(|tip| pin_marks::distance(at, tip, pins.len()));
            let distance = position.distance(ray.origin);
            // A pin of a filled body may be below its surface.
            let depth = surface.map_or(f32::INFINITY, |hit| match hit.body == entity {
                true => hit.distance + 0.25 * body.size,
                false => 1.02 * hit.distance,
            });
            let (Some(beside), Some(point)) = (beside, SurfacePoint::new(&[(particle, 1.0)]))
            else {
                continue;
            };
            if distance <= depth && best.is_none_or(|(least, ..)| beside < least) {
                let hit = SoftBodyHit {
                    body: entity,
                    distance,
                    position,
                    point,
                };
                best = Some((beside, hit, vertex));
            }
        }
    }
    best.map(|(_, hit, vertex)| (hit, vertex))
}

/// Size of a pixel at a distance of 1 m from the eye [m/px].
fn pixel_size(camera: &Camera, height: f32) -> f32 {
    // Element [1][1] of the projection is 1/tan(half the field of view).
    2.0 / (camera.clip_from_view().y_axis.y * height.max(1.0))
}

fn own(
    mut pointer: ResMut<Pointer>,
    mut hovered: ResMut<Hovered>,
    (mouse, keyboard): (Res<ButtonInput<MouseButton>>, Res<ButtonInput<KeyCode>>),
    scroll: Res<AccumulatedMouseScroll>,
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut egui: Query<&mut EguiContext, With<PrimaryEguiContext>>,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    (spawn, handles): (Res<Spawn>, Res<HoveredHandle>),
) {
    let mut on_panel = egui.iter_mut().any(|mut context| {
        let context = context.get_mut();
        context.is_pointer_over_egui()
            || context.egui_is_using_pointer()
            || context.any_popup_open()
    });
    if let Some(at) = pointer.position {
        let (left, right) = settings.free(window.width());
        on_panel |= at.x < left || at.x >= right;
    }
    pointer.over_panel = on_panel;
    let (left, right) = settings.free(window.width());
    let middle = Vec2::new(left.midpoint(right), window.height() / 2.0);
    let (camera, eye) = *camera;
    pointer.aim = match on_panel {
        false => pointer.ray,
        true => camera.viewport_to_world(eye, middle).ok(),
    };
    let handle = handles.hovered.filter(|_| !on_panel);
    let has_blades = keyboard.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    let under = match (on_panel, pointer.hit, pointer.collider) {
        (true, ..) => Under::Panel,
        _ if has_blades => Under::Blades,
        (false, Some(hit), _) if handle.is_none() => Under::Body(hit.body),
        (false, ..) if handle.is_some() => handle.map_or(Under::Stage, Under::Collider),
        (false, _, Some(hit)) if !spawn.on_click => Under::Collider(hit.collider),
        _ => Under::Stage,
    };
    let down = |button| mouse.pressed(button);
    let buttons = Buttons {
        left: down(MouseButton::Left),
        other: down(MouseButton::Right) || down(MouseButton::Middle),
        pressed: mouse.get_just_pressed().next().is_some(),
    };
    pointer.owner = pointer.owner.next(buttons, under);
    hovered.0 = match (pointer.owner, under) {
        (PointerOwner::Body(body), _) | (PointerOwner::None, Under::Body(body)) => Some(body),
        _ => None,
    };
    let steps = match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => scroll.delta.y / MouseScrollUnit::SCROLL_UNIT_CONVERSION_FACTOR,
    };
    let wheel_is_ours = match pointer.owner {
        PointerOwner::Panel => false,
        PointerOwner::None => !on_panel,
        _ => true,
    };
    pointer.wheel = if wheel_is_ours { steps } else { 0.0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Entity = Entity::from_raw_u32(7).expect("7 is a valid index");
    const LEFT: Buttons = Buttons {
        left: true,
        other: false,
        pressed: true,
    };
    const RIGHT: Buttons = Buttons {
        left: false,
        other: true,
        pressed: true,
    };
    const BOTH: Buttons = Buttons {
        left: true,
        other: true,
        pressed: true,
    };
    const UP: Buttons = Buttons {
        left: false,
        other: false,
        pressed: false,
    };

    fn held(buttons: Buttons) -> Buttons {
        Buttons {
            pressed: false,
            ..buttons
        }
    }

    #[test]
    fn left_on_a_body_drags_it_and_right_on_it_turns_the_camera() {
        let none = PointerOwner::None;
        assert_eq!(none.next(LEFT, Under::Body(BODY)), PointerOwner::Body(BODY));
        assert_eq!(none.next(RIGHT, Under::Body(BODY)), PointerOwner::Camera);
        assert_eq!(none.next(RIGHT, Under::Stage), PointerOwner::Camera);
    }

    #[test]
    fn the_panel_keeps_the_pointer_wherever_it_goes() {
        let owner = PointerOwner::None.next(LEFT, Under::Panel);
        assert_eq!(owner, PointerOwner::Panel);
        assert_eq!(
            owner.next(held(LEFT), Under::Body(BODY)),
            PointerOwner::Panel
        );
        assert_eq!(owner.next(BOTH, Under::Stage), PointerOwner::Panel);
        assert_eq!(owner.next(UP, Under::Stage), PointerOwner::None);
    }

    #[test]
    fn the_camera_never_takes_over_from_a_body_whatever_the_order() {
        let owner = PointerOwner::None.next(LEFT, Under::Body(BODY));
        let both = owner.next(BOTH, Under::Stage);
        assert_eq!(both, PointerOwner::Body(BODY));
        let right_left_over = both.next(held(RIGHT), Under::Stage);
        assert_eq!(right_left_over, PointerOwner::Spent);
        assert_eq!(
            right_left_over.next(BOTH, Under::Body(BODY)),
            PointerOwner::Spent
        );
        assert_eq!(right_left_over.next(UP, Under::Stage), PointerOwner::None);
    }

    #[test]
    fn a_body_never_takes_over_from_the_camera() {
        let owner = PointerOwner::None.next(RIGHT, Under::Stage);
        assert_eq!(owner.next(BOTH, Under::Body(BODY)), PointerOwner::Camera);
        assert_eq!(
            owner.next(held(LEFT), Under::Body(BODY)),
            PointerOwner::Camera
        );
    }

    #[test]
    fn with_shift_a_left_drag_cuts_until_the_button_is_up() {
        let owner = PointerOwner::None.next(LEFT, Under::Blades);
        assert_eq!(owner, PointerOwner::Scissors);
        assert_eq!(owner.next(held(LEFT), Under::Stage), PointerOwner::Scissors);
        assert_eq!(owner.next(UP, Under::Stage), PointerOwner::None);
        let none = PointerOwner::None;
        assert_eq!(none.next(RIGHT, Under::Blades), PointerOwner::Camera);
    }

    #[test]
    fn a_press_beside_everything_has_no_owner_until_all_is_up() {
        let owner = PointerOwner::None.next(LEFT, Under::Stage);
        assert_eq!(owner, PointerOwner::Spent);
        assert_eq!(owner.next(BOTH, Under::Body(BODY)), PointerOwner::Spent);
        assert_eq!(owner.next(UP, Under::Stage), PointerOwner::None);
    }

    #[test]
    fn a_button_that_was_down_before_the_window_had_it_starts_nothing() {
        assert_eq!(
            PointerOwner::None.next(held(LEFT), Under::Body(BODY)),
            PointerOwner::None
        );
    }
}
