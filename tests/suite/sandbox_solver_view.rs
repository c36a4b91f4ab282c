//! Pure functions of the solver view: position of a constraint, its tint, and the sentence.

use crate::support;
use bevy::color::{LinearRgba, Oklaba};
use glam::{UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    sandbox::{
        render::solver_view::{
            legend::sentence,
            place::{Kinds, Slot, Summary, Turn, places},
        },
        state::view::SolverView,
    },
    solver::{
        RestShape, Topology,
        kernel::WIDTH,
        topology::{coloring::MAX_COLORS, order::Elements},
    },
};
use std::collections::BTreeMap;

const EDGES: Kinds = Kinds {
    edges: true,
    tetrahedra: false,
    struts: false,
};

const BOTH: Kinds = Kinds {
    tetrahedra: true,
    ..EDGES
};

fn cloth() -> Topology {
    let shape = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(63),
        diagonals: Default::default(),
        shear: true,
    };
    Topology::new(shape.build().expect("sound").shape).expect("sound")
}

fn block() -> Topology {
    let shape = Primitive::Box {
        size: Vec3::ONE,
        cells: UVec3::splat(6),
    };
    Topology::new(shape.build().expect("sound").shape).expect("sound")
}

/// One particle in the center of more edges than there are colors.
fn star() -> Topology {
    let rays = MAX_COLORS as u32 + 10;
    let at = |i: u32| Vec3::new((i % 12) as f32, (i / 12) as f32, 0.0);
    Topology::new(RestShape {
        vertices: (0..=rays).map(at).collect(),
        edges: (1..=rays).map(|ray| [0, ray]).collect(),
        ..RestShape::default()
    })
    .expect("sound")
}

/// Constraints that are solved at the same time share no particle, and no lane is used twice.
fn check<const N: usize>(topology: &Topology, elements: &Elements<N>) {
    let places = places(elements);
    assert_eq!(places.len(), elements.corners().len());
    let mut blocks: BTreeMap<(usize, usize), Vec<(usize, [u32; N])>> = BTreeMap::new();
    let mut touched = BTreeMap::new();
    for (index, (place, corners)) in places.iter().zip(elements.corners()).enumerate() {
        let Some(Turn { partition, color }) = place.turn else {
            continue;
        };
        assert_eq!(topology.partitions.partition_of(&corners), Some(partition));
        blocks
            .entry((partition, color))
            .or_default()
            .push((place.lane, corners));
        for corner in corners {
            let other = touched.insert((partition, color, corner), index);
            assert_eq!(other, None, "constraint {index} shares particle {corner}");
        }
    }
    for ((partition, color), lanes) in blocks {
        for (index, (lane, corners)) in lanes.into_iter().enumerate() {
            // The lowest strip of a corner, or the next lane of a block.
            let strip = elements.strips().and_then(|strips| {
                let lanes = corners.iter().map(|&corner| strips.place(corner).lane());
                lanes.min()
            });
            assert_eq!(
                lane,
                strip.unwrap_or(index % WIDTH),
                "in color {color} of partition {partition}"
            );
        }
    }
}

#[test]
fn a_place_says_what_is_solved_together() {
    let (cloth, block) = (cloth(), block());
    assert!(cloth.partitions.count() > 1, "it is large enough to be cut");
    check(&cloth, &cloth.edges.elements);
    check(&block, &block.edges.elements);
    check(&block, &block.tetrahedra.elements);
}

#[test]
fn overflow_constraints_have_no_turn_and_are_white() {
    let star = star();
    let places = places(&star.edges.elements);
    let overflow: Vec<&Slot> = places.iter().filter(|place| place.turn.is_none()).collect();
    assert_eq!(overflow.len(), 10);
    for place in overflow {
        for view in [SolverView::Partitions, SolverView::Colors] {
            assert_eq!(place.tint(view, 3), Vec3::ONE);
        }
    }
}

/// Distance of two colors in Oklab; 0.02 is just noticeable.
fn difference(a: Vec3, b: Vec3) -> f32 {
    let oklab = |color: Vec3| {
        let color = Oklaba::from(LinearRgba::rgb(color.x, color.y, color.z));
        Vec3::new(color.lightness, color.a, color.b)
    };
    oklab(a).distance(oklab(b))
}

#[test]
fn neighbors_have_distinguishable_colors() {
    let place = |partition, color, lane| Slot {
        turn: Some(Turn { partition, color }),
        lane,
    };
    for n in 0..200 {
        // Partitions are adjacent; a constraint's neighbors have the colors next to its own.
        for other in n + 1..n + 4 {
            let partitions =
                [n, other].map(|partition| place(partition, 0, 0).tint(SolverView::Partitions, 0));
            assert!(
                difference(partitions[0], partitions[1]) > 0.1,
                "bands {n}, {other}"
            );
            let colors = [n, other].map(|color| place(0, color, 0).tint(SolverView::Colors, 0));
            assert!(
                difference(colors[0], colors[1]) > 0.1,
                "colors {n}, {other}"
            );
        }
    }
    for lane in 0..WIDTH {
        for other in 0..lane {
            let lanes = [lane, other].map(|lane| place(0, 0, lane).tint(SolverView::Lanes, 0));
            assert!(
                difference(lanes[0], lanes[1]) > 0.1,
                "lanes {lane}, {other}"
            );
        }
    }
}

#[test]
fn each_view_shows_its_own_and_partitions_are_counted_on_from_body_to_body() {
    let place = |partition, color, lane| Slot {
        turn: Some(Turn { partition, color }),
        lane,
    };
    let same = |view, a: Slot, b: Slot| assert_eq!(a.tint(view, 0), b.tint(view, 0));
    same(SolverView::Partitions, place(2, 0, 0), place(2, 5, 7));
    same(SolverView::Colors, place(0, 4, 0), place(9, 4, 7));
    same(SolverView::Lanes, place(0, 0, 6), place(9, 4, 6));
    let second = place(0, 0, 0).tint(SolverView::Partitions, 2);
    assert_eq!(second, place(2, 0, 0).tint(SolverView::Partitions, 0));
    assert_eq!(
        place(0, 3, 0).tint(SolverView::Colors, 2),
        place(0, 3, 0).tint(SolverView::Colors, 0)
    );
}

#[test]
fn the_summary_counts_what_is_solved() {
    let tetrahedron = Topology::new(support::tetrahedron()).expect("sound");
    let all = Summary::of(&tetrahedron, BOTH);
    assert_eq!((all.bodies, all.partitions, all.overflow), (1, 1, 0));
    // Six edges, each of which shares no particle with one other: three colors of two.
    assert_eq!((all.edges.constraints, all.edges.colors), (6, 3));
    assert_eq!(all.edges.fraction(), Some(6.0 / 24.0));
    assert_eq!(all.tetrahedra.fraction(), Some(1.0 / 8.0));
    let edges = Summary::of(&tetrahedron, EDGES);
    assert_eq!(edges.tetrahedra.fraction(), None, "volume is off");
    let both = all.and(edges);
    assert_eq!((both.bodies, both.partitions), (2, 2));
    assert_eq!(both.edges.constraints, 12);
    assert_eq!(both.tetrahedra, all.tetrahedra);
}

#[test]
fn the_sentence_says_how_many_and_how_full() {
    let tetrahedron = Topology::new(support::tetrahedron()).expect("sound");
    let summary = Summary::of(&tetrahedron, BOTH);
    let says = |view, words: &[&str]| {
        let text = sentence(view, &summary);
        for word in words {
            assert!(text.contains(word), "“{word}” is missing: {text}");
        }
        assert!(!text.contains("white"), "nothing overflows: {text}");
    };
    says(SolverView::Partitions, &["1 partition in 1 body"]);
    says(SolverView::Colors, &["edges 3, tetrahedra 1."]);
    says(SolverView::Lanes, &["edges 25 %, tetrahedra 12 %."]);
    let star = Summary::of(&star(), EDGES);
    let text = sentence(SolverView::Colors, &star);
    assert!(
        text.contains("10 constraints are in no partition"),
        "{text}"
    );
}
