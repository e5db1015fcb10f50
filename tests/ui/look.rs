//! Nothing to see is an error, and pictures for people.

use strum::IntoEnumIterator as _;
use touch2touch::app::command::{Command, LabelsCommand, LibraryCommand, PredictCommand, ViewCommand};
use touch2touch::app::inspect::InspectCommand;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskSource, MaskTool, ProposalSource, Theme, Workspace};
use touch2touch::app::workbench::{Layer, SceneTool, WorkbenchCommand};
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::label::Paint;
use touch2touch_core::manual::PoseAxis;
use touch2touch_core::rig::lab;

use super::rig::Rig;

/// A start so far off that the run from it ends elsewhere.
const STRAY: PlanarPose = PlanarPose { theta_rad: -0.7, y_m: 0.008, z_m: 0.0 };

/// Every workspace draws something in both themes and sizes.
#[test]
fn every_workspace_draws_in_both_themes() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    rig.send(PredictCommand::Generate);
    for theme in [Theme::Dark, Theme::Light] {
        rig.send(prefer(move |s| s.theme = theme));
        for workspace in Workspace::iter() {
            rig.send(prefer(move |s| s.workspace = workspace));
            rig.shoot(&format!("test-{}-{theme:?}", workspace.name()).to_lowercase());
            let image = rig.harness.render().unwrap();
            let mut colors: Vec<[u8; 4]> = image.pixels().map(|p| p.0).collect();
            colors.sort_unstable();
            colors.dedup();
            assert!(colors.len() > 500, "{workspace:?} {theme:?}: {} colors", colors.len());
        }
    }
}

/// Pictures for the README and for looking at: only where a folder for them is given. With the shipped models.
///
/// `TOUCH2TOUCH_SCREENSHOTS` is the folder, `TOUCH2TOUCH_REAL_PAIRS` a folder of image pairs to show as well.
#[test]
#[ignore = "pictures for looking at, into the folder TOUCH2TOUCH_SCREENSHOTS"]
fn pictures_for_the_docs() {
    for (size, name) in [([1280.0, 800.0], "1280"), ([1920.0, 1080.0], "1920")] {
        let Some(mut rig) = Rig::live(size, Place::Demo) else { return };
        rig.shoot(&format!("{name}-first-start"));
        rig.send(LibraryCommand::Select(PairId(30)));
        rig.send(PredictCommand::Generate);
        rig.shoot(&format!("{name}-demo-inspect"));
        rig.send(prefer(|s| s.workspace = Workspace::Align));
        rig.send(Command::Inspect(InspectCommand::By(i64::MIN)));
        rig.send(Command::Inspect(InspectCommand::By(4)));
        rig.shoot(&format!("{name}-demo-align"));
        rig.send(Command::Inspect(InspectCommand::Start(Some(STRAY))));
        rig.shoot(&format!("{name}-demo-align-start"));
        rig.send(Command::Inspect(InspectCommand::Start(None)));
        for layer in [Layer::Residuals, Layer::Reasons] {
            rig.send(Command::Workbench(WorkbenchCommand::SetLayer(layer)));
            rig.shoot(&format!("{name}-demo-align-{}", layer.name()).to_lowercase());
        }
        rig.send(Command::Workbench(WorkbenchCommand::SetLayer(Layer::None)));
        rig.send(Command::Workbench(WorkbenchCommand::SetBothClouds(true)));
        rig.shoot(&format!("{name}-demo-align-both"));
        rig.send(Command::Workbench(WorkbenchCommand::SetBothClouds(false)));
        rig.send(Command::Workbench(WorkbenchCommand::SetTool(SceneTool::Pose)));
        rig.send(Command::Workbench(WorkbenchCommand::Nudge(PoseAxis::Y, 0.002)));
        rig.send(Command::Workbench(WorkbenchCommand::Nudge(PoseAxis::Theta, 0.1)));
        rig.shoot(&format!("{name}-demo-align-hand"));
        rig.send(Command::Workbench(WorkbenchCommand::SetTool(SceneTool::Look)));
        rig.send(prefer(|s| s.workspace = Workspace::Label));
        rig.shoot(&format!("{name}-demo-label"));
        rig.send(prefer(|s| s.mask.choice.source = MaskSource::Unet));
        rig.shoot(&format!("{name}-demo-label-unet"));
        rig.send(prefer(|s| s.mask.choice.source = MaskSource::Cad));
        rig.shoot(&format!("{name}-demo-label-cad"));
        rig.send(prefer(|s| s.mask.choice.source = MaskSource::Threshold));
        rig.send(prefer(|s| s.mask.tool = MaskTool::Rectangle));
        for (paint, from, to) in
            [(Paint::Ignore, [8.0, 8.0], [40.0, 30.0]), (Paint::Contact, [90.0, 60.0], [100.0, 90.0])]
        {
            rig.send(prefer(move |s| s.mask.paint = paint));
            let source = ImprintSource::Measured;
            rig.send(LabelsCommand::BeginStroke { finger: lab::RIGHT, source, at_px: from, erase: false });
            rig.send(LabelsCommand::StrokeTo(to));
            rig.send(LabelsCommand::EndStroke);
        }
        let mut mask = rig.state().settings.mask.clone();
        mask.proposal = ProposalSource::CadTruth;
        rig.send(prefer(move |s| s.mask = mask.clone()));
        rig.send(ViewCommand::Propose(true));
        rig.shoot(&format!("{name}-demo-label-propose"));
        rig.send(ViewCommand::Propose(false));
        rig.send(LabelsCommand::ResetMask);
        rig.send(prefer(|s| s.workspace = Workspace::Evaluate));
        for _ in 0..5 {
            rig.send(LibraryCommand::Step(7));
            rig.send(PredictCommand::Generate);
        }
        rig.shoot(&format!("{name}-demo-evaluate"));
        rig.send(prefer(|s| s.workspace = Workspace::Adapt));
        rig.shoot(&format!("{name}-demo-adapt"));
        rig.send(prefer(|s| s.theme = Theme::Light));
        rig.send(prefer(|s| s.workspace = Workspace::Inspect));
        rig.shoot(&format!("{name}-demo-light"));
        rig.send(prefer(|s| s.theme = Theme::Dark));
        if let Some(pairs) = std::env::var_os("TOUCH2TOUCH_REAL_PAIRS") {
            rig.send(LibraryCommand::Open(Place::Path(pairs.into())));
            rig.send(LibraryCommand::Select(PairId(7)));
            rig.send(PredictCommand::Generate);
            rig.shoot(&format!("{name}-pairs-inspect"));
        }
    }
}
