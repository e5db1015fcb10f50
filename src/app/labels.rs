//! The room of the document: strokes, clean-ups, review states, accepted poses, undo, saving.

pub(super) mod unsaved;

use std::borrow::Cow;

use glam::DVec3;
pub use unsaved::{UnsavedCommand, unsaved};

use super::effect::{Effect, LabelsToSave};
use super::keys::{EstimateKey, ImprintSource, Revision};
use super::state::history::{Gesture, History};
pub(crate) use super::state::labels::{Changed, Merged};
pub use super::state::labels::{Document, DrawnMask, MaskPlace, PairLabels, Question, Review, Stored, Stroke};
use super::state::tasks::Level;
use super::state::{Lookup, State};
use super::{results, settings};
use touch2touch_core::grid::Mask;
use touch2touch_core::label::{CleanUp, DrawTool, Drawing, Paint, Provenance, Sight, VisiblePixels};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::{Act, Operation};
use touch2touch_pipeline::masks::label_edit::{self, Edited, LabelEdit, TakenUp};

/// A command to the document.
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
        /// True to remove in place of the tool's own effect.
        erase: bool,
    },
    /// Pointer down on a 3D view.
    BeginIn3d(Box<StrokeIn3d>),
    /// Pointer moved, raw bubble pixels, or pixels of the picture that the stroke began on.
    StrokeTo([f32; 2]),
    /// A corner of a drawing that is made of clicks, pixels as of [`Self::StrokeTo`].
    Corner([f32; 2]),
    /// Pointer up. A polygon that is still open is given up.
    EndStroke,
    /// Closes the open polygon.
    Close,
    /// Gives the stroke up.
    CancelStroke,
    /// Cleans the mask in force up.
    CleanUp(CleanUp),
    /// Makes the automatic mask the corrected one.
    AdoptAutomatic,
    /// Makes the proposal that is shown the corrected mask; what was painted by hand stays, unless the preferences say.
    AcceptProposal,
    /// Removes the corrected mask: the automatic source is in force again.
    ResetMask,
    /// Takes back the last change of what is on screen.
    Undo,
    /// Does it again.
    Redo,
    /// Sets the review state of the selected pair.
    SetReview(Review),
    /// Sets the note of a pair: it was typed while that one was on screen.
    SetNote(String, String),
    /// Accepts the pose shown for an imprint, or withdraws it.
    AcceptPose(ImprintSource, bool),
    /// Writes all labels and settings now.
    Save,
    /// To what is not on the disk yet.
    Unsaved(UnsavedCommand),
}

/// The beginning of a drawing in a 3D view.
#[derive(Clone, Debug)]
pub struct StrokeIn3d {
    /// The finger drawn on: whose point the pointer meant.
    pub finger: PadId,
    /// The imprint it is drawn on.
    pub source: ImprintSource,
    /// The picture.
    pub sight: Sight,
    /// Position in the picture, pixels.
    pub at_px: [f32; 2],
    /// The point at whose depth the brush has its size, meters, grasp frame.
    pub size_at: DVec3,
    /// True to remove in place of the tool's own effect.
    pub erase: bool,
}

pub(super) fn step(state: &mut State, command: LabelsCommand, effects: &mut Vec<Effect>) {
    match command {
        LabelsCommand::BeginStroke { finger, source, at_px, erase } => {
            begin_stroke(state, (finger, source), (at_px, erase), None, effects);
        }
        LabelsCommand::BeginIn3d(begin) => {
            let StrokeIn3d { finger, source, sight, at_px, size_at, erase } = *begin;
            begin_stroke(state, (finger, source), (at_px, erase), Some((sight, size_at)), effects);
        }
        LabelsCommand::StrokeTo(at_px) => stroke_to(state, at_px),
        LabelsCommand::EndStroke => end_stroke(state, effects),
        LabelsCommand::Close => close(state, effects),
        LabelsCommand::CancelStroke => cancel_stroke(state),
        LabelsCommand::Corner(at_px) => corner(state, at_px),
        // The journal could not hold a size that is no number, and the change could not be undone.
        LabelsCommand::CleanUp(clean_up) if !clean_up.size_mm.is_finite() => {}
        LabelsCommand::CleanUp(clean_up) => clean(state, clean_up, effects),
        LabelsCommand::AdoptAutomatic => adopt_automatic(state, effects),
        LabelsCommand::AcceptProposal => accept_proposal(state, effects),
        LabelsCommand::ResetMask => reset(state, effects),
        LabelsCommand::Undo => undo(state, effects),
        LabelsCommand::Redo if state.document.stroke.is_some() => {}
        LabelsCommand::Redo => travel(state, Act::Redo, effects),
        LabelsCommand::SetReview(review) => {
            set_review(state, review, effects);
            state.reorder();
        }
        LabelsCommand::SetNote(pair, text) => {
            if state.document.is_editable(&pair) {
                change(state, &pair, LabelEdit::Note(&text), None, effects);
            }
            state.reorder();
        }
        LabelsCommand::AcceptPose(source, accept) => accept_pose(state, source, accept, effects),
        LabelsCommand::Save => save_all(state, effects),
        LabelsCommand::Unsaved(command) => unsaved::step(state, command, effects),
    }
}

/// The recipe of the pose that is shown of an imprint.
fn shown_pose_key(state: &State, source: ImprintSource) -> Option<EstimateKey> {
    results::pose(state, source).shown()?;
    let now = results::pose_key(state, source).ok().flatten().filter(|key| results::pose_of(state, key).is_some());
    now.or_else(|| results::latest(state, source)?.pose.clone())
}

/// True where the selected pair may be edited; says why not.
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
        None => TaskError::new(what, "the labels of this pair are still loading").with_hint("Try again."),
    };
    state.log.error(&err);
    false
}

/// The automatic mask of an imprint as a hand takes it up, where it is there.
fn automatic(state: &State, source: ImprintSource, finger: PadId) -> Option<DrawnMask> {
    let (mask, recipe) = (results::automatic_mask(state, source, finger), results::mask_recipe(state, finger).ok()?);
    Some(DrawnMask::new(mask.ready()?.clone(), results::automatic_provenance(state, source, finger, &recipe)))
}

/// The mask in force as a hand takes it up; an empty one where none can be had.
///
/// `None` while it is being computed: a correction must not start from something else than what is shown.
fn start_from(state: &State, source: ImprintSource, finger: PadId) -> Option<DrawnMask> {
    let there = results::drawn_mask(state, source, finger).cloned();
    if let Some(mask) = there.or_else(|| automatic(state, source, finger)) {
        return Some(mask);
    }
    match (results::automatic_mask(state, source, finger), results::mask_recipe(state, finger)) {
        (Lookup::Waiting | Lookup::Stale(_), Ok(_)) => None,
        _ => {
            let [width, height] = results::imprint(state, source, finger).ready()?.size();
            Some(DrawnMask::new(Mask::filled(width, height, false), Provenance::Nothing))
        }
    }
}

/// The mask that clean-ups work on: its finger, imprint and place.
fn worked_on(state: &State) -> Option<(PadId, ImprintSource, MaskPlace)> {
    let finger = state.selection.finger;
    let source = results::worked_on(state, finger);
    Some((finger, source, results::mask_place(state, source, finger)?))
}

/// Begins a stroke, on the image or (with a picture and the point at whose depth a brush has its size) in 3D.
fn begin_stroke(
    state: &mut State,
    (finger, source): (PadId, ImprintSource),
    (at_px, erase): ([f32; 2], bool),
    in_3d: Option<(Sight, DVec3)>,
    effects: &mut Vec<Effect>,
) {
    end_stroke(state, effects);
    let Some((mut tool, paint)) = state.settings.mask.drawing() else { return };
    if !state.fingers().contains(&finger) || !check_editable(state, "Correct the mask") {
        return;
    }
    let Some(mut start) = start_from(state, source, finger) else {
        let err = TaskError::new("Correct the mask", "the mask is still being computed").with_hint("Try again.");
        return state.log.error(&err);
    };
    let Some(place) = results::mask_place(state, source, finger) else { return };
    let seen = match in_3d.as_ref().map(|(sight, _)| seen(state, source, finger, sight)).transpose() {
        Ok(seen) => seen,
        Err(err) => return state.log.error(&err),
    };
    if let (Some((sight, size_at)), DrawTool::Brush { radius_px }) = (&in_3d, &mut tool) {
        *radius_px = brush_px(state, sight, *size_at);
    }
    let proposed = results::shown_proposal(state, source, finger).cloned();
    if paint == Paint::LetThrough && proposed.is_none() {
        let err = TaskError::new("Let the proposal through", "no proposal is shown here");
        return state.log.error(&err.with_hint("Propose a mask first, or paint contact."));
    }
    state.selection.imprint = source;
    let (pair, pose) = (state.pair_name().to_owned(), shown_pose_key(state, source));
    start.revision = state.document.next_revision();
    let labels = state.document.labels.entry(pair.clone()).or_default();
    let before = labels.put(&place, Some(start.clone()));
    let mut drawing = Drawing::begin(tool, at_px, if erase { paint.reversed() } else { paint });
    drawing.sight = in_3d.map(|(sight, _)| Box::new(sight));
    let [width, height] = start.mask.size();
    let touched = Mask::filled(width, height, false);
    let by = Provenance::hand(state.settings.labeler());
    let stroke = Stroke { pair, place, source, drawing, proposed, seen, pose, before, start, touched, by };
    state.document.stroke = Some(stroke);
    redraw(state, 0);
}

fn stroke_to(state: &mut State, at_px: [f32; 2]) {
    let Some(stroke) = &mut state.document.stroke else { return };
    let before = stroke.drawing.points.len();
    stroke.drawing.move_to(at_px);
    redraw(state, before);
}

fn corner(state: &mut State, at_px: [f32; 2]) {
    if let Some(stroke) = &mut state.document.stroke {
        stroke.drawing.corner(at_px);
        redraw(state, 0);
    }
}

/// Draws the stroke on its mask: what a brush did since its first `from` points, anything else anew.
fn redraw(state: &mut State, from: usize) {
    // Out of the document while it is drawn on, so that the imprint can be looked at where it lies.
    let Some(mut stroke) = state.document.stroke.take() else { return };
    let labels = state.document.labels.get_mut(&stroke.pair);
    if let Some(mut hand) = labels.and_then(|labels| labels.masks.remove(&stroke.place)) {
        let imprint = results::imprint(state, stroke.source, stroke.place.pad).ready();
        if imprint.is_some_and(|imprint| stroke.draw_on(&mut hand, imprint, from)) {
            hand.revision = state.document.next_revision();
        }
        state.document.labels.entry(stroke.pair.clone()).or_default().put(&stroke.place, Some(hand));
    }
    state.document.stroke = Some(stroke);
}

/// Ends what is being drawn. A polygon that nobody closed is given up: an area that was not finished is no mask.
pub(super) fn end_stroke(state: &mut State, effects: &mut Vec<Effect>) {
    if state.document.has_open_polygon() {
        cancel_stroke(state);
        let hint = "Enter or a click on its first corner closes a polygon.".to_owned();
        return state.log.push(Level::Warning, "The open polygon was dropped", None, Some(hint));
    }
    finish(state, effects);
}

fn close(state: &mut State, effects: &mut Vec<Effect>) {
    let Some(stroke) = state.document.stroke.as_mut().filter(|stroke| stroke.drawing.is_by_clicks()) else { return };
    if stroke.drawing.close() {
        redraw(state, 0);
        finish(state, effects);
    } else {
        let hint = "Click the next corner, or drop it with Esc.".to_owned();
        state.log.push(Level::Warning, "A polygon has at least three corners", None, Some(hint));
    }
}

/// Makes what was drawn a change of the document.
fn finish(state: &mut State, effects: &mut Vec<Effect>) {
    let doc = &mut state.document;
    let Some(stroke) = doc.stroke.take() else { return };
    let Stroke { pair, place, source, drawing, pose, before, start, .. } = stroke;
    let labels = doc.labels.entry(pair.clone()).or_default();
    let Some(mask) = labels.put(&place, before) else { return };
    let drawn = mask.revision;
    let edit = LabelEdit::Draw { on: TakenUp { place, mask: start }, mask, drawing: &drawing };
    let Some(name) = change(state, &pair, edit, Some(drawn), effects) else { return };
    state.document.changed = Some(Changed { pair, source, name, before: pose });
}

/// Takes in what somebody else made of a pair's masks meanwhile. What was done here before cannot be taken back any more: it
/// would take theirs back as well.
pub(super) fn merged(state: &mut State, name: &str, merged: &Merged, effects: &mut Vec<Effect>) {
    if state.document.stroke.as_ref().is_some_and(|stroke| stroke.pair == name) {
        end_stroke(state, effects);
    }
    for (place, theirs) in &merged.now.masks {
        let (given, mine) = (merged.given.masks.get(place), state.document.drawn_mask(name, place));
        let mut both = match (mine, given) {
            (Some(mine), given) => mine.merged(given, theirs),
            (None, None) => theirs.clone(),
            // Removed since: the next writing says so.
            (None, Some(_)) => continue,
        };
        if mine.is_none_or(|mine| !mine.is_same(&both)) {
            both.revision = state.document.next_revision();
            state.document.labels.entry(name.to_owned()).or_default().put(place, Some(both));
        }
    }
    state.history.forget(name);
    let text = format!("{name}: somebody else labeled it as well; both are kept, and what was done before stays");
    state.log.push(Level::Warning, text, None, None);
}

fn cancel_stroke(state: &mut State) {
    let doc = &mut state.document;
    let Some(stroke) = doc.stroke.take() else { return };
    if let Some(labels) = doc.labels.get_mut(&stroke.pair) {
        labels.put(&stroke.place, stroke.before);
    }
}

/// Does something to the labels of a pair, which are saved: one gesture. New masks get the revision. Its name; `None` where
/// nothing changed.
fn change(
    state: &mut State,
    pair: &str,
    edit: LabelEdit<'_>,
    revision: Option<Revision>,
    effects: &mut Vec<Effect>,
) -> Option<Cow<'static, str>> {
    let labels = state.document.pair(pair).cloned().unwrap_or_default();
    // What is typed and what is accepted beside it is seen where it is done.
    let seen = matches!(edit, LabelEdit::Note(_) | LabelEdit::AcceptPose(..) | LabelEdit::WithdrawPose(_));
    match label_edit::edit(&labels, edit) {
        Ok(edited) => {
            let Edited { deed, change } = edited?;
            let name = deed.name.clone();
            state.history.make(&mut state.document, Gesture::forth(pair, name.clone(), &change, revision));
            save_pair(state, pair, deed, effects);
            if !seen && !state.is_labeling() {
                state.log.changed(format!("The labels of {pair} were changed: {name}"), pair);
            }
            Some(name)
        }
        Err(err) => {
            state.log.error(&err);
            None
        }
    }
}

/// Cleans the mask in force of the active finger up.
fn clean(state: &mut State, clean_up: CleanUp, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let what = clean_up.kind.name();
    if !check_editable(state, what) {
        return;
    }
    let found = worked_on(state).and_then(|(finger, source, place)| Some((start_from(state, source, finger)?, place)));
    let Some((mask, place)) = found else {
        return state.log.error(&TaskError::new(what, "there is no mask to work on yet"));
    };
    let (rig, on) = (state.rig(), TakenUp { place: place.clone(), mask });
    change_mask(state, what, &place, LabelEdit::CleanUp { on, clean_up, rig: &rig }, effects);
}

/// Does something to the mask of an imprint of the selected pair.
fn change_mask(state: &mut State, what: &str, place: &MaskPlace, edit: LabelEdit<'_>, effects: &mut Vec<Effect>) {
    let pair = state.pair_name().to_owned();
    let (source, revision) = (place.of.source(), state.document.next_revision());
    let before = shown_pose_key(state, source);
    let Some(name) = change(state, &pair, edit, Some(revision), effects) else {
        return state.log.info(format!("{what}: nothing to change"));
    };
    state.document.changed = Some(Changed { pair, source, name, before });
}

fn adopt_automatic(state: &mut State, effects: &mut Vec<Effect>) {
    const WHAT: &str = "Copy the automatic mask";
    end_stroke(state, effects);
    if !check_editable(state, WHAT) {
        return;
    }
    let Some((finger, source, place)) = worked_on(state) else { return };
    if let Some(mask) = automatic(state, source, finger) {
        let adopt = LabelEdit::Adopt(TakenUp { place: place.clone(), mask });
        return change_mask(state, WHAT, &place, adopt, effects);
    }
    match (results::automatic_mask(state, source, finger), results::mask_recipe(state, finger)) {
        (Lookup::Failed(err), _) => {
            let err = err.clone();
            state.log.error(&err);
        }
        (Lookup::Absent(absent), _) | (_, Err(absent)) => state.log.error(&TaskError::new(WHAT, absent.text())),
        _ => state.log.error(&TaskError::new(WHAT, "it is still being computed").with_hint("Try again.")),
    }
}

/// Makes the proposal on screen the mask. It is looked at no more: with the mask what it was made of may have changed.
fn accept_proposal(state: &mut State, effects: &mut Vec<Effect>) {
    const WHAT: &str = "Accept the proposal";
    end_stroke(state, effects);
    if !results::proposes(state) || !check_editable(state, WHAT) {
        return;
    }
    let Some((finger, source, place)) = worked_on(state) else { return };
    let proposal = match results::proposal(state, source, finger) {
        Lookup::Ready(proposal) => proposal.clone(),
        Lookup::Failed(err) => {
            let err = err.clone();
            return state.log.error(&err);
        }
        Lookup::Absent(absent) => return state.log.error(&TaskError::new(WHAT, absent.text())),
        Lookup::Waiting | Lookup::Stale(_) => {
            let err = TaskError::new(WHAT, "it is still being computed").with_hint("Try again.");
            return state.log.error(&err);
        }
    };
    state.selection.proposing = false;
    let over_drawn = state.settings.mask.over_drawn;
    let accept = LabelEdit::AcceptProposal { place: place.clone(), proposal: &proposal, over_drawn };
    change_mask(state, WHAT, &place, accept, effects);
}

fn reset(state: &mut State, effects: &mut Vec<Effect>) {
    const WHAT: &str = "Back to the automatic mask";
    end_stroke(state, effects);
    let Some((finger, source, place)) = worked_on(state) else { return };
    if results::drawn_mask(state, source, finger).is_some() && check_editable(state, WHAT) {
        change_mask(state, WHAT, &place, LabelEdit::Remove(place.clone()), effects);
    }
}

pub(super) fn set_review(state: &mut State, review: Review, effects: &mut Vec<Effect>) {
    if says_open_polygon(state) {
        return;
    }
    end_stroke(state, effects);
    let pair = state.pair_name().to_owned();
    if state.document.review(&pair) == review || !check_editable(state, "Review state") {
        return;
    }
    if review == Review::Done {
        let (automatic, by) = (right_as_they_are(state), state.settings.labeler());
        let revision = (!automatic.is_empty()).then(|| state.document.next_revision());
        change(state, &pair, LabelEdit::Done { automatic, by }, revision, effects);
    } else {
        change(state, &pair, LabelEdit::Review(review), None, effects);
    }
}

/// True where a polygon is open, which is said: a pair is not judged with a shape that is half drawn.
pub(super) fn says_open_polygon(state: &mut State) -> bool {
    let open = state.document.has_open_polygon();
    if open {
        let hint = "Close it with Enter or a click on its first corner, or drop it with Esc.".to_owned();
        state.log.push(Level::Warning, "A polygon is still open: nothing was marked", None, Some(hint));
    }
    open
}

/// The automatic masks of the measured imprints on screen that nobody corrected: whoever marks the pair done has found them right.
fn right_as_they_are(state: &State) -> Vec<TakenUp> {
    let of = |finger: PadId| {
        let source = ImprintSource::Measured;
        if results::drawn_mask(state, source, finger).is_some() {
            return None;
        }
        let mask = automatic(state, source, finger)?;
        Some(TakenUp { place: results::mask_place(state, source, finger)?, mask })
    };
    state.fingers().into_iter().filter_map(of).collect()
}

fn accept_pose(state: &mut State, source: ImprintSource, accept: bool, effects: &mut Vec<Effect>) {
    if !check_editable(state, "Accept the pose") {
        return;
    }
    let pose = match (accept, results::pose(state, source)) {
        (false, _) => None,
        (true, Lookup::Ready(pose)) => Some(pose.grasp_from_object.into()),
        (true, _) => return state.log.error(&TaskError::new("Accept the pose", "there is no pose yet")),
    };
    set_accepted(state, source, pose, effects);
}

/// Stores or withdraws the accepted pose of an imprint: one gesture. The pair must be editable.
pub(super) fn set_accepted(
    state: &mut State,
    source: ImprintSource,
    pose: Option<AcceptedPose>,
    effects: &mut Vec<Effect>,
) {
    let Some(of) = results::shown_imprint(state, source) else {
        return state.log.error(&TaskError::new("Accept the pose", "the fingers show different predictions"));
    };
    let pair = state.pair_name().to_owned();
    let edit = match pose {
        Some(pose) => LabelEdit::AcceptPose(of, pose),
        None => LabelEdit::WithdrawPose(of),
    };
    change(state, &pair, edit, None, effects);
}

fn undo(state: &mut State, effects: &mut Vec<Effect>) {
    if let Some(stroke) = &mut state.document.stroke {
        if stroke.drawing.take_corner_back() {
            return redraw(state, 0);
        }
        return cancel_stroke(state);
    }
    travel(state, Act::Undo, effects);
}

/// Takes the last change of what is on screen back, or does it again.
fn travel(state: &mut State, act: Act, effects: &mut Vec<Effect>) {
    let (pair, shown) = (state.pair_name().to_owned(), results::mask_places(state));
    let go = if act == Act::Undo { History::undo } else { History::redo };
    let name = go(&mut state.history, &mut state.document, &pair, &shown).map(|gesture| gesture.name.clone());
    let how = if act == Act::Undo { "Undone" } else { "Redone" };
    match name {
        Some(name) => {
            // What the last change did is said no more: it may be what was taken back.
            state.document.changed = None;
            state.log.info(format!("{how}: {name}"));
            save_pair(state, &pair, Operation { act, ..Operation::named(name) }, effects);
            state.reorder();
        }
        None => state.log.info(format!("{how}: nothing on screen to change")),
    }
}

/// Writes the labels of a pair of the open data set, which were changed.
fn save_pair(state: &mut State, name: &str, deed: Operation, effects: &mut Vec<Effect>) {
    // Whether that works is to be said anew.
    state.document.failed.remove(name);
    save_again(state, name, deed, effects);
}

fn save_again(state: &mut State, name: &str, mut deed: Operation, effects: &mut Vec<Effect>) {
    deed.person = state.settings.known_labeler();
    let Some(open) = &state.library.open else { return };
    let revision = state.document.next_revision();
    let Some(labels) = state.document.finished(name) else { return };
    let save = LabelsToSave { seq: open.seq, name: name.to_owned(), revision, labels, deed };
    effects.push(Effect::SaveLabels(open.source.clone(), Box::new(save)));
    state.document.unsaved.insert(name.to_owned());
    state.document.asked.insert(name.to_owned(), revision);
}

fn save_all(state: &mut State, effects: &mut Vec<Effect>) {
    if !state.document.has_open_polygon() {
        end_stroke(state, effects);
    }
    let unsaved: Vec<String> = state.document.unsaved.iter().cloned().collect();
    for name in unsaved {
        save_again(state, &name, Operation::named("saved again"), effects);
    }
    settings::save(state, effects);
    state.log.push(Level::Info, "Labels and preferences are being written", None, None);
}

/// Half the width of the brush in a 3D picture, pixels: as many millimeters as on the image, at the depth of a point
/// (meters, grasp frame).
pub(crate) fn brush_px(state: &State, sight: &Sight, size_at: DVec3) -> f32 {
    let radius_m = f64::from(state.settings.mask.radius_px) / state.rig().depth_px_per_mm() * 1e-3;
    sight.px_per_m(size_at).map_or(0.0, |scale| (radius_m * scale) as f32)
}

/// The places of the pixels of a finger's imprint in a 3D picture.
fn seen(state: &State, source: ImprintSource, finger: PadId, sight: &Sight) -> Result<VisiblePixels, TaskError> {
    let sample =
        results::sample(state).ready().ok_or_else(|| TaskError::new("Draw in 3D", "the pair is not read yet"))?;
    let imprints = sample.rig.pads().map(|pad| results::imprint(state, source, pad).ready()).collect();
    touch2touch_pipeline::steps::cloud::seen(sample, &imprints, finger, sight)
}
