//! The shaders of `shaders/`, embedded, with `#import <common/x.wgsl>` resolved.
//!
//! An import stands on its own line; every file is taken once, before the text that asks for it. The resolved text
//! remembers where each line came from, so that an error names the file that a person edits.

use super::{Gpu, GpuError, wgpu};

/// Every file of `shaders/`: its path below that folder, and its text.
pub(crate) const SHADERS: &[(&str, &str)] = &[
    ("common/color.wgsl", include_str!("../../shaders/common/color.wgsl")),
    ("common/edl.wgsl", include_str!("../../shaders/common/edl.wgsl")),
    ("common/floor.wgsl", include_str!("../../shaders/common/floor.wgsl")),
    ("common/light.wgsl", include_str!("../../shaders/common/light.wgsl")),
    ("common/stroke.wgsl", include_str!("../../shaders/common/stroke.wgsl")),
    ("common/view.wgsl", include_str!("../../shaders/common/view.wgsl")),
    ("edges.wgsl", include_str!("../../shaders/edges.wgsl")),
    ("edl_many.wgsl", include_str!("../../shaders/edl_many.wgsl")),
    ("edl_one.wgsl", include_str!("../../shaders/edl_one.wgsl")),
    ("floor.wgsl", include_str!("../../shaders/floor.wgsl")),
    ("lines.wgsl", include_str!("../../shaders/lines.wgsl")),
    ("mesh.wgsl", include_str!("../../shaders/mesh.wgsl")),
    ("points.wgsl", include_str!("../../shaders/points.wgsl")),
    ("shadow.wgsl", include_str!("../../shaders/shadow.wgsl")),
    ("raster.wgsl", include_str!("../../shaders/raster.wgsl")),
];

/// A shader text that cannot be used.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShaderError {
    /// An import, or the entry itself, that is in no table.
    #[error("shader {path} is not there{}", .imported_at.as_ref().map_or(String::new(), |at| format!(" (imported at {at})")))]
    Missing {
        /// The path asked for.
        path: String,
        /// `file:line` of the import; `None` for an entry.
        imported_at: Option<String>,
    },
    /// Files that import each other.
    #[error("shaders import each other: {}", .chain.join(" -> "))]
    Cycle {
        /// From the first file to its second occurrence.
        chain: Vec<String>,
    },
    /// A line that starts with `#` but is no import.
    #[error("{at}: expected #import <path>, found {text:?}")]
    Directive {
        /// `file:line`.
        at: String,
        /// The line.
        text: String,
    },
    /// WGSL that does not compile.
    #[error("{at}: {reason}")]
    Wgsl {
        /// `file:line` in `shaders/`.
        at: String,
        /// The compiler's message.
        reason: String,
    },
}

/// A shader with its imports pasted in.
#[derive(Debug)]
pub struct Resolved {
    /// The whole WGSL text.
    pub source: String,
    /// For every line of `source`: index into `files`, and the line there, counted from 1.
    lines: Vec<(usize, usize)>,
    files: Vec<String>,
}

impl Resolved {
    /// `file:line` of line `line` (counted from 1) of [`Self::source`].
    pub(crate) fn locate(&self, line: usize) -> String {
        match line.checked_sub(1).and_then(|i| self.lines.get(i)) {
            Some(&(file, line)) => format!("{}:{line}", self.files[file]),
            None => format!("{}:end", self.files.last().map_or("", String::as_str)),
        }
    }
}

/// Pastes the imports of `entry` in; `files` is a table like [`SHADERS`].
///
/// # Errors
/// A missing file, a cycle, an unknown directive.
pub fn resolve(files: &[(&str, &str)], entry: &str) -> Result<Resolved, ShaderError> {
    let mut out = Resolved { source: String::new(), lines: Vec::new(), files: Vec::new() };
    paste(files, entry, None, &mut Vec::new(), &mut out)?;
    Ok(out)
}

/// Appends `path` after its imports; `open` are the files on the way to it.
fn paste(
    files: &[(&str, &str)],
    path: &str,
    imported_at: Option<String>,
    open: &mut Vec<String>,
    out: &mut Resolved,
) -> Result<(), ShaderError> {
    if let Some(start) = open.iter().position(|p| p == path) {
        let chain = open[start..].iter().cloned().chain([path.to_owned()]).collect();
        return Err(ShaderError::Cycle { chain });
    }
    if out.files.iter().any(|f| f == path) {
        return Ok(());
    }
    let Some((_, text)) = files.iter().find(|(p, _)| *p == path) else {
        return Err(ShaderError::Missing { path: path.to_owned(), imported_at });
    };
    open.push(path.to_owned());
    let mut own = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let location = || format!("{path}:{}", number + 1);
        if !line.trim_start().starts_with('#') {
            own.push((number + 1, line));
            continue;
        }
        let target = line.trim().strip_prefix("#import <").and_then(|rest| rest.strip_suffix('>'));
        let target = target.ok_or_else(|| ShaderError::Directive { at: location(), text: line.to_owned() })?;
        paste(files, target, Some(location()), open, out)?;
    }
    open.pop();
    out.files.push(path.to_owned());
    let file = out.files.len() - 1;
    for (number, line) in own {
        out.source.push_str(line);
        out.source.push('\n');
        out.lines.push((file, number));
    }
    Ok(())
}

/// Resolves and compiles the shader `entry` for the device.
///
/// # Errors
/// [`ShaderError`] with file and line where the text is wrong; [`GpuError::Device`] where the driver refuses it.
pub fn compile(gpu: &Gpu, entry: &str) -> Result<wgpu::ShaderModule, GpuError> {
    let resolved = resolve(SHADERS, entry)?;
    check(&resolved)?;
    gpu.guarded(entry, || {
        Ok(gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(entry),
            source: wgpu::ShaderSource::Wgsl(resolved.source.as_str().into()),
        }))
    })
}

/// Parses the text, so that an error has a file and a line.
fn check(resolved: &Resolved) -> Result<wgpu::naga::Module, ShaderError> {
    wgpu::naga::front::wgsl::parse_str(&resolved.source).map_err(|error| ShaderError::Wgsl {
        at: resolved.locate(error.location(&resolved.source).map_or(0, |l| l.line_number as usize)),
        reason: error.message().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{offset_of, size_of};
    use wgpu::naga;

    #[test]
    fn imports_are_pasted_once_and_lines_are_traced() {
        let files = [
            ("a.wgsl", "// a\n#import <b.wgsl>\n#import <c.wgsl>\nfn a() {}\n"),
            ("b.wgsl", "#import <c.wgsl>\nfn b() {}\n"),
            ("c.wgsl", "fn c() {}\n"),
        ];
        let r = resolve(&files, "a.wgsl").unwrap();
        assert_eq!(r.source, "fn c() {}\nfn b() {}\n// a\nfn a() {}\n");
        let locations: Vec<String> = (1..=5).map(|l| r.locate(l)).collect();
        assert_eq!(locations, ["c.wgsl:1", "b.wgsl:2", "a.wgsl:1", "a.wgsl:4", "a.wgsl:end"]);
    }

    #[test]
    fn cycles_missing_files_and_other_directives_are_named() {
        let files = [
            ("a", "#import <b>\n"),
            ("b", "\n#import <a>\n"),
            ("m", "//\n#import <nowhere>\n"),
            ("d", "#include <a>\n"),
            ("self", "#import <self>"),
        ];
        let text = |entry| resolve(&files, entry).unwrap_err().to_string();
        assert_eq!(text("a"), "shaders import each other: a -> b -> a");
        assert_eq!(text("self"), "shaders import each other: self -> self");
        assert_eq!(text("m"), "shader nowhere is not there (imported at m:2)");
        assert_eq!(text("zzz"), "shader zzz is not there");
        assert_eq!(text("d"), "d:1: expected #import <path>, found \"#include <a>\"");
    }

    #[test]
    fn a_wgsl_error_names_the_file_that_was_written() {
        let files = [("top", "#import <part>\nfn f() {}\n"), ("part", "fn good() {}\nfn bad() { let x = ; }\n")];
        let error = check(&resolve(&files, "top").unwrap()).unwrap_err();
        assert!(matches!(&error, ShaderError::Wgsl { at, .. } if at == "part:2"), "{error}");
    }

    #[test]
    fn the_table_lists_every_file_of_the_folder() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let mut on_disk: Vec<String> = [root.clone(), root.join("common")]
            .iter()
            .flat_map(|folder| std::fs::read_dir(folder).unwrap())
            .map(|entry| entry.unwrap().path())
            .filter(|p| p.is_file())
            .map(|p| p.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/"))
            .collect();
        on_disk.sort();
        let listed: Vec<&str> = SHADERS.iter().map(|(path, _)| *path).collect();
        assert_eq!(on_disk, listed);
    }

    /// Parses and validates one entry of the table.
    fn validated(entry: &str) -> naga::Module {
        let resolved = resolve(SHADERS, entry).unwrap();
        let module = check(&resolved).unwrap_or_else(|e| panic!("{e}"));
        let flags = naga::valid::ValidationFlags::all();
        naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{entry}: {}", e.emit_to_string(&resolved.source)));
        module
    }

    /// A shared part may call a function that its importers bring, so parts are tried inside the shaders that use them.
    #[test]
    fn every_shader_is_valid_and_every_part_is_in_one() {
        let (parts, entries): (Vec<&str>, Vec<&str>) =
            SHADERS.iter().map(|(path, _)| *path).partition(|path| path.starts_with("common/"));
        let mut used: Vec<String> = Vec::new();
        for entry in entries {
            validated(entry);
            used.extend(resolve(SHADERS, entry).unwrap().files);
        }
        for part in parts {
            assert!(used.iter().any(|file| file == part), "no shader imports {part}");
        }
    }

    /// The members (name, offset) and the size of a struct, as the shader compiler lays it out.
    fn layout(entry: &str, name: &str) -> (Vec<(String, usize)>, usize) {
        let module = validated(entry);
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
        let members = members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect();
        (members, *span as usize)
    }

    /// Compares a Rust struct with the WGSL struct of the same name: every member, every offset, the size.
    macro_rules! check_layout {
        ($entry:literal, $module:ident :: $name:ident { $($field:ident),* $(,)? }) => {{
            use crate::gpu::$module::$name;
            let rust = vec![$((stringify!($field).to_owned(), offset_of!($name, $field))),*];
            assert_eq!(layout($entry, stringify!($name)), (rust, size_of::<$name>()), stringify!($name));
        }};
    }

    #[test]
    fn rust_and_wgsl_structs_have_the_same_layout() {
        check_layout!(
            "common/view.wgsl",
            view::ViewUniform {
                clip_from_world,
                eye_in_world,
                up_in_world,
                key_in_world,
                depth,
                size_px,
                px_per_m,
                plane_count,
                unit_px,
                unused_0,
                unused_1,
                unused_2,
                planes,
            }
        );
        check_layout!(
            "common/floor.wgsl",
            floor::FloorUniform { color, center, light, shadow, unused_0, unused_1, unused_2 }
        );
        check_layout!("points.wgsl", points::PointVertex { position, payload });
        check_layout!(
            "points.wgsl",
            points::PointsUniform {
                world_from_points,
                color,
                highlight,
                lo,
                hi,
                size,
                size_in_meters,
                color_mode,
                map,
                stride,
                drawn,
                selected,
                unused_0,
                unused_1,
                unused_2,
            }
        );
        check_layout!(
            "mesh.wgsl",
            mesh::MeshUniform { world_from_mesh, color, xray, scalar, lo, hi, map, closed, unused_0, unused_1 }
        );
        check_layout!("edges.wgsl", edges::EdgeVertex { a, always, b, unused, normal_a, normal_b });
        check_layout!("edges.wgsl", edges::EdgesUniform { world_from_mesh, color, width_px, creases, dash_px, unused });
        check_layout!("lines.wgsl", lines::LineVertex { position, color });
        check_layout!("lines.wgsl", lines::LinesUniform { world_from_lines, width_px, opacity, unused_0, unused_1 });
    }
}
