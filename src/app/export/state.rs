//! What is chosen of a figure before it is drawn, and what it then is of.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use super::super::keys::{CloudKey, ImprintSource, MaskKey, MaskVersion, PredictionKey, RegistrationChoice};
use super::super::pane::{Kind, Pane};
use super::super::settings::state::{ColorMap as MapChoice, Settings};
use super::super::state::State;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_work::bundles::BundleInfo;
use touch2touch_work::case::CaseSetup;
use touch2touch_work::cloud::Clouds;
use touch2touch_work::error::TaskError;
use touch2touch_work::export::ExportChoice;
use touch2touch_work::figure::{FigureLook, FigurePane, FigureSetup, FigureTheme, note};
use touch2touch_work::import::ImportSetup;
use touch2touch_work::io::case_file;
use touch2touch_work::mask::made_of;
use touch2touch_work::pair_files::{PairFile, PairParts, write};
use touch2touch_work::pose::PoseResult;
use touch2touch_work::recipe::{ModelName, Recipe};
use touch2touch_work::tool::NamedTool;

/// Pairs of the list that a figure may take.
pub(crate) const MOST_PAIRS: usize = 50;
/// Scales that are offered.
pub(crate) const SCALES: [u8; 4] = [1, 2, 4, 8];

/// What a person chose about the next figure. Not kept between runs of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureForm {
    /// How many pairs of the list, from the first; `None` = the selected pair alone.
    pub first: Option<usize>,
    /// Whether all fingers get a row, or only the active one.
    pub both_fingers: bool,
    /// The columns.
    pub panes: Vec<FigurePane>,
    /// Pixels of a PNG per pixel of an imprint.
    pub scale: u8,
    /// Ground and ink.
    pub theme: FigureTheme,
    /// Half the range of the colors of errors, meters.
    pub error_m: f32,
}

impl Default for FigureForm {
    fn default() -> Self {
        let look = FigureLook::default();
        Self {
            first: Some(4),
            both_fingers: false,
            panes: look.panes,
            scale: 2,
            theme: FigureTheme::Light,
            error_m: look.error_m,
        }
    }
}

impl FigureForm {
    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        self.first = self.first.map(|n| n.clamp(1, MOST_PAIRS));
        self.scale = self.scale.clamp(SCALES[0], SCALES[3]);
        self.error_m = touch2touch_core::units::clamp_or(self.error_m, 5e-5, 0.1, FigureLook::default().error_m);
        self.panes.sort_unstable();
        self.panes.dedup();
        self
    }
}

/// The room's state.
#[derive(Clone, Debug, Default)]
pub struct ExportState {
    /// Whether the form is open.
    pub asking: bool,
    /// What it says.
    pub form: FigureForm,
    /// Whether the form of an export of masks is open.
    pub asking_masks: bool,
    /// What it says.
    pub masks: ExportChoice,
    /// The import of masks that is asked about.
    pub importing: Option<ImportForm>,
    /// How many imports were asked about.
    pub(in crate::app) imports: u64,
    /// Whether the prediction of a case that was opened is still to be made.
    pub predict: bool,
}

/// An import of masks that is asked about: what it would change is said before anything changes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImportForm {
    /// The folder or file.
    pub from: PathBuf,
    /// Whether what was painted by hand is replaced as well.
    pub over_drawn: bool,
    /// Which asking it is: files may be others than at the one before.
    pub(in crate::app) asked: u64,
}

impl State {
    /// What of the open case cannot be made again on this machine, in sentences.
    pub fn case_lacks(&self) -> Vec<String> {
        let case = self.library.open.as_ref().and_then(|open| open.source.case());
        // Which models are here is not known at once.
        let Some((_, case, _)) = case.filter(|_| !self.export.predict) else { return Vec::new() };
        let lacks = |model: &&ModelName| self.library.bundle(&model.id).is_none();
        let generator = case.recipe.generator.as_ref().map(|(model, _)| model);
        let imprints = generator.filter(lacks).map(|model| {
            let name = &model.name;
            format!("Predicted imprints are shown as the case holds them: its generator {name} is not on this machine.")
        });
        let masks = case.recipe.mask_model.as_ref().filter(lacks).map(|model| {
            let name = &model.name;
            format!("Masks are made another way than in the case: its mask model {name} is not on this machine.")
        });
        imprints.into_iter().chain(masks).collect()
    }

    /// What is imported as the form says, while it is open.
    pub(crate) fn import_setup(&self) -> Option<ImportSetup> {
        let form = self.export.importing.as_ref()?;
        let (from, over_drawn, person) = (form.from.clone(), form.over_drawn, self.known_person());
        Some(ImportSetup { from, format: None, over_drawn, person })
    }
}

/// Something to be written once the place is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// The figure that the form describes.
    Figure,
    /// One pane as a picture.
    Picture {
        /// The pane.
        pane: Pane,
        /// Pixels per pixel of an imprint; `None` for an SVG.
        scale: Option<u8>,
        /// Half the range of the colors of errors, meters.
        error_m: f32,
    },
    /// Cloud, pose and mesh of an imprint of the selected pair, into a folder.
    Pair(ImprintSource),
    /// The selected pair with everything that its results depend on.
    Case,
    /// Masks for training, as the form says, into a folder.
    Masks,
}

impl Output {
    /// What is asked for, as the title of a dialog.
    pub fn title(self) -> &'static str {
        match self {
            Self::Figure => "Save the figure (.png or .svg)",
            Self::Case => "Save the case (.t2tcase)",
            Self::Masks => "Export masks to a folder",
            Self::Pair(_) => "Export cloud, pose and mesh to a folder",
            Self::Picture { scale: Some(_), .. } => "Save the picture (.png)",
            Self::Picture { scale: None, .. } => "Save the picture (.svg)",
        }
    }

    /// The name that a file is offered under; `None` where a folder is asked for.
    pub fn file_name(self) -> Option<String> {
        match self {
            Self::Figure => Some("figure.png".into()),
            Self::Picture { pane, scale, .. } => Some(pane.picture_name(scale.is_some())),
            Self::Case => Some(format!("case.{}", case_file::ENDING)),
            Self::Pair(_) | Self::Masks => None,
        }
    }
}

/// How the studio showed a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CaseView {
    /// The preferences, with the arrangement of the panes.
    pub settings: Settings,
    /// Where 3D views look from, in the window's own format.
    pub camera: String,
    /// The active finger.
    pub finger: PadId,
    /// Whether all fingers were shown.
    pub both_fingers: bool,
}

/// What is written of the selected pair for other programs, gathered for a job.
#[derive(Clone, Debug)]
pub struct PairExport {
    name: String,
    source: ImprintSource,
    prediction: Option<String>,
    rig: Arc<Rig>,
    clouds: Arc<Clouds>,
    mask: String,
    engine: RegistrationChoice,
    pose: Option<Arc<PoseResult>>,
    truth: Option<PlanarPose>,
    tool: Option<Arc<NamedTool>>,
}

impl PairExport {
    /// Writes the files that there can be: without a pose only the cloud.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, TaskError> {
        let files: Vec<PairFile> =
            PairFile::iter().filter(|file| *file == PairFile::Cloud || self.pose.is_some()).collect();
        let parts = PairParts {
            name: &self.name,
            source: self.source,
            prediction: self.prediction.as_deref(),
            rig: &self.rig,
            clouds: &self.clouds,
            mask: &self.mask,
            registration: self.engine,
            pose: self.pose.as_deref(),
            truth: self.truth,
            tool: self.tool.as_ref().map(|tool| (tool.name.as_str(), &tool.model)),
        };
        write(&parts, &files, folder)
    }
}

/// A pair of a figure with the predictions that it needs.
pub(crate) type Recipes = Vec<(PairId, Vec<(PredictionKey, BundleInfo)>)>;

impl Pane {
    /// The name that a picture of it is offered under.
    pub(in crate::app) fn picture_name(self, pixels: bool) -> String {
        let name = self.title().to_lowercase().replace(' ', "-");
        format!("{name}.{}", if pixels { "png" } else { "svg" })
    }

    /// The column of a figure that shows the same; `None` for panes that are no pictures.
    pub(crate) fn in_figure(self) -> Option<FigurePane> {
        Some(match (self, self.kind()) {
            (Self::GelDifference, _) => FigurePane::GelSlim,
            (Self::GelRaw, _) => FigurePane::Raw,
            (Self::GelReference, _) => FigurePane::Reference,
            (_, Kind::Imprint(ImprintSource::Measured)) => FigurePane::Measured,
            (_, Kind::Imprint(ImprintSource::Predicted)) => FigurePane::Predicted,
            (Self::Error, _) => FigurePane::Error,
            _ => return None,
        })
    }
}

impl State {
    /// How figures look, in the colors of the panes.
    fn figure_look(&self, panes: Vec<FigurePane>, error_m: f32, theme: FigureTheme, scale: f64) -> FigureLook {
        let (range, window) = (self.settings.range, self.settings.footprint_visible);
        let map = match self.settings.color_map {
            MapChoice::Viridis => ColorMap::Viridis,
            MapChoice::Gray => ColorMap::Gray,
        };
        FigureLook { panes, map, range: Range { lo: range.min_m, hi: range.max_m }, error_m, theme, window, scale }
    }

    /// What the form describes, before anything is drawn.
    pub(crate) fn figure_setup(&self) -> FigureSetup {
        let form = &self.export.form;
        let pairs = match form.first {
            Some(n) => self.library.order.iter().copied().take(n).collect(),
            None => self.selection.pair.into_iter().collect(),
        };
        let fingers = if form.both_fingers { self.rig().pad_list() } else { vec![self.selection.finger] };
        let look = self.figure_look(form.panes.clone(), form.error_m, form.theme, f64::from(form.scale));
        self.with_note(FigureSetup { pairs, fingers, shift: self.settings.shift, look, note: String::new() })
    }

    /// One pane of the selected pair, with the fingers that it shows.
    pub(crate) fn picture_setup(&self, pane: Pane, scale: Option<u8>, error_m: f32) -> Option<FigureSetup> {
        let shown = self.fingers();
        let fingers = self.rig().pads().filter(|finger| shown.contains(finger)).collect();
        let scale = f64::from(scale.unwrap_or(1));
        let look = self.figure_look(vec![pane.in_figure()?], error_m, FigureTheme::Light, scale);
        let pairs = vec![self.selection.pair?];
        Some(self.with_note(FigureSetup { pairs, fingers, shift: self.settings.shift, look, note: String::new() }))
    }

    fn with_note(&self, setup: FigureSetup) -> FigureSetup {
        let recipes = self.figure_recipes(&setup);
        let mut said: Vec<String> = Vec::new();
        for (recipe, bundle) in recipes.iter().flat_map(|(_, list)| list) {
            let text = note(&bundle.name, &recipe.config(), setup.shift);
            if !said.contains(&text) {
                said.push(text);
            }
        }
        // Pairs whose shown predictions were made in different ways are said so, not listed.
        let note = match said.as_slice() {
            [] => String::new(),
            [one] => one.clone(),
            several => format!("{} and {} other ways", several[0], several.len() - 1),
        };
        FigureSetup { note, ..setup }
    }

    /// The predictions that a figure shows: the one shown for a touch, else what the settings would make of it.
    pub(crate) fn figure_recipes(&self, setup: &FigureSetup) -> Recipes {
        let predicted = setup.look.panes.iter().any(|pane| pane.is_predicted());
        let Some(open) = self.library.open.as_ref().filter(|_| predicted) else { return Vec::new() };
        let of = |pair: &PairId| {
            let touches = setup.fingers.iter().map(|finger| open.key(*pair).finger(*finger));
            let recipes = touches.filter_map(|touch| {
                let recipe = self.shown(touch).cloned().or_else(|| self.recipe(touch))?;
                let bundle = self.library.bundle(&recipe.bundle)?.clone();
                Some((recipe, bundle))
            });
            (*pair, recipes.collect())
        };
        setup.pairs.iter().map(of).collect()
    }

    /// What the contact masks of a cloud are made of, as the verbs say it.
    fn masks_made_of(&self, cloud: &CloudKey) -> String {
        let source = self.settings.mask.choice.source.key();
        let keys = cloud.parts.iter().flatten().filter_map(|(imprint, version)| match version.as_ref()? {
            MaskVersion::Hand(_) => Some(MaskBasis::Hand.key(source)),
            MaskVersion::Auto(recipe) => {
                let key = MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
                Some(self.results.masks.get(&key)?.basis.key(recipe.source().key()))
            }
        });
        made_of(keys.collect(), source)
    }

    /// What can be written of the selected pair; `None` while its cloud is not there.
    pub fn pair_export(&self, source: ImprintSource) -> Option<PairExport> {
        let cloud = self.cloud_key(source).ok()??;
        let pose = self.pose_key(source).ok().flatten().and_then(|key| self.results.poses.get(&key)).cloned();
        let recipe = self.rig().pads().find_map(|pad| self.chosen(pad)).filter(|_| source == ImprintSource::Predicted);
        let prediction = recipe.map(|recipe| {
            let shift = self.settings.shift.label().to_lowercase();
            format!("{} · {shift}", self.made_with(recipe))
        });
        Some(PairExport {
            name: self.pair_name().to_owned(),
            source,
            prediction,
            rig: self.rig(),
            clouds: self.results.clouds.get(&cloud)?.clone(),
            mask: self.masks_made_of(&cloud),
            engine: self.settings.pose_engine,
            pose,
            truth: self.sample().ready()?.grasp_from_object,
            tool: self.tool_key().ok().and_then(|key| self.results.tools.get(&key)).cloned(),
        })
    }

    /// What goes into a case of the selected pair; `camera` is where 3D views look from, as the window says it.
    pub(crate) fn case_setup(&self, camera: &str) -> Option<CaseSetup> {
        let pair = self.selection.pair?;
        let chosen = self.chosen(self.selection.finger).or_else(|| self.rig().pads().find_map(|pad| self.chosen(pad)));
        let generator = chosen.and_then(|key| Some((self.library.bundle(&key.bundle)?.clone().into(), key.config())));
        // What is of the person stays with the person.
        let settings = self.settings.clone().of_person(&Settings::default());
        let view = CaseView {
            settings,
            camera: camera.to_owned(),
            finger: self.selection.finger,
            both_fingers: self.selection.both_fingers,
        };
        Some(CaseSetup {
            pair,
            recipe: Recipe { generator, ..self.in_force(ImprintSource::Measured) },
            labels: self.document.pair(self.pair_name()).cloned().unwrap_or_default(),
            view: serde_json::to_value(view).ok(),
        })
    }

    /// Whether a figure of the open pairs can be drawn.
    pub(crate) fn can_draw(&self) -> bool {
        let open = self.library.open.as_ref();
        open.is_some_and(|open| open.source.as_dataset().is_some()) && self.entry().is_some()
    }
}
