// Eye-dome lighting and ambient occlusion of a picture with one sample per pixel.

@group(1) @binding(0) var depths: texture_2d<f32>;

fn depth_at(at: vec2<i32>) -> f32 {
    return textureLoad(depths, at, 0).x;
}
