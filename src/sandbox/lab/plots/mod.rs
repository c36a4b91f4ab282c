//! Plots in the window: figures over the last ten seconds of simulated time, and the force of the
//! grab over the displacement of the grabbed point.
//!
//! Both take in every tick, whether they are shown or not; they only read the simulation.

mod card;
pub mod curve;
pub mod figures;

pub use card::{Card, Shown, show};

use crate::{
    output::series::{Multiples, Series},
    sandbox::{
        lab::throughput::Throughput,
        state::{
            request::{Request, Requested},
            view::ViewSettings,
        },
        ui::{WidgetRects, area},
    },
    scene::CurrentScene,
    simulation::{SimulationSettings, Statistics, StepSchedule, StepSystems, TickStart},
    solver::{EffectStates, Grab, Particles, SurfacePoint},
};
use bevy::prelude::*;
use bevy_egui::{EguiContext, EguiPrimaryContextPass, PrimaryEguiContext};
use curve::ForceCurve;
use figures::{FIGURES, Figure, Sample, Track, find};

/// A command to the plots, from their own widgets or from a key.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotCommand {
    /// Opens or closes the plots over time.
    Toggle,
    /// Shows or hides a figure, by its name.
    Figure(&'static str),
    /// Stops taking in ticks (`true`), to read the plots, or goes on.
    Freeze(bool),
    /// Shows or hides the force–displacement curve.
    Curve(bool),
}

/// The plots.
#[derive(Resource, Debug)]
pub struct Plots {
    open: bool,
    /// Whether the force–displacement curve is shown.
    curve_shown: bool,
    frozen: bool,
    chosen: Vec<&'static str>,
    track: Track,
    curve: Option<ForceCurve>,
    /// The grabbed body and point.
    grabbed: Option<(Entity, SurfacePoint)>,
    /// Frames per second, smoothed.
    frame_rate: f64,
}

impl Default for Plots {
    fn default() -> Self {
        Self {
            open: false,
            curve_shown: true,
            frozen: false,
            chosen: vec!["held_energy_j", "volume_error_percent", "residual"],
            track: Track::default(),
            curve: None,
            grabbed: None,
            frame_rate: 0.0,
        }
    }
}

impl Plots {
    /// Whether the plots over time are open.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    /// The chosen figures, in the order of the menu.
    fn figures(&self) -> Vec<&'static Figure> {
        let is_chosen = |figure: &&Figure| self.chosen.contains(&figure.name);
        FIGURES.iter().filter(is_chosen).collect()
    }

    /// The chosen figures for export; `None` if there is nothing to export.
    #[must_use]
    pub fn multiples(&self, title: &str) -> Option<Multiples> {
        let samples = || self.track.samples();
        let series = |figure: &&'static Figure| Series {
            name: figure.name.to_owned(),
            label: labelled(figure),
            values: samples()
                .map(|sample| (figure.value)(sample).unwrap_or(f64::NAN))
                .collect(),
        };
        let curves: Vec<Series> = self.figures().iter().map(series).collect();
        let axis = Series {
            name: "time_s".to_owned(),
            label: "time [s]".to_owned(),
            values: samples().map(|sample| sample.statistics.time).collect(),
        };
        let is_empty = curves.is_empty() || axis.values.is_empty();
        (!is_empty).then(|| Multiples {
            title: title.to_owned(),
            axis,
            curves,
        })
    }

    /// The force–displacement curve for export; `None` without one.
    #[must_use]
    pub fn force_curve(&self, title: &str) -> Option<Multiples> {
        let curve = self.curve.as_ref()?;
        let column = |axis: usize, name: &str, label: &str, factor: f64| Series {
            name: name.to_owned(),
            label: label.to_owned(),
            values: curve.points().iter().map(|it| it[axis] * factor).collect(),
        };
        (!curve.points().is_empty()).then(|| Multiples {
            title: format!("{title}: {}", curve.body),
            axis: column(0, "displacement_mm", "displacement [mm]", 1e3),
            curves: vec![column(1, "force_n", "force [N]", 1.0)],
        })
    }
}

/// Title of a figure with its unit.
fn labelled(figure: &Figure) -> String {
    match figure.unit {
        "" => figure.title.to_owned(),
        unit => format!("{} [{unit}]", figure.title),
    }
}

/// Widget rectangles of the plots, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct PlotRects(pub WidgetRects);

/// Shows the plots.
pub struct PlotsPlugin;

impl Plugin for PlotsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Plots>()
            .init_resource::<PlotRects>()
            .init_resource::<Throughput>()
            .add_message::<PlotCommand>()
            .add_message::<Requested>()
            .add_systems(
                StepSchedule,
                (take_in, pull)
                    .chain()
                    .after(StepSystems::End)
                    // They only read the simulation, as everything else after the end of a tick.
                    .ambiguous_with_all()
                    .run_if(tick_ended),
            )
            .add_systems(Update, (forget, obey, measure_frames).chain())
            .add_systems(EguiPrimaryContextPass, draw);
    }
}

fn tick_ended(clock: Res<crate::simulation::SimulationClock>) -> bool {
    !clock.mid_tick()
}

/// Takes in the figures of the tick that has just ended.
fn take_in(mut plots: ResMut<Plots>, statistics: Res<Statistics>, throughput: Res<Throughput>) {
    if plots.frozen {
        return;
    }
    let sample = Sample {
        statistics: statistics.clone(),
        frames_per_second: plots.frame_rate,
        projections: throughput.per_second(),
    };
    plots.bypass_change_detection().track.push(sample);
}

/// Follows the grab with the force–displacement curve.
fn pull(
    mut plots: ResMut<Plots>,
    settings: Res<SimulationSettings>,
    grabs: Query<(
        Entity,
        &Grab,
        &Particles,
        &TickStart,
        &EffectStates,
        Option<&Name>,
    )>,
) {
    let plots = plots.bypass_change_detection();
    let Some((body, grab, particles, start, states, name)) = grabs.iter().next() else {
        plots.grabbed = None;
        if let Some(curve) = &mut plots.curve {
            curve.live = false;
        }
        return;
    };
    if plots.grabbed != Some((body, grab.point)) {
        plots.grabbed = Some((body, grab.point));
        let name = name.map_or_else(String::new, |name| name.to_string());
        let from = grab.point.position(&start.positions);
        plots.curve = Some(ForceCurve::new(name, from));
    }
    let h = settings.substep_seconds() as f32;
    if let Some(curve) = &mut plots.curve {
        let point = grab.point.position(&particles.positions);
        curve.push(point, states.others.grab.force(h));
    }
}

/// Discards what belongs to another scene.
fn forget(scene: Option<Res<CurrentScene>>, mut plots: ResMut<Plots>) {
    if scene.is_some_and(|scene| scene.is_changed()) {
        plots.track.clear();
        plots.curve = None;
        plots.grabbed = None;
        plots.frozen = false;
    }
}

fn obey(mut commands: MessageReader<PlotCommand>, mut plots: ResMut<Plots>) {
    for command in commands.read() {
        match *command {
            PlotCommand::Toggle => plots.open = !plots.open,
            PlotCommand::Freeze(frozen) => plots.frozen = frozen,
            PlotCommand::Curve(shown) => plots.curve_shown = shown,
            PlotCommand::Figure(name) => {
                let before = plots.chosen.len();
                plots.chosen.retain(|it| *it != name);
                if plots.chosen.len() == before && find(name).is_some() {
                    plots.chosen.push(name);
                }
            }
        }
    }
}

/// Smooths the frame rate over about half a second.
fn measure_frames(time: Res<Time<Real>>, mut plots: ResMut<Plots>) {
    let seconds = time.delta_secs_f64();
    if seconds > 0.0 {
        let plots = plots.bypass_change_detection();
        let fraction = (seconds / 0.5).min(1.0);
        plots.frame_rate += (1.0 / seconds - plots.frame_rate) * fraction;
    }
}

fn draw(world: &mut World) -> Result {
    let context = world
        .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
        .single_mut(world)?
        .get_mut()
        .clone();
    let plots = world.resource::<Plots>();
    let curve = plots.curve.as_ref().filter(|_| plots.curve_shown);
    if !plots.open && curve.is_none() {
        world.resource_mut::<PlotRects>().0.clear();
        return Ok(());
    }
    let card = Card {
        over_time: plots.open.then(|| {
            let shown = |figure: &'static Figure| Shown {
                figure,
                points: plots.track.points(figure),
            };
            plots.figures().into_iter().map(shown).collect()
        }),
        end: plots.track.end().unwrap_or(0.0),
        frozen: plots.frozen,
        curve: curve.cloned(),
        curve_shown: plots.curve_shown,
    };
    let free = area::free(&context, world.resource::<ViewSettings>());
    let answer = show(&context, &card, free);
    for command in answer.commands {
        world.write_message(command);
    }
    if answer.export {
        world.write_message(Requested(Request::ExportPlots));
    }
    let mut rects = world.resource_mut::<PlotRects>();
    if rects.0 != answer.places {
        rects.0 = answer.places;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plots() -> Plots {
        let mut plots = Plots::default();
        for tick in 0..3 {
            let statistics = Statistics {
                tick,
                time: tick as f64,
                kinetic: 2.0 * tick as f64,
                ..Statistics::default()
            };
            plots.track.push(Sample {
                statistics,
                ..Sample::default()
            });
        }
        plots
    }

    #[test]
    fn what_is_chosen_is_exported_with_its_unit_and_missing_values() {
        let mut plots = plots();
        plots.chosen = vec!["contacts", "kinetic_j"];
        let multiples = plots.multiples("cube").expect("there are figures");
        assert_eq!(multiples.axis.values, [0.0, 1.0, 2.0]);
        let [kinetic, contacts] = &multiples.curves[..] else {
            panic!("two figures");
        };
        assert_eq!(kinetic.label, "Kinetic energy [J]");
        assert_eq!(kinetic.values, [0.0, 2.0, 4.0]);
        assert!(contacts.values.iter().all(|value| value.is_nan()));
    }

    #[test]
    fn nothing_is_exported_without_ticks_or_figures() {
        assert!(Plots::default().multiples("cube").is_none());
        let mut plots = plots();
        plots.chosen.clear();
        assert!(plots.multiples("cube").is_none());
        assert!(plots.force_curve("cube").is_none());
    }
}
