//! Figures of an evaluation are kept on the disk and are, bit for bit, those that would be computed.

use std::path::Path;
use std::sync::{Arc, Mutex};

use strum::IntoEnumIterator as _;
use touch2touch::app::command::{Command, EvaluateCommand, Pane, ViewCommand};
use touch2touch::app::library::Place;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::live::LiveServices;
use touch2touch::app::state::State;
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::Metric;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::lab;
use touch2touch_core::sim;
use touch2touch_pipeline::infer::bundle::Origin;
use touch2touch_pipeline::infer::store::Store;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::simulated::{Layout, write_pair, write_tools};
use touch2touch_pipeline::job::{Cancel, JobCx};
use touch2touch_pipeline::labels::{DrawnMask, Labels, MaskPlace, Operation, PairLabels, Revision};
use touch2touch_pipeline::scores::evaluate::{Evaluation, Report, Setup, evaluate, export, kept, known};
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::recipe::Recipe;

fn write(root: &Path, grasps: std::ops::Range<u64>) {
    let tools = &catalog::tools()[..2];
    let config = sim::SimConfig::default();
    for tool in tools {
        for number in grasps.clone() {
            let sample = sim::simulate(tool, sim::random_grasp(number + 3), number, &config);
            write_pair(root, Layout::Test, &tool.name, number, &sample).unwrap();
        }
    }
    let meshes: Vec<_> = tools.iter().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect();
    write_tools(root, &meshes).unwrap();
}

fn setup() -> Setup {
    let bundle = |name| Origin::from(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles").join(name));
    Setup {
        bundles: vec![bundle("generator")],
        classifier: Some(bundle("classifier")),
        recipe: Recipe {
            mask: MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() },
            ..Recipe::default()
        },
        resamples: 50,
        ..Setup::default()
    }
}

fn models(folder: &Path) -> Models {
    Models::new(Some(Store::new(folder.to_owned(), 64 << 20)))
}

/// An evaluation, and how many grasps were computed for it: the program starts anew each time.
fn run(data: &Path, setup: &Setup, cache: &Path) -> (Evaluation, u64) {
    let first = Arc::new(Mutex::new(None));
    let seen = first.clone();
    let sink = move |progress: touch2touch_pipeline::job::Progress| {
        if progress.total > 0 {
            seen.lock().unwrap().get_or_insert(progress.total - progress.done);
        }
    };
    let cx = JobCx::new(Cancel::default(), Arc::new(sink));
    let found = evaluate(&Dataset::open(data).unwrap(), setup, &models(cache), &cx).unwrap();
    let fresh = first.lock().unwrap().unwrap();
    (found, fresh)
}

/// Everything of an evaluation but the time it took, as text.
fn text(evaluation: &Evaluation) -> String {
    let still = Evaluation { seconds: 0.0, ..evaluation.clone() };
    let report = Report { evaluation: &still, published: Vec::new(), pairs: Some(&still.scores) };
    let features: Vec<_> =
        still.scores.iter().flat_map(|s| &s.grasps).flat_map(|g| g.images.iter().map(|i| &i.features)).collect();
    format!("{} {features:?} {:?}", serde_json::to_string(&report).unwrap(), still.scores[1].measured_features)
}

#[test]
fn a_second_evaluation_computes_nothing_and_says_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (data, cache) = (folder.path().join("data"), folder.path().join("cache"));
    write(&data, 0..3);
    let few = Setup { grasps_per_tool: Some(2), ..setup() };
    let (cold, fresh) = run(&data, &few, &cache);
    assert_eq!((fresh, cold.scores[1].grasps.len(), cold.scores[1].grasps[0].images[0].features.len()), (4, 4, 4));
    let (warm, fresh) = run(&data, &few, &cache);
    assert_eq!(fresh, 0);
    assert_eq!(text(&warm), text(&cold));

    // More grasps: only those are computed, and the lab's SSIM is that of the larger set.
    let (more, fresh) = run(&data, &setup(), &cache);
    let (anew, all) = run(&data, &setup(), &folder.path().join("other"));
    assert_eq!((fresh, all), (2, 6));
    assert_eq!(text(&more), text(&anew));
    // The table of what is there is the same, and that of a part says so.
    let dataset = Dataset::open(&data).unwrap();
    let there = kept(&dataset, &setup(), &models(&cache)).unwrap().unwrap();
    assert_eq!((text(&there), there.scored, there.of, there.complete), (text(&anew), 6, 6, true));
    assert!(there.size().starts_with("All 6 pairs of "), "{}", there.size());
    let part = folder.path().join("part");
    let two = Setup { pairs: Some([PairId(0), PairId(3)].into()), ..setup() };
    assert!(kept(&dataset, &setup(), &models(&part)).unwrap().is_none());
    run(&data, &two, &part);
    let there = kept(&dataset, &setup(), &models(&part)).unwrap().unwrap();
    assert_eq!((there.scored, there.of, there.complete), (2, 6, false));
    let out = folder.path().join("out");
    export(&there, true, &out).unwrap();
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    for name in ["evaluation.md", "evaluation.tex"] {
        assert!(read(name).contains("2 of 6 pairs of "), "{name}");
    }
    assert!(read("evaluation.csv").lines().nth(1).unwrap().contains(",6,"), "{}", read("evaluation.csv"));
    assert!(read("evaluation.json").contains("\"of\": 6"));
    // And back to the smaller set.
    let (again, fresh) = run(&data, &few, &cache);
    assert_eq!((fresh, text(&again)), (0, text(&cold)));
    let there = kept(&dataset, &setup(), &models(&cache)).unwrap().unwrap();
    assert!(there.notes.iter().any(|note| note.contains("the range of another selection")), "{:?}", there.notes);

    // What is there is told without computing, and under a copy's names as well.
    let dataset = Dataset::open(&data).unwrap();
    let there = known(&dataset, &setup(), &models(&cache)).unwrap();
    assert_eq!(there.iter().map(|s| s.grasps.len()).collect::<Vec<_>>(), [6, 6]);
    assert_eq!(there[1].grasps[0].angle_error_rad, anew.scores[1].grasps[0].angle_error_rad);
    let copy = folder.path().join("copy");
    write(&copy, 0..3);
    assert_eq!(run(&copy, &setup(), &cache).1, 0, "the same content elsewhere");
    let mask = MaskChoice { threshold_m: 0.004, ..setup().recipe.mask };
    let other = Setup { recipe: Recipe { mask, ..Recipe::default() }, ..setup() };
    assert!(known(&dataset, &other, &models(&cache)).unwrap().iter().all(|s| s.grasps.is_empty()));
}

#[test]
fn an_evaluation_is_compared_with_an_earlier_file_on_the_same_grasps() {
    let folder = tempfile::tempdir().unwrap();
    let (data, cache) = (folder.path().join("data"), folder.path().join("cache"));
    write(&data, 0..3);
    let write_report = |evaluation: &Evaluation, pairs: bool| {
        let report = Report { evaluation, published: Vec::new(), pairs: pairs.then_some(&evaluation.scores) };
        let file = folder.path().join("yesterday.json");
        std::fs::write(&file, serde_json::to_vec(&report).unwrap()).unwrap();
        file
    };
    let (mut first, _) = run(&data, &setup(), &cache);
    assert!(first.differences.is_empty(), "one generator alone");
    // From itself, as the file has it, it differs by nothing: poses that were not found are in the file too.
    let file = write_report(&first, true);
    first.against(&file).unwrap();
    let [same] = first.differences.as_slice() else { panic!("{:?}", first.differences) };
    assert_eq!(same.from, format!("{} (yesterday)", same.to));
    assert!(same.groups.iter().all(|g| g.grasps > 0 && g.figures.contains_key("success_10")));
    assert!(
        same.groups.iter().flat_map(|g| g.figures.values()).all(|d| d.value == 0.0 && d.interval == Some([0.0; 2]))
    );
    // Another mask gives other poses and the same images.
    let mask = MaskChoice { threshold_m: 0.004, ..setup().recipe.mask };
    let other = Setup { recipe: Recipe { mask, ..Recipe::default() }, ..setup() };
    let (mut other, _) = run(&data, &other, &cache);
    other.against(&file).unwrap();
    let group = &other.differences[0].groups[0];
    assert_eq!(group.figures["psnr_db"].value, 0.0);
    let figure = |evaluation: &Evaluation, key| evaluation.rows[1].groups[0].named(key).map(|e| e.value);
    let angle = figure(&other, "angle_deg").zip(figure(&first, "angle_deg")).map(|(to, from)| to - from);
    // A mean of differences and a difference of means: the same but for the last digit.
    let apart = group.figures.get("angle_deg").zip(angle).map(|(difference, angle)| (difference.value - angle).abs());
    assert!(apart.is_some_and(|apart| apart < 1e-12), "{apart:?}");
    // What cannot be compared is refused.
    let why = other.against(&write_report(&first, false)).unwrap_err();
    assert!(why.hint.is_some_and(|hint| hint.contains("--pairs")));
    std::fs::write(&file, "{}").unwrap();
    assert!(other.against(&file).is_err() && other.against(&folder.path().join("none.json")).is_err());
}

/// The studio as it stands when nothing is left to compute.
fn studio(data: &Path, home: &Path, pane: Pane, commands: Vec<Command>) -> State {
    let services = LiveServices::with_config_folder(Some(home.to_owned()));
    let (mut state, mut runtime) = (State::default(), Runtime::inline(Arc::new(services)));
    runtime.start(&mut state, Some(Place::Path(data.to_owned())));
    runtime.settle(&mut state);
    runtime.tick(&mut state, vec![ViewCommand::ShowPanes([pane].into()).into()]);
    runtime.settle(&mut state);
    runtime.tick(&mut state, commands);
    runtime.settle(&mut state);
    state
}

#[test]
fn the_studio_shows_the_scores_of_the_last_time_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let (data, home) = (folder.path().join("data"), folder.path().join("home"));
    write(&data, 0..1);
    assert!(studio(&data, &home, Pane::Table, Vec::new()).table.scores.sources.is_empty());
    let made = studio(&data, &home, Pane::Table, vec![EvaluateCommand::All.into()]);
    let table = made.table.result.as_ref().expect("a table as well");
    assert_eq!((table.complete, table.setup.grasps_per_tool), (true, None));
    let again = studio(&data, &home, Pane::Table, Vec::new());
    assert!(again.table.result.is_none(), "nobody looks at it");
    let looked = studio(&data, &home, Pane::Results, Vec::new()).table.result.expect("the same table");
    assert_eq!((&looked.rows, looked.complete, looked.size()), (&table.rows, true, table.size()));
    let values = |state: &State| {
        let sources = state.table.scores.sources.iter();
        let of = |pair: u32| sources.clone().map(move |s| Metric::iter().map(|f| s.value(PairId(pair), f)).collect());
        (0..2).flat_map(of).collect::<Vec<Vec<Option<f64>>>>()
    };
    assert_eq!(values(&again), values(&made));
    assert!(values(&again).iter().all(|figures| figures[0].is_some()), "{:?}", values(&again));
}

#[test]
fn what_was_changed_or_damaged_is_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let (data, cache) = (folder.path().join("data"), folder.path().join("cache"));
    write(&data, 0..2);
    let (cold, _) = run(&data, &setup(), &cache);
    // A mask that somebody drew.
    let dataset = Dataset::open(&data).unwrap();
    let labels = Labels::of(&dataset);
    let name = dataset.index.pairs[0].name.clone();
    let mask = Arc::new(Mask::from_fn(175, 140, |x, y| (40..140).contains(&x) && (60..80).contains(&y)));
    let drawn = DrawnMask { revision: Revision(1), ..DrawnMask::new(mask, Provenance::told("Threshold")) };
    let mut drawn_on = PairLabels::default();
    drawn_on.draw(&MaskPlace::measured(lab::RIGHT), Some(drawn));
    labels.save(&name, &drawn_on, &Operation::default()).unwrap();
    let (hand, fresh) = run(&data, &setup(), &cache);
    assert_eq!(fresh, 1);
    assert_ne!(hand.scores[0].grasps[0].angle_error_rad, cold.scores[0].grasps[0].angle_error_rad);
    assert_eq!(
        run(&data, &Setup { recipe: Recipe { hand: false, ..setup().recipe }, ..setup() }, &cache).1,
        0,
        "left out, as before it was drawn"
    );
    labels.save(&name, &PairLabels::default(), &Operation::default()).unwrap();
    assert_eq!(run(&data, &setup(), &cache).1, 0, "taken back");
    // A touch.
    let sample = sim::simulate(&catalog::tools()[0], sim::random_grasp(77), 1, &sim::SimConfig::default());
    write_pair(&data, Layout::Test, &catalog::tools()[0].name, 1, &sample).unwrap();
    assert_eq!(run(&data, &setup(), &cache).1, 1);
    // The files of figures: cut off, and filled with anything.
    let sheets = || {
        let all = std::fs::read_dir(&cache).unwrap().map(|entry| entry.unwrap().path());
        all.filter(|path| path.extension().is_some_and(|e| e == "scores")).collect::<Vec<_>>()
    };
    assert_eq!(sheets().len(), 3, "two methods, and what files hold");
    let whole = run(&data, &setup(), &cache).0;
    for damage in [|bytes: Vec<u8>| bytes[..bytes.len() - 3].to_vec(), |bytes: Vec<u8>| vec![b'{'; bytes.len()]] {
        for sheet in sheets() {
            std::fs::write(&sheet, damage(std::fs::read(&sheet).unwrap())).unwrap();
        }
        let (found, fresh) = run(&data, &setup(), &cache);
        assert!(fresh > 0);
        assert_eq!(text(&found), text(&whole));
        assert_eq!(run(&data, &setup(), &cache).1, 0);
    }
}
