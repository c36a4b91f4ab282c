//! The order of the constraints of a torn topology, for storing it: it depends on the tears, not on
//! the shape alone.

use crate::{
    RestShape, Topology, VertexIndex,
    numbering::Numbering,
    order::{Colors, Elements},
    partitions::Partitions,
    topology::{Edges, Facets, Hinges, Tetrahedra},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Partitions and colors of a torn topology.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TornOrder {
    splits: u32,
    starts: Vec<u32>,
    edges: Colors,
    tetrahedra: Colors,
    /// Particles of the hinges and of the triangles, where they were used.
    hinges: Option<(Vec<[u32; 4]>, Colors)>,
    facets: Option<(Vec<[u32; 3]>, Colors)>,
}

impl Topology {
    /// The order of its constraints if it was torn.
    #[must_use]
    pub fn torn_order(&self) -> Option<TornOrder> {
        let hinges = self.hinges.0.get().map(|it| &it.elements);
        let facets = self.facets.0.get().map(|it| &it.elements);
        (self.splits > 0).then(|| TornOrder {
            splits: self.splits,
            starts: self.partitions.starts().to_vec(),
            edges: self.edges.elements.colors(),
            tetrahedra: self.tetrahedra.elements.colors(),
            hinges: hinges.map(|it| (it.corners().collect(), it.colors())),
            facets: facets.map(|it| (it.corners().collect(), it.colors())),
        })
    }

    /// A torn topology from its [`rest_shape`](Self::rest_shape), its numbering and its order;
    /// `None` if they do not fit each other.
    #[must_use]
    pub fn torn(shape: RestShape, numbering: Numbering, order: &TornOrder) -> Option<Self> {
        let place = |vertex: u32| numbering.particle(VertexIndex(vertex)).0;
        let ends: Vec<[u32; 2]> = shape.edges.iter().map(|it| it.map(place)).collect();
        let corners: Vec<[u32; 4]> = shape.tetrahedra.iter().map(|it| it.map(place)).collect();
        let mut topology = Self::numbered(shape, numbering).ok()?;
        let count = topology.particles();
        let partitions = Partitions::from_starts(order.starts.clone())?;
        if partitions.particles() != count {
            return None;
        }
        let rest = &topology.rest;
        let edges = Elements::colored(&ends, &partitions, &order.edges)?;
        let cells = Elements::colored(&corners, &partitions, &order.tetrahedra)?;
        let is_same = ends.len() == topology.edges.ends().len()
            && corners.len() == topology.tetrahedra.corners().len();
        if !is_same {
            return None;
        }
        let (edges, cells) = (Edges::of(edges, rest), Tetrahedra::of(cells, rest));
        if let Some((corners, colors)) = &order.hinges {
            // Each fold has an edge and two triangles with areas.
            let is_sound = |it: &[u32; 4]| {
                it.iter().all(|&i| (i as usize) < count)
                    && (0..4).all(|i| !it[..i].contains(&it[i]))
            };
            if !corners.iter().all(is_sound) {
                return None;
            }
            let elements = Elements::colored(corners, &partitions, colors)?;
            topology
                .hinges
                .0
                .get_or_init(|| Hinges::with(elements, rest));
        }
        if let Some((corners, colors)) = &order.facets {
            let mut known: Vec<_> = topology.triangles.to_vec();
            known.sort_unstable();
            if !corners.iter().all(|it| known.binary_search(it).is_ok()) {
                return None;
            }
            let elements = Elements::colored(corners, &partitions, colors)?;
            let facets = Arc::new(Facets::with(elements, rest));
            topology.facets.0.get_or_init(|| facets);
        }
        (topology.edges, topology.tetrahedra) = (edges, cells);
        topology.partitions = Arc::new(partitions);
        topology.splits = order.splits;
        Some(topology)
    }
}
