//! [`Axes`]: which axes of a CAD model's file are x, y and z of the object.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use super::TriMesh;

/// Letters of the axes.
const LETTERS: [char; 3] = ['x', 'y', 'z'];

/// Reordering of the axes of a CAD model: which of its file's, with which sign, becomes x, y and z. As text `x-zy`. A rotation:
/// a model is never mirrored by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Axes {
    from: [usize; 3],
    negative: [bool; 3],
}

impl Axes {
    /// All 24 but the file's own.
    pub(crate) fn others() -> impl Iterator<Item = Self> {
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let signs = [[false, false], [true, false], [false, true], [true, true]];
        orders.into_iter().flat_map(move |from| signs.map(|[y, z]| Self::rotation(from, [y, z]))).skip(1)
    }

    /// The rotation with these axes, and these signs of y and z.
    fn rotation(from: [usize; 3], [y, z]: [bool; 2]) -> Self {
        let swapped = (from[1] + 3 - from[0]) % 3 != 1;
        Self { from, negative: [swapped ^ y ^ z, y, z] }
    }

    /// The model turned so.
    #[must_use]
    pub fn apply(self, mesh: &TriMesh) -> TriMesh {
        let turned = |p: &DVec3| {
            let p = p.to_array();
            let sign = |i: usize| if self.negative[i] { -1.0 } else { 1.0 };
            DVec3::from_array(std::array::from_fn(|i| sign(i) * p[self.from[i]]))
        };
        TriMesh { vertices: mesh.vertices.iter().map(turned).collect(), triangles: mesh.triangles.clone() }
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.from.iter().zip(self.negative).try_for_each(|(from, negative)| {
            let sign = if negative { "-" } else { "" };
            write!(f, "{sign}{}", LETTERS[*from])
        })
    }
}

impl FromStr for Axes {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let named = Self::others().find(|axes| axes.to_string() == text);
        named.ok_or(())
    }
}
