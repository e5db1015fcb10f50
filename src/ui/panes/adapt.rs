//! Networks that learn from the open pairs, a tab for each: what is asked for, how it goes, and what it is worth on pairs
//! that were left out.

mod generator;
mod masks;

use eframe::egui::{RichText, ScrollArea, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{LearnCommand, Pane};
use crate::app::learn::{self, Network};
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::SMALL;
use crate::ui::parts::widget::curves;
use crate::ui::parts::widget::scroll_to_focus;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    let shown = cx.state.learn.shown;
    ui.horizontal_wrapped(|ui| {
        for network in Network::iter() {
            if ui.selectable_label(network == shown, network.name()).clicked() {
                cx.push(LearnCommand::Show(network));
            }
        }
    });
    if shown == Network::Generator && cx.state.learn.adapted.is_none() && learn::curves(cx.state, shown).is_empty() {
        generator::choices(cx, ui);
        // Before the first fit the invitation has the button.
        let begun =
            cx.state.learn.stopped[shown as usize].is_some() || cx.state.tasks.of_kind(TaskKind::Learn).is_some();
        if begun {
            start(cx, ui, shown);
        }
        return generator::nothing_yet(cx, ui, begun);
    }
    ScrollArea::vertical().auto_shrink(false).id_salt(("adapt", shown as usize)).show(ui, |ui| {
        match shown {
            Network::Generator => generator::choices(cx, ui),
            Network::Masks => masks::choices(cx, ui),
        }
        start(cx, ui, shown);
        how_it_goes(cx, ui, shown);
        match (shown, cx.state.learn.trained.clone()) {
            (Network::Generator, _) => generator::worth(cx, ui),
            (Network::Masks, Some(trained)) => masks::worth(cx, ui, &trained),
            (Network::Masks, None) => {}
        }
        scroll_to_focus(ui);
    });
}

/// The buttons, or the progress of what is under way.
fn start(cx: &mut Cx<'_>, ui: &mut Ui, network: Network) {
    let (action, start, go_on) = match network {
        Network::Generator => (Action::FitPairs, "Fit to my pairs", "Continue the fit"),
        Network::Masks => (Action::StartTraining, "Start training", "Continue training"),
    };
    let tip = match network {
        Network::Generator => "Predictions now come from the fitted model",
        Network::Masks => "Automatic masks now come from the trained model",
    };
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        if let Some((_, task)) = cx.state.tasks.of_kind(TaskKind::Learn) {
            return cx.under_way(ui, task, &task.progress.text);
        }
        if let Some(at) = cx.state.learn.stopped[network as usize].clone() {
            cx.action_button(ui, action, go_on);
            ui.label(RichText::new(format!("stopped at {at}, can be continued")).color(cx.p.caution).size(SMALL));
        } else {
            cx.action_button(ui, action, start);
        }
        if learn::in_use(cx.state, network) {
            ui.label(RichText::new("in use").color(cx.p.good)).on_hover_text(tip);
        } else if learn::made(cx.state, network).is_some() {
            cx.action_button(ui, Action::UseModel, Action::UseModel.name());
        }
        let adapted = cx.state.learn.adapted.as_ref().filter(|_| network == Network::Generator);
        if let Some(gain) = adapted.and_then(|adapted| generator::gain(adapted)) {
            ui.label(RichText::new(gain).color(cx.p.strong)).on_hover_text("PSNR on pairs left out of the fit");
        }
    });
}

/// The curves of the run, while it goes on and afterwards.
fn how_it_goes(cx: &Cx<'_>, ui: &mut Ui, network: Network) {
    let all = learn::curves(cx.state, network);
    if all.is_empty() {
        return;
    }
    let (unit, name) = match network {
        Network::Generator => ("dB", "PSNR on touches left out, dB"),
        Network::Masks => ("Dice", "Dice on pairs left out"),
    };
    let of = |unit: &str| all.iter().filter(|curve| curve.unit == unit).collect::<Vec<_>>();
    let size = vec2(((ui.available_width() - 12.0) / 2.0).clamp(110.0, 420.0), 100.0);
    ui.horizontal_wrapped(|ui| {
        curves::show(ui, size, "Loss (bold: the current or last run)", &of("loss"));
        curves::show(ui, size, name, &of(unit));
    });
}
