//! Ambiguity of a GelSlim image: whether it can tell where on the tool it is. A bare shaft looks the same all along.
//!
//! A tool whose picture does not change when it is moved along one direction leaves that position open, whatever model
//! reads the picture: "cannot know", not "wrong". So the test is the definition: the difference image is compared with
//! itself moved by some millimeters, in every direction; where there is one in which nothing changes and in the others
//! there is, the touch is ambiguous. An end of the shaft, a bend, a crossing or a second contact within the window
//! changes the picture in every direction.

use serde::{Deserialize, Serialize};

use super::grid::RgbGrid;
use super::resample::area;
use super::rig::lab;

/// Columns that the image is reduced to: 0.28 mm per pixel of a GelSlim, and little of the camera's noise left.
const COLUMNS: usize = 64;
/// Directions tried in half a turn.
const DIRECTIONS: usize = 60;
/// Distances by which the image is moved against itself, shares of its width: 3.4, 5.1 and 6.8 mm of a GelSlim's 18.
const MOVES: [f64; 3] = [0.19, 0.285, 0.38];
/// A change (0: none, 1: nothing in common) up to this counts as none.
const UNCHANGED: f64 = 0.35;
/// Signal below which nothing touches the gel, levels of 255 (root mean square).
const TOUCHED: f64 = 1.5;

/// Ambiguity of a difference image: what it leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ambiguity {
    /// Kind of touch.
    pub kind: TouchKind,
    /// The direction in which the picture changes least, radians in 0..π, from the image's x towards its y (down).
    pub direction_rad: f64,
    /// Change of the picture when it is moved that way: 0 none, 1 nothing in common.
    pub change: f64,
    /// Strength of the picture, levels of 255 (root mean square).
    pub signal: f64,
}

/// Kinds of touches by what they tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, strum::EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum TouchKind {
    /// The picture tells where on the tool it is.
    Distinct,
    /// Nothing but parallel ridges: the position along them cannot be known.
    BareShaft,
    /// Nothing touches the gel.
    Nothing,
}

impl Ambiguity {
    /// The warning, if one is due.
    pub fn warning(&self) -> Option<&'static str> {
        match self.kind {
            TouchKind::Distinct => None,
            TouchKind::BareShaft => Some(
                "The gel shows a bare shaft: where along it the tool is held cannot be known from this image. What the \
                 prediction shows beyond the GelSlim's window is one of many possibilities.",
            ),
            TouchKind::Nothing => Some("Nothing touches the gel: the prediction has nothing to go by."),
        }
    }

    /// A few words for beside a picture.
    pub fn caption(&self) -> Option<&'static str> {
        match self.kind {
            TouchKind::Distinct => None,
            TouchKind::BareShaft => Some("bare shaft: place along it unknown"),
            TouchKind::Nothing => Some("nothing touches the gel"),
        }
    }
}

/// Ambiguity of a difference image (signed, 0..255 scale, any size). `None` for an image without finite pixels. Takes a
/// few milliseconds.
pub fn ambiguity(difference: &RgbGrid) -> Option<Ambiguity> {
    let [width, height] = difference.size();
    if width < 2 || height < 2 || difference.as_slice().iter().flatten().all(|v| !v.is_finite()) {
        return None;
    }
    // Square pixels in the aspect of a GelSlim, whatever the image was resized to.
    let rows = COLUMNS * lab::GELSLIM.height / lab::GELSLIM.width;
    let planes: Vec<Vec<f64>> = (0..3)
        .map(|c| {
            let plane = difference.map(|p| if p[c].is_finite() { p[c] } else { 0.0 });
            let small = area(&plane, COLUMNS.min(width), rows.min(height));
            let small = super::resample::bilinear(&small, COLUMNS, rows);
            let mut values: Vec<f64> = small.as_slice().iter().map(|&v| f64::from(v)).collect();
            level(&mut values);
            blur(&values, COLUMNS, rows)
        })
        .collect();
    let signal = (planes.iter().flatten().map(|v| v * v).sum::<f64>() / (3 * COLUMNS * rows) as f64).sqrt();
    let change = |direction: f64| {
        MOVES.iter().map(|d| moved(&planes, rows, direction, d * COLUMNS as f64)).fold(0.0f64, f64::max)
    };
    let (direction_rad, change) = (0..DIRECTIONS)
        .map(|k| std::f64::consts::PI * k as f64 / DIRECTIONS as f64)
        .map(|direction| (direction, change(direction)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let kind = match () {
        () if signal < TOUCHED => TouchKind::Nothing,
        () if change <= UNCHANGED => TouchKind::BareShaft,
        () => TouchKind::Distinct,
    };
    Some(Ambiguity { kind, direction_rad, change, signal })
}

/// Takes the median off: the light of the untouched gel.
fn level(values: &mut [f64]) {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    values.iter_mut().for_each(|v| *v -= median);
}

/// Binomial smoothing over five pixels along each axis: markers and noise fade, ridges stay.
fn blur(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    const TAPS: [f64; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
    let index = |k: usize, step: isize, n: usize| (k as isize + step).clamp(0, n as isize - 1) as usize;
    let tap = |f: &dyn Fn(isize) -> f64| (-2..=2).zip(TAPS).map(|(step, w)| w * f(step)).sum::<f64>();
    let pass = |of: &[f64], across: bool| -> Vec<f64> {
        (0..of.len())
            .map(|i| {
                let (x, y) = (i % width, i / width);
                tap(&|step| match across {
                    true => of[y * width + index(x, step, width)],
                    false => of[index(y, step, height) * width + x],
                })
            })
            .collect()
    };
    pass(&pass(values, true), false)
}

/// Change of the planes when they are moved by `distance` pixels: 0 none, 1 nothing in common.
fn moved(planes: &[Vec<f64>], rows: usize, direction: f64, distance: f64) -> f64 {
    let (dy, dx) = direction.sin_cos();
    let (dx, dy) = (dx * distance, dy * distance);
    let (mut difference, mut size) = (0.0, 0.0);
    for y in 0..rows {
        for x in 0..COLUMNS {
            let (u, v) = (x as f64 + dx, y as f64 + dy);
            if u < 0.0 || v < 0.0 || u > (COLUMNS - 1) as f64 || v > (rows - 1) as f64 {
                continue;
            }
            let (i, j) = ((u as usize).min(COLUMNS - 2), (v as usize).min(rows - 2));
            let (s, t) = (u - i as f64, v - j as f64);
            for plane in planes {
                let k = j * COLUMNS + i;
                let top = plane[k] + (plane[k + 1] - plane[k]) * s;
                let bottom = plane[k + COLUMNS] + (plane[k + COLUMNS + 1] - plane[k + COLUMNS]) * s;
                let (there, here) = (top + (bottom - top) * t, plane[y * COLUMNS + x]);
                difference += (there - here).powi(2);
                size += there * there + here * here;
            }
        }
    }
    if size > 0.0 { difference / size } else { 0.0 }
}

#[cfg(test)]
mod tests;
