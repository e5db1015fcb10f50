//! The steps of a registration, forwards and backwards: the curve of the cost, and the figures of the step shown.

use eframe::egui::{
    self, Align, Align2, Color32, ComboBox, FontId, Label, Layout, Painter, Pos2, Rect, RichText, Role, Sense, Slider,
    Stroke, Ui, UiBuilder, WidgetInfo, pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::{images, scene};
use crate::app::action::{Action, with_keys};
use crate::app::command::{Command, Pane};
use crate::app::inspect::{InspectCommand, Inspected, Inspection};
use crate::app::keys::{ImprintSource, PoseBits, Registration};
use crate::app::results;
use crate::app::settings::prefer;
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, SMALL, caption, mix, pane_frame};
use crate::ui::parts::widget::empty;
use touch2touch_core::align::TraceStep;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// Steps per second while playing.
const PACE: f64 = 8.0;
/// Height of the rows of controls, points.
const ROW: f32 = 26.0;
/// Height of the lines of figures, points.
const FIGURES: f32 = 34.0;

/// The clock of what plays.
#[derive(Default)]
pub(crate) struct Memory {
    /// When the last step went by while playing, seconds.
    played_at: Option<f64>,
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    play(cx, ui, memory);
    pane_frame(cx.p).inner_margin(egui::Margin::symmetric(8, 4)).show(ui, |ui| {
        let full = ui.available_rect_before_wrap();
        ui.set_min_size(full.size());
        let (head, body) = full.split_top_bottom_at_y(full.top() + ROW);
        row(ui, head, |ui| header(cx, ui));
        let lookup = results::inspection(cx.state);
        match (lookup, results::inspected(cx.state)) {
            (Lookup::Failed(err), _) => {
                // What keeps the pose from being there is said in the 3D view.
                let own = cx.state.inspect.start.is_some();
                let why = if own { err.why.clone() } else { String::new() };
                let action = own.then(|| (Action::OwnStarts.name(), Action::OwnStarts.tooltip()));
                within(ui, body, |ui| {
                    if empty::show(ui, "No pose to replay", &why, action) {
                        cx.act(Action::OwnStarts);
                    }
                });
            }
            (Lookup::Absent(absent), _) => within(ui, body, |ui| images::absent_text(cx, ui, absent)),
            (_, Some(shown)) => {
                let (rest, bottom) = body.split_top_bottom_at_y(body.bottom() - ROW);
                let (curves, lines) = rest.split_top_bottom_at_y(rest.bottom() - FIGURES);
                if let Some(command) = plot(cx, ui, curves.shrink2(vec2(0.0, 3.0)), shown) {
                    cx.push(Command::Inspect(command));
                }
                within(ui, lines, |ui| figures(cx, ui, shown));
                row(ui, bottom, |ui| transport(cx, ui, shown));
                if matches!(lookup, Lookup::Stale(_)) {
                    ui.painter().rect_filled(rest, 0.0, cx.p.panel.gamma_multiply(0.5));
                }
            }
            _ => within(ui, body, |ui| {
                empty::show(ui, "Recording the registration…", "", None);
            }),
        }
        ui.advance_cursor_after_rect(full);
    });
}

fn within(ui: &mut Ui, rect: Rect, add: impl FnOnce(&mut Ui)) {
    ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
        ui.set_clip_rect(rect.intersect(ui.clip_rect()));
        add(ui);
    });
}

fn row(ui: &mut Ui, rect: Rect, add: impl FnOnce(&mut Ui)) {
    within(ui, rect, |ui| {
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            add(ui);
        });
    });
}

/// Lets the next step come when its time is there. Nothing is painted for it while nothing plays.
fn play(cx: &mut Cx<'_>, ui: &Ui, memory: &mut Memory) {
    if !cx.state.inspect.playing {
        memory.played_at = None;
        return;
    }
    let now = ui.input(|i| i.time);
    let since = now - *memory.played_at.get_or_insert(now);
    if since >= 1.0 / PACE {
        memory.played_at = Some(now);
        cx.push(Command::Inspect(InspectCommand::By(1)));
    }
    let wait = (1.0 / PACE - since).clamp(0.001, 1.0 / PACE);
    ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(wait));
}

/// `−12.0°, y 2.00, z 0.00 mm`: angle in the lab's sense, y and z of the object's origin in the grasp frame.
fn pose_text(grasp_from_object: PlanarPose) -> String {
    let lab = units::wrap_angle(-grasp_from_object.theta_rad);
    let PlanarPose { y_m, z_m, .. } = grasp_from_object;
    let mm = |meters: f64| units::fixed(units::mm(meters), 2);
    format!("{}, y {}, z {} mm", units::text_deg(lab), mm(y_m), mm(z_m))
}

/// The root of a cost per point, millimeters.
fn root_mm(cost_m2: f64) -> f64 {
    units::mm(cost_m2.max(0.0).sqrt())
}

/// Choice of imprint, registration and start.
fn header(cx: &mut Cx<'_>, ui: &mut Ui) {
    let inspect = cx.state.inspect.clone();
    for source in ImprintSource::iter() {
        images::side_mark(ui, cx.p, source);
        let button = egui::Button::selectable(inspect.source == source, RichText::new(source.name()).size(12.0));
        let button = ui.add(button).accessible_name(format!("Steps of the {} imprint", source.name().to_lowercase()));
        if button.on_hover_text("Whose registration is replayed").clicked() {
            cx.push(Command::Inspect(InspectCommand::Source(source)));
        }
    }
    let registration = cx.state.settings.registration;
    let combo = ComboBox::from_id_salt("registration").width(168.0).selected_text(registration.label());
    let combo = combo.show_ui(ui, |ui| {
        for e in Registration::iter() {
            let on = e == registration.with_own_gate();
            if ui.selectable_label(on, e.label()).on_hover_text(e.description()).clicked() {
                cx.out.push(prefer(move |s| s.registration = e).into());
            }
        }
    });
    combo.response.accessible_name("Registration of the steps").on_hover_text(registration.description());
    match inspect.start.map(PoseBits::get) {
        Some(start) => {
            ui.label(caption(format!("from {}", pose_text(start)), cx.p))
                .on_hover_text("The requested start; step 0 shows where it really began");
            cx.action_button(ui, Action::OwnStarts, "All starts");
        }
        None => starts(cx, ui),
    }
}

/// One button per start; the winner is marked.
fn starts(cx: &mut Cx<'_>, ui: &mut Ui) {
    /// More do not fit beside each other: they are chosen in the curves.
    const MOST: usize = 10;
    let Some(shown) = results::inspected(cx.state) else { return };
    ui.label(caption("start", cx.p));
    let inspection = shown.inspection.clone();
    for run in 0..inspection.num_runs().min(MOST) {
        let winner = run == inspection.report().winner;
        let text = RichText::new((run + 1).to_string()).size(12.0);
        let text = if winner { text.color(cx.p.good) } else { text };
        let button = ui.add(egui::Button::selectable(run == shown.run, text));
        let button = button.accessible_name(format!("Start {}", run + 1));
        let about = match (inspection.requested(run), inspection.report().runs.get(run)) {
            (Some(start), Some(r)) => {
                let best = if winner { "Best. " } else { "" };
                format!("{best}Starts at {}; {}", pose_text(start), r.stop)
            }
            _ => String::new(),
        };
        if button.on_hover_text(about).clicked() {
            cx.push(Command::Inspect(InspectCommand::Run(run)));
        }
    }
    if inspection.num_runs() > MOST {
        ui.label(caption(format!("of {}", inspection.num_runs()), cx.p));
    }
}

/// The pose of the step shown with its error, and what fits there.
fn figures(cx: &Cx<'_>, ui: &mut Ui, shown: Inspected<'_>) {
    ui.spacing_mut().item_spacing.y = 1.0;
    let (step, pose) = (shown.step, shown.step.grasp_from_object);
    let mut color = cx.p.strong;
    let mut text = pose_text(pose);
    if let Some(off) = results::off_truth(cx.state, pose) {
        text += &format!("   off by {}", units::text_deg(off.angle_rad));
        color = scene::error_color(cx.p, off.angle_rad);
    }
    ui.add(Label::new(RichText::new(text).size(12.0).color(color)).truncate())
        .on_hover_text("Angle with the sign that the lab reports; position of the tool's origin in the grasp frame");
    let kernel =
        if step.kernel_m.is_finite() { format!(" within {:.2} mm", units::mm(step.kernel_m)) } else { String::new() };
    let mut text = format!(
        "{:.0} % of {} points fit{kernel}, cost {:.2} mm",
        step.inlier_share * 100.0,
        step.points,
        root_mm(step.cost_m2)
    );
    if let Some(mask_m2) = step.mask_cost_m2 {
        text += &format!(" (membrane {:.2}, mask {:.2})", root_mm(step.cost_m2 - mask_m2), root_mm(mask_m2));
    }
    let next = if shown.is_last() { "ends" } else { "next" };
    text += &format!(" · {next}: {}", shown.inspection.what_next(shown.run, shown.at));
    ui.add(Label::new(caption(text, cx.p)).truncate()).on_hover_text(
        "Points in use, and those within the kernel's width; the root of the cost per point, which is comparable \
         within one kernel width",
    );
}

/// Buttons and slider.
fn transport(cx: &mut Cx<'_>, ui: &mut Ui, shown: Inspected<'_>) {
    let (steps, at, run) = (shown.inspection.num_steps(shown.run), shown.at, shown.run);
    for (action, text) in [
        (Action::StepBack, "<"),
        (Action::PlaySteps, if cx.state.inspect.playing { "Pause" } else { "Play" }),
        (Action::StepForward, ">"),
    ] {
        cx.action_button(ui, action, text);
    }
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let text = format!("step {at} of {}", steps.saturating_sub(1));
        ui.add_sized([92.0, 18.0], Label::new(RichText::new(text).size(SMALL).color(cx.p.text)));
        ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(24.0);
        let mut to = at;
        let slider = Slider::new(&mut to, 0..=steps.saturating_sub(1)).show_value(false);
        let slider = ui.add_enabled(steps > 1, slider).accessible_name("Step");
        let tip = "Step shown; 0 is the start. [[step_back]] and [[step_forward]] step";
        if slider.on_hover_text(with_keys(tip)).changed() {
            cx.push(Command::Inspect(InspectCommand::Go { run, at: to }));
        }
    });
}

/// The cost over the steps, a curve for each start.
struct Plot<'a> {
    inspection: &'a Inspection,
    rect: Rect,
    /// Steps of the longest run, at least 2.
    steps: usize,
    /// The top of the axis, millimeters.
    top_mm: f64,
}

impl<'a> Plot<'a> {
    fn new(inspection: &'a Inspection, rect: Rect) -> Self {
        let runs = 0..inspection.num_runs();
        let steps = runs.clone().map(|run| inspection.num_steps(run)).max().unwrap_or(0).max(2);
        let costs = runs.flat_map(|run| inspection.steps(run)).map(|step| root_mm(step.cost_m2));
        let highest = costs.filter(|v| v.is_finite()).fold(0.0, f64::max);
        Self { inspection, rect, steps, top_mm: round_up(highest) }
    }

    fn x(&self, at: usize) -> f32 {
        self.rect.left() + self.rect.width() * at as f32 / (self.steps - 1) as f32
    }

    fn place(&self, at: usize, step: &TraceStep) -> Pos2 {
        let share = (root_mm(step.cost_m2) / self.top_mm).clamp(0.0, 1.0) as f32;
        pos2(self.x(at), self.rect.bottom() - share * self.rect.height())
    }

    /// The step under the pointer: start, step, and its place.
    fn nearest(&self, to: Pos2) -> Option<(usize, usize, Pos2)> {
        const NEAR: f32 = 14.0;
        let runs = 0..self.inspection.num_runs();
        let places = runs.flat_map(|run| {
            self.inspection.steps(run).enumerate().map(move |(at, step)| (run, at, self.place(at, step)))
        });
        let near = places.filter(|(.., place)| place.distance(to) <= NEAR);
        near.min_by(|(.., a), (.., b)| a.distance(to).total_cmp(&b.distance(to)))
    }
}

/// A round number at or above a positive one.
fn round_up(value: f64) -> f64 {
    if !(value > 0.0 && value.is_finite()) {
        return 1.0;
    }
    let base = 10f64.powf(value.log10().floor());
    [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0].into_iter().map(|m| m * base).find(|v| *v >= value).unwrap_or(value)
}

/// Draws the curves; a click or a drag asks for a step.
fn plot(cx: &Cx<'_>, ui: &Ui, full: Rect, shown: Inspected<'_>) -> Option<InspectCommand> {
    let response = ui.interact(full, ui.scope_id().with("curves"), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Cost over the steps"));
    let p = cx.p;
    let rect = Rect::from_min_max(full.min + vec2(34.0, 16.0), full.max - vec2(6.0, 16.0));
    let plot = Plot::new(shown.inspection, rect);
    let painter = ui.painter_at(full);
    axes(p, &painter, &plot);
    let runs = 0..plot.inspection.num_runs();
    for run in runs.filter(|run| *run != shown.run).chain([shown.run]) {
        curve(p, &painter, &plot, run, run == shown.run);
    }
    painter.vline(plot.x(shown.at), rect.y_range(), Stroke::new(1.0, p.strong));
    painter.circle(plot.place(shown.at, shown.step), 4.0, p.accent, Stroke::new(1.5, p.strong));
    let hovered = response.hover_pos().and_then(|pos| plot.nearest(pos));
    if let Some((run, at, place)) = hovered
        && let Some(step) = plot.inspection.step(run, at)
    {
        painter.circle_stroke(place, 6.0, Stroke::new(1.0, p.strong));
        let fit = step.inlier_share * 100.0;
        let text = format!("start {}, step {at}: {} · {fit:.0} % fit", run + 1, pose_text(step.grasp_from_object));
        response.clone().on_hover_text_at_pointer(text);
    }
    if !response.clicked() && !response.dragged() {
        return None;
    }
    let share = ((response.interact_pointer_pos()?.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    // A click on another start's curve shows that start; a drag stays with the one shown.
    let (run, at) = match hovered {
        Some((run, at, _)) if response.clicked() => (run, at),
        _ => (shown.run, (share * (plot.steps - 1) as f32).round() as usize),
    };
    ((run, at) != (shown.run, shown.at)).then_some(InspectCommand::Go { run, at })
}

fn axes(p: &Palette, painter: &Painter, plot: &Plot<'_>) {
    let (rect, font) = (plot.rect, FontId::proportional(10.0));
    for share in [0.0, 0.5, 1.0] {
        let y = rect.bottom() - share as f32 * rect.height();
        painter.hline(rect.x_range(), y, Stroke::new(1.0, p.line));
        let value = plot.top_mm * share;
        let text = if plot.top_mm >= 10.0 || value == 0.0 { format!("{value:.0}") } else { format!("{value:.2}") };
        painter.text(pos2(rect.left() - 4.0, y), Align2::RIGHT_CENTER, text, font.clone(), p.weak);
    }
    let title = pos2(rect.left(), rect.top() - 4.0);
    painter.text(title, Align2::LEFT_BOTTOM, "root of the cost per point, mm", font.clone(), p.weak);
    let last = plot.steps - 1;
    let every = [1, 2, 5, 10, 20, 50, 100].into_iter().find(|e| last / e <= 10).unwrap_or(last.max(1));
    for at in (0..=last).step_by(every) {
        let place = pos2(plot.x(at), rect.bottom() + 2.0);
        painter.text(place, Align2::CENTER_TOP, at.to_string(), font.clone(), p.weak);
    }
}

fn curve(p: &Palette, painter: &Painter, plot: &Plot<'_>, run: usize, shown: bool) {
    let color: Color32 = if shown { p.accent } else { mix(p.panel, p.weak, 0.7) };
    let stroke = Stroke::new(if shown { 2.0 } else { 1.0 }, color);
    let steps: Vec<&TraceStep> = plot.inspection.steps(run).collect();
    for (at, pair) in steps.windows(2).enumerate() {
        // A jump of the cost at another kernel is no change of the fit: no line.
        if pair[0].kernel_m == pair[1].kernel_m && pair[0].points == pair[1].points {
            painter.line_segment([plot.place(at, pair[0]), plot.place(at + 1, pair[1])], stroke);
        }
    }
    for (at, step) in steps.iter().enumerate() {
        painter.circle_filled(plot.place(at, step), if shown { 2.0 } else { 1.2 }, color);
    }
    if run == plot.inspection.report().winner
        && let Some(step) = steps.last()
    {
        painter.circle_stroke(plot.place(steps.len() - 1, step), 5.0, Stroke::new(1.5, p.good));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_round_numbers() {
        for (value, top) in [(0.34, 0.4), (1.0, 1.0), (4.2, 5.0), (12.0, 15.0), (81.0, 100.0)] {
            assert!((round_up(value) - top).abs() < 1e-9, "{value}");
        }
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(round_up(odd), 1.0);
        }
    }
}
