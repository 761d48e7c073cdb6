//! Automata and synthesis as a person meets them.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

use insta::assert_snapshot;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};

use crate::{Answer, empty_folder, understudy};

const FACTORY: &str = "engineering/supervisor/tests/data/small_factory";
const MODEL: &str = "examples/small-factory/model.toml";

fn des(arguments: &[&str]) -> Answer {
    let all: Vec<&str> = ["des", "--json"].iter().chain(arguments).copied().collect();
    understudy(&all)
}

fn counts(answer: &Answer) -> (u64, u64) {
    let result = &answer.json()["result"];
    let number = |value: &Value| value.as_u64().expect("a number");
    (number(&result["states"]), number(&result["transitions"]))
}

#[test]
fn from_machines_to_a_reduced_supervisor_as_in_tct() {
    let folder = empty_folder("des");
    let file = |name: &str| folder.join(name).display().to_string();
    let given = |name: &str| format!("{FACTORY}/{name}.ADS");
    let (plant, specification) = (file("PLANT.ADS"), file("SPEC.ADS"));
    let (supervisor, reduced) = (file("SUPER.ADS"), file("SIMSUP.toml"));
    let made = des(&["sync", &given("MACH1"), &given("MACH2"), "-o", &plant]);
    assert_eq!(counts(&made), (9, 24));
    des(&["sync", &given("BUFSPEC"), &given("BRSPEC"), "-o", &specification]);
    let made = des(&["supcon", &plant, &specification, "--lift", "-o", &supervisor]);
    assert_eq!(counts(&made), (12, 24));
    assert_eq!(made.json()["result"]["marked"], json!([0]));
    let same = des(&["isomorph", &supervisor, &given("_SUPER")]);
    assert_eq!((same.status, &same.json()["result"]["isomorphic"]), (0, &json!(true)));
    let other = des(&["isomorph", &supervisor, &plant]);
    assert_eq!(other.status, 1);
    let made = des(&["supreduce", &plant, &supervisor, "-o", &reduced]);
    assert_eq!(counts(&made), (3, 14));
    assert_eq!(made.json()["result"]["lower_bound"], 3);
    let data = des(&["condat", &plant, &given("_SUPER")]).json();
    assert_eq!(
        (&data["result"]["states_with_disablement"], &data["result"]["pairs"]),
        (&json!(7), &json!(7))
    );
    assert_eq!(data["result"]["table"]["10"], json!([13]));
    // A model is an input like TCT's files.
    assert_eq!(counts(&des(&["minstate", &reduced])), (3, 14));
    let drawn = des(&["convert", &supervisor, "-o", &file("SUPER.svg")]);
    assert_eq!(drawn.status, 0);
}

#[test]
fn a_model_goes_to_supremica_and_back_with_the_same_supervisor() {
    let folder = empty_folder("supremica");
    let file = |name: &str| folder.join(name).display().to_string();
    let (module, supervised) = (file("factory.wmod"), file("supervised.wmod"));
    let made = des(&["convert", MODEL, "-o", &module]);
    assert_eq!(made.status, 0, "{}", made.errors);
    let synthesised = understudy(&["synth", &module, "--json", "-o", &supervised]);
    assert_eq!(counts(&synthesised), (12, 24));
    let checked = des(&["check", &supervised]).json();
    assert_eq!(checked["result"]["automata"].as_array().map(Vec::len), Some(5));
    let ladder = understudy(&["supervisor-to-ladder", &supervised, "--plant", &module]);
    assert_eq!(ladder.status, 0, "{}", ladder.errors);
    let several = des(&["trim", &module]);
    assert_eq!(several.json()["failures"][0]["code"], "U0652", "{}", several.output);
}

#[test]
fn generators_of_libfaudes_meet_by_the_names_of_their_events() {
    let folder = empty_folder("libfaudes");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    // Each file alone would give its events the labels 1 and 0.
    let machine = |number: u32| {
        format!(
            "<Generator> m{number} <Alphabet> start{number} +C+ done{number} </Alphabet> <States> 1 2 </States> <TransRel> 1 start{number} 2 2 done{number} 1 </TransRel> <InitStates> 1 </InitStates> <MarkedStates> 1 </MarkedStates> </Generator>"
        )
    };
    let buffer = "<Generator> buffer <Alphabet> start2 +C+ done1 </Alphabet> <States> 1 2 </States> <TransRel> 1 done1 2 2 start2 1 </TransRel> <InitStates> 1 </InitStates> <MarkedStates> 1 </MarkedStates> </Generator>";
    let (one, two) = (file("one.gen", &machine(1)), file("two.gen", &machine(2)));
    let buffer = file("buffer.gen", buffer);
    let plant = folder.join("plant.gen").display().to_string();
    assert_eq!(counts(&des(&["sync", &one, &two, "-o", &plant])), (4, 8));
    assert_eq!(counts(&des(&["supcon", &plant, &buffer, "--lift"])), (6, 8));
    let projected = des(&["project", &plant, "--hide", "done1"]).json();
    assert_eq!(projected["result"]["is_observer"]["holds"], json!(true));
    assert_eq!(projected["result"]["is_locally_control_consistent"]["holds"], json!(true));
    let unknown = des(&["observer", &plant, "--hide", "done3"]).json();
    assert_eq!(unknown["failures"][0]["code"], "U0809");
    let two = file("two.gen", &machine(2).replace(" +C+", "").replace("start2", "start1"));
    assert_eq!(des(&["sync", &one, &two]).json()["failures"][0]["code"], "U0839");
}

#[test]
fn the_events_of_the_avalanche_effect() {
    let answer = des(&["avalanche", "examples/avalanche/TEST.ADS"]).json();
    assert_eq!(answer["result"]["events"], json!([1, 2, 3]));
    assert_eq!(answer["result"]["all_events"], json!([1, 2, 3, 4, 5, 6]));
}

#[test]
fn what_is_forgotten_or_wrong_is_said() {
    let specification = format!("{FACTORY}/BUFSPEC.ADS");
    let machine = format!("{FACTORY}/MACH1.ADS");
    let not_lifted = understudy(&["des", "supcon", &machine, &specification]);
    assert_snapshot!(not_lifted.shown());
    let wrong = understudy(&["des", "check", "Cargo.toml", "absent.ADS", "README.md"]);
    assert_eq!(wrong.status, 2);
    for code in ["U0821", "U0601"] {
        assert!(wrong.errors.contains(code), "{code}: {}", wrong.errors);
    }
}

#[test]
fn every_engine_synthesises_the_small_factory() {
    assert_snapshot!(understudy(&["synth", MODEL]).shown());
    assert_snapshot!(understudy(&["synth", MODEL, "--engine", "modular", "--reduce"]).shown());
    let symbolic = understudy(&["synth", MODEL, "--engine", "symbolic", "--json"]);
    assert_eq!(counts(&symbolic), (12, 24));
    let reduced = understudy(&["synth", MODEL, "--reduce", "--json"]);
    assert_eq!(counts(&reduced), (3, 14));
    let bounded = understudy(&["synth", MODEL, "--memory", "0"]);
    assert_eq!(bounded.status, 1);
    assert!(bounded.errors.contains("--engine symbolic"), "{}", bounded.errors);
}

/// A machine that may fail, and what forbids that.
const NEVER_FAILS: &str = "\
[events]
start  = { controllable = true }
finish = { controllable = false }
fail   = { controllable = false }

[[plant]]
name = \"machine\"
marked = \"all\"
transitions = [\"idle start working\", \"working finish idle\", \"working fail idle\"]
";
const FORBIDDING: &str = "\
[[supervisor]]
name = \"never_fail\"
marked = \"all\"
events = [\"fail\"]
transitions = [\"a start b\", \"b finish a\"]
";

#[test]
fn a_supervisor_that_forbids_what_it_cannot_is_not_reduced() {
    let folder = empty_folder("uncontrollable");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let plant = file("plant.toml", NEVER_FAILS);
    let events = NEVER_FAILS.split("[[").next().expect("events");
    let supervisor = file("supervisor.toml", &format!("{events}{FORBIDDING}"));
    let reduced = folder.join("reduced.toml");
    let out = reduced.to_str().expect("text");
    for operation in ["condat", "supreduce"] {
        let answer = understudy(&["des", operation, &plant, &supervisor, "-o", out]);
        assert_eq!(answer.status, 1, "{operation}: {}", answer.output);
        assert!(
            answer.errors.contains(
                "error[U0846]: in state b the supervisor disables the uncontrollable event fail"
            ),
            "{operation}: {}",
            answer.errors
        );
        assert!(!reduced.exists(), "{operation} writes nothing");
    }
}

#[test]
fn a_ladder_with_errors_is_not_written() {
    let folder = empty_folder("withheld");
    let model = folder.join("model.toml");
    let text = "[events]\nstart = { controllable = true }\nfull = { controllable = false }\n\n\
                [[supervisor]]\nname = \"pump\"\nmarked = [\"off\"]\n\
                transitions = [\"off start on\", \"on full stuck\"]\n";
    std::fs::write(&model, text).expect("written");
    let (model, out) = (model.to_str().expect("text"), folder.join("made.ladder"));
    let to_file = ["supervisor-to-ladder", model, "-o", out.to_str().expect("text")];
    for arguments in [&to_file[..], &to_file[..2]] {
        let answer = understudy(arguments);
        assert_eq!(answer.status, 1, "{}", answer.output);
        assert!(answer.errors.contains("error[U0882]"), "{}", answer.errors);
        assert!(!answer.output.contains("rung"), "{}", answer.output);
        assert!(!out.exists());
    }
}

/// Behind the place where the specification forbids a failure there are two more states of the product.
#[test]
fn explored_states_are_not_called_the_product() {
    let folder = empty_folder("explored");
    let model = folder.join("model.toml");
    let text = "[events]\nstart = { controllable = true }\nfail = { controllable = false }\n\
                stop = { controllable = true }\n\n[[plant]]\nname = \"machine\"\nmarked = \"all\"\n\
                transitions = [\"idle start working\", \"working fail broken\", \"working stop ended\"]\n\n\
                [[specification]]\nname = \"never_fail\"\nmarked = \"all\"\nevents = [\"fail\"]\ntransitions = []\n";
    std::fs::write(&model, text).expect("written");
    let model = model.to_str().expect("text");
    let found = understudy(&["synth", model, "--json"]).json();
    assert_eq!(found["result"]["explored_states"], json!(2), "{found}");
    let specified = understudy(&["synth", model, "--engine", "specified"]);
    let said = "of 2 explored states of their product with the plants, a supervisor keeps to 1";
    assert!(specified.errors.contains(said), "{}", specified.errors);
}

/// A plant of 20,000 states, ten random transitions from each, and a supervisor that forbids a few of them. Its reduction takes long.
fn event_rich(folder: &Path) -> [String; 2] {
    const STATES: u64 = 20_000;
    let mut state = 88_172_645_463_325_252_u64;
    let mut random = |below: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % below
    };
    let mut transitions = BTreeMap::new();
    for source in 0..STATES {
        transitions.insert((source, random(60)), (source + 1) % STATES);
        for _ in 0..10 {
            let (event, target) = (random(60), random(STATES));
            transitions.entry((source, event)).or_insert(target);
        }
    }
    let mut write = |name: &str| {
        let head = format!("{name}\nState size:\n{STATES}\nMarker states:\n*\nTransitions:\n");
        let lines = transitions.iter();
        let lines = lines.map(|(&(source, event), target)| format!("{source} {event} {target}\n"));
        let path = folder.join(format!("{name}.ADS"));
        std::fs::write(&path, head + &lines.collect::<String>()).expect("written");
        transitions.retain(|&(_, event), _| event % 2 == 0 || random(20_000) > 0);
        path.display().to_string()
    };
    [write("PLANT"), write("SUPER")]
}

#[test]
fn a_reduction_that_ends_early_keeps_its_result() {
    let folder = empty_folder("early");
    let [plant, supervisor] = event_rich(&folder);
    let out = folder.join("SIMSUP.ADS").display().to_string();
    let files = ["supreduce", &plant, &supervisor, "-o", &out];
    let limited = des(&[&files[..], &["--budget", "1ms"]].concat());
    assert_eq!(limited.status, 0, "{}", limited.errors);
    assert_eq!(limited.json()["result"]["is_complete"], json!(false));
    let states = counts(&limited).0;
    assert!(states < 20_000, "{states}");

    std::fs::remove_file(&out).expect("it was written");
    let mut process = Command::new(env!("CARGO_BIN_EXE_understudy"))
        .arg("des")
        .args(files)
        .args(["--budget", "1h"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary is built");
    let mut errors = BufReader::new(process.stderr.take().expect("a pipe"));
    let mut line = String::new();
    errors.read_line(&mut line).expect("text");
    assert!(line.contains("order 1 of 2: ") && line.contains(" of 20000 states tried, "), "{line}");
    let id = i32::try_from(process.id()).expect("a process id");
    kill(Pid::from_raw(id), Signal::SIGINT).expect("it runs");
    let mut output = String::new();
    let mut stdout = process.stdout.take().expect("a pipe");
    stdout.read_to_string(&mut output).expect("text");
    let status = process.wait().expect("it ends");
    assert!(status.success(), "{status}: {output}");
    assert!(output.contains("warning[U0847]: the reduction was interrupted after "), "{output}");
    let kept = counts(&des(&["convert", &out]));
    assert!(kept.0 <= states, "{kept:?} after {states}");
}

/// A ladder that is withheld for a finding leaves nothing on standard output but the other findings, each once.
#[test]
fn a_finding_is_printed_once() {
    let supervisor = "examples/avalanche/FIG4.ADS";
    for more in [&[][..], &["-o", "absent.ladder"]] {
        let answer = understudy(&[&["supervisor-to-ladder", supervisor], more].concat());
        assert_eq!(answer.status, 1, "{}", answer.shown());
        let all = [answer.output.as_str(), answer.errors.as_str()].concat();
        for code in ["U0882", "U0885", "U0876", "U0886"] {
            assert_eq!(all.matches(&format!("[{code}]")).count(), 1, "{code}: {all}");
        }
    }
}
