//! The drawn form of grains: a sphere of triangles around each point, placed by the processor, or by the
//! graphics card in [`GrainBuffer`].

use bevy::{
    math::primitives::Sphere, mesh::VertexAttributeValues, prelude::*,
    render::storage::ShaderBuffer,
};

/// A body of grains that the graphics card draws at the places in this buffer: one `vec4<f32>` for
/// each grain, its center in `xyz` relative to the transform of the body and its radius in `w` [m].
///
/// Without it, the spheres are written into the mesh in every frame, for any material. With it, the
/// mesh never changes: 16 bytes per grain are written instead of 530 to 1970, those of its vertices and
/// indices. It requires a material whose vertex shader reads the buffer. Positions of the mesh are those of
/// a unit sphere around the origin, and `uv.x` is the number of the grain.
#[derive(Component, Debug, Clone, PartialEq, Eq)]
pub struct GrainBuffer(pub Handle<ShaderBuffer>);

impl GrainBuffer {
    /// A buffer for a number of grains, without any until the body is drawn.
    #[must_use]
    pub fn new(grains: usize, buffers: &mut Assets<ShaderBuffer>) -> Self {
        Self(buffers.add(vec![Vec4::ZERO; grains.max(1)]))
    }
}

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

    /// Positions and texture coordinates of the vertices of a mesh for a [`GrainBuffer`].
    #[must_use]
    pub fn unplaced(&self) -> (Vec<[f32; 3]>, Vec<[f32; 2]>) {
        let numbers = 0..self.radii.len() as u32;
        // Exact below 2²⁴ grains.
        let vertices = numbers.flat_map(|grain| {
            let of_grain = [grain as f32, 0.0];
            let directions = self.directions.iter();
            directions.map(move |direction| (direction.to_array(), of_grain))
        });
        vertices.unzip()
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

    /// What a vertex shader makes of the mesh and the buffer is what is drawn without them.
    #[test]
    fn unplaced_spheres_become_the_balls_at_their_places() {
        let radii = vec![0.1, 0.3];
        let outline = Outline::grains(radii.clone());
        let mut drawn = Drawn::buffered(Arc::new(outline));
        drawn.points = vec![Vec3::ZERO, Vec3::X];
        drawn.origin = Vec3::Y;
        let places = drawn.places().expect("grains");

        let balls = Balls::new(radii);
        let mut positions = vec![[f32::NAN; 3]; balls.vertices()];
        let mut normals = positions.clone();
        balls.draw(&drawn.points, &mut positions, &mut normals);
        let (unit, numbers) = balls.unplaced();
        assert_eq!(unit, normals);
        for ((unit, [number, _]), position) in unit.iter().zip(numbers).zip(positions) {
            let place = places[number as usize];
            let placed = place.truncate() + place.w * Vec3::from(*unit) + drawn.origin;
            assert!(placed.distance(Vec3::from(position)) < 1e-6);
        }
    }
}
