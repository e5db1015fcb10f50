//! The engines that run graphs, behind one small trait.
//!
//! * **rten** is pure Rust and always there.
//! * **ONNX Runtime** is about 1.5 times faster and is used when its library is found (see [`super::runtime`]); it runs
//!   graphs on the processor, or on what one of its [`Provider`]s stands for.
//!
//! Both leave one core free for the window. Their outputs agree to about 1e-5 of the values' size, those of providers to
//! [`Provider::tolerance`]; the engine is therefore part of a result's recipe.

#[cfg(feature = "onnx")]
mod ort_engine;
#[cfg(feature = "onnx")]
mod rten_engine;

use std::borrow::Cow;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use super::bundle::{BundleFile, Role};
pub use super::provider::Provider;
use crate::io::files;
#[cfg(feature = "onnx")]
pub(super) use ort_engine::{library, try_provider};
use touch2touch_core::diffusion::{ModelError, Tensor};

/// An engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EngineKind {
    /// rten, pure Rust.
    Rten,
    /// ONNX Runtime on the processor.
    Ort,
    /// ONNX Runtime on an execution provider.
    #[serde(untagged)]
    On(Provider),
}

impl EngineKind {
    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            EngineKind::Rten => "rten (built in)",
            EngineKind::Ort => "ONNX Runtime",
            EngineKind::On(provider) => provider.engine_name(),
        }
    }

    /// Most items of a batch that it is given at once.
    ///
    /// On the processor one: a batch is no faster there, and run alone, an item comes out the same to the last bit, whatever
    /// is run with it. A device is idle with one.
    pub(super) fn at_once(self) -> usize {
        match self {
            EngineKind::On(provider) if provider.has_own_memory() => 32,
            _ => 1,
        }
    }
}

/// The user's choice of engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EngineChoice {
    /// ONNX Runtime if its library is found, on the first provider that works here, else on the processor; else rten.
    #[default]
    Auto,
    /// rten.
    Rten,
    /// ONNX Runtime on the processor, or an error.
    Ort,
    /// ONNX Runtime on this provider, or an error.
    #[serde(untagged)]
    On(Provider),
}

impl From<EngineKind> for EngineChoice {
    fn from(kind: EngineKind) -> Self {
        match kind {
            EngineKind::Rten => Self::Rten,
            EngineKind::Ort => Self::Ort,
            EngineKind::On(provider) => Self::On(provider),
        }
    }
}

impl EngineChoice {
    /// Every choice there is, in the order of lists.
    pub fn all() -> impl Iterator<Item = Self> {
        [Self::Auto, Self::Rten, Self::Ort].into_iter().chain(Provider::iter().map(Self::On))
    }

    /// Choices that the system of this program can have.
    pub fn possible() -> impl Iterator<Item = Self> {
        Self::all().filter(|choice| !matches!(choice, Self::On(provider) if !provider.is_possible_here()))
    }

    /// Key on the command line and in Python.
    pub fn key(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Rten => "rten",
            Self::Ort => "ort",
            Self::On(provider) => provider.key(),
        }
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "Automatic",
            Self::Rten => "rten",
            Self::Ort => "ONNX Runtime",
            Self::On(provider) => provider.name(),
        }
    }
}

impl FromStr for EngineChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::all().find(|choice| choice.key() == text).ok_or_else(|| {
            let keys: Vec<&str> = Self::all().map(Self::key).collect();
            format!("unknown engine \"{text}\"; choose from {}", keys.join(", "))
        })
    }
}

/// The way to a library of ONNX Runtime, in a sentence.
pub(super) const INSTALL: &str = "install it with `pip install onnxruntime`, or set ORT_DYLIB_PATH to its library";

/// Why there is no engine or no graph.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// Built without the feature `onnx`.
    #[error("this build cannot run models; build it with the feature `onnx` (it is on by default)")]
    NotInThisBuild,
    /// ONNX Runtime was asked for and is not there.
    #[error("ONNX Runtime was not found ({tried}); {}, or choose the built-in engine", INSTALL)]
    NoOnnxRuntime {
        /// The places and what was wrong with each.
        tried: String,
    },
    /// A provider was asked for and cannot be had.
    #[error("{} cannot be used: {reason}; choose another runtime, or `auto`", provider.name())]
    NoProvider {
        /// The provider.
        provider: Provider,
        /// Reason, with what to do about it.
        reason: String,
    },
    /// A file of the bundle cannot be read.
    #[error("the graph cannot be read: {source}: {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The engine does not take the graph.
    #[error("{} cannot load the graph `{}`: {reason}", engine.label(), role.key())]
    Load {
        /// The engine.
        engine: EngineKind,
        /// The graph's task.
        role: Role,
        /// The engine's words.
        reason: String,
    },
    /// The bundle failed its trial.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

/// Why an engine does not take a bundle.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} does not take the model bundle \"{bundle}\": {reason} ({})", engine.label(), folder.display())]
pub struct Refusal {
    /// Name of the bundle.
    pub bundle: String,
    /// Folder of the bundle.
    pub folder: PathBuf,
    /// The engine.
    pub engine: EngineKind,
    /// Reason, as the message goes on.
    pub reason: String,
}

/// One input of a run.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// f32 of any shape.
    F32(&'a Tensor),
    /// A row of 64-bit numbers.
    I64(&'a [i64]),
}

/// A loaded graph in one engine.
trait Session: Send {
    /// Runs the graph and returns the output `output`; the error is the engine's text.
    fn run(&mut self, inputs: &[(&str, Input<'_>)], output: &str) -> Result<Tensor, String>;
}

/// A loaded graph, kept and reused for every run.
pub struct Graph {
    role: Role,
    runs: u64,
    session: Box<dyn Session>,
}

impl std::fmt::Debug for Graph {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Graph").field("role", &self.role).finish_non_exhaustive()
    }
}

impl Graph {
    /// Loads the ONNX graph `file` into `engine`, which must be one that [`resolve`] gave.
    ///
    /// # Errors
    /// See [`EngineError`].
    pub fn load(engine: EngineKind, role: Role, file: &BundleFile) -> Result<Self, EngineError> {
        let bytes =
            file.read(files::MODEL).map_err(|source| EngineError::Read { path: file.path().to_owned(), source })?;
        let load = |reason| EngineError::Load { engine, role, reason };
        load_session(engine, bytes)
            .map(|session| Self { role, runs: 0, session })
            .map_err(|reason| reason.map_or(EngineError::NotInThisBuild, load))
    }

    /// Number of runs so far.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// Runs the graph. The output must have the shape `expected`, batch first, and hold only finite numbers.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn run(
        &mut self,
        inputs: &[(&str, Input<'_>)],
        output: &str,
        expected: &[usize],
    ) -> Result<Tensor, ModelError> {
        self.runs += 1;
        let graph = || self.role.key().to_owned();
        let tensor = self.session.run(inputs, output).map_err(|reason| ModelError::Run { graph: graph(), reason })?;
        if tensor.shape() != expected {
            let (expected, found) = (expected.to_vec(), tensor.shape().to_vec());
            return Err(ModelError::Shape { graph: graph(), expected, found });
        }
        match tensor.non_finite() {
            0 => Ok(tensor),
            count => Err(ModelError::NonFinite { graph: graph(), count }),
        }
    }
}

/// Without a reason where this build has no engine.
#[cfg(feature = "onnx")]
fn load_session(engine: EngineKind, bytes: Cow<'static, [u8]>) -> Result<Box<dyn Session>, Option<String>> {
    let on = |provider| ort_engine::load(&bytes, provider).map(|s| Box::new(s) as Box<dyn Session>);
    let session = match engine {
        EngineKind::Rten => rten_engine::load(bytes).map(|s| Box::new(s) as Box<dyn Session>),
        EngineKind::Ort => on(None),
        EngineKind::On(provider) => on(Some(provider)),
    };
    session.map_err(Some)
}

#[cfg(not(feature = "onnx"))]
fn load_session(_: EngineKind, _: Cow<'static, [u8]>) -> Result<Box<dyn Session>, Option<String>> {
    Err(None)
}

/// Turns the user's choice into an engine; loads ONNX Runtime's library the first time it is wanted.
///
/// # Errors
/// [`EngineError::NotInThisBuild`]; [`EngineError::NoOnnxRuntime`] and [`EngineError::NoProvider`] if they were asked for by
/// name.
#[cfg(feature = "onnx")]
pub fn resolve(choice: EngineChoice) -> Result<EngineKind, EngineError> {
    let found = || match library() {
        Ok(_) => Ok(()),
        Err(searched) => {
            let tried: Vec<String> = searched.iter().map(|s| format!("{}: {}", s.place, s.outcome)).collect();
            Err(EngineError::NoOnnxRuntime { tried: tried.join("; ") })
        }
    };
    match choice {
        EngineChoice::Rten => Ok(EngineKind::Rten),
        EngineChoice::Auto if library().is_err() => Ok(EngineKind::Rten),
        EngineChoice::Auto => {
            // What compiles for minutes is no default.
            let works = |provider: &Provider| *provider != Provider::TensorRt && try_provider(*provider).is_ok();
            Ok(Provider::iter().find(works).map_or(EngineKind::Ort, EngineKind::On))
        }
        EngineChoice::Ort => found().map(|()| EngineKind::Ort),
        EngineChoice::On(provider) => {
            found()?;
            try_provider(provider).map_err(|why| EngineError::NoProvider { provider, reason: why.to_string() })?;
            Ok(EngineKind::On(provider))
        }
    }
}

/// Turns the user's choice into an engine.
///
/// # Errors
/// Always: this build has none.
#[cfg(not(feature = "onnx"))]
pub fn resolve(_: EngineChoice) -> Result<EngineKind, EngineError> {
    Err(EngineError::NotInThisBuild)
}

/// Exact build of an engine that [`resolve`] gave: its name, and its library's own words where it has one.
pub(super) fn build(engine: EngineKind) -> String {
    match engine {
        #[cfg(feature = "onnx")]
        EngineKind::Ort => library().map_or_else(|_| engine.label().to_owned(), |library| library.build),
        #[cfg(feature = "onnx")]
        EngineKind::On(provider) => {
            let build = library().map_or_else(|_| String::new(), |library| library.build);
            format!("{} {build}", provider.key())
        }
        _ => engine.label().to_owned(),
    }
}

/// Why a provider cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(not(feature = "onnx"), allow(dead_code, reason = "only ONNX Runtime has providers"))]
pub(super) enum NoProvider {
    /// The library was built without it.
    #[error("the ONNX Runtime in use has none; {}", .0.way_to())]
    NotInTheLibrary(Provider),
    /// It is there and does not start.
    #[error("it does not start ({said}); {}", provider.needs())]
    DoesNotStart {
        /// The provider.
        provider: Provider,
        /// ONNX Runtime's words.
        said: String,
    },
}

/// A place that was searched without success.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Searched {
    /// Place that was searched.
    pub place: String,
    /// Fault that was met there.
    pub outcome: String,
}

/// A loaded library of ONNX Runtime.
#[cfg(feature = "onnx")]
#[derive(Clone, Debug)]
pub(super) struct Library {
    pub(super) path: PathBuf,
    pub(super) found_in: String,
    pub(super) build: String,
}

/// Threads of an engine: all cores but one, at least one.
pub fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get().saturating_sub(1)).max(1)
}

#[cfg(all(test, not(feature = "onnx")))]
mod tests {
    use super::{EngineChoice, EngineError, resolve};

    #[test]
    fn a_build_without_engines_says_so() {
        assert!(matches!(resolve(EngineChoice::Auto), Err(EngineError::NotInThisBuild)));
    }
}
