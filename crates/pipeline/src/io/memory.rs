//! Memory of the program.

use std::path::Path;

use super::files;

/// The most so far, MiB; `None` where the system does not tell.
pub fn peak_mib() -> Option<u64> {
    let status = files::read(Path::new("/proc/self/status"), files::SMALL).ok()?;
    let status = String::from_utf8(status).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? / 1024)
}
