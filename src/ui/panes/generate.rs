//! The generator: bundle, steps, seed, depth scale, run, and the results so far.

use crate::app::settings::prefer;
use crate::app::{recipe, results};
use eframe::egui::{self, RichText, ScrollArea, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{Pane, PredictCommand};
use crate::app::keys::{ComparisonKey, PredictionKey, Preset, Sampler, ShiftMode, shift_name, shift_tooltip};
use crate::app::settings::{GenerateSettings, STEPS};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section, value};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::scroll_to_focus;
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};

/// Width of the captions at the left.
const LABEL: f32 = 72.0;

/// A caption at the left of its control.
fn row(ui: &mut Ui, weak: egui::Color32, name: &str, add: impl FnOnce(&mut Ui)) {
    // In a narrow pane what does not fit beside the name stands below it.
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(vec2(LABEL, 24.0), layout, |ui| {
            ui.set_min_width(LABEL);
            ui.label(RichText::new(name).color(weak));
        });
        add(ui);
    });
}

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    // Above what scrolls: it is in sight in the lowest window.
    run(cx, ui);
    ScrollArea::vertical().id_salt("generate").show(ui, |ui| {
        let bundle = recipe::bundle(cx.state, BundleKind::Generator).ok();
        let spelt_out = cx.state.settings.generate.spelt_out(bundle);
        let mut new = spelt_out.clone();
        model(cx, ui, &mut new);
        presets(cx, ui, &mut new);
        mapping(cx, ui);
        fit_parts(cx, ui);
        let more = egui::CollapsingHeader::new(RichText::new("More").size(SMALL)).id_salt("more of generate");
        let more = more.show(ui, |ui| numbers(cx, ui, &mut new));
        more.header_response.on_hover_text("Sampler, steps, seed, previews");
        if new != spelt_out {
            // Whoever changes a number has left the preset.
            if new.preset == spelt_out.preset && !new.same_numbers(&spelt_out) {
                new.preset = None;
            }
            cx.push(prefer(move |s| s.generate = new.clone()));
        }
        results(cx, ui);
        scroll_to_focus(ui);
    });
}

/// The model bundle, and the folders that are none.
fn model(cx: &Cx<'_>, ui: &mut Ui, new: &mut GenerateSettings) {
    row(ui, cx.p.weak, "Model", |ui| {
        let bundles: Vec<_> = cx.state.library.bundles.iter().filter(|b| b.kind == BundleKind::Generator).collect();
        let current = recipe::bundle(cx.state, BundleKind::Generator).map_or("none found", |b| b.name.as_str());
        let combo =
            egui::ComboBox::from_id_salt("bundle").width(ui.available_width() - 8.0).selected_text(current).truncate();
        let response = combo.show_ui(ui, |ui| {
            for bundle in bundles {
                let chosen = bundle.name == current;
                // One for other sensors stays in the list, and says why it cannot be used.
                let misfit = bundle.ends(&cx.state.rig()).and_then(Result::err);
                let label = egui::Button::selectable(chosen, egui::RichText::new(&bundle.name));
                let option = ui.add_enabled(misfit.is_none(), label);
                let option = match misfit {
                    Some(misfit) => option.on_disabled_hover_text(misfit.to_string()),
                    None => option.on_hover_text(bundle.origin.to_string()),
                };
                if option.clicked() {
                    new.bundle = Some(bundle.name.clone());
                }
            }
        });
        response.response.accessible_name("Model").on_hover_text("The model that predicts imprints");
    });
    for problem in &cx.state.library.bundle_problems {
        ui.label(RichText::new(problem.to_string()).size(SMALL).color(cx.p.wrong));
    }
}

/// Choice of the numbers in one word.
fn presets(cx: &Cx<'_>, ui: &mut Ui, new: &mut GenerateSettings) {
    let bundle = recipe::bundle(cx.state, BundleKind::Generator).ok();
    row(ui, cx.p.weak, "Preset", |ui| {
        for preset in Preset::iter() {
            let (name, help) = preset_texts(preset, bundle);
            let button = ui.add(egui::Button::selectable(new.preset == Some(preset), name));
            if button.on_hover_text(help).clicked() {
                *new = GenerateSettings { preset: Some(preset), ..new.clone() };
            }
        }
        if new.preset.is_none() {
            ui.label(caption("custom", cx.p));
        }
    });
}

/// The numbers behind the presets, and when previews and predictions are made.
fn numbers(cx: &mut Cx<'_>, ui: &mut Ui, new: &mut GenerateSettings) {
    let bundle = recipe::bundle(cx.state, BundleKind::Generator).ok();
    row(ui, cx.p.weak, "Sampler", |ui| {
        let combo = egui::ComboBox::from_id_salt("sampler").width(72.0).selected_text(sampler_name(new.sampler));
        let (name, said) =
            (("Sampler", "Algorithm that turns noise into an image"), |s: &Sampler| (sampler_name(*s), ""));
        new.sampler = choose(ui, combo, name, Some(&new.sampler), Sampler::iter(), said).unwrap_or(new.sampler);
        ui.label(RichText::new("eta").color(cx.p.weak));
        let drag = egui::DragValue::new(&mut new.eta).speed(0.01).range(0.0..=1.0).fixed_decimals(2);
        let tip = "Fresh noise that DDIM adds at each step, 0 to 1; 0 is deterministic";
        let eta = GenerateSettings::default().eta;
        reset(ui.add(drag).accessible_name("Eta"), tip, "0.00", || new.eta = eta);
    });
    row(ui, cx.p.weak, "Steps", |ui| {
        let drag = egui::DragValue::new(&mut new.steps).speed(0.2).range(STEPS);
        let tip = "Denoising steps: more take longer and add detail";
        let recommended = bundle.and_then(|bundle| bundle.generator.as_ref()).map_or(10, |g| g.defaults.steps);
        reset(ui.add(drag).accessible_name("Steps"), tip, &recommended.to_string(), || new.steps = recommended);
        let both = ui.checkbox(&mut new.both_fingers, "both fingers");
        both.on_hover_text("Predict both fingers, as the pose needs; off: only the active one");
    });
    row(ui, cx.p.weak, "Seed", |ui| {
        let drag = egui::DragValue::new(&mut new.seed).speed(1.0);
        let (tip, seed) = ("The same seed gives the same prediction", GenerateSettings::default().seed);
        reset(ui.add(drag).accessible_name("Seed"), tip, "42", || new.seed = seed);
        cx.action_button(ui, Action::GenerateNewSeed, "New");
    });
    row(ui, cx.p.weak, "Predict", |ui| {
        let by_itself = ui.checkbox(&mut new.by_itself, "automatically");
        by_itself.on_hover_text(
            "The pair on screen is predicted without a click where that takes less than a second on this machine, by \
             what earlier predictions took. Default on",
        );
    });
}

/// Tooltip with the default; a double-click resets.
fn reset(response: egui::Response, tip: &str, default: &str, mut set: impl FnMut()) {
    if response.double_clicked() {
        set();
    }
    response.on_hover_text(format!("{tip}. Default {default}; double-click resets"));
}

fn run(cx: &mut Cx<'_>, ui: &mut Ui) {
    let running = cx.state.tasks.any_generating();
    let width = ui.available_width();
    match running {
        Some((_, task)) => {
            ui.horizontal(|ui| {
                // As high as the button in its place: nothing below moves.
                ui.set_min_height(28.0);
                cx.under_way(ui, task, &task.progress.text);
            });
        }
        None => {
            let can = results::can_generate(cx.state);
            let text = RichText::new("Generate").family(crate::ui::parts::theme::medium()).color(cx.p.on_accent);
            let button = egui::Button::new(text).fill(cx.p.accent).min_size(vec2(width, 28.0));
            let response = ui.add_enabled(can.is_ok(), button).accessible_name("Generate");
            let response = response.on_hover_text(Action::Generate.help());
            let why = can.err().map_or("", |absent| absent.text());
            if response.on_disabled_hover_text(why).clicked() {
                cx.act(Action::Generate);
            }
            if !why.is_empty() {
                ui.label(RichText::new(why).size(SMALL).color(cx.p.caution));
            }
        }
    }
}

/// Name and tooltip of a preset: what it does with this bundle.
fn preset_texts(preset: Preset, bundle: Option<&BundleInfo>) -> (&'static str, String) {
    const SHARP: &str = "Sharpest: more steps would change nothing. Sharper is not always closer to the measurement";
    let (name, what) = match preset {
        Preset::Fast => ("Fast", "For browsing: close to the mean of all plausible imprints"),
        Preset::Default => ("Default", "What the model recommends"),
        Preset::Sharp => ("Sharp", SHARP),
    };
    let help = match bundle.and_then(|bundle| bundle.generator.as_ref()) {
        Some(g) => {
            let config = preset.config(g.defaults, g.training_steps);
            format!("{what}: {} with {} steps", sampler_name(config.sampler), config.steps)
        }
        None => what.to_owned(),
    };
    (name, help)
}

/// The name on screen.
fn sampler_name(sampler: Sampler) -> &'static str {
    match sampler {
        Sampler::Ddim => "DDIM",
        Sampler::Ddpm => "DDPM",
    }
}

/// Choice of the way to meters.
fn mapping(cx: &mut Cx<'_>, ui: &mut Ui) {
    let current = cx.state.settings.shift;
    row(ui, cx.p.weak, "Depth scale", |ui| {
        let combo = egui::ComboBox::from_id_salt("mapping").width(ui.available_width() - 8.0);
        let response = combo.selected_text(shift_name(current)).truncate().show_ui(ui, |ui| {
            // The refit is there once its statistics are; until then the button brings them.
            for mode in ShiftMode::iter().chain(cx.state.settings.refit.map(ShiftMode::Refit)) {
                if ui.selectable_label(mode == current, shift_name(mode)).on_hover_text(shift_tooltip(mode)).clicked() {
                    cx.push(prefer(move |s| s.shift = mode));
                }
            }
            if cx.state.settings.refit.is_none() {
                cx.action_button(ui, Action::Refit, "Match to this data set…");
            }
        });
        let tip = format!("How the model's output becomes millimeters. {}", shift_tooltip(current));
        response.response.accessible_name("Choice of depth scale").on_hover_text(tip);
    });
}

/// The parts of a model's fit to a rig, each with a switch; nothing for a model without one.
fn fit_parts(cx: &mut Cx<'_>, ui: &mut Ui) {
    let made = results::chosen(cx.state, cx.state.selection.finger);
    let made = made.and_then(|recipe| cx.state.results.predictions.get(recipe));
    let parts = match cx.state.settings.shift {
        ShiftMode::Parts(parts) => parts,
        ShiftMode::ExactInverse if made.is_some_and(|made| made.fit.is_some()) => CorrectionParts::ALL,
        _ => return,
    };
    row(ui, cx.p.weak, "Fit", |ui| {
        ui.horizontal_wrapped(|ui| {
            for part in CorrectionPart::iter() {
                let mut on = parts.has(part);
                if ui.checkbox(&mut on, RichText::new(part.label()).size(SMALL)).on_hover_text(part.tip()).changed() {
                    let next = parts.with(part, on);
                    let whole = next == CorrectionParts::ALL;
                    let mode = if whole { ShiftMode::ExactInverse } else { ShiftMode::Parts(next) };
                    cx.push(prefer(move |s| s.shift = mode));
                }
            }
        });
    });
}

fn results(cx: &mut Cx<'_>, ui: &mut Ui) {
    let finger = cx.state.selection.finger;
    let Some(touch) = cx.state.touch_key(finger) else { return };
    let keys: Vec<PredictionKey> = cx.state.results.made.get(&touch).cloned().unwrap_or_default();
    // One alone is what is shown anyway.
    if keys.len() < 2 {
        return;
    }
    ui.label(section(&format!("Results, {} finger", cx.state.finger_name(finger)), cx.p));
    let chosen = results::chosen(cx.state, finger).cloned();
    let shift = cx.state.settings.shift;
    for recipe in keys.iter().rev() {
        let selected = chosen.as_ref() == Some(recipe);
        let compared = cx.state.results.comparisons.get(&ComparisonKey::measured(recipe.clone(), shift));
        let psnr = compared.and_then(|c| c.psnr_db).map_or(String::new(), |v| format!("{v:.1} dB"));
        let (seconds, took) = match cx.state.results.predictions.get(recipe) {
            Some(p) if p.kept => ("kept".to_owned(), format!("Predicted earlier ({:.1} s), read from disk", p.seconds)),
            Some(p) => (format!("{:.1} s", p.seconds), format!("Predicted in {:.2} s", p.seconds)),
            None => (String::new(), String::new()),
        };
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let text = format!("seed {}", recipe.config.seed);
            let label = ui.add(egui::Button::selectable(selected, text).min_size(vec2(84.0, 20.0)));
            if label.on_hover_text("Show this prediction").clicked() {
                pick(cx, recipe);
            }
            ui.label(caption(format!("{} steps", recipe.config.steps), cx.p));
            ui.label(value(psnr, cx.p).size(SMALL));
            ui.label(caption(seconds, cx.p)).on_hover_text(took);
        });
    }
}

/// Shows a prediction, and that of the other finger made with the same settings, if there is one.
fn pick(cx: &mut Cx<'_>, recipe: &PredictionKey) {
    cx.push(PredictCommand::Choose(recipe.clone()));
    for finger in cx.state.rig().pads() {
        let Some(touch) = cx.state.touch_key(finger) else { continue };
        let other = PredictionKey { touch, ..recipe.clone() };
        if other != *recipe && cx.state.results.predictions.contains(&other) {
            cx.push(PredictCommand::Choose(other));
        }
    }
}
