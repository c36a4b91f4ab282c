//! Position of each constraint in the solution order, and its tint.
//!
//! Pure functions of a topology, without drawing.

use crate::sandbox::state::view::SolverView;
use bevy::prelude::*;

use crate::{
    render::distinct_color,
    sandbox::render::material::{PALETTE, linear},
    solver::{
        Topology,
        kernel::{MAX_WIDTH, WIDTH},
        topology::order::Elements,
    },
};

/// Position of a constraint in the solution order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// Partition and color; `None` for an overflow constraint, which is solved alone.
    pub turn: Option<Turn>,
    /// Lane in its block, from 0 to 7; in the pattern of a grid, to 15.
    pub lane: usize,
}

/// Partition and color in which a constraint is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// Index of the partition.
    pub partition: usize,
    /// Index of the color within the partition.
    pub color: usize,
}

/// Positions of all constraints, in storage order.
#[must_use]
pub fn places<const N: usize>(elements: &Elements<N>) -> Vec<Slot> {
    let alone = Slot {
        turn: None,
        lane: 0,
    };
    let mut places = vec![alone; elements.corners().len()];
    for batch in elements.batches() {
        for (color, (first, group, patterns)) in elements.patterns(batch).enumerate() {
            let turn = batch.partition().map(|partition| Turn { partition, color });
            let strips = patterns.iter().flat_map(|pattern| {
                let lanes = pattern.lanes;
                (0..MAX_WIDTH).filter(move |lane| lanes >> lane & 1 == 1)
            });
            // Without patterns, the lanes of one block after the other.
            let lanes = strips.chain((0..WIDTH).cycle());
            for (place, lane) in places[first..][..group.len()].iter_mut().zip(lanes) {
                *place = Slot { turn, lane };
            }
        }
    }
    places
}

impl Slot {
    /// Tint of the position in a view, linear sRGB. Partitions are numbered from `first_partition`,
    /// so that two bodies of one partition each differ. Overflow constraints have no partition and
    /// no color; they are white.
    #[must_use]
    pub fn tint(self, view: SolverView, first_partition: usize) -> Vec3 {
        match (view, self.turn) {
            (SolverView::Lanes, _) => linear(PALETTE[self.lane % WIDTH]),
            (SolverView::Partitions, Some(turn)) => distinct(first_partition + turn.partition),
            (SolverView::Colors, Some(turn)) => distinct(turn.color),
            (SolverView::Off, _) | (_, None) => Vec3::ONE,
        }
    }
}

/// A distinct color, linear sRGB.
fn distinct(n: usize) -> Vec3 {
    let color = distinct_color(n).to_linear();
    color.to_vec3().clamp(Vec3::ZERO, Vec3::ONE)
}

/// Kinds of constraints of a body that are solved and drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Kinds {
    /// Edges, if stretch is on.
    pub edges: bool,
    /// Tetrahedra, if volume is on.
    pub tetrahedra: bool,
    /// Struts.
    pub struts: bool,
}

/// Number of partitions and constraints of some bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Summary {
    /// Number of bodies.
    pub bodies: usize,
    /// Number of partitions of all bodies.
    pub partitions: usize,
    /// Number of overflow constraints.
    pub overflow: usize,
    /// Edges, if stretch is on.
    pub edges: Filling,
    /// Tetrahedra, if volume is on.
    pub tetrahedra: Filling,
    /// Struts, if they are on.
    pub struts: Filling,
}

/// Lane utilization of the blocks of one kind of constraint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Filling {
    /// Number of constraints.
    pub constraints: usize,
    /// Number of lanes of all blocks, including idle ones.
    pub lanes: usize,
    /// Largest number of colors in a partition.
    pub colors: usize,
}

impl Summary {
    /// Summary of one body.
    #[must_use]
    pub fn of(topology: &Topology, kinds: Kinds) -> Self {
        let mut all = Self {
            bodies: 1,
            partitions: topology.partitions.count(),
            ..Self::default()
        };
        if kinds.edges {
            all.edges = all.fill(&topology.edges.elements);
        }
        if kinds.tetrahedra {
            all.tetrahedra = all.fill(&topology.tetrahedra.elements);
        }
        if kinds.struts {
            all.struts = all.fill(&topology.struts().elements);
        }
        all
    }

    fn fill<const N: usize>(&mut self, elements: &Elements<N>) -> Filling {
        let mut filling = Filling::default();
        for batch in elements.batches() {
            let groups = elements.patterns(batch);
            let mut colors = 0;
            for (_, group, patterns) in groups {
                colors += 1;
                filling.constraints += group.len();
                filling.lanes += match patterns.len() {
                    0 => group.len().next_multiple_of(WIDTH),
                    patterns => patterns * MAX_WIDTH,
                };
            }
            if batch.partition().is_some() {
                filling.colors = filling.colors.max(colors);
            } else {
                self.overflow += batch.constraints().len();
            }
        }
        filling
    }

    /// Combines two summaries.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            bodies: self.bodies + other.bodies,
            partitions: self.partitions + other.partitions,
            overflow: self.overflow + other.overflow,
            edges: self.edges.and(other.edges),
            tetrahedra: self.tetrahedra.and(other.tetrahedra),
            struts: self.struts.and(other.struts),
        }
    }
}

impl Filling {
    /// Fraction of the lanes that are used, 0 to 1; `None` without constraints.
    #[must_use]
    pub fn fraction(self) -> Option<f64> {
        (self.lanes > 0).then(|| self.constraints as f64 / self.lanes as f64)
    }

    fn and(self, other: Self) -> Self {
        Self {
            constraints: self.constraints + other.constraints,
            lanes: self.lanes + other.lanes,
            colors: self.colors.max(other.colors),
        }
    }
}
