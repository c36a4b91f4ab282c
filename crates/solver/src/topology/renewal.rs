//! Bodies of grains that gain and lose grains.

use crate::{
    Mass, ParticleIndex, RestShape, SurfacePoint, Topology, TopologyError, VertexIndex,
    numbering::Numbering,
};
use glam::DVec3;
use std::sync::Arc;

/// A new grain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Birth {
    /// Position [m].
    pub position: DVec3,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Radius [m].
    pub radius: f32,
}

/// What appears in a body of grains and what disappears.
#[derive(Debug, Clone, PartialEq)]
pub struct Renewal {
    /// Particles that stay, in their order.
    pub kept: Vec<u32>,
    /// Grains that follow them.
    pub births: Vec<Birth>,
}

/// A body of grains after a [`Renewal`]. Its vertices have the order of its particles.
#[derive(Debug)]
pub struct Renewed {
    /// The topology.
    pub topology: Arc<Topology>,
    /// Particles of the topology before that stayed, in their order.
    pub kept: Vec<u32>,
}

impl Renewed {
    /// Number of a particle now; `None` if it has disappeared.
    #[must_use]
    pub fn particle(&self, before: u32) -> Option<ParticleIndex> {
        let now = self.kept.binary_search(&before).ok()?;
        Some(ParticleIndex(now as u32))
    }

    /// Number of a vertex of the topology `before` now; `None` if it has disappeared.
    #[must_use]
    pub fn vertex(&self, before: &Topology, vertex: VertexIndex) -> Option<VertexIndex> {
        let particle = self.particle(before.particle(vertex) as u32)?;
        Some(self.topology.numbering.vertex(particle))
    }

    /// Renumbers pins and additional masses of the topology `before`, and removes those of grains that
    /// have disappeared.
    pub(crate) fn keep_attached(
        &self,
        before: &Topology,
        pins: &mut Vec<VertexIndex>,
        added: &mut Vec<(VertexIndex, Mass)>,
    ) {
        let now = |place: &mut VertexIndex| {
            let now = self.vertex(before, *place);
            now.inspect(|now| *place = *now).is_some()
        };
        pins.retain_mut(now);
        added.retain_mut(|(place, _)| now(place));
    }

    /// The same point now; `None` if one of its particles has disappeared.
    #[must_use]
    pub fn point(&self, point: &SurfacePoint) -> Option<SurfacePoint> {
        let terms: Option<Vec<_>> = point
            .terms()
            .map(|(particle, weight)| Some((self.particle(particle.0)?, weight)))
            .collect();
        SurfacePoint::new(&terms?)
    }
}

impl Topology {
    /// The same body of grains after a renewal.
    ///
    /// # Errors
    /// [`TopologyError`] if no grain is left, or a new one has an invalid position or radius.
    pub fn renewed(&self, renewal: &Renewal) -> Result<Renewed, TopologyError> {
        let kept = || renewal.kept.iter().map(|&particle| particle as usize);
        let births = || renewal.births.iter();
        let shape = RestShape {
            vertices: kept()
                .map(|particle| self.rest[particle])
                .chain(births().map(|birth| birth.position.as_vec3()))
                .collect(),
            radii: kept()
                .map(|particle| self.radius(particle))
                .chain(births().map(|birth| birth.radius))
                .collect(),
            ..RestShape::default()
        };
        let mut topology = Self::numbered(shape, Numbering::default())?;
        topology.is_renewed = true;
        let stay = renewal.kept.iter().copied().map(Some);
        let sources = stay.chain(births().map(|_| None));
        topology.groups = self.groups.carried(sources);
        Ok(Renewed {
            topology: Arc::new(topology),
            kept: renewal.kept.clone(),
        })
    }

    /// Whether grains have appeared or disappeared.
    #[must_use]
    pub const fn is_renewed(&self) -> bool {
        self.is_renewed
    }
}
