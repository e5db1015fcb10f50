//! `touch2touch masks propose`: masks proposed for many pairs at once.

use clap::Args;

use super::super::args::{DatasetArgs, LimitArgs, RegistrationParser, keyed};
use super::super::contact_mask::MaskArgs;
use super::super::recipe::ModelArgs;
use super::super::{Common, Output, ToolArgs, VerbResult};
use touch2touch_core::dataset::{PairEntry, PairId};
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::labels::filter::Filter;
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::masks::propose::{BatchSetup, ProposalSource, ProposeSetup, propose_all};

/// Arguments of `masks propose`.
#[derive(Debug, Args)]
pub(in super::super) struct ProposeArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Source of the proposals. `cad_hand` takes the poses that were set by hand and accepted.
    #[arg(long, default_value = ProposalSource::default().key(), value_parser = keyed::<ProposalSource>())]
    source: ProposalSource,
    /// The imprints that masks are proposed for.
    #[arg(long, default_value = ImprintSource::Measured.key(), value_parser = keyed::<ImprintSource>())]
    imprint: ImprintSource,
    /// Replace what was painted by hand as well. Pairs marked "done", "flagged" or "skip" stay as they are all the same.
    #[arg(long)]
    over_drawn: bool,
    /// Only pairs that answer to all these words, as in the studio's filter box: parts of name, tool or note, `tool:rod`,
    /// `is:todo`, `note:edge`, `has:note`.
    #[arg(long, value_name = "WORDS", default_value = "", hide_default_value = true)]
    filter: String,
    /// The registration of `cad_registered`.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = Registration::default(), value_parser = RegistrationParser)]
    registration: Registration,
    /// Who labels; else whom the system says.
    #[arg(long, value_name = "NAME")]
    person: Option<String>,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    tool: ToolArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    limit: LimitArgs,
    #[command(flatten)]
    common: Common,
}

pub(super) fn run(args: &ProposeArgs) -> VerbResult {
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let (filter, reviews) = (Filter::parse(&args.filter), Labels::of(&dataset).reviews());
    if !filter.conditions.is_empty() {
        anyhow::bail!("conditions on scores, such as angle>5, are for the studio; here are no scores to look at");
    }
    let is_meant = |entry: &PairEntry| {
        let note = reviews.notes.get(&entry.name).map_or("", String::as_str);
        filter.passes(entry, reviews.states.get(&entry.name).copied().unwrap_or_default(), note)
    };
    let meant: Vec<u32> = (0u32..).zip(&dataset.index.pairs).filter(|(_, e)| is_meant(e)).map(|(at, _)| at).collect();
    if meant.is_empty() {
        anyhow::bail!("no pair answers to \"{}\"; `touch2touch doctor` lists what the data set has", args.filter);
    }
    let pairs: Vec<PairId> = args.limit.spread(meant.len()).into_iter().map(|at| PairId(meant[at])).collect();
    let output = Output::new(args.common, "proposing", pairs.len());
    let models = args.model.models();
    let setup = BatchSetup {
        propose: ProposeSetup {
            source: args.source,
            recipe: args.model.posed(args.imprint, &dataset.rig, &args.mask, args.registration)?,
            pose: None,
        },
        pairs,
        over_drawn: args.over_drawn,
        person: args.person.clone(),
    };
    let found = propose_all(&dataset, &setup, &models, &output.job())?;
    for remark in &found.left_out {
        output.note(&format!("left out: {}: {}", remark.name, remark.why));
    }
    let complete = found.complete && found.left_out.is_empty();
    output.finish(&found, || found.text())?;
    Ok(complete)
}
