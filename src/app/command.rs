//! [`Command`]: everything that can happen to the state, as data, by room.

pub use super::answers::Answer;
pub use super::doctor::DoctorCommand;
pub use super::evaluate::EvaluateCommand;
pub use super::export::ExportCommand;
pub use super::follow::FollowCommand;
pub use super::inspect::InspectCommand;
pub use super::labels::{LabelsCommand, UnsavedCommand};
pub use super::learn::LearnCommand;
pub use super::library::LibraryCommand;
pub use super::pane::Pane;
pub use super::predict::PredictCommand;
pub use super::settings::SettingsCommand;
pub use super::state::view::{CameraPreset, Hover, UiRequest};
pub use super::tasks::TasksCommand;
pub use super::view::ViewCommand;
pub use super::workbench::WorkbenchCommand;

/// The table of the rooms, given to the macro `$with`.
macro_rules! rooms {
    ($with:ident) => {
        $with! {
            /// To the data set, its list, and which pair is looked at.
            Library(LibraryCommand) in library,
            /// To following a folder.
            Follow(FollowCommand) in follow,
            /// To what is on screen.
            View(ViewCommand) in view,
            /// To predictions.
            Predict(PredictCommand) in predict,
            /// To masks, review states and accepted poses.
            Labels(LabelsCommand) in labels,
            /// To the steps of a registration.
            Inspect(InspectCommand) in inspect,
            /// To layers, poses by hand and points read.
            Workbench(WorkbenchCommand) in workbench,
            /// To the results table.
            Evaluate(EvaluateCommand) in evaluate,
            /// To figures and other things that are taken away.
            Export(ExportCommand) in export,
            /// To the panel about the open data set.
            Doctor(DoctorCommand) in doctor,
            /// To networks that learn from the open pairs.
            Learn(LearnCommand) in learn,
            /// To the preferences.
            Settings(SettingsCommand) in settings,
            /// To running jobs and the log.
            Tasks(TasksCommand) in tasks,
            /// An answer of the runtime.
            Answer(Answer) in answers,
        }
    };
}
pub(in crate::app) use rooms;

macro_rules! commands {
    ($( #[doc = $doc:literal] $room:ident($command:ident) in $module:ident, )*) => {
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

rooms!(commands);
