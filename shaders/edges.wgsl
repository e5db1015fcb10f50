// The edges of a mesh that a pencil would draw: creases, borders, and where the surface turns away from the eye.
// Rust twins: gpu::edges::{EdgeVertex, EdgesUniform}.
#import <common/view.wgsl>
#import <common/stroke.wgsl>

struct EdgeVertex {
    a: vec3<f32>,
    // 2: a border. 1: a crease. 0: drawn only where one of its faces is seen and the other is not.
    always: u32,
    b: vec3<f32>,
    unused: u32,
    // The normals of its faces.
    normal_a: vec4<f32>,
    normal_b: vec4<f32>,
}

struct EdgesUniform {
    world_from_mesh: mat4x4<f32>,
    // sRGB-encoded color and opacity.
    color: vec4<f32>,
    width_px: f32,
    // Whether creases are drawn, or the silhouette and borders alone.
    creases: u32,
    unused_0: u32,
    unused_1: u32,
}

@group(1) @binding(0) var<uniform> edges: EdgesUniform;
@group(1) @binding(1) var<storage, read> list: array<EdgeVertex>;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> @builtin(position) vec4<f32> {
    let edge = list[instance];
    var a = (edges.world_from_mesh * vec4<f32>(edge.a, 1.0)).xyz;
    var b = (edges.world_from_mesh * vec4<f32>(edge.b, 1.0)).xyz;
    let to_eye = towards_eye(0.5 * (a + b));
    let facing_a = dot((edges.world_from_mesh * vec4<f32>(edge.normal_a.xyz, 0.0)).xyz, to_eye);
    let facing_b = dot((edges.world_from_mesh * vec4<f32>(edge.normal_b.xyz, 0.0)).xyz, to_eye);
    let always = edge.always == 2u || (edge.always == 1u && edges.creases != 0u);
    if !always && facing_a * facing_b > 0.0 {
        return NOWHERE;
    }
    // What the planes leave of it.
    for (var i = 0u; i < view.plane_count; i++) {
        let plane = view.planes[i];
        let da = dot(plane.xyz, a) + plane.w;
        let db = dot(plane.xyz, b) + plane.w;
        if da < 0.0 && db < 0.0 {
            return NOWHERE;
        }
        if da < 0.0 {
            a = mix(a, b, da / (da - db));
        } else if db < 0.0 {
            b = mix(b, a, db / (db - da));
        }
    }
    var clip = stroke(view.clip_from_world * vec4<f32>(a, 1.0), view.clip_from_world * vec4<f32>(b, 1.0), edges.width_px, vertex);
    // A little towards the eye: an edge must not sink into its own faces.
    let nearer = select(0.0005, 0.002 * clip.z, view.depth.z == 0.0);
    clip.z = min(clip.z + nearer, clip.w);
    return clip;
}

// Behind something: faint.
@fragment
fn fs_hidden() -> @location(0) vec4<f32> {
    return vec4<f32>(edges.color.rgb, edges.color.a * 0.3);
}

@fragment
fn fs_main() -> @location(0) vec4<f32> {
    return edges.color;
}
