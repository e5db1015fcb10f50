//! [`MeshVertex`]: what a mesh sends to its pipelines; and when an edge is sharp.

use bytemuck::{Pod, Zeroable};

use super::wgpu;

/// Faces that meet at less than this are one rounded surface.
pub(super) const CREASE_RAD: f64 = 40.0 / 180.0 * std::f64::consts::PI;

/// One corner of one triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct MeshVertex {
    pub(super) position: [f32; 3],
    pub(super) normal: [f32; 3],
    /// The value of the corner, and whether it has one (1 or 0).
    pub(super) value: [f32; 2],
}

/// [`MeshVertex`] as the inputs of `shaders/mesh.wgsl`.
pub(super) const VERTEX_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<MeshVertex>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2],
};
