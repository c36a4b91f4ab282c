//! Messages to the user: short notices in the corner of the view that disappear after some seconds.
//!
//! Any system can push a message to [`Notices`]. A repeated notice is counted instead of shown
//! again. Errors are shown longest; a press closes a notice.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{
        self, Area, Color32, Frame, Id, Label, Margin, Order, Rect, RichText, Sense, Stroke, pos2,
    },
};

use crate::sandbox::{
    state::view::ViewSettings,
    ui::{area, theme},
};

/// Maximum number of visible notices; the oldest are dropped first.
const MAX_NOTICES: usize = 5;
/// Maximum width of a notice [logical px].
const WIDTH: f32 = 440.0;

/// Severity of a notice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gravity {
    /// Success.
    Info,
    /// Success with a caveat.
    Warning,
    /// Failure.
    Error,
}

impl Gravity {
    /// Display time [s].
    const fn seconds(self) -> f32 {
        match self {
            Self::Info => 4.0,
            Self::Warning => 8.0,
            Self::Error => 15.0,
        }
    }

    const fn color(self, colors: &theme::Palette) -> Color32 {
        match self {
            Self::Info => colors.accent,
            Self::Warning => colors.changed,
            Self::Error => colors.alarm,
        }
    }
}

/// A visible notice.
#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// Severity.
    pub gravity: Gravity,
    /// Text.
    pub text: String,
    /// Number of repetitions while it was visible.
    pub times: u32,
    remaining: f32,
}

/// The visible notices, oldest first.
#[derive(Resource, Debug, Default)]
pub struct Notices(Vec<Notice>);

impl Notices {
    /// Shows an information notice.
    pub fn info(&mut self, text: impl Into<String>) {
        self.push(Gravity::Info, text.into());
    }

    /// Shows a warning.
    pub fn warn(&mut self, text: impl Into<String>) {
        self.push(Gravity::Warning, text.into());
    }

    /// Shows an error.
    pub fn error(&mut self, text: impl Into<String>) {
        self.push(Gravity::Error, text.into());
    }

    /// The notes, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &Notice> {
        self.0.iter()
    }

    fn push(&mut self, gravity: Gravity, text: String) {
        let remaining = gravity.seconds();
        let same = |notice: &&mut Notice| notice.gravity == gravity && notice.text == text;
        if let Some(notice) = self.0.iter_mut().find(same) {
            notice.times += 1;
            notice.remaining = remaining;
            return;
        }
        if self.0.len() == MAX_NOTICES {
            self.0.remove(0);
        }
        self.0.push(Notice {
            gravity,
            text,
            times: 1,
            remaining,
        });
    }

    /// Advances real time.
    fn age(&mut self, seconds: f32) {
        for notice in &mut self.0 {
            notice.remaining -= seconds;
        }
        self.0.retain(|notice| notice.remaining > 0.0);
    }
}

/// Draws the notices.
pub struct MessagePlugin;

impl Plugin for MessagePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Notices>()
            .init_resource::<ViewSettings>()
            .add_systems(Update, age)
            .add_systems(EguiPrimaryContextPass, show);
    }
}

fn age(mut notices: ResMut<Notices>, time: Res<Time<Real>>) {
    notices.bypass_change_detection().age(time.delta_secs());
}

/// The text with its first letter in upper case, for error messages that stand alone.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

fn show(
    mut contexts: EguiContexts,
    mut notices: ResMut<Notices>,
    view: Res<ViewSettings>,
) -> Result {
    if !notices.0.is_empty() {
        let context = contexts.ctx_mut()?;
        draw(context, &mut notices, area::free(context, &view));
    }
    Ok(())
}

/// Draws the notes in the lower left corner of the area that the panel leaves free.
pub fn draw(context: &egui::Context, notices: &mut Notices, free: Rect) {
    let width = (free.width() - 24.0).clamp(120.0, WIDTH);
    // Above the legend of colors, if it is in this corner.
    let legend = area::card(context, "color legend", Order::Middle);
    let legend = legend.filter(|it| it.left() < free.left() + width);
    let mut bottom = legend.map_or(free.bottom() - 6.0, |it| it.top()) - 6.0;
    let mut dismissed = None;
    for (index, notice) in notices.0.iter().enumerate().rev() {
        let area = Area::new(Id::new(("notice", index)))
            .order(Order::Foreground)
            .fixed_pos(pos2(free.left() + 12.0, bottom))
            .pivot(egui::Align2::LEFT_BOTTOM)
            .constrain(false)
            // Fading would leave a gray box: see `Palette::veil` about translucent colors.
            .fade_in(false)
            .show(context, |ui| card(ui, notice, width));
        if area.inner {
            dismissed = Some(index);
        }
        bottom = area.response.rect.top() - 6.0;
    }
    if let Some(index) = dismissed {
        notices.0.remove(index);
    }
}

/// Draws one notice; `true` if a press closed it.
fn card(ui: &mut egui::Ui, notice: &Notice, width: f32) -> bool {
    ui.set_max_width(width);
    let frame = Frame::new()
        .fill(theme::of(ui).veil)
        .stroke(Stroke::new(1.0, theme::of(ui).line))
        .corner_radius(6.0)
        .inner_margin(Margin {
            left: 14,
            right: 12,
            top: 8,
            bottom: 8,
        })
        .show(ui, |ui| {
            let text = match notice.times {
                1 => notice.text.clone(),
                times => format!("{} (×{times})", notice.text),
            };
            ui.add(Label::new(RichText::new(text).color(theme::of(ui).text)).wrap());
        });
    let rect = frame.response.rect;
    let mut stripe = rect.shrink(1.0);
    stripe.set_width(4.0);
    ui.painter()
        .rect_filled(stripe, 3.0, notice.gravity.color(theme::of(ui)));
    frame.response.interact(Sense::click()).clicked()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_words_are_counted_not_repeated() {
        let mut notices = Notices::default();
        notices.error("no such file");
        notices.error("no such file");
        notices.info("no such file");
        let shown: Vec<_> = notices.iter().map(|n| (n.gravity, n.times)).collect();
        assert_eq!(shown, [(Gravity::Error, 2), (Gravity::Info, 1)]);
    }

    #[test]
    fn notes_go_by_themselves_and_errors_last() {
        let mut notices = Notices::default();
        notices.error("broken");
        notices.info("saved");
        notices.age(5.0);
        assert_eq!(notices.iter().count(), 1);
        notices.age(15.0);
        assert_eq!(notices.iter().count(), 0);
    }

    #[test]
    fn a_flood_of_notes_leaves_the_newest() {
        let mut notices = Notices::default();
        for number in 0..20 {
            notices.warn(format!("note {number}"));
        }
        let texts: Vec<_> = notices.iter().map(|n| n.text.as_str()).collect();
        assert_eq!(texts.len(), MAX_NOTICES);
        assert_eq!(texts.last(), Some(&"note 19"));
    }
}
