//! The bodies of a saved scene.

use super::{BuiltBody, Definition, MeshSource, colliders::color, pose};
use crate::{
    effect::OwnEffect,
    scene::{BodySpec, BuiltScene, Look, Material, SceneEffects, StitchTo, VertexSelection},
    solver::{Body, Effects, GroupName, Topology, VertexIndex},
};
use glam::Vec3;
use std::sync::Arc;

/// Deviation of an added body from its rest shape, relative to its size, that is not worth a note.
const RIGID: f64 = 1e-3;

/// A body as it is now.
struct Now<'a> {
    body: &'a Body,
    look: Look,
    /// Effects of an app.
    own: &'a [OwnEffect],
    /// Spawn order, from 1.
    order: u64,
    /// The body of the file that it is, if it is one.
    built: Option<&'a BuiltBody>,
}

impl Definition {
    /// The bodies as they are now, in order.
    pub(super) fn bodies_of(
        &self,
        now: &BuiltScene,
        reasons: &mut Vec<String>,
        notes: &mut Vec<String>,
    ) -> Vec<BodySpec> {
        let all: Vec<Now> = self.now(now);
        let mut specs = Vec::new();
        let mut index = 0;
        while let Some(one) = all.get(index) {
            let copies = self.whole_grid(&all[index..]);
            if let Some(built) = one.built {
                let mut spec = self.changed(built, one, now, reasons);
                if copies == 1 && self.scene.bodies[built.spec].copies.is_some() {
                    spec.position = self.scene.bodies[built.spec].places()[built.copy];
                    spec.copies = None;
                    spec.groups = groups(&built.body.topology);
                    spec.name = one.body.name.clone();
                }
                specs.push(spec);
            } else {
                specs.extend(self.added_body(one, reasons, notes));
            }
            index += copies;
        }
        specs
    }

    fn now<'a>(&'a self, now: &'a BuiltScene) -> Vec<Now<'a>> {
        // The emitter makes its copies again.
        let lasts = |(_, body): &(usize, &Body)| body.particles.emission.source().is_none();
        let bodies = now.world.bodies.iter().enumerate().filter(lasts);
        let found = bodies.map(|(index, body)| {
            let order = now.places.as_ref().and_then(|it| it.bodies.get(index));
            let order = order.map_or(index as u64 + 1, |order| order.get());
            let built = self
                .bodies
                .get(order as usize - 1)
                .filter(|built| Arc::ptr_eq(&built.body.topology, original(&body.topology)));
            Now {
                body,
                look: now.looks.get(index).copied().unwrap_or_default(),
                own: now.own.get(index).map_or(&[], Vec::as_slice),
                order,
                built,
            }
        });
        found.collect()
    }

    /// Number of bodies at the start of a list that one entry of the file still describes: all
    /// copies of a grid that were changed alike, or else 1.
    fn whole_grid(&self, all: &[Now]) -> usize {
        let Some(first) = all.first().and_then(|one| Some((one, one.built?))) else {
            return 1;
        };
        let (first, built) = first;
        let members = self
            .bodies
            .iter()
            .filter(|it| it.spec == built.spec)
            .count();
        let alike = |(copy, one): (usize, &Now)| {
            one.built.is_some_and(|it| {
                (it.spec, it.copy) == (built.spec, copy)
                    && one.body.name == it.body.name
                    && same_pins(one.body, &it.body)
                    && one.look.color == first.look.color
                    && one.body.density == first.body.density
                    && one.body.added_mass == first.body.added_mass
                    && one.body.sleep == first.body.sleep
                    && without_grab(&one.body.effects) == without_grab(&first.body.effects)
                    && one.own == first.own
                    && one.body.stitches.all().len() == first.body.stitches.all().len()
            })
        };
        let whole = all.len() >= members && all[..members].iter().enumerate().all(alike);
        if whole { members } else { 1 }
    }

    /// The entry of the file with the changes that were made to the body.
    fn changed(
        &self,
        built: &BuiltBody,
        one: &Now,
        now: &BuiltScene,
        reasons: &mut Vec<String>,
    ) -> BodySpec {
        let mut spec = self.scene.bodies[built.spec].clone();
        let body = one.body;
        if spec.copies.is_none() {
            spec.name = body.name.clone();
        }
        let effects = without_grab(&body.effects);
        if effects != without_grab(&built.body.effects) || body.density != built.body.density {
            write_effects(&mut spec, body, effects);
        }
        spec.effects.own = one.own.to_vec();
        spec.added_mass.clone_from(&body.added_mass);
        spec.sleep = body.sleep;
        if !same_pins(body, &built.body) {
            spec.pins = pins(body);
        }
        if one.look.color != built.color {
            spec.color = color(one.look.color);
        }
        if body.stitches.all().len() != built.body.stitches.all().len() {
            spec.stitches.clear();
        }
        self.renumber(&mut spec, now, reasons);
        spec
    }

    /// Numbers the colliders of stitches and names the bodies as they are now.
    fn renumber(&self, spec: &mut BodySpec, now: &BuiltScene, reasons: &mut Vec<String>) {
        let count = now.world.colliders.len();
        let origins: Vec<_> = (0..count).map(|index| self.origin(now, index)).collect();
        let (name, mut lost) = (&spec.name, false);
        spec.stitches.retain_mut(|stitch| {
            let number = match &mut stitch.to {
                StitchTo::Point(_) => return true,
                StitchTo::Collider(number) => number,
                StitchTo::Body(name) | StitchTo::BodyPoint(name, _) => {
                    let built = self.bodies.iter().find(|it| it.body.name == *name);
                    let all = self.now(now);
                    let of = |one: &&Now| {
                        one.built
                            .zip(built)
                            .is_some_and(|(a, b)| std::ptr::eq(a, b))
                    };
                    let found = all.iter().find(of).map(|one| one.body.name.clone());
                    return found.map(|found| *name = found).is_some();
                }
            };
            let before = (*number as usize).wrapping_sub(1);
            let place = origins.iter().position(|origin| *origin == Some(before));
            if let Some(place) = place {
                *number = place as u32 + 1;
                let moved = now.world.colliders[place].start != self.colliders[before].start;
                lost |= moved;
            }
            place.is_some()
        });
        if lost {
            reasons.push(format!(
                "{name} is stitched to a collider that was moved, and would be torn at the start"
            ));
        }
    }

    /// The entry of a body that was added.
    fn added_body(
        &self,
        one: &Now,
        reasons: &mut Vec<String>,
        notes: &mut Vec<String>,
    ) -> Option<BodySpec> {
        let (body, name) = (one.body, &one.body.name);
        let topology = original(&body.topology);
        let Some(source) = self.mesh_of(topology) else {
            reasons.push(format!("{name}: the source of its mesh is unknown"));
            return None;
        };
        if !body.stitches.is_empty() {
            reasons.push(format!("{name}: stitches of an added body"));
            return None;
        }
        let added = self.added.values().zip(self.added.keys());
        let begun = added
            .filter(|(_, order)| order.get() == one.order)
            .map(|(new, _)| &new.body)
            .find(|start| Arc::ptr_eq(original(&start.topology), topology))
            .unwrap_or(body);
        let points: Vec<Vec3> = begun
            .particles
            .positions
            .iter()
            .map(|x| x.truncate())
            .collect();
        let pose = pose::rigid(&topology.rest, &points);
        if pose.deviation > RIGID {
            notes.push(format!(
                "{name} begins in its rest shape: a scene file does not contain its deformation"
            ));
        }
        let mut spec = BodySpec {
            name: name.clone(),
            primitive: None,
            mesh: None,
            hair: None,
            material: None,
            density: None,
            added_mass: body.added_mass.clone(),
            position: pose.position,
            rotation: pose.rotation,
            velocity: mean_velocity(begun),
            spin: Vec3::ZERO,
            effects: SceneEffects::default(),
            sleep: body.sleep,
            groups: groups(topology),
            pins: pins(body),
            stitches: Vec::new(),
            cuts: Vec::new(),
            start: Vec::new(),
            copies: None,
            color: color(one.look.color),
        };
        match source {
            MeshSource::Primitive(primitive) => spec.primitive = Some(primitive),
            MeshSource::File(mesh) => spec.mesh = Some(mesh),
            MeshSource::Hair(hair) => spec.hair = Some(hair),
        }
        write_effects(&mut spec, body, without_grab(&body.effects));
        spec.effects.own = one.own.to_vec();
        Some(spec)
    }

    /// The definition of a mesh, from the bodies that were added or those of the file.
    fn mesh_of(&self, topology: &Arc<Topology>) -> Option<MeshSource> {
        let known = self.meshes.iter().find(|(it, _)| Arc::ptr_eq(it, topology));
        if let Some((_, source)) = known {
            return Some(source.clone());
        }
        let mut bodies = self.bodies.iter();
        // A body with initial cuts has another mesh than its entry names.
        let built = bodies.find(|it| {
            Arc::ptr_eq(&it.body.topology, topology) && self.scene.bodies[it.spec].cuts.is_empty()
        })?;
        let spec = &self.scene.bodies[built.spec];
        let primitive = spec.primitive.map(MeshSource::Primitive);
        let mesh = || spec.mesh.clone().map(MeshSource::File);
        let hair = || spec.hair.clone().map(MeshSource::Hair);
        primitive.or_else(mesh).or_else(hair)
    }
}

/// The mesh as it was before plastic flow.
fn original(topology: &Arc<Topology>) -> &Arc<Topology> {
    topology.original().unwrap_or(topology)
}

fn without_grab(effects: &Effects) -> Effects {
    Effects {
        grab: None,
        ..*effects
    }
}

fn same_pins(a: &Body, b: &Body) -> bool {
    sorted(&a.pins) == sorted(&b.pins)
}

fn sorted(pins: &[VertexIndex]) -> Vec<VertexIndex> {
    let mut pins = pins.to_vec();
    pins.sort_unstable();
    pins.dedup();
    pins
}

fn pins(body: &Body) -> Vec<VertexSelection> {
    sorted(&body.pins)
        .into_iter()
        .map(VertexSelection::Vertex)
        .collect()
}

/// The groups by their vertices, without those that arose from cuts.
fn groups(topology: &Topology) -> Vec<(GroupName, Vec<VertexSelection>)> {
    let before = topology.particles() - topology.splits();
    let group = |name: &GroupName| {
        let particles = topology.groups.particles(*name);
        let vertices = particles.map(|particle| topology.numbering.vertex(particle));
        let mut vertices: Vec<_> = vertices.filter(|it| it.index() < before).collect();
        vertices.sort_unstable();
        (
            *name,
            vertices.into_iter().map(VertexSelection::Vertex).collect(),
        )
    };
    topology.groups.names().iter().map(group).collect()
}

/// Writes density and effects. The material stays if the body is still made of it.
fn write_effects(spec: &mut BodySpec, body: &Body, effects: Effects) {
    let material = spec.material.as_deref().and_then(Material::find);
    if !material.is_some_and(|material| material.describes(body.density, &effects)) {
        spec.material = None;
    }
    spec.density = Some(body.density);
    spec.effects = effects.into();
}

/// Velocity of the center of mass [m/s]; zero if no particle can move.
fn mean_velocity(body: &Body) -> Vec3 {
    let particles = &body.particles;
    let movable = (0..particles.len()).filter(|&i| particles.positions[i].w > 0.0);
    let (mut sum, mut mass) = (glam::DVec3::ZERO, 0.0);
    for i in movable {
        let m = 1.0 / f64::from(particles.positions[i].w);
        sum += particles.velocity_f64(i) * m;
        mass += m;
    }
    if mass > 0.0 {
        (sum / mass).as_vec3()
    } else {
        Vec3::ZERO
    }
}
