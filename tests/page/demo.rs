//! `understudy demo --watch` from outside: its scenario is judged undisturbed, and then its cluster stays up and takes commands.

use std::fs;

use serde_json::Value;

use crate::commands::give;
use crate::{Page, empty_folder, member, one_at_a_time, understudy};

#[test]
fn the_cluster_of_a_demo_stays_up_for_the_visitor() {
    let _turn = one_at_a_time();
    let runs = empty_folder("demo_watch");
    let mut command = understudy(&["demo", "--watch", "127.0.0.1:0"]);
    command.args(["--link", "udp", "--period", "50ms", "--cycles", "150"]).arg("--out").arg(&runs);
    let page = Page::start(command);
    let kill = serde_json::json!({ "command": "kill" });
    page.wait_for("the first cycles", |state| member(state, "robot")["state"] == "publishing");
    // It would disturb the scenario, and the page says so before a button is pressed.
    assert_eq!(page.get("/api/run").json()["commands"]["after_scenario"], true);
    assert_eq!(give(&page, "robot", &kill), (409, "U0560".to_owned()));
    let over = page.wait_for("the verdict", |state| state["scenario_over"].is_string());
    assert_eq!(over["finished"], false);
    assert_eq!(give(&page, "robot", &kill).0, 200);
    page.wait_for("outputs that go on", |state| {
        member(state, "robot")["state"] == "killed"
            && state["programs"][0]["source"] == "reconstructed"
    });
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    assert!(!run.join("summary.json").exists(), "it is not over");
    page.end();
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    // What the visitor does is not judged, and nobody cut the scenario short.
    assert_eq!((&summary["cycles_run"], &summary["interrupted"]), (&150.into(), &false.into()));
    let verdict = over["scenario_over"].as_str().expect("a verdict");
    assert_eq!(verdict.starts_with("passed"), summary["passed"] == true, "{verdict}");
    let off = summary["stations"][0]["intervals"].to_string();
    assert!(!off.contains("\"off\""), "{off}");
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let place = |words: &str| journal.find(words).unwrap_or_else(|| panic!("no {words}"));
    assert!(place("\"scenario-over\"") < place("\"crash\""));
}
