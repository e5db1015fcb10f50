//! `touch2touch masks stats`: how far the labeling is, and what it took.

use clap::Args;
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::super::args::DatasetArgs;
use super::super::{Common, Output, VerbResult};
use touch2touch_work::label_stats::{Counts, Effort, LabelStats, label_stats};
use touch2touch_work::labels::{Labels, Review, system_person};
use touch2touch_work::repeats::Repeater;

/// Arguments of `masks stats`.
#[derive(Debug, Args)]
pub(in super::super) struct StatsArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Whose blind repeats are listed; else those of whom the system says.
    #[arg(long)]
    person: Option<String>,
    #[command(flatten)]
    common: Common,
}

/// Answer of `masks stats`.
#[derive(Serialize)]
struct Report {
    seconds_per_mask: Option<f64>,
    edits_per_mask: Option<f64>,
    #[serde(flatten)]
    stats: LabelStats,
}

pub(super) fn run(args: &StatsArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let output = Output::new(args.common, "reading", 1);
    let labels = Labels::of(&dataset);
    let reviews = labels.reviews();
    for problem in &reviews.problems {
        output.note(&format!("{}: {} ({})", problem.file.display(), problem.what, problem.hint));
    }
    let person = args.person.clone().or_else(system_person).unwrap_or_default();
    // Nothing is to come back here: that is for the studio.
    let stats = label_stats(&dataset, &labels, &reviews.states, Repeater { person: &person, share: 0.0 });
    for problem in &stats.problems {
        output.note(problem);
    }
    let complete = reviews.problems.is_empty() && stats.problems.is_empty();
    let effort = stats.effort;
    let report = Report { seconds_per_mask: effort.seconds_per_mask(), edits_per_mask: effort.edits_per_mask(), stats };
    output.finish(&report, || text(&report.stats))?;
    Ok(complete)
}

fn counts(counts: &Counts) -> String {
    Review::iter().map(|review| format!("{:>12}", counts.of(review))).collect()
}

fn effort(effort: Effort) -> String {
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.1}"));
    let (seconds, edits) = (number(effort.seconds_per_mask()), number(effort.edits_per_mask()));
    format!("masks {:>5}, {seconds:>6} s and {edits:>5} edits each", effort.masks)
}

fn text(stats: &LabelStats) -> String {
    let mut lines: Vec<String> =
        vec![Review::iter().map(|review| format!("{:>12}", review.name())).collect::<String>() + "  tool"];
    for tool in &stats.tools {
        lines.push(format!("{}  {}", counts(&tool.pairs), tool.tool.as_deref().unwrap_or("no tool")));
    }
    lines.push(format!("{}  all {} pairs", counts(&stats.all), stats.all.total()));
    lines.push(String::new());
    for (source, spent) in &stats.sources {
        lines.push(format!("{}  from {source}", effort(*spent)));
    }
    lines.push(format!("{}  in all", effort(stats.effort)));
    if !stats.deeds.is_empty() {
        let deeds: Vec<String> = stats.deeds.iter().map(|(deed, count)| format!("{count} x {deed}")).collect();
        lines.push(format!("edits: {}", deeds.join(", ")));
    }
    if !stats.repeats.masks.is_empty() {
        lines.push(String::new());
        lines.push(format!("{:>6} {:>6} {:>8} {:>13}  drawn twice", "IoU", "Dice", "edge mm", "seconds"));
    }
    for repeat in &stats.repeats.masks {
        let (a, [first, second]) = (&repeat.compared.agreement, repeat.seconds);
        let edge = a.edge_mm.map_or_else(|| "-".to_owned(), |mm| format!("{mm:.2}"));
        let (pair, finger) = (&repeat.compared.pair, &repeat.compared.finger);
        lines.push(format!(
            "{:6.3} {:6.3} {edge:>8} {:>13}  {pair}, {finger}",
            a.iou,
            a.dice,
            format!("{first}, {second}")
        ));
    }
    lines.join("\n")
}
