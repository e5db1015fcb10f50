//! A pair in 3D, made for stills: membranes, contact points and poses ([`in_space`]).

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use crate::compare::deviation::{Deviation, deviation};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::ImprintSource;
use crate::steps::estimate::{Estimate, Touch};
use crate::steps::models::Models;
use crate::steps::pose::PoseResult;
use crate::steps::prediction::predicted_by;
use crate::steps::recipe::{Recipe, Stage};
use crate::steps::tool::load_tool;
use crate::still::StillSetup;
use touch2touch_core::cloud::membrane;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Grid;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::{PerPad, Rig};
use touch2touch_core::sample::Sample;
use touch2touch_core::units;

/// A column of 3D pictures: the imprints that it shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum SpacePane {
    /// The measured one.
    #[default]
    Measured,
    /// The predicted one.
    Predicted,
    /// Both: the model where the measured one has it, as an outline where the predicted one has it.
    Both,
}

impl SpacePane {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "Measured",
            Self::Predicted => "Predicted",
            Self::Both => "Both",
        }
    }

    /// The imprints.
    pub fn sides(self) -> &'static [ImprintSource] {
        match self {
            Self::Measured => &[ImprintSource::Measured],
            Self::Predicted => &[ImprintSource::Predicted],
            Self::Both => &[ImprintSource::Measured, ImprintSource::Predicted],
        }
    }

    /// The one of them that asks for a generator, if there is one.
    pub fn farthest(self) -> ImprintSource {
        if self == Self::Measured { ImprintSource::Measured } else { ImprintSource::Predicted }
    }
}

/// The ground of a still.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Ground {
    /// White, for papers.
    #[default]
    White,
    /// Black, for slides.
    Black,
    /// None: dark letters, for light pages.
    Transparent,
}

/// Direction in which a still is taken, degrees: about the vertical from the right finger's side, and above the horizontal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewAngles {
    /// Turn about the vertical.
    pub yaw_deg: f64,
    /// Height of the eye, -90 to 90.
    pub pitch_deg: f64,
}

impl Default for ViewAngles {
    fn default() -> Self {
        Self { yaw_deg: 51.6, pitch_deg: 20.0 }
    }
}

/// View of a pair, for a renderer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpaceView {
    /// The imprints shown.
    pub pane: SpacePane,
    /// The ground.
    pub ground: Ground,
    /// Direction of the view.
    pub angles: ViewAngles,
    /// Distance at which the colors of signed distances end, meters; `None` where the model has its own color.
    pub distance_m: Option<f64>,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
}

/// A picture by a renderer.
#[derive(Clone, Debug, PartialEq)]
pub struct SpacePicture {
    /// sRGB and opacity, not multiplied.
    pub pixels: Grid<[u8; 4]>,
    /// Pixels per meter in the plane of what one looks at.
    pub px_per_m: f64,
}

/// An imprint of a pair in 3D: meters, grasp frame.
#[derive(Clone, Debug)]
pub struct SpaceSide {
    /// Origin of the imprint.
    pub source: ImprintSource,
    /// Contact points of each pad.
    pub contact: PerPad<Arc<[DVec3]>>,
    /// Membrane of each pad, smoothed for the eye.
    pub membranes: PerPad<Arc<TriMesh>>,
    /// The registered pose; `None` where there is none.
    pub pose: Option<PoseResult>,
    /// Signed distances of model and contact points at that pose, where they are shown.
    pub deviation: Option<Deviation>,
}

/// A pair in 3D.
#[derive(Clone, Debug)]
pub struct InSpace {
    /// The imprints.
    pub sides: Vec<SpaceSide>,
    /// The CAD model, in its own frame.
    pub model: Option<Arc<TriMesh>>,
    /// The true pose.
    pub truth: Option<PlanarPose>,
    /// The sensors.
    pub rig: Arc<Rig>,
    /// Words on how it was made.
    pub note: String,
}

/// Makes membranes, contact points and poses of a pair, and where they are shown the distances between them.
///
/// # Errors
/// If prediction, imprint or mask cannot be made. Without a tool or a pose it is shown without.
pub fn in_space(
    dataset: &Dataset,
    setup: &StillSetup,
    sample: &Sample,
    models: &Models,
    cx: &JobCx,
) -> Result<InSpace, TaskError> {
    const WHAT: &str = "3D picture";
    let StillSetup { pair, pane, recipe, labels, distance_m, .. } = setup;
    let name = dataset.index.get(*pair).and_then(|entry| entry.tool.as_deref());
    let tool = match name {
        Some(name) => load_tool(dataset, name).map(|loaded| loaded.model),
        None => Err(TaskError::new(WHAT, "no tool is named")),
    };
    let touch = Touch { dataset, pair: *pair, sample, tool: tool.as_ref(), labels };
    let (mut made, mut notes) = (Vec::new(), Vec::new());
    for &source in pane.sides() {
        let recipe = Recipe { imprint: source, ..recipe.clone() };
        let estimate = Estimate::new(&recipe).with_surface().reach(touch, Stage::Pose, models, cx)?;
        let clouds = estimate.surface();
        let mut membranes = PerPad::default();
        for (pad, imprint) in estimate.imprints.entries() {
            let camera = sample.pad(pad).and_then(|touch| touch.camera());
            membranes[pad] = camera.and_then(|camera| membrane(imprint, camera).ok()).map(Arc::new);
        }
        let pose = estimate.pose().ok().cloned();
        let apart = pose.as_ref().zip(tool.as_ref().ok()).filter(|_| distance_m.is_some());
        let deviation = apart.map(|(pose, tool)| deviation(clouds, tool, pose.grasp_from_object));
        notes.push(side_note(&recipe, pose.as_ref()));
        let contact = clouds.fingers.as_ref().map(|cloud| cloud.map(|cloud| cloud.contact_points().collect()));
        made.push(SpaceSide { source, contact, membranes, pose, deviation });
    }
    Ok(InSpace {
        sides: made,
        model: tool.ok().map(|tool| Arc::new(tool.mesh.clone())),
        truth: sample.grasp_from_object,
        rig: sample.rig.clone(),
        note: notes.join(" · "),
    })
}

/// `measured 3.2° ± 0.5° (true 3.1°), joint`.
fn side_note(recipe: &Recipe, pose: Option<&PoseResult>) -> String {
    let mut text = recipe.imprint.key().to_owned();
    match pose {
        Some(pose) => {
            text += &format!(" {}", pose.angle_text());
            if let Some(truth) = pose.truth_rad {
                text += &format!(" (true {})", units::text_deg(truth));
            }
            text += &format!(", {}", recipe.registration);
        }
        None => text += ": no pose",
    }
    match (&recipe.generator, recipe.imprint) {
        (Some((bundle, config)), ImprintSource::Predicted) => {
            format!("{text} · {}", predicted_by(&bundle.name, config, recipe.shift))
        }
        _ => text,
    }
}
