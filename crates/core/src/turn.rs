//! [`Turn`]: how a picture was laid down.

use super::grid::Grid;

/// One of the eight ways to lay down a square picture: quarter turns, then perhaps mirrored left to right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Turn {
    /// Counter-clockwise quarter turns, 0 to 3.
    pub quarters: u8,
    /// Mirrored left to right after turning.
    pub mirrored: bool,
}

impl Turn {
    /// All eight, the upright one first.
    pub fn all() -> impl Iterator<Item = Self> {
        [false, true].into_iter().flat_map(|mirrored| (0..4).map(move |quarters| Self { quarters, mirrored }))
    }

    /// The image laid down this way.
    pub fn apply<T: Clone>(self, upright: &Grid<T>) -> Grid<T> {
        let turned = (0..self.quarters % 4).fold(upright.clone(), |image, _| quarter(&image));
        if self.mirrored { mirrored(&turned) } else { turned }
    }

    /// The upright image that was laid down this way.
    pub fn undo<T: Clone>(self, image: &Grid<T>) -> Grid<T> {
        let image = if self.mirrored { mirrored(image) } else { image.clone() };
        (0..(4 - self.quarters % 4) % 4).fold(image, |image, _| quarter(&image))
    }
}

impl std::fmt::Display for Turn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.quarters % 4, self.mirrored) {
            (0, false) => f.write_str("upright"),
            (0, true) => f.write_str("mirrored"),
            (n, false) => write!(f, "turned by {}°", 90 * u32::from(n)),
            (n, true) => write!(f, "turned by {}° and mirrored", 90 * u32::from(n)),
        }
    }
}

/// Counter-clockwise by a quarter.
fn quarter<T: Clone>(image: &Grid<T>) -> Grid<T> {
    let [width, height] = image.size();
    Grid::from_fn(height, width, |x, y| image[(width - 1 - y, x)].clone())
}

fn mirrored<T: Clone>(image: &Grid<T>) -> Grid<T> {
    Grid::from_fn(image.width(), image.height(), |x, y| image[(image.width() - 1 - x, y)].clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undo_is_the_inverse_of_apply() {
        let image = Grid::from_fn(3, 5, |x, y| 10 * x + y);
        for turn in Turn::all() {
            assert_eq!(turn.undo(&turn.apply(&image)), image, "{turn}");
        }
        let turned = Turn { quarters: 1, mirrored: false }.apply(&image);
        assert_eq!((turned.size(), turned[(0, 0)]), ([5, 3], image[(2, 0)]));
    }
}
