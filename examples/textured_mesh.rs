//! A ball with a texture, as a soft body: `cargo run --release --example textured_mesh`

use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use pliant::{prelude::*, render::SoftBodyMeshPlugin, solver::Damping};

fn main() -> AppExit {
    App::new()
        .add_plugins((
            DefaultPlugins,
            SoftBodyPlugins::default(),
            SoftBodyMeshPlugin,
        ))
        .add_systems(Startup, setup)
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut images: ResMut<Assets<Image>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) -> Result {
    // Any mesh of triangles: of a glTF file, for example, once it is loaded.
    let mesh = Sphere::new(0.6).mesh().uv(48, 24); // m
    let ball = SoftBody::from_mesh(&mesh)?;
    let drawn = ball
        .mesh(&mesh)
        .ok_or("the body was made from another mesh")?;
    commands.spawn((
        drawn,
        ball.at(Vec3::Y * 1.5).build(),
        Stretch {
            compliance: Compliance::of(3e-4), // m/N
            damping: Damping::of(0.05),       // s
            ..default()
        },
        Volume::default(),
        Ground::default(),
        MeshMaterial3d(materials.add(StandardMaterial {
            base_color_texture: Some(images.add(stripes())),
            ..default()
        })),
    ));
    commands.spawn((
        Mesh3d(meshes.add(Plane3d::default().mesh().size(10.0, 10.0))),
        MeshMaterial3d(materials.add(Color::srgb(0.6, 0.6, 0.6))),
    ));
    commands.spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(2.0, 5.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(0.0, 1.5, 3.0).looking_at(Vec3::Y * 0.6, Vec3::Y),
    ));
    Ok(())
}

/// A beach ball: twelve sectors in five colors, and a white cap.
fn stripes() -> Image {
    const SIZE: u32 = 96;
    let color = |x: u32, y: u32| -> [u8; 4] {
        if y < SIZE / 12 {
            return [255; 4];
        }
        match x * 12 / SIZE % 6 {
            0 => [230, 60, 50, 255],
            1 | 4 => [250, 245, 235, 255],
            2 => [40, 90, 200, 255],
            3 => [250, 190, 40, 255],
            _ => [30, 150, 90, 255],
        }
    };
    let pixels = (0..SIZE).flat_map(|y| (0..SIZE).flat_map(move |x| color(x, y)));
    let size = Extent3d {
        width: SIZE,
        height: SIZE,
        depth_or_array_layers: 1,
    };
    let (form, format) = (TextureDimension::D2, TextureFormat::Rgba8UnormSrgb);
    Image::new(
        size,
        form,
        pixels.collect(),
        format,
        RenderAssetUsages::default(),
    )
}
