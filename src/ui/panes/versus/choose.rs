//! The menu that says what stands on one side of a comparison.

use std::collections::BTreeSet;

use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{self, Button, DragValue, PopupCloseBehavior, RichText, Ui};
use strum::IntoEnumIterator as _;

use super::{Letter, color};
use crate::app::settings::{STEPS, Versus};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::cut::cut_in_the_middle;
use touch2touch_core::rig::SensorKind;
use touch2touch_pipeline::compare::subject::{Mapping, RecipeChange, SEEDS, Subject};
use touch2touch_pipeline::steps::bundles::BundleInfo;

/// Width of a letter in a button, points.
const LETTER: f32 = 5.8;

fn cut(text: &str, letters: usize) -> String {
    cut_in_the_middle(text, letters as f32, |text| text.chars().count() as f32)
}

/// The button of one of the two, `width` points wide at most, with its menu; what was chosen.
pub(super) fn menu(cx: &Cx<'_>, ui: &mut Ui, versus: &Versus, letter: Letter, width: f32) -> Option<Subject> {
    let subject = letter.of(versus);
    let label = subject.label();
    let text = RichText::new(format!("{letter:?}  {}", cut(&label, ((width - 28.0) / LETTER).max(6.0) as usize)))
        .color(color(cx.p, versus, letter));
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let (button, inner) =
        MenuButton::from_button(Button::new(text)).config(config).ui(ui, |ui| content(cx, ui, subject));
    button
        .accessible_name(format!("{letter:?}: {label}"))
        .on_hover_text(format!("{label}. Click to choose another; each workspace remembers its own"));
    inner.and_then(|inner| inner.inner)
}

fn content(cx: &Cx<'_>, ui: &mut Ui, subject: &Subject) -> Option<Subject> {
    ui.style_mut().override_font_id = None;
    ui.set_min_width(240.0);
    let mut chosen = None;
    let mut row = |ui: &mut Ui, value: Subject, text: &str, tip: &str| {
        if ui.selectable_label(*subject == value, text).on_hover_text(tip).clicked() {
            chosen = Some(value);
        }
    };
    row(ui, Subject::Measured, "Measured", "What the Soft Bubble measured");
    row(ui, Subject::shown(), "Prediction on screen", "The prediction that the other panes show");
    let mean = match subject {
        Subject::Mean(..) => subject.clone(),
        _ => Subject::Mean(RecipeChange::default(), 8),
    };
    row(ui, mean, "Mean of seeds", "Mean of predictions with different seeds");
    row(ui, Subject::Stored, "Stored picture", "Prediction of another program: NAME_vqvae.png beside the pair");
    let variants = variants(cx);
    if !variants.is_empty() {
        ui.separator();
        ui.label(caption("Predictions of this touch so far", cx.p));
        for variant in variants {
            let value = Subject::Predicted(variant);
            let text = value.label();
            row(ui, value, text.trim_start_matches("Prediction · "), "The same settings in every pair");
        }
    }
    ui.separator();
    ui.label(caption("Another prediction", cx.p));
    let variant = subject.change().cloned().unwrap_or_default();
    if let Some(variant) = change(cx, ui, &variant) {
        chosen = Some(match subject {
            Subject::Mean(_, count) => Subject::Mean(variant, *count),
            _ => Subject::Predicted(variant),
        });
    }
    if let Subject::Mean(variant, count) = subject {
        let mut count = *count;
        ui.horizontal(|ui| {
            ui.label("Seeds");
            if ui.add(DragValue::new(&mut count).range(SEEDS)).changed() {
                chosen = Some(Subject::Mean(variant.clone(), count));
            }
        });
    }
    chosen
}

/// The predictions that were made of the active finger, each as the change to a recipe that names it.
fn variants(cx: &Cx<'_>) -> BTreeSet<RecipeChange> {
    let state = cx.state;
    let keys = state.touch_key(state.selection.finger).and_then(|touch| state.results.made.get(&touch));
    let variant = |key: &crate::app::keys::PredictionKey| {
        let bundle = state.library.bundle(&key.bundle)?;
        Some(RecipeChange {
            bundle: Some(bundle.name.clone()),
            steps: Some(key.config.steps),
            seed: Some(key.config.seed),
            shift: None,
        })
    };
    keys.into_iter().flatten().rev().take(6).filter_map(variant).collect()
}

/// Model, seed, steps and way to meters; what was changed.
fn change(cx: &Cx<'_>, ui: &mut Ui, variant: &RecipeChange) -> Option<RecipeChange> {
    let mut new = variant.clone();
    ui.spacing_mut().item_spacing.y = 2.0;
    let rig = cx.state.rig();
    let depth = |b: &&BundleInfo| b.generator.as_ref().is_some_and(|g| g.sensors.output.kind == SensorKind::Depth);
    for bundle in cx.state.library.bundles.iter().filter(|b| b.fits(&rig)).filter(depth) {
        let on = new.bundle.as_deref() == Some(bundle.name.as_str());
        let tip = "Use this model; click again to follow the Generate pane";
        if ui.selectable_label(on, &bundle.name).on_hover_text(tip).clicked() {
            new.bundle = (!on).then(|| bundle.name.clone());
        }
    }
    let generate = &cx.state.settings.generate;
    ui.horizontal(|ui| {
        number(ui, "Seed", &mut new.seed, generate.seed, 0..=u64::from(u32::MAX));
        number(ui, "Steps", &mut new.steps, generate.steps, STEPS);
    });
    for mapping in Mapping::iter() {
        let on = new.shift == Some(mapping);
        let tip = "Use this depth scale; click again to follow the Generate pane";
        if ui.selectable_label(on, mapping.mode().label()).on_hover_text(tip).clicked() {
            new.shift = (!on).then_some(mapping);
        }
    }
    ui.label(RichText::new("Everything else follows the Generate pane.").size(SMALL).color(cx.p.weak));
    (new != *variant).then_some(new)
}

/// A number that is either left to the settings or chosen.
fn number<N: egui::emath::Numeric>(
    ui: &mut Ui,
    name: &str,
    value: &mut Option<N>,
    usual: N,
    range: std::ops::RangeInclusive<N>,
) {
    let mut own = value.is_some();
    if ui.checkbox(&mut own, name).on_hover_text("Ticked: this number; otherwise follows the Generate pane").changed() {
        *value = own.then_some(usual);
    }
    let mut number = value.unwrap_or(usual);
    let drag = ui.add_enabled(own, DragValue::new(&mut number).range(range));
    if drag.accessible_name(name).changed() {
        *value = Some(number);
    }
}
