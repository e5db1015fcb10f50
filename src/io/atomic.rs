//! Files that are either the old or the new one, never half of either.

use std::fs::File;
use std::io;
use std::path::Path;

/// Writes to a temporary file in the same folder, flushes it to the disk, and renames it over `path`.
///
/// A crash at any moment leaves the previous file (or none) and at most a stray temporary file.
///
/// # Errors
/// Whatever the disk says; `path` is then unchanged.
pub fn write(path: &Path, content: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tmp-").suffix(".part");
    // Temporary files are private by default; the finished file is an ordinary one.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o644));
    }
    let mut temporary = builder.tempfile_in(folder)?;
    content(temporary.as_file_mut())?;
    temporary.as_file().sync_all()?;
    temporary.persist(path).map_err(|err| err.error)?;
    // The rename itself is in the folder; not every system can flush a folder, and the content is safe already.
    #[cfg(unix)]
    if let Ok(folder) = File::open(folder) {
        folder.sync_all().ok();
    }
    Ok(())
}

/// [`write()`] with the bytes at hand.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, |file| io::Write::write_all(file, bytes))
}
