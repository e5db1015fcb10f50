//! Meters and radians inside, millimeters and degrees on screen: the only place that converts and formats.

/// A number of things in words: `1 mask`, `3 masks`.
pub fn counted(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

/// Meters to millimeters.
pub fn mm(meters: f64) -> f64 {
    meters * 1e3
}

/// A number with fixed decimals that never reads `-0.00`.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.bytes().all(|b| matches!(b, b'0' | b'.')) => size.to_owned(),
        _ => text,
    }
}

/// `8.42 mm`: lengths are shown with two decimals.
pub fn text_mm(meters: f64) -> String {
    format!("{} mm", fixed(mm(meters), 2))
}

/// `12.3°`: angles are shown with one decimal.
pub fn text_deg(radians: f64) -> String {
    format!("{}°", fixed(radians.to_degrees(), 1))
}

/// `1.3 %`: shares are shown with one decimal; one that is not zero never reads `0.0 %`.
pub(crate) fn text_percent(share: f64) -> String {
    if share > 0.0 && share < 0.0005 { "< 0.1 %".into() } else { format!("{} %", fixed(100.0 * share, 1)) }
}

/// The factor to meters for a tool whose longest side is `size` in an unknown unit: 1 if it may be meters, else that
/// of mm, cm, inch, µm or of a mesh scaled twice, whichever makes it as large as a hand-held tool first.
/// `None` if none does.
pub fn scale_to_meters(size: f64) -> Option<f64> {
    [1.0, 1e-3, 1e-2, 0.0254, 1e-6, 1e3].into_iter().find(|scale| is_tool_length(size * scale))
}

/// True where a hand-held tool can be so long, meters.
pub fn is_tool_length(meters: f64) -> bool {
    (0.004..=0.4).contains(&meters)
}

/// A number of unknown unit for a message: four significant digits.
pub fn significant(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let scale = 10f64.powi(3 - x.abs().log10().floor() as i32);
    if scale.is_normal() { (x * scale).round() / scale } else { x }
}

/// The angle brought into (-π, π].
pub fn wrap_angle(radians: f64) -> f64 {
    let wrapped = radians.rem_euclid(std::f64::consts::TAU);
    if wrapped > std::f64::consts::PI { wrapped - std::f64::consts::TAU } else { wrapped }
}

/// The size of the difference of two angles, in [0, π]: 359° and 1° are 2° apart.
pub fn angle_error(a: f64, b: f64) -> f64 {
    wrap_angle(a - b).abs()
}

/// A number from a file or a text box, brought into a range; what is not finite becomes `default`.
pub fn clamp_or<T: Copy + PartialOrd + Into<f64>>(value: T, lo: T, hi: T, default: T) -> T {
    match value {
        value if !value.into().is_finite() => default,
        value if value < lo => lo,
        value if value > hi => hi,
        value => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_error_wraps() {
        assert!((angle_error(359f64.to_radians(), 1f64.to_radians()) - 2f64.to_radians()).abs() < 1e-12);
        assert!((angle_error(0.3, 0.3 + std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!(text_deg(-0.1), "-5.7°");
        assert_eq!((fixed(-0.0004, 2), fixed(-0.006, 2), fixed(-1.0, 0)), ("0.00".into(), "-0.01".into(), "-1".into()));
        assert_eq!(text_mm(0.00842), "8.42 mm");
        assert_eq!((significant(64.3519458), significant(-1.23456e-5), significant(0.0)), (64.35, -1.235e-5, 0.0));
        assert!(significant(f64::NAN).is_nan() && significant(1e-310) == 1e-310);
    }
}
