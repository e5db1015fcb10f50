//! [`ToolModel`]: a tool's CAD model with the distances to it, and a place for what others derive from it.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::DVec3;

use super::field::{DistanceField, FieldError};
use super::mesh::distance::MeshError;
use super::mesh::{MeshDistance, TriMesh};

/// Points of the surface that registrations compare with: as many as the lab samples.
pub(crate) const SURFACE_POINTS: usize = 5000;
/// Seed of those points, so that every run compares with the same ones.
pub(crate) const SURFACE_SEED: u64 = 0;

/// Why a CAD model cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ToolError {
    /// No silhouette.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// No surface.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A tool's CAD model with the distances to its silhouette and its surface, built once and shared.
///
/// The fingers close on the tool from both sides, so its middle lies between them wherever the CAD model was drawn: here x is
/// measured from the middle.
#[derive(Clone, Debug)]
pub struct ToolModel {
    /// The model, meters, object frame with x from the middle between the two sides that the fingers hold.
    pub mesh: TriMesh,
    /// Place of that middle along x in the object frame of the file, meters.
    pub middle_x_m: f64,
    /// Distance to its silhouette along the closing axis.
    pub field: DistanceField,
    /// Distance to its surface.
    pub distance: MeshDistance,
    surface: Vec<(DVec3, DVec3)>,
    derived: Derived,
}

impl ToolModel {
    /// Builds everything that the default registration and labeling need: some 10 to 30 ms.
    ///
    /// # Errors
    /// [`ToolError`] if the mesh is empty or damaged, or its size cannot be meters (with the scale that would be).
    pub fn new(mut mesh: TriMesh) -> Result<Self, ToolError> {
        let field = DistanceField::from_mesh(&mesh)?;
        let mut surface = mesh.sample_surface_with_normals(SURFACE_POINTS, SURFACE_SEED);
        let middle_x_m = middle_x(&mesh, &surface);
        if middle_x_m != 0.0 {
            mesh.vertices.iter_mut().for_each(|v| v.x -= middle_x_m);
            surface.iter_mut().for_each(|(p, _)| p.x -= middle_x_m);
        }
        let distance = MeshDistance::new(&mesh)?;
        Ok(Self { mesh, middle_x_m, field, distance, surface, derived: Derived::default() })
    }

    /// [`SURFACE_POINTS`] points of the surface with the normals of their triangles, meters, object frame.
    pub fn surface(&self) -> &[(DVec3, DVec3)] {
        &self.surface
    }

    /// Form of the tool that a registration needs of its own: made at the first request for the type `T`, kept with the
    /// tool, and shared by all threads. The tool does not know what it keeps.
    ///
    /// `make` must depend on the tool alone; whoever asks for one type always passes the same function.
    pub fn derived<T: Any + Send + Sync>(&self, make: impl FnOnce(&Self) -> T) -> Arc<T> {
        self.derived.cell().get_or_init(|| Arc::new(make(self))).clone()
    }
}

/// Middle of the extent along x of what the fingers hold: of the surface around the object's origin, else of all of it. 0 if it
/// is nearer to 0 than the rounding of a file.
fn middle_x(mesh: &TriMesh, surface: &[(DVec3, DVec3)]) -> f64 {
    /// Half the side of the square that is held, meters.
    const HELD_M: f64 = 0.015;
    const ROUNDING_M: f64 = 1e-6;
    let points = || mesh.vertices.iter().chain(surface.iter().map(|(p, _)| p)).filter(|p| p.is_finite());
    let extent = |held: &dyn Fn(&DVec3) -> bool| {
        let x = points().filter(|p| held(p)).map(|p| p.x);
        x.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
    };
    let [mut lo, mut hi] = extent(&|p| p.y.abs() < HELD_M && p.z.abs() < HELD_M);
    if lo > hi {
        [lo, hi] = extent(&|_| true);
    }
    let middle = 0.5 * (lo + hi);
    if middle.is_finite() && middle.abs() > ROUNDING_M { middle } else { 0.0 }
}

/// One value of each type, each made once, shared by clones of the tool.
#[derive(Clone, Default)]
struct Derived(Arc<Mutex<HashMap<TypeId, Arc<dyn Any + Send + Sync>>>>);

impl Derived {
    /// The place for a value of this type. The list is not held while the value is made.
    fn cell<T: Any + Send + Sync>(&self) -> Arc<OnceLock<Arc<T>>> {
        // The list is whole at any time: a cell is in it or not.
        let mut cells = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let cell = cells.entry(TypeId::of::<T>()).or_insert_with(|| Arc::new(OnceLock::<Arc<T>>::new()));
        Arc::clone(cell).downcast().expect("the entry of a type holds that type")
    }
}

impl std::fmt::Debug for Derived {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Derived").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::align::testing::cross;

    #[test]
    fn a_model_drawn_beside_the_grasp_plane_is_as_one_about_it() {
        let mut beside = cross();
        beside.vertices.iter_mut().for_each(|v| v.x -= 0.004);
        let (model, centered) = (ToolModel::new(beside.clone()).unwrap(), ToolModel::new(cross()).unwrap());
        assert_eq!(centered.middle_x_m, 0.0);
        assert!((model.middle_x_m + 0.004).abs() < 1e-9);
        for (a, b) in model.mesh.vertices.iter().zip(&centered.mesh.vertices) {
            assert!(a.abs_diff_eq(*b, 1e-9));
        }
    }
}
