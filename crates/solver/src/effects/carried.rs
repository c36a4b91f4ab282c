//! The effects of one body.

use crate::{ElasticKind, Ground, Method, ShapeMatching, Topology, WorkEstimate};
use serde::{Deserialize, Serialize};

macro_rules! carried_by_a_body {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        /// The effects of a body; absent effects cost nothing.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        pub struct Effects {
            $($(#[doc = $does1] pub $field1: Option<crate::$kind1>,)*)*
            $($(#[doc = $does2] pub $field2: Option<crate::$kind2>,)*)*
            /// Grab of the body by a spring.
            pub $grabbed: Option<crate::$grab>,
            $($(#[doc = $does3] pub $field3: Option<crate::$kind3>,)*)*
        }
    };
}

crate::effects!(carried_by_a_body);

impl Effects {
    /// Whether it is present, and iterations of this method project its constraints.
    #[must_use]
    pub fn iterates(&self, kind: ElasticKind, method: Method) -> bool {
        self.has(kind) && !(self.is_direct(method) && kind.is_solved_directly())
    }

    /// Whether the body is solved directly in a world of this method.
    #[must_use]
    pub fn is_direct(&self, method: Method) -> bool {
        self.direct.is_some() && method.has_direct()
    }

    /// The ground, if it has rolling resistance.
    pub(crate) fn rolling_ground(&self) -> Option<Ground> {
        self.ground
            .filter(|ground| ground.rolling_resistance.get() > 0.0)
    }

    /// Whether something acts on the body between substeps: plastic flow or rolling resistance.
    pub(crate) fn acts_between_substeps(&self) -> bool {
        self.plasticity.is_some() || self.rolling_ground().is_some()
    }

    /// Whether the body has contact with other bodies or itself.
    #[must_use]
    pub fn can_touch(&self) -> bool {
        self.contact.is_some() || self.self_contact.is_some()
    }

    /// Whether the body is rigid where it touches others, the ground and colliders: with contact,
    /// and with shape matching of its whole shape at the frequency ∞.
    #[must_use]
    pub fn is_rigid(&self) -> bool {
        let is_whole = |it: ShapeMatching| {
            it.frequency.get() == f32::INFINITY && it.region.get() == f32::INFINITY
        };
        self.contact.is_some() && self.shape_matching.is_some_and(is_whole)
    }

    /// Whether the surface of the body touches other surfaces, in a world with or without colliders
    /// that are meshes.
    #[must_use]
    pub fn touches_surfaces(&self, has_meshes: bool) -> bool {
        self.can_touch() || has_meshes && self.collide.is_some()
    }

    /// Number of constraints of a body with these effects; pressure counts as one, and so do all
    /// regions of shape matching together.
    #[must_use]
    pub fn constraints(&self, topology: &Topology) -> usize {
        self.elements(topology) + self.body_constraints(topology)
    }

    /// Number of elements of its elastic effects.
    fn elements(&self, topology: &Topology) -> usize {
        let carried = ElasticKind::ALL.into_iter().filter(|&kind| self.has(kind));
        carried.map(|kind| kind.elements(topology)).sum()
    }

    /// Work estimate of a number of iterations: pressure counts its triangles, shape matching its
    /// particles, other effects their constraints.
    #[must_use]
    pub fn load(&self, topology: &Topology, iterations: usize) -> WorkEstimate {
        let pass = self.elements(topology) + self.body_load(topology);
        WorkEstimate {
            projections: pass * iterations,
            pieces: topology.partitions.count(),
        }
    }
}
