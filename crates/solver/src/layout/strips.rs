//! Strips of a grid, one per lane.
//!
//! In a grid, constraints repeat from particle to particle. Particles are cut into lines of equal
//! length (a small body is one line), and each line into [`MAX_WIDTH`] strips: particle i of a line
//! is in row i mod L of lane ⌊i/L⌋, where L is the length of a strip. Constraints between the same
//! rows with the same distances of lanes form a [pattern](Pattern), which is solved in all lanes
//! without gathering particles.

use super::width::MAX_WIDTH;
use std::ops::Range;

/// How particles are placed in lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Strips {
    /// Particles of a line.
    line: u32,
    /// Particles of a strip, which are the rows of a line.
    length: u32,
}

/// A row and a distance of lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(transparent)]
pub struct Spot(u32);

impl Spot {
    const fn new(row: u32, lane: u32) -> Self {
        Self(row * MAX_WIDTH as u32 + lane)
    }

    /// The row.
    #[must_use]
    pub const fn row(self) -> usize {
        self.0 as usize / MAX_WIDTH
    }

    /// The lane, or the distance of lanes.
    #[must_use]
    pub const fn lane(self) -> usize {
        self.0 as usize % MAX_WIDTH
    }
}

/// Constraints that share no particle and differ by their lanes only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pattern<const N: usize> {
    /// Row of each corner, with the distance of its lane from the lowest of a constraint.
    pub corners: [Spot; N],
    /// The lowest lanes of the constraints, as bits.
    pub lanes: u16,
}

impl<const N: usize> Pattern<N> {
    /// Row of each corner.
    pub(super) fn rows(&self) -> [u32; N] {
        self.corners.map(|corner| corner.row() as u32)
    }
}

/// A pattern, with its constraints by their places among those that were grouped.
pub(super) struct Found<const N: usize> {
    pub pattern: Pattern<N>,
    pub members: Range<usize>,
}

/// Bodies in which constraints have fewer lanes on average are not cut into strips. Miri is too slow
/// for bodies of several lines that fill so many.
const MIN_FILL: f32 = if cfg!(miri) { 0.2 } else { 0.6 };

/// Number of the most frequent differences between the particles of an edge that are considered.
const DIFFERENCES: usize = 6;

/// Constraints of a kind that fill fewer lanes are ordered as if there were no strips.
const MIN_FILL_OF_KIND: f32 = if cfg!(miri) { 0.2 } else { 0.4 };

/// Maximum number of particles in a line of a body of several partitions.
const LONGEST: u32 = 1024;

/// Minimum number of lines of such a body, each of which is a partition or a part of one. Miri is too
/// slow for the bodies that have so many.
const LINES: u32 = if cfg!(miri) { 4 } else { 8 };

/// Maximum number of rows of a grid in such a line.
const MULTIPLES: u32 = 8;

/// Particles of such a body, at least, whose constraints are counted to compare strips.
const SAMPLE: u32 = 512;

impl Strips {
    /// The strips that fill most lanes, if they are enough; for a body that `is_cut` into partitions,
    /// in lines that are short enough for these.
    pub(crate) fn find(
        count: usize,
        edges: &[[u32; 2]],
        tetrahedra: &[[u32; 4]],
        is_cut: bool,
    ) -> Option<Self> {
        let count = u32::try_from(count).ok()?;
        // A single difference is that of a rope, which is solved best in two colors from end to end.
        let differences = frequent_differences(edges, count).filter(|it| it.len() > 1)?;
        // Every sample is in the middle of the body.
        let middle = count / 2 - (count / 2).min(LONGEST)..count / 2 + LONGEST + SAMPLE;
        let sampled = match is_cut {
            true => middle,
            false => 0..count,
        };
        let (edges, tetrahedra) = (
            &within(edges, &sampled)[..],
            &within(tetrahedra, &sampled)[..],
        );
        let sample = |line: u32| match is_cut {
            true => {
                let start = count / 2 / line * line;
                start..start + SAMPLE.div_ceil(line) * line
            }
            false => 0..count,
        };
        let lanes = MAX_WIDTH as u32;
        let mut lines = vec![count];
        if is_cut {
            let longest = LONGEST.min(count / LINES);
            lines.clear();
            for &difference in &differences {
                let multiples = (1..=MULTIPLES).map(|k| difference.saturating_mul(k));
                lines.extend(multiples.filter(|line| (lanes..=longest).contains(line)));
            }
            lines.sort_unstable();
            lines.dedup();
        }
        let best = |candidates: &[Self], tetrahedra| {
            let mut best: Option<(f32, Self)> = None;
            for &strips in candidates {
                let fill = strips.fill(edges, tetrahedra, &sample(strips.line));
                if best.is_none_or(|(most, _)| fill > most + CLEARLY) {
                    best = Some((fill, strips));
                }
            }
            best
        };
        // A cell may be divided as the next but one: strips of even and odd length differ.
        let lengths = |line: u32, more: u32| {
            let least = line.div_ceil(lanes);
            (least..=least + more).map(move |length| Self { line, length })
        };
        let of_lines: Vec<Self> = lines
            .into_iter()
            .flat_map(|line| lengths(line, 1))
            .collect();
        let (_, Self { line, .. }) = best(&of_lines, &[])?;
        let least = line.div_ceil(lanes);
        let mut candidates: Vec<Self> = lengths(line, 3).collect();
        let steps = differences
            .iter()
            .flat_map(|&it| [it, it.saturating_mul(2)]);
        let steps = steps.filter_map(|step| least.checked_next_multiple_of(step));
        let steps = steps.filter(|&length| length > least + 3 && length <= least + least / 2);
        candidates.extend(steps.map(|length| Self { line, length }));
        candidates.sort_unstable_by_key(|strips| strips.length);
        candidates.dedup();
        let (fill, strips) = best(&candidates, tetrahedra)?;
        (fill >= MIN_FILL).then_some(strips)
    }

    /// Mean fraction of the lanes that the constraints of a sample have.
    fn fill(self, edges: &[[u32; 2]], tetrahedra: &[[u32; 4]], sample: &Range<u32>) -> f32 {
        let mut sum = (0, 0);
        self.count(&mut sum, edges, sample);
        self.count(&mut sum, tetrahedra, sample);
        let (constraints, patterns) = sum;
        constraints as f32 / (patterns * MAX_WIDTH).max(1) as f32
    }

    /// Adds the numbers of constraints whose lowest particle is in a sample, and of their patterns.
    fn count<const N: usize>(
        self,
        sum: &mut (usize, usize),
        constraints: &[[u32; N]],
        sample: &Range<u32>,
    ) {
        let constraints = within(constraints, sample);
        let mut members: Vec<u32> = (0..constraints.len() as u32).collect();
        sum.1 += self.group(&constraints, &mut members).len();
        sum.0 += members.len();
    }

    /// Whether constraints fill enough lanes.
    pub(super) fn are_filled_by<const N: usize>(self, constraints: &[[u32; N]]) -> bool {
        let mut sum = (0, 0);
        self.count(&mut sum, constraints, &(0..u32::MAX));
        let (constraints, patterns) = sum;
        patterns > 0 && constraints as f32 >= MIN_FILL_OF_KIND * (patterns * MAX_WIDTH) as f32
    }

    /// Sorts the `members` of `constraints` by patterns, and within each by lanes.
    pub(super) fn group<const N: usize>(
        self,
        constraints: &[[u32; N]],
        members: &mut [u32],
    ) -> Vec<Found<N>> {
        let mut keyed: Vec<([Spot; N], u32, u32)> = members
            .iter()
            .map(|&member| {
                let (corners, lane) = self.spots(&constraints[member as usize]);
                (corners, lane, member)
            })
            .collect();
        keyed.sort_unstable();
        let mut start = 0;
        let mut patterns = Vec::new();
        for found in keyed.chunk_by(|one, next| {
            // The same row twice: neighbors in it would share a particle.
            one.0 == next.0 && one.1 < next.1 && has_no_pair(&one.0)
        }) {
            patterns.push(Found {
                pattern: Pattern {
                    corners: found[0].0,
                    lanes: found.iter().fold(0, |lanes, it| lanes | 1 << it.1),
                },
                members: start..start + found.len(),
            });
            start += found.len();
        }
        for (member, (.., number)) in members.iter_mut().zip(keyed) {
            *member = number;
        }
        patterns
    }

    /// Where the corners of a constraint are, relative to its lowest lane, and this lane.
    fn spots<const N: usize>(self, corners: &[u32; N]) -> ([Spot; N], u32) {
        let places = corners.map(|corner| self.place(corner));
        let lowest = places.iter().map(|place| place.lane()).min().unwrap_or(0) as u32;
        (places.map(|place| Spot(place.0 - lowest)), lowest)
    }

    /// Row and lane of a particle.
    #[must_use]
    pub fn place(self, particle: u32) -> Spot {
        let (line, within) = (particle / self.line, particle % self.line);
        let row = line * self.length + within % self.length;
        Spot::new(row, within / self.length)
    }

    /// The particles of a row.
    #[must_use]
    pub fn row(self, row: usize) -> Row {
        let (line, length) = (self.line as usize, self.length as usize);
        let start = row / length * line;
        Row {
            first: start + row % length,
            length,
            end: start + line,
        }
    }

    /// Rows of the particles in a range of whole lines, or up to the last particle.
    #[must_use]
    pub fn rows(self, particles: &Range<usize>) -> Range<usize> {
        let (line, length) = (self.line as usize, self.length as usize);
        particles.start / line * length..particles.end.div_ceil(line) * length
    }

    /// Particles of a line, after whose multiples a body may be cut.
    pub(super) fn line(self) -> usize {
        self.line as usize
    }
}

/// The particles of a row, one in each lane.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    first: usize,
    length: usize,
    end: usize,
}

impl Row {
    /// The particle in a lane; it may be beyond the last one of the body.
    #[inline(always)]
    #[must_use]
    pub fn particle(self, lane: usize) -> Option<usize> {
        let particle = self.first + lane * self.length;
        (particle < self.end).then_some(particle)
    }
}

/// A fill must exceed that of shorter lines by this to be preferred.
const CLEARLY: f32 = 0.02;

/// The constraints whose lowest particle is in a sample.
fn within<const N: usize>(constraints: &[[u32; N]], sample: &Range<u32>) -> Vec<[u32; N]> {
    let low = |corners: &&[u32; N]| corners.iter().min().is_some_and(|low| sample.contains(low));
    constraints.iter().filter(low).copied().collect()
}

/// Whether no two corners are in one row.
fn has_no_pair<const N: usize>(corners: &[Spot; N]) -> bool {
    (0..N).all(|i| {
        corners[..i]
            .iter()
            .all(|other| other.row() != corners[i].row())
    })
}

/// The most frequent differences between the particles of an edge; `None` if they are not those of
/// a grid.
fn frequent_differences(edges: &[[u32; 2]], count: u32) -> Option<Vec<u32>> {
    let mut all: Vec<u32> = edges.iter().map(|[a, b]| a.abs_diff(*b)).collect();
    all.sort_unstable();
    let mut counted: Vec<(usize, u32)> = all
        .chunk_by(|a, b| a == b)
        .map(|same| (same.len(), same[0]))
        .collect();
    counted.sort_unstable_by_key(|&(times, difference)| (usize::MAX - times, difference));
    counted.truncate(DIFFERENCES);
    let (most, _) = *counted.first()?;
    (most >= count as usize / 4).then(|| counted.into_iter().map(|(_, it)| it).collect())
}
