//! Tests of the place of a bundle's pictures.

use super::*;
use touch2touch_core::rig::Rig;

fn generator(window_px: Option<[f64; 2]>) -> Result<GeneratorSpec, String> {
    let text = include_bytes!("../../../../../../tests/data/bundles/generator/manifest.json");
    let mut manifest: Value = serde_json::from_slice(text).unwrap();
    if let Some(center) = window_px {
        manifest["output"]["window_px"] = serde_json::json!(center);
    }
    let mut problems = Problems { file: "manifest.json".into(), list: Vec::new() };
    let parsed = parse(manifest.to_string().as_bytes(), &mut problems);
    if let Some(problem) = problems.list.first() {
        return Err(problem.what.clone());
    }
    match parsed.unwrap().spec {
        Some(BundleSpec::Generator(spec)) => Ok(*spec),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_picture_with_one_window_for_all_pads_is_moved_to_each_pads_own() {
    let rig = Rig::lab();
    let moved = |spec: &GeneratorSpec, pad| {
        let chain = spec.depth_chain(ShiftMode::ExactInverse).unwrap().placed(rig.window_share(pad));
        // The bundle's pictures lie turned by 180 degrees.
        std::array::from_fn(|i| -chain.offset[i] * rig.depth().unwrap().size()[i] as f64)
    };
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9;
    let mut framed = generator(Some([10.0, 10.0])).unwrap();
    framed.output.imprint_size = rig.depth().unwrap().size();
    framed.output.window_px = Some([74.5, 74.0]);
    assert!(near(moved(&framed, lab::RIGHT), [-10.0, -2.4]), "{:?}", moved(&framed, lab::RIGHT));
    assert!(near(moved(&framed, lab::LEFT), [0.3, -0.6]), "{:?}", moved(&framed, lab::LEFT));
    assert!(near(moved(&generator(None).unwrap(), lab::LEFT), [0.0, 0.0]), "without the key nothing moves");
    assert!(generator(Some([-1.0, 10.0])).unwrap_err().contains("output.window_px"));
}
