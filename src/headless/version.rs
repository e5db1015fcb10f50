//! `touch2touch --version`: what has to be known of a program and its machine before a result can be made again.

#[cfg(feature = "gui")]
use std::{sync::mpsc, thread, time::Duration};

use super::{Common, Output, VerbResult};
use touch2touch_pipeline::infer::bundle::Origin;
use touch2touch_pipeline::infer::runtime::runtime_report;

/// Name and version.
const SHORT: &str = concat!("touch2touch ", env!("CARGO_PKG_VERSION"));

/// The version of rten in this build. The manifest demands exactly this one, so that a prediction stays what it was.
const RTEN: &str = "0.27.0";

/// Time that the graphics driver is waited for.
#[cfg(feature = "gui")]
const PATIENCE: Duration = Duration::from_millis(800);

/// Prints the version, or with `long` also what the program is built from and runs on.
pub(super) fn run(long: bool) -> VerbResult {
    let output = Output::new(Common { json: false }, "version", 0);
    output.finish(&(), || if long { describe() } else { SHORT.to_owned() })?;
    Ok(true)
}

/// Name, version, commit, engines, models and graphics device, a line each.
fn describe() -> String {
    let commit = option_env!("TOUCH2TOUCH_COMMIT").unwrap_or(if cfg!(debug_assertions) {
        "not recorded (a build for development)"
    } else {
        "not recorded (built without git)"
    });
    let graphics = graphics();
    let models: Vec<String> = Origin::built_in().map(|origin| origin.to_string()).collect();
    let (engines, models) = (engines(), models.join(", "));
    format!("{SHORT}\ncommit    {commit}\nengines   {engines}\nmodels    {models}\ngraphics  {graphics}")
}

fn engines() -> String {
    let report = runtime_report();
    let onnx_runtime = match (&report.engine, &report.library) {
        (None, _) => return report.reason,
        (Some(engine), Some(library)) => format!("{} at {} is used", engine.label(), library.display()),
        _ => "no ONNX Runtime was found (`touch2touch runtime` says where it was looked for)".to_owned(),
    };
    format!("rten {RTEN} (built in); {onnx_runtime}")
}

/// The graphics device in words. A driver may hang or panic, and the answer is worth neither.
#[cfg(feature = "gui")]
fn graphics() -> String {
    // What the drivers say while they are looked for is no error of ours: the answer is what counts.
    log::set_max_level(log::LevelFilter::Off);
    let (answer, asked) = mpsc::channel();
    let asking = thread::Builder::new().spawn(move || answer.send(crate::gpu::context::adapter_in_words()));
    if let Err(err) = asking {
        return format!("unknown: {err}");
    }
    match asked.recv_timeout(PATIENCE) {
        Ok(Ok(adapter)) => adapter,
        Ok(Err(err)) => format!("none: {err}"),
        Err(mpsc::RecvTimeoutError::Timeout) => format!("unknown: no answer within {} ms", PATIENCE.as_millis()),
        Err(mpsc::RecvTimeoutError::Disconnected) => "unknown: the driver failed".to_owned(),
    }
}

#[cfg(not(feature = "gui"))]
fn graphics() -> String {
    "this build has no window".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rten_is_the_locked_one() {
        let lock = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.lock")).unwrap();
        assert!(
            lock.contains(&format!("name = \"rten\"\nversion = \"{RTEN}\"")),
            "set RTEN to the version in Cargo.lock"
        );
        let manifest =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/crates/pipeline/Cargo.toml")).unwrap();
        assert!(
            manifest.contains(&format!("rten = {{ version = \"={RTEN}\"")),
            "Cargo.toml must demand exactly {RTEN}"
        );
    }
}
