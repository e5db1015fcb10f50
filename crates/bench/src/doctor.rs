//! `touch2touch-bench doctor`: how surely a data set that is stored wrongly is told from a sound one, and what is wrong with
//! it.

mod kinds;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use strum::IntoEnumIterator as _;

use self::kinds::{Kind, Set, kinds, near};
use super::Machine;
use crate::json::JsonArgs;
use touch2touch::headless::RuntimeArg;
use touch2touch::headless::{Output, VerbResult};
use touch2touch_bench::known::{Case, CaseSet};
use touch2touch_core::catalog::{ToolSpec, tools};
use touch2touch_core::doubt::{Doubt, PairInput, judge, worth};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::read_as::ReadAs;
use touch2touch_core::rig::{Rig, lab};
use touch2touch_core::sample::{DepthTouch, Sample};
use touch2touch_core::sim::{Condition, SimConfig, random_grasp};
use touch2touch_pipeline::doubts::{Generator, PAIRS, placed};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::bundles::{self, BundleKind};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::predict::Generating;

/// Arguments of `bench doctor`.
#[derive(Debug, Args)]
pub(super) struct DoctorArgs {
    /// Pairs in a data set.
    #[arg(long, default_value_t = PAIRS as u32, value_parser = clap::value_parser!(u32).range(1..=200))]
    pairs: u32,
    /// Data sets that are spoilt in each way, each of other tools and grasps.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    sets: u32,
    /// Sound data sets of each condition.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=1000))]
    sound: u32,
    /// Sound sets of this folder of cases too, which have no GelSlims.
    #[arg(long, value_name = "DIR")]
    cases: Option<PathBuf>,
    /// Only ways with this in their name.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Seed of grasps, noise and sensors.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Without predictions.
    #[arg(long)]
    no_generator: bool,
    /// Poses are not known.
    #[arg(long)]
    no_poses: bool,
    #[command(flatten)]
    runtime: RuntimeArg,
    #[command(flatten)]
    json: JsonArgs,
}

#[derive(Serialize)]
struct Row {
    /// Way in which it was stored.
    kind: String,
    sets: usize,
    /// Sets where that was said, and nothing else.
    named: usize,
    /// Sets where something was said.
    noticed: usize,
    /// Other causes that were named.
    otherwise: Vec<String>,
    /// Sets whose poses are worse when they are read as was said.
    worsened: usize,
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    pairs: u32,
    spoilt: Vec<Row>,
    /// Sets that are slightly off, and that no reading mends: named where nothing wrong was said.
    near: Vec<Row>,
    sound: Vec<Row>,
    /// Of all spoilt sets, those that were named rightly, and those noticed.
    named_share: f64,
    noticed_share: f64,
    /// Sound sets, and those of which something was said.
    sound_sets: usize,
    false_alarms: usize,
    /// Sets of any kind that are worse when they are read as was said.
    worsened: usize,
}

pub(super) fn run(args: &DoctorArgs) -> VerbResult {
    let machine = Machine::now();
    let meant = |kind: &Kind| args.only.as_ref().is_none_or(|text| kind.name.contains(text));
    let [kinds, near] = [kinds(), near()].map(|all| all.into_iter().filter(meant).collect::<Vec<Kind>>());
    let conditions = Condition::iter().count() * args.sound as usize;
    let all = (kinds.len() + near.len()) * args.sets as usize + conditions;
    let output = Output::new(args.json.common(), "judging", all);
    let models = Models::new(None);
    let bundle = (!args.no_generator).then(|| bundles::find(&[]).take(BundleKind::Generator, None, &Rig::lab()));
    let bundle = bundle.transpose()?;
    let config = bundle.as_ref().and_then(|bundle| Some(bundle.generator.as_ref()?.defaults));
    let generator: Option<Generator<'_>> = bundle
        .as_ref()
        .zip(config.as_ref())
        .map(|(bundle, config)| (&models, Generating { bundle, engine: args.runtime.choice(), config }));
    let judged = |kinds: &[Kind]| {
        let mut rows: Vec<Row> = kinds.iter().map(|kind| Row::new(&kind.name)).collect();
        for number in 0..args.sets {
            let sound = sound_set(args, Condition::Plain, number);
            rows.par_iter_mut().zip(kinds).for_each(|(row, kind)| {
                let set = kind.of(&sound);
                row.add(&set, &doubts(&set, generator), |doubt| kind.is(&doubt.cause));
                output.step(&kind.name);
            });
        }
        rows
    };
    let (spoilt, mut near) = (judged(&kinds), judged(&near));
    near.iter_mut().for_each(|row| row.named += row.sets - row.noticed);
    let mut sound: Vec<Row> = Vec::new();
    for condition in Condition::iter() {
        let mut row = Row::new(condition.key());
        let sets: Vec<(Set, Vec<Doubt>)> = (0..args.sound)
            .into_par_iter()
            .map(|number| {
                let set = sound_set(args, condition, number);
                let doubts = doubts(&set, generator);
                output.step(condition.key());
                (set, doubts)
            })
            .collect();
        sets.iter().for_each(|(set, doubts)| row.add(set, doubts, |_| false));
        sound.push(row);
    }
    if let Some(folder) = &args.cases {
        let mut row = Row::new(&folder.display().to_string());
        for set in sets_of_cases(folder, args.pairs as usize)? {
            row.add(&set, &doubts(&set, generator), |_| false);
        }
        sound.push(row);
    }
    let share = |of: fn(&Row) -> usize| {
        spoilt.iter().map(of).sum::<usize>() as f64 / spoilt.iter().map(|row| row.sets).sum::<usize>().max(1) as f64
    };
    let report = Report {
        machine,
        pairs: args.pairs,
        named_share: share(|row| row.named),
        noticed_share: share(|row| row.noticed),
        sound_sets: sound.iter().map(|row| row.sets).sum(),
        false_alarms: sound.iter().map(|row| row.noticed).sum(),
        worsened: spoilt.iter().chain(&near).chain(&sound).map(|row| row.worsened).sum(),
        spoilt,
        near,
        sound,
    };
    args.json.write(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(true)
}

impl Row {
    fn new(kind: &str) -> Self {
        Self { kind: kind.to_owned(), sets: 0, named: 0, noticed: 0, otherwise: Vec::new(), worsened: 0 }
    }

    fn add(&mut self, set: &Set, doubts: &[Doubt], right: impl Fn(&Doubt) -> bool) {
        self.sets += 1;
        self.noticed += usize::from(!doubts.is_empty());
        self.named += usize::from(!doubts.is_empty() && doubts.iter().all(&right));
        self.otherwise.extend(doubts.iter().filter(|doubt| !right(doubt)).map(|doubt| doubt.cause.key()));
        let cure: Vec<ReadAs> = doubts.iter().filter_map(Doubt::read_as).collect();
        if !cure.is_empty() {
            let mut read = set.clone();
            read.pairs.iter_mut().for_each(|(_, sample)| *sample = ReadAs::all(&cure, sample));
            let [before, after] = [set, &read].map(|set| with_felt(set, |felt| worth(felt, &set.tools)));
            self.worsened += usize::from(after.is_worse_than(&before));
        }
    }
}

/// A sound data set: every other one of other sensors than the nominal ones, each of other tools.
fn sound_set(args: &DoctorArgs, condition: Condition, number: u32) -> Set {
    let config = if number.is_multiple_of(2) {
        SimConfig::default()
    } else {
        SimConfig::randomised(args.seed + u64::from(number))
    };
    let all = tools();
    let mut set = Set { pairs: Vec::new(), tools: Default::default() };
    for index in 0..u64::from(args.pairs) {
        let pick = (index + u64::from(number) * u64::from(args.pairs)) as usize % all.len();
        let spec: ToolSpec = condition.tool(&all[pick], index);
        let seed = args.seed.wrapping_mul(0x9e37_79b9) ^ (u64::from(number) << 32) ^ index;
        let mut sample = condition.simulate(&spec, random_grasp(seed), seed, &config);
        if args.no_poses {
            sample.grasp_from_object = None;
        }
        set.tools.entry(spec.name.clone()).or_insert_with(|| spec.mesh());
        set.pairs.push((spec.name, sample));
    }
    set
}

/// Sets of so many cases each, one after the other.
fn sets_of_cases(folder: &Path, pairs: usize) -> anyhow::Result<Vec<Set>> {
    let CaseSet { cases, tools } = CaseSet::open(folder)?;
    let name = |tool: usize| format!("tool_{tool:02}");
    let tools: BTreeMap<String, TriMesh> = tools.into_iter().map(|(tool, mesh)| (name(tool), mesh)).collect();
    let pair = |(_, case): &(String, Case)| {
        let mut sample = Sample { grasp_from_object: Some(case.grasp_from_object), ..Sample::default() };
        for ((pad, imprint), camera) in sample.rig.pad_list().into_iter().zip(&case.imprints).zip(&case.cameras) {
            let touch = DepthTouch { imprint: imprint.clone(), camera: Some(camera.clone()), truth: None };
            sample.pads[pad].get_or_insert_default().set(lab::BUBBLE_ID, touch);
        }
        (name(case.tool), sample)
    };
    let sets = cases.chunks(pairs).map(|some| Set { pairs: some.iter().map(pair).collect(), tools: tools.clone() });
    Ok(sets.collect())
}

fn doubts(set: &Set, generator: Option<Generator<'_>>) -> Vec<Doubt> {
    with_felt(set, |felt| match generator {
        Some(generator) => {
            judge(felt, &set.tools, Some(&mut |samples| placed(samples, generator, &JobCx::unwatched())))
        }
        None => judge(felt, &set.tools, None),
    })
}

fn with_felt<T>(set: &Set, then: impl FnOnce(&[PairInput<'_>]) -> T) -> T {
    let count = set.pairs.len() as isize;
    let beside: Vec<_> = (0..count)
        .map(|at| move |on: isize| set.pairs[(at + on).rem_euclid(count) as usize].1.grasp_from_object)
        .collect();
    let felt = set.pairs.iter().zip(&beside);
    let felt = felt.map(|((tool, sample), beside)| PairInput { tool: Some(tool), sample, beside: Some(beside) });
    then(&felt.collect::<Vec<_>>())
}

fn text(report: &Report) -> String {
    let mut text = format!("{}\n{} pairs in each data set\n\n", report.machine.text(), report.pairs);
    let rows = |text: &mut String, rows: &[Row]| {
        for row in rows {
            let mut otherwise = row.otherwise.clone();
            otherwise.sort();
            otherwise.dedup();
            let said = if otherwise.is_empty() { String::new() } else { format!("  also: {}", otherwise.join(", ")) };
            let worse =
                if row.worsened > 0 { format!("  WORSE WITH THE CURE: {}", row.worsened) } else { String::new() };
            *text += &format!(
                "{:<66} {:>2} of {:>2} named, {:>2} noticed{worse}{said}\n",
                row.kind, row.named, row.sets, row.noticed
            );
        }
    };
    rows(&mut text, &report.spoilt);
    text += "\nslightly off, where no reading helps (named: nothing wrong was said)\n";
    rows(&mut text, &report.near);
    text += "\nsound, by condition\n";
    rows(&mut text, &report.sound);
    text += &format!(
        "\n{:.1} % of the spoilt sets are named rightly, {:.1} % noticed; {} of {} sound ones are doubted; {} sets \
         are worse when they are read as was said\n",
        100.0 * report.named_share,
        100.0 * report.noticed_share,
        report.false_alarms,
        report.sound_sets,
        report.worsened
    );
    text
}
