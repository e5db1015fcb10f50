//! The mask on an image.

use eframe::egui::{Color32, Key, Ui};

use super::Memory;
use crate::app::keys::{ImprintSource, MaskVersion};
use crate::app::pane::Pane;
use crate::app::results;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{CONTACT, IGNORED, PROPOSED};
use crate::ui::parts::widget::image_canvas::CanvasOutput;
use crate::ui::parts::widget::texture::{mask_image, outline};
use touch2touch_core::rig::PadId;

/// True while a key is held that takes everything off the imprint, so that the data itself is seen.
pub(super) fn is_bared(ui: &Ui) -> bool {
    ui.input(|i| i.key_down(Key::X)) && !ui.ctx().egui_wants_keyboard_input()
}

/// The mask in force as a veil with an outline, or the outline alone.
pub(super) fn mask(
    cx: &mut Cx<'_>,
    ui: &Ui,
    memory: &mut Memory,
    output: &CanvasOutput,
    source: ImprintSource,
    finger: PadId,
) {
    let settings = &cx.state.settings;
    if !settings.mask_visible {
        return;
    }
    let Ok(in_force) = results::mask_in_force(cx.state, source, finger) else { return };
    let key: (&MaskVersion, _) = (&in_force.version, results::imprint_key(cx.state, source, finger).ok());
    // Where nobody paints the data itself is what counts: the outline says enough.
    if !settings.mask_outline && cx.state.selection.panes.contains(&Pane::Masks) {
        let mask = in_force.mask;
        let slot = ("mask", source, finger);
        let texture = cx.shared.textures.mask(ui.ctx(), slot, &key, mask);
        output.paint(texture, CONTACT.gamma_multiply(settings.mask_opacity));
    }
    if let Some(ignored) = results::drawn_mask(cx.state, source, finger).and_then(|hand| hand.marks.ignored()) {
        let slot = ("ignored", source, finger);
        let veil = || (mask_image(ignored), None);
        let picture = cx.shared.textures.get(ui.ctx(), slot, &key, true, veil);
        output.paint(picture.texture.id(), IGNORED.gamma_multiply(settings.mask_opacity));
        let segments = memory.outlines.get(&("ignored", source, finger), &key, || outline(ignored));
        output.segments(segments, IGNORED, 1.25);
    }
    if let Some(proposal) = results::shown_proposal(cx.state, source, finger) {
        let key = results::proposal_key(cx.state, source, finger).ok();
        let slot = ("proposal", source, finger);
        let veil = || (mask_image(&proposal.mask), None);
        let picture = cx.shared.textures.get(ui.ctx(), slot, &key, true, veil);
        output.paint(picture.texture.id(), PROPOSED.gamma_multiply(0.6 * settings.mask_opacity));
        let segments = memory.outlines.get(&slot, &key, || outline(&proposal.mask));
        output.segments(segments, Color32::from_black_alpha(110), 2.5);
        output.segments(segments, PROPOSED, 1.25);
    }
    let mask = in_force.mask;
    let segments = memory.outlines.get(&("mask", source, finger), &key, || outline(mask));
    output.segments(segments, Color32::from_black_alpha(110), 2.5);
    output.segments(segments, CONTACT, 1.25);
}
