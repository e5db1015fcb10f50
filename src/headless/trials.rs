//! `touch2touch trials`: what a robot would do with the poses, in a hole of the tool's own outline, and cup on cup.

use std::path::PathBuf;

use clap::Args;

use super::args::{JsonArgs, RegistrationParser, SensorsArgs, at_least_one, keyed};
use super::contact_mask::MaskArgs;
use super::recipe::{MappingArgs, RuntimeArg, common, first_mask_model};
use super::{Output, VerbResult};
use touch2touch_core::diffusion::Sampler;
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_core::rig::Rig;
use touch2touch_core::trials::{After, Compliance, HoleShape, Loop};
use touch2touch_core::units::{fixed, mm};
use touch2touch_work::bundles::{self, BundleInfo, BundleKind};
use touch2touch_work::infer::bundle::{Bundle, Found, find_all};
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::models::Models;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::trials::{Method, MethodTrials, ToolTrials, Trials, TrialsSetup, trials};

/// Arguments of `trials`.
#[derive(Debug, Args)]
pub(super) struct TrialsArgs {
    /// Tools, separated by commas: those of the simulator, `pencil` and `cup` (default: the unseen tools, the pencil, the cup).
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',')]
    tool: Vec<String>,
    /// Trials of each tool.
    #[arg(long, default_value_t = TrialsSetup::default().count, value_parser = at_least_one::<usize>)]
    count: usize,
    /// Seed of the grasps; the noise that a generator starts from is the bundle's own.
    #[arg(long, default_value_t = TrialsSetup::default().seed)]
    seed: u64,
    #[command(flatten)]
    sensors: SensorsArgs,
    /// Room to each side of the upright tool in its hole. Others, 0.5 to 5 mm, are tried with the same poses.
    #[arg(long, value_name = "MM", default_value_t = mm(TrialsSetup::default().hole.clearance_m))]
    clearance_mm: f64,
    /// Depth of the hole.
    #[arg(long, value_name = "MM", default_value_t = mm(TrialsSetup::default().hole.depth_m))]
    depth_mm: f64,
    /// Height of the bevel of 45° at the hole's mouth.
    #[arg(long, value_name = "MM", default_value_t = mm(TrialsSetup::default().hole.chamfer_m))]
    chamfer_mm: f64,
    /// Turn, to either side, by which the gripper gives way.
    #[arg(long, value_name = "DEG", default_value_t = 2.0)]
    compliance_deg: f64,
    /// Shift, to either side, by which the gripper gives way.
    #[arg(long, value_name = "MM", default_value_t = mm(TrialsSetup::default().compliance.shift_m))]
    compliance_mm: f64,
    /// Distance that a stacked cup's center of mass has to keep from the edge of its support.
    #[arg(long, value_name = "MM", default_value_t = mm(TrialsSetup::default().margin_m))]
    margin_mm: f64,
    /// A generator's bundle; repeat for several rows (default: every generator that is found).
    #[arg(long = "bundle")]
    bundles: Vec<PathBuf>,
    /// Leave the generators out.
    #[arg(long, conflicts_with = "bundles")]
    measured_only: bool,
    /// The mask model's bundle (default: the first one found).
    #[arg(long)]
    mask_bundle: Option<PathBuf>,
    #[command(flatten)]
    mask: MaskArgs,
    /// The registration that gives the poses.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = RegistrationChoice::default(), value_parser = RegistrationParser)]
    registration: RegistrationChoice,
    /// Sampling steps (default: each bundle's; a bundle that draws in one step keeps it).
    #[arg(long)]
    steps: Option<u32>,
    /// The way from noise to an image (default: each bundle's).
    #[arg(long, value_parser = keyed::<Sampler>())]
    sampler: Option<Sampler>,
    #[command(flatten)]
    mapping: MappingArgs,
    #[command(flatten)]
    runtime: RuntimeArg,
    /// Neither look for predictions that were made before (by the studio, too), nor keep those made now.
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    json: JsonArgs,
}

pub(super) fn run(args: &TrialsArgs) -> VerbResult {
    let setup = setup(args)?;
    let output = Output::new(args.json.common(), "trying", setup.count * setup.tools.len());
    let models = Models::new(if args.no_cache { None } else { super::cache::store() });
    let found = trials(&setup, &models, &output.job())?;
    args.json.write(&found)?;
    output.finish(&found, || text(&found))?;
    Ok(found.complete)
}

/// The settings that the arguments name.
fn setup(args: &TrialsArgs) -> anyhow::Result<TrialsSetup> {
    let rig = Rig::lab();
    let Found { bundles: found, .. } = find_all(&[]);
    let generators: Vec<BundleInfo> = if args.measured_only {
        Vec::new()
    } else if args.bundles.is_empty() {
        let fits = |bundle: &&Bundle| bundle.ends(&rig).is_some_and(|ends| ends.is_ok());
        found.iter().filter(fits).map(BundleInfo::of).collect()
    } else {
        let open = |folder: &PathBuf| bundles::open("Trials", folder)?.of_kind(BundleKind::Generator, "Trials");
        args.bundles.iter().map(open).collect::<Result<_, _>>()?
    };
    if generators.is_empty() && !args.measured_only {
        anyhow::bail!("no generator bundle was found; name one with --bundle, or leave them out with --measured-only");
    }
    let only = if let [one] = generators.as_slice() { Some((one.name.as_str(), &*one.id)) } else { None };
    let shift = args.mapping.mode(only)?;
    let mask_model = first_mask_model(args.mask_bundle.as_deref(), &found)?;
    let recipe = common(shift, &args.mask, mask_model, args.registration, args.runtime);
    let mut methods = vec![Method::of(&recipe.of(ImprintSource::Measured))];
    for bundle in generators {
        let info = bundle.generator.as_ref();
        let info = info.ok_or_else(|| anyhow::anyhow!("the bundle {} is no generator", bundle.name))?;
        bundle.ends(&rig).transpose()?;
        let config = info.config(args.steps, None, args.sampler);
        let predicted = recipe.of(ImprintSource::Predicted);
        methods.push(Method::of(&Recipe { generator: Some((bundle.into(), config)), ..predicted }));
    }
    methods.push(Method::uncorrected());
    let usual = TrialsSetup::default();
    Ok(TrialsSetup {
        tools: if args.tool.is_empty() { usual.tools } else { args.tool.clone() },
        count: args.count,
        seed: args.seed,
        sensors: args.sensors.sensors(),
        methods,
        hole: HoleShape {
            depth_m: 1e-3 * args.depth_mm,
            clearance_m: 1e-3 * args.clearance_mm,
            chamfer_m: 1e-3 * args.chamfer_mm,
        },
        clearances_m: usual.clearances_m,
        compliance: Compliance { turn_rad: args.compliance_deg.to_radians(), shift_m: 1e-3 * args.compliance_mm },
        margin_m: 1e-3 * args.margin_mm,
    })
}

fn text(found: &Trials) -> String {
    let mut text = String::new();
    for tool in &found.tools {
        text += &table(tool);
    }
    text += "Published, on a real robot\n";
    for published in &found.published {
        text += &format!("  {:<30} {}\n", published.what, published.share);
    }
    for note in &found.notes {
        text += &format!("- {note}\n");
    }
    text + &format!("- {:.0} s in all{}", found.seconds, if found.complete { "" } else { "; stopped early" })
}

fn table(tool: &ToolTrials) -> String {
    let sweep = tool.methods.first().map(|method| method.sweep.as_slice()).unwrap_or_default();
    let clearances: Vec<String> = sweep.iter().map(|s| format!("{:>4}", fixed(mm(s.clearance_m), 1))).collect();
    let heading =
        if sweep.is_empty() { "stacking".to_owned() } else { format!("insertion; room, mm:{}", clearances.concat()) };
    let mut text = format!("{:<32} {:>7} {:>16}  {heading}\n", tool.tool, "mean °", "success");
    for method in &tool.methods {
        text += &row(method);
    }
    text + "\n"
}

fn row(method: &MethodTrials) -> String {
    let hits: Vec<String> = method.sweep.iter().map(|s| format!("{:>4}", s.success.hits)).collect();
    let angle = method.angle.mean_deg.map_or("-".to_owned(), |deg| fixed(deg, 1));
    let indent = if hits.is_empty() { String::new() } else { format!("                    {}", hits.concat()) };
    let mut text = format!("  {:<30} {angle:>7} {:>16}  {indent}", method.method, method.success.to_string());
    text = format!("{}\n", text.trim_end());
    for counts in &method.with_verdict {
        text += &format!("    {}\n", looped(counts));
    }
    text
}

fn looped(counts: &Loop) -> String {
    let Loop { after, regrasps, refusals, per_trial, per_try } = counts;
    let after = match after {
        After::Try => "verdict, then try:    ",
        After::GiveUp => "verdict, then give up:",
    };
    format!("{after} {per_trial} of trials, {per_try} of tries; {regrasps} grasped again, {refusals} refused")
}
