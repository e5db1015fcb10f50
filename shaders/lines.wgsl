// Lines of a width in pixels: six vertices per segment, read from a storage buffer.
// Rust twins: gpu::lines::{LineVertex, LinesUniform}.

struct LineVertex {
    position: vec3<f32>,
    // rgba8, sRGB-encoded.
    color: u32,
}

struct LinesUniform {
    world_from_lines: mat4x4<f32>,
    width_px: f32,
    opacity: f32,
}

@group(1) @binding(0) var<uniform> lines: LinesUniform;
@group(1) @binding(1) var<storage, read> ends: array<LineVertex>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec4<f32>,
    @location(1) off_px: vec2<f32>,
}

@vertex
fn vs_main(@builtin(vertex_index) index: u32) -> Varying {
    var out: Varying;
    out.clip = NOWHERE;
    let vertex = index % 6u;
    let segment = index / 6u;
    let from_end = ends[2u * segment];
    let to_end = ends[2u * segment + 1u];
    if is_hidden(from_end.position) || is_hidden(to_end.position) {
        return out;
    }
    let clip_from_lines = view.clip_from_world * lines.world_from_lines;
    let a = clip_from_lines * vec4<f32>(from_end.position, 1.0);
    let b = clip_from_lines * vec4<f32>(to_end.position, 1.0);
    let line = stroke(a, b, lines.width_px, vertex);
    out.clip = line.clip;
    out.off_px = line.off_px;
    let at_b = quad_corner(vertex).x > 0.0;
    out.color = unpack4x8unorm(select(from_end.color, to_end.color, at_b));
    out.color.a = out.color.a * lines.opacity;
    return out;
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    return vec4<f32>(in.color.rgb, in.color.a * stroke_cover(in.off_px, lines.width_px));
}
