//! What an angle hangs on is the same on the screen and by verb.

use touch2touch::app::command::ViewCommand;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch_work::io::npz;
use touch2touch_work::io::pt::Values;

use super::*;

const MEASURED: ImprintSource = ImprintSource::Measured;

#[test]
pub(super) fn what_an_angle_hangs_on_is_the_same_on_the_screen_and_by_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let path = folder.to_str().unwrap();
    let out = home.path().join("influence");
    let verb = ["pose", path, "--influence", out.to_str().unwrap(), "--mask", "threshold", "--threshold-mm", "9"];
    let report = json(&verb, home.path());
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    let choice = MaskChoice { source: MaskSource::Threshold, threshold_m: 0.009, ..MaskChoice::default() };
    studio.send(prefer(move |s| s.mask = MaskSettings { choice, ..MaskSettings::default() }).into());
    assert!(results::influence(&studio.state, MEASURED).ready().is_none(), "nobody looks at it");
    studio.send(ViewCommand::ShowInfluence(true).into());
    let pairs = studio.state.library.open.as_ref().unwrap().source.index().pairs.len();
    let mut shown = 0;
    for pair in 0..pairs {
        studio.send(LibraryCommand::Select(PairId(pair as u32)).into());
        let state = &studio.state;
        let name = state.pair_name();
        let case = report["cases"].as_array().unwrap().iter().find(|case| case["name"] == name).unwrap();
        let found = match results::influence(state, MEASURED) {
            Lookup::Ready(found) => found,
            // Where the membranes alone decide, both say so.
            Lookup::Failed(said) => {
                let why = case["no_influence"].as_str().unwrap_or_default();
                assert!(why.contains(&said.why), "{name}: {why}: {}", said.why);
                continue;
            }
            _ => panic!("{name}: {:?}", state.tasks.failed),
        };
        shown += 1;
        let arrays = npz::read(Path::new(case["influence"]["file"].as_str().unwrap())).unwrap();
        for (finger, values) in found.pixels.entries() {
            let written = &arrays[&state.finger_name(finger).to_lowercase()];
            assert_eq!(written.shape, [values.height(), values.width()]);
            let Values::F32(written) = &written.values else { panic!("{name}: not f32") };
            let shown = values.as_slice().iter().map(|v| (found.deg_per_mm2(*v) as f32).to_bits());
            assert!(shown.eq(written.iter().map(|v| v.to_bits())), "{name} {finger:?}");
            let finite = values.as_slice().iter().filter(|v| v.is_finite()).count();
            assert!(finite > 1000 && finite < values.len(), "{name} {finger:?}: {finite}");
        }
        let places = case["influence"]["places"].as_array().unwrap();
        assert_eq!(places.len(), 10, "{name}");
        for (said, place) in places.iter().zip(&found.places) {
            assert_eq!(said["angle_deg"], number(place.angle_deg), "{name}");
            assert_eq!(said["in_mask"], place.in_mask, "{name}");
        }
    }
    assert!(shown > 0, "no pair has an influence");
    // A registration that has none says so, in both.
    let verb = [
        "pose",
        path,
        "--influence",
        out.to_str().unwrap(),
        "--mask",
        "threshold",
        "--threshold-mm",
        "9",
        "--engine",
        "gicp",
    ];
    let why = json(&verb, home.path())["cases"][0]["no_influence"].as_str().unwrap().to_owned();
    let engine = touch2touch_core::pose::Registration::Gicp.into();
    studio.send(prefer(move |s| s.registration = engine).into());
    let Lookup::Failed(said) = results::influence(&studio.state, MEASURED) else {
        panic!("{:?}", studio.state.tasks.failed)
    };
    assert!(why.contains(&said.why), "{why}: {}", said.why);
    studio.send(ViewCommand::ShowInfluence(false).into());
}
