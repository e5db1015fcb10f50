//! A rig as a file declares it: read, and refused where its numbers cannot be those of a gripper, because every length and
//! every file name of the data set follows from them.

use serde::Deserialize;

use super::{CameraTolerance, Crop, Rig, Sensor, Text, Window, lab};
use crate::text::is_unprintable;

/// Sensors and pads at most.
const MOST: usize = 100;
/// Letters of a key, which becomes part of file names, at most.
const LONGEST_KEY: usize = 32;
/// Letters of a name for people at most.
const LONGEST_NAME: usize = 80;
/// Columns or rows of a stored picture at most.
const LARGEST_SIDE: usize = 4096;
/// Columns or rows of a camera's full picture at most.
const LARGEST_FULL: usize = 65_536;
/// Pixels per meter that a tactile sensor can have: 10 mm to 1 um for a pixel.
const PX_PER_M: std::ops::RangeInclusive<f64> = 100.0..=1e6;
/// Standard deviations of a camera's mount, degrees and millimeters, at most.
const TOLERANCE_DEG: f64 = 20.0;
const TOLERANCE_MM: f64 = 20.0;
/// A window is at most this many times as wide or high as the picture that it lies in.
const LARGEST_WINDOW: f64 = 10.0;
/// Words that end the names of other pictures of a touch, or stand for all fingers.
const TAKEN: [&str; 4] = ["touch", "reference", "vqvae", "both"];

/// The lab's rig with other cameras' mounts.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OfTheLab {
    camera_tolerance: CameraTolerance,
}

impl Rig {
    /// A rig declared in JSON: the whole of it, or only how well the cameras of the lab's are mounted.
    ///
    /// # Errors
    /// Fault of the declaration, in words.
    pub fn parse(json: &[u8]) -> Result<Self, String> {
        let rig = match serde_json::from_slice(json) {
            Ok(OfTheLab { camera_tolerance }) => Self { camera_tolerance, ..lab::rig() },
            Err(_) => serde_json::from_slice(json).map_err(|err| err.to_string())?,
        };
        rig.check()?;
        Ok(rig)
    }

    fn check(&self) -> Result<(), String> {
        let sensors: Vec<&Text> = self.sensors.iter().map(|sensor| &sensor.key).collect();
        let pads: Vec<&Text> = self.pads.iter().map(|pad| &pad.key).collect();
        if ![&sensors, &pads].iter().all(|keys| (1..=MOST).contains(&keys.len())) {
            return Err(format!("it needs 1 to {MOST} sensors and 1 to {MOST} pads"));
        }
        for keys in [&sensors, &pads] {
            for (index, key) in keys.iter().enumerate() {
                check_key(key)?;
                if keys[..index].contains(key) {
                    return Err(format!("the key {key:?} is there twice; each must be its own"));
                }
            }
        }
        let names = self.sensors.iter().map(|sensor| &sensor.name).chain(self.pads.iter().map(|pad| &pad.name));
        names.chain([&self.name]).try_for_each(|name| check_name(name))?;
        for sensor in &self.sensors {
            sensor.check().map_err(|why| format!("sensor {}: {why}", sensor.key))?;
        }
        let CameraTolerance { angle_deg, place_mm } = self.camera_tolerance;
        if !((0.0..=TOLERANCE_DEG).contains(&angle_deg) && (0.0..=TOLERANCE_MM).contains(&place_mm)) {
            return Err(format!(
                "camera_tolerance: angle_deg must be 0 to {TOLERANCE_DEG} and place_mm 0 to {TOLERANCE_MM}"
            ));
        }
        for (index, window) in self.windows.iter().enumerate() {
            self.check_window(window).map_err(|why| format!("window {index}, counted from 0: {why}"))?;
            let same = |w: &Window| (w.pad, w.of, w.within) == (window.pad, window.of, window.within);
            if self.windows[..index].iter().any(same) {
                return Err(format!("window {index}, counted from 0: an earlier one has the same pad and sensors"));
            }
        }
        Ok(())
    }

    fn check_window(&self, window: &Window) -> Result<(), String> {
        let within = self.sensor(window.within).filter(|_| self.sensor(window.of).is_some());
        let (Some(within), true) = (within, window.pad.index() < self.pads.len()) else {
            return Err("it names a pad or a sensor that is not there; they count from 0".into());
        };
        if window.of == window.within {
            return Err("it must name two sensors".into());
        }
        for ((center, size), side) in window.center_px.into_iter().zip(window.size_px).zip(within.size()) {
            let side = side as f64;
            if !(size > 0.0 && size <= LARGEST_WINDOW * side) {
                return Err(format!("size_px must be over 0 and at most {} px here", LARGEST_WINDOW * side));
            }
            if !center.is_finite() || center + size / 2.0 <= -0.5 || center - size / 2.0 >= side - 0.5 {
                return Err(format!("it lies outside the picture of {} (center_px, size_px)", within.key));
            }
        }
        Ok(())
    }
}

impl Sensor {
    fn check(&self) -> Result<(), String> {
        if !self.size().iter().all(|side| (1..=LARGEST_SIDE).contains(side)) {
            return Err(format!("width and height must be 1 to {LARGEST_SIDE} px"));
        }
        if !PX_PER_M.contains(&self.px_per_m) {
            return Err(format!("px_per_m must be {} to {} pixels per meter", PX_PER_M.start(), PX_PER_M.end()));
        }
        if !matches!(self.rotation_deg, 0 | 180) {
            return Err("rotation_deg must be 0 or 180".into());
        }
        self.crop.check(self.size())
    }
}

impl Crop {
    /// Checks that a stored picture of this size can be a part of the full one.
    fn check(self, stored: [usize; 2]) -> Result<(), String> {
        if self.full == [0, 0] {
            return match self.offset.iter().all(|offset| *offset <= LARGEST_FULL) {
                true => Ok(()),
                false => Err(format!("crop.offset must be at most {LARGEST_FULL} px")),
            };
        }
        for ((full, offset), side) in self.full.into_iter().zip(self.offset).zip(stored) {
            if full > LARGEST_FULL || offset > full || side > full - offset {
                return Err(format!(
                    "crop: the stored picture must lie inside the full one, which has at most {LARGEST_FULL} px a side; \
                     full [0, 0] says that only the stored one is known"
                ));
            }
        }
        Ok(())
    }
}

fn check_key(key: &str) -> Result<(), String> {
    let plain = key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
    if key.is_empty() || key.len() > LONGEST_KEY || !plain {
        return Err(format!("the key {key:?} must be 1 to {LONGEST_KEY} small letters and digits"));
    }
    if TAKEN.contains(&key) {
        return Err(format!("the key {key:?} has another meaning here; choose another word"));
    }
    Ok(())
}

fn check_name(name: &str) -> Result<(), String> {
    if name.trim().is_empty() || name.chars().count() > LONGEST_NAME || name.contains(is_unprintable) {
        return Err(format!("the name {name:?} must be 1 to {LONGEST_NAME} letters that can be shown"));
    }
    Ok(())
}
