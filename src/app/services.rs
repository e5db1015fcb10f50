//! [`Services`]: the folders of the program and its models, as jobs use them.

use std::path::PathBuf;
use std::time::Duration;

use serde_json::Value;

use super::source::Place;
use super::state::settings::{SETTINGS_VERSION, Settings};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::infer::store::{self, Store};
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::io::{atomic, files, folders};
use touch2touch_pipeline::learn::new_bundle::models_folder;
use touch2touch_pipeline::learn::tuning::unfinished_folder;
use touch2touch_pipeline::steps::models::Models;

/// The settings file inside the configuration folder.
const SETTINGS_FILE: &str = "settings.json";
/// The place to which a settings file is put that cannot be used.
const BAD_SETTINGS_FILE: &str = "settings.bad.json";

/// The folders of the program, its models, which stay loaded between jobs, and how long it waits.
#[derive(Debug)]
pub struct Services {
    /// The folder of settings and statistics.
    pub config_folder: Option<PathBuf>,
    /// The folder of fitted models.
    pub models_folder: Option<PathBuf>,
    /// The folder of tuning that was stopped.
    pub unfinished: Option<PathBuf>,
    /// The folder of the last evaluation of each data set.
    pub evaluations: Option<PathBuf>,
    /// The folder of labels that could not be saved.
    pub waiting: Option<PathBuf>,
    /// The models.
    pub models: Models,
    /// The time that a pair stays on screen before it is predicted without being asked for: longer than a key that is held
    /// down leaves it there.
    pub patience: Duration,
    /// The time that labels that could not be written wait until they are tried again.
    pub retry_after: Duration,
}

impl Services {
    /// With settings in the user's configuration folder.
    pub fn of_user() -> Self {
        Self {
            config_folder: folders::config(),
            models_folder: models_folder(),
            unfinished: unfinished_folder(),
            evaluations: folders::data().map(|folder| folder.join("evaluations")),
            waiting: folders::data().map(|folder| folder.join("recovered")),
            models: Models::new(store::user_folder().map(|folder| Store::new(folder, store::DEFAULT_BUDGET))),
            ..Self::with_config_folder(None)
        }
    }

    /// With settings, kept predictions, fitted models and labels that wait in a given folder; `None` keeps none.
    pub fn with_config_folder(folder: Option<PathBuf>) -> Self {
        let inside = |name: &str| folder.as_ref().map(|folder| folder.join(name));
        Self {
            models_folder: inside("models"),
            unfinished: inside("unfinished"),
            evaluations: inside("evaluations"),
            waiting: inside("recovered"),
            models: Models::new(inside("predictions").map(|folder| Store::new(folder, store::DEFAULT_BUDGET))),
            config_folder: folder,
            patience: Duration::from_millis(150),
            retry_after: Duration::from_secs(5),
        }
    }

    /// Keeps shift statistics with the program's own files; says where, or `None` where nothing is kept.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(crate) fn save_statistics(&self, statistics: &ShiftStatistics) -> Result<Option<PathBuf>, TaskError> {
        let Some(folder) = self.config_folder.as_ref().map(|folder| folder.join("statistics")) else { return Ok(None) };
        let p = &statistics.provenance;
        let hash = p.bundle_hash.get(..12).unwrap_or(&p.bundle_hash);
        let dataset: String = p.dataset.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let file = folder.join(format!("{hash}-{dataset}.json"));
        std::fs::create_dir_all(&folder)
            .map_err(|err| TaskError::new("Keep the statistics", format!("{err} ({})", folder.display())))?;
        statistics.write(&file).map_err(|err| TaskError::from_error("Keep the statistics", &err))?;
        Ok(Some(file))
    }

    /// The stored settings (defaults where there are none), and what was wrong if they were set aside.
    pub fn load_settings(&self) -> (Settings, Option<TaskError>) {
        let (settings, problem) = self.read_settings();
        self.keep_at_most(&settings);
        (settings, problem)
    }

    /// The settings for who changes nothing. A file that cannot be read stays where it is, for the studio to set aside and to say
    /// so.
    pub(crate) fn peek_settings(&self) -> Option<Settings> {
        let file = self.config_folder.as_ref()?.join(SETTINGS_FILE);
        Some(parse_settings(&files::read(&file, files::SMALL).ok()?).ok()?.0.validated())
    }

    /// Writes the settings.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn save_settings(&self, settings: &Settings) -> Result<(), TaskError> {
        const WHAT: &str = "Save the preferences";
        self.keep_at_most(settings);
        let Some(folder) = &self.config_folder else { return Ok(()) };
        let file = folder.join(SETTINGS_FILE);
        let fail = |err: std::io::Error| TaskError::new(WHAT, format!("{err} ({})", file.display()));
        // A path that is no text cannot be written; it must not keep everything else from being written.
        let mut settings = settings.clone();
        let is_text = |place: &Place| !matches!(place, Place::Path(path) if path.to_str().is_none());
        settings.recent.retain(is_text);
        settings.last.place = settings.last.place.filter(is_text);
        settings.bundle_folders.retain(|folder| folder.to_str().is_some());
        let text = serde_json::to_vec_pretty(&settings).map_err(|err| fail(err.into()))?;
        std::fs::create_dir_all(folder).map_err(fail)?;
        atomic::write_bytes(&file, &text).map_err(fail)
    }

    /// The budget of the kept predictions as the settings say.
    fn keep_at_most(&self, settings: &Settings) {
        self.models.keep_at_most(u64::from(settings.cache_mib) << 20);
    }

    fn read_settings(&self) -> (Settings, Option<TaskError>) {
        let Some(folder) = &self.config_folder else { return (Settings::default(), None) };
        let file = folder.join(SETTINGS_FILE);
        let bytes = match files::read(&file, files::SMALL) {
            Ok(bytes) => bytes,
            Err(err) if err.kind() == std::io::ErrorKind::NotFound => return (Settings::default(), None),
            Err(err) => {
                let why = format!("{err} ({})", file.display());
                return (Settings::default(), Some(TaskError::new("The preferences could not be read", why)));
            }
        };
        let (settings, why, what) = match parse_settings(&bytes) {
            Ok((settings, refused)) if refused.is_empty() => return (settings.validated(), None),
            Ok((settings, refused)) => (Some(settings), refused.join("; "), "Some preferences"),
            Err(why) => (None, why, "Preferences"),
        };
        let bad = folder.join(BAD_SETTINGS_FILE);
        // What is read still is the file to start from; one of which nothing is must not be read again.
        let set_aside =
            if settings.is_some() { std::fs::copy(&file, &bad).map(drop) } else { std::fs::rename(&file, &bad) };
        let kept = match set_aside {
            Ok(()) => format!("Old file: {}", bad.display()),
            Err(err) => format!("The old file could not be kept: {err}."),
        };
        let why = format!("{why} ({})", file.display());
        let problem = TaskError::new(format!("{what} could not be read and were reset"), why).with_hint(kept);
        (settings.unwrap_or_default().validated(), Some(problem))
    }
}

/// The settings, and which of them could not be used.
fn parse_settings(bytes: &[u8]) -> Result<(Settings, Vec<String>), String> {
    let mut value: Value = serde_json::from_slice(bytes).map_err(|err| err.to_string())?;
    let version = value.get("version").and_then(Value::as_u64);
    if version != Some(SETTINGS_VERSION.into()) {
        return Err(format!(
            "they are of version {}, this program writes version {SETTINGS_VERSION}",
            version.map_or_else(|| "unknown".into(), |v| v.to_string())
        ));
    }
    let fits = |value: Value| serde_json::from_value::<Settings>(value).is_ok();
    let refused = leave_out(&mut value, "", &fits).into_iter().map(|path| format!("{path} cannot be read")).collect();
    Ok((serde_json::from_value(value).map_err(|err| err.to_string())?, refused))
}

/// Leaves out the parts of a value that make it unfit, each as small as can be, and returns their paths: that of the value
/// itself where nothing else helps.
fn leave_out(value: &mut Value, path: &str, fits: &dyn Fn(Value) -> bool) -> Vec<String> {
    if fits(value.clone()) {
        return Vec::new();
    }
    let mut out = Vec::new();
    if let Value::Object(parts) = value {
        let dot = if path.is_empty() { "" } else { "." };
        parts.retain(|key, part| {
            let alone = |part| fits(Value::Object([(key.clone(), part)].into_iter().collect()));
            let unfit = leave_out(part, &format!("{path}{dot}{key}"), &alone);
            out.extend(unfit);
            alone(part.clone())
        });
    }
    if let Value::Array(parts) = value {
        let mut at = 0;
        parts.retain_mut(|part| {
            let alone = |part| fits(Value::Array(vec![part]));
            out.extend(leave_out(part, &format!("{path}[{at}]"), &alone));
            at += 1;
            alone(part.clone())
        });
    }
    if fits(value.clone()) { out } else { vec![path.to_owned()] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::settings::{CompareChoice, Workspace};
    use touch2touch_pipeline::compare::subject::Subject;

    #[test]
    fn settings_come_back_and_bad_ones_are_set_aside() {
        let folder = tempfile::tempdir().unwrap();
        let services = Services::with_config_folder(Some(folder.path().join("new")));
        assert_eq!(services.load_settings(), (Settings::default(), None));
        let mut settings = Settings::default();
        settings.mask.radius_px = 7.5;
        settings.recent.push(Place::Path("/data/x".into()));
        services.save_settings(&settings).unwrap();
        assert_eq!(services.load_settings(), (settings, None));
        let file = folder.path().join("new").join(SETTINGS_FILE);
        for bad in ["", "[1, 2", r#"{"version": 999}"#, r#"{"theme": "light"}"#] {
            std::fs::write(&file, bad).unwrap();
            // The window asks first, and leaves it to the studio to say what is wrong.
            assert!(services.peek_settings().is_none() && file.exists());
            let (settings, problem) = services.load_settings();
            assert_eq!(settings, Settings::default(), "{bad}");
            assert!(problem.unwrap().hint.unwrap().contains(BAD_SETTINGS_FILE));
            assert!(!file.exists(), "set aside, so that the next start is quiet");
            assert_eq!(std::fs::read_to_string(file.with_file_name(BAD_SETTINGS_FILE)).unwrap(), bad);
        }
        // Numbers that cannot be worked with are brought into range; unknown and missing keys are no harm.
        std::fs::write(&file, r#"{"version": 1, "ui_zoom": 1e9, "new_key": 3}"#).unwrap();
        assert_eq!(services.load_settings().0.ui_zoom, 4.0);
        for (size, there) in [("[900, 700]", true), ("[0, 700]", false), ("[900, 1e30]", false)] {
            let last = format!(r#"{{"window": {{"position": [-3, 4], "size": {size}, "maximized": true}}}}"#);
            std::fs::write(&file, format!(r#"{{"version": 1, "last": {last}}}"#)).unwrap();
            assert_eq!(services.peek_settings().unwrap().last.window.is_some(), there, "{size}");
        }
        // Keys that cannot be used cost nothing else, and are said.
        // A field that cannot be read falls back alone, and the file as it was is kept.
        let one = r#"{"version": 1, "theme": "plaid", "ui_zoom": 2.0, "recent": ["demo", 7, {"path": "/data/x"}],
            "compare": {"inspect": {"a": "measured", "b": "prediction:bundle=a, b"}, "label": {"a": "stored"}},
            "mask": {"radius_px": "wide", "clean_mm": 2.0}, "last": {"cameras": ["one"], "pair": "data_6"}}"#;
        std::fs::write(&file, one).unwrap();
        let (settings, problem) = services.load_settings();
        let problem = problem.unwrap();
        assert!(problem.hint.unwrap().contains(BAD_SETTINGS_FILE));
        let fields = ["compare.inspect.b", "last.cameras", "mask.radius_px", "recent[1]", "theme"];
        let fields = fields.map(|field| format!("{field} cannot be read")).join("; ");
        assert_eq!(problem.why, format!("{fields} ({})", file.display()));
        assert_eq!(std::fs::read_to_string(file.with_file_name(BAD_SETTINGS_FILE)).unwrap(), one);
        let mut want = Settings { ui_zoom: 2.0, ..Settings::default() };
        want.recent = vec![Place::Demo, Place::Path("/data/x".into())];
        want.mask.clean_mm = 2.0;
        want.last.pair = "data_6".into();
        let compared = |a| CompareChoice { a, ..CompareChoice::default() };
        want.compare.insert(Workspace::Inspect, compared(Subject::Measured));
        want.compare.insert(Workspace::Label, compared(Subject::Stored));
        assert_eq!(settings, want);
    }
}
