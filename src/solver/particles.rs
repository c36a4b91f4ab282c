//! The state of a body: its particles. Everything else about a body only describes.

use super::History;
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Particles as columns of 16-byte elements.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Particles {
    /// Position in xyz [m], inverse mass in w [1/kg]; 0 is pinned.
    pub positions: Vec<Vec4>,
    /// Position at the start of the substep in xyz [m]; w is unused.
    pub previous: Vec<Vec4>,
    /// Velocity in xyz [m/s]; w is 0.
    pub velocities: Vec<Vec4>,
    /// What they were one substep ago, for [steps of second order](super::history).
    pub history: History,
}

impl Particles {
    /// Particles at rest at the given positions [m], with inverse masses of zero.
    #[must_use]
    pub fn at_rest(positions: impl Iterator<Item = Vec3>) -> Self {
        let positions: Vec<Vec4> = positions.map(|x| x.extend(0.0)).collect();
        Self {
            previous: positions.clone(),
            velocities: vec![Vec4::ZERO; positions.len()],
            positions,
            history: History::default(),
        }
    }

    /// All of them, to be stepped.
    #[must_use]
    pub fn as_part(&mut self) -> Part<'_> {
        Part {
            positions: &mut self.positions,
            previous: &mut self.previous,
            velocities: &mut self.velocities,
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Index of the first particle whose position or velocity is not finite.
    #[must_use]
    pub fn first_not_finite(&self) -> Option<usize> {
        first_not_finite(&self.positions)
            .into_iter()
            .chain(first_not_finite(&self.velocities))
            .min()
    }
}

/// Some particles of a body, next to each other.
#[derive(Debug)]
pub struct Part<'a> {
    /// As [`Particles::positions`].
    pub positions: &'a mut [Vec4],
    /// As [`Particles::previous`].
    pub previous: &'a mut [Vec4],
    /// As [`Particles::velocities`].
    pub velocities: &'a mut [Vec4],
}

impl<'a> Part<'a> {
    /// The first `count` particles, and the others.
    ///
    /// # Panics
    /// If there are fewer.
    #[must_use]
    pub fn split_at(self, count: usize) -> (Self, Self) {
        let (positions, more_positions) = self.positions.split_at_mut(count);
        let (previous, more_previous) = self.previous.split_at_mut(count);
        let (velocities, more_velocities) = self.velocities.split_at_mut(count);
        (
            Part {
                positions,
                previous,
                velocities,
            },
            Part {
                positions: more_positions,
                previous: more_previous,
                velocities: more_velocities,
            },
        )
    }

    /// The same for a shorter time.
    #[must_use]
    pub fn reborrow(&mut self) -> Part<'_> {
        Part {
            positions: self.positions,
            previous: self.previous,
            velocities: self.velocities,
        }
    }
}

/// Index of the first element that is not finite.
#[must_use]
pub fn first_not_finite(elements: &[Vec4]) -> Option<usize> {
    // A non-finite number times zero is NaN, and NaN stays: one sum tells for all. Four sums,
    // because one would wait for itself.
    let (fours, rest) = elements.as_chunks::<4>();
    let mut sums = [Vec4::ZERO; 4];
    for four in fours {
        for (sum, x) in sums.iter_mut().zip(four) {
            *sum += *x * 0.0;
        }
    }
    let sum = rest.iter().fold(Vec4::ZERO, |sum, x| sum + *x * 0.0);
    let all = sum + (sums[0] + sums[1]) + (sums[2] + sums[3]);
    if all == Vec4::ZERO {
        return None;
    }
    elements.iter().position(|x| !x.is_finite())
}
