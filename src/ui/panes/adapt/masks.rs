//! The mask model in the pane Adapt: what it would learn from, and what it is worth on pairs that it did not see.

use eframe::egui::{self, DragValue, Label, RichText, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::command::{LearnCommand, LibraryCommand};
use crate::app::learn::{LearnForm, MINUTES, MOST_HELD_OUT, STEPS};
use crate::app::state::Lookup;
use crate::app::tasks::TaskKind;
use crate::app::{recipe, results};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section};
use touch2touch_core::units::counted;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::learn::train::{MaskScore, MasksFrom, Trained};
use touch2touch_pipeline::steps::bundles::BundleKind;

/// Masks that are listed, the worst first.
const LISTED: usize = 200;

/// Form of a training, and the masks that it would learn from.
pub(super) fn choices(cx: &mut Cx<'_>, ui: &mut Ui) {
    form(cx, ui);
    plan(cx, ui);
}

fn form(cx: &mut Cx<'_>, ui: &mut Ui) {
    let before = cx.state.learn.form;
    let mut form = before;
    let begins = match recipe::bundle(cx.state, BundleKind::Mask) {
        Ok(bundle) => format!("starts from {}", bundle.name),
        Err(_) => "no mask model to start from".to_owned(),
    };
    ui.add(Label::new(caption(begins, cx.p)).wrap());
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        ui.label(caption("Learn from", cx.p));
        for from in MasksFrom::iter() {
            if ui.radio(form.choice.from == from, from.name()).on_hover_text(from.tooltip()).clicked() {
                form.choice.from = from;
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        budget(cx, ui, &mut form);
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        ui.label(caption("Leave out", cx.p));
        let percent = DragValue::new(&mut form.choice.held_out_percent).range(0..=MOST_HELD_OUT).suffix(" %");
        let percent = ui.add(percent).accessible_name("Pairs left out for the score");
        percent.on_hover_text("This share of the pairs, with both fingers, is not trained on and gives the score");
    });
    let tip = "Off: pairs reserved for tests (test_only) are left out, so that no model is scored on what it was \
               trained on";
    ui.checkbox(&mut form.choice.test_in_train, "train on pairs reserved for tests").on_hover_text(tip);
    if form != before {
        cx.push(LearnCommand::SetForm(form));
    }
}

/// For how long.
fn budget(cx: &Cx<'_>, ui: &mut Ui, form: &mut LearnForm) {
    ui.label(caption("Train for", cx.p));
    let tip = "A few steps are timed first; the learning rate falls toward the end";
    if ui.radio(!form.by_steps, "minutes").on_hover_text(tip).clicked() {
        form.by_steps = false;
    }
    if ui.radio(form.by_steps, "steps").on_hover_text("Gives the same result on any machine of the same kind").clicked()
    {
        form.by_steps = true;
    }
    let drag = match form.by_steps {
        false => DragValue::new(&mut form.minutes).range(MINUTES).suffix(" min"),
        true => DragValue::new(&mut form.steps).range(STEPS).suffix(" steps"),
    };
    let name = if form.by_steps { "Training steps" } else { "Training minutes" };
    ui.add(drag).accessible_name(name).on_hover_text("About ten minutes for twenty masks on two free cores");
}

/// Plan of the training.
fn plan(cx: &mut Cx<'_>, ui: &mut Ui) {
    if cx.state.tasks.of_kind(TaskKind::Learn).is_some() {
        return;
    }
    let Some(key) = results::train_plan_key(cx.state) else { return };
    let mut say = |text: String, color| ui.add(Label::new(RichText::new(text).size(SMALL).color(color)).wrap());
    match cx.state.look(key) {
        Lookup::Ready(plan) | Lookup::Stale(plan) => {
            let nothing = plan.nothing();
            for line in nothing.as_ref().map_or_else(|| plan.lines(), |nothing| nothing.others.clone()) {
                say(line, cx.p.text);
            }
            for warning in plan.warnings() {
                say(warning, cx.p.caution);
            }
            if let Some(nothing) = nothing {
                say(format!("Nothing to train on yet: {}.", nothing.why), cx.p.caution);
                say(nothing.hint, cx.p.caution);
                if let Some(cure) = nothing.cure
                    && ui.button(cure.name()).on_hover_text("Changes the choice above; does not start yet").clicked()
                {
                    let form = cx.state.learn.form;
                    cx.push(LearnCommand::SetForm(LearnForm { choice: cure.applied(form.choice), ..form }));
                }
            }
        }
        Lookup::Failed(err) => {
            say(err.to_string(), cx.p.wrong);
        }
        Lookup::Waiting | Lookup::Absent(_) => {
            say("…".into(), cx.p.weak);
        }
    }
}

/// Scores of the new model on masks that were not trained on.
pub(super) fn worth(cx: &mut Cx<'_>, ui: &mut Ui, trained: &Trained) {
    ui.add_space(6.0);
    ui.label(section("Scores on pairs left out", cx.p));
    let mut say = |text: String, color| ui.add(Label::new(RichText::new(text).size(SMALL).color(color)).wrap());
    for warning in &trained.warnings {
        say(warning.clone(), cx.p.caution);
    }
    for remark in &trained.unusable {
        say(format!("not used: {remark}"), cx.p.caution);
    }
    for (worth, when) in trained.poses.iter().flatten().zip(["before", "after"]) {
        say(format!("{when}: {} on {}", worth.text(), counted(worth.grasps, "grasp")), cx.p.text);
    }
    let change = |before: f64, after: f64| format!("{before:.3} to {after:.3}");
    let mut select = None;
    egui::Grid::new("held out").num_columns(3).spacing(vec2(12.0, 3.0)).striped(true).show(ui, |ui| {
        for (heading, tip) in [
            ("IoU", "Intersection over union, before and after training"),
            ("Dice", "Dice coefficient, before and after training"),
            ("pair, worst first", "A click shows the pair"),
        ] {
            ui.label(caption(heading, cx.p)).on_hover_text(tip);
        }
        ui.end_row();
        let row = |ui: &mut Ui, before: MaskScore, after: MaskScore| {
            let color = if after.iou < before.iou { cx.p.caution } else { cx.p.text };
            ui.label(RichText::new(change(before.iou, after.iou)).color(color).size(SMALL));
            ui.label(RichText::new(change(before.dice, after.dice)).color(color).size(SMALL));
        };
        if let (Some(before), Some(after)) = (trained.before, trained.after) {
            row(ui, before, after);
            ui.label(RichText::new(format!("mean of {}", trained.held_out.len())).size(SMALL).strong());
            ui.end_row();
        }
        for one in trained.held_out.iter().take(LISTED) {
            row(ui, one.before, one.after);
            let predicted = if one.imprint == ImprintSource::Predicted { ", predicted" } else { "" };
            let name = format!("{}, {}{predicted}", one.pair, one.finger);
            let shown = ui.add(Label::new(RichText::new(&name).size(SMALL)).truncate().sense(egui::Sense::click()));
            if shown.on_hover_text(name).clicked() {
                select = Some(one.id);
            }
            ui.end_row();
        }
    });
    if let Some(pair) = select {
        cx.push(LibraryCommand::Select(pair));
    }
    if trained.held_out.len() > LISTED {
        ui.label(caption(format!("and {} better ones", trained.held_out.len() - LISTED), cx.p));
    }
    let by = if trained.persons.is_empty() { String::new() } else { format!(" by {}", trained.persons.join(", ")) };
    let text = format!(
        "{} masks of {} pairs{by}, {} steps, {:.0} s; saved in {}",
        trained.masks,
        trained.pairs,
        trained.steps,
        trained.seconds,
        trained.bundle.display()
    );
    ui.add(Label::new(caption(text, cx.p)).wrap());
}
