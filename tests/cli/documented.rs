//! Every command that the pages show is one, and one of each kind is run as it stands there: a text that no longer fits the program
//! fails.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use touch2touch::headless::check_command;
use touch2touch_core::label::{Marks, Provenance};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::{MaskStore, StoredMask, StoredReview};

use super::pages::{self, fenced, repository};
use super::{error_text, run, simulated, succeed};
use crate::cli_generate::full_size_bundle;

/// The texts whose commands are run; those of the training are Python's.
fn texts() -> impl Iterator<Item = (String, String)> {
    pages::all().into_iter().filter(|(page, _)| !page.starts_with("training"))
}

/// What is done with a command.
enum How {
    /// It is run, with words of it replaced and others added so that it ends soon; these exit codes are right.
    Run(&'static [(&'static str, &'static str)], &'static str, &'static [i32]),
    /// It opens a window or fetches from the net: only its words are checked.
    Parse,
}

/// What is done with the command that begins like this; the longest beginning counts.
static TABLE: &[(&str, How)] = &[
    // The studio itself.
    ("touch2touch", How::Parse),
    ("touch2touch --version", How::Run(&[], "", &[0])),
    ("touch2touch simulate", How::Run(&[("all", "pattern_36,pattern_31_rod"), ("46", "1"), ("10", "1")], "", &[0])),
    ("touch2touch simulate --faults --out faults", How::Run(&[], "", &[0])),
    ("touch2touch generate", How::Run(&[], "--limit 1 --steps 1", &[0])),
    ("touch2touch watch", How::Run(&[], "--once --steps 1", &[0])),
    ("touch2touch compare", How::Run(&[("seed=7,steps=50", "steps=2")], "--steps 1", &[0])),
    ("touch2touch stats", How::Run(&[], "--limit 1 --steps 1", &[0])),
    ("touch2touch evaluate", How::Run(&[("test-set", "PATH")], "--grasps 1 --steps 1 --resamples 0", &[0])),
    ("touch2touch adapt", How::Run(&[("50", "1"), ("5", "0.01")], "--limit 2 --steps 1", &[0])),
    ("touch2touch pose", How::Run(&[], "--limit 1", &[0])),
    ("touch2touch still", How::Run(&[("4", "1"), ("180", "2")], "--steps 1", &[0])),
    ("touch2touch export", How::Run(&[], "", &[0])),
    ("touch2touch label", How::Run(&[], "", &[0])),
    ("touch2touch masks export", How::Run(&[], "", &[0])),
    ("touch2touch masks import", How::Run(&[], "", &[0])),
    ("touch2touch masks train", How::Run(&[("10", "0.01")], "--test-in-train", &[0])),
    ("touch2touch masks train PATH --from cad", How::Run(&[("3", "0.01")], "--test-in-train", &[0])),
    ("touch2touch doctor", How::Run(&[], "", &[0])),
    ("touch2touch bundle check", How::Run(&[], "", &[0])),
    // Without an engine on the machine it says so by its exit code.
    ("touch2touch runtime", How::Run(&[], "", &[0, 1])),
];

fn how(command: &str) -> &'static (&'static str, How) {
    let fits = |row: &str| command == row || command.starts_with(&format!("{row} "));
    let row = TABLE.iter().filter(|(row, _)| fits(row)).max_by_key(|(row, _)| row.len());
    row.unwrap_or_else(|| panic!("`{command}`: say in the table of this test how it is run"))
}

/// Small things that the placeholders of the texts stand for.
struct Stage {
    dir: tempfile::TempDir,
    name: String,
    small_bundle: PathBuf,
}

impl Stage {
    fn new() -> Self {
        let (dir, set) = simulated("pattern_36", &["--grasps", "1", "--seed", "3"]);
        let dataset = Dataset::open(&set).unwrap();
        let name = dataset.index.pairs[0].name.clone();
        // One mask corrected by hand, for the export.
        let id = touch2touch_core::dataset::PairId(0);
        let sample = dataset.load(id).unwrap();
        let imprint = &sample.pad(lab::RIGHT).unwrap().depth().unwrap().imprint;
        let mask = imprint.map(|&depth| depth > 0.005);
        let stored = StoredMask {
            marks: Marks::all(mask.size(), Provenance::told("Threshold 5.00 mm")),
            mask,
            person: "test".into(),
            saved_unix_s: 1,
        };
        let store = MaskStore::for_dataset(&dataset).unwrap();
        store.save(&name, lab::RIGHT, Some(&stored)).unwrap();
        MaskStore::in_folder(dir.path().join("other")).save(&name, lab::RIGHT, Some(&stored)).unwrap();
        store.save_review(&name, &StoredReview { review: "done".into(), ..StoredReview::default() }).unwrap();
        let (set, masks) = (set.to_str().unwrap(), dir.path().join("masks"));
        succeed(&["masks", "export", set, "--out", masks.to_str().unwrap()], dir.path());
        let robot = dir.path().join("robot");
        std::fs::create_dir(&robot).unwrap();
        let touch = dataset.gelslim_file(id).unwrap();
        std::fs::copy(&touch, robot.join(touch.file_name().unwrap())).unwrap();
        let small_bundle = full_size_bundle(dir.path());
        Self { dir, name, small_bundle }
    }

    /// The words of a command with things in the place of placeholders.
    fn words(&self, command: &str, number: usize) -> Vec<String> {
        let at = |name: &str| self.dir.path().join(name).to_str().unwrap().to_owned();
        let mut before = String::new();
        let mut out = Vec::new();
        for word in command.split_whitespace().skip(1) {
            let to = match (word, before.as_str()) {
                ("PATH", _) => at("set"),
                ("NAME", _) => self.name.clone(),
                ("OTHER", _) => at("other"),
                ("MASKS", _) => at("masks"),
                ("TOOL.stl", _) => at("set/tools_stls/pattern_36.stl"),
                ("DIR", "--out") => at(&format!("out {number}")),
                ("DIR", "watch") => at("robot"),
                ("DIR", "check") => repository().join("assets/models/generator_ldm").to_str().unwrap().to_owned(),
                ("FITTED", "--out") => at(&format!("fitted {number}")),
                ("FITTED", _) => self.small_bundle.to_str().unwrap().to_owned(),
                ("FILE" | "OUT" | "OUT.json" | "SHARDS" | "TABLE.csv", _) => at(&format!("{number} {word}")),
                ("STILL.png", _) => at(&format!("{number} still.png")),
                ("PY", _) => "/no/such/python".to_owned(),
                (json, _) if json.starts_with("--json=") => format!("--json={}", at(&format!("{number} OUT.json"))),
                (path, _) if path.starts_with("assets/") => repository().join(path).to_str().unwrap().to_owned(),
                ("faults", _) => at("faults"),
                (other, _) => {
                    let placeholder = other.len() > 1 && other.chars().all(|c| c.is_ascii_uppercase());
                    assert!(!placeholder, "`{command}`: say in this test what {other} stands for");
                    assert!(before != "--out", "`{command}`: {other} would be written where the tests run");
                    other.to_owned()
                }
            };
            before = word.to_owned();
            out.push(to);
        }
        out
    }
}

#[test]
fn every_command_of_the_texts_does_what_they_say() {
    let stage = Stage::new();
    let (mut number, mut seen, mut rows) = (0, BTreeSet::new(), BTreeSet::new());
    for (file, text) in texts() {
        for line in fenced(&text).0 {
            if !seen.insert(line.to_owned()) {
                continue;
            }
            number += 1;
            let place = format!("{file}: `{line}`");
            if let Some(script) = line.strip_prefix("./") {
                let script = repository().join(script.split(' ').next().unwrap());
                let script = std::fs::read_to_string(script).unwrap_or_else(|err| panic!("{place}: {err}"));
                assert!(!line.contains("PATH") || script.contains("\"$@\""), "{place}: it passes no path on");
                continue;
            }
            if line == "cargo install --locked --path ." {
                // What it would build is what every other test runs.
                assert!(repository().join("Cargo.lock").is_file(), "{place}: nothing is locked");
                continue;
            }
            if line.starts_with("cargo run --release -p touch2touch-bench -- ") {
                // Its own tests run each, and hold its options against the pages.
                continue;
            }
            assert!(line.starts_with("touch2touch"), "{place}: what is it?");
            // What is optional is left out and only looked at.
            let whole = line.replace(['[', ']'], "");
            check_command(["touch2touch".to_owned()].into_iter().chain(stage.words(&whole, number)))
                .unwrap_or_else(|err| panic!("{place}: {err}"));
            let shortest: String = line.split(" [").next().unwrap().to_owned();
            let (row, how) = how(&shortest);
            let How::Run(replaced, more, right) = how else {
                // A verb of which the table knows nothing must not pass for a path.
                let path = stage.words(&shortest, number).first().cloned();
                assert!(path.is_none_or(|path| Path::new(&path).exists()), "{place}: say in the table how it is run");
                continue;
            };
            // The words of all are checked above; each row of the table is run once.
            if !rows.insert(*row) {
                continue;
            }
            let mut command = shortest;
            for (word, by) in *replaced {
                command = command.split(' ').map(|w| if w == *word { *by } else { w }).collect::<Vec<_>>().join(" ");
            }
            let mut words = stage.words(&command, number);
            // With the shipped model the reference alone, of 200 steps, takes most of a minute.
            let small = stage.small_bundle.to_str().unwrap();
            words.extend(more.split_whitespace().map(|word| word.replace("SMALL", small)));
            let start = std::time::Instant::now();
            let done = run(&words.iter().map(String::as_str).collect::<Vec<_>>(), stage.dir.path());
            eprintln!("{:6.1} s {place}", start.elapsed().as_secs_f64());
            let code = done.status.code();
            let said = (String::from_utf8_lossy(&done.stdout), error_text(&done));
            assert!(code.is_some_and(|code| right.contains(&code)), "{place}: {code:?}\n{}\n{}", said.0, said.1);
            assert!(!done.stdout.is_empty(), "{place}: it says nothing");
            for out in words
                .iter()
                .filter(|word| word.contains(&format!("{number} ")) || word.ends_with(&format!(" {number}")))
            {
                let path = Path::new(out.strip_prefix("--json=").unwrap_or(out));
                let there = path.is_file() || std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some());
                assert!(there, "{place}: nothing was written to {out}");
            }
        }
    }
    assert!(rows.len() >= 10, "{} commands: were the fences read?", rows.len());
}

/// Commands within sentences may leave things out, but every word of them is one.
#[test]
fn commands_within_sentences_are_spelled_right() {
    let mut seen = 0;
    for (file, text) in pages::all() {
        let rest = fenced(&text).1;
        for span in rest.split('`').skip(1).step_by(2) {
            let words: Vec<&str> = span.split_whitespace().collect();
            if words.first() != Some(&"touch2touch") || words.len() < 2 || words.contains(&"VERB") {
                continue;
            }
            check_command(words.iter().copied().chain(["--help"]))
                .unwrap_or_else(|err| panic!("{file}: `{span}`: {err}"));
            seen += 1;
        }
    }
    assert!(seen >= 5, "{seen} commands: were the sentences read?");
}
