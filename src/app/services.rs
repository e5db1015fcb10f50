//! [`Services`]: files and models as the lanes use them; tests put their own behind it.
//!
//! The studio and the command line use [`DataSource`] and [`Services`] as [`live`] implements them over `io` and `infer`.

pub mod live;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use super::keys::{PredictionKey, TouchKey};
pub use super::source::{DataSource, Followed};
use super::state::labels::Review;
use super::state::library::Place;
use super::state::settings::Settings;
use touch2touch_core::contact::ContactMask;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::Recovered;
use touch2touch_pipeline::steps::bundles::BundleInfo;
use touch2touch_pipeline::steps::models::{GenerateInput, Models};
use touch2touch_pipeline::steps::prediction::Prediction;

/// A data set that was opened.
#[derive(Clone)]
pub struct Opened {
    /// The data.
    pub source: Arc<dyn DataSource>,
    /// Review states stored with it that are not "todo", by pair name.
    pub reviews: BTreeMap<String, Review>,
    /// Notes stored with it, by pair name.
    pub notes: BTreeMap<String, String>,
    /// Labels that could not be saved before, and are now.
    pub recovered: Recovered,
}

impl std::fmt::Debug for Opened {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Opened({}, {} reviews)", self.source.title(), self.reviews.len())
    }
}

/// Files and models, as the lanes use them.
pub trait Services: Send + Sync {
    /// Reads the index of a data set.
    ///
    /// # Errors
    /// If nothing in it can be opened.
    fn open(&self, place: &Place) -> Result<Opened, TaskError>;

    /// The bundles that ship with the program and those in `folders`; what is wrong with those that were refused.
    fn find_bundles(&self, folders: &[PathBuf]) -> (Vec<BundleInfo>, Vec<TaskError>);

    /// Runs the generator on the pictures of its input sensor; one answer for each, in order. The model
    /// stays loaded between calls; the runtime calls this on one lane only.
    ///
    /// # Errors
    /// If the model cannot be loaded or run, or the job was told to stop.
    fn predict(
        &self,
        bundle: &BundleInfo,
        engine: EngineChoice,
        config: &GenerateConfig,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError>;

    /// The predictions of a touch that are kept on the disk, oldest first, with the keys that `bundles` and
    /// `runtime` give it now. Never fails: what cannot be read is not there.
    fn stored(
        &self,
        bundles: &[BundleInfo],
        runtime: EngineChoice,
        touch: TouchKey,
        difference: &RgbGrid,
    ) -> Vec<(PredictionKey, Prediction)> {
        let _ = (bundles, runtime, touch, difference);
        Vec::new()
    }

    /// Runs the mask model on an imprint in meters, as [`Models::mask`]; the mask says what it is made of in the end.
    /// Called on the same lane as [`Self::predict`].
    ///
    /// # Errors
    /// If the model cannot be loaded or run.
    fn mask_by_model(
        &self,
        bundle: &BundleInfo,
        runtime: EngineChoice,
        imprint: &DepthMap,
        probability: Option<f32>,
    ) -> Result<ContactMask, TaskError>;

    /// The models, which stay loaded between calls.
    fn models(&self) -> &Models {
        static MODELS: LazyLock<Models> = LazyLock::new(|| Models::new(None));
        &MODELS
    }

    /// The folder of models that were made here.
    fn models_folder(&self) -> Option<&Path> {
        None
    }

    /// The folder of tuning that was stopped.
    fn unfinished_folder(&self) -> Option<&Path> {
        None
    }

    /// The time that a pair stays on screen before it is predicted without being asked for.
    fn patience(&self) -> Duration {
        Duration::ZERO
    }

    /// The time that labels that could not be written wait until they are tried again.
    fn retry_after(&self) -> Duration {
        Duration::from_secs(5)
    }

    /// The stored settings (defaults where there are none), and what was wrong if they were set aside.
    fn load_settings(&self) -> (Settings, Option<TaskError>);

    /// Keeps shift statistics with the program's own files; says where, or `None` where nothing is kept.
    ///
    /// # Errors
    /// If they cannot be written.
    fn save_statistics(&self, _statistics: &ShiftStatistics) -> Result<Option<PathBuf>, TaskError> {
        Ok(None)
    }

    /// Writes the settings.
    ///
    /// # Errors
    /// If they cannot be written.
    fn save_settings(&self, settings: &Settings) -> Result<(), TaskError>;
}

/// Shared services.
pub(crate) type SharedServices = Arc<dyn Services>;
