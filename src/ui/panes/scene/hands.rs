//! Hands on: the strip of the pose that a hand holds.

use eframe::egui::{self, Button, Color32, Rect, RichText, Ui, UiBuilder, vec2};

use crate::app::action::Action;
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::state::State;
use crate::app::workbench::{ManualTry, SceneTool};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// The keys that move the tool in hand.
const KEYS: &str = "arrow keys 0.1 mm · Alt + Left, Right 0.5° · Shift ×10 · Ctrl ÷10";

/// The pose that a hand holds on a side, or would hold.
pub(super) fn held(state: &State, source: ImprintSource) -> Option<PlanarPose> {
    let bench = &state.workbench;
    if bench.tool != SceneTool::Pose || bench.hand.as_ref().is_some_and(|hand| hand.source != source) {
        return None;
    }
    Some(bench.hand(source).map_or_else(|| results::manual_begins(state, source), |hand| hand.pose))
}

/// Height of the strip of the pose in hand, points; 0 where there is none.
pub(super) fn strip_height(state: &State, source: ImprintSource) -> f32 {
    held(state, source).map_or(0.0, |_| 25.0 + 14.0 * 4.0)
}

/// The pose in hand: where it is, what it costs, and what can be done with it.
pub(super) fn strip(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, rect: Rect) {
    let Some(pose) = held(cx.state, source) else { return };
    let hand = cx.state.workbench.hand(source).cloned();
    let place = rect.shrink(2.0);
    let builder = UiBuilder::new().max_rect(place).id_salt(("hand", source as usize));
    ui.scope_builder(builder, |ui| {
        ui.painter().rect(place, 4.0, cx.p.panel.gamma_multiply(0.95), (1.0, cx.p.accent), egui::StrokeKind::Inside);
        let inner = place.shrink2(vec2(8.0, 4.0));
        ui.scope_builder(UiBuilder::new().max_rect(inner), |ui| {
            ui.set_clip_rect(place.intersect(ui.clip_rect()));
            ui.spacing_mut().item_spacing = vec2(4.0, 1.0);
            let mut text = place_text(pose);
            if let Some(off) = results::off_truth(cx.state, pose) {
                let (angle, position) = (units::text_deg(off.angle_rad), units::text_mm(off.position_m));
                text += &format!("   (error {angle}, {position})");
            }
            let found = results::pose(cx.state, source).shown();
            text.extend(found.and_then(|found| Some(format!("   {}", found.report.answers_text(pose)?))));
            ui.label(RichText::new(text).size(SMALL).color(cx.p.strong));
            let (text, color) = cost_text(cx, hand.as_ref());
            ui.label(RichText::new(text).size(SMALL).color(color)).on_hover_text(
                "Outline: distance of the contact points to the tool's outline in the plane, inside counted as zero. \
                 Surface: distance to the tool's surface in space. Of at most 512 contact points",
            );
            ui.horizontal(|ui| {
                let busy = hand.as_ref().is_some_and(|hand| hand.icp.is_some());
                let icp = if busy { "Registering…" } else { "Register from here" };
                for (action, text) in
                    [(Action::IcpFromHere, icp), (Action::Accept, "Accept"), (Action::RevertHand, "Revert")]
                {
                    let button = Button::selectable(false, RichText::new(text).size(SMALL)).frame_when_inactive(true);
                    let name = format!("{}, {}", action.name(), source.name().to_lowercase());
                    cx.acting(ui, action, button.min_size(vec2(0.0, 20.0)), name);
                }
            });
            ui.label(caption(KEYS, cx.p));
        });
    });
}

/// The three numbers of a pose.
pub(super) fn place_text(pose: PlanarPose) -> String {
    // The angle as everywhere on screen: of the tool's inverse motion, as the lab reports it.
    let angle = pose.inverse().theta_rad;
    format!("y {:+.2}  z {:+.2} mm   angle {:+.1}°", units::mm(pose.y_m), units::mm(pose.z_m), angle.to_degrees())
}

/// Cost of the pose, against where it began.
fn cost_text(cx: &Cx<'_>, hand: Option<&ManualTry>) -> (String, Color32) {
    let Some(hand) = hand else {
        return ("Move the tool with the arrow keys or its handles".into(), cx.p.weak);
    };
    let text = match (hand.cost, hand.began_cost) {
        (Some(now), Some(before)) => format!(
            "outline {:.2} (was {:.2}) mm · {:.0} % inliers · surface {:.2} mm",
            units::mm(now.outline_rms_m),
            units::mm(before.outline_rms_m),
            now.inlier_share * 100.0,
            units::mm(now.surface_rms_m)
        ),
        _ => "Fit: waiting for the contact points".into(),
    };
    let better = hand.cost.zip(hand.began_cost).is_some_and(|(a, b)| a.cost_m2 <= b.cost_m2);
    (text, if better { cx.p.good } else { cx.p.caution })
}
