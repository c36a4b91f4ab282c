//! Emitter.

use super::sink::Sink;
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Angle, Capacity, Coefficient, Emission, Finite, Flow, Fraction, GrainRadius, Lifetime, Seed,
    Settings,
    kernel::random::Draws,
    topology::{Birth, Renewal},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Source of grains.
///
/// Emitter: grains flow out of a round opening.
///
/// After n ticks at f ticks per second, ⌊n·rate/f⌋ grains were due, exactly. A grain leaves where it
/// touches no other grain of the body; while there is no such place, or the body is full, it waits,
/// and later ones with it. A grain that is due within a tick has moved on from the opening by its end,
/// as in free fall.
///
/// Position, direction and radius of a grain depend on its number and the seed alone, unless it
/// waited.
///
/// ```
/// use pliant_solver::{Angle, Capacity, Coefficient, Emitter, Lifetime};
///
/// // A fountain, of at most 500 grains.
/// let fountain = Emitter {
///     rate: Coefficient::of(250.0), // 1/s
///     capacity: Capacity::of(500),
///     lifetime: Lifetime::of(2.0), // s
///     speed: Coefficient::of(4.0), // m/s
///     spread: Angle::of(10.0),     // °
///     toward_y: 1.0.try_into()?,
///     ..Emitter::default()
/// };
/// # assert_ne!(fountain, Emitter::default());
/// # Ok::<(), pliant_solver::InvalidValue>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Emitter {
    /// Grains per second [1/s]; default 100.
    pub rate: Coefficient,
    /// Largest number of grains of the body; default 1000.
    pub capacity: Capacity,
    /// Time after which a grain disappears [s]; default ∞.
    pub lifetime: Lifetime,
    /// Speed of the grains [m/s]; default 1.
    pub speed: Coefficient,
    /// Largest angle between the direction of a grain and that of the emitter [°]; default 0.
    pub spread: Angle,
    /// Radius of the opening [m]; default 0.05.
    pub opening: Coefficient,
    /// Largest radius of a grain [m]; default 0.015.
    pub radius: GrainRadius,
    /// Variation of the radius: grains have radii from `radius` × (1 − variation) to `radius`;
    /// default 0.2.
    pub variation: Fraction,
    /// Position of the center of the opening along x [m]; default 0.
    pub x: Finite,
    /// Position along y [m]; default 1.
    pub y: Finite,
    /// Position along z [m]; default 0.
    pub z: Finite,
    /// Direction along x; default 0. Its length does not matter; a direction of length 0 is taken as
    /// −y.
    pub toward_x: Finite,
    /// Direction along y; default −1.
    pub toward_y: Finite,
    /// Direction along z; default 0.
    pub toward_z: Finite,
    /// Seed of the random numbers; default 0.
    pub seed: Seed,
}

impl Default for Emitter {
    fn default() -> Self {
        Self {
            rate: Coefficient::of(100.0),
            capacity: Capacity::default(),
            lifetime: Lifetime::default(),
            speed: Coefficient::of(1.0),
            spread: Angle::default(),
            opening: Coefficient::of(0.05),
            radius: GrainRadius::default(),
            variation: Fraction::of(0.2),
            x: Finite::ZERO,
            y: Finite::of(1.0),
            z: Finite::ZERO,
            toward_x: Finite::ZERO,
            toward_y: Finite::of(-1.0),
            toward_z: Finite::ZERO,
            seed: Seed::default(),
        }
    }
}

/// Places that are tried for a grain in a tick.
const TRIES: u64 = 16;

/// Unit of rates in fixed point [1/s].
const UNIT: f64 = 1.0 / 1_048_576.0;

/// Smallest fraction of its nominal radius that a grain can have.
const MIN_RADIUS: f64 = 0.1;

/// Effects that add or remove grains.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Renewing<'a> {
    pub emitter: Option<&'a Emitter>,
    pub sink: Option<&'a Sink>,
}

impl Renewing<'_> {
    /// Ends a tick of a body of grains with these radii [m] at `at` [m]: what appears and
    /// disappears, or `None`.
    pub fn end_tick(
        self,
        emission: &mut Emission,
        radii: &[f32],
        at: impl Fn(usize) -> DVec3,
        settings: &Settings,
    ) -> Option<Renewal> {
        let lives = self.lives(emission, radii.len(), &at, settings);
        let mut kept: Vec<u32> = (0..radii.len() as u32)
            .filter(|&particle| lives[particle as usize])
            .collect();
        let births = self.emitter.map_or_else(Vec::new, |emitter| {
            let mut space = None;
            let flow = &mut emission.grains;
            emitter.births(flow, kept.len(), settings, |birth| {
                let present = kept.iter().map(|&i| i as usize);
                let present = present.map(|i| (at(i), f64::from(radii[i])));
                let space = space.get_or_insert_with(|| Space::of(emitter, present, settings));
                space.take(birth)
            })
        });
        if kept.is_empty() && births.is_empty() {
            // A body has at least one particle.
            kept.push(0);
        }
        if kept.len() == radii.len() && births.is_empty() {
            return None;
        }
        let ages = kept.iter().map(|&i| emission.ages[i as usize]);
        emission.ages = ages.chain(births.iter().map(|_| 0)).collect();
        Some(Renewal { kept, births })
    }

    /// Whether each grain stays.
    fn lives(
        self,
        emission: &mut Emission,
        grains: usize,
        at: &impl Fn(usize) -> DVec3,
        settings: &Settings,
    ) -> Vec<bool> {
        emission.ages.resize(grains, 0);
        let lifetime = self
            .emitter
            .map_or(f64::INFINITY, |it| it.lifetime.get().into());
        let ages = emission.ages.iter_mut().enumerate();
        ages.map(|(i, age)| {
            *age = age.saturating_add(1);
            let is_old = f64::from(*age) * settings.tick_seconds() >= lifetime;
            !is_old && !self.sink.is_some_and(|sink| sink.contains(at(i)))
        })
        .collect()
    }
}

impl Emitter {
    /// Direction, of length 1.
    #[must_use]
    pub fn axis(&self) -> DVec3 {
        let axis = Finite::vector([self.toward_x, self.toward_y, self.toward_z]);
        axis.try_normalize().unwrap_or(DVec3::NEG_Y)
    }

    /// Whether a body with this number of grains will change by itself, and must not sleep.
    #[must_use]
    pub fn is_active(&self, grains: usize) -> bool {
        let has_room = grains < self.capacity.get() as usize;
        self.lifetime.get() < f32::INFINITY || (has_room && self.rate.get() > 0.0)
    }

    /// Largest distance from the center of the opening at the end of the tick in which something leaves
    /// it [m].
    pub(crate) fn way(&self, settings: &Settings) -> f64 {
        let seconds = settings.tick_seconds();
        let fall = settings.gravity.as_dvec3().length() * seconds;
        f64::from(self.opening.get()) + (f64::from(self.speed.get()) + fall) * seconds
    }

    /// What is emitted in a tick, beside a number of those that are `present`. `take` takes the place of
    /// one, unless it is not free.
    pub(crate) fn births(
        &self,
        flow: &mut Flow,
        present: usize,
        settings: &Settings,
        mut take: impl FnMut(&Birth) -> bool,
    ) -> Vec<Birth> {
        flow.ticks += 1;
        let waiting = flow.waiting();
        let before = flow.phase;
        let [rate, ticks] =
            [f64::from(self.rate.get()), settings.rate.get()].map(|it| (it / UNIT).round() as u64);
        flow.phase += rate;
        flow.due += flow.phase / ticks;
        flow.phase %= ticks;
        let room = (self.capacity.get() as usize).saturating_sub(present);
        let mut births = Vec::new();
        while births.len() < room && flow.waiting() > 0 {
            // Fraction of the tick that was left when the grain was due; `None` if it waited.
            let left = (births.len() as u64).checked_sub(waiting).map(|new| {
                let due = ((new + 1) * ticks).saturating_sub(before);
                1.0 - due as f64 / rate as f64
            });
            let number = flow.emitted;
            // One that waited tries other places in each tick.
            let tick = left.map_or(flow.ticks, |_| 0);
            let birth = (1..=TRIES)
                .map(|attempt| self.birth([number, attempt, tick], left, settings))
                .find(&mut take);
            let Some(birth) = birth else {
                break;
            };
            births.push(birth);
            flow.emitted += 1;
        }
        births
    }

    /// A grain by its number, the attempt and the tick if it has waited, at the end of a tick of which
    /// a fraction is `left` when it leaves the opening.
    fn birth(
        &self,
        [number, attempt, tick]: [u64; 3],
        left: Option<f64>,
        settings: &Settings,
    ) -> Birth {
        let mut radius = Draws::new([self.seed.get().into(), number, 0, 0]);
        let varied = f64::from(self.variation.get()) * radius.next();
        let radius = f64::from(self.radius.get()) * (1.0 - varied).max(MIN_RADIUS);
        let mut draws = Draws::new([self.seed.get().into(), number, attempt, tick]);
        let axis = self.axis();
        let (u, v) = axis.any_orthonormal_pair();
        let around = |angle: f64| {
            let (sin, cos) = libm::sincos(angle * core::f64::consts::TAU);
            u * cos + v * sin
        };
        // Even over the area of the opening, and over the solid angle of the cone.
        let arm = f64::from(self.opening.get()) * draws.next().sqrt();
        let place = around(draws.next()) * arm;
        let narrowest = libm::cos(f64::from(self.spread.get()).to_radians());
        let cos = 1.0 - draws.next() * (1.0 - narrowest);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let direction = axis * cos + around(draws.next()) * sin;
        let t = left.unwrap_or_else(|| draws.next()) * settings.tick_seconds();
        let velocity = direction * f64::from(self.speed.get());
        let fall = settings.gravity.as_dvec3() * t;
        let center = Finite::vector([self.x, self.y, self.z]);
        Birth {
            position: center + place + (velocity + fall / 2.0) * t,
            velocity: velocity + fall,
            radius: radius as f32,
        }
    }
}

/// The grains near an emitter, by cells that are as large as the largest grain.
struct Space {
    cell: f64,
    grains: BTreeMap<[i64; 3], Vec<(DVec3, f64)>>,
}

impl Space {
    fn of(
        emitter: &Emitter,
        present: impl Iterator<Item = (DVec3, f64)>,
        settings: &Settings,
    ) -> Self {
        let present: Vec<_> = present.collect();
        let largest = present.iter().fold(0.0, |all: f64, (_, r)| all.max(*r));
        let cell = 2.0 * largest.max(emitter.radius.get().into());
        let reach = emitter.way(settings) + cell;
        let center = Finite::vector([emitter.x, emitter.y, emitter.z]);
        let mut space = Self {
            cell,
            grains: BTreeMap::new(),
        };
        for (place, radius) in present {
            if (place - center).abs().max_element() <= reach {
                space.add(place, radius);
            }
        }
        space
    }

    fn cell(&self, place: DVec3) -> [i64; 3] {
        (place / self.cell).to_array().map(|it| it.floor() as i64)
    }

    fn add(&mut self, place: DVec3, radius: f64) {
        let cell = self.cell(place);
        self.grains.entry(cell).or_default().push((place, radius));
    }

    /// Takes the place of a grain, unless it touches another.
    fn take(&mut self, birth: &Birth) -> bool {
        let is_free = self.is_free(birth);
        if is_free {
            self.add(birth.position, birth.radius.into());
        }
        is_free
    }

    /// Whether a grain touches no other.
    fn is_free(&self, birth: &Birth) -> bool {
        let [x, y, z] = self.cell(birth.position);
        let touches = |&(place, radius): &(DVec3, f64)| {
            let distance = f64::from(birth.radius) + radius;
            place.distance_squared(birth.position) < distance * distance
        };
        (-1..=1).all(|dx| {
            (-1..=1).all(|dy| {
                let row = [x.saturating_add(dx), y.saturating_add(dy)];
                let from = [row[0], row[1], z.saturating_sub(1)];
                let to = [row[0], row[1], z.saturating_add(1)];
                let mut near = self.grains.range(from..=to).flat_map(|(_, all)| all);
                !near.any(touches)
            })
        })
    }
}
