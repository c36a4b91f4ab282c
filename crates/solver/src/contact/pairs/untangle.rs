//! Separates surfaces that cross.
//!
//! Surfaces that were apart do not cross, but bodies can intersect initially, be moved into each
//! other, or be squeezed between obstacles that do not yield. There, the sides of the surfaces are
//! not known: contacts and truncation would keep them crossed. While two bodies cross,
//!
//! - contacts and truncation leave out pairs in the box around the crossings;
//! - the bodies separate as a whole, at the recovery speed v of their contact, along the direction
//!   n in which the crossing edges leave the crossed triangles: with the mean displacements D of
//!   their particles in the substep, C = n·(D₁ − D₂) − vh ≥ 0 and W = 1/M₁ + 1/M₂.
//!
//! Both depend on the positions at the start of the substep alone. Where a surface crosses itself,
//! pairs are left out in the same way, and `self_untangle.rs` separates its parts.

use super::{
    bounds::Bounds,
    contacts::{Between, Contacts, Member, Owner, Piece},
    crossings::{around, crosses},
    self_crossing::SelfCrossing,
    tangible::Tangible,
    tangle::{Crossed, CrossingSearch, Tangle},
};
use glam::DVec3;

/// Directions shorter than this fraction of their sum of lengths are undecided.
const UNDECIDED: f64 = 0.1;

impl Contacts {
    /// Finds the surfaces that cross at the start of the substep, of members that may have crossed
    /// others: they have been moved otherwise than stepped, could not be kept apart, are under
    /// repair, whose displacements are not truncated, or crossed before.
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
        self.self_crossings.clear();
        if !self.may_cross.contains(&true) {
            return;
        }
        let mut search = std::mem::take(&mut self.search);
        search.crossed.clear();
        search.of_itself.clear();
        search.boxes.clear();
        search.boxes.resize(self.pieces.len(), None);
        for pair in &self.pairs {
            let members = pair
                .pieces
                .map(|piece| self.pieces[piece as usize].member as u32);
            if members.iter().any(|&it| self.may_cross[it as usize]) {
                self.find_crossings(pair.pieces, members, &mut search);
            }
        }
        for (&members, crossed) in &search.crossed {
            let tangle = self.tangle(members, crossed);
            self.tangles.push(tangle);
        }
        let CrossingSearch {
            of_itself, regions, ..
        } = &mut search;
        for crossings in of_itself.chunk_by_mut(|a, b| a.member == b.member) {
            self.orient(crossings, regions);
            let tangles = self.tangles_of_itself(crossings);
            self.tangles.extend(tangles);
        }
        std::mem::swap(&mut self.self_crossings, of_itself);
        self.search = search;
        self.may_cross.fill(false);
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
            search.columns.fill(&search.edges.boxes);
            search.hits.clear();
            search.columns.near(
                &search.triangles.boxes,
                search.instructions,
                &mut search.hits,
            );
            for &[triangle, edge] in &search.hits {
                let edge = search.edges.vertices[edge as usize];
                let triangle = search.triangles.vertices[triangle as usize];
                let meet = edge.iter().any(|end| triangle.contains(end))
                    || self.are_stitched((a.member, edge), (b.member, triangle));
                let (ends, corners) = (edge.map(at), triangle.map(at));
                if meet || !crosses(ends, corners) {
                    continue;
                }
                if members[0] == members[1] {
                    let crossing = SelfCrossing::new(members[0], edge, triangle);
                    search.of_itself.push(crossing);
                } else {
                    let crossed = search.crossed.entry(members).or_insert(Crossed {
                        bounds: Bounds::EMPTY,
                        direction: DVec3::ZERO,
                        count: 0,
                    });
                    let [p, q, r] = corners;
                    crossed.bounds = crossed.bounds.with(around(&ends)).with(around(&corners));
                    crossed.direction += (q - p).cross(r - p).normalize_or_zero() * sign;
                    crossed.count += 1;
                }
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
        let [first, second] = members.map(|member| &self.members[member as usize]);
        let mean = |member: &Member| {
            let x = &self.starts[member.vertices()];
            x.iter().sum::<DVec3>() / x.len() as f64
        };
        let apart = mean(first) - mean(second);
        let mut direction = crossed.direction;
        let is_open = [first, second].iter().any(|it| !it.surface.is_closed());
        if is_open && direction.dot(apart) < 0.0 {
            direction = -direction;
        }
        if direction.length() < UNDECIDED * f64::from(crossed.count) {
            direction = apart;
        }
        let margin = first.half_thickness() + second.half_thickness();
        let edge = first.surface.mean_edge.max(second.surface.mean_edge);
        Tangle {
            members,
            bounds: crossed.bounds.grown(margin + edge),
            direction: direction.try_normalize().unwrap_or(DVec3::Y),
            multiplier: 0.0,
        }
    }

    /// Whether two primitives with these surface vertices are left out, as they lie where two
    /// members cross.
    pub(super) fn is_tangled(&self, members: [u32; 2], corners: [u32; 4]) -> bool {
        let [a, b] = members;
        let members = [a.min(b), a.max(b)];
        let of_both = |tangle: &&Tangle| tangle.members == members;
        self.tangles.iter().filter(of_both).any(|tangle| {
            let at = |v: u32| self.starts[v as usize].as_vec3a();
            corners.iter().all(|&v| tangle.bounds.contains(at(v)))
        })
    }

    /// Separates the bodies that cross, after an iteration and before their contacts.
    pub(crate) fn separate(&mut self, bodies: &mut [impl Tangible]) {
        self.separate_itself(bodies);
        let mut tangles = std::mem::take(&mut self.tangles);
        for tangle in &mut tangles {
            let [a, b] = tangle.members.map(|member| &self.members[member as usize]);
            let Some(between) = a.between(b).filter(|&it| it != Between::Itself) else {
                continue;
            };
            let Some(pair) = a.pair_params(b, between, self.h) else {
                continue;
            };
            let [first, second] = [a, b].map(|member| self.displacement(member, bodies));
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
                    shift(&mut bodies[body], by);
                }
            }
        }
        self.tangles = tangles;
    }

    /// Mean displacement of a member in the substep.
    fn displacement(&self, member: &Member, bodies: &[impl Tangible]) -> Displacement {
        if let Owner::Body(body) = member.owner
            && member.is_stepped
        {
            let body = &bodies[body];
            let (mut mass, mut sum) = (0.0, DVec3::ZERO);
            for i in 0..body.topology().particles() {
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

/// Moves all movable particles of a body.
fn shift(body: &mut impl Tangible, by: DVec3) {
    for i in 0..body.topology().particles() {
        if body.inverse_mass(i) > 0.0 {
            body.shift(i, by);
        }
    }
    body.touch();
}
