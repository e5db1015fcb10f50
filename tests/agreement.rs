//! The studio and the command line are one program: what a button does, a verb does, and with the same numbers.

mod edits;
mod in_3d;
mod proposals;
mod python;
mod random;
mod recipes;
mod stills;
mod verdicts;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;
use strum::IntoEnumIterator as _;
use touch2touch::app::command::{
    Command, DoctorCommand, ExportCommand, LabelsCommand, LearnCommand, LibraryCommand, Pane, PredictCommand,
    ViewCommand,
};
use touch2touch::app::export::Output;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::learn::{AdaptPairs, LearnForm};
use touch2touch::app::library::Place;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::Services;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskChoice, MaskSettings, MaskSource, MaskTool};
use touch2touch::app::state::{Lookup, State};
use touch2touch::app::{export, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Grid;
use touch2touch_core::label::CleanKind;
use touch2touch_core::postprocess::{CorrectionParts, ShiftMode};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::doctor::{Cure, Fact};
use touch2touch_pipeline::export::{ExportChoice, Which};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::labels::Labels;

use crate::support::{files_below, run, simulate};

#[test]
pub(crate) fn what_is_said_of_a_data_set_is_the_same_in_the_panel_and_by_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    for command in [DoctorCommand::Show(true), DoctorCommand::Try, DoctorCommand::Cure(Cure::Examine { pairs: 0 })] {
        studio.send(command.into());
    }
    let state = &studio.state;
    let (_, facts) = state.results.abouts.iter().next().expect("the panel is open");
    let worth = state.doctor.worth.as_ref().expect("the models were tried");
    let lines: Vec<Fact> = facts.iter().cloned().chain(worth.facts()).collect();
    let said = json(&["doctor", folder.to_str().unwrap()], home.path());
    assert!(lines.len() >= 10, "{lines:?}");
    // The time that a fit takes is the machine's.
    let timeless = |value: &Value| value.as_str().unwrap().split("; fit to").next().unwrap().to_owned();
    for (line, said) in lines.iter().zip(said["about"].as_array().unwrap()) {
        let line: Value = serde_json::from_str(&serde_json::to_string(line).unwrap()).unwrap();
        assert_eq!(timeless(&line["text"]), timeless(&said["text"]));
        assert_eq!((&line["topic"], &line["grade"], &line["cures"]), (&said["topic"], &said["grade"], &said["cures"]));
    }
    assert_eq!(said["about"].as_array().unwrap().len(), lines.len());
    let examined = state.doctor.examined.as_ref().expect("every pair was examined");
    assert_eq!(said["problems"], serde_json::to_value(&examined.report.problems).unwrap());
    // Every cure of a verb is one that the program knows.
    for cure in lines.iter().flat_map(|line| &line.cures) {
        let Some(verb) = cure.verb() else { continue };
        touch2touch::headless::check_command(verb.split(' ')).unwrap_or_else(|err| panic!("{verb}: {err}"));
    }
}

/// The studio on a place, run until nothing is left to compute.
struct Studio {
    state: State,
    runtime: Runtime,
}

impl Studio {
    fn open(place: Place, home: &Path) -> Self {
        let services = Services::with_config_folder(Some(home.to_owned()));
        let mut settings = services.load_settings().0;
        settings.generate.by_itself = false;
        settings.about_own_data = false;
        services.save_settings(&settings).unwrap();
        let runtime = Runtime::threads(Arc::new(services), Arc::new(|| {}));
        let mut studio = Self { state: State::default(), runtime };
        studio.runtime.start(&mut studio.state, Some(place));
        let panes = [Pane::Measured, Pane::Predicted, Pane::Compare, Pane::Metrics, Pane::Scene];
        studio.send(ViewCommand::ShowPanes(panes.into_iter().collect()).into());
        studio.send(ViewCommand::ShowBothFingers(true).into());
        studio
    }

    fn send(&mut self, command: Command) {
        self.runtime.tick(&mut self.state, vec![command]);
        let (begin, mut idle) = (Instant::now(), 0);
        while idle < 5 {
            assert!(begin.elapsed() < Duration::from_secs(240), "{:?}", self.state.log.entries.back());
            std::thread::sleep(Duration::from_millis(4));
            self.runtime.tick(&mut self.state, Vec::new());
            let settled = self.state.tasks.is_idle() && self.state.document.unsaved.is_empty();
            idle = if settled && self.state.library.open.is_some() && !self.state.library.bundles.is_empty() {
                idle + 1
            } else {
                0
            };
        }
    }

    /// Shows a pair and has it predicted.
    fn predict(&mut self, pair: u32) {
        self.send(LibraryCommand::Select(PairId(pair)).into());
        self.send(PredictCommand::Generate.into());
    }
}

/// A number as serde writes it: what bit-for-bit means in a text.
fn number(value: f64) -> Value {
    serde_json::from_str(&serde_json::to_string(&value).unwrap()).unwrap()
}

fn optional(value: Option<f64>) -> Value {
    value.map_or(Value::Null, number)
}

fn json(arguments: &[&str], home: &Path) -> Value {
    let output = run(&[arguments, &["--json"]].concat(), home);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    serde_json::from_str(&text)
        .unwrap_or_else(|err| panic!("{arguments:?}: {err}\n{text}\n{}", String::from_utf8_lossy(&output.stderr)))
}

/// A lab folder with a corrected mask and reviews, made by the verbs as a person would.
fn lab_folder(home: &Path) -> PathBuf {
    let folder = home.join("lab");
    simulate(&folder, "pattern_36", &["--grasps", "3", "--seed", "5"]);
    folder
}

/// A folder of two picture pairs.
fn pictures_folder(home: &Path) -> PathBuf {
    let folder = home.join("pictures");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, at) in [("a", 30), ("b", 70)] {
        let gelslim = Grid::from_fn(128, 128, |x, y| [(x % 90) as f32 + 80.0, ((y + at) % 70) as f32 + 90.0, 120.0]);
        images::write_rgb8(&folder.join(format!("{name}_gelslim.png")), &gelslim).unwrap();
        let bubble = Grid::from_fn(128, 128, |x, y| 220 - 2 * x.abs_diff(at).max(y.abs_diff(60)).min(100) as u8);
        images::write_gray8(&folder.join(format!("{name}_bubble.png")), &bubble).unwrap();
    }
    folder
}

fn name_of(report: &Value, pair: usize) -> String {
    report["cases"][pair]["name"].as_str().unwrap().to_owned()
}

#[test]
fn on_a_lab_folder_drawn_masks_and_reviews_count_in_both() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let path = folder.to_str().unwrap();
    let names: Vec<String> = {
        let report = json(&["pose", path], home.path());
        (0..3).map(|pair| name_of(&report, pair)).collect()
    };
    // One is corrected and accepted by the verb, another by the studio; the third is left out.
    let adopt = ["label", path, "--pair", &names[0], "--adopt", "--mask", "cad", "--finger", "right"];
    json(&adopt, home.path());
    let labeled = json(&["label", path, "--pair", &names[0], "--accept", "measured"], home.path());
    let labeled = &labeled["pairs"][0];
    assert_eq!((&labeled["review"], &labeled["masks"][0][0]), (&"in_progress".into(), &"right".into()));
    let skipped = json(&["label", path, "--pair", &names[2], "--review", "skip"], home.path());
    assert_eq!(skipped["pairs"][0]["review"], "skip");

    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    studio.send(LibraryCommand::Select(PairId(1)).into());
    studio.send(LabelsCommand::AdoptAutomatic.into());
    studio.send(LabelsCommand::CleanUp(CleanKind::LargestIsland.into()).into());
    studio.send(LabelsCommand::AcceptPose(ImprintSource::Measured, true).into());
    let exported = home.path().join("by_studio");
    studio.send(ExportCommand::SetMasks(ExportChoice { which: Which::Begun, ..ExportChoice::default() }).into());
    studio.send(ExportCommand::Write(Output::Masks, exported.clone()).into());
    let state = &studio.state;
    assert_eq!(state.document.review(&names[2]).stored(), "skip");
    assert_eq!(state.document.review(&names[0]).stored(), "in_progress");
    drop(studio);

    // What the studio accepted is what the verb's registration answers now.
    let report = json(&["pose", path], home.path());
    for pair in [0, 1] {
        let case = &report["cases"][pair];
        assert!(case["mask"].as_str().unwrap().starts_with("hand"), "{case}");
        for key in ["angle_deg", "y_m", "z_m"] {
            assert_eq!(case["accepted"][key], case[key], "{key} of {}", names[pair]);
        }
    }
    // Both export the same files.
    let by_verb = home.path().join("by_verb");
    let export = json(&["masks", "export", path, "--pairs", "begun", "--out", by_verb.to_str().unwrap()], home.path());
    assert_eq!((&export["corrected"], &export["left_out"]), (&2.into(), &serde_json::json!({ "skip": 1 })));
    let files = |root: &Path| -> BTreeMap<PathBuf, Vec<u8>> {
        let name = |file: &Path| file.strip_prefix(root).unwrap().to_owned();
        files_below(root).iter().map(|file| (name(file), std::fs::read(file).unwrap())).collect()
    };
    let (studios, verbs) = (files(&exported), files(&by_verb));
    assert!(studios.len() >= 4, "{:?}", studios.keys());
    assert!(studios == verbs, "{:?} and {:?}", studios.keys(), verbs.keys());

    // Left out where it is asked for.
    let without = json(&["pose", path, "--no-hand"], home.path());
    assert_eq!(without["cases"][0]["mask"], "unet");
}

#[test]
fn every_pane_says_a_command_that_the_program_understands() {
    let home = tempfile::tempdir().unwrap();
    let mut studio = Studio::open(Place::Demo, home.path());
    studio.send(LibraryCommand::Select(PairId(3)).into());
    let mut said = 0;
    for shift in ShiftMode::iter() {
        studio.send(prefer(move |s| s.shift = shift).into());
        for source in MaskSource::iter() {
            let choice = MaskChoice { source, ..MaskChoice::default() };
            studio.send(prefer(move |s| s.mask = MaskSettings { choice, ..MaskSettings::default() }).into());
            for pane in Pane::iter() {
                let Some(words) = export::equivalent_words(&studio.state, pane) else { continue };
                said += 1;
                if let Err(err) = touch2touch::headless::check_command(&words) {
                    panic!("{pane:?}: {words:?}: {err}");
                }
            }
        }
    }
    assert!(said > 18 * 9, "{said}");
    // One of them, run: it answers with the number that the studio shows.
    studio.send(prefer(|s| s.shift = ShiftMode::ExactInverse).into());
    studio.send(prefer(|s| s.mask = MaskSettings::default()).into());
    studio.predict(3);
    let words = export::equivalent_words(&studio.state, Pane::Metrics).unwrap();
    let words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
    let report = json(&words, home.path());
    for (case, source) in report["cases"].as_array().unwrap().iter().zip(ImprintSource::iter()) {
        let shown = results::pose(&studio.state, source).ready().unwrap();
        assert_eq!(case["angle_deg"], number(shown.angle_rad.to_degrees()), "{source:?}");
    }
}

/// The value of an option in the command of a pane.
fn said(studio: &Studio, pane: Pane, option: &str) -> Option<String> {
    let words = export::equivalent_words(&studio.state, pane)?;
    touch2touch::headless::check_command(&words).unwrap();
    let at = words.iter().position(|word| word == option)?;
    words.get(at + 1).cloned()
}

#[test]
fn commands_of_tables_and_fits_say_what_decides_them() {
    let home = tempfile::tempdir().unwrap();
    let mut studio = Studio::open(Place::Demo, home.path());
    let pane = Pane::Results;
    studio.send(prefer(|s| s.shift = ShiftMode::ExactInverse).into());
    studio.send(prefer(|s| s.runtime = EngineChoice::Rten).into());
    assert_eq!(said(&studio, pane, "--shift").as_deref(), Some("exact"));
    assert_eq!(said(&studio, pane, "--runtime").as_deref(), Some("rten"));
    studio.send(prefer(|s| s.shift = ShiftMode::Parts(CorrectionParts::NONE)).into());
    assert_eq!(said(&studio, pane, "--shift").as_deref(), Some("exact:none"));
    studio.send(prefer(|s| s.shift = ShiftMode::PaperShift).into());
    assert_eq!(said(&studio, pane, "--shift").as_deref(), Some("paper"));
    assert_eq!(said(&studio, Pane::Adapt, "--pairs"), None);
    let names: Vec<String> = studio
        .state
        .library
        .open
        .as_ref()
        .unwrap()
        .source
        .dataset
        .index
        .pairs
        .iter()
        .map(|pair| pair.name.clone())
        .collect();
    studio.send(LibraryCommand::SetFilter(names[1].clone()).into());
    studio.send(LearnCommand::SetForm(LearnForm { pairs: AdaptPairs::Listed, ..LearnForm::default() }).into());
    let listed: Vec<String> = studio.state.library.order.iter().map(|id| names[id.0 as usize].clone()).collect();
    assert!(!listed.is_empty() && listed.len() < names.len());
    assert_eq!(said(&studio, Pane::Adapt, "--pairs"), Some(listed.join(",")));
    // Nothing is marked done: there is nothing to fit, and no command for it.
    studio.send(LearnCommand::SetForm(LearnForm { pairs: AdaptPairs::Done, ..LearnForm::default() }).into());
    assert_eq!(export::equivalent_words(&studio.state, Pane::Adapt), None);
}
