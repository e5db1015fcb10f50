//! A graphics device that is lost (its driver crashed or was changed, its memory is full): nothing can be drawn any more, so
//! everything is saved, the window closes and the program starts again where it was.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use eframe::egui::Context;

use crate::gpu::wgpu;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::program::Program;

/// Tells the program that it was started again, and when: seconds since 1970.
const STARTED_AGAIN: &str = "TOUCH2TOUCH_STARTED_AGAIN";
/// A device that is lost again so soon will be lost for ever.
const TOO_SOON: Duration = Duration::from_secs(30);

/// Loss of the window's device, with the reason. Cheap to clone.
#[derive(Clone, Debug, Default)]
pub struct Loss(Arc<OnceLock<String>>);

impl Loss {
    /// Listens to a device as long as what is returned is kept.
    pub(crate) fn watch(&self, device: &wgpu::Device, ctx: &Context) -> Watched {
        let (loss, ctx) = (self.clone(), ctx.clone());
        device.set_device_lost_callback(move |reason, why| {
            // A window that closes destroys its device.
            if reason != wgpu::DeviceLostReason::Destroyed {
                loss.say(&why);
                ctx.request_repaint();
            }
        });
        Watched(device.clone())
    }

    /// The device is lost.
    pub fn say(&self, why: &str) {
        if self.0.set(why.to_owned()).is_ok() {
            log::error!("the graphics device was lost ({why}); the labels are saved");
        }
    }

    /// Why the device was lost, if it was.
    pub(crate) fn why(&self) -> Option<&str> {
        self.0.get().map(String::as_str)
    }
}

/// A device that is listened to. Its callback holds the window's context, which holds what the device made: it ends with the
/// window, or neither would ever be freed.
pub(crate) struct Watched(wgpu::Device);

impl Drop for Watched {
    fn drop(&mut self) {
        self.0.set_device_lost_callback(|_, _| {});
    }
}

fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// True where a program that was `started_again` then may be so now.
fn may_start(started_again: Option<&str>, now: u64) -> bool {
    let then: Option<u64> = started_again.and_then(|text| text.parse().ok());
    then.is_none_or(|then| now.saturating_sub(then) >= TOO_SOON.as_secs())
}

/// Note in the window of a program that had to start again.
pub(crate) fn greeting() -> Option<TaskError> {
    std::env::var_os(STARTED_AGAIN)?;
    let why = "the graphics device was lost; everything was saved and the studio restarted";
    Some(
        TaskError::new("Start again", why)
            .with_hint("If it happens often, look for a newer driver of the graphics card."),
    )
}

/// Starts the program again, which opens what was open last; where that is not possible, why, in words.
pub(crate) fn start_again(why: &str) -> String {
    let lost = format!("the graphics device was lost ({why}). Everything is saved: start the program again");
    if !may_start(std::env::var(STARTED_AGAIN).ok().as_deref(), now()) {
        return format!("{lost} once its driver works. It was lost twice within {} s.", TOO_SOON.as_secs());
    }
    let Some(mut program) = Program::declared().map(Program::command) else {
        return format!("{lost}; it does not know its own path.");
    };
    // Not the arguments: another data set than theirs may have been open.
    program.env(STARTED_AGAIN, now().to_string());
    log::error!("the studio starts again");
    #[cfg(unix)]
    let failed = std::os::unix::process::CommandExt::exec(&mut program);
    #[cfg(not(unix))]
    let failed = match program.spawn() {
        Ok(_) => std::process::exit(0),
        Err(err) => err,
    };
    format!("{lost}; it could not start itself: {failed}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_starts_again_but_not_twice_within_half_a_minute() {
        assert!(may_start(None, 1000));
        assert!(!may_start(Some("1000"), 1000) && !may_start(Some("1000"), 1029));
        assert!(may_start(Some("1000"), 1030) && may_start(Some("nonsense"), 1000));
        // A clock that was set back.
        assert!(!may_start(Some("1000"), 900));
    }

    #[test]
    fn the_first_reason_counts() {
        let loss = Loss::default();
        assert_eq!(loss.why(), None);
        loss.say("driver");
        loss.clone().say("again");
        assert_eq!(loss.why(), Some("driver"));
    }
}
