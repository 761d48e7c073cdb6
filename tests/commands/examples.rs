//! The examples, as their READMEs run them.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::{Answer, empty_folder, understudy};

/// Sorted, so that a failure names the same file first wherever it is run.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("there").path()).collect();
    paths.sort();
    paths
}

fn folders() -> Vec<PathBuf> {
    let mut folders = entries(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"));
    folders.retain(|path| path.is_dir());
    folders
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// The scenarios of a cluster's folder.
fn scenarios(folder: &Path) -> Vec<PathBuf> {
    let is_scenario = |path: &PathBuf| {
        path.extension().is_some_and(|extension| extension == "toml")
            && fs::read_to_string(path).is_ok_and(|text| text.contains("\ncycles = "))
    };
    entries(folder).into_iter().filter(is_scenario).collect()
}

fn succeeds(arguments: &[&str]) -> Answer {
    let answer = understudy(arguments);
    assert_eq!(answer.status, 0, "{arguments:?}\n{}{}", answer.output, answer.errors);
    answer
}

/// Models, maps, nets, automata, ladders of every form, clusters, scenarios and projects of reconfiguration.
#[test]
fn every_file_is_right() {
    let is_read = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default();
        ["ladder", "toml", "ADS", "xml", "st", "ld"].iter().any(|read| extension == *read)
    };
    for folder in folders() {
        let mut files = entries(&folder);
        files.retain(is_read);
        let files = files.iter().map(|path| text(path));
        succeeds(&[&["check"], &files.collect::<Vec<_>>()[..]].concat());
    }
}

#[test]
fn every_scenario_comes_out_as_it_expects() {
    let mut run = 0;
    for folder in folders() {
        let cluster = folder.join("cluster.toml");
        if !cluster.exists() {
            continue;
        }
        for scenario in scenarios(&folder) {
            let (cluster, scenario) = (text(&cluster), text(&scenario));
            succeeds(&["simulate", cluster, "--scenario", scenario, "--seed", "1"]);
            run += 1;
        }
    }
    assert!(run >= 3, "{run} scenarios");
}

/// The signals of a ladder that are declared with this word, in order.
fn declared(ladder: &str, word: &str) -> Vec<String> {
    let lines = ladder.lines();
    let names = lines.filter_map(|line| line.strip_prefix(word)?.split_whitespace().next());
    names.map(str::to_owned).collect()
}

/// Signals that differ between two images of at most 64 bits: `+` for those that have become 1.
fn changes(names: &[String], before: u64, now: u64) -> Vec<String> {
    let changed = names.iter().enumerate().map(|(bit, name)| {
        let sign = if now >> bit & 1 == 1 { '+' } else { '-' };
        ((before ^ now) >> bit & 1 == 1).then(|| format!("{sign}{name}"))
    });
    changed.flatten().collect()
}

/// What the second boiler's controller does and sees while it is killed, and everybody else: its laps of four kinds, in order.
#[test]
fn the_complete_controller_lights_burns_and_shuts_down() {
    let out = empty_folder("examples_boiler_run");
    let folder = "examples/boiler";
    let (cluster, scenario) =
        (format!("{folder}/cluster.toml"), format!("{folder}/kill-each.toml"));
    let run = ["simulate", &cluster, "--scenario", &scenario, "--seed", "1"];
    succeeds(&[&run[..], &["--out", text(&out)]].concat());
    let ladder = format!("{}/{folder}/complete.ladder", env!("CARGO_MANIFEST_DIR"));
    let ladder = fs::read_to_string(ladder).expect("a ladder");
    let (inputs, outputs) = (declared(&ladder, "input "), declared(&ladder, "output "));
    let journal = fs::read_to_string(out.join("latest/journal.jsonl")).expect("a journal");
    let mut before = (0, 0);
    let mut story = Vec::new();
    for line in journal.lines() {
        let record: Value = serde_json::from_str(line).expect("JSON");
        let event = &record["event"];
        if record["name"] != "second-boiler" || event["event"] != "stepped" {
            continue;
        }
        let word = |image: &Value| image["words"][0].as_u64().expect("a word");
        let now = (word(&event["outputs"]), word(&event["field"]["sensors"]));
        let mut signals = changes(&outputs, before.0, now.0);
        signals.extend(changes(&inputs, before.1, now.1));
        if !signals.is_empty() {
            story.push(signals.join(" "));
        }
        before = now;
    }
    insta::assert_snapshot!(story.join("\n"));
}

#[test]
fn every_example_is_explained_and_in_the_gallery() {
    let gallery = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/examples.md");
    let gallery = fs::read_to_string(gallery).expect("a page");
    for folder in folders() {
        let name = name(&folder);
        assert!(folder.join("README.md").exists(), "{name} has no README.md");
        for part in [
            format!("| [{name}](#{name}) |"),
            format!("](../../examples/{name})"),
            format!("](../pictures/examples/{name}.svg)"),
        ] {
            assert!(gallery.contains(&part), "docs/reference/examples.md lacks {part}");
        }
    }
}

/// The states and transitions of an answer, as the reference files have them.
fn counts(answer: &Answer) -> Value {
    let result = &answer.json()["result"];
    json!([result["states"], result["transitions"]])
}

#[test]
fn models_have_the_counts_of_other_tools() {
    for example in ["small-factory", "transfer-line", "guideway", "agv"] {
        let out = empty_folder(&format!("examples_{example}"));
        let folder = Path::new("examples").join(example);
        let expected = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder.join("expected.json"));
        let expected = fs::read_to_string(expected).expect("a reference");
        let expected: Value = serde_json::from_str(&expected).expect("JSON");
        let model = folder.join("model.toml");
        let model = text(&model);
        let (super_file, reduced_file) = (out.join("SUPER.ADS"), out.join("SIMSUP.ADS"));
        let synth = |more: &[&str]| succeeds(&[&["synth", model, "--json"], more].concat());
        let made = synth(&["-o", text(&super_file)]);
        assert_eq!(counts(&made), expected["super"], "{example}");
        let symbolic = synth(&["--engine", "symbolic"]);
        assert_eq!(counts(&symbolic), expected["super"], "{example}");
        let reduced = synth(&["--reduce", "-o", text(&reduced_file)]);
        let (states, theirs) = (&counts(&reduced)[0], &expected["supreduce_TCT"][0]);
        assert!(states.as_u64() <= theirs.as_u64(), "{example}: {states}");
        // The named model is TCT's.
        let theirs =
            format!("engineering/supervisor/tests/data/{}/_SUPER.ADS", example.replace('-', "_"));
        succeeds(&["des", "isomorph", text(&super_file), &theirs]);
        let avalanche = succeeds(&["des", "avalanche", &theirs, "--json"]).json();
        assert_eq!(avalanche["result"]["events"], expected["avalanche_super"], "{example}");
    }
}

#[test]
fn the_papers_small_automata_have_their_avalanche_events_and_ladders_without() {
    for example in ["TEST", "FIG4", "FIG6"] {
        let out = empty_folder(&format!("examples_{example}"));
        let file = format!("examples/avalanche/{example}.ADS");
        let expected =
            format!("{}/examples/avalanche/{example}.expected.json", env!("CARGO_MANIFEST_DIR"));
        let expected = fs::read_to_string(expected).expect("a reference");
        let expected: Value = serde_json::from_str(&expected).expect("JSON");
        let found = succeeds(&["des", "avalanche", &file, "--json"]).json();
        assert_eq!(found["result"]["events"], expected["avalanche_events"]);
        let size = succeeds(&["des", "sync", &file, "--json"]);
        assert_eq!(counts(&size), expected["size"], "{example}");
        // Figure 4 is two strings that end in states that nobody marked; no controller is to run it.
        if example != "FIG4" {
            let ladder = out.join("proved.ladder");
            succeeds(&["supervisor-to-ladder", &file, "-o", text(&ladder)]);
            succeeds(&["check", text(&ladder)]);
        }
    }
}

/// Figures 11 to 13 of the paper, whose inputs bring all events; what two events in one scan do is said.
#[test]
fn the_papers_figures_have_their_ladders() {
    let ladder = |number: u32, more: &[&str]| {
        let model = format!("examples/avalanche/figure-{number}.toml");
        let map = "examples/avalanche/start.toml";
        understudy(&[&["supervisor-to-ladder", &model, "--io", map, "--json"], more].concat())
    };
    for (number, more, rungs) in [(4, &[][..], 6), (6, &[], 5), (7, &["--one-event", "assume"], 20)]
    {
        let result = &ladder(number, more).json()["result"];
        assert_eq!(result["rungs"], rungs, "figure {number}: {result}");
    }
    let refuted = ladder(7, &[]).json();
    let message = refuted["failures"][0]["message"].as_str().expect("a message");
    assert!(message.contains("--one-event queue"), "{message}");
    let queue = ladder(7, &["--one-event", "queue", "--priority", "f,d"]).json();
    let findings = queue["result"]["findings"].as_array().expect("a list");
    let order = findings.iter().find(|finding| finding["code"] == "U0877").expect("the bound");
    assert_eq!(order["events"], json!([12, 8, 2, 4, 6, 10]), "{order}");
    let wrong = ladder(7, &["--one-event", "assume", "--priority", "f"]);
    assert_eq!(wrong.status, 2, "{}", wrong.output);
    let unknown = ladder(7, &["--one-event", "queue", "--priority", "g"]);
    assert!(unknown.output.contains("U0851"), "{}", unknown.output);
}

/// What there is to know about a ladder is said where it goes to standard output, too.
#[test]
fn warnings_of_a_printed_ladder_are_said() {
    let file = "examples/avalanche/figure-7.toml";
    let answer = understudy(&["supervisor-to-ladder", file, "--one-event", "queue"]);
    assert!(answer.errors.contains("warning[U0877]"), "{}", answer.errors);
    assert!(!answer.output.contains("warning["), "{}", answer.output);
}

/// As in the README; each ladder is proved again on the way.
#[test]
fn the_boilers_ladders_are_made_from_their_models() {
    let out = empty_folder("examples_boiler");
    for name in ["pilot", "main", "complete"] {
        let model = format!("examples/boiler/{name}.toml");
        let map = format!("examples/boiler/{name}-map.toml");
        let (supervisors, ladder) =
            (out.join(format!("{name}-supervisors.toml")), out.join(format!("{name}.ladder")));
        let (supervisors, made) = (text(&supervisors), text(&ladder));
        succeeds(&["synth", &model, "--engine", "specified", "-o", supervisors]);
        let convert = ["supervisor-to-ladder", supervisors, "--io", &map];
        succeeds(&[&convert[..], &["--plant", &model, "-o", made]].concat());
        let ours = format!("{}/examples/boiler/{name}.ladder", env!("CARGO_MANIFEST_DIR"));
        let (made, ours) = (fs::read(made), fs::read(ours));
        assert!(
            made.expect("written") == ours.expect("there"),
            "examples/boiler/{name}.ladder is another one"
        );
    }
}

#[test]
fn specifications_that_are_no_supervisors_are_not_taken_for_ones() {
    let out = empty_folder("examples_specified").join("supervisors.toml");
    let model = "examples/transfer-line/model.toml";
    let run = ["synth", model, "--engine", "specified", "-o", text(&out)];
    let answer = understudy(&run);
    assert_eq!(answer.status, 1);
    assert!(answer.errors.contains("U0846"), "{}", answer.errors);
    assert!(!out.exists());
    let reduced = understudy(&[&run[..], &["--reduce"]].concat());
    assert_eq!(reduced.status, 2);
}

/// Tables 3.1 and 3.2, as the library's tests hold them row by row: what the command prints is the same.
#[test]
fn the_motivating_example_has_the_tables_of_the_thesis() {
    for mode in ["automatic", "manual"] {
        let answer = succeeds(&[
            "supervisor-to-ladder",
            "examples/motivating-example/supervisor.ADS",
            "--io",
            "examples/motivating-example/map.toml",
            "--mode",
            mode,
            "--table",
        ]);
        insta::assert_snapshot!(format!("table_{mode}"), answer.output);
    }
}
