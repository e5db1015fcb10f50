//! The simulated sensors' settings.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::Lens;
use crate::noise::{Noise, Stream};
use crate::rig::lab;

/// One pair of sensors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimConfig {
    /// The Soft Bubbles.
    pub bubble: BubbleConfig,
    /// The GelSlims.
    pub gelslim: GelSlimConfig,
    /// True where the first finger's bubble alone is simulated, for a small picture.
    pub first_bubble_alone: bool,
}

/// Press of the nominal bubble, at which its camera is as far from the tool as the rig says.
pub(super) const NOMINAL_PRESS_M: f64 = 0.0129;

/// A Soft Bubble and its depth camera. Lengths in meters.
#[derive(Clone, Debug, PartialEq)]
pub struct BubbleConfig {
    /// Distance that the dome would reach past the tool's surface if the tool were not there.
    pub press_m: f64,
    /// Height of the dome over its rim.
    pub dome_rise_m: f64,
    /// Share by which the dome is fuller than a paraboloid.
    pub dome_fullness: f64,
    /// Semi-axes of the rim along y and z.
    pub rim_semi_axes_m: [f64; 2],
    /// Center of the rim, (y, z), of the right and of the left finger.
    pub rim_centers_m: [[f64; 2]; 2],
    /// Slope of the rim's plane along z.
    pub rim_tilt: f64,
    /// Pressure during the touch over the tension of the flat membrane, 1/m.
    pub pressure_per_m: f64,
    /// Growth of the tension with the stretch: 0 for a soap film, 1 for a linear membrane.
    pub stiffening: f64,
    /// Distance by which the reference image is nearer than the dome.
    pub reference_m: f64,
    /// Deviation of the camera's noise in one frame.
    pub noise_m: f64,
    /// Deviation of the slow distortion of one frame.
    pub drift_m: f64,
    /// Deviation of the fixed grain.
    pub texture_m: f64,
    /// Largest speckle.
    pub speckle_m: f64,
    /// Speckles per pixel.
    pub speckle_density: f64,
    /// Weight of each neighbor in the camera's blur, 0..0.33.
    pub blur: f32,
    /// Share of the pixels at a depth step that fly between its two sides.
    pub flying_share: f64,
    /// Share of pixels that are dropped and read 0.
    pub dropped_share: f64,
    /// Deviation of the calibration's translation error (the true camera is where the sample says plus this).
    pub calibration_m: f64,
    /// Deviation of the calibration's angle error, radians.
    pub calibration_rad: f64,
    /// Seed of the sensor's fixed texture: one sensor has one.
    pub texture_seed: u64,
}

impl BubbleConfig {
    /// A soap film that reaches the middle plane of a tool.
    pub fn film(half_thickness_m: f64) -> Self {
        Self {
            // The free membrane was seen somewhat nearer than it is pressed on.
            press_m: half_thickness_m + 3.5e-3,
            dome_rise_m: 0.028,
            dome_fullness: 0.0,
            rim_tilt: 0.04,
            pressure_per_m: 28.0,
            stiffening: 0.0,
            ..Self::default()
        }
    }
}

impl Default for BubbleConfig {
    fn default() -> Self {
        Self {
            press_m: NOMINAL_PRESS_M,
            dome_rise_m: 0.0354,
            dome_fullness: 0.03,
            rim_semi_axes_m: [0.0626, 0.076],
            rim_centers_m: [[-0.0025, -0.0282], [0.0021, -0.0286]],
            rim_tilt: 0.177,
            pressure_per_m: 56.0,
            stiffening: 4.78,
            reference_m: 0.0019,
            noise_m: 0.000_6,
            drift_m: 0.000_25,
            texture_m: 0.000_5,
            speckle_m: 0.002_2,
            speckle_density: 0.012,
            blur: 0.18,
            flying_share: 0.35,
            dropped_share: 0.000_3,
            calibration_m: 0.0,
            calibration_rad: 0.0,
            texture_seed: 1,
        }
    }
}

/// A GelSlim. Lengths in meters, brightness on the 0..255 scale.
#[derive(Clone, Debug, PartialEq)]
pub struct GelSlimConfig {
    /// Depth to which the tool is pushed in.
    pub indentation_m: f64,
    /// Relative deviation of the depth from grasp to grasp.
    pub indentation_spread: f64,
    /// Deviation of the angle between gel and tool, radians.
    pub tilt_rad: f64,
    /// Tilt by which the gel presses less deep towards the tool's tip, radians.
    pub lean_rad: f64,
    /// Tilt by which it presses deeper towards the top of the picture, radians.
    pub roll_rad: f64,
    /// Length over which the gel rises beside a dent.
    pub decay_m: f64,
    /// Blur of the surface.
    pub smoothing_m: f64,
    /// Directions of the red, green and blue LED in the picture, radians from +x (right) towards +y (down).
    pub led_angle_rad: [f64; 3],
    /// Brightness change per unit of slope, per channel.
    pub led_gain: [f64; 3],
    /// Relative brightness gained towards an LED, at the picture's edge.
    pub led_falloff: f64,
    /// Mean brightness without contact.
    pub base: [f64; 3],
    /// Largest change of brightness.
    pub saturation: f64,
    /// Darkening of steep slopes.
    pub shadow: f64,
    /// Slow color change from touch to touch, per channel.
    pub color_drift: [f64; 3],
    /// The lens of the right and of the left finger.
    pub lenses: [Lens; 2],
    /// Distance of the markers.
    pub marker_pitch_m: f64,
    /// Radius of a marker.
    pub marker_radius_m: f64,
    /// Offset of the marker grid from the lens's center, in pitches, right and left finger.
    pub marker_phase: [[f64; 2]; 2],
    /// Rotation of the marker grid, radians, right and left finger.
    pub marker_angle_rad: [f64; 2],
    /// Share of the light that a marker takes, 0..1.
    pub marker_darkness: f64,
    /// Sideways movement per unit slope of the bulk.
    pub marker_push_m: f64,
    /// Smoothing of the bulk.
    pub spread_m: f64,
    /// Way that the grip draws the gel towards the tip.
    pub drag_m: f64,
    /// Widening of the gel under the grip, relative.
    pub dilation: f64,
    /// Deviation of the grasp's shear.
    pub shear_m: f64,
    /// Deviation of the grasp's twist, radians.
    pub twist_rad: f64,
    /// Deviation of the camera's noise, per channel.
    pub noise: [f64; 3],
    /// Seed of the sensor's fixed traits: one sensor has one.
    pub sensor_seed: u64,
}

impl Default for GelSlimConfig {
    /// Measured on published pictures of the lab's two GelSlims.
    fn default() -> Self {
        Self {
            indentation_m: 0.001_05,
            indentation_spread: 0.12,
            tilt_rad: 0.03,
            lean_rad: 0.074,
            roll_rad: 0.025,
            decay_m: 0.000_65,
            smoothing_m: 0.000_06,
            led_angle_rad: lab::GELSLIM_LED_ANGLE_RAD,
            led_gain: lab::GELSLIM_LED_GAIN,
            led_falloff: 0.16,
            base: [78.0, 102.0, 147.0],
            saturation: 150.0,
            shadow: 20.0,
            color_drift: [2.5, 0.9, 2.2],
            lenses: Lens::LAB,
            marker_pitch_m: 0.001_42,
            marker_radius_m: 0.000_135,
            marker_phase: [[0.72, 0.03], [0.44, 0.07]],
            marker_angle_rad: [0.023, -0.030],
            marker_darkness: 0.32,
            marker_push_m: 0.001_2,
            spread_m: 0.001_6,
            drag_m: 0.000_15,
            dilation: 0.026,
            shear_m: 0.000_06,
            twist_rad: 0.003,
            noise: [2.7, 1.5, 1.9],
            sensor_seed: 1,
        }
    }
}

/// The sensors that grasps are simulated with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensors {
    /// The nominal ones.
    #[default]
    Nominal,
    /// Another pair, drawn by this seed as training draws them ([`SimConfig::randomised`]).
    Drawn(u64),
    /// The nominal bubbles with GelSlims in other colors and with other dots, drawn by this seed: twice as far from the
    /// nominal ones as those of the training, so that most lie outside of what is trained on.
    OtherGelslims(u64),
}

impl Sensors {
    /// Another pair by its seed, or other GelSlims by theirs; the nominal ones without either.
    ///
    /// # Errors
    /// If both are named.
    pub fn named(drawn: Option<u64>, gelslims: Option<u64>) -> Result<Self, &'static str> {
        match (drawn, gelslims) {
            (Some(_), Some(_)) => Err("name other sensors or other GelSlims, not both"),
            (Some(seed), None) => Ok(Self::Drawn(seed)),
            (None, Some(seed)) => Ok(Self::OtherGelslims(seed)),
            (None, None) => Ok(Self::Nominal),
        }
    }

    /// Settings of these sensors.
    pub fn config(self) -> SimConfig {
        match self {
            Self::Nominal => SimConfig::default(),
            Self::Drawn(seed) => SimConfig::randomised(seed),
            Self::OtherGelslims(seed) => {
                let gelslim = GelSlimConfig::default().in_other_colors(&SimConfig::randomised(seed).gelslim);
                SimConfig { gelslim, ..SimConfig::default() }
            }
        }
    }
}

impl GelSlimConfig {
    /// This GelSlim with its colors and dots moved twice as far as `drawn` has them; the gel stays.
    fn in_other_colors(self, drawn: &Self) -> Self {
        let beyond = |from: f64, to: f64| from + 2.0 * (to - from);
        let each = |from: [f64; 3], to: [f64; 3]| std::array::from_fn(|c| beyond(from[c], to[c]));
        Self {
            led_angle_rad: each(self.led_angle_rad, drawn.led_angle_rad),
            led_gain: each(self.led_gain, drawn.led_gain),
            base: each(self.base, drawn.base),
            marker_pitch_m: beyond(self.marker_pitch_m, drawn.marker_pitch_m),
            marker_radius_m: beyond(self.marker_radius_m, drawn.marker_radius_m),
            marker_angle_rad: drawn.marker_angle_rad,
            marker_phase: drawn.marker_phase,
            sensor_seed: drawn.sensor_seed,
            ..self
        }
    }

    /// Unit vectors towards the LEDs, picture axes.
    pub(super) fn led_directions(&self) -> [DVec2; 3] {
        self.led_angle_rad.map(DVec2::from_angle)
    }
}

impl SimConfig {
    /// Another pair of sensors, drawn around the nominal one: for training that must not depend on one sensor.
    pub fn randomised(seed: u64) -> Self {
        let mut noise = Noise::new(seed, Stream::Config, 0);
        let (b, g) = (BubbleConfig::default(), GelSlimConfig::default());
        // The lab's grip varies by 1.3 mm; its bubble hardly. A GelSlim image does not tell which bubble belongs to it: a wide
        // range would only blur what is learnt.
        let press_m = b.press_m + noise.uniform(-0.0022, 0.0022);
        let rim_centers_m = b.rim_centers_m.map(|center| center.map(|c| c + noise.uniform(-0.001, 0.001)));
        let lean_rad = noise.uniform(0.03, 0.11);
        let smoothing_m = noise.uniform(0.000_03, 0.000_12);
        let lenses = g.lenses.map(|lens| {
            let second = noise.uniform(-0.43, -0.28);
            Lens {
                center_px: lens.center_px.map(|c| c + noise.uniform(-6.0, 6.0)),
                px_per_m: lens.px_per_m * noise.uniform(0.97, 1.03),
                radial: [second, -0.45 * second],
                turn_rad: lens.turn_rad + noise.uniform(-0.01, 0.01),
            }
        });
        let mut around = |nominal: f64, spread: f64| nominal * noise.uniform(1.0 - spread, 1.0 + spread);
        let bubble = BubbleConfig {
            press_m,
            dome_rise_m: around(b.dome_rise_m, 0.03),
            dome_fullness: b.dome_fullness,
            rim_semi_axes_m: b.rim_semi_axes_m.map(|a| around(a, 0.02)),
            rim_centers_m,
            rim_tilt: around(b.rim_tilt, 0.2),
            pressure_per_m: around(b.pressure_per_m, 0.07),
            stiffening: around(b.stiffening, 0.25),
            reference_m: around(b.reference_m, 0.3),
            noise_m: around(b.noise_m, 0.4),
            drift_m: around(b.drift_m, 0.6),
            texture_m: around(b.texture_m, 0.4),
            speckle_m: around(b.speckle_m, 0.4),
            speckle_density: around(b.speckle_density, 0.5),
            blur: around(0.12, 0.5) as f32,
            flying_share: around(b.flying_share, 0.8),
            dropped_share: around(b.dropped_share, 1.0),
            calibration_m: b.calibration_m,
            calibration_rad: b.calibration_rad,
            texture_seed: seed ^ 0x5EED_B0BB,
        };
        let gelslim = GelSlimConfig {
            indentation_m: around(g.indentation_m, 0.3),
            indentation_spread: around(g.indentation_spread, 0.5),
            tilt_rad: around(g.tilt_rad, 0.6),
            lean_rad,
            roll_rad: around(g.roll_rad, 1.5),
            decay_m: around(g.decay_m, 0.3),
            smoothing_m,
            led_angle_rad: g.led_angle_rad.map(|a| a + around(1.0, 0.22) - 1.0),
            led_gain: g.led_gain.map(|a| around(a, 0.35)),
            led_falloff: around(g.led_falloff, 0.7),
            base: g.base.map(|a| around(a, 0.15)),
            saturation: around(g.saturation, 0.3),
            shadow: around(g.shadow, 0.6),
            color_drift: g.color_drift.map(|drift| around(drift, 0.8)),
            lenses,
            marker_pitch_m: around(g.marker_pitch_m, 0.12),
            marker_radius_m: around(g.marker_radius_m, 0.2),
            marker_phase: g.marker_phase.map(|phase| phase.map(|_| around(0.5, 1.0))),
            marker_angle_rad: g.marker_angle_rad.map(|_| around(1.0, 0.05) - 1.0),
            marker_darkness: around(g.marker_darkness, 0.3),
            marker_push_m: around(g.marker_push_m, 0.4),
            spread_m: around(g.spread_m, 0.3),
            drag_m: around(g.drag_m, 1.0),
            dilation: around(g.dilation, 0.6),
            shear_m: around(g.shear_m, 0.8),
            twist_rad: around(g.twist_rad, 0.9),
            noise: g.noise.map(|deviation| around(deviation, 0.5)),
            sensor_seed: seed ^ 0x5EED_6E15,
        };
        Self { bubble, gelslim, ..Self::default() }
    }
}
