//! [`ToolModel`]: a tool's CAD model with everything that registration and labeling derive from it.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::align::icp::Samples;
use super::align::lab_icp::LAB_MODEL_POINTS;
use super::align::{DistanceField, FieldError, LabModel};
use super::mesh::distance::MeshError;
use super::mesh::{MeshDistance, TriMesh};

/// Seed of the model points, so that every run compares with the same ones.
const MODEL_SEED: u64 = 0;
/// Samples this close to the outline of the silhouette, meters, get its normal.
const OUTLINE_M: f64 = 0.5e-3;
/// Points of the surface that stand for triangles which are too dear to search: less than half a millimeter apart on a
/// hand-held tool.
const DENSE_POINTS: usize = 50_000;
/// Most triangles that a search may look at, on average. Ordinary meshes take some ten, however many they have.
const MAX_EFFORT: usize = 500;
/// Searches that tell, each this far from the surface, meters.
const EFFORT_SEARCHES: usize = 64;
const EFFORT_OFFSET_M: f64 = 1e-3;

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

/// A tool's CAD model with everything that registration and labeling derive from it, built once and shared.
#[derive(Clone, Debug)]
pub struct ToolModel {
    /// The model, meters, object frame.
    pub mesh: TriMesh,
    /// Distance to its silhouette along the closing axis.
    pub field: DistanceField,
    /// Distance to its surface.
    pub distance: MeshDistance,
    /// 5000 points of its surface, `(y, z)`, meters: what the lab's loop compares with.
    pub model_points: Vec<DVec2>,
    /// The same points in space with their normals.
    surface: Vec<(DVec3, DVec3)>,
    /// Only the peers look at these, so they are built when first asked for.
    samples: OnceLock<Samples>,
    silhouette: OnceLock<Samples>,
    lab: OnceLock<LabModel>,
    /// `None` inside where the triangles themselves can be searched.
    dense: OnceLock<Option<Samples>>,
}

impl ToolModel {
    /// Builds everything that the default registration and labeling need: some 10 to 30 ms.
    ///
    /// # Errors
    /// [`ToolError`] if the mesh is empty or damaged, or its size cannot be meters (with the scale that would be).
    pub fn new(mesh: TriMesh) -> Result<Self, ToolError> {
        let field = DistanceField::from_mesh(&mesh)?;
        let distance = MeshDistance::new(&mesh)?;
        let surface = mesh.sample_surface_with_normals(LAB_MODEL_POINTS, MODEL_SEED);
        let model_points = surface.iter().map(|(p, _)| DVec2::new(p.y, p.z)).collect();
        Ok(Self {
            mesh,
            field,
            distance,
            model_points,
            surface,
            samples: OnceLock::new(),
            silhouette: OnceLock::new(),
            lab: OnceLock::new(),
            dense: OnceLock::new(),
        })
    }

    /// Points of the surface with the normals of their triangles, in space.
    pub fn samples(&self) -> &Samples {
        self.samples.get_or_init(|| Samples::in_space(&self.surface))
    }

    /// What to compare with in place of the triangles, where looking for the nearest triangle takes too long: points of
    /// the surface, close together, each with the plane of its triangle. `None` for nearly all tools.
    pub fn instead_of_triangles(&self) -> Option<&Samples> {
        let dense = self.dense.get_or_init(|| {
            let (mut effort, mut searches) = (0, 0);
            for (i, (point, normal)) in self.surface.iter().take(EFFORT_SEARCHES).enumerate() {
                // In turn outside and inside.
                let side = if i % 2 == 0 { EFFORT_OFFSET_M } else { -EFFORT_OFFSET_M };
                let at = *point + *normal * side;
                if at.is_finite() {
                    effort += self.distance.effort(at);
                    searches += 1;
                }
            }
            (effort > MAX_EFFORT * searches)
                .then(|| Samples::in_space(&self.mesh.sample_surface_with_normals(DENSE_POINTS, MODEL_SEED)))
        });
        dense.as_ref()
    }

    /// The same points as the lab's loop sees them.
    pub fn lab_model(&self) -> &LabModel {
        self.lab.get_or_init(|| LabModel::new(&self.surface.iter().map(|(p, _)| *p).collect::<Vec<_>>()))
    }

    /// The same points projected along the closing axis (x = 0). Those on the outline of the silhouette carry its
    /// normal; the others, which say nothing about the place in the plane, carry none (zero).
    pub fn silhouette(&self) -> &Samples {
        self.silhouette.get_or_init(|| {
            let flat: Vec<(DVec3, DVec3)> = self
                .surface
                .iter()
                .map(|(p, _)| {
                    let sample = self.field.sample(DVec2::new(p.y, p.z));
                    let normal = if sample.distance > -OUTLINE_M {
                        sample.gradient.try_normalize().unwrap_or(DVec2::ZERO)
                    } else {
                        DVec2::ZERO
                    };
                    (DVec3::new(0.0, p.y, p.z), DVec3::new(0.0, normal.x, normal.y))
                })
                .collect();
            Samples::in_plane(&flat)
        })
    }
}
