//! [`Generator`]: a GelSlim difference image to a decoder's picture, with the graphs of a bundle.

mod preview;

use std::ops::{ControlFlow, Range};
use std::sync::Arc;

pub use preview::Observer;
use preview::Watching;

use super::bundle::{Bundle, GeneratorInput, GeneratorSpec, InputScale, Role, TimestepType};
use super::engine::{EngineChoice, EngineError, EngineKind, Graph, Input};
use super::kept_key::KeptKey;
use super::sandbox::admit;
use touch2touch_core::diffusion::{
    Denoiser, DiffusionError, GenerateConfig, ModelError, Prediction, Progress, Tensor, sample,
};
use touch2touch_core::fit::Fitted;
use touch2touch_core::grid::{Grid, RgbGrid};
use touch2touch_core::postprocess::RawPrediction;

/// Why there is no prediction.
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// The progress closure asked to stop.
    #[error("cancelled")]
    Cancelled,
    /// The bundle is of another kind.
    #[error("the bundle \"{0}\" is not a generator; choose one whose manifest says kind \"generator\"")]
    NotAGenerator(String),
    /// No engine, or it does not take a graph.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The sampler or the denoiser failed.
    #[error(transparent)]
    Diffusion(DiffusionError),
    /// The condition encoder or the decoder failed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An item names an image that was not given.
    #[error("item of image {image}, but there are {images}")]
    NoImage {
        /// Index of the image.
        image: usize,
        /// Number of images.
        images: usize,
    },
    /// The image has no pixels, or some are not numbers.
    #[error(
        "the difference image of {width} x {height} pixels has {bad} values that are not numbers; nothing can be predicted from it"
    )]
    BadImage {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// NaN or infinite values.
        bad: usize,
    },
}

/// A generator with its graphs loaded, ready to be used again and again.
#[derive(Debug)]
pub struct Generator {
    spec: GeneratorSpec,
    fit: Option<Arc<Fitted>>,
    hash: String,
    engine: EngineKind,
    /// Most items run at once: what the engine takes, and less once it had no room for that.
    at_once: usize,
    encoder: Graph,
    denoiser: Graph,
    decoder: Graph,
    /// Prepared images and their conditions, the last used last.
    encoded: Vec<(Tensor, Tensor)>,
}

/// One picture to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Index of the image.
    pub image: usize,
    /// Seed of its noise.
    pub seed: u64,
}

impl Generator {
    /// Loads the three graphs of a checked bundle.
    ///
    /// # Errors
    /// [`GenerateError::NotAGenerator`] and [`GenerateError::Engine`].
    pub fn open(bundle: &Bundle, choice: EngineChoice) -> Result<Self, GenerateError> {
        let not = || GenerateError::NotAGenerator(bundle.name().to_owned());
        let spec = bundle.generator().ok_or_else(not)?.clone();
        let engine = admit(bundle, choice)?;
        let load = |role| -> Result<Graph, GenerateError> {
            Ok(Graph::load(engine, role, bundle.file(role).ok_or_else(not)?)?)
        };
        Ok(Self {
            encoder: load(Role::ConditionEncoder)?,
            denoiser: load(Role::Denoiser)?,
            decoder: load(Role::Decoder)?,
            hash: bundle.hash().to_owned(),
            encoded: Vec::new(),
            fit: bundle.fit().cloned(),
            spec,
            engine,
            at_once: engine.at_once(),
        })
    }

    /// The bundle's description.
    pub fn spec(&self) -> &GeneratorSpec {
        &self.spec
    }

    /// The bundle's fit to a rig, if it was fitted to one.
    pub fn fit(&self) -> Option<&Arc<Fitted>> {
        self.fit.as_ref()
    }

    /// The engine in use.
    pub fn engine(&self) -> EngineKind {
        self.engine
    }

    /// The key of what [`Generator::generate`] returns for the image with the digest `input` (see
    /// [`super::kept_key::input_digest`]).
    pub fn recipe(&self, input: String, config: &GenerateConfig) -> KeptKey {
        KeptKey { input, bundle: self.hash.clone(), engine: self.engine, config: *config }
    }

    /// Predicts what the Soft Bubble feels where the GelSlim felt `difference` (signed, 0..255 scale, any size).
    ///
    /// The result is in the decoder's range and orientation; [`GeneratorSpec::depth_chain`] turns it into meters.
    /// `progress` is called before each sampling step; `Break` cancels within one step.
    ///
    /// # Errors
    /// See [`GenerateError`].
    pub fn generate(
        &mut self,
        difference: &RgbGrid,
        config: &GenerateConfig,
        mut progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<RawPrediction, GenerateError> {
        let mut one = self.run(&[difference], &[Item { image: 0, seed: config.seed }], config, &mut progress)?;
        Ok(one.remove(0))
    }

    /// Any images from any seeds: each image is encoded once, however many seeds it has, and each item comes out as it
    /// would alone, on the processor to the last bit. `config.seed` is not used. Answers in the order of `items`.
    ///
    /// # Errors
    /// See [`GenerateError`]; an item of an image that is not there is a [`GenerateError::NoImage`].
    pub fn run(
        &mut self,
        images: &[&RgbGrid],
        items: &[Item],
        config: &GenerateConfig,
        observer: &mut dyn Observer,
    ) -> Result<Vec<RawPrediction>, GenerateError> {
        if items.is_empty() {
            return Ok(Vec::new());
        }
        let conditions: Vec<Option<Tensor>> = (0..images.len())
            .map(|at| {
                // An image that no item is of is not encoded.
                items.iter().any(|item| item.image == at).then(|| self.condition(images[at])).transpose()
            })
            .collect::<Result<_, _>>()?;
        let of_item = |item: &Item| {
            let condition = conditions.get(item.image).and_then(Option::as_ref).cloned();
            condition.ok_or(GenerateError::NoImage { image: item.image, images: images.len() })
        };
        let condition = items.iter().map(of_item).collect::<Result<Vec<_>, _>>()?;
        let condition = Tensor::stack(&condition).expect("conditions have one shape and there is at least one");
        let seeds: Vec<u64> = items.iter().map(|item| item.seed).collect();
        let spec = &self.spec;
        let mut plain = BundleDenoiser { graph: &mut self.denoiser, spec, at_once: &mut self.at_once };
        let mut watch = Watching::new(observer, &mut self.decoder, spec, items.len());
        let latent = sample(&mut plain, &spec.schedule, config, &seeds, &condition, &mut watch);
        let latent = latent.map_err(|err| match err {
            DiffusionError::Cancelled => GenerateError::Cancelled,
            DiffusionError::Model(err) => GenerateError::Model(err),
            err => GenerateError::Diffusion(err),
        })?;
        Ok(decode(&mut self.decoder, spec, latent, &mut self.at_once)?)
    }

    /// The condition of one image, without the batch axis. The last few are kept: another seed of the same image, or
    /// the same image with other settings, does not run the encoder again.
    fn condition(&mut self, image: &RgbGrid) -> Result<Tensor, GenerateError> {
        let prepared = prepare(image, &self.spec.input)?;
        Ok(self.encode(prepared)?)
    }

    fn encode(&mut self, prepared: Tensor) -> Result<Tensor, ModelError> {
        if let Some(at) = self.encoded.iter().position(|(known, _)| *known == prepared) {
            let known = self.encoded.remove(at);
            let condition = known.1.clone();
            self.encoded.push(known);
            return Ok(condition);
        }
        // One at a time: a condition does not depend on what else is in the batch, not even in its last bit.
        let input = Tensor::stack(std::slice::from_ref(&prepared)).expect("there is one");
        let shape: Vec<usize> = std::iter::once(1).chain(self.spec.condition.shape).collect();
        let name = self.spec.input.sensor.key.as_str();
        let condition = self.encoder.run(&[(name, Input::F32(&input))], "condition", &shape)?;
        let condition = condition.item(0).expect("the shape was checked: there is one");
        if self.encoded.len() >= KEPT_CONDITIONS {
            self.encoded.remove(0);
        }
        self.encoded.push((prepared, condition.clone()));
        Ok(condition)
    }

    /// Forgets the conditions of images seen before, as if freshly loaded: for measuring.
    pub fn forget_conditions(&mut self) {
        self.encoded.clear();
    }

    /// The three graphs, for measuring what they take by themselves: condition encoder, denoiser, decoder.
    pub fn graphs(&mut self) -> [&mut Graph; 3] {
        [&mut self.encoder, &mut self.denoiser, &mut self.decoder]
    }
}

/// Conditions kept for the next run.
const KEPT_CONDITIONS: usize = 8;

/// The decoder's pictures of clean latents, one per entry of the batch.
fn decode(
    decoder: &mut Graph,
    spec: &GeneratorSpec,
    mut latent: Tensor,
    at_once: &mut usize,
) -> Result<Vec<RawPrediction>, ModelError> {
    let scale = spec.latent.scale_factor;
    latent.data_mut().iter_mut().for_each(|v| *v = (f64::from(*v) / scale) as f32);
    let [width, height] = spec.output.size;
    let plane = |values: &[f32]| Grid::from_vec(width, height, values.to_vec()).expect("the chunks have this length");
    let pictures = in_parts(latent.batch(), at_once, |part| {
        let shape = [part.len(), spec.output.channels, height, width];
        decoder.run(&[("latent", Input::F32(&part_of(&latent, part)))], "image", &shape)
    })?;
    let one = |picture: &[f32]| RawPrediction { channels: picture.chunks_exact(width * height).map(plane).collect() };
    Ok(pictures.data().chunks_exact(spec.output.channels * width * height).map(one).collect())
}

/// Runs a batch of `count` in parts of at most `at_once`. A part that fails, since the device has no room for it, say, is
/// tried again by halves, and later parts are no larger.
///
/// Engines sum in another order for another size of batch: of parts of one, each is the same to the last bit, whatever is run
/// with it.
fn in_parts(
    count: usize,
    at_once: &mut usize,
    mut run: impl FnMut(Range<usize>) -> Result<Tensor, ModelError>,
) -> Result<Tensor, ModelError> {
    let (mut done, mut parts) = (0, Vec::new());
    while done < count {
        let part = done..count.min(done + *at_once);
        match run(part.clone()) {
            Ok(outputs) => {
                parts.push(outputs);
                done = part.end;
            }
            Err(ModelError::Run { graph, reason }) if part.len() > 1 => {
                *at_once = part.len() / 2;
                log::warn!("{} at once are too many for `{graph}` ({reason}); now {at_once}", part.len());
            }
            Err(err) => return Err(err),
        }
    }
    Ok(Tensor::concat(&parts.iter().collect::<Vec<_>>()).expect("they have one shape and there is at least one"))
}

fn part_of(batch: &Tensor, part: Range<usize>) -> Tensor {
    let items: Vec<Tensor> = part.filter_map(|at| batch.item(at)).collect();
    Tensor::stack(&items).expect("the batch has these items, all of one shape")
}

/// The denoiser's graph, as the sampler wants it.
struct BundleDenoiser<'a> {
    graph: &'a mut Graph,
    spec: &'a GeneratorSpec,
    at_once: &'a mut usize,
}

impl Denoiser for BundleDenoiser<'_> {
    fn predict(&mut self, latent: &Tensor, timestep: u32, condition: &Tensor) -> Result<Tensor, ModelError> {
        let Self { graph, spec, at_once } = self;
        in_parts(latent.batch(), at_once, |part| {
            let float = Tensor::filled(vec![part.len()], timestep as f32);
            let whole = vec![i64::from(timestep); part.len()];
            let timestep = match spec.timestep {
                TimestepType::Int64 => Input::I64(&whole),
                TimestepType::Float32 => Input::F32(&float),
            };
            let (latent, condition) = (part_of(latent, part.clone()), part_of(condition, part));
            let inputs =
                [("latent", Input::F32(&latent)), ("timestep", timestep), ("condition", Input::F32(&condition))];
            graph.run(&inputs, "prediction", latent.shape())
        })
    }

    fn prediction(&self) -> Prediction {
        self.spec.prediction
    }

    fn latent_shape(&self) -> Vec<usize> {
        self.spec.latent.shape.to_vec()
    }
}

/// The picture ([`touch2touch_core::sample::PadTouch::picture`]) as the condition encoder wants it: scaled, resized,
/// normalized, turned; `[channels, height, width]`.
///
/// # Errors
/// [`GenerateError::BadImage`] for an image without pixels or with values that are not numbers.
pub fn prepare(difference: &RgbGrid, input: &GeneratorInput) -> Result<Tensor, GenerateError> {
    let bad = difference.as_slice().iter().flatten().filter(|v| !v.is_finite()).count();
    if bad > 0 || difference.is_empty() {
        return Err(GenerateError::BadImage { width: difference.width(), height: difference.height(), bad });
    }
    let scale = match input.scale {
        InputScale::Unit => 1.0 / 255.0,
        InputScale::Byte | InputScale::Meters => 1.0,
    };
    let [width, height] = input.size;
    let resized = input.resampling.resize_rgb(difference, width, height);
    let turned = if input.rotation_deg == 180 { resized.rotated_180() } else { resized };
    let plane = |c: usize| {
        let normalize = move |p: &[f32; 3]| ((f64::from(p[c]) * scale - input.mean[c]) / input.std[c]) as f32;
        turned.as_slice().iter().map(normalize).collect::<Vec<f32>>()
    };
    let channels = input.channels();
    let data = (0..channels).flat_map(plane).collect();
    Ok(Tensor::new(vec![channels, height, width], data).expect("the planes have this size"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::bundle::SensorSpec;
    use touch2touch_core::resample::Resampling;
    use touch2touch_core::rig::lab;

    fn input(scale: InputScale, rotation_deg: u32) -> GeneratorInput {
        GeneratorInput {
            sensor: SensorSpec::of(&lab::GELSLIM),
            size: [2, 2],
            scale,
            mean: vec![0.1, 0.0, -0.1],
            std: vec![0.5, 1.0, 2.0],
            resampling: Resampling::Bilinear,
            rotation_deg,
        }
    }

    #[test]
    fn the_image_is_scaled_normalized_and_turned() {
        let image = Grid::from_vec(2, 2, vec![[51.0, 0.0, 0.0], [0.0; 3], [0.0; 3], [0.0, 255.0, 0.0]]).unwrap();
        let unit = prepare(&image, &input(InputScale::Unit, 0)).unwrap();
        assert_eq!(unit.shape(), [3, 2, 2]);
        assert!((unit.data()[0] - 0.2).abs() < 1e-6 && (unit.data()[1] + 0.2).abs() < 1e-6);
        assert!((unit.data()[7] - 1.0).abs() < 1e-6 && (unit.data()[8] - 0.05).abs() < 1e-6);
        let byte = prepare(&image, &input(InputScale::Byte, 180)).unwrap();
        assert!((byte.data()[3] - 101.8).abs() < 1e-4 && (byte.data()[4] - 255.0).abs() < 1e-4);
    }

    #[test]
    fn a_batch_that_is_too_large_is_run_by_halves() {
        let (mut at_once, mut sizes) = (32, Vec::new());
        let outputs = in_parts(11, &mut at_once, |part| {
            sizes.push(part.len());
            match part.len() > 3 {
                true => Err(ModelError::Run { graph: "denoiser".into(), reason: "out of memory".into() }),
                false => Ok(Tensor::new(vec![part.len(), 1], part.map(|at| at as f32).collect()).unwrap()),
            }
        });
        assert_eq!((outputs.unwrap().data(), at_once), ((0..11).map(|v| v as f32).collect::<Vec<_>>().as_slice(), 2));
        assert_eq!(sizes, [11, 5, 2, 2, 2, 2, 2, 1]);
        // One that fails alone fails.
        let alone =
            in_parts(1, &mut at_once, |_| Err(ModelError::Run { graph: "denoiser".into(), reason: "no".into() }));
        assert!(alone.is_err());
    }

    #[test]
    fn an_image_that_is_no_image_is_an_error() {
        let bad = Grid::filled(3, 2, [0.0, f32::NAN, 0.0]);
        assert!(matches!(prepare(&bad, &input(InputScale::Unit, 0)), Err(GenerateError::BadImage { bad: 6, .. })));
        let empty = Grid::from_vec(0, 0, vec![]).unwrap();
        assert!(prepare(&empty, &input(InputScale::Unit, 0)).is_err());
    }
}
