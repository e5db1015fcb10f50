//! Operators that a UNet needs beside convolutions: [`relu`], [`halved`], [`padded`], [`cropped`].

use crate::tape::Tensor;

/// Negative values become 0.
pub(crate) fn relu(x: &Tensor) -> Tensor {
    let input = x.shared();
    let values = x.values().iter().map(|v| v.max(0.0)).collect();
    Tensor::made([x], x.shape(), values, move |slope, [to_x], slopes| {
        slopes.add(to_x, || slope.iter().zip(input.iter()).map(|(s, &v)| if v > 0.0 { *s } else { 0.0 }).collect());
    })
}

/// Pictures `[n, c, h, w]` at half their size: the largest of each four pixels, the first of equal ones.
pub fn halved(x: &Tensor) -> Tensor {
    let [n, c, h, w] = x.dims();
    let shape = [n, c, h / 2, w / 2];
    let largest: Vec<usize> = (0..shape.iter().product())
        .map(|i| {
            let (column, row, plane) = (i % shape[3], i / shape[3] % shape[2], i / shape[3] / shape[2]);
            let first = (plane * h + 2 * row) * w + 2 * column;
            let four = [first, first + 1, first + w, first + w + 1];
            four.into_iter().fold(first, |best, index| if x.values()[index] > x.values()[best] { index } else { best })
        })
        .collect();
    let values = largest.iter().map(|&index| x.values()[index]).collect();
    Tensor::made([x], &shape, values, move |slope, [to_x], slopes| {
        slopes.add(to_x, || {
            let mut whole = vec![0.0; n * c * h * w];
            largest.iter().zip(slope).for_each(|(&index, slope)| whole[index] += slope);
            whole
        });
    })
}

/// Rows and columns around a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Margins {
    /// Before the first row, and behind the last one.
    pub rows: [usize; 2],
    /// Before the first column, and behind the last one.
    pub columns: [usize; 2],
}

impl Margins {
    /// Margins that make both sides multiples of a number, half on either side, the odd one behind.
    pub(crate) fn to_multiples(rows: usize, columns: usize, of: usize) -> Self {
        let split = |size: usize| {
            let more = size.next_multiple_of(of) - size;
            [more / 2, more - more / 2]
        };
        Self { rows: split(rows), columns: split(columns) }
    }

    /// The size of a picture within margins.
    fn around(self, [rows, columns]: [usize; 2]) -> [usize; 2] {
        [rows + self.rows.iter().sum::<usize>(), columns + self.columns.iter().sum::<usize>()]
    }
}

/// Pictures `[n, c, h, w]` with margins of zeros.
pub fn padded(x: &Tensor, margins: Margins) -> Tensor {
    let [n, c, h, w] = x.dims();
    let [rows, columns] = margins.around([h, w]);
    Tensor::made([x], &[n, c, rows, columns], grown(x.values(), [h, w], margins), move |slope, [to_x], slopes| {
        slopes.add(to_x, || cut(&slope, [h, w], margins));
    })
}

/// Pictures `[n, c, h, w]` without their margins.
pub(crate) fn cropped(x: &Tensor, margins: Margins) -> Tensor {
    let [n, c, rows, columns] = x.dims();
    let [around_rows, around_columns] = margins.around([0, 0]);
    let inner = [rows - around_rows, columns - around_columns];
    Tensor::made([x], &[n, c, inner[0], inner[1]], cut(x.values(), inner, margins), move |slope, [to_x], slopes| {
        slopes.add(to_x, || grown(&slope, inner, margins));
    })
}

fn grown(values: &[f32], [h, w]: [usize; 2], margins: Margins) -> Vec<f32> {
    let [rows, columns] = margins.around([h, w]);
    let mut out = vec![0.0; values.len() / (h * w) * rows * columns];
    for (plane, values) in out.chunks_exact_mut(rows * columns).zip(values.chunks_exact(h * w)) {
        let inner = plane.chunks_exact_mut(columns).skip(margins.rows[0]);
        inner.zip(values.chunks_exact(w)).for_each(|(to, row)| to[margins.columns[0]..][..w].copy_from_slice(row));
    }
    out
}

fn cut(values: &[f32], [h, w]: [usize; 2], margins: Margins) -> Vec<f32> {
    let [rows, columns] = margins.around([h, w]);
    let planes = values.chunks_exact(rows * columns);
    let inner = planes.flat_map(|plane| plane.chunks_exact(columns).skip(margins.rows[0]).take(h));
    inner.flat_map(|row| &row[margins.columns[0]..][..w]).copied().collect()
}
