//! Paints egui with a shader that a software renderer runs faster than that of `bevy_egui`.

use bevy::{prelude::*, render::RenderApp, shader::load_shader_library};
use bevy_egui::render::EGUI_SHADER_HANDLE;

/// Replaces the shader of `bevy_egui`, which has been added before, without arrays of textures.
pub struct PaintPlugin;

impl Plugin for PaintPlugin {
    fn build(&self, app: &mut App) {
        if app.get_sub_app(RenderApp).is_none() {
            return;
        }
        load_shader_library!(app, "srgb.wgsl");
        let shader = Shader::from_wgsl(include_str!("paint.wgsl"), "sandbox/ui/paint.wgsl");
        app.world_mut()
            .resource_mut::<Assets<Shader>>()
            .insert(EGUI_SHADER_HANDLE.id(), shader)
            .expect("a handle by UUID has no generation");
    }
}
