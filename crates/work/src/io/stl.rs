//! STL meshes: binary and text, with equal corners welded so that edges can be followed.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use touch2touch_core::mesh::{TriMesh, triangle_area};

/// Why a mesh cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file cannot be opened, read or written.
    #[error("cannot access the mesh ({}): {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Neither a binary nor a text STL.
    #[error("not an STL mesh: {reason} ({})", file.display())]
    NotStl {
        /// The file.
        file: PathBuf,
        /// Reason, as the message ends.
        reason: String,
    },
    /// A binary STL with fewer or more bytes than its triangle count needs.
    #[error("the mesh announces {triangles} triangles ({expected} bytes) but has {found} bytes ({})", file.display())]
    Truncated {
        /// The file.
        file: PathBuf,
        /// Triangles announced.
        triangles: u32,
        /// Bytes needed.
        expected: u64,
        /// Bytes there.
        found: u64,
    },
    /// A corner that is NaN or infinite.
    #[error("triangle {triangle} has a corner that is not a number ({})", file.display())]
    NotFinite {
        /// The file.
        file: PathBuf,
        /// Position of the triangle in the file.
        triangle: usize,
    },
    /// The model is too large or too small to be a tool in meters.
    #[error(
        "the CAD model is {} long, which cannot be meters: scale it by {offered} ({})",
        number(*size),
        file.display()
    )]
    Unit {
        /// The file.
        file: PathBuf,
        /// Longest side of the bounding box, in the file's unit.
        size: f64,
        /// The factor that would bring it to meters.
        offered: f64,
    },
    /// Neither the unit that was named nor any other makes the model as large as a tool.
    #[error("the CAD model is {} long: that is no tool {unit} ({})", number(*size), file.display())]
    NotATool {
        /// The file.
        file: PathBuf,
        /// Longest side of the bounding box, in the file's unit.
        size: f64,
        /// In which unit, and who said so.
        unit: String,
    },
    /// The file that names the unit of the models does not name one.
    #[error("{reason} ({})", file.display())]
    UnitFile {
        /// The file.
        file: PathBuf,
        /// Text that was found, and texts that may stand there.
        reason: String,
    },
    /// No triangle with an area.
    #[error("the mesh has no triangle with an area ({} degenerate ones) ({})", dropped, file.display())]
    Empty {
        /// The file.
        file: PathBuf,
        /// Degenerate triangles found.
        dropped: usize,
    },
}

impl MeshError {
    /// The file it is about.
    pub fn file(&self) -> &Path {
        match self {
            Self::Io { file, .. }
            | Self::NotStl { file, .. }
            | Self::Truncated { file, .. }
            | Self::NotFinite { file, .. }
            | Self::Unit { file, .. }
            | Self::NotATool { file, .. }
            | Self::UnitFile { file, .. }
            | Self::Empty { file, .. } => file,
        }
    }

    /// Advice for the user.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Io { .. } => "check that the file exists and may be read",
            Self::NotStl { .. } => "export the part as STL from the CAD program",
            Self::Truncated { .. } => "copy or export the file again",
            Self::Unit { .. } => {
                "accept the scale with --tool-scale auto on the command line, or for good with `touch2touch unit` or the \
                 button at the 3D view: a file unit.txt beside the model says auto, m, cm, mm, um, in or a factor"
            }
            Self::NotATool { .. } => {
                "tools are 4 mm to 0.4 m long: name the right unit in unit.txt beside the model or with --tool-scale, or \
                 export the model again"
            }
            Self::UnitFile { .. } => "write m, cm, mm, um, in, auto or a factor to meters into the file",
            Self::NotFinite { .. } | Self::Empty { .. } => "repair the mesh in the CAD program and export it again",
        }
    }
}

/// A length of unknown unit for a message, however large.
fn number(size: f64) -> String {
    let size = touch2touch_core::units::significant(size);
    if (1e-4..1e6).contains(&size) { size.to_string() } else { format!("{size:e}") }
}

/// A mesh as read, with what was noticed.
#[derive(Clone, Debug, PartialEq)]
pub struct StlFile {
    /// The mesh in the file's own unit, which should be meters.
    pub mesh: TriMesh,
    /// Triangles left out because they have no area.
    pub degenerate: usize,
    /// The factor that would bring the mesh to meters, where its size says that it is in another unit.
    pub suggested_scale: Option<f64>,
}

/// Most bytes of a model: five million triangles. Welding takes about five times as much memory.
const MAX_BYTES: u64 = 256 << 20;
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads a binary or text STL.
///
/// Corners with the same coordinates become one vertex; triangles without area are dropped and counted.
///
/// # Errors
/// [`MeshError`].
pub fn read(path: &Path) -> Result<StlFile, MeshError> {
    let bytes =
        super::files::read(path, MAX_BYTES).map_err(|source| MeshError::Io { file: path.to_owned(), source })?;
    weld(path, corners(path, &bytes)?)
}

fn corners(path: &Path, bytes: &[u8]) -> Result<Vec<[[f32; 3]; 3]>, MeshError> {
    let not_stl = |reason: &str| MeshError::NotStl { file: path.to_owned(), reason: reason.into() };
    let count = bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let expected = |n: u32| HEADER as u64 + RECORD as u64 * u64::from(n);
    // Some binary files also start with "solid": the length decides.
    if let Some(n) = count.filter(|&n| expected(n) == bytes.len() as u64) {
        let mut out = Vec::with_capacity(n as usize);
        for record in bytes[HEADER..].chunks_exact(RECORD) {
            let value = |i: usize| {
                let at = 12 + 4 * i;
                f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
            };
            out.push(std::array::from_fn(|c| std::array::from_fn(|k| value(3 * c + k))));
        }
        return Ok(out);
    }
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(0);
    if bytes[start..].len() >= 5 && bytes[start..start + 5].eq_ignore_ascii_case(b"solid") {
        let text = std::str::from_utf8(bytes).map_err(|_| not_stl("it starts like a text STL but is not text"))?;
        return text_corners(text).map_err(|reason| not_stl(&reason));
    }
    match count {
        Some(n) => Err(MeshError::Truncated {
            file: path.to_owned(),
            triangles: n,
            expected: expected(n),
            found: bytes.len() as u64,
        }),
        None => Err(not_stl("the file is shorter than an STL header")),
    }
}

fn text_corners(text: &str) -> Result<Vec<[[f32; 3]; 3]>, String> {
    let mut out = Vec::new();
    let mut open: Vec<[f32; 3]> = Vec::with_capacity(3);
    let mut ended = false;
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                let mut corner = [0f32; 3];
                for value in &mut corner {
                    *value = words
                        .next()
                        .and_then(|w| w.parse().ok())
                        .ok_or_else(|| format!("line {} is not a corner", number + 1))?;
                }
                open.push(corner);
            }
            Some("endfacet") => {
                let triangle = <[[f32; 3]; 3]>::try_from(open.as_slice())
                    .map_err(|_| format!("the facet ending at line {} has {} corners", number + 1, open.len()))?;
                out.push(triangle);
                open.clear();
            }
            Some("endsolid") => ended = true,
            _ => {}
        }
    }
    if !ended || !open.is_empty() {
        return Err("the text ends before \"endsolid\"".into());
    }
    Ok(out)
}

fn weld(path: &Path, corners: Vec<[[f32; 3]; 3]>) -> Result<StlFile, MeshError> {
    let mut known: HashMap<[u32; 3], u32> = HashMap::with_capacity(corners.len());
    let mut mesh = TriMesh::default();
    let mut degenerate = 0;
    for (number, triangle) in corners.iter().enumerate() {
        if triangle.iter().flatten().any(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { file: path.to_owned(), triangle: number });
        }
        let points = triangle.map(|c| DVec3::new(f64::from(c[0]), f64::from(c[1]), f64::from(c[2])));
        if triangle_area(points) <= 0.0 {
            degenerate += 1;
            continue;
        }
        let mut indices = [0; 3];
        for (index, (corner, point)) in indices.iter_mut().zip(triangle.iter().zip(points)) {
            // Adding zero makes -0 and 0 the same corner.
            let key = corner.map(|v| (v + 0.0).to_bits());
            *index = *known.entry(key).or_insert_with(|| {
                mesh.vertices.push(point);
                (mesh.vertices.len() - 1) as u32
            });
        }
        mesh.triangles.push(indices);
    }
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty { file: path.to_owned(), dropped: degenerate });
    }
    let suggested_scale = suggested_scale(&mesh);
    Ok(StlFile { mesh, degenerate, suggested_scale })
}

/// The factor that brings a model to meters whose size says that it is in another unit.
fn suggested_scale(mesh: &TriMesh) -> Option<f64> {
    let [lo, hi] = mesh.bounds()?;
    touch2touch_core::units::scale_to_meters((hi - lo).max_element()).filter(|&scale| scale != 1.0)
}

/// Writes a binary STL; coordinates are rounded to 32 bits.
///
/// # Errors
/// [`MeshError::Io`] if the disk refuses.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<(), MeshError> {
    let mut out = vec![0u8; 80];
    // Not "solid", which would make some readers take the file for text.
    out[..11].copy_from_slice(b"touch2touch");
    out.extend((mesh.triangles.len() as u32).to_le_bytes());
    for index in 0..mesh.triangles.len() {
        let corners = mesh.corners(index);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize().unwrap_or_default();
        for point in std::iter::once(normal).chain(corners) {
            for value in point.to_array() {
                out.extend((value as f32).to_le_bytes());
            }
        }
        out.extend([0, 0]);
    }
    super::atomic::write_bytes(path, &out).map_err(|source| MeshError::Io { file: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron(scale: f64) -> TriMesh {
        let v = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(|p| DVec3::from_array(p) * scale);
        TriMesh { vertices: v.to_vec(), triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    #[test]
    fn binary_round_trip_is_watertight_and_knows_its_unit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        write(&path, &tetrahedron(0.03125)).unwrap();
        let back = read(&path).unwrap();
        assert!(back.mesh.is_watertight());
        assert_eq!((back.mesh.vertices.len(), back.degenerate, back.suggested_scale), (4, 0, None));
        assert!((back.mesh.area() - tetrahedron(0.03125).area()).abs() < 1e-12);
        write(&path, &tetrahedron(60.0)).unwrap();
        assert_eq!(read(&path).unwrap().suggested_scale, Some(1e-3));
        write(&path, &tetrahedron(60.0e-6)).unwrap();
        assert_eq!(read(&path).unwrap().suggested_scale, Some(1e3));
    }

    #[test]
    fn text_is_read_and_degenerate_triangles_are_counted() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        let facet = |c: &str| format!("facet normal 0 0 0\nouter loop\n{c}endloop\nendfacet\n");
        let good = facet("vertex 0 0 0\n vertex 1e-2 0 0\nvertex 0 1e-2 0\n");
        let flat = facet("vertex 0 0 0\nvertex 1 1 1\nvertex 2 2 2\n");
        std::fs::write(&path, format!("solid a\n{good}{flat}endsolid a\n")).unwrap();
        let file = read(&path).unwrap();
        assert_eq!((file.mesh.triangles.len(), file.degenerate), (1, 1));
        for (bad, word) in [
            (format!("solid a\n{good}"), "endsolid"),
            ("solid a\nfacet\nvertex 1 2\nendfacet\nendsolid".into(), "line 3"),
            ("solid a\nfacet\nvertex 1 2 3\nendfacet\nendsolid".into(), "1 corners"),
            (format!("solid a\n{flat}endsolid"), "no triangle"),
            ("solid a\nfacet\nvertex nan 2 3\nvertex 1 2 3\nvertex 2 2 3\nendfacet\nendsolid".into(), "not a number"),
            ("x".into(), "shorter"),
            (String::new(), "shorter"),
        ] {
            std::fs::write(&path, bad).unwrap();
            let text = read(&path).unwrap_err().to_string();
            assert!(text.contains(word) && text.contains("t.stl"), "{text}");
        }
    }

    #[test]
    fn a_cut_binary_file_says_how_much_is_missing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        write(&path, &tetrahedron(0.03)).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..200]).unwrap();
        assert!(matches!(read(&path), Err(MeshError::Truncated { triangles: 4, expected: 284, found: 200, .. })));
        assert!(matches!(read(&dir.path().join("no.stl")), Err(MeshError::Io { .. })));
    }
}
