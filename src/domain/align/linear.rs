//! The few lines of linear algebra that registration needs, for matrices of up to 6 x 6.

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

/// Eigenvalues (ascending) and unit eigenvectors of a symmetric matrix, by Jacobi rotations: slower than a closed
/// form, but accurate for repeated and tiny eigenvalues, which are the interesting ones here.
///
/// `None` if an entry is not finite: nothing is decomposed then.
pub(super) fn eigen_symmetric<const N: usize>(mut a: Matrix<N>) -> Option<([f64; N], Matrix<N>)> {
    if a.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let mut v = identity::<N>();
    for _ in 0..50 {
        let size: f64 = (0..N).map(|i| a[i][i].abs()).sum();
        let off: f64 = (0..N).flat_map(|i| (i + 1..N).map(move |j| (i, j))).map(|(i, j)| a[i][j].abs()).sum();
        if off <= 1e-15 * size {
            break;
        }
        for (p, q) in (0..N).flat_map(|i| (i + 1..N).map(move |j| (i, j))) {
            if a[p][q] == 0.0 {
                continue;
            }
            let tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = t * c;
            let turn = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
            for row in a.iter_mut().chain(&mut v) {
                (row[p], row[q]) = turn(row[p], row[q]);
            }
            for (k, (x, y)) in a[p].into_iter().zip(a[q]).enumerate() {
                (a[p][k], a[q][k]) = turn(x, y);
            }
        }
    }
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
