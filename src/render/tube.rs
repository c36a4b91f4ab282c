//! The drawn form of a rope: a tube around its edges.
//!
//! Edges are joined into chains once, at rest. Each frame every point of a chain gets a ring of
//! vertices in a parallel-transported frame.

use bevy::prelude::*;
use std::collections::BTreeMap;

/// Vertices per ring.
const SIDES: usize = 12;

/// A tube around chains of points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tube {
    /// Points of each chain, in order.
    chains: Vec<Vec<u32>>,
    /// Radius [m].
    radius: f32,
}

impl Tube {
    /// A tube with a radius [m] around edges. A chain ends at points where the number of edges is
    /// not two.
    #[must_use]
    pub fn new(edges: &[[u32; 2]], radius: f32) -> Self {
        let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (i, edge) in edges.iter().enumerate() {
            for &end in edge {
                at.entry(end).or_default().push(i);
            }
        }
        let mut used = vec![false; edges.len()];
        let mut chains = Vec::new();
        // First the open chains; the remaining edges form closed loops.
        let ends = at.iter().filter(|(_, meeting)| meeting.len() != 2);
        let starts: Vec<u32> = ends.chain(at.iter()).map(|(&point, _)| point).collect();
        for start in starts {
            while let Some(chain) = follow(start, edges, &at, &mut used) {
                chains.push(chain);
            }
        }
        Self { chains, radius }
    }

    /// Number of drawn vertices: one ring per point, and a ring and a tip at each end.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.chains
            .iter()
            .map(|chain| (chain.len() + 2) * SIDES + 2)
            .sum()
    }

    /// For each drawn vertex, the point that it belongs to.
    #[must_use]
    pub fn copies(&self) -> Vec<u32> {
        let mut copies = Vec::with_capacity(self.vertices());
        for chain in &self.chains {
            let (head, tail) = (chain[0], chain[chain.len() - 1]);
            for &point in [head].iter().chain(chain).chain(&[tail]) {
                copies.extend([point; SIDES]);
            }
            copies.extend([head, tail]);
        }
        copies
    }

    /// Triangles over the drawn vertices.
    #[must_use]
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        let mut first = 0;
        let sides = SIDES as u32;
        for chain in &self.chains {
            let rings = chain.len() as u32 + 2;
            let tip = first + rings * sides;
            for side in 0..sides {
                let next = (side + 1) % sides;
                for ring in 0..rings - 1 {
                    let (here, there) = (first + ring * sides, first + (ring + 1) * sides);
                    triangles.push([here + side, here + next, there + side]);
                    triangles.push([here + next, there + next, there + side]);
                }
                let last = first + (rings - 1) * sides;
                triangles.push([tip, first + next, first + side]);
                triangles.push([tip + 1, last + side, last + next]);
            }
            first = tip + 2;
        }
        triangles
    }

    /// Writes positions and normals of the drawn vertices for the given points.
    pub fn draw(&self, points: &[Vec3], positions: &mut [[f32; 3]], normals: &mut [[f32; 3]]) {
        let mut out = positions.iter_mut().zip(normals);
        let mut put = |position: Vec3, normal: Vec3| {
            if let Some((p, n)) = out.next() {
                *p = position.to_array();
                *n = normal.to_array();
            }
        };
        for chain in &self.chains {
            let line: Vec<Vec3> = chain.iter().map(|&i| points[i as usize]).collect();
            let tangent = |i: usize| {
                let span = line[(i + 1).min(line.len() - 1)] - line[i.saturating_sub(1)];
                span.try_normalize()
            };
            let mut along = tangent(0).unwrap_or(Vec3::Y);
            let mut side = along.any_orthonormal_vector();
            let mut frames = Vec::with_capacity(line.len());
            for i in 0..line.len() {
                let next = tangent(i).unwrap_or(along);
                side = (Quat::from_rotation_arc(along, next) * side)
                    .reject_from(next)
                    .try_normalize()
                    .unwrap_or_else(|| next.any_orthonormal_vector());
                along = next;
                frames.push((along, side));
            }
            let (start, end) = (frames[0], frames[line.len() - 1]);
            let (head, tail) = (line[0], line[line.len() - 1]);
            // The ends are rounded by one narrower ring and a tip.
            let mut ring = |center: Vec3, (along, side): (Vec3, Vec3), size: f32, lean: f32| {
                let other = along.cross(side);
                for k in 0..SIDES {
                    let angle = k as f32 / SIDES as f32 * std::f32::consts::TAU;
                    let out = side * angle.cos() + other * angle.sin();
                    put(
                        center + out * self.radius * size,
                        (out + along * lean).normalize(),
                    );
                }
            };
            ring(head - start.0 * self.radius * 0.7, start, 0.7, -1.0);
            for (&center, &frame) in line.iter().zip(&frames) {
                ring(center, frame, 1.0, 0.0);
            }
            ring(tail + end.0 * self.radius * 0.7, end, 0.7, 1.0);
            put(head - start.0 * self.radius, -start.0);
            put(tail + end.0 * self.radius, end.0);
        }
    }
}

/// The chain that starts at a point, over unused edges.
fn follow(
    start: u32,
    edges: &[[u32; 2]],
    at: &BTreeMap<u32, Vec<usize>>,
    used: &mut [bool],
) -> Option<Vec<u32>> {
    let mut chain = vec![start];
    let mut here = start;
    while let Some(&edge) = at[&here].iter().find(|&&edge| !used[edge]) {
        used[edge] = true;
        let [a, b] = edges[edge];
        here = if a == here { b } else { a };
        chain.push(here);
        if at[&here].len() != 2 {
            break;
        }
    }
    (chain.len() > 1).then_some(chain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rope_is_one_chain_whatever_the_order_of_its_edges() {
        let tube = Tube::new(&[[2, 3], [1, 0], [1, 2]], 0.1);
        assert_eq!(tube.chains, [[0, 1, 2, 3]]);
    }

    #[test]
    fn a_fork_is_three_chains_and_a_loop_is_one_that_closes() {
        assert_eq!(Tube::new(&[[0, 1], [0, 2], [0, 3]], 0.1).chains.len(), 3);
        let ring = Tube::new(&[[0, 1], [1, 2], [2, 0]], 0.1);
        assert_eq!(ring.chains.len(), 1);
        assert_eq!(ring.chains[0].first(), ring.chains[0].last());
    }

    #[test]
    fn every_vertex_is_drawn_and_every_triangle_names_one() {
        let tube = Tube::new(&[[0, 1], [1, 2]], 0.1);
        let count = tube.vertices();
        let mut positions = vec![[f32::NAN; 3]; count];
        let mut normals = positions.clone();
        tube.draw(
            &[Vec3::ZERO, Vec3::X, Vec3::ONE],
            &mut positions,
            &mut normals,
        );
        assert!(
            positions
                .iter()
                .chain(&normals)
                .flatten()
                .all(|x| x.is_finite())
        );
        assert!(
            tube.triangles()
                .iter()
                .flatten()
                .all(|&v| (v as usize) < count)
        );
    }

    #[test]
    fn every_vertex_is_within_reach_of_the_point_that_it_belongs_to() {
        let tube = Tube::new(&[[0, 1], [1, 2]], 0.1);
        let points = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)];
        let mut positions = vec![[0.0; 3]; tube.vertices()];
        let mut normals = positions.clone();
        tube.draw(&points, &mut positions, &mut normals);
        let copies = tube.copies();
        assert_eq!(copies.len(), positions.len());
        for (position, point) in positions.iter().zip(copies) {
            let distance = Vec3::from_array(*position).distance(points[point as usize]);
            // On the ring around the point, or one radius beyond the end.
            assert!(distance < 0.1 + 1e-6, "{distance}");
        }
    }

    #[test]
    fn the_tube_faces_outwards() {
        let tube = Tube::new(&[[0, 1]], 0.1);
        let mut positions = vec![[0.0; 3]; tube.vertices()];
        let mut normals = positions.clone();
        tube.draw(&[Vec3::ZERO, Vec3::X], &mut positions, &mut normals);
        for triangle in tube.triangles() {
            let [a, b, c] = triangle.map(|v| Vec3::from_array(positions[v as usize]));
            let normal: Vec3 = triangle
                .iter()
                .map(|&v| Vec3::from_array(normals[v as usize]))
                .sum();
            assert!(
                (b - a).cross(c - a).dot(normal) > 0.0,
                "{triangle:?} faces inwards"
            );
        }
    }

    #[test]
    fn a_rope_squeezed_to_a_point_stays_finite() {
        let tube = Tube::new(&[[0, 1]], 0.1);
        let mut positions = vec![[0.0; 3]; tube.vertices()];
        let mut normals = positions.clone();
        tube.draw(&[Vec3::ONE; 2], &mut positions, &mut normals);
        assert!(
            positions
                .iter()
                .chain(&normals)
                .flatten()
                .all(|x| x.is_finite())
        );
    }
}
