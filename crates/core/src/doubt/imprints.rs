//! Imprints against CAD models, under every reading of both.

use std::collections::{BTreeMap, BTreeSet};

use super::fit::{angle_error_rad, grainless, likeness, registered};
use super::{Cause, Doubt, Gain, PairInput, SAME, median};
use crate::field::DistanceField;
use crate::mesh::{Axes, TriMesh};
use crate::read_as::{Depths, Lay, ReadAs};
use crate::sample::{PadTouch, Sample};
use crate::units::counted;

/// Mean likeness of imprints that lie on their tools. Simulated ones have 0.6 to 0.85, wrongly read ones 0.5 and less.
const LIES_ON: f64 = 0.5;
/// Gain in mean likeness that a reading must have: what a sound data set gains by another reading is 0.01.
const CLEARLY: f64 = 0.08;
/// Gain that a reading of a CAD model must have: of one tool there may be a single pair.
const CLEARLY_OF_TOOL: f64 = 0.22;
/// Pairs whose likeness is at least this are not tried with other CAD models.
const GOOD: f64 = 0.65;
/// Imprints of less mean likeness have nothing to do with their tools.
const NOTHING: f64 = 0.15;
/// Imprints of a tool do not belong to its CAD model where their mean likeness is less than this share of the other tools',
/// which must be beyond doubt. A poor membrane alone has half of it.
const NOT_ITS_MODEL: f64 = 0.3;
const OTHERS_LIE_ON: f64 = 0.55;
/// Fewest pairs that are said to be another tool's.
const SOME: usize = 2;
/// Motions of the cameras that are tried beside a factor, meters along their axes.
const CAMERAS_M: [f64; 6] = [-8e-3, -5e-3, -3e-3, 3e-3, 5e-3, 8e-3];
/// Angles differ from here on, radians.
const ANGLES_DIFFER_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// The readings that are tried.
fn readings() -> Vec<ReadAs> {
    let mut all = vec![ReadAs::NegateTheta];
    for depths in [Depths::Imprints, Depths::Whole] {
        all.push(ReadAs::SwapFingers(depths));
        all.extend([Lay::MirrorColumns, Lay::MirrorRows, Lay::Turn].map(|lay| ReadAs::Lay(depths, lay)));
        all.extend([0.1, 0.5, 2.0, 10.0].map(|factor| ReadAs::Scale(depths, factor)));
    }
    all.push(ReadAs::Scale(Depths::Imprints, -1.0));
    all.extend([0.5, 0.8, 1.25, 2.0].map(ReadAs::ScaleCamera));
    all
}

/// Pairs with a CAD model, their imprints without grain.
struct Pairs<'a> {
    /// Positions among the pairs that are looked at.
    at: Vec<usize>,
    samples: Vec<Sample>,
    tools: Vec<&'a str>,
    fields: BTreeMap<&'a str, DistanceField>,
}

impl<'a> Pairs<'a> {
    fn of(pairs: &[PairInput<'a>], meshes: &'a BTreeMap<String, TriMesh>) -> Self {
        let fields: BTreeMap<&str, DistanceField> = meshes
            .iter()
            .filter_map(|(name, mesh)| Some((name.as_str(), DistanceField::from_mesh(mesh).ok()?)))
            .collect();
        let (mut at, mut taken, mut tools) = (Vec::new(), Vec::new(), Vec::new());
        for (index, PairInput { tool, sample, .. }) in pairs.iter().enumerate() {
            let Some(tool) = tool.filter(|tool| fields.contains_key(tool)) else { continue };
            if !sample.pads.iter().flatten().any(|t| t.depth().is_some() && t.camera().is_some()) {
                continue;
            }
            at.push(index);
            taken.push(grainless(sample));
            tools.push(tool);
        }
        Self { at, samples: taken, tools, fields }
    }

    /// The likeness of a sample, at its true pose where that is known.
    fn score(sample: &Sample, field: &DistanceField) -> f64 {
        let pose = sample.grasp_from_object.or_else(|| registered(sample, field));
        pose.map_or(0.0, |pose| likeness(sample, field, pose))
    }

    fn scores(&self, read_as: &[ReadAs]) -> Vec<f64> {
        let score = |(sample, tool): (&Sample, &&str)| Self::score(&ReadAs::all(read_as, sample), &self.fields[*tool]);
        self.samples.iter().zip(&self.tools).map(score).collect()
    }

    /// Mean likeness of the pairs of a tool with this outline.
    fn of_tool(&self, tool: &str, field: &DistanceField) -> f64 {
        let of = self.samples.iter().zip(&self.tools).filter(|(_, named)| **named == tool);
        let scores: Vec<f64> = of.map(|(sample, _)| Self::score(sample, field)).collect();
        scores.iter().sum::<f64>() / scores.len().max(1) as f64
    }
}

/// Doubt about the imprints of some pairs, or about their CAD models, with the mean likeness where it is mended; 0 where
/// nothing mends it. Other CAD models are tried where that is asked.
pub(super) fn judge(
    pairs: &[PairInput<'_>],
    meshes: &BTreeMap<String, TriMesh>,
    try_models: bool,
) -> Option<(Doubt, f64)> {
    let pairs = Pairs::of(pairs, meshes);
    if pairs.samples.is_empty() {
        return None;
    }
    let stored = pairs.scores(&[]);
    let read = best_reading(&pairs, &stored);
    let mean = stored.iter().sum::<f64>() / stored.len() as f64;
    let models = if try_models { tools_in_doubt(&pairs, &stored) } else { Vec::new() };
    // CAD models are blamed where that explains more than any one reading of all pairs.
    let best_read = read.as_ref().map_or(mean, |(_, gain)| gain.read);
    if let Some((doubt, with)) = of_models(&pairs, meshes, &models, &stored)
        && with > best_read
    {
        return Some((doubt, with));
    }
    if let Some((read_as, gain)) = read {
        if let Some((doubt, likeness)) = cameras_moved(&pairs, &stored, read_as, &gain) {
            return Some((doubt, likeness));
        }
        return Some((Doubt::stored(read_as, &figures(&pairs, &stored, read_as, &gain)), gain.read));
    }
    if let Some(doubt) = one_model(&pairs, &models, &stored) {
        return Some((doubt, 0.0));
    }
    if let Some(doubt) = try_models.then(|| other_models_of_some(&pairs, &stored)).flatten() {
        return Some((doubt, 0.0));
    }
    let unexplained = || {
        let what = format!(
            "the imprints do not lie on their CAD models at the true poses (similarity {mean:.2} in {}, where sound data have 0.6), \
             and nothing that was tried explains it",
            counted(stored.len(), "pair")
        );
        let hint = "check that poses, CAD models and imprints are of the same grasps, and their frames";
        Doubt::new(Cause::Unexplained, what, hint)
    };
    (mean < NOTHING).then(|| (unexplained(), 0.0))
}

/// CAD models that do not fit where those of other tools do, and that none of them replaces.
fn one_model(pairs: &Pairs<'_>, doubted: &[(&str, f64)], stored: &[f64]) -> Option<Doubt> {
    let tools: BTreeSet<&str> = pairs.tools.iter().copied().collect();
    let typical = median(stored.iter().copied()).filter(|typical| *typical >= OTHERS_LIE_ON)?;
    let bad: Vec<&(&str, f64)> = doubted.iter().filter(|(_, score)| *score < NOT_ITS_MODEL * typical).collect();
    if bad.is_empty() || 2 * bad.len() > tools.len() {
        return None;
    }
    let said: Vec<String> = bad.iter().map(|(tool, score)| format!("{tool} {score:.2}")).collect();
    let names: Vec<String> = bad.iter().map(|(tool, _)| (*tool).to_owned()).collect();
    let what = format!(
        "the imprints of {} do not lie on their CAD models, where those of the others do (similarity {}): none of the other models \
         fits either",
        counted(bad.len(), "tool"),
        said.join(", ")
    );
    Some(Doubt::new(Cause::NotItsModel(names), what, "check that the CAD models are those tools', in the object frame"))
}

/// The reading that explains the pairs best, if one does.
fn best_reading(pairs: &Pairs<'_>, stored: &[f64]) -> Option<(ReadAs, Gain)> {
    let known = pairs.samples.iter().any(|sample| sample.grasp_from_object.is_some());
    readings()
        .into_iter()
        .filter(|read_as| known || *read_as != ReadAs::NegateTheta)
        .map(|read_as| (read_as, Gain::between(stored, &pairs.scores(&[read_as]))))
        .filter(|(_, gain)| gain.explains(LIES_ON, CLEARLY))
        .max_by(|(_, a), (_, b)| a.read.total_cmp(&b.read))
}

/// Doubt about the place of the cameras, where that explains the pairs as well as a factor does: no cure is near.
fn cameras_moved(pairs: &Pairs<'_>, stored: &[f64], read_as: ReadAs, gain: &Gain) -> Option<(Doubt, f64)> {
    if !matches!(read_as, ReadAs::Scale(_, factor) | ReadAs::ScaleCamera(factor) if factor > 0.0) {
        return None;
    }
    let score = |forward_m: f64| {
        let moved = pairs.samples.iter().map(|sample| with_cameras_moved(sample, forward_m));
        let scores = moved.zip(&pairs.tools).map(|(sample, tool)| Pairs::score(&sample, &pairs.fields[*tool]));
        (forward_m, Gain::between(stored, &scores.collect::<Vec<_>>()))
    };
    let (forward_m, rival) = CAMERAS_M.map(score).into_iter().max_by(|(_, a), (_, b)| a.read.total_cmp(&b.read))?;
    (rival.explains(LIES_ON, CLEARLY) && rival.read >= gain.read - SAME).then(|| {
        let what = format!(
            "the imprints lie off their CAD models: with the depth cameras {:.0} mm further {} they have a similarity of {:.2} \
             instead of {:.2}; that {} would explain it no better",
            1e3 * forward_m.abs(),
            if forward_m > 0.0 { "forward" } else { "back" },
            rival.read,
            rival.read - rival.mean,
            read_as.mistake()
        );
        let hint = "check the places of the cameras in the gripper, the depths without contact, and the unit of the depths";
        (Doubt::new(Cause::Unexplained, what, hint), rival.read)
    })
}

/// The sample with its depth cameras moved along their optical axes.
fn with_cameras_moved(sample: &Sample, forward_m: f64) -> Sample {
    let mut sample = sample.clone();
    for touch in sample.pads.iter_mut().flatten().filter_map(PadTouch::depth_mut) {
        if let Some(pose) = touch.camera.as_mut().map(|camera| &mut camera.grasp_from_camera) {
            pose.translation += forward_m * pose.matrix3.z_axis;
        }
    }
    sample
}

/// Figures by which a reading of the imprints is better, in words.
fn figures(pairs: &Pairs<'_>, stored: &[f64], read_as: ReadAs, gain: &Gain) -> String {
    let errors = |readings: &[ReadAs]| {
        let error = |(sample, tool): (&Sample, &&str)| {
            angle_error_rad(&ReadAs::all(readings, sample), &pairs.fields[*tool]).map(f64::to_degrees)
        };
        median(pairs.samples.iter().zip(&pairs.tools).filter_map(error))
    };
    let (before, after) = (errors(&[]), errors(&[read_as]));
    let angles = match (before, after) {
        (Some(before), Some(after)) if (before - after).to_radians() > ANGLES_DIFFER_RAD => {
            format!(
                "read otherwise, the registered angle is off by a median of {after:.1}° instead of {before:.1}°, and the"
            )
        }
        _ => "read otherwise, the".into(),
    };
    let mean = stored.iter().sum::<f64>() / stored.len().max(1) as f64;
    format!(
        "{angles} imprints lie on their CAD models with a similarity of {:.2} instead of {mean:.2}, better on {} of {}",
        gain.read,
        gain.better,
        counted(stored.len(), "pair")
    )
}

/// The tools whose pairs do not lie on their CAD models, with their mean likeness.
fn tools_in_doubt<'a>(pairs: &Pairs<'a>, stored: &[f64]) -> Vec<(&'a str, f64)> {
    means(pairs, stored).into_iter().filter(|(_, mean)| *mean < GOOD).collect()
}

/// Mean likeness of the pairs of each tool.
fn means<'a>(pairs: &Pairs<'a>, stored: &[f64]) -> Vec<(&'a str, f64)> {
    let mut by_tool: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (tool, score) in pairs.tools.iter().zip(stored) {
        by_tool.entry(tool).or_default().push(*score);
    }
    let mean = |(tool, scores): (_, Vec<f64>)| (tool, scores.iter().sum::<f64>() / scores.len() as f64);
    by_tool.into_iter().map(mean).collect()
}

/// Other CAD models, or the same with other axes, where they explain the tools in doubt; with the mean likeness of all pairs
/// that follows.
fn of_models(
    pairs: &Pairs<'_>,
    meshes: &BTreeMap<String, TriMesh>,
    doubted: &[(&str, f64)],
    stored: &[f64],
) -> Option<(Doubt, f64)> {
    if doubted.is_empty() {
        return None;
    }
    let others = other_models(pairs, doubted);
    let turned = other_axes(pairs, meshes, doubted, &means(pairs, stored));
    let explained = |tools: &[(&str, f64)]| {
        let gained: f64 =
            tools.iter().map(|(tool, gain)| gain * pairs.tools.iter().filter(|t| *t == tool).count() as f64).sum();
        (stored.iter().sum::<f64>() + gained) / stored.len() as f64
    };
    let by_others = explained(&others.iter().map(|(tool, _, gain)| (*tool, *gain)).collect::<Vec<_>>());
    let by_axes = turned.as_ref().map_or(0.0, |turned| explained(&turned.tools));
    let mean = stored.iter().sum::<f64>() / stored.len() as f64;
    if others.is_empty() && turned.is_none() {
        return None;
    }
    if let Some(OtherAxes { axes, tools, of_all }) = turned.filter(|_| by_axes > by_others) {
        let names: Vec<String> = tools.iter().map(|(tool, _)| (*tool).to_owned()).collect();
        let figures = format!("the imprints then lie on them with a similarity of {by_axes:.2} instead of {mean:.2}");
        // One program drew them all, unless a tool is only right as it is.
        if of_all {
            return Some((Doubt::stored(ReadAs::CadAxes(axes), &figures), by_axes));
        }
        let what = format!(
            "the CAD models of {} have other axes ({}), {axes} instead of xyz: {figures}",
            counted(names.len(), "tool"),
            names.join(", ")
        );
        let hint = "export them in the object frame: x along the gripper's closing axis, z away from the wrist";
        return Some((Doubt::new(Cause::Axes(names, axes), what, hint), by_axes));
    }
    let list: Vec<(String, String)> =
        others.iter().map(|(tool, other, _)| ((*tool).to_owned(), (*other).to_owned())).collect();
    let said: Vec<String> = list.iter().map(|(tool, other)| format!("{tool} looks like {other}")).collect();
    let what = format!(
        "the CAD models of {} are those of other tools ({}): with the others the imprints lie on them with a likeness of \
         {by_others:.2} instead of {mean:.2}",
        counted(list.len(), "tool"),
        said.join(", ")
    );
    let hint = "put the right files into tools_stls, or correct the names of the pairs";
    Some((Doubt::new(Cause::OtherTool(list), what, hint), by_others))
}

/// For each tool in doubt the other one whose model its pairs lie on, with the gain.
fn other_models<'a>(pairs: &Pairs<'a>, doubted: &[(&'a str, f64)]) -> Vec<(&'a str, &'a str, f64)> {
    let mut better = Vec::new();
    for &(tool, as_is) in doubted {
        let others = pairs.fields.iter().filter(|(other, _)| **other != tool);
        let scores = others.map(|(other, field)| (*other, pairs.of_tool(tool, field)));
        let best = scores.max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some((other, score)) = best.filter(|(_, score)| *score >= LIES_ON && score - as_is >= CLEARLY_OF_TOOL) {
            better.push((tool, other, score - as_is));
        }
    }
    better
}

/// Pairs that lie on the CAD models of other tools than their own, where the others of their tool do not.
fn other_models_of_some(pairs: &Pairs<'_>, stored: &[f64]) -> Option<Doubt> {
    let mut found: Vec<(usize, String)> = Vec::new();
    for ((sample, tool), (at, as_is)) in pairs.samples.iter().zip(&pairs.tools).zip(pairs.at.iter().zip(stored)) {
        if *as_is >= GOOD {
            continue;
        }
        let others = pairs.fields.iter().filter(|(other, _)| *other != tool);
        let scores = others.map(|(other, field)| (*other, Pairs::score(sample, field)));
        let best = scores.max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some((other, _)) = best.filter(|(_, score)| *score >= LIES_ON && score - as_is >= CLEARLY_OF_TOOL) {
            found.push((*at, format!("{tool} looks like {other}")));
        }
    }
    if found.len() < SOME {
        return None;
    }
    let (at, mut said): (Vec<usize>, Vec<String>) = found.into_iter().unzip();
    said.sort_unstable();
    said.dedup();
    let what = format!(
        "{} of {} lie on the CAD models of other tools than their own ({})",
        at.len(),
        counted(pairs.samples.len(), "pair"),
        said.join(", ")
    );
    let doubt = Doubt::new(
        Cause::OtherToolOfSome,
        what,
        "correct the names of these pairs, and look at the others of the tool",
    );
    Some(Doubt { pairs: at, ..doubt })
}

/// Other axes of the CAD models: the tools that they explain with their gains, and whether they are as good for all others.
struct OtherAxes<'a> {
    axes: Axes,
    tools: Vec<(&'a str, f64)>,
    of_all: bool,
}

/// The axes with which all tools together lie best on their models, where some of those in doubt then clearly do.
fn other_axes<'a>(
    pairs: &Pairs<'a>,
    meshes: &BTreeMap<String, TriMesh>,
    doubted: &[(&'a str, f64)],
    stored: &[(&'a str, f64)],
) -> Option<OtherAxes<'a>> {
    let of = |axes: Axes| {
        let score = |tool: &str| {
            let field = meshes.get(tool).and_then(|mesh| DistanceField::from_mesh(&axes.apply(mesh)).ok());
            field.map_or(0.0, |field| pairs.of_tool(tool, &field))
        };
        let scores: Vec<(&str, f64, f64)> = stored.iter().map(|(tool, as_is)| (*tool, score(tool), *as_is)).collect();
        let gain: f64 = scores.iter().map(|(_, score, as_is)| score - as_is).sum();
        let clearly = |tool: &str, score: f64, as_is: f64| {
            let is_doubted = doubted.iter().any(|(name, _)| *name == tool);
            is_doubted && score >= LIES_ON && score - as_is >= CLEARLY_OF_TOOL
        };
        let of_all = scores.iter().all(|(tool, score, as_is)| clearly(tool, *score, *as_is) || *score > as_is - SAME);
        let tools = scores.into_iter().filter(|(tool, score, as_is)| clearly(tool, *score, *as_is));
        (gain, OtherAxes { axes, tools: tools.map(|(tool, score, as_is)| (tool, score - as_is)).collect(), of_all })
    };
    let found = Axes::others().map(of).filter(|(_, found)| !found.tools.is_empty());
    found.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, best)| best)
}
