// Point clouds as discs that face the eye: six vertices per point, read from a storage buffer.
// Rust twins: gpu::points::{PointVertex, PointsUniform}.

struct PointVertex {
    position: vec3<f32>,
    // Color modes: 0 = a color as rgba8, 1 = the bits of an f32, 2 = unused.
    payload: u32,
}

struct PointsUniform {
    world_from_points: mat4x4<f32>,
    // One color for all (mode 2), and the opacity.
    color: vec4<f32>,
    // Values at the ends of the color map (mode 1).
    lo: f32,
    hi: f32,
    // Disc diameter: pixels, or meters if size_in_meters != 0.
    size: f32,
    size_in_meters: u32,
    color_mode: u32,
    map: u32,
    // Every stride-th point is drawn.
    stride: u32,
}

@group(1) @binding(0) var<uniform> cloud: PointsUniform;
@group(1) @binding(1) var<storage, read> points: array<PointVertex>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) corner: vec2<f32>,
    @location(1) @interpolate(flat) color: vec4<f32>,
    // Pixels.
    @location(2) @interpolate(flat) radius: f32,
    @location(3) @interpolate(flat) to_eye: vec3<f32>,
    // 1 = a bead, 0 = a disc.
    @location(4) @interpolate(flat) bead: u32,
}

@vertex
fn vs_main(@builtin(vertex_index) index: u32) -> Varying {
    var out: Varying;
    out.clip = NOWHERE;
    let vertex = index % 6u;
    let point = points[index / 6u * cloud.stride];
    if is_hidden(point.position) {
        return out;
    }
    let in_world = cloud.world_from_points * vec4<f32>(point.position, 1.0);
    let clip = view.clip_from_world * in_world;
    if clip.w <= 0.0 {
        return out;
    }
    // All is chosen without a branch: where a branch needs uniforms alone, Mesa's software driver compiles the shader anew at
    // every drawing and keeps each copy, 0.4 MB.
    let in_meters = cloud.size * view.px_per_m / clip.w;
    let diameter = select(cloud.size * view.unit_px, in_meters, cloud.size_in_meters != 0u);
    // Below one pixel a disc would vanish between the samples.
    let radius = max(0.5 * diameter, 0.5);
    out.to_eye = towards_eye(in_world.xyz);
    out.corner = quad_corner(vertex);
    out.clip = offset_px(clip, out.corner * radius);
    out.radius = radius;
    let one = cloud.color_mode == 2u;
    out.bead = u32(one & (radius > 1.25));
    let mapped = scalar_color(cloud.map, point.payload, cloud.lo, cloud.hi);
    let own = select(mapped, unpack4x8unorm(point.payload).rgb, cloud.color_mode == 0u);
    out.color = vec4<f32>(select(own, cloud.color.rgb, one), cloud.color.a);
    return out;
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    // Discs of one or two pixels are squares: cutting their corners leaves holes.
    if in.radius > 1.25 && dot(in.corner, in.corner) > 1.0 {
        discard;
    }
    if in.bead != 0u {
        // A color that says nothing but which cloud it is may be shaded: a bead instead of a disc.
        let up = view.up_in_world.xyz;
        let depth = sqrt(max(1.0 - dot(in.corner, in.corner), 0.0));
        let normal = normalize(cross(up, in.to_eye) * in.corner.x + up * in.corner.y + in.to_eye * depth);
        return vec4<f32>(lit(in.color.rgb, 0.4 + 0.6 * light_on(normal), gloss_on(normal, in.to_eye)), in.color.a);
    }
    return in.color;
}
