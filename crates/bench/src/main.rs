//! `touch2touch-bench`: time and error of the registration engines and of the generator, on known grasps, side by side; what
//! the verdict and the doctor find. None of it ships with the studio.

mod cases;
mod doctor;
mod figures;
mod front;
mod generator;
mod grasps;
mod json;
mod peers;
mod registration;
mod reliability;
mod rows;
mod shards;
mod training_data;
mod trials;
mod verdict;

use std::process::ExitCode;

use clap::Parser;
use glam::DVec3;
use serde::Serialize;
use touch2touch::headless::{VerbResult, program};
use touch2touch_core::cloud::{CloudError, lift};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::sample::DepthCamera;
use touch2touch_pipeline::io::program::Program;

/// Command line: the benchmark to run.
#[derive(Debug, Parser)]
#[command(
    name = "touch2touch-bench",
    version,
    about = "Benchmarks of Touch2Touch Studio",
    disable_help_subcommand = true
)]
enum Benchmark {
    /// Every registration engine, and Open3D and small_gicp where Python has them, on a folder of known grasps.
    Registration(registration::RegistrationArgs),
    /// Error against time of sampler, steps and engine of a generator, on simulated grasps.
    Generator(generator::GeneratorArgs),
    /// Write fresh known grasps of the built-in simulator, for `touch2touch-bench registration`.
    Cases(cases::CasesArgs),
    /// Number of data sets stored wrongly that the doctor names rightly, and of sound ones that it doubts.
    Doctor(doctor::DoctorArgs),
    /// Poses, answers and verdicts of grasps at any turn and place, and of the lab's.
    Grasps(grasps::GraspsArgs),
    /// Signs of a fault that need no truth (a wrong tool, swapped fingers, a turned camera), each as a detector.
    Verdict(verdict::VerdictArgs),
    /// Write training data for the networks: a data set or, with `simulator` as PATH, simulated touches, as shards that
    /// `training/` reads.
    TrainingData(Box<training_data::TrainingDataArgs>),
    /// Would a robot that goes by the poses put tools into holes, and a cup on a cup? On simulated grasps.
    Trials(trials::TrialsArgs),
}

fn main() -> ExitCode {
    // A bundle that does not ship is tried in a process of its own, which is this program again with the studio's verb.
    if std::env::args_os().nth(1).is_some_and(|word| word == "bundle") {
        return touch2touch::headless::main();
    }
    program(Program::executable(), || run(&Benchmark::parse())).into()
}

fn run(benchmark: &Benchmark) -> VerbResult {
    match benchmark {
        Benchmark::Registration(args) => registration::run(args),
        Benchmark::Generator(args) => generator::run(args),
        Benchmark::Grasps(args) => grasps::run(args),
        Benchmark::Cases(args) => cases::run(args),
        Benchmark::Doctor(args) => doctor::run(args),
        Benchmark::TrainingData(args) => training_data::run(args),
        Benchmark::Trials(args) => trials::run(args),
        Benchmark::Verdict(args) => verdict::run(args),
    }
}

/// The contact points of both fingers, one after the other, grasp frame, meters.
fn contact_points(
    imprints: &[DepthMap; 2],
    cameras: &[DepthCamera; 2],
    masks: &[Mask; 2],
) -> Result<Vec<DVec3>, CloudError> {
    let mut points = Vec::new();
    for ((imprint, camera), mask) in imprints.iter().zip(cameras).zip(masks) {
        points.extend(lift(imprint, camera, Some(mask))?.points);
    }
    Ok(points)
}

/// Machine and its load when the figures were taken: without it no time means anything.
#[derive(Clone, Debug, Serialize)]
struct Machine {
    /// The processor's name, where the system tells.
    cpu: Option<String>,
    /// Hardware threads that this process may use.
    threads: usize,
    /// Average number of runnable tasks in the last minute when the measurement began, where the system tells.
    load_1min: Option<f64>,
    /// `linux x86_64`.
    system: String,
    /// True where the program was built without optimization, which makes its times meaningless.
    debug_build: bool,
}

impl Machine {
    fn now() -> Self {
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let cpu = cpuinfo.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
        let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
        Self {
            cpu: cpu.map(|(_, name)| name.trim().to_owned()),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            load_1min: load.split(' ').next().and_then(|v| v.parse().ok()),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            debug_build: cfg!(debug_assertions),
        }
    }

    fn text(&self) -> String {
        format!(
            "{}, {} threads, load {}, {}{}",
            self.cpu.as_deref().unwrap_or("unknown processor"),
            self.threads,
            self.load_1min.map_or("unknown".into(), |l| format!("{l:.1}")),
            self.system,
            if self.debug_build { ", DEBUG BUILD: its times mean nothing" } else { "" }
        )
    }
}
