//! Scoring the grasps of one tool: image figures wait until all its predictions are there, because the lab's SSIM takes
//! its range from them.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::load::Case;
use super::methods::{Made, Method, Models};
use super::{Setup, Skipped};
use crate::domain::align::Ask;
use crate::domain::catalog::pattern_of;
use crate::domain::contact::{ContactMask, MaskBasis};
use crate::domain::evaluation::{GraspScore, ImageScore, PEAK_M, Scores, fingers, squared_error};
use crate::domain::grid::{DepthMap, Grid, Mask, RgbGrid};
use crate::domain::metrics::{self, LEVELS, SsimRange, Unstretched, planes, ssim_ranges, unit_range};
use crate::domain::pose::ToolModel;
use crate::domain::rig::{PadId, PerPad};
use crate::domain::sample::{Sample, Scale};
use crate::infer::classifier::Verdict;
use crate::io::caught::caught;
use crate::io::dataset::{ASSUMED_IMPRINT_RANGE_M, Dataset, assumed_meters};
use crate::work::cloud::contact_points;
use crate::work::compare::as_tile;
use crate::work::error::TaskError;
use crate::work::job::JobCx;
use crate::work::mask::MaskInputs;
use crate::work::models::Masking;
use crate::work::pose;
use crate::work::tool::load_tool;

/// A prediction that waits for its image figures.
struct Image {
    finger: usize,
    prediction: Grid<f32>,
    /// `None` for the measured imprint itself, which is not compared with itself.
    truth: Option<Grid<f32>>,
    noise_free: Option<Grid<f32>>,
    unstretched: Option<Unstretched>,
    verdict: Option<Verdict>,
}

/// A grasp that waits for its image figures.
struct Pending {
    score: GraspScore,
    images: Vec<Image>,
}

/// The grasps of one tool, by method.
pub(super) struct Tool {
    /// Its pattern's name.
    pattern: Option<String>,
    model: Option<ToolModel>,
    class: Option<usize>,
    pending: BTreeMap<usize, Vec<Pending>>,
}

impl Tool {
    /// Reads the CAD model.
    pub(super) fn new(dataset: &Dataset, tool: Option<String>, skipped: &mut Vec<Skipped>) -> Self {
        let model = tool.as_deref().and_then(|name| {
            let skip = |err: TaskError| {
                let why = err.hint.map_or(err.why.clone(), |hint| format!("{} ({hint})", err.why));
                skipped.push(Skipped { what: name.into(), method: String::new(), why });
            };
            load_tool(dataset, name).map(|(model, _)| model).map_err(skip).ok()
        });
        let pattern = tool.as_deref().map(|name| pattern_of(name).to_owned());
        Self { pattern, model, class: None, pending: BTreeMap::new() }
    }

    /// Takes some of its grasps through every method. `say` is told which.
    pub(super) fn score(
        &mut self,
        cases: &[Case],
        setup: &Setup,
        models: &mut Models,
        skipped: &mut Vec<Skipped>,
        cx: &JobCx,
        say: &mut dyn FnMut(&str),
    ) {
        let Models { methods, masks: by_models, mask_bundle, classifier, made_otherwise, .. } = models;
        let by = Masking { choice: setup.mask, model: mask_bundle.as_ref(), engine: setup.runtime };
        let with_masks = by.recipe().is_ok();
        self.class = classifier.as_ref().and_then(|c| c.class_of(self.pattern.as_deref()?));
        for (at, method) in methods.iter_mut().enumerate() {
            say(method.name());
            let upper = matches!(method, Method::Measured);
            let Some(made) = method.make(cases, setup, cx) else { return };
            let mut skip = |case: &Case, why: String| {
                skipped.push(Skipped { what: case.name.clone(), method: method.name().to_owned(), why });
            };
            let mut kept: Vec<(&Case, Made, PerPad<Mask>)> = Vec::new();
            for (case, made) in cases.iter().zip(made) {
                let made = match made {
                    Ok(made) => made,
                    Err(why) => {
                        skip(case, why);
                        continue;
                    }
                };
                let masks = case.sample.rig.pads().map(|f| {
                    if self.model.is_none() || case.sample.grasp_from_object.is_none() {
                        return None;
                    }
                    let imprint = made.imprints[f].as_ref().filter(|_| with_masks)?;
                    let tool = self.model.as_ref();
                    let inputs = MaskInputs { sample: &case.sample, tool, labels: case.labels.as_ref() };
                    let found = guarded(|| by_models.contact_mask(by, imprint, f, inputs).map_err(|err| err.why));
                    let finger = || case.sample.rig.pad_key(f);
                    let found = found.map_err(|why| skip(case, format!("{} finger: contact mask: {why}", finger())));
                    let ContactMask { mask, basis } = found.ok()?;
                    let why = match basis {
                        MaskBasis::Source => return Some(mask),
                        MaskBasis::Hand => "were drawn by hand, and are taken whatever the imprint",
                        MaskBasis::Flat => "are empty: the imprints are flat",
                        MaskBasis::Depth(_) => {
                            "are by depth: the mask model found no contact in imprints that have some"
                        }
                    };
                    *made_otherwise.entry((method.name().to_owned(), why)).or_insert(0) += 1;
                    Some(mask)
                });
                let masks = masks.collect();
                kept.push((case, made, masks));
            }
            // Poses on all cores; the models run one by one.
            let angles: Vec<Result<Option<f64>, String>> = kept
                .par_iter()
                .map(|(case, made, masks)| {
                    // A color picture has no depth, so there is nothing that could fail.
                    let posed = with_masks && made.colors.is_empty();
                    guarded(|| Ok(posed.then(|| self.angle(setup, &case.sample, made, masks)).flatten()))
                })
                .collect();
            for ((case, made, _), angle) in kept.into_iter().zip(angles) {
                let scored = angle.and_then(|angle| Ok((angle, guarded(|| Ok(images(case, &made, setup, upper)))?)));
                let (angle_error_rad, mut images) = match scored {
                    Ok(scored) => scored,
                    Err(why) => {
                        skip(case, why);
                        continue;
                    }
                };
                if let Some(classifier) =
                    classifier.as_mut().filter(|_| case.sample.scale == Scale::Measured && made.colors.is_empty())
                {
                    let pictures: Vec<&DepthMap> = images.iter().map(|i| &i.prediction).collect();
                    match guarded(|| classifier.classify(&pictures).map_err(|err| err.to_string())) {
                        Ok(verdicts) => images.iter_mut().zip(verdicts).for_each(|(i, v)| i.verdict = Some(v)),
                        Err(why) => skip(case, format!("tool classifier: {why}")),
                    }
                }
                let score = GraspScore {
                    pair: case.name.clone(),
                    tool: self.pattern.clone(),
                    group: case.group,
                    // Differences of a color sensor never lost their scale.
                    scale: if made.colors.is_empty() { case.sample.scale } else { Scale::Measured },
                    images: Vec::new(),
                    angle_error_rad,
                    seconds: made.seconds,
                };
                self.pending.entry(at).or_default().push(Pending { score, images });
            }
        }
    }

    /// The error of the angle from both fingers: NaN without a pose, `None` where there can be none.
    fn angle(&self, setup: &Setup, sample: &Sample, made: &Made, masks: &PerPad<Mask>) -> Option<f64> {
        let (model, truth) = (self.model.as_ref()?, sample.grasp_from_object?);
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            return None;
        }
        let found = contact_points(sample, &made.imprints.as_ref(), &masks.as_ref())
            .and_then(|points| pose::pose(&points, model, &*setup.engine.method(), Ask::default(), Some(truth)));
        Some(found.ok().and_then(|found| found.error_rad).unwrap_or(f64::NAN))
    }

    /// The image figures, now that all predictions of the tool are there.
    pub(super) fn finish(self, scores: &mut [Scores], skipped: &mut Vec<Skipped>) {
        let class = self.class;
        let mut measured_features = Vec::new();
        for (at, pending) in self.pending {
            let range = spread(pending.iter().flat_map(|p| &p.images).map(|i| &i.prediction));
            let done: Vec<Result<GraspScore, Skipped>> = pending
                .into_par_iter()
                .map(|Pending { mut score, images }| {
                    let assumed = score.scale == Scale::Assumed;
                    let ranges = if assumed {
                        [SsimRange::Explicit(1.0); 2]
                    } else {
                        [SsimRange::Explicit(range), SsimRange::Explicit(PEAK_M)]
                    };
                    let scored =
                        || Ok(images.into_iter().map(|image| finished(image, class, ranges, assumed)).collect());
                    match guarded(scored) {
                        Ok(images) => {
                            score.images = images;
                            Ok(score)
                        }
                        Err(why) => Err(Skipped { what: score.pair, method: scores[at].method.clone(), why }),
                    }
                })
                .collect();
            let mut kept = Vec::new();
            for one in done {
                match one {
                    Ok(score) => kept.push(score),
                    Err(bad) => skipped.push(bad),
                }
            }
            // The measured imprints come first: what the others' features are compared with.
            if at == 0 {
                measured_features = kept
                    .iter()
                    .flat_map(|g| g.images.iter().map(move |i| (g.group, i.features.clone())))
                    .filter(|(_, f)| !f.is_empty())
                    .collect();
            } else {
                scores[at].measured_features.extend(measured_features.iter().cloned());
            }
            scores[at].grasps.extend(kept);
        }
    }
}

/// The compared images of a grasp: in meters, or stretched to 0..1 where the scale was lost.
fn images(case: &Case, made: &Made, setup: &Setup, upper: bool) -> Vec<Image> {
    let image = |finger: PadId| {
        if let Some(color) = made.colors.get(finger) {
            // On the scale on which the peak of the depth stands for that of the color: one pooled figure serves both.
            let levels = |picture: &RgbGrid| planes(picture, PEAK_M / LEVELS);
            let truth = Some(levels(&case.sample.pad(finger)?.color()?.difference));
            let prediction = levels(color);
            let finger = finger.index();
            return Some(Image { finger, prediction, truth, noise_free: None, unstretched: None, verdict: None });
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
            let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
            let raw = (in_assumed_meters(&prediction, made), assumed_meters(tile));
            let unstretched = metrics::unstretched(&raw.0, &raw.1, hi - lo).ok();
            let (prediction, truth) = (unit_range(&prediction), unit_range(tile));
            return Some(Image {
                finger: finger.index(),
                prediction,
                truth: Some(truth),
                noise_free: None,
                unstretched,
                verdict: None,
            });
        }
        let prediction = made.imprints[finger].clone()?;
        let truth = (!upper).then(|| bubble.imprint.clone());
        let noise_free = bubble.truth.as_ref().map(|t| t.imprint.clone());
        Some(Image { finger: finger.index(), prediction, truth, noise_free, unstretched: None, verdict: None })
    };
    let present = |f: &PadId| case.sample.pad(*f).is_some();
    fingers(&case.sample.rig, setup.both_fingers).filter(present).filter_map(image).collect()
}

/// The work on one pair: a panic in it is that pair's failure and not the end of the run.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    caught(work).unwrap_or_else(|message| {
        Err(format!("an internal error, which is a bug: {message}; please report it with this pair"))
    })
}

/// What a method made of a picture, in the assumed meters: stored predictions are gray levels.
fn in_assumed_meters(prediction: &Grid<f32>, made: &Made) -> Grid<f32> {
    if made.tile.is_some() { assumed_meters(prediction) } else { prediction.clone() }
}

/// Largest minus smallest value of some images.
fn spread<'a>(images: impl Iterator<Item = &'a Grid<f32>>) -> f64 {
    let (lo, hi) = images
        .flat_map(|i| i.as_slice())
        .filter(|v| v.is_finite())
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    f64::from(hi) - f64::from(lo)
}

fn finished(image: Image, class: Option<usize>, ranges: [SsimRange; 2], assumed: bool) -> ImageScore {
    let Image { finger, prediction, truth, noise_free, unstretched, verdict } = image;
    let ssim = truth.as_ref().and_then(|truth| ssim_ranges(&prediction, truth, &ranges).ok());
    let of = |at: usize| ssim.as_ref().map(|found| found[at].mean);
    let clean = noise_free.as_ref().and_then(|clean| ssim_ranges(&prediction, clean, &ranges[..1]).ok());
    ImageScore {
        finger,
        error: truth.and_then(|truth| squared_error(&prediction, &truth)).unwrap_or_default(),
        noise_free: noise_free.and_then(|clean| squared_error(&prediction, &clean)),
        ssim: of(0),
        ssim_noise_free: clean.map(|found| found[0].mean),
        ssim_peak: of(1).filter(|_| !assumed),
        unstretched,
        tool_right: verdict.as_ref().zip(class).map(|(v, class)| v.class == class),
        features: verdict.map_or_else(Vec::new, |v| v.features),
    }
}
