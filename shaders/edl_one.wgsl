// Eye-dome lighting and ambient occlusion of a picture with one sample per pixel.
#import <common/view.wgsl>
#import <common/edl.wgsl>

@group(1) @binding(0) var depths: texture_2d<f32>;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(quad_corner(vertex), 0.0, 1.0);
}

fn depth_at(at: vec2<i32>) -> f32 {
    return textureLoad(depths, at, 0).x;
}

@fragment
fn fs_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let own = depth_at(vec2<i32>(at.xy));
    if own <= 0.0 {
        discard;
    }
    var behind = 0.0;
    for (var i = 0; i < NEIGHBORS; i++) {
        behind += meters_behind(own, depth_at(neighbor(at.xy, i)));
    }
    return shade(behind);
}

@fragment
fn fs_hollows(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let own = depth_at(vec2<i32>(at.xy));
    if own <= 0.0 {
        discard;
    }
    var hollows = 0.0;
    for (var j = 0; j < HOLLOWS; j++) {
        for (var i = 0; i < LINES; i++) {
            let way = ends_px(own, j, i);
            hollows += hollow(own, depth_at(inside(at.xy + way)), depth_at(inside(at.xy - way)), j);
        }
    }
    return shade_hollows(hollows);
}
