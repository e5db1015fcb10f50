//! `touch2touch compare`: any two imprints of a pair against each other; the numbers behind the studio's Compare pane.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::VerbResult;
use super::args::DatasetArgs;
use super::contact_mask::labels_of;
use super::notes::Notes;
use super::recipe::{ModelArgs, RecipeArgs};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::findings::Finding;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::picture::colored;
use touch2touch_core::rig::Text;
use touch2touch_core::units::{fixed, mm};
use touch2touch_pipeline::compare::depict::{SubjectImprints, depict};
use touch2touch_pipeline::compare::subject::{MadeFrom, Subject};
use touch2touch_pipeline::compare::{Comparison, Depicted, between};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::{images, npz};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::steps::estimate::Touch;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};
use touch2touch_pipeline::steps::tool::load_tool;

/// Half the range of the difference's colors in a written picture, meters.
const DIFFERENCE_M: f32 = 0.004;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a unique part of it.
    #[arg(long)]
    pair: String,
    /// First imprint: `measured`, `prediction`, `mean` (of seeds) or `stored` (a picture of another program's prediction beside the
    /// pair), with what differs from the other options: `prediction:bundle=DIR,seed=7,steps=50,shift=raw`,
    /// `mean:seeds=4`. A shift is `exact`, `unfitted` (without a bundle's fit), `paper` or `raw`.
    #[arg(long, default_value = "prediction")]
    a: Subject,
    /// Second imprint, given in the same way.
    #[arg(long, default_value = "measured")]
    b: Subject,
    /// Folder for the difference A minus B of each finger, in meters (.npy) and as a picture from -4 to 4 mm; created if
    /// missing.
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    recipe: RecipeArgs,
}

/// Figures of one imprint against another.
#[derive(Debug, Serialize)]
struct Figures {
    psnr_db: Option<f64>,
    ssim: Option<f64>,
}

impl From<&Comparison> for Figures {
    fn from(found: &Comparison) -> Self {
        Self { psnr_db: found.psnr_db, ssim: found.ssim }
    }
}

#[derive(Debug, Serialize)]
struct Finger {
    finger: Text,
    /// Against the measurement; `None` of the measurement itself and without one.
    a: Option<Figures>,
    b: Option<Figures>,
    /// A against B.
    a_b: Figures,
}

#[derive(Debug, Serialize)]
struct Poses {
    /// The lab's angles, degrees.
    a_deg: f64,
    b_deg: f64,
    a_error_deg: Option<f64>,
    b_error_deg: Option<f64>,
    /// Difference of the two poses.
    apart_deg: f64,
    apart_m: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    pair: String,
    a: String,
    b: String,
    scale: &'static str,
    fingers: Vec<Finger>,
    /// `None` without camera, tool or contact.
    poses: Option<Poses>,
    /// Oddities of the files, and reasons why there are no poses.
    notes: Vec<Finding>,
}

/// Origin of a subject's imprint by these options.
pub(super) fn made_from(
    subject: &Subject,
    model: &ModelArgs,
    recipe: impl Fn(&ModelArgs) -> anyhow::Result<Recipe>,
) -> anyhow::Result<MadeFrom> {
    subject.made_from(|generator| {
        let own_mapping = subject.change().is_some_and(|change| change.shift.is_some());
        let model = if own_mapping { model.without_mapping() } else { model.clone() };
        recipe(&generator.map_or_else(|| model.clone(), |name| model.with_generator(name)))
    })
}

pub(super) fn run(args: &CompareArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let id = super::find_pair(&dataset, &args.pair)?;
    let entry = &dataset.index.pairs[id.0 as usize];
    let output = args.dataset.output("comparing", 1);
    let sample = dataset.load(id)?;
    let mut notes = Notes::of(&dataset);
    notes.take(&output, &sample.notes);
    let tool = entry.tool.as_ref().map(|name| load_tool(&dataset, name)).transpose()?;
    notes.take(&output, tool.as_ref().map_or(&[], |loaded| &loaded.notes));
    let lacks = TaskError::new("Compare", "no tool is named, so there is no CAD model");
    let labels = labels_of(&Labels::of(&dataset), &entry.name, &output);
    let tool = tool.as_ref().map(|loaded| &loaded.model);
    let touch = Touch { dataset: &dataset, pair: id, sample: &sample, tool: tool.ok_or(&lacks), labels: &labels };
    let models = args.recipe.model.models();
    let recipe = |model: &ModelArgs, imprint| {
        model.posed(imprint, &dataset.rig, &args.recipe.mask, args.recipe.registration.one()?)
    };
    let measuring = recipe(&args.recipe.model, ImprintSource::Measured)?;
    let find = |subject: &Subject| -> anyhow::Result<SubjectImprints> {
        let from = made_from(subject, &args.recipe.model, |model| recipe(model, ImprintSource::Predicted))?;
        Ok(depict(&from, &measuring, touch, &models, &JobCx::unwatched())?)
    };
    let (found, measured) = ([find(&args.a)?, find(&args.b)?], find(&Subject::Measured)?);
    let tile = measured.tile.as_ref();
    let mut fingers = Vec::new();
    for pad in sample.rig.pads() {
        let [a, b, truth] = [&found[0], &found[1], &measured].map(|found| found.of_pad(&sample, pad, tile));
        let (Some(a), Some(b), truth) = (a?, b?, truth?) else { continue };
        let against = |subject: &Subject, of: &Depicted<'_>| -> anyhow::Result<Option<Figures>> {
            match &truth {
                Some(truth) if *subject != Subject::Measured => Ok(Some((&between(of, truth, sample.scale)?).into())),
                _ => Ok(None),
            }
        };
        let apart = between(&a, &b, sample.scale)?;
        let finger = sample.rig.pad_key(pad);
        if let Some(out) = &args.out {
            write(out, &finger, &apart.error)?;
        }
        fingers.push(Finger { finger, a: against(&args.a, &a)?, b: against(&args.b, &b)?, a_b: (&apart).into() });
    }
    if fingers.is_empty() {
        anyhow::bail!("{}: no finger has both {} and {}", entry.name, args.a, args.b);
    }
    let mut poses = None;
    if tool.is_some() {
        let [a, b] = found.map(|found| -> Result<PoseResult, TaskError> {
            let estimate = found.estimate.reach(touch, Stage::Pose, &models, &JobCx::unwatched())?;
            estimate.pose().map_err(Clone::clone).cloned()
        });
        match (a, b) {
            (Ok(a), Ok(b)) => poses = Some(apart(&a, &b)),
            (Err(err), _) | (_, Err(err)) => output.note(&format!("no poses: {err:#}")),
        }
    }
    let report = Report {
        pair: entry.name.clone(),
        a: args.a.to_string(),
        b: args.b.to_string(),
        scale: sample.scale.key(),
        fingers,
        poses,
        notes: notes.into_list(&output),
    };
    output.finish(&report, || text(&report))?;
    Ok(true)
}

fn apart(a: &PoseResult, b: &PoseResult) -> Poses {
    let between = PoseDifference::between(a.grasp_from_object, b.grasp_from_object);
    let error = |pose: &PoseResult| pose.error_rad.map(f64::to_degrees);
    Poses {
        a_deg: a.angle_rad.to_degrees(),
        b_deg: b.angle_rad.to_degrees(),
        a_error_deg: error(a),
        b_error_deg: error(b),
        apart_deg: between.angle_rad.to_degrees(),
        apart_m: between.position_m,
    }
}

/// `a-minus-b-FINGER.npy` and `.png`.
fn write(out: &Path, finger: &str, error: &DepthMap) -> anyhow::Result<()> {
    std::fs::create_dir_all(out)
        .map_err(|err| anyhow::anyhow!("cannot create the output folder: {err}: {}", out.display()))?;
    npz::write_npy(&out.join(format!("a-minus-b-{finger}.npy")), error)?;
    let range = Range::symmetric(DIFFERENCE_M);
    let picture = colored(error, ColorMap::Diverging, range).map(|pixel| pixel.map(f32::from));
    Ok(images::write_rgb8(&out.join(format!("a-minus-b-{finger}.png")), &picture)?)
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "{}\nA  {}\nB  {}\n\n{:<8} {:<6} {:>7} {:>7}\n",
        report.pair, report.a, report.b, "finger", "", "PSNR dB", "SSIM"
    );
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| fixed(v, digits));
    for finger in &report.fingers {
        for (name, figures) in [("A", finger.a.as_ref()), ("B", finger.b.as_ref()), ("A - B", Some(&finger.a_b))] {
            let Some(of) = figures else { continue };
            text += &format!("{:<8} {name:<6} {:>7} {:>7}\n", finger.finger, number(of.psnr_db, 1), number(of.ssim, 3));
        }
    }
    if let Some(poses) = &report.poses {
        let error = |v: Option<f64>| v.map_or(String::new(), |v| format!(" (error {}°)", fixed(v, 1)));
        text += &format!(
            "\nangle A {}°{}, B {}°{}; the poses are {}° and {} mm apart\n",
            fixed(poses.a_deg, 1),
            error(poses.a_error_deg),
            fixed(poses.b_deg, 1),
            error(poses.b_error_deg),
            fixed(poses.apart_deg, 1),
            fixed(mm(poses.apart_m), 2)
        );
    }
    text
}
