//! What is wrong with a map of signals, all of it in one run, and what its signals cannot show.

use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{Interpreter, Name};
use understudy_supervisor::ladder::{
    Agent, InputEvent, InputOutputMap, Mode, Modules, Partition, Position, Switch, When, convert,
    read_map,
};
use understudy_supervisor::proof::{Finding, FindingKind, findings};
use understudy_supervisor::{Automaton, Event, Label, State, Transition, read_ads, read_model};
use understudy_text::{Diagnostic, Report};

fn shown(text: &str, diagnostics: Vec<Diagnostic>) -> String {
    let report = Report { name: String::new(), text: text.to_owned(), diagnostics };
    let lines = report.diagnostics.iter().map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found.help.as_deref().map_or(String::new(), |help| format!(" ({help})"));
        format!("{place} {} {}{help}", found.code, found.message)
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn supervisor() -> Automaton {
    let text = include_str!("../../../examples/motivating-example/supervisor.ADS");
    read_ads(text).automaton.expect("an automaton")
}

#[test]
fn everything_wrong_with_the_form_is_found() {
    let text = r#"
program = 5
strat = "x0"
[events]
a = "zero"
[[input]]
event = "a"
when = "pulse "
[[switch]]
off = "c_cl"
memory = "yes"
[[timer]]
event = "b"
name = "t"
runs_while = "x"
preset = "5 sec"
[[pulse]]
event = ["c"]
signal = "y"
[addresses]
x_a = "IX0.0"
"#;
    let read = read_map(text);
    assert_eq!(read.map, None);
    insta::assert_snapshot!(shown(text, read.diagnostics), @r#"
    2:11 U0864 `program` is the number 5
    3:1 U0862 a map has no key `strat` (did you mean `start`?)
    5:5 U0864 `a` is the text "zero"
    6:1 U0863 an input needs `signal`
    8:8 U0865 `when` cannot be "pulse " (did you mean `pulse`?)
    9:1 U0863 a switch needs `positions`
    11:10 U0864 `memory` is the text "yes"
    16:10 U0865 invalid duration `5 sec`: expected a number with a unit, such as `10ms`
    18:9 U0864 `event` is a list
    21:7 U0867 "IX0.0" is no address of a bit (addresses look like %IX0.3, %QX1.0 or %MX2.7)
    "#);
}

#[test]
fn everything_wrong_with_the_meaning_is_found() {
    let text = r#"program = "rung"
[events]
a = 0
b = 2
c_hi = 1
c_cl = 5
[[input]]
event = "c_hi"
signal = "x 1"
[[input]]
event = "a"
signal = "x"
[[input]]
event = "b"
signal = "x"
[[input]]
event = "aa"
signal = "z"
[[switch]]
off = "c_cl"
positions = [{ event = "a", signal = "x" }]
[[timer]]
event = "4"
name = "time"
runs_while = "y"
preset = "5s"
"#;
    let read = read_map(text);
    assert_eq!(read.diagnostics, []);
    let supervisor = supervisor();
    let mut found = Partition::new(&read.map.expect("a map"), &Modules::supervisor(&supervisor))
        .expect_err("much is wrong");
    found.sort_by_key(|found| found.span.start);
    insta::assert_snapshot!(shown(text, found), @r#"
    1:1 U0853 the controllable event `3` has no signal (give it a [[switch]] or a [[pulse]])
    1:1 U0853 the uncontrollable event `6` has no signal (give it an [[input]] or a [[timer]])
    1:1 U0853 the controllable event `7` has no signal (give it a [[switch]] or a [[pulse]])
    1:1 U0853 the controllable event `9` has no signal (give it a [[switch]] or a [[pulse]])
    1:11 U0855 "rung" cannot be a name in a ladder (letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format)
    8:9 U0854 `c_hi` is controllable (1, an odd label): the PLC generates it
    9:10 U0855 "x 1" cannot be a name in a ladder (letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format)
    15:10 U0856 `x` brings two events in the same way (one event for `rising` and one for `falling` are possible)
    17:9 U0851 there is no event `aa` (did you mean `a`?)
    21:24 U0854 `a` is uncontrollable (0, an even label): no PLC can command it
    21:24 U0852 the event `a` has two meanings
    21:38 U0856 `x` is the signal of a position of a switch and of an input
    25:14 U0857 no switch has the signal `y` (did you mean `x`?)
    "#);
}

#[test]
fn an_empty_supervisor_is_said_to_be_one() {
    let empty = Automaton::empty("none", supervisor().alphabet().clone());
    let text = include_str!("../../../examples/motivating-example/map.toml");
    let map = read_map(text).map.expect("a map");
    let found = Partition::new(&map, &Modules::supervisor(&empty)).expect_err("no state");
    insta::assert_snapshot!(shown(text, found), @"1:1 U0858 the automaton `none` has no state: there is no supervisor that keeps the specification");
}

#[test]
fn addresses_stand_in_the_ladder() {
    let text = include_str!("../../../examples/motivating-example/map.toml");
    let map = read_map(text).map.expect("a map");
    let supervisor = map.name_events(supervisor());
    let modules = Modules::supervisor(&supervisor);
    let located = format!(
        "{text}\n[addresses]\nx0 = \"%IX0.0\"\nx_c_hi = \"%QX1.7\"\nx_a = \"%I0.1\"\nrequest_c_hi = \"%IX2\"\n"
    );
    let map = read_map(&located).map.expect("a map");
    let program = convert(&modules, &map, Mode::Requested).expect("it fits").program;
    let signals = program.inputs.iter().chain(&program.outputs);
    let located = signals.filter_map(|signal| {
        let address = signal.address.as_ref()?;
        Some(format!("{} {address}", signal.name))
    });
    insta::assert_snapshot!(located.collect::<Vec<_>>().join("\n"), @r"
    x0 %IX0.0
    x_a %IX0.1
    request_c_hi %IX2
    x_c_hi %QX1.7
    ");
    let wrong =
        format!("{text}\n[addresses]\nx0 = \"%QX0.0\"\nx_c_hy = \"%QX1.7\"\nx_c_hi = \"%QX0.0\"\n");
    let map = read_map(&wrong).map.expect("a map");
    let found = convert(&modules, &map, Mode::Automatic).expect_err("much is wrong");
    insta::assert_snapshot!(shown(&wrong, found), @r#"
    52:1 U0867 %QX0.0 is not the address of `x0`, which needs one of %IX
    53:1 U0866 the ladder has no signal `x_c_hy` (did you mean `x_c_hi`?)
    54:1 U0867 %QX0.0 is the address of `x_c_hi` and of `x0`
    "#);
}

const MODEL: &str = r#"
[events]
start  = { controllable = true, signal = "motor" }
done   = { controllable = false, signal = "down", when = "rising" }
lifted = { controllable = false, signal = "down", when = "falling" }
stop   = { controllable = true }

[addresses]
motor = "%QX0.0"

[[supervisor]]
name = "ram"
marked = ["up"]
transitions = ["up start down", "down done done", "done stop off", "off lifted up"]
"#;

/// What a map does not say about an event, the model does.
#[test]
fn signals_of_a_model_are_a_map() {
    let model = read_model(MODEL, |_| Err(String::new())).model.expect("a model");
    let modules = Modules::supervisor(&model.supervisors[0]);
    let program = |map: &InputOutputMap| {
        let made = convert(&modules, map, Mode::Automatic).expect("it fits");
        let signals = made.program.inputs.iter().chain(&made.program.outputs);
        let shown = signals.map(|signal| {
            let address = signal.address.as_ref().map(ToString::to_string);
            let description = signal.description.as_deref().unwrap_or_default();
            format!("{} {} {description}", signal.name, address.unwrap_or_default())
        });
        shown.collect::<Vec<_>>().join("\n")
    };
    let mut own = InputOutputMap::of_signals("ram", &modules.alphabet(), &model.signals);
    own.addresses = model.addresses.clone();
    insta::assert_snapshot!(program(&own), @r"
    down  plant: done when it becomes 1; lifted when it becomes 0
    motor %QX0.0 on for one scan at start
    stop  on for one scan at stop
    ");
    let switch = "program = \"ram\"\n[[switch]]\noff = \"stop\"\npositions = [{ event = \"start\", signal = \"lower\" }]\n";
    let map = read_map(switch).map.expect("a map");
    let both = map.with_signals(&model.signals, &modules.alphabet());
    // The map has no signal `motor`.
    let both = both.with_addresses(&model.addresses);
    insta::assert_snapshot!(program(&both), @r"
    down  plant: done when it becomes 1; lifted when it becomes 0
    lower  on since start
    ");
}

const HEATER: &str = "\
[events]
a = { controllable = false }
h = { controllable = true }
c = { controllable = true }

[[supervisor]]
name = \"heater\"
marked = \"all\"
transitions = [\"s0 a s1\", \"s1 h s2\", \"s2 a s0\", \"s1 c s0\"]
";

fn heater_map() -> InputOutputMap {
    let text = "program = \"heater\"\n[[input]]\nevent = \"a\"\nsignal = \"x_a\"\n\
                [[switch]]\noff = \"c\"\npositions = [{ event = \"h\", signal = \"x_h\" }]\n";
    read_map(text).map.expect("a map")
}

fn latched_again(modules: &Modules, map: &InputOutputMap) -> Vec<Finding> {
    let found = findings(modules, Some(map)).expect("small");
    found.into_iter().filter(|found| found.kind == FindingKind::LatchedAgain).collect()
}

/// Assumption 4 of the thesis: `x_h` stays on from one h to the next, so the second one has no edge.
#[test]
fn a_command_whose_signal_is_on_is_found_with_its_run() {
    let model = read_model(HEATER, |_| Err(String::new())).model.expect("a model");
    let map = heater_map();
    let alone = Modules::supervisor(&model.supervisors[0]);
    let beside = Modules { supervisors: &model.supervisors, plants: &model.supervisors };
    let said = [alone, beside].map(|modules| latched_again(&modules, &map).remove(0).message);
    insta::assert_snapshot!(said.join("\n"));
    // With a c in between there is nothing to find.
    let text = HEATER.replace("s2 a s0", "s2 c s0").replace(", \"s1 c s0\"", "");
    let model = read_model(&text, |_| Err(String::new())).model.expect("a model");
    assert_eq!(latched_again(&Modules::supervisor(&model.supervisors[0]), &map), []);
}

/// The pulse of a command that follows itself at once has one edge for two commands, and is found; with an event in between it is not.
#[test]
fn a_pulse_that_follows_itself_is_found() {
    for (transitions, is_found) in [
        ("\"s0 a s1\", \"s1 h s2\", \"s2 h s0\"", true),
        ("\"s0 a s1\", \"s1 h s2\", \"s2 a s3\", \"s3 h s0\"", false),
    ] {
        let (head, _) = HEATER.split_once("transitions").expect("transitions");
        let text = format!(
            "{}transitions = [{transitions}]\n",
            head.replace("c = { controllable = true }\n", "")
        );
        let model = read_model(&text, |_| Err(String::new())).model.expect("a model");
        let modules = Modules::supervisor(&model.supervisors[0]);
        let map = InputOutputMap::direct("heater", &modules.alphabet());
        let found = latched_again(&modules, &map);
        assert_eq!(!found.is_empty(), is_found, "{found:?}");
        let made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
        let mut run = Interpreter::new(&made.program, Duration::from_millis(10)).expect("a ladder");
        let on = [true, false, false].map(|event| run.scan(&[event])[0]);
        assert_eq!(on, [true, is_found, false]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    /// A run of a finding leads to its command, and a command that is seen twice in a row on any run is found. Events 0 and 2;
    /// commands 1, which is off, and 3 and 5, which are positions.
    #[test]
    fn commands_without_an_edge_are_those_that_are_found(
        targets in proptest::collection::vec(proptest::option::weighted(0.5, 0_u32..4), 20),
        choices in proptest::collection::vec(0_usize..20, 200),
    ) {
        let labels = [0, 1, 2, 3, 5].map(Label::new);
        let steps = targets.iter().enumerate().filter_map(|(cell, target)| {
            let source = State::new(cell as u32 / 5);
            Some(Transition { source, label: labels[cell % 5], target: State::new((*target)?) })
        });
        let events = labels.map(Event::unnamed);
        let automaton = Automaton::new("random", events, vec![true; 4], steps.collect());
        let automaton = automaton.expect("deterministic");
        let name = |label: usize| Name::from(labels[label].to_string());
        let input = |label: usize, signal: &str| InputEvent {
            event: name(label),
            signal: signal.into(),
            when: When::Rising,
            by: Agent::Plant,
        };
        let position = |label: usize, signal: &str| Position { event: name(label), signal: signal.into() };
        let map = InputOutputMap {
            program: "random".into(),
            inputs: vec![input(0, "u0"), input(2, "u2")],
            switches: vec![Switch {
                off: Some(name(1)),
                positions: vec![position(3, "y3"), position(4, "y5")],
                memory: false,
            }],
            ..InputOutputMap::default()
        };
        let found = latched_again(&Modules::supervisor(&automaton), &map);
        let at = |label: Label| [1, 3, 5].iter().position(|&number| number == label.number());
        for finding in &found {
            let command = finding.events[0];
            let mut state = State::INITIAL;
            let mut position = 0;
            for &label in &finding.run {
                state = automaton.step(state, label).expect("a run");
                position = at(label).unwrap_or(position);
            }
            prop_assert_eq!(Some(position), at(command));
            prop_assert!(automaton.step(state, command).is_some_and(|target| target != state));
        }
        let (mut state, mut position) = (State::INITIAL, 0);
        for choice in choices {
            let label = labels[choice % 5];
            let Some(target) = automaton.step(state, label) else { continue };
            let is_again = at(label).is_some_and(|at| at > 0 && at == position) && target != state;
            prop_assert!(!is_again || found.iter().any(|finding| finding.events == [label]));
            position = at(label).unwrap_or(position);
            state = target;
        }
    }
}
