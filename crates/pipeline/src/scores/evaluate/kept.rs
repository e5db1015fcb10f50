//! The last evaluation of a data set, kept for the next start: [`Kept`].

use std::io;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use super::{Evaluation, Setup};
use crate::infer::bundle::MANIFEST;
use crate::io::dataset::Dataset;
use crate::io::digest::sha256;
use crate::io::{atomic, files};
use crate::labels::Labels;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::Scores;

/// Largest file that is read, bytes: that of a hundred thousand grasps.
const MOST_BYTES: u64 = 1 << 28;
/// Letters of a digest in a file's name.
const LETTERS: usize = 24;

/// The file that an evaluation is kept in: another one for other data, models, labels or settings.
#[derive(Clone, Debug)]
pub struct Kept {
    folder: PathBuf,
    /// Begins the names of the files of its data set, of which one is kept.
    dataset: String,
    file: PathBuf,
}

impl Kept {
    /// The file in `folder` for an evaluation of a data set as it is now.
    pub fn of(folder: &Path, dataset: &Dataset, setup: &Setup) -> Self {
        let place = dataset.root.as_ref().map_or_else(|| dataset.title.clone(), |root| root.display().to_string());
        let mut decides = format!("{} {:?}", env!("CARGO_PKG_VERSION"), dataset.read_as()).into_bytes();
        decides.extend(serde_json::to_vec(setup).unwrap_or_default());
        let mask_model = setup.recipe.mask_model.as_ref().map(|model| &model.origin);
        for bundle in setup.bundles.iter().chain(&setup.classifier).chain(mask_model) {
            decides.extend(&*bundle.file(MANIFEST).read(files::SMALL).unwrap_or_default());
        }
        let pairs = (0..dataset.index.pairs.len() as u32).flat_map(|pair| dataset.pair_files(PairId(pair)));
        let models =
            dataset.index.tools().into_iter().filter_map(|tool| dataset.tool_mesh_file(&tool).map(Path::to_owned));
        let labels = Labels::of(dataset).folder().ok().and_then(|folder| std::fs::read_dir(folder).ok());
        let mut labels: Vec<PathBuf> = labels.into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        labels.sort();
        for file in pairs.chain(models).chain(labels) {
            let state = file.metadata().ok().map(|state| (state.len(), state.modified().ok()));
            let since = state.and_then(|(_, at)| at?.duration_since(UNIX_EPOCH).ok());
            decides.extend(format!("{} {:?} {since:?}", file.display(), state.map(|(len, _)| len)).bytes());
        }
        let [of_dataset, rest] = [place.as_bytes(), &decides].map(|bytes| sha256(bytes)[..LETTERS].to_owned());
        let file = folder.join(format!("{of_dataset}-{rest}.json"));
        Self { folder: folder.to_owned(), dataset: of_dataset, file }
    }

    /// The evaluation, by the settings that the file was named for; `None` where none is kept, or it cannot be read.
    pub fn read(&self, setup: Setup) -> Option<Evaluation> {
        let (mut found, scores): (Evaluation, Vec<Scores>) =
            serde_json::from_slice(&files::read(&self.file, MOST_BYTES).ok()?).ok()?;
        (found.setup, found.scores) = (setup, scores);
        Some(found)
    }

    /// Keeps it in place of the one before.
    ///
    /// # Errors
    /// Whatever the disk says.
    pub fn write(&self, evaluation: &Evaluation) -> io::Result<()> {
        std::fs::create_dir_all(&self.folder)?;
        for old in std::fs::read_dir(&self.folder)?.flatten() {
            if old.file_name().to_string_lossy().starts_with(&self.dataset) {
                std::fs::remove_file(old.path())?;
            }
        }
        atomic::write_bytes(&self.file, &serde_json::to_vec(&(evaluation, &evaluation.scores))?)
    }
}
