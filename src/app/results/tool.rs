//! The CAD model of a tool.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::ToolKey;
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::{Absent, Lookup, State};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::tool::{NamedTool, named_tool, tool_file};

impl Computes for ToolKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<NamedTool>> {
        let (source, name) = (state.library.open.as_ref()?.source.clone(), self.name.clone());
        let what = format!("CAD model of {name}");
        Some(Job::new(Worker::Compute, what, move |_| named_tool(&name, tool_file(&source.dataset, &name)?.mesh)))
    }

    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        true
    }
}

/// The tool of the selected pair.
///
/// # Errors
/// [`Absent::NothingSelected`], [`Absent::NoTool`].
pub fn tool_name(state: &State) -> Result<&str, Absent> {
    state.entry().ok_or(Absent::NothingSelected)?.tool.as_deref().ok_or(Absent::NoTool)
}

/// The key of the tool of the selected pair.
///
/// # Errors
/// Why there can be none.
pub(crate) fn tool_key(state: &State) -> Result<ToolKey, Absent> {
    let dataset = state.library.open.as_ref().ok_or(Absent::NothingOpen)?.seq;
    Ok(ToolKey { dataset, name: tool_name(state)?.into() })
}

/// The tool of the selected pair, with its CAD model.
pub fn tool(state: &State) -> Lookup<'_, NamedTool> {
    state.look_or(tool_key(state).map(Some), || None).value()
}

pub(crate) fn want_tool(wants: &mut Demands<'_>) {
    if let Ok(key) = tool_key(wants.state) {
        wants.ask(key);
    }
}
