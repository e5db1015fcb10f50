//! Lower bounds of the membrane's cost over a box of poses.

use super::cost::{Patch, Read};
use super::pyramid::SLOPES;
use super::template::BandField;
use crate::align::batch::{Extent, State};
use crate::align::lanes::{LANES, Located};
use crate::align::windows::Floor;
use crate::tent::STEP_M;

/// Nodes by which a place may be off, because it is kept in f32.
const ROUNDED: f32 = 2e-4;

impl BandField {
    /// Lower bound of a patch's cost anywhere in a box of states about `state`, as shares of the kernel's square, summed
    /// over the places. May stop at `enough`.
    ///
    /// A place moves by at most its way, so the template there lies between the values of a window, and the residual is at
    /// least as far from zero as these leave it. For short ways the kernel lies above its tangent less what bends, as in
    /// [`DistanceField::bound`](crate::field::DistanceField).
    pub(super) fn floor(&self, patch: &Patch, state: State, kernel_m: f64, extent: Extent, enough: f64) -> Floor {
        /// Steps between two looks at the sum.
        const LOOK: usize = 4;
        let windows = self.pyramid.over(&self.field);
        let motion = self.motion(state);
        let scale = (1.0 / kernel_m) as f32;
        let turn = extent.half[0] as f32;
        let bow = 0.51 * turn * turn;
        let [half_y, half_z] = [extent.half[1], extent.half[2]].map(|half| (half / STEP_M) as f32 + ROUNDED);
        let zero = [0f32; LANES];
        let (mut low, mut here) = (zero, zero);
        let mut slope = [zero; 3];
        let sum = |lanes: &[f32; LANES]| lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        let mut tangents = false;
        for (i, at) in (0..patch.y.len()).step_by(LANES).enumerate() {
            let Read { ay, az, r, gy, gz, template, twist, at: located } = self.read(patch, at, motion);
            let Located { index, fy, fz, .. } = located;
            let mut counts = [1f32; LANES];
            if patch.len() < at + LANES {
                counts[patch.len() - at..].fill(0.0);
            }
            let (mut wy, mut wz) = (zero, zero);
            for l in 0..LANES {
                wy[l] = half_y + turn * az[l].abs() + bow * ay[l].abs();
                wz[l] = half_z + turn * ay[l].abs() + bow * az[l].abs();
            }
            let most = wy.iter().chain(&wz).fold(0f32, |most, way| if *way > most { *way } else { most });
            let (mut lowest, mut highest) = ([f32::NEG_INFINITY; LANES], [f32::INFINITY; LANES]);
            if let Some(values) = windows.values.iter().find(|range| most <= range.reach as f32) {
                for (l, index) in index.iter().enumerate() {
                    let [down, up] = values.cells[*index];
                    (lowest[l], highest[l]) = (-down, up);
                }
            }
            let (mut f, mut least) = (zero, zero);
            let slopes = windows.slopes.iter().zip(SLOPES).find(|(_, reach)| most <= *reach as f32);
            let Some((slopes, _)) = slopes else {
                for l in 0..LANES {
                    here[l] += counts[l] * share(r[l] * scale);
                    low[l] += counts[l] * share(beyond(lowest[l], highest[l], template[l] - r[l]) * scale);
                }
                if !tangents && i % LOOK == LOOK - 1 && sum(&low) >= enough {
                    break;
                }
                continue;
            };
            tangents = true;
            let mut ranges = [zero; 4];
            for (l, index) in index.iter().enumerate() {
                for (range, value) in ranges.iter_mut().zip(slopes.cells[*index]) {
                    range[l] = value;
                }
            }
            let [my, mz, hy, hz] = ranges;
            for l in 0..LANES {
                // Within one cell the slope is known.
                let stays = fy[l] >= wy[l] && fy[l] + wy[l] <= 1.0 && fz[l] >= wz[l] && fz[l] + wz[l] <= 1.0;
                let my = if stays { gy[l] } else { my[l] };
                let mz = if stays { gz[l] } else { mz[l] };
                let hy = if stays { twist[l].abs() * wz[l] } else { hy[l] };
                let hz = if stays { 0.0 } else { hz[l] };
                let unsure = hy * wy[l] + hz * wz[l];
                let change = my.abs() * wy[l] + mz.abs() * wz[l] + unsure;
                let lowest = if lowest[l] > template[l] - change { lowest[l] } else { template[l] - change };
                let highest = if highest[l] < template[l] + change { highest[l] } else { template[l] + change };
                least[l] = share(beyond(lowest, highest, template[l] - r[l]) * scale);
                let r = r[l] * scale;
                f[l] = share(r);
                here[l] += counts[l] * f[l];
                let ratio = 1.0 / (1.0 + r * r);
                let pull = 2.0 * r * ratio * ratio;
                let arm = ay[l].abs() + az[l].abs();
                let steep = if my.abs() > mz.abs() { my.abs() } else { mz.abs() };
                let lost = pull.abs() * (unsure + steep * bow * arm) * scale + bends(r.abs(), change * scale);
                let tangent = if lost < 0.5 * (f[l] - least[l]) { counts[l] } else { 0.0 };
                low[l] += tangent * (f[l] - lost) + (counts[l] - tangent) * least[l];
                let pull = tangent * pull * scale;
                slope[0][l] += pull * (mz * ay[l] - my * az[l]);
                slope[1][l] += pull * my;
                slope[2][l] += pull * mz;
            }
        }
        let [turn, y, z] = slope.map(|lanes| sum(&lanes));
        Floor { low: sum(&low), slope: [turn, y / STEP_M, z / STEP_M], here: sum(&here) }
    }
}

/// Cost of a residual in widths of the kernel.
#[inline]
fn share(r: f32) -> f32 {
    r * r / (1.0 + r * r)
}

/// Distance of a value from the numbers between two.
#[inline]
fn beyond(lowest: f32, highest: f32, value: f32) -> f32 {
    let (under, over) = (lowest - value, value - highest);
    let most = if under > over { under } else { over };
    if most > 0.0 { most } else { 0.0 }
}

/// Height by which [`share`] can fall below its tangent at a residual within `change` of it: the bend grows up to one
/// width of the kernel and falls from there on.
#[inline]
fn bends(size: f32, change: f32) -> f32 {
    let (near, far) = (size - change, size + change);
    let near = if near > 1.0 { near } else { 1.0 };
    let worst = if far < 1.0 { far } else { near };
    let square = worst * worst;
    let below = 1.0 + square;
    let bend = (3.0 * square - 1.0) / (below * below * below);
    if bend > 0.0 { bend * change * change } else { 0.0 }
}
