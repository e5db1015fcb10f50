//! Sources of masks, in one list: the automatic ones, in force where nothing is drawn, and what is only proposed.

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{self, RichText, Slider, Ui};
use strum::IntoEnumIterator as _;

use super::{LINE, slider_mm};
use crate::app::action::Action;
use crate::app::keys::ImprintSource;
use crate::app::settings::{MaskChoice, MaskSettings, MaskSource, ProposalSource};
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{PROPOSED, SMALL, caption};
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::masks::propose::FARTHEST_M;

/// The list, the number of what is chosen, and what can be done with it.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    list(cx, ui);
    let settings = &cx.state.settings.mask;
    let mut new = settings.clone();
    ui.horizontal(|ui| {
        ui.set_height(LINE);
        ui.spacing_mut().slider_width = (ui.available_width() - 86.0).max(40.0);
        number(ui, &mut new);
    });
    if new != *settings {
        cx.push(prefer(move |s| s.mask = new.clone()));
    }
    in_force(cx, ui);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        offer(cx, ui);
    });
}

/// One list of both: choosing an automatic source proposes that one.
fn list(cx: &mut Cx<'_>, ui: &mut Ui) {
    let settings = &cx.state.settings.mask;
    let (source, proposal) = (settings.choice.source, settings.proposal);
    let automatic = proposal == ProposalSource::Automatic;
    let text = format!("Source: {}", if automatic { source.name() } else { proposal.name() });
    let tip = if automatic { source.tooltip() } else { proposal.tooltip() };
    let combo = egui::ComboBox::from_id_salt("mask source").width(ui.available_width() - 8.0).selected_text(text);
    let response = combo.height(420.0).show_ui(ui, |ui| {
        ui.label(caption("Used until you draw", cx.p));
        for other in MaskSource::iter() {
            let option = ui.selectable_label(automatic && other == source, other.name());
            if option.on_hover_text(other.tooltip()).clicked() {
                cx.push(prefer(move |s| {
                    s.mask.choice.source = other;
                    s.mask.proposal = ProposalSource::Automatic;
                }));
            }
        }
        ui.separator();
        ui.label(caption("Suggestions only: nothing changes until you accept", cx.p));
        for other in ProposalSource::iter().filter(|other| *other != ProposalSource::Automatic) {
            if ui.selectable_label(other == proposal, other.name()).on_hover_text(other.tooltip()).clicked() {
                cx.push(prefer(move |s| s.mask.proposal = other));
            }
        }
    });
    response.response.accessible_name("Mask source").on_hover_text(tip);
}

/// The number that the choice has; where it has none the row stays empty.
fn number(ui: &mut Ui, new: &mut MaskSettings) {
    if new.proposal != ProposalSource::Automatic {
        if new.proposal.is_cad() {
            let tip = "Points closer to the CAD model than this are suggested as contact";
            slider_mm(ui, "Proposal distance", &mut new.choice.cad_distance_m, 0.0..=(FARTHEST_M as f32 * 0.5e3), tip);
        }
        return;
    }
    let default = MaskChoice::default();
    match new.choice.source {
        MaskSource::Threshold => {
            let tip = "Pixels deeper than this are contact, mm. Default 5.00; double-click resets";
            let threshold = &mut new.choice.threshold_m;
            resets(ui, "Threshold", tip, threshold, default.threshold_m, (1e3, 15.0, 2, " mm"));
        }
        MaskSource::TopPercent => {
            let tip = "This share of the pixels, the deepest, is contact. Default 15.0; double-click resets";
            resets(ui, "Top percent", tip, &mut new.choice.top_percent, default.top_percent, (1.0, 60.0, 1, " %"));
        }
        MaskSource::Cad => {
            let tip = "Points closer to the CAD model at its true pose than this are contact, mm. Default 1.00; double-click resets";
            let distance = &mut new.choice.cad_distance_m;
            resets(ui, "CAD distance", tip, distance, default.cad_distance_m, (1e3, 5.0, 2, " mm"));
        }
        MaskSource::Unet => probability(ui, &mut new.choice),
        MaskSource::Auto | MaskSource::Truth => {}
    }
}

/// A slider over a value from 0 on, shown times a factor with decimals and unit; a double-click sets the default.
fn resets(
    ui: &mut Ui,
    name: &str,
    tip: &str,
    value: &mut f32,
    default: f32,
    (factor, most, decimals, unit): (f32, f32, usize, &str),
) {
    let mut shown = *value * factor;
    let slider = ui.add(Slider::new(&mut shown, 0.0..=most).fixed_decimals(decimals).suffix(unit));
    let response = slider.accessible_name(name);
    if response.double_clicked() {
        *value = default;
    } else if response.changed() {
        *value = shown / factor;
    }
    response.on_hover_text(tip);
}

/// From which probability on the mask model's pixels are contact.
fn probability(ui: &mut Ui, choice: &mut MaskChoice) {
    /// Probability at which somebody starts who chooses it himself.
    const START: f32 = 0.5;
    let mut own = choice.probability.is_some();
    let tip = "Set the probability above which a pixel is contact; off: the mask model's own";
    if ui.checkbox(&mut own, "probability").on_hover_text(tip).changed() {
        choice.probability = own.then_some(START);
    }
    if let Some(least) = &mut choice.probability {
        ui.spacing_mut().slider_width = (ui.available_width() - 60.0).max(40.0);
        let slider = Slider::new(least, 0.0..=1.0).fixed_decimals(2);
        ui.add(slider)
            .accessible_name("Probability")
            .on_hover_text("Pixels above this probability are contact, 0 to 1");
    }
}

/// The mask in force of what is worked on, in a line; those of the other fingers and imprints behind it.
fn in_force(cx: &Cx<'_>, ui: &mut Ui) {
    let finger = cx.state.selection.finger;
    let worked_on = results::worked_on(cx.state, finger);
    let (text, color) = match results::mask_recipe(cx.state, finger) {
        Err(absent) => (absent.text().to_owned(), cx.p.caution),
        Ok(_) => {
            let drawn = results::drawn_mask(cx.state, worked_on, finger).is_some();
            (origin(cx, worked_on, finger), if drawn { cx.p.strong } else { cx.p.weak })
        }
    };
    let all: Vec<String> = cx
        .state
        .rig()
        .pads()
        .flat_map(|pad| ImprintSource::iter().map(move |imprint| (imprint, pad)))
        .filter(|(imprint, pad)| results::imprint(cx.state, *imprint, *pad).ready().is_some())
        .map(|(imprint, pad)| origin(cx, imprint, pad))
        .collect();
    let label = egui::Label::new(RichText::new(text).size(SMALL).color(color)).truncate();
    ui.add(label).on_hover_text(format!("Masks in use:\n{}", all.join("\n")));
}

/// Origin of the mask of one imprint: `right, measured: mask model`.
fn origin(cx: &Cx<'_>, source: ImprintSource, finger: PadId) -> String {
    let text = match results::mask_in_force(cx.state, source, finger) {
        Ok(mask) => mask.label,
        Err(Lookup::Failed(err)) => err.why.clone(),
        Err(Lookup::Absent(absent)) => absent.text().to_owned(),
        Err(_) => "…".to_owned(),
    };
    format!("{}, {}: {text}", cx.state.finger_name(finger), source.key())
}

/// Buttons that show, accept or reject what the source proposes.
fn offer(cx: &mut Cx<'_>, ui: &mut Ui) {
    if results::proposes(cx.state) {
        cx.action_button(ui, Action::Accept, "Accept");
        cx.action_button(ui, Action::CancelJobs, "Reject");
        let mut over = cx.state.settings.mask.over_drawn;
        let tip = "Accepting also replaces what you painted; off: it stays";
        if ui.checkbox(&mut over, "replace hand-drawn").on_hover_text(tip).changed() {
            cx.push(prefer(move |s| s.mask.over_drawn = over));
        }
        return;
    }
    cx.action_button(ui, Action::Propose, "Propose");
}

/// Provenance of the proposal, or the reason why there is none.
pub(super) fn said(cx: &Cx<'_>, ui: &mut Ui) {
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
    ui.add(egui::Label::new(RichText::new(&text).size(SMALL).color(color)).wrap()).on_hover_text(text);
}
