// Lit triangle meshes: solid, translucent, or as an x-ray. Rust twins: gpu::mesh::{MeshVertex, MeshUniform}.
#import <common/view.wgsl>
#import <common/color.wgsl>

struct MeshUniform {
    world_from_mesh: mat4x4<f32>,
    // sRGB-encoded color and opacity.
    color: vec4<f32>,
    // 0 = solid, 1 = x-ray (more opaque where the surface turns away from the eye).
    xray: u32,
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
}

@group(1) @binding(0) var<uniform> mesh: MeshUniform;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) in_world: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

@vertex
fn vs_main(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Varying {
    var out: Varying;
    let in_world = mesh.world_from_mesh * vec4<f32>(position, 1.0);
    out.in_world = in_world.xyz;
    out.clip = view.clip_from_world * in_world;
    // Rigid motions only: normals turn like directions.
    out.normal = (mesh.world_from_mesh * vec4<f32>(normal, 0.0)).xyz;
    return out;
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    let to_eye = towards_eye(in.in_world);
    // The side that is seen is lit, whichever way the triangle was wound.
    var normal = normalize(in.normal);
    normal = normal * select(-1.0, 1.0, dot(normal, to_eye) >= 0.0);
    let facing = clamp(dot(normal, to_eye), 0.0, 1.0);
    if mesh.xray != 0u {
        let rim = (1.0 - facing) * (1.0 - facing);
        return vec4<f32>(mesh.color.rgb, mix(mesh.color.a * 0.6, min(mesh.color.a * 2.5, 1.0), rim));
    }
    // A head light and a weaker one from above; the sum stays below 1, so that the color stays itself.
    let light = 0.25 + 0.55 * facing + 0.20 * clamp(dot(normal, view.up_in_world.xyz), 0.0, 1.0);
    return vec4<f32>(srgb_from_linear(linear_from_srgb(mesh.color.rgb) * light), mesh.color.a);
}
