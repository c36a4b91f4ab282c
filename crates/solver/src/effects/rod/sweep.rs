//! An iteration that solves the equations of chains or networks one after another (Gauss–Seidel): those
//! of a segment together, and those of a joint, in the order of the rows. It needs more iterations the more
//! segments there are, and is there for comparison.

use super::{
    elimination::SINGULAR,
    system::{Node, Pass, System, turned},
};
use glam::{DMat3, DVec3};

impl System {
    /// Leaves the displacements of the particles in `moves`.
    pub(super) fn sweep(&mut self, pass: &Pass, at: &impl Fn(u32) -> Node) {
        for row in 0..self.rest.rows() {
            if row < self.rest.segments.len() {
                self.stretch(row, pass, at);
            }
            self.bend(row, pass, at);
        }
    }

    fn stretch(&mut self, row: usize, pass: &Pass, at: &impl Fn(u32) -> Node) {
        let frame = self.frame(row);
        let [first, second] = self.rest.segments[row].nodes;
        let [w0, w1] = [first, second].map(|node| at(node).w);
        let ([right, _], [soft, _]) = self.right(row, Some(&frame), pass, &self.moved(at));
        let block = DMat3::from_diagonal(DVec3::splat(w0 + w1))
            + frame.arm * frame.inertia * frame.arm.transpose()
            + soft;
        let change = solve(block, right) * pass.relaxation;
        self.lambdas[row][0] += change;
        self.moves[first as usize] -= w0 * change;
        self.moves[second as usize] += w1 * change;
        let by = frame.inertia * (frame.arm.transpose() * change);
        let orientation = &mut self.segments[row].orientation;
        *orientation = turned(*orientation, by);
    }

    fn bend(&mut self, row: usize, pass: &Pass, at: &impl Fn(u32) -> Node) {
        let Some((behind, joint)) = self.rest.joint_of(row) else {
            return;
        };
        let before = joint.before;
        let by_turn = self.bending(row);
        let [of_before, of_behind] = [before, behind].map(|i| self.frame(i).inertia);
        let ([_, right], [_, soft]) = self.right(row, None, pass, &self.moved(at));
        let block = by_turn * (of_before + of_behind) * by_turn.transpose() + soft;
        let change = solve(block, right) * pass.relaxation;
        self.lambdas[row][1] += change;
        let moment = by_turn.transpose() * change;
        for (segment, by) in [
            (before, -(of_before * moment)),
            (behind, of_behind * moment),
        ] {
            let orientation = &mut self.segments[segment].orientation;
            *orientation = turned(*orientation, by);
        }
    }

    /// The nodes, moved by the constraints before.
    fn moved<'a>(&'a self, at: &'a impl Fn(u32) -> Node) -> impl Fn(u32) -> Node + 'a {
        |node| {
            let Node { x, w } = at(node);
            let x = x + self.moves[node as usize];
            Node { x, w }
        }
    }
}

/// Solves three equations of a symmetric positive semidefinite matrix by LDLᵀ. Singular pivots are left
/// out.
#[allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the matrix"
)]
fn solve(block: DMat3, right: DVec3) -> DVec3 {
    let mut a = block.to_cols_array_2d();
    let mut x = right.to_array();
    let mut pivots = [0.0; 3];
    for j in 0..3 {
        let limit = block.col(j)[j] * SINGULAR;
        pivots[j] = if a[j][j] > limit { 1.0 / a[j][j] } else { 0.0 };
        for r in j + 1..3 {
            let entry = a[j][r] * pivots[j];
            for c in j + 1..=r {
                a[c][r] -= entry * a[j][c];
            }
            x[r] -= entry * x[j];
        }
    }
    for j in (0..3).rev() {
        x[j] *= pivots[j];
        for r in j + 1..3 {
            x[j] -= a[j][r] * pivots[j] * x[r];
        }
    }
    DVec3::from_array(x)
}
