//! PyTorch's container, in both directions.

use std::path::PathBuf;

use crate::support;
use touch2touch_pipeline::io::error::FileErrorKind;
use touch2touch_pipeline::io::pt::{PtItem, Tensor, Values, read_dict, write_dict};

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The bits of a tensor as `make_pt_fixture.py` writes them.
fn bits(tensor: &Tensor) -> Vec<String> {
    match &tensor.values {
        Values::F32(v) => v.iter().map(|x| format!("{:08x}", x.to_bits())).collect(),
        Values::F64(v) => v.iter().map(|x| format!("{:016x}", x.to_bits())).collect(),
        Values::U8(v) => v.iter().map(u8::to_string).collect(),
        Values::I64(v) => v.iter().map(i64::to_string).collect(),
    }
}

#[test]
fn a_file_written_by_pytorch_reads_back_to_the_last_bit() {
    let dict = read_dict(&data("torch_views.pt")).unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&std::fs::read(data("torch_views.json")).unwrap()).unwrap();
    let truth = truth.as_object().unwrap();
    assert!(truth.len() >= 16);
    for (key, want) in truth {
        let tensor = dict.tensor(key).unwrap();
        assert_eq!(serde_json::json!(tensor.shape), want["shape"], "{key}");
        assert_eq!(serde_json::json!(bits(&tensor)), want["bits"], "{key}");
        let is_f64 = want["dtype"] == "float64";
        assert_eq!(matches!(tensor.values, Values::F64(_)), is_f64, "{key}");
    }
    assert_eq!(dict.scalar("a_float").unwrap(), 0.25);
    assert_eq!(dict.scalar("an_int").unwrap(), 7.0);
    assert_eq!(dict.scalar("theta").unwrap(), -0.107_569_456_100_463_87);
    assert_eq!(dict.shaped("transposed", &[&[5, 3]]).unwrap().into_f32().len(), 15);
}

#[test]
fn what_is_not_there_or_of_another_shape_is_named() {
    let dict = read_dict(&data("torch_views.pt")).unwrap();
    let err = dict.tensor("bubble_imprint").unwrap_err();
    let text = err.to_string();
    assert!(
        text.contains("bubble_imprint") && text.contains("transposed") && text.contains("torch_views.pt"),
        "{text}"
    );
    let err = dict.shaped("f32", &[&[2, 1, 140, 175], &[140, 175]]).unwrap_err();
    let text = err.to_string();
    assert!(text.contains("[2, 3, 4]") && text.contains("[2, 1, 140, 175] or [140, 175]"), "{text}");
    assert_eq!(dict.scalar("f32").unwrap_err().kind, FileErrorKind::Content);
    assert_eq!(dict.scalar("empty").unwrap_err().kind, FileErrorKind::Content);
    assert_eq!(dict.tensor("a_text").unwrap_err().kind, FileErrorKind::Missing);
    assert!(!err.hint.is_empty());
}

#[test]
fn numpy_values_and_top_level_tensors_are_refused_by_name() {
    let dict = read_dict(&data("torch_numpy.pt")).unwrap();
    assert_eq!(dict.tensor("ok").unwrap(), Tensor::f32(&[2], vec![1.0; 2]));
    for key in ["theta", "arr"] {
        let text = dict.tensor(key).unwrap_err().to_string();
        assert!(text.contains("numpy") && text.contains(key), "{text}");
    }
    assert!(read_dict(&data("torch_toplevel.pt")).unwrap_err().what.contains("dict of tensors"));
}

/// The archive `bytes` as `torch.save` writes it to a file of this name: everything in a folder of the name, no sizes before
/// the values, and at the end both kinds of end records, where nothing in the short one points to the long one.
fn as_torch_writes(bytes: &[u8], name: &str) -> Vec<u8> {
    let mut from = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    let count = from.len() as u64;
    for index in 0..from.len() {
        let mut entry = from.by_index(index).unwrap();
        let path = entry.name().unwrap().replacen("archive", name, 1);
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
        let size = (content.len() as u32).to_le_bytes();
        let crc = entry.crc32().to_le_bytes();
        let at = (out.len() as u32).to_le_bytes();
        let length = (path.len() as u16).to_le_bytes();
        // Bit 3: the sizes follow the values; bit 11: the name is UTF-8.
        let common: &[u8] = &[0, 0, 8, 8, 0, 0, 0, 0, 0x3f, 0xea];
        out.extend([b"PK\x03\x04", common, &[0; 12], &length, &[0; 2], path.as_bytes(), &content].concat());
        out.extend([b"PK\x07\x08", &crc[..], &size, &size].concat());
        directory.extend([b"PK\x01\x02\0\0", common, &crc, &size, &size, &length, &[0; 12], &at].concat());
        directory.extend(path.as_bytes());
    }
    let (start, size) = (out.len() as u64, directory.len() as u64);
    out.extend(directory);
    let end = out.len() as u64;
    out.extend([b"PK\x06\x06", &44u64.to_le_bytes()[..], &[0x1e, 3, 0x2d, 0], &[0; 8]].concat());
    out.extend([count, count, size, start].into_iter().flat_map(u64::to_le_bytes));
    out.extend([b"PK\x06\x07", &[0; 4][..], &end.to_le_bytes(), &1u32.to_le_bytes()].concat());
    out.extend([b"PK\x05\x06", &[0; 4][..]].concat());
    out.extend([count as u16, count as u16].into_iter().flat_map(u16::to_le_bytes));
    out.extend([size as u32, start as u32].into_iter().flat_map(u32::to_le_bytes));
    out.extend([0, 0]);
    out
}

/// The archive with other bytes in the first place of its pickle that has these.
pub(super) fn with_pickle(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut old = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    let mut new = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for index in 0..old.len() {
        let mut entry = old.by_index(index).unwrap();
        let name = entry.name().unwrap().into_owned();
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
        if name.ends_with("data.pkl") {
            let at = content.windows(from.len()).position(|window| window == from).expect("the bytes are there");
            content.splice(at..at + from.len(), to.iter().copied());
        }
        new.start_file(name, options).unwrap();
        std::io::Write::write_all(&mut new, &content).unwrap();
    }
    new.finish().unwrap().into_inner()
}

#[test]
fn bfloat16_is_read_and_a_view_that_goes_backwards_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("own.pt");
    // Two values of 16 bits lie in one of 32: the upper half is that value rounded, the lower one is 0.
    write_dict(&path, &[("x", Tensor::f32(&[4], vec![1.5, -2.0, 9.0, 9.0]).into())]).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, with_pickle(&bytes, b"FloatStorage", b"BFloat16Storage")).unwrap();
    assert_eq!(read_dict(&path).unwrap().tensor("x").unwrap(), Tensor::f32(&[4], vec![0.0, 1.5, 0.0, -2.0]));
    // torch knows no such view, but a program could write one.
    write_dict(&path, &[("x", Tensor::u8(&[2, 2], vec![1, 2, 3, 4]).into())]).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let backwards = with_pickle(&bytes, b"(J\x02\0\0\0J\x01\0\0\0t\x89", b"(J\xfe\xff\xff\xffJ\x01\0\0\0t\x89");
    std::fs::write(&path, backwards).unwrap();
    let error = read_dict(&path).unwrap().tensor("x").unwrap_err().to_string();
    assert!(error.contains("_rebuild_tensor_v2") && error.contains("own.pt"), "{error}");
}

#[test]
fn a_file_of_torch_opens_whatever_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("own.pt");
    write_dict(&path, &sample_items()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for letter in ["a", "_", "\u{e9}", "\u{89e6}", "\u{1f91a}"] {
        for letters in 1..=60 {
            let name = letter.repeat(letters);
            std::fs::write(&path, as_torch_writes(&bytes, &name)).unwrap();
            let dict = read_dict(&path).unwrap_or_else(|err| panic!("{name}: {err}"));
            let theta = dict.scalar("theta").unwrap_or_else(|err| panic!("{name}: {err}"));
            assert_eq!(theta, -0.107_569_456_100_463_87, "{name}");
            assert_eq!(dict.shaped("bubble_imprint", &[&[2, 1, 3, 4]]).unwrap().into_f32().len(), 24, "{name}");
            assert_eq!(dict.scalar("scale").unwrap(), 0.1, "{name}");
        }
    }
}

fn sample_items() -> Vec<(&'static str, PtItem)> {
    let numbers: Vec<f32> = (0..24).map(|i| (i as f32).sin() * 1e-3).collect();
    vec![
        ("bubble_imprint", Tensor::f32(&[2, 1, 3, 4], numbers).into()),
        ("theta", Tensor::f64(&[], vec![-0.107_569_456_100_463_87]).into()),
        ("contact_mask", Tensor::u8(&[2, 2], vec![0, 1, 255, 7]).into()),
        ("index", Tensor { shape: vec![2], values: Values::I64(vec![-5, i64::MAX]) }.into()),
        ("none", Tensor::f32(&[0, 3], vec![]).into()),
        ("train_tools", PtItem::Texts(vec!["pattern_31_rod".into(), "ünïcode".into()])),
        ("name", PtItem::Text("demo".into())),
        ("scale", PtItem::Float(0.1)),
    ]
}

#[test]
fn what_is_written_reads_back_and_is_the_same_every_time() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("own.pt");
    write_dict(&path, &sample_items()).unwrap();
    let first = std::fs::read(&path).unwrap();
    write_dict(&path, &sample_items()).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), first);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "no temporary file is left");
    let dict = read_dict(&path).unwrap();
    for (key, item) in sample_items() {
        if let PtItem::Tensor(tensor) = item {
            assert_eq!(dict.tensor(key).unwrap(), tensor, "{key}");
        }
    }
    assert_eq!(dict.scalar("scale").unwrap(), 0.1);
    let bad = [("x", PtItem::from(Tensor::f32(&[2, 2], vec![0.0])))];
    assert!(write_dict(&path, &bad).unwrap_err().what.contains("do not fill"));
    assert_eq!(std::fs::read(&path).unwrap(), first, "a refused write leaves the old file");
}

/// Needs a Python with PyTorch, named by `TOUCH2TOUCH_TORCH_PYTHON`.
#[test]
fn pytorch_reads_what_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("own.pt");
    write_dict(&path, &sample_items()).unwrap();
    let script = "
import sys, math, torch
d = torch.load(sys.argv[1], weights_only=True)
want = torch.tensor([math.sin(i) for i in range(24)])
assert list(d) == ['bubble_imprint', 'theta', 'contact_mask', 'index', 'none', 'train_tools', 'name', 'scale'], list(d)
assert d['bubble_imprint'].shape == (2, 1, 3, 4) and d['bubble_imprint'].dtype == torch.float32
assert (d['bubble_imprint'].flatten() - want * 1e-3).abs().max() < 1e-9
assert d['theta'].item() == -0.10756945610046387 and d['theta'].shape == () and d['theta'].dtype == torch.float64
assert d['contact_mask'].tolist() == [[0, 1], [255, 7]] and d['contact_mask'].dtype == torch.uint8
assert d['index'].tolist() == [-5, 2**63 - 1]
assert d['none'].shape == (0, 3)
assert d['train_tools'] == ['pattern_31_rod', 'ünïcode'] and d['name'] == 'demo' and d['scale'] == 0.1
torch.load(sys.argv[1], weights_only=True, mmap=True)
";
    support::torch_runs(script, &[path]);
}
