//! Triangle meshes: the CAD model over the clouds.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3};

use super::buffer::{Elements, Uniform};
use super::edges::{EdgeData, EdgeStyle};
use super::pipelines::Pipelines;
use super::vertex::{CREASE_RAD, MeshVertex, drawable, place};
use super::view::Camera;
use super::{Gpu, GpuError, view, wgpu};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::mesh::TriMesh;

/// A mesh to be shown.
#[derive(Clone, Debug)]
pub struct MeshItem {
    /// Tells meshes of one scene apart and labels their buffers.
    pub name: String,
    /// Must change whenever `mesh` changes; nothing else makes it go to the device.
    pub revision: u64,
    /// Meters, in its own frame. Triangles with a corner that does not exist or is not finite are left out.
    pub mesh: Arc<TriMesh>,
    /// Shading: how normals are made.
    pub shading: Shading,
    /// A value per vertex, shown through [`MeshStyle::map`] and [`MeshStyle::range`] where it is finite; empty for none.
    pub values: Arc<[f32]>,
    /// Everything that may change at every frame.
    pub style: MeshStyle,
}

/// Shading: how normals are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Every triangle by itself.
    Flat,
    /// Rounded over edges of less than 40°, sharp over others.
    #[default]
    Smooth,
    /// Rounded over every edge.
    Round,
}

/// Effect of a mesh on the things behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// Hides them, or tints them where the opacity is below 1.
    #[default]
    Solid,
    /// Lets all of them through; its rim is stronger than its faces.
    XRay,
    /// The nearest layer alone, see-through; thin before something solid.
    Veil,
    /// No faces: [`MeshStyle::edges`] alone, faint where something is in front.
    Outline,
}

/// Style and pose of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshStyle {
    /// From the mesh's frame (the object frame) to the world (the grasp frame). A rigid motion.
    pub world_from_mesh: DAffine3,
    /// sRGB, 0..1.
    pub color: [f32; 3],
    /// 0..1.
    pub opacity: f32,
    /// Solid, x-ray, or edges alone.
    pub look: Look,
    /// Style of its edges, if they are drawn.
    pub edges: Option<EdgeStyle>,
    /// For [`MeshItem::values`].
    pub map: ColorMap,
    /// For [`MeshItem::values`].
    pub range: Range,
    /// True where the surface has an inside: what a plane lays open is then filled.
    pub closed: bool,
}

impl Default for MeshStyle {
    fn default() -> Self {
        Self {
            world_from_mesh: DAffine3::IDENTITY,
            color: [0.75, 0.75, 0.78],
            opacity: 1.0,
            look: Look::Solid,
            edges: None,
            map: ColorMap::Diverging,
            range: Range { lo: 0.0, hi: 1.0 },
            closed: true,
        }
    }
}

/// Twin of the struct in `shaders/mesh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct MeshUniform {
    pub(super) world_from_mesh: [f32; 16],
    pub(super) color: [f32; 4],
    pub(super) xray: u32,
    pub(super) scalar: u32,
    pub(super) lo: f32,
    pub(super) hi: f32,
    pub(super) map: u32,
    pub(super) closed: u32,
    pub(super) unused_0: u32,
    pub(super) unused_1: u32,
}

/// Brightness of a surface, 0..1, for a unit normal towards the eye, with the directions of the camera. Twin of the
/// function in `shaders/common/light.wgsl`.
pub fn light_on(normal: DVec3, camera: &Camera) -> f64 {
    let [_, up, _] = camera.axes();
    let facing = normal.dot(camera.key_light());
    let key = ((facing + 0.2) / 1.2).clamp(0.0, 1.0);
    let above = 0.5 + 0.5 * normal.dot(up);
    0.14 + 0.20 * above * above + 0.62 * key.powf(1.5) + 0.08 * (-facing).clamp(0.0, 1.0)
}

/// White light that a surface mirrors towards the eye, 0..1, linear; `to_eye` is a unit vector. Twin of the function in
/// `shaders/common/light.wgsl`.
pub fn gloss_on(normal: DVec3, to_eye: DVec3, camera: &Camera) -> f64 {
    let halfway = normal.dot((camera.key_light() + to_eye).normalize()).clamp(0.0, 1.0);
    0.03 * halfway.powi(8) + 0.11 * halfway.powi(40)
}

/// A mesh on the device.
#[derive(Debug)]
pub(super) struct MeshData {
    pub(super) uploaded: (u64, Shading),
    vertices: Elements,
    uniform: Uniform<MeshUniform>,
    bindings: wgpu::BindGroup,
    edges: Option<EdgeData>,
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
                let (buffer, uniform, edges) =
                    old.map_or((None, None, None), |d| (Some(d.vertices.buffer), Some(d.uniform), d.edges));
                let corners = vertices(&item.mesh, item.shading, &item.values);
                let vertices = Elements::upload(gpu, &label, &corners, wgpu::BufferUsages::VERTEX, buffer)?;
                let uniform = uniform.unwrap_or_else(|| Uniform::new(gpu, &label));
                let bindings = pipelines.bind(gpu, &label, &uniform.buffer, None);
                (Self { uploaded: wanted, vertices, uniform, bindings, edges }, true)
            }
        };
        let style = &item.style;
        let [r, g, b] = style.color;
        let world_from_mesh = view::matrix(&style.world_from_mesh);
        let range = drawable(style.range);
        let written = data.uniform.set(
            gpu,
            MeshUniform {
                world_from_mesh,
                color: [r, g, b, style.opacity.clamp(0.0, 1.0)],
                xray: u32::from(style.look == Look::XRay),
                scalar: u32::from(!item.values.is_empty()),
                lo: range.lo,
                hi: range.hi,
                map: style.map as u32,
                closed: u32::from(style.closed),
                unused_0: 0,
                unused_1: 0,
            },
        );
        let mut did = [uploaded, written];
        let old = data.edges.take();
        if let Some(edges) = &style.edges {
            let what = (item.name.as_str(), item.revision, &*item.mesh);
            let (edge_data, [list, numbers]) = EdgeData::update(gpu, pipelines, old, what, (world_from_mesh, edges))?;
            data.edges = Some(edge_data);
            did = [did[0] | list, did[1] | numbers];
        }
        Ok((data, did))
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.bindings, &[]);
        pass.set_vertex_buffer(0, self.vertices.buffer.slice(..));
        pass.draw(0..self.vertices.count, 0..1);
    }

    /// Draws its edges with the view bound to group 0.
    pub(super) fn draw_edges(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(edges) = &self.edges {
            edges.draw(pass);
        }
    }
}

/// The corners of all triangles with their normals, three per triangle.
fn vertices(mesh: &TriMesh, shading: Shading, values: &[f32]) -> Vec<MeshVertex> {
    let corner = |i: &u32| mesh.vertices.get(*i as usize).copied().filter(|p| p.is_finite());
    let value = |i: u32| match values.get(i as usize) {
        Some(v) if v.is_finite() => [*v, 1.0],
        _ => [0.0; 2],
    };
    let (faces, values): (Vec<[DVec3; 3]>, Vec<[[f32; 2]; 3]>) = mesh
        .triangles
        .iter()
        .filter_map(|t| Some(([corner(&t[0])?, corner(&t[1])?, corner(&t[2])?], t.map(value))))
        .unzip();
    // Twice the area long: large triangles have more say in a shared normal.
    let areas: Vec<DVec3> = faces.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect();
    let mut around: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
    let crease = match shading {
        Shading::Flat | Shading::Smooth => CREASE_RAD.cos(),
        Shading::Round => -2.0,
    };
    if shading != Shading::Flat {
        for (f, face) in faces.iter().enumerate() {
            for p in face {
                around.entry(place(*p)).or_default().push(f);
            }
        }
    }
    let mut out = Vec::with_capacity(faces.len() * 3);
    for ((face, area), values) in faces.iter().zip(&areas).zip(values) {
        let own = area.normalize_or_zero();
        for (p, value) in face.iter().zip(values) {
            let neighbors = around.get(&place(*p)).map_or(&[][..], Vec::as_slice);
            let rounded: DVec3 =
                neighbors.iter().map(|&f| areas[f]).filter(|n| n.normalize_or_zero().dot(own) > crease).sum();
            let normal = rounded.try_normalize().unwrap_or(own);
            out.push(MeshVertex { position: view::position(*p), normal: normal.as_vec3().to_array(), value });
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
        for v in vertices(&tube(24), Shading::Smooth, &[]) {
            // 2 of 3 (or 1 of 3) triangles at a corner belong to one side: a few degrees off the radius.
            assert!(radial(&v) > 0.995);
        }
        for (mesh, shading) in [(tube(4), Shading::Smooth), (tube(24), Shading::Flat)] {
            let v = vertices(&mesh, shading, &[]);
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
        let v = vertices(&mesh, Shading::Smooth, &[]);
        assert_eq!(v.len(), 9 * 3, "the one without area stays and is invisible");
        assert!(v.iter().flat_map(|v| v.normal).all(f32::is_finite));
    }
}
