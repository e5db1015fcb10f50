//! The manifest's keys, and what makes a manifest wrong.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::fit::FitSpec;
use super::sensor::{SensorPair, SensorSpec};
use super::{FileEntry, Problems, Role};
use touch2touch_core::diffusion::{GenerateConfig, Prediction, Sampler, Schedule, Spacing};
use touch2touch_core::postprocess::{
    ColorChain, DepthChain, DepthRange, PostprocessError, Reduction, Shift, ShiftMode, ShiftStats,
};
use touch2touch_core::resample::Resampling;
use touch2touch_core::rig::{Sensor, SensorKind, lab, share};

const FORMAT: &str = "touch2touch-bundle";
/// The newest version; the first declares no sensors, and means the lab's.
const VERSION: u64 = 2;
/// No side of an image or latent may be longer; a larger number is a mistake and would exhaust the memory.
const MAX_SIDE: usize = 4096;
/// Most values of one tensor: four pictures with the longest sides.
const MAX_VALUES: usize = 4 * MAX_SIDE * MAX_SIDE;

/// Kind of a bundle, with its description.
#[derive(Clone, Debug, PartialEq)]
pub enum BundleSpec {
    /// Touch of one sensor to the touch that another would have felt.
    Generator(Box<GeneratorSpec>),
    /// Imprint to contact mask.
    MaskUnet(MaskSpec),
    /// Imprint to the tool that made it.
    ToolClassifier(ClassifierSpec),
}

/// A latent-diffusion generator.
#[derive(Clone, Debug, PartialEq)]
pub struct GeneratorSpec {
    /// Preparation of the difference image.
    pub input: GeneratorInput,
    /// Shape of the condition.
    pub condition: TensorSpec,
    /// Shape and scale of the latent.
    pub latent: LatentSpec,
    /// Noise schedule of the training.
    pub schedule: Schedule,
    /// Noise schedule, as the manifest has it.
    pub schedule_spec: ScheduleSpec,
    /// Meaning of the denoiser's output.
    pub prediction: Prediction,
    /// Reading of the decoder's picture.
    pub output: OutputSpec,
    /// Statistics for the paper's shift; `None` if the bundle has none.
    pub shift: Option<ShiftStats>,
    /// Settings to generate with if nobody chooses.
    pub defaults: GenerateConfig,
    /// Type of the timestep that the denoiser's graph takes.
    pub timestep: TimestepType,
    /// The fit to a rig, if it was fitted to one.
    pub fit: Option<FitSpec>,
}

impl GeneratorSpec {
    /// The sensors that it is for.
    pub fn sensors(&self) -> SensorPair {
        SensorPair { input: self.input.sensor.clone(), output: self.output.sensor.clone() }
    }

    /// The steps from the decoder's picture to depth, for the user's choice of shift.
    ///
    /// # Errors
    /// [`PostprocessError::NoStatistics`] for the paper's shift of a bundle without statistics,
    /// [`PostprocessError::NotDepth`] for a bundle that predicts a color picture.
    pub fn depth_chain(&self, mode: ShiftMode) -> Result<DepthChain, PostprocessError> {
        let chain = DepthChain {
            range: self.output.range_m.ok_or(PostprocessError::NotDepth)?,
            reduction: self.output.reduction,
            shift: Shift::None,
            correction: None,
            size: self.output.imprint_size,
            resampling: self.output.resampling,
            rotation_deg: self.output.rotation_deg,
            window: self.output.window_px.map(|center| share(center, self.output.imprint_size)),
            offset: [0.0; 2],
        };
        chain.with_mode(mode, self.shift)
    }

    /// The steps from the decoder's picture to a color sensor's difference; `None` for a bundle that predicts depth.
    pub fn color_chain(&self) -> Option<ColorChain> {
        Some(ColorChain {
            range: self.output.range?,
            size: self.output.imprint_size,
            resampling: self.output.resampling,
            rotation_deg: self.output.rotation_deg,
        })
    }
}

/// The element type of the denoiser's `timestep`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimestepType {
    /// int64, as in latent diffusion.
    Int64,
    /// float32 holding the same whole number.
    Float32,
}

/// `input` of a generator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeneratorInput {
    /// Sensor: of a color sensor the picture is the difference of touched and untouched image, RGB; of a depth sensor
    /// the imprint.
    pub sensor: SensorSpec,
    /// `[width, height]` the picture is resized to, pixels.
    pub size: [usize; 2],
    /// Scale of the picture before mean and deviation.
    pub scale: InputScale,
    /// Subtracted per channel: three of a color sensor, one of a depth sensor.
    pub mean: Vec<f64>,
    /// Divided by per channel.
    pub std: Vec<f64>,
    /// Resampling by which it is resized.
    #[serde(default = "bilinear")]
    pub resampling: Resampling,
    /// Rotation of the prepared image: 0 or 180 degrees.
    #[serde(default)]
    pub rotation_deg: u32,
}

/// Scale of the picture that mean and deviation belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum InputScale {
    /// Divided by 255.
    #[serde(rename = "0..1")]
    Unit,
    /// As stored.
    #[serde(rename = "0..255")]
    Byte,
    /// Meters, of a depth sensor.
    #[serde(rename = "m")]
    Meters,
}

impl GeneratorInput {
    /// Channels of the prepared picture.
    pub fn channels(&self) -> usize {
        match self.sensor.kind {
            SensorKind::Color => 3,
            SensorKind::Depth => 1,
        }
    }
}

/// The shape of a tensor without its batch: channels, rows, columns.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TensorSpec {
    /// `[channels, height, width]`.
    pub shape: [usize; 3],
}

/// `latent`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LatentSpec {
    /// `[channels, height, width]`.
    pub shape: [usize; 3],
    /// The decoder is given `latent / scale_factor`.
    pub scale_factor: f64,
}

/// `schedule`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduleSpec {
    /// Formula of the betas.
    pub kind: ScheduleKind,
    /// Training steps.
    pub steps: usize,
    /// First beta.
    pub beta_start: f64,
    /// Last beta.
    pub beta_end: f64,
}

/// The formula of a schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScheduleKind {
    /// [`Schedule::scaled_linear`], what latent diffusion calls "linear".
    ScaledLinear,
}

/// `output` of a generator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputSpec {
    /// Sensor that would have felt the picture.
    pub sensor: SensorSpec,
    /// `[width, height]` of the decoder's picture.
    pub size: [usize; 2],
    /// Channels of the decoder's picture.
    pub channels: usize,
    /// Depths that -1 and 1 mean, meters: of a depth sensor.
    #[serde(default)]
    pub range_m: Option<DepthRange>,
    /// Differences that -1 and 1 mean, on the 0..255 scale: of a color sensor.
    #[serde(default)]
    pub range: Option<[f64; 2]>,
    /// Reduction of the channels of a depth picture to one.
    #[serde(default)]
    pub reduction: Reduction,
    /// Rotation from the picture to the sensor's own raw orientation: 0 or 180 degrees.
    #[serde(default)]
    pub rotation_deg: u32,
    /// `[width, height]` of the imprint (or color picture) that the decoder's picture stands for.
    pub imprint_size: [usize; 2],
    /// Resampling by which the picture is brought to that size.
    #[serde(default = "bilinear")]
    pub resampling: Resampling,
    /// Center of the color sensor's window in the picture, pixels of the imprint in its raw orientation: of a model
    /// that draws it in the same place for every pad. Without it, pictures stay where they are drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window_px: Option<[f64; 2]>,
}

fn bilinear() -> Resampling {
    Resampling::Bilinear
}

/// A contact mask UNet.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskSpec {
    /// Preparation of the imprint.
    pub input: MaskInput,
    /// Reading of the output.
    pub output: MaskOutput,
}

/// `input` of a mask UNet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskInput {
    /// Sensor: a depth sensor.
    pub sensor: SensorSpec,
    /// `[width, height]`, pixels.
    pub size: [usize; 2],
    /// The imprint's depth that becomes 0 and 1, meters.
    pub range_m: DepthRange,
    /// Conversion of the scaled depth to 0..1.
    #[serde(default)]
    pub cast: Cast,
    /// Rotation of the raw imprint before the graph (and back after it): 0 or 180 degrees.
    #[serde(default)]
    pub rotation_deg: u32,
}

/// Conversion between the scaled imprint and the graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cast {
    /// Truncated to eight bits, clamped to 0..255, divided by 255.
    #[default]
    Saturate,
    /// As the lab: truncated to eight bits, wrapping around outside, divided by 255.
    Wrap,
    /// Clamped to 0..1, not truncated.
    None,
}

/// `output` of a mask UNet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskOutput {
    /// 2: softmax, the second is contact. 1: sigmoid.
    pub classes: usize,
    /// Probability from which a pixel is contact.
    #[serde(default = "half")]
    pub threshold: f64,
}

/// A tool classifier.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassifierSpec {
    /// Preparation of the imprint.
    pub input: ClassifierInput,
    /// Classes that it can name.
    pub output: ClassifierOutput,
}

/// `input` of a tool classifier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassifierInput {
    /// Sensor: a depth sensor.
    pub sensor: SensorSpec,
    /// `[width, height]`, pixels; resized bilinearly.
    pub size: [usize; 2],
    /// The imprint's depth that becomes -1 and 1, meters; clamped.
    pub range_m: DepthRange,
    /// Rotation of the raw imprint before the graph: 0 or 180 degrees.
    #[serde(default)]
    pub rotation_deg: u32,
}

/// `output` of a tool classifier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassifierOutput {
    /// The tools' names, in the order of the logits.
    pub classes: Vec<String>,
    /// Length of the graph's output `features`, by which sets of imprints are compared; without it there is none.
    #[serde(default)]
    pub features: Option<usize>,
}

fn half() -> f64 {
    0.5
}

/// `defaults`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Defaults {
    steps: u32,
    #[serde(default)]
    sampler: Sampler,
    #[serde(default)]
    spacing: Spacing,
    #[serde(default)]
    eta: f64,
    #[serde(default = "default_seed")]
    seed: u64,
}

fn default_seed() -> u64 {
    GenerateConfig::default().seed
}

/// A parsed manifest. `spec` is `None` if something kept it from being read (the problems then say what).
pub(super) struct Manifest {
    pub(super) name: String,
    pub(super) files: BTreeMap<Role, FileEntry>,
    pub(super) spec: Option<BundleSpec>,
    pub(super) provenance: Value,
}

/// Reads the manifest and adds all that is wrong with it; `None` if it is no manifest of this version at all.
pub(super) fn parse(text: &[u8], problems: &mut Problems) -> Option<Manifest> {
    let value: Value = match serde_json::from_slice(text) {
        Ok(value) => value,
        Err(err) => {
            problems.add(format!("is not valid JSON: {err}"), "correct it, or copy the bundle again");
            return None;
        }
    };
    let Value::Object(mut keys) = value else {
        problems.add("is not a JSON object", "see the description of the manifest in the documentation");
        return None;
    };
    if keys.remove("format").as_ref().and_then(Value::as_str) != Some(FORMAT) {
        problems.add(format!("format: must be \"{FORMAT}\""), "this is another program's file");
        return None;
    }
    match keys.remove("format_version") {
        Some(version) if version.as_u64() == Some(1) => upgrade(&mut keys),
        Some(version) if version.as_u64() == Some(VERSION) => {}
        version => {
            let version = version.map_or("missing".to_owned(), |v| v.to_string());
            problems.add(
                format!("format_version: {version}, but this program reads versions 1 to {VERSION}"),
                "use a bundle made for this version of the program, or update the program",
            );
            return None;
        }
    }

    let name: String = section(&mut keys, "name", problems).unwrap_or_default();
    let files: BTreeMap<Role, FileEntry> = section(&mut keys, "files", problems).unwrap_or_default();
    let provenance = keys.remove("provenance").unwrap_or_default();
    let kind: Option<String> = section(&mut keys, "kind", problems);
    let (spec, roles): (_, &[Role]) = match kind.as_deref() {
        Some("generator") => (generator(&mut keys, problems), &[Role::ConditionEncoder, Role::Denoiser, Role::Decoder]),
        Some("mask_unet") => (mask(&mut keys, problems), &[Role::MaskUnet]),
        Some("tool_classifier") => (classifier(&mut keys, problems), &[Role::ToolClassifier]),
        other => {
            if let Some(other) = other {
                let hint = "it must be \"generator\", \"mask_unet\" or \"tool_classifier\"";
                problems.add(format!("kind: \"{other}\" is unknown"), hint);
            }
            return None;
        }
    };
    for role in roles {
        if !files.contains_key(role) {
            problems.add(format!("files.{}: missing", role.key()), "name the graph's file and its SHA-256");
        }
    }
    for role in files.keys().filter(|role| !roles.contains(role)) {
        problems.add(format!("files.{}: not part of this kind of bundle", role.key()), "remove it");
    }
    for key in keys.keys() {
        problems.add(format!("{key}: unknown key"), "remove it, or move it under provenance");
    }
    Some(Manifest { name, files, spec, provenance })
}

/// Declares the sensors of a manifest of the first version, which were always the lab's.
fn upgrade(keys: &mut Map<String, Value>) {
    let generator = keys.get("kind").and_then(Value::as_str) == Some("generator");
    let (input, output) = if generator { (&lab::GELSLIM, Some(&lab::BUBBLE)) } else { (&lab::BUBBLE, None) };
    let declared = |sensor: &Sensor| serde_json::to_value(SensorSpec::of(sensor)).unwrap_or_default();
    if let Some(Value::Object(section)) = keys.get_mut("input")
        && section.get("sensor").and_then(Value::as_str) == Some(&*input.key)
    {
        section.insert("sensor".into(), declared(input));
    }
    if let (Some(Value::Object(section)), Some(output)) = (keys.get_mut("output"), output) {
        section.insert("sensor".into(), declared(output));
    }
}

/// Takes one key out of the manifest and reads it.
fn section<T: DeserializeOwned>(keys: &mut Map<String, Value>, key: &str, problems: &mut Problems) -> Option<T> {
    let value = keys.remove(key).or_else(|| {
        problems.add(format!("{key}: missing"), "add it as the documentation of the manifest describes");
        None
    })?;
    serde_json::from_value(value)
        .map_err(|err| {
            problems.add(format!("{key}: {err}"), "correct it as the documentation of the manifest describes")
        })
        .ok()
}

/// Reports what is not fine, with what to do about it.
type Check<'a> = &'a mut dyn FnMut(bool, &str, &str);

fn check_input(input: &GeneratorInput, check: Check<'_>) {
    check(sides(&input.size), "input.size: out of range", SIDES);
    check(turn(input.rotation_deg), "input.rotation_deg: not supported", TURNS);
    check(sides(&input.sensor.size), "input.sensor.size: out of range", SIDES);
    let n = input.channels();
    let each = "give one number per channel: three of a color sensor, one of a depth sensor";
    check(input.mean.len() == n && input.mean.iter().all(|m| m.is_finite()), "input.mean: not numbers", each);
    let positive = input.std.len() == n && input.std.iter().all(|&s| s > 0.0 && s.is_finite());
    check(positive, "input.std: not positive", each);
    let meters = (input.sensor.kind == SensorKind::Depth) == (input.scale == InputScale::Meters);
    check(meters, "input.scale: not the sensor's", "\"m\" of a depth sensor, \"0..1\" or \"0..255\" of a color sensor");
}

fn check_output(output: &OutputSpec, check: Check<'_>) {
    check(sides(&output.size), "output.size: out of range", SIDES);
    check(sides(&output.imprint_size), "output.imprint_size: out of range", SIDES);
    let inside = |center: [f64; 2]| (0..2).all(|i| (0.0..output.imprint_size[i] as f64).contains(&center[i]));
    let place = "give the window's center, pixels of the imprint in its raw orientation";
    check(output.window_px.is_none_or(inside), "output.window_px: outside the imprint", place);
    check(sides(&output.sensor.size), "output.sensor.size: out of range", SIDES);
    match output.sensor.kind {
        SensorKind::Depth => {
            let valid = output.range_m.is_some_and(|range| range.is_valid()) && output.range.is_none();
            check(valid, "output.range_m: empty", "give [smallest, largest] depth in meters");
        }
        SensorKind::Color => {
            let valid = output.range.is_some_and(|[lo, hi]| lo < hi && lo.is_finite() && hi.is_finite());
            let valid = valid && output.range_m.is_none();
            check(valid, "output.range: empty", "give [smallest, largest] difference on the 0..255 scale");
            check(output.channels == 3, "output.channels: not a color picture's", "a color sensor has 3 channels");
        }
    }
    check(turn(output.rotation_deg), "output.rotation_deg: not supported", TURNS);
    check((1..=4).contains(&output.channels), "output.channels: out of range", "1 to 4 channels can be used");
    let luma = output.reduction != Reduction::Luma || output.channels == 3;
    check(luma, "output.reduction: luma needs 3 channels", "use \"mean\"");
}

fn generator(keys: &mut Map<String, Value>, problems: &mut Problems) -> Option<BundleSpec> {
    // Every section is read before any is given up, so that the list of problems is whole.
    let input: Option<GeneratorInput> = section(keys, "input", problems);
    let condition: Option<TensorSpec> = section(keys, "condition", problems);
    let latent: Option<LatentSpec> = section(keys, "latent", problems);
    let schedule: Option<ScheduleSpec> = section(keys, "schedule", problems);
    let prediction: Option<Prediction> = section(keys, "prediction", problems);
    let output: Option<OutputSpec> = section(keys, "output", problems);
    let shift: Option<ShiftStats> = if keys.contains_key("shift") { section(keys, "shift", problems) } else { None };
    let defaults: Option<Defaults> = section(keys, "defaults", problems);
    let fit: Option<FitSpec> = if keys.contains_key("fit") { section(keys, "fit", problems) } else { None };

    let mut check = |fine: bool, what: &str, hint: &str| {
        if !fine {
            problems.add(what, hint);
        }
    };
    if let Some(input) = &input {
        check_input(input, &mut check);
    }
    if let Some(condition) = &condition {
        check(sides(&condition.shape), "condition.shape: out of range", SIDES);
    }
    if let Some(latent) = &latent {
        check(sides(&latent.shape), "latent.shape: out of range", SIDES);
        let usable = latent.scale_factor > 0.0 && latent.scale_factor.is_finite();
        check(usable, "latent.scale_factor: not positive", "give the factor used in training");
    }
    if let Some(output) = &output {
        check_output(output, &mut check);
        if output.sensor.kind == SensorKind::Color {
            check(shift.is_none(), "shift: not for a color picture", "remove it");
            check(fit.is_none(), "fit: not for a color picture", "remove it");
        }
    }
    if let Some(s) = &shift {
        let finite = [s.pred_mean, s.pred_std, s.gt_mean, s.gt_std].iter().all(|v| v.is_finite());
        check(finite && s.pred_std >= 0.0 && s.gt_std >= 0.0, "shift: not usable", "give four finite numbers");
    }
    let schedule_spec = schedule.clone();
    let schedule = schedule.and_then(|spec| {
        let built = Schedule::scaled_linear(spec.steps, spec.beta_start, spec.beta_end);
        built.map_err(|err| problems.add(format!("schedule: {err}"), "give the schedule used in training")).ok()
    });
    let defaults = defaults.map(|d| GenerateConfig {
        steps: d.steps,
        eta: d.eta,
        seed: d.seed,
        sampler: d.sampler,
        spacing: d.spacing,
    });
    if let Some(d) = &defaults {
        if !(0.0..=1.0).contains(&d.eta) {
            problems.add("defaults.eta: out of range", "choose 0 to 1");
        }
        if let (Some(schedule), Some(prediction)) = (&schedule, prediction)
            && let Err(err) = schedule.steps(d.steps, d.spacing, prediction)
        {
            problems.add(format!("defaults: {err}"), "change the steps, the spacing or the schedule");
        }
    }
    Some(BundleSpec::Generator(Box::new(GeneratorSpec {
        input: input?,
        condition: condition?,
        latent: latent?,
        schedule: schedule?,
        schedule_spec: schedule_spec?,
        prediction: prediction?,
        output: output?,
        shift,
        defaults: defaults?,
        timestep: TimestepType::Int64,
        fit,
    })))
}

/// Checks the picture that a model of imprints is given.
fn check_imprint(sensor: &SensorSpec, size: &[usize; 2], range: DepthRange, turned: u32, problems: &mut Problems) {
    if !sides(size) {
        problems.add("input.size: out of range", SIDES);
    }
    if !range.is_valid() {
        problems.add("input.range_m: empty", "give [smallest, largest] depth in meters");
    }
    if !turn(turned) {
        problems.add("input.rotation_deg: not supported", TURNS);
    }
    if sensor.kind != SensorKind::Depth {
        problems.add("input.sensor.kind: not depth", "contact and tools are found in imprints of a depth sensor");
    }
}

fn mask(keys: &mut Map<String, Value>, problems: &mut Problems) -> Option<BundleSpec> {
    let input: Option<MaskInput> = section(keys, "input", problems);
    let output: Option<MaskOutput> = section(keys, "output", problems);
    if let Some(input) = &input {
        check_imprint(&input.sensor, &input.size, input.range_m, input.rotation_deg, problems);
    }
    if let Some(output) = &output {
        if !(1..=2).contains(&output.classes) {
            problems.add("output.classes: out of range", "1 (sigmoid) or 2 (softmax)");
        }
        if !(output.threshold > 0.0 && output.threshold < 1.0) {
            problems.add("output.threshold: out of range", "give a probability between 0 and 1");
        }
    }
    Some(BundleSpec::MaskUnet(MaskSpec { input: input?, output: output? }))
}

fn classifier(keys: &mut Map<String, Value>, problems: &mut Problems) -> Option<BundleSpec> {
    let input: Option<ClassifierInput> = section(keys, "input", problems);
    let output: Option<ClassifierOutput> = section(keys, "output", problems);
    if let Some(input) = &input {
        check_imprint(&input.sensor, &input.size, input.range_m, input.rotation_deg, problems);
    }
    if let Some(output) = &output {
        let mut names: Vec<&String> = output.classes.iter().filter(|name| !name.is_empty()).collect();
        names.sort();
        names.dedup();
        if names.len() != output.classes.len() || !(2..=MAX_SIDE).contains(&names.len()) {
            problems.add("output.classes: not usable", "name at least two tools, each once");
        }
        if output.features.is_some_and(|n| !sides(&[n])) {
            problems.add("output.features: out of range", "1 to 4096, or leave it out");
        }
    }
    Some(BundleSpec::ToolClassifier(ClassifierSpec { input: input?, output: output? }))
}

const SIDES: &str = "every side must be 1 to 4096, and no tensor larger than 4 x 4096 x 4096";
const TURNS: &str = "it must be 0 or 180";

fn sides(sides: &[usize]) -> bool {
    sides.iter().all(|&n| (1..=MAX_SIDE).contains(&n)) && sides.iter().product::<usize>() <= MAX_VALUES
}

fn turn(degrees: u32) -> bool {
    matches!(degrees, 0 | 180)
}

#[cfg(test)]
mod tests;
