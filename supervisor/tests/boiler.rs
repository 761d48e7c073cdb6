//! The boiler of chapter 4, built from its text: how large its supervisors are beside those of the thesis, and that its ladders keep them.

use understudy_ladder::print;
use understudy_supervisor::ladder::{InputOutputMap, Mode, Modules, convert, read_map};
use understudy_supervisor::operations::minstate;
use understudy_supervisor::proof::{ProofSettings, Verdict, findings, prove};
use understudy_supervisor::{Bounds, Model, read_model, synthesise};

/// What the thesis states of a supervisor, and ours.
fn counts(text: &str, thesis: &str) -> (Model, String) {
    let read = read_model(text, |file| Err(format!("{file} is not known here")));
    assert_eq!(read.diagnostics, []);
    let model = read.model.expect("a model");
    let made = synthesise(&model.plants(), &model.specifications(), Bounds::default())
        .expect("small enough");
    assert!(
        made.is_as_specified(),
        "the specifications are supervisors by themselves"
    );
    let least = minstate(&made.supervisor);
    let text = format!(
        "thesis: {thesis}\nhere: {}, {}; after minstate {}, {}",
        made.supervisor.state_count(),
        made.supervisor.transition_count(),
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
    let modules = Modules {
        supervisors: &model.specifications,
        plants: &model.plants,
    };
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
        include_str!("../../examples/boiler/pilot.toml"),
        include_str!("../../examples/boiler/pilot-map.toml"),
        include_str!("../../examples/boiler/pilot.ladder"),
        "21, 75",
    ));
}

#[test]
fn the_main_supervisor_becomes_a_ladder_that_keeps_it() {
    insta::assert_snapshot!(check(
        include_str!("../../examples/boiler/main.toml"),
        include_str!("../../examples/boiler/main-map.toml"),
        include_str!("../../examples/boiler/main.ladder"),
        "57, 156; after minstate 42, 136",
    ));
}

/// Its ladder is proved where the command line makes it again.
#[test]
fn the_complete_supervisor_is_the_meet_of_its_specifications() {
    let (_, counts) = counts(
        include_str!("../../examples/boiler/complete.toml"),
        "57, 196",
    );
    insta::assert_snapshot!(counts, @"
    thesis: 57, 196
    here: 1116, 7391; after minstate 592, 3843
    ");
}
