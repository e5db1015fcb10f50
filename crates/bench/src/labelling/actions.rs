//! Work of a person on a mask: pre-labeled grasps corrected by a scripted one, for each way to begin.
//!
//! The person knows the true contact, and of all that hands can do next takes what mends most: a clean-up by key or button
//! (at the size that is set, 1 mm), a line around what is missing or too much, drawn with [`JITTER_PX`] of unsteadiness, or
//! a key that clears the mask and a line around the whole contact.
//! Times are those of the keystroke-level model (Card, Moran and Newell 1980) and of following an outline, besides what the
//! program itself takes.

use std::sync::Arc;
use std::time::Instant;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore as _, SeedableRng as _};
use serde::Serialize;
use strum::IntoEnumIterator as _;

use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{CleanKind, CleanUp, DrawTool, Drawing, Ground, Paint, Provenance, grow, iou, islands};
use touch2touch_core::rig::Rig;
use touch2touch_work::labels::DrawnMask;

/// The IoU with the true contact at which a mask is done.
pub(super) const TARGET: f64 = 0.95;
/// Steps after which the person gives a mask up.
const MOST: usize = 12;
/// To decide what to do next, seconds.
const DECIDE_S: f64 = 1.35;
/// To press a key, seconds.
const KEY_S: f64 = 0.28;
/// To point at something, seconds.
const POINT_S: f64 = 1.1;
/// To press or let go of a button of the mouse, seconds.
const BUTTON_S: f64 = 0.1;
/// Speed of a hand that follows an outline, image pixels per second.
const TRACE_PX_PER_S: f64 = 50.0;
/// Distance of a drawn line from where it should be, standard deviation, pixels.
const JITTER_PX: f32 = 0.5;
/// Pixels from point to point of a drawn line.
const POINT_EVERY: usize = 3;
/// Distance of a line beyond what is wrong where that does no harm, pixels.
const SLOPPY_PX: f64 = 2.0;
/// Regions that a person looks at in turn, the largest first.
const REGIONS: usize = 3;
/// An outline around fewer pixels than this is not drawn.
const SMALLEST_HOLE_PX: f32 = 6.0;

/// Begin of a person's work.
pub(super) struct Begin {
    /// The mask in force, or that of the proposal.
    pub mask: Mask,
    /// Keys pressed before the first correction: to propose and to accept.
    pub keys: usize,
    /// Keys pressed to take it over where nothing is to be corrected.
    pub keys_as_it_is: usize,
    /// Time that the program took to make it, milliseconds.
    pub ms: f64,
}

/// Work on one mask.
#[derive(Clone, Copy, Debug)]
struct Took {
    begun_iou: f64,
    iou: f64,
    actions: usize,
    strokes: usize,
    seconds: f64,
    own_ms: f64,
}

/// Work on masks that began in one way, means over fingers.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub way: &'static str,
    pub masks: usize,
    /// IoU with the true contact before and after.
    pub begun_iou: f64,
    pub iou: f64,
    /// Keys, buttons and strokes.
    pub actions: f64,
    pub strokes: f64,
    /// By the model of a person.
    pub seconds: f64,
    /// Time that the program took: proposals, drawing, packing for undo and file; milliseconds.
    pub own_ms: f64,
    /// Share of the masks that reached the target.
    pub reached: f64,
}

/// A person who corrects masks that began in one way.
pub(super) struct Person {
    rig: Arc<Rig>,
    random: ChaCha8Rng,
    /// True where the lasso is in hand: it stays so from mask to mask.
    lasso: bool,
    took: Vec<Took>,
}

/// Something that hands can do next.
struct Move {
    /// Acts in their order.
    does: Vec<Does>,
    actions: usize,
    seconds: f64,
}

enum Does {
    Draw(Drawing),
    Clean(CleanUp),
}

impl Move {
    /// This, and another one after it.
    fn then(self, next: Move) -> Self {
        let does = self.does.into_iter().chain(next.does).collect();
        // It is decided once for both.
        Self { does, actions: self.actions + next.actions, seconds: self.seconds + next.seconds - DECIDE_S }
    }

    fn on(&self, hand: &mut DrawnMask, imprint: &DepthMap, rig: &Rig) {
        for does in &self.does {
            match does {
                Does::Draw(drawing) => {
                    hand.draw(drawing, Ground::new(imprint), Provenance::hand("script"));
                }
                Does::Clean(clean_up) => {
                    hand.clean(*clean_up, rig);
                }
            }
        }
    }
}

impl Person {
    pub(super) fn new(seed: u64) -> Self {
        Self { rig: Rig::lab(), random: ChaCha8Rng::seed_from_u64(seed), lasso: false, took: Vec::new() }
    }

    /// Corrects one mask until it is good enough, nothing helps any more, or patience ends.
    pub(super) fn correct(&mut self, begin: Begin, truth: &Mask, imprint: &DepthMap) {
        let begun_iou = iou(&begin.mask, truth);
        let mut hand = DrawnMask::new(begin.mask, Provenance::Nothing);
        let mut took = Took {
            begun_iou,
            iou: begun_iou,
            actions: begin.keys,
            strokes: 0,
            seconds: DECIDE_S + begin.keys as f64 * KEY_S,
            own_ms: begin.ms,
        };
        for _ in 0..MOST {
            if took.iou >= TARGET {
                break;
            }
            let Some((step, after)) = self.best(&hand, took.iou, truth, imprint) else { break };
            let start = Instant::now();
            step.on(&mut hand, imprint, &self.rig);
            let packed = serde_json::to_vec(&hand.pack()).map_or(0, |bytes| bytes.len());
            took.own_ms += start.elapsed().as_secs_f64() * 1e3;
            log::debug!("{:.3} -> {after:.3}, {packed} bytes", took.iou);
            let strokes = step.does.iter().filter(|does| matches!(does, Does::Draw(_))).count();
            self.lasso |= strokes > 0;
            took.strokes += strokes;
            took.actions += step.actions;
            took.seconds += step.seconds;
            took.iou = after;
        }
        if took.actions == begin.keys {
            took.actions += begin.keys_as_it_is;
            took.seconds += begin.keys_as_it_is as f64 * KEY_S;
        }
        self.took.push(took);
    }

    /// Move that mends most for each action, and the IoU after it; where several make the mask good enough, that of the
    /// fewest actions, then of the least time.
    fn best(&mut self, hand: &DrawnMask, now: f64, truth: &Mask, imprint: &DepthMap) -> Option<(Move, f64)> {
        /// A gain that nobody sees is none.
        const LEAST: f64 = 1e-3;
        let mut moves: Vec<Move> = CleanKind::iter().map(clean_up).collect();
        moves.extend(self.lines(&hand.mask, truth));
        moves.extend(self.anew(truth));
        let tried = moves.into_iter().filter_map(|step| {
            let mut after = hand.clone();
            step.on(&mut after, imprint, &self.rig);
            let after = iou(&after.mask, truth);
            (after > now + LEAST).then_some((step, after))
        });
        let worth = |(step, after): &(Move, f64)| match *after >= TARGET {
            true => [1.0, -(step.actions as f64), -step.seconds],
            // As if each action mended the same share of what is still wrong.
            false => [0.0, ((1.0 - now) / (1.0 - after)).ln() / step.actions as f64, 0.0],
        };
        tried.max_by(|a, b| worth(a).partial_cmp(&worth(b)).unwrap_or(std::cmp::Ordering::Equal))
    }

    /// Lines around what is missing and around what is too much.
    fn lines(&mut self, mask: &Mask, truth: &Mask) -> Vec<Move> {
        let mut moves = Vec::new();
        for paint in [Paint::Contact, Paint::Free] {
            let add = paint == Paint::Contact;
            // What is wrong, and where a line may go without harm.
            let wrong = Mask::from_fn(mask.width(), mask.height(), |x, y| mask[(x, y)] != add && truth[(x, y)] == add);
            let near = grow(&wrong, SLOPPY_PX);
            let harmless = Mask::from_fn(mask.width(), mask.height(), |x, y| truth[(x, y)] == add);
            let within = Mask::from_fn(mask.width(), mask.height(), |x, y| near[(x, y)] && harmless[(x, y)]);
            let mut regions = largest(&within, &wrong);
            if add {
                // The whole contact anew, in one line.
                regions.extend(largest(&harmless, &wrong));
            }
            moves.extend(regions.iter().filter_map(|region| self.around(region, paint)));
        }
        moves
    }

    /// The mask cleared, and a line around the largest part of the contact.
    fn anew(&mut self, truth: &Mask) -> Option<Move> {
        let whole = largest(truth, truth).into_iter().next()?;
        Some(clean_up(CleanKind::Clear).then(self.around(&whole, Paint::Contact)?))
    }

    /// A line around a region; `None` for an empty one.
    fn around(&mut self, region: &Mask, paint: Paint) -> Option<Move> {
        let line = path(region)?;
        let length: f64 = line.windows(2).map(|p| f64::from((p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))).sum();
        let points = line.iter().map(|p| p.map(|v| v + JITTER_PX * self.normal())).collect();
        let drawing = Drawing { tool: DrawTool::Lasso, points, paint, sight: None };
        let key = usize::from(!self.lasso);
        let seconds = DECIDE_S + POINT_S + 2.0 * BUTTON_S + length / TRACE_PX_PER_S + key as f64 * KEY_S;
        Some(Move { does: vec![Does::Draw(drawing)], actions: 1 + key, seconds })
    }

    /// Nearly normal, of standard deviation 1: the sum of four uniform numbers.
    fn normal(&mut self) -> f32 {
        let sum: f32 = (0..4).map(|_| (self.random.next_u32() >> 8) as f32 / (1 << 24) as f32 - 0.5).sum();
        sum * 3f32.sqrt()
    }

    /// Row of all masks; `None` without any.
    pub(super) fn row(&self, way: &'static str) -> Option<Row> {
        let masks = self.took.len();
        let mean = |of: &dyn Fn(&Took) -> f64| self.took.iter().map(of).sum::<f64>() / masks as f64;
        (masks > 0).then(|| Row {
            way,
            masks,
            begun_iou: mean(&|took| took.begun_iou),
            iou: mean(&|took| took.iou),
            actions: mean(&|took| took.actions as f64),
            strokes: mean(&|took| took.strokes as f64),
            seconds: mean(&|took| took.seconds),
            own_ms: mean(&|took| took.own_ms),
            reached: mean(&|took| f64::from(u8::from(took.iou >= TARGET))),
        })
    }
}

/// A clean-up at 1 mm: three of them have keys, the others are buttons.
fn clean_up(kind: CleanKind) -> Move {
    let by_key = matches!(kind, CleanKind::FillHoles | CleanKind::LargestIsland | CleanKind::Clear);
    let seconds = DECIDE_S + if by_key { KEY_S } else { POINT_S + 2.0 * BUTTON_S };
    Move { does: vec![Does::Clean(CleanUp::from(kind))], actions: 1, seconds }
}

/// The islands of a mask with the most pixels of another one in them, apart.
fn largest(mask: &Mask, of: &Mask) -> Vec<Mask> {
    let (labels, sizes) = islands(mask);
    let mut counts: Vec<(usize, u32)> = (1..=sizes.len() as u32).map(|label| (0, label)).collect();
    for (label, counted) in labels.as_slice().iter().zip(of.as_slice()) {
        if *counted && let Some(entry) = (*label as usize).checked_sub(1).and_then(|index| counts.get_mut(index)) {
            entry.0 += 1;
        }
    }
    counts.sort_by(|a, b| b.cmp(a));
    let regions = counts.into_iter().filter(|(count, _)| *count > 0).take(REGIONS);
    regions.map(|(_, label)| labels.map(|l| *l == label)).collect()
}

/// One line that encloses the pixels of a region and leaves its holes out: around it, and by the shortest way to each hole,
/// around that and back. `None` for an empty region.
fn path(region: &Mask) -> Option<Vec<[f32; 2]>> {
    let mut loops = outlines(region);
    loops.sort_by(|a, b| area(b).abs().total_cmp(&area(a).abs()));
    let mut loops = loops.into_iter();
    let mut line = smooth(&loops.next()?);
    for hole in loops.filter(|hole| area(hole).abs() >= SMALLEST_HOLE_PX) {
        let hole = smooth(&hole);
        let distance = |a: &[f32; 2], b: &[f32; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let pairs = (0..line.len()).flat_map(|i| (0..hole.len()).map(move |j| (i, j)));
        let nearest =
            pairs.min_by(|a, b| distance(&line[a.0], &hole[a.1]).total_cmp(&distance(&line[b.0], &hole[b.1])));
        let Some((index, from)) = nearest else { continue };
        let around = hole[from..].iter().chain(&hole[..=from]).copied();
        let detour: Vec<[f32; 2]> = around.chain([line[index]]).collect();
        line.splice(index + 1..index + 1, detour);
    }
    Some(line)
}

/// Twice the signed area that a closed line encloses, halved.
fn area(line: &[[f32; 2]]) -> f32 {
    let next = line.iter().cycle().skip(1);
    0.5 * line.iter().zip(next).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f32>()
}

/// Every [`POINT_EVERY`]th corner of a closed outline, in the middle of its neighbors.
fn smooth(outline: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let n = outline.len();
    let middle = |i: usize| {
        let [a, b, c] = [outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]];
        [(a[0] + 2.0 * b[0] + c[0]) / 4.0, (a[1] + 2.0 * b[1] + c[1]) / 4.0]
    };
    (0..n).step_by(POINT_EVERY.min((n / 6).max(1))).map(middle).collect()
}

/// The closed lines between the pixels of a mask and what is outside, corner by corner; `(0, 0)` is the center of the first
/// pixel.
fn outlines(mask: &Mask) -> Vec<Vec<[f32; 2]>> {
    let inside = |x: i32, y: i32| {
        let pixel = usize::try_from(x).ok().zip(usize::try_from(y).ok());
        pixel.is_some_and(|(x, y)| mask.get(x, y) == Some(&true))
    };
    // From each corner where the edges lead that have the mask at their right.
    let mut edges: std::collections::BTreeMap<(i32, i32), Vec<(i32, i32)>> = std::collections::BTreeMap::new();
    for (y, x) in (0..mask.height() as i32).flat_map(|y| (0..mask.width() as i32).map(move |x| (y, x))) {
        if !inside(x, y) {
            continue;
        }
        for (outside, from, to) in [
            (!inside(x, y - 1), (x, y), (x + 1, y)),
            (!inside(x + 1, y), (x + 1, y), (x + 1, y + 1)),
            (!inside(x, y + 1), (x + 1, y + 1), (x, y + 1)),
            (!inside(x - 1, y), (x, y + 1), (x, y)),
        ] {
            if outside {
                edges.entry(from).or_default().push(to);
            }
        }
    }
    let mut outlines = Vec::new();
    while let Some((&start, _)) = edges.first_key_value() {
        let (mut line, mut corner) = (Vec::new(), start);
        while let Some(next) = edges.get_mut(&corner).and_then(Vec::pop) {
            if edges.get(&corner).is_some_and(Vec::is_empty) {
                edges.remove(&corner);
            }
            line.push([corner.0 as f32 - 0.5, corner.1 as f32 - 0.5]);
            corner = next;
        }
        outlines.push(line);
    }
    outlines
}

/// The rows as a table.
pub(super) fn text(rows: &[Row]) -> String {
    let mut lines = vec![
        format!(
            "corrected by a scripted person to an IoU of {TARGET} (keys, buttons and strokes; seconds by the keystroke-level \
             model):"
        ),
        "| begun from | IoU | actions | of them strokes | seconds | program, ms | IoU after | reached |".into(),
        "|---|---|---|---|---|---|---|---|".into(),
    ];
    lines.extend(rows.iter().map(|row| {
        format!(
            "| {} | {:.2} | {:.1} | {:.1} | {:.1} | {:.0} | {:.3} | {:.0} % |",
            row.way,
            row.begun_iou,
            row.actions,
            row.strokes,
            row.seconds,
            row.own_ms,
            row.iou,
            row.reached * 100.0
        )
    }));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(cx: f64, cy: f64, radius: f64) -> Mask {
        Mask::from_fn(80, 60, |x, y| (x as f64 - cx).hypot(y as f64 - cy) <= radius)
    }

    fn enclosed(line: &[[f32; 2]]) -> Mask {
        let drawing = Drawing { tool: DrawTool::Lasso, points: line.to_vec(), paint: Paint::Contact, sight: None };
        let mut touched = Mask::filled(80, 60, false);
        drawing.touch(&mut touched, Ground::new(&DepthMap::filled(80, 60, 0.0)), 0);
        touched
    }

    #[test]
    fn an_outline_encloses_what_it_is_of_and_leaves_holes_out() {
        let ring = Mask::from_fn(80, 60, |x, y| disc(40.0, 30.0, 20.0)[(x, y)] && !disc(42.0, 31.0, 12.0)[(x, y)]);
        assert_eq!(outlines(&ring).len(), 2);
        assert!(iou(&enclosed(&path(&ring).unwrap()), &ring) > 0.93);
        let dot = Mask::from_fn(80, 60, |x, y| (x, y) == (5, 5));
        assert_eq!(outlines(&dot).iter().map(Vec::len).collect::<Vec<_>>(), [4]);
        assert_eq!(enclosed(&path(&dot).unwrap()), dot);
        assert_eq!(path(&Mask::filled(80, 60, false)), None);
    }

    #[test]
    fn a_person_mends_what_is_wrong_and_leaves_what_is_right() {
        let (truth, imprint) = (disc(40.0, 30.0, 20.0), DepthMap::filled(80, 60, 0.005));
        let begin = |mask| Begin { mask, keys: 0, keys_as_it_is: 1, ms: 0.0 };
        let took = |mask| {
            let mut person = Person::new(3);
            person.correct(begin(mask), &truth, &imprint);
            person.row("test").unwrap()
        };
        let right = took(truth.clone());
        assert_eq!((right.actions, right.strokes, right.iou), (1.0, 0.0, 1.0), "taken over by one key");
        // A hole: one key.
        let holed = Mask::from_fn(80, 60, |x, y| truth[(x, y)] && !disc(40.0, 30.0, 8.0)[(x, y)]);
        let mended = took(holed);
        assert_eq!((mended.actions, mended.strokes, mended.reached), (1.0, 0.0, 1.0));
        // Nothing: the tool and a line around it.
        let nothing = took(Mask::filled(80, 60, false));
        assert!(nothing.strokes >= 1.0 && nothing.iou > 0.9 && nothing.seconds > 3.0, "{nothing:?}");
        // Too much beside it: cut off.
        let too_much = Mask::from_fn(80, 60, |x, y| truth[(x, y)] || (x > 50 && (25..35).contains(&y)));
        let cut = took(too_much);
        assert!(cut.reached == 1.0 && cut.actions <= 3.0, "{cut:?}");
    }
}
