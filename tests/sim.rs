//! The simulator: determinism, geometry, mechanics and statistics.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};
use touch2touch_bench::random_tool::random_tool;
use touch2touch_core::catalog::{self, ToolSpec};
use touch2touch_core::grid::Grid;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::mesh::distance::MeshDistance;
use touch2touch_core::rig::{PadId, lab};
use touch2touch_core::sample::{ColorTouch, DepthTouch, Sample};
use touch2touch_core::sim::{self, Grasp, SimConfig};

use crate::support::shared;

fn bubble_of(sample: &Sample, finger: PadId) -> &DepthTouch {
    sample.pad(finger).and_then(|t| t.depth()).expect("both fingers have a bubble")
}

fn gelslim_of(sample: &Sample, finger: PadId) -> &ColorTouch {
    sample.pad(finger).and_then(|t| t.color()).expect("both fingers have a GelSlim")
}

/// The noise-free membrane point behind every pixel, object frame.
fn lifted(sample: &Sample, finger: PadId) -> Grid<DVec3> {
    let touch = bubble_of(sample, finger);
    let (camera, truth) = (touch.camera.as_ref().unwrap(), touch.truth.as_ref().unwrap());
    let object_from_grasp = sample.grasp_from_object.unwrap().inverse().to_affine();
    Grid::from_fn(lab::BUBBLE.width, lab::BUBBLE.height, |u, v| {
        let z = f64::from(camera.depth_reference[(u, v)] - truth.imprint[(u, v)]);
        let p = camera.grasp_from_camera.transform_point3(camera.lift(u as f64, v as f64, z));
        object_from_grasp.transform_point3(p)
    })
}

fn contact_pixels(sample: &Sample, finger: PadId) -> Vec<(usize, usize)> {
    let contact = &bubble_of(sample, finger).truth.as_ref().unwrap().contact;
    (0..lab::BUBBLE.height).flat_map(|v| (0..lab::BUBBLE.width).map(move |u| (u, v))).filter(|&p| contact[p]).collect()
}

/// One sample of each tool and of a few random ones, made once for all tests.
fn a_few() -> &'static [(ToolSpec, Sample)] {
    static SAMPLES: LazyLock<Vec<(ToolSpec, Sample)>> = LazyLock::new(|| {
        let tools = catalog::tools().iter().cloned().chain((0..3).map(random_tool));
        tools
            .enumerate()
            .map(|(i, tool)| {
                let sample = sim::simulate(&tool, sim::random_grasp(i as u64), i as u64, &SimConfig::default());
                (tool, sample)
            })
            .collect()
    });
    &SAMPLES
}

fn same_bits(a: &Sample, b: &Sample) -> bool {
    lab::PADS.iter().all(|&f| {
        let bits = |s: &Sample| -> Vec<u32> {
            let (bubble, gel) = (bubble_of(s, f), gelslim_of(s, f));
            bubble
                .imprint
                .as_slice()
                .iter()
                .chain(gel.difference.as_slice().iter().flatten())
                .map(|v| v.to_bits())
                .collect()
        };
        bits(a) == bits(b)
    })
}

#[test]
fn the_same_seed_gives_the_same_sample_in_any_thread() {
    let tool = &catalog::tools()[4];
    let make = move |seed| sim::simulate(tool, sim::random_grasp(100), seed, &SimConfig::default());
    let here = make(5);
    let there = std::thread::spawn(move || make(5)).join().unwrap();
    assert!(same_bits(&here, &there));
    assert!(!same_bits(&here, &make(6)));
    assert_eq!(SimConfig::randomised(3), SimConfig::randomised(3));
    assert_ne!(SimConfig::randomised(3), SimConfig::randomised(4));
}

/// The catalog's tools and the lab's published CAD models are the same solids.
#[test]
fn the_tools_are_the_labs_own() {
    let Some(folder) = shared("lab-meshes") else { return };
    for tool in catalog::tools() {
        let ours = tool.mesh();
        let labs = touch2touch_pipeline::io::stl::read(&folder.join(format!("{}.stl", tool.name))).unwrap().mesh;
        let farthest = |from: &TriMesh, to: &TriMesh| {
            let distance = MeshDistance::new(to).unwrap();
            let points = from.sample_surface(2_000, 1).into_iter().chain(from.vertices.iter().copied().step_by(4));
            points.map(|p| distance.signed(p).abs()).fold(0.0, f64::max)
        };
        let apart = farthest(&ours, &labs).max(farthest(&labs, &ours));
        // All within 0.05 mm but for one spot: our mesh is coarse where the beads of pattern_32 meet in the rounded corner.
        let most = if tool.name == "pattern_32" { 1.2e-4 } else { 5e-5 };
        assert!(apart <= most, "{}: {:.3} mm apart", tool.name, apart * 1e3);
        assert!((ours.volume() / labs.volume() - 1.0).abs() < 0.01, "{}", tool.name);
    }
}

/// The key property: depth, intrinsics, rig, pose and CAD agree for both fingers.
#[test]
fn contact_points_of_both_fingers_lie_on_the_tool() {
    for (tool, sample) in a_few() {
        let solid = tool.solid();
        for finger in lab::PADS {
            let points = lifted(sample, finger);
            let mut distances: Vec<f64> =
                contact_pixels(sample, finger).iter().map(|&p| solid.signed_distance(points[p]).abs()).collect();
            assert!(distances.len() > 150, "{}: only {} contact pixels", tool.name, distances.len());
            distances.sort_by(f64::total_cmp);
            let median = distances[distances.len() / 2];
            assert!(median < 7e-4, "{} {}: median {median}", tool.name, finger.index());
            assert!(distances[distances.len() - 1] < 1.05e-3, "{} {}", tool.name, finger.index());
        }
    }
}

#[test]
fn the_contact_mask_is_the_labs_signed_distance_rule() {
    for (tool, sample) in a_few() {
        let solid = tool.solid();
        for finger in lab::PADS {
            let contact = &bubble_of(sample, finger).truth.as_ref().unwrap().contact;
            let near = lifted(sample, finger).map(|&p| solid.signed_distance(p) <= 1e-3);
            let both = contact.as_slice().iter().zip(near.as_slice()).filter(|(a, b)| **a && **b).count();
            let either = contact.as_slice().iter().zip(near.as_slice()).filter(|(a, b)| **a || **b).count();
            assert!(both as f64 / either as f64 > 0.98, "{} {}", tool.name, finger.index());
        }
    }
}

#[test]
fn the_membrane_never_enters_the_tool() {
    for (tool, sample) in a_few() {
        let solid = tool.solid();
        for finger in lab::PADS {
            let deepest =
                lifted(sample, finger).as_slice().iter().map(|&p| solid.signed_distance(p)).fold(0.0, f64::min);
            assert!(deepest > -5e-5, "{} {}: {deepest}", tool.name, finger.index());
        }
    }
}

/// A pixel of the GelSlim on a bar's ridge, sent through both cameras, meets the membrane where the bubble has its
/// ridge: the membrane point of that bubble pixel is on the tool.
#[test]
fn gelslim_contact_projects_to_the_ridges_of_the_imprint() {
    for (tool, sample) in a_few() {
        let (solid, grasp_from_object) = (tool.solid(), sample.grasp_from_object.unwrap());
        for finger in lab::PADS {
            let camera = bubble_of(sample, finger).camera.as_ref().unwrap();
            let camera_from_grasp = camera.grasp_from_camera.inverse();
            let contact = &bubble_of(sample, finger).truth.as_ref().unwrap().contact;
            let (mut on, mut all) = (0, 0);
            for row in (0..lab::GELSLIM.height).step_by(8) {
                for column in (0..lab::GELSLIM.width).step_by(8) {
                    let yz = gelslim_yz(finger, column, row);
                    let object = grasp_from_object.inverse().transform_yz(yz);
                    // the ridge only: its flanks are hidden on the side that faces away
                    if solid.height(object).is_none_or(|height| height < tool.half_thickness_m - 2e-4) {
                        continue;
                    }
                    let p = DVec3::new(-sim::outward(finger) * tool.half_thickness_m, yz.x, yz.y);
                    let (u, v) = camera.project(camera_from_grasp.transform_point3(p)).unwrap();
                    all += 1;
                    on += usize::from(contact.get(u.round() as usize, v.round() as usize) == Some(&true));
                }
            }
            assert!(
                all == 0 || f64::from(on as u32) > 0.85 * f64::from(all as u32),
                "{} {}: {on} of {all}",
                tool.name,
                finger.index()
            );
        }
    }
}

/// The (y, z) that a GelSlim's pixel looks at, meters.
fn gelslim_yz(finger: PadId, column: usize, row: usize) -> DVec2 {
    let lens = SimConfig::default().gelslim.lenses[finger.index()];
    sim::gelslim_yz(finger, lens.flat(DVec2::new(column as f64, row as f64)))
}

/// A tool that its half turn about z maps to itself feels the same to both fingers: the images are mirrored
/// (bubble: about the row direction, apart from the cameras' different offsets).
#[test]
fn the_fingers_mirror_each_other() {
    let sample = sim::simulate(&catalog::tools()[5], Grasp::default(), 1, &mirrored());
    let object = |finger| lifted(&sample, finger);
    let (right, left) = (object(lab::RIGHT), object(lab::LEFT));
    // the same (y, z) has mirrored x: compare over a common grid of (y, z)
    let height_at = |points: &Grid<DVec3>, yz: DVec2| {
        points
            .as_slice()
            .iter()
            .min_by(|a, b| {
                let d = |p: &DVec3| (DVec2::new(p.y, p.z) - yz).length_squared();
                d(a).total_cmp(&d(b))
            })
            .map(|p| p.x)
            .unwrap()
    };
    for i in 0..25 {
        let yz = DVec2::new(f64::from(i % 5) - 2.0, f64::from(i / 5) - 2.0) * 0.006;
        let (r, l) = (height_at(&right, yz), height_at(&left, yz));
        assert!(r > 0.0 && l < 0.0);
        assert!((r + l).abs() < 6e-4, "{yz}: {r} {l}");
    }
    // rows run in opposite directions, columns in the same
    let at = |g: &Grid<DVec3>, u, v| g[(u, v)];
    assert!(at(&right, 70, 20).y > at(&right, 70, 120).y && at(&left, 70, 20).y < at(&left, 70, 120).y);
    assert!(at(&right, 20, 70).z > at(&right, 150, 70).z && at(&left, 20, 70).z > at(&left, 150, 70).z);
}

/// The nominal sensors with their bubbles opposite each other.
fn mirrored() -> SimConfig {
    let mut config = SimConfig::default();
    config.bubble.rim_centers_m = [[0.0, -0.028]; 2];
    config
}

struct Moments {
    mean: f64,
    deviation: f64,
    low: f64,
    high: f64,
}

fn moments(values: impl Iterator<Item = f64>) -> Moments {
    let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in values {
        n += 1.0;
        sum += v;
        square += v * v;
        low = low.min(v);
        high = high.max(v);
    }
    let mean = sum / n;
    Moments { mean, deviation: (square / n - mean * mean).sqrt(), low, high }
}

/// The published statistics of the lab's dataset, in bands.
#[test]
fn statistics_are_those_of_the_labs_data() {
    let samples: Vec<Sample> = (0..24)
        .map(|i| {
            let tool = &catalog::tools()[i % 9];
            sim::simulate(tool, sim::random_grasp(900 + i as u64), i as u64, &SimConfig::default())
        })
        .collect();
    let each = || samples.iter().flat_map(|s| lab::PADS.map(|f| (s, f)));

    let m = moments(each().flat_map(|(s, f)| bubble_of(s, f).imprint.as_slice().iter().map(|&v| f64::from(v))));
    assert!((0.0030..0.0066).contains(&m.mean), "imprint mean {}", m.mean);
    assert!((0.0035..0.0060).contains(&m.deviation), "imprint deviation {}", m.deviation);
    assert!((-0.022..-0.004).contains(&m.low) && (0.014..0.032).contains(&m.high), "imprint {} .. {}", m.low, m.high);

    for (c, (mean, deviation)) in [(-0.0107, 0.0687), (-0.0063, 0.0428), (-0.0087, 0.0576)].into_iter().enumerate() {
        let m =
            moments(each().flat_map(|(s, f)| {
                gelslim_of(s, f).difference.as_slice().iter().map(move |p| f64::from(p[c]) / 255.0)
            }));
        assert!((m.mean - mean).abs() < 0.012, "channel {c}: mean {}", m.mean);
        assert!((0.65..1.45).contains(&(m.deviation / deviation)), "channel {c}: deviation {}", m.deviation);
        assert!(m.low > -0.9 && m.high < 0.9, "channel {c}: {} .. {}", m.low, m.high);
    }
    for (c, mean) in [0.2966, 0.3886, 0.5625].into_iter().enumerate() {
        let m = moments(each().flat_map(|(s, f)| {
            let images = gelslim_of(s, f).images.as_ref().unwrap();
            images.raw.as_slice().iter().map(move |p| f64::from(p[c]) / 255.0)
        }));
        assert!((m.mean - mean).abs() < 0.05, "raw channel {c}: mean {}", m.mean);
        assert!(m.low >= 0.0 && m.high <= 1.0);
    }
    for (s, f) in each() {
        let images = gelslim_of(s, f).images.as_ref().unwrap();
        assert!(images.raw.as_slice().iter().flatten().all(|v| v.fract() == 0.0));
    }
}

#[test]
fn random_sensors_and_tools_give_finite_images() {
    for seed in 0..6 {
        let config = SimConfig::randomised(seed);
        let sample = sim::simulate(&random_tool(seed), sim::random_grasp(seed), seed, &config);
        for finger in lab::PADS {
            let touch = bubble_of(&sample, finger);
            assert!(touch.imprint.as_slice().iter().all(|v| v.is_finite() && v.abs() < 0.06));
            assert!(touch.truth.as_ref().unwrap().contact.as_slice().iter().any(|&c| c));
            assert!(gelslim_of(&sample, finger).difference.as_slice().iter().flatten().all(|v| v.abs() <= 255.0));
        }
    }
}
