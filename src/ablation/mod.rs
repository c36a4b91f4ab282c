//! Ablation: what each effect of a scene costs, and what one would see without it.
//!
//! A scene runs as it is, once without each of its effects, and once with twice the substeps, all
//! from the same state for the same simulated time. Without an effect, a tick takes less time, and
//! the bodies end elsewhere. The distance that twice the substeps make is the yardstick: the
//! solver's own error is about as large, so that a smaller distance says nothing about an effect.
//!
//! Effects are removed from all bodies at once. Distances of particles hide nothing, but a scene
//! that is chaotic (folds, piles) has a large yardstick.

pub mod report;

use crate::{
    effect::{EffectInfo, EffectRegistry},
    scene::{
        BuiltScene,
        overrides::{Override, OverrideError},
        run::headless,
    },
    simulation::{
        Measuring, Profile, SimulationSettings, SolverThreads,
        plain::{bodies_in_order, capture},
        tick,
    },
    solver::{Body, Substeps, Threads, VertexIndex, topology::bounds},
};
use bevy::{math::DVec3, prelude::*};
use std::ops::ControlFlow;

/// Largest yardstick for which an effect is advised against, as a fraction of the size of the
/// scene. A scene that twice the substeps change by more is chaotic or not converged, and does not
/// tell what an effect changes.
pub const MAX_YARDSTICK: f64 = 0.02;

/// Options of an ablation.
#[derive(Debug, Clone)]
pub struct Options {
    /// Simulated time [s], above 0; default 2.
    pub seconds: f64,
    /// Overrides that are applied to the scene before.
    pub set: Vec<Override>,
    /// Solver threads; defaults to one per core.
    pub threads: Option<Threads>,
    /// Number of times that each variant runs, in turn with the others; default 3, at least 2. The
    /// fastest run counts, the second fastest gives the noise.
    pub rounds: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seconds: 2.0,
            set: Vec::new(),
            threads: None,
            rounds: 3,
        }
    }
}

/// Distance of the particles of two runs at the end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distance {
    /// Root mean square [m].
    pub rms: f64,
    /// Maximum [m].
    pub max: f64,
    /// Number of bodies and grains that only one of the runs has at the end. They have no distance.
    pub unmatched: usize,
}

/// Real time of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cost {
    /// Mean over the ticks of the fastest run [ms].
    pub ms: f64,
    /// Difference to the second fastest run [ms].
    pub noise: f64,
}

/// The scene without one of its effects, or with another setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Name of the effect in files.
    pub name: &'static str,
    /// Title of the effect.
    pub title: &'static str,
    /// Number of bodies that carry it.
    pub carriers: usize,
    /// Real time of a tick.
    pub cost: Cost,
    /// Distance from the scene as it is; `None` if a body diverged.
    pub distance: Option<Distance>,
}

/// Conclusion about an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advice {
    /// It changes what is seen.
    Keep,
    /// It costs time, and changes less than twice the substeps do.
    Remove,
    /// It changes less than twice the substeps do, and its cost is within the timing noise.
    Negligible,
}

/// The ablation of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Ablation {
    /// Simulated time [s].
    pub seconds: f64,
    /// Number of ticks.
    pub ticks: u64,
    /// Substeps per tick.
    pub substeps: u32,
    /// Number of threads.
    pub threads: usize,
    /// Size of the scene [m]: the largest diagonal of a body's bounding box at the start, or, where
    /// bodies or grains come or go, at the end.
    pub size: f64,
    /// Cost of the scene as it is.
    pub cost: Cost,
    /// The scene without each of its effects, in the order in which they act.
    pub without: Vec<Variant>,
    /// The scene with twice the substeps; `None` if that exceeds their range.
    pub finer: Option<Variant>,
}

impl Ablation {
    /// Fraction of a tick's time that the scene saves without an effect, and its uncertainty;
    /// negative if it takes longer.
    #[must_use]
    pub fn saved(&self, variant: &Variant) -> (f64, f64) {
        let whole = self.cost.ms.max(f64::MIN_POSITIVE);
        let noise = self.cost.noise.max(variant.cost.noise);
        ((self.cost.ms - variant.cost.ms) / whole, noise / whole)
    }

    /// Distance that twice the substeps make; infinite if it is unknown, as a body diverged, other
    /// bodies or grains remain, or that many substeps are out of range.
    #[must_use]
    pub fn yardstick(&self) -> f64 {
        let finer = self.finer.as_ref();
        finer
            .and_then(|finer| finer.distance)
            .filter(|distance| distance.unmatched == 0)
            .map_or(f64::INFINITY, |distance| distance.rms)
    }

    /// Whether the yardstick is small enough to judge effects by distances: at most
    /// [`MAX_YARDSTICK`].
    #[must_use]
    pub fn is_conclusive(&self) -> bool {
        self.yardstick() <= MAX_YARDSTICK * self.size
    }

    /// What to do with an effect; to keep it, if the scene is not
    /// [conclusive](Self::is_conclusive).
    #[must_use]
    pub fn advice(&self, variant: &Variant) -> Advice {
        match variant.distance {
            Some(Distance {
                rms, unmatched: 0, ..
            }) if self.is_conclusive() && rms <= self.yardstick() => {
                let (saved, noise) = self.saved(variant);
                if saved > noise {
                    Advice::Remove
                } else {
                    Advice::Negligible
                }
            }
            _ => Advice::Keep,
        }
    }
}

/// What is changed in a run.
#[derive(Debug, Clone, Copy)]
enum Change {
    None,
    Without(&'static str),
    Substeps(Substeps),
}

/// Times and the end of the runs of one change.
#[derive(Debug, Default)]
struct Runs {
    ms: Vec<f64>,
    /// Final state of the first run; every run has the same.
    end: Vec<Body>,
}

impl Runs {
    fn cost(&self) -> Cost {
        let mut sorted = self.ms.clone();
        sorted.sort_by(f64::total_cmp);
        match sorted[..] {
            [] => Cost::default(),
            [ms] => Cost { ms, noise: ms },
            [ms, second, ..] => Cost {
                ms,
                noise: second - ms,
            },
        }
    }
}

/// Runs a scene with and without each of its effects; `progress` is called after each run with the
/// completed fraction, from 0 to 1, and may end the measurement, which then has no result.
///
/// # Errors
/// [`OverrideError`] if an override is invalid; nothing has run in this case.
pub fn run(
    built: &BuiltScene,
    options: &Options,
    mut progress: impl FnMut(f64) -> ControlFlow<()>,
) -> Result<Option<Ablation>, OverrideError> {
    let mut app = prepare(built, options)?;
    let world = app.world_mut();
    let settings = **world.resource::<SimulationSettings>();
    let threads = world.resource::<SolverThreads>().0.count();
    let effects = carried(world);
    let start = capture(world).bodies;
    let ticks = (options.seconds * settings.rate.get()).round().max(1.0) as u64;
    let finer = Substeps::new(settings.substeps.get().saturating_mul(2)).ok();
    let mut changes = vec![Change::None];
    changes.extend(
        effects
            .iter()
            .map(|(effect, _)| Change::Without(effect.name)),
    );
    changes.extend(finer.map(Change::Substeps));
    let rounds = options.rounds.max(2);
    let all = (rounds * changes.len()) as f64;
    let mut runs: Vec<Runs> = changes.iter().map(|_| Runs::default()).collect();
    for round in 0..rounds {
        for (place, (change, runs)) in changes.iter().zip(&mut runs).enumerate() {
            let (ms, end) = run_once(prepare(built, options)?, *change, ticks);
            runs.ms.push(ms);
            if round == 0 {
                runs.end = end;
            }
            if progress((round * changes.len() + place + 1) as f64 / all).is_break() {
                return Ok(None);
            }
        }
    }
    let whole = runs.remove(0);
    let variant = |name, title, carriers, runs: &Runs| Variant {
        name,
        title,
        carriers,
        cost: runs.cost(),
        distance: distance(&whole.end, &runs.end),
    };
    let without = effects.iter().zip(&runs);
    Ok(Some(Ablation {
        seconds: ticks as f64 / settings.rate.get(),
        ticks,
        substeps: settings.substeps.get(),
        threads,
        size: match count(&start) == count(&whole.end) {
            true => size(&start),
            false => size(&whole.end),
        },
        cost: whole.cost(),
        without: without
            .map(|((effect, carriers), runs)| variant(effect.name, effect.title, *carriers, runs))
            .collect(),
        finer: runs
            .get(effects.len())
            .map(|runs| variant("substeps", "Twice the substeps", start.len(), runs)),
    }))
}

fn prepare(built: &BuiltScene, options: &Options) -> Result<App, OverrideError> {
    let mut app = headless(built);
    let world = app.world_mut();
    for change in &options.set {
        change.apply(world)?;
    }
    if let Some(threads) = &options.threads {
        world.insert_resource(SolverThreads(threads.clone()));
    }
    world.insert_resource(Measuring(false));
    Ok(app)
}

/// Effects that some body carries, with the number of these bodies, in the order in which they act.
fn carried(world: &mut World) -> Vec<(EffectInfo, usize)> {
    let bodies = bodies_in_order(world);
    let registry = world.resource::<EffectRegistry>();
    let count = |effect: &EffectInfo| {
        let carriers = bodies.iter();
        carriers
            .filter(|&&body| (effect.present)(&world.entity(body)))
            .count()
    };
    let counted = registry
        .iter()
        .map(|effect| (effect.clone(), count(effect)));
    counted.filter(|(_, carriers)| *carriers > 0).collect()
}

/// Runs a prepared scene with a change. Returns the mean real time of a tick [ms] and the final
/// bodies.
fn run_once(mut app: App, change: Change, ticks: u64) -> (f64, Vec<Body>) {
    let world = app.world_mut();
    match change {
        Change::None => {}
        Change::Without(effect) => remove(world, effect),
        Change::Substeps(substeps) => {
            world.resource_mut::<SimulationSettings>().substeps = substeps;
        }
    }
    let mut spent = 0.0;
    for _ in 0..ticks {
        tick(world);
        spent += world.resource::<Profile>().tick().as_secs_f64();
    }
    (spent * 1e3 / ticks as f64, capture(world).bodies)
}

/// Removes an effect from all bodies.
fn remove(world: &mut World, effect: &str) {
    let remove = world
        .resource::<EffectRegistry>()
        .get(effect)
        .map(|info| info.remove);
    for body in bodies_in_order(world) {
        if let Some(remove) = remove {
            remove(&mut world.entity_mut(body));
        }
    }
}

/// Distance of the particles of the same bodies in two states; `None` if a body diverged.
fn distance(one: &[Body], other: &[Body]) -> Option<Distance> {
    let (mut sum, mut max, mut count) = (0.0, 0.0_f64, 0_usize);
    let both = Body::in_both(one, other);
    let mut unmatched = one.len() + other.len() - 2 * both.len();
    for (a, b) in both {
        if a.quarantine.is_some() || b.quarantine.is_some() {
            return None;
        }
        let (a_places, b_places) = (places(a), places(b));
        let mut matched = 0;
        let (mut rest, mut others) = (&a_places[..], &b_places[..]);
        while let ([(one, p), next @ ..], [(other, q), beyond @ ..]) = (rest, others) {
            if one <= other {
                rest = next;
            }
            if other <= one {
                others = beyond;
            }
            if one == other {
                let squared = p.distance_squared(*q);
                sum += squared;
                max = max.max(squared);
                matched += 1;
            }
        }
        if !a.topology.radii.is_empty() {
            unmatched += a_places.len() + b_places.len() - 2 * matched;
        }
        count += matched;
    }
    let rms = (sum / count.max(1) as f64).sqrt();
    rms.is_finite().then(|| Distance {
        rms,
        max: max.sqrt(),
        unmatched,
    })
}

/// Positions of the particles of a body [m] by what identifies them, in ascending order: the number of the
/// vertex, as a torn body has additional particles; of grains the radius, as those that disappear change
/// the numbers of the others. Grains of one radius are identified by their order.
fn places(body: &Body) -> Vec<(u32, DVec3)> {
    let Body {
        topology,
        particles,
        ..
    } = body;
    let vertices = 0..particles.len() as u32;
    let mut places: Vec<_> = vertices
        .map(|vertex| {
            let i = topology.particle(VertexIndex(vertex));
            let radius = topology.radii.get(i).map(|radius| radius.to_bits());
            (radius.unwrap_or(vertex), particles.position(i))
        })
        .collect();
    places.sort_by_key(|(key, _)| *key);
    places
}

/// Numbers of bodies and of grains.
fn count(bodies: &[Body]) -> (usize, usize) {
    let grains = bodies.iter().map(|body| body.topology.radii.len());
    (bodies.len(), grains.sum())
}

/// The largest diagonal of a body's bounding box [m].
fn size(bodies: &[Body]) -> f64 {
    let diagonal = |body: &Body| {
        let positions = body.particles.positions.iter();
        let (low, high) = bounds(positions.map(|x| x.truncate()));
        let radius = body.topology.radii.iter().copied().fold(0.0, f32::max);
        f64::from(low.distance(high) + 2.0 * radius)
    };
    bodies.iter().map(diagonal).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{Density, RestShape, Topology};
    use std::sync::Arc;

    fn grains(radii: &[f32]) -> Body {
        let shape = RestShape {
            vertices: radii.iter().map(|radius| Vec3::X * *radius).collect(),
            radii: radii.to_vec(),
            ..RestShape::default()
        };
        let topology = Topology::new(shape).expect("grains");
        Body::new("grains", Arc::new(topology), Density::of(1.0))
    }

    #[test]
    fn grains_are_compared_with_themselves_though_others_disappear() {
        let all = [grains(&[0.3, 0.1, 0.4, 0.2, 0.2])];
        let fewer = [grains(&[0.3, 0.4, 0.2, 0.2])];
        let found = distance(&all, &fewer).expect("finite");
        assert_eq!((found.max, found.unmatched), (0.0, 1));
        let others = [grains(&[0.3, 0.4, 0.2, 0.25])];
        let found = distance(&fewer, &others).expect("finite");
        assert_eq!((found.max, found.unmatched), (0.0, 2));
    }
}
