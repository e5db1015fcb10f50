//! Scouts over the full turn and all of the model: where a tool may be, if nothing is known of how it was grasped.
//!
//! The coarsest band of each finger is kept turned all around. Compared with it at every place of the model, cell by cell,
//! an image tells some dozens of poses, from which the descents start. Many are given up early: of two that stand where the
//! coarse bands end, the fine ones ask about the cheaper one alone.

use std::sync::Arc;

use super::cost::Patch;
use super::problem::{Descents, LAST, Problem, SCOUTS_WEIGHT, WORTH, alike};
use super::turned::{Frame, REACH, TURNS, Turned};
use crate::align::batch::State;
use crate::align::lanes::LANES;
use crate::align::search::Progress;
use crate::tent::STEP_M;

/// Differences of heights from which on a cell counts no more, meters.
const CAP_M: f32 = 3e-3;
/// Places of a finger's image that its cells are the mean of.
const PLACES: usize = 1200;
/// Poses that go on to each band, coarse to fine.
const KEEP: [usize; LAST] = [24, 12, 8];

/// An image's cells with depth: the first that they are compared with, and the height.
type Cells = Vec<(usize, f32)>;

impl Problem<'_> {
    /// The images in cells about the middle of the membranes.
    fn cells(&self, frame: Frame) -> Vec<Cells> {
        let (width, across) = (frame.width(), 2 * REACH + 1);
        let per_node = STEP_M / frame.cell_m;
        let of = |patch: &Patch| {
            let mut sums = vec![[0f32; 2]; across * across];
            for (y, z, band) in patch.places() {
                let [column, row] = [y, z].map(|node| (f64::from(node) * per_node).round() as i32 + REACH as i32);
                let within = |at: i32| (0..across as i32).contains(&at);
                if within(column) && within(row) {
                    let sum = &mut sums[row as usize * across + column as usize];
                    *sum = [sum[0] + 1.0, sum[1] + band];
                }
            }
            let felt = sums.iter().enumerate().filter(|(_, [count, _])| *count >= 3.0);
            felt.map(|(at, [count, sum])| (at / across * width + at % across, sum / count)).collect()
        };
        self.patches_of(0, PLACES).iter().map(|(_, patch)| of(patch)).collect()
    }

    /// The poses at which the coarse images fit better than all around, the best first.
    fn coarse(&self) -> Vec<State> {
        let frame = self.frame();
        let (side, width) = (frame.side, frame.width());
        let fingers: Vec<(Arc<Turned>, Cells)> = self.turned(frame).into_iter().zip(self.cells(frame)).collect();
        let mut costs = vec![0f32; TURNS * side * side];
        for (at, lanes) in costs.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let (line, column) = (at * LANES / side, at * LANES % side);
            let first = (line / side * width + line % side) * width + column;
            for (turned, cells) in &fingers {
                for (cell, height) in cells {
                    let heights = &turned.0[first + cell..][..LANES];
                    for l in 0..LANES {
                        let off = heights[l] - height;
                        let square = off * off;
                        lanes[l] += if square < CAP_M * CAP_M { square } else { CAP_M * CAP_M };
                    }
                }
            }
        }
        let cost = |turn: usize, row: usize, column: usize| costs[(turn * side + row) * side + column];
        let mut found: Vec<(f32, State)> = Vec::new();
        for (at, own) in costs.iter().enumerate() {
            let (turn, row, column) = (at / (side * side), at / side % side, at % side);
            let turns = [turn + TURNS - 1, turn, turn + 1].map(|turn| turn % TURNS);
            let near = |middle: usize| middle.saturating_sub(1)..(middle + 2).min(side);
            let least = turns.iter().all(|&t| near(row).all(|r| near(column).all(|c| cost(t, r, c) >= *own)));
            if least {
                found.push((*own, frame.state(turn, row, column)));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
            .into_iter()
            .map(|(_, state)| state)
            .filter(|state| self.config.allows(state.to_pose(self.centroid())))
            .take(KEEP[0])
            .collect()
    }

    /// So many ends of the scouts that start all around, the cheapest first.
    pub(super) fn anywhere(&self, descents: &mut Descents<'_, '_>, count: usize) -> Vec<(State, Progress)> {
        let mut runs: Vec<(State, Progress)> = self.coarse().into_iter().map(|at| (at, Progress::new(at))).collect();
        for (stage, worth) in WORTH.into_iter().enumerate() {
            let mut ends: Vec<(State, Progress)> = Vec::with_capacity(runs.len());
            for (start, mut at) in runs {
                descents.descend(ends.len(), &mut at, stage, SCOUTS_WEIGHT);
                match ends.iter_mut().find(|(_, end)| alike(&end.state, &at.state)) {
                    Some(end) if end.1.cost > at.cost => *end = (start, at),
                    Some(_) => {}
                    None => ends.push((start, at)),
                }
            }
            ends.retain(|(_, at)| self.config.allows(at.state.to_pose(self.centroid())));
            ends.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
            ends.truncate(KEEP.get(stage + 1).copied().unwrap_or(count));
            let dearest = ends.first().map_or(0.0, |(_, best)| best.cost * (1.0 + worth));
            ends.retain(|(_, at)| at.cost <= dearest);
            runs = ends;
        }
        runs
    }
}
