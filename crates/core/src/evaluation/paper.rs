//! Published figures, on real data.

use super::{Estimate, Group, Row, TableMetrics};

/// Rows of the paper and of the lab's evaluation notebook, for both fingers of 46 real grasps per tool.
pub fn paper_rows() -> Vec<Row> {
    // The angle's success within 10 degrees on seen tools is not known here for the diffusion model.
    vec![
        row(
            "Paper: latent diffusion",
            [Some(26.1), Some(0.62), Some(1.3), Some(97.8), None],
            [Some(20.4), Some(0.47), Some(6.4), Some(59.4), Some(79.0)],
        ),
        row(
            "Lab's notebook: VQ-VAE",
            [Some(27.01), Some(0.57), Some(1.36), Some(98.79), Some(100.0)],
            [Some(20.73), Some(0.37), Some(7.43), Some(52.9), Some(75.36)],
        ),
        row(
            "Paper: VQ-VAE",
            [None, None, Some(1.4), Some(97.1), Some(100.0)],
            [None, None, Some(8.39), Some(40.58), Some(73.19)],
        ),
    ]
}

/// PSNR, SSIM, angle error, success at 5 and at 10 degrees; of unseen grasps, then of unseen tools.
fn row(method: &str, seen: [Option<f64>; 5], unseen: [Option<f64>; 5]) -> Row {
    let figures = |group, tools: usize, values: [Option<f64>; 5]| {
        let keys = ["psnr_db", "ssim", "angle_deg", "success_5", "success_10"];
        let published = |(key, value): (_, Option<f64>)| Some((key, Estimate { value: value?, interval: None }));
        TableMetrics {
            group,
            tools,
            grasps: 46 * tools,
            images: 92 * tools,
            without_pose: 0,
            figures: keys.into_iter().zip(values).filter_map(published).collect(),
        }
    };
    Row {
        method: method.into(),
        published: true,
        upper_bound: false,
        groups: vec![figures(Group::SeenTools, 9, seen), figures(Group::UnseenTools, 3, unseen)],
    }
}
