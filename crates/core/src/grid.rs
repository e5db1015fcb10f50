//! [`Grid`]: a checked, row-major image. Every picture, depth map and mask in the product is one.
//!
//! Pixels are addressed as `(x, y)` = (column, row); `(0, 0)` is the *center* of the top-left pixel.

use std::ops::{Index, IndexMut};

/// A `width × height` image stored row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

/// A depth or imprint image in meters; NaN marks "no measurement".
pub type DepthMap = Grid<f32>;
/// A contact mask: `true` where the membrane touches the object.
pub type Mask = Grid<bool>;
/// A color image on the 0..255 scale; a difference image has signed values.
pub type RgbGrid = Grid<[f32; 3]>;

/// A storage whose length does not match its size.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{len} values cannot fill an image of {width} x {height} pixels")]
pub struct GridSizeError {
    /// Columns asked for.
    pub width: usize,
    /// Rows asked for.
    pub height: usize,
    /// Values given.
    pub len: usize,
}

impl<T> Grid<T> {
    /// Wraps row-major `data`.
    ///
    /// # Errors
    /// [`GridSizeError`] if `data.len() != width * height`.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Result<Self, GridSizeError> {
        if width.checked_mul(height) == Some(data.len()) {
            Ok(Self { width, height, data })
        } else {
            Err(GridSizeError { width, height, len: data.len() })
        }
    }

    /// Builds the image from a function of `(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                data.push(f(x, y));
            }
        }
        Self { width, height, data }
    }

    /// Columns, in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows, in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// `[width, height]` in pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.data.len()
    }

    /// True where the image has no pixel.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    /// All pixels, row by row.
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row by row, to be changed in place.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Gives the storage back.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// The pixel at `(x, y)`, or `None` outside the image.
    pub fn get(&self, x: usize, y: usize) -> Option<&T> {
        (x < self.width && y < self.height).then(|| &self.data[y * self.width + x])
    }

    /// Row `y`, left to right. Panics outside the image.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// A new image with every pixel passed through `f`.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Grid<U> {
        Grid { width: self.width, height: self.height, data: self.data.iter().map(f).collect() }
    }
}

impl RgbGrid {
    /// Adds another picture of this size, value by value.
    pub(crate) fn add(&mut self, other: &Self) {
        let values = self.data.as_flattened_mut().iter_mut();
        values.zip(other.data.as_flattened()).for_each(|(value, more)| *value += more);
    }
}

impl<T: Clone> Grid<T> {
    /// An image filled with `value`.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }

    /// Both axes reversed: the lab's convention that lines a bubble image up with a GelSlim image.
    pub fn rotated_180(&self) -> Self {
        let mut data = self.data.clone();
        data.reverse();
        Self { width: self.width, height: self.height, data }
    }

    /// The order of the rows reversed (a vertical flip).
    pub fn rows_reversed(&self) -> Self {
        Self::from_fn(self.width, self.height, |x, y| self[(x, self.height - 1 - y)].clone())
    }
}

impl<T> Index<(usize, usize)> for Grid<T> {
    type Output = T;

    fn index(&self, (x, y): (usize, usize)) -> &T {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) outside {} x {}", self.width, self.height);
        &self.data[y * self.width + x]
    }
}

impl<T> IndexMut<(usize, usize)> for Grid<T> {
    fn index_mut(&mut self, (x, y): (usize, usize)) -> &mut T {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) outside {} x {}", self.width, self.height);
        &mut self.data[y * self.width + x]
    }
}
