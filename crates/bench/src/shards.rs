//! Shards of training data as `training/data.py` reads them: a folder of `.npy` files, and `done.json` last of all.

use std::fs::File;
use std::io::{self, BufWriter, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use serde_json::Value;

use touch2touch_core::grid::{DepthMap, Mask, RgbGrid};
use touch2touch_pipeline::io::{atomic, files};

/// Side of the GelSlim image, pixels.
pub(crate) const GELSLIM_SIDE: usize = 128;
/// Steps per gray level in which its difference is stored.
const STEPS_PER_LEVEL: f32 = 64.0;
/// Numbers per touch beside the images.
const META: usize = 8;
/// Length of a `.npy` header with any shape.
const HEADER: usize = 128;
/// Contact that nobody knows.
const UNKNOWN: u8 = 255;
/// File that is written when a shard is complete.
const DONE: &str = "done.json";
const FILES: [&str; 5] = ["gelslim.npy", "imprint.npy", "clean.npy", "contact.npy", "meta.npy"];

/// One touch of one pad.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Record {
    /// The difference image in gray levels, [`GELSLIM_SIDE`] pixels wide and high.
    pub gelslim: RgbGrid,
    /// The measured imprint, meters, raw orientation; not a number where nothing was measured.
    pub imprint: DepthMap,
    /// Imprint that a network should draw: the measured one without noise where that is known, and without holes.
    pub clean: DepthMap,
    /// Contact of the membrane with the tool, where that is known.
    pub contact: Option<Mask>,
    /// Number of the grasp.
    pub grasp: u32,
    /// Number of the pad.
    pub pad: usize,
    /// Angle (radians), y and z (meters) of the tool in the hand, where known.
    pub pose: Option<[f64; 3]>,
    /// The tool's place in the catalog.
    pub tool: Option<usize>,
    /// Whose touch it is.
    pub origin: Origin,
    /// True for a tool that nothing is trained on.
    pub unseen: bool,
}

/// Whose touch it is: it decides how much the trainer varies the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// Sensors that were drawn.
    Drawn,
    /// The simulator's nominal sensors.
    Nominal,
    /// Sensors that were drawn, their bubbles pressed to any depth: for contact masks only.
    AnyDepth,
    /// Real ones.
    Measured,
}

/// A shard that is being written.
#[derive(Debug)]
pub(crate) struct ShardWriter {
    folder: PathBuf,
    /// `[width, height]` of imprints.
    size: [usize; 2],
    files: Vec<BufWriter<File>>,
    touches: usize,
    finished: bool,
}

impl Drop for ShardWriter {
    /// Removes the files of a shard that was not finished: they are of no use to anybody.
    fn drop(&mut self) {
        if self.finished {
            return;
        }
        self.files.clear();
        for name in FILES {
            std::fs::remove_file(self.folder.join(name)).ok();
        }
        // Only if nothing else lies there.
        std::fs::remove_dir(&self.folder).ok();
    }
}

impl ShardWriter {
    /// Begins a shard of imprints of this size; what an earlier run left unfinished there is replaced. Unless it is finished,
    /// nothing of it stays.
    ///
    /// # Errors
    /// Whatever the disk says.
    pub(crate) fn create(folder: &Path, size: [usize; 2]) -> io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        let mut shard = Self { folder: folder.to_owned(), size, files: Vec::new(), touches: 0, finished: false };
        for name in FILES {
            let mut file = BufWriter::new(File::create(folder.join(name))?);
            file.write_all(&[0; HEADER])?;
            shard.files.push(file);
        }
        Ok(shard)
    }

    /// Adds a touch.
    ///
    /// # Errors
    /// Whatever the disk says, or if an image has another size.
    pub(crate) fn push(&mut self, record: &Record) -> io::Result<()> {
        let sizes = [record.imprint.size(), record.clean.size(), record.contact.as_ref().map_or(self.size, Mask::size)];
        if record.gelslim.size() != [GELSLIM_SIDE; 2] || sizes != [self.size; 3] {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "an image has another size"));
        }
        let [gelslim, imprint, clean, contact, meta] = self.files.as_mut_slice() else { return Ok(()) };
        let pixels = record.gelslim.as_slice();
        let planes = (0..3).flat_map(|c| pixels.iter().map(move |p| (p[c] * STEPS_PER_LEVEL).round() as i16));
        write_i16(gelslim, planes)?;
        write_i16(imprint, micrometers(&record.imprint))?;
        write_i16(clean, micrometers(&record.clean))?;
        match &record.contact {
            Some(mask) => contact.write_all(&mask.as_slice().iter().map(|&on| u8::from(on)).collect::<Vec<_>>())?,
            None => contact.write_all(&vec![UNKNOWN; self.size[0] * self.size[1]])?,
        }
        let [angle, y, z] = record.pose.unwrap_or([f64::NAN; 3]).map(|v| v as f32);
        let origin = match record.origin {
            Origin::Drawn => 0.0,
            Origin::Nominal => 1.0,
            Origin::AnyDepth => 2.0,
            Origin::Measured => 3.0,
        };
        let tool = record.tool.map_or(-1.0, |tool| tool as f32);
        let numbers: [f32; META] =
            [record.grasp as f32, record.pad as f32, angle, y, z, tool, origin, f32::from(u8::from(record.unseen))];
        numbers.iter().try_for_each(|v| meta.write_all(&v.to_le_bytes()))?;
        self.touches += 1;
        Ok(())
    }

    /// Touches so far.
    pub(crate) fn touches(&self) -> usize {
        self.touches
    }

    /// Completes the shard: headers, everything on the disk, and `done.json` with what is to be said about it.
    ///
    /// # Errors
    /// Whatever the disk says.
    pub(crate) fn finish(mut self, about: &Value) -> io::Result<()> {
        let (n, [width, height]) = (self.touches, self.size);
        let shapes = [
            ("<i2", vec![n, 3, GELSLIM_SIDE, GELSLIM_SIDE]),
            ("<i2", vec![n, height, width]),
            ("<i2", vec![n, height, width]),
            ("|u1", vec![n, height, width]),
            ("<f4", vec![n, META]),
        ];
        for (file, (kind, shape)) in self.files.iter_mut().zip(shapes) {
            file.seek(SeekFrom::Start(0))?;
            file.write_all(&header(kind, &shape))?;
            file.flush()?;
            file.get_ref().sync_all()?;
        }
        atomic::write_bytes(&self.folder.join(DONE), about.to_string().as_bytes())?;
        self.finished = true;
        Ok(())
    }
}

/// Description of a complete shard; `None` where there is none, or one that was not finished.
pub(crate) fn about(folder: &Path) -> Option<Value> {
    serde_json::from_slice(&files::read(&folder.join(DONE), files::SMALL).ok()?).ok()
}

fn write_i16(to: &mut impl io::Write, values: impl Iterator<Item = i16>) -> io::Result<()> {
    to.write_all(&values.flat_map(i16::to_le_bytes).collect::<Vec<u8>>())
}

/// Meters to whole micrometers; `i16::MIN` is no measurement.
fn micrometers(depth: &DepthMap) -> impl Iterator<Item = i16> + '_ {
    let of = |z: &f32| if z.is_finite() { (z * 1e6).round().clamp(-32767.0, 32767.0) as i16 } else { i16::MIN };
    depth.as_slice().iter().map(of)
}

/// Version 1.0 of numpy's format, C order, padded to [`HEADER`] bytes.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", shape.join(", "));
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(((HEADER - 10) as u16).to_le_bytes());
    bytes.extend(format!("{text:<width$}\n", width = HEADER - 11).into_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::grid::Grid;

    #[test]
    fn a_shard_says_what_was_felt_and_is_there_only_when_it_is_complete() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("own-0001");
        let imprint = Grid::from_fn(4, 3, |x, y| if x == 0 { f32::NAN } else { (x + 10 * y) as f32 * 1e-4 });
        let record = Record {
            gelslim: Grid::filled(GELSLIM_SIDE, GELSLIM_SIDE, [1.0, -2.0, 0.5]),
            clean: imprint.map(|v| if v.is_nan() { 0.0 } else { *v }),
            imprint,
            contact: None,
            grasp: 5,
            pad: 1,
            pose: None,
            tool: Some(2),
            origin: Origin::Measured,
            unseen: false,
        };
        let mut writer = ShardWriter::create(&folder, [4, 3]).unwrap();
        writer.push(&record).unwrap();
        assert!(about(&folder).is_none());
        let on = Some(Grid::from_fn(4, 3, |x, _| x == 2));
        writer.push(&Record { contact: on, pose: Some([0.1, 0.002, 0.0]), ..record.clone() }).unwrap();
        let small = Record { imprint: Grid::filled(3, 3, 0.0), ..record };
        assert!(writer.push(&small).is_err() && writer.touches() == 2);
        writer.finish(&serde_json::json!({"touches": 2})).unwrap();
        assert_eq!(about(&folder).unwrap()["touches"], 2);
        // Read back as numpy would.
        for name in FILES {
            let bytes = std::fs::read(folder.join(name)).unwrap();
            assert_eq!((&bytes[..6], bytes[HEADER - 1]), (&b"\x93NUMPY"[..], b'\n'), "{name}");
        }
        let read =
            |name: &str, at: usize, n: usize| std::fs::read(folder.join(name)).unwrap()[HEADER + at..][..n].to_vec();
        assert_eq!(read("imprint.npy", 0, 4), [0, 0x80, 100, 0], "no measurement, then 100 micrometers");
        assert_eq!((read("contact.npy", 0, 1), read("contact.npy", 12, 4)), (vec![255], vec![0, 0, 1, 0]));
        assert_eq!(read("gelslim.npy", 0, 2), 64i16.to_le_bytes());
        assert_eq!(read("meta.npy", 24, 4), 3f32.to_le_bytes());
    }
}
