//! [`placed`]: a drawn picture as a pad's sensor sees it: through a line, moved, with a field on top.

use crate::image::{Tap, across, shifted, taps};
use crate::tape::Tensor;

/// Pictures `[n, side, side]` through the line `[2]` (factor and offset), moved by their pad's shift (of `[pads, 2]`, rows
/// and columns, pixels; interpolated linearly, the border repeated), plus their pad's field (of `[pads, side · side]`).
/// A picture without a pad stays as it is.
pub fn placed(drawn: &Tensor, line: &Tensor, shifts: &Tensor, fields: &Tensor, pads: &[Option<usize>]) -> Tensor {
    let [_, side, _] = drawn.dims();
    let pixels = side * side;
    let mut values = drawn.values().to_vec();
    for (seen, pad) in values.chunks_exact_mut(pixels).zip(pads) {
        let Some(pad) = *pad else { continue };
        let shift = [0, 1].map(|axis| f64::from(shifts.values()[2 * pad + axis]));
        let lined: Vec<f32> = seen.iter().map(|v| v * line.values()[0] + line.values()[1]).collect();
        let moved = shifted(&lined, side, shift);
        let field = &fields.values()[pad * pixels..][..pixels];
        seen.iter_mut().zip(moved).zip(field).for_each(|((seen, moved), field)| *seen = moved + field);
    }
    let (of_drawn, of_line, of_shifts) = (drawn.shared(), line.shared(), shifts.shared());
    let pads = pads.to_vec();
    let sizes = [shifts.values().len(), fields.values().len()];
    let inputs = [drawn, line, shifts, fields];
    Tensor::made(inputs, drawn.shape(), values, move |slope, [to_drawn, to_line, to_shifts, to_fields], slopes| {
        let mut input_slopes =
            InputSlopes { drawn: slope, line: [0.0; 2], shifts: vec![0.0; sizes[0]], fields: vec![0.0; sizes[1]] };
        for (item, pad) in pads.iter().enumerate() {
            if let Some(pad) = *pad {
                let range = item * pixels..(item + 1) * pixels;
                input_slopes.follow(range.clone(), &of_drawn[range], &of_line, &Place::new(side, &of_shifts, pad), pad);
            }
        }
        slopes.add(to_drawn, || input_slopes.drawn);
        slopes.add(to_line, || input_slopes.line.iter().map(|&v| v as f32).collect());
        slopes.add(to_shifts, || input_slopes.shifts);
        slopes.add(to_fields, || input_slopes.fields);
    })
}

/// Taps that each row and column reads with.
struct Place {
    side: usize,
    rows: Vec<Tap>,
    columns: Vec<Tap>,
}

impl Place {
    fn new(side: usize, shifts: &[f32], pad: usize) -> Self {
        let taps = |axis: usize| taps(side, f64::from(shifts[2 * pad + axis]));
        Self { side, rows: taps(0), columns: taps(1) }
    }
}

/// Slopes along the inputs; that along the drawn pictures begins as the one along the result.
struct InputSlopes {
    drawn: Vec<f32>,
    line: [f64; 2],
    shifts: Vec<f32>,
    fields: Vec<f32>,
}

impl InputSlopes {
    /// Takes one picture's slope back.
    fn follow(&mut self, range: std::ops::Range<usize>, drawn: &[f32], line: &[f32], place: &Place, pad: usize) {
        let side = place.side;
        let slope = &mut self.drawn[range];
        let field = &mut self.fields[pad * side * side..][..side * side];
        field.iter_mut().zip(slope.iter()).for_each(|(field, slope)| *field += slope);

        let lined: Vec<f32> = drawn.iter().map(|v| v * line[0] + line[1]).collect();
        let across = across(&lined, &place.columns);
        // Moving on by a shift reads further back: hence the minus.
        let mut along_across = vec![0.0; slope.len()];
        let mut down = 0.0f64;
        for (tap, slope) in place.rows.iter().zip(slope.chunks_exact(side)) {
            let (upper, lower) = across[tap.low * side..][..2 * side].split_at(side);
            let (to_upper, to_lower) = along_across[tap.low * side..][..2 * side].split_at_mut(side);
            for (x, &slope) in slope.iter().enumerate() {
                to_upper[x] += slope * (1.0 - tap.part);
                to_lower[x] += slope * tap.part;
                down -= f64::from(slope * (lower[x] - upper[x]) * tap.inside);
            }
        }
        let mut right = 0.0f64;
        slope.fill(0.0);
        let rows = slope.chunks_exact_mut(side).zip(lined.chunks_exact(side)).zip(along_across.chunks_exact(side));
        for ((to, lined), along) in rows {
            for (tap, &along) in place.columns.iter().zip(along) {
                to[tap.low] += along * (1.0 - tap.part);
                to[tap.low + 1] += along * tap.part;
                right -= f64::from(along * (lined[tap.low + 1] - lined[tap.low]) * tap.inside);
            }
        }
        self.shifts[2 * pad] += down as f32;
        self.shifts[2 * pad + 1] += right as f32;
        for (slope, drawn) in slope.iter_mut().zip(drawn) {
            self.line[0] += f64::from(*slope * drawn);
            self.line[1] += f64::from(*slope);
            *slope *= line[0];
        }
    }
}
