//! [`Column`]: the columns of the results table, each with what it is computed from.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::ser::{SerializeMap as _, Serializer};

use super::{Estimate, GraspScore, Group, ImageScore, Row, angles, images, mean, psnr, psnr_of};
use crate::metrics::{frechet_distance, frechet_extrapolated};
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
    /// Printed by the paper as well.
    pub(super) in_paper: bool,
    /// The name in files.
    pub(super) key: &'static str,
    /// The figure of a group.
    pub(super) of: Of,
}

/// Reduction of a group's grasps to its figure.
pub(super) enum Of {
    /// Of each tool's grasps, then the mean over the tools, with an interval.
    Tool(fn(&[&GraspScore]) -> Option<f64>),
    /// Of all grasps; beside them what the classifier sees of the measured imprints.
    Group(fn(&[&GraspScore], &[&[f32]]) -> Option<f64>),
    /// Read in publications only.
    Published,
}

/// Names in files of the Fréchet distance by our features, and by those of an image network.
pub(super) const FRECHET: &str = "frechet";
pub(super) const FID: &str = "fid";

/// The columns of a group, in the paper's order.
pub(super) static COLUMNS: &[Column] = &[
    Column {
        in_paper: true,
        ..db("PSNR dB", "psnr_db", "Against the measured imprint, decibels; peak 22.5 mm", |tool| {
            psnr(tool, |image| Some(image.error))
        })
    },
    db(
        "each dB",
        "psnr_each_db",
        "PSNR of each image, then the mean, as scikit-image has it with the data range 22.5 mm, decibels",
        |tool| mean(measured(tool).filter_map(|i| psnr_of(i.error))),
    ),
    db(
        "clean dB",
        "psnr_noise_free_db",
        "PSNR against the simulator's imprint before camera noise, decibels",
        |tool| psnr(tool, |image| image.noise_free),
    ),
    Column {
        in_paper: true,
        ..ssim("SSIM", "ssim", "Structural similarity; range of the tool's predictions (the lab's)", |tool| {
            mean(images(tool).filter_map(|i| i.ssim))
        })
    },
    db(
        "raw dB",
        "psnr_raw_db",
        "PSNR of pictures as they are, in the assumed meters and not stretched to 0..1, decibels",
        |tool| mean(images(tool).filter_map(|i| i.unstretched?.psnr_raw_db)),
    ),
    ssim("raw SSIM", "ssim_raw", "Structural similarity of pictures as they are", |tool| {
        mean(images(tool).filter_map(|i| i.unstretched?.ssim_raw))
    }),
    db(
        "line dB",
        "psnr_line_db",
        "PSNR of pictures after the straight line that fits best: the worth of the shape alone, decibels",
        |tool| mean(images(tool).filter_map(|i| i.unstretched?.psnr_line_db)),
    ),
    ssim("SSIM 22.5", "ssim_peak", "Structural similarity with the range 22.5 mm", |tool| {
        mean(images(tool).filter_map(|i| i.ssim_peak))
    }),
    ssim(
        "SSIM std",
        "ssim_standard",
        "Structural similarity without the border, as scikit-image has it with Gaussian weights and the data range 22.5 mm",
        |tool| mean(images(tool).filter_map(|i| i.ssim_standard)),
    ),
    ssim(
        "clean SSIM",
        "ssim_noise_free",
        "SSIM against the simulator's imprint before camera noise, range of the tool's predictions",
        |tool| mean(images(tool).filter_map(|i| i.ssim_noise_free)),
    ),
    Column {
        heading: "FD",
        key: FRECHET,
        tip: "Fréchet distance in the features of the tool classifier: not to be compared with a published FID",
        decimals: 2,
        larger_is_better: false,
        in_paper: true,
        of: Of::Group(|grasps, measured| frechet_distance(&features(grasps), measured)),
    },
    Column {
        heading: "FD ∞",
        key: "frechet_extrapolated",
        tip: "The same for infinitely many images: a straight line in one over their number, followed to 0",
        decimals: 2,
        larger_is_better: false,
        in_paper: false,
        of: Of::Group(|grasps, measured| frechet_extrapolated(&features(grasps), measured)),
    },
    Column {
        heading: "FD N",
        key: "frechet_images",
        tip: "Number of images that the Fréchet distance is of, on each side",
        decimals: 0,
        larger_is_better: true,
        in_paper: false,
        of: Of::Group(|grasps, measured| {
            let count = features(grasps).len().min(measured.len());
            (count > 0).then_some(count as f64)
        }),
    },
    Column {
        heading: "FID",
        key: FID,
        tip: "Fréchet distance in the features of an image network: as published, or of the extractor that was named",
        decimals: 1,
        larger_is_better: false,
        in_paper: true,
        of: Of::Published,
    },
    Column {
        heading: "angle °",
        key: "angle_deg",
        tip: "Mean error of the in-hand angle, degrees, of the grasps that have a pose",
        decimals: 1,
        larger_is_better: false,
        in_paper: true,
        of: Of::Tool(|tool| angles(tool)?.mean_deg),
    },
    Column {
        in_paper: true,
        ..percent("≤5° %", "success_5", "Share of grasps within 5 degrees, percent", |tool| {
            Some(angles(tool)?.success_5)
        })
    },
    Column {
        in_paper: true,
        ..percent("≤10° %", "success_10", "Share of grasps within 10 degrees, percent", |tool| {
            Some(angles(tool)?.success_10)
        })
    },
    Column {
        heading: "place mm",
        key: "position_mm",
        tip: "Mean distance of the tool's estimated place in the hand from the true one, millimeters",
        decimals: 2,
        larger_is_better: false,
        in_paper: false,
        of: Of::Tool(|tool| mean(tool.iter().filter_map(|g| g.position_error_m)).map(|m| m * 1e3)),
    },
    ssim("IoU", "mask_iou", "Intersection over union of contact masks with the simulator's true contact", |tool| {
        mean(images(tool).filter_map(|i| i.mask_iou))
    }),
    percent(
        "good %",
        "verdict_good",
        "Share of grasps whose pose the verdict calls good, without the truth, percent",
        |tool| mean(tool.iter().filter_map(|g| g.verdict).map(|grade| if grade == Grade::Good { 100.0 } else { 0.0 })),
    ),
    percent("tool %", "tool_accuracy", "Share of imprints whose tool the classifier names, percent", |tool| {
        mean(images(tool).filter_map(|i| i.tool_right).map(|right| if right { 100.0 } else { 0.0 }))
    }),
    Column {
        heading: "s/image",
        key: "seconds",
        tip: "Median time to generate an image, seconds",
        decimals: 3,
        larger_is_better: false,
        in_paper: false,
        of: Of::Group(|grasps, _| {
            let mut seconds: Vec<f64> = grasps.iter().filter_map(|g| g.seconds).collect();
            seconds.sort_by(f64::total_cmp);
            let n = seconds.len();
            (n > 0).then(|| 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]))
        }),
    },
];

/// The features of the images that have some.
fn features<'a>(grasps: &'a [&GraspScore]) -> Vec<&'a [f32]> {
    images(grasps).map(|i| i.features.as_slice()).filter(|f| !f.is_empty()).collect()
}

/// The images whose scale was measured.
fn measured<'a>(tool: &'a [&GraspScore]) -> impl Iterator<Item = &'a ImageScore> {
    tool.iter().filter(|grasp| grasp.scale == Scale::Measured).flat_map(|grasp| &grasp.images)
}

type OfTool = fn(&[&GraspScore]) -> Option<f64>;

const fn db(heading: &'static str, key: &'static str, tip: &'static str, of: OfTool) -> Column {
    Column { heading, tip, decimals: 1, larger_is_better: true, in_paper: false, key, of: Of::Tool(of) }
}

const fn ssim(heading: &'static str, key: &'static str, tip: &'static str, of: OfTool) -> Column {
    Column { decimals: 2, ..db(heading, key, tip, of) }
}

const fn percent(heading: &'static str, key: &'static str, tip: &'static str, of: OfTool) -> Column {
    db(heading, key, tip, of)
}

/// The figures of one method in one column group. A column without one cannot be there, as the notes say.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    #[serde(flatten, serialize_with = "by_column")]
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
            Of::Group(_) | Of::Published => map.serialize_entry(column.key, &figure.map(|e| e.value))?,
        }
    }
    map.end()
}

/// The columns that some row fills.
pub fn columns(rows: &[Row]) -> Vec<&'static Column> {
    COLUMNS.iter().filter(|column| rows.iter().flat_map(|r| &r.groups).any(|f| f.get(column).is_some())).collect()
}

/// Notes on the meaning of the columns, a line each.
pub const NOTES: [&str; 9] = [
    "each figure per tool, then the mean over the tools; intervals: 95 %, bootstrap over the grasps",
    "each, SSIM std: the standard conventions, those of scikit-image with the data range 22.5 mm: PSNR of each image and \
     then the mean, SSIM without the border; beside them the lab's",
    "clean: against the simulator's imprint before camera noise, which no generator can know; the row of the measured \
     imprints says how much that noise costs",
    "raw, line: of pictures whose scale was assumed, as they are and after the straight line that fits best; PSNR itself \
     stretches both pictures to 0..1, where no noise-free picture passes 20 dB",
    "FD: Fréchet distance in the features of the tool classifier, predicted against measured imprints of the group; it \
     cannot be compared with a published FID, nor between groups of different size",
    "FID: Fréchet distance in the features of an image network: published ones are of Inception",
    "angle: error of the in-hand angle from both fingers' contact; without a pose a grasp fails and is in no mean",
    "place: of the grasps that have a pose; IoU: of the contact masks of both fingers, against the simulator's true contact",
    "tool: share of imprints whose tool the classifier names",
];

/// Conventions of PSNR and SSIM.
pub fn conventions(scale: Scale) -> &'static str {
    match scale {
        Scale::Measured => {
            "PSNR: squared error pooled over a tool's images, peak 22.5 mm; SSIM: 11 x 11 window, zero padding, range of \
             the tool's predictions (the lab's conventions), and with the range 22.5 mm; against the measured imprint"
        }
        Scale::Assumed => {
            "PSNR and SSIM: each image stretched to 0..1 on its own, peak and range 1, then the mean (the source lost \
             its scale); angles, where the tools are named: from the pose of the measured imprint, with an assumed camera"
        }
    }
}
