//! The studio: a floor with grid lines, a plain backdrop, one key light with a soft shadow.
//!
//! The lighting itself is in `shaders/studio.wgsl`, shared by floor, bodies and backdrop. This
//! module contains the entities, and updates the range of the shadow and the fade of the floor with
//! the camera.

use crate::render::Drawn;
use crate::sandbox::render::{
    camera::{CameraSystems, OrbitCamera},
    grounding::Grounding,
    material::{SkinMaterial, SkinPlugin},
    orbit::FIELD_OF_VIEW,
};
use crate::sandbox::state::look::HiddenBody;
use bevy::{
    asset::RenderAssetUsages,
    asset::embedded_asset,
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, NoFrustumCulling},
    },
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{CascadeShadowConfig, DirectionalLightShadowMap, NotShadowCaster, NotShadowReceiver},
    mesh::{Indices, PrimitiveTopology},
    pbr::Material,
    prelude::*,
    reflect::TypePath,
    render::{
        render_resource::{AsBindGroup, ShaderType},
        renderer::RenderAdapterInfo,
    },
    shader::{ShaderRef, load_shader_library},
};

/// Direction of the key light: from the upper left, in front of the default camera.
const KEY_FROM: Vec3 = Vec3::new(-0.62, 0.9, 0.62);
/// Extent of the floor mesh, in camera distances; the floor has faded out before that.
const FLOOR_REACH: f32 = 60.0;
/// Depth of the drawn floor below the ground, in camera distances: about one pixel. Cloth that lies on
/// the ground has no drawn thickness; in one plane with the floor it would be hidden or flicker.
const FLOOR_DROP: f32 = 1e-3;
/// Range of the shadow, in camera distances.
const SHADOW_REACH: f32 = 2.6;

/// Height of the floor [m]; `None` if there is no floor because no body would rest on it.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct FloorHeight(pub Option<f32>);

impl Default for FloorHeight {
    fn default() -> Self {
        Self(Some(0.0))
    }
}

/// Uniform of `floor.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ShaderType)]
pub struct FloorView {
    /// Center of the view on the floor [m].
    pub focus: Vec3,
    /// Size of the viewed region [m].
    pub scale: f32,
    /// Shading by the bodies on the floor.
    pub grounding: Grounding,
}

/// The floor.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone, Default)]
pub struct FloorMaterial {
    /// The viewed region, and shading.
    #[uniform(0)]
    pub view: FloorView,
}

impl Material for FloorMaterial {
    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/floor.wgsl".into()
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }
}

/// The backdrop.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone, Default)]
pub struct BackdropMaterial {}

impl Material for BackdropMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/backdrop.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/backdrop.wgsl".into()
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }
}

#[derive(Component)]
struct Floor;

/// Builds the studio. The [`OrbitCamera`] is spawned elsewhere.
pub struct StagePlugin;

impl Plugin for StagePlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "shaders/studio.wgsl");
        embedded_asset!(app, "shaders/floor.wgsl");
        embedded_asset!(app, "shaders/backdrop.wgsl");
        app.add_plugins((
            SkinPlugin,
            MaterialPlugin::<FloorMaterial>::default(),
            MaterialPlugin::<BackdropMaterial>::default(),
        ))
        .init_resource::<FloorHeight>()
        .insert_resource(DirectionalLightShadowMap { size: 2048 })
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, build)
        .add_systems(Update, follow.after(CameraSystems));
    }
}

/// Camera components besides the orbit.
#[must_use]
pub fn lens() -> impl Bundle {
    (
        Camera3d::default(),
        Projection::Perspective(PerspectiveProjection {
            fov: FIELD_OF_VIEW,
            near: 0.01,
            ..default()
        }),
        // Designed for product renderings: preserves colors, compresses highlights.
        Tonemapping::KhronosPbrNeutral,
        DebandDither::Enabled,
    )
}

fn build(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut floors: ResMut<Assets<FloorMaterial>>,
    mut backdrops: ResMut<Assets<BackdropMaterial>>,
    adapter: Option<Res<RenderAdapterInfo>>,
    mut shadow_map: ResMut<DirectionalLightShadowMap>,
) {
    if adapter.is_some_and(|adapter| is_software(&adapter)) {
        shadow_map.size = 1024;
    }
    commands.spawn((
        Floor,
        Mesh3d(meshes.add(Plane3d::new(Vec3::Y, Vec2::splat(1.0)))),
        MeshMaterial3d(floors.add(FloorMaterial::default())),
        NotShadowCaster,
    ));
    commands.spawn((
        Mesh3d(meshes.add(screen_triangle())),
        MeshMaterial3d(backdrops.add(BackdropMaterial {})),
        (NoFrustumCulling, NoAutoAabb, Aabb::default()),
        (NotShadowCaster, NotShadowReceiver),
    ));
    commands.spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            shadow_depth_bias: 0.01,
            shadow_normal_bias: 1.2,
            ..default()
        },
        Transform::from_translation(KEY_FROM).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}

/// Whether a software renderer is used; shadows are coarser then.
#[must_use]
pub fn is_software(adapter: &RenderAdapterInfo) -> bool {
    adapter.device_type == wgpu::DeviceType::Cpu
}

/// One triangle that covers the screen, in clip space.
fn screen_triangle() -> Mesh {
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(
        Mesh::ATTRIBUTE_POSITION,
        vec![[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]],
    )
    .with_inserted_indices(Indices::U32(vec![0, 1, 2]))
}

/// Moves the floor and the shadow with the focus of the camera.
fn follow(
    camera: Single<&OrbitCamera>,
    height: Res<FloorHeight>,
    mut floor: Single<
        (
            &mut Transform,
            &mut Visibility,
            &MeshMaterial3d<FloorMaterial>,
        ),
        With<Floor>,
    >,
    mut light: Single<&mut CascadeShadowConfig>,
    mut materials: ResMut<Assets<FloorMaterial>>,
    bodies: Query<(&Drawn, &MeshMaterial3d<SkinMaterial>), Without<HiddenBody>>,
    skins: Res<Assets<SkinMaterial>>,
) {
    let orbit = camera.now;
    let (transform, visibility, material) = &mut *floor;
    let shown = if height.0.is_some() {
        Visibility::Inherited
    } else {
        Visibility::Hidden
    };
    visibility.set_if_neq(shown);
    let level = height.0.unwrap_or_default();
    let center = orbit.focus.with_y(level);
    let grounding = Grounding::of(center, &bodies, &skins);
    let view = FloorView {
        focus: center,
        scale: orbit.distance,
        grounding,
    };
    let changed = materials
        .get(&material.0)
        .is_some_and(|material| material.view != view);
    if !changed {
        return;
    }
    if let Some(mut material) = materials.get_mut(&material.0) {
        material.view = view;
    }
    let drop = FLOOR_DROP * orbit.distance;
    **transform = Transform::from_translation(center - drop * Vec3::Y)
        .with_scale(Vec3::splat(FLOOR_REACH * orbit.distance));
    light.bounds = vec![SHADOW_REACH * orbit.distance];
    light.minimum_distance = 0.0;
}
