//! Growing a mask from a few strokes: [`grow_from`].

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::grid::{DepthMap, Grid, Mask};

/// Cost of a step from pixel to pixel besides the depth that it climbs, meters: on a plateau the nearer seed wins.
const STEP_M: f64 = 0.000_02;
/// Micrometers, so that costs have an order without doubt.
const UNITS_PER_M: f64 = 1e6;

/// Each pixel to the seed that is reached from it over the least climbing: to contact or to free.
///
/// Without seeds that are free, the edge of the image is. Pixels without depth belong to no seed and are no contact.
/// `None` without seeds of contact, or if the sizes differ.
pub fn grow_from(imprint: &DepthMap, contact: &Mask, free: &Mask) -> Option<Mask> {
    let (width, height) = (imprint.width(), imprint.height());
    if contact.size() != imprint.size() || free.size() != imprint.size() || !contact.as_slice().contains(&true) {
        return None;
    }
    let edge = !free.as_slice().contains(&true);
    let on_edge = |x: usize, y: usize| edge && (x == 0 || y == 0 || x + 1 == width || y + 1 == height);
    let mut cost = Grid::filled(width, height, u64::MAX);
    let mut owner = Mask::filled(width, height, false);
    let mut queue = BinaryHeap::new();
    for y in 0..height {
        for x in 0..width {
            let is_contact = contact[(x, y)];
            if (is_contact || free[(x, y)] || on_edge(x, y)) && imprint[(x, y)].is_finite() {
                cost[(x, y)] = 0;
                owner[(x, y)] = is_contact;
                queue.push(Reverse((0u64, y, x)));
            }
        }
    }
    while let Some(Reverse((so_far, y, x))) = queue.pop() {
        if so_far > cost[(x, y)] {
            continue;
        }
        let depth = f64::from(imprint[(x, y)]);
        for (nx, ny) in [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)] {
            let Some(there) = imprint.get(nx, ny).filter(|depth| depth.is_finite()) else { continue };
            let climb = (f64::from(*there) - depth).abs() + STEP_M;
            // Saturates: a damaged depth is far from everything.
            let next = so_far.saturating_add((climb * UNITS_PER_M) as u64);
            if next < cost[(nx, ny)] {
                cost[(nx, ny)] = next;
                owner[(nx, ny)] = owner[(x, y)];
                queue.push(Reverse((next, ny, nx)));
            }
        }
    }
    Some(owner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_grows_to_the_step_and_stops_at_the_other() {
        // A plateau 8 mm deep in a rest of 1 mm, with a slope of 5 px between.
        let imprint = DepthMap::from_fn(60, 40, |x, _| match x {
            0..20 => 0.001,
            20..25 => 0.001 + 0.0014 * (x as f32 - 19.5),
            _ => 0.008,
        });
        let dot = |x, y| Mask::from_fn(60, 40, |px, py| px == x && py == y);
        let none = Mask::filled(60, 40, false);
        let grown = grow_from(&imprint, &dot(40, 20), &dot(5, 5)).unwrap();
        assert!((0..40).all(|y| grown[(25, y)] && grown[(59, y)] && !grown[(19, y)]));
        assert_eq!(grow_from(&imprint, &none, &dot(5, 5)), None);
        assert_eq!(grow_from(&imprint, &Mask::filled(2, 2, true), &none), None);
        // Without a free stroke the edge is free.
        let bump =
            DepthMap::from_fn(60, 40, |x, y| if (15..45).contains(&x) && (10..30).contains(&y) { 0.006 } else { 0.0 });
        let grown = grow_from(&bump, &dot(30, 20), &none).unwrap();
        assert_eq!(grown.as_slice().iter().filter(|v| **v).count(), 30 * 20);
        let nan = DepthMap::filled(60, 40, f32::NAN);
        assert!(grow_from(&nan, &dot(30, 20), &none).unwrap() == none);
        let mut holes = bump.clone();
        (holes[(20, 20)], holes[(21, 20)]) = (f32::NAN, f32::INFINITY);
        assert!(!grow_from(&holes, &dot(30, 20), &none).unwrap()[(20, 20)]);
    }
}
