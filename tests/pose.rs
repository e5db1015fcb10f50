//! Depth to pose on synthetic grasps with known truth, made by an independent membrane model.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::{DVec2, DVec3};
use strum::IntoEnumIterator as _;
use touch2touch_bench::known::{Case, CaseSet};
use touch2touch_core::align::{AlignConfig, AlignReport, Ask, Rung, align};
use touch2touch_core::cloud::lift;
use touch2touch_core::contact::{
    LAB_CAD_DISTANCE_M, MaskBasis, cad_signed_distance, rest_and_top, settled_model, threshold,
};
use touch2touch_core::dataset::PairId;
use touch2touch_core::field::DistanceField;
use touch2touch_core::grid::Mask;
use touch2touch_core::pose::{Registration, ToolModel, register};
use touch2touch_core::rig::{PerPad, lab};
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
        for (name, case) in &set.cases {
            let tool = &tools[&case.tool];
            let begin = Instant::now();
            let pose = register(&points_of(case), tool, engine, false).unwrap();
            ms.push(begin.elapsed().as_secs_f64() * 1e3);
            lookups.push(pose.lookups as f64);
            let found = pose.grasp_from_object;
            let error = angle_error(found.theta_rad, case.grasp_from_object.theta_rad).to_degrees();
            let weakest = pose.observability.unwrap().eigenvalues[0];
            let shift = (found.y_m - case.grasp_from_object.y_m).hypot(found.z_m - case.grasp_from_object.z_m) * 1e3;
            let straight = matches!(case.tool, 0 | 11);
            if std::env::var_os("TOUCH2TOUCH_VERBOSE").is_some() {
                eprintln!(
                    "{name} tool {:2} stratum {} error {error:5.2} deg {shift:5.2} mm weakest {weakest:.4} inliers {:.2} of {} {} it {}",
                    case.tool, case.stratum, pose.inlier_share, pose.offered, pose.stop, pose.iterations
                );
            }
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

#[test]
fn the_fast_answer_costs_what_the_proved_one_does() {
    let Some(folder) = shared("pose-cases") else { return };
    let set = CaseSet::open(&folder).unwrap();
    let fields: BTreeMap<usize, DistanceField> =
        set.tools.iter().map(|(number, mesh)| (*number, DistanceField::from_mesh(mesh).unwrap())).collect();
    let mut lookups = Vec::new();
    for (name, case) in &set.cases {
        let points: Vec<DVec2> = points_of(case).iter().map(|p| DVec2::new(p.y, p.z)).collect();
        let ask = |config: &AlignConfig| align(&points, &fields[&case.tool], config).unwrap();
        let (fast, proved) = (
            ask(&AlignConfig::default()),
            ask(&AlignConfig { rungs: vec![Rung::Certified], ..AlignConfig::default() }),
        );
        let cost = |report: &AlignReport| report.runs[report.winner].cost_m2;
        let certificate = proved.certificate.unwrap();
        assert!(certificate.certified, "{name}: {certificate:?}");
        assert!(cost(&fast) <= 1.02 * cost(&proved), "{name}: {} against {}", cost(&fast), cost(&proved));
        lookups.push(certificate.lookups as f64);
    }
    eprintln!("proofs: median {:.0} look-ups", median(&lookups));
    assert!(median(&lookups) < 2e6);
}

#[test]
fn the_labs_files_with_the_mask_from_the_cad_give_the_stored_angle() {
    let Some(folder) = shared("lab-sample") else { return };
    let dataset = Dataset::open(&folder).unwrap();
    let mut seen = 0;
    for (i, entry) in dataset.index.pairs.iter().enumerate() {
        let sample = dataset.load(PairId(i as u32)).unwrap();
        let truth = sample.grasp_from_object.unwrap();
        let tool = ToolModel::new(dataset.tool_mesh(entry.tool.as_ref().unwrap()).unwrap().unwrap()).unwrap();
        let masks = sample.rig.pads().map(|finger| {
            let bubble = sample.pad(finger)?.depth()?;
            let camera = bubble.camera.as_ref()?;
            let mask =
                cad_signed_distance(&bubble.imprint, camera, &tool.distance, truth.inverse(), LAB_CAD_DISTANCE_M);
            Some(mask.unwrap())
        });
        let masks: PerPad<Mask> = masks.collect();
        let points = contact_points(&sample, &measured(&sample).as_ref(), &masks.as_ref()).unwrap();
        let registration = Registration::DistanceField(None).method();
        let pose = touch2touch_pipeline::steps::pose::pose(&points, &tool, &*registration, Ask::default(), Some(truth))
            .unwrap();
        let error = pose.error_rad.unwrap().to_degrees();
        eprintln!(
            "{}: {:.2} deg, error {error:.2} deg, {} points",
            entry.name,
            pose.angle_rad.to_degrees(),
            pose.num_points
        );
        assert!(error < 2.0, "{}: {error} deg", entry.name);
        seen += 1;
    }
    assert_eq!(seen, 4);
}

/// The angle's error with the masks that stand in where the mask model finds nothing, degrees, and their share.
fn error_by_depth(dataset: &Dataset, id: PairId, share: Option<f32>) -> (f64, usize) {
    let sample = dataset.load(id).unwrap();
    let name = dataset.index.get(id).unwrap().tool.as_ref().unwrap();
    let tool = ToolModel::new(dataset.tool_mesh(name).unwrap().unwrap()).unwrap();
    let mask = |finger| {
        let imprint = &sample.pad(finger)?.depth()?.imprint;
        if let Some(share) = share {
            let [rest, top] = rest_and_top(imprint).unwrap();
            return Some(threshold(imprint, rest + share * (top - rest)));
        }
        let found = settled_model(imprint, Mask::filled(imprint.width(), imprint.height(), false));
        assert!(matches!(found.basis, MaskBasis::Depth(_)), "{name}: {:?}", found.basis);
        Some(std::sync::Arc::unwrap_or_clone(found.mask))
    };
    let masks: PerPad<Mask> = sample.rig.pads().map(mask).collect();
    let points = contact_points(&sample, &measured(&sample).as_ref(), &masks.as_ref()).unwrap();
    let (registration, truth) = (Registration::DistanceField(None).method(), sample.grasp_from_object);
    let pose = touch2touch_pipeline::steps::pose::pose(&points, &tool, &*registration, Ask::default(), truth);
    pose.map_or((f64::NAN, 0), |pose| (pose.error_rad.unwrap().to_degrees(), pose.num_points))
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
        let errors = |share| ids.iter().map(|&id| error_by_depth(&dataset, id, share).0).collect::<Vec<f64>>();
        if std::env::var_os("TOUCH2TOUCH_SHARES").is_some() {
            for id in &ids {
                let sample = dataset.load(*id).unwrap();
                let rises = lab::PADS.map(|f| rest_and_top(&sample.pad(f).unwrap().depth().unwrap().imprint));
                eprintln!("{name} {id:?}: rest and top {rises:?}");
            }
            for share in [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9] {
                let found = errors(Some(share));
                eprintln!("{name}, share {share}: median {:.2}, {found:.2?}", median(&found));
            }
        }
        let found = errors(None);
        eprintln!("{name}: median {:.2}, {found:.2?}", median(&found));
        assert!(median(&found) < limit, "{name}: {found:.2?}");
    }
}
