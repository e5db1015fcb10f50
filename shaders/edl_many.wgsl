// Eye-dome lighting of a picture with several samples per pixel: the first one speaks for all.
#import <common/view.wgsl>
#import <common/edl.wgsl>

@group(1) @binding(0) var depths: texture_multisampled_2d<f32>;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(quad_corner(vertex), 0.0, 1.0);
}

@fragment
fn fs_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let own = textureLoad(depths, vec2<i32>(at.xy), 0).x;
    if own <= 0.0 {
        discard;
    }
    var behind = 0.0;
    for (var i = 0; i < NEIGHBORS; i++) {
        behind += meters_behind(own, textureLoad(depths, neighbor(at.xy, i), 0).x);
    }
    return shade(behind);
}
