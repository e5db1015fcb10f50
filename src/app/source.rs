//! [`Source`]: an open data set with its labels.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use touch2touch_core::dataset::{PairId, Problem};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::doubts;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::FOLDER;
use touch2touch_pipeline::labels::{Labels, Recovered, Reviews, Unsaved, recover};

/// A place that can be opened.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// The built-in simulated data.
    Demo,
    /// A folder, or a file in one.
    Path(PathBuf),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Demo => write!(f, "the demo"),
            Self::Path(path) => write!(f, "{}", path.display()),
        }
    }
}

/// An open data set: its index is in memory, samples and labels are read on demand, from any thread.
#[derive(Debug)]
pub struct Source {
    /// The data set.
    pub dataset: Arc<Dataset>,
    /// Store of its labels.
    pub labels: Labels,
    /// The problems of its files and of its labels.
    pub problems: Vec<Problem>,
    /// Review states and notes that were stored when it was opened.
    pub reviews: Reviews,
    /// Labels that could not be saved before, and are now.
    pub recovered: Recovered,
    /// The folder of labels that could not be saved.
    waiting: Option<PathBuf>,
}

impl Source {
    /// Opens a place: data set, stored labels, what is wrong with either, and what waits in a folder of labels that could not
    /// be saved before.
    ///
    /// # Errors
    /// If nothing in it can be opened.
    pub fn open(place: &Place, waiting: Option<&Path>) -> Result<Self, TaskError> {
        let dataset = match place {
            Place::Demo => Dataset::demo(),
            Place::Path(path) => Dataset::open(path)
                .map_err(|err| TaskError::from_error(format!("Open {place}"), &err).with_hint(err.hint))?,
        };
        let mut problems = doubts::notes(&dataset);
        problems.extend(dataset.problems.iter().cloned());
        let labels = Labels::of(&dataset);
        let recovered = waiting.map(|waiting| recover(&dataset, &labels, waiting)).unwrap_or_default();
        let mut reviews = labels.reviews();
        problems.append(&mut reviews.problems);
        let (dataset, waiting) = (Arc::new(dataset), waiting.map(Path::to_owned));
        Ok(Self { dataset, labels, problems, reviews, recovered, waiting })
    }

    /// Itself with a data set that grew while it was followed: known pairs keep their ids, and what was labeled stays known.
    pub(crate) fn grown(&self, dataset: &Arc<Dataset>) -> Self {
        Self {
            dataset: dataset.clone(),
            labels: self.labels.continued(dataset),
            problems: dataset.problems.clone(),
            reviews: self.reviews.clone(),
            recovered: Recovered::default(),
            waiting: self.waiting.clone(),
        }
    }

    /// Reads one pair.
    ///
    /// # Errors
    /// With the file and the reason if it cannot be read.
    pub fn load(&self, pair: PairId) -> Result<Sample, TaskError> {
        self.dataset.load(pair).map_err(|err| {
            let name = self.dataset.index.get(pair).map_or("a pair", |entry| &entry.name);
            TaskError::from_error(format!("Load {name}"), &err).with_hint(err.hint)
        })
    }

    /// Writes labels that could not be written where they belong into a folder; `None` = where they wait for the next opening.
    /// Returns the place where they are then.
    ///
    /// # Errors
    /// If they cannot be written there either.
    pub fn keep_labels(&self, unsaved: &[Unsaved], folder: Option<&Path>) -> Result<PathBuf, TaskError> {
        match (folder, &self.waiting) {
            (Some(folder), _) => {
                let folder = folder.join(FOLDER);
                self.labels.keep_in(&self.dataset, unsaved, &folder)?;
                Ok(folder)
            }
            (None, Some(waiting)) => self.labels.keep_waiting(&self.dataset, unsaved, waiting),
            (None, None) => {
                Err(TaskError::new("Keep the labels", "this system names no folder for what could not be saved"))
            }
        }
    }
}

/// A touch that arrived in a followed folder.
#[derive(Clone, Debug)]
pub struct Followed {
    /// The data set with all pairs so far: those known before keep their ids.
    pub source: Arc<Source>,
    /// The touch.
    pub pair: PairId,
    /// True where it was there before, and only its bubble came later.
    pub completed: bool,
    /// The tensors, or why they cannot be read.
    pub sample: Result<Arc<Sample>, TaskError>,
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use touch2touch_core::diffusion::GenerateConfig;
    use touch2touch_core::frames::PlanarPose;
    use touch2touch_core::grid::{Mask, RgbGrid};
    use touch2touch_core::label::Provenance;
    use touch2touch_core::manual::AcceptedPose;
    use touch2touch_core::postprocess::ShiftMode;
    use touch2touch_core::rig::lab;
    use touch2touch_pipeline::export::{DrawnMasks, ExportChoice, ExportSetup, LeftOut, Which, export_masks, plan};
    use touch2touch_pipeline::job::JobCx;
    use touch2touch_pipeline::labels::{DrawnMask, ImprintOf, MaskPlace, PairLabels, Review, Revision};

    /// A folder with one pair of pictures.
    fn pictures(folder: &Path) {
        let gray = touch2touch_core::grid::Grid::from_fn(32, 32, |x, y| (x * 4 + y) as u8);
        let rgb = RgbGrid::from_fn(32, 32, |x, y| [x as f32, y as f32, 9.0]);
        touch2touch_pipeline::io::images::write_gray8(&folder.join("a_bubble.png"), &gray).unwrap();
        touch2touch_pipeline::io::images::write_rgb8(&folder.join("a_gelslim.png"), &rgb).unwrap();
    }

    fn labels() -> PairLabels {
        let mask = Arc::new(Mask::from_fn(175, 140, |x, y| x > 20 && y < 9));
        PairLabels {
            masks: [(
                MaskPlace::measured(lab::RIGHT),
                DrawnMask { revision: Revision(3), ..DrawnMask::new(mask, Provenance::Threshold { min_m: 0.005 }) },
            )]
            .into(),
            review: Review::InProgress,
            accepted: [
                (ImprintOf::Measured, PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.001 }.into()),
                (
                    ImprintOf::predicted("b0", &GenerateConfig::default(), ShiftMode::Raw),
                    AcceptedPose { pose: PlanarPose { y_m: 1e-3, ..PlanarPose::default() }, by_hand: true },
                ),
            ]
            .into(),
            note: "shallow at the edge".into(),
        }
    }

    #[test]
    fn export_takes_what_is_stored_and_what_changed_since() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let source = Source::open(&Place::Path(folder.path().to_owned()), None).unwrap();
        let name = source.dataset.index.pairs[0].name.clone();
        let out = folder.path().join("export");
        let export = |changed: &BTreeMap<String, PairLabels>, choice| {
            let (masks, setup) = (DrawnMasks { labels: &source.labels, changed }, ExportSetup { pairs: None, choice });
            export_masks(&source.dataset, &masks, &setup, &out, None, &JobCx::unwatched()).map(|(plan, _)| plan)
        };
        let (done, begun) = (ExportChoice::default(), ExportChoice { which: Which::Begun, ..ExportChoice::default() });
        let none = export(&BTreeMap::new(), done).unwrap_err();
        assert!(none.why.contains("no mask") && !out.exists());
        let finger = source.load(PairId(0)).unwrap().pads.entries().next().unwrap().0;
        let mut labels = labels();
        assert_eq!(finger, lab::RIGHT);
        labels.review = Review::InProgress;
        let changed = BTreeMap::from([(name.clone(), labels.clone())]);
        // What was begun goes along if asked only.
        let masks = DrawnMasks { labels: &source.labels, changed: &changed };
        let plan = plan(&source.dataset, &masks, &ExportSetup { pairs: None, choice: done }).unwrap();
        assert_eq!((plan.total(), &plan.left_out), (0, &BTreeMap::from([(LeftOut::NotDone, 1)])));
        assert!(export(&changed, done).unwrap_err().why.contains("not marked \"done\""));
        let line = export(&changed, begun).unwrap().lines().join("; ");
        assert!(line.contains("1 mask"), "{line}");
        labels.review = Review::Done;
        let changed = BTreeMap::from([(name.clone(), labels.clone())]);
        assert!(export(&changed, done).is_ok());
        for left_out in [Review::Skip, Review::Flagged] {
            labels.review = left_out;
            assert!(export(&BTreeMap::from([(name.clone(), labels.clone())]), begun).is_err());
        }
    }

    #[test]
    fn the_demo_opens_without_a_folder() {
        let demo = Source::open(&Place::Demo, None).unwrap();
        assert_eq!(demo.dataset.root, None);
        assert!(demo.dataset.index.pairs.len() >= 12);
        assert!(Source::open(&Place::Path("/no/such/folder".into()), None).unwrap_err().hint.is_some());
    }
}
