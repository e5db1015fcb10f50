//! [`Command`]: everything that can happen to the state, as data, by room.

pub use super::adapt::AdaptCommand;
pub use super::answers::Answer;
pub use super::dial::DialCommand;
pub use super::evaluate::EvaluateCommand;
pub use super::export::ExportCommand;
pub use super::follow::FollowCommand;
pub use super::inspect::InspectCommand;
pub use super::labels::{LabelsCommand, UnsavedCommand};
pub use super::library::LibraryCommand;
pub use super::pane::Pane;
pub use super::predict::PredictCommand;
pub use super::seeds::SeedsCommand;
pub use super::services::Opened;
pub use super::settings::SettingsCommand;
pub use super::state::view::{CameraPreset, Hover, UiRequest};
pub use super::tasks::TasksCommand;
pub use super::train::TrainCommand;
pub use super::view::ViewCommand;
pub use super::workbench::WorkbenchCommand;

macro_rules! commands {
    ($( #[doc = $doc:literal] $room:ident($command:ident), )*) => {
        /// Everything that can happen to the state. Views and actions send the rooms' commands; jobs answer.
        #[derive(Clone, Debug)]
        pub enum Command { $( #[doc = $doc] $room($command), )* }

        $( impl From<$command> for Command {
            fn from(command: $command) -> Self {
                Self::$room(command)
            }
        } )*
    };
}

commands! {
    /// To the data set, its list, and which pair is looked at.
    Library(LibraryCommand),
    /// To following a folder.
    Follow(FollowCommand),
    /// To what is on screen.
    View(ViewCommand),
    /// To predictions.
    Predict(PredictCommand),
    /// To several seeds of one touch.
    Seeds(SeedsCommand),
    /// To masks, review states and accepted poses.
    Labels(LabelsCommand),
    /// To the time machine and the basin map.
    Inspect(InspectCommand),
    /// To layers, poses by hand and measurements.
    Workbench(WorkbenchCommand),
    /// To the results table.
    Evaluate(EvaluateCommand),
    /// To the dial.
    Dial(DialCommand),
    /// To figures and other things that are taken away.
    Export(ExportCommand),
    /// The fit to one's own pairs.
    Adapt(AdaptCommand),
    /// The training of the mask model.
    Train(TrainCommand),
    /// To the preferences.
    Settings(SettingsCommand),
    /// To running jobs and the log.
    Tasks(TasksCommand),
    /// An answer of the runtime.
    Answer(Answer),
}
