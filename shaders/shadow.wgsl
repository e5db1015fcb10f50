// The shadow that a mesh throws on the floor, drawn from above, and its blur.

struct Caster {
    world_from_mesh: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> ground: FloorUniform;
@group(1) @binding(0) var<uniform> caster: Caster;
@group(1) @binding(0) var picture: texture_2d<f32>;

@vertex
fn vs_main(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) value: vec2<f32>,
) -> @builtin(position) vec4<f32> {
    let p = (caster.world_from_mesh * vec4<f32>(position, 1.0)).xyz;
    let down = (ground.center.z - p.z) / ground.light.z;
    let on_floor = p + ground.light.xyz * down;
    let at = (on_floor.xy - ground.center.xy) / ground.center.w;
    return vec4<f32>(at, 0.5, 1.0);
}

@fragment
fn fs_main() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0);
}

@vertex
fn vs_blur(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    let right = vertex == 1u || vertex == 2u || vertex == 4u;
    let top = vertex == 2u || vertex == 4u || vertex == 5u;
    return vec4<f32>(select(-1.0, 1.0, right), select(-1.0, 1.0, top), 0.5, 1.0);
}

const BLUR: i32 = 14;
const SIGMA: f32 = 6.0;

fn blurred(at: vec2<f32>, step: vec2<i32>) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(picture)) - 1;
    var sum = 0.0;
    var weights = 0.0;
    for (var i = -BLUR; i <= BLUR; i++) {
        let weight = exp(-f32(i * i) / (2.0 * SIGMA * SIGMA));
        sum += weight * textureLoad(picture, clamp(vec2<i32>(at) + i * step, vec2<i32>(0), last), 0).x;
        weights += weight;
    }
    return vec4<f32>(sum / weights);
}

@fragment
fn fs_across(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return blurred(at.xy, vec2<i32>(1, 0));
}

@fragment
fn fs_down(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return blurred(at.xy, vec2<i32>(0, 1));
}
