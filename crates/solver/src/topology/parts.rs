//! Parts of a topology that are computed on first use.

use super::{Components, Cotangents, Facets, Frames, Hinges, Surface};
use crate::Topology;
use std::sync::Arc;

impl Topology {
    /// The triangles of its surface as membranes, computed on first use.
    #[must_use]
    pub fn facets(&self) -> &Facets {
        self.facets
            .0
            .get_or_init(|| Arc::new(Facets::of(&self.triangles, &self.rest, &self.partitions)))
    }

    /// The rest frames of its tetrahedra, computed on first use.
    #[must_use]
    pub fn frames(&self) -> &Frames {
        let make = || Arc::new(Frames::of(&self.tetrahedra, &self.rest));
        self.frames.0.get_or_init(make)
    }

    /// Data for the quadratic bending energy of its hinges, computed on first use.
    #[must_use]
    pub fn cotangents(&self) -> &Cotangents {
        self.cotangents.0.get_or_init(|| match self.original() {
            Some(original) => original.cotangents().clone(),
            None => Cotangents::of(self.hinges(), &self.rest),
        })
    }

    /// The hinges of its surface, computed on first use.
    #[must_use]
    pub fn hinges(&self) -> &Hinges {
        self.hinges
            .0
            .get_or_init(|| Hinges::of(&self.triangles, &self.rest, &self.partitions))
    }

    /// Its connected parts of several particles, computed on first use.
    #[must_use]
    pub fn components(&self) -> &Arc<Components> {
        self.components.0.get_or_init(|| match self.original() {
            Some(original) => Arc::clone(original.components()),
            None => Arc::new(Components::of(
                self.particles(),
                self.edges.ends(),
                &self.triangles,
                self.tetrahedra.corners(),
            )),
        })
    }

    /// Its contact surface, computed on first use.
    #[must_use]
    pub fn surface(&self) -> &Arc<Surface> {
        self.surface.0.get_or_init(|| match self.original() {
            Some(original) => Arc::clone(original.surface()),
            None => Arc::new(Surface::of(self)),
        })
    }
}
