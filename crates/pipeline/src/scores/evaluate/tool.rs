//! Scoring the grasps of one tool: image figures wait until all its predictions are there, because the lab's SSIM takes
//! its range from them.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::load::LoadedPair;
use super::methods::{Made, Method, Models};
use super::{Setup, Skipped, ToolWork};
use crate::compare::as_tile;
use crate::error::TaskError;
use crate::infer::classifier::ToolClassifier;
use crate::io::catch_panic::catch_panic;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::estimate::{Estimate, Touch};
use crate::steps::models;
use crate::steps::recipe::Stage;
use crate::steps::tool::load_tool;
use touch2touch_core::catalog::pattern_of;
use touch2touch_core::contact::{ContactMask, MaskBasis};
use touch2touch_core::dataset::Problem;
use touch2touch_core::evaluation::{GraspScore, ImageScore, PEAK_M, Scores, squared_error};
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::label::iou;
use touch2touch_core::metrics::{LEVELS, SsimRange, planes, ssim, unit_range};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::{Sample, Scale};
use touch2touch_core::verdict::Grade;

/// A prediction that waits for its image figures.
struct Image {
    finger: usize,
    prediction: Grid<f32>,
    /// `None` for the measured imprint itself, which is not compared with itself.
    truth: Option<Grid<f32>>,
    noise_free: Option<Grid<f32>>,
    mask_iou: Option<f64>,
    /// Features by the tool classifier.
    features: Vec<f32>,
}

/// A grasp that waits for its image figures.
struct Pending {
    entry: Entry,
    images: Vec<Image>,
}

/// The figures of a grasp by a method, with what else is said of it.
pub(super) struct Entry {
    /// As in the table.
    pub(super) score: GraspScore,
    /// Oddities of the files.
    pub(super) notes: Vec<Problem>,
    /// Why masks are not of the source that was asked, with how many.
    pub(super) otherwise: BTreeMap<&'static str, usize>,
}

/// Why masks of a touch are not of the source that was asked, and how many.
fn otherwise(estimate: &Estimate) -> BTreeMap<&'static str, usize> {
    let mut otherwise = BTreeMap::new();
    let masked = estimate.has(Stage::Mask).then(|| estimate.contact());
    for ContactMask { basis, .. } in masked.iter().flat_map(|contact| contact.masks.iter().flatten()) {
        let why = match basis {
            MaskBasis::Source => continue,
            MaskBasis::Hand => "were drawn by hand",
            MaskBasis::Flat => "are empty: the imprints are flat",
            MaskBasis::Depth(_) => "are by depth: the mask model found no contact in imprints that have some",
        };
        *otherwise.entry(why).or_insert(0) += 1;
    }
    otherwise
}

/// Has the tool classifier describe each image, if there is one.
fn describe(classifier: Option<&mut ToolClassifier>, images: &mut [Image]) -> Result<(), String> {
    let Some(classifier) = classifier else { return Ok(()) };
    let pictures: Vec<&DepthMap> = images.iter().map(|i| &i.prediction).collect();
    let found = guarded(|| classifier.classify(&pictures).map_err(|err| err.to_string()))
        .map_err(|why| format!("tool classifier: {why}"))?;
    images.iter_mut().zip(found).for_each(|(image, verdict)| image.features = verdict.features);
    Ok(())
}

/// True where the pose of a grasp can be compared with another: the true one, or that of the measured imprints.
fn can_be_posed(sample: &Sample) -> bool {
    let cameras = || sample.pads.iter().flatten().any(|touch| touch.camera().is_some());
    sample.grasp_from_object.is_some() || (sample.scale == Scale::Assumed && cameras())
}

/// A grasp with what a method made of it.
struct Masked<'a> {
    case: &'a LoadedPair,
    made: Made,
    /// Up to its masks, where they can be made.
    estimate: Option<Estimate>,
    /// Why some masks are not of the source that was asked.
    otherwise: BTreeMap<&'static str, usize>,
    /// Intersection over union of each mask with the simulator's true contact.
    iou: PerPad<f64>,
}

/// The grasps of one tool, by method.
pub(super) struct Tool<'a> {
    dataset: &'a Dataset,
    /// Name of the tool's pattern.
    pattern: Option<String>,
    model: Option<ToolModel>,
    pending: BTreeMap<usize, Vec<Pending>>,
}

impl<'a> Tool<'a> {
    /// Reads the CAD model, if there is anything to score.
    pub(super) fn new(dataset: &'a Dataset, work: &ToolWork, skipped: &mut Vec<Skipped>) -> Self {
        let tool = &work.tool;
        let model = tool.as_deref().filter(|_| !work.ids.is_empty()).and_then(|name| {
            let skip = |err: TaskError| {
                let why = err.hint.map_or(err.why.clone(), |hint| format!("{} ({hint})", err.why));
                skipped.push(Skipped { what: name.into(), method: String::new(), why });
            };
            load_tool(dataset, name).map(|loaded| loaded.model).map_err(skip).ok()
        });
        let pattern = tool.as_deref().map(|name| pattern_of(name).to_owned());
        Self { dataset, pattern, model, pending: BTreeMap::new() }
    }

    /// Takes some of its grasps through every method. `say` is told which.
    pub(super) fn score(
        &mut self,
        cases: &[LoadedPair],
        setup: &Setup,
        models: &mut Models,
        skipped: &mut Vec<Skipped>,
        cx: &JobCx,
        say: &mut dyn FnMut(&str),
    ) {
        let common = models.common().clone();
        let Models { methods, masks: by_models, classifier, .. } = models;
        for (at, method) in methods.iter_mut().enumerate() {
            say(method.name());
            let upper = matches!(method, Method::Measured);
            let recipe = method.posed(&common);
            let with_masks = recipe.mask_recipe(&self.dataset.rig).is_ok();
            let cases: Vec<&LoadedPair> = cases.iter().collect();
            let Some(made) = method.make(&cases, common.shift, cx) else { return };
            let mut skip = |case: &LoadedPair, why: String| {
                skipped.push(Skipped { what: case.name.clone(), method: method.name().to_owned(), why });
            };
            let labels = (PairLabels::default(), TaskError::new("Evaluate", "there is no CAD model"));
            let mut kept: Vec<Masked<'_>> = Vec::new();
            for (case, made) in cases.into_iter().zip(made) {
                let made = match made {
                    Ok(made) => made,
                    Err(why) => {
                        skip(case, why);
                        continue;
                    }
                };
                let touch = self.touch(case, &labels);
                let mut estimate = Estimate::with_imprints(&recipe, made.imprints.clone());
                let posed = with_masks && self.model.is_some() && can_be_posed(&case.sample);
                if posed {
                    let reach =
                        || estimate.clone().reach(touch, Stage::Mask, by_models, &cx.quiet()).map_err(|err| err.why);
                    match guarded(reach) {
                        Ok(masked) => estimate = masked,
                        Err(why) => skip(case, format!("contact mask: {why}")),
                    }
                }
                let otherwise = otherwise(&estimate);
                let iou = if estimate.has(Stage::Mask) { mask_iou(&estimate, &case.sample) } else { PerPad::default() };
                let estimate = Some(estimate).filter(|estimate| estimate.has(Stage::Mask));
                kept.push(Masked { case, made, estimate, otherwise, iou });
            }
            // Poses on all cores; the models run one by one.
            let angles: Vec<Result<Judged, String>> = kept
                .par_iter()
                .map(|Masked { case, made, estimate, .. }| {
                    // A color picture has no depth, so there is nothing that could fail.
                    let Some(estimate) = estimate.clone().filter(|_| made.colors.is_empty()) else {
                        return Ok(Judged::default());
                    };
                    guarded(|| self.angle(estimate, self.touch(case, &labels), by_models, cx))
                })
                .collect();
            for (Masked { case, made, otherwise, iou, .. }, angle) in kept.into_iter().zip(angles) {
                let scored = angle.and_then(|angle| Ok((angle, guarded(|| Ok(images(case, &made, setup, upper)))?)));
                let (judged, mut images) = match scored {
                    Ok(scored) => scored,
                    Err(why) => {
                        skip(case, why);
                        continue;
                    }
                };
                for image in &mut images {
                    image.mask_iou = iou.get(PadId::new(image.finger)).copied();
                }
                if case.sample.scale == Scale::Measured
                    && made.colors.is_empty()
                    && let Err(why) = describe(classifier.as_mut(), &mut images)
                {
                    skip(case, why);
                }
                let score = GraspScore {
                    pair: case.name.clone(),
                    tool: self.pattern.clone(),
                    group: case.group,
                    // Differences of a color sensor never lost their scale.
                    scale: if made.colors.is_empty() { case.sample.scale } else { Scale::Measured },
                    images: Vec::new(),
                    angle_error_rad: judged.angle_error_rad,
                    position_error_m: judged.position_error_m,
                    verdict: judged.verdict,
                };
                let entry = Entry { score, notes: case.sample.notes.clone(), otherwise };
                self.pending.entry(at).or_default().push(Pending { entry, images });
            }
        }
    }

    fn touch<'t>(&'t self, case: &'t LoadedPair, nothing: &'t (PairLabels, TaskError)) -> Touch<'t> {
        Touch {
            dataset: self.dataset,
            pair: case.id,
            sample: &case.sample,
            tool: self.model.as_ref().ok_or(&nothing.1),
            labels: case.labels.as_ref().unwrap_or(&nothing.0),
        }
    }

    /// The error of the angle from both fingers and the verdict on the pose.
    fn angle(
        &self,
        estimate: Estimate,
        touch: Touch<'_>,
        models: &models::Models,
        cx: &JobCx,
    ) -> Result<Judged, String> {
        if touch.sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            return Ok(Judged::default());
        }
        let cx = &cx.quiet();
        let truth = Estimate::compared_with(touch, estimate.recipe(), models, cx).map_err(|err| err.why)?;
        let estimate = estimate.reach(touch, Stage::Pose, models, cx).map_err(|err| err.why)?;
        let found = estimate.pose().ok();
        let off = found.zip(truth).zip(touch.tool.ok()).map(|((found, truth), tool)| found.off(truth, tool));
        Ok(Judged {
            angle_error_rad: truth.map(|_| off.map_or(f64::NAN, |off| off.angle_rad)),
            position_error_m: off.map(|off| off.position_m),
            verdict: found.and_then(|found| Some(found.verdict.as_ref()?.grade)),
        })
    }

    /// The image figures, now that all predictions of the tool are there.
    pub(super) fn finish(mut self, scores: &mut [Scores], skipped: &mut Vec<Skipped>) -> Vec<(usize, Entry)> {
        let mut measured_features = Vec::new();
        let mut all = Vec::new();
        for (at, scores) in scores.iter_mut().enumerate() {
            let pending = self.pending.remove(&at).unwrap_or_default();
            let range = width(pending.iter().flat_map(|p| &p.images).filter_map(|i| span(&i.prediction)));
            let done: Vec<_> = pending.into_par_iter().map(|pending| ended(pending, range)).collect();
            let mut entries = Vec::new();
            for one in done {
                match one {
                    Ok(entry) => entries.push(entry),
                    Err((what, why)) => skipped.push(Skipped { what, method: scores.method.clone(), why }),
                }
            }
            // The measured imprints come first: what the others' features are compared with.
            if at == 0 {
                measured_features = entries
                    .iter()
                    .flat_map(|e: &Entry| e.score.images.iter().map(move |i| (e.score.group, i.features.clone())))
                    .filter(|(_, f)| !f.is_empty())
                    .collect();
            } else if !entries.is_empty() {
                scores.measured_features.extend(measured_features.iter().cloned());
            }
            scores.grasps.extend(entries.iter().map(|entry| entry.score.clone()));
            all.extend(entries.into_iter().map(|entry| (at, entry)));
        }
        all
    }
}

/// A pose against the truth, and the verdict on it.
#[derive(Default)]
struct Judged {
    /// Radians; NaN without a pose, `None` where there can be none.
    angle_error_rad: Option<f64>,
    /// Meters.
    position_error_m: Option<f64>,
    verdict: Option<Grade>,
}

/// Intersection over union of each mask of a touch with the simulator's true contact, where it is known.
fn mask_iou(estimate: &Estimate, sample: &Sample) -> PerPad<f64> {
    let mut found = PerPad::default();
    for (pad, contact) in estimate.contact().masks.entries() {
        let truth = sample.pad(pad).and_then(|touch| touch.depth()).and_then(|depth| depth.truth.as_ref());
        found[pad] = truth
            .filter(|truth| truth.contact.size() == contact.mask.size())
            .map(|truth| iou(&contact.mask, &truth.contact));
    }
    found
}

/// A grasp with its image figures; else its pair and what failed.
fn ended(pending: Pending, range: f64) -> Result<Entry, (String, String)> {
    let Pending { mut entry, images } = pending;
    // Stretched pictures have one range only.
    let range = if entry.score.scale == Scale::Assumed { 1.0 } else { range };
    match guarded(|| Ok(images.into_iter().map(|i| finished(i, range)).collect())) {
        Ok(images) => {
            entry.score.images = images;
            Ok(entry)
        }
        Err(why) => Err((entry.score.pair, why)),
    }
}

/// The compared images of a grasp: in meters, or stretched to 0..1 where the scale was lost.
fn images(case: &LoadedPair, made: &Made, setup: &Setup, upper: bool) -> Vec<Image> {
    let of_finger = |finger: PadId| {
        let image = |prediction, truth, noise_free| Image {
            finger: finger.index(),
            prediction,
            truth,
            noise_free,
            mask_iou: None,
            features: Vec::new(),
        };
        if let Some(color) = made.colors.get(finger) {
            // On the scale on which the peak of the depth stands for that of the color: one pooled figure serves both.
            let levels = |picture: &RgbGrid| planes(picture, PEAK_M / LEVELS);
            let truth = Some(levels(&case.sample.pad(finger)?.color()?.difference));
            return Some(image(levels(color), truth, None));
        }
        let bubble = case.sample.pad(finger)?.depth()?;
        if case.sample.scale == Scale::Assumed {
            // On the picture's own pixels and in its orientation, so that stored predictions are not resampled.
            let tile = case.tile.as_ref()?;
            let prediction = match (&made.tile, &made.imprints[finger]) {
                (Some(stored), _) => stored.clone(),
                (None, Some(imprint)) => {
                    made.pictures[finger].clone().unwrap_or_else(|| as_tile(imprint, &case.sample.rig, tile.size()))
                }
                (None, None) => return None,
            };
            return Some(image(unit_range(&prediction), Some(unit_range(tile)), None));
        }
        let prediction = made.imprints[finger].clone()?;
        let truth = (!upper).then(|| bubble.imprint.clone());
        let noise_free = bubble.truth.as_ref().map(|t| t.imprint.clone());
        Some(image(prediction, truth, noise_free))
    };
    let meant = |pad: &PadId| setup.finger.is_none_or(|only| only == *pad) && case.sample.pad(*pad).is_some();
    case.sample.rig.pads().filter(meant).filter_map(of_finger).collect()
}

/// The work on one pair: a panic in it is that pair's failure and not the end of the run.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_panic(work).unwrap_or_else(|message| {
        Err(format!("an internal error, which is a bug: {message}; please report it with this pair"))
    })
}

/// Least and largest value of an image; `None` without one that is finite.
fn span(image: &Grid<f32>) -> Option<[f32; 2]> {
    let finite = image.as_slice().iter().copied().filter(|v| v.is_finite());
    let [low, high] = finite.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    (low <= high).then_some([low, high])
}

/// Largest minus smallest value of some images.
fn width(spans: impl Iterator<Item = [f32; 2]>) -> f64 {
    let [low, high] = spans.fold([f32::INFINITY, f32::NEG_INFINITY], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    f64::from(high) - f64::from(low)
}

fn finished(image: Image, range: f64) -> ImageScore {
    let Image { finger, prediction, truth, noise_free, mask_iou, features } = image;
    let similar = |truth| ssim(&prediction, truth, SsimRange::Explicit(range)).ok();
    ImageScore {
        finger,
        ssim: truth.as_ref().and_then(similar),
        error: truth.and_then(|truth| squared_error(&prediction, &truth)).unwrap_or_default(),
        noise_free: noise_free.and_then(|clean| squared_error(&prediction, &clean)),
        mask_iou,
        features,
    }
}
