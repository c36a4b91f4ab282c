//! Limits of the elements of a body, and those that are above them.

use super::{
    Tear,
    split::{Strained, Weak},
    state::{Key, Limits, TearState},
    stretch::Stretches,
};
use crate::{
    Effects, ElasticKind, Topology,
    effects::{
        body_effect::{BodyEffect, Store},
        elastic::{Elastic, Point, Visit},
    },
    topology::Dimension,
};
use glam::DVec3;

/// κ of a triangle or a tetrahedron. Near the tip of a crack that releases G, the density of energy
/// is about G/(4πr); an element of extent l at the tip has its center at r = l/3, and so the energy
/// 3/(4π) G V/l. How near that is on meshes, the pure shear strip of the tests measures.
pub const FRACTION: f64 = 3.0 / (4.0 * std::f64::consts::PI);

/// κ of an edge: an edge along the largest stretch has about half of the energy of the elements
/// around it.
pub const EDGE_FRACTION: f64 = 0.5 * FRACTION;

impl TearState {
    /// Computes the limits, unless they are those of the body.
    pub(super) fn update(&mut self, tear: &Tear, body: &Strained) {
        let Effects {
            stretch,
            membrane,
            weave,
            neo_hookean,
            ..
        } = *body.effects;
        let key = Key {
            topology: body.topology.id(),
            tear: *tear,
            stretch,
            membrane,
            weave,
            neo_hookean,
        };
        if self.made_for.as_ref() == Some(&key) {
            return;
        }
        let mut found = Compliances {
            topology: body.topology,
            all: Vec::new(),
        };
        body.effects.visit(&mut found);
        *self = Self::of(tear, body.topology, found.all);
        self.made_for = Some(key);
    }

    fn of(tear: &Tear, topology: &Topology, all: Vec<(ElasticKind, Vec<f32>)>) -> Self {
        let toughness = f64::from(tear.toughness.get());
        let at = |i: u32| topology.rest[i as usize].as_dvec3();
        let mut state = Self::default();
        for (kind, compliances) in all {
            match kind {
                ElasticKind::Stretch => {
                    let areas = areas_of_edges(topology);
                    let each = compliances.iter().zip(areas);
                    let strength = |(&compliance, area): (&f32, f64)| {
                        // A cut through a rope releases the energy of what is cut.
                        let fraction = match topology.dimension {
                            Dimension::Line => 1.0,
                            _ => EDGE_FRACTION,
                        };
                        let energy = fraction * toughness * area;
                        let tough = (2.0 * energy / f64::from(compliance)).sqrt();
                        // An edge beside the elements comes off with them.
                        match area > 0.0 {
                            true => tear.force.get().min(tough as f32),
                            false => f32::INFINITY,
                        }
                    };
                    state.strengths = each.map(strength).collect();
                }
                ElasticKind::NeoHookean => {
                    let least = |corners: [u32; 4]| {
                        let x = corners.map(at);
                        let volume = crate::topology::volume(x).abs();
                        FRACTION * toughness * volume / longest(&x)
                    };
                    let all = topology.tetrahedra.corners();
                    state.tetrahedra.least = all.map(|it| least(it) as f32).collect();
                    state.tetrahedra.compliances.push((kind, compliances));
                }
                _ => {
                    let facets = topology.facets();
                    let least = |(corners, &area): ([u32; 3], &f32)| {
                        FRACTION * toughness * f64::from(area) / longest(&corners.map(at))
                    };
                    let all = facets.corners().zip(&facets.area);
                    state.triangles.least = all.map(|it| least(it) as f32).collect();
                    state.triangles.compliances.push((kind, compliances));
                }
            }
        }
        state
    }

    /// The elements above their limits, in order.
    pub(super) fn weak(&self, tear: &Tear, body: &Strained) -> Vec<Weak> {
        let mut weak = Vec::new();
        self.weak_edges(tear, body, &mut weak);
        weak_segments(tear, body, &mut weak);
        let topology = body.topology;
        let strain = f64::from(tear.strain.get());
        let toughness = f64::from(tear.toughness.get());
        if !self.triangles.least.is_empty() {
            let facets = topology.facets();
            let all = facets.corners().zip(&facets.area);
            let each = all.map(|(corners, &area)| (corners, f64::from(area)));
            weak_elements(&self.triangles, each, (toughness, strain), body, &mut weak);
        }
        if !self.tetrahedra.least.is_empty() {
            let cells = &topology.tetrahedra;
            let all = cells.corners().zip(&cells.rest_volume);
            let each = all.map(|(corners, &volume)| (corners, f64::from(volume.abs())));
            weak_elements(&self.tetrahedra, each, (toughness, strain), body, &mut weak);
        }
        weak
    }

    fn weak_edges(&self, tear: &Tear, body: &Strained, weak: &mut Vec<Weak>) {
        if self.strengths.is_empty() {
            return;
        }
        let edges = &body.topology.edges;
        let lambdas = (body.lambdas)(ElasticKind::Stretch);
        let per_lambda = (-1.0 / (body.h * body.h)) as f32;
        let mut add = |index: usize, ends: [u32; 2], load: f64| {
            let [a, b] = ends.map(|i| body.topology.rest[i as usize].as_dvec3());
            weak.push(Weak {
                load,
                particles: ends.into(),
                direction: (b - a) / f64::from(edges.rest_length[index]),
            });
        };
        let strain = f64::from(tear.strain.get());
        if strain.is_finite() {
            for (index, ends) in edges.ends().enumerate() {
                let [a, b] = ends.map(|i| (body.at)(i));
                let rest = f64::from(edges.rest_length[index]);
                let ratio = (a.distance(b) / rest - 1.0) / strain;
                let force = lambdas.get(index).map_or(0.0, |lambda| lambda * per_lambda);
                let load = f64::from(force.max(0.0) / self.strengths[index]).max(ratio);
                if load > 1.0 {
                    add(index, ends, load * load);
                }
            }
            return;
        }
        let above = lambdas.iter().zip(&self.strengths).enumerate();
        let above = above.filter(|(_, (lambda, strength))| *lambda * per_lambda > **strength);
        let above: Vec<usize> = above.map(|(index, _)| index).collect();
        if above.is_empty() {
            return;
        }
        let ends: Vec<[u32; 2]> = edges.ends().collect();
        for index in above {
            let load = f64::from(lambdas[index] * per_lambda / self.strengths[index]);
            add(index, ends[index], load * load);
        }
    }
}

/// Segments of a rod, each with half of the energy of the joints at its ends.
fn weak_segments(tear: &Tear, body: &Strained, weak: &mut Vec<Weak>) {
    let (Some(rod), Some(state)) = (body.effects.rod, body.rod) else {
        return;
    };
    let nodes = state.nodes();
    let mut energies = vec![0.0; nodes.len()];
    let rows: Vec<_> = state.rows().collect();
    let mut number = 0;
    let at = |i: u32| ((body.at)(i), 0.0);
    // Three equations of a segment, then three of a joint.
    rod.stores(body.rod, body.topology, &at, &mut |store: Store| {
        let (segment, joint) = rows[number / 6];
        if number % 6 < 3 {
            if let Some(segment) = segment {
                energies[segment] += store.energy();
            }
        } else {
            for segment in joint.into_iter().flatten() {
                energies[segment] += 0.5 * store.energy();
            }
        }
        number += 1;
    });
    let strain = f64::from(tear.strain.get());
    let toughness = f64::from(tear.toughness.get());
    // EA over the force is 1 over the strain at which the tension is that.
    let tension = rod.axial_stiffness() / f64::from(tear.force.get());
    for (&[a, b], energy) in nodes.iter().zip(energies) {
        let rest = [a, b].map(|i| body.topology.rest[i as usize].as_dvec3());
        let along = rest[1] - rest[0];
        let stretch = (body.at)(a).distance((body.at)(b)) / along.length() - 1.0;
        let ratio = stretch.max(0.0) * tension.max(1.0 / strain);
        let load = (energy / toughness).max(ratio * ratio);
        if load > 1.0 {
            weak.push(Weak {
                load,
                particles: vec![a, b],
                direction: along.normalize_or_zero(),
            });
        }
    }
}

fn weak_elements<const N: usize>(
    limits: &Limits,
    elements: impl Iterator<Item = ([u32; N], f64)>,
    (toughness, strain): (f64, f64),
    body: &Strained,
    weak: &mut Vec<Weak>,
) {
    let mut energies = vec![0.0_f32; limits.least.len()];
    let per_lambda = (1.0 / (body.h * body.h)) as f32;
    for (kind, compliances) in &limits.compliances {
        let lambdas = (body.lambdas)(*kind);
        if lambdas.len() != compliances.len() {
            continue;
        }
        let rows = compliances.len() / energies.len();
        let both = lambdas
            .chunks_exact(rows)
            .zip(compliances.chunks_exact(rows));
        for (energy, (lambdas, compliances)) in energies.iter_mut().zip(both) {
            for (lambda, compliance) in lambdas.iter().zip(compliances) {
                let force = lambda * per_lambda;
                *energy += 0.5 * compliance * force * force;
            }
        }
    }
    let may_break = |index: usize| strain.is_finite() || energies[index] > limits.least[index];
    for (index, (corners, measure)) in elements.enumerate() {
        if !may_break(index) {
            continue;
        }
        let rest = corners.map(|i| body.topology.rest[i as usize].as_dvec3());
        let stretches = Stretches::of(rest, corners.map(|i| (body.at)(i)));
        if !stretches.is_tensile() {
            continue;
        }
        let along = rest.map(|x| (x - rest[0]).dot(stretches.direction));
        let extent =
            along.into_iter().fold(f64::MIN, f64::max) - along.into_iter().fold(f64::MAX, f64::min);
        let limit = FRACTION * toughness * measure / extent;
        let ratio = (stretches.largest - 1.0) / strain;
        let load = (f64::from(energies[index]) / limit).max(ratio * ratio);
        if load > 1.0 {
            weak.push(Weak {
                load,
                particles: corners.into(),
                direction: stretches.direction,
            });
        }
    }
}

/// Area of crack that each edge stands for: in m² of a solid, m of a sheet; 1 for a rope.
fn areas_of_edges(topology: &Topology) -> Vec<f64> {
    let ends: Vec<[u32; 2]> = topology.edges.ends().collect();
    if topology.dimension == Dimension::Line {
        return vec![1.0; ends.len()];
    }
    let at = |i: u32| topology.rest[i as usize].as_dvec3();
    let edges = EdgesByEnd::of(&ends, topology.particles());
    let mut areas = vec![0.0; ends.len()];
    let mut add = |corners: &[u32], part: f64| {
        for (i, &a) in corners.iter().enumerate() {
            for edge in corners[..i].iter().flat_map(|&b| edges.between(a, b)) {
                areas[edge] += part / f64::from(topology.edges.rest_length[edge]);
            }
        }
    };
    match topology.dimension {
        Dimension::Solid => {
            for corners in topology.tetrahedra.corners() {
                add(
                    &corners,
                    crate::topology::volume(corners.map(at)).abs() / 2.0,
                );
            }
        }
        _ => {
            for corners in topology.triangles.iter() {
                let [a, b, c] = corners.map(at);
                add(corners, (b - a).cross(c - a).length() / 3.0);
            }
        }
    }
    areas
}

/// Edges by the particle with the lower number: limits are computed anew after each tear, and
/// sorting all sides of the elements would take most of its time.
struct EdgesByEnd {
    /// Start of the edges of each particle, and the end of those of the last.
    starts: Vec<u32>,
    /// The other particle, and the edge, sorted for each particle.
    edges: Vec<(u32, u32)>,
}

impl EdgesByEnd {
    fn of(ends: &[[u32; 2]], particles: usize) -> Self {
        let mut starts = vec![0_u32; particles + 1];
        for [a, b] in ends {
            starts[*a.min(b) as usize + 1] += 1;
        }
        for i in 0..particles {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut edges = vec![(0, 0); ends.len()];
        for (edge, [a, b]) in (0..).zip(ends) {
            let slot = &mut next[*a.min(b) as usize];
            edges[*slot as usize] = (*a.max(b), edge);
            *slot += 1;
        }
        for ends in starts.windows(2) {
            edges[ends[0] as usize..ends[1] as usize].sort_unstable();
        }
        Self { starts, edges }
    }

    fn between(&self, a: u32, b: u32) -> impl Iterator<Item = usize> + '_ {
        let (low, high) = (a.min(b), a.max(b));
        let [from, to] = [0, 1].map(|next| self.starts[low as usize + next] as usize);
        let own = &self.edges[from..to];
        let first = own.partition_point(|(other, _)| *other < high);
        let edges = own[first..].iter();
        edges
            .take_while(move |(other, _)| *other == high)
            .map(|(_, edge)| *edge as usize)
    }
}

/// The longest distance between corners [m].
fn longest(corners: &[DVec3]) -> f64 {
    let pairs = (0..corners.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let lengths = pairs.map(|(i, j)| corners[i].distance(corners[j]));
    lengths.fold(f64::MIN_POSITIVE, f64::max)
}

/// Compliances of the elements that can tear.
struct Compliances<'a> {
    topology: &'a Topology,
    all: Vec<(ElasticKind, Vec<f32>)>,
}

impl Visit for Compliances<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let tears = matches!(
            E::KIND,
            ElasticKind::Stretch
                | ElasticKind::Membrane
                | ElasticKind::Weave
                | ElasticKind::NeoHookean
        );
        if !tears {
            return;
        }
        let topology = self.topology;
        let elements = E::elements(topology).corners().enumerate();
        let each = elements.flat_map(|(index, corners)| {
            let points = corners.map(|i| {
                let x = topology.rest[i as usize].as_dvec3();
                Point { x, w: 0.0, rest: x }
            });
            let rows = effect.rows(topology, index, points);
            rows.map(|row| row.compliance as f32)
        });
        self.all.push((E::KIND, each.collect()));
    }
}
