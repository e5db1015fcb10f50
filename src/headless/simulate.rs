//! `touch2touch simulate`: a data set in the lab's format, with its truth.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde_json::json;
use strum::IntoEnumIterator;

use super::args::{at_least_one, keyed};
use super::{Common, Output, VerbResult};
use touch2touch_core::catalog::{self, ToolSpec};
use touch2touch_core::sim::{self, Condition, Fault, Sensors};
use touch2touch_pipeline::io::simulated::{Depths, Layout, Writing, write_depths};

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(super) struct SimulateArgs {
    /// The folder to write; created if missing.
    #[arg(long)]
    out: PathBuf,
    /// `all`, `seen`, `unseen`, or tool names separated by commas.
    #[arg(long, default_value = "all")]
    tools: String,
    /// Grasps per tool.
    #[arg(long, default_value_t = 46, value_parser = at_least_one::<u32>)]
    grasps: u32,
    /// Seed of grasps and noise: the same seed writes the same files.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the paper's test set instead: 46 grasps of each tool within the paper's grid, none of them
    /// trained on. The same as the built-in data set `test-set`, which needs no files.
    #[arg(long, conflicts_with_all = ["grasps", "seed", "faults", "part"])]
    test_set: bool,
    /// Condition of the pairs, as in the paper's Table I. ambiguous: the GelSlims close on the tool's bare shaft; mixed:
    /// every other pair does; misaligned: the bubbles grasp up to 8 mm away; noise: on the GelSlim image; turned: grasps over
    /// the full turn.
    #[arg(long, default_value = "plain", conflicts_with = "faults", value_parser = condition())]
    condition: Condition,
    /// Simulate with another pair of sensors, drawn by this seed as training draws them (default: the nominal pair).
    #[arg(long, value_name = "SEED", conflicts_with = "gelslims")]
    sensors: Option<u64>,
    /// Simulate with GelSlims in other colors and with other dots, drawn by this seed beyond what training draws.
    #[arg(long, value_name = "SEED")]
    gelslims: Option<u64>,
    /// Write five touches with one known fault each instead (wrong CAD, foreign body, blank finger, straight rod, STL in
    /// millimeters), to see how each looks in the studio.
    #[arg(long, conflicts_with_all = ["tools", "grasps", "seed", "sensors", "gelslims"])]
    faults: bool,
    /// Part of the lab's layout that it is written as: `train/...`, `test/test_only/...` or `test/train_only/...`; or its other
    /// form, `<tool>.pt` with GelSlims and the depth of their own gel.
    #[arg(long, visible_alias = "form", value_parser = keyed::<Layout>(), default_value = "test")]
    part: Layout,
    #[command(flatten)]
    common: Common,
}

/// Parser of the key of a condition.
pub fn condition() -> impl TypedValueParser<Value = Condition> {
    PossibleValuesParser::new(Condition::iter().map(|c| PossibleValue::new(c.key()).help(c.description())))
        .map(|key| key.parse().unwrap_or_default())
}

pub(super) fn run(args: &SimulateArgs) -> VerbResult {
    let own_depth = args.part == Layout::GelslimDepth;
    if own_depth && (args.faults || args.test_set || args.condition != Condition::Plain) {
        anyhow::bail!("the form gelslim-depth has neither --faults nor --test-set nor --condition");
    }
    if args.faults {
        return write_faults(args);
    }
    let chosen = chosen_tools(&args.tools)?;
    let start = std::time::Instant::now();
    let grasps = if args.test_set { sim::TEST_GRASPS } else { args.grasps.into() };
    let output = Output::new(args.common, "simulating", chosen.len() * grasps as usize);
    let sensors = Sensors::named(args.sensors, args.gelslims).map_err(anyhow::Error::msg)?;
    let config = sensors.config();
    // A condition gives at most two forms of a tool, one to even pairs and one to odd ones.
    let models: BTreeMap<String, ToolSpec> = chosen
        .iter()
        .flat_map(|tool| (0..grasps.min(2)).map(|g| args.condition.tool(tool, g)))
        .map(|tool| (tool.name.clone(), tool))
        .collect();
    let tools: Vec<_> = models.values().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect();
    let pairs = chosen.len() * grasps as usize;
    // In the order of the list: it decides the seeds.
    let order: Vec<&str> = chosen.iter().map(|tool| tool.name.as_str()).collect();
    let mut recipe = json!({
        "tools": order, "condition": args.condition, "grasps": grasps, "seed": (!args.test_set).then_some(args.seed),
        "test_set": args.test_set,
    });
    // Folders that were written before there were others name none.
    if sensors != Sensors::Nominal {
        recipe["sensors"] = json!(sensors);
    }
    let writing = Writing::begin(&args.out, args.part, &tools, pairs, recipe)?;
    for (t, tool) in chosen.iter().enumerate() {
        let mut depths = Depths::default();
        for g in 0..grasps {
            let touched = args.condition.tool(tool, g);
            let (grasp, seed) = if args.test_set {
                // By the place in the whole list, so that a choice of tools does not change their grasps.
                sim::test_grasp(catalog::tools().iter().position(|t| t.name == tool.name).unwrap_or(t), g)
            } else {
                // One seed per pair, so that a pair does not depend on how many others were asked for.
                let seed = args.seed.wrapping_mul(1_000_003) ^ ((t as u64) << 32) ^ g;
                (sim::random_grasp(seed), seed)
            };
            if own_depth {
                depths.push(tool, grasp, seed, &config);
            } else {
                let sample = args.condition.simulate(&touched, grasp, seed, &config);
                writing.pair(&touched.name, g, &sample)?;
            }
            output.step(&touched.name);
        }
        if own_depth {
            write_depths(&args.out, &tool.name, depths)?;
        }
    }
    writing.finish()?;
    // The test set's seeds are its own.
    let written = json!({
        "out": args.out, "pairs": pairs, "tools": models.keys().collect::<Vec<_>>(), "condition": args.condition,
        "sensors": sensors, "seed": (!args.test_set).then_some(args.seed), "seconds": start.elapsed().as_secs_f64(),
    });
    output.finish(&written, || format!("{pairs} pairs of {} tools in {}", models.len(), args.out.display()))?;

    Ok(true)
}

/// One touch per fault, each under a tool of its own that is named after the fault.
fn write_faults(args: &SimulateArgs) -> VerbResult {
    let names: Vec<(Fault, String)> = Fault::iter().map(|f| (f, f.to_string())).collect();
    let output = Output::new(args.common, "simulating", names.len());
    let models: Vec<_> = names.iter().map(|(f, name)| (name.as_str(), false, f.mesh())).collect();
    let recipe = json!({"faults": true});
    let writing = Writing::begin(&args.out, args.part, &models, names.len(), recipe)?;
    for (fault, name) in &names {
        writing.pair(name, 0, &fault.sample())?;
        output.step(name);
    }
    writing.finish()?;
    let faults: BTreeMap<&String, &str> = names.iter().map(|(f, name)| (name, f.what())).collect();
    output.finish(&json!({"out": args.out, "faults": faults}), || {
        let lines: Vec<String> = faults.iter().map(|(name, what)| format!("  {name}: {what}")).collect();
        format!("{} touches with a fault each in {}\n{}", lines.len(), args.out.display(), lines.join("\n"))
    })?;

    Ok(true)
}

/// The tools that a list names.
fn chosen_tools(list: &str) -> anyhow::Result<Vec<&'static ToolSpec>> {
    let all = catalog::tools();
    Ok(match list {
        "all" => all.iter().collect(),
        "seen" => all.iter().filter(|t| t.seen).collect(),
        "unseen" => all.iter().filter(|t| !t.seen).collect(),
        names => names
            .split(',')
            .map(|name| {
                all.iter().find(|t| t.name == name.trim()).ok_or_else(|| {
                    let known: Vec<&str> = all.iter().map(|t| t.name.as_str()).collect();
                    anyhow::anyhow!("no tool is named {name:?}; there are: {}", known.join(", "))
                })
            })
            .collect::<anyhow::Result<_>>()?,
    })
}
