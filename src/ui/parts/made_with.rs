//! The line below each pane that shows a prediction: model, steps and seed; and where the settings in force would make
//! another one, that it is so, and the way to the new one.

use eframe::egui::text::{LayoutJob, TextWrapping};
use eframe::egui::{Button, FontId, Rect, RichText, Sense, Ui, pos2, vec2};

use super::cx::Cx;
use super::theme::SMALL;
use super::widget::cut::cut_in_the_middle;
use crate::app::action::Action;
use crate::app::keys::{ImprintSource, ShiftMode, shift_name};
use crate::app::pane::{Kind, Pane};
use crate::app::results::{self, Why};

use touch2touch_core::rig::PadId;

/// Height of the line, points.
const HEIGHT: f32 = 18.0;
/// Width of its button.
const BUTTON: f32 = 64.0;

/// True where a pane as a whole shows a prediction; a 3D pane has the line below the view that does.
pub(crate) fn is_predicted(cx: &Cx<'_>, pane: Pane) -> bool {
    match pane.kind() {
        Kind::Imprint(source) => source == ImprintSource::Predicted,
        Kind::Steps => cx.state.inspect.source == ImprintSource::Predicted,
        Kind::Compare => cx.state.settings.compared().is_error(),
        Kind::Form | Kind::Color | Kind::Scene => false,
    }
}

/// The finger whose prediction is shown; `None` where there is none.
fn finger_shown(cx: &Cx<'_>) -> Option<PadId> {
    let mut fingers = cx.state.fingers().into_iter().filter(|finger| results::chosen(cx.state, *finger).is_some());
    // One that is out of date is said first.
    fingers.clone().find(|finger| results::outdated(cx.state, *finger).is_some()).or_else(|| fingers.next())
}

/// The place of what shows a prediction, or does not, and that of the line below it, if it has one.
pub(crate) fn split(cx: &Cx<'_>, full: Rect, is_predicted: bool) -> (Rect, Option<Rect>) {
    if !is_predicted || finger_shown(cx).is_none() || full.height() < 4.0 * HEIGHT {
        return (full, None);
    }
    let (place, below) = full.split_top_bottom_at_y(full.bottom() - HEIGHT);
    (place, Some(below))
}

/// The line; dims what stands above it where its prediction is not the one that is meant. `title` is what shows it.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, title: &str, place: Rect, line: Rect) {
    let Some((finger, recipe)) = finger_shown(cx).and_then(|finger| Some((finger, results::chosen(cx.state, finger)?)))
    else {
        return;
    };
    let shift = cx.state.settings.shift;
    let model = cx.state.library.model_name(&recipe.bundle);
    let why = results::outdated(cx.state, finger);
    // What is meant needs no more than its seed; what is not says all that may differ.
    let settings = match why {
        None => format!(", seed {}", recipe.config.seed),
        Some(_) => format!(" · {}", recipe.config.text()),
    };
    let engine = cx.state.results.predictions.get(recipe).map_or(String::new(), |made| format!(", by {}", made.engine));
    let full = format!("{model}: {}{engine}. Depth scale: {}", recipe.config.text(), shift_name(shift));
    let (lead, tip) = match why {
        None => ("", "This is what the current settings give"),
        Some(Why::OnItsWay) => ("Updating; this is ", "A prediction with the current settings is being made"),
        Some(Why::Picked) => ("Picked: ", "Shown until you change the settings or press Generate"),
        Some(Why::NotMade) => ("Old settings: ", "The current settings would give another prediction"),
    };
    let text = format!("{lead}{model}{settings}");
    if why.is_some_and(|why| why != Why::Picked) {
        ui.painter().rect_filled(place, 0.0, cx.p.canvas.gamma_multiply(0.45));
    }
    ui.painter().rect_filled(line, 0.0, cx.p.frame);
    let again = matches!(why, Some(Why::NotMade | Why::Picked)) && results::can_generate(cx.state).is_ok();
    let room = line.with_max_x(line.right() - if again { BUTTON + 6.0 } else { 0.0 });
    let color = match (why, shift) {
        (None | Some(Why::Picked), ShiftMode::Raw) | (Some(Why::NotMade | Why::OnItsWay), _) => cx.p.caution,
        _ => cx.p.weak,
    };
    let painter = ui.painter_at(room);
    let width = |text: &str| painter.layout_no_wrap(text.to_owned(), FontId::proportional(SMALL), color).size().x;
    // Names are long, and differ at their ends.
    let left = (room.width() - 12.0 - width(lead) - width(&settings)).max(40.0);
    let shown = format!("{lead}{}{settings}", cut_in_the_middle(model, left, width));
    let mut job = LayoutJob::simple_singleline(shown, FontId::proportional(SMALL), color);
    job.wrap = TextWrapping::truncate_at_width(room.width() - 8.0);
    let galley = painter.layout_job(job);
    let start = room.left_center() + vec2(6.0, -0.5 * galley.size().y);
    painter.galley(start, galley, color);
    let response = ui.interact(room, ui.scope_id().with((title, "made with")), Sense::hover());
    response.widget_info(|| eframe::egui::WidgetInfo::labeled(eframe::egui::Role::Label, true, &text));
    response.on_hover_text(format!("{full}. {tip}"));
    if again {
        let place =
            Rect::from_center_size(pos2(line.right() - BUTTON / 2.0 - 3.0, line.center().y), vec2(BUTTON, 16.0));
        let button = Button::new(RichText::new("Generate").size(SMALL)).small().min_size(vec2(BUTTON, 16.0));
        let button = ui.put(place, button).accessible_name(format!("Generate again, {title}"));
        let tip = Action::Generate.behind("Predicts with the current settings");
        if button.on_hover_text(tip).clicked() {
            cx.act(Action::Generate);
        }
    }
}
