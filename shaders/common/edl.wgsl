// Eye-dome lighting (Boucheny 2009): what lies behind its neighbors on the screen is darkened, so that clouds show their
// depth. Depths are clip depths; 0 = nothing was drawn there.
#import <common/view.wgsl>

// Meters behind a neighbor, per meter of the eye's distance, that darken to 1/e.
const REACH: f32 = 0.012;
// Pixels to the neighbors.
const STEP_PX: f32 = 1.5;
const NEIGHBORS: i32 = 8;

// The pixel of neighbor i of a position, within the picture.
fn neighbor(at: vec2<f32>, i: i32) -> vec2<i32> {
    let angle = f32(i) * (6.2831853 / f32(NEIGHBORS));
    let last = vec2<i32>(view.size_px) - 1;
    return clamp(vec2<i32>(at + STEP_PX * vec2<f32>(cos(angle), sin(angle))), vec2<i32>(0), last);
}

// Meters that a depth lies behind another; 0 in front of it and of nothing.
fn meters_behind(own: f32, other: f32) -> f32 {
    return select(0.0, max(meters_of(own) - meters_of(other), 0.0), other > 0.0);
}

// Black, as opaque as the sum over all neighbors says; never quite, because a color must stay readable.
fn shade(meters: f32) -> vec4<f32> {
    let light = exp(-meters / (f32(NEIGHBORS) * REACH * view.depth.w));
    return vec4<f32>(0.0, 0.0, 0.0, min(1.0 - light, 0.75));
}
