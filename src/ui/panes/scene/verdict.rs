//! The verdict on a pose: one line above the picture, colored by the worst of what is known; the rest on demand.

use crate::app::pane::Workspace;
use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{Align, Button, Color32, Layout, RichText, Sense, Ui, UiBuilder, vec2};

use super::hands;
use super::overlay::{difference, lower_first, pose_details, pose_time, step_text};
use crate::app::keys::ImprintSource;
use crate::app::settings::MaskSource;
use crate::app::state::{Absent, Lookup, State};
use crate::ui::panes::images;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, grade_color};
use touch2touch_core::align::MIN_POINTS;
use touch2touch_core::sample::Scale;
use touch2touch_core::units;

/// Height of the line, points.
const HEIGHT: f32 = 22.0;
/// Height of its letters, points.
const LINE: f32 = 12.0;
/// Width from which the line has room for both errors, points.
const WIDE: f32 = 290.0;

/// True where there is no pose because the mask has too few contact points.
fn lacks_contact(state: &State, source: ImprintSource) -> bool {
    match results::pose(state, source) {
        Lookup::Absent(Absent::NoContact) => true,
        Lookup::Failed(_) => {
            results::cloud(state, source).ready().is_some_and(|clouds| clouds.contact_points().len() < MIN_POINTS)
        }
        _ => false,
    }
}

/// The line; takes its height from the top of the pane. What mends both sides is offered on the `first`.
pub(super) fn line(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, first: bool) {
    let width = ui.available_width();
    let (text, color, details) = said(cx, source, width >= WIDE);
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
        if offer("Open in Label", "Edit the mask there, or choose another source") {
            cx.push(prefer(|s| s.workspace = Workspace::Label));
        }
        let tip = "Makes everything deeper than a threshold contact, in all pairs";
        if !threshold && offer("Use threshold", tip) {
            cx.push(prefer(|s| s.mask.choice.source = MaskSource::Threshold));
        }
    }
    // The CAD model is in another unit: it is said in which, and that is all.
    let units = match results::pose(cx.state, source) {
        Lookup::Failed(err) if first => err.units.clone(),
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
        ui.add(eframe::egui::Label::new(RichText::new(&text).size(LINE).color(color)).truncate());
    });
    response.on_hover_ui(|ui| {
        // What is cut off stands there whole.
        for line in std::iter::once(text).chain(details) {
            ui.label(RichText::new(line).size(SMALL));
        }
    });
}

/// The line, its color, and what there is besides.
fn said(cx: &Cx<'_>, source: ImprintSource, wide: bool) -> (String, Color32, Vec<String>) {
    let state = cx.state;
    if let Some((text, color, details)) = step_text(cx, source) {
        return (text, color, vec![details]);
    }
    let (text, color, mut details) = match results::pose(state, source) {
        Lookup::Ready(pose) | Lookup::Stale(pose) => {
            let angle = pose.angle_text();
            let (mut text, color) = match &pose.verdict {
                Some(verdict) => (format!("{} · {angle}", verdict.grade), grade_color(cx.p, verdict.grade)),
                None => (angle, cx.p.strong),
            };
            let mut details: Vec<String> = Vec::new();
            if let Some(verdict) = &pose.verdict {
                details.push(format!("{}: {}", verdict.grade, verdict.why));
                details.push(verdict.parts_text());
                details.extend(verdict.against.iter().skip(1).map(|sign| format!("{}: {}", sign.grade, sign.what)));
            }
            details.push(format!("{}, {}", pose_details(pose), pose_time(pose)));
            if let Some(off) = results::off_truth(state, pose.grasp_from_object) {
                let both = difference("off by", "", off);
                if wide {
                    text += &format!(" · {both}");
                } else {
                    text += &format!(" · off by {}", units::text_deg(off.angle_rad));
                    details.push(both);
                }
                details.extend(pose.truth_rad.map(|truth| format!("true angle {}", units::text_deg(truth))));
            }
            text.extend(pose.report.answers_text(pose.grasp_from_object).map(|answers| format!(" · {answers}")));
            if let Some(verdict) = &pose.verdict {
                text += &format!(" · {}", verdict.why);
            }
            if results::sample(state).ready().is_some_and(|sample| sample.scale == Scale::Assumed) {
                text += " · assumed camera";
                details.push("Pictures carry no camera and no scale; the simulator's are assumed".to_owned());
            }
            (text, color, details)
        }
        Lookup::Waiting => ("Pose: computing…".to_owned(), cx.p.weak, Vec::new()),
        Lookup::Failed(err) => (format!("No pose: {}", err.why), cx.p.wrong, vec![err.to_string()]),
        Lookup::Absent(absent) => (format!("No pose: {}", lower_first(absent)), cx.p.weak, Vec::new()),
    };
    let mut text = text;
    if let Some(pose) = results::by_hand(state, source) {
        text = format!("By hand: {} · {text}", hands::place_text(pose));
        if let Some(off) = results::off_truth(state, pose) {
            details.push(difference("Pose by hand: error", "", off));
        }
    }
    if let Some(between) = results::sides_apart(state) {
        details.push(difference("Measured vs predicted:", "apart", between));
    }
    (text, color, details)
}
