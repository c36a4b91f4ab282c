//! Appearance and disappearance of grains between ticks.

use super::{
    Active, AddedMass, BodyDensity, PastStarts, Pins, SoftBody, TickStart,
    body::{KnownMesh, follow_joints},
    step::UnderWay,
};
use crate::effect::follow_points;
use crate::solver::{
    EffectStates, Emitter, Grab, Particles, Sink, Stitches, advance::Stepper,
    direct::DirectWorkspace, renew::Attached,
};
use bevy::{ecs::query::QueryData, prelude::*};

/// Bodies that an effect renews.
type Renewable = Or<(With<Emitter>, With<Sink>)>;

/// The components that change.
#[derive(QueryData)]
#[query_data(mutable)]
pub(super) struct Renewed {
    entity: Entity,
    body: &'static mut SoftBody,
    known: &'static mut KnownMesh,
    particles: &'static mut Particles,
    start: &'static mut TickStart,
    past: &'static mut PastStarts,
    states: &'static mut EffectStates,
    stitches: Option<&'static mut Stitches>,
    density: &'static BodyDensity,
    added: &'static mut AddedMass,
    pins: &'static mut Pins,
}

/// Adds and removes grains at the end of a tick.
pub(super) fn renew(
    mut bodies: Query<(Renewed, super::carried::Carried), (Active, Renewable)>,
    under_way: Res<UnderWay>,
    mut commands: Commands,
) {
    for (mut body, carried) in &mut bodies {
        let effects = carried.effects();
        let mut topology = body.body.0.clone();
        let mut none = Stitches::default();
        let mut stepper = Stepper {
            topology: &mut topology,
            particles: body.particles.bypass_change_detection(),
            effects: &effects,
            states: body.states.bypass_change_detection(),
            stitches: match &mut body.stitches {
                Some(stitches) => stitches.bypass_change_detection(),
                None => &mut none,
            },
            direct: &mut DirectWorkspace::default(),
            force: None,
        };
        let attached = Attached {
            added: &mut body.added.bypass_change_detection().0,
            pins: &mut body.pins.bypass_change_detection().0,
        };
        let start = &mut body.start.bypass_change_detection().0;
        let settings = under_way.settings();
        let Some(renewed) = stepper.renew(body.density.0, attached, start, settings) else {
            continue;
        };
        body.past.follow(&renewed.kept);
        body.known.follow(topology.id());
        body.body.0 = topology;
        body.particles.set_changed();
        let (entity, grab) = (body.entity, effects.grab);
        commands.queue(move |world: &mut World| {
            follow_joints(world, entity, |stitches, number| {
                stitches.follow_renewed(number, &renewed);
                false
            });
            let Ok(mut body) = world.get_entity_mut(entity) else {
                return;
            };
            follow_points(&mut body, |point| renewed.point(point));
            let Some(grab) = grab else {
                return;
            };
            match renewed.point(&grab.point) {
                Some(point) => {
                    if let Some(mut grab) = body.get_mut::<Grab>() {
                        grab.bypass_change_detection().point = point;
                    }
                }
                // What was grabbed has disappeared.
                None => {
                    body.remove::<Grab>();
                }
            }
        });
    }
}
