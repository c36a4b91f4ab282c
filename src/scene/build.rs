//! Builds a plain world from a scene, with the skins of its bodies.

use super::{
    Answer, BodySpec, CameraSpec, ColliderError, ColliderSpec, Look, Material, PartBounds, Region,
    ScalpSpec, Scene, SceneError, ShapeSpec, asset,
    collider_notes::collider_notes,
    overlap_note::overlap_note,
    select::{add_groups, check_group, select},
    stitches::{join, stitches},
    substeps::{choose, is_automatic},
};
use crate::{
    effect::{OwnEffect, OwnEffects},
    mesh::{self, Bounds, BuildOptions, FileMesh, Skin, SoftMesh, Treatment, read::Parts},
    simulation::SpawnOrders,
    solver::{
        Body, Collider, ColliderMesh, ColliderShape, Cut, Effects, InvalidValue, MAX_COORDINATE,
        Pose, RestShape, RodShape, Topology, VertexIndex, World, contact::rotation_degrees,
        deform::deform, direct, measure, topology::Dimension,
    },
    suggestion::similar,
};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::{path::PathBuf, sync::Arc};

/// A scene that has been built.
#[derive(Debug, Clone)]
pub struct BuiltScene {
    /// Bodies, colliders and settings.
    pub world: World,
    /// The skin of each body; `None` if its own triangles are its surface.
    pub skins: Vec<Option<Arc<Skin>>>,
    /// The appearance of each body.
    pub looks: Vec<Look>,
    /// Appearances of the colliders, in the order of `world.colliders`.
    pub collider_looks: Vec<Look>,
    /// Spawn orders of bodies and colliders of a restored state; `None` for a new scene, which
    /// numbers them in order.
    pub places: Option<SpawnOrders>,
    /// Direction of the initial view.
    pub camera: Option<CameraSpec>,
    /// Region that the initial view shows in addition to bodies and colliders.
    pub frame: Option<Region>,
    /// Repairs and omissions in meshes, in one sentence each.
    pub notes: Vec<String>,
    /// Effects of an app on each body; may end before the last body.
    pub own: Vec<Vec<OwnEffect>>,
    /// The effects of the app, with which it [runs](super::run::headless).
    pub own_effects: OwnEffects,
}

/// The mesh of a body of a scene.
struct BodyMesh {
    topology: Arc<Topology>,
    skin: Option<Arc<Skin>>,
    notes: Vec<String>,
}

/// Number of meshes that are built concurrently.
const MESHES_AT_ONCE: usize = 8;

impl Scene {
    /// Builds meshes, fills surfaces, places bodies.
    ///
    /// # Errors
    /// [`SceneError`] with the body or collider and what is wrong with it.
    pub fn build(&self) -> Result<BuiltScene, SceneError> {
        let mut built = BuiltScene {
            world: World {
                settings: self.world,
                sleep: self.sleep,
                ..World::default()
            },
            skins: Vec::new(),
            looks: Vec::new(),
            collider_looks: Vec::new(),
            places: None,
            camera: self.camera,
            frame: self.frame,
            notes: self.notes.clone(),
            own: Vec::new(),
            own_effects: self.own_effects.clone(),
        };
        for (place, spec) in self.colliders.iter().enumerate() {
            let (collider, notes) = self.collider(spec).map_err(|error| SceneError::Collider {
                index: place + 1,
                error,
            })?;
            let notes = notes.into_iter();
            let number = place + 1;
            built
                .notes
                .extend(notes.map(|note| format!("collider {number}: {note}")));
            built.world.colliders.push(collider);
            let look = collider_look(spec).map_err(|message| SceneError::Collider {
                index: number,
                error: ColliderError::Look(message),
            })?;
            built.collider_looks.push(look);
        }
        // A few at a time, so that a limit is detected before many more are built.
        for specs in self.bodies.chunks(MESHES_AT_ONCE) {
            let meshes: Vec<_> = specs.par_iter().map(|spec| self.body_mesh(spec)).collect();
            for (spec, mesh) in specs.iter().zip(meshes) {
                self.add(spec, mesh?, &mut built)?;
            }
        }
        join(self, &mut built.world)?;
        if self.chooses_substeps {
            self.choose_substeps(&mut built);
        }
        self.check_view()?;
        self.acceptance.check(&built.world)?;
        self.check_answers(&built.world)?;
        built.notes.extend(collider_notes(&built.world));
        built.notes.extend(overlap_note(&built.world));
        Ok(built)
    }

    /// Chooses the substeps for the bodies that were filled with an automatic number of cells.
    fn choose_substeps(&self, built: &mut BuiltScene) {
        let mut bodies = built.world.bodies.iter().zip(&built.skins);
        let firsts = self.bodies.iter().filter_map(|spec| {
            // Copies are alike. Only what was filled has a skin.
            let (body, skin) = bodies.by_ref().nth(spec.places().len() - 1)?;
            (is_automatic(spec) && skin.is_some()).then_some(body)
        });
        if let Some((substeps, notes)) = choose(firsts, &built.world) {
            built.world.settings.substeps = substeps;
            built.notes.extend(notes);
        }
    }

    /// Builds the mesh of a body.
    fn body_mesh(&self, spec: &BodySpec) -> Result<BodyMesh, SceneError> {
        check_numbers(spec)?;
        let mut mesh = self.soft_mesh(spec)?;
        let shape = std::mem::take(&mut mesh.shape);
        let mut topology = Topology::new(shape).map_err(|error| SceneError::Topology {
            body: spec.name.clone(),
            error,
        })?;
        let SoftMesh {
            skin,
            points,
            notes,
            ..
        } = mesh;
        add_groups(spec, &mut topology, |part| {
            self.part_vertices(spec, part, skin.as_ref(), &points)
        })?;
        if spec.effects.pressure.is_some()
            && let Err(reason) = topology.enclosure()
        {
            return Err(spec.wrong(format!("cannot apply pressure: {reason}")));
        }
        Ok(BodyMesh {
            topology: Arc::new(topology),
            skin: skin.map(Arc::new),
            notes,
        })
    }

    fn add(
        &self,
        spec: &BodySpec,
        mesh: BodyMesh,
        built: &mut BuiltScene,
    ) -> Result<(), SceneError> {
        let look = Look::new(spec.color.as_deref()).map_err(|message| spec.wrong(message))?;
        let BodyMesh {
            topology,
            skin,
            notes,
        } = mesh;
        let notes = notes.into_iter();
        built
            .notes
            .extend(notes.map(|note| format!("{}: {note}", spec.name)));
        let places = spec.places();
        check_room(spec, &built.world, topology.particles(), places.len())?;
        if !spec.cuts.is_empty() && skin.is_some() {
            let message = "a filled surface cannot have initial cuts; use a primitive or the \
                           treatment `Shell`";
            return Err(spec.wrong(message.to_owned()));
        }
        for (number, &place) in places.iter().enumerate() {
            let name = if places.len() == 1 {
                spec.name.clone()
            } else {
                format!("{} {}", spec.name, number + 1)
            };
            let body = body(spec, name, &topology, (place, &built.world.colliders))?;
            if number == 0
                && body.effects.direct.is_some()
                && let Some(reason) =
                    direct::unfit(&topology, &body.effects, built.world.settings.method)
            {
                return Err(spec.wrong(format!("cannot use the direct solver: {reason}")));
            }
            if number == 0 {
                let notes = contact_notes(&body.effects, &topology).into_iter();
                built
                    .notes
                    .extend(notes.map(|note| format!("{}: {note}", spec.name)));
            }
            built.world.bodies.push(body);
            built.skins.push(skin.clone());
            built.looks.push(look);
            if !spec.effects.own.is_empty() {
                built.own.resize(built.looks.len() - 1, Vec::new());
                built.own.push(spec.effects.own.clone());
            }
        }
        Ok(())
    }

    /// Checks that the view has a direction, and that its region is a box.
    fn check_view(&self) -> Result<(), SceneError> {
        if let Some(CameraSpec { eye, target }) = self.camera
            && !(eye.is_finite() && target.is_finite() && eye != target)
        {
            return Err(SceneError::View(format!(
                "camera looks from {eye} to {target}, but expected two different points with finite \
                 coordinates"
            )));
        }
        if let Some(Region { low, high }) = self.frame
            && !(low.is_finite() && high.is_finite() && low.cmple(high).all())
        {
            return Err(SceneError::View(format!(
                "frame reaches from {low} to {high}, but expected finite corners, low not above high"
            )));
        }
        Ok(())
    }

    /// Checks that the bodies of all analytic solutions exist.
    fn check_answers(&self, world: &World) -> Result<(), SceneError> {
        let names = || world.bodies.iter().map(|body| body.name.as_str());
        let unknown = |answer: &&Answer| !names().any(|name| name == answer.body());
        match self.answers.iter().find(unknown) {
            Some(answer) => Err(SceneError::Answer {
                body: answer.body().to_owned(),
                valid: names().collect::<Vec<_>>().join(", "),
            }),
            None => Ok(()),
        }
    }

    fn soft_mesh(&self, spec: &BodySpec) -> Result<SoftMesh, SceneError> {
        let named = |error| SceneError::Mesh {
            body: spec.name.clone(),
            error,
        };
        match (&spec.primitive, &spec.mesh, &spec.hair) {
            (Some(primitive), None, None) => primitive.build().map_err(named),
            (None, Some(mesh), None) => {
                let (file, bounds) = self
                    .file_mesh(&mesh.file, mesh.part.as_deref(), mesh.bounds)
                    .map_err(named)?;
                mesh::build(file, &mesh.options(bounds)).map_err(named)
            }
            (None, None, Some(hair)) => {
                let scalp = match &hair.scalp {
                    ScalpSpec::Mesh {
                        file,
                        part,
                        bounds,
                        size,
                    } => self.file_surface(file, part.as_deref(), *bounds, *size),
                    ScalpSpec::Surface(primitive) => primitive.build(),
                };
                let hair = scalp.and_then(|scalp| hair.strands.grow(&scalp));
                hair.map_err(named)
            }
            _ => Err(spec.wrong(
                "expected a primitive, a mesh or hair, as in `primitive: Box(size: (1, 1, 1))`, \
                 `mesh: (file: \"bunny\")` or `hair: (scalp: Mesh(file: \"bunny\"))`"
                    .to_owned(),
            )),
        }
    }

    /// Builds a collider, with notes about its mesh.
    fn collider(&self, spec: &ColliderSpec) -> Result<(Collider, Vec<String>), ColliderError> {
        for v in [spec.position, spec.rotation] {
            for component in v.to_array() {
                InvalidValue::unless_finite("position or rotation", component)?;
            }
        }
        let start = Pose {
            rotation: rotation_degrees(spec.rotation),
            translation: spec.position.as_dvec3(),
        };
        let (shape, notes) = match &spec.shape {
            &ShapeSpec::Sphere { radius } => (ColliderShape::Sphere { radius }, Vec::new()),
            &ShapeSpec::Box { size } => (ColliderShape::Box { size }, Vec::new()),
            &ShapeSpec::Capsule { radius, length } => {
                (ColliderShape::Capsule { radius, length }, Vec::new())
            }
            ShapeSpec::Mesh {
                file,
                part,
                bounds,
                size,
            } => mesh_shape(self.file_surface(file, part.as_deref(), *bounds, *size)?)?,
            ShapeSpec::Surface(primitive) => mesh_shape(primitive.build()?)?,
        };
        let collider = Collider::moving(shape, start, spec.path.clone())?;
        Ok((collider, notes))
    }

    /// The mesh files of its bodies and colliders.
    #[must_use]
    pub fn mesh_files(&self) -> Vec<PathBuf> {
        let of_bodies = self.bodies.iter().flat_map(|body| {
            let scalp = body.hair.as_ref().and_then(|hair| match &hair.scalp {
                ScalpSpec::Mesh { file, .. } => Some(file),
                ScalpSpec::Surface(_) => None,
            });
            body.mesh.as_ref().map(|mesh| &mesh.file).or(scalp)
        });
        let of_colliders = self.colliders.iter().filter_map(|it| match &it.shape {
            ShapeSpec::Mesh { file, .. } => Some(file),
            _ => None,
        });
        let files = of_bodies.chain(of_colliders).filter(|file| is_path(file));
        files.map(|file| self.folder.join(file)).collect()
    }

    /// The triangles of a mesh file or of a part of one.
    fn file_surface(
        &self,
        file: &str,
        part: Option<&str>,
        bounds: PartBounds,
        size: Option<f32>,
    ) -> Result<SoftMesh, mesh::MeshError> {
        let (mesh, bounds) = self.file_mesh(file, part, bounds)?;
        let options = BuildOptions {
            size,
            bounds,
            treatment: Treatment::Shell,
            ..BuildOptions::default()
        };
        mesh::build(mesh, &options)
    }

    fn parts(&self, file: &str) -> Result<Parts, mesh::MeshError> {
        if is_path(file) {
            Parts::of_file(&self.folder.join(file))
        } else {
            asset::parts(file)
        }
    }

    /// The vertices of a body that a part of its mesh file became, which has these skin and points.
    fn part_vertices(
        &self,
        spec: &BodySpec,
        part: &str,
        skin: Option<&Skin>,
        points: &[Option<u32>],
    ) -> Result<Vec<VertexIndex>, String> {
        let Some(mesh) = &spec.mesh else {
            return Err(format!("Part(\"{part}\") needs a body with `mesh`"));
        };
        let wrong = |error: mesh::MeshError| error.to_string();
        let parts = self.parts(&mesh.file).map_err(wrong)?;
        let vertices = parts.vertices(part).map_err(wrong)?;
        let body_part = mesh.part.as_deref().map(|name| parts.vertices(name));
        let body_part = body_part.transpose().map_err(wrong)?;
        // The body may itself be a part, which has only its own vertices, in the same order.
        let own = |vertex: u32| match &body_part {
            None => Some(vertex as usize),
            Some(all) => all.binary_search(&vertex).ok(),
        };
        let points = vertices.into_iter().filter_map(|it| points[own(it)?]);
        Ok(match skin {
            None => points.map(VertexIndex).collect(),
            Some(skin) => points
                .flat_map(|point| skin.anchors[point as usize].vertices)
                .collect(),
        })
    }

    /// A mesh file or a part of one, and the bounds of the file if the part keeps its place in them.
    fn file_mesh(
        &self,
        file: &str,
        part: Option<&str>,
        bounds: PartBounds,
    ) -> Result<(FileMesh, Option<Bounds>), mesh::MeshError> {
        let parts = self.parts(file)?;
        let Some(part) = part else {
            return Ok((parts.into_whole(), None));
        };
        let bounds = (bounds == PartBounds::File).then(|| parts.bounds());
        Ok((parts.part(part)?, bounds))
    }
}

/// Whether the name of a mesh is the path of a file, and not the name of a built-in mesh.
pub(super) fn is_path(file: &str) -> bool {
    file.contains('.') && asset::ASSETS.iter().all(|asset| asset.name != file)
}

fn collider_look(spec: &ColliderSpec) -> Result<Look, String> {
    let look = Look {
        opacity: spec.opacity,
        ..Look::new(spec.color.as_deref())?
    };
    let wrong = || format!("opacity is {}, but must be between 0 and 1", spec.opacity);
    look.is_valid().then_some(look).ok_or_else(wrong)
}

fn check_numbers(spec: &BodySpec) -> Result<(), SceneError> {
    for (name, v) in [
        ("position", spec.position),
        ("rotation", spec.rotation),
        ("velocity", spec.velocity),
        ("spin", spec.spin),
        (
            "spacing",
            spec.copies.map_or(Vec3::ZERO, |copies| copies.spacing),
        ),
    ] {
        if !v.is_finite() {
            let message = format!("{name} is {v}, but must be three finite numbers");
            return Err(spec.wrong(message));
        }
    }
    let count = spec.copies.map_or(1, |copies| {
        let [x, y, z] = copies.count.to_array().map(u64::from);
        x.saturating_mul(y).saturating_mul(z)
    });
    if !(1..=MAX_COPIES).contains(&count) {
        let message =
            format!("the number of copies is {count}, but must be between 1 and {MAX_COPIES}");
        return Err(spec.wrong(message));
    }
    let is_far = |place: &Vec3| f64::from(place.abs().max_element()) > MAX_COORDINATE;
    if let Some(place) = spec.places().into_iter().find(is_far) {
        let message = format!(
            "position is {place}, but must be within {MAX_COORDINATE} m of the origin along each axis; \
             move the whole scene nearer to it"
        );
        return Err(spec.wrong(message));
    }
    Ok(())
}

/// Maximum number of copies of a body.
const MAX_COPIES: u64 = 10_000;
/// Maximum number of bodies of a scene.
const MAX_BODIES: usize = 100_000;
/// Maximum number of particles of a scene: about 1.5 GB with edges and tetrahedra.
const MAX_PARTICLES: usize = 4_000_000;

/// Checks the limits before bodies are created.
fn check_room(
    spec: &BodySpec,
    world: &World,
    particles: usize,
    copies: usize,
) -> Result<(), SceneError> {
    let before: usize = world.bodies.iter().map(|body| body.particles.len()).sum();
    for (what, count, most) in [
        ("bodies", world.bodies.len() + copies, MAX_BODIES),
        ("particles", before + particles * copies, MAX_PARTICLES),
    ] {
        if count > most {
            let message = format!(
                "with this body the scene has {count} {what}, but at most {most} are supported; use \
                 fewer copies or cells"
            );
            return Err(spec.wrong(message));
        }
    }
    Ok(())
}

fn body(
    spec: &BodySpec,
    name: String,
    topology: &Arc<Topology>,
    (place, colliders): (Vec3, &[Collider]),
) -> Result<Body, SceneError> {
    let material = material(spec, topology)?;
    let of_material = material.map(Material::body_density).transpose();
    let of_material = of_material.map_err(|error| spec.wrong(error.to_string()))?;
    let density = spec.density.or(of_material).unwrap_or_default();
    let mut body = Body::new(name, Arc::clone(topology), density);
    let turn = rotation_degrees(spec.rotation);
    for (i, rest) in topology.rest.iter().enumerate() {
        let turned: DVec3 = turn * rest.as_dvec3() + place.as_dvec3();
        body.particles.set_position(i, turned);
    }
    body.added_mass.clone_from(&spec.added_mass);
    body.sleep = spec.sleep;
    if let Some(&(vertex, _)) = spec
        .added_mass
        .iter()
        .find(|(vertex, _)| vertex.index() >= topology.particles())
    {
        let last = topology.particles() - 1;
        let message = format!("added_mass refers to vertex {vertex}; expected 0 to {last}");
        return Err(spec.wrong(message));
    }
    check_effects(spec, topology).map_err(|message| spec.wrong(message))?;
    cut(spec, place, &mut body)?;
    let positions = body.particles.positions.iter();
    let positions: Vec<Vec3> = positions.map(|x| x.truncate()).collect();
    let pins = select(&spec.pins, &body.topology, &positions, "pins", |part| {
        Err(format!(
            "Part(\"{part}\") is an entry of `groups`: pin the group, as in `Group(\"{part}\")`"
        ))
    });
    body.pins = pins.map_err(|message| spec.wrong(message))?;
    body.update_masses();
    for &deformation in &spec.start {
        deform(&mut body.particles, deformation);
    }
    body.stitches = stitches(spec, &body, colliders)?;
    let start = &mut body.tick_start.positions;
    start.clone_from(&body.particles.positions);
    body.set_velocity(spec.velocity);
    turn_by(&mut body, spec.spin);
    check_start(spec, &body)?;
    let made = material.map(Material::effects).unwrap_or_default();
    body.effects = Effects {
        stretch: spec.effects.stretch.or(made.stretch),
        bend: spec.effects.bend.or(made.bend),
        neo_hookean: spec.effects.neo_hookean.or(made.neo_hookean),
        membrane: spec.effects.membrane.or(made.membrane),
        ..(&spec.effects).into()
    };
    Ok(body)
}

/// The material of a body, if its dimension supports it.
fn material(spec: &BodySpec, topology: &Topology) -> Result<Option<&'static Material>, SceneError> {
    let Some(name) = &spec.material else {
        return Ok(None);
    };
    let names = |all: &mut dyn Iterator<Item = &'static Material>| {
        all.map(|material| material.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    let Some(material) = Material::find(name) else {
        let valid = names(&mut Material::all().iter());
        let message = format!(
            "unknown material “{name}”{}; expected one of: {valid}",
            similar(name, &valid)
        );
        return Err(spec.wrong(message));
    };
    if material.fits(topology.dimension) {
        return Ok(Some(material));
    }
    let all = Material::all().iter();
    let valid = names(&mut all.filter(|other| other.fits(topology.dimension)));
    let made = match material.dimension() {
        Dimension::Solid => "solids",
        Dimension::Sheet => "sheets",
        Dimension::Line => "ropes",
        Dimension::Grains => "grains",
    };
    let given = match topology.dimension {
        Dimension::Solid => "solid",
        Dimension::Sheet => "a sheet",
        Dimension::Line => "a rope",
        Dimension::Grains => "grains",
    };
    let message = format!(
        "{name} is a material for {made}, but the body is {given}; expected one of: {valid}"
    );
    Err(spec.wrong(message))
}

/// Checks that the initial state is finite: finite parameters can add up to infinity.
fn check_start(spec: &BodySpec, body: &Body) -> Result<(), SceneError> {
    let Some(particle) = body.particles.first_not_finite() else {
        return Ok(());
    };
    let vertex = body.topology.vertex(particle);
    let x = body.particles.positions[particle].truncate();
    let v = body.particles.velocity(particle);
    let message = format!(
        "particle {vertex} starts at {x} m with {v} m/s, but both must be finite; use smaller values \
         of spacing, start, velocity or spin"
    );
    Err(spec.wrong(message))
}

/// Adds ω × r to the velocities of all movable particles, with r from the center of mass.
fn turn_by(body: &mut Body, spin: Vec3) {
    if spin == Vec3::ZERO {
        return;
    }
    let middle = measure::center_of_mass(&body.particles).as_vec3();
    let particles = &mut body.particles;
    for i in 0..particles.len() {
        let x = particles.positions[i];
        if x.w > 0.0 {
            let turned = spin.cross(x.truncate() - middle);
            particles.set_velocity(i, particles.velocity(i) + turned);
        }
    }
}

/// Makes the initial cuts, which are moved with the copies of a body.
fn cut(spec: &BodySpec, place: Vec3, body: &mut Body) -> Result<(), SceneError> {
    for (number, cut) in (1..).zip(&spec.cuts) {
        let cut = Cut {
            eye: cut.eye + (place - spec.position),
            ..*cut
        };
        let wrong = |message: &str| spec.wrong(format!("cut {number}: {message}"));
        if !cut.is_valid() {
            return Err(wrong(
                "expected a finite eye and two finite rays that are not parallel",
            ));
        }
        if body.cut(&cut).is_none() {
            return Err(wrong("it does not divide the body: check `eye` and `rays`"));
        }
    }
    Ok(())
}

/// Checks that the body has what its effects act on.
fn check_effects(spec: &BodySpec, topology: &Topology) -> Result<(), String> {
    let effects = &spec.effects;
    let has_grains = !topology.radii.is_empty();
    let of_grains = [
        (effects.grains.is_some(), "grains"),
        (effects.emitter.is_some(), "emitter"),
    ];
    if let Some((_, name)) = of_grains
        .iter()
        .find(|(carried, _)| *carried && !has_grains)
    {
        return Err(format!(
            "`{name}` needs a body of grains, such as the primitive `Grains`"
        ));
    }
    if effects.tear.is_some() && has_grains {
        return Err("`tear` needs elements that could break; grains have none".to_owned());
    }
    if effects.force_mask.is_some() && has_grains {
        return Err(
            "`force_mask` needs a shape at rest that can be divided; grains have none".to_owned(),
        );
    }
    if let Some(mask) = effects.force_mask
        && !mask.group.is_empty()
    {
        check_group(topology, mask.group).map_err(|message| format!("`force_mask`: {message}"))?;
    }
    match effects.rod {
        Some(_) => RodShape::of(topology)
            .map(drop)
            .map_err(|error| format!("`rod`: {error}")),
        None => Ok(()),
    }
}

/// Notes about thicknesses that a mesh is too fine for.
fn contact_notes(effects: &Effects, topology: &Topology) -> Vec<String> {
    let thicknesses = [
        ("contact", effects.contact.map(|it| it.thickness)),
        ("self_contact", effects.self_contact.map(|it| it.thickness)),
    ];
    let notes = thicknesses.into_iter().filter_map(|(name, thickness)| {
        let thickness = thickness?.get();
        let edge = topology.surface().mean_edge;
        (edge > 0.0 && thickness > edge).then(|| {
            format!(
                "{name}.thickness is {thickness} m, above the mean edge length of {edge:.3} m: contacts \
                 act between distant parts of the surface, which is slow and makes folds stiff; lower \
                 the thickness, or use fewer cells"
            )
        })
    });
    notes.collect()
}

/// Shape of a collider with the triangles of a mesh.
fn mesh_shape(mesh: SoftMesh) -> Result<(ColliderShape, Vec<String>), ColliderError> {
    let RestShape {
        vertices,
        triangles,
        ..
    } = mesh.shape;
    let shape = ColliderMesh::new(&vertices, &triangles)?;
    let mut notes = mesh.notes;
    let holes = shape.open_edges();
    if holes > 0 {
        notes.push(format!(
            "the mesh is open, with {holes} edges of one triangle: bodies touch it on both sides, and \
             may get inside through its openings; close it if it is meant to be solid"
        ));
    }
    Ok((ColliderShape::Mesh(shape), notes))
}
