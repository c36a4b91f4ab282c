//! Rods whose rest shape is not that of the mesh: closed forms of rings and helices.

use crate::support::{assert_follows, body, damping, pinned, settings, world as world_of};
use glam::{DQuat, DVec3, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, ContactThickness, Curl, Density, Friction, Mass, RestShape, Rod, RodLink, RodRadius,
        SectionStiffness, SelfContact, Settings, Twist, VertexIndex, World, YoungsModulus,
        reference,
    },
};
use std::f64::consts::{PI, TAU};

/// EI [N·m²] of the rods.
const BENDING: f64 = 0.5;

/// A rod with EI and GJ, which hardly stretches.
fn rod(twisting: f64, curl: f64, twist: f64) -> Rod {
    let number = |value: f64| value as f32;
    Rod {
        youngs_modulus: YoungsModulus::of(1e9),
        radius: RodRadius::of(0.01),
        bending_stiffness: SectionStiffness::new(number(BENDING)).expect("sound"),
        twisting_stiffness: SectionStiffness::new(number(twisting)).expect("sound"),
        curl: Curl::new(number(curl)).expect("sound"),
        twist: Twist::new(number(twist)).expect("sound"),
        damping: damping(0.01),
        ..Rod::default()
    }
}

fn made(shape: RestShape, rod: Rod) -> Body {
    let mut body = body("rod", shape, 0.3);
    body.effects.rod = Some(rod);
    body
}

fn world(body: Body, substeps: u32, gravity: f32) -> World {
    let settings = Settings {
        gravity: Vec3::Y * gravity,
        ..settings(0.0, 60.0, substeps, 1)
    };
    world_of(settings, body)
}

fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * 60.0).round() as u32 {
        world.tick();
        assert!(world.bodies[0].quarantine.is_none());
    }
}

/// Positions in the order of the vertices [m].
fn places(body: &Body) -> Vec<DVec3> {
    let vertices = 0..body.topology.particles() as u32;
    vertices
        .map(|i| {
            let particle = body.topology.numbering.particle(VertexIndex(i));
            body.particles.position(particle.index())
        })
        .collect()
}

/// A polyline through these points [m].
fn line(points: impl IntoIterator<Item = DVec3>) -> RestShape {
    let vertices: Vec<Vec3> = points.into_iter().map(|it| it.as_vec3()).collect();
    RestShape {
        edges: (1..vertices.len() as u32).map(|i| [i - 1, i]).collect(),
        vertices,
        ..RestShape::default()
    }
}

/// A part of a circle of length 1 m that turns by an angle [rad].
fn arc(angle: f64, segments: u32) -> RestShape {
    let radius = 1.0 / angle;
    line((0..=segments).map(|i| {
        let (sin, cos) = (angle * f64::from(i) / f64::from(segments)).sin_cos();
        DVec3::new(radius * sin, radius * (1.0 - cos), 0.0)
    }))
}

const RING: f32 = 0.5;

/// A ring without curvature at rest, twisted by an angle [rad]; vertices are moved out of its plane
/// by a thousandth of its radius in the mode of instability, two waves around it.
fn ring(segments: u32, twisting: f64, twist: f64) -> Body {
    let hoop = Primitive::Hoop {
        radius: RING,
        segments,
    };
    let shape = hoop.build().expect("sound").shape;
    let length = 2.0 * f64::from(segments) * f64::from(RING) * (PI / f64::from(segments)).sin();
    let mut body = made(shape, rod(twisting, 0.0, twist / length));
    for vertex in 0..segments {
        let angle = TAU * f64::from(vertex) / f64::from(segments);
        let particle = body.topology.numbering.particle(VertexIndex(vertex));
        let place = body.particles.position(particle.index());
        let by = DVec3::Z * 1e-3 * f64::from(RING) * (2.0 * angle).cos();
        body.particles.set_position(particle.index(), place + by);
    }
    body
}

/// Michell (1889): a ring of a straight rod leaves its plane at a twist of 2π√3 EI/GJ. Of a ring of
/// N segments with C_b, the factor √3 is that of the second variation of its energy: at C/B = 1/3, 1
/// and 3, N = 24: 1.9622, 1.7050, 1.7135, and N = 48: 1.8115, 1.7257, 1.7275.
#[test]
fn a_twisted_ring_leaves_its_plane_at_the_twist_of_michell() {
    let cases = [
        (24, 1.0 / 3.0, 1.9622),
        (24, 1.0, 1.7050),
        (24, 3.0, 1.7135),
        (48, 1.0 / 3.0, 1.8115),
        (48, 1.0, 1.7257),
        (48, 3.0, 1.7275),
    ];
    for (segments, ratio, factor) in cases {
        let rises = |fraction: f64| {
            let twist = fraction * TAU * factor / ratio;
            let mut world = world(ring(segments, ratio * BENDING, twist), 2, 0.0);
            let mut most: f64 = 0.0;
            // Later it may have passed through itself and lie flat again.
            for _ in 0..40 {
                run(&mut world, 1.0);
                let places = places(&world.bodies[0]);
                let center = places.iter().sum::<DVec3>() / places.len() as f64;
                // A ring in its plane may turn as a whole.
                let off = |place: &DVec3| (place.distance(center) - f64::from(RING)).abs();
                most = places.iter().map(off).fold(most, f64::max);
            }
            most
        };
        let (below, above) = (rises(0.99), rises(1.01));
        assert!(
            below < 5e-4 && above > 5e-3,
            "{segments} segments, C/B = {ratio}: {below} m at 99 %, {above} m at 101 %"
        );
    }
}

fn distance(a: [DVec3; 2], b: [DVec3; 2]) -> f64 {
    // Fine enough for rods whose segments are shorter than a few radii.
    let along = |[p, q]: [DVec3; 2], t: u32| p.lerp(q, f64::from(t) / 16.0);
    let pairs = (0..=16).flat_map(|s| (0..=16).map(move |t| (s, t)));
    pairs
        .map(|(s, t)| along(a, s).distance(along(b, t)))
        .fold(f64::INFINITY, f64::min)
}

/// A ring that winds up into a plectoneme within 5 s: its link Tw + Wr stays 0, as no strand passes
/// through another, and strands keep the distance of their diameters.
#[test]
fn a_ring_winds_up_without_passing_through_itself() {
    let (segments, radius) = (64, 0.014_f32);
    let mut start = ring(segments, BENDING, 0.0);
    start.effects.self_contact = Some(SelfContact {
        thickness: ContactThickness::of(2.0 * radius),
        friction: Friction::of(0.1),
        ..SelfContact::default()
    });
    let mut world = world(start, 40, 0.0);
    let length = TAU * f64::from(RING);
    let mut most: f64 = 0.0;
    for tick in 1..=420_u32 {
        let turns = 9.0 * (f64::from(tick) / 300.0).min(1.0);
        let rod = world.bodies[0].effects.rod.as_mut().expect("a rod");
        rod.twist = Twist::new((turns * TAU / length) as f32).expect("sound");
        world.tick();
        if tick % 10 != 0 {
            continue;
        }
        let body = &world.bodies[0];
        let points = places(body);
        let all: Vec<DVec3> = (0..points.len())
            .map(|i| body.particles.position(i))
            .collect();
        let link = RodLink::of(&body.topology, &all, &body.particles.segments).expect("a ring");
        let (wound, link) = (link.writhe, link.total());
        // Both sums are exact for polygons, up to the rounding of positions.
        assert!(link.abs() < 1e-3, "link {link} after {tick} ticks");
        most = most.max(wound.abs());
        let count = points.len();
        let edge = |i: usize| [points[i], points[(i + 1) % count]];
        for j in 0..count {
            // Edges up to two apart are less than four diameters apart along the rod.
            for i in (0..j).filter(|i| (j - i).min(count - (j - i)) > 2) {
                let gap = distance(edge(i), edge(j));
                // Rods are solved after contacts, with one iteration: 0.2 % were measured.
                let least = 2.0 * f64::from(radius) * 0.99;
                assert!(
                    gap > least,
                    "{gap} m between {i} and {j} after {tick} ticks"
                );
            }
        }
    }
    assert!(most > 4.0, "wound by {most} turns");
}

/// A loaded helix: δ = F ∫ (|m⊥|²/EI + m∥²/GJ) ds with the arm m = (r − r(s)) × e (Castigliano),
/// for a load on its axis nearly 2πnR³F/GJ.
#[test]
fn a_helix_is_a_spring_of_its_twist() {
    let (turns, per_turn, radius, height) = (5, 48, 0.1, 0.1);
    let twisting = BENDING / 1.3;
    let count = turns * per_turn;
    let mut points: Vec<DVec3> = (0..=count)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(per_turn)).sin_cos();
            let down = height * f64::from(i) / f64::from(count);
            DVec3::new(radius * cos, -down, radius * sin)
        })
        .collect();
    // To the axis, where the load hangs.
    let end = points[count as usize];
    points.extend((1..=8).map(|k| end - DVec3::X * (radius * f64::from(k) / 8.0)));
    let tip = points[points.len() - 1];
    let mut flexibility = 0.0;
    let fine = 64;
    for (number, pair) in points.windows(2).enumerate() {
        let along = (pair[1] - pair[0]).normalize();
        for k in 0..fine {
            let t = (f64::from(k) + 0.5) / f64::from(fine);
            // The first segment is clamped; the rod begins in its middle.
            if number == 0 && t < 0.5 {
                continue;
            }
            let moment = (tip - pair[0].lerp(pair[1], t)).cross(DVec3::Y);
            let twisted = moment.dot(along);
            let bent = moment.length_squared() - twisted * twisted;
            let ds = pair[0].distance(pair[1]) / f64::from(fine);
            flexibility += (bent / BENDING + twisted * twisted / twisting) * ds;
        }
    }
    let wire = TAU * f64::from(turns) * radius.powi(3) / twisting;
    // The arm and the pitch.
    assert!(
        (flexibility / wire - 1.0).abs() < 0.06,
        "{flexibility} {wire}"
    );
    // A hundredth of the radius.
    let force = 0.01 * radius / flexibility;
    let load = |mass: f64| {
        let mut body = pinned(made(line(points.clone()), rod(twisting, 1.0, 0.0)), &[0, 1]);
        body.density = Density::new(1e-4 * mass as f32).expect("sound");
        let last = VertexIndex(points.len() as u32 - 1);
        body.added_mass
            .push((last, Mass::new(mass as f32).expect("sound")));
        body.update_masses();
        let mut world = world(body, 10, -9.81);
        run(&mut world, 20.0);
        tip.y - places(&world.bodies[0])[points.len() - 1].y
    };
    let found = load(force / 9.81) / (force * flexibility);
    // Joints bend at angles of 7.5°: the rule of the middle errs by its square over 24, 0.07 %, and
    // joints lose sin²(θ₀/2) = 0.4 % of their stiffness. The load moves by 1 % of its arm.
    assert!((found - 1.0).abs() < 0.01, "{found}");
}

/// Without gravity, an arc of 90° becomes straight, an arc of 180°, or with a twist τ a helix of
/// curvature κ: over its length it advances by τ/ω and turns by ω = √(κ² + τ²).
#[test]
fn curl_and_twist_shape_a_rod_at_rest() {
    let kappa = PI / 2.0;
    for (curl, twist) in [(0.0, 0.0), (2.0, 0.0), (1.0, 3.0), (0.5, -2.0)] {
        let body = made(arc(kappa, 64), rod(BENDING, curl, twist));
        let mut world = world(body, 4, 0.0);
        run(&mut world, 10.0);
        let points = places(&world.bodies[0]);
        let ends = points[0].distance(points[64]);
        let omega = (curl * kappa).hypot(twist);
        let expected = if omega == 0.0 {
            1.0
        } else {
            let radius = curl * kappa / (omega * omega);
            (2.0 * radius * (omega / 2.0).sin()).hypot(twist / omega)
        };
        // Half a segment at either end is not bent, and chords are shorter: (ωl)²/24 and its like.
        assert!(
            (ends - expected).abs() < 2e-3,
            "curl {curl}, twist {twist}: ends {ends} m apart for {expected}"
        );
        // Its handedness and shape, by the triple product of three chords.
        let triple = |at: &dyn Fn(usize) -> DVec3| {
            let chord = |k: usize| at(k + 16) - at(k);
            chord(0).cross(chord(16)).dot(chord(32))
        };
        let exact = |k: usize| {
            let s = k as f64 / 64.0;
            let radius = curl * kappa / (omega * omega);
            let (sin, cos) = (omega * s).sin_cos();
            DVec3::new(radius * cos, radius * sin, twist / omega * s)
        };
        let handed = triple(&|k| points[k]);
        let expected = if omega == 0.0 { 0.0 } else { triple(&exact) };
        // It is proportional to the torsion and to the square of the curvature.
        assert!(
            (handed - expected).abs() < 0.03 * expected.abs() + 1e-7,
            "curl {curl}, twist {twist}: {handed} for {expected}"
        );
    }
}

/// Branches keep their angles, whatever the curl.
#[test]
fn a_tree_of_straight_branches_has_nothing_to_curl() {
    let tree = Primitive::Tree {
        trunk: 0.5,
        forks: 3,
        levels: 2,
        spread: 35.0,
        shrink: 0.75,
        segments: 4,
    };
    let shape = tree.build().expect("sound").shape;
    let mut world = world(made(shape, rod(BENDING, 0.0, 0.0)), 4, 0.0);
    let before = places(&world.bodies[0]);
    run(&mut world, 2.0);
    for (now, before) in places(&world.bodies[0]).iter().zip(before) {
        // Vertices are rounded to f32: what they are at rest too is straight to 1e-7.
        assert!(now.distance(before) < 1e-5, "{now} {before}");
    }
}

/// The rest shape may change at any time; the reference follows.
#[test]
fn the_reference_curls_as_the_solver_does() {
    let hoop = Primitive::Hoop {
        radius: RING,
        segments: 24,
    };
    for shape in [arc(1.0, 24), hoop.build().expect("sound").shape] {
        let mut fast = world(
            pinned(made(shape, rod(BENDING, 1.0, 0.0)), &[0, 1]),
            10,
            -9.81,
        );
        let mut exact = reference::World::of(&fast);
        let moved = |world: &World| places(&world.bodies[0]);
        let start = moved(&fast);
        for tick in 0..60 {
            let rod = rod(
                BENDING,
                1.0 + f64::from(tick) / 60.0,
                f64::from(tick) / 30.0,
            );
            fast.bodies[0].effects.rod = Some(rod);
            exact.bodies[0].carry(&fast.bodies[0].effects);
            fast.tick();
            exact.tick();
            // Displacements of f32 over 600 substeps.
            assert_follows(&exact, &fast, 1e-4);
        }
        let end = moved(&fast);
        let farthest = end.iter().zip(&start).map(|(a, b)| a.distance(*b));
        assert!(farthest.fold(0.0, f64::max) > 0.05);
    }
}

/// The link does not depend on the place and orientation of a body that has not been stepped yet.
#[test]
fn a_ring_that_is_turned_before_the_first_tick_has_no_link() {
    let shape = Primitive::Hoop {
        radius: 0.5,
        segments: 24,
    };
    let body = made(shape.build().expect("sound").shape, Rod::default());
    for turn in [
        DQuat::IDENTITY,
        DQuat::from_rotation_x(PI),
        DQuat::from_rotation_y(PI),
        DQuat::from_rotation_z(PI),
        DQuat::from_rotation_z(2.0),
    ] {
        let at = |x: &Vec3| turn * x.as_dvec3();
        let positions: Vec<_> = body.topology.rest.iter().map(at).collect();
        let link = RodLink::of(&body.topology, &positions, &[]).expect("a ring");
        // Coordinates at rest are rounded to 6e-8, and so the directions of 24 segments of 0.13 m to
        // some 1e-6, of a turn of 2π; a flat ring has no writhe, one out of its plane by that the square.
        assert!(link.total().abs() < 1e-6, "{turn}: {link:?}");
    }
}
