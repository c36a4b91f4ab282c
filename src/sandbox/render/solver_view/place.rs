//! Where each constraint stands in the order in which they are solved, and the tint that tells so.
//!
//! Pure functions of a topology: nothing here draws.

use crate::sandbox::state::view::SolverView;
use bevy::{color::Oklcha, prelude::*};

use crate::{
    sandbox::render::material::{PALETTE, linear},
    solver::{Topology, lanes::WIDTH, order::Elements},
};

/// Where a constraint stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Its band and its colour there; `None` for a loose one, which is solved alone.
    pub turn: Option<Turn>,
    /// Its place in its block, from 0 to 7.
    pub lane: usize,
}

/// When a constraint is solved: in which band, with which colour of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// Number of the band.
    pub partition: usize,
    /// Number of the colour among those of the band.
    pub colour: usize,
}

/// Where each constraint stands, in the order in which they are stored.
#[must_use]
pub fn places<const N: usize>(elements: &Elements<N>) -> Vec<Place> {
    let alone = Place {
        turn: None,
        lane: 0,
    };
    let mut places = vec![alone; elements.corners().len()];
    for batch in elements.batches() {
        for (colour, (first, group)) in elements.groups(batch).enumerate() {
            let turn = batch
                .partition()
                .map(|partition| Turn { partition, colour });
            for (index, place) in places[first..][..group.len()].iter_mut().enumerate() {
                *place = Place {
                    turn,
                    lane: index % WIDTH,
                };
            }
        }
    }
    places
}

impl Place {
    /// The tint of the place in a view, linear sRGB. Bands are counted on from `first_partition`, so
    /// that two bodies of a band each differ. What is loose has no band and no colour: it is white.
    #[must_use]
    pub fn tint(self, view: SolverView, first_partition: usize) -> Vec3 {
        match (view, self.turn) {
            (SolverView::Lanes, _) => linear(PALETTE[self.lane]),
            (SolverView::Partitions, Some(turn)) => distinct(first_partition + turn.partition),
            (SolverView::Colours, Some(turn)) => distinct(turn.colour),
            (SolverView::Off, _) | (_, None) => Vec3::ONE,
        }
    }
}

/// A circle divided by the golden ratio: no few multiples of it come near each other [°].
const GOLDEN_ANGLE: f32 = 137.507_77;

/// The n-th of a row of colours in which neighbours differ in hue and in lightness, linear sRGB.
fn distinct(n: usize) -> Vec3 {
    let hue = (n as f32 * GOLDEN_ANGLE).rem_euclid(360.0);
    let lightness = [0.72, 0.54, 0.86, 0.63][n % 4];
    let colour = LinearRgba::from(Oklcha::lch(lightness, 0.17, hue));
    colour.to_vec3().clamp(Vec3::ZERO, Vec3::ONE)
}

/// Which constraints of a body are solved and drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Kinds {
    /// Edges, where stretch is on.
    pub edges: bool,
    /// Tetrahedra, where volume is on.
    pub tetrahedra: bool,
    /// Struts.
    pub struts: bool,
}

/// How many pieces the constraints of bodies are solved in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Summary {
    /// Bodies.
    pub bodies: usize,
    /// Bands of all bodies.
    pub partitions: usize,
    /// Constraints that have no band.
    pub loose: usize,
    /// The edges, where stretch is on.
    pub edges: Filling,
    /// The tetrahedra, where volume is on.
    pub tetrahedra: Filling,
    /// The struts, where they are on.
    pub struts: Filling,
}

/// How full the blocks are that constraints of one kind are solved in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Filling {
    /// Constraints.
    pub constraints: usize,
    /// Lanes of all blocks, those that stay idle too.
    pub lanes: usize,
    /// Colours of the band that has most.
    pub colours: usize,
}

impl Summary {
    /// Of one body.
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
            let groups = elements.groups(batch);
            let mut colours = 0;
            for (_, group) in groups {
                colours += 1;
                filling.constraints += group.len();
                filling.lanes += group.len().next_multiple_of(WIDTH);
            }
            if batch.partition().is_some() {
                filling.colours = filling.colours.max(colours);
            } else {
                self.loose += batch.constraints().len();
            }
        }
        filling
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            bodies: self.bodies + other.bodies,
            partitions: self.partitions + other.partitions,
            loose: self.loose + other.loose,
            edges: self.edges.and(other.edges),
            tetrahedra: self.tetrahedra.and(other.tetrahedra),
            struts: self.struts.and(other.struts),
        }
    }
}

impl Filling {
    /// Share of the lanes that have something to do, 0 to 1; `None` without constraints.
    #[must_use]
    pub fn share(self) -> Option<f64> {
        (self.lanes > 0).then(|| self.constraints as f64 / self.lanes as f64)
    }

    fn and(self, other: Self) -> Self {
        Self {
            constraints: self.constraints + other.constraints,
            lanes: self.lanes + other.lanes,
            colours: self.colours.max(other.colours),
        }
    }
}
