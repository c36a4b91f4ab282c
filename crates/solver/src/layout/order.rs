//! Order in which the constraints of one kind are solved.
//!
//! Constraints are stored in this order: first the batches of one half, then those of the other,
//! then the overflow. Batches of a half share no particle, so that threads can take them in any
//! order; a batch is solved color by color; and constraints of a color share no particle, so that
//! lanes can take them together. Overflow constraints, which span more than two partitions, are
//! colored as well, but solved on one thread.
//!
//! In a body of [strips], patterns of constraints are colored instead of single ones, on rows
//! instead of particles, and constraints are stored pattern by pattern; unless few of them repeat.
//!
//! [strips]: super::strips

use super::{
    coloring::{MAX_COLORS, Painter},
    partitions::Partitions,
    strips::{Pattern, Strips},
    width::WIDTH,
};
use serde::{Deserialize, Serialize};
use std::{
    ops::{Deref, Range},
    sync::Arc,
};

pub use super::corner::Corner;

/// Particles of the constraints of one kind, in the order in which they are solved.
///
/// Immutable, which guarantees the ranges of [`Batch::particles`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Elements<const N: usize>(Arc<Order<N>>);

impl<const N: usize> Deref for Elements<N> {
    type Target = Order<N>;

    fn deref(&self) -> &Order<N> {
        &self.0
    }
}

/// Content of [`Elements`], shared by copies.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Order<const N: usize> {
    corners: Vec<[Corner; N]>,
    /// Ranges of constraints that share no particle.
    groups: Vec<Range<u32>>,
    /// The strips of the body, if the constraints fill their lanes.
    strips: Option<Strips>,
    /// The patterns of these constraints in strips.
    patterns: Vec<Pattern<N>>,
    /// For each group, the end of its patterns.
    pattern_ends: Vec<u32>,
    batches: Vec<Batch>,
    how: Painting,
    /// Batches of the first half.
    first_half: usize,
    /// Number of blocks when all were colored.
    blocks_at_first: usize,
}

/// The constraints of one partition, or the overflow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    partition: Option<usize>,
    particles: Range<usize>,
    constraints: Range<usize>,
    groups: Range<usize>,
}

/// How constraints are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Painting {
    /// Whether the odd partitions come first.
    pub odd_first: bool,
    /// Whether colors are assigned at random in runs of 64 particles, or rows of strips, instead of
    /// from one to the next: for the edges of sheets.
    ///
    /// With one iteration per substep, a step is x₊ = G(2x − x₋) with the product G of all
    /// projections. Where G has a complex eigenvalue g near 1, with |Im g| > (1 − Re g)^1.5, a root
    /// of z² − 2gz + g = 0 has |z| > 1, and undamped modes grow. Colors assigned from particle to
    /// particle form slanted domains on a grid, which have such eigenvalues: a free flat cloth of
    /// 64² particles, rigid, with both diagonals, grew by a factor of e twice per second at 600
    /// substeps per second. With random assignment, none of the tested sheets had any. Solids have
    /// none either way, and two alternating colors are optimal for a rope.
    pub scattered: bool,
}

/// Particles or rows in a run in which colors are [scattered](Painting::scattered).
const STRETCH: u32 = 64;

impl<const N: usize> Elements<N> {
    /// Orders constraints on partitioned particles. Returns them with their old numbers.
    #[must_use]
    pub fn new(
        constraints: &[[u32; N]],
        partitions: &Partitions,
        how: Painting,
    ) -> (Self, Vec<u32>) {
        let odd_first = how.odd_first;
        let mut members = vec![Vec::new(); partitions.count()];
        let mut overflow = Vec::new();
        for (index, corners) in constraints.iter().enumerate() {
            match partitions.partition_of(corners) {
                Some(partition) => members[partition].push(index as u32),
                None => overflow.push(index as u32),
            }
        }
        let strips = partitions.strips();
        let strips = strips.filter(|strips| strips.are_filled_by(constraints));
        let mut all = Order {
            how,
            strips,
            ..Order::default()
        };
        let mut stored = Vec::with_capacity(constraints.len());
        let mut artist = Artist::new(constraints, partitions, strips);
        for half in 0..2 {
            let parity = usize::from(odd_first == (half == 0));
            for partition in (parity..partitions.count()).step_by(2) {
                let members = std::mem::take(&mut members[partition]);
                let order = if how.scattered { scatter } else { by_first };
                let colors = artist.paint(members, order, &mut overflow);
                all.close_batch(Some(partition), colors, &mut stored);
            }
            if half == 0 {
                all.first_half = all.batches.len();
            }
        }
        all.close_overflow(overflow, &mut artist, &mut stored);
        all.corners = stored
            .iter()
            .map(|&i| constraints[i as usize].map(Corner::of))
            .collect();
        all.blocks_at_first = all.blocks();
        all.find_reach();
        (Self(Arc::new(all)), stored)
    }

    /// The same after a change of the body: each constraint has the particles that `corners` gives
    /// for its number, or is removed, and those `added` follow. Particles may only be replaced by
    /// copies of themselves, numbered next to them, so that those of a color still share none. A
    /// constraint keeps its color and its place among the others; a new one gets the first color of
    /// its partition that its particles do not have. When the colors have decayed, all are assigned
    /// anew. Returns the old number of each constraint; numbers of added ones continue after the
    /// old ones.
    #[must_use]
    pub fn edited(
        &self,
        corners: impl Fn(usize) -> Option<[u32; N]>,
        added: &[[u32; N]],
        partitions: &Partitions,
    ) -> (Self, Vec<u32>) {
        let old = self.corners.len();
        let now: Vec<Option<[u32; N]>> = (0..old)
            .map(corners)
            .chain(added.iter().map(|corners| Some(*corners)))
            .collect();
        let corners_of = |index: u32| now[index as usize].unwrap_or([0; N]);
        let mut arrivals: Vec<Vec<u32>> = vec![Vec::new(); partitions.count()];
        let mut overflow = Vec::new();
        for (index, corners) in (old as u32..).zip(added) {
            match partitions.partition_of(corners) {
                Some(partition) => arrivals[partition].push(index),
                None => overflow.push(index),
            }
        }
        let stays = |range: &Range<u32>| -> Vec<u32> {
            let range = range.clone();
            range
                .filter(|&index| now[index as usize].is_some())
                .collect()
        };
        let mut all = Order {
            how: self.how,
            first_half: self.first_half,
            blocks_at_first: self.blocks_at_first,
            ..Order::default()
        };
        let mut stored = Vec::with_capacity(now.len());
        // The colors at each particle of a partition.
        let mut taken: Vec<u128> = Vec::new();
        for batch in &self.batches {
            let Some(partition) = batch.partition else {
                continue;
            };
            let groups = &self.groups[batch.groups.clone()];
            let mut colors: Vec<Vec<u32>> = groups.iter().map(stays).collect();
            let newcomers = &arrivals[partition];
            let range = partitions.reach(partition);
            let place = |corner: u32| corner as usize - range.start;
            if !newcomers.is_empty() {
                taken.clear();
                taken.resize(range.len(), 0);
                for (color, members) in colors.iter().enumerate() {
                    for corner in members.iter().flat_map(|&index| corners_of(index)) {
                        taken[place(corner)] |= 1 << color;
                    }
                }
            }
            for &index in newcomers {
                let corners = corners_of(index);
                let used = corners.iter().fold(0, |used, &it| used | taken[place(it)]);
                let free = used.trailing_ones() as usize;
                if free == MAX_COLORS {
                    overflow.push(index);
                    continue;
                }
                if free == colors.len() {
                    colors.push(Vec::new());
                }
                colors[free].push(index);
                for corner in corners {
                    taken[place(corner)] |= 1 << free;
                }
            }
            all.close_batch(Some(partition), without_patterns(colors), &mut stored);
        }
        let groups = match self.overflow() {
            Some(index) => &self.groups[self.batches[index].groups.clone()],
            None => &[],
        };
        let mut groups: Vec<Vec<u32>> = groups.iter().map(stays).collect();
        groups.extend(overflow.into_iter().map(|index| vec![index]));
        if !groups.is_empty() {
            all.close_batch(None, without_patterns(groups), &mut stored);
        }
        if all.blocks() as f32 > DECAYED * self.blocks_at_first.max(stored.len() / WIDTH) as f32 {
            let corners: Vec<[u32; N]> = stored.iter().map(|&index| corners_of(index)).collect();
            let (anew, places) = Self::new(&corners, partitions, self.how);
            let places = places.iter().map(|&place| stored[place as usize]);
            return (anew, places.collect());
        }
        all.corners = stored
            .iter()
            .map(|&index| corners_of(index).map(Corner::of))
            .collect();
        all.find_reach();
        (Self(Arc::new(all)), stored)
    }

    /// How the constraints are colored, for storing them.
    #[must_use]
    pub fn colors(&self) -> Colors {
        let sizes = |batch: &Batch| {
            let groups = &self.groups[batch.groups.clone()];
            groups.iter().map(|group| group.end - group.start).collect()
        };
        Colors {
            batches: self.batches.iter().map(sizes).collect(),
            overflows: self.overflow().is_some(),
            how: self.how,
            blocks_at_first: self.blocks_at_first as u64,
        }
    }

    /// Constraints in stored order with stored colors; `None` if these are invalid for them.
    #[must_use]
    pub fn colored(corners: &[[u32; N]], partitions: &Partitions, colors: &Colors) -> Option<Self> {
        let Colors {
            batches,
            overflows,
            how,
            blocks_at_first,
        } = colors;
        if batches.len() != partitions.count() + usize::from(*overflows) {
            return None;
        }
        let mut all = Order {
            how: *how,
            blocks_at_first: usize::try_from(*blocks_at_first).ok()?,
            ..Order::default()
        };
        let half = |parity: usize| (parity..partitions.count()).step_by(2);
        let first = usize::from(how.odd_first);
        all.first_half = half(first).count();
        let order = half(first).chain(half(1 - first)).map(Some);
        let mut stored: Vec<u32> = Vec::with_capacity(corners.len());
        let mut seen = vec![0_u32; partitions.particles()];
        let mut mark = 0;
        for (partition, sizes) in order.chain(overflows.then_some(None)).zip(batches) {
            let mut groups = Vec::new();
            let mut next = stored.len() as u32;
            for &size in sizes {
                let end = next.checked_add(size)?;
                let group = corners.get(next as usize..end as usize)?;
                mark += 1;
                for it in group {
                    let fits = partition.is_none() || partitions.partition_of(it) == partition;
                    for &corner in it {
                        let seen = seen.get_mut(corner as usize)?;
                        if !fits || std::mem::replace(seen, mark) == mark {
                            return None;
                        }
                    }
                }
                groups.push((next..end).collect());
                next = end;
            }
            all.close_batch(partition, without_patterns(groups), &mut stored);
        }
        if stored.len() != corners.len() {
            return None;
        }
        all.corners = corners.iter().map(|it| it.map(Corner::of)).collect();
        all.find_reach();
        Some(Self(Arc::new(all)))
    }
}

/// When there are more blocks than this multiple of those of the first coloring, or of as many full
/// ones, the coloring has decayed.
const DECAYED: f32 = 1.25;

/// The colors of constraints in their order, without the constraints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Colors {
    /// Number of constraints of each color, batch by batch.
    batches: Vec<Vec<u32>>,
    /// Whether the last batch is overflow.
    overflows: bool,
    how: Painting,
    blocks_at_first: u64,
}

impl<const N: usize> Order<N> {
    /// Stores the constraints of a partition, color by color.
    fn close_batch(
        &mut self,
        partition: Option<usize>,
        colors: impl IntoIterator<Item = Color<N>>,
        stored: &mut Vec<u32>,
    ) {
        let (first, first_group) = (stored.len(), self.groups.len());
        for Color { members, patterns } in colors {
            if members.is_empty() {
                continue;
            }
            let first = stored.len() as u32;
            self.groups.push(first..first + members.len() as u32);
            stored.extend(members);
            self.patterns.extend(patterns);
            self.pattern_ends.push(self.patterns.len() as u32);
        }
        self.batches.push(Batch {
            partition,
            particles: 0..0,
            constraints: first..stored.len(),
            groups: first_group..self.groups.len(),
        });
    }

    /// Stores overflow constraints, also color by color: one thread solves them, in lanes.
    /// Uncolored ones form groups of one.
    fn close_overflow(
        &mut self,
        overflow: Vec<u32>,
        artist: &mut Artist<N>,
        stored: &mut Vec<u32>,
    ) {
        if !overflow.is_empty() {
            let mut alone = Vec::new();
            let mut colors = artist.paint(overflow, |_, _| (), &mut alone);
            for index in alone {
                colors.extend(artist.paint(vec![index], |_, _| (), &mut Vec::new()));
            }
            self.close_batch(None, colors, stored);
        }
    }

    /// Number of blocks of lanes.
    pub(crate) fn blocks(&self) -> usize {
        let sizes = self.groups.iter().map(|group| group.len());
        sizes.map(|size| size.div_ceil(WIDTH)).sum()
    }

    /// Number of patterns in a body of strips.
    pub(crate) fn pattern_count(&self) -> usize {
        self.patterns.len()
    }

    /// Computes the particle range of each batch.
    fn find_reach(&mut self) {
        for batch in &mut self.batches {
            let flat = self.corners[batch.constraints.clone()].as_flattened();
            let particles = || flat.iter().map(|corner| corner.particle());
            if let (Some(low), Some(high)) = (particles().min(), particles().max()) {
                batch.particles = low as usize..high as usize + 1;
            }
        }
    }

    /// Particles of each constraint.
    #[must_use]
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [u32; N]> + Clone {
        self.corners
            .iter()
            .map(|corners| corners.map(Corner::particle))
    }

    /// Particles of one constraint.
    pub(crate) fn corner(&self, index: usize) -> [u32; N] {
        self.corners[index].map(Corner::particle)
    }

    /// All batches in order.
    #[must_use]
    pub fn batches(&self) -> &[Batch] {
        &self.batches
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.corners[..])
            + size_of_val(&self.groups[..])
            + size_of_val(&self.patterns[..])
            + size_of_val(&self.pattern_ends[..])
            + size_of_val(&self.batches[..])
    }

    /// Whether the odd partitions come first.
    #[must_use]
    pub fn odd_first(&self) -> bool {
        self.how.odd_first
    }

    /// Number of the batch of a partition.
    #[must_use]
    pub fn batch_of(&self, partition: usize) -> usize {
        if (partition % 2 == 1) == self.how.odd_first {
            partition / 2
        } else {
            self.first_half + partition / 2
        }
    }

    /// Number of the batch of overflow constraints, if any.
    #[must_use]
    pub fn overflow(&self) -> Option<usize> {
        let last = self.batches.last()?;
        last.partition.is_none().then(|| self.batches.len() - 1)
    }

    /// All constraints of the odd partitions, or of the even ones.
    #[must_use]
    pub fn half(&self, odd: bool) -> Range<usize> {
        let bound = self.batches.len() - usize::from(self.overflow().is_some());
        let batches = if odd == self.how.odd_first {
            &self.batches[..self.first_half]
        } else {
            &self.batches[self.first_half..bound]
        };
        match (batches.first(), batches.last()) {
            (Some(first), Some(last)) => first.constraints.start..last.constraints.end,
            _ => 0..0,
        }
    }

    /// The strips in which the constraints have patterns.
    #[must_use]
    pub fn strips(&self) -> Option<Strips> {
        self.strips
    }

    /// [Groups](Self::groups) of a batch with their patterns, in strips.
    pub fn patterns(
        &self,
        batch: &Batch,
    ) -> impl Iterator<Item = (usize, &[[Corner; N]], &[Pattern<N>])> {
        self.patterns_in(batch, Direction::Forward)
    }

    /// The same in a direction.
    pub(crate) fn patterns_in(
        &self,
        batch: &Batch,
        direction: Direction,
    ) -> impl Iterator<Item = (usize, &[[Corner; N]], &[Pattern<N>])> {
        let ends = &self.pattern_ends[..];
        direction.of(batch.groups.clone()).map(move |number| {
            let (first, group) = self.group(number);
            let start = number.checked_sub(1).map_or(0, |before| ends[before]);
            (
                first,
                group,
                &self.patterns[start as usize..ends[number] as usize],
            )
        })
    }

    /// Constraints of a batch that share no particle: the number of the first, and their particles.
    pub fn groups(&self, batch: &Batch) -> impl Iterator<Item = (usize, &[[Corner; N]])> {
        self.groups_in(batch, Direction::Forward)
    }

    /// The same in a direction.
    pub(crate) fn groups_in(
        &self,
        batch: &Batch,
        direction: Direction,
    ) -> impl Iterator<Item = (usize, &[[Corner; N]])> {
        direction
            .of(batch.groups.clone())
            .map(|number| self.group(number))
    }

    fn group(&self, number: usize) -> (usize, &[[Corner; N]]) {
        let group = &self.groups[number];
        let group = group.start as usize..group.end as usize;
        (group.start, &self.corners[group])
    }
}

/// Direction in which a pass goes through the constraints of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    /// In their order.
    Forward,
    /// From the last to the first.
    Backward,
}

impl Direction {
    /// The numbers of a range in this direction.
    pub fn of(self, Range { start, end }: Range<usize>) -> impl Iterator<Item = usize> + Clone {
        (start..end).map(move |number| match self {
            Self::Forward => number,
            Self::Backward => start + end - 1 - number,
        })
    }
}

/// Constraints of a color in their order, with their patterns in a body of strips.
struct Color<const N: usize> {
    members: Vec<u32>,
    patterns: Vec<Pattern<N>>,
}

fn without_patterns<const N: usize>(colors: Vec<Vec<u32>>) -> impl Iterator<Item = Color<N>> {
    colors.into_iter().map(|members| Color {
        members,
        patterns: Vec::new(),
    })
}

/// An order of some of the elements with these particles or rows.
type Sort<const N: usize> = fn(&[[u32; N]], &mut [u32]);

/// From particle to particle.
fn by_first<const N: usize>(all: &[[u32; N]], members: &mut [u32]) {
    members.sort_by_key(|&i| all[i as usize].iter().min().copied());
}

/// At random in runs of [`STRETCH`].
fn scatter<const N: usize>(all: &[[u32; N]], members: &mut [u32]) {
    members.sort_by_key(|&i| {
        let corners = &all[i as usize];
        let first = corners.iter().min();
        (first.map_or(0, |first| first / STRETCH), hash(corners))
    });
}

/// Colors the constraints of one batch after the other.
struct Artist<'a, const N: usize> {
    constraints: &'a [[u32; N]],
    strips: Option<Strips>,
    painter: Painter,
}

impl<'a, const N: usize> Artist<'a, N> {
    fn new(constraints: &'a [[u32; N]], partitions: &Partitions, strips: Option<Strips>) -> Self {
        let particles = 0..partitions.particles();
        let places = strips.map_or(particles.end, |strips| strips.rows(&particles).end);
        Self {
            constraints,
            strips,
            painter: Painter::new(places),
        }
    }

    /// Colors the `members` in an order; appends uncolored ones to `overflow`.
    fn paint(
        &mut self,
        mut members: Vec<u32>,
        sort: Sort<N>,
        overflow: &mut Vec<u32>,
    ) -> Vec<Color<N>> {
        let Some(strips) = self.strips else {
            sort(self.constraints, &mut members);
            let mut colors = self.painter.paint(self.constraints, &members, overflow);
            // The order within a color changes no bit, but keeps neighbors in the cache.
            for color in &mut colors {
                by_first(self.constraints, color);
            }
            return without_patterns(colors).collect();
        };
        let found = strips.group(self.constraints, &mut members);
        let rows: Vec<[u32; N]> = found.iter().map(|it| it.pattern.rows()).collect();
        let mut order: Vec<u32> = (0..found.len() as u32).collect();
        sort(&rows, &mut order);
        let mut left = Vec::new();
        let colors = self.painter.paint(&rows, &order, &mut left);
        let members_of = |&pattern: &u32| &members[found[pattern as usize].members.clone()];
        overflow.extend(left.iter().flat_map(members_of));
        let color = |mut color: Vec<u32>| {
            by_first(&rows, &mut color);
            Color {
                members: color.iter().flat_map(members_of).copied().collect(),
                patterns: color.iter().map(|&it| found[it as usize].pattern).collect(),
            }
        };
        colors.into_iter().map(color).collect()
    }
}

/// FNV-1a with the finalizer of MurmurHash3, so that neighbors have very different hashes; and its
/// input.
fn hash<const N: usize>(corners: &[u32; N]) -> (u64, [u32; N]) {
    let mut hash = corners
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &corner| {
            (hash ^ u64::from(corner)).wrapping_mul(0x0100_0000_01b3)
        });
    hash = (hash ^ (hash >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    hash = (hash ^ (hash >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    (hash ^ (hash >> 33), *corners)
}

impl Batch {
    /// Number of the partition; `None` for overflow constraints.
    #[must_use]
    pub fn partition(&self) -> Option<usize> {
        self.partition
    }

    /// Range of its particles.
    #[must_use]
    pub fn particles(&self) -> Range<usize> {
        self.particles.clone()
    }

    /// Its constraints.
    #[must_use]
    pub fn constraints(&self) -> Range<usize> {
        self.constraints.clone()
    }
}
