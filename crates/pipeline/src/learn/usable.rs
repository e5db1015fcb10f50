//! Requirements of a touch before anything is fitted to it or learned from it.

use touch2touch_core::grid::{DepthMap, RgbGrid};

/// Least share of an imprint that must have been measured.
const MEASURED: f64 = 0.5;

/// Why a touch cannot be fitted or learned from: its GelSlim picture is not finite, or too little of its imprint was measured.
pub fn unusable(gelslim: &RgbGrid, imprint: &DepthMap) -> Option<String> {
    if gelslim.as_slice().iter().flatten().any(|v| !v.is_finite()) {
        return Some("its GelSlim image has values that are not numbers".into());
    }
    let measured = imprint.as_slice().iter().filter(|v| v.is_finite()).count();
    ((measured as f64) < MEASURED * imprint.len() as f64)
        .then(|| format!("only {measured} of {} pixels of its imprint were measured", imprint.len()))
}
