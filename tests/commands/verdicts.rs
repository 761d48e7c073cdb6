//! Ladders of other people with properties and verdicts, where they are at hand: ours are the same, or the difference is explained.

use std::fs;
use std::path::{Path, PathBuf};
use understudy_testing::skip;

use crate::{empty_folder, understudy_in};

/// What another checker says otherwise, and why.
const EXPLAINED: [(&str, &str); 4] = [
    // It is checked with a budget of 4 turns of its loop, which has 10.
    ("userfb_watchdog_fail", "holds"),
    // Its rungs read the values from before the scan, so that `q` is a scan behind `m`. A PLC scans rung by rung.
    ("graphical_feedback_snapshot_fail", "holds"),
    // It is checked with inputs that fail, which is no part of the program.
    ("fault_injection_unsafe", "holds"),
    // It begins with a counter at the largest number, which the counters of the standard do not.
    ("counter_saturate_at_max", "fails"),
];

fn folders() -> Vec<PathBuf> {
    let data = std::env::var_os("UNDERSTUDY_DATA").unwrap_or_default();
    let Ok(entries) = fs::read_dir(Path::new(&data).join("ladder/esbmc_ld")) else {
        skip("UNDERSTUDY_DATA names no folder with ladder/esbmc_ld");
        return Vec::new();
    };
    let mut folders: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    folders.sort();
    folders
}

/// Their properties as ours: a line each.
fn properties(text: &str) -> String {
    let mut lines = Vec::new();
    let mut fields: Vec<(String, String)> = Vec::new();
    for line in text.lines().chain(["  - id: end"]) {
        let line = line.trim();
        if line.starts_with("- id:") {
            lines.extend(property(&fields));
            fields.clear();
        } else if let Some((name, value)) = line.split_once(':') {
            let value = value.trim().trim_matches('"').replace("&&", "&").replace("||", "|");
            fields.push((name.to_owned(), value));
        }
    }
    lines.join("\n")
}

fn property(fields: &[(String, String)]) -> Option<String> {
    let field = |name: &str| {
        let found = fields.iter().find(|(field, _)| field == name);
        found.map(|(_, value)| value.as_str())
    };
    Some(match field("kind")? {
        "invariant" => format!("AG ({})", field("expression")?),
        "absence" | "reachability" => format!("AG !({})", field("expression")?),
        "mutual_exclusion" => {
            let both = field("variables")?.trim_matches(['[', ']']).replace(", ", " and ");
            format!("never {both}")
        }
        "response" => format!(
            "{} is followed by {} within {} scans",
            field("trigger")?,
            field("response")?,
            field("max_scans")?
        ),
        other => panic!("a kind of property that is not known: {other}"),
    })
}

#[test]
fn verdicts_are_those_of_another_checker_or_explained() {
    let work = empty_folder("verdicts");
    let mut lines = Vec::new();
    for folder in folders() {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let read = |file: &str| fs::read_to_string(folder.join(file)).expect("a file that exists");
        let description = read("test.desc");
        let ladder =
            folder.join(description.lines().nth(1).expect("the name of the ladder").trim());
        let theirs = if description.contains("FAILED") { "fails" } else { "holds" };
        fs::write(work.join("their.properties"), properties(&read("props.yaml"))).expect("written");
        let ladder = ladder.display().to_string();
        let answer = understudy_in(
            &work,
            &["verify", &ladder, "--properties", "their.properties", "--json"],
        );
        if answer.status == 2 {
            let codes = answer.json()["diagnostics"].as_array().map_or(0, Vec::len);
            assert!(codes > 0, "{name}: {}", answer.shown());
            lines.push(format!("{name}: not taken"));
            continue;
        }
        let document = answer.json();
        let proofs =
            document["result"]["programs"][0]["properties"].as_array().expect("a list").clone();
        assert!(!proofs.is_empty(), "{name}");
        let all = |verdict: &str| proofs.iter().all(|proof| proof["verdict"] == verdict);
        let any = |verdict: &str| proofs.iter().any(|proof| proof["verdict"] == verdict);
        let ours = if any("fails") {
            "fails"
        } else if all("holds") {
            "holds"
        } else {
            "undecided"
        };
        let expected =
            EXPLAINED.iter().find(|(known, _)| *known == name).map_or(theirs, |(_, ours)| ours);
        assert_eq!(ours, expected, "{name}: {}", answer.shown());
        lines.push(format!("{name}: {ours}, {} properties", proofs.len()));
    }
    if !lines.is_empty() {
        insta::assert_snapshot!(lines.join("\n"));
    }
}
