//! What several test modules need.

use std::path::PathBuf;

/// The folder with real and reference data that only some machines have: `TOUCH2TOUCH_SHARED`, else `../shared`
/// beside the checkout. `None` (with a note) where it is absent: the product's tests pass without it.
pub(crate) fn shared() -> Option<PathBuf> {
    let path = std::env::var_os("TOUCH2TOUCH_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("no reference data at {}: this part of the test is left out", path.display());
    None
}

/// Whether a missing GPU, model runtime or window is a failure instead of a reason to leave a test out.
/// The check script sets it, so that nothing is skipped unnoticed.
pub(crate) fn require(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|v| v != "0" && !v.is_empty())
}

/// A numpy archive: arrays by name, flattened in C order, as f64.
pub(crate) struct Npz(zip::ZipArchive<std::fs::File>);

impl Npz {
    /// Opens `path`; panics with the path if that fails.
    pub(crate) fn open(path: &std::path::Path) -> Self {
        let file = std::fs::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self(zip::ZipArchive::new(file).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
    }

    /// Reads the array `name` of any number type that the reference data uses.
    pub(crate) fn read(&mut self, name: &str) -> Vec<f64> {
        use npyz::{DType, NpyFile};
        let entry = self.0.by_name(&format!("{name}.npy")).unwrap_or_else(|e| panic!("{name}: {e}"));
        let npy = NpyFile::new(entry).unwrap();
        let DType::Plain(kind) = npy.dtype() else { panic!("{name}: not a plain array") };
        match kind.to_string().as_str() {
            "<f4" => npy.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect(),
            "<f8" => npy.into_vec::<f64>().unwrap(),
            "|u1" => npy.into_vec::<u8>().unwrap().into_iter().map(f64::from).collect(),
            "<i8" => npy.into_vec::<i64>().unwrap().into_iter().map(|v| v as f64).collect(),
            other => panic!("{name}: type {other}"),
        }
    }
}
