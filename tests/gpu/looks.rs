//! The looks of a 3D picture worth a page: dashes, veils, shadows, grounds, parts and samples.

use super::*;
use touch2touch::gpu::floor::Floor;
use touch2touch::gpu::view::Part;
use touch2touch::spatial::still::Stills;

/// Red, green and blue of a picture's pixel.
fn at(view: &View, picture: &Picture, p: DVec3) -> [u8; 3] {
    let [x, y] = view.pixel(p);
    picture.rgb(x, y).unwrap()
}

#[test]
fn a_dashed_outline_has_gaps_and_a_whole_one_none() {
    let Some(mut view) = View::new() else { return };
    view.camera.orthographic = true;
    let back = view.camera.axes()[2];
    let (v, u) = back.any_orthonormal_pair();
    for (revision, dash_px) in [(1, 0.0), (2, 12.0)] {
        let edges = EdgeStyle { color: [0.0, 1.0, 0.0], opacity: 1.0, width_px: 3.0, creases: false, dash_px };
        let style = MeshStyle { look: Look::Outline, edges: Some(edges), ..MeshStyle::default() };
        let item = MeshItem { revision, ..mesh_item(square(DVec3::ZERO, back, 0.02), style) };
        let picture = view.picture(&SceneData { meshes: vec![item], ..scene() });
        // Along one side, without its ends.
        let greens: Vec<bool> =
            (-90..=90).map(|i| at(&view, &picture, v * 0.02 + u * (f64::from(i) * 0.0002))[1] > 200).collect();
        let gaps = greens.windows(2).filter(|two| two[0] && !two[1]).count();
        let share = greens.iter().filter(|on| **on).count() as f64 / greens.len() as f64;
        match dash_px == 0.0 {
            true => assert!(gaps == 0 && share == 1.0, "{gaps} gaps, {share}"),
            // 36 mm at 2585 px/m are 93 px: gaps every 8 to 17 px, and more line than gap.
            false => assert!((5..=12).contains(&gaps) && (0.45..0.75).contains(&share), "{gaps} gaps, {share}"),
        }
    }
}

#[test]
fn a_veil_is_one_layer_and_thin_before_what_is_solid() {
    let Some(mut view) = View::new() else { return };
    let [right, _, back] = view.camera.axes();
    let blue = MeshStyle { color: [0.1, 0.2, 0.9], opacity: 0.5, look: Look::Veil, ..MeshStyle::default() };
    let red = MeshStyle { color: [0.9, 0.1, 0.1], ..MeshStyle::default() };
    let veil = |name: &str, off: f64| MeshItem {
        name: name.into(),
        ..mesh_item(square(back * off, back, 0.02), MeshStyle { closed: false, ..blue })
    };
    let plate = MeshItem { name: "plate".into(), ..mesh_item(square(DVec3::ZERO, back, 0.005), red) };
    let middle = DVec3::ZERO;
    let beside = right * 0.011;
    let mut draw = |meshes: Vec<MeshItem>| {
        let picture = view.picture(&SceneData { meshes, ..scene() });
        [middle, beside].map(|p| at(&view, &picture, p))
    };
    let [bare, _] = draw(vec![plate.clone()]);
    let [over, free] = draw(vec![veil("near", 0.01), plate.clone()]);
    assert!(over[0] > 150 && over[0] < bare[0], "the model's color comes through: {over:?} of {bare:?}");
    assert!(free[2] > 80 && free[2] > free[0] + 40, "the veil itself: {free:?}");
    let [two, free_two] = draw(vec![veil("near", 0.01), veil("nearer", 0.012), plate.clone()]);
    let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 3);
    assert!(near(two, over) && near(free_two, free), "a second layer adds nothing: {two:?} {free_two:?}");
    let [behind, _] = draw(vec![veil("far", -0.01), plate]);
    assert_eq!(behind, bare, "behind the model it is not seen");
}

/// A floor 20 mm below the origin.
fn floor(opacity: f32, shadow: f32) -> Option<Floor> {
    Some(Floor { center: DVec3::new(0.0, 0.0, 0.02), reach_m: 0.08, color: [0.9; 3], opacity, shadow })
}

#[test]
fn a_shadow_darkens_the_floor_below_and_is_drawn_again_only_when_something_moves() {
    let Some(mut view) = View::new() else { return };
    let ball = mesh_item(sphere(0.008, 24), MeshStyle::default());
    // Straight down, where the light comes from nearly, and a place at the side of it.
    let (below, away) = (DVec3::new(0.005, 0.007, 0.02), DVec3::new(-0.03, 0.03, 0.02));
    let mut picture = |shadow: f32, moved: f64| {
        let style = MeshStyle { world_from_mesh: DAffine3::from_translation(DVec3::X * moved), ..ball.style };
        let meshes = vec![MeshItem { style, ..ball.clone() }];
        let picture = view.picture(&SceneData { meshes, floor: floor(1.0, shadow), ..scene() });
        [below, away].map(|p| i32::from(at(&view, &picture, p)[0]))
    };
    let [plain_below, plain_away] = picture(0.0, 0.0);
    let [dark, light] = picture(0.6, 0.0);
    assert!(dark < plain_below - 60, "{dark} of {plain_below}");
    assert!((light - plain_away).abs() <= 6, "{light} of {plain_away}");
    let [moved, _] = picture(0.6, -0.05);
    assert!(moved > dark + 40, "the shadow goes with the ball: {moved} after {dark}");
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
    let stills = Stills::new().unwrap();
    let picture = stills.picture(&data, &camera, [160, 160]).unwrap();
    let reds: std::collections::BTreeSet<u8> = picture.rgba.chunks_exact(4).map(|p| p[0]).collect();
    assert!(reds.len() > 8, "between black and white lie the steps of an edge: {reds:?}");
    // The same picture in quarters.
    let pipelines = Arc::new(Pipelines::new(&gpu).unwrap());
    let mut renderer = SceneRenderer::new(&gpu, pipelines).unwrap();
    let whole = Target::new(&gpu, [120, 100]).unwrap();
    renderer.render(&gpu, &data, &camera, &whole).unwrap();
    let whole = whole.read(&gpu).unwrap();
    for at in [[0, 0], [60, 0], [0, 50], [60, 50]] {
        let target = Target::new(&gpu, [60, 50]).unwrap();
        let part = Part { of: [120, 100], at, size: [60, 50] };
        renderer.render_part(&gpu, &data, (&camera, part), &target).unwrap();
        let quarter = target.read(&gpu).unwrap();
        let off = (0..50).flat_map(|y| (0..60).map(move |x| (x, y)));
        let off = off.filter(|(x, y)| quarter.rgb(*x, *y) != whole.rgb(x + at[0], y + at[1])).count();
        // An edge may round to the other side of a sample.
        assert!(off < 12, "{off} pixels differ in the part at {at:?}");
    }
}
