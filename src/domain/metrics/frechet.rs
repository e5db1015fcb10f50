//! Distance of two sets of feature vectors, each taken for a sample of a normal distribution.

use crate::domain::linear::{diagonalise, rotation};

/// A square matrix by rows.
type Matrix = Vec<Vec<f64>>;

/// The Fréchet distance of two sets of vectors: `|m1 - m2|² + tr(C1 + C2 - 2 (C1 C2)^½)`, with means `m` and unbiased
/// covariances `C`. Behind published "FID" figures stand the features of an Inception network; with other features the
/// numbers are of another size. With few vectors it is biased upwards: compare sets of equal size only.
///
/// `None` with fewer than two vectors on a side, vectors of different lengths or of none, or values that are not finite.
///
/// # Numerics
/// In f64. The trace of the root is the sum of the singular values of `C1^½ C2^½`, which needs no root of a matrix that
/// is not symmetric; eigenvalues below rounding count as 0, so fewer vectors than dimensions are no trouble.
pub fn frechet_distance(first: &[&[f32]], second: &[&[f32]]) -> Option<f64> {
    let d = first.first()?.len();
    let sound = |set: &[&[f32]]| set.len() >= 2 && set.iter().all(|v| v.len() == d && v.iter().all(|x| x.is_finite()));
    if d == 0 || !sound(first) || !sound(second) {
        return None;
    }
    let ((m1, c1), (m2, c2)) = (moments(first, d), moments(second, d));
    let apart: f64 = m1.iter().zip(&m2).map(|(a, b)| (a - b).powi(2)).sum();
    let trace = |c: &Matrix| (0..d).map(|i| c[i][i]).sum::<f64>();
    let shared: f64 = singular_values(product(&root(c1.clone())?, &root(c2.clone())?)).iter().sum();
    Some((apart + trace(&c1) + trace(&c2) - 2.0 * shared).max(0.0))
}

/// Mean and unbiased covariance.
fn moments(set: &[&[f32]], d: usize) -> (Vec<f64>, Matrix) {
    let n = set.len() as f64;
    let mean: Vec<f64> = (0..d).map(|i| set.iter().map(|v| f64::from(v[i])).sum::<f64>() / n).collect();
    let mut c = vec![vec![0.0; d]; d];
    for v in set {
        let centred: Vec<f64> = v.iter().zip(&mean).map(|(x, m)| f64::from(*x) - m).collect();
        for (row, x) in c.iter_mut().zip(&centred) {
            for (cell, y) in row.iter_mut().zip(&centred) {
                *cell += x * y;
            }
        }
    }
    c.iter_mut().flatten().for_each(|cell| *cell /= n - 1.0);
    (mean, c)
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let row = |a: &Vec<f64>| {
        let mut out = vec![0.0; b[0].len()];
        for (x, row) in a.iter().zip(b) {
            for (cell, y) in out.iter_mut().zip(row) {
                *cell += x * y;
            }
        }
        out
    };
    a.iter().map(row).collect()
}

/// The positive semi-definite root of such a matrix; eigenvalues below rounding become 0. `None` for what is not finite.
fn root(c: Matrix) -> Option<Matrix> {
    let d = c.len();
    let (values, vectors) = eigen_symmetric(c)?;
    let largest = values.iter().copied().fold(0.0, f64::max);
    let floor = largest * d as f64 * f64::EPSILON;
    let mut out = vec![vec![0.0; d]; d];
    for (k, &value) in values.iter().enumerate().filter(|(_, v)| **v > floor) {
        let scale = value.sqrt();
        for i in 0..d {
            let x = scale * vectors[i][k];
            for (j, cell) in out[i].iter_mut().enumerate() {
                *cell += x * vectors[j][k];
            }
        }
    }
    Some(out)
}

/// Eigenvalues (in no order) and unit eigenvectors (as columns), small ones beside large ones too.
fn eigen_symmetric(mut a: Matrix) -> Option<(Vec<f64>, Matrix)> {
    let d = a.len();
    if a.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let mut v: Matrix = (0..d).map(|i| (0..d).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    diagonalise(&mut a, &mut v);
    Some(((0..d).map(|i| a[i][i]).collect(), v))
}

/// Singular values by one-sided Jacobi rotations of the rows.
fn singular_values(mut a: Matrix) -> Vec<f64> {
    let d = a.len();
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
    for _ in 0..60 {
        let mut turned = false;
        for p in 0..d {
            for q in p + 1..d {
                let (above, below) = a.split_at_mut(q);
                let (x, y) = (&mut above[p], &mut below[0]);
                let (xx, yy, xy) = (dot(x, x), dot(y, y), dot(x, y));
                if xy.abs() <= 1e-15 * (xx * yy).sqrt() || xy == 0.0 {
                    continue;
                }
                turned = true;
                let (c, s) = rotation(xx, yy, xy);
                for (x, y) in x.iter_mut().zip(y.iter_mut()) {
                    (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                }
            }
        }
        if !turned {
            break;
        }
    }
    a.iter().map(|row| dot(row, row).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// `n` vectors of length `d`, scaled and moved per dimension.
    fn set(n: usize, d: usize, seed: u64, scale: f32, shift: f32) -> Vec<Vec<f32>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n)
            .map(|_| (0..d).map(|i| shift + scale * (i + 1) as f32 * rng.random_range(-1.0f32..1.0)).collect())
            .collect()
    }

    fn distance(a: &[Vec<f32>], b: &[Vec<f32>]) -> Option<f64> {
        let view = |s: &[Vec<f32>]| -> Vec<Vec<f32>> { s.to_vec() };
        let (a, b) = (view(a), view(b));
        frechet_distance(
            &a.iter().map(Vec::as_slice).collect::<Vec<_>>(),
            &b.iter().map(Vec::as_slice).collect::<Vec<_>>(),
        )
    }

    #[test]
    fn known_distances() {
        // One dimension: (m1 - m2)² + (s1 - s2)².
        let a = vec![vec![0.0], vec![2.0]];
        let b = vec![vec![10.0], vec![16.0]];
        let expected = 144.0 + (2f64.sqrt() - 18f64.sqrt()).powi(2);
        assert!((distance(&a, &b).unwrap() - expected).abs() < 1e-9);
        // A shift alone is its squared length, a scale alone (k - 1)² of the variance.
        let a = set(300, 7, 1, 1.0, 0.0);
        let moved: Vec<Vec<f32>> = a.iter().map(|v| v.iter().map(|x| x + 0.5).collect()).collect();
        assert!((distance(&a, &moved).unwrap() - 7.0 * 0.25).abs() < 1e-4);
        let wider: Vec<Vec<f32>> = a.iter().map(|v| v.iter().map(|x| x * 3.0).collect()).collect();
        let (mean, c) = moments(&a.iter().map(Vec::as_slice).collect::<Vec<_>>(), 7);
        let variance: f64 = (0..7).map(|i| c[i][i]).sum();
        let shift: f64 = mean.iter().map(|m| 4.0 * m * m).sum();
        assert!((distance(&a, &wider).unwrap() / (4.0 * variance + shift) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn few_vectors_in_many_dimensions_are_no_trouble() {
        // 12 vectors in 40 dimensions: rank 11 at most.
        let (a, b) = (set(12, 40, 3, 0.02, 4.0), set(12, 40, 4, 0.02, 4.0));
        assert!(distance(&a, &a).unwrap() < 1e-9, "{:?}", distance(&a, &a));
        let (there, back) = (distance(&a, &b).unwrap(), distance(&b, &a).unwrap());
        assert!(there > 0.0 && (there - back).abs() < 1e-9 * there, "{there} {back}");
        // A direction in which nothing varies changes nothing.
        let with =
            |s: &[Vec<f32>]| -> Vec<Vec<f32>> { s.iter().map(|v| v.iter().copied().chain([7.0]).collect()).collect() };
        assert!((distance(&with(&a), &with(&b)).unwrap() - there).abs() < 1e-9 * there);
        // All alike: the distance of the means.
        let (p, q) = (vec![vec![1.0; 5]; 4], vec![vec![2.0; 5]; 6]);
        assert!((distance(&p, &q).unwrap() - 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_root_of_a_matrix_squares_to_it() {
        let a = set(60, 30, 9, 1.0, 0.0);
        let (_, c) = moments(&a.iter().map(Vec::as_slice).collect::<Vec<_>>(), 30);
        let r = root(c.clone()).unwrap();
        let square = product(&r, &r);
        let size = c[29][29];
        assert!(c.iter().flatten().zip(square.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-12 * size));
        let singular: f64 = singular_values(r).iter().sum();
        let eigen: f64 = eigen_symmetric(c).unwrap().0.iter().map(|v| v.max(0.0).sqrt()).sum();
        assert!((singular / eigen - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_compared_is_none() {
        let one = vec![vec![1.0, 2.0]];
        let two = vec![vec![1.0, 2.0], vec![2.0, 3.0]];
        assert_eq!(distance(&one, &two), None);
        assert_eq!(distance(&two, &[]), None);
        assert_eq!(distance(&two, &vec![vec![1.0]; 3]), None);
        assert_eq!(distance(&vec![vec![]; 3], &vec![vec![]; 3]), None);
        assert_eq!(distance(&two, &vec![vec![f32::NAN, 1.0]; 3]), None);
    }
}
