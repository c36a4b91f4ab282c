//! Tethers: no particle goes farther from its nearest pin than the way to it is long at rest.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{
        Active, EffectSystems, Profile, SoftBody, SolvePhase, SolveSchedule, StepSchedule,
        StepSystems, TetherLeads,
    },
    solver::{Particles, Slack, Tethers},
};
use bevy::prelude::*;

impl Effect for Tethers {
    const NAME: &'static str = "tethers";
    const TITLE: &'static str = "Tethers";
    const SUMMARY: &'static str =
        "No particle goes farther from its nearest pin than the way to it is long at rest.";
    const PARAMETERS: &'static [Parameter<Self>] = &[parameter!(
        slack: Slack, "Slack", "",
        "How much farther it may go, as a share of that way.",
        (0.0, 0.5), Scale::Linear
    )];

    type State = TetherLeads;
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            StepSchedule,
            find_pins
                .in_set(EffectSystems(Self::NAME))
                .in_set(StepSystems::Ready)
                // It changes nothing but its own state.
                .ambiguous_with_all(),
        );
        schedules.add_systems(
            SolveSchedule,
            solve
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::Elastic),
        );
    }

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn figures(&self, body: &EntityRef, _h: f32) -> Figures {
        let (Some(leads), Some(particles)) = (body.get::<TetherLeads>(), body.get::<Particles>())
        else {
            return Figures::default();
        };
        Figures {
            elements: leads.0.count(),
            residual: leads.0.residual(&particles.positions, self),
            ..Figures::default()
        }
    }
}

/// Brings tethers in line with pins.
fn find_pins(mut bodies: Query<(&SoftBody, &Particles, &mut TetherLeads), With<Tethers>>) {
    for (body, particles, mut leads) in &mut bodies {
        leads.0.update(body, &particles.positions);
    }
}

/// Puts every particle that is too far from its pin back.
fn solve(
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&mut Particles, &Tethers, &TetherLeads), Active>,
) {
    profile.time(Tethers::NAME, || {
        for (mut particles, tethers, leads) in &mut bodies {
            leads.0.solve(particles.as_part(), 0, tethers);
        }
    });
}
