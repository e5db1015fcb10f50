//! The looks of a 3D picture worth a page: dashes, veils, shadows, grounds, parts and samples.

use super::*;
use touch2touch::gpu::floor::Floor;
use touch2touch::spatial::still::Still;

/// A floor 20 mm below the origin.
fn floor(opacity: f32, shadow: f32) -> Option<Floor> {
    Some(Floor { center: DVec3::new(0.0, 0.0, 0.02), reach_m: 0.08, color: [0.9; 3], opacity, shadow })
}

#[test]
fn without_a_ground_nothing_is_where_nothing_is() {
    let Some(mut view) = View::new() else { return };
    let back = view.camera.axes()[2];
    let red = mesh_item(square(DVec3::ZERO, back, 0.01), MeshStyle { color: [0.9, 0.1, 0.1], ..Default::default() });
    let data = SceneData { meshes: vec![red], transparent: true, floor: floor(0.0, 0.5), eye_dome: true, ..scene() };
    let picture = view.picture(&data);
    let alpha = |[x, y]: [u32; 2]| picture.rgba[((y * SIZE[0] + x) * 4 + 3) as usize];
    assert_eq!([alpha([2, 2]), alpha([SIZE[0] - 3, 2])], [0, 0]);
    assert_eq!(alpha(view.pixel(DVec3::ZERO)), 255);
}

#[test]
fn a_still_has_smooth_edges_and_parts_that_fit() {
    let Some(gpu) = support::gpu() else { return };
    let camera = Camera::default();
    let back = camera.axes()[2];
    let style = MeshStyle { color: [1.0; 3], ..MeshStyle::default() };
    let (u, v) = back.any_orthonormal_pair();
    let slanted = (u + v * 0.37).normalize();
    let mut mesh = square(DVec3::ZERO, back, 0.01);
    // Turned in its plane, so that its edges run across pixels.
    let turn = DAffine3::from_axis_angle(back, 0.3 + slanted.x * 0.01);
    for vertex in &mut mesh.vertices {
        *vertex = turn.transform_point3(*vertex);
    }
    let data = SceneData { meshes: vec![mesh_item(mesh, style)], background: [0.0; 3], ..scene() };
    let picture = Still::of_scene(data.clone(), camera, [160, 160]).unwrap().picture(&camera).unwrap();
    let reds: std::collections::BTreeSet<u8> = picture.rgba.chunks_exact(4).map(|p| p[0]).collect();
    assert!(reds.len() > 8, "between black and white lie the steps of an edge: {reds:?}");
    // The same picture in quarters.
    let pipelines = Arc::new(Pipelines::new(&gpu).unwrap());
    let mut renderer = SceneRenderer::new(&gpu, pipelines).unwrap();
    let whole = Target::new(&gpu, [120, 100]).unwrap();
    renderer.render(&gpu, &data, (&camera, Part::whole(whole.size())), &whole).unwrap();
    let whole = whole.read(&gpu).unwrap();
    for at in [[0, 0], [60, 0], [0, 50], [60, 50]] {
        let target = Target::new(&gpu, [60, 50]).unwrap();
        let part = Part { of: [120, 100], at, size: [60, 50] };
        renderer.render(&gpu, &data, (&camera, part), &target).unwrap();
        let quarter = target.read(&gpu).unwrap();
        let off = (0..50).flat_map(|y| (0..60).map(move |x| (x, y)));
        let off = off.filter(|(x, y)| quarter.rgb(*x, *y) != whole.rgb(x + at[0], y + at[1])).count();
        // An edge may round to the other side of a sample.
        assert!(off < 12, "{off} pixels differ in the part at {at:?}");
    }
}
