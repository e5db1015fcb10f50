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
use touch2touch_pipeline::job::{Cancel, JobCx, Progress};

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
fn torch() -> Option<OsString> {
    let python = std::env::var_os("TOUCH2TOUCH_TORCH_PYTHON");
    python.or_else(|| left_out("TOUCH2TOUCH_TORCH_PYTHON is not set: PyTorch itself is not asked", "REQUIRE_TORCH"))
}

/// Runs a script on files in that Python, where there is one.
pub(crate) fn torch_runs(script: &str, files: &[PathBuf]) {
    let Some(python) = torch() else { return };
    let mut command = Command::new(python);
    let out = command.args(["-c", script]).args(files).env("OMP_NUM_THREADS", "1").output().unwrap();
    assert!(out.status.success(), "{}", error_text(&out));
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

/// As [`run`], where the program must succeed.
pub(crate) fn succeed(args: &[&str], data: &Path) -> Output {
    let output = run(args, data);
    assert!(output.status.success(), "{}", error_text(&output));
    output
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
    succeed(&[&fixed[..], words].concat(), set.parent().unwrap());
}

/// A folder and the set of simulated grasps in it.
pub(crate) fn simulated(tools: &str, words: &[&str]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    simulate(&set, tools, words);
    (dir, set)
}

/// Asserts that a text has all of these parts.
pub(crate) fn assert_says(text: &str, all: &[&str]) {
    for expected in all {
        assert!(text.contains(*expected), "`{expected}` is missing in:\n{text}");
    }
}

/// A job that is cancelled once its progress is so.
pub(crate) fn cancelled_when(so: impl Fn(Progress) -> bool + Send + Sync + 'static) -> JobCx {
    let cancel = Cancel::default();
    let told = cancel.clone();
    let watch = move |progress: Progress| {
        if so(progress) {
            told.cancel();
        }
    };
    JobCx::new(cancel, Arc::new(watch))
}

/// A tetrahedron with three edges of this length along the axes.
pub(crate) fn tetrahedron(size: f64) -> TriMesh {
    let corners = [[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    TriMesh { vertices: corners.map(glam::DVec3::from_array).to_vec(), triangles }
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

/// All files below a folder.
pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let inside = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    inside.flat_map(|path| if path.is_dir() { files_below(&path) } else { vec![path] }).collect()
}

/// All Rust files below a folder of the repository.
pub(crate) fn rust_files(folder: impl AsRef<Path>) -> Vec<PathBuf> {
    let mut files = files_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
    files.retain(|path| path.extension().is_some_and(|e| e == "rs"));
    files
}
