use std::rc::Rc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::cost::{Joint, MaskPart, Patch};
use super::smooth::BANDS;
use super::template::template;
use super::*;
use crate::align::batch::{Cloud, State};
use crate::align::search::Cost;
use crate::align::{Contacts, Evidence, PadImage, Prior, Rung, Uncertainty};
use crate::catalog::tools;
use crate::cloud::lift;
use crate::grid::{DepthMap, Mask};
use crate::pose::register_with;
use crate::rig::lab;
use crate::sample::DepthCamera;
use crate::sim::{BubbleConfig, Grasp, SimConfig, random_grasp, simulate};
use crate::symmetry::Symmetry;
use crate::tent::FreeShape;
use crate::units::angle_error;
use crate::verdict::{Grade, Verdict};

/// A touch of the simulator: imprints, cameras and true contact of both fingers, the tool and the pose.
pub(super) struct Touch {
    imprints: [DepthMap; 2],
    cameras: [DepthCamera; 2],
    masks: [Mask; 2],
    pub(super) tool: ToolModel,
    pub(super) truth: PlanarPose,
}

impl Touch {
    pub(super) fn new(tool: usize, seed: u64) -> Self {
        Self::held(tool, random_grasp(seed), seed)
    }

    fn held(tool: usize, grasp: Grasp, seed: u64) -> Self {
        Self::felt(tool, grasp, seed, &SimConfig::default())
    }

    fn felt(tool: usize, grasp: Grasp, seed: u64, config: &SimConfig) -> Self {
        let sample = simulate(&tools()[tool], grasp, seed, config);
        let touch = |f: usize| sample.pad(lab::PADS[f]).unwrap().depth().unwrap();
        Self {
            imprints: [0, 1].map(|f| touch(f).imprint.clone()),
            cameras: [0, 1].map(|f| touch(f).camera.clone().unwrap()),
            masks: [0, 1].map(|f| touch(f).truth.as_ref().unwrap().contact.clone()),
            tool: ToolModel::new(tools()[tool].mesh()).unwrap(),
            truth: sample.grasp_from_object.unwrap(),
        }
    }

    pub(super) fn points(&self) -> Vec<DVec3> {
        (0..2).flat_map(|f| lift(&self.imprints[f], &self.cameras[f], Some(&self.masks[f])).unwrap().points).collect()
    }

    pub(super) fn images(&self) -> Vec<PadImage<'_>> {
        (0..2).map(|f| PadImage::measured(&self.imprints[f], &self.cameras[f])).collect()
    }

    pub(super) fn by(&self, method: &dyn Register) -> Result<AlignReport, AlignError> {
        let contacts = Contacts { points: &self.points(), images: &self.images() };
        method.run(&Scene::new(contacts), &self.tool, Ask::default())
    }

    pub(super) fn error_deg(&self, report: &AlignReport) -> f64 {
        angle_error(report.grasp_from_object.theta_rad, self.truth.theta_rad).abs().to_degrees()
    }
}

#[test]
fn a_foreign_body_in_the_mask_turns_the_masks_pose_and_hardly_this_one() {
    let (mut mask_worst, mut joint_worst) = (0f64, 0f64);
    for (tool, seed) in [(0, 3), (3, 4), (7, 5)] {
        let mut touch = Touch::new(tool, seed);
        for mask in &mut touch.masks {
            for y in 0..60 {
                for x in 0..90 {
                    mask[(x, y)] = true;
                }
            }
        }
        let joint = touch.by(&JointConfig::default()).unwrap();
        assert_eq!(joint.joint.unwrap().basis, Basis::Both);
        joint_worst = joint_worst.max(touch.error_deg(&joint));
        mask_worst = mask_worst.max(touch.error_deg(&touch.by(&AlignConfig::default()).unwrap()));
    }
    assert!(joint_worst < 1.5 && mask_worst > 1.25 * joint_worst, "{joint_worst} {mask_worst}");
}

#[test]
fn without_a_mask_the_membrane_answers_and_the_order_of_the_fingers_is_nothing() {
    let mut touch = Touch::new(3, 5);
    touch.masks.iter_mut().for_each(|mask| mask.as_mut_slice().fill(false));
    let found = touch.by(&JointConfig::default()).unwrap();
    assert_eq!(found.joint.unwrap().basis, Basis::Membrane);
    assert!(touch.error_deg(&found) < 2.0, "{}", touch.error_deg(&found));
    assert_eq!(found, touch.by(&JointConfig::default()).unwrap(), "the same bits");
    touch.imprints.reverse();
    touch.cameras.reverse();
    let swapped = touch.by(&JointConfig::default()).unwrap();
    assert!(touch.error_deg(&swapped) < 2.0);
    assert!(angle_error(swapped.grasp_from_object.theta_rad, found.grasp_from_object.theta_rad).abs() < 5e-3);
}

#[test]
fn where_the_membrane_says_nothing_the_mask_answers_bit_for_bit_and_it_is_said() {
    let touch = Touch::new(0, 3);
    let by_mask = touch.by(&AlignConfig::default()).unwrap();
    let same = |touch: &Touch, images: &[PadImage<'_>], basis: Basis| {
        let contacts = Contacts { points: &touch.points(), images };
        let found = JointConfig::default().run(&Scene::new(contacts), &touch.tool, Ask::default()).unwrap();
        assert_eq!(found.joint.unwrap().basis, basis);
        assert_eq!(AlignReport { joint: None, range: by_mask.range, ..found }, by_mask);
    };
    same(&touch, &[], Basis::NoImage);
    let nothing = DepthMap::filled(175, 140, f32::NAN);
    let image = |imprint, f: usize| PadImage::measured(imprint, &touch.cameras[f]);
    same(&touch, &[image(&nothing, 0), image(&nothing, 1)], Basis::NoZone);
    let small = DepthMap::filled(5, 4, 0.0);
    same(&touch, &[image(&small, 0)], Basis::NoZone);
    let mut lost = touch.cameras[0].clone();
    lost.grasp_from_camera.translation.x = f64::NAN;
    same(&touch, &[PadImage::measured(&touch.imprints[0], &lost)], Basis::NoZone);
    let mut empty = touch.cameras[0].clone();
    empty.depth_reference.as_mut_slice().fill(f32::INFINITY);
    same(&touch, &[PadImage::measured(&touch.imprints[0], &empty)], Basis::NoZone);
    // Membranes that nothing pushed in: where they would pass the middle plane they stop there.
    let free = [0, 1].map(|f: usize| {
        let camera = &touch.cameras[f];
        DepthMap::from_fn(175, 140, |x, y| {
            let reference = camera.depth_reference[(x, y)];
            let direction = camera.grasp_from_camera.matrix3 * camera.lift(x as f64, y as f64, 1.0);
            let plane = (-camera.grasp_from_camera.translation.x / direction.x) as f32;
            (reference - plane).max(0.0)
        })
    });
    same(&touch, &[image(&free[0], 0), image(&free[1], 1)], Basis::LittleContact);
}

#[test]
fn the_slope_of_the_joint_cost_is_its_derivative() {
    let touch = Touch::new(0, 3);
    let template = template(
        &touch.tool,
        1.0,
        FreeShape { bend: DVec2::splat(10.0), ..FreeShape::default() },
        super::template::Grasp::default(),
    )
    .unwrap();
    let places = (0..200).map(|i| {
        let place = DVec2::new(f64::from(i % 20) - 10.0, f64::from(i / 20) - 5.0) * 1.3e-3;
        (place, 2e-4 * (i % 7) as f32 - 4e-4)
    });
    let fingers = [(template[BANDS.len() - 1].clone(), Rc::new(Patch::new(places.collect::<Vec<_>>().into_iter())))];
    let cloud = Cloud::new((0..96).map(|i| DVec2::new(f64::from(i % 12) - 4.0, f64::from(i / 12)) * 1.7e-3));
    let mask = MaskPart { field: &touch.tool.field, cloud: &cloud, kernel_m: 1e-3, weight: 0.1 };
    let mut joint = Joint { fingers: &fingers, kernel_m: 5e-4, mask: Some(mask), lookups: 0 };
    // Bilinear look-ups have kinks: the mean slope over a step within which few points pass one.
    let state = State { phi: 0.1, place: DVec2::new(1.1e-3, -7e-4) };
    let step = 4e-6;
    for axis in 0..3 {
        let moved = |by: f64| state.moved(std::array::from_fn(|i| if i == axis { by } else { 0.0 }));
        let numeric = (joint.sums(moved(step)).cost - joint.sums(moved(-step)).cost) / (2.0 * step);
        let analytic = 2.0 * joint.sums(state).g[axis];
        assert!((numeric - analytic).abs() < 0.03 * analytic.abs() + 0.3, "{axis}: {numeric} {analytic}");
    }
    assert_eq!(joint.lookups, 9 * 296);
}

/// The answer about a touch with another tool's model or its own, with evidence and verdict.
fn judged(touch: &Touch, tool: &ToolModel) -> (AlignReport, Verdict) {
    let (points, images) = (touch.points(), touch.images());
    let contacts = Contacts { points: &points, images: &images };
    let ask = Ask { evidence: true, ..Ask::default() };
    let report = register_with(&JointConfig::default(), contacts, tool, ask).unwrap();
    let verdict = Verdict::of(&report).unwrap();
    (report, verdict)
}

#[test]
fn the_verdict_tells_another_tool_a_blank_finger_and_swapped_ones_without_truth() {
    for (tool, other, seed) in [(0, 7, 3), (3, 0, 4), (7, 3, 5)] {
        let mut touch = Touch::new(tool, seed);
        let (right, good) = judged(&touch, &touch.tool);
        assert_eq!(good.grade, Grade::Good, "{good:?} {:?}", right.evidence);
        assert!(good.against.is_empty() && good.why.contains("the tool's shape"), "{good:?}");
        let (_, wrong) = judged(&touch, &ToolModel::new(tools()[other].mesh()).unwrap());
        assert!(wrong.grade > Grade::Good, "{wrong:?}");
        touch.imprints.reverse();
        touch.masks.reverse();
        let (_, swapped) = judged(&touch, &touch.tool);
        let said = |verdict: &Verdict, what: &str| verdict.against.iter().any(|sign| sign.what.contains(what));
        assert!(swapped.grade == Grade::Wrong && said(&swapped, "swapped"), "{swapped:?}");
        touch.imprints[1].as_mut_slice().fill(0.0);
        touch.masks[1].as_mut_slice().fill(false);
        let (_, blank) = judged(&touch, &touch.tool);
        assert_eq!(blank.grade, Grade::Wrong, "{blank:?}");
    }
}

#[test]
fn a_grasp_at_70_degrees_is_found_unless_the_range_is_the_labs() {
    let tool = tools().iter().position(|tool| tool.name.contains("_35")).unwrap();
    let touch = Touch::held(tool, Grasp { theta_rad: 70f64.to_radians(), x_m: 0.004, y_m: -0.008 }, 3);
    let (points, images) = (touch.points(), touch.images());
    let found = |range: Range| {
        let contacts = Contacts { points: &points, images: &images };
        let ask = Ask { evidence: true, ..Ask::default() };
        register_with(&JointConfig { range }, contacts, &touch.tool, ask).unwrap()
    };
    let [labs, free] = [Range::LAB, Range::default()].map(found);
    assert!(touch.error_deg(&labs) > 20.0 && labs.answers.is_empty(), "{}", touch.error_deg(&labs));
    assert!(touch.error_deg(&free) < 2.0 && free.rung == Rung::Around, "{}", touch.error_deg(&free));
    assert_eq!(free.answers[0].grasp_from_object, free.grasp_from_object);
    assert_eq!(Verdict::of(&free).unwrap().grade, Grade::Good, "{:?}", free.evidence);
    // Of grasps from the lab's grid the answer is that of a search of that range alone.
    let touch = Touch::new(tool, 3);
    let (points, images) = (touch.points(), touch.images());
    let scene = Scene::new(Contacts { points: &points, images: &images });
    let ask = Ask { in_lab_grid: true, ..Ask::default() };
    let [labs, free] =
        [Range::LAB, Range::default()].map(|range| JointConfig { range }.run(&scene, &touch.tool, ask).unwrap());
    assert_eq!(AlignReport { range: Range::LAB, ..free }, labs);
}

#[test]
fn a_soap_film_that_reaches_the_middle_plane_tells_the_angle_to_less_than_a_degree() {
    let error_deg = |grasp: u64| {
        let tool = grasp as usize % tools().len();
        let bubble = BubbleConfig::film(tools()[tool].half_thickness_m);
        let config = SimConfig { bubble, ..SimConfig::default() };
        let touch = Touch::felt(tool, random_grasp(grasp), grasp, &config);
        let found = touch.by(&JointConfig { range: Range::LAB }).unwrap();
        assert!(found.has_membrane());
        Symmetry::of(&touch.tool).difference(found.grasp_from_object, touch.truth).angle_rad.to_degrees()
    };
    let errors: Vec<f64> = (0..48).into_par_iter().map(error_deg).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    // 0.80 without the finest band.
    assert!(mean < 0.72, "{mean} {errors:.2?}");
}

#[test]
fn a_tool_that_is_followed_does_not_turn_over_to_an_equal_answer() {
    let tool = tools().iter().position(|tool| tool.name.contains("_03_")).unwrap();
    let touch = Touch::new(tool, 3);
    let (first, _) = judged(&touch, &touch.tool);
    let pose = first.grasp_from_object;
    assert_eq!(first.answers_text(pose).as_deref(), Some("1 of 4 equal answers"));
    let mut kept = first.clone();
    kept.keep_to(PlanarPose { theta_rad: pose.theta_rad + 1.4, ..pose });
    let turned = crate::units::angle_error(kept.grasp_from_object.theta_rad, pose.theta_rad).to_degrees();
    assert!((turned - 90.0).abs() < 1e-6 && kept.answers[0].grasp_from_object == kept.grasp_from_object, "{turned}");
    // The point in the middle of the contact is as well known as before.
    let spread = |report: &AlignReport| report.evidence.unwrap().uncertainty.place_m(report.grasp_from_object);
    assert!((spread(&kept) / spread(&first) - 1.0).abs() < 1e-9, "{} {}", spread(&kept), spread(&first));
    kept.keep_to(pose);
    assert!((kept.grasp_from_object.theta_rad - pose.theta_rad).abs() < 1e-12);
}

#[test]
fn the_spread_is_as_wide_as_what_the_contact_leaves_open() {
    let touch = Touch::new(0, 3);
    let (report, _) = judged(&touch, &touch.tool);
    let told = report.evidence.unwrap().uncertainty;
    assert!((0.1..1.5).contains(&told.angle_rad().to_degrees()), "{told:?}");
    let [long, short] = told.half_axes(report.grasp_from_object);
    assert!(long.length() >= short.length() && long.length() < 1e-3 && long.dot(short).abs() < 1e-12, "{told:?}");
    // A rod is known least along itself.
    let rod = tools().iter().position(|tool| tool.name.ends_with("_rod")).unwrap();
    let touch = Touch::new(rod, 2);
    let (report, _) = judged(&touch, &touch.tool);
    let told = report.evidence.unwrap().uncertainty;
    let [long, short] = told.half_axes(report.grasp_from_object);
    let along = DVec2::from_angle(report.grasp_from_object.theta_rad).perp();
    assert!(long.length() > 1.3 * short.length(), "{long} {short}");
    assert!(long.normalize().dot(along).abs() > 0.98, "{long} {along}");
    // Of nothing, all that is known is what a gripper can hold.
    let nothing = Scene::new(&[][..]);
    let report = AlignReport { joint: None, grasp_from_object: PlanarPose::default(), ..report };
    let evidence = Evidence::about(&nothing, &touch.tool, &report).0;
    assert_eq!((evidence.on_tool, evidence.membrane), (0.0, None));
    assert!((evidence.uncertainty.angle_rad().to_degrees() - 13.0).abs() < 0.1, "{evidence:?}");
}

#[test]
fn a_prediction_unlike_the_tool_is_to_be_checked_and_wrong_only_beyond_what_right_ones_show() {
    let touch = Touch::new(0, 3);
    let (mut report, _) = judged(&touch, &touch.tool);
    let mut evidence = report.evidence.unwrap();
    let mut membrane = evidence.membrane.unwrap();
    let mut grade = |basis, gain: f64| {
        (membrane.swapped, membrane.likeness) = (Some(gain), 0.3);
        evidence.membrane = Some(membrane);
        report.evidence = Some(evidence);
        report.joint = report.joint.map(|fit| JointFit { basis, ..fit });
        Verdict::of(&report).unwrap().grade
    };
    assert_eq!([0.3, 0.5].map(|gain| grade(Basis::Both, gain)), [Grade::Wrong; 2]);
    assert_eq!([0.3, 0.5].map(|gain| grade(Basis::Unlike, gain)), [Grade::Check, Grade::Wrong]);
}

/// A spread along the tool's own axis and across it, meters, and next to none of the angle.
fn spread_along(pose: PlanarPose, [along_m, across_m]: [f64; 2]) -> Uncertainty {
    let turn = DVec2::from_angle(pose.theta_rad);
    let (across, along) = (across_m.powi(2), along_m.powi(2));
    let yy = across * turn.x.powi(2) + along * turn.y.powi(2);
    let zz = across * turn.y.powi(2) + along * turn.x.powi(2);
    let yz = (across - along) * turn.x * turn.y;
    let covariance = [[1e-6, 0.0, 0.0], [0.0, yy, yz], [0.0, yz, zz]];
    Uncertainty { covariance, center: DVec2::new(pose.y_m, pose.z_m) }
}

#[test]
fn a_place_open_along_the_tool_is_uncertain() {
    let rod = tools().iter().position(|tool| tool.name.ends_with("_rod")).unwrap();
    let touch = Touch::new(rod, 2);
    let (mut report, _) = judged(&touch, &touch.tool);
    let (pose, evidence) = (report.grasp_from_object, report.evidence.unwrap());
    let mut graded = |along_m: f64, across_m: f64| {
        let uncertainty = spread_along(pose, [along_m, across_m]);
        let turn = DVec2::from_angle(pose.theta_rad);
        let across = DVec2::from(uncertainty.half_axes(pose).map(|axis| axis.dot(turn)));
        assert!((across.length() - across_m).abs() < 1e-9);
        report.evidence = Some(Evidence { uncertainty, ..evidence });
        Verdict::of(&report).unwrap()
    };
    let held = graded(3e-3, 1e-4);
    assert_eq!((held.angle.grade, held.place.grade), (Grade::Good, Grade::Check));
    let json = serde_json::to_value(&held).unwrap();
    assert_eq!((json["angle"]["grade"].as_str(), json["place"]["grade"].as_str()), (Some("good"), Some("check")));
    assert!((json["place"]["sd_mm"].as_f64().unwrap() - 3.0).abs() < 1e-3, "{json}");
    assert!(held.parts_text().ends_with("place uncertain (±3.00 mm)"), "{}", held.parts_text());
    assert!(held.why.starts_with("a straight edge leaves the position along it open"), "{held:?}");
    assert!(graded(3e-3, 3e-3).why.starts_with("the contact does not determine the position"));
    assert_eq!(graded(1e-4, 3e-3).grade, Grade::Check);
    assert!(graded(1e-4, 1e-4).why.contains("lies on the tool"));
    // Fingers that have it at two places along what is open: of the place alone, and no fault.
    let mut fingers = evidence;
    let apart = super::Elsewhere { angle_rad: 0.01, position_m: 9e-3, gain: 0.9 };
    fingers.membrane = fingers.membrane.map(|membrane| MembraneEvidence { fingers: Some(apart), ..membrane });
    let of = |along_m: f64| {
        let uncertainty = spread_along(pose, [along_m, 1e-4]);
        let report = AlignReport { evidence: Some(Evidence { uncertainty, ..fingers }), ..report.clone() };
        let verdict = Verdict::of(&report).unwrap();
        [verdict.angle.grade, verdict.place.grade]
    };
    assert_eq!(of(3e-3), [Grade::Good, Grade::Check]);
    assert_eq!(of(1e-4), [Grade::Good, Grade::Wrong]);
}

#[test]
fn a_rod_that_slid_out_of_the_hand_comes_back_along_itself() {
    let (pose, prior) = (PlanarPose { theta_rad: 0.2, y_m: 0.001, z_m: -0.003 }, Prior::default());
    let slid = |along_m: f64| {
        let moved = pose.transform_yz(DVec2::new(0.0, along_m));
        PlanarPose { y_m: moved.x, z_m: moved.y, ..pose }
    };
    let told = |of: PlanarPose, along_m: f64| move || spread_along(of, [along_m, 2e-4]);
    let far = slid(0.02);
    let back = prior.slid_in(far, told(far, 2.8e-3));
    let from_middle = DVec2::new(back.y_m, back.z_m).dot(DVec2::from_angle(pose.theta_rad).perp());
    assert!(!prior.allows(far) && prior.allows(back) && from_middle.abs() < 1e-9, "{back:?}");
    // What the gripper can hold stays, and nothing is asked about it; so does what no slide brings back, and what is known.
    assert_eq!(prior.slid_in(pose, || panic!("asked")), pose);
    let aside = PlanarPose { y_m: 0.02, ..pose };
    assert_eq!(prior.slid_in(aside, told(aside, 2.8e-3)), aside);
    assert_eq!(prior.slid_in(far, told(far, 1e-3)), far);
}
