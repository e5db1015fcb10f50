//! A tool's CAD model, read from its data set and made ready for registration: [`load_tool`], [`Tools`].

use std::collections::BTreeMap;

use super::error::{TaskError, says};
use crate::domain::dataset::Problem;
use crate::domain::mesh::TriMesh;
use crate::domain::pose::ToolModel;
use crate::io::dataset::{Dataset, ToolFile};

/// A tool's name and its CAD model with what the registration derives from it.
#[derive(Clone, Debug)]
pub struct NamedTool {
    /// The tool's name.
    pub name: String,
    /// The CAD model, ready for registration.
    pub model: ToolModel,
}

/// The file of a tool's CAD model in a data set, with what is odd about it.
///
/// # Errors
/// If there is none, or it cannot be used.
pub fn tool_file(dataset: &Dataset, name: &str) -> Result<ToolFile, TaskError> {
    let what = format!("CAD model of {name}");
    match dataset.tool_with_notes(name) {
        Ok(Some(file)) => Ok(file),
        Ok(None) => Err(TaskError::new(what, format!("there is no {name}.stl, so its grasps have no pose"))
            .with_hint("Put it into tools_stls, in meters and the object frame.")),
        Err(err) => Err(TaskError::new(what, says(&err)).with_hint(err.hint())),
    }
}

/// A tool with what the registration needs. Takes some tens of milliseconds.
///
/// # Errors
/// If the mesh has no area or is not finite.
pub fn named_tool(name: &str, mesh: TriMesh) -> Result<NamedTool, TaskError> {
    let model = ToolModel::new(mesh).map_err(|err| TaskError::from_error(format!("CAD model of {name}"), &err))?;
    Ok(NamedTool { name: name.to_owned(), model })
}

/// A tool of a data set, with what is odd about its file.
///
/// # Errors
/// As [`tool_file`] and [`named_tool`].
pub fn load_tool(dataset: &Dataset, name: &str) -> Result<(ToolModel, Vec<Problem>), TaskError> {
    let ToolFile { mesh, notes } = tool_file(dataset, name)?;
    Ok((named_tool(name, mesh)?.model, notes))
}

/// The CAD models of a data set, each read once. One that is not there, or cannot be used, is not looked for again.
#[derive(Debug)]
pub struct Tools<'a> {
    dataset: &'a Dataset,
    models: BTreeMap<String, Option<ToolModel>>,
}

impl<'a> Tools<'a> {
    /// Nothing is read yet.
    pub fn new(dataset: &'a Dataset) -> Self {
        Self { dataset, models: BTreeMap::new() }
    }

    /// The model of a tool, read when it is first asked for.
    pub fn get(&mut self, name: &str) -> Option<&ToolModel> {
        if !self.models.contains_key(name) {
            let model = load_tool(self.dataset, name).ok().map(|(model, _)| model);
            self.models.insert(name.to_owned(), model);
        }
        self.known(name)
    }

    /// The model of a tool that was asked for before.
    pub fn known(&self, name: &str) -> Option<&ToolModel> {
        self.models.get(name)?.as_ref()
    }
}
