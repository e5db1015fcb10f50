//! The edges of a mesh that a pencil would draw: creases, borders, and where the surface turns away from the eye.

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat4, DVec3, DVec4};
use rustc_hash::FxHashMap;

use super::buffer::{Elements, Item};
use super::pipelines::Pipelines;
use super::vertex::{CREASE_RAD, place};
use super::{Gpu, GpuError, view, wgpu};
use touch2touch_core::mesh::TriMesh;

/// Style of the edges of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeStyle {
    /// sRGB, 0..1.
    pub color: [f32; 3],
    /// 0..1.
    pub opacity: f32,
    /// Physical pixels.
    pub width_px: f32,
    /// True where creases are drawn, else the silhouette and borders alone.
    pub creases: bool,
    /// Pixels from the start of a dash to that of the next, to the nearest octave; 0 = whole lines.
    pub dash_px: f32,
}

/// Kinds of edges, [`EdgeVertex::always`].
const SMOOTH: u32 = 0;
const CREASE: u32 = 1;
const BORDER: u32 = 2;

/// Twin of the struct in `shaders/edges.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct EdgeVertex {
    pub(super) a: [f32; 3],
    pub(super) always: u32,
    pub(super) b: [f32; 3],
    pub(super) unused: u32,
    pub(super) normal_a: [f32; 4],
    pub(super) normal_b: [f32; 4],
}

/// Twin of the struct in `shaders/edges.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct EdgesUniform {
    pub(super) world_from_mesh: [f32; 16],
    pub(super) color: [f32; 4],
    pub(super) width_px: f32,
    pub(super) creases: u32,
    pub(super) dash_px: f32,
}

/// The edges of one mesh on the device.
#[derive(Debug)]
pub(super) struct EdgeData {
    /// By the mesh's revision.
    item: Item<u64, EdgesUniform>,
    /// Only where a program draws: of the edges of a mesh it would move all to the screen to show a twentieth.
    seen: Option<Seen>,
}

/// Edges that may be seen.
#[derive(Debug)]
struct Seen {
    all: Vec<EdgeVertex>,
    /// The eye that they are seen from, in the mesh's frame, and whether creases are.
    from: ([f32; 4], bool),
    /// Their vertices.
    vertices: Option<Elements>,
}

impl EdgeData {
    /// Uploads what changed since `old`; `eye` is in the world, as the view has it. Returns whether edges were uploaded, and
    /// whether numbers were.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn update(
        gpu: &Gpu,
        pipelines: &Pipelines,
        old: Option<Self>,
        (name, revision, mesh): (&str, u64, &TriMesh),
        (world_from_mesh, style): (&DAffine3, &EdgeStyle),
        eye: DVec4,
    ) -> Result<(Self, [bool; 2]), GpuError> {
        let (on, label) = ((gpu, pipelines), ["Edges", name]);
        let usage = wgpu::BufferUsages::STORAGE;
        let (old, mut seen) = old.map_or((None, None), |data| (Some(data.item), data.seen));
        let list = || {
            let all = edges(mesh);
            seen = gpu.software.then(|| Seen { all: all.clone(), from: ([f32::NAN; 4], false), vertices: None });
            all
        };
        let (mut item, uploaded) = Item::upload(on, label, old, revision, usage, list)?;
        let [r, g, b] = style.color;
        let written = item.uniform.set(
            gpu,
            EdgesUniform {
                world_from_mesh: view::matrix(world_from_mesh),
                color: [r, g, b, style.opacity.clamp(0.0, 1.0)],
                width_px: if style.width_px.is_finite() { style.width_px.max(0.5) } else { 1.0 },
                creases: u32::from(style.creases),
                dash_px: if style.dash_px.is_finite() { style.dash_px.max(0.0) } else { 0.0 },
            },
        );
        let eye = (DMat4::from(world_from_mesh.inverse()) * eye).as_vec4().to_array();
        if let Some(seen) = seen.as_mut().filter(|seen| seen.from != (eye, style.creases)) {
            let may_be = |(_, edge): &(u32, &EdgeVertex)| may_be_seen(edge, eye, style.creases);
            let vertices: Vec<u32> = (0..).zip(&seen.all).filter(may_be).flat_map(|(i, _)| 6 * i..6 * i + 6).collect();
            let old = seen.vertices.take().map(|old| old.buffer);
            seen.vertices = Some(Elements::upload(gpu, "Edges::seen", &vertices, wgpu::BufferUsages::INDEX, old)?);
            seen.from = (eye, style.creases);
        }
        Ok((Self { item, seen }, [uploaded, written]))
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.item.bindings, &[]);
        // No instances: a program that draws takes each as a drawing of its own.
        match self.seen.as_ref().and_then(|seen| seen.vertices.as_ref()) {
            Some(vertices) => {
                pass.set_index_buffer(vertices.buffer.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..vertices.count, 0, 0..1);
            }
            None => pass.draw(0..6 * self.item.elements.count, 0..1),
        }
    }
}

/// False where the shader would throw an edge away. The rounding of both may differ: then it is left to the shader.
fn may_be_seen(edge: &EdgeVertex, eye: [f32; 4], creases: bool) -> bool {
    let to_eye = |i: usize| eye[i] - 0.5 * (edge.a[i] + edge.b[i]) * eye[3];
    let (x, y, z) = (to_eye(0), to_eye(1), to_eye(2));
    let facing = [edge.normal_a, edge.normal_b].map(|[u, v, w, _]| u * x + v * y + w * z);
    let apart = facing[0] * facing[1] <= 0.0 || facing[0].abs().min(facing[1].abs()) < 1e-5;
    apart || edge.always == BORDER || (edge.always == CREASE && creases)
}

/// Every edge once, with the normals of its faces. Faces with a corner that is not finite are left out.
fn edges(mesh: &TriMesh) -> Vec<EdgeVertex> {
    let corner = |i: &u32| mesh.vertices.get(*i as usize).copied().filter(|p| p.is_finite());
    let mut index_of: FxHashMap<[[u64; 3]; 2], usize> = FxHashMap::default();
    // Each with the normals of its first two faces and the number of all.
    let mut list: Vec<([DVec3; 2], [DVec3; 2], usize)> = Vec::new();
    for t in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = t.map(|i| corner(&i)) else { continue };
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (p, q) = if place(p) <= place(q) { (p, q) } else { (q, p) };
            let index = *index_of.entry([place(p), place(q)]).or_insert_with(|| {
                list.push(([p, q], [normal, -normal], 0));
                list.len() - 1
            });
            let (_, normals, faces) = &mut list[index];
            *faces += 1;
            if *faces == 2 {
                normals[1] = normal;
            }
        }
    }
    let vertex = |([a, b], [first, second], faces): ([DVec3; 2], [DVec3; 2], usize)| {
        let kind = match faces {
            2 if first.dot(second) > CREASE_RAD.cos() => SMOOTH,
            2 => CREASE,
            _ => BORDER,
        };
        EdgeVertex {
            a: view::position(a),
            always: kind,
            b: view::position(b),
            unused: 0,
            normal_a: first.extend(0.0).as_vec4().to_array(),
            normal_b: second.extend(0.0).as_vec4().to_array(),
        }
    };
    list.into_iter().map(vertex).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_may_be_seen_where_one_of_its_faces_is_seen() {
        let roof = |eye, creases| {
            let normal = |x: f32| [x, 0.0, 1.0, 0.0];
            let (a, b) = ([0.0, -1.0, 0.0], [0.0, 1.0, 0.0]);
            let edge = EdgeVertex { a, always: CREASE, b, unused: 0, normal_a: normal(-1.0), normal_b: normal(1.0) };
            may_be_seen(&edge, eye, creases)
        };
        assert!(!roof([0.0, 0.0, 5.0, 1.0], false) && roof([0.0, 0.0, 5.0, 1.0], true));
        assert!(roof([5.0, 0.0, 1.0, 1.0], false) && roof([1.0, 0.0, 0.5, 0.0], false));
        assert!(roof([3.0, 0.0, 3.0, 1.0], false), "just at its border it is left to the shader");
    }

    #[test]
    fn edges_are_found_once_and_told_apart() {
        // Two triangles that meet flat, a third at a right angle.
        let mesh = TriMesh {
            vertices: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.0, 1.0]]
                .map(DVec3::from_array)
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 0, 4], [0, 1, 77]],
        };
        let kinds = |kind: u32| edges(&mesh).iter().filter(|e| e.always == kind).count();
        assert_eq!([kinds(0), kinds(1), kinds(2)], [1, 1, 5]);
        let broken = TriMesh { vertices: vec![DVec3::NAN; 3], triangles: vec![[0, 1, 2]] };
        assert!(edges(&broken).is_empty());
        // The corners of the same triangles, not shared.
        let split = TriMesh {
            vertices: mesh.triangles[..3].iter().flatten().map(|&i| mesh.vertices[i as usize]).collect(),
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]],
        };
        assert_eq!(edges(&split).len(), 7);
    }
}
