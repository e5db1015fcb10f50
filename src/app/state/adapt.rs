//! What the fit is asked for, and its last answer.

use std::ops::RangeInclusive;
use std::sync::Arc;

use super::State;
use super::labels::Review;
use super::tasks::TaskKind;
use touch2touch_core::dataset::PairId;
use touch2touch_work::adapt::{AdaptSetup, Adapted, HeldBack, Tuning};
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::job::Curve;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::recipe::Recipe;

/// Parts in which pairs are left out in turn.
const FOLDS: usize = 3;

/// Steps of tuning that can be asked for.
pub(crate) const TUNING_STEPS: RangeInclusive<u32> = 30..=5000;

/// Which pairs are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumIter)]
pub enum AdaptPairs {
    /// All of the data set.
    #[default]
    All,
    /// Those marked done.
    Done,
    /// Those in the list as it is filtered.
    Listed,
}

impl AdaptPairs {
    /// The name on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::All => "all pairs",
            Self::Done => "pairs marked done",
            Self::Listed => "pairs in the list",
        }
    }
}

/// The fit and how it is asked for.
#[derive(Clone, Debug)]
pub struct AdaptState {
    /// Which pairs.
    pub pairs: AdaptPairs,
    /// Whether the networks themselves are tuned after the closed form.
    pub tune: bool,
    /// With how many steps: 50 take about a minute on two free cores, for each part and for all.
    pub steps: u32,
    /// The last fit to the open data set.
    pub result: Option<Arc<Adapted>>,
    /// Its bundle.
    pub bundle: Option<Arc<str>>,
}

impl Default for AdaptState {
    fn default() -> Self {
        Self { pairs: AdaptPairs::default(), tune: false, steps: 50, result: None, bundle: None }
    }
}

impl State {
    /// The pairs that a fit started now would take.
    pub(crate) fn adapt_pairs(&self) -> Box<dyn Iterator<Item = PairId> + '_> {
        let Some(open) = &self.library.open else { return Box::new(std::iter::empty()) };
        let pairs = &open.source.index().pairs;
        let all = (0..pairs.len() as u32).map(PairId);
        match self.adapt.pairs {
            AdaptPairs::All => Box::new(all),
            AdaptPairs::Done => {
                Box::new(all.filter(|id| self.document.review(&pairs[id.0 as usize].name) == Review::Done))
            }
            AdaptPairs::Listed => Box::new(self.library.order.iter().copied()),
        }
    }

    /// What is fitted: the chosen generator, or what that was fitted from.
    fn to_be_fitted(&self) -> Option<&BundleInfo> {
        let chosen = self.bundle(BundleKind::Generator).ok()?;
        match chosen.fit() {
            Some(fit) => self.library.bundle(&fit.from_sha256),
            None => Some(chosen),
        }
    }

    /// Whether there is something to fit, and pairs to fit it to.
    pub(crate) fn can_adapt(&self) -> bool {
        self.to_be_fitted().is_some() && self.adapt_pairs().next().is_some()
    }

    /// What a fit started now would do; `None` without data, pairs or a depth generator.
    pub fn adapt_setup(&self) -> Option<AdaptSetup> {
        let bundle = self.to_be_fitted()?.clone();
        self.can_adapt().then(|| AdaptSetup {
            recipe: Recipe {
                generator: Some((bundle.clone().into(), self.settings.generate.config(&bundle))),
                ..self.in_force(ImprintSource::Predicted)
            },
            pairs: self.adapt_pairs().collect(),
            folds: FOLDS,
            tuning: self.adapt.tune.then_some(Tuning::Steps(self.adapt.steps)),
            unfinished: None,
            out: None,
            force: false,
            replace: false,
        })
    }

    /// How the tuning goes, or how the last one went.
    pub(crate) fn tuning_curves(&self) -> &[Curve] {
        match (self.running(TaskKind::Fit), &self.adapt.result) {
            (Some((_, task)), _) => &task.progress.curves,
            (None, Some(result)) => &result.curves,
            (None, None) => &[],
        }
    }

    /// The chosen touch as the model drew it before and after the fit; the first one where the chosen one is not among
    /// those that were left out.
    pub fn held_back(&self) -> Option<&HeldBack> {
        let all = &self.adapt.result.as_ref()?.held_back;
        let of_pair = || all.iter().filter(|held| Some(held.pair) == self.selection.pair);
        of_pair().find(|held| held.pad == self.selection.finger).or_else(|| of_pair().next()).or_else(|| all.first())
    }

    /// Whether that is what predicts now.
    pub(crate) fn uses_fit(&self) -> bool {
        let now = self.bundle(BundleKind::Generator).ok().map(|bundle| &bundle.id);
        self.fitted().is_some_and(|fitted| Some(&fitted.id) == now)
    }

    /// The last fit, where it was not written because of what speaks against it.
    pub(crate) fn refused_fit(&self) -> Option<&Arc<Adapted>> {
        self.adapt.result.as_ref().filter(|adapted| adapted.unwritten.is_some())
    }

    /// The bundle that was fitted to the open data set.
    pub fn fitted(&self) -> Option<&BundleInfo> {
        self.library.bundle(self.adapt.bundle.as_deref()?)
    }
}
