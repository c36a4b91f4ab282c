//! The formulas of `docs/coming-from.md`, each against the other engine itself.
//!
//! Pliant and the engine step the same few particles with parameters that the formulas translate, and are
//! compared tick by tick, or at rest where their integrators differ.

#[cfg(any(jolt, bullet))]
use crate::native::{Bodies, Extras, Functions};
use glam::Vec3;
use pliant::solver::{
    Bend, Body, Coefficient, Compliance, Damping, Density, Drag, Effects, Filling, Finite,
    FlexuralRigidity, NeoHookean, PoissonRatio, Pressure, RestShape, Stiffness, Stretch, Substeps,
    Topology, Uniform, VertexIndex, Volume, World, YoungsModulus,
};
use std::sync::Arc;

/// Gravity [m/s²].
const G: f64 = 9.81;

/// Substeps of a tick of 1/60 s.
const SUBSTEPS: u32 = 10;

/// Tolerance of a way relative to the largest displacement: the equations are the same, and both round
/// velocities and positions to f32 in each of 600 substeps.
const ROUNDING: f64 = 2e-3;

/// A few particles with masses [kg], of which some are pinned.
struct Case {
    shape: RestShape,
    masses: Vec<f32>,
    pins: Vec<u32>,
}

impl Case {
    /// A mass [kg] that hangs from a pin on an edge of this length [m].
    fn hanging(length: f32, mass: f32) -> Self {
        Self {
            shape: RestShape {
                vertices: vec![Vec3::ZERO, Vec3::NEG_Y * length],
                edges: vec![[0, 1]],
                ..RestShape::default()
            },
            masses: vec![1.0, mass],
            pins: vec![0],
        }
    }

    /// A free particle.
    fn free() -> Self {
        Self {
            pins: Vec::new(),
            ..Self::hanging(0.1, 1.0)
        }
    }

    /// Two triangles on an edge of `edge` along z, of which one is pinned; the corner of the other is a mass.
    fn hinge(edge: f32, arm: f32, mass: f32) -> Self {
        Self {
            shape: RestShape {
                vertices: vec![
                    Vec3::new(0.0, 0.0, -0.5 * edge),
                    Vec3::new(0.0, 0.0, 0.5 * edge),
                    Vec3::new(-arm, 0.0, 0.0),
                    Vec3::new(arm, 0.0, 0.0),
                ],
                edges: vec![[0, 1], [1, 2], [0, 2], [1, 3], [0, 3]],
                triangles: vec![[0, 1, 2], [1, 0, 3]],
                ..RestShape::default()
            },
            masses: vec![1.0, 1.0, 1.0, mass],
            pins: vec![0, 1, 2],
        }
    }

    /// A tetrahedron on a pinned face of ½ m², 1 m high, upside down.
    fn tetrahedron() -> Self {
        Self {
            shape: RestShape {
                vertices: vec![Vec3::ZERO, Vec3::X, Vec3::NEG_Y, Vec3::Z],
                edges: vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
                triangles: vec![[0, 3, 1], [0, 1, 2], [0, 2, 3], [1, 3, 2]],
                tetrahedra: vec![[0, 1, 3, 2]],
                ..RestShape::default()
            },
            masses: vec![1.0; 4],
            pins: vec![0, 1, 3],
        }
    }

    fn inverse_masses(&self) -> Vec<f32> {
        let mut inverse: Vec<f32> = self.masses.iter().map(|mass| 1.0 / mass).collect();
        for &pin in &self.pins {
            inverse[pin as usize] = 0.0;
        }
        inverse
    }

    /// How far a vertex is below its rest position after each tick in Pliant [m].
    fn ours(&self, effects: Effects, ticks: usize, vertex: u32) -> Vec<f64> {
        let topology = Topology::new(self.shape.clone()).expect("a sound shape");
        let mut body = Body::new("body", Arc::new(topology), Density::of(1.0));
        body.pins = self.pins.iter().copied().map(VertexIndex).collect();
        body.effects = effects;
        for (vertex, weight) in (0..).zip(self.inverse_masses()) {
            let particle = body.topology.particle(VertexIndex(vertex));
            body.particles.positions[particle].w = weight;
        }
        body.tick_start.clone_from(&body.particles);
        let mut world = World::default();
        world.sleep.enabled = false;
        world.settings.substeps = Substeps::of(SUBSTEPS);
        world.bodies.push(body);
        let at = |world: &World| {
            let body = &world.bodies[0];
            let particle = body.topology.particle(VertexIndex(vertex));
            body.particles.position(particle).y
        };
        let start = at(&world);
        (0..ticks)
            .map(|_| {
                world.tick();
                start - at(&world)
            })
            .collect()
    }
}

/// Edges of this compliance [m/N].
fn springs(compliance: f32, damping: f32) -> Effects {
    Effects {
        stretch: Some(Stretch {
            compliance: Compliance::of(compliance),
            damping: Damping::of(damping),
            ..Stretch::default()
        }),
        ..Effects::default()
    }
}

/// A drag [1/s] and a uniform acceleration upwards [m/s²].
fn falling(drag: f64, upwards: f64) -> Effects {
    Effects {
        drag: Some(Drag {
            linear: Coefficient::of(drag as f32),
            ..Drag::default()
        }),
        uniform: Some(Uniform {
            y: Finite::of(upwards as f32),
            ..Uniform::default()
        }),
        ..Effects::default()
    }
}

#[track_caller]
fn assert_same(ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len());
    let largest = theirs.iter().fold(0.0_f64, |most, it| most.max(it.abs()));
    assert!(largest > 0.0, "it does not move");
    for (tick, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        assert!(
            (ours - theirs).abs() <= tolerance * largest,
            "tick {tick}: {ours} m, expected {theirs} m of at most {largest} m"
        );
    }
}

#[cfg(any(jolt, bullet))]
impl Case {
    /// The way in a peer in C++.
    fn in_native(
        &self,
        peer: &'static Functions,
        edge_compliance: f32,
        volumes: Option<&[f32]>,
        extras: Extras,
        (ticks, vertex): (usize, usize),
    ) -> Vec<f64> {
        let bodies = Bodies {
            shape: &self.shape,
            inverse_masses: &self.inverse_masses(),
            offsets: &[Vec3::ZERO],
            edge_compliance,
            volume_compliances: volumes,
            substeps: SUBSTEPS,
            threads: 1,
            extras,
        };
        let mut world = peer.create("formula", &bodies).expect("a world");
        let start = f64::from(world.state().positions[vertex].y);
        (0..ticks)
            .map(|_| {
                world.step();
                start - f64::from(world.state().positions[vertex].y)
            })
            .collect()
    }
}

#[cfg(bullet)]
mod bullet {
    use super::*;
    use crate::{native::BULLET, scenes::SOFTNESS};

    /// α = h²w (1 − k)/k for one iteration, with k = 2/(2 + s) of the scene.
    #[test]
    fn a_linear_stiffness_is_a_compliance_by_step_and_mass() {
        let (mass, h) = (0.1_f32, 1.0 / (60.0 * SUBSTEPS as f32));
        let case = Case::hanging(0.2, mass);
        let k = 2.0 / (2.0 + SOFTNESS);
        let alpha = h * h / mass * (1.0 - k) / k;
        let ours = case.ours(springs(alpha, 0.0), 60, 1);
        let theirs = case.in_native(&BULLET, 0.0, None, Extras::default(), (60, 1));
        assert_same(&ours, &theirs, ROUNDING);
    }

    /// c = k/((1 − k)h), as the native part has it.
    #[test]
    fn a_damping_is_drag() {
        let case = Case::free();
        let damping = 0.5;
        let extras = Extras {
            linear_damping: damping as f32,
            ..Extras::default()
        };
        let theirs = case.in_native(&BULLET, 0.0, None, extras, (60, 1));
        let ours = case.ours(falling(damping, 0.0), 60, 1);
        assert_same(&ours, &theirs, ROUNDING);
    }
}

#[cfg(jolt)]
mod jolt {
    use super::*;
    use crate::native::JOLT;

    impl Case {
        /// The way in Jolt.
        fn in_jolt(
            &self,
            edge_compliance: f32,
            volumes: Option<&[f32]>,
            extras: Extras,
            way: (usize, usize),
        ) -> Vec<f64> {
            self.in_native(&JOLT, edge_compliance, volumes, extras, way)
        }
    }

    #[test]
    fn a_compliance_of_edges_is_the_same() {
        let case = Case::hanging(0.2, 0.1);
        let ours = case.ours(springs(1e-3, 0.0), 60, 1);
        let theirs = case.in_jolt(1e-3, None, Extras::default(), (60, 1));
        assert_same(&ours, &theirs, ROUNDING);
    }

    /// The native part multiplies by 36.
    #[test]
    fn a_compliance_of_volumes_is_36_times_as_large() {
        let case = Case::tetrahedron();
        let alpha = 1.4e-4;
        let effects = Effects {
            volume: Some(Volume {
                compliance: Compliance::of(alpha),
                ..Volume::default()
            }),
            // Jolt needs edges: soft ones, the same in both.
            ..springs(1e3, 0.0)
        };
        let ours = case.ours(effects, 60, 2);
        let theirs = case.in_jolt(1e3, Some(&[alpha]), Extras::default(), (60, 2));
        assert_same(&ours, &theirs, ROUNDING);
    }

    /// A hinge sags to where its moment is that of the weight. Jolt's angle has no damping: the mean of the way
    /// is compared, over 8 s; its ends are not whole periods, of which there are some 20.
    #[test]
    fn a_hinge_has_the_stiffness_of_its_angle() {
        let (edge, arm, alpha) = (0.5_f32, 0.4_f32, 1.0_f32);
        let case = Case::hinge(edge, arm, 0.076);
        let areas = edge * arm;
        let effects = Effects {
            bend: Some(Bend {
                stiffness: FlexuralRigidity::of(areas / (alpha * edge * edge)),
                ..Bend::default()
            }),
            ..springs(0.0, 0.0)
        };
        let extras = Extras {
            hinges: &[[0, 1, 2, 3]],
            hinge_compliance: alpha,
            ..Extras::default()
        };
        let mean = |way: Vec<f64>| way.iter().sum::<f64>() / way.len() as f64;
        let ours = mean(case.ours(effects, 480, 3));
        let theirs = mean(case.in_jolt(0.0, None, extras, (480, 3)));
        assert!(
            (ours / theirs - 1.0).abs() < 0.05,
            "{ours} m, expected {theirs} m"
        );
    }

    #[test]
    fn a_linear_damping_and_a_gravity_factor_are_drag_and_a_uniform_force() {
        let case = Case::free();
        let (damping, factor) = (0.5, 0.3);
        let extras = Extras {
            linear_damping: damping as f32,
            gravity_factor: factor as f32,
            ..Extras::default()
        };
        let theirs = case.in_jolt(0.0, None, extras, (60, 1));
        let ours = case.ours(falling(damping, G * (1.0 - factor)), 60, 1);
        // Equal to first order in h: the damping of a substep is 0.8 ‰.
        assert_same(&ours, &theirs, ROUNDING);
    }

    /// A tetrahedron whose apex is blown down by a gas in a vacuum, on edges that hold it: it swings about the
    /// same place.
    #[test]
    fn a_pressure_is_that_of_a_gas_in_a_vacuum() {
        let mut case = Case::tetrahedron();
        case.shape.tetrahedra.clear();
        let rest = 1.0 / 6.0;
        let amount = 6.0;
        let mut effects = springs(1e-2, 0.0);
        effects.pressure = Some(Pressure {
            factor: Filling::of(1000.0),
            bulk_modulus: Stiffness::of((amount / (1000.0 * rest)) as f32),
        });
        let extras = Extras {
            pressure: amount as f32,
            ..Extras::default()
        };
        let mean = |way: Vec<f64>| way.iter().sum::<f64>() / way.len() as f64;
        let ours = mean(case.ours(effects, 240, 2));
        let theirs = mean(case.in_jolt(1e-2, None, extras, (240, 2)));
        // Jolt takes the force at the start of a substep.
        assert!(
            (ours / theirs - 1.0).abs() < 0.02,
            "{ours} m, expected {theirs} m"
        );
        let without = mean(case.in_jolt(1e-2, None, Extras::default(), (240, 2)));
        assert!(theirs > 1.2 * without, "{theirs} m, {without} m without");
    }
}

#[cfg(feature = "rapier")]
mod rapier {
    use super::*;
    use rapier3d::prelude::{
        PhysicsWorld, Real, SoftBodyBuilder, SoftBodyCellModel, SoftBodyMaterial,
        SpringCoefficients, Vector,
    };
    use std::f64::consts::{PI, TAU};

    impl Case {
        /// The way in Rapier.
        fn in_rapier(
            &self,
            settings: impl FnOnce(SoftBodyBuilder) -> SoftBodyBuilder,
            (ticks, vertex): (usize, usize),
        ) -> Vec<f64> {
            let mut world = PhysicsWorld::new();
            world.gravity = Vector::new(0.0, -G as Real, 0.0);
            let parameters = &mut world.integration_parameters;
            parameters.dt = 1.0 / 60.0;
            parameters.num_solver_iterations = SUBSTEPS as usize;
            parameters.soft_bodies.max_extra_substeps = 0;
            let at = |x: &Vec3| Vector::new(x.x, x.y, x.z);
            let body = SoftBodyBuilder::new(self.shape.vertices.iter().map(at).collect())
                .masses(self.masses.clone())
                .pinned_particles(self.pins.iter().copied())
                .edges(self.shape.edges.clone())
                .no_surface_collider()
                .can_sleep(false);
            let body = world.insert_soft_body(settings(body));
            let height = |world: &PhysicsWorld| {
                let body = world.soft_bodies.get(body).expect("it is there");
                f64::from(body.particle_position(vertex).y)
            };
            let start = height(&world);
            (0..ticks)
                .map(|_| {
                    world.step();
                    start - height(&world)
                })
                .collect()
        }
    }

    /// α = w/(2πf)²: a mass hangs lower by g/(2πf)², whatever it is.
    #[test]
    fn a_natural_frequency_of_edges_is_a_compliance_by_mass() {
        let (frequency, ratio) = (2.0, 1.0);
        for mass in [0.05, 0.4] {
            let case = Case::hanging(0.2, mass);
            let softness = SpringCoefficients::new(frequency as Real, ratio as Real);
            let theirs = case.in_rapier(|body| body.softness(softness), (240, 1));
            let alpha = 1.0 / (f64::from(mass) * (TAU * frequency).powi(2));
            let damping = ratio / (PI * frequency);
            let ours = case.ours(springs(alpha as f32, damping as f32), 240, 1);
            // At rest; on the way there both are of first order in h, with ωh = 0.02.
            assert_same(&ours[200..], &theirs[200..], ROUNDING);
            assert_same(&ours, &theirs, 0.04);
        }
    }

    #[test]
    fn a_linear_damping_and_a_gravity_scale_are_drag_and_a_uniform_force() {
        let case = Case::free();
        let (damping, scale) = (0.5, 0.3);
        let set = |body: SoftBodyBuilder| {
            body.linear_damping(damping as Real)
                .gravity_scale(scale as Real)
        };
        let theirs = case.in_rapier(set, (60, 1));
        let ours = case.ours(falling(damping, G * (1.0 - scale)), 60, 1);
        // To first order: a damping of 0.8 ‰ per substep, and half a substep of gravity in 60 ticks.
        assert_same(&ours, &theirs, 2.0 * ROUNDING);
    }

    /// The apex of a tetrahedron hangs from its pinned face.
    #[test]
    fn elastic_moduli_are_the_same() {
        let case = Case::tetrahedron();
        let (modulus, ratio) = (400.0, 0.3);
        let set = |body: SoftBodyBuilder| {
            let body = body
                .edges(Vec::new())
                .cells(case.shape.tetrahedra.clone())
                .cell_model(SoftBodyCellModel::NeoHookean);
            body.material(SoftBodyMaterial {
                young_modulus: modulus as Real,
                poisson_ratio: ratio as Real,
                ..SoftBodyMaterial::default()
            })
        };
        let theirs = case.in_rapier(set, (600, 2));
        let effects = Effects {
            neo_hookean: Some(NeoHookean {
                youngs_modulus: YoungsModulus::of(modulus as f32),
                poisson_ratio: PoissonRatio::of(ratio as f32),
                damping: Damping::of(0.2),
            }),
            ..Effects::default()
        };
        let ours = case.ours(effects, 600, 2);
        // At rest.
        assert_same(&ours[560..], &theirs[560..], 0.01);
    }
}
