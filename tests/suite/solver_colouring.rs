//! Colouring: what may be solved at the same time shares no particle.

use pliant::solver::colouring::{Colouring, MOST_COLOURS, colour};
use proptest::prelude::*;

/// Checks what every colouring promises.
fn check<const N: usize>(constraints: &[[u32; N]], particles: usize, colouring: &Colouring) {
    let mut sorted = colouring.order.clone();
    sorted.sort_unstable();
    let each_once: Vec<u32> = (0..constraints.len() as u32).collect();
    assert_eq!(sorted, each_once, "each constraint exactly once");

    let mut next = 0;
    for range in colouring.colours.iter().chain([&colouring.overflow]) {
        assert_eq!(range.start, next, "no gap between colours");
        next = range.end;
    }
    assert_eq!(next, constraints.len());

    for range in &colouring.colours {
        let mut touched = vec![false; particles];
        for &index in &colouring.order[range.clone()] {
            for &corner in &constraints[index as usize] {
                assert!(
                    !touched[corner as usize],
                    "a colour touches particle {corner} twice"
                );
                touched[corner as usize] = true;
            }
        }
    }
}

/// Constraints of `N` different particles out of `particles`.
fn constraints<const N: usize>(particles: u32) -> impl Strategy<Value = Vec<[u32; N]>> {
    let one = proptest::array::uniform(0..particles)
        .prop_filter("different", |corners: &[u32; N]| {
            (0..N).all(|i| !corners[..i].contains(&corners[i]))
        });
    proptest::collection::vec(one, 0..300)
}

proptest! {
    #[test]
    fn no_two_edges_of_a_colour_share_a_particle_and_each_is_solved_once(
        edges in constraints::<2>(40),
    ) {
        let colouring = colour(&edges, 40);
        check(&edges, 40, &colouring);
        prop_assert_eq!(colouring, colour(&edges, 40));
    }

    #[test]
    fn no_two_tetrahedra_of_a_colour_share_a_particle_and_each_is_solved_once(
        tetrahedra in constraints::<4>(60),
    ) {
        let colouring = colour(&tetrahedra, 60);
        check(&tetrahedra, 60, &colouring);
        prop_assert_eq!(colouring, colour(&tetrahedra, 60));
    }
}

#[test]
fn a_star_of_ten_thousand_edges_is_coloured_and_the_rest_overflows() {
    let edges: Vec<[u32; 2]> = (1..=10_000).map(|tip| [0, tip]).collect();
    let colouring = colour(&edges, 10_001);
    check(&edges, 10_001, &colouring);
    assert_eq!(colouring.colours.len(), MOST_COLOURS);
    assert_eq!(colouring.overflow.len(), 10_000 - MOST_COLOURS);
}

#[test]
fn nothing_to_colour_gives_no_colours() {
    let colouring = colour::<2>(&[], 0);
    assert!(colouring.colours.is_empty() && colouring.overflow.is_empty());
}
