//! Values and slopes of a band of the template in windows around each cell.

use std::sync::OnceLock;

use crate::align::lanes::Lattice;
use crate::align::windows::{Ranges, Slopes};
use crate::relax::Field;
use crate::tent::STEP_M;

/// Reaches of the windows in which a band's values are known, nodes. A place that moves farther may have any cost.
const VALUES: [usize; 8] = [1, 2, 3, 4, 6, 8, 12, 16];
/// Reaches of the windows in which a band's slopes are known, nodes.
pub(super) const SLOPES: [usize; 3] = [1, 2, 4];

/// Pyramid over a band: its windows, made at the first request.
#[derive(Default)]
pub(super) struct Pyramid(OnceLock<Windows>);

/// The values and slopes, by the windows' reach.
pub(super) struct Windows {
    pub(super) values: [Ranges; VALUES.len()],
    pub(super) slopes: [Slopes; SLOPES.len()],
}

impl Pyramid {
    /// The windows of the field that this is the pyramid of.
    pub(super) fn over(&self, field: &Field) -> &Windows {
        self.0.get_or_init(|| {
            let grid = Lattice { columns: field.columns, rows: field.rows, values: &field.values };
            // Beyond the border its value goes on.
            Windows { values: Ranges::of(grid, VALUES), slopes: Slopes::of(grid, STEP_M, SLOPES, [0.0; 4]) }
        })
    }
}
