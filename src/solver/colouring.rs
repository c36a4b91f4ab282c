//! Colouring of constraints: no two of a colour share a particle.
//!
//! Greedy in the order given, so that the same input gives the same colours everywhere. What no
//! colour takes (a particle in more constraints than there are colours) goes to one last group
//! that is to be solved one at a time.

use std::ops::Range;

/// Colours at most; a particle in more constraints than this sends the rest to the overflow.
pub const MOST_COLOURS: usize = 64;

/// The order in which constraints are to be solved, grouped by colour.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Colouring {
    /// Indices of the constraints as given, colour by colour; each exactly once.
    pub order: Vec<u32>,
    /// A range of `order` for each colour; no two constraints in it share a particle.
    pub colours: Vec<Range<usize>>,
    /// What no colour took: a range of `order` at its end, solved one at a time.
    pub overflow: Range<usize>,
}

/// Colours constraints that touch `N` particles each, of `particles` in all.
#[must_use]
pub fn colour<const N: usize>(constraints: &[[u32; N]], particles: usize) -> Colouring {
    let mut taken = vec![0_u64; particles];
    let mut chosen = Vec::with_capacity(constraints.len());
    let mut counts = [0_usize; MOST_COLOURS + 1];
    for corners in constraints {
        let used = corners
            .iter()
            .fold(0, |used, &corner| used | taken[corner as usize]);
        let free = used.trailing_ones() as usize;
        if free < MOST_COLOURS {
            for &corner in corners {
                taken[corner as usize] |= 1 << free;
            }
        }
        chosen.push(free as u8);
        counts[free] += 1;
    }

    let mut starts = [0_usize; MOST_COLOURS + 1];
    for colour in 1..=MOST_COLOURS {
        starts[colour] = starts[colour - 1] + counts[colour - 1];
    }
    let ranges: Vec<_> = (0..=MOST_COLOURS)
        .map(|colour| starts[colour]..starts[colour] + counts[colour])
        .collect();
    let mut order = vec![0; constraints.len()];
    for (index, &colour) in chosen.iter().enumerate() {
        let slot = &mut starts[colour as usize];
        order[*slot] = index as u32;
        *slot += 1;
    }
    Colouring {
        order,
        colours: ranges[..MOST_COLOURS]
            .iter()
            .filter(|range| !range.is_empty())
            .cloned()
            .collect(),
        overflow: ranges[MOST_COLOURS].clone(),
    }
}
