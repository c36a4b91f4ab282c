//! A body on which several threads work, each on its own piece.

#![allow(
    unsafe_code,
    clippy::mut_from_ref,
    reason = "threads get pieces of one borrow that share no element"
)]

use super::stepper::Stepper;
use crate::{
    ElasticKind, Grabs, Instructions, SegmentState,
    colliders::inside::WayOut,
    direct::DirectWorkspace,
    effects::{body_kinds::SharedStates, controls::ByParticle},
    kernel::{
        columns::Line,
        moments::{Moments, Turn},
        strips::{BEFORE, CARRIES, PARTICLES, StripRows},
    },
    layout::strips::Strips,
    parallel::scope::Column,
    particles::{Part, surface_force::Pushes},
    partitions::{Partitions, Piece},
};
use glam::{Vec3, Vec4};
use std::{
    marker::PhantomData,
    ops::Range,
    slice,
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
};

/// The mutable parts of a [`Stepper`], for access by piece from threads.
pub(crate) struct SharedBody<'a> {
    positions: *mut Vec4,
    displacements: *mut Vec4,
    carry: *mut Vec4,
    particles: usize,
    segments: Column<SegmentState>,
    spins: Column<Vec4>,
    pushes: Column<Pushes>,
    multipliers: [Column<f32>; ElasticKind::COUNT],
    sums: Column<Vec4>,
    /// States of effects without elements.
    pub states: SharedStates,
    direct: *mut DirectWorkspace,
    loads: *mut Vec<Vec4>,
    sides: *const [WayOut],
    controls: *const ByParticle,
    grabs: Option<*mut Grabs>,
    /// Displacements before internal constraints, and what these have done to the even pieces.
    before: Column<Vec4>,
    moments: Column<Moments>,
    turn: *mut Turn,
    /// The parts of the body that are turned back, if there are several.
    parts: Column<u32>,
    /// The point about which they are summed up.
    pub origin: Vec3,
    strips: Option<SharedStrips>,
    touched: AtomicBool,
    /// The bits of [`Found::longest`](crate::effects::states::Found::longest): of numbers that are not
    /// negative, they have the same order.
    longest: Option<AtomicU32>,
    lives: PhantomData<&'a mut ()>,
}

/// The rows of a body that is stepped in strips.
struct SharedStrips {
    strips: Strips,
    particles: Column<Line>,
    carry: Column<Line>,
    before: Column<Line>,
    loaded: Column<bool>,
}

// SAFETY: it only gives out references that the callers of `SharedBody::part` promise to be
// exclusive.
unsafe impl Sync for SharedBody<'_> {}

impl<'a> SharedBody<'a> {
    /// Borrows the body while it is shared; `in_strips` if its workspace has room for its rows.
    pub fn new(body: &'a mut Stepper, in_strips: bool) -> Self {
        let strips = body.topology.partitions.strips().filter(|_| in_strips);
        let strips = strips.map(|strips| {
            let columns = &mut body.states.workspace.columns().strips;
            SharedStrips {
                strips,
                particles: Column::of(&mut columns.particles),
                carry: Column::of(&mut columns.carry),
                before: Column::of(&mut columns.before),
                loaded: Column::of(&mut columns.loaded),
            }
        });
        let particles = &mut *body.particles;
        let count = particles.positions.len();
        assert!(
            particles.displacements.len() == count && particles.carry.len() == count,
            "particles have columns of different lengths"
        );
        let sums = Column::of(body.states.sums());
        let multipliers = body.states.columns();
        let multipliers = multipliers.each_mut().map(|column| Column::of(column));
        let pushes = Column::of(body.states.recorded.pushes());
        let scratch = body.states.scratch.found();
        let loads = &raw mut scratch.loads;
        let sides = &raw const scratch.sides[..];
        let controls = &raw const scratch.controls;
        let given = body.controls.as_deref_mut();
        let grabs = given.and_then(|it| it.grabs.as_mut());
        let longest = scratch.longest.map(|it| AtomicU32::new(it.to_bits()));
        let spin = &mut scratch.spin;
        Self {
            positions: particles.positions.as_mut_ptr(),
            displacements: particles.displacements.as_mut_ptr(),
            carry: particles.carry.as_mut_ptr(),
            particles: count,
            segments: Column::of(&mut particles.segments),
            spins: Column::of(&mut particles.spins),
            pushes,
            sums,
            multipliers,
            states: SharedStates::of(&mut body.states.others, body.stitches),
            direct: &raw mut *body.direct,
            loads,
            sides,
            controls,
            grabs: grabs.map(|grabs| &raw mut *grabs),
            before: Column::of(&mut spin.before),
            moments: Column::of(&mut spin.sums),
            turn: &raw mut spin.turn,
            parts: Column::of(&mut spin.parts),
            origin: spin.origin,
            strips,
            touched: AtomicBool::new(false),
            longest,
            lives: PhantomData,
        }
    }

    /// The particles of a piece.
    ///
    /// # Panics
    /// If the body has fewer particles.
    ///
    /// # Safety
    /// During the lifetime of the part, no other piece that shares a particle with it is requested.
    pub unsafe fn part(&self, piece: &Piece) -> Part<'_> {
        let Range { start, end } = piece.particles;
        assert!(
            start <= end && end <= self.particles,
            "a piece of {start}..{end} is cut from {} particles",
            self.particles
        );
        let count = end - start;
        // SAFETY: in bounds by the assertion; exclusive by the caller's promise, segments because
        // the chains of pieces that share no particle share none either.
        unsafe {
            let segments = self.states.segments(piece);
            Part {
                positions: slice::from_raw_parts_mut(self.positions.add(start), count),
                displacements: slice::from_raw_parts_mut(self.displacements.add(start), count),
                carry: slice::from_raw_parts_mut(self.carry.add(start), count),
                segments: self.segments.part(segments),
                spins: self.spins.part(start..end),
                pushes: self.pushes.part(start..end),
            }
        }
    }

    /// The rows of a piece of a body in strips, and for each of its partitions whether its particles
    /// are there.
    ///
    /// # Safety
    /// As for [`part`](Self::part).
    pub unsafe fn rows(&self, piece: &Piece) -> Option<(StripRows<'_>, &mut [bool])> {
        let shared = self.strips.as_ref()?;
        let Range { start, end } = shared.strips.rows(&piece.particles);
        // SAFETY: the caller's promise, as partitions begin with a row.
        let (lines, loaded) = unsafe {
            (
                [
                    shared.particles.part(start * PARTICLES..end * PARTICLES),
                    shared.carry.part(start * CARRIES..end * CARRIES),
                    shared.before.part(start * BEFORE..end * BEFORE),
                ],
                shared.loaded.part(piece.partitions.clone()),
            )
        };
        let rows = StripRows::new(shared.strips, (start, piece.particles.start), lines);
        Some((rows, loaded))
    }

    /// Gives the particles the numbers of all rows that they are in, after an error: displacements, and
    /// the rest if they have `moved` there.
    ///
    /// # Safety
    /// No part and no rows of the body are borrowed.
    pub unsafe fn store(&self, partitions: &Partitions, moved: bool, instructions: Instructions) {
        for number in 0..partitions.count() {
            let piece = partitions.alone(number);
            // SAFETY: the caller's promise.
            unsafe {
                if let Some((rows, [true])) = self.rows(&piece) {
                    let mut part = self.part(&piece);
                    rows.store(&mut part, moved, instructions);
                }
            }
        }
    }

    /// Some multipliers of an effect; empty if they are not stored.
    ///
    /// # Safety
    /// During the lifetime of the slice, the same ones are not requested again.
    pub unsafe fn multipliers(&self, kind: ElasticKind, range: Range<usize>) -> &mut [f32] {
        // SAFETY: the caller's promise.
        unsafe { self.multipliers[kind as usize].part(range) }
    }

    /// All multipliers, effect by effect; empty where they are not stored.
    ///
    /// # Safety
    /// During the lifetime of the slices, no multipliers are requested again.
    pub unsafe fn all_multipliers(&self) -> [&mut [f32]; ElasticKind::COUNT] {
        // SAFETY: the caller's promise.
        self.multipliers
            .each_ref()
            .map(|column| unsafe { column.part(0..column.len()) })
    }

    /// Records whether a contact was made.
    pub fn touch(&self, touched: bool) {
        if touched {
            self.touched.store(true, Ordering::Relaxed);
        }
    }

    /// Whether any contact was made, once all threads are done.
    pub fn touched(&self) -> bool {
        self.touched.load(Ordering::Relaxed)
    }

    /// Whether displacements are measured.
    pub fn is_measured(&self) -> bool {
        self.longest.is_some()
    }

    /// Records the largest component of a displacement on a piece [m].
    pub fn measure(&self, longest: f32) {
        if let Some(all) = &self.longest {
            all.fetch_max(longest.to_bits(), Ordering::Relaxed);
        }
    }

    /// The largest of all, once all threads are done; `None` unless it is measured.
    pub fn longest(&self) -> Option<f32> {
        let longest = self.longest.as_ref()?;
        Some(f32::from_bits(longest.load(Ordering::Relaxed)))
    }

    /// Sums of the displacements of the particles of a piece.
    ///
    /// # Panics
    /// If the sums have not been allocated.
    ///
    /// # Safety
    /// As for [`part`](Self::part).
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

    /// The displacements of the particles of a piece before internal constraints; empty unless they are
    /// kept.
    ///
    /// # Safety
    /// As for [`part`](Self::part).
    pub unsafe fn before(&self, piece: &Piece) -> &mut [Vec4] {
        // SAFETY: the caller's promise.
        unsafe { self.before.part(piece.particles.clone()) }
    }

    /// What internal constraints have done to an even piece; `None` unless it is summed up.
    ///
    /// # Safety
    /// As for [`part`](Self::part).
    pub unsafe fn moments(&self, piece: &Piece) -> Option<&mut Moments> {
        let place = piece.partitions.start / 2;
        // SAFETY: the caller's promise, as even pieces begin with even partitions.
        unsafe { self.moments.part(place..place + 1) }.first_mut()
    }

    /// What they have done to all even pieces, and the rotation that takes it back.
    ///
    /// # Safety
    /// No piece of the body is borrowed.
    pub unsafe fn turning(&self) -> (&[Moments], &mut Turn) {
        // SAFETY: borrowed by `new`; exclusive by the caller's promise.
        unsafe { (self.moments.part(0..self.moments.len()), &mut *self.turn) }
    }

    /// The parts of the body that are turned back, if there are several.
    ///
    /// # Safety
    /// No piece of the body is borrowed.
    pub unsafe fn parts(&self) -> &[u32] {
        // SAFETY: borrowed by `new`, and not written while it is shared.
        unsafe { self.parts.part(0..self.parts.len()) }
    }

    /// The rotation that takes it back.
    ///
    /// # Safety
    /// It is not being [found](Self::turning).
    pub unsafe fn turn(&self) -> Turn {
        // SAFETY: borrowed by `new`; not written by the caller's promise.
        unsafe { *self.turn }
    }

    /// The sides to which the body leaves the colliders that it is in.
    pub fn sides(&self) -> &[WayOut] {
        // SAFETY: borrowed by `new`, and not written while it is shared.
        unsafe { &*self.sides }
    }

    /// What an app does to the body, by its particles.
    pub fn controls(&self) -> &ByParticle {
        // SAFETY: borrowed by `new`, and not written while it is shared.
        unsafe { &*self.controls }
    }

    /// Grabs of an app.
    ///
    /// # Safety
    /// During the lifetime of the reference, they are not requested again.
    pub unsafe fn grabs(&self) -> Option<&mut Grabs> {
        // SAFETY: borrowed by `new`; not aliased by the caller's promise.
        self.grabs.map(|grabs| unsafe { &mut *grabs })
    }

    /// Memory for a force.
    ///
    /// # Safety
    /// During the lifetime of the reference, it is not requested again.
    pub unsafe fn loads(&self) -> &mut Vec<Vec4> {
        // SAFETY: borrowed by `new`; exclusive by the caller's promise.
        unsafe { &mut *self.loads }
    }

    /// Data of the direct solver.
    ///
    /// # Safety
    /// During the lifetime of the reference, it is not requested again.
    pub unsafe fn direct(&self) -> &mut DirectWorkspace {
        // SAFETY: borrowed by `new`; exclusive by the caller's promise.
        unsafe { &mut *self.direct }
    }
}
