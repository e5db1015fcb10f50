//! The GelSlim: a gel pressed onto the tool, lit by three colored LEDs, with black markers.
//!
//! The gel's surface is a sheet on an elastic foundation: flat where the tool presses, then rising with a decay
//! length of under a millimeter, hence the colored streaks with a sharp inner and a fading outer side. Each LED
//! brightens the slopes that face it and darkens the others. Markers move sideways with the stretched gel, so the
//! difference image has a dark and a bright dot for each.

use glam::DVec2;

use super::{GelSlimConfig, Lens, rig};
use crate::catalog::ToolSpec;
use crate::frames::PlanarPose;
use crate::grid::RgbGrid;
use crate::noise::{Noise, Stream};
use crate::relax::{Field, Problem};
use crate::rig::{PadId, lab};
use crate::sample::ColorTouch;

/// Spacing of the grid that the gel is solved on, meters.
const STEP_M: f64 = 0.000_15;
/// Margin of the gel beyond the picture, meters.
const MARGIN_M: f64 = 0.002_4;
/// Half the width of the picture, on which the light falls off, meters.
const HALF_WIDTH_M: f64 = 0.009;
/// Lengths of the gel's stains, and of the slow change of its colors, meters.
const STAIN_M: f64 = 0.006_3;
const DRIFT_M: f64 = 0.005_5;

/// Grid on the gel, along the picture's axes (right, down), and where the pixels of the picture lie in it.
struct Frame {
    lens: Lens,
    columns: usize,
    rows: usize,
    /// For each pixel the place in the grid, in steps.
    nodes: Vec<[f32; 2]>,
}

impl Frame {
    fn new(lens: Lens) -> Self {
        let half = (lens.half_extent() + MARGIN_M) / STEP_M;
        let (columns, rows) = (2 * half.x.ceil() as usize + 1, 2 * half.y.ceil() as usize + 1);
        let mut frame = Self { lens, columns, rows, nodes: Vec::new() };
        let (width, height) = (lab::GELSLIM.width, lab::GELSLIM.height);
        let pixels = (0..width * height).map(|i| DVec2::new((i % width) as f64, (i / width) as f64));
        let view = lens.view();
        frame.nodes = pixels.map(|px| frame.node(view(px)).as_vec2().to_array()).collect();
        frame
    }

    fn middle(&self) -> DVec2 {
        DVec2::new((self.columns / 2) as f64, (self.rows / 2) as f64)
    }

    /// Place in the grid, in steps, of a place on the gel, meters from the picture's middle.
    fn node(&self, flat: DVec2) -> DVec2 {
        flat / STEP_M + self.middle()
    }

    /// The inverse of [`Frame::node`].
    fn flat(&self, i: usize, j: usize) -> DVec2 {
        (DVec2::new(i as f64, j as f64) - self.middle()) * STEP_M
    }

    /// The picture of a color at every node.
    fn picture(&self, mut color: impl FnMut(usize, usize) -> [f32; 3]) -> RgbGrid {
        let mut values = Vec::with_capacity(self.columns * self.rows);
        for j in 0..self.rows {
            for i in 0..self.columns {
                values.push(color(i, j));
            }
        }
        RgbGrid::from_fn(lab::GELSLIM.width, lab::GELSLIM.height, |x, y| {
            let [i, j] = self.nodes[y * lab::GELSLIM.width + x];
            let (tx, ty) = (i.fract(), j.fract());
            let k = j as usize * self.columns + i as usize;
            let (a, b) = (&values[k], &values[k + 1]);
            let (c, d) = (&values[k + self.columns], &values[k + self.columns + 1]);
            std::array::from_fn(|n| {
                let top = a[n] + (b[n] - a[n]) * tx;
                let bottom = c[n] + (d[n] - c[n]) * tx;
                top + (bottom - top) * ty
            })
        })
    }
}

/// Gel, by the depth that the tool pushes into it, meters.
struct Gel {
    pushed: Field,
}

impl Gel {
    fn press(
        config: &GelSlimConfig,
        tool: &ToolSpec,
        object_from_grasp: PlanarPose,
        finger: PadId,
        frame: &Frame,
        noise: &mut Noise,
    ) -> Self {
        let (columns, rows) = (frame.columns, frame.rows);
        // the two surfaces are never quite parallel
        let tilt = DVec2::new(f64::from(noise.normal()), f64::from(noise.normal())) * config.tilt_rad
            + DVec2::new(rig::outward(finger) * config.roll_rad, -config.lean_rad);
        let depth = config.indentation_m * (1.0 + config.indentation_spread * f64::from(noise.normal()));
        let mut obstacle = Field::filled(columns, rows, f32::NEG_INFINITY);
        let solid = tool.solid();
        for j in 0..rows {
            for i in 0..columns {
                let yz = rig::gelslim_yz(finger, frame.flat(i, j));
                if let Some(height) = solid.height(object_from_grasp.transform_yz(yz)) {
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
fn blur(field: &mut Field, sigma: f64) {
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
fn slopes(field: &Field, step: f64) -> [Field; 2] {
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
    let frame = Frame::new(config.lenses[finger.index()]);
    let gel = Gel::press(config, tool, object_from_grasp, finger, &frame, &mut noise);

    let base = illumination(config, finger, &frame);
    let markers = marker_grid(config, finger, &frame);
    let mut reference = base.clone();
    for &(place, size) in &markers {
        stamp(&mut reference, &frame.lens, place, size, config.marker_darkness);
    }
    add_noise(&mut reference, config.noise, &mut Noise::new(config.sensor_seed, Stream::GelReference, finger.index()));

    let mut raw = base;
    shade(&mut raw, config, &gel, &frame, &mut noise);
    for (place, size) in moved(&markers, config, &gel, &frame, &mut noise) {
        stamp(&mut raw, &frame.lens, place, size, config.marker_darkness);
    }
    add_noise(&mut raw, config.noise, &mut Noise::new(seed, Stream::GelNoise, finger.index()));
    ColorTouch::from_images(raw, reference).expect("both pictures have the size of the sensor")
}

/// The light without contact and without markers: each LED is brighter on its own side.
fn illumination(config: &GelSlimConfig, finger: PadId, frame: &Frame) -> RgbGrid {
    let mut noise = Noise::new(config.sensor_seed, Stream::GelReference, 8 + finger.index());
    let stain = noise.smooth(frame.columns, frame.rows, STAIN_M / STEP_M);
    let leds = config.led_directions();
    frame.picture(|i, j| {
        let p = frame.flat(i, j) / HALF_WIDTH_M;
        std::array::from_fn(|c| {
            let fall = 1.0 + config.led_falloff * leds[c].dot(p) - 0.12 * (p.length_squared() - 0.5);
            (config.base[c] * fall) as f32 * (1.0 + 0.02 * stain[(i, j)])
        })
    })
}

/// Adds the light and shade of the gel's slopes.
fn shade(image: &mut RgbGrid, config: &GelSlimConfig, gel: &Gel, frame: &Frame, noise: &mut Noise) {
    let mut pushed = gel.pushed.clone();
    blur(&mut pushed, config.smoothing_m / STEP_M);
    let [slope_x, slope_y] = slopes(&pushed, STEP_M);
    let (columns, rows) = (pushed.columns, pushed.rows);
    let slow: [_; 3] = std::array::from_fn(|_| noise.smooth(columns, rows, DRIFT_M / STEP_M));
    let leds = config.led_directions();
    let light = frame.picture(|i, j| {
        // the side of a dent faces away from where it is deepest
        let k = j * columns + i;
        let facing = -DVec2::new(f64::from(slope_x.values[k]), f64::from(slope_y.values[k]));
        let steep = facing.length_squared();
        std::array::from_fn(|c| {
            let light = config.led_gain[c] * leds[c].dot(facing) / (1.0 + 0.35 * steep).sqrt()
                - config.shadow * steep / (1.0 + steep);
            // more light saturates
            let light = light / (1.0 + (light / config.saturation).powi(2)).sqrt();
            (light + config.color_drift[c] * f64::from(slow[c][(i, j)])) as f32
        })
    });
    image.add(&light);
}

/// Places on the gel, meters, by the cell of a finger's marker lattice and the marker's own shift, in cells.
fn lattice(config: &GelSlimConfig, finger: PadId, lens: &Lens) -> impl Fn(DVec2, DVec2) -> DVec2 {
    let (pitch, phase) = (config.marker_pitch_m, DVec2::from_array(config.marker_phase[finger.index()]));
    let center = lens.flat(DVec2::from_array(lens.center_px));
    let turn = DVec2::from_angle(config.marker_angle_rad[finger.index()] + lens.turn_rad);
    move |cell, shift| center + turn.rotate(cell + phase + shift) * pitch
}

/// Places of the markers of one of the lab's GelSlims without contact, pixels of its picture.
pub(crate) fn marker_places(finger: PadId) -> Vec<DVec2> {
    let config = GelSlimConfig::default();
    let lens = config.lenses[finger.index()];
    let place = lattice(&config, finger, &lens);
    let size = DVec2::new(lab::GELSLIM.width as f64, lab::GELSLIM.height as f64);
    let cells = (-8..=8).flat_map(|j| (-8..=8).map(move |i| DVec2::new(f64::from(i), f64::from(j))));
    let places = cells.map(|cell| lens.pixel(place(cell, DVec2::ZERO)));
    places.filter(|px| px.cmpgt(DVec2::ZERO).all() && px.cmplt(size - 1.0).all()).collect()
}

/// Place on the gel and radius of each marker without contact, meters.
fn marker_grid(config: &GelSlimConfig, finger: PadId, frame: &Frame) -> Vec<(DVec2, f64)> {
    let mut noise = Noise::new(config.sensor_seed, Stream::GelReference, 16 + finger.index());
    let (pitch, at) = (config.marker_pitch_m, lattice(config, finger, &frame.lens));
    let extent = frame.lens.half_extent() + pitch;
    let reach = (extent.x / pitch) as i32 + 2;
    let mut markers = Vec::new();
    for j in -reach..=reach {
        for i in -reach..=reach {
            let jitter = DVec2::new(f64::from(noise.normal()), f64::from(noise.normal())) * 0.03;
            let place = at(DVec2::new(f64::from(i), f64::from(j)), jitter);
            let size = config.marker_radius_m * (1.0 + 0.12 * f64::from(noise.normal()));
            if place.abs().cmple(extent).all() {
                markers.push((place, size));
            }
        }
    }
    markers
}

/// The markers during the touch: pushed away from the dents, drawn along and apart by the grip, sheared and twisted.
fn moved(
    markers: &[(DVec2, f64)],
    config: &GelSlimConfig,
    gel: &Gel,
    frame: &Frame,
    noise: &mut Noise,
) -> Vec<(DVec2, f64)> {
    let bulk = gel.bulk(config.spread_m);
    let slopes = slopes(&bulk, 4.0 * STEP_M);
    let shear = DVec2::new(f64::from(noise.normal()), f64::from(noise.normal())) * config.shear_m;
    let twist = f64::from(noise.normal()) * config.twist_rad;
    markers
        .iter()
        .map(|&(place, size)| {
            let node = frame.node(place) / 4.0 - 0.375;
            let away = -DVec2::new(slopes[0].at(node.x, node.y), slopes[1].at(node.x, node.y));
            let drag = DVec2::X * config.drag_m + shear + place * config.dilation + place.perp() * twist;
            (place + away * config.marker_push_m + drag, size)
        })
        .collect()
}

/// Darkens a soft round spot at a place on the gel.
fn stamp(image: &mut RgbGrid, lens: &Lens, place: DVec2, radius_m: f64, darkness: f64) {
    /// Width of the spot's edge, pixels.
    const EDGE: f64 = 3.8;
    let center = lens.pixel(place);
    let radius = radius_m * lens.scale(center);
    let reach = radius + EDGE;
    let span = |c: f64, n: usize| ((c - reach).max(0.0) as usize).min(n)..((c + reach).max(0.0) as usize + 1).min(n);
    for y in span(center.y, image.height()) {
        for x in span(center.x, image.width()) {
            let r = (DVec2::new(x as f64, y as f64) - center).length();
            let cover = (0.5 + (radius - r) / EDGE).clamp(0.0, 1.0);
            let keep = (1.0 - darkness * cover * cover * (3.0 - 2.0 * cover)) as f32;
            for value in &mut image[(x, y)] {
                *value *= keep;
            }
        }
    }
}

/// Adds sensor noise and rounds to the camera's whole values.
fn add_noise(image: &mut RgbGrid, deviations: [f64; 3], noise: &mut Noise) {
    for pixel in image.as_mut_slice() {
        for (value, deviation) in pixel.iter_mut().zip(deviations) {
            *value = (*value + deviation as f32 * noise.normal()).round().clamp(0.0, 255.0);
        }
    }
}
