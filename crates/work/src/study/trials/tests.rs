use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use super::*;
use crate::job::Cancel;
use crate::mask::{MaskChoice, MaskSource};
use touch2touch_core::catalog::{ToolSpec, cup_handle, tools};
use touch2touch_core::trials::{After, Share};
use touch2touch_core::verdict::Grade;

/// A recipe that needs no model.
fn recipe(source: MaskSource) -> Recipe {
    Recipe { mask: MaskChoice { source, ..MaskChoice::default() }, ..Recipe::default() }
}

fn setup(tools: &[&str], count: usize) -> TrialsSetup {
    TrialsSetup {
        tools: tools.iter().map(|&name| name.to_owned()).collect(),
        count,
        methods: vec![Method::of(&recipe(MaskSource::Truth)), Method::uncorrected()],
        clearances_m: vec![0.0005, 0.001, 0.005],
        ..TrialsSetup::default()
    }
}

fn run(setup: &TrialsSetup) -> Trials {
    trials(setup, &Models::new(None), &JobCx::unwatched()).unwrap()
}

#[test]
fn the_sums_hold_and_a_seed_gives_the_same_trials() {
    let setup = setup(&["pattern_35", "cup"], 3);
    let made = run(&setup);
    assert!(made.complete);
    assert_eq!(made.tools.iter().map(|tool| tool.tool.as_str()).collect::<Vec<_>>(), ["pattern_35", "cup"]);
    for tool in &made.tools {
        for method in &tool.methods {
            assert_eq!(method.trials.iter().map(|trial| trial.number).collect::<Vec<_>>(), [0, 1, 2]);
            let hits = method.trials.iter().filter(|trial| trial.first.tried().success).count();
            assert_eq!((method.success, method.angle.count), (Share::new(hits, 3), 3));
            // The sweep goes by the same poses: the stated clearance is one of it, and room never hinders.
            assert_eq!(method.sweep.len(), if tool.tool == "cup" { 0 } else { 3 });
            assert!(method.sweep.windows(2).all(|w| w[0].success.hits <= w[1].success.hits));
            assert!(method.sweep.iter().all(|s| s.clearance_m != 0.001 || s.success == method.success));
            for counts in &method.with_verdict {
                assert_eq!(counts.per_trial.of, 3);
                assert_eq!(counts.per_try.of + counts.refusals, 3);
                assert_eq!(counts.per_try.hits, counts.per_trial.hits);
                assert_eq!(counts.regrasps, method.trials.iter().filter(|trial| trial.second.is_some()).count());
            }
            for trial in &method.trials {
                let doubted = trial.first.grade != Some(Grade::Good) && !method.with_verdict.is_empty();
                assert_eq!(trial.second.is_some(), doubted);
                assert_eq!(trial.first.estimate.is_some(), trial.first.attempt.is_some());
                assert!(trial.second.as_ref().is_none_or(|second| second.seed != trial.first.seed));
            }
        }
        let [by_pose, floor] = tool.methods.as_slice() else { panic!("two methods") };
        assert_eq!((by_pose.with_verdict.len(), floor.with_verdict.len()), (2, 0));
        assert_eq!(by_pose.with_verdict[1].after, After::GiveUp);
        // Both were given the same grasps.
        let truths = |of: &MethodTrials| of.trials.iter().map(|trial| trial.first.truth).collect::<Vec<_>>();
        assert_eq!(truths(by_pose), truths(floor));
        assert!(by_pose.angle.mean_deg.unwrap() < 2.0 && floor.angle.mean_deg.unwrap() > 2.0);
    }
    let again = run(&setup);
    assert_eq!(again.tools, made.tools);
    let json = serde_json::to_value(&made).unwrap();
    assert_eq!(json["tools"][0]["methods"][0]["success"]["of"], 3);
    assert_eq!(json["tools"][1]["task"], "stacking");
    // A tool's grasps do not depend on what else is tried, and another seed has others.
    let alone = run(&TrialsSetup { tools: vec!["cup".to_owned()], count: 2, ..setup.clone() });
    assert_eq!(alone.tools[0].methods[1].trials, made.tools[1].methods[1].trials[..2]);
    let other = run(&TrialsSetup { tools: vec!["cup".to_owned()], count: 2, seed: 2, ..setup });
    assert!(other.tools[0].methods[1].trials[0].first.truth != alone.tools[0].methods[1].trials[0].first.truth);
}

#[test]
fn a_perfect_pose_always_succeeds_and_thirty_degrees_never_do() {
    let setup = setup(&[], 1);
    for name in known_tools() {
        let task = Task::new(&name, &setup).unwrap();
        for seed in 0..6 {
            let truth = random_grasp(seed).object_from_grasp().inverse();
            assert!(task.attempt(InHand { truth, estimate: truth }).unwrap().end.is_success(), "{name}");
            for wrong in [30f64, -30.0] {
                let estimate = PlanarPose { theta_rad: truth.theta_rad + wrong.to_radians(), ..truth };
                assert!(!task.attempt(InHand { truth, estimate }).unwrap().end.is_success(), "{name} {wrong}");
            }
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_a_stopped_run_says_so() {
    let none = JobCx::unwatched();
    let why = |setup: &TrialsSetup| trials(setup, &Models::new(None), &none).unwrap_err();
    assert!(why(&setup(&["pattern_99"], 1)).hint.unwrap().contains("pencil"));
    assert!(why(&setup(&["pencil"], 0)).why.contains("nothing to do"));
    let mut deep = setup(&["pencil"], 1);
    deep.hole.depth_m = 0.2;
    assert!(why(&deep).why.contains("cannot go"));
    let cancel = Cancel::default();
    cancel.cancel();
    let stopped = JobCx::new(cancel, Arc::new(|_| {}));
    let setup = setup(&["pencil"], 2);
    assert!(trials(&setup, &Models::new(None), &stopped).is_err());
    // Stopped after the first trial was made: what was done is there.
    let (cancel, seen) = (Cancel::default(), Arc::new(AtomicUsize::new(0)));
    let flag = cancel.clone();
    let stop_at_once = JobCx::new(
        cancel,
        Arc::new(move |progress| {
            seen.store(progress.done as usize, Ordering::Relaxed);
            if progress.done > 0 {
                flag.cancel();
            }
        }),
    );
    let part = trials(&TrialsSetup { count: 40, ..setup }, &Models::new(None), &stop_at_once).unwrap();
    assert!(!part.complete && !part.tools[0].methods[0].trials.is_empty());
    assert!(part.tools[0].methods[0].trials.len() < 40);
}

#[test]
fn a_pair_is_tried_as_its_tool_is_a_peg_or_a_cup() {
    let truth = PlanarPose { theta_rad: 0.1, ..PlanarPose::default() };
    let tried = |spec: &ToolSpec, off_deg: f64| {
        let estimate = PlanarPose { theta_rad: truth.theta_rad + off_deg.to_radians(), ..truth };
        of_pair(&ToolModel::new(spec.mesh()).unwrap(), truth, estimate).unwrap()
    };
    let peg = tried(&tools()[0], 0.0);
    let room = peg.room.unwrap();
    assert!(peg.attempt.end.is_success() && peg.goal.kind() == GoalKind::Insertion);
    assert_eq!((room.room_m, room.needs_m), (0.001, Some(0.0005)));
    assert_eq!(tried(&tools()[0], 30.0).room.unwrap().needs_m, None);
    let [stands, falls] = [0.0, 30.0].map(|off| tried(&cup_handle(), off));
    assert!(stands.attempt.end.is_success() && !falls.attempt.end.is_success());
    assert_eq!((stands.room, falls.goal.kind()), (None, GoalKind::Stacking));
    let json = serde_json::to_value(&stands).unwrap();
    assert!(json["end"]["kind"] == "stands" && json.get("room_m").is_none(), "{json}");
    assert_eq!(serde_json::to_value(&peg).unwrap()["room_m"], 0.001);
}

#[test]
fn a_rod_is_not_refused_for_where_it_is_along_itself() {
    let made = run(&setup(&["pencil"], 6));
    let [by_pose, _] = made.tools[0].methods.as_slice() else { panic!("two methods") };
    let good = by_pose.trials.iter().filter(|trial| trial.first.grade == Some(Grade::Good));
    let good = good.inspect(|trial| assert!(trial.first.tried().success, "{trial:?}")).count();
    assert!(good >= 5, "{:?}", by_pose.trials.iter().map(|trial| &trial.first.why).collect::<Vec<_>>());
}
