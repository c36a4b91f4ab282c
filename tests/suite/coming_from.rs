//! The formulas of `docs/coming-from.md`: Pliant compared with the equations of other engines,
//! written out here in f64, and the names of the parameters on that page.

use crate::{
    support::{
        G, assert_relative, body, body_of_masses, chain, damping, edge_strains, pinned, point, run,
        settings, stretch, tetrahedron, volume, with, world,
    },
    support_app::app,
};
use glam::{DVec3, Vec3};
use pliant::{
    effect::EffectRegistry,
    mesh::Primitive,
    solver::{
        Bend, Body, Coefficient, Drag, Effects, Filling, Finite, FlexuralRigidity, Fraction,
        Frequency, Method, Pressure, RestShape, ShapeMatching, Slack, Stiffness, Strain,
        StrainLimit, Tethers, Uniform, VertexIndex, World,
    },
};
use std::{
    f64::consts::{PI, TAU},
    fs,
    path::Path,
};

/// Tolerance of a way relative to its largest extension: the equations are the same, Pliant rounds
/// displacements to f32.
const ROUNDING: f64 = 1e-3;

/// How a case is stepped.
#[derive(Clone, Copy)]
struct Steps {
    /// Ticks per second [Hz].
    rate: f64,
    /// Substeps of a tick.
    substeps: u32,
    /// Number of ticks.
    ticks: usize,
}

/// A second of 1/600 s.
const FINE: Steps = Steps {
    rate: 60.0,
    substeps: 10,
    ticks: 60,
};
/// A second of 1/60 s.
const COARSE: Steps = Steps {
    substeps: 1,
    ..FINE
};

impl Steps {
    /// Length of a substep [s].
    fn h(self) -> f64 {
        1.0 / (self.rate * f64::from(self.substeps))
    }

    /// Position-based dynamics of one particle under gravity: its extension [m] after each tick.
    ///
    /// Extension is measured downwards, and `project` maps the predicted one to the final one of a
    /// substep; its second argument is the one before the substep.
    fn textbook(self, start: f64, project: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let h = self.h();
        let (mut extension, mut speed) = (start, 0.0);
        let mut way = Vec::with_capacity(self.ticks);
        for _ in 0..self.ticks {
            for _ in 0..self.substeps {
                let before = extension;
                speed += h * G;
                extension = project(before + h * speed, before);
                speed = (extension - before) / h;
            }
            way.push(extension);
        }
        way
    }

    /// The same in Pliant: the way of a vertex downwards from its rest position [m].
    fn pliant(self, mut world: World, vertex: u32) -> Vec<f64> {
        let mut way = Vec::with_capacity(self.ticks);
        for _ in 0..self.ticks {
            world.tick();
            let body = &world.bodies[0];
            let particle = body.topology.particle(VertexIndex(vertex));
            let rest = f64::from(body.topology.rest[particle].y);
            way.push(rest - body.particles.position(particle).y);
        }
        way
    }

    /// A world of these steps with gravity.
    fn world(self, iterations: u32, body: Body) -> World {
        world(settings(G, self.rate, self.substeps, iterations), body)
    }
}

/// Fails unless both ways are equal within a tolerance relative to the largest extension.
#[track_caller]
fn assert_same(ours: &[f64], theirs: &[f64], tolerance: f64, what: &str) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let largest = theirs.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    assert!(largest > 0.0, "{what}: it does not move");
    for (tick, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        assert!(
            (ours - theirs).abs() <= tolerance * largest,
            "{what}, tick {tick}: {ours} m, expected {theirs} m"
        );
    }
}

/// A mass [kg] that hangs from a pin on an edge of this length [m].
fn hanging(length: f32, mass: f32, effects: Effects) -> Body {
    pinned(
        with(body_of_masses(chain(1, length), &[1.0, mass]), effects),
        &[0],
    )
}

/// Edges of this compliance [m/N].
fn springs(compliance: f32) -> Effects {
    Effects {
        stretch: stretch(compliance),
        ..Effects::default()
    }
}

/// Ten Minute Physics (`edgeCompliance`, `stretchingCompliance`), Obi (stretch compliance) and Jolt
/// (`Edge::mCompliance`) project an edge by C/(w + α/h²), without a multiplier.
#[test]
fn a_compliance_of_edges_is_the_same() {
    let (alpha, mass) = (1e-3_f32, 0.1_f32);
    let (w, softness) = (
        1.0 / f64::from(mass),
        f64::from(alpha) / (FINE.h() * FINE.h()),
    );
    let theirs = FINE.textbook(0.0, |e, _| e - w * e / (w + softness));
    let world = FINE.world(1, hanging(0.01, mass, springs(alpha)));
    assert_same(&FINE.pliant(world, 1), &theirs, ROUNDING, "edge");
}

/// Ten Minute Physics (`volCompliance`) takes C = V − V₀, Jolt (`Volume::mCompliance`)
/// C = 6 (V − V₀).
///
/// A vertex of the unit tetrahedron is lowered by e over its pinned face of ½ m²: V − V₀ = −e/6 and
/// ‖∇V‖ = 1/6 m², so w‖∇C‖² is w/36, or w for Jolt.
#[test]
fn a_compliance_of_volumes_is_the_same_and_that_of_jolt_is_36_times_as_large() {
    let (alpha, w) = (1.4e-4_f32, 1.0);
    let softness = f64::from(alpha) / (FINE.h() * FINE.h());
    let lesson = FINE.textbook(0.0, |e, _| {
        let (error, gradient) = (-e / 6.0, -1.0 / 6.0);
        let lambda = -error / (w * gradient * gradient + softness);
        e + w * gradient * lambda
    });
    let jolt = FINE.textbook(0.0, |e, _| {
        let (error, gradient) = (-e, -1.0);
        let lambda = -error / (w * gradient * gradient + 36.0 * softness);
        e + w * gradient * lambda
    });
    let effects = Effects {
        volume: volume(alpha),
        ..Effects::default()
    };
    let body = with(body_of_masses(tetrahedron(), &[1.0; 4]), effects);
    let ours = FINE.pliant(FINE.world(1, pinned(body, &[0, 1, 3])), 2);
    assert_same(&ours, &lesson, ROUNDING, "Ten Minute Physics");
    assert_same(&ours, &jolt, ROUNDING, "Jolt");
}

/// Vellum's distance constraint of stiffness k and damping ratio d is that of the XPBD paper with
/// α = 1/k and β = kd: γ = αβ/h = d/h, so that d is a time.
#[test]
fn the_damping_ratio_of_vellum_is_a_time() {
    const ITERATIONS: u32 = 10;
    let steps = Steps {
        rate: 24.0,
        substeps: 5,
        ticks: 48,
    };
    let (stiffness, ratio, mass) = (1000.0_f32, 0.01_f32, 0.1_f32);
    let (h, w) = (steps.h(), 1.0 / f64::from(mass));
    let alpha = 1.0 / (f64::from(stiffness) * h * h);
    let beta = f64::from(stiffness) * f64::from(ratio) * h * h;
    let gamma = alpha * beta / h;
    let theirs = steps.textbook(0.0, |mut e, before| {
        let mut lambda = 0.0;
        for _ in 0..ITERATIONS {
            let left = e + alpha * lambda + gamma * (e - before);
            let change = -left / ((1.0 + gamma) * w + alpha);
            lambda += change;
            e += w * change;
        }
        e
    });
    let mut effects = springs(1.0 / stiffness);
    if let Some(stretch) = &mut effects.stretch {
        stretch.damping = damping(ratio);
    }
    let world = steps.world(ITERATIONS, hanging(0.01, mass, effects));
    assert_same(&steps.pliant(world, 1), &theirs, ROUNDING, "distance");
}

/// A hinge of k N·m per radian (Vellum's stiffness; 1/α of Jolt's `DihedralBend::mCompliance`) is
/// B = k (A₀ + A₁)/e².
///
/// ```text
///        1
///      / │ \        the edge 0–1 of e = 0.5 m and vertex 2 are pinned, 3 sags by θ about the
///    2 ──┼── 3      edge, L = 0.4 m away
///      \ │ /
///        0
/// ```
///
/// It settles where kθ = mgL cos θ, for rigid edges.
#[test]
fn a_hinge_has_the_stiffness_of_its_angle() {
    let (edge, arm, stiffness) = (0.5_f32, 0.4_f32, 1.0_f64);
    let mass = 0.3 / (G * f64::from(arm));
    let shape = RestShape {
        vertices: vec![
            Vec3::new(0.0, 0.0, -0.5 * edge),
            Vec3::new(0.0, 0.0, 0.5 * edge),
            Vec3::new(-arm, 0.0, 0.0),
            Vec3::new(arm, 0.0, 0.0),
        ],
        edges: vec![[0, 1], [1, 2], [2, 0], [1, 3], [3, 0]],
        triangles: vec![[0, 1, 2], [1, 0, 3]],
        ..RestShape::default()
    };
    let areas = f64::from(edge) * f64::from(arm);
    let rigidity = stiffness * areas / (f64::from(edge) * f64::from(edge));
    let effects = Effects {
        bend: Some(Bend {
            stiffness: FlexuralRigidity::new(rigidity as f32).expect("sound"),
            damping: damping(0.1),
        }),
        ..springs(0.0)
    };
    let body = with(
        body_of_masses(shape, &[1.0, 1.0, 1.0, mass as f32]),
        effects,
    );
    let mut world = world(settings(G, 60.0, 10, 4), pinned(body, &[0, 1, 2]));
    run(&mut world, 4.0);
    let body = &world.bodies[0];
    let corner = body.topology.particle(VertexIndex(3));
    let sag = -body.particles.position(corner).y;
    let mut angle = 0.0_f64;
    for _ in 0..50 {
        // Contracts, as mgL/k = 0.3 is below 1.
        angle = 0.3 / stiffness * angle.cos();
    }
    // At rest both constraints of the particle are met but for what gravity adds in a substep.
    assert_relative(sag, f64::from(arm) * angle.sin(), 2e-3, "sag");
}

/// A sphere of 0.25 m.
fn sphere(cells: u32) -> RestShape {
    let balloon = Primitive::Balloon {
        radius: 0.25,
        cells,
    };
    balloon.build().expect("a sound sphere").shape
}

/// Fill ratio and bulk modulus [Pa].
fn filled(factor: f64, modulus: f64) -> Pressure {
    Pressure {
        factor: Filling::new(factor as f32).expect("sound"),
        bulk_modulus: Stiffness::new(modulus as f32).expect("sound"),
    }
}

/// Jolt's `mPressure` P gives p = P/V. With f = 1000 and K = P/(1000 V₀), K (fV₀/V − 1) is
/// P/V − P/(1000 V₀).
#[test]
fn the_pressure_of_jolt_is_that_of_a_gas_in_a_vacuum() {
    const FILL: f64 = 1000.0;
    let mut effects = springs(1e-3);
    if let Some(stretch) = &mut effects.stretch {
        stretch.damping = damping(0.01);
    }
    let mut balloon = with(body("balloon", sphere(3), 0.3), effects);
    let enclosure = *balloon.topology.enclosure().expect("closed");
    let rest = enclosure.rest_volume;
    let amount = 2000.0 * rest;
    let pressure = filled(FILL, amount / (FILL * rest));
    for ratio in [0.5, 1.0, 2.0, 4.0] {
        let ours = pressure.overpressure(&enclosure, ratio * rest);
        let theirs = amount / (ratio * rest);
        let apart = (ours - theirs).abs();
        // K and f are rounded to f32.
        let bound = amount / (FILL * rest) + 1e-6 * theirs;
        assert!(apart <= bound, "{ours} Pa, expected {theirs} Pa");
    }
    balloon.effects.pressure = Some(pressure);
    let mut world = world(settings(0.0, 60.0, 50, 8), balloon);
    run(&mut world, 1.0);
    let body = &world.bodies[0];
    let h = world.settings.substep_seconds();
    let found = body
        .states
        .others
        .pressure
        .overpressure(h)
        .expect("stepped");
    let volume = enclosure.volume(&body.topology, |i| body.particles.position(i as usize));
    assert!(volume > 1.1 * rest, "it is blown up: {volume} m³");
    // V/(1000 V₀) is 1.4e-3; the rest is for the residual of the iterations.
    assert_relative(found * volume, amount, 3e-3, "pV");
}

/// Vellum's pressure of stiffness k and rest length scale s has C = V − sV₀ and the force kC along
/// −∇V. With K = ksV₀ and f = s, K (fV₀/V − 1) is −kC (1 − C/V).
#[test]
fn the_pressure_of_vellum_is_a_bulk_modulus() {
    let balloon = body("balloon", sphere(2), 1.0);
    let enclosure = *balloon.topology.enclosure().expect("closed");
    let rest = enclosure.rest_volume;
    for (stiffness, scale) in [(1e4, 1.0), (1e6, 1.5)] {
        let pressure = filled(scale, stiffness * scale * rest);
        for ratio in [0.99, 1.01] {
            let volume = ratio * scale * rest;
            let theirs = -stiffness * (volume - scale * rest);
            let ours = pressure.overpressure(&enclosure, volume);
            // |C/V| is at most 1.01 %.
            assert_relative(ours, theirs, 1.1e-2, "overpressure");
        }
    }
}

/// Bullet pushes a node by the mean area of its triangles times the pressure, along its normal.
/// ∇V is a third of the sum of their areas: with six triangles, twice that.
#[test]
fn a_pressure_of_bullet_acts_half_as_much() {
    let balloon = body("balloon", sphere(4), 1.0);
    let topology = &balloon.topology;
    let enclosure = topology.enclosure().expect("closed");
    let x: Vec<DVec3> = topology.rest.iter().map(|x| x.as_dvec3()).collect();
    let mut gradients = vec![DVec3::ZERO; x.len()];
    enclosure.volume_and_gradients(topology, |i| x[i as usize], &mut gradients);
    let mut areas = vec![(0.0, 0.0); x.len()];
    for corners in topology.triangles.iter() {
        let [a, b, c] = corners.map(|i| x[i as usize]);
        let area = 0.5 * (b - a).cross(c - a).length();
        for &i in corners {
            let (sum, count) = &mut areas[i as usize];
            *sum += area;
            *count += 1.0;
        }
    }
    // The work in a uniform growth, of which the position is the direction.
    let (mut theirs, mut ours) = (0.0, 0.0);
    for ((x, gradient), (sum, count)) in x.iter().zip(&gradients).zip(areas) {
        theirs += (gradient.normalize() * (sum / count)).dot(*x);
        ours += gradient.dot(*x);
    }
    // Twelve of 162 nodes have five triangles, and the normals of the triangles of a node differ.
    assert_relative(theirs / ours, 0.5, 0.05, "fraction of the force");
}

/// Damping c and the factor or scale f of gravity, of a particle that is thrown sideways.
///
/// Jolt (`mLinearDamping`) multiplies velocities by 1 − ch, Rapier and Avian by 1/(1 + ch), as
/// here. Those of Jolt differ by (ch)² = 3e-6 in each of 300 substeps, together by 8e-4.
#[test]
fn a_linear_damping_and_a_gravity_factor_are_drag_and_a_uniform_force() {
    let (c, factor, sideways) = (0.5_f32, 0.25, 0.3_f32);
    let steps = Steps {
        substeps: 5,
        ..FINE
    };
    let h = steps.h();
    let ch = f64::from(c) * h;
    let effects = Effects {
        drag: Some(Drag {
            linear: Coefficient::of(c),
            quadratic: Coefficient::of(0.0),
        }),
        uniform: Some(Uniform {
            y: Finite::of((G * (1.0 - factor)) as f32),
            ..Uniform::default()
        }),
        ..Effects::default()
    };
    let mut world = steps.world(1, with(body_of_masses(point(), &[1.0]), effects));
    world.bodies[0].set_velocity(Vec3::new(sideways, 0.0, 0.0));
    run(&mut world, 1.0);
    let ours = world.bodies[0].particles.position(0);
    for (kept, tolerance, what) in [
        (1.0 - ch, 2e-3, "Jolt"),
        (1.0 / (1.0 + ch), ROUNDING, "Rapier and Avian"),
    ] {
        let mut v = DVec3::X * f64::from(sideways);
        let mut x = DVec3::ZERO;
        for _ in 0..300 {
            v = (v - DVec3::Y * (factor * G * h)) * kept;
            x += v * h;
        }
        let apart = ours.distance(x);
        assert!(
            apart <= tolerance * x.length(),
            "{what}: {ours}, expected {x}"
        );
    }
}

/// Jolt's `mLRAMaxDistanceMultiplier` and Obi's tether scale s: at most s times the rest distance
/// along the mesh. On edges of 1 m/N, the load hangs on its tether alone.
#[test]
fn the_scale_of_a_tether_is_its_slack_and_one() {
    let scale = 1.1_f32;
    let mut effects = Effects {
        tethers: Some(Tethers {
            slack: Slack::new(scale - 1.0).expect("sound"),
        }),
        ..springs(1.0)
    };
    if let Some(stretch) = &mut effects.stretch {
        stretch.damping = damping(0.05);
    }
    let rope = body_of_masses(chain(4, 0.05), &[0.1, 0.1, 0.1, 0.1, 1.0]);
    let mut world = world(settings(G, 60.0, 10, 1), pinned(with(rope, effects), &[0]));
    run(&mut world, 3.0);
    let body = &world.bodies[0];
    let end = body.topology.particle(VertexIndex(4));
    let length = -body.particles.position(end).y;
    assert_relative(length, 0.2 * f64::from(scale), 1e-4, "length");
}

/// Obi's distance constraint with compliance 0, max compression 1 and the stretching scale s: an
/// edge is put back to s times its length if it is longer, and free if it is shorter.
#[test]
fn a_constraint_that_may_be_compressed_is_a_strain_limit() {
    let (length, scale) = (0.1_f32, 1.2_f32);
    let most = f64::from(scale - 1.0) * f64::from(length);
    let theirs = FINE.textbook(-0.06, |e, _| e.min(most));
    let effects = Effects {
        strain_limit: Some(StrainLimit {
            limit: Strain::new(scale - 1.0).expect("sound"),
        }),
        ..Effects::default()
    };
    let mut world = FINE.world(1, hanging(length, 0.1, effects));
    // Shorter by 6 cm.
    world.bodies[0]
        .particles
        .set_position(1, DVec3::new(0.0, -0.04, 0.0));
    assert_same(&FINE.pliant(world, 1), &theirs, ROUNDING, "edge");
}

/// Bullet's `m_kLST` k and `piterations` n, as any stiffness of classic position-based dynamics:
/// each iteration leaves 1 − k of the error. XPBD leaves α̃/(w + α̃), which is (1 − k)ⁿ for
/// α̃ = w (1 − k)ⁿ/(1 − (1 − k)ⁿ).
#[test]
fn a_stiffness_of_iterations_is_a_compliance_of_one_step_length() {
    // Lengths of 1 cm are rounded to 1e-9 m, and the smallest extension is 9e-6 m.
    const TOLERANCE: f64 = 2e-3;
    let (k, mass) = (0.3_f32, 0.1_f32);
    let w = 1.0 / f64::from(mass);
    for steps in [FINE, COARSE] {
        for iterations in [1_u8, 4] {
            let h = steps.h();
            let left = (1.0 - f64::from(k)).powi(i32::from(iterations));
            let theirs = steps.textbook(0.0, |e, _| e * left);
            let what = format!("{iterations} iterations of {h} s");

            let alpha = h * h * w * left / (1.0 - left);
            let world = steps.world(1, hanging(0.01, mass, springs(alpha as f32)));
            assert_same(&steps.pliant(world, 1), &theirs, TOLERANCE, &what);

            let body = hanging(0.01, mass, springs(0.0));
            let mut world = steps.world(iterations.into(), body);
            world.settings.method = Method::Pbd {
                stiffness: Fraction::new(k).expect("a fraction"),
            };
            assert_same(&steps.pliant(world, 1), &theirs, TOLERANCE, &what);
        }
    }
}

/// Bullet's `kDP` k leaves 1 − k of the velocity after a step; drag leaves 1/(1 + ch).
#[test]
fn a_damping_coefficient_of_bullet_is_drag_of_one_step_length() {
    let k = 0.1_f32;
    let c = f64::from(k) / ((1.0 - f64::from(k)) * COARSE.h());
    let effects = Effects {
        drag: Some(Drag {
            linear: Coefficient::new(c as f32).expect("sound"),
            quadratic: Coefficient::of(0.0),
        }),
        ..Effects::default()
    };
    let body = with(body_of_masses(point(), &[1.0]), effects);
    let mut world = world(settings(0.0, COARSE.rate, 1, 1), body);
    world.bodies[0].set_velocity(Vec3::X);
    for _ in 0..10 {
        world.tick();
    }
    let left = world.bodies[0].particles.velocity_f64(0).x;
    assert_relative(left, (1.0 - f64::from(k)).powi(10), ROUNDING, "speed");
}

/// Bullet's `kMT` k moves every node by the fraction k towards the matched shape once a step. An
/// implicit step of frequency f leaves 1/(1 + (2πfh)²) of the deviation.
#[test]
fn pose_matching_is_a_frequency_of_one_step_length() {
    let k = 0.3_f64;
    let frequency = (k / (1.0 - k)).sqrt() / (TAU * COARSE.h());
    let effects = Effects {
        shape_matching: Some(ShapeMatching {
            frequency: Frequency::new(frequency as f32).expect("sound"),
            ..ShapeMatching::default()
        }),
        ..Effects::default()
    };
    let mut body = with(body_of_masses(tetrahedron(), &[1.0; 4]), effects);
    // A tenth larger, about its center of mass.
    let middle = DVec3::splat(0.25);
    for i in 0..4 {
        let rest = body.topology.rest[i].as_dvec3();
        body.particles
            .set_position(i, middle + (rest - middle) * 1.1);
    }
    let mut world = world(settings(0.0, COARSE.rate, 1, 1), body);
    world.tick();
    for strain in edge_strains(&world.bodies[0]) {
        assert_relative(strain, 0.1 * (1.0 - k), 1e-4, "strain");
    }
}

/// Rapier's softness of f Hz and ζ is α = w/(2πf)² and τ = ζ/(πf): the extension of an edge without
/// load decays as that of a damped oscillator, e^(−ζωt) (cos ω't + ζω/ω' sin ω't).
#[test]
fn a_frequency_and_a_damping_ratio_are_those_of_an_oscillator() {
    const START: f64 = 0.02;
    let (frequency, ratio, mass) = (2.0, 0.2, 0.5_f32);
    let omega = TAU * frequency;
    let alpha = 1.0 / (f64::from(mass) * omega * omega);
    let mut effects = springs(alpha as f32);
    if let Some(stretch) = &mut effects.stretch {
        stretch.damping = damping((ratio / (PI * frequency)) as f32);
    }
    let steps = Steps {
        substeps: 100,
        ..FINE
    };
    let body = hanging(0.1, mass, effects);
    let mut world = world(settings(0.0, steps.rate, steps.substeps, 1), body);
    let start = DVec3::new(0.0, -0.1 - START, 0.0);
    world.bodies[0].particles.set_position(1, start);
    let turns = omega * (1.0 - ratio * ratio).sqrt();
    let exact = |tick: usize| {
        let t = (tick + 1) as f64 / steps.rate;
        let swing = (turns * t).cos() + ratio * omega / turns * (turns * t).sin();
        START * (-ratio * omega * t).exp() * swing
    };
    let theirs: Vec<f64> = (0..steps.ticks).map(exact).collect();
    // Errors of an implicit step are of the first order: ωh is 2e-3.
    assert_same(&steps.pliant(world, 1), &theirs, 5e-3, "oscillation");
}

/// `effect.parameter` between backticks.
#[test]
fn every_parameter_of_the_page_exists() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/coming-from.md");
    let page = fs::read_to_string(path).expect("it is there");
    let app = app();
    let registry = app.world().resource::<EffectRegistry>();
    let is_name = |text: &str| {
        let mut letters = text.bytes();
        !text.is_empty() && letters.all(|letter| letter == b'_' || letter.is_ascii_lowercase())
    };
    let mut count = 0;
    for code in page.split('`').skip(1).step_by(2) {
        let Some((effect, parameter)) = code.split_once('.') else {
            continue;
        };
        if !is_name(effect) || !is_name(parameter) {
            continue;
        }
        let info = registry.get(effect);
        let info = info.unwrap_or_else(|| panic!("{code}: there is no effect {effect}"));
        let exists = info.parameters.iter().any(|it| it.name == parameter);
        assert!(exists, "{code}: {effect} has no such parameter");
        count += 1;
    }
    assert!(count > 30, "only {count} parameters on the page");
}
