//! Box, ball, torus and cylinder of tetrahedra.
//!
//! The box is a grid. The ball is filled by lattice stuffing ([`lattice`](super::super::lattice)).
//! Torus and cylinder are a disc swept along a line, with a smooth surface and flat ends.

use glam::{DVec2, DVec3, UVec3, Vec3};

use crate::{
    MeshError,
    clean::keep_used,
    elements::{boundary_triangles, edges, tetrahedron_volume},
    lattice::{Lattice, stuff},
};
use pliant_solver::RestShape;

/// A box of cubes, each of five tetrahedra: one in the middle and one at every second corner. Cubes
/// that share a face are mirrored, so that both split it into the same triangles.
pub(super) fn cuboid(size: Vec3, cells: UVec3) -> RestShape {
    let mut vertices = Vec::new();
    for k in 0..=cells.z {
        for j in 0..=cells.y {
            for i in 0..=cells.x {
                let fraction = UVec3::new(i, j, k).as_vec3() / cells.as_vec3();
                vertices.push((fraction - 0.5) * size);
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for k in 0..cells.z {
        for j in 0..cells.y {
            for i in 0..cells.x {
                let odd = (i + j + k) % 2;
                // Corner (x, y, z) of the cube, mirrored along x in every second cube.
                let corner = |x: u32, y: u32, z: u32| {
                    let at = UVec3::new(i + (x ^ odd), j + y, k + z);
                    at.x + (cells.x + 1) * (at.y + (cells.y + 1) * at.z)
                };
                let [a, b, c, d] = [
                    corner(0, 0, 0),
                    corner(1, 1, 0),
                    corner(1, 0, 1),
                    corner(0, 1, 1),
                ];
                let mut cube = [
                    [a, c, b, d],
                    [corner(1, 0, 0), a, c, b],
                    [corner(0, 1, 0), b, d, a],
                    [corner(0, 0, 1), c, a, d],
                    [corner(1, 1, 1), d, b, c],
                ];
                if odd == 1 {
                    cube.iter_mut().for_each(|t| t.swap(2, 3));
                }
                tetrahedra.extend(cube);
            }
        }
    }
    solid_of(vertices, tetrahedra)
}

/// A ball with `cells` cubes of a lattice across.
pub(super) fn sphere(radius: f32, cells: u32) -> Result<RestShape, MeshError> {
    let lattice = Lattice::around(DVec3::ONE, 2.0 / f64::from(cells));
    let field: Vec<f64> = lattice.points().iter().map(|p| 1.0 - p.length()).collect();
    let mut ball = stuff(&lattice, &field)?;
    keep_used(&mut ball.vertices, &mut ball.tetrahedra);
    let scaled = ball
        .vertices
        .iter()
        .map(|p| (*p * f64::from(radius)).as_vec3());
    Ok(solid_of(scaled.collect(), ball.tetrahedra))
}

/// A unit disc of triangles in rings around its center, with 6k points on ring k, which makes all
/// triangles nearly equilateral.
struct Disc {
    points: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

impl Disc {
    fn new(rings: u32) -> Self {
        let first = |ring: u32| {
            if ring == 0 {
                0
            } else {
                1 + 3 * ring * (ring - 1)
            }
        };
        let mut points = vec![DVec2::ZERO];
        let mut triangles = Vec::new();
        for ring in 1..=rings {
            let radius = f64::from(ring) / f64::from(rings);
            points.extend((0..6 * ring).map(|k| on_circle(k, 6 * ring) * radius));
            let outer = |sector: u32, k: u32| first(ring) + (sector * ring + k) % (6 * ring);
            let inner = |sector: u32, k: u32| {
                first(ring - 1) + (sector * (ring - 1) + k) % (6 * (ring - 1)).max(1)
            };
            for sector in 0..6 {
                for k in 0..ring {
                    let base = [outer(sector, k), outer(sector, k + 1)];
                    triangles.push([base[0], base[1], inner(sector, k)]);
                    if k + 1 < ring {
                        triangles.push([inner(sector, k), base[1], inner(sector, k + 1)]);
                    }
                }
            }
        }
        Self { points, triangles }
    }
}

fn on_circle(k: u32, of: u32) -> DVec2 {
    let angle = 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(of);
    DVec2::new(libm::cos(angle), libm::sin(angle))
}

/// Copies of a disc, one per station, joined by prisms of three tetrahedra each. The diagonal of
/// each side of a prism starts at the smaller index, so that adjacent prisms agree.
fn sweep(
    disc: &Disc,
    stations: u32,
    closed: bool,
    place: impl Fn(u32, DVec2) -> DVec3,
) -> RestShape {
    let per_station = disc.points.len() as u32;
    let vertices: Vec<DVec3> = (0..stations)
        .flat_map(|station| disc.points.iter().map(move |p| (station, *p)))
        .map(|(station, p)| place(station, p))
        .collect();
    let mut tetrahedra = Vec::new();
    let spans = if closed { stations } else { stations - 1 };
    for station in 0..spans {
        let next = (station + 1) % stations;
        for triangle in &disc.triangles {
            let mut corners = *triangle;
            corners.sort_unstable();
            let [a, b, c] = corners.map(|i| station * per_station + i);
            let [d, e, f] = corners.map(|i| next * per_station + i);
            for mut t in [[a, b, c, f], [a, b, e, f], [a, d, e, f]] {
                if tetrahedron_volume(t.map(|i| vertices[i as usize])) < 0.0 {
                    t.swap(2, 3);
                }
                tetrahedra.push(t);
            }
        }
    }
    solid_of(vertices.iter().map(|p| p.as_vec3()).collect(), tetrahedra)
}

fn rings(cells: u32) -> u32 {
    cells.div_ceil(2)
}

/// Number of cells that fit into a length, at least `least`. The count is capped far above any
/// limit, so that it does not overflow.
fn spans(length: f64, cell: f64, least: u32) -> u32 {
    (length / cell).round().clamp(f64::from(least), 1e9) as u32
}

fn swept_tetrahedra(rings: u32, spans: u32) -> u64 {
    let rings = u64::from(rings);
    rings
        .saturating_mul(rings)
        .saturating_mul(18)
        .saturating_mul(u64::from(spans))
}

fn cylinder_layers(radius: f32, height: f32, cells: u32) -> u32 {
    spans(
        f64::from(height),
        f64::from(radius) / f64::from(rings(cells)),
        1,
    )
}

/// Number of tetrahedra that [`cylinder`] makes.
pub(super) fn cylinder_tetrahedra(radius: f32, height: f32, cells: u32) -> u64 {
    swept_tetrahedra(rings(cells), cylinder_layers(radius, height, cells))
}

/// A cylinder around the y axis.
pub(super) fn cylinder(radius: f32, height: f32, cells: u32) -> RestShape {
    let layers = cylinder_layers(radius, height, cells);
    let (radius, height) = (f64::from(radius), f64::from(height));
    sweep(&Disc::new(rings(cells)), layers + 1, false, |layer, p| {
        let y = height * (f64::from(layer) / f64::from(layers) - 0.5);
        DVec3::new(p.x * radius, y, p.y * radius)
    })
}

fn torus_stations(major: f32, minor: f32, cells: u32) -> u32 {
    let length = 2.0 * std::f64::consts::PI * f64::from(major);
    spans(length, f64::from(minor) / f64::from(rings(cells)), 12)
}

/// Number of tetrahedra that [`torus`] makes.
pub(super) fn torus_tetrahedra(major: f32, minor: f32, cells: u32) -> u64 {
    swept_tetrahedra(rings(cells), torus_stations(major, minor, cells))
}

/// A torus around the y axis.
pub(super) fn torus(major: f32, minor: f32, cells: u32) -> RestShape {
    let stations = torus_stations(major, minor, cells);
    let (major, minor) = (f64::from(major), f64::from(minor));
    sweep(&Disc::new(rings(cells)), stations, true, |station, p| {
        let around = on_circle(station, stations);
        let from_axis = around * (major + p.x * minor);
        DVec3::new(from_axis.x, p.y * minor, from_axis.y)
    })
}

/// A solid made of tetrahedra alone, with its edges and its boundary.
fn solid_of(vertices: Vec<Vec3>, tetrahedra: Vec<[u32; 4]>) -> RestShape {
    RestShape {
        edges: edges(&tetrahedra, &[]),
        triangles: boundary_triangles(&tetrahedra),
        vertices,
        tetrahedra,
        ..RestShape::default()
    }
}
