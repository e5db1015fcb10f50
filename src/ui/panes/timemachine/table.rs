//! The figures of the step shown, of the pinned ones, and their differences.

use eframe::egui::{self, Align2, Color32, FontId, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::pose_text;
use crate::app::command::Command;
use crate::app::inspect::{InspectCommand, Inspected, Pin};
use crate::app::results;
use crate::ui::panes::scene;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::line::Line;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// Height of a line, points.
const LINE: f32 = 16.0;
/// Width of the names, points.
const NAMES: f32 = 62.0;

/// A column of figures: angle in the lab's sense (degrees), y, z, root of the cost (mm).
type StepFigures = [Option<f64>; 4];

fn column(pose: PlanarPose, cost_m2: Option<f64>) -> StepFigures {
    let lab = units::wrap_angle(-pose.theta_rad).to_degrees();
    [Some(lab), Some(units::mm(pose.y_m)), Some(units::mm(pose.z_m)), cost_m2.map(root_mm)]
}

/// The root of a cost per point, millimeters.
pub(super) fn root_mm(cost_m2: f64) -> f64 {
    units::mm(cost_m2.max(0.0).sqrt())
}

fn minus(a: StepFigures, b: StepFigures) -> StepFigures {
    let mut difference: StepFigures = std::array::from_fn(|i| Some(a[i]? - b[i]?));
    difference[0] = difference[0].map(|deg| units::wrap_angle(deg.to_radians()).to_degrees());
    difference
}

/// The table and the lines below.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, shown: Inspected<'_>) {
    ui.spacing_mut().item_spacing.y = 0.0;
    let step = shown.step;
    let now = column(step.grasp_from_object, Some(step.cost_m2));
    let truth = results::truth(cx.state);
    let pins = cx.state.inspect.pins_of(cx.state.pair_key());
    let mut columns: Vec<(&str, Color32, StepFigures)> = vec![("now", cx.p.strong, now)];
    if let Some(truth) = truth {
        columns.push(("− true", cx.p.truth, minus(now, column(truth, None))));
    }
    for (i, pin) in pins.iter().enumerate() {
        if let Some(pin) = pin {
            columns.push((["A", "B"][i], cx.p.pins[i], column(pin.grasp_from_object, Some(pin.cost_m2))));
        }
    }
    if let [Some(a), Some(b)] = pins {
        let of = |p: Pin| column(p.grasp_from_object, Some(p.cost_m2));
        let mut difference = minus(of(b), of(a));
        // Costs of different kernels are not of one kind.
        if a.kernel_m != b.kernel_m || a.registration != b.registration {
            difference[3] = None;
        }
        columns.push(("B − A", cx.p.strong, difference));
    }
    let column = ((ui.available_width() - NAMES) / columns.len() as f32).min(52.0);
    let line = Line { height: LINE, size: 12.0, column, swatch: None };
    heads(cx, ui, &columns, pins, column);
    for (i, (name, tip)) in [
        ("Angle °", "In-hand angle, with the sign that the lab reports"),
        ("y mm", "Position of the tool's origin in the grasp frame"),
        ("z mm", "Position of the tool's origin in the grasp frame"),
        ("√cost mm", "Root of the cost per point; comparable within one kernel width"),
    ]
    .into_iter()
    .enumerate()
    {
        let decimals = if i == 0 { 1 } else { 2 };
        let numbers: Vec<(String, Color32)> = columns
            .iter()
            .enumerate()
            .map(|(c, (_, _, values))| {
                let text = values[i].filter(|v| v.is_finite()).map_or("–".to_owned(), |v| units::fixed(v, decimals));
                let color = match (columns[c].0, i, values[i]) {
                    ("− true", 0, Some(v)) => scene::error_color(cx.p, v.to_radians().abs()),
                    _ => cx.p.strong,
                };
                (text, color)
            })
            .collect();
        ui.scope(|ui| {
            ui.set_max_width(NAMES + column * columns.len() as f32);
            line.show(ui, (name, cx.p.weak), &numbers).on_hover_text(tip);
        });
    }
    ui.add_space(3.0);
    let kernel =
        if step.kernel_m.is_finite() { format!(" within {:.2} mm", units::mm(step.kernel_m)) } else { String::new() };
    let used = format!("{:.0} % of {} points fit{kernel}", step.inlier_share * 100.0, step.points);
    let tip = format!(
        "Points in use at this step: {} of {}. Those within the kernel's width count as fitting",
        step.points,
        shown.inspection.report().offered
    );
    text(cx, ui, &used, &tip);
    if let Some(mask_m2) = step.mask_cost_m2 {
        let [membranes, mask] = [step.cost_m2 - mask_m2, mask_m2].map(root_mm);
        let parts = format!("√cost: membrane {membranes:.2} mm, mask {mask:.2} mm");
        text(cx, ui, &parts, "The two parts of the cost; their squares add up");
    }
    let (start, stop) = (shown.inspection.applied(shown.run), shown.inspection.what_next(shown.run, shown.at));
    if shown.is_last() {
        text(cx, ui, &format!("End: {stop}"), "Why the registration stopped here");
    } else {
        text(cx, ui, &format!("Next: {stop}"), "What the registration does from here");
    }
    if let (Some(requested), Some(applied)) = (shown.inspection.requested(shown.run), start) {
        let same = touch2touch_core::inspect::is_same_place(requested, applied);
        let color = if same { cx.p.weak } else { cx.p.caution };
        let line = if same {
            format!("Start: {}", pose_text(applied))
        } else {
            format!("Start: {} (requested {})", pose_text(applied), pose_text(requested))
        };
        let label = egui::Label::new(egui::RichText::new(line).size(SMALL).color(color)).wrap();
        ui.add(label).on_hover_text("Pose of step 0, and the requested one where it differs");
    }
}

fn text(cx: &Cx<'_>, ui: &mut Ui, text: &str, tip: &str) {
    ui.add(egui::Label::new(caption(text, cx.p)).wrap()).on_hover_text(tip);
}

/// The names of the columns; those of pins let them go.
fn heads(cx: &mut Cx<'_>, ui: &mut Ui, columns: &[(&str, Color32, StepFigures)], pins: [Option<Pin>; 2], width: f32) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
    for (i, (name, color, _)) in columns.iter().enumerate() {
        let right = rect.left() + NAMES + width * (i + 1) as f32 - 2.0;
        let pin = ["A", "B"].iter().position(|n| n == name);
        let text = if pin.is_some() { format!("{name} ×") } else { (*name).to_owned() };
        let place = egui::Rect::from_min_max(pos2(right - width, rect.top()), pos2(right, rect.bottom()));
        ui.painter().text(place.right_center(), Align2::RIGHT_CENTER, text, FontId::proportional(SMALL), *color);
        if let Some(pin) = pin {
            let response = ui.interact(place, ui.scope_id().with(("unpin", pin)), Sense::click());
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Remove step {name}")));
            let about = pins[pin].map_or(String::new(), |p| {
                let registration = p.registration.label();
                format!("{}: {registration}, start {}, step {}. Click to remove it", p.source.name(), p.run + 1, p.at)
            });
            if response.on_hover_text(about).clicked() {
                cx.push(Command::Inspect(InspectCommand::Unpin(pin)));
            }
        }
    }
}
