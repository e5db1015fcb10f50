//! The paper's results table from the scores of single touches: which grasps belong together, what is averaged over
//! what, and how sure the figures are.
//!
//! Conventions, as the lab computes its table: PSNR of the squared error pooled over all images of a tool, peak 0.0225 m;
//! SSIM with the range of the tool's predictions; every figure per tool, then the mean over the tools. Where the source
//! lost its scale, PSNR and SSIM are those of images stretched to 0..1 one by one, and their mean.
//!
//! The intervals are 95 % bootstrap intervals: the grasps are drawn again within each tool, the tools stay.

mod columns;
mod metric;
mod paper;
mod write;

use std::collections::{BTreeMap, BTreeSet};

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Deserializer, Serialize};

use super::catalog;
use super::dataset::{PairEntry, Split};
use super::metrics::AngleSummary;
use super::sample::Scale;
use super::verdict::Grade;

use columns::{COLUMNS, Of};
pub use columns::{Column, NOTES, TableMetrics, columns, conventions};
pub use metric::{Condition, Metric};
pub use paper::paper_rows;
pub use write::{csv, text};

/// The lab's peak of the PSNR, meters.
pub const PEAK_M: f64 = 0.0225;
/// Seed of the intervals.
const BOOTSTRAP_SEED: u64 = 1;

/// Grasps that are averaged together: a column group of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// Grasps of tools that were trained on, which were not.
    SeenTools,
    /// Grasps of tools that were never trained on.
    UnseenTools,
    /// Grasps of the training set.
    Training,
    /// Pictures whose GelSlim image kept its whole range.
    CleanPictures,
    /// Pictures whose GelSlim image was cut off at black or white.
    ClippedPictures,
    /// Grasps of unknown tools.
    Unknown,
}

impl Group {
    /// The name on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::SeenTools => "Unseen grasps of seen tools",
            Self::UnseenTools => "Unseen tools",
            Self::Training => "Training grasps",
            Self::CleanPictures => "Pictures with clean GelSlim images",
            Self::ClippedPictures => "Pictures with clipped GelSlim images",
            Self::Unknown => "Grasps of unknown tools",
        }
    }

    /// A few letters for a column.
    pub fn short(self) -> &'static str {
        match self {
            Self::SeenTools => "unseen grasps",
            Self::UnseenTools => "unseen tools",
            Self::Training => "training",
            Self::CleanPictures => "clean",
            Self::ClippedPictures => "clipped",
            Self::Unknown => "all",
        }
    }

    /// The group of a pair: `clipped` for a picture says whether its GelSlim image is. `simulated`: nothing of the source
    /// was trained on.
    pub fn of(entry: &PairEntry, simulated: bool, clipped: Option<bool>) -> Self {
        match (clipped, entry.tool.as_deref()) {
            (Some(true), _) => Self::ClippedPictures,
            (Some(false), _) => Self::CleanPictures,
            (None, Some(_)) if !simulated && matches!(entry.split, Split::Train | Split::TrainOnly) => Self::Training,
            (None, Some(tool)) => match catalog::tools().iter().find(|t| t.name == catalog::pattern_of(tool)) {
                Some(known) if known.seen => Self::SeenTools,
                Some(_) => Self::UnseenTools,
                None => Self::Unknown,
            },
            (None, None) => Self::Unknown,
        }
    }
}

/// A squared error that can be pooled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SquaredError {
    /// Sum over the pixels, m² (or of the stretched images).
    pub sum: f64,
    /// Pixels.
    pub pixels: usize,
}

/// The figures of one predicted image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageScore {
    /// Finger: 0 right, 1 left.
    pub finger: usize,
    /// Against the measured imprint.
    pub error: SquaredError,
    /// Against the simulator's imprint without camera noise.
    pub noise_free: Option<SquaredError>,
    /// With the range of the tool's predictions; of stretched pictures with 1.
    pub ssim: Option<f64>,
    /// Intersection over union of the contact mask with the simulator's true contact, 0..1.
    pub mask_iou: Option<f64>,
    /// Features of the imprint: the input of the classifier's last layer.
    #[serde(skip)]
    pub features: Vec<f32>,
}

/// The figures of one grasp by one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspScore {
    /// The pair's name.
    pub pair: String,
    /// Name of its tool, without the shaft it may have been put on.
    pub tool: Option<String>,
    /// Column group.
    pub group: Group,
    /// Scale of the images, which says what their figures mean.
    pub scale: Scale,
    /// One per finger that was compared.
    pub images: Vec<ImageScore>,
    /// Error of the in-hand angle, radians, without sign; NaN (null in files) without a pose, `None` (absent in files) where
    /// no truth is known.
    #[serde(skip_serializing_if = "Option::is_none", default, deserialize_with = "null_is_nan")]
    pub angle_error_rad: Option<f64>,
    /// Distance of the estimated place of the tool in the hand from the true one, meters; `None` without a pose or truth.
    pub position_error_m: Option<f64>,
    /// Reliance that the pose deserves, without the truth; `None` without a pose.
    pub verdict: Option<Grade>,
}

/// A number that is there; null is NaN.
fn null_is_nan<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    Ok(Some(Option::deserialize(from)?.unwrap_or(f64::NAN)))
}

/// A method with its grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// The row's name.
    pub method: String,
    /// True where these are the measured imprints themselves.
    pub upper_bound: bool,
    /// One per grasp it was given.
    pub grasps: Vec<GraspScore>,
    /// Features of the measured imprints, to compare sets with: by group, without order.
    #[serde(skip)]
    pub measured_features: Vec<(Group, Vec<f32>)>,
}

/// A figure with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The figure.
    pub value: f64,
    /// Lower and upper end; `None` for a figure that was read in a publication.
    pub interval: Option<[f64; 2]>,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The method.
    pub method: String,
    /// Published on real data, not computed here.
    pub published: bool,
    /// The measured imprints themselves: what no generator can beat.
    pub upper_bound: bool,
    /// One per column group of the table.
    pub groups: Vec<TableMetrics>,
}

/// Notes on groups that have fewer images than the Fréchet distance has features.
pub fn few_features(scores: &[Scores], groups: &[Group]) -> Vec<String> {
    let few = |group: &Group| {
        let measured = scores.iter().find(|scores| !scores.measured_features.is_empty())?;
        let mut of = measured.measured_features.iter().filter(|(g, _)| g == group).map(|(_, features)| features.len());
        let features = of.next()?;
        let images = 1 + of.count();
        (images < features).then(|| {
            format!(
                "Fréchet distance, {}: {images} images are fewer than the {features} features: biased upwards, compare sets \
                 of equal size only",
                group.short()
            )
        })
    };
    groups.iter().filter_map(few).collect()
}

/// The row of a method, for the column groups `groups`; `resamples` drawings for the intervals, 0 for none.
pub fn row(scores: &Scores, groups: &[Group], resamples: usize) -> Row {
    let figures = |&group: &Group| {
        let grasps: Vec<&GraspScore> = scores.grasps.iter().filter(|g| g.group == group).collect();
        let measured: Vec<&[f32]> =
            scores.measured_features.iter().filter(|(g, _)| *g == group).map(|(_, f)| f.as_slice()).collect();
        figures(group, &grasps, &measured, resamples)
    };
    Row {
        method: scores.method.clone(),
        published: false,
        upper_bound: scores.upper_bound,
        groups: groups.iter().map(figures).collect(),
    }
}

/// The column groups of some grasps, in the order of the table.
pub fn groups_of<'a>(grasps: impl IntoIterator<Item = &'a GraspScore>) -> Vec<Group> {
    grasps.into_iter().map(|g| g.group).collect::<BTreeSet<_>>().into_iter().collect()
}

fn figures(group: Group, grasps: &[&GraspScore], measured: &[&[f32]], resamples: usize) -> TableMetrics {
    let tools = by_tool(grasps, |grasp| grasp);
    let figure = |column: &Column| match &column.of {
        Of::Tool(of) => estimate(&tools, of, resamples),
        Of::Group(of) => of(grasps, measured).map(|value| Estimate { value, interval: None }),
    };
    TableMetrics {
        group,
        tools: tools.len(),
        grasps: grasps.len(),
        images: images(grasps).count(),
        without_pose: grasps.iter().filter(|g| g.angle_error_rad.is_some_and(f64::is_nan)).count(),
        figures: COLUMNS.iter().filter_map(|column| Some((column.key, figure(column)?))).collect(),
    }
}

fn images<'a>(grasps: &'a [&GraspScore]) -> impl Iterator<Item = &'a ImageScore> {
    grasps.iter().flat_map(|g| &g.images)
}

/// The mean of some figures; `None` without any.
pub fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
    (n > 0).then(|| sum / n as f64)
}

/// PSNR of the pooled error where lengths are measured, else the mean of the images' own. Equal images have none.
fn psnr(grasps: &[&GraspScore], of: impl Fn(&ImageScore) -> Option<SquaredError>) -> Option<f64> {
    let db = |peak: f64, e: SquaredError| {
        (e.pixels > 0 && e.sum > 0.0).then(|| 20.0 * peak.log10() - 10.0 * (e.sum / e.pixels as f64).log10())
    };
    if grasps.iter().any(|g| g.scale == Scale::Assumed) {
        return mean(images(grasps).filter_map(|i| db(1.0, of(i)?)));
    }
    let pooled = images(grasps)
        .filter_map(of)
        .fold(SquaredError::default(), |a, b| SquaredError { sum: a.sum + b.sum, pixels: a.pixels + b.pixels });
    db(PEAK_M, pooled)
}

fn angles(grasps: &[&GraspScore]) -> Option<AngleSummary> {
    let errors: Vec<f64> = grasps.iter().filter_map(|g| g.angle_error_rad).collect();
    (!errors.is_empty()).then(|| AngleSummary::from_errors(&errors))
}

/// Grasps, alone or in pairs, by the tool of `grasp`, in the order of the tools' names.
fn by_tool<'a, T: Copy>(grasps: &[T], grasp: impl Fn(T) -> &'a GraspScore) -> Vec<Vec<T>> {
    let mut tools: BTreeMap<Option<&str>, Vec<T>> = BTreeMap::new();
    for &one in grasps {
        tools.entry(grasp(one).tool.as_deref()).or_default().push(one);
    }
    tools.into_values().collect()
}

/// The mean over the tools of a figure of each tool's grasps, with its interval.
fn estimate<T: Copy>(tools: &[Vec<T>], figure: impl Fn(&[T]) -> Option<f64>, resamples: usize) -> Option<Estimate> {
    let over = |tools: &[Vec<T>]| mean(tools.iter().filter_map(|grasps| figure(grasps)));
    let value = over(tools)?;
    let mut rng = ChaCha8Rng::seed_from_u64(BOOTSTRAP_SEED);
    let mut drawn: Vec<f64> = (0..resamples)
        .filter_map(|_| {
            let again: Vec<Vec<T>> = tools
                .iter()
                .map(|grasps| (0..grasps.len()).map(|_| grasps[rng.random_range(0..grasps.len())]).collect())
                .collect();
            over(&again)
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    let quantile = |share: f64| drawn[((drawn.len() - 1) as f64 * share).round() as usize];
    Some(Estimate { value, interval: (drawn.len() >= 20).then(|| [quantile(0.025), quantile(0.975)]) })
}

/// The squared error over the pixels that are finite in both images; `None` if the sizes differ or none is.
pub fn squared_error(prediction: &super::grid::Grid<f32>, truth: &super::grid::Grid<f32>) -> Option<SquaredError> {
    let pixels =
        prediction.as_slice().iter().zip(truth.as_slice()).filter(|(p, t)| p.is_finite() && t.is_finite()).count();
    let mse = super::metrics::mse(prediction, truth).ok()?;
    Some(SquaredError { sum: mse * pixels as f64, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn grasp(tool: &str, group: Group, rms_m: f64, angle_deg: f64) -> GraspScore {
        let error = SquaredError { sum: rms_m * rms_m * 100.0, pixels: 100 };
        let image = ImageScore { error, ssim: Some(0.5), ..ImageScore::default() };
        GraspScore {
            pair: format!("{tool}/data_0"),
            tool: Some(tool.into()),
            group,
            scale: Scale::Measured,
            images: vec![image],
            angle_error_rad: Some(angle_deg.to_radians()),
            position_error_m: Some(1e-3),
            verdict: Some(Grade::of_angle_error(angle_deg.to_radians())),
        }
    }

    #[test]
    fn grasps_are_ordered_by_their_worst_figure_and_a_failure_is_the_worst() {
        let grasps = [("a", 0.002, 1.0), ("b", 0.001, 12.0), ("c", 0.009, f64::NAN), ("d", 0.003, 3.0)];
        let grasps = grasps.map(|(tool, rms_m, deg)| grasp(tool, Group::SeenTools, rms_m, deg));
        let order = |metric: Metric| {
            let mut all: Vec<&GraspScore> = grasps.iter().collect();
            all.sort_by(|a, b| metric.worse(a.metric(metric).unwrap(), b.metric(metric).unwrap()));
            all.iter().map(|g| g.tool.clone().unwrap()).collect::<String>()
        };
        assert_eq!(order(Metric::Angle), "cbda");
        assert_eq!(order(Metric::Psnr), "cdab");
        // 20 log10(22.5 / 2).
        assert!((grasps[0].metric(Metric::Psnr).unwrap() - 21.023).abs() < 1e-3);
        assert_eq!(grasps[0].metric(Metric::Ssim), Some(0.5));
        // A file tells a grasp without a pose from one without a truth.
        let written = |grasp: &GraspScore| serde_json::to_value(grasp).unwrap().get("angle_error_rad").cloned();
        assert_eq!(written(&grasps[2]), Some(serde_json::Value::Null));
        let bare = GraspScore { images: Vec::new(), angle_error_rad: None, ..grasps[0].clone() };
        assert!([Metric::Angle, Metric::Psnr, Metric::Ssim].iter().all(|f| bare.metric(*f).is_none()));
        assert_eq!(written(&bare), None);
    }

    #[test]
    fn errors_are_pooled_within_a_tool_and_figures_averaged_over_tools() {
        let group = Group::SeenTools;
        let grasps = vec![
            grasp("a", group, 0.00225, 1.0),
            grasp("a", group, 0.0, 3.0),
            grasp("b", group, 0.0225, 20.0),
            grasp("b", group, 0.0225, f64::NAN),
            grasp("c", Group::UnseenTools, 0.0225, 0.0),
        ];
        let scores = Scores { method: "m".into(), upper_bound: false, grasps, measured_features: Vec::new() };
        assert_eq!(groups_of(&scores.grasps), [Group::SeenTools, Group::UnseenTools]);
        let row = row(&scores, &[group], 200);
        let f = &row.groups[0];
        // Tool a: 20 dB of half the squared error, 23.01; tool b: 0.
        let a = 10.0 * (0.0225f64 * 0.0225 / (0.5 * 0.00225 * 0.00225)).log10();
        assert!((f.named("psnr_db").unwrap().value - 0.5 * a).abs() < 1e-9);
        assert_eq!((f.tools, f.grasps, f.images, f.without_pose), (2, 4, 4, 1));
        // 2° in tool a, 20° in tool b (the failure is in no mean), success 100 % and 0 %.
        assert!((f.named("angle_deg").unwrap().value - 11.0).abs() < 1e-9);
        assert!((f.named("success_5").unwrap().value - 50.0).abs() < 1e-9);
        let [low, high] = f.named("psnr_db").unwrap().interval.unwrap();
        assert!(low <= f.named("psnr_db").unwrap().value && f.named("psnr_db").unwrap().value <= high && low < high);
        assert_eq!(f.named("frechet"), None);
    }

    #[test]
    fn equal_images_have_no_psnr_and_pictures_are_averaged_one_by_one() {
        let group = Group::CleanPictures;
        let mut equal = grasp("a", group, 0.0, 1.0);
        equal.angle_error_rad = None;
        let scores = |grasps| Scores { method: "m".into(), upper_bound: false, grasps, measured_features: Vec::new() };
        let one = row(&scores(vec![equal]), &[group], 10);
        assert!(one.groups[0].named("psnr_db").is_none() && one.groups[0].named("angle_deg").is_none());
        let mut pictures = vec![grasp("a", group, 0.1, 1.0), grasp("a", group, 0.01, 1.0)];
        pictures.iter_mut().for_each(|g| g.scale = Scale::Assumed);
        let two = row(&scores(pictures), &[group], 0);
        let psnr = two.groups[0].named("psnr_db").unwrap();
        assert!((psnr.value - 30.0).abs() < 1e-9 && psnr.interval.is_none());
    }

    #[test]
    fn groups_follow_the_tool_and_the_part_of_the_data() {
        let entry = |tool: &str, split| PairEntry { name: "x".into(), tool: Some(tool.into()), split, number: 0 };
        let of = |tool: &str, split| Group::of(&entry(tool, split), false, None);
        assert_eq!(of("pattern_31_rod", Split::Test), Group::SeenTools);
        assert_eq!(of("pattern_36", Split::Test), Group::UnseenTools);
        assert_eq!(of("pattern_36_on_shaft", Split::Test), Group::UnseenTools);
        assert_eq!(of("pattern_31_rod", Split::Train), Group::Training);
        assert_eq!(of("hammer", Split::Test), Group::Unknown);
        assert_eq!(Group::of(&entry("pattern_31_rod", Split::Train), true, None), Group::SeenTools);
        let picture = PairEntry { tool: None, ..entry("", Split::None) };
        assert_eq!(Group::of(&picture, false, Some(true)), Group::ClippedPictures);
        assert_eq!(Group::of(&picture, false, None), Group::Unknown);
    }
}
