//! A body that several threads work on, each on a piece of its own.

#![allow(
    unsafe_code,
    clippy::mut_from_ref,
    reason = "threads get pieces of one borrow that share no element"
)]

use super::{scope::Column, stepper::Stepper};
use crate::{
    ElasticKind, Factors, effects::body_kinds::SharedStates, particles::Part, partitions::Piece,
};
use glam::Vec4;
use std::{
    marker::PhantomData,
    ops::Range,
    slice,
    sync::atomic::{AtomicBool, Ordering},
};

/// The parts of a [`Stepper`] that change, for threads to take pieces of.
pub(crate) struct SharedBody<'a> {
    positions: *mut Vec4,
    displacements: *mut Vec4,
    carry: *mut Vec4,
    particles: usize,
    multipliers: [Column<f32>; ElasticKind::COUNT],
    sums: Column<Vec4>,
    /// What effects without elements keep.
    pub states: SharedStates,
    factors: *mut Factors,
    touched: AtomicBool,
    lives: PhantomData<&'a mut ()>,
}

// SAFETY: it only hands out what `SharedBody::part`'s callers promise to be theirs alone.
unsafe impl Sync for SharedBody<'_> {}

impl<'a> SharedBody<'a> {
    /// Borrows the body for as long as it is shared.
    pub fn new(body: &'a mut Stepper) -> Self {
        let particles = &mut *body.particles;
        let count = particles.positions.len();
        assert!(
            particles.displacements.len() == count && particles.carry.len() == count,
            "particles have columns of different lengths"
        );
        Self {
            positions: particles.positions.as_mut_ptr(),
            displacements: particles.displacements.as_mut_ptr(),
            carry: particles.carry.as_mut_ptr(),
            particles: count,
            sums: Column::of(body.states.sums()),
            multipliers: body
                .states
                .columns()
                .each_mut()
                .map(|column| Column::of(column)),
            states: SharedStates::of(&mut body.states.others, body.stitches),
            factors: &raw mut *body.factors,
            touched: AtomicBool::new(false),
            lives: PhantomData,
        }
    }

    /// The particles of a piece.
    ///
    /// # Panics
    /// If the body has fewer particles.
    ///
    /// # Safety
    /// As long as the part lives, nobody else asks for a piece that shares a particle with it.
    pub unsafe fn part(&self, piece: &Piece) -> Part<'_> {
        let Range { start, end } = piece.particles;
        assert!(
            start <= end && end <= self.particles,
            "a piece of {start}..{end} is cut from {} particles",
            self.particles
        );
        let count = end - start;
        // SAFETY: in bounds by the assertion; theirs alone by the caller's promise.
        unsafe {
            Part {
                positions: slice::from_raw_parts_mut(self.positions.add(start), count),
                displacements: slice::from_raw_parts_mut(self.displacements.add(start), count),
                carry: slice::from_raw_parts_mut(self.carry.add(start), count),
            }
        }
    }

    /// Some multipliers of an effect; empty if they are not kept.
    ///
    /// # Safety
    /// As long as they live, nobody else asks for the same ones.
    pub unsafe fn multipliers(&self, kind: ElasticKind, range: Range<usize>) -> &mut [f32] {
        // SAFETY: the caller's promise.
        unsafe { self.multipliers[kind as usize].part(range) }
    }

    /// All multipliers, effect by effect; empty where they are not kept.
    ///
    /// # Safety
    /// As long as they live, nobody else asks for any.
    pub unsafe fn all_multipliers(&self) -> [&mut [f32]; ElasticKind::COUNT] {
        // SAFETY: the caller's promise.
        self.multipliers
            .each_ref()
            .map(|column| unsafe { column.part(0..column.len()) })
    }

    /// A contact was made, or not.
    pub fn touch(&self, touched: bool) {
        if touched {
            self.touched.store(true, Ordering::Relaxed);
        }
    }

    /// Whether any was, once all threads are done.
    pub fn touched(&self) -> bool {
        self.touched.load(Ordering::Relaxed)
    }

    /// Room to add up ways of the particles of a piece.
    ///
    /// # Panics
    /// If none has been made.
    ///
    /// # Safety
    /// As of [`part`](Self::part).
    pub unsafe fn sums(&self, piece: &Piece) -> &mut [Vec4] {
        let Range { start, end } = piece.particles;
        assert!(
            start <= end && end <= self.sums.len(),
            "sums of {start}..{end} of {}",
            self.sums.len()
        );
        // SAFETY: the caller's promise.
        unsafe { self.sums.part(start..end) }
    }

    /// What it is solved with directly.
    ///
    /// # Safety
    /// As long as it lives, nobody else asks for it.
    pub unsafe fn factors(&self) -> &mut Factors {
        // SAFETY: borrowed by `new`; theirs alone by the caller's promise.
        unsafe { &mut *self.factors }
    }
}
