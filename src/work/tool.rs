//! A CAD model made ready for registration: [`named_tool`].

use super::error::TaskError;
use crate::domain::mesh::TriMesh;
use crate::domain::pose::ToolModel;

/// A tool's name and its CAD model with what the registration derives from it.
#[derive(Clone, Debug)]
pub struct NamedTool {
    /// The tool's name.
    pub name: String,
    /// The CAD model, ready for registration.
    pub model: ToolModel,
}

/// A tool with what the registration needs. Takes some tens of milliseconds.
///
/// # Errors
/// If the mesh has no area or is not finite.
pub fn named_tool(name: &str, mesh: TriMesh) -> Result<NamedTool, TaskError> {
    let model = ToolModel::new(mesh).map_err(|err| TaskError::from_error(format!("CAD model of {name}"), &err))?;
    Ok(NamedTool { name: name.to_owned(), model })
}
