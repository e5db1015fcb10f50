//! [`SensorSpec`]: the sensors that a bundle was made for, and whether they are those of some data.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::Bundle;
use touch2touch_core::rig::{Rig, Sensor, SensorId, SensorKind};

/// A sensor as a manifest declares it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    /// The name that the rig gives it, such as `gelslim`.
    pub key: String,
    /// Kind of its picture: color or depth.
    pub kind: SensorKind,
    /// `[width, height]` of its stored picture, pixels.
    pub size: [usize; 2],
}

impl SensorSpec {
    /// Declaration of a rig's sensor.
    pub fn of(sensor: &Sensor) -> Self {
        Self { key: sensor.key.to_string(), kind: sensor.kind, size: sensor.size() }
    }
}

impl fmt::Display for SensorSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind: &str = self.kind.into();
        write!(f, "{} ({kind}, {} x {})", self.key, self.size[0], self.size[1])
    }
}

/// The sensors between which a generator predicts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorPair {
    /// Sensor that the generator starts from.
    pub input: SensorSpec,
    /// Sensor that the generator predicts.
    pub output: SensorSpec,
}

/// Sensors of a rig at which a generator starts and ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// The sensor whose reading is the condition.
    pub input: SensorId,
    /// The sensor that the prediction can be compared with; `None` where the rig has no such sensor.
    pub output: Option<SensorId>,
}

/// A generator is for other sensors than those of the data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the bundle \"{bundle}\" predicts {} from {}, but the sensors of this data are {}; what fits is {}",
    .sensors.output, .sensors.input, list(.rig), fitting(.rig)
)]
pub struct Misfit {
    /// Name of the bundle.
    pub bundle: String,
    /// Sensors that it is for.
    pub sensors: Box<SensorPair>,
    /// Sensors of the data.
    pub rig: Vec<SensorSpec>,
}

fn list(sensors: &[SensorSpec]) -> String {
    sensors.iter().map(SensorSpec::to_string).collect::<Vec<_>>().join(" and ")
}

fn fitting(sensors: &[SensorSpec]) -> String {
    let keys: Vec<&str> = sensors.iter().map(|sensor| sensor.key.as_str()).collect();
    format!("a bundle whose manifest names {} as input.sensor", keys.join(" or "))
}

impl SensorPair {
    /// Of two sensors of a rig.
    pub fn of(input: &Sensor, output: &Sensor) -> Self {
        Self { input: SensorSpec::of(input), output: SensorSpec::of(output) }
    }

    /// Sensors of `rig` at which the generator named `bundle` starts and ends: the sensor that it starts from must be
    /// there as it was declared, and the sensor that it predicts must not be there as another, nor another in its place:
    /// predictions would be compared with that one.
    ///
    /// # Errors
    /// [`Misfit`] says what was asked, what is there and what would fit.
    pub fn ends(&self, bundle: &str, rig: &Rig) -> Result<Ends, Misfit> {
        let at = |wanted: &SensorSpec| rig.sensor_of_key(&wanted.key);
        let same = |id: SensorId, wanted: &SensorSpec| rig.sensor(id).map(SensorSpec::of).as_ref() == Some(wanted);
        let output = at(&self.output);
        let in_its_place = |sensor: &Sensor| sensor.kind == self.output.kind && sensor.key != self.input.key;
        let free = output.is_some() || !rig.sensors.iter().any(in_its_place);
        match at(&self.input).filter(|id| same(*id, &self.input)) {
            Some(input) if free && output.is_none_or(|id| same(id, &self.output)) => Ok(Ends { input, output }),
            _ => Err(Misfit {
                bundle: bundle.to_owned(),
                sensors: Box::new(self.clone()),
                rig: rig.sensors.iter().map(SensorSpec::of).collect(),
            }),
        }
    }
}

impl Bundle {
    /// Sensors of `rig` at which the bundle starts and ends, if it is a generator; `None` for another kind of bundle.
    ///
    /// # Errors
    /// [`Misfit`].
    pub fn ends(&self, rig: &Rig) -> Option<Result<Ends, Misfit>> {
        Some(self.generator()?.sensors().ends(self.name(), rig))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::rig::lab;

    #[test]
    fn sensors_must_be_there_as_they_were_declared() {
        let (gelslim, bubble) = (SensorSpec::of(&lab::GELSLIM), SensorSpec::of(&lab::BUBBLE));
        let mut rig = (*Rig::lab()).clone();
        let pair = SensorPair { input: gelslim.clone(), output: bubble.clone() };
        let back = SensorPair { input: bubble, output: gelslim };
        assert_eq!(pair.ends("b", &rig), Ok(Ends { input: lab::GELSLIM_ID, output: Some(lab::BUBBLE_ID) }));
        assert_eq!(back.ends("b", &rig), Ok(Ends { input: lab::BUBBLE_ID, output: Some(lab::GELSLIM_ID) }));
        rig.sensors[1].width = 100;
        assert!(pair.ends("b", &rig).is_err() && back.ends("b", &rig).is_err());
        rig.sensors[1] = lab::GELSLIM_DEPTH.clone();
        assert!(pair.ends("b", &rig).is_err(), "no imprint of a bubble is a gel's");
        rig.sensors.truncate(1);
        assert_eq!(pair.ends("b", &rig), Ok(Ends { input: lab::GELSLIM_ID, output: None }));
        rig.sensors[0].key = "digit".into();
        let text = pair.ends("Tiny", &rig).unwrap_err().to_string();
        for part in
            ["\"Tiny\"", "bubble (depth, 175 x 140)", "gelslim (color, 427 x 320)", "digit (color", "names digit"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
