//! `Tool`: a CAD model, ready for registration.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::ToolModel;
use touch2touch_pipeline::io::dataset::{ToolScale, read_in_meters};
use touch2touch_pipeline::steps::tool::tool_of;

use crate::arrays::{Array, array, points, points_of};
use crate::process::{failed, refused};

/// CAD model of a tool with what a registration needs of it.
///
/// `Tool("file.stl")` reads a file; its unit is that of `unit.txt` beside it, else meters, or `unit`: "m", "cm", "mm", "um",
/// "in", "auto". `Tool(vertices, faces)` takes (V, 3) coordinates in meters, object frame, and (F, 3) indices,
/// counter-clockwise seen from outside. Made once and used for any number of grasps: it takes some 10 to 30 ms.
#[pyclass(module = "touch2touch", frozen)]
pub(crate) struct Tool {
    pub(crate) model: Arc<ToolModel>,
    /// Name for people.
    #[pyo3(get)]
    pub(crate) name: String,
}

impl Tool {
    pub(crate) fn of(name: &str, model: Arc<ToolModel>) -> Self {
        Self { model, name: name.to_owned() }
    }
}

#[pymethods]
impl Tool {
    #[new]
    #[pyo3(signature = (source, faces=None, *, name=None, unit=None))]
    fn new(
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        faces: Option<PyReadonlyArray2<'_, i64>>,
        name: Option<String>,
        unit: Option<&str>,
    ) -> PyResult<Self> {
        let (mesh, called) = match faces {
            None => {
                let file: PathBuf = source.extract()?;
                let scale = unit.map(str::parse::<ToolScale>).transpose().map_err(refused)?;
                let mesh = py.detach(|| read_in_meters(&file, scale));
                let mesh = mesh.map_err(|err| refused(format!("{err}. {}", err.hint)))?;
                (mesh, file.file_stem().unwrap_or_default().to_string_lossy().into_owned())
            }
            Some(faces) => {
                let vertices = points_of(&source.extract()?, "vertices")?.into_owned();
                (TriMesh { triangles: triangles(&faces, vertices.len())?, vertices }, "tool".to_owned())
            }
        };
        let name = name.unwrap_or(called);
        let model = py.detach(|| tool_of(&name, mesh)).map_err(|err| failed(&err))?;
        Ok(Self { model: Arc::new(model), name })
    }

    /// Corners of the model (V, 3), meters, object frame.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        // As the file has them: the model measures x from its middle.
        let in_file = |vertex: &DVec3| *vertex + DVec3::X * self.model.middle_x_m;
        points(py, &self.model.mesh.vertices.iter().map(in_file).collect::<Vec<_>>())
    }

    /// Corners of each triangle (F, 3), counter-clockwise seen from outside.
    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, i64>> {
        let triangles = &self.model.mesh.triangles;
        array(py, triangles.iter().flatten().map(|i| i64::from(*i)).collect(), &[triangles.len(), 3])
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("touch2touch")?.getattr("_tool")?;
        (make, (this.vertices(py)?, this.faces(py)?, &this.name)).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        let size = self.model.mesh.bounds().map(|[low, high]| 1e3 * (high - low)).unwrap_or_default();
        let faces = self.model.mesh.triangles.len();
        format!("Tool({:?}, {faces} triangles, {:.1} x {:.1} x {:.1} mm)", self.name, size.x, size.y, size.z)
    }
}

fn triangles(faces: &PyReadonlyArray2<'_, i64>, vertices: usize) -> PyResult<Vec<[u32; 3]>> {
    if faces.shape()[1] != 3 {
        return Err(refused(format!("faces must be an array of F x 3 indices, not F x {}", faces.shape()[1])));
    }
    let index = |at: &i64| u32::try_from(*at).ok().filter(|i| (*i as usize) < vertices);
    let rows = faces.as_array();
    let all: Option<Vec<[u32; 3]>> =
        rows.rows().into_iter().map(|row| Some([index(&row[0])?, index(&row[1])?, index(&row[2])?])).collect();
    all.ok_or_else(|| refused(format!("faces name a corner that is not there: there are {vertices}, counted from 0")))
}
