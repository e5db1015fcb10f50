//! [`product`]: the matrix product below everything.

use rten_gemm::{GemmExecutor, GemmInputA, GemmInputB, GemmOptions};
use rten_tensor::NdTensorView;

/// A matrix in row-major memory, or its transpose.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    data: &'a [f32],
    shape: [usize; 2],
    strides: [usize; 2],
}

impl<'a> Matrix<'a> {
    pub(super) fn new(data: &'a [f32], rows: usize, columns: usize) -> Self {
        Self { data: &data[..rows * columns], shape: [rows, columns], strides: [columns, 1] }
    }

    /// Rows that lie `stride` values apart.
    pub(super) fn within(data: &'a [f32], rows: usize, columns: usize, stride: usize) -> Self {
        Self { data, shape: [rows, columns], strides: [stride, 1] }
    }

    pub(super) fn transposed(self) -> Self {
        let ([rows, columns], [down, right]) = (self.shape, self.strides);
        Self { data: self.data, shape: [columns, rows], strides: [right, down] }
    }

    fn view(self) -> NdTensorView<'a, f32, 2> {
        NdTensorView::from_data_with_strides(self.shape, self.data, self.strides)
            .expect("a matrix, or its transpose, lies within its memory")
    }
}

/// Destination of a product: a new matrix, or a sum with what lies in its place.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Into {
    New,
    Sum,
}

/// `out` (row-major) = `a` · `b`, or plus that.
///
/// Threads are those of the surrounding rayon pool; the sums do not depend on their number.
pub(super) fn product(out: &mut [f32], into: Into, a: Matrix<'_>, b: Matrix<'_>) {
    thread_local!(static GEMM: GemmExecutor = GemmExecutor::new());
    let out = &mut out[..a.shape[0] * b.shape[1]];
    let options = GemmOptions { beta: if into == Into::Sum { 1.0 } else { 0.0 }, ..GemmOptions::default() };
    let (a, b) = (GemmInputA::Unpacked(a.view()), GemmInputB::Unpacked(b.view()));
    GEMM.with(|gemm| gemm.gemm(out, a, b, options)).expect("the shapes fit");
}
