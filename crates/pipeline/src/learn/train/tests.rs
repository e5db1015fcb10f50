//! Tests of the division, and of the words before anything starts.

use super::*;

fn entries(count: usize, for_tests: usize) -> Vec<Entry> {
    let entry = |at: usize| Entry {
        id: PairId(at as u32),
        name: format!("data_{at}"),
        tool: None,
        held_out: at < for_tests,
        cad: false,
        places: Vec::new(),
    };
    (0..count).map(entry).collect()
}

fn held(entries: &[Entry]) -> Vec<&str> {
    entries.iter().filter(|entry| entry.held_out).map(|entry| entry.name.as_str()).collect()
}

fn divided(count: usize, for_tests: usize, held_out_percent: u8, seed: u64) -> Vec<Entry> {
    let mut entries = entries(count, for_tests);
    divide(&mut entries, TrainChoice { held_out_percent, seed, ..TrainChoice::default() });
    entries
}

#[test]
fn a_share_of_the_pairs_is_left_out_by_the_seed_and_never_all() {
    for (count, percent, expected) in
        [(0, 20, 0), (1, 20, 0), (2, 20, 1), (3, 20, 1), (20, 20, 4), (20, 0, 0), (20, 100, 19), (1, 100, 0)]
    {
        assert_eq!(held(&divided(count, 0, percent, 3)).len(), expected, "{percent} % of {count}");
    }
    assert_eq!(held(&divided(20, 0, 20, 3)), held(&divided(20, 0, 20, 3)));
    assert_ne!(held(&divided(20, 0, 20, 3)), held(&divided(20, 0, 20, 4)));
    // One more pair changes at most one of those before.
    let (few, more) = (divided(20, 0, 20, 3), divided(21, 0, 20, 3));
    assert!(held(&few).iter().filter(|name| !held(&more).contains(name)).count() <= 1);
}

#[test]
fn pairs_kept_for_tests_are_always_left_out() {
    let entries = divided(12, 2, 20, 0);
    assert_eq!(held(&entries).len(), 4);
    assert!(entries[0].held_out && entries[1].held_out);
    // They are a score by themselves: of two others none need be given up for one.
    assert_eq!(held(&divided(4, 2, 20, 0)).len(), 2);
    assert_eq!(held(&divided(3, 3, 20, 0)).len(), 3);
}

#[test]
fn nothing_to_learn_from_has_its_reason_and_where_there_is_one_its_tick() {
    let of = |left_out: &[(LeftOut, usize)], for_tests, by_cad| {
        let left_out = left_out.iter().copied().collect();
        TrainPlan { for_tests, by_cad, held_out: [2 * for_tests, for_tests], left_out, ..TrainPlan::default() }
    };
    let tests = of(&[], 9, 40).nothing().unwrap();
    assert!(tests.why.contains("all pairs") && tests.why.contains("9 pairs, 18 masks"), "{tests:?}");
    assert_eq!(tests.cure, Some(TrainCure::TestInTrain));
    assert!(TrainCure::TestInTrain.applied(TrainChoice::default()).test_in_train);
    let not_done = of(&[(LeftOut::NotDone, 3)], 0, 0).nothing().unwrap();
    assert!(not_done.why.contains("3 pairs were corrected, and none") && not_done.cure.is_none(), "{not_done:?}");
    let empty = of(&[(LeftOut::NotDrawn, 2)], 0, 0).nothing().unwrap();
    assert!(empty.why.contains("2 pairs marked \"done\" have no mask"), "{empty:?}");
    let begin = of(&[], 0, 12).nothing().unwrap();
    assert_eq!(begin.cure, Some(TrainCure::FromCad));
    assert!(begin.hint.contains("12 pairs"), "{begin:?}");
    assert_eq!(TrainCure::FromCad.applied(TrainChoice::default()).from, MasksFrom::Cad);
    let some = TrainPlan { tools: BTreeMap::from([("rod".to_owned(), 1)]), ..TrainPlan::default() };
    assert_eq!(some.nothing(), None);
}
