//! STL meshes: binary and text, with equal corners welded so that edges can be followed.

mod other;
mod speck;

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::error::FileError;
use touch2touch_core::mesh::{TriMesh, triangle_area};

/// A length of unknown unit for a message, however large.
pub(super) fn number(size: f64) -> String {
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
    /// Faults of the file that it was read in spite of.
    pub mended: Vec<String>,
}

/// Most bytes of a model: five million triangles. Welding takes about five times as much memory.
const MAX_BYTES: u64 = 256 << 20;
const REPAIR: &str = "repair the mesh in the CAD program and export it again";
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads a binary or text STL.
///
/// Corners with the same coordinates become one vertex; triangles without area are dropped and counted; a speck far from the
/// rest is left out and named.
///
/// # Errors
/// [`FileError`].
pub fn read(path: &Path) -> Result<StlFile, FileError> {
    let bytes = super::files::read(path, MAX_BYTES).map_err(|err| cannot_access(path, err))?;
    let mut mended = Vec::new();
    let corners = corners(path, &bytes, &mut mended)?;
    let mut file = weld(path, corners)?;
    mended.extend(speck::leave_out(&mut file.mesh));
    Ok(StlFile { mended, ..file })
}

fn cannot_access(path: &Path, err: std::io::Error) -> FileError {
    FileError::io(path, "cannot access the mesh", err)
}

type Corners = Vec<[[f32; 3]; 3]>;

fn corners(path: &Path, bytes: &[u8], mended: &mut Vec<String>) -> Result<Corners, FileError> {
    let not_stl = |reason: String| {
        FileError::new(path, format!("not an STL mesh: {reason}"), "export the part as STL from the CAD program")
    };
    let count = bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let expected = |n: u32| HEADER as u64 + RECORD as u64 * u64::from(n);
    // Some binary files also start with "solid": the length decides.
    if let Some(n) = count.filter(|&n| expected(n) == bytes.len() as u64) {
        return Ok(records(bytes, n as usize));
    }
    // Text has no zero bytes, in whatever letters it is written; the numbers of a binary file do.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let solid = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    if solid && !text.iter().take(1024).any(|&byte| byte == 0) {
        return text_corners(&String::from_utf8_lossy(text), mended).map_err(not_stl);
    }
    if let Some(what) = other::named(bytes) {
        return Err(not_stl(what.into()));
    }
    let Some(n) = count else { return Err(not_stl("the file is shorter than an STL header".into())) };
    let (there, behind) = ((bytes.len() - HEADER) / RECORD, (bytes.len() - HEADER) % RECORD);
    let said = n as usize;
    let off_by_one = said.abs_diff(there) == 1 || said == 0;
    if behind == 0 && there > 0 && off_by_one {
        mended.push(format!("its head announces {said} triangles and {there} follow: all {there} are read"));
        return Ok(records(bytes, there));
    }
    // More behind the model than in it is no model with something behind it.
    let left = bytes.len() as u64 - expected(said.min(there) as u32);
    if said > 0 && said <= there && left < expected(n) {
        let s = if left == 1 { "" } else { "s" };
        mended.push(format!("{left} byte{s} behind the last triangle left out"));
        return Ok(records(bytes, said));
    }
    let what = format!("the mesh announces {n} triangles ({} bytes) but has {} bytes", expected(n), bytes.len());
    Err(FileError::new(path, what, "copy or export the file again"))
}

/// The triangles of a binary file that has so many.
fn records(bytes: &[u8], count: usize) -> Corners {
    let triangle = |record: &[u8]| {
        let value = |i: usize| {
            let at = 12 + 4 * i;
            f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
        };
        std::array::from_fn(|c| std::array::from_fn(|k| value(3 * c + k)))
    };
    bytes[HEADER..].chunks_exact(RECORD).take(count).map(triangle).collect()
}

fn text_corners(text: &str, mended: &mut Vec<String>) -> Result<Corners, String> {
    let mut out = Vec::new();
    let mut open: Vec<[f32; 3]> = Vec::with_capacity(3);
    let (mut in_facet, mut ended) = (false, false);
    // Old Macs ended lines with CR alone.
    let lines = text.split(if text.contains('\n') { '\n' } else { '\r' });
    for (number, line) in lines.enumerate() {
        let mut words = line.split_ascii_whitespace();
        let mut word = words.next().unwrap_or_default().to_ascii_lowercase();
        if word == "end" {
            word += &words.next().unwrap_or_default().to_ascii_lowercase();
        }
        match word.as_str() {
            "facet" => in_facet = true,
            "vertex" => {
                let mut corner = [0f32; 3];
                for value in &mut corner {
                    // Fortran writes 1.0D-02.
                    let number_of = |word: &str| word.replace(['d', 'D'], "e").parse().ok();
                    *value = words
                        .next()
                        .and_then(number_of)
                        .ok_or_else(|| format!("line {} is not a corner", number + 1))?;
                }
                open.push(corner);
            }
            "endfacet" => {
                let triangle = <[[f32; 3]; 3]>::try_from(open.as_slice())
                    .map_err(|_| format!("the facet ending at line {} has {} corners", number + 1, open.len()))?;
                out.push(triangle);
                open.clear();
                in_facet = false;
            }
            "endsolid" => ended = true,
            _ => {}
        }
    }
    if in_facet || !open.is_empty() {
        return Err("the text ends within a facet".into());
    }
    if !ended {
        mended.push("the text ends without \"endsolid\": its end may be missing".into());
    }
    Ok(out)
}

fn weld(path: &Path, corners: Vec<[[f32; 3]; 3]>) -> Result<StlFile, FileError> {
    let mut known: HashMap<[u32; 3], u32> = HashMap::with_capacity(corners.len());
    let mut mesh = TriMesh::default();
    let mut degenerate = 0;
    for (number, triangle) in corners.iter().enumerate() {
        if triangle.iter().flatten().any(|v| !v.is_finite()) {
            return Err(FileError::new(path, format!("triangle {number} has a corner that is not a number"), REPAIR));
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
        let what = format!("the mesh has no triangle with an area ({degenerate} degenerate ones)");
        return Err(FileError::new(path, what, REPAIR));
    }
    Ok(StlFile { mesh, degenerate, mended: Vec::new() })
}

/// Writes a binary STL; coordinates are rounded to 32 bits.
///
/// # Errors
/// [`FileError`] if the disk refuses.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<(), FileError> {
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
    super::atomic::write_bytes(path, &out).map_err(|err| cannot_access(path, err))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron(scale: f64) -> TriMesh {
        let v = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(|p| DVec3::from_array(p) * scale);
        TriMesh { vertices: v.to_vec(), triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    #[test]
    fn binary_round_trip_is_watertight() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        write(&path, &tetrahedron(0.03125)).unwrap();
        let back = read(&path).unwrap();
        assert!(back.mesh.is_watertight());
        assert_eq!((back.mesh.vertices.len(), back.degenerate), (4, 0));
        assert!((back.mesh.area() - tetrahedron(0.03125).area()).abs() < 1e-12);
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
            (format!("solid a\n{good}facet\nvertex 1 2 3\n"), "within a facet"),
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

    /// A binary file with this head, so many triangles announced, and bytes behind them.
    fn binary(head: &str, announced: u32, behind: &[u8]) -> Vec<u8> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        write(&path, &tetrahedron(0.03)).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[..head.len()].copy_from_slice(head.as_bytes());
        bytes[80..84].copy_from_slice(&announced.to_le_bytes());
        [&bytes, behind].concat()
    }

    /// The tetrahedron as text, with other words in the place of some.
    fn text(replace: &[(&str, &str)]) -> Vec<u8> {
        let mesh = tetrahedron(0.03);
        let facet = |index| {
            let corner = |c: DVec3| format!("vertex {:.5e} {:.5e} {:.5e}\n", c.x, c.y, c.z);
            let corners: String = mesh.corners(index).map(corner).concat();
            format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
        };
        let mut text = format!("solid bar\n{}endsolid bar\n", (0..4).map(facet).collect::<String>());
        for (from, to) in replace {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        text.into_bytes()
    }

    #[test]
    fn what_other_programs_write_is_read_and_what_was_mended_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        let far = |mesh: &TriMesh| {
            let mut out = mesh.clone();
            out.vertices.extend([[10., 10., 10.], [10.002, 10., 10.], [10., 10.002, 10.]].map(DVec3::from_array));
            out.triangles.push([4, 5, 6]);
            write(&path, &out).unwrap();
            std::fs::read(&path).unwrap()
        };
        let latin = [&text(&[])[..6], b"Schl\xfcssel \xb9\xa4\xbe\xdf", &text(&[])[9..]].concat();
        let files: [(&str, Vec<u8>, Option<&str>); 14] = [
            ("sound", binary("bar", 4, b""), None),
            ("one byte behind", binary("bar", 4, b"\0"), Some("1 byte behind")),
            ("two bytes behind", binary("bar", 4, b"\0\0"), Some("2 bytes behind")),
            ("solid in the head", binary("solid part", 4, b"\0"), Some("1 byte behind")),
            ("count of zero", binary("bar", 0, b""), Some("announces 0 triangles and 4 follow")),
            ("one too many", binary("bar", 5, b""), Some("announces 5")),
            ("one too few", binary("bar", 3, b""), Some("announces 3")),
            ("text", text(&[]), None),
            ("end solid", text(&[("endsolid", "end solid"), ("endfacet", "end facet")]), None),
            ("no end", text(&[("endsolid bar\n", "")]), Some("without \"endsolid\"")),
            ("CR alone", text(&[("\n", "\r")]), None),
            ("Fortran", text(&[("e-2", "D-02")]), None),
            ("other letters", latin, None),
            ("UTF-8 mark", [b"\xef\xbb\xbf", text(&[]).as_slice()].concat(), None),
        ];
        let sound = tetrahedron(0.03);
        for (what, bytes, note) in files {
            std::fs::write(&path, bytes).unwrap();
            let file = read(&path).unwrap_or_else(|err| panic!("{what}: {err}"));
            assert_eq!((file.mesh.triangles.len(), file.mesh.vertices.len()), (4, 4), "{what}");
            assert!((file.mesh.area() - sound.area()).abs() < 1e-7, "{what}");
            assert_eq!(file.mended.len(), usize::from(note.is_some()), "{what}: {:?}", file.mended);
            assert!(file.mended.iter().all(|said| said.contains(note.unwrap())), "{what}: {:?}", file.mended);
        }
        let speck = far(&sound);
        std::fs::write(&path, speck).unwrap();
        let file = read(&path).unwrap();
        assert_eq!((file.mesh.triangles.len(), file.mesh.vertices.len()), (4, 4));
        assert!(file.mended[0].contains("1 triangle") && file.mended[0].contains("left out"), "{:?}", file.mended);
    }

    #[test]
    fn a_file_of_another_kind_is_called_by_its_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.stl");
        let long = |head: &str| [head.as_bytes(), &b" \n# filler".repeat(60)].concat();
        for (bytes, word) in [
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 3\n".to_vec(), "git lfs pull"),
            (b"\x1f\x8b\x08\0\0\0\0\0".to_vec(), "gzip"),
            (long("<!DOCTYPE html><html>"), "web page"),
            (long("  <html>"), "web page"),
            (long("ply\nformat ascii 1.0"), "PLY"),
            (long("# Blender\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\n"), "OBJ"),
            (long("v 0 0 0\nv 1 0 0\nf 1 2 3"), "OBJ"),
            (b"PK\x03\x04\x14\0".to_vec(), "zip"),
            (long("ISO-10303-21;\nHEADER;"), "STEP"),
        ] {
            std::fs::write(&path, &bytes).unwrap();
            let error = read(&path).unwrap_err();
            let said = error.to_string();
            assert!(said.contains("not an STL mesh") && said.contains(word) && said.contains("t.stl"), "{said}");
        }
    }
}
