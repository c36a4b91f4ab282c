//! A second camera that draws the view without panel and figures into an image, for pictures and
//! films.

use crate::sandbox::{
    render::{camera::OrbitCamera, stage},
    state::view::ViewSettings,
};
use bevy::{
    camera::RenderTarget, prelude::*, render::render_resource::TextureFormat, window::PrimaryWindow,
};

/// Order of the camera: before that of the window.
const ORDER: isize = -1;

/// The camera, which follows that of the window.
#[derive(Component, Debug)]
pub struct PlainView {
    /// The image that it draws into.
    pub image: Handle<Image>,
}

/// Lets the cameras follow.
pub(super) fn build(app: &mut App) {
    app.add_systems(PostUpdate, follow.before(TransformSystems::Propagate));
}

fn follow(
    main: Single<(&Transform, &Msaa), (With<OrbitCamera>, Without<PlainView>)>,
    mut views: Query<(&mut Transform, &mut Msaa), With<PlainView>>,
) {
    for (mut transform, mut msaa) in &mut views {
        transform.set_if_neq(*main.0);
        msaa.set_if_neq(*main.1);
    }
}

/// Size of the area that the panel leaves free [physical px], at most `width` wide; both even.
pub fn size(window: &Window, view: &ViewSettings, width: f32) -> UVec2 {
    let (left, right) = view.free(window.width());
    let free = Vec2::new((right - left).max(16.0), window.height().max(16.0));
    let free = free * window.scale_factor();
    let scaled = free * (width / free.x).min(1.0);
    ((scaled / 2.0).round().as_uvec2() * 2).max(UVec2::splat(2))
}

/// Spawns the camera; `None` without a window. The image has the shape of the free area, and is at
/// most `width` wide [px].
pub fn spawn(world: &mut World, width: f32) -> Option<Entity> {
    let mut windows = world.query_filtered::<&Window, With<PrimaryWindow>>();
    let window = windows.single(world).ok()?;
    let size = size(window, world.resource::<ViewSettings>(), width);
    let mut cameras = world.query_filtered::<(&Transform, &Msaa), With<OrbitCamera>>();
    let (transform, msaa) = cameras.single(world).ok()?;
    let (transform, msaa) = (*transform, *msaa);
    let image = Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None);
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let camera = world.spawn((
        stage::lens(),
        Camera {
            order: ORDER,
            ..default()
        },
        RenderTarget::Image(image.clone().into()),
        msaa,
        transform,
        PlainView { image },
    ));
    Some(camera.id())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_has_the_shape_of_the_free_area() {
        let window = Window {
            resolution: (1280, 800).into(),
            ..default()
        };
        let view = ViewSettings {
            panel_width: 344.0,
            ..default()
        };
        assert_eq!(size(&window, &view, f32::INFINITY), UVec2::new(936, 800));
        assert_eq!(size(&window, &view, 720.0), UVec2::new(720, 616));
        let all_panel = ViewSettings {
            panel_width: 1280.0,
            ..default()
        };
        assert!(size(&window, &all_panel, 720.0).min_element() >= 2);
    }
}
