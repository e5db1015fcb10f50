//! The mask network: [`segment`], a UNet of convolutions and ReLU with three levels down.
//!
//! It is that of `training/models.py`, with each batch normalization folded into the convolution before it, as the
//! exporter does.

use super::layers::Layers;
use super::layout::Layout;
use crate::error::{Error, Result};
use crate::onnx::Onnx;
use crate::ops::{self, Margins};
use crate::params::{Leaves, Params};
use crate::tape::Tensor;

/// In front of the names of the mask network's weights.
pub(crate) const MASK: &str = "mask/";

pub(crate) const NETWORK: &str = "mask network";
const LEVELS: usize = 4;
/// Classes of a pixel: no contact, contact.
const CLASSES: usize = 2;
/// Value that is subtracted from the imprint, which is 0..1.
const MIDDLE: f32 = 0.5;

/// Reads the network's weights; its widths may be others than those of the shipped one.
///
/// # Errors
/// If it is of another architecture.
pub fn read(file: &Onnx) -> Result<Params> {
    let weights = file.weights().iter();
    let first = weights.map(|weight| (weight.name(), weight.shape())).find(|(name, _)| *name == "out.weight");
    let missing = || Error::Missing { network: NETWORK, weight: "out.weight".to_owned() };
    let width = first.and_then(|(_, shape)| shape.get(1).copied()).ok_or_else(missing)?;
    let mut params = Params::default();
    layout(width).read(NETWORK, MASK, file, &mut params)?;
    Ok(params)
}

pub(crate) fn layout(width: usize) -> Layout {
    let mut l = Layout::default();
    let widths: [usize; LEVELS] = std::array::from_fn(|level| width << level);
    for level in 0..LEVELS {
        let inputs = if level == 0 { 1 } else { widths[level - 1] };
        l.conv(&format!("down.{level}.0"), inputs, widths[level], 3);
        l.conv(&format!("down.{level}.3"), widths[level], widths[level], 3);
    }
    for level in 0..LEVELS - 1 {
        l.conv(&format!("lift.{level}"), widths[level + 1], widths[level], 1);
        l.conv(&format!("up.{level}.0"), 2 * widths[level], widths[level], 3);
        l.conv(&format!("up.{level}.3"), widths[level], widths[level], 3);
    }
    l.conv("out", width, CLASSES, 1);
    l
}

/// Imprints `[n, 1, rows, columns]` in 0..1 to logits `[n, 2, rows, columns]`: no contact, contact.
pub fn segment(leaves: &Leaves<'_>, imprints: &Tensor) -> Tensor {
    let l = Layers::new(leaves, MASK);
    let [.., rows, columns] = imprints.dims::<4>();
    let margins = Margins::to_multiples(rows, columns, 1 << (LEVELS - 1));
    let mut x = ops::padded(&ops::line(imprints, 1.0, -MIDDLE), margins);
    let mut skipped = Vec::new();
    for level in 0..LEVELS {
        if level > 0 {
            x = ops::halved(&x);
        }
        x = twice(&l, &x, &format!("down.{level}"));
        skipped.push(x.clone());
    }
    for level in (0..LEVELS - 1).rev() {
        let lifted = ops::doubled(&l.conv(&x, &format!("lift.{level}"), 1, 0));
        x = twice(&l, &ops::beside(&lifted, &skipped[level]), &format!("up.{level}"));
    }
    ops::cropped(&l.conv(&x, "out", 1, 0), margins)
}

/// Convolution and ReLU, twice.
fn twice(l: &Layers<'_>, x: &Tensor, name: &str) -> Tensor {
    let x = ops::relu(&l.conv(x, &format!("{name}.0"), 1, 1));
    ops::relu(&l.conv(&x, &format!("{name}.3"), 1, 1))
}

#[cfg(test)]
mod tests {
    use rten::{Model, ValueOrView, ValueView};

    use super::*;
    use crate::fixture;

    const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/models/mask_unet/mask_unet.onnx");

    #[test]
    fn the_network_equals_the_shipped_graph() {
        let bytes = std::fs::read(SHIPPED).unwrap();
        let params = read(&Onnx::parse(bytes.clone()).unwrap()).unwrap();
        let imprints: Vec<f32> = fixture::random(1).normals(2 * 140 * 175).iter().map(|v| 0.5 + 0.2 * v).collect();
        let logits = segment(&params.leaves(|_| false), &Tensor::new(&[2, 1, 140, 175], imprints.clone()));
        assert_eq!(logits.shape(), [2, 2, 140, 175]);

        let model = Model::load(bytes).unwrap();
        let input: ValueOrView<'_> = ValueView::from_shape(&[2, 1, 140, 175], &imprints).unwrap().into();
        let (input_id, output_id) = (model.input_ids()[0], model.output_ids()[0]);
        let expected = model.run(vec![(input_id, input)], &[output_id], None).unwrap().remove(0);
        let expected = expected.into_tensor::<f32>().unwrap().into_data();
        let worst = logits.values().iter().zip(&expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-4, "{worst}");
    }

    #[test]
    fn other_widths_are_read_and_other_networks_refused() {
        let narrow = Onnx::parse(fixture::file(&layout(2), 1)).unwrap();
        let params = read(&narrow).unwrap();
        let logits = segment(&params.leaves(|_| false), &Tensor::new(&[1, 1, 9, 14], vec![0.5; 126]));
        assert_eq!(logits.shape(), [1, 2, 9, 14]);
        let decoder = Onnx::parse(fixture::start().decoder).unwrap();
        assert!(matches!(read(&decoder), Err(Error::Missing { network: NETWORK, .. })));
    }
}
