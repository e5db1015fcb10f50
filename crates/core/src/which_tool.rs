//! [`which_tool`]: the tool of a touch among several, by what each of them explains of contact and membranes.

use std::sync::Arc;

use crate::align::{AlignReport, Ask, Contacts, Prior, Register};
use crate::mesh::TriMesh;
use crate::pose::register_with;
use crate::tool::ToolModel;
use crate::verdict::{Grade, Verdict};

/// Penalty of a pose outside the lab's grasps: among all poses most tools fit somewhere.
const BEYOND: f64 = 0.2;
/// Difference of two costs at which the cheaper tool is taken for `e` times as likely. From fresh grasps under two laws, on
/// which the right tool was ahead of the next one by 0.1 to 2.
const TELLING: f64 = 0.1;
/// Chance from which a tool is named as possible, and from which it is called sure.
const POSSIBLE: f64 = 0.05;
const SURE: f64 = 0.95;

/// Candidate for the tool of a touch.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Name of the tool.
    pub tool: String,
    /// CAD model of it, x from the middle between the sides that the fingers hold.
    pub mesh: Arc<TriMesh>,
    /// Answer of the registration of its model, with the evidence.
    pub report: AlignReport,
    /// Logarithm of the misfit that it leaves of the membranes' relief, plus the share of contact that lies off it. Lower is
    /// better.
    pub cost: f64,
    /// Chance that it is this one if it is one of them, 0 to 1.
    pub chance: f64,
}

/// Every tool that can be registered to a touch, the likeliest first. Models that no pose is found for are left out.
pub fn which_tool<'t>(
    contacts: Contacts<'_>,
    tools: impl IntoIterator<Item = (&'t str, &'t ToolModel)>,
    registration: &dyn Register,
) -> Vec<Candidate> {
    let ask = Ask { evidence: true, ..Ask::default() };
    let candidate = |(tool, model): (&str, &ToolModel)| {
        let report = register_with(registration, contacts, model, ask).ok()?;
        let evidence = report.evidence?;
        let misfit = evidence.membrane.map_or(1.0, |membrane| membrane.misfit.max(1e-9));
        let beyond = if Prior::default().allows(report.grasp_from_object) { 0.0 } else { BEYOND };
        Some(Candidate {
            tool: tool.to_owned(),
            mesh: Arc::new(model.mesh.clone()),
            cost: misfit.ln() + 1.0 - evidence.on_tool + beyond,
            report,
            chance: 0.0,
        })
    };
    let mut all: Vec<Candidate> = tools.into_iter().filter_map(candidate).collect();
    all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let best = all.first().map_or(0.0, |first| first.cost);
    let weight = |candidate: &Candidate| (-(candidate.cost - best) / TELLING).exp();
    let sum: f64 = all.iter().map(weight).sum();
    all.iter_mut().for_each(|candidate| candidate.chance = weight(candidate) / sum);
    all
}

/// The answer in words: `pattern_36 (sure)`, `pattern_36 or pattern_35`, or `none of these 5 tools fits`.
pub fn in_words(ranked: &[Candidate]) -> String {
    let fits = |one: &&Candidate| Verdict::of(&one.report).is_none_or(|verdict| verdict.grade < Grade::Wrong);
    let likely: Vec<&Candidate> = ranked.iter().filter(fits).filter(|one| one.chance >= POSSIBLE).collect();
    match &likely[..] {
        [] => format!("none of these {} tools fits", ranked.len()),
        [one] if one.chance >= SURE => format!("{} (sure)", one.tool),
        several => several.iter().map(|one| one.tool.as_str()).collect::<Vec<_>>().join(" or "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::JointConfig;
    use crate::align::PadImage;
    use crate::catalog::tools;
    use crate::cloud::lift;
    use crate::rig::lab;
    use crate::sim::{SimConfig, random_grasp, simulate};

    #[test]
    fn the_tool_that_was_touched_comes_first_and_chances_add_up() {
        let names = [0usize, 3, 7];
        let models: Vec<(String, ToolModel)> =
            names.iter().map(|&i| (tools()[i].name.clone(), ToolModel::new(tools()[i].mesh()).unwrap())).collect();
        for (own, seed) in names.into_iter().zip(3..) {
            let sample = simulate(&tools()[own], random_grasp(seed), seed, &SimConfig::default());
            let touch = |pad| sample.pad(pad).and_then(|touch| touch.depth()).unwrap();
            let mut points = Vec::new();
            for pad in lab::PADS {
                let contact = &touch(pad).truth.as_ref().unwrap().contact;
                points.extend(
                    lift(&touch(pad).imprint, touch(pad).camera.as_ref().unwrap(), Some(contact)).unwrap().points,
                );
            }
            let images =
                lab::PADS.map(|pad| PadImage::measured(&touch(pad).imprint, touch(pad).camera.as_ref().unwrap()));
            let contacts = Contacts { points: &points, images: &images };
            let all = which_tool(contacts, models.iter().map(|(name, m)| (name.as_str(), m)), &JointConfig::default());
            assert_eq!(
                all[0].tool,
                tools()[own].name,
                "{:?}",
                all.iter().map(|c| (&c.tool, c.cost)).collect::<Vec<_>>()
            );
            assert!(in_words(&all).starts_with(&tools()[own].name), "{}", in_words(&all));
            assert!(all[0].chance > 0.6 && (all.iter().map(|c| c.chance).sum::<f64>() - 1.0).abs() < 1e-9);
        }
        let nothing = which_tool(Contacts::default(), [], &JointConfig::default());
        assert!(nothing.is_empty() && in_words(&nothing) == "none of these 0 tools fits");
    }
}
