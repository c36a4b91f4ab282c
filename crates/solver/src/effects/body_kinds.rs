//! Maps kinds of effects without elements to their types.

#![allow(unsafe_code, reason = "states are handed out to threads")]

use super::{
    body_effect::{
        BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, Resting, Store, WorkOf,
    },
    stitches::{Stitches, Stitching},
};
use crate::{
    Effects, Topology,
    kernel::{each::InLanes, sum::SquareSum},
    parallel::scope::{Scope, Side},
    particles::{Part, Particles},
    partitions::Piece,
};
use glam::{DVec3, Vec4};
use std::ops::Range;

/// Generates the code for effects without elements.
macro_rules! of_body_effects {
    (
        {
            forces { $($force:tt)* }
            masks { $($mask:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($elastic:tt)* }
            shapes { $($shape:ident $shaped:ident $shapes:literal;)* }
        }
        $stitches:ident $stitched:ident
        { pins { $($pin:ident $pinned:ident $pins:literal;)* } }
        $grab:ident $grabbed:ident
        {
            chains { $($chain:ident $chained:ident $chains:literal;)* }
            between { $($between:tt)* }
            surfaces { $($surface:ident $surfaced:ident $surfaces:literal;)* }
            changes { $($change:tt)* }
        }
    ) => {
        of_body_effects! {
            $($shape $shaped,)*
            ; $stitches $stitched
            ; $($pin $pinned,)* $grab $grabbed, $($chain $chained,)* $($surface $surfaced,)*
        }
    };
    ($($before:ident $first:ident,)*; $stitches:ident $stitched:ident; $($after:ident $last:ident,)*) => {
        /// The effects without elements, in the order in which they act.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum BodyEffectKind {
            $(#[doc = concat!("[`", stringify!($before), "`](crate::", stringify!($before), ").")] $before,)*
            #[doc = concat!("[`", stringify!($stitches), "`](crate::", stringify!($stitches), ").")]
            $stitches,
            $(#[doc = concat!("[`", stringify!($after), "`](crate::", stringify!($after), ").")] $after,)*
        }

        impl BodyEffectKind {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$before,)* Self::$stitches, $(Self::$after,)*];

            /// Its name in files and commands.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$before => stringify!($first),)*
                    Self::$stitches => stringify!($stitched),
                    $(Self::$after => stringify!($last),)*
                }
            }

            /// When it acts in a substep.
            #[must_use]
            pub const fn phase(self) -> BodyPhase {
                match self {
                    $(Self::$before => <crate::$before as BodyEffect>::PHASE,)*
                    Self::$stitches => Stitching::PHASE,
                    $(Self::$after => <crate::$after as BodyEffect>::PHASE,)*
                }
            }

            /// Row of the energy ledger for its work.
            pub(crate) const fn work(self) -> WorkOf {
                match self {
                    $(Self::$before => <crate::$before as BodyEffect>::WORK,)*
                    Self::$stitches => Stitching::WORK,
                    $(Self::$after => <crate::$after as BodyEffect>::WORK,)*
                }
            }

            /// Whether a body may stay in lanes for it.
            pub(crate) const fn is_in_lanes(self) -> bool {
                match self {
                    $(Self::$before => <crate::$before as BodyEffect>::IN_LANES,)*
                    Self::$stitches => Stitching::IN_LANES,
                    $(Self::$after => <crate::$after as BodyEffect>::IN_LANES,)*
                }
            }

            /// Whether it has no torque on a body without pins.
            pub(crate) const fn is_internal(self) -> bool {
                match self {
                    $(Self::$before => <crate::$before as BodyEffect>::IS_INTERNAL,)*
                    Self::$stitches => Stitching::IS_INTERNAL,
                    $(Self::$after => <crate::$after as BodyEffect>::IS_INTERNAL,)*
                }
            }

            /// Pieces of a body on which it works, one side after the other.
            pub(crate) const fn sides(self) -> [Option<Side>; 3] {
                match self {
                    $(Self::$before => <ScopeOf<crate::$before> as Scope<StateOf<crate::$before>>>::SIDES,)*
                    Self::$stitches => <ScopeOf<Stitching> as Scope<Stitches>>::SIDES,
                    $(Self::$after => <ScopeOf<crate::$after> as Scope<StateOf<crate::$after>>>::SIDES,)*
                }
            }
        }

        impl Effects {
            /// Whether a body has the effect; `stitched` tells whether it has stitches.
            #[must_use]
            pub fn carries(&self, kind: BodyEffectKind, stitched: bool) -> bool {
                match kind {
                    $(BodyEffectKind::$before => self.$first.is_some(),)*
                    BodyEffectKind::$stitches => stitched,
                    $(BodyEffectKind::$after => self.$last.is_some(),)*
                }
            }

            /// Number of constraints of all of them on a body, except stitches.
            pub(crate) fn body_constraints(&self, topology: &Topology) -> usize {
                let counts = [
                    $(self.$first.as_ref().map_or(0, |effect| effect.constraints(topology)),)*
                    $(self.$last.as_ref().map_or(0, |effect| effect.constraints(topology)),)*
                ];
                counts.into_iter().sum()
            }

            /// Estimated cost of a pass of all of them, in constraints of elastic effects.
            pub(crate) fn body_load(&self, topology: &Topology) -> usize {
                let loads = [
                    $(self.$first.as_ref().map_or(0, |effect| effect.load(topology)),)*
                    $(self.$last.as_ref().map_or(0, |effect| effect.load(topology)),)*
                ];
                loads.into_iter().sum()
            }
        }

        /// States of the effects without elements of a body; that of an absent effect is empty.
        /// Stitches are separate, because their broken flags are part of the stored state.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct BodyEffectStates {
            $(#[doc = concat!("Of [`", stringify!($before), "`](crate::", stringify!($before), ").")] pub $first: StateOf<crate::$before>,)*
            $(#[doc = concat!("Of [`", stringify!($after), "`](crate::", stringify!($after), ").")] pub $last: StateOf<crate::$after>,)*
        }

        impl BodyEffectStates {
            /// Begins a tick of a body with these positions [m] and inverse masses [1/kg]: clears
            /// the states of absent effects.
            pub(crate) fn begin_tick(&mut self, effects: &Effects, topology: &Topology, positions: &[Vec4]) {
                $(match &effects.$first {
                    Some(effect) => effect.begin_tick(&mut self.$first, topology, positions),
                    None => self.$first = Default::default(),
                })*
                $(match &effects.$last {
                    Some(effect) => effect.begin_tick(&mut self.$last, topology, positions),
                    None => self.$last = Default::default(),
                })*
            }

            /// Updates the state of an effect for a body before it is stepped.
            pub(crate) fn prepare(&mut self, (effects, kind): (&Effects, BodyEffectKind), body: &Resting) {
                match kind {
                    $(BodyEffectKind::$before => if let Some(effect) = &effects.$first {
                        effect.prepare(&mut self.$first, body);
                    },)*
                    BodyEffectKind::$stitches => {}
                    $(BodyEffectKind::$after => if let Some(effect) = &effects.$last {
                        effect.prepare(&mut self.$last, body);
                    },)*
                }
            }

            /// Energy that an effect stores in a body with particles `at` positions in m and
            /// inverse masses in 1/kg.
            pub(crate) fn stores(
                &self,
                (effects, kind): (&Effects, BodyEffectKind),
                topology: &Topology,
                at: &dyn Fn(u32) -> (DVec3, f64),
                store: &mut dyn FnMut(Store),
            ) {
                match kind {
                    $(BodyEffectKind::$before => if let Some(effect) = &effects.$first {
                        effect.stores(&self.$first, topology, at, store);
                    },)*
                    BodyEffectKind::$stitches => {}
                    $(BodyEffectKind::$after => if let Some(effect) = &effects.$last {
                        effect.stores(&self.$last, topology, at, store);
                    },)*
                }
            }

            /// Number of elements of an effect on a body, as shown to users; 0 for stitches.
            #[must_use]
            pub fn elements(&self, (effects, kind): (&Effects, BodyEffectKind), topology: &Topology) -> usize {
                match kind {
                    $(BodyEffectKind::$before => effects.$first.map_or(0, |effect| {
                        effect.elements(&self.$first, topology)
                    }),)*
                    BodyEffectKind::$stitches => 0,
                    $(BodyEffectKind::$after => effects.$last.map_or(0, |effect| {
                        effect.elements(&self.$last, topology)
                    }),)*
                }
            }

            /// Residual of the equations of an effect after a substep of `h` seconds.
            #[must_use]
            pub fn residual(
                &self,
                (effects, kind): (&Effects, BodyEffectKind),
                topology: &Topology,
                particles: &Particles,
                h: f64,
            ) -> SquareSum {
                match kind {
                    $(BodyEffectKind::$before => effects.$first.map_or_else(SquareSum::default, |effect| {
                        effect.residual(&self.$first, topology, particles, h)
                    }),)*
                    BodyEffectKind::$stitches => SquareSum::default(),
                    $(BodyEffectKind::$after => effects.$last.map_or_else(SquareSum::default, |effect| {
                        effect.residual(&self.$last, topology, particles, h)
                    }),)*
                }
            }

            /// Memory use in bytes.
            #[must_use]
            pub(crate) fn bytes(&self) -> usize {
                let bytes = [
                    $(<crate::$before as BodyEffect>::bytes(&self.$first),)*
                    $(<crate::$after as BodyEffect>::bytes(&self.$last),)*
                ];
                bytes.into_iter().sum()
            }
        }

        /// The states while several threads work on the body.
        pub(crate) struct SharedStates {
            $($first: SharedOf<crate::$before>,)*
            $stitched: SharedOf<Stitching>,
            $($last: SharedOf<crate::$after>,)*
        }

        impl SharedStates {
            /// Borrows the states while they are shared.
            pub fn of(states: &mut BodyEffectStates, stitches: &mut Stitches) -> Self {
                Self {
                    $($first: <ScopeOf<crate::$before> as Scope<_>>::share(&mut states.$first),)*
                    $stitched: <ScopeOf<Stitching> as Scope<_>>::share(stitches),
                    $($last: <ScopeOf<crate::$after> as Scope<_>>::share(&mut states.$last),)*
                }
            }

            /// Numbers of the segments that a rod solves on a piece.
            ///
            /// # Safety
            /// The states are still borrowed.
            pub unsafe fn segments(&self, piece: &Piece) -> Range<usize> {
                // SAFETY: the caller keeps the states borrowed.
                unsafe { self.rod.segments_of(piece) }
            }

            /// Begins a substep on a piece.
            ///
            /// # Safety
            /// The states are still borrowed, and no other thread works on the piece, or on one
            /// that shares a particle with it.
            pub unsafe fn begin(&self, particles: &Range<usize>) {
                // SAFETY: the caller keeps the states borrowed, and no other thread works on these
                // particles.
                unsafe {
                    $(<ScopeOf<crate::$before> as Scope<StateOf<crate::$before>>>::begin(&self.$first, particles.clone());)*
                    $(<ScopeOf<crate::$after> as Scope<StateOf<crate::$after>>>::begin(&self.$last, particles.clone());)*
                }
            }

            /// Performs a pass of one effect over a piece in lanes, see
            /// [`BodyEffect::solve_in_lanes`].
            ///
            /// # Safety
            /// As for [`solve`](Self::solve).
            pub unsafe fn solve_in_lanes(
                &self,
                (effects, kind): (&Effects, BodyEffectKind),
                piece: &Piece,
                particles: &mut impl InLanes,
                pass: &BodyPass,
            ) -> Option<u64> {
                // SAFETY: the caller keeps the states borrowed, and no other thread works on the
                // piece, nor on the body if the effect works on all of it.
                unsafe {
                    match kind {
                        $(BodyEffectKind::$before => effects.$first.as_ref().map_or(Some(0), |effect| {
                            let state = <ScopeOf<crate::$before> as Scope<StateOf<crate::$before>>>::piece(&self.$first, piece);
                            effect.solve_in_lanes(state, particles, pass)
                        }),)*
                        BodyEffectKind::$stitches => None,
                        $(BodyEffectKind::$after => effects.$last.as_ref().map_or(Some(0), |effect| {
                            let state = <ScopeOf<crate::$after> as Scope<StateOf<crate::$after>>>::piece(&self.$last, piece);
                            effect.solve_in_lanes(state, particles, pass)
                        }),)*
                    }
                }
            }

            /// Performs a pass of one effect over a piece; returns whether the body touched
            /// something.
            ///
            /// # Safety
            /// As for [`begin`](Self::begin); if the effect works on the whole body, no other
            /// thread works on the body.
            pub unsafe fn solve(
                &self,
                (effects, kind): (&Effects, BodyEffectKind),
                piece: &Piece,
                part: Part,
                pass: &BodyPass,
            ) -> bool {
                // SAFETY: the caller keeps the states borrowed, and no other thread works on the
                // piece, nor on the body if the effect works on all of it.
                unsafe {
                    match kind {
                        $(BodyEffectKind::$before => effects.$first.as_ref().is_some_and(|effect| {
                            let state = <ScopeOf<crate::$before> as Scope<StateOf<crate::$before>>>::piece(&self.$first, piece);
                            effect.solve(state, part, pass)
                        }),)*
                        BodyEffectKind::$stitches => {
                            let state = <ScopeOf<Stitching> as Scope<Stitches>>::piece(&self.$stitched, piece);
                            Stitching.solve(state, part, pass)
                        }
                        $(BodyEffectKind::$after => effects.$last.as_ref().is_some_and(|effect| {
                            let state = <ScopeOf<crate::$after> as Scope<StateOf<crate::$after>>>::piece(&self.$last, piece);
                            effect.solve(state, part, pass)
                        }),)*
                    }
                }
            }
        }

        /// State of the reference for effects without elements.
        #[derive(Debug, Clone, Default)]
        pub(crate) struct ReferenceStates {
            $(pub $first: <crate::$before as BodyEffect>::ReferenceState,)*
            pub $stitched: <Stitching as BodyEffect>::ReferenceState,
            $(pub $last: <crate::$after as BodyEffect>::ReferenceState,)*
        }

        impl ReferenceStates {
            /// Updates the states for a body at `x` [m] with inverse masses `w` [1/kg].
            pub fn prepare(&mut self, effects: &Effects, topology: &Topology, x: &[DVec3], w: &[f64]) {
                $(if let Some(effect) = &effects.$first {
                    effect.prepare_reference(&mut self.$first, topology, x, w);
                })*
                $(if let Some(effect) = &effects.$last {
                    effect.prepare_reference(&mut self.$last, topology, x, w);
                })*
            }

            /// Begins a substep of a body with this number of particles.
            pub fn begin(&mut self, effects: &Effects, particles: usize) {
                $(if let Some(effect) = &effects.$first {
                    effect.begin_reference(&mut self.$first, particles);
                })*
                $(if let Some(effect) = &effects.$last {
                    effect.begin_reference(&mut self.$last, particles);
                })*
            }

            /// Performs a pass of one effect.
            pub fn solve(
                &mut self,
                (effects, kind): (&Effects, BodyEffectKind),
                body: ReferenceParticles,
                pass: &ReferencePass,
            ) {
                match kind {
                    $(BodyEffectKind::$before => if let Some(effect) = &effects.$first {
                        effect.solve_reference(&mut self.$first, body, pass);
                    },)*
                    BodyEffectKind::$stitches => {
                        Stitching.solve_reference(&mut self.$stitched, body, pass);
                    }
                    $(BodyEffectKind::$after => if let Some(effect) = &effects.$last {
                        effect.solve_reference(&mut self.$last, body, pass);
                    },)*
                }
            }

            /// Moves particles by the current multipliers of one effect.
            pub fn pull(&mut self, (effects, kind): (&Effects, BodyEffectKind), body: ReferenceParticles) {
                match kind {
                    $(BodyEffectKind::$before => if let Some(effect) = &effects.$first {
                        effect.pull_reference(&mut self.$first, body);
                    },)*
                    BodyEffectKind::$stitches => {}
                    $(BodyEffectKind::$after => if let Some(effect) = &effects.$last {
                        effect.pull_reference(&mut self.$last, body);
                    },)*
                }
            }
        }
    };
}

type StateOf<E> = <E as BodyEffect>::State;
type ScopeOf<E> = <E as BodyEffect>::Scope;
type SharedOf<E> = <ScopeOf<E> as Scope<StateOf<E>>>::Shared;

crate::effects!(of_body_effects);
