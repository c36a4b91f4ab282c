//! Paints egui with a shader and textures that a software renderer handles faster than those of
//! `bevy_egui`.

use bevy::{
    asset::AssetId,
    prelude::*,
    render::{RenderApp, render_resource::TextureFormat},
    shader::load_shader_library,
};
use bevy_egui::{
    EguiManagedTextures, EguiPostUpdateSet, render::EGUI_SHADER_HANDLE, update_egui_textures_system,
};

/// Replaces the shader of `bevy_egui`, which has been added before, without arrays of textures, and
/// the format of the textures.
///
/// The textures hold sRGB as it is, and the shader decodes the interpolated value: a software
/// renderer decodes four values for each pixel of an sRGB texture, which took it longer than all
/// else of the panel.
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
        app.add_systems(
            PostUpdate,
            (
                // It converts the colors that it writes into a texture to the texture's format.
                (|textures: Res<_>, images: ResMut<_>| {
                    set_format(TextureFormat::Rgba8UnormSrgb, &textures, images);
                })
                .before(update_egui_textures_system),
                (|textures: Res<_>, images: ResMut<_>| {
                    set_format(TextureFormat::Rgba8Unorm, &textures, images);
                })
                .after(update_egui_textures_system),
            )
                .in_set(EguiPostUpdateSet::PostProcessOutput),
        );
    }
}

/// Sets the format of the textures, without another upload.
fn set_format(
    format: TextureFormat,
    textures: &EguiManagedTextures,
    mut images: ResMut<Assets<Image>>,
) {
    for texture in textures.values() {
        let id: AssetId<Image> = texture.handle.id();
        if let Some(image) = images.get_mut_untracked(id) {
            image.texture_descriptor.format = format;
        }
    }
}
