//! Stitches between bodies.

use crate::{
    support::{
        G, body, body_of_masses, chain, cube, damping, edge_strains, elastic_on_ground, point,
        random_vector, run, settings, stretch, volume, with, world,
    },
    support_app::{app_by_stages, app_of, cubes, deterministic, ticks},
};
use glam::{DVec3, Vec3};
use pliant::{
    scene::Scene,
    simulation::{
        Action, Actions, Asleep, BodyContacts, JustRestored, SoftBody, plain, state_hash,
    },
    solver::{
        Body, Compliance, Contact, Cut, Effects, Force, Order, ParticleIndex, Particles, Stitch,
        StitchEnd, Stitches, SurfacePoint, World, deform::Random, reference,
    },
};

fn at(terms: &[(u32, f32)]) -> SurfacePoint {
    let terms = terms
        .iter()
        .map(|&(particle, weight)| (ParticleIndex(particle), weight));
    SurfacePoint::new(&terms.collect::<Vec<_>>()).expect("a point")
}

/// Stitches points of a body to points of body `number`.
fn join(
    body: &mut Body,
    number: u32,
    points: &[[SurfacePoint; 2]],
    (compliance, strength): (f32, f32),
) {
    let stitches = points.iter().map(|&[point, other]| Stitch {
        point,
        to: StitchEnd::Body {
            number,
            point: other,
        },
        compliance: Compliance::new(compliance).expect("sound"),
        strength: Force::new(strength).expect("sound"),
        broken: false,
    });
    body.stitches = Stitches::new(stitches.collect(), body.particles.len()).expect("sound");
}

const UNBREAKABLE: (f32, f32) = (0.0, f32::INFINITY);

fn momentum(world: &World) -> DVec3 {
    let bodies = world.bodies.iter().map(|body| &body.particles);
    let of = |particles: &Particles| {
        let each = particles.positions.iter().enumerate();
        each.fold(DVec3::ZERO, |sum, (i, x)| {
            sum + particles.velocity_f64(i) / f64::from(x.w)
        })
    };
    bodies.map(of).sum()
}

/// Two bodies of two masses each at random velocities, joined at weighted points that meet.
fn pairs(random: &mut Random, order: u32) -> (World, [SurfacePoint; 2]) {
    let mut bodies = [[1.0, 2.0], [3.0, 5.0]].map(|masses| body_of_masses(chain(1, 1.0), &masses));
    for body in &mut bodies {
        for i in 0..2 {
            let v = random_vector(random, 1.0);
            body.particles.set_velocity(i, v);
        }
    }
    let ends = [at(&[(0, 0.3), (1, 0.7)]), at(&[(0, 1.0), (1, 1.0)])];
    let places = [0, 1].map(|i| ends[i].position(&bodies[i].particles.positions));
    bodies[1].translate(places[0] - places[1]);
    let [mut one, other] = bodies;
    join(&mut one, 1, &[ends], UNBREAKABLE);
    let mut settings = settings(0.0, 60.0, 10, 1);
    settings.order = Order::new(order).expect("sound");
    let mut world = world(settings, one);
    world.bodies.push(other);
    (world, ends)
}

/// As within a body: see `solver_stitches` for the bounds. Steps of second order become ones of
/// first order for joined bodies, as different lengths of a substep would not keep the momentum.
#[test]
fn points_of_two_bodies_meet_and_momentum_stays() {
    let mut random = Random::new(8);
    for round in 0..100 {
        let (mut world, ends) = pairs(&mut random, 1 + round % 2);
        let before = momentum(&world);
        run(&mut world, 0.1);
        let [a, b] = [0, 1].map(|i| ends[i].position(&world.bodies[i].particles.positions));
        assert!(a.distance(b) < 2e-6, "{} m apart", a.distance(b));
        let lost = (momentum(&world) - before).length();
        assert!(lost < 8.0 * 11.0 * 1.5e-4, "{lost} kg·m/s of {before}");
    }
}

/// A mass of 2 kg hangs from a pinned one by a stitch, which carries its weight.
fn hung(strength: f64) -> World {
    let mut top = body_of_masses(point(), &[1.0]);
    top.pins = vec![0.into()];
    top.update_masses();
    let mut mass = body_of_masses(point(), &[2.0]);
    let one = at(&[(0, 1.0)]);
    join(&mut mass, 0, &[[one, one]], (0.0, strength as f32));
    let mut world = world(settings(G, 60.0, 20, 1), top);
    world.bodies.push(mass);
    world
}

/// The weight is accurate to 1e-6, see `solver_stitches`.
#[test]
fn a_stitch_to_another_body_carries_and_breaks() {
    for (strength, breaks) in [(0.99 * 2.0 * G, true), (1.01 * 2.0 * G, false)] {
        let mut world = hung(strength);
        let mut reference = reference::World::of(&world);
        for _ in 0..30 {
            world.tick();
            reference.tick();
        }
        assert_eq!(world.bodies[1].stitches.broken() == 1, breaks);
        assert_eq!(reference.bodies[1].stitches().broken() == 1, breaks);
        let apart = reference.bodies[1].x[0].distance(world.bodies[1].particles.position(0));
        assert!(apart < 600.0_f64.powf(1.5) * 6e-8, "{apart} m apart");
    }
}

/// Three soft cubes in a row, joined face to face by breakable thread of some strength [N]; the
/// middle one owns all stitches. A fourth body of the same world is not joined.
fn row(contact: bool, strength: f32) -> World {
    let effects = Effects {
        stretch: stretch(1e-4),
        volume: volume(1e-9),
        contact: contact.then(Contact::default),
        ..elastic_on_ground()
    };
    let cubes = [-0.3, 0.0, 0.3, 2.0].map(|x| {
        let mut it = with(body("cube", cube(0.3, 3), 1000.0), effects);
        it.effects.stretch.as_mut().expect("it has one").damping = damping(0.02);
        it.translate(Vec3::new(x, 0.4, 0.0));
        it
    });
    let [left, mut middle, right, far] = cubes;
    let mut stitches = Vec::new();
    for (number, other) in [(0, &left), (2, &right)] {
        for (i, x) in (0..).zip(&middle.particles.positions) {
            for (j, y) in (0..).zip(&other.particles.positions) {
                if x.truncate().distance(y.truncate()) < 1e-4 {
                    stitches.push((number, [at(&[(i, 1.0)]), at(&[(j, 1.0)])]));
                }
            }
        }
    }
    assert_eq!(stitches.len(), 32);
    let mut all = Vec::new();
    for (count, (number, points)) in stitches.into_iter().enumerate() {
        let strength = [strength, f32::INFINITY][count % 2];
        join(&mut middle, number, &[points], (1e-5, strength));
        all.extend_from_slice(middle.stitches.all());
    }
    middle.stitches = Stitches::new(all, middle.particles.len()).expect("sound");
    let mut world = world(settings(G, 60.0, 10, 2), left);
    world.bodies.extend([middle, right, far]);
    world.bodies[0].set_velocity(Vec3::new(0.0, 1.5, 0.0));
    world
}

#[test]
fn threads_schedules_and_snapshots_change_no_bit_of_joined_bodies() {
    for contact in [false, true] {
        let (world, _) = deterministic(row(contact, 40.0), 60);
        let broken = world.bodies[1].stitches.broken();
        assert!(broken > 0 && broken < 32, "{broken} are broken");
    }
}

/// Without contact and without stitches a world has the same bits as one whose stitches are all
/// broken: joining is what steps bodies together, and nothing else.
#[test]
fn broken_stitches_join_nothing() {
    let mut broken = row(false, 1.0);
    let stitches = broken.bodies[1].stitches.all().iter();
    let stitches = stitches
        .map(|it| Stitch {
            broken: true,
            ..*it
        })
        .collect();
    let count = broken.bodies[1].particles.len();
    broken.bodies[1].stitches = Stitches::new(stitches, count).expect("sound");
    let mut without = broken.clone();
    without.bodies[1].stitches = Stitches::default();
    run(&mut broken, 0.5);
    run(&mut without, 0.5);
    assert_eq!(broken.state_hash(), without.state_hash());
}

/// Two cubes side by side, of which each corner of one face is stitched to the other, and a third
/// one that is not joined.
#[test]
fn joined_bodies_sleep_and_wake_together() {
    let mut world = cubes();
    let mut far = world.bodies[0].clone();
    far.translate(Vec3::X * 3.0);
    world.bodies.push(far);
    world.bodies[1].set_velocity(Vec3::ZERO);
    world.bodies[1].translate(Vec3::X * -1.6);
    let [one, other] = [0, 1].map(|i| world.bodies[i].particles.positions.clone());
    let pairs = (0..8).flat_map(|i| (0..8).map(move |j| [i, j]));
    let meet = |[i, j]: &[u32; 2]| {
        let [a, b] = [one[*i as usize], other[*j as usize]];
        a.truncate().distance(b.truncate()) < 1e-5
    };
    let points: Vec<_> = pairs
        .filter(meet)
        .map(|ends| ends.map(|i| at(&[(i, 1.0)])))
        .collect();
    assert_eq!(points.len(), 4);
    join(&mut world.bodies[0], 1, &points, (1e-5, f32::INFINITY));
    let (mut app, bodies, _) = app_of(&world);
    run(&mut world, 20.0);
    ticks(&mut app, 1200);
    let asleep = |world: &World| -> Vec<bool> { world.bodies.iter().map(|it| it.asleep).collect() };
    assert_eq!(asleep(&world), [true; 3]);
    let asleep_in_app = |app: &bevy::prelude::App| -> Vec<bool> {
        let of = |body: &bevy::prelude::Entity| app.world().entity(*body).contains::<Asleep>();
        bodies.iter().map(of).collect()
    };
    assert_eq!(asleep_in_app(&app), [true; 3]);
    world.bodies[1].set_velocity(Vec3::Y);
    let mut particles = app
        .world_mut()
        .get_mut::<Particles>(bodies[1])
        .expect("a body");
    for i in 0..particles.len() {
        particles.set_velocity(i, Vec3::Y);
    }
    for count in 1..=3 {
        world.tick();
        ticks(&mut app, 1);
        assert_eq!(asleep(&world), [false, false, true], "after {count} ticks");
        assert_eq!(asleep_in_app(&app), asleep(&world), "after {count} ticks");
        let captured = plain::capture(app.world_mut());
        assert_eq!(captured.state_hash(), world.state_hash());
    }
}

#[test]
fn removing_a_body_breaks_stitches_to_it_and_renumbers_the_others() {
    let world = row(false, f32::INFINITY);
    let (mut app, bodies, _) = app_of(&world);
    ticks(&mut app, 2);
    app.world_mut().despawn(bodies[0]);
    ticks(&mut app, 2);
    let stitches = app
        .world()
        .get::<Stitches>(bodies[1])
        .expect("it is stitched");
    for stitch in stitches.all() {
        let StitchEnd::Body { number, .. } = stitch.to else {
            panic!("a stitch to a body");
        };
        assert!(stitch.broken || number == 1, "body 2 is number 1 now");
    }
    assert_eq!(stitches.broken(), 16);
    // Another mesh in the place of the other body.
    let finer = body("finer", cube(0.2, 1), 1000.0).topology;
    app.world_mut()
        .entity_mut(bodies[2])
        .insert(SoftBody(finer));
    ticks(&mut app, 2);
    let stitches = app
        .world()
        .get::<Stitches>(bodies[1])
        .expect("it is stitched");
    assert_eq!(stitches.broken(), 32);
}

/// Stitches that broke refer to nothing: the number of their body may be that of another one, which
/// has fewer particles and tears.
#[test]
fn stitches_that_are_broken_are_not_moved_with_another_body() {
    let mut rope = body("rope", chain(20, 2.0), 0.1);
    rope.effects.stretch = stretch(0.0);
    let mut short = body("short", chain(4, 0.4), 0.1);
    short.translate(Vec3::Y);
    let links = [2, 3].map(|vertex| {
        short
            .particles
            .position(short.topology.particle(vertex.into()))
    });
    let between = (links[0] + links[1]).as_vec3() / 2.0;
    let mut weight = body_of_masses(point(), &[0.1]);
    join(
        &mut weight,
        0,
        &[[at(&[(0, 1.0)]), at(&[(20, 1.0)])]],
        UNBREAKABLE,
    );
    let mut world = world(settings(0.0, 60.0, 10, 1), rope);
    world.bodies.extend([short, weight]);
    let cut = Cut {
        eye: between + Vec3::Z,
        rays: [Vec3::new(1.0, 0.0, -1.0), Vec3::new(-1.0, 0.0, -1.0)],
    };
    let (mut app, bodies, _) = app_of(&world);
    app.world_mut().despawn(bodies[0]);
    let mut actions = app.world_mut().resource_mut::<Actions>();
    actions.push(Action::Cut {
        body: bodies[1],
        cut,
    });
    Actions::apply(app.world_mut());
    ticks(&mut app, 2);
    assert!(plain::capture(app.world_mut()).bodies[0].particles.len() > 5);
    // The same without Bevy.
    world.remove(0);
    assert!(world.cut(0, &cut));
    assert_eq!(world.bodies[1].stitches.broken(), 1);
    world.tick();
}

/// A sleeping weight is stitched to a sleeping hook, or the hook to it; without the hook it falls.
#[test]
fn what_hung_from_a_removed_body_wakes() {
    for owner in [0, 1] {
        let mut world = cubes();
        world.bodies[1].set_velocity(Vec3::ZERO);
        world.bodies[1].translate(Vec3::new(-2.0, 1.0, 0.0));
        world.bodies[1].effects.ground = None;
        let one = at(&[(0, 1.0)]);
        join(
            &mut world.bodies[owner],
            1 - owner as u32,
            &[[one, one]],
            UNBREAKABLE,
        );
        for body in &mut world.bodies {
            body.fall_asleep();
        }
        let (mut app, bodies, _) = app_of(&world);
        for body in &bodies {
            app.world_mut().entity_mut(*body).insert(JustRestored);
        }
        ticks(&mut app, 5);
        let is_asleep =
            |app: &bevy::prelude::App| app.world().entity(bodies[1]).contains::<Asleep>();
        assert!(is_asleep(&app), "owner {owner}: it sleeps");
        app.world_mut().despawn(bodies[0]);
        ticks(&mut app, 2);
        assert!(!is_asleep(&app), "owner {owner}: it falls in Bevy");
        world.remove(0);
        assert!(!world.bodies[0].asleep, "owner {owner}: it falls");
    }
}

/// The rope has no contact, the cubes have; the stitch breaks in the middle of a tick, and the group
/// stays what it was.
#[test]
fn a_stitch_that_breaks_leaves_the_contacts_of_others_alone() {
    let mut world = row(true, f32::INFINITY);
    world.bodies.truncate(3);
    world.bodies[1].stitches = Stitches::default();
    for (i, body) in world.bodies.iter_mut().enumerate() {
        body.translate(
            Vec3::new(0.0, 0.302 * i as f32, 0.0) - body.particles.position(0).as_vec3(),
        );
    }
    let mut rope = body("rope", chain(3, 0.3), 0.1);
    rope.effects.stretch = stretch(1e-6);
    let place = world.bodies[0].particles.position(0).as_vec3();
    let end = rope.particles.position(0).as_vec3();
    rope.translate(place - end);
    // Its weight is 0.29 N; it breaks while it swings down.
    join(
        &mut rope,
        1,
        &[[at(&[(0, 1.0)]), at(&[(0, 1.0)])]],
        (0.0, 0.1),
    );
    world.bodies.insert(0, rope);
    let (world, contacts) = deterministic(world, 40);
    assert_eq!(world.bodies[0].stitches.broken(), 1);
    assert!(contacts > 0, "the cubes touch");
}

/// A cut through the other body renumbers its particles: the stitch stays where it was.
#[test]
fn stitches_follow_a_body_that_is_cut() {
    let mut rope = body("rope", chain(20, 2.0), 0.1);
    rope.effects.stretch = stretch(0.0);
    let mut weight = body_of_masses(point(), &[0.1]);
    let end = rope.topology.particle(20.into()) as u32;
    let place = rope.particles.position(end as usize).as_vec3();
    weight.translate(place - weight.particles.position(0).as_vec3());
    join(
        &mut weight,
        0,
        &[[at(&[(0, 1.0)]), at(&[(end, 1.0)])]],
        UNBREAKABLE,
    );
    let middle = rope.particles.position(rope.topology.particle(10.into()));
    let mut world = world(settings(0.0, 60.0, 10, 1), rope);
    world.bodies.push(weight);
    let (mut app, bodies, _) = app_of(&world);
    ticks(&mut app, 1);
    let side = DVec3::new(0.7, 0.4, 1.0);
    let cut = Cut {
        eye: (middle + DVec3::Z - DVec3::X * 0.013).as_vec3(),
        rays: [
            (DVec3::NEG_Z + side * 0.4).as_vec3(),
            (DVec3::NEG_Z - side * 0.4).as_vec3(),
        ],
    };
    let before = app
        .world()
        .get::<SoftBody>(bodies[0])
        .expect("a body")
        .particles();
    let mut actions = app.world_mut().resource_mut::<Actions>();
    actions.push(Action::Cut {
        body: bodies[0],
        cut,
    });
    Actions::apply(app.world_mut());
    let after = app
        .world()
        .get::<SoftBody>(bodies[0])
        .expect("a body")
        .particles();
    assert!(after > before, "the cut hits the rope");
    let stitches = app
        .world()
        .get::<Stitches>(bodies[1])
        .expect("it is stitched");
    let StitchEnd::Body { point, .. } = stitches.all()[0].to else {
        panic!("a stitch to a body");
    };
    let particles = app.world().get::<Particles>(bodies[0]).expect("a body");
    let there = point.position(&particles.positions);
    assert!(there.distance(place) < 1e-5, "{there} instead of {place}");
}

/// A rope whose first two vertices are stitched into a jelly: although both have contact, and the
/// rope crosses the surface, nothing pushes it out.
#[test]
fn what_is_stitched_into_a_body_is_no_contact() {
    let scene: Scene = "Scene(title: \"\", look_at: \"\", world: (substeps: 20), bodies: [
            (name: \"jelly\", primitive: Box(size: (0.3, 0.3, 0.3), cells: (4, 4, 4)), position: (0, 0.15, 0),
             effects: (stretch: (compliance: 1e-5, damping: 0.02), volume: (), contact: (thickness: 0.01), ground: ())),
            (name: \"rope\", primitive: Rope(length: 0.5, segments: 10), density: 0.2, position: (0.03, 0.52, 0.02), rotation: (0, 0, 90),
             effects: (stretch: (damping: 0.02), contact: (thickness: 0.01)),
             stitches: [(point: Vertex(0), to: Body(\"jelly\"))]),
        ], acceptance: (seconds: 1))"
        .parse()
        .expect("it is read");
    let mut world = scene.build().expect("it is built").world;
    let stitch = world.bodies[1].stitches.all()[0];
    let StitchEnd::Body { number: 0, point } = stitch.to else {
        panic!("a stitch to the jelly");
    };
    let gap = |world: &World| {
        let ends = [
            point.position(&world.bodies[0].particles.positions),
            stitch.point.position(&world.bodies[1].particles.positions),
        ];
        ends[0].distance(ends[1])
    };
    // Positions within 1 m are rounded by 6e-8 m, those of an anchor by its weights as well.
    assert!(gap(&world) < 1e-6, "{} m at the start", gap(&world));
    for _ in 0..120 {
        world.tick();
        assert_eq!(world.crossings(), 0);
    }
    // One iteration per substep leaves the constraints of the rope behind the stitch by what its
    // weight of 1 N moves its first particle of 10 g in a substep: g·100 g/10 g h² = 7e-5 m.
    assert!(gap(&world) < 1e-4, "{} m apart", gap(&world));
}

#[test]
fn stitches_to_bodies_say_what_is_wrong() {
    let text = |to: &str| {
        format!(
            "Scene(title: \"\", look_at: \"\", bodies: [\
             (name: \"head\", primitive: Box(size: (0.2, 0.2, 0.2), cells: (2, 2, 2)), effects: ()), \
             (name: \"rope\", primitive: Rope(length: 1), position: (0, 3, 0), effects: (), \
             stitches: [(point: Vertex(0), to: {to})])], acceptance: (seconds: 1))"
        )
    };
    for (to, reason) in [
        (
            "Body(\"haed\")",
            "stitch 1: unknown body “haed” (did you mean “head”?)",
        ),
        ("Body(\"rope\")", "cannot be stitched to itself"),
        ("Body(\"head\")", "m from “head”, but may be at most"),
        (
            "BodyPoint(\"head\", Vertex(27))",
            "vertex 27, which “head” does not have; it has 27",
        ),
        (
            "BodyPoint(\"head\", Roots(1))",
            "Roots, Within and Group are stitched to",
        ),
    ] {
        let scene: Scene = text(to).parse().expect("it is read");
        let error = scene.build().expect_err(to).to_string();
        assert!(error.contains(reason), "{to}: {error}");
    }
    let scene: Scene = text("BodyPoint(\"head\", Vertex(26))")
        .parse()
        .expect("it is read");
    let built = scene.build().expect("it is built");
    let stitch = built.world.bodies[1].stitches.all()[0];
    assert!(matches!(stitch.to, StitchEnd::Body { number: 0, .. }));
}

/// Strands of 13 segments on a soft head that lands, in wind. A rod is solved after its stitches and
/// moves its root by what hangs on it: n a h² for an acceleration a.
#[test]
fn roots_stay_in_a_soft_head_and_segments_beside_them_keep_their_length() {
    let scene = Scene::load("soft_head").expect("it is read").scene;
    let mut world = scene.build().expect("it is built").world;
    let (mut farthest, mut longest) = (0.0_f32, 0.0_f64);
    for _ in 0..60 {
        world.tick();
        let [head, hair] = &world.bodies[..] else {
            panic!("two bodies");
        };
        let [on_head, on_hair] = [head, hair].map(|it| &it.particles.positions);
        for (point, _, other) in hair.stitches.intact_joints() {
            let gap = point.position(on_hair).distance(other.position(on_head));
            farthest = farthest.max(gap);
        }
        let ends = hair.topology.edges.ends();
        for (strain, ends) in edge_strains(hair).zip(ends) {
            let place = ends.map(|i| hair.topology.vertex(i as usize).0 % 14);
            if place.into_iter().min() < Some(3) {
                longest = longest.max(strain.abs());
            }
        }
    }
    // 13 segments at 30 g, with which the head hits the ground, at h = 1/1200 s: 2.7 mm.
    assert!(farthest < 2.7e-3, "a root is {farthest} m from its place");
    // EA = 212 N, against 4e-3 N of strand per g: 30 g are a strain of 6e-4, and as much again for
    // what a contact after the rods moves, half of 0.1 mm on 33 mm.
    assert!(
        longest < 2.1e-3,
        "a segment near a root is strained by {longest}"
    );
}

/// A body that is stepped stage by stage leaves those alone that stitches join and that touch: the same
/// bits and the same contacts as without it.
#[test]
fn a_body_that_is_stepped_by_itself_leaves_joined_and_touching_bodies_alone() {
    let mut world = pairs(&mut Random::new(3), 1).0;
    world.settings.gravity = Vec3::NEG_Y * G as f32;
    for mut cube in cubes().bodies {
        cube.effects.contact = Some(Contact::default());
        cube.set_velocity(Vec3::ZERO);
        world.bodies.push(cube);
    }
    // One upon the other.
    let upper = world.bodies.len() - 1;
    world.bodies[upper].translate(Vec3::new(-2.0, 0.42, 0.0));
    let mut alone = body("alone", cube(0.4, 1), 1000.0);
    alone.effects.stretch = stretch(1e-6);
    alone.translate(Vec3::X * 20.0);
    world.bodies.push(alone);
    let [mut whole, mut partly] = [false, true].map(|is_staged| {
        let chosen = |bodies: &[bevy::prelude::Entity]| is_staged.then_some(bodies[upper + 1]);
        app_by_stages(&world, chosen).0
    });
    let mut touched = 0;
    for tick in 1..=60 {
        let [a, b] = [&mut whole, &mut partly].map(|app| {
            ticks(app, 1);
            let contacts = app.world().resource::<BodyContacts>();
            let pairs: Vec<_> = contacts.pairs().map(|pair| pair.force).collect();
            let all = (pairs, contacts.counts().near);
            (state_hash(app.world_mut()), all)
        });
        touched += a.1.0.len();
        assert_eq!(a, b, "tick {tick}");
    }
    assert!(touched > 0, "the cubes never touch");
}
