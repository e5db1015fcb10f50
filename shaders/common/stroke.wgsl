// Straight lines of a width in pixels, with soft rims: they stay smooth with one sample per pixel.

struct Stroke {
    clip: vec4<f32>,
    // Pixels from the middle of the line, times clip w, and clip w: their ratio is even on the screen.
    off_px: vec2<f32>,
    // Where on the line: 0 at its start, 1 at its end.
    along: f32,
}

// The share of a-b that lies behind the near plane, seen from a: 0, or where the line meets the plane.
// In front means clip z <= clip w, because depth is reversed.
fn near_share(a: vec4<f32>, b: vec4<f32>) -> f32 {
    let da = a.w - a.z;
    let db = b.w - b.z;
    if da >= 0.0 || db <= da {
        return 0.0;
    }
    return clamp(-da / (db - da), 0.0, 1.0);
}

// Vertex 0..5 of the line between two clip positions; NOWHERE where all of it is behind the near plane.
fn stroke(a_whole: vec4<f32>, b_whole: vec4<f32>, width_px: f32, vertex: u32) -> Stroke {
    if a_whole.z > a_whole.w && b_whole.z > b_whole.w {
        return Stroke(NOWHERE, vec2<f32>(0.0, 1.0), 0.0);
    }
    let from_a = near_share(a_whole, b_whole);
    let to_b = 1.0 - near_share(b_whole, a_whole);
    let a = mix(a_whole, b_whole, from_a);
    let b = mix(a_whole, b_whole, to_b);
    let a_px = a.xy / a.w * view.size_px * 0.5;
    let b_px = b.xy / b.w * view.size_px * 0.5;
    var along = b_px - a_px;
    let len = length(along);
    along = select(vec2<f32>(1.0, 0.0), along / len, len > 1.0e-6);
    let across = vec2<f32>(-along.y, along.x);
    let corner = quad_corner(vertex);
    // Half a pixel more for the rim.
    let half_width = 0.5 * width_px * view.unit_px + 0.5;
    // Square caps: the line is longer by half its width at both ends, so that corners close.
    let px = across * corner.y * half_width + along * corner.x * half_width;
    let at_b = corner.x > 0.0;
    let clip = offset_px(select(a, b, at_b), px);
    return Stroke(clip, vec2<f32>(corner.y * half_width, 1.0) * clip.w, select(from_a, to_b, at_b));
}

// How much of a pixel a line covers, so far from its middle.
fn stroke_cover(off_px: vec2<f32>, width_px: f32) -> f32 {
    return clamp(0.5 * width_px * view.unit_px + 0.5 - abs(off_px.x / off_px.y), 0.0, 1.0);
}
