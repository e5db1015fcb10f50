//! [`Store`]: predictions on the disk, found again by their recipe, within a budget of bytes.
//!
//! One file per prediction, named after the digest of its input and the id of its recipe, so that everything made of one touch
//! is found by name. A file is a line of JSON (recipe, sizes, checksum) and the decoder's values behind it. Whatever is
//! not exactly that is removed and treated as not there: a cache is never a reason for an error. The time of a file's
//! last change is the time it was last used; the least recently used go first.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};

use super::kept_key::KeptKey;
use crate::io::digest::sha256;
use crate::io::{files, folders};
use touch2touch_core::grid::Grid;
use touch2touch_core::postprocess::RawPrediction;

/// The format and its version, in every file.
const FORMAT: &str = "touch2touch-prediction-2";
/// End of the files' names: nothing else in the folder is ever touched.
const SUFFIX: &str = ".prediction";
/// No file with a longer first line, or more values, is one of ours.
const MAX_HEADER: usize = 1 << 16;
const MAX_VALUES: usize = 1 << 26;
/// Hex digits of a digest in a file's name.
const DIGITS: usize = 24;
/// A temporary file that is older was left behind by a program that was killed.
const STRAY: Duration = Duration::from_hours(1);

/// The budget where nobody chose one.
pub const DEFAULT_BUDGET: u64 = 512 << 20;

/// A folder of predictions.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    budget: u64,
    /// Bytes in the folder, as far as known: counted at the first write.
    bytes: Mutex<Option<u64>>,
}

/// Prediction as it was stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// Recipe that it was made from.
    pub recipe: KeptKey,
    /// The decoder's picture.
    pub raw: RawPrediction,
    /// Time that it took to make, seconds.
    pub seconds: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header<K> {
    format: String,
    recipe: K,
    width: usize,
    height: usize,
    channels: usize,
    /// Of the values behind the header.
    sha256: String,
    seconds: f64,
}

/// The folder of this user's predictions, in [`folders::program_cache`].
pub fn user_folder() -> Option<PathBuf> {
    folders::program_cache().map(|folder| folder.join("predictions"))
}

impl Store {
    /// A store in `folder` (made when something is first written) of at most `budget` bytes; 0 keeps nothing.
    pub fn new(folder: PathBuf, budget: u64) -> Self {
        Self { folder, budget, bytes: Mutex::new(None) }
    }

    /// Folder of the store.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Bytes it may hold.
    pub fn budget(&self) -> u64 {
        self.budget
    }

    /// Changes the budget; what is too much goes at the next write.
    pub(crate) fn set_budget(&mut self, budget: u64) {
        self.budget = budget;
    }

    /// The prediction of a recipe, now the most recently used.
    pub fn get(&self, recipe: &KeptKey) -> Option<Stored> {
        let is_it = |stored: &Stored| stored.recipe.input == recipe.input && stored.recipe.id() == recipe.id();
        self.read(&self.file(recipe)).filter(is_it)
    }

    /// Every prediction of the image with the digest `input`, the most recently used first, at most `limit`.
    pub fn of_input(&self, input: &str, limit: usize) -> Vec<Stored> {
        let prefix = format!("{}-", short(input));
        let mut files: Vec<Found> = self.files().into_iter().filter(|f| f.name.starts_with(&prefix)).collect();
        files.sort_by(|a, b| b.used.cmp(&a.used).then(a.name.cmp(&b.name)));
        let all = files.iter().filter_map(|found| self.read(&self.folder.join(&found.name)));
        all.filter(|stored| stored.recipe.input == input).take(limit).collect()
    }

    /// Keeps a prediction, and drops the least recently used ones beyond the budget.
    ///
    /// # Errors
    /// Whatever the disk says. What was there stays as it was.
    pub fn put(&self, recipe: &KeptKey, raw: &RawPrediction, seconds: f64) -> io::Result<()> {
        let Some(first) = raw.channels.first().filter(|_| self.budget > 0) else { return Ok(()) };
        let values: Vec<u8> =
            raw.channels.iter().flat_map(|plane| plane.as_slice()).flat_map(|v| v.to_le_bytes()).collect();
        let header = Header {
            format: FORMAT.into(),
            recipe: recipe.clone(),
            width: first.width(),
            height: first.height(),
            channels: raw.channels.len(),
            sha256: sha256(&values),
            seconds,
        };
        let mut line = serde_json::to_vec(&header)?;
        line.push(b'\n');
        let size = (line.len() + values.len()) as u64;
        if size > self.budget || line.len() > MAX_HEADER {
            return Ok(());
        }
        fs::create_dir_all(&self.folder)?;
        let file = self.file(recipe);
        let before = fs::metadata(&file).map_or(0, |m| m.len());
        // Renamed into place, but not forced to the disk: after a power cut the checksum tells half a file, and no
        // result has to wait for a disk.
        let mut out = tempfile::Builder::new().prefix(".tmp-").suffix(".part").tempfile_in(&self.folder)?;
        out.write_all(&line)?;
        out.write_all(&values)?;
        out.persist(&file).map_err(|err| err.error)?;
        let mut bytes = self.bytes.lock().unwrap_or_else(PoisonError::into_inner);
        let total = match *bytes {
            Some(known) => (known + size).saturating_sub(before),
            None => self.files().iter().map(|f| f.bytes).sum(),
        };
        *bytes = Some(if total > self.budget { self.evict(&file) } else { total });
        Ok(())
    }

    fn file(&self, recipe: &KeptKey) -> PathBuf {
        self.folder.join(format!("{}-{}{SUFFIX}", short(&recipe.input), recipe.id()))
    }

    /// Reads a file and marks it as used; one that is not whole is removed.
    fn read(&self, file: &Path) -> Option<Stored> {
        let content = files::read(file, (MAX_HEADER + 4 * MAX_VALUES) as u64).ok()?;
        match parse(&content) {
            Some(stored) => {
                // Needs a handle that may write; a folder that may only be read is used as it is.
                let touched = File::options().append(true).open(file).and_then(|f| f.set_modified(SystemTime::now()));
                if let Err(err) = touched {
                    log::debug!("cannot mark {} as used: {err}", file.display());
                }
                Some(stored)
            }
            None => {
                log::warn!("a damaged prediction was removed: {}", file.display());
                if let Err(err) = fs::remove_file(file) {
                    log::warn!("it could not be removed: {err}");
                }
                None
            }
        }
    }

    fn files(&self) -> Vec<Found> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let mut files = Vec::new();
        for entry in entries.flatten() {
            let Ok(name) = entry.file_name().into_string() else { continue };
            let Some(meta) = entry.metadata().ok().filter(fs::Metadata::is_file) else { continue };
            let used = meta.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if name.ends_with(SUFFIX) {
                files.push(Found { name, bytes: meta.len(), used });
            } else if name.ends_with(".part") && used.elapsed().is_ok_and(|age| age > STRAY) {
                fs::remove_file(entry.path()).ok();
            }
        }
        files
    }

    /// Removes the least recently used files, `keep` last, until nine tenths of the budget are left; answers the bytes
    /// that stay.
    fn evict(&self, keep: &Path) -> u64 {
        let mut files = self.files();
        files.sort_by_key(|f| (self.folder.join(&f.name) == keep, f.used));
        let mut total: u64 = files.iter().map(|f| f.bytes).sum();
        for found in &files {
            // A little room, so that not every write has to look through the folder.
            if total <= self.budget / 10 * 9 || self.folder.join(&found.name) == keep {
                break;
            }
            match fs::remove_file(self.folder.join(&found.name)) {
                Ok(()) => total -= found.bytes,
                Err(err) => log::warn!("cannot remove {}: {err}", found.name),
            }
        }
        total
    }
}

struct Found {
    name: String,
    bytes: u64,
    used: SystemTime,
}

fn short(digest: &str) -> &str {
    digest.get(..DIGITS).unwrap_or(digest)
}

/// A whole file, or `None`.
fn parse(content: &[u8]) -> Option<Stored> {
    let end = content.iter().take(MAX_HEADER).position(|&b| b == b'\n')?;
    let header: Header<KeptKey> = serde_json::from_slice(&content[..end]).ok()?;
    if header.format != FORMAT {
        return None;
    }
    let values = &content[end + 1..];
    let plane = header.width.checked_mul(header.height).filter(|&n| n > 0)?;
    let count = plane.checked_mul(header.channels).filter(|n| (1..=MAX_VALUES).contains(n))?;
    if values.len() != 4 * count || sha256(values) != header.sha256 {
        return None;
    }
    let values: Vec<f32> = values.chunks_exact(4).map(|v| f32::from_le_bytes([v[0], v[1], v[2], v[3]])).collect();
    let channels = values.chunks_exact(plane).map(|v| Grid::from_vec(header.width, header.height, v.to_vec()).ok());
    let raw = RawPrediction { channels: channels.collect::<Option<_>>()? };
    Some(Stored { recipe: header.recipe, raw, seconds: header.seconds })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::engine::EngineKind;
    use touch2touch_core::diffusion::GenerateConfig;

    fn recipe(input: &str, seed: u64) -> KeptKey {
        let config = GenerateConfig { seed, ..Default::default() };
        KeptKey { input: input.into(), bundle: "bundle".into(), engine: EngineKind::Rten, config }
    }

    fn raw(value: f32) -> RawPrediction {
        let plane = |c: usize| Grid::from_fn(16, 8, |x, y| value + (x * y + c) as f32 * 0.125);
        RawPrediction { channels: (0..3).map(plane).collect() }
    }

    fn store(budget: u64) -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path().join("predictions"), budget);
        (folder, store)
    }

    /// Makes a file look as if it had been used so many seconds ago.
    fn age(store: &Store, recipe: &KeptKey, seconds: u64) {
        let file = File::options().append(true).open(store.file(recipe)).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
    }

    /// Predictions that are kept, and their bytes.
    fn kept(store: &Store) -> (usize, u64) {
        let files = store.files();
        (files.len(), files.iter().map(|found| found.bytes).sum())
    }

    #[test]
    fn what_was_kept_is_found_again_bit_for_bit_and_only_under_its_recipe() {
        let (_folder, store) = store(1 << 20);
        assert_eq!((store.get(&recipe("a", 1)), kept(&store)), (None, (0, 0)));
        store.put(&recipe("a", 1), &raw(0.1), 0.5).unwrap();
        let again = Store::new(store.folder().to_owned(), 1 << 20);
        let found = again.get(&recipe("a", 1)).unwrap();
        assert_eq!((found.raw, found.seconds, found.recipe), (raw(0.1), 0.5, recipe("a", 1)));
        for other in [recipe("b", 1), recipe("a", 2)] {
            assert_eq!(again.get(&other), None);
        }
        // The same names with another content: what is inside decides.
        fs::rename(again.file(&recipe("a", 1)), again.file(&recipe("b", 1))).unwrap();
        assert_eq!(again.get(&recipe("b", 1)), None);
    }

    #[test]
    fn everything_of_one_touch_is_listed_the_last_used_first() {
        let (_folder, store) = store(1 << 20);
        for seed in 0..4 {
            store.put(&recipe("a", seed), &raw(seed as f32), 0.0).unwrap();
            age(&store, &recipe("a", seed), 100 - seed);
        }
        store.put(&recipe("b", 9), &raw(9.0), 0.0).unwrap();
        let seeds =
            |store: &Store| -> Vec<u64> { store.of_input("a", 3).iter().map(|s| s.recipe.config.seed).collect() };
        assert_eq!(seeds(&store), [3, 2, 1]);
        assert!(store.of_input("c", 9).is_empty());
    }

    #[test]
    fn the_least_recently_used_go_when_the_budget_is_full() {
        let (_folder, small) = store(1 << 20);
        small.put(&recipe("a", 0), &raw(0.0), 0.0).unwrap();
        let (_, one) = kept(&small);
        let (_folder, store) = store(one * 5 / 2);
        store.put(&recipe("a", 1), &raw(1.0), 0.0).unwrap();
        store.put(&recipe("a", 2), &raw(2.0), 0.0).unwrap();
        age(&store, &recipe("a", 1), 50);
        age(&store, &recipe("a", 2), 90);
        // Reading the older one makes it the newer one.
        assert!(store.get(&recipe("a", 2)).is_some());
        store.put(&recipe("a", 3), &raw(3.0), 0.0).unwrap();
        assert!(kept(&store).1 <= one * 5 / 2);
        assert!(store.get(&recipe("a", 1)).is_none() && store.get(&recipe("a", 3)).is_some());
        assert!(store.get(&recipe("a", 2)).is_some());
        // One that does not fit at all, and a budget of nothing, keep what is there.
        let nothing = Store::new(store.folder().to_owned(), 0);
        nothing.put(&recipe("a", 4), &raw(4.0), 0.0).unwrap();
        Store::new(store.folder().to_owned(), 100).put(&recipe("a", 5), &raw(5.0), 0.0).unwrap();
        assert_eq!(kept(&store).0, 2);
    }

    #[test]
    fn a_damaged_file_is_not_there_and_is_removed() {
        let (_folder, store) = store(1 << 20);
        let key = recipe("a", 1);
        store.put(&key, &raw(0.5), 0.0).unwrap();
        let whole = fs::read(store.file(&key)).unwrap();
        let mut flipped = whole.clone();
        *flipped.last_mut().unwrap() ^= 1;
        let line = whole.iter().position(|&b| b == b'\n').unwrap();
        let head = String::from_utf8(whole[..line].to_vec()).unwrap();
        let with = |from: &str, to: &str| [head.replace(from, to).as_bytes(), &whole[line..]].concat();
        for damaged in [
            Vec::new(),
            vec![0; 300_000],
            whole[..whole.len() - 4].to_vec(),
            [whole.clone(), vec![0; 4]].concat(),
            flipped,
            with("\"width\":16", "\"width\":18446744073709551615"),
            with("\"width\":16", "\"width\":0"),
            with(FORMAT, "touch2touch-prediction-9"),
        ] {
            fs::write(store.file(&key), &damaged).unwrap();
            assert_eq!(store.get(&key), None, "{} bytes", damaged.len());
            assert!(!store.file(&key).exists());
        }
        fs::write(store.file(&key), &whole).unwrap();
        assert!(store.get(&key).is_some());
        // Files of others are left alone; what a killed program left is not.
        fs::write(store.folder().join("notes.txt"), "mine").unwrap();
        let part = store.folder().join(".tmp-x.part");
        fs::write(&part, "half").unwrap();
        File::options().append(true).open(&part).unwrap().set_modified(SystemTime::UNIX_EPOCH).unwrap();
        assert_eq!(kept(&store).0, 1);
        assert!(store.folder().join("notes.txt").exists() && !part.exists());
    }
}
