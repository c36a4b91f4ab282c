//! Reduces contacts between rigid surfaces to a few that carry the load.
//!
//! Two flat faces touch in as many places as they have vertices and crossing edges, which makes
//! Gauss–Seidel converge slowly: the rows push against each other, and the residual becomes a
//! creeping motion. Of rows with nearly the same normal between the same bodies, the four that span
//! the largest area are as good as all.

use super::row::{Active, ContactRow};
use glam::DVec3;

/// Rows whose normals have at least this cosine belong together: 8°.
const SAME: f64 = 0.99;

/// Rows that end the substep closer than the closest one plus this fraction of the thickness may
/// carry the load.
const LEVEL: f64 = 0.1;

/// Rows of two rigid surfaces with nearly the same normal.
#[derive(Debug, Default)]
pub(super) struct Manifold {
    /// Indices of the bodies; `u32::MAX` for the ground and colliders.
    bodies: [u32; 2],
    normal: DVec3,
    /// Indices of the rows, in order.
    rows: Vec<u32>,
}

/// Buffers, reused.
#[derive(Debug, Default)]
pub(super) struct Manifolds {
    all: Vec<Manifold>,
    count: usize,
    is_kept: Vec<bool>,
    points: Vec<(u32, DVec3)>,
}

impl Manifolds {
    /// Keeps at most four rows for each pair of rigid surfaces and each normal.
    pub fn reduce(&mut self, rows: &mut Vec<ContactRow>, active: &[Active]) {
        self.count = 0;
        self.is_kept.clear();
        self.is_kept.resize(rows.len(), true);
        for (number, row) in rows.iter().enumerate() {
            if row.is_between_rigid() {
                self.put(number as u32, row, active);
            }
        }
        for number in 0..self.count {
            self.choose(number, rows, active);
        }
        let mut kept = self.is_kept.iter();
        rows.retain(|_| kept.next().copied().unwrap_or(true));
    }

    fn put(&mut self, number: u32, row: &ContactRow, active: &[Active]) {
        let (bodies, normal) = (row.bodies(active), row.normal());
        let is_same = |it: &Manifold| it.bodies == bodies && it.normal.dot(normal) > SAME;
        let found = self.all[..self.count].iter().position(is_same);
        let place = found.unwrap_or_else(|| {
            if self.all.len() == self.count {
                self.all.push(Manifold::default());
            }
            let new = &mut self.all[self.count];
            (new.bodies, new.normal) = (bodies, normal);
            new.rows.clear();
            self.count += 1;
            self.count - 1
        });
        self.all[place].rows.push(number);
    }

    fn choose(&mut self, number: usize, rows: &[ContactRow], active: &[Active]) {
        let Self {
            all,
            is_kept,
            points,
            ..
        } = self;
        let manifold = &all[number];
        if manifold.rows.len() <= 4 {
            return;
        }
        let normal = manifold.normal;
        let error = |row: u32| rows[row as usize].predicted_error();
        let deepest = manifold.rows.iter().map(|&row| error(row));
        let deepest = deepest.fold(f64::INFINITY, f64::min);
        points.clear();
        for &row in &manifold.rows {
            is_kept[row as usize] = false;
            let level = deepest + LEVEL * rows[row as usize].thickness();
            if error(row) <= level.max(0.0) {
                let point = rows[row as usize].point(active);
                points.push((row, point - normal * normal.dot(point)));
            }
        }
        let farthest = |of: &dyn Fn(DVec3) -> f64| {
            let mut best = (f64::NEG_INFINITY, points[0]);
            for &it in points.iter() {
                let value = of(it.1);
                if value > best.0 {
                    best = (value, it);
                }
            }
            best.1
        };
        // A corner, the opposite corner, and the farthest on either side of the diagonal.
        let middle = points.iter().map(|it| it.1).sum::<DVec3>() / points.len() as f64;
        let first = farthest(&|x| x.distance_squared(middle));
        let second = farthest(&|x| x.distance_squared(first.1));
        let across = normal.cross(second.1 - first.1);
        let third = farthest(&|x| (x - first.1).dot(across));
        let fourth = farthest(&|x| -(x - first.1).dot(across));
        for (row, _) in [first, second, third, fourth] {
            is_kept[row as usize] = true;
        }
    }
}

impl ContactRow {
    /// Whether nothing soft is involved, but a rigid body is.
    fn is_between_rigid(&self) -> bool {
        self.is_rigid() && !self.is_soft()
    }
}
