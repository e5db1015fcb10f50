//! Judgment of a fit before it may become a bundle: [`objections`].

use super::adapted::Adapted;
use super::gather::FitTouch;
use touch2touch_core::dataset::Problem;
use touch2touch_core::fit::sound::{self, FoundPad};
use touch2touch_core::fit::{FitPair, Fitted};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::{PadId, Rig};

/// Figures and data that a fit is judged by.
pub(super) struct Evidence<'a> {
    pub(super) rig: &'a Rig,
    pub(super) touches: &'a [FitTouch],
    pub(super) fitted: &'a Fitted,
    /// Prediction of each touch by a fit to the others.
    pub(super) unseen: &'a [Option<DepthMap>],
    /// Faults of the data that their examination found.
    pub(super) doubts: &'a [Problem],
}

/// Objections to a fit, in words: from its own figures, its scores, and the known faults of the data.
pub(super) fn objections(evidence: &Evidence<'_>, scores: &Adapted) -> Vec<String> {
    let Evidence { rig, touches, fitted, unseen, doubts } = *evidence;
    let cases: Vec<FitPair<'_>> = touches.iter().map(FitTouch::case).collect();
    let names: Vec<_> = rig.pads().map(|pad| rig.pad_key(pad)).collect();
    let found = |pad: PadId| {
        let correction = &*fitted.pads.get(pad)?.correction;
        let there = touches.iter().find(|touch| touch.pad == pad).and_then(|touch| touch.to_window_px);
        let window = there.zip(half_window(rig, pad, correction.mean.size())).map(|(there, reach)| [there, reach]);
        Some(FoundPad { name: &names[pad.index()], correction, window })
    };
    let pads: Vec<Option<FoundPad<'_>>> = rig.pads().map(found).collect();
    let mut all = sound::figures(&cases, &pads);
    let angle = |scored: Option<&super::Scored>| scored.and_then(|scored| scored.angle);
    let after = scores.after.as_ref().or(scores.closed_form.as_ref());
    if let Some((before, after)) = angle(Some(&scores.before)).zip(angle(after)) {
        all.extend(sound::angle(&before, &after));
    }
    all.extend(sound::strangers(&cases, unseen));
    let wrong = doubts.iter().map(|p| format!("{} ({})", p.what, p.hint));
    all.into_iter().chain(wrong).collect()
}

/// Half of the width and height of a pad's color window, in pixels of a picture of this size.
fn half_window(rig: &Rig, pad: PadId, size: [usize; 2]) -> Option<[f64; 2]> {
    let (window, full) = (rig.color_window(pad)?, rig.depth()?.size());
    Some([0, 1].map(|i| window.size_px[i] / full[i].max(1) as f64 * size[i] as f64 / 2.0))
}
