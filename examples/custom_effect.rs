//! An effect of one's own: a component, its parameters, and a system that exists only while a body carries it.
//! `cargo run --release --example custom_effect`

use bevy::prelude::*;
use pliant::{effect::*, mesh::Primitive, prelude::*, simulation::*, solver::measure};
use std::sync::Arc;

/// Pulls particles towards the plane y = 0 like a spring of this frequency.
#[derive(Component, Clone, Default)]
struct Float {
    frequency: f32, // Hz
}

impl Effect for Float {
    const NAME: &'static str = "float";
    const TITLE: &'static str = "Float";
    const SUMMARY: &'static str = "Pulls a body towards the plane y = 0.";
    const PARAMETERS: &'static [Parameter<Self>] = &[Parameter {
        name: "frequency",
        title: "Frequency",
        unit: "Hz",
        help: "Frequency of the oscillation.",
        range: (0.1, 10.0),
        scale: Scale::Linear,
        get: |float| float.frequency.into(),
        set: |float, value| {
            float.frequency = pliant::solver::quantity::finite("frequency", value as f32)?;
            Ok(())
        },
    }];
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = pull
            .in_set(EffectSystems(Self::NAME))
            .in_set(SolvePhase::User);
        schedules.add_systems(SolveSchedule, system);
    }
}

fn pull(step: Res<CurrentSubstep>, mut bodies: Query<(&mut Particles, &Float), Active>) {
    for (mut particles, float) in &mut bodies {
        let omega_h = std::f32::consts::TAU * float.frequency * step.step.h;
        let Particles {
            positions,
            displacements,
            ..
        } = &mut *particles;
        for (x, u) in positions
            .iter()
            .zip(displacements)
            .filter(|(x, _)| x.w > 0.0)
        {
            u.y -= omega_h * omega_h * (x.y + u.y);
        }
    }
}

fn main() -> Result {
    let rope = Primitive::Rope {
        length: 1.0,
        segments: 8,
    }
    .build()?; // m
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        SoftBodyPlugins::default(),
        EffectPlugin::<Float>::default(),
    ));
    let topology = SoftBody(Arc::new(Topology::new(rope.shape)?));
    let rope = (
        topology,
        BodyDensity(Density::new(0.1)?),
        Stretch::default(),
        Float { frequency: 1.0 },
    );
    let rope = app.world_mut().spawn(rope).id();
    for tenth in 1..=10 {
        (0..6).for_each(|_| tick(app.world_mut()));
        let particles = app
            .world()
            .get::<Particles>(rope)
            .expect("a body has particles");
        let height = measure::centre_of_mass(particles).y; // about −g/ω² = −0.248 m
        println!("{:.1} s: {height:.3} m", 0.1 * f64::from(tenth));
    }
    Ok(())
}
