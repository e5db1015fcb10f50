//! Tunes the shipped generator on prepared pairs, cross-validated, and prints times, memory, losses and scores.
//!
//! `cargo run --release -p touch2touch-tuning --example real_pairs -- FOLDER [NAME=VALUE …]`
//!
//! The folder holds `pictures.npy` `[n, 3, 128, 128]` (difference images, 0..1 scale, upright), `imprints.npy`
//! `[n, 128, 128]` (as the decoder draws them, 0..1 = −6.3 to 18 mm) and `pads.npy` `[n]` (−1 = simulated), all `<f4`.
//! Names: `steps`, `batch`, `seed`, `folds`, `only` (one fold), `threads`, `trained` (all, encoder), `augment` (none), `anchor`, `decay`, `rate`, `simulated`
//! (share of each batch), `sim` (another such folder: simulated pairs to mix in), `simtest` (one to score on), `start`
//! (identity, closed), `sampler` (steps).
//!
//! Scores: mm stretches both images to 0..1 by their extremes, ls draws the best straight line, raw compares them as
//! they are; PSNR in dB.
#![allow(clippy::print_stdout, reason = "figures are what it is for")]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

use touch2touch_tuning::{
    Augment, Config, Descent as _, NoiseSchedule, Pair, Placement, Sampler, Start, Trained, Tuner,
};

const SIDE: usize = 128;
const BUNDLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/models/generator_ldm");

/// mm, ls and raw.
type Score = [f64; 3];
type Outcome<T> = Result<T, Box<dyn Error>>;

/// The shipped bundle, by its manifest.
fn shipped(sampler: usize) -> Outcome<Start> {
    let file = |name: &str| std::fs::read(format!("{BUNDLE}/{name}.onnx"));
    Ok(Start {
        encoder: file("condition_encoder")?,
        denoiser: file("denoiser")?,
        decoder: file("decoder")?,
        schedule: NoiseSchedule { steps: 1000, beta_start: 0.0015, beta_end: 0.0155 },
        sampler: Sampler { steps: sampler.max(1), eta: 1.0, seed: 42 },
        mean: [-0.0107, -0.0063, -0.0087],
        std: [0.0687, 0.0428, 0.0576],
        range_m: [-0.0188, 0.0264],
        unit_m: [-0.0063, 0.0180],
        placement: Placement::identity(2, SIDE),
    })
}

/// An array of `<f4` numbers: how many rows, and all values.
fn npy(path: &Path) -> Outcome<(usize, Vec<f32>)> {
    let bytes = std::fs::read(path)?;
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..10 + length])?;
    if !(header.contains("'<f4'") && header.contains("False")) {
        return Err(format!("{}: not a C-ordered array of <f4", path.display()).into());
    }
    let shape = header.split("'shape': (").nth(1).and_then(|rest| rest.split(',').next()).ok_or("no shape")?;
    let values = bytes[10 + length..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    Ok((shape.trim().parse()?, values.collect()))
}

fn pairs(folder: &Path) -> Outcome<Vec<Pair>> {
    let (count, pictures) = npy(&folder.join("pictures.npy"))?;
    let (imprints, pads) = (npy(&folder.join("imprints.npy"))?.1, npy(&folder.join("pads.npy"))?.1);
    let part = |values: &[f32], i: usize| values[i * values.len() / count..(i + 1) * values.len() / count].to_vec();
    let pair = |i: usize| Pair {
        picture: part(&pictures, i),
        imprint: part(&imprints, i),
        frame: (pads[i] >= 0.0).then_some(pads[i] as usize),
        weight: 1.0,
    };
    Ok((0..count).map(pair).collect())
}

/// PSNR of two images in 0..1.
fn psnr(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = a.zip(b).map(|(a, b)| (a - b).powi(2)).collect();
    -10.0 * (squares.iter().sum::<f64>() / squares.len() as f64).log10()
}

/// mm, ls and raw.
fn scores(predicted: &[f32], measured: &[f32]) -> Score {
    let wide = |values: &[f32]| values.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    let (p, m) = (wide(predicted), wide(measured));
    let stretched = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        values.iter().map(|v| (v - low) / (high - low)).collect::<Vec<_>>()
    };
    let mm = psnr(stretched(&p).into_iter(), stretched(&m).into_iter());
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (of_p, of_m) = (mean(&p), mean(&m));
    let both: f64 = p.iter().zip(&m).map(|(p, m)| (p - of_p) * (m - of_m)).sum();
    let factor = both / p.iter().map(|p| (p - of_p).powi(2)).sum::<f64>();
    let ls = psnr(p.iter().map(|p| of_m + factor * (p - of_p)), m.iter().copied());
    [mm, ls, psnr(p.iter().copied(), m.iter().copied())]
}

fn score(tuner: &Tuner, pairs: &[Pair]) -> Outcome<Score> {
    let queries: Vec<_> = pairs.iter().map(|pair| (pair.picture.as_slice(), pair.frame)).collect();
    let predicted = tuner.predict(&queries)?;
    let all = pairs.iter().zip(&predicted).map(|(pair, predicted)| scores(predicted, &pair.imprint));
    let sum = all.fold([0.0; 3], |sum, score| std::array::from_fn(|i| sum[i] + score[i]));
    Ok(sum.map(|sum| sum / pairs.len() as f64))
}

/// Largest memory of this process so far, MB; 0 where the system does not tell.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    line.split_whitespace().next().and_then(|kb| kb.parse::<u64>().ok()).unwrap_or_default() / 1024
}

/// Processor time of this process so far, seconds; 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name in brackets may hold blanks; behind it user and system time are the 12th and 13th field, in 1/100 s.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    fields.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// What is asked for on the command line.
struct Options {
    config: Config,
    folds: usize,
    only: Option<usize>,
    sampler: usize,
    closed: bool,
    real: Vec<Pair>,
    sim: Vec<Pair>,
    simtest: Vec<Pair>,
}

fn asked() -> Outcome<Options> {
    let mut words = std::env::args().skip(1);
    let folder = words.next().ok_or("say which folder the pairs are in")?;
    let named: BTreeMap<String, String> = words
        .filter_map(|word| word.split_once('=').map(|(name, value)| (name.to_owned(), value.to_owned())))
        .collect();
    let number = |name: &str, default: f64| named.get(name).map_or(Ok(default), |value| value.parse::<f64>());
    let other = |name: &str| named.get(name).map_or(Ok(Vec::new()), |folder| pairs(Path::new(folder)));
    let plain = Config::default();
    let config = Config {
        steps: number("steps", plain.steps as f64)? as usize,
        batch: number("batch", plain.batch as f64)? as usize,
        seed: number("seed", plain.seed as f64)? as u64,
        trained: if named.get("trained").is_some_and(|v| v == "encoder") { Trained::Encoder } else { Trained::All },
        network_rate: number("rate", f64::from(plain.network_rate))? as f32,
        anchor: number("anchor", f64::from(plain.anchor))? as f32,
        decay: number("decay", f64::from(plain.decay))? as f32,
        simulated: number("simulated", plain.simulated)?,
        augment: if named.get("augment").is_some_and(|v| v == "none") { Augment::none() } else { plain.augment },
        threads: named.get("threads").map(|value| value.parse()).transpose()?,
        ..Config::default()
    };
    Ok(Options {
        config,
        folds: number("folds", 3.0)? as usize,
        only: named.get("only").map(|value| value.parse()).transpose()?,
        sampler: number("sampler", 2.0)? as usize,
        closed: named.get("start").is_none_or(|start| start == "closed"),
        real: pairs(Path::new(&folder))?,
        sim: other("sim")?,
        simtest: other("simtest")?,
    })
}

fn main() -> Outcome<()> {
    let Options { config, folds, only, sampler, closed, real, sim, simtest } = asked()?;
    let mut sums = [[0.0; 3]; 4];
    let run: Vec<usize> = (0..folds.max(1)).filter(|fold| only.is_none_or(|only| only == *fold)).collect();
    for &fold in &run {
        let held = |i: usize| folds > 1 && i % folds == fold;
        let pick =
            |kept: bool| real.iter().enumerate().filter(move |(i, _)| held(*i) != kept).map(|(_, pair)| pair.clone());
        let (train, test): (Vec<Pair>, Vec<Pair>) = (pick(true).collect(), pick(false).collect());
        let mut start = shipped(sampler)?;
        let began = Instant::now();
        if closed {
            start.placement = Placement::closed_form(&start, &train)?;
        }
        println!(
            "fold {fold}: {} to learn, {} held out; start {:.2} s",
            train.len(),
            test.len(),
            began.elapsed().as_secs_f64()
        );
        println!("  line {:?} shift {:?}", start.placement.line, start.placement.shift);
        let with: Vec<Pair> = train.iter().chain(&sim).cloned().collect();
        let mut tuner = Tuner::new(&start, with, config.clone())?;
        let sets = [&train, &test, &simtest];
        let print = |what: &str, tuner: &Tuner| -> Outcome<Vec<Score>> {
            let found = sets.iter().map(|set| if set.is_empty() { Ok([0.0; 3]) } else { score(tuner, set) });
            let found = found.collect::<Outcome<Vec<_>>>()?;
            let text: Vec<String> = found.iter().map(|[mm, ls, raw]| format!("{mm:.2} / {ls:.2} / {raw:.2}")).collect();
            println!("  {what}: mm / ls / raw: learned {}, held out {}, simulated {}", text[0], text[1], text[2]);
            Ok(found)
        };
        let before = print("before", &tuner)?;
        let mut seconds = Vec::new();
        let mut losses = Vec::new();
        let cpu = cpu_seconds();
        while tuner.steps_done() < tuner.steps() {
            let report = tuner.step()?;
            seconds.push(report.seconds);
            losses.push(report.loss);
        }
        let cpu = cpu_seconds() - cpu;
        let total: f64 = seconds.iter().sum();
        seconds.sort_by(f64::total_cmp);
        let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len().max(1) as f32;
        let few = losses.len().min(5);
        println!(
            "  {} steps in {total:.1} s ({cpu:.1} s of processor time), median {:.0} ms, fastest {:.0} ms; loss {:.4} to {:.4}; peak {} MB",
            losses.len(),
            1e3 * seconds[seconds.len() / 2],
            1e3 * seconds[0],
            mean(&losses[..few]),
            mean(&losses[losses.len() - few..]),
            peak_mb()
        );
        let after = print("after", &tuner)?;
        for (sum, found) in sums.iter_mut().zip([before[1], after[1], before[2], after[2]]) {
            sum.iter_mut().zip(found).for_each(|(sum, found)| *sum += found / run.len() as f64);
        }
    }
    let text = sums.map(|[mm, ls, raw]| format!("{mm:.2} / {ls:.2} / {raw:.2}"));
    println!("mean of folds: held out {} -> {}, simulated {} -> {}", text[0], text[1], text[2], text[3]);
    Ok(())
}
