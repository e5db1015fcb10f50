//! Folders that fill while they are open: pairs that appear are added behind the others, so that a [`PairId`] stays what
//! it was; touches without a bubble borrow the cameras of the rig.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::depths;
use super::lab::{self, FileRef, Lab};
use super::{Dataset, LoadError, OpenError, RIG_JSON, SAME_NAME, Scan, Source, SourceKind, pictures, problem};
use crate::io::catch_panic::catch_panic;
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
    /// [`OpenError`]; [`OpenError::NothingFound`] also where the folder now holds another kind of data set only.
    pub fn grown(&self) -> Result<Self, OpenError> {
        let Some(root) = &self.root else { return Ok(self.clone()) };
        drop(std::fs::read_dir(root).map_err(|source| OpenError::Io { path: root.clone(), source })?);
        // Of the same kind: something else that comes into the folder must not hide what is known.
        let scan = match &self.source {
            Source::Lab(lab) if lab.flat => lab::scan_flat_again(root),
            Source::Lab(_) => lab::scan(root),
            Source::Depths(_) => depths::scan(root)?,
            Source::Pictures(pictures) if pictures.folders.iter().all(|folder| folder != root) => {
                pictures::scan_folders(root)?
            }
            Source::Pictures(_) => pictures::scan(root)?,
            Source::BuiltIn(_) => None,
        };
        let fresh = Self::of(scan.ok_or_else(|| OpenError::NothingFound { path: root.clone(), instead: None })?);
        if *fresh.rig != *self.rig {
            let why = format!("{RIG_JSON} declares other sensors than when the folder was opened: open it again");
            return Err(OpenError::Rig { path: root.join(RIG_JSON), why });
        }
        let known: BTreeMap<&str, usize> =
            self.index.pairs.iter().enumerate().map(|(at, entry)| (entry.name.as_str(), at)).collect();
        let mut dataset = Self { problems: fresh.problems.clone(), cameras: OnceLock::new(), ..self.clone() };
        dataset.problems.extend(dataset.said_read_as());
        if let Some(cameras) = self.cameras.get().filter(|cameras| !cameras.is_empty()) {
            dataset.cameras.set(cameras.clone()).ok();
        }
        for (at, entry) in fresh.index.pairs.iter().enumerate() {
            let at = PairId(at as u32);
            match known.get(entry.name.as_str()) {
                Some(&old) => {
                    let old = PairId(old as u32);
                    if self.pair_files(old) != fresh.pair_files(at) {
                        dataset.take(&fresh, at, Some(old));
                    }
                }
                None => {
                    if dataset.take(&fresh, at, None) {
                        dataset.index.pairs.push(entry.clone());
                    }
                }
            }
        }
        match (&mut dataset.source, &fresh.source) {
            (Source::Lab(mine), Source::Lab(other)) => mine.meshes.clone_from(&other.meshes),
            (Source::Pictures(mine), Source::Pictures(other)) => mine.meshes.clone_from(&other.meshes),
            (Source::Depths(mine), Source::Depths(other)) => mine.meshes.clone_from(&other.meshes),
            _ => {}
        }
        Ok(dataset)
    }

    /// Files in the folder that look like touches and are none of the pairs: of another kind, or of the same name as
    /// another.
    pub fn left_out(&self) -> Vec<Problem> {
        let Some(root) = &self.root else { return Vec::new() };
        let mut out: Vec<Problem> = self.problems.iter().filter(|p| p.what.starts_with(SAME_NAME)).cloned().collect();
        let (flat, mine) = match &self.source {
            Source::Lab(lab) if lab.flat => (true, "GelSlim .pt files"),
            Source::Lab(_) => (false, "the lab's folders"),
            Source::Pictures(_) => (false, "pictures"),
            Source::Depths(_) | Source::BuiltIn(_) => return out,
        };
        let (folders, pictures) =
            (matches!(&self.source, Source::Lab(lab) if !lab.flat), self.kind == SourceKind::Pictures);
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

    /// Takes over the files of a pair of `fresh`, for the pair `into` or a further one; not from another kind of source.
    fn take(&mut self, fresh: &Self, id: PairId, into: Option<PairId>) -> bool {
        match (&mut self.source, &fresh.source) {
            (Source::Lab(mine), Source::Lab(other)) => {
                let mut files = other.pairs[id.0 as usize].clone();
                for file in [&mut files.gelslim, &mut files.bubble].into_iter().flatten() {
                    *file =
                        FileRef { folder: mine.folder_number(&other.folders[file.folder as usize]), ..file.clone() };
                }
                put(&mut mine.pairs, files, into);
            }
            (Source::Pictures(mine), Source::Pictures(other)) => {
                put(&mut mine.pairs, other.pairs[id.0 as usize].clone(), into);
            }
            (Source::Depths(mine), Source::Depths(other)) => {
                let row = mine.take(other, id);
                put(&mut mine.pairs, row, into);
            }
            _ => return false,
        }
        true
    }

    /// The folders whose content decides which pairs there are.
    pub fn folders(&self) -> Vec<PathBuf> {
        match &self.source {
            Source::Lab(lab) => lab.folders.clone(),
            Source::Pictures(pictures) => pictures.folders.clone(),
            Source::Depths(depths) => depths.folders.clone(),
            Source::BuiltIn(_) => Vec::new(),
        }
    }

    /// The GelSlim file of a pair, or the picture that stands for it; `None` where there is none.
    pub fn gelslim_file(&self, id: PairId) -> Option<PathBuf> {
        let first = self.pair_files(id).into_iter().next()?;
        match &self.source {
            Source::Lab(lab) => lab.pairs[id.0 as usize].gelslim.is_some().then_some(first),
            Source::Depths(_) | Source::Pictures(_) | Source::BuiltIn(_) => Some(first),
        }
    }

    /// The cameras for touches without a bubble: of [`RIG_FILE`] in the root, else of the first bubble file.
    fn cameras(&self) -> &PerPad<Arc<DepthCamera>> {
        self.cameras.get_or_init(|| {
            let named = self.root.iter().map(|root| root.join(RIG_FILE)).find(|file| file.is_file());
            let first = || match &self.source {
                Source::Lab(lab) => lab.first_bubble(),
                Source::Depths(_) | Source::Pictures(_) | Source::BuiltIn(_) => None,
            };
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
fn cameras_of(file: &Path) -> Result<PerPad<DepthCamera>, LoadError> {
    catch_panic(|| Lab::cameras(file))
        .unwrap_or_else(|message| Err(LoadError::Bug { files: vec![file.to_owned()], message }))
}

fn put<T>(list: &mut Vec<T>, item: T, at: Option<PairId>) {
    match at.and_then(|at| list.get_mut(at.0 as usize)) {
        Some(place) => *place = item,
        None => list.push(item),
    }
}

impl Lab {
    /// The position of a folder in the list; added if it is new.
    fn folder_number(&mut self, folder: &Path) -> u32 {
        let at = self.folders.iter().position(|f| f == folder).unwrap_or_else(|| {
            self.folders.push(folder.to_owned());
            self.folders.len() - 1
        });
        at as u32
    }

    fn first_bubble(&self) -> Option<PathBuf> {
        let file = self.pairs.iter().find_map(|pair| pair.bubble.as_ref())?;
        Some(self.folders[file.folder as usize].join(&file.name))
    }
}
