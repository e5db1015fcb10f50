// Lit triangle meshes: solid, translucent, a veil, or as an x-ray. Rust twins: gpu::mesh::{MeshVertex, MeshUniform}.

// The share of its opacity that a veil keeps before something solid.
const VEIL_THIN: f32 = 0.14;

struct MeshUniform {
    world_from_mesh: mat4x4<f32>,
    // sRGB-encoded color and opacity.
    color: vec4<f32>,
    // 0 = solid, 1 = x-ray (more opaque where the surface turns away from the eye).
    xray: u32,
    // 1 = where a corner has a value, the color map shows it.
    scalar: u32,
    // Values at the ends of the color map.
    lo: f32,
    hi: f32,
    map: u32,
}

@group(1) @binding(0) var<uniform> mesh: MeshUniform;

struct Varying {
    // Two pipelines must find the same depth.
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) in_world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    // The value, and whether there is one (1) or not (0).
    @location(2) value: vec2<f32>,
}

@vertex
fn vs_main(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) value: vec2<f32>,
) -> Varying {
    var out: Varying;
    let in_world = mesh.world_from_mesh * vec4<f32>(position, 1.0);
    out.in_world = in_world.xyz;
    out.clip = view.clip_from_world * in_world;
    // Rigid motions only: normals turn like directions.
    out.normal = (mesh.world_from_mesh * vec4<f32>(normal, 0.0)).xyz;
    out.value = value;
    return out;
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    let to_eye = towards_eye(in.in_world);
    // The side that is seen is lit, whichever way the triangle was wound.
    var normal = normalize(in.normal);
    normal = normal * select(-1.0, 1.0, dot(normal, to_eye) >= 0.0);
    if mesh.xray != 0u {
        let facing = clamp(dot(normal, to_eye), 0.0, 1.0);
        let rim = (1.0 - facing) * (1.0 - facing);
        return vec4<f32>(mesh.color.rgb, mix(mesh.color.a * 0.6, min(mesh.color.a * 2.5, 1.0), rim));
    }
    var color = mesh.color.rgb;
    var light = light_on(normal);
    var gloss = gloss_on(normal, to_eye);
    if mesh.scalar != 0u {
        let mapped = scalar_color(mesh.map, bitcast<u32>(in.value.x / max(in.value.y, 1.0e-3)), mesh.lo, mesh.hi);
        color = mix(color, mapped, in.value.y);
        // A color that is to be read must not be taken for a darker or a paler one of its map.
        light = mix(light, 0.5 + 0.5 * light, in.value.y);
        gloss = gloss * (1.0 - in.value.y);
    }
    return vec4<f32>(lit(color, light, gloss), mesh.color.a);
}

// A veil: lit on both sides, more opaque where it turns away from the eye.
fn veil(in: Varying) -> vec4<f32> {
    let to_eye = towards_eye(in.in_world);
    var normal = normalize(in.normal);
    normal = normal * select(-1.0, 1.0, dot(normal, to_eye) >= 0.0);
    let away = 1.0 - clamp(dot(normal, to_eye), 0.0, 1.0);
    let alpha = mix(mesh.color.a, min(mesh.color.a * 1.7, 1.0), away * away);
    return vec4<f32>(lit(mesh.color.rgb, 0.3 + 0.7 * light_on(normal), 0.7 * gloss_on(normal, to_eye)), alpha);
}

@fragment
fn fs_veil(in: Varying) -> @location(0) vec4<f32> {
    return veil(in);
}

// Before something solid, which is what one looks at.
@fragment
fn fs_veil_thin(in: Varying) -> @location(0) vec4<f32> {
    let color = veil(in);
    return vec4<f32>(color.rgb, color.a * VEIL_THIN);
}

// Depth alone: what the nearest layer of a veil is.
@fragment
fn fs_depth(in: Varying) -> @location(0) vec4<f32> {
    return vec4<f32>(0.0);
}
