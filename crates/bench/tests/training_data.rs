//! `training-data`: a data set in the lab's format and the simulator as shards of one folder.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::label::{Marks, Provenance};
use touch2touch_core::rig::lab;
use touch2touch_core::sim::{SimConfig, random_grasp, simulate};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::{MaskStore, StoredMask, StoredReview};
use touch2touch_pipeline::io::simulated::{Layout, write_pair, write_tools};

use super::{error_text, json, run};

/// Two simulated grasps of each tool.
fn write_set(root: &Path, names: &[&str]) {
    let tools: Vec<_> = names.iter().map(|name| catalog::tools().iter().find(|t| t.name == *name).unwrap()).collect();
    for (tool, index) in tools.iter().flat_map(|tool| [0, 1].map(|index| (tool, index))) {
        let sample = simulate(tool, random_grasp(3 + index), index, &SimConfig::default());
        write_pair(root, Layout::Train, &tool.name, index, &sample).unwrap();
    }
    write_tools(root, &tools.iter().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect::<Vec<_>>()).unwrap();
}

fn about(shard: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(shard.join("done.json")).unwrap()).unwrap()
}

/// The values behind a header of 128 bytes.
fn values(shard: &Path, name: &str) -> Vec<u8> {
    std::fs::read(shard.join(name)).unwrap()[128..].to_vec()
}

#[test]
fn a_data_set_and_the_simulator_become_shards_of_one_folder() {
    let dir = tempfile::tempdir().unwrap();
    let (set, out) = (dir.path().join("set"), dir.path().join("shards"));
    let [set_name, out_name] = [&set, &out].map(|path| path.to_str().unwrap());
    write_set(&set, &["pattern_36", "pattern_31_rod"]);
    // A mask by hand wins over the CAD model, and a pair marked "skip" is left out.
    let dataset = Dataset::open(&set).unwrap();
    let names: Vec<String> = dataset.index.pairs.iter().map(|pair| pair.name.clone()).collect();
    let size = dataset.load(PairId(0)).unwrap().pad(lab::RIGHT).unwrap().depth().unwrap().imprint.clone();
    let mask = size.map(|&depth| depth > 0.006);
    let count = mask.as_slice().iter().filter(|&&on| on).count();
    let stored = StoredMask {
        marks: Marks::all(mask.size(), Provenance::told("Threshold 6.00 mm")),
        mask,
        person: "test".into(),
        saved_unix_s: 1,
    };
    MaskStore::for_dataset(&dataset).unwrap().save(&names[0], lab::RIGHT, Some(&stored)).unwrap();
    let skip = StoredReview { review: "skip".into(), ..StoredReview::default() };
    MaskStore::for_dataset(&dataset).unwrap().save_review(&names[3], &skip).unwrap();

    let write = |more: &[&str]| {
        run(&[&["training-data", set_name, "--out", out_name, "--per-shard", "2", "--json"], more].concat())
    };
    let second = json(&write(&["--shard", "2/2"]));
    assert_eq!((&second["written"], &second["of_others"], &second["touches"]), (&1.into(), &1.into(), &2.into()));
    let rest = json(&write(&[]));
    assert_eq!((&rest["written"], &rest["already"], &rest["skipped"]), (&1.into(), &1.into(), &1.into()), "{rest}");
    assert_eq!((&rest["contact"]["hand"], &rest["contact"]["cad"]), (&1.into(), &3.into()), "{rest}");
    let again = json(&write(&[]));
    assert_eq!((&again["written"], &again["already"]), (&0.into(), &2.into()), "{again}");
    let shards = || {
        let mut all: Vec<_> = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path()).collect();
        all.sort();
        all
    };
    let [first, last] = <[_; 2]>::try_from(shards()).unwrap();
    assert_eq!((&about(&first)["samples"], &about(&last)["samples"]), (&4.into(), &2.into()));
    let pixels = lab::BUBBLE.width * lab::BUBBLE.height;
    let contact = values(&first, "contact.npy");
    assert_eq!(contact[..pixels].iter().filter(|&&on| on == 1).count(), count);
    assert_eq!((contact.len(), values(&first, "gelslim.npy").len()), (4 * pixels, 4 * 3 * 128 * 128 * 2));
    // What differs is not taken for what was asked.
    let other = write(&["--limit", "1"]);
    assert!(!other.status.success() && error_text(&other).contains("holds other data"), "{}", error_text(&other));
    // One that was cut off is written again.
    std::fs::remove_file(first.join("done.json")).unwrap();
    assert_eq!(json(&write(&[]))["written"], 1);
    assert_eq!(values(&first, "contact.npy"), contact);

    let simulate = ["training-data", "simulator", "--grasps", "3", "--seed", "5", "--out", out_name, "--json"];
    let simulated = json(&run(&simulate));
    assert_eq!((&simulated["touches"], &simulated["contact"]["truth"]), (&6.into(), &6.into()), "{simulated}");
    assert_eq!(shards().len(), 3, "shards of several sources lie beside each other");
    let shard = shards().pop().unwrap();
    assert_eq!((&about(&shard)["source"], &about(&shard)["mix"]), (&"simulator".into(), &"train".into()));
    let refused = run(&["training-data", set_name, "--out", out_name, "--shard", "3/2"]);
    assert!(error_text(&refused).contains("between 1 and N"), "{}", error_text(&refused));
}

#[test]
fn what_cannot_be_used_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    let (set, out) = (dir.path().join("set"), dir.path().join("shards"));
    std::fs::create_dir(&set).unwrap();
    for name in ["a_gelslim.png", "a_bubble.png"] {
        std::fs::write(set.join(name), b"not a picture").unwrap();
    }
    let [set, out_name] = [&set, &out].map(|path| path.to_str().unwrap());
    for _ in 0..2 {
        let refused = run(&["training-data", set, "--out", out_name]);
        let said = error_text(&refused);
        assert!(!refused.status.success() && said.contains("no pair can be used") && said.contains("a_"), "{said}");
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0);
    }
}

/// Runs the program where no file may grow beyond some KiB, which is how a full disk looks to it.
#[cfg(unix)]
fn cramped(kib: u32, args: &[&str]) -> Output {
    let script = format!("trap '' XFSZ; ulimit -f {kib}; exec \"$0\" \"$@\"");
    Command::new("bash").args(["-c", &script, env!("CARGO_BIN_EXE_touch2touch-bench")]).args(args).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_full_disk_ends_in_an_error_and_leaves_no_halves() {
    let dir = tempfile::tempdir().unwrap();
    let (set, out) = (dir.path().join("set"), dir.path().join("shards"));
    write_set(&set, &["pattern_36"]);
    let full = cramped(4, &["training-data", set.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let text = error_text(&full);
    assert_eq!(full.status.code(), Some(2), "{text}");
    assert!(text.contains("File too large"), "{text}");
    assert_eq!(std::fs::read_dir(&out).map_or(0, |list| list.count()), 0);
}
