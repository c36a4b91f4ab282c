//! Supernodes of a large factor, and the pieces into which their dense matrices are cut.
//!
//! A supernode is a set of successive columns with the same rows below them. Its front is a dense matrix of its
//! columns and those rows: what earlier columns subtract is added up in it, its columns are factored, and what
//! they subtract from the rows below goes to the front of the next supernode that has them (multifrontal method,
//! Duff and Reid 1983).

use super::plan::{Plan, work_of};
use std::ops::Range;

/// Particles of a tile of rows: their coordinates fill registers of four numbers.
pub(super) const TILE: usize = 4;

/// Maximum number of particles whose columns are in one piece.
const WIDTH: usize = 16;

/// Time of a front, of each of its rows and columns, and of each number that is passed on to the next, over
/// that of a multiplication: supernodes are united where that is cheaper, although zeros are computed with.
const FRONT: u64 = 1000;
const ROW: u64 = 50;
const NUMBER: u64 = 6;

/// Parts into which the cost of a factorization is divided, so that threads take about as long.
const PARTS: u64 = 48;

/// The supernodes of a factor, in postorder.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fronts {
    pub fronts: Vec<Front>,
    /// The rows below each supernode, and the place of each in the front of the next supernode.
    pub rows: Vec<u32>,
    pub places: Vec<u32>,
    /// Number of the supernodes whose next one this is, by supernode.
    children: Vec<u32>,
    /// For each block of the plan, the place of its row in its front.
    pub locals: Vec<u32>,
    pub pieces: Vec<Piece>,
    pub tasks: Vec<Task>,
    /// Numbers in the pieces of the factor.
    pub numbers: u64,
}

#[derive(Debug, Clone)]
pub(crate) struct Front {
    /// First column, and the number of columns.
    pub first: usize,
    pub count: usize,
    /// In [`Fronts::rows`].
    pub rows: Range<usize>,
    children: Range<usize>,
    /// Those of its own columns, and of the others.
    pub own: Range<usize>,
    pub others: Range<usize>,
}

impl Front {
    /// Number of tiles of rows.
    pub fn tiles(&self) -> usize {
        (self.count + self.rows.len()).div_ceil(TILE)
    }
}

/// Columns of a front, from its first to its last particle, with the rows of the diagonal and below.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub front: usize,
    pub first: usize,
    pub end: usize,
}

impl Piece {
    /// Its first tile of rows.
    pub fn tile(&self) -> usize {
        self.first / TILE
    }

    /// Number of its columns.
    pub fn width(&self) -> usize {
        3 * (self.end - self.first)
    }

    /// Number of strips in which it is stored, as a piece of this front.
    pub fn strips(&self, front: &Front) -> usize {
        (front.tiles() - self.tile()) * self.width()
    }
}

/// Work for one thread. It needs the results of earlier tasks only.
#[derive(Debug, Clone)]
pub(crate) enum Task {
    /// All pieces of successive supernodes, which need nothing of others.
    Subtree(Range<usize>),
    /// A piece of a supernode.
    Piece(usize),
}

/// Cost of a supernode with this number of columns and rows below them, in multiplications.
fn cost(count: usize, below: usize) -> u64 {
    let below = below.next_multiple_of(TILE);
    let work: u64 = (below..below + count).map(work_of).sum();
    let passed = 9 * below as u64 * (below as u64 + 1) / 2;
    work + FRONT + ROW * (count + below) as u64 + NUMBER * passed
}

impl Fronts {
    /// Of a plan with all blocks of the factor. In the end, the plan must have those of the matrix only.
    pub fn new(plan: &Plan) -> Self {
        let mut all = Self::default();
        all.find(plan);
        all.relate(plan.size());
        all.cut();
        all.divide();
        all
    }

    /// Finds supernodes.
    fn find(&mut self, plan: &Plan) {
        // First column, and the number of columns; rows below are those of the last column.
        let mut found: Vec<(usize, usize)> = Vec::new();
        let below = |(first, count): (usize, usize)| plan.column(first + count - 1);
        for column in 0..plan.size() {
            let rows = plan.column(column);
            let mut own = (column, 1);
            while let Some(&last) = found.last() {
                let theirs = below(last);
                let goes_on = plan.rows[theirs.clone()]
                    .first()
                    .is_some_and(|&row| (own.0..own.0 + own.1).contains(&(row as usize)));
                let both = (last.0, last.1 + own.1);
                let apart = cost(last.1, theirs.len()) + cost(own.1, rows.len());
                if !goes_on || cost(both.1, rows.len()) > apart {
                    break;
                }
                own = both;
                found.pop();
            }
            found.push(own);
        }
        for (first, count) in found {
            let start = self.rows.len();
            self.rows
                .extend_from_slice(&plan.rows[below((first, count))]);
            self.fronts.push(Front {
                first,
                count,
                rows: start..self.rows.len(),
                children: 0..0,
                own: 0..0,
                others: 0..0,
            });
        }
    }

    /// Finds what each supernode needs of others.
    fn relate(&mut self, size: usize) {
        let mut front_of = vec![0; size];
        for (number, front) in self.fronts.iter().enumerate() {
            front_of[front.first..front.first + front.count].fill(number);
        }
        let mut children = vec![Vec::new(); self.fronts.len()];
        self.places = vec![0; self.rows.len()];
        for (number, front) in (0..).zip(&self.fronts) {
            let Some(&row) = self.rows[front.rows.clone()].first() else {
                continue;
            };
            let next = front_of[row as usize];
            children[next].push(number);
            let next = &self.fronts[next];
            for at in front.rows.clone() {
                self.places[at] = self.place(next, self.rows[at]);
            }
        }
        for (front, list) in self.fronts.iter_mut().zip(children) {
            let start = self.children.len();
            self.children.extend(list);
            front.children = start..self.children.len();
        }
    }

    /// Place of a row in a front that has it.
    fn place(&self, front: &Front, row: u32) -> u32 {
        match row as usize - front.first {
            own if own < front.count => own as u32,
            _ => {
                let below = &self.rows[front.rows.clone()];
                (front.count + below.partition_point(|&other| other < row)) as u32
            }
        }
    }

    /// Finds the places of blocks, given by their columns, in the fronts.
    pub fn locate(&mut self, plan: &Plan) {
        let mut locals = Vec::with_capacity(plan.rows.len());
        for front in &self.fronts {
            for column in front.first..front.first + front.count {
                let rows = &plan.rows[plan.column(column)];
                locals.extend(rows.iter().map(|&row| self.place(front, row)));
            }
        }
        self.locals = locals;
    }

    /// Cuts fronts into pieces.
    fn cut(&mut self) {
        for (number, front) in self.fronts.iter_mut().enumerate() {
            let mut cut = |range: Range<usize>| {
                let start = self.pieces.len();
                for first in range.clone().step_by(WIDTH) {
                    self.pieces.push(Piece {
                        front: number,
                        first,
                        end: range.end.min(first + WIDTH),
                    });
                }
                start..self.pieces.len()
            };
            let count = front.count;
            front.own = cut(0..count);
            front.others = cut(count..count + front.rows.len());
            let own = &self.pieces[front.own.clone()];
            let numbers = own.iter().map(|piece| 3 * TILE * piece.strips(front));
            self.numbers += numbers.sum::<usize>() as u64;
        }
    }

    /// Divides the work into tasks.
    fn divide(&mut self) {
        let mut first = Vec::with_capacity(self.fronts.len());
        let mut costs = Vec::with_capacity(self.fronts.len());
        for (number, front) in self.fronts.iter().enumerate() {
            let mut sum = (number, cost(front.count, front.rows.len()));
            for child in self.children(front) {
                sum = (sum.0.min(first[child]), sum.1 + costs[child]);
            }
            first.push(sum.0);
            costs.push(sum.1);
        }
        let total = costs.iter().zip(&self.fronts);
        let total: u64 = total
            .filter(|(_, front)| front.rows.is_empty())
            .map(|(cost, _)| cost)
            .sum();
        let mut subtrees = Vec::new();
        let mut top = Vec::new();
        let mut rest = self.fronts.len();
        while let Some(number) = rest.checked_sub(1) {
            if costs[number] * PARTS <= total {
                subtrees.push((costs[number], first[number]..rest));
                rest = first[number];
            } else {
                top.push(number);
                rest = number;
            }
        }
        // The largest first, so that threads end at about the same time.
        subtrees.sort_by_key(|(cost, fronts)| (std::cmp::Reverse(*cost), fronts.start));
        let subtrees = subtrees.into_iter();
        self.tasks
            .extend(subtrees.map(|(_, fronts)| Task::Subtree(fronts)));
        for number in top.into_iter().rev() {
            let front = &self.fronts[number];
            self.tasks
                .extend((front.own.start..front.others.end).map(Task::Piece));
        }
    }

    /// The supernodes that pass numbers on to this one.
    pub fn children(&self, front: &Front) -> impl Iterator<Item = usize> {
        let children = &self.children[front.children.clone()];
        children.iter().map(|&child| child as usize)
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.fronts[..])
            + size_of_val(&self.rows[..])
            + size_of_val(&self.places[..])
            + size_of_val(&self.children[..])
            + size_of_val(&self.locals[..])
            + size_of_val(&self.pieces[..])
            + size_of_val(&self.tasks[..])
    }
}
