//! Methods, and averaged passes: compared with hand-written ones, the reference, and each other.

use crate::{
    reference_support::{EPSILON, random_body},
    support::{
        self, G, body, body_of_masses, chain, cube, edge_strains, elastic_on_ground, pinned, point,
        position, rms_strain, run, settings, stretch, volume, with, world,
    },
    support_app::{app_of, ticks},
};
use bevy::prelude::IntoScheduleConfigs;
use glam::{UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::{SolvePhase, SolveSchedule, state_hash},
    solver::{
        Body, Effects, Fraction, Method, Rate, Settings, SmoothingIterations, Stretch, VertexIndex,
        World, deform::Random, measure, reference,
    },
};
use std::{fs, path::Path};

const JACOBI: &str = "(substeps: 1, iterations: 4, method: Jacobi())";

fn parsed(text: &str) -> Settings {
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(text).expect("sound settings")
}

fn pbd(stiffness: f32) -> Method {
    let stiffness = Fraction::new(stiffness).expect("a fraction");
    Method::Pbd { stiffness }
}

fn smoothing(count: u32) -> SmoothingIterations {
    SmoothingIterations::new(count).expect("in range")
}

#[test]
fn settings_name_a_method_and_refuse_what_makes_no_sense() {
    assert_eq!(parsed("()").method, Method::Xpbd);
    assert_eq!(parsed("(method: Pbd())").method, pbd(1.0));
    assert_eq!(parsed("(method: Pbd(stiffness: 0.25))").method, pbd(0.25));
    assert_eq!(parsed("(method: Verlet)").method, Method::Verlet);
    assert!(matches!(parsed(JACOBI).method, Method::Jacobi { .. }));
    for wrong in [
        "(method: Pbd(stiffness: 1.5))",
        "(method: Jacobi(kept_speed: -1))",
        "(method: Newton)",
        "(smoothing_iterations: 0.5)",
        "(collision_iterations: -1)",
    ] {
        assert!(ron::from_str::<Settings>(wrong).is_err(), "{wrong}");
    }
}

/// A soft cube that falls onto its ground and bounces.
fn falling(effects: Effects) -> World {
    let mut cube = with(body("cube", cube(0.4, 2), 1000.0), effects);
    cube.translate(Vec3::Y * 0.5);
    cube.set_velocity(Vec3::new(1.0, 0.0, 0.3));
    world(settings(G, 60.0, 4, 3), cube)
}

#[test]
fn classic_pbd_is_xpbd_without_compliance_to_the_bit() {
    let mut rigid = falling(elastic_on_ground());
    let mut soft = falling(Effects {
        stretch: stretch(1e-3),
        volume: volume(1e-6),
        ..elastic_on_ground()
    });
    soft.settings.method = pbd(1.0);
    // What XPBD has beyond the literature.
    rigid.settings.keep_spin = pliant::solver::KeepSpin::of(0);
    for _ in 0..120 {
        rigid.tick();
        soft.tick();
    }
    assert_eq!(rigid.state_hash(), soft.state_hash());
}

#[test]
fn an_iteration_of_classic_pbd_leaves_one_minus_its_stiffness_of_the_error() {
    // Without gravity, and with one pinned end, an edge that is 0.3 m too long.
    let mut edge = pinned(body_of_masses(chain(1, 1.0), &[1.0, 1.0]), &[0]);
    edge.effects.stretch = stretch(1.0);
    edge.particles.positions[1].y = -1.3;
    for (stiffness, iterations) in [(0.25, 1), (0.25, 6), (0.9, 2), (0.0, 3)] {
        let mut world = world(settings(0.0, 60.0, 1, iterations), edge.clone());
        world.settings.method = pbd(stiffness);
        world.tick();
        let left = -f64::from(position(&world, 1).y) - 1.0;
        let expected = 0.3 * (1.0 - f64::from(stiffness)).powi(iterations as i32);
        // A few roundings of a length of 1.3 m per iteration.
        assert!(
            (left - expected).abs() < 1e-6,
            "{left} instead of {expected}"
        );
    }
}

/// The settings of every method, and of averaged passes after XPBD.
fn methods() -> Vec<(&'static str, Settings)> {
    let base = settings(9.81, 600.0, 1, 3);
    let of = |method| Settings { method, ..base };
    vec![
        ("pbd", of(pbd(0.7))),
        ("jacobi", of(parsed(JACOBI).method)),
        ("verlet", of(Method::Verlet)),
        (
            "smoothed",
            Settings {
                smoothing_iterations: smoothing(4),
                ..base
            },
        ),
    ]
}

#[test]
fn a_substep_of_every_method_equals_the_references() {
    for (name, settings) in methods() {
        // Tetrahedra in a row, each sharing a face with the next.
        let mut bar = with(
            body("bar", cube(1.0, 2), 1000.0),
            Effects {
                stretch: stretch(1e-5),
                volume: volume(1e-7),
                ..elastic_on_ground()
            },
        );
        let mut random = Random::new(3);
        for x in &mut bar.particles.positions {
            *x += support::random_vector(&mut random, 0.05).extend(0.0);
        }
        bar.translate(Vec3::Y * 0.6);
        let mut fast = world(settings, pinned(bar, &[3]));
        let mut reference = reference::World::of(&fast);
        fast.tick();
        reference.tick();
        for (i, expected) in reference.bodies[0].x.iter().enumerate() {
            let error = fast.bodies[0].particles.position(i).distance(*expected);
            // About 30 operations per constraint on lengths of 1 m, about 30 constraints per
            // particle, seven iterations, none of which amplifies a difference.
            assert!(error < 7.0 * 30.0 * 8.0 * EPSILON, "{name}: {error}");
        }
    }
}

#[test]
fn methods_in_the_schedules_equal_those_of_the_plan() {
    for (name, settings) in methods() {
        let mut plan = falling(elastic_on_ground());
        plan.settings = settings;
        let (mut app, ..) = app_of(&plan);
        app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
        ticks(&mut app, 40);
        (0..40).for_each(|_| plan.tick());
        assert_eq!(state_hash(app.world_mut()), plan.state_hash(), "{name}");
    }
}

#[test]
fn verlet_without_constraints_falls_by_the_closed_form() {
    let mut verlet = world(settings(G, 60.0, 10, 1), body_of_masses(point(), &[1.0]));
    verlet.settings.method = Method::Verlet;
    let mut plain = verlet.clone();
    plain.settings.method = Method::Xpbd;
    verlet.tick();
    plain.tick();
    assert_eq!(verlet.state_hash(), plain.state_hash());
    // −gh²n(n+1)/2, within ten roundings of a fall of 15 mm.
    let (h, n) = (1.0 / 600.0, 10.0);
    let expected = -G * h * h * n * (n + 1.0) / 2.0;
    assert!((f64::from(position(&verlet, 0).y) - expected).abs() < 1e-6);
}

#[test]
fn an_isolated_particle_and_a_coincident_pair_stay_finite() {
    for (name, settings) in methods() {
        let mut shape = chain(2, 1.0);
        shape.vertices.push(Vec3::new(3.0, 0.0, 0.0));
        let mut body = body_of_masses(shape, &[1.0; 4]);
        body.effects.stretch = stretch(0.0);
        body.particles.positions[1] = body.particles.positions[0];
        let mut world = world(settings, body);
        run(&mut world, 1.0);
        let body = &world.bodies[0];
        assert!(body.quarantine.is_none(), "{name}");
        // The unconnected particle falls: in a second by about 4.9 m or, with damping, by less.
        let fallen = body.particles.positions[3].truncate();
        assert!(
            fallen.x == 3.0 && (-5.0..-0.1).contains(&fallen.y),
            "{name}: {fallen}"
        );
        let length = body.particles.positions[0].distance(body.particles.positions[1]);
        assert!((length - 1.0).abs() < 0.05, "{name}: {length}");
    }
}

/// Strains of the edges of a net whose rest lengths are half of what its frame allows.
fn strains(iterations: u32) -> (Vec<f64>, f64) {
    let shape = Primitive::Cloth {
        size: Vec2::splat(1.0),
        cells: UVec2::splat(10),
        diagonals: Default::default(),
        shear: false,
    };
    let mut net = with(
        body("net", shape.build().expect("sound").shape, 1.0),
        Effects {
            stretch: Some(Stretch::default()),
            ..Effects::default()
        },
    );
    // The frame is twice as wide as at rest.
    for x in &mut net.particles.positions {
        *x = (x.truncate() * 2.0).extend(x.w);
    }
    let rim = |i: &u32| {
        let (row, column) = (i / 11, i % 11);
        [0, 10].contains(&row) || [0, 10].contains(&column)
    };
    net.pins = (0..121).filter(rim).map(VertexIndex).collect();
    net.update_masses();
    net.particles.settle();
    let mut world = world(settings(0.0, 60.0, 1, 10), net);
    world.settings.smoothing_iterations = smoothing(iterations);
    run(&mut world, 10.0);
    let body = &world.bodies[0];
    let strains = edge_strains(body).collect();
    (strains, measure::rms_speed(&body.particles))
}

fn spread(strains: &[f64]) -> f64 {
    let mean = strains.iter().sum::<f64>() / strains.len() as f64;
    let squares: f64 = strains.iter().map(|strain| (strain - mean).powi(2)).sum();
    (squares / strains.len() as f64).sqrt()
}

#[test]
fn smoothing_distributes_unsatisfiable_errors_evenly() {
    let (rough, _) = strains(0);
    let (smooth, speed) = strains(10);
    let (before, after) = (spread(&rough), spread(&smooth));
    println!("spread {before} to {after}, speed {speed} m/s");
    assert!(after <= 0.5 * before, "{after} after {before}");
    assert!(speed < 1e-3, "{speed} m/s");
}

#[test]
fn smoothing_does_not_change_the_compliance_of_a_converged_body() {
    // One edge is solved by one iteration: αF = 1e-3 m/N · 9.81 N.
    let mut mass = pinned(body_of_masses(chain(1, 1.0), &[1.0, 1.0]), &[0]);
    mass.effects.stretch = stretch(1e-3);
    mass.effects.stretch.as_mut().expect("given").damping = support::damping(0.05);
    let mut world = world(settings(G, 60.0, 10, 1), mass);
    world.settings.smoothing_iterations = smoothing(8);
    run(&mut world, 5.0);
    let stretch = -f64::from(position(&world, 1).y) - 1.0;
    support::assert_relative(stretch, 1e-3 * G, 1e-3, "the stretch");
}

/// The cloth of the lab: 21 × 21 particles on 10 m × 10 m, flat, without obstacles.
fn cloth(edges: impl FnOnce(&mut Vec<[u32; 2]>)) -> Body {
    let shape = Primitive::Cloth {
        size: Vec2::splat(10.0),
        cells: UVec2::splat(20),
        diagonals: Default::default(),
        shear: false,
    };
    let mut shape = shape.build().expect("sound").shape;
    edges(&mut shape.edges);
    let mut cloth = with(
        body("cloth", shape, 1.0),
        Effects {
            stretch: Some(Stretch::default()),
            ..Effects::default()
        },
    );
    cloth.pins = [0, 20].map(VertexIndex).to_vec();
    cloth.update_masses();
    cloth
}

/// The lab: steps of 0.0333 s with this number of passes.
fn lab(iterations: u32, cloth: Body) -> World {
    let mut world = world(settings(9.8, 30.0, 1, iterations), cloth);
    world.settings.rate = Rate::new(1.0 / 0.0333).expect("sound");
    world.settings.method = parsed(JACOBI).method;
    world
}

#[test]
fn the_lab_has_every_edge_once() {
    let cloth = cloth(|_| ());
    let topology = &cloth.topology;
    assert_eq!(topology.particles(), 441);
    assert_eq!(topology.triangles.len(), 800);
    assert_eq!(topology.edges.ends().len(), 1240);
}

#[test]
fn a_particle_of_the_lab_falls_at_its_terminal_speed() {
    let mut world = lab(32, body_of_masses(point(), &[1.0]));
    run(&mut world, 0.0333 * 1000.0);
    let speed = -world.bodies[0].particles.velocity_f64(0).y;
    // The remaining 0.99¹⁰⁰⁰ = 4e-5 is still missing.
    support::assert_relative(speed, 9.8 * 0.0333 * 0.99 / 0.01, 0.01, "the speed");
}

/// A straightforward implementation of the lab in single precision.
struct Port {
    x: Vec<Vec3>,
    v: Vec<Vec3>,
    edges: Vec<([usize; 2], f32)>,
}

impl Port {
    fn of(body: &Body) -> Self {
        let numbers = &body.topology.numbering;
        let mut x = vec![Vec3::ZERO; 441];
        for (vertex, x) in x.iter_mut().enumerate() {
            let particle = numbers.particle(VertexIndex(vertex as u32)).index();
            *x = body.particles.positions[particle].truncate();
        }
        let vertex = |particle: u32| body.topology.vertex(particle as usize).index();
        let ends = body.topology.edges.ends().map(|ends| ends.map(vertex));
        let edges = ends
            .map(|[i, j]| ([i, j], (x[i] - x[j]).length()))
            .collect();
        Self {
            v: vec![Vec3::ZERO; 441],
            x,
            edges,
        }
    }

    fn frame(&mut self, iterations: u32, ball: Option<Vec3>) {
        const T: f32 = 0.0333;
        let pinned = |i: usize| [0, 20].contains(&i);
        for i in (0..441).filter(|i| !pinned(*i)) {
            self.v[i] += Vec3::Y * (-9.8 * T);
            self.v[i] *= 0.99;
            self.x[i] += self.v[i] * T;
        }
        for _ in 0..iterations {
            let mut sums = vec![Vec3::ZERO; 441];
            let mut counts = vec![0.0; 441];
            for &([i, j], length) in &self.edges {
                let (a, b) = (self.x[i], self.x[j]);
                let reach = (a - b).normalize() * length;
                sums[i] += 0.5 * (a + b + reach);
                sums[j] += 0.5 * (a + b - reach);
                counts[i] += 1.0;
                counts[j] += 1.0;
            }
            for i in (0..441).filter(|i| !pinned(*i)) {
                let x = (0.2 * self.x[i] + sums[i]) / (0.2 + counts[i]);
                self.v[i] += (x - self.x[i]) / T;
                self.x[i] = x;
            }
        }
        for i in (0..441).filter(|i| !pinned(*i)) {
            if let Some(center) = ball {
                let d = self.x[i] - center;
                if d.length() < 2.7 {
                    let x = center + 2.7 * d.normalize();
                    self.v[i] += (x - self.x[i]) / T;
                    self.x[i] = x;
                }
            }
        }
    }

    /// Continues from the state of a body.
    fn take(&mut self, body: &Body) {
        for vertex in 0..441 {
            let particle = body.topology.particle(VertexIndex(vertex));
            self.x[vertex as usize] = body.particles.position(particle).as_vec3();
            self.v[vertex as usize] = body.particles.velocity(particle);
        }
    }

    /// Largest difference of a position [m] and of a velocity [m/s] from those of a body.
    fn distance(&self, body: &Body) -> (f32, f32) {
        let mut most = (0.0_f32, 0.0_f32);
        for vertex in 0..441 {
            let particle = body.topology.particle(VertexIndex(vertex));
            let x = body.particles.position(particle).as_vec3();
            let v = body.particles.velocity(particle);
            most.0 = most.0.max(x.distance(self.x[vertex as usize]));
            most.1 = most.1.max(v.distance(self.v[vertex as usize]));
        }
        most
    }
}

#[test]
fn the_lab_equals_a_hand_written_one() {
    let cloth = cloth(|_| ());
    let mut port = Port::of(&cloth);
    let mut world = lab(32, cloth);
    let (mut worst, mut worst_of_port) = (0.0_f64, 0.0_f64);
    for frame in 1..=90 {
        // A folding cloth amplifies rounding: each frame starts from the same state.
        let mut exact = reference::World::of(&world);
        port.take(&world.bodies[0]);
        port.frame(32, None);
        world.tick();
        exact.tick();
        let (places, speeds) = port.distance(&world.bodies[0]);
        if frame == 1 {
            // Positions below 8 m are rounded by 2.4e-7 m in each of at most 32 passes, which adds
            // up to 8e-6 m, and to 1/t times that for velocities.
            assert!(places < 8e-6 && speeds < 2.4e-4, "{places} m, {speeds} m/s");
        }
        let body = &world.bodies[0];
        for (particle, x) in exact.bodies[0].x.iter().enumerate() {
            let vertex = body.topology.vertex(particle).index();
            let found = body.particles.position(particle);
            worst = worst.max(found.distance(*x));
            worst_of_port = worst_of_port.max(port.x[vertex].as_dvec3().distance(*x));
        }
    }
    println!("in a frame {worst} m, the hand-written one {worst_of_port} m");
    // The rotation of a short edge exceeds the rounding of its ends; both deviate from f64 by the
    // same amount, within the statistics of rounding.
    assert!(worst < 2.0 * worst_of_port, "{worst} m, {worst_of_port} m");
    assert!(worst_of_port < 1e-4, "{worst_of_port} m");
    assert_eq!(world.bodies[0].particles.positions[0].y, 0.0);
}

#[test]
fn the_order_of_edges_and_of_triangles_does_not_matter() {
    let after = |cloth: Body| {
        let mut world = lab(32, cloth);
        run(&mut world, 1.0);
        let body = &world.bodies[0];
        let numbers = &body.topology.numbering;
        let place =
            |i: u32| body.particles.positions[numbers.particle(VertexIndex(i)).index()].truncate();
        (0..441).map(place).collect::<Vec<_>>()
    };
    let given = after(cloth(|_| ()));
    let reversed = after(cloth(|edges| edges.reverse()));
    let apart = given.iter().zip(&reversed).map(|(a, b)| a.distance(*b));
    let apart = apart.fold(0.0, f32::max);
    // Roundings as above, of 30 frames.
    assert!(apart < 30.0 * 8e-6, "{apart}");
}

const BEGIN: &str = "<!-- the cloth lab: begin -->\n";
const END: &str = "<!-- the cloth lab: end -->";

/// After an intended change, `PLIANT_MINT=1 cargo test --release strain_against_iterations` writes
/// the table anew.
#[test]
fn strain_against_iterations_in_the_lab_is_as_documented() {
    let mut table =
        "| passes a step | root mean square strain | greatest strain |\n|---|---|---|\n".to_owned();
    let mut before = f64::INFINITY;
    for passes in [1, 2, 4, 8, 16, 32, 64, 128, 256] {
        let mut world = lab(passes, cloth(|_| ()));
        run(&mut world, 20.0);
        let body = &world.bodies[0];
        let (mean, most) = (rms_strain(body), edge_strains(body).fold(0.0, f64::max));
        assert!(
            mean < before,
            "{mean} by {passes}, {before} by half of them"
        );
        before = mean;
        let (mean, most) = (100.0 * mean, 100.0 * most);
        table += &format!("| {passes} | {mean:.1} % | {most:.0} % |\n");
    }
    println!("{table}");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/results/accuracy.md");
    let document = fs::read_to_string(&path).expect("it is there");
    let (start, rest) = document.split_once(BEGIN).expect("where it begins");
    let (_, end) = rest.split_once(END).expect("where it ends");
    let right = format!("{start}{BEGIN}{table}{END}{end}");
    if std::env::var_os("PLIANT_MINT").is_some() {
        fs::write(&path, right).expect("writable");
    } else {
        assert_eq!(document, right);
    }
}

#[test]
fn no_particle_of_the_lab_enters_its_ball_and_one_at_the_center_comes_out() {
    use pliant::solver::{Collide, Collider, ColliderShape, CollisionIterations, Friction, Pose};
    let mut cloth = cloth(|_| ());
    cloth.effects.collide = Some(Collide {
        friction: Friction::NONE,
        ..Collide::default()
    });
    let center = Vec3::new(0.0, -4.0, 0.0);
    let middle = cloth.topology.particle(VertexIndex(220));
    let mut world = lab(32, cloth);
    world.settings.collision_iterations = CollisionIterations::new(1).expect("in range");
    let ball = Collider::new(
        ColliderShape::Sphere { radius: 2.7 },
        Pose::at(center.as_dvec3()),
    );
    world.colliders.push(ball.expect("sound"));
    let particles = &mut world.bodies[0].particles;
    particles.set_position(middle, center.as_dvec3());
    for _ in 0..150 {
        world.tick();
        let body = &world.bodies[0];
        assert!(body.quarantine.is_none());
        for x in &body.particles.positions {
            let distance = x.truncate().distance(center);
            assert!(distance > 2.7 - 1e-5, "{distance}");
        }
    }
}

#[test]
fn a_method_that_is_not_selected_uses_no_memory() {
    let mut world = falling(elastic_on_ground());
    world.tick();
    let plain = world.bodies[0].states.bytes();
    world.settings.smoothing_iterations = smoothing(1);
    world.tick();
    assert!(world.bodies[0].states.bytes() > plain);
    world.settings.smoothing_iterations = smoothing(0);
    world.tick();
    assert_eq!(world.bodies[0].states.bytes(), plain);
    // A body of random elements with one particle each is handled as well.
    let mut lonely = support::world(world.settings, random_body::<1>(10, 3));
    lonely.settings.method = Method::Verlet;
    lonely.tick();
    assert!(lonely.bodies[0].quarantine.is_none());
}
