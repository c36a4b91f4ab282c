//! Reduces contacts between rigid surfaces to a few that carry the load.
//!
//! Two flat faces touch in as many places as they have corners and crossing edges, which makes
//! Gauss–Seidel converge slowly: the rows push against each other, and the residual becomes a
//! creeping motion. Of touches with nearly the same normal between the same surfaces, the four that span
//! the largest area are as good as all.

use glam::DVec3;

/// Touches whose normals have at least this cosine belong together: 8°.
pub(super) const SAME: f64 = 0.99;

/// Touches that end the substep closer than the closest one plus this fraction of the distance may
/// carry the load.
const LEVEL: f64 = 0.1;

/// A place where two rigid surfaces may touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// The surfaces, as a number.
    pub of: u32,
    pub normal: DVec3,
    pub point: DVec3,
    /// C at the end of the substep without contact, and the distance that the surfaces keep [m].
    pub error: f64,
    pub distance: f64,
}

/// Touches of the same surfaces with nearly the same normal.
#[derive(Debug, Default)]
struct Manifold {
    of: u32,
    normal: DVec3,
    /// Indices of the touches, in order.
    touches: Vec<u32>,
}

/// Buffers, reused.
#[derive(Debug, Default)]
pub(super) struct Manifolds {
    all: Vec<Manifold>,
    count: usize,
    /// The first one of the same surfaces as the last touch.
    first: usize,
    is_kept: Vec<bool>,
    points: Vec<(u32, DVec3)>,
}

impl Manifolds {
    /// Which touches to keep: at most four for the same surfaces and each normal. Those of the same surfaces follow
    /// each other.
    pub fn keep(&mut self, touches: &[Touch]) -> &[bool] {
        (self.count, self.first) = (0, 0);
        self.is_kept.clear();
        self.is_kept.resize(touches.len(), true);
        for (number, touch) in (0..).zip(touches) {
            self.put(number, touch);
        }
        for number in 0..self.count {
            self.choose(number, touches);
        }
        &self.is_kept
    }

    fn put(&mut self, number: u32, touch: &Touch) {
        let (of, normal) = (touch.of, touch.normal);
        let is_same = |it: &Manifold| it.normal.dot(normal) > SAME;
        if self.all[self.first..self.count]
            .first()
            .is_some_and(|it| it.of != of)
        {
            self.first = self.count;
        }
        let known = &self.all[self.first..self.count];
        let found = known
            .iter()
            .position(is_same)
            .map(|place| self.first + place);
        let place = found.unwrap_or_else(|| {
            if self.all.len() == self.count {
                self.all.push(Manifold::default());
            }
            let new = &mut self.all[self.count];
            (new.of, new.normal) = (of, normal);
            new.touches.clear();
            self.count += 1;
            self.count - 1
        });
        self.all[place].touches.push(number);
    }

    fn choose(&mut self, number: usize, touches: &[Touch]) {
        let Self {
            all,
            is_kept,
            points,
            ..
        } = self;
        let manifold = &all[number];
        if manifold.touches.len() <= 4 {
            return;
        }
        let normal = manifold.normal;
        let of = |number: u32| &touches[number as usize];
        let deepest = manifold.touches.iter().map(|&it| of(it).error);
        let deepest = deepest.fold(f64::INFINITY, f64::min);
        points.clear();
        for &number in &manifold.touches {
            is_kept[number as usize] = false;
            let Touch {
                point,
                error,
                distance,
                ..
            } = *of(number);
            if error <= (deepest + LEVEL * distance).max(0.0) {
                points.push((number, point - normal * normal.dot(point)));
            }
        }
        // Errors that are not finite are left to the solver.
        if points.is_empty() {
            let all = manifold.touches.iter();
            all.for_each(|&number| is_kept[number as usize] = true);
            return;
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
        for (number, _) in [first, second, third, fourth] {
            is_kept[number as usize] = true;
        }
    }
}
