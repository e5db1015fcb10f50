//! [`MeshVertex`]: what a mesh sends to its pipelines; and what clouds, meshes and edges share.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::wgpu;
use touch2touch_core::colormap::Range;

/// Faces that meet at less than this are one rounded surface.
pub(super) const CREASE_RAD: f64 = 40.0 / 180.0 * std::f64::consts::PI;

/// Tells the places of corners apart: by position, not by index, because the corners of an STL file are not shared.
pub(super) fn place(p: DVec3) -> [u64; 3] {
    (p + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The range for the shaders: an empty or infinite one shows the middle color, as on the CPU.
pub(super) fn drawable(range: Range) -> Range {
    if (range.hi - range.lo).is_finite() { range } else { Range { lo: 0.0, hi: 0.0 } }
}

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
