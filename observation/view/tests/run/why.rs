//! Chains of reasons.

use understudy_view::Reason;

use crate::support::{KILL_EACH, cell, model, scenario};

#[test]
fn a_reconstructed_output_names_parity_word_mask_and_lineage() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let why = model.why("press.move_down", Some(140)).expect("it is known");
    insta::assert_snapshot!(why.to_text());
    let reconstructed = why.reconstructed.expect("the press is killed");
    assert!(reconstructed.proved);
    assert_eq!(reconstructed.word_of, "understudy");
    assert_eq!(reconstructed.not_received, ["press"]);
}

/// In every cycle, for every output: the chain begins with what was driven, and every contact in it reads what the samples, the
/// memory or the rungs above say.
#[test]
fn every_output_of_every_cycle_is_explained() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    for cycle in 0..299 {
        for output in ["grip", "extend", "move_up", "%QX0.1"] {
            let Ok(why) = model.why(output, Some(cycle)) else {
                continue;
            };
            let reason = why.because.expect("nothing is fail-safe");
            assert_eq!(reason.value, why.value);
            assert_eq!(why.scanned, None);
            assert!(count(&reason) <= 400);
            let text = serde_json::to_string(&reason).expect("JSON");
            assert!(!text.contains("not known"), "{output} in {cycle}: {text}");
        }
    }
}

fn count(reason: &Reason) -> usize {
    1 + reason.because.iter().map(count).sum::<usize>()
}

#[test]
fn what_is_not_there_is_said() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let check = |signal: &str, cycle: Option<i64>, code: &str, expected: &str| {
        let error = model.why(signal, cycle).expect_err("it has no answer");
        assert_eq!(error.code(), code);
        assert_eq!(error.words(), expected);
        assert_eq!(error.to_string(), format!("{code}: {expected}"));
    };
    check(
        "move_don",
        None,
        "U0573",
        "no program has an output `move_don`; did you mean `move_down`?",
    );
    check(
        "%QX0.0",
        None,
        "U0574",
        "robot and press have an output `%QX0.0`; name the program too, for example `robot.%QX0.0`",
    );
    assert!(model.why("press.%QX0.0", None).is_ok());
    let error = model.why("press.move_down", Some(5000)).expect_err("it has no answer");
    assert_eq!(error.code(), "U0575");
}
