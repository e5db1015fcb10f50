//! Mutations: of bytes, and of what is inside a container, which is closed again with the right checksums.

use std::io::Write as _;

use rand::Rng as _;
use rand::seq::IndexedRandom as _;
use rand_chacha::ChaCha8Rng;

use super::seeds::{Content, Seed};

/// Numbers that break readers.
const NUMBERS: [u64; 14] = [
    0,
    1,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x10000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    u64::MAX,
];
/// The same, and others, as a text would have them.
const WORDS: [&str; 16] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "NaN",
    "null",
    "4294967296",
    "18446744073709551616",
    "0.5",
    "[]",
    "{}",
    "\"\"",
    "true",
    "99999999999999999999999999999999",
    "(",
];

/// A file made from one of the seeds.
pub(super) fn mutated(seeds: &[Seed], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let seed = seeds.choose(rng).expect("every reader has seeds");
    let other = seeds.choose(rng).expect("every reader has seeds");
    match &seed.content {
        Content::Zip(entries) if rng.random_bool(0.7) => {
            let mut entries = entries.clone();
            if rng.random_bool(0.1) {
                let gone = rng.random_range(0..entries.len());
                entries.remove(gone);
            }
            for _ in 0..rng.random_range(1..3) {
                // The short entries say how the long ones are read.
                let at = (0..3)
                    .map(|_| rng.random_range(0..entries.len().max(1)))
                    .min_by_key(|&i| entries.get(i).map(|e| e.1.len()));
                if let Some((_, bytes)) = at.and_then(|at| entries.get_mut(at)) {
                    bytes_of(bytes, &[], rng);
                }
            }
            zip(&entries, rng.random_bool(0.3))
        }
        Content::Png(bytes) if rng.random_bool(0.7) => {
            let mut bytes = bytes.clone();
            bytes_of(&mut bytes, &[], rng);
            png_checksums(&mut bytes);
            bytes
        }
        _ => {
            let mut bytes = seed.bytes();
            bytes_of(&mut bytes, &other.bytes(), rng);
            bytes
        }
    }
}

/// A few changes. `other` is what pieces may be taken from.
fn bytes_of(bytes: &mut Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) {
    for _ in 0..*[1, 1, 1, 2, 4, 16].choose(rng).expect("not empty") {
        if bytes.is_empty() {
            bytes.push(rng.random());
            continue;
        }
        let at = rng.random_range(0..bytes.len());
        let length = rng.random_range(1..=(bytes.len() - at).min(64));
        match rng.random_range(0..9) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = rng.random(),
            2 => {
                let number = NUMBERS.choose(rng).expect("not empty");
                let width = *[1, 2, 4, 8].choose(rng).expect("not empty");
                let (little, big) = (number.to_le_bytes(), number.to_be_bytes());
                let new = if rng.random() { &little[..width] } else { &big[8 - width..] };
                for (byte, &new) in bytes[at..].iter_mut().zip(new) {
                    *byte = new;
                }
            }
            3 => drop(bytes.drain(at..at + length)),
            4 => {
                let piece = bytes[at..at + length].to_vec();
                let times = *[1, 2, 50].choose(rng).expect("not empty");
                bytes.splice(at..at, piece.repeat(times));
            }
            5 => {
                bytes.truncate(at);
            }
            6 => word(bytes, at, rng),
            7 if !other.is_empty() => {
                let from = rng.random_range(0..other.len());
                let count = rng.random_range(1..=(other.len() - from).min(256));
                bytes.splice(at..at + length, other[from..from + count].iter().copied());
            }
            _ => {
                let count = rng.random_range(1..=16);
                bytes.splice(at..at, (0..count).map(|_| rng.random::<u8>()));
            }
        }
    }
}

/// Replaces the number or word that follows `at` in a text.
fn word(bytes: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let inside = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-.".contains(byte);
    let Some(start) = bytes[at..].iter().position(inside).map(|i| at + i) else { return };
    let end = bytes[start..].iter().position(|b| !inside(b)).map_or(bytes.len(), |i| start + i);
    bytes.splice(start..end, WORDS.choose(rng).expect("not empty").bytes());
}

/// An archive of these entries.
pub(super) fn zip(entries: &[(String, Vec<u8>)], deflated: bool) -> Vec<u8> {
    use zip::CompressionMethod::{Deflated, Stored};
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = if deflated { Deflated } else { Stored };
    let options =
        zip::write::SimpleFileOptions::default().compression_method(method).compression_level(deflated.then_some(1));
    for (name, bytes) in entries {
        zip.start_file(name.as_str(), options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Writes the checksum of each chunk anew, as far as the chunks can be followed.
pub(super) fn png_checksums(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(end) = (at + 8).checked_add(length).filter(|end| end + 4 <= bytes.len()) else { return };
        let sum = crc32(&bytes[at + 4..end]).to_be_bytes();
        bytes[end..end + 4].copy_from_slice(&sum);
        at = end + 4;
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |sum: u32, &byte: &u8| {
        (0..8).fold(sum ^ u32::from(byte), |sum, _| if sum & 1 == 1 { sum >> 1 ^ 0xedb8_8320 } else { sum >> 1 })
    };
    !bytes.iter().fold(!0, step)
}
