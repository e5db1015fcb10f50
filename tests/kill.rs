//! The studio's saving under SIGKILL: what was said to be saved is on the disk, whatever the moment.
//!
//! One test plays both parts. The parent starts this binary again on the same test with [`ROLE`] set; that child drives
//! the application model over real files (every drawing tool, contact and ignored pixels, clean-ups, undo, navigation, review
//! states, exports in every form, by a seeded script) and says after each round up to which act a pair is saved, as the
//! model's document has it. The parent kills the child at a random moment; plays the same script in a copy of the folder as it
//! was before, so that it knows every mask after every act; and reads
//! the folder with the product's reader. Each mask and review state must be one that was there at the last confirmation or
//! later, and every file must parse; an export that has its list must be whole. The next round goes on in the folder that the
//! last one left. What a kill leaves of a training is looked at in `training.rs`, where there are models.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::Digest as _;
use strum::IntoEnumIterator as _;
use touch2touch::app::command::{Command, ExportCommand, LabelsCommand, LibraryCommand, Pane, ViewCommand};
use touch2touch::app::export::Output;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::labels::{DrawnMask, MaskPlace, PairLabels, Review};
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::Services;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskTool, Settings};
use touch2touch::app::source::Source;
use touch2touch::app::state::{Lookup, State};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Grid;
use touch2touch_core::label::{CleanKind, CleanUp, PackedMask, Paint};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::export::{DrawnMasks, ExportChoice, ExportSetup, Which, export_masks};
use touch2touch_pipeline::io::exchange::{Format, MANIFEST, list};
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::masks::{FOLDER, MaskStore};
use touch2touch_pipeline::job::JobCx;

use crate::support::copy_folder;

/// What the child plays: `FOLDER` and the script's seed.
const ROLE: &str = "TOUCH2TOUCH_KILL_TEST";
/// Kills of one run of the test; the next number of rounds in one folder.
const KILLS: usize = 80;
const ROUNDS: usize = 10;
const PAIRS: u32 = 3;
/// Acts of a script: more than fit in before the latest kill.
const ACTS: usize = 400;

/// Where the exports of a data set go: beside it.
fn exported(folder: &Path) -> PathBuf {
    folder.with_file_name("exported")
}

/// The script of a seed: what a person does, one gesture an act.
fn script(folder: &Path, seed: u64) -> Vec<Vec<Command>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut acts = vec![vec![Command::Library(LibraryCommand::Select(PairId(rng.random_range(0..PAIRS))))]];
    while acts.len() < ACTS {
        // Pictures have a right finger only.
        let finger = lab::RIGHT;
        acts.push(match rng.random_range(0..22) {
            0..11 => {
                let tool = [MaskTool::Brush, MaskTool::Eraser, MaskTool::Lasso, MaskTool::Polygon, MaskTool::Rectangle]
                    .into_iter()
                    .chain([MaskTool::Wand, MaskTool::Brush])
                    .nth(rng.random_range(0..7))
                    .unwrap_or_default();
                let paint = if rng.random_range(0..5) == 0 { Paint::Ignore } else { Paint::Contact };
                let mut at = || [rng.random_range(0.0..175.0f32), rng.random_range(0.0..140.0f32)];
                let (at_px, way) = (at(), [at(), at(), at()]);
                let begin = Command::Labels(LabelsCommand::BeginStroke {
                    finger,
                    source: ImprintSource::Measured,
                    at_px,
                    erase: rng.random(),
                });
                let mut act = vec![
                    prefer(move |s| s.mask.tool = tool).into(),
                    prefer(move |s| s.mask.paint = paint).into(),
                    Command::View(ViewCommand::SelectFinger(finger)),
                    begin,
                ];
                for to in way {
                    act.push(Command::Labels(LabelsCommand::StrokeTo(to)));
                    if tool == MaskTool::Polygon {
                        act.push(Command::Labels(LabelsCommand::Corner(to)));
                    }
                }
                act.push(Command::Labels(LabelsCommand::Close));
                act.push(Command::Labels(LabelsCommand::EndStroke));
                act
            }
            11 => {
                let kinds: Vec<CleanKind> = CleanKind::iter().collect();
                let clean_up = CleanUp::from(kinds[rng.random_range(0..kinds.len())]);
                vec![
                    Command::View(ViewCommand::SelectFinger(finger)),
                    Command::Labels(LabelsCommand::CleanUp(clean_up)),
                ]
            }
            12 => vec![Command::View(ViewCommand::SelectFinger(finger)), Command::Labels(LabelsCommand::ResetMask)],
            13 | 14 => vec![Command::Labels(LabelsCommand::Undo)],
            15 => vec![Command::Labels(LabelsCommand::Redo)],
            16 => vec![Command::Labels(LabelsCommand::SetReview(
                [Review::Done, Review::Flagged, Review::Skip][rng.random_range(0..3)],
            ))],
            17 | 18 => {
                let formats: Vec<Format> = Format::iter().collect();
                let format = formats[rng.random_range(0..formats.len())];
                let choice = ExportChoice { which: Which::Begun, format, ..ExportChoice::default() };
                vec![
                    Command::Export(ExportCommand::SetMasks(choice)),
                    Command::Export(ExportCommand::Write(Output::Masks, exported(folder))),
                ]
            }
            _ => vec![Command::Library(LibraryCommand::Select(PairId(rng.random_range(0..PAIRS))))],
        });
    }
    acts
}

/// An open folder in the application model.
fn start(mut runtime: Runtime, folder: &Path) -> (Runtime, State) {
    let settings = Settings { about_own_data: false, ..Settings::default() };
    let mut state = State { settings, ..State::default() };
    let panes = [Pane::Measured, Pane::Masks].into_iter().collect();
    let open = LibraryCommand::Open(Place::Path(folder.to_owned()));
    runtime.tick(&mut state, vec![open.into(), Command::View(ViewCommand::ShowPanes(panes))]);
    (runtime, state)
}

/// Whether the selected pair can be drawn on: everything a stroke starts from is there.
fn ready(state: &State) -> bool {
    let mask = results::mask_in_force(state, ImprintSource::Measured, lab::RIGHT);
    let imprint = results::imprint(state, ImprintSource::Measured, lab::RIGHT).ready().is_some();
    let known = imprint && !matches!(mask, Err(Lookup::Waiting | Lookup::Stale(_)));
    state.entry().is_some() && state.document.is_editable(state.pair_name()) && known
}

/// The child: acts, and says what is saved, until it is killed.
fn act(role: &str) -> ! {
    let (folder, seed) = role.rsplit_once(' ').unwrap();
    let seed: u64 = seed.parse().unwrap();
    let runtime = Runtime::threads(Arc::new(Services::with_config_folder(None)), Arc::new(|| {}));
    let (mut runtime, mut state) = start(runtime, Path::new(folder));
    let mut rng = ChaCha8Rng::seed_from_u64(!seed);
    // Not by `println!`, which the test harness may hold back.
    let mut said = std::io::stdout();
    let mut say = |line: String| said.write_all(format!("\n{line}\n").as_bytes()).and_then(|()| said.flush()).unwrap();
    let mut unsaved = state.document.unsaved.clone();
    let mut confirm = |state: &State, act: usize| {
        for name in unsaved.difference(&state.document.unsaved) {
            say(format!("saved {act} {name}"));
        }
        unsaved.clone_from(&state.document.unsaved);
    };
    for (i, commands) in script(Path::new(folder), seed).into_iter().enumerate() {
        loop {
            runtime.tick(&mut state, Vec::new());
            confirm(&state, i);
            if i == 0 && state.library.open.is_some() || ready(&state) {
                break;
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        std::io::stdout().write_all(format!("\nact {}\n", i + 1).as_bytes()).unwrap();
        runtime.tick(&mut state, commands);
        confirm(&state, i + 1);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
    }
    loop {
        runtime.tick(&mut state, Vec::new());
        confirm(&state, ACTS);
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Masks with the provenance of each pixel, and the review state.
type Labels = (BTreeMap<MaskPlace, PackedMask>, Review);

fn plain(labels: &PairLabels) -> Labels {
    let mask = |(place, hand): (&MaskPlace, &DrawnMask)| (place.clone(), hand.pack());
    (labels.masks.iter().map(mask).collect(), labels.review)
}

/// What each pair says before the first act and after each one, played in a folder without exports.
fn played(folder: &Path, seed: u64, acts: usize) -> Vec<BTreeMap<String, Labels>> {
    let (mut runtime, mut state) = start(Runtime::inline(Arc::new(Services::with_config_folder(None))), folder);
    runtime.settle(&mut state);
    let source = Source::open(&Place::Path(folder.to_owned()), None).unwrap();
    let mut now: BTreeMap<String, Labels> = BTreeMap::new();
    for entry in &source.dataset.index.pairs {
        now.insert(entry.name.clone(), plain(&source.labels.load(&entry.name).unwrap()));
    }
    let mut all = vec![now.clone()];
    for mut commands in script(folder, seed).into_iter().take(acts) {
        assert!(all.len() == 1 || ready(&state));
        commands.retain(|command| !matches!(command, Command::Export(_)));
        runtime.tick(&mut state, commands);
        runtime.settle(&mut state);
        for (name, labels) in &state.document.labels {
            now.insert(name.clone(), plain(labels));
        }
        all.push(now.clone());
    }
    all
}

/// What a child said before its end.
#[derive(Default)]
struct Said {
    /// The last act that was begun.
    begun: usize,
    /// Per pair the last act up to which it is saved.
    saved: BTreeMap<String, usize>,
    confirmations: usize,
}

fn kill_one(folder: &Path, seed: u64, acts: usize, after: Duration) -> Said {
    let mut child = Process::new(std::env::current_exe().unwrap())
        .args(["--exact", "kill::no_confirmed_stroke_is_lost_to_a_kill", "--nocapture", "--test-threads", "1"])
        .env(ROLE, format!("{} {seed}", folder.display()))
        // Labels lie beside the pictures; nothing of the user's is looked at.
        .env("XDG_DATA_HOME", folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut said = Said::default();
    let note = |said: &mut Said, line: &str| {
        let mut words = line.splitn(3, ' ');
        match (words.next(), words.next().and_then(|n| n.parse().ok()), words.next()) {
            (Some("act"), Some(act), None) => said.begun = act,
            (Some("saved"), Some(act), Some(pair)) => {
                said.saved.insert(pair.to_owned(), act);
                said.confirmations += 1;
            }
            _ => {}
        }
    };
    // So far by acts, which a busy machine does not change, and only then by the clock: any moment of an act is hit.
    while said.begun < acts {
        note(&mut said, &lines.next().expect("the child ended before the act").unwrap());
    }
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            for line in lines {
                note(&mut said, &line.unwrap());
            }
        });
        std::thread::sleep(after);
        assert!(child.try_wait().unwrap().is_none(), "the child ended by itself");
        child.kill().unwrap();
        child.wait().unwrap();
        reader.join().unwrap();
    });
    said
}

/// Reads the folder with the product's reader and compares; answers how many masks were newer than confirmed.
fn compare(folder: &Path, played: &[BTreeMap<String, Labels>], said: &Said) -> usize {
    let source = Source::open(&Place::Path(folder.to_owned()), None).unwrap();
    assert_eq!(source.problems, [], "a file does not parse");
    let store = MaskStore::in_folder(folder.join(FOLDER));
    for (pair, finger) in store.masks() {
        store.load(&pair, finger).unwrap();
    }
    let mut newer = 0;
    for entry in &source.dataset.index.pairs {
        // Of a journal, a kill can only cut the last line short.
        let journal = store.journal(&entry.name).unwrap();
        let (whole, last) = journal.split_at(journal.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1));
        let torn = |line: &&[u8]| !line.is_empty() && serde_json::from_slice::<serde_json::Value>(line).is_err();
        // One that was cut short before is closed by the next one.
        let torn = whole.split(|b| *b == b'\n').filter(torn).count();
        assert!(torn < ROUNDS, "{torn} lines of a journal do not parse; the last: {:?}", String::from_utf8_lossy(last));
        let (masks, review) = plain(&source.labels.load(&entry.name).unwrap());
        let confirmed = said.saved.get(&entry.name).copied().unwrap_or(0);
        // A line may be on its way when the kill comes, an act is announced before it is begun.
        let may_be = &played[confirmed..=said.begun];
        for finger in lab::PADS {
            let place = MaskPlace::measured(finger);
            let fits = |labels: &BTreeMap<String, Labels>| labels[&entry.name].0.get(&place) == masks.get(&place);
            assert!(
                may_be.iter().any(fits),
                "{}, finger {finger:?}: confirmed at act {confirmed}, begun {}; on the disk is the mask of acts {:?}",
                entry.name,
                said.begun,
                (0..played.len()).filter(|&act| fits(&played[act])).collect::<Vec<_>>()
            );
            newer += usize::from(!fits(&may_be[0]));
        }
        assert!(may_be.iter().any(|labels| labels[&entry.name].1 == review), "{}: {review:?}", entry.name);
    }
    newer
}

/// One more export, which is whole, and takes away what kills left of others.
fn finish(folder: &Path) {
    let source = Source::open(&Place::Path(folder.to_owned()), None).unwrap();
    let masks = DrawnMasks { labels: &source.labels, changed: &BTreeMap::new() };
    let choice = ExportChoice { which: Which::Begun, ..ExportChoice::default() };
    let setup = ExportSetup { pairs: None, choice };
    match export_masks(&source.dataset, &masks, &setup, &exported(folder), None, &JobCx::unwatched()) {
        Ok(_) => {
            let mut seen = Exports::default();
            look_at_exports(folder.parent().unwrap(), &mut seen);
            assert_eq!(seen.whole, 1);
            // One that was killed before it had its lock, or while it took itself away, is left alone until it is older.
            let beside = std::fs::read_dir(folder.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path());
            let locked: Vec<PathBuf> = beside.filter(|path| path.join("lock").is_file()).collect();
            assert!(locked.is_empty(), "what was cut off is gone: {locked:?}");
        }
        // All pairs may have been skipped or flagged.
        Err(err) => assert!(err.why.contains("there is no mask to export"), "{err}"),
    }
}

/// What the kills left of exports.
#[derive(Default)]
struct Exports {
    /// Times that there was a whole one.
    whole: usize,
    /// Times that one was under way.
    cut: usize,
}

/// Every folder that has an export's list holds all that it lists, to the byte, and its masks can be read: where an export
/// goes, and where one is made first.
fn look_at_exports(beside: &Path, seen: &mut Exports) {
    for entry in std::fs::read_dir(beside).unwrap().map(|entry| entry.unwrap()) {
        let name = entry.file_name().to_string_lossy().into_owned();
        seen.cut += usize::from(name.starts_with(".touch2touch-new-"));
        for folder in [entry.path(), entry.path().join("new"), entry.path().join("old")] {
            let Ok(text) = std::fs::read(folder.join(MANIFEST)) else {
                assert!(!folder.ends_with("exported"), "an export without its list lies in its place");
                continue;
            };
            let says: serde_json::Value = serde_json::from_slice(&text).unwrap();
            for (file, sha256) in says["files"].as_object().unwrap() {
                let bytes = std::fs::read(folder.join(file)).unwrap_or_else(|err| panic!("{file}: {err}"));
                let found: String = sha2::Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
                assert_eq!(*sha256, found, "{file}");
            }
            let found = list(&folder, None).unwrap();
            assert_eq!((found.masks.len(), found.refused.len()), (says["stems"].as_object().unwrap().len(), 0));
            assert!(found.masks.iter().all(|listed| listed.read().is_ok()));
            seen.whole += usize::from(folder.ends_with("exported"));
        }
    }
}

#[test]
fn no_confirmed_stroke_is_lost_to_a_kill() {
    if let Ok(role) = std::env::var(ROLE) {
        act(&role);
    }
    let next = AtomicUsize::new(0);
    let totals = Mutex::new((0, 0, 0));
    let exports = Mutex::new(Exports::default());
    let workers = std::thread::available_parallelism().map_or(1, usize::from).clamp(1, 4);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let series = next.fetch_add(1, Ordering::Relaxed);
                    if series * ROUNDS >= KILLS {
                        break;
                    }
                    let dir = tempfile::tempdir().unwrap();
                    let folder = dir.path().join("set");
                    std::fs::create_dir(&folder).unwrap();
                    for pair in 0..PAIRS {
                        let file = |kind: &str| folder.join(format!("touch_{pair}_{kind}.png"));
                        let gray = Grid::from_fn(32, 32, |x, y| ((x * y * (pair as usize + 1)) % 256) as u8);
                        images::write_gray8(&file("bubble"), &gray).unwrap();
                        images::write_rgb8(&file("gelslim"), &Grid::from_fn(32, 32, |x, _| [x as f32; 3])).unwrap();
                    }
                    for round in 0..ROUNDS {
                        let seed = (series * ROUNDS + round) as u64;
                        let mut rng = ChaCha8Rng::seed_from_u64(seed + 1_000_000);
                        let (acts, after) = (rng.random_range(1..16), rng.random_range(0..30_000));
                        let beside = tempfile::tempdir().unwrap();
                        copy_folder(&folder, &beside.path().join("set"));
                        let said = kill_one(&folder, seed, acts, Duration::from_micros(after));
                        let played = played(&beside.path().join("set"), seed, said.begun);
                        let newer = compare(&folder, &played, &said);
                        look_at_exports(dir.path(), &mut exports.lock().unwrap());
                        let mut totals = totals.lock().unwrap();
                        *totals = (totals.0 + said.begun, totals.1 + said.confirmations, totals.2 + newer);
                    }
                    finish(&folder);
                }
            });
        }
    });
    let (acts, confirmations, newer) = *totals.lock().unwrap();
    let Exports { whole, cut } = exports.into_inner().unwrap();
    eprintln!("{KILLS} kills, {acts} acts, {confirmations} confirmed saves, {newer} masks newer than confirmed");
    eprintln!("exports: {whole} times a whole one, {cut} times one that was cut off");
    // Kills that come before anything was saved would show nothing.
    // On a busy machine fewer acts fit between two kills; enough of them must have been confirmed to mean anything.
    assert!(acts > 5 * KILLS && confirmations > KILLS / 5);
    assert!(whole > 0 && cut > 0, "exports: {whole} whole, {cut} cut off");
}
