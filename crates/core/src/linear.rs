//! Linear algebra that the science asks of nalgebra, with its refusals: nothing is decomposed that is not finite.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, DimDiff, DimSub, Matrix6, OMatrix, OVector, U1, Vector6};

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

/// Solves `h x = b` for the unknowns in `free` by Cholesky; the others are zero. Only the lower triangle is read.
/// `None` if that part is not positive definite or not finite.
pub(super) fn solve_symmetric(mut h: Matrix6<f64>, mut b: Vector6<f64>, free: &[usize]) -> Option<Vector6<f64>> {
    for i in (0..6).filter(|i| !free.contains(i)) {
        h.row_mut(i).fill(0.0);
        h.column_mut(i).fill(0.0);
        h[(i, i)] = 1.0;
        b[i] = 0.0;
    }
    let x = h.cholesky()?.solve(&b);
    x.iter().all(|x| x.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix4};
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

        #[test]
        fn solving_undoes_multiplying(m in proptest::array::uniform32(-1.0..1.0f64), x in proptest::array::uniform6(-1.0..1.0f64)) {
            // A sum of outer products and a little of the identity: positive definite.
            let j = nalgebra::SMatrix::<f64, 6, 5>::from_column_slice(&m[..30]);
            let h: Matrix6<f64> = j * j.transpose() + 0.1 * Matrix6::identity();
            for free in [&[0, 1, 2, 3, 4, 5][..], &[0, 4, 5], &[3]] {
                let kept = Vector6::from_fn(|i, _| if free.contains(&i) { x[i] } else { 0.0 });
                let solution = solve_symmetric(h.lower_triangle(), h * kept, free).unwrap();
                prop_assert!((solution - kept).amax() < 1e-9);
            }
        }
    }

    #[test]
    fn what_is_not_finite_or_not_definite_is_refused_at_once() {
        let all = [0, 1, 2, 3, 4, 5];
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(eigen_symmetric(Matrix2::new(1.0, bad, bad, 1.0)).is_none());
            let mut h = Matrix6::identity();
            h[(0, 0)] = bad;
            h[(1, 0)] = bad;
            assert!(solve_symmetric(h, Vector6::repeat(1.0), &all).is_none());
        }
        let mut h = Matrix6::identity();
        h[(1, 0)] = 2.0;
        assert!(solve_symmetric(h, Vector6::repeat(1.0), &all).is_none());
        assert!(solve_symmetric(h, Vector6::repeat(1.0), &[0, 2]).is_some());
    }
}
