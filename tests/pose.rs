//! Depth to pose on synthetic grasps with known truth, made by an independent membrane model.

use std::path::Path;
use std::time::Instant;

use glam::{DAffine3, DMat3, DVec3};
use touch2touch::domain::grid::{DepthMap, Mask};
use touch2touch::domain::mesh::TriMesh;
use touch2touch::domain::pose::{Engine, FingerInput, ToolModel, estimate};
use touch2touch::domain::sample::BubbleCamera;
use touch2touch::domain::sensor::Intrinsics;
use touch2touch::domain::units::angle_error;

use crate::support::{Npz, shared};

struct Case {
    imprints: [DepthMap; 2],
    cameras: [BubbleCamera; 2],
    masks: [Mask; 2],
    theta_rad: f64,
    yz: [f64; 2],
    tool: usize,
    stratum: usize,
}

fn read_case(path: &Path) -> Case {
    let mut npz = Npz::open(path);
    let reference = npz.read("depth_ref");
    let depth = npz.read("depth");
    let mask = npz.read("mask");
    let k = npz.read("K");
    let t = npz.read("T");
    let pixels = 140 * 175;
    let map = |values: &[f64], finger: usize| {
        let part = &values[finger * pixels..(finger + 1) * pixels];
        DepthMap::from_vec(175, 140, part.iter().map(|&v| v as f32).collect()).unwrap()
    };
    let camera = |finger: usize| {
        let k = &k[finger * 9..];
        let t = &t[finger * 16..];
        let column = |c: usize| DVec3::new(t[c], t[4 + c], t[8 + c]);
        BubbleCamera {
            depth_reference: map(&reference, finger),
            intrinsics: Intrinsics { fx: k[0], fy: k[4], cx: k[2], cy: k[5] },
            grasp_from_camera: DAffine3::from_mat3_translation(
                DMat3::from_cols(column(0), column(1), column(2)),
                column(3),
            ),
        }
    };
    let imprint = |finger: usize| {
        let (reference, depth) = (map(&reference, finger), map(&depth, finger));
        DepthMap::from_fn(175, 140, |x, y| reference[(x, y)] - depth[(x, y)])
    };
    let yz = npz.read("yz");
    Case {
        imprints: [imprint(0), imprint(1)],
        cameras: [camera(0), camera(1)],
        masks: [0, 1].map(|finger| map(&mask, finger).map(|&m| m > 0.5)),
        theta_rad: npz.read("theta_deg")[0].to_radians(),
        yz: [yz[0], yz[1]],
        tool: npz.read("tool")[0] as usize,
        stratum: npz.read("stratum")[0] as usize,
    }
}

/// A binary STL, corners merged by their bits.
fn read_stl(path: &Path) -> TriMesh {
    let bytes = std::fs::read(path).unwrap();
    let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
    let mut mesh = TriMesh::default();
    let mut known = std::collections::HashMap::new();
    for i in 0..count {
        let corner = |c: usize, axis: usize| {
            let at = 84 + i * 50 + 12 + c * 12 + axis * 4;
            f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
        };
        mesh.triangles.push([0, 1, 2].map(|c| {
            let p = [0, 1, 2].map(|axis| corner(c, axis));
            *known.entry(p.map(f32::to_bits)).or_insert_with(|| {
                mesh.vertices.push(DVec3::from_array(p.map(f64::from)));
                mesh.vertices.len() as u32 - 1
            })
        }));
    }
    mesh
}

fn percent(values: &[f64], below: f64) -> f64 {
    values.iter().filter(|v| **v <= below).count() as f64 / values.len() as f64 * 100.0
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}

#[test]
fn forty_known_grasps_with_spoilt_masks() {
    let Some(folder) = shared().map(|s| s.join("pose-cases")) else {
        return;
    };
    let mut tools: Vec<Option<ToolModel>> = (0..12).map(|_| None).collect();
    let mut names: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "npz"))
        .collect();
    names.sort();
    assert_eq!(names.len(), 40);
    let mut build_ms = Vec::new();
    let cases: Vec<Case> = names.iter().map(|p| read_case(p)).collect();
    for case in &cases {
        tools[case.tool].get_or_insert_with(|| {
            let mesh = read_stl(&folder.join(format!("tool_{:02}.stl", case.tool)));
            let begin = Instant::now();
            let tool = ToolModel::new(mesh).unwrap();
            build_ms.push(begin.elapsed().as_secs_f64() * 1e3);
            tool
        });
    }
    eprintln!(
        "tool models: median {:.1} ms, most {:.1} ms",
        median(&build_ms),
        build_ms.iter().copied().fold(0.0, f64::max)
    );
    for engine in [Engine::DistanceField, Engine::LabIcp] {
        let (mut errors, mut shifts, mut ms, mut flags, mut lookups) = (vec![], vec![], vec![], vec![], vec![]);
        for (name, case) in names.iter().zip(&cases) {
            let tool = tools[case.tool].as_ref().unwrap();
            let fingers = [0, 1].map(|f| {
                Some(FingerInput { imprint: &case.imprints[f], camera: &case.cameras[f], mask: Some(&case.masks[f]) })
            });
            let begin = Instant::now();
            let pose = estimate(&fingers, tool, engine, false).unwrap();
            ms.push(begin.elapsed().as_secs_f64() * 1e3);
            lookups.push(pose.report.lookups as f64);
            let found = pose.grasp_from_object;
            let error = angle_error(found.theta_rad, case.theta_rad).to_degrees();
            let weakest = pose.report.observability.unwrap().eigenvalues[0];
            let shift = (found.y_m - case.yz[0]).hypot(found.z_m - case.yz[1]) * 1e3;
            let straight = matches!(case.tool, 0 | 11);
            if std::env::var_os("TOUCH2TOUCH_VERBOSE").is_some() {
                eprintln!(
                    "{} tool {:2} stratum {} error {error:5.2} deg {shift:5.2} mm weakest {weakest:.4} inliers {:.2} of {} {} it {}",
                    name.file_stem().unwrap().to_string_lossy(),
                    case.tool,
                    case.stratum,
                    pose.report.inlier_share,
                    pose.report.offered,
                    pose.report.stop,
                    pose.report.iterations
                );
            }
            if !straight {
                shifts.push(shift);
            }
            flags.push(pose.report.is_degenerate() == straight);
            errors.push(error);
        }
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let s5 = percent(&errors, 5.0);
        eprintln!(
            "{engine}: mean {mean:.2} deg, median {:.2}, within 5 deg {s5:.1} %, 10 deg {:.1} %, shift median {:.2} mm, \
             flag right {:.0} %, median {:.3} ms, {} look-ups",
            median(&errors),
            percent(&errors, 10.0),
            median(&shifts),
            flags.iter().filter(|f| **f).count() as f64 / 40.0 * 100.0,
            median(&ms),
            median(&lookups),
        );
        if engine == Engine::DistanceField {
            // A prototype of the same method reached mean 0.93, median 0.58, 100 % on these cases.
            assert!(mean <= 1.1 && s5 >= 95.0, "mean {mean} deg, within 5 deg {s5} %");
            assert!(median(&shifts) <= 0.6, "position {} mm", median(&shifts));
        } else {
            // One start at the identity and a squared cost: worse, as it should be, but no nonsense.
            assert!(s5 >= 50.0, "within 5 deg {s5} %");
        }
    }
}
