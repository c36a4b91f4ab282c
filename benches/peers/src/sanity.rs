//! Checks that a run has all constraints of the scene and has not diverged.
//!
//! No speed is given for a run that fails: that of a solver that lost its constraints, or whose
//! positions are not finite, means nothing.
//!
//! Its tests check the formulas of `docs/coming-from.md` by which parameters of the peers become
//! those of Pliant.

use crate::{
    peer::Report,
    scenes::{Scene, volume},
};
use glam::Vec3;
use serde::Serialize;

/// Maximum root mean square strain of the edges.
const MAX_STRAIN: f64 = 0.5;
/// Maximum diagonal of the bounding box of a body, over its initial one.
const MAX_GROWTH: f32 = 3.0;
/// Maximum displacement of a pin [m].
const MAX_SLIP: f32 = 1e-2;
/// Minimum displacement of the particle that moved most during the warm-up [m].
const MIN_MOTION: f32 = 1e-4;

/// Residual of the constraints of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Residual {
    /// Root mean square of length over rest length, minus 1.
    pub edge_strain: f64,
    /// Root mean square of volume over rest volume, minus 1.
    pub volume_strain: f64,
}

/// Checks a run, and returns its residual.
///
/// # Errors
/// The reason why the run is rejected, in a few words.
pub fn examine(scene: &Scene, has_volume: bool, report: &Report) -> Result<Residual, String> {
    let counts = report.counts;
    let tetrahedra = if has_volume { scene.tetrahedra() } else { 0 };
    if (counts.edges, counts.tetrahedra) != (scene.edges(), tetrahedra) {
        return Err(format!(
            "holds {} edges and {} tetrahedra, not {} and {tetrahedra}",
            counts.edges,
            counts.tetrahedra,
            scene.edges()
        ));
    }
    if report.positions.len() != scene.particles() {
        return Err(format!("has {} particles", report.positions.len()));
    }
    if !report.positions.iter().all(|x| x.is_finite()) {
        return Err("not finite".into());
    }
    let bodies = || report.positions.chunks(scene.shape.vertices.len());
    for (body, offset) in bodies().zip(&scene.offsets) {
        check_body(scene, body, *offset)?;
    }
    let residual = residual(scene, bodies());
    if residual.edge_strain > MAX_STRAIN {
        return Err(format!(
            "edges strained by {:.0} %",
            residual.edge_strain * 100.0
        ));
    }
    Ok(residual)
}

/// Root mean square strain of the edges at these positions.
#[must_use]
pub fn strain(scene: &Scene, positions: &[Vec3]) -> f64 {
    residual(scene, positions.chunks(scene.shape.vertices.len())).edge_strain
}

fn check_body(scene: &Scene, body: &[Vec3], offset: Vec3) -> Result<(), String> {
    let rest = &scene.shape.vertices;
    let slip = |&pin: &u32| body[pin as usize].distance(rest[pin as usize] + offset);
    if scene.pins.iter().map(slip).any(|slip| slip > MAX_SLIP) {
        return Err("a pin moved".into());
    }
    let growth = diagonal(body) / diagonal(rest);
    if growth > MAX_GROWTH {
        return Err(format!("fell apart to {growth:.1} times its size"));
    }
    let moved = body.iter().zip(rest).map(|(x, r)| x.distance(*r + offset));
    if moved.fold(0.0, f32::max) < MIN_MOTION {
        return Err("does not move".into());
    }
    Ok(())
}

fn diagonal(points: &[Vec3]) -> f32 {
    let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    low.distance(high)
}

fn residual<'a>(scene: &Scene, bodies: impl Iterator<Item = &'a [Vec3]>) -> Residual {
    let (mut edges, mut volumes) = (Mean::default(), Mean::default());
    let rest = |i: u32| scene.shape.vertices[i as usize].as_dvec3();
    for body in bodies {
        let now = |i: u32| body[i as usize].as_dvec3();
        for &[a, b] in &scene.shape.edges {
            edges.add(now(a).distance(now(b)) / rest(a).distance(rest(b)) - 1.0);
        }
        for corners in &scene.shape.tetrahedra {
            volumes.add(volume(corners.map(now)) / volume(corners.map(rest)) - 1.0);
        }
    }
    Residual {
        edge_strain: edges.root(),
        volume_strain: volumes.root(),
    }
}

#[derive(Default)]
struct Mean {
    squares: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.squares += value * value;
        self.count += 1;
    }

    fn root(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

/// A mass hangs on one constraint, in a peer and in Pliant with the parameters that the formulas of
/// `docs/coming-from.md` give: both must move alike.
///
/// Both take implicit steps of the same length, each with one projection of the only constraint,
/// which solves it exactly. They differ by rounding, and where it is said.
#[cfg(all(test, any(jolt, bullet, feature = "rapier")))]
mod tests {
    use super::*;
    use crate::scenes::{GRAVITY, RATE};
    use pliant::solver::{
        Body, Compliance, Density, Effects, Iterations, Mass, Rate, RestShape, Stretch, Substeps,
        Threads, Topology, VertexIndex, World,
    };
    #[cfg(feature = "rapier")]
    use rapier3d::prelude::SoftBodyBuilder;
    use std::sync::Arc;

    /// The mass that hangs [kg].
    const MASS: f32 = 0.5;
    /// Ticks of 1/60 s.
    const TICKS: usize = 120;
    /// Tolerance relative to the largest extension: peers round positions to f32, as a random force
    /// of up to 0.3 % of the weight in a substep of 1/960 s.
    const ROUNDING: f64 = 0.02;

    /// An edge of this length [m] that hangs from vertex 0.
    fn link(length: f32) -> RestShape {
        RestShape {
            vertices: vec![Vec3::ZERO, Vec3::new(0.0, -length, 0.0)],
            edges: vec![[0, 1]],
            ..RestShape::default()
        }
    }

    /// The way of the last vertex downwards from its rest position [m] after each tick, in Pliant.
    /// The others are pinned.
    fn pliant(shape: &RestShape, effects: Effects, substeps: u32) -> Vec<f64> {
        let last = shape.vertices.len() as u32 - 1;
        let topology = Topology::new(shape.clone()).expect("a sound shape");
        let none = Density::new(1e-9).expect("in range");
        let mut body = Body::new("hanging", Arc::new(topology), none);
        body.pins = (0..last).map(VertexIndex).collect();
        let mass = Mass::new(MASS).expect("in range");
        body.added_mass.push((VertexIndex(last), mass));
        body.update_masses();
        body.effects = effects;
        let particle = body.topology.numbering.particle(VertexIndex(last)).index();
        let start = body.particles.position(particle).y;

        let mut world = World {
            threads: Threads::new(1).expect("one thread"),
            ..World::default()
        };
        world.sleep.enabled = false;
        let settings = &mut world.settings;
        settings.rate = Rate::new(f64::from(RATE)).expect("in range");
        settings.substeps = Substeps::new(substeps).expect("in range");
        settings.iterations = Iterations::new(1).expect("in range");
        settings.gravity = Vec3::new(0.0, GRAVITY, 0.0);
        world.bodies.push(body);
        let tick = |_| {
            world.tick();
            start - world.bodies[0].particles.position(particle).y
        };
        (0..TICKS).map(tick).collect()
    }

    /// Edges of this compliance [m/N].
    fn springs(compliance: f64) -> Effects {
        Effects {
            stretch: Some(Stretch {
                compliance: Compliance::new(compliance as f32).expect("in range"),
                ..Stretch::default()
            }),
            ..Effects::default()
        }
    }

    /// Fails unless both ways are equal within a tolerance relative to the largest extension.
    #[track_caller]
    fn assert_same(ours: &[f64], theirs: &[f64], tolerance: f64, what: &str) {
        assert_eq!(ours.len(), theirs.len(), "{what}");
        let largest = theirs.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(largest > 1e-4, "{what}: it moves by {largest} m");
        for (tick, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
            assert!(
                (ours - theirs).abs() <= tolerance * largest,
                "{what}, tick {tick}: {ours} m, in the peer {theirs} m"
            );
        }
    }

    /// As [`pliant`], in a peer that is written in C++.
    #[cfg(any(jolt, bullet))]
    fn native(
        peer: &'static crate::native::Functions,
        shape: &RestShape,
        edge_compliance: f32,
        volume_compliances: Option<&[f32]>,
        substeps: u32,
    ) -> Vec<f64> {
        let last = shape.vertices.len() - 1;
        let mut inverse_masses = vec![0.0; shape.vertices.len()];
        inverse_masses[last] = 1.0 / MASS;
        let bodies = crate::native::Bodies {
            shape,
            inverse_masses: &inverse_masses,
            offsets: &[Vec3::ZERO],
            edge_compliance,
            volume_compliances,
            substeps,
            threads: 1,
        };
        let mut world = peer.create("hanging", &bodies).expect("a sound scene");
        let tick = |_| {
            world.step();
            f64::from(shape.vertices[last].y - world.state().positions[last].y)
        };
        (0..TICKS).map(tick).collect()
    }

    /// `Edge::mCompliance` is `stretch.compliance`, and `mNumIterations` are substeps.
    #[cfg(jolt)]
    #[test]
    fn the_compliance_of_an_edge_in_jolt_is_the_same() {
        let alpha = 2e-3_f32;
        for substeps in [4, 16] {
            let theirs = native(&crate::native::JOLT, &link(0.1), alpha, None, substeps);
            let ours = pliant(&link(0.1), springs(alpha.into()), substeps);
            let what = format!("edge, {substeps} substeps");
            assert_same(&ours, &theirs, ROUNDING, &what);
        }
    }

    /// `Volume::mCompliance` is 36 times `volume.compliance`: `native/jolt.cpp` multiplies by that,
    /// as the constraint of Jolt is six times the volume.
    #[cfg(jolt)]
    #[test]
    fn the_compliance_of_a_volume_in_jolt_is_36_times_as_large() {
        use pliant::solver::Volume;

        // Vertex 3 sinks towards the pinned face 0, 1, 2. The edge has no effect: 1e-6 N/m.
        let (alpha, loose) = (2e-4_f32, 1e6_f32);
        let shape = RestShape {
            vertices: vec![Vec3::ZERO, Vec3::Z, Vec3::X, Vec3::Y],
            edges: vec![[0, 3]],
            tetrahedra: vec![[0, 1, 2, 3]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..RestShape::default()
        };
        let theirs = native(&crate::native::JOLT, &shape, loose, Some(&[alpha]), 16);
        let effects = Effects {
            volume: Some(Volume {
                compliance: Compliance::new(alpha).expect("in range"),
                ..Volume::default()
            }),
            ..Effects::default()
        };
        let ours = pliant(&shape, effects, 16);
        assert_same(&ours, &theirs, ROUNDING, "tetrahedron");
    }

    /// `m_kLST` k, which `native/bullet.cpp` sets to 2/(2 + [`SOFTNESS`](crate::scenes::SOFTNESS)),
    /// leaves 1 − k of an error after the only iteration of a step; XPBD leaves α̃/(w + α̃).
    ///
    /// Bullet projects the square of the length: to first order in the strain, which is below 0.3 %
    /// on an edge of 1 m.
    #[cfg(bullet)]
    #[test]
    fn a_link_of_bullet_is_a_compliance_of_one_step_length() {
        let k = f64::from(2.0 / (2.0 + crate::scenes::SOFTNESS));
        for substeps in [1, 2] {
            let theirs = native(&crate::native::BULLET, &link(1.0), 0.0, None, substeps);
            let h = 1.0 / (f64::from(RATE) * f64::from(substeps));
            let alpha = h * h * (1.0 - k) / k / f64::from(MASS);
            let ours = pliant(&link(1.0), springs(alpha), substeps);
            let what = format!("link, {substeps} substeps");
            assert_same(&ours, &theirs, ROUNDING, &what);
        }
    }

    /// As [`pliant`], for a mass on an edge of 0.1 m with this softness in Rapier, and 16 substeps.
    #[cfg(feature = "rapier")]
    fn rapier(
        frequency: f32,
        damping_ratio: f32,
        change: impl FnOnce(SoftBodyBuilder) -> SoftBodyBuilder,
    ) -> Vec<f64> {
        use rapier3d::prelude::{PhysicsWorld, Real, SoftBodySolver, SpringCoefficients, Vector};

        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, GRAVITY, 0.0);
        let parameters = &mut world.integration_parameters;
        parameters.dt = 1.0 / RATE;
        parameters.num_solver_iterations = 16;
        parameters.num_internal_pgs_iterations = 1;
        parameters.num_internal_stabilization_iterations = 0;
        parameters.soft_bodies.max_extra_substeps = 0;
        parameters.soft_bodies.resweep_strain = Real::MAX;
        let positions = vec![Vector::new(0.0, 0.0, 0.0), Vector::new(0.0, -0.1, 0.0)];
        let builder = SoftBodyBuilder::new(positions)
            .masses(vec![1.0, MASS])
            .pinned_particles([0])
            .edges(vec![[0, 1]])
            .softness(SpringCoefficients::new(frequency, damping_ratio))
            .solver(SoftBodySolver::Constraints)
            .additional_pgs_iterations(0)
            .can_sleep(false)
            .no_surface_collider();
        let body = world.insert_soft_body(change(builder));
        let tick = |_| {
            world.step();
            let body = world.soft_bodies.get(body).expect("it was inserted");
            let end = body.particle_positions().nth(1).expect("two particles");
            f64::from(-0.1 - end.y)
        };
        (0..TICKS).map(tick).collect()
    }

    /// The effects with the same edge: α = w/(2πf)² and τ = ζ/(πf).
    #[cfg(feature = "rapier")]
    fn softness(frequency: f32, damping_ratio: f32) -> Effects {
        use pliant::solver::Damping;
        use std::f64::consts::PI;

        let omega = 2.0 * PI * f64::from(frequency);
        let mut effects = springs(1.0 / (f64::from(MASS) * omega * omega));
        if let Some(stretch) = &mut effects.stretch {
            let tau = f64::from(damping_ratio) / (PI * f64::from(frequency));
            stretch.damping = Damping::new(tau as f32).expect("in range");
        }
        effects
    }

    /// `edge_softness`, `linear_damping` c, and `gravity_scale` s, which is an acceleration of
    /// 9.81 (1 − s) upwards. The order in which spring and damping act in a substep makes a
    /// difference of ch = 5e-4.
    #[cfg(feature = "rapier")]
    #[test]
    fn the_softness_of_an_edge_in_rapier_is_a_compliance_and_a_damping_time() {
        use pliant::solver::{Coefficient, Drag, Finite, Uniform};

        let (damping, scale) = (0.5_f32, 0.8_f32);
        for (frequency, ratio) in [(4.0, 0.1), (4.0, 1.0), (1.5, 0.0)] {
            let theirs = rapier(frequency, ratio, |builder| {
                builder.linear_damping(damping).gravity_scale(scale)
            });
            let effects = Effects {
                drag: Some(Drag {
                    linear: Coefficient::new(damping).expect("in range"),
                    quadratic: Coefficient::new(0.0).expect("in range"),
                }),
                uniform: Some(Uniform {
                    y: Finite::new((scale - 1.0) * GRAVITY).expect("in range"),
                    ..Uniform::default()
                }),
                ..softness(frequency, ratio)
            };
            let ours = pliant(&link(0.1), effects, 16);
            let what = format!("edge of {frequency} Hz and ζ = {ratio}");
            assert_same(&ours, &theirs, ROUNDING, &what);
        }
    }

    /// `edge_plastic_yield` y, `edge_plastic_creep` and `edge_plastic_max`, which this load reaches
    /// after 0.4 s.
    ///
    /// Strains are relative to the current length in Rapier, and to the original one here: rates of
    /// flow differ by y = 2 %, and by up to 1 % as the length grows by a twentieth. Rest lengths
    /// flow once in a step there, and in every substep here.
    #[cfg(feature = "rapier")]
    #[test]
    fn plastic_edges_of_rapier_flow_alike() {
        use pliant::solver::{Creep, PlasticLimit, Plasticity, Yield};

        const TOLERANCE: f64 = 0.05;
        let (yields, creep, most) = (0.02_f32, 1.0_f32, 0.05_f32);
        let theirs = rapier(4.0, 1.0, |mut builder| {
            builder.material.edge_plastic_yield = yields;
            builder.material.edge_plastic_creep = creep;
            builder.material.edge_plastic_max = most;
            builder
        });
        let effects = Effects {
            plasticity: Some(Plasticity {
                stretch_yield: Yield::new(yields).expect("in range"),
                creep: Creep::new(creep).expect("in range"),
                stretch_limit: PlasticLimit::new(most).expect("in range"),
                ..Plasticity::default()
            }),
            ..softness(4.0, 1.0)
        };
        let ours = pliant(&link(0.1), effects, 16);
        assert_same(&ours, &theirs, TOLERANCE, "plastic edge");
    }
}
