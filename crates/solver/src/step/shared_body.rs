//! A body that several threads work on, each on a piece of its own.

#![allow(
    unsafe_code,
    clippy::mut_from_ref,
    reason = "threads get pieces of one borrow that share no element"
)]

use crate::{
    ContactMultiplier, ElasticKind, Factors, Stitches, TetherTargets,
    effects::{grab::Grab, pressure::PressureState, shape_matching::ShapeMatchingState},
    particles::Part,
    partitions::Piece,
    step::stepper::Stepper,
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
    lambdas: [Column<f32>; ElasticKind::COUNT],
    sums: (*mut Vec4, usize),
    /// Multipliers of contact with the ground and with colliders.
    rigid: [Column<ContactMultiplier>; 2],
    grab: *mut Option<Grab>,
    pressure_state: *mut PressureState,
    matching: *mut Option<Box<ShapeMatchingState>>,
    factors: *mut Factors,
    /// The tethers; read only.
    pub tether_targets: &'a TetherTargets,
    touched: AtomicBool,
    stitches: *mut Stitches,
    lives: PhantomData<&'a mut ()>,
}

/// Multipliers of one effect.
struct Column<T> {
    start: *mut T,
    len: usize,
}

// SAFETY: it only hands out what `SharedBody::piece`'s callers promise to be theirs alone.
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
            sums: {
                let sums = body.lambdas.sums();
                (sums.as_mut_ptr(), sums.len())
            },
            rigid: {
                let rigid = &mut body.lambdas.rigid;
                [&mut rigid.ground, &mut rigid.colliders].map(Column::of)
            },
            lambdas: body.lambdas.columns().each_mut().map(Column::of),
            grab: &raw mut body.effects.grab,
            pressure_state: &raw mut body.lambdas.pressure_state,
            matching: &raw mut body.lambdas.matching,
            factors: &raw mut *body.factors,
            tether_targets: &*body.tether_targets,
            touched: AtomicBool::new(false),
            stitches: &raw mut *body.stitches,
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
    pub unsafe fn lambdas(&self, kind: ElasticKind, range: Range<usize>) -> &mut [f32] {
        // SAFETY: the caller's promise.
        unsafe { self.lambdas[kind as usize].part(range) }
    }

    /// All multipliers, effect by effect; empty where they are not kept.
    ///
    /// # Safety
    /// As long as they live, nobody else asks for any.
    pub unsafe fn all_lambdas(&self) -> [&mut [f32]; ElasticKind::COUNT] {
        // SAFETY: the caller's promise.
        self.lambdas
            .each_ref()
            .map(|column| unsafe { column.part(0..column.len) })
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
        let (first, count) = self.sums;
        assert!(
            start <= end && end <= count,
            "sums of {start}..{end} of {count}"
        );
        // SAFETY: in bounds by the assertion; theirs alone by the caller's promise.
        unsafe { slice::from_raw_parts_mut(first.add(start), end - start) }
    }

    /// Multipliers of contact of the particles of a piece with the ground; empty if they are not kept.
    ///
    /// # Safety
    /// As of [`part`](Self::part).
    pub unsafe fn ground(&self, piece: &Piece) -> &mut [ContactMultiplier] {
        // SAFETY: the caller's promise.
        unsafe { self.rigid[0].part(piece.particles.clone()) }
    }

    /// The same with colliders.
    ///
    /// # Safety
    /// As of [`part`](Self::part).
    pub unsafe fn colliders(&self, piece: &Piece) -> &mut [ContactMultiplier] {
        // SAFETY: the caller's promise.
        unsafe { self.rigid[1].part(piece.particles.clone()) }
    }

    /// The hold of a hand.
    ///
    /// # Safety
    /// As long as it lives, nobody else asks for it.
    pub unsafe fn grab(&self) -> &mut Option<Grab> {
        // SAFETY: borrowed by `new`; theirs alone by the caller's promise.
        unsafe { &mut *self.grab }
    }

    /// What pressure keeps.
    ///
    /// # Safety
    /// As long as it lives, nobody else asks for it.
    pub unsafe fn pressure_state(&self) -> &mut PressureState {
        // SAFETY: borrowed by `new`; theirs alone by the caller's promise.
        unsafe { &mut *self.pressure_state }
    }

    /// The stitches.
    ///
    /// # Safety
    /// As long as they live, nobody else asks for them.
    pub unsafe fn stitches(&self) -> &mut Stitches {
        // SAFETY: borrowed by `new`; theirs alone by the caller's promise.
        unsafe { &mut *self.stitches }
    }

    /// The regions whose shapes are matched.
    ///
    /// # Safety
    /// As long as it lives, nobody else asks for it.
    pub unsafe fn matching(&self) -> Option<&mut ShapeMatchingState> {
        // SAFETY: borrowed by `new`; theirs alone by the caller's promise.
        unsafe { (*self.matching).as_deref_mut() }
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

impl<T> Column<T> {
    fn of(multipliers: &mut Vec<T>) -> Self {
        Self {
            start: multipliers.as_mut_ptr(),
            len: multipliers.len(),
        }
    }

    /// # Safety
    /// As long as the part lives, nobody else asks for one that overlaps it.
    unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        if range.start > range.end || range.end > self.len {
            return &mut [];
        }
        // SAFETY: in bounds; theirs alone by the caller's promise.
        unsafe { slice::from_raw_parts_mut(self.start.add(range.start), range.len()) }
    }
}
