//! Fetches ONNX Runtime's library with the user's own `pip`, whatever index and proxy that is set up for.
//!
//! The wheel's version and SHA-256 are pinned per platform; the library inside is what is used, no Python is needed to
//! run it. It appears in its folder in one step (write, sync, rename), so a broken download leaves nothing behind.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::infer::engine;
use crate::infer::library::{library_in, runtime_dir};
use crate::io::digest::sha256;
use crate::io::files;

/// The version fetched.
pub(crate) const VERSION: &str = "1.31.1";

/// A platform's wheel.
struct Wheel {
    os: &'static str,
    arch: &'static str,
    /// As pip names the platform.
    platform: &'static str,
    sha256: &'static str,
    /// The library inside.
    library: &'static str,
}

/// The wheels of onnxruntime 1.31.1 for Python 3.11; the library inside is the same for every Python.
const WHEELS: [Wheel; 4] = [
    Wheel {
        os: "linux",
        arch: "x86_64",
        platform: "manylinux_2_28_x86_64",
        sha256: "5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f",
        library: "libonnxruntime.so.1.31.1",
    },
    Wheel {
        os: "linux",
        arch: "aarch64",
        platform: "manylinux_2_28_aarch64",
        sha256: "da05378364c44d4407e463982d2bf8d5e4cfea873283757e48beeb41df97b7f3",
        library: "libonnxruntime.so.1.31.1",
    },
    Wheel {
        os: "macos",
        arch: "aarch64",
        platform: "macosx_14_0_arm64",
        sha256: "60b6b69bfe580eab576cacc5d132a0e9cf2a37fcfd18d46dd191042b1d1ed0d7",
        library: "libonnxruntime.1.31.1.dylib",
    },
    Wheel {
        os: "windows",
        arch: "x86_64",
        platform: "win_amd64",
        sha256: "c3d91b5de31e2fc82d71bd65b2b22bddee8b49057a3a36338e9a868e0ea90c05",
        library: "onnxruntime.dll",
    },
];

/// Why the library could not be fetched.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// No wheel is pinned for this platform.
    #[error(
        "no ONNX Runtime {VERSION} is known for {os} on {arch}; install it yourself and set ORT_DYLIB_PATH, or use the built-in engine"
    )]
    Platform {
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
    #[error("pip could not download onnxruntime {VERSION}: {message}")]
    Pip {
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

/// Fetches the pinned ONNX Runtime into `dir` (default: the application's data folder) and returns the library's path.
/// A library that is already there is kept.
///
/// # Errors
/// See [`FetchError`]; nothing is left behind then.
///
/// # Cost
/// A download of about 24 MB; seconds to minutes. Call it off the UI thread.
pub fn fetch_runtime(dir: Option<&Path>) -> Result<PathBuf, FetchError> {
    let dir = match dir {
        Some(dir) => dir.to_path_buf(),
        None => runtime_dir().ok_or(FetchError::NoFolder)?,
    };
    let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    let wheel = WHEELS.iter().find(|w| w.os == os && w.arch == arch).ok_or(FetchError::Platform { os, arch })?;
    if let Some(path) = library_in(&dir).filter(|path| path.ends_with(wheel.library)) {
        return Ok(path);
    }
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |source| FetchError::Io { path, source }
    };
    std::fs::create_dir_all(&dir).map_err(io(&dir))?;
    let download = tempfile::tempdir_in(&dir).map_err(io(&dir))?;
    pip_download(wheel, download.path())?;
    let path = std::fs::read_dir(download.path())
        .map_err(io(download.path()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .find(|path| path.extension().is_some_and(|ext| ext == "whl"))
        .ok_or_else(|| FetchError::Pip { message: "it left no wheel".into() })?;
    let bytes = files::read(&path, files::MODEL).map_err(io(&path))?;
    let found = sha256(&bytes);
    if found != wheel.sha256 {
        return Err(FetchError::Checksum { path, found, expected: wheel.sha256 });
    }
    let target = unpack(&bytes, wheel.library, &dir)?;
    engine::search_again();
    Ok(target)
}

fn pip_download(wheel: &Wheel, into: &Path) -> Result<(), FetchError> {
    let program = if cfg!(windows) { "python" } else { "python3" };
    let output = Command::new(program)
        .args(["-m", "pip", "download", "--no-deps", "--disable-pip-version-check", "--quiet"])
        .args(["--only-binary=:all:", "--implementation", "cp", "--python-version", "3.11", "--abi", "cp311"])
        .args(["--platform", wheel.platform, "--dest"])
        .arg(into)
        .arg(format!("onnxruntime=={VERSION}"))
        .output()
        .map_err(|source| FetchError::NoPython { program, source })?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    let message = lines[lines.len().saturating_sub(3)..].join(" ");
    Err(FetchError::Pip { message })
}

/// Takes the library and its licences out of the wheel.
fn unpack(wheel: &[u8], library: &str, dir: &Path) -> Result<PathBuf, FetchError> {
    let bad = |err: zip::result::ZipError| FetchError::Wheel { reason: err.to_string() };
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(wheel)).map_err(bad)?;
    let mut entry = |name: &str| -> Result<Vec<u8>, FetchError> {
        let mut file = archive.by_name(name).map_err(bad)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(|err| FetchError::Wheel { reason: err.to_string() })?;
        Ok(bytes)
    };
    for (name, target) in
        [("onnxruntime/LICENSE", "LICENSE"), ("onnxruntime/ThirdPartyNotices.txt", "ThirdPartyNotices.txt")]
    {
        write_whole(&dir.join(target), &entry(name)?)?;
    }
    let target = dir.join(library);
    write_whole(&target, &entry(&format!("onnxruntime/capi/{library}"))?)?;
    Ok(target)
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
    fn the_library_and_its_licences_are_unpacked() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = wheel(&[
            ("onnxruntime/LICENSE", b"MIT"),
            ("onnxruntime/ThirdPartyNotices.txt", b"others"),
            ("onnxruntime/capi/libonnxruntime.so.1.31.1", b"\x7fELF"),
        ]);
        let path = unpack(&bytes, "libonnxruntime.so.1.31.1", dir.path()).unwrap();
        assert_eq!(std::fs::read(path).unwrap(), b"\x7fELF");
        assert_eq!(std::fs::read(dir.path().join("LICENSE")).unwrap(), b"MIT");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 3, "no temporary file stays");
    }

    #[test]
    fn a_wheel_without_the_library_or_a_broken_one_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let empty = wheel(&[("onnxruntime/LICENSE", b"MIT"), ("onnxruntime/ThirdPartyNotices.txt", b"")]);
        assert!(matches!(unpack(&empty, "libonnxruntime.so.1.31.1", dir.path()), Err(FetchError::Wheel { .. })));
        assert!(matches!(unpack(b"PK", "x", dir.path()), Err(FetchError::Wheel { .. })));
        assert_eq!(library_in(dir.path()), None);
    }

    #[test]
    fn a_library_that_is_there_is_kept() {
        let dir = tempfile::tempdir().unwrap();
        match WHEELS.iter().find(|w| w.os == std::env::consts::OS && w.arch == std::env::consts::ARCH) {
            Some(wheel) => {
                let path = dir.path().join(wheel.library);
                std::fs::write(&path, b"kept").unwrap();
                assert_eq!(fetch_runtime(Some(dir.path())).unwrap(), path);
                assert_eq!(std::fs::read(path).unwrap(), b"kept");
            }
            None => assert!(matches!(fetch_runtime(Some(dir.path())), Err(FetchError::Platform { .. }))),
        }
    }

    #[test]
    fn every_pin_is_a_hash() {
        assert!(WHEELS.iter().all(|w| w.sha256.len() == 64 && w.sha256.bytes().all(|b| b.is_ascii_hexdigit())));
    }
}
