//! A tree of edges.

use core::f64::consts::{PI, TAU};
use glam::{DQuat, DVec3};
use pliant_solver::RestShape;

/// Measures of a tree.
#[derive(Debug, Clone, Copy)]
pub struct Tree {
    /// Length of the trunk [m].
    pub trunk: f32,
    /// Branches at a fork.
    pub forks: u32,
    /// Forks between the trunk and a tip.
    pub levels: u32,
    /// Angle between a branch and those that leave it [°].
    pub spread: f32,
    /// Length of a branch as a fraction of that which it leaves.
    pub shrink: f32,
    /// Edges of a branch.
    pub segments: u32,
}

impl Tree {
    /// Number of vertices.
    pub fn vertices(&self) -> u64 {
        let forks = u64::from(self.forks);
        let branches =
            (0..self.levels).fold(1_u64, |sum, _| sum.saturating_mul(forks).saturating_add(1));
        branches
            .saturating_mul(self.segments.into())
            .saturating_add(1)
    }

    /// Branches level by level. Those at a fork are spread evenly around it, each fork turned by the
    /// golden angle against the one before.
    pub fn grow(&self) -> RestShape {
        let golden = PI * (3.0 - 5.0_f64.sqrt());
        let spread = turn_about(DVec3::NEG_Z, f64::from(self.spread).to_radians());
        let mut places = vec![DVec3::ZERO];
        let mut edges = Vec::new();
        let mut length = f64::from(self.trunk);
        // The vertices from which branches leave, and rotations from y to their directions.
        let mut leaving = vec![(0_u32, DQuat::IDENTITY)];
        for level in 0..=self.levels {
            let mut next = Vec::new();
            for (number, &(root, turn)) in leaving.iter().enumerate() {
                let step = turn * DVec3::Y * (length / f64::from(self.segments));
                let mut last = root;
                for _ in 0..self.segments {
                    places.push(places[last as usize] + step);
                    edges.push([last, places.len() as u32 - 1]);
                    last = places.len() as u32 - 1;
                }
                if level == self.levels {
                    continue;
                }
                let start = golden * number as f64;
                next.extend((0..self.forks).map(|fork| {
                    let around = start + TAU * f64::from(fork) / f64::from(self.forks);
                    (last, turn * turn_about(DVec3::Y, around) * spread)
                }));
            }
            leaving = next;
            length *= f64::from(self.shrink);
        }
        RestShape {
            vertices: places.into_iter().map(|at| at.as_vec3()).collect(),
            edges,
            ..RestShape::default()
        }
    }
}

/// The rotation about an axis by an angle [rad], with the same bits on every platform.
fn turn_about(axis: DVec3, angle: f64) -> DQuat {
    let [x, y, z] = (axis * libm::sin(0.5 * angle)).to_array();
    DQuat::from_xyzw(x, y, z, libm::cos(0.5 * angle))
}
