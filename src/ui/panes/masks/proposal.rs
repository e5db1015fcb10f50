//! Sources of proposed masks, and the proposal.

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{self, RichText, Ui};
use strum::IntoEnumIterator as _;

use super::slider_mm;
use crate::app::action::Action;
use crate::app::settings::ProposalSource;
use crate::app::state::Lookup;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{PROPOSED, SMALL, section};
use touch2touch_work::propose::FARTHEST_M;

/// Source, number, and the way to accept or reject.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    ui.label(section("Propose", cx.p));
    let settings = &cx.state.settings.mask;
    let mut new = settings.clone();
    let combo = egui::ComboBox::from_id_salt("proposal source").width(ui.available_width() - 8.0);
    let response = combo.selected_text(settings.proposal.name()).show_ui(ui, |ui| {
        for source in ProposalSource::iter() {
            let option = ui.selectable_label(source == settings.proposal, source.name());
            if option.on_hover_text(source.tooltip()).clicked() {
                new.proposal = source;
            }
        }
    });
    response.response.accessible_name("Proposal source").on_hover_text(settings.proposal.tooltip());
    if new.proposal.is_cad() {
        ui.spacing_mut().slider_width = (ui.available_width() - 86.0).max(40.0);
        let tip = "The greatest distance to the CAD model that is proposed as contact";
        slider_mm(ui, "Proposal distance", &mut new.choice.cad_distance_m, 0.0..=(FARTHEST_M as f32 * 0.5e3), tip);
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let shown = results::proposes(cx.state);
        let text = if shown { "Reject" } else { "Show" };
        cx.action_button(ui, if shown { Action::CancelJobs } else { Action::Propose }, text);
        if shown {
            cx.action_button(ui, Action::Accept, "Accept");
            let tip = "Accepting replaces what was painted by hand as well; off, hand work stays";
            ui.checkbox(&mut new.over_drawn, "over hand work").on_hover_text(tip);
        } else {
            for_all(cx, ui);
        }
    });
    if results::proposes(cx.state) {
        said(cx, ui);
        for_all(cx, ui);
    }
    if new != *settings {
        cx.push(prefer(move |s| s.mask = new.clone()));
    }
}

/// Button that proposes for every pair in the list, or the progress of that.
fn for_all(cx: &mut Cx<'_>, ui: &mut Ui) {
    if let Some((ticket, task)) = cx.state.tasks.of_kind(TaskKind::Propose) {
        let tip = "Stop; the pairs that were done until then keep their masks";
        ui.horizontal(|ui| cx.stoppable(ui, (ticket, task), 300.0, (&task.progress.text, tip)));
    } else {
        // Said here as well: the box that sets it is on screen only with a proposal.
        let over = if cx.state.settings.mask.over_drawn { ", over hand work" } else { "" };
        let text = format!("Propose for {} listed{over}", cx.state.library.order.len());
        cx.action_button(ui, Action::ProposeAll, &text);
    }
}

/// Provenance of the proposal, or the reason why there is none.
fn said(cx: &Cx<'_>, ui: &mut Ui) {
    let finger = cx.state.selection.finger;
    let source = results::worked_on(cx.state, finger);
    let (text, color) = match results::proposal(cx.state, source, finger) {
        Lookup::Ready(proposal) => {
            let mut text =
                format!("{}, {}: {}", cx.state.finger_name(finger), source.key(), proposal.provenance.text());
            if !proposal.note.is_empty() {
                text += &format!("; {}", proposal.note);
            }
            (text, PROPOSED)
        }
        Lookup::Failed(err) => (format!("{}. {}", err.why, err.hint.as_deref().unwrap_or_default()), cx.p.caution),
        Lookup::Absent(absent) => (absent.text().to_owned(), cx.p.caution),
        Lookup::Waiting | Lookup::Stale(_) => ("…".to_owned(), cx.p.weak),
    };
    ui.add(egui::Label::new(RichText::new(text).size(SMALL).color(color)).wrap());
}
