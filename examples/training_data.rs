//! Writes one shard of training data for the Python package in `training/`.
//!
//! `cargo run --release --no-default-features --example training_data -- OUT N SEED [train|depths|unseen|seen]
//! [plain|ambiguous|misaligned]`
//! writes `N` grasps, both fingers each, to the new folder `OUT`: `gelslim.npy`, `imprint.npy`, `clean.npy`,
//! `contact.npy`, `meta.npy` (described in `training/data.py`) and, last of all, `done.json`.
//! `train`: 60 % the nine seen tools, 40 % random tools, 60 % of it with randomised sensors and stretched tools. `seen` and `unseen`:
//! those tools with the nominal sensors, for validation. The three unseen tools are never in `train`.
//! `depths`: as `train`, with bubbles of any size pressed 2 to 15 mm deep, for contact masks only: a GelSlim image does not
//! tell how deep the bubble is pressed, so a generator would learn from them to draw the mean of all depths.
//! `ambiguous`: the GelSlims close on the bare shaft of the tool, so that they see nothing of its pattern.
//! `misaligned`: the bubbles grasp up to 8 mm from where the GelSlims did. For a mixture, write shards of both.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use touch2touch::domain::catalog::{self, ToolSpec};
use touch2touch::domain::grid::DepthMap;
use touch2touch::domain::resample;
use touch2touch::domain::rig::lab;
use touch2touch::domain::sim::{self, BubbleConfig, Condition, Grasp, MISALIGNMENT_M, SimConfig};

/// Side of the resized GelSlim image, pixels.
const SIDE: usize = 128;
/// Steps per gray level in which the difference image is stored.
const STEPS_PER_LEVEL: f32 = 64.0;
/// Grasps simulated at a time.
const CHUNK: usize = 64;
/// Numbers per sample in `meta.npy`.
const META: usize = 8;

/// Where the grasps of a shard come from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mix {
    Train,
    Depths,
    Seen,
    Unseen,
}

impl Mix {
    /// Whether it trains a network: with invented tools, and never with the unseen ones.
    fn trains(self) -> bool {
        matches!(self, Self::Train | Self::Depths)
    }
}

/// One finger's part of a grasp, as it is stored.
struct Record {
    gelslim: Vec<i16>,
    imprint: Vec<i16>,
    clean: Vec<i16>,
    contact: Vec<u8>,
    meta: [f32; META],
}

/// A `.npy` file (version 1.0, little endian, C order) whose length is known beforehand.
struct Npy(BufWriter<File>);

impl Npy {
    fn create(folder: &Path, name: &str, kind: &str, shape: &[usize]) -> Result<Self> {
        let path = folder.join(name);
        let mut file = BufWriter::new(File::create(&path).with_context(|| format!("cannot write {}", path.display()))?);
        let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
        let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({},), }}", shape.join(", "));
        let padded = (10 + text.len() + 1).next_multiple_of(64) - 10;
        let length = u16::try_from(padded).context("header too long")?;
        file.write_all(b"\x93NUMPY\x01\x00")?;
        file.write_all(&length.to_le_bytes())?;
        writeln!(file, "{text:<width$}", width = padded - 1)?;
        Ok(Self(file))
    }

    fn i16s(&mut self, values: &[i16]) -> Result<()> {
        values.iter().try_for_each(|v| self.0.write_all(&v.to_le_bytes()))?;
        Ok(())
    }
}

/// Meters to whole micrometers; no measurement becomes `i16::MIN`.
fn micrometers(depth: &DepthMap) -> Vec<i16> {
    depth
        .as_slice()
        .iter()
        .map(|z| if z.is_nan() { i16::MIN } else { (z * 1e6).round().clamp(-32767.0, 32767.0) as i16 })
        .collect()
}

/// The tool with narrower bars, longer ones to the sides and towards the wrist and shorter ones at the tip, as the real tools
/// have: most of their bars that lie across run out of the picture.
fn stretched(mut tool: ToolSpec, rng: &mut ChaCha8Rng) -> ToolSpec {
    let side = rng.random_range(1.0..2.4);
    let wrist = rng.random_range(0.95..1.3);
    let tip = rng.random_range(0.15..0.9);
    for p in tool.bars.iter_mut().flat_map(|bar| &mut bar.core) {
        p.x *= side;
        p.y *= if p.y > 0.0 { tip } else { wrist };
    }
    // Real bars are narrower than the catalog's, with sharper rims.
    let width = rng.random_range(0.5..1.0);
    tool.bars.iter_mut().for_each(|bar| bar.half_width_m *= width);
    let bevel = rng.random_range(0.4..1.0);
    tool.bevel_width_m *= bevel * width;
    tool.bevel_depth_m *= bevel;
    tool
}

/// The bubble in another size, pressed on as lightly or as hard as any gripper does; slower distortions weigh more where the
/// imprint is shallow.
fn of_any_depth(bubble: BubbleConfig, rng: &mut ChaCha8Rng) -> BubbleConfig {
    let press_m = 0.002 * 7.5_f64.powf(rng.random_range(0.0..1.0));
    let size = rng.random_range(0.55..1.0);
    BubbleConfig {
        press_m,
        dome_rise_m: bubble.dome_rise_m * rng.random_range(0.5..1.1),
        rim_semi_axes_m: bubble.rim_semi_axes_m.map(|a| a * size),
        rim_center_z_m: bubble.rim_center_z_m * rng.random_range(-0.3..1.0),
        air_kept: bubble.air_kept * rng.random_range(0.0..1.0),
        noise_m: bubble.noise_m * rng.random_range(0.2..1.0),
        texture_m: bubble.texture_m * rng.random_range(0.0..1.0),
        speckle_density: bubble.speckle_density * rng.random_range(0.0..1.0),
        dropped_share: if rng.random_bool(0.5) { bubble.dropped_share } else { rng.random_range(0.0..0.006) },
        ..bubble
    }
}

/// Simulates grasp `index` of the shard; both fingers.
fn grasp(index: u64, seed: u64, mix: Mix, condition: Condition) -> Result<Vec<Record>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(index));
    let pick = |rng: &mut ChaCha8Rng, seen: bool| {
        let tools: Vec<usize> = (0..catalog::tools().len()).filter(|&i| catalog::tools()[i].seen == seen).collect();
        tools[rng.random_range(0..tools.len())]
    };
    let random = mix.trains() && rng.random_bool(0.4);
    let number = if random { None } else { Some(pick(&mut rng, mix != Mix::Unseen)) };
    let invented;
    let nominal = !mix.trains() || rng.random_bool(if mix == Mix::Depths { 0.0 } else { 0.4 });
    let tool = match number {
        Some(i) if nominal => &catalog::tools()[i],
        Some(i) => {
            invented = stretched(catalog::tools()[i].clone(), &mut rng);
            &invented
        }
        None => {
            let tool = catalog::random_tool(rng.random());
            invented = if nominal { tool } else { stretched(tool, &mut rng) };
            &invented
        }
    };
    let mut config = if nominal { SimConfig::default() } else { SimConfig::randomised(rng.random()) };
    if mix == Mix::Depths {
        config.bubble = of_any_depth(config.bubble, &mut rng);
    }
    let grasp = sim::random_grasp(rng.random());
    let on_shaft = if condition == Condition::Ambiguous { Some(catalog::on_a_shaft(tool.clone())) } else { None };
    let tool = on_shaft.as_ref().unwrap_or(tool);
    let noise = rng.random();
    // the bubbles' own grasp, if it is another one
    let gelslims = grasp;
    let grasp = if condition == Condition::Misaligned {
        let mut off = || rng.random_range(-MISALIGNMENT_M..=MISALIGNMENT_M);
        Grasp { x_m: grasp.x_m + off(), y_m: grasp.y_m + off(), ..grasp }
    } else {
        grasp
    };
    let sample = sim::simulate_apart(tool, gelslims, grasp, noise, &config);
    lab::PADS
        .iter()
        .map(|&finger| {
            let touch = sample.pad(finger).context("the simulator left a finger out")?;
            let gelslim = touch.color().context("no GelSlim image")?;
            let imprint = touch.depth().context("no bubble image")?;
            let truth = imprint.truth.as_ref().context("no truth")?;
            ensure!(imprint.imprint.size() == [lab::BUBBLE.width, lab::BUBBLE.height], "unexpected bubble size");
            let small = resample::bilinear_rgb(&gelslim.difference, SIDE, SIDE);
            let planes =
                (0..3).flat_map(|c| small.as_slice().iter().map(move |p| (p[c] * STEPS_PER_LEVEL).round() as i16));
            let tool_number = number.map_or(-1.0, |i| i as f32);
            Ok(Record {
                gelslim: planes.collect(),
                imprint: micrometers(&imprint.imprint),
                clean: micrometers(&truth.imprint),
                contact: truth.contact.as_slice().iter().map(|&c| u8::from(c)).collect(),
                meta: [
                    index as f32,
                    finger.index() as f32,
                    grasp.theta_rad as f32,
                    grasp.x_m as f32,
                    grasp.y_m as f32,
                    tool_number,
                    if mix == Mix::Depths { 2.0 } else { f32::from(u8::from(nominal)) },
                    f32::from(u8::from(mix == Mix::Unseen)),
                ],
            })
        })
        .collect()
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    ensure!(
        (3..=5).contains(&arguments.len()),
        "usage: training_data OUT N SEED [train|depths|seen|unseen] [plain|ambiguous|misaligned]"
    );
    let folder = Path::new(&arguments[0]);
    let grasps: usize = arguments[1].parse().context("N must be a whole number")?;
    let seed: u64 = arguments[2].parse().context("SEED must be a whole number")?;
    let mix_name = arguments.get(3).map_or("train", String::as_str);
    let mix = match mix_name {
        "train" => Mix::Train,
        "depths" => Mix::Depths,
        "seen" => Mix::Seen,
        "unseen" => Mix::Unseen,
        other => anyhow::bail!("unknown mix {other:?}: use train, depths, seen or unseen"),
    };
    let condition_name = arguments.get(4).map_or("plain", String::as_str);
    let condition = match condition_name {
        "plain" => Condition::Plain,
        "ambiguous" => Condition::Ambiguous,
        "misaligned" => Condition::Misaligned,
        other => anyhow::bail!("unknown condition {other:?}: use plain, ambiguous or misaligned"),
    };
    ensure!(!folder.join("done.json").exists(), "{} is already written", folder.display());
    std::fs::create_dir_all(folder)?;

    let samples = 2 * grasps;
    let image = [samples, lab::BUBBLE.height, lab::BUBBLE.width];
    let mut gelslim = Npy::create(folder, "gelslim.npy", "<i2", &[samples, 3, SIDE, SIDE])?;
    let mut imprint = Npy::create(folder, "imprint.npy", "<i2", &image)?;
    let mut clean = Npy::create(folder, "clean.npy", "<i2", &image)?;
    let mut contact = Npy::create(folder, "contact.npy", "|u1", &image)?;
    let mut meta = Npy::create(folder, "meta.npy", "<f4", &[samples, META])?;
    let bar = indicatif::ProgressBar::new(grasps as u64);
    for start in (0..grasps).step_by(CHUNK) {
        let end = grasps.min(start + CHUNK);
        let chunk: Vec<Vec<Record>> =
            (start..end).into_par_iter().map(|i| grasp(i as u64, seed, mix, condition)).collect::<Result<_>>()?;
        for record in chunk.iter().flatten() {
            gelslim.i16s(&record.gelslim)?;
            imprint.i16s(&record.imprint)?;
            clean.i16s(&record.clean)?;
            contact.0.write_all(&record.contact)?;
            record.meta.iter().try_for_each(|v| meta.0.write_all(&v.to_le_bytes()))?;
        }
        bar.inc((end - start) as u64);
    }
    for mut file in [gelslim, imprint, clean, contact, meta] {
        file.0.flush()?;
    }
    let done = serde_json::json!({ "mix": mix_name, "condition": condition_name, "grasps": grasps, "samples": samples, "seed": seed });
    std::fs::write(folder.join("done.json"), done.to_string())?;
    Ok(())
}
