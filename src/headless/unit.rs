//! `touch2touch unit PATH`: which unit the CAD models of a data set are in, and a way to say it.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::args::DatasetArgs;
use super::{Common, Output, VerbResult};
use touch2touch_work::io::dataset::{Dataset, ToolUnit};
use touch2touch_work::tool::{load_tool, set_unit, units_of};

/// Arguments of `unit`.
#[derive(Debug, Args)]
pub(super) struct UnitArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Only this tool.
    #[arg(long, value_name = "NAME")]
    tool: Option<String>,
    /// Write the file unit.txt beside the tool's CAD model that says this unit: m, cm, mm, um or in. It is for all models
    /// of that folder; where they are in several units it says `auto`.
    #[arg(long, value_name = "UNIT", requires = "tool")]
    set: Option<ToolUnit>,
    /// Replace a unit.txt that says something else.
    #[arg(long, requires = "set")]
    replace: bool,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Fit {
    /// `mm`.
    unit: &'static str,
    /// Length of the tool then: `64.35 mm`.
    length: String,
}

#[derive(Serialize)]
struct Tool {
    name: String,
    /// True where its CAD model can be used as it is read now.
    usable: bool,
    /// The units in which it would be as large as a tool.
    fits: Vec<Fit>,
    /// Content of unit.txt.
    says: Option<String>,
    /// Why it cannot be used.
    problem: Option<String>,
}

#[derive(Serialize)]
struct Report {
    tools: Vec<Tool>,
    /// The file that was written or said it already.
    file: Option<PathBuf>,
    /// Word in that file.
    word: Option<String>,
}

/// Success: every CAD model that was looked at can be used.
pub(super) fn run(args: &UnitArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let mut names: BTreeSet<&str> = dataset.index.pairs.iter().filter_map(|pair| pair.tool.as_deref()).collect();
    if let Some(tool) = &args.tool {
        anyhow::ensure!(names.contains(tool.as_str()), "no pair is of the tool {tool:?}: there are {}", list(&names));
        names.retain(|name| name == tool);
    }
    let (mut file, mut word) = (None, None);
    if let (Some(tool), Some(unit)) = (&args.tool, args.set) {
        let says = if args.replace { units_of(&dataset, tool)?.says } else { None };
        let set = set_unit(&dataset, tool, unit, says.as_deref())?;
        if let Some(why) = set.not_written {
            anyhow::bail!("cannot write unit.txt: {why}; --tool-scale {} says it to one verb", unit.key());
        }
        (file, word) = (Some(set.file), Some(set.word));
    }
    let output = Output::new(args.common, "reading CAD models", names.len());
    let mut tools = Vec::new();
    for name in names {
        tools.push(examine(&dataset, name));
        output.step(name);
    }
    let done = tools.iter().all(|tool| tool.usable);
    let report = Report { tools, file, word };
    output.finish(&report, || text(&report))?;
    Ok(done)
}

fn list(names: &BTreeSet<&str>) -> String {
    names.iter().copied().collect::<Vec<_>>().join(", ")
}

fn examine(dataset: &Dataset, name: &str) -> Tool {
    let problem = load_tool(dataset, name).err().map(|err| err.to_string());
    let offer = units_of(dataset, name).ok();
    let fit = |(unit, length): &(ToolUnit, String)| Fit { unit: unit.key(), length: length.clone() };
    Tool {
        name: name.to_owned(),
        usable: problem.is_none(),
        fits: offer.iter().flat_map(|offer| offer.units.iter().map(fit)).collect(),
        says: offer.and_then(|offer| offer.says),
        problem,
    }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    if let (Some(file), Some(word)) = (&report.file, &report.word) {
        text += &format!("{} says {word}\n\n", file.display());
    }
    for tool in &report.tools {
        let fits: Vec<String> = tool.fits.iter().map(|fit| format!("{} ({} long)", fit.unit, fit.length)).collect();
        let fits = if fits.is_empty() { "no unit by its size".to_owned() } else { fits.join(", ") };
        let says = tool.says.as_ref().map_or(String::new(), |says| format!("; unit.txt says {says}"));
        text += &format!("{:<24} {} {fits}{says}\n", tool.name, if tool.usable { "usable " } else { "refused" });
        if let Some(problem) = &tool.problem {
            text += &format!("  {problem}\n");
        }
    }
    text
}
