//! Pictures of imprints as a notebook shows them.

use pyo3::PyResult;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::picture::colored;
use touch2touch_pipeline::io::images::png_bytes;

use crate::process::refused;

/// The color range of imprints, meters.
const RANGE: Range = Range { lo: 0.0, hi: 0.018 };

/// Imprints side by side below a caption, as HTML with the pictures in it.
pub(crate) fn html<'a>(caption: &str, imprints: impl Iterator<Item = &'a DepthMap>) -> PyResult<String> {
    let mut out = format!("<div>{caption}</div>");
    for imprint in imprints {
        let png = png_bytes(&colored(imprint, ColorMap::Viridis, RANGE)).map_err(|err| refused(err.to_string()))?;
        out += &format!("<img style=\"margin-right:4px\" src=\"data:image/png;base64,{}\">", base64(&png));
    }
    Ok(out)
}

/// Bytes as text of 64 letters (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = char::from(LETTERS[(bits >> (18 - 6 * i) & 63) as usize]);
            out.push(if i <= group.len() { letter } else { '=' });
        }
    }
    out
}
