//! Keeping work: scenes, snapshots, recordings, recent files, and unsaved changes at closing.
//!
//! - [`save`]: writes the scene or a snapshot; [`files`]: names, folders, writing.
//! - [`unsaved`]: what has changed since the scene was opened or saved.
//! - [`recording`]: started and ended in the window.
//! - [`card`]: the cards that ask; this module carries out what they answer.
//! - [`closing`]: the window's close button.

pub mod badge;
pub mod card;
pub mod closing;
pub mod files;
pub mod recording;
pub mod save;
pub mod unsaved;

use super::time::{OpenScene, SceneContext};
use crate::{
    output::plain_name,
    sandbox::{
        state::{
            event::SceneLoaded,
            keep::{FileKind, KeepRequest, RecentFiles},
            view::{ViewCommand, ViewSettings},
        },
        ui::{
            WidgetRects, area,
            message::{Notices, capitalised},
        },
    },
    scene::{CurrentScene, save::Definition},
};
use bevy::prelude::*;
use bevy_egui::{EguiContext, EguiPrimaryContextPass, PrimaryEguiContext};
use card::{Answer, Card, SaveCard};
use save::{OpenDefinition, SaveError};
use std::{path::Path, sync::Arc};
use unsaved::Baseline;

/// Rectangles of the cards' widgets, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct KeepRects(WidgetRects);

/// Keeps work.
pub struct KeepPlugin;

impl Plugin for KeepPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<RecentFiles>()
            .init_resource::<Card>()
            .init_resource::<KeepRects>()
            .init_resource::<OpenDefinition>()
            .init_resource::<Baseline>()
            .init_resource::<closing::Scripted>()
            .add_message::<SceneLoaded>()
            .add_observer(save::note_added)
            .add_systems(PreUpdate, (note_recent, follow_undo))
            .add_systems(Update, (closing::close, refresh_recent))
            .add_systems(EguiPrimaryContextPass, (show, badge::show));
        recording::build(app);
    }
}

/// The scene whose definition is known.
#[derive(Resource, Debug)]
struct Known(Arc<SceneContext>);

/// Follows undo and redo to another scene. Sources of meshes that were added there are not known
/// any more.
fn follow_undo(world: &mut World) {
    let Some(OpenScene(scene)) = world.get_resource::<OpenScene>() else {
        return;
    };
    let known = world.get_resource::<Known>();
    if !known.is_some_and(|Known(known)| Arc::ptr_eq(known, scene)) {
        scene_opened(world);
    }
}

/// Notes the definition of a scene that was opened, for saving it later.
pub(super) fn scene_opened(world: &mut World) {
    let Some(OpenScene(scene)) = world.get_resource::<OpenScene>().cloned() else {
        return;
    };
    let built = &scene.beginning;
    // A snapshot has bodies, but no definition of them.
    let is_snapshot = built.places.is_some();
    let definition = (!is_snapshot).then(|| Definition::new(&scene.current.scene, built));
    world.insert_resource(Known(Arc::clone(&scene)));
    world.insert_resource(OpenDefinition(definition));
    Baseline::take(world);
}

/// Puts files that were opened into the list.
fn note_recent(
    mut loaded: MessageReader<SceneLoaded>,
    current: Option<Res<CurrentScene>>,
    mut recent: ResMut<RecentFiles>,
) {
    let opened = loaded.read().filter(|scene| scene.error.is_none()).count();
    if let (true, Some(path)) = (opened > 0, current.and_then(|scene| scene.path.clone())) {
        recent.note(&path);
    }
}

/// Looks every two seconds which of the recent files exist.
fn refresh_recent(mut recent: ResMut<RecentFiles>, time: Res<Time<Real>>, mut waited: Local<f32>) {
    *waited += time.delta_secs();
    if *waited > 2.0 {
        *waited = 0.0;
        let mut now = recent.clone();
        if now.refresh() {
            *recent = now;
        }
    }
}

/// Carries out a request of the File menu.
pub(super) fn carry_out(world: &mut World, request: KeepRequest) {
    match request {
        KeepRequest::OpenCard => {
            *world.resource_mut::<Card>() = Card::Open {
                path: String::new(),
                error: None,
            };
        }
        KeepRequest::Open(path) => {
            if path.exists() {
                let name = path.to_string_lossy().into_owned();
                world.write_message(ViewCommand::LoadScene(name));
            } else {
                world.resource_mut::<RecentFiles>().forget(&path);
                let text = format!("{} no longer exists", path.display());
                world.resource_mut::<Notices>().error(text);
            }
        }
        KeepRequest::Save => match save::scene_file(world) {
            Some(path) => attempt(world, FileKind::Scene, &path, true, false),
            None => ask(world, FileKind::Scene, false),
        },
        KeepRequest::SaveAs(kind) => ask(world, kind, false),
        KeepRequest::Record => recording::toggle(world),
        KeepRequest::PlainPicture => {
            world.write_message(ViewCommand::PlainPicture);
        }
    }
}

/// Opens the card that asks for a name.
fn ask(world: &mut World, kind: FileKind, then_close: bool) {
    let folder = files::folder(save::scene_file(world).as_deref());
    let scene = world.get_resource::<CurrentScene>();
    let scene = scene.map_or("scene", |scene| scene.name.as_str());
    let stem = Path::new(scene).file_stem();
    let stem = stem.map_or_else(|| scene.into(), |stem| stem.to_string_lossy());
    let stem = plain_name(&stem);
    let reasons = match kind {
        FileKind::Scene => match save::scene_text(world, &folder) {
            Err(SaveError::NotDescribable(reasons)) => reasons,
            _ => Vec::new(),
        },
        FileKind::Snapshot => Vec::new(),
    };
    *world.resource_mut::<Card>() = Card::Save(SaveCard {
        kind,
        name: files::free_name(&folder, &stem, kind.extension()),
        folder,
        error: None,
        reasons,
        exists: false,
        then_close,
    });
}

/// Saves, and shows what came of it. A failure opens the card that asks for a name, or stays on it.
fn attempt(world: &mut World, kind: FileKind, path: &Path, replace: bool, then_close: bool) {
    let result = save::save(world, kind, path, replace);
    let mut notices = world.resource_mut::<Notices>();
    let error = match result {
        Ok(notes) => {
            let text = format!("Saved {}", path.display());
            if notes.is_empty() {
                notices.info(text);
            } else {
                notices.warn(format!("{text}\n· {}", notes.join("\n· ")));
            }
            *world.resource_mut::<Card>() = Card::Closed;
            if then_close {
                closing::close_now(world);
            }
            return;
        }
        Err(error) => error,
    };
    if !matches!(*world.resource::<Card>(), Card::Save(_)) {
        ask(world, kind, then_close);
    }
    if let Card::Save(card) = &mut *world.resource_mut::<Card>() {
        match error {
            SaveError::NotDescribable(reasons) => card.reasons = reasons,
            SaveError::Exists(_) => card.exists = true,
            SaveError::Failed(text) => card.error = Some(capitalised(&text)),
        }
    }
}

fn show(world: &mut World) -> Result {
    let mut places = WidgetRects::default();
    if *world.resource::<Card>() != Card::Closed {
        let context = world
            .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
            .single_mut(world)?
            .get_mut()
            .clone();
        let free = area::free(&context, world.resource::<ViewSettings>());
        let mut card = world.resource::<Card>().clone();
        let answer = card::draw(&context, &mut card, free, &mut places);
        world.resource_mut::<Card>().set_if_neq(card);
        if let Some(answer) = answer {
            obey(world, answer);
        }
    }
    let mut known = world.resource_mut::<KeepRects>();
    if known.0 != places {
        known.0 = places;
    }
    Ok(())
}

/// Carries out what was pressed on the card.
pub fn obey(world: &mut World, answer: Answer) {
    let card = world.resource::<Card>().clone();
    match (answer, card) {
        (Answer::Cancel, _) => *world.resource_mut::<Card>() = Card::Closed,
        (Answer::Discard, _) => closing::close_now(world),
        (Answer::Open, Card::Open { path, .. }) => open(world, &path),
        (Answer::Snapshot, Card::Save(card)) => ask(world, FileKind::Snapshot, card.then_close),
        (Answer::Save { replace }, Card::Save(card)) => {
            match files::file_name(&card.name, card.kind.extension()) {
                Ok(name) => {
                    let path = card.folder.join(name);
                    attempt(world, card.kind, &path, replace, card.then_close);
                }
                Err(error) => {
                    let error = Some(error);
                    *world.resource_mut::<Card>() = Card::Save(SaveCard { error, ..card });
                }
            }
        }
        (Answer::Save { .. }, Card::Closing { .. }) => match save::scene_file(world) {
            Some(path) => attempt(world, FileKind::Scene, &path, true, true),
            None => ask(world, FileKind::Scene, true),
        },
        _ => {}
    }
}

/// Opens a file by the path that was typed.
fn open(world: &mut World, typed: &str) {
    let path = typed.trim().trim_matches('"');
    let path = path.strip_prefix("file://").unwrap_or(path);
    let error = match std::fs::metadata(path) {
        _ if path.is_empty() => Some("Enter a path".to_owned()),
        Ok(found) if found.is_dir() => Some(format!("{path} is a folder; enter a file in it")),
        Ok(_) => None,
        Err(error) => Some(format!("{path}: {error}")),
    };
    if error.is_none() {
        let name = path.to_owned();
        world.write_message(ViewCommand::LoadScene(name));
        *world.resource_mut::<Card>() = Card::Closed;
    } else {
        let path = typed.to_owned();
        *world.resource_mut::<Card>() = Card::Open { path, error };
    }
}
