//! Granularity of effects, a piece of a body or the whole, and access to their states from threads.

#![allow(
    unsafe_code,
    reason = "threads get pieces of one borrow that share no element"
)]

use crate::partitions::Piece;
use std::{ops::Range, slice};

/// Pieces on which a task runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Of either side.
    Any,
    /// Of the even partitions.
    Even,
    /// Of the odd partitions.
    Odd,
    /// The body in one piece.
    Whole,
}

impl Side {
    /// Common side of two tasks that can run together, if any.
    pub fn with(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Whole, _) | (_, Self::Whole) => None,
            (Self::Any, side) | (side, Self::Any) => Some(side),
            (a, b) => (a == b).then_some(a),
        }
    }
}

/// Granularity of an effect with the state `S`.
pub trait Scope<S> {
    /// The pieces on which it works, one side after the other. On a body in one partition only the
    /// first side has work.
    const SIDES: [Option<Side>; 3];

    /// The state while threads work on the body.
    type Shared;

    /// Part of the state that belongs to a piece.
    type Piece<'a>
    where
        S: 'a;

    /// Borrows the state while it is shared.
    fn share(state: &mut S) -> Self::Shared;

    /// Part of the state that belongs to a piece of the body.
    ///
    /// # Safety
    /// The state is still borrowed; during the lifetime of the part, no overlapping part is
    /// requested.
    unsafe fn piece<'a>(shared: &'a Self::Shared, piece: &Piece) -> Self::Piece<'a>
    where
        S: 'a;

    /// Begins a substep on the piece with these particles.
    ///
    /// # Safety
    /// As for [`piece`](Self::piece).
    unsafe fn begin(_: &Self::Shared, _: Range<usize>) {}
}

/// The effect works on the whole body at once.
pub enum WholeBody {}

impl<S> Scope<S> for WholeBody {
    const SIDES: [Option<Side>; 3] = [Some(Side::Whole), None, None];
    type Shared = *mut S;
    type Piece<'a>
        = &'a mut S
    where
        S: 'a;

    fn share(state: &mut S) -> *mut S {
        state
    }

    unsafe fn piece<'a>(shared: &'a *mut S, _: &Piece) -> &'a mut S
    where
        S: 'a,
    {
        // SAFETY: borrowed by `share`; not aliased by the caller's promise.
        unsafe { &mut **shared }
    }
}

/// The effect works on each particle by itself, and stores an item per particle during a substep;
/// the column is empty if it is not needed.
pub enum EachParticle {}

impl<T: Clone + Default> Scope<Vec<T>> for EachParticle {
    const SIDES: [Option<Side>; 3] = [Some(Side::Any), None, None];
    type Shared = Column<T>;
    type Piece<'a>
        = &'a mut [T]
    where
        T: 'a;

    fn share(state: &mut Vec<T>) -> Column<T> {
        Column::of(state)
    }

    unsafe fn piece<'a>(shared: &'a Column<T>, piece: &Piece) -> &'a mut [T]
    where
        T: 'a,
    {
        // SAFETY: the caller's promise.
        unsafe { shared.part(piece.particles.clone()) }
    }

    unsafe fn begin(shared: &Column<T>, particles: Range<usize>) {
        // SAFETY: the caller's promise.
        unsafe { shared.part(particles) }.fill(T::default());
    }
}

/// The effect works on each particle by itself, and only reads its state.
pub enum ReadOnly {}

impl<S> Scope<S> for ReadOnly {
    const SIDES: [Option<Side>; 3] = [Some(Side::Any), None, None];
    type Shared = *const S;
    type Piece<'a>
        = &'a S
    where
        S: 'a;

    fn share(state: &mut S) -> *const S {
        state
    }

    unsafe fn piece<'a>(shared: &'a *const S, _: &Piece) -> &'a S
    where
        S: 'a,
    {
        // SAFETY: borrowed by `share`, and not written while it is shared.
        unsafe { &**shared }
    }
}

/// A column of which threads take parts.
pub struct Column<T> {
    start: *mut T,
    len: usize,
}

impl<T> Column<T> {
    /// Borrows the column while it is shared.
    pub fn of(column: &mut [T]) -> Self {
        Self {
            start: column.as_mut_ptr(),
            len: column.len(),
        }
    }

    /// Length of the column.
    pub fn len(&self) -> usize {
        self.len
    }

    /// A part of the column; empty if the column is, as one that is not needed.
    ///
    /// # Panics
    /// If the column is shorter and not empty.
    ///
    /// # Safety
    /// The column is still borrowed; during the lifetime of the part, no overlapping part is
    /// requested.
    #[allow(clippy::mut_from_ref, reason = "the caller's promise")]
    pub unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        if self.len == 0 {
            return &mut [];
        }
        assert!(
            range.start <= range.end && range.end <= self.len,
            "{range:?} of a column of {}",
            self.len
        );
        // SAFETY: in bounds; not aliased by the caller's promise.
        unsafe { slice::from_raw_parts_mut(self.start.add(range.start), range.len()) }
    }
}
