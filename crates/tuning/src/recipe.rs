//! [`Recipe`]: the objective of the generator. It is unrolled as it is used: from zeros or noise to an imprint in one
//! denoising step, sometimes two, and through what lies behind the decoder.

use std::ops::Range;

use crate::augment::{Augment, Clipping, Set};
use crate::config::Config;
use crate::nets::generator::{self, DECODER, LATENT, Schedule, Sizes};
use crate::ops;
use crate::optim::Rate;
use crate::pair::Pair;
use crate::params::Leaves;
use crate::random::{Purpose, Random, dealt};
use crate::tape::Tensor;
use crate::trainer::Objective;

/// The straight line behind the decoder: factor and offset.
pub(crate) const LINE: &str = "line";
/// The shift of each pad, `[pads, 2]`, pixels.
pub(crate) const SHIFT: &str = "shift";
/// Field of each pad: what its imprints have beside the touch, `[pads, side · side]`.
pub(crate) const FIELD: &str = "field";

/// The generator's objective over a set of pairs.
#[derive(Debug)]
pub(crate) struct Recipe {
    pub(crate) model: Model,
    pub(crate) config: Config,
    pairs: Vec<Pair>,
    /// Pairs of pads, and simulated ones, by index.
    real: Vec<usize>,
    simulated: Vec<usize>,
    /// Mean imprint by pad; the last is that of simulated pairs.
    means: Vec<Vec<f32>>,
    clippings: Vec<Clipping>,
    /// Ranges in which simulated pairs are varied.
    still: Augment,
}

/// Constants of the generator.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) sizes: Sizes,
    pub(crate) schedule: Schedule,
    pub(crate) mean: [f32; 3],
    pub(crate) deviation: [f32; 3],
    /// The decoder's −1..1 in units: factor and offset.
    pub(crate) unit: [f32; 2],
    pub(crate) pads: usize,
}

/// A part of a batch.
pub(crate) struct Part {
    pictures: Vec<f32>,
    imprints: Vec<f32>,
    pads: Vec<Option<usize>>,
    noise: Vec<f32>,
    /// Noise of the second step, where there is one.
    second: Option<Vec<f32>>,
}

impl Model {
    /// A picture as the encoder wants it.
    pub(crate) fn standardized(&self, picture: &[f32]) -> Vec<f32> {
        let planes = picture.chunks_exact(self.sizes.pixels()).zip(self.mean.iter().zip(&self.deviation));
        planes.flat_map(|(plane, (mean, deviation))| plane.iter().map(move |v| (v - mean) / deviation)).collect()
    }

    /// Clean latents from noisy ones at a step.
    fn clean(&self, leaves: &Leaves<'_>, latents: &Tensor, t: usize, condition: &Tensor) -> Tensor {
        let (signal, noise) = self.schedule.amplitudes(t);
        let v = generator::denoise(leaves, &self.sizes, &self.schedule, latents, t, condition);
        ops::blend(latents, signal as f32, &v, -noise as f32)
    }

    /// Latents as the pads' sensors see them, in units, `[n, side, side]`; simulated pairs have no pad and see the
    /// decoder's own picture.
    pub(crate) fn seen(&self, leaves: &Leaves<'_>, latents: &Tensor, pads: &[Option<usize>]) -> Tensor {
        let drawn = generator::decode(leaves, latents).reshaped(&[pads.len(), self.sizes.side, self.sizes.side]);
        let [factor, offset] = self.unit;
        let drawn = ops::line(&drawn, factor, offset);
        ops::placed(&drawn, &leaves.get(LINE), &leaves.get(SHIFT), &leaves.get(FIELD), pads)
    }

    /// Latents of a batch.
    pub(crate) fn latents(&self, values: Vec<f32>) -> Tensor {
        let cells = self.sizes.cells();
        Tensor::new(&[values.len() / self.sizes.latent(), LATENT, cells, cells], values)
    }
}

impl Recipe {
    pub(crate) fn new(model: Model, pairs: Vec<Pair>, config: Config) -> Self {
        let of_kind = |simulated: bool| {
            pairs
                .iter()
                .enumerate()
                .filter(|(_, pair)| pair.frame.is_none() == simulated)
                .map(|(index, _)| index)
                .collect::<Vec<_>>()
        };
        let (real, simulated) = (of_kind(false), of_kind(true));
        let means = (0..=model.pads).map(|pad| mean_imprint(&pairs, pad, &model)).collect();
        let clipped = pairs.iter().map(|pair| Clipping::of(&pair.picture)).filter(|clipping| clipping.any());
        let still = Augment { shift: 0.0, ..config.augment.clone() };
        Self { clippings: clipped.collect(), still, model, config, real, simulated, means, pairs }
    }

    /// The pair of each place in the batch of a step.
    fn drawn(&self, step: usize) -> Vec<usize> {
        let batch = self.config.batch;
        let of_simulated = match (self.real.is_empty(), self.simulated.is_empty()) {
            (true, _) => batch,
            (_, true) => 0,
            _ => (self.config.simulated * batch as f64).round() as usize,
        };
        let simulated = (0..of_simulated).map(|i| dealt(self.config.seed, &self.simulated, step * of_simulated + i, 1));
        let of_real = batch - of_simulated;
        let real = (0..of_real).map(|i| dealt(self.config.seed, &self.real, step * of_real + i, 0));
        // Simulated pairs are spread over the parts.
        let all: Vec<usize> = real.chain(simulated).collect();
        let order = Random::new(self.config.seed, Purpose::Batch, step, 1).order(batch);
        order.into_iter().map(|place| all[place]).collect()
    }
}

/// Mean imprint of a pad; of simulated pairs behind the last pad.
fn mean_imprint(pairs: &[Pair], pad: usize, model: &Model) -> Vec<f32> {
    let own: Vec<&Pair> = pairs.iter().filter(|pair| pair.frame.unwrap_or(model.pads) == pad).collect();
    let mut mean = vec![0.0; model.sizes.pixels()];
    for pair in &own {
        mean.iter_mut().zip(&pair.imprint).for_each(|(mean, value)| *mean += value / own.len() as f32);
    }
    mean
}

impl Objective for Recipe {
    type Part = Part;

    fn rate(&self, name: &str) -> Option<Rate> {
        let c = &self.config;
        let plain = |rate: f32| (rate > 0.0).then_some(Rate { rate, decay: 0.0, anchor: 0.0 });
        match name {
            LINE => plain(c.line_rate),
            SHIFT => plain(c.shift_rate),
            FIELD => plain(c.field_rate),
            _ if LATENT_SCALE.iter().any(|fixed| name.strip_prefix(DECODER) == Some(fixed)) => None,
            _ => (c.network_rate > 0.0).then_some(Rate { rate: c.network_rate, decay: c.decay, anchor: c.anchor }),
        }
    }

    fn part(&self, step: usize, places: Range<usize>) -> Part {
        let c = &self.config;
        let drawn = self.drawn(step);
        let two = Random::new(c.seed, Purpose::Batch, step, 0).happens(c.second);
        let latent = self.model.sizes.latent();
        let mut items = Part {
            pictures: Vec::new(),
            imprints: Vec::new(),
            pads: Vec::new(),
            noise: Vec::new(),
            second: two.then(Vec::new),
        };
        for place in places {
            let pair = &self.pairs[drawn[place]];
            let mean = &self.means[pair.frame.unwrap_or(self.model.pads)];
            let set = Set { mean, deviation: self.model.deviation, clippings: &self.clippings };
            let random = &mut Random::new(c.seed, Purpose::Variation, step, place);
            // Moving a simulated picture moves its markers too, by which the network tells one finger from the other.
            let augment = if pair.frame.is_none() { &self.still } else { &c.augment };
            let (picture, imprint) = augment.vary(&pair.picture, &pair.imprint, &set, random);
            items.pictures.extend(self.model.standardized(&picture));
            items.imprints.extend(imprint);
            items.pads.push(pair.frame);
            let random = &mut Random::new(c.seed, Purpose::Noise, step, place);
            let zeros = random.happens(0.5);
            let noise = random.normals(latent);
            items.noise.extend(if zeros { vec![0.0; latent] } else { noise });
            if let Some(second) = &mut items.second {
                second.extend(random.normals(latent));
            }
        }
        items
    }

    fn loss(&self, leaves: &Leaves<'_>, part: Part) -> Tensor {
        let model = &self.model;
        let condition = generator::encode(leaves, &model.sizes, &part.pictures);
        let first = model.schedule.trailing(1)[0];
        let mut clean = model.clean(leaves, &model.latents(part.noise), first, &condition);
        if let Some(second) = part.second {
            let middle = model.schedule.trailing(2)[1];
            let (signal, noise) = model.schedule.amplitudes(middle);
            // The first step is taken as it is: slopes end here.
            let between = ops::blend(&clean.detached(), signal as f32, &model.latents(second), noise as f32);
            clean = model.clean(leaves, &between, middle, &condition);
        }
        let weights = vec![1.0 / self.config.batch as f32; part.pads.len()];
        ops::distance(&model.seen(leaves, &clean, &part.pads), &part.imprints, &weights)
    }
}

/// Weights of the decoder that say where latents lie: no layer's, they stay.
const LATENT_SCALE: [&str; 2] = ["mean", "std"];
