//! Markers: the lattice on a GelSlim's gel tells which of several sensors took a picture.
//!
//! Each gel has its own lattice, which stays where it is while the picture around it changes. What is left of a
//! difference image without its smooth part shows the markers' edges; pictures of one sensor have them in the same
//! places. On 36 published pairs of two fingers, each picture left out in turn, all 36 are told.

use glam::DVec2;

use super::blur::gaussian;
use super::grid::{Grid, RgbGrid};
use super::resample;
use super::rig::{PadId, lab};
use super::sim::marker_places;

/// The lattice is looked at at this size, pixels.
const SIDE: usize = 128;
/// Deviation of the blur that is taken away, pixels: markers are smaller, touches larger.
const SMOOTH_PX: f64 = 4.0;
/// Deviation of the blur of the edges, pixels: a lattice that moved by less is the same.
const EDGE_PX: f64 = 1.0;
/// Rounds of assigning and averaging; it ends after three or four.
const ROUNDS: usize = 20;
/// Deviations of the blurs of a dot and of what is around it, pixels.
const DOT_PX: f64 = 0.6;
const AROUND_DOT_PX: f64 = 3.0;
/// Mean brightness of a finger's dots, in deviations of the picture, that tells it. Published pictures have 1.0 and more at
/// their own finger's dots, less than 0.4 at the other's.
const BRIGHT: f64 = 0.6;
/// By how much each picture must be more like its own group than like the other. Published pictures of two fingers have
/// .51 to .84; halves of the pictures of one finger, taken apart by chance, less than .2.
const APART: f64 = 0.25;

/// The markers' edges of a square, upright difference image: mean 0, deviation 1. `None` for a flat or broken picture.
pub fn signature(difference: &RgbGrid) -> Option<Grid<f32>> {
    let gray = gray(difference)?;
    let smooth = gaussian(&gray, SMOOTH_PX);
    let edges = Grid::from_fn(SIDE, SIDE, |x, y| (gray[(x, y)] - smooth[(x, y)]).abs());
    standardized(&gaussian(&edges, EDGE_PX))
}

/// The finger of the lab's rig whose GelSlim took an upright difference image, by the places of its markers: without contact
/// they were there, which leaves bright dots in the difference. `None` where the dots are clearly neither's.
pub fn lab_finger(difference: &RgbGrid) -> Option<PadId> {
    let gray = gray(difference)?;
    let (fine, smooth) = (gaussian(&gray, DOT_PX), gaussian(&gray, AROUND_DOT_PX));
    let dots = Grid::from_fn(SIDE, SIDE, |x, y| fine[(x, y)] - smooth[(x, y)]);
    let mut sizes: Vec<f64> = dots.as_slice().iter().map(|v| v.abs()).collect();
    // Edges of the bars are no dots, however bright.
    let most = *sizes.select_nth_unstable_by(dots.len() * 49 / 50, f64::total_cmp).1;
    let dots = dots.map(|v| v.clamp(-most, most));
    let spread = (dots.as_slice().iter().map(|v| v * v).sum::<f64>() / dots.len() as f64).sqrt();
    let scale = lab::GELSLIM.size().map(|full| SIDE as f64 / full as f64);
    let brightness = |finger: PadId| {
        let places = marker_places(finger);
        let of = |px: &DVec2| dots.get(((px.x + 0.5) * scale[0]) as usize, ((px.y + 0.5) * scale[1]) as usize);
        places.iter().filter_map(of).sum::<f64>() / (places.len() as f64 * spread)
    };
    let [right, left] = lab::PADS.map(brightness);
    let (finger, own, other) = if right > left { (lab::RIGHT, right, left) } else { (lab::LEFT, left, right) };
    (own > BRIGHT && own - other > BRIGHT).then_some(finger)
}

/// The picture in gray and at the side that markers are looked at; `None` for one that is empty or not finite.
fn gray(difference: &RgbGrid) -> Option<Grid<f64>> {
    let sound = !difference.is_empty() && difference.as_slice().iter().flatten().all(|v| v.is_finite());
    let gray = |pixel: &[f32; 3]| pixel.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
    sound.then(|| resample::bilinear_rgb(difference, SIDE, SIDE).map(gray))
}

fn standardized(image: &Grid<f64>) -> Option<Grid<f32>> {
    let n = image.len() as f64;
    let mean = image.as_slice().iter().sum::<f64>() / n;
    let deviation = (image.as_slice().iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    (deviation > 1e-9).then(|| image.map(|v| ((v - mean) / deviation) as f32))
}

/// Likeness of two signatures, -1..1.
pub fn likeness(a: &Grid<f32>, b: &Grid<f32>) -> f64 {
    if a.size() != b.size() {
        return 0.0;
    }
    a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>()
        / a.len().max(1) as f64
}

/// Template: what the signatures of one sensor have in common, their median, pixel by pixel. `None` without any.
pub fn template(signatures: &[&Grid<f32>]) -> Option<Grid<f32>> {
    let [width, height] = signatures.first()?.size();
    let mut column = vec![0.0f32; signatures.len()];
    let median = Grid::from_fn(width, height, |x, y| {
        for (value, signature) in column.iter_mut().zip(signatures) {
            *value = signature[(x, y)];
        }
        column.sort_by(f32::total_cmp);
        f64::from(column[(column.len() - 1) / 2] + column[column.len() / 2]) / 2.0
    });
    standardized(&median)
}

/// Sensor of two that took each picture: 0 or 1; all 0 where one sensor took all of them.
pub fn two_groups(signatures: &[Grid<f32>]) -> Vec<usize> {
    let n = signatures.len();
    let one = vec![0; n];
    // The two pictures that are least alike begin.
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    let Some((a, b)) = pairs.min_by(|&(i, j), &(k, l)| {
        likeness(&signatures[i], &signatures[j]).total_cmp(&likeness(&signatures[k], &signatures[l]))
    }) else {
        return one;
    };
    let mut templates = [signatures[a].clone(), signatures[b].clone()];
    let mut groups = one.clone();
    for _ in 0..ROUNDS {
        let next: Vec<usize> =
            signatures.iter().map(|s| usize::from(likeness(s, &templates[1]) > likeness(s, &templates[0]))).collect();
        for (group, kept) in templates.iter_mut().enumerate() {
            let own: Vec<&Grid<f32>> =
                signatures.iter().zip(&next).filter(|(_, g)| **g == group).map(|(s, _)| s).collect();
            if let Some(template) = template(&own) {
                *kept = template;
            }
        }
        if next == groups {
            break;
        }
        groups = next;
    }
    let apart = |(signature, &group): (&Grid<f32>, &usize)| {
        likeness(signature, &templates[group]) - likeness(signature, &templates[1 - group])
    };
    let mut margins: Vec<f64> = signatures.iter().zip(&groups).map(apart).collect();
    margins.sort_by(f64::total_cmp);
    // A picture or two without markers may stand between.
    if margins[n / 8] < APART { one } else { groups }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::{SimConfig, random_grasp, simulate};

    /// A picture of a gel whose markers lie at `phase`, with noise and a touch that differ by `seed`.
    fn picture(phase: f64, seed: u64) -> RgbGrid {
        Grid::from_fn(SIDE, SIDE, |x, y| {
            let marker = |v: usize| (v as f64 / 4.0 + phase).sin();
            let touch = 20.0 * ((x as f64 - 40.0 - seed as f64).powi(2) / -900.0).exp();
            let noise = ((x * 7919 + y * 104_729 + seed as usize * 1_299_721) % 1009) as f64 / 1009.0 - 0.5;
            [(8.0 * marker(x) * marker(y) + touch + 4.0 * noise) as f32; 3]
        })
    }

    #[test]
    fn pictures_of_two_gels_are_told_apart_and_those_of_one_are_not() {
        let of = |phases: &[f64]| -> Vec<Grid<f32>> {
            phases.iter().enumerate().map(|(i, &p)| signature(&picture(p, i as u64)).unwrap()).collect()
        };
        let groups = two_groups(&of(&[0.0, 0.8, 0.0, 0.8, 0.8, 0.0]));
        assert_eq!(groups.iter().map(|g| *g == groups[0]).collect::<Vec<_>>(), [true, false, true, false, false, true]);
        assert_eq!(two_groups(&of(&[0.3; 6])), [0; 6]);
        assert_eq!(two_groups(&of(&[0.3])), [0]);
        assert_eq!(two_groups(&[]), [0usize; 0]);
    }

    #[test]
    fn a_flat_or_broken_picture_has_no_signature() {
        assert_eq!(signature(&Grid::filled(64, 64, [3.0; 3])), None);
        assert_eq!(signature(&Grid::filled(64, 64, [f32::NAN; 3])), None);
        assert_eq!(signature(&Grid::filled(0, 0, [0.0; 3])), None);
        assert_eq!(template(&[]), None);
    }

    /// Of simulated touches, and none of other gels.
    #[test]
    fn the_dots_tell_the_finger() {
        let tools = crate::catalog::tools();
        for number in 0..4 {
            let sensors = if number < 3 { SimConfig::default() } else { SimConfig::randomised(number) };
            let touch = simulate(&tools[2 * number as usize], random_grasp(40 + number), number, &sensors);
            for pad in lab::PADS {
                let found = lab_finger(&touch.pad(pad).unwrap().color().unwrap().difference);
                assert_eq!(found, (number < 3).then_some(pad), "{number}");
            }
        }
        assert_eq!(lab_finger(&Grid::filled(9, 9, [0.0; 3])), None);
        assert_eq!(lab_finger(&Grid::filled(9, 9, [f32::NAN; 3])), None);
    }
}
