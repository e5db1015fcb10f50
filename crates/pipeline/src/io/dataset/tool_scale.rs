//! The unit of CAD files: STL does not say which it is.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use strum::{EnumIter, IntoEnumIterator as _};

use super::problem;
use crate::io::error::{FileError, FileErrorKind};
use crate::io::stl;
use crate::io::{atomic, files};
use touch2touch_core::dataset::Problem;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::units::{is_tool_length, scale_to_meters};

/// The file beside the CAD models that says which unit they are in.
pub const UNIT_FILE: &str = "unit.txt";
/// Most bytes of that file: a word or a number.
const MAX_UNIT_BYTES: u64 = 4096;

/// A unit that CAD programs write models in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter)]
pub enum ToolUnit {
    /// Most CAD programs' own.
    Millimeters,
    /// Blender's and others'.
    Centimeters,
    /// The lab's.
    Meters,
    /// Rarely anyone's.
    Micrometers,
    /// Inches, where parts are drawn in them.
    Inches,
}

impl ToolUnit {
    /// Key, name, and meters of one.
    fn row(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Millimeters => ("mm", "millimeters", 1e-3),
            Self::Centimeters => ("cm", "centimeters", 1e-2),
            Self::Meters => ("m", "meters", 1.0),
            Self::Micrometers => ("um", "micrometers", 1e-6),
            Self::Inches => ("in", "inches", 0.0254),
        }
    }

    /// The word in [`UNIT_FILE`] and on the command line.
    pub fn key(self) -> &'static str {
        self.row().0
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// One of it, meters.
    pub fn meters(self) -> f64 {
        self.row().2
    }

    /// The units in which something of this size is as large as a hand-held tool.
    pub fn fitting(size: f64) -> impl Iterator<Item = Self> {
        Self::iter().filter(move |unit| is_tool_length(size * unit.meters()))
    }

    /// Scale of a file in this unit.
    pub fn scale(self) -> ToolScale {
        if self == Self::Meters { ToolScale::Meters } else { ToolScale::Factor(self.meters()) }
    }
}

impl FromStr for ToolUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::iter()
            .find(|unit| unit.key() == text)
            .ok_or_else(|| format!("unknown unit {:?}: use m, cm, mm, um or in", files::clip(text)))
    }
}

/// Unit of a CAD file's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ToolScale {
    /// Meters; a model that is too large or too small for that is an error.
    #[default]
    Meters,
    /// The unit that makes the model as large as a hand-held tool.
    Auto,
    /// To be multiplied by this to get meters.
    Factor(f64),
}

impl FromStr for ToolScale {
    type Err = String;

    /// `m`, `cm`, `mm`, `um`, `in`, `auto`, or the factor to meters.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        if let Ok(unit) = text.parse::<ToolUnit>() {
            return Ok(unit.scale());
        }
        Ok(match text {
            "auto" => Self::Auto,
            other => match other.parse::<f64>() {
                Ok(factor) if factor.is_finite() && factor > 0.0 => Self::Factor(factor),
                _ => {
                    return Err(format!(
                        "unknown unit {:?}: use m, cm, mm, um, in, auto or a factor to meters",
                        files::clip(other)
                    ));
                }
            },
        })
    }
}

impl ToolScale {
    /// Scale that [`UNIT_FILE`] beside `model` names; `None` without one.
    fn beside(model: &Path) -> Result<Option<Self>, FileError> {
        let hint = "write m, cm, mm, um, in, auto or a factor to meters into the file";
        let file = || model.with_file_name(UNIT_FILE);
        let unknown = |reason: String| FileError::new(file(), reason, hint).of_kind(FileErrorKind::Unit);
        said_beside(model)?.map(|text| text.parse().map_err(unknown)).transpose()
    }
}

/// The words of [`UNIT_FILE`] beside `model`; `None` without one.
///
/// # Errors
/// If it is there and cannot be read.
pub(crate) fn said_beside(model: &Path) -> Result<Option<String>, FileError> {
    let file: PathBuf = model.with_file_name(UNIT_FILE);
    match files::read_to_string(&file, MAX_UNIT_BYTES) {
        Ok(text) => Ok(Some(text.trim().to_owned())),
        Err(err) if err.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(err) => Err(FileError::io(file, "cannot access the mesh", err)),
    }
}

/// Longest side of a CAD model, in its file's own unit.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn tool_size(path: &Path) -> Result<f64, FileError> {
    let bounds = stl::read(path)?.mesh.bounds();
    Ok(bounds.map_or(0.0, |[lo, hi]| (hi - lo).max_element()))
}

/// Names the unit of all CAD models beside `model`, for good. What the file said before is lost.
///
/// # Errors
/// Whatever the disk says.
pub(crate) fn write_beside(model: &Path, word: &str) -> std::io::Result<()> {
    atomic::write_bytes(&model.with_file_name(UNIT_FILE), format!("{word}\n").as_bytes())
}

/// A CAD model that can be worked with.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ToolFile {
    /// The model in meters.
    pub(crate) mesh: TriMesh,
    /// Oddities of its file.
    pub(crate) notes: Vec<Problem>,
}

/// Reads a CAD model and brings it to meters: by `scale`, else as [`UNIT_FILE`] beside it says, else as it is. The one
/// verdict on CAD files, for the doctor and for whoever uses them.
///
/// # Errors
/// [`FileError`]; [`FileErrorKind::Unit`], with the factor that would fit, if the model cannot be in meters, and if no unit
/// makes it a tool, or not the one that was named.
pub(crate) fn read_tool(path: &Path, scale: Option<ToolScale>) -> Result<ToolFile, FileError> {
    let (scale, said_by) = match scale {
        Some(scale) => (scale, "the caller".to_owned()),
        None => (ToolScale::beside(path)?.unwrap_or_default(), format!("{}", path.with_file_name(UNIT_FILE).display())),
    };
    let stl::StlFile { mut mesh, degenerate, mended, .. } = stl::read(path)?;
    let size = mesh.bounds().map_or(0.0, |[lo, hi]| (hi - lo).max_element());
    let fitting = scale_to_meters(size);
    let wrong = |what: String, hint| {
        let what = format!("the CAD model is {} long{what}", stl::number(size));
        FileError::new(path, what, hint).of_kind(FileErrorKind::Unit)
    };
    let not_a_tool = |unit: String| {
        let hint =
            "tools are 4 mm to 0.4 m long: name the right unit in unit.txt beside the model, or export the model again";
        wrong(format!(": that is not a tool {unit}"), hint)
    };
    let factor = match (scale, fitting) {
        (ToolScale::Factor(factor), _) if is_tool_length(size * factor) => factor,
        (ToolScale::Factor(factor), fitting) => {
            let instead = fitting.map_or(String::new(), |fitting| format!("; {fitting} would fit"));
            return Err(not_a_tool(format!("with the factor {factor} to meters that {said_by} gives{instead}")));
        }
        (ToolScale::Auto, Some(factor)) => factor,
        (ToolScale::Meters, Some(1.0)) => 1.0,
        (ToolScale::Meters, Some(offered)) => {
            let hint = "accept the scale with `touch2touch doctor --set` or the button at the 3D view: a file unit.txt beside the \
                        model says auto, m, cm, mm, um, in or a factor";
            return Err(wrong(format!(", which cannot be meters: scale it by {offered}"), hint));
        }
        (ToolScale::Meters | ToolScale::Auto, None) => return Err(not_a_tool("in meters or any other unit".into())),
    };
    if factor != 1.0 {
        for vertex in &mut mesh.vertices {
            *vertex *= factor;
        }
    }
    let notes = (degenerate > 0).then(|| {
        problem(
            path,
            format!("{degenerate} triangles of the CAD model have no area"),
            "they are left out; repair the mesh if edges look frayed",
        )
    });
    let mended = mended.into_iter().map(|what| {
        problem(
            path,
            format!("the CAD model: {what}"),
            "it is used so; export it again from the CAD program if it looks wrong",
        )
    });
    Ok(ToolFile { mesh, notes: notes.into_iter().chain(mended).collect() })
}

/// The mesh of [`read_tool`].
///
/// # Errors
/// As [`read_tool`].
pub fn read_in_meters(path: &Path, scale: Option<ToolScale>) -> Result<TriMesh, FileError> {
    read_tool(path, scale).map(|file| file.mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A 40 x 20 x 10 box, in units of `unit` meters.
    fn write(path: &Path, unit: f64) {
        let size = DVec3::new(0.01, 0.02, 0.04) / unit;
        let vertices = (0..8).map(|i| DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2 & 1).into()) * size);
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        stl::write(path, &TriMesh { vertices: vertices.collect(), triangles }).unwrap();
    }

    fn length(mesh: &TriMesh) -> f64 {
        mesh.bounds().map(|[lo, hi]| (hi - lo).max_element()).unwrap()
    }

    #[test]
    fn every_unit_is_offered_and_the_offer_can_be_accepted() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        for (unit, name) in [(1.0, "m"), (1e-2, "cm"), (1e-3, "mm"), (1e-6, "um"), (0.0254, "in")] {
            write(&path, unit);
            let scale: ToolScale = name.parse().unwrap();
            assert!((length(&read_in_meters(&path, Some(scale)).unwrap()) - 0.04).abs() < 1e-8, "{name}");
        }
        for unit in [1e-3, 1e-6] {
            write(&path, unit);
            let error = read_in_meters(&path, None).unwrap_err();
            assert!(error.what.contains(&format!("scale it by {unit}")), "{error}");
            assert!(error.to_string().contains("t.stl") && error.hint.contains("auto"));
            assert!((length(&read_in_meters(&path, Some(ToolScale::Auto)).unwrap()) - 0.04).abs() < 1e-8);
        }
        // Beside the models it holds for the studio as well; the caller's word counts more.
        std::fs::write(dir.path().join(UNIT_FILE), "auto\n").unwrap();
        assert!((length(&read_in_meters(&path, None).unwrap()) - 0.04).abs() < 1e-8);
        assert!(read_in_meters(&path, Some(ToolScale::Meters)).is_err());
        std::fs::write(dir.path().join(UNIT_FILE), "furlong").unwrap();
        let error = read_in_meters(&path, None).unwrap_err();
        assert!(error.to_string().contains("furlong") && error.file.ends_with(UNIT_FILE), "{error}");
    }

    #[test]
    fn a_unit_that_makes_no_tool_is_refused_whoever_names_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        // Too large or too small in every unit.
        for unit in [1e-30, 1e20] {
            write(&path, unit);
            for scale in [None, Some(ToolScale::Auto), Some(ToolScale::Meters), Some(ToolScale::Factor(1.0))] {
                let error = read_tool(&path, scale).unwrap_err();
                assert!(error.what.contains("not a tool") && error.to_string().contains("t.stl"), "{error}");
                assert!(error.to_string().len() < 200 + path.as_os_str().len(), "{error}");
            }
        }
        // A model in millimeters: the right unit in the file is right, a wrong one is not taken.
        write(&path, 1e-3);
        let unit_file = dir.path().join(UNIT_FILE);
        for right in ["mm", "auto", "0.001"] {
            std::fs::write(&unit_file, right).unwrap();
            assert!((length(&read_tool(&path, None).unwrap().mesh) - 0.04).abs() < 1e-8, "{right}");
        }
        for wrong in ["um", "in", "1"] {
            std::fs::write(&unit_file, wrong).unwrap();
            let error = read_tool(&path, None).unwrap_err().to_string();
            assert!(error.contains(UNIT_FILE) && error.contains("0.001 would fit"), "{wrong}: {error}");
        }
    }
}
