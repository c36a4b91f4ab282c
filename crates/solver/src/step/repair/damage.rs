//! Damage criteria for repair.

use super::{MIN_COLLAPSED_LENGTH, MIN_COLLAPSED_VOLUME, ParticleAccess, rest};
use crate::{
    Effects, Method, Particles, Settings, Stretch, Topology,
    effects::{bend, stretch, volume},
    elastic::Elastic,
    kernel::block::Resources,
    topology::{self, Dimension},
};
use glam::DVec3;
use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU64, Ordering},
};

/// Fraction of its rest volume below which a tetrahedron has collapsed.
pub const COLLAPSED: f64 = 0.01;

/// Fraction of its rest length below which an edge of a sheet has collapsed.
pub const CRUSHED: f64 = 0.1;

/// Strain that a single projection would take from an edge of a tangled hinge.
pub const TANGLED: f64 = 0.1;

/// Mean strain above which a sheet counts as loaded beyond the accuracy of its iterations, not as
/// tangled.
pub const LOADED: f64 = 0.05;

/// All hinges of a sheet, in the units in which their fractions are added up.
const WHOLE: f64 = (1_u64 << 60) as f64;

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
    /// `visit` returned true; the order of the visits depends on the threads. None is tangled where
    /// the `mean_change` of the strains is that of a load.
    pub fn tangles<M: ParticleAccess>(
        &self,
        particles: &M,
        (search, mean_change): (&impl Search<M>, f64),
        visit: impl FnMut(&[u32], f64) -> bool + Send,
    ) -> f64 {
        let Elements::Edges(stretch, h) = self.elements else {
            return 0.0;
        };
        if mean_change > LOADED {
            return 0.0;
        }
        let total = self.topology.hinges().length;
        // In integers, whose sum does not depend on the order in which threads find hinges.
        let tangled = AtomicU64::new(0);
        let visit = Mutex::new(visit);
        search.any_folded(self, particles, |corners| {
            if let Some(strain) = self.tangle((&stretch, h), corners, particles)
                && visit.lock().unwrap_or_else(PoisonError::into_inner)(&corners, strain)
            {
                let [a, b, ..] = corners.map(|i| rest(self.topology, i));
                let part = a.distance(b) / total * WHOLE;
                tangled.fetch_add(part as u64, Ordering::Relaxed);
            }
            false
        });
        tangled.into_inner() as f64 / WHOLE
    }

    /// Whether any hinge is tangled.
    pub fn is_tangled<M: ParticleAccess>(&self, particles: &M, search: &impl Search<M>) -> bool {
        let Elements::Edges(stretch, h) = self.elements else {
            return false;
        };
        search.any_folded(self, particles, |corners| {
            self.tangle((&stretch, h), corners, particles).is_some()
        })
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

/// Means over the elements of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Survey {
    /// Mean strain that a projection would remove from the edges of a sheet; 0 for solids.
    pub mean_change: f64,
    /// At most this fraction of the body has collapsed; none if it is 0.
    pub collapsed: f64,
}

/// A search for damage. Where it says that something may be, the elements are examined one by one in
/// double precision.
pub(crate) trait Search<M: ParticleAccess> {
    /// Whether an element may have collapsed or be tangled, now or after the next substep; true by
    /// default.
    fn may_be_damaged(&self, _: &Repairable, _: &M) -> bool {
        true
    }

    /// Whether a repair may begin now: an element may have collapsed or be tangled; true by default.
    /// Asked before the [survey](Self::survey), which takes longer and would find nothing.
    fn may_need_repair(&self, _: &Repairable, _: &M) -> bool {
        true
    }

    /// Means over the elements.
    fn survey(&self, body: &Repairable, particles: &M) -> Survey;

    /// Whether `counts` holds for any of the hinges that may be folded over; it is asked about them
    /// in any order.
    fn any_folded(
        &self,
        body: &Repairable,
        particles: &M,
        counts: impl Fn([u32; 4]) -> bool + Sync,
    ) -> bool;
}

/// A search in all elements, in double precision.
pub(crate) struct OneByOne;

impl<M: ParticleAccess> Search<M> for OneByOne {
    fn survey(&self, body: &Repairable, particles: &M) -> Survey {
        let (mut change, mut total) = (0.0, 0.0);
        if let Elements::Edges(stretch, h) = body.elements {
            body.each(|ends, length| {
                let [a, b] = [ends[0], ends[1]].map(|i| i as usize);
                let weight = particles.inverse_mass(a) + particles.inverse_mass(b);
                let error = particles.position(a).distance(particles.position(b)) - length;
                change += projected((&stretch, h), error, length, weight);
                total += length;
            });
        }
        Survey {
            mean_change: mean(change, total),
            collapsed: 1.0,
        }
    }

    fn any_folded(&self, body: &Repairable, _: &M, counts: impl FnMut([u32; 4]) -> bool) -> bool {
        body.topology.hinges().corners().any(counts)
    }
}

/// A search in lanes, in single precision. Elements that may count as damaged are found exactly to the
/// safe side: most sheets in motion have an edge that may be tangled, but few of their hinges are
/// folded over. The mean change has the error of lengths in single precision, about 1e-7.
impl Search<Particles> for Resources<'_> {
    fn may_be_damaged(&self, body: &Repairable, particles: &Particles) -> bool {
        match body.elements {
            Elements::Tetrahedra => {
                volume::any_below(COLLAPSED as f32, body.topology, particles, *self)
            }
            Elements::Edges(stretch, h) => {
                let kernel = stretch.kernel(body.topology, h as f32);
                let bounds = [CRUSHED, TANGLED].map(|bound| bound as f32);
                stretch::any_short(bounds, &kernel, particles, *self)
            }
        }
    }

    fn may_need_repair(&self, body: &Repairable, particles: &Particles) -> bool {
        let Elements::Edges(stretch, h) = body.elements else {
            return true;
        };
        let kernel = stretch.kernel(body.topology, h as f32);
        stretch::any_crushed(CRUSHED as f32, &kernel, particles, *self)
            || body.is_tangled(particles, self)
    }

    fn survey(&self, body: &Repairable, particles: &Particles) -> Survey {
        let Elements::Edges(stretch, h) = body.elements else {
            return Survey {
                mean_change: 0.0,
                collapsed: 1.0,
            };
        };
        let kernel = stretch.kernel(body.topology, h as f32);
        let sums = stretch::sums(CRUSHED as f32, &kernel, particles, *self);
        Survey {
            mean_change: mean(sums.change, sums.rest_length),
            collapsed: mean(sums.crushed, sums.rest_length),
        }
    }

    fn any_folded(
        &self,
        body: &Repairable,
        particles: &Particles,
        counts: impl Fn([u32; 4]) -> bool + Sync,
    ) -> bool {
        let hinges = body.topology.hinges();
        bend::any_folded(FOLDED as f32, hinges, particles, *self, counts)
    }
}

fn mean(change: f64, total: f64) -> f64 {
    if total > 0.0 { change / total } else { 0.0 }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, Density, Instructions, RestShape, Threads, kernel::random::Draws};
    use glam::vec3;
    use std::sync::Arc;

    fn sheet(side: u32) -> RestShape {
        let at = |i: u32, j: u32| i * side + j;
        let places = (0..side).flat_map(|i| (0..side).map(move |j| vec3(i as f32, 0.0, j as f32)));
        let cells = (0..side - 1).flat_map(|i| (0..side - 1).map(move |j| (i, j)));
        let (mut edges, mut triangles) = (Vec::new(), Vec::new());
        for (i, j) in cells {
            let [a, b] = [at(i, j), at(i + 1, j)];
            edges.extend([[a, a + 1], [a, b], [a + 1, b]]);
            triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
        }
        RestShape {
            vertices: places.collect(),
            edges,
            triangles,
            ..RestShape::default()
        }
    }

    /// What a search finds: means, tangled fraction, whether a hinge is tangled, and the tangled
    /// hinges with their strains.
    type Found = (Survey, f64, bool, Vec<(Vec<u32>, f64)>);

    fn find(body: &Repairable, particles: &Particles, search: &impl Search<Particles>) -> Found {
        let mut found = Vec::new();
        let survey = search.survey(body, particles);
        let means = (search, survey.mean_change);
        let fraction = body.tangles(particles, means, |corners, strain| {
            found.push((corners.to_vec(), strain));
            true
        });
        found.sort_by(|one, other| one.0.cmp(&other.0));
        (survey, fraction, body.is_tangled(particles, search), found)
    }

    /// Where some of the particles are beyond their neighbors, a search in lanes finds what a search
    /// one by one finds, with every instruction set and on several threads, which search the second
    /// sheet together; the mean change to 1e-6: lengths of at most three times the rest length have
    /// less than 5 roundings of 2⁻²⁴.
    #[test]
    fn a_search_in_lanes_finds_the_same_damage() {
        let effects = Effects {
            stretch: Some(Stretch::default()),
            ..Effects::default()
        };
        let threads = [1, 3].map(|count| Threads::new(count).expect("the system starts threads"));
        let mut tangles = 0;
        for (side, trials) in [(12, 40_u32), (90, 4)] {
            let topology = Arc::new(Topology::new(sheet(side)).expect("a sound sheet"));
            let body = Repairable::of(&effects, &topology, &Settings::default()).expect("a sheet");
            for trial in 0..trials {
                let mut draws = Draws::new([trial.into()]);
                let proto = Body::new("sheet", Arc::clone(&topology), Density::of(1.0));
                let mut particles = proto.particles;
                let moved = 0.04 * f64::from(trial) / f64::from(trials);
                for position in &mut particles.positions {
                    let is_moved = draws.next() < moved;
                    let mut draw = || (draws.next() - 0.5) as f32 * 3.0;
                    let way = vec3(draw(), 0.1 * draw(), draw());
                    *position += if is_moved { way } else { 0.01 * way }.extend(0.0);
                }
                let expected = find(&body, &particles, &OneByOne);
                tangles += expected.3.len();
                let collapsed = body.collapsed(&particles, |_| ());
                let mut survey = None;
                for instructions in Instructions::all() {
                    for threads in &threads {
                        let found = find(&body, &particles, &(instructions, threads));
                        assert_eq!(*survey.get_or_insert(found.0), found.0);
                        let error = found.0.mean_change - expected.0.mean_change;
                        assert!(error.abs() < 1e-6, "{found:?}");
                        // Edges within a thousandth of the bound are few.
                        let most = collapsed..=collapsed + 1e-3;
                        assert!(most.contains(&found.0.collapsed), "{found:?}, {collapsed}");
                        assert_eq!((found.1, found.2), (expected.1, expected.2));
                        let may_need_repair =
                            (instructions, threads).may_need_repair(&body, &particles);
                        assert_eq!(may_need_repair, found.0.collapsed > 0.0 || found.2);
                        assert_eq!(found.3, expected.3, "trial {trial} of {side}²");
                    }
                }
            }
        }
        assert!(tangles > 200, "{tangles} tangled hinges");
    }
}
