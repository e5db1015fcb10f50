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
            Self::TrainFromCad { .. } => "Masks from CAD, and train".into(),
            Self::Examine { pairs } => format!("Examine {}", counted(*pairs, "pair")),
        }
    }

    /// Effect, in words.
    pub fn tip(&self) -> String {
        match self {
            Self::FitRange { min_m, max_m } => {
                let [lo, hi] = [min_m, max_m].map(|m| fixed(mm(f64::from(*m)), 1));
                format!("Colors go from {lo} to {hi} mm in all panes, instead of 0 to 18 mm")
            }
            Self::ReadTool { .. } => "Writes unit.txt beside the CAD model, which says so for good".into(),
            Self::ReadAs { .. } => {
                "Writes read-as.txt into the data set, which says so for good, and opens it again; the files stay as \
                 they are"
                    .into()
            }
            Self::Fit { .. } => {
                "Fits the generator to the pairs in closed form, scores it on pairs that were left out, and writes a new \
                 bundle that can be taken into use"
                    .into()
            }
            Self::TrainFromCad { .. } => {
                "Makes masks from the CAD models at the true poses, trains the mask model on them, and scores it on \
                 pairs that were left out. No mask of yours is touched, no pair is marked"
                    .into()
            }
            Self::Examine { .. } => "Reads every pair and lists what is wrong with it".into(),
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
