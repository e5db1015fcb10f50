//! [`guarded`]: what goes wrong with one pair of a run is that pair's failure, even a bug of this program.

use std::path::PathBuf;

use touch2touch_pipeline::io::catch_panic::catch_panic;
use touch2touch_pipeline::io::files::listed;

/// A panic on a pair's files.
#[derive(Debug, thiserror::Error)]
#[error("an internal error, which is a bug: {message}; please report it with {}", names(files))]
pub(super) struct Bug {
    files: Vec<PathBuf>,
    message: String,
}

fn names(files: &[PathBuf]) -> String {
    if files.is_empty() { "the data set".to_owned() } else { listed(files) }
}

/// Does the work of one pair. After a [`Bug`], whatever `work` changes must be made anew.
///
/// # Errors
/// The errors of `work`, and [`Bug`] where it panics.
pub(super) fn guarded<T>(files: Vec<PathBuf>, work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    catch_panic(work).unwrap_or_else(|message| Err(Bug { files, message }.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_said_with_the_files_and_other_errors_stay_what_they_are() {
        assert_eq!(guarded(Vec::new(), || Ok(3)).unwrap(), 3);
        let other = guarded::<()>(Vec::new(), || anyhow::bail!("no such finger")).unwrap_err();
        assert!(!other.is::<Bug>() && other.to_string() == "no such finger");
        let bug = guarded::<()>(vec!["a.pt".into(), "b.pt".into()], || panic!("index 7")).unwrap_err();
        let text = bug.to_string();
        assert!(bug.is::<Bug>() && text.contains("index 7") && text.ends_with("a.pt, b.pt"), "{text}");
        assert!(guarded::<()>(Vec::new(), || panic!("x")).unwrap_err().to_string().ends_with("the data set"));
    }
}
