//! The order of constraints: those that may be solved at the same time share no particle.

use crate::support;
use glam::{UVec2, UVec3, Vec2, Vec3};
use pliant::solver::deform::Random;
use pliant::{
    mesh::Primitive,
    solver::{
        Effects, RestShape, Topology, World,
        deform::{Deformation, deform},
        measure,
        topology::{
            coloring::MAX_COLORS,
            order::{Elements, Painting},
            partitions::{MIN_CUT, Partitions},
        },
    },
};
use proptest::prelude::*;

/// Lowest and highest particle of each constraint.
fn reaches<const N: usize>(constraints: &[[u32; N]]) -> impl Iterator<Item = (u32, u32)> {
    constraints.iter().map(|corners| {
        let (low, high) = (corners.iter().min(), corners.iter().max());
        (*low.expect("corners"), *high.expect("corners"))
    })
}

fn order<const N: usize>(
    constraints: &[[u32; N]],
    particles: usize,
    odd_first: bool,
) -> (Partitions, Elements<N>, Vec<u32>) {
    let partitions = Partitions::cut(particles, reaches(constraints), None);
    let (elements, stored) = Elements::new(
        constraints,
        &partitions,
        Painting {
            odd_first,
            scattered: odd_first,
        },
    );
    (partitions, elements, stored)
}

/// Checks the invariants of every order.
fn check<const N: usize>(
    constraints: &[[u32; N]],
    partitions: &Partitions,
    elements: &Elements<N>,
) {
    let mut given = constraints.to_vec();
    let mut stored = elements.corners().collect::<Vec<_>>();
    given.sort_unstable();
    stored.sort_unstable();
    assert_eq!(given, stored, "each constraint exactly once");

    let mut next = 0;
    let mut touched = vec![0; partitions.particles()];
    let mut round = 0;
    for batch in elements.batches() {
        assert_eq!(batch.constraints().start, next, "no gap between batches");
        for (first, group) in elements.groups(batch) {
            assert_eq!(first, next, "no gap between colors");
            next += group.len();
            round += 1;
            for corner in group.as_flattened() {
                let corner = corner.particle() as usize;
                let last = std::mem::replace(&mut touched[corner], round);
                assert_ne!(last, round, "a color touches particle {corner} twice");
                assert!(batch.particles().contains(&corner));
            }
        }
        assert_eq!(batch.constraints().end, next);
    }
    assert_eq!(next, constraints.len());

    for odd in [false, true] {
        let mut end = 0;
        for piece in partitions.pieces(odd) {
            assert_eq!(
                piece.particles.start, end,
                "pieces share no particle and leave none out"
            );
            end = piece.particles.end;
            let Some(partition) = piece.partition else {
                continue;
            };
            let batch = &elements.batches()[elements.batch_of(partition)];
            assert_eq!(batch.partition(), Some(partition));
            let reach = batch.particles();
            assert!(
                reach.is_empty()
                    || piece.particles.start <= reach.start && reach.end <= piece.particles.end,
                "partition {partition} reaches {reach:?}, beyond its piece {:?}",
                piece.particles
            );
        }
        assert_eq!(end, partitions.particles());
    }
}

/// Constraints of `N` different particles out of `particles`, most of them near each other.
fn constraints<const N: usize>(
    particles: u32,
    most: usize,
) -> impl Strategy<Value = Vec<[u32; N]>> {
    let near = (0..particles, proptest::array::uniform::<_, N>(0..64_u32))
        .prop_map(move |(first, offsets)| offsets.map(|offset| (first + offset) % particles));
    let one = prop_oneof![9 => near, 1 => proptest::array::uniform(0..particles)]
        .prop_filter("different", |corners: &[u32; N]| {
            (0..N).all(|i| !corners[..i].contains(&corners[i]))
        });
    proptest::collection::vec(one, 0..most)
}

proptest! {
    #[test]
    fn no_two_edges_of_a_color_share_a_particle_and_each_is_solved_once(
        edges in constraints::<2>(40, 300),
        odd_first: bool,
    ) {
        let (partitions, elements, stored) = order(&edges, 40, odd_first);
        check(&edges, &partitions, &elements);
        prop_assert_eq!(partitions.count(), 1);
        prop_assert_eq!(stored, order(&edges, 40, odd_first).2);
    }

    #[test]
    fn no_two_tetrahedra_of_a_color_share_a_particle_and_each_is_solved_once(
        tetrahedra in constraints::<4>(60, 300),
        odd_first: bool,
    ) {
        let (partitions, elements, _) = order(&tetrahedra, 60, odd_first);
        check(&tetrahedra, &partitions, &elements);
    }

    #[test]
    fn large_bodies_are_cut_so_that_every_second_partition_is_apart(
        tetrahedra in constraints::<4>(MIN_CUT as u32 + 500, 4000),
        odd_first: bool,
    ) {
        let (partitions, elements, _) = order(&tetrahedra, MIN_CUT + 500, odd_first);
        check(&tetrahedra, &partitions, &elements);
    }

    #[test]
    fn constraints_that_come_and_go_leave_a_valid_order_and_the_others_in_theirs(
        edges in constraints::<2>(300, 900),
        added in constraints::<2>(300, 60),
        seed: u32,
    ) {
        let (partitions, before, _) = order(&edges, 300, false);
        let mut random = Random::new(seed);
        let removed: Vec<usize> =
            (0..edges.len()).filter(|_| random.next() < 0.1).collect();
        let old: Vec<[u32; 2]> = before.corners().collect();
        let corners = |index: usize| (!removed.contains(&index)).then(|| old[index]);
        let (after, from) = before.edited(corners, &added, &partitions);
        let stored: Vec<[u32; 2]> = after.corners().collect();
        prop_assert_eq!(Elements::colored(&stored, &partitions, &after.colors()), Some(after.clone()));

        let stays = (0..edges.len()).filter(|index| !removed.contains(index));
        let mut expected: Vec<[u32; 2]> = stays.map(|index| old[index]).collect();
        expected.extend(&added);
        check(&expected, &partitions, &after);
        for (corners, &from) in after.corners().zip(&from) {
            let old = old.get(from as usize);
            prop_assert_eq!(&corners, old.unwrap_or_else(|| &added[from as usize - edges.len()]));
        }
    }
}

#[test]
fn a_star_of_ten_thousand_edges_is_colored_and_the_rest_overflows() {
    let edges: Vec<[u32; 2]> = (1..=10_000).map(|tip| [0, tip]).collect();
    let (partitions, elements, _) = order(&edges, 10_001, false);
    check(&edges, &partitions, &elements);
    let overflow = &elements.batches()[elements.overflow().expect("more edges than colors")];
    assert_eq!(overflow.constraints().len(), 10_000 - MAX_COLORS);
}

#[test]
fn nothing_to_order_gives_no_constraints() {
    let (partitions, elements, stored) = order::<2>(&[], 0, false);
    check(&[], &partitions, &elements);
    assert!(stored.is_empty() && elements.overflow().is_none());
}

/// Meshes of every kind, from one tetrahedron to some hundred thousand.
fn shapes() -> Vec<RestShape> {
    let solid = |cells: u32| Primitive::Box {
        size: Vec3::ONE,
        cells: UVec3::splat(cells),
    };
    let cloth = |cells: u32| Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(cells),
        diagonals: Default::default(),
        shear: true,
    };
    let mut shapes: Vec<RestShape> = [solid(1), solid(4), solid(30), cloth(20), cloth(199)]
        .iter()
        .map(|primitive| primitive.build().expect("sound").shape)
        .collect();
    // Two disconnected pieces.
    let mut both = shapes[2].clone();
    let other = shapes[2].clone();
    let first = both.vertices.len() as u32;
    both.vertices.extend(&other.vertices);
    both.edges
        .extend(other.edges.iter().map(|e| e.map(|i| i + first)));
    both.tetrahedra
        .extend(other.tetrahedra.iter().map(|t| t.map(|i| i + first)));
    shapes.push(both);
    shapes
}

#[test]
fn meshes_of_every_size_and_in_several_pieces_are_ordered() {
    for shape in shapes() {
        let topology = Topology::new(shape).expect("sound");
        let ends = topology.edges.ends().collect::<Vec<_>>();
        check(&ends, &topology.partitions, &topology.edges.elements);
        let corners = topology.tetrahedra.corners().collect::<Vec<_>>();
        check(
            &corners,
            &topology.partitions,
            &topology.tetrahedra.elements,
        );
    }
}

/// Fraction of the lanes of all blocks that hold a constraint.
fn filled<const N: usize>(elements: &Elements<N>) -> f64 {
    let groups = || {
        elements
            .batches()
            .iter()
            .flat_map(|batch| elements.groups(batch))
    };
    let used: usize = groups().map(|(_, group)| group.len()).sum();
    let blocks: usize = groups().map(|(_, group)| group.len().div_ceil(8)).sum();
    used as f64 / (8 * blocks) as f64
}

#[test]
fn few_lanes_stay_empty() {
    for shape in shapes().into_iter().skip(2) {
        let topology = Topology::new(shape).expect("sound");
        let edges = filled(&topology.edges.elements);
        assert!(edges > 0.9, "only {edges} of the lanes of edges are filled");
        if topology.tetrahedra.corners().len() > 0 {
            let tetrahedra = filled(&topology.tetrahedra.elements);
            assert!(
                tetrahedra > 0.9,
                "only {tetrahedra} of the lanes of tetrahedra are filled"
            );
        }
    }
}

#[test]
fn a_mesh_in_any_order_of_vertices_is_cut_into_partitions_and_keeps_the_numbers_of_its_vertices() {
    let mut shape = shapes().swap_remove(2);
    let count = shape.vertices.len() as u32;
    // 7919 is prime, so that each number occurs once.
    let shuffled = |i: u32| (i * 7919 + 13) % count;
    let given = shape.vertices.clone();
    for (i, &x) in (0..).zip(&given) {
        shape.vertices[shuffled(i) as usize] = x;
    }
    for corner in shape.edges.as_flattened_mut() {
        *corner = shuffled(*corner);
    }
    for corner in shape.tetrahedra.as_flattened_mut() {
        *corner = shuffled(*corner);
    }
    for corner in shape.triangles.as_flattened_mut() {
        *corner = shuffled(*corner);
    }
    let vertices = shape.vertices.clone();
    let edges: Vec<_> = shape.edges.iter().map(sorted).collect();
    let topology = Topology::new(shape).expect("sound");
    assert!(
        topology.partitions.count() >= 8,
        "only {} partitions",
        topology.partitions.count()
    );
    for particle in 0..count {
        let vertex = topology.vertex(particle as usize);
        assert_eq!(topology.rest[particle as usize], vertices[vertex.index()]);
        assert_eq!(topology.particle(vertex), particle as usize);
    }
    let mut back: Vec<_> = topology
        .edges
        .ends()
        .map(|ends| sorted(&ends.map(|particle| topology.vertex(particle as usize).0)))
        .collect();
    let mut edges = edges;
    back.sort_unstable();
    edges.sort_unstable();
    assert_eq!(back, edges);
}

fn sorted(ends: &[u32; 2]) -> [u32; 2] {
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

/// A free flat sheet, rigid and barely stretched, with this number of cells per side.
fn sheet(cells: u32, shear: bool) -> World {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(cells),
        diagonals: Default::default(),
        shear,
    };
    let shape = cloth.build().expect("a cloth").shape;
    let effects = Effects {
        stretch: support::stretch(0.0),
        ..Effects::default()
    };
    let mut body = support::with(support::body("sheet", shape, 0.2), effects);
    deform(&mut body.particles, Deformation::Scale(1.0005));
    support::world(support::settings(0.0, 60.0, 10, 1), body)
}

/// An iteration in an order of slanted color domains is unstable: from the second to the fourth
/// second, these two grew by factors of e⁵ and e³. In a stable order, the motion decays.
#[test]
fn a_free_flat_sheet_does_not_gather_speed() {
    for (cells, shear) in [(33, true), (63, false)] {
        let mut world = sheet(cells, shear);
        let mut speed_after = |seconds: f64| {
            support::run(&mut world, seconds);
            measure::rms_speed(&world.bodies[0].particles)
        };
        let (early, late) = (speed_after(1.0), speed_after(3.0));
        assert!(late < early, "{cells}: {early} m/s, then {late} m/s");
    }
}
