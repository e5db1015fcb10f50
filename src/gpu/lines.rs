//! Line segments of a width in pixels: grids, axes, correspondences.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3};

use super::buffer::Item;
use super::pipelines::Pipelines;
use super::{Gpu, GpuError, view, wgpu};

/// Lines to be shown.
#[derive(Clone, Debug)]
pub struct LinesItem {
    /// Tells line sets of one scene apart and labels their buffers.
    pub name: String,
    /// Must change whenever `segments` change; nothing else makes them go to the device.
    pub revision: u64,
    /// The segments; one with an end that is not finite is left out.
    pub segments: Arc<[Segment]>,
    /// Everything that may change at every frame.
    pub style: LinesStyle,
}

/// A straight line between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Both ends, meters, in the lines' own frame.
    pub ends: [DVec3; 2],
    /// sRGB and opacity.
    pub rgba: [u8; 4],
}

with_defaults! {
    /// Style and pose of lines.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct LinesStyle {
        /// From the lines' frame to the world (the grasp frame).
        pub world_from_lines: DAffine3 = DAffine3::IDENTITY,
        /// Physical pixels.
        pub width_px: f32 = 1.5,
        /// 0..1, on top of each segment's own.
        pub opacity: f32 = 1.0,
        /// Drawn over everything instead of hidden by what is in front.
        pub overlay: bool = false,
    }
}

/// One end of a segment; twin of the struct in `shaders/lines.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct LineVertex {
    pub(super) position: [f32; 3],
    pub(super) color: u32,
}

/// Twin of the struct in `shaders/lines.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct LinesUniform {
    pub(super) world_from_lines: [f32; 16],
    pub(super) width_px: f32,
    pub(super) opacity: f32,
}

/// Lines on the device, by their revision.
pub(super) type LinesData = Item<u64, LinesUniform>;

impl LinesData {
    /// Uploads what changed since `old`. Returns whether lines were uploaded, and whether numbers were.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn update(
        gpu: &Gpu,
        pipelines: &Pipelines,
        old: Option<Self>,
        item: &LinesItem,
    ) -> Result<(Self, [bool; 2]), GpuError> {
        let (on, label) = ((gpu, pipelines), ["Lines", &item.name]);
        let usage = wgpu::BufferUsages::STORAGE;
        let (mut data, uploaded) = Item::upload(on, label, old, item.revision, usage, || vertices(&item.segments))?;
        let written = data.uniform.set(
            gpu,
            LinesUniform {
                world_from_lines: view::matrix(&item.style.world_from_lines),
                width_px: if item.style.width_px.is_finite() { item.style.width_px.max(0.5) } else { 1.0 },
                opacity: item.style.opacity.clamp(0.0, 1.0),
            },
        );
        Ok((data, [uploaded, written]))
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.bindings, &[]);
        pass.draw(0..6 * (self.elements.count / 2), 0..1);
    }
}

/// Both ends of every segment.
fn vertices(segments: &[Segment]) -> Vec<LineVertex> {
    let end =
        |s: &Segment, i: usize| LineVertex { position: view::position(s.ends[i]), color: u32::from_le_bytes(s.rgba) };
    segments.iter().flat_map(|s| [end(s, 0), end(s, 1)]).collect()
}
