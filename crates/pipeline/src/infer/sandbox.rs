//! Trial of a bundle by an engine, in a process of its own.
//!
//! A graph of a few hundred bytes can ask for any amount of memory or never end, and a failed allocation ends a process
//! without a word. So a bundle is loaded and run once, on zeros of the shapes its manifest declares, by the same
//! program in a second process, before an engine of the first process sees it: [`check`], which `bundle check` calls for
//! every engine that is present, and [`admit`], which [`super::generator`], [`super::mask`] and [`super::classifier`] call
//! before they load a graph, in the studio as on the command line. A bundle that passed is not tried again (the verdict
//! is kept in the cache folder, by the bundle's hash, the engine's build and the program's version), and those that ship
//! with the program are not tried at all.
//!
//! What an execution provider computes is also compared with the processor's own outputs ([`compare`]), for the bundles that
//! ship too, and where it differs by more than [`super::engine::Provider::tolerance`] or fails, the automatic choice goes on
//! with the processor.
//!
//! Bounded is loading, and one run of every graph with a batch of one, in time ([`TIME`]) and in memory
//! ([`memory_limit`]: on Linux the address space, elsewhere on Unix what `ps` says is resident; on Windows nothing limits
//! the memory, but it is the second process that ends; a provider that maps a device's memory has no bound). Not bounded is
//! what a graph asks for on other values than zeros, and larger batches, which take their multiple. Another program that uses this library has no
//! second process ([`Program::declared`]); it compares, and tries nothing else.

mod compare;
mod watch;

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::bundle::contract::promised;
use super::bundle::{Bundle, Origin, TimestepType};
use super::engine::{EngineChoice, EngineError, EngineKind, Graph, Input, Refusal, build, resolve};
use crate::io::digest::sha256;
use crate::io::folders;
use crate::io::program::Program;
use touch2touch_core::diffusion::{ModelError, Tensor};
use watch::{End, Limits, ProcessEnd};

/// Most time a trial may take.
pub const TIME: Duration = Duration::from_secs(60);
/// Memory every trial may use: the program, the engine's library and its threads, and what graphs pass on to each other.
const MEMORY: u64 = 4 << 30;
/// Bytes that it may use besides, for each byte of the graphs: weights are unpacked, laid out anew, and held more than
/// once.
const MEMORY_PER_BYTE: u64 = 8;
/// The name of the second process's verb, after the program's: `bundle try DIR --engine rten`.
pub const VERB: [&str; 2] = ["bundle", "try"];
/// Starts of the second process's lines: what it is about to do, what went wrong, that all is well.
const AT: &str = "at ";
const REFUSED: &str = "refused ";
const TAKEN: &str = "taken";

/// The most memory a trial of the bundle may use, bytes.
pub(crate) fn memory_limit(bundle: &Bundle) -> u64 {
    MEMORY + MEMORY_PER_BYTE * bundle.bytes()
}

/// The engine of the user's choice, once it is known to take the bundle.
///
/// # Errors
/// The errors of [`resolve`], and [`EngineError::Refused`].
pub(super) fn admit(bundle: &Bundle, choice: EngineChoice) -> Result<EngineKind, EngineError> {
    let engine = resolve(choice)?;
    match (known_or_tried(bundle, engine), engine, choice) {
        (Ok(()), ..) => Ok(engine),
        (Err(why), EngineKind::On(_), EngineChoice::Auto) => {
            log::warn!("{why}; it runs on the processor");
            admit(bundle, EngineChoice::Ort)
        }
        (Err(why), ..) => Err(why.into()),
    }
}

/// The verdict on a bundle and an engine that [`resolve`] gave: from memory, from the disk, or from a trial.
fn known_or_tried(bundle: &Bundle, engine: EngineKind) -> Result<(), Refusal> {
    /// Verdicts since the program started; only that of a bundle that passed is kept longer.
    static KNOWN: Mutex<BTreeMap<String, Result<(), Refusal>>> = Mutex::new(BTreeMap::new());
    // The manifests hold the checksums of the graphs; what a driver makes of them is another matter.
    let on_the_processor = !matches!(engine, EngineKind::On(_));
    if on_the_processor && (Origin::ships(bundle.hash()) || Program::declared().is_none()) {
        return Ok(());
    }
    let key = key(bundle, engine);
    let known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
    let verdict = match known {
        Some(verdict) => verdict,
        None if kept(&key).is_some_and(|file| file.is_file()) => Ok(()),
        None => match Program::declared().map(|program| start(program, bundle, engine)) {
            Some(Ok(seen)) => judge(bundle, engine, &seen),
            // The program was moved, say: no reason to give the bundle up.
            Some(Err(err)) => {
                log::warn!("the model bundle {} could not be tried: {err}", bundle.origin());
                return Ok(());
            }
            None => compare::with_the_processor(bundle, engine).map_err(|why| refusal(bundle, engine, why)),
        },
    };
    if verdict.is_ok() {
        keep(&key, bundle, engine);
    }
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(key, verdict.clone());
    verdict
}

/// Tries the bundle on an engine that [`resolve`] gave, whatever is known of it.
///
/// # Errors
/// [`Refusal`], also if no trial could be made.
pub fn check(bundle: &Bundle, engine: EngineKind) -> Result<(), Refusal> {
    let program = Program::declared().ok_or_else(|| refusal(bundle, engine, "there is no program to try it with"))?;
    match start(program, bundle, engine) {
        Ok(seen) => judge(bundle, engine, &seen)?,
        Err(err) => return Err(refusal(bundle, engine, format!("it could not be tried: {err}"))),
    }
    keep(&key(bundle, engine), bundle, engine);
    Ok(())
}

/// Loads every graph and runs it once on zeros, in the second process. `line` is told what happens.
///
/// # Errors
/// [`EngineError::NoOnnxRuntime`] and the like; that an engine refuses is said in a line and answered `false`.
pub fn run(bundle: &Bundle, choice: EngineChoice, line: &mut dyn FnMut(&str)) -> Result<bool, EngineError> {
    let engine = resolve(choice)?;
    let mut at = |at: &str| line(&format!("{AT}{at}"));
    let outcome = on_zeros(bundle, engine, &mut at).and_then(|()| {
        at("comparing the outputs with the processor's");
        compare::with_the_processor(bundle, engine)
    });
    match &outcome {
        Ok(()) => line(TAKEN),
        Err(reason) => line(&format!("{REFUSED}{}", reason.replace('\n', "; "))),
    }
    Ok(outcome.is_ok())
}

fn on_zeros(bundle: &Bundle, engine: EngineKind, at: &mut dyn FnMut(&str)) -> Result<(), String> {
    let mut graphs = Vec::new();
    // All at once in memory, as in use.
    for (role, file) in bundle.files() {
        at(&format!("loading the graph `{}`", role.key()));
        graphs.push((role, Graph::load(engine, role, file).map_err(|err| err.to_string())?));
    }
    for (role, graph) in &mut graphs {
        at(&format!("running the graph `{}` on zeros", role.key()));
        let Some((inputs, outputs)) = promised(*role, bundle.spec()) else { continue };
        let zeros: Vec<(&str, Tensor)> =
            inputs.iter().map(|p| (&*p.name, Tensor::filled(batch_of_one(&p.shape), 0.0))).collect();
        let inputs = as_inputs(bundle, &zeros, &[0]);
        for output in outputs {
            match graph.run(&inputs, &output.name, &batch_of_one(&output.shape)) {
                // Zeros are no touch: what comes out of them need not be numbers.
                Ok(_) | Err(ModelError::NonFinite { .. }) => {}
                Err(err) => return Err(err.to_string()),
            }
        }
    }
    Ok(())
}

fn batch_of_one(shape: &[usize]) -> Vec<usize> {
    [&[1], shape].concat()
}

/// Tensors by name as a graph of the bundle takes them; of the timestep the first number where it wants whole ones.
fn as_inputs<'a>(bundle: &Bundle, tensors: &'a [(&str, Tensor)], step: &'a [i64]) -> Vec<(&'a str, Input<'a>)> {
    let whole_steps = bundle.generator().is_none_or(|spec| spec.timestep == TimestepType::Int64);
    let input = |(name, tensor): &'a (&str, Tensor)| match *name == "timestep" && whole_steps {
        true => (*name, Input::I64(step)),
        false => (*name, Input::F32(tensor)),
    };
    tensors.iter().map(input).collect()
}

fn start(program: &Program, bundle: &Bundle, engine: EngineKind) -> std::io::Result<ProcessEnd> {
    let name = EngineChoice::from(engine).key();
    let place = match bundle.origin() {
        Origin::Folder(folder) => std::path::absolute(folder)?,
        built_in => built_in.path(),
    };
    let mut words = program.0.clone();
    words.extend([VERB[0], VERB[1], name, "--"].map(OsString::from));
    words.push(place.into());
    // Drivers reserve address space by the terabyte.
    let bounded = !matches!(engine, EngineKind::On(provider) if provider.has_own_memory());
    watch::watch(&words, Limits { memory: bounded.then(|| memory_limit(bundle)), time: TIME })
}

fn refusal(bundle: &Bundle, engine: EngineKind, reason: impl Into<String>) -> Refusal {
    Refusal { bundle: bundle.name().to_owned(), folder: bundle.origin().path(), engine, reason: reason.into() }
}

/// Verdict on a trial, from the second process's words and its end.
fn judge(bundle: &Bundle, engine: EngineKind, seen: &ProcessEnd) -> Result<(), Refusal> {
    let lines = || seen.output.lines();
    let at = lines().filter_map(|l| l.strip_prefix(AT)).next_back().unwrap_or("starting");
    let limit = format!("{:.1} GB", memory_limit(bundle) as f64 / 1e9);
    let reason = match &seen.end {
        End::Ended(status) if status.success() && lines().any(|l| l == TAKEN) => return Ok(()),
        End::TooLong => format!("{at} was not done after {} s", TIME.as_secs()),
        End::TooMuch => format!("{at} takes more than {limit} of memory"),
        End::Ended(status) => {
            let said = lines().find_map(|l| l.strip_prefix(REFUSED)).map(str::to_owned);
            said.unwrap_or_else(|| {
                // The last words of a process that ended by itself, of which the first line is the one that counts.
                let words = seen.errors.lines().find(|l| l.contains("memory allocation of"));
                match words.or_else(|| seen.errors.lines().find(|l| !l.trim().is_empty())) {
                    Some(words) if words.contains("memory allocation of") => {
                        format!("{at} takes more than {limit} of memory ({words})")
                    }
                    Some(words) => format!("{at} ended the process ({status}): {words}"),
                    None => format!("{at} ended the process ({status})"),
                }
            })
        }
    };
    Err(refusal(bundle, engine, reason))
}

/// Key of a verdict: a digest of all that it depends on.
fn key(bundle: &Bundle, engine: EngineKind) -> String {
    let parts = [env!("CARGO_PKG_VERSION"), &build(engine), bundle.hash(), &memory_limit(bundle).to_string()];
    sha256(parts.join("\n").as_bytes())
}

/// The file that says that a bundle passed, whether it exists or not.
fn kept(key: &str) -> Option<PathBuf> {
    Some(folders::program_cache()?.join("trials").join(key))
}

fn keep(key: &str, bundle: &Bundle, engine: EngineKind) {
    let Some(file) = kept(key).filter(|file| !file.exists()) else { return };
    let text = format!("{} takes {} ({})\n", engine.label(), bundle.name(), bundle.hash());
    let written = file.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::write(&file, text));
    if let Err(err) = written {
        log::debug!("the verdict on {} could not be kept: {err}", bundle.name());
    }
}
