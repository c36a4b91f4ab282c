//! Colouring of constraints: no two of a colour share a particle.
//!
//! Greedy in the order given, so that the same input gives the same colours everywhere.

/// Colours at most; a particle in more constraints than this leaves the rest loose.
pub const MAX_COLOURS: usize = 128;

/// Colours sets of constraints, one after the other.
#[derive(Debug)]
pub struct Painter {
    /// Colours that touch a particle, a bit each.
    taken: Vec<u128>,
    degree: Vec<u32>,
}

impl Painter {
    /// For constraints on so many particles.
    #[must_use]
    pub fn new(particles: usize) -> Self {
        Self {
            taken: vec![0; particles],
            degree: vec![0; particles],
        }
    }

    /// Colours the `members` of `constraints`: returns them colour by colour, and appends what no
    /// colour takes to `loose`.
    pub fn paint<const N: usize>(
        &mut self,
        constraints: &[[u32; N]],
        members: &[u32],
        loose: &mut Vec<u32>,
    ) -> Vec<Vec<u32>> {
        let mut busiest = 0;
        for &member in members {
            for &corner in &constraints[member as usize] {
                let degree = &mut self.degree[corner as usize];
                *degree += 1;
                busiest = busiest.max(*degree as usize);
            }
        }
        // A colour is full at a multiple of the lanes, so that few blocks have idle ones.
        let colours = (busiest + busiest / 4 + 1).min(MAX_COLOURS);
        let capacity = members.len().div_ceil(colours).next_multiple_of(8);
        let mut colours: Vec<Vec<u32>> = Vec::new();
        let mut full = 0_u128;
        for &member in members {
            let corners = &constraints[member as usize];
            let used = corners
                .iter()
                .fold(full, |used, &corner| used | self.taken[corner as usize]);
            let free = used.trailing_ones() as usize;
            if free == MAX_COLOURS {
                loose.push(member);
                continue;
            }
            for &corner in corners {
                self.taken[corner as usize] |= 1 << free;
            }
            if free == colours.len() {
                colours.push(Vec::with_capacity(capacity));
            }
            colours[free].push(member);
            if colours[free].len() == capacity {
                full |= 1 << free;
            }
        }
        for &member in members {
            for &corner in &constraints[member as usize] {
                self.taken[corner as usize] = 0;
                self.degree[corner as usize] = 0;
            }
        }
        colours
    }
}
