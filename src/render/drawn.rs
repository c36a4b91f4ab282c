//! The drawn surface of a body, interpolated between two ticks.
//!
//! Picking, framing, dragging and overlays use it instead of the simulation state, so that they
//! agree with the picture.

use super::{
    balls::{Balls, GrainPositions, UnitSpheres},
    body_mesh::OwnMesh,
    surface::Surface,
    tube::Tube,
};
use bevy::{
    asset::RenderAssetUsages,
    camera::primitives::Aabb,
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use std::{borrow::Cow, sync::Arc};

/// The constant part of a body's drawn surface.
#[derive(Debug, Default)]
pub struct Outline {
    /// Triangles over the points; empty for a rope.
    pub triangles: Vec<[u32; 3]>,
    /// Edges over the points, for a body without triangles.
    pub segments: Vec<[u32; 2]>,
    /// Radius of the drawn segments, or of the largest grain [m].
    pub radius: f32,
    /// Radius of each point [m], for grains.
    pub radii: Vec<f32>,
    /// Whether the triangles enclose a volume.
    pub closed: bool,
    form: Form,
}

/// How the points are turned into a mesh.
#[derive(Debug)]
enum Form {
    Surface(Surface),
    Own(Box<OwnMesh>),
    Tube(Tube),
    Balls(Balls),
}

impl Default for Form {
    fn default() -> Self {
        Self::Surface(Surface::default())
    }
}

impl Outline {
    /// A surface over points at rest that encloses a volume if it is `closed`. Edges between faces
    /// that meet at more than `crease` [rad] stay sharp.
    #[must_use]
    pub fn surface(points: &[Vec3], triangles: Vec<[u32; 3]>, closed: bool, crease: f32) -> Self {
        let form = Form::Surface(Surface::new(points, &triangles, crease));
        Self {
            triangles,
            closed,
            form,
            ..default()
        }
    }

    /// A surface that a mesh of the app draws.
    #[must_use]
    pub(super) fn own(mesh: OwnMesh, triangles: Vec<[u32; 3]>, closed: bool) -> Self {
        Self {
            triangles,
            closed,
            form: Form::Own(Box::new(mesh)),
            ..default()
        }
    }

    /// A rope with a radius [m] over edges.
    #[must_use]
    pub fn rope(segments: Vec<[u32; 2]>, radius: f32) -> Self {
        let form = Form::Tube(Tube::new(&segments, radius));
        Self {
            segments,
            radius,
            form,
            ..default()
        }
    }

    /// Grains of these radii [m].
    #[must_use]
    pub fn grains(radii: Vec<f32>) -> Self {
        Self {
            radius: radii.iter().copied().fold(0.0, f32::max),
            form: Form::Balls(Balls::new(radii.clone())),
            radii,
            ..default()
        }
    }

    /// A mesh with space for the drawn vertices, at the origin, or at rest for a mesh of the app.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        let (count, triangles) = match &self.form {
            Form::Own(own) => return own.mesh(),
            Form::Surface(surface) => (surface.source.len(), surface.triangles.clone()),
            Form::Tube(tube) => (tube.vertices(), tube.triangles()),
            Form::Balls(balls) => (balls.vertices(), balls.triangles()),
        };
        Mesh::new(
            PrimitiveTopology::TriangleList,
            RenderAssetUsages::default(),
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0_f32; 3]; count])
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0_f32; 3]; count])
        .with_inserted_indices(Indices::U32(triangles.into_flattened()))
    }

    /// For each vertex of [`mesh`](Self::mesh), the point that it belongs to.
    #[must_use]
    pub fn copies(&self) -> Cow<'_, [u32]> {
        match &self.form {
            Form::Surface(surface) => Cow::Borrowed(&surface.source),
            Form::Own(own) => Cow::Borrowed(&own.source),
            Form::Tube(tube) => Cow::Owned(tube.copies()),
            Form::Balls(balls) => Cow::Owned(balls.copies()),
        }
    }

    /// Unique pairs of points, the edges of a wireframe.
    #[must_use]
    pub fn wires(&self) -> Vec<[u32; 2]> {
        let sides = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut wires: Vec<[u32; 2]> = sides
            .chain(self.segments.iter().copied())
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        wires.sort_unstable();
        wires.dedup();
        wires
    }

    fn draw(
        &self,
        points: &[Vec3],
        (positions, normals): (&mut [[f32; 3]], &mut [[f32; 3]]),
        sums: &mut Vec<Vec3>,
    ) {
        match &self.form {
            Form::Surface(surface) => surface.draw(points, positions, normals),
            Form::Own(own) => own.draw(points, (positions, normals), sums),
            Form::Tube(tube) => tube.draw(points, positions, normals),
            Form::Balls(balls) => balls.draw(points, positions, normals),
        }
    }
}

/// A body's surface in this frame.
#[derive(Component, Debug, Default)]
pub struct Drawn {
    /// Its constant part.
    pub outline: Arc<Outline>,
    /// Its points [m].
    pub points: Vec<Vec3>,
    /// Its particles [m]; equal to the points if no skin is embedded.
    pub particles: Vec<Vec4>,
    /// Minimum corner of its bounding box [m].
    pub low: Vec3,
    /// Maximum corner of its bounding box [m].
    pub high: Vec3,
    /// Origin of its mesh [m]: the mean of the particles of a body whose `Transform` follows it, else 0.
    pub origin: Vec3,
    /// Number of unit spheres of its mesh, if a vertex shader moves them.
    spheres: Option<usize>,
    /// Drawn vertices, reused from frame to frame to avoid allocations.
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// Sums of areas for them.
    sums: Vec<Vec3>,
}

impl Drawn {
    /// A body with the given outline; `points` must be set before use.
    #[must_use]
    pub fn new(outline: Arc<Outline>) -> Self {
        Self {
            outline,
            ..default()
        }
    }

    /// A body of grains with [`GrainPositions`] and a mesh of at least as many spheres.
    #[must_use]
    pub(super) fn of_grains(outline: Arc<Outline>, spheres: usize) -> Self {
        Self {
            spheres: Some(spheres),
            ..Self::new(outline)
        }
    }

    /// Number of unit spheres of its mesh, if it has [`GrainPositions`].
    #[must_use]
    pub(super) fn spheres(&self) -> Option<usize> {
        self.spheres
    }

    /// For each vertex of its mesh, the point that it belongs to; for spheres without a grain, the last.
    #[must_use]
    pub fn copies(&self) -> Cow<'_, [u32]> {
        let Some(spheres) = self.spheres else {
            return self.outline.copies();
        };
        let mut copies = Balls::new(vec![1.0; spheres]).copies();
        let last = self.outline.radii.len().saturating_sub(1) as u32;
        copies.iter_mut().for_each(|it| *it = last.min(*it));
        Cow::Owned(copies)
    }

    /// Center of the bounding box [m].
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.low.midpoint(self.high)
    }

    /// Recomputes bounds, positions and normals from `points`.
    pub fn refresh(&mut self) {
        let (low, high) = self.points.iter().fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(low, high), &point| (low.min(point), high.max(point)),
        );
        (self.low, self.high) = (low - self.outline.radius, high + self.outline.radius);
        if self.spheres.is_some() {
            return;
        }
        let count = match &self.outline.form {
            Form::Surface(surface) => surface.source.len(),
            Form::Own(own) => own.source.len(),
            Form::Tube(tube) => tube.vertices(),
            Form::Balls(balls) => balls.vertices(),
        };
        self.positions.resize(count, [0.0; 3]);
        self.normals.resize(count, [0.0; 3]);
        let into = (&mut self.positions[..], &mut self.normals[..]);
        self.outline.draw(&self.points, into, &mut self.sums);
    }

    /// Bounds of its mesh, from its origin [m].
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::from_min_max(self.low - self.origin, self.high - self.origin)
    }

    /// Writes centers and radii of its grains.
    pub(super) fn write_grains(&self, grains: &mut GrainPositions) {
        let balls = self.points.iter().zip(&self.outline.radii);
        let grain = |(&center, &radius): (&Vec3, &f32)| (center - self.origin).extend(radius);
        grains.0.clear();
        grains.0.extend(balls.map(grain));
        grains
            .0
            .resize(self.spheres.unwrap_or_default(), Vec4::ZERO);
    }

    /// Copies positions, from its origin, and normals into a mesh of [`Outline::mesh`].
    pub fn write(&self, mesh: &mut Mesh) {
        for (attribute, values) in [
            (Mesh::ATTRIBUTE_POSITION, &self.positions),
            (Mesh::ATTRIBUTE_NORMAL, &self.normals),
        ] {
            if let Some(VertexAttributeValues::Float32x3(into)) = mesh.attribute_mut(attribute) {
                into.clone_from(values);
            }
        }
        if let Form::Own(own) = &self.outline.form {
            own.turn_tangents(&self.positions, &self.normals, mesh);
        }
        if self.origin != Vec3::ZERO
            && let Some(VertexAttributeValues::Float32x3(positions)) =
                mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION)
        {
            for position in positions {
                *position = (Vec3::from(*position) - self.origin).into();
            }
        }
    }
}

/// A mesh of unit spheres, for [`GrainPositions`].
#[must_use]
pub(super) fn mesh_of_spheres(count: usize) -> Mesh {
    let spheres = UnitSpheres::new(count);
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, spheres.positions.clone())
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, spheres.positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, spheres.grains)
    .with_inserted_indices(Indices::U32(spheres.triangles.into_flattened()))
}
