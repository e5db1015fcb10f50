//! Files that are no files: pipes and devices where a file is expected, in every folder that is read.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use touch2touch_bench::known;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::infer::bundle::Bundle;
use touch2touch_pipeline::io::dataset::{Dataset, read_in_meters};
use touch2touch_pipeline::io::masks::MaskStore;
use touch2touch_pipeline::io::{images, npz, pt, statistics, stl};

/// A pipe that nobody writes to, and a link to a device that never ends.
fn not_files(dir: &Path, name: &str) -> [PathBuf; 2] {
    let paths = ["pipe", "device"].map(|kind| dir.join(kind).join(name));
    for path in &paths {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    }
    assert!(std::process::Command::new("mkfifo").arg(&paths[0]).status().unwrap().success());
    std::os::unix::fs::symlink("/dev/zero", &paths[1]).unwrap();
    paths
}

/// What `read` answers; a reader that waits or never ends fails the test instead of holding it up.
fn within_a_minute(what: &str, read: impl FnOnce() -> String + Send + 'static) -> String {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || sender.send(read()).ok());
    receiver.recv_timeout(Duration::from_mins(1)).unwrap_or_else(|_| panic!("{what} hangs"))
}

fn error<T>(result: Result<T, impl std::fmt::Display>) -> String {
    result.err().map_or_else(|| "it was read".into(), |err| err.to_string())
}

#[test]
fn no_reader_waits_for_a_pipe_or_reads_a_device() {
    type Read = fn(&Path) -> String;
    let readers: [(&str, Read); 10] = [
        ("a.pt", |file| error(pt::read_dict(file))),
        ("a.npz", |file| error(npz::read(file))),
        ("case_0.npz", |file| error(known::CaseSet::open(file.parent().unwrap()))),
        ("a.stl", |file| error(stl::read(file))),
        ("unit.txt", |file| error(read_in_meters(&file.with_file_name("t.stl"), None))),
        ("a.png", |file| error(images::read_rgb(file))),
        ("a_gelslim.png", |file| error(Dataset::open(file.parent().unwrap()).unwrap().load(PairId(0)))),
        ("data_0.pt", |file| error(Dataset::open(file.parent().unwrap()).unwrap().load(PairId(0)))),
        ("manifest.json", |file| error(Bundle::open(file.parent().unwrap()))),
        ("stats.json", |file| error(statistics::ShiftStatistics::read(file))),
    ];
    for (name, read) in readers {
        let dir = tempfile::tempdir().unwrap();
        for path in not_files(dir.path(), name) {
            let said = within_a_minute(name, move || read(&path));
            assert!(said.contains("not an ordinary file") && said.contains(name), "{name}: {said}");
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let name = MaskStore::in_folder(PathBuf::new()).mask_file("a", lab::RIGHT);
    for path in not_files(dir.path(), &name.to_string_lossy()) {
        let store = MaskStore::in_folder(path.parent().unwrap().to_owned());
        let said = within_a_minute("a mask", move || error(store.load("a", lab::RIGHT)));
        assert!(said.contains("not an ordinary file"), "{said}");
    }
}
