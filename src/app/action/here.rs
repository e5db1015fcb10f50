//! The actions that belong to the place where a person is: the workspace on screen and the pane under the pointer.

use super::super::pane::{Kind, Pane, Workspace};
use super::{Action, Group};

impl Action {
    /// True where it is about a workspace, or about a pane in it.
    pub(crate) fn is_of(self, workspace: Workspace, pane: Option<Pane>) -> bool {
        pane.is_some_and(|pane| self.is_of_pane(pane)) || self.is_of_workspace(workspace)
    }

    /// True where its letter means it only where masks are drawn: it changes labels, or what the tools do to them.
    pub(crate) fn is_of_labeling(self) -> bool {
        use Action as A;
        let looks = matches!(self, A::MaskVisible | A::MaskOutline);
        self.group() == Group::Mask && !looks
    }

    fn is_of_workspace(self, workspace: Workspace) -> bool {
        match workspace {
            Workspace::Inspect => matches!(
                self,
                Self::Generate | Self::GenerateNewSeed | Self::NextPair | Self::PreviousPair | Self::NextWorst
            ),
            Workspace::Align => self.group() == Group::Pose,
            Workspace::Label => self.group() == Group::Mask || self == Self::NextUnfinished,
            Workspace::Evaluate => matches!(self, Self::PredictAll | Self::ExportTable | Self::NextWorst),
            Workspace::Adapt => {
                matches!(self, Self::FitPairs | Self::UseModel | Self::TrainMasks | Self::StartTraining)
            }
        }
    }

    fn is_of_pane(self, pane: Pane) -> bool {
        use Action as A;
        let picture = matches!(self, A::Fit | A::SavePane | A::CopyPane | A::CopyHovered | A::MaximizePane);
        let range = matches!(self, A::LockRange | A::RangeOnce);
        match pane.kind() {
            Kind::Form => match pane {
                Pane::Browser => self.group() == Group::Navigate,
                Pane::Generate => self.group() == Group::Generate,
                Pane::Masks => self.group() == Group::Mask || self == A::Accept,
                _ => false,
            },
            Kind::Color => picture,
            Kind::Imprint(_) => picture || range || matches!(self, A::MaskVisible | A::MaskOutline),
            Kind::Compare => picture || range,
            Kind::Scene => picture || self.is_of_scene(),
            Kind::Steps => matches!(self, A::StepBack | A::StepForward | A::PlaySteps | A::OwnStarts),
        }
    }

    /// True where it is about the 3D views.
    fn is_of_scene(self) -> bool {
        use Action as A;
        let look = matches!(self, A::CameraLeft | A::CameraRight | A::CameraFront | A::CameraTop)
            || matches!(self, A::CameraOblique | A::Distances)
            || matches!(self, A::Parallel | A::BothClouds);
        look || matches!(self, A::PoseTool | A::NextAnswer | A::IcpFromHere | A::Accept | A::RevertHand)
            || matches!(self, A::PlaySteps | A::PaintIn3d | A::PaintLayers)
    }
}

#[cfg(test)]
mod tests {
    use strum::IntoEnumIterator as _;

    use super::*;

    #[test]
    fn each_workspace_and_each_picture_has_what_belongs_to_it() {
        for workspace in Workspace::iter() {
            assert!(Action::iter().any(|action| action.is_of(workspace, None)), "{workspace:?}");
        }
        for pane in Pane::iter().filter(|pane| pane.kind() != Kind::Form) {
            assert!(Action::iter().any(|action| action.is_of_pane(pane)), "{pane:?}");
        }
        assert!(Action::Brush.is_of(Workspace::Label, None) && !Action::Brush.is_of(Workspace::Align, None));
        assert!(Action::StepBack.is_of(Workspace::Inspect, Some(Pane::Steps)));
        assert!(!Action::StepBack.is_of(Workspace::Inspect, Some(Pane::Measured)));
    }
}
