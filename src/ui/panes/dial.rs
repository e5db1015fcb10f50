//! The dial: what a choice does to all pairs, as one small plot for each value, all on the same axes.

mod plots;

use eframe::egui::{self, RichText, ScrollArea, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{DialCommand, Pane};
use crate::app::dial;
use crate::app::dial::DialPairs;
use crate::app::keys::ImprintSource;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::empty;
use touch2touch_work::sweep::{Dial, MOST_VALUES, Series, Sweep};

/// Source of the imprints that are shown.
#[derive(Default)]
pub(crate) struct Memory {
    source: Option<ImprintSource>,
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        choices(cx, ui);
        ui.separator();
        let Some(sweep) = cx.state.dial.result.clone() else {
            return nothing_yet(cx, ui);
        };
        let Some(series) = about(cx, ui, memory, &sweep) else { return };
        ScrollArea::vertical().auto_shrink(false).id_salt("dial").show(ui, |ui| {
            plots::line(cx, ui, &sweep, series);
            ui.add_space(6.0);
            plots::multiples(cx, ui, &sweep, series);
        });
    });
}

fn nothing_yet(cx: &mut Cx<'_>, ui: &mut Ui) {
    let refused = dial::setup(cx.state).err();
    let (what, why) = match (cx.state.tasks.of_kind(TaskKind::Dial), refused) {
        (Some(_), _) => {
            ("The plots appear when all pairs are done".to_owned(), "Cancel keeps those done until then".to_owned())
        }
        (None, Some(why)) => {
            let rejects = matches!(cx.state.dial.dial, Dial::Trim | Dial::Gate);
            let where_to = if rejects { ". The Metrics pane chooses the registration" } else { "" };
            ("This dial cannot be turned now".to_owned(), format!("{why}{where_to}"))
        }
        (None, None) => {
            let text = "Each value of the dial over the same pairs: one small plot for each, with a dot for every pair";
            ("Run it to see what this dial does".to_owned(), text.to_owned())
        }
    };
    let action = Action::TurnDial.command(cx.state).map(|_| ("Run", Action::TurnDial.tooltip()));
    if empty::show(ui, &what, &why, action) {
        cx.act(Action::TurnDial);
    }
}

/// Choice of the dial, its range and the pairs.
fn choices(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        let now = cx.state.dial.dial;
        let combo = egui::ComboBox::from_id_salt("dial").width(116.0).selected_text(now.name());
        let response = combo.show_ui(ui, |ui| {
            for dial in Dial::iter() {
                if ui.selectable_label(dial == now, dial.name()).on_hover_text(dial.tooltip()).clicked() {
                    cx.push(DialCommand::Choose(dial));
                }
            }
        });
        response.response.accessible_name("Dial").on_hover_text(now.tooltip());
        if now != Dial::Shift {
            range(cx, ui, now);
        }
        let pairs = cx.state.dial.pairs;
        let combo = egui::ComboBox::from_id_salt("dial pairs").width(110.0).selected_text(pairs.label());
        let response = combo.show_ui(ui, |ui| {
            for offered in DialPairs::OFFERED {
                if ui.selectable_label(offered == pairs, offered.label()).clicked() {
                    cx.push(DialCommand::Over(offered));
                }
            }
        });
        let tip = "Over which pairs; a number of them is spread evenly over the data set";
        response.response.accessible_name("Pairs of the dial").on_hover_text(tip);
        let mut predictions = cx.state.dial.predictions;
        let tip = "Pose the predictions as well; each pair is predicted once, or taken from the disk";
        if ui.checkbox(&mut predictions, "predictions").on_hover_text(tip).changed() {
            cx.push(DialCommand::Predictions(predictions));
        }
        match cx.state.tasks.of_kind(TaskKind::Dial) {
            Some((_, task)) => cx.under_way(ui, task, &task.progress.text),
            None => {
                cx.action_button(ui, Action::TurnDial, "Run");
            }
        }
    });
    if cx.state.dial.result.is_some()
        && let Err(why) = dial::setup(cx.state)
    {
        ui.add(egui::Label::new(RichText::new(why).size(SMALL).color(cx.p.caution)).wrap());
    }
}

/// From where to where, in how many values.
fn range(cx: &mut Cx<'_>, ui: &mut Ui, dial: Dial) {
    let ([mut first, mut last], mut count) = (cx.state.dial.range, cx.state.dial.count);
    let (before, limits) = ((first, last, count), dial.limits());
    let suffix = if dial.unit().is_empty() { String::new() } else { format!(" {}", dial.unit()) };
    let number = |ui: &mut Ui, value: &mut f64, name: &str| {
        let drag = egui::DragValue::new(value).speed(dial.step()).range(limits.clone()).max_decimals(3).suffix(&suffix);
        ui.add(drag).accessible_name(name).on_hover_text(format!("{name}: {}", dial.tooltip()));
    };
    ui.label(caption("from", cx.p));
    number(ui, &mut first, "First value");
    ui.label(caption("to", cx.p));
    number(ui, &mut last, "Last value");
    ui.label(caption("in", cx.p));
    let drag = egui::DragValue::new(&mut count).speed(0.1).range(2..=MOST_VALUES).suffix(" values");
    ui.add(drag)
        .accessible_name("Number of values")
        .on_hover_text("How many values, evenly spaced, both ends among them");
    if (first, last, count) != before {
        cx.push(DialCommand::Range([first, last], count));
    }
}

/// Summary of the sweep, choice of the imprints shown, and remarks.
fn about<'a>(cx: &Cx<'_>, ui: &mut Ui, memory: &mut Memory, sweep: &'a Sweep) -> Option<&'a Series> {
    let of = |source: ImprintSource| sweep.series.iter().find(|series| series.source == source);
    let series = memory.source.and_then(of).or_else(|| of(ImprintSource::Predicted)).or(sweep.series.first())?;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(6.0, 4.0);
        for one in &sweep.series {
            let text = RichText::new(one.source.name()).color(side_color(cx.p, one.source));
            let button = ui.add(egui::Button::selectable(one.source == series.source, text));
            let button = button.accessible_name(format!("Dial over {} imprints", one.source.key()));
            if button.on_hover_text("Which imprints are posed").clicked() {
                memory.source = Some(one.source);
            }
        }
        let what = if series.has_truth() {
            "a dot is a pair at the error of its angle; a click opens it"
        } else {
            "the true poses are not known: a dot is a pair at the change of its angle against what is in force; a click opens it"
        };
        let text = format!("{} over {} pairs: {what}", sweep.dial.name(), sweep.pairs);
        ui.label(caption(text, cx.p));
        if let Some(first) = sweep.left_out.first() {
            let list: Vec<String> = sweep.left_out.iter().map(|r| format!("{}: {}", r.name, r.why)).take(20).collect();
            let text = format!("{} left out, the first: {}", sweep.left_out.len(), first.name);
            ui.label(RichText::new(text).size(SMALL).color(cx.p.caution)).on_hover_text(list.join("\n"));
        }
        if !sweep.complete {
            ui.label(RichText::new("stopped early").size(SMALL).color(cx.p.caution));
        }
        if dial::is_outdated(cx.state) {
            let tip = "Another setting than the dial was changed since: run it again to see this with what is in force";
            ui.label(RichText::new("of earlier settings").size(SMALL).color(cx.p.caution)).on_hover_text(tip);
        }
        for note in &sweep.notes {
            ui.label(caption(note, cx.p));
        }
    });
    Some(series)
}
