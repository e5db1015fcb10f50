//! Model bundles: a folder with `manifest.json` and the ONNX graphs it names, on the disk or inside the program.
//!
//! [`Bundle::open`] checks everything that can be checked without running a graph: the manifest, the presence and
//! SHA-256 of every file, and the names, element types and shapes of every graph's inputs and outputs against the
//! manifest. A bundle with anything wrong is refused with the whole list. Whether an engine takes the graphs, and what
//! they ask for, is found out by [`super::sandbox`].
//!
//! # Manifest, format version 2
//!
//! JSON; unknown keys are refused, except under `provenance`, which is free-form. Every `size` is `[width, height]`.
//!
//! ```json
//! {
//!   "format": "touch2touch-bundle",
//!   "format_version": 2,
//!   "kind": "generator",
//!   "name": "Demo generator",
//!   "files": {
//!     "condition_encoder": { "path": "condition_encoder.onnx", "sha256": "<64 hex digits>" },
//!     "denoiser": { "path": "denoiser.onnx", "sha256": "…" },
//!     "decoder": { "path": "decoder.onnx", "sha256": "…" }
//!   },
//!   "input": {
//!     "sensor": { "key": "gelslim", "kind": "color", "size": [427, 320] }, "size": [128, 128], "scale": "0..1",
//!     "mean": [-0.0107, -0.0063, -0.0087], "std": [0.0687, 0.0428, 0.0576],
//!     "resampling": "bilinear", "rotation_deg": 0
//!   },
//!   "condition": { "shape": [32, 16, 16] },
//!   "latent": { "shape": [4, 16, 16], "scale_factor": 1.0 },
//!   "schedule": { "kind": "scaled_linear", "steps": 1000, "beta_start": 0.0015, "beta_end": 0.0155 },
//!   "prediction": "v",
//!   "output": {
//!     "sensor": { "key": "bubble", "kind": "depth", "size": [175, 140] }, "size": [128, 128], "channels": 1, "range_m": [-0.0116, 0.0225], "reduction": "mean",
//!     "rotation_deg": 180, "imprint_size": [175, 140], "resampling": "bilinear"
//!   },
//!   "shift": { "pred_mean": 0.0126, "pred_std": 0.0015, "gt_mean": 0.0027, "gt_std": 0.0033 },
//!   "defaults": { "steps": 20, "sampler": "ddim", "spacing": "trailing", "eta": 0.0, "seed": 42 },
//!   "provenance": { "licence": "…", "data": "…" }
//! }
//! ```
//!
//! ```json
//! {
//!   "format": "touch2touch-bundle",
//!   "format_version": 2,
//!   "kind": "mask_unet",
//!   "name": "Demo mask UNet",
//!   "files": { "mask_unet": { "path": "mask_unet.onnx", "sha256": "…" } },
//!   "input": {
//!     "sensor": { "key": "bubble", "kind": "depth", "size": [175, 140] }, "size": [175, 140], "range_m": [-0.0116, 0.0225], "cast": "saturate", "rotation_deg": 0
//!   },
//!   "output": { "classes": 2, "threshold": 0.5 },
//!   "provenance": {}
//! }
//! ```
//!
//! ```json
//! {
//!   "format": "touch2touch-bundle",
//!   "format_version": 2,
//!   "kind": "tool_classifier",
//!   "name": "Demo tool classifier",
//!   "files": { "tool_classifier": { "path": "tool_classifier.onnx", "sha256": "…" } },
//!   "input": {
//!     "sensor": { "key": "bubble", "kind": "depth", "size": [175, 140] }, "size": [128, 128],
//!     "range_m": [-0.0188, 0.0264], "rotation_deg": 180
//!   },
//!   "output": { "classes": ["pattern_31_rod", "pattern_36"], "features": 96 },
//!   "provenance": {}
//! }
//! ```
//!
//! `"window_px": [74.5, 74.0]` in a generator's `output` says that its picture has the center of the color sensor's window
//! there, pixels of the raw imprint, for every pad: each picture is then moved to where the rig has the pad's window. Without
//! it, or in a rig without windows, pictures stay where they are.
//!
//! `sensor` declares a sensor as the rig of the data does ([`sensor::SensorSpec`]); a bundle is used only where they agree. A
//! generator that starts from a depth sensor has `"scale": "m"` and one number in `mean` and `std`; one that predicts a
//! color sensor has, in place of `range_m`, the `range` of the difference on the 0..255 scale, three channels and no
//! `shift`. Version 1 has `"sensor": "gelslim"` or `"bubble"` in `input` and none in `output`: the lab's sensors.
//!
//! A generator that was fitted to pairs of a rig says so: `"fit": { "file": { "path": "fit.npz", "sha256": "…" },
//! "pads": ["right", "left"], "source": { … } }` ([`FitSpec`], [`touch2touch_core::fit`]).
//!
//! `shift` may be left out (the paper's shift is then not offered), and so may `reduction`, `resampling`,
//! `rotation_deg`, `cast` and `threshold` (mean, bilinear, 0, saturate, 0.5); `features`
//! where the classifier hands none out. The fields of the structs below say what
//! each key means.
//!
//! # Graphs
//!
//! Plain ONNX without external data, float32, the first axis of every tensor the dynamic batch:
//!
//! | role | inputs | output |
//! | --- | --- | --- |
//! | `condition_encoder` | the input sensor's key, such as `gelslim` \[N, 3 or 1, input height, width\] | `condition` \[N, …condition shape\] |
//! | `denoiser` | `latent` \[N, …latent shape\], `timestep` int64 or float32 \[N\], `condition` | `prediction` \[N, …latent shape\] |
//! | `decoder` | `latent` \[N, …latent shape\] | `image` \[N, channels, output height, width\], about -1 to 1 |
//! | `mask_unet` | `imprint` \[N, 1, input height, width\], 0 to 1 | `logits` \[N, classes, input height, width\] |
//! | `tool_classifier` | `imprint` \[N, 1, input height, width\], -1 to 1 | `logits` \[N, classes\], `features` \[N, features\] |

pub(super) mod contract;
mod find;
mod fit;
pub(crate) mod manifest;
mod origin;
mod sensor;

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::io::digest::sha256;
use crate::io::files;
use crate::io::model_id::identity;
use touch2touch_core::dataset::Problem;
use touch2touch_core::fit::Fitted;
use touch2touch_core::units::counted;

pub use find::{Found, find, find_all};
pub(crate) use fit::FitSpec;
pub use fit::write as write_fit;
pub use manifest::TimestepType;
pub(crate) use manifest::{
    BundleSpec, Cast, ClassifierInput, ClassifierSpec, GeneratorInput, GeneratorSpec, InputScale, MaskInput, MaskSpec,
};
pub(crate) use origin::BundleFile;
pub use origin::Origin;
pub(crate) use sensor::Misfit;
#[cfg(test)]
pub(crate) use sensor::SensorSpec;
pub use sensor::{Ends, SensorPair};

/// The manifest's file name.
pub const MANIFEST: &str = "manifest.json";

/// Longest manifest that is read, bytes.
const MAX_MANIFEST: u64 = 4 << 20;

/// Task of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Role {
    /// Turns the GelSlim difference into the condition of the denoiser.
    ConditionEncoder,
    /// Tells signal from noise.
    Denoiser,
    /// Turns a clean latent into a picture.
    Decoder,
    /// Finds the contact in an imprint.
    MaskUnet,
    /// Names the tool that made an imprint.
    ToolClassifier,
}

impl Role {
    /// The key in the manifest.
    pub fn key(self) -> &'static str {
        self.into()
    }
}

/// A file of a bundle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Relative to the bundle's folder.
    pub path: String,
    /// Of the whole file, hex.
    pub sha256: String,
}

/// A bundle with everything wrong about it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct BundleError {
    /// Origin of the bundle: a folder, or the program.
    pub origin: Origin,
    /// All that was found, at least one.
    pub problems: Vec<Problem>,
}

impl fmt::Display for BundleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the model bundle {} cannot be used: {}", self.origin, counted(self.problems.len(), "problem"))?;
        let dir = self.origin.path();
        for problem in &self.problems {
            let file = problem.file.strip_prefix(&dir).unwrap_or(&problem.file);
            write!(f, "\n- {}: {} ({})", file.display(), problem.what, problem.hint)?;
        }
        Ok(())
    }
}

/// A checked bundle.
#[derive(Clone, Debug, PartialEq)]
pub struct Bundle {
    origin: Origin,
    name: String,
    hash: String,
    files: BTreeMap<Role, BundleFile>,
    bytes: u64,
    spec: BundleSpec,
    fit: Option<Arc<Fitted>>,
    provenance: serde_json::Value,
}

impl Bundle {
    /// Opens and checks the bundle at `origin`, mostly a folder.
    ///
    /// # Errors
    /// [`BundleError`] with everything that is wrong: the manifest's JSON, version, keys and values, missing files,
    /// checksums, and graphs whose inputs and outputs are not those the manifest describes.
    ///
    /// # Cost
    /// Reads and hashes every file once, about 0.1 s for 20 MB.
    pub fn open(origin: impl Into<Origin>) -> Result<Self, BundleError> {
        let origin = origin.into();
        let refuse = |problems| BundleError { origin: origin.clone(), problems };
        let file = origin.file(MANIFEST);
        let path = file.path().to_owned();
        let text = file.read(MAX_MANIFEST).map_err(|err| {
            refuse(vec![Problem {
                file: path.clone(),
                what: format!("cannot be read: {err}"),
                hint: "choose a folder that holds a manifest.json".into(),
            }])
        })?;
        let mut problems = Problems { file: path, list: Vec::new() };
        let Some(mut manifest) = manifest::parse(&text, &mut problems) else {
            return Err(refuse(problems.list));
        };
        let mut files = BTreeMap::new();
        let mut size = 0;
        for (&role, entry) in &manifest.files {
            if !stays_inside(&entry.path) {
                let what = format!("files.{}.path: \"{}\" leads out of the folder", role.key(), entry.path);
                problems.add(what, "name a file inside the bundle's folder");
                continue;
            }
            let file = origin.file(&entry.path);
            match file.read(files::MODEL) {
                Ok(bytes) => {
                    size += bytes.len() as u64;
                    let mut at_file = Problems { file: file.path().to_owned(), list: Vec::new() };
                    if !sha256(&bytes).eq_ignore_ascii_case(&entry.sha256) {
                        at_file.add(
                            "its SHA-256 is not the manifest's: the file is damaged or was replaced",
                            "copy the bundle again, or write its checksum anew if you changed it",
                        );
                    }
                    if let Some(spec) = &mut manifest.spec {
                        contract::check(role, &bytes, spec, &mut at_file);
                    }
                    problems.list.append(&mut at_file.list);
                }
                Err(err) => problems.list.push(Problem {
                    file: file.path().to_owned(),
                    what: format!("cannot be read: {err}"),
                    hint: "copy the bundle again".into(),
                }),
            }
            files.insert(role, file);
        }
        let fit = match &manifest.spec {
            Some(BundleSpec::Generator(spec)) => read_fit(&origin, spec, &mut problems),
            _ => None,
        };
        match (manifest.spec, problems.list.is_empty()) {
            (Some(spec), true) => {
                let (name, provenance) = (manifest.name, manifest.provenance);
                Ok(Self { hash: identity(&text), origin, name, files, bytes: size, spec, fit, provenance })
            }
            _ => Err(refuse(problems.list)),
        }
    }

    /// Origin of the bundle: a folder, or the program.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// The name for people.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Digest of what decides the bundle's results, lower-case hex: the manifest without name, note and places, with the
    /// files' checksums ([`crate::io::model_id`]).
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Specification by kind: the use of the bundle, its inputs and outputs.
    pub fn spec(&self) -> &BundleSpec {
        &self.spec
    }

    /// The generator's description, if the bundle is one.
    pub fn generator(&self) -> Option<&GeneratorSpec> {
        match &self.spec {
            BundleSpec::Generator(spec) => Some(spec),
            _ => None,
        }
    }

    /// The fit to a rig, if it was fitted to one.
    pub fn fit(&self) -> Option<&Arc<Fitted>> {
        self.fit.as_ref()
    }

    /// The mask UNet's description, if the bundle is one.
    pub fn mask_unet(&self) -> Option<&MaskSpec> {
        match &self.spec {
            BundleSpec::MaskUnet(spec) => Some(spec),
            _ => None,
        }
    }

    /// The tool classifier's description, if the bundle is one.
    pub fn tool_classifier(&self) -> Option<&ClassifierSpec> {
        match &self.spec {
            BundleSpec::ToolClassifier(spec) => Some(spec),
            _ => None,
        }
    }

    /// The file of a graph.
    pub fn file(&self, role: Role) -> Option<&BundleFile> {
        self.files.get(&role)
    }

    /// The graphs with their roles.
    pub fn files(&self) -> impl Iterator<Item = (Role, &BundleFile)> {
        self.files.iter().map(|(role, file)| (*role, file))
    }

    /// The size of all graphs together, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Free-form: data, commit, licence, losses.
    pub fn provenance(&self) -> &serde_json::Value {
        &self.provenance
    }
}

/// The pictures of a generator's fit, and what is wrong with them.
fn read_fit(origin: &Origin, spec: &GeneratorSpec, problems: &mut Problems) -> Option<Arc<Fitted>> {
    let fit = spec.fit.as_ref()?;
    if !stays_inside(&fit.file.path) {
        problems.add(format!("fit.file.path: \"{}\" leads out of the folder", fit.file.path), "name a file inside it");
        return None;
    }
    let file = origin.file(&fit.file.path);
    let mut add = |what: String| {
        problems.list.push(Problem {
            file: file.path().to_owned(),
            what,
            hint: "fit the bundle again, or copy it again".into(),
        })
    };
    let bytes = match file.read(files::MODEL) {
        Ok(bytes) => bytes,
        Err(err) => {
            add(format!("cannot be read: {err}"));
            return None;
        }
    };
    if !sha256(&bytes).eq_ignore_ascii_case(&fit.file.sha256) {
        add("its SHA-256 is not the manifest's: the file is damaged or was replaced".into());
        return None;
    }
    fit::read(file.path(), &bytes, fit, spec.output.size).map(Arc::new).map_err(add).ok()
}

/// Collects problems of one file.
pub(super) struct Problems {
    pub(super) file: PathBuf,
    pub(super) list: Vec<Problem>,
}

impl Problems {
    pub(super) fn add(&mut self, what: impl Into<String>, hint: &str) {
        self.list.push(Problem { file: self.file.clone(), what: what.into(), hint: hint.into() });
    }
}

/// True where `name` is that of a file inside the bundle: neither absolute nor empty, and climbing nowhere.
fn stays_inside(name: &str) -> bool {
    let plain = Path::new(name).components().all(|c| matches!(c, std::path::Component::Normal(_)));
    plain && !name.is_empty()
}
