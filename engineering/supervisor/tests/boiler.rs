//! The boiler of chapter 4, built from its text: how large its supervisors are beside those of the thesis, and that its ladders keep them.

use understudy_ladder::print;
use understudy_supervisor::ladder::{InputOutputMap, Mode, Modules, convert, read_map};
use understudy_supervisor::operations::minstate;
use understudy_supervisor::proof::{ProofSettings, Verdict, findings, prove};
use understudy_supervisor::{Automaton, Bounds, Model, State, read_model, synthesise};

fn synthesised(text: &str) -> (Model, Automaton) {
    let read = read_model(text, |file| Err(format!("{file} is not known here")));
    assert_eq!(read.diagnostics, []);
    let model = read.model.expect("a model");
    let made = synthesise(&model.plants(), &model.specifications(), Bounds::default())
        .expect("small enough");
    assert!(made.is_as_specified(), "the specifications are supervisors by themselves");
    (model, made.supervisor)
}

/// What the thesis states of a supervisor, and ours.
fn counts(text: &str, thesis: &str) -> (Model, String) {
    let (model, supervisor) = synthesised(text);
    let least = minstate(&supervisor);
    let text = format!(
        "thesis: {thesis}\nhere: {}, {}; after minstate {}, {}",
        supervisor.state_count(),
        supervisor.transition_count(),
        least.state_count(),
        least.transition_count(),
    );
    (model, text)
}

fn map(text: &str) -> InputOutputMap {
    let read = read_map(text);
    assert_eq!(read.diagnostics, []);
    read.map.expect("a map")
}

fn check(text: &str, map_text: &str, ladder: &str, thesis: &str) -> String {
    let (model, counts) = counts(text, thesis);
    let map = map(map_text);
    let modules = Modules { supervisors: &model.specifications, plants: &model.plants };
    let conversion =
        convert(&modules, &map, Mode::Automatic).unwrap_or_else(|wrong| panic!("{wrong:?}"));
    let verdict = prove(
        &conversion.program,
        &modules,
        &map,
        &conversion.correspondence,
        ProofSettings::default(),
    );
    let proof = match verdict.expect("a verdict") {
        Verdict::Proved(proof) => proof,
        Verdict::Refuted(counterexample) => panic!("{counterexample}"),
    };
    assert_eq!(print(&conversion.program), ladder, "the ladder in examples/boiler is another one");
    let found = findings(&modules, None).expect("small");
    let messages = found.iter().map(|finding| format!("{} {}", finding.code(), finding.message));
    format!(
        "{counts}\n{} rungs, proved over {} states\n{}",
        conversion.program.rungs.len(),
        proof.states,
        messages.collect::<Vec<_>>().join("\n")
    )
}

/// Ours has more states, because the operator may call and call off at every moment, and every device is closed by a command of
/// its own in any order.
#[test]
fn the_pilot_supervisor_becomes_a_ladder_that_keeps_it() {
    insta::assert_snapshot!(check(
        include_str!("../../../examples/boiler/pilot.toml"),
        include_str!("../../../examples/boiler/pilot-map.toml"),
        include_str!("../../../examples/boiler/pilot.ladder"),
        "21, 75",
    ));
}

#[test]
fn the_main_supervisor_becomes_a_ladder_that_keeps_it() {
    insta::assert_snapshot!(check(
        include_str!("../../../examples/boiler/main.toml"),
        include_str!("../../../examples/boiler/main-map.toml"),
        include_str!("../../../examples/boiler/main.ladder"),
        "57, 156; after minstate 42, 136",
    ));
}

/// Its ladder is proved where the command line makes it again.
#[test]
fn the_complete_supervisor_is_the_meet_of_its_specifications() {
    let (_, counts) = counts(include_str!("../../../examples/boiler/complete.toml"), "57, 196");
    insta::assert_snapshot!(counts, @"
    thesis: 57, 196
    here: 1116, 7393; after minstate 592, 3845
    ");
}

/// The state of one part of the model where the supervisor is in `state`.
fn part<'a>(model: &Model, names: &'a [String], state: State, part: &str) -> &'a str {
    let mut parts = model.plants.iter().chain(&model.specifications);
    let place = parts.position(|automaton| automaton.name() == part);
    let place = place.unwrap_or_else(|| panic!("no part {part}"));
    let mut states = names[state.index()].split(',');
    states.nth(place).expect("a state of each part")
}

/// `rules` such as `pump on: damper low high`: while the pump is on, the damper is low or high.
fn always(text: &str, rules: &[&str]) {
    let (model, supervisor) = synthesised(text);
    let names = supervisor.state_names().expect("names of the product");
    for rule in rules {
        let (while_so, needed) = rule.split_once(": ").expect("a rule");
        let is = |state, side: &str| {
            let (name, states) = side.split_once(' ').expect("a part and its states");
            states.split(' ').any(|wanted| wanted == part(&model, names, state, name))
        };
        let concerned: Vec<State> =
            supervisor.states().filter(|&state| is(state, while_so)).collect();
        assert!(!concerned.is_empty(), "{rule}: it is never so");
        for state in concerned {
            assert!(is(state, needed), "{rule}: {}", names[state.index()]);
        }
    }
}

#[test]
fn the_main_flame_has_air() {
    let text = include_str!("../../../examples/boiler/main.toml");
    always(text, &["pump on: damper low high", "gas low high: pump on"]);
}

#[test]
fn the_complete_controller_opens_nothing_that_it_may_not() {
    let text = include_str!("../../../examples/boiler/complete.toml");
    always(
        text,
        &[
            "pilot_valve open: purge_timer over",
            "transformer on: pilot_valve open",
            "pump on: damper low high",
            "main_valve low high: pilot_valve open",
            "main_valve low high: trial_timer idle",
            "main_valve low high: pump on",
            "main_valve high: damper high",
        ],
    );
}

/// In an emergency, commands alone close everything, whichever of them comes first where there is a choice.
#[test]
fn an_emergency_closes_everything_in_a_bounded_number_of_commands() {
    let text = include_str!("../../../examples/boiler/complete.toml");
    let (model, supervisor) = synthesised(text);
    let names = supervisor.state_names().expect("names of the product");
    let stage = |state| part(&model, names, state, "stage");
    let mut states: Vec<State> =
        supervisor.states().filter(|&state| stage(state) == "danger").collect();
    let mut commands = 0;
    while !states.is_empty() {
        commands += 1;
        assert!(commands <= 12, "still closing");
        states = states
            .iter()
            .flat_map(|&state| {
                let edges = supervisor.edges(state).iter();
                let event = |place| supervisor.alphabet().event(place).label;
                let commands = edges.filter(|edge| event(edge.event).is_controllable());
                let next: Vec<State> = commands.map(|edge| edge.target).collect();
                let waits = "the PLC has nothing to command";
                assert!(!next.is_empty(), "{waits}: {}", names[state.index()]);
                next
            })
            .filter(|&state| stage(state) != "idle")
            .collect();
        states.sort_unstable();
        states.dedup();
    }
    assert_eq!(commands, 8, "at most, with the shut-down and burner management");
}
