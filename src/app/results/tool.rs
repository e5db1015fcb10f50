//! The CAD model of a tool.

use std::sync::Arc;

use super::{Absent, Computes, DatasetSeq, Demands, Job, Lane, Lookup, SharedServices, State};
use touch2touch_work::error::TaskError;
use touch2touch_work::tool::{NamedTool, named_tool};

/// A tool of a data set.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ToolKey {
    /// The opening of the data set.
    pub dataset: DatasetSeq,
    /// The name.
    pub name: Arc<str>,
}

impl Computes for ToolKey {
    type Value = NamedTool;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<NamedTool>> {
        let (source, name) = (state.library.open.as_ref()?.source.clone(), self.name.clone());
        let what = format!("CAD model of {name}");
        Some(Job::new(Lane::Compute, what, move |_| named_tool(&name, source.tool_mesh(&name)?)))
    }

    fn bytes(tool: &NamedTool) -> usize {
        let mesh = tool.model.mesh.vertices.len() * 24 + tool.model.mesh.triangles.len() * 12;
        // The registration's field and tree are of the mesh's order, at least a few MB.
        8 * mesh + (4 << 20)
    }

    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        true
    }
}

impl State {
    /// The tool of the selected pair.
    ///
    /// # Errors
    /// [`Absent::NothingSelected`], [`Absent::NoTool`].
    pub fn tool_name(&self) -> Result<&str, Absent> {
        self.entry().ok_or(Absent::NothingSelected)?.tool.as_deref().ok_or(Absent::NoTool)
    }

    /// The key of the tool of the selected pair.
    ///
    /// # Errors
    /// Why there can be none.
    pub(crate) fn tool_key(&self) -> Result<ToolKey, Absent> {
        let dataset = self.library.open.as_ref().ok_or(Absent::NothingOpen)?.seq;
        Ok(ToolKey { dataset, name: self.tool_name()?.into() })
    }

    /// The tool of the selected pair, with its CAD model.
    pub fn tool(&self) -> Lookup<'_, NamedTool> {
        self.look_or(self.tool_key().map(Some), || None).value()
    }
}

impl Demands<'_> {
    pub(crate) fn tool(&mut self) {
        if let Ok(key) = self.state.tool_key() {
            self.ask(key);
        }
    }
}
