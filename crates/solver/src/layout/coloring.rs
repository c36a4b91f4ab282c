//! Coloring of constraints: two constraints of one color share no particle.
//!
//! Greedy in the given order, so that equal input gives equal colors everywhere.

/// Maximum number of colors; if a particle has more constraints, the remainder is overflow.
pub const MAX_COLORS: usize = 128;

/// Colors sets of constraints, one after the other.
#[derive(Debug)]
pub struct Painter {
    /// Colors at each particle, as bits.
    taken: Vec<u128>,
    degree: Vec<u32>,
}

impl Painter {
    /// For constraints on this number of particles.
    #[must_use]
    pub fn new(particles: usize) -> Self {
        Self {
            taken: vec![0; particles],
            degree: vec![0; particles],
        }
    }

    /// Colors the `members` of `constraints`: returns them color by color, and appends uncolored
    /// ones to `overflow`.
    pub fn paint<const N: usize>(
        &mut self,
        constraints: &[[u32; N]],
        members: &[u32],
        overflow: &mut Vec<u32>,
    ) -> Vec<Vec<u32>> {
        let mut busiest = 0;
        for &member in members {
            for &corner in &constraints[member as usize] {
                let degree = &mut self.degree[corner as usize];
                *degree += 1;
                busiest = busiest.max(*degree as usize);
            }
        }
        // Colors are filled up to a multiple of the lanes, to minimize unused lanes.
        let colors = (busiest + busiest / 4 + 1).min(MAX_COLORS);
        let capacity = members.len().div_ceil(colors).next_multiple_of(8);
        let mut colors: Vec<Vec<u32>> = Vec::new();
        let mut full = 0_u128;
        for &member in members {
            let corners = &constraints[member as usize];
            let used = corners
                .iter()
                .fold(full, |used, &corner| used | self.taken[corner as usize]);
            let free = used.trailing_ones() as usize;
            if free == MAX_COLORS {
                overflow.push(member);
                continue;
            }
            for &corner in corners {
                self.taken[corner as usize] |= 1 << free;
            }
            if free == colors.len() {
                colors.push(Vec::with_capacity(capacity));
            }
            colors[free].push(member);
            if colors[free].len() == capacity {
                full |= 1 << free;
            }
        }
        for &member in members {
            for &corner in &constraints[member as usize] {
                self.taken[corner as usize] = 0;
                self.degree[corner as usize] = 0;
            }
        }
        colors
    }
}
