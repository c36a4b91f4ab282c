//! Damage criteria for repair.

use super::{MIN_COLLAPSED_LENGTH, MIN_COLLAPSED_VOLUME, ParticleAccess, rest};
use crate::{
    Effects, Instructions, Method, Particles, Settings, Stretch, Topology,
    effects::{bend, stretch, volume},
    elastic::Elastic,
    topology::{self, Dimension},
};
use glam::DVec3;

/// Fraction of its rest volume below which a tetrahedron has collapsed.
pub const COLLAPSED: f64 = 0.01;

/// Fraction of its rest length below which an edge of a sheet has collapsed.
pub const CRUSHED: f64 = 0.1;

/// Strain that a single projection would take from an edge of a tangled hinge.
pub const TANGLED: f64 = 0.1;

/// Mean strain above which a sheet counts as loaded beyond the accuracy of its iterations, not as
/// tangled.
pub const LOADED: f64 = 0.05;

/// Cosine of the angle between the normals of a hinge that is folded over: 120°.
const FOLDED: f64 = -0.5;

/// Repairable elements of a body, and the time constant.
#[derive(Debug, Clone, Copy)]
pub struct Repairable<'a> {
    pub topology: &'a Topology,
    /// T [s].
    pub time: f64,
    elements: Elements,
}

#[derive(Debug, Clone, Copy)]
enum Elements {
    Tetrahedra,
    /// Edges of a sheet, in substeps of this length [s].
    Edges(Stretch, f64),
}

impl<'a> Repairable<'a> {
    /// `None` if the body is not repaired.
    pub fn of(effects: &Effects, topology: &'a Topology, settings: &Settings) -> Option<Self> {
        if effects.neo_hookean.is_some() || effects.plasticity.is_some() {
            return None;
        }
        let is_sheet = topology.dimension == Dimension::Sheet && settings.method == Method::Xpbd;
        let h = settings.substep_seconds();
        let (time, elements) = match (effects.volume, effects.stretch) {
            (Some(volume), _) => (volume.repair, Elements::Tetrahedra),
            (None, Some(stretch)) if is_sheet => (stretch.repair, Elements::Edges(stretch, h)),
            _ => return None,
        };
        let time = f64::from(time.get());
        time.is_finite().then_some(Self {
            topology,
            time,
            elements,
        })
    }

    /// Visits the particles of each element, and its rest volume [m³] or rest length [m].
    pub fn each(&self, mut visit: impl FnMut(&[u32], f64)) {
        match self.elements {
            Elements::Tetrahedra => {
                let tetrahedra = &self.topology.tetrahedra;
                let volumes = tetrahedra.rest_volume.iter();
                for (corners, &rest) in tetrahedra.corners().zip(volumes) {
                    visit(&corners, rest.into());
                }
            }
            Elements::Edges(..) => {
                let edges = &self.topology.edges;
                for (ends, &rest) in edges.ends().zip(&edges.rest_length) {
                    visit(&ends, rest.into());
                }
            }
        }
    }

    /// Time between two checks of an undamaged body [s]. Solids are checked in every tick: an
    /// element that stays inverted for longer inverts its neighbors.
    pub const fn interval(&self) -> f64 {
        match self.elements {
            Elements::Tetrahedra => 0.0,
            Elements::Edges(..) => self.time,
        }
    }

    /// Whether any element has collapsed or may be tangled, in one pass over the body.
    pub fn may_be_damaged(&self, particles: &Particles, instructions: Instructions) -> bool {
        match self.elements {
            Elements::Tetrahedra => {
                volume::any_below(COLLAPSED as f32, self.topology, particles, instructions)
            }
            Elements::Edges(stretch, h) => {
                let kernel = stretch.kernel(self.topology, h as f32);
                let bounds = [CRUSHED, TANGLED].map(|bound| bound as f32);
                stretch::any_short(bounds, &kernel, particles, instructions)
            }
        }
    }

    /// Whether an element has collapsed, or a hinge is tangled: without either, no element counts as
    /// damaged. In lanes, and exact to the safe side: most sheets in motion have an edge that may be
    /// tangled, but few of their hinges are folded over.
    pub fn may_need_repair(&self, particles: &Particles, instructions: Instructions) -> bool {
        let Elements::Edges(stretch, h) = self.elements else {
            return true;
        };
        let kernel = stretch.kernel(self.topology, h as f32);
        stretch::any_crushed(CRUSHED as f32, &kernel, particles, instructions)
            || bend::any_folded(
                FOLDED as f32,
                self.topology.hinges(),
                particles,
                instructions,
                |corners| self.tangle((&stretch, h), corners, particles).is_some(),
            )
    }

    /// Minimum collapsed fraction of the body for a repair to begin.
    pub const fn min_collapsed(&self) -> f64 {
        match self.elements {
            Elements::Tetrahedra => MIN_COLLAPSED_VOLUME,
            Elements::Edges(..) => MIN_COLLAPSED_LENGTH,
        }
    }

    /// Visits the particles of each collapsed element. Returns the collapsed fraction of the body.
    pub fn collapsed(&self, particles: &impl ParticleAccess, mut visit: impl FnMut(&[u32])) -> f64 {
        let (mut collapsed, mut total) = (0.0, 0.0);
        self.each(|corners, rest| {
            total += rest;
            let x = |corner: usize| particles.position(corners[corner] as usize);
            let has_collapsed = match self.elements {
                Elements::Tetrahedra => topology::volume([0, 1, 2, 3].map(x)) < COLLAPSED * rest,
                Elements::Edges(..) => x(0).distance(x(1)) < CRUSHED * rest,
            };
            if has_collapsed {
                collapsed += rest;
                visit(corners);
            }
        });
        if collapsed > 0.0 {
            collapsed / total
        } else {
            0.0
        }
    }

    /// Visits the particles of each tangled hinge, and the largest strain that a projection would
    /// remove from one of its edges. Returns the fraction of all hinges, by length, for which
    /// `visit` returned true.
    pub fn tangles(
        &self,
        particles: &impl ParticleAccess,
        mut visit: impl FnMut(&[u32], f64) -> bool,
    ) -> f64 {
        let Elements::Edges(stretch, h) = self.elements else {
            return 0.0;
        };
        let stretch = (&stretch, h);
        let (mut change, mut total) = (0.0, 0.0);
        self.each(|ends, length| {
            let [a, b] = [ends[0], ends[1]].map(|i| i as usize);
            let weight = particles.inverse_mass(a) + particles.inverse_mass(b);
            let error = particles.position(a).distance(particles.position(b)) - length;
            change += projected(stretch, error, length, weight);
            total += length;
        });
        if change > LOADED * total {
            return 0.0;
        }
        let (mut tangled, mut total) = (0.0, 0.0);
        for corners in self.topology.hinges().corners() {
            let [a, b, ..] = corners.map(|i| rest(self.topology, i));
            let length = a.distance(b);
            total += length;
            if let Some(strain) = self.tangle(stretch, corners, particles)
                && visit(&corners, strain)
            {
                tangled += length;
            }
        }
        if tangled > 0.0 { tangled / total } else { 0.0 }
    }

    /// Largest strain that a projection would remove from an edge of a hinge, if it is tangled.
    fn tangle(
        &self,
        stretch: (&Stretch, f64),
        corners: [u32; 4],
        particles: &impl ParticleAccess,
    ) -> Option<f64> {
        let x = corners.map(|i| particles.position(i as usize));
        let rest = corners.map(|i| rest(self.topology, i));
        if !is_folded(x) || is_folded(rest) {
            return None;
        }
        let weights = corners.map(|i| particles.inverse_mass(i as usize));
        let edges = [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3]];
        let strains = edges.map(|[a, b]| {
            let (length, weight) = (rest[a].distance(rest[b]), weights[a] + weights[b]);
            let strain = (x[a].distance(x[b]) - length).abs() / length;
            projected(stretch, strain, length, weight)
        });
        let strain = strains.into_iter().fold(0.0, f64::max);
        (strain > TANGLED).then_some(strain)
    }
}

/// The part of a strain that a projection in a substep of `h` seconds would remove from an edge
/// with this rest length [m] and sum of inverse masses [1/kg].
fn projected((stretch, h): (&Stretch, f64), strain: f64, length: f64, weight: f64) -> f64 {
    let compliance = stretch.compliance_of(length as f32) / (h * h);
    strain * weight / (weight + compliance).max(f64::MIN_POSITIVE)
}

fn is_folded(hinge: [DVec3; 4]) -> bool {
    let [a, b] = topology::hinges::normals(hinge);
    a.dot(b) < FOLDED * a.length() * b.length()
}
