//! Project files and records: what is read, and everything that is wrong with them.

use std::fmt::Write as _;
use std::time::Duration;

use understudy_ladder::parse;
use understudy_reconfiguration::record::{Missed, RecordError, learn, missed, read};
use understudy_reconfiguration::{Analysis, Signals, analyse, project};

const LADDER: &str = include_str!("../../../examples/filling-line/filling-line.ladder");
const PLANT: &str = include_str!("../../../examples/filling-line/plant.ladder");
const PROJECT: &str = include_str!("../../../examples/filling-line/reconfiguration.toml");

fn open(name: &str) -> Result<String, String> {
    match name {
        "filling-line.ladder" => Ok(LADDER.to_owned()),
        "plant.ladder" => Ok(PLANT.to_owned()),
        "still.ladder" => {
            Ok("program still\ninput Motor\noutput ps1\nrung\n  Motor ( ps1 )\n".to_owned())
        }
        _ => Err("no such file".to_owned()),
    }
}

fn findings(text: &str) -> String {
    let loaded = project::read("project.toml", text, &mut open);
    let mut said = String::new();
    for report in &loaded.reports {
        for found in &report.diagnostics {
            let at = report.line_and_column(found.span.start);
            let help = found.help.as_deref().map_or(String::new(), |help| format!(" ({help})"));
            let _ = writeln!(said, "{}:{at} {} {}{help}", report.name, found.code, found.message);
        }
    }
    said
}

#[test]
fn the_example_is_right() {
    assert_eq!(findings(PROJECT), "");
    let loaded = project::read("project.toml", PROJECT, &mut open);
    let project = loaded.project.expect("it is right");
    assert_eq!(project.channels, [0, 1, 2, 3, 4]);
    assert_eq!(project.period, Duration::from_millis(100));
    assert_eq!(project.analysis, Analysis::Late);
    assert_eq!(project.relation.len(), 4);
}

#[test]
fn everything_that_is_wrong_is_found_at_once() {
    insta::assert_snapshot!(findings(
        r#"
[project]
ladder = "filling-line.ladder"
plant = "absent.ladder"
period = "soon"
channels = ["Redy", "ps1"]
simultaneous = 0
detection = "later"
colour = "red"

[[relation]]
events = ["ps1", "ps9+", "ps1+"]
rows = ["Motr", "", "Motor /Motor"]
states = ["0101", "00000_00x0"]

[[relation]]
events = 1
"#
    ));
    assert!(findings("[project]\nladder = 5\n[[relation]\n").contains("U1201"));
    assert!(findings("relation = []").contains("U1203"));
    let without_a_ladder = "[project]\nladder = 5\n[diagnosis]\nquiet = 5\n";
    assert!(findings(without_a_ladder).contains("`quiet` is the number 5"));
}

#[test]
fn a_plant_that_stands_still_is_said_with_the_way_there() {
    let text = PROJECT.replace("\"plant.ladder\"", "\"still.ladder\"");
    let project = project::read("p", &text, &mut open).project.expect("it is right");
    let failure = analyse(&project).err().expect("a standstill");
    assert_eq!(failure.code(), "U1221");
    assert!(failure.to_string().contains("00000_0000"), "{failure}");
}

#[test]
fn states_without_a_safe_command_are_shown_with_their_rows() {
    // ps1 may come in state 3 while the belt runs, and in state 1 while it stands.
    let text = format!(
        "{PROJECT}\n[[relation]]\nevents = [\"ps1+\"]\nrows = [\"Motor\"]\n\n[[relation]]\nevents = [\"ps2+\"]\nrows = [\"/Motor\"]\n"
    );
    let project = project::read("p", &text, &mut open).project.expect("it is right");
    let failure = analyse(&project).err().expect("no command");
    assert_eq!(failure.code(), "U1231");
    let text = failure.to_string();
    assert!(text.contains("ps1+") && text.contains("[0 dc dc dc]"), "{text}");
}

fn signals() -> Signals {
    let names = |text: &str| text.split(' ').map(str::to_owned).collect();
    Signals { inputs: names("a"), outputs: names("y") }
}

/// y follows a, until a has come twice.
const COUNTER: &str =
    "program p\ninput a\noutput y\nrung\n  a {CTU twice 2} \nrung\n  a /twice.Q ( y )\n";

fn learnt(text: &str) -> Result<(Vec<String>, usize), RecordError> {
    let ladder = parse(COUNTER).program;
    let runs = read("r.csv", text, &signals())?;
    let controller = learn(&runs, &ladder, Duration::from_millis(10), &signals())?;
    let names = (0..controller.states().len()).map(|state| controller.state_name(state));
    Ok((names.collect(), controller.move_count()))
}

#[test]
fn what_is_hidden_is_found_by_what_came_before() {
    let (states, moves) = learnt("a,y\n0,0\n1,1\n1,1\n0,0\n1,0\n0,0\n1,0\n").expect("a record");
    // 0_0 leads to 1_1 at first and to 1_0 later.
    assert_eq!(states, ["0_0", "1_1", "0_0'1", "1_0", "0_0'2"]);
    assert_eq!(moves, 5);
}

#[test]
fn records_that_cannot_be_are_refused_with_the_scan() {
    let code = |text: &str| learnt(text).expect_err("wrong").code();
    assert_eq!(code("a,y\n0,0\n1,0\n"), "U1213");
    assert_eq!(code("run,a,y\n1,0,0\n1,1,1\n2,0,0\n2,1,0\n"), "U1212");
    assert_eq!(code("a,y\n0,2\n"), "U1211");
    assert_eq!(code("a\n0\n"), "U1211");
    assert_eq!(code("a,y\n"), "U1214");
    let error = learnt("run,a,y\n1,0,0\n1,1,1\n\n2,0,0\n2,1,0\n").expect_err("a contradiction");
    insta::assert_snapshot!(error.to_string(), @"U1212: the record contradicts itself: run 1 has the outputs 1 in scan 2 and run 2 has 0, on the same inputs so far; no hidden state explains that");
}

#[test]
fn a_complete_record_agrees_with_the_exploration_and_a_short_one_says_what_it_missed() {
    let ladder = parse(LADDER).program;
    let plant = parse(PLANT).program;
    let period = Duration::from_millis(100);
    // The plant and the ladder, scan by scan, as an engineer would record them.
    let mut own = understudy_ladder::Interpreter::new(&ladder, period).expect("it runs");
    let mut world = understudy_ladder::Interpreter::new(&plant, period).expect("it runs");
    let inputs: Vec<&str> = ladder.inputs.iter().map(|signal| signal.name.as_str()).collect();
    let outputs: Vec<&str> = ladder.outputs.iter().map(|signal| signal.name.as_str()).collect();
    let mut shown = vec![false; inputs.len()];
    let mut table = format!("{},{}\n", inputs.join(","), outputs.join(","));
    let mut short = String::new();
    for scan in 0..300 {
        let driven = own.scan(&shown);
        let row: Vec<&str> =
            shown.iter().chain(&driven).map(|&bit| if bit { "1" } else { "0" }).collect();
        let _ = writeln!(table, "{}", row.join(","));
        if scan == 60 {
            short = table.clone();
        }
        world.scan(&driven);
        shown = inputs.iter().map(|name| world.value(name).unwrap_or(false)).collect();
    }
    let check = |records: &str| {
        let text = PROJECT
            .replace("period", "records = [\"r.csv\"]\nperiod")
            .replace("simultaneous = 2", "simultaneous = 1");
        let project = project::read("p", &text, &mut |name| match name {
            "r.csv" => Ok(records.to_owned()),
            name => open(name),
        });
        let outcome = analyse(&project.project.expect("it is right"));
        outcome.unwrap_or_else(|failure| panic!("{failure}")).missed.expect("there are records")
    };
    assert_eq!(check(&table), Missed::default());
    let Missed { states, moves } = check(&short);
    assert!(!states.is_empty() && moves.len() > states.len(), "{states:?} {moves:?}");
    // A record does not say how long a state may last, which a diagnosis has to know.
    let (rest, _) = PROJECT.split_once("[diagnosis]").expect("the example asks for one");
    let without = PROJECT.replace("plant = \"plant.ladder\"", "records = [\"r.csv\"]");
    let refused = project::read("p", &without, &mut |name| match name {
        "r.csv" => Ok(table.clone()),
        name => open(name),
    });
    let codes = refused.reports[0].diagnostics.iter().map(|found| found.code);
    assert_eq!(codes.collect::<Vec<_>>(), ["U1203"]);
    // Without a plant the record is all there is, and it comes to the same.
    let text = rest
        .replace("plant = \"plant.ladder\"", "records = [\"r.csv\"]")
        .replace("simultaneous = 2", "simultaneous = 1");
    let project = project::read("p", &text, &mut |name| match name {
        "r.csv" => Ok(table.clone()),
        name => open(name),
    });
    let outcome =
        analyse(&project.project.expect("right")).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(outcome.controller.states().len(), 12);
    let itself = missed(&outcome.controller, &outcome.controller);
    assert_eq!(itself, Missed::default());
}
