//! The clock of the simulation: pause, single steps, speed, and a limit on catching up.

use super::DrawnInstant;
use bevy::prelude::*;
use std::time::Duration;

/// Durations are whole nanoseconds: a tick that is due within 1 ns [s] counts as due.
const NANOSECOND: f64 = 1e-9;

/// Steps of a fixed schedule and ticks are multiples of each other if they are within this part. Steps
/// are whole nanoseconds: of at least 1 ms, they are off by half of it.
const MULTIPLE: f64 = 1e-6;

/// Maximum number of ticks in the time between the drawn and the current state, so that memory has a
/// bound.
const MAX_PAST: usize = 32;

/// The clock of a tick: `Res<Time<Tick>>`, and `Res<Time>` inside
/// [`StepSchedule`](super::StepSchedule).
#[derive(Debug, Clone, Copy, Default)]
pub struct Tick;

/// The clock of a substep: `Res<Time<SubstepTime>>`, and `Res<Time>` inside
/// [`SubstepSchedule`](super::SubstepSchedule).
#[derive(Debug, Clone, Copy, Default)]
pub struct SubstepTime;

/// Controls when ticks happen. Changes take effect at the next tick.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// /// The space bar pauses, and slow motion is an eighth of real time.
/// fn control(keys: Res<ButtonInput<KeyCode>>, mut clock: ResMut<SimulationClock>) {
///     if keys.just_pressed(KeyCode::Space) {
///         clock.paused = !clock.paused;
///     }
///     clock.speed = if keys.pressed(KeyCode::ShiftLeft) { 0.125 } else { 1.0 };
/// }
/// # bevy::ecs::system::assert_is_system(control);
/// ```
#[derive(Resource, Debug, Clone)]
pub struct SimulationClock {
    /// Whether the simulation is paused; default false.
    pub paused: bool,
    /// Simulated seconds per real second, between 0 and 100; default 1. The length of a tick does
    /// not depend on it.
    pub speed: f64,
    /// Maximum real time to catch up in one run of the outer schedule; default 0.25 s. Ticks beyond
    /// it are dropped, so that a slow computer shows slow motion and never stalls.
    pub catch_up: Duration,
    /// Real time after which no further tick begins in one run of the outer schedule; default
    /// 50 ms. The others are caught up in the next runs or dropped, so that a hitch does not make
    /// the frame after it as long. A tick is never interrupted because of it. With it, the number of
    /// ticks in a run depends on the machine; none for an app that sets its own time.
    pub limit: Option<Duration>,
    /// Real time for ticks in one run of the outer schedule; default none. Longer ticks are spread
    /// over several runs, which keeps a window responsive at any cost of a tick.
    pub budget: Option<Duration>,
    /// Real time for which an action may wait for the end of a tick that is spread over several
    /// runs; default none. A tick that takes longer ends early, after a whole substep, and
    /// triggers [`EndedEarly`](super::EndedEarly): a program remains responsive at any cost of a
    /// tick, at the price of ticks of unequal length. A substep is never interrupted.
    pub patience: Option<Duration>,
    /// Whether no tick may begin until a follower of the simulation, such as the reference overlay,
    /// has caught up; default false. A tick under way is finished. Ticks that become due meanwhile
    /// are dropped.
    pub held: bool,
    /// Real time by which each run of the outer schedule advances instead of the measured one;
    /// default none. For films, which run evenly although drawing is slow: a run advances only when
    /// the ticks of the one before are done, and not sooner than this time after it.
    pub film_step: Option<Duration>,
    /// Time since the start of the scene [s].
    pub(super) time: f64,
    /// Ticks since the start of the scene.
    pub(super) tick: u64,
    /// The next substep, while a tick is under way.
    pub(super) next_substep: Option<u32>,
    waiting: f64,
    /// Time of the frame that a fixed schedule has not run for yet [s].
    ahead: f64,
    /// Time of a run of a fixed schedule [s]; none in other schedules.
    fixed_step: Option<f64>,
    tick_seconds: f64,
    steps_requested: u32,
    dropped: u64,
    /// Measured time since the last step of a film.
    film_waited: Duration,
    film_steps: u64,
}

impl Default for SimulationClock {
    fn default() -> Self {
        Self {
            paused: false,
            speed: 1.0,
            catch_up: Duration::from_millis(250),
            limit: Some(Duration::from_millis(50)),
            budget: None,
            patience: None,
            held: false,
            film_step: None,
            time: 0.0,
            tick: 0,
            next_substep: None,
            waiting: 0.0,
            ahead: 0.0,
            fixed_step: None,
            tick_seconds: 1.0 / 60.0,
            steps_requested: 0,
            dropped: 0,
            film_waited: Duration::ZERO,
            film_steps: 0,
        }
    }
}

impl SimulationClock {
    /// Simulated time since the start of the scene [s].
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// Ticks since the start of the scene.
    #[must_use]
    pub const fn tick(&self) -> u64 {
        self.tick
    }

    /// Whether a tick is under way, interrupted because of the `budget`.
    #[must_use]
    pub const fn mid_tick(&self) -> bool {
        self.next_substep.is_some()
    }

    /// Number of dropped ticks since the start of the scene.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Number of steps of a film whose ticks are done: see [`film_step`](Self::film_step).
    #[must_use]
    pub fn film_steps(&self) -> u64 {
        self.film_steps - u64::from(self.is_behind() && self.film_steps > 0)
    }

    /// Whether a tick is under way or due.
    fn is_behind(&self) -> bool {
        self.mid_tick() || self.waiting + NANOSECOND >= self.tick_seconds
    }

    /// Requests one tick, even while paused.
    pub fn step_once(&mut self) {
        self.steps_requested += 1;
    }

    /// Fraction of the next tick that has passed in real time, from 0 to 1: draw bodies
    /// interpolated by it between [`TickStart`](super::TickStart) and their current state. 0 in
    /// mid-tick, 1 when paused. In one of Bevy's fixed schedules it includes the time of the frame
    /// for which that schedule has not run yet; if it is at 1 there for several frames, as its rate
    /// is not that of the ticks, [`drawn`](Self::drawn) is even.
    #[must_use]
    pub fn overstep(&self) -> f32 {
        if self.mid_tick() {
            0.0
        } else if self.paused {
            1.0
        } else {
            let waiting = self.waiting + self.ahead * self.bounded_speed();
            (waiting / self.tick_seconds).clamp(0.0, 1.0) as f32
        }
    }

    /// The instant that is drawn, for [`PastStarts::positions`](super::PastStarts::positions). It
    /// advances by the time of the frame in each frame, as far as ticks keep up, except where the speed
    /// or the pause changes: there it jumps by up to the time by which it is behind.
    ///
    /// It is behind real time by the length of a tick. In one of Bevy's fixed schedules, it is behind
    /// by the longer of the tick and the step of the schedule if one is a multiple of the other, and
    /// else by both together: one tick at 60, 120 or 240 Hz with 60 ticks per second, 0.1 s at
    /// 10 Hz, 32.3 ms at 64 Hz. With more than 33 ticks in that time, drawing is not even.
    ///
    /// In mid-tick, it is not after the start of that tick; when paused, it is the current state.
    #[must_use]
    pub fn drawn(&self) -> DrawnInstant {
        let lag = self.lag();
        if lag == 0.0 || self.paused {
            let fraction = self.overstep();
            return DrawnInstant {
                ticks_back: 0,
                fraction,
            };
        }
        let waiting = self.waiting + self.ahead * self.bounded_speed();
        let ticks = (waiting - lag) / self.tick_seconds;
        let most = if self.mid_tick() { 0.0 } else { 1.0 };
        let ticks = ticks.clamp(-(MAX_PAST as f64), most);
        let ticks_back = (-ticks).ceil().max(0.0);
        DrawnInstant {
            ticks_back: ticks_back as usize,
            fraction: (ticks + ticks_back) as f32,
        }
    }

    /// Simulated time by which drawing is behind real time, beyond a tick [s]. A fixed schedule does
    /// not run for a step, in which the drawn instant must not come to the current state.
    fn lag(&self) -> f64 {
        let Some(step) = self.fixed_step else {
            return 0.0;
        };
        let step = step * self.bounded_speed();
        Fit::of(step, self.tick_seconds).map_or(step, |fit| fit.excess)
    }

    /// Number of states before that at the start of the last tick which drawing needs.
    pub(super) fn past_starts(&self) -> usize {
        // Rounding makes no tick more.
        let ticks = (self.lag() / self.tick_seconds - MULTIPLE).ceil();
        (ticks.max(0.0) as usize).min(MAX_PAST)
    }

    /// The speed, in its valid range.
    fn bounded_speed(&self) -> f64 {
        if self.speed.is_finite() {
            self.speed.clamp(0.0, 100.0)
        } else {
            1.0
        }
    }

    /// Resets the clock to the start of a scene; pause, speed and limits are kept.
    pub fn restart(&mut self) {
        *self = Self {
            paused: self.paused,
            speed: self.speed,
            catch_up: self.catch_up,
            limit: self.limit,
            budget: self.budget,
            patience: self.patience,
            film_step: self.film_step,
            film_steps: self.film_steps,
            fixed_step: self.fixed_step,
            tick_seconds: self.tick_seconds,
            ..Self::default()
        };
    }

    /// Advances by `real` time, with ticks of `tick_seconds`.
    pub(super) fn advance(&mut self, real: Duration, tick_seconds: f64) {
        self.tick_seconds = tick_seconds;
        if self.paused {
            return;
        }
        let speed = self.bounded_speed();
        let passed = match self.film_step {
            None => real,
            Some(step) => self.film(real, step),
        };
        let passed = passed.as_secs_f64() * speed;
        self.waiting += passed;
        if self.fixed_step.is_some()
            && let Some(fit) = Fit::of(passed, tick_seconds)
        {
            // Ticks stay in step with the schedule, whatever their phase was at another speed.
            self.waiting = (self.waiting / fit.shorter).round() * fit.shorter;
        }
        // One more than the limit may be pending, so that a tick that is slightly late is not
        // dropped.
        let bound = match self.held {
            true => 1.0,
            false => (self.catch_up.as_secs_f64() * speed / tick_seconds).max(1.0),
        };
        let most = bound + 1.0;
        let due = self.waiting / tick_seconds;
        if due > most {
            let dropped = (due - most).ceil();
            self.dropped += dropped as u64;
            self.waiting -= dropped * tick_seconds;
        }
    }

    /// The step of a film, or nothing if it is too early.
    fn film(&mut self, real: Duration, step: Duration) -> Duration {
        // What is too late is not caught up.
        self.film_waited = (self.film_waited + real).min(2 * step);
        if self.held || self.is_behind() || self.film_waited < step {
            return Duration::ZERO;
        }
        self.film_waited -= step;
        self.film_steps += 1;
        step
    }

    /// Whether a tick is due; removes it from the pending ones.
    pub(super) fn take_tick(&mut self) -> bool {
        if self.held {
            return false;
        }
        if self.steps_requested > 0 {
            self.steps_requested -= 1;
            return true;
        }
        if self.paused || self.waiting + NANOSECOND < self.tick_seconds {
            return false;
        }
        self.waiting = (self.waiting - self.tick_seconds).max(0.0);
        true
    }
}

/// A fixed schedule whose step is a multiple or a whole part of a tick.
struct Fit {
    /// The shorter of step and tick, of which the other is a multiple [s].
    shorter: f64,
    /// How much longer a step is than a tick [s].
    excess: f64,
}

impl Fit {
    fn of(step: f64, tick: f64) -> Option<Self> {
        let of_long_steps = multiple(step, tick).map(|ticks| Self {
            shorter: tick,
            excess: (ticks - 1.0) * tick,
        });
        of_long_steps.or_else(|| {
            multiple(tick, step).map(|steps| Self {
                shorter: tick / steps,
                excess: 0.0,
            })
        })
    }
}

/// How many times `part` is in `whole`, if it is a whole number of times.
fn multiple(whole: f64, part: f64) -> Option<f64> {
    let times = whole / part;
    let nearest = times.round();
    let is_whole = nearest >= 1.0 && (times - nearest).abs() <= MULTIPLE * times;
    is_whole.then_some(nearest)
}

/// After the fixed schedules of a frame: notes the time for which they have not run yet.
pub(super) fn look_ahead(fixed: Res<Time<Fixed>>, mut clock: ResMut<SimulationClock>) {
    clock.ahead = fixed.overstep().as_secs_f64();
    clock.fixed_step = Some(fixed.timestep().as_secs_f64());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of 25 frames per second of a simulation of 60 ticks per second.
    #[test]
    fn a_film_advances_evenly_however_fast_frames_are_drawn() {
        const TICK: f64 = 1.0 / 60.0;
        for (real, at_least) in [(4, 19), (16, 19), (40, 50), (300, 50)] {
            let mut clock = SimulationClock {
                film_step: Some(Duration::from_millis(40)),
                ..SimulationClock::default()
            };
            let (mut steps, mut ticks) = (0, 0_u32);
            // At 4 ms a frame, fifty frames are 200 ms.
            let frames = if real == 4 { 200 } else { 50 };
            for _ in 0..frames {
                clock.advance(Duration::from_millis(real), TICK);
                while clock.take_tick() {
                    ticks += 1;
                }
                steps = clock.film_steps();
                let due = (steps as f64 * 0.04 / TICK + 1e-6).floor();
                assert_eq!(f64::from(ticks), due, "{real} ms: step {steps}");
            }
            assert!(steps >= at_least, "{real} ms: {steps} steps");
            assert!(
                steps <= frames * real.min(40) / 40,
                "{real} ms: {steps} steps"
            );
        }
    }

    #[test]
    fn a_film_waits_for_slow_ticks() {
        let mut clock = SimulationClock {
            film_step: Some(Duration::from_millis(40)),
            ..SimulationClock::default()
        };
        let slow = Duration::from_millis(500);
        clock.advance(slow, 1.0 / 60.0);
        assert!(clock.take_tick());
        clock.advance(slow, 1.0 / 60.0);
        assert_eq!(clock.film_steps(), 0, "its second tick is due");
        assert!(clock.take_tick());
        assert_eq!(clock.film_steps(), 1);
        assert!(!clock.take_tick());
    }
}
