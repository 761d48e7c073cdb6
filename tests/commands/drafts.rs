//! `understudy init --from` takes every program that `check` calls right and that has outputs, and `check` proposes it for no other.

use std::fs;
use std::path::{Path, PathBuf};

use crate::{empty_folder, understudy_in};

/// Programs of a folder and of the folders in it.
fn programs(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).expect("a folder");
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        if path.is_dir() {
            // Files of a project are no programs alone.
            if !path.ends_with("other-tools/conveyor") {
                programs(&path, found);
            }
        } else if path.extension().is_some_and(|ending| {
            ["st", "xml", "ladder", "ld"].iter().any(|known| ending == *known)
        }) {
            found.push(path);
        }
    }
}

/// Whether `check` finds the program right, and whether `init --from` drafted a cluster of it, which is checked.
fn draft(folder: &Path, file: &str) -> (bool, bool) {
    let checked = understudy_in(folder, &["check", file]);
    let drafted = understudy_in(folder, &["init", "cell", "--from", file]);
    let proposed = format!("understudy init cell --from {file}\n");
    let is_proposed = checked.errors.contains(&proposed);
    assert_eq!(is_proposed, drafted.status == 0, "{}{}", checked.shown(), drafted.shown());
    if drafted.status == 0 {
        let files = ["check", "cell/cluster.toml", "cell/kill.toml"];
        let answer = understudy_in(folder, &files);
        assert_eq!(answer.status, 0, "{file}: {}", answer.shown());
    }
    (checked.status == 0, drafted.status == 0)
}

fn simulate(folder: &Path, file: &str) {
    let run = ["simulate", "cell/cluster.toml", "--scenario", "cell/kill.toml", "--seed", "1"];
    let answer = understudy_in(folder, &run);
    assert_eq!(answer.status, 0, "{file}: {}", answer.shown());
}

#[test]
fn every_program_that_check_calls_right_is_drafted() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    programs(&root.join("examples"), &mut files);
    for crate_folder in fs::read_dir(root.join("programs")).expect("crates") {
        let tests = crate_folder.expect("a crate").path().join("tests");
        if tests.is_dir() {
            programs(&tests, &mut files);
        }
    }
    assert!(files.len() > 50, "{files:?}");
    let mut drafted = 0;
    for (place, path) in files.iter().enumerate() {
        let folder = empty_folder(&format!("draft_{place}"));
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
        fs::copy(path, folder.join(name)).expect("copied");
        let (is_right, is_drafted) = draft(&folder, name);
        assert_eq!(is_right, is_drafted, "{}", path.display());
        drafted += usize::from(is_drafted);
        // Those with numbers, of each of their languages.
        if ["level.st", "reactor.st", "pump.xml"].contains(&name) {
            simulate(&folder, name);
        }
    }
    assert!(drafted > 50, "{drafted} of {}", files.len());
}

const TYPES: &str = "\
TYPE
  Color : (red, green, blue);
  Pair : STRUCT low : REAL; high : BOOL; END_STRUCT;
END_TYPE
";

/// An input and an output of each type, and one that becomes the other.
fn of_each_type() -> String {
    let types = [
        "BOOL",
        "BYTE",
        "WORD",
        "DWORD",
        "LWORD",
        "SINT",
        "INT",
        "DINT",
        "LINT",
        "USINT",
        "UINT",
        "UDINT",
        "ULINT",
        "REAL",
        "LREAL",
        "TIME",
        "DATE",
        "TIME_OF_DAY",
        "DATE_AND_TIME",
        "Color",
        "INT (-3..12)",
        "USINT (5..9)",
        "Pair",
    ];
    let declare = |name: &str| {
        let lines = types.iter().enumerate();
        let lines = lines.map(|(place, of)| format!("  {name}{place} : {of};\n"));
        lines.collect::<String>()
    };
    let body = (0..types.len()).map(|place| format!("q{place} := i{place};\n"));
    format!(
        "{TYPES}PROGRAM each\nVAR_INPUT\n{}END_VAR\nVAR_OUTPUT\n{}END_VAR\n{}END_PROGRAM\n",
        declare("i"),
        declare("q"),
        body.collect::<String>()
    )
}

#[test]
fn a_program_of_every_type_is_drafted_and_masked() {
    let folder = empty_folder("draft_types");
    fs::write(folder.join("each.st"), of_each_type()).expect("written");
    assert_eq!(draft(&folder, "each.st"), (true, true));
    simulate(&folder, "each.st");
    let text = fs::read_to_string(folder.join("cell/cluster.toml")).expect("written");
    for line in [
        "q0 = false",
        "q6 = 0",
        "q13 = 0.0",
        "q15 = \"0ms\"",
        "q16 = \"1970-01-01\"",
        "q19 = \"red\"",
        "q21 = 5",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}: {text}");
    }
    let plant = fs::read_to_string(folder.join("cell/each-plant.st")).expect("written");
    for line in ["i20 : INT (-3..12);", "q21 : USINT (5..9);"] {
        assert!(plant.lines().any(|found| found.trim() == line), "{line}: {plant}");
    }
    // A stand-in drives only values that the program has names for.
    assert!(plant.contains("i19 := INT#2; ELSE i19 := INT#0;"), "{plant}");
}

const FILL: &str = "\
PROGRAM fill
  VAR_INPUT low : BOOL; level : REAL; END_VAR
  VAR_OUTPUT valve : BOOL; END_VAR
  valve := low AND level < 5.0;
END_PROGRAM
";

const DRAIN: &str = "\
PROGRAM drain
  VAR_INPUT high : BOOL; END_VAR
  VAR_OUTPUT pump : INT; END_VAR
  IF high THEN pump := 3; ELSE pump := 0; END_IF;
END_PROGRAM
";

/// A configuration that runs these programs, with global variables.
fn configuration(globals: &str, runs: &[&str]) -> String {
    let runs = runs.iter().enumerate();
    let runs = runs.map(|(place, run)| format!("    PROGRAM p{place} WITH t{place} : {run};\n"));
    format!(
        "CONFIGURATION plant\n{globals}  RESOURCE one ON PLC\n    TASK t0(INTERVAL := T#100ms, PRIORITY := 1);\n    TASK t1(INTERVAL := T#20ms, PRIORITY := 0);\n{}  END_RESOURCE\nEND_CONFIGURATION\n",
        runs.collect::<String>()
    )
}

/// Names of the controllers that are drafted of a text.
fn controllers(name: &str, text: &str) -> Vec<String> {
    let folder = empty_folder(&format!("draft_{name}"));
    let file = format!("{name}.st");
    fs::write(folder.join(&file), text).expect("written");
    let answer = understudy_in(&folder, &["init", "cell", "--from", &file]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let answer = understudy_in(&folder, &["check", "cell/cluster.toml", "cell/kill.toml"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    simulate(&folder, name);
    let text = fs::read_to_string(folder.join("cell/cluster.toml")).expect("written");
    assert!(text.contains("period = \"20ms\""), "{text}");
    let sections = text.split("[[controller]]\nname = \"").skip(1);
    sections.map(|rest| rest.split('"').next().unwrap_or_default().to_owned()).collect()
}

#[test]
fn programs_of_a_file_are_apart_where_they_do_the_same_apart() {
    let both = ["fill", "drain"];
    let apart = format!("{FILL}{DRAIN}{}", configuration("", &both));
    assert_eq!(controllers("apart", &apart), both);
    // A variable of both: one controller runs them, as `check` takes the file.
    let global = "VAR_GLOBAL common : INT; END_VAR\n";
    let external = "PROGRAM fill\n  VAR_EXTERNAL common : INT; END_VAR\n";
    let fill =
        FILL.replace("PROGRAM fill\n", external).replace("valve :=", "common := 2; valve :=");
    let drain = DRAIN.replace("PROGRAM drain\n", &external.replace("fill", "drain"));
    let drain = drain.replace("pump := 3", "pump := common");
    let shared = format!("{fill}{drain}{}", configuration(global, &both));
    assert_eq!(controllers("shared", &shared), ["shared"]);
    // One that only one of them has.
    let own = format!("{fill}{DRAIN}{}", configuration(global, &both));
    assert_eq!(controllers("own", &own), both);
    // Within a block that both call.
    let block = "FUNCTION_BLOCK b\n  VAR_EXTERNAL common : INT; END_VAR\n  common := common + 1;\nEND_FUNCTION_BLOCK\n";
    let call = |program: &str| {
        let program = program.replace("  VAR_INPUT", "  VAR call : b; END_VAR\n  VAR_INPUT");
        program.replace("END_PROGRAM", "  call();\nEND_PROGRAM")
    };
    let called = format!("{block}{}{}{}", call(FILL), call(DRAIN), configuration(global, &both));
    assert_eq!(controllers("called", &called), ["called"]);
    // The same program twice.
    let twice = format!("{FILL}{DRAIN}{}", configuration("", &["fill", "fill"]));
    assert_eq!(controllers("twice", &twice), ["twice"]);
    // Connected by the configuration.
    let wired = configuration(global, &["fill", "drain(pump => common)"]);
    assert_eq!(controllers("wired", &format!("{FILL}{DRAIN}{wired}")), ["wired"]);
    // An input of both has a wire to both.
    let input = |program: &str| {
        program.replace("END_PROGRAM", "  IF %IX0.0 THEN RETURN; END_IF;\nEND_PROGRAM")
    };
    let text = format!("{}{}{}", input(FILL), input(DRAIN), configuration("", &both));
    assert_eq!(controllers("input", &text), both);
    let input = "VAR_GLOBAL start AT %IX0.0 : BOOL; END_VAR\n";
    let start = |program: &str| {
        let external = "  VAR_EXTERNAL start : BOOL; END_VAR\n  VAR_INPUT";
        let program = program.replace("  VAR_INPUT", external);
        program.replace("END_PROGRAM", "  IF start THEN RETURN; END_IF;\nEND_PROGRAM")
    };
    let text = format!("{}{}{}", start(FILL), start(DRAIN), configuration(input, &both));
    assert_eq!(controllers("global", &text), both);
    // An output that one writes and the other reads, and a memory, at an address.
    let written = FILL.replace("END_PROGRAM", "  %Q0.3 := low;\nEND_PROGRAM");
    let read = DRAIN.replace("IF high", "IF high AND %QX0.3");
    let text = format!("{written}{read}{}", configuration("", &both));
    assert_eq!(controllers("output", &text), ["output"]);
    let memory = |program: &str| program.replace("END_PROGRAM", "  %MW4 := %MW4 + 1;\nEND_PROGRAM");
    let text = format!("{}{}{}", memory(FILL), memory(DRAIN), configuration("", &both));
    assert_eq!(controllers("memory", &text), ["memory"]);
}

/// A program reads another one, or both call a third, which has one memory: apart, each would have that memory for itself.
#[test]
fn programs_that_name_each_other_stay_together() {
    let both = ["fill", "drain"];
    let runs = configuration("", &both);
    let reads = DRAIN.replace("IF high", "IF high AND fill.valve");
    assert_eq!(controllers("reads", &format!("{FILL}{reads}{runs}")), ["reads"]);
    let block = "FUNCTION_BLOCK b\n  VAR_OUTPUT q : BOOL; END_VAR\n  q := fill.valve;\nEND_FUNCTION_BLOCK\n";
    let within = DRAIN.replace("  VAR_INPUT", "  VAR call : b; END_VAR\n  VAR_INPUT");
    let within = within.replace("  IF high", "  call();\n  IF high AND call.q");
    assert_eq!(controllers("within", &format!("{FILL}{block}{within}{runs}")), ["within"]);
    let third = "PROGRAM third\n  VAR_INPUT step : BOOL; END_VAR\n  VAR sum : INT; END_VAR\n  IF step AND sum < 9 THEN sum := sum + 1; END_IF;\nEND_PROGRAM\n";
    let call = |program: &str, step: &str| {
        program.replace("END_PROGRAM", &format!("  third(step := {step});\nEND_PROGRAM"))
    };
    let (fill, drain) = (call(FILL, "low"), call(DRAIN, "high"));
    assert_eq!(controllers("third", &format!("{fill}{drain}{third}{runs}")), ["third"]);
    // A third that only one of them calls is its own.
    assert_eq!(controllers("caller", &format!("{fill}{DRAIN}{third}{runs}")), both);
    // A variable with an address is the memory there.
    let mark = "VAR_GLOBAL mark AT %QX0.3 : BOOL; END_VAR\n";
    let external = "  VAR_EXTERNAL mark : BOOL; END_VAR\n  VAR_INPUT";
    let writes = FILL.replace("  VAR_INPUT", external);
    let writes = writes.replace("END_PROGRAM", "  mark := low;\nEND_PROGRAM");
    let reads = DRAIN.replace("IF high", "IF high AND %QX0.3");
    let text = format!("{writes}{reads}{}", configuration(mark, &both));
    assert_eq!(controllers("alias", &text), ["alias"]);
}

/// A program that another one calls does not run by itself, without a configuration too.
#[test]
fn a_called_program_is_no_controller() {
    let folder = empty_folder("draft_called_program");
    for (name, class) in [("inner.st", "VAR"), ("outer.st", "VAR_OUTPUT")] {
        let main = "PROGRAM main\n  VAR_INPUT a : BOOL; END_VAR\n  VAR_OUTPUT q : BOOL; END_VAR\n  called(step := a);\n  q := called.full;\nEND_PROGRAM\n";
        let called = format!(
            "PROGRAM called\n  VAR_INPUT step : BOOL; END_VAR\n  {class} full : BOOL; END_VAR\n  full := step OR full;\nEND_PROGRAM\n"
        );
        fs::write(folder.join(name), format!("{main}{called}")).expect("written");
        assert_eq!(draft(&folder, name), (true, true), "{name}");
        let text = fs::read_to_string(folder.join("cell/cluster.toml")).expect("written");
        assert_eq!(text.matches("[[controller]]").count(), 1, "{text}");
        fs::remove_dir_all(folder.join("cell")).expect("removed");
    }
}

#[test]
fn check_proposes_only_what_runs() {
    let folder = empty_folder("draft_refused");
    let check = |name: &str, text: &str, expected: (bool, bool)| {
        fs::write(folder.join(name), text).expect("written");
        assert_eq!(draft(&folder, name), expected, "{name}");
    };
    check("blind.st", &FILL.replace("VAR_OUTPUT", "VAR"), (true, false));
    check(
        "library.st",
        "FUNCTION f : INT\n  VAR_INPUT a : INT; END_VAR\n  f := a;\nEND_FUNCTION\n",
        (true, false),
    );
    check("named.st", &FILL.replace("PROGRAM fill", "PROGRAM _fill"), (true, false));
    check("wrong.st", &FILL.replace("level <", "lever <"), (false, false));
    // A library has nothing to be verified; a chosen program is verified, and not the whole file.
    let checked = understudy_in(&folder, &["check", "library.st"]);
    assert!(!checked.errors.contains("next:"), "{}", checked.shown());
    fs::write(folder.join("both.st"), format!("{FILL}{DRAIN}")).expect("written");
    let checked = understudy_in(&folder, &["check", "both.st", "--program", "drain"]);
    assert!(checked.errors.contains("verify both.st --program drain\n"), "{}", checked.shown());
    assert!(!checked.errors.contains("init"), "{}", checked.shown());
    // What has no outputs names what could be one.
    let said = understudy_in(&folder, &["init", "cell", "--from", "blind.st"]);
    assert!(said.errors.contains("such as `valve`"), "{}", said.shown());
    // Existing files are in the way.
    check("fill.st", FILL, (true, true));
    let checked = understudy_in(&folder, &["check", "fill.st"]);
    assert!(!checked.errors.contains("init"), "{}", checked.shown());
}

/// The copies of a file with several programs are each right, and nothing is said of the other programs.
#[test]
fn copies_of_several_programs_have_no_findings() {
    let folder = empty_folder("draft_several");
    let text = "PROGRAM one VAR_INPUT a : REAL; END_VAR VAR_OUTPUT p : REAL; END_VAR p := a; END_PROGRAM
        PROGRAM two VAR_INPUT n : INT (-100..-50); END_VAR VAR_OUTPUT q : BOOL; END_VAR q := n > -70; END_PROGRAM
        CONFIGURATION c RESOURCE r ON x TASK t(INTERVAL := T#20ms, PRIORITY := 0);
        PROGRAM one WITH t : one; PROGRAM two WITH t : two; END_RESOURCE END_CONFIGURATION";
    fs::write(folder.join("both.st"), text).expect("written");
    let answer = understudy_in(&folder, &["init", "cell", "--from", "both.st"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    for name in ["one", "two"] {
        let answer = understudy_in(&folder, &["check", &format!("cell/{name}.st")]);
        assert!(answer.status == 0 && !answer.errors.contains("warning"), "{}", answer.shown());
    }
    // Each input of the stand-in has two values.
    let plant = fs::read_to_string(folder.join("cell/two-plant.st")).expect("a plant");
    assert!(plant.contains("n := INT#-100") && plant.contains("n := INT#-50"), "{plant}");
}
