//! What a file is that is called STL and is none.

/// The kind of the file and what to do, as a message ends; `None` where nothing is known of it.
pub(super) fn named(bytes: &[u8]) -> Option<&'static str> {
    let head = bytes[..bytes.len().min(4096)].trim_ascii_start();
    let small = String::from_utf8_lossy(head).to_ascii_lowercase();
    let first = |words: &[&str]| words.iter().any(|word| small.starts_with(word));
    Some(if first(&["version https://git-lfs"]) {
        "it is a pointer of Git LFS, the model itself was not downloaded: fetch it with `git lfs pull`"
    } else if head.starts_with(b"\x1f\x8b") {
        "it is compressed with gzip: unpack it first"
    } else if head.starts_with(b"PK\x03\x04") {
        "it is a zip archive (3MF is one as well): unpack it, or export the part as STL"
    } else if first(&["<!doctype html", "<html", "<head"]) {
        "it is a web page: download the file itself, not the page that shows it"
    } else if first(&["ply"]) {
        "it is a PLY mesh: convert it to STL"
    } else if first(&["iso-10303"]) {
        "it is a STEP model: export it as STL"
    } else if small.lines().filter(|line| line.trim_start().starts_with("v ")).count() > 1 {
        "it is an OBJ mesh: convert it to STL"
    } else {
        return None;
    })
}
