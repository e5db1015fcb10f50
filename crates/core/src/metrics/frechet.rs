//! Distance of two sets of feature vectors, each taken for a sample of a normal distribution.

use nalgebra::{DMatrix, DVector};

use crate::linear::eigen_symmetric;

/// The Fréchet distance of two sets of vectors: `|m1 - m2|² + tr(C1 + C2 - 2 (C1 C2)^½)`, with means `m` and unbiased
/// covariances `C`. Behind published "FID" figures stand the features of an Inception network; with other features the
/// numbers are of another size. With few vectors it is biased upwards: compare sets of equal size only.
///
/// `None` with fewer than two vectors on a side, vectors of different lengths or of none, or values that are not finite.
///
/// # Numerics
/// In f64. The trace of the root is the sum of the singular values of `C1^½ C2^½`, which needs no root of a matrix that
/// is not symmetric; eigenvalues below rounding count as 0. With fewer vectors than dimensions these singular values are
/// those of the vectors' products with each other, `X1ᵀ X2` over the root of both degrees of freedom: no covariance is formed.
pub fn frechet_distance(first: &[&[f32]], second: &[&[f32]]) -> Option<f64> {
    let d = first.first()?.len();
    let sound = |set: &[&[f32]]| set.len() >= 2 && set.iter().all(|v| v.len() == d && v.iter().all(|x| x.is_finite()));
    if d == 0 || !sound(first) || !sound(second) {
        return None;
    }
    if first.len().max(second.len()) <= d {
        return Some(of_products(first, second, d));
    }
    let ((m1, c1), (m2, c2)) = (moments(first, d), moments(second, d));
    let shared = (root(c1.clone())? * root(c2.clone())?).singular_values().sum();
    Some(((m1 - m2).norm_squared() + c1.trace() + c2.trace() - 2.0 * shared).max(0.0))
}

/// Distance by the products of centered vectors.
fn of_products(first: &[&[f32]], second: &[&[f32]], d: usize) -> f64 {
    let ((m1, x1), (m2, x2)) = (centered(first, d), centered(second, d));
    let freedoms = [x1.ncols() - 1, x2.ncols() - 1].map(|n| n as f64);
    let shared = x1.tr_mul(&x2).singular_values().sum() / (freedoms[0] * freedoms[1]).sqrt();
    let traces = x1.norm_squared() / freedoms[0] + x2.norm_squared() / freedoms[1];
    ((m1 - m2).norm_squared() + traces - 2.0 * shared).max(0.0)
}

/// Mean, and the vectors without it as columns.
fn centered(set: &[&[f32]], d: usize) -> (DVector<f64>, DMatrix<f64>) {
    let mut vectors = DMatrix::from_fn(d, set.len(), |i, k| f64::from(set[k][i]));
    let mean = vectors.column_mean();
    vectors.column_iter_mut().for_each(|mut v| v -= &mean);
    (mean, vectors)
}

/// Mean and unbiased covariance.
fn moments(set: &[&[f32]], d: usize) -> (DVector<f64>, DMatrix<f64>) {
    let (mean, vectors) = centered(set, d);
    let covariance = &vectors * vectors.transpose() / (set.len() - 1) as f64;
    (mean, covariance)
}

/// The positive semi-definite root of such a matrix; eigenvalues below rounding become 0. `None` for what is not finite.
fn root(c: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let floor = c.nrows() as f64 * f64::EPSILON;
    let (values, v) = eigen_symmetric(c)?;
    let floor = floor * values.max();
    let scales = values.map(|x| if x > floor { x.sqrt() } else { 0.0 });
    Some(&v * DMatrix::from_diagonal(&scales) * v.transpose())
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
    fn the_distance_is_that_of_pytorch_fid() {
        let reference: serde_json::Value =
            serde_json::from_str(include_str!("../../tests/data/scikit_image.json")).unwrap();
        for case in reference["sets"].as_array().unwrap() {
            let d = case["features"].as_u64().unwrap() as usize;
            let set = |key: &str| -> Vec<Vec<f32>> {
                let values: Vec<f32> =
                    case[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap() as f32).collect();
                values.chunks(d).map(<[f32]>::to_vec).collect()
            };
            let (found, theirs) =
                (distance(&set("first"), &set("second")).unwrap(), case["distance"].as_f64().unwrap());
            assert!((found - theirs).abs() < 1e-3, "{found} for {theirs}");
        }
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
