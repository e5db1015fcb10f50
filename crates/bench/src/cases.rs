//! `touch2touch-bench cases`: fresh known grasps from the built-in simulator.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;

use super::generator::timed_run;
use touch2touch::headless::{Common, Output, VerbResult, condition};
use touch2touch_bench::known::{self, Suite};
use touch2touch_core::rig::Rig;
use touch2touch_core::sim::Condition;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::infer::generator::Generator;
use touch2touch_pipeline::io::stl;
use touch2touch_pipeline::steps::bundles::{self, BundleKind};
use touch2touch_pipeline::steps::models::outside_of_pools;

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
    /// Fault of the pairs, as in the paper's Table I: matters to what is predicted from the GelSlims.
    #[arg(long, default_value = "plain", value_parser = condition())]
    condition: Condition,
    /// Bubbles of any size, pressed on 2 to 15 mm deep, in place of the nominal ones.
    #[arg(long)]
    any_depth: bool,
    /// Imprints that the generator predicts from the GelSlims in place of the measured ones.
    #[arg(long)]
    predicted: bool,
    /// The generator's bundle (default: the shipped one).
    #[arg(long, requires = "predicted")]
    bundle: Option<PathBuf>,
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
    if known::case_files(&args.out).is_ok() {
        anyhow::bail!("{} already holds cases: name a new folder", args.out.display());
    }
    let count = args.count as usize;
    let mut suite = Suite::new(count, args.seed).with_condition(args.condition);
    if args.any_depth {
        suite = suite.with_any_depth();
    }
    let generator = args.predicted.then(|| open(args.bundle.as_deref())).transpose()?.map(Mutex::new);
    let output = Output::new(args.common, "simulating", count);
    for (number, tool) in suite.tools().iter().enumerate() {
        stl::write(&known::tool_file(&args.out, number), &tool.mesh())?;
    }
    let digits = (count - 1).to_string().len().max(3);
    (0..count).into_par_iter().try_for_each(|i| {
        let (sample, mut case) = suite.felt(i);
        if let Some(generator) = &generator {
            let predict = || {
                let mut generator = generator.lock().unwrap_or_else(PoisonError::into_inner);
                let config = generator.spec().defaults;
                timed_run(&mut generator, &sample, &config)
            };
            (_, case.imprints) = outside_of_pools(predict)?;
            case.predicted = true;
        }
        output.step(&suite.tools()[case.tool].name);
        anyhow::Ok(known::write(&args.out.join(format!("case_{i:0digits$}.npz")), &case)?)
    })?;
    let written = Written {
        out: args.out.clone(),
        cases: count,
        tools: suite.tools().iter().map(|t| t.name.clone()).collect(),
        seed: args.seed,
        seconds: start.elapsed().as_secs_f64(),
    };
    output.finish(&written, || format!("{count} cases of {} tools in {}", suite.tools().len(), args.out.display()))?;
    Ok(true)
}

/// The generator that predicts.
fn open(bundle: Option<&Path>) -> anyhow::Result<Generator> {
    let available = bundles::find(&[]);
    let bundle = available.take(BundleKind::Generator, bundle, &Rig::lab())?.open("Open the generator")?;
    Ok(Generator::open(&bundle, EngineChoice::Auto)?)
}
