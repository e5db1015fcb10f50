//! ONNX Runtime on this machine: what was found of it, and what it can run graphs on.

#[cfg(feature = "onnx")]
mod device;

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
#[cfg(feature = "onnx")]
use strum::IntoEnumIterator as _;

use super::engine::{self, EngineChoice, EngineKind, Provider, Searched};

/// Engine that runs the models, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RuntimeReport {
    /// Engine that [`EngineChoice::Auto`] means here; `None` if this build cannot run models.
    pub engine: Option<EngineKind>,
    /// Why, in a sentence.
    pub reason: String,
    /// The ONNX Runtime library in use.
    pub library: Option<PathBuf>,
    /// Build of that library, in its own words.
    pub build: Option<String>,
    /// The places searched in vain, in order.
    pub searched: Vec<Searched>,
    /// Threads an engine uses on the processor.
    pub threads: usize,
    /// Providers that this system can have.
    pub providers: Vec<ProviderReport>,
}

/// A provider on this machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProviderReport {
    /// The provider.
    pub provider: Provider,
    /// It ran a graph just now.
    pub works: bool,
    /// Device with its memory, where that can be found out.
    pub device: Option<String>,
    /// Reason that it does not work, and what to do about it.
    pub reason: Option<String>,
}

impl fmt::Display for RuntimeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "engine   {}", self.engine.map_or("none", EngineKind::label))?;
        writeln!(f, "why      {}", self.reason)?;
        if let Some(library) = &self.library {
            writeln!(f, "library  {}", library.display())?;
        }
        if let Some(build) = &self.build {
            writeln!(f, "build    {build}")?;
        }
        write!(f, "threads  {}", self.threads)?;
        for found in &self.providers {
            let name = found.provider.name();
            match (&found.reason, &found.device) {
                (Some(reason), _) => write!(f, "\n{name:<8} no: {reason}")?,
                (None, device) => write!(f, "\n{name:<8} works: {}", device.as_deref().unwrap_or("its first device"))?,
            }
        }
        for searched in &self.searched {
            write!(f, "\nsearched {}: {}", searched.place, searched.outcome)?;
        }
        Ok(())
    }
}

/// Finds out which engine is in use and why. Loads ONNX Runtime's library if it is found, and tries its providers.
pub fn runtime_report() -> RuntimeReport {
    let report = RuntimeReport {
        engine: engine::resolve(EngineChoice::Auto).ok(),
        reason: "this build cannot run models (it lacks the feature `onnx`)".into(),
        library: None,
        build: None,
        searched: Vec::new(),
        threads: engine::threads(),
        providers: Vec::new(),
    };
    #[cfg(feature = "onnx")]
    let report = match engine::library() {
        Ok(library) => RuntimeReport {
            reason: format!("an ONNX Runtime library was found: {}", library.found_in),
            library: Some(library.path),
            build: Some(library.build),
            providers: Provider::iter().filter(|provider| provider.is_possible_here()).map(look_at).collect(),
            ..report
        },
        Err(searched) => RuntimeReport {
            reason: format!("no ONNX Runtime library was found, so the built-in engine is used; {}", engine::INSTALL),
            searched,
            ..report
        },
    };
    report
}

#[cfg(feature = "onnx")]
fn look_at(provider: Provider) -> ProviderReport {
    match engine::try_provider(provider) {
        Ok(()) => ProviderReport { provider, works: true, device: device::describe(provider), reason: None },
        Err(why) => ProviderReport { provider, works: false, device: None, reason: Some(why.to_string()) },
    }
}
