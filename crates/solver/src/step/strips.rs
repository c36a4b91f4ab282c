//! Steps a body in [strips](crate::topology::strips): its particles go into lanes before the
//! constraints of effects that fill them, and back before what is not solved in lanes. Where nothing
//! else acts but gravity and contact with ground and colliders, they stay from one substep to the next:
//! a piece leaves them for a contact alone, unless that can [act in lanes], as the ground does mostly.
//!
//! [act in lanes]: crate::effects::body_effect::BodyEffect::solve_in_lanes

use super::{
    advance::{Acting, StepContext},
    phases::Task,
};
use crate::{
    ElasticKind, Topology,
    effects::free::Free,
    kernel::lanes::{Instructions, MAX_WIDTH},
    parallel::scope::Side,
};

/// A body in strips.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InStrips {
    /// The effects whose constraints are solved in lanes.
    solved: [bool; ElasticKind::COUNT],
    /// Whether particles stay in lanes from one substep to the next.
    stay: bool,
    /// Whether constraints need carries.
    are_damped: bool,
}

impl InStrips {
    /// How some substeps, or stages of one, are faster in strips; `None` if they are not.
    pub fn of(
        topology: &Topology,
        acting: Acting,
        tasks: impl Iterator<Item = (Task, Side)> + Clone,
        context: &StepContext,
    ) -> Option<Self> {
        let settings = context.settings;
        let effects = acting.effects;
        let any = settings.substep(0);
        topology.partitions.strips()?;
        if settings.method.relaxation() < 1.0
            || any.averaging(any.total_iterations() - 1).is_some()
            || context.watch.is_some()
        {
            return None;
        }
        let least = min_fill(context.instructions) * MAX_WIDTH as f32;
        let solved = ElasticKind::ALL.map(|kind| {
            effects.has(kind) && {
                let patterns = kind.patterns(topology) as f32;
                patterns > 0.0 && kind.elements(topology) as f32 >= least * patterns
            }
        });
        let is_solved = |task| matches!(task, Task::Elastic { kind, .. } if solved[kind as usize]);
        let mut all = tasks.clone();
        all.any(|(task, _)| is_solved(task)).then(|| Self {
            solved,
            stay: has_several_substeps(tasks.clone())
                && tasks.into_iter().all(|(task, _)| {
                    is_solved(task)
                        || matches!(
                            task,
                            Task::Push
                                | Task::Begin
                                | Task::MovePins { .. }
                                | Task::Grabs { .. }
                                | Task::EndAndBegin { .. }
                                | Task::End { .. }
                                | Task::Keep { .. }
                                | Task::Sum { .. }
                                | Task::TurnBack { .. }
                        )
                        || matches!(task, Task::FindTurn { .. }) && acting.free == Free::Whole
                        || matches!(task, Task::Body { kind, .. } if kind.is_in_lanes())
                        || matches!(task, Task::Force { kind, .. } if effects.pushes_in_lanes(kind))
                }),
            are_damped: ElasticKind::ALL
                .into_iter()
                .any(|kind| effects.damping(kind).is_some_and(|it| it.get() > 0.0)),
        })
    }

    /// Whether positions and carries move in lanes.
    pub fn stay(&self) -> bool {
        self.stay
    }
}

/// Whether a substep follows the end of another.
pub(super) fn has_several_substeps(tasks: impl Iterator<Item = (Task, Side)>) -> bool {
    let is_end = |task| matches!(task, Task::EndAndBegin { .. } | Task::End { .. });
    let mut from_end = tasks.skip_while(|(task, _)| !is_end(*task));
    from_end.nth(1).is_some()
}

/// Mean fraction of the lanes that the constraints of an effect must fill to be solved faster than
/// with gathers. On an AMD EPYC (Zen 5), full lanes were 2.6 times as fast with AVX-512, 1.8 times with
/// AVX2 and 1.4 times with SSE2, where numbers for some of the lanes are put there one by one.
///
/// Miri has few instructions, and is to see everything.
fn min_fill(instructions: Instructions) -> f32 {
    if cfg!(miri) {
        return 0.0;
    }
    match instructions.widest() {
        MAX_WIDTH => 0.4,
        _ if instructions.expands() => 0.75,
        _ => 0.95,
    }
}

/// Tasks with those that move particles into lanes and back, if the body is in strips.
#[derive(Debug, Clone)]
pub(crate) struct Moving<I> {
    tasks: I,
    strips: Option<InStrips>,
    /// Whether particles are in lanes.
    are_in_lanes: bool,
    next: Option<(Task, Side)>,
}

impl<I: Iterator<Item = (Task, Side)>> Moving<I> {
    pub fn new(tasks: I, strips: Option<InStrips>) -> Self {
        Self {
            tasks,
            strips,
            are_in_lanes: false,
            next: None,
        }
    }
}

impl<I: Iterator<Item = (Task, Side)>> Iterator for Moving<I> {
    type Item = (Task, Side);

    fn next(&mut self) -> Option<(Task, Side)> {
        if let Some(next) = self.next.take() {
            return Some(next);
        }
        let next = self.tasks.next();
        let Some(strips) = self.strips else {
            return next;
        };
        let into_lanes = match next {
            Some((Task::Elastic { kind, .. }, _)) => strips.solved[kind as usize],
            Some((Task::Keep { .. }, _)) => strips.stay,
            Some((
                Task::Push
                | Task::Force { .. }
                | Task::Begin
                | Task::MovePins { .. }
                | Task::Grabs { .. }
                | Task::EndAndBegin { .. }
                | Task::End { .. }
                | Task::Body { .. }
                | Task::Sum { .. }
                | Task::FindTurn { .. }
                | Task::TurnBack { .. },
                _,
            )) if strips.stay => self.are_in_lanes,
            _ => false,
        };
        if into_lanes == self.are_in_lanes {
            return next;
        }
        self.are_in_lanes = into_lanes;
        self.next = next;
        let task = if into_lanes {
            let carried = strips.stay || strips.are_damped;
            Task::Load { carried }
        } else {
            Task::Store { moved: strips.stay }
        };
        Some((task, Side::Any))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Collide, Effects, Ground, Outside, RestShape, StickyGround, Stretch, Tethers, World,
        advance::tasks,
    };
    use glam::Vec3;

    /// A grid stays in lanes for a tick where ground, colliders and an app act, and not where tethers do.
    #[test]
    fn a_grid_stays_in_lanes_among_ground_and_colliders() {
        let side = 20;
        let at = |x: u32, y: u32| y * side + x;
        let cells = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| (x, y)));
        let mut shape = RestShape {
            vertices: (0..side * side)
                .map(|i| Vec3::new((i % side) as f32, 0.0, (i / side) as f32))
                .collect(),
            ..RestShape::default()
        };
        for (x, y) in cells {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            shape.edges.extend([[a, b], [a, c], [a, d]]);
            shape.triangles.extend([[a, b, d], [a, d, c]]);
        }
        let topology = Topology::new(shape).expect("a sound sheet");
        let world = World::default();
        let context = StepContext {
            settings: &world.settings,
            time: 0.0,
            swept: &world.swept,
            threads: &world.threads,
            instructions: world.instructions,
            watch: None,
        };
        let stays_with = |effects: &Effects, outside| {
            let acting = Acting::of(effects, outside, &world.settings, Free::Whole);
            let tasks = tasks(&topology, acting, &(0..4), &context);
            InStrips::of(&topology, acting, tasks, &context).map(|it| it.stay())
        };
        let stays = |effects: &Effects| stays_with(effects, Outside::default());
        let plain = Effects {
            stretch: Some(Stretch::default()),
            ..Effects::default()
        };
        let contact = Effects {
            ground: Some(Ground::default()),
            sticky_ground: Some(StickyGround::default()),
            collide: Some(Collide::default()),
            ..plain
        };
        let tethered = Effects {
            tethers: Some(Tethers::default()),
            ..contact
        };
        assert!(topology.partitions.strips().is_some(), "it is a grid");
        // Others need lanes that are nearly full.
        if !context.instructions.expands() {
            return;
        }
        assert_eq!(stays(&plain), Some(true));
        assert_eq!(stays(&contact), Some(true));
        let controlled = Outside {
            pushed: true,
            steered: true,
            grabbed: true,
            ..Outside::default()
        };
        assert_eq!(stays_with(&contact, controlled), Some(true));
        assert_eq!(stays(&tethered), Some(false));
    }
}
