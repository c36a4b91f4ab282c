//! Finds the bodies of a group that meet nothing in some substeps: they are stepped as without contact.
//!
//! Before the substeps, each body gets a longest step s: twice the largest component of a displacement
//! that it has, with all that gravity can add, and a part of its thickness. A body of which no particle
//! moves farther along an axis in any of n substeps stays in its box at the start, grown by ns. Contact
//! looks at most 0.75 steps ahead to half way, and has there a margin of the motion of two pieces relative
//! to their means and to each other, 2.25·√3·s for each of the two, and of half of its thickness. So two
//! bodies whose boxes are apart when each is grown by
//!
//! (n + 5) s + 3/2 of its part of the distance
//!
//! have no near candidates in any of the substeps: no contact acts, and nothing is truncated. Contact with
//! them is left out, and the bits are those with it.
//!
//! The longest step is measured while the bodies are stepped, as a maximum, which depends on no order. If
//! one exceeds its own so far that its box meets another, all are put back to the start of the substeps, and
//! stepped again together.

use super::{
    advance::{StepContext, Stepper},
    copies::{self, Candidate},
    joints::Joined,
    together::GroupedBody,
};
use crate::{
    Particles, Stitches, Threads, WorkEstimate,
    colliders::collider::SweptCollider,
    contact::{Tangible, half_thickness},
    effects::body_kinds::BodyEffectStates,
    ledger::{self, Ledger},
    particles::surface_force::Recorded,
};
use glam::{Vec3, Vec4};
use std::ops::Range;

/// A longest step, as a multiple of the step under way.
const FASTER: f32 = 2.0;

/// What a step may be longer, as a fraction of the thickness.
const MARGIN: f32 = 0.1;

/// Steps beyond which nothing is looked for.
const AHEAD: f32 = 5.0;

/// Parts of the distance beyond which nothing is looked for.
const DISTANCES: f32 = 1.5;

/// Rounding of positions and boxes, as a fraction of coordinates.
const ROUNDING: f32 = 1e-5;

/// Where a body may be in some substeps.
#[derive(Debug, Clone, Copy)]
struct Reach {
    /// Box around all particles at the start [m].
    low: Vec3,
    high: Vec3,
    /// What is looked for around it, without steps [m].
    margin: f32,
    /// Longest step along an axis [m], and how often it counts.
    step: f32,
    steps: f32,
}

impl Reach {
    fn of(it: &GroupedBody, substeps: u32, context: &StepContext) -> Self {
        let particles = &*it.body.particles;
        let (mut low, mut high) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for &x in &particles.positions {
            (low, high) = (low.min(x), high.max(x));
        }
        let [low, high] = [low, high].map(Vec4::truncate);
        let thickness = half_thickness(it, context.swept.has_meshes());
        let mut step = 0.0;
        if it.is_stepped {
            let all = particles.displacements.iter();
            let longest = all.fold(Vec4::ZERO, |longest, u| longest.max(u.abs()));
            let h = context.settings.substep_seconds() as f32;
            let longer = (h / particles.substep_seconds()).max(1.0);
            let falls = substeps as f32 * fall(context);
            let foreseen = longer * longest.truncate().max_element() + falls;
            step = FASTER * foreseen + MARGIN * thickness;
        }
        let rounding = ROUNDING * low.abs().max(high.abs()).max_element();
        Self {
            low,
            high,
            margin: DISTANCES * thickness + rounding,
            step,
            steps: substeps as f32 + AHEAD,
        }
    }

    /// Box around all that is looked for [m].
    fn bounds(&self) -> [Vec3; 2] {
        let more = self.steps * self.step + self.margin;
        [self.low - more, self.high + more]
    }

    /// False if a collider certainly stays away.
    fn meets_collider(&self, collider: &SweptCollider) -> bool {
        let moved = collider.to.translation - collider.from.translation;
        let turned = collider.to.rotation - collider.from.rotation;
        // The norm of a matrix is at most that of its columns together.
        let columns = [turned.x_axis, turned.y_axis, turned.z_axis];
        let turned: f64 = columns.iter().map(|it| it.length_squared()).sum();
        let step = moved.length() + f64::from(collider.shape.reach()) * turned.sqrt();
        let more = AHEAD * step as f32;
        let [low, high] = self.bounds();
        !low.is_finite() || !high.is_finite() || collider.near(low - more, high + more)
    }
}

/// False if two boxes are certainly apart.
fn meet([low, high]: [Vec3; 2], [other_low, other_high]: [Vec3; 2]) -> bool {
    !(low.cmpgt(other_high) | other_low.cmpgt(high)).any()
}

/// Displacement by gravity in a substep [m], its largest component.
fn fall(context: &StepContext) -> f32 {
    let h = context.settings.substep_seconds() as f32;
    (context.settings.gravity * (h * h)).abs().max_element()
}

/// Bodies of which some are apart from all others in some substeps, with what is needed to check that they
/// were, and to step all of them again.
#[derive(Debug)]
pub(super) struct Apart {
    reaches: Vec<Reach>,
    kept: Vec<Option<Kept>>,
}

impl Apart {
    /// Marks the bodies that are apart; `None` if none are.
    pub fn find(
        bodies: &mut [GroupedBody],
        substeps: &Range<u32>,
        context: &StepContext,
    ) -> Option<Self> {
        if !bodies
            .iter()
            .all(|it| !it.is_stepped || can_be_repeated(it))
        {
            return None;
        }
        let count = substeps.len() as u32;
        let all = bodies.iter();
        let reaches: Vec<_> = all.map(|it| Reach::of(it, count, context)).collect();
        let can_meet = mark(bodies, &reaches, substeps, context);
        if !bodies.iter().any(|it| it.is_apart) {
            return None;
        }
        let kept = bodies.iter_mut().map(|it| {
            (can_meet && it.is_stepped).then(|| {
                it.body.set_longest(Some(0.0));
                Kept::of(&it.body)
            })
        });
        Some(Self {
            kept: kept.collect(),
            reaches,
        })
    }

    /// The number of bodies that are apart; `None` if any may have met another, in which case all are put
    /// back to the start of the substeps, and none is apart.
    pub fn check(
        mut self,
        bodies: &mut [GroupedBody],
        substeps: &Range<u32>,
        context: &StepContext,
    ) -> Option<usize> {
        let falls = fall(context);
        let (mut holds, mut is_any_faster) = (true, false);
        for ((it, reach), kept) in bodies.iter_mut().zip(&mut self.reaches).zip(&self.kept) {
            if kept.is_some() {
                let longest = it.body.longest().unwrap_or(f32::INFINITY) + falls;
                it.body.set_longest(None);
                holds &= it.result.is_ok() && longest.is_finite();
                is_any_faster |= longest > reach.step;
                reach.step = reach.step.max(longest);
            }
        }
        let count = bodies.iter().filter(|it| it.is_apart).count();
        if holds && is_any_faster {
            // They may still be apart.
            mark(bodies, &self.reaches, substeps, context);
            holds = bodies.iter().filter(|it| it.is_apart).count() == count;
        }
        if holds {
            return Some(count);
        }
        for (it, kept) in bodies.iter_mut().zip(self.kept) {
            if let Some(kept) = kept {
                kept.put_back(&mut it.body);
                it.result = Ok(Ledger::default());
                it.is_apart = false;
            }
        }
        None
    }
}

/// Whether a body can be put back to the start of some substeps at little cost: not what plastic flow and the
/// direct solver keep.
fn can_be_repeated(it: &GroupedBody) -> bool {
    it.body.effects.plasticity.is_none() && it.body.effects.direct.is_none()
}

/// Marks the bodies that are apart; returns whether there is anything that one could meet.
fn mark(
    bodies: &mut [GroupedBody],
    reaches: &[Reach],
    substeps: &Range<u32>,
    context: &StepContext,
) -> bool {
    let all = bodies.iter().map(|it| (it.number, it.stitches()));
    let joined = Joined::of(all, usize::MAX);
    let meshes = substeps.clone();
    let meshes = meshes.flat_map(|substep| context.swept.of(substep));
    let meshes = meshes.filter(|it| it.shape.mesh().is_some());
    for (it, reach) in bodies.iter_mut().zip(reaches) {
        let effects = it.body.effects;
        let meets_mesh =
            effects.collide.is_some() && meshes.clone().any(|it| reach.meets_collider(it));
        it.is_apart =
            it.is_stepped && !effects.is_rigid() && !joined.contains(it.number) && !meets_mesh;
    }
    let touches = |it: &GroupedBody| it.takes_part() && it.body.effects.contact.is_some();
    let mut order: Vec<_> = (0..bodies.len())
        .filter(|&place| touches(&bodies[place]))
        .collect();
    let boxes: Vec<_> = reaches.iter().map(Reach::bounds).collect();
    let low = |place: usize| boxes[place][0].x;
    order.sort_unstable_by(|&a, &b| low(a).total_cmp(&low(b)).then(a.cmp(&b)));
    for (next, &a) in (1..).zip(&order) {
        for &b in &order[next..] {
            if low(b) > boxes[a][1].x {
                break;
            }
            if meet(boxes[a], boxes[b]) {
                bodies[a].is_apart = false;
                bodies[b].is_apart = false;
            }
        }
    }
    order.len() > 1 || meshes.clone().next().is_some()
}

fn candidate<'a>(it: &'a GroupedBody) -> Candidate<'a> {
    Candidate {
        topology: it.body.topology,
        effects: it.body.effects,
        stitches: Some(it.body.stitches),
    }
}

/// Performs some substeps of the bodies that are apart and have no contact with themselves, and tracks energy if `tracked`.
pub(super) fn advance(
    bodies: &mut [GroupedBody],
    substeps: &Range<u32>,
    tracked: bool,
    context: &StepContext,
) {
    let settings = context.settings;
    let iterations = substeps.len() * settings.substep(0).total_iterations() as usize;
    let mut apart: Vec<_> = bodies.iter_mut().filter(|it| it.is_alone()).collect();
    let are_copies = |a: &&mut GroupedBody, b: &&mut GroupedBody| {
        let are_free = a.body.controls.is_none() && b.body.controls.is_none();
        !tracked && are_free && candidate(a).is_copy_of(&candidate(b), settings)
    };
    let size = |first: &&mut GroupedBody, copies, threads| {
        copies::group_size(first.body.topology, copies, threads, context.instructions)
    };
    let load = |it: &&mut GroupedBody| -> WorkEstimate {
        let Stepper {
            topology, effects, ..
        } = &it.body;
        it.body.direct.load(effects, topology, iterations)
    };
    context.threads.for_each_group(
        &mut apart,
        (are_copies, size),
        load,
        &|group: &mut [&mut GroupedBody], threads: &Threads| {
            let context = StepContext {
                threads,
                ..*context
            };
            match group {
                [it] if tracked => {
                    it.result = ledger::advance(&mut it.body, substeps.clone(), &context);
                }
                [it] => {
                    let done = it.body.advance(substeps.clone(), &context);
                    it.result = done.map(|()| Ledger::default());
                }
                copies => {
                    let steppers = copies.iter_mut().map(|it| it.body.reborrow());
                    let results = copies::advance(steppers, substeps, &context);
                    for (it, result) in copies.iter_mut().zip(results) {
                        it.result = result.map(|()| Ledger::default());
                    }
                }
            }
        },
    );
}

/// What substeps change of a body, as it was before.
#[derive(Debug)]
struct Kept {
    particles: Particles,
    others: BodyEffectStates,
    recorded: Recorded,
    is_touched: bool,
    stitches: Option<Stitches>,
}

impl Kept {
    fn of(body: &Stepper) -> Self {
        Self {
            particles: body.particles.clone(),
            others: body.states.others.clone(),
            recorded: body.states.recorded.clone(),
            is_touched: body.states.is_touched,
            stitches: (!body.stitches.is_empty()).then(|| body.stitches.clone()),
        }
    }

    fn put_back(self, body: &mut Stepper) {
        *body.particles = self.particles;
        body.states.others = self.others;
        body.states.recorded = self.recorded;
        body.states.is_touched = self.is_touched;
        if let Some(stitches) = self.stitches {
            *body.stitches = stitches;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        Body, Compliance, Contact, Density, Plasticity, RestShape, Stretch, Topology, World,
        measure::state_hash,
    };
    use glam::Vec3;
    use std::sync::Arc;

    /// A sheet of 1 m, with contact.
    fn sheet(topology: &Arc<Topology>, at: Vec3, velocity: Vec3) -> Body {
        let mut body = Body::new("sheet", Arc::clone(topology), Density::of(1.0));
        body.effects.stretch = Some(Stretch {
            compliance: Compliance::of(1e-6),
            ..Stretch::default()
        });
        body.effects.contact = Some(Contact::default());
        body.translate(at);
        body.set_velocity(velocity);
        body
    }

    fn topology() -> Arc<Topology> {
        let side = 9;
        let at = |x: u32, y: u32| y * side + x;
        let mut shape = RestShape {
            vertices: (0..side * side)
                .map(|i| Vec3::new((i % side) as f32, 0.0, (i / side) as f32) / 8.0)
                .collect(),
            ..RestShape::default()
        };
        for (x, y) in (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| (x, y))) {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            shape.triangles.extend([[a, c, d], [a, d, b]]);
            shape.edges.extend([[a, b], [a, c], [a, d], [b, d], [c, d]]);
        }
        shape.edges.sort_unstable();
        shape.edges.dedup();
        Arc::new(Topology::new(shape).expect("a sound sheet"))
    }

    fn world(bodies: Vec<Body>) -> World {
        let mut world = World {
            bodies,
            ..World::default()
        };
        world.sleep.enabled = false;
        world
    }

    fn hashes(world: &World) -> Vec<u64> {
        let all = world.bodies.iter();
        all.map(|it| state_hash(std::iter::once(&it.particles)))
            .collect()
    }

    /// Bodies that nothing comes near, beside two that meet, have the bits that they have without contact, as
    /// copies or alone.
    #[test]
    fn a_body_beside_others_that_meet_is_stepped_as_without_contact() {
        let topology = topology();
        let lone = (0..5).map(|i| {
            let at = Vec3::new(5.0 + 4.0 * i as f32, 0.0, 0.0);
            let mut body = sheet(&topology, at, Vec3::Y * i as f32);
            body.particles.set_velocity(3, Vec3::new(1.0, 2.0, -1.0));
            body
        });
        let lone: Vec<_> = lone.collect();
        let mut bodies = vec![
            sheet(&topology, Vec3::ZERO, Vec3::Y),
            sheet(&topology, Vec3::new(0.1, 0.2, 0.05), Vec3::NEG_Y),
        ];
        bodies.extend(lone.clone());
        let mut with = world(bodies);
        let mut without = world(lone);
        for body in &mut without.bodies {
            body.effects.contact = None;
        }
        let mut met = false;
        for tick in 0..60 {
            with.tick();
            without.tick();
            assert_eq!(hashes(&with)[2..], hashes(&without), "tick {tick}");
            let counts = with.contacts().counts();
            assert!(counts.apart >= 5, "tick {tick}: {counts:?}");
            assert_eq!(counts.repeated, 0);
            met |= counts.acting > 0;
        }
        assert!(met, "two of them meet");
    }

    /// A body that expands like an explosion reaches another within a tick: that is stepped again, with the bits
    /// of bodies that are always stepped together, as those with plastic flow are.
    #[test]
    fn a_tick_with_an_unforeseen_motion_is_stepped_again() {
        let topology = topology();
        let mut charge = sheet(&topology, Vec3::ZERO, Vec3::ZERO);
        for i in 0..charge.particles.len() {
            let x = charge.particles.position(i);
            charge.particles.set_position(i, x * 0.05);
        }
        charge.tick_start.clone_from(&charge.particles);
        let other = sheet(&topology, Vec3::X * 0.7, Vec3::ZERO);
        let third = sheet(&topology, Vec3::X * 50.0, Vec3::ZERO);
        let mut bodies = vec![charge, other, third];
        let mut tried = world(bodies.clone());
        bodies[2].effects.plasticity = Some(Plasticity::default());
        let mut together = world(bodies);
        let mut apart = 0;
        for tick in 0..60 {
            tried.tick();
            together.tick();
            assert_eq!(hashes(&tried), hashes(&together), "tick {tick}");
            assert_eq!(tried.crossings(), 0, "tick {tick}");
            apart += tried.contacts().counts().apart;
            assert_eq!(together.contacts().counts().apart, 0);
        }
        assert!(
            tried.contacts().counts().repeated > 0,
            "it comes near at once"
        );
        assert!(apart > 0, "the third is left alone");
    }
}
