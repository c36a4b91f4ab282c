//! Strands of hair on a surface.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    MeshError, SoftMesh,
    limits::{SIZES, count, particles, range, sizes},
    scatter::{Root, Surface},
};
use pliant_solver::RestShape;

/// Strands of hair that grow on a surface: their number, shape and region.
///
/// ```
/// use pliant_mesh::{Primitive, Strands};
///
/// let ring = Primitive::Torus { major: 0.2, minor: 0.08, cells: 8 }.build()?;
/// let strands = Strands { count: 50, length: 0.1, segments: 8, ..Strands::default() };
/// let hair = strands.grow(&ring)?;
/// assert_eq!(hair.shape.vertices.len(), 50 * 9); // from root to tip, strand by strand
/// # Ok::<(), pliant_mesh::MeshError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Strands {
    /// Number of strands, from 1; 100 by default.
    pub count: u32,
    /// Length of a strand along its axis [m], from 1e-7 to 1e7; 0.1 by default.
    pub length: f32,
    /// Segments of a strand, from 1; 16 by default.
    pub segments: u32,
    /// Radius of the curls [m]: 0, or from 1e-7 to 1e7; 0 by default.
    pub curl: f32,
    /// Turns of a curl, from 0 to 1e3; 3 by default.
    pub turns: f32,
    /// Largest angle between up (+y) and the normal of a triangle on which strands grow [°], above 0 to
    /// 180; 180, the whole surface, by default.
    pub coverage: f32,
    /// Distance of the roots from the surface along its normal [m], from −1e7 to 1e7; negative values are
    /// inside. 0 by default.
    pub offset: f32,
}

impl Default for Strands {
    fn default() -> Self {
        Self {
            count: 100,
            length: 0.1,
            segments: 16,
            curl: 0.0,
            turns: 3.0,
            coverage: 180.0,
            offset: 0.0,
        }
    }
}

/// Fraction of a strand over which its curl grows to its radius.
const GROWTH: f64 = 0.3;

impl Strands {
    /// Strands on the triangles of a body, which are those of its lattice if it is
    /// [filled](crate::Treatment), in its coordinates: one body of as many chains of edges, with
    /// vertices from root to tip, strand by strand. Roots cover the surface evenly: of five times as many
    /// points, those with close neighbors are removed (Yuksel, *Sample Elimination for Generating Poisson
    /// Disk Sample Sets*, 2015). Strands leave it along its normal, which is interpolated between the
    /// vertices. The same surface gives the same bits.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if a parameter is out of its range, [`MeshError::TooLarge`] beyond
    /// [`MAX_PARTICLES`](crate::MAX_PARTICLES), [`MeshError::Unusable`] if no triangle with an area is
    /// within the `coverage`.
    pub fn grow(&self, scalp: &SoftMesh) -> Result<SoftMesh, MeshError> {
        self.check("count")?;
        range(
            "offset",
            self.offset,
            self.offset.abs() <= *SIZES.end(),
            "a number from -1e7 to 1e7 m",
        )?;
        let surface = Surface::new(&scalp.shape, f64::from(self.coverage))?;
        let mut shape = RestShape::default();
        for Root { at, normal } in surface.roots(self.count) {
            self.add(&mut shape, at, normal, f64::from(self.offset));
        }
        Ok(SoftMesh {
            shape,
            notes: scalp.notes.clone(),
            ..SoftMesh::default()
        })
    }

    /// Checks all parameters but the offset. `number` is the name of the number of strands.
    pub(super) fn check(&self, number: &'static str) -> Result<(), MeshError> {
        sizes([("length", self.length)])?;
        count(number, self.count, 1)?;
        count("segments", self.segments, 1)?;
        particles(u64::from(self.count) * (u64::from(self.segments) + 1))?;
        let valid = self.coverage > 0.0 && self.coverage <= 180.0;
        range("coverage", self.coverage, valid, "a number above 0, to 180")?;
        let valid = self.curl == 0.0 || SIZES.contains(&self.curl);
        range(
            "curl",
            self.curl,
            valid,
            "0, or a number from 1e-7 to 1e7 m",
        )?;
        let valid = (0.0..=1e3).contains(&self.turns);
        range("turns", self.turns, valid, "a number from 0 to 1000")
    }

    /// Adds a strand that begins at a distance from a point in a direction. Its first segment is straight.
    pub(super) fn add(&self, shape: &mut RestShape, point: DVec3, out: DVec3, distance: f64) {
        let (u, v) = out.any_orthonormal_pair();
        let place = |k: u32| -> Vec3 {
            let t = f64::from(k.saturating_sub(1)) / f64::from(self.segments.max(2) - 1);
            let along = f64::from(k) / f64::from(self.segments) * f64::from(self.length);
            let angle = core::f64::consts::TAU * f64::from(self.turns) * t;
            let curl = f64::from(self.curl) * (t / GROWTH).min(1.0);
            let aside = u * (libm::cos(angle) * curl) + v * (libm::sin(angle) * curl);
            (point + out * (distance + along) + aside).as_vec3()
        };
        let first = shape.vertices.len() as u32;
        shape.vertices.extend((0..=self.segments).map(place));
        let edges = (first..first + self.segments).map(|i| [i, i + 1]);
        shape.edges.extend(edges);
    }
}
