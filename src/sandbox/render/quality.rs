//! Quality of the picture: shadows, smoothed edges and the [resolution](super::reduced) of the
//! window, or none of them.
//!
//! With [`Quality::Auto`], a software renderer starts with low quality; afterwards the measured
//! frame time decides, with hysteresis. Frames in which the simulation takes most of the time do
//! not count, as another quality would not shorten them.

use crate::{
    sandbox::{
        render::{camera::OrbitCamera, stage::is_software},
        state::{
            activity::Activity,
            display::{DisplaySettings, Quality},
        },
    },
    simulation::SoftBodySystems,
};
use bevy::{light::ShadowFilteringMethod, prelude::*, render::renderer::RenderAdapterInfo};
use std::time::{Duration, Instant};

/// Frame time above which the quality is lowered [s].
const SLOW: f32 = 1.0 / 25.0;
/// Frame time below which the quality may be raised [s].
const FAST: f32 = 1.0 / 50.0;
/// Time of slow frames after which the quality is lowered [s].
const SLOW_FOR: f32 = 2.0;
/// Time of fast frames after which the quality is raised for the first time [s]. Doubles each time,
/// so that a computer between the two does not switch forever.
const FAST_FOR: f32 = 30.0;
/// Longer frames are stalls, such as the compilation of a shader, and do not count [s].
const STALL: f32 = 1.0;
/// Part of a frame that ticks may take for the frame to count.
const MAX_TICKS: f32 = 0.6;

/// The quality in which the picture is drawn.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EffectiveQuality {
    /// No shadows, no smoothed edges, a lower resolution.
    Low,
    /// Shadows, smoothed edges, and the resolution of the window.
    #[default]
    High,
}

/// Chooses the quality by the frame time.
#[derive(Resource, Debug, Clone, PartialEq)]
struct Governor {
    low: bool,
    slow: f32,
    fast: f32,
    fast_for: f32,
}

impl Default for Governor {
    fn default() -> Self {
        Self {
            low: false,
            slow: 0.0,
            fast: 0.0,
            fast_for: FAST_FOR,
        }
    }
}

impl Governor {
    /// Counts a frame of a duration, of which ticks took a part [s].
    fn pass(&mut self, frame: f32, ticks: f32) {
        if frame > STALL || ticks > MAX_TICKS * frame {
            return;
        }
        if self.low {
            self.fast = if frame < FAST { self.fast + frame } else { 0.0 };
            if self.fast > self.fast_for {
                (self.low, self.slow) = (false, 0.0);
                self.fast_for *= 2.0;
            }
        } else {
            let change = if frame > SLOW { frame } else { -frame };
            self.slow = (self.slow + change).max(0.0);
            if self.slow > SLOW_FOR {
                (self.low, self.fast) = (true, 0.0);
            }
        }
    }
}

/// Real time that the ticks of a frame take.
#[derive(Resource, Debug, Default)]
struct TickTime {
    begun: Option<Instant>,
    spent: Duration,
}

/// Chooses and applies the quality.
pub struct QualityPlugin;

impl Plugin for QualityPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<DisplaySettings>()
            .init_resource::<EffectiveQuality>()
            .init_resource::<Activity>()
            .init_resource::<Governor>()
            .init_resource::<TickTime>()
            .add_systems(Startup, start)
            .add_systems(Update, (choose, apply).chain())
            .add_systems(
                PostUpdate,
                (
                    begin_ticks.before(SoftBodySystems::First),
                    end_ticks.after(SoftBodySystems::Last),
                ),
            );
    }
}

fn begin_ticks(mut time: ResMut<TickTime>) {
    time.begun = Some(Instant::now());
}

fn end_ticks(mut time: ResMut<TickTime>) {
    time.spent = time.begun.take().map_or(Duration::ZERO, |it| it.elapsed());
}

fn start(adapter: Option<Res<RenderAdapterInfo>>, mut governor: ResMut<Governor>) {
    governor.low = adapter.is_some_and(|adapter| is_software(&adapter));
}

fn choose(
    settings: Res<DisplaySettings>,
    time: Res<Time<Real>>,
    (ticks, activity): (Res<TickTime>, Res<Activity>),
    mut governor: ResMut<Governor>,
    mut quality: ResMut<EffectiveQuality>,
) {
    let low = match settings.quality {
        Quality::Auto if activity.is_idle() => governor.low,
        Quality::Auto => {
            governor.pass(time.delta_secs(), ticks.spent.as_secs_f32());
            governor.low
        }
        Quality::Low => true,
        Quality::High => false,
    };
    quality.set_if_neq(if low {
        EffectiveQuality::Low
    } else {
        EffectiveQuality::High
    });
}

fn apply(
    quality: Res<EffectiveQuality>,
    cameras: Query<Entity, With<OrbitCamera>>,
    new: Query<(), Added<OrbitCamera>>,
    mut lights: Query<&mut DirectionalLight>,
    mut commands: Commands,
) {
    if !quality.is_changed() && new.is_empty() {
        return;
    }
    // `studio.wgsl` leaves shadows out with the simple filter: a software renderer would pay for
    // the lookup even where a branch skips it.
    let (smoothing, filter) = match *quality {
        EffectiveQuality::Low => (Msaa::Off, ShadowFilteringMethod::Hardware2x2),
        EffectiveQuality::High => (Msaa::Sample4, ShadowFilteringMethod::Gaussian),
    };
    for camera in &cameras {
        commands.entity(camera).insert((smoothing, filter));
    }
    for mut light in &mut lights {
        light.shadow_maps_enabled = *quality == EffectiveQuality::High;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(governor: &mut Governor, seconds: f32, frame: f32, ticks: f32) -> bool {
        for _ in 0..(seconds / frame).ceil() as u32 {
            governor.pass(frame, ticks);
        }
        governor.low
    }

    #[test]
    fn slow_frames_lower_the_quality_and_a_few_do_not() {
        let mut governor = Governor::default();
        assert!(!after(&mut governor, 1.0, 0.1, 0.0));
        assert!(!after(&mut governor, 5.0, 0.016, 0.0));
        assert!(after(&mut governor, 3.0, 0.1, 0.0));
    }

    #[test]
    fn frames_that_the_simulation_makes_slow_do_not_count() {
        let mut governor = Governor::default();
        assert!(!after(&mut governor, 60.0, 0.1, 0.08));
        assert!(!after(&mut governor, 60.0, 2.0, 0.0), "stalls");
    }

    #[test]
    fn a_computer_between_the_two_switches_ever_more_rarely() {
        let mut governor = Governor::default();
        let mut switches = 0;
        let mut seconds = 0.0;
        // Fast at low quality, slow at high quality.
        while seconds < 3600.0 {
            let low = governor.low;
            let frame = if low { 0.016 } else { 0.05 };
            governor.pass(frame, 0.0);
            seconds += frame;
            switches += u32::from(governor.low != low);
        }
        // Raised after 30, 60, 120, … s: at most log₂(3600/30) < 7 times, each lowered again.
        assert!((2..=15).contains(&switches), "{switches}");
    }
}
