//! Named groups of vertices: forces act on them alone, and particles stay in them whatever renumbers
//! or copies them.

use crate::support::{
    body_of_masses, chain, pinned, settings, state_bits, stretch, topology, with, world,
};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Cut, Effects, Finite, ForceMask, Fraction, Group, GroupName, Groups, ParticleIndex,
        RestShape, Topology, TopologyError, Uniform, VertexIndex, reference,
        topology::{Birth, Renewal, numbering::Numbering},
    },
};

const SAIL: GroupName = GroupName::of("sail");
const TAIL: GroupName = GroupName::of("tail");

fn group(name: GroupName, vertices: impl IntoIterator<Item = u32>) -> Group {
    Group {
        name,
        vertices: vertices.into_iter().collect(),
    }
}

fn cloth() -> RestShape {
    let primitive = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(8),
        diagonals: Default::default(),
        shear: true,
    };
    primitive.build().expect("sound").shape
}

fn masked(mask: ForceMask) -> Effects {
    Effects {
        force_mask: Some(mask),
        ..Uniform {
            x: Finite::of(3.0),
            y: Finite::of(-4.0),
            ..Uniform::default()
        }
        .into()
    }
}

fn of(group: GroupName) -> ForceMask {
    ForceMask {
        group,
        ..ForceMask::default()
    }
}

/// The particles of a group.
fn members(groups: &Groups, name: GroupName) -> Vec<u32> {
    groups.particles(name).map(|it| it.0).collect()
}

/// A cut through a level cloth along z, beside its middle.
const CUT: Cut = Cut {
    eye: Vec3::new(0.01, 9.0, 0.0),
    rays: [Vec3::new(0.0, -1.0, -1.0), Vec3::new(0.0, -1.0, 1.0)],
};

#[test]
fn only_the_particles_of_the_group_accelerate() {
    let shape = RestShape {
        groups: vec![group(TAIL, 0..4), group(SAIL, [9, 2, 7, 7])],
        ..chain(10, 0.1)
    };
    let loose = with(body_of_masses(shape, &[1.0; 11]), masked(of(SAIL)));
    let mut fast = world(settings(0.0, 60.0, 10, 1), loose);
    let mut plain = reference::World::of(&fast);
    for _ in 0..30 {
        fast.tick();
        plain.tick();
    }
    let moving = DVec3::new(3.0, -4.0, 0.0) * 0.5;
    for i in 0..11 {
        let v = [
            fast.bodies[0].particles.velocity_f64(i),
            plain.bodies[0].v[i],
        ];
        if ![2, 7, 9].contains(&i) {
            assert_eq!(v, [DVec3::ZERO; 2], "particle {i}");
            continue;
        }
        // v = a t. In f32, v is rounded in each of 300 substeps by half an ulp of a place below two
        // meters over h, 3.6e-5 m/s: at most 1.1e-2 m/s, and that in f64 5e8 times finer.
        for (v, tolerance) in v.into_iter().zip([1.1e-2, 1e-10]) {
            assert!(v.distance(moving) < tolerance, "particle {i}: {v} m/s");
        }
    }
}

#[test]
fn the_weight_is_that_of_the_box_within_the_group() {
    let shape = RestShape {
        groups: vec![group(SAIL, (0..81).filter(|i| i % 3 != 0))],
        ..cloth()
    };
    let topology = topology(shape);
    let boxed = ForceMask {
        low_x: Fraction::of(0.3),
        high_z: Fraction::of(0.6),
        fade: Fraction::of(0.4),
        ..ForceMask::default()
    };
    let weights = |mask: ForceMask| -> Vec<f64> { (0..81).map(mask.weights(&topology)).collect() };
    let (whole, part) = (
        weights(boxed),
        weights(ForceMask {
            group: SAIL,
            ..boxed
        }),
    );
    for (i, (whole, part)) in (0..81).zip(whole.iter().zip(&part)) {
        let is_in = !topology.vertex(i).0.is_multiple_of(3);
        assert_eq!(*part, if is_in { *whole } else { 0.0 }, "particle {i}");
    }
    assert!(part.iter().any(|weight| (0.1..0.9).contains(weight)));
    assert!(ForceMask::default().is_whole() && !of(SAIL).is_whole());
    // Never the whole body instead of a group that does not exist.
    assert_eq!(weights(of(TAIL)), [0.0; 81]);
}

#[test]
fn a_force_on_a_group_does_what_the_reference_does() {
    let shape = RestShape {
        groups: vec![group(SAIL, 40..60)],
        ..cloth()
    };
    let effects = Effects {
        stretch: stretch(1e-5),
        ..masked(of(SAIL))
    };
    let masses = vec![0.01; 81];
    let cloth = pinned(with(body_of_masses(shape, &masses), effects), &[0]);
    let mut fast = world(settings(9.81, 60.0, 8, 2), cloth);
    let mut plain = reference::World::of(&fast);
    let mut whole = reference::World::of(&fast);
    whole.bodies[0].effects.force_mask = None;
    for _ in 0..15 {
        fast.tick();
        plain.tick();
        whole.tick();
    }
    let far = |x: &dyn Fn(usize) -> DVec3| {
        let each = plain.bodies[0].x.iter().enumerate();
        each.fold(0.0_f64, |most, (i, other)| most.max(other.distance(x(i))))
    };
    let deviation = far(&|i| fast.bodies[0].particles.position(i));
    // 120 substeps of 2 iterations round displacements of up to 3 cm by a relative 6e-8.
    assert!(deviation < 1e-6, "off by {deviation} m");
    assert!(far(&|i| whole.bodies[0].x[i]) > 1e-2, "the group matters");
}

/// A cut separates what is in the group from its copies: each is in it as its origin was.
#[test]
fn copies_of_a_cut_stay_in_the_groups_of_their_origin() {
    let is_in = |x: Vec3| x.z < -1e-4;
    let flat = cloth();
    let inside = (0..81).filter(|i| is_in(flat.vertices[*i as usize]));
    let shape = RestShape {
        groups: vec![group(TAIL, []), group(SAIL, inside)],
        ..flat
    };
    let effects = Effects {
        stretch: stretch(1e-5),
        ..masked(of(SAIL))
    };
    let mut cut = with(body_of_masses(shape, &[0.01; 81]), effects);
    cut.cut(&CUT).expect("it crosses the cloth");
    let after = &cut.topology;
    let count = after.particles();
    assert!(count >= 81 + 7, "{count} particles");
    let expected = (0..count as u32).filter(|i| is_in(after.rest[*i as usize]));
    let expected: Vec<u32> = expected.collect();
    assert_eq!(members(&after.groups, SAIL), expected);
    assert!(expected.len() > 36, "copies are in it");
    assert!(members(&after.groups, TAIL).is_empty());

    // From its shape and order, as in a snapshot.
    let order = after.torn_order().expect("it is torn");
    let numbering = Numbering::clone(&after.numbering);
    let again = Topology::torn(after.rest_shape(), numbering, &order).expect("sound");
    assert_eq!(again.groups, after.groups);

    let mut world = world(settings(0.0, 60.0, 10, 1), cut);
    world.bodies[0].effects.stretch = None;
    world.tick();
    let body = &world.bodies[0];
    for (i, x) in body.topology.rest.iter().enumerate() {
        let expected = if is_in(*x) { -4.0 / 60.0 } else { 0.0 };
        let speed = body.particles.velocity_f64(i).y;
        // Ten substeps that round velocities by half an ulp of a meter over h, 3.6e-5 m/s.
        assert!((speed - expected).abs() < 3.6e-4, "{x}: {speed} m/s");
    }
}

/// A rope whose vertices are in an order that the solver does not keep.
#[test]
fn groups_follow_the_numbering_of_the_particles() {
    const COUNT: u32 = 4001;
    let vertex = |along: u32| along * 77 % COUNT;
    let mut vertices = vec![Vec3::ZERO; COUNT as usize];
    for along in 0..COUNT {
        vertices[vertex(along) as usize] = Vec3::X * (0.01 * along as f32);
    }
    let shape = RestShape {
        vertices,
        edges: (1..COUNT)
            .map(|along| [vertex(along - 1), vertex(along)])
            .collect(),
        groups: vec![group(SAIL, (0..100).map(vertex)), group(TAIL, [vertex(99)])],
        ..RestShape::default()
    };
    let topology = Topology::new(shape.clone()).expect("sound");
    assert!(
        !topology.numbering.vertices().is_empty(),
        "it is renumbered"
    );
    let near = (0..COUNT).filter(|i| topology.rest[*i as usize].x < 0.995);
    assert_eq!(members(&topology.groups, SAIL), near.collect::<Vec<_>>());
    let tail = topology.particle(VertexIndex(vertex(99))) as u32;
    assert_eq!(members(&topology.groups, TAIL), [tail]);

    let again = Topology::numbered(topology.rest_shape(), topology.numbering.clone());
    assert!(again.expect("sound") == topology);
    let mut grown = Topology::new(RestShape {
        groups: shape.groups[..1].to_vec(),
        ..shape
    })
    .expect("sound");
    let added = grown.add_group(TAIL, [VertexIndex(vertex(99))]);
    assert_eq!(added, Ok(()));
    assert!(grown == topology);
}

#[test]
fn grains_that_stay_keep_their_groups_and_new_ones_have_none() {
    let grains = topology(RestShape {
        vertices: (0..4).map(|i| Vec3::X * i as f32).collect(),
        radii: vec![0.1; 4],
        groups: vec![group(SAIL, [0, 1, 2])],
        ..RestShape::default()
    });
    let birth = Birth {
        position: DVec3::Y,
        velocity: DVec3::ZERO,
        radius: 0.1,
    };
    let renewal = Renewal {
        kept: vec![1, 2, 3],
        births: vec![birth],
    };
    let renewed = grains.renewed(&renewal).expect("grains are left");
    let groups = &renewed.topology.groups;
    assert_eq!(groups.names(), [SAIL]);
    assert_eq!(members(groups, SAIL), [0, 1]);
    // Grains cannot be masked.
    let weights = of(SAIL).weights(&renewed.topology);
    assert_eq!([0, 1, 2, 3].map(weights), [1.0; 4]);
}

#[test]
fn a_body_without_groups_pays_nothing_and_has_none() {
    let plain = topology(cloth());
    assert!(plain.groups.is_empty());
    assert_eq!(plain.groups.bytes(), 0);
    assert_eq!(plain.groups.particles(SAIL).next(), None::<ParticleIndex>);
}

#[test]
fn invalid_groups_are_refused() {
    let error =
        |groups: Vec<Group>| Topology::new(RestShape { groups, ..cloth() }).expect_err("invalid");
    let numbered = |i: u32| GroupName::new(&format!("group {i}")).expect("short");
    let many = |count| (0..count).map(|i| group(numbered(i), [i])).collect();
    let thirty_two = Topology::new(RestShape {
        groups: many(32),
        ..cloth()
    });
    let groups = thirty_two.expect("a bit for each").groups;
    assert_eq!(members(&groups, numbered(31)), [31]);
    assert_eq!(error(many(33)), TopologyError::TooManyGroups(33));
    assert_eq!(
        error(vec![group(SAIL, [0]), group(GroupName::default(), [0])]),
        TopologyError::UnnamedGroup(1)
    );
    assert_eq!(
        error(vec![group(SAIL, [0]), group(SAIL, [1])]),
        TopologyError::RepeatedGroup(SAIL)
    );
    let missing = error(vec![group(TAIL, [80, 81])]);
    assert_eq!(
        missing.to_string(),
        "group “tail” refers to vertex 81; expected 0 to 80"
    );
}

#[test]
fn names_are_short_texts() {
    // Two bytes each.
    let longest = "é".repeat(15) + "!";
    let name = GroupName::new(&longest).expect("31 bytes");
    assert_eq!(name.as_str(), longest);
    let text = ron::to_string(&name).expect("a text");
    assert_eq!(ron::from_str(&text), Ok(name));
    for wrong in [longest + "!", "two\nlines".to_owned()] {
        let error = GroupName::new(&wrong).expect_err("invalid").to_string();
        assert!(error.contains("31 bytes"), "{error}");
        assert!(ron::from_str::<GroupName>(&format!("{wrong:?}")).is_err());
    }
}

/// A mask of a group of all particles has the bits of no mask.
#[test]
fn a_group_of_all_has_the_bits_of_no_mask() {
    let swung = |mask: Option<ForceMask>| {
        let shape = RestShape {
            groups: vec![group(SAIL, 0..81)],
            ..cloth()
        };
        let effects = Effects {
            stretch: stretch(1e-5),
            force_mask: mask,
            ..masked(ForceMask::default())
        };
        let cloth = pinned(with(body_of_masses(shape, &[0.01; 81]), effects), &[0]);
        let mut world = world(settings(9.81, 60.0, 8, 2), cloth);
        (0..10).for_each(|_| world.tick());
        state_bits(&world.bodies[0].particles)
    };
    assert_eq!(swung(Some(of(SAIL))), swung(None));
    assert_ne!(swung(Some(of(TAIL))), swung(None));
}
