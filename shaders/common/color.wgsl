// Color maps, sRGB-encoded. CPU twin: crates/core/src/colormap.rs (a GPU test compares them).

const NAN_COLOR: vec3<f32> = vec3<f32>(0.42, 0.42, 0.42);

// The order of domain::colormap::ColorMap.
const MAP_VIRIDIS: u32 = 0u;
const MAP_DIVERGING: u32 = 1u;
const MAP_GRAY: u32 = 2u;

// Fit by Matt Zucker (CC0) to matplotlib's viridis (CC0).
fn viridis(t: f32) -> vec3<f32> {
    let c0 = vec3<f32>(0.27772733, 0.0054073445, 0.3340998);
    let c1 = vec3<f32>(0.10509304, 1.4046135, 1.3845901);
    let c2 = vec3<f32>(-0.33086183, 0.21484756, 0.09509516);
    let c3 = vec3<f32>(-4.6342306, -5.799101, -19.332441);
    let c4 = vec3<f32>(6.22827, 14.179934, 56.69055);
    let c5 = vec3<f32>(4.776385, -13.745145, -65.35303);
    let c6 = vec3<f32>(-5.435456, 4.6458526, 26.312435);
    let color = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6)))));
    return clamp(color, vec3<f32>(0.0), vec3<f32>(1.0));
}

fn diverging(t: f32) -> vec3<f32> {
    let s = t * 4.0;
    let low = mix(vec3<f32>(0.02, 0.19, 0.38), vec3<f32>(0.26, 0.58, 0.76), clamp(s, 0.0, 1.0));
    let to_zero = mix(low, vec3<f32>(0.97), clamp(s - 1.0, 0.0, 1.0));
    let from_zero = mix(to_zero, vec3<f32>(0.84, 0.38, 0.30), clamp(s - 2.0, 0.0, 1.0));
    return mix(from_zero, vec3<f32>(0.40, 0.0, 0.12), clamp(s - 3.0, 0.0, 1.0));
}

fn map_color(map: u32, unit: f32) -> vec3<f32> {
    let t = clamp(unit, 0.0, 1.0);
    let others = select(vec3<f32>(t), diverging(t), map == MAP_DIVERGING);
    return select(others, viridis(t), map == MAP_VIRIDIS);
}

// The color of a value given by its bits: drivers may assume that floats are numbers, so NaN is found in the bits.
fn scalar_color(map: u32, bits: u32, lo: f32, hi: f32) -> vec3<f32> {
    if (bits & 0x7fffffffu) > 0x7f800000u {
        return NAN_COLOR;
    }
    let span = hi - lo;
    return map_color(map, select(0.5, (bitcast<f32>(bits) - lo) / span, span > 0.0));
}

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    let low = c / 12.92;
    let high = pow((c + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, c <= vec3<f32>(0.04045));
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    let low = c * 12.92;
    let high = 1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, low, c <= vec3<f32>(0.0031308));
}
