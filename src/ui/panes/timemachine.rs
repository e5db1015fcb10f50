//! The time machine: the steps of a registration, forwards and backwards, with everything they are judged by.

mod plot;
mod table;

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{
    self, Align, Color32, ComboBox, Layout, Pos2, Rect, RichText, Shape, Slider, Stroke, Ui, UiBuilder, pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::images;
use crate::app::action::{Action, with_keys};
use crate::app::command::{Command, Pane};
use crate::app::inspect::{InspectCommand, Inspected};
use crate::app::keys::{ImprintSource, PoseBits, Registration};
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, pane_frame};
use crate::ui::parts::widget::empty;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// Steps per second while playing.
const PACE: f64 = 8.0;
/// Width of the table beside the curves, points.
const TABLE: f32 = 292.0;
/// Height of the rows of controls, points.
const ROW: f32 = 26.0;

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
        row(ui, Rect::from_min_size(full.min, vec2(full.width(), ROW)), |ui| header(cx, ui));
        let body = Rect::from_min_max(pos2(full.left(), full.top() + ROW + 2.0), full.max);
        let lookup = results::inspection(cx.state);
        match (lookup, results::inspected(cx.state)) {
            (Lookup::Failed(err), _) => {
                let (why, own) = (err.why.clone(), cx.state.inspect.start.is_some());
                let action = own.then(|| (Action::OwnStarts.name(), Action::OwnStarts.tooltip()));
                within(ui, body, |ui| {
                    if empty::show(ui, "No pose to replay", &why, action) {
                        cx.act(Action::OwnStarts);
                    }
                });
            }
            (Lookup::Absent(absent), _) => within(ui, body, |ui| images::absent_text(cx, ui, absent)),
            (_, Some(shown)) => {
                let bottom = Rect::from_min_max(pos2(body.left(), body.bottom() - ROW), body.max);
                let middle = Rect::from_min_max(body.min, pos2(body.right(), bottom.top() - 2.0));
                let split = middle.right() - TABLE.min(middle.width() * 0.5);
                let curves = Rect::from_min_max(middle.min, pos2(split - 10.0, middle.bottom()));
                let figures = Rect::from_min_max(pos2(split, middle.top()), middle.max);
                if let Some(command) = plot::show(cx, ui, curves, shown) {
                    cx.push(Command::Inspect(command));
                }
                within(ui, figures, |ui| table::show(cx, ui, shown));
                row(ui, bottom, |ui| transport(cx, ui, shown));
                if matches!(lookup, Lookup::Stale(_)) {
                    ui.painter().rect_filled(middle, 0.0, cx.p.panel.gamma_multiply(0.5));
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

/// `−12.0°, 2.00, 0.00 mm`: angle in the lab's sense, y and z of the object's origin in the grasp frame.
pub(crate) fn pose_text(grasp_from_object: PlanarPose) -> String {
    let lab = units::wrap_angle(-grasp_from_object.theta_rad);
    let PlanarPose { y_m, z_m, .. } = grasp_from_object;
    let mm = |meters: f64| units::fixed(units::mm(meters), 2);
    format!("{}, y {}, z {} mm", units::text_deg(lab), mm(y_m), mm(z_m))
}

/// Choice of imprint, registration and start.
fn header(cx: &mut Cx<'_>, ui: &mut Ui) {
    let inspect = cx.state.inspect.clone();
    for source in [ImprintSource::Measured, ImprintSource::Predicted] {
        images::side_mark(ui, cx.p, source);
        let button = egui::Button::selectable(inspect.source == source, RichText::new(source.name()).size(12.0));
        let button = ui.add(button).accessible_name(format!("Steps of the {} imprint", source.name().to_lowercase()));
        if button.on_hover_text("Whose registration is replayed").clicked() {
            cx.push(Command::Inspect(InspectCommand::Source(source)));
        }
    }
    ui.add_space(4.0);
    let registration = cx.state.settings.registration;
    let combo = ComboBox::from_id_salt("time machine engine").width(168.0).selected_text(registration.label());
    let combo = combo.show_ui(ui, |ui| {
        for e in Registration::iter() {
            if ui
                .selectable_label(e == registration.with_own_gate(), e.label())
                .on_hover_text(e.description())
                .clicked()
            {
                cx.out.push(prefer(move |s| s.registration = e).into());
            }
        }
    });
    combo.response.accessible_name("Registration of the steps").on_hover_text(registration.description());
    ui.add_space(4.0);
    match inspect.start.map(PoseBits::get) {
        Some(start) => {
            ui.label(caption(format!("from {}", pose_text(start)), cx.p))
                .on_hover_text("The requested start; step 0 shows where it really began");
            cx.action_button(ui, Action::OwnStarts, "All starts");
        }
        None => runs(cx, ui),
    }
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let mut lines = inspect.lines;
        let text = RichText::new("Show pull lines").size(12.0);
        let tip = "Draws lines in 3D from contact points to where they are pulled on the tool";
        if ui.checkbox(&mut lines, text).on_hover_text(with_keys(tip)).changed() {
            cx.push(Command::Inspect(InspectCommand::Lines(lines)));
        }
    });
}

/// One button per start; the winner is marked.
fn runs(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(shown) = results::inspected(cx.state) else { return };
    ui.label(caption("start", cx.p));
    let inspection = shown.inspection.clone();
    /// More do not fit beside each other: they are chosen in the curves.
    const MOST: usize = 10;
    for run in 0..inspection.num_runs().min(MOST) {
        let winner = run == inspection.report().winner;
        let mut text = RichText::new((run + 1).to_string()).size(12.0);
        if winner {
            text = text.color(cx.p.good);
        }
        let button = ui.add(egui::Button::selectable(run == shown.run, text));
        let button = button.accessible_name(format!("Start {}", run + 1));
        let about = match (inspection.requested(run), inspection.report().runs.get(run)) {
            (Some(start), Some(r)) => {
                let winner = if winner { "Best. " } else { "" };
                format!("{winner}Starts at {}; {}", pose_text(start), r.stop)
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

/// Icon on a button of the transport.
#[derive(Clone, Copy)]
enum Icon {
    First,
    Back,
    Play,
    Pause,
    Forward,
    Last,
}

impl Icon {
    /// Twelve points across. Drawn, because no font of the program has all of them.
    fn paint(self, ui: &Ui, center: Pos2, color: Color32) {
        let painter = ui.painter();
        let bar = |x: f32, width: f32| {
            painter.rect_filled(Rect::from_center_size(center + vec2(x, 0.0), vec2(width, 10.0)), 0.0, color);
        };
        // Points to the right for 1, to the left for -1.
        let triangle = |x: f32, side: f32| {
            let corners = [vec2(-4.0 * side, -5.0), vec2(4.0 * side, 0.0), vec2(-4.0 * side, 5.0)];
            let corners = corners.map(|c| center + vec2(x, 0.0) + c).to_vec();
            painter.add(Shape::convex_polygon(corners, color, Stroke::NONE));
        };
        match self {
            Self::First => {
                bar(-5.0, 2.0);
                triangle(1.0, -1.0);
            }
            Self::Back => {
                triangle(-2.0, -1.0);
                bar(4.0, 2.0);
            }
            Self::Play => triangle(0.0, 1.0),
            Self::Pause => {
                bar(-3.0, 3.0);
                bar(3.0, 3.0);
            }
            Self::Forward => {
                bar(-4.0, 2.0);
                triangle(2.0, 1.0);
            }
            Self::Last => {
                triangle(-1.0, 1.0);
                bar(5.0, 2.0);
            }
        }
    }
}

/// Buttons and slider.
fn transport(cx: &mut Cx<'_>, ui: &mut Ui, shown: Inspected<'_>) {
    let (steps, at, run) = (shown.inspection.num_steps(shown.run), shown.at, shown.run);
    let playing = cx.state.inspect.playing;
    for (action, icon) in [
        (Action::FirstStep, Icon::First),
        (Action::StepBack, Icon::Back),
        (Action::PlaySteps, if playing { Icon::Pause } else { Icon::Play }),
        (Action::StepForward, Icon::Forward),
        (Action::LastStep, Icon::Last),
    ] {
        let button = cx.action_button(ui, action, "      ");
        let color = if action.command(cx.state).is_some() { cx.p.strong } else { cx.p.weak.gamma_multiply(0.5) };
        icon.paint(ui, button.rect.center(), color);
    }
    ui.add_space(4.0);
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        cx.action_button(ui, Action::PinStep, "Compare step");
        let text = format!("step {at} of {}", steps.saturating_sub(1));
        ui.add_sized([92.0, 18.0], egui::Label::new(RichText::new(text).size(SMALL).color(cx.p.text)));
        ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(24.0);
        let mut to = at;
        let slider = Slider::new(&mut to, 0..=steps.saturating_sub(1)).show_value(false);
        let slider = ui.add_enabled(steps > 1, slider).accessible_name("Step");
        let tip = "Step shown; 0 is the start. [[step_back]] and [[step_forward]] step, [[first_step]] and \
                   [[last_step]] jump to the ends";
        if slider.on_hover_text(with_keys(tip)).changed() {
            cx.push(Command::Inspect(InspectCommand::Go { run, at: to }));
        }
    });
}
