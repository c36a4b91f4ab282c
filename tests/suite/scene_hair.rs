//! Scenes with hair: strands do not pass through each other, hair that has lost its stiffness or its
//! curls is noticed, and in a closed box momentum is balanced.

use glam::DVec3;
use pliant::{
    scene::{Scene, run::run},
    solver::{
        Body, Curl, Rate, RigidSurface, Rod, SectionStiffness, Settings, Substeps, World,
        YoungsModulus, measure,
    },
};

fn scene(name: &str) -> Scene {
    Scene::load(name).expect("a sound scene").scene
}

fn world(name: &str) -> World {
    scene(name).build().expect("a sound scene").world
}

/// A straight motion of both ends of a segment.
struct Motion {
    strand: u32,
    from: [DVec3; 2],
    to: [DVec3; 2],
    low: DVec3,
    high: DVec3,
}

impl Motion {
    fn new(strand: u32, from: [DVec3; 2], to: [DVec3; 2]) -> Self {
        let all = [from[0], from[1], to[0], to[1]];
        Self {
            strand,
            from,
            to,
            low: all.into_iter().fold(DVec3::INFINITY, DVec3::min),
            high: all.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max),
        }
    }

    fn at(&self, t: f64) -> [DVec3; 2] {
        [0, 1].map(|end| self.from[end].lerp(self.to[end], t))
    }
}

/// Six times the volume of the tetrahedron of two segments: 0 where they are in one plane.
fn volume([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> f64 {
    (b - a).cross(d - c).dot(c - a)
}

/// Whether two segments in one plane cross.
fn crosses([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> bool {
    let (u, v, r) = (b - a, d - c, c - a);
    let normal = u.cross(v);
    let [s, t] = [v, u].map(|other| r.cross(other).dot(normal) / normal.length_squared());
    (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)
}

/// Whether one segment passes through another one: an odd number of crossings on straight paths. The
/// volume is a cubic of time, whose changes of sign are searched for in 16 intervals.
fn passes(one: &Motion, other: &Motion) -> bool {
    let value = |t| volume(one.at(t), other.at(t));
    let mut count = 0;
    for i in 0..16 {
        let (mut low, mut high) = (f64::from(i) / 16.0, f64::from(i + 1) / 16.0);
        if value(low) * value(high) >= 0.0 {
            continue;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            match value(low) * value(middle) < 0.0 {
                true => high = middle,
                false => low = middle,
            }
        }
        count += usize::from(crosses(one.at(low), other.at(low)));
    }
    count % 2 == 1
}

/// How often segments of different strands passed through each other in a substep.
fn passages(before: &[DVec3], body: &Body, nodes: u32) -> usize {
    let strand = |particle: u32| body.topology.vertex(particle as usize).0 / nodes;
    let mut all: Vec<Motion> = (body.topology.edges.ends())
        .map(|ends| {
            let to = ends.map(|i| body.particles.position(i as usize));
            Motion::new(strand(ends[0]), ends.map(|i| before[i as usize]), to)
        })
        .collect();
    all.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
    let mut count = 0;
    for (i, one) in all.iter().enumerate() {
        let others = all[i + 1..].iter();
        let near = others.take_while(|other| other.low.x <= one.high.x);
        let near = near.filter(|other| {
            other.strand != one.strand
                && other.low.cmple(one.high).all()
                && one.low.cmple(other.high).all()
        });
        count += near.filter(|other| passes(one, other)).count();
    }
    count
}

/// The 150 strands of the scene `hair` in its violent first swing. A tick is a substep, in which every
/// particle moves on a straight line.
fn passages_of_a_swing(with_contact: bool) -> usize {
    let mut world = world("hair");
    let Settings { rate, substeps, .. } = world.settings;
    let each = f64::from(rate) * f64::from(substeps.get());
    world.settings.rate = Rate::new(each).expect("in range");
    world.settings.substeps = Substeps::new(1).expect("in range");
    if !with_contact {
        world.bodies[0].effects.self_contact = None;
    }
    let mut count = 0;
    for _ in 0..each as usize / 2 {
        let body = &world.bodies[0];
        let before: Vec<DVec3> = (0..body.particles.len())
            .map(|i| body.particles.position(i))
            .collect();
        world.tick();
        count += passages(&before, &world.bodies[0], 17);
    }
    count
}

#[test]
fn strands_of_hair_do_not_pass_through_each_other() {
    assert_eq!(passages_of_a_swing(true), 0);
    let without = passages_of_a_swing(false);
    assert!(without > 100, "only {without} without self-contact");
}

/// Why a scene is not accepted with another rod; empty if it is.
fn reasons(name: &str, change: impl Fn(&mut Rod)) -> String {
    let scene = scene(name);
    let mut built = scene.build().expect("a sound scene");
    let rods = built.world.bodies.iter_mut();
    rods.filter_map(|body| body.effects.rod.as_mut())
        .for_each(change);
    let done = run(&built, &scene.run_options(), |_| ()).expect("nothing is overridden");
    done.reasons.join("; ")
}

#[test]
fn limp_hair_is_not_accepted() {
    for name in ["hair", "curls", "fur"] {
        let limp = reasons(name, |rod| {
            rod.bending_stiffness = SectionStiffness::of(1e-14);
            rod.twisting_stiffness = SectionStiffness::of(1e-14);
        });
        assert!(limp.contains("shape error"), "{name}: {limp}");
    }
    let soft = reasons("curls", |rod| {
        let modulus = rod.youngs_modulus.get() / 100.0;
        rod.youngs_modulus = YoungsModulus::of(modulus);
    });
    assert!(soft.contains("shape error"), "{soft}");
}

#[test]
fn curls_that_are_lost_are_noticed() {
    let straight = reasons("curls", |rod| rod.curl = Curl::of(0.0));
    assert!(straight.contains("shape error"), "{straight}");
}

/// In every tick Δp = (ΣF + mg) T, with the forces of the ground and of the colliders, for all bodies
/// together: contacts between them, stitches, pressure and the rigid body keep the momentum. Of the
/// impulse that was exchanged, less than 1e-5 is lost in a second.
#[test]
fn momentum_is_balanced_in_a_closed_box_and_nothing_crosses() {
    let mut world = world("all_together");
    assert_eq!(world.bodies.len(), 9);
    world.sleep.enabled = false;
    for body in &mut world.bodies {
        body.states.records_contacts = true;
    }
    let momentum = |world: &World| -> DVec3 {
        let bodies = world.bodies.iter();
        bodies.map(|it| measure::momentum(&it.particles)).sum()
    };
    let particles = world.bodies.iter().flat_map(|it| &it.particles.positions);
    let mass: f64 = particles.map(|x| 1.0 / f64::from(x.w)).sum();
    let weight = mass * world.settings.gravity.as_dvec3();
    let seconds = 1.0 / f64::from(world.settings.rate);
    let (mut exchanged, mut lost) = (0.0, DVec3::ZERO);
    let (mut touched, mut met) = ([false; 6], [false; 9]);
    for tick in 0..60 {
        let before = momentum(&world);
        world.tick();
        assert_eq!(world.crossings(), 0, "after {tick} ticks");
        let mut force = weight;
        for body in &world.bodies {
            for it in body.states.surface_forces() {
                force += it.force;
                exchanged += it.force.length() * seconds;
                touched[match it.surface {
                    RigidSurface::Ground => 0,
                    RigidSurface::Collider(number) => number as usize + 1,
                }] = true;
            }
        }
        exchanged += weight.length() * seconds;
        lost += momentum(&world) - before - force * seconds;
        for body in world.contacts().touching().as_flattened() {
            met[*body as usize] = true;
        }
    }
    assert_eq!(met, [true; 9], "who has touched another");
    assert_eq!(touched[..5], [true; 5], "the ground and the walls");
    assert!(world.bodies.iter().all(|body| body.quarantine.is_none()));
    let fraction = lost.length() / exchanged;
    assert!(fraction < 1e-5, "{fraction} of the impulse is lost: {lost}");
}
