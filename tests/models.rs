//! Bundles, engines and models on the tiny bundles of `tests/data/bundles` (written by `make_bundles.py` there).

use std::path::{Path, PathBuf};

use touch2touch_pipeline::infer::bundle::{Bundle, MANIFEST, find};

use crate::support::{assert_says, edit_json, tiny, tiny_with};

/// Everything said about a bundle that must be refused.
fn refusal(dir: &Path) -> String {
    Bundle::open(dir).expect_err("the bundle must be refused").to_string()
}

#[test]
fn whole_bundles_open() {
    let generator = Bundle::open(&tiny("generator")).unwrap();
    assert_eq!(generator.name(), "Tiny generator of the tests");
    assert_eq!(generator.generator().unwrap().defaults.steps, 6);
    assert_eq!(generator.hash().len(), 64);
    assert!(generator.provenance()["made_by"].is_string());
    let mask = Bundle::open(&tiny("mask")).unwrap();
    assert_eq!(mask.mask_unet().unwrap().output.classes, 2);
    assert!(mask.generator().is_none());
}

#[test]
fn a_tool_classifier_opens_and_a_wrong_one_is_refused() {
    let bundle = Bundle::open(&tiny("classifier")).unwrap();
    let spec = bundle.tool_classifier().unwrap();
    assert_eq!((spec.output.classes.len(), spec.output.features), (3, Some(4)));
    assert!(bundle.generator().is_none() && bundle.mask_unet().is_none());

    let dir = tiny_with("classifier", |m| {
        m["output"]["classes"] = serde_json::json!(["pattern_36", "pattern_36", ""]);
        m["output"]["features"] = serde_json::json!(5);
        m["input"]["rotation_deg"] = serde_json::json!(90);
    });
    let text = refusal(dir.path());
    assert_says(
        &text,
        &[
            "output.classes: not usable",
            "input.rotation_deg: not supported",
            "tool_classifier.onnx: output `features`: shape [N, 4], but the manifest says [N, 5]",
        ],
    );
    edit_json(&dir.path().join(MANIFEST), |m| m["output"]["classes"] = serde_json::json!(["a", "b"]));
    let text = refusal(dir.path());
    assert!(text.contains("output `logits`: shape [N, 3], but the manifest says [N, 2]"), "{text}");
}

#[test]
fn a_refusal_lists_everything_that_is_wrong() {
    let dir = tiny_with("generator", |_| {});
    let decoder = dir.path().join("decoder.onnx");
    let mut bytes = std::fs::read(&decoder).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    std::fs::write(&decoder, bytes).unwrap();
    std::fs::remove_file(dir.path().join("condition_encoder.onnx")).unwrap();
    edit_json(&dir.path().join(MANIFEST), |m| {
        m["latent"]["shape"] = serde_json::json!([3, 4, 4]);
        m["input"]["std"] = serde_json::json!([0.07, 0.0, 0.06]);
        m["schedule"]["beta_end"] = serde_json::json!(1.5);
        m["output"]["range_m"] = serde_json::json!([0.02, 0.01]);
        m["output"]["window_px"] = serde_json::json!([-1.0, 20.0]);
        m["prediction"] = serde_json::json!("velocity");
        m["surprise"] = serde_json::json!(1);
        m["defaults"]["eta"] = serde_json::json!(2.0);
        m.as_object_mut().unwrap().remove("condition");
    });
    let text = refusal(dir.path());
    assert_says(
        &text,
        &[
            "condition_encoder.onnx: cannot be read",
            "decoder.onnx: its SHA-256 is not the manifest's",
            "input.std: not positive",
            "schedule: the betas run from 0.0015 to 1.5",
            "output.range_m: empty",
            "output.window_px: outside the imprint",
            "prediction: unknown variant `velocity`",
            "surprise: unknown key",
            "condition: missing",
            "defaults.eta: out of range",
        ],
    );
}

#[test]
fn shapes_that_disagree_with_the_manifest_are_refused() {
    let dir = tiny_with("generator", |m| {
        m["latent"]["shape"] = serde_json::json!([3, 4, 4]);
        m["output"]["channels"] = serde_json::json!(1);
        m["input"]["size"] = serde_json::json!([16, 32]);
    });
    let text = refusal(dir.path());
    assert_says(
        &text,
        &[
            "denoiser.onnx: input `latent`: shape [N, 4, 4, 4], but the manifest says [N, 3, 4, 4]",
            "denoiser.onnx: output `prediction`: shape",
            "decoder.onnx: input `latent`: shape",
            "decoder.onnx: output `image`: shape [N, 3, 16, 16], but the manifest says [N, 1, 16, 16]",
            "condition_encoder.onnx: input `gelslim`: shape [N, 3, 16, 16], but the manifest says [N, 3, 32, 16]",
        ],
    );
}

#[test]
fn other_versions_formats_and_paths_are_refused() {
    let with = |change: fn(&mut serde_json::Value)| {
        let dir = tiny_with("mask", change);
        refusal(dir.path())
    };
    let newer = with(|m| m["format_version"] = 3.into());
    assert!(newer.contains("format_version: 3, but this program reads versions 1 to 2"), "{newer}");
    // The second version declares its sensors; the first never did.
    assert!(with(|m| m["format_version"] = 2.into()).contains("input: invalid type"));
    let color = serde_json::json!({"key": "gelslim", "kind": "color", "size": [427, 320]});
    let dir = tiny_with("mask", |m| {
        m["format_version"] = 2.into();
        m["input"]["sensor"] = color;
    });
    assert!(refusal(dir.path()).contains("input.sensor.kind: not depth"));
    assert!(with(|m| m["format"] = "other".into()).contains("another program's file"));
    assert!(with(|m| m["kind"] = "painter".into()).contains("kind: \"painter\" is unknown"));
    for path in ["../mask_unet.onnx", "/etc/hostname", ""] {
        let dir = tiny_with("mask", |m| m["files"]["mask_unet"]["path"] = path.into());
        assert!(refusal(dir.path()).contains("leads out of the folder"), "{path}");
    }
    assert!(with(|m| m["files"] = serde_json::json!({})).contains("files.mask_unet: missing"));
    assert!(with(|m| m["files"]["decoder"] = m["files"]["mask_unet"].clone()).contains("files.decoder: not part"));

    let dir = tempfile::tempdir().unwrap();
    assert!(refusal(dir.path()).contains("manifest.json: cannot be read"));
    for text in ["", "{", "[]", "null", "\u{feff}{}", "{\"format\": \"touch2touch-bundle\"}"] {
        std::fs::write(dir.path().join(MANIFEST), text).unwrap();
        assert!(refusal(dir.path()).contains("1 problem"), "{text}");
    }
}

#[test]
fn bundles_are_found_once_and_broken_ones_reported() {
    let broken = tiny_with("mask", |m| m["output"]["classes"] = 7.into());
    let roots = [tiny(""), tiny("generator"), broken.path().to_path_buf(), PathBuf::from("/nowhere")];
    let found = find(&roots);
    let names: Vec<&str> = found.bundles.iter().map(Bundle::name).collect();
    let all = [
        "Tiny tool classifier of the tests",
        "Tiny generator of the tests",
        "Tiny mask UNet of the tests",
        "Tiny generator from Soft Bubble to GelSlim",
        "Tiny generator from DIGIT to Soft Bubble",
        "Rounding of the tests",
    ];
    let each_once = |name: &&str| names.iter().filter(|found| *found == name).count() == 1;
    assert!(names.len() == all.len() && all.iter().all(each_once), "{names:?}");
    assert!(found.problems.iter().any(|p| p.what.contains("output.classes")));
}

pub(crate) mod running {
    use std::ops::ControlFlow;

    use touch2touch_core::diffusion::{GenerateConfig, Progress, Tensor};
    use touch2touch_core::grid::{Grid, RgbGrid};
    use touch2touch_core::postprocess::{RawPrediction, ShiftMode};
    use touch2touch_pipeline::infer::bundle::Role;
    use touch2touch_pipeline::infer::classifier::{ToolClassifier, Verdict};
    use touch2touch_pipeline::infer::engine::{EngineChoice, Graph, Input, resolve};
    use touch2touch_pipeline::infer::generator::{GenerateError, Generator};
    use touch2touch_pipeline::infer::mask::{ImprintError, MaskModel};

    use super::*;
    use crate::support::left_out;

    /// The engines of this machine. rten always; ONNX Runtime where it is found, and it must be if `REQUIRE_ORT` is set.
    fn engines() -> Vec<EngineChoice> {
        match resolve(EngineChoice::Ort) {
            Ok(_) => vec![EngineChoice::Rten, EngineChoice::Ort],
            Err(err) => {
                left_out::<()>(err, "REQUIRE_ORT");
                vec![EngineChoice::Rten]
            }
        }
    }

    pub(crate) fn image() -> RgbGrid {
        Grid::from_fn(43, 32, |x, y| {
            let bar = if (x + y / 2) % 20 < 5 { 40.0 } else { 0.0 };
            [bar, -bar * 0.5, (x as f32 * 0.3).sin() * 10.0]
        })
    }

    pub(crate) fn go_on(_: Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    pub(crate) fn config() -> GenerateConfig {
        GenerateConfig { steps: 6, ..Default::default() }
    }

    pub(crate) fn largest_difference(a: &RawPrediction, b: &RawPrediction) -> f32 {
        let pairs = a.channels.iter().zip(&b.channels).flat_map(|(a, b)| a.as_slice().iter().zip(b.as_slice()));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    /// Each graph on each engine against onnx's own evaluator in numpy.
    #[test]
    fn every_engine_computes_what_the_standard_says() {
        let text = std::fs::read(tiny("reference.json")).unwrap();
        let reference: serde_json::Value = serde_json::from_slice(&text).unwrap();
        let wave =
            |n: usize, f: fn(f64) -> f64, step: f64| (0..n).map(|i| f(f64::from(i as u32) * step) as f32).collect();
        let gelslim = Tensor::new(vec![2, 3, 16, 16], wave(1536, f64::sin, 0.37)).unwrap();
        let latent = Tensor::new(vec![2, 4, 4, 4], wave(128, f64::cos, 0.71)).unwrap();
        let near = |found: Vec<f32>, key: &str, engine| {
            let expected = reference[key].as_array().unwrap();
            assert_eq!(found.len(), expected.len());
            for (a, b) in found.iter().zip(expected) {
                // Values of about 1 through a few dozen sums in f32; the cosine of timestep 700 costs a few bits.
                assert!((f64::from(*a) - b.as_f64().unwrap()).abs() < 2e-5, "{engine:?} {key}: {a} for {b}");
            }
        };
        for choice in engines() {
            let engine = resolve(choice).unwrap();
            let load = |role: Role| {
                let file = tiny("generator").join(format!("{}.onnx", role.key()));
                Graph::load(engine, role, &file.into()).unwrap()
            };
            let condition = load(Role::ConditionEncoder)
                .run(&[("gelslim", Input::F32(&gelslim))], "condition", &[2, 5, 4, 4])
                .unwrap();
            let inputs = [
                ("latent", Input::F32(&latent)),
                ("timestep", Input::I64(&[700, 700])),
                ("condition", Input::F32(&condition)),
            ];
            let prediction = load(Role::Denoiser).run(&inputs, "prediction", &[2, 4, 4, 4]).unwrap();
            let image = load(Role::Decoder).run(&[("latent", Input::F32(&latent))], "image", &[2, 3, 16, 16]).unwrap();
            near(condition.into_data(), "condition", engine);
            near(prediction.into_data(), "prediction", engine);
            near(image.into_data().into_iter().step_by(7).collect(), "image", engine);
        }
    }

    #[test]
    fn engines_agree_from_image_to_picture() {
        let bundle = Bundle::open(&tiny("generator")).unwrap();
        let results: Vec<RawPrediction> = engines()
            .into_iter()
            .map(|choice| Generator::open(&bundle, choice).unwrap().generate(&image(), &config(), &mut go_on).unwrap())
            .collect();
        for other in &results[1..] {
            // Six steps, each adding rounding of about 1e-6; the picture is of size 1.
            let difference = largest_difference(&results[0], other);
            assert!(difference < 1e-4, "the engines differ by {difference}");
        }
    }

    #[test]
    fn a_seed_gives_the_same_picture_again_and_another_seed_another() {
        let bundle = Bundle::open(&tiny("generator")).unwrap();
        for choice in engines() {
            let mut generator = Generator::open(&bundle, choice).unwrap();
            let mut go = |seed| generator.generate(&image(), &GenerateConfig { seed, ..config() }, &mut go_on).unwrap();
            let first = go(1);
            assert_eq!(first.channels.len(), 3);
            assert_eq!(first.channels[0].size(), [16, 16]);
            assert_eq!(go(1), first);
            assert!(largest_difference(&first, &go(2)) > 1e-2);
            let again = Generator::open(&bundle, choice).unwrap().generate(
                &image(),
                &GenerateConfig { seed: 1, ..config() },
                &mut go_on,
            );
            assert_eq!(again.unwrap(), first, "a freshly loaded model must agree");
        }
    }

    #[test]
    fn pictures_become_depth_in_every_reading() {
        let bundle = Bundle::open(&tiny("generator")).unwrap();
        let mut generator = Generator::open(&bundle, EngineChoice::Auto).unwrap();
        let raw = generator.generate(&image(), &config(), &mut go_on).unwrap();
        let depth = |mode| generator.spec().depth_chain(mode).unwrap().run(&raw).unwrap();
        let (saved, exact) = (depth(ShiftMode::Raw), depth(ShiftMode::ExactInverse));
        assert_eq!(saved.size(), [18, 14]);
        for (&r, &d) in saved.as_slice().iter().zip(exact.as_slice()) {
            assert!((2.0 * f64::from(r) - 0.0225 - f64::from(d)).abs() < 1e-7);
            assert!((-0.0117..=0.0226).contains(&d));
        }
        assert_ne!(depth(ShiftMode::PaperShift), exact);
    }

    #[test]
    fn impossible_requests_are_errors() {
        let generator = Bundle::open(&tiny("generator")).unwrap();
        let mask = Bundle::open(&tiny("mask")).unwrap();
        assert!(matches!(Generator::open(&mask, EngineChoice::Rten), Err(GenerateError::NotAGenerator(_))));
        assert!(matches!(MaskModel::open(&generator, EngineChoice::Rten), Err(ImprintError::NotAMaskUnet(_))));
        let mut model = Generator::open(&generator, EngineChoice::Rten).unwrap();
        for config in [
            GenerateConfig { steps: 0, ..config() },
            GenerateConfig { steps: 1001, ..config() },
            GenerateConfig { eta: f64::NAN, ..config() },
        ] {
            assert!(matches!(model.generate(&image(), &config, &mut go_on), Err(GenerateError::Diffusion(_))));
        }
        let holes = Grid::filled(4, 4, [f32::NAN; 3]);
        let result = model.generate(&holes, &config(), &mut go_on);
        assert!(matches!(result, Err(GenerateError::BadImage { bad: 48, .. })));
        let damaged = tiny_with("mask", |_| {});
        std::fs::write(damaged.path().join("mask_unet.onnx"), b"gone").unwrap();
        for choice in engines() {
            let engine = resolve(choice).unwrap();
            let load = |file: PathBuf| Graph::load(engine, Role::MaskUnet, &file.into()).unwrap_err().to_string();
            assert!(load(damaged.path().join("mask_unet.onnx")).contains("cannot load the graph `mask_unet`"));
            assert!(load(damaged.path().join("absent.onnx")).contains("absent.onnx"));
            let mut graph = Graph::load(engine, Role::MaskUnet, &tiny("mask/mask_unet.onnx").into()).unwrap();
            let wrong = Tensor::filled(vec![1, 1, 3, 3], 0.0);
            assert!(graph.run(&[("imprint", Input::F32(&wrong))], "logits", &[1, 2, 14, 18]).is_err());
            assert!(graph.run(&[], "logits", &[1, 2, 14, 18]).is_err());
        }
    }

    #[test]
    fn the_mask_model_marks_what_is_deep_and_keeps_size_and_orientation() {
        let bundle = Bundle::open(&tiny("mask")).unwrap();
        for choice in engines() {
            let mut model = MaskModel::open(&bundle, choice).unwrap();
            // The graph answers "deeper than 5 mm"; the bundle turns the imprint by 180 degrees and back.
            let mut imprint = Grid::from_fn(18, 14, |x, y| if x < 6 && y > 3 { 0.008 } else { 0.001 });
            let expected = imprint.map(|&d| d > 0.005);
            assert_eq!(model.predict(&imprint).unwrap(), expected);
            imprint[(2, 8)] = f32::NAN;
            assert!(!model.predict(&imprint).unwrap()[(2, 8)]);
            let large = Grid::from_fn(36, 28, |x, y| if x < 12 && y > 7 { 0.008 } else { 0.001 });
            let mask = model.predict(&large).unwrap();
            assert_eq!(mask, large.map(|&d| d > 0.005));
            let nothing = Grid::filled(18, 14, f32::NAN);
            assert!(matches!(model.predict(&nothing), Err(ImprintError::Nothing { .. })));
        }
    }

    #[test]
    fn the_classifier_names_what_is_deepest_one_by_one_or_in_a_batch() {
        let bundle = Bundle::open(&tiny("classifier")).unwrap();
        // The classes are the quarters of the turned imprint: top left, top right, bottom left.
        let deep = |right: bool, low: bool| {
            Grid::from_fn(18, 14, |x, y| if (x >= 9) == right && (y >= 7) == low { 0.009 } else { 0.002 })
        };
        let imprints = [deep(true, true), deep(false, true), deep(true, false)];
        for choice in engines() {
            let mut model = ToolClassifier::open(&bundle, choice).unwrap();
            let together = model.classify(&imprints.iter().collect::<Vec<_>>()).unwrap();
            assert_eq!(together.iter().map(|v| v.class).collect::<Vec<_>>(), [0, 1, 2]);
            for (imprint, verdict) in imprints.iter().zip(&together) {
                let alone: Vec<Verdict> = model.classify(&[imprint]).unwrap();
                assert_eq!(alone[0].class, verdict.class);
                // 9 mm of a range of 0 to 10 is 0.8 of -1 to 1, and 2 mm is -0.6.
                let mut features = verdict.features.clone();
                features.sort_by(f32::total_cmp);
                assert!(features.iter().zip([-0.6, -0.6, -0.6, 0.8]).all(|(a, b)| (a - b).abs() < 1e-5));
            }
            let nothing = Grid::filled(18, 14, f32::NAN);
            assert!(matches!(model.classify(&[&nothing]), Err(ImprintError::Nothing { .. })));
            assert!(model.classify(&[]).unwrap().is_empty());
            let mask = Bundle::open(&tiny("mask")).unwrap();
            assert!(matches!(ToolClassifier::open(&mask, choice), Err(ImprintError::NotAClassifier(_))));
        }
    }

    /// Every shipped bundle is whole, and does the same on every engine.
    #[test]
    fn shipped_bundles_run_on_every_engine() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models");
        let found = find(&[root]);
        assert!(found.problems.is_empty(), "{:#?}", found.problems);
        assert!(!found.bundles.is_empty());
        let touch = Grid::from_fn(175, 140, |x, y| if (x + y) % 60 < 12 { 0.009 } else { 0.002 });
        for bundle in &found.bundles {
            let mut pictures = Vec::new();
            let mut masks = Vec::new();
            let mut verdicts: Vec<Verdict> = Vec::new();
            for choice in engines() {
                if bundle.generator().is_some() {
                    let mut generator = Generator::open(bundle, choice).unwrap();
                    let config = GenerateConfig { steps: 3, ..generator.spec().defaults };
                    pictures.push(generator.generate(&image(), &config, &mut go_on).unwrap());
                } else if bundle.tool_classifier().is_some() {
                    verdicts.append(&mut ToolClassifier::open(bundle, choice).unwrap().classify(&[&touch]).unwrap());
                } else {
                    masks.push(MaskModel::open(bundle, choice).unwrap().probability(&touch).unwrap());
                }
            }
            for other in pictures.iter().skip(1) {
                // Measured 2.5e-6 of 1.4 for an untrained generator of this size and 20 steps; a thousandth of the
                // range is 0.03 mm.
                let difference = largest_difference(&pictures[0], other);
                assert!(difference < 1e-3, "{}: the engines differ by {difference}", bundle.name());
            }
            for other in verdicts.iter().skip(1) {
                let pairs = verdicts[0].logits.iter().zip(&other.logits);
                let difference = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(difference < 1e-2, "{}: the engines differ by {difference}", bundle.name());
            }
            for other in masks.iter().skip(1) {
                let pairs = masks[0].as_slice().iter().zip(other.as_slice());
                let difference = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(difference < 1e-3, "{}: the engines differ by {difference}", bundle.name());
            }
        }
    }
}

/// The trial of a bundle in a second process, by the program itself.
mod trial {
    use std::process::Output;

    use super::*;
    use crate::support::{json, run, simulated, succeed};

    fn text(output: &Output) -> String {
        String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
    }

    /// Verdicts that were kept.
    fn kept(data: &Path) -> usize {
        std::fs::read_dir(data.join("trials")).map_or(0, Iterator::count)
    }

    fn number(mut n: u64) -> Vec<u8> {
        let mut out = Vec::new();
        while n > 0x7f {
            out.push(n as u8 | 0x80);
            n >>= 7;
        }
        out.push(n as u8);
        out
    }

    /// Fields of a protobuf message: bytes and numbers.
    fn bytes(field: u8, value: &[u8]) -> Vec<u8> {
        [vec![field << 3 | 2], number(value.len() as u64), value.to_vec()].concat()
    }
    fn whole(field: u8, value: u64) -> Vec<u8> {
        [vec![field << 3], number(value)].concat()
    }

    fn port(field: u8, name: &str, axes: &[u64]) -> Vec<u8> {
        let batch = bytes(1, &bytes(2, b"N"));
        let axes: Vec<u8> = axes.iter().flat_map(|&n| bytes(1, &whole(1, n))).collect();
        let tensor = [whole(1, 1), bytes(2, &[batch, axes].concat())].concat();
        bytes(field, &[bytes(1, name.as_bytes()), bytes(2, &bytes(1, &tensor))].concat())
    }

    /// A copy of the tiny mask bundle with another graph: one node of type `op` from `imprint` (and a list of numbers,
    /// if there is one) to `logits`.
    fn with_graph(op: &str, shape: &[i64]) -> tempfile::TempDir {
        let dir = tiny_with("mask", |_| {});
        let mut node = bytes(1, b"imprint");
        let mut graph = Vec::new();
        if !shape.is_empty() {
            node.extend(bytes(1, b"shape"));
            let raw: Vec<u8> = shape.iter().flat_map(|n| n.to_le_bytes()).collect();
            let tensor = [whole(1, shape.len() as u64), whole(2, 7), bytes(8, b"shape"), bytes(9, &raw)].concat();
            graph.extend(bytes(5, &tensor));
        }
        node.extend([bytes(2, b"logits"), bytes(3, b"node"), bytes(4, op.as_bytes())].concat());
        graph.extend([bytes(1, &node), bytes(2, b"graph")].concat());
        graph.extend([port(11, "imprint", &[1, 14, 18]), port(12, "logits", &[2, 14, 18])].concat());
        let opset = bytes(8, &whole(2, 17));
        let model = [whole(1, 8), bytes(7, &graph), opset].concat();
        std::fs::write(dir.path().join("mask_unet.onnx"), &model).unwrap();
        let sum: String = <sha2::Sha256 as sha2::Digest>::digest(&model).iter().map(|b| format!("{b:02x}")).collect();
        edit_json(&dir.path().join(MANIFEST), |m| m["files"]["mask_unet"]["sha256"] = sum.into());
        Bundle::open(dir.path()).expect("nothing is wrong that can be seen without an engine");
        dir
    }

    #[test]
    fn whole_bundles_are_taken_and_the_verdict_is_kept() {
        let data = tempfile::tempdir().unwrap();
        for name in ["generator", "mask", "classifier"] {
            let report = json(&succeed(&["bundle", "check", tiny(name).to_str().unwrap(), "--json"], data.path()));
            assert_eq!((&report["engines"][0], &report["problems"]), (&"rten".into(), &serde_json::json!([])));
        }
        assert!(kept(data.path()) >= 3);
    }

    /// 196 GB from a graph of 300 bytes, and 8 GB, which a large machine could give.
    #[test]
    fn a_graph_that_asks_for_too_much_is_refused_and_ends_nothing() {
        let data = tempfile::tempdir().unwrap();
        for copies in [97_000_000, 4_000_000] {
            let dir = with_graph("Expand", &[copies, 2, 14, 18]);
            let checked = run(&["bundle", "check", dir.path().to_str().unwrap()], data.path());
            let said = text(&checked);
            assert_eq!(checked.status.code(), Some(1), "{said}");
            assert_says(&said, &["rten (built in) does not take", "`mask_unet`", "memory"]);
        }
        assert_eq!(kept(data.path()), 0);
    }

    #[test]
    fn what_an_engine_cannot_load_or_run_is_said() {
        let data = tempfile::tempdir().unwrap();
        for (dir, expected) in [
            (with_graph("NoSuchOperator", &[]), "cannot load the graph `mask_unet`"),
            (with_graph("Identity", &[]), "mask_unet"),
            (with_graph("Expand", &[1, -7, 14, 18]), "mask_unet"),
        ] {
            let checked = run(&["bundle", "check", dir.path().to_str().unwrap()], data.path());
            let said = text(&checked);
            assert_eq!(checked.status.code(), Some(1), "{said}");
            assert!(said.contains("rten (built in) does not take") && said.contains(expected), "{said}");
        }
    }

    /// The verbs and the studio open a bundle by the same functions: none of them comes to the engine.
    #[test]
    fn a_verb_refuses_such_a_bundle_before_its_engine_sees_it() {
        let (data, set) = simulated("pattern_36", &["--grasps", "1"]);
        let pose = |bundle: &Path| {
            let args = ["pose", set.to_str().unwrap(), "--mask", "unet", "--runtime", "rten", "--mask-bundle"];
            run(&[&args[..], &[bundle.to_str().unwrap()]].concat(), data.path())
        };
        let refused = pose(with_graph("Expand", &[97_000_000, 2, 14, 18]).path());
        assert!(matches!(refused.status.code(), Some(1 | 2)), "{}", text(&refused));
        assert!(text(&refused).contains("does not take the model bundle"), "{}", text(&refused));
        assert_eq!(kept(data.path()), 0);
        // A good one is tried once, and then known.
        let good = pose(&tiny("mask"));
        assert!(!text(&good).contains("does not take"), "{}", text(&good));
        assert_eq!(kept(data.path()), 1);
    }
}
