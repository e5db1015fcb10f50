//! The shaders of `shaders/`, embedded: each is the text of its parts, one after the other.

use super::{Gpu, GpuError, wgpu};

/// Joins files of `shaders/`.
macro_rules! shader {
    ($($part:literal),+) => { concat!($(include_str!(concat!("../../shaders/", $part))),+) };
}

pub(super) const EDGES: &str = shader!("common/view.wgsl", "common/stroke.wgsl", "edges.wgsl");
pub(super) const EDL_MANY: &str = shader!("common/view.wgsl", "common/edl.wgsl", "edl_many.wgsl");
pub(super) const EDL_ONE: &str = shader!("common/view.wgsl", "common/edl.wgsl", "edl_one.wgsl");
pub(super) const FLOOR: &str = shader!("common/view.wgsl", "common/floor.wgsl", "floor.wgsl");
pub(super) const LINES: &str = shader!("common/view.wgsl", "common/stroke.wgsl", "lines.wgsl");
pub(super) const MESH: &str = shader!("common/view.wgsl", "common/color.wgsl", "common/light.wgsl", "mesh.wgsl");
pub(super) const POINTS: &str = shader!("common/view.wgsl", "common/color.wgsl", "common/light.wgsl", "points.wgsl");
pub(super) const SHADOW: &str = shader!("common/floor.wgsl", "shadow.wgsl");
pub(super) const RASTER: &str = shader!("raster.wgsl");

/// Compiles a shader for the device.
///
/// # Errors
/// [`GpuError::Device`] where the text is wrong or the driver refuses it.
pub(super) fn compile(gpu: &Gpu, label: &str, text: &str) -> Result<wgpu::ShaderModule, GpuError> {
    gpu.guarded(label, || {
        let source = wgpu::ShaderSource::Wgsl(text.into());
        Ok(gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{offset_of, size_of};
    use wgpu::naga;

    fn validated(text: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        let flags = naga::valid::ValidationFlags::all();
        naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        module
    }

    #[test]
    fn every_shader_is_valid() {
        for text in [EDGES, EDL_MANY, EDL_ONE, FLOOR, LINES, MESH, POINTS, SHADOW, RASTER] {
            validated(text);
        }
    }

    /// The members (name, offset) and the size of a struct, as the shader compiler lays it out.
    fn layout(text: &str, name: &str) -> (Vec<(String, usize)>, usize) {
        let module = validated(text);
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
        let members = members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect();
        (members, *span as usize)
    }

    /// Compares a Rust struct with the WGSL struct of the same name: every member, every offset, the size up to padding.
    macro_rules! check_layout {
        ($text:expr, $module:ident :: $name:ident { $($field:ident),* $(,)? }) => {{
            use crate::gpu::$module::$name;
            let rust = vec![$((stringify!($field).to_owned(), offset_of!($name, $field))),*];
            assert_eq!(layout($text, stringify!($name)), (rust, size_of::<$name>().next_multiple_of(16)), stringify!($name));
        }};
    }

    #[test]
    fn rust_and_wgsl_structs_have_the_same_layout() {
        check_layout!(
            MESH,
            view::ViewUniform {
                clip_from_world,
                eye_in_world,
                up_in_world,
                key_in_world,
                depth,
                size_px,
                px_per_m,
                unit_px,
            }
        );
        check_layout!(FLOOR, floor::FloorUniform { color, center, light, shadow });
        check_layout!(POINTS, points::PointVertex { position, payload });
        check_layout!(
            POINTS,
            points::PointsUniform { world_from_points, color, lo, hi, size, size_in_meters, color_mode, map, stride }
        );
        check_layout!(MESH, mesh::MeshUniform { world_from_mesh, color, xray, scalar, lo, hi, map });
        check_layout!(EDGES, edges::EdgeVertex { a, always, b, unused, normal_a, normal_b });
        check_layout!(EDGES, edges::EdgesUniform { world_from_mesh, color, width_px, creases, dash_px });
        check_layout!(LINES, lines::LineVertex { position, color });
        check_layout!(LINES, lines::LinesUniform { world_from_lines, width_px, opacity });
    }
}
