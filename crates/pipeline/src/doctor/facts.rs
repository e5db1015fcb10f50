//! [`facts`]: lines about a data set that cost a second at most: names, labels, CAD models, and a handful of its pairs.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Cure, Fact, Grade, Topic};
use crate::doubts;
use crate::export::DrawnMasks;
use crate::io::dataset::{Dataset, SourceKind, ToolScale};
use crate::job::JobCx;
use crate::labels::Review;
use crate::pairs::{by_tool, spread};
use crate::steps::tool::{offer, units_of};
use touch2touch_core::dataset::{PairId, Split};
use touch2touch_core::rig::SensorKind;
use touch2touch_core::sample::{PadTouch, Sample, Scale};
use touch2touch_core::units::{counted, fixed, mm};

/// Pairs that are read for a look at cameras, poses and depths.
const LOOKED_AT: usize = 12;
/// Most names in a line.
const MOST_NAMED: usize = 3;
/// Most CAD models that are read.
const MOST_MODELS: usize = 64;
/// Share of the pixels that are left out of the range on each side: single flying pixels are no depth of the imprint.
const FLYING: f64 = 0.005;
/// Less is the noise of a membrane at rest, millimeters.
const ASIDE_MM: f64 = 1.0;
/// Every so many pixels of an imprint count for the range.
const STRIDE: usize = 7;

/// Lines about a data set and what people said about it. Pairs and CAD models that cannot be read are in the lines.
pub fn facts(dataset: &Dataset, masks: &DrawnMasks<'_>) -> Vec<Fact> {
    let ids: Vec<PairId> = spread(dataset.index.pairs.len(), Some(LOOKED_AT)).map(|at| PairId(at as u32)).collect();
    let looked_at: Vec<Sample> = ids.par_iter().filter_map(|id| dataset.load(*id).ok()).collect();
    let models = models(dataset);
    let posed = looked_at.iter().filter(|sample| sample.grasp_from_object.is_some()).count();
    let mut all = vec![sensors(dataset), pairs(dataset, &looked_at, ids.len()), tools(dataset)];
    all.extend(cad(dataset, &models));
    all.push(cameras(&looked_at, posed));
    all.extend(range(&looked_at));
    all.push(drawn(dataset, masks, posed > 0, &models));
    all.push(reviews(dataset, masks));
    all.push(problems(dataset, ids.len() - looked_at.len()));
    all
}

/// Names with numbers, the first few of them.
fn named<'a>(all: impl ExactSizeIterator<Item = (&'a str, Option<usize>)>) -> String {
    let others = all.len().saturating_sub(MOST_NAMED);
    let one = |(name, count): (&str, Option<usize>)| match count {
        Some(count) => format!("{name} {count}"),
        None => name.to_owned(),
    };
    let mut text = all.take(MOST_NAMED).map(one).collect::<Vec<_>>().join(", ");
    if others > 0 {
        text += &format!(" and {others} more");
    }
    text
}

fn sensors(dataset: &Dataset) -> Fact {
    let rig = &dataset.rig;
    let one = |sensor: &touch2touch_core::rig::Sensor| {
        let kind = if sensor.kind == SensorKind::Depth { "depth" } else { "color" };
        format!("{} ({kind}, {} x {} px)", sensor.name, sensor.width, sensor.height)
    };
    let sensors: Vec<String> = rig.sensors.iter().map(one).collect();
    Fact::plain(Topic::Sensors, format!("{} on {}", sensors.join(", "), counted(rig.pads.len(), "finger")))
}

fn pairs(dataset: &Dataset, looked_at: &[Sample], asked: usize) -> Fact {
    let all = &dataset.index.pairs;
    let mut text = counted(all.len(), "pair");
    text += match dataset.kind {
        SourceKind::Pictures => " of images",
        SourceKind::Demo => ", simulated on demand",
        _ => " in the lab's files",
    };
    let tests = all.iter().filter(|pair| pair.split == Split::Test).count();
    if tests > 0 {
        text += &format!("; {tests} reserved for tests");
    }
    if looked_at.iter().any(|sample| sample.scale == Scale::Assumed) {
        text += "; images carry no depth scale: -6.3 to 18 mm is assumed";
    }
    let has = |sample: &&Sample, get: fn(&PadTouch) -> bool| sample.pads.iter().flatten().any(get);
    let blind = looked_at.iter().filter(|sample| !has(sample, |touch| touch.color().is_some())).count();
    let unfelt = looked_at.iter().filter(|sample| !has(sample, |touch| touch.depth().is_some())).count();
    let mut grade = Grade::Plain;
    for (count, what) in [(blind, "color image"), (unfelt, "measured imprint")] {
        if count > 0 {
            text += &format!("; {count} of {asked} checked have no {what}");
            grade = Grade::Caution;
        }
    }
    Fact::plain(Topic::Pairs, text).graded(grade)
}

fn tools(dataset: &Dataset) -> Fact {
    let mut of = by_tool(dataset);
    let without = of.remove(&None).map_or(0, |ids| ids.len());
    if of.is_empty() {
        return Fact::plain(Topic::Tools, "unknown: no CAD model, no pose");
    }
    let list = named(of.iter().map(|(tool, ids)| (tool.unwrap_or_default(), Some(ids.len()))));
    let without = if without > 0 { format!("; {} without a tool", counted(without, "pair")) } else { String::new() };
    Fact::plain(Topic::Tools, format!("{}: {list}{without}", counted(of.len(), "tool")))
}

/// The CAD model of a tool.
enum Cad {
    Usable,
    Missing,
    Refused(Vec<Cure>),
}

fn models(dataset: &Dataset) -> BTreeMap<String, Cad> {
    let one = |tool: &String| {
        let cad = match dataset.tool_mesh(tool) {
            Ok(Some(_)) => Cad::Usable,
            Err(err) if dataset.tool_mesh_file(tool).is_some() => {
                let offer = offer(dataset, tool, &err);
                let cures = offer.iter().flat_map(|offer| {
                    let cure = |(unit, _): &(_, _)| Cure::ReadTool {
                        tool: offer.tool.clone(),
                        unit: *unit,
                        replacing: offer.says.clone(),
                    };
                    offer.units.iter().map(cure)
                });
                // The likeliest unit alone: the others are in the pane that cannot draw the tool.
                Cad::Refused(cures.take(1).collect())
            }
            _ => Cad::Missing,
        };
        (tool.clone(), cad)
    };
    dataset.index.tools().par_iter().take(MOST_MODELS).map(one).collect()
}

fn cad(dataset: &Dataset, models: &BTreeMap<String, Cad>) -> Option<Fact> {
    if models.is_empty() {
        return None;
    }
    let of = |is: fn(&Cad) -> bool| models.iter().filter(move |(_, cad)| is(cad)).map(|(tool, _)| tool.as_str());
    let usable: Vec<&str> = of(|cad| matches!(cad, Cad::Usable)).collect();
    let missing: Vec<&str> = of(|cad| matches!(cad, Cad::Missing)).collect();
    let refused: Vec<&str> = of(|cad| matches!(cad, Cad::Refused(_))).collect();
    let unit = match (dataset.tool_scale, usable.first()) {
        (Some(ToolScale::Meters), _) => " in meters".into(),
        (Some(_), _) => " in the given unit".into(),
        (None, Some(tool)) => match units_of(dataset, tool).ok().and_then(|offer| offer.says) {
            Some(says) => format!(" in {says} (unit.txt)"),
            None => " in meters".into(),
        },
        (None, None) => String::new(),
    };
    let mut text = format!("{} of {} usable{unit}", usable.len(), models.len());
    let list = |names: &[&str]| named(names.iter().map(|name| (*name, None)).collect::<Vec<_>>().into_iter());
    if !missing.is_empty() {
        text += &format!("; no file for {}", list(&missing));
    }
    if !refused.is_empty() {
        text += &format!("; wrong unit? {}", list(&refused));
    }
    let grade = match (missing.is_empty(), refused.is_empty()) {
        (_, false) => Grade::Wrong,
        (false, true) => Grade::Caution,
        (true, true) => Grade::Plain,
    };
    let cures = models.values().filter_map(|cad| if let Cad::Refused(cures) = cad { Some(cures) } else { None });
    let fact = Fact::plain(Topic::Cad, text).graded(grade);
    Some(Fact { cures: cures.flatten().take(MOST_NAMED).cloned().collect(), ..fact })
}

fn cameras(looked_at: &[Sample], posed: usize) -> Fact {
    let camera = looked_at.iter().flat_map(|sample| sample.pads.iter().flatten()).find_map(PadTouch::camera);
    let assumed = looked_at.iter().any(|sample| sample.scale == Scale::Assumed);
    let camera = match camera {
        Some(_) if assumed => "depth cameras assumed: images carry none".into(),
        Some(camera) => format!("depth cameras known (focal length {:.0} px)", camera.intrinsics.fx),
        None => "no depth camera: no 3D points, no pose".into(),
    };
    let poses = match posed {
        0 => "true poses unknown".into(),
        n if n == looked_at.len() => "true poses known".into(),
        n => format!("true poses known for {n} of {} checked", looked_at.len()),
    };
    Fact::plain(Topic::Cameras, format!("{camera}; {poses}"))
}

/// The range of the measured imprints, without flying pixels, in tenths of a millimeter outwards.
fn range(looked_at: &[Sample]) -> Option<Fact> {
    let mut values: Vec<f32> = looked_at
        .iter()
        .flat_map(|sample| sample.pads.iter().flatten())
        .filter_map(PadTouch::depth)
        .flat_map(|depth| depth.imprint.as_slice().iter().step_by(STRIDE))
        .copied()
        .filter(|v| v.is_finite())
        .collect();
    let cut = (values.len() as f64 * FLYING) as usize;
    let last = values.len().checked_sub(1 + cut)?;
    let mut at = |index: usize| f64::from(*values.select_nth_unstable_by(index, f32::total_cmp).1);
    let (lo, hi) = (at(cut), at(last));
    let (lo, hi) = ((mm(lo) * 10.0).floor() / 10.0, (mm(hi) * 10.0).ceil() / 10.0);
    // Colors begin where nothing touches: what lies below is the membrane that gives way beside the tool.
    let from = lo.max(0.0);
    if hi <= from {
        return Some(Fact::plain(Topic::Range, "all measured imprints are flat").graded(Grade::Caution));
    }
    let mut text = format!("{} to {} mm", fixed(from, 1), fixed(hi, 1));
    if lo < -ASIDE_MM {
        text += &format!("; down to {} mm beside the tool", fixed(lo, 1));
    }
    let cure = Cure::FitRange { min_m: (from * 1e-3) as f32, max_m: (hi * 1e-3) as f32 };
    Some(Fact::plain(Topic::Range, text).with_cure(cure))
}

fn drawn(dataset: &Dataset, masks: &DrawnMasks<'_>, posed: bool, models: &BTreeMap<String, Cad>) -> Fact {
    let known: std::collections::BTreeSet<&str> = dataset.index.pairs.iter().map(|pair| pair.name.as_str()).collect();
    let drawn: Vec<_> = masks.all(&dataset.rig).into_iter().filter(|(pair, _)| known.contains(pair.as_str())).collect();
    let mut of: Vec<&str> = drawn.iter().map(|(pair, _)| pair.as_str()).collect();
    of.dedup();
    let text = match drawn.len() {
        0 => "none edited yet: automatic masks".into(),
        n => format!("{} edited, in {}", counted(n, "mask"), counted(of.len(), "pair")),
    };
    let fact = Fact::plain(Topic::Masks, text);
    let usable = |tool: &String| matches!(models.get(tool), Some(Cad::Usable));
    let pairs = dataset.index.pairs.iter().filter(|pair| pair.tool.as_ref().is_some_and(usable)).count();
    if posed && pairs > 1 && dataset.kind != SourceKind::Demo && !dataset.rig.is_gel() {
        let text = format!("{}; could be made from CAD and true poses for {}", fact.text, counted(pairs, "pair"));
        return Fact { text, ..fact }.with_cure(Cure::TrainFromCad { pairs });
    }
    fact
}

fn reviews(dataset: &Dataset, masks: &DrawnMasks<'_>) -> Fact {
    use strum::IntoEnumIterator as _;
    let states = masks.reviews();
    let count = |review: Review| {
        let is = |name: &String| states.get(name).copied().unwrap_or_default() == review;
        dataset.index.pairs.iter().filter(|pair| is(&pair.name)).count()
    };
    let said: Vec<String> = Review::iter()
        .map(|review| (count(review), review))
        .filter(|(n, _)| *n > 0)
        .map(|(n, review)| format!("{n} {}", review.name()))
        .collect();
    Fact::plain(Topic::Reviews, if said.is_empty() { "none".into() } else { said.join(", ") })
}

fn problems(dataset: &Dataset, unreadable: usize) -> Fact {
    let found = doubts::examine_reading(dataset, doubts::PAIRS, None, &JobCx::unwatched());
    let mut parts: Vec<String> = found.iter().map(|doubt| doubt.what.clone()).collect();
    if unreadable > 0 {
        parts.push(format!("{} of those checked cannot be read", counted(unreadable, "pair")));
    }
    match dataset.problems.as_slice() {
        [] => {}
        [one] => parts.push(one.what.clone()),
        [first, others @ ..] => parts.push(format!("{} (and {} more)", first.what, others.len())),
    }
    let grade = match (parts.is_empty(), found.is_empty()) {
        (true, _) => Grade::Plain,
        (false, true) => Grade::Caution,
        (false, false) => Grade::Wrong,
    };
    let text = if parts.is_empty() { "none obvious".into() } else { parts.join("; ") };
    let mut fact = Fact::plain(Topic::Problems, text).graded(grade);
    if let Some(list) = doubts::remedy(dataset, &found).filter(|_| dataset.root.is_some()) {
        fact = fact.with_cure(Cure::ReadAs { list });
    }
    fact.with_cure(Cure::Examine { pairs: dataset.index.pairs.len() })
}
