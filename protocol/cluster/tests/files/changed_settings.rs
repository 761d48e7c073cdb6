//! Online changes of what remote I/Os do where nothing is proved.

use understudy_cluster::{ChangeError, ChangeTexts, Cluster, NeedsStop, changed_fallbacks};
use understudy_wire::ProgramId;

use crate::common::load;

const PROGRAM: &str = "PROGRAM one\nVAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT y, z : BOOL; level : REAL; END_VAR\nVAR RETAIN n : INT; END_VAR\nn := n + 1;\nEND_PROGRAM";

fn cluster(program: &str, settings: &str) -> Cluster {
    let file = format!(
        "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n[[controller]]\nname = \"two\"\nladder = \"two.st\"\n[[remote_io]]\ncontroller = \"one\"\n{settings}\n[[remote_io]]\ncontroller = \"two\"\n"
    );
    let two = PROGRAM.replace("PROGRAM one", "PROGRAM two");
    let loaded = load(&file, &[("one.st", program), ("two.st", &two)]);
    loaded.cluster.unwrap_or_else(|| panic!("{:?}\n{settings}", loaded.reports))
}

/// The keys, and what the plan says of them.
const KEYS: [(&str, &[&str]); 9] = [
    ("hold_cycles = 5", &["`hold_cycles` of remote I/O `one-io` changes from `3` to `5`"]),
    ("trial_cycles = 7", &["`trial_cycles` of remote I/O `one-io` changes"]),
    (
        "fail_safe = { z = true, level = 2.5 }",
        &[
            "`fail_safe.z` of remote I/O `one-io` changes from `FALSE` to `TRUE`",
            "`fail_safe.level` of remote I/O `one-io` changes from `0.0` to `2.5`",
        ],
    ),
    ("ramp = { level = 0.1 }", &["`ramp.level` of remote I/O `one-io` changes from none to `0.1`"]),
    (
        "release = \"operator\"",
        &["`release` of remote I/O `one-io` changes from `automatic` to `operator`"],
    ),
    (
        "value_fault = \"fail-safe\"",
        &["`value_fault` of remote I/O `one-io` changes from `hold` to `fail-safe`"],
    ),
    (
        "stale_state = \"cold\"",
        &["`stale_state` of remote I/O `one-io` changes from `operator` to `cold`"],
    ),
    (
        "restart = \"operator\"",
        &["`restart` of remote I/O `one-io` changes from `warm` to `operator`"],
    ),
    (
        "hold_cycles = 0\nfail_safe = { y = true }",
        &[
            "`hold_cycles` of remote I/O `one-io` changes from `3` to `0`",
            "`fail_safe.y` of remote I/O `one-io` changes from `FALSE` to `TRUE`",
        ],
    ),
];

/// Each key alone, with the program that it stands by and with a changed one, there and back, for members of both files: what is loaded makes exactly the
/// configuration of the other file, and its settings are those of that file.
#[test]
fn each_setting_changes_online() {
    let before = cluster(PROGRAM, "");
    for (keys, told) in KEYS {
        for program in [PROGRAM.to_owned(), PROGRAM.replace("n + 1", "n + 2")] {
            let after = cluster(&program, keys);
            let texts = ChangeTexts::between(&before, &after)
                .unwrap_or_else(|reasons| panic!("{keys}: {reasons:?}"));
            let found = changed_fallbacks(&before, &after, &texts);
            let found: Vec<String> = found.iter().map(ToString::to_string).collect();
            assert_eq!(found.len(), told.len(), "{keys}: {found:?}");
            for (found, told) in found.iter().zip(told) {
                assert!(found.starts_with(told), "{keys}: {found}");
            }
            assert_eq!(texts.programs.is_empty(), program == PROGRAM);
            assert_eq!(texts.touched().into_iter().collect::<Vec<_>>(), [ProgramId(0)]);
            // What travels is the same after it was written as JSON, real numbers included.
            let json = serde_json::to_string(&texts).expect("JSON");
            let texts: ChangeTexts = serde_json::from_str(&json).expect("the same");
            for cluster in [&before, &after] {
                for texts in [texts.clone(), texts.clone().back()] {
                    let change = texts.load(cluster).unwrap_or_else(|why| panic!("{keys}: {why}"));
                    for (hash, file) in [(&before, &before), (&after, &after)] {
                        let configuration = hash.agreement().configuration;
                        let settings = file.remote_io_settings(ProgramId(0)).expect("a remote I/O");
                        let fallback = change.fallback_in(configuration, ProgramId(0));
                        assert_eq!(fallback, Some(&settings.fallback), "{keys}");
                        assert_eq!(change.fallback_in(configuration, ProgramId(1)), None);
                        let changed = cluster.changed(&texts, configuration).expect("it is read");
                        assert_eq!(changed.canonical_text(), file.canonical_text(), "{keys}");
                        assert_eq!(changed.agreement(), file.agreement(), "{keys}");
                        let of_changed = changed.remote_io_settings(ProgramId(0));
                        assert_eq!(of_changed.expect("one").fallback, settings.fallback, "{keys}");
                    }
                }
            }
        }
    }
}

/// Texts that were changed on their way, or are of other settings, are refused, and nothing of them is taken.
#[test]
fn settings_that_are_none_of_the_cluster_are_refused() {
    let before = cluster(PROGRAM, "ramp = { level = 0.5 }");
    let after = cluster(PROGRAM, "hold_cycles = 5\nramp = { level = 0.1 }");
    let texts = ChangeTexts::between(&before, &after).expect("an online change");
    let json = serde_json::to_value(&texts).expect("JSON");
    let load = |pointer: &str, value: serde_json::Value| {
        let mut changed = json.clone();
        *changed.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}: {json:#}")) = value;
        let texts: ChangeTexts = serde_json::from_value(changed).expect("it has the form");
        texts.load(&before).expect_err(pointer)
    };
    let no_settings = |error: &ChangeError| matches!(error, ChangeError::NoSettings { .. });
    let image = |width: u32| serde_json::json!({ "width": width, "words": [0] });
    for (pointer, value) in [
        ("/fallbacks/0/after/fail_safe", image(33)),
        ("/fallbacks/0/after/fail_safe", image(0)),
        ("/fallbacks/0/after/hold_cycles", 100_001.into()),
        ("/fallbacks/0/after/trial_cycles", u32::MAX.into()),
        ("/fallbacks/0/after/restart", serde_json::Value::Null),
        // The bit of a BOOL, a bit within a value, and a step that is no number above 0.
        ("/fallbacks/0/after/ramps/0/0", 0.into()),
        ("/fallbacks/0/after/ramps/0/0", 34.into()),
        ("/fallbacks/0/after/ramps/0/1", 0.into()),
        ("/fallbacks/0/after/ramps/0/1", f64::INFINITY.to_bits().into()),
        ("/fallbacks/0/after/ramps/0/1", f64::NAN.to_bits().into()),
    ] {
        let value = if pointer.ends_with("fail_safe") && value["width"] == 0 {
            serde_json::json!({ "width": 0, "words": [] })
        } else {
            value
        };
        let error = load(pointer, value);
        assert!(no_settings(&error), "{pointer}: {error}");
    }
    let is_other = |error: &ChangeError| matches!(error, ChangeError::OtherSettings { .. });
    assert!(is_other(&load("/fallbacks/0/before/hold_cycles", 4.into())));
    let claimed = load("/fallbacks/0/after/hold_cycles", 6.into());
    assert!(matches!(claimed, ChangeError::NotItsResult { .. }), "{claimed}");
    let missing = load("/fallbacks/0/program", 7.into());
    assert!(matches!(missing, ChangeError::NoSuchProgram { .. }), "{missing}");
}

/// The remote I/O and the stations would have to begin to keep values, or to end it.
#[test]
fn the_first_retentive_variable_needs_a_stop() {
    let kept = cluster(PROGRAM, "");
    let not_kept = cluster(&PROGRAM.replace("VAR RETAIN", "VAR"), "");
    for (before, after) in [(&kept, &not_kept), (&not_kept, &kept)] {
        let reasons = ChangeTexts::between(before, after).expect_err("it needs a stop");
        let [NeedsStop::Setting(setting)] = &reasons[..] else { panic!("{reasons:?}") };
        assert_eq!(setting.to_string(), "`restart` of remote I/O `one-io` changes");
    }
}
