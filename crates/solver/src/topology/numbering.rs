//! Numbers the particles of a body so that those of a constraint have close numbers.
//!
//! The smaller the index range of constraints, the narrower the [partitions](crate::partitions) can
//! be: there are more of them for threads, and a larger part fits in the cache. The order is that
//! of Cuthill and McKee (*Reducing the bandwidth of sparse symmetric matrices*, 1969): layer by
//! layer from an end of the body, found as by George and Liu (1979). If the order of the input is
//! better, such as rows of a grid, it is kept.

use super::index::{ParticleIndex, VertexIndex};
use std::ops::Range;

/// Mapping between particles of the solver and vertices of the input.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Numbering {
    /// Vertex of each particle; empty for the identity.
    vertices: Vec<u32>,
    /// Particle of each vertex; empty for the identity.
    particles: Vec<u32>,
}

impl Numbering {
    /// The better of two orders for constraints between `count` vertices: the given one, or layer
    /// by layer.
    #[must_use]
    pub fn new(count: usize, edges: &[[u32; 2]], tetrahedra: &[[u32; 4]]) -> Self {
        let graph = Graph::new(count, edges, tetrahedra);
        let layers = Self::of(graph.layers());
        let reach =
            |numbering: &Self| total_reach(edges, numbering) + total_reach(tetrahedra, numbering);
        let given = Self::default();
        if reach(&layers) < reach(&given) {
            layers
        } else {
            given
        }
    }

    /// Numbering in which the particles have these vertices; an empty list is the identity. `None`
    /// unless they are a permutation of the vertices from 0.
    #[must_use]
    pub fn from_vertices(vertices: Vec<u32>) -> Option<Self> {
        let mut seen = vec![false; vertices.len()];
        for &vertex in &vertices {
            let seen = seen.get_mut(vertex as usize)?;
            if std::mem::replace(seen, true) {
                return None;
            }
        }
        Some(Self::of(vertices))
    }

    /// Vertex of each particle; empty for the identity.
    #[must_use]
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Number of particles; `None`, for any number of them, if it is the identity.
    #[must_use]
    pub(crate) fn len(&self) -> Option<usize> {
        (!self.vertices.is_empty()).then_some(self.vertices.len())
    }

    fn of(vertices: Vec<u32>) -> Self {
        let mut particles = vec![0; vertices.len()];
        for (particle, &vertex) in vertices.iter().enumerate() {
            particles[vertex as usize] = particle as u32;
        }
        Self {
            vertices,
            particles,
        }
    }

    /// Vertex of the input of a particle.
    #[must_use]
    pub fn vertex(&self, particle: ParticleIndex) -> VertexIndex {
        let vertex = self.vertices.get(particle.index());
        VertexIndex(vertex.map_or(particle.0, |&vertex| vertex))
    }

    /// Particle of a vertex of the input; a vertex that does not exist maps to no valid particle.
    #[must_use]
    pub fn particle(&self, vertex: VertexIndex) -> ParticleIndex {
        let particle = self.particles.get(vertex.index());
        ParticleIndex(particle.map_or(vertex.0, |&particle| particle))
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        (self.vertices.len() + self.particles.len()) * size_of::<u32>()
    }
}

/// Sum over all elements of the index range of their particles.
fn total_reach<const N: usize>(elements: &[[u32; N]], numbering: &Numbering) -> u64 {
    elements
        .iter()
        .map(|corners| {
            let particles = corners.map(|vertex| numbering.particle(VertexIndex(vertex)).0);
            let (low, high) = (particles.iter().min(), particles.iter().max());
            u64::from(high.copied().unwrap_or(0) - low.copied().unwrap_or(0))
        })
        .sum()
}

/// Adjacency of the vertices by elements.
struct Graph {
    /// Start of the neighbors of each vertex, and the end of those of the last.
    starts: Vec<u32>,
    neighbors: Vec<u32>,
}

impl Graph {
    fn new(count: usize, edges: &[[u32; 2]], tetrahedra: &[[u32; 4]]) -> Self {
        let each = |put: &mut dyn FnMut(u32, u32)| {
            for &[a, b] in edges {
                put(a, b);
                put(b, a);
            }
            // Edges of tetrahedra are normally edges of the body.
            if edges.is_empty() {
                for corners in tetrahedra {
                    for (i, &a) in corners.iter().enumerate() {
                        for &b in corners[..i].iter().chain(&corners[i + 1..]) {
                            put(a, b);
                        }
                    }
                }
            }
        };
        let mut starts = vec![0_u32; count + 1];
        each(&mut |a, _| starts[a as usize + 1] += 1);
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut neighbors = vec![0; starts[count] as usize];
        each(&mut |a, b| {
            let slot = &mut next[a as usize];
            neighbors[*slot as usize] = b;
            *slot += 1;
        });
        Self { starts, neighbors }
    }

    fn neighbors(&self, vertex: u32) -> &[u32] {
        let Range { start, end } = self.starts[vertex as usize]..self.starts[vertex as usize + 1];
        &self.neighbors[start as usize..end as usize]
    }

    fn degree(&self, vertex: u32) -> usize {
        self.neighbors(vertex).len()
    }

    /// All vertices, component by component, each layer by layer from one of its ends.
    fn layers(&self) -> Vec<u32> {
        let count = self.starts.len() - 1;
        let mut order = Vec::with_capacity(count);
        let mut walk = Walk {
            graph: self,
            seen: vec![0; count],
            mark: 0,
        };
        let mut done = vec![false; count];
        for first in 0..count as u32 {
            if done[first as usize] {
                continue;
            }
            let end = walk.end_of(first);
            let from = order.len();
            walk.walk(end, &mut order);
            for &vertex in &order[from..] {
                done[vertex as usize] = true;
            }
        }
        order
    }
}

/// Breadth-first traversal of the graph.
struct Walk<'a> {
    graph: &'a Graph,
    /// Number of the last traversal that reached each vertex.
    seen: Vec<u32>,
    mark: u32,
}

impl Walk<'_> {
    /// A pseudo-peripheral vertex of the component of `start`.
    fn end_of(&mut self, start: u32) -> u32 {
        const TRIES: usize = 4;
        let (mut end, mut depth) = (start, 0);
        let mut order = Vec::new();
        for _ in 0..TRIES {
            order.clear();
            let (layers, last) = self.walk(end, &mut order);
            if layers <= depth {
                break;
            }
            depth = layers;
            let least = order[last..]
                .iter()
                .min_by_key(|&&vertex| (self.graph.degree(vertex), vertex));
            end = least.copied().unwrap_or(end);
        }
        end
    }

    /// Appends the vertices of a component, layer by layer from `start`, those with few neighbors
    /// first. Returns the number of layers and the start of the last one.
    fn walk(&mut self, start: u32, order: &mut Vec<u32>) -> (usize, usize) {
        self.mark += 1;
        self.seen[start as usize] = self.mark;
        let first = order.len();
        order.push(start);
        let (mut layers, mut layer) = (1, first);
        let mut end = order.len();
        let mut next = first;
        while next < order.len() {
            if next == end {
                (layers, layer, end) = (layers + 1, end, order.len());
            }
            let found = order.len();
            for &neighbor in self.graph.neighbors(order[next]) {
                let seen = &mut self.seen[neighbor as usize];
                if *seen != self.mark {
                    *seen = self.mark;
                    order.push(neighbor);
                }
            }
            order[found..].sort_unstable_by_key(|&vertex| (self.graph.degree(vertex), vertex));
            next += 1;
        }
        (layers, layer)
    }
}
