//! What stands on a pane whose prediction the settings in force would not make: how it was made, and the way to the new one.

use eframe::egui::{Align2, Button, FontId, Rect, RichText, Sense, Ui, pos2, vec2};

use super::cx::Cx;
use super::theme::SMALL;
use crate::app::action::Action;
use crate::app::keys::ImprintSource;
use crate::app::pane::{Kind, Pane};
use crate::app::results::shown::{Outdated, Why};

/// Height of the line, points.
const HEIGHT: f32 = 22.0;
/// Width of its button.
const BUTTON: f32 = 68.0;

/// Whether all that a pane shows hangs on a prediction.
fn is_of_prediction(cx: &Cx<'_>, pane: Pane) -> bool {
    match pane.kind() {
        Kind::Imprint(source) | Kind::Scene(source) => source == ImprintSource::Predicted,
        Kind::Error => true,
        Kind::Steps | Kind::Map => cx.state.inspect.source == ImprintSource::Predicted,
        Kind::Form => pane == Pane::Ledger,
        Kind::Color | Kind::Versus => false,
    }
}

/// Dims a pane whose prediction is not the one that the settings ask for, and says so; `rect` is its place.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, pane: Pane, rect: Rect) {
    if !is_of_prediction(cx, pane) {
        return;
    }
    let Some(outdated) = cx.state.fingers().into_iter().find_map(|finger| cx.state.outdated(finger)) else { return };
    let Outdated { made_with, why } = outdated;
    if !why.is_meant() {
        ui.painter().rect_filled(rect, 0.0, cx.p.canvas.gamma_multiply(0.45));
    }
    let text = match why {
        Why::OnItsWay => format!("Predicting anew. Shown: {made_with}"),
        Why::Picked => format!("Picked: {made_with}"),
        Why::Held => format!("As the case holds it: {made_with}. The model is not here"),
        Why::NotMade => format!("Made with {made_with}"),
    };
    let line = Rect::from_min_size(pos2(rect.left(), rect.bottom() - HEIGHT), vec2(rect.width(), HEIGHT));
    ui.painter().rect_filled(line, 0.0, cx.p.frame);
    let button = why != Why::OnItsWay && cx.state.can_generate().is_ok() && rect.width() > 2.0 * BUTTON;
    let room = if button { line.with_max_x(line.right() - BUTTON - 8.0) } else { line };
    let painter = ui.painter_at(room);
    let color = if why == Why::Picked { cx.p.text } else { cx.p.caution };
    painter.text(room.left_center() + vec2(8.0, 0.0), Align2::LEFT_CENTER, &text, FontId::proportional(SMALL), color);
    let response = ui.interact(room, ui.scope_id().with((pane, "outdated")), Sense::hover());
    response.on_hover_text(format!("{text}. The settings in force would make another prediction"));
    if button {
        let place =
            Rect::from_center_size(pos2(line.right() - BUTTON / 2.0 - 4.0, line.center().y), vec2(BUTTON, 18.0));
        let name = format!("Generate anew, {}", pane.title());
        let again = ui.put(place, Button::new(RichText::new("Generate").size(SMALL)).min_size(vec2(BUTTON, 18.0)));
        let tip = cx.keys().behind("Predicts with the settings in force", Action::Generate);
        if again.accessible_name(name).on_hover_text(tip).clicked() {
            cx.act(Action::Generate);
        }
    }
}
