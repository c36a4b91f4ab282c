//! The state-independent part: elimination order and pattern of the factor.

use super::{
    fronts::Fronts,
    ordering::{Elimination, eliminate, eliminate_in_order},
};
use std::ops::Range;

/// Multiplications from which a factorization is computed in [fronts](Fronts): below that, blocks by themselves
/// are faster.
pub(super) const LARGE: u64 = 30_000_000;

/// Elimination order and pattern of a factor of 3 × 3 blocks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    /// Position of each particle in the order; pinned ones come last, and are not part of the system.
    pub place: Vec<u32>,
    /// Start of the blocks of each column, and the end of the last.
    columns: Vec<u32>,
    /// Row of each block below the diagonal, ascending within a column: of the factor, or with fronts of the
    /// matrix only.
    pub rows: Vec<u32>,
    /// Start of the list of each row in `left`.
    starts: Vec<u32>,
    /// For each row, the runs of blocks left of the diagonal.
    left: Vec<Run>,
    /// Of a large factor, in place of the runs.
    pub fronts: Option<Fronts>,
    /// Number of multiplications of a factorization.
    pub work: u64,
}

/// Blocks of a row in successive columns that have the same rows below it: together, they update those
/// rows of the row's own column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    /// First column, and the number of columns.
    pub column: u32,
    pub count: u32,
    /// Number of blocks below it in each of them.
    pub below: u32,
}

/// How the order of elimination is found.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Order<'a> {
    /// By local fill, if a factorization takes at most this number of multiplications.
    LocalFill { max_work: u64 },
    /// That of another plan, of all particles: with more pins it is nearly as good, and found at once.
    Given(&'a [u32]),
}

/// Error: a factorization would exceed the limit of multiplications.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooLarge;

/// Number of multiplications for a column with this number of blocks below the diagonal.
pub(super) const fn work_of(blocks: usize) -> u64 {
    let count = blocks as u64;
    27 * (count * (count + 1) / 2 + count)
}

impl Plan {
    /// `is_free` tells which particles are not pinned; `links` are the pairs of particles that share an
    /// element.
    pub fn new(
        is_free: &[bool],
        links: impl Iterator<Item = (u32, u32)>,
        order: Order,
    ) -> Result<Self, TooLarge> {
        Self::with_large(is_free, links, order, LARGE)
    }

    /// With fronts from this number of multiplications.
    pub(super) fn with_large(
        is_free: &[bool],
        links: impl Iterator<Item = (u32, u32)>,
        order: Order,
        large: u64,
    ) -> Result<Self, TooLarge> {
        let free: Vec<u32> = (0..)
            .zip(is_free)
            .filter(|(_, free)| **free)
            .map(|(i, _)| i)
            .collect();
        let mut number = vec![u32::MAX; is_free.len()];
        for (k, &i) in (0..).zip(&free) {
            number[i as usize] = k;
        }
        let links = links.map(|(a, b)| (number[a as usize], number[b as usize]));
        let links = links.filter(|&(a, b)| a != u32::MAX && b != u32::MAX);
        let links: Vec<(u32, u32)> = links.collect();
        let of_system = links.iter().copied();
        let cliques = match order {
            Order::LocalFill { max_work } => eliminate(free.len(), of_system, max_work)?,
            Order::Given(order) => {
                let order = order.iter().map(|&i| number[i as usize]);
                let order: Vec<u32> = order.filter(|&k| k != u32::MAX).collect();
                eliminate_in_order(&order, of_system)
            }
        };
        let order = postorder(&cliques);
        let mut position = vec![0; free.len()];
        for (k, &at) in (0..).zip(&order) {
            position[cliques[at].0 as usize] = k;
        }
        let mut plan = Self {
            columns: vec![0],
            starts: vec![0],
            ..Self::default()
        };
        for at in order {
            let clique = &cliques[at].1;
            let first = plan.rows.len();
            plan.rows
                .extend(clique.iter().map(|&i| position[i as usize]));
            plan.rows[first..].sort_unstable();
            plan.columns.push(plan.rows.len() as u32);
            plan.work += work_of(clique.len());
        }
        let mut pinned = free.len() as u32..;
        for k in number {
            let place = match position.get(k as usize) {
                Some(place) => Some(*place),
                None => pinned.next(),
            };
            plan.place.extend(place);
        }
        if plan.work < large {
            plan.find_runs();
        } else {
            let mut fronts = Fronts::new(&plan);
            let places = links.into_iter().map(|(a, b)| {
                let (a, b) = (position[a as usize], position[b as usize]);
                (a.min(b), a.max(b))
            });
            plan.keep(places.collect());
            fronts.locate(&plan);
            plan.fronts = Some(fronts);
        }
        Ok(plan)
    }

    /// Keeps these blocks, given by column and row, and no others.
    fn keep(&mut self, mut blocks: Vec<(u32, u32)>) {
        blocks.sort_unstable();
        blocks.dedup();
        let size = self.size() as u32;
        let ends = (0..size).map(|column| blocks.partition_point(|block| block.0 <= column) as u32);
        self.columns = std::iter::once(0).chain(ends).collect();
        self.rows = blocks.into_iter().map(|(_, row)| row).collect();
    }

    fn find_runs(&mut self) {
        let mut lists: Vec<Vec<Run>> = vec![Vec::new(); self.size()];
        for column in 0..self.size() {
            let rows = &self.rows[self.column(column)];
            for (&row, below) in rows.iter().zip((0..rows.len() as u32).rev()) {
                let list = &mut lists[row as usize];
                let column = column as u32;
                match list.last_mut() {
                    // Rows of a column are also rows of the first of them, so that equally many below the
                    // row are the same.
                    Some(last)
                        if last.column + last.count == column
                            && last.below == below
                            && self.rows[self.columns[column as usize - 1] as usize] == column =>
                    {
                        last.count += 1;
                    }
                    _ => list.push(Run {
                        column,
                        count: 1,
                        below,
                    }),
                }
            }
        }
        for list in lists {
            self.left.extend(list);
            self.starts.push(self.left.len() as u32);
        }
    }

    /// Whether each particle is part of the system.
    pub fn free(&self) -> impl Iterator<Item = bool> {
        let size = self.size();
        self.place.iter().map(move |place| (*place as usize) < size)
    }

    /// Number of columns: of free particles.
    pub fn size(&self) -> usize {
        self.columns.len() - 1
    }

    /// The blocks of a column below the diagonal.
    pub fn column(&self, column: usize) -> Range<usize> {
        self.columns[column] as usize..self.columns[column + 1] as usize
    }

    /// The runs of blocks of a row left of the diagonal.
    pub fn row(&self, row: usize) -> &[Run] {
        &self.left[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Block of two different positions that share an element; [`u32::MAX`] if one of them is pinned.
    pub fn block(&self, a: u32, b: u32) -> u32 {
        if a.max(b) as usize >= self.size() {
            return u32::MAX;
        }
        let range = self.column(a.min(b) as usize);
        let found = self.rows[range.clone()].binary_search(&a.max(b));
        found.map_or(u32::MAX, |at| (range.start + at) as u32)
    }

    /// Numbers of the factor in fronts.
    pub fn numbers(&self) -> u64 {
        self.fronts.as_ref().map_or(0, |fronts| fronts.numbers)
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.place[..])
            + size_of_val(&self.columns[..])
            + size_of_val(&self.rows[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.left[..])
            + self.fronts.as_ref().map_or(0, Fronts::bytes)
    }
}

/// The columns in postorder of the elimination tree, which changes neither fill nor work: columns with
/// the same rows become neighbors. Of the children of a column, that with the most rows is last.
fn postorder(cliques: &Elimination) -> Vec<usize> {
    let count = cliques.len();
    let mut at = vec![0; count];
    for (k, (particle, _)) in cliques.iter().enumerate() {
        at[*particle as usize] = k;
    }
    let mut children = vec![Vec::new(); count];
    let mut stack = Vec::new();
    for (k, (_, clique)) in cliques.iter().enumerate() {
        match clique.iter().map(|&i| at[i as usize]).min() {
            Some(parent) => children[parent].push(k),
            None => stack.push(k),
        }
    }
    for list in &mut children {
        list.sort_by_key(|&k| cliques[k].1.len());
    }
    // Parents before children and the last child first, and then the reverse of that.
    let mut order = Vec::with_capacity(count);
    while let Some(next) = stack.pop() {
        order.push(next);
        stack.append(&mut children[next]);
    }
    order.reverse();
    order
}
