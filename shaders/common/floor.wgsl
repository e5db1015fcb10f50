// The floor below a scene. Rust twin: gpu::floor::FloorUniform.

struct FloorUniform {
    // sRGB-encoded color of the floor, and its opacity in the middle.
    color: vec4<f32>,
    // Middle of the floor, meters; half its width in w.
    center: vec4<f32>,
    // Towards the light that throws the shadow.
    light: vec4<f32>,
    // Opacity of the deepest shadow.
    shadow: f32,
}
