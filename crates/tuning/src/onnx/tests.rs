use super::*;
use crate::fixture::{field, initializer, shipped};

const FILES: [&str; 3] = ["condition_encoder", "denoiser", "decoder"];

#[test]
fn the_shipped_files_have_a_name_for_each_weight() {
    for name in FILES {
        let file = Onnx::parse(shipped(name)).unwrap();
        assert!(file.weights().iter().all(|w| !w.name().contains("onnx::") && !w.name().contains('/')), "{name}");
    }
    let encoder = Onnx::parse(shipped("condition_encoder")).unwrap();
    let weight = |name: &str| encoder.weights().iter().find(|w| w.name() == name).unwrap();
    assert_eq!(weight("mix.0.mlp.2.weight").shape(), [320, 160]);
    assert_eq!(weight("trunk.6.bias").shape(), [160, 1, 1]);
    assert_eq!(weight("trunk.1.norm2.weight").shape(), [48, 1, 1]);
    assert!(encoder.values(weight("trunk.0.weight")).iter().any(|v| *v != 0.0));
}

#[test]
fn writing_what_was_read_changes_no_byte() {
    for name in FILES {
        let bytes = shipped(name);
        let file = Onnx::parse(bytes.clone()).unwrap();
        let values = |name: &str| file.values(file.weights().iter().find(|w| w.name() == name).unwrap());
        assert!(file.with(values) == bytes, "{name}");
    }
}

#[test]
fn written_weights_are_read_back_and_nothing_else_changes() {
    let bytes = shipped("decoder");
    let file = Onnx::parse(bytes.clone()).unwrap();
    let changed = "decoder.5.conv1.weight";
    let of = |file: &Onnx, name: &str| file.values(file.weights().iter().find(|w| w.name() == name).unwrap());
    let halved = |name: &str| of(&file, name).iter().map(|v| if name == changed { v / 2.0 } else { *v }).collect();
    let written = file.with(halved);
    let again = Onnx::parse(written.clone()).unwrap();
    for weight in file.weights() {
        let factor = if weight.name() == changed { 0.5 } else { 1.0 };
        let (before, after) = (file.values(weight), of(&again, weight.name()));
        // Halving is exact but for the smallest numbers of half precision.
        assert!(before.iter().zip(&after).all(|(b, a)| (b * factor - a).abs() < 1e-7), "{}", weight.name());
    }
    let place = &file.weights().iter().find(|w| w.name() == changed).unwrap().place;
    let outside = |bytes: &[u8]| [&bytes[..place.start], &bytes[place.end..]].concat();
    assert!(outside(&written) == outside(&bytes));
}

#[test]
fn both_precisions_and_both_forms_of_shapes_are_read() {
    let raw: Vec<u8> = [1.5f32, -2.0].iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect();
    let half = [field(1, &[1, 2]), vec![2 << 3, 10], field(8, b"h_f16"), field(9, &raw)].concat();
    let cast = [field(1, b"h_f16"), field(2, b"h"), field(4, b"Cast")].concat();
    let graph = [field(5, &half), field(5, &initializer("s", &[2, 1], &[3.0, 4.0])), field(1, &cast)].concat();
    let file = Onnx::parse(field(7, &graph)).unwrap();
    let weights: Vec<_> = file.weights().iter().map(|w| (w.name(), w.shape().to_vec(), file.values(w))).collect();
    assert_eq!(weights, [("h", vec![1, 2], vec![1.5, -2.0]), ("s", vec![2, 1], vec![3.0, 4.0])]);
}

#[test]
fn damaged_files_are_errors_and_never_panics() {
    let small = field(7, &field(5, &initializer("w", &[2, 3], &[1.0; 6])));
    assert_eq!(Onnx::parse(small.clone()).unwrap().weights().len(), 1);
    for cut in 0..small.len() {
        drop(Onnx::parse(small[..cut].to_vec()));
        for flip in [0x01, 0x55, 0xff] {
            let mut changed = small.clone();
            changed[cut] ^= flip;
            drop(Onnx::parse(changed));
        }
    }
    let wrong = field(7, &field(5, &initializer("w", &[usize::MAX, usize::MAX], &[1.0])));
    assert!(Onnx::parse(wrong).unwrap_err().contains("\"w\""));
    let twice = field(7, &field(5, &initializer("w", &[1], &[1.0])).repeat(2));
    assert!(Onnx::parse(twice).unwrap_err().contains("two weights"));
    assert!(Onnx::parse(b"not a model".to_vec()).is_err());
}
