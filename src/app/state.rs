//! [`State`]: everything the studio shows. Changed by [`super::apply::apply`] only.

use std::sync::Arc;

pub mod cache;
pub mod doctor;
pub mod evaluate;
pub mod export;
pub mod history;
pub mod inspect;
pub mod labels;
pub mod learn;
pub mod library;
pub mod results;
pub mod settings;
pub mod tasks;
pub mod view;
pub mod workbench;

use super::keys::{ImprintSource, PairKey, TouchKey};
use super::pane::{Demand, Pane, Workspace};
use doctor::DoctorState;
use evaluate::TableState;
use export::ExportState;
use history::History;
use inspect::Inspect;
use labels::Document;
use learn::LearnState;
use library::Library;
use results::{Cached, Request, Results};
use settings::Settings;
use tasks::{Log, Tasks};
use touch2touch_core::dataset::PairEntry;
use touch2touch_core::rig::{PadId, Rig, Text};
use touch2touch_pipeline::error::TaskError;
use view::Selection;
use workbench::Workbench;

/// Everything the studio shows.
#[derive(Debug, Default)]
pub struct State {
    /// The open data set and its list.
    pub library: Library,
    /// The selection: everything that is looked at.
    pub selection: Selection,
    /// The part of a registration that is looked at.
    pub inspect: Inspect,
    /// The document: everything that a person made.
    pub document: Document,
    /// The history of changes that can be undone.
    pub history: History,
    /// The results: everything that was computed.
    pub results: Results,
    /// The results table of the data set.
    pub table: TableState,
    /// The choices of the next figure and of what else is taken away.
    pub export: ExportState,
    /// The panel about the open data set.
    pub doctor: DoctorState,
    /// Networks that are fitted and trained.
    pub learn: LearnState,
    /// The workbench: what the 3D panes do and show besides.
    pub workbench: Workbench,
    /// The preferences.
    pub settings: Settings,
    /// The tasks: everything that runs.
    pub tasks: Tasks,
    /// The event, in words.
    pub log: Log,
}

impl State {
    /// The sensors of the open data set; the lab's while none is open.
    pub fn rig(&self) -> Arc<Rig> {
        self.library.open.as_ref().map_or_else(Rig::lab, |open| open.source.dataset.rig.clone())
    }

    /// The fingers on screen, the active one first.
    pub fn fingers(&self) -> Vec<PadId> {
        let active = self.selection.finger;
        let others = self.fingers_with_data().into_iter().filter(|pad| self.selection.both_fingers && *pad != active);
        std::iter::once(active).chain(others).collect()
    }

    /// The fingers that the data have, as far as pairs were read.
    pub(crate) fn fingers_with_data(&self) -> Vec<PadId> {
        let samples = &self.results.samples;
        let there = |pad: &PadId| samples.is_empty() || samples.iter().any(|(_, sample)| sample.pad(*pad).is_some());
        self.rig().pads().filter(there).collect()
    }

    /// The finger after the active one.
    pub(crate) fn other_finger(&self) -> PadId {
        PadId::new((self.selection.finger.index() + 1) % self.rig().pads().len().max(1))
    }

    /// A finger's name in files, such as `right`.
    pub fn finger_name(&self, finger: PadId) -> Text {
        self.rig().pad_key(finger)
    }

    /// The selected pair's entry.
    pub fn entry(&self) -> Option<&PairEntry> {
        self.library.entry(self.selection.pair?)
    }

    /// True where masks are drawn: in their workspace, and wherever their tools are on screen.
    pub fn is_labeling(&self) -> bool {
        self.settings.workspace == Workspace::Label || self.selection.panes.contains(&Pane::Masks)
    }

    /// The selected pair's name; empty if there is none.
    pub fn pair_name(&self) -> &str {
        self.entry().map_or("", |entry| &entry.name)
    }

    /// The selected pair.
    pub fn pair_key(&self) -> Option<PairKey> {
        Some(self.library.open.as_ref()?.key(self.selection.pair?))
    }

    /// One finger of the selected pair.
    pub fn touch_key(&self, finger: PadId) -> Option<TouchKey> {
        Some(self.pair_key()?.finger(finger))
    }

    /// True where a pair is the one on screen.
    pub(super) fn is_selected(&self, key: PairKey) -> bool {
        self.pair_key() == Some(key)
    }

    /// True where a pane on screen needs something.
    pub(super) fn needs(&self, need: Demand) -> bool {
        self.selection.panes.iter().any(|pane| pane.needs().contains(&need))
    }

    /// Closes the dialogs that stand beside the work: there is one at a time.
    pub(super) fn close_dialogs(&mut self) {
        (self.export.asking_masks, self.export.importing, self.export.still) = (false, None, None);
        self.doctor.shown = false;
    }

    /// True where a 3D view of a side is on screen.
    pub(super) fn shows_scene(&self, side: ImprintSource) -> bool {
        self.needs(Demand::Scene) && self.settings.scene_sides().sides().contains(&side)
    }

    /// True where a pane on screen shows something of the selected pair.
    pub(super) fn shows_pair(&self) -> bool {
        self.selection.panes.iter().any(|pane| pane.is_of_pair())
    }

    /// The result of a recipe, or what stands in its place.
    pub(crate) fn look<K: Cached>(&self, key: K) -> Lookup<'_, Arc<K::Value>> {
        self.look_or(Ok(Some(key)), || None)
    }

    /// The result of a recipe that may be unknown still, or not be possible; meanwhile the one before.
    pub(crate) fn look_or<'a, K: Cached>(
        &'a self,
        key: Result<Option<K>, Absent>,
        before: impl FnOnce() -> Option<&'a Arc<K::Value>>,
    ) -> Lookup<'a, Arc<K::Value>> {
        let key = match key {
            Ok(key) => key,
            Err(absent) => return Lookup::Absent(absent),
        };
        if let Some(value) = key.as_ref().and_then(|key| K::cache(&self.results).get(key)) {
            return Lookup::Ready(value);
        }
        match (key.and_then(|key| self.failure(key)), before()) {
            (Some(err), _) => Lookup::Failed(err),
            (None, Some(before)) => Lookup::Stale(before),
            (None, None) => Lookup::Waiting,
        }
    }

    /// Why a result could not be computed, if that was tried.
    pub(crate) fn failure(&self, request: impl Into<Request>) -> Option<&TaskError> {
        self.tasks.failed.get(&request.into())
    }

    /// Recomputes the order of the list.
    pub(in crate::app) fn reorder(&mut self) {
        self.library.reorder(&self.document, &self.table);
    }
}

/// Something a pane shows, or why it cannot.
#[derive(Debug)]
pub enum Lookup<'a, T: ?Sized> {
    /// Here it is.
    Ready(&'a T),
    /// It is being recomputed; this is the one before. Show it dimmed.
    Stale(&'a T),
    /// It is being computed.
    Waiting,
    /// It could not be computed.
    Failed(&'a TaskError),
    /// It cannot be there, for a reason that is no failure.
    Absent(Absent),
}

impl<T: ?Sized> Clone for Lookup<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: ?Sized> Copy for Lookup<'_, T> {}

impl<'a, T: ?Sized> Lookup<'a, T> {
    /// The value, if it is up to date.
    pub fn ready(self) -> Option<&'a T> {
        match self {
            Self::Ready(value) => Some(value),
            _ => None,
        }
    }

    /// The value, even the one before.
    pub fn shown(self) -> Option<&'a T> {
        match self {
            Self::Ready(value) | Self::Stale(value) => Some(value),
            _ => None,
        }
    }

    /// The reason in its place, when there is no value.
    pub fn without<U: ?Sized>(self) -> Lookup<'a, U> {
        match self {
            Self::Ready(_) | Self::Stale(_) | Self::Waiting => Lookup::Waiting,
            Self::Failed(err) => Lookup::Failed(err),
            Self::Absent(absent) => Lookup::Absent(absent),
        }
    }

    /// Looks into a value; `None` becomes `absent`.
    pub fn and_then<U: ?Sized>(self, absent: Absent, f: impl FnOnce(&'a T) -> Option<&'a U>) -> Lookup<'a, U> {
        match self {
            Self::Ready(value) => f(value).map_or(Lookup::Absent(absent), Lookup::Ready),
            Self::Stale(value) => f(value).map_or(Lookup::Absent(absent), Lookup::Stale),
            _ => self.without(),
        }
    }

    /// Part of a value.
    pub fn map<U: ?Sized>(self, f: impl FnOnce(&'a T) -> &'a U) -> Lookup<'a, U> {
        match self {
            Self::Ready(value) => Lookup::Ready(f(value)),
            Self::Stale(value) => Lookup::Stale(f(value)),
            _ => self.without(),
        }
    }

    /// The failure of what it is made from, where it is not there itself.
    pub(super) fn or_failed(self, err: Option<&'a TaskError>) -> Self {
        match (self, err) {
            (Self::Stale(_) | Self::Waiting, Some(err)) => Self::Failed(err),
            _ => self,
        }
    }
}

impl<'a, T> Lookup<'a, Arc<T>> {
    /// The value itself.
    pub fn value(self) -> Lookup<'a, T> {
        self.map(|value| &**value)
    }
}

with_texts! {
    /// Why something cannot be shown, and what brings it.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Absent(text) {
        /// No data set is open.
        NothingOpen = "No data set is open. Drop a folder here, or open the demo.",
        /// No pair is selected.
        NothingSelected = "No pair is selected.",
        /// The source has no such finger.
        NoFinger = "These data have no such finger.",
        /// The finger has no GelSlim image.
        NoGelSlim = "This finger has no GelSlim image.",
        /// The finger has no reading of the sensor that the generator starts from.
        NoInput = "This finger has no image that the model could start from.",
        /// The prediction is a color picture.
        PredictsColor = "The prediction is a color image: no depth, so no contact, points or pose.",
        /// The generators that were found are for other sensors.
        OtherSensors = "No generator fits the sensors of this data set; see the list of models.",
        /// The source only has the GelSlim difference image.
        OnlyDifference = "These data only have the difference image.",
        /// The finger has no measured imprint.
        NoBubble = "This finger has no measured imprint.",
        /// Nothing was generated yet.
        NoPrediction = "No prediction yet.",
        /// The source has no camera: no points in space.
        NoCamera = "No depth camera in these data: no 3D points, no pose.",
        /// The source does not say which tool it was.
        NoTool = "Tool unknown: no CAD model, no pose.",
        /// The true pose is not known.
        NoTruth = "True pose unknown.",
        /// The source is not simulated.
        NotSimulated = "The true contact is known for simulated data only.",
        /// No mask model was found.
        NoMaskModel = "No mask model was found.",
        /// No generator was found.
        NoGenerator = "No generator was found.",
        /// The generator that was named is not there any more.
        NoSuchGenerator = "The chosen model is gone; choose another.",
        /// No tool classifier was found.
        NoClassifier = "No tool classifier was found.",
        /// The mask has too few contact points.
        NoContact = "The mask has too few contact points for a pose.",
        /// No pose was set by hand.
        NoHandPose = "No pose set by hand yet: move the tool with the pose tool.",
        /// Nothing was painted by hand on the mask.
        NoStrokes = "Nothing to grow from: paint a short stroke on the contact, and one with the right button beside it.",
    }
}
