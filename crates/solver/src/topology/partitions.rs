//! Bands: runs of particles so wide that a constraint reaches from one at most into the next.
//!
//! Every second band can then be worked on at the same time: a constraint belongs to the band of
//! its first particle, and touches nothing before that band or beyond the next.

use std::ops::Range;

/// A body with fewer particles is one band. Miri is too slow for larger ones.
pub const MIN_CUT: usize = if cfg!(miri) { 64 } else { 2048 };

/// Pieces at most, for either half of the bands.
const MAX_PIECES: usize = 256;

/// Particles of a band, if nothing else decides.
const USUAL: usize = if cfg!(miri) { 16 } else { 256 };

/// How the particles of a body are cut.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partitions {
    /// First particle of each band, and the number of particles.
    starts: Vec<u32>,
    /// Pieces to work on the even bands, and on the odd ones.
    pieces: [Vec<Piece>; 2],
    whole: Piece,
}

/// Particles that one thread has at a time: a band with the next one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// The particles.
    pub particles: Range<usize>,
    /// The band whose constraints are solved on them, if one is.
    pub partition: Option<usize>,
}

impl Partitions {
    /// Cuts `particles` whose constraints reach from one to another: pairs of the lowest and the
    /// highest particle of each.
    #[must_use]
    pub fn cut(particles: usize, reaches: impl Iterator<Item = (u32, u32)>) -> Self {
        if particles < MIN_CUT {
            return Self::new(vec![0, particles as u32]);
        }
        let mut farthest: Vec<u32> = (0..particles as u32).collect();
        for (low, high) in reaches {
            let far = &mut farthest[low as usize];
            *far = high.max(*far);
        }
        // Eight bands keep four threads busy in either half.
        let count = (particles / USUAL / 8 * 8).clamp(8, 2 * (MAX_PIECES - 1));
        let width = particles.div_ceil(count);
        let mut starts = vec![0, width.min(particles) as u32];
        while let &[.., before, last] = &starts[..]
            && (last as usize) < particles
        {
            let reach = farthest[before as usize..last as usize].iter().max();
            let next = reach
                .map_or(0, |&far| far as usize + 1)
                .max(last as usize + width);
            starts.push(next.min(particles) as u32);
        }
        Self::new(starts)
    }

    fn new(starts: Vec<u32>) -> Self {
        let partitions = starts.len() - 1;
        let start = |partition: usize| starts[partition.min(partitions)] as usize;
        let piece = |partition: usize| Piece {
            particles: start(partition)..start(partition + 2),
            partition: Some(partition),
        };
        let even = (0..partitions).step_by(2).map(piece).collect();
        let mut odd: Vec<_> = (1..partitions).step_by(2).map(piece).collect();
        let whole = Piece {
            particles: 0..start(partitions),
            partition: None,
        };
        match odd.first_mut() {
            // What is before the first odd band goes with it.
            Some(first) => first.particles.start = 0,
            None => odd.push(whole.clone()),
        }
        Self {
            pieces: [even, odd],
            whole,
            starts,
        }
    }

    /// All particles in one piece.
    #[must_use]
    pub fn whole(&self) -> &[Piece] {
        std::slice::from_ref(&self.whole)
    }

    /// All particles in pieces that share none: for the even bands, or for the odd ones.
    #[must_use]
    pub fn pieces(&self, odd: bool) -> &[Piece] {
        &self.pieces[usize::from(odd)]
    }

    /// How many.
    #[must_use]
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many particles.
    #[must_use]
    pub fn particles(&self) -> usize {
        self.starts.last().copied().unwrap_or(0) as usize
    }

    /// The band of a constraint; `None` if it reaches beyond the next one.
    #[must_use]
    pub fn partition_of<const N: usize>(&self, corners: &[u32; N]) -> Option<usize> {
        let low = corners.iter().min()?;
        let high = corners.iter().max()?;
        let partition = self.starts.partition_point(|start| start <= low) - 1;
        let end = self.starts.get(partition + 2).or(self.starts.last())?;
        (high < end).then_some(partition)
    }
}
