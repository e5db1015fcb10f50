//! Triangle meshes: the CAD model over the clouds.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3};

use super::buffer::{Elements, Uniform};
use super::pipelines::Pipelines;
use super::vertex::MeshVertex;
use super::{Gpu, GpuError, view, wgpu};
use crate::domain::mesh::TriMesh;

/// A mesh to be shown.
#[derive(Clone, Debug)]
pub struct MeshItem {
    /// Tells meshes of one scene apart and labels their buffers.
    pub name: String,
    /// Must change whenever `mesh` changes; nothing else makes it go to the device.
    pub revision: u64,
    /// Meters, in its own frame. Triangles with a corner that does not exist or is not finite are left out.
    pub mesh: Arc<TriMesh>,
    /// How edges are shaded.
    pub shading: Shading,
    /// Everything that may change at every frame.
    pub style: MeshStyle,
}

/// How normals are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Every triangle by itself.
    Flat,
    /// Rounded over edges of less than 40°, sharp over others.
    #[default]
    Smooth,
}

/// What a mesh does to the things behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// Hides them, or tints them where the opacity is below 1.
    #[default]
    Solid,
    /// Lets all of them through; its outline is stronger than its faces.
    XRay,
}

/// How a mesh looks and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshStyle {
    /// From the mesh's frame (the object frame) to the world (the grasp frame). A rigid motion.
    pub world_from_mesh: DAffine3,
    /// sRGB, 0..1.
    pub color: [f32; 3],
    /// 0..1.
    pub opacity: f32,
    /// Solid or x-ray.
    pub look: Look,
}

impl Default for MeshStyle {
    fn default() -> Self {
        Self { world_from_mesh: DAffine3::IDENTITY, color: [0.75, 0.75, 0.78], opacity: 1.0, look: Look::Solid }
    }
}

/// Twin of the struct in `shaders/mesh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct MeshUniform {
    pub(super) world_from_mesh: [f32; 16],
    pub(super) color: [f32; 4],
    pub(super) xray: u32,
    pub(super) unused_0: u32,
    pub(super) unused_1: u32,
    pub(super) unused_2: u32,
}

/// A mesh on the device.
#[derive(Debug)]
pub(super) struct MeshData {
    uploaded: (u64, Shading),
    vertices: Elements,
    uniform: Uniform<MeshUniform>,
    bindings: wgpu::BindGroup,
}

impl MeshData {
    /// Uploads what changed since `old`. Returns whether vertices were uploaded, and whether numbers were.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn update(
        gpu: &Gpu,
        pipelines: &Pipelines,
        old: Option<Self>,
        item: &MeshItem,
    ) -> Result<(Self, [bool; 2]), GpuError> {
        let wanted = (item.revision, item.shading);
        let (mut data, uploaded) = match old {
            Some(data) if data.uploaded == wanted => (data, false),
            old => {
                let label = format!("Mesh::{}", item.name);
                let (buffer, uniform) = old.map_or((None, None), |d| (Some(d.vertices.buffer), Some(d.uniform)));
                let corners = vertices(&item.mesh, item.shading);
                let vertices = Elements::upload(gpu, &label, &corners, wgpu::BufferUsages::VERTEX, buffer)?;
                let uniform = uniform.unwrap_or_else(|| Uniform::new(gpu, &label));
                let bindings = pipelines.bind(gpu, &label, &uniform.buffer, None);
                (Self { uploaded: wanted, vertices, uniform, bindings }, true)
            }
        };
        let [r, g, b] = item.style.color;
        let written = data.uniform.set(
            gpu,
            MeshUniform {
                world_from_mesh: view::matrix(&item.style.world_from_mesh),
                color: [r, g, b, item.style.opacity.clamp(0.0, 1.0)],
                xray: u32::from(item.style.look == Look::XRay),
                unused_0: 0,
                unused_1: 0,
                unused_2: 0,
            },
        );
        Ok((data, [uploaded, written]))
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.bindings, &[]);
        pass.set_vertex_buffer(0, self.vertices.buffer.slice(..));
        pass.draw(0..self.vertices.count, 0..1);
    }
}

/// The corners of all triangles with their normals, three per triangle.
fn vertices(mesh: &TriMesh, shading: Shading) -> Vec<MeshVertex> {
    /// Faces that meet at less than this are one rounded surface.
    const CREASE_RAD: f64 = 40.0 / 180.0 * std::f64::consts::PI;
    let corner = |i: &u32| mesh.vertices.get(*i as usize).copied().filter(|p| p.is_finite());
    let faces: Vec<[DVec3; 3]> =
        mesh.triangles.iter().filter_map(|t| Some([corner(&t[0])?, corner(&t[1])?, corner(&t[2])?])).collect();
    // Twice the area long: large triangles have more say in a shared normal.
    let areas: Vec<DVec3> = faces.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect();
    // By position, not by index: the corners of an STL file are not shared.
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut around: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
    if shading == Shading::Smooth {
        for (f, face) in faces.iter().enumerate() {
            for p in face {
                around.entry(key(*p)).or_default().push(f);
            }
        }
    }
    let mut out = Vec::with_capacity(faces.len() * 3);
    for (face, area) in faces.iter().zip(&areas) {
        let own = area.normalize_or_zero();
        for p in face {
            let neighbors = around.get(&key(*p)).map_or(&[][..], Vec::as_slice);
            let rounded: DVec3 =
                neighbors.iter().map(|&f| areas[f]).filter(|n| n.normalize_or_zero().dot(own) > CREASE_RAD.cos()).sum();
            let normal = rounded.try_normalize().unwrap_or(own);
            out.push(MeshVertex { position: view::position(*p), normal: normal.as_vec3().to_array() });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism of `sides` faces about z, without caps.
    fn tube(sides: u32) -> TriMesh {
        let mut mesh = TriMesh::default();
        for i in 0..sides {
            let a = f64::from(i) / f64::from(sides) * std::f64::consts::TAU;
            for z in [0.0, 1.0] {
                mesh.vertices.push(DVec3::new(a.cos(), a.sin(), z));
            }
            let (p, q) = (2 * i, 2 * ((i + 1) % sides));
            mesh.triangles.extend([[p, q, q + 1], [p, q + 1, p + 1]]);
        }
        mesh
    }

    #[test]
    fn smooth_rounds_a_tube_and_keeps_a_box_sharp() {
        let radial = |v: &MeshVertex| v.normal[0] * v.position[0] + v.normal[1] * v.position[1];
        for v in vertices(&tube(24), Shading::Smooth) {
            // 2 of 3 (or 1 of 3) triangles at a corner belong to one side: a few degrees off the radius.
            assert!(radial(&v) > 0.995);
        }
        for (mesh, shading) in [(tube(4), Shading::Smooth), (tube(24), Shading::Flat)] {
            let v = vertices(&mesh, shading);
            for t in v.chunks(3) {
                assert_eq!(t[0].normal, t[1].normal);
                assert_eq!(t[0].normal, t[2].normal);
            }
        }
    }

    #[test]
    fn bad_triangles_are_left_out() {
        let mut mesh = tube(4);
        mesh.triangles.push([0, 1, 99]);
        mesh.vertices.push(DVec3::NAN);
        mesh.triangles.push([0, 1, 8]);
        mesh.triangles.push([0, 0, 0]);
        let v = vertices(&mesh, Shading::Smooth);
        assert_eq!(v.len(), 9 * 3, "the one without area stays and is invisible");
        assert!(v.iter().flat_map(|v| v.normal).all(f32::is_finite));
    }
}
