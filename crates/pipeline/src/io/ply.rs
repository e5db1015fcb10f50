//! Point clouds as PLY files: binary, little endian, one vertex per point.

use std::path::Path;

use glam::DVec3;

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlyPoint {
    /// Meters.
    pub at: DVec3,
    /// True for a contact point.
    pub contact: bool,
    /// The finger, in the order of the rig's pads.
    pub finger: u8,
    /// The pixel of its imprint, column and row.
    pub pixel: [u16; 2],
    /// Signed distance to the model, meters; NaN where there is none.
    pub distance: f32,
}

/// Writes a cloud; `comments` say what its frame and units are, a line each.
///
/// # Errors
/// Whatever the disk says.
pub fn write(path: &Path, points: &[PlyPoint], comments: &[String]) -> std::io::Result<()> {
    let mut out = String::from("ply\nformat binary_little_endian 1.0\n");
    for comment in comments {
        // One line of plain letters, whatever a file was called.
        let plain: String = comment.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect();
        out += &format!("comment {plain}\n");
    }
    out += &format!("element vertex {}\n", points.len());
    for property in [
        "double x",
        "double y",
        "double z",
        "uchar contact",
        "uchar finger",
        "ushort pixel_x",
        "ushort pixel_y",
        "float distance_to_model",
    ] {
        out += &format!("property {property}\n");
    }
    out += "end_header\n";
    let mut bytes = out.into_bytes();
    bytes.reserve(points.len() * 34);
    for point in points {
        point.at.to_array().iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([u8::from(point.contact), point.finger]);
        point.pixel.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend(point.distance.to_le_bytes());
    }
    super::atomic::write_bytes(path, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads what the header announces, property by property.
    fn read(bytes: &[u8]) -> (Vec<String>, Vec<PlyPoint>) {
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let header: Vec<String> = std::str::from_utf8(&bytes[..at]).unwrap().lines().map(str::to_owned).collect();
        let count: usize = header.iter().find_map(|l| l.strip_prefix("element vertex ")).unwrap().parse().unwrap();
        let size = |line: &String| match line.split(' ').nth(1) {
            Some("double") => 8,
            Some("float") => 4,
            Some("ushort") => 2,
            _ => 1,
        };
        let width: usize = header.iter().filter(|l| l.starts_with("property ")).map(size).sum();
        assert_eq!(bytes.len() - at, count * width, "the header announces what follows");
        let point = |row: &[u8]| PlyPoint {
            at: DVec3::from_array([0, 8, 16].map(|i| f64::from_le_bytes(row[i..i + 8].try_into().unwrap()))),
            contact: row[24] == 1,
            finger: row[25],
            pixel: [26, 28].map(|i| u16::from_le_bytes(row[i..i + 2].try_into().unwrap())),
            distance: f32::from_le_bytes(row[30..34].try_into().unwrap()),
        };
        (header, bytes[at..].chunks(width).map(point).collect())
    }

    #[test]
    fn points_come_back_bit_for_bit() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let points: Vec<PlyPoint> = (0..50u16)
            .map(|i| PlyPoint {
                at: DVec3::new(0.1 / f64::from(i + 1), -1e-3 * f64::from(i), 0.3),
                contact: i % 3 == 0,
                finger: (i % 2) as u8,
                pixel: [i, 300 - i],
                distance: 1e-4 * f32::from(i),
            })
            .collect();
        write(file.path(), &points, &["frame: grasp".into(), "pair a\nend_header\tü".into()]).unwrap();
        let (header, back) = read(&std::fs::read(file.path()).unwrap());
        assert_eq!(back, points);
        assert_eq!(
            header[1..4],
            ["format binary_little_endian 1.0", "comment frame: grasp", "comment pair a?end_header??"]
        );
        write(file.path(), &[], &[]).unwrap();
        assert!(read(&std::fs::read(file.path()).unwrap()).1.is_empty());
    }
}
