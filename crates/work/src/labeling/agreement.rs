//! Agreement between the masks of two people: [`compare_labels`].

use serde::Serialize;

use super::labels::Labels;
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use touch2touch_core::label::{Agreement, agreement};

const WHAT: &str = "Compare masks";

/// A mask that both drew.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// The pair's name.
    pub pair: String,
    /// The tool, where known.
    pub tool: Option<String>,
    /// The finger.
    pub finger: String,
    /// Agreement of the two masks.
    #[serde(flatten)]
    pub agreement: Agreement,
}

/// Two sets of masks.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Agreements {
    /// Masks of measured imprints that both drew, the worst first.
    pub masks: Vec<Compared>,
    /// Masks that only the first, and only the second drew.
    pub only: [usize; 2],
    /// Masks of different sizes, which cannot be compared.
    pub sizes: usize,
}

impl Agreements {
    /// Mean of something over all masks; `None` without any.
    fn mean(&self, of: impl Fn(&Agreement) -> Option<f64>) -> Option<f64> {
        let values: Vec<f64> = self.masks.iter().filter_map(|one| of(&one.agreement)).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// Mean IoU, mean Dice and mean distance of the edges (millimeters) of all masks that both drew.
    pub fn means(&self) -> [Option<f64>; 3] {
        [self.mean(|a| Some(a.iou)), self.mean(|a| Some(a.dice)), self.mean(|a| a.edge_mm)]
    }
}

/// Compares the masks of the measured imprints in two sets of labels of a data set.
///
/// # Errors
/// If a mask that both drew cannot be read, or the data set has no depth sensor.
pub fn compare_labels(dataset: &Dataset, a: &Labels, b: &Labels) -> Result<Agreements, TaskError> {
    if dataset.rig.depth().is_none() {
        return Err(TaskError::new(WHAT, "the data set has no depth sensor"));
    }
    let px_per_mm = dataset.rig.depth_px_per_mm();
    let [drawn_a, drawn_b] = [a, b].map(|labels| labels.masks().into_iter().collect::<std::collections::BTreeSet<_>>());
    let mut out = Agreements {
        only: [drawn_a.difference(&drawn_b).count(), drawn_b.difference(&drawn_a).count()],
        ..Agreements::default()
    };
    for entry in &dataset.index.pairs {
        let both: Vec<_> = dataset
            .rig
            .pads()
            .filter(|pad| [&drawn_a, &drawn_b].iter().all(|drawn| drawn.contains(&(entry.name.clone(), *pad))))
            .collect();
        if both.is_empty() {
            continue;
        }
        let (a, b) = (a.load(&entry.name)?, b.load(&entry.name)?);
        for pad in both {
            let (Some(a), Some(b)) = (a.measured(pad), b.measured(pad)) else { continue };
            match agreement(&a.mask, &b.mask, px_per_mm) {
                Some(agreement) => out.masks.push(Compared {
                    pair: entry.name.clone(),
                    tool: entry.tool.clone(),
                    finger: dataset.rig.pad_key(pad).into_owned(),
                    agreement,
                }),
                None => out.sizes += 1,
            }
        }
    }
    out.masks.sort_by(|a, b| a.agreement.iou.total_cmp(&b.agreement.iou));
    Ok(out)
}
