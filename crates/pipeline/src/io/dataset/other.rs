//! Names of what a folder holds that is no data set of ours: [`kind`].

use std::path::Path;

/// Most entries of a folder that are looked at.
const MOST: usize = 4096;

/// Names that tell a container: ends of files' names, in lower case, or whole names.
const KINDS: [(&str, &[&str]); 11] = [
    ("a LeRobot data set (meta/info.json, Parquet)", &["meta/info.json"]),
    ("a rosbag", &[".bag", ".db3", ".mcap"]),
    ("a Zarr store", &[".zarr", ".zgroup", ".zarray", "zarr.json"]),
    ("HDF5 files", &[".h5", ".hdf5", ".hdf"]),
    ("numpy's archives", &[".npz"]),
    ("numpy's arrays", &[".npy"]),
    ("Parquet files", &[".parquet"]),
    ("TFRecord files (RLDS)", &[".tfrecord"]),
    ("MATLAB files", &[".mat"]),
    ("Python pickles", &[".pkl", ".pickle"]),
    ("videos", &[".mp4", ".avi", ".mkv", ".mov", ".webm"]),
];

/// The kind of what lies at a path that was asked for: the file itself, or what is in the folder.
pub(super) fn kind(path: &Path, folder: &Path) -> Option<&'static str> {
    let lower = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let mut names = vec![lower(path)];
    if path.is_dir() {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().take(MOST);
        names.extend(entries.map(|entry| lower(&entry.path())));
        if folder.join("meta").join("info.json").is_file() {
            names.push("meta/info.json".into());
        }
    }
    let is = |ends: &[&str]| names.iter().any(|name| ends.iter().any(|end| name.ends_with(end)));
    KINDS.iter().find(|(_, ends)| is(ends)).map(|(kind, _)| *kind)
}

#[cfg(test)]
mod tests {
    use crate::io::dataset::Dataset;

    #[test]
    fn containers_of_others_are_named() {
        for (file, says) in [
            ("a.h5", "HDF5"),
            ("b/zarr.json", "Zarr"),
            ("meta/info.json", "LeRobot"),
            ("c.mcap", "rosbag"),
            ("d.MP4", "videos"),
            ("e.npz", "numpy's archives"),
        ] {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, b"x").unwrap();
            let folder = if file.starts_with("meta") { dir.path() } else { path.parent().unwrap() };
            for asked in [folder, &path] {
                if file.starts_with("meta") && asked == path {
                    continue;
                }
                let error = Dataset::open(asked).unwrap_err();
                let (what, hint) = (error.to_string(), error.hint);
                assert!(what.contains(says) && hint.contains("from_arrays"), "{what}; {hint}");
            }
        }
        let dir = tempfile::tempdir().unwrap();
        let error = Dataset::open(dir.path()).unwrap_err();
        assert!(!error.hint.contains("from_arrays"), "{error}");
    }
}
