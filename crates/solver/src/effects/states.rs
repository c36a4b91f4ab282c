//! States of the effects of a body.

use super::{
    body_kinds::BodyEffectStates,
    controls::ByParticle,
    free::{Free, SpinState},
    rod,
    workspace::Workspace,
};
use crate::{
    Effects, ElasticKind, Particles, SurfaceForce, TearState, Topology, colliders::inside::WayOut,
    particles::surface_force::Recorded,
};
use glam::Vec4;

/// State of the effects of a body between iterations, and for measurements: multipliers λ of
/// elastic effects, one column per effect that is present, and the states of the others. λ/h² is a
/// force.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct EffectStates {
    multipliers: [Vec<f32>; ElasticKind::COUNT],
    /// Sums of the displacements of averaged passes; zeros between them.
    sums: Vec<Vec4>,
    /// Whether forces of ground and colliders are recorded, for
    /// [`surface_forces`](Self::surface_forces) and
    /// [`field::contact_force`](crate::field::contact_force); default false. It does not change the
    /// motion.
    pub records_contacts: bool,
    pub(crate) recorded: Recorded,
    /// Whether the body touched something in the tick, or is stitched to something.
    pub is_touched: bool,
    /// Workspace of a body that is stepped in lanes.
    pub(crate) workspace: Workspace,
    /// What was found at the beginning of the tick.
    pub(crate) scratch: Scratch,
    /// Limits of tearing.
    pub(crate) tear: Option<Box<TearState>>,
    /// States of effects without elements.
    pub others: BodyEffectStates,
}

/// What was found at the beginning of a tick, and memory for it; nothing before the first one. No part of the
/// state of a body: any two are equal.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch(Option<Box<Found>>);

#[derive(Debug, Clone, Default)]
pub(crate) struct Found {
    /// What the body needs to keep its angular momentum.
    pub spin: SpinState,
    /// The sides to which it leaves the colliders that it began the tick in.
    pub sides: Vec<WayOut>,
    /// What an app does to it.
    pub controls: ByParticle,
    /// Memory for a wind.
    pub loads: Vec<Vec4>,
    /// The largest component of a displacement in any substep [m], from the value that is set before;
    /// `None` unless it is measured.
    pub longest: Option<f32>,
}

impl PartialEq for Scratch {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Scratch {
    /// To be filled.
    pub fn found(&mut self) -> &mut Found {
        self.0.get_or_insert_default()
    }

    /// The parts that can rotate freely.
    pub fn free(&self) -> Free {
        self.0.as_ref().map_or(Free::None, |found| found.spin.free)
    }

    /// Memory use in bytes.
    fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |found| {
            let columns = size_of_val(&found.sides[..]) + size_of_val(&found.loads[..]);
            size_of::<Found>() + columns + found.spin.bytes() + found.controls.bytes()
        })
    }
}

impl EffectStates {
    /// Multipliers of an elastic effect, element by element; empty where they are not stored.
    #[must_use]
    pub fn multipliers(&self, kind: ElasticKind) -> &[f32] {
        &self.multipliers[kind as usize]
    }

    /// Forces of ground and colliders on the body in the last tick, sorted by surface; none unless
    /// [contacts are recorded](Self::records_contacts), and none of a body that sleeps.
    #[must_use]
    pub fn surface_forces(&self) -> &[SurfaceForce] {
        self.recorded.forces()
    }

    /// Ends a tick of `seconds`: takes the forces of ground and colliders on these particles.
    /// [`World`](crate::World) does so, before the body is torn.
    pub fn end_contacts(&mut self, particles: &Particles, seconds: f64) {
        self.recorded.end_tick(|i| particles.position(i), seconds);
    }

    /// Forgets the contacts of a tick that failed.
    pub fn forget_contacts(&mut self) {
        self.recorded.clear();
    }

    /// States of a body in the middle of a run, as far as they follow from its particles: energies and
    /// residuals of rods. The others are found in the next tick.
    #[must_use]
    pub fn resumed(effects: &Effects, topology: &Topology, particles: &Particles) -> Self {
        let mut states = Self::default();
        states.resume(effects, topology, particles);
        states
    }

    /// See [`resumed`](Self::resumed).
    pub(crate) fn resume(&mut self, effects: &Effects, topology: &Topology, particles: &Particles) {
        let rod = effects.rod.as_ref();
        self.others.rod = rod.and_then(|it| rod::resumed(it, topology, &particles.segments));
    }

    /// Allocates the multipliers of an effect, or frees them if they are not `kept`.
    pub fn make_room(&mut self, kind: ElasticKind, topology: &Topology, kept: bool) {
        let column = &mut self.multipliers[kind as usize];
        let count = if kept { kind.multipliers(topology) } else { 0 };
        if column.len() != count {
            *column = vec![0.0; count];
        }
    }

    /// Multipliers of all elastic effects, in the order of [`ElasticKind::ALL`].
    pub(crate) fn columns(&mut self) -> &mut [Vec<f32>; ElasticKind::COUNT] {
        &mut self.multipliers
    }

    /// Allocates sums for `count` particles.
    pub(crate) fn make_sums(&mut self, count: usize) {
        if self.sums.len() != count {
            self.sums = vec![Vec4::ZERO; count];
        }
    }

    /// Resets multipliers and sums, whose values after an error would depend on the threads.
    pub(crate) fn clear_solutions(&mut self) {
        self.multipliers.iter_mut().for_each(|it| it.fill(0.0));
        self.sums.fill(Vec4::ZERO);
    }

    /// Sums of the displacements of averaged passes, by particle.
    pub(crate) fn sums(&mut self) -> &mut [Vec4] {
        &mut self.sums
    }

    /// Forgets what belongs to particles or elements, for another topology; what was measured in the
    /// last substep or tick remains.
    pub(crate) fn forget(&mut self) {
        let before = std::mem::take(self);
        self.records_contacts = before.records_contacts;
        self.recorded = before.recorded;
        self.others.grab = before.others.grab.of_point();
        // Found anew in the next tick.
        self.others.grains = before.others.grains;
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.multipliers
            .iter()
            .map(|column| size_of_val(&column[..]))
            .sum::<usize>()
            + size_of_val(&self.sums[..])
            + self.recorded.bytes()
            + self.workspace.bytes()
            + self.scratch.bytes()
            + self.tear.as_deref().map_or(0, TearState::bytes)
            + self.others.bytes()
    }
}
