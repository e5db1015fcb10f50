//! The fan of the poses of several seeds, as a picture.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::canvas::{Drawing, Drawn, Paper, pixels};
use touch2touch_core::ensemble::{AngleFan, Dial};
use touch2touch_core::grid::RgbGrid;
use touch2touch_core::units;

const SEED: RGBColor = RGBColor(0xc2, 0x54, 0x00);
const TRUTH: RGBColor = RGBColor(0x1c, 0x84, 0x47);
const GRAY: RGBColor = RGBColor(0x64, 0x64, 0x64);
const LENGTH: f64 = 180.0;

struct Picture<'a> {
    title: &'a str,
    fan: &'a AngleFan,
    dial: Dial,
    truth_rad: Option<f64>,
}

impl Drawing for Picture<'_> {
    fn size(&self) -> [u32; 2] {
        [360, 240]
    }

    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
        let (dial, [width, height]) = (&self.dial, self.size().map(f64::from));
        let pivot = [width / 2.0, height - 20.0];
        let toward = |off: f64, share: f64| {
            let lean = dial.lean(off);
            [pivot[0] + lean.sin() * LENGTH * share, pivot[1] - lean.cos() * LENGTH * share]
        };
        let letters = |units: f64, color, h, v| paper.letters(units, color).pos(Pos::new(h, v));
        paper.text([8.0, 6.0], &letters(12.0, GRAY, HPos::Left, VPos::Top), self.title)?;
        let at = |i: i32| dial.reach_rad * f64::from(i) / 12.0;
        let arc: Vec<[f64; 2]> = (-12..=12).map(|i| toward(at(i), 1.0)).collect();
        paper.line(&arc, GRAY, 1.0)?;
        for i in [-12, -6, 0, 6, 12] {
            paper.line(&[toward(at(i), 0.97), toward(at(i), 1.03)], GRAY, 1.0)?;
            let text = format!("{:.1}", (dial.mean_rad + at(i)).to_degrees());
            paper.text(toward(at(i), 1.04), &letters(10.0, GRAY, HPos::Center, VPos::Bottom), &text)?;
        }
        for angle in &self.fan.angles_rad {
            paper.line(&[pivot, toward(dial.off(*angle), 0.95)], SEED, 1.0)?;
        }
        paper.line(&[pivot, toward(0.0, 0.95)], SEED, 3.0)?;
        let below = height - 6.0;
        if let Some(truth) = self.truth_rad {
            paper.line(&[pivot, toward(dial.off(truth), 0.95)], TRUTH, 2.0)?;
            paper.text([width - 8.0, below], &letters(10.0, TRUTH, HPos::Right, VPos::Bottom), "truth")?;
        }
        let spread = units::fixed(self.fan.std_rad.to_degrees(), 2);
        let seeds = self.fan.angles_rad.len();
        let text = format!("mean {:.2}° spread {spread}°, {seeds} seeds", dial.mean_rad.to_degrees());
        paper.text([8.0, below], &letters(10.0, SEED, HPos::Left, VPos::Bottom), &text)
    }
}

/// Draws a fan with the true angle, where known; `None` for a fan without a mean.
pub fn picture(title: &str, fan: &AngleFan, truth_rad: Option<f64>) -> anyhow::Result<Option<RgbGrid>> {
    let others: Vec<f64> = truth_rad.into_iter().collect();
    Dial::of(fan, &others).map(|dial| pixels(&Picture { title, fan, dial, truth_rad }, 2.0)).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_is_drawn_and_one_without_a_mean_is_not() {
        let fan = AngleFan::of(&[0.1, 0.12, 0.15]).unwrap();
        let count = |truth| {
            let image = picture("a/1", &fan, truth).unwrap().unwrap();
            image.as_slice().iter().filter(|p| p[1] > p[0] + 40.0 && p[1] > p[2] + 20.0).count()
        };
        assert!(count(Some(0.13)) > 200 && count(None) == 0, "{} {}", count(Some(0.13)), count(None));
        assert!(picture("", &AngleFan::of(&[0.0, std::f64::consts::PI]).unwrap(), None).unwrap().is_none());
    }
}
