//! The room of training a mask model on the masks that people corrected.

pub use super::state::train::TrainForm;
pub(crate) use super::state::train::{MINUTES, MOST_HELD_OUT, STEPS, TrainState};

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Access, Effect, Errand};
use super::settings::{self, prefer};
use super::source::DataSource;
use super::state::State;
use super::state::labels::PairLabels;
use super::state::tasks::{Level, TaskKind};
use super::{recipe, tasks};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::DrawnMasks;
use touch2touch_pipeline::job::{Curve, JobCx};
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::learn::train::{self, TrainSetup, Trained};
use touch2touch_pipeline::steps::bundles::{self, BundleInfo, BundleKind};

/// A command to the training.
#[derive(Clone, Copy, Debug)]
pub enum TrainCommand {
    /// Changes what is asked for.
    SetForm(TrainForm),
    /// Trains the chosen mask model on the masks of pairs marked done.
    Start,
    /// Makes automatic masks with the trained model from now on.
    Use,
}

pub(super) fn step(state: &mut State, command: TrainCommand, effects: &mut Vec<Effect>) {
    match command {
        TrainCommand::SetForm(form) => {
            state.train.form = form.validated();
            // What is kept is of what was asked for then.
            state.train.stopped = None;
        }
        TrainCommand::Start => {
            let (Some(setup), Some(open)) = (setup(state), &state.library.open) else { return };
            let errand = Train { source: open.source.clone(), changed: state.document.labels.clone(), setup };
            if tasks::start(state, TaskKind::Train.name(), errand, effects).is_some() {
                state.train.stopped = None;
            }
        }
        TrainCommand::Use => take_up(state, effects),
    }
}

/// Makes automatic masks with the trained model.
fn take_up(state: &mut State, effects: &mut Vec<Effect>) {
    let Some(name) = trained(state).map(|bundle| bundle.name.clone()) else { return };
    let bundle = name.clone();
    settings::step(state, prefer(move |s| s.mask.bundle = Some(bundle.clone())), effects);
    state.log.info(format!("Automatic masks are made by {name} from now on"));
}

/// Trains a mask model, and keeps the new one where the program keeps models.
pub struct Train {
    source: Arc<dyn DataSource>,
    /// The labels of pairs, as far as they may not be on the disk yet.
    changed: BTreeMap<String, PairLabels>,
    setup: TrainSetup,
}

impl Errand for Train {
    type End = (Arc<Trained>, BundleInfo);
    const KIND: TaskKind = TaskKind::Train;

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        let (services, what) = (&access.services, Self::KIND.name());
        let dataset = self.source.on_disk(what)?;
        let models = services.models_folder().ok_or_else(|| {
            TaskError::new(what, "this system names no folder for models")
                .with_hint("Train with touch2touch masks train --out FOLDER.")
        })?;
        let unfinished = services.unfinished_folder().map(Into::into);
        let setup = TrainSetup { out: train::new_folder(models, dataset), unfinished, ..self.setup };
        let masks = DrawnMasks { labels: &Labels::of(dataset), changed: &self.changed };
        let trained = train::train(dataset, &masks, &setup, services.models(), cx)?;
        let bundle = bundles::open("Open the trained bundle", trained.bundle.as_path())?;
        Ok((Arc::new(trained), bundle))
    }

    /// Puts the bundle in the place of the mask model in force, unless it is worse than that on pairs that were left out.
    fn ended((trained, bundle): &Self::End, state: &mut State, effects: &mut Vec<Effect>) {
        let scores = match (trained.before, trained.after) {
            (Some(before), Some(after)) => {
                format!(", IoU {:.3} instead of {:.3} on other pairs", after.iou, before.iou)
            }
            _ => String::new(),
        };
        state.log.saved(format!("Trained: {}{scores}", bundle.name), trained.bundle.clone());
        state.train.bundle = Some(bundle.id.clone());
        state.library.bundles.retain(|known| known.origin != bundle.origin && known.id != bundle.id);
        state.library.bundles.push(bundle.clone());
        if trained.is_worse() {
            let hint = "Train it for longer or on more masks; \"Use the trained mask model\" takes it all the same.";
            let text = "The trained mask model is worse on other pairs, and was not taken into use";
            state.log.push(Level::Warning, text, None, Some(hint.into()));
        } else {
            take_up(state, effects);
        }
        state.train.result = Some(trained.clone());
    }
}

/// The setup of a training started now; `None` without data or a mask model. Where the new bundle lies is not the
/// state's to say.
pub(crate) fn setup(state: &State) -> Option<TrainSetup> {
    state.library.open.as_ref()?;
    let generators = state.library.bundles.iter().filter(|bundle| bundle.kind == BundleKind::Generator);
    Some(TrainSetup {
        start: recipe::bundle(state, BundleKind::Mask).ok()?.clone(),
        generators: generators.cloned().collect(),
        engine: state.settings.runtime,
        registration: state.settings.registration,
        choice: state.train.form.choice,
        tuning: state.train.form.tuning(),
        unfinished: None,
        out: PathBuf::new(),
    })
}

/// The curves of the training, or of the last one.
pub(crate) fn curves(state: &State) -> &[Curve] {
    match (state.tasks.of_kind(TaskKind::Train), &state.train.result) {
        (Some((_, task)), _) => &task.progress.curves,
        (None, Some(result)) => &result.curves,
        (None, None) => &[],
    }
}

/// The bundle that was trained on the open data set.
pub fn trained(state: &State) -> Option<&BundleInfo> {
    state.library.bundle(state.train.bundle.as_deref()?)
}

/// True where the trained bundle makes the automatic masks now.
pub fn uses_trained(state: &State) -> bool {
    let now = recipe::bundle(state, BundleKind::Mask).ok().map(|bundle| &bundle.id);
    trained(state).is_some_and(|trained| Some(&trained.id) == now)
}
