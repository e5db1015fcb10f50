//! What several test modules need.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Display;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::Value;
use touch2touch_core::catalog::ToolSpec;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::sim;
use touch2touch_pipeline::io::simulated::{Layout, pair_paths, write_pair, write_tools};

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

/// Writes simulated grasps of these tools and their CAD models. Each grasp is simulated by the first test that asks for it;
/// the files are each test's own.
pub(crate) fn write_grasps(root: &Path, layout: Layout, tools: &[ToolSpec], grasps: u64) {
    for tool in tools {
        for index in 0..grasps {
            let files = grasp_files(tool, index);
            for (path, bytes) in pair_paths(root, layout, &tool.name, index).iter().zip(files.iter()) {
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(path, bytes).unwrap();
            }
        }
    }
    let meshes: Vec<_> = tools.iter().map(|tool| (tool.name.as_str(), tool.seen, mesh(tool))).collect();
    write_tools(root, &meshes).unwrap();
}

/// The contents of a GelSlim and of a bubble file.
type PairFiles = Arc<[Vec<u8>; 2]>;

/// The files of a simulated grasp.
fn grasp_files(tool: &ToolSpec, index: u64) -> PairFiles {
    static MADE: Mutex<BTreeMap<(String, u64), PairFiles>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let files = made.entry((tool.name.clone(), index)).or_insert_with(|| {
        let folder = tempfile::tempdir().unwrap();
        let sample = sim::simulate(tool, sim::random_grasp(index + 3), index, &sim::SimConfig::default());
        let written = write_pair(folder.path(), Layout::Train, &tool.name, index, &sample).unwrap();
        Arc::new(written.map(|file| std::fs::read(file).unwrap()))
    });
    files.clone()
}

/// The CAD model of a tool, made once.
pub(crate) fn mesh(tool: &ToolSpec) -> TriMesh {
    static MADE: Mutex<BTreeMap<String, TriMesh>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(tool.name.clone()).or_insert_with(|| tool.mesh()).clone()
}

/// The one line of JSON that a verb answers with.
pub(crate) fn json(output: &Output) -> Value {
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(text.trim().lines().count(), 1, "one line of JSON, got {text:?}; {}", error_text(output));
    serde_json::from_str(&text).unwrap_or_else(|err| panic!("{err}: {text}"))
}

/// Standard error of a verb.
pub(crate) fn error_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Has the program write simulated grasps.
pub(crate) fn simulate(set: &Path, tools: &str, words: &[&str]) {
    let fixed = ["simulate", "--out", set.to_str().unwrap(), "--tools", tools];
    let made = run(&[&fixed[..], words].concat(), set.parent().unwrap());
    assert!(made.status.success(), "{}", error_text(&made));
}

/// A tiny bundle of the tests, written by `make_bundles.py` there.
pub(crate) fn tiny(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles").join(name)
}

/// A copy of a tiny bundle with another manifest.
pub(crate) fn tiny_with(name: &str, change: impl FnOnce(&mut Value)) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    copy_folder(&tiny(name), dir.path());
    edit_json(&dir.path().join("manifest.json"), change);
    dir
}

/// Changes a file of JSON.
pub(crate) fn edit_json(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    change(&mut value);
    std::fs::write(file, value.to_string()).unwrap();
}

/// Copies a folder with all that is in it.
pub(crate) fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(|entry| entry.unwrap()) {
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy_folder(&entry.path(), &to),
            false => drop(std::fs::copy(entry.path(), to).unwrap()),
        }
    }
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
