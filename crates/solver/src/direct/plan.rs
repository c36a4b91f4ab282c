//! The state-independent part: elimination order and pattern of the factor.

use std::{collections::BTreeSet, ops::Range};

/// Elimination order and pattern of a factor of 3 × 3 blocks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    /// Position of each particle in the order.
    pub place: Vec<u32>,
    /// Start of the blocks of each column, and the end of the last.
    columns: Vec<u32>,
    /// Row of each block below the diagonal, ascending within a column.
    pub rows: Vec<u32>,
    /// Start of the list of each row in `left`.
    starts: Vec<u32>,
    /// For each row, the blocks left of the diagonal as column and place.
    left: Vec<(u32, u32)>,
    /// Number of multiplications of a factorization.
    pub work: u64,
}

/// Error: a factorization would exceed the limit of multiplications.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooLarge;

impl Plan {
    /// By minimum degree, with ties by number. `links` are the pairs of particles that share an
    /// element.
    pub fn new(
        particles: usize,
        links: impl Iterator<Item = (u32, u32)>,
        max_work: u64,
    ) -> Result<Self, TooLarge> {
        let mut near = vec![Vec::new(); particles];
        for (a, b) in links {
            near[a as usize].push(b);
            near[b as usize].push(a);
        }
        for list in &mut near {
            list.sort_unstable();
            list.dedup();
        }
        let mut queue: BTreeSet<(usize, u32)> =
            (0..).zip(&near).map(|(i, list)| (list.len(), i)).collect();
        let (mut place, mut cliques) = (vec![0; particles], Vec::new());
        let mut work = 0;
        while let Some((_, next)) = queue.pop_first() {
            place[next as usize] = cliques.len() as u32;
            let clique = std::mem::take(&mut near[next as usize]);
            let count = clique.len() as u64;
            work += 27 * (count * (count + 1) / 2 + count);
            if work > max_work {
                return Err(TooLarge);
            }
            for &i in &clique {
                let list = &mut near[i as usize];
                queue.remove(&(list.len(), i));
                list.extend(&clique);
                list.sort_unstable();
                list.dedup();
                list.retain(|&k| k != i && k != next);
                queue.insert((list.len(), i));
            }
            cliques.push(clique);
        }
        let (mut columns, mut rows) = (vec![0], Vec::new());
        for clique in &cliques {
            let first = rows.len();
            rows.extend(clique.iter().map(|&i| place[i as usize]));
            rows[first..].sort_unstable();
            columns.push(rows.len() as u32);
        }
        let mut lists = vec![Vec::new(); particles];
        for (column, range) in (0..).zip(columns.windows(2)) {
            for block in range[0]..range[1] {
                lists[rows[block as usize] as usize].push((column, block));
            }
        }
        let (mut starts, mut left) = (vec![0], Vec::new());
        for list in lists {
            left.extend(list);
            starts.push(left.len() as u32);
        }
        Ok(Self {
            place,
            columns,
            rows,
            starts,
            left,
            work,
        })
    }

    /// The blocks of a column below the diagonal.
    pub fn column(&self, column: usize) -> Range<usize> {
        self.columns[column] as usize..self.columns[column + 1] as usize
    }

    /// The blocks of a row left of the diagonal, as column and place.
    pub fn row(&self, row: usize) -> &[(u32, u32)] {
        &self.left[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Block of two different positions that share an element.
    pub fn block(&self, a: u32, b: u32) -> u32 {
        let range = self.column(a.min(b) as usize);
        let found = self.rows[range.clone()].binary_search(&a.max(b));
        found.map_or(u32::MAX, |at| (range.start + at) as u32)
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.place[..])
            + size_of_val(&self.columns[..])
            + size_of_val(&self.rows[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.left[..])
    }
}
