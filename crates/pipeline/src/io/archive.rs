//! Writing zip archives.

use std::io::{self, Cursor};
use std::path::Path;

use zip::ZipWriter;

use super::atomic;

/// Writes an archive of what `fill` puts into it, whole or not at all. It is made in memory, because the archive's writer prints
/// what goes wrong when it is given up half-way, and nothing goes wrong there.
///
/// # Errors
/// Whatever `fill` or the disk says; the file at `path` is then unchanged.
pub(super) fn write(
    path: &Path,
    fill: impl FnOnce(&mut ZipWriter<Cursor<Vec<u8>>>) -> io::Result<()>,
) -> io::Result<()> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    fill(&mut zip)?;
    atomic::write_bytes(path, zip.finish()?.get_ref())
}
