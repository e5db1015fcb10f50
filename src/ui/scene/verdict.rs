//! The verdict on a pose: one line above the picture, colored by the worst of what is known; the rest on demand.

use eframe::egui::{Align, Button, Color32, Layout, RichText, Sense, Ui, UiBuilder, vec2};

use super::hands;
use super::overlay::{difference, lower_first, pose_details, pose_time, step_text};
use crate::app::action::Action;
use crate::app::command::SettingsCommand;
use crate::app::keys::ImprintSource;
use crate::app::settings::MaskSource;
use crate::app::state::{Absent, Lookup, State};
use crate::domain::align::MIN_POINTS;
use crate::domain::hand::PoseDifference;
use crate::domain::units;
use crate::ui::cx::Cx;
use crate::ui::images;
use crate::ui::theme::{Palette, SMALL};
use crate::work::pose::PoseResult;

/// Height of the line, points.
const HEIGHT: f32 = 22.0;
/// Limits of a good and of a usable angle, radians: the paper's.
const ANGLE_RAD: [f64; 2] = [5.0 / 180.0 * std::f64::consts::PI, 10.0 / 180.0 * std::f64::consts::PI];
/// Limits of a good and of a usable place, meters: a tenth and a half of what the gripper leaves open.
const PLACE_M: [f64; 2] = [1e-3, 5e-3];

/// How much a pose can be relied on; a later one is worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Grade {
    /// Nothing is known against it, and nothing for it: there is no truth.
    Open,
    Good,
    Caution,
    Wrong,
}

impl Grade {
    /// By two limits.
    fn of(value: f64, [good, usable]: [f64; 2]) -> Self {
        match value {
            v if v <= good => Self::Good,
            v if v <= usable => Self::Caution,
            _ => Self::Wrong,
        }
    }

    fn color(self, p: &Palette) -> Color32 {
        match self {
            Self::Open => p.strong,
            Self::Good => p.good,
            Self::Caution => p.caution,
            Self::Wrong => p.wrong,
        }
    }
}

/// What speaks for or against a pose, the worst first.
pub(super) fn findings(state: &State, pose: &PoseResult) -> Vec<(Grade, String)> {
    let mut found = Vec::new();
    if let Some(truth) = state.truth() {
        let off = PoseDifference::between(pose.grasp_from_object, truth);
        let grade = Grade::of(off.angle_rad, ANGLE_RAD).max(Grade::of(off.position_m, PLACE_M));
        found.push((grade, format!("off by {}, {}", units::text_deg(off.angle_rad), units::text_mm(off.position_m))));
    }
    if !pose.report.within_prior {
        found.push((Grade::Wrong, "the gripper cannot hold it so (±22.5°, ±5 mm)".into()));
    }
    if pose.report.is_degenerate() {
        found.push((Grade::Caution, "not determined by the contact".into()));
    }
    if pose.report.refused().is_some() {
        found.push((Grade::Caution, "a cheaper place was refused: the gripper cannot hold it so".into()));
    }
    found.sort_by_key(|(grade, _)| std::cmp::Reverse(*grade));
    found
}

/// Whether there is no pose because the mask has too few contact points.
fn lacks_contact(state: &State, source: ImprintSource) -> bool {
    match state.pose(source) {
        Lookup::Absent(Absent::NoContact) => true,
        Lookup::Failed(_) => {
            state.cloud(source).ready().is_some_and(|clouds| clouds.contact_points().len() < MIN_POINTS)
        }
        _ => false,
    }
}

/// The line; takes its height from the top of the pane.
pub(super) fn line(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource) {
    let (text, color, details) = said(cx, source);
    let width = ui.available_width();
    let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT), Sense::hover());
    ui.painter().rect_filled(rect, 0.0, cx.p.frame);
    ui.painter().circle_filled(rect.left_center() + vec2(12.0, 0.0), 4.0, color);
    let mut inner = rect.with_min_x(rect.left() + 22.0).shrink2(vec2(4.0, 2.0));
    // Too few contact points: the mask is where that is mended.
    if lacks_contact(cx.state, source) {
        let threshold = cx.state.settings.mask.choice.source == MaskSource::Threshold;
        let mut offer = |name, tip: &str| {
            let place = inner.with_min_x(inner.right() - 92.0);
            inner.set_right(place.left() - 4.0);
            let button = Button::new(RichText::new(name).size(SMALL)).small().min_size(vec2(88.0, 16.0));
            ui.put(place, button).on_hover_text(tip).clicked()
        };
        if offer("Open in Label", "The mask can be corrected there, or another source chosen") {
            cx.act(Action::LabelWorkspace);
        }
        let tip = "Marks what is deeper than the threshold as contact, here and on the other pairs";
        if !threshold && offer("Use threshold", tip) {
            cx.push(SettingsCommand::SetMaskSource(MaskSource::Threshold));
        }
    }
    // The CAD model is in another unit: it is said in which, and that is all.
    let units = match cx.state.pose(source) {
        Lookup::Failed(err) => err.units.clone(),
        _ => None,
    };
    if let Some(offer) = units {
        let right = Layout::right_to_left(Align::Center);
        let place = UiBuilder::new().max_rect(inner).layout(right);
        let side = source.name().to_lowercase();
        let used = ui.scope_builder(place, |ui| {
            ui.spacing_mut().interact_size.y = 16.0;
            ui.spacing_mut().button_padding.y = 0.0;
            images::unit_buttons(cx, ui, &offer, &side);
        });
        let used = used.response.rect;
        inner.set_right(used.left() - 4.0);
    }
    ui.scope_builder(UiBuilder::new().max_rect(inner), |ui| {
        ui.set_clip_rect(inner.intersect(ui.clip_rect()));
        ui.add(eframe::egui::Label::new(RichText::new(text).size(12.0).color(color)).truncate());
    });
    if !details.is_empty() {
        response.on_hover_ui(|ui| {
            for line in details {
                ui.label(RichText::new(line).size(SMALL));
            }
        });
    }
}

/// The line, its color, and what there is besides.
fn said(cx: &Cx<'_>, source: ImprintSource) -> (String, Color32, Vec<String>) {
    let state = cx.state;
    if let Some((text, color, details)) = step_text(cx, source) {
        return (text, color, vec![details]);
    }
    let (text, color, mut details) = match state.pose(source) {
        Lookup::Ready(pose) | Lookup::Stale(pose) => {
            let found = findings(state, pose);
            let grade = found.first().map_or(Grade::Open, |(grade, _)| *grade);
            let mut text = units::text_deg(pose.angle_rad);
            for (_, why) in &found {
                text += &format!(" · {why}");
            }
            if found.is_empty() {
                text += &format!(" · residual {}", units::text_mm(pose.rms_m));
            }
            if state.provisional_pose(source).is_some() {
                text += " · being proved…";
            }
            let mut details = vec![format!("{}, {}", pose_details(pose), pose_time(pose))];
            details.extend(pose.truth_rad.map(|truth| format!("true angle {}", units::text_deg(truth))));
            (text, grade.color(cx.p), details)
        }
        Lookup::Waiting => ("Pose: computing…".to_owned(), cx.p.weak, Vec::new()),
        Lookup::Failed(err) => (format!("No pose: {}", err.why), cx.p.wrong, vec![err.to_string()]),
        Lookup::Absent(absent) => (format!("No pose: {}", lower_first(absent)), cx.p.weak, Vec::new()),
    };
    let mut text = text;
    if let Some(pose) = state.by_hand(source) {
        text = format!("By hand: {} · {text}", hands::place_text(pose));
        if let Some(off) = hands::off_truth(state, pose) {
            details.push(difference("The pose by hand", "off the truth", off));
        }
    }
    if let Some(apart) = state.sides_apart() {
        details.push(difference("Measured and predicted", "apart", apart));
    }
    (text, color, details)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_graded_by_its_limits_and_what_is_no_number_is_wrong() {
        let at = |deg: f64| Grade::of(deg.to_radians(), ANGLE_RAD);
        assert_eq!([at(0.0), at(4.9), at(9.0), at(11.0)], [Grade::Good, Grade::Good, Grade::Caution, Grade::Wrong]);
        assert_eq!(at(f64::NAN), Grade::Wrong);
        assert!(Grade::Wrong > Grade::Caution && Grade::Good > Grade::Open);
    }
}
