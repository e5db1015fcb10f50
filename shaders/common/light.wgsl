// One studio light for everything that has a surface, as if painted on a ball (a matcap): it turns with the eye, so that
// shapes read the same from every side. CPU twins: {light_on, gloss_on} of tests/gpu.rs.

// The share of its color that a surface shows: a wide key light, a sky, and a weak light from below on the far side. The
// sum stays below 1, so that the color stays itself.
fn light_on(normal: vec3<f32>) -> f32 {
    let key = clamp((dot(normal, view.key_in_world.xyz) + 0.2) / 1.2, 0.0, 1.0);
    let above = 0.5 + 0.5 * dot(normal, view.up_in_world.xyz);
    let bounce = clamp(-dot(normal, view.key_in_world.xyz), 0.0, 1.0);
    return 0.14 + 0.20 * above * above + 0.62 * key * sqrt(key) + 0.08 * bounce;
}

// White light that is mirrored towards the eye, linear.
fn gloss_on(normal: vec3<f32>, to_eye: vec3<f32>) -> f32 {
    let halfway = clamp(dot(normal, normalize(view.key_in_world.xyz + to_eye)), 0.0, 1.0);
    let two = halfway * halfway;
    let eight = two * two * two * two;
    let forty = eight * eight * eight * eight * eight;
    return 0.03 * eight + 0.11 * forty;
}

// A color (sRGB-encoded) under the light.
fn lit(color: vec3<f32>, light: f32, gloss: f32) -> vec3<f32> {
    return srgb_from_linear(clamp(linear_from_srgb(color) * light + gloss, vec3<f32>(0.0), vec3<f32>(1.0)));
}
