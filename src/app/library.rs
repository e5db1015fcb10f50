//! The room of the open data set and its list.

pub(crate) use super::state::library::OpenDataset;
pub use super::state::library::{Follow, Library, Place, Sort, short_name};

use std::ops::Range;
use std::sync::Arc;

use super::effect::{Access, Effect};
use super::keys::DatasetSeq;
use super::source::Source;
use super::state::State;
use super::state::doctor::DoctorState;
use super::state::evaluate::ScoreChoice;
use super::state::labels::{Document, Review};
use super::state::results::{Request, Results};
use super::state::settings::MAX_RECENT;
use super::state::tasks::{Level, TaskKind};
use super::tasks::{self, Start};
use super::{inspect, labels, results, settings};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PadId;
use touch2touch_core::units::counted;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::dataset::ToolUnit;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};
use touch2touch_pipeline::steps::tool::{UnitSet, set_unit};

/// A command to the data set and its list.
#[derive(Clone, Debug)]
pub enum LibraryCommand {
    /// Opens a place; what is open stays until the new one is read.
    Open(Place),
    /// Opens the same place again.
    Reload,
    /// Removes a place from the recent ones.
    ForgetRecent(Place),
    /// Reads a tool's CAD file in a unit from now on: writes that beside it.
    ReadToolAs {
        /// The tool.
        tool: String,
        /// The unit.
        unit: ToolUnit,
        /// The unit that the file beside it says now, as the person was told.
        replacing: Option<String>,
    },
    /// Narrows the list.
    SetFilter(String),
    /// Narrows the list to one tool.
    SetToolFilter(Option<String>),
    /// Sorts the list.
    SetSort(Sort),
    /// Sorts it by a score.
    SetScore(ScoreChoice),
    /// The rows of the list that are on screen.
    ShowRows(Range<usize>),
    /// Shows a pair.
    Select(PairId),
    /// Moves in the list; stops at its ends.
    Step(i64),
    /// Shows the first of the list.
    First,
    /// Shows the last of the list.
    Last,
    /// Shows the next of the list whose review is not finished, going round.
    NextUnfinished,
    /// Selects the next worst pair by the chosen score; the list is then in that order.
    NextWorst,
    /// Marks the selected pair as done and shows the next unfinished one.
    DoneAndNext,
}

pub(super) fn step(state: &mut State, command: LibraryCommand, effects: &mut Vec<Effect>) {
    match command {
        LibraryCommand::Open(place) => open(state, place, effects),
        LibraryCommand::Reload => {
            if let Some(place) = state.library.open.as_ref().map(|open| open.place.clone()) {
                open(state, place, effects);
            }
        }
        LibraryCommand::ForgetRecent(place) => {
            state.settings.recent.retain(|p| *p != place);
            settings::save(state, effects);
        }
        LibraryCommand::ReadToolAs { tool, unit, replacing } => {
            if let Some((source, seq)) = state.library.open.as_ref().map(|open| (open.source.clone(), open.seq)) {
                let title = format!("Read {tool} in {}", unit.name());
                let start = Start { what: title.clone(), ..Start::new(TaskKind::ReadTool, title) };
                let run = move |_: &Access, _: &JobCx| {
                    Ok((seq, set_unit(&source.dataset, &tool, unit, replacing.as_deref())?))
                };
                tasks::start(state, start, effects, run, tool_read);
            }
        }
        LibraryCommand::SetFilter(filter) => relist(state, |state| state.library.filter = filter),
        LibraryCommand::SetToolFilter(tool) => relist(state, |state| state.library.tool = tool),
        LibraryCommand::SetSort(sort) => relist(state, |state| state.library.sort = sort),
        LibraryCommand::SetScore(choice) => relist(state, |state| {
            (state.table.chosen, state.library.sort) = (choice, Sort::Score);
        }),
        LibraryCommand::ShowRows(rows) => state.library.rows = rows,
        LibraryCommand::Select(pair) => select(state, pair, effects),
        LibraryCommand::Step(by) => step_by(state, by, effects),
        LibraryCommand::First => select_row(state, 0, effects),
        LibraryCommand::Last => select_row(state, usize::MAX, effects),
        LibraryCommand::NextUnfinished => {
            let next = next_unfinished(state);
            select_unfinished(state, next, effects);
        }
        LibraryCommand::NextWorst => select_next_worst(state, effects),
        LibraryCommand::DoneAndNext if labels::says_open_polygon(state) => {}
        LibraryCommand::DoneAndNext => {
            labels::set_review(state, Review::Done, effects);
            // Before the list is sorted anew, so that "next" is what the person sees as next.
            let next = next_unfinished(state);
            select_unfinished(state, next, effects);
            state.reorder();
        }
    }
}

/// Changes what the order of the list is made of.
fn relist(state: &mut State, change: impl FnOnce(&mut State)) {
    change(state);
    state.reorder();
}

fn open(state: &mut State, place: Place, effects: &mut Vec<Effect>) {
    labels::end_stroke(state, effects);
    state.library.last_seq.0 += 1;
    let seq = state.library.last_seq;
    state.library.opening = Some(place.clone());
    state.library.failure = None;
    let title = format!("Open {place}");
    let start = Start { what: title.clone(), ..Start::new(TaskKind::Open, title) };
    let run = move |access: &Access, _: &JobCx| {
        let source = Source::open(&place, access.services.waiting.as_deref())?;
        Ok((seq, place, Arc::new(source)))
    };
    if let Some(task) = tasks::start(state, start, effects, run, opened) {
        task.opening = Some(seq);
    }
}

/// A data set was opened.
pub fn opened((seq, place, source): &(DatasetSeq, Place, Arc<Source>), state: &mut State, effects: &mut Vec<Effect>) {
    // Else a later opening was started meanwhile: this one is not wanted any more.
    if *seq == state.library.last_seq {
        show(state, *seq, place.clone(), source, effects);
    }
}

/// The CAD file of a tool is read in another unit, in a data set: what failed for it is tried again.
pub fn tool_read((seq, set): &(DatasetSeq, UnitSet), state: &mut State, _: &mut Vec<Effect>) {
    let done = format!("{} is now read in {}", set.tool, set.unit.name());
    match &set.not_written {
        None => state.log.saved(format!("{done}: unit.txt says {}", set.word), set.file.clone()),
        Some(why) => state.log.push(
            Level::Warning,
            format!("{done} until this data set is closed: unit.txt could not be written"),
            Some(why.clone()),
            Some("Copy the data set to a folder you can write to".to_owned()),
        ),
    }
    if state.library.is_open(*seq) {
        state.tasks.failed.clear();
        state.library.units_named += 1;
    }
}

/// Puts a place first among the recent ones.
fn remember(state: &mut State, place: &Place, effects: &mut Vec<Effect>) {
    let recent = &mut state.settings.recent;
    recent.retain(|p| p != place);
    recent.insert(0, place.clone());
    recent.truncate(MAX_RECENT);
    settings::save(state, effects);
}

fn select_row(state: &mut State, row: usize, effects: &mut Vec<Effect>) {
    let last = state.library.order.len().wrapping_sub(1);
    if let Some(pair) = state.library.order.get(row.min(last)).copied() {
        select(state, pair, effects);
    }
}

fn step_by(state: &mut State, by: i64, effects: &mut Vec<Effect>) {
    let row = state.selection.pair.and_then(|pair| state.library.row_of(pair));
    // Where what is selected was filtered away: start where the list starts.
    let row = row.map_or(0, |row| (row as i64).saturating_add(by).max(0) as usize);
    select_row(state, row, effects);
}

/// The next of the list whose review is not finished, going round.
fn next_unfinished(state: &State) -> Option<PairId> {
    let order = &state.library.order;
    let start = state.selection.pair.and_then(|pair| state.library.row_of(pair)).map_or(0, |row| row + 1);
    let unfinished = |pair: &&PairId| {
        Some(**pair) != state.selection.pair
            && state.library.entry(**pair).is_some_and(|e| !state.document.review(&e.name).is_finished())
    };
    order[start.min(order.len())..].iter().chain(order).find(unfinished).copied()
}

fn select_unfinished(state: &mut State, next: Option<PairId>, effects: &mut Vec<Effect>) {
    match next {
        Some(pair) => select(state, pair, effects),
        None => state.log.info("All pairs of the list are done or skipped"),
    }
}

fn select_next_worst(state: &mut State, effects: &mut Vec<Effect>) {
    if state.table.by().is_none() {
        return;
    }
    if state.library.sort == Sort::Score && !state.table.chosen.best_first {
        return step_by(state, 1, effects);
    }
    state.library.sort = Sort::Score;
    state.table.chosen.best_first = false;
    state.reorder();
    select_row(state, 0, effects);
}

pub(super) fn select(state: &mut State, pair: PairId, effects: &mut Vec<Effect>) {
    if state.library.entry(pair).is_none() || state.selection.pair == Some(pair) {
        return;
    }
    labels::end_stroke(state, effects);
    state.selection.pair = Some(pair);
    state.selection.hover_point = None;
    state.workbench.leave_pair();
    inspect::rewind(state);
    state.document.changed = None;
    // What failed while it was only loaded ahead was not reported then.
    if let Some(key) = state.pair_key()
        && let Some(err) = state.tasks.failed.get(&Request::Sample(key))
    {
        state.log.error(err);
    }
    say_notes(state);
    results::say_masks(state);
    settings::follow_range(state);
}

/// Says the oddities of the files of the selected pair, once it is loaded; each pair once.
pub(super) fn say_notes(state: &mut State) {
    let Some((key, sample)) = state.pair_key().and_then(|key| Some((key, state.results.samples.get(&key)?.clone())))
    else {
        return;
    };
    if sample.notes.is_empty() || !state.results.noted.insert(Request::Sample(key)) {
        return;
    }
    let name = state.pair_name().to_owned();
    for note in &sample.notes {
        let detail = note.file.display().to_string();
        state.log.push(Level::Warning, format!("{name}: {}", note.what), Some(detail), Some(note.hint.clone()));
    }
}

/// Shows a data set that was opened.
fn show(state: &mut State, seq: DatasetSeq, place: Place, source: &Arc<Source>, effects: &mut Vec<Effect>) {
    labels::end_stroke(state, effects);
    // What is being written goes on; what could not be would be forgotten.
    let failed = state.document.failed.clone();
    let unsaved: Vec<_> = labels::unsaved(state).into_iter().filter(|one| failed.contains_key(&one.name)).collect();
    if let Some(open) = state.library.open.as_ref().filter(|_| !unsaved.is_empty()) {
        effects.push(Effect::keep_waiting(open.source.clone(), unsaved));
    }
    // Predictions under way are of the data set before.
    tasks::cancel_all(state, effects);
    state.tasks.running.values_mut().for_each(|task| task.outdated = true);
    let before = state.entry().map(|entry| entry.name.clone());
    let same_place = state.library.open.as_ref().is_some_and(|open| open.place == place);
    // The first opening of a run goes on where the last run ended.
    let last = state.settings.last.clone();
    let resumed = state.library.open.is_none() && last.place.as_ref() == Some(&place);
    state.results = Results::default();
    state.table.result = None;
    state.table.scored = None;
    state.table.scores = Arc::default();
    state.learn = state.learn.emptied();
    // Somebody's own folder is said what it is, unless it was open when the window was closed.
    let own = source.dataset.root.is_some() && !resumed;
    let shown = if same_place { state.doctor.shown } else { own && state.settings.about_own_data };
    state.doctor = DoctorState { shown, ..DoctorState::default() };
    state.history.clear();
    state.tasks.failed.clear();
    state.document = Document {
        reviews: source.reviews.states.clone(),
        notes: source.reviews.notes.clone(),
        marked: true,
        last_revision: state.document.last_revision,
        ..Document::default()
    };
    state.library.opening = None;
    let tools = source.dataset.index.tools();
    state.library.open = Some(OpenDataset { seq, place: place.clone(), source: source.clone(), tools });
    if !same_place {
        state.library.filter.clear();
        state.library.tool = None;
        state.library.rows = 0..0;
    }
    if resumed {
        state.library.sort = last.sort;
    }
    state.reorder();
    if resumed {
        let pads = source.dataset.rig.pads().len();
        state.selection.finger = PadId::new(last.finger.min(pads.saturating_sub(1)));
        state.selection.both_fingers = last.both_fingers;
    }
    let kept = before.filter(|_| same_place).or(resumed.then_some(last.pair)).and_then(|name| {
        let at = source.dataset.index.pairs.iter().position(|entry| entry.name == name)?;
        u32::try_from(at).ok().map(PairId)
    });
    state.selection.pair = kept.or_else(|| state.library.order.first().copied());
    state.selection.hover = None;
    state.selection.hover_point = None;
    state.workbench.leave_pair();
    inspect::rewind(state);
    let (pairs, problems) = (source.dataset.index.pairs.len(), source.problems.len());
    let (level, found, hint) = match problems {
        0 => (Level::Info, String::new(), None),
        n => {
            let hint = "The list of problems says which files, and what to do.".to_owned();
            (Level::Warning, format!(", {}", counted(n, "problem")), Some(hint))
        }
    };
    state.log.push(level, format!("{}: {pairs} pairs{found}", source.dataset.title), None, hint);
    if let Some(text) = source.recovered.text() {
        let hint = "Undo takes them back, pair by pair.";
        state.log.push(Level::Warning, text, None, Some(hint.into()));
    }
    source.recovered.failed.iter().for_each(|err| state.log.error(err));
    remember(state, &place, effects);
}

/// Takes the bundles that were found.
pub(super) fn found(state: &mut State, bundles: Vec<BundleInfo>, problems: Vec<TaskError>) {
    for problem in &problems {
        state.log.error(problem);
    }
    let lacks = |kind| bundles.iter().all(|bundle| bundle.kind != kind);
    for (kind, text) in [
        (BundleKind::Generator, "No generator found: nothing can be predicted"),
        (BundleKind::Mask, "No mask model found: masks come from a threshold"),
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
