//! The program as a user runs it: one JSON object on standard output, exit codes that mean what they say.

use std::path::Path;

use serde_json::Value;
use strum::IntoEnumIterator as _;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::{ByImprint, MaskStore, StoredReview};

use crate::support::{self, assert_says, error_text, json, run, simulate, simulated, succeed, tiny};

mod documented;
mod hostile;
mod links;
mod notes;
mod outputs;
mod pages;
mod read_as;
mod refused;
mod stats;
mod unit;
mod watch;

#[test]
fn a_simulated_dataset_is_sound_has_poses_and_exports_masks() {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().join("data");
    let set = dir.path().join("set");
    let (set_text, data_path) = (set.to_str().unwrap(), data.as_path());

    let tools = "pattern_04_3_lines_angle_1,pattern_36";
    let words = ["simulate", "--out", set_text, "--tools", tools, "--grasps", "2", "--seed", "7", "--json"];
    let made = succeed(&words, data_path);
    assert_eq!(json(&made)["pairs"], 4);

    let doctor = succeed(&["doctor", set_text, "--no-predictions", "--json"], data_path);
    assert_eq!(json(&doctor)["pairs"], 4);
    assert_eq!(json(&doctor)["problems"], Value::Array(vec![]), "our own files are sound");

    let report = json(&succeed(&["pose", set_text, "--mask", "cad", "--engine", "all", "--json"], data_path));
    let cases = report["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4 * Registration::iter().count(), "four pairs, all engines");
    for case in cases {
        for key in ["name", "angle_deg", "truth_deg", "error_deg", "y_m", "z_m", "ms", "stop"] {
            assert!(!case[key].is_null(), "{key} is missing in {case}");
        }
        // Of round bars the camera sees the crown's near side alone, which costs what knows only the mask some degrees.
        let of_its_own = ["joint", "distance_field"].contains(&case["engine"].as_str().unwrap());
        let limit = if of_its_own { 5.0 } else { 10.0 };
        assert!(case["error_deg"].as_f64().unwrap() < limit, "{case}");
    }
    for engine in ["distance_field", "lab_icp"] {
        for key in ["mean_deg", "median_deg", "success_5", "success_10", "median_ms"] {
            assert!(report["summary"]["engines"][engine][key].is_number(), "{engine} {key}");
        }
    }

    let traced = run(&["pose", set_text, "--mask", "cad", "--limit", "1", "--trace", "--json"], data_path);
    let report = &json(&traced)["cases"][0]["report"];
    assert!(report["trace"].as_array().unwrap().len() > 3, "the start and some iterations");
    assert!(report["fits"].as_array().unwrap().len() > 100, "each point's residual");
    assert!(cases[0].get("report").is_none(), "nothing is recorded unless asked for");

    let told = run(
        &["pose", set_text, "--mask", "cad", "--limit", "1", "--trace", "--start", "-10,1,-2", "--json"],
        data_path,
    );
    let start = &json(&told)["cases"][0]["report"]["start"];
    assert!((start["theta_rad"].as_f64().unwrap() + 10f64.to_radians()).abs() < 1e-12, "{start}");
    assert!((start["z_m"].as_f64().unwrap() + 0.002).abs() < 1e-12, "{start}");
    for bad in [&["--start", "1,2"][..], &["--mask", "dept"], &["--engine", "best"]] {
        let refused = run(&[&["pose", set_text][..], bad].concat(), data_path);
        assert_eq!(refused.status.code(), Some(2), "{}", error_text(&refused));
    }

    // What a person accepted in the studio stands beside what was registered.
    assert!(cases[0].get("accepted").is_none());
    let store = MaskStore::for_dataset(&Dataset::open(&set).unwrap()).unwrap();
    let pose = PlanarPose { theta_rad: -0.1, y_m: 0.001, z_m: 0.002 };
    let accepted = [Some(AcceptedPose { pose, by_hand: true }), None];
    let accepted = ByImprint { accepted, ..ByImprint::default() };
    let name = cases[0]["name"].as_str().unwrap();
    store.save_review(name, &StoredReview { review: "todo".into(), accepted, ..StoredReview::default() }).unwrap();
    let labeled = json(&run(&["pose", set_text, "--json"], data_path));
    let cases: Vec<&Value> = labeled["cases"].as_array().unwrap().iter().filter(|c| !c["accepted"].is_null()).collect();
    assert_eq!(cases.len(), 1);
    let found = &cases[0]["accepted"];
    assert_eq!((cases[0]["name"].as_str(), found["by_hand"].as_bool()), (Some(name), Some(true)));
    assert!((found["angle_deg"].as_f64().unwrap() - 0.1f64.to_degrees()).abs() < 1e-9, "{found}");
    assert!(found["error_deg"].is_number() && found["grasp_from_object"]["y_m"] == 0.001, "{found}");

    let masks = dir.path().join("masks");
    let nothing = run(&["masks", "export", set_text, "--out", masks.to_str().unwrap()], data_path);
    assert_eq!(nothing.status.code(), Some(2), "nothing was corrected by hand yet");
    assert!(error_text(&nothing).contains("--pairs all"));
    let all = ["masks", "export", set_text, "--out", masks.to_str().unwrap(), "--pairs", "all", "--json"];
    let counts = json(&succeed(&all, data_path));
    let total: i64 = ["train", "val", "test"].iter().map(|k| counts[k].as_i64().unwrap()).sum();
    assert_eq!(total, 8, "two fingers of four pairs");
    assert!(touch2touch_pipeline::io::exchange::list(&masks, None).unwrap().refused.is_empty());
}

#[test]
fn what_cannot_be_done_is_said_and_is_no_success() {
    let dir = tempfile::tempdir().unwrap();
    let absent = run(&["doctor", "/no/such/folder", "--json"], dir.path());
    assert_eq!(absent.status.code(), Some(2));
    assert!(absent.stdout.is_empty(), "no JSON where there is no report");
    assert!(error_text(&absent).contains("/no/such/folder"), "{}", error_text(&absent));

    let tool = run(&["simulate", "--out", "x", "--tools", "hammer"], dir.path());
    assert_eq!(tool.status.code(), Some(2));
    assert!(error_text(&tool).contains("pattern_31_rod"), "the message names what there is");

    let bundle = run(&["bundle", "check", dir.path().to_str().unwrap(), "--json"], dir.path());
    assert_eq!(bundle.status.code(), Some(1), "checked, but not sound");
    assert!(!json(&bundle)["problems"].as_array().unwrap().is_empty());
}

#[test]
fn the_lab_sample_is_within_two_degrees() {
    let Some(lab) = support::shared("lab-sample") else { return };
    let dir = tempfile::tempdir().unwrap();
    let report = json(&succeed(&["pose", lab.to_str().unwrap(), "--mask", "cad", "--json"], dir.path()));
    assert_eq!(report["cases"].as_array().unwrap().len(), 4);
    for case in report["cases"].as_array().unwrap() {
        assert!(case["error_deg"].as_f64().unwrap() < 2.0, "{case}");
    }
}

#[test]
fn the_five_faults_are_written_and_told_apart() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("faults");
    let set_text = set.to_str().unwrap();
    let made = succeed(&["simulate", "--faults", "--out", set_text, "--json"], dir.path());
    assert_eq!(json(&made)["faults"].as_object().unwrap().len(), 5);

    let doctor = json(&run(&["doctor", set_text, "--no-predictions", "--json"], dir.path())).to_string();
    assert!(doctor.contains("scale it by 0.001") && doctor.contains("left imprint is 0 everywhere"), "{doctor}");

    let pose = run(&["pose", set_text, "--mask", "truth", "--json"], dir.path());
    assert_eq!(pose.status.code(), Some(1), "one tool cannot be aligned");
    assert!(error_text(&pose).contains("scale it by 0.001"), "{}", error_text(&pose));
    let report = json(&pose);
    let error = |name: &str| {
        let cases = report["cases"].as_array().unwrap();
        let case = cases.iter().find(|c| c["name"].as_str().unwrap().contains(name));
        case.and_then(|c| c["error_deg"].as_f64())
    };
    assert!(error("wrong_cad").unwrap() > 10.0, "the wrong model cannot fit");
    for name in ["blob_in_mask", "blank_finger", "straight_rod"] {
        assert!(error(name).unwrap() < 6.0, "{name} with the true mask: {:?}", error(name));
    }
    assert_eq!(error("stl_in_millimetres"), None);
}

/// With the tiny bundles: the form of the table, not its figures.
#[test]
fn the_results_table_is_printed_and_written() {
    let dir = tempfile::tempdir().unwrap();
    let (data, set) = (dir.path().join("data"), dir.path().join("set"));
    let set_text = set.to_str().unwrap();
    let tools = "pattern_31_rod,pattern_36";
    let words = ["simulate", "--out", set_text, "--tools", tools, "--grasps", "2", "--condition", "mixed", "--json"];
    let made = succeed(&words, &data);
    assert_eq!(json(&made)["tools"].as_array().unwrap().len(), 4, "both tools, and both on a bare shaft");

    let bundle = |name: &str| tiny(name).display().to_string();
    let (generator, mask, classifier) = (bundle("generator"), bundle("mask"), bundle("classifier"));
    let lines = dir.path().join("table.csv");
    let mut args = vec!["evaluate", set_text, "--bundle", &generator, "--bundle", &generator];
    args.extend(["--mask-bundle", &mask, "--classifier", &classifier, "--resamples", "50", "--paper"]);
    args.extend(["--csv", lines.to_str().unwrap()]);
    let text = String::from_utf8(succeed(&args, &data).stdout).unwrap();
    let all = ["Unseen grasps of seen tools", "Unseen tools", "Measured (upper bound)", "Paper: VQ-VAE", "95 %"];
    assert_says(&text, &all);
    assert_eq!(std::fs::read_to_string(&lines).unwrap().lines().count(), 1 + 2 * 6, "six rows, two groups");

    args.extend(["--json", "--pairs"]);
    let report = json(&run(&args, &data));
    assert_eq!(report["complete"], true);
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    assert_ne!(rows[1]["method"], rows[2]["method"], "two bundles of one name can be told apart");
    for (row, upper) in rows.iter().zip([true, false, false]) {
        for figures in row["groups"].as_array().unwrap() {
            assert_eq!((&figures["grasps"], &figures["images"]), (&Value::from(2), &Value::from(4)));
            assert_eq!(figures["psnr_db"].is_null(), upper, "the measured imprints are not compared with themselves");
            for key in ["psnr_noise_free_db", "success_5", "mask_iou"] {
                assert!(figures[key]["value"].is_number(), "{key} in {figures}");
            }
            assert_eq!(figures["frechet"].is_number(), !upper);
        }
    }
    assert_eq!(rows[1]["groups"], rows[2]["groups"]);
    assert_eq!(report["pairs"].as_array().unwrap().len(), 3);

    // A damaged pair is left out and named; the rest is scored.
    std::fs::write(set.join("test/test_only/gelslims/pattern_36_data_0.pt"), b"no file").unwrap();
    let rest = run(&args, &data);
    assert!(!rest.status.success() && error_text(&rest).contains("pattern_36"), "{}", error_text(&rest));
    let report = json(&rest);
    assert_eq!(report["rows"][0]["groups"][1]["grasps"], 1);
    assert_eq!(report["skipped"].as_array().unwrap().len(), 1);

    let wrong = run(&["evaluate", "test-set", "--bundle", &mask], &data);
    assert!(error_text(&wrong).contains("not a generator"), "{}", error_text(&wrong));
}

/// The lab's own predictions in the picture folder, as they were measured before.
#[test]
fn stored_predictions_get_a_row() {
    let Some(pairs) = support::shared("real-pairs") else { return };
    let dir = tempfile::tempdir().unwrap();
    let generator = tiny("generator").display().to_string();
    let args = ["evaluate", pairs.to_str().unwrap(), "--bundle", &generator, "--json"];
    let report = json(&run(&args, dir.path()));
    assert_eq!(report["groups"], serde_json::json!(["clean_pictures", "clipped_pictures"]));
    let lab = &report["rows"][1]["groups"];
    assert_eq!((&lab[0]["grasps"], &lab[1]["grasps"]), (&Value::from(19), &Value::from(17)));
    let psnr = |at: usize| lab[at]["psnr_db"]["value"].as_f64().unwrap();
    let mean = (19.0 * psnr(0) + 17.0 * psnr(1)) / 36.0;
    assert!((mean - 26.0).abs() < 0.1, "26.0 dB over all pictures: {mean}");
    assert!(lab[0]["angle_deg"].is_null() && lab[0]["frechet"].is_null());
}

/// A grasp of the simulator in the lab's layout, spoilt.
fn write_spoilt(root: &Path, number: u64, spoil: impl Fn(&mut touch2touch_core::sample::DepthTouch)) {
    use touch2touch_core::catalog;
    use touch2touch_core::sim;
    use touch2touch_pipeline::io::simulated::{Layout, write_pair, write_tools};
    let tool = &catalog::tools()[3];
    let mut sample = sim::simulate(tool, sim::random_grasp(number), 7 + number, &sim::SimConfig::default());
    for touch in sample.pads.iter_mut().flatten() {
        spoil(touch.depth_mut().unwrap());
    }
    write_tools(root, &[(tool.name.as_str(), true, tool.mesh())]).unwrap();
    write_pair(root, Layout::Test, &tool.name, number, &sample).unwrap();
}

#[test]
fn a_flat_imprint_has_no_pose_and_implausible_intrinsics_are_said() {
    let dir = tempfile::tempdir().unwrap();
    let (flat, twice) = (dir.path().join("flat"), dir.path().join("twice"));
    write_spoilt(&flat, 0, |b| b.imprint = b.imprint.map(|_| 0.0));
    // The default mask comes from the CAD model at the true pose, and would know where the tool is.
    for mask in ["auto", "cad"] {
        let out = run(&["pose", flat.to_str().unwrap(), "--mask", mask, "--json"], dir.path());
        assert_eq!(out.status.code(), Some(1), "{mask}: {}", error_text(&out));
        let case = &json(&out)["cases"][0];
        assert!(case["angle_deg"].is_null() && case["mask"] == "flat", "{mask}: {case}");
        assert!(error_text(&out).contains("flat"), "{}", error_text(&out));
    }
    for number in 0..3 {
        write_spoilt(&twice, number, |b| {
            let k = &mut b.camera.as_mut().unwrap().intrinsics;
            (k.fx, k.fy, k.cx, k.cy) = (2.0 * k.fx, 2.0 * k.fy, 2.0 * k.cx, 2.0 * k.cy);
        });
    }
    let out = run(&["pose", twice.to_str().unwrap(), "--json"], dir.path());
    let (report, said) = (json(&out), error_text(&out));
    let notes = report["notes"].as_array().unwrap();
    let of = |what: &str| notes.iter().find(|note| note["what"].as_str().unwrap().contains(what));
    let note = of("K is implausible").unwrap_or_else(|| panic!("{report}"));
    assert_eq!(note["count"], 6, "{report}");
    // What explains it is said too.
    assert!(of("the camera matrices are 2 times too large").is_some(), "{report}");
    assert!(said.contains("K is implausible") && said.contains("_data_0.pt") && said.contains("6 times"), "{said}");
    let doctor = json(&run(&["doctor", twice.to_str().unwrap(), "--no-predictions", "--json"], dir.path()));
    assert!(doctor["problems"].as_array().unwrap().contains(note), "{doctor}");
}
