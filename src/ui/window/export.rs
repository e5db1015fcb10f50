//! Taking things away: the form of a figure, and the menu in each pane's title.

pub(crate) mod import;
pub(crate) mod masks;

use eframe::egui::{self, DragValue, Rect, RichText, Sense, Stroke, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::{Action, with_keys};
use crate::app::command::{ExportCommand, Pane, UiRequest, ViewCommand};
use crate::app::export;
use crate::app::export::{FigureForm, FigureRows, MOST_PAIRS, Output, SCALES, StillAsked};
use crate::app::keys::ImprintSource;
use crate::app::pane::Kind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;
use touch2touch_pipeline::images::figure::{FigurePane, FigureTheme};
use touch2touch_pipeline::images::space::Ground;
use touch2touch_pipeline::images::still::WIDTH_PX;

/// The form of a figure, where it is open. It blocks nothing: pairs and colors can be changed beside it.
pub(crate) fn form(cx: &mut Cx<'_>, ctx: &egui::Context) {
    if !cx.state.export.asking {
        return;
    }
    let mut open = true;
    let mut form = cx.state.export.form.clone();
    let window = egui::Window::new("Figure").id(egui::Id::unique("figure form")).open(&mut open);
    let window = window.collapsible(false).resizable(false).default_pos([320.0, 90.0]);
    window.show(ctx, |ui| {
        ui.set_width(380.0);
        ui.spacing_mut().item_spacing = vec2(8.0, 6.0);
        rows(cx, ui, &mut form);
        columns(cx, ui, &mut form);
        look(cx, ui, &mut form);
        ui.separator();
        let setup = export::figure_setup(cx.state);
        let (count, rig) = (setup.pairs.len() * setup.fingers.len(), cx.state.rig());
        let fits = setup.look.check(count, &rig);
        preview(cx, ui, [setup.look.panes.len(), count], setup.look.size(count, &rig));
        let [width, height] = setup.look.pixels(count, &rig);
        match &fits {
            Ok(()) => {
                let [lo, hi] = [setup.look.range.lo, setup.look.range.hi].map(|m| m * 1e3);
                let panes = setup.look.panes.len();
                let text =
                    format!("{count} x {panes} pictures, {width} x {height} pixels, colors {lo:.1} to {hi:.1} mm");
                ui.label(caption(text, cx.p));
                ui.add(egui::Label::new(caption(setup.note.as_str(), cx.p)).truncate());
            }
            Err(err) => {
                ui.label(RichText::new(format!("It cannot be drawn: {}", err.why)).size(12.0).color(cx.p.caution));
                ui.label(caption(err.hint.as_deref().unwrap_or_default(), cx.p));
            }
        }
        ui.horizontal(|ui| {
            let save = ui.add_enabled(fits.is_ok(), egui::Button::new("Save…"));
            let save = save.accessible_name("Save the figure");
            if save.on_hover_text("Choose a file: .png, or .svg for letters and lines that can be edited").clicked() {
                cx.push(ExportCommand::Place(Output::Figure));
            }
            if ui.button("Close").on_hover_text("What is chosen stays until the program ends").clicked() {
                cx.push(ExportCommand::Ask(false));
            }
        });
    });
    if form != cx.state.export.form {
        cx.push(ExportCommand::SetForm(form));
    }
    if !open {
        cx.push(ExportCommand::Ask(false));
    }
}

fn rows(cx: &Cx<'_>, ui: &mut Ui, form: &mut FigureForm) {
    let listed = cx.state.library.order.len();
    ui.horizontal(|ui| {
        ui.label(caption("Rows", cx.p));
        let one = form.rows == FigureRows::Selected;
        if ui.radio(one, "this pair").on_hover_text("The pair on screen alone").clicked() {
            form.rows = FigureRows::Selected;
        }
        let ticked = cx.state.library.ticked.len();
        let radio = egui::RadioButton::new(form.rows == FigureRows::Ticked, format!("the {ticked} ticked"));
        let tip = with_keys("Pairs ticked in the list: Ctrl+click, or [[tick_pair]] for the one on screen");
        if ui.add_enabled(ticked > 0, radio).on_hover_text(&tip).on_disabled_hover_text(&tip).clicked() {
            form.rows = FigureRows::Ticked;
        }
        let tip = "From the top of the list as it is filtered and sorted now";
        let mut first = match form.rows {
            FigureRows::First(n) => Some(n),
            FigureRows::Selected | FigureRows::Ticked => None,
        };
        if ui.radio(first.is_some(), "the first").on_hover_text(tip).clicked() && first.is_none() {
            first = Some(4);
        }
        let mut count = first.unwrap_or(4);
        let drag = DragValue::new(&mut count).range(1..=MOST_PAIRS);
        let drag = ui.add_enabled(first.is_some(), drag).accessible_name("Pairs of the figure");
        if drag.on_hover_text(tip).changed() {
            first = Some(count);
        }
        form.rows = first.map_or(form.rows, FigureRows::First);
        ui.label(caption(format!("of {listed} listed"), cx.p));
    });
    ui.horizontal(|ui| {
        ui.label(caption("Fingers", cx.p));
        let active = cx.state.finger_name(cx.state.selection.finger);
        for (both, text) in [(false, format!("{active} only")), (true, "all, a row each".to_owned())] {
            if ui.radio(form.both_fingers == both, text).on_hover_text("Which fingers get a row").clicked() {
                form.both_fingers = both;
            }
        }
    });
}

fn columns(cx: &Cx<'_>, ui: &mut Ui, form: &mut FigureForm) {
    let rig = cx.state.rig();
    ui.label(caption("Columns", cx.p));
    egui::Grid::new("figure columns").num_columns(2).show(ui, |ui| {
        for (i, pane) in FigurePane::iter().enumerate() {
            let mut on = form.panes.contains(&pane);
            let response = ui.checkbox(&mut on, pane.title(&rig));
            if response.on_hover_text("Give this pane a column").changed() {
                form.panes.retain(|p| *p != pane);
                if on {
                    form.panes.push(pane);
                }
            }
            if i % 2 == 1 {
                ui.end_row();
            }
        }
    });
}

fn look(cx: &Cx<'_>, ui: &mut Ui, form: &mut FigureForm) {
    ui.horizontal(|ui| {
        ui.label(caption("Scale", cx.p));
        for scale in SCALES {
            let button = ui.selectable_label(form.scale == scale, format!("{scale}x"));
            let button = button.accessible_name(format!("Scale {scale}x"));
            if button.on_hover_text("Pixels of a PNG for each pixel of an imprint").clicked() {
                form.scale = scale;
            }
        }
        ui.add_space(8.0);
        ui.label(caption("Ground", cx.p));
        for (theme, text) in [(FigureTheme::Light, "white"), (FigureTheme::Dark, "dark")] {
            let tip = "White for papers, dark for slides";
            if ui.selectable_label(form.theme == theme, text).on_hover_text(tip).clicked() {
                form.theme = theme;
            }
        }
    });
    ui.horizontal(|ui| {
        ui.label(caption("Colors of errors up to", cx.p));
        let mut mm = form.error_m * 1e3;
        let drag = DragValue::new(&mut mm).speed(0.05).range(0.05..=100.0).suffix(" mm");
        let drag = ui.add(drag).accessible_name("Range of errors in the figure");
        if drag.on_hover_text("Imprints take the locked range of the panes").changed() {
            form.error_m = mm * 1e-3;
        }
    });
}

/// The grid in small: `[columns, rows]`, in a figure of `[width, height]` units.
fn preview(cx: &Cx<'_>, ui: &mut Ui, [columns, rows]: [usize; 2], size: [u32; 2]) {
    const HIGH: f32 = 96.0;
    let (full, _) = ui.allocate_exact_size(vec2(ui.available_width(), HIGH), Sense::hover());
    let [width, height] = size.map(|n| n.max(1) as f32);
    let fit = (full.width() / width).min(HIGH / height);
    let page = Rect::from_min_size(full.min, vec2(width, height) * fit);
    let ground = match cx.state.export.form.theme {
        FigureTheme::Light => egui::Color32::WHITE,
        FigureTheme::Dark => egui::Color32::from_gray(24),
    };
    ui.painter().rect(page, 1.0, ground, Stroke::new(1.0, cx.p.line), egui::StrokeKind::Outside);
    let inner = page.shrink(page.width().min(page.height()) * 0.08);
    let (w, h) = (inner.width() / columns.max(1) as f32, inner.height() / rows.max(1) as f32);
    for y in 0..rows {
        for x in 0..columns {
            let cell = Rect::from_min_size(inner.min + vec2(x as f32 * w, y as f32 * h), vec2(w, h));
            ui.painter().rect_filled(cell.shrink(w.min(h) * 0.08), 0.0, cx.p.accent.gamma_multiply(0.55));
        }
    }
}

/// Frames of a turntable: six seconds of a film.
const FRAMES: u32 = 180;

/// Pictures of a 3D view, by ground and size, from where the view looks now.
fn stills(cx: &mut Cx<'_>, ui: &mut Ui) {
    let pane = cx.state.settings.scene_sides();
    ui.label(caption("3D picture with scale bar, name and provenance", cx.p));
    let angles = cx.shared.angles[cx.state.workbench.side as usize];
    for (ground, name, on) in [
        (Ground::White, "white", "on white"),
        (Ground::Black, "black", "on black"),
        (Ground::Transparent, "no ground", "without ground"),
    ] {
        ui.horizontal(|ui| {
            let asked = StillAsked { pane, width_px: WIDTH_PX, ground, angles, turntable: None };
            let sizes = [(WIDTH_PX, "1x"), (2 * WIDTH_PX, "2x"), (4 * WIDTH_PX, "4x"), (8192, "8k")];
            let sizes = sizes.map(|(width_px, text)| (StillAsked { width_px, ..asked }, text));
            for (asked, text) in sizes.into_iter().chain([(StillAsked { turntable: Some(FRAMES), ..asked }, "film")]) {
                let button = ui.add_enabled(export::can_draw(cx.state), egui::Button::new(text));
                let button = button.accessible_name(format!("Save 3D picture {text} {on}"));
                let size = format!("{} x {} pixels {on}", asked.width_px, asked.width_px);
                let tip = match asked.turntable {
                    None => format!("Save as PNG of {size}, in the direction of this view"),
                    Some(frames) => {
                        format!("Save one turn around the pair as {frames} PNG files of {size}, for a film")
                    }
                };
                if button.on_hover_text(tip).clicked() {
                    cx.push(ExportCommand::Place(Output::Still(asked)));
                    ui.close();
                }
            }
            ui.label(caption(name, cx.p));
        });
    }
}

/// Menu of the files that a pane offers.
pub(crate) fn menu(cx: &mut Cx<'_>, ui: &mut Ui, pane: Pane, error_m: f32) {
    if export::in_figure(cx.state, pane).is_some() {
        ui.label(caption("Picture with bar, unit and scale bar", cx.p));
        ui.horizontal(|ui| {
            for scale in [Some(1), Some(2), Some(4), None] {
                let text = scale.map_or_else(|| "SVG".to_owned(), |scale| format!("{scale}x"));
                let button = ui.add_enabled(export::can_draw(cx.state), egui::Button::new(&text));
                let button = button.accessible_name(format!("Save picture {text}"));
                let tip = match scale {
                    Some(_) => "Save as PNG, drawn on white for papers: pixels for each pixel of an imprint",
                    None => "Save as SVG: letters and lines that can be edited",
                };
                if button.on_hover_text(tip).clicked() {
                    cx.push(ExportCommand::Place(Output::Picture { pane, scale, error_m }));
                    ui.close();
                }
            }
        });
        ui.separator();
    }
    if pane.kind() == Kind::Scene {
        stills(cx, ui);
        ui.separator();
    }
    let sides: &[Action] = match pane.side() {
        Some(ImprintSource::Measured) => &[Action::ExportMeasured],
        Some(ImprintSource::Predicted) => &[Action::ExportPredicted],
        None if pane.is_of_pair() => &[Action::ExportMeasured, Action::ExportPredicted],
        None => &[],
    };
    let table: &[Action] = if matches!(pane, Pane::Results | Pane::Table) { &[Action::ExportTable] } else { &[] };
    for action in [Action::Figure].iter().chain(sides).chain(table).copied() {
        if cx.menu_row(ui, action, false).clicked() {
            ui.close();
        }
    }
    ui.separator();
    let tip = Action::CopyPane.behind("Copies this pane as it is on the screen");
    if ui.button("Copy as picture").on_hover_text(tip).clicked() {
        cx.push(ViewCommand::Ui(UiRequest::PictureOf(pane)));
        ui.close();
    }
    if let Some(command) = export::equivalent(cx.state, pane, error_m) {
        let copy = ui.button("Copy the command");
        let tip = format!("What does the same in a shell:\n{command}");
        if copy.on_hover_text(tip).clicked() {
            ui.copy_text(command);
            ui.close();
        }
    }
}
