//! Folders that fill while they are open: pairs that appear are added behind the others, so that a [`PairId`] stays what
//! it was; touches without a bubble borrow the cameras of the rig.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::depths;
use super::lab::{self, PairFiles};
use super::{Dataset, Files, RIG_JSON, SAME_NAME, Scan, Source, SourceKind, error, pictures, problem};
use crate::io::catch_panic::catch_panic;
use crate::io::error::FileError;
use touch2touch_core::dataset::{PairId, Problem};
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::{DepthCamera, Sample};

/// A bubble file of the rig, in the root of a data set: its cameras serve touches that have no bubble file.
pub(crate) const RIG_FILE: &str = "rig.pt";

/// Touches of another kind beside those of the data set.
fn other_kind(root: &Path, what: &str, mine: &str) -> Problem {
    problem(
        root,
        format!("{what} lie here beside {mine}: they are left out"),
        "put touches of different kinds into folders of their own",
    )
}

impl Dataset {
    /// The data set after its folder was read again: pairs known before keep their ids, also where their files are gone.
    ///
    /// # Errors
    /// [`FileError`]: nothing is found also where the folder now holds another kind of data set only.
    pub fn grown(&self) -> Result<Self, FileError> {
        let Some(root) = &self.root else { return Ok(self.clone()) };
        drop(std::fs::read_dir(root).map_err(|err| error::no_folder(root, err))?);
        // Of the same kind: something else that comes into the folder must not hide what is known.
        let scan = match &self.source {
            Source::Lab { flat: true } => lab::scan_flat_again(root),
            Source::Lab { flat: false } => lab::scan(root),
            Source::Depths => depths::scan(root)?,
            Source::Pictures if self.folders.iter().all(|folder| folder != root) => pictures::scan_folders(root)?,
            Source::Pictures => pictures::scan(root)?,
            Source::BuiltIn(_) => None,
        };
        let fresh = Self::of(scan.ok_or_else(|| error::nothing_found(root, None))?);
        if *fresh.rig != *self.rig {
            let why = format!("{RIG_JSON} declares other sensors than when the folder was opened: open it again");
            return Err(error::bad_rig(&root.join(RIG_JSON), why));
        }
        let known: BTreeMap<&str, usize> =
            self.index.pairs.iter().enumerate().map(|(at, entry)| (entry.name.as_str(), at)).collect();
        let Self { index, files, problems, folders, meshes, .. } = fresh;
        let mut dataset = Self { problems, folders, meshes, cameras: OnceLock::new(), ..self.clone() };
        dataset.problems.extend(dataset.said_read_as());
        if let Some(cameras) = self.cameras.get().filter(|cameras| !cameras.is_empty()) {
            dataset.cameras.set(cameras.clone()).ok();
        }
        for (entry, files) in index.pairs.into_iter().zip(files) {
            match known.get(entry.name.as_str()) {
                Some(&at) => dataset.files[at] = files,
                None => {
                    dataset.files.push(files);
                    dataset.index.pairs.push(entry);
                }
            }
        }
        Ok(dataset)
    }

    /// Files in the folder that look like touches and are none of the pairs: of another kind, or of the same name as
    /// another.
    pub fn left_out(&self) -> Vec<Problem> {
        let Some(root) = &self.root else { return Vec::new() };
        let mut out: Vec<Problem> = self.problems.iter().filter(|p| p.what.starts_with(SAME_NAME)).cloned().collect();
        let (flat, mine) = match &self.source {
            Source::Lab { flat: true } => (true, "GelSlim .pt files"),
            Source::Lab { flat: false } => (false, "the lab's folders"),
            Source::Pictures => (false, "pictures"),
            Source::Depths | Source::BuiltIn(_) => return out,
        };
        let pictures = self.kind == SourceKind::Pictures;
        let folders = !flat && !pictures;
        for (is_mine, what, there) in [
            (folders, "the lab's folders of touches", lab::scan as fn(&Path) -> Option<Scan>),
            (pictures, "pictures of touches", |root| pictures::scan(root).ok().flatten()),
            (flat, "GelSlim .pt files", lab::scan_flat),
        ] {
            if !is_mine && there(root).is_some_and(|scan| scan.root == *root) {
                out.push(other_kind(root, what, mine));
            }
        }
        out
    }

    /// The folders whose content decides which pairs there are.
    pub fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// The GelSlim file of a pair, or the picture that stands for it; `None` where there is none.
    pub fn gelslim_file(&self, id: PairId) -> Option<PathBuf> {
        let first = self.pair_files(id).into_iter().next()?;
        let bubble_only = matches!(&self.files[id.0 as usize], Files::Lab(halves) if halves.gelslim.is_none());
        (!bubble_only).then_some(first)
    }

    /// The cameras for touches without a bubble: of [`RIG_FILE`] in the root, else of the first bubble file.
    fn cameras(&self) -> &PerPad<Arc<DepthCamera>> {
        self.cameras.get_or_init(|| {
            let named = self.root.iter().map(|root| root.join(RIG_FILE)).find(|file| file.is_file());
            let bubble = |files: &Files| if let Files::Lab(halves) = files { halves.bubble.clone() } else { None };
            let first = || self.files.iter().find_map(bubble);
            let cameras = named.or_else(first).map(|file| (cameras_of(&file), file));
            match cameras {
                Some((Ok(cameras), _)) => cameras.map(|camera| camera.map(Arc::new)),
                Some((Err(err), file)) => {
                    log::warn!("no cameras for touches without a bubble: {err} ({})", file.display());
                    PerPad::default()
                }
                None => PerPad::default(),
            }
        })
    }

    pub(super) fn lend_cameras(&self, sample: &mut Sample) {
        for pad in sample.rig.pads() {
            if let Some(touch) = sample.pads.get_mut(pad)
                && touch.depth().is_none()
            {
                touch.lent.clone_from(&self.cameras()[pad]);
            }
        }
    }
}

/// The cameras in a bubble file of the lab's; one without camera data has none.
fn cameras_of(file: &Path) -> Result<PerPad<DepthCamera>, FileError> {
    catch_panic(|| PairFiles::cameras(file)).unwrap_or_else(|message| Err(error::bug(&[file.to_owned()], &message)))
}
