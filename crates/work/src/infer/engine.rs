//! The engines that run graphs, behind one small trait.
//!
//! * **rten** is pure Rust and always there.
//! * **ONNX Runtime** is about 1.5 times faster and is used when its library is found (see [`super::runtime`]).
//!
//! Both leave one core free for the window. Their outputs agree to about 1e-5 of the values' size; the engine is
//! therefore part of a result's recipe.

#[cfg(feature = "onnx")]
mod ort_engine;
#[cfg(feature = "onnx")]
mod rten_engine;

use std::borrow::Cow;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::bundle::{BundleFile, Role};
use crate::io::files;
use touch2touch_core::diffusion::{ModelError, Tensor};

/// An engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EngineKind {
    /// rten, pure Rust.
    Rten,
    /// ONNX Runtime.
    Ort,
}

impl EngineKind {
    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            EngineKind::Rten => "rten (built in)",
            EngineKind::Ort => "ONNX Runtime",
        }
    }
}

/// The user's choice of engine.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, strum::EnumIter,
)]
#[serde(rename_all = "snake_case")]
pub enum EngineChoice {
    /// ONNX Runtime if its library is found, else rten.
    #[default]
    Auto,
    /// rten.
    Rten,
    /// ONNX Runtime, or an error.
    Ort,
}

impl From<EngineKind> for EngineChoice {
    fn from(kind: EngineKind) -> Self {
        match kind {
            EngineKind::Rten => Self::Rten,
            EngineKind::Ort => Self::Ort,
        }
    }
}

impl EngineChoice {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "Automatic",
            Self::Rten => "rten",
            Self::Ort => "ONNX Runtime",
        }
    }
}

/// Why there is no engine or no graph.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// Built without the feature `onnx`.
    #[error("this build cannot run models; build it with the feature `onnx` (it is on by default)")]
    NotInThisBuild,
    /// ONNX Runtime was asked for and is not there.
    #[error(
        "ONNX Runtime was not found ({tried}); fetch it with `touch2touch runtime --fetch`, set ORT_DYLIB_PATH, or choose the built-in engine"
    )]
    NoOnnxRuntime {
        /// The places and what was wrong with each.
        tried: String,
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
        load_session(engine, bytes)
            .map(|session| Self { role, runs: 0, session })
            .map_err(|err| err.unwrap_or_else(|reason| EngineError::Load { engine, role, reason }))
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

/// An [`EngineError`] that is already complete, or the engine's text.
struct LoadFailure(Result<EngineError, String>);

impl LoadFailure {
    fn unwrap_or_else(self, complete: impl FnOnce(String) -> EngineError) -> EngineError {
        self.0.unwrap_or_else(complete)
    }
}

#[cfg(feature = "onnx")]
fn load_session(engine: EngineKind, bytes: Cow<'static, [u8]>) -> Result<Box<dyn Session>, LoadFailure> {
    let session: Result<Box<dyn Session>, String> = match engine {
        EngineKind::Rten => rten_engine::load(bytes).map(|s| Box::new(s) as Box<dyn Session>),
        EngineKind::Ort => ort_engine::load(&bytes).map(|s| Box::new(s) as Box<dyn Session>),
    };
    session.map_err(|reason| LoadFailure(Err(reason)))
}

#[cfg(not(feature = "onnx"))]
fn load_session(_: EngineKind, _: Cow<'static, [u8]>) -> Result<Box<dyn Session>, LoadFailure> {
    Err(LoadFailure(Ok(EngineError::NotInThisBuild)))
}

/// Turns the user's choice into an engine; loads ONNX Runtime's library the first time it is wanted.
///
/// # Errors
/// [`EngineError::NotInThisBuild`], and [`EngineError::NoOnnxRuntime`] if it was asked for by name.
#[cfg(feature = "onnx")]
pub fn resolve(choice: EngineChoice) -> Result<EngineKind, EngineError> {
    match choice {
        EngineChoice::Rten => Ok(EngineKind::Rten),
        EngineChoice::Auto => Ok(if library().is_ok() { EngineKind::Ort } else { EngineKind::Rten }),
        EngineChoice::Ort => match library() {
            Ok(_) => Ok(EngineKind::Ort),
            Err(searched) => {
                let tried: Vec<String> = searched.iter().map(|s| format!("{}: {}", s.place, s.outcome)).collect();
                Err(EngineError::NoOnnxRuntime { tried: tried.join("; ") })
            }
        },
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

/// The library of ONNX Runtime in use, loaded on the first call, or all the places that were searched in vain.
#[cfg(feature = "onnx")]
pub(super) fn library() -> Result<Library, Vec<super::library::Searched>> {
    ort_engine::library()
}

/// Exact build of an engine that [`resolve`] gave: its name, and its library's own words where it has one.
pub(super) fn build(engine: EngineKind) -> String {
    match engine {
        #[cfg(feature = "onnx")]
        EngineKind::Ort => library().map_or_else(|_| engine.label().to_owned(), |library| library.build),
        _ => engine.label().to_owned(),
    }
}

/// Forgets that no library was found, so that a freshly fetched one is.
pub(super) fn search_again() {
    #[cfg(feature = "onnx")]
    ort_engine::search_again();
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
