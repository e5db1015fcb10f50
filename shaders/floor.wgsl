// The floor: a disc that fades towards its rim, with the soft shadow of what stands over it.

@group(1) @binding(0) var<uniform> ground: FloorUniform;
@group(1) @binding(1) var shadow: texture_2d<f32>;
@group(1) @binding(2) var shadow_sampler: sampler;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    // -1..1 across the floor.
    @location(0) at: vec2<f32>,
    @location(1) in_world: vec3<f32>,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Varying {
    var out: Varying;
    out.at = quad_corner(vertex);
    out.in_world = vec3<f32>(ground.center.xy + out.at * ground.center.w, ground.center.z);
    out.clip = view.clip_from_world * vec4<f32>(out.in_world, 1.0);
    return out;
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    let thrown = textureSample(shadow, shadow_sampler, vec2<f32>(0.5 + 0.5 * in.at.x, 0.5 - 0.5 * in.at.y)).x;
    // From below one looks through it: down is +z.
    if towards_eye(in.in_world).z > 0.0 {
        discard;
    }
    let fade = smoothstep(1.0, 0.25, length(in.at));
    let light = ground.color.a * fade;
    let dark = ground.shadow * thrown * smoothstep(1.0, 0.8, length(in.at));
    // Black over the floor's color, as one layer.
    let alpha = dark + light * (1.0 - dark);
    return vec4<f32>(ground.color.rgb * (light * (1.0 - dark) / max(alpha, 1.0e-4)), alpha);
}
