//! Point clouds, drawn as discs that face the eye.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3};

use super::buffer::Item;
use super::pipelines::Pipelines;
use super::vertex::drawable;
use super::{Gpu, GpuError, view, wgpu};
use touch2touch_core::colormap::{ColorMap, NAN_COLOR, Range};

/// A cloud to be shown.
#[derive(Clone, Debug)]
pub struct CloudItem {
    /// Tells clouds of one scene apart and labels their buffers.
    pub name: String,
    /// Must change whenever `points` or `colors` change; nothing else makes them go to the device.
    pub revision: u64,
    /// Positions, meters, in the cloud's own frame. One that is not finite is left out; the others keep their index.
    pub points: Arc<[DVec3]>,
    /// Colors.
    pub colors: PointColors,
    /// Everything that may change at every frame.
    pub style: CloudStyle,
}

/// Source of the points' colors.
#[derive(Clone, Debug)]
pub enum PointColors {
    /// [`CloudStyle::color`] for all.
    One,
    /// sRGB per point; a missing one is drawn as NaN.
    PerPoint(Arc<[[u8; 3]]>),
    /// A value per point, shown through [`CloudStyle::map`] and [`CloudStyle::range`]; a missing one is NaN.
    Scalar(Arc<[f32]>),
}

/// The diameter of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointSize {
    /// Physical pixels, at any distance.
    Px(f32),
    /// Meters; at least one pixel.
    Meters(f32),
}

with_defaults! {
    /// Style and pose of a cloud.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CloudStyle {
        /// From the cloud's frame to the world (the grasp frame).
        pub world_from_points: DAffine3 = DAffine3::IDENTITY,
        /// sRGB, 0..1, for [`PointColors::One`].
        pub color: [f32; 3] = [0.2, 0.6, 1.0],
        /// For [`PointColors::Scalar`].
        pub map: ColorMap = ColorMap::Viridis,
        /// For [`PointColors::Scalar`].
        pub range: Range = Range { lo: 0.0, hi: 1.0 },
        /// Diameter.
        pub size: PointSize = PointSize::Px(3.0),
        /// 0..1; below 1 nothing is hidden by the points.
        pub opacity: f32 = 1.0,
    }
}

/// Twin of the struct in `shaders/points.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct PointVertex {
    pub(super) position: [f32; 3],
    pub(super) payload: u32,
}

/// Twin of the struct in `shaders/points.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct PointsUniform {
    pub(super) world_from_points: [f32; 16],
    pub(super) color: [f32; 4],
    pub(super) lo: f32,
    pub(super) hi: f32,
    pub(super) size: f32,
    pub(super) size_in_meters: u32,
    pub(super) color_mode: u32,
    pub(super) map: u32,
    pub(super) stride: u32,
}

/// A cloud on the device.
#[derive(Debug)]
pub(super) struct PointsData {
    /// By revision, color mode and number of points.
    item: Item<(u64, u32, usize), PointsUniform>,
    instances: u32,
}

impl PointsData {
    /// Uploads what changed since `old`. Returns whether points were uploaded, and whether numbers were.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn update(
        gpu: &Gpu,
        pipelines: &Pipelines,
        old: Option<Self>,
        item: &CloudItem,
        stride: u32,
    ) -> Result<(Self, [bool; 2]), GpuError> {
        let wanted = (item.revision, color_mode(&item.colors), item.points.len());
        let (on, label) = ((gpu, pipelines), ["Points", &item.name]);
        let (old, usage) = (old.map(|data| data.item), wgpu::BufferUsages::STORAGE);
        let (mut data, uploaded) = Item::upload(on, label, old, wanted, usage, || vertices(item))?;
        let stride = stride.max(1);
        let instances = data.elements.count.div_ceil(stride);
        let written = data.uniform.set(gpu, uniform(&item.style, wanted.1, stride));
        Ok((Self { item: data, instances }, [uploaded, written]))
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.item.bindings, &[]);
        pass.draw(0..6 * self.instances, 0..1);
    }
}

/// The number of the mode in the shader.
fn color_mode(colors: &PointColors) -> u32 {
    match colors {
        PointColors::PerPoint(_) => 0,
        PointColors::Scalar(_) => 1,
        PointColors::One => 2,
    }
}

/// The points as the shader reads them.
fn vertices(item: &CloudItem) -> Vec<PointVertex> {
    let nan = NAN_COLOR.map(|c| (c * 255.0 + 0.5) as u8);
    let payload = |i: usize| match &item.colors {
        PointColors::One => 0,
        PointColors::PerPoint(colors) => {
            let [r, g, b] = colors.get(i).copied().unwrap_or(nan);
            u32::from_le_bytes([r, g, b, 255])
        }
        PointColors::Scalar(values) => values.get(i).copied().unwrap_or(f32::NAN).to_bits(),
    };
    let vertex = |(i, p): (usize, &DVec3)| PointVertex { position: view::position(*p), payload: payload(i) };
    item.points.iter().enumerate().map(vertex).collect()
}

/// The numbers that go with a cloud.
fn uniform(style: &CloudStyle, color_mode: u32, stride: u32) -> PointsUniform {
    let (size, size_in_meters) = match style.size {
        PointSize::Px(px) => (px, 0),
        PointSize::Meters(m) => (m, 1),
    };
    let [r, g, b] = style.color;
    let range = drawable(style.range);
    PointsUniform {
        world_from_points: view::matrix(&style.world_from_points),
        color: [r, g, b, style.opacity.clamp(0.0, 1.0)],
        lo: range.lo,
        hi: range.hi,
        size: if size.is_finite() { size } else { 1.0 },
        size_in_meters,
        color_mode,
        map: style.map as u32,
        stride,
    }
}
