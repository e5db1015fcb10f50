//! An STL in millimeters: it is said, one click accepts it, and nothing has to be opened anew.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, LibraryCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch::app::state::Lookup;
use touch2touch::app::tasks::Level;
use touch2touch_pipeline::io::dataset::ToolUnit;
use touch2touch_pipeline::io::stl;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];
const MEASURED: ImprintSource = ImprintSource::Measured;

#[test]
fn a_click_reads_the_model_in_the_unit_that_fits() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    let folder = rig.data.join("tools_stls");
    for entry in std::fs::read_dir(&folder).unwrap() {
        let file = entry.unwrap().path();
        let mut mesh = stl::read(&file).unwrap().mesh;
        mesh.vertices.iter_mut().for_each(|v| *v *= 1e3);
        stl::write(&file, &mesh).unwrap();
    }
    rig.restart(SIZE);
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    let posed = |rig: &Rig| results::pose(rig.state(), MEASURED).ready().is_some();
    assert!(!posed(&rig));
    let tool = results::tool_name(rig.state()).unwrap().to_owned();
    // One offer for both sides.
    assert_eq!(rig.harness.query_all_by_label_contains("as millimeters, ").count(), 1);
    let unit = folder.join("unit.txt");
    assert!(!unit.exists());
    rig.click(&format!("Read {tool} as millimeters, measured"));
    assert_eq!(std::fs::read_to_string(&unit).unwrap(), "mm\n");
    assert!(posed(&rig), "{:?}", results::pose(rig.state(), MEASURED));
    assert!(rig.harness.query_all_by_label_contains("as millimeters").next().is_none());

    // Somebody else wrote another unit meanwhile: it is not lost unsaid.
    std::fs::write(&unit, "in").unwrap();
    let (unit_now, replacing) = (ToolUnit::Millimeters, Some("mm".to_owned()));
    rig.send(Command::Library(LibraryCommand::ReadToolAs { tool, unit: unit_now, replacing }));
    assert_eq!(std::fs::read_to_string(&unit).unwrap(), "in");
    let log = &rig.state().log;
    assert!(
        log.entries.iter().any(|entry| entry.level == Level::Error && entry.detail.as_ref().unwrap().contains("in"))
    );
    // What is read anew says so, and the offer names what it would replace.
    rig.send(LibraryCommand::Reload);
    let Lookup::Failed(err) = results::pose(rig.state(), MEASURED) else { panic!("it is no tool in inches") };
    assert_eq!(err.units.as_ref().unwrap().says.as_deref(), Some("in"));
}
