//! The boiler of chapter 4, built from its text: what the pilot flame's supervisor is, and that its ladder keeps it.

use understudy_ladder::print;
use understudy_supervisor::ladder::{InputOutputMap, Mode, Modules, convert, read_map};
use understudy_supervisor::operations::minstate;
use understudy_supervisor::proof::{ProofSettings, Verdict, findings, prove};
use understudy_supervisor::{Automaton, Bounds, read_model, synthesise};

fn supervisor(text: &str) -> Automaton {
    let read = read_model(text, |file| Err(format!("{file} is not known here")));
    assert_eq!(read.diagnostics, []);
    let model = read.model.expect("a model");
    let made = synthesise(&model.plants(), &model.specifications(), Bounds::default())
        .expect("small enough");
    assert_eq!(made.explanation, None);
    minstate(&made.supervisor).with_name(model.name)
}

fn map(text: &str) -> InputOutputMap {
    let read = read_map(text);
    assert_eq!(read.diagnostics, []);
    read.map.expect("a map")
}

fn check(model: &str, map_text: &str, ladder: &str, thesis: &str) -> String {
    let supervisor = supervisor(model);
    let map = map(map_text);
    let modules = Modules::supervisor(&supervisor);
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
    assert_eq!(
        print(&conversion.program),
        ladder,
        "the ladder in examples/boiler is another one"
    );
    let found = findings(&modules).expect("small");
    let messages = found
        .iter()
        .map(|finding| format!("{} {}", finding.code(), finding.message));
    format!(
        "{} states, {} transitions (thesis: {thesis})\n{} rungs, proved over {} states\n{}",
        supervisor.state_count(),
        supervisor.transition_count(),
        conversion.program.rungs.len(),
        proof.states,
        messages.collect::<Vec<_>>().join("\n")
    )
}

/// The thesis has 21 states. Ours has more, because the operator may call and call off at every moment, and every device is
/// closed by a command of its own in any order.
#[test]
fn the_pilot_supervisor_becomes_a_ladder_that_keeps_it() {
    insta::assert_snapshot!(check(
        include_str!("../../examples/boiler/pilot.toml"),
        include_str!("../../examples/boiler/pilot-map.toml"),
        include_str!("../../examples/boiler/pilot.ladder"),
        "21 and 75",
    ));
}

#[test]
fn the_main_supervisor_becomes_a_ladder_that_keeps_it() {
    insta::assert_snapshot!(check(
        include_str!("../../examples/boiler/main.toml"),
        include_str!("../../examples/boiler/main-map.toml"),
        include_str!("../../examples/boiler/main.ladder"),
        "57 and 156, 42 and 136 after minstate",
    ));
}
