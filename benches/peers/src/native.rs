//! Peers in C++: the seven functions of `native/peer.h`, as a [`Run`].
//!
//! The only module with `unsafe`. It is sound because a world is created by `create`, used only
//! with the functions of the same peer and from one thread, and dropped once; because the arrays of
//! the scene outlive `create`, and no peer keeps them; and because `positions` writes three floats
//! for each of the particles counted by `particles` immediately before.

#![allow(unsafe_code, reason = "calls into C++; see the module's documentation")]

use crate::{
    peer::{Counts, PeerError, Report, Run},
    scenes::{GRAVITY, RATE, SOFTNESS, SUBSTEPS, Scene},
};
use glam::Vec3;
use std::{
    ffi::{CStr, c_char, c_void},
    ptr::NonNull,
};

/// `PeerScene` of `peer.h`.
#[repr(C)]
pub struct PeerScene {
    positions: *const f32,
    inverse_masses: *const f32,
    edges: *const u32,
    tetrahedra: *const u32,
    triangles: *const u32,
    offsets: *const f32,
    particle_count: u32,
    edge_count: u32,
    tetrahedron_count: u32,
    triangle_count: u32,
    body_count: u32,
    substeps: u32,
    threads: u32,
    edge_compliance: f32,
    edge_softness: f32,
    gravity: f32,
}

/// `PeerCounts` of `peer.h`.
#[repr(C)]
pub struct PeerCounts {
    edges: u64,
    tetrahedra: u64,
}

/// The functions of one peer.
#[derive(Clone, Copy)]
pub struct Functions {
    version: unsafe extern "C" fn() -> *const c_char,
    create: unsafe extern "C" fn(*const PeerScene) -> *mut c_void,
    destroy: unsafe extern "C" fn(*mut c_void),
    tick: unsafe extern "C" fn(*mut c_void, f32),
    counts: unsafe extern "C" fn(*const c_void) -> PeerCounts,
    positions: unsafe extern "C" fn(*const c_void, *mut f32),
    particles: unsafe extern "C" fn(*const c_void) -> u32,
}

macro_rules! functions {
    ($(#[$attribute:meta])* $table:ident: $version:ident, $create:ident, $destroy:ident, $tick:ident, $counts:ident, $positions:ident, $particles:ident) => {
        $(#[$attribute])*
        pub static $table: Functions = {
            unsafe extern "C" {
                fn $version() -> *const c_char;
                fn $create(scene: *const PeerScene) -> *mut c_void;
                fn $destroy(world: *mut c_void);
                fn $tick(world: *mut c_void, seconds: f32);
                fn $counts(world: *const c_void) -> PeerCounts;
                fn $positions(world: *const c_void, positions: *mut f32);
                fn $particles(world: *const c_void) -> u32;
            }
            Functions {
                version: $version,
                create: $create,
                destroy: $destroy,
                tick: $tick,
                counts: $counts,
                positions: $positions,
                particles: $particles,
            }
        };
    };
}

functions!(
    /// Jolt's.
    #[cfg(jolt)]
    JOLT: jolt_version, jolt_create, jolt_destroy, jolt_tick, jolt_counts, jolt_positions, jolt_particles
);
functions!(
    /// Bullet's.
    #[cfg(bullet)]
    BULLET: bullet_version, bullet_create, bullet_destroy, bullet_tick, bullet_counts, bullet_positions, bullet_particles
);

impl Functions {
    /// Version, as reported by the peer.
    #[must_use]
    pub fn version(&self) -> String {
        // SAFETY: a static string that ends in zero.
        let text = unsafe { CStr::from_ptr((self.version)()) };
        text.to_string_lossy().into_owned()
    }

    /// Builds a scene.
    ///
    /// # Errors
    /// [`PeerError::Scene`] if the peer cannot build it.
    pub fn build(&'static self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError> {
        let shape = &scene.shape;
        let positions = flat(&shape.vertices);
        let offsets = flat(&scene.offsets);
        let description = PeerScene {
            positions: positions.as_ptr(),
            inverse_masses: scene.inverse_masses.as_ptr(),
            edges: shape.edges.as_ptr().cast(),
            tetrahedra: shape.tetrahedra.as_ptr().cast(),
            triangles: shape.triangles.as_ptr().cast(),
            offsets: offsets.as_ptr(),
            particle_count: shape.vertices.len() as u32,
            edge_count: shape.edges.len() as u32,
            tetrahedron_count: shape.tetrahedra.len() as u32,
            triangle_count: shape.triangles.len() as u32,
            body_count: scene.offsets.len() as u32,
            substeps: SUBSTEPS,
            threads: threads as u32,
            edge_compliance: scene.edge_compliance,
            edge_softness: SOFTNESS,
            gravity: GRAVITY,
        };
        // SAFETY: all arrays have the lengths of their counts and outlive this call.
        let world = unsafe { (self.create)(&raw const description) };
        let world = NonNull::new(world).ok_or_else(|| PeerError::Scene {
            scene: scene.name,
            reason: "it made no world".into(),
        })?;
        let functions = self;
        Ok(Box::new(Native { functions, world }))
    }
}

fn flat(points: &[Vec3]) -> Vec<f32> {
    points.iter().flat_map(|point| point.to_array()).collect()
}

struct Native {
    functions: &'static Functions,
    world: NonNull<c_void>,
}

impl Run for Native {
    fn tick(&mut self) -> Result<(), PeerError> {
        // SAFETY: the world is alive, and `&mut` makes the access exclusive.
        unsafe { (self.functions.tick)(self.world.as_ptr(), 1.0 / RATE) };
        Ok(())
    }

    fn report(&mut self) -> Result<Report, PeerError> {
        let world = self.world.as_ptr();
        // SAFETY: the world is alive.
        let (counts, particles) = unsafe {
            (
                (self.functions.counts)(world),
                (self.functions.particles)(world),
            )
        };
        let mut positions = vec![0.0_f32; 3 * particles as usize];
        // SAFETY: the buffer holds three floats per particle.
        unsafe { (self.functions.positions)(world, positions.as_mut_ptr()) };
        let positions = positions.chunks_exact(3).map(Vec3::from_slice).collect();
        Ok(Report {
            counts: Counts {
                edges: counts.edges,
                tetrahedra: counts.tetrahedra,
                per_tetrahedron: 1,
            },
            positions,
        })
    }
}

impl Drop for Native {
    fn drop(&mut self) {
        // SAFETY: created by `create` of the same peer, and not used afterwards.
        unsafe { (self.functions.destroy)(self.world.as_ptr()) };
    }
}
