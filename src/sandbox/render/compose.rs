//! Composes the window at low quality: one pass writes the enlarged [picture](Picture), and panel,
//! figures and marks over it, into the texture that is shown.
//!
//! Otherwise egui is painted into the texture of the camera, which is then copied with a conversion
//! of every pixel. A software renderer takes several milliseconds for that.

use super::reduced::Picture;
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    camera::{CameraOutputMode, MainPassResolutionOverride, Viewport},
    core_pipeline::{Core3d, Core3dSystems, FullscreenShader, upscaling::upscaling},
    ecs::system::SystemParam,
    image::ToExtents,
    prelude::*,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems,
        camera::{ExtractedCamera, NormalizedRenderTargetExt},
        render_asset::RenderAssets,
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BufferUsages,
            CachedRenderPipelineId, ColorTargetState, ColorWrites, FilterMode, FragmentState,
            IndexFormat, PipelineCache, RawBufferVec, RenderPassDescriptor,
            RenderPipelineDescriptor, Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages,
            SpecializedRenderPipeline, SpecializedRenderPipelines, TextureFormat,
            TextureSampleType, VertexState,
            binding_types::{sampler, texture_2d},
        },
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        sync_world::MainEntity,
        texture::{GpuImage, ManualTextureViews},
        view::{ExtractedView, ExtractedWindows, ViewTarget},
    },
};
use bevy_egui::{
    EguiPixelsPerPoint, EguiRenderOutput,
    egui::{
        self, TextureId,
        epaint::{Primitive, Vertex},
    },
    render::{
        EguiCameraView, EguiPipeline, EguiPipelineKey,
        systems::{
            EguiTextureBindGroups, EguiTextureId, EguiTransforms,
            prepare_egui_render_target_data_system,
        },
    },
};
use std::ops::Range;

/// Composes the window from a picture at a lower resolution and egui.
pub struct ComposePlugin;

impl Plugin for ComposePlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "shaders/enlarge.wgsl");
        if let Some(renderer) = app.get_sub_app_mut(RenderApp) {
            renderer
                .init_gpu_resource::<SpecializedRenderPipelines<Enlarger>>()
                .init_gpu_resource::<Painting>()
                .add_systems(RenderStartup, load)
                .add_systems(
                    Render,
                    take_over
                        .in_set(RenderSystems::Prepare)
                        .before(prepare_egui_render_target_data_system),
                )
                .add_systems(
                    Core3d,
                    compose.after(Core3dSystems::PostProcess).after(upscaling),
                );
        }
    }
}

/// What enlarges the picture.
#[derive(Resource)]
struct Enlarger {
    layout: BindGroupLayoutDescriptor,
    sampler: Sampler,
    vertex: VertexState,
    shader: Handle<Shader>,
}

fn load(
    device: Res<RenderDevice>,
    assets: Res<AssetServer>,
    fullscreen: Res<FullscreenShader>,
    mut commands: Commands,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "enlarge_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                texture_2d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
            ),
        ),
    );
    let sampler = device.create_sampler(&SamplerDescriptor {
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        ..default()
    });
    commands.insert_resource(Enlarger {
        layout,
        sampler,
        vertex: fullscreen.to_vertex_state(),
        shader: load_embedded_asset!(assets.as_ref(), "shaders/enlarge.wgsl"),
    });
}

impl SpecializedRenderPipeline for Enlarger {
    /// Format of the window's texture.
    type Key = TextureFormat;

    fn specialize(&self, format: TextureFormat) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("enlarge".into()),
            layout: vec![self.layout.clone()],
            vertex: self.vertex.clone(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                targets: vec![Some(ColorTargetState {
                    format,
                    blend: None,
                    write_mask: ColorWrites::ALL,
                })],
                ..default()
            }),
            ..default()
        }
    }
}

/// The pipelines for a target: for the picture, and for egui.
#[derive(Debug, Clone, Copy)]
pub struct Pipelines {
    enlarge: CachedRenderPipelineId,
    paint: CachedRenderPipelineId,
}

/// Access to the pipelines.
#[derive(SystemParam)]
pub struct Composer<'w> {
    cache: Res<'w, PipelineCache>,
    enlarger: Res<'w, Enlarger>,
    enlargers: ResMut<'w, SpecializedRenderPipelines<Enlarger>>,
    egui: Res<'w, EguiPipeline>,
    painters: ResMut<'w, SpecializedRenderPipelines<EguiPipeline>>,
    windows: Res<'w, ExtractedWindows>,
    images: Res<'w, RenderAssets<GpuImage>>,
    manual: Res<'w, ManualTextureViews>,
}

impl Composer<'_> {
    /// The pipelines for the target of a camera; `None` until they are compiled.
    pub fn pipelines(&mut self, camera: &ExtractedCamera) -> Option<Pipelines> {
        let target = camera.target.as_ref()?;
        let target_format =
            target.get_texture_view_format(&self.windows, &self.images, &self.manual)?;
        let pipelines = Pipelines {
            enlarge: self
                .enlargers
                .specialize(&self.cache, &self.enlarger, target_format),
            paint: self.painters.specialize(
                &self.cache,
                &self.egui,
                EguiPipelineKey { target_format },
            ),
        };
        let is_compiled = |id| self.cache.get_render_pipeline(id).is_some();
        (is_compiled(pipelines.enlarge) && is_compiled(pipelines.paint)).then_some(pipelines)
    }
}

/// The triangles of egui.
#[derive(Resource)]
struct Painting {
    vertices: RawBufferVec<Vertex>,
    indices: RawBufferVec<u32>,
    meshes: Vec<ClippedMesh>,
}

/// A part of the triangles with the same texture and clip rectangle.
struct ClippedMesh {
    /// [physical px]
    clip: URect,
    texture: EguiTextureId,
    indices: Range<u32>,
    /// Index of the first vertex.
    first: i32,
}

impl Default for Painting {
    fn default() -> Self {
        Self {
            vertices: RawBufferVec::new(BufferUsages::VERTEX),
            indices: RawBufferVec::new(BufferUsages::INDEX),
            meshes: Vec::new(),
        }
    }
}

impl Painting {
    fn clear(&mut self) {
        self.vertices.clear();
        self.indices.clear();
        self.meshes.clear();
    }

    /// Adds triangles, clipped to a rectangle [physical px].
    fn push(&mut self, mesh: &egui::Mesh, clip: URect, camera: MainEntity) {
        let start = self.indices.len() as u32;
        let first = self.vertices.len() as i32;
        self.indices.extend(mesh.indices.iter().copied());
        self.vertices.extend(mesh.vertices.iter().copied());
        self.meshes.push(ClippedMesh {
            clip,
            texture: match mesh.texture_id {
                TextureId::Managed(id) => EguiTextureId::Managed(camera, id),
                TextureId::User(id) => EguiTextureId::User(id),
            },
            indices: start..self.indices.len() as u32,
            first,
        });
    }
}

/// A rectangle of egui [logical px] in physical pixels.
fn physical(rect: egui::Rect, pixels_per_point: f32) -> URect {
    let pixel = |at: egui::Pos2| {
        let at = at.to_vec2() * pixels_per_point;
        // Coordinates to the left of the window and above it become 0.
        UVec2::new(at.x.round() as u32, at.y.round() as u32)
    };
    URect {
        min: pixel(rect.min),
        max: pixel(rect.max),
    }
}

/// Takes the triangles from `bevy_egui`, which then paints nothing, and leaves out the copy into the
/// window.
fn take_over(
    mut cameras: Query<
        (
            &mut ExtractedCamera,
            &ExtractedView,
            Option<&EguiCameraView>,
        ),
        (With<Picture>, With<ViewTarget>),
    >,
    mut outputs: Query<(&mut EguiRenderOutput, &EguiPixelsPerPoint)>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    mut painting: ResMut<Painting>,
) {
    for (mut camera, view, egui) in &mut cameras {
        camera.output_mode = CameraOutputMode::Skip;
        painting.clear();
        let Some((mut output, scale)) = egui.and_then(|egui| outputs.get_mut(egui.0).ok()) else {
            continue;
        };
        let size = camera.physical_target_size.unwrap_or_default();
        let window = URect::from_corners(UVec2::ZERO, size);
        for job in output.paint_jobs.drain(..) {
            let clip = physical(job.clip_rect, scale.pixels_per_point).intersect(window);
            // The panel has no shapes that paint themselves.
            if let Primitive::Mesh(mesh) = &job.primitive
                && !clip.is_empty()
            {
                painting.push(mesh, clip, view.retained_view_entity.main_entity);
            }
        }
        let painting = &mut *painting;
        painting.vertices.write_buffer(&device, &queue);
        painting.indices.write_buffer(&device, &queue);
    }
}

/// Writes the window.
fn compose(
    view: ViewQuery<(
        &ViewTarget,
        &ExtractedView,
        &ExtractedCamera,
        &MainPassResolutionOverride,
        &Picture,
    )>,
    (enlarger, cache): (Res<Enlarger>, Res<PipelineCache>),
    (painting, textures, transforms): (
        Res<Painting>,
        Res<EguiTextureBindGroups>,
        Res<EguiTransforms>,
    ),
    mut context: RenderContext,
) {
    let (target, view, camera, drawn, picture) = view.into_inner();
    let pipeline = |id| cache.get_render_pipeline(id);
    let (Some(enlarge), Some(paint), Some(window)) = (
        pipeline(picture.pipelines.enlarge),
        pipeline(picture.pipelines.paint),
        target.out_texture_color_attachment(Some(LinearRgba::BLACK)),
    ) else {
        return;
    };
    context.command_encoder().copy_texture_to_texture(
        target.main_texture().as_image_copy(),
        picture.texture.texture.as_image_copy(),
        drawn.0.to_extents(),
    );
    let bind_group = context.render_device().create_bind_group(
        "enlarge",
        &cache.get_bind_group_layout(&enlarger.layout),
        &BindGroupEntries::sequential((&picture.texture.default_view, &enlarger.sampler)),
    );
    let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("compose"),
        color_attachments: &[Some(window)],
        ..default()
    });
    pass.set_camera_viewport(&Viewport {
        physical_position: picture.area.min,
        physical_size: picture.area.size(),
        ..default()
    });
    pass.set_render_pipeline(enlarge);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.draw(0..3, 0..1);

    let (Some(vertices), Some(indices), Some(offset), Some((_, transform))) = (
        painting.vertices.buffer(),
        painting.indices.buffer(),
        transforms
            .offsets
            .get(&view.retained_view_entity.main_entity),
        &transforms.bind_group,
    ) else {
        return;
    };
    pass.set_camera_viewport(&Viewport {
        physical_size: camera.physical_target_size.unwrap_or_default(),
        ..default()
    });
    pass.set_render_pipeline(paint);
    pass.set_bind_group(0, transform, &[*offset]);
    pass.set_vertex_buffer(0, vertices.slice(..));
    pass.set_index_buffer(indices.slice(..), IndexFormat::Uint32);
    for mesh in &painting.meshes {
        let Some((texture, _)) = textures.get(&mesh.texture) else {
            continue;
        };
        let size = mesh.clip.size();
        pass.set_scissor_rect(mesh.clip.min.x, mesh.clip.min.y, size.x, size.y);
        pass.set_bind_group(1, texture, &[]);
        pass.draw_indexed(mesh.indices.clone(), mesh.first, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_egui::egui::{Color32, Pos2, pos2};

    #[test]
    fn clip_rectangles_are_rounded_and_begin_in_the_window() {
        let rect = egui::Rect::from_min_max(pos2(-3.0, 10.2), pos2(20.4, 30.0));
        assert_eq!(physical(rect, 1.5), URect::new(0, 15, 31, 45));
    }

    #[test]
    fn each_mesh_draws_its_own_vertices() {
        let mut painting = Painting::default();
        let mesh = |size: f32| {
            let mut mesh = egui::Mesh::with_texture(TextureId::Managed(7));
            let rect = egui::Rect::from_min_max(Pos2::ZERO, pos2(size, size));
            mesh.add_colored_rect(rect, Color32::WHITE);
            mesh
        };
        let clip = URect::new(0, 0, 9, 9);
        let camera = MainEntity::from(Entity::PLACEHOLDER);
        painting.push(&mesh(1.0), clip, camera);
        painting.push(&mesh(2.0), clip, camera);
        let corners = |mesh: &ClippedMesh| {
            let indices =
                &painting.indices.values()[mesh.indices.start as usize..mesh.indices.end as usize];
            let vertex = |index: &u32| (mesh.first as u32 + index) as usize;
            let vertices = painting.vertices.values();
            indices
                .iter()
                .map(|index| vertices[vertex(index)].pos.x)
                .fold(0.0, f32::max)
        };
        let sizes: Vec<f32> = painting.meshes.iter().map(corners).collect();
        assert_eq!(sizes, [1.0, 2.0]);
        let texture = EguiTextureId::Managed(camera, 7);
        assert!(painting.meshes.iter().all(|mesh| mesh.texture == texture));
    }
}
