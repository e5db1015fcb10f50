//! Symmetry of a tool: the turns in the plane that take its CAD model to itself. No touch tells poses apart that differ by one.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec2;

use super::frames::PlanarPose;
use super::manual::PoseDifference;
use super::mesh::sampling::spread;
use super::tent::{Sheet, heights};
use super::tool::ToolModel;
use super::units::{angle_error, wrap_angle};

/// Parts of a full turn that are tried; a model that the finest one takes to itself is round.
const PARTS: [u32; 6] = [2, 3, 4, 5, 6, 36];
/// Places of the outline that are turned, of each side.
const PLACES: usize = 1200;
/// Difference of heights, meters, within a node of a turned place, and the share of the places that may differ by more.
const SAME_M: f64 = 0.5e-3;
const OFF: f64 = 0.02;

/// Turns that take a tool to itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetry {
    /// Each as a motion of the object frame, `(y, z)` about the model's middle; none for most tools.
    pub turns: Vec<PlanarPose>,
}

impl Symmetry {
    /// The symmetry of a tool, found at the first request and kept with it.
    pub fn of(tool: &ToolModel) -> Arc<Self> {
        tool.derived(Self::find)
    }

    fn find(tool: &ToolModel) -> Self {
        // The top of each side as the membranes meet it: what lies within, as where bars cross, does not matter.
        let sides: Vec<Sheet> = [1.0, -1.0].into_iter().filter_map(|side| heights(&tool.mesh, side)).collect();
        let places: Vec<Vec<DVec2>> = sides.iter().map(raised).collect();
        let count = places.iter().map(Vec::len).sum::<usize>().max(1);
        let center = places.iter().flatten().sum::<DVec2>() / count as f64;
        let about_center = |theta_rad: f64| {
            let moved = center - DVec2::from_angle(theta_rad).rotate(center);
            PlanarPose { theta_rad, y_m: moved.x, z_m: moved.y }
        };
        let holds = |turn: PlanarPose| {
            sides.iter().zip(&places).all(|(side, places)| {
                let chosen = spread(places.len(), PLACES);
                let most = (OFF * chosen.len() as f64) as usize;
                let differs = |i: &usize| !has_near(side, turn.transform_yz(places[*i]), height(side, places[*i]));
                chosen.into_iter().filter(differs).take(most + 1).count() <= most
            })
        };
        let mut turns: Vec<PlanarPose> = Vec::new();
        for parts in PARTS.into_iter().filter(|parts| holds(about_center(TAU / f64::from(*parts)))) {
            for part in 1..parts {
                let turn = about_center(TAU * f64::from(part) / f64::from(parts));
                if turns.iter().all(|known| (known.theta_rad - turn.theta_rad).abs() > 1e-6) {
                    turns.push(turn);
                }
            }
        }
        Self { turns }
    }

    /// The poses, `grasp_from_object`, that no touch tells apart from this one, itself first.
    pub fn alike(&self, grasp_from_object: PlanarPose) -> impl Iterator<Item = PlanarPose> {
        let turned = self.turns.iter().map(move |turn| {
            let pose = grasp_from_object.compose(*turn);
            PlanarPose { theta_rad: wrap_angle(pose.theta_rad), ..pose }
        });
        std::iter::once(grasp_from_object).chain(turned)
    }

    /// Of these the one whose angle is nearest to that of another pose.
    pub fn nearest(&self, grasp_from_object: PlanarPose, to: PlanarPose) -> PlanarPose {
        let off = |pose: &PlanarPose| angle_error(pose.theta_rad, to.theta_rad);
        self.alike(grasp_from_object).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(grasp_from_object)
    }

    /// Difference of a pose from the true one, or from the nearest of those that no touch tells apart from it.
    pub fn difference(&self, found: PlanarPose, truth: PlanarPose) -> PoseDifference {
        PoseDifference::between(found, self.nearest(truth, found))
    }
}

/// Places of the nodes that are raised, meters.
fn raised(side: &Sheet) -> Vec<DVec2> {
    let columns = side.field.columns;
    let place = |k: usize| side.origin + DVec2::new((k % columns) as f64, (k / columns) as f64) * side.step_m;
    (0..side.field.values.len()).filter(|&k| side.field.values[k] > 0.0).map(place).collect()
}

fn height(side: &Sheet, place: DVec2) -> f64 {
    let at = (place - side.origin) / side.step_m;
    side.field.at(at.x, at.y)
}

/// True where a side is about so high within a node of a place: at a wall every height between its foot and its top.
fn has_near(side: &Sheet, place: DVec2, high_m: f64) -> bool {
    let [low, high] = (0..9).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], k| {
        let step = DVec2::new(f64::from(k % 3 - 1), f64::from(k / 3 - 1)) * side.step_m;
        let found = height(side, place + step);
        [low.min(found), high.max(found)]
    });
    (low - SAME_M..high + SAME_M).contains(&high_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::tools;

    #[test]
    fn the_labs_tools_have_the_turns_that_they_were_drawn_with() {
        let turns = |name: &str| {
            let spec = tools().iter().find(|tool| tool.name.contains(name)).unwrap();
            let tool = ToolModel::new(spec.mesh()).unwrap();
            Symmetry::of(&tool).turns.iter().map(|turn| turn.theta_rad.to_degrees().round() as i32).collect::<Vec<_>>()
        };
        assert_eq!(turns("_01_"), [180]);
        assert_eq!(turns("_03_"), [180, 90, 270]);
        assert_eq!(turns("_04_"), [120, 240]);
        assert_eq!(turns("_06_"), [72, 144, 216, 288]);
        assert_eq!(turns("_31_"), [180]);
        assert_eq!((turns("_05_"), turns("_36")), (vec![], vec![]));
    }

    #[test]
    fn a_model_drawn_elsewhere_has_the_same_turns_about_its_own_middle() {
        let mut mesh = tools().iter().find(|tool| tool.name.contains("_04_")).unwrap().mesh();
        let moved = PlanarPose { theta_rad: 2.3, y_m: 0.03, z_m: -0.012 };
        let affine = moved.to_affine();
        mesh.vertices.iter_mut().for_each(|v| *v = affine.transform_point3(*v));
        let symmetry = Symmetry::of(&ToolModel::new(mesh).unwrap());
        assert_eq!(symmetry.turns.len(), 2);
        for turn in &symmetry.turns {
            let middle = DVec2::new(moved.y_m, moved.z_m);
            assert!(turn.transform_yz(middle).distance(middle) < 1e-4, "{turn:?}");
        }
    }
}
