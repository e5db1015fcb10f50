//! Triangle meshes: the CAD model over the clouds.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, DVec4};
use rustc_hash::FxHashMap;

use super::buffer::{Elements, Item};
use super::edges::{EdgeData, EdgeStyle};
use super::pipelines::Pipelines;
use super::vertex::{CREASE_RAD, MeshVertex, drawable, place};
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

with_defaults! {
    /// Style and pose of a mesh.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MeshStyle {
        /// From the mesh's frame (the object frame) to the world (the grasp frame). A rigid motion.
        pub world_from_mesh: DAffine3 = DAffine3::IDENTITY,
        /// sRGB, 0..1.
        pub color: [f32; 3] = [0.75, 0.75, 0.78],
        /// 0..1.
        pub opacity: f32 = 1.0,
        /// Solid, x-ray, or edges alone.
        pub look: Look = Look::Solid,
        /// Style of its edges, if they are drawn.
        pub edges: Option<EdgeStyle> = None,
        /// For [`MeshItem::values`].
        pub map: ColorMap = ColorMap::Diverging,
        /// For [`MeshItem::values`].
        pub range: Range = Range { lo: 0.0, hi: 1.0 },
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
}

/// A mesh on the device.
#[derive(Debug)]
pub(super) struct MeshData {
    /// By revision.
    item: Item<(u64, Shading), MeshUniform>,
    /// The corners of its triangles among the vertices.
    corners: Elements,
    edges: Option<EdgeData>,
}

impl MeshData {
    /// Uploads what changed since `old`; `eye` is in the world, as the view has it. Returns whether vertices were uploaded, and whether numbers were.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn update(
        gpu: &Gpu,
        pipelines: &Pipelines,
        old: Option<Self>,
        item: &MeshItem,
        eye: DVec4,
    ) -> Result<(Self, [bool; 2]), GpuError> {
        let wanted = (item.revision, item.shading);
        let (old, old_edges, mut corners) =
            old.map_or((None, None, None), |data| (Some(data.item), data.edges, Some(data.corners)));
        let (on, label) = ((gpu, pipelines), ["Mesh", &item.name]);
        let mut order = Vec::new();
        let distinct = || {
            let (vertices, corners) = shared(&vertices(&item.mesh, item.shading, &item.values));
            order = corners;
            vertices
        };
        let (mut data, uploaded) = Item::upload(on, label, old, wanted, wgpu::BufferUsages::VERTEX, distinct)?;
        let corners = match corners.take_if(|_| !uploaded) {
            Some(corners) => corners,
            None => {
                let old = corners.map(|old| old.buffer);
                Elements::upload(gpu, "Mesh::corners", &order, wgpu::BufferUsages::INDEX, old)?
            }
        };
        let style = &item.style;
        let [r, g, b] = style.color;
        let range = drawable(style.range);
        let written = data.uniform.set(
            gpu,
            MeshUniform {
                world_from_mesh: view::matrix(&style.world_from_mesh),
                color: [r, g, b, style.opacity.clamp(0.0, 1.0)],
                xray: u32::from(style.look == Look::XRay),
                scalar: u32::from(!item.values.is_empty()),
                lo: range.lo,
                hi: range.hi,
                map: style.map as u32,
            },
        );
        let mut did = [uploaded, written];
        let mut edges = None;
        if let Some(style) = &style.edges {
            let what = (item.name.as_str(), item.revision, &*item.mesh);
            let how = (&item.style.world_from_mesh, style);
            let (data, [list, numbers]) = EdgeData::update(gpu, pipelines, old_edges, what, how, eye)?;
            edges = Some(data);
            did = [did[0] | list, did[1] | numbers];
        }
        Ok((Self { item: data, corners, edges }, did))
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.item.bindings, &[]);
        pass.set_vertex_buffer(0, self.item.elements.buffer.slice(..));
        pass.set_index_buffer(self.corners.buffer.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.corners.count, 0, 0..1);
    }

    /// Draws its edges with the view bound to group 0.
    pub(super) fn draw_edges(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(edges) = &self.edges {
            edges.draw(pass);
        }
    }
}

/// The distinct ones of some vertices, and the place of each among them: a smooth surface has a sixth as many as corners, and
/// each is moved to the screen once.
fn shared(corners: &[MeshVertex]) -> (Vec<MeshVertex>, Vec<u32>) {
    let (mut distinct, mut place_of) = (Vec::new(), FxHashMap::default());
    let place = |vertex: &MeshVertex| {
        *place_of.entry(bytemuck::cast::<_, [u32; 8]>(*vertex)).or_insert_with(|| {
            distinct.push(*vertex);
            distinct.len() as u32 - 1
        })
    };
    let order = corners.iter().map(place).collect();
    (distinct, order)
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
    let normals: Vec<DVec3> = areas.iter().map(|area| area.normalize_or_zero()).collect();
    let mut around: FxHashMap<[u64; 3], Vec<usize>> = FxHashMap::default();
    let crease = if shading == Shading::Round { -2.0 } else { CREASE_RAD.cos() };
    for (f, face) in faces.iter().enumerate() {
        for p in face {
            around.entry(place(*p)).or_default().push(f);
        }
    }
    let mut out = Vec::with_capacity(faces.len() * 3);
    for ((face, &own), values) in faces.iter().zip(&normals).zip(values) {
        for (p, value) in face.iter().zip(values) {
            let neighbors = around.get(&place(*p)).map_or(&[][..], Vec::as_slice);
            let rounded: DVec3 = neighbors.iter().filter(|&&f| normals[f].dot(own) > crease).map(|&f| areas[f]).sum();
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
        for t in vertices(&tube(4), Shading::Smooth, &[]).chunks(3) {
            assert_eq!(t[0].normal, t[1].normal);
            assert_eq!(t[0].normal, t[2].normal);
        }
    }

    #[test]
    fn corners_that_are_alike_are_one_vertex() {
        let corners = vertices(&tube(24), Shading::Smooth, &[]);
        let (distinct, order) = shared(&corners);
        assert_eq!((distinct.len(), order.len()), (24 * 2, 24 * 6));
        assert!(order.iter().zip(&corners).all(|(at, corner)| distinct[*at as usize] == *corner));
        assert_eq!(shared(&vertices(&tube(4), Shading::Smooth, &[])).0.len(), 4 * 4);
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
