// What shows the shape of a picture from its depths alone. Eye-dome lighting (Boucheny 2009): what lies behind its neighbors on
// the screen is darkened, so that clouds show their depth. Ambient occlusion: what lies in a hollow is darkened. Both are
// without chance, so that nothing flickers while the view turns. Depths are clip depths; 0 = nothing was drawn there.

// Meters behind a neighbor, per meter of the eye's distance, that darken to 1/e.
const REACH: f32 = 0.012;
// Pixels to the neighbors.
const STEP_PX: f32 = 1.5;
const NEIGHBORS: i32 = 8;

// Sizes of the hollows that are looked for, meters, and the lines through each pixel that they are looked for on.
const HOLLOWS_M: array<f32, 3> = array<f32, 3>(0.0012, 0.0035, 0.009);
const HOLLOWS: i32 = 3;
const LINES: i32 = 4;
// Cosine and sine of the angles between two lines, and between the first lines of two sizes: 45 and 15 degrees.
const TO_NEXT_LINE: vec2<f32> = vec2<f32>(0.70710678, 0.70710678);
const TO_NEXT_SIZE: vec2<f32> = vec2<f32>(0.96592583, 0.25881905);
// Furthest that one looks on the screen, pixels.
const FAR_PX: f32 = 90.0;
// Darkness of a deep hollow.
const DARK: f32 = 1.1;

fn inside(at: vec2<f32>) -> vec2<i32> {
    return clamp(vec2<i32>(at), vec2<i32>(0), vec2<i32>(view.size_px) - 1);
}

// The pixel of neighbor i of a position, within the picture.
fn neighbor(at: vec2<f32>, i: i32) -> vec2<i32> {
    let angle = f32(i) * (6.2831853 / f32(NEIGHBORS));
    return inside(at + STEP_PX * view.unit_px * vec2<f32>(cos(angle), sin(angle)));
}

// Meters that a depth lies behind another; 0 in front of it and of nothing.
fn meters_behind(own: f32, other: f32) -> f32 {
    return select(0.0, max(meters_of(own) - meters_of(other), 0.0), other > 0.0);
}

// A way on the screen, turned by an angle of this cosine and sine.
fn turned(way: vec2<f32>, by: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(way.x * by.x - way.y * by.y, way.x * by.y + way.y * by.x);
}

// Depth of a hollow of a size, so many meters from the eye, between two other depths, as a share of its size. Something far in
// front is no wall of it, and where nothing is the way is open.
fn hollow(m: f32, one: f32, other: f32, size: f32) -> f32 {
    let a = select(-size, clamp(m - meters_of(one), -size, 4.0 * size), one > 0.0);
    let b = select(-size, clamp(m - meters_of(other), -size, 4.0 * size), other > 0.0);
    let wall = max(a, b);
    let near = select(1.0, max(0.0, 1.0 - (wall - size) / (3.0 * size)), wall > size);
    return clamp(0.5 * (a + b) / size, 0.0, 1.0) * near;
}

// Black, as opaque as the sum over all neighbors says; never quite, because a color must stay readable.
fn shade(meters: f32) -> vec4<f32> {
    let light = exp(-meters / (f32(NEIGHBORS) * REACH * view.depth.w));
    return vec4<f32>(0.0, 0.0, 0.0, min(1.0 - light, 0.75));
}

// Black, as opaque as the sum over all hollows says.
fn shade_hollows(hollows: f32) -> vec4<f32> {
    return vec4<f32>(0.0, 0.0, 0.0, 1.0 - exp(-DARK * hollows / f32(HOLLOWS * LINES)));
}

// Who imports it has `depth_at`: the clip depth at a pixel.
@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(quad_corner(vertex), 0.0, 1.0);
}

@fragment
fn fs_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let own = depth_at(vec2<i32>(at.xy));
    if own <= 0.0 {
        discard;
    }
    var behind = 0.0;
    for (var i = 0; i < NEIGHBORS; i++) {
        behind += meters_behind(own, depth_at(neighbor(at.xy, i)));
    }
    return shade(behind);
}

@fragment
fn fs_hollows(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let own = depth_at(vec2<i32>(at.xy));
    if own <= 0.0 {
        discard;
    }
    let m = meters_of(own);
    // In a parallel view all depths have the same scale.
    let px_per_m = px_per_m_at(select(1.0, m, view.depth.z == 0.0));
    var sizes = HOLLOWS_M;
    var hollows = 0.0;
    // Each size has its own directions.
    var first = vec2<f32>(1.0, 0.0);
    for (var j = 0; j < HOLLOWS; j++) {
        let size = sizes[j];
        var way = first * clamp(size * px_per_m, 1.5, FAR_PX * view.unit_px);
        for (var i = 0; i < LINES; i++) {
            hollows += hollow(m, depth_at(inside(at.xy + way)), depth_at(inside(at.xy - way)), size);
            way = turned(way, TO_NEXT_LINE);
        }
        first = turned(first, TO_NEXT_SIZE);
    }
    return shade_hollows(hollows);
}
