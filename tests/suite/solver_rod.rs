//! Rods against closed forms of beams, and their conservation laws.

use crate::support::{assert_follows, body, damping, pinned, settings, world as world_of};
use glam::{DQuat, DVec3, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Contact, Cut, Effects, Mass, NotARod, PoissonRatio, RestShape, Rod, RodRadius,
        RodShape, Settings, Threads, Topology, VertexIndex, World, YoungsModulus,
        analytic::Elastica, reference,
    },
};
use std::{
    f64::consts::{PI, TAU},
    sync::Arc,
};

const RADIUS: f32 = 0.01;
const MODULUS: f32 = 1e8;
const RATIO: f32 = 0.3;

/// EI [N·m²].
fn bending() -> f64 {
    f64::from(MODULUS) * PI * f64::from(RADIUS).powi(4) / 4.0
}

/// GJ [N·m²].
fn twisting() -> f64 {
    f64::from(MODULUS) / (2.0 * (1.0 + f64::from(RATIO))) * PI * f64::from(RADIUS).powi(4) / 2.0
}

fn rod(tau: f32) -> Rod {
    Rod {
        youngs_modulus: YoungsModulus::new(MODULUS).expect("sound"),
        poisson_ratio: PoissonRatio::new(RATIO).expect("sound"),
        radius: RodRadius::new(RADIUS).expect("sound"),
        damping: damping(tau),
        ..Rod::default()
    }
}

/// A chain through these points [m].
fn line(points: &[DVec3]) -> RestShape {
    let count = u32::try_from(points.len()).expect("few");
    RestShape {
        vertices: points.iter().map(|point| point.as_vec3()).collect(),
        edges: (1..count).map(|i| [i - 1, i]).collect(),
        ..RestShape::default()
    }
}

/// A rod through these points, of a density in kg/m, that is clamped at its first segment.
fn beam(points: &[DVec3], density: f32, effect: Rod) -> Body {
    let mut body = pinned(body("beam", line(points), density), &[0, 1]);
    body.effects = Effects {
        rod: Some(effect),
        ..Effects::default()
    };
    body
}

fn loaded(mut body: Body, mass: f32) -> Body {
    let tip = body.topology.particles() as u32 - 1;
    let mass = Mass::new(mass).expect("sound");
    body.added_mass.push((VertexIndex(tip), mass));
    body.update_masses();
    body
}

fn world(body: Body, substeps: u32, gravity: Vec3) -> World {
    let settings = Settings {
        gravity,
        ..settings(0.0, 60.0, substeps, 1)
    };
    world_of(settings, body)
}

fn tip(world: &World) -> DVec3 {
    let particles = &world.bodies[0].particles;
    particles.position(particles.len() - 1)
}

fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * 60.0).round() as u32 {
        world.tick();
        assert!(world.bodies[0].quarantine.is_none());
    }
}

fn straight(count: usize, length: f64) -> Vec<DVec3> {
    // The first segment is clamped, and the beam begins in its middle.
    let part = length / (count as f64 - 0.5);
    (0..=count).map(|i| DVec3::X * (i as f64 * part)).collect()
}

/// PL³/3EI, from 8 to 128 segments and from 1 to 64 substeps, with one iteration.
#[test]
fn the_tip_of_a_cantilever_does_not_depend_on_segments_or_substeps() {
    // A deflection of 1 % of the length, where the linear form errs by its square.
    let force = 0.03 * bending();
    let expected = 0.01;
    for (segments, substeps) in [(8, 4), (32, 4), (128, 4), (32, 1), (32, 16), (32, 64)] {
        // Almost weightless: 1e-3 of the load.
        let mass = (force / 9.81) as f32;
        let body = beam(&straight(segments, 1.0), 1e-3 * mass, rod(0.03));
        let mut world = world(loaded(body, mass), substeps, Vec3::Y * -9.81);
        run(&mut world, 6.0);
        // The own weight adds 3/8 of a thousandth.
        let found = -tip(&world).y;
        // 1 % (the discretization: 1/(8n²) of the length and more, at n = 8).
        let off = found / expected - 1.0;
        assert!(
            off.abs() < 0.01,
            "{segments} segments, {substeps} substeps: {off}"
        );
    }
}

/// The elastica, from deflections of a tenth of the length to a rod that hangs down.
#[test]
fn a_heavy_cantilever_hangs_like_the_elastica() {
    // The longer time constant of damping is for the rod that swings like a pendulum, with little bending.
    for (load, tau) in [(1.0, 0.05), (8.0, 0.05), (30.0, 0.05), (100.0, 0.5)] {
        let density = load * bending() / 9.81;
        let body = beam(&straight(64, 1.0), density as f32, rod(tau));
        let mut world = world(body, 4, Vec3::Y * -9.81);
        // The damping of its joints brings it to rest slowly where it hangs like a pendulum.
        run(&mut world, 60.0);
        let [x, y] = Elastica { load, clamp: 0.0 }.end().expect("a sound load");
        let clamp = 0.5 / 63.5;
        let off = tip(&world).distance(DVec3::new(x + clamp, y, 0.0));
        // A joint is too soft by θ²/6, at most 4e-3 at 64 segments where all of the bend is in the
        // first quarter; the load of a segment is at its ends; and the weight stretches the rod by
        // wL²/2EA, 1.25e-3 at a load of 100.
        assert!(off < 2e-3, "load {load}: {off} of the length");
    }
}

/// Pa³/3EI + Pb³/3EI + Pa²b/GJ: the loaded arm of length a turns and bends the clamped one.
#[test]
fn an_l_shaped_cantilever_bends_and_twists() {
    for (a, b) in [(0.5_f64, 0.5), (0.6, 0.3)] {
        let count = 64.0;
        let part: f64 = (a + b) / count;
        let clamped = (b / part).round() as usize;
        let free = (a / part).round() as usize;
        let mut points: Vec<DVec3> = (0..=clamped)
            .map(|i| DVec3::X * ((i as f64 - 0.5) * b / (clamped as f64 - 0.5)))
            .collect();
        let corner = *points.last().expect("many");
        points.extend((1..=free).map(|i| corner + DVec3::Z * (i as f64 * a / free as f64)));
        let force = 0.01 * bending();
        let mass = (force / 9.81) as f32;
        let mut world = world(
            loaded(beam(&points, 1e-3 * mass, rod(0.03)), mass),
            4,
            Vec3::Y * -9.81,
        );
        run(&mut world, 8.0);
        let bent = force * (a.powi(3) + b.powi(3)) / (3.0 * bending());
        let expected = bent + force * a * a * b / twisting();
        let off = -tip(&world).y / expected - 1.0;
        // The corner is a joint, as soft as a segment is long: a 32nd to a 64th of an arm in the
        // smaller of three terms; and the linear form.
        assert!(off.abs() < 0.01, "a = {a}, b = {b}: {off}");
    }
}

/// Clamped at both ends and twisted by 90°: each joint twists by the same angle, and nothing bends.
#[test]
fn a_twisted_rod_twists_evenly_and_stays_straight() {
    let count = 24;
    let mut body = beam(&straight(count, 1.0), 0.3, rod(0.05));
    body.pins.extend([23, 24].map(VertexIndex));
    body.update_masses();
    let mut world = world(body, 4, Vec3::ZERO);
    world.tick();
    let end = world.bodies[0].particles.segments.last_mut().expect("24");
    end.orientation = DQuat::from_axis_angle(DVec3::X, PI / 2.0) * end.orientation;
    run(&mut world, 5.0);
    let particles = &world.bodies[0].particles;
    let first = particles.segments[0].orientation;
    for (i, segment) in particles.segments.iter().enumerate() {
        let turn = segment.orientation * first.conjugate();
        let angle = 2.0 * turn.x.atan2(turn.w);
        let expected = PI / 2.0 * i as f64 / 23.0;
        // What is left after 5 s of damping.
        assert!(
            (angle - expected).abs() < 1e-4,
            "segment {i}: {angle} for {expected}"
        );
    }
    for i in 0..particles.len() {
        let x = particles.position(i);
        assert!(x.y.abs() < 1e-6 && x.z.abs() < 1e-6, "particle {i} at {x}");
    }
}

/// √(GJ/ρI_p)/4L for a rod that is clamped at one end: its twist swings in a quarter wave.
#[test]
fn torsion_swings_at_its_frequency() {
    let (count, length) = (32, 1.0);
    let density = 0.3;
    let body = beam(&straight(count, length), density, rod(0.0));
    let mut world = world(body, 256, Vec3::ZERO);
    world.tick();
    // The lowest mode, small.
    for (i, segment) in world.bodies[0].particles.segments.iter_mut().enumerate() {
        let along = i as f64 / (count as f64 - 0.5);
        let angle = 0.1 * (PI / 2.0 * along).sin();
        segment.orientation = DQuat::from_axis_angle(DVec3::X, angle) * segment.orientation;
    }
    // Mass per length λ, I_p = J: λ r²/2 is the inertia per length.
    let inertia = f64::from(density) * f64::from(RADIUS).powi(2) / 2.0;
    let speed = (twisting() / inertia).sqrt();
    let period = 4.0 * length / speed;
    let h = 1.0 / (60.0 * 256.0);
    let angle = |world: &World| {
        let segments = &world.bodies[0].particles.segments;
        let end = segments[segments.len() - 1].orientation;
        let turn = end * segments[0].orientation.conjugate();
        2.0 * turn.x.atan2(turn.w)
    };
    // The phase after two ticks of known length, by the decaying cosine of implicit Euler: its
    // angular frequency is atan(ωh)/h.
    let omega = 2.0 * PI / period;
    let ticks = 2.0;
    let steps = ticks * 256.0;
    let start = angle(&world);
    for _ in 0..2 {
        world.tick();
    }
    let numeric = (omega * h).atan() / h;
    let expected =
        start * (1.0 + (omega * h).powi(2)).powf(-steps / 2.0) * (numeric * steps * h).cos();
    let off = (angle(&world) - expected).abs() / start;
    assert!(omega * h < 0.1, "{}", omega * h);
    // The discrete chain of 32 segments is slower by (π/4n)²/6 = 1e-4 of the phase of some
    // radians; start values of the first tick.
    assert!(off < 0.05, "{} for {expected}", angle(&world));
}

/// π²EI/4L² for a column that is clamped below and free above.
#[test]
fn a_column_buckles_at_eulers_load() {
    let critical = PI * PI * bending() / 4.0;
    let lean = |factor: f64| {
        let mut points = straight(32, 1.0);
        for point in &mut points {
            *point = DVec3::Y * point.x;
        }
        let mass = (factor * critical / 9.81) as f32;
        let mut body = loaded(beam(&points, 1e-3 * mass, rod(0.02)), mass);
        // Pushed aside by a thousandth of its length.
        let top = body.particles.len() - 1;
        let place = body.particles.position(top) + DVec3::X * 1e-3;
        body.particles.set_position(top, place);
        let mut world = world(body, 8, Vec3::Y * -9.81);
        run(&mut world, 20.0);
        tip(&world).x.abs()
    };
    // Within 2 % of the load: below it leans no more than at the start, above it falls far aside
    // (post-buckling: about 2√2 L/π √(2(P/P_c − 1)), a fifth of the length at 2 %).
    let (below, above) = (lean(0.98), lean(1.02));
    assert!(below < 2e-3, "{below} m below the critical load");
    assert!(above > 0.05, "{above} m above it");
}

/// Three turns of a helix of radius 0.2 m and pitch 0.1 m.
fn coil() -> Vec<DVec3> {
    (0..=72)
        .map(|i| {
            let angle = f64::from(i) * 6.0 * PI / 72.0;
            DVec3::new(
                0.2 * angle.cos(),
                0.1 * angle / (2.0 * PI),
                0.2 * angle.sin(),
            )
        })
        .collect()
}

fn free(points: &[DVec3], effect: Rod) -> Body {
    let mut body = beam(points, 0.3, effect);
    body.pins.clear();
    body.update_masses();
    body
}

/// Curled, turned and moved, without gravity.
#[test]
fn a_curled_rod_at_rest_stays_where_it_is() {
    let mut body = free(&coil(), rod(0.0));
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
    for i in 0..body.particles.len() {
        let place = turn * body.particles.position(i) + DVec3::new(0.3, 1.0, -0.2);
        body.particles.set_position(i, place);
    }
    let before = body.particles.clone();
    let mut world = world(body, 10, Vec3::ZERO);
    run(&mut world, 5.0);
    let after = &world.bodies[0].particles;
    for i in 0..after.len() {
        let moved = after.position(i).distance(before.position(i));
        // Positions are rounded to 6e-8 m at 1 m in the file, so that its edges are off by that.
        assert!(moved < 1e-6, "particle {i} moved by {moved} m");
    }
}

/// Linear momentum is exact, and energy does not grow.
#[test]
fn a_free_rod_conserves_momentum_and_gains_no_energy() {
    let mut body = free(&coil(), rod(0.0));
    for i in 0..body.particles.len() {
        let x = body.particles.position(i);
        let stretched = DVec3::new(x.x * 1.2, x.y * 3.0, x.z);
        body.particles.set_position(i, stretched);
    }
    body.set_velocity(Vec3::new(0.5, 0.0, 0.0));
    let momentum = |body: &Body| -> DVec3 {
        let all = 0..body.particles.len();
        all.map(|i| body.particles.velocity_f64(i) / f64::from(body.particles.positions[i].w))
            .sum()
    };
    let start = momentum(&body);
    let mut world = world(body, 10, Vec3::ZERO);
    let kinetic = |body: &Body| -> f64 {
        let all = 0..body.particles.len();
        all.map(|i| {
            let v = body.particles.velocity_f64(i);
            0.5 * v.length_squared() / f64::from(body.particles.positions[i].w)
        })
        .sum()
    };
    let (mut highest, mut fastest) = (0.0_f64, 0.0_f64);
    for tick in 0..600 {
        world.tick();
        let speed = kinetic(&world.bodies[0]);
        if tick < 60 {
            highest = highest.max(speed);
        } else {
            fastest = fastest.max(speed);
        }
        let off = (momentum(&world.bodies[0]) - start).length() / start.length();
        // Displacements of f32, 6000 substeps of 73 particles.
        assert!(off < 1e-4, "tick {tick}: momentum off by {off}");
    }
    assert!(
        fastest <= highest,
        "{fastest} J after the first second, {highest} J in it"
    );
}

/// Both run the same solve on positions of other precision.
fn the_reference_follows(body: Body) {
    let mut fast = world(body, 10, Vec3::Y * -9.81);
    let mut exact = reference::World::of(&fast);
    for _ in 0..60 {
        fast.tick();
        exact.tick();
        // Displacements of f32 over 600 substeps; a swinging rod is not chaotic.
        assert_follows(&exact, &fast, 1e-4);
    }
}

#[test]
fn the_reference_follows_the_solver() {
    the_reference_follows(beam(&coil(), 0.3, rod(1e-3)));
}

/// 150 strands and a chain that is too long for a piece of a body that threads share.
#[test]
fn a_strand_moves_the_same_alone_among_others_and_on_any_number_of_threads() {
    let strand = |number: usize, count: usize| -> Vec<DVec3> {
        let place = |i: usize| {
            let along = i as f64 * 0.02;
            DVec3::new(along, 0.1 * (along * 3.0).sin(), number as f64 * 0.05)
        };
        (0..count).map(place).collect()
    };
    let lengths: Vec<usize> = (0..150).map(|k| 20 + k % 13).chain([1500]).collect();
    let clamped = |firsts: &[u32], shape: RestShape| {
        let pins: Vec<u32> = firsts.iter().flat_map(|&i| [i, i + 1]).collect();
        let mut body = pinned(body("strands", shape, 0.3), &pins);
        body.effects.rod = Some(rod(1e-3));
        body
    };
    let mut shape = RestShape::default();
    let mut firsts = Vec::new();
    for (number, &count) in lengths.iter().enumerate() {
        let first = shape.vertices.len() as u32;
        let strand = line(&strand(number, count));
        shape.vertices.extend(strand.vertices);
        let edges = strand.edges.into_iter();
        shape
            .edges
            .extend(edges.map(|[a, b]| [first + a, first + b]));
        firsts.push(first);
    }
    let together = clamped(&firsts, shape);
    for iterations in [1, 2] {
        let settings = settings(-9.81, 60.0, 4, iterations);
        let run = |body: &Body, threads| {
            let mut world = world_of(settings, body.clone());
            world.threads = Threads::new(threads).expect("sound");
            for _ in 0..3 {
                world.tick();
            }
            world.bodies.remove(0)
        };
        let expected = run(&together, 1);
        for threads in [2, 3] {
            assert_eq!(run(&together, threads).particles, expected.particles);
        }
        for number in [0, 77, 149, 150] {
            let count = lengths[number];
            let alone = clamped(&[0], line(&strand(number, count)));
            let alone = run(&alone, 1);
            for i in 0..count as u32 {
                let place = |body: &Body, vertex| {
                    let particle = body.topology.numbering.particle(VertexIndex(vertex));
                    body.particles.position(particle.0 as usize)
                };
                let (one, other) = (place(&alone, i), place(&expected, firsts[number] + i));
                assert_eq!(one, other, "strand {number}, vertex {i}");
            }
        }
    }
}

#[test]
fn a_body_with_a_surface_or_too_much_to_couple_is_refused() {
    let shape = |shape: RestShape| RodShape::of(&Topology::new(shape).expect("sound"));
    let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let mut star = line(&points);
    star.edges = vec![[1, 0], [1, 2], [1, 3]];
    assert!(!shape(star).expect("edges alone").is_of_chains());
    let mut ring = line(&points);
    ring.edges.push([3, 0]);
    assert!(!shape(ring).expect("edges alone").is_of_chains());
    let cloth = Primitive::Box {
        size: Vec3::ONE,
        cells: glam::UVec3::ONE,
    };
    let cloth = cloth.build().expect("sound").shape;
    assert_eq!(shape(cloth), Err(NotARod::Surface));
    let center = |edges: u32| {
        let mut star = line(&vec![DVec3::X; edges as usize + 1]);
        star.vertices = (0..=edges)
            .map(|i| Vec3::new(i as f32, (i * i) as f32, 0.0))
            .collect();
        star.edges = (1..=edges).map(|i| [0, i]).collect();
        shape(star)
    };
    assert!(center(12).is_ok());
    let error = center(13).expect_err("too many");
    assert!(
        error.to_string().contains("13 edges meet in vertex 0"),
        "{error}"
    );
    let net = |cells: u32| {
        let cloth = Primitive::Cloth {
            size: glam::Vec2::ONE,
            cells: glam::UVec2::splat(cells),
            diagonals: Default::default(),
            shear: false,
        };
        let mut net = cloth.build().expect("sound").shape;
        net.triangles.clear();
        shape(net)
    };
    // A mesh of triangles has two rings per cell.
    assert!(net(20).is_ok());
    assert_eq!(
        net(23),
        Err(NotARod::Rings {
            rings: 2 * 23 * 23 - 1
        })
    );
    // A chain, and two lone vertices.
    let mut two = line(&points);
    two.edges = vec![[2, 3]];
    assert!(shape(two).expect("edges alone").is_of_chains());
}

/// A ring, a tree and a chain in one body, and a number of more chains.
fn network(more: usize) -> RestShape {
    let mut parts = vec![
        (
            Primitive::Hoop {
                radius: 0.3,
                segments: 24,
            },
            Vec3::Y,
        ),
        (
            Primitive::Tree {
                trunk: 0.4,
                forks: 3,
                levels: 2,
                spread: 40.0,
                shrink: 0.7,
                segments: 3,
            },
            Vec3::X,
        ),
        (
            Primitive::Rope {
                length: 0.5,
                segments: 8,
            },
            Vec3::Z,
        ),
    ];
    let strand = |number: usize| {
        let rope = Primitive::Rope {
            length: 0.5,
            segments: 8 + (number % 5) as u32,
        };
        (rope, Vec3::Z * (2.0 + 0.05 * number as f32))
    };
    parts.extend((0..more).map(strand));
    let mut all = RestShape::default();
    for (part, place) in parts {
        let shape = part.build().expect("sound").shape;
        let first = all.vertices.len() as u32;
        all.vertices
            .extend(shape.vertices.iter().map(|at| *at + place));
        let edges = shape.edges.iter();
        all.edges
            .extend(edges.map(|edge| edge.map(|vertex| vertex + first)));
    }
    all
}

/// Pushed apart, a free network turns and swings; momentum stays, and energy does not grow.
#[test]
fn a_free_network_conserves_momentum_and_gains_no_energy() {
    let mut body = body("network", network(0), 0.3);
    body.effects.rod = Some(rod(0.0));
    for i in 0..body.particles.len() {
        let x = body.particles.position(i).as_vec3();
        let push = Vec3::new(x.y * x.z - 0.3, x.x - x.z * x.z, x.y * x.y - x.x);
        body.particles.set_velocity(i, push);
    }
    let momentum = |body: &Body| -> DVec3 {
        let all = 0..body.particles.len();
        all.map(|i| body.particles.velocity_f64(i) / f64::from(body.particles.positions[i].w))
            .sum()
    };
    let energy = |body: &Body| -> f64 {
        let all = 0..body.particles.len();
        all.map(|i| {
            let v = body.particles.velocity_f64(i);
            0.5 * v.length_squared() / f64::from(body.particles.positions[i].w)
        })
        .sum()
    };
    let (start, first) = (momentum(&body), energy(&body));
    let mut world = world(body, 10, Vec3::ZERO);
    for tick in 0..300 {
        world.tick();
        let off = (momentum(&world.bodies[0]) - start).length() / start.length();
        // Displacements of f32, 3000 substeps of 73 particles.
        assert!(off < 1e-4, "tick {tick}: momentum off by {off}");
        let now = energy(&world.bodies[0]);
        assert!(now <= first, "tick {tick}: {now} J of {first} J");
    }
}

/// At rest, a network of rods stays where it is.
#[test]
fn a_network_at_rest_stays_where_it_is() {
    let mut body = body("network", network(0), 0.3);
    body.effects.rod = Some(rod(0.0));
    let start: Vec<DVec3> = (0..body.particles.len())
        .map(|i| body.particles.position(i))
        .collect();
    let mut world = world(body, 4, Vec3::ZERO);
    run(&mut world, 1.0);
    for (i, start) in start.into_iter().enumerate() {
        let moved = world.bodies[0].particles.position(i).distance(start);
        // The vertices are rounded to 24 bits of up to 1 m, and so are the lengths.
        assert!(moved < 1e-6, "particle {i} has moved by {moved}");
    }
}

/// A ring that has been cut is a chain, and a tree that has been cut two networks; their segments
/// keep their orientations, so that nothing moves.
#[test]
fn a_network_that_is_cut_stays_where_it_is() {
    let mut body = body("network", network(0), 0.3);
    body.effects.rod = Some(rod(0.0));
    let mut world = world(body, 4, Vec3::ZERO);
    world.tick();
    // Through the left side of the ring, and the trunk of the tree.
    for place in [Vec3::new(-0.3, 1.02, 0.0), Vec3::new(1.0, 0.23, 0.0)] {
        let side = Vec3::X * 0.05;
        let cut = Cut {
            eye: place + Vec3::Z,
            rays: [side - Vec3::Z, -side - Vec3::Z],
        };
        assert!(world.cut(0, &cut));
    }
    let before = world.bodies[0].particles.clone();
    assert_eq!(before.len(), 75, "two particles were split");
    run(&mut world, 1.0);
    for i in 0..before.len() {
        let moved = world.bodies[0]
            .particles
            .position(i)
            .distance(before.position(i));
        assert!(moved < 1e-6, "particle {i} has moved by {moved}");
    }
}

/// A ring that is pulled apart by two opposite forces F gets longer by FR³/EI (π/4 − 2/π), and
/// narrower by FR³/EI (2/π − 1/2) (Timoshenko).
#[test]
fn a_ring_that_is_pulled_apart_changes_its_shape_as_a_ring_of_a_beam() {
    let radius = 0.5_f32;
    let r = f64::from(radius);
    for (segments, substeps) in [(32, 1), (32, 8), (128, 4)] {
        let hoop = Primitive::Hoop { radius, segments };
        let shape = hoop.build().expect("sound").shape;
        let [top, bottom] = [1, 3].map(|quarter| (segments / 4 * quarter) as usize);
        let [left, right] = [2, 0].map(|quarter| (segments / 4 * quarter) as usize);
        // Hung by its top, and loaded at the bottom; a deflection of 0.3 % of the radius.
        let force = 0.003 * bending() / (r * r) / (PI / 4.0 - 2.0 / PI);
        let mass = (force / 9.81) as f32;
        let mut body = pinned(body("ring", shape, 1e-4 * mass), &[top as u32]);
        body.effects.rod = Some(rod(0.05));
        let load = Mass::new(mass).expect("sound");
        body.added_mass.push((VertexIndex(bottom as u32), load));
        body.update_masses();
        let topology = Arc::clone(&body.topology);
        let mut world = world(body, substeps, Vec3::Y * -9.81);
        run(&mut world, 20.0);
        let at = |vertex: usize| {
            let particle = topology.numbering.particle(VertexIndex(vertex as u32));
            world.bodies[0].particles.position(particle.index())
        };
        let longer = at(top).distance(at(bottom)) - 2.0 * r;
        let narrower = 2.0 * r - at(left).distance(at(right));
        let unit = force * r.powi(3) / bending();
        let expected = [PI / 4.0 - 2.0 / PI, 2.0 / PI - 0.5].map(|factor| factor * unit);
        // The bend is in joints at angles h apart. The moment M is FR/2 (|cos φ| − c), and that of
        // forces on the sides |sin φ| − c, where c makes their sums 0: 2/π (1 − h²/12). The sum of
        // |cos φ sin φ| is 2 − 2h²/3 instead of 2.
        let h = TAU / f64::from(segments);
        let c = 4.0 / PI.powi(2) * h * h / 6.0;
        let joints = [
            c / (0.5 - 4.0 / PI.powi(2)),
            (2.0 / 3.0 * h * h - TAU * c) / (8.0 / PI - 2.0),
        ];
        let errors = [longer, narrower].into_iter().zip(expected);
        for ((found, expected), joints) in errors.zip(joints) {
            let off = found / expected - 1.0 - joints;
            // Chords are shorter than arcs by h²/24. Shear and stretch add 0.2 %, and the linear
            // form errs by about as much as the deflection, 0.3 % of the radius.
            assert!(
                off.abs() < h * h / 24.0 + 0.003,
                "{segments} segments, {substeps} substeps: {off} beside {joints}"
            );
        }
    }
}

/// A stem of length b whose end carries a crossbar with arms of length a: loaded at one end, it
/// deflects there by Pa³/3EI + Pb³/3EI + Pa²b/GJ; loaded at both, by Pa³/3EI + 2Pb³/3EI.
#[test]
fn a_branch_bends_and_twists_as_a_beam_does() {
    let (a, b) = (0.4, 0.5);
    let force = 0.01 * bending();
    let mass = (force / 9.81) as f32;
    let deflection = |of_stem: u32, of_arm: u32, loaded: usize| -> f64 {
        let part = b / (f64::from(of_stem) - 0.5);
        let mut points: Vec<DVec3> = (0..=of_stem)
            .map(|i| DVec3::X * ((f64::from(i) - 0.5) * part))
            .collect();
        let end = points[of_stem as usize];
        let mut shape = line(&points);
        for side in [1.0, -1.0] {
            let mut last = of_stem;
            for i in 1..=of_arm {
                points.push(end + DVec3::Z * (side * a * f64::from(i) / f64::from(of_arm)));
                shape.edges.push([last, points.len() as u32 - 1]);
                last = points.len() as u32 - 1;
            }
        }
        shape.vertices = points.iter().map(|at| at.as_vec3()).collect();
        let ends = [of_stem + of_arm, of_stem + 2 * of_arm];
        let mut body = pinned(body("cross", shape, 1e-4 * mass), &[0, 1]);
        body.effects.rod = Some(rod(0.03));
        let load = Mass::new(mass).expect("sound");
        let loads = ends[..loaded].iter().map(|&end| (VertexIndex(end), load));
        body.added_mass.extend(loads);
        body.update_masses();
        let topology = Arc::clone(&body.topology);
        let mut world = world(body, 4, Vec3::Y * -9.81);
        run(&mut world, 8.0);
        let particle = topology.numbering.particle(VertexIndex(ends[0]));
        -world.bodies[0].particles.position(particle.index()).y
    };
    let arm = force * a.powi(3) / (3.0 * bending());
    let stem = force * b.powi(3) / (3.0 * bending());
    let twist = force * a * a * b / twisting();
    for (loaded, expected) in [(1, arm + stem + twist), (2, arm + 2.0 * stem)] {
        let coarse = deflection(20, 16, loaded) / expected - 1.0;
        let fine = deflection(40, 32, loaded) / expected - 1.0;
        // The joints at the stem are as soft as a segment is long, which is an error of first order:
        // without it, as for a chain.
        let off = 2.0 * fine - coarse;
        assert!(fine.abs() < 0.02, "{loaded} loads: {coarse}, {fine}");
        assert!(off.abs() < 2e-3, "{loaded} loads: {coarse}, {fine}, {off}");
    }
}

/// Beside 200 chains in a body that threads share, in one iteration and in two.
#[test]
fn a_network_has_the_same_bits_on_any_number_of_threads() {
    let mut body = pinned(body("network", network(200), 0.3), &[0, 30]);
    body.effects.rod = Some(rod(1e-3));
    for iterations in [1, 2] {
        let run = |threads| {
            let mut world = world_of(settings(-9.81, 60.0, 4, iterations), body.clone());
            world.threads = Threads::new(threads).expect("sound");
            for _ in 0..5 {
                world.tick();
            }
            world.bodies.remove(0).particles
        };
        let expected = run(1);
        assert_eq!(run(2), expected);
        assert_eq!(run(3), expected);
    }
}

#[test]
fn the_reference_follows_the_solver_on_a_network() {
    let mut body = pinned(body("network", network(0), 0.3), &[0, 24, 25]);
    body.effects.rod = Some(rod(1e-3));
    the_reference_follows(body);
}

/// A stiff rod falls across another one, and comes to lie on it.
#[test]
fn rods_touch_at_their_radius() {
    let along =
        |axis: DVec3| -> Vec<DVec3> { (-4..=4).map(|i| axis * (0.05 * f64::from(i))).collect() };
    let crossed = |axis: DVec3, height: f32, pins: &[u32]| {
        let mut body = pinned(body("rod", line(&along(axis)), 0.3), pins);
        body.translate(Vec3::Y * height);
        body.effects = Effects {
            rod: Some(rod(0.01)),
            contact: Some(Contact::default()),
            ..Effects::default()
        };
        body
    };
    let all: Vec<u32> = (0..9).collect();
    let fixed = crossed(DVec3::X, 0.0, &all);
    let mut world = world(fixed, 10, Vec3::Y * -9.81);
    world.bodies.push(crossed(DVec3::Z, 0.1, &[]));
    run(&mut world, 0.5);
    let middle = world.bodies[1].particles.position(4);
    // Twice the radius, as the two vertices in the middle are the closest points; gh² in a substep
    // is 3e-5 m, and the ends of the rod, which bend, take part with more mass than a vertex has.
    let expected = 2.0 * f64::from(RADIUS);
    assert!((middle.y - expected).abs() < 3e-4, "{middle}");
}
