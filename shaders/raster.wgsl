// Colored and textured triangles of the window, already in clip space.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) color: vec4<f32>,
}

@vertex
fn vs_main(@location(0) at: vec2<f32>, @location(1) uv: vec2<f32>, @location(2) color: vec4<f32>) -> Corner {
    return Corner(vec4<f32>(at, 0.0, 1.0), uv, color);
}

// Premultiplied, sRGB-encoded: as the window toolkit blends.
@fragment
fn fs_flat(corner: Corner) -> @location(0) vec4<f32> {
    return corner.color;
}

@fragment
fn fs_tinted(corner: Corner) -> @location(0) vec4<f32> {
    return corner.color * textureSample(picture, picture_sampler, corner.uv);
}

struct Spot {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

// One triangle over the whole viewport.
@vertex
fn vs_whole(@builtin(vertex_index) index: u32) -> Spot {
    let uv = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return Spot(vec4<f32>(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0), uv);
}

// Nothing but the texture: software renderers have a way of their own for it.
@fragment
fn fs_copied(spot: Spot) -> @location(0) vec4<f32> {
    return textureSample(picture, picture_sampler, spot.uv);
}
