//! Inside test and distance queries for a surface.
//!
//! A point is inside where the magnitude of the generalized winding number exceeds one half. The
//! test tolerates overlapping triangles, small gaps and surfaces that face inwards. Distant
//! triangles are approximated by a dipole, after Barill and others, "Fast Winding Numbers for Soups
//! and Clouds" (2018). Independent of lattices; does not modify the surface.

use glam::DVec3;

const LEAF: usize = 8;
/// A node is approximated by one dipole beyond this multiple of its radius, as in the paper. The
/// error is a few hundredths, irrelevant at a threshold of one half.
const FAR: f64 = 2.0;

/// Bounding volume hierarchy of the triangles of a surface.
pub(super) struct Enclosure {
    triangles: Vec<[DVec3; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// Area-weighted centroid of the triangles.
    center: DVec3,
    /// Largest distance of a triangle corner from `center`.
    radius: f64,
    /// Sum of area times normal.
    area: DVec3,
    content: Content,
}

enum Content {
    Leaf {
        start: usize,
        end: usize,
    },
    /// The first child is the next node.
    Inner {
        second: usize,
    },
}

impl Enclosure {
    /// Builds the tree; at least one triangle is required.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let mut tree = Self {
            triangles: triangles
                .iter()
                .map(|t| t.map(|i| vertices[i as usize]))
                .collect(),
            nodes: Vec::new(),
        };
        tree.grow(0, triangles.len());
        tree
    }

    fn grow(&mut self, start: usize, end: usize) {
        let index = self.nodes.len();
        let triangles = &mut self.triangles[start..end];
        let mut node = Node::of(triangles, start, end);
        if triangles.len() <= LEAF {
            self.nodes.push(node);
            return;
        }
        let extent = node.high - node.low;
        let axis = extent.max_position();
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        let middle = triangles.len() / 2;
        triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        node.content = Content::Inner { second: 0 };
        self.nodes.push(node);
        self.grow(start, start + middle);
        let second = self.nodes.len();
        self.nodes[index].content = Content::Inner { second };
        self.grow(start + middle, end);
    }

    /// Whether the magnitude of the winding number exceeds one half.
    pub fn contains(&self, point: DVec3) -> bool {
        self.winding_number(point).abs() > 0.5
    }

    /// Winding number of the surface around a point: 1 inside and 0 outside of a closed surface.
    pub fn winding_number(&self, point: DVec3) -> f64 {
        self.solid_angle(0, point) / (4.0 * std::f64::consts::PI)
    }

    fn solid_angle(&self, index: usize, point: DVec3) -> f64 {
        let node = &self.nodes[index];
        let to = node.center - point;
        let distance_squared = to.length_squared();
        if distance_squared > FAR * FAR * node.radius * node.radius {
            return node.area.dot(to) / (distance_squared * distance_squared.sqrt());
        }
        match node.content {
            Content::Leaf { start, end } => self.triangles[start..end]
                .iter()
                .map(|triangle| solid_angle(triangle, point))
                .sum(),
            Content::Inner { second } => {
                self.solid_angle(index + 1, point) + self.solid_angle(second, point)
            }
        }
    }

    /// Distance from a point to the surface, at most `limit`.
    pub fn distance(&self, point: DVec3, limit: f64) -> f64 {
        let mut best = limit * limit;
        self.nearest(0, point, &mut best);
        best.sqrt()
    }

    fn nearest(&self, index: usize, point: DVec3, best: &mut f64) {
        let node = &self.nodes[index];
        if node.box_distance_squared(point) >= *best {
            return;
        }
        match node.content {
            Content::Leaf { start, end } => {
                for triangle in &self.triangles[start..end] {
                    let nearest = nearest_in_triangle(triangle, point);
                    *best = best.min(nearest.distance_squared(point));
                }
            }
            Content::Inner { second } => {
                let near = self.nodes[index + 1].box_distance_squared(point);
                let far = self.nodes[second].box_distance_squared(point);
                if near <= far {
                    self.nearest(index + 1, point, best);
                    self.nearest(second, point, best);
                } else {
                    self.nearest(second, point, best);
                    self.nearest(index + 1, point, best);
                }
            }
        }
    }
}

impl Node {
    fn of(triangles: &[[DVec3; 3]], start: usize, end: usize) -> Self {
        let corners = || triangles.iter().flatten();
        let low = corners().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = corners().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let (mut area, mut size, mut moment) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for [a, b, c] in triangles {
            let own = (b - a).cross(c - a) * 0.5;
            area += own;
            size += own.length();
            moment += (a + b + c) * (own.length() / 3.0);
        }
        let center = if size > 0.0 {
            moment / size
        } else {
            (low + high) * 0.5
        };
        let radius = corners().fold(0.0, |radius: f64, p| radius.max(p.distance(center)));
        Self {
            low,
            high,
            center,
            radius,
            area,
            content: Content::Leaf { start, end },
        }
    }

    fn box_distance_squared(&self, point: DVec3) -> f64 {
        point.clamp(self.low, self.high).distance_squared(point)
    }
}

/// Winding number by direct summation, for few points or few triangles.
pub(super) fn winding_number(triangles: impl Iterator<Item = [DVec3; 3]>, point: DVec3) -> f64 {
    let whole: f64 = triangles.map(|t| solid_angle(&t, point)).sum();
    whole / (4.0 * std::f64::consts::PI)
}

/// Solid angle that a triangle subtends at a point [sr], positive from behind. Van Oosterom &
/// Strackee, "The Solid Angle of a Plane Triangle" (1983), eq. 8.
fn solid_angle(triangle: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let above = a.dot(b.cross(c));
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * libm::atan2(above, below)
}

/// Point of a triangle nearest to a given point. Ericson, "Real-Time Collision Detection" (2005),
/// section 5.1.5.
fn nearest_in_triangle(&[a, b, c]: &[DVec3; 3], point: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    a + ab * (vb / sum) + ac * (vc / sum)
}
