//! Tearing and cutting: bookkeeping, and limits with known answers.

use crate::support::{body, cube, pinned, settings, with, world as world_of};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Bend, Body, BreakingStrain, Collide, Collider, ColliderShape, Compliance, Cut, Drag,
        Effects, Force, Membrane, Method, NeoHookean, PieceSize, PoissonRatio, Pose, RestShape,
        Rod, SelfContact, Stretch, Tear, Thickness, Topology, Toughness, VertexIndex, World,
        YoungsModulus, reference,
        topology::{Dimension, order::Elements},
    },
};
use std::collections::BTreeSet;

fn cloth(size: Vec2, cells: UVec2) -> RestShape {
    let primitive = Primitive::Cloth {
        size,
        cells,
        diagonals: Default::default(),
        shear: true,
    };
    primitive.build().expect("sound").shape
}

fn of<T: TryFrom<f64>>(value: f64) -> T {
    T::try_from(value).ok().expect("in range")
}

/// No two constraints of a color share a particle, and each is in its partition.
fn check_colors<const N: usize>(elements: &Elements<N>, topology: &Topology) {
    let mut seen = vec![0; topology.particles()];
    let mut mark = 0;
    for batch in elements.batches() {
        for (_, group) in elements.groups(batch) {
            mark += 1;
            for corners in group {
                let corners = corners.map(|corner| corner.particle());
                for corner in corners {
                    let last = std::mem::replace(&mut seen[corner as usize], mark);
                    assert_ne!(last, mark, "a color has particle {corner} twice");
                }
                if batch.partition().is_some() {
                    let own = topology.partitions.partition_of(&corners);
                    assert_eq!(own, batch.partition());
                }
            }
        }
    }
}

/// The invariants of a torn body.
fn check(body: &Body, mass: f64, elements: usize) {
    let topology = &*body.topology;
    check_colors(&topology.edges.elements, topology);
    check_colors(&topology.tetrahedra.elements, topology);
    check_colors(&topology.hinges().elements, topology);
    check_colors(&topology.facets().elements, topology);
    let mut used = vec![false; topology.particles()];
    for corner in topology.edges.ends().flatten() {
        used[corner as usize] = true;
    }
    assert!(used.iter().all(|used| *used), "a particle has no element");
    let vertices = (0..topology.particles()).map(|i| topology.vertex(i));
    let all: BTreeSet<_> = vertices.collect();
    assert_eq!(
        all.len(),
        topology.particles(),
        "each particle has a vertex"
    );
    assert_eq!(carriers(topology), elements, "no element is lost");
    // Masses are rounded to f32 once each: 6e-8 of the whole.
    assert!((total_mass(body) / mass - 1.0).abs() < 1e-6);
    assert_eq!(body.quarantine, None);
}

fn carriers(topology: &Topology) -> usize {
    match topology.dimension {
        Dimension::Solid => topology.tetrahedra.corners().len(),
        Dimension::Sheet => topology.triangles.len(),
        _ => topology.edges.ends().len(),
    }
}

fn total_mass(body: &Body) -> f64 {
    let positions = body.particles.positions.iter();
    positions.map(|x| 1.0 / f64::from(x.w)).sum()
}

/// Stretched by half, with a toughness that no element withstands.
fn torn_everywhere(shape: RestShape, effects: Effects) -> World {
    let mut torn = with(body("torn", shape, 1.0), effects);
    torn.effects.tear = Some(Tear {
        toughness: of::<Toughness>(1e-6),
        ..Tear::default()
    });
    for i in 0..torn.particles.len() {
        let x = torn.particles.position(i);
        torn.particles.set_position(i, x * 1.5);
    }
    world_of(settings(0.0, 60.0, 10, 1), torn)
}

fn springs() -> Effects {
    Effects {
        stretch: Some(Stretch {
            compliance: of::<Compliance>(1e-3),
            ..Stretch::default()
        }),
        bend: Some(Bend::default()),
        ..Effects::default()
    }
}

#[test]
fn a_cloth_that_tears_everywhere_at_once_keeps_its_mass_and_a_valid_order() {
    let mut world = torn_everywhere(cloth(Vec2::ONE, UVec2::splat(60)), springs());
    let (mass, elements) = (
        total_mass(&world.bodies[0]),
        carriers(&world.bodies[0].topology),
    );
    for _ in 0..10 {
        world.tick();
        check(&world.bodies[0], mass, elements);
    }
    assert!(world.bodies[0].particles.len() > 2 * 61 * 61);
}

#[test]
fn a_solid_that_tears_everywhere_at_once_keeps_its_mass_and_a_valid_order() {
    let effects = Effects::from(NeoHookean::default());
    let mut world = torn_everywhere(cube(1.0, 8), effects);
    let (mass, elements) = (
        total_mass(&world.bodies[0]),
        carriers(&world.bodies[0].topology),
    );
    for _ in 0..10 {
        world.tick();
        check(&world.bodies[0], mass, elements);
    }
    assert!(world.bodies[0].particles.len() > 2 * 9 * 9 * 9);
}

#[test]
fn tearing_has_the_same_bits_on_all_threads() {
    let hash = |threads: usize| {
        let mut world = torn_everywhere(cloth(Vec2::ONE, UVec2::splat(60)), springs());
        world.threads = pliant::solver::Threads::new(threads).expect("threads");
        for _ in 0..5 {
            world.tick();
        }
        world.state_hash()
    };
    let one = hash(1);
    assert_eq!(one, hash(2));
    assert_eq!(one, hash(4));
}

/// A torn topology is stored with its order, and continues with the same bits.
#[test]
fn a_torn_topology_is_the_same_after_it_was_stored() {
    for mut world in [
        torn_everywhere(cloth(Vec2::ONE, UVec2::splat(60)), springs()),
        torn_everywhere(cube(1.0, 4), Effects::from(NeoHookean::default())),
    ] {
        world.tick();
        world.tick();
        let topology = &*world.bodies[0].topology;
        let order = topology.torn_order().expect("it is torn");
        let numbering = (*topology.numbering).clone();
        let again = Topology::torn(topology.rest_shape(), numbering, &order);
        assert!(again.expect("sound") == *topology);
    }
}

/// A rope of springs, hung from its first vertex, with a load at its last one.
fn chain(load: f64, force: f64, substeps: u32) -> World {
    let shape = RestShape {
        vertices: (0..5).map(|i| Vec3::NEG_Y * (0.25 * i as f32)).collect(),
        edges: (0..4).map(|i| [i, i + 1]).collect(),
        ..RestShape::default()
    };
    let rope = body("rope", shape, 1e-3);
    let effects = Effects {
        stretch: Some(Stretch {
            compliance: of::<Compliance>(1e-4),
            damping: of(0.05),
            ..Stretch::default()
        }),
        tear: Some(Tear {
            toughness: of::<Toughness>(f64::INFINITY),
            force: of::<Force>(force),
            smallest_piece: of::<PieceSize>(1.0),
            ..Tear::default()
        }),
        ..Effects::default()
    };
    let mut rope = with(pinned(rope, &[0]), effects);
    rope.added_mass = vec![(VertexIndex(4), of(load / 9.81))];
    rope.update_masses();
    world_of(settings(9.81, 60.0, substeps, 1), rope)
}

/// The load is applied at once and oscillates: the peak of an undamped mass on a spring is twice
/// its weight, and damping of the spring lowers it. Here the strength is above that.
#[test]
fn a_chain_breaks_above_twice_the_load_that_it_holds() {
    // The weight of the rope itself is a thousandth of the load.
    for substeps in [16, 64] {
        let mut holds = chain(10.0, 20.5, substeps);
        let mut breaks = chain(10.0, 9.9, substeps);
        for _ in 0..600 {
            holds.tick();
            breaks.tick();
        }
        assert_eq!(holds.bodies[0].particles.len(), 5, "{substeps} substeps");
        assert!(breaks.bodies[0].particles.len() > 5, "{substeps} substeps");
    }
}

#[test]
fn a_chain_at_rest_holds_up_to_its_strength() {
    let mut world = chain(10.0, 1e9, 16);
    for _ in 0..600 {
        world.tick();
    }
    let limit = |world: &mut World, force: f64| {
        let tear = world.bodies[0].effects.tear.as_mut().expect("it tears");
        tear.force = of::<Force>(force);
    };
    // 0.2 % for the weight of the rope and the last oscillation; at rest XPBD's force is exact.
    limit(&mut world, 10.0 * 1.01);
    for _ in 0..60 {
        world.tick();
    }
    assert_eq!(world.bodies[0].particles.len(), 5);
    limit(&mut world, 10.0 * 0.99);
    for _ in 0..60 {
        world.tick();
    }
    assert!(world.bodies[0].particles.len() > 5);
}

/// A rod under a load that is applied at once carries at most twice that, and half of it tears it.
#[test]
fn a_rod_breaks_at_its_force() {
    let breaks = |force: f64| {
        let mut world = chain(10.0, force, 16);
        let rope = &mut world.bodies[0];
        rope.effects.stretch = None;
        // EA is 785 N: a strain of 1.3 %.
        rope.effects.rod = Some(Rod {
            youngs_modulus: of::<YoungsModulus>(1e7),
            radius: of(5e-3),
            ..Rod::default()
        });
        (0..120).for_each(|_| world.tick());
        world.bodies[0].particles.len() > 5
    };
    assert!(!breaks(20.5));
    assert!(breaks(5.0));
}

/// The lips of a cut touch at rest. With contact of the body with itself, they never pass through each other.
#[test]
fn the_lips_of_a_cut_stay_on_their_sides() {
    let mut effects = springs();
    effects.tear = None;
    effects.self_contact = Some(SelfContact::default());
    let sheet = with(
        body("sheet", cloth(Vec2::ONE, UVec2::splat(16)), 0.2),
        effects,
    );
    let mut world = world_of(settings(9.81, 60.0, 20, 1), sheet);
    let mut sheet = world.bodies.remove(0);
    // From the middle of the rest shape to its rim.
    let cut = Cut {
        eye: Vec3::new(0.01, 5.0, 0.0),
        rays: [Vec3::new(0.0, -1.0, 0.0), Vec3::new(0.0, -1.0, 0.4)],
    };
    assert!(sheet.cut(&cut).is_some());
    // It falls onto a ball below the end of the cut.
    sheet.effects.collide = Some(Collide::default());
    sheet.translate(Vec3::new(0.0, 0.3, 0.0));
    world.bodies.push(sheet);
    let ball = ColliderShape::Sphere { radius: 0.2 };
    world.colliders =
        vec![Collider::new(ball, Pose::at(DVec3::new(0.02, 0.0, 0.2))).expect("sound")];
    let mut most = 0;
    for _ in 0..120 {
        world.tick();
        most = most.max(world.crossings());
    }
    assert_eq!(most, 0, "pairs that cross");
}

#[test]
fn the_reference_tears_where_the_fast_solver_does() {
    let mut world = chain(10.0, 9.9, 16);
    let mut reference = reference::World::of(&world);
    // Light particles under a heavy load are slow to converge.
    for _ in 0..300 {
        world.tick();
        reference.tick();
        let [fast, exact] = [&world.bodies[0].topology, &reference.bodies[0].topology];
        assert_eq!(fast.particles(), exact.particles());
        assert!(fast.rest == exact.rest);
    }
    assert!(world.bodies[0].particles.len() > 5);
}

/// The strain of a strip clamped at height H between rigid grips under which a long cut runs:
/// its energy W per area ahead of the cut is released, W H = G_c (Rivlin and Thomas 1953), and in
/// plane stress with fixed width W = ½Eε²t/(1 − ν²).
fn strip_tears_at(edge: f64) -> f64 {
    let (height, width) = (0.1, 0.3);
    let (modulus, ratio, thickness) = (1e6, 0.3, 1e-3);
    let toughness = 0.3;
    let cells = UVec2::new(
        (width / edge).round() as u32,
        (height / edge).round() as u32,
    );
    let shape = cloth(Vec2::new(width as f32, height as f32), cells);
    // Heavy enough for the springs of an element to be converged: h²Ew/t is 2 %.
    let mut strip = body("strip", shape, 10.0);
    let at = |body: &Body, i: usize| body.topology.rest[i].as_dvec3();
    // A cut from the left edge past the middle, along a line of the grid.
    let cut = Cut {
        eye: Vec3::new(0.0, 1.0, 1e-5),
        rays: [Vec3::new(-0.3, -1.0, 0.0), Vec3::new(-0.02, -1.0, 0.0)],
    };
    assert!(strip.cut(&cut).is_some());
    let is_end =
        |body: &Body, i: usize, sign: f64| (at(body, i).z - sign * height / 2.0).abs() < 1e-6;
    let ends =
        (0..strip.particles.len()).filter(|&i| is_end(&strip, i, 1.0) || is_end(&strip, i, -1.0));
    strip.pins = ends.map(|i| strip.topology.vertex(i)).collect();
    strip.update_masses();
    strip.effects = Effects {
        membrane: Some(Membrane {
            youngs_modulus: of::<YoungsModulus>(modulus),
            poisson_ratio: of::<PoissonRatio>(ratio),
            thickness: of::<Thickness>(thickness),
            ..Membrane::default()
        }),
        drag: Some(Drag {
            linear: of(5.0),
            ..Drag::default()
        }),
        tear: Some(Tear {
            toughness: of::<Toughness>(toughness),
            ..Tear::default()
        }),
        ..Effects::default()
    };
    let expected =
        (2.0 * toughness * (1.0 - ratio * ratio) / (modulus * thickness * height)).sqrt();
    let mut world = world_of(settings(0.0, 60.0, 250, 1), strip);
    let before = world.bodies[0].particles.len();
    let mut relative = 0.0;
    // The cut runs when its tip has moved by a tenth of the height.
    let run = (0.1 * height / edge).ceil() as usize + 1;
    while world.bodies[0].particles.len() < before + run {
        relative += 0.01;
        let strip = &mut world.bodies[0];
        strip.wake();
        for i in 0..strip.particles.len() {
            if is_end(strip, i, 1.0) {
                let x = strip.particles.position(i);
                let z = height / 2.0 + relative * expected * height;
                strip.particles.set_position(i, DVec3::new(x.x, x.y, z));
            }
        }
        world.tick();
        assert!(relative < 1.5, "the cut does not run");
    }
    relative
}

/// A limit on strain would differ by √2 from one mesh to the other.
#[test]
fn a_cut_in_a_strip_runs_at_the_strain_of_griffith_on_any_mesh() {
    let [coarse, fine] = [0.01, 0.005].map(strip_tears_at);
    // Discretization: the tip is one element wide, 5 and 10 % of the height.
    assert!((coarse - 1.0).abs() < 0.2, "{coarse}");
    assert!((fine - 1.0).abs() < 0.2, "{fine}");
    assert!((coarse / fine - 1.0).abs() < 0.1, "{coarse} {fine}");
}

#[test]
fn scissors_cut_cloth_solids_ropes_and_rods_in_two() {
    let slice = |x: f32| Cut {
        eye: Vec3::new(x, 5.0, 0.0),
        rays: [Vec3::new(0.0, -1.0, -2.0), Vec3::new(0.0, -1.0, 2.0)],
    };
    let rope = Primitive::Rope {
        length: 1.0,
        segments: 32,
    };
    let rope = rope.build().expect("sound").shape;
    let middle = |shape: &RestShape| {
        let (low, high) = shape
            .vertices
            .iter()
            .fold((f32::MAX, f32::MIN), |(low, high), x| {
                (low.min(x.x), high.max(x.x))
            });
        low.midpoint(high) + 0.003
    };
    let mut rod = rope.clone();
    // Across the cut.
    for x in &mut rod.vertices {
        *x = Vec3::new(x.x + x.y + x.z, 0.0, 0.0);
    }
    let shapes = [
        (cloth(Vec2::ONE, UVec2::splat(20)), springs()),
        (cube(1.0, 5), Effects::from(NeoHookean::default())),
        (rod.clone(), Effects::from(Stretch::default())),
        (
            rod,
            Effects {
                rod: Some(Rod::default()),
                ..Effects::default()
            },
        ),
    ];
    for (shape, effects) in shapes {
        let x = middle(&shape);
        let mut body = with(body("cut", shape, 1.0), effects);
        let mut world = world_of(settings(0.0, 60.0, 10, 1), body.clone());
        world.tick();
        body = world.bodies.remove(0);
        let (mass, elements) = (total_mass(&body), carriers(&body.topology));
        assert!(body.cut(&slice(x)).is_some(), "the cut hits the body");
        check(&body, mass, elements);
        assert_eq!(pieces(&body.topology), 2);
        world.bodies.push(body);
        for _ in 0..5 {
            world.tick();
        }
        check(&world.bodies[0], mass, elements);
        let mut body = world.bodies.remove(0);
        assert!(body.cut(&slice(x)).is_none(), "it is cut already");
        assert!(
            body.cut(&slice(100.0)).is_none(),
            "a cut beside it changes nothing"
        );
    }
}

/// Number of connected pieces.
fn pieces(topology: &Topology) -> usize {
    let mut labels: Vec<u32> = (0..topology.particles() as u32).collect();
    loop {
        let mut changed = false;
        for [a, b] in topology.edges.ends() {
            let least = labels[a as usize].min(labels[b as usize]);
            for end in [a, b] {
                changed |= std::mem::replace(&mut labels[end as usize], least) != least;
            }
        }
        if !changed {
            return labels.into_iter().collect::<BTreeSet<_>>().len();
        }
    }
}

#[test]
fn copies_are_free_and_pins_stay_with_the_original() {
    let shape = cloth(Vec2::ONE, UVec2::splat(10));
    let pins: Vec<u32> = (0..121).collect();
    let mut body = pinned(body("cloth", shape, 1.0), &pins);
    let cut = Cut {
        eye: Vec3::new(0.0, 5.0, 0.01),
        rays: [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0)],
    };
    assert!(body.cut(&cut).is_some());
    let fixed = body
        .particles
        .positions
        .iter()
        .filter(|x| x.w == 0.0)
        .count();
    assert_eq!(fixed, 121);
    assert!(body.particles.len() > 121);
}

/// Strain limits, on springs and on triangles: a patch that is stretched beyond them comes apart,
/// one below holds.
#[test]
fn a_strain_limit_is_the_strain_at_which_elements_break() {
    for effects in [springs(), Effects::from(Membrane::default())] {
        for (stretched, breaks) in [(1.19, false), (1.21, true)] {
            let mut patch = with(
                body("patch", cloth(Vec2::ONE, UVec2::splat(8)), 1.0),
                effects,
            );
            patch.effects.bend = None;
            patch.effects.tear = Some(Tear {
                toughness: of::<Toughness>(f64::INFINITY),
                strain: of::<BreakingStrain>(0.2),
                ..Tear::default()
            });
            let all: Vec<u32> = (0..81).collect();
            patch = pinned(patch, &all);
            for i in 0..patch.particles.len() {
                let x = patch.particles.position(i);
                patch
                    .particles
                    .set_position(i, DVec3::new(x.x * stretched, x.y, x.z));
            }
            let mut world = world_of(settings(0.0, 60.0, 4, 1), patch);
            world.bodies[0].wake();
            world.tick();
            let tears = world.bodies[0].particles.len() > 81;
            assert_eq!(tears, breaks, "stretched to {stretched}");
        }
    }
}

#[test]
fn a_body_under_its_limits_keeps_its_bits() {
    let run = |tear: Option<Tear>| {
        let mut cloth = with(
            body("cloth", cloth(Vec2::ONE, UVec2::splat(16)), 0.2),
            springs(),
        );
        cloth.effects.tear = tear;
        let mut world = world_of(settings(9.81, 60.0, 10, 1), pinned(cloth, &[0]));
        world.settings.method = Method::default();
        for _ in 0..60 {
            world.tick();
        }
        world.state_hash()
    };
    let strong = Tear {
        toughness: of::<Toughness>(1e6),
        ..Tear::default()
    };
    assert_eq!(run(None), run(Some(strong)));
}
