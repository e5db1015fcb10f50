//! Fetches ONNX Runtime's library with the user's own `pip`, whatever index and proxy that is set up for.
//!
//! The wheel's version and SHA-256 are pinned per platform; the library inside is what is used, no Python is needed to
//! run it. It appears in its folder in one step (write, sync, rename), so a broken download leaves nothing behind.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::infer::engine::{self, Provider};
use crate::infer::library::{is_library, library_in};
use crate::infer::packages::{Package, Wheel, runtime_dir};
use crate::io::digest::sha256;
use crate::io::files;

/// Why the library could not be fetched.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// No wheel is pinned for this platform.
    #[error(
        "no ONNX Runtime{} is known for {os} on {arch}; install one yourself and set ORT_DYLIB_PATH, or use the built-in engine",
        .provider.map(|provider| format!(" with {}", provider.name())).unwrap_or_default()
    )]
    Platform {
        /// Provider that it should have.
        provider: Option<Provider>,
        /// Operating system.
        os: &'static str,
        /// Processor.
        arch: &'static str,
    },
    /// There is no home folder to put it in.
    #[error("there is no data folder for the library; name one, or set TOUCH2TOUCH_DATA")]
    NoFolder,
    /// Python or its pip is missing.
    #[error(
        "`{program}` could not be started ({source}); install Python 3 with pip (Debian, Ubuntu: `apt install python3-pip`), or set ORT_DYLIB_PATH to a library of ONNX Runtime 1.24 or newer"
    )]
    NoPython {
        /// The program's name.
        program: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// Pip said no.
    #[error("pip could not download {package}: {message}")]
    Pip {
        /// Name and version of the package.
        package: String,
        /// The end of what it said.
        message: String,
    },
    /// The wheel is not the pinned one.
    #[error("the downloaded {} has SHA-256 {found}, not {expected}: it was not unpacked", path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
        /// Hash of the file.
        found: String,
        /// The pinned hash.
        expected: &'static str,
    },
    /// The wheel does not hold the library.
    #[error("the wheel cannot be unpacked: {reason}")]
    Wheel {
        /// Why.
        reason: String,
    },
    /// The library cannot be written.
    #[error("{source}: {}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Fetches the pinned ONNX Runtime, the plain one or that with a provider, into `dir` (default: the application's data folder)
/// and returns the library's path. A library that is already there is kept.
///
/// # Errors
/// See [`FetchError`]; no library is left behind then.
///
/// # Cost
/// A download of about 24 MB, 85 MB with OpenVINO, 300 MB with CUDA; seconds to minutes. Call it off the UI thread.
pub fn fetch_runtime(dir: Option<&Path>, provider: Option<Provider>) -> Result<PathBuf, FetchError> {
    let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    let known = Package::of(provider).and_then(|package| Some((package, package.wheel()?)));
    let (package, wheel) = known.ok_or(FetchError::Platform { provider, os, arch })?;
    let dir = match dir {
        Some(dir) => dir.to_path_buf(),
        None => package.folder(&runtime_dir().ok_or(FetchError::NoFolder)?),
    };
    if let Some(path) = library_in(&dir).filter(|path| of_version(path, package.version)) {
        return Ok(path);
    }
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |source| FetchError::Io { path, source }
    };
    std::fs::create_dir_all(&dir).map_err(io(&dir))?;
    let download = tempfile::tempdir_in(&dir).map_err(io(&dir))?;
    pip_download(package, wheel, download.path())?;
    let path = std::fs::read_dir(download.path())
        .map_err(io(download.path()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .find(|path| path.extension().is_some_and(|ext| ext == "whl"))
        .ok_or_else(|| FetchError::Pip { package: package.name.into(), message: "it left no wheel".into() })?;
    let bytes = files::read(&path, files::MODEL).map_err(io(&path))?;
    let found = sha256(&bytes);
    if found != wheel.sha256 {
        return Err(FetchError::Checksum { path, found, expected: wheel.sha256 });
    }
    let target = unpack(&bytes, &dir)?;
    engine::search_again();
    Ok(target)
}

/// The library is of this version; where names have none, of any.
fn of_version(library: &Path, version: &str) -> bool {
    let name = library.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.contains(version) || !name.contains(|c: char| c.is_ascii_digit())
}

fn pip_download(package: &Package, wheel: &Wheel, into: &Path) -> Result<(), FetchError> {
    let program = if cfg!(windows) { "python" } else { "python3" };
    let named = format!("{}=={}", package.name, package.version);
    let output = Command::new(program)
        .args(["-m", "pip", "download", "--no-deps", "--disable-pip-version-check", "--quiet"])
        .args(["--only-binary=:all:", "--implementation", "cp", "--python-version", "3.11", "--abi", "cp311"])
        .args(["--platform", wheel.platform, "--dest"])
        .arg(into)
        .arg(&named)
        .output()
        .map_err(|source| FetchError::NoPython { program, source })?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    let message = lines[lines.len().saturating_sub(3)..].join(" ");
    Err(FetchError::Pip { package: named, message })
}

/// Takes the libraries and their licences out of the wheel; that of ONNX Runtime last, so that it is there when all is.
fn unpack(wheel: &[u8], dir: &Path) -> Result<PathBuf, FetchError> {
    let bad = |err: zip::result::ZipError| FetchError::Wheel { reason: err.to_string() };
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(wheel)).map_err(bad)?;
    let names = archive.file_names().map(|name| Ok(name?.into_owned()));
    let names: Vec<String> = names.collect::<Result<_, _>>().map_err(bad)?;
    let mut wanted: Vec<(&str, &str)> = names
        .iter()
        .filter_map(|name| {
            let file = name.strip_prefix("onnxruntime/capi/").filter(|file| is_shared_library(file));
            let file = file.or_else(|| name.strip_prefix("onnxruntime/").filter(|file| LICENCES.contains(file)))?;
            Some((name.as_str(), file))
        })
        .collect();
    wanted.sort_by_key(|(_, file)| is_library(file));
    let target = wanted.last().filter(|(_, file)| is_library(file)).map(|(_, file)| dir.join(file));
    let target = target.ok_or_else(|| FetchError::Wheel { reason: "no library of ONNX Runtime is in it".into() })?;
    for (name, file) in wanted {
        let mut entry = archive.by_name(name).map_err(bad)?;
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).map_err(|err| FetchError::Wheel { reason: err.to_string() })?;
        write_whole(&dir.join(file), &bytes)?;
    }
    Ok(target)
}

const LICENCES: [&str; 2] = ["LICENSE", "ThirdPartyNotices.txt"];

/// A library of the system, and not the module for Python.
fn is_shared_library(file: &str) -> bool {
    let ends = [".so", ".dylib", ".dll"].iter().any(|ext| file.contains(ext));
    ends && !file.contains('/') && !file.contains("pybind11")
}

/// Writes a file so that it is there whole or not at all.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), FetchError> {
    let write = || -> std::io::Result<()> {
        let mut builder = tempfile::Builder::new();
        // Temporary files are private; a library in a shared folder must not be.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
        let mut file = builder.tempfile_in(path.parent().unwrap_or(Path::new(".")))?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|err| err.error)?;
        Ok(())
    };
    write().map_err(|source| FetchError::Io { path: path.to_path_buf(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheel(entries: &[(&str, &[u8])]) -> Vec<u8> {
        let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, bytes) in entries {
            archive.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
            archive.write_all(bytes).unwrap();
        }
        archive.finish().unwrap().into_inner()
    }

    #[test]
    fn the_libraries_and_their_licences_are_unpacked() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = wheel(&[
            ("onnxruntime/capi/libonnxruntime.so.1.31.1", b"\x7fELF"),
            ("onnxruntime/LICENSE", b"MIT"),
            ("onnxruntime/ThirdPartyNotices.txt", b"others"),
            ("onnxruntime/capi/libonnxruntime_providers_openvino.so", b"\x7fELF"),
            ("onnxruntime/capi/onnxruntime_pybind11_state.cpython-311-x86_64-linux-gnu.so", b"\x7fELF"),
            ("onnxruntime/capi/build.py", b""),
        ]);
        let path = unpack(&bytes, dir.path()).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"\x7fELF");
        assert_eq!(library_in(dir.path()), Some(path));
        assert_eq!(std::fs::read(dir.path().join("LICENSE")).unwrap(), b"MIT");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 4, "no temporary file stays, nothing of Python's");
    }

    #[test]
    fn a_wheel_without_the_library_or_a_broken_one_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let empty = wheel(&[("onnxruntime/LICENSE", b"MIT"), ("onnxruntime/ThirdPartyNotices.txt", b"")]);
        assert!(matches!(unpack(&empty, dir.path()), Err(FetchError::Wheel { .. })));
        assert!(matches!(unpack(b"PK", dir.path()), Err(FetchError::Wheel { .. })));
        assert_eq!(library_in(dir.path()), None);
    }

    #[test]
    fn a_library_that_is_there_is_kept() {
        let dir = tempfile::tempdir().unwrap();
        let plain = Package::of(None).unwrap();
        match plain.wheel() {
            Some(_) => {
                let path = dir.path().join(format!("libonnxruntime.so.{}", plain.version));
                std::fs::write(&path, b"kept").unwrap();
                assert_eq!(fetch_runtime(Some(dir.path()), None).unwrap(), path);
                assert_eq!(std::fs::read(path).unwrap(), b"kept");
            }
            None => assert!(matches!(fetch_runtime(Some(dir.path()), None), Err(FetchError::Platform { .. }))),
        }
    }

    #[test]
    fn what_no_index_has_for_this_system_is_said() {
        let absent = if cfg!(windows) { Provider::CoreMl } else { Provider::DirectMl };
        let said = fetch_runtime(None, Some(absent)).unwrap_err().to_string();
        assert!(said.contains(absent.name()) && said.contains("ORT_DYLIB_PATH"), "{said}");
    }
}
