//! Linear algebra that the science asks of nalgebra, with its refusals: nothing is decomposed that is not finite.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, OMatrix, OVector, U1};

/// Rounds after which a decomposition gives up; it takes a few per row.
const MOST_ROUNDS: usize = 10_000;

/// Eigenvalues (ascending) and unit eigenvectors (as columns) of a symmetric matrix, whose lower triangle is read.
///
/// `None` if an entry is not finite.
#[allow(clippy::type_complexity, reason = "an alias would have to repeat the bounds")]
pub(super) fn eigen_symmetric<D: DimSub<U1>>(m: OMatrix<f64, D, D>) -> Option<(OVector<f64, D>, OMatrix<f64, D, D>)>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    if m.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let eigen = m.try_symmetric_eigen(f64::EPSILON, MOST_ROUNDS)?;
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let (mut values, mut vectors) = (eigen.eigenvalues.clone(), eigen.eigenvectors.clone());
    for (to, from) in order.into_iter().enumerate() {
        values[to] = eigen.eigenvalues[from];
        vectors.set_column(to, &eigen.eigenvectors.column(from));
    }
    Some((values, vectors))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eigenvectors_rebuild_the_matrix(m in proptest::array::uniform16(-1.0..1.0f64)) {
            let m = Matrix4::from_row_slice(&m);
            let a = m + m.transpose();
            let (values, v) = eigen_symmetric(a).unwrap();
            prop_assert!(values.as_slice().is_sorted());
            prop_assert!((v * Matrix4::from_diagonal(&values) * v.transpose() - a).amax() < 1e-12);
            prop_assert!((v * v.transpose() - Matrix4::identity()).amax() < 1e-12);
        }

    }
}
