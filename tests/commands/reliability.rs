//! Reliability, calculated and measured.

use std::fs;

use insta::assert_snapshot;
use serde_json::Value;

use crate::{empty_folder, understudy};

const PRESS_CELL: &str = "examples/press-cell/cluster.toml";
const RATES: [&str; 4] = ["--mtbf", "10000h", "--mttr", "24h"];

fn reliability(arguments: &[&str]) -> crate::Answer {
    understudy(&[&["reliability"], arguments].concat())
}

#[test]
fn reliability_explains_itself() {
    assert_snapshot!(reliability(&["--help"]).shown());
}

#[test]
fn measure_explains_itself() {
    assert_snapshot!(understudy(&["measure", "--help"]).shown());
}

#[test]
fn twenty_controllers_beside_what_else_could_be_bought() {
    let arguments = [&["--controllers", "20", "--mission", "1000h"], &RATES[..]].concat();
    assert_snapshot!(reliability(&arguments).shown());
}

#[test]
fn the_figures_for_twenty_controllers_stand_at_the_top_and_in_the_result() {
    let arguments = [
        &["--controllers", "20", "--mission", "1000h", "--json"],
        &RATES[..],
    ]
    .concat();
    let found = reliability(&arguments).json();
    let check = |name: &str, expected: f64, tolerance: f64| {
        assert_eq!(found[name], found["result"][name], "{name}");
        let value = found[name].as_f64().expect(name);
        assert!((value - expected).abs() <= tolerance, "{name}: {value}");
    };
    check("mttf_cluster_hours", 110_906.0, 0.5);
    check("mttf_duplex_hours", 104_939.0, 0.5);
    check("mttf_paper_hours", 10_897.0, 0.5);
    check("mttf_simplex_hours", 500.0, 1e-9);
    // (20): (2N + 1) / (N (N + 1) lambda) + mu / (N (N + 1) lambda^2), in closed form.
    check(
        "mttf_paper_hours",
        41e4 / 420.0 + 1e8 / (24.0 * 420.0),
        1e-8,
    );
    check("reliability_simplex", (-2.0_f64).exp(), 1e-13);
    let number = |name: &str| found[name].as_f64().expect(name);
    assert!((number("p0") + number("p1") + number("p2") - 1.0).abs() < 1e-12);
    assert!((number("p0") + number("p1") - number("reliability_paper")).abs() < 1e-12);
    assert!(number("mttf_tmr_hours") > 0.0 && number("reliability_duplex") < 1.0);
    let spare = [
        &["--controllers", "20", "--spares", "2", "--json"],
        &RATES[..],
    ]
    .concat();
    let hours = reliability(&spare).json()["mttf_cluster_hours"].as_f64();
    assert!(
        hours.is_some_and(|hours| (hours / 3.03e7 - 1.0).abs() < 1e-3),
        "{hours:?}"
    );
}

#[test]
fn a_cluster_file_says_how_many_boxes_there_are() {
    let of_file = reliability(&[&[PRESS_CELL, "--json"], &RATES[..]].concat()).json();
    let by_hand = reliability(&[&["--controllers", "2", "--json"], &RATES[..]].concat()).json();
    assert_eq!(of_file["result"], by_hand["result"]);
    assert_eq!(of_file["boxes"], Value::from(3));
}

#[test]
fn everything_that_is_wrong_with_the_question_is_said() {
    let answer = reliability(&[
        "--controllers",
        "0",
        "--mtbf",
        "10000",
        "--mttr",
        "-4h",
        "--coverage",
        "1.5",
        "--beta",
        "-1",
        "--mission",
        "3 weeks",
        "--crews",
        "0",
    ]);
    assert_snapshot!(answer.shown());
    for wrong in ["0h", "infh", "1e99h", "h", ""] {
        let answer = reliability(&["--controllers", "2", "--mtbf", wrong, "--mttr", "24h"]);
        assert_eq!(answer.status, 2, "{wrong}");
        assert!(answer.errors.contains("--mtbf"), "{}", answer.errors);
    }
    let unit = reliability(&[&["--controllers", "2", "--coverage", "NaN"], &RATES[..]].concat());
    assert_eq!(unit.status, 2);
    assert!(unit.errors.contains("U0703"), "{}", unit.errors);
    assert_eq!(
        reliability(&["--controllers", "2"]).status,
        2,
        "rates are asked for"
    );
}

#[test]
fn a_chain_of_ones_own() {
    let folder = empty_folder("chain");
    let file = folder.join("two.chain");
    let path = file.to_str().expect("text");
    let text = "state whole start\nstate half\nstate gone failure\n\
                whole -> half : 2 / 100h\nhalf -> whole : 1 / 4h\nhalf -> gone : 1 / 100h\n";
    fs::write(&file, text).expect("written");
    let found = reliability(&["--chain", path, "--mission", "10h", "--json"]).json();
    // (3 lambda + mu) / (2 lambda^2)
    let hours = found["result"]["mttf_hours"].as_f64().expect("a mean time");
    assert!((hours - (0.03 + 0.25) / 2e-4).abs() < 1e-9, "{hours}");
    fs::write(&file, text.replace("2 / 100h", "2 / 100")).expect("written");
    let wrong = reliability(&["--chain", path]);
    assert_eq!(wrong.status, 2);
    assert!(wrong.errors.contains("error[U0725]"), "{}", wrong.errors);
}

#[test]
fn a_report_has_all_its_files_or_none() {
    let folder = empty_folder("reliability_report");
    let out = folder.join("report");
    let out = out.to_str().expect("text");
    let answer = reliability(&[&[PRESS_CELL, "--report", out], &RATES[..]].concat());
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let mut names: Vec<String> = fs::read_dir(out)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("a file")
                .file_name()
                .into_string()
                .expect("text")
        })
        .collect();
    names.sort();
    assert_eq!(
        names,
        ["reliability.csv", "reliability.html", "reliability.json"]
    );
    let page = fs::read_to_string(folder.join("report/reliability.html")).expect("a page");
    assert!(page.contains("press-cell") && page.contains("<svg"));
    // A file stands where the folder should be.
    let taken = folder.join("taken");
    fs::write(&taken, "").expect("written");
    let taken = taken.to_str().expect("text");
    let refused = reliability(&[&[PRESS_CELL, "--report", taken], &RATES[..]].concat());
    assert_eq!(refused.status, 1);
    assert!(
        refused.errors.contains("error[U0602]"),
        "{}",
        refused.errors
    );
}

#[test]
fn a_campaign_is_a_function_of_its_seed_and_covers_the_model() {
    let campaign = |seed: &str| {
        understudy(&[
            "measure",
            PRESS_CELL,
            "--mtbf",
            "10s",
            "--mttr",
            "500ms",
            "--failures",
            "40",
            "--seed",
            seed,
            "--json",
        ])
    };
    let (first, again, other) = (campaign("1"), campaign("1"), campaign("2"));
    assert_eq!(first.output, again.output);
    assert_ne!(first.output, other.output);
    assert_eq!(first.status, 0, "{}{}", first.output, first.errors);
    let found = &first.json()["result"];
    assert_eq!(found["assessment"]["agrees"], Value::from(true));
    assert_eq!(found["assessment"]["failures"], Value::from(40));
    assert_eq!(found["violations"], Value::Array(Vec::new()));
    assert_eq!(found["bias"]["relative"], Value::from(0.0));
}

#[test]
fn a_campaign_that_says_nothing_or_never_ends_is_refused() {
    let check = |arguments: &[&str], code: &str| {
        let answer = understudy(&[&["measure", PRESS_CELL], arguments].concat());
        assert_eq!(answer.status, 2, "{arguments:?}");
        assert!(
            answer.errors.contains(code),
            "{arguments:?}: {}",
            answer.errors
        );
    };
    check(
        &["--mtbf", "100h", "--mttr", "1h", "--acceleration", "10001"],
        "U0717",
    );
    check(
        &[
            "--mtbf",
            "1000h",
            "--mttr",
            "24h",
            "--cycles-per-mttr",
            "50",
        ],
        "U0717",
    );
    check(
        &["--mtbf", "100h", "--mttr", "1h", "--acceleration", "NaN"],
        "U0716",
    );
    check(
        &["--mtbf", "100h", "--mttr", "1h", "--acceleration", "-3"],
        "U0716",
    );
    check(
        &["--mtbf", "100h", "--mttr", "1h", "--cycles-per-mttr", "0"],
        "U0716",
    );
    check(&["--mtbf", "10000h", "--mttr", "24h"], "U0609");
    check(&["--mtbf", "10000", "--mttr", "x"], "U0705");
}
