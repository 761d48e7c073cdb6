//! Campaigns of failures on real processes.

use std::io::Read;

use super::*;

const MEASURE: [&str; 9] =
    ["measure", PRESS_CELL, "--real", "--link", "udp", "--period", PERIOD, "--seed", "1"];

/// A busy host may cost a failure, never the account of it: what was measured stands beside the model, and nobody is left.
#[test]
fn stations_are_killed_until_the_system_fails_and_the_journals_give_an_outlook() {
    let _one = some_at_a_time();
    let out = empty_folder("measure_real");
    let times = ["--mtbf", "2s", "--mttr", "1s", "--failures", "2", "--limit", "50s", "--out"];
    let arguments = [&MEASURE[..], &times, &[out.to_str().expect("text")]].concat();
    let (_, document, errors) = answer(&arguments);
    no_orphan(&out);
    assert_eq!(document["failures"], Value::Array(Vec::new()), "{errors}");
    let found = &document["result"];
    assert_eq!(found["violations"], Value::Array(Vec::new()), "{document:#}");
    let assessment = &found["assessment"];
    assert_eq!(assessment["world"], "processes");
    let failures = assessment["failures"].as_u64().expect("a count");
    let censored = assessment["censored"].as_u64().expect("a count");
    assert!((1..=2).contains(&(failures + censored)), "{document:#}");
    for (cause, _) in assessment["causes"].as_object().expect("causes") {
        assert!(cause.contains("understudy"), "{cause}");
    }
    let replica = out.join("latest/replica-1");
    let (status, outlook, errors) =
        answer(&["outlook", replica.to_str().expect("text"), "--ahead", "1s", "--mttr", "1s"]);
    assert_eq!(status, 0, "{errors}");
    let result = &outlook["result"];
    assert_eq!((&result["controllers"], &result["understudies"]), (&2.into(), &1.into()));
    let reliability = &result["outlook"]["reliability"]["estimate"];
    assert!(reliability.as_f64().is_some_and(|r| r > 0.0 && r < 1.0), "{outlook:#}");
}

#[test]
fn an_interrupted_campaign_leaves_what_was_measured_and_no_orphan() {
    let _one = some_at_a_time();
    let out = empty_folder("measure_interrupted");
    let times = ["--mtbf", "1000h", "--mttr", "24h", "--acceleration", "1", "--out"];
    let arguments = [&MEASURE[..], &times].concat();
    let (mut child, _errors) = running_with(&arguments, &out, &[], "synchronised");
    signal(child.id(), Signal::SIGINT);
    let mut text = String::new();
    let output = child.stdout.take();
    output.expect("piped").read_to_string(&mut text).expect("text");
    child.wait().expect("it ends");
    no_orphan(&out);
    assert!(text.contains("interrupted after 0 of"), "{text}");
    assert!(text.contains("MTTF measured"), "{text}");
    assert!(out.join("latest/replica-1/journal.jsonl").exists());
}
