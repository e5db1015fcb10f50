//! The GelSlim: a gel pressed onto the tool, lit by three colored LEDs, with black markers.
//!
//! The gel's surface is a sheet on an elastic foundation: flat where the tool presses, then rising with a decay
//! length of under a millimeter, hence the colored streaks with a sharp inner and a fading outer side. Each LED
//! brightens the slopes that face it and darkens the others. Markers move sideways with the stretched gel, so the
//! difference image has a dark and a bright dot for each.

use glam::DVec2;

use super::{GelSlimConfig, rig};
use crate::catalog::ToolSpec;
use crate::frames::PlanarPose;
use crate::grid::RgbGrid;
use crate::noise::{Noise, Stream};
use crate::relax::{Field, Problem};
use crate::rig::{PadId, lab};
use crate::sample::{ColorImages, ColorTouch};

/// Spacing of the grid that the gel is solved on, meters.
const STEP_M: f64 = 0.000_15;
/// Margin of the gel beyond the picture, meters.
const MARGIN_M: f64 = 0.002_4;
/// Pixels of the picture per grid step.
const PX_PER_STEP: f64 = STEP_M * lab::GELSLIM.px_per_m;
/// Grid steps from the first node to the first pixel.
const MARGIN_STEPS: f64 = MARGIN_M / STEP_M;

/// Gel, by the depth that the tool pushes into it, in picture axes (x right, y down), meters.
struct Gel {
    pushed: Field,
}

impl Gel {
    fn press(
        config: &GelSlimConfig,
        tool: &ToolSpec,
        object_from_grasp: PlanarPose,
        finger: PadId,
        noise: &mut Noise,
    ) -> Self {
        let (columns, rows) = grid_size();
        // the two surfaces are never quite parallel
        let tilt = DVec2::new(f64::from(noise.normal()), f64::from(noise.normal())) * config.tilt_rad
            - DVec2::Y * config.lean_rad;
        let depth = config.indentation_m * (1.0 + config.indentation_spread * f64::from(noise.normal()));
        let mut obstacle = Field::filled(columns, rows, f32::NEG_INFINITY);
        for j in 0..rows {
            for i in 0..columns {
                let column = (i as f64 - MARGIN_STEPS) * PX_PER_STEP;
                let row = (j as f64 - MARGIN_STEPS) * PX_PER_STEP;
                let yz = rig::gelslim_yz(finger, column, row);
                if let Some(height) = tool.height(object_from_grasp.transform_yz(yz)) {
                    let push = depth - (tool.half_thickness_m - height) + tilt.dot(yz);
                    obstacle.values[j * columns + i] = push as f32;
                }
            }
        }
        let free = vec![true; columns * rows];
        let stiffness = (config.decay_m * config.decay_m).recip() as f32;
        let problem =
            Problem { obstacle: &obstacle, free: &free, load: 0.0, more: None, stiffness, step: STEP_M as f32 };
        Self { pushed: problem.solve(3, 14) }
    }

    /// A much smoother copy: the sideways movement of the gel follows its slopes.
    fn bulk(&self, length_m: f64) -> Field {
        let (columns, rows) = (self.pushed.columns.div_ceil(4), self.pushed.rows.div_ceil(4));
        let mut mean = Field::filled(columns, rows, 0.0);
        for j in 0..rows {
            for i in 0..columns {
                let (mut sum, mut count) = (0.0, 0.0);
                for y in 4 * j..(4 * j + 4).min(self.pushed.rows) {
                    for x in 4 * i..(4 * i + 4).min(self.pushed.columns) {
                        sum += self.pushed.values[y * self.pushed.columns + x];
                        count += 1.0;
                    }
                }
                mean.values[j * columns + i] = sum / count;
            }
        }
        let sigma = length_m / (4.0 * STEP_M);
        blur(&mut mean, sigma);
        mean
    }
}

/// Gaussian blur as three box blurs along each axis; the border repeats.
pub(crate) fn blur(field: &mut Field, sigma: f64) {
    let radius = ((sigma * sigma + 0.25).sqrt() - 0.5).round() as usize;
    if radius == 0 {
        return;
    }
    let mut line = Vec::new();
    let mut pass = |values: &mut [f32], start: usize, stride: usize, count: usize| {
        line.clear();
        line.extend((0..count).map(|k| values[start + k * stride]));
        let value = |line: &[f32], k: isize| line[k.clamp(0, count as isize - 1) as usize];
        let mut sum: f32 = (-(radius as isize)..=radius as isize).map(|k| value(&line, k)).sum();
        for k in 0..count {
            values[start + k * stride] = sum / (2 * radius + 1) as f32;
            let k = k as isize;
            sum += value(&line, k + radius as isize + 1) - value(&line, k - radius as isize);
        }
    };
    for _ in 0..3 {
        for j in 0..field.rows {
            pass(&mut field.values, j * field.columns, 1, field.columns);
        }
        for i in 0..field.columns {
            pass(&mut field.values, i, field.columns, field.rows);
        }
    }
}

/// The slope of a field at every node, meters per meter.
pub(crate) fn slopes(field: &Field, step: f64) -> [Field; 2] {
    let (columns, rows) = (field.columns, field.rows);
    let mut out = [Field::filled(columns, rows, 0.0), Field::filled(columns, rows, 0.0)];
    let scale = (0.5 / step) as f32;
    for j in 1..rows - 1 {
        for i in 1..columns - 1 {
            let k = j * columns + i;
            out[0].values[k] = (field.values[k + 1] - field.values[k - 1]) * scale;
            out[1].values[k] = (field.values[k + columns] - field.values[k - columns]) * scale;
        }
    }
    out
}

/// Both images of one finger's touch, with whole values in 0..=255.
pub(super) fn touch(
    config: &GelSlimConfig,
    tool: &ToolSpec,
    object_from_grasp: PlanarPose,
    finger: PadId,
    seed: u64,
) -> ColorTouch {
    let mut noise = Noise::new(seed, Stream::Gel, finger.index());
    let gel = Gel::press(config, tool, object_from_grasp, finger, &mut noise);

    let base = illumination(config, finger);
    let markers = marker_grid(config, finger);
    let mut reference = base.clone();
    for &(center, size) in &markers {
        stamp(&mut reference, center, size, config.marker_darkness);
    }
    add_noise(&mut reference, config.noise, &mut Noise::new(config.sensor_seed, Stream::GelReference, finger.index()));

    let mut raw = base;
    shade(&mut raw, config, &gel, &mut noise);
    for (center, size) in moved(&markers, config, &gel, &mut noise) {
        stamp(&mut raw, center, size, config.marker_darkness);
    }
    add_noise(&mut raw, config.noise, &mut Noise::new(seed, Stream::GelNoise, finger.index()));
    let difference = RgbGrid::from_fn(lab::GELSLIM.width, lab::GELSLIM.height, |x, y| {
        std::array::from_fn(|c| raw[(x, y)][c] - reference[(x, y)][c])
    });
    ColorTouch { images: Some(ColorImages { raw, reference }), difference }
}

/// A color at every grid node, for effects that are smooth over a few pixels.
struct Wash {
    columns: usize,
    values: Vec<[f32; 3]>,
}

impl Wash {
    /// From a function of the node's column and row.
    fn new(columns: usize, rows: usize, mut f: impl FnMut(usize, usize) -> [f32; 3]) -> Self {
        let mut values = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                values.push(f(i, j));
            }
        }
        Self { columns, values }
    }

    /// The interpolated picture.
    fn picture(&self) -> RgbGrid {
        let steps: Vec<(usize, f32)> = (0..lab::GELSLIM.width.max(lab::GELSLIM.height))
            .map(|x| {
                let i = x as f64 / PX_PER_STEP + MARGIN_STEPS;
                (i as usize, i.fract() as f32)
            })
            .collect();
        RgbGrid::from_fn(lab::GELSLIM.width, lab::GELSLIM.height, |x, y| {
            let ((i, tx), (j, ty)) = (steps[x], steps[y]);
            let k = j * self.columns + i;
            let (a, b) = (&self.values[k], &self.values[k + 1]);
            let (c, d) = (&self.values[k + self.columns], &self.values[k + self.columns + 1]);
            std::array::from_fn(|n| {
                let top = a[n] + (b[n] - a[n]) * tx;
                let bottom = c[n] + (d[n] - c[n]) * tx;
                top + (bottom - top) * ty
            })
        })
    }
}

/// Columns and rows of the solver's grid.
fn grid_size() -> (usize, usize) {
    (
        (lab::GELSLIM.width as f64 / PX_PER_STEP + 2.0 * MARGIN_STEPS).ceil() as usize + 1,
        (lab::GELSLIM.height as f64 / PX_PER_STEP + 2.0 * MARGIN_STEPS).ceil() as usize + 1,
    )
}

/// The light without contact and without markers: each LED is brighter on its own side.
fn illumination(config: &GelSlimConfig, finger: PadId) -> RgbGrid {
    let mut noise = Noise::new(config.sensor_seed, Stream::GelReference, 8 + finger.index());
    let (columns, rows) = grid_size();
    let stain = noise.smooth(columns, rows, 150.0 / PX_PER_STEP);
    let leds = config.led_directions();
    let middle = DVec2::new(columns as f64, rows as f64) * 0.5;
    let half_width = 0.5 * lab::GELSLIM.width as f64 / PX_PER_STEP;
    Wash::new(columns, rows, |i, j| {
        let p = (DVec2::new(i as f64, j as f64) - middle) / half_width;
        std::array::from_fn(|c| {
            let fall = 1.0 + config.led_falloff * leds[c].dot(p) - 0.12 * (p.length_squared() - 0.5);
            (config.base[c] * fall) as f32 * (1.0 + 0.02 * stain[(i, j)])
        })
    })
    .picture()
}

/// Adds the light and shade of the gel's slopes.
fn shade(image: &mut RgbGrid, config: &GelSlimConfig, gel: &Gel, noise: &mut Noise) {
    let mut pushed = gel.pushed.clone();
    blur(&mut pushed, config.smoothing_m / STEP_M);
    let [slope_x, slope_y] = slopes(&pushed, STEP_M);
    let (columns, rows) = (pushed.columns, pushed.rows);
    let slow: [_; 3] = std::array::from_fn(|_| noise.smooth(columns, rows, 130.0 / PX_PER_STEP));
    let leds = config.led_directions();
    let light = Wash::new(columns, rows, |i, j| {
        // the side of a dent faces away from where it is deepest
        let k = j * columns + i;
        let facing = -DVec2::new(f64::from(slope_x.values[k]), f64::from(slope_y.values[k]));
        let steep = facing.length_squared();
        std::array::from_fn(|c| {
            let light = config.led_gain[c] * leds[c].dot(facing) / (1.0 + 0.35 * steep).sqrt()
                - config.shadow * steep / (1.0 + steep);
            // more light saturates
            let light = light / (1.0 + (light / config.saturation).powi(2)).sqrt();
            (light + config.color_drift * f64::from(slow[c][(i, j)])) as f32
        })
    })
    .picture();
    for (pixel, light) in image.as_mut_slice().iter_mut().zip(light.as_slice()) {
        for c in 0..3 {
            pixel[c] += light[c];
        }
    }
}

/// Center (pixels) and radius (pixels) of each marker without contact.
fn marker_grid(config: &GelSlimConfig, finger: PadId) -> Vec<(DVec2, f64)> {
    let mut noise = Noise::new(config.sensor_seed, Stream::GelReference, 16 + finger.index());
    let pitch = config.marker_pitch_m * lab::GELSLIM.px_per_m;
    let radius = config.marker_radius_m * lab::GELSLIM.px_per_m;
    let center = DVec2::new(0.5 * lab::GELSLIM.width as f64, 0.5 * lab::GELSLIM.height as f64);
    let turn = DVec2::from_angle(config.marker_angle_rad);
    let reach = (lab::GELSLIM.width as f64 / pitch) as i32;
    let mut markers = Vec::new();
    for j in -reach..=reach {
        for i in -reach..=reach {
            let cell = DVec2::new(f64::from(i) + config.marker_phase[0], f64::from(j) + config.marker_phase[1]);
            let jitter = DVec2::new(f64::from(noise.normal()), f64::from(noise.normal())) * 0.03;
            let flat = turn.rotate(cell + jitter) * pitch;
            // the gel is curved: the grid looks wider towards the rim
            let p = center + flat * (1.0 + config.marker_fan * (flat / center.x).length_squared());
            let size = radius * (1.0 + 0.12 * f64::from(noise.normal()));
            let inside = p.cmpge(DVec2::splat(-10.0)).all()
                && p.cmple(DVec2::new(lab::GELSLIM.width as f64, lab::GELSLIM.height as f64) + 10.0).all();
            if inside {
                markers.push((p, size));
            }
        }
    }
    markers
}

/// The markers during the touch: pushed away from the dents, plus the shear and twist of the grasp.
fn moved(markers: &[(DVec2, f64)], config: &GelSlimConfig, gel: &Gel, noise: &mut Noise) -> Vec<(DVec2, f64)> {
    let bulk = gel.bulk(config.spread_m);
    let slopes = slopes(&bulk, 4.0 * STEP_M);
    let shear = DVec2::new(f64::from(noise.normal()), f64::from(noise.normal())) * config.shear_m;
    let twist = f64::from(noise.normal()) * config.twist_rad;
    let deepest = bulk.values.iter().fold(1e-9_f32, |a, &b| a.max(b));
    let center = DVec2::new(0.5 * lab::GELSLIM.width as f64, 0.5 * lab::GELSLIM.height as f64);
    markers
        .iter()
        .map(|&(p, size)| {
            let node = (p / PX_PER_STEP + MARGIN_STEPS) / 4.0 - 0.375;
            let away = -DVec2::new(slopes[0].at(node.x, node.y), slopes[1].at(node.x, node.y));
            // friction drags the gel along where it is pressed
            let held = bulk.at(node.x, node.y) / f64::from(deepest);
            let drag = (shear * lab::GELSLIM.px_per_m + (p - center).perp() * twist) * (0.35 + 0.65 * held);
            (p + away * config.marker_push_m * lab::GELSLIM.px_per_m + drag, size)
        })
        .collect()
}

/// Darkens a soft round spot.
fn stamp(image: &mut RgbGrid, center: DVec2, radius: f64, darkness: f64) {
    let reach = radius + 2.5;
    let span = |c: f64, n: usize| (c - reach).max(0.0) as usize..((c + reach).max(0.0) as usize + 1).min(n);
    for y in span(center.y, image.height()) {
        for x in span(center.x, image.width()) {
            let r = (DVec2::new(x as f64, y as f64) - center).length();
            let cover = (0.5 + (radius - r) / 2.4).clamp(0.0, 1.0);
            let keep = (1.0 - darkness * cover * cover * (3.0 - 2.0 * cover)) as f32;
            for value in &mut image[(x, y)] {
                *value *= keep;
            }
        }
    }
}

/// Adds sensor noise and rounds to the camera's whole values.
fn add_noise(image: &mut RgbGrid, deviation: f64, noise: &mut Noise) {
    let deviation = deviation as f32;
    for pixel in image.as_mut_slice() {
        for value in pixel {
            *value = (*value + deviation * noise.normal()).round().clamp(0.0, 255.0);
        }
    }
}
