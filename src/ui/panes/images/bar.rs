//! The color bar under the pictures, and the offer to fit its range.

use crate::app::settings::prefer;
use eframe::egui::{Button, Rect, RichText, Ui, UiBuilder, pos2, vec2};

use super::map_of;
use crate::app::action::Action;
use crate::app::command::SettingsCommand;
use crate::app::settings::ColorRange;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::SMALL;
use crate::ui::parts::widget::colorbar::{Colorbar, ColorbarChange};
use crate::ui::parts::widget::texture::Histogram;
use touch2touch_core::colormap::{ColorMap, Range};

/// Offer of a smaller range where a picture takes little of the locked one.
pub(super) fn offer_range(cx: &mut Cx<'_>, ui: &mut Ui, area: Rect, histogram: &Histogram) {
    /// A picture that takes less of the range shows a few of its colors.
    const LITTLE: f32 = 1.0 / 3.0;
    let (range, bulk) = (cx.state.settings.range, histogram.bulk());
    let shown = bulk.hi.min(range.max_m) - bulk.lo.max(range.min_m);
    if !range.locked || bulk.hi <= bulk.lo || shown >= LITTLE * (range.max_m - range.min_m) {
        return;
    }
    let text = format!("Fit colors to {:.1}–{:.1} mm", bulk.lo * 1e3, bulk.hi * 1e3);
    let text = Action::RangeOnce.behind(&text);
    let place = Rect::from_min_max(pos2(area.left() + 4.0, area.bottom() - 24.0), area.max - vec2(4.0, 2.0));
    ui.scope_builder(UiBuilder::new().max_rect(place).id_salt("offer range"), |ui| {
        ui.vertical_centered(|ui| {
            let button = Button::new(RichText::new(text).size(SMALL)).min_size(vec2(0.0, 20.0));
            let tip = "This pair uses less than a third of the color range";
            if ui.add(button).on_hover_text(tip).clicked() {
                cx.act(Action::RangeOnce);
            }
        });
    });
}

/// Tooltip of the button that sets the range.
const AUTO: &str = "Fit the range to what is shown";
/// Tooltip of the lock.
const LOCK: &str = "Keep the range: the same colors in every pair. Off: fitted to each pair";

/// The bar of differences.
pub(crate) fn error_bar(cx: &mut Cx<'_>, ui: &mut Ui, histogram: Option<&Histogram>) {
    let bar = Colorbar {
        label: "Error range",
        map: ColorMap::Diverging,
        default: Range::symmetric(4.0),
        symmetric: true,
        histogram,
        locked: None,
        tips: [AUTO.to_owned(), String::new()],
    };
    match bar.show(ui, Range::symmetric(cx.shared.views.error_mm)) {
        Some(ColorbarChange::Range(range)) => cx.shared.views.error_mm = range.hi.clamp(0.05, 100.0),
        Some(ColorbarChange::Auto) => {
            if let Some(h) = histogram {
                cx.shared.views.error_mm = (h.span.lo.abs().max(h.span.hi.abs()) * 1e3).clamp(0.05, 100.0);
            }
        }
        Some(ColorbarChange::Lock(_)) | None => {}
    }
}

/// The bar of imprints.
pub(crate) fn color_bar(cx: &mut Cx<'_>, ui: &mut Ui, histogram: Option<&Histogram>) {
    let range = cx.state.settings.range;
    let default = ColorRange::default();
    let bar = Colorbar {
        label: "Depth range",
        map: map_of(cx.state),
        default: Range { lo: default.min_m * 1e3, hi: default.max_m * 1e3 },
        symmetric: false,
        histogram,
        locked: Some(range.locked),
        tips: [Action::RangeOnce.behind(AUTO), Action::LockRange.behind(LOCK)],
    };
    match bar.show(ui, Range { lo: range.min_m * 1e3, hi: range.max_m * 1e3 }) {
        Some(ColorbarChange::Range(r)) => {
            cx.push(prefer(move |s| s.range = ColorRange { min_m: r.lo * 1e-3, max_m: r.hi * 1e-3, ..s.range }));
        }
        Some(ColorbarChange::Auto) => cx.push(SettingsCommand::RangeFromShown),
        Some(ColorbarChange::Lock(locked)) => cx.push(prefer(move |s| s.range.locked = locked)),
        None => {}
    }
}
