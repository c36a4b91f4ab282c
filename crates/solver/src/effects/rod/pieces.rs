//! Access to the chains and networks of a body from several threads: those of each piece.

#![allow(
    unsafe_code,
    reason = "threads get pieces of one borrow that share no element"
)]

use super::{
    RodState,
    bundle::{Bundle, Scratch},
    shape::ChainRange,
    system::{Errors, System},
};
use crate::{
    SegmentState,
    parallel::scope::{Column, Scope, Side},
    partitions::Piece,
};
use std::{
    ops::Range,
    ptr,
    sync::{Mutex, PoisonError},
};

/// A rod works on whole chains: those that begin in the even partitions, in the odd ones, and those
/// that are too long for a piece. Networks belong to the last piece. They share no particle, so the order
/// changes no bit.
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
                 chains,
                 networks,
                 bundles,
                 groups,
                 scratch,
                 ..
             }| {
                let System {
                    segments, lambdas, ..
                } = chains;
                let whole = Some((networks, &*scratch));
                SharedRod::of(bundles, segments, lambdas, groups, whole)
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
            let has_networks = has_networks(&*shared.groups, piece);
            RodPiece {
                networks: (has_networks && !shared.networks.is_null())
                    .then(|| &mut *shared.networks),
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
    networks: *mut System,
    /// Number of segments of the networks.
    network_segments: usize,
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
    /// The networks, in the last piece.
    pub networks: Option<&'a mut System>,
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
        whole: Option<(&mut System, &Scratches)>,
    ) -> Self {
        let (networks, scratch) = whole.unzip();
        Self {
            network_segments: networks.as_ref().map_or(0, |it| it.segments.len()),
            networks: networks.map_or(ptr::null_mut(), ptr::from_mut),
            bundles: Column::of(bundles),
            segments: Column::of(segments),
            lambdas: Column::of(lambdas),
            groups,
            scratch: scratch.map_or(ptr::null(), ptr::from_ref),
        }
    }

    /// Numbers of the segments of a piece: those of its chains, and behind the last of these the
    /// networks.
    ///
    /// # Safety
    /// The rod is still borrowed.
    pub unsafe fn segments_of(&self, piece: &Piece) -> Range<usize> {
        // SAFETY: borrowed by `of`, and only read while it is shared.
        let groups = unsafe { &*self.groups };
        let segments = group(groups, piece).segments;
        match has_networks(groups, piece) {
            true => segments.start..segments.end + self.network_segments,
            false => segments,
        }
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

/// Whether the networks of a body are solved with a piece: the whole body, or its only partition.
fn has_networks(groups: &[Group], piece: &Piece) -> bool {
    let is_cut = groups.len() > 2;
    piece.partition.is_none() == is_cut
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
