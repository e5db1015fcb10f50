// Straight lines of a width in pixels.
#import <common/view.wgsl>

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

// Vertex 0..5 of the line between two clip positions; NOWHERE where all of it is behind the near plane.
fn stroke(a_whole: vec4<f32>, b_whole: vec4<f32>, width_px: f32, vertex: u32) -> vec4<f32> {
    if a_whole.z > a_whole.w && b_whole.z > b_whole.w {
        return NOWHERE;
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
    let half_width = 0.5 * width_px;
    // Square caps: the line is longer by half its width at both ends, so that corners close.
    let px = across * corner.y * half_width + along * corner.x * half_width;
    return offset_px(select(a, b, corner.x > 0.0), px);
}
