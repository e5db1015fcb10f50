//! Distances between contacts and model points, both ways.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::icp::Samples;
use crate::frames::PlanarPose;

/// Distances up to this count as overlap, meters.
const OVERLAP_M: f64 = 1e-3;
/// The gate of the lab's fitness, meters.
const LAB_GATE_M: f64 = 0.015;

/// Distances between contacts and model points, seen along the closing axis, at the final pose.
///
/// The two directions answer different questions: contacts far from the model are a wrong mask or a wrong pose; model
/// points far from every contact are mostly parts that nothing touched.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Directions {
    /// From every contact to its nearest model point.
    pub scene_to_model: Distances,
    /// From every model point to its nearest contact.
    pub model_to_scene: Distances,
}

/// One direction of [`Directions`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Root mean square of all distances, meters.
    pub rms_m: f64,
    /// Share of the distances up to 1 mm.
    pub overlap: f64,
    /// Share of the distances up to 15 mm: the "fitness" that the lab computes and does not use.
    pub fitness_15mm: f64,
    /// Root mean square of those, meters; from model to scene it is by this that the lab chooses among starts.
    pub rms_15mm_m: f64,
}

impl Directions {
    /// Of contacts (`(y, z)`, grasp frame, meters; those that are not finite are left out) and model points at a
    /// pose. `None` if one side is empty. A few milliseconds.
    pub fn at(contacts: &[DVec2], model: &Samples, grasp_from_object: PlanarPose) -> Option<Self> {
        let object_from_grasp = grasp_from_object.inverse();
        let contacts: Vec<(DVec3, DVec3)> = contacts
            .iter()
            .map(|p| object_from_grasp.transform_yz(*p))
            .map(|q| (DVec3::new(0.0, q.x, q.y), DVec3::ZERO))
            .filter(|(q, _)| q.is_finite())
            .collect();
        let contacts = Samples::in_plane(&contacts);
        if contacts.is_empty() || model.is_empty() {
            return None;
        }
        Some(Self {
            scene_to_model: distances(contacts.points(), model),
            model_to_scene: distances(model.points(), &contacts),
        })
    }
}

fn distances(from: &[DVec3], to: &Samples) -> Distances {
    let (mut all, mut gated, mut near, mut within) = (0.0, 0.0, 0usize, 0usize);
    for p in from {
        let (item, _) = to.nearest(*p);
        let squared = (to.point(item) - *p).with_x(0.0).length_squared();
        all += squared;
        near += usize::from(squared <= OVERLAP_M * OVERLAP_M);
        if squared <= LAB_GATE_M * LAB_GATE_M {
            within += 1;
            gated += squared;
        }
    }
    let count = from.len() as f64;
    Distances {
        rms_m: (all / count).sqrt(),
        overlap: near as f64 / count,
        fitness_15mm: within as f64 / count,
        rms_15mm_m: (gated / (within as f64).max(1.0)).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_direction_counts_its_own_points() {
        // A model of four points in a row, 10 mm apart; contacts on the first two, 0.5 mm beside, after a shift.
        let model: Vec<(DVec3, DVec3)> =
            (0..4).map(|i| (DVec3::new(0.0, 0.01 * f64::from(i), 0.0), DVec3::ZERO)).collect();
        let model = Samples::in_plane(&model);
        let pose = PlanarPose { theta_rad: 0.3, y_m: 0.002, z_m: -0.001 };
        let mut contacts: Vec<DVec2> = [0.0, 0.01].iter().map(|y| pose.transform_yz(DVec2::new(*y, 0.5e-3))).collect();
        contacts.push(DVec2::NAN);
        let both = Directions::at(&contacts, &model, pose).unwrap();
        let to_model = both.scene_to_model;
        assert!((to_model.rms_m - 0.5e-3).abs() < 1e-9 && to_model.overlap == 1.0 && to_model.fitness_15mm == 1.0);
        let to_scene = both.model_to_scene;
        assert_eq!((to_scene.overlap, to_scene.fitness_15mm), (0.5, 0.75));
        let squares: [f64; 4] = [0.25e-6, 0.25e-6, 100.25e-6, 400.25e-6];
        assert!((to_scene.rms_m - (squares.iter().sum::<f64>() / 4.0).sqrt()).abs() < 1e-9);
        assert!((to_scene.rms_15mm_m - (squares[..3].iter().sum::<f64>() / 3.0).sqrt()).abs() < 1e-9);
        assert_eq!(Directions::at(&[], &model, pose), None);
    }
}
