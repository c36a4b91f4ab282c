//! Pictures of the view without panel and figures.

use super::{
    pictures,
    plain_view::{self, PlainView},
    screenshot,
};
use crate::{
    sandbox::{
        render::readiness::PipelinesReady,
        state::{event::ScreenshotSaved, view::ViewCommand},
        ui::message::Notices,
    },
    scene::CurrentScene,
    simulation::SimulationClock,
};
use bevy::{
    ecs::message::MessageCursor,
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
};

/// Frames before the picture is taken, for the pipelines of its camera.
const WARM_UP: u32 = 6;

/// The picture that is about to be taken.
#[derive(Resource, Debug, Default)]
struct Coming(Option<(Entity, u32)>);

/// Whether a picture is about to be taken.
pub(super) fn is_coming(world: &World) -> bool {
    world
        .get_resource::<Coming>()
        .is_some_and(|coming| coming.0.is_some())
}

/// Takes pictures without the panel.
pub struct PlainPicturePlugin;

impl Plugin for PlainPicturePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Coming>()
            .add_systems(Last, (begin, take).chain());
    }
}

fn begin(world: &mut World, mut read: Local<MessageCursor<ViewCommand>>) {
    let commands = world.resource::<Messages<ViewCommand>>();
    let asked = read
        .read(commands)
        .any(|command| *command == ViewCommand::PlainPicture);
    if asked && world.resource::<Coming>().0.is_none() {
        let camera = plain_view::spawn(world, f32::INFINITY);
        world.resource_mut::<Coming>().0 = camera.map(|camera| (camera, 0));
    }
}

fn take(world: &mut World) {
    let ready = world
        .get_resource::<PipelinesReady>()
        .is_none_or(PipelinesReady::get);
    let mut coming = world.resource_mut::<Coming>();
    let Some((camera, frames)) = &mut coming.0 else {
        return;
    };
    *frames += 1;
    if *frames < WARM_UP || !ready {
        return;
    }
    let camera = *camera;
    coming.0 = None;
    let scene = world.get_resource::<CurrentScene>();
    let name = scene.map_or_else(|| "pliant".to_owned(), |scene| scene.name.clone());
    let time = world.resource::<SimulationClock>().time();
    let Some(image) = world
        .get::<PlainView>(camera)
        .map(|view| view.image.clone())
    else {
        return;
    };
    world.spawn(Screenshot::image(image)).observe(
        move |captured: On<ScreenshotCaptured>,
              mut saved: MessageWriter<ScreenshotSaved>,
              mut notices: ResMut<Notices>,
              mut commands: Commands| {
            commands.entity(camera).despawn();
            match pictures::folder() {
                Ok(folder) => {
                    let path = pictures::free_file(&folder, &name, time, "png");
                    let error = screenshot::save(&captured.image, &path).err();
                    saved.write(ScreenshotSaved { path, error });
                }
                Err(error) => notices.error(format!("Cannot save a picture: {error}")),
            }
        },
    );
}
