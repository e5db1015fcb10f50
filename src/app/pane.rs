//! [`Pane`]: the panes of the window, one row each. Titles, menus, default places, what is drawn by which file of the
//! window and what is computed while a pane is on screen all follow from its row.

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use super::keys::ImprintSource;

with_texts! {
    /// The arrangements of the same panes.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, EnumIter)]
    #[serde(rename_all = "snake_case")]
    pub enum Workspace(name, tooltip) {
        /// Truth and prediction side by side.
        #[default]
        Inspect = "Inspect", "Measured and predicted side by side";
        /// The cloud on the CAD.
        Align = "Align", "Contact points on the CAD model";
        /// Correcting masks.
        Label = "Label", "Edit contact masks and review pairs";
        /// Numbers.
        Evaluate = "Evaluate", "Scores and tables";
        /// Models made better on one's own sensors.
        Adapt = "Adapt", "Generator and mask model made better on your own sensors";
    }
}

/// The kind of a pane, as far as mouse, colors and links between panes depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A list, a table or controls.
    Form,
    /// Pictures of color sensors.
    Color,
    /// Imprints of one side.
    Imprint(ImprintSource),
    /// Two imprints.
    Compare,
    /// 3D views of the sides that are chosen.
    Scene,
    /// Steps that can be played.
    Steps,
}

/// The dock where a pane lies in a workspace at first. Panes of one dock are its tabs, the one of the earlier row in front.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Dock {
    /// The column at the left.
    Left,
    /// In the upper row of the middle, counted from the left.
    Top(u8),
    /// In the lower row of the middle, counted from the left.
    Bottom(u8),
    /// In the column at the right, counted from the top.
    Right(u8),
}

/// A demand: what is computed while a pane is on screen. Everything but [`Demand::Thumbnails`] and [`Demand::Training`]
/// is of the selected pair and begins with its tensors and labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// Nothing besides the tensors and labels.
    Pair,
    /// The imprint of a side, with its mask where masks are drawn.
    Imprint(ImprintSource),
    /// Masks, even where they are not drawn.
    Masks,
    /// The prediction against the measurement.
    Comparison,
    /// Implausible things about a prediction's way to meters.
    Flags,
    /// Any two imprints against each other.
    Compare,
    /// Cloud and pose in 3D, of the sides that are chosen.
    Scene,
    /// The poses of both sides.
    Poses,
    /// The recorded registration that is looked at.
    Steps,
    /// Small pictures of the pairs in the list.
    Thumbnails,
    /// The plan of a training of the mask model: what it would learn from.
    Training,
}

/// The table, given to the macro `$with`: for each file of `ui/panes` the panes that it draws.
macro_rules! panes {
    ($with:ident) => {
        $with! {
            browser { Browser {
                "Pairs", "The pairs of what is open", Form, needs [Thumbnails],
                at [Inspect Left, Align Left, Label Left, Evaluate Left, Adapt Left]
            } }
            metrics { Metrics {
                "Metrics", "Pose and image scores of this pair", Form, needs [Comparison, Flags, Poses],
                at [Inspect Right(2), Align Right(2), Label Right(2), Evaluate Right(1), Adapt Right(1)]
            } }
            generate { Generate {
                "Generate", "Predicts the Soft Bubble imprint from the GelSlim image", Form, needs [Pair],
                at [Inspect Right(1), Align Right(2), Evaluate Right(1)]
            } }
            scene { Scene {
                "3D", "Measured and predicted contact on the CAD model", Scene, needs [Scene],
                at [Inspect Bottom(2), Align Top(1), Label Bottom(2), Evaluate Right(1)]
            } }
            images {
                GelSlim {
                    "GelSlim", "The GelSlim image: difference, in contact, or without contact",
                    Color, needs [Pair], at [Inspect Top(1), Label Bottom(1)]
                }
                Measured {
                    "Measured imprint", "What the Soft Bubble measured; dashed: what the GelSlim sees of it",
                    Imprint(Measured), needs [Imprint(Measured)],
                    at [Inspect Top(2), Align Top(2), Label Top(1), Evaluate Bottom(1), Adapt Bottom(1)]
                }
                Predicted {
                    "Predicted imprint", "What the generator predicts from the GelSlim image, in the same colors",
                    Imprint(Predicted), needs [Imprint(Predicted)],
                    at [Inspect Top(3), Align Top(2), Label Top(1), Evaluate Bottom(2), Adapt Bottom(2)]
                }
            }
            compare { Compare {
                    "Compare", "Any two imprints of this touch: side by side, or their difference",
                    Compare, needs [Compare], at [Inspect Bottom(1), Align Top(2), Evaluate Bottom(3), Adapt Bottom(3)]
            } }
            steps { Steps {
                "Steps of the registration" as "Steps", "The registration step by step",
                Steps, needs [Steps], at [Align Bottom(1)]
            } }
            masks {
                Masks { "Mask", "Edit the contact mask", Form, needs [Masks], at [Label Right(1)] }
            }
            results { Results {
                "Results", "Scores of every generator, and of every pair", Form, needs [],
                at [Evaluate Top(1)]
            } }
            adapt { Adapt {
                "Adapt", "The generator fitted to the open pairs, or the mask model trained on their masks, and what that is worth",
                Form, needs [Training],
                at [Adapt Top(1)]
            } }
            log { Log {
                "Log", "Messages so far", Form, needs [],
                at [Inspect Right(2), Align Right(2), Label Right(2), Evaluate Right(1), Adapt Right(1)]
            } }
            settings_pane {
                Settings { "Preferences", "Appearance, model engine, disk space for predictions", Form, needs [], at [Inspect Right(1)] }
            }
        }
    };
}
#[cfg(feature = "gui")]
pub(crate) use panes;

macro_rules! define {
    ($( $file:ident { $( $pane:ident {
        $title:literal $(as $tab:literal)?, $tip:literal, $kind:expr, needs [$($need:expr),*],
        at [$($workspace:ident $dock:expr),*]
    } )* } )*) => {
        /// A pane of the window. What is on screen decides what is computed.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[derive(strum::EnumIter, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Pane {
            $($( #[doc = $tip] $pane, )*)*
        }

        impl Pane {
            /// The title.
            pub fn title(self) -> &'static str {
                match self { $($( Self::$pane => $title, )*)* }
            }

            /// The title where several tabs have to fit side by side into the narrowest column.
            pub fn tab(self) -> &'static str {
                match self { $($( Self::$pane => [$title $(, $tab)?].last().unwrap_or(&$title), )*)* }
            }

            /// The tooltip of its title.
            pub fn tip(self) -> &'static str {
                match self { $($( Self::$pane => $tip, )*)* }
            }

            /// The kind of what it shows.
            pub fn kind(self) -> Kind {
                use ImprintSource::{Measured, Predicted};
                use Kind::{Color, Compare, Form, Imprint, Scene, Steps};
                match self { $($( Self::$pane => $kind, )*)* }
            }

            /// The demands: what is computed for it.
            pub fn needs(self) -> &'static [Demand] {
                use ImprintSource::{Measured, Predicted};
                use Demand::{
                    Compare, Comparison, Flags, Imprint, Masks, Pair, Poses, Scene,
                    Steps, Thumbnails, Training,
                };
                match self { $($( Self::$pane => &[$($need),*], )*)* }
            }

            /// The docks where it lies at first in the workspaces that have it.
            fn places(self) -> &'static [(Workspace, Dock)] {
                use Dock::{Bottom, Left, Right, Top};
                match self { $($( Self::$pane => &[$((Workspace::$workspace, $dock)),*], )*)* }
            }
        }
    };
}
panes!(define);

impl Pane {
    /// The panes of a workspace, dock by dock.
    pub fn of(workspace: Workspace) -> Vec<Self> {
        use strum::IntoEnumIterator as _;
        let mut panes: Vec<Self> = Self::iter().filter(|pane| pane.dock(workspace).is_some()).collect();
        panes.sort_by_key(|pane| pane.dock(workspace));
        panes
    }

    /// The dock where it lies at first in a workspace that has it.
    pub(crate) fn dock(self, workspace: Workspace) -> Option<Dock> {
        self.places().iter().find(|(of, _)| *of == workspace).map(|(_, dock)| *dock)
    }

    /// The side that it is about.
    pub fn side(self) -> Option<ImprintSource> {
        match self.kind() {
            Kind::Imprint(side) => Some(side),
            _ => None,
        }
    }

    /// True where it is closed in a workspace until somebody asks for it: a tab costs everyone who does not need it.
    pub(crate) fn is_closed_at_first(self, workspace: Workspace) -> bool {
        match self {
            Self::Settings | Self::Log => true,
            Self::Generate => workspace != Workspace::Inspect,
            _ => false,
        }
    }

    /// True where it shows something of the selected pair.
    pub(crate) fn is_of_pair(self) -> bool {
        let of_all = |need: &Demand| matches!(need, Demand::Thumbnails | Demand::Training);
        self.needs().iter().any(|need| !of_all(need))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strum::IntoEnumIterator as _;

    #[test]
    fn every_pane_can_be_found() {
        for workspace in Workspace::iter() {
            assert_eq!(Pane::of(workspace)[0], Pane::Browser, "{workspace:?} begins at the left");
        }
        for pane in Pane::iter() {
            assert!(!pane.places().is_empty(), "{pane:?} lies in no workspace");
            let same = Pane::iter().filter(|other| other.title() == pane.title()).count();
            assert_eq!(same, 1, "{pane:?} shares its title with another");
        }
    }
}
