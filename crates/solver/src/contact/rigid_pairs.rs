//! Pairs of rigid surfaces, and where they touch.

use super::{closest::Kind, manifold::Touch};
use glam::DVec3;

/// Two rigid surfaces that may touch.
#[derive(Debug, Clone)]
pub(super) struct RigidPair {
    /// Indices of the members, in ascending order.
    pub members: [u32; 2],
    /// Where they touch; empty unless this is known.
    pub places: Vec<Place>,
    pub is_known: bool,
    /// Bound on how far the surfaces have moved against each other since it is [m].
    pub moved: f64,
    /// How far they may move against each other in this substep [m], if they can come near each other in it.
    pub moves: Option<f64>,
}

/// Two primitives of rigid surfaces that touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub kind: Kind,
    /// Members of the first and of the second primitive.
    pub members: [u32; 2],
    /// Surface vertices of the corners.
    pub vertices: [u32; 4],
    /// Distance to maintain [m].
    pub distance: f32,
}

/// All pairs, and buffers, reused.
#[derive(Debug, Default)]
pub(super) struct RigidPairs {
    /// In ascending order of their members.
    pub all: Vec<RigidPair>,
    pub touches: Vec<Touch>,
    pub places: Vec<Place>,
    /// Pair, part of the open candidates and number in it of each batch whose places are to be found.
    pub unknown: Vec<[u32; 3]>,
    /// Lowest and highest displacement of the vertices of each member in the substep [m].
    pub motions: Vec<[DVec3; 2]>,
}

impl RigidPairs {
    /// A tick begins: it does not depend on the one before.
    pub fn begin_tick(&mut self) {
        self.all.retain(|it| it.moves.is_some());
        self.all.iter_mut().for_each(RigidPair::forget);
    }

    /// Index of a pair, which is added if it is new.
    pub fn place(&mut self, members: [u32; 2]) -> usize {
        let known = self.find(members);
        known.unwrap_or_else(|place| {
            let new = RigidPair {
                members,
                places: Vec::new(),
                is_known: false,
                moved: 0.0,
                moves: None,
            };
            self.all.insert(place, new);
            place
        })
    }

    /// Bound on how far two members move against each other in the substep [m].
    pub fn relative_motion(&self, members: [u32; 2]) -> f64 {
        let [[low, high], [other_low, other_high]] =
            members.map(|member| self.motions[member as usize]);
        let most = (high - other_low).abs().max((low - other_high).abs());
        most.length()
    }

    /// Index of a pair, or the one that it would have.
    pub fn find(&self, members: [u32; 2]) -> Result<usize, usize> {
        self.all.binary_search_by_key(&members, |it| it.members)
    }
}

impl RigidPair {
    /// Where they touch is to be found anew.
    pub fn forget(&mut self) {
        self.places.clear();
        self.is_known = false;
        self.moved = 0.0;
    }
}
