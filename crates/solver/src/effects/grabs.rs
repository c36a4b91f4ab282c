//! Several grabs of a body at once, of an app: for touch, for hands with fingers.

use super::grab::{Glide, Grab, GrabState, Hold};
use crate::{SurfacePoint, Topology, kernel::each::Singles};
use glam::Vec4;
use serde::{Deserialize, Serialize};

/// Springs from points or patches of a body to targets, each a [`Grab`]. A target is reached at the end
/// of the next tick, evenly over its substeps.
///
/// A body that is grabbed does not sleep. Grabs of points that the body does not have, and with targets that
/// are not finite, do nothing.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{Grab, Grabs, ParticleIndex, SurfacePoint};
///
/// // Both ends of a rope of 0.1 kg and 1 m, under 9.81 m/s².
/// let ends = [0, 10].map(|i| SurfacePoint::new(&[(ParticleIndex(i), 1.0)]).expect("a point"));
/// let mut grabs = Grabs::new(ends.map(|end| Grab::on(end, Vec3::ZERO, 0.1, 1.0, 9.81)));
/// grabs.iter_mut().for_each(|grab| grab.target += Vec3::Y * 0.01); // m
/// assert_eq!(grabs.iter().count(), 2);
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<StoredGrab>", into = "Vec<StoredGrab>")]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct Grabs(Vec<(Grab, GrabState)>);

/// A grab with what its own form leaves out.
#[derive(Serialize, Deserialize)]
struct StoredGrab(Grab, Hold, Glide);

impl From<Vec<StoredGrab>> for Grabs {
    fn from(stored: Vec<StoredGrab>) -> Self {
        Self::new(
            stored
                .into_iter()
                .map(|StoredGrab(grab, hold, glide)| Grab {
                    hold,
                    glide,
                    ..grab
                }),
        )
    }
}

impl From<Grabs> for Vec<StoredGrab> {
    fn from(grabs: Grabs) -> Self {
        let all = grabs.0.into_iter();
        all.map(|(grab, _)| StoredGrab(grab, grab.hold, grab.glide))
            .collect()
    }
}

impl Grabs {
    /// These grabs.
    pub fn new(grabs: impl IntoIterator<Item = Grab>) -> Self {
        let all = grabs.into_iter().map(|grab| (grab, GrabState::default()));
        Self(all.collect())
    }

    /// Adds a grab, and returns its place in the order of [`iter_mut`](Self::iter_mut).
    pub fn add(&mut self, grab: Grab) -> usize {
        self.0.push((grab, GrabState::default()));
        self.0.len() - 1
    }

    /// Removes the grab at a place, unless there is none; later ones follow it.
    pub fn remove(&mut self, place: usize) {
        if place < self.0.len() {
            self.0.remove(place);
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The grabs.
    pub fn iter(&self) -> impl Iterator<Item = &Grab> {
        self.0.iter().map(|(grab, _)| grab)
    }

    /// The grabs, to move their [targets](Grab::target).
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Grab> {
        self.0.iter_mut().map(|(grab, _)| grab)
    }

    /// Force of each spring in the last substep of `h` seconds [N].
    pub fn forces(&self, h: f32) -> impl Iterator<Item = f32> {
        self.0.iter().map(move |(_, state)| state.force(h))
    }

    /// Begins or continues a tick of a body with these positions [m] and inverse masses [1/kg].
    pub(crate) fn prepare(&mut self, topology: &Topology, positions: &[Vec4]) {
        for (grab, state) in &mut self.0 {
            if is_sound(grab, positions.len()) {
                grab.begin(state, topology, positions);
            }
        }
    }

    /// Pulls the particles of a body in an iteration of a substep of `h` seconds, with the numbers of the
    /// substep, of the substeps and of the iteration.
    pub(crate) fn pull(
        &mut self,
        particles: usize,
        singles: &mut (impl Singles + ?Sized),
        h: f32,
        at: ((u32, u32), u32),
    ) {
        for (grab, state) in &mut self.0 {
            if is_sound(grab, particles) {
                grab.pull(state, singles, h, at);
            }
        }
    }

    /// Ends a tick of `tick` seconds, of which a fraction was computed.
    pub(crate) fn end_tick(&mut self, fraction: Option<f32>, tick: f32) {
        for (grab, _) in &mut self.0 {
            grab.end_tick(fraction, tick);
        }
    }

    /// Moves the points to the particles of a body that was torn or renewed; grabs of those that are
    /// gone are removed.
    pub(crate) fn follow(&mut self, now: impl Fn(&SurfacePoint) -> Option<SurfacePoint>) {
        self.0.retain_mut(|(grab, _)| {
            let moved = now(&grab.point);
            moved.inspect(|moved| grab.point = *moved).is_some()
        });
    }

    /// Heap memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.0[..]) + self.0.iter().map(|(_, state)| state.bytes()).sum::<usize>()
    }
}

/// Whether a grab is one of a body with this number of particles.
pub(crate) fn is_sound(grab: &Grab, particles: usize) -> bool {
    grab.point.fits(particles) && grab.target.is_finite()
}
