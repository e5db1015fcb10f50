//! What the mutations start from: good files, and the small forms of files that once broke something.

use std::io::Read as _;
use std::path::Path;

use touch2touch_pipeline::io::pt::{PtItem, Tensor, Values, write_dict};

use super::mutate::{png_checksums, zip};

/// The bytes of a file, or what it is made of.
#[derive(Clone, Debug)]
pub(super) enum Content {
    Raw(Vec<u8>),
    /// Entries of an archive.
    Zip(Vec<(String, Vec<u8>)>),
    Png(Vec<u8>),
}

/// A file to start from.
pub(super) struct Seed {
    pub(super) name: &'static str,
    pub(super) content: Content,
    /// Whether it is read.
    pub(super) good: bool,
    /// A word of the refusal.
    pub(super) says: Option<&'static str>,
}

impl Seed {
    pub(super) fn bytes(&self) -> Vec<u8> {
        match &self.content {
            Content::Raw(bytes) | Content::Png(bytes) => bytes.clone(),
            Content::Zip(entries) => zip(entries, false),
        }
    }
}

pub(super) fn good(name: &'static str, content: Content) -> Seed {
    Seed { name, content, good: true, says: None }
}

pub(super) fn bad(name: &'static str, content: Content, says: &'static str) -> Seed {
    Seed { name, content, good: false, says: Some(says) }
}

/// A text.
pub(super) fn text(text: &str) -> Content {
    Content::Raw(text.as_bytes().to_vec())
}

/// What `write` leaves in a file.
pub(super) fn written(write: impl FnOnce(&Path)) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    write(&file);
    std::fs::read(&file).unwrap()
}

/// An archive taken apart.
pub(super) fn opened(bytes: &[u8]) -> Content {
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    let count = archive.len();
    let entry = |index| {
        let mut entry = archive.by_index(index).unwrap();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        (String::from_utf8_lossy(entry.name_raw()).into_owned(), bytes)
    };
    Content::Zip((0..count).map(entry).collect())
}

/// A dict as `torch.save` writes it.
pub(super) fn dict(items: &[(&str, PtItem)]) -> Content {
    opened(&written(|file| write_dict(file, items).unwrap()))
}

/// A `.pt` file of this pickle, compressed.
fn pickled(pickle: Vec<u8>) -> Content {
    let mut entries = vec![("a/data.pkl".to_owned(), pickle), ("a/byteorder".to_owned(), b"little".to_vec())];
    entries.push(("a/data/0".to_owned(), vec![0; 64]));
    Content::Raw(zip(&entries, true))
}

/// A pickled dict `{"x": tensor}` whose tensor is a view of this shape with strides of 0.
fn repeated_value(shape: &[i32]) -> Vec<u8> {
    let text = |text: &str| [b"X".as_slice(), &(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let int = |n: i32| [b"J".as_slice(), &n.to_le_bytes()].concat();
    let sizes: Vec<u8> = shape.iter().flat_map(|&n| int(n)).collect();
    let strides: Vec<u8> = shape.iter().flat_map(|_| int(0)).collect();
    let storage =
        [&b"(("[..], &text("storage"), b"ctorch\nFloatStorage\n", &text("0"), &text("cpu"), &int(16), b"tQ"].concat();
    let view = [&int(0)[..], b"(", &sizes, b"t(", &strides, b"t\x89ccollections\nOrderedDict\n)RtR"].concat();
    [&b"\x80\x02}"[..], &text("x"), b"ctorch._utils\n_rebuild_tensor_v2\n", &storage, &view, b"s."].concat()
}

/// Dicts of tensors: of PyTorch, of this program, and bombs.
pub(super) fn pt() -> Vec<Seed> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let torch = |name: &str| opened(&std::fs::read(data.join(name)).unwrap());
    let many = |op: &[u8], count: usize| [b"\x80\x02(".as_slice(), &op.repeat(count), b"t."].concat();
    let doubled = [b"\x80\x02}X\x01\x00\x00\x00a]".as_slice(), &b"q\x00h\x00\x86".repeat(40), b"s."].concat();
    let mut large = dict(&[("x", Tensor::u8(&[4], vec![1; 4]).into())]);
    if let Content::Zip(entries) = &mut large {
        entries.iter_mut().filter(|(name, _)| name.ends_with("data/0")).for_each(|entry| entry.1 = vec![0; 65 << 20]);
        large = Content::Raw(zip(entries, true));
    }
    vec![
        good("torch views", torch("torch_views.pt")),
        good("torch texts", torch("torch_tools.pt")),
        good("numpy values", torch("torch_numpy.pt")),
        bad("a tensor on its own", torch("torch_toplevel.pt"), "dict"),
        good(
            "numbers and texts",
            dict(&[("theta", PtItem::Float(1.5)), ("t", PtItem::Texts(vec!["a".into(), "b".into()]))]),
        ),
        bad("a plain pickle", Content::Raw(b"\x80\x02}X\x01\x00\x00\x00aK\x01s.".to_vec()), "not a zip archive"),
        bad("a bomb of nothing", pickled(many(b"N", 4 << 20)), "list of contents is longer"),
        bad("a bomb of dicts", pickled(many(b"}", 1_000_000)), "would take more"),
        bad("a bomb of marks", pickled(many(b"(", 1_000_000)), "would take more"),
        good("a bomb of copies, which are shared", pickled(doubled)),
        bad("a compressed storage", large, "would be unpacked"),
        bad("a value repeated for ever", pickled(repeated_value(&[1 << 15, 1 << 15])), "more than"),
        bad(
            "an old archive",
            Content::Raw([vec![0; 257], b"ustar\x0000".to_vec(), vec![0; 248]].concat()),
            "not a zip archive",
        ),
        bad("empty", text(""), "empty"),
    ]
}

fn zeros(shape: &[usize]) -> PtItem {
    Tensor::f32(shape, vec![0.0; shape.iter().product()]).into()
}

/// Bubble files of the lab's, and such with a plain number where a tensor belongs.
pub(super) fn bubble() -> Vec<Seed> {
    let image = [2, 1, 140, 175];
    let whole: Vec<(&str, PtItem)> = vec![
        ("bubble_imprint", zeros(&image)),
        ("bubble_depth_ref", Tensor::f32(&image, vec![0.09; 2 * 140 * 175]).into()),
        ("K", Tensor::f64(&[2, 3, 3], [212.0, 0.0, 112.0, 0.0, 211.0, 86.0, 0.0, 0.0, 1.0].repeat(2)).into()),
        ("bubbles_tr_quat", Tensor::f64(&[2, 7], [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].repeat(2)).into()),
        ("grasp_frame_quat", Tensor::f64(&[1, 7], vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).into()),
        ("theta", PtItem::Float(0.1)),
        ("x", PtItem::Float(0.0)),
        ("y", PtItem::Float(0.0)),
    ];
    let mut seeds = vec![good("a touch", dict(&whole))];
    for key in ["bubble_imprint", "bubble_depth_ref", "K", "bubbles_tr_quat", "grasp_frame_quat"] {
        let with = |(name, item): &(&'static str, PtItem)| {
            (*name, if *name == key { PtItem::Float(1.5) } else { item.clone() })
        };
        let file = dict(&whole.iter().map(with).collect::<Vec<_>>());
        // Without the imprint there is nothing; the rest costs what needs it.
        seeds.push(if key == "bubble_imprint" { bad(key, file, "a plain number") } else { good(key, file) });
    }
    seeds
}

/// GelSlim files with a plain number where a tensor belongs.
pub(super) fn gelslim() -> Vec<Seed> {
    let shape = [2, 3, 320, 427];
    let image = || PtItem::from(Tensor::u8(&shape, vec![9; shape.iter().product()]));
    let pair = |a: PtItem, b: PtItem| dict(&[("gelslim", a), ("gelslim_ref", b), ("theta", PtItem::Float(0.0))]);
    vec![
        good("a touch", pair(image(), image())),
        bad("a number", pair(PtItem::Float(1.5), image()), "a plain number"),
        bad("a number as the reference", pair(image(), PtItem::Float(1.5)), "a plain number"),
        bad("a number and nothing else", dict(&[("gelslim", PtItem::Float(1.5))]), "a plain number"),
    ]
}

/// Files of the depth data set with one touch.
pub(super) fn gelslim_depth() -> Vec<Seed> {
    let picture = |n: usize| PtItem::from(Tensor::u8(&[n, 6, 320, 427], vec![9; n * 6 * 320 * 427]));
    let whole = |depths: PtItem, pose: PtItem| {
        dict(&[
            ("tactile_image", picture(1)),
            ("base_tactile_image", picture(1)),
            ("depth_images", depths),
            ("in_hand_pose", pose),
            ("grasp_widths", Tensor::f32(&[1], vec![12.0]).into()),
        ])
    };
    let (depths, pose) = (|| zeros(&[1, 2, 320, 427]), || zeros(&[1, 3]));
    vec![
        good("a touch", whole(depths(), pose())),
        bad("other depths", whole(zeros(&[1, 2, 4, 4]), pose()), "expected [1, 2, 320, 427]"),
        bad("too many poses", whole(depths(), zeros(&[2, 3])), "expected [1, 3]"),
        bad("empty", text(""), "empty"),
    ]
}

/// Imprints as numpy's arrays.
pub(super) fn depth_arrays() -> Vec<Seed> {
    let zeros = vec![0; 4 * 140 * 175];
    vec![
        good("an imprint", Content::Raw(npy("140, 175", &zeros))),
        bad("another size", Content::Raw(npy("2, 3", &zeros[..24])), "3 x 2 values"),
        bad("a bomb", Content::Raw(npy("100000, 100000", &zeros[..24])), "do not fit"),
        bad("empty", text(""), "cut off"),
    ]
}

/// Imprints as TIFF files.
pub(super) fn depth_tiffs() -> Vec<Seed> {
    let tiff = |width: u32, height: u32, compression: u32, data: &[u8]| {
        let properties = [
            (256, width),
            (257, height),
            (258, 32),
            (259, compression),
            (262, 1),
            (273, 110),
            (279, data.len() as u32),
            (339, 3),
        ];
        // The list is 8 + 2 + 8 * 12 + 4 = 110 bytes long; the values follow.
        let entry = |(tag, value): (u16, u32)| {
            [&tag.to_le_bytes()[..], &4u16.to_le_bytes(), &1u32.to_le_bytes(), &value.to_le_bytes()].concat()
        };
        let list: Vec<u8> = properties.into_iter().flat_map(entry).collect();
        Content::Raw([b"II\x2a\0\x08\0\0\0\x08\0", &list[..], &[0; 4], data].concat())
    };
    let zeros = vec![0; 4 * 140 * 175];
    vec![
        good("an imprint", tiff(175, 140, 1, &zeros)),
        bad("another size", tiff(3, 2, 1, &zeros[..24]), "3 x 2 values"),
        bad("too large", tiff(100_000, 100_000, 1, &zeros[..24]), "100000 x 100000"),
        bad("compressed otherwise", tiff(175, 140, 9, &zeros), "not a readable TIFF"),
        bad("cut off", tiff(175, 140, 1, &zeros[..24]), "not a readable TIFF"),
    ]
}

/// An array file with this header.
fn npy(shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': True, 'shape': ({shape}), }}\n");
    [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
}

/// Archives of arrays.
pub(super) fn npz() -> Vec<Seed> {
    let tensors = [
        ("a", Tensor::f32(&[2, 3], vec![1.0; 6])),
        ("b", Tensor::u8(&[4], vec![1; 4])),
        ("c", Tensor { shape: vec![], values: Values::I64(vec![3]) }),
    ];
    let one = |entry: Vec<u8>| Content::Zip(vec![("x.npy".to_owned(), entry)]);
    let bomb = npy("4194305, 4, ", &vec![0; 4 * 4 * 4_194_305]);
    vec![
        good("arrays", opened(&written(|file| touch2touch_pipeline::io::npz::write(file, &tensors).unwrap()))),
        good("another order", one(npy("2, 2", &[0; 16]))),
        bad("a product that wraps", one(npy("4294967296, 4294967296", &[])), "do not fit"),
        bad("a product that wraps to nothing", one(npy("0, 4294967296, 4294967296", &[])), "do not fit"),
        bad("a long shape", one(npy(&"1, ".repeat(5000), &[])), "header"),
        bad("a bomb", Content::Raw(zip(&[("x.npy".to_owned(), bomb)], true)), "do not fit"),
        bad("no archive", text("PK\x03\x04"), "archive"),
    ]
}

/// A picture's file.
pub(super) fn picture(picture: &image::DynamicImage, format: image::ImageFormat) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut out, format).unwrap();
    out.into_inner()
}

/// PNG and JPEG of every kind, and one that announces 12,000 pixels a side.
pub(super) fn pictures() -> Vec<Seed> {
    use image::{DynamicImage as D, ImageFormat};
    let kinds: [(&str, D); 5] = [
        ("gray", D::new_luma8(24, 20)),
        ("deep gray", D::new_luma16(24, 20)),
        ("color", D::new_rgb8(24, 20)),
        ("color with alpha", D::new_rgba8(24, 20)),
        ("deep color", D::new_rgb16(24, 20)),
    ];
    let mut seeds: Vec<Seed> =
        kinds.iter().map(|(name, kind)| good(name, Content::Png(picture(kind, ImageFormat::Png)))).collect();
    seeds.push(good("JPEG", Content::Raw(picture(&D::new_rgb8(24, 20), ImageFormat::Jpeg))));
    let mut huge = picture(&D::new_rgb8(24, 20), ImageFormat::Png);
    huge[16..24].copy_from_slice(&[12_000u32.to_be_bytes(), 12_000u32.to_be_bytes()].concat());
    png_checksums(&mut huge);
    seeds.push(bad("12,000 pixels a side", Content::Png(huge), "4096"));
    seeds.push(bad("empty", text(""), "PNG"));
    seeds
}
