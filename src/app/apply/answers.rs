//! What the runtime answers: results, progress, failures.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::super::command::{Command, Computed, Opened};
use super::super::document::{Document, PairLabels, Stored};
use super::super::effect::Effect;
use super::super::jobs::generate::Keyed;
use super::super::keys::{
    DatasetSeq, ImprintKey, ImprintSource, MaskKey, PairKey, PoseKey, PredictionKey, Request, TouchKey,
};
use super::super::library::{OpenDataset, Place};
use super::super::state::State;
use super::super::tasks::{Level, Task, Ticket};
use super::{cancel_all, follow, inspect, is_selected, masks, preferences, refit, remember, reorder, workbench};
use crate::domain::contact::ContactMask;
use crate::domain::dataset::PairId;
use crate::domain::grid::Grid;
use crate::domain::rig::PerPad;
use crate::work::bundles::BundleKind;
use crate::work::error::{TaskError, TaskErrorKind};
use crate::work::prediction::Prediction;

pub(super) fn step(state: &mut State, command: Command, effects: &mut Vec<Effect>) {
    match command {
        Command::Opened(ticket, seq, place, opened) => {
            state.tasks.running.remove(&ticket);
            // A later opening was started meanwhile: this one is not wanted any more.
            if seq == state.library.last_seq {
                show(state, seq, place, opened, effects);
            }
        }
        Command::Followed(seq, followed) => {
            let current = state.library.open.as_ref().map(|open| open.seq);
            follow::arrived(state, followed, current == Some(seq), effects);
        }
        Command::Bundles(bundles, problems) => {
            for problem in &problems {
                state.log.error(problem);
            }
            let lacks = |kind| bundles.iter().all(|bundle| bundle.kind != kind);
            for (kind, text) in [
                (BundleKind::Generator, "No generator was found: nothing can be predicted"),
                (BundleKind::Mask, "No mask model was found: the mask source \"UNet\" is not available"),
            ] {
                if lacks(kind) {
                    let hint = "Put its folder into assets/models beside the program, or name a folder with bundles in \
                                TOUCH2TOUCH_MODELS.";
                    state.log.push(Level::Warning, text, None, Some(hint.into()));
                }
            }
            state.library.bundles = bundles;
            state.library.bundle_problems = problems;
        }
        Command::SettingsLoaded(settings, problem) => {
            state.settings = settings.validated();
            if let Some(problem) = problem {
                state.log.push(Level::Warning, problem.what, Some(problem.why), problem.hint);
            }
            effects.push(Effect::FindBundles(state.settings.bundle_folders.clone()));
        }
        Command::Demanded(list) => state.tasks.demanded = list,
        Command::Computed(request, computed) => {
            let current = state.library.open.as_ref().map(|open| open.seq);
            if request.dataset().is_none_or(|seq| Some(seq) == current) {
                store(state, request, computed);
            }
        }
        Command::Generated(ticket, predictions) => {
            forget(state, ticket);
            for (key, prediction) in predictions {
                generated(state, key, prediction);
            }
        }
        // One that comes after its result, or after Cancel, is too late.
        Command::Previewed(ticket, preview)
            if state.tasks.running.get(&ticket).is_some_and(|task| !task.cancelling) =>
        {
            state.results.previews.insert(preview.recipe.touch, preview);
        }
        Command::Refitted(ticket, statistics, saved) => {
            state.tasks.running.remove(&ticket);
            refit::arrived(state, &statistics, saved, effects);
        }
        Command::Progressed(ticket, progress) => {
            if let Some(task) = state.tasks.running.get_mut(&ticket) {
                task.progress = progress;
            }
        }
        Command::Finished(ticket, line) => {
            state.tasks.running.remove(&ticket);
            if let Some(line) = line {
                state.log.info(line);
            }
        }
        Command::TaskFailed(ticket, err) => failed_task(state, ticket, &err),
        Command::RequestFailed(request, err) => failed_request(state, request, err),
        // An answer to anything but the last request: what was changed since is not on the disk yet.
        Command::LabelsSaved(name, revision) if state.document.asked.get(&name) == Some(&revision) => {
            state.document.asked.remove(&name);
            state.document.unsaved.remove(&name);
        }
        Command::SaveFailed(err) => state.log.error(&err),
        // Everything else was carried out before.
        _ => {}
    }
}

fn show(state: &mut State, seq: DatasetSeq, place: Place, opened: Opened, effects: &mut Vec<Effect>) {
    masks::end_stroke(state, effects);
    // Predictions under way are of the data set before.
    cancel_all(state, effects);
    let before = state.entry().map(|entry| entry.name.clone());
    let same_place = state.library.open.as_ref().is_some_and(|open| open.place == place);
    state.results.clear();
    state.table.result = None;
    state.table.running = None;
    state.history.clear();
    state.tasks.failed.clear();
    state.document =
        Document { reviews: opened.reviews, last_revision: state.document.last_revision, ..Document::default() };
    state.library.opening = None;
    let tools = opened.source.index().tools();
    state.library.open = Some(OpenDataset { seq, place: place.clone(), source: opened.source.clone(), tools });
    follow::opened(state, same_place, effects);
    if !same_place {
        state.library.filter.clear();
        state.library.tool = None;
        state.library.rows = 0..0;
    }
    reorder(state);
    let kept = before.filter(|_| same_place).and_then(|name| {
        let at = opened.source.index().pairs.iter().position(|entry| entry.name == name)?;
        u32::try_from(at).ok().map(PairId)
    });
    state.selection.pair = kept.or_else(|| state.library.order.first().copied());
    state.selection.hover = None;
    state.selection.hover_point = None;
    state.workbench.leave_pair();
    inspect::rewind(state);
    state.inspect.pins = [None, None];
    let (pairs, problems) = (opened.source.index().pairs.len(), opened.source.problems().len());
    let (level, hint) = match problems {
        0 => (Level::Info, None),
        _ => (Level::Warning, Some("The list of problems says which files, and what to do.".to_owned())),
    };
    let text = match problems {
        0 => format!("{}: {pairs} pairs", opened.source.title()),
        n => format!("{}: {pairs} pairs, {n} problem{}", opened.source.title(), if n == 1 { "" } else { "s" }),
    };
    state.log.push(level, text, None, hint);
    remember(state, &place, effects);
}

/// Stores a result under its own key. A kind that does not fit the request is a defect of a job and is left out.
fn store(state: &mut State, request: Request, computed: Computed) {
    let results = &mut state.results;
    let bytes = |grid: &Grid<f32>| grid.len() * 4;
    match (request, computed) {
        (Request::Sample(key), Computed::Sample(sample)) => {
            let size = sample.bytes();
            results.samples.insert(key, sample, size);
            if is_selected(state, key) {
                preferences::follow_range(state);
                super::say_notes(state);
            }
        }
        (Request::Labels(key), Computed::Labels(labels)) => store_labels(state, key, *labels),
        (Request::Thumbnail(key), Computed::Depth(depth)) => {
            let size = bytes(&depth);
            results.thumbnails.insert(key, depth, size);
        }
        (Request::Tool(_, name), Computed::Tool(tool)) => {
            let mesh = tool.model.mesh.vertices.len() * 24 + tool.model.mesh.triangles.len() * 12;
            // The registration's field and tree are of the mesh's order, at least a few MB.
            results.tools.insert(name.to_string(), tool, 8 * mesh + (4 << 20));
        }
        (Request::Stored(touch), Computed::Predictions(list)) => stored(state, touch, list),
        (Request::Prediction(_), Computed::Predictions(list)) => {
            for (key, prediction) in list {
                generated(state, key, prediction);
            }
        }
        (Request::Seed(recipe), Computed::Predictions(list)) => {
            let touch = recipe.touch;
            let shown = results.chosen.get(&touch).cloned();
            for (key, prediction) in list {
                generated(state, key, prediction);
            }
            // A seed among several does not push away what is looked at.
            if let Some(shown) = shown.filter(|recipe| state.results.predictions.contains(recipe)) {
                state.results.chosen.insert(touch, shown);
            }
        }
        (Request::Ensemble(key), Computed::Ensemble(ensemble)) => {
            let size = ensemble.bytes();
            results.ensembles.insert(key, ensemble, size);
        }
        (Request::Imprint(recipe, shift), Computed::Depth(depth)) => {
            let size = bytes(&depth);
            results.imprints.insert((recipe, shift), depth, size);
        }
        (Request::Imprint(recipe, _), Computed::Color(picture)) => {
            let size = picture.len() * 12;
            results.colors.insert(recipe, picture, size);
        }
        (Request::Comparison(recipe, shift), Computed::Comparison(comparison)) => {
            let size = bytes(&comparison.error);
            results.comparisons.insert((recipe, shift), comparison, size);
        }
        (Request::Ledger(recipe, shift), Computed::Ledger(ledger)) => {
            let size = ledger.ledger.bytes();
            results.ledgers.insert((recipe, shift), ledger, size);
        }
        (Request::Ambiguity(touch), Computed::Ambiguity(found)) => {
            results.ambiguities.insert(touch, Arc::new(found), size_of_val(&found));
        }
        (Request::Mask(key), Computed::Mask(found)) => mask_arrived(state, key, *found),
        (Request::Cloud(key), Computed::Cloud(clouds)) => {
            // One of a single finger is of the table of poses, not what the panes show.
            if let Some(at) =
                place_of(&key.parts).filter(|(_, source)| state.cloud_key(*source) == Ok(Some(key.clone())))
            {
                state.results.latest.entry(at).or_default().0 = Some(key.clone());
            }
            let size = clouds.bytes();
            state.results.clouds.insert(key, clouds, size);
            workbench::refresh_cost(state);
        }
        (Request::Pose(key), Computed::Pose(pose)) => {
            if let Some(at) = place_of(&key.cloud.parts).filter(|(_, s)| state.pose_key(*s) == Ok(Some(key.clone()))) {
                state.results.latest.entry(at).or_default().1 = Some(PoseKey::clone(&key));
            }
            let size = pose.bytes();
            state.results.poses.insert(key, pose, size);
        }
        (Request::Run(key), Computed::Pose(pose)) => {
            let size = pose.bytes();
            results.runs.insert(key.clone(), pose, size);
            workbench::run_arrived(state, &key);
        }
        (Request::Layers(key), Computed::Layers(layers)) => {
            let size = layers.bytes();
            results.layers.insert(key, layers, size);
        }
        (Request::Inspection(key), Computed::Inspection(inspection)) => {
            if let Some(place) = place_of(&key.pose.cloud.parts) {
                state.results.latest_inspections.insert(place, key.clone());
            }
            let size = inspection.bytes();
            state.results.inspections.insert(key, inspection, size);
        }
        (Request::Basin(key), Computed::Basin(basin)) => {
            if let Some(place) = place_of(&key.pose.cloud.parts) {
                state.results.latest_basins.insert(place, key.clone());
            }
            let size = basin.bytes();
            state.results.basins.insert(key, basin, size);
        }
        (request, _) => log::error!("the result of {request:?} is of another kind"),
    }
}

/// Keeps a mask, and what it is made of where that is not what its recipe names; then the log says so, once.
fn mask_arrived(state: &mut State, key: MaskKey, found: ContactMask) {
    if let Some(why) = found.basis.note() {
        let touch = key.imprint.touch();
        let said = state.results.mask_bases.insert(key.clone(), found.basis) == Some(found.basis);
        if let Some(entry) = state.library.entry(touch.pair.pair).filter(|_| !said && is_selected(state, touch.pair)) {
            let text = format!("{}, {} finger: {why}", entry.name, state.finger_name(touch.finger));
            state.log.push(Level::Warning, text, None, None);
        }
    }
    let size = found.mask.len();
    state.results.masks.insert(key, Arc::new(found.mask), size);
}

/// The pair and imprint a cloud belongs to.
fn place_of<M>(parts: &PerPad<(ImprintKey, M)>) -> Option<(PairKey, ImprintSource)> {
    let (imprint, _) = parts.iter().flatten().next()?;
    let source = match imprint {
        ImprintKey::Measured(_) => ImprintSource::Measured,
        ImprintKey::Predicted(..) => ImprintSource::Predicted,
    };
    Some((imprint.touch().pair, source))
}

fn store_labels(state: &mut State, key: PairKey, mut labels: PairLabels) {
    let Some(name) = state.library.entry(key.pair).map(|entry| entry.name.clone()) else { return };
    let doc = &mut state.document;
    if doc.stored.insert(name.clone(), Stored::Loaded) == Some(Stored::Loaded) {
        // Read twice: what is here may be newer.
        return;
    }
    for hand in labels.masks.iter_mut().flatten() {
        hand.revision = doc.next_revision();
    }
    let review = labels.review;
    doc.labels.insert(name.clone(), labels);
    doc.set_review(&name, review);
}

/// Ends a task; what it showed on the way is not shown any more.
fn forget(state: &mut State, ticket: Ticket) -> Option<Task> {
    let task = state.tasks.running.remove(&ticket)?;
    for recipe in &task.recipes {
        if state.results.previews.get(&recipe.touch).is_some_and(|preview| preview.recipe == *recipe) {
            state.results.previews.remove(&recipe.touch);
        }
    }
    Some(task)
}

/// Keeps what was made of a touch before; what fits the settings is shown if nothing is yet, else the last used.
fn stored(state: &mut State, touch: TouchKey, predictions: Keyed) {
    state.results.looked_up.insert(touch);
    let shown = state.results.chosen.get(&touch).cloned();
    let fitting = state.recipe(touch).filter(|recipe| predictions.iter().any(|(key, _)| key == recipe));
    for (key, prediction) in predictions {
        if !state.results.predictions.contains(&key) {
            generated(state, key, prediction);
        }
    }
    if let Some(recipe) = shown.or(fitting).filter(|recipe| state.results.predictions.contains(recipe)) {
        state.results.chosen.insert(touch, recipe);
    }
}

fn generated(state: &mut State, recipe: PredictionKey, prediction: Arc<Prediction>) {
    if state.library.open.as_ref().map(|open| open.seq) != Some(recipe.touch.pair.dataset) {
        return;
    }
    let size = prediction.raw.channels.iter().map(|c| c.len() * 4).sum();
    state.results.predictions.insert(recipe.clone(), prediction, size);
    let made = state.results.made.entry(recipe.touch).or_default();
    made.retain(|r| *r != recipe);
    made.push(recipe.clone());
    state.results.chosen.insert(recipe.touch, recipe);
    // Old predictions may have left the cache to make room.
    let results = &mut state.results;
    let there: BTreeMap<_, Vec<_>> = std::mem::take(&mut results.made)
        .into_iter()
        .map(|(touch, list)| (touch, list.into_iter().filter(|r| results.predictions.contains(r)).collect()))
        .collect();
    results.made = there;
    results.chosen.retain(|_, recipe| results.predictions.contains(recipe));
}

fn failed_task(state: &mut State, ticket: Ticket, err: &TaskError) {
    let Some(task) = forget(state, ticket) else { return };
    let current = state.library.open.as_ref().map(|open| open.seq);
    let outdated = task.recipes.iter().any(|r| Some(r.touch.pair.dataset) != current);
    if outdated && err.is_cancelled() {
        return;
    }
    if task.opening.is_some_and(|seq| seq != state.library.last_seq) {
        // A later opening was started meanwhile.
        return;
    }
    if task.opening.is_some() {
        state.library.opening = None;
        state.library.failure = Some(err.clone());
    }
    state.table.running.take_if(|running| *running == ticket);
    state.log.error(err);
}

fn failed_request(state: &mut State, request: Request, err: TaskError) {
    let current = state.library.open.as_ref().map(|open| open.seq);
    if request.dataset().is_some_and(|seq| Some(seq) != current) || err.is_cancelled() {
        return;
    }
    // What a pane shows in place of the result is not said a second time, except what nobody would look for there.
    let loud = match &request {
        Request::Sample(key) => is_selected(state, *key),
        Request::Labels(_) | Request::Tool(..) => true,
        Request::Run(key) => workbench::run_failed(state, key),
        _ => false,
    };
    if loud || err.kind == TaskErrorKind::Panicked {
        state.log.error(&err);
    }
    if let Request::Labels(key) = &request
        && let Some(entry) = state.library.entry(key.pair)
    {
        let name = entry.name.clone();
        state.document.stored.insert(name, Stored::Blocked(err.clone()));
    }
    state.tasks.failed.insert(request, err);
}
