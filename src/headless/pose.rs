//! `touch2touch pose`: in-hand poses of a whole data set, with the error against the truth where it is known.

mod args;
mod report;

use std::collections::BTreeMap;

use super::VerbResult;
use super::contact_mask::labels_of;
use super::guard::{Bug, guarded};
use super::notes::Notes;
use super::output::says;
use super::recipe::misgiving;
use touch2touch_core::align::{AlignReport, Ask};
use touch2touch_core::dataset::PairId;
use touch2touch_core::pose::{Registration, ToolModel};
use touch2touch_core::which_tool::in_words;
use touch2touch_pipeline::doubts;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::dataset::SourceKind;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::steps::estimate::{Touch, estimate};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};
use touch2touch_pipeline::steps::tool::load_tool;

pub(super) use args::{PoseArgs, parse_start};
pub(super) use report::AnswerRow;
use report::{Accepted, First, PoseRow, RankedTool, Report, summary, text};

/// Word of `--tool` for trying all tools.
const ANY: &str = "any";

pub(super) fn run(args: &PoseArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let ids = args.pairs.of(&dataset)?;
    let imprints = args.imprint.sides();
    let output = args.dataset.output("aligning", ids.len());
    let models = args.recipe.model.models();
    let recipe = args.recipe(&dataset.rig)?;
    let mut tools: BTreeMap<String, Option<ToolModel>> = BTreeMap::new();
    let mut notes = Notes::of(&dataset);
    notes.take(&output, &doubts::notes(&dataset));
    if dataset.kind == SourceKind::Pictures {
        output.note("pictures hold no camera: the simulator's is assumed");
    }
    let mut cases = Vec::new();
    let all_labels = Labels::of(&dataset);
    let mut complete = true;
    let open = TaskError::new("Pose", "the tool is not known yet");
    for id in ids {
        let (pair, entry) = (PairId(id as u32), &dataset.index.pairs[id]);
        output.step(&entry.name);
        let sample = match dataset.load(pair) {
            Ok(sample) => sample,
            Err(err) => {
                output.note(&format!("{}: {err}", entry.name));
                complete = false;
                continue;
            }
        };
        notes.take(&output, &sample.notes);
        let names = match args.which.as_deref() {
            Some(ANY) => dataset.index.tools(),
            Some(name) => vec![name.to_owned()],
            None => entry.tool.iter().cloned().collect(),
        };
        if names.is_empty() {
            output.note(&format!("{}: no tool is named, so there is no CAD model to align", entry.name));
        }
        for name in &names {
            tools.entry(name.clone()).or_insert_with(|| match load_tool(&dataset, name) {
                Ok(loaded) => {
                    notes.take(&output, &loaded.notes);
                    Some(loaded.model)
                }
                Err(err) => {
                    output.note(&err.to_string());
                    None
                }
            });
        }
        let tried: Vec<(&str, &ToolModel)> =
            names.iter().filter_map(|name| Some((name.as_str(), tools.get(name)?.as_ref()?))).collect();
        let Some((_, first)) = tried.first() else {
            complete = false;
            continue;
        };
        let tool = if args.which.as_deref() == Some(ANY) { Err(&open) } else { Ok(*first) };
        let labels = labels_of(&all_labels, &entry.name, &output);
        for &imprint in imprints {
            let recipe = recipe.of(imprint);
            if imprint == ImprintSource::Predicted {
                notes.take(&output, misgiving(&recipe, &sample).as_slice());
            }
            let touch = Touch { dataset: &dataset, pair, sample: &sample, tool, labels: &labels };
            let work = || pose_cases(args, &entry.name, touch, &tried, &recipe, &models);
            match guarded(dataset.pair_files(pair), work) {
                Ok(found) => {
                    for note in found.first().iter().flat_map(|case| &case.mask_notes) {
                        output.note(&format!("note: {} ({} imprint), {note}", entry.name, imprint.key()));
                    }
                    complete &= found.iter().all(|c| c.angle_deg.is_some());
                    cases.extend(found);
                }
                Err(err) => {
                    output.note(&format!("{} ({} imprint): {}", entry.name, imprint.key(), says(&err)));
                    if err.is::<Bug>() {
                        models.forget();
                    }
                    complete = false;
                }
            }
        }
    }
    complete &= !cases.is_empty();
    let notes = notes.into_list(&output);
    let of =
        First { registration: args.recipe.registration.all()?[0].to_string(), imprint: imprints[0].key().to_owned() };
    let report = Report { summary: summary(&cases, of), cases, notes };
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

/// One case per engine for the pair `name` and one kind of imprint. The tool of `touch` is left open where all of `tried`,
/// by name, are to be tried.
fn pose_cases(
    args: &PoseArgs,
    name: &str,
    touch: Touch<'_>,
    tried: &[(&str, &ToolModel)],
    recipe: &Recipe,
    models: &Models,
) -> anyhow::Result<Vec<PoseRow>> {
    let (sample, imprint, accepted) = (touch.sample, recipe.imprint, touch.labels.accepted(&recipe.imprint_of()));
    let estimate = estimate(touch, recipe, Stage::Cloud, models, &JobCx::unwatched())?;
    let contact = estimate.contact();
    let truth = sample.grasp_from_object;
    let one = |&by: &Registration| {
        let ranked = match touch.tool {
            Ok(_) => None,
            Err(_) => Some(estimate.which_tool(sample, tried.iter().copied(), &*by.method())?),
        };
        let likeliest = ranked.iter().flatten().next().map(|first| first.tool.as_str());
        let model = likeliest.and_then(|name| tried.iter().find(|(tool, _)| *tool == name)).map(|(_, model)| *model);
        let tool = model.map_or(touch.tool, Ok).map_err(Clone::clone);
        let starts = (!args.starts.is_empty()).then_some(args.starts.as_slice());
        let ask = Ask { starts, record: args.trace, evidence: true, ..Ask::default() };
        let found = tool.and_then(|tool| estimate.pose_by(sample, tool, &*by.method(), ask));
        let answer = found.as_ref().ok();
        let place = answer.map(PoseResult::object_from_grasp);
        Ok(PoseRow {
            name: name.to_owned(),
            registration: by.to_string(),
            imprint: imprint.key(),
            which_tool: ranked.as_deref().map(in_words),
            tools: ranked.map(|all| all.iter().map(RankedTool::new).collect()),
            mask: contact.made_of(),
            mask_notes: contact.notes(&sample.rig),
            angle_deg: answer.map(|found| found.angle_rad.to_degrees()),
            truth_deg: truth.map(|truth| truth.inverse().theta_rad.to_degrees()),
            error_deg: answer.and_then(|found| Some(found.error_rad?.to_degrees())),
            y_m: place.map(|p| p.y_m),
            z_m: place.map(|p| p.z_m),
            ms: answer.map_or(0.0, |found| found.ms),
            angle_sd_deg: answer.and_then(|found| Some(found.angle_sd_rad()?.to_degrees())),
            verdict: answer.and_then(|found| found.verdict.clone()),
            evidence: answer.and_then(|found| found.report.evidence),
            answers: answer.iter().flat_map(|found| &found.report.answers).map(AnswerRow::new).collect(),
            stop: found.as_ref().map_or_else(|err| err.why.clone(), |found| found.stop.clone()),
            accepted: accepted.map(|a| Accepted::new(a, truth.zip(model.or(touch.tool.ok())))),
            // The evidence stands beside it.
            report: found.ok().filter(|_| args.trace).map(|found| AlignReport { evidence: None, ..found.report }),
        })
    };
    args.recipe.registration.all()?.iter().map(one).collect()
}
