//! A muscle, as an effect with a kernel for eight elements: `cargo run --example custom_effect`

use bevy::prelude::*;
use pliant::{effect::*, prelude::*, simulation::*, solver::kernel::prelude::*};

/// Contracts the edges of a body to a fraction of their rest length.
#[derive(Component, Clone, Default)]
#[component(on_add = needs_plugin::<Muscle>)]
struct Muscle(f32);

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
    for (body, mut particles, muscle) in &mut bodies {
        iterate(&Contract(&body.edges, muscle.0), &mut particles);
    }
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
        _: Option<[Floats<L>; 1]>,
    ) -> Projected<L, 2, 1> {
        let d = difference(b, a);
        let length = dot(&d, &d).sqrt();
        let error = block.column(simd, &self.0.rest_length) * self.1 - length;
        let scale = error / (length * (a[3] + b[3]));
        let moves = [scaled(&d, -(a[3] * scale)), scaled(&d, b[3] * scale)];
        let change = [scale * length];
        Projected { moves, change }
    }
}

fn main() {
    let (mut app, muscle) = (App::new(), EffectPlugin::<Muscle>::default());
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default(), muscle));
    let rope = SoftBody::rope(1.0, 20); // 1 m
    let rope = app.world_mut().spawn((rope.build(), Muscle(0.6))).id();
    (0..60).for_each(|_| tick(app.world_mut()));
    let particles = app.world().get::<Particles>(rope).expect("a body");
    let [first, last] = [0, 20].map(|particle| particles.position(particle));
    println!("{:.3} m", first.distance(last));
}
