//! [`Action`]: the table of what a person can trigger. Menus, toolbar, palette and shortcut sheet are made from it; what
//! an action does is in [`super::act`].

mod bindings;
mod here;
mod key;

use strum::{EnumIter, EnumString, IntoEnumIterator, IntoStaticStr};

pub use bindings::Bindings;
pub use key::{Key, Shortcut};
use key::{alt, alt_shift, ctrl, ctrl_shift, plain, shift};

/// The part of the shortcut sheet an action stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter)]
pub enum Group {
    /// Opening and saving.
    File,
    /// From pair to pair.
    Navigate,
    /// Predictions.
    Generate,
    /// Contact masks.
    Mask,
    /// Registration.
    Pose,
    /// What is shown and how.
    View,
    /// Help.
    Help,
}

impl Group {
    /// The heading.
    pub fn name(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Navigate => "Navigate",
            Self::Generate => "Generate",
            Self::Mask => "Mask",
            Self::Pose => "Pose",
            Self::View => "View",
            Self::Help => "Help",
        }
    }

    /// Its actions, in the order of the table.
    pub fn actions(self) -> impl Iterator<Item = Action> {
        Action::iter().filter(move |action| action.group() == self)
    }
}

macro_rules! actions {
    ($( $name:ident, $group:ident, $label:literal, $tooltip:literal, [$($shortcut:expr),*]; )*) => {
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

            /// What it does.
            pub fn tooltip(self) -> &'static str {
                match self { $( Self::$name => $tooltip, )* }
            }

            /// The part of the shortcut sheet it stands in.
            pub fn group(self) -> Group {
                match self { $( Self::$name => Group::$group, )* }
            }

            /// Its shortcuts where a person chose none ([`Bindings`] has those in force), the main one first.
            pub fn defaults(self) -> &'static [Shortcut] {
                match self { $( Self::$name => const { &[$($shortcut),*] }, )* }
            }
        }
    };
}

use Key as K;
actions! {
    OpenFolder, File, "Open folder…", "Opens a folder with the lab's files or with images", [ctrl(K::O), ctrl_shift(K::O)];
    OpenDemo, File, "Open the demo", "Opens the built-in simulated data", [];
    Follow, File, "Follow the folder", "Shows and predicts each touch that arrives in the open folder, or stops", [ctrl_shift(K::F)];
    Reload, File, "Reload", "Reads the open data set again", [plain(K::F5)];
    Save, File, "Save now", "Writes labels and preferences now; they are also saved after every change", [ctrl(K::S)];
    Figure, File, "Figure…", "Draws pairs side by side for a paper, with one range of colors, as PNG or SVG", [ctrl_shift(K::E)];
    SaveCase, File, "Save case…", "Writes this pair with all that its results depend on into one file, which opens to the same picture elsewhere", [];
    OwnPreferences, File, "Back to my preferences", "Gives your own preferences back, while the case stays open", [];
    ExportMeasured, File, "Export the measured pair…", "Writes cloud (PLY), pose (JSON) and aligned mesh (STL) of the measured imprint", [];
    ExportPredicted, File, "Export the predicted pair…", "Writes cloud (PLY), pose (JSON) and aligned mesh (STL) of the predicted imprint", [];
    ExportMasks, File, "Export masks…", "Writes the masks as a folder that the UNet training reads, as NPY, COCO or PNG", [ctrl(K::E)];
    ImportMasks, File, "Import masks…", "Takes masks over from a folder of PNG, NPY or COCO files, named as an export names them; hand work stays", [];

    PreviousPair, Navigate, "Previous pair", "Shows the previous pair of the list", [plain(K::A), plain(K::PageUp)];
    NextPair, Navigate, "Next pair", "Shows the next pair of the list", [plain(K::D), plain(K::PageDown)];
    TenBack, Navigate, "10 back", "Moves 10 pairs back in the list", [shift(K::A)];
    TenForward, Navigate, "10 forward", "Moves 10 pairs forward in the list", [shift(K::D)];
    FirstPair, Navigate, "First pair", "Shows the first pair of the list", [plain(K::Home)];
    LastPair, Navigate, "Last pair", "Shows the last pair of the list", [plain(K::End)];
    NextUnfinished, Navigate, "Next unfinished", "Shows the next pair that is neither done nor skipped", [shift(K::N)];
    NextWorst, Navigate, "Next worst", "Shows the pair that is worst by the chosen score, then the next worse one", [plain(K::N)];
    NextUncertain, Navigate, "Next uncertain", "Shows the most uncertain pair that is neither done nor skipped, then the next; ranks the pairs first where they are not", [alt(K::N)];
    OtherFinger, Navigate, "Other finger", "Makes the other finger the active one", [plain(K::U)];
    BothFingers, Navigate, "Both fingers", "Shows both fingers, or only the active one", [shift(K::U)];
    FindPair, Navigate, "Filter pairs", "Moves the keyboard to the filter of the list", [ctrl(K::F)];

    Generate, Generate, "Generate", "Predicts the Soft Bubble imprint from the GelSlim image", [ctrl(K::G)];
    GenerateNewSeed, Generate, "Generate with a new seed", "Draws another seed, then generates", [ctrl_shift(K::G)];
    RunSeeds, Generate, "Several seeds", "Predicts the touch with several seeds, one after the other, or stops; shows where they disagree", [];
    LockSeed, Generate, "Lock the seed", "Keeps the seed when generating again, or draws a new one each time", [ctrl(K::L)];
    FitPairs, Generate, "Fit to my pairs", "Fits the generator to the open pairs, and says what it is worth on pairs that were left out", [];
    UseFit, Generate, "Use the fitted model", "Predicts with the model that was fitted to these pairs", [];
    EvaluateDataset, Generate, "Evaluate the data set", "Scores the chosen generators on the open data set, as the paper's results table does", [];
    PredictAll, Generate, "Predict all", "Predicts and scores every pair of the open data set with the chosen generators; what was scored before is not computed again", [];
    TurnDial, Generate, "Turn the dial", "Poses many pairs with every value of the chosen dial (mask threshold, probability, gate, trim, shift)", [];
    RankMasks, Generate, "Rank by uncertainty", "Asks the mask model about every measured imprint and registers its pose, so that the most uncertain masks come first; runs no generator", [];
    ExportTable, Generate, "Export the results table…", "Writes the results table as CSV, Markdown, LaTeX and JSON", [];
    CancelJobs, Generate, "Cancel", "Stops what is running; gives up a stroke, rejects a proposal", [plain(K::Escape)];
    NextShift, Generate, "Next range mapping", "Goes through raw, paper shift, exact inverse and the refit", [shift(K::P)];
    Refit, Generate, "Refit on this data set", "Computes shift statistics of this data set's predictions and measurements, and uses them", [];

    Brush, Mask, "Brush", "Adds to the mask while the button is down", [plain(K::Num1), plain(K::B)];
    Eraser, Mask, "Eraser", "Removes from the mask while the button is down", [plain(K::Num2), plain(K::E)];
    Lasso, Mask, "Lasso", "Adds what a drawn line encloses; the right button removes", [plain(K::L)];
    Polygon, Mask, "Polygon", "Adds what lines between clicks enclose; a double click ends it, the right button removes", [plain(K::P)];
    RectangleTool, Mask, "Rectangle", "Adds a rectangle; the right button removes", [plain(K::R)];
    Wand, Mask, "Wand", "Adds what is connected with the point and about as deep; drag to the right for more", [plain(K::M)];
    PanTool, Mask, "Move the image", "The pointer moves the image instead of drawing", [plain(K::Num8)];
    PaintIn3d, Mask, "Draw in 3D", "Mask tools draw on the points of the 3D views, or the pointer turns the views again", [alt(K::B)];
    PaintLayers, Mask, "Draw through all layers", "Drawings in 3D reach all points under them, also hidden ones, or only the front-most", [alt(K::L)];
    PaintIgnore, Mask, "Paint ignored pixels", "Tools mark pixels that count neither as contact nor as free of it, or paint contact again", [shift(K::B)];
    LastTool, Mask, "Last tool", "Goes back to the tool before", [plain(K::Q)];
    BrushSmaller, Mask, "Smaller brush", "Makes the brush smaller", [plain(K::OpenBracket)];
    BrushLarger, Mask, "Larger brush", "Makes the brush larger", [plain(K::CloseBracket)];
    FillHoles, Mask, "Fill holes", "Fills the holes of the mask", [plain(K::H)];
    LargestIsland, Mask, "Largest island", "Keeps only the largest connected part of the mask", [plain(K::K)];
    DropSmall, Mask, "Drop small islands", "Removes islands smaller across than the clean-up size", [];
    OpenMask, Mask, "Open the mask", "Removes what is thinner than the clean-up size", [];
    CloseMask, Mask, "Close the mask", "Fills gaps thinner than the clean-up size", [];
    SmoothMask, Mask, "Smooth the mask", "Makes each pixel what most around it are, within the clean-up size", [];
    GrowMask, Mask, "Grow the mask", "Adds what lies within the clean-up size", [];
    ShrinkMask, Mask, "Shrink the mask", "Removes what lies within the clean-up size of the outside", [];
    ClearBorder, Mask, "Clear the border", "Removes islands that touch the edge of the image", [];
    ClearMask, Mask, "Clear the mask", "Leaves no contact in the mask, to draw it anew", [plain(K::Delete)];
    AdoptAutomatic, Mask, "Threshold to mask", "Makes the mask of the chosen automatic source the corrected one", [plain(K::T)];
    Propose, Mask, "Propose a mask", "Shows the mask of the chosen source over the one in force, to accept or to let through by brush; nothing changes before", [plain(K::G)];
    NextProposal, Mask, "Next proposal source", "Goes through what proposes masks: the automatic source, CAD distance, strokes, other masks", [shift(K::G)];
    ProposeAll, Mask, "Propose for all listed", "Makes what the source proposes the mask of every pair in the list that is not marked done, flagged or skipped; hand work stays, and each pair can be undone", [];
    LetThrough, Mask, "Let the proposal through", "Tools let what is proposed through where they paint, or paint contact again", [shift(K::L)];
    TakeOver, Mask, "Take the other imprint's mask", "Copies the mask of the measured imprint to the predicted one, or the other way round; each keeps its own", [];
    ResetMask, Mask, "Remove the correction", "Goes back to the automatic mask", [shift(K::T)];
    Undo, Mask, "Undo", "Takes back the last change of what is on screen", [ctrl(K::Z)];
    Redo, Mask, "Redo", "Does it again", [ctrl_shift(K::Z), ctrl(K::Y)];
    TrainMasks, Mask, "Train mask model…", "Shows from how many corrected masks the mask model would learn, and trains it in the background", [];
    StartTraining, Mask, "Start training", "Trains the mask model on the masks of pairs marked done; the new model makes the automatic masks when it is ready", [];
    UseTrained, Mask, "Use the trained mask model", "Makes automatic masks with the model that was trained on these pairs", [];
    MaskVisible, Mask, "Show the mask", "Draws the mask over the images, or not", [plain(K::S)];
    MaskOutline, Mask, "Mask as outline", "Draws only the outline of the mask", [shift(K::S)];
    MaskFainter, Mask, "Mask fainter", "Makes the mask more transparent", [plain(K::Minus)];
    MaskStronger, Mask, "Mask stronger", "Makes the mask less transparent", [plain(K::Equals)];
    Influence, Mask, "What the angle hangs on", "Colors the pixels by how much the registered angle would change without them, or with those beside the mask", [shift(K::I)];
    Ghosts, Mask, "As it was before", "Keeps mask, points and pose as they were before the last change visible until the next one, or not", [shift(K::H)];
    Lens, Mask, "Lens", "Magnifies the imprint under the pointer eight times, or not", [shift(K::M)];
    DoneAndNext, Mask, "Done and next", "Marks the pair as done and shows the next unfinished one", [ctrl(K::Enter)];
    Flag, Mask, "Flag", "Marks the pair as questionable", [plain(K::Exclamationmark)];
    Skip, Mask, "Skip", "Leaves the pair out", [ctrl(K::Backspace)];
    MarkTodo, Mask, "Back to todo", "Takes the review state back", [];

    RunPose, Pose, "Compute again", "Tries again what could not be computed", [ctrl(K::R)];
    AcceptMeasuredPose, Pose, "Accept the measured pose", "Stores the pose of the measured imprint with the pair", [];
    AcceptPredictedPose, Pose, "Accept the predicted pose", "Stores the pose of the predicted imprint with the pair", [];
    PoseTool, Pose, "Pose tool", "Moves the tool by hand in the 3D panes: arrow keys, or the handles", [plain(K::Z)];
    SixDof, Pose, "6-DoF", "Lets the pose tool leave the plane: x, pitch and yaw as well", [];
    NudgeLeft, Pose, "Nudge -y", "Moves the tool by 0.1 mm along -y; with Shift 1 mm, with Ctrl 0.01 mm", [plain(K::ArrowLeft), shift(K::ArrowLeft), ctrl(K::ArrowLeft)];
    NudgeRight, Pose, "Nudge +y", "Moves the tool by 0.1 mm along +y; with Shift 1 mm, with Ctrl 0.01 mm", [plain(K::ArrowRight), shift(K::ArrowRight), ctrl(K::ArrowRight)];
    NudgeUp, Pose, "Nudge -z", "Moves the tool by 0.1 mm along -z, to the wrist; with Shift 1 mm, with Ctrl 0.01 mm", [plain(K::ArrowUp), shift(K::ArrowUp), ctrl(K::ArrowUp)];
    NudgeDown, Pose, "Nudge +z", "Moves the tool by 0.1 mm along +z; with Shift 1 mm, with Ctrl 0.01 mm", [plain(K::ArrowDown), shift(K::ArrowDown), ctrl(K::ArrowDown)];
    TurnLeft, Pose, "Turn -", "Turns the tool by -0.5° about x; with Shift 5°, with Ctrl 0.05°", [alt(K::ArrowLeft), alt_shift(K::ArrowLeft), ctrl_shift(K::ArrowLeft)];
    TurnRight, Pose, "Turn +", "Turns the tool by 0.5° about x; with Shift 5°, with Ctrl 0.05°", [alt(K::ArrowRight), alt_shift(K::ArrowRight), ctrl_shift(K::ArrowRight)];
    IcpFromHere, Pose, "Start ICP from here", "Registers from the pose set by hand, with the chosen registration", [shift(K::Z)];
    Accept, Pose, "Accept", "Makes the proposal that is shown the mask, or stores the pose set by hand with the pair", [plain(K::Enter)];
    RevertHand, Pose, "Revert the pose by hand", "Gives the pose set by hand up", [];
    MeasureDistance, Pose, "Measure distance", "Measures between two points clicked in 3D", [plain(K::Y)];
    MeasureAngle, Pose, "Measure angle", "Measures the angle at the second of three points clicked in 3D", [shift(K::Y)];
    StepBack, Pose, "Previous step", "Shows the step before in the time machine", [plain(K::Comma)];
    StepForward, Pose, "Next step", "Shows the next step in the time machine", [plain(K::Period)];
    FirstStep, Pose, "First step", "Shows the pose that the registration began at", [shift(K::Comma)];
    LastStep, Pose, "Last step", "Shows the pose that the registration ended at", [shift(K::Period)];
    PlaySteps, Pose, "Play the steps", "Lets the steps go by, or stops; with the pointer in the time machine or a 3D view", [plain(K::Space)];
    PinStep, Pose, "Pin this step", "Keeps the step for comparison with another", [plain(K::J)];
    OwnStarts, Pose, "All own starts", "Back from a single start to those of the registration", [];
    Correspondences, Pose, "Correspondences", "Draws lines from contact points to where they are pulled, or not", [];
    NextPoseEngine, Pose, "Other registration", "Goes through the registrations", [];

    LockRange, View, "Lock the color range", "Keeps the colors from pair to pair, or fits them to each", [plain(K::O)];
    RangeOnce, View, "Fit the color range once", "Sets the color range from what is shown", [plain(K::C)];
    ResetRange, View, "Reset the color range", "Sets the color range to 0 to 18 mm", [shift(K::C)];
    Fit, View, "Fit", "Fits images and 3D views to their panes", [plain(K::Num0)];
    CameraLeft, View, "View from the left", "Looks along the closing axis from the left finger", [ctrl(K::Num1)];
    CameraRight, View, "View from the right", "Looks along the closing axis from the right finger", [ctrl(K::Num2)];
    CameraFront, View, "View from the front", "Looks across the closing axis", [ctrl(K::Num3)];
    CameraTop, View, "View from the top", "Looks along the tool", [ctrl(K::Num4)];
    NextLayer, View, "Next layer", "Goes through the layers of the 3D panes: none, residuals, reasons, distance, lines", [plain(K::V)];
    AnimateWeakest, View, "Animate weak direction", "Moves the tool to and fro by at most 2 mm and 2° in the direction that the contact determines least", [];
    BothClouds, View, "Both clouds", "Shows measured and predicted cloud in each 3D view", [];
    CompareMode, View, "Next comparison", "Goes through side by side, wipe, difference and 3D in the Compare pane", [shift(K::F)];
    SwapCompared, View, "Swap A and B", "Puts B in the place of A in the Compare pane, and A in that of B", [shift(K::R)];
    Section, View, "Cut open", "Cuts the 3D views open with a plane, or no longer", [plain(K::X)];
    WindowOnly, View, "GelSlim's window only", "Draws in 3D only what the GelSlims see, or all of it", [plain(K::W)];
    MembraneSurface, View, "Membrane as a surface", "Draws the membrane in 3D as a surface, or as points", [];
    EyeDome, View, "Depth shading", "Darkens in 3D what lies behind its neighbors (eye-dome lighting), or not", [];
    Parallel, View, "Parallel projection", "Looks at 3D along parallel lines, or in perspective", [plain(K::I)];
    CopyCamera, View, "Copy the camera", "Copies where the 3D view under the pointer looks from; Ctrl+V over a 3D view takes it over", [];
    LinkCameras, View, "Link cameras", "Moves both 3D views together", [];
    Footprint, View, "GelSlim window", "Draws the GelSlim's window on bubble images", [];
    SwitchTheme, View, "Dark or light", "Switches between the dark and the light theme", [];
    DepthChain, View, "Depth chain", "Shows everything between the decoder and the meters, stage by stage", [];
    InspectWorkspace, View, "Inspect", "Truth and prediction side by side", [];
    AlignWorkspace, View, "Align", "The cloud on the CAD model", [];
    LabelWorkspace, View, "Label", "Correcting masks", [];
    EvaluateWorkspace, View, "Evaluate", "The metrics", [];
    ResetWorkspace, View, "Reset workspace", "Puts the panes back where they were", [];
    MaximizePane, View, "Maximize pane", "Lets one pane fill the window", [plain(K::Backtick)];
    Fullscreen, View, "Full screen", "Fills the screen", [plain(K::F11)];
    Screenshot, View, "Screenshot", "Saves a picture of the window with the user's pictures", [plain(K::F12)];
    SavePane, View, "Save this pane", "Saves a picture of the pane under the pointer, with its bar and unit", [shift(K::F12)];
    CopyPane, View, "Copy this pane", "Copies a picture of the pane under the pointer", [ctrl(K::F12)];
    CopyHovered, View, "Copy the hovered value", "Copies the number under the pointer", [ctrl(K::C)];

    Palette, Help, "Command palette", "Finds anything that can be done", [ctrl(K::P), ctrl(K::K)];
    ShortcutSheet, Help, "Shortcuts", "Shows the keys of all actions, and changes them", [plain(K::Questionmark), plain(K::F1)];
    ResetSettings, Help, "Reset preferences", "Sets all preferences to their defaults", [];
}

impl Action {
    /// Whether it moves the tool in hand: Shift and Ctrl make its steps larger and smaller.
    pub fn is_nudge(self) -> bool {
        matches!(
            self,
            Self::NudgeLeft | Self::NudgeRight | Self::NudgeUp | Self::NudgeDown | Self::TurnLeft | Self::TurnRight
        )
    }

    /// Other words that people look for it by, in small letters.
    pub fn words(self) -> std::str::SplitWhitespace<'static> {
        let text = match self {
            Self::OpenFolder => "load directory data dataset browse file",
            Self::OpenDemo => "example sample simulated simulator",
            Self::Follow => "live watch camera stream",
            Self::Reload => "refresh again",
            Self::ExportMasks => "unet training labels npy coco png save",
            Self::ImportMasks => "unet labels npy coco png load read",
            Self::NextWorst => "bad largest error outlier failure hardest",
            Self::NextUncertain | Self::RankMasks => {
                "queue active learning doubt disagreement unsure probability hardest"
            }
            Self::NextUnfinished => "todo open unlabeled remaining",
            Self::FindPair => "search list find samples",
            Self::Generate => "predict prediction run inference diffusion",
            Self::RunSeeds => "ensemble uncertainty spread repeat",
            Self::FitPairs => "adapt calibrate tune finetune train",
            Self::TrainMasks | Self::StartTraining => "unet learn finetune tune segmentation",
            Self::TurnDial => "sweep threshold small multiples",
            Self::EvaluateDataset => "score metrics benchmark results table",
            Self::ExportTable => "csv markdown json save results latex",
            Self::CancelJobs => "stop abort interrupt",
            Self::NextShift => "depth offset gain millimeters scale",
            Self::Refit => "statistics mean deviation shift",
            Self::AdoptAutomatic => "use copy automatic mask",
            Self::PaintIn3d | Self::PaintLayers => "cloud points brush lasso front occlusion",
            Self::PaintIgnore => "unknown unsure void class",
            Self::Propose | Self::NextProposal | Self::ProposeAll => "prelabel batch pre-label suggest auto cad",
            Self::Accept => "confirm take yes",
            Self::TakeOver => "copy mask across measured predicted",
            Self::ResetMask => "delete mask automatic again",
            Self::ClearMask => "delete erase empty nothing start over reset",
            Self::Undo => "revert back",
            Self::Influence => "leverage sensitivity heat map pose pixels important",
            Self::Ghosts => "ghost previous before undo compare",
            Self::Lens => "magnify magnifier zoom loupe",
            Self::BrushSmaller | Self::BrushLarger => "pen size radius width",
            Self::RunPose => "retry recompute register registration icp failed",
            Self::NextPoseEngine => "icp gicp register method algorithm",
            Self::PoseTool => "hand gizmo drag manual move",
            Self::MeasureDistance | Self::MeasureAngle => "ruler mm length degrees",
            Self::LockRange | Self::RangeOnce | Self::ResetRange => "colorbar colormap scale limits minimum maximum mm",
            Self::Fit => "zoom center home view",
            Self::Section => "clip slice plane cross",
            Self::EyeDome => "edl shadow",
            Self::Parallel => "orthographic perspective camera",
            Self::Footprint => "rectangle outline crop",
            Self::SwitchTheme => "mode bright black white appearance",
            Self::DepthChain => "ledger trace pipeline stages",
            Self::Screenshot | Self::SavePane => "png picture image figure save export",
            Self::CopyPane => "png picture image figure clipboard",
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
            for shortcut in action.defaults() {
                assert_eq!(shortcuts.insert(*shortcut, action), None, "{shortcut} is taken, {action:?} wants it too");
                assert_eq!(shortcut.used_by(), None, "{action:?} {shortcut}");
                assert_eq!(shortcut.plainly(), *shortcut, "{action:?}");
            }
            assert_eq!(names.insert(action.name(), action), None);
        }
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
