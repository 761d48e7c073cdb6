//! Every command takes the same forms of a duration, and refuses others in the same words.

use crate::{empty_folder, understudy_in};

/// Calls without their last argument, a duration. No file exists, so that none of them starts anything.
const CALLS: [&[&str]; 10] = [
    &["verify", "missing.ladder", "--period"],
    &["verify", "missing.ladder", "--budget"],
    &["check", "missing.ladder", "--budget"],
    &["convert", "missing.ladder", "out.st", "--period"],
    &["allocate", "missing.ladder", "--period"],
    &["allocate", "missing.ladder", "--budget"],
    &["resources", "missing.ladder", "--period"],
    &["lab", "missing.toml", "--period"],
    &["simulate", "missing.toml", "--period"],
    &["campaign", "missing.toml", "--budget"],
];

#[test]
fn every_command_takes_the_same_durations() {
    let folder = empty_folder("durations");
    for call in CALLS {
        for duration in ["1.5ms", "1500us", "10 ms", "1m30s", "10min", "2h", "200000ns"] {
            let answer = understudy_in(&folder, &[call, &[duration]].concat());
            let errors = &answer.errors;
            assert!(
                errors.contains("missing.") && !errors.contains("invalid"),
                "{call:?} {duration}: {errors}"
            );
        }
    }
}

#[test]
fn every_command_refuses_other_texts_in_the_same_words() {
    let folder = empty_folder("no-durations");
    for call in CALLS {
        for text in ["5 minuts", "10", "ms", "1.s", "1e3ms", "1s1h"] {
            let answer = understudy_in(&folder, &[call, &[text]].concat());
            let expected =
                format!("invalid duration `{text}`: expected a number with a unit, such as `10ms`");
            let errors = answer.errors.split_whitespace().collect::<Vec<_>>().join(" ");
            assert_eq!(answer.status, 2, "{call:?} {text}");
            assert!(errors.contains(&expected), "{call:?} {text}: {errors}");
        }
    }
}
