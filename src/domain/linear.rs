//! The few lines of linear algebra that registration (matrices of up to 6 x 6) and the Fréchet distance need.

/// A symmetric matrix by rows.
pub(super) type Matrix<const N: usize> = [[f64; N]; N];

/// The identity.
fn identity<const N: usize>() -> Matrix<N> {
    let mut m = [[0.0; N]; N];
    for (i, row) in m.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    m
}

/// Cosine and sine of the Jacobi rotation that makes the entry `pq` of a symmetric 2 x 2 block zero; `pq` is not 0.
pub(super) fn rotation(pp: f64, qq: f64, pq: f64) -> (f64, f64) {
    let tau = (qq - pp) / (2.0 * pq);
    let t = 1f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
    let c = 1.0 / (1.0 + t * t).sqrt();
    (c, t * c)
}

/// Makes a symmetric matrix (by rows, finite) diagonal by cyclic Jacobi rotations, and turns the columns of `v` along:
/// slower than a closed form, but accurate for repeated and tiny eigenvalues, which are the interesting ones here.
pub(super) fn diagonalise<R: AsRef<[f64]> + AsMut<[f64]>>(a: &mut [R], v: &mut [R]) {
    let d = a.len();
    for _ in 0..60 {
        let at = |i: usize, j: usize| a[i].as_ref()[j].abs();
        let size: f64 = (0..d).map(|i| at(i, i)).sum();
        let off: f64 = (0..d).flat_map(|i| (i + 1..d).map(move |j| (i, j))).map(|(i, j)| at(i, j)).sum();
        if off <= 1e-15 * size {
            break;
        }
        for p in 0..d {
            for q in p + 1..d {
                let at = |i: usize, j: usize| a[i].as_ref()[j];
                if at(p, q) == 0.0 {
                    continue;
                }
                let (c, s) = rotation(at(p, p), at(q, q), at(p, q));
                let turn = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
                for row in a.iter_mut().chain(&mut *v) {
                    let row = row.as_mut();
                    (row[p], row[q]) = turn(row[p], row[q]);
                }
                let (above, below) = a.split_at_mut(q);
                for (x, y) in above[p].as_mut().iter_mut().zip(below[0].as_mut()) {
                    (*x, *y) = turn(*x, *y);
                }
            }
        }
    }
}

/// Eigenvalues (ascending) and unit eigenvectors of a symmetric matrix.
///
/// `None` if an entry is not finite: nothing is decomposed then.
pub(super) fn eigen_symmetric<const N: usize>(mut a: Matrix<N>) -> Option<([f64; N], Matrix<N>)> {
    if a.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let mut v = identity::<N>();
    diagonalise(&mut a, &mut v);
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    Some((order.map(|i| a[i][i]), order.map(|i| std::array::from_fn(|row| v[row][i]))))
}

/// Solves `h x = b` for the unknowns in `free` by Cholesky; the others are zero. Only the lower triangle is read.
/// `None` if that part is not positive definite or not finite.
pub(super) fn solve_symmetric<const N: usize>(h: &Matrix<N>, b: &[f64; N], free: &[usize]) -> Option<[f64; N]> {
    let n = free.len();
    let mut l = [[0.0; N]; N];
    let mut x = [0.0; N];
    for i in 0..n {
        for j in 0..=i {
            let (row, column) = (free[i].max(free[j]), free[i].min(free[j]));
            let rest = h[row][column] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j {
                if !(rest > 0.0 && rest.is_finite()) {
                    return None;
                }
                l[i][i] = rest.sqrt();
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
    }
    for i in 0..n {
        x[i] = (b[free[i]] - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
    }
    let mut spread = [0.0; N];
    for (i, &place) in free.iter().enumerate() {
        spread[place] = x[i];
    }
    spread.iter().all(|x| x.is_finite()).then_some(spread)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eigenvectors_rebuild_the_matrix(m in proptest::array::uniform10(-1.0..1.0f64)) {
            let mut a = [[0.0; 4]; 4];
            let pairs = (0..4).flat_map(|i| (0..=i).map(move |j| (i, j)));
            for ((i, j), value) in pairs.zip(m) {
                a[i][j] = value;
                a[j][i] = value;
            }
            let (values, vectors) = eigen_symmetric(a).unwrap();
            prop_assert!(values.is_sorted());
            for i in 0..4 {
                for j in 0..4 {
                    let rebuilt: f64 = (0..4).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                    prop_assert!((rebuilt - a[i][j]).abs() < 1e-12);
                }
            }
        }

        #[test]
        fn solving_undoes_multiplying(m in proptest::array::uniform32(-1.0..1.0f64), x in proptest::array::uniform6(-1.0..1.0f64)) {
            // A sum of outer products and a little of the identity: positive definite.
            let mut h = [[0.0; 6]; 6];
            for j in m.chunks_exact(6) {
                for (r, row) in h.iter_mut().enumerate() {
                    for (c, cell) in row.iter_mut().enumerate() {
                        *cell += j[r] * j[c] + if r == c { 0.1 } else { 0.0 };
                    }
                }
            }
            for free in [&[0, 1, 2, 3, 4, 5][..], &[0, 4, 5], &[3]] {
                let kept: [f64; 6] = std::array::from_fn(|i| if free.contains(&i) { x[i] } else { 0.0 });
                let b: [f64; 6] = std::array::from_fn(|i| (0..6).map(|j| h[i][j] * kept[j]).sum());
                let found = solve_symmetric(&h, &b, free).unwrap();
                for i in 0..6 {
                    prop_assert!((found[i] - kept[i]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn what_is_not_finite_or_not_definite_is_refused_at_once() {
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(eigen_symmetric([[1.0, bad], [bad, 1.0]]).is_none());
            assert!(solve_symmetric(&[[bad, 0.0], [0.0, 1.0]], &[1.0, 1.0], &[0, 1]).is_none());
        }
        assert!(solve_symmetric(&[[1.0, 2.0], [2.0, 1.0]], &[1.0, 1.0], &[0, 1]).is_none());
    }
}
