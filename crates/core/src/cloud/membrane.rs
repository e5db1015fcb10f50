//! The membrane as a surface to be looked at: [`membrane`]. Depth is filtered in the pixel grid, because triangles between
//! noisy pixels look like scales. For display alone: no registration may see what was smoothed here.

use rayon::prelude::*;

use super::{CloudError, check, lift_depth, usable_depth};
use crate::grid::{DepthMap, Grid};
use crate::mesh::TriMesh;
use crate::sample::DepthCamera;

/// Neighbors whose depths differ by more are no surface: the membrane jumps there, or a pixel flies, meters.
const JUMP_M: f64 = 0.005;
/// Pixels between the corners of the triangles: what is smoothed has no more to show.
const STEP: usize = 3;
/// Largest hole that is closed, pixels; a hole at the border of the picture is none.
const HOLE: usize = 600;
/// Sweeps that carry the depths around a hole into it.
const SWEEPS: usize = 60;
/// Passes of the smoothing: pixels between the taps, and the deviation over depths, meters. Wider and stricter from pass to
/// pass: noise lies within, the flank of a contact beyond.
const PASSES: [(usize, f64); 3] = [(1, 0.003), (2, 0.002_5), (4, 0.002)];
/// Weights of the taps from the middle outwards.
const TAPS: [f64; 3] = [6.0, 4.0, 1.0];

/// The surface of a membrane, smoothed for the eye: meters, grasp frame.
///
/// Flying pixels give way to the median around them, holes are closed, noise is smoothed and the shape of the contact kept.
/// No triangle spans a jump in depth, and none lies beyond the measured border.
///
/// # Errors
/// [`CloudError`] if sizes differ or the camera's numbers cannot be right.
pub fn membrane(imprint: &DepthMap, camera: &DepthCamera) -> Result<TriMesh, CloudError> {
    check(imprint, camera)?;
    let raw = Grid::from_fn(imprint.width(), imprint.height(), |x, y| {
        usable_depth(imprint[(x, y)], camera.depth_reference[(x, y)]).map_or(f64::NAN, f64::from)
    });
    let mut depth = median(&raw);
    close_holes(&mut depth);
    for (step, within_m) in PASSES {
        depth = smoothed(&depth, step, within_m);
    }
    Ok(triangles(&depth, camera))
}

/// Neighbors of a pixel within `reach`, itself among them.
fn around(image: &Grid<f64>, [x, y]: [usize; 2], reach: usize) -> impl Iterator<Item = ([usize; 2], f64)> + '_ {
    let [width, height] = image.size();
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    rows.flat_map(move |v| columns.clone().map(move |u| ([u, v], image[(u, v)])))
}

/// The median of 3 x 3 pixels where there is a depth; a depth that stands alone is dropped.
fn median(image: &Grid<f64>) -> Grid<f64> {
    Grid::from_fn(image.width(), image.height(), |x, y| {
        if !image[(x, y)].is_finite() {
            return f64::NAN;
        }
        let mut found: Vec<f64> = around(image, [x, y], 1).map(|(_, z)| z).filter(|z| z.is_finite()).collect();
        if found.len() < 3 {
            return f64::NAN;
        }
        let middle = found.len() / 2;
        *found.select_nth_unstable_by(middle, f64::total_cmp).1
    })
}

/// Fills holes that are small and have depths all around: each begins at their mean and is relaxed towards a surface of the
/// least bending between them.
fn close_holes(depth: &mut Grid<f64>) {
    let [width, height] = depth.size();
    let mut seen = Grid::filled(width, height, false);
    for start in (0..height).flat_map(|y| (0..width).map(move |x| [x, y])) {
        if seen[(start[0], start[1])] || depth[(start[0], start[1])].is_finite() {
            continue;
        }
        let (hole, rim) = hole(depth, &mut seen, start);
        let enclosed = hole.iter().all(|[x, y]| *x > 0 && *y > 0 && x + 1 < width && y + 1 < height);
        if !enclosed || hole.len() > HOLE || rim.is_empty() {
            continue;
        }
        let mean = rim.iter().sum::<f64>() / rim.len() as f64;
        for [x, y] in &hole {
            depth[(*x, *y)] = mean;
        }
        for _ in 0..SWEEPS {
            for &[x, y] in &hole {
                let four = depth[(x - 1, y)] + depth[(x + 1, y)] + depth[(x, y - 1)] + depth[(x, y + 1)];
                depth[(x, y)] = 0.25 * four;
            }
        }
    }
}

/// The pixels without a depth that hang together with `start`, and the depths along their border.
fn hole(depth: &Grid<f64>, seen: &mut Grid<bool>, start: [usize; 2]) -> (Vec<[usize; 2]>, Vec<f64>) {
    let (mut pixels, mut rim) = (vec![start], Vec::new());
    seen[(start[0], start[1])] = true;
    let mut next = 0;
    while let Some(&[x, y]) = pixels.get(next) {
        next += 1;
        let sides = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
        for (u, v) in sides {
            match depth.get(u, v) {
                Some(z) if z.is_finite() => rim.push(*z),
                Some(_) if !seen[(u, v)] => {
                    seen[(u, v)] = true;
                    pixels.push([u, v]);
                }
                _ => {}
            }
        }
    }
    (pixels, rim)
}

/// One pass of smoothing (the edge-avoiding wavelets of Dammertz 2010): each neighbor counts by its distance in the picture and
/// in depth.
fn smoothed(image: &Grid<f64>, step: usize, within_m: f64) -> Grid<f64> {
    let [width, height] = image.size();
    let pixel = |[x, y]: [usize; 2]| {
        let own = image[(x, y)];
        if !own.is_finite() {
            return own;
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        let reach = TAPS.len() - 1;
        for (i, j) in (0..=2 * reach).flat_map(|j| (0..=2 * reach).map(move |i| (i, j))) {
            let (u, v) = ((x + i * step).wrapping_sub(reach * step), (y + j * step).wrapping_sub(reach * step));
            let Some(z) = image.get(u, v).filter(|z| z.is_finite()) else { continue };
            let off = (z - own) / within_m;
            // A rational fall-off: as wide as a bell at the noise, and far cheaper.
            let weight = TAPS[i.abs_diff(reach)] * TAPS[j.abs_diff(reach)] / (1.0 + off * off * off * off);
            sum += weight * z;
            weights += weight;
        }
        sum / weights
    };
    let rows = (0..height).into_par_iter();
    let all = rows.flat_map_iter(|y| (0..width).map(move |x| [x, y])).map(pixel).collect();
    Grid::from_vec(width, height, all).unwrap_or_else(|_| image.clone())
}

/// Triangles between every [`STEP`]-th pixel of a row and column, where the depths between hang together.
fn triangles(depth: &Grid<f64>, camera: &DepthCamera) -> TriMesh {
    let [width, height] = depth.size();
    let [columns, rows] = [width, height].map(|n| n.saturating_sub(1) / STEP);
    let mut mesh = TriMesh::default();
    let mut index = Grid::filled(columns + 1, rows + 1, None);
    let mut corner = |mesh: &mut TriMesh, u: usize, v: usize| {
        *index[(u, v)].get_or_insert_with(|| {
            let (x, y) = (u * STEP, v * STEP);
            mesh.vertices.push(lift_depth(depth[(x, y)], camera, x, y));
            (mesh.vertices.len() - 1) as u32
        })
    };
    for (u, v) in (0..rows).flat_map(|v| (0..columns).map(move |u| (u, v))) {
        if !is_whole(depth, [u * STEP, v * STEP]) {
            continue;
        }
        let corners = [(u, v), (u + 1, v), (u, v + 1), (u + 1, v + 1)].map(|(u, v)| corner(&mut mesh, u, v));
        let [a, b, c, d] = corners;
        mesh.triangles.extend([[a, c, b], [b, c, d]]);
    }
    mesh
}

/// True where a cell from the pixel `[x, y]` to the next corners has all its depths and none of them jumps.
fn is_whole(depth: &Grid<f64>, [x, y]: [usize; 2]) -> bool {
    let at = |u: usize, v: usize| depth.get(x + u, y + v).copied().filter(|z| z.is_finite());
    let near = |a: Option<f64>, b: Option<f64>| matches!((a, b), (Some(a), Some(b)) if (a - b).abs() <= JUMP_M);
    (0..=STEP).all(|u| (0..STEP).all(|v| near(at(u, v), at(u, v + 1)) && near(at(v, u), at(v + 1, u))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;
    use glam::DVec3;

    const SIZE: [usize; 2] = [120, 90];

    /// A dome of 6 mm with noise of `noise_m` from pixel to pixel.
    fn dome(noise_m: f64) -> DepthMap {
        DepthMap::from_fn(SIZE[0], SIZE[1], |x, y| {
            let r = ((x as f64 - 60.0) / 40.0).hypot((y as f64 - 45.0) / 30.0);
            let noise = f64::from((x as u32 * 7919 + y as u32 * 104_729) % 2001) / 1000.0 - 1.0;
            (0.006 * (1.0 - r * r).max(0.0) + noise_m * noise) as f32
        })
    }

    fn of(imprint: &DepthMap) -> TriMesh {
        membrane(imprint, &fixture::camera(SIZE[0], SIZE[1])).unwrap()
    }

    /// The pixel of each corner.
    fn pixels(mesh: &TriMesh) -> Vec<[f64; 2]> {
        let camera = fixture::camera(SIZE[0], SIZE[1]);
        let pixel = |p: &DVec3| {
            let (u, v) = camera.project(camera.grasp_from_camera.inverse().transform_point3(*p)).unwrap();
            [u, v]
        };
        mesh.vertices.iter().map(pixel).collect()
    }

    /// The largest angle between triangles beside each other, radians.
    fn roughest(mesh: &TriMesh) -> f64 {
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
            (b - a).cross(c - a).normalize()
        };
        let pairs = mesh.triangles.chunks(2).map(|two| normal(&two[0]).angle_between(normal(&two[1])));
        pairs.fold(0.0, f64::max)
    }

    #[test]
    fn noise_is_smoothed_and_the_shape_kept() {
        let (clean, noisy) = (of(&dome(0.0)), of(&dome(0.0006)));
        assert_eq!(clean.triangles.len(), noisy.triangles.len());
        // From one pixel to the next, noise turns a normal by up to a right angle.
        assert!(roughest(&noisy) < 0.35, "{}", roughest(&noisy));
        let camera = fixture::camera(SIZE[0], SIZE[1]);
        let exact = super::super::lift(&dome(0.0), &camera, None).unwrap();
        let off = noisy.vertices.iter().zip(pixels(&noisy)).map(|(p, [x, y])| {
            let index = y.round() as usize * SIZE[0] + x.round() as usize;
            p.distance(exact.points[index])
        });
        let most = off.fold(0.0, f64::max);
        assert!(most < 0.000_6, "{most} m from the true shape");
    }

    #[test]
    fn holes_are_closed_and_flying_pixels_pulled_back() {
        let whole = of(&dome(0.0));
        let mut broken = dome(0.0);
        for (x, y) in (0..90).map(|i| (50 + i % 10, 40 + i / 10)) {
            broken[(x, y)] = f32::NAN;
        }
        broken[(80, 20)] = 0.03;
        let mended = of(&broken);
        assert_eq!(mended.triangles.len(), whole.triangles.len());
        let most = mended.vertices.iter().zip(&whole.vertices).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(most < 0.000_5, "{most} m from the whole surface");
    }

    #[test]
    fn no_triangle_spans_a_jump_or_leaves_the_measured_part() {
        let mut step = DepthMap::from_fn(SIZE[0], SIZE[1], |x, _| if x < 60 { 0.0 } else { 0.012 });
        for y in 0..SIZE[1] {
            for x in 0..15 {
                step[(x, y)] = f32::NAN;
            }
        }
        let mesh = of(&step);
        let pixels = pixels(&mesh);
        assert!(pixels.iter().all(|[x, _]| *x > 14.5), "beyond the measured border");
        for triangle in &mesh.triangles {
            let sides = triangle.map(|i| pixels[i as usize][0] < 59.5);
            assert!(sides.iter().all(|side| *side == sides[0]), "a triangle over the jump");
        }
        assert!(mesh.triangles.len() > 1500, "{}", mesh.triangles.len());
    }

    #[test]
    fn nothing_is_made_of_nothing() {
        assert!(of(&DepthMap::filled(SIZE[0], SIZE[1], f32::NAN)).triangles.is_empty());
        let camera = fixture::camera(1, 1);
        assert!(membrane(&DepthMap::filled(1, 1, 0.0), &camera).unwrap().triangles.is_empty());
        assert!(membrane(&dome(0.0), &camera).is_err());
    }
}
