//! Search for the library of ONNX Runtime.

use std::path::{Path, PathBuf};
use std::process::Command;

/// All places to look at, in order, each with the library that lies there.
pub(super) fn candidates() -> impl Iterator<Item = (String, Option<PathBuf>)> {
    // Each place is looked at only when the ones before it had nothing: the last one starts a program.
    let named = std::iter::once_with(|| {
        let path = std::env::var_os("ORT_DYLIB_PATH").filter(|v| !v.is_empty()).map(PathBuf::from);
        match path {
            Some(path) if path.is_dir() => (format!("ORT_DYLIB_PATH ({})", path.display()), library_in(&path)),
            Some(path) => (format!("ORT_DYLIB_PATH ({})", path.display()), path.is_file().then_some(path)),
            None => ("ORT_DYLIB_PATH (not set)".into(), None),
        }
    });
    let beside = std::iter::once_with(|| {
        let dir = std::env::current_exe().ok().and_then(|exe| exe.parent().map(Path::to_path_buf));
        match dir {
            Some(dir) => (format!("beside the program ({})", dir.display()), library_in(&dir)),
            None => ("beside the program (unknown)".into(), None),
        }
    });
    let packages = std::iter::once_with(|| {
        let library = python_packages().iter().find_map(|dir| library_in(&dir.join("onnxruntime/capi")));
        ("Python's package folders".into(), library)
    });
    let python = std::iter::once_with(|| {
        let library = python_onnxruntime().and_then(|dir| library_in(&dir.join("capi")));
        ("the onnxruntime package of `python3`".into(), library)
    });
    named.chain(beside).chain(packages).chain(python)
}

/// The library in `dir`; the last by name where there are several.
fn library_in(dir: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(dir).ok()?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    files.filter(|path| path.file_name().and_then(|n| n.to_str()).is_some_and(is_library)).max()
}

/// The library's own file, not one that it loads.
fn is_library(file: &str) -> bool {
    let plain = file.strip_prefix("lib").unwrap_or(file);
    let end = plain.strip_prefix("onnxruntime.").map(|end| end.trim_matches(|c: char| c == '.' || c.is_ascii_digit()));
    matches!(end, Some("so" | "dylib" | "dll"))
}

/// Package folders of the Pythons that can be found without starting one.
fn python_packages() -> Vec<PathBuf> {
    let mut prefixes: Vec<PathBuf> =
        ["VIRTUAL_ENV", "CONDA_PREFIX"].iter().filter_map(std::env::var_os).map(PathBuf::from).collect();
    prefixes.extend(dirs::home_dir().map(|home| home.join(".local")));
    prefixes.extend(["/usr/local", "/opt/homebrew", "/usr"].map(PathBuf::from));
    let mut found = Vec::new();
    for prefix in prefixes {
        found.push(prefix.join("Lib/site-packages"));
        let Ok(entries) = std::fs::read_dir(prefix.join("lib")) else { continue };
        let mut pythons: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.starts_with("python3")))
            .collect();
        pythons.sort();
        for python in pythons.iter().rev() {
            found.extend(["site-packages", "dist-packages"].map(|name| python.join(name)));
        }
    }
    found
}

/// Asks the Python on the path, without importing the package.
fn python_onnxruntime() -> Option<PathBuf> {
    const QUESTION: &str = "import importlib.util as u; s = u.find_spec('onnxruntime'); \
                            print(list(s.submodule_search_locations)[0] if s else '')";
    let python = if cfg!(windows) { "python" } else { "python3" };
    let output = Command::new(python).args(["-I", "-c", QUESTION]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let text = text.trim();
    (output.status.success() && !text.is_empty()).then(|| PathBuf::from(text))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_packed_library_is_none() {
        let names = ["libonnxruntime.so.1.31.1", "libonnxruntime.1.31.1.dylib", "onnxruntime.dll"];
        assert!(names.into_iter().all(super::is_library));
        assert!(!super::is_library("libonnxruntime.so.1.31.1.xz") && !super::is_library("libonnxruntime_providers.so"));
    }
}
