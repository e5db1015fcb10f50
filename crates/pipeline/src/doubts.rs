//! Doubts about a data set that looks right: [`examine_reading`].

use std::collections::BTreeMap;
use std::path::PathBuf;

use rayon::prelude::*;

use crate::error::TaskError;
use crate::io::dataset::{Dataset, READ_AS_FILE, SourceKind, write_read_as};
use crate::job::JobCx;
use crate::pairs::by_tool;
use crate::steps::imprint::imprint_of;
use crate::steps::models::Models;
use crate::steps::predict::Generating;
use touch2touch_core::dataset::{PairId, Problem};
use touch2touch_core::doubt::{Doubt, PairInput, Placed, judge};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::read_as::{ReadAs, also, list};
use touch2touch_core::sample::Sample;

/// Pairs that are looked at where nobody says how many: what is wrong with all of a set shows in these.
pub const PAIRS: usize = 6;
/// Most tools whose CAD models are tried.
const MOST_TOOLS: usize = 32;

/// A generator with the models that run it.
pub type Generator<'a> = (&'a Models, Generating<'a>);

/// Doubts about a data set, from about `pairs` of its pairs, spread over the tools. With a generator, predictions are
/// compared with what was measured, which takes seconds; without one it is a fraction of a second.
///
/// Pairs and CAD models that cannot be read are left out: what is wrong with those is said by whoever reads them.
pub fn examine_reading(dataset: &Dataset, pairs: usize, generator: Option<Generator<'_>>, cx: &JobCx) -> Vec<Doubt> {
    // The likeness of an imprint to a tool is that of a membrane.
    if dataset.rig.is_gel() {
        return Vec::new();
    }
    // The simulator's own are what they are.
    if dataset.kind == SourceKind::Demo && dataset.read_as().is_empty() {
        return Vec::new();
    }
    let ids = handful(dataset, pairs);
    let loaded: Vec<(PairId, Option<&str>, Sample)> = ids
        .par_iter()
        .filter_map(|id| Some((*id, dataset.index.get(*id)?.tool.as_deref(), dataset.load(*id).ok()?)))
        .collect();
    let beside: Vec<_> = loaded
        .iter()
        .map(|(id, ..)| {
            move |on: isize| {
                let id = PairId(u32::try_from(i64::from(id.0) + on as i64).ok()?);
                dataset.load(id).ok()?.grasp_from_object
            }
        })
        .collect();
    let felt = loaded.iter().zip(&beside);
    let felt: Vec<PairInput<'_>> =
        felt.map(|((_, tool, sample), beside)| PairInput { tool: *tool, sample, beside: Some(beside) }).collect();
    let tools = dataset.index.tools();
    let mesh = |tool: &String| Some((tool.clone(), dataset.tool_mesh(tool).ok()??));
    let meshes: BTreeMap<String, TriMesh> = tools.par_iter().take(MOST_TOOLS).filter_map(mesh).collect();
    let mut doubts = match generator {
        Some(generator) => judge(&felt, &meshes, Some(&mut |samples| placed(samples, generator, cx))),
        None => judge(&felt, &meshes, None),
    };
    let name = |at: &usize| Some(dataset.index.get(loaded.get(*at)?.0)?.name.as_str());
    for doubt in doubts.iter_mut().filter(|doubt| !doubt.pairs.is_empty()) {
        let names: Vec<&str> = doubt.pairs.iter().filter_map(name).collect();
        doubt.what = format!("{}; they are {}", doubt.what, names.join(", "));
    }
    doubts
}

/// Reading of the data set that removes the doubts if they are true, as `doctor --set read-as=` takes it; `None` where no reading
/// helps.
pub fn remedy(dataset: &Dataset, doubts: &[Doubt]) -> Option<String> {
    let mut readings = doubts.iter().filter_map(Doubt::read_as).peekable();
    readings.peek()?;
    Some(list(&readings.fold(dataset.read_as().to_vec(), |known, more| also(&known, more))))
}

/// Has a data set read otherwise than it is stored from now on, by the file beside its data that says so, which it returns.
/// Whoever has it open opens it again.
///
/// # Errors
/// If it is built in, or the file cannot be written.
pub fn read_otherwise(dataset: &Dataset, read_as: &[ReadAs]) -> Result<PathBuf, TaskError> {
    const WHAT: &str = "Read the data otherwise";
    let root = dataset.root.as_ref();
    let root =
        root.ok_or_else(|| TaskError::new(WHAT, format!("a built-in data set has no folder for {READ_AS_FILE}")))?;
    let file = root.join(READ_AS_FILE);
    write_read_as(root, read_as)
        .map_err(|err| TaskError::new(WHAT, format!("cannot write {}: {err}", file.display())))?;
    Ok(file)
}

/// Doubts as entries of a problem list.
pub fn problems(dataset: &Dataset, doubts: &[Doubt]) -> Vec<Problem> {
    let file = dataset.root.clone().unwrap_or_else(|| PathBuf::from(&dataset.title));
    let remedy = remedy(dataset, doubts).unwrap_or_default();
    let of = |doubt: &Doubt| {
        let hint = match doubt.read_as() {
            Some(_) if remedy.is_empty() => {
                format!("read them as they are stored: `touch2touch doctor {} --set read-as=`", file.display())
            }
            Some(_) => format!(
                "correct what writes the files, or have them read so: `touch2touch doctor {} --set read-as={remedy}`",
                file.display(),
            ),
            None => doubt.hint.clone(),
        };
        Problem { file: file.clone(), what: doubt.what.clone(), hint }
    };
    doubts.iter().map(of).collect()
}

/// Doubts about a data set, for the notes of whoever answers from it: cheaply, without predictions.
pub fn notes(dataset: &Dataset) -> Vec<Problem> {
    problems(dataset, &examine_reading(dataset, PAIRS, None, &JobCx::unwatched()))
}

/// Refuses true poses and CAD models that contradict the imprints, for whoever would make masks of them.
///
/// # Errors
/// In words, with what seems wrong.
#[cfg(any(test, feature = "tune"))]
pub(crate) fn check_truth(dataset: &Dataset, what: &str) -> Result<(), TaskError> {
    let doubts = examine_reading(dataset, PAIRS, None, &JobCx::unwatched());
    match doubts.into_iter().find(|doubt| doubt.cause.is_of_poses()) {
        Some(doubt) => Err(TaskError::new(what, doubt.what).with_hint(doubt.hint)),
        None => Ok(()),
    }
}

/// About so many pairs, of as many tools as there are, spread over the pairs of each.
fn handful(dataset: &Dataset, pairs: usize) -> Vec<PairId> {
    let tools: Vec<Vec<PairId>> = by_tool(dataset).into_values().collect();
    let taken = tools.len().min(pairs);
    let mut ids: Vec<PairId> = Vec::new();
    for slot in 0..taken {
        let of_tool = &tools[slot * tools.len() / taken];
        let count = (pairs / taken + usize::from(slot < pairs % taken)).min(of_tool.len());
        ids.extend((0..count).map(|i| of_tool[(2 * i + 1) * of_tool.len() / (2 * count)]));
    }
    ids.sort_unstable();
    ids
}

/// The predictions of samples' images, each placed in the imprint of each finger; `None` where they cannot be made.
pub fn placed(samples: &[&Sample], (models, generating): Generator<'_>, cx: &JobCx) -> Option<Vec<Placed>> {
    let made = generating.pairs(models, samples, cx).ok()??;
    let one = |(sample, made): (&&Sample, crate::steps::predict::Predicted)| {
        let made = made.map(|made| made?.ok());
        sample
            .rig
            .pads()
            .map(|from| {
                let made = made[from].as_ref()?;
                let at = |at| imprint_of(made, ShiftMode::ExactInverse, sample, at).ok();
                Some(sample.rig.pads().map(at).collect())
            })
            .collect()
    };
    Some(samples.iter().zip(made).map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_not_made_of_poses_that_contradict_the_imprints() {
        assert!(check_truth(&Dataset::demo(), "Train").is_ok());
        let negated = Dataset::demo().reading(vec![ReadAs::NegateTheta]);
        let refused = check_truth(&negated, "Train").unwrap_err();
        assert!(refused.why.contains("theta has the other sign"), "{refused:?}");
    }
}
