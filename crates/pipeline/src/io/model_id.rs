//! The identity of a model bundle: a digest of what decides its results, so that what was made or drawn under it is found
//! again when the bundle is written anew with another name, note or folder.
//!
//! Builds before this one called a bundle by the digest of its whole manifest. [`current`] turns such a name into the
//! identity, for every manifest that was seen.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value;

use super::digest::sha256;

/// Keys of a manifest that decide no result: who made it, how it is called and offered.
const IDLE: [&str; 4] = ["defaults", "format_version", "name", "provenance"];

/// Identities by the digests of the manifests.
static SEEN: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());

fn seen() -> MutexGuard<'static, BTreeMap<String, String>> {
    SEEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The identity that a manifest's bytes declare, lower-case hex; it holds the checksums of all files. From now on
/// [`current`] knows the manifest.
pub(crate) fn identity(manifest: &[u8]) -> String {
    let digest = sha256(manifest);
    if let Some(known) = seen().get(&digest) {
        return known.clone();
    }
    let Ok(Value::Object(mut keys)) = serde_json::from_slice(manifest) else { return digest };
    keys.retain(|key, _| !IDLE.contains(&key.as_str()));
    if let Some(Value::Object(files)) = keys.get_mut("files") {
        files.values_mut().for_each(without_path);
    }
    if let Some(Value::Object(fit)) = keys.get_mut("fit") {
        fit.remove("source");
        fit.get_mut("file").into_iter().for_each(without_path);
    }
    let identity = sha256(Value::Object(keys).to_string().as_bytes());
    seen().insert(digest, identity.clone());
    identity
}

/// A file is known by its checksum, wherever it lies.
fn without_path(file: &mut Value) {
    let Value::Object(file) = file else { return };
    file.remove("path");
    if let Some(Value::String(digest)) = file.get_mut("sha256") {
        digest.make_ascii_lowercase();
    }
}

/// The identity of the bundle that a text names: the text itself, unless it is the digest of a manifest that was seen.
pub(crate) fn current(id: &str) -> String {
    seen().get(id).cloned().unwrap_or_else(|| id.to_owned())
}

#[cfg(test)]
mod tests {
    use serde_json::Map;

    use super::*;

    fn manifest(change: impl FnOnce(&mut Map<String, Value>)) -> Vec<u8> {
        let text = r#"{"name": "a", "files": {"decoder": {"path": "decoder.onnx", "sha256": "AB01"}}, "latent": {"scale_factor": 1.0},
            "fit": {"file": {"path": "fit.npz", "sha256": "cd"}, "pads": ["right"], "source": {"data": "set"}},
            "defaults": {"steps": 2}, "provenance": {"note": "first"}, "format_version": 1}"#;
        let Ok(Value::Object(mut keys)) = serde_json::from_str(text) else { unreachable!("an object") };
        change(&mut keys);
        serde_json::to_vec_pretty(&Value::Object(keys)).unwrap()
    }

    #[test]
    fn names_notes_defaults_and_places_decide_nothing() {
        let plain = identity(&manifest(|_| {}));
        let put = |key: &str, value: Value| identity(&manifest(|keys| drop(keys.insert(key.into(), value))));
        for (key, value) in [("name", "b".into()), ("provenance", Value::Null), ("defaults", Value::Null)] {
            assert_eq!(put(key, value), plain, "{key}");
        }
        let elsewhere = manifest(|keys| {
            keys["files"]["decoder"] = serde_json::json!({"path": "other/d.onnx", "sha256": "ab01"});
            keys["fit"]["source"] = Value::Null;
            keys["fit"]["file"]["path"] = "f.npz".into();
        });
        assert_eq!(identity(&elsewhere), plain);
    }

    #[test]
    fn weights_and_numbers_decide() {
        let plain = identity(&manifest(|_| {}));
        let changes: [fn(&mut Map<String, Value>); 4] = [
            |keys| keys["files"]["decoder"]["sha256"] = "ab02".into(),
            |keys| keys["latent"]["scale_factor"] = 1.5.into(),
            |keys| keys["fit"]["file"]["sha256"] = "ce".into(),
            |keys| drop(keys.insert("later".into(), true.into())),
        ];
        for change in changes {
            assert_ne!(identity(&manifest(change)), plain);
        }
    }

    #[test]
    fn a_manifest_that_was_seen_is_known_by_its_digest() {
        let text = manifest(|keys| keys["name"] = "seen".into());
        let digest = sha256(&text);
        let identity = identity(&text);
        assert_eq!((current(&digest), current(&identity)), (identity.clone(), identity));
        assert_eq!(current("never seen"), "never seen");
        assert_eq!(super::identity(b"no JSON"), sha256(b"no JSON"));
    }
}
