//! Reliability of the standard deviations that poses come with: how often an error stays within so many of them.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use serde::Serialize;

use super::front::{FAINT, FRONT, INK, OURS, PEER};
use touch2touch_core::align::Evidence;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units::wrap_angle;
use touch2touch_pipeline::images::canvas::{Drawing, Drawn, Paper};

/// Errors in standard deviations: angle, y, z.
pub(super) type Scores = [f64; 3];

/// Errors of a pose in the standard deviations that its evidence foretells.
pub(super) fn scores(evidence: &Evidence, estimated: PlanarPose, truth: PlanarPose) -> Scores {
    let turned = wrap_angle(estimated.theta_rad - truth.theta_rad);
    let errors = [turned, estimated.y_m - truth.y_m, estimated.z_m - truth.z_m];
    std::array::from_fn(|i| errors[i] / evidence.uncertainty.covariance[i][i].sqrt())
}

/// Reliability over all cases with a pose.
#[derive(Debug, Serialize)]
pub(super) struct Reliability {
    /// Poses counted.
    poses: usize,
    /// Root of the mean squared score of angle, y and z: 1 where the standard deviations are right, more where they promise
    /// too much.
    rms: [f64; 3],
    /// Percent of the poses within one and within two standard deviations, of angle, y and z; a normal distribution has 68.3
    /// and 95.4.
    within_1: [f64; 3],
    within_2: [f64; 3],
    /// Of the angle: percent of the poses that a normal distribution has within some standard deviations, and that are.
    curve: Vec<[f64; 2]>,
}

impl Reliability {
    /// `None` without any pose.
    pub(super) fn of(scores: &[Scores]) -> Option<Self> {
        if scores.is_empty() {
            return None;
        }
        let within = |i: usize, limit: f64| {
            100.0 * scores.iter().filter(|s| s[i].abs() <= limit).count() as f64 / scores.len() as f64
        };
        let rms = |i: usize| (scores.iter().map(|s| s[i] * s[i]).sum::<f64>() / scores.len() as f64).sqrt();
        let curve =
            (0..=60).map(|step| f64::from(step) * 0.05).map(|limit| [100.0 * normal_within(limit), within(0, limit)]);
        Some(Self {
            poses: scores.len(),
            rms: std::array::from_fn(rms),
            within_1: std::array::from_fn(|i| within(i, 1.0)),
            within_2: std::array::from_fn(|i| within(i, 2.0)),
            curve: curve.collect(),
        })
    }

    /// `angle 0.89 (97 % within 2), y 0.9 (..), z ..`.
    pub(super) fn text(&self) -> String {
        let one = |(name, i): (&str, usize)| format!("{name} {:.2} ({:.0} %)", self.rms[i], self.within_2[i]);
        ["angle", "y", "z"].into_iter().zip(0..).map(one).collect::<Vec<_>>().join(", ")
    }
}

/// Share of a normal distribution within so many standard deviations.
fn normal_within(limit: f64) -> f64 {
    libm::erf(limit / std::f64::consts::SQRT_2)
}

const COLORS: [RGBColor; 4] = [OURS, PEER, FRONT, RGBColor(150, 60, 160)];

/// The picture: observed over foretold shares of the angle's errors, a line for each engine.
pub(super) struct Picture<'a> {
    pub(super) title: &'a str,
    pub(super) lines: Vec<(&'a str, &'a Reliability)>,
}

impl Drawing for Picture<'_> {
    fn size(&self) -> [u32; 2] {
        [620, 620]
    }

    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
        paper.text([80.0, 16.0], &paper.letters(17.0, INK), self.title)?;
        let mut chart = ChartBuilder::on(paper.area)
            .margin_top(paper.px(50.0))
            .margin_left(paper.px(10.0))
            .margin_right(paper.px(30.0))
            .margin_bottom(paper.px(10.0))
            .x_label_area_size(paper.px(60.0))
            .y_label_area_size(paper.px(70.0))
            .build_cartesian_2d(0.0..100.0, 0.0..100.0)?;
        let percent = |share: &f64| format!("{share:.0} %");
        chart
            .configure_mesh()
            .bold_line_style(paper.stroke(FAINT, 1.0))
            .light_line_style(paper.stroke(FAINT, 0.4))
            .axis_style(paper.stroke(INK, 1.5))
            .label_style(paper.letters(15.0, INK))
            .axis_desc_style(paper.letters(16.0, INK))
            .x_desc("errors that the standard deviation foretells within a limit")
            .y_desc("errors within it")
            .x_label_formatter(&percent)
            .y_label_formatter(&percent)
            .draw()?;
        chart.draw_series([PathElement::new([(0.0, 0.0), (100.0, 100.0)], paper.stroke(INK, 1.0))])?;
        for (number, (name, line)) in self.lines.iter().enumerate() {
            let color = COLORS[number % COLORS.len()];
            let points = line.curve.iter().map(|[foretold, seen]| (*foretold, *seen));
            chart.draw_series(LineSeries::new(points, paper.stroke(color, 2.5)))?;
            let label = format!("{name}: {}", line.text());
            // Below the diagonal, where lines are only of deviations that promise far too much.
            let (right, bottom) = chart.backend_coord(&(98.0, 3.0));
            let style = paper.letters(14.0, color).pos(Pos::new(HPos::Right, VPos::Bottom));
            paper.area.draw_text(&label, &style, (right, bottom - paper.px(20.0 * number as f64)))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_deviations_give_the_diagonal() {
        for (limit, share) in [(0.0, 0.0), (1.0, 0.682_689_5), (2.0, 0.954_499_7)] {
            assert!((normal_within(limit) - share).abs() < 1e-6, "{limit}");
        }
        // The quantiles of a normal distribution, by bisection.
        let quantile = |share: f64| {
            let (mut low, mut high) = (0.0, 8.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if normal_within(middle) < share { low = middle } else { high = middle }
            }
            low
        };
        let scores: Vec<Scores> = (0..2000).map(|i| [quantile((f64::from(i) + 0.5) / 2000.0); 3]).collect();
        let found = Reliability::of(&scores).unwrap();
        assert!((found.rms[0] - 1.0).abs() < 0.01 && (found.within_2[2] - 95.4).abs() < 0.1, "{found:?}");
        assert!(found.curve.iter().all(|[foretold, seen]| (foretold - seen).abs() < 0.1), "{found:?}");
        assert!(Reliability::of(&[]).is_none());
        let svg =
            touch2touch_pipeline::images::canvas::svg(&Picture { title: "t", lines: vec![("joint", &found)] }).unwrap();
        assert!(svg.contains("joint: angle 1.00 (95 %)"), "{svg}");
    }
}
