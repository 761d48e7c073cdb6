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
    let arguments = [&["--controllers", "20", "--mission", "1000h", "--json"], &RATES[..]].concat();
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
    check("mttf_paper_hours", 41e4 / 420.0 + 1e8 / (24.0 * 420.0), 1e-8);
    check("reliability_simplex", (-2.0_f64).exp(), 1e-13);
    let number = |name: &str| found[name].as_f64().expect(name);
    assert!((number("p0") + number("p1") + number("p2") - 1.0).abs() < 1e-12);
    assert!((number("p0") + number("p1") - number("reliability_paper")).abs() < 1e-12);
    assert!(number("mttf_tmr_hours") > 0.0 && number("reliability_duplex") < 1.0);
    let spare = [&["--controllers", "20", "--spares", "2", "--json"], &RATES[..]].concat();
    let hours = reliability(&spare).json()["mttf_cluster_hours"].as_f64();
    assert!(hours.is_some_and(|hours| (hours / 3.03e7 - 1.0).abs() < 1e-3), "{hours:?}");
}

/// Two shared spares protect 25 groups of 12 controllers better than 300 pairs, with little more than half of the machines.
#[test]
fn shared_spares_are_compared_with_pairs() {
    let plant = ["--controllers", "300", "--groups", "25", "--shared-spares", "2"];
    let found = reliability(&[&plant[..], &RATES[..], &["--json"]].concat()).json();
    let row = |place: usize| {
        let row = &found["result"]["compared"][place];
        (row["boxes"].as_u64().expect("a count"), row["mttf_hours"].as_f64().expect("hours"))
    };
    let rows = [(600, 7_018.0), (325, 7_247.0), (326, 24_166.0), (327, 110_526.0)];
    for (place, (boxes, hours)) in rows.into_iter().enumerate() {
        let found = row(place);
        assert_eq!(found.0, boxes);
        assert!((found.1 / hours - 1.0).abs() < 1e-3, "{place}: {found:?}");
    }
    // Pairs in closed form: (3 lambda + mu) / (2 lambda^2), for each of 300.
    let pairs = (3e-4 + 1.0 / 24.0) / 2e-8 / 300.0;
    assert!((row(0).1 / pairs - 1.0).abs() < 5e-3, "{pairs}");
    let refused =
        reliability(&[&["--controllers", "4", "--shared-spares", "9"], &RATES[..]].concat());
    assert_eq!(refused.status, 2, "{}", refused.errors);
    // Options of spares are not ignored without spares, and one group at least is small enough for them.
    for option in [["--wake", "2s"], ["--wake-coverage", "0.9"], ["--too-large", "1"]] {
        let alone = reliability(&[&["--controllers", "4"], &option[..], &RATES[..]].concat());
        assert!(alone.status == 2 && alone.errors.contains("--shared-spares"), "{}", alone.errors);
    }
    let none = ["--controllers", "8", "--groups", "2", "--shared-spares", "1", "--too-large", "2"];
    let refused = reliability(&[&none[..], &RATES[..]].concat());
    let wanted =
        "the number of groups that are too large for the spares is 2; it must be between 0 and 1";
    assert!(refused.status == 2 && refused.errors.contains(wanted), "{}", refused.errors);
}

/// The tables of the page about whole cells are what its commands print.
#[test]
fn the_tables_of_a_whole_cell_are_those_of_the_page() {
    let page = include_str!("../../docs/how-to/no-single-point.md");
    let mut found = 0;
    for after in page.split("```sh\nunderstudy ").skip(1) {
        let (arguments, after) = after.split_once('\n').expect("a line");
        let (_, table) = after.split_once("```text\n").expect("a table");
        let (table, _) = table.split_once("```").expect("its end");
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let answer = understudy(&arguments);
        assert_eq!(answer.status, 0, "{}", answer.errors);
        assert!(table.lines().count() > 3, "{table}");
        for line in table.lines() {
            assert!(answer.output.lines().any(|it| it == line), "{line}\n{}", answer.output);
        }
        found += 1;
    }
    assert_eq!(found, 3);
}

/// The wiring of a cluster file decides whether field devices are single points.
#[test]
fn field_devices_follow_the_wiring() {
    let times = ["--remote-io", "20000h,24h", "--field-device", "300000h,24h", "--json"];
    let of_file = |file: &str| {
        let file = format!("examples/twin-remote-io/{file}.toml");
        reliability(&[&[file.as_str()], &RATES[..], &times[..]].concat()).json()["result"].clone()
    };
    let by_hand = |parallel: &str| {
        let counts = ["--controllers", "2", "--twins", "2", "--parallel", parallel];
        reliability(&[&counts[..], &RATES[..], &times[..]].concat()).json()["result"].clone()
    };
    let (exclusive, parallel) = (of_file("cluster"), of_file("parallel"));
    assert_eq!(
        (&exclusive["cells"][0], &parallel["cells"][0]),
        (&by_hand("0")["cells"][0], &by_hand("2")["cells"][0])
    );
    assert_eq!(exclusive["single_points"][0]["part"], "field device");
    assert_eq!(parallel["single_points"], serde_json::json!([]));
    assert_eq!((&exclusive["boxes"], &parallel["boxes"]), (&Value::from(9), &Value::from(11)));
    let mean = |of: &Value| of["mttf_cluster_hours"].as_f64().expect("a mean");
    assert!(mean(&exclusive) < 150_000.0 && mean(&parallel) > 5.0 * mean(&exclusive));
}

/// A cluster file says how many remote I/Os, twins and networks there are.
#[test]
fn a_whole_cell_has_its_remote_ios_twins_and_networks() {
    let times = ["--remote-io", "20000h,24h", "--network", "100000h,8h"];
    let cell = "examples/twin-remote-io/cluster.toml";
    let of_file = reliability(&[&[cell, "--json"], &RATES[..], &times[..]].concat()).json();
    let counts = ["--controllers", "2", "--twins", "2", "--networks", "2", "--json"];
    let by_hand = reliability(&[&counts[..], &RATES[..], &times[..]].concat()).json();
    assert_eq!(of_file["result"], by_hand["result"]);
    assert_eq!(of_file["boxes"], Value::from(9), "3 stations, 4 remote I/Os, 2 networks");
    let single = reliability(&[&[PRESS_CELL, "--json"], &RATES[..], &times[..]].concat()).json();
    assert_eq!(single["boxes"], Value::from(6), "3 stations, 2 remote I/Os, a network");
    let mean = |found: &Value| found["result"]["mttf_cluster_hours"].as_f64().expect("a mean");
    assert!(mean(&of_file) > 80.0 * mean(&single));
    // Spares: the same parts in series with all rows.
    let plant = ["--controllers", "300", "--groups", "25", "--shared-spares", "1", "--json"];
    let parts = ["--twins", "300", "--networks", "2"];
    let found = reliability(&[&plant[..], &RATES[..], &times[..], &parts[..]].concat()).json();
    let row = |place: usize| found["result"]["compared"][place].clone();
    assert_eq!(row(0)["boxes"], Value::from(600 + 600 + 50));
    assert_eq!(row(2)["boxes"], Value::from(300 + 25 + 1 + 600 + 50));
    // 300 pairs of remote I/Os and 25 of networks in closed form.
    let pair = |l: f64, m: f64| 2.0 * l * l / (3.0 * l + m);
    let parts = 300.0 * pair(1.0 / 20_000.0, 1.0 / 24.0) + 25.0 * pair(1e-5, 1.0 / 8.0);
    let wanted = 1.0 / (1.0 / 24_166.0 + parts);
    let hours = row(2)["mttf_hours"].as_f64().expect("a mean");
    assert!((hours / wanted - 1.0).abs() < 5e-3, "{hours}, {wanted}");
    let wrong = ["--controllers", "2", "--twins", "3", "--remote-io", "1h", "--network", "1h,0h"];
    let refused = reliability(&[&wrong[..], &RATES[..]].concat());
    assert_eq!(refused.status, 2);
    assert!(
        refused.errors.contains("--remote-io") && refused.errors.contains("--network"),
        "{}",
        refused.errors
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
    assert_eq!(reliability(&["--controllers", "2"]).status, 2, "rates are asked for");
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
        .map(|entry| entry.expect("a file").file_name().into_string().expect("text"))
        .collect();
    names.sort();
    assert_eq!(names, ["reliability.csv", "reliability.html", "reliability.json"]);
    let page = fs::read_to_string(folder.join("report/reliability.html")).expect("a page");
    assert!(page.contains("press-cell") && page.contains("<svg"));
    // A file stands where the folder should be.
    let taken = folder.join("taken");
    fs::write(&taken, "").expect("written");
    let taken = taken.to_str().expect("text");
    let refused = reliability(&[&[PRESS_CELL, "--report", taken], &RATES[..]].concat());
    assert_eq!(refused.status, 1);
    assert!(refused.errors.contains("error[U0602]"), "{}", refused.errors);
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
        assert!(answer.errors.contains(code), "{arguments:?}: {}", answer.errors);
    };
    check(&["--mtbf", "100h", "--mttr", "1h", "--acceleration", "10001"], "U0717");
    check(&["--mtbf", "1000h", "--mttr", "24h", "--cycles-per-mttr", "50"], "U0717");
    check(&["--mtbf", "100h", "--mttr", "1h", "--acceleration", "NaN"], "U0716");
    check(&["--mtbf", "100h", "--mttr", "1h", "--acceleration", "-3"], "U0716");
    check(&["--mtbf", "100h", "--mttr", "1h", "--cycles-per-mttr", "0"], "U0716");
    check(&["--mtbf", "10000h", "--mttr", "24h"], "U0609");
    check(&["--mtbf", "10000", "--mttr", "x"], "U0705");
}

#[test]
fn a_campaign_with_one_crew_is_held_against_the_model_with_one_crew() {
    let measure = |crews: &str| {
        let times = ["--mtbf", "3s", "--mttr", "500ms", "--failures", "30"];
        let how = ["--seed", "1", "--json", "--crews", crews];
        understudy(&[&["measure", PRESS_CELL][..], &times, &how].concat())
    };
    let (one, two) = (measure("1").json(), measure("2").json());
    let model = |found: &Value| found["result"]["mttf_closed_form_hours"].as_f64();
    assert!(model(&one) < model(&two));
    assert_eq!(one["result"]["assessment"]["agrees"], Value::from(true));
    let none = measure("0");
    assert_eq!(none.status, 2);
    assert!(none.errors.contains("U0704") || none.output.contains("U0704"));
}

#[test]
fn what_belongs_to_processes_is_refused_without_them() {
    let times = ["--mtbf", "10s", "--mttr", "500ms"];
    for more in [["--limit", "1min"], ["--out", "somewhere"]] {
        let answer = understudy(&[&["measure", PRESS_CELL][..], &times, &more].concat());
        assert_eq!(answer.status, 2, "{more:?}: {}", answer.errors);
    }
}

#[test]
fn outlook_explains_itself() {
    assert_snapshot!(understudy(&["outlook", "--help"]).shown());
}

#[test]
fn a_journal_gives_the_hours_to_come() {
    let folder = empty_folder("outlook");
    let out = folder.to_str().expect("text");
    let scenario = ["--scenario", "scenarios/kill-each.toml", "--seed", "1"];
    let run = understudy(&[&["simulate", PRESS_CELL, "--out", out][..], &scenario].concat());
    assert_eq!(run.status, 0, "{}", run.errors);
    let latest = folder.join("latest");
    let latest = latest.to_str().expect("text");
    assert_snapshot!(understudy(&["outlook", latest, "--ahead", "10s"]).shown());
    let found = understudy(&["outlook", latest, "--ahead", "10s", "--json"]).json();
    let observed = &found["result"]["observed"];
    assert_eq!(observed["asked"], observed["masked"]);
    assert_eq!(observed["repairs"], Value::from(3));
    let check = |arguments: &[&str], code: &str| {
        let answer = understudy(&[&["outlook"], arguments].concat());
        assert_eq!(answer.status, 2, "{arguments:?}");
        assert!(answer.errors.contains(code), "{}", answer.errors);
    };
    check(&["absent"], "U0601");
    check(&[latest, "--ahead", "10"], "U0705");
    check(&["examples/press-cell/cluster.toml"], "U0532");
}

#[test]
fn boxes_may_differ_and_parts_may_be_shared() {
    let twenty = ["--controllers", "20", "--json"];
    let hours = |more: &[&str]| {
        let answer = reliability(&[&twenty, &RATES[..], more].concat());
        assert_eq!(answer.status, 0, "{}", answer.errors);
        answer.json()["mttf_cluster_hours"].as_f64().expect("hours")
    };
    let alike = hours(&[]);
    assert_eq!(hours(&["--box", "same*3=10000h,24h"]), alike);
    assert!(hours(&["--box", "old*3=4000h,48h"]) < alike);
    assert!(hours(&["--box", "understudies=40000h,24h"]) > alike);
    assert!(hours(&["--shared", "power=200000h"]) < alike);
    let named = |more: &[&str]| reliability(&[&[PRESS_CELL], &RATES[..], more].concat());
    assert_eq!(named(&["--box", "robot=4000h,48h", "--box", "understudy=1y,1d"]).status, 0);
    let wrong = named(&[
        "--box",
        "robt=4000h,48h",
        "--box",
        "robot",
        "--box",
        "press*2=1h,1h",
        "--shared",
        "power=0h",
    ]);
    assert_snapshot!(wrong.shown());
}

#[test]
fn the_papers_mode_of_a_cluster_file_is_calculated_as_such() {
    let file = fs::read_to_string(PRESS_CELL).expect("the example");
    let folder = empty_folder("paper_mode");
    for name in ["robot.ladder", "press.ladder"] {
        fs::copy(format!("examples/press-cell/{name}"), folder.join(name)).expect("copied");
    }
    let path = folder.join("cluster.toml");
    let period = "period = \"10ms\"";
    assert!(file.contains(period));
    fs::write(&path, file.replace(period, &format!("{period}\nmode = \"paper\"")))
        .expect("written");
    let path = path.to_str().expect("text");
    let found = reliability(&[&[path, "--json"], &RATES[..]].concat()).json();
    let ratio = found["mttf_cluster_hours"].as_f64().expect("hours")
        / found["mttf_paper_hours"].as_f64().expect("hours");
    assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
}
