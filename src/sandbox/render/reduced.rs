//! Draws the bodies at a lower resolution than the window.
//!
//! Only the area that the panel leaves free is drawn. It is [composed](super::compose) with panel,
//! figures and marks at full resolution. The camera itself is unchanged, so that points on the
//! screen and in the world correspond as before.

use crate::sandbox::{
    render::{
        camera::OrbitCamera,
        compose::{ComposePlugin, Composer, Pipelines},
        quality::EffectiveQuality,
    },
    state::view::ViewSettings,
};
use bevy::{
    camera::MainPassResolutionOverride,
    image::ToExtents,
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        camera::ExtractedCamera,
        extract_component::{ExtractComponent, ExtractComponentPlugin},
        render_resource::{TextureDescriptor, TextureDimension, TextureFormat, TextureUsages},
        renderer::RenderDevice,
        texture::{CachedTexture, TextureCache},
        view::ExtractedView,
    },
    window::PrimaryWindow,
};

/// Draws an area of the window at a lower resolution.
#[derive(Component, ExtractComponent, Debug, Clone, Copy, PartialEq)]
#[extract_component_sync_target((Self, MainPassResolutionOverride, Picture))]
pub struct ReducedView {
    /// The area [physical px], from the window's top left.
    area: URect,
    fraction: f32,
}

impl ReducedView {
    /// The part of the area that is inside a target of a size [physical px]; `None` if it is empty.
    fn within(&self, target: UVec2) -> Option<URect> {
        let all = URect::from_corners(UVec2::ZERO, target);
        let area = self.area.intersect(all);
        (!area.is_empty()).then_some(area)
    }

    /// Size at which an area is drawn [physical px].
    fn size(&self, area: URect) -> UVec2 {
        (area.size().as_vec2() * self.fraction)
            .ceil()
            .as_uvec2()
            .max(UVec2::ONE)
    }
}

/// Maps the clip space of a target of a size onto that of an area of it.
fn crop(area: URect, target: UVec2) -> Mat4 {
    let scale = target.as_vec2() / area.size().as_vec2();
    // Of the area's center from that of the target, with y up, in halves of the target.
    let offset = (2.0 * area.as_rect().center() / target.as_vec2() - 1.0) * Vec2::new(1.0, -1.0);
    Mat4::from_translation((-offset * scale).extend(0.0)) * Mat4::from_scale(scale.extend(1.0))
}

/// The drawn picture, in a texture of its size.
///
/// It holds sRGB as it is: a software renderer interpolates that faster than it decodes four values
/// for each pixel. The shader decodes the result.
#[derive(Component)]
pub struct Picture {
    pub(super) texture: CachedTexture,
    /// Where it is shown [physical px].
    pub(super) area: URect,
    /// What shows it.
    pub(super) pipelines: Pipelines,
}

/// Draws at a lower resolution below [`EffectiveQuality::High`].
pub struct ReducedPlugin;

impl Plugin for ReducedPlugin {
    fn build(&self, app: &mut App) {
        if app.get_sub_app(RenderApp).is_none() {
            return;
        }
        app.add_plugins((
            ExtractComponentPlugin::<ReducedView>::default(),
            ComposePlugin,
        ))
        // The panel of this frame has been drawn.
        .add_systems(Last, choose);
        if let Some(renderer) = app.get_sub_app_mut(RenderApp) {
            renderer.add_systems(Render, reduce.in_set(RenderSystems::PrepareViews));
        }
    }
}

fn choose(
    quality: Res<EffectiveQuality>,
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    cameras: Query<(Entity, Option<&ReducedView>), With<OrbitCamera>>,
    mut commands: Commands,
) {
    let wanted = (*quality != EffectiveQuality::High).then(|| {
        let (left, right) = settings.free(window.width());
        let end = |x: f32| (x * window.scale_factor()).round().max(0.0) as u32;
        ReducedView {
            area: URect::new(end(left), 0, end(right), window.physical_height()),
            fraction: quality.resolution(),
        }
    });
    for (camera, now) in &cameras {
        match wanted {
            _ if now == wanted.as_ref() => {}
            Some(wanted) => {
                commands.entity(camera).insert(wanted);
            }
            None => {
                commands.entity(camera).remove::<ReducedView>();
            }
        }
    }
}

/// Crops the view to its area and lowers its resolution, once the window can be composed.
fn reduce(
    mut views: Query<(Entity, &ReducedView, &ExtractedCamera, &mut ExtractedView)>,
    mut composer: Composer,
    (device, mut textures): (Res<RenderDevice>, ResMut<TextureCache>),
    mut commands: Commands,
) {
    for (entity, reduced, camera, mut view) in &mut views {
        let target = camera.physical_target_size.unwrap_or_default();
        let mut entity = commands.entity(entity);
        let pipelines = composer.pipelines(camera);
        let (Some(area), Some(pipelines)) = (reduced.within(target), pipelines) else {
            entity.remove::<(MainPassResolutionOverride, Picture)>();
            continue;
        };
        view.clip_from_view = crop(area, target) * view.clip_from_view;
        // Widths of lines are in pixels of the screen.
        view.viewport = UVec4::new(0, 0, area.width(), area.height());
        let size = reduced.size(area);
        let texture = textures.get(
            &device,
            TextureDescriptor {
                label: Some("reduced_view"),
                size: size.to_extents(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format: TextureFormat::Rgba8Unorm,
                usage: TextureUsages::COPY_DST | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
        );
        let picture = Picture {
            texture,
            area,
            pipelines,
        };
        entity.insert((MainPassResolutionOverride(size), picture));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_the_area_become_those_of_the_picture() {
        let target = UVec2::new(1280, 800);
        for area in [URect::new(0, 0, 936, 800), URect::new(344, 0, 1280, 800)] {
            let crop = crop(area, target);
            let clip = |pixel: UVec2| {
                let unit = pixel.as_vec2() / target.as_vec2();
                Vec3::new(2.0 * unit.x - 1.0, 1.0 - 2.0 * unit.y, 0.25)
            };
            let (min, max) = (clip(area.min), clip(area.max));
            // Rounding of single precision, of numbers about 1.
            assert!(
                crop.project_point3(min)
                    .distance(Vec3::new(-1.0, 1.0, 0.25))
                    < 1e-6
            );
            assert!(
                crop.project_point3(max)
                    .distance(Vec3::new(1.0, -1.0, 0.25))
                    < 1e-6
            );
        }
    }

    #[test]
    fn low_quality_draws_what_the_panel_leaves_free() {
        let mut app = App::new();
        app.insert_resource(EffectiveQuality::Low)
            .insert_resource(ViewSettings {
                panel_width: 344.0,
                ..default()
            })
            .add_systems(Last, choose);
        let window = Window {
            resolution: (1280, 800).into(),
            ..default()
        };
        app.world_mut().spawn((window, PrimaryWindow));
        let camera = app.world_mut().spawn(OrbitCamera::default()).id();
        app.update();
        let reduced = *app.world().get::<ReducedView>(camera).expect("low");
        assert_eq!(reduced.area.size(), UVec2::new(936, 800));
        assert_eq!(reduced.size(reduced.area), UVec2::new(624, 534));

        app.world_mut().resource_mut::<ViewSettings>().panel_width = 0.0;
        app.update();
        let reduced = *app.world().get::<ReducedView>(camera).expect("low");
        assert_eq!(reduced.area.size(), UVec2::new(1280, 800));

        app.insert_resource(EffectiveQuality::High);
        app.update();
        assert!(app.world().get::<ReducedView>(camera).is_none());
    }

    #[test]
    fn an_area_outside_the_target_is_not_drawn() {
        let view = ReducedView {
            area: URect::new(0, 0, 936, 800),
            fraction: 0.5,
        };
        // The window became smaller in this frame.
        assert_eq!(
            view.within(UVec2::new(400, 300)),
            Some(URect::new(0, 0, 400, 300))
        );
        assert_eq!(view.within(UVec2::ZERO), None);
        assert_eq!(view.size(URect::new(0, 0, 401, 300)), UVec2::new(201, 150));
    }
}
