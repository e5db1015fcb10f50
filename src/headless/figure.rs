//! `touch2touch figure`: pairs side by side, as a picture for a paper.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::args::{DatasetArgs, FingerArg, RegistrationParser, keyed};
use super::compare::made_from;
use super::contact_mask::{MaskArgs, labels_of};
use super::recipe::ModelArgs;
use super::{Common, Output, VerbResult};
use crate::spatial;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::dataset::PairId;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::compare::depict::{Compared, apart};
use touch2touch_pipeline::compare::subject::Subject;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::images::figure::{
    FigureFile, FigureLook, FigureMakers, FigurePane, FigureSetup, FigureTheme, figure, kind, note,
};
use touch2touch_pipeline::images::space::{SpaceInput, SpaceView, pictured};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{ImprintSource, Labels};

/// Arguments of `figure`.
#[derive(Debug, Args)]
pub(super) struct FigureArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pairs, top to bottom: names, or parts of names that no other pair has, with commas between them.
    #[arg(long, value_name = "A,B", value_delimiter = ',', required = true)]
    pairs: Vec<String>,
    /// The columns, left to right, with commas between them; those that begin with `3d:` need a graphics device.
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = parse_pane(), default_value = "gelslim,measured,predicted,error")]
    panes: Vec<FigurePane>,
    /// The finger, or `both` for a row of each.
    #[arg(long, default_value = "right")]
    finger: FingerArg,
    /// The file to write: `.png`, or `.svg` with letters and lines that can be edited.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Pixels of a PNG per pixel of an imprint.
    #[arg(long, default_value_t = FigureLook::default().scale)]
    scale: f64,
    /// Dark on white for papers, or light on dark.
    #[arg(long, value_parser = keyed::<FigureTheme>(), default_value = "light")]
    theme: FigureTheme,
    /// The range of the colors of imprints, millimeters, the same for all pictures.
    #[arg(long, value_name = "LO..HI", value_parser = parse_range, default_value = "0..18", allow_hyphen_values = true)]
    range: Range,
    /// Half the range of the colors of errors.
    #[arg(long, value_name = "MM", default_value_t = FigureLook::default().error_m * 1e3)]
    error_range_mm: f32,
    /// Draw imprints in gray.
    #[arg(long)]
    gray: bool,
    /// Leave out what the GelSlim sees of an imprint, the dashed rectangle.
    #[arg(long)]
    no_window: bool,
    /// Of the column `compare`: one of the two, in the words of the verb `compare`.
    #[arg(long, default_value = "prediction")]
    a: Subject,
    /// The other.
    #[arg(long, default_value = "measured")]
    b: Subject,
    /// The registration of poses in 3D.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = Registration::default(), value_parser = RegistrationParser)]
    registration: Registration,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

fn parse_pane() -> impl TypedValueParser<Value = FigurePane> {
    // The parser has compared the key with the list.
    PossibleValuesParser::new(FigurePane::iter().map(FigurePane::key))
        .map(|key| key.parse().unwrap_or(FigurePane::Measured))
}

/// Reads `LO..HI` in millimeters.
fn parse_range(text: &str) -> Result<Range, String> {
    let ends = text.split_once("..").and_then(|(lo, hi)| Some([lo.trim().parse().ok()?, hi.trim().parse().ok()?]));
    match ends {
        Some([lo, hi]) if f32::is_finite(lo) && f32::is_finite(hi) && lo < hi => {
            Ok(Range { lo: lo / 1e3, hi: hi / 1e3 })
        }
        _ => Err("two numbers with dots between them are needed, the lower one first, such as 0..18".to_owned()),
    }
}

#[derive(Serialize)]
struct Report<'a> {
    file: &'a std::path::Path,
    #[serde(flatten)]
    figure: FigureFile,
    note: &'a str,
}

pub(super) fn run(args: &FigureArgs) -> VerbResult {
    kind(&args.out)?;
    let dataset = args.dataset.open()?;
    let pairs: Vec<PairId> =
        args.pairs.iter().map(|name| super::find_pair(&dataset, name)).collect::<anyhow::Result<_>>()?;
    let fingers = args.finger.fingers(&dataset.rig)?;
    let look = FigureLook {
        panes: args.panes.clone(),
        map: if args.gray { ColorMap::Gray } else { ColorMap::Viridis },
        range: args.range,
        error_m: args.error_range_mm / 1e3,
        theme: args.theme,
        window: !args.no_window,
        scale: args.scale,
    };
    let output = Output::new(args.common, "drawing", pairs.len());
    let models = args.model.models();
    let mut setup = FigureSetup {
        pairs,
        fingers,
        shift: touch2touch_core::postprocess::ShiftMode::default(),
        look,
        note: String::new(),
    };
    let predicted = setup.look.panes.iter().any(|pane| pane.is_predicted());
    let imprint = if predicted { ImprintSource::Predicted } else { ImprintSource::Measured };
    let in_space = setup.look.panes.iter().any(|pane| pane.space().is_some());
    let recipe = match in_space {
        true => args.model.posed(imprint, &dataset.rig, &args.mask, args.registration)?,
        false => args.model.recipe(imprint, &dataset.rig)?,
    };
    let drawer = in_space.then(spatial::stills).transpose()?;
    let all_labels = Labels::of(&dataset);
    if let Some((bundle, config)) = &recipe.generator {
        setup.shift = recipe.shift;
        setup.note = note(&bundle.name, config, setup.shift);
    }
    let space = |pair: PairId, sample: &Sample, view: &SpaceView, cx: &JobCx| {
        let labels = labels_of(&all_labels, &dataset.index.pairs[pair.0 as usize].name, &output);
        let input = SpaceInput { dataset: &dataset, pair, recipe: &recipe, labels: &labels, models: &models };
        let by = drawer.as_deref().ok_or_else(|| TaskError::new("Figure", "there is no 3D renderer"))?;
        pictured(input, sample, view, by, cx)
    };
    let of_subject =
        |subject| made_from(subject, &args.model, |model| model.recipe(ImprintSource::Predicted, &dataset.rig));
    let compared = match setup.look.panes.contains(&FigurePane::Compare) {
        true => {
            let from = [of_subject(&args.a)?, of_subject(&args.b)?];
            Some(Compared { subjects: [args.a.clone(), args.b.clone()], from, recipe: recipe.clone() })
        }
        false => None,
    };
    if let Some(compared) = &compared {
        setup.note = compared.note(&setup.note);
    }
    let makers = FigureMakers {
        predict: |_, sample: &Arc<Sample>, cx: &JobCx| recipe.generating()?.pair(&models, sample, cx),
        space,
        apart: |pair, sample: &Arc<Sample>, cx: &JobCx| match &compared {
            Some(compared) => apart(compared, (&dataset, pair), sample, &models, cx),
            None => Ok(PerPad::default()),
        },
    };
    let drawn = figure(&dataset, &setup, makers, &output.job())?;
    let report = Report { file: &args.out, figure: drawn.write(&args.out)?, note: &setup.note };
    output.finish(&report, || {
        let [width, height] = report.figure.size_px;
        format!("wrote {} ({} rows, {width} x {height} pixels)", args.out.display(), report.figure.rows.len())
    })?;
    Ok(true)
}
