//! Volume enclosed by a closed surface, for pressure.

use crate::{Topology, VertexIndex};
use glam::DVec3;
use std::sync::Arc;

/// A surface is flat if its volume is below this fraction of the cube of the body's size: it is
/// then within the rounding of its coordinates.
const FLAT: f64 = 1e-7;

/// Lower bound of gradients in denominators, as the square of a fraction of their rest values.
const FLOOR: f64 = 1e-4;

/// The volume within the surface of a body at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Enclosure {
    /// Rest volume V₀ [m³], above 0.
    pub rest_volume: f64,
    /// 1 if the triangles face outwards, −1 if they face inwards.
    pub outward: f64,
    /// Mean of ‖∇V‖² over all particles at rest [m⁴].
    pub gradient_scale: f64,
}

/// Reason why a surface encloses no volume.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotClosed {
    /// There are no triangles.
    #[error("it has no surface; pressure needs a closed surface")]
    NoSurface,
    /// Boundary edges, of one triangle only.
    #[error(
        "its surface is open: {edges} boundary edges, one of them from vertex {from} to {to}; close \
         the holes"
    )]
    Open {
        /// Number of such edges.
        edges: usize,
        /// A vertex of the first of them.
        from: VertexIndex,
        /// The other one.
        to: VertexIndex,
    },
    /// There are edges of more than two triangles.
    #[error(
        "its surface is not a manifold: {edges} edges have more than two triangles, one of them \
         from vertex {from} to {to}; split the surface there"
    )]
    Branched {
        /// Number of such edges.
        edges: usize,
        /// A vertex of the first of them.
        from: VertexIndex,
        /// The other one.
        to: VertexIndex,
    },
    /// Neighboring triangles are oriented inconsistently.
    #[error(
        "its triangles are not oriented consistently at {edges} edges, one of them from vertex \
         {from} to {to}; flip the triangles on one side"
    )]
    Twisted {
        /// Number of edges between such neighbors.
        edges: usize,
        /// A vertex of the first of them.
        from: VertexIndex,
        /// The other one.
        to: VertexIndex,
    },
    /// It is flat.
    #[error("its surface encloses no volume at rest")]
    Flat,
}

impl Topology {
    /// Volume enclosed by its surface, computed on first use.
    ///
    /// # Errors
    /// [`NotClosed`] if it encloses no volume.
    pub fn enclosure(&self) -> Result<&Enclosure, NotClosed> {
        let find = || Arc::new(Enclosure::of(self));
        let found = self.enclosure.0.get_or_init(find);
        Result::as_ref(found).map_err(|error| *error)
    }
}

impl Enclosure {
    fn of(topology: &Topology) -> Result<Self, NotClosed> {
        check_closed(topology)?;
        let mut gradients = vec![DVec3::ZERO; topology.rest.len()];
        let at = |i: u32| topology.rest[i as usize].as_dvec3();
        let volume = volume_and_gradients(&topology.triangles, at, &mut gradients);
        let size = f64::from(topology.size);
        if volume.abs() <= FLAT * size * size * size {
            return Err(NotClosed::Flat);
        }
        let squares: f64 = gradients.iter().map(|g| g.length_squared()).sum();
        Ok(Self {
            rest_volume: volume.abs(),
            outward: volume.signum(),
            gradient_scale: squares / gradients.len() as f64,
        })
    }

    /// Volume [m³] and its gradients [m²] with the particles `at` positions in m; negative when the
    /// surface is inverted.
    pub fn volume_and_gradients(
        &self,
        topology: &Topology,
        at: impl Fn(u32) -> DVec3,
        gradients: &mut [DVec3],
    ) -> f64 {
        let volume = volume_and_gradients(&topology.triangles, at, gradients);
        if self.outward < 0.0 {
            for gradient in gradients {
                *gradient = -*gradient;
            }
        }
        self.outward * volume
    }

    /// Σw‖∇V‖² [m⁴/kg] of these gradients, with a lower bound from gradients of a hundredth of
    /// their rest values, so that a collapsed body is not thrown; 0 if no particle can move.
    #[must_use]
    pub fn weight(&self, gradients: &[DVec3], w: impl Fn(usize) -> f64) -> f64 {
        let (mut weight, mut sum) = (0.0, 0.0);
        for (i, gradient) in gradients.iter().enumerate() {
            weight += w(i) * gradient.length_squared();
            sum += w(i);
        }
        if weight > 0.0 {
            weight.max(FLOOR * self.gradient_scale * sum)
        } else {
            weight
        }
    }

    /// Volume alone [m³].
    #[must_use]
    pub fn volume(&self, topology: &Topology, at: impl Fn(u32) -> DVec3) -> f64 {
        self.outward * volume(&topology.triangles, at)
    }
}

/// Checks that every edge has two triangles that traverse it in opposite directions.
fn check_closed(topology: &Topology) -> Result<(), NotClosed> {
    if topology.triangles.is_empty() {
        return Err(NotClosed::NoSurface);
    }
    // Ends in ascending order, and whether the triangle goes from the first to the second.
    let mut sides: Vec<([u32; 2], bool)> = topology
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| ([a.min(b), a.max(b)], a < b))
        .collect();
    sides.sort_unstable();
    let wrong = |is: fn(&[([u32; 2], bool)]) -> bool| {
        let mut around = sides.chunk_by(|one, other| one.0 == other.0);
        let mut found = around.by_ref().filter(|around| is(around));
        let [from, to] = found.next()?[0].0.map(|i| topology.vertex(i as usize));
        Some((1 + found.count(), from, to))
    };
    if let Some((edges, from, to)) = wrong(|around| around.len() == 1) {
        return Err(NotClosed::Open { edges, from, to });
    }
    if let Some((edges, from, to)) = wrong(|around| around.len() > 2) {
        return Err(NotClosed::Branched { edges, from, to });
    }
    if let Some((edges, from, to)) = wrong(|around| around[0].1 == around[1].1) {
        return Err(NotClosed::Twisted { edges, from, to });
    }
    Ok(())
}

/// Σ x₀·(x₁ × x₂)/6, relative to a point of the surface, so that distance from the origin costs no
/// precision.
fn volume(triangles: &[[u32; 3]], at: impl Fn(u32) -> DVec3) -> f64 {
    let Some(origin) = triangles.first().map(|corners| at(corners[0])) else {
        return 0.0;
    };
    let six: f64 = triangles
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|i| at(i) - origin);
            a.dot(b.cross(c))
        })
        .sum();
    six / 6.0
}

/// The same with gradients: a third of the area vectors of the triangles around each particle,
/// which equals Σ x₁ × x₂ / 6 where they form a closed fan.
fn volume_and_gradients(
    triangles: &[[u32; 3]],
    at: impl Fn(u32) -> DVec3,
    gradients: &mut [DVec3],
) -> f64 {
    gradients.fill(DVec3::ZERO);
    let Some(origin) = triangles.first().map(|corners| at(corners[0])) else {
        return 0.0;
    };
    let mut six = 0.0;
    for corners in triangles {
        let [a, b, c] = corners.map(|i| at(i) - origin);
        let normal = (b - a).cross(c - a);
        six += a.dot(normal);
        for &i in corners {
            gradients[i as usize] += normal / 6.0;
        }
    }
    six / 6.0
}
