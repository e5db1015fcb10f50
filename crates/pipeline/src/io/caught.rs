//! Panics that become errors: a pair, a job or a thread that fails costs itself and never the run.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs `work`; where it panics, what the panic said.
///
/// Nothing that `work` borrowed mutably may be used afterwards, as it may be half changed.
///
/// # Errors
/// The panic's message.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| panic_message(&*payload))
}

/// Message of a panic.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_with_its_message() {
        assert_eq!(caught(|| 3), Ok(3));
        assert_eq!(caught(|| panic!("a {}", "b")), Err::<(), _>("a b".into()));
        assert_eq!(caught(|| panic!("c")), Err::<(), _>("c".into()));
        assert_eq!(caught(|| std::panic::panic_any(1)), Err::<(), _>("no message".into()));
    }
}
