//! Pictures in 3D: the same bytes by the menu of a pane and by the verbs.

use touch2touch::app::command::WorkbenchCommand;
use touch2touch::app::export::StillAsked;
use touch2touch::app::workbench::Layer;
use touch2touch_pipeline::still::space::{Ground, SpacePane, ViewAngles};

use super::*;
use crate::support;

#[test]
pub(super) fn pictures_in_3d_are_the_same_files_in_both() {
    let Some(_device) = support::gpu() else { return };
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let mut studio = Studio::open(Place::Demo, home.path());
    let angles = ViewAngles { yaw_deg: 40.0, pitch_deg: 12.5 };
    let asked =
        StillAsked { pane: SpacePane::Measured, width_px: 320, ground: Ground::Transparent, angles, turntable: None };
    studio.send(ExportCommand::Write(Output::Still(asked), at("studio.png")).into());
    studio.send(WorkbenchCommand::SetLayer(Layer::Distance).into());
    let turned = StillAsked { turntable: Some(2), ..asked };
    studio.send(ExportCommand::Write(Output::Still(turned), at("studio-turn")).into());
    let name = studio.state.pair_name().to_owned();
    let verb = |arguments: &[&str], file: &str| {
        json(&[arguments, &["--out", at(file).to_str().unwrap()]].concat(), home.path())
    };
    let still = ["still", "demo", "--pair", &name, "--width", "320", "--ground", "transparent", "--view", "40,12.5"];
    let said = verb(&still, "verb.png");
    assert_eq!(said["size_px"], serde_json::json!([320, 320]), "{said}");
    verb(&[&still[..], &["--distance", "1", "--turntable", "2"]].concat(), "verb-turn");
    for end in [".png", "-turn/frame_0001.png", "-turn/frame_0002.png"] {
        let [a, b] = ["studio", "verb"].map(|by| std::fs::read(at(&format!("{by}{end}"))).unwrap());
        assert!(a.len() > 5000 && a == b, "{end}: {} and {} bytes", a.len(), b.len());
    }
}
