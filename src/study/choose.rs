//! Chooses substeps and iterations for a goal: the cheapest setting that is accurate enough, or the
//! most accurate one that is cheap enough.
//!
//! Substeps usually reduce the error more than iterations at the same cost, but not always: for
//! soft bodies or large mass ratios, iterations can be better. Each number of iterations is tried,
//! and the substeps for it are found by doubling and bisection; a number of iterations is abandoned
//! as soon as it costs more than the best setting so far.
//!
//! Where the error is not monotonic in substeps, the best setting may be missed: a bounce happens
//! at the end of a substep, so its timing error varies irregularly with the number of substeps.

use super::{
    probe::{Probe, ProbeNews, ProbePoint},
    setting::{Setting, constraints},
};
use crate::solver::{InvalidValue, World};
use std::ops::ControlFlow;

/// What a setting is optimized for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Limit on the time per tick on one thread [ms].
    Milliseconds(f64),
    /// Limit on the constraint projections per tick.
    Projections(u64),
    /// Limit on the error: root mean square distance to the f64 reference, relative to the size of
    /// the body.
    Error(f64),
}

/// A chosen setting with the reason.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Choice {
    /// Substeps and iterations.
    pub setting: Setting,
    /// Its error, as in [`ProbePoint::error`].
    pub error: f64,
    /// Constraint projections per tick.
    pub projections_per_tick: u64,
    /// Whether it meets the goal; if not, it is the closest setting found.
    pub met: bool,
    /// The reason for the choice, in one sentence.
    pub reason: String,
    /// Number of settings tried.
    pub tried: usize,
}

/// Numbers of iterations to try.
const ITERATIONS: [u32; 5] = [1, 2, 4, 8, 16];

/// Limit on iterations per tick: beyond it, no realistic body is interactive.
pub const MAX_ITERATIONS_PER_TICK: u32 = 512;

/// Finds the setting that meets a goal best, for the next `seconds` of a world.
///
/// Reports each setting after it was tried. If the callback returns [`ControlFlow::Break`], the
/// search stops and returns `None`. It also returns `None` if the body diverged at every setting.
///
/// # Errors
/// [`InvalidValue`] if a setting is out of its range.
pub fn choose(
    world: &World,
    seconds: f64,
    goal: Goal,
    mut news: impl FnMut(ProbeNews) -> ControlFlow<()>,
) -> Result<Option<Choice>, InvalidValue> {
    match Probe::new(world, seconds, &mut news)? {
        Some(probe) => choose_from(&probe, goal, news),
        None => Ok(None),
    }
}

/// Like [`choose`], with an existing f64 reference.
///
/// # Errors
/// [`InvalidValue`] if a setting is out of its range.
pub fn choose_from(
    probe: &Probe,
    goal: Goal,
    news: impl FnMut(ProbeNews) -> ControlFlow<()>,
) -> Result<Option<Choice>, InvalidValue> {
    let mut search = Search {
        probe,
        tried: Vec::new(),
        news,
        stopped: false,
    };
    let chosen = match goal {
        Goal::Error(error) => search.cheapest(error)?,
        Goal::Projections(most) => search.most_exact(most, f64::INFINITY)?,
        Goal::Milliseconds(most) => {
            let here = Setting::xpbd(
                probe.world().settings.substeps.get(),
                probe.world().settings.iterations.get(),
            );
            let place = search.tried(here)?;
            let point = &search.tried[place];
            let affordable = most / search.milliseconds(point) * point.projections_per_tick as f64;
            search.most_exact(affordable as u64, most)?
        }
    };
    Ok(chosen.filter(|_| !search.stopped))
}

struct Search<'a, N> {
    probe: &'a Probe,
    tried: Vec<ProbePoint>,
    news: N,
    stopped: bool,
}

impl<N: FnMut(ProbeNews) -> ControlFlow<()>> Search<'_, N> {
    /// Index of a setting in the list of tried settings; tries it first if necessary.
    fn tried(&mut self, setting: Setting) -> Result<usize, InvalidValue> {
        let known = self.tried.iter().position(|point| point.setting == setting);
        if let Some(place) = known {
            return Ok(place);
        }
        let point = self.probe.point(setting)?;
        self.stopped |= (self.news)(ProbeNews::Point(point.clone())).is_break();
        self.tried.push(point);
        Ok(self.tried.len() - 1)
    }

    /// Time per tick [ms].
    fn milliseconds(&self, point: &ProbePoint) -> f64 {
        point.ms_per_second.median / self.probe.world().settings.rate.get()
    }

    /// The setting with the fewest iterations whose error is at most `error`.
    fn cheapest(&mut self, error: f64) -> Result<Option<Choice>, InvalidValue> {
        let mut best: Option<(u32, Setting)> = None;
        let mut totals = Vec::new();
        for iterations in ITERATIONS {
            let limit = best.map_or(MAX_ITERATIONS_PER_TICK, |(total, _)| total - 1);
            let found = self.fewest_substeps(iterations, limit / iterations, error)?;
            if self.stopped {
                return Ok(None);
            }
            if let Some(substeps) = found {
                let total = substeps * iterations;
                best = Some((total, Setting::xpbd(substeps, iterations)));
                totals.push((iterations, total));
            }
        }
        let Some((total, setting)) = best else {
            let reason = format!(
                "No setting of up to {MAX_ITERATIONS_PER_TICK} iterations per tick is that accurate."
            );
            return Ok(self.nearest(reason));
        };
        let reason = match totals.first() {
            Some(&(1, plain)) if setting.iterations > 1 => format!(
                "With one iteration per substep it would take {plain} iterations per tick instead of \
                 {total}: more iterations are more efficient here."
            ),
            _ if setting.iterations > 1 => format!(
                "Substeps alone do not reach the goal within {MAX_ITERATIONS_PER_TICK} iterations per tick; with \
                 more iterations per substep, {total} suffice."
            ),
            _ if setting.substeps == 1 => "No setting is cheaper.".to_owned(),
            _ => format!(
                "No number of iterations per substep needs fewer than {total} iterations per tick: \
                 substeps are more efficient here."
            ),
        };
        self.chosen(setting, true, reason)
    }

    /// The fewest substeps, up to `most`, whose error is at most `error`: by doubling, then by
    /// bisection, because more substeps rarely increase the error.
    fn fewest_substeps(
        &mut self,
        iterations: u32,
        most: u32,
        error: f64,
    ) -> Result<Option<u32>, InvalidValue> {
        let (mut too_few, mut enough) = (0, None);
        let mut next = 1;
        while next <= most && !self.stopped {
            let place = self.tried(Setting::xpbd(next, iterations))?;
            if self.tried[place].error <= error {
                enough = Some(next);
                break;
            }
            too_few = next;
            // The limit itself is tried as well.
            next = match next * 2 {
                double if double > most && next < most => most,
                double => double,
            };
        }
        while let Some(upper) = enough
            && upper - too_few > 1
            && !self.stopped
        {
            let middle = u32::midpoint(too_few, upper);
            let place = self.tried(Setting::xpbd(middle, iterations))?;
            if self.tried[place].error <= error {
                enough = Some(middle);
            } else {
                too_few = middle;
            }
        }
        Ok(enough)
    }

    /// The setting with the smallest error within these limits of projections and milliseconds per
    /// tick.
    fn most_exact(
        &mut self,
        projections: u64,
        milliseconds: f64,
    ) -> Result<Option<Choice>, InvalidValue> {
        let per_iteration = constraints(self.probe.world()).max(1) as u64;
        let total = u32::try_from(projections / per_iteration).unwrap_or(u32::MAX);
        let mut best: Option<(f64, Setting)> = None;
        for iterations in ITERATIONS {
            let mut substeps = total.min(MAX_ITERATIONS_PER_TICK) / iterations;
            // Tries again with fewer substeps if a substep costs more than its iterations.
            for _ in 0..2 {
                if substeps == 0 || self.stopped {
                    break;
                }
                let setting = Setting::xpbd(substeps, iterations);
                let place = self.tried(setting)?;
                let point = &self.tried[place];
                let (cost, error) = (self.milliseconds(point), point.error);
                if cost <= milliseconds {
                    if error.is_finite() && best.is_none_or(|(least, _)| error < least) {
                        best = Some((error, setting));
                    }
                    break;
                }
                substeps = (f64::from(substeps) * milliseconds / cost) as u32;
            }
        }
        if self.stopped {
            return Ok(None);
        }
        let Some((_, setting)) = best else {
            let setting = Setting::xpbd(1, 1);
            self.tried(setting)?;
            let reason = "A single iteration per tick costs more than that.".to_owned();
            return self.chosen(setting, false, reason);
        };
        let reason = match setting.iterations {
            1 => "More iterations with fewer substeps would be less accurate.".to_owned(),
            _ => "More substeps with fewer iterations would be less accurate.".to_owned(),
        };
        self.chosen(setting, true, reason)
    }

    /// The most accurate setting tried, where none meets the goal.
    fn nearest(&mut self, reason: String) -> Option<Choice> {
        let finite = self.tried.iter().filter(|point| point.error.is_finite());
        let setting = finite.min_by(|a, b| a.error.total_cmp(&b.error))?.setting;
        self.chosen(setting, false, reason).ok().flatten()
    }

    fn chosen(
        &mut self,
        setting: Setting,
        met: bool,
        reason: String,
    ) -> Result<Option<Choice>, InvalidValue> {
        let place = self.tried(setting)?;
        let point = &self.tried[place];
        Ok(point.error.is_finite().then_some(Choice {
            setting,
            error: point.error,
            projections_per_tick: point.projections_per_tick,
            met,
            reason,
            tried: self.tried.len(),
        }))
    }
}
