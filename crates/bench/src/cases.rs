//! `touch2touch-bench cases`: fresh known grasps from the built-in simulator.

use std::path::PathBuf;

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;

use touch2touch::headless::{Common, Output, VerbResult};
use touch2touch_work::io::cases;
use touch2touch_work::io::stl;

/// Arguments of `bench cases`.
#[derive(Debug, Args)]
pub(super) struct CasesArgs {
    /// New folder for `case_NNN.npz` and `tool_KK.stl`.
    #[arg(long)]
    out: PathBuf,
    /// Number of cases: 70 % nominal, 20 % hard, 10 % degenerate (straight tools).
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    count: u32,
    /// Seed of tools, poses, noise and masks.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Written {
    out: PathBuf,
    cases: usize,
    tools: Vec<String>,
    seed: u64,
    seconds: f64,
}

pub(super) fn run(args: &CasesArgs) -> VerbResult {
    let start = std::time::Instant::now();
    std::fs::create_dir_all(&args.out)
        .map_err(|err| anyhow::anyhow!("cannot make the folder {}: {err}", args.out.display()))?;
    // Cases of another seed among these would be measured as if they belonged to it.
    if cases::case_files(&args.out).is_ok() {
        anyhow::bail!("{} already holds cases: name a new folder", args.out.display());
    }
    let tools = cases::simulated_tools();
    let count = args.count as usize;
    let output = Output::new(args.common, "simulating", count);
    for (number, mesh) in cases::simulated_meshes().iter().enumerate() {
        stl::write(&cases::tool_file(&args.out, number), mesh)?;
    }
    let digits = (count - 1).to_string().len().max(3);
    (0..count).into_par_iter().try_for_each(|i| {
        let case = cases::simulated(i, count, args.seed, &tools);
        output.step(&tools[case.tool].name);
        cases::write(&args.out.join(format!("case_{i:0digits$}.npz")), &case)
    })?;
    let written = Written {
        out: args.out.clone(),
        cases: count,
        tools: tools.iter().map(|t| t.name.clone()).collect(),
        seed: args.seed,
        seconds: start.elapsed().as_secs_f64(),
    };
    output.finish(&written, || format!("{count} cases of {} tools in {}", tools.len(), args.out.display()))?;
    Ok(true)
}
