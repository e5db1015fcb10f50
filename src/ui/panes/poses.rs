//! Prediction against truth as poses: measured and predicted against the true pose and against each other, per finger
//! and joint.

use eframe::egui::{Align2, Color32, FontId, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{LabelsCommand, Pane};
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::state::Lookup;
use crate::app::workbench::PoseOf;
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{SMALL, caption, grade_color};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::{ManualPose, PoseDifference};
use touch2touch_core::units;
use touch2touch_core::verdict::Grade;
use touch2touch_work::labels::ImprintOf;

/// Height of a row: two lines of small type.
const ROW: f32 = 32.0;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        ScrollArea::vertical().id_salt("poses").show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 0.0;
            let columns = [
                ("Measured", side_color(cx.p, ImprintSource::Measured)),
                ("Predicted", side_color(cx.p, ImprintSource::Predicted)),
                ("Apart", cx.p.weak),
            ];
            let heads = columns.map(|(name, color)| ([name.to_owned(), String::new()], color));
            row(ui, ("Off the truth", cx.p.weak), &heads, 18.0);
            for of in PoseOf::all(&cx.state.rig()) {
                let name = of.name(&cx.state.rig());
                let cells = cells(cx, of);
                ui.painter().hline(ui.max_rect().x_range(), ui.cursor().top(), (1.0, cx.p.line));
                row(ui, (name.as_str(), cx.p.text), &cells, ROW);
            }
            ui.add_space(6.0);
            let text = match results::truth(cx.state) {
                Some(_) => "Angle and place of the tool's origin. Apart: measured against predicted.",
                None => "The true pose of this pair is not known: only the distance between the two poses is shown.",
            };
            ui.label(caption(text, cx.p));
            ui.add_space(6.0);
            ui.spacing_mut().item_spacing.y = 4.0;
            for source in ImprintSource::iter() {
                accept(cx, ui, source);
            }
        });
    });
}

/// Takes the registered pose of a side over into the labels, or withdraws the one that is there.
fn accept(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource) {
    let Some(pose) = results::pose(cx.state, source).shown() else { return };
    let action = match source {
        ImprintSource::Measured => Action::AcceptMeasuredPose,
        ImprintSource::Predicted => Action::AcceptPredictedPose,
    };
    let accepted = results::accepted(cx.state, source) == Some(pose.grasp_from_object.into());
    match results::by_hand(cx.state, source) {
        Some(hand) => by_hand(cx, ui, source, hand),
        None if accepted => _ = cx.action_button(ui, action, &format!("{}: accepted (withdraw)", source.name())),
        None => _ = cx.action_button(ui, action, action.name()),
    }
    let elsewhere = results::accepted_elsewhere(cx.state);
    if source == ImprintSource::Predicted && !elsewhere.is_empty() {
        let of: Vec<String> = elsewhere.into_iter().map(ImprintOf::text).collect();
        ui.label(caption("another prediction has an accepted pose", cx.p)).on_hover_text(of.join("\n"));
    }
}

/// `Accepted by hand: 3.0° (error 0.2°)`.
pub(crate) fn by_hand_text(cx: &Cx<'_>, hand: ManualPose) -> String {
    let mut text = format!("Accepted by hand: {}", units::text_deg(hand.planar.inverse().theta_rad));
    if let Some(truth) = results::truth(cx.state) {
        text += &format!(" (error {})", units::text_deg(PoseDifference::between(hand.planar, truth).angle_rad));
    }
    text
}

/// A pose that a person set, in place of the button that takes the registered one over.
fn by_hand(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, hand: ManualPose) {
    ui.label(RichText::new(by_hand_text(cx, hand)).size(SMALL).color(cx.p.good));
    let tip = cx.keys().fill("The registered pose counts again ([[undo]] brings it back)");
    let withdraw = ui.small_button("Withdraw").on_hover_text(tip);
    if withdraw.accessible_name(format!("Withdraw the pose by hand, {}", source.name().to_lowercase())).clicked() {
        cx.push(LabelsCommand::AcceptPose(source, false));
    }
}

/// Angle and place of one comparison as two lines.
fn text(difference: PoseDifference) -> [String; 2] {
    [units::text_deg(difference.angle_rad), units::text_mm(difference.position_m)]
}

/// Measured and predicted against the truth, and against each other.
fn cells(cx: &Cx<'_>, of: PoseOf) -> [([String; 2], Color32); 3] {
    let p = cx.p;
    let pose = |source| results::pose_of(cx.state, source, of);
    let planar = |source| -> Option<PlanarPose> { Some(pose(source).ready()?.grasp_from_object) };
    let against = |source: ImprintSource| match (pose(source), results::truth(cx.state)) {
        (Lookup::Ready(pose), Some(truth)) => {
            let difference = PoseDifference::between(pose.grasp_from_object, truth);
            (text(difference), grade_color(p, Grade::of_difference(difference)))
        }
        (Lookup::Failed(_), _) => (["failed".to_owned(), String::new()], p.wrong),
        (Lookup::Waiting, _) => (["…".to_owned(), String::new()], p.weak),
        _ => (["–".to_owned(), String::new()], p.weak),
    };
    let apart = match (planar(ImprintSource::Measured), planar(ImprintSource::Predicted)) {
        (Some(a), Some(b)) => (text(PoseDifference::between(a, b)), p.strong),
        _ => (["–".to_owned(), String::new()], p.weak),
    };
    [against(ImprintSource::Measured), against(ImprintSource::Predicted), apart]
}

/// A name at the left and three columns of two lines each.
fn row(ui: &mut Ui, name: (&str, Color32), cells: &[([String; 2], Color32); 3], height: f32) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let all: Vec<String> = cells.iter().map(|([a, b], _)| format!("{a} {b}").trim_end().to_owned()).collect();
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{}: {}", name.0, all.join(", "))));
    let painter = ui.painter_at(rect);
    let font = FontId::proportional(SMALL);
    painter.text(pos2(rect.left(), rect.center().y), Align2::LEFT_CENTER, name.0, font.clone(), name.1);
    let width = ((rect.width() - 76.0) / 3.0).max(40.0);
    for (i, ([first, second], color)) in cells.iter().enumerate() {
        let x = rect.right() - 2.0 - width * (2 - i) as f32;
        let lines = if second.is_empty() { 1.0 } else { 2.0 };
        let top = rect.center().y - 6.5 * lines;
        painter.text(pos2(x, top), Align2::RIGHT_TOP, first, font.clone(), *color);
        painter.text(pos2(x, top + 13.0), Align2::RIGHT_TOP, second, font.clone(), *color);
    }
}
