//! [`Column`]: the columns of the results table, each with what it is computed from.

use std::collections::BTreeMap;

use serde::ser::SerializeMap as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Estimate, GraspScore, Group, Metric, Row, angles, images, mean, psnr};
use crate::metrics::frechet_distance;
use crate::sample::Scale;
use crate::verdict::Grade;

/// A column of the table.
pub struct Column {
    /// With the unit.
    pub heading: &'static str,
    /// The meaning, in a line.
    pub tip: &'static str,
    /// Digits after the point.
    pub decimals: usize,
    /// True where more of it is better.
    pub larger_is_better: bool,
    /// The name in files.
    pub key: &'static str,
    /// The figure of a group.
    pub(super) of: Of,
}

/// Reduction of a group's grasps to its figure.
pub(super) enum Of {
    /// Of each tool's grasps, then the mean over the tools, with an interval.
    Tool(fn(&[&GraspScore]) -> Option<f64>),
    /// Of all grasps; beside them what the classifier sees of the measured imprints.
    Group(fn(&[&GraspScore], &[&[f32]]) -> Option<f64>),
}

/// The columns of a group, in the paper's order.
pub(super) static COLUMNS: &[Column] = &[
    tenths("PSNR dB", "psnr_db", "Against the measured imprint, decibels; peak 22.5 mm", |tool| {
        psnr(tool, |image| Some(image.error))
    }),
    tenths(
        "clean dB",
        "psnr_noise_free_db",
        "PSNR against the simulator's imprint before camera noise, decibels",
        |tool| psnr(tool, |image| image.noise_free),
    ),
    hundredths("SSIM", "ssim", "Structural similarity; range of the tool's predictions (the lab's)", |tool| {
        mean(images(tool).filter_map(|i| i.ssim))
    }),
    Column {
        heading: "FD",
        key: "frechet",
        tip: "Fréchet distance in the features of the tool classifier: not to be compared with a published FID",
        decimals: 2,
        larger_is_better: false,
        of: Of::Group(|grasps, measured| frechet_distance(&features(grasps), measured)),
    },
    Column {
        heading: "angle °",
        key: "angle_deg",
        tip: "Mean error of the in-hand angle, degrees, of the grasps that have a pose",
        decimals: 1,
        larger_is_better: false,
        of: Of::Tool(|tool| angles(tool)?.mean_deg),
    },
    tenths("≤5° %", "success_5", "Share of grasps within 5 degrees, percent", |tool| Some(angles(tool)?.success_5)),
    tenths("≤10° %", "success_10", "Share of grasps within 10 degrees, percent", |tool| {
        Some(angles(tool)?.success_10)
    }),
    Column {
        heading: "place mm",
        key: "position_mm",
        tip: "Mean distance of the tool's estimated place in the hand from the true one, millimeters",
        decimals: 2,
        larger_is_better: false,
        of: Of::Tool(|tool| mean(tool.iter().filter_map(|g| g.position_error_m)).map(|m| m * 1e3)),
    },
    hundredths(
        "IoU",
        "mask_iou",
        "Intersection over union of contact masks with the simulator's true contact",
        |tool| mean(images(tool).filter_map(|i| i.mask_iou)),
    ),
    tenths(
        "good %",
        "verdict_good",
        "Share of grasps whose pose the verdict calls good, without the truth, percent",
        |tool| mean(tool.iter().filter_map(|g| g.verdict).map(|grade| if grade == Grade::Good { 100.0 } else { 0.0 })),
    ),
];

impl Column {
    /// The figure of a single grasp; `None` for a column that only a group has.
    pub fn of_grasp(&self, grasp: &GraspScore) -> Option<f64> {
        match self.of {
            Of::Tool(of) => of(&[grasp]),
            Of::Group(_) => None,
        }
    }

    /// The metric of a grasp that the column averages, by which pairs can be sorted.
    pub fn metric(&self) -> Option<Metric> {
        match self.key {
            "psnr_db" => Some(Metric::Psnr),
            "psnr_noise_free_db" => Some(Metric::PsnrNoiseFree),
            "ssim" => Some(Metric::Ssim),
            "angle_deg" => Some(Metric::Angle),
            "verdict_good" => Some(Metric::Verdict),
            _ => None,
        }
    }
}

/// The features of the images that have some.
fn features<'a>(grasps: &'a [&GraspScore]) -> Vec<&'a [f32]> {
    images(grasps).map(|i| i.features.as_slice()).filter(|f| !f.is_empty()).collect()
}

type OfTool = fn(&[&GraspScore]) -> Option<f64>;

const fn tenths(heading: &'static str, key: &'static str, tip: &'static str, of: OfTool) -> Column {
    Column { heading, tip, decimals: 1, larger_is_better: true, key, of: Of::Tool(of) }
}

const fn hundredths(heading: &'static str, key: &'static str, tip: &'static str, of: OfTool) -> Column {
    Column { decimals: 2, ..tenths(heading, key, tip, of) }
}

/// The figures of one method in one column group. A column without one cannot be there, as the notes say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableMetrics {
    /// The column group.
    pub group: Group,
    /// Tools averaged over.
    pub tools: usize,
    /// Grasps.
    pub grasps: usize,
    /// Images (fingers).
    pub images: usize,
    /// Grasps without a pose: failures.
    pub without_pose: usize,
    /// By the column's name in files.
    #[serde(flatten, serialize_with = "by_column", deserialize_with = "of_columns")]
    pub figures: BTreeMap<&'static str, Estimate>,
}

impl TableMetrics {
    /// The figure of a column.
    pub fn get(&self, column: &Column) -> Option<Estimate> {
        self.named(column.key)
    }

    /// The figure of the column that files call so.
    pub fn named(&self, key: &str) -> Option<Estimate> {
        self.figures.get(key).copied()
    }
}

/// Every column by name, null without a figure; those of a whole group, which have no interval, as plain numbers.
fn by_column<S: Serializer>(figures: &BTreeMap<&'static str, Estimate>, to: S) -> Result<S::Ok, S::Error> {
    let mut map = to.serialize_map(Some(COLUMNS.len()))?;
    for column in COLUMNS {
        let figure = figures.get(column.key);
        match column.of {
            Of::Tool(_) => map.serialize_entry(column.key, &figure)?,
            Of::Group(_) => map.serialize_entry(column.key, &figure.map(|e| e.value))?,
        }
    }
    map.end()
}

/// The figures that [`by_column`] wrote.
fn of_columns<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeMap<&'static str, Estimate>, D::Error> {
    let mut written = BTreeMap::<String, serde_json::Value>::deserialize(from)?;
    let figure = |column: &Column| {
        let written = written.remove(column.key)?;
        let plain = written.as_f64().map(|value| Estimate { value, interval: None });
        Some((column.key, plain.or_else(|| serde_json::from_value(written).ok())?))
    };
    Ok(COLUMNS.iter().filter_map(figure).collect())
}

/// The columns that some row fills.
pub fn columns(rows: &[Row]) -> Vec<&'static Column> {
    COLUMNS.iter().filter(|column| rows.iter().flat_map(|r| &r.groups).any(|f| f.get(column).is_some())).collect()
}

/// Notes on the meaning of the columns, a line each.
pub const NOTES: [&str; 5] = [
    "each figure per tool, then the mean over the tools; intervals: 95 %, bootstrap over the grasps",
    "clean: against the simulator's imprint before camera noise, which no generator can know; the row of the measured \
     imprints says how much that noise costs",
    "FD: Fréchet distance in the features of the tool classifier, predicted against measured imprints of the group; it \
     cannot be compared with a published FID, nor between groups of different size",
    "angle: error of the in-hand angle from both fingers' contact; without a pose a grasp fails and is in no mean",
    "place: of the grasps that have a pose; IoU: of the contact masks of both fingers, against the simulator's true contact",
];

/// Conventions of PSNR and SSIM.
pub fn conventions(scale: Scale) -> &'static str {
    match scale {
        Scale::Measured => {
            "PSNR: squared error pooled over a tool's images, peak 22.5 mm; SSIM: 11 x 11 window, zero padding, range of \
             the tool's predictions (the lab's conventions); against the measured imprint"
        }
        Scale::Assumed => {
            "PSNR and SSIM: each image stretched to 0..1 on its own, peak and range 1, then the mean (the source lost \
             its scale); angles, where the tools are named: from the pose of the measured imprint, with an assumed camera"
        }
    }
}
