// Eye-dome lighting and ambient occlusion of a picture with several samples per pixel: the first one speaks for all.

@group(1) @binding(0) var depths: texture_multisampled_2d<f32>;

fn depth_at(at: vec2<i32>) -> f32 {
    return textureLoad(depths, at, 0).x;
}
