//! Influence of each contact point on a registered angle: [`influence`].
//!
//! The registration ends where the pulls of its points balance. Without one of them the balance lies elsewhere, and to
//! first order the pose moves there by the inverse curvature of the cost times the pull that is missing: one solved
//! matrix answers for all points, also for those that were not registered. Points on the silhouette pull nothing and
//! have no influence. Where membranes had a say they hold the pose as well ([`Hold`]), and a point moves it less.

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

use super::ANGLE_SCALE_M;
use super::Hold;
use super::observability::{DEGENERATE_BELOW, MIN_TELLING, observability};
use crate::field::DistanceField;
use crate::frames::PlanarPose;

/// Why there is no influence to speak of.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InfluenceError {
    /// Nearly all points lie on the silhouette, or far away from it.
    #[error(
        "only {got} contact points lie beside the tool's outline (at least {MIN_TELLING}): nothing says what the angle \
         hangs on; enlarge the contact mask"
    )]
    TooFewTelling {
        /// Points up to 2 mm outside the silhouette.
        got: usize,
    },
    /// The tool turns freely.
    #[error("the contact leaves the angle open: no pixel decides it")]
    AngleOpen,
    /// The pose is no minimum of the cost, or not finite.
    #[error("the pose is not where the contact points balance: register it again")]
    NoBalance,
}

/// Influence of each point: by how much the angle of `object_from_grasp` (the one that the lab reports, radians)
/// changes when a point of the registration leaves it, and when another one joins it. `registered` says for each point
/// whether it takes part. NaN for points that are not finite.
///
/// Points are `(y, z)`, meters, grasp frame; the pose is where the registration on `field` ended, with a last kernel of
/// `kernel_m`, or where membranes and mask together did, with the membranes' `hold`. Motions that nothing determines (a rod
/// slides along itself) are left where they are.
///
/// # Errors
/// [`InfluenceError`] where the registered points do not determine the angle.
pub fn influence(
    points_yz: &[DVec2],
    registered: &[bool],
    field: &DistanceField,
    grasp_from_object: PlanarPose,
    kernel_m: f64,
    hold: Option<&Hold>,
) -> Result<Vec<f64>, InfluenceError> {
    let is_registered = |at: usize| registered.get(at) == Some(&true);
    let own: Vec<DVec2> = (0..points_yz.len()).filter(|at| is_registered(*at)).map(|at| points_yz[at]).collect();
    if !grasp_from_object.is_finite() {
        return Err(InfluenceError::NoBalance);
    }
    let seen = observability(&own, field, grasp_from_object);
    if seen.telling < MIN_TELLING && hold.is_none() {
        return Err(InfluenceError::TooFewTelling { got: seen.telling });
    }
    let motions = seen.motions.map(Vector3::from);
    let is_open = |at: &usize| hold.is_none() && seen.eigenvalues[*at] < DEGENERATE_BELOW;
    // A motion that mostly turns leaves the angle open, one that mostly slides does not.
    if (0..3).filter(is_open).map(|at| motions[at][0].powi(2)).sum::<f64>() > 0.5 {
        return Err(InfluenceError::AngleOpen);
    }
    let pull = |point: DVec2| Pull::of(point, seen.center, field, grasp_from_object, kernel_m);
    let (mut curvature, mut together, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for point in own.iter().filter(|p| p.is_finite()) {
        let pull = pull(*point);
        curvature += pull.slope * pull.slope.transpose() * pull.stiffness;
        together += pull.slope * pull.strength;
        count += 1.0;
    }
    // The mean over the points counts beside the membranes: one point more or less changes the share of all.
    let share = hold.map_or(Vector3::zeros(), |_| together / f64::max(count, 1.0));
    if let Some(hold) = hold {
        curvature += hold.about(seen.center) * count;
    }
    // Along an open motion the curvature is noise: there the pose is held.
    let scale = curvature.trace();
    for open in (0..3).filter(is_open).map(|at| motions[at]) {
        let held = Matrix3::identity() - open * open.transpose();
        curvature = held * curvature * held + open * open.transpose() * scale;
    }
    let held: Vec<Vector3<f64>> = (0..3).filter(is_open).map(|at| motions[at]).collect();
    let inverse = curvature.cholesky().map(|factors| factors.inverse()).ok_or(InfluenceError::NoBalance)?;
    let found = points_yz.iter().enumerate().map(|(at, point)| {
        if !point.is_finite() {
            return f64::NAN;
        }
        let Pull { mut slope, strength, stiffness } = pull(*point);
        for open in &held {
            slope -= open * open.dot(&slope);
        }
        let step = inverse * slope;
        // The curvature that goes or comes with the point.
        let leverage = stiffness * slope.dot(&step);
        let own = step[0] * strength - (inverse * share)[0];
        let way = if is_registered(at) { own / (1.0 - leverage) } else { -own / (1.0 + leverage) };
        way / ANGLE_SCALE_M
    });
    Ok(found.collect())
}

/// Effect of a point on the cost at a pose.
struct Pull {
    /// Change of its distance by (angle times [`ANGLE_SCALE_M`], y, z), grasp frame: of the point against the tool.
    slope: Vector3<f64>,
    /// Weight times distance, meters.
    strength: f64,
    /// By how much the strength grows with the distance; what the registration takes for the curvature.
    stiffness: f64,
}

impl Pull {
    fn of(point: DVec2, center: DVec2, field: &DistanceField, grasp_from_object: PlanarPose, kernel_m: f64) -> Self {
        /// Least share of the weight that stays for the curvature far out, where the kernel lets go: as in the
        /// registration.
        const FLAT: f64 = 0.1;
        let sample = field.sample(grasp_from_object.inverse().transform_yz(point));
        let r = sample.distance;
        if r.is_nan() || r <= 0.0 {
            return Self { slope: Vector3::zeros(), strength: 0.0, stiffness: 0.0 };
        }
        let normal = DVec2::from_angle(grasp_from_object.theta_rad).rotate(sample.gradient);
        let arm = (point - center).perp();
        let slope = Vector3::new(normal.dot(arm) / ANGLE_SCALE_M, normal.x, normal.y);
        let share = 1.0 / (1.0 + (r / kernel_m).powi(2));
        let weight = share * share;
        let bend = 1.0 - 4.0 * (1.0 - share);
        Self { slope, strength: weight * r, stiffness: weight * bend.max(FLAT) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cross_contacts, cuboid, disc, filled};
    use crate::align::{AlignConfig, align};
    use crate::mesh::TriMesh;
    use glam::DVec3;

    const KERNEL_M: f64 = 1e-3;
    const POSE: PlanarPose = PlanarPose { theta_rad: 0.1, y_m: 0.001, z_m: -0.002 };

    /// The angle registered from all points, none thinned.
    fn registered(points: &[DVec2], field: &DistanceField, start: PlanarPose) -> PlanarPose {
        let config = AlignConfig { points: usize::MAX, starts: vec![start], ..AlignConfig::default() };
        align(points, field, &config).unwrap().grasp_from_object
    }

    /// Predicted and true changes of the angle, degrees, when the points of a square leave or join, for all squares of
    /// 4 mm. `takes` says which points are registered to begin with.
    fn squares(points: &[DVec2], takes: &[bool], field: &DistanceField) -> Vec<(f64, f64)> {
        let own = |takes: &dyn Fn(usize) -> bool| -> Vec<DVec2> {
            (0..points.len()).filter(|at| takes(*at)).map(|at| points[at]).collect()
        };
        let pose = registered(&own(&|at| takes[at]), field, POSE);
        let each = influence(points, takes, field, pose, KERNEL_M, None).unwrap();
        let square = |p: DVec2| ((p.x / 0.004).floor() as i32, (p.y / 0.004).floor() as i32);
        let all: std::collections::BTreeSet<_> = points.iter().map(|p| square(*p)).collect();
        let mut found = Vec::new();
        for (here, joins) in all.into_iter().flat_map(|here| [(here, false), (here, true)]) {
            let flips = |at: usize| square(points[at]) == here && takes[at] != joins;
            if !(0..points.len()).any(flips) {
                continue;
            }
            let predicted: f64 = (0..points.len()).filter(|at| flips(*at)).map(|at| each[at]).sum();
            let after = registered(&own(&|at| takes[at] != flips(at)), field, pose);
            found.push((predicted.to_degrees(), (pose.theta_rad - after.theta_rad).to_degrees()));
        }
        found
    }

    fn correlation(pairs: &[(f64, f64)]) -> f64 {
        let n = pairs.len() as f64;
        let (a, b) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
        let sum = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>();
        let cross = sum(&|p| (p.0 - a) * (p.1 - b));
        cross / (sum(&|p| (p.0 - a).powi(2)) * sum(&|p| (p.1 - b).powi(2))).sqrt()
    }

    #[test]
    fn predicts_what_registering_without_a_square_of_points_does() {
        let field = DistanceField::from_mesh(&cross()).unwrap();
        for seed in 1..4 {
            let mut points = cross_contacts(3000, POSE, 0.5e-3, seed);
            // A blob beside the tool that is no contact, and points that are not in the mask yet.
            let blob = filled(&[DVec2::new(0.002, 0.002)], 0.0, 120, PlanarPose::default(), 0.0, seed);
            points.extend(blob.iter().map(|p| *p + DVec2::new(0.012, 0.008)));
            let takes: Vec<bool> = (0..points.len()).map(|at| at % 4 != 0).collect();
            let pairs = squares(&points, &takes, &field);
            let corr = correlation(&pairs);
            let slope = pairs.iter().map(|p| p.0 * p.1).sum::<f64>() / pairs.iter().map(|p| p.0 * p.0).sum::<f64>();
            assert!(corr > 0.9 && (0.7..1.4).contains(&slope), "{corr} {slope}");
        }
    }

    #[test]
    fn what_is_missing_is_said() {
        let field = DistanceField::from_mesh(&cross()).unwrap();
        let all = |points: &[DVec2]| vec![true; points.len()];
        let of = |points: &[DVec2]| influence(points, &all(points), &field, POSE, KERNEL_M, None);
        assert_eq!(of(&[]), Err(InfluenceError::TooFewTelling { got: 0 }));
        // All on the silhouette: nothing pulls.
        let inside = cross_contacts(500, POSE, 0.0, 1);
        assert!(matches!(of(&inside), Err(InfluenceError::TooFewTelling { .. })));
        let mut points = cross_contacts(2000, POSE, 0.5e-3, 1);
        let whole = of(&points).unwrap();
        assert!(whole.iter().all(|v| v.is_finite()));
        // What is not finite has no influence and changes that of nobody.
        points.push(DVec2::new(f64::NAN, 0.0));
        let found = of(&points).unwrap();
        assert!(found[2000].is_nan() && found[..2000] == whole);
        let nowhere = PlanarPose { theta_rad: f64::NAN, ..POSE };
        let all = vec![true; points.len()];
        assert_eq!(influence(&points, &all, &field, nowhere, KERNEL_M, None), Err(InfluenceError::NoBalance));
        // No flag is the same as not registered.
        assert_eq!(
            influence(&points, &[], &field, POSE, KERNEL_M, None),
            Err(InfluenceError::TooFewTelling { got: 0 })
        );
    }

    #[test]
    fn a_disc_leaves_the_angle_open_and_a_sliding_rod_does_not() {
        let round = DistanceField::from_mesh(&disc(0.01, 96)).unwrap();
        let rim: Vec<DVec2> = (0..2000).map(|i| DVec2::from_angle(f64::from(i)) * 0.0104).collect();
        let of_disc = influence(&rim, &vec![true; rim.len()], &round, PlanarPose::default(), KERNEL_M, None);
        assert_eq!(of_disc, Err(InfluenceError::AngleOpen));
        let rod: TriMesh = cuboid(DVec3::ZERO, DVec3::new(0.003, 0.003, 0.04));
        let field = DistanceField::from_mesh(&rod).unwrap();
        let points = filled(&[DVec2::new(0.0035, 0.02)], 0.0, 4000, PlanarPose::default(), 0.0, 1);
        let found =
            influence(&points, &vec![true; points.len()], &field, PlanarPose::default(), KERNEL_M, None).unwrap();
        // A point beside the rod's end turns it the more, the farther out it is; on the other side the other way.
        let of = |end: f64, side: f64| {
            let near = |p: &DVec2| (p.y - 0.018 * end).abs() < 0.001 && p.x * side > 0.003_2;
            points.iter().zip(&found).filter(|(p, _)| near(p)).map(|(_, v)| v).sum::<f64>()
        };
        assert!(of(1.0, 1.0) * of(1.0, -1.0) < 0.0 && of(1.0, 1.0) * of(-1.0, 1.0) < 0.0);
        assert!(of(1.0, 1.0).abs() > 5.0 * of(0.1, 1.0).abs(), "{} {}", of(1.0, 1.0), of(0.1, 1.0));
    }
}
