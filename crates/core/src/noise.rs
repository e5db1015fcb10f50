//! Seeded randomness: the same numbers on every machine and for every number of threads.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use super::grid::Grid;

/// Stream of random numbers by its purpose. Streams of one seed are independent of each other, so that adding a draw to
/// one effect does not change the others.
#[derive(Clone, Copy, Debug)]
pub enum Stream {
    /// The pose of a tool in the hand.
    Grasp = 1,
    /// Drawn tools.
    Tool = 2,
    /// Drawn sensors.
    Config = 3,
    /// Place of the sensors.
    Rig = 4,
    /// Noise of the depth camera.
    Depth = 5,
    /// Texture of an imprint.
    DepthTexture = 6,
    /// Traits of a gel.
    Gel = 7,
    /// Noise of its camera.
    GelNoise = 8,
    /// Picture of a gel without touch.
    GelReference = 9,
    /// Corrupted masks.
    Mask = 10,
    /// Faults of a pair.
    Condition = 11,
}

/// A source of random numbers for one purpose and one finger.
pub struct Noise(ChaCha8Rng);

impl Noise {
    /// Source number `lane` (a finger's index, or 0) of the stream `stream` of `seed`.
    pub fn new(seed: u64, stream: Stream, lane: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream((stream as u64) << 8 | lane as u64);
        Self(rng)
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `[lo, hi)`.
    pub fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    /// Uniform in `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n.saturating_sub(1))
    }

    /// Nearly normal, mean 0, standard deviation 1, never beyond 3.5: the sum of four uniform numbers. Several
    /// times cheaper than an exact normal, and sensor noise has no far tails (those are separate effects here).
    pub fn normal(&mut self) -> f32 {
        let bits = self.0.next_u64();
        let sum = (0..4).map(|i| (bits >> (16 * i)) as u16 as f32).sum::<f32>();
        (sum - 131_070.0) / 37_837.2
    }

    /// White noise of standard deviation 1.
    pub fn white(&mut self, width: usize, height: usize) -> Grid<f32> {
        Grid::from_fn(width, height, |_, _| self.normal())
    }

    /// A smooth random field of standard deviation about 1 whose bumps are about `cell` pixels wide.
    pub fn smooth(&mut self, width: usize, height: usize, cell: f64) -> Grid<f32> {
        let columns = (width as f64 / cell).ceil() as usize + 2;
        let rows = (height as f64 / cell).ceil() as usize + 2;
        let nodes = self.white(columns, rows);
        Grid::from_fn(width, height, |x, y| {
            let (fx, fy) = (x as f64 / cell, y as f64 / cell);
            let (ix, iy) = (fx as usize, fy as usize);
            // smoothstep; 1.35 makes up for the variance that interpolation loses
            let ease = |t: f64| (t * t * (3.0 - 2.0 * t)) as f32;
            let (tx, ty) = (ease(fx - ix as f64), ease(fy - iy as f64));
            let top = nodes[(ix, iy)] * (1.0 - tx) + nodes[(ix + 1, iy)] * tx;
            let bottom = nodes[(ix, iy + 1)] * (1.0 - tx) + nodes[(ix + 1, iy + 1)] * tx;
            1.35 * (top * (1.0 - ty) + bottom * ty)
        })
    }
}

/// Blurs an image with the kernel `[side, 1 - 2 side, side]` along both axes; the border repeats.
pub fn blur3(image: &Grid<f32>, side: f32) -> Grid<f32> {
    let (w, h) = (image.width(), image.height());
    let rows = Grid::from_fn(w, h, |x, y| {
        let row = image.row(y);
        side * (row[x.saturating_sub(1)] + row[(x + 1).min(w - 1)]) + (1.0 - 2.0 * side) * row[x]
    });
    Grid::from_fn(w, h, |x, y| {
        side * (rows[(x, y.saturating_sub(1))] + rows[(x, (y + 1).min(h - 1))]) + (1.0 - 2.0 * side) * rows[(x, y)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, stream, lane| Noise::new(seed, stream, lane).white(4, 4);
        assert_eq!(draw(1, Stream::Depth, 0), draw(1, Stream::Depth, 0));
        assert_ne!(draw(1, Stream::Depth, 0), draw(1, Stream::Depth, 1));
        assert_ne!(draw(1, Stream::Depth, 0), draw(1, Stream::Gel, 0));
        assert_ne!(draw(1, Stream::Depth, 0), draw(2, Stream::Depth, 0));
    }
}
