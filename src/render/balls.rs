//! The drawn form of grains: a sphere of triangles around each point. It is written into the mesh of the
//! body, or moved by a vertex shader with [`GrainPositions`].

use bevy::{math::primitives::Sphere, mesh::VertexAttributeValues, prelude::*};

/// Centers of grains relative to the transform of their body, in `xyz`, and their radii in `w` [m], for a
/// material that moves them on the graphics card. Written in every frame in which the body moves.
///
/// Without this component, the spheres of grains are written into the mesh of the body, for any material.
/// With it, the mesh consists of unit spheres around the origin and stays as it is; `uv.x` is the number of
/// the grain. A vertex shader scales and moves each sphere, in the main pass and in the prepass, which
/// draws shadows. 16 bytes per grain are written instead of 530 to 1970, those of its vertices and indices.
///
/// There are at least as many entries as grains, so that the number seldom changes while grains are
/// emitted; further ones have the radius 0.
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct GrainPositions(pub Vec<Vec4>);

/// Bodies with at most this number of grains have spheres of 80 triangles; others of 20.
const FINE: usize = 4000;

/// Spheres around points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balls {
    radii: Vec<f32>,
    /// Vertices of the unit sphere.
    directions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Balls {
    /// Balls of these radii [m].
    #[must_use]
    pub fn new(radii: Vec<f32>) -> Self {
        let subdivisions = u32::from(radii.len() <= FINE);
        let sphere = Sphere::new(1.0).mesh().ico(subdivisions);
        let (directions, triangles) = sphere.map_or_else(|_| default(), |mesh| unit(&mesh));
        Self {
            radii,
            directions,
            triangles,
        }
    }

    /// Number of drawn vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.radii.len() * self.directions.len()
    }

    /// For each drawn vertex, the point that it belongs to.
    #[must_use]
    pub fn copies(&self) -> Vec<u32> {
        let points = 0..self.radii.len() as u32;
        points
            .flat_map(|point| std::iter::repeat_n(point, self.directions.len()))
            .collect()
    }

    /// Triangles over the drawn vertices.
    #[must_use]
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let each = self.directions.len() as u32;
        let points = 0..self.radii.len() as u32;
        let of_point = |point: u32| {
            let triangles = self.triangles.iter();
            triangles.map(move |triangle| triangle.map(|vertex| point * each + vertex))
        };
        points.flat_map(of_point).collect()
    }

    /// Writes positions and normals of the drawn vertices for the given points.
    pub fn draw(&self, points: &[Vec3], positions: &mut [[f32; 3]], normals: &mut [[f32; 3]]) {
        let each = self.directions.len().max(1);
        let balls = points.iter().zip(&self.radii);
        let out = positions
            .chunks_exact_mut(each)
            .zip(normals.chunks_exact_mut(each));
        for ((&center, &radius), (positions, normals)) in balls.zip(out) {
            let vertices = positions.iter_mut().zip(normals).zip(&self.directions);
            for ((position, normal), &direction) in vertices {
                *position = (center + direction * radius).to_array();
                *normal = direction.to_array();
            }
        }
    }
}

/// Spheres of radius 1 around the origin.
#[derive(Debug)]
pub struct UnitSpheres {
    /// Positions, which are also the normals.
    pub positions: Vec<[f32; 3]>,
    /// Texture coordinates: the number of the sphere, exact below 2²⁴, and 0.
    pub grains: Vec<[f32; 2]>,
    /// Triangles over the vertices.
    pub triangles: Vec<[u32; 3]>,
}

impl UnitSpheres {
    /// A number of spheres.
    #[must_use]
    pub fn new(count: usize) -> Self {
        let balls = Balls::new(vec![1.0; count]);
        let directions = balls.directions.iter().map(|it| it.to_array());
        let vertices = directions.len();
        Self {
            positions: directions.cycle().take(count * vertices).collect(),
            grains: balls.copies().iter().map(|&it| [it as f32, 0.0]).collect(),
            triangles: balls.triangles(),
        }
    }
}

/// Vertices and triangles of the mesh of a unit sphere, each vertex once.
fn unit(mesh: &Mesh) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let Some(VertexAttributeValues::Float32x3(given)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION)
    else {
        return default();
    };
    let mut directions: Vec<Vec3> = Vec::new();
    let place: Vec<u32> = given
        .iter()
        .map(|&at| {
            let at = Vec3::from_array(at);
            let is_same = |other: &Vec3| other.distance_squared(at) < 1e-6;
            let known = directions.iter().position(is_same);
            known.unwrap_or_else(|| {
                directions.push(at);
                directions.len() - 1
            }) as u32
        })
        .collect();
    let indices: Vec<u32> = mesh.indices().map_or_else(Vec::new, |indices| {
        indices.iter().map(|index| place[index]).collect()
    });
    (directions, indices.as_chunks::<3>().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Drawn, Outline};
    use std::sync::Arc;

    #[test]
    fn every_vertex_lies_on_its_ball_and_every_triangle_faces_outwards() {
        let radii = [0.1, 0.3];
        let balls = Balls::new(radii.to_vec());
        let points = [Vec3::ZERO, Vec3::X];
        let mut positions = vec![[f32::NAN; 3]; balls.vertices()];
        let mut normals = positions.clone();
        balls.draw(&points, &mut positions, &mut normals);
        // A sphere of 80 triangles has 42 vertices.
        assert_eq!(positions.len(), 2 * 42);
        for (position, point) in positions.iter().zip(balls.copies()) {
            let (point, at) = (point as usize, Vec3::from_array(*position));
            assert!((at.distance(points[point]) - radii[point]).abs() < 1e-6);
        }
        let triangles = balls.triangles();
        assert_eq!(triangles.len(), 2 * 80);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| Vec3::from_array(positions[v as usize]));
            let normal = Vec3::from_array(normals[triangle[0] as usize]);
            assert!((b - a).cross(c - a).dot(normal) > 0.0);
        }
    }

    /// What a vertex shader makes of the mesh and the positions is what is drawn without them.
    #[test]
    fn unit_spheres_at_the_positions_of_grains_are_their_balls() {
        let radii = vec![0.1, 0.3];
        let mut drawn = Drawn::of_grains(Arc::new(Outline::grains(radii.clone())), 3);
        drawn.points = vec![Vec3::ZERO, Vec3::X];
        drawn.origin = Vec3::Y;
        let mut grains = GrainPositions::default();
        drawn.write_grains(&mut grains);
        assert_eq!(grains.0.len(), 3);
        assert_eq!(grains.0[2], Vec4::ZERO);

        let balls = Balls::new(radii);
        let mut positions = vec![[f32::NAN; 3]; balls.vertices()];
        let mut normals = positions.clone();
        balls.draw(&drawn.points, &mut positions, &mut normals);
        let UnitSpheres {
            positions: unit,
            grains: numbers,
            triangles,
        } = UnitSpheres::new(3);
        assert_eq!(unit[..normals.len()], normals);
        assert_eq!(triangles[..160], balls.triangles());
        assert_eq!(unit.len(), 3 * 42);
        for ((unit, [number, _]), position) in unit.iter().zip(numbers).zip(positions) {
            let grain = grains.0[number as usize];
            let placed = grain.truncate() + grain.w * Vec3::from(*unit) + drawn.origin;
            assert!(placed.distance(Vec3::from(position)) < 1e-6);
        }
        assert_eq!(drawn.copies().len(), 3 * 42);
    }
}
