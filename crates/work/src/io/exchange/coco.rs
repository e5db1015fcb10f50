//! COCO: `annotations/PART.json` with images, categories and run lengths, and the images in `PART/`.
//!
//! An image without contact has no annotation, as COCO has it. That such an image was looked at all the same, and which pair
//! and finger it is of, is said under a key of our own ([`Of`]).
//!
//! `iscrowd` 0 is the mask. Some programs write 1 beside every run-length mask, because COCO's own data has run lengths for
//! crowds only, and loaders for training leave out what has 1. So the mask has 0, and the ignored pixels, which are to be left
//! out, have 1 and a category of their own; what is read is told by the category alone.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::format::{Place, Writer, write_image};
use super::found::{Coded, Listed, Listing, ReadError, Stored};
use super::unet::image_from_imprint;
use super::{Content, ExportError, ExportReport, PARTS, io};
use crate::io::{atomic, files, images};
use touch2touch_core::grid::Mask;
use touch2touch_core::label::{coco_runs, coco_runs_of, coco_text};

/// The folder of the annotations.
pub(super) const ANNOTATIONS: &str = "annotations";
const CONTACT: &str = "contact";
const IGNORE: &str = "ignore";

/// Pair and finger that an image is of.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Of {
    pair: String,
    finger: String,
}

/// Writes them.
#[derive(Default)]
pub(super) struct Annotations {
    /// Images and annotations of each part.
    parts: [(Vec<Value>, Vec<Value>); 3],
    /// Numbers given last, to an image and to an annotation, from 1: pycocotools takes an annotation 0 for none.
    last: [u64; 2],
}

impl Writer for Annotations {
    fn folders(&self) -> Vec<String> {
        PARTS.iter().chain(&[ANNOTATIONS]).map(|&folder| folder.to_owned()).collect()
    }

    fn add(&mut self, to: &Place<'_>, content: &Content, report: &mut ExportReport) -> Result<(), ExportError> {
        let name = format!("{}.png", to.stem);
        let picture = image_from_imprint(&content.imprint, report);
        write_image(&to.root.join(PARTS[to.part]).join(&name), &picture)?;
        let (images, annotations) = &mut self.parts[to.part];
        self.last[0] += 1;
        let of = Of { pair: to.pair.to_owned(), finger: to.finger.to_owned() };
        images.push(json!({
            "id": self.last[0], "file_name": name, "width": picture.width(), "height": picture.height(), "touch2touch": of,
        }));
        for (category, mask) in [(1, Some(&content.mask)), (2, content.ignored.as_ref())] {
            let Some((mask, bbox)) = mask.and_then(|mask| Some((mask, bounds(mask)?))) else { continue };
            self.last[1] += 1;
            annotations.push(json!({
                "id": self.last[1], "image_id": self.last[0], "category_id": category, "iscrowd": category - 1,
                "segmentation": {"size": [mask.height(), mask.width()], "counts": coco_text(&coco_runs(mask))},
                "area": mask.as_slice().iter().filter(|v| **v).count(), "bbox": bbox,
            }));
        }
        Ok(())
    }

    fn finish(&mut self, root: &Path) -> Result<(), ExportError> {
        for (part, (images, annotations)) in PARTS.iter().zip(&self.parts) {
            let file = root.join(ANNOTATIONS).join(format!("{part}.json"));
            let content = json!({
                "info": {"description": "Contact masks of imprints, raw orientation"},
                "images": images,
                "categories": [
                    {"id": 1, "name": CONTACT, "supercategory": "touch"},
                    {"id": 2, "name": IGNORE, "supercategory": "touch"},
                ],
                "annotations": annotations,
            });
            atomic::write_bytes(&file, content.to_string().as_bytes()).map_err(|source| io(&file, "write", source))?;
        }
        Ok(())
    }
}

/// The rectangle of the pixels that are set, `[x, y, width, height]`; `None` where none is.
fn bounds(mask: &Mask) -> Option<[usize; 4]> {
    let on = |x: usize, y: usize| mask[(x, y)];
    let (width, height) = (mask.width(), mask.height());
    let column = |x: &usize| (0..height).any(|y| on(*x, y));
    let row = |y: &usize| (0..width).any(|x| on(x, *y));
    let (left, right) = ((0..width).find(column)?, (0..width).rfind(column)?);
    let (top, bottom) = ((0..height).find(row)?, (0..height).rfind(row)?);
    Some([left, top, right - left + 1, bottom - top + 1])
}

#[derive(Deserialize)]
struct File {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    file_name: String,
    width: usize,
    height: usize,
    #[serde(default)]
    touch2touch: Option<Of>,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    category_id: u64,
    segmentation: Segmentation,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Segmentation {
    Runs {
        /// Rows and columns.
        size: [usize; 2],
        counts: Counts,
    },
    Other(serde::de::IgnoredAny),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Counts {
    Text(String),
    Runs(Vec<u32>),
}

/// The masks of an annotations file. An image of another program without an annotation is one that nobody labeled.
pub(super) fn read(file: &Path, listing: &mut Listing) -> Result<(), ReadError> {
    let bad = |what: String| ReadError::new(file, what, "name a COCO annotations file with run lengths");
    let bytes = files::read(file, files::SMALL).map_err(|err| bad(format!("cannot be read: {err}")))?;
    let content: File = serde_json::from_slice(&bytes).map_err(|err| bad(format!("no COCO annotations: {err}")))?;
    let named = |name: &str| content.categories.iter().filter(|c| c.name == name).map(|c| c.id).collect::<Vec<_>>();
    let (contact, ignore) = (named(CONTACT), named(IGNORE));
    let others = content.categories.iter().filter(|c| c.name != CONTACT && c.name != IGNORE).count();
    if contact.is_empty() && others > 1 {
        return Err(bad(format!("none of its {} categories is called \"{CONTACT}\"", content.categories.len())));
    }
    let mut coded: BTreeMap<u64, Coded> = content
        .images
        .iter()
        .map(|image| (image.id, Coded { size: [image.width, image.height], contact: Vec::new(), ignored: Vec::new() }))
        .collect();
    let mut wrong: BTreeMap<u64, String> = BTreeMap::new();
    for annotation in &content.annotations {
        let (id, category) = (annotation.image_id, annotation.category_id);
        let Some(of) = coded.get_mut(&id) else {
            return Err(bad(format!("an annotation is of image {id}, which it does not list")));
        };
        let to = if ignore.contains(&category) {
            &mut of.ignored
        } else if contact.is_empty() || contact.contains(&category) {
            &mut of.contact
        } else {
            continue;
        };
        match &annotation.segmentation {
            Segmentation::Runs { size: [rows, columns], .. } if [*columns, *rows] != of.size => {
                let [width, height] = of.size;
                wrong.insert(id, format!("a mask has {columns} x {rows} pixels, its image {width} x {height}"));
            }
            Segmentation::Runs { counts: Counts::Runs(runs), .. } => to.push(runs.clone()),
            Segmentation::Runs { counts: Counts::Text(text), .. } => match coco_runs_of(text) {
                Some(runs) => to.push(runs),
                None => {
                    wrong.insert(id, "its run lengths are not understood".into());
                }
            },
            Segmentation::Other(_) => {
                wrong.insert(id, "a mask is no run lengths (polygons are not read)".into());
            }
        }
    }
    for image in content.images {
        let name = PathBuf::from(&image.file_name);
        let stem = name.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        if image.width.max(image.height) > images::MAX_SIDE as usize {
            wrong.insert(image.id, format!("{} x {} pixels are more than are read", image.width, image.height));
        }
        if let Some(why) = wrong.remove(&image.id) {
            listing.refused.push(bad(format!("{}: {why}", image.file_name)));
            continue;
        }
        let Some(coded) = coded.remove(&image.id) else { continue };
        if image.touch2touch.is_none() && coded.contact.is_empty() && coded.ignored.is_empty() {
            continue;
        }
        let of = image.touch2touch.map(|of| (of.pair, of.finger));
        listing.masks.push(Listed { stem, file: file.to_owned(), of, stored: Stored::Coded(coded) });
    }
    Ok(())
}
