//! ONNX Runtime on this machine: what was found of it, and how it is fetched.

mod fetch;

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use super::engine::{self, EngineChoice, EngineKind};

pub(crate) use super::library::Searched;
pub(crate) use fetch::VERSION;
pub use fetch::fetch_runtime;

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
    /// Threads an engine uses.
    pub threads: usize,
    /// The version [`fetch_runtime`] fetches.
    pub fetchable: &'static str,
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
        for searched in &self.searched {
            write!(f, "\nsearched {}: {}", searched.place, searched.outcome)?;
        }
        Ok(())
    }
}

/// Finds out which engine is in use and why. Loads ONNX Runtime's library if it is found.
pub fn runtime_report() -> RuntimeReport {
    let report = RuntimeReport {
        engine: engine::resolve(EngineChoice::Auto).ok(),
        reason: "this build cannot run models (it lacks the feature `onnx`)".into(),
        library: None,
        build: None,
        searched: Vec::new(),
        threads: engine::threads(),
        fetchable: VERSION,
    };
    #[cfg(feature = "onnx")]
    let report = match engine::library() {
        Ok(library) => RuntimeReport {
            reason: format!("an ONNX Runtime library was found: {}", library.found_in),
            library: Some(library.path),
            build: Some(library.build),
            ..report
        },
        Err(searched) => RuntimeReport {
            reason: "no ONNX Runtime library was found, so the built-in engine is used".into(),
            searched,
            ..report
        },
    };
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_always_says_why() {
        let report = runtime_report();
        assert!(!report.reason.is_empty() && report.threads >= 1);
        assert_eq!(report.engine.is_some(), cfg!(feature = "onnx"));
        assert_eq!(report.library.is_some(), report.engine == Some(EngineKind::Ort));
        assert!(report.to_string().contains(&report.reason));
    }
}
