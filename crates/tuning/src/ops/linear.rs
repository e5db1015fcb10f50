//! [`linear`]: a product of rows with weights.

use super::product::{Into, Matrix, product};
use crate::tape::Tensor;

/// Order of a product's weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// `[in, out]`.
    InOut,
    /// `[out, in]`.
    OutIn,
}

impl Weights {
    /// The weights as `[in, out]`.
    fn matrix(self, weight: &[f32], inputs: usize, outputs: usize) -> Matrix<'_> {
        match self {
            Weights::InOut => Matrix::new(weight, inputs, outputs),
            Weights::OutIn => Matrix::new(weight, outputs, inputs).transposed(),
        }
    }
}

/// Rows `[…, in]` times weights, plus a bias: `[…, out]`.
pub fn linear(x: &Tensor, weight: &Tensor, bias: &Tensor, lie: Weights) -> Tensor {
    let outputs = bias.values().len();
    let inputs = weight.values().len() / outputs;
    let rows = x.values().len() / inputs;
    let mut shape = x.shape().to_vec();
    if let Some(last) = shape.last_mut() {
        assert_eq!(*last, inputs, "{:?} times {:?}", x.shape(), weight.shape());
        *last = outputs;
    }
    let mut values = bias.values().repeat(rows);
    product(
        &mut values,
        Into::Sum,
        Matrix::new(x.values(), rows, inputs),
        lie.matrix(weight.values(), inputs, outputs),
    );
    let (of_x, of_weight) = (x.shared(), weight.shared());
    Tensor::made([x, weight, bias], &shape, values, move |slope, [to_x, to_weight, to_bias], slopes| {
        let along = Matrix::new(&slope, rows, outputs);
        let seen = Matrix::new(&of_x, rows, inputs);
        slopes.add(to_x, || new(rows * inputs, along, lie.matrix(&of_weight, inputs, outputs).transposed()));
        slopes.add(to_weight, || match lie {
            Weights::InOut => new(inputs * outputs, seen.transposed(), along),
            Weights::OutIn => new(inputs * outputs, along.transposed(), seen),
        });
        slopes.add(to_bias, || super::arithmetic::summed(&slope, outputs));
    })
}

fn new(count: usize, a: Matrix<'_>, b: Matrix<'_>) -> Vec<f32> {
    let mut out = vec![0.0; count];
    product(&mut out, Into::New, a, b);
    out
}
