//! `touch2touch simulate`: a dataset in the lab's format, with its truth.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;
use strum::IntoEnumIterator;

use super::{Common, Output, VerbResult};
use crate::domain::sim::{self, Fault, SimConfig};
use crate::io::simulated::{self, Layout};

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
    #[arg(long, default_value_t = 46)]
    grasps: u32,
    /// Seed of grasps and noise: the same seed writes the same files.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Writes five touches with one known fault each (wrong CAD, foreign body, blank finger, straight rod, STL in
    /// millimetres) instead: to learn what each looks like in the studio.
    #[arg(long, conflicts_with_all = ["tools", "grasps", "seed"])]
    faults: bool,
    /// Which of the lab's layouts.
    #[arg(long, value_enum, default_value_t = Part::Test)]
    part: Part,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Part {
    /// `train/…/<tool folder>/data_N.pt`
    Train,
    /// `test/test_only/…/<tool>_data_N.pt`
    Test,
}

impl Part {
    fn layout(self) -> Layout {
        match self {
            Self::Train => Layout::Train,
            Self::Test => Layout::Test,
        }
    }
}

#[derive(Serialize)]
struct Written {
    out: PathBuf,
    pairs: usize,
    tools: Vec<String>,
    seed: u64,
    seconds: f64,
}

pub(super) fn run(args: &SimulateArgs) -> VerbResult {
    if args.faults {
        return write_faults(args);
    }
    let tools = chosen_tools(&args.tools)?;
    let start = std::time::Instant::now();
    let output = Output::new(args.common, "simulating", tools.len() * args.grasps as usize);
    let layout = args.part.layout();
    let models: Vec<_> = tools.iter().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect();
    simulated::write_tools(&args.out, &models)?;
    let config = SimConfig::default();
    for (t, tool) in tools.iter().enumerate() {
        for g in 0..args.grasps {
            // One seed per pair, so that a pair does not depend on how many others were asked for.
            let seed = args.seed.wrapping_mul(1_000_003) ^ ((t as u64) << 32) ^ u64::from(g);
            let sample = sim::simulate(tool, sim::random_grasp(seed), seed, &config);
            simulated::write_pair(&args.out, layout, &tool.name, u64::from(g), &sample)?;
            output.step(&tool.name);
        }
    }
    let written = Written {
        out: args.out.clone(),
        pairs: tools.len() * args.grasps as usize,
        tools: tools.iter().map(|t| t.name.clone()).collect(),
        seed: args.seed,
        seconds: start.elapsed().as_secs_f64(),
    };
    output.finish(&written, || {
        format!("{} pairs of {} tools in {}", written.pairs, written.tools.len(), written.out.display())
    })?;
    Ok(true)
}

#[derive(Serialize)]
struct WrittenFaults {
    out: PathBuf,
    /// What is wrong with each tool's touch.
    faults: BTreeMap<String, &'static str>,
}

/// One touch per fault, each under a tool of its own that is named after the fault.
fn write_faults(args: &SimulateArgs) -> VerbResult {
    let names: Vec<(Fault, String)> = Fault::iter().map(|f| (f, f.to_string())).collect();
    let output = Output::new(args.common, "simulating", names.len());
    let models: Vec<_> = names.iter().map(|(f, name)| (name.as_str(), false, f.mesh())).collect();
    simulated::write_tools(&args.out, &models)?;
    for (fault, name) in &names {
        simulated::write_pair(&args.out, args.part.layout(), name, 0, &fault.sample())?;
        output.step(name);
    }
    let faults = names.iter().map(|(f, name)| (name.clone(), f.what())).collect();
    let written = WrittenFaults { out: args.out.clone(), faults };
    output.finish(&written, || {
        let lines: Vec<String> = written.faults.iter().map(|(name, what)| format!("  {name}: {what}")).collect();
        format!("{} touches with a fault each in {}\n{}", lines.len(), written.out.display(), lines.join("\n"))
    })?;
    Ok(true)
}

/// The tools that a list names.
fn chosen_tools(list: &str) -> anyhow::Result<Vec<&'static sim::ToolSpec>> {
    let all = sim::tools();
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
