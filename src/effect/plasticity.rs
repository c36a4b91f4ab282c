//! Plasticity: what is strained beyond a yield strain stays so.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{
        Active, Carried, CurrentSubstep, EffectSystems, Profile, SoftBody, SolverSystems,
        SolverThreads, SubstepSchedule, plain, step,
    },
    solver::{
        Creep, Particles, PlasticLimit, Plasticity, Yield,
        advance::{Spare, Stage},
    },
};
use bevy::prelude::*;

impl Effect for Plasticity {
    const NAME: &'static str = "plasticity";
    const TITLE: &'static str = "Plasticity";
    const SUMMARY: &'static str = "What is strained beyond a yield strain stays so.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            stretch_yield: Yield, "Edges yield at", "",
            "Strain of an edge beyond which it flows: 0.05 is a twentieth longer or shorter.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            bend_yield: Yield, "Bends yield at", "1/m",
            "Change of curvature of the surface beyond which it flows; a sheet of thickness t is strained by half of t times this.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            volume_yield: Yield, "Volumes yield at", "",
            "Change of volume of a tetrahedron, as a share of it, beyond which it flows.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            creep: Creep, "Creep", "1/s",
            "How fast what is strained too far flows: a held strain loses all but 37 % of its excess in the inverse of this.",
            (0.01, 1e3), Scale::LogarithmicToInfinity
        ),
        parameter!(
            stretch_limit: PlasticLimit, "Edges flow up to", "",
            "By how much a rest length may change at most, as a share of what it was.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            bend_limit: PlasticLimit, "Bends flow up to", "1/m",
            "By how much the curvature at rest may change at most.",
            (0.1, 1e3), Scale::LogarithmicToInfinity
        ),
        parameter!(
            volume_limit: PlasticLimit, "Volumes flow up to", "",
            "By how much a rest volume may change at most, as a share of what it was.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SubstepSchedule,
            flow.in_set(EffectSystems(Self::NAME))
                .in_set(SolverSystems::Postsolve)
                // No commands of that are waited for: a point of synchronisation would be a system more.
                .after_ignore_deferred(step::postsolve),
        );
    }

    fn when_added() -> Option<Self> {
        Some(Self::typical())
    }

    fn figures(&self, body: &EntityRef, _h: f32) -> Figures {
        let topology = body.get::<SoftBody>();
        let count = |topology: &SoftBody| self.elements(&plain::effects(*body), topology);
        Figures {
            elements: topology.map_or(0, count),
            ..Figures::default()
        }
    }
}

/// Lets rest values flow at the end of a substep.
fn flow(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&mut SoftBody, &mut Particles, Carried), (Active, With<Plasticity>)>,
) {
    let means = current.means(&threads);
    profile.time(Plasticity::NAME, || {
        for (mut body, mut particles, carried) in &mut bodies {
            let mut spare = Spare::of(carried.effects());
            // Who draws the body need not look at it again.
            let topology = &mut body.bypass_change_detection().0;
            let mut stepper = spare.stepper(topology, &mut particles);
            stepper.act(Stage::Flow, &current.step, 0, &means);
        }
    });
}
