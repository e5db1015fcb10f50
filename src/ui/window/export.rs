//! Taking things away: the menu in each pane's title.

use eframe::egui::{self, Align2, Color32, ColorImage, FontId, Rect, RichText, Sense, Ui, Vec2, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{ExportCommand, Pane, UiRequest, ViewCommand};
use crate::app::export::{self, Output, StillAsked};
use crate::app::keys::ImprintSource;
use crate::app::pane::Kind;
use crate::app::results;
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;
use touch2touch_pipeline::export::import::Import;
use touch2touch_pipeline::export::{ExportChoice, Plan, Which};
use touch2touch_pipeline::io::exchange::Format;
use touch2touch_pipeline::still::WIDTH_PX;
use touch2touch_pipeline::still::space::Ground;

/// Frames of a turntable: six seconds of a film.
const FRAMES: u32 = 180;

/// The row that asks for a picture of a 3D view.
fn still(cx: &mut Cx<'_>, ui: &mut Ui) {
    let button = ui.add_enabled(export::can_draw(cx.state), egui::Button::new("Save 3D picture…"));
    if button.on_hover_text("PNG of this pair, in a size and on a ground of your choice").clicked() {
        let asked = StillAsked {
            pane: cx.state.settings.scene_sides(),
            width_px: 2 * WIDTH_PX,
            ground: Ground::White,
            angles: cx.shared.angles[cx.state.workbench.side as usize],
            turntable: None,
        };
        cx.push(ExportCommand::AskStill(Some(asked)));
        ui.close();
    }
}

/// The form of a 3D picture, where it is open, with what would be saved: the pair on screen from where the view looks now.
pub(crate) fn still_form(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let Some((before, _)) = cx.state.export.still else { return };
    let angles = cx.shared.angles[cx.state.workbench.side as usize];
    let mut asked = StillAsked { pane: cx.state.settings.scene_sides(), angles, ..before };
    let closed = form(ctx, "Save 3D picture", |ui| {
        ui.horizontal(|ui| {
            ui.label(caption("Size", cx.p));
            for scale in [1, 2, 4] {
                let px = scale * WIDTH_PX;
                ui.radio_value(&mut asked.width_px, px, format!("{scale}x"))
                    .on_hover_text(format!("{px} x {px} pixels"));
            }
            ui.add_space(16.0);
            ui.label(caption("Ground", cx.p));
            for (ground, text) in
                [(Ground::White, "white"), (Ground::Black, "black"), (Ground::Transparent, "transparent")]
            {
                ui.radio_value(&mut asked.ground, ground, text);
            }
        });
        let mut turntable = asked.turntable.is_some();
        let tip = format!(
            "A folder with {FRAMES} frames once around the pair, six seconds of a film, in place of one picture"
        );
        ui.checkbox(&mut turntable, "turntable").on_hover_text(tip);
        asked.turntable = turntable.then_some(FRAMES);
        preview(cx, ui);
        let save = ui.add_enabled(export::can_draw(cx.state), egui::Button::new("Save…"));
        if save.accessible_name("Choose where the 3D picture goes").clicked() {
            cx.push(ExportCommand::Place(Output::Still(asked)));
        }
    });
    if closed {
        cx.push(ExportCommand::AskStill(None));
    } else if asked != before {
        cx.push(ExportCommand::AskStill(Some(asked)));
    }
}

/// The picture that would be saved, or the one before while it is drawn.
fn preview(cx: &mut Cx<'_>, ui: &mut Ui) {
    const SLOT: &str = "preview of a 3D picture";
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(ui.available_width()), Sense::hover());
    let key = export::still_key(cx.state);
    let found = key.as_ref().map(|key| cx.state.look(key.clone()).value());
    let texture = match (&found, key) {
        (Some(Lookup::Ready(picture)), Some(key)) => {
            let image =
                || (ColorImage::from_rgba_unmultiplied(picture.size(), picture.as_slice().as_flattened()), None);
            Some(cx.shared.textures.get(ui.ctx(), SLOT, key, false, image))
        }
        _ => cx.shared.textures.last(SLOT),
    };
    if let Some(picture) = texture {
        let uv = Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
        ui.painter().image(picture.texture.id(), rect, uv, Color32::WHITE);
    }
    let said = match &found {
        Some(Lookup::Failed(err)) => err.to_string(),
        Some(Lookup::Ready(_)) => String::new(),
        _ => "Drawing…".to_owned(),
    };
    ui.painter().text(rect.left_top() + vec2(6.0, 4.0), Align2::LEFT_TOP, said, FontId::proportional(12.0), cx.p.weak);
    response.on_hover_text("Turn the 3D view to look from elsewhere");
}

/// Menu of the files that a pane offers.
pub(crate) fn menu(cx: &mut Cx<'_>, ui: &mut Ui, pane: Pane) {
    if pane.kind() == Kind::Scene {
        still(cx, ui);
        ui.separator();
    }
    let sides: &[Action] = match pane.side() {
        Some(ImprintSource::Measured) => &[Action::ExportMeasured],
        Some(ImprintSource::Predicted) => &[Action::ExportPredicted],
        None if pane.is_of_pair() => &[Action::ExportMeasured, Action::ExportPredicted],
        None => &[],
    };
    let table: &[Action] = if pane == Pane::Results { &[Action::ExportTable] } else { &[] };
    for action in sides.iter().chain(table).copied() {
        if cx.menu_row(ui, action, false).clicked() {
            ui.close();
        }
    }
    ui.separator();
    for (copied, text, tip) in [
        (false, "Save as picture", Action::SavePane.behind("Saves this pane as PNG")),
        (true, "Copy as picture", Action::CopyPane.behind("Copies this pane as a picture")),
    ] {
        if ui.button(text).on_hover_text(tip).clicked() {
            cx.push(ViewCommand::Ui(UiRequest::PanePicture { pane: Some(pane), copied }));
            ui.close();
        }
    }
    if let Some(command) = export::equivalent(cx.state, pane) {
        let copy = ui.button("Copy as command line");
        let tip = format!("Command line for this:\n{command}");
        if copy.on_hover_text(tip).clicked() {
            ui.copy_text(command);
            ui.close();
        }
    }
}

/// A form beside the panes, in the middle at first; true where it was closed. It blocks nothing: pairs can be drawn and marked.
fn form(ctx: &egui::Context, title: &str, add: impl FnOnce(&mut Ui)) -> bool {
    let mut open = true;
    let window = egui::Window::new(title).id(egui::Id::unique(("form", title))).open(&mut open);
    let middle = ctx.content_rect().center();
    let window = window.collapsible(false).resizable(false).pivot(egui::Align2::CENTER_CENTER).default_pos(middle);
    window.show(ctx, |ui| {
        ui.set_width(400.0);
        ui.spacing_mut().item_spacing = vec2(8.0, 6.0);
        add(ui);
    });
    !open
}

/// The form of an import of masks, where it is open: what would change is said before anything does.
pub(crate) fn import_form(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let Some(asked) = cx.state.export.importing.clone() else { return };
    let closed = form(ctx, "Import masks", |ui| {
        ui.add(egui::Label::new(caption(asked.from.display().to_string(), cx.p)).wrap());
        let mut over_drawn = asked.over_drawn;
        let tip = "Off: hand-drawn pixels stay, and so do the masks of pairs that are done, flagged or skipped. Can be undone, \
                   pair by pair";
        let tick = ui.checkbox(&mut over_drawn, "also replace hand-drawn masks and reviewed pairs").on_hover_text(tip);
        if tick.changed() {
            cx.push(ExportCommand::ImportOverHand(over_drawn));
        }
        ui.separator();
        let ready = import_plan(cx, ui);
        ui.horizontal(|ui| {
            let import = ui.add_enabled(ready, egui::Button::new("Import")).accessible_name("Import these masks");
            let tip = "Makes them the masks of the measured imprints. No pair is marked done";
            if import.on_hover_text(tip).clicked() {
                cx.push(ExportCommand::Import);
            }
        });
    });
    if closed {
        cx.push(ExportCommand::AskImport(None));
    }
}

/// Plan, line by line, or that it is `nothing`; true where there is something to do.
fn plan<T>(
    cx: &Cx<'_>,
    ui: &mut Ui,
    found: Lookup<'_, T>,
    said: impl FnOnce(&T) -> (Vec<String>, bool),
    [nothing, waiting]: [RichText; 2],
) -> bool {
    let mut line = |text: RichText| _ = ui.add(egui::Label::new(text).wrap());
    match found {
        Lookup::Ready(plan) | Lookup::Stale(plan) => {
            let (lines, some) = said(plan);
            lines.into_iter().for_each(|text| line(RichText::new(text).size(12.0).color(cx.p.text)));
            if !some {
                line(nothing.size(12.0).color(cx.p.caution));
            }
            return some;
        }
        Lookup::Failed(err) => line(RichText::new(err.to_string()).size(12.0).color(cx.p.wrong)),
        Lookup::Waiting | Lookup::Absent(_) => line(waiting.color(cx.p.weak)),
    }
    false
}

/// Changes that the import would make; true where there are any.
fn import_plan(cx: &Cx<'_>, ui: &mut Ui) -> bool {
    let Some(key) = results::import_plan_key(cx.state) else { return false };
    let said = |plan: &Import| {
        let format = format!("Format: {}", plan.format.name());
        (std::iter::once(format).chain(plan.lines()).collect(), plan.total() > 0)
    };
    let texts = [RichText::new("Nothing would change."), RichText::new("Reading the masks…").size(12.0)];
    plan(cx, ui, cx.state.look(key).value(), said, texts)
}

/// The form of an export of masks, where it is open: what goes where is said before anything is written.
pub(crate) fn masks_form(cx: &mut Cx<'_>, ctx: &egui::Context) {
    if !cx.state.export.asking_masks {
        return;
    }
    let mut choice = cx.state.export.masks;
    let closed = form(ctx, "Export masks", |ui| {
        mask_choices(cx, ui, &mut choice);
        ui.separator();
        let ready = mask_plan(cx, ui);
        ui.horizontal(|ui| {
            let write = ui.add_enabled(ready, egui::Button::new("Choose folder…"));
            let write = write.accessible_name("Choose the folder of the export");
            let tip = format!(
                "A new or empty folder, or a previous export. {}. Everything written is read back and checked.",
                choice.format.text()
            );
            if write.on_hover_text(tip).clicked() {
                cx.push(ExportCommand::Place(Output::Masks));
            }
        });
    });
    if choice != cx.state.export.masks {
        cx.push(ExportCommand::SetMasks(choice));
    }
    if closed {
        cx.push(ExportCommand::AskMasks(false));
    }
}

fn mask_choices(cx: &Cx<'_>, ui: &mut Ui, choice: &mut ExportChoice) {
    ui.horizontal(|ui| {
        ui.label(caption("Masks", cx.p));
        for (which, text, tip) in [
            (Which::Done, "done", "Pairs marked \"done\" that have a mask drawn by hand"),
            (Which::Begun, "done and in progress", "Also pairs whose mask was begun"),
        ] {
            let radio = ui.radio(choice.which == which, text);
            if radio.on_hover_text(format!("{tip}. Never skipped or flagged pairs")).clicked() {
                choice.which = which;
            }
        }
    });
    ui.horizontal(|ui| {
        ui.label(caption("Format", cx.p));
        for format in Format::iter() {
            if ui.radio(choice.format == format, format.name()).on_hover_text(format.text()).clicked() {
                choice.format = format;
            }
        }
    });
    let tip =
        "Off: pairs reserved for tests (test_only) go to test, so that no model is scored on what it was trained on";
    ui.checkbox(&mut choice.test_in_train, "train on pairs reserved for tests").on_hover_text(tip);
    let tip = "So that scores are on tools the model was not trained on. Off: pairs are split one by one";
    ui.checkbox(&mut choice.by_tool, "keep each tool in one split").on_hover_text(tip);
    let tip = "All other pixels are written as ignored";
    ui.checkbox(&mut choice.manual_checked, "only pixels painted by hand").on_hover_text(tip);
}

/// Division of the export; true where there is something to write.
fn mask_plan(cx: &Cx<'_>, ui: &mut Ui) -> bool {
    let Some(key) = results::mask_plan_key(cx.state) else { return false };
    let nothing = Action::DoneAndNext.behind("Nothing to write yet: edit a mask and mark its pair done");
    let said = |plan: &Plan| (plan.lines(), plan.total() > 0);
    plan(cx, ui, cx.state.look(key).value(), said, [RichText::new(nothing), caption("…", cx.p)])
}
