//! What several test modules need.

use std::ffi::OsString;
use std::fmt::Display;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of real and reference data that only some machines have: in `TOUCH2TOUCH_SHARED`, else in `../shared` beside
/// the checkout. `REQUIRE_SHARED=1` demands it.
pub(crate) fn shared(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("TOUCH2TOUCH_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        Some(path)
    } else {
        left_out(format!("no reference data at {}", path.display()), "REQUIRE_SHARED")
    }
}

/// A graphics device. `REQUIRE_GPU=1` demands it.
pub(crate) fn gpu() -> Option<touch2touch::gpu::Gpu> {
    touch2touch::gpu::Gpu::headless().map_or_else(|err| left_out(err, "REQUIRE_GPU"), Some)
}

/// A Python with PyTorch, named by `TOUCH2TOUCH_TORCH_PYTHON`. `REQUIRE_TORCH=1` demands it.
pub(crate) fn torch() -> Option<OsString> {
    let python = std::env::var_os("TOUCH2TOUCH_TORCH_PYTHON");
    python.or_else(|| left_out("TOUCH2TOUCH_TORCH_PYTHON is not set: PyTorch itself is not asked", "REQUIRE_TORCH"))
}

/// A Python with the package installed, named by `TOUCH2TOUCH_PYTHON`, as the check script has made it. `REQUIRE_PYTHON=1`
/// demands it.
pub(crate) fn python() -> Option<PathBuf> {
    let python = std::env::var_os("TOUCH2TOUCH_PYTHON").map(PathBuf::from);
    python.or_else(|| left_out("TOUCH2TOUCH_PYTHON names no Python with the package", "REQUIRE_PYTHON"))
}

/// The folder of an ONNX Runtime with OpenVINO, as the check script has installed it.
pub(crate) fn openvino() -> Option<String> {
    let named = std::env::var("TOUCH2TOUCH_OPENVINO").ok().filter(|dir| Path::new(dir).is_dir());
    named.or_else(|| left_out("TOUCH2TOUCH_OPENVINO names no folder with OpenVINO", "REQUIRE_ORT"))
}

/// Says that this machine lacks something that the running test needs, which is then not tried: a failure where
/// `variable` demands it. Every test that leaves something out does it through here.
pub(crate) fn left_out<T>(why: impl Display, variable: &str) -> Option<T> {
    assert!(!require(variable), "{variable} is set, but: {why}");
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    // Not by the macro: what it prints is only shown for tests that fail.
    writeln!(std::io::stderr(), "NOT TRIED by {test}: {why} ({variable}=1 makes this a failure)").ok();
    None
}

/// Whether what is missing is a failure instead of a reason to leave a test out. The check script sets it, so that nothing
/// is skipped unnoticed.
fn require(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|v| v != "0" && !v.is_empty())
}

/// Runs the program; `data` stands for all folders of the user.
pub(crate) fn run(args: &[&str], data: &Path) -> Output {
    command(args, data).output().unwrap()
}

/// The program as [`run`] runs it.
pub(crate) fn command(args: &[&str], data: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_touch2touch"));
    command
        .args(args)
        // Nothing of the user's may be read or written by a test.
        .env("TOUCH2TOUCH_DATA", data)
        .env("XDG_DATA_HOME", data)
        .env("XDG_CONFIG_HOME", data)
        .env("TOUCH2TOUCH_CACHE", data);
    command
}

/// All Rust files below a folder.
pub(crate) fn rust_files(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}
