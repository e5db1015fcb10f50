// Group 0: the camera, the same for every shader. Rust twin: gpu::view::ViewUniform.
//
// World = the grasp frame: x = closing axis of the gripper, +z = the direction the tool points,
// y = lateral, right-handed, meters. Clip depth is reversed: 1 at the near plane, 0 far away.
struct ViewUniform {
    clip_from_world: mat4x4<f32>,
    // xyz, w = 1: where the eye is (perspective). xyz, w = 0: the direction towards it (orthographic).
    eye_in_world: vec4<f32>,
    // Towards the top of the screen; soft light comes from there.
    up_in_world: vec4<f32>,
    // Towards the key light: above the eye, to its left.
    key_in_world: vec4<f32>,
    // How clip depth becomes meters in front of the eye, see meters_of.
    depth: vec4<f32>,
    size_px: vec2<f32>,
    // Pixels per meter where clip w = 1; divide by clip w for any other place.
    px_per_m: f32,
    // Pixels that stand for one pixel of a screen: a still of four times the size has lines of four times the width.
    unit_px: f32,
}

@group(0) @binding(0) var<uniform> view: ViewUniform;

// A clip position outside every frustum: throws the primitive away.
const NOWHERE: vec4<f32> = vec4<f32>(2.0, 2.0, 2.0, 1.0);

// Rust writes this into the x of a point that is not finite (gpu::view::HIDDEN); nothing real is that far away.
const HIDDEN_BEYOND: f32 = 1.0e30;

fn is_hidden(p: vec3<f32>) -> bool {
    return abs(p.x) > HIDDEN_BEYOND;
}

// Moves a clip position by pixels (x right, y up).
fn offset_px(clip: vec4<f32>, px: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(clip.xy + px * 2.0 / view.size_px * clip.w, clip.zw);
}

// Pixels between two points that are a meter apart across the line of sight, at a clip w.
fn px_per_m_at(w: f32) -> f32 {
    return view.px_per_m / max(w, 1.0e-9);
}

// The unit vector from a point towards the eye.
fn towards_eye(p_in_world: vec3<f32>) -> vec3<f32> {
    return normalize(view.eye_in_world.xyz - p_in_world * view.eye_in_world.w);
}

// Meters in front of the eye of a clip depth. Perspective (depth.z = 0): depth.x / z. Orthographic: depth.x - depth.y z.
fn meters_of(z: f32) -> f32 {
    return select(depth_parallel(z), view.depth.x / max(z, 1.0e-9), view.depth.z == 0.0);
}

fn depth_parallel(z: f32) -> f32 {
    return view.depth.x - view.depth.y * z;
}

// Two triangles that cover -1..1, vertex 0..5.
fn quad_corner(vertex: u32) -> vec2<f32> {
    let right = vertex == 1u || vertex == 2u || vertex == 4u;
    let top = vertex == 2u || vertex == 4u || vertex == 5u;
    return vec2<f32>(select(-1.0, 1.0, right), select(-1.0, 1.0, top));
}
