//! numpy's `.npy`: a magic number, a header that is a Python dict, and the values.
//!
//! <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>

use std::io::Read;

use crate::io::pt::{Tensor, Values, each, gathered};

const MAGIC: &[u8] = b"\x93NUMPY";
/// numpy pads the header so that the values begin at a multiple of this.
const ALIGNMENT: usize = 64;
/// Longest header. numpy itself refuses longer ones.
const MAX_HEADER: usize = 10_000;

/// Fields of the header.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    /// `<f4` and the like.
    descr: String,
    fortran: bool,
    shape: Vec<usize>,
    /// Product of the shape.
    pub(super) count: usize,
    /// Bytes before the values.
    length: usize,
}

/// Reads the header; the values follow. An array of more than `most` values is refused.
pub(super) fn header(from: &mut impl Read, most: usize) -> Result<Header, String> {
    let cut = |_| "its header is cut off".to_owned();
    let mut start = [0; 8];
    from.read_exact(&mut start).map_err(cut)?;
    if !start.starts_with(MAGIC) {
        return Err("it does not begin as numpy's arrays do".into());
    }
    let mut size = [0; 4];
    let size_bytes = if start[6] == 1 { 2 } else { 4 };
    from.read_exact(&mut size[..size_bytes]).map_err(cut)?;
    let size = u32::from_le_bytes(size) as usize;
    if size > MAX_HEADER {
        return Err(format!("its header has {size} bytes; at most {MAX_HEADER} are read"));
    }
    let mut text = vec![0; size];
    from.read_exact(&mut text).map_err(cut)?;
    let (descr, fortran, shape) = std::str::from_utf8(&text).ok().and_then(dict).ok_or_else(|| {
        format!("its header is not understood: {}", crate::io::files::clip(&String::from_utf8_lossy(&text)))
    })?;
    // An axis of length 0 must not hide what the others say.
    let count = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n.max(1)));
    if count.is_none_or(|count| count > most) {
        return Err(format!("shape {shape:?}: its values do not fit into the {most} that are read"));
    }
    let count = shape.iter().product();
    Ok(Header { descr, fortran, shape, count, length: start.len() + size_bytes + size })
}

/// `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }` in any order; nothing else.
fn dict(text: &str) -> Option<(String, bool, Vec<usize>)> {
    let (mut descr, mut fortran, mut shape) = (None, None, None);
    let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
    while !rest.is_empty() {
        let (key, after) = quoted(rest)?;
        let value = after.trim_start().strip_prefix(':')?.trim_start();
        let after = match key {
            "descr" => {
                let (value, after) = quoted(value)?;
                descr = Some(value.to_owned());
                after
            }
            "fortran_order" => {
                let (value, after) = value.split_at_checked(value.find(|c: char| !c.is_alphabetic())?)?;
                fortran = Some(match value {
                    "True" => true,
                    "False" => false,
                    _ => return None,
                });
                after
            }
            "shape" => {
                let (value, after) = value.strip_prefix('(')?.split_once(')')?;
                let value = value.trim();
                let value = value.strip_suffix(',').unwrap_or(value);
                // numpy of Python 2 wrote long integers with an L.
                let size = |n: &str| n.trim().trim_end_matches('L').parse().ok();
                shape = Some(if value.is_empty() {
                    Vec::new()
                } else {
                    value.split(',').map(size).collect::<Option<_>>()?
                });
                after
            }
            _ => return None,
        };
        let after = after.trim_start();
        rest = if after.is_empty() { after } else { after.strip_prefix(',')?.trim_start() };
    }
    Some((descr?, fortran?, shape?))
}

/// The text between quotes, and what follows.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

impl Header {
    /// Reads the values, of which there must be as many as the shape says in an array of `size` bytes.
    pub(super) fn values(self, from: &mut impl Read, size: u64) -> Result<Tensor, String> {
        let Self { descr, fortran, shape, count, length } = self;
        let unsupported = || format!("its element type {descr:?} is not supported");
        let mut letters = descr.chars();
        let big_endian = match letters.next() {
            Some('<' | '|' | '=') => false,
            Some('>') => true,
            _ => return Err(unsupported()),
        };
        let (kind, width) = (letters.next(), letters.as_str());
        let bytes_each = match (kind, width) {
            (Some('f'), "4" | "8")
            | (Some('u'), "1" | "2" | "4")
            | (Some('i'), "1" | "2" | "4" | "8")
            | (Some('b'), "1") => width.parse::<usize>().map_err(|_| unsupported())?,
            _ => return Err(unsupported()),
        };
        // The product is bounded by the header's check.
        let expected = count * bytes_each;
        if size != (length + expected) as u64 {
            return Err(format!(
                "the values of shape {shape:?} take {expected} bytes; it has {} for them",
                size.saturating_sub(length as u64)
            ));
        }
        let mut bytes = Vec::new();
        // One more than expected: the end of a compressed array is where its checksum is looked at.
        from.take(expected as u64 + 1).read_to_end(&mut bytes).map_err(|err| err.to_string())?;
        if bytes.len() != expected {
            return Err(format!("values of shape {shape:?} do not fit into {} bytes", bytes.len()));
        }
        if big_endian {
            bytes.chunks_exact_mut(bytes_each).for_each(<[u8]>::reverse);
        }
        if fortran {
            // The first index runs fastest.
            let strides = shape.iter().scan(1, |stride, n| Some(std::mem::replace(stride, *stride * n)));
            bytes = gathered(&bytes, bytes_each, &shape, &strides.collect::<Vec<usize>>());
        }
        let values = match (kind, bytes_each) {
            (Some('f'), 4) => Values::F32(each(&bytes, f32::from_le_bytes)),
            (Some('f'), _) => Values::F64(each(&bytes, f64::from_le_bytes)),
            (Some('b'), _) => Values::U8(bytes.iter().map(|&b| u8::from(b != 0)).collect()),
            (Some('u'), 1) => Values::U8(bytes),
            (Some('u'), 2) => Values::I64(each(&bytes, |b| i64::from(u16::from_le_bytes(b)))),
            (Some('u'), _) => Values::I64(each(&bytes, |b| i64::from(u32::from_le_bytes(b)))),
            (_, 1) => Values::I64(each(&bytes, |b| i64::from(i8::from_le_bytes(b)))),
            (_, 2) => Values::I64(each(&bytes, |b| i64::from(i16::from_le_bytes(b)))),
            (_, 4) => Values::I64(each(&bytes, |b| i64::from(i32::from_le_bytes(b)))),
            _ => Values::I64(each(&bytes, i64::from_le_bytes)),
        };
        Ok(Tensor { shape, values })
    }
}

/// The whole file of an array.
pub(super) fn bytes(shape: &[usize], values: &Values) -> Vec<u8> {
    let descr = match values {
        Values::F32(_) => "<f4",
        Values::F64(_) => "<f8",
        Values::U8(_) => "|u1",
        Values::I64(_) => "<i8",
    };
    // A tuple of one has a comma in Python.
    let sizes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let sizes = if shape.len() > 1 { sizes.trim_end_matches(", ") } else { sizes.trim_end() };
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({sizes}), }}");
    let before = MAGIC.len() + 4;
    let padded = (before + header.len() + 1).next_multiple_of(ALIGNMENT);
    header.extend(std::iter::repeat_n(' ', padded - before - header.len() - 1));
    header.push('\n');
    let mut out = [MAGIC, &[1, 0]].concat();
    // A shape of a few numbers is far shorter than this.
    out.extend((header.len() as u16).to_le_bytes());
    out.extend(header.bytes());
    out.extend(values.bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_those_of_numpy_and_nothing_else() {
        let all = Some(("<f4".to_owned(), false, vec![2, 3]));
        assert_eq!(dict("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }  \n"), all);
        assert_eq!(dict("{\"shape\":(2L,3L),\"fortran_order\":False,\"descr\":\"<f4\"}"), all);
        assert_eq!(dict("{'descr': '|u1', 'fortran_order': True, 'shape': (), }").unwrap().2, Vec::<usize>::new());
        for bad in [
            "",
            "{}",
            "{'descr': '<f4', 'fortran_order': False}",
            "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': 0, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1,,)}",
            "{'descr': '<f4' 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': ((((1,)",
            "{'é",
        ] {
            assert_eq!(dict(bad), None, "{bad}");
        }
    }

    #[test]
    fn what_is_written_has_numpys_form() {
        let written = bytes(&[3], &Values::U8(vec![7, 8, 9]));
        let text = String::from_utf8_lossy(&written);
        assert!(text.contains("{'descr': '|u1', 'fortran_order': False, 'shape': (3,), }"), "{text}");
        assert_eq!((written.len() - 3) % ALIGNMENT, 0);
        for shape in [vec![], vec![1], vec![2, 3], vec![0, 4]] {
            let values = Values::F64((0..shape.iter().product()).map(|i| i as f64).collect());
            let written = bytes(&shape, &values);
            let mut from = written.as_slice();
            let read = header(&mut from, 100).unwrap().values(&mut from, written.len() as u64).unwrap();
            assert_eq!(read, Tensor { shape, values });
        }
    }
}
