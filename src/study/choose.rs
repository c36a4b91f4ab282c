//! Chooses substeps and iterations for a goal: the cheapest setting that is exact enough, or the
//! most exact one that is cheap enough.
//!
//! Substeps are mostly the better buy, but not always: where a body is soft, or heavy on light,
//! iterations can be. So each number of iterations is tried, and for each the substeps are found
//! by doubling and halving; a number of iterations is given up as soon as it costs more than the
//! best setting known.
//!
//! Where the error does not fall steadily with substeps, the best may be missed: what bounces does so
//! at the end of a substep, and whether that is near the true time is luck.

use super::{
    probe::{Probe, ProbeNews, ProbePoint},
    setting::{Setting, constraints},
};
use crate::solver::{InvalidValue, World};
use std::ops::ControlFlow;

/// What a setting is to be good for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// A tick takes at most so long on one thread [ms].
    Milliseconds(f64),
    /// A tick takes at most so many projections of constraints.
    Projections(u64),
    /// The error is at most this: root mean square distance to the f64 reference, over the body's size.
    Error(f64),
}

/// A setting that was chosen, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Substeps and iterations.
    pub setting: Setting,
    /// Its error, as of [`ProbePoint::error`].
    pub error: f64,
    /// What it costs.
    pub projections_per_tick: u64,
    /// Whether it meets the goal; if not, it is the nearest that was found.
    pub met: bool,
    /// Why this one, in a sentence.
    pub reason: String,
    /// How many settings were tried.
    pub tried: usize,
}

/// Numbers of iterations that are tried.
const ITERATIONS: [u32; 5] = [1, 2, 4, 8, 16];

/// Sweeps a tick at most: what costs more is not interactive for any body worth the name.
pub const MAX_SWEEPS: u32 = 512;

/// Looks for the setting that meets a goal best, for a world that goes on for `seconds`.
///
/// Tells each setting when it was tried; when it is told [`ControlFlow::Break`] in return, it stops
/// and gives nothing. Gives nothing, too, if the body blew up whatever was tried.
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

/// The same, where the f64 reference is there already.
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
    /// Place of a setting among what was tried; it is tried if it was not.
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

    /// Time of a tick [ms].
    fn milliseconds(&self, point: &ProbePoint) -> f64 {
        point.ms_per_second.median / self.probe.world().settings.rate.get()
    }

    /// The setting with the fewest sweeps whose error is at most `error`.
    fn cheapest(&mut self, error: f64) -> Result<Option<Choice>, InvalidValue> {
        let mut best: Option<(u32, Setting)> = None;
        let mut sweeps_of = Vec::new();
        for iterations in ITERATIONS {
            let limit = best.map_or(MAX_SWEEPS, |(sweeps, _)| sweeps - 1);
            let found = self.fewest_substeps(iterations, limit / iterations, error)?;
            if self.stopped {
                return Ok(None);
            }
            if let Some(substeps) = found {
                let sweeps = substeps * iterations;
                best = Some((sweeps, Setting::xpbd(substeps, iterations)));
                sweeps_of.push((iterations, sweeps));
            }
        }
        let Some((sweeps, setting)) = best else {
            let reason =
                format!("No setting of up to {MAX_SWEEPS} iterations per tick is that accurate.");
            return Ok(self.nearest(reason));
        };
        let reason = match sweeps_of.first() {
            Some(&(1, plain)) if setting.iterations > 1 => format!(
                "With one iteration per substep it would take {plain} iterations per tick instead of \
                 {sweeps}: more iterations are more efficient here."
            ),
            _ if setting.iterations > 1 => format!(
                "Substeps alone do not reach the goal within {MAX_SWEEPS} iterations per tick; with \
                 more iterations per substep, {sweeps} suffice."
            ),
            _ if setting.substeps == 1 => "No setting is cheaper.".to_owned(),
            _ => format!(
                "No number of iterations per substep needs fewer than {sweeps} iterations per tick: \
                 substeps are more efficient here."
            ),
        };
        self.chosen(setting, true, reason)
    }

    /// The fewest substeps, up to `most`, whose error is at most `error`: by doubling, then by
    /// halving the gap, as more substeps are seldom worse.
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
            // The last one before the limit is tried as well.
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

    /// The setting of the least error among those of at most so many projections and
    /// milliseconds a tick.
    fn most_exact(
        &mut self,
        projections: u64,
        milliseconds: f64,
    ) -> Result<Option<Choice>, InvalidValue> {
        let a_sweep = constraints(self.probe.world()).max(1) as u64;
        let sweeps = u32::try_from(projections / a_sweep).unwrap_or(u32::MAX);
        let mut best: Option<(f64, Setting)> = None;
        for iterations in ITERATIONS {
            let mut substeps = sweeps.min(MAX_SWEEPS) / iterations;
            // One more try, with fewer, if substeps cost more than their sweeps.
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

    /// The most exact of all that was tried, where none meets the goal.
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
