//! [`MaskTuner`]: tunes a mask network on imprints whose contact masks people corrected, step by step.

mod sensors;

pub use sensors::Sensors;

use std::ops::Range;

use crate::error::{Error, Result};
use crate::nets::mask::{self, MASK};
use crate::onnx::Onnx;
use crate::ops;
use crate::optim::Rate;
use crate::params::{Leaves, Params};
use crate::random::{Purpose, Random, dealt};
use crate::state::{Origin, OriginBuilder};
use crate::tape::Tensor;
use crate::trainer::{Objective, Trainer, descend};

/// A mask network as its bundle describes it: where tuning begins.
#[derive(Clone, Debug)]
pub struct MaskStart {
    /// ONNX file of the network.
    pub file: Vec<u8>,
    /// `[columns, rows]` of imprints and masks.
    pub size: [usize; 2],
    /// Meters at 0 and 1 of the network's input.
    pub range_m: [f32; 2],
    /// Cast of values between and beyond them.
    pub cast: Cast,
}

/// Cast of the unit interval before it reaches the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cast {
    /// As it is, held at 0 and 1.
    #[default]
    None,
    /// In 8 bits, held at 0 and 255.
    Saturate,
    /// In 8 bits, of which higher ones are lost.
    Wrap,
}

impl MaskStart {
    /// Meters as the network sees them.
    pub fn scaled(&self, meters: f32) -> f32 {
        let [min, max] = self.range_m;
        let unit = (meters - min) / (max - min);
        match self.cast {
            // `as u8` saturates; through i32 the low eight bits stay.
            Cast::Saturate => f32::from((unit * 255.0) as u8) / 255.0,
            Cast::Wrap => f32::from((unit * 255.0) as i32 as u8) / 255.0,
            Cast::None => unit.clamp(0.0, 1.0),
        }
    }
}

/// An imprint with the mask that is right for it, as large as the network's input and turned as that.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskTouch {
    /// Meters, row by row; NaN where nothing was measured, which the network sees as 0 m.
    pub imprint_m: Vec<f32>,
    /// Contact: true where a pixel touches.
    pub contact: Vec<bool>,
    /// Pixels that count; all without it.
    pub counted: Option<Vec<bool>>,
    /// True where a network predicted the imprint: then it is not drawn shallower, because predictions have one depth.
    pub predicted: bool,
}

/// Pull of the weights toward zero.
const DECAY: f32 = 0.01;

/// Settings of the tuning of a mask network. The defaults are for some twenty masks and ten minutes.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskConfig {
    /// Steps of the whole plan; the rates follow it.
    pub steps: usize,
    /// Imprints per step.
    pub batch: usize,
    /// Decides order and variations.
    pub seed: u64,
    /// Rate of the weights.
    pub rate: f32,
    /// Other sensors that the imprints are varied to.
    pub sensors: Sensors,
    /// Threads; `None` for as many as there are cores, four at most. The result does not depend on it.
    pub threads: Option<usize>,
}

impl Default for MaskConfig {
    fn default() -> Self {
        Self { steps: 300, batch: 8, seed: 42, rate: 6e-4, sensors: Sensors::default(), threads: None }
    }
}

/// The objective: cross-entropy + (1 − Dice) over variations of the touches.
#[derive(Debug)]
struct Recipe {
    start: MaskStart,
    touches: Vec<MaskTouch>,
    all: Vec<usize>,
    config: MaskConfig,
}

/// A part of a batch.
#[derive(Default)]
struct Part {
    inputs: Vec<f32>,
    masks: Vec<f32>,
    counted: Vec<f32>,
}

impl Objective for Recipe {
    type Part = Part;

    fn rate(&self, _: &str) -> Option<Rate> {
        Some(Rate { rate: self.config.rate, decay: DECAY, anchor: 0.0 })
    }

    fn part(&self, step: usize, places: Range<usize>) -> Part {
        let c = &self.config;
        let mut items = Part::default();
        for place in places {
            let touch = &self.touches[dealt(c.seed, &self.all, step * c.batch + place, 0)];
            let random = &mut Random::new(c.seed, Purpose::Variation, step, place);
            let varied = c.sensors.vary(touch, self.start.size, random);
            let bit = |&v: &bool| f32::from(u8::from(v));
            items
                .inputs
                .extend(varied.imprint_m.iter().map(|&m| self.start.scaled(if m.is_finite() { m } else { 0.0 })));
            items.masks.extend(varied.contact.iter().map(bit));
            match &varied.counted {
                Some(counted) => items.counted.extend(counted.iter().map(bit)),
                None => items.counted.extend(vec![1.0; varied.contact.len()]),
            }
        }
        items
    }

    fn loss(&self, leaves: &Leaves<'_>, part: Part) -> Tensor {
        let [width, height] = self.start.size;
        let count = part.inputs.len() / (width * height);
        let logits = mask::segment(leaves, &Tensor::new(&[count, 1, height, width], part.inputs));
        let weights = vec![1.0 / self.config.batch as f32; count];
        ops::contact_loss(&logits, &part.masks, &part.counted, &weights)
    }
}

/// A mask network on its way from its bundle to what people drew. To cancel, stop calling [`crate::Descent::step`]: what
/// [`MaskTuner::tuned`] returns is always usable.
#[derive(Debug)]
pub struct MaskTuner {
    file: Onnx,
    origin: Origin,
    trainer: Trainer<Recipe>,
}

impl MaskTuner {
    /// Before the first step, or where the run stood that [`crate::Descent::to_bytes`] kept as `state`: to the last bit as if
    /// it had not been stopped.
    ///
    /// # Errors
    /// If the network is of another architecture (which weight says so), a setting is out of range, there are no touches,
    /// one cannot be learned from (which one), or the state is damaged or of another start, other touches or other settings.
    pub fn new(start: &MaskStart, touches: Vec<MaskTouch>, config: MaskConfig, state: Option<&[u8]>) -> Result<Self> {
        if config.steps == 0 {
            return Err(Error::Start { what: "steps", why: "there must be one or more".into() });
        }
        let [low, high] = start.range_m;
        let span = high - low;
        if !(span.is_finite() && span > 0.0) {
            return Err(Error::Start { what: "range", why: "it must rise".into() });
        }
        let unread = |why| Error::Onnx { network: mask::NETWORK, why };
        let file = Onnx::parse(start.file.clone()).map_err(unread)?;
        let params = mask::read(&file)?;
        check(&touches, start.size)?;
        let origin = origin(start, &touches, &config);
        let (batch, steps, threads) = (config.batch, config.steps, config.threads);
        let start = MaskStart { file: Vec::new(), ..start.clone() };
        let recipe = Recipe { start, all: (0..touches.len()).collect(), touches, config };
        let mut trainer = Trainer::new(recipe, params, batch, steps, threads);
        state.map_or(Ok(()), |state| trainer.restore(origin, state))?;
        Ok(Self { file, origin, trainer })
    }

    /// The network's ONNX file as it is now (the running mean of the weights), as long as before.
    pub fn tuned(&self) -> Vec<u8> {
        let params = &self.trainer.average;
        self.file
            .with(|name| params.get(&format!("{MASK}{name}")).map(|entry| entry.values.to_vec()).unwrap_or_default())
    }

    /// Probability of contact of each pixel of imprints (meters, as in [`MaskTouch::imprint_m`]), by the network as it
    /// is now.
    ///
    /// # Errors
    /// [`Error::Mask`] with the place of an imprint that has another size.
    pub fn probabilities(&self, imprints: &[&[f32]]) -> Result<Vec<Vec<f32>>> {
        self.ask(&self.trainer.average, imprints)
    }

    /// Probability of contact of each pixel, by the network before the first step.
    ///
    /// # Errors
    /// As [`MaskTuner::probabilities`].
    pub fn probabilities_at_start(&self, imprints: &[&[f32]]) -> Result<Vec<Vec<f32>>> {
        self.ask(&self.trainer.start, imprints)
    }

    fn ask(&self, params: &Params, imprints: &[&[f32]]) -> Result<Vec<Vec<f32>>> {
        let start = &self.trainer.objective.start;
        let [width, height] = start.size;
        let pixels = width * height;
        if let Some(index) = imprints.iter().position(|imprint| imprint.len() != pixels) {
            let why = format!("its imprint has {} values instead of {pixels}", imprints[index].len());
            return Err(Error::Mask { index, why });
        }
        Ok(self.trainer.workers.run(imprints.len(), |i| {
            let meters = imprints[i].iter();
            let input: Vec<f32> = meters.map(|&m| start.scaled(if m.is_finite() { m } else { 0.0 })).collect();
            let logits = mask::segment(&params.leaves(|_| false), &Tensor::new(&[1, 1, height, width], input));
            let (no, yes) = logits.values().split_at(pixels);
            no.iter().zip(yes).map(|(no, yes)| 1.0 / (1.0 + (no - yes).exp())).collect()
        }))
    }
}

// The state of a run is about 3 MB for the shipped bundle.
descend!(MaskTuner);

/// Refuses touches that cannot be learned from, and sets without any.
fn check(touches: &[MaskTouch], [width, height]: [usize; 2]) -> Result<()> {
    if touches.is_empty() {
        return Err(Error::NoPairs);
    }
    let pixels = width * height;
    for (index, touch) in touches.iter().enumerate() {
        let counted = touch.counted.as_ref().map_or(pixels, Vec::len);
        let sizes =
            [("imprint", touch.imprint_m.len()), ("mask", touch.contact.len()), ("map of what counts", counted)];
        if let Some((what, length)) = sizes.into_iter().find(|(_, length)| *length != pixels) {
            return Err(Error::Mask { index, why: format!("its {what} has {length} values instead of {pixels}") });
        }
        if touch.imprint_m.iter().all(|v| !v.is_finite()) {
            return Err(Error::Mask { index, why: "its imprint holds no measurement".into() });
        }
    }
    if touches.iter().all(|touch| touch.counted.as_ref().is_some_and(|counted| !counted.contains(&true))) {
        return Err(Error::NoPairs);
    }
    Ok(())
}

/// Everything that decides the outcome. Threads do not.
fn origin(start: &MaskStart, touches: &[MaskTouch], config: &MaskConfig) -> Origin {
    let begun = OriginBuilder::default()
        .bytes(&start.file)
        .told(&(start.size, start.range_m, start.cast))
        .told(&MaskConfig { threads: None, ..config.clone() });
    let bits = |bits: &[bool]| bits.iter().map(|&v| u8::from(v)).collect::<Vec<u8>>();
    let touch = |origin: OriginBuilder, touch: &MaskTouch| {
        let counted = touch.counted.as_deref().map(bits);
        origin.numbers(&touch.imprint_m).bytes(&bits(&touch.contact)).told(&(counted, touch.predicted))
    };
    touches.iter().fold(begun, touch).finish()
}

#[cfg(test)]
mod tests;
