//! Every reader on files that were damaged on purpose: seeded mutations of good files and of bombs.
//!
//! No panic, no hang, no memory beyond what [`targets::Target::base_mib`] and [`PER_BYTE`] allow, and every refusal names
//! the file. The work is done by a child (this test binary again) under a memory limit, so that what would end a process
//! ends that one; the input it was at is kept under `target/tmp`.
//!
//! * `FUZZ_SECONDS`: how long (10 if unset). Hours are fine.
//! * `FUZZ_SEED`: another sequence of mutations (1 if unset).
//! * `FUZZ_ONLY`: the name of one reader.
#![allow(clippy::print_stdout, reason = "what was tried belongs in the log of the tests")]

mod mutate;
mod seeds;
mod targets;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use touch2touch_pipeline::io::catch_panic::catch_panic;

use targets::Target;

/// Bytes of memory that a reader may take for a byte of the file, beyond its base.
const PER_BYTE: u64 = 64;
/// Longest time for one file, in a debug build on a busy machine.
const LONGEST: Duration = Duration::from_secs(30);
/// Most mutated files of a reader where no time is asked for: then every run does the same as far as it comes.
const MOST: u64 = 2000;
/// Address space of the child, KiB.
const MEMORY_KIB: u64 = 2 << 20;
/// Set for the child: the folder it works in.
const CHILD: &str = "FUZZ_CHILD";
const TEST: &str = "fuzz::readers_survive_whatever_is_in_a_file";

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}")))
}

#[test]
fn readers_survive_whatever_is_in_a_file() {
    match std::env::var_os(CHILD) {
        Some(folder) => child(Path::new(&folder)),
        None => parent(),
    }
}

fn parent() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &format!("ulimit -v {MEMORY_KIB} && exec \"$@\""), "sh"])
            .arg(std::env::current_exe().unwrap());
        shell
    } else {
        Command::new(std::env::current_exe().unwrap())
    };
    let child = command
        .args([TEST, "--exact", "--nocapture", "--test-threads=1"])
        .env(CHILD, &folder)
        .env("RUST_BACKTRACE", "0")
        // Every further arena and thread reserves address space that nobody uses.
        .env("MALLOC_ARENA_MAX", "1")
        .env("RAYON_NUM_THREADS", "1")
        // What is freed goes back to the system, so that the next file's memory is its own.
        .env("MALLOC_MMAP_THRESHOLD_", "65536")
        .env("MALLOC_TRIM_THRESHOLD_", "65536")
        .stderr(std::fs::File::create(folder.join("stderr")).unwrap())
        .stdout(std::fs::File::create(folder.join("stdout")).unwrap())
        .spawn();
    let mut child = child.unwrap();
    let deadline = Instant::now() + Duration::from_secs(number("FUZZ_SECONDS").unwrap_or(10)) + 10 * LONGEST;
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break Some(status),
            None if Instant::now() > deadline => {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(50)),
        }
    };
    let said = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
    if status.is_none_or(|status| !status.success()) {
        let (said, at) = (said("stderr"), said("at"));
        let tail: String =
            said.lines().rev().take(20).collect::<Vec<_>>().into_iter().rev().collect::<Vec<_>>().join("\n");
        panic!("{status:?} at {at}; the input is kept in {}\n{tail}", folder.display());
    }
    println!("{}", said("stdout"));
    assert!(said("stdout").contains("mutated files"), "the child did nothing: {}", said("stdout"));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// What one reader went through.
#[derive(Default)]
struct Tally {
    files: u64,
    accepted: u64,
    /// Largest use of memory beyond what the file's size explains, MiB.
    peak_mib: u64,
    longest: Duration,
}

fn child(folder: &Path) {
    let asked = number("FUZZ_SECONDS");
    let seed = number("FUZZ_SEED").unwrap_or(1);
    let only = std::env::var("FUZZ_ONLY").ok();
    let targets: Vec<Target> =
        targets::all().into_iter().filter(|t| only.as_ref().is_none_or(|o| o == t.name)).collect();
    assert!(!targets.is_empty(), "no reader has that name");
    let mut tallies: Vec<Tally> = targets.iter().map(|_| Tally::default()).collect();
    // The seeds as they are come first: each is a known case.
    for (target, tally) in targets.iter().zip(&mut tallies) {
        for (number, seed) in target.seeds.iter().enumerate() {
            let at = format!("{}, seed {} ({number})", target.name, seed.name);
            let outcome = one(folder, target, &seed.bytes(), &at, tally);
            assert_eq!(outcome.is_ok(), seed.good, "{at}: {outcome:?}");
            if let (Err(said), Some(word)) = (&outcome, seed.says) {
                assert!(said.contains(word), "{at}: {word:?} is not in: {said}");
            }
        }
    }
    let end = Instant::now() + Duration::from_secs(asked.unwrap_or(10));
    'all: for round in 0..if asked.is_some() { u64::MAX } else { MOST } {
        for (number, (target, tally)) in targets.iter().zip(&mut tallies).enumerate() {
            if Instant::now() > end {
                break 'all;
            }
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(round * targets.len() as u64 + number as u64);
            let bytes = mutate::mutated(&target.seeds, &mut rng);
            let at = format!("{}, FUZZ_SEED {seed}, round {round}", target.name);
            drop(one(folder, target, &bytes, &at, tally));
        }
    }
    for (target, tally) in targets.iter().zip(&tallies) {
        println!(
            "{}: {} mutated files, {} read, at most {} MiB and {:.2} s",
            target.name,
            tally.files - target.seeds.len() as u64,
            tally.accepted,
            tally.peak_mib,
            tally.longest.as_secs_f64()
        );
    }
}

/// One file to one reader. What it answered, if that was an answer.
fn one(folder: &Path, target: &Target, bytes: &[u8], at: &str, tally: &mut Tally) -> Result<(), String> {
    // Kept for the parent: an abort leaves no other trace.
    std::fs::write(folder.join("at"), at).unwrap();
    let dir = folder.join("work");
    if dir.exists() {
        std::fs::remove_dir_all(&dir).unwrap();
    }
    std::fs::create_dir_all(&dir).unwrap();
    let file: PathBuf = (target.place)(&dir, bytes);
    let (before, start) = (memory::start(), Instant::now());
    let outcome =
        catch_panic(|| (target.read)(&dir, &file)).unwrap_or_else(|panic| panic!("{at}: it panicked: {panic}"));
    let took = start.elapsed();
    let peak = memory::peak().saturating_sub(before);
    let allowed = (target.base_mib << 20) + PER_BYTE * bytes.len() as u64;
    assert!(peak <= allowed, "{at}: {} MiB for {} bytes: {outcome:?}", peak >> 20, bytes.len());
    assert!(took < LONGEST, "{at}: it took {took:?}: {outcome:?}");
    if let Err(said) = &outcome {
        let name = file.file_name().unwrap().to_string_lossy();
        assert!(said.contains(&*name) && said.len() > name.len() + 10, "{at}: the refusal names no file: {said}");
        assert!(said.len() < 6000, "{at}: the refusal has {} bytes: {said}", said.len());
        assert!(!said.contains("which is a bug"), "{at}: {said}");
    }
    tally.files += 1;
    tally.accepted += u64::from(outcome.is_ok());
    tally.peak_mib = tally.peak_mib.max(peak >> 20);
    tally.longest = tally.longest.max(took);
    outcome
}

/// Memory of this process as Linux counts it; elsewhere 0, and only the limit of the child holds.
mod memory {
    fn status(key: &str) -> u64 {
        let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_default();
        line.trim_start_matches(':').trim().trim_end_matches(" kB").parse::<u64>().unwrap_or(0) << 10
    }

    /// Forgets the peak so far; what is in use now.
    pub(super) fn start() -> u64 {
        // Not everywhere allowed; the peak of an earlier file then counts for the later ones, too.
        std::fs::write("/proc/self/clear_refs", "5").ok();
        status("VmRSS")
    }

    /// The largest use since then.
    pub(super) fn peak() -> u64 {
        status("VmHWM")
    }
}
