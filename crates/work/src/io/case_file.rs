//! A case in one file: a zip of a manifest and the files that it names. The reader trusts nothing in it.

use std::collections::BTreeMap;
use std::io::{Read as _, Write as _};
use std::path::{Component, Path, PathBuf};

use super::{archive, atomic, files};

/// The ending of a case.
pub const ENDING: &str = "t2tcase";
/// The name of the manifest within.
const MANIFEST: &str = "case.json";
/// Largest manifest, bytes: masks and the steps of registrations are in it.
const MAX_MANIFEST: u64 = 16 << 20;
/// Largest file of a case, and all of them together, bytes.
const MAX_FILE: u64 = 64 << 20;
const MAX_ALL: u64 = 160 << 20;
/// Most files of a case.
const MAX_FILES: usize = 64;

/// Why a case cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum CaseFileError {
    /// The file cannot be opened or written.
    #[error("cannot read or write the case ({}): {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It is no case, or a damaged one.
    #[error("not a readable case: {reason} ({})", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Reason, as the message ends.
        reason: String,
    },
}

/// Content of a case.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CaseContent {
    /// The manifest, JSON.
    pub manifest: Vec<u8>,
    /// The files, by their path below the data folder, with `/`.
    pub files: BTreeMap<String, Vec<u8>>,
    /// Files besides the data, by their path in the case: results and models ([`BESIDE`]).
    pub beside: BTreeMap<String, Vec<u8>>,
}

/// Results of a case: below this folder of it.
pub(crate) const RESULTS: &str = "results/";
/// Models of a case: below this folder of it.
pub const MODELS: &str = "models/";
/// The folders of a case besides that of the data.
const BESIDE: [&str; 2] = [RESULTS, MODELS];

impl CaseContent {
    /// All files but the manifest.
    fn all(&self) -> impl Iterator<Item = (&String, &Vec<u8>)> {
        self.files.iter().chain(&self.beside)
    }
}

/// True for the path of a result or a model in a case.
fn is_beside(name: &str) -> bool {
    BESIDE.iter().any(|folder| name.strip_prefix(folder).is_some_and(is_plain))
}

/// True for a path below the data folder that is one on every system: relative, without dots and drives.
fn is_plain(name: &str) -> bool {
    let path = Path::new(name);
    !name.is_empty()
        && name.len() <= 400
        && !name.contains(['\\', ':', '\0'])
        && path.components().all(|part| matches!(part, Component::Normal(_)))
        && !name.ends_with('/')
}

/// True where the name of a file ends as that of a case.
pub fn is_case(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

/// Writes a case.
///
/// # Errors
/// If a file has a name that could not be unpacked everywhere, there is more than can be read back, or the disk refuses.
pub fn write(file: &Path, content: &CaseContent) -> Result<(), CaseFileError> {
    let damaged = |reason: String| CaseFileError::Damaged { file: file.to_owned(), reason };
    let all: u64 = content.all().map(|(_, bytes)| bytes.len() as u64).sum();
    let largest = content.all().map(|(_, bytes)| bytes.len() as u64).max().unwrap_or(0);
    let count = content.all().count();
    if count > MAX_FILES || largest > MAX_FILE || all > MAX_ALL {
        return Err(damaged(format!("its {count} files of {all} bytes are too much for a case")));
    }
    if content.manifest.len() as u64 > MAX_MANIFEST {
        return Err(damaged(format!("its manifest of {} bytes is too large", content.manifest.len())));
    }
    let odd = content.beside.keys().find(|name| !is_beside(name));
    if let Some(name) = content.files.keys().find(|name| !is_plain(name)).or(odd) {
        return Err(damaged(format!("{:?} is no name that every system can unpack", files::clip(name))));
    }
    archive::write(file, |zip| {
        // Without a date, so that the same case is the same file.
        let options = zip::write::SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
        zip.start_file(MANIFEST, options)?;
        zip.write_all(&content.manifest)?;
        for (name, bytes) in &content.files {
            zip.start_file(format!("data/{name}"), options)?;
            zip.write_all(bytes)?;
        }
        for (name, bytes) in &content.beside {
            zip.start_file(name.as_str(), options)?;
            zip.write_all(bytes)?;
        }
        Ok(())
    })
    .map_err(|source| CaseFileError::Io { file: file.to_owned(), source })
}

/// Reads a case. No more is unpacked than a case may have, whatever sizes it announces.
///
/// # Errors
/// [`CaseFileError`].
pub fn read(file: &Path) -> Result<CaseContent, CaseFileError> {
    let opened = files::open(file).map_err(|source| CaseFileError::Io { file: file.to_owned(), source })?;
    let damaged = |reason: String| CaseFileError::Damaged { file: file.to_owned(), reason: files::clip(&reason) };
    let mut zip = zip::ZipArchive::new(std::io::BufReader::new(opened)).map_err(|err| damaged(err.to_string()))?;
    if zip.len() > MAX_FILES + 1 {
        return Err(damaged(format!("it has {} files; at most {MAX_FILES} are read", zip.len())));
    }
    let mut content = CaseContent::default();
    let (mut manifest, mut room) = (None, MAX_ALL);
    for index in 0..zip.len() {
        let entry = zip.by_index(index).map_err(|err| damaged(err.to_string()))?;
        let name = String::from_utf8_lossy(entry.name_raw()).into_owned();
        let limit = if name == MANIFEST { MAX_MANIFEST } else { MAX_FILE.min(room) };
        let mut bytes = Vec::new();
        // What is announced is not believed: one byte more than allowed is too many.
        entry.take(limit + 1).read_to_end(&mut bytes).map_err(|err| damaged(format!("{name:?}: {err}")))?;
        if bytes.len() as u64 > limit {
            return Err(damaged(format!("{name:?} unpacks to more than {limit} bytes")));
        }
        room = room.saturating_sub(bytes.len() as u64);
        if name == MANIFEST {
            if manifest.replace(bytes).is_some() {
                return Err(damaged("it has two manifests".into()));
            }
            continue;
        }
        let twice = match name.strip_prefix("data/").filter(|path| is_plain(path)) {
            Some(path) => content.files.insert(path.to_owned(), bytes),
            None if is_beside(&name) => content.beside.insert(name.clone(), bytes),
            None => return Err(damaged(format!("{name:?} is no file of a case"))),
        };
        if twice.is_some() {
            return Err(damaged(format!("{name:?} is in it twice")));
        }
    }
    content.manifest = manifest.ok_or_else(|| damaged(format!("it has no {MANIFEST}")))?;
    Ok(content)
}

/// Writes the files of a case below a folder, which is made if it is not there. Files that are there are replaced.
///
/// # Errors
/// Whatever the disk says.
pub fn unpack(content: &CaseContent, folder: &Path) -> Result<(), CaseFileError> {
    std::fs::create_dir_all(folder).map_err(|source| CaseFileError::Io { file: folder.to_owned(), source })?;
    write_all(&content.files, folder)
}

/// Writes the models of a case below a folder, which is made if there are any, each in a folder of its own.
///
/// # Errors
/// Whatever the disk says.
pub(crate) fn unpack_models(content: &CaseContent, folder: &Path) -> Result<(), CaseFileError> {
    let models = content.beside.iter().filter_map(|(name, bytes)| Some((name.strip_prefix(MODELS)?, bytes)));
    write_all(models, folder)
}

fn write_all<N: AsRef<Path>, B: AsRef<[u8]>>(
    files: impl IntoIterator<Item = (N, B)>,
    folder: &Path,
) -> Result<(), CaseFileError> {
    let io = |file: &Path| {
        let file = file.to_owned();
        move |source| CaseFileError::Io { file, source }
    };
    for (name, bytes) in files {
        let file = folder.join(name);
        let bytes = bytes.as_ref();
        let parent = file.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).map_err(io(parent))?;
        atomic::write_bytes(&file, bytes).map_err(io(&file))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn content() -> CaseContent {
        let files = [("train/a/data_0.pt", vec![1, 2, 3]), ("b.stl", vec![0; 9000])];
        CaseContent {
            manifest: b"{}".to_vec(),
            files: files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect(),
            beside: [("results/a.npy".to_owned(), vec![7]), ("models/m/manifest.json".to_owned(), vec![8])].into(),
        }
    }

    fn zipped(entries: &[(&str, &[u8])]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("x.t2tcase");
        let mut zip = zip::ZipWriter::new(std::fs::File::create(&file).unwrap());
        for (name, bytes) in entries {
            zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap();
        (folder, file)
    }

    #[test]
    fn a_case_comes_back_and_is_the_same_file_each_time() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a.t2tcase", "b.t2tcase"].map(|name| folder.path().join(name));
        write(&a, &content()).unwrap();
        write(&b, &content()).unwrap();
        assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
        let back = read(&a).unwrap();
        assert_eq!(back, content());
        unpack(&back, &folder.path().join("out")).unwrap();
        assert_eq!(std::fs::read(folder.path().join("out/train/a/data_0.pt")).unwrap(), [1, 2, 3]);
        unpack_models(&back, &folder.path().join("models")).unwrap();
        assert_eq!(std::fs::read(folder.path().join("models/m/manifest.json")).unwrap(), [8]);
        assert!(is_case(&a) && is_case(Path::new("X.T2TCASE")) && !is_case(Path::new("t2tcase")));
    }

    #[test]
    fn what_could_leave_the_folder_or_fill_the_disk_is_refused() {
        for (entries, word) in [
            (vec![("case.json", b"{}".as_slice()), ("data/../x", b"1")], "no file of a case"),
            (vec![("case.json", b"{}".as_slice()), ("data//etc/x", b"1")], "no file of a case"),
            (vec![("case.json", b"{}".as_slice()), ("data/c:x", b"1")], "no file of a case"),
            (vec![("case.json", b"{}".as_slice()), ("other", b"1")], "no file of a case"),
            (vec![("case.json", b"{}".as_slice()), ("models/../x", b"1")], "no file of a case"),
            (vec![("data/x", b"1".as_slice())], "no case.json"),
        ] {
            let (_folder, file) = zipped(&entries);
            let err = read(&file).unwrap_err().to_string();
            assert!(err.contains(word), "{err}");
        }
        // A bomb: megabytes of zeros in a few kilobytes.
        let zeros = vec![0; MAX_MANIFEST as usize + 1];
        let (_folder, file) = zipped(&[("case.json", &zeros)]);
        assert!(std::fs::metadata(&file).unwrap().len() < 100_000);
        assert!(read(&file).unwrap_err().to_string().contains("more than"));
        let many: Vec<String> = (0..70).map(|i| format!("data/{i}")).collect();
        let many: Vec<(&str, &[u8])> = many.iter().map(|name| (name.as_str(), b"1".as_slice())).collect();
        let (_folder, file) = zipped(&many);
        assert!(read(&file).unwrap_err().to_string().contains("at most 64"));
        let folder = tempfile::tempdir().unwrap();
        let mut odd = content();
        odd.files.insert("../x".into(), Vec::new());
        assert!(write(&folder.path().join("a.t2tcase"), &odd).is_err());
        std::fs::write(folder.path().join("b.t2tcase"), b"PK nonsense").unwrap();
        assert!(read(&folder.path().join("b.t2tcase")).is_err() && read(folder.path()).is_err());
    }
}
