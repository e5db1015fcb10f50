//! Which test holds which verb against the studio; a verb of which nothing is said here fails.

use std::path::Path;

use super::random::{compared, files, labels, posed, tables, watched};
use super::{exchange, python, recipes, stills};
use crate::support::run;

/// Comparison of a verb with the studio.
enum Held {
    /// By these tests.
    By(&'static [fn()]),
    /// It cannot be, or need not: why.
    Not(&'static str),
}

/// Learning is built with the feature `tune`.
mod learned {
    #[cfg(feature = "tune")]
    pub(super) const TESTS: [fn(); 2] = [
        super::super::random::learned::a_fit_is_the_same_by_button_and_verb,
        super::super::random::learned::a_training_is_the_same_by_button_and_verb,
    ];
    #[cfg(not(feature = "tune"))]
    pub(super) const TESTS: [fn(); 2] = [|| (), || ()];
}

fn held(verb: &str) -> Option<Held> {
    use Held::{By, Not};
    Some(match verb {
        "generate" => By(&[recipes::a_random_recipe_gives_the_same_numbers_in_the_studio_and_by_the_verbs]),
        "pose" => By(&[
            recipes::a_random_recipe_gives_the_same_numbers_in_the_studio_and_by_the_verbs,
            posed::every_step_of_a_registration_is_the_same_in_the_time_machine_and_by_the_verb,
            python::a_random_recipe_gives_the_same_poses_from_python_and_by_the_verb,
        ]),
        "compare" => By(&[
            compared::any_two_imprints_differ_by_the_same_in_the_pane_and_by_the_verb,
            super::two_predictions_are_compared_by_one_function,
        ]),
        "stats" => By(&[tables::statistics_of_a_random_recipe_are_the_same_by_button_and_verb_and_shift_the_same]),
        "watch" => By(&[
            watched::what_lies_in_a_folder_is_watched_to_the_numbers_that_the_studio_shows,
            watched::what_arrives_is_followed_by_the_studio_to_the_numbers_that_watch_writes,
        ]),
        "evaluate" => By(&[recipes::a_random_recipe_gives_the_same_results_table_in_the_studio_and_by_the_verb]),
        "still" => By(&[stills::pictures_in_3d_are_the_same_files_in_both]),
        "export" => By(&[
            files::a_random_recipe_exports_the_same_files_by_button_and_verb,
            super::a_pair_in_files_is_the_same_in_both,
        ]),
        "adapt" => By(&[learned::TESTS[0]]),
        "label" => By(&[
            labels::random_edits_of_masks_by_hand_are_those_of_the_verb,
            labels::masks_proposed_by_a_random_recipe_are_those_of_the_verb,
            super::edits::a_drawing_and_a_clean_up_are_the_same_by_hand_and_by_verb,
        ]),
        "masks export" | "masks import" => {
            By(&[exchange::masks_are_imported_by_the_studio_as_by_the_verb_and_undo_takes_it_back])
        }
        "masks train" => By(&[learned::TESTS[1]]),
        "simulate" => Not("the studio opens what it wrote, and simulates nothing but the demo"),
        "doctor" => By(&[
            super::what_is_said_of_a_data_set_is_the_same_in_the_panel_and_by_the_verb,
            files::the_unit_of_a_cad_model_is_written_the_same_by_button_and_verb,
        ]),
        "bundle check" => Not("it looks at one model's files and computes nothing of a touch"),
        "runtime" => Not("it says which engine is there"),
        _ => return None,
    })
}

/// The verbs that the help of a command line lists.
fn listed(words: &[&str], home: &Path) -> Vec<String> {
    let help = run(&[words, &["--help"]].concat(), home);
    let text = String::from_utf8(help.stdout).unwrap();
    let names = text.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // A name stands two columns in; what follows of its description stands farther in.
    let names = names.filter_map(|line| line.strip_prefix("  ")).filter(|line| !line.starts_with(' '));
    names.map(|line| line.split_whitespace().next().unwrap().to_owned()).filter(|name| name != "help").collect()
}

#[test]
fn every_verb_says_how_it_is_held_against_the_studio() {
    let home = tempfile::tempdir().unwrap();
    let (mut by_tests, mut left_out) = (0, 0);
    for verb in listed(&[], home.path()) {
        let below = listed(&[&verb], home.path());
        let leaves: Vec<String> = match below.is_empty() {
            true => vec![verb],
            false => below.into_iter().map(|name| format!("{verb} {name}")).collect(),
        };
        for leaf in leaves {
            match held(&leaf) {
                Some(Held::By(tests)) => {
                    assert!(!tests.is_empty(), "{leaf}");
                    by_tests += 1;
                }
                Some(Held::Not(why)) => {
                    assert!(why.len() > 20, "{leaf}: {why}");
                    left_out += 1;
                }
                None => panic!("`touch2touch {leaf}`: no test holds it against the studio, and nothing says why"),
            }
        }
    }
    assert!(by_tests >= 14 && left_out >= 3, "{by_tests} by tests, {left_out} by reasons");
}
