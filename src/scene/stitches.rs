//! Stitches of a scene: within a body, to colliders, and to other bodies.

use super::{BodySpec, PointSpec, Scene, SceneError, StitchSpec, StitchTo, select};
use crate::{
    mesh,
    solver::{
        Body, Collider, Compliance, ParticleIndex, Stitch, StitchEnd, StitchError, Stitches,
        SurfacePoint, Topology, VertexIndex, World, contact::on_triangle,
    },
    suggestion::similar,
};
use glam::{DVec3, Vec3};

/// A stitch of a body, and its number in the file, from 1.
type Numbered = (usize, Stitch);

/// The stitches of a body within itself and to colliders.
pub(super) fn stitches(
    spec: &BodySpec,
    body: &Body,
    colliders: &[Collider],
) -> Result<Stitches, SceneError> {
    let mut all = Vec::new();
    for (number, it) in (1..).zip(&spec.stitches) {
        let wrong = |message| spec.wrong(format!("stitch {number}: {message}"));
        for point in points(it, body).map_err(wrong)? {
            let to = match &it.to {
                StitchTo::Point(other) => {
                    StitchEnd::Point(surface_point(*other, body).map_err(wrong)?)
                }
                StitchTo::Collider(collider) => {
                    on_collider(&point, body, *collider, colliders).map_err(wrong)?
                }
                // Once the other body is there.
                StitchTo::Body(_) | StitchTo::BodyPoint(..) => continue,
            };
            all.push((number, stitch(it, point, to)));
        }
    }
    checked(spec, body, all)
}

/// Adds the stitches to other bodies, at the places where their points are now.
pub(super) fn join(scene: &Scene, world: &mut World) -> Result<(), SceneError> {
    let mut first = 0;
    for spec in &scene.bodies {
        let copies = spec.places().len();
        let joins = |it: &&StitchSpec| matches!(it.to, StitchTo::Body(_) | StitchTo::BodyPoint(..));
        if spec.stitches.iter().any(|it| joins(&it)) {
            for own in first..first + copies {
                let body = &world.bodies[own];
                // The others have been checked, so that their numbers are not needed again.
                let mut all: Vec<Numbered> = body
                    .stitches
                    .all()
                    .iter()
                    .map(|stitch| (0, *stitch))
                    .collect();
                for (number, it) in (1..).zip(&spec.stitches).filter(|(_, it)| joins(it)) {
                    let wrong = |message| spec.wrong(format!("stitch {number}: {message}"));
                    let points = points(it, body).map_err(wrong)?;
                    let ends = other_ends(it, &points, own, world).map_err(wrong)?;
                    let both = points.into_iter().zip(ends);
                    all.extend(both.map(|(point, to)| (number, stitch(it, point, to))));
                }
                world.bodies[own].stitches = checked(spec, body, all)?;
            }
        }
        first += copies;
    }
    Ok(())
}

fn stitch(spec: &StitchSpec, point: SurfacePoint, to: StitchEnd) -> Stitch {
    let tough = Stitch::strength_of(spec.toughness, spec.compliance);
    Stitch {
        point,
        to,
        compliance: spec.compliance,
        strength: if tough < spec.strength {
            tough
        } else {
            spec.strength
        },
        broken: false,
    }
}

/// The points of a body that a stitch of the file holds: one, or those of all roots.
fn points(spec: &StitchSpec, body: &Body) -> Result<Vec<SurfacePoint>, String> {
    if spec.toughness.get().is_finite() && spec.compliance == Compliance::default() {
        return Err(
            "a rigid stitch stores no energy, so `toughness` needs a `compliance`; or give it a \
             `strength`"
                .into(),
        );
    }
    let vertices = match (spec.point, &spec.to) {
        (PointSpec::Roots(count), StitchTo::Collider(_) | StitchTo::Body(_)) => {
            select::roots(&body.topology, count)?
        }
        (PointSpec::Within { low, high }, StitchTo::Collider(_) | StitchTo::Body(_)) => {
            within(body, low, high)?
        }
        (PointSpec::Group(name), StitchTo::Collider(_) | StitchTo::Body(_)) => {
            select::group(&body.topology, name)?
        }
        (point, _) => return Ok(vec![surface_point(point, body)?]),
    };
    let points = vertices.into_iter().map(PointSpec::Vertex);
    points.map(|point| surface_point(point, body)).collect()
}

/// The vertices of a body in a box.
fn within(body: &Body, low: Vec3, high: Vec3) -> Result<Vec<VertexIndex>, String> {
    let positions = body.particles.positions.iter().enumerate();
    let inside = positions.filter(|(_, x)| {
        let x = x.truncate();
        x.cmpge(low).all() && x.cmple(high).all()
    });
    let mut vertices: Vec<_> = inside.map(|(i, _)| body.topology.vertex(i)).collect();
    vertices.sort_unstable();
    match vertices.is_empty() {
        false => Ok(vertices),
        true => Err(format!("no vertex is within {low} and {high} m")),
    }
}

fn surface_point(spec: PointSpec, body: &Body) -> Result<SurfacePoint, String> {
    let terms = match spec {
        PointSpec::Vertex(vertex) => vec![(vertex, 1.0)],
        PointSpec::Triangle(corners, weights) => corners.into_iter().zip(weights).collect(),
        PointSpec::Roots(_) | PointSpec::Within { .. } | PointSpec::Group(_) => {
            return Err(
                "Roots, Within and Group are stitched to a `Collider` or a `Body`, as in `to: Collider(1)`"
                    .to_owned(),
            );
        }
    };
    let particle = |vertex: VertexIndex| match vertex.index() < body.particles.len() {
        true => body.topology.numbering.particle(vertex),
        false => ParticleIndex(vertex.0),
    };
    let terms: Vec<_> = terms
        .iter()
        .map(|&(v, weight)| (particle(v), weight))
        .collect();
    SurfacePoint::new(&terms).ok_or_else(|| {
        format!("{spec:?} is not a valid point: the sum of its weights must not be zero")
    })
}

/// The end of a stitch on collider number `number`, from 1, at the place of the point.
fn on_collider(
    point: &SurfacePoint,
    body: &Body,
    number: u32,
    colliders: &[Collider],
) -> Result<StitchEnd, String> {
    let count = colliders.len();
    let Some(collider) = colliders.get((number as usize).wrapping_sub(1)) else {
        return Err(match count {
            0 => format!("unknown collider {number}: the scene has no colliders"),
            _ => format!("unknown collider {number}; expected 1 to {count}"),
        });
    };
    let here = if point.fits(body.particles.len()) {
        point.position(&body.particles.positions)
    } else {
        Vec3::ZERO
    };
    Ok(StitchEnd::Collider {
        number: number - 1,
        place: collider.pose_at(0.0).undo(here.as_dvec3()).as_vec3(),
    })
}

/// The ends on another body of a stitch of body number `own` with these points.
fn other_ends(
    spec: &StitchSpec,
    points: &[SurfacePoint],
    own: usize,
    world: &World,
) -> Result<Vec<StitchEnd>, String> {
    let (StitchTo::Body(name) | StitchTo::BodyPoint(name, _)) = &spec.to else {
        return Ok(Vec::new());
    };
    let Some(number) = world.bodies.iter().position(|body| body.name == *name) else {
        let names = world.bodies.iter().map(|body| body.name.as_str());
        let names: Vec<_> = names.collect();
        let mut valid = names[..names.len().min(SHOWN)].join(", ");
        if names.len() > SHOWN {
            valid += ", …";
        }
        return Err(format!(
            "unknown body “{name}”{}; expected one of: {valid}",
            similar(name, &names.join(", "))
        ));
    };
    if number == own {
        return Err(format!(
            "“{name}” cannot be stitched to itself as another body; use `Point`"
        ));
    }
    let (body, other) = (&world.bodies[own], &world.bodies[number]);
    if let Some(missing) = points.iter().find_map(|point| missing(point, body)) {
        let count = body.particles.len();
        return Err(format!(
            "it refers to vertex {missing}, which the body does not have; it has {count} vertices"
        ));
    }
    let ends = match &spec.to {
        StitchTo::BodyPoint(_, point) => {
            let point = surface_point(*point, other)?;
            if let Some(missing) = missing(&point, other) {
                let count = other.particles.len();
                return Err(format!(
                    "it refers to vertex {missing}, which “{name}” does not have; it has {count} vertices"
                ));
            }
            vec![point; points.len()]
        }
        _ => {
            let at = points
                .iter()
                .map(|point| point.position(&body.particles.positions).as_dvec3());
            places_on(other, &at.collect::<Vec<_>>())?
        }
    };
    let number = number as u32;
    let ends = ends.into_iter();
    Ok(ends
        .map(|point| StitchEnd::Body { number, point })
        .collect())
}

/// A vertex of a point that the body does not have; such a vertex has kept its number.
fn missing(point: &SurfacePoint, body: &Body) -> Option<ParticleIndex> {
    let mut particles = point.terms().map(|(particle, _)| particle);
    particles.find(|particle| particle.index() >= body.particles.len())
}

/// Number of names that a message lists.
const SHOWN: usize = 20;

/// A point may be this far from the surface of the body to which it is stitched, as a fraction of
/// the mean length of its edges.
const FAR: f64 = 0.5;

/// The points of a body at these positions [m]: of a solid in the tetrahedron around each, of
/// others the closest one.
fn places_on(body: &Body, at: &[DVec3]) -> Result<Vec<SurfacePoint>, String> {
    let Body {
        name,
        topology,
        particles,
        ..
    } = body;
    let x: Vec<DVec3> = (0..particles.len())
        .map(|i| particles.position(i))
        .collect();
    let found: Vec<Option<(SurfacePoint, f64)>> = if topology.tetrahedra.corners().len() == 0 {
        at.iter()
            .map(|&point| closest(topology, &x, point))
            .collect()
    } else {
        let corners: Vec<[u32; 4]> = topology.tetrahedra.corners().collect();
        let (anchors, _) = mesh::embed(at, &x, &corners);
        let anchors = anchors.iter().zip(at);
        let found = anchors.map(|(anchor, at)| {
            let terms = anchor.vertices.iter().zip(anchor.weights);
            let terms: Vec<_> = terms
                .map(|(v, weight)| (ParticleIndex(v.0), weight))
                .collect();
            let point = SurfacePoint::new(&terms)?;
            Some((point, position(&point, &x).distance(*at)))
        });
        found.collect()
    };
    let limit = FAR
        * f64::from(
            topology
                .surface()
                .mean_edge
                .max(2.0 * topology.largest_radius()),
        );
    let checked = found.into_iter().zip(at).map(|(found, at)| {
        let (point, distance) = found.ok_or_else(|| format!("“{name}” has no points"))?;
        if distance > limit {
            return Err(format!(
                "the point at {:.3} m is {distance:.3} m from “{name}”, but may be at most {limit:.3} m \
                 away: move the body, or name a point, as in `BodyPoint(\"{name}\", Vertex(0))`",
                at.as_vec3()
            ));
        }
        Ok(point)
    });
    checked.collect()
}

fn position(point: &SurfacePoint, x: &[DVec3]) -> DVec3 {
    let terms = point.terms();
    terms.fold(DVec3::ZERO, |sum, (i, weight)| {
        sum + x[i.index()] * f64::from(weight)
    })
}

/// The point of a sheet, a rope or grains that is closest to a position, and its distance [m].
fn closest(topology: &Topology, x: &[DVec3], at: DVec3) -> Option<(SurfacePoint, f64)> {
    // A triangle; an edge or a vertex is one whose corners are repeated.
    let triangles = topology.triangles.iter().copied();
    let edges = topology.edges.ends().map(|[a, b]| [a, b, b]);
    let vertices = (0..x.len() as u32).map(|i| [i; 3]);
    let primitives: Box<dyn Iterator<Item = [u32; 3]>> = if !topology.triangles.is_empty() {
        Box::new(triangles)
    } else if topology.edges.ends().len() > 0 {
        Box::new(edges)
    } else {
        Box::new(vertices)
    };
    let distances = primitives.map(|corners| {
        let of = corners.map(|i| x[i as usize]);
        let weights = on_triangle(at, of);
        let there = of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
        (there.distance(at), corners, weights)
    });
    let (distance, corners, weights) = distances.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let terms = corners.into_iter().zip(weights);
    let terms: Vec<_> = terms
        .filter(|(_, weight)| *weight > 0.0)
        .map(|(i, weight)| (ParticleIndex(i), weight as f32))
        .collect();
    Some((SurfacePoint::new(&terms)?, distance))
}

/// The stitches of a body, unless they are unsound.
fn checked(spec: &BodySpec, body: &Body, all: Vec<Numbered>) -> Result<Stitches, SceneError> {
    let count = body.particles.len();
    let (numbers, all): (Vec<_>, Vec<_>) = all.into_iter().unzip();
    Stitches::new(all, count).map_err(|error| {
        let message = match error {
            StitchError::NoSuchParticle { stitch, .. } => format!(
                "stitch {} refers to a vertex that the body does not have; it has {count} vertices",
                numbers[stitch]
            ),
            StitchError::SharedParticle { stitch, particle } => format!(
                "both ends of stitch {} are attached to vertex {}; use two different vertices",
                numbers[stitch],
                body.topology.vertex(particle.index())
            ),
            error => error.to_string(),
        };
        spec.wrong(message)
    })
}
