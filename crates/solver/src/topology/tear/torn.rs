//! The topology after tearing.

use super::{
    Carriers, Tearing,
    attached::{Copies, hinge, now},
};
use crate::{
    Topology,
    numbering::Numbering,
    order::Elements,
    partitions::Partitions,
    topology::{Cotangents, Edges, Facets, Hinges, Identity, RestValues, Tetrahedra, lazy::Lazy},
};
use std::{collections::BTreeMap, sync::Arc};

/// Result of tearing.
#[derive(Debug)]
pub struct Torn {
    /// The torn topology.
    pub topology: Arc<Topology>,
    /// For each of its particles, the particle that it was, or of which it is a copy.
    pub sources: Vec<u32>,
    /// For each particle before, its number now.
    pub places: Vec<u32>,
    /// For each particle that was split, the elements around it: their particles as they were and
    /// as they are.
    elements: BTreeMap<u32, Vec<Vec<[u32; 2]>>>,
}

impl Torn {
    /// What particles of one element have become: the same copies as in an element that had all of
    /// them, or the particles themselves.
    #[must_use]
    pub fn together(&self, particles: &[u32]) -> Vec<u32> {
        let has_all = |element: &&Vec<[u32; 2]>| {
            let mut each = particles.iter();
            each.all(|it| element.iter().any(|[was, _]| was == it))
        };
        let around = particles.iter().find_map(|it| self.elements.get(it));
        let element = around.into_iter().flatten().find(has_all);
        let now = |particle: &u32| {
            let own = element.and_then(|all| all.iter().find(|[was, _]| was == particle));
            own.map_or(self.places[*particle as usize], |[_, is]| *is)
        };
        particles.iter().map(now).collect()
    }
}

/// The structure of a torn topology, without rest values.
struct Structure<'a> {
    copies: Copies,
    places: Vec<u32>,
    partitions: Partitions,
    edges: (Elements<2>, Vec<u32>),
    hinges: Option<(Elements<4>, Vec<u32>)>,
    tearing: Tearing<'a>,
}

impl<'a> Tearing<'a> {
    /// Ends; `None` if nothing was split.
    #[must_use]
    pub fn finish(self) -> Option<Torn> {
        if self.is_empty() {
            return None;
        }
        let topology = self.topology;
        let structure = Structure::of(self);
        let sources = structure.sources();
        // After plastic flow there are two topologies of the same structure.
        let torn = match topology.original() {
            None => Arc::new(structure.apply(topology)),
            Some(original) => {
                let values = topology.rest_values().unwrap_or_default();
                if !values.angles.is_empty() || !values.folds.is_empty() {
                    // Both have the same ones in the same order.
                    let _ = original.hinges();
                }
                let original = Arc::new(structure.apply(original));
                let values = structure.rest_values(topology, &values);
                original.flowed(&values).unwrap_or(original)
            }
        };
        Some(Torn {
            topology: torn,
            sources,
            elements: structure.elements(),
            places: structure.places,
        })
    }
}

impl<'a> Structure<'a> {
    fn of(tearing: Tearing<'a>) -> Self {
        let topology = tearing.topology;
        let family = tearing.family();
        let mut is_split = vec![false; topology.particles()];
        for &root in family.keys() {
            is_split[root as usize] = true;
        }
        let copies = Copies {
            family,
            roots: tearing.roots.clone(),
            count: topology.particles() as u32,
            is_split,
        };
        let mut places = Vec::with_capacity(topology.particles() + copies.roots.len());
        let mut next = 0;
        for particle in 0..copies.count {
            places.push(next);
            next += copies.family.get(&particle).map_or(1, Vec::len) as u32;
        }
        places.resize(places.len() + copies.roots.len(), 0);
        for (&root, family) in &copies.family {
            for (offset, &copy) in (0..).zip(family) {
                places[copy as usize] = places[root as usize] + offset;
            }
        }
        let partitions = topology.partitions.moved(|particle| {
            let place = (particle < copies.count).then(|| places[particle as usize]);
            place.unwrap_or(next)
        });
        let placed = |corners: [u32; 2]| corners.map(|corner| places[corner as usize]);
        let ends: Vec<[u32; 2]> = topology.edges.ends().collect();
        let edges = match &tearing.carriers {
            Carriers::Line(mesh) => topology.edges.elements.edited(
                |index| Some(placed(mesh.corners[index])),
                &[],
                &partitions,
            ),
            carriers => {
                let becomes = |edge| match carriers {
                    Carriers::Solid(mesh) => mesh.edges_of(edge, &copies),
                    Carriers::Sheet(mesh) => mesh.edges_of(edge, &copies),
                    Carriers::Line(_) => Vec::new(),
                };
                let mut now = Vec::with_capacity(ends.len());
                let (mut added, mut parents) = (Vec::new(), Vec::new());
                for (index, &edge) in (0..).zip(&ends) {
                    if copies.are_whole(&edge) {
                        now.push(Some(placed(edge)));
                        continue;
                    }
                    let mut all = becomes(edge).into_iter().map(placed);
                    now.push(all.next());
                    let before = added.len();
                    added.extend(all);
                    parents.resize(parents.len() + added.len() - before, index);
                }
                let elements = &topology.edges.elements;
                let (elements, mut from) = elements.edited(|index| now[index], &added, &partitions);
                for from in &mut from {
                    if let Some(added) = from.checked_sub(ends.len() as u32) {
                        *from = parents[added as usize];
                    }
                }
                (elements, from)
            }
        };
        let mut structure = Self {
            copies,
            places,
            partitions,
            edges,
            hinges: None,
            tearing,
        };
        structure.hinges = structure.find_hinges();
        structure
    }

    fn placed<const N: usize>(&self, corners: [u32; N]) -> [u32; N] {
        corners.map(|corner| self.places[corner as usize])
    }

    /// Hinges of a sheet, if it has any; those of a solid are found again when they are used.
    fn find_hinges(&self) -> Option<(Elements<4>, Vec<u32>)> {
        let Carriers::Sheet(mesh) = &self.tearing.carriers else {
            return None;
        };
        let hinges = self.tearing.topology.hinges.0.get()?;
        let triangles = mesh.torn_triangles(&self.copies);
        let corners: Vec<[u32; 4]> = hinges.corners().collect();
        let now = |index: usize| match self.copies.are_whole(&corners[index]) {
            true => Some(self.placed(corners[index])),
            false => hinge(corners[index], &triangles, &self.copies).map(|it| self.placed(it)),
        };
        Some(hinges.elements.edited(now, &[], &self.partitions))
    }

    /// For each particle after, the one that it was.
    fn sources(&self) -> Vec<u32> {
        let mut sources = vec![0; self.places.len()];
        for (particle, &place) in (0..).zip(&self.places) {
            sources[place as usize] = self.copies.root(particle);
        }
        sources
    }

    fn elements(&self) -> BTreeMap<u32, Vec<Vec<[u32; 2]>>> {
        let both = |element: u32| {
            let corners: &[u32] = match &self.tearing.carriers {
                Carriers::Solid(mesh) => &mesh.corners[element as usize],
                Carriers::Sheet(mesh) => &mesh.corners[element as usize],
                Carriers::Line(mesh) => &mesh.corners[element as usize],
            };
            let both = |&it: &u32| [self.copies.root(it), self.places[it as usize]];
            corners.iter().map(both).collect()
        };
        let around = |family: &Vec<u32>| {
            let all = family.iter().flat_map(|&it| self.tearing.around(it));
            all.map(|&element| both(element)).collect()
        };
        let families = self.copies.family.iter();
        families
            .map(|(&root, family)| (root, around(family)))
            .collect()
    }

    /// The same structure on a topology with other rest values.
    fn apply(&self, topology: &Topology) -> Topology {
        let sources = self.sources();
        let rest: Vec<_> = sources
            .iter()
            .map(|&it| topology.rest[it as usize])
            .collect();
        let vertex = |particle: u32| topology.vertex(particle as usize).0;
        let mut vertices = vec![0; sources.len()];
        for (particle, &place) in (0..).zip(&self.places) {
            vertices[place as usize] = match particle < self.copies.count {
                true => vertex(particle),
                // Copies follow the vertices, in the order in which they arose.
                false => particle,
            };
        }
        let tetrahedra = match &self.tearing.carriers {
            Carriers::Solid(mesh) => {
                let now = |index: usize| Some(self.placed(mesh.corners[index]));
                let (elements, from) =
                    topology
                        .tetrahedra
                        .elements
                        .edited(now, &[], &self.partitions);
                Tetrahedra {
                    elements,
                    rest_volume: picked(&topology.tetrahedra.rest_volume, &from),
                    gradient_scale: picked(&topology.tetrahedra.gradient_scale, &from).into(),
                }
            }
            _ => topology.tetrahedra.clone(),
        };
        let mut triangles = match &self.tearing.carriers {
            Carriers::Solid(mesh) => mesh.surface(&topology.triangles, &self.copies),
            Carriers::Sheet(mesh) => mesh.corners.clone(),
            Carriers::Line(_) => topology.triangles.to_vec(),
        };
        for corners in &mut triangles {
            *corners = self.placed(*corners);
        }
        let (edges, from) = &self.edges;
        let torn = Topology {
            rest: rest.into(),
            numbering: Numbering::from_vertices(vertices)
                .unwrap_or_default()
                .into(),
            partitions: self.partitions.clone().into(),
            edges: Edges {
                elements: edges.clone(),
                rest_length: picked(&topology.edges.rest_length, from),
            },
            tetrahedra,
            triangles: triangles.into(),
            radii: topology.radii.clone(),
            groups: topology.groups.carried(sources.iter().copied().map(Some)),
            dimension: topology.dimension,
            bounds: topology.bounds,
            size: topology.size,
            left_out: topology.left_out,
            hinges: Lazy::default(),
            cotangents: Lazy::default(),
            facets: Lazy::default(),
            frames: Lazy::default(),
            struts: Lazy::default(),
            surface: Lazy::default(),
            components: Lazy::default(),
            enclosure: Lazy::default(),
            splits: topology.splits + self.copies.roots.len() as u32,
            is_renewed: false,
            original: None,
            identity: Identity::default(),
        };
        if let (Some((elements, from)), Some(hinges)) = (&self.hinges, topology.hinges.0.get()) {
            torn.hinges.0.get_or_init(|| Hinges {
                elements: elements.clone(),
                rest_angle: picked(&hinges.rest_angle, from),
                flexibility: picked(&hinges.flexibility, from).into(),
                floors: [0, 1].map(|k| picked(&hinges.floors[k], from).into()),
                length: Hinges::length_of(elements, &torn.rest),
            });
            if let Some(cotangents) = topology.cotangents.0.get() {
                torn.cotangents.0.get_or_init(|| Cotangents {
                    weights: [0, 1, 2].map(|k| picked(&cotangents.weights[k], from).into()),
                    rest: picked(&cotangents.rest, from),
                    area: picked(&cotangents.area, from).into(),
                    scale: picked(&cotangents.scale, from).into(),
                });
            }
        }
        if let (Carriers::Sheet(mesh), Some(facets)) =
            (&self.tearing.carriers, topology.facets.0.get())
        {
            let known = mesh.torn_triangles(&self.copies);
            let corners: Vec<[u32; 3]> = facets.corners().collect();
            let now = |index: usize| {
                let torn = now(corners[index], &known, &self.copies);
                Some(self.placed(torn.unwrap_or(corners[index])))
            };
            let (elements, from) = facets.elements.edited(now, &[], &self.partitions);
            torn.facets.0.get_or_init(|| {
                Arc::new(Facets {
                    elements,
                    metric: [0, 1, 2].map(|k| picked(&facets.metric[k], &from)),
                    inverse: [0, 1, 2, 3].map(|k| picked(&facets.inverse[k], &from)),
                    area: picked(&facets.area, &from),
                })
            });
        }
        torn
    }

    /// Rest values after plastic flow.
    fn rest_values(&self, topology: &Topology, values: &RestValues) -> RestValues {
        let hinges = |column: &[f32]| match &self.hinges {
            Some((_, from)) if !column.is_empty() => picked(column, from),
            _ => Vec::new(),
        };
        let volumes = match &self.tearing.carriers {
            Carriers::Solid(mesh) => {
                let now = |index: usize| Some(self.placed(mesh.corners[index]));
                let elements = &topology.tetrahedra.elements;
                picked(
                    &values.volumes,
                    &elements.edited(now, &[], &self.partitions).1,
                )
            }
            _ => values.volumes.clone(),
        };
        RestValues {
            lengths: picked(&values.lengths, &self.edges.1),
            volumes,
            angles: hinges(&values.angles),
            folds: hinges(&values.folds),
        }
    }
}

/// The entries of a column at these places.
fn picked(column: &[f32], from: &[u32]) -> Vec<f32> {
    from.iter().map(|&index| column[index as usize]).collect()
}
