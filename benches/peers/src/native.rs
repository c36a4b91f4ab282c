//! Peers in C++: the seven functions of `native/peer.h`, as a [`Run`].
//!
//! The only module with `unsafe`. It is sound because a world is created by `create`, used only
//! with the functions of the same peer and from one thread, and dropped once; because the arrays of
//! the scene outlive `create`, and no peer keeps them; and because `positions` writes three floats
//! for each of the particles counted by `particles` immediately before, as many as `place` reads.

#![allow(unsafe_code, reason = "calls into C++; see the module's documentation")]

use crate::{
    peer::{Counts, PeerError, Report, Run},
    scenes::{GRAVITY, RATE, SOFTNESS, SUBSTEPS, Scene},
};
use glam::Vec3;
use pliant::solver::RestShape;
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
    volume_compliances: *const f32,
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
    hinges: *const u32,
    hinge_count: u32,
    hinge_compliance: f32,
    pressure: f32,
    linear_damping: f32,
    gravity_factor: f32,
}

/// Copies of a body, and how they are stepped.
pub struct Bodies<'a> {
    /// The mesh of one body.
    pub shape: &'a RestShape,
    /// Inverse mass of each particle [1/kg]; 0 for pins.
    pub inverse_masses: &'a [f32],
    /// Offset of each copy [m].
    pub offsets: &'a [Vec3],
    /// Compliance of each edge [m/N].
    pub edge_compliance: f32,
    /// Compliance of each tetrahedron [m⁵/N]; `None` if all are rigid.
    pub volume_compliances: Option<&'a [f32]>,
    /// Substeps of a tick.
    pub substeps: u32,
    /// Number of threads.
    pub threads: usize,
    /// What Jolt has besides.
    pub extras: Extras<'a>,
}

/// Parameters of Jolt, in its units. Bullet also has the damping.
#[derive(Debug, Clone, Copy)]
pub struct Extras<'a> {
    /// Vertices of the hinges, the two of the edge first.
    pub hinges: &'a [[u32; 4]],
    /// `DihedralBend::mCompliance` [1/(N·m)].
    pub hinge_compliance: f32,
    /// `mPressure` [J].
    pub pressure: f32,
    /// `mLinearDamping` [1/s].
    pub linear_damping: f32,
    /// `mGravityFactor`.
    pub gravity_factor: f32,
}

impl Default for Extras<'_> {
    fn default() -> Self {
        Self {
            hinges: &[],
            hinge_compliance: 0.0,
            pressure: 0.0,
            linear_damping: 0.0,
            gravity_factor: 1.0,
        }
    }
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
    /// Moves the particles, in peers that are compared at rest.
    #[cfg_attr(not(jolt), allow(dead_code, reason = "only Jolt is compared at rest"))]
    place: Option<unsafe extern "C" fn(*mut c_void, *const f32)>,
}

macro_rules! functions {
    ($(#[$attribute:meta])* $table:ident: $version:ident, $create:ident, $destroy:ident, $tick:ident, $counts:ident, $positions:ident, $particles:ident $(, $place:ident)?) => {
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
                $(fn $place(world: *mut c_void, positions: *const f32);)?
            }
            let place = functions!(@optional $($place)?);
            Functions {
                version: $version,
                create: $create,
                destroy: $destroy,
                tick: $tick,
                counts: $counts,
                positions: $positions,
                particles: $particles,
                place,
            }
        };
    };
    (@optional) => { None };
    (@optional $place:ident) => { Some($place as unsafe extern "C" fn(*mut c_void, *const f32)) };
}

functions!(
    /// Jolt's.
    #[cfg(jolt)]
    JOLT: jolt_version, jolt_create, jolt_destroy, jolt_tick, jolt_counts, jolt_positions, jolt_particles, jolt_place
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
        let bodies = Bodies {
            shape: &scene.shape,
            inverse_masses: &scene.inverse_masses,
            offsets: &scene.offsets,
            edge_compliance: scene.edge_compliance,
            volume_compliances: None,
            substeps: SUBSTEPS,
            threads,
            extras: Extras::default(),
        };
        Ok(Box::new(self.create(scene.name, &bodies)?))
    }

    /// Builds bodies.
    ///
    /// # Errors
    /// [`PeerError::Scene`] with the name of the scene if the peer cannot build them.
    ///
    /// # Panics
    /// If there is not one mass per particle, or not one compliance per tetrahedron.
    pub fn create(
        &'static self,
        scene: &'static str,
        bodies: &Bodies,
    ) -> Result<Native, PeerError> {
        let shape = bodies.shape;
        assert_eq!(bodies.inverse_masses.len(), shape.vertices.len());
        if let Some(volumes) = bodies.volume_compliances {
            assert_eq!(volumes.len(), shape.tetrahedra.len());
        }
        let positions = flat(&shape.vertices);
        let offsets = flat(bodies.offsets);
        let description = PeerScene {
            positions: positions.as_ptr(),
            inverse_masses: bodies.inverse_masses.as_ptr(),
            edges: shape.edges.as_ptr().cast(),
            tetrahedra: shape.tetrahedra.as_ptr().cast(),
            triangles: shape.triangles.as_ptr().cast(),
            offsets: offsets.as_ptr(),
            volume_compliances: bodies
                .volume_compliances
                .map_or(std::ptr::null(), <[f32]>::as_ptr),
            particle_count: shape.vertices.len() as u32,
            edge_count: shape.edges.len() as u32,
            tetrahedron_count: shape.tetrahedra.len() as u32,
            triangle_count: shape.triangles.len() as u32,
            body_count: bodies.offsets.len() as u32,
            substeps: bodies.substeps,
            threads: bodies.threads as u32,
            edge_compliance: bodies.edge_compliance,
            edge_softness: SOFTNESS,
            gravity: GRAVITY,
            hinges: bodies.extras.hinges.as_ptr().cast(),
            hinge_count: bodies.extras.hinges.len() as u32,
            hinge_compliance: bodies.extras.hinge_compliance,
            pressure: bodies.extras.pressure,
            linear_damping: bodies.extras.linear_damping,
            gravity_factor: bodies.extras.gravity_factor,
        };
        // SAFETY: all arrays have the lengths of their counts and outlive this call.
        let world = unsafe { (self.create)(&raw const description) };
        let world = NonNull::new(world).ok_or_else(|| PeerError::Scene {
            scene,
            reason: "it made no world".into(),
        })?;
        let functions = self;
        Ok(Native { functions, world })
    }
}

fn flat(points: &[Vec3]) -> Vec<f32> {
    points.iter().flat_map(|point| point.to_array()).collect()
}

/// Bodies in a peer.
pub struct Native {
    functions: &'static Functions,
    world: NonNull<c_void>,
}

impl Native {
    /// Steps 1/60 s.
    pub fn step(&mut self) {
        // SAFETY: the world is alive, and `&mut` makes the access exclusive.
        unsafe { (self.functions.tick)(self.world.as_ptr(), 1.0 / RATE) };
    }

    /// Moves the movable particles to positions [m], body by body, without velocity.
    ///
    /// # Panics
    /// If there is not one position per particle, or if the peer is not compared at rest.
    #[cfg(jolt)]
    pub fn place(&mut self, positions: &[Vec3]) {
        let world = self.world.as_ptr();
        // SAFETY: the world is alive.
        let particles = unsafe { (self.functions.particles)(world) };
        assert_eq!(positions.len(), particles as usize);
        let place = self.functions.place.expect("the peer is compared at rest");
        let positions = flat(positions);
        // SAFETY: the world is alive, access is exclusive, and there are three floats per particle.
        unsafe { place(world, positions.as_ptr()) };
    }

    /// Current constraints and positions.
    #[must_use]
    pub fn state(&self) -> Report {
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
        Report {
            counts: Counts {
                edges: counts.edges,
                tetrahedra: counts.tetrahedra,
                per_tetrahedron: 1,
            },
            positions,
        }
    }
}

impl Run for Native {
    fn tick(&mut self) -> Result<(), PeerError> {
        self.step();
        Ok(())
    }

    fn report(&mut self) -> Result<Report, PeerError> {
        Ok(self.state())
    }
}

impl Drop for Native {
    fn drop(&mut self) {
        // SAFETY: created by `create` of the same peer, and not used afterwards.
        unsafe { (self.functions.destroy)(self.world.as_ptr()) };
    }
}
