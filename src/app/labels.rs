//! The room of the document: strokes, clean-ups, review states, accepted poses, undo, saving.

pub mod state;

pub use state::{Document, HandMask, PairLabels, Review, Stored, Stroke};

use std::sync::Arc;

use glam::DVec2;

use super::effect::{Effect, LabelsToSave};
use super::history::{Edit, Gesture};
use super::keys::ImprintSource;
use super::settings;
use super::settings::state::MaskTool;
use super::state::{Lookup, State};
use super::tasks::state::Level;
use crate::domain::grid::Mask;
use crate::domain::hand::AcceptedPose;
use crate::domain::label::{self, Patch};
use crate::domain::rig::PadId;
use crate::work::error::TaskError;

/// What can happen to the document.
#[derive(Clone, Debug)]
pub enum LabelsCommand {
    /// Pointer down on an image, raw bubble pixels. `erase` swaps brush and eraser for this stroke.
    BeginStroke {
        /// The finger drawn on.
        finger: PadId,
        /// The imprint it is drawn on: its mask in force is where the correction starts.
        source: ImprintSource,
        /// Position.
        at_px: [f32; 2],
        /// Whether to remove instead of the tool's own effect.
        erase: bool,
    },
    /// Pointer moved, raw bubble pixels.
    StrokeTo([f32; 2]),
    /// Pointer up.
    EndStroke,
    /// Gives the stroke up.
    CancelStroke,
    /// Fills the holes of the mask in force.
    FillHoles,
    /// Keeps the largest island of the mask in force.
    LargestIsland,
    /// Makes the automatic mask the corrected one.
    AdoptAutomatic,
    /// Removes the corrected mask: the automatic source is in force again.
    ResetMask,
    /// Takes back the last change of what is on screen.
    Undo,
    /// Does it again.
    Redo,
    /// Sets the review state of the selected pair.
    SetReview(Review),
    /// Accepts the pose shown for an imprint, or withdraws it.
    AcceptPose(ImprintSource, bool),
    /// Writes all labels and settings now.
    Save,
}

pub(super) fn step(state: &mut State, command: LabelsCommand, effects: &mut Vec<Effect>) {
    match command {
        LabelsCommand::BeginStroke { finger, source, at_px, erase } => {
            begin_stroke(state, finger, source, at_px, erase, effects);
        }
        LabelsCommand::StrokeTo(at_px) => stroke_to(state, at_px),
        LabelsCommand::EndStroke => end_stroke(state, effects),
        LabelsCommand::CancelStroke => cancel_stroke(state),
        LabelsCommand::FillHoles => replace(state, "fill holes", "Fill holes", effects, label::fill_holes),
        LabelsCommand::LargestIsland => {
            replace(state, "largest island", "Largest island", effects, label::largest_island);
        }
        LabelsCommand::AdoptAutomatic => adopt_automatic(state, effects),
        LabelsCommand::ResetMask => reset(state, effects),
        LabelsCommand::Undo => undo(state, effects),
        LabelsCommand::Redo => redo(state, effects),
        LabelsCommand::SetReview(review) => {
            set_review(state, review, effects);
            state.reorder();
        }
        LabelsCommand::AcceptPose(source, accept) => accept_pose(state, source, accept, effects),
        LabelsCommand::Save => save_all(state, effects),
    }
}

/// Whether the selected pair may be edited; says why not.
pub(super) fn check_editable(state: &mut State, what: &str) -> bool {
    if state.entry().is_none() {
        return false;
    }
    let name = state.pair_name().to_owned();
    if state.document.is_editable(&name) {
        return true;
    }
    let err = match state.document.blocked(&name) {
        Some(err) => TaskError { what: what.into(), ..err.clone() },
        None => TaskError::new(what, "the stored labels of this pair are still being read").with_hint("Try again."),
    };
    state.log.error(&err);
    false
}

/// The mask in force and where it comes from; an empty one where none can be had.
///
/// `None` while it is being computed: a correction must not start from something else than what is shown.
fn start_from(state: &State, source: ImprintSource, finger: PadId) -> Option<(Arc<Mask>, String)> {
    match state.mask_in_force(source, finger) {
        Ok(mask) => {
            let base = match state.document.hand_mask(state.pair_name(), finger) {
                Some(hand) if Arc::ptr_eq(&hand.mask, mask.mask) => hand.base.clone(),
                _ => mask.label,
            };
            Some((mask.mask.clone(), base))
        }
        Err(Lookup::Waiting | Lookup::Stale(_) | Lookup::Ready(_)) => None,
        Err(Lookup::Failed(_) | Lookup::Absent(_)) => {
            let size = state.imprint(source, finger).ready()?.size();
            Some((Arc::new(Mask::filled(size[0], size[1], false)), String::new()))
        }
    }
}

/// The imprint whose mask the clean-ups work on: the measured one where it is there.
fn edited_source(state: &State, finger: PadId) -> ImprintSource {
    if state.imprint(ImprintSource::Measured, finger).ready().is_some() {
        ImprintSource::Measured
    } else {
        ImprintSource::Predicted
    }
}

fn begin_stroke(
    state: &mut State,
    finger: PadId,
    source: ImprintSource,
    at_px: [f32; 2],
    erase: bool,
    effects: &mut Vec<Effect>,
) {
    end_stroke(state, effects);
    let settings = &state.settings.mask;
    let value = match settings.tool {
        MaskTool::Brush => !erase,
        MaskTool::Eraser => erase,
        MaskTool::Pan => return,
    };
    let radius_px = settings.radius_px;
    if !state.fingers().contains(&finger) || !check_editable(state, "Correct the mask") {
        return;
    }
    let Some((pixels, base)) = start_from(state, source, finger) else {
        let err = TaskError::new("Correct the mask", "the mask is still being computed").with_hint("Try again.");
        return state.log.error(&err);
    };
    let pair = state.pair_name().to_owned();
    let revision = state.document.next_revision();
    let labels = state.document.labels.entry(pair.clone()).or_default();
    let before = labels.masks[finger].replace(HandMask { mask: pixels.clone(), revision, base });
    state.document.stroke = Some(Stroke { pair, finger, value, radius_px, at: at_px, before, pixels });
    stroke_to(state, at_px);
}

fn stroke_to(state: &mut State, at_px: [f32; 2]) {
    let doc = &mut state.document;
    let Some(stroke) = &mut doc.stroke else { return };
    if !at_px.iter().all(|v| v.is_finite()) {
        return;
    }
    let [a, b] = [stroke.at, at_px].map(|p| DVec2::new(p[0].into(), p[1].into()));
    stroke.at = at_px;
    let (value, radius) = (stroke.value, f64::from(stroke.radius_px));
    let hand = doc.labels.get_mut(&stroke.pair).and_then(|labels| labels.masks[stroke.finger].as_mut());
    if let Some(hand) = hand
        && label::paint(Arc::make_mut(&mut hand.mask), [a, b], radius, value).is_some()
    {
        doc.last_revision += 1;
        hand.revision = super::keys::Revision(doc.last_revision);
    }
}

pub(super) fn end_stroke(state: &mut State, effects: &mut Vec<Effect>) {
    let doc = &mut state.document;
    let Some(stroke) = doc.stroke.take() else { return };
    let slot = &mut doc.labels.entry(stroke.pair.clone()).or_default().masks[stroke.finger];
    let Some(now) = slot.as_ref() else { return };
    // The patch that leads back: what undo needs.
    let Some(patch) = Patch::between(&now.mask, &stroke.pixels) else {
        *slot = stroke.before;
        return;
    };
    let (pair, finger) = (stroke.pair, stroke.finger);
    let edit = match stroke.before {
        Some(before) if before.mask.size() == now.mask.size() => Edit::Patch { pair: pair.clone(), finger, patch },
        before => Edit::HandMask { pair: pair.clone(), finger, mask: before },
    };
    record(state, &pair, if stroke.value { "brush stroke" } else { "eraser stroke" }, edit, effects);
}

fn cancel_stroke(state: &mut State) {
    let doc = &mut state.document;
    let Some(stroke) = doc.stroke.take() else { return };
    if let Some(labels) = doc.labels.get_mut(&stroke.pair) {
        labels.masks[stroke.finger] = stroke.before;
    }
}

/// Records a change that was made; `edit` is its inverse. The pair counts as begun, and is saved.
fn record(state: &mut State, pair: &str, name: &'static str, edit: Edit, effects: &mut Vec<Effect>) {
    let mut edits = vec![edit];
    if state.document.review(pair) == Review::Todo {
        let before = state.document.set_review(pair, Review::InProgress);
        edits.push(Edit::Review { pair: pair.to_owned(), review: before });
    }
    state.history.record(Gesture { name, edits });
    save_pair(state, pair, effects);
}

/// Replaces the active finger's mask by `f` of the mask in force.
fn replace(
    state: &mut State,
    name: &'static str,
    what: &str,
    effects: &mut Vec<Effect>,
    f: impl FnOnce(&Mask) -> Mask,
) {
    end_stroke(state, effects);
    if !check_editable(state, what) {
        return;
    }
    let finger = state.selection.finger;
    let Some((pixels, base)) = start_from(state, edited_source(state, finger), finger) else {
        return state.log.error(&TaskError::new(what, "there is no mask to work on yet"));
    };
    let mask = f(&pixels);
    if mask == *pixels {
        return state.log.info(format!("{what}: nothing to change"));
    }
    set_hand_mask(state, name, finger, Some((Arc::new(mask), base)), effects);
}

fn set_hand_mask(
    state: &mut State,
    name: &'static str,
    finger: PadId,
    mask: Option<(Arc<Mask>, String)>,
    effects: &mut Vec<Effect>,
) {
    let pair = state.pair_name().to_owned();
    let revision = state.document.next_revision();
    let mask = mask.map(|(mask, base)| HandMask { mask, revision, base });
    let mut edit = Edit::HandMask { pair: pair.clone(), finger, mask };
    edit.swap(&mut state.document);
    record(state, &pair, name, edit, effects);
}

fn adopt_automatic(state: &mut State, effects: &mut Vec<Effect>) {
    const WHAT: &str = "Threshold to mask";
    end_stroke(state, effects);
    if !check_editable(state, WHAT) {
        return;
    }
    let finger = state.selection.finger;
    let source = edited_source(state, finger);
    match (state.automatic_mask(source, finger), state.mask_recipe(finger)) {
        (Lookup::Ready(mask), Ok(recipe)) => {
            let adopted = (mask.clone(), state.automatic_label(source, finger, &recipe));
            set_hand_mask(state, "automatic mask taken over", finger, Some(adopted), effects);
        }
        (Lookup::Failed(err), _) => {
            let err = err.clone();
            state.log.error(&err);
        }
        (Lookup::Absent(absent), _) | (_, Err(absent)) => state.log.error(&TaskError::new(WHAT, absent.text())),
        _ => state.log.error(&TaskError::new(WHAT, "it is still being computed").with_hint("Try again.")),
    }
}

fn reset(state: &mut State, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let finger = state.selection.finger;
    if state.document.hand_mask(state.pair_name(), finger).is_some() && check_editable(state, "Remove the correction") {
        set_hand_mask(state, "correction removed", finger, None, effects);
    }
}

pub(super) fn set_review(state: &mut State, review: Review, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let pair = state.pair_name().to_owned();
    if state.document.review(&pair) == review || !check_editable(state, "Review state") {
        return;
    }
    let before = state.document.set_review(&pair, review);
    let edit = Edit::Review { pair: pair.clone(), review: before };
    state.history.record(Gesture { name: "review state", edits: vec![edit] });
    save_pair(state, &pair, effects);
}

fn accept_pose(state: &mut State, source: ImprintSource, accept: bool, effects: &mut Vec<Effect>) {
    if !check_editable(state, "Accept the pose") {
        return;
    }
    let pose = match (accept, state.pose(source)) {
        (false, _) => None,
        (true, Lookup::Ready(pose)) => Some(pose.grasp_from_object.into()),
        (true, _) => return state.log.error(&TaskError::new("Accept the pose", "there is no pose yet")),
    };
    let name = if accept { "pose accepted" } else { "pose withdrawn" };
    set_accepted(state, name, source, pose, effects);
}

/// Stores or withdraws the accepted pose of an imprint: one gesture. The pair must be editable.
pub(super) fn set_accepted(
    state: &mut State,
    name: &'static str,
    source: ImprintSource,
    pose: Option<AcceptedPose>,
    effects: &mut Vec<Effect>,
) {
    let pair = state.pair_name().to_owned();
    let mut edit = Edit::Pose { pair: pair.clone(), source, pose };
    edit.swap(&mut state.document);
    state.history.record(Gesture { name, edits: vec![edit] });
    save_pair(state, &pair, effects);
}

fn undo(state: &mut State, effects: &mut Vec<Effect>) {
    if state.document.stroke.is_some() {
        return cancel_stroke(state);
    }
    let (pair, fingers) = (state.pair_name().to_owned(), state.fingers());
    let name = state.history.undo(&mut state.document, &pair, &fingers).map(|gesture| gesture.name);
    travelled(state, "Undone", &pair, name, effects);
}

fn redo(state: &mut State, effects: &mut Vec<Effect>) {
    if state.document.stroke.is_some() {
        return;
    }
    let (pair, fingers) = (state.pair_name().to_owned(), state.fingers());
    let name = state.history.redo(&mut state.document, &pair, &fingers).map(|gesture| gesture.name);
    travelled(state, "Done again", &pair, name, effects);
}

fn travelled(state: &mut State, how: &str, pair: &str, name: Option<&'static str>, effects: &mut Vec<Effect>) {
    match name {
        Some(name) => {
            state.log.info(format!("{how}: {name}"));
            save_pair(state, pair, effects);
            state.reorder();
        }
        None => state.log.info(format!("{how}: nothing on screen to change")),
    }
}

/// Writes the labels of a pair of the open data set.
fn save_pair(state: &mut State, name: &str, effects: &mut Vec<Effect>) {
    let Some(open) = &state.library.open else { return };
    let revision = state.document.next_revision();
    let Some(labels) = state.document.labels.get(name) else { return };
    let save = LabelsToSave { seq: open.seq, name: name.to_owned(), revision, labels: labels.clone() };
    effects.push(Effect::SaveLabels(open.source.clone(), Box::new(save)));
    state.document.unsaved.insert(name.to_owned());
    state.document.asked.insert(name.to_owned(), revision);
}

fn save_all(state: &mut State, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let unsaved: Vec<String> = state.document.unsaved.iter().cloned().collect();
    for name in unsaved {
        save_pair(state, &name, effects);
    }
    settings::save(state, effects);
    state.log.push(Level::Info, "Labels and preferences are being written", None, None);
}
