//! `touch2touch doctor PATH --set NAME=VALUE`: what is said of a data set for good, by a file beside its data.

use std::path::PathBuf;
use std::str::FromStr;

use serde::Serialize;
use serde_json::json;

use super::super::VerbResult;
use super::super::args::DatasetArgs;
use touch2touch_core::read_as::{ReadAs, parse_list};
use touch2touch_pipeline::doubts::read_otherwise;
use touch2touch_pipeline::io::dataset::{Dataset, ToolUnit};
use touch2touch_pipeline::steps::tool::{set_unit, units_of};

/// Something to say of a data set.
#[derive(Debug, Clone)]
pub(super) enum Setting {
    /// Readings other than as it is stored; none: as it is stored.
    ReadAs(Vec<ReadAs>),
    /// The unit of a tool's CAD model.
    Unit { tool: String, unit: ToolUnit },
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let named = text.split_once('=').map(|(name, value)| (name, name.strip_prefix("unit:"), value));
        match named {
            Some(("read-as", _, list)) => parse_list(list).map(Self::ReadAs),
            Some((_, Some(tool), unit)) => Ok(Self::Unit { tool: tool.to_owned(), unit: unit.parse()? }),
            _ => Err("say read-as=LIST, such as read-as=swap-fingers, or unit:TOOL=UNIT, such as unit:cup=mm".into()),
        }
    }
}

#[derive(Serialize)]
struct Said {
    /// The file that says it; `null` where the data are read as they are stored.
    file: Option<PathBuf>,
    /// Word in that file.
    word: String,
    /// Mistakes in the stored data that the readings mend.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    because: Vec<String>,
}

impl Setting {
    fn say(&self, dataset: &Dataset) -> anyhow::Result<Said> {
        match self {
            Self::ReadAs(read_as) => {
                let file = Some(read_otherwise(dataset, read_as)?).filter(|_| !read_as.is_empty());
                let keys: Vec<String> = read_as.iter().map(ToString::to_string).collect();
                let because = read_as.iter().map(|reading| reading.mistake()).collect();
                Ok(Said { file, word: keys.join(","), because })
            }
            Self::Unit { tool, unit } => {
                let known = dataset.index.pairs.iter().any(|pair| pair.tool.as_deref() == Some(tool));
                anyhow::ensure!(known, "no pair is of the tool {tool:?}");
                let set = set_unit(dataset, tool, *unit, units_of(dataset, tool)?.says.as_deref())?;
                if let Some(why) = set.not_written {
                    anyhow::bail!("cannot write unit.txt: {why}");
                }
                Ok(Said { file: Some(set.file), word: set.word, because: Vec::new() })
            }
        }
    }
}

/// Says it all, in order.
pub(super) fn run(args: &DatasetArgs, settings: &[Setting]) -> VerbResult {
    let dataset = args.open()?;
    let set = settings.iter().map(|setting| setting.say(&dataset)).collect::<anyhow::Result<Vec<Said>>>()?;
    args.output("writing", 1).finish(&json!({"set": set}), || {
        let line = |said: &Said| match &said.file {
            Some(file) if said.because.is_empty() => format!("{} says {}\n", file.display(), said.word),
            Some(file) => format!("{} says {}, because {}\n", file.display(), said.word, said.because.join(" and ")),
            None => "read as it is stored\n".to_owned(),
        };
        set.iter().map(line).collect()
    })?;
    Ok(true)
}
