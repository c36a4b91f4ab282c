//! The scene browser: a card over the middle of the window with all scenes by group, with pictures,
//! descriptions and a search.
//!
//! The pictures are part of the program and are decoded when the browser is first opened.

pub mod card;
pub mod catalog;

use bevy::{
    asset::RenderAssetUsages,
    image::{CompressedImageFormats, ImageSampler, ImageType},
    prelude::*,
};
use bevy_egui::{
    EguiContext, EguiPrimaryContextPass, PrimaryEguiContext,
    egui::{ColorImage, Context, TextureHandle, TextureOptions},
};
use std::collections::BTreeMap;

use crate::{
    effect::EffectRegistry,
    sandbox::{
        state::{
            browser::Browser,
            event::SceneLoaded,
            request::{Request, Requested},
        },
        ui::WidgetRects,
    },
    scene::{CurrentScene, registry::SCENES},
};
use card::{Card, CardState};
use catalog::Catalog;

/// Rectangles of the browser's widgets, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct BrowserRects(WidgetRects);

/// State of the browser while it is open, and the decoded pictures.
#[derive(Resource, Default)]
struct Shown {
    state: Option<CardState>,
    pictures: BTreeMap<&'static str, TextureHandle>,
}

/// The scene browser.
pub struct BrowserPlugin;

impl Plugin for BrowserPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Browser>()
            .init_resource::<BrowserRects>()
            .init_resource::<Shown>()
            .init_resource::<Catalog>()
            .add_message::<SceneLoaded>()
            .add_message::<Requested>()
            .add_systems(Update, catalog::remember_files)
            .add_systems(EguiPrimaryContextPass, browse);
    }
}

fn browse(world: &mut World) -> Result {
    if !world.resource::<Browser>().open {
        world.resource_mut::<Shown>().state = None;
        let mut rects = world.resource_mut::<BrowserRects>();
        if rects.0 != WidgetRects::default() {
            rects.0.clear();
        }
        return Ok(());
    }
    let context = world
        .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
        .single_mut(world)?
        .get_mut()
        .clone();
    world.resource_scope(|world, mut catalog: Mut<Catalog>| {
        catalog.read(world.resource::<EffectRegistry>());
    });
    let entries = world.resource::<Catalog>().entries();
    let current = world.get_resource::<CurrentScene>();
    let open = current.map_or(String::new(), |scene| scene.name.clone());
    let outcome = world.resource_scope(|_, mut shown: Mut<Shown>| {
        if shown.pictures.is_empty() {
            shown.pictures = pictures(&context);
        }
        let Shown { state, pictures } = &mut *shown;
        let card = Card {
            entries: &entries,
            open: &open,
            picture: &|name| pictures.get(name).map(TextureHandle::id),
        };
        let state = state.get_or_insert_with(|| CardState::at(&card));
        card.draw(&context, state)
    });
    let mut rects = world.resource_mut::<BrowserRects>();
    if rects.0 != outcome.places {
        rects.0 = outcome.places;
    }
    if let Some(name) = outcome.chosen {
        world.write_message(Requested(Request::OpenScene(name)));
    }
    if outcome.closes {
        world.resource_mut::<Browser>().open = false;
    }
    Ok(())
}

/// The pictures of the built-in scenes as textures.
fn pictures(context: &Context) -> BTreeMap<&'static str, TextureHandle> {
    let decoded = SCENES.iter().filter_map(|scene| {
        let image = decode(scene.picture)?;
        let texture = context.load_texture(scene.name, image, TextureOptions::LINEAR);
        Some((scene.name, texture))
    });
    decoded.collect()
}

/// Decodes a PNG.
fn decode(bytes: &[u8]) -> Option<ColorImage> {
    let image = Image::from_buffer(
        bytes,
        ImageType::Extension("png"),
        CompressedImageFormats::NONE,
        true,
        ImageSampler::Default,
        RenderAssetUsages::default(),
    );
    let image = image.ok()?;
    let size = [image.width() as usize, image.height() as usize];
    let pixels = image.data?;
    let fits = pixels.len() == 4 * size[0] * size[1];
    fits.then(|| ColorImage::from_rgba_unmultiplied(size, &pixels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_egui::egui::Color32;

    #[test]
    fn every_built_in_scene_has_a_picture_of_the_size_of_a_tile() {
        let mut bytes = 0;
        for scene in SCENES {
            let image = decode(scene.picture).expect(scene.name);
            let size = card::PICTURE.map(|it| it as usize);
            assert_eq!(image.size, size, "{}", scene.name);
            let first = image.pixels[0];
            let is_plain = image.pixels.iter().all(|pixel| *pixel == first);
            assert!(!is_plain, "{} shows nothing", scene.name);
            // Bodies have colors, unlike sky, floor and shadows; those of one scene are gray.
            let is_colored = |pixel: &&Color32| {
                let [r, g, b] = [pixel.r(), pixel.g(), pixel.b()];
                r.max(g).max(b) - r.min(g).min(b) > 60
            };
            let colored = image.pixels.iter().filter(is_colored).count();
            let has_bodies = colored >= 100 || scene.name == "chute";
            assert!(has_bodies, "{} shows no bodies", scene.name);
            bytes += scene.picture.len();
        }
        // They are part of the program: 25 kB each.
        assert!(bytes < 25_000 * SCENES.len(), "{bytes} bytes");
    }
}
