// Lines of a width in pixels: six vertices per segment, read from a storage buffer.
// Rust twins: gpu::lines::{LineVertex, LinesUniform}.
#import <common/view.wgsl>

struct LineVertex {
    position: vec3<f32>,
    // rgba8, sRGB-encoded.
    color: u32,
}

struct LinesUniform {
    world_from_lines: mat4x4<f32>,
    width_px: f32,
    opacity: f32,
    unused_0: f32,
    unused_1: f32,
}

@group(1) @binding(0) var<uniform> lines: LinesUniform;
@group(1) @binding(1) var<storage, read> ends: array<LineVertex>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec4<f32>,
}

// The part of a-b in front of the near plane, seen from a: a itself, or where the line meets the plane.
// In front means clip z <= clip w, because depth is reversed.
fn cut_near(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    let da = a.w - a.z;
    let db = b.w - b.z;
    if da >= 0.0 || db <= da {
        return a;
    }
    return mix(a, b, clamp(-da / (db - da), 0.0, 1.0));
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32, @builtin(instance_index) segment: u32) -> Varying {
    var out: Varying;
    out.clip = NOWHERE;
    let from_end = ends[2u * segment];
    let to_end = ends[2u * segment + 1u];
    if is_hidden(from_end.position) || is_hidden(to_end.position) {
        return out;
    }
    let clip_from_lines = view.clip_from_world * lines.world_from_lines;
    let a_whole = clip_from_lines * vec4<f32>(from_end.position, 1.0);
    let b_whole = clip_from_lines * vec4<f32>(to_end.position, 1.0);
    if a_whole.z > a_whole.w && b_whole.z > b_whole.w {
        return out;
    }
    let a = cut_near(a_whole, b_whole);
    let b = cut_near(b_whole, a_whole);
    let a_px = a.xy / a.w * view.size_px * 0.5;
    let b_px = b.xy / b.w * view.size_px * 0.5;
    var along = b_px - a_px;
    let len = length(along);
    along = select(vec2<f32>(1.0, 0.0), along / len, len > 1.0e-6);
    let across = vec2<f32>(-along.y, along.x);
    let corner = quad_corner(vertex);
    let at_b = corner.x > 0.0;
    let half_width = 0.5 * lines.width_px;
    // Square caps: the line is longer by half its width at both ends, so that corners close.
    let px = across * corner.y * half_width + along * corner.x * half_width;
    out.clip = offset_px(select(a, b, at_b), px);
    out.color = unpack4x8unorm(select(from_end.color, to_end.color, at_b));
    out.color.a = out.color.a * lines.opacity;
    return out;
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    return in.color;
}
