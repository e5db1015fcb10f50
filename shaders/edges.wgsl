// The edges of a mesh that a pencil would draw: creases, borders, and where the surface turns away from the eye.
// Rust twins: gpu::edges::{EdgeVertex, EdgesUniform}.

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
    // Pixels from the start of a dash to that of the next; 0 = a whole line.
    dash_px: f32,
}

@group(1) @binding(0) var<uniform> edges: EdgesUniform;
@group(1) @binding(1) var<storage, read> list: array<EdgeVertex>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) off_px: vec2<f32>,
    // Dashes since the middle of the mesh.
    @location(1) dashes: f32,
}

@vertex
fn vs_main(@builtin(vertex_index) index: u32) -> Varying {
    var out: Varying;
    out.clip = NOWHERE;
    let vertex = index % 6u;
    let edge = list[index / 6u];
    let a = (edges.world_from_mesh * vec4<f32>(edge.a, 1.0)).xyz;
    let b = (edges.world_from_mesh * vec4<f32>(edge.b, 1.0)).xyz;
    let to_eye = towards_eye(0.5 * (a + b));
    let facing_a = dot((edges.world_from_mesh * vec4<f32>(edge.normal_a.xyz, 0.0)).xyz, to_eye);
    let facing_b = dot((edges.world_from_mesh * vec4<f32>(edge.normal_b.xyz, 0.0)).xyz, to_eye);
    let always = edge.always == 2u || (edge.always == 1u && edges.creases != 0u);
    if !always && facing_a * facing_b > 0.0 {
        return out;
    }
    let clip_a = view.clip_from_world * vec4<f32>(a, 1.0);
    let clip_b = view.clip_from_world * vec4<f32>(b, 1.0);
    let line = stroke(clip_a, clip_b, edges.width_px, vertex);
    out.clip = line.clip;
    // A little towards the eye: an edge must not sink into its own faces.
    let nearer = select(0.0005, 0.002 * out.clip.z, view.depth.z == 0.0);
    out.clip.z = min(out.clip.z + nearer, out.clip.w);
    out.off_px = line.off_px;
    out.dashes = dashes(a, b, line.along);
    return out;
}

// Dashes up to a place on an edge. They are laid out on the edge itself, from the foot of the mesh's origin, so that edges
// in one line go on and nothing creeps while the view turns; their length changes by octaves.
fn dashes(a: vec3<f32>, b: vec3<f32>, along: f32) -> f32 {
    let origin = edges.world_from_mesh[3].xyz;
    let px_per_m = px_per_m_at((view.clip_from_world * vec4<f32>(origin, 1.0)).w) / view.unit_px;
    let length_m = edges.dash_px / max(px_per_m, 1.0e-6);
    let period_m = exp2(round(log2(max(length_m, 1.0e-9))));
    return dot(mix(a, b, along) - origin, normalize(b - a)) / period_m;
}

fn covered(in: Varying) -> f32 {
    let gap = edges.dash_px > 0.0 && fract(in.dashes) > 0.58;
    return select(stroke_cover(in.off_px, edges.width_px), 0.0, gap);
}

// Behind something: faint.
@fragment
fn fs_hidden(in: Varying) -> @location(0) vec4<f32> {
    return vec4<f32>(edges.color.rgb, edges.color.a * select(0.3, 0.2, edges.dash_px > 0.0) * covered(in));
}

@fragment
fn fs_main(in: Varying) -> @location(0) vec4<f32> {
    let cover = covered(in);
    // A gap must not mark the picture as something solid.
    if cover <= 0.0 {
        discard;
    }
    return vec4<f32>(edges.color.rgb, edges.color.a * cover);
}
