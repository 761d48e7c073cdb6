//! The two formats: what is accepted, and everything that is wrong in one run.

use insta::assert_snapshot;
use understudy_supervisor::ads::Vocal;
use understudy_supervisor::{
    Alphabet, Automaton, Event, Label, Model, State, read_ads, read_model, write_ads, write_model,
};
use understudy_text::{Diagnostic, Report};

use crate::models::{MODELS, Model as Reference};

fn places(text: &str, diagnostics: &[Diagnostic]) -> String {
    let report = Report { name: String::new(), text: text.to_owned(), diagnostics: Vec::new() };
    let line = |diagnostic: &Diagnostic| {
        let place = report.line_and_column(diagnostic.span.start);
        let help = diagnostic.help.as_ref().map(|help| format!(" [{help}]")).unwrap_or_default();
        format!("{place} {} {}{help}", diagnostic.code, diagnostic.message)
    };
    diagnostics.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn accepted(text: &str) -> Automaton {
    let read = read_ads(text);
    read.automaton.unwrap_or_else(|| panic!("{}", places(text, &read.diagnostics)))
}

#[test]
fn every_spelling_of_ads_is_one_automaton() {
    let plain = accepted(
        "A\nState size (State set will be (0,1....,size-1)):\n2\nMarker states:\n0\n1\n\nVocal states:\n\nTransitions:\n0 1 1\n1 2 0\n",
    );
    let variants = [
        // The other spelling, Windows line ends, a mark of the byte order, no vocal states.
        "\u{feff}# made by hand\r\nA\r\n\r\nState set size (0..size-1):\r\n\r\n2\r\nMARKER STATES:\r\n\r\n*\r\nTransitions:\r\n\r\n0 1 1\r\n1\t2  0",
        // Comments behind numbers, several numbers on a line, blank lines within lists.
        "A\nstate size:\n2 # two\nMarker states:\n0 1\nVocal states:\n\nTransitions:\n\n0 1 1\n\n# between\n1 2 0 # back\n\n",
        "A\rState size\r2\rMarker states:\r1\r\r0\rTransitions:\r1 2 0\r0 1 1\r",
    ];
    for text in variants {
        assert_eq!(accepted(text), plain, "{text:?}");
    }
}

#[test]
fn empty_and_vocal_are_read_and_written() {
    let empty = accepted("EMPTY\nState size:\n0\nMarker states:\n\nTransitions:\n");
    assert!(empty.is_empty() && empty.initial().is_none());
    assert_eq!(accepted(&write_ads(&empty, &[]).expect("it fits")), empty);
    let event = Event { label: Label::new(3), name: "start".to_owned() };
    let nothing = Model {
        alphabet: Alphabet::new([event.clone()]),
        supervisors: vec![Automaton::empty("EMPTY", Alphabet::new([event]))],
        ..Model::default()
    };
    let again = read_model(&write_model(&nothing), |_| Err(String::new()));
    assert_eq!(again.model.expect("right").supervisors, nothing.supervisors);
    let text = "V\nState size:\n2\nMarker states:\nVocal states:\n1 10\nTransitions:\n0 0 1\n";
    let read = read_ads(text);
    let vocal = [Vocal { state: State::new(1), output: 10 }];
    assert_eq!(read.vocal, vocal);
    let again =
        read_ads(&write_ads(&read.automaton.expect("right"), &read.vocal).expect("it fits"));
    assert_eq!(again.vocal, vocal);
}

#[test]
fn all_that_is_wrong_with_an_ads_file_is_said_at_once() {
    let text = "A\nState size:\n3\nMaker states:\n0\nMarker states:\n4\nVocal states:\n0 9\n1\nTransitions:\n0 1000 1\n0 1 1\n0 1 2\n0 1 1\n5 2 0\n1 x 2\n1 2\nTransitions:\n";
    assert_snapshot!(places(text, &read_ads(text).diagnostics), @r#"
4:1 U0812 "Maker states:" is neither a heading nor a list of numbers from 0 up [did you mean "Marker states:"?]
7:1 U0814 there is no state 4: the automaton has states 0 to 2
9:1 U0816 vocal output 9: outputs are 10 to 99
10:1 U0813 a line of this list has more or fewer numbers
12:3 U0815 label 1000: the labels of this format are 0 to 999 [odd labels are controllable events, even ones are not]
14:1 U0818 from state 0 event 1 leads to state 1 and to state 2; an automaton must be deterministic [give the two events labels of their own]
15:1 U0819 the transition 0 1 1 stands twice
16:1 U0814 there is no state 5: the automaton has states 0 to 2
17:3 U0812 "1 x 2" is neither a heading nor a list of numbers from 0 up
18:1 U0813 a line of this list has more or fewer numbers
19:1 U0811 the heading "Transitions:" stands twice
"#);
}

#[test]
fn what_is_missing_from_an_ads_file_is_said() {
    assert_snapshot!(places("", &read_ads("").diagnostics), @r#"
1:1 U0810 the heading "State size (State set will be (0,1....,size-1)):" is missing
1:1 U0810 the heading "Marker states:" is missing
1:1 U0810 the heading "Transitions:" is missing
"#);
    let text = "A\nB\nState size:\nMarker states:\nTransitions:\n0 1 0\n";
    assert_snapshot!(places(text, &read_ads(text).diagnostics), @r#"
2:1 U0810 the name is one line, and then comes the number of states
3:1 U0812 the number of states is missing
"#);
    let text = "A\nState size:\n4000000000\nMarker states:\n7\nTransitions:\n";
    assert_snapshot!(places(text, &read_ads(text).diagnostics), @r#"
3:1 U0817 4000000000 states: the format has room for 2000000 states
"#);
}

#[test]
fn reference_models_survive_writing_in_both_formats() {
    for name in MODELS {
        let model = Reference::read(name);
        for automaton in model.plants.iter().chain(&model.specifications) {
            assert_eq!(&accepted(&write_ads(automaton, &[]).expect("it fits")), automaton);
        }
        let alphabets = model.plants.iter().map(Automaton::alphabet);
        let whole = Model {
            name: name.to_owned(),
            alphabet: understudy_supervisor::Alphabet::new([]).union(alphabets),
            plants: model.plants.clone(),
            specifications: model.specifications.clone(),
            ..Model::default()
        };
        let text = write_model(&whole);
        let read = read_model(&text, |_| Err("nothing to load".to_owned()));
        let read = read.model.unwrap_or_else(|| panic!("{}", places(&text, &read.diagnostics)));
        for (one, other) in read.plants.iter().zip(&whole.plants) {
            assert!(one.transitions().eq(other.transitions()), "{name}: {}", other.name());
            assert!(one.marked().eq(other.marked()), "{name}: {}", other.name());
        }
        assert_eq!(
            write_model(&read),
            write_model(
                &read_model(&write_model(&read), |_| Err(String::new())).model.expect("right")
            )
        );
    }
}

const MACHINE: &str = r#"
name = "cell"

[events]
start  = { controllable = true }
finish = { controllable = false, signal = "done", when = "rising" }
reset  = { controllable = true, label = 1 }

[[plant]]
name = "machine"
initial = "idle"
transitions = [
    "working finish idle",
    "idle    start  working",
]
marked = ["idle"]

[[specification]]
file = "ONCE.ADS"
"#;

#[test]
fn a_model_has_named_events_states_signals_and_files() {
    let once = "ONCE\nState size:\n2\nMarker states:\n*\nTransitions:\n0 3 1\n";
    let read = read_model(MACHINE, |path| {
        assert_eq!(path, "ONCE.ADS");
        Ok(once.to_owned())
    });
    assert_eq!(read.diagnostics, []);
    let model = read.model.expect("right");
    let event =
        |number: u32, name: &str| Event { label: Label::new(number), name: name.to_owned() };
    assert_eq!(model.alphabet.events(), [event(0, "finish"), event(1, "reset"), event(3, "start")]);
    assert_eq!(model.signals.len(), 1);
    let machine = &model.plants[0];
    assert_eq!(machine.state_name(State::INITIAL), "idle");
    assert_eq!(
        machine.run(&[Label::new(3)]).map(|state| machine.state_name(state).into_owned()),
        Some("working".to_owned())
    );
    assert_eq!(model.specifications[0].alphabet().name(Label::new(3)), "start");
}

#[test]
fn all_that_is_wrong_with_a_model_is_said_at_once() {
    let text = r#"
title = "cell"
[events]
start  = { controllable = true, label = 2 }
finish = { controllable = false, label = 4, when = "risin" }
again  = { controlable = true, label = 4 }
"two words" = { controllable = 1 }
opened = { controllable = false, label = 6, signal = "door", when = "rising" }
shut   = { controllable = false, label = 8, signal = "door", when = "falling" }
locked = { controllable = false, label = 10, signal = "door" }
barred = { controllable = true, label = 11, signal = "the bar" }
[addresses]
door = "%IX0.0"
bar = "QX1"
[[plant]]
name = "machine"
transitions = [
    "idle strat working",
    "idle finish",
    "idle finish working",
    "idle finish idle",
    "wroking finish idle",
]
marked = ["idel"]
[[specification]]
file = "GONE.ADS"
[[specification]]
transitions = 3
"#;
    let read = read_model(text, |_| Err("no such file".to_owned()));
    assert!(read.model.is_none());
    assert_snapshot!(places(text, &read.diagnostics), @r#"
    2:1 U0821 a model has no key `title` [known: name, events, addresses, plant, specification, supervisor]
    4:41 U0827 label 2: odd labels are controllable, even ones are not
    5:52 U0823 `when` cannot be "risin" [did you mean `rising`?]
    6:12 U0821 an event has no key `controlable` [did you mean `controllable`?]
    6:40 U0827 label 4 stands for two events
    7:1 U0825 the name of an event is one word
    7:32 U0823 `controllable` is the number 1
    10:55 U0856 `door` is the signal of two events [one uncontrollable event for `rising` and one for `falling` are possible]
    11:54 U0855 "the bar" cannot be a name in a ladder [letters, digits and `_`, single dots between its parts, a letter or `_` first, no word of the format]
    14:7 U0867 "QX1" is no address of a bit [addresses look like %IX0.3, %QX1.0 or %MX2.7]
    18:11 U0824 there is no event strat [did you mean `start`?]
    19:5 U0825 a transition is three words: a state, an event, and the state to which it leads
    21:5 U0826 from state idle event finish leads to state working and to state idle; an automaton must be deterministic
    22:6 U0828 no event leads to state wroking of machine [did you mean `working`?]
    24:12 U0828 a marked state is idel, and no transition knows it [did you mean `idle`?]
    26:8 U0829 GONE.ADS cannot be read: no such file
    27:1 U0822 an automaton needs `name`
    "#);
    let text = "name = \"a\n[events";
    assert_snapshot!(places(text, &read_model(text, |_| Err(String::new())).diagnostics), @r#"
1:10 U0820 invalid TOML: invalid basic string, expected `"`
2:8 U0820 invalid TOML: unclosed table, expected `]`
"#);
    assert_snapshot!(places("", &read_model("", |_| Err(String::new())).diagnostics), @r#"
1:1 U0822 the model has no [[plant]], [[specification]] or [[supervisor]]
"#);
}
