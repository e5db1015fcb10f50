//! The program as it is handed on: one file, on a machine that has nothing else of ours.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::infer::bundle::{Bundle, Origin};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::infer::generator::Generator;
use touch2touch_pipeline::io::dataset::Dataset;

/// Runs a copy of the program that lies alone in `home`, with nothing of this machine's settings.
fn alone(home: &Path, args: &[&str]) -> Output {
    let copy = home.join("touch2touch");
    if !copy.exists() {
        let program = Path::new(env!("CARGO_BIN_EXE_touch2touch"));
        std::fs::hard_link(program, &copy).or_else(|_| std::fs::copy(program, &copy).map(drop)).unwrap();
    }
    Command::new(copy).args(args).current_dir(home).env_clear().env("HOME", home).output().unwrap()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_programs_own_bundles_are_those_that_ship_and_predict_the_same() {
    let demo = Dataset::open(Path::new("demo")).unwrap();
    let sample = demo.load(PairId(0)).unwrap();
    let touch = sample.pad(lab::RIGHT).unwrap();
    let mut generators = 0;
    for origin in Origin::built_in() {
        let bundle = Bundle::open(&origin).unwrap();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models").join(origin.short_name());
        let shipped = Bundle::open(&folder).unwrap();
        assert_eq!(bundle.hash(), shipped.hash(), "predictions kept under one are found under the other");
        if bundle.generator().is_some() {
            let image = &touch.color().unwrap().difference;
            let [own, other] = [&bundle, &shipped].map(|bundle| {
                let mut generator = Generator::open(bundle, EngineChoice::Rten).unwrap();
                let config = generator.spec().defaults;
                generator.generate(image, &config, &mut |_| std::ops::ControlFlow::Continue(())).unwrap()
            });
            assert_eq!(own, other);
            generators += 1;
        }
    }
    assert!(generators > 0, "a generator ships");
}

#[test]
fn a_copied_program_predicts_and_poses_the_demo() {
    let home = tempfile::tempdir().unwrap();
    let generate = ["generate", "demo", "--limit", "1", "--runtime", "rten", "--out", "out", "--json"];
    let report = json(&alone(home.path(), &generate));
    assert!(report["mean"]["psnr_db"].as_f64().unwrap() > 15.0, "{report}");
    let pose =
        ["pose", "demo", "--limit", "1", "--imprint", "predicted", "--mask", "unet", "--runtime", "rten", "--json"];
    let report = json(&alone(home.path(), &pose));
    assert!(report["cases"][0]["error_deg"].as_f64().unwrap().abs() < 10.0, "{report}");
    let check = alone(home.path(), &["bundle", "check", "built-in:generator_ldm", "--json"]);
    assert_eq!(json(&check)["problems"], Value::Array(Vec::new()));
    let absent = alone(home.path(), &["bundle", "check", "built-in:absent"]);
    assert!(!absent.status.success() && String::from_utf8_lossy(&absent.stdout).contains("cannot be read"));
}

#[test]
fn the_version_tells_what_a_result_was_made_with() {
    let home = tempfile::tempdir().unwrap();
    let text = |args: &[&str]| {
        let output = alone(home.path(), args);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let name = concat!("touch2touch ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(text(&["-V"]), name);
    let long = text(&["--version"]);
    assert!(long.starts_with(name), "{long}");
    for line in ["\ncommit    ", "\nengines   rten ", "\nmodels    built-in:generator_ldm", "\ngraphics  "] {
        assert!(long.contains(line), "{line:?} is missing in:\n{long}");
    }
}
