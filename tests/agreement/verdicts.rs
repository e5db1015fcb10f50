//! Verdict, spread and the likeliest tool are the same on the screen and by verb.

use touch2touch::app::command::Command;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::workbench::WorkbenchCommand;

use super::*;

const MEASURED: ImprintSource = ImprintSource::Measured;

#[test]
pub(super) fn verdict_and_likeliest_tool_are_the_same_on_the_screen_and_by_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let path = folder.to_str().unwrap();
    let report = json(&["pose", path, "--tool", "any", "--mask", "threshold"], home.path());
    let own = json(&["pose", path, "--mask", "threshold"], home.path());
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    studio.send(ViewCommand::ShowPanes([Pane::Metrics, Pane::Scene].into_iter().collect()).into());
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    studio.send(prefer(move |s| s.mask = MaskSettings { choice, ..MaskSettings::default() }).into());
    let case = |report: &serde_json::Value, name: &str| {
        report["cases"].as_array().unwrap().iter().find(|case| case["name"] == name).unwrap().clone()
    };
    let pairs = studio.state.library.open.as_ref().unwrap().source.dataset.index.pairs.len();
    let mut ranked = 0;
    for pair in 0..pairs {
        studio.send(LibraryCommand::Select(PairId(pair as u32)).into());
        let state = &studio.state;
        let (name, said) = (state.pair_name().to_owned(), case(&own, state.pair_name()));
        let Lookup::Ready(found) = results::pose(state, MEASURED) else {
            assert!(said["verdict"].is_null(), "{name}");
            continue;
        };
        assert_eq!(serde_json::to_value(&found.verdict).unwrap(), said["verdict"], "{name}");
        assert_eq!(number(found.angle_sd_rad().unwrap().to_degrees()), said["angle_sd_deg"], "{name}");
        assert_eq!(serde_json::to_value(found.report.evidence).unwrap(), said["evidence"], "{name}");
        assert!(results::ranking(state, MEASURED).is_none(), "{name}: nobody asked");
        studio.send(Command::Workbench(WorkbenchCommand::TryTools(true)));
        let Some(Lookup::Ready(all)) = results::ranking(&studio.state, MEASURED) else {
            panic!("{name}: {:?}", studio.state.tasks.failed)
        };
        let said = case(&report, &name)["tools"].as_array().unwrap().clone();
        assert_eq!(all.len(), said.len(), "{name}");
        for (shown, said) in all.iter().zip(&said) {
            assert_eq!(
                (said["tool"].as_str().unwrap(), &said["chance"]),
                (&*shown.tool, &number(shown.chance)),
                "{name}"
            );
        }
        ranked += all.len();
    }
    assert!(ranked >= pairs, "{ranked}");
}
