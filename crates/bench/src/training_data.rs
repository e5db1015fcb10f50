//! Training data for the networks: a data set or the simulator as shards that the trainer reads.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use crate::shards::{self, GELSLIM_SIDE, Origin, Record, ShardWriter};
use touch2touch_bench::training_mix::{Mix, training_touch};
use touch2touch_core::catalog;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::resample::{bilinear, bilinear_rgb};
use touch2touch_core::rig::{PadId, Rig, lab};
use touch2touch_core::sample::Sample;
use touch2touch_core::sim::Condition;
use touch2touch_pipeline::error::{Remark, TaskError};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::digest::sha256;
use touch2touch_pipeline::io::names;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{Labels, PairLabels, Review};
use touch2touch_pipeline::learn::usable::unusable;
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskInputs, MaskRecipe, contact_mask};
use touch2touch_pipeline::steps::tool::Tools;

mod verb;

pub(crate) use verb::{TrainingDataArgs, run};

const WHAT: &str = "Write training data";
/// Tells the simulator's touches from those of the simulator before: shards of both do not mix.
const SIMULATOR: &str = "measured tools and membrane";
/// Pairs in memory at a time.
const CHUNK: usize = 64;

/// Source of touches.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TouchSource<'a> {
    /// A data set, with what people said about it.
    Dataset(&'a Dataset, &'a Labels, &'a [PairId]),
    /// The simulator.
    Simulator {
        /// Number of grasps.
        grasps: usize,
        /// Mix of tools that they are drawn from.
        mix: Mix,
        /// Condition that the touches are simulated under.
        condition: Condition,
        /// Decides all of it.
        seed: u64,
    },
}

/// Division of the touches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShardSetup {
    /// Pairs in a shard.
    pub pairs_per_shard: usize,
    /// Only every `share[1]`-th shard, from number `share[0]` (counted from 1) on: so many machines share the work.
    pub share: [usize; 2],
}

/// By what the contact is known, in touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct ContactCounts {
    /// Drawn by hand.
    pub hand: usize,
    /// Near the CAD model at the true pose.
    pub cad: usize,
    /// The simulator's truth.
    pub truth: usize,
    /// Not known: the mask UNet does not learn from these.
    pub unknown: usize,
}

/// Counts of what was written.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct WrittenShards {
    /// Shards written now.
    pub written: usize,
    /// Shards that an earlier run had written.
    pub already: usize,
    /// Shards that other machines write.
    pub of_others: usize,
    /// Touches in the shards written now.
    pub touches: usize,
    /// By what their contact is known.
    pub contact: ContactCounts,
    /// Pairs marked *skip*.
    pub skipped: usize,
    /// Pairs that could not be used.
    pub left_out: Vec<Remark>,
}

/// Writes the shards that are not there yet into a folder, which may hold shards of other sources: a mixture.
///
/// # Errors
/// If the job was told to stop, the data are not of the lab's rig, nothing can be used, or a shard of that name holds other data or
/// cannot be written. Shards that are complete stay.
pub(crate) fn write_shards(
    source: TouchSource<'_>,
    setup: ShardSetup,
    out: &Path,
    cx: &JobCx,
) -> Result<WrittenShards, TaskError> {
    let mut done = WrittenShards::default();
    let reader = Reader::open(source, &mut done)?;
    let all = reader.len();
    if all == 0 {
        return Err(TaskError::new(WHAT, "there is no pair to write"));
    }
    let per_shard = setup.pairs_per_shard.max(1);
    let count = all.div_ceil(per_shard);
    let [share, shares] = setup.share;
    for shard in 0..count {
        let range = shard * per_shard..all.min((shard + 1) * per_shard);
        let folder = out.join(format!("{}-{:04}", reader.name(), shard + 1));
        if shard % shares.max(1) + 1 != share.max(1) {
            done.of_others += 1;
            continue;
        }
        let request = reader.request(range.clone());
        if let Some(about) = shards::about(&folder) {
            if about["request"] != json!(request) {
                return Err(TaskError::new(WHAT, format!("{} holds other data", folder.display()))
                    .with_hint("Name another folder, or remove that one to have it written again."));
            }
            done.already += 1;
            continue;
        }
        let fail = |err: std::io::Error| TaskError::new(WHAT, format!("{err} ({})", folder.display()));
        let mut writer = ShardWriter::create(&folder, [lab::BUBBLE.width, lab::BUBBLE.height]).map_err(fail)?;
        let (mut contact, first_left_out) = (ContactCounts::default(), done.left_out.len());
        for at in range.clone().step_by(CHUNK) {
            cx.check(WHAT)?;
            let text = format!("shard {} of {count}: pair {} of {all}", shard + 1, at + 1);
            cx.progress(at as u64, all as u64, text);
            let chunk: Vec<usize> = (at..range.end.min(at + CHUNK)).collect();
            let read: Vec<Result<Vec<ShardTouch>, Remark>> = chunk.into_par_iter().map(|at| reader.read(at)).collect();
            for pair in read {
                match pair {
                    Ok(touches) => touches.into_iter().try_for_each(|touch| {
                        *touch.known.of(&mut contact) += 1;
                        writer.push(&touch.record).map_err(fail)
                    })?,
                    Err(remark) => done.left_out.push(remark),
                }
            }
        }
        let touches = writer.touches();
        if touches == 0 {
            // The trainer cannot read a shard of nothing, and what is mended should be tried again.
            drop(writer);
            continue;
        }
        let left_out = &done.left_out[first_left_out..];
        let mut about = reader.about();
        about["request"] = json!(request);
        about["shard"] = json!([shard + 1, count]);
        about["samples"] = json!(touches);
        about["contact"] = json!(contact);
        about["left_out"] = json!(left_out);
        writer.finish(&about).map_err(fail)?;
        done.written += 1;
        done.touches += touches;
        done.contact = done.contact.and(contact);
    }
    if done.touches == 0 && !done.left_out.is_empty() {
        let why = done.left_out.first().map_or_else(String::new, |first| format!("; {}: {}", first.name, first.why));
        return Err(TaskError::new(WHAT, format!("no pair can be used{why}"))
            .with_hint("Training needs pairs of a GelSlim image and the Soft Bubble's imprint of the same grasp."));
    }
    cx.progress(all as u64, all as u64, "done");
    Ok(done)
}

impl ContactCounts {
    fn and(self, other: Self) -> Self {
        Self {
            hand: self.hand + other.hand,
            cad: self.cad + other.cad,
            truth: self.truth + other.truth,
            unknown: self.unknown + other.unknown,
        }
    }
}

/// By what a contact is known.
#[derive(Clone, Copy)]
enum Known {
    Hand,
    Cad,
    Truth,
    Not,
}

impl Known {
    fn of(self, counts: &mut ContactCounts) -> &mut usize {
        match self {
            Self::Hand => &mut counts.hand,
            Self::Cad => &mut counts.cad,
            Self::Truth => &mut counts.truth,
            Self::Not => &mut counts.unknown,
        }
    }
}

struct ShardTouch {
    record: Record,
    known: Known,
}

/// Source of touches with what is read once for all of them.
struct Reader<'a> {
    source: TouchSource<'a>,
    /// Without those marked *skip*.
    pairs: Vec<PairId>,
    /// The CAD models of the pairs, read.
    tools: Option<Tools<'a>>,
}

impl<'a> Reader<'a> {
    fn open(source: TouchSource<'a>, done: &mut WrittenShards) -> Result<Self, TaskError> {
        let (mut pairs, mut tools) = (Vec::new(), None);
        if let TouchSource::Dataset(dataset, labels, wanted) = source {
            if *dataset.rig != *Rig::lab() {
                return Err(TaskError::new(
                    WHAT,
                    format!("the trainer knows no rig but the lab's, not {}", dataset.rig.name),
                ));
            }
            let reviews = labels.reviews().states;
            let mut models = Tools::new(dataset);
            for &id in wanted {
                let Some(entry) = dataset.index.get(id) else { continue };
                if reviews.get(&entry.name) == Some(&Review::Skip) {
                    done.skipped += 1;
                    continue;
                }
                pairs.push(id);
                if let Some(tool) = &entry.tool {
                    models.get(tool);
                }
            }
            tools = Some(models);
        }
        Ok(Self { source, pairs, tools })
    }

    fn len(&self) -> usize {
        match self.source {
            TouchSource::Dataset(..) => self.pairs.len(),
            TouchSource::Simulator { grasps, .. } => grasps,
        }
    }

    /// Start of the shards' names: shards of several sources lie beside each other.
    fn name(&self) -> String {
        match self.source {
            TouchSource::Dataset(dataset, ..) => names::label(&dataset.title),
            TouchSource::Simulator { mix, condition, seed, .. } => {
                let mix: &str = mix.into();
                format!("simulated-{mix}-{}-{seed}", condition.key())
            }
        }
    }

    fn about(&self) -> Value {
        match self.source {
            TouchSource::Dataset(dataset, ..) => json!({"source": dataset.title}),
            TouchSource::Simulator { grasps, mix, condition, seed } => json!({
                "source": "simulator", "mix": mix, "condition": condition, "grasps": grasps, "seed": seed,
                "windows_px": windows_px(),
            }),
        }
    }

    /// Tells this shard from any other of the same name.
    fn request(&self, range: std::ops::Range<usize>) -> String {
        let text = match self.source {
            TouchSource::Dataset(dataset, ..) => {
                let name = |id: &PairId| dataset.index.get(*id).map(|entry| entry.name.as_str());
                json!([dataset.title, self.pairs[range].iter().map(name).collect::<Vec<_>>()])
            }
            TouchSource::Simulator { mix, condition, seed, .. } => {
                json!([SIMULATOR, mix, condition, seed, [range.start, range.end]])
            }
        };
        sha256(text.to_string().as_bytes())[..16].to_owned()
    }

    fn read(&self, at: usize) -> Result<Vec<ShardTouch>, Remark> {
        match self.source {
            TouchSource::Dataset(dataset, labels, _) => self.measured(dataset, labels, at),
            TouchSource::Simulator { mix, condition, seed, .. } => {
                let drawn = training_touch(seed, at as u64, mix, condition);
                let origin = match (mix, drawn.nominal) {
                    (Mix::Depths, _) => Origin::AnyDepth,
                    (_, true) => Origin::Nominal,
                    (_, false) => Origin::Drawn,
                };
                let touches = drawn.sample.rig.pads().filter_map(|pad| {
                    let truth = drawn.sample.pad(pad)?.depth()?.truth.as_ref()?;
                    let mut touch = touch(&drawn.sample, pad, at, drawn.tool)?;
                    touch.record.clean = truth.imprint.clone();
                    touch.record.contact = Some(truth.contact.clone());
                    touch.record.origin = origin;
                    touch.record.unseen = mix == Mix::Unseen;
                    touch.known = Known::Truth;
                    Some(touch)
                });
                Ok(touches.collect())
            }
        }
    }

    fn measured(&self, dataset: &Dataset, labels: &Labels, at: usize) -> Result<Vec<ShardTouch>, Remark> {
        let entry = dataset.index.get(self.pairs[at]);
        let name = entry.map(|entry| entry.name.clone()).unwrap_or_default();
        let fail = |why: String| Remark { name: name.clone(), why };
        let sample = dataset.load(self.pairs[at]).map_err(|err| fail(format!("{err} ({})", err.hint)))?;
        let labels = labels.load(&name).map_err(|err| fail(err.why))?;
        let tool_name = entry.and_then(|entry| entry.tool.as_deref());
        let number = tool_name.and_then(|name| catalog::tools().iter().position(|tool| tool.name == name));
        let tool = tool_name.and_then(|name| self.tools.as_ref()?.known(name));
        let mut touches = Vec::new();
        for pad in sample.rig.pads() {
            let Some(mut touch) = touch(&sample, pad, at, number) else { continue };
            if let Some(why) = unusable(&touch.record.gelslim, &touch.record.imprint) {
                return Err(fail(why));
            }
            touch.record.unseen = number.is_some_and(|at| !catalog::tools()[at].seen);
            if let Some((mask, known)) = contact(&sample, pad, tool, &labels) {
                (touch.record.contact, touch.known) = (Some(mask), known);
            }
            touches.push(touch);
        }
        if touches.is_empty() {
            return Err(fail("no finger has both a GelSlim image and a measured imprint".into()));
        }
        Ok(touches)
    }
}

/// Centers of the GelSlims' windows in the raw bubble picture, of each finger.
fn windows_px() -> Vec<[f64; 2]> {
    let rig = Rig::lab();
    rig.pads().filter_map(|pad| Some(rig.color_window(pad)?.center_px)).collect()
}

/// A touch without what only the simulator or people know; `None` where a sensor felt nothing.
fn touch(sample: &Sample, pad: PadId, at: usize, tool: Option<usize>) -> Option<ShardTouch> {
    let estimate = sample.pad(pad)?;
    let (picture, depth) = (estimate.picture(lab::GELSLIM_ID)?, estimate.depth()?);
    let size = [lab::BUBBLE.width, lab::BUBBLE.height];
    let imprint =
        if depth.imprint.size() == size { depth.imprint.clone() } else { bilinear(&depth.imprint, size[0], size[1]) };
    let place = sample.grasp_from_object.map(|pose| pose.inverse());
    let record = Record {
        gelslim: bilinear_rgb(&picture, GELSLIM_SIDE, GELSLIM_SIDE),
        clean: without_holes(&imprint),
        imprint,
        contact: None,
        grasp: at as u32,
        // A pair that has one finger is its first pad, whichever it was taken by.
        pad: sample.taken_by.unwrap_or(pad).index(),
        pose: place.map(|place| [place.theta_rad, place.y_m, place.z_m]),
        tool,
        origin: Origin::Measured,
        unseen: false,
    };
    Some(ShardTouch { record, known: Known::Not })
}

/// The contact by hand, else near the CAD model at the true pose.
fn contact(sample: &Sample, pad: PadId, tool: Option<&ToolModel>, labels: &PairLabels) -> Option<(Mask, Known)> {
    let imprint = &sample.pad(pad)?.depth()?.imprint;
    let recipe = MaskRecipe::Cad(MaskChoice::default().cad_distance_m.into());
    let inputs = MaskInputs::measured(sample, tool, Some(labels));
    let found =
        contact_mask(&recipe, imprint, pad, inputs, |_| Err(TaskError::new(WHAT, "no mask model is asked"))).ok()?;
    let known = match found.basis {
        MaskBasis::Hand => Known::Hand,
        MaskBasis::Source => Known::Cad,
        MaskBasis::Depth(_) | MaskBasis::Flat => return None,
    };
    Some((Arc::unwrap_or_clone(found.mask), known))
}

/// Holes are filled from their borders inward with the mean of what is beside them.
fn without_holes(imprint: &DepthMap) -> DepthMap {
    let mut now = imprint.clone();
    let [width, height] = now.size();
    while now.as_slice().iter().any(|v| !v.is_finite()) {
        let next = Grid::from_fn(width, height, |x, y| {
            let own = now[(x, y)];
            if own.is_finite() {
                return own;
            }
            let beside = (y.saturating_sub(1)..height.min(y + 2))
                .flat_map(|y| (x.saturating_sub(1)..width.min(x + 2)).map(move |x| (x, y)))
                .map(|at| now[at])
                .filter(|v| v.is_finite());
            let (sum, count) = beside.fold((0.0f64, 0), |(sum, count), v| (sum + f64::from(v), count + 1));
            if count > 0 { (sum / f64::from(count)) as f32 } else { f32::NAN }
        });
        if next.as_slice().iter().all(|v| !v.is_finite()) {
            return Grid::filled(width, height, 0.0);
        }
        now = next;
    }
    now
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_take_what_is_beside_them() {
        let imprint = Grid::from_fn(7, 5, |x, y| if (2..5).contains(&x) && y < 4 { f32::NAN } else { x as f32 });
        let filled = without_holes(&imprint);
        assert!(filled.as_slice().iter().all(|v| v.is_finite()));
        assert!((filled[(3, 1)] - 3.0).abs() < 0.8 && filled[(1, 0)] == 1.0, "{}", filled[(3, 1)]);
        let nothing = without_holes(&Grid::filled(3, 3, f32::NAN));
        assert!(nothing.as_slice().iter().all(|&v| v == 0.0));
    }
}
