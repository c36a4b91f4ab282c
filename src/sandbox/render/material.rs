//! Materials of soft bodies and colliders, lines and reference overlays, and the palette.
//!
//! The skin is a custom material (`shaders/body.wgsl`): jelly needs wrapped and transmitted light,
//! which the standard material does not offer, and it costs a software renderer a third of the
//! standard material.

use super::coloring::map::STOPS;
use bevy::{
    asset::{embedded_asset, uuid_handle},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{Material, MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    reflect::TypePath,
    render::{
        render_resource::{
            AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError,
        },
        storage::ShaderBuffer,
    },
    shader::ShaderRef,
};

/// Default colors of bodies, as 8-bit sRGB. They differ in lightness as well as in hue, so that
/// neighbors are distinguishable with color blindness too (after Okabe and Ito).
pub const PALETTE: [[u8; 3]; 8] = [
    [240, 84, 60],  // coral
    [0, 158, 142],  // teal
    [247, 179, 32], // amber
    [84, 94, 214],  // iris
    [86, 185, 236], // sky
    [214, 78, 140], // raspberry
    [120, 178, 58], // leaf
    [140, 82, 60],  // cocoa
];

/// Palette color of the n-th body, linear sRGB.
#[must_use]
pub fn palette(n: usize) -> Vec3 {
    linear(PALETTE[n % PALETTE.len()])
}

/// Linear sRGB of an 8-bit sRGB color.
#[must_use]
pub fn linear([red, green, blue]: [u8; 3]) -> Vec3 {
    Color::srgb_u8(red, green, blue).to_linear().to_vec3()
}

/// Uniform of `body.wgsl`; the fields are explained there.
#[derive(Debug, Clone, Copy, PartialEq, ShaderType)]
pub struct Finish {
    /// Color, linear sRGB.
    pub color: Vec3,
    /// Perceptual roughness of the coat, 0 (mirror) to 1.
    pub roughness: f32,
    /// Light transport inside, 0 (plaster) to 1 (jelly).
    pub translucency: f32,
    /// Strength of the coat's reflection, 0 (matt) to 1.
    pub gloss: f32,
    /// 1 while the pointer is over the body or drags it, otherwise 0.
    pub highlight: f32,
    /// Height of the floor [m].
    pub floor: f32,
    /// Color of transmitted light, linear sRGB.
    pub deep: Vec3,
    /// Opacity where the surface faces the eye, 0 (clear glass) to 1. Grazing surfaces are less
    /// transparent.
    pub opacity: f32,
    /// Color map of a surface that is [colored](super::coloring) by a quantity: linear sRGB in xyz.
    pub map: [Vec4; STOPS],
}

impl Finish {
    /// Jelly of a color, linear sRGB.
    #[must_use]
    pub fn jelly(color: Vec3) -> Self {
        Self::new(color, 0.20, 1.0, 1.0)
    }

    /// Woven cloth of a color, linear sRGB.
    #[must_use]
    pub fn cloth(color: Vec3) -> Self {
        Self::new(color, 0.75, 0.5, 0.25)
    }

    /// A rope or chain of a color, linear sRGB.
    #[must_use]
    pub fn cord(color: Vec3) -> Self {
        Self::new(color, 0.4, 0.3, 0.7)
    }

    /// Grains of a color, linear sRGB.
    #[must_use]
    pub fn grain(color: Vec3) -> Self {
        Self::new(color, 0.6, 0.2, 0.8)
    }

    /// A collider: pale, hard and matt, so that it stays in the background; smooth glass if its
    /// opacity is below 1. Color: linear sRGB.
    #[must_use]
    pub fn collider(color: Option<Vec3>, opacity: f32) -> Self {
        let color = color.unwrap_or_else(|| linear([196, 202, 206]));
        if opacity < 1.0 {
            let glass = Self::new(color, 0.1, 0.0, 1.0);
            return Self { opacity, ..glass };
        }
        Self::new(color, 0.45, 0.0, 0.5)
    }

    /// The same surface in another color, linear sRGB.
    #[must_use]
    pub fn colored(self, color: Vec3) -> Self {
        Self {
            color,
            deep: deep(color, self.translucency),
            ..self
        }
    }

    fn new(color: Vec3, roughness: f32, translucency: f32, gloss: f32) -> Self {
        Self {
            color,
            roughness,
            translucency,
            gloss,
            highlight: 0.0,
            floor: 0.0,
            deep: deep(color, translucency),
            opacity: 1.0,
            map: [Vec4::ZERO; STOPS],
        }
    }
}

/// Color of transmitted light, which loses most of the components that the color lacks.
fn deep(color: Vec3, translucency: f32) -> Vec3 {
    color.powf(1.0 + 0.35 * translucency)
}

/// The skin of a body or collider.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone)]
#[bind_group_data(SkinKey)]
pub struct SkinMaterial {
    /// Appearance.
    #[uniform(0)]
    pub finish: Finish,
    /// The [`GrainPositions`](crate::render::GrainPositions); [`NO_GRAINS`] for other bodies.
    #[storage(1, read_only, visibility(vertex))]
    pub grains: Handle<ShaderBuffer>,
}

impl SkinMaterial {
    /// A skin of a body that does not consist of grains.
    #[must_use]
    pub fn new(finish: Finish) -> Self {
        Self {
            finish,
            grains: NO_GRAINS,
        }
    }
}

/// The buffer of skins without grains.
pub const NO_GRAINS: Handle<ShaderBuffer> = uuid_handle!("5f3d8f7e-6a52-4c0b-9c43-0f4f0a5c1d27");

/// What the shaders of skins depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SkinKey {
    has_grains: bool,
}

impl From<&SkinMaterial> for SkinKey {
    fn from(skin: &SkinMaterial) -> Self {
        Self {
            has_grains: skin.grains != NO_GRAINS,
        }
    }
}

impl Material for SkinMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/skin_vertex.wgsl".into()
    }

    fn prepass_vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/skin_vertex.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/body.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        if self.finish.opacity < 1.0 {
            AlphaMode::Blend
        } else {
            AlphaMode::Opaque
        }
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        if key.bind_group_data.has_grains {
            descriptor.vertex.shader_defs.push("GRAINS".into());
        }
        // Cloth has two sides, and an inverted body must remain visible.
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}

/// Lines over bodies, in one color.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone)]
pub struct WireMaterial {
    /// Color, linear sRGB with opacity.
    #[uniform(0)]
    pub color: LinearRgba,
}

impl Material for WireMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/wire.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/wire.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Blend
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }
}

/// Uniform of `reference_overlay.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, ShaderType)]
pub struct Veil {
    /// Color, linear sRGB.
    pub color: Vec3,
    /// Depth inside the body up to which it is visible [m].
    pub reach: f32,
    /// 1 if the surface encloses a volume; its back side is not drawn then.
    pub closed: u32,
}

/// A translucent surface.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone)]
pub struct ReferenceMaterial {
    /// Appearance.
    #[uniform(0)]
    pub veil: Veil,
}

impl Material for ReferenceMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/reference_overlay.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://pliant/sandbox/render/shaders/reference_overlay.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Blend
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        // Cloth has two sides.
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}

/// The materials of bodies, colliders, lines and reference overlays.
pub struct SkinPlugin;

impl Plugin for SkinPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "shaders/body.wgsl");
        embedded_asset!(app, "shaders/skin_vertex.wgsl");
        embedded_asset!(app, "shaders/wire.wgsl");
        embedded_asset!(app, "shaders/reference_overlay.wgsl");
        app.add_plugins((
            MaterialPlugin::<SkinMaterial>::default(),
            MaterialPlugin::<WireMaterial>::default(),
            MaterialPlugin::<ReferenceMaterial>::default(),
        ));
        let empty = ShaderBuffer::from(vec![Vec4::ZERO]);
        let mut buffers = app.world_mut().resource_mut::<Assets<ShaderBuffer>>();
        // The handle is not that of a removed asset.
        buffers
            .insert(NO_GRAINS.id(), empty)
            .expect("a handle by UUID has no generation");
    }
}
