//! Access to the chains of a body from several threads: those of each piece.

#![allow(
    unsafe_code,
    reason = "threads get pieces of one borrow that share no element"
)]

use super::{
    RodState,
    bundle::{Bundle, Scratch},
    chains::ChainRange,
    system::{Errors, SegmentState, System},
};
use crate::{
    partitions::Piece,
    step::scope::{Column, Scope, Side},
};
use std::{
    ops::Range,
    ptr,
    sync::{Mutex, PoisonError},
};

/// A rod works on whole chains: those that begin in the even partitions, in the odd ones, and those
/// that are too long for a piece. Chains share no particle, so the order changes no bit.
pub enum EachChain {}

impl Scope<Option<Box<RodState>>> for EachChain {
    const SIDES: [Option<Side>; 3] = [Some(Side::Even), Some(Side::Odd), Some(Side::Whole)];
    type Shared = SharedRod;
    type Piece<'a>
        = RodPiece<'a>
    where
        Option<Box<RodState>>: 'a;

    fn share(state: &mut Option<Box<RodState>>) -> SharedRod {
        state.as_deref_mut().map_or_else(
            || SharedRod::of(&mut [], &mut [], &mut [], &[], None),
            |RodState {
                 system,
                 bundles,
                 groups,
                 scratch,
                 ..
             }| {
                let System {
                    segments, lambdas, ..
                } = system;
                SharedRod::of(bundles, segments, lambdas, groups, Some(scratch))
            },
        )
    }

    unsafe fn piece<'a>(shared: &'a SharedRod, piece: &Piece) -> RodPiece<'a>
    where
        Option<Box<RodState>>: 'a,
    {
        // SAFETY: borrowed by `share`, and groups are only read while it is shared; those of pieces
        // that share no particle share no element.
        unsafe {
            let group = group(&*shared.groups, piece);
            RodPiece {
                first_segment: group.segments.start,
                segments: shared.segments.part(group.segments.clone()),
                lambdas: shared.lambdas.part(group.segments),
                bundles: shared.bundles.part(group.bundles),
                scratch: shared.scratch.as_ref(),
            }
        }
    }
}

/// The bundles of a piece.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    /// Places of the bundles.
    pub bundles: Range<usize>,
    /// Numbers of their segments.
    pub segments: Range<usize>,
}

/// A rod on which threads work.
pub struct SharedRod {
    bundles: Column<Bundle>,
    segments: Column<SegmentState>,
    lambdas: Column<Errors>,
    groups: *const [Group],
    scratch: *const Scratches,
}

/// The part of a rod that belongs to a piece.
pub struct RodPiece<'a> {
    pub bundles: &'a mut [Bundle],
    /// A copy of the segments, as of the last substep.
    pub segments: &'a mut [SegmentState],
    pub lambdas: &'a mut [Errors],
    /// Number of the first segment.
    pub first_segment: usize,
    /// `None` for a body without a rod.
    pub scratch: Option<&'a Scratches>,
}

impl SharedRod {
    /// Borrows the bundles, segments and multipliers of a rod while they are shared.
    fn of(
        bundles: &mut [Bundle],
        segments: &mut [SegmentState],
        lambdas: &mut [Errors],
        groups: &[Group],
        scratch: Option<&Scratches>,
    ) -> Self {
        Self {
            bundles: Column::of(bundles),
            segments: Column::of(segments),
            lambdas: Column::of(lambdas),
            groups,
            scratch: scratch.map_or(ptr::null(), ptr::from_ref),
        }
    }

    /// Numbers of the segments of the chains of a piece.
    ///
    /// # Safety
    /// The rod is still borrowed.
    pub unsafe fn segments_of(&self, piece: &Piece) -> Range<usize> {
        // SAFETY: borrowed by `of`, and only read while it is shared.
        unsafe { group(&*self.groups, piece) }.segments
    }
}

/// The group of a piece.
fn group(groups: &[Group], piece: &Piece) -> Group {
    let of_piece = match piece.partition {
        Some(partition) => groups.get(partition),
        None => groups.last(),
    };
    of_piece.cloned().unwrap_or_default()
}

/// The bundles of the chains of each partition, and of those that are too long for one.
pub fn groups(
    parts: &[ChainRange],
    bundles: impl Fn(Range<usize>) -> Vec<Bundle>,
) -> (Vec<Bundle>, Vec<Group>) {
    let mut all = Vec::new();
    let of_part = |part: &ChainRange| {
        let first = all.len();
        all.extend(bundles(part.chains.clone()));
        Group {
            bundles: first..all.len(),
            segments: part.segments.clone(),
        }
    };
    let groups = parts.iter().map(of_part).collect();
    (all, groups)
}

/// Memory for the solution of chains, for as many threads as work on the body.
#[derive(Debug, Default)]
pub struct Scratches(Mutex<Vec<Scratch>>);

impl Scratches {
    /// Works with one of them.
    pub fn with(&self, work: impl FnOnce(&mut Scratch)) {
        let all = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut one = all().pop().unwrap_or_default();
        work(&mut one);
        all().push(one);
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.iter().map(Scratch::bytes).sum()
    }
}

/// A copy of a rod gets memory of its own.
impl Clone for Scratches {
    fn clone(&self) -> Self {
        Self::default()
    }
}
