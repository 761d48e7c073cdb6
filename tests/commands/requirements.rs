//! The requirements of an example: each property that its page runs is proved, and its alarms occur in the cycles that it names.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::{empty_folder, understudy};

fn page(folder: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(folder);
    fs::read_to_string(path.join("requirements.md")).expect("a page of requirements")
}

/// The numbers `R1`, `R2` of the requirements at the beginning of a text.
fn number(text: &str) -> Option<&str> {
    let word = text.split([' ', '|']).next()?;
    let digits = word.strip_prefix('R')?;
    (!digits.is_empty() && digits.chars().all(|digit| digit.is_ascii_digit())).then_some(word)
}

/// Runs every `understudy verify` of the page: all properties hold, and each requirement has one.
#[test]
fn the_boilers_requirements_are_proved_of_its_ladders() {
    let page = page("boiler");
    let rows = page.lines().filter_map(|line| number(line.strip_prefix("| ")?));
    let listed: BTreeSet<&str> = rows.collect();
    let mut proved = BTreeSet::new();
    let mut count = 0;
    for command in page.lines().filter_map(|line| line.strip_prefix("understudy verify ")) {
        let arguments: Vec<&str> = command.split(' ').collect();
        let answer = understudy(&[&["verify"], &arguments[..], &["--json"]].concat());
        assert_eq!(answer.status, 0, "{command}\n{}", answer.shown());
        let document = answer.json();
        let found = document["result"]["programs"][0]["properties"].as_array().expect("properties");
        for property in found {
            assert_eq!(property["verdict"], "holds", "{property:#}");
        }
        count += found.len();
        let (_, file) = command.split_once("--properties ").expect("a file of properties");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let lines = fs::read_to_string(path).expect("properties");
        proved.extend(lines.lines().filter_map(number).map(str::to_owned));
    }
    let proved: BTreeSet<&str> = proved.iter().map(String::as_str).collect();
    assert_eq!(listed, proved);
    assert!(page.contains(&format!("{count} properties are proved")), "{count}");
}

/// The cycles in which an alarm of the remote I/O's program becomes 1 in the newest run of `out`.
fn alarms(out: &Path, controller: &str) -> Vec<String> {
    let path = format!("examples/boiler/{controller}.ladder");
    let ladder =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a ladder");
    let outputs = ladder.lines().filter_map(|line| line.strip_prefix("output "));
    let is_alarm: Vec<bool> = outputs.map(|line| line.contains("alarm")).collect();
    let run = out.join("latest").display().to_string();
    let member = format!("{controller}-io");
    let asked = ["journal", &run, "--all", "--json", "--event", "applied", "--member", &member];
    let answer = understudy(&asked);
    let document = answer.json();
    let mut before = false;
    let mut cycles = Vec::new();
    for line in document["result"]["lines"].as_array().expect("lines") {
        let text = line["text"].as_str().expect("a text");
        let bits = text.split([' ', ',']).nth(1).expect("the outputs");
        assert_eq!(bits.len(), is_alarm.len(), "{text}");
        let now = bits.chars().zip(&is_alarm).any(|(bit, alarm)| bit == '1' && *alarm);
        if now && !before {
            cycles.push(line["cycle"].to_string());
        }
        before = now;
    }
    cycles
}

#[test]
fn each_emergency_of_the_boilers_raises_its_alarm_while_its_controller_is_killed() {
    let out = empty_folder("requirements_emergencies");
    let folder = out.display().to_string();
    let (cluster, scenario) = ("examples/boiler/cluster.toml", "examples/boiler/emergencies.toml");
    let run = ["simulate", cluster, "--scenario", scenario, "--seed", "1", "--out", &folder];
    let answer = understudy(&run);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let page = page("boiler");
    for controller in ["pilot", "main", "complete"] {
        let named = page.lines().filter_map(|line| line.rsplit('|').nth(1));
        let shown = named.flat_map(|cell| cell.split(';')).filter_map(|part| {
            let cycles = part.trim().strip_prefix(controller)?.strip_prefix(' ')?;
            let cycles = cycles.split(", ").map(str::to_owned);
            Some(cycles.filter(|cycle| cycle.chars().all(|digit| digit.is_ascii_digit())))
        });
        let shown: BTreeSet<String> = shown.flatten().collect();
        let raised: BTreeSet<String> = alarms(&out, controller).into_iter().collect();
        assert_eq!(shown, raised, "{controller}");
    }
}
