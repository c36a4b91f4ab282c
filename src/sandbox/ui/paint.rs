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
        decode_in_the_shader(app);
    }
}

/// Has the textures hold sRGB as it is.
fn decode_in_the_shader(app: &mut App) {
    app.add_systems(
        PostUpdate,
        (
            // `bevy_egui` converts the colors that it writes into a texture to the format.
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

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_egui::{
        EguiRenderOutput,
        egui::{Color32, ColorImage, TextureId, TextureOptions, epaint::ImageDelta},
    };

    #[test]
    fn textures_hold_the_colors_of_egui_also_where_a_part_is_written() {
        let mut app = App::new();
        app.init_resource::<EguiManagedTextures>()
            .init_resource::<Assets<Image>>()
            .add_systems(
                PostUpdate,
                update_egui_textures_system.in_set(EguiPostUpdateSet::PostProcessOutput),
            );
        decode_in_the_shader(&mut app);
        let context = app.world_mut().spawn(EguiRenderOutput::default()).id();
        let gray = |size, level| ColorImage::filled(size, Color32::from_gray(level));
        let whole = ImageDelta::full(gray([2, 1], 200), TextureOptions::LINEAR);
        let part = ImageDelta::partial([1, 0], gray([1, 1], 64), TextureOptions::LINEAR);
        for delta in [whole, part] {
            let mut output = app.world_mut().get_mut::<EguiRenderOutput>(context);
            let output = output.as_mut().expect("spawned above");
            let set = &mut output.textures_delta.set;
            set.entry(TextureId::Managed(0)).or_default().push(delta);
            app.update();
        }
        let textures = app.world().resource::<EguiManagedTextures>();
        let handle = &textures[&(context, 0)].handle;
        let images = app.world().resource::<Assets<Image>>();
        let image = images.get(handle).expect("written");
        assert_eq!(image.texture_descriptor.format, TextureFormat::Rgba8Unorm);
        let data = image.data.as_deref().expect("in memory");
        assert_eq!(data[0], 200);
        // `bevy_egui` truncates what it converts by way of floating point.
        assert!((63..=64).contains(&data[4]), "{}", data[4]);
    }
}
