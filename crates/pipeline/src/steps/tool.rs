//! A tool's CAD model, read from its data set and made ready for registration: [`load_tool`], [`Tools`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{TaskError, UnitOffer, says};
use crate::io::dataset::{Dataset, ToolFile, ToolUnit, UNIT_FILE, said_beside, tool_size, write_beside};
use crate::io::error::{FileError, FileErrorKind};
use touch2touch_core::dataset::Problem;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::units::{is_tool_length, scale_to_meters, text_mm};

/// The CAD model of a tool as its data set has it.
#[derive(Clone, Debug)]
pub struct LoadedTool {
    /// The tool's name.
    pub name: String,
    /// The model, ready for registration.
    pub model: ToolModel,
    /// Oddities of its file.
    pub notes: Vec<Problem>,
}

/// A tool of a data set, with what is odd about its file. Takes some tens of milliseconds.
///
/// # Errors
/// If it has no CAD file, or that one cannot be used.
pub fn load_tool(dataset: &Dataset, name: &str) -> Result<LoadedTool, TaskError> {
    let what = format!("CAD model of {name}");
    match dataset.tool_with_notes(name) {
        Ok(Some(ToolFile { mesh, notes })) => {
            let model = ToolModel::new(mesh).map_err(|err| TaskError::from_error(what, &err))?;
            Ok(LoadedTool { name: name.to_owned(), model, notes })
        }
        Ok(None) => Err(TaskError::new(what, format!("there is no {name}.stl, so its grasps have no pose"))
            .with_hint("Put it into tools_stls, in meters and the object frame.")),
        Err(err) => {
            let units = offer(dataset, name, &err).map(Arc::new);
            Err(TaskError { units, ..TaskError::new(what, says(&err)).with_hint(err.hint) })
        }
    }
}

/// The units in which a tool's CAD file would fit, where its unit is what is wrong with it; `None` if there is none.
pub(crate) fn offer(dataset: &Dataset, tool: &str, wrong: &FileError) -> Option<UnitOffer> {
    let offer = (wrong.kind == FileErrorKind::Unit).then(|| units_of(dataset, tool).ok()).flatten();
    offer.filter(|offer| !offer.units.is_empty())
}

/// The units that a tool's CAD file may be in by its size, and what is said of it beside it.
///
/// # Errors
/// If there is no such file, or it cannot be read.
pub fn units_of(dataset: &Dataset, tool: &str) -> Result<UnitOffer, TaskError> {
    let what = || format!("CAD model of {tool}");
    let fail = |err: FileError| TaskError::new(what(), says(&err)).with_hint(err.hint);
    let Some(file) = dataset.tool_mesh_file(tool) else {
        return Err(TaskError::new(what(), "there is no file of it in this data set"));
    };
    let size = tool_size(file).map_err(fail)?;
    let units = ToolUnit::fitting(size).map(|unit| (unit, text_mm(size * unit.meters()))).collect();
    Ok(UnitOffer { tool: tool.to_owned(), units, says: said_beside(file).map_err(fail)? })
}

/// Unit in which a CAD file is read from now on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitSet {
    /// The tool.
    pub tool: String,
    /// The unit of its file.
    pub unit: ToolUnit,
    /// The file that says so, for all CAD models beside it.
    pub file: PathBuf,
    /// Word in that file: the unit, or `auto` where the models beside it are in several.
    pub word: String,
    /// Why it could not be written: then the unit holds as long as this data set is open.
    pub not_written: Option<String>,
}

/// Has a tool's CAD file read in a unit, by the file [`UNIT_FILE`] beside it. It is for all CAD models of that folder:
/// where the unit does not fit them too, the file says `auto`.
///
/// `replacing`: what the file says now, as whoever asks for it was told.
///
/// # Errors
/// If the tool is not as large as a tool in that unit, if no word fits all models of the folder, or if the file says
/// something else than `replacing`; nothing is changed then.
pub fn set_unit(dataset: &Dataset, tool: &str, unit: ToolUnit, replacing: Option<&str>) -> Result<UnitSet, TaskError> {
    let fail = |why: String| TaskError::new(format!("Read {tool} in {}", unit.name()), why);
    let offer = units_of(dataset, tool)?;
    let model = dataset.tool_mesh_file(tool).map(Path::to_owned).unwrap_or_default();
    if !offer.units.iter().any(|(fits, _)| *fits == unit) {
        let others: Vec<&str> = offer.units.iter().map(|(unit, _)| unit.name()).collect();
        let hint = if others.is_empty() {
            "Export it again.".to_owned()
        } else {
            format!("It fits in {}.", others.join(", "))
        };
        return Err(fail("the model is then not a tool: tools are 4 mm to 0.4 m long".into()).with_hint(hint));
    }
    let file = model.with_file_name(UNIT_FILE);
    let word = word_for(&model, unit).ok_or_else(|| {
        fail("the models beside it are in other units, and one file names the unit of all".into())
            .with_hint("Export the model again in the unit of the others.")
    })?;
    let done =
        |not_written| Ok(UnitSet { tool: tool.to_owned(), unit, file: file.clone(), word: word.clone(), not_written });
    match offer.says.as_deref() {
        Some(says) if says == word => return done(None),
        Some(says) if Some(says) != replacing => {
            return Err(fail(format!("{} says {says:?} already", file.display()))
                .with_hint("Replace it if that is wrong: it is for all models of that folder."));
        }
        _ => {}
    }
    match write_beside(&model, &word) {
        Ok(()) => done(None),
        Err(err) => {
            dataset.hold_unit(tool, unit);
            done(Some(format!("{err} ({})", file.display())))
        }
    }
}

/// Word that [`UNIT_FILE`] beside a model has to hold so that it is read in `unit` and the models beside it can be
/// read.
fn word_for(model: &Path, unit: ToolUnit) -> Option<String> {
    let beside = std::fs::read_dir(model.parent()?).ok()?.flatten().map(|entry| entry.path());
    let is_model = |file: &PathBuf| file.extension().is_some_and(|end| end.eq_ignore_ascii_case("stl"));
    // What cannot be read in any unit is not held against it.
    let sizes = beside.filter(is_model).filter_map(|file| tool_size(&file).ok());
    let mut sizes = sizes.filter(|size| scale_to_meters(*size).is_some());
    if sizes.all(|size| is_tool_length(size * unit.meters())) {
        return Some(unit.key().to_owned());
    }
    let own = scale_to_meters(tool_size(model).ok()?);
    (own == Some(unit.meters())).then(|| "auto".to_owned())
}

/// A tool of a mesh, with what the registration needs. Takes some tens of milliseconds.
///
/// # Errors
/// If the mesh has no area or is not finite.
pub fn tool_of(name: &str, mesh: TriMesh) -> Result<ToolModel, TaskError> {
    ToolModel::new(mesh).map_err(|err| TaskError::from_error(format!("CAD model of {name}"), &err))
}

/// The CAD models of a data set, each read once. One that is not there, or cannot be used, is not looked for again.
#[derive(Debug)]
pub struct Tools<'a> {
    dataset: &'a Dataset,
    models: BTreeMap<String, Option<ToolModel>>,
    notes: Vec<Problem>,
}

impl<'a> Tools<'a> {
    /// Nothing is read yet.
    pub fn new(dataset: &'a Dataset) -> Self {
        Self { dataset, models: BTreeMap::new(), notes: Vec::new() }
    }

    /// The model of a tool, read when it is first asked for.
    pub fn get(&mut self, name: &str) -> Option<&ToolModel> {
        if !self.models.contains_key(name) {
            let model = load_tool(self.dataset, name).ok().map(|mut loaded| {
                self.notes.append(&mut loaded.notes);
                loaded.model
            });
            self.models.insert(name.to_owned(), model);
        }
        self.known(name)
    }

    /// The model of a tool that was asked for before.
    pub fn known(&self, name: &str) -> Option<&ToolModel> {
        self.models.get(name)?.as_ref()
    }

    /// Oddities of the files that were read.
    pub(crate) fn into_notes(self) -> Vec<Problem> {
        self.notes
    }
}
