//! [`contact_loss`]: how far logits of contact are from a contact mask.

use crate::tape::Tensor;

/// Cross-entropy + (1 − Dice) of logits `[n, 2, h, w]` (no contact, contact) against masks `[n, h, w]` of 0 and 1, each
/// picture by its weight.
///
/// `counted` has 1 for each pixel that counts and 0 for one that is left out of everything. The cross-entropy is the mean
/// over the pixels that count; the Dice of a picture without contact is told by adding 1 to both of its sides. A picture
/// of which no pixel counts adds nothing.
pub(crate) fn contact_loss(logits: &Tensor, masks: &[f32], counted: &[f32], weights: &[f32]) -> Tensor {
    let [n, classes, h, w] = logits.dims();
    let pixels = h * w;
    assert_eq!((classes, masks.len(), counted.len(), weights.len()), (2, n * pixels, n * pixels, n));
    let mut loss = 0.0;
    let mut slope = Vec::with_capacity(logits.values().len());
    let pictures = logits.values().chunks_exact(2 * pixels).zip(weights);
    let truths = masks.chunks_exact(pixels).zip(counted.chunks_exact(pixels));
    for ((logits, &weight), (mask, counted)) in pictures.zip(truths) {
        let (value, along) = of_picture(logits, mask, counted);
        loss += f64::from(weight) * value;
        // The softmax of two depends on their difference alone.
        slope.extend(along.iter().map(|v| -v * weight));
        slope.extend(along.iter().map(|v| v * weight));
    }
    Tensor::made([logits], &[1], vec![loss as f32], move |outer, [to_logits], slopes| {
        slopes.add(to_logits, || slope.iter().map(|v| v * outer[0]).collect());
    })
}

/// The loss of a picture, and its slope along the difference of the two logits of each pixel.
fn of_picture(logits: &[f32], mask: &[f32], counted: &[f32]) -> (f64, Vec<f32>) {
    let (no, yes) = logits.split_at(mask.len());
    let count: f64 = counted.iter().map(|&c| f64::from(c)).sum();
    if count == 0.0 {
        return (0.0, vec![0.0; mask.len()]);
    }
    let (mut cross, mut both, mut sides) = (0.0, 0.0, 0.0);
    let mut probabilities = Vec::with_capacity(mask.len());
    for (((no, yes), &mask), &counted) in no.iter().zip(yes).zip(mask).zip(counted) {
        let difference = f64::from(yes - no);
        let probability = 1.0 / (1.0 + (-difference).exp());
        let (mask, counted) = (f64::from(mask), f64::from(counted));
        // -log p of the right class, without an overflow: softplus of minus its lead.
        let lead = if mask > 0.5 { difference } else { -difference };
        cross += counted * ((-lead).max(0.0) + (-lead.abs()).exp().ln_1p());
        both += counted * probability * mask;
        sides += counted * (probability + mask);
        probabilities.push(probability);
    }
    let (above, below) = (2.0 * both + 1.0, sides + 1.0);
    let slope = |((p, &mask), &counted): ((f64, &f32), &f32)| {
        let (mask, counted) = (f64::from(mask), f64::from(counted));
        let of_cross = (p - mask) / count;
        let of_dice = -(2.0 * mask * below - above) / (below * below) * p * (1.0 - p);
        (counted * (of_cross + of_dice)) as f32
    };
    let along = probabilities.into_iter().zip(mask).zip(counted).map(slope).collect();
    (cross / count + 1.0 - above / below, along)
}
