//! The fan of the poses of several seeds, as a picture.

use super::canvas::{Anchor, Canvas, Colour};
use crate::domain::ensemble::{AngleFan, Dial};
use crate::domain::grid::RgbGrid;
use crate::domain::units;

const SEED: Colour = [0xc2, 0x54, 0x00];
const TRUTH: Colour = [0x1c, 0x84, 0x47];
const GREY: Colour = [0x64, 0x64, 0x64];
const SIZE: [u32; 2] = [360, 240];
const LENGTH: f32 = 180.0;

/// Draws a fan with the true angle, where known; `None` for a fan without a mean.
pub(in crate::headless) fn picture(title: &str, fan: &AngleFan, truth_rad: Option<f64>) -> Option<RgbGrid> {
    let others: Vec<f64> = truth_rad.into_iter().collect();
    let dial = Dial::of(fan, &others)?;
    let pivot = [SIZE[0] as f32 / 2.0, SIZE[1] as f32 - 14.0];
    let toward = |off: f64, share: f32| -> [f32; 2] {
        let lean = dial.lean(off) as f32;
        [pivot[0] + lean.sin() * LENGTH * share, pivot[1] - lean.cos() * LENGTH * share]
    };
    let mut canvas = Canvas::new(SIZE[0], SIZE[1]);
    canvas.text([8.0, 16.0], 8.0, Anchor::Start, GREY, title);
    let reach = dial.reach_rad;
    let at = |i: i32| reach * f64::from(i) / 12.0;
    for i in -12..12 {
        canvas.line(toward(at(i), 1.0), toward(at(i + 1), 1.0), 1.0, GREY);
    }
    for i in [-12, -6, 0, 6, 12] {
        canvas.line(toward(at(i), 0.97), toward(at(i), 1.03), 1.0, GREY);
        let text = format!("{:.1}", (dial.mean_rad + at(i)).to_degrees());
        canvas.text(toward(at(i), 1.08), 7.0, Anchor::Middle, GREY, text);
    }
    for angle in &fan.angles_rad {
        canvas.line(pivot, toward(dial.off(*angle), 0.95), 1.0, SEED);
    }
    canvas.line(pivot, toward(0.0, 0.95), 3.0, SEED);
    if let Some(truth) = truth_rad {
        canvas.line(pivot, toward(dial.off(truth), 0.95), 2.0, TRUTH);
        canvas.text([SIZE[0] as f32 - 8.0, SIZE[1] as f32 - 8.0], 7.0, Anchor::End, TRUTH, "truth");
    }
    let spread = units::fixed(fan.std_rad.to_degrees(), 2);
    let text = format!("mean {:.2} spread {spread} deg, {} seeds", dial.mean_rad.to_degrees(), fan.angles_rad.len());
    canvas.text([8.0, SIZE[1] as f32 - 8.0], 7.0, Anchor::Start, SEED, text);
    Some(canvas.pixels(2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_is_drawn_and_one_without_a_mean_is_not() {
        let fan = AngleFan::of(&[0.1, 0.12, 0.15]).unwrap();
        let count = |truth| {
            let image = picture("a/1", &fan, truth).unwrap();
            image.as_slice().iter().filter(|p| p[1] > p[0] + 40.0 && p[1] > p[2] + 20.0).count()
        };
        assert!(count(Some(0.13)) > 200 && count(None) == 0, "{} {}", count(Some(0.13)), count(None));
        assert!(picture("", &AngleFan::of(&[0.0, std::f64::consts::PI]).unwrap(), None).is_none());
    }
}
