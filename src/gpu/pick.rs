//! Picking: the point under the pointer, found on the CPU: exact, and the same on every machine.

use glam::{DVec2, DVec3};

use super::view::{Camera, Projector};

/// A picked point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index in the cloud.
    pub index: usize,
    /// Distance from the pointer on the screen, pixels.
    pub distance_px: f64,
    /// Distance in front of the eye, meters; smaller is nearer.
    pub depth_m: f64,
}

/// The point of a cloud that a person means who points at `px`: of those within one pixel of the least distance on
/// the screen, the one nearest to the eye. `None` if no point is within `radius_px`.
///
/// Points that are not finite or behind the eye are never picked. What hides a point is not taken into account.
pub fn nearest_point(points: &[DVec3], camera: &Camera, size: [u32; 2], px: DVec2, radius_px: f64) -> Option<Hit> {
    let projector = Projector::new(camera, size);
    let near: Vec<Hit> = points
        .iter()
        .enumerate()
        .filter_map(|(index, p)| {
            let (point_px, depth_m) = projector.project(*p)?;
            let distance_px = (point_px - px).length();
            (distance_px <= radius_px).then_some(Hit { index, distance_px, depth_m })
        })
        .collect();
    let least = near.iter().map(|h| h.distance_px).fold(f64::INFINITY, f64::min);
    near.into_iter().filter(|h| h.distance_px <= least + 1.0).min_by(|a, b| a.depth_m.total_cmp(&b.depth_m))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [400, 300];

    #[test]
    fn every_point_of_a_cloud_is_found_under_its_own_pixel() {
        let camera = Camera::default();
        let points: Vec<DVec3> = (0..400)
            .map(|i| DVec3::new(0.0, (f64::from(i % 20) - 10.0) * 0.002, (f64::from(i / 20) - 10.0) * 0.002))
            .collect();
        for (i, p) in points.iter().enumerate() {
            let (px, depth) = camera.project(*p, SIZE).unwrap();
            let hit = nearest_point(&points, &camera, SIZE, px, 4.0).unwrap();
            assert_eq!(hit.index, i);
            assert!(hit.distance_px < 1e-9 && (hit.depth_m - depth).abs() < 1e-12);
        }
    }

    #[test]
    fn the_nearer_of_two_in_line_wins_and_the_radius_counts() {
        let camera = Camera::default();
        let towards = camera.axes()[2];
        let points = [DVec3::NAN, DVec3::ZERO, towards * 0.02, towards * 0.01, towards];
        let center = DVec2::new(200.0, 150.0);
        let pick = |px, radius| nearest_point(&points, &camera, SIZE, px, radius);
        assert_eq!(pick(center, 3.0).unwrap().index, 2);
        assert_eq!(pick(center + DVec2::X * 5.0, 4.9), None);
        assert_eq!(pick(center + DVec2::X * 5.0, 5.1).unwrap().index, 2);
        assert_eq!(pick(DVec2::NAN, 5.0), None);
        assert_eq!(nearest_point(&[], &camera, SIZE, center, 9.0), None);
    }
}
