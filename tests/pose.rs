//! Depth to pose on synthetic grasps with known truth, made by an independent membrane model.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::DVec3;
use strum::IntoEnumIterator as _;
use touch2touch_bench::known::{Case, CaseSet};
use touch2touch_core::align::Ask;
use touch2touch_core::cloud::lift;
use touch2touch_core::contact::{MaskBasis, settled_model};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Mask;
use touch2touch_core::pose::{Registration, ToolModel, register};
use touch2touch_core::rig::PerPad;
use touch2touch_core::units::angle_error;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::steps::cloud::contact_points;
use touch2touch_pipeline::steps::imprint::measured;

use crate::support::shared;

/// The contact points of both fingers, grasp frame, meters.
fn points_of(case: &Case) -> Vec<DVec3> {
    [0, 1].map(|f| lift(&case.imprints[f], &case.cameras[f], Some(&case.masks[f])).unwrap().points).concat()
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
    let Some(folder) = shared("pose-cases") else { return };
    let set = CaseSet::open(&folder).unwrap();
    assert_eq!(set.cases.len(), 40);
    let mut build_ms = Vec::new();
    let tools: BTreeMap<usize, ToolModel> = set
        .tools
        .into_iter()
        .map(|(number, mesh)| {
            let begin = Instant::now();
            let tool = ToolModel::new(mesh).unwrap();
            build_ms.push(begin.elapsed().as_secs_f64() * 1e3);
            (number, tool)
        })
        .collect();
    eprintln!(
        "tool models: median {:.1} ms, most {:.1} ms",
        median(&build_ms),
        build_ms.iter().copied().fold(0.0, f64::max)
    );
    for engine in Registration::iter() {
        let (mut errors, mut shifts, mut ms, mut flags, mut lookups) = (vec![], vec![], vec![], vec![], vec![]);
        for (_, case) in &set.cases {
            let tool = &tools[&case.tool];
            let begin = Instant::now();
            let pose = register(&points_of(case), tool, engine, false).unwrap();
            ms.push(begin.elapsed().as_secs_f64() * 1e3);
            lookups.push(pose.lookups as f64);
            let found = pose.grasp_from_object;
            let error = angle_error(found.theta_rad, case.grasp_from_object.theta_rad).to_degrees();
            let shift = (found.y_m - case.grasp_from_object.y_m).hypot(found.z_m - case.grasp_from_object.z_m) * 1e3;
            let straight = matches!(case.tool, 0 | 11);
            if !straight {
                shifts.push(shift);
            }
            flags.push(pose.is_degenerate() == straight);
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
            flags.iter().filter(|f| **f).count() as f64 / flags.len() as f64 * 100.0,
            median(&ms),
            median(&lookups),
        );
        if engine == Registration::DistanceField(None) {
            // A prototype of the same method reached mean 0.93, median 0.58, 100 % on these cases.
            assert!(mean <= 0.75 && median(&errors) <= 0.5 && s5 >= 100.0, "mean {mean} deg, within 5 deg {s5} %");
            assert!(median(&shifts) <= 0.5, "position {} mm", median(&shifts));
            assert!(flags.iter().all(|f| *f), "degenerate grasps are flagged, others are not");
        } else if engine == Registration::LabIcp {
            // One start at the identity and a squared cost: worse, as it should be, but no nonsense.
            assert!(s5 >= 50.0, "within 5 deg {s5} %");
        } else {
            assert!(s5 >= 80.0, "{engine}: within 5 deg {s5} %");
        }
    }
}

/// The angle's error with the masks that stand in where the mask model finds nothing, degrees.
fn error_by_depth(dataset: &Dataset, id: PairId) -> f64 {
    let sample = dataset.load(id).unwrap();
    let name = dataset.index.get(id).unwrap().tool.as_ref().unwrap();
    let tool = ToolModel::new(dataset.tool_mesh(name).unwrap().unwrap()).unwrap();
    let mask = |finger| {
        let imprint = &sample.pad(finger)?.depth()?.imprint;
        let found = settled_model(imprint, Mask::filled(imprint.width(), imprint.height(), false));
        assert!(matches!(found.basis, MaskBasis::Depth(_)), "{name}: {:?}", found.basis);
        Some(std::sync::Arc::unwrap_or_clone(found.mask))
    };
    let masks: PerPad<Mask> = sample.rig.pads().map(mask).collect();
    let points = contact_points(&sample, &measured(&sample).as_ref(), &masks.as_ref()).unwrap();
    let (registration, truth) = (Registration::DistanceField(None).method(), sample.grasp_from_object);
    let pose = touch2touch_pipeline::steps::pose::pose(&points, &tool, &*registration, Ask::default(), truth);
    pose.map_or(f64::NAN, |pose| pose.error_rad.unwrap().to_degrees())
}

#[test]
fn depth_stands_in_where_the_mask_model_finds_nothing() {
    let demo = Dataset::demo();
    let some = (0..demo.index.pairs.len()).step_by(23).map(|i| PairId(i as u32));
    let mut sets = vec![("demo", some.collect::<Vec<_>>(), demo, 6.0)];
    if let Some(folder) = shared("lab-sample") {
        let lab = Dataset::open(&folder).unwrap();
        sets.push(("lab-sample", (0..4).map(PairId).collect(), lab, 12.0));
    }
    for (name, ids, dataset, limit) in sets {
        let found = ids.iter().map(|&id| error_by_depth(&dataset, id)).collect::<Vec<f64>>();
        eprintln!("{name}: median {:.2}, {found:.2?}", median(&found));
        assert!(median(&found) < limit, "{name}: {found:.2?}");
    }
}
