//! A folder of pictures (PNG or JPEG; depths as NPY and TIFF too): `NAME_gelslim.png`, optionally with `NAME_bubble.png` and `NAME_vqvae.png`; or
//! the camera's own images, `NAME_touch.png` with `NAME_reference.png` or one `reference.png` for all.
//!
//! A file [`RIG_JSON`] in the folder declares the sensors ([`Rig`]); the names of the first color and the first depth
//! sensor then stand for `gelslim` and `bubble` in file names. Without it they are the lab's.
//!
//! Camera images are used as they are. The others lost their scale: each was stretched to 0..255 on its own. What is
//! assumed instead:
//!
//! * **Imprint**: 0 and 255 stand for [`ASSUMED_IMPRINT_RANGE_M`]. The picture is rotated by 180 degrees (the
//!   lab's convention for display beside a GelSlim image) and is turned back; it is resampled to 175 x 140 px.
//! * **GelSlim**: the picture shows a standardised difference image, so "no difference" is its most frequent
//!   gray, and one gray level is worth [`CLEAN_GAIN`]. Pictures whose most frequent value is the darkest or
//!   brightest one lost half of their range; they get the gain that brings their spread to [`DIFFERENCE_STD`].
//! * **Turns**: both pictures of a pair may have been turned or mirrored for training. The colors tell
//!   ([`touch2touch_core::upright`]), and both are laid upright again.
//! * **Cameras**: pictures of the lab's sensors whose tool is named (the submodule `tools`) get the simulator's nominal
//!   camera, because a pose needs one.

mod lengths;
mod meters;
mod tools;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::io::error::{FileError, FileErrorKind};
use crate::io::images;
use touch2touch_core::dataset::{PairEntry, Problem, Split};
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::markers::lab_finger;
use touch2touch_core::resample;
use touch2touch_core::rig::{PadId, Rig, Sensor, SensorId, SensorKind, lab};
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample, Scale};
use touch2touch_core::turn::Turn;
use touch2touch_core::upright::{self, TurnReading};

use self::meters::Depth;
use super::cad::{CAD_FOLDER, cad_files};
use super::rig_json::{RIG_JSON, rig_of};
use super::{Files, Loaded, Scan, Source, SourceKind, built_in, last_integer, problem, same_name};

/// Depths that the darkest and the brightest value of a bubble picture are taken for, meters.
pub(crate) const ASSUMED_IMPRINT_RANGE_M: [f64; 2] = [-0.0063, 0.0180];

/// Difference (0..255 scale) per gray level of an unclipped picture: red, green, blue.
///
/// Each channel was divided by its standard deviation (0.0989, 0.0746, 0.0731 of 0..1) before all three were
/// stretched together, so the gains have this ratio; their common factor 0.039 makes the spread of pictures of
/// this kind equal to [`DIFFERENCE_STD`] (each channel alone asks for 0.038 to 0.040, so the ratio holds).
const CLEAN_GAIN: [f32; 3] = [0.039 * 0.0989 * 255.0, 0.039 * 0.0746 * 255.0, 0.039 * 0.0731 * 255.0];

/// Standard deviation of the lab's difference images, 0..255 scale (its training set's 0.0687, 0.0428, 0.0576).
const DIFFERENCE_STD: [f32; 3] = [0.0687 * 255.0, 0.0428 * 255.0, 0.0576 * 255.0];

/// Position of the GelSlim's suffix in [`suffixes`].
const GELSLIM: usize = 0;
/// Position of the bubble's suffix in [`suffixes`].
pub(super) const BUBBLE: usize = 1;
/// Position of the prediction's suffix in [`suffixes`].
pub(super) const VQVAE: usize = 2;
/// Position of the camera image's suffix in [`suffixes`].
const TOUCH: usize = 3;
/// Position of the untouched camera image's suffix in [`suffixes`].
const REFERENCE: usize = 4;

const KINDS: usize = 5;
const EXTENSIONS: [&str; 3] = [".png", ".jpg", ".jpeg"];
/// The untouched image of all touches that have none of their own.
const COMMON_REFERENCE: &str = "reference";

type Kinds = [Option<PathBuf>; KINDS];

/// A gray picture (0..255), and what to say of its file.
type NotedTile = (Grid<f32>, Option<Problem>);

/// The pictures of a pair.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Touch {
    files: Kinds,
    /// The finger, where it is named.
    finger: Option<PadId>,
    /// True where its tool is named, so that a camera is worth assuming.
    of_tool: bool,
}

/// Ends of the pictures' names, in lower case, in the order of their kinds.
fn suffixes(rig: &Rig) -> [String; KINDS] {
    let of = |sensor: Option<&Sensor>, without: &Sensor| format!("_{}", sensor.unwrap_or(without).key.to_lowercase());
    let (color, depth) = (of(rig.color(), &lab::GELSLIM), of(rig.depth(), &lab::BUBBLE));
    [color, depth, "_vqvae".into(), "_touch".into(), "_reference".into()]
}

/// Looks for pictures directly in `folder`; `None` if there is no GelSlim or bubble picture.
pub(super) fn scan(folder: &Path) -> Result<Option<Scan>, FileError> {
    let rig = rig_of(folder)?;
    let mut found = Found::default();
    found.look(folder, None, &rig);
    Ok(found.end(folder, rig))
}

/// Looks for pictures in the folders in `folder`, each named like the tool of its pictures; `None` if there is none.
pub(super) fn scan_folders(folder: &Path) -> Result<Option<Scan>, FileError> {
    let rig = rig_of(folder)?;
    let mut found = Found::default();
    for (tool, path) in tools::folders(folder) {
        found.look(&path, Some(&tool), &rig);
    }
    Ok(found.end(folder, rig))
}

/// Touches found in one folder after the other.
#[derive(Default)]
struct Found {
    pairs: Vec<(PairEntry, Kinds)>,
    problems: Vec<Problem>,
    /// The folders that hold touches.
    folders: Vec<PathBuf>,
}

impl Found {
    /// Takes the pictures directly in `folder`, felt by the sensors of `rig`, of this tool.
    fn look(&mut self, folder: &Path, tool: Option<&str>, rig: &Rig) {
        let suffixes = suffixes(rig);
        let mut found: BTreeMap<String, Kinds> = BTreeMap::new();
        let mut problems = Vec::new();
        let mut common = None;
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        for entry in entries {
            let path = match entry {
                Ok(entry) => entry.path(),
                Err(err) => {
                    problems.push(problem(folder, format!("cannot list the folder: {err}"), "check its permissions"));
                    continue;
                }
            };
            let Some(name) = path.file_name().map(|n| n.to_string_lossy().into_owned()) else { continue };
            let lower = name.to_ascii_lowercase();
            if lower == RIG_JSON && name != RIG_JSON && !folder.join(RIG_JSON).exists() {
                let what = format!(
                    "the sensors are declared in {RIG_JSON} alone: this name has other letters and is not read"
                );
                problems.push(problem(&path, what, "rename it to rig.json"));
            }
            let depth = meters::EXTENSIONS.iter().find_map(|ext| lower.strip_suffix(ext));
            let depth = depth.filter(|stem| stem.ends_with(suffixes[BUBBLE].as_str()));
            let picture = EXTENSIONS.iter().find_map(|ext| lower.strip_suffix(ext));
            let Some(stem) = picture.or(depth) else { continue };
            if name.starts_with('.') {
                continue;
            }
            if stem == COMMON_REFERENCE {
                common = Some(path);
                continue;
            }
            let Some(kind) = suffixes.iter().position(|suffix| stem.ends_with(suffix.as_str())) else { continue };
            // Suffix and extension are ASCII, so the cut is at a character.
            let pair = name[..stem.len() - suffixes[kind].len()].to_owned();
            let slot = &mut found.entry(pair).or_default()[kind];
            match slot {
                Some(first) => problems.push(same_name(path, stem, first)),
                None => *slot = Some(path),
            }
        }
        if found.values().all(|files| [GELSLIM, BUBBLE, TOUCH].iter().all(|kind| files[*kind].is_none())) {
            return;
        }
        self.folders.push(folder.to_owned());
        for (name, mut files) in found {
            let touched = files[TOUCH].is_some();
            if touched && files[REFERENCE].is_none() {
                files[REFERENCE].clone_from(&common);
            }
            let lone = |kind: usize| files[kind].clone().unwrap_or_default();
            if files[GELSLIM].is_some() || (touched && files[REFERENCE].is_some()) {
                let number = last_integer(&name);
                let name = tool.map_or_else(|| name.clone(), |tool| format!("{tool}/{name}"));
                self.pairs.push((PairEntry { name, tool: tool.map(str::to_owned), split: Split::None, number }, files));
            } else if touched {
                let what =
                    format!("the untouched image is missing: {name}_reference.png, or one reference.png for all");
                problems.push(problem(lone(TOUCH), what, "add the image of the gel without contact"));
            } else if files[REFERENCE].is_none() || files[BUBBLE].is_some() || files[VQVAE].is_some() {
                let file = if files[BUBBLE].is_some() { lone(BUBBLE) } else { lone(VQVAE) };
                problems.push(problem(
                    file,
                    format!("its other half {name}{}.png is missing", suffixes[GELSLIM]),
                    "add the missing picture, or remove this one",
                ));
            }
        }
        self.problems.append(&mut problems);
    }

    /// The data set of the pictures, if there are any.
    fn end(mut self, folder: &Path, rig: Arc<Rig>) -> Option<Scan> {
        if self.folders.is_empty() {
            return None;
        }
        self.pairs.sort_by(|(a, _), (b, _)| (&a.tool, a.number, &a.name).cmp(&(&b.tool, b.number, &b.name)));
        let (mut pairs, files): (Vec<PairEntry>, Vec<Kinds>) = self.pairs.into_iter().unzip();
        let fingers = tools::name(folder, &mut pairs, &rig, &mut self.problems);
        let touches = files.into_iter().zip(fingers).zip(&pairs);
        let touches = touches.map(|((files, finger), pair)| Touch { files, finger, of_tool: pair.tool.is_some() });
        let touches: Vec<Touch> = touches.collect();
        let tools = pairs.iter().filter_map(|pair| pair.tool.as_deref());
        let known = |tool: &str| built_in::mesh(tool).is_some();
        let meshes = cad_files(folder, vec![folder.join(CAD_FOLDER)], tools, known, &mut self.problems);
        Some(Scan {
            root: folder.to_owned(),
            pairs,
            problems: self.problems,
            files: touches.into_iter().map(Files::Pictures).collect(),
            folders: self.folders,
            meshes,
            source: Source::Pictures,
            kind: SourceKind::Pictures,
            rig,
        })
    }
}

impl Touch {
    fn file(&self, kind: usize) -> Option<&Path> {
        self.files[kind].as_deref()
    }

    pub(super) fn list(&self) -> Vec<PathBuf> {
        [GELSLIM, TOUCH, REFERENCE, BUBBLE].iter().filter_map(|&kind| self.files[kind].clone()).collect()
    }

    /// A gray picture that lay this way in its file, upright.
    pub(super) fn tile(&self, rig: &Rig, kind: usize, laid: Turn) -> Result<Option<Grid<f32>>, FileError> {
        Ok(self.tile_and_note(rig, kind, laid)?.map(|(tile, _)| tile))
    }

    /// The picture of [`Self::tile`], and what to say of its file.
    fn tile_and_note(&self, rig: &Rig, kind: usize, laid: Turn) -> Result<Option<NotedTile>, FileError> {
        let Some(path) = self.file(kind) else { return Ok(None) };
        let sensor = rig.depth().unwrap_or(&lab::BUBBLE);
        let (tile, note) = match meters::read(path, sensor)? {
            Depth::Levels(found) => found,
            Depth::Meters(imprint) => (tile_from_imprint(&imprint, sensor), None),
        };
        // Pairs are turned as squares; in another shape a quarter turn would not fit back.
        let upright = tile.width() == tile.height() || laid.quarters.is_multiple_of(2);
        Ok(Some((if upright { laid.undo(&tile) } else { tile }, note)))
    }

    /// The upright difference image, and how it lay where the colors tell.
    fn difference(&self, rig: &Rig) -> Result<Option<(RgbGrid, Option<TurnReading>)>, FileError> {
        let Some(path) = self.file(GELSLIM) else { return Ok(None) };
        let difference = difference_from_tile(&images::read_rgb(path)?);
        // The light of a GelSlim tells how its picture lay; nothing is known of other sensors' light.
        let tells = rig.color().is_some_and(|sensor| sensor.key == lab::GELSLIM.key);
        let reading = tells.then(|| upright::best(&difference)).flatten();
        let upright = reading.map_or_else(|| difference.clone(), |found| found.turn.undo(&difference));
        Ok(Some((upright, reading)))
    }

    /// True where a channel of the GelSlim picture was cut off at black or white: half of its range is lost.
    pub(super) fn is_clipped(&self) -> Result<Option<bool>, FileError> {
        let Some(path) = self.file(GELSLIM) else { return Ok(None) };
        let tile = images::read_rgb(path)?;
        Ok(Some((0..3).any(|channel| matches!(mode(&tile, channel), 0 | 255))))
    }

    /// The pair as the first pad's touch, whichever it was ([`Sample::taken_by`]).
    pub(super) fn load(&self, rig: &Arc<Rig>) -> Result<Loaded, FileError> {
        let mut notes = Vec::new();
        let mut touch = PadTouch::default();
        let mut scale = Scale::Assumed;
        let mut reading = None;
        // A picture of a kind that the rig does not have is kept behind its sensors.
        let place = |kind| rig.first(kind).unwrap_or(SensorId(rig.sensors.len() as u8));
        let (color_id, depth_id) = (place(SensorKind::Color), place(SensorKind::Depth));
        if let (Some(touched), Some(reference)) = (self.file(TOUCH), self.file(REFERENCE)) {
            let (raw, untouched) = (images::read_rgb(touched)?, images::read_rgb(reference)?);
            let sizes = [raw.size(), untouched.size()];
            let color = ColorTouch::from_images(raw, untouched).ok_or_else(|| {
                let what = format!("the touched image has {:?} pixels, the untouched one {:?}", sizes[0], sizes[1]);
                FileError::new(touched, what, "take both images with the same camera settings")
                    .of_kind(FileErrorKind::Content)
            })?;
            touch.set(color_id, color);
            // The model's meters are its own; only a bubble picture has none.
            scale = Scale::Measured;
        } else if let Some((difference, read)) = self.difference(rig)? {
            reading = read;
            let path = self.file(GELSLIM).unwrap_or(Path::new(""));
            notes.extend(read.filter(|read| read.is_guess()).map(|read| unsure(path, read)));
            if difference.as_slice().iter().all(|p| *p == [0.0; 3]) {
                notes.push(problem(path, "the picture is a single color", "check that the right picture was saved"));
            }
            touch.set(color_id, ColorTouch { images: None, difference });
        }
        let laid = reading.map_or_else(Turn::default, |read| read.turn);
        for file in self.list() {
            let behind = images::bytes_behind(&file);
            if behind > 0 {
                let what = format!("{behind} bytes stand behind the end of the JPEG");
                notes.push(problem(file, what, "they are left out; write only the bytes that the encoder returned"));
            }
        }
        let dots = || lab_finger(&touch.color()?.difference).filter(|_| reading.is_some());
        let taken_by = self.finger.or_else(dots);
        let sensor = rig.depth().unwrap_or(&lab::BUBBLE);
        let of_tool = || self.of_tool.then(|| tools::camera(rig, taken_by.unwrap_or(lab::RIGHT))).flatten();
        if let Some(path) = self.file(BUBBLE).filter(|path| meters::has_any(path))
            && let Depth::Meters(imprint) = meters::read(path, sensor)?
        {
            touch.set(depth_id, DepthTouch { imprint, camera: of_tool(), truth: None });
        } else if let Some((tile, note)) = self.tile_and_note(rig, BUBBLE, laid)? {
            notes.extend(note);
            let [w, h] = tile.size();
            let path = self.file(BUBBLE).unwrap_or(Path::new(""));
            if w < 16 || h < 16 {
                notes.push(problem(
                    path,
                    format!("the picture has only {w} x {h} pixels"),
                    "save it at 128 x 128 or more",
                ));
            }
            if tile.as_slice().windows(2).all(|v| v[0] == v[1]) {
                notes.push(problem(path, "the picture is a single gray", "check that the right picture was saved"));
            }
            let imprint = imprint_from_tile(&tile, rig);
            touch.set(depth_id, DepthTouch { imprint, camera: of_tool(), truth: None });
            scale = Scale::Assumed;
        }
        let pads = rig.pads().map(|pad| (pad.index() == 0).then(|| touch.clone())).collect();
        let rig = rig.clone();
        let sample = Sample { rig, pads, scale, laid, reading, taken_by, notes, ..Sample::default() };
        Ok(Loaded { sample, invalid: Default::default() })
    }
}

/// That the colors say how a picture lies, but not clearly.
fn unsure(path: &Path, read: TurnReading) -> Problem {
    let what = format!(
        "its colors hardly tell how it lies: taken as {}, {:.0} % free of curl, {:.0} % more than the next way",
        read.turn,
        100.0 * read.consistency,
        100.0 * read.margin
    );
    problem(path, what, "look at it: where it lies wrong, save both pictures of the pair upright")
}

/// A bubble picture (0..255) on its own pixels, in the assumed meters.
pub(crate) fn assumed_meters(tile: &Grid<f32>) -> DepthMap {
    let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
    tile.map(|&v| (lo + (hi - lo) * f64::from(v) / 255.0) as f32)
}

/// Assumed meters, turned back to how the depth sensor's picture lies, at its size.
pub(crate) fn imprint_from_tile(tile: &Grid<f32>, rig: &Rig) -> DepthMap {
    let sensor = rig.depth().unwrap_or(&lab::BUBBLE);
    let turned = if sensor.rotation_deg == 180 { tile.rotated_180() } else { tile.clone() };
    // The lab made these pictures with torchvision's resize, so they are undone with the same one.
    resample::bilinear(&assumed_meters(&turned), sensor.width, sensor.height)
}

/// The gray levels (0..255) that stand for an imprint, as a picture beside the first sensor's lies.
fn tile_from_imprint(imprint: &DepthMap, sensor: &Sensor) -> Grid<f32> {
    let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
    let tile = imprint.map(|meters| (255.0 * (f64::from(*meters) - lo) / (hi - lo)) as f32);
    if sensor.rotation_deg == 180 { tile.rotated_180() } else { tile }
}

/// The most frequent level of a channel.
fn mode(tile: &RgbGrid, channel: usize) -> usize {
    let mut counts = [0u32; 256];
    for pixel in tile.as_slice() {
        counts[pixel[channel].round().clamp(0.0, 255.0) as usize] += 1;
    }
    counts.iter().enumerate().max_by_key(|&(level, &n)| (n, std::cmp::Reverse(level))).map_or(0, |m| m.0)
}

fn difference_from_tile(tile: &RgbGrid) -> RgbGrid {
    let mut zero = [0f32; 3];
    let mut gain = CLEAN_GAIN;
    for channel in 0..3 {
        let mode = mode(tile, channel);
        zero[channel] = mode as f32;
        if mode == 0 || mode == 255 {
            let spread = standard_deviation(tile.as_slice().iter().map(|p| f64::from(p[channel]))) as f32;
            gain[channel] = if spread > 1.0 { DIFFERENCE_STD[channel] / spread } else { 0.0 };
        }
    }
    tile.map(|pixel| std::array::from_fn(|c| (pixel[c] - zero[c]) * gain[c]))
}

fn standard_deviation(values: impl Iterator<Item = f64>) -> f64 {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for v in values {
        n += 1.0;
        sum += v;
        squares += v * v;
    }
    if n == 0.0 { 0.0 } else { (squares / n - (sum / n) * (sum / n)).max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gray_is_no_difference() {
        let mut tile = Grid::filled(20, 20, [120.0; 3]);
        tile[(3, 4)] = [220.0, 120.0, 20.0];
        let difference = difference_from_tile(&tile);
        assert_eq!(difference[(0, 0)], [0.0; 3]);
        assert!((difference[(3, 4)][0] - 98.4).abs() < 0.1 && (difference[(3, 4)][2] + 72.7).abs() < 0.1);
        assert_eq!(difference_from_tile(&Grid::filled(4, 4, [0.0; 3]))[(1, 1)], [0.0; 3]);
    }
}
