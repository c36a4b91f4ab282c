//! Partitions: runs of particles that are wide enough for a constraint to span at most two of them.
//!
//! Every second partition can then be processed at the same time: a constraint belongs to the
//! partition of its first particle, and uses no particle before it or beyond the next one.

use super::strips::Strips;
use std::ops::Range;

/// A body with fewer particles is a single partition. Miri is too slow for larger ones.
pub const MIN_CUT: usize = if cfg!(miri) { 64 } else { 2048 };

/// Maximum number of partitions.
pub const MAX_PARTITIONS: usize = 510;

/// Maximum number of batches of the constraints of an effect: one for each partition, and one for
/// constraints that reach beyond the next.
pub(crate) const MAX_BATCHES: usize = MAX_PARTITIONS + 1;

/// Default number of particles in a partition.
const USUAL: usize = if cfg!(miri) { 16 } else { 256 };

/// Partitioning of the particles of a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partitions {
    /// First particle of each partition, and the number of particles.
    starts: Vec<u32>,
    /// Pieces for the even partitions, and for the odd ones.
    pieces: [Vec<Piece>; 2],
    whole: Piece,
    strips: Option<Strips>,
}

/// Particles that one thread has at a time: a partition with the next one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// The particles.
    pub particles: Range<usize>,
    /// The partitions that they belong to.
    pub partitions: Range<usize>,
    /// The partition whose constraints are solved on them, if any.
    pub partition: Option<usize>,
}

impl Partitions {
    /// Partitions `particles`, which may be cut into strips: then at their lines. `reaches` are pairs
    /// of the lowest and the highest particle of each constraint.
    #[must_use]
    pub fn cut(
        particles: usize,
        reaches: impl Iterator<Item = (u32, u32)>,
        strips: Option<Strips>,
    ) -> Self {
        if particles < MIN_CUT {
            return Self::new(vec![0, particles as u32]).with(strips);
        }
        let line = strips.map_or(1, Strips::line);
        let mut farthest: Vec<u32> = (0..particles as u32).collect();
        for (low, high) in reaches {
            let far = &mut farthest[low as usize];
            *far = high.max(*far);
        }
        // Eight partitions keep four threads busy in either half.
        let count = (particles / USUAL / 8 * 8).clamp(8, MAX_PARTITIONS);
        let width = particles.div_ceil(count).next_multiple_of(line);
        let mut starts = vec![0, width.min(particles) as u32];
        while let &[.., before, last] = &starts[..]
            && (last as usize) < particles
        {
            let reach = farthest[before as usize..last as usize].iter().max();
            let next = reach
                .map_or(0, |&far| (far as usize + 1).next_multiple_of(line))
                .max(last as usize + width);
            starts.push(next.min(particles) as u32);
        }
        Self::new(starts).with(strips)
    }

    fn with(self, strips: Option<Strips>) -> Self {
        Self { strips, ..self }
    }

    /// How the particles are placed in lanes; `None` unless constraints repeat as in a grid.
    #[must_use]
    pub fn strips(&self) -> Option<Strips> {
        self.strips
    }

    /// First particle of each partition, and the number of particles.
    #[must_use]
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// With stored starts; `None` if they do not ascend from 0, or are too many.
    #[must_use]
    pub fn from_starts(starts: Vec<u32>) -> Option<Self> {
        let ascend = starts.windows(2).all(|pair| pair[0] < pair[1]);
        let count = (2..=MAX_PARTITIONS + 1).contains(&starts.len());
        (count && starts[0] == 0 && ascend).then(|| Self::new(starts))
    }

    /// The same after copies were inserted next to particles, where `place` is the new number of
    /// an old particle or of the end.
    pub(crate) fn moved(&self, place: impl Fn(u32) -> u32) -> Self {
        Self::new(self.starts.iter().map(|&start| place(start)).collect())
    }

    fn new(starts: Vec<u32>) -> Self {
        let partitions = starts.len() - 1;
        let start = |partition: usize| starts[partition.min(partitions)] as usize;
        let piece = |partition: usize| Piece {
            particles: start(partition)..start(partition + 2),
            partitions: partition..(partition + 2).min(partitions),
            partition: Some(partition),
        };
        let even = (0..partitions).step_by(2).map(piece).collect();
        let mut odd: Vec<_> = (1..partitions).step_by(2).map(piece).collect();
        let whole = Piece {
            particles: 0..start(partitions),
            partitions: 0..partitions,
            partition: None,
        };
        match odd.first_mut() {
            // Particles before the first odd partition belong to it.
            Some(first) => (first.particles.start, first.partitions.start) = (0, 0),
            None => odd.push(whole.clone()),
        }
        Self {
            pieces: [even, odd],
            whole,
            strips: None,
            starts,
        }
    }

    /// All particles in one piece.
    #[must_use]
    pub fn whole(&self) -> &[Piece] {
        std::slice::from_ref(&self.whole)
    }

    /// All particles in disjoint pieces: for the even partitions, or for the odd ones.
    #[must_use]
    pub fn pieces(&self, odd: bool) -> &[Piece] {
        &self.pieces[usize::from(odd)]
    }

    /// One partition without the next.
    pub(crate) fn alone(&self, partition: usize) -> Piece {
        Piece {
            particles: self.starts[partition] as usize..self.starts[partition + 1] as usize,
            partitions: partition..partition + 1,
            partition: None,
        }
    }

    /// Number of partitions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of particles.
    #[must_use]
    pub fn particles(&self) -> usize {
        self.starts.last().copied().unwrap_or(0) as usize
    }

    /// The particles that constraints of a partition may have: its own and those of the next one.
    pub(super) fn reach(&self, partition: usize) -> Range<usize> {
        let start = |it: usize| self.starts[it.min(self.count())] as usize;
        start(partition)..start(partition + 2)
    }

    /// Partition of a constraint; `None` if it extends beyond the next one.
    #[must_use]
    pub fn partition_of<const N: usize>(&self, corners: &[u32; N]) -> Option<usize> {
        let low = corners.iter().min()?;
        let high = corners.iter().max()?;
        let partition = self.starts.partition_point(|start| start <= low) - 1;
        let end = self.starts.get(partition + 2).or(self.starts.last())?;
        (high < end).then_some(partition)
    }
}
