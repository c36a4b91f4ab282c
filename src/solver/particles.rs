//! The state of a body: its particles. Everything else about a body only describes.

use glam::{Vec3, Vec4};

/// Particles as columns of 16-byte elements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Position in xyz [m], inverse mass in w [1/kg]; 0 is pinned.
    pub positions: Vec<Vec4>,
    /// Position at the start of the substep in xyz [m]; w is unused.
    pub previous: Vec<Vec4>,
    /// Velocity in xyz [m/s]; w is 0.
    pub velocities: Vec<Vec4>,
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

/// Index of the first element that is not finite.
#[must_use]
pub fn first_not_finite(elements: &[Vec4]) -> Option<usize> {
    // A non-finite number times zero is NaN, and NaN stays: one sum tells for a whole block.
    const BLOCK: usize = 64;
    elements
        .chunks(BLOCK)
        .position(|block| {
            let sum = block.iter().fold(Vec4::ZERO, |sum, &x| sum + x * 0.0);
            !sum.is_finite()
        })
        .and_then(|block| {
            let start = block * BLOCK;
            elements[start..]
                .iter()
                .position(|x| !x.is_finite())
                .map(|offset| start + offset)
        })
}
