//! The lab's folders: finding the pairs by name. Reading them is in the submodule `load`.
//!
//! ```text
//! train/{bubbles,gelslims}/data/<tool folder>/data_N.pt
//! test/{train_only,test_only}/{bubbles,gelslims}/<tool>_data_N.pt
//! tools_stls/<tool>.stl
//! ```
//! Source: `scripts/testing.py` lines 552-558, 630 and `vq_vae/training.py` lines 45-53 of the lab's touch2touch
//! repository. There, bubble and GelSlim folders are paired by position; here every pair is matched by name.

mod load;
mod mirrored;

use std::path::{Path, PathBuf};

use crate::io::catch_panic::catch_panic;
use crate::io::error::FileError;
use crate::io::names::is_output;
use crate::io::pt::read_dict;
use touch2touch_core::dataset::{PairEntry, Problem, Split};
use touch2touch_core::rig::{PerPad, Rig};
use touch2touch_core::sample::DepthCamera;

use super::cad::{CAD_FOLDER, cad_files};
use super::{Files, Scan, Source, SourceKind, last_integer, problem, same_name};

const BUBBLES: &str = "bubbles";
const GELSLIMS: [&str; 2] = ["gelslims", "gelslims_no_distortion"];
/// Text before the tool's name in the names of the lab's tool folders.
const TOOL_PREFIXES: [&str; 3] = [
    "bubble_style_transfer_dataset_bubbles_",
    "gelslim_style_transfer_dataset_gelslim_",
    "gelslim_style_transfer_dataset_gelslims_",
];
/// Tool folders lie at most this deep below `bubbles`; also what ends a loop of links.
const MAX_DEPTH: usize = 3;

/// `.pt` files that lie beside touches and are none.
pub(super) const NO_TOUCH: [&str; 4] = ["rig", "tools", "stats", "training_stats"];

/// The two halves of a pair.
#[derive(Clone, Debug)]
pub(super) struct PairFiles {
    pub(super) gelslim: Option<PathBuf>,
    pub(super) bubble: Option<PathBuf>,
}

/// A file of one sensor, with what its path says.
struct Found {
    /// Name of the pair within its group.
    name: String,
    tool: Option<String>,
    number: u64,
    file: PathBuf,
}

/// A folder that holds `bubbles` and `gelslims`.
struct Group {
    folder: PathBuf,
    split: Split,
}

fn group(folder: PathBuf) -> Option<Group> {
    let split = match folder.file_name().and_then(|n| n.to_str()) {
        Some("train") => Split::Train,
        Some("train_only") => Split::TrainOnly,
        Some("test_only" | "test") => Split::Test,
        _ => Split::None,
    };
    let has_sensors = [BUBBLES].iter().chain(&GELSLIMS).any(|name| folder.join(name).is_dir());
    has_sensors.then_some(Group { folder, split })
}

/// The groups in and below `folder`.
fn groups_below(folder: &Path) -> Vec<Group> {
    ["", "train", "test", "test/train_only", "test/test_only", "train_only", "test_only"]
        .iter()
        .filter_map(|sub| group(if sub.is_empty() { folder.to_owned() } else { folder.join(sub) }))
        .collect()
}

/// The data set's root: the same whichever of its folders is opened, so that masks stay with their pairs.
fn root_of(group: &Group) -> PathBuf {
    let parent = |path: &Path| path.parent().unwrap_or(path).to_owned();
    let up = parent(&group.folder);
    match group.split {
        Split::None => group.folder.clone(),
        Split::Train => up,
        Split::TrainOnly | Split::Test if up.file_name().is_some_and(|n| n == "test") => parent(&up),
        Split::TrainOnly | Split::Test => up,
    }
}

/// The groups that `path` stands for, and the tool it names if it is a tool folder.
fn locate(path: &Path) -> Option<(Vec<Group>, Option<String>)> {
    for start in [path.to_owned(), path.join("data")] {
        let groups = groups_below(&start);
        if !groups.is_empty() {
            return Some((groups, None));
        }
    }
    // Inside `bubbles` or `gelslims`: climb to the folder that holds them.
    for (depth, folder) in path.ancestors().take(MAX_DEPTH + 1).enumerate() {
        let name = folder.file_name()?;
        if name == BUBBLES || GELSLIMS.iter().any(|g| name == *g) {
            let group = group(folder.parent()?.to_owned())?;
            let inner = path.file_name()?.to_string_lossy();
            let tool = (depth > 0 && inner != "data").then(|| tool_name(&inner).to_owned());
            return Some((vec![group], tool));
        }
    }
    None
}

pub(super) fn tool_name(folder: &str) -> &str {
    TOOL_PREFIXES.iter().find_map(|prefix| folder.strip_prefix(prefix)).unwrap_or(folder)
}

/// Looks for the lab's folders in, above and below `path`; `None` if there are none.
pub(super) fn scan(path: &Path) -> Option<Scan> {
    let (groups, only_tool) = locate(path)?;
    let root = root_of(groups.first()?);
    let mut scan = Scanner::default();
    let mut pairs: Vec<(PairEntry, PairFiles)> = Vec::new();
    for group in &groups {
        scan.group(group, &mut pairs);
    }
    if let Some(tool) = only_tool {
        pairs.retain(|(entry, _)| entry.tool.as_ref() == Some(&tool));
    }
    Some(scan.finish(root, &groups, pairs))
}

/// Looks for GelSlim `.pt` files directly in `folder`, as a robot may write them; `None` if there are none.
///
/// It is one as soon as one of its files holds a GelSlim image or is still being written: other files may lie there too.
pub(super) fn scan_flat(folder: &Path) -> Option<Scan> {
    /// A folder of this many files of something else is one of something else.
    const MOST_TRIED: usize = 256;
    let scan = scan_flat_again(folder)?;
    // What cannot be read, or makes the reader fail, may be a touch that is still being written.
    let is_touch = |files: &Files| {
        let read = catch_panic(|| read_dict(&files.list()[0]));
        read.map_or(true, |read| read.map_or(true, |dict| dict.has("gelslim")))
    };
    scan.files.iter().take(MOST_TRIED).any(is_touch).then_some(scan)
}

/// [`scan_flat`] of a folder that is known to be one: whatever `.pt` file appears there is a touch, or is said to be none
/// when it is loaded.
pub(super) fn scan_flat_again(folder: &Path) -> Option<Scan> {
    let mut scan = Scanner::default();
    let mut found = Vec::new();
    scan.folder(folder, None, MAX_DEPTH, &mut found);
    found.retain(|f| !NO_TOUCH.contains(&f.name.as_str()));
    if found.is_empty() {
        return None;
    }
    let pairs = scan.each_once(found).into_iter().map(|f| {
        let entry = PairEntry { name: f.name, tool: f.tool, split: Split::None, number: f.number };
        (entry, PairFiles { gelslim: Some(f.file), bubble: None })
    });
    let pairs = pairs.collect();
    Some(scan.finish(folder.to_owned(), &[], pairs))
}

impl Scanner {
    /// Sorts the pairs in the lab's order and adds the CAD models.
    fn finish(mut self, root: PathBuf, groups: &[Group], mut pairs: Vec<(PairEntry, PairFiles)>) -> Scan {
        pairs.sort_by(|(a, _), (b, _)| {
            (a.split as u8, &a.tool, a.number, &a.name).cmp(&(b.split as u8, &b.tool, b.number, &b.name))
        });
        let (pairs, files): (Vec<_>, Vec<_>) =
            pairs.into_iter().map(|(entry, files)| (entry, Files::Lab(files))).unzip();
        let mut folders = vec![root.join(CAD_FOLDER)];
        folders.extend(groups.iter().map(|g| g.folder.join(CAD_FOLDER)));
        folders.extend(root.parent().map(|p| p.join(CAD_FOLDER)));
        let tools = pairs.iter().filter_map(|p| p.tool.as_deref());
        let meshes = cad_files(&root, folders, tools, |_| false, &mut self.problems);
        Scan {
            root,
            pairs,
            problems: self.problems,
            source: Source::Lab { flat: groups.is_empty() },
            files,
            folders: self.folders,
            meshes,
            kind: SourceKind::Lab,
            rig: Rig::lab(),
        }
    }
}

#[derive(Default)]
struct Scanner {
    folders: Vec<PathBuf>,
    problems: Vec<Problem>,
}

impl Scanner {
    fn group(&mut self, group: &Group, pairs: &mut Vec<(PairEntry, PairFiles)>) {
        let bubbles = self.sensor(&group.folder, BUBBLES);
        let gelslims = match self.sensor(&group.folder, GELSLIMS[0]) {
            // Both variants: the plain one counts, the other fills its gaps.
            Some(mut plain) => {
                if let Some(other) = self.sensor(&group.folder, GELSLIMS[1]) {
                    let known = plain.len();
                    for found in other {
                        if plain[..known].binary_search_by(|f| f.name.cmp(&found.name)).is_err() {
                            plain.push(found);
                        }
                    }
                    plain.sort_by(|a, b| a.name.cmp(&b.name));
                }
                Some(plain)
            }
            None => self.sensor(&group.folder, GELSLIMS[1]),
        };
        let (one_sensor, missing) = match (&bubbles, &gelslims) {
            (Some(_), Some(_)) => (false, ""),
            (None, _) => (true, BUBBLES),
            (_, None) => (true, GELSLIMS[0]),
        };
        let (bubbles, gelslims) = (bubbles.unwrap_or_default(), gelslims.unwrap_or_default());
        if one_sensor {
            self.problems.push(problem(
                group.folder.join(missing),
                format!("the folder is missing: {} touches open with one sensor only", bubbles.len() + gelslims.len()),
                "add the folder if the other sensor's images are wanted",
            ));
        }
        let (mut b, mut g) = (bubbles.into_iter().peekable(), gelslims.into_iter().peekable());
        loop {
            let order = match (b.peek(), g.peek()) {
                (Some(x), Some(y)) => x.name.cmp(&y.name),
                (Some(_), None) => std::cmp::Ordering::Less,
                (None, Some(_)) => std::cmp::Ordering::Greater,
                (None, None) => break,
            };
            let (bubble, gelslim) =
                (if order.is_le() { b.next() } else { None }, if order.is_ge() { g.next() } else { None });
            let Some(first) = bubble.as_ref().or(gelslim.as_ref()) else { break };
            if !one_sensor && gelslim.is_none() {
                self.problems.push(problem(
                    &first.file,
                    format!("its other half is missing: no {} in {}", first.name, GELSLIMS[0]),
                    "add the missing file, or remove this one",
                ));
                continue;
            }
            if !one_sensor && bubble.is_none() {
                self.problems.push(problem(
                    &first.file,
                    format!("no {} in {BUBBLES}: it opens without a measured imprint", first.name),
                    "add the bubble file if the truth is wanted",
                ));
            }
            let prefix = match group.split {
                Split::TrainOnly => "train_only/",
                Split::Test => "test_only/",
                Split::Train | Split::None => "",
            };
            let entry = PairEntry {
                name: format!("{prefix}{}", first.name),
                tool: first.tool.clone(),
                split: group.split,
                number: first.number,
            };
            let files = PairFiles { gelslim: gelslim.map(|f| f.file), bubble: bubble.map(|f| f.file) };
            pairs.push((entry, files));
        }
    }

    /// All files of one sensor, sorted by name, each name once. `None` if the folder does not exist.
    fn sensor(&mut self, group: &Path, sensor: &str) -> Option<Vec<Found>> {
        let folder = group.join(sensor);
        if !folder.is_dir() {
            return None;
        }
        let mut found = Vec::new();
        self.folder(&folder, None, 0, &mut found);
        if found.is_empty() {
            self.problems.push(problem(folder, "the folder has no .pt files", "check that the download is complete"));
        }
        Some(self.each_once(found))
    }

    /// Sorted by name; of files with the same name the first.
    fn each_once(&mut self, mut found: Vec<Found>) -> Vec<Found> {
        found.sort_by(|a, b| a.name.cmp(&b.name).then_with(|| a.file.cmp(&b.file)));
        let mut once: Vec<Found> = Vec::with_capacity(found.len());
        for file in found {
            match once.last() {
                Some(first) if first.name == file.name => {
                    self.problems.push(same_name(file.file, &file.name, &first.file));
                }
                _ => once.push(file),
            }
        }
        once
    }

    fn folder(&mut self, folder: &Path, tool: Option<&str>, depth: usize, out: &mut Vec<Found>) {
        let unreadable =
            |err: std::io::Error| problem(folder, format!("cannot list the folder: {err}"), "check its permissions");
        let entries = match std::fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(err) => return self.problems.push(unreadable(err)),
        };
        self.folders.push(folder.to_owned());
        let before = out.len();
        let mut below = Vec::new();
        for entry in entries {
            let entry = match entry {
                Ok(entry) => entry,
                Err(err) => {
                    self.problems.push(unreadable(err));
                    continue;
                }
            };
            let name = entry.file_name();
            let text = name.to_string_lossy();
            if text.starts_with('.') || is_output(&text) {
                continue;
            }
            let mut kind = entry.file_type().ok();
            if kind.is_some_and(|k| k.is_symlink()) {
                kind = std::fs::metadata(entry.path()).ok().map(|m| m.file_type());
            }
            let stem = text
                .len()
                .checked_sub(3)
                .filter(|&n| text.is_char_boundary(n) && text[n..].eq_ignore_ascii_case(".pt"));
            match (kind, stem) {
                (Some(kind), _) if kind.is_dir() => below.push((entry.path(), text.into_owned())),
                (Some(_), Some(end)) => {
                    let stem = tool_name(&text[..end]);
                    let (name_in_group, tool) = match tool {
                        Some(tool) => (format!("{tool}/{stem}"), Some(tool.to_owned())),
                        None => (stem.to_owned(), stem.rfind("_data_").map(|at| stem[..at].to_owned())),
                    };
                    let number_in_name = last_integer(stem);
                    out.push(Found { name: name_in_group, tool, number: number_in_name, file: entry.path() });
                }
                (None, Some(_)) => {
                    self.problems.push(problem(
                        entry.path(),
                        "a link that leads nowhere",
                        "restore the file it points to",
                    ));
                }
                _ => {}
            }
        }
        if tool.is_some() && out.len() == before && below.is_empty() {
            self.problems.push(problem(folder, "the tool folder is empty", "check that the download is complete"));
        }
        if depth >= MAX_DEPTH {
            return;
        }
        below.sort();
        for (path, name) in below {
            // `data` only groups the tool folders; every other folder names a tool.
            let inner = if depth == 0 && name == "data" { None } else { Some(tool_name(&name).to_owned()) };
            self.folder(&path, inner.as_deref(), depth + 1, out);
        }
    }
}

impl PairFiles {
    /// The cameras of a bubble file.
    pub(super) fn cameras(bubble: &Path) -> Result<PerPad<DepthCamera>, FileError> {
        let sample = Self { gelslim: None, bubble: Some(bubble.to_owned()) }.load(&Rig::lab())?.sample;
        Ok(sample.pads.map(|touch| touch?.depth()?.camera.clone()))
    }
}
