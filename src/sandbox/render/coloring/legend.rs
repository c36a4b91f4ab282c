//! The legend of colored bodies: quantity, unit, color map, range, and the fields of a fixed range.

use super::map;
use crate::sandbox::{
    state::{
        color::{ColorScale, Quantity, shade},
        request::{Request, Requested},
        view::{SolverView, ViewSettings},
    },
    ui::{WidgetRects, area, format, number, theme},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts,
    egui::{
        self, Align2, Area, Button, Color32, Context, DragValue, Frame, Id, Label, Margin, Order,
        Painter, Rect, RichText, Sense, Stroke, StrokeKind, TextStyle, Ui, pos2, vec2,
    },
};
use std::cell::Cell;

/// Width of the contents [logical px].
const WIDTH: f32 = 248.0;
/// Width of the parts of the bar for values beyond the range [logical px].
const BEYOND: f32 = 14.0;
/// Cards in the same corner, by the identities of their areas.
const CARDS: [&str; 4] = [
    "what accuracy costs",
    "cost of effects",
    "stress tests",
    "first steps",
];

/// Rectangles of the legend's widgets, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct LegendRects(pub WidgetRects);

pub(super) fn is_noted(rects: Res<LegendRects>) -> bool {
    rects.iter().next().is_some()
}

pub(super) fn show(
    mut contexts: EguiContexts,
    view: Res<ViewSettings>,
    scale: Res<ColorScale>,
    mut rects: ResMut<LegendRects>,
    mut requests: MessageWriter<Requested>,
) -> Result {
    let shown = view
        .color
        .quantity()
        .filter(|_| view.solver == SolverView::Off);
    let Some(quantity) = shown else {
        rects.0.clear();
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let free = area::free(context, &view);
    let (request, places) = draw(context, &quantity, &scale, free);
    if rects.0 != places {
        rects.0 = places;
    }
    if let Some(request) = request {
        requests.write(Requested(request));
    }
    Ok(())
}

/// Draws the legend in the lower left corner of the area that the panel leaves free, beside a card
/// that is open there.
pub fn draw(
    context: &Context,
    quantity: &Quantity,
    scale: &ColorScale,
    free: Rect,
) -> (Option<Request>, WidgetRects) {
    let mut request = None;
    let mut places = WidgetRects::default();
    let left = beside_cards(context, free);
    let area = Area::new(Id::new("color legend"))
        .order(Order::Middle)
        .pivot(Align2::LEFT_BOTTOM)
        .fixed_pos(pos2(left + 10.0, free.bottom() - 10.0))
        .constrain(false)
        // Fading would leave a gray box: see `Palette::veil` about translucent colors.
        .fade_in(false)
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).veil)
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(10, 7))
                .show(ui, |ui| {
                    ui.set_width(WIDTH.min(free.width() - 40.0));
                    contents(ui, quantity, scale, &mut request, &mut places);
                });
        });
    places.note("legend", &area.response, context.content_rect());
    (request, places)
}

/// Left end of the free area, after an open card.
fn beside_cards(context: &Context, free: Rect) -> f32 {
    let open = CARDS
        .iter()
        .filter_map(|name| area::card(context, name, Order::Middle));
    let ends = open.map(|card| card.right());
    let fits = ends.filter(|end| end + WIDTH + 30.0 < free.right());
    fits.fold(free.left(), f32::max)
}

fn contents(
    ui: &mut Ui,
    quantity: &Quantity,
    scale: &ColorScale,
    request: &mut Option<Request>,
    places: &mut WidgetRects,
) {
    ui.spacing_mut().item_spacing.y = 3.0;
    let unit = match quantity.unit {
        "" => String::new(),
        unit => format!(" [{unit}]"),
    };
    let title = RichText::new(format!("{}{unit}", quantity.symbol));
    let title = title.color(theme::of(ui).strong);
    ui.add(Label::new(title).wrap())
        .on_hover_text(quantity.help);
    bar(ui, quantity, scale.range());
    fields(ui, quantity, scale, request, places);
    let text = match scale.extremes {
        Some((low, high)) => {
            let text = |value: f32| format(f64::from(value) * quantity.factor, 3);
            let unit = quantity.unit;
            format!("On screen: {} to {} {unit}", text(low), text(high))
        }
        None => "Not defined for these bodies (gray)".to_owned(),
    };
    let text = RichText::new(text.trim_end())
        .small()
        .color(theme::of(ui).weak);
    ui.add(Label::new(text).wrap())
        .on_hover_text("Smallest and largest value of all bodies. Values beyond the range are striped; bodies for which the quantity is not defined are gray.");
}

/// The color map with its ends, and three figures below it.
fn bar(ui: &mut Ui, quantity: &Quantity, range: (f32, f32)) {
    let (whole, _) = ui.allocate_exact_size(vec2(ui.available_width(), 30.0), Sense::hover());
    let rect = Rect::from_min_size(whole.min, vec2(whole.width(), 14.0));
    let inner = rect.shrink2(vec2(BEYOND, 0.0));
    let colors = map::map(quantity.signed);
    let at = |fraction: f32| {
        let value = range.0 + (range.1 - range.0) * fraction;
        let color = map::color(&colors, shade(value, range, quantity.signed));
        let srgb = Color::linear_rgb(color.x, color.y, color.z).to_srgba();
        let byte = |channel: f32| (channel * 255.0).round() as u8;
        Color32::from_rgb(byte(srgb.red), byte(srgb.green), byte(srgb.blue))
    };
    let painter = ui.painter();
    let steps = inner.width().max(1.0) as usize;
    for step in 0..steps {
        let x = inner.left() + inner.width() * step as f32 / steps as f32;
        let width = inner.width() / steps as f32 + 0.5;
        let slice = Rect::from_min_size(pos2(x, rect.top()), vec2(width, rect.height()));
        painter.rect_filled(slice, 0.0, at((step as f32 + 0.5) / steps as f32));
    }
    beyond(
        painter,
        Rect::from_min_max(rect.min, inner.left_bottom()),
        at(0.0),
    );
    beyond(
        painter,
        Rect::from_min_max(inner.right_top(), rect.max),
        at(1.0),
    );
    let line = Stroke::new(1.0, theme::of(ui).tick);
    painter.rect_stroke(rect, 0.0, line, StrokeKind::Outside);
    let font = TextStyle::Small.resolve(ui.style());
    let color = theme::of(ui).text;
    let figures = [
        (0.0, Align2::LEFT_TOP),
        (0.5, Align2::CENTER_TOP),
        (1.0, Align2::RIGHT_TOP),
    ];
    for (fraction, align) in figures {
        let value = f64::from(range.0 + (range.1 - range.0) * fraction) * quantity.factor;
        let x = inner.left() + inner.width() * fraction;
        painter.vline(x, rect.bottom()..=rect.bottom() + 3.0, line);
        let at = match fraction {
            0.0 => whole.left(),
            1.0 => whole.right(),
            _ => x,
        };
        painter.text(
            pos2(at, rect.bottom() + 2.0),
            align,
            format(value, 3),
            font.clone(),
            color,
        );
    }
}

/// An end of the bar with the stripes of values beyond the range.
fn beyond(painter: &Painter, rect: Rect, color: Color32) {
    painter.rect_filled(rect, 0.0, color);
    let is_light = egui::Rgba::from(color).intensity() > 0.25;
    let stripe = if is_light {
        Color32::BLACK
    } else {
        Color32::WHITE
    };
    let painter = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    let mut x = rect.left() - rect.height();
    while x < rect.right() {
        let ends = [pos2(x, rect.bottom()), pos2(x + rect.height(), rect.top())];
        painter.line_segment(ends, Stroke::new(1.5, stripe));
        x += 6.0;
    }
}

/// The two ends of the range as fields, and the button that holds or frees it.
fn fields(
    ui: &mut Ui,
    quantity: &Quantity,
    scale: &ColorScale,
    request: &mut Option<Request>,
    places: &mut WidgetRects,
) {
    let (low, high) = scale.range();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        let end = |ui: &mut Ui, places: &mut WidgetRects, name: &str, value: f32| {
            let shown = f64::from(value) * quantity.factor;
            let unit = quantity.unit;
            let mut edited = shown;
            let refused = Cell::new(false);
            let field = DragValue::new(&mut edited)
                .speed((f64::from(high - low) * quantity.factor / 200.0).max(1e-9))
                .update_while_editing(false)
                .custom_formatter(move |value, _| {
                    format!("{} {unit}", format(value, 3)).trim_end().to_owned()
                })
                .custom_parser(|text| {
                    let value = number::parse(text, unit).ok();
                    refused.set(value.is_none());
                    value
                });
            let field = ui.add_sized([76.0, theme::ROW], field);
            let field =
                field.on_hover_text("End of the range. Drag or type a value to fix the range.");
            places.note(format!("legend.{name}"), &field, ui.clip_rect());
            let changed = field.changed() && edited != shown && !refused.get();
            changed.then_some((edited / quantity.factor) as f32)
        };
        let from = end(ui, places, "low", low);
        ui.label("to");
        let to = end(ui, places, "high", high);
        if from.is_some() || to.is_some() {
            let range = (from.unwrap_or(low), to.unwrap_or(high));
            *request = Some(Request::ColorRange(Some(range)));
        }
        let held = scale.fixed.is_some();
        let button = Button::new(if held { "Auto" } else { "Lock" }).selected(held);
        let button = ui.add(button).on_hover_text(if held {
            "Let the range follow the values: 98 % of them are within it"
        } else {
            "Lock the current range, to compare parameters or bodies"
        });
        places.note("legend.hold", &button, ui.clip_rect());
        if button.clicked() {
            *request = Some(Request::ColorRange(match held {
                true => None,
                false => Some((rounded(low), rounded(high))),
            }));
        }
    });
}

/// A value to three digits, as the field shows it.
fn rounded(value: f32) -> f32 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
