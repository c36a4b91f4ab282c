//! A custom effect with a kernel for eight elements at once: muscles that contract the edges of a
//! body.
//! `cargo run --release --example custom_effect`

use bevy::prelude::*;
use pliant::{
    effect::*,
    prelude::*,
    simulation::*,
    solver::{
        kernel::{Projection, simd::*, *},
        order::Elements,
        topology::Edges,
    },
};

/// Edges pull themselves to a fraction of their rest length.
#[derive(Component, Clone, Default)]
struct Muscle {
    fraction: f32,
}

impl Effect for Muscle {
    const NAME: &'static str = "muscle";
    const TITLE: &'static str = "Muscle";
    const SUMMARY: &'static str = "Contracts the edges of a body.";
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        let system = contract.in_set(EffectSystems(Self::NAME));
        schedules.add_systems(SolveSchedule, system.in_set(SolvePhase::User));
    }
}

fn contract(mut bodies: Query<(&SoftBody, &mut Particles, &Muscle), Active>) {
    bodies
        .par_iter_mut()
        .for_each(|(body, mut particles, muscle)| {
            iterate(&Contract(&body.edges, muscle.fraction), &mut particles);
        });
}

struct Contract<'a>(&'a Edges, f32);

impl Blocks<2, 1> for Contract<'_> {
    fn elements(&self) -> &Elements<2> {
        &self.0.elements
    }

    #[inline(always)]
    fn project<L: Lanes>(
        &self,
        simd: L,
        block: &Block<2>,
        [a, b]: &[Columns<L>; 2],
        _: Option<&[Vectors<L>; 2]>,
        _: Option<[f32x8<L>; 1]>,
    ) -> Projection<L, 2, 1> {
        let d = difference(b, a);
        let length = dot(&d, &d).sqrt();
        let error = block.column(simd, &self.0.rest_length) * self.1 - length;
        let scale = error / (length * (a[3] + b[3])); // of a direction as long as the edge
        Projection {
            moves: [scaled(&d, -(a[3] * scale)), scaled(&d, b[3] * scale)],
            change: [scale * length],
        }
    }
}

fn main() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
    app.add_plugins(EffectPlugin::<Muscle>::default());
    let rope = app.world_mut().spawn(SoftBody::rope(1.0, 20).build()).id(); // 1 m
    for tick_number in 0..60 {
        let fraction = 1.0 - 0.4 * tick_number as f32 / 60.0;
        app.world_mut().entity_mut(rope).insert(Muscle { fraction });
        tick(app.world_mut());
    }
    let particles = app.world().get::<Particles>(rope).expect("a body");
    let length = particles.position(0).distance(particles.position(20));
    println!("{length:.3} m"); // 0.6 m
}
