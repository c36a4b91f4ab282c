//! Fills a surface of unit size with a lattice of tetrahedra and checks the volume of the result.

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use super::thin::keep_thin_parts;
use crate::{
    MeshError, TetMesh,
    clean::{counted, keep_used},
    component_of_each,
    elements::{surface_volume, tetrahedron_volume},
    enclosure::Enclosure,
    lattice::{Lattice, stuff},
    orient::{Borders, borders},
    tetrahedra_volume,
};

/// Accepted relative difference between the volume of a filling and that of its surface.
const TOLERANCE: f64 = 0.05;
/// A filling that does not extend beyond the surface is accepted if it lacks at most this fraction
/// of the volume.
const GOOD: f64 = 0.02;
/// Largest number of particles of an automatic resolution, as far as [`MIN_AUTOMATIC`] allows. Gauss-Seidel
/// passes a displacement on by one cell per substep or iteration: fine lattices need many substeps,
/// and invert without them.
const MAX_PARTICLES: usize = 2000;
/// Finest automatic resolution, for the same reason, in cells along the longest side.
const MAX_AUTOMATIC: u32 = 18;
/// Coarsest automatic resolution.
const MIN_AUTOMATIC: u32 = 6;
/// Particles per cell of the lattice: those of its corners and its centers.
const PARTICLES_PER_CELL: f64 = 2.0;
/// Maximum distance by which the tetrahedra may extend beyond the surface, in cells. It compensates
/// for parts too fine for the lattice and for the volume between a curved surface and flat faces.
const FARTHEST: f64 = 0.2;
/// Distances are clamped to this, in cells; it exceeds the distance of any end of a cut edge.
const LIMIT: f64 = 1.05;
/// Bisections of that distance until the volume fits. Five leave 0.006 cells, less than 1 % of the
/// volume of a ball of ten cells.
const HALVINGS: u32 = 5;
/// A piece with less than this fraction of the volume of the largest piece is removed.
const DUST: f64 = 0.01;
/// A surface is a sheet if the norm of its area vector exceeds this fraction of its area. A closed
/// surface has 0, a box without lid 0.2, a half sphere 0.5, a sheet 1.
const SHEET: f64 = 0.6;
/// Sample points along the longest side for estimating the volume of a surface that is not simple.
const SAMPLES: f64 = 24.0;

/// Fills a surface with tetrahedra, with `cells` cubes along the longest side, or as many as
/// [`MAX_PARTICLES`] allows.
pub(super) fn fill(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    cells: Option<u32>,
    notes: &mut Vec<String>,
) -> Result<TetMesh, MeshError> {
    let solid = Solid::new(vertices, triangles, notes)?;
    let volume = solid.volume();
    if volume <= 0.0 {
        return Err(MeshError::unusable(
            "the surface encloses no volume",
            "close it, or import it as a shell, with the treatment `Shell`",
        ));
    }
    let (used, mut filling) = match cells {
        Some(cells) => (cells, solid.fill(cells, volume)?),
        None => solid.fill_within_budget(volume)?,
    };
    let error = volume_of(&filling) / volume - 1.0;
    drop_dust(&mut filling, notes);
    keep_used(&mut filling.vertices, &mut filling.tetrahedra);
    let chosen = match (cells, used) {
        (Some(_), _) => String::new(),
        (None, MAX_AUTOMATIC) => ", the most that are chosen".to_owned(),
        (None, MIN_AUTOMATIC) => ", the fewest that are chosen".to_owned(),
        (None, _) => format!(", chosen for at most {MAX_PARTICLES} particles"),
    };
    notes.push(format!(
        "filled with {used} cells along the longest side{chosen}: {}, {}, {}",
        counted(filling.vertices.len(), "particle", "particles"),
        counted(filling.tetrahedra.len(), "tetrahedron", "tetrahedra"),
        compared(error),
    ));
    Ok(filling)
}

/// The volume of a filling in words, relative to that of its surface.
fn compared(error: f64) -> String {
    let percent = 100.0 * error.abs();
    let sign = if error < 0.0 { "less" } else { "more" };
    match error.abs() {
        under if under < 5e-4 => "the volume of the surface".to_owned(),
        within if within <= TOLERANCE => format!("{percent:.1} % {sign} volume than the surface"),
        _ => format!(
            "{percent:.0} % {sign} volume than the surface (use more cells for a closer fit)"
        ),
    }
}

/// A surface as the boundary of a solid.
struct Solid<'a> {
    vertices: &'a [DVec3],
    triangles: &'a [[u32; 3]],
    enclosure: Enclosure,
    half_extent: DVec3,
    closed: bool,
}

impl<'a> Solid<'a> {
    fn new(
        vertices: &'a [DVec3],
        triangles: &'a [[u32; 3]],
        notes: &mut Vec<String>,
    ) -> Result<Self, MeshError> {
        let Borders { open, branching } = borders(triangles);
        if open > 0 {
            let (mut vector, mut area) = (DVec3::ZERO, 0.0);
            for t in triangles {
                let [a, b, c] = t.map(|i| vertices[i as usize]);
                let own = (b - a).cross(c - a);
                vector += own;
                area += own.length();
            }
            let rim = counted(open, "boundary edge", "boundary edges");
            if vector.length() > SHEET * area {
                return Err(MeshError::unusable(
                    format!("the surface is open ({rim}) and too flat to enclose a volume"),
                    "close it, or import it as a shell, with the treatment `Shell`",
                ));
            }
            notes.push(format!(
                "the surface is open ({rim}); its holes were closed"
            ));
        }
        let half_extent = vertices
            .iter()
            .fold(DVec3::ZERO, |most, p| most.max(p.abs()));
        Ok(Self {
            vertices,
            triangles,
            enclosure: Enclosure::new(vertices, triangles),
            half_extent,
            closed: open == 0 && branching == 0,
        })
    }

    /// Enclosed volume: exact for a closed surface without self-overlap, sampled otherwise.
    fn volume(&self) -> f64 {
        let spacing = 1.0 / SAMPLES;
        let count = (self.half_extent * 2.0 / spacing).ceil().max(DVec3::ONE);
        let cell = self.half_extent * 2.0 / count;
        let count: UVec3 = count.as_uvec3();
        let layer = |z: u32| {
            let (mut simple, mut inside) = (true, 0_u32);
            for (y, x) in (0..count.y).flat_map(|y| (0..count.x).map(move |x| (y, x))) {
                let at = UVec3::new(x, y, z).as_dvec3() + 0.5;
                let winding = self.enclosure.winding_number(at * cell - self.half_extent);
                simple &= (-0.5..1.5).contains(&winding);
                inside += u32::from(winding.abs() > 0.5);
            }
            (simple, inside)
        };
        let (simple, inside) = (0..count.z)
            .into_par_iter()
            .map(layer)
            .reduce(|| (self.closed, 0), |a, b| (a.0 && b.0, a.1 + b.1));
        if simple {
            surface_volume(self.vertices, self.triangles)
        } else {
            f64::from(inside) * cell.element_product()
        }
    }

    /// The finest filling within the budget of particles, with its resolution.
    fn fill_within_budget(&self, volume: f64) -> Result<(u32, TetMesh), MeshError> {
        let inside = MAX_PARTICLES as f64 / PARTICLES_PER_CELL;
        // Bodies with much surface have more particles than their volume says.
        let mut cells = ((inside / volume).cbrt() as u32).clamp(MIN_AUTOMATIC, MAX_AUTOMATIC);
        loop {
            let mut filling = self.fill(cells, volume)?;
            // The lattice has vertices of no tetrahedron.
            keep_used(&mut filling.vertices, &mut filling.tetrahedra);
            let particles = filling.vertices.len();
            if particles <= MAX_PARTICLES || cells == MIN_AUTOMATIC {
                return Ok((cells, filling));
            }
            let excess = particles as f64 / MAX_PARTICLES as f64;
            let fewer = (f64::from(cells) / excess.cbrt()) as u32;
            cells = fewer.clamp(MIN_AUTOMATIC, cells - 1);
        }
    }

    /// Tetrahedra at a given resolution, extended beyond the surface as far as needed for the
    /// volume, within the limit.
    fn fill(&self, cells: u32, volume: f64) -> Result<TetMesh, MeshError> {
        let lattice = Lattice::around(self.half_extent, 1.0 / f64::from(cells));
        let mut distances = self.distances(&lattice);
        keep_thin_parts(&lattice, &mut distances, self.vertices, self.triangles);
        let reaching = |beyond: f64| {
            let field: Vec<f64> = distances.iter().map(|d| d + beyond).collect();
            stuff(&lattice, &field)
        };
        let on_surface = reaching(0.0)?;
        if volume_of(&on_surface) >= volume * (1.0 - GOOD) {
            return Ok(on_surface);
        }
        let (mut too_near, mut far) = (0.0, FARTHEST * lattice.spacing);
        for _ in 0..HALVINGS {
            let between = 0.5 * (too_near + far);
            if volume_of(&reaching(between)?) < volume {
                too_near = between;
            } else {
                far = between;
            }
        }
        reaching(far)
    }

    /// Signed distances of the lattice points from the surface, positive inside. Beyond one or two
    /// cells only the sign matters, and the distance is clamped.
    fn distances(&self, lattice: &Lattice) -> Vec<f64> {
        let limit = LIMIT * lattice.spacing;
        let of_row = |row: &[DVec3]| {
            let (mut inside, mut reach) = (false, 0.0);
            let signed = row.iter().map(|&point| {
                let distance = self.enclosure.distance(point, limit);
                // A point closer to its neighbor than the neighbor is to a closed surface lies on
                // the same side.
                if !self.closed || reach <= lattice.spacing {
                    inside = self.enclosure.contains(point);
                }
                reach = distance;
                if inside { distance } else { -distance }
            });
            signed.collect::<Vec<_>>()
        };
        let points = lattice.points();
        lattice.rows(&points).flat_map_iter(of_row).collect()
    }
}

fn volume_of(filling: &TetMesh) -> f64 {
    tetrahedra_volume(&filling.vertices, &filling.tetrahedra)
}

/// Removes pieces that are tiny compared with the largest, and notes how many pieces remain.
fn drop_dust(filling: &mut TetMesh, notes: &mut Vec<String>) {
    let piece = component_of_each(filling.vertices.len(), &filling.tetrahedra);
    let mut volumes: Vec<f64> = Vec::new();
    for (tetrahedron, &piece) in filling.tetrahedra.iter().zip(&piece) {
        volumes.resize(volumes.len().max(piece as usize + 1), 0.0);
        volumes[piece as usize] +=
            tetrahedron_volume(tetrahedron.map(|i| filling.vertices[i as usize]));
    }
    let largest = volumes.iter().copied().fold(0.0, f64::max);
    let is_dust = |piece: u32| volumes[piece as usize] < DUST * largest;
    let mut pieces = piece.iter();
    filling
        .tetrahedra
        .retain(|_| pieces.next().is_some_and(|piece| !is_dust(*piece)));
    let dust = (0..volumes.len() as u32).filter(|p| is_dust(*p)).count();
    if dust > 0 {
        let pieces = counted(dust, "piece", "pieces");
        notes.push(format!("{pieces} of less than 1 % of the volume removed"));
    }
    if volumes.len() - dust > 1 {
        let pieces = volumes.len() - dust;
        notes.push(format!("the body has {pieces} disconnected pieces"));
    }
}
