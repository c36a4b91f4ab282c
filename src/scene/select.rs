//! Vertices that a scene file selects: pins, and named groups.

use super::{BodySpec, SceneError, VertexSelection};
use crate::{
    solver::{
        GroupName, NotARod, ParticleIndex, RodShape, Topology, VertexIndex,
        contact::rotation_degrees, topology::bounds,
    },
    suggestion::similar_of,
};
use glam::{DVec3, Vec3};

/// The vertices of a body at these positions that are selected, each once, ascending. `does` says
/// what an entry does to them, as in “pins”, and `part` finds the vertices of a part of the mesh file.
pub(super) fn select(
    selected: &[VertexSelection],
    topology: &Topology,
    positions: &[Vec3],
    does: &str,
    part: impl Fn(&str) -> Result<Vec<VertexIndex>, String>,
) -> Result<Vec<VertexIndex>, String> {
    let (low, high) = bounds(positions.iter().copied());
    // A layer of particles is not exactly horizontal after a rotation.
    let slack = (high - low).max_element() * 1e-5;
    let mut found = Vec::new();
    for entry in selected {
        let particles = (0..positions.len() as u32).map(ParticleIndex);
        let vertices = particles.map(|particle| topology.numbering.vertex(particle));
        let all = vertices.zip(positions.iter().copied());
        let before = found.len();
        match entry {
            &VertexSelection::Vertex(vertex) => {
                found.extend((vertex.index() < positions.len()).then_some(vertex));
            }
            VertexSelection::Top(fraction)
            | VertexSelection::Bottom(fraction)
            | VertexSelection::Left(fraction)
            | VertexSelection::Right(fraction)
            | VertexSelection::Front(fraction)
            | VertexSelection::Back(fraction) => {
                let toward = match entry {
                    VertexSelection::Top(_) => Vec3::Y,
                    VertexSelection::Bottom(_) => Vec3::NEG_Y,
                    VertexSelection::Left(_) => Vec3::NEG_X,
                    VertexSelection::Right(_) => Vec3::X,
                    VertexSelection::Front(_) => Vec3::Z,
                    _ => Vec3::NEG_Z,
                };
                let farthest = low.dot(toward).max(high.dot(toward));
                let width = (high - low).dot(toward.abs());
                let limit = farthest - width * fraction - slack;
                let beyond = all.filter(|(_, x)| x.dot(toward) >= limit);
                found.extend(beyond.map(|(i, _)| i));
            }
            &VertexSelection::Within { low, high } => {
                let inside = |x: Vec3| x.cmpge(low).all() && x.cmple(high).all();
                found.extend(all.filter(|&(_, x)| inside(x)).map(|(i, _)| i));
            }
            &VertexSelection::Roots(count) => found.extend(roots(topology, count)?),
            &VertexSelection::Group(name) => found.extend(group(topology, name)?),
            VertexSelection::Part(name) => found.extend(part(name)?),
        }
        if found.len() == before {
            let last = positions.len() - 1;
            let entry = ron::to_string(entry).unwrap_or_else(|_| format!("{entry:?}"));
            let [low, high] =
                [low, high].map(|x| Vec3::select(x.abs().cmple(Vec3::splat(slack)), Vec3::ZERO, x));
            return Err(format!(
                "{entry} {does} nothing; the body extends from {low} to {high} m and has vertices 0 to {last}"
            ));
        }
    }
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// The first `count` vertices of each chain of a body.
pub(super) fn roots(topology: &Topology, count: u32) -> Result<Vec<VertexIndex>, String> {
    let shape = match RodShape::of(topology) {
        Err(error @ NotARod::Surface) => return Err(format!("Roots: {error}")),
        shape => shape.unwrap_or_default(),
    };
    if !shape.is_of_chains() || shape.roots(1).next().is_none() {
        return Err(
            "Roots: the body must consist of open chains of edges; this one has branches or rings"
                .into(),
        );
    }
    Ok(shape
        .roots(count)
        .map(|particle| topology.numbering.vertex(particle))
        .collect())
}

/// The vertices of a group of a body.
pub(super) fn group(topology: &Topology, name: GroupName) -> Result<Vec<VertexIndex>, String> {
    check_group(topology, name)?;
    let particles = topology.groups.particles(name);
    Ok(particles.map(|it| topology.numbering.vertex(it)).collect())
}

/// Checks that a body has a group of this name.
pub(super) fn check_group(topology: &Topology, name: GroupName) -> Result<(), String> {
    if topology.groups.contains(name) {
        return Ok(());
    }
    let names = || topology.groups.names().iter().map(GroupName::as_str);
    let valid: Vec<_> = names().collect();
    Err(match valid.is_empty() {
        true => format!("unknown group “{name}”: the body has no `groups`"),
        false => format!(
            "unknown group “{name}”{}; expected one of: {}",
            similar_of(name.as_str(), names()),
            valid.join(", ")
        ),
    })
}

/// Adds the groups of a body, selected at its position before its cuts and `start`.
pub(super) fn add_groups(
    spec: &BodySpec,
    topology: &mut Topology,
    part: impl Fn(&str) -> Result<Vec<VertexIndex>, String>,
) -> Result<(), SceneError> {
    let turn = rotation_degrees(spec.rotation);
    let place = |rest: &Vec3| -> Vec3 {
        let turned: DVec3 = turn * rest.as_dvec3() + spec.position.as_dvec3();
        turned.as_vec3()
    };
    let positions: Vec<Vec3> = match spec.groups.is_empty() {
        true => Vec::new(),
        false => topology.rest.iter().map(place).collect(),
    };
    for (name, selected) in &spec.groups {
        let in_group = |message| spec.wrong(format!("group “{name}”: {message}"));
        if selected.is_empty() {
            let message = "it has no entries; expected vertices, as in `[Top(0.3)]`";
            return Err(in_group(message.to_owned()));
        }
        let vertices =
            select(selected, topology, &positions, "selects", &part).map_err(in_group)?;
        let added = topology.add_group(*name, vertices);
        added.map_err(|error| SceneError::Topology {
            body: spec.name.clone(),
            error,
        })?;
    }
    Ok(())
}
