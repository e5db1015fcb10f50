//! `Dataset` and `Pair`: a source of paired touches, and one grasp of it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyIndexError, PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyTuple};
use touch2touch_core::catalog;
use touch2touch_core::dataset::{PairEntry, PairId, Problem};
use touch2touch_core::evaluation::GraspScore;
use touch2touch_core::read_as::parse_list;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{DepthCamera, PadTouch, Sample};
use touch2touch_core::sim::{self, Grasp, Sensors};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::dataset::{Dataset as Source, ToolScale};
use touch2touch_pipeline::labels::filter::Filter;
use touch2touch_pipeline::labels::{Labels, PairLabels, Review};
use touch2touch_pipeline::steps::estimate::Touch;
use touch2touch_pipeline::steps::tool::load_tool;

use crate::arrays::{Array, array, rows, stack, stack_rgb, transform};
use crate::picture;
use crate::process::{away, failed, refused};
use crate::tables::Scores;
use crate::tool::Tool;

/// A data set that is open, with what was read of it.
pub(crate) struct Opened {
    pub(crate) source: Source,
    pub(crate) labels: Labels,
    /// Path and choices that it was opened with, by which it pickles.
    path: PathBuf,
    read_as: Option<String>,
    tool_unit: Option<String>,
    /// CAD models that were read.
    tools: Mutex<BTreeMap<String, Result<Arc<Tool>, TaskError>>>,
}

impl Opened {
    /// A tool's CAD model, read once.
    fn tool(&self, name: &str) -> Result<Arc<Tool>, TaskError> {
        let known = self.tools.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned();
        known.unwrap_or_else(|| {
            let made = load_tool(&self.source, name).map(|loaded| Arc::new(Tool::of(name, Arc::new(loaded.model))));
            let mut tools = self.tools.lock().unwrap_or_else(PoisonError::into_inner);
            tools.entry(name.to_owned()).or_insert(made).clone()
        })
    }
}

/// Opens a data set: a folder in the lab's layout or of image pairs, or a built-in one ("demo", "test-set",
/// "test-set-noise", ...). Reads names only; pairs load one by one.
///
/// `read_as`: read the data otherwise than they are stored, what `touch2touch doctor` offers ("swap-fingers", several with
/// commas). `tool_unit`: unit of the CAD files where no `unit.txt` says it.
#[pyfunction]
#[pyo3(signature = (path, *, read_as=None, tool_unit=None))]
pub(crate) fn open(
    py: Python<'_>,
    path: PathBuf,
    read_as: Option<String>,
    tool_unit: Option<String>,
) -> PyResult<Dataset> {
    py.detach(|| {
        let source = Source::open(&path).map_err(|err| refused(format!("{err}; {}", err.hint)))?;
        let readings = read_as.as_deref().map(parse_list).transpose().map_err(refused)?;
        let mut source = match readings {
            Some(readings) => source.reading(readings),
            None => source,
        };
        source.tool_scale = tool_unit.as_deref().map(str::parse::<ToolScale>).transpose().map_err(refused)?;
        let labels = Labels::of(&source);
        let ids = (0..source.index.pairs.len()).collect();
        let tools = Mutex::default();
        Ok(Dataset { opened: Arc::new(Opened { source, labels, path, read_as, tool_unit, tools }), ids })
    })
}

/// A problem in a line.
fn said(problem: &Problem) -> String {
    format!("{}: {}. {}", problem.file.display(), problem.what, problem.hint)
}

/// A source of paired touches. `len(data)`, `data[0]`, `data["tool/data_7"]`, `data[:10]`, iteration.
#[pyclass(module = "touch2touch", frozen, sequence)]
pub(crate) struct Dataset {
    pub(crate) opened: Arc<Opened>,
    /// The pairs that it shows, by their places in the source.
    pub(crate) ids: Vec<usize>,
}

impl Dataset {
    fn entry(&self, id: usize) -> &PairEntry {
        &self.opened.source.index.pairs[id]
    }

    fn load(&self, py: Python<'_>, id: usize) -> PyResult<Pair> {
        let opened = self.opened.clone();
        let sample = away(py, |_| {
            let name = &opened.source.index.pairs[id].name;
            opened.source.load(PairId(id as u32)).map_err(|err| refused(format!("Load {name}: {err}")))
        })?;
        let entry = self.entry(id);
        Ok(Pair {
            of: Of::Data(self.opened.clone(), PairId(id as u32)),
            name: entry.name.clone(),
            tool_name: entry.tool.clone(),
            sample: Arc::new(sample),
        })
    }

    fn part(&self, ids: Vec<usize>) -> Self {
        Self { opened: self.opened.clone(), ids }
    }
}

#[pymethods]
impl Dataset {
    fn __len__(&self) -> usize {
        self.ids.len()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, at: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        if let Ok(name) = at.extract::<String>() {
            let id = self.ids.iter().find(|id| self.entry(**id).name == name);
            let id = id.ok_or_else(|| PyKeyError::new_err(format!("no pair is named {name:?}")))?;
            return Ok(self.load(py, *id)?.into_pyobject(py)?.into_any());
        }
        if let Ok(slice) = at.cast::<PySlice>() {
            let span = slice.indices(self.ids.len() as isize)?;
            let at = (0..span.slicelength as isize).map(|n| (span.start + n * span.step) as usize);
            return Ok(self.part(at.map(|at| self.ids[at]).collect()).into_pyobject(py)?.into_any());
        }
        let at: isize = at.extract().map_err(|_| PyTypeError::new_err("a number, a name or a slice is needed"))?;
        let place = if at < 0 { at + self.ids.len() as isize } else { at };
        let id = usize::try_from(place).ok().and_then(|place| self.ids.get(place));
        let id = id.ok_or_else(|| PyIndexError::new_err(format!("there is no pair {at} among {}", self.ids.len())))?;
        Ok(self.load(py, *id)?.into_pyobject(py)?.into_any())
    }

    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (builtins, get) = (slf.py().import("builtins")?, slf.getattr("__getitem__")?);
        builtins.call_method1("map", (get, builtins.call_method1("range", (slf.get().ids.len(),))?))
    }

    /// Names of the pairs, in order.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.ids.iter().map(|id| self.entry(*id).name.as_str()).collect()
    }

    /// Names of the tools of these pairs, in order.
    #[getter]
    fn tools(&self) -> Vec<&str> {
        let mut tools: Vec<&str> = self.ids.iter().filter_map(|id| self.entry(*id).tool.as_deref()).collect();
        tools.sort_unstable();
        tools.dedup();
        tools
    }

    /// Title for people.
    #[getter]
    fn title(&self) -> &str {
        &self.opened.source.title
    }

    /// Faults of the data set as far as names and folders tell, a line each.
    #[getter]
    fn problems(&self) -> Vec<String> {
        self.opened.source.problems.iter().map(said).collect()
    }

    /// The CAD model of a tool.
    fn tool(&self, py: Python<'_>, name: &str) -> PyResult<Tool> {
        let tool = py.detach(|| self.opened.tool(name)).map_err(|err| failed(&err))?;
        Ok(Tool::of(&tool.name, tool.model.clone()))
    }

    /// A map-style data set for PyTorch: `DataLoader(data.torch(("gelslim", "imprint")), num_workers=2)`. Each item is a
    /// dictionary of arrays by the names of `Pair`'s properties, and "name".
    #[pyo3(signature = (fields=None))]
    fn torch<'py>(slf: &Bound<'py, Self>, fields: Option<Vec<String>>) -> PyResult<Bound<'py, PyAny>> {
        let fields = fields.unwrap_or_else(|| ["gelslim", "imprint"].map(str::to_owned).to_vec());
        slf.py().import("touch2touch._torch")?.getattr("MapDataset")?.call1((slf, fields))
    }

    /// The pairs that answer to all words, in the words of the studio's filter box: parts of a name, "tool:rod",
    /// "is:done", "note:edge"; and, with the scores of an evaluation, "angle>5", "psnr<20", "verdict=wrong". Scores are
    /// those of the generators; "measured:angle>2" names a row by a part of its name.
    #[pyo3(signature = (words, scores=None))]
    fn filter(&self, py: Python<'_>, words: &str, scores: Option<&Scores>) -> PyResult<Self> {
        let filter = Filter::parse(words);
        if !filter.conditions.is_empty() && scores.is_none() {
            return Err(refused("conditions such as angle>5 are on scores: pass those of touch2touch.evaluate"));
        }
        py.detach(|| {
            let reviews = self.opened.labels.reviews();
            let passes = |id: &usize| {
                let entry = self.entry(*id);
                let review = reviews.states.get(&entry.name).copied().unwrap_or(Review::Todo);
                let note = reviews.notes.get(&entry.name).map_or("", String::as_str);
                filter.passes(entry, review, note)
                    && filter.conditions.iter().all(|condition| {
                        scores.is_some_and(|scores| {
                            let of = scores.of(&entry.name, &condition.source);
                            let value = |grasp: &GraspScore| grasp.metric(condition.metric);
                            of.into_iter().filter_map(value).any(|value| condition.passes(value))
                        })
                    })
            };
            Ok(self.part(self.ids.iter().copied().filter(passes).collect()))
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let Opened { path, read_as, tool_unit, source, .. } = &*this.opened;
        let make = py.import("touch2touch")?.getattr("_dataset")?;
        let path = if path.exists() { std::path::absolute(path)? } else { path.clone() };
        let ids = (this.ids.len() != source.index.pairs.len()).then(|| this.names());
        (make, (path, read_as, tool_unit, ids)).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        format!("Dataset({:?}, {} pairs of {} tools)", self.opened.source.title, self.ids.len(), self.tools().len())
    }

    /// The part of these names.
    fn _named(&self, names: Vec<String>) -> PyResult<Self> {
        let places: BTreeMap<&str, usize> = self.ids.iter().map(|id| (self.entry(*id).name.as_str(), *id)).collect();
        let place = |name: &String| {
            let place = places.get(name.as_str()).copied();
            place.ok_or_else(|| PyKeyError::new_err(format!("no pair is named {name:?}")))
        };
        Ok(self.part(names.iter().map(place).collect::<PyResult<_>>()?))
    }
}

/// Source of a pair.
#[derive(Clone)]
enum Of {
    Data(Arc<Opened>, PairId),
    /// Simulated here, with the arguments that made it.
    Simulated(Arc<Tool>, Simulation),
}

#[derive(Clone)]
struct Simulation {
    grasp: Grasp,
    seed: u64,
    sensors: Option<u64>,
    gelslims: Option<u64>,
}

/// One grasp: what both sensors of each finger felt, and the truth where it is known. Fingers are in the order of the rig:
/// right, left. Images are (2, height, width), a finger without one is NaN; `None` where no finger has one.
#[pyclass(module = "touch2touch", frozen)]
#[derive(Clone)]
pub(crate) struct Pair {
    of: Of,
    /// Name in the data set.
    #[pyo3(get)]
    name: String,
    /// Name of its tool, where known.
    #[pyo3(get)]
    tool_name: Option<String>,
    pub(crate) sample: Arc<Sample>,
}

impl Pair {
    fn pads<'s, T>(&'s self, of: impl Fn(&'s PadTouch) -> Option<T>) -> impl Iterator<Item = Option<T>> {
        self.sample.rig.pads().map(move |pad: PadId| self.sample.pad(pad).and_then(&of))
    }

    /// A matrix of each camera, of `side` rows; NaN for a pad without one, `None` without any.
    fn cameras<'py, const N: usize>(
        &self,
        py: Python<'py>,
        side: usize,
        matrix: impl Fn(&DepthCamera) -> [f64; N],
    ) -> PyResult<Option<Array<'py, f64>>> {
        let all: Vec<Option<[f64; N]>> = self.pads(|touch| touch.camera().map(&matrix)).collect();
        if all.iter().all(Option::is_none) {
            return Ok(None);
        }
        let values = all.iter().flat_map(|matrix| matrix.unwrap_or([f64::NAN; N])).collect();
        array(py, values, &[all.len(), side, side]).map(Some)
    }

    /// Labels that people gave it, as they are on the disk now.
    fn labels(&self, py: Python<'_>) -> PyResult<PairLabels> {
        let Of::Data(opened, _) = &self.of else { return Ok(PairLabels::default()) };
        py.detach(|| opened.labels.load(&self.name)).map_err(|err| failed(&err))
    }

    /// The labels of its data set; `None` of one that was simulated here.
    pub(crate) fn all_labels(&self) -> Option<&Labels> {
        match &self.of {
            Of::Data(opened, _) => Some(&opened.labels),
            Of::Simulated(..) => None,
        }
    }

    /// The data set that it lies in, and where; `None` of one that was simulated here.
    pub(crate) fn place(&self) -> Option<(&Source, PairId)> {
        match &self.of {
            Of::Data(opened, id) => Some((&opened.source, *id)),
            Of::Simulated(..) => None,
        }
    }

    fn tool_model(&self) -> Result<Arc<Tool>, TaskError> {
        match (&self.of, &self.tool_name) {
            (Of::Simulated(tool, _), _) => Ok(tool.clone()),
            (Of::Data(opened, _), Some(name)) => opened.tool(name),
            (Of::Data(..), None) => Err(TaskError::new("Pose", "no tool is named, so there is no CAD model to align")),
        }
    }

    /// Asks `of` with the touch as the way from a touch to a pose takes it, with the tool and the labels beside it.
    pub(crate) fn with_touch<T>(
        &self,
        tool: Option<&Arc<Tool>>,
        of: impl FnOnce(Touch<'_>) -> Result<T, TaskError>,
    ) -> Result<T, TaskError> {
        let tool = tool.map_or_else(|| self.tool_model(), |tool| Ok(tool.clone()));
        let tool = tool.as_ref().map(|tool| &*tool.model);
        let none = PairLabels::default();
        let demo;
        let (dataset, pair, labels) = match &self.of {
            Of::Data(opened, pair) => (&opened.source, *pair, Some(opened.labels.load(&self.name)?)),
            // The way asks no data set for anything; a touch names one all the same.
            Of::Simulated(..) => {
                demo = Source::demo();
                (&demo, PairId(0), None)
            }
        };
        of(Touch { dataset, pair, sample: &self.sample, tool, labels: labels.as_ref().unwrap_or(&none) })
    }
}

#[pymethods]
impl Pair {
    /// Color images of the GelSlims, touched minus untouched: (2, 320, 427, 3) float32, signed, 0..255 scale. What the
    /// models see.
    #[getter]
    fn gelslim<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        stack_rgb(py, self.pads(|touch| touch.color().map(|color| &color.difference)))
    }

    /// The touched color images, 0..255 scale; `None` where the source has the difference only.
    #[getter]
    fn gelslim_touched<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        stack_rgb(py, self.pads(|touch| Some(&touch.color()?.images.as_ref()?.raw)))
    }

    /// The untouched color images, likewise.
    #[getter]
    fn gelslim_untouched<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        stack_rgb(py, self.pads(|touch| Some(&touch.color()?.images.as_ref()?.reference)))
    }

    /// Measured imprints of the Soft Bubbles: (2, 140, 175) float32, meters, positive where pushed in, NaN where nothing was
    /// measured; the camera's own orientation.
    #[getter]
    fn imprint<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        stack(py, self.pads(|touch| touch.depth().map(|depth| &depth.imprint)), f32::NAN)
    }

    /// Depth without contact: (2, 140, 175) float32, meters from the camera.
    #[getter]
    fn depth_reference<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        stack(py, self.pads(|touch| touch.camera().map(|camera| &camera.depth_reference)), f32::NAN)
    }

    /// The simulator's imprints before camera noise, likewise; `None` for measured data.
    #[getter]
    fn true_imprint<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        stack(py, self.pads(|touch| Some(&touch.depth()?.truth.as_ref()?.imprint)), f32::NAN)
    }

    /// The simulator's true contact: (2, 140, 175) bool; `None` for measured data.
    #[getter]
    fn true_contact<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, bool>>> {
        stack(py, self.pads(|touch| Some(&touch.depth()?.truth.as_ref()?.contact)), false)
    }

    /// Camera matrices of the depth images as they are stored: (2, 3, 3) float64, pixels; `None` without a camera. A pixel
    /// (u, v) at depth z lies at z K⁻¹ (u, v, 1) in the camera's frame.
    #[getter]
    #[pyo3(name = "K")]
    fn intrinsics<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        self.cameras(py, 3, |camera| {
            let (k, [x, y]) = (camera.intrinsics, camera.crop.offset.map(|o| o as f64));
            [k.fx, 0.0, k.cx - x, 0.0, k.fy, k.cy - y, 0.0, 0.0, 1.0]
        })
    }

    /// Places of the depth cameras: (2, 4, 4) float64, camera frame to grasp frame, meters; `None` without a camera.
    #[getter]
    fn grasp_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        self.cameras(py, 4, |camera| rows(&camera.grasp_from_camera))
    }

    /// The true pose of the tool in the hand: `grasp_from_object` (4, 4) float64, meters; `None` where it is not known.
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        self.sample.grasp_from_object.map(|pose| transform(py, &pose.to_affine())).transpose()
    }

    /// The true in-hand angle as the lab reports it (of `object_from_grasp`), radians; `None` where it is not known.
    #[getter]
    fn true_angle(&self) -> Option<f64> {
        self.sample.grasp_from_object.map(|pose| pose.inverse().theta_rad)
    }

    /// The CAD model of its tool.
    #[getter]
    fn tool(&self, py: Python<'_>) -> PyResult<Tool> {
        let tool = py.detach(|| self.tool_model()).map_err(|err| failed(&err))?;
        Ok(Tool::of(&tool.name, tool.model.clone()))
    }

    /// Contact masks that people drew on the measured imprints: (2, 140, 175) bool; `None` where nobody did.
    #[getter]
    fn drawn_mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, bool>>> {
        let labels = self.labels(py)?;
        stack(py, self.sample.rig.pads().map(|pad| Some(&*labels.measured(pad)?.mask)), false)
    }

    /// Review state that people gave it: "todo", "in_progress", "done", "flagged" or "skip".
    #[getter]
    fn review(&self, py: Python<'_>) -> PyResult<&'static str> {
        Ok(self.labels(py)?.review.stored())
    }

    /// Note that a person wrote about it; empty for none.
    #[getter]
    fn note(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.labels(py)?.note)
    }

    /// Oddities of its files and numbers, a line each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.sample.notes.iter().map(said).collect()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let module = py.import("touch2touch")?;
        match &this.of {
            Of::Data(opened, id) => {
                let data = Dataset { opened: opened.clone(), ids: vec![id.0 as usize] };
                (module.getattr("_pair")?, (data, 0)).into_pyobject(py)
            }
            Of::Simulated(tool, s) => {
                let Grasp { theta_rad, x_m, y_m } = s.grasp;
                let arguments = (tool.name.as_str(), theta_rad, x_m, y_m, s.seed, s.sensors, s.gelslims);
                (module.getattr("_simulated")?, arguments).into_pyobject(py)
            }
        }
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let depth = slf.get().sample.pads.entries().filter_map(|(_, touch)| touch.depth());
        let images = picture::imprints(slf.py(), depth.map(|touch| &touch.imprint))?;
        slf.py().import("touch2touch._scene")?.call_method1("pair_html", (slf, images))
    }

    fn __repr__(&self) -> String {
        let angle = self.true_angle().map_or(String::new(), |a| format!(", held at {:.1}°", a.to_degrees()));
        format!("Pair({:?}, tool {}{angle})", self.name, self.tool_name.as_deref().unwrap_or("unknown"))
    }
}

/// A simulated grasp of a tool of the simulator, by name: both sensors' touch with the truth.
///
/// `angle` in radians (±22.5° in the lab's data), `x` and `y` in meters (±5 mm), in the lab's sense. `sensors`, `gelslims`:
/// seeds of other sensors, as for `touch2touch simulate`.
#[pyfunction]
#[pyo3(signature = (tool, angle=0.0, x=0.0, y=0.0, *, seed=0, sensors=None, gelslims=None))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn simulate(
    py: Python<'_>,
    tool: &str,
    angle: f64,
    x: f64,
    y: f64,
    seed: u64,
    sensors: Option<u64>,
    gelslims: Option<u64>,
) -> PyResult<Pair> {
    if ![angle, x, y].iter().all(|v| v.is_finite()) {
        return Err(refused("a grasp must be of finite numbers"));
    }
    let chosen = Sensors::named(sensors, gelslims).map_err(refused)?;
    let spec = catalog::tools().iter().find(|spec| spec.name == tool).ok_or_else(|| {
        let names: Vec<&str> = catalog::tools().iter().map(|spec| spec.name.as_str()).collect();
        refused(format!("no tool is named {tool:?}; there are: {}", names.join(", ")))
    })?;
    let grasp = Grasp { theta_rad: angle, x_m: x, y_m: y };
    let sample = away(py, |_| Ok(sim::simulate(spec, grasp, seed, &chosen.config())))?;
    let model = touch2touch_pipeline::steps::tool::tool_of(&spec.name, spec.mesh()).map_err(|err| failed(&err))?;
    let made = Arc::new(Tool::of(&spec.name, Arc::new(model)));
    Ok(Pair {
        of: Of::Simulated(made, Simulation { grasp, seed, sensors, gelslims }),
        name: format!("{tool}, simulated"),
        tool_name: Some(spec.name.clone()),
        sample: Arc::new(sample),
    })
}

/// The data set at a path, for functions that take one or the other.
pub(crate) fn dataset_of(py: Python<'_>, data: &Bound<'_, PyAny>) -> PyResult<Py<Dataset>> {
    match data.cast::<Dataset>() {
        Ok(data) => Ok(data.clone().unbind()),
        Err(_) => Py::new(py, open(py, data.extract::<PathBuf>()?, None, None)?),
    }
}
