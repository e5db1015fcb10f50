//! The identity of a model bundle: a digest of what decides its results, so that what was made or drawn under it is found
//! again when the bundle is written anew with another name, note or folder.

use serde_json::Value;

use super::digest::sha256;

/// Keys of a manifest that decide no result: who made it, how it is called and offered.
const IDLE: [&str; 4] = ["defaults", "format_version", "name", "provenance"];

/// The identity that a manifest's bytes declare, lower-case hex; it holds the checksums of all files.
pub(crate) fn identity(manifest: &[u8]) -> String {
    let Ok(Value::Object(mut keys)) = serde_json::from_slice(manifest) else { return sha256(manifest) };
    keys.retain(|key, _| !IDLE.contains(&key.as_str()));
    if let Some(Value::Object(files)) = keys.get_mut("files") {
        files.values_mut().for_each(without_path);
    }
    if let Some(Value::Object(fit)) = keys.get_mut("fit") {
        fit.remove("source");
        fit.get_mut("file").into_iter().for_each(without_path);
    }
    sha256(Value::Object(keys).to_string().as_bytes())
}

/// A file is known by its checksum, wherever it lies.
fn without_path(file: &mut Value) {
    let Value::Object(file) = file else { return };
    file.remove("path");
    if let Some(Value::String(digest)) = file.get_mut("sha256") {
        digest.make_ascii_lowercase();
    }
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
        assert_eq!(identity(b"no JSON"), sha256(b"no JSON"));
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
}
