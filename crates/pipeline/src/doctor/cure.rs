//! [`Cure`]: something that betters a data set or what is made of it.

use serde::Serialize;

use crate::io::dataset::ToolUnit;
use touch2touch_core::units::{counted, fixed, mm};

/// Something that a person can do about a fact, as a value: a button of the studio, a line of the command line.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "cure")]
pub enum Cure {
    /// Colors from the least to the greatest depth.
    FitRange {
        /// Depth of the first color, meters.
        min_m: f32,
        /// Depth of the last color, meters.
        max_m: f32,
    },
    /// A tool's CAD file read in a unit.
    ReadTool {
        /// The tool.
        tool: String,
        /// The unit.
        #[serde(serialize_with = "key_of")]
        unit: ToolUnit,
        /// The unit that the file beside it says now.
        replacing: Option<String>,
    },
    /// The data read otherwise than they are stored, as `doctor --set read-as=` takes it; empty: as they are stored.
    ReadAs {
        /// The readings, with commas.
        list: String,
    },
    /// The generator fitted to the pairs.
    Fit {
        /// The pairs.
        pairs: usize,
    },
    /// The mask model trained on masks from the CAD models at the true poses.
    TrainFromCad {
        /// The pairs.
        pairs: usize,
    },
    /// Every pair read and examined.
    Examine {
        /// The pairs.
        pairs: usize,
    },
}

fn key_of<S: serde::Serializer>(unit: &ToolUnit, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(unit.key())
}

impl Cure {
    /// The words on its button.
    pub fn name(&self) -> String {
        match self {
            Self::FitRange { .. } => "Fit the range".into(),
            Self::ReadTool { tool, unit, .. } => format!("Read {tool} in {}", unit.name()),
            Self::ReadAs { list } if list.is_empty() => "Read as stored".into(),
            Self::ReadAs { list } => format!("Read with {list}"),
            Self::Fit { pairs } => format!("Fit to {}", counted(*pairs, "pair")),
            Self::TrainFromCad { .. } => "Train on masks from CAD".into(),
            Self::Examine { pairs } => format!("Check all {}", counted(*pairs, "pair")),
        }
    }

    /// Effect, in words.
    pub fn tip(&self) -> String {
        match self {
            Self::FitRange { min_m, max_m } => {
                let [lo, hi] = [min_m, max_m].map(|m| fixed(mm(f64::from(*m)), 1));
                format!("Sets the colors of all panes to {lo}–{hi} mm instead of 0–18 mm")
            }
            Self::ReadTool { .. } => "Writes unit.txt beside the CAD model, so this has to be done only once".into(),
            Self::ReadAs { .. } => {
                "Writes read-as.txt into the data set and opens it again; the data files stay unchanged"
                    .into()
            }
            Self::Fit { .. } => {
                "Fits the generator to your pairs, scores it on pairs that were left out, and saves it as a new model that \
                 you can use"
                    .into()
            }
            Self::TrainFromCad { .. } => {
                "Trains the mask model on masks made from the CAD models at the true poses, and scores it on pairs that were \
                 left out. Your masks and review states stay as they are"
                    .into()
            }
            Self::Examine { .. } => "Reads every pair and lists what is wrong".into(),
        }
    }

    /// The same on the command line, PATH being the data set; `None` where the window alone has it.
    pub fn verb(&self) -> Option<String> {
        Some(match self {
            Self::FitRange { .. } => return None,
            Self::ReadTool { tool, unit, .. } => format!("touch2touch doctor PATH --set unit:{tool}={}", unit.key()),
            Self::ReadAs { list } => format!("touch2touch doctor PATH --set read-as={list}"),
            Self::Fit { .. } => "touch2touch adapt PATH --out FITTED".into(),
            Self::TrainFromCad { .. } => "touch2touch masks train PATH --from cad".into(),
            Self::Examine { .. } => "touch2touch doctor PATH".into(),
        })
    }
}
