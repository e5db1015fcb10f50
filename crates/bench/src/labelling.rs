//! `touch2touch-bench labelling`: what proposed masks are worth on known grasps, what a stroke costs, and what a mask takes
//! a person.

mod actions;

use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::Machine;
use super::figures::quantile;
use super::generator::cases::{Case, simulate};
use touch2touch::headless::JsonArgs;
use touch2touch::headless::ModelArgs;
use touch2touch::headless::{Output, VerbResult};
use touch2touch_core::align::{Ask, Contacts};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{CadPose, DrawTool, Drawing, Ground, Paint, Provenance, agreement, difference};
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_core::rig::{PadId, PerPad, Rig, lab};
use touch2touch_work::cloud::{clouds, contact_points, images};
use touch2touch_work::imprint::{imprints_of, measured};
use touch2touch_work::influence::influence;
use touch2touch_work::job::JobCx;
use touch2touch_work::labels::{DrawnMask, ImprintSource};
use touch2touch_work::mask::{MaskChoice, MaskInputs, MaskSource};
use touch2touch_work::models::{Masking, Models};
use touch2touch_work::on_pad::OnPad;
use touch2touch_work::pose::pose;
use touch2touch_work::propose::{self, Side};
use touch2touch_work::recipe::Recipe;

/// Moves of the pointer in a stroke.
const MOVES: usize = 60;
/// Strokes of each kind.
const STROKES: usize = 20;

/// Arguments of `bench labelling`.
#[derive(Debug, Args)]
pub(super) struct LabellingArgs {
    /// Grasps of the unseen tools, simulated.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    grasps: u32,
    /// Seed of grasps and noise.
    #[arg(long, default_value_t = 1)]
    simulation_seed: u64,
    /// Only what a mask takes a person: no predictions, no strokes.
    #[arg(long)]
    actions: bool,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    json: JsonArgs,
}

/// Figures of what one source proposes on the imprints of one kind.
#[derive(Serialize)]
struct Row {
    imprint: &'static str,
    source: String,
    /// With the true contact, mean over fingers; `None` where nothing could be proposed.
    iou: Option<f64>,
    iou_worst: Option<f64>,
    /// Angle error of the poses registered from the proposed masks, degrees, mean.
    angle_error_deg: Option<f64>,
    /// Angle between those and the poses registered from the true masks of the same imprints, degrees, mean.
    apart_from_true_masks_deg: Option<f64>,
    /// Grasps without a pose.
    no_pose: usize,
    /// To make the mask of one finger, milliseconds, median.
    ms: Option<f64>,
}

/// Cost of a stroke besides the screen.
#[derive(Serialize)]
struct Stroke {
    size: [usize; 2],
    radius_px: f32,
    /// For a move of the pointer: drawing, provenance, and finding what to upload; milliseconds.
    move_median_ms: f64,
    move_worst_ms: f64,
    /// For the end of it: packing for undo, journal and file; milliseconds.
    end_median_ms: f64,
    /// The largest share of the picture that one move uploads.
    largest_upload: f64,
}

/// Work that follows the end of a stroke on the imprints of both fingers until its pose is there, besides the screen.
#[derive(Serialize)]
struct Follow {
    /// Masks that the strokes change: of the true contact, or of all that is deeper than the threshold.
    masks: &'static str,
    size: [usize; 2],
    strokes: usize,
    /// Mask to surface points of both fingers; milliseconds.
    cloud: Spent,
    /// Contact points to the first pose, which is the pose itself where it needs no proof.
    registration: Spent,
    /// Both: a pose and its angle error are there.
    whole: Spent,
    /// Strokes after which the pose needed a proof.
    proofs: usize,
    /// Mask to the pose with its proof, of those.
    proved: Option<Spent>,
    /// Pose to the influence of every pixel, where that is shown.
    influence: Spent,
}

/// Milliseconds of something that was done several times.
#[derive(Serialize)]
struct Spent {
    median_ms: f64,
    worst_ms: f64,
}

impl Spent {
    fn of(ms: &[f64]) -> Self {
        let median_ms = quantile(ms.iter().copied(), 0.5).unwrap_or(f64::NAN);
        Self { median_ms, worst_ms: ms.iter().copied().fold(f64::NAN, f64::max) }
    }
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    grasps: usize,
    simulation_seed: u64,
    rows: Vec<Row>,
    strokes: Vec<Stroke>,
    follows: Vec<Follow>,
    /// The IoU at which a mask is done.
    target: f64,
    /// Work of a person on a mask, by the way to begin.
    actions: Vec<actions::Row>,
}

/// Proposals of one source, by grasp.
struct Proposals {
    source: &'static str,
    ious: Vec<f64>,
    errors: Vec<Option<f64>>,
    apart: Vec<f64>,
    ms: Vec<f64>,
}

pub(super) fn run(args: &LabellingArgs) -> VerbResult {
    let machine = Machine::now();
    let cases = simulate(args.grasps as usize, args.simulation_seed, |seen| !seen)?;
    let imprints = if args.actions {
        &[ImprintSource::Measured][..]
    } else {
        &[ImprintSource::Measured, ImprintSource::Predicted]
    };
    let output = Output::new(args.json.common(), "proposing", cases.len() * imprints.len());
    let (rig, models) = (Rig::lab(), args.model.models());
    let (mut rows, mut persons) = (Vec::new(), Persons::default());
    for &imprint in imprints {
        let recipe = args.model.recipe(imprint, &rig)?;
        let recipe = Recipe { mask_model: args.model.mask_model(MaskSource::Unet, &rig)?, ..recipe };
        let mut sources: Vec<Proposals> = Vec::new();
        for (index, case) in cases.iter().enumerate() {
            output.step(&case.name);
            let imprints = match imprint {
                ImprintSource::Measured => measured(&case.sample),
                ImprintSource::Predicted => {
                    let generated = recipe.generating()?.pair(&models, &case.sample, &JobCx::unwatched())?;
                    imprints_of(&generated, recipe.shift, &case.sample)?
                }
            };
            // What is carried comes from the grasp of the same tool before, else from the next one.
            let same = |from: &&Case| std::sync::Arc::ptr_eq(&from.tool, &case.tool);
            let from = cases[..index].iter().rev().find(same).or_else(|| cases[index + 1..].iter().find(same));
            let truth = true_masks(case)?;
            let true_pose = registered(case, (imprint, &imprints), &truth);
            let proposed = proposals((&recipe, &models), case, from, (imprint, &imprints), &truth)?;
            if imprint == ImprintSource::Measured {
                persons.correct(&proposed, &imprints, &truth, args.simulation_seed);
            }
            for (source, masks, ms) in proposed {
                let place = sources.iter().position(|one| one.source == source).unwrap_or_else(|| {
                    sources.push(Proposals { source, ious: vec![], errors: vec![], apart: vec![], ms: vec![] });
                    sources.len() - 1
                });
                let one = &mut sources[place];
                for pad in lab::PADS {
                    if let (Some(mask), Some(truth)) = (&masks[pad], &truth[pad]) {
                        one.ious.extend(
                            agreement(mask, truth, Rig::lab().depth_px_per_mm()).map(|agreement| agreement.iou),
                        );
                    }
                }
                let pose = registered(case, (imprint, &imprints), &masks);
                one.errors.push(pose.map(|pose| apart_deg(pose, case.truth)));
                one.apart.extend(pose.zip(true_pose).map(|(a, b)| apart_deg(a, b)));
                one.ms.push(ms);
            }
        }
        rows.extend(sources.iter().map(|one| row(imprint, one)));
    }
    let strokes = [([175, 140], 4.0), ([1024, 1024], 4.0), ([1024, 1024], 40.0)];
    let strokes = strokes.into_iter().filter(|_| !args.actions);
    let strokes = strokes.map(|(size, radius_px)| stroke(size, radius_px)).collect();
    let threshold_m = MaskChoice::default().threshold_m;
    let by_threshold = |case: &Case| {
        let mask = |pad| Some(case.sample.pad(pad)?.depth()?.imprint.map(|&depth| depth >= threshold_m));
        Ok(case.sample.rig.pads().map(mask).collect())
    };
    let mut follows = Vec::new();
    if !args.actions {
        follows.extend(follow("true masks", &cases, &true_masks)?);
        follows.extend(follow("threshold", &cases, &by_threshold)?);
    }
    let report = Report {
        machine,
        grasps: cases.len(),
        simulation_seed: args.simulation_seed,
        rows,
        strokes,
        follows,
        target: actions::TARGET,
        actions: persons.rows(),
    };
    args.json.write(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(true)
}

/// A scripted person for each way to begin: what is in force is taken over by a key where it is right, a proposal is shown
/// and accepted by two, and where it was proposed for all pairs at once, by none.
const WAYS: [(&str, Option<&str>, [usize; 2]); 7] = [
    ("nothing", None, [0, 0]),
    ("threshold", Some("threshold"), [0, 1]),
    ("mask model", Some("mask model"), [0, 1]),
    ("CAD at the true pose", Some("CAD at the true pose"), [2, 0]),
    ("CAD at the true pose, for all at once", Some("CAD at the true pose"), [0, 0]),
    ("another grasp's mask, carried", Some("carried from another grasp"), [2, 0]),
    ("another grasp's mask, carried, for all at once", Some("carried from another grasp"), [0, 0]),
];

/// Persons who correct the masks of each of [`WAYS`].
#[derive(Default)]
struct Persons(Vec<actions::Person>);

impl Persons {
    fn correct(&mut self, proposed: &[Proposed], imprints: &PerPad<DepthMap>, truth: &PerPad<Mask>, seed: u64) {
        self.0.extend((self.0.len()..WAYS.len()).map(|_| actions::Person::new(seed)));
        for (person, (_, source, [keys, keys_as_it_is])) in self.0.iter_mut().zip(WAYS) {
            let proposal = proposed.iter().find(|(name, ..)| Some(*name) == source);
            for (pad, imprint) in imprints.entries() {
                let mask = match (source, proposal) {
                    (None, _) => Some(Mask::filled(imprint.width(), imprint.height(), false)),
                    (Some(_), proposal) => proposal.and_then(|(_, masks, _)| masks[pad].clone()),
                };
                if let (Some(mask), Some(truth)) = (mask, &truth[pad]) {
                    let ms = proposal.map_or(0.0, |(_, _, ms)| *ms);
                    person.correct(actions::Begin { mask, keys, keys_as_it_is, ms }, truth, imprint);
                }
            }
        }
    }

    fn rows(&self) -> Vec<actions::Row> {
        self.0.iter().zip(WAYS).filter_map(|(person, (way, ..))| person.row(way)).collect()
    }
}

fn apart_deg(a: PlanarPose, b: PlanarPose) -> f64 {
    touch2touch_core::units::angle_error(a.theta_rad, b.theta_rad).to_degrees()
}

fn true_masks(case: &Case) -> anyhow::Result<PerPad<Mask>> {
    let mut masks = PerPad::default();
    for pad in lab::PADS {
        let truth = case.sample.pad(pad).and_then(|touch| touch.depth()?.truth.as_ref());
        let truth = truth.ok_or_else(|| anyhow::anyhow!("a simulated grasp knows its contact"))?;
        masks[pad] = Some(truth.contact.clone());
    }
    Ok(masks)
}

fn registered(
    case: &Case,
    (of, imprints): (ImprintSource, &PerPad<DepthMap>),
    masks: &PerPad<Mask>,
) -> Option<PlanarPose> {
    let points = contact_points(&case.sample, &imprints.as_ref(), &masks.as_ref()).ok()?;
    let method = RegistrationChoice::default().method();
    let contacts = Contacts { points: &points, images: &images(&case.sample, &imprints.as_ref(), of) };
    pose(contacts, &case.tool, &*method, Ask::default(), None).ok().map(|answer| answer.grasp_from_object)
}

type Proposed = (&'static str, PerPad<Mask>, f64);

/// Masks that each source proposes for a grasp, with the milliseconds that a finger took.
fn proposals(
    (recipe, models): (&Recipe, &Models),
    case: &Case,
    from: Option<&Case>,
    (of, imprints): (ImprintSource, &PerPad<DepthMap>),
    truth: &PerPad<Mask>,
) -> anyhow::Result<Vec<Proposed>> {
    let mut all: Vec<Proposed> = Vec::new();
    let mut each = |name, make: &mut dyn FnMut(PadId, &DepthMap) -> anyhow::Result<Mask>| -> anyhow::Result<_> {
        let begin = Instant::now();
        let mut masks = PerPad::default();
        for (pad, imprint) in imprints.entries() {
            masks[pad] = Some(make(pad, imprint)?);
        }
        let ms = begin.elapsed().as_secs_f64() * 1e3 / lab::PADS.len() as f64;
        all.push((name, masks.clone(), ms));
        Ok(masks)
    };
    let mut by_model = PerPad::default();
    for (name, source) in [
        ("threshold", MaskSource::Threshold),
        ("top percent", MaskSource::TopPercent),
        ("mask model", MaskSource::Unet),
    ] {
        let choice = MaskChoice { source, ..MaskChoice::default() };
        let inputs = MaskInputs { sample: &case.sample, tool: None, labels: None, of: None };
        by_model = each(name, &mut |pad, imprint| {
            let by = Masking { choice, model: recipe.mask_model.as_deref(), engine: recipe.engine };
            Ok(models.contact_mask(by, imprint, pad, inputs)?.mask)
        })?;
    }
    let within_m = MaskChoice::default().cad_distance_m;
    let near_cad = |pose: PlanarPose, cad_pose: CadPose, pad, imprint: &DepthMap| -> anyhow::Result<Mask> {
        let distances =
            propose::cad_distances(imprint, of, OnPad { sample: &case.sample, pad }, &case.tool, pose.into())?;
        Ok(propose::near_cad(&distances, within_m, cad_pose).mask)
    };
    each("CAD at the true pose", &mut |pad, imprint| near_cad(case.truth, CadPose::Truth, pad, imprint))?;
    if let Some(pose) = registered(case, (of, imprints), &by_model) {
        each("CAD at the registered pose", &mut |pad, imprint| {
            near_cad(pose, CadPose::Registered(pose), pad, imprint)
        })?;
    }
    each("other finger's true mask", &mut |pad, imprint| {
        let other = case.sample.rig.other_pad(pad).ok_or_else(|| anyhow::anyhow!("there is no other finger"))?;
        let (Some(there), Some(mask)) = (&imprints[other], &truth[other]) else { anyhow::bail!("there is no other") };
        let from = Side { sample: &case.sample, pad: other, imprint: there };
        Ok(propose::carried_across("other", from, mask, Side { sample: &case.sample, pad, imprint })?.mask)
    })?;
    if let Some(from) = from {
        let masks = true_masks(from)?;
        each("carried from another grasp", &mut |pad, imprint| {
            let mut labels = touch2touch_work::labels::PairLabels::default();
            let hand = masks[pad].clone().map(|mask| DrawnMask::new(mask, Provenance::Truth));
            labels.draw(&touch2touch_work::labels::MaskPlace::measured(pad), hand);
            let to = Side { sample: &case.sample, pad, imprint };
            Ok(propose::carried_from_pair(
                propose::OtherPair { name: "another", sample: &from.sample, labels: &labels },
                to,
            )?
            .mask)
        })?;
    }
    all.push(("true mask", truth.clone(), 0.0));
    Ok(all)
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn row(imprint: ImprintSource, proposals: &Proposals) -> Row {
    let errors: Vec<f64> = proposals.errors.iter().copied().flatten().collect();
    Row {
        imprint: imprint.key(),
        source: proposals.source.into(),
        iou: mean(&proposals.ious),
        iou_worst: proposals.ious.iter().copied().min_by(f64::total_cmp),
        angle_error_deg: mean(&errors),
        apart_from_true_masks_deg: mean(&proposals.apart),
        no_pose: proposals.errors.len() - errors.len(),
        ms: quantile(proposals.ms.iter().copied(), 0.5),
    }
}

/// Strokes across a picture, as the studio draws them move by move.
fn stroke(size: [usize; 2], radius_px: f32) -> Stroke {
    let [width, height] = size;
    let imprint = DepthMap::filled(width, height, 0.005);
    let (mut moves, mut ends, mut largest) = (Vec::new(), Vec::new(), 0.0f64);
    let mut hand = DrawnMask::new(Mask::filled(width, height, false), Provenance::Nothing);
    for stroke in 0..STROKES {
        let point = |i: usize| {
            let t = i as f32 / MOVES as f32;
            let y = height as f32 * ((stroke as f32 + 0.5) / STROKES as f32 + 0.1 * (6.0 * t).sin());
            [width as f32 * t, y]
        };
        let paint = if stroke % 4 == 3 { Paint::Free } else { Paint::Contact };
        let mut drawing = Drawing::begin(DrawTool::Brush { radius_px }, point(0), paint);
        let mut touched = Mask::filled(width, height, false);
        for i in 1..=MOVES {
            let shown = hand.mask.clone();
            let begin = Instant::now();
            let from = drawing.points.len();
            drawing.move_to(point(i));
            hand.draw_on(&drawing, &mut touched, Ground::new(&imprint), from, Provenance::hand("bench"));
            let upload = difference(&shown, &hand.mask);
            moves.push(begin.elapsed().as_secs_f64() * 1e3);
            largest = largest.max(upload.map_or(0.0, |rect| (rect.width * rect.height) as f64 / imprint.len() as f64));
        }
        let begin = Instant::now();
        let bytes = serde_json::to_vec(&hand.pack()).map_or(0, |bytes| bytes.len());
        ends.push(begin.elapsed().as_secs_f64() * 1e3);
        log::debug!("{bytes} bytes");
    }
    Stroke {
        size,
        radius_px,
        move_median_ms: quantile(moves.iter().copied(), 0.5).unwrap_or(f64::NAN),
        move_worst_ms: moves.iter().copied().fold(0.0, f64::max),
        end_median_ms: quantile(ends.iter().copied(), 0.5).unwrap_or(f64::NAN),
        largest_upload: largest,
    }
}

/// Strokes at the edge of masks, each followed by what the studio computes of it.
fn follow(
    name: &'static str,
    cases: &[Case],
    masks_of: &dyn Fn(&Case) -> anyhow::Result<PerPad<Mask>>,
) -> anyhow::Result<Option<Follow>> {
    const STROKES_EACH: usize = 4;
    const RADIUS_PX: f32 = 4.0;
    let method = RegistrationChoice::default().method();
    let (mut lifting, mut registering, mut whole, mut proved, mut hanging) = (vec![], vec![], vec![], vec![], vec![]);
    let mut size = None;
    for case in cases {
        let mut masks = masks_of(case)?;
        let imprint = |pad| Some(&case.sample.pad(pad)?.depth()?.imprint);
        let images = images(&case.sample, &case.sample.rig.pads().map(imprint).collect(), ImprintSource::Measured);
        for stroke in 0..STROKES_EACH {
            let pad = lab::PADS[stroke % lab::PADS.len()];
            let (Some(mask), Some(imprint_of_it)) = (masks.get_mut(pad), imprint(pad)) else { continue };
            size = Some(imprint_of_it.size());
            let mut hand = DrawnMask::new(mask.clone(), Provenance::Nothing);
            let mut touched = mask.map(|_| false);
            let Some(start) = edge(mask, stroke) else { continue };
            let paint = if stroke < STROKES_EACH / 2 { Paint::Contact } else { Paint::Free };
            let drawing = Drawing::begin(DrawTool::Brush { radius_px: RADIUS_PX }, start, paint);
            hand.draw_on(&drawing, &mut touched, Ground::new(imprint_of_it), 0, Provenance::hand("bench"));
            *mask = (*hand.mask).clone();
            let parts = lab::PADS.into_iter().map(|pad| Some((imprint(pad)?, masks[pad].as_ref()))).collect();
            let begin = Instant::now();
            let lifted = clouds(&case.sample, &parts)?;
            let since = |begin: Instant| begin.elapsed().as_secs_f64() * 1e3;
            let cloud_ms = since(begin);
            let points = lifted.contact_points();
            let contacts = Contacts { points: &points, images: &images };
            let register = |ask| pose(contacts, &case.tool, &*method, ask, Some(case.truth));
            let answer = register(Ask { provisional: true, ..Ask::default() });
            let all_ms = since(begin);
            let Ok(mut answer) = answer else { continue };
            if !answer.report.needs_no_proof() {
                answer = register(Ask::default())?;
                proved.push(since(begin));
            }
            lifting.push(cloud_ms);
            registering.push(all_ms - cloud_ms);
            whole.push(all_ms);
            let begin = Instant::now();
            let by = RegistrationChoice::default();
            if influence(&lifted, contacts, &case.sample, &case.tool, by, &answer.report).is_ok() {
                hanging.push(since(begin));
            }
        }
    }
    Ok(size.filter(|_| !whole.is_empty()).map(|size| Follow {
        masks: name,
        size,
        strokes: whole.len(),
        cloud: Spent::of(&lifting),
        registration: Spent::of(&registering),
        whole: Spent::of(&whole),
        proofs: proved.len(),
        proved: (!proved.is_empty()).then(|| Spent::of(&proved)),
        influence: Spent::of(&hanging),
    }))
}

/// A pixel at the edge of a mask, another one for each stroke.
fn edge(mask: &Mask, stroke: usize) -> Option<[f32; 2]> {
    let row = mask.height() * (stroke + 3) / (STROKES + 6) + mask.height() / 3;
    let x = mask.row(row.min(mask.height() - 1)).iter().position(|contact| *contact)?;
    Some([x as f32, row as f32])
}

fn text(report: &Report) -> String {
    let number = |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
    let mut lines = vec![format!(
        "{} simulated grasps of the unseen tools; IoU with the true contact, angles in degrees (mean)",
        report.grasps
    )];
    lines.push(format!(
        "{:10} {:28} {:>6} {:>6} {:>7} {:>16} {:>8} {:>8}",
        "imprint", "source", "IoU", "worst", "error", "from true masks", "no pose", "ms"
    ));
    for row in &report.rows {
        lines.push(format!(
            "{:10} {:28} {:>6} {:>6} {:>7} {:>16} {:>8} {:>8}",
            row.imprint,
            row.source,
            number(row.iou, 3),
            number(row.iou_worst, 3),
            number(row.angle_error_deg, 2),
            number(row.apart_from_true_masks_deg, 2),
            row.no_pose,
            number(row.ms, 1)
        ));
    }
    if !report.strokes.is_empty() {
        lines.push("strokes, without the screen:".into());
    }
    for stroke in &report.strokes {
        lines.push(format!(
            "{:>4} x {:<4} brush of {:>2} px: a move {:.3} ms (worst {:.3}), the end {:.2} ms, uploads at most {:.1} % of the picture",
            stroke.size[0],
            stroke.size[1],
            stroke.radius_px,
            stroke.move_median_ms,
            stroke.move_worst_ms,
            stroke.end_median_ms,
            stroke.largest_upload * 100.0
        ));
    }
    for Follow { masks, size, strokes, cloud, registration, whole, proofs, proved, influence } in &report.follows {
        let ms = |spent: &Spent| format!("{:.2} ms (worst {:.2})", spent.median_ms, spent.worst_ms);
        lines.push(format!(
            "after a stroke ({masks}, {strokes} strokes), {} x {}, both fingers: cloud {}, registration {}, the new pose \
             after {}; {proofs} poses needed a proof{}; influence of all pixels {}",
            size[0],
            size[1],
            ms(cloud),
            ms(registration),
            ms(whole),
            proved.as_ref().map_or(String::new(), |proved| format!(", which was there after {}", ms(proved))),
            ms(influence)
        ));
    }
    lines.push(actions::text(&report.actions));
    lines.join("\n")
}
