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
const SLOW: f32 = 1.0 / 30.0;
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
    /// As low, at half the resolution of the window.
    Lowest,
    /// No shadows, no smoothed edges, two thirds of the resolution.
    Low,
    /// Shadows, smoothed edges, and the resolution of the window.
    #[default]
    High,
}

impl EffectiveQuality {
    /// Drawn pixels per pixel of the screen, in each direction.
    pub const fn resolution(self) -> f32 {
        match self {
            Self::Lowest => 0.5,
            Self::Low => 2.0 / 3.0,
            Self::High => 1.0,
        }
    }

    const fn lower(self) -> Self {
        match self {
            Self::High => Self::Low,
            Self::Low | Self::Lowest => Self::Lowest,
        }
    }

    const fn higher(self) -> Self {
        match self {
            Self::Lowest => Self::Low,
            Self::Low | Self::High => Self::High,
        }
    }
}

/// Chooses the quality by the frame time.
#[derive(Resource, Debug, Clone, PartialEq)]
struct Governor {
    quality: EffectiveQuality,
    slow: f32,
    fast: f32,
    fast_for: f32,
}

impl Default for Governor {
    fn default() -> Self {
        Self {
            quality: EffectiveQuality::High,
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
        self.fast = if frame < FAST { self.fast + frame } else { 0.0 };
        if self.quality != EffectiveQuality::High && self.fast > self.fast_for {
            self.set(self.quality.higher());
            self.fast_for *= 2.0;
        }
        let change = if frame > SLOW { frame } else { -frame };
        self.slow = (self.slow + change).max(0.0);
        if self.slow > SLOW_FOR {
            self.set(self.quality.lower());
        }
    }

    fn set(&mut self, quality: EffectiveQuality) {
        *self = Self {
            quality,
            slow: 0.0,
            fast: 0.0,
            ..*self
        };
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
    if adapter.is_some_and(|adapter| is_software(&adapter)) {
        governor.set(EffectiveQuality::Low);
    }
}

fn choose(
    settings: Res<DisplaySettings>,
    time: Res<Time<Real>>,
    (ticks, activity): (Res<TickTime>, Res<Activity>),
    mut governor: ResMut<Governor>,
    mut quality: ResMut<EffectiveQuality>,
) {
    quality.set_if_neq(match settings.quality {
        Quality::Auto => {
            if !activity.is_idle() {
                governor.pass(time.delta_secs(), ticks.spent.as_secs_f32());
            }
            governor.quality
        }
        Quality::Low => EffectiveQuality::Low,
        Quality::High => EffectiveQuality::High,
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
        EffectiveQuality::Lowest | EffectiveQuality::Low => {
            (Msaa::Off, ShadowFilteringMethod::Hardware2x2)
        }
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
    use super::{EffectiveQuality::*, *};

    fn after(governor: &mut Governor, seconds: f32, frame: f32, ticks: f32) -> EffectiveQuality {
        for _ in 0..(seconds / frame).ceil() as u32 {
            governor.pass(frame, ticks);
        }
        governor.quality
    }

    #[test]
    fn slow_frames_lower_the_quality_and_a_few_do_not() {
        let mut governor = Governor::default();
        assert_eq!(after(&mut governor, 1.0, 0.1, 0.0), High);
        assert_eq!(after(&mut governor, 5.0, 0.016, 0.0), High);
        assert_eq!(after(&mut governor, 3.0, 0.1, 0.0), Low);
        // Less than 30 frames per second.
        assert_eq!(after(&mut governor, 10.0, 0.032, 0.0), Low);
        assert_eq!(after(&mut governor, 3.0, 0.035, 0.0), Lowest);
        assert_eq!(after(&mut governor, 60.0, 0.1, 0.0), Lowest);
    }

    #[test]
    fn frames_that_the_simulation_makes_slow_do_not_count() {
        let mut governor = Governor::default();
        assert_eq!(after(&mut governor, 60.0, 0.1, 0.08), High);
        assert_eq!(after(&mut governor, 60.0, 2.0, 0.0), High, "stalls");
    }

    #[test]
    fn a_computer_between_the_two_switches_ever_more_rarely() {
        let mut governor = Governor::default();
        let mut switches = 0;
        let mut seconds = 0.0;
        // Fast at low quality, slow at high quality.
        while seconds < 3600.0 {
            let quality = governor.quality;
            let is_high = quality == High;
            let frame = if is_high { 0.05 } else { 0.016 };
            governor.pass(frame, 0.0);
            seconds += frame;
            switches += u32::from(governor.quality != quality);
        }
        // Raised after 30, 60, 120, … s: at most log₂(3600/30) < 7 times, each lowered again.
        assert!((2..=15).contains(&switches), "{switches}");
    }
}
