//! Finds the pairs of primitives that may come near each other.

use super::{
    between::Between,
    bounds::{Ball, Bounds, Columns},
    closest::Kind,
    contacts::{Contacts, HORIZON, Member, Piece},
    gaps::Pairs,
    unfolded::are_apart,
};
use crate::{
    Threads, WorkEstimate,
    lanes::Instructions,
    particles::MAX_COORDINATE,
    topology::{features::Features, patches::Patch},
};
use glam::{DVec3, Vec3A};
use std::ops::Range;

/// Candidates of one kind between two pieces of surfaces, or within one piece.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    /// Pieces of the first and the second primitive of each candidate.
    pub pieces: [u32; 2],
    pub between: Between,
    pub kind: Kind,
    /// Range of its candidates.
    pub range: Range<usize>,
    /// Offset of the second frame from the first for which the candidates are valid.
    pub offset: Ball,
    /// Minimum distance of the surfaces [m].
    pub min_gap: f64,
    /// The smallest clearance of its candidates, and the smallest distance at detection [m].
    pub least: f32,
    pub closest: f32,
}

impl Batch {
    /// Its pieces in ascending order.
    fn sorted(&self) -> [u32; 2] {
        let [a, b] = self.pieces;
        [a.min(b), a.max(b)]
    }
}

/// Two pieces that may come near each other, or one piece with itself.
#[derive(Debug, Clone)]
pub(super) struct PiecePair {
    pub pieces: [u32; 2],
    between: Between,
    /// Offset of the second frame from the first when candidates were found [m].
    pub offset: DVec3,
    /// Displacements of the second frame relative to the first, from there, for which candidates
    /// are valid.
    pub claim: Ball,
    /// Whether the motion has left the claim.
    pub is_lost: bool,
    /// Its number in the chart of its surface, if any, and whether it needs no candidates, as the surface is too
    /// little folded there to touch itself.
    pub chart: Option<u32>,
    pub is_unfolded: bool,
}

/// Two primitives that may come near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Indices of the corners in the pieces, those of the first primitive first.
    pub corners: [u32; 4],
    /// Distance to maintain [m].
    pub distance: f32,
    /// Whether they touch at rest, as the lips of a crack do. They keep a part of the gap that they have
    /// at the start of a substep, and at most the distance.
    pub touch_at_rest: bool,
    /// Distance of the primitives beyond that at detection, by the centers of the claims [m].
    pub clearance: f32,
}

/// Buffers for detection, reused.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    finders: Vec<Finder>,
    /// Indices of the pairs of pieces whose candidates are to be found.
    lost: Vec<u32>,
    /// Bounding boxes of each piece in its frame.
    boxes: Vec<PieceBoxes>,
    /// Lower and upper corner of a box around the motion of each piece [m].
    swept_boxes: Vec<[DVec3; 2]>,
    order: Vec<(f64, u32)>,
    /// Batches and candidates of the previous detection.
    before: Found,
}

/// Batches with their candidates.
#[derive(Debug, Default)]
struct Found {
    batches: Vec<Batch>,
    candidates: Vec<Candidate>,
}

/// Finds the candidates of some pairs of pieces, on one thread.
#[derive(Debug, Default)]
struct Finder {
    instructions: Instructions,
    columns: Columns,
    hits: Vec<[u32; 2]>,
    first: Primitives,
    second: Primitives,
    pairs: Pairs,
    /// Corners of the pairs, by their indices in the pieces, and bounds of their distances [m].
    corners: Vec<[u32; 4]>,
    distances: Vec<f32>,
    /// Its part of the lost pairs.
    lost: Range<usize>,
    found: Found,
}

/// Bounding boxes around the claims of a piece.
#[derive(Debug, Default)]
struct PieceBoxes {
    /// Around all of it, with the radius of its balls.
    all: Bounds,
    /// Whether those of its primitives are there, as they are found on first use.
    are_filled: bool,
    /// Around the centers of the corners of each primitive, by their kind.
    parts: [PartBoxes; 3],
}

/// The boxes of primitives of one kind, also as columns.
#[derive(Debug, Default)]
struct PartBoxes {
    boxes: Vec<Bounds>,
    columns: Columns,
}

/// Primitives of a piece with their boxes.
#[derive(Debug, Default)]
struct Primitives {
    boxes: Vec<Bounds>,
    /// Indices of the vertices, edges or triangles of its patch.
    numbers: Vec<u32>,
    /// Surface vertices of each; of fewer than three, the last is repeated.
    vertices: Vec<[u32; 3]>,
}

/// Kind of primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Vertices,
    Edges,
    Triangles,
}

/// Number of substeps of the current motion for which candidates are found, assuming constant
/// velocity.
const AHEAD: f64 = 1.0;

/// The same for pieces relative to each other.
const FRAMES_AHEAD: f64 = 2.0;

/// Lower bound of a truncated gap, as a fraction of the thickness and as a fraction of the longest
/// edge; thinner gaps would be within the rounding of positions.
const MIN_GAP: [f64; 2] = [0.01, 5e-4];

/// Maximum contact distance as a fraction of the rest distance of the primitives, and of the gap of
/// those that touch at rest.
pub(super) const OF_REST: f64 = 0.9;

/// Margin of the balls against rounding, as a fraction of the size of a body: a few ε of `f32`.
pub(super) const SLACK: f32 = 1e-6;

/// Constraint projections that take about as long as finding the candidates of a pair of pieces.
const PROJECTIONS: usize = 1000;

impl Contacts {
    /// Finds candidates for the current motion where it has left the claims. New claims stay valid
    /// while the motion changes little; frames are extrapolated over a tick of this number of
    /// substeps, motion over `horizon` of them. Other candidates are kept.
    pub(super) fn detect(&mut self, substeps: u32, horizon: f64, threads: &Threads) {
        let is_first = !std::mem::replace(&mut self.is_valid, true);
        self.counts.detections += 1;
        self.claim(substeps);
        if is_first {
            for number in 0..self.pieces.len() {
                let reach = self.pieces[number].claimed_radius;
                // Once for the matrix.
                self.bend(number, reach);
                self.bend(number, reach);
            }
        }
        self.find_pairs(horizon);
        let mut pairs = std::mem::take(&mut self.pairs);
        let mut scratch = std::mem::take(&mut self.scratch);
        let Scratch {
            finders,
            lost,
            boxes,
            before,
            ..
        } = &mut scratch;
        lost.clear();
        let numbered = pairs.iter().zip(0..);
        let is_lost = |pair: &PiecePair| pair.is_lost && !pair.is_unfolded;
        lost.extend(numbered.filter_map(|(pair, number)| is_lost(pair).then_some(number)));
        for piece in lost.iter().flat_map(|&lost| pairs[lost as usize].pieces) {
            let boxes = &mut boxes[piece as usize];
            if !boxes.are_filled {
                let piece = &self.pieces[piece as usize];
                let centers = &self.claimed[piece.corners(&self.members)];
                boxes.fill(piece, &self.members, centers);
            }
        }
        // More parts than threads, as pairs take different times.
        let parts = match threads.count() {
            1 => 1,
            count => 4 * count,
        };
        let each = lost.len().div_ceil(parts).max(1);
        finders.resize_with(parts, Finder::default);
        for (finder, part) in finders.iter_mut().zip(0..) {
            finder.lost = (part * each).min(lost.len())..((part + 1) * each).min(lost.len());
        }
        let estimate = |finder: &Finder| WorkEstimate {
            projections: finder.lost.len() * PROJECTIONS,
            pieces: 1,
        };
        threads.for_each(finders, estimate, &|finder: &mut Finder, _: &Threads| {
            finder.found.batches.clear();
            finder.found.candidates.clear();
            for number in finder.lost.clone() {
                finder.find(self, boxes, &pairs[lost[number] as usize]);
            }
        });
        std::mem::swap(&mut before.batches, &mut self.batches);
        std::mem::swap(&mut before.candidates, &mut self.candidates);
        self.batches.clear();
        self.candidates.clear();
        let mut next = 0;
        let mut place = 0;
        let mut number = 0;
        for pair in &mut pairs {
            let is_lost = std::mem::take(&mut pair.is_lost);
            if pair.is_unfolded {
                continue;
            }
            if is_lost {
                if number % each == 0 {
                    place = 0;
                }
                self.keep(&finders[number / each].found, pair.pieces, &mut place);
                number += 1;
            } else {
                self.keep(before, pair.pieces, &mut next);
            }
        }
        self.pairs = pairs;
        self.scratch = scratch;
        self.counts.candidates = self.candidates.len();
        self.gaps.clear();
        self.gaps.resize(self.candidates.len(), 0.0);
    }

    /// Adds the batches of a pair of pieces; `next` is the first one not yet visited. Both are in
    /// the order of the pairs.
    fn keep(&mut self, found: &Found, pieces: [u32; 2], next: &mut usize) {
        let batches = &found.batches;
        while let Some(batch) = batches.get(*next).filter(|batch| batch.sorted() <= pieces) {
            *next += 1;
            if batch.sorted() == pieces {
                let start = self.candidates.len();
                self.candidates
                    .extend(&found.candidates[batch.range.clone()]);
                self.batches.push(Batch {
                    range: start..self.candidates.len(),
                    ..batch.clone()
                });
            }
        }
    }

    /// Renews frames and claims of pieces that have left them, and the box of each in its frame.
    fn claim(&mut self, substeps: u32) {
        let Self {
            members,
            pieces,
            starts,
            ends,
            vertices,
            claimed,
            centers,
            offsets,
            scratch,
            ..
        } = self;
        scratch.boxes.resize_with(pieces.len(), PieceBoxes::default);
        let lost = pieces.iter_mut().zip(&mut scratch.boxes);
        for (piece, boxes) in lost.filter(|(piece, _)| piece.is_lost) {
            let corners = piece.corners(members);
            let skin = piece.skin(members);
            piece.origin = starts[vertices[piece.first] as usize];
            piece.drift = DVec3::ZERO;
            piece.is_new = false;
            piece.is_renewed = true;
            let mut size = 0.0_f32;
            let mut longest = 0.0_f64;
            let mut bounds = Bounds::EMPTY;
            for corner in corners {
                let v = vertices[corner] as usize;
                let relative = (ends[v] - starts[v] - piece.motion) * (HORIZON * AHEAD);
                let offset = starts[v] - piece.origin;
                let center = (offset + relative * 0.5).as_vec3a();
                size = size.max(offset.abs().max_element() as f32);
                longest = longest.max(relative.length_squared());
                bounds = bounds.with(Bounds::around(center, center));
                (claimed[corner], centers[corner]) = (center, center);
                offsets[corner] = offset.as_vec3a();
            }
            piece.slack = size * SLACK;
            (piece.radius, piece.travel) = (0.0, 0.0);
            (piece.claim, piece.claimed_radius) = (Ball::ORIGIN, 0.0);
            if piece.is_stepped {
                let far = piece.motion * f64::from(substeps.max(2));
                piece.claim = Ball::around(DVec3::ZERO, far, skin + 2.0 * piece.slack);
                let thickness = 0.5 * piece.half_thickness + 2.0 * piece.slack;
                piece.claimed_radius = 0.5 * longest.sqrt() as f32 + skin + thickness;
            }
            boxes.all = bounds.grown(piece.claimed_radius);
            boxes.are_filled = false;
        }
    }

    /// Finds pairs of pieces whose boxes overlap during their motion. Pairs of pieces that are not
    /// lost are kept.
    fn find_pairs(&mut self, horizon: f64) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let Scratch {
            boxes,
            swept_boxes,
            order,
            ..
        } = &mut scratch;
        let mut pairs = std::mem::take(&mut self.pairs);
        let is_lost = |piece: u32| self.pieces[piece as usize].is_lost;
        pairs.retain(|pair| !pair.pieces.map(is_lost).contains(&true));
        for pair in pairs.iter_mut().filter(|pair| pair.is_lost) {
            *pair = self.pair(pair.pieces, pair.between, horizon);
        }
        order.clear();
        swept_boxes.clear();
        for ((piece, boxes), number) in self.pieces.iter().zip(boxes).zip(0..) {
            let at = piece.origin;
            let reach = piece.half_thickness + piece.slack;
            let moved = boxes.all.displaced(&piece.claim.bounds()).grown(reach);
            let around = [moved.low, moved.high].map(|corner| at + corner.as_dvec3());
            swept_boxes.push(around);
            let [low, high] = around;
            let is_far = low.cmpgt(DVec3::splat(MAX_COORDINATE)).any()
                || high.cmplt(DVec3::splat(-MAX_COORDINATE)).any();
            if !is_far && !self.members[piece.member].is_idle {
                order.push((around[0].x, number));
            }
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (place, &(_, a)) in order.iter().enumerate() {
            let [low, high] = swept_boxes[a as usize];
            for &(next, b) in &order[place..] {
                if next > high.x {
                    break;
                }
                let [other_low, other_high] = swept_boxes[b as usize];
                if (is_lost(a) || is_lost(b))
                    && (low.cmple(other_high) & high.cmpge(other_low)).all()
                    && let [of_a, of_b] =
                        [a, b].map(|piece| &self.members[self.pieces[piece as usize].member])
                    && let Some(between) = of_a.between(of_b)
                {
                    pairs.push(self.pair([a.min(b), a.max(b)], between, horizon));
                }
            }
        }
        pairs.sort_unstable_by_key(|pair| pair.pieces);
        self.pairs = pairs;
        self.scratch = scratch;
        for piece in &mut self.pieces {
            piece.is_lost = false;
        }
    }

    /// Claims the relative motion of two pieces.
    fn pair(&self, pieces: [u32; 2], between: Between, horizon: f64) -> PiecePair {
        let [a, b] = pieces.map(|piece| &self.pieces[piece as usize]);
        let skin = |piece: &Piece| match piece.is_stepped {
            true => 0.5 * piece.skin(&self.members),
            false => 0.0,
        };
        let displacement = (b.motion - a.motion) * (HORIZON * FRAMES_AHEAD);
        let more = skin(a) + skin(b) + 2.0 * (a.slack + b.slack);
        let claim = if pieces[0] == pieces[1] {
            Ball::ORIGIN
        } else {
            Ball::around(DVec3::ZERO, displacement, more)
        };
        let chart = match between {
            Between::Itself => {
                let surface = &self.members[a.member].surface;
                surface.chart().find([a.patch as u32, b.patch as u32])
            }
            _ => None,
        };
        let mut pair = PiecePair {
            pieces,
            between,
            offset: b.frame() - a.frame(),
            claim,
            is_lost: true,
            chart,
            is_unfolded: false,
        };
        pair.is_unfolded = self.are_unfolded(&pair, horizon);
        pair
    }

    /// Whether no contact can act between two pieces of a surface, or in one, with this horizon in substeps.
    pub(super) fn are_unfolded(&self, pair: &PiecePair, horizon: f64) -> bool {
        let Some(number) = pair.chart else {
            return false;
        };
        let places = pair.pieces.map(|piece| piece as usize);
        let [a, b] = places.map(|place| &self.pieces[place]);
        let chart = self.members[a.member].surface.chart();
        let reaches = places.map(|place| self.bends[place].reach);
        let path = (b.motion - a.motion).length() as f32 * (0.5 * horizon as f32);
        // Beyond it, no candidate is near.
        let limit = a.half_thickness
            + b.half_thickness
            + (reaches[0] + reaches[1] + path)
            + 2.0 * (a.slack + b.slack);
        are_apart(chart, number, &self.bends[places[0] - a.patch..], limit)
    }
}

impl Finder {
    /// Finds the candidates of a pair of pieces, or within one piece.
    fn find(&mut self, contacts: &Contacts, boxes: &[PieceBoxes], pair: &PiecePair) {
        let vertices = [Part::Vertices, Part::Triangles];
        self.batch(contacts, boxes, pair, Kind::VertexTriangle, vertices);
        if pair.pieces[0] != pair.pieces[1] {
            let swapped = pair.swapped();
            self.batch(contacts, boxes, &swapped, Kind::VertexTriangle, vertices);
        }
        self.batch(contacts, boxes, pair, Kind::EdgeEdge, [Part::Edges; 2]);
        // Grains touch edges only where there are no triangles that the edges belong to.
        let of = pair.pieces.map(|piece| {
            let member = contacts.pieces[piece as usize].member;
            &contacts.members[member].surface
        });
        let [a, b] = of.map(|surface| match () {
            () if !surface.triangles.is_empty() => Part::Triangles,
            () if !surface.edges.is_empty() => Part::Edges,
            () => Part::Vertices,
        });
        let mut batch = |pair, kind, parts| self.batch(contacts, boxes, pair, kind, parts);
        match (a, b) {
            _ if pair.between == Between::Itself => {}
            (Part::Vertices, Part::Vertices) => batch(pair, Kind::VertexVertex, [a, b]),
            (Part::Vertices, Part::Edges) => batch(pair, Kind::VertexEdge, [a, b]),
            (Part::Edges, Part::Vertices) => batch(&pair.swapped(), Kind::VertexEdge, [b, a]),
            _ => {}
        }
    }

    /// Finds candidates of one kind.
    fn batch(
        &mut self,
        contacts: &Contacts,
        boxes: &[PieceBoxes],
        pair: &PiecePair,
        kind: Kind,
        parts: [Part; 2],
    ) {
        let PiecePair {
            pieces,
            between,
            offset: apart,
            claim,
            ..
        } = *pair;
        let Contacts {
            members,
            pieces: all,
            vertices,
            claimed,
            ..
        } = contacts;
        let Self {
            instructions,
            columns,
            hits,
            first: ones,
            second: others,
            pairs,
            corners,
            distances,
            found: Found {
                batches,
                candidates,
            },
            ..
        } = self;
        let [a, b] = pieces.map(|piece| &all[piece as usize]);
        let [of_a, of_b] = [a, b].map(|piece| &members[piece.member]);
        let halves = [of_a, of_b].map(|member| member.half_thickness_for(between).unwrap_or(0.0));
        let thickness = halves[0] + halves[1];
        let is_itself = pieces[0] == pieces[1];
        let offset = if is_itself {
            Ball::ORIGIN
        } else {
            let rounding = apart.abs().max_element() as f32 * SLACK;
            let apart = Ball::around(apart, DVec3::ZERO, rounding);
            apart.plus(claim)
        };
        let reach = thickness + a.claimed_radius + b.claimed_radius + offset.radius;
        let [boxes_a, boxes_b] = pieces.map(|piece| &boxes[piece as usize]);
        let shift = Bounds::around(offset.center, offset.center);
        let back = Bounds::around(-offset.center, -offset.center);
        let near_b = boxes_b.all.displaced(&shift).grown(reach);
        let near_a = boxes_a.all.displaced(&back).grown(reach);
        let patches = [a.patch(members), b.patch(members)];
        ones.collect(patches[0], parts[0], boxes_a, near_b, (*instructions, hits));
        others.collect(patches[1], parts[1], boxes_b, near_a, (*instructions, hits));
        if ones.boxes.is_empty() || others.boxes.is_empty() {
            return;
        }
        for it in &mut others.boxes {
            *it = it.displaced(&shift).grown(reach);
        }
        // Most primitives of a surface that are near each other share a vertex.
        let sharing =
            (between == Between::Itself).then_some([&ones.vertices[..], &others.vertices]);
        columns.fill(&others.boxes, sharing.map(|[_, others]| others));
        hits.clear();
        let queries = (&ones.boxes[..], sharing.map(|[ones, _]| ones));
        columns.near(
            queries,
            is_itself && kind == Kind::EdgeEdge,
            *instructions,
            hits,
        );
        pairs.clear();
        corners.clear();
        for &[one, other] in &*hits {
            let (one, other) = (one as usize, other as usize);
            let [of_one, of_other] = [&ones.vertices[one], &others.vertices[other]];
            let is_stitched = match between {
                Between::Itself => of_a.stitched.hold(*of_one, *of_other),
                Between::Bodies => {
                    of_a.stitched.join(*of_one, of_b.number)
                        || of_b.stitched.join(*of_other, of_a.number)
                }
                Between::Colliders => false,
            };
            if is_stitched {
                continue;
            }
            let (first, second) = (ones.numbers[one], others.numbers[other]);
            let of = kind.corners((a, a.patch(members), first), (b, b.patch(members), second));
            pairs.push(
                kind,
                of.map(|corner| claimed[corner as usize]),
                offset.center,
            );
            corners.push(of);
        }
        let start = candidates.len();
        let mut bounds = pairs.lower_bounds(kind, *instructions).iter();
        distances.clear();
        corners.retain(|_| {
            // What is not finite is left to exact tests.
            let near = bounds.next().filter(|it| **it <= reach || it.is_nan());
            distances.extend(near);
            near.is_some()
        });
        pairs.clear();
        if between == Between::Itself {
            for corners in &*corners {
                let of = corners.map(|corner| vertices[corner as usize] as usize);
                let rest = of.map(|v| Vec3A::from(of_a.surface.rest[v - of_a.first]));
                pairs.push(kind, rest.map(|at| at - rest[0]), Vec3A::ZERO);
            }
        }
        let at_rest = pairs.lower_bounds(kind, *instructions);
        let mut least = f32::INFINITY;
        let mut closest = f32::INFINITY;
        for (number, (&corners, &apart)) in corners.iter().zip(&*distances).enumerate() {
            let of = corners.map(|corner| vertices[corner as usize]);
            let is_far_at_rest = |it: &f32| OF_REST as f32 * it >= 1.00001 * thickness;
            let (kept, touch_at_rest) = if between != Between::Itself {
                (thickness - kind.smaller(of, [of_a, of_b]), false)
            } else if at_rest.get(number).is_some_and(is_far_at_rest) {
                (thickness, false)
            } else {
                let rest = of.map(|v| of_a.surface.rest[v as usize - of_a.first].as_dvec3());
                // The distance of edges that meet at an end may be rounded to other than 0.
                let (one, other) = rest.split_at(kind.split());
                let most = OF_REST * kind.distance(rest);
                match most == 0.0 || one.iter().any(|x| other.contains(x)) {
                    true => (thickness, true),
                    false => (thickness.min(most as f32), false),
                }
            };
            if kept > 0.0 {
                let clearance = apart - kept;
                least = least.min(clearance);
                closest = closest.min(apart);
                candidates.push(Candidate {
                    corners,
                    distance: kept,
                    touch_at_rest,
                    clearance,
                });
            }
        }
        let found = &mut candidates[start..];
        if found.is_empty() {
            return;
        }
        found.sort_unstable_by_key(|candidate| {
            let [a, b, c, d] = candidate.corners.map(u128::from);
            a << 96 | b << 64 | c << 32 | d
        });
        let longest = of_a.surface.longest_edge.max(of_b.surface.longest_edge);
        let [of_thickness, of_edge] = MIN_GAP;
        let thickness = f64::from(thickness);
        let min_gap = (of_thickness * thickness).max(of_edge * f64::from(longest));
        batches.push(Batch {
            pieces,
            between,
            kind,
            range: start..candidates.len(),
            offset,
            min_gap: min_gap.min(0.5 * thickness),
            least,
            closest,
        });
    }
}

impl PiecePair {
    /// The same with the pieces swapped.
    fn swapped(&self) -> Self {
        let Self {
            pieces: [a, b],
            between,
            offset,
            claim,
            ..
        } = *self;
        Self {
            pieces: [b, a],
            between,
            offset: -offset,
            claim: Ball::ORIGIN.minus(claim),
            ..*self
        }
    }
}

impl Kind {
    /// By how much grains among the corners, by their surface vertices, are smaller than the largest
    /// of their bodies [m].
    fn smaller(self, corners: [u32; 4], [a, b]: [&Member; 2]) -> f32 {
        match self {
            Self::EdgeEdge => 0.0,
            Self::VertexTriangle | Self::VertexEdge => a.deficit(corners[0]),
            Self::VertexVertex => a.deficit(corners[0]) + b.deficit(corners[1]),
        }
    }

    /// Corners of two primitives of pieces, by index.
    fn corners(
        self,
        (a, of_a, first): (&Piece, &Patch, u32),
        (b, of_b, second): (&Piece, &Patch, u32),
    ) -> [u32; 4] {
        let [first, second] = [first, second].map(|number| number as usize);
        let corner = |piece: &Piece, place: u32| piece.first as u32 + place;
        match self {
            Self::VertexTriangle => {
                let [x, y, z] = of_b.triangles[second].map(|place| corner(b, place));
                [corner(a, first as u32), x, y, z]
            }
            Self::EdgeEdge => {
                let [p, q] = of_a.edges[first].map(|place| corner(a, place));
                let [r, s] = of_b.edges[second].map(|place| corner(b, place));
                [p, q, r, s]
            }
            Self::VertexEdge => {
                let [p, q] = of_b.edges[second].map(|place| corner(b, place));
                [corner(a, first as u32), p, q, q]
            }
            Self::VertexVertex => {
                let other = corner(b, second as u32);
                [corner(a, first as u32), other, other, other]
            }
        }
    }
}

impl PieceBoxes {
    /// Encloses the primitives of a piece with these centers of its corners: of a rigid one, those that can touch
    /// others first.
    fn fill(&mut self, piece: &Piece, members: &[Member], centers: &[Vec3A]) {
        self.are_filled = true;
        let patch = piece.patch(members);
        let features = members[piece.member].features();
        let around = |corners: &[u32]| {
            let all = corners.iter().map(|&corner| centers[corner as usize]);
            all.fold(Bounds::EMPTY, |all, at| all.with(Bounds::around(at, at)))
        };
        let [vertices, edges, triangles] = &mut self.parts;
        vertices.fill((0..patch.own as u32).map(|vertex| {
            let is_corner = |it: &Features| it.is_corner[patch.vertices[vertex as usize] as usize];
            match features.is_none_or(is_corner) {
                true => around(&[vertex]),
                false => Bounds::EMPTY,
            }
        }));
        edges.fill(patch.edges.iter().map(|edge| {
            let ends = edge.map(|place| patch.vertices[place as usize]);
            match features.is_none_or(|it| it.is_sharp(ends)) {
                true => around(edge),
                false => Bounds::EMPTY,
            }
        }));
        triangles.fill(patch.triangles.iter().map(|triangle| around(triangle)));
    }
}

impl PartBoxes {
    fn fill(&mut self, boxes: impl Iterator<Item = Bounds>) {
        self.boxes.clear();
        self.boxes.extend(boxes);
        self.columns.fill(&self.boxes, None);
    }
}

impl Primitives {
    /// Collects the primitives of a patch that overlap a box.
    fn collect(
        &mut self,
        patch: &Patch,
        part: Part,
        boxes: &PieceBoxes,
        near: Bounds,
        (instructions, hits): (Instructions, &mut Vec<[u32; 2]>),
    ) {
        self.numbers.clear();
        self.vertices.clear();
        self.boxes.clear();
        hits.clear();
        let PartBoxes { boxes, columns } = &boxes.parts[part as usize];
        columns.near((&[near], None), false, instructions, hits);
        for &[_, number] in &*hits {
            let place = number as usize;
            let [a, b, c] = match part {
                Part::Vertices => [number; 3],
                Part::Edges => {
                    let [a, b] = patch.edges[place];
                    [a, b, b]
                }
                Part::Triangles => patch.triangles[place],
            };
            self.numbers.push(number);
            self.vertices
                .push([a, b, c].map(|place| patch.vertices[place as usize]));
            self.boxes.push(boxes[place]);
        }
    }
}
