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

// The way to the ends of line i in a hollow of size j, pixels. Each size has its own directions.
fn ends_px(own: f32, j: i32, i: i32) -> vec2<f32> {
    // In a parallel view all depths have the same scale.
    let w = select(1.0, meters_of(own), view.depth.z == 0.0);
    var sizes = HOLLOWS_M;
    let far = clamp(sizes[j] * px_per_m_at(w), 1.5, FAR_PX * view.unit_px);
    let angle = (f32(i) + f32(j) / f32(HOLLOWS)) * (3.14159265 / f32(LINES));
    return far * vec2<f32>(cos(angle), sin(angle));
}

// Depth of the hollow of size j at a pixel between two others, as a share of its size. Something far in front is no wall of
// it, and where nothing is the way is open.
fn hollow(own: f32, one: f32, other: f32, j: i32) -> f32 {
    var sizes = HOLLOWS_M;
    let size = sizes[j];
    let m = meters_of(own);
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
    var hollows = 0.0;
    for (var j = 0; j < HOLLOWS; j++) {
        for (var i = 0; i < LINES; i++) {
            let way = ends_px(own, j, i);
            hollows += hollow(own, depth_at(inside(at.xy + way)), depth_at(inside(at.xy - way)), j);
        }
    }
    return shade_hollows(hollows);
}
