//! The room of the panel about the open data set: what it is, what the models are worth on it, and what would better that.

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Access, Effect};
use super::keys::{DatasetSeq, ImprintSource};
use super::learn::{self, AdaptPairs, LearnCommand, Network};
use super::library::{self, LibraryCommand};
use super::recipe;
use super::settings::{self, ColorRange, prefer};
use super::state::State;
use super::state::tasks::TaskKind;
use super::tasks::{self, Start};
use touch2touch_core::read_as::parse_list;
use touch2touch_pipeline::doctor::{self, Cure, Examined, Worth};
use touch2touch_pipeline::doubts;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::doctor::MOST_PAIRS;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::learn::train::MasksFrom;
use touch2touch_pipeline::steps::bundles::BundleKind;
use touch2touch_pipeline::steps::recipe::Recipe;

/// A command to the panel.
#[derive(Clone, Debug)]
pub enum DoctorCommand {
    /// Opens or closes it.
    Show(bool),
    /// Tries the models on a sample of the data set.
    Try,
    /// Does what betters a fact.
    Cure(Cure),
}

pub(super) fn step(state: &mut State, command: DoctorCommand, effects: &mut Vec<Effect>) {
    match command {
        DoctorCommand::Show(shown) => {
            state.close_dialogs();
            state.doctor.shown = shown && state.library.open.is_some();
        }
        DoctorCommand::Try => {
            let (Some(recipe), Some(open)) = (worth_recipe(state), &state.library.open) else { return };
            let source = open.source.clone();
            let start = Start::new(TaskKind::TryModels, format!("Try the models on {}", source.dataset.title));
            let run = move |access: &Access, cx: &JobCx| {
                Ok(doctor::worth(&source.dataset, &recipe, &access.services.models, cx)?.map(Arc::new))
            };
            if tasks::start(state, start, effects, run, tried).is_some() {
                state.doctor.tried = true;
            }
        }
        DoctorCommand::Cure(cure) if can(state, &cure) => carry_out(state, cure, effects),
        DoctorCommand::Cure(_) => {}
    }
}

/// True where a cure can do anything now.
pub(crate) fn can(state: &State, cure: &Cure) -> bool {
    let free = |kind| state.tasks.of_kind(kind).is_none();
    state.library.open.is_some()
        && match cure {
            Cure::FitRange { min_m, max_m } => !is_fitted(state.settings.range, [*min_m, *max_m]),
            Cure::ReadTool { .. } | Cure::ReadAs { .. } => true,
            Cure::Fit { .. } => learn::can_start(state, Network::Generator),
            Cure::TrainFromCad { .. } => learn::can_start(state, Network::Masks),
            Cure::Examine { .. } => free(TaskKind::Examine),
        }
}

/// True where colors span about this range already: a little more or less is the same to the eye.
fn is_fitted(range: ColorRange, [min_m, max_m]: [f32; 2]) -> bool {
    let near = 0.15 * (max_m - min_m);
    (range.min_m - min_m).abs() <= near && (range.max_m - max_m).abs() <= near
}

fn carry_out(state: &mut State, cure: Cure, effects: &mut Vec<Effect>) {
    match cure {
        Cure::FitRange { min_m, max_m } => {
            let range = prefer(move |s| s.range = ColorRange { min_m, max_m, locked: true });
            settings::step(state, range, effects);
        }
        Cure::ReadTool { tool, unit, replacing } => {
            library::step(state, LibraryCommand::ReadToolAs { tool, unit, replacing }, effects);
        }
        Cure::ReadAs { list } => {
            let Some((seq, source)) = state.library.open.as_ref().map(|open| (open.seq, open.source.clone())) else {
                return;
            };
            let what = TaskKind::ReadOtherwise.name();
            let run = move |_: &Access, _: &JobCx| {
                let read_as = parse_list(&list).map_err(|why| TaskError::new(what, why))?;
                Ok((seq, doubts::read_otherwise(&source.dataset, &read_as)?, list))
            };
            tasks::start(state, Start::new(TaskKind::ReadOtherwise, what), effects, run, read_otherwise);
        }
        Cure::Fit { .. } => {
            state.learn.form.pairs = AdaptPairs::All;
            start_learning(state, Network::Generator, effects);
        }
        Cure::TrainFromCad { .. } => {
            state.learn.form.choice.from = MasksFrom::Cad;
            start_learning(state, Network::Masks, effects);
        }
        Cure::Examine { .. } => {
            let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
            let recipe = tried_recipe(state);
            let run = move |access: &Access, cx: &JobCx| {
                let generator = recipe.generating().ok().map(|generating| (&access.services.models, generating));
                doctor::examined(&source.dataset, MOST_PAIRS, generator, cx).map(Arc::new)
            };
            tasks::start(state, Start::new(TaskKind::Examine, TaskKind::Examine.name()), effects, run, examined);
        }
    }
}

/// Has a network learn, where it can be seen.
fn start_learning(state: &mut State, network: Network, effects: &mut Vec<Effect>) {
    // The trial of the models must not be waited for.
    if let Some((ticket, _)) = state.tasks.of_kind(TaskKind::TryModels) {
        tasks::step(state, tasks::TasksCommand::Cancel(ticket), effects);
    }
    learn::step(state, LearnCommand::Start(network), effects);
    learn::step(state, LearnCommand::Show(network), effects);
    state.doctor.shown = false;
}

/// The models that are tried: a generator as it was before it was fitted to anything.
fn tried_recipe(state: &State) -> Recipe {
    let generator = learn::to_be_fitted(state).cloned();
    Recipe {
        generator: generator.map(|bundle| (bundle.clone().into(), state.settings.generate.config(&bundle))),
        ..recipe::in_force(state, ImprintSource::Predicted)
    }
}

/// The recipe of trying the models now; `None` where no data, or no model, is there.
fn worth_recipe(state: &State) -> Option<Recipe> {
    // The models come from what is built in.
    state.library.open.as_ref()?.source.dataset.root.as_ref()?;
    let recipe = tried_recipe(state);
    (recipe.generator.is_some() || recipe.mask_model.is_some()).then_some(recipe)
}

/// True where the models can be tried.
pub(crate) fn can_try(state: &State) -> bool {
    worth_recipe(state).is_some()
}

/// True where the models are to be tried because the panel is looked at, and were not yet.
pub(crate) fn wants_worth(state: &State) -> bool {
    let doctor = &state.doctor;
    doctor.shown && !doctor.tried && can_try(state) && state.tasks.of_kind(TaskKind::TryModels).is_none()
}

/// The name of the generator in force, where it was fitted to something.
pub(crate) fn fitted_in_use(state: &State) -> Option<&str> {
    let now = recipe::bundle(state, BundleKind::Generator).ok()?;
    now.is_fitted().then_some(now.name.as_str())
}

/// The models were tried.
pub fn tried(worth: &Option<Arc<Worth>>, state: &mut State, _: &mut Vec<Effect>) {
    state.doctor.worth = worth.clone();
}

/// Every pair was examined.
pub fn examined(examined: &Arc<Examined>, state: &mut State, _: &mut Vec<Effect>) {
    state.doctor.examined = Some(examined.clone());
}

/// A data set is read otherwise than it is stored: a file of it says so, and what that says.
pub fn read_otherwise((seq, file, list): &(DatasetSeq, PathBuf, String), state: &mut State, effects: &mut Vec<Effect>) {
    let text = match list.as_str() {
        "" => "The data are read as stored".to_owned(),
        list => format!("The data are read with {list}"),
    };
    state.log.saved(text, file.clone());
    if state.library.is_open(*seq) {
        library::step(state, LibraryCommand::Reload, effects);
    }
}
