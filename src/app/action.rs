//! [`Action`]: the table of what a person can trigger. Menus, toolbar, palette and shortcut sheet are made from it; the
//! commands in its rows are spelt in [`super::act`].

mod here;
mod shortcut;

use strum::{EnumIter, EnumString, IntoEnumIterator, IntoStaticStr};

pub use shortcut::Shortcut;
use shortcut::{alt, ctrl, ctrl_shift, plain, shift};

with_texts! {
    /// The part of the shortcut sheet an action stands in.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter)]
    pub enum Group(name) {
        /// Opening and saving.
        File = "File",
        /// From pair to pair.
        Navigate = "Navigate",
        /// Predictions.
        Generate = "Generate",
        /// Contact masks.
        Mask = "Mask",
        /// Registration.
        Pose = "Pose",
        /// The view: what is shown, and how.
        View = "View",
        /// Help.
        Help = "Help",
    }
}

impl Group {
    /// The actions, in the order of the table.
    pub fn actions(self) -> impl Iterator<Item = Action> {
        Action::iter().filter(move |action| action.group() == self)
    }
}

/// The table, given to the macro `$with`: name, part of the sheet, name on screen, what it does in words, keys, and the
/// command that it is now, `None` where it cannot do anything (grayed out). [`super::act`] has what these say.
macro_rules! actions {
    ($with:ident) => {
        $with! {
        OpenFolder, File, "Open folder…", "Opens a folder of the lab's files or of image pairs", [ctrl("O"), ctrl_shift("O")],
            _ => ui(UiRequest::Pick(Purpose::Folder));
        OpenDemo, File, "Open the demo", "Opens the built-in simulated data", [],
            _ => does(LibraryCommand::Open(Place::Demo));
        Follow, File, "Follow the folder", "Shows and predicts each new touch in the open folder; again to stop", [ctrl_shift("F")],
            state => follow(state);
        Reload, File, "Reload", "Reads the open data set again", [plain("F5")],
            state => opened(state, LibraryCommand::Reload);
        AboutData, File, "About this data", "What is in this data set, how well the models do on it, and what would help", [],
            state => opened(state, DoctorCommand::Show(!state.doctor.shown));
        Save, File, "Save now", "Saves labels and preferences now; this also happens after every change", [ctrl("S")],
            _ => does(LabelsCommand::Save);
        ExportMeasured, File, "Export the measured pair…", "Writes point cloud (PLY), pose (JSON) and CAD model in the hand (STL), from the measured imprint", [],
            state => export(state, ImprintSource::Measured);
        ExportPredicted, File, "Export the predicted pair…", "Writes point cloud (PLY), pose (JSON) and CAD model in the hand (STL), from the predicted imprint", [],
            state => export(state, ImprintSource::Predicted);
        ExportMasks, File, "Export masks…", "Writes masks as a folder for UNet training, or as PNG only", [ctrl("E")],
            state => opened(state, ExportCommand::AskMasks(true));
        ImportMasks, File, "Import masks…", "Reads masks from a folder of PNG files with the names of an export; what you drew stays", [],
            state => opened(state, ViewCommand::Ui(UiRequest::Pick(Purpose::Masks)));

        PreviousPair, Navigate, "Previous pair", "Shows the previous pair of the list", [plain("A"), plain("PgUp")],
            state => listed(state, LibraryCommand::Step(-1));
        NextPair, Navigate, "Next pair", "Shows the next pair of the list", [plain("D"), plain("PgDn")],
            state => listed(state, LibraryCommand::Step(1));
        FirstPair, Navigate, "First pair", "Shows the first pair of the list", [plain("Home")],
            state => listed(state, LibraryCommand::First);
        LastPair, Navigate, "Last pair", "Shows the last pair of the list", [plain("End")],
            state => listed(state, LibraryCommand::Last);
        NextUnfinished, Navigate, "Next unfinished", "Shows the next pair that is neither done nor skipped", [shift("N")],
            state => listed(state, LibraryCommand::NextUnfinished);
        NextWorst, Navigate, "Next worst", "Shows the worst pair by the chosen score, then the second worst, and so on", [plain("N")],
            state => listed(state, LibraryCommand::NextWorst).filter(|_| state.table.by().is_some());
        OtherFinger, Navigate, "Other finger", "Switches to the other finger", [plain("U")],
            state => does(ViewCommand::SelectFinger(state.other_finger()));
        BothFingers, Navigate, "Both fingers", "Shows both fingers, or only the active one", [shift("U")],
            state => does(ViewCommand::ShowBothFingers(!state.selection.both_fingers));
        FindPair, Navigate, "Filter pairs", "Goes to the filter of the list", [ctrl("F")],
            state => when(state.selection.panes.contains(&Pane::Browser), ViewCommand::Ui(UiRequest::FocusFilter));

        Generate, Generate, "Generate", "Predicts the Soft Bubble imprint from the GelSlim image", [ctrl("G")],
            state => when(results::can_generate(state).is_ok(), PredictCommand::Generate);
        GenerateNewSeed, Generate, "Generate with a new seed", "Draws a new seed and generates", [ctrl_shift("G")],
            state => when(results::can_generate(state).is_ok(), PredictCommand::GenerateNewSeed);
        FitPairs, Generate, "Fit to my pairs", "Fits the generator to the open pairs, and says what it is worth on pairs that were left out", [],
            state => when(learn::can_start(state, Network::Generator), LearnCommand::Start(Network::Generator));
        UseModel, Generate, "Use the new model", "Predicts or makes automatic masks with the model that was fitted or trained on these pairs", [],
            state => can_use(state, state.learn.shown);
        PredictAll, Generate, "Predict all", "Predicts and scores every pair of the open data set with the chosen generators; what was scored before is not computed again", [],
            state => when(can_score_all(state), EvaluateCommand::Start);
        ExportTable, Generate, "Export the results table…", "Writes the results table as CSV and JSON", [],
            state => when(state.table.result.is_some(), ViewCommand::Ui(UiRequest::Pick(Purpose::Table)));
        CancelJobs, Generate, "Cancel", "Closes a dialog, drops a stroke, rejects a suggestion; else stops what is running", [plain("Esc")],
            state => cancel(state);
        Refit, Generate, "Match depths to this data set", "Matches the mean and deviation of predicted depths to the measurements of this data set (refit)", [],
            state => when(results::can_generate(state).is_ok(), PredictCommand::Refit);

        Brush, Mask, "Brush", "Paints the mask; the right button erases", [plain("1"), plain("B")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Brush));
        Eraser, Mask, "Eraser", "Erases the mask", [plain("2"), plain("E")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Eraser));
        Lasso, Mask, "Lasso", "Adds the area you outline; the right button removes it", [plain("L")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Lasso));
        Polygon, Mask, "Polygon", "Adds the area between the corners you click; Enter or the first corner closes it, Backspace takes a corner back, the right button removes", [plain("P")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Polygon));
        RectangleTool, Mask, "Rectangle", "Adds a rectangle; the right button removes", [plain("R")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Rectangle));
        Wand, Mask, "Wand", "Adds the connected area of about the same depth; drag right for more", [plain("M")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Wand));
        PanTool, Mask, "Move the image", "Dragging moves the image instead of drawing", [plain("8")],
            _ => does(prefer(|s| s.mask.tool = MaskTool::Pan));
        PaintIn3d, Mask, "Draw in 3D", "Mask tools draw on the 3D views; off: dragging turns the view", [alt("B")],
            state => toggle(state, SceneTool::Paint);
        PaintLayers, Mask, "Draw through all layers", "Drawing in 3D also marks hidden points; off: only those in front", [alt("L")],
            _ => does(prefer(|s| s.mask.layers = s.mask.layers.other()));
        PaintIgnore, Mask, "Paint ignored pixels", "Tools mark pixels to ignore, neither contact nor free; off: they paint contact", [shift("B")],
            _ => does(paint(Paint::Ignore));
        BrushSmaller, Mask, "Smaller brush", "Makes the brush smaller", [plain("[")],
            _ => does(prefer(|s| s.mask.radius_px /= BRUSH_STEP));
        BrushLarger, Mask, "Larger brush", "Makes the brush larger", [plain("]")],
            _ => does(prefer(|s| s.mask.radius_px *= BRUSH_STEP));
        FillHoles, Mask, "Fill holes", "Fills the holes of the mask", [plain("H")],
            state => clean_up(state, CleanKind::FillHoles);
        LargestIsland, Mask, "Largest island", "Keeps only the largest connected part of the mask", [plain("K")],
            state => clean_up(state, CleanKind::LargestIsland);
        SmoothMask, Mask, "Smooth the mask", "Smooths the outline, within the clean-up size", [],
            state => clean_up(state, CleanKind::Smooth);
        GrowMask, Mask, "Grow the mask", "Grows the mask by the clean-up size", [],
            state => clean_up(state, CleanKind::Grow);
        ShrinkMask, Mask, "Shrink the mask", "Shrinks the mask by the clean-up size", [],
            state => clean_up(state, CleanKind::Shrink);
        AdoptAutomatic, Mask, "Copy the automatic mask", "Takes the automatic mask as a start for editing", [plain("T")],
            state => editable(state, LabelsCommand::AdoptAutomatic);
        Propose, Mask, "Propose a mask", "Shows a suggested mask over the current one, to accept as a whole or by brush; nothing changes until then", [plain("G")],
            state => of_pair(state, ViewCommand::Propose(!state.selection.proposing));
        ResetMask, Mask, "Back to the automatic mask", "Removes what you drew", [shift("T")],
            state => editable(state, LabelsCommand::ResetMask).filter(|_| is_corrected(state));
        Undo, Mask, "Undo", "Undoes the last change to what is on screen, or the last polygon corner", [ctrl("Z")],
            state => undo(state);
        Redo, Mask, "Redo", "Redoes what was undone", [ctrl_shift("Z"), ctrl("Y")],
            state => when(state.history.next_redo(state.pair_name(), &results::mask_places(state)).is_some(), LabelsCommand::Redo);
        TrainMasks, Mask, "Train mask model…", "Shows from how many corrected masks the mask model would learn, and trains it in the background", [],
            _ => does(LearnCommand::Show(Network::Masks));
        StartTraining, Mask, "Start training", "Trains the mask model on the masks of pairs marked done; the new model makes the automatic masks when it is ready", [],
            state => when(learn::can_start(state, Network::Masks), LearnCommand::Start(Network::Masks));
        MaskVisible, Mask, "Show the mask", "Shows or hides the mask over the images", [plain("S")],
            _ => does(prefer(|s| s.mask_visible ^= true));
        MaskOutline, Mask, "Mask as outline", "Shows only the outline of the mask", [shift("S")],
            _ => does(prefer(|s| s.mask_outline ^= true));
        DoneAndNext, Mask, "Done and next", "Marks the pair done, with the masks on screen, and goes to the next unfinished one", [ctrl("Enter")],
            state => editable(state, LibraryCommand::DoneAndNext);
        Flag, Mask, "Flag", "Marks the pair as doubtful", [plain("!")],
            state => editable(state, LabelsCommand::SetReview(Review::Flagged));
        Skip, Mask, "Skip", "Leaves the pair out", [ctrl("Backspace")],
            state => editable(state, LabelsCommand::SetReview(Review::Skip));

        RunPose, Pose, "Try again", "Computes again what failed", [ctrl("R")],
            state => of_pair(state, TasksCommand::Retry);
        TryTools, Pose, "Try all tools", "Fits every CAD model of the data set to this pair and ranks them: which tool is it?", [],
            state => of_pair(state, WorkbenchCommand::TryTools(true));
        AcceptMeasuredPose, Pose, "Accept the measured pose", "Saves the pose of the measured imprint with the pair", [],
            state => accept(state, ImprintSource::Measured);
        AcceptPredictedPose, Pose, "Accept the predicted pose", "Saves the pose of the predicted imprint with the pair", [],
            state => accept(state, ImprintSource::Predicted);
        PoseTool, Pose, "Pose tool", "Moves the tool by hand in the 3D panes: arrow keys, or the handles", [plain("Z")],
            state => toggle(state, SceneTool::Pose);
        NextAnswer, Pose, "Next answer", "Puts the tool at the next of the poses that fit about as well", [alt("]")],
            state => when(workbench::answer(state).is_some(), WorkbenchCommand::NextAnswer);
        IcpFromHere, Pose, "Register from here", "Registers again, starting from the pose set by hand", [shift("Z")],
            state => when(in_hand(state), WorkbenchCommand::StartIcp);
        Accept, Pose, "Accept", "Closes the polygon, accepts the suggested mask, or saves the pose set by hand", [plain("Enter")],
            state => accept_shown(state);
        RevertHand, Pose, "Drop the pose by hand", "Goes back to the registered pose", [],
            state => when(state.workbench.hand.is_some(), WorkbenchCommand::RevertHand);
        StepBack, Pose, "Previous step", "Previous step of the registration", [plain(",")],
            state => inspect(state, |s| s.at > 0, InspectCommand::By(-1));
        StepForward, Pose, "Next step", "Next step of the registration", [plain(".")],
            state => inspect(state, |s| !s.is_last(), InspectCommand::By(1));
        PlaySteps, Pose, "Play the steps", "Plays the registration, or pauses; with the pointer in the steps or a 3D view", [plain("Space")],
            state => inspect(state, |s| s.inspection.num_steps(s.run) > 1, InspectCommand::Play(!state.inspect.playing));
        OwnStarts, Pose, "All starts", "Back from a single start to all that the registration tries", [],
            state => when(state.inspect.start.is_some(), InspectCommand::Start(None));

        LockRange, View, "Lock the color range", "Same colors in every pair; off: fitted to each", [plain("O")],
            _ => does(prefer(|s| s.range.locked ^= true));
        RangeOnce, View, "Fit the color range", "Fits the colors to what is shown", [plain("C")],
            state => of_pair(state, SettingsCommand::RangeFromShown);
        Fit, View, "Fit", "Fits images and 3D views to their panes", [plain("0")],
            _ => ui(UiRequest::Fit);
        CameraLeft, View, "View from the left", "Looks along the closing axis from the left finger", [ctrl("1")],
            _ => ui(UiRequest::Camera(CameraPreset::Left));
        CameraRight, View, "View from the right", "Looks along the closing axis from the right finger", [ctrl("2")],
            _ => ui(UiRequest::Camera(CameraPreset::Right));
        CameraFront, View, "View from the front", "Looks across the closing axis", [ctrl("3")],
            _ => ui(UiRequest::Camera(CameraPreset::Front));
        CameraOblique, View, "Oblique view", "The view at the start: from above a corner", [ctrl("7")],
            _ => ui(UiRequest::Camera(CameraPreset::Oblique));
        CameraTop, View, "View from the top", "Looks along the tool", [ctrl("4")],
            _ => ui(UiRequest::Camera(CameraPreset::Top));
        Distances, View, "Distance to the CAD", "Colors CAD model and contact points in 3D by their distance, in mm", [plain("V")],
            state => distances(state);
        BothClouds, View, "Both clouds", "Shows measured and predicted points in each 3D view", [],
            state => does(WorkbenchCommand::SetBothClouds(!state.workbench.both_clouds));
        Parallel, View, "Parallel projection", "No perspective in 3D", [plain("I")],
            _ => does(prefer(|s| s.scene.orthographic ^= true));
        Footprint, View, "GelSlim window", "Outlines what the GelSlim sees, on bubble images", [],
            _ => does(prefer(|s| s.footprint_visible ^= true));
        SwitchTheme, View, "Dark theme", "Switches between the dark and the light theme", [],
            _ => does(prefer(|s| s.theme = next_of(&s.theme)));
        ResetWorkspace, View, "Reset workspace", "Puts the panes of this workspace back to the default layout", [],
            _ => ui(UiRequest::ResetWorkspace);
        MaximizePane, View, "Maximize pane", "Makes one pane fill the window", [plain("`")],
            _ => ui(UiRequest::ToggleMaximized);
        NextPane, View, "Next pane", "Moves the keyboard focus to the next pane; Tab then goes through its controls", [plain("F6")],
            _ => ui(UiRequest::StepPane(1));
        PreviousPane, View, "Previous pane", "Moves the keyboard focus to the previous pane", [shift("F6")],
            _ => ui(UiRequest::StepPane(-1));
        Fullscreen, View, "Full screen", "Fills the screen", [plain("F11")],
            _ => ui(UiRequest::ToggleFullscreen);
        Screenshot, View, "Screenshot", "Saves a picture of the window to your Pictures folder", [plain("F12")],
            _ => ui(UiRequest::Screenshot);
        SavePane, View, "Save this pane", "Saves a picture of the pane under the pointer, with its bar and unit", [shift("F12")],
            _ => ui(UiRequest::PanePicture { pane: None, copied: false });
        CopyPane, View, "Copy this pane", "Copies a picture of the pane under the pointer", [ctrl("F12")],
            _ => ui(UiRequest::PanePicture { pane: None, copied: true });
        CopyHovered, View, "Copy the hovered value", "Copies the number under the pointer", [ctrl("C")],
            state => when(state.selection.hover.is_some(), ViewCommand::Ui(UiRequest::CopyHovered));

        Palette, Help, "Command palette", "Finds any action, pane, pair or tool", [ctrl("P"), ctrl("K")],
            state => does(ViewCommand::SetPalette(!state.selection.palette));
        ShortcutSheet, Help, "Shortcuts", "Shows the keys of all actions", [plain("?"), plain("F1")],
            state => does(ViewCommand::SetShortcutSheet(!state.selection.shortcut_sheet));
        ResetSettings, Help, "Reset preferences", "Sets all preferences to their defaults", [],
            _ => does(SettingsCommand::ResetSettings);
        }
    };
}
pub(super) use actions;

macro_rules! define {
    ($( $name:ident, $group:ident, $label:literal, $tooltip:literal, [$($shortcut:expr),*], $state:pat => $does:expr; )*) => {
        /// Something a person can trigger. The settings name it in snake case.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter, EnumString, IntoStaticStr)]
        #[strum(serialize_all = "snake_case")]
        pub enum Action {
            $( #[doc = $tooltip] $name, )*
        }

        impl Action {
            /// The name on screen, in sentence case; `…` if a question follows.
            pub fn name(self) -> &'static str {
                match self { $( Self::$name => $label, )* }
            }

            /// The effect, in words.
            pub fn tooltip(self) -> &'static str {
                match self { $( Self::$name => $tooltip, )* }
            }

            /// The part of the shortcut sheet it stands in.
            pub fn group(self) -> Group {
                match self { $( Self::$name => Group::$group, )* }
            }

            /// The shortcuts, the main one first.
            pub fn keys(self) -> &'static [Shortcut] {
                match self { $( Self::$name => const { &[$($shortcut),*] }, )* }
            }
        }
    };
}

actions!(define);

/// A text in which `[[generate]]` stands for the main shortcut of that action, or for its name where it has none.
pub fn with_keys(text: &str) -> String {
    let mut parts = text.split("[[");
    let mut filled = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("]]").unwrap_or((part, ""));
        filled += &name.parse().map_or_else(
            |_| name.to_owned(),
            |action: Action| action.keys().first().map_or_else(|| action.name().to_owned(), Shortcut::to_string),
        );
        filled += rest;
    }
    filled
}

impl Action {
    /// The main shortcut as menus show it; empty if there is none.
    pub fn key_text(self) -> String {
        self.keys().first().map_or(String::new(), Shortcut::to_string)
    }

    /// A text with the main shortcut behind it: `Stop this job (Esc)`.
    pub fn behind(self, text: &str) -> String {
        match self.keys().first() {
            Some(shortcut) => format!("{text} ({shortcut})"),
            None => text.to_owned(),
        }
    }

    /// Tooltip with the shortcut behind it.
    pub fn help(self) -> String {
        self.behind(self.tooltip())
    }

    /// Other words that people look for it by, in small letters.
    pub fn words(self) -> std::str::SplitWhitespace<'static> {
        let text = match self {
            Self::OpenFolder => "load directory data dataset browse file",
            Self::OpenDemo => "example sample simulated simulator",
            Self::Follow => "live watch camera stream",
            Self::Reload => "refresh again",
            Self::AboutData => "doctor facts summary info problems what is own",
            Self::ExportMasks => "unet training labels png save",
            Self::ImportMasks => "unet labels png load read",
            Self::NextWorst => "bad largest error outlier failure hardest",
            Self::NextUnfinished => "todo open unlabeled remaining",
            Self::FindPair => "search list find samples",
            Self::Generate => "predict prediction run inference diffusion",
            Self::FitPairs => "adapt calibrate tune finetune train",
            Self::TrainMasks | Self::StartTraining => "unet learn finetune tune segmentation",
            Self::PredictAll => "score metrics benchmark results table evaluate",
            Self::ExportTable => "csv json save results",
            Self::CancelJobs => "stop abort interrupt",
            Self::Refit => "statistics mean deviation shift",
            Self::AdoptAutomatic => "use copy automatic mask",
            Self::PaintIn3d | Self::PaintLayers => "cloud points brush lasso front occlusion",
            Self::PaintIgnore => "unknown unsure void class",
            Self::Propose => "prelabel pre-label suggest auto cad",
            Self::Accept => "confirm take yes",
            Self::ResetMask => "delete mask automatic again",
            Self::Undo => "revert back",
            Self::BrushSmaller | Self::BrushLarger => "pen size radius width",
            Self::RunPose => "retry recompute register registration icp failed",
            Self::TryTools => "which tool wrong cad model identify rank recognize",
            Self::PoseTool => "hand gizmo drag manual move",
            Self::LockRange | Self::RangeOnce => "colorbar colormap scale limits minimum maximum mm",
            Self::Fit => "zoom center home view",
            Self::Parallel => "orthographic perspective camera",
            Self::Footprint => "rectangle outline crop",
            Self::SwitchTheme => "mode bright black white appearance",
            Self::Screenshot | Self::SavePane => "png picture image save export",
            Self::CopyPane => "png picture image clipboard",
            Self::CopyHovered => "clipboard number",
            Self::ShortcutSheet => "keys keyboard help bindings hotkeys",
            Self::ResetSettings => "defaults factory settings",
            Self::ResetWorkspace => "layout panes windows default",
            _ => "",
        };
        text.split_whitespace()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn no_two_actions_share_a_shortcut_or_a_name() {
        let mut shortcuts: BTreeMap<Shortcut, Action> = BTreeMap::new();
        let mut names: BTreeMap<&str, Action> = BTreeMap::new();
        for action in Action::iter() {
            for shortcut in action.keys() {
                assert_eq!(shortcuts.insert(*shortcut, action), None, "{shortcut} is taken, {action:?} wants it too");
            }
            assert_eq!(names.insert(action.name(), action), None);
        }
    }

    #[test]
    fn keys_are_said_behind_texts_and_within() {
        assert_eq!(Action::Redo.help(), "Redoes what was undone (Ctrl+Shift+Z)");
        assert_eq!(with_keys("[[redo]], [[open_demo]] or [[fit]]."), "Ctrl+Shift+Z, Open the demo or 0.");
        assert_eq!(with_keys("Nothing to fill"), "Nothing to fill");
        assert_eq!((Action::CameraTop.key_text().as_str(), Action::OpenDemo.key_text().as_str()), ("Ctrl+4", ""));
    }

    #[test]
    fn each_action_says_what_it_does() {
        for action in Action::iter() {
            assert!(action.tooltip().len() >= 8 && !action.tooltip().ends_with('.'), "{action:?}");
            assert!(action.name().chars().next().is_some_and(|c| c.is_uppercase() || c.is_numeric()), "{action:?}");
        }
        assert_eq!(Group::iter().flat_map(Group::actions).count(), Action::iter().count());
    }
}
