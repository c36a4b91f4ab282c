//! Separates surfaces that cross.
//!
//! Surfaces that were apart do not cross, but bodies can intersect or touch initially, be moved into
//! each other, or be squeezed between obstacles that do not yield. There, the sides of the surfaces
//! are not known: contacts and truncation would keep them crossed. While two bodies cross or touch at
//! distance 0,
//!
//! - contacts and truncation leave out pairs in the box around the crossings;
//! - the bodies separate as a whole, at the recovery speed v of their contact, along the direction
//!   n in which the crossing edges leave the crossed triangles: with the mean displacements D of
//!   their particles in the substep, C = n·(D₁ − D₂) − vh ≥ 0 and W = 1/M₁ + 1/M₂.
//!
//! Of a closed surface the outside is known, so that n is that of its triangles alone if the other is
//! open; an edge that is a chord of it, with both ends outside, is moved by itself along that normal, by
//! the constraint of `self_untangle.rs`, as a rope around a pulley. An open one is left to the side of the larger part of the body. Surfaces at the same place
//! part along their normals, the first of them to the front of the second.
//!
//! Both depend on the positions at the start of the substep alone. Where a surface crosses itself,
//! pairs are left out in the same way, and `self_untangle.rs` separates its parts. What is within a
//! closed collider without crossing it leaves it in the same way, see `within.rs`.

use super::{
    between::Between,
    bounds::Bounds,
    contacts::{Contacts, Member, Owner, Piece},
    crossing::Crossing,
    intersect::{around, crosses, touches},
    tangible::Tangible,
    tangle::{Crossed, CrossingSearch, Extent, Tangle, UNDECIDED},
};
use crate::Topology;
use glam::DVec3;

/// Bodies whose centers are nearer than this fraction of an edge are at the same place.
const SAME_PLACE: f64 = 1e-3;

impl Contacts {
    /// Finds the surfaces that cross at the start of the substep. Only members that may have
    /// crossed others are searched: those that were moved other than by a step, could not be kept
    /// apart, are under repair, whose displacements are not truncated, or crossed before.
    pub(super) fn find_tangles(&mut self, bodies: &[impl Tangible]) {
        for tangle in self.tangles.drain(..) {
            for member in tangle.members {
                self.may_cross[member as usize] = true;
            }
        }
        for (member, may_cross) in self.members.iter().zip(&mut self.may_cross) {
            if let Owner::Body(body) = member.owner {
                *may_cross |= bodies[body].is_repaired();
            }
        }
        self.crossings.clear();
        if !self.may_cross.contains(&true) {
            return;
        }
        let mut search = std::mem::take(&mut self.search);
        search.crossed.clear();
        search.of_itself.clear();
        search.of_colliders.clear();
        search.boxes.clear();
        search.boxes.resize(self.pieces.len(), None);
        for pair in &self.pairs {
            let members = pair
                .pieces
                .map(|piece| self.pieces[piece as usize].member as u32);
            let may_cross = members.iter().any(|&it| self.may_cross[it as usize]);
            if may_cross && !pair.is_unfolded {
                self.find_crossings(pair.pieces, members, &mut search);
            }
        }
        self.find_chords(&mut search);
        for (&members, crossed) in &search.crossed {
            let tangle = self.tangle(members, crossed);
            self.tangles.push(tangle);
        }
        self.find_within(bodies, &search.crossed);
        let CrossingSearch {
            of_itself, regions, ..
        } = &mut search;
        for crossings in of_itself.chunk_by_mut(|a, b| a.members == b.members) {
            self.orient(crossings, regions);
            let tangles = self.tangles_of_itself(crossings);
            self.tangles.extend(tangles);
        }
        self.crossings.append(of_itself);
        self.search = search;
        self.may_cross.fill(false);
        self.teleported.fill(false);
    }

    /// Adds the crossings of two pieces, or within one. Surfaces that cross have distance 0, so that
    /// the pairs of pieces contain them.
    fn find_crossings(&self, pieces: [u32; 2], members: [u32; 2], search: &mut CrossingSearch) {
        let bounds = pieces.map(|piece| {
            let known = &mut search.boxes[piece as usize];
            *known.get_or_insert_with(|| {
                let corners = self.pieces[piece as usize].corners(&self.members);
                let all = self.vertices[corners].iter();
                all.fold(Bounds::EMPTY, |all, &v| {
                    all.with(around(&[self.starts[v as usize]]))
                })
            })
        });
        if !bounds[0].meets(&bounds[1]) {
            return;
        }
        for (first, sign) in [(0, 1.0), (1, -1.0)] {
            if first == 1 && pieces[0] == pieces[1] {
                break;
            }
            let second = 1 - first;
            let [a, b] = [first, second].map(|side| &self.pieces[pieces[side] as usize]);
            let vertex = |piece: &Piece, corner: u32| self.vertices[piece.first + corner as usize];
            let at = |v: u32| self.starts[v as usize];
            let edges = a.patch(&self.members).edges.iter();
            let edges = edges.map(|it| it.map(|corner| vertex(a, corner)));
            search.edges.collect(edges, at, &bounds[second]);
            let triangles = b.patch(&self.members).triangles.iter();
            let triangles = triangles.map(|it| it.map(|corner| vertex(b, corner)));
            search.triangles.collect(triangles, at, &bounds[first]);
            search.columns.fill(&search.edges.boxes, None);
            search.hits.clear();
            search.columns.near(
                (&search.triangles.boxes, None),
                false,
                search.instructions,
                &mut search.hits,
            );
            for &[triangle, edge] in &search.hits {
                let edge = search.edges.vertices[edge as usize];
                let triangle = search.triangles.vertices[triangle as usize];
                let meet = edge.iter().any(|end| triangle.contains(end))
                    || self.are_stitched((a.member, edge), (b.member, triangle));
                let (ends, corners) = (edge.map(at), triangle.map(at));
                let is_itself = members[0] == members[1];
                // What is held there, as the roots of hair, is not to be moved away.
                let is_free = |member: usize, corners: &[u32]| {
                    let mut weights = corners.iter().map(|&v| self.inverse_masses[v as usize]);
                    self.members[member].is_collider() || weights.all(|weight| weight > 0.0)
                };
                let crosses = crosses(ends, corners);
                let is_tangled = crosses
                    || !is_itself
                        && touches(ends, corners)
                        && is_free(a.member, &edge)
                        && is_free(b.member, &triangle);
                if meet || !is_tangled {
                    continue;
                }
                if is_itself {
                    search
                        .of_itself
                        .push(Crossing::new(members, edge, triangle));
                } else {
                    let crossed = search.crossed.entry(members).or_insert(Crossed {
                        bounds: Bounds::EMPTY,
                        directions: [DVec3::ZERO; 2],
                        counts: [0; 2],
                        chords: Vec::new(),
                    });
                    let [p, q, r] = corners;
                    crossed.bounds = crossed.bounds.with(around(&ends)).with(around(&corners));
                    let of_triangle = &self.members[b.member];
                    if crosses && of_triangle.is_collider() && of_triangle.surface.is_closed() {
                        let crossing = Crossing::new(members, edge, triangle);
                        search.of_colliders.push(crossing);
                        continue;
                    }
                    crossed.directions[second] += (q - p).cross(r - p).normalize_or_zero() * sign;
                    crossed.counts[second] += 1;
                }
            }
        }
    }

    /// Of the edges of bodies that cross closed colliders, finds those that are chords, which enter and
    /// leave on one side: they are moved out by themselves. The others are added to the crossings of both.
    fn find_chords(&mut self, search: &mut CrossingSearch) {
        let CrossingSearch {
            of_colliders,
            crossed,
            ..
        } = search;
        of_colliders.sort_unstable_by_key(|it| (it.members, it.edge, it.triangle));
        let of_edges = of_colliders.chunk_by_mut(|a, b| (a.members, a.edge) == (b.members, b.edge));
        for crossings in of_edges {
            for it in &mut *crossings {
                let [a, b, c] = it.triangle.map(|v| self.starts[v as usize]);
                it.direction = (b - a).cross(c - a).normalize_or_zero();
                it.fraction = 1.0;
            }
            let is_chord = matches!(crossings, [a, b] if a.direction.dot(b.direction) > 0.0);
            let members = crossings[0].members;
            let Some(crossed) = crossed.get_mut(&members) else {
                continue;
            };
            if is_chord {
                let body = &self.members[members[0] as usize];
                let ends = crossings[0].edge.map(|v| body.particle(v as usize) as u32);
                crossed.chords.extend(ends);
                for it in &mut *crossings {
                    it.locate(&self.starts, &self.inverse_masses);
                }
                self.crossings.extend_from_slice(crossings);
            } else {
                crossed.directions[1] += crossings.iter().map(|it| it.direction).sum::<DVec3>();
                crossed.counts[1] += crossings.len() as u32;
            }
        }
    }

    /// Whether a stitch holds an edge and a triangle of members together.
    fn are_stitched(&self, one: (usize, [u32; 2]), other: (usize, [u32; 3])) -> bool {
        let [a, b] = [one.0, other.0].map(|member| &self.members[member]);
        let edge = one.1.map(|v| v - a.first as u32);
        let triangle = other.1.map(|v| v - b.first as u32);
        if one.0 == other.0 {
            a.stitched.hold(edge, triangle)
        } else {
            a.stitched.join(edge, b.number) || b.stitched.join(triangle, a.number)
        }
    }

    fn tangle(&self, members: [u32; 2], crossed: &Crossed) -> Tangle {
        let both = members.map(|member| &self.members[member as usize]);
        let [first, second] = both;
        let margin = first.half_thickness() + second.half_thickness();
        let edge = first.surface.mean_edge.max(second.surface.mean_edge);
        if crossed.counts == [0; 2] {
            let mut particles = crossed.chords.clone();
            particles.sort_unstable();
            particles.dedup();
            return Tangle {
                members,
                extent: Extent::Part(particles),
                direction: DVec3::ZERO,
                multiplier: 0.0,
            };
        }
        Tangle {
            members,
            extent: Extent::Box(crossed.bounds.grown(margin + edge)),
            direction: self.direction(both, crossed, SAME_PLACE * f64::from(edge)),
            multiplier: 0.0,
        }
    }

    /// Direction in which the first of two members that cross leaves the second, a unit vector. Centers
    /// nearer than a distance [m] do not decide it.
    fn direction(&self, both: [&Member; 2], crossed: &Crossed, same_place: f64) -> DVec3 {
        let is_closed = both.map(|it| it.surface.is_closed());
        let knows = |side: usize| {
            (is_closed[side] || !is_closed[1 - side]) && crossed.counts[side] > 0
                || crossed.counts[1 - side] == 0
        };
        let (mut sum, mut count) = (DVec3::ZERO, 0);
        for side in (0..2).filter(|side| knows(*side)) {
            sum += crossed.directions[side];
            count += crossed.counts[side];
        }
        // A collider can be far larger than a body: what counts is where it is crossed.
        let [a, b] = both.map(|member| match member.owner {
            Owner::Body(_) => self.mean(member),
            Owner::Collider(_) => crossed.bounds.center().as_dvec3(),
        });
        let apart = a - b;
        let is_apart = apart.length() > same_place;
        let has_outside = (0..2).any(|side| is_closed[side] && knows(side));
        if !has_outside && is_apart && sum.dot(apart) < 0.0 {
            sum = -sum;
        }
        if sum.length() < UNDECIDED * f64::from(count) {
            sum = if is_apart {
                apart
            } else {
                crossed.directions[1]
            };
        }
        sum.try_normalize().unwrap_or(DVec3::Y)
    }

    /// Mean position of the surface vertices of a member at the start of the substep [m].
    fn mean(&self, member: &Member) -> DVec3 {
        let x = &self.starts[member.vertices()];
        x.iter().sum::<DVec3>() / x.len() as f64
    }

    /// Whether two primitives with these surface vertices are left out, as they lie where two
    /// members cross, or belong to what is within a collider.
    pub(super) fn is_tangled(&self, members: [u32; 2], corners: [u32; 4]) -> bool {
        let [a, b] = members;
        let members = [a.min(b), a.max(b)];
        let of_both = self.tangles.iter().filter(|it| it.members == members);
        let mut extents = of_both.map(|it| &it.extent);
        extents.any(|extent| match extent {
            Extent::Box(bounds) => {
                let at = |v: u32| self.starts[v as usize].as_vec3a();
                corners.iter().all(|&v| bounds.contains(at(v)))
            }
            Extent::Part(particles) => {
                // The body comes before the collider.
                let body = &self.members[members[0] as usize];
                let of_body = corners.iter().map(|&v| v as usize);
                let mut of_body = of_body.filter(|v| body.vertices().contains(v));
                of_body.any(|v| particles.binary_search(&(body.particle(v) as u32)).is_ok())
            }
        })
    }

    /// Separates the bodies that cross, after an iteration and before their contacts.
    pub(crate) fn separate(&mut self, bodies: &mut [impl Tangible]) {
        self.separate_crossings(bodies);
        let mut tangles = std::mem::take(&mut self.tangles);
        for tangle in &mut tangles {
            let [a, b] = tangle.members.map(|member| &self.members[member as usize]);
            let Some(between) = a.between(b).filter(|&it| it != Between::Itself) else {
                continue;
            };
            let Some(pair) = a.pair_params(b, between, self.h) else {
                continue;
            };
            let part = match &tangle.extent {
                Extent::Box(_) => None,
                Extent::Part(particles) => Some(&particles[..]),
            };
            let [first, second] = [a, b].map(|member| self.displacement(member, part, bodies));
            let weight = first.inverse_mass + second.inverse_mass;
            if weight == 0.0 {
                continue;
            }
            let error = tangle.direction.dot(first.mean - second.mean) - pair.recovery;
            if !error.is_finite() {
                continue;
            }
            let change = (-error / weight).max(-tangle.multiplier);
            tangle.multiplier += change;
            let impulse = tangle.direction * change;
            for (member, by) in [
                (a, impulse * first.inverse_mass),
                (b, -impulse * second.inverse_mass),
            ] {
                if let Owner::Body(body) = member.owner
                    && by != DVec3::ZERO
                {
                    shift(&mut bodies[body], part, by);
                }
            }
        }
        self.tangles = tangles;
    }

    /// Mean displacement of a member in the substep, or of a part of its particles.
    fn displacement(
        &self,
        member: &Member,
        part: Option<&[u32]>,
        bodies: &[impl Tangible],
    ) -> Displacement {
        if let Owner::Body(body) = member.owner
            && member.is_stepped
        {
            let body = &bodies[body];
            let (mut mass, mut sum) = (0.0, DVec3::ZERO);
            for i in particles(body.topology(), part) {
                let weight = body.inverse_mass(i);
                if weight > 0.0 {
                    mass += 1.0 / weight;
                    sum += (body.now(i) - body.start(i)) / weight;
                }
            }
            if mass > 0.0 {
                return Displacement {
                    mean: sum / mass,
                    inverse_mass: 1.0 / mass,
                };
            }
        }
        let displacements = member.vertices().map(|v| self.ends[v] - self.starts[v]);
        Displacement {
            mean: displacements.sum::<DVec3>() / member.surface.vertices.len() as f64,
            inverse_mass: 0.0,
        }
    }
}

/// Mean displacement of the movable particles of a member.
struct Displacement {
    mean: DVec3,
    /// Inverse of their mass [1/kg]; 0 if none is movable.
    inverse_mass: f64,
}

/// The particles of a body, or of a part of it.
fn particles<'a>(
    topology: &Topology,
    part: Option<&'a [u32]>,
) -> impl Iterator<Item = usize> + use<'a> {
    let all = 0..part.map_or(topology.particles(), <[u32]>::len);
    all.map(move |place| part.map_or(place, |part| part[place] as usize))
}

/// Moves all movable particles of a body, or of a part of it.
fn shift(body: &mut impl Tangible, part: Option<&[u32]>, by: DVec3) {
    for i in particles(body.topology(), part) {
        if body.inverse_mass(i) > 0.0 {
            body.shift(i, by);
        }
    }
    body.touch();
}
