//! Sensors are data: the reverse direction, from Soft Bubble to GelSlim, and a gripper that this program never saw.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value, json as value};
use touch2touch::app::command::{Command, Pane, PredictCommand, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::Services;
use touch2touch::app::settings::Settings;
use touch2touch::app::state::{Absent, Lookup, State};
use touch2touch::app::tasks::Level;
use touch2touch::app::{recipe, results};
use touch2touch_core::grid::{Grid, RgbGrid};
use touch2touch_core::rig::{PadId, Rig, SensorKind, lab};
use touch2touch_pipeline::infer::bundle::{Bundle, Ends};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::infer::generator::Generator;
use touch2touch_pipeline::io::dataset::{Dataset, RIG_JSON};
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::steps::bundles::BundleKind;

use crate::support::{error_text, json, run, simulate, tiny};

/// The studio on a place, with the bundles of a folder beside the shipped ones; waits until `done`.
fn studio(place: Place, named: &str, home: &Path, mut done: impl FnMut(&State) -> bool) -> State {
    let services = Services::with_config_folder(Some(home.to_owned()));
    let mut settings = Settings { bundle_folders: vec![tiny("")], ..Settings::default() };
    settings.generate.bundle = Some(named.to_owned());
    settings.generate.by_itself = false;
    settings.about_own_data = false;
    services.save_settings(&settings).unwrap();
    let mut runtime = Runtime::threads(Arc::new(services), Arc::new(|| {}));
    let mut state = State::default();
    runtime.start(&mut state, Some(place));
    let panes = [Pane::Predicted, Pane::Measured, Pane::GelSlim, Pane::Compare, Pane::Metrics];
    runtime.tick(&mut state, vec![Command::View(ViewCommand::ShowPanes(panes.into_iter().collect()))]);
    let begin = std::time::Instant::now();
    let mut asked = false;
    while !done(&state) {
        assert!(begin.elapsed().as_secs() < 120, "{:?}", state.log.entries);
        let ready = !asked && results::sample(&state).ready().is_some() && !state.library.bundles.is_empty();
        asked |= ready;
        runtime.tick(&mut state, if ready { vec![Command::Predict(PredictCommand::Generate)] } else { Vec::new() });
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    state
}

#[test]
fn the_reverse_direction_goes_through_every_verb() {
    let dir = tempfile::tempdir().unwrap();
    let (home, set, out) = (dir.path().join("home"), dir.path().join("set"), dir.path().join("out"));
    let reverse = tiny("bubble_to_gelslim");
    simulate(&set, "pattern_36", &["--grasps", "1", "--seed", "3"]);
    let [set, out, reverse] = [&set, &out, &reverse].map(|p| p.to_str().unwrap());
    assert!(run(&["bundle", "check", reverse], &home).status.success());

    let generate = ["generate", set, "--out", out, "--finger", "both", "--runtime", "rten", "--json"];
    let found = json(&run(&[&generate[..], &["--bundle", reverse]].concat(), &home));
    let pairs = found["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 2, "both fingers");
    for pair in pairs {
        assert!(pair["psnr_db"].as_f64().unwrap() > 0.0 && pair["ssim"].is_number(), "{pair}");
    }
    assert!(found["convention"].as_str().unwrap().contains("left out"), "{}", found["convention"]);
    let pictures: Vec<PathBuf> = std::fs::read_dir(out).unwrap().map(|f| f.unwrap().path()).collect();
    let picture = pictures.iter().find(|f| f.to_string_lossy().ends_with("_left.png")).unwrap();
    assert_eq!(images::read_rgb(picture).unwrap().size(), lab::GELSLIM.size());

    // What needs depth says so.
    let pose = run(&["pose", set, "--imprint", "predicted", "--bundle", reverse, "--runtime", "rten"], &home);
    assert!(!pose.status.success() && error_text(&pose).contains("predicts a color picture"), "{}", error_text(&pose));
    let args = ["evaluate", set, "--bundle", reverse, "--resamples", "0", "--runtime", "rten", "--json"];
    let table = json(&run(&[&args[..], &["--mask", "truth"]].concat(), &home));
    let row = &table["rows"][1]["groups"][0];
    assert!(row["psnr_db"]["value"].as_f64().unwrap() > 0.0 && row["ssim"]["value"].is_number(), "{row}");
    assert!(row["angle_deg"].is_null() && row["frechet"].is_null(), "{row}");
    let notes = table["notes"].to_string();
    assert!(notes.contains("no angle or Fréchet distance, which need depth"), "{notes}");
    assert!(table["rows"][0]["groups"][0]["angle_deg"].is_object(), "the measured imprints have depth");
}

#[test]
fn the_studio_shows_a_predicted_color_picture() {
    let home = tempfile::tempdir().unwrap();
    let name = "Tiny generator from Soft Bubble to GelSlim";
    let shown =
        |state: &State| results::predicted_color(state, lab::RIGHT).is_some_and(|lookup| lookup.ready().is_some());
    let state = studio(Place::Demo, name, home.path(), shown);
    let picture = results::predicted_color(&state, lab::RIGHT).unwrap().ready().unwrap();
    assert_eq!(picture.size(), lab::GELSLIM.size());
    // The same as the generator itself makes of the imprint.
    let mut generator =
        Generator::open(&Bundle::open(&tiny("bubble_to_gelslim")).unwrap(), EngineChoice::Auto).unwrap();
    let condition = results::touch(&state, lab::RIGHT).ready().unwrap().picture(lab::BUBBLE_ID).unwrap();
    let config = results::chosen(&state, lab::RIGHT).unwrap().config;
    let raw = generator.generate(&condition, &config, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
    assert_eq!(generator.spec().color_chain().unwrap().run(&raw).as_ref(), Ok(picture));
    for absent in [
        results::imprint(&state, ImprintSource::Predicted, lab::RIGHT).without::<()>(),
        results::comparison(&state, lab::RIGHT).without(),
        results::flags(&state, lab::RIGHT).without(),
    ] {
        assert!(matches!(absent, Lookup::Absent(Absent::PredictsColor)), "{absent:?}");
    }
    assert_eq!(state.log.entries.iter().filter(|e| e.level == Level::Error).count(), 0, "{:?}", state.log.entries);
}

/// A gripper of one finger with one DIGIT, and a touch taken with it.
fn digit_folder(dir: &Path) -> Rig {
    let rig = value!({
        "name": "One DIGIT",
        "sensors": [{ "key": "digit", "name": "DIGIT", "kind": "color", "width": 240, "height": 320, "px_per_m": 16_000.0 }],
        "pads": [{ "key": "thumb", "name": "Thumb" }],
    });
    std::fs::write(dir.join(RIG_JSON), rig.to_string()).unwrap();
    let picture = |touched: bool| {
        RgbGrid::from_fn(240, 320, |x, y| {
            let bar = if touched && (100..140).contains(&x) { 60.0 } else { 0.0 };
            [90.0 + bar, 100.0 + (y % 20) as f32, 120.0 - bar]
        })
    };
    images::write_rgb8(&dir.join("reference.png"), &picture(false)).unwrap();
    images::write_rgb8(&dir.join("a_touch.png"), &picture(true)).unwrap();
    Rig::parse(rig.to_string().as_bytes()).unwrap()
}

#[test]
fn a_gripper_of_one_digit_is_opened_and_predicted_for() {
    let dir = tempfile::tempdir().unwrap();
    let (home, set, out) = (dir.path().join("home"), dir.path().join("set"), dir.path().join("out"));
    std::fs::create_dir(&set).unwrap();
    let rig = digit_folder(&set);
    let dataset = Dataset::open(&set).unwrap();
    assert_eq!((&*dataset.rig, dataset.problems.len()), (&rig, 0), "{:?}", dataset.problems);
    let sample = dataset.load(touch2touch_core::dataset::PairId(0)).unwrap();
    let thumb = PadId::default();
    assert_eq!(sample.pads.entries().map(|(pad, _)| pad).collect::<Vec<_>>(), [thumb]);
    let touch = sample.pad(thumb).unwrap();
    assert_eq!(touch.color().unwrap().difference[(120, 7)], [60.0, 0.0, -60.0]);
    assert!(touch.depth().is_none() && rig.first(SensorKind::Depth).is_none());
    let digit = Bundle::open(&tiny("digit_to_bubble")).unwrap();
    assert_eq!(digit.ends(&rig).unwrap(), Ok(Ends { input: rig.sensor_of_key("digit").unwrap(), output: None }));

    let [set, out, digit] = [&set, &out, &tiny("digit_to_bubble")].map(|p| p.to_str().unwrap().to_owned());
    let generate = ["generate", &set, "--out", &out, "--runtime", "rten", "--json", "--bundle"];
    let found = json(&run(&[&generate[..], &[&digit]].concat(), &home));
    assert_eq!(found["pairs"][0]["finger"], "thumb");
    let depth: Grid<f32> = images::read_gray(&Path::new(&out).join("a_thumb.png")).unwrap();
    assert_eq!(depth.size(), [175, 140]);
    // What follows a folder knows its sensors too.
    let watch = ["watch", &set, "--once", "--runtime", "rten", "--mask", "threshold", "--json", "--out", &out];
    let watched = run(&[&watch[..], &["--bundle", &digit]].concat(), &home);
    let said = String::from_utf8_lossy(&watched.stdout);
    let done = said.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let done = done.filter(|event| event["event"] == "done").collect::<Vec<_>>();
    assert_eq!((done.len(), &done[0]["fingers"][0]["finger"]), (1, &value!("thumb")), "{said}{}", error_text(&watched));
    // A bundle for other sensors says so, and what would fit; without a name the fitting one is looked for.
    let lab = tiny("generator");
    let refused = run(&[&generate[..], &[lab.to_str().unwrap()]].concat(), &home);
    for part in ["from gelslim (color, 427 x 320)", "sensors of this data are digit (color, 240 x 320)", "names digit"]
    {
        assert!(error_text(&refused).contains(part), "{part}: {}", error_text(&refused));
    }
    // The studio takes the one bundle that fits, though another is named, and shows the prediction.
    let name = "Tiny generator of the tests";
    let shown = |state: &State| results::imprint(state, ImprintSource::Predicted, thumb).ready().is_some();
    let state = studio(Place::Path(PathBuf::from(&set)), name, &home, shown);
    assert_eq!(recipe::bundle(&state, BundleKind::Generator).unwrap().name, "Tiny generator from DIGIT to Soft Bubble");
    let misfits = state.library.bundles.iter().filter(|b| b.kind == BundleKind::Generator && !b.fits(&state.rig()));
    assert!(misfits.count() >= 2, "those of the lab's sensors");
    assert_eq!((state.finger_name(thumb).as_ref(), state.fingers()), ("thumb", vec![thumb]));
    assert_eq!(results::imprint(&state, ImprintSource::Predicted, thumb).ready().unwrap().size(), [175, 140]);
}
