//! [`Tensor`]: the little that graphs and samplers need of an n-dimensional array.

/// Row-major f32 values with a shape; the first axis is the batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    data: Vec<f32>,
}

impl Tensor {
    /// Wraps row-major `data`; `None` if its length is not the product of `shape` (or the product overflows).
    pub fn new(shape: Vec<usize>, data: Vec<f32>) -> Option<Self> {
        let len = shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d))?;
        (len == data.len()).then_some(Self { shape, data })
    }

    /// A tensor of `value`.
    pub fn filled(shape: Vec<usize>, value: f32) -> Self {
        let data = vec![value; shape.iter().product()];
        Self { shape, data }
    }

    /// The sizes of the axes.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// All values, the last axis fastest.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All values, to be changed in place.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// Gives the storage back.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// The length of the first axis; 1 for a scalar.
    pub fn batch(&self) -> usize {
        self.shape.first().copied().unwrap_or(1)
    }

    /// Entry `index` of the first axis, without that axis; `None` outside.
    pub fn item(&self, index: usize) -> Option<Tensor> {
        let shape = self.shape.get(1..)?.to_vec();
        let len: usize = shape.iter().product();
        (index < self.batch()).then(|| Tensor { data: self.data[index * len..(index + 1) * len].to_vec(), shape })
    }

    /// Joins tensors of one shape along a new first axis; `None` for none or for different shapes.
    pub fn stack(items: &[Tensor]) -> Option<Tensor> {
        let first = items.first()?;
        if items.iter().any(|t| t.shape != first.shape) {
            return None;
        }
        let shape = std::iter::once(items.len()).chain(first.shape.iter().copied()).collect();
        Some(Tensor { shape, data: items.iter().flat_map(|t| t.data.iter().copied()).collect() })
    }

    /// Joins tensors along their first axis; `None` for none, for scalars, or where the other axes differ.
    pub fn concat(items: &[&Tensor]) -> Option<Tensor> {
        let rest = items.first()?.shape.get(1..)?.to_vec();
        if items.iter().any(|t| t.shape.get(1..) != Some(&rest)) {
            return None;
        }
        let shape = std::iter::once(items.iter().map(|t| t.batch()).sum()).chain(rest).collect();
        Some(Tensor { shape, data: items.iter().flat_map(|t| t.data.iter().copied()).collect() })
    }

    /// Number of values that are NaN or infinite.
    pub fn non_finite(&self) -> usize {
        self.data.iter().filter(|v| !v.is_finite()).count()
    }
}
