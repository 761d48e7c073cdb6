//! The requirements of an example: each property that its page runs is proved, and its alarms occur in the cycles that it names.

use std::collections::{BTreeMap, BTreeSet};
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

/// Each number of a first column, `R1` for `R` and so on.
fn listed<'a>(page: &'a str, letter: &str) -> BTreeSet<&'a str> {
    let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.split(' ').next());
    let is_number =
        |word: &&str| word.strip_prefix(letter).is_some_and(|of| of.parse::<u32>().is_ok());
    rows.filter(is_number).collect()
}

/// Runs every `understudy verify` and `understudy simulate` of a page. What a block `sh` proves holds, and each requirement R has a
/// property; what a block `console` asks fails, and there is one for each N, a requirement that a printed program does not keep. It
/// names the requirement R as which another program keeps it.
fn check(folder: &str) {
    let page = page(folder);
    let mut proved: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let (mut count, mut refuted, mut runs, mut fails) = (0, 0, 0, false);
    let mut faulty = BTreeSet::new();
    for line in page.lines() {
        fails = if line.starts_with("```") { line == "```console" } else { fails };
        let Some(command) = line.strip_prefix("understudy ") else { continue };
        let arguments: Vec<String> = words(command);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        match arguments[0] {
            "verify" => {}
            // The emergencies of the boiler have a test of their own.
            "simulate" if folder != "boiler" => {
                let answer = understudy(&arguments);
                assert_eq!(answer.status, 0, "{command}\n{}", answer.shown());
                runs += 1;
                continue;
            }
            _ => continue,
        }
        let answer = understudy(&[&arguments[..], &["--json"]].concat());
        assert_eq!(answer.status, i32::from(fails), "{command}\n{}", answer.shown());
        let document = answer.json();
        let found = document["result"]["programs"][0]["properties"].as_array().expect("properties");
        for property in found {
            let expected = if fails { "fails" } else { "holds" };
            assert_eq!(property["verdict"], expected, "{property:#}");
        }
        let ladder = arguments[1].to_owned();
        if fails {
            refuted += found.len();
            faulty.insert(ladder);
            continue;
        }
        count += found.len();
        let (_, file) = command.split_once("--properties ").expect("a file of properties");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let lines = fs::read_to_string(path).expect("properties");
        for requirement in lines.lines().filter_map(number) {
            proved.entry(requirement.to_owned()).or_default().insert(ladder.clone());
        }
    }
    let numbers: BTreeSet<&str> = proved.keys().map(String::as_str).collect();
    assert_eq!(listed(&page, "R"), numbers, "{folder}");
    assert_eq!(listed(&page, "N").len(), refuted, "{folder}");
    for row in page.lines().filter(|line| line.starts_with("| N")) {
        let kept = row.trim_end_matches(" |").rsplit("| ").next().unwrap_or_default();
        let by = proved.get(kept).unwrap_or_else(|| panic!("{folder}: no program keeps {row}"));
        assert!(by.iter().any(|ladder| !faulty.contains(ladder)), "{folder}: {row}: {by:?}");
    }
    assert!(page.contains(&format!("{count} properties are proved")), "{folder}: {count}");
    let has_cluster = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(folder)
        .join("cluster.toml")
        .exists();
    assert!(
        !has_cluster || folder == "boiler" || runs > 0,
        "{folder}: no run shows the requirements"
    );
}

/// The words of a command line; what is between quotes is one of them.
fn words(command: &str) -> Vec<String> {
    let parts = command.split('"').enumerate();
    let words = parts.flat_map(|(place, part)| match place % 2 {
        0 => part.split_whitespace().map(str::to_owned).collect(),
        _ => vec![part.to_owned()],
    });
    words.collect()
}

#[test]
fn the_boilers_requirements_are_proved_of_its_ladders() {
    check("boiler");
}

#[test]
fn the_requirements_of_the_papers_other_examples_are_proved_and_shown() {
    for folder in ["vents", "painting-system", "filling-line", "assembly-cell", "press-cell"] {
        check(folder);
    }
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
