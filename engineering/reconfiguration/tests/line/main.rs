//! The filling line of the examples, from its ladder to the proof of its second module.

mod together;
mod trimming;

use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{Element, Program, parse};
use understudy_reconfiguration::command::Objective;
use understudy_reconfiguration::explore::{Bounds, Explored, explore};
use understudy_reconfiguration::module_two::{Combined, combine};
use understudy_reconfiguration::proof::{Claim, NotProved, Proof, prove};
use understudy_reconfiguration::{
    Analysis, Bits, Controller, MegaController, Question, Relation, Row,
};

const LADDER: &str = include_str!("../../../../examples/filling-line/filling-line.ladder");
const PLANT: &str = include_str!("../../../../examples/filling-line/plant.ladder");

/// Every timer of the line is a multiple of it or rounded up, and the order of all that happens stays.
const PERIOD: Duration = Duration::from_millis(500);

fn program(text: &str) -> Program {
    let parsed = parse(text);
    assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
    parsed.program
}

fn explored(period: Duration) -> Explored {
    let ladder = program(LADDER);
    let names = ladder.memory.iter().map(|signal| signal.name.to_string());
    explore(
        &ladder.lower(period).expect("a circuit"),
        &program(PLANT).lower(period).expect("a circuit"),
        &names.collect::<Vec<_>>(),
        Bounds::default(),
    )
    .expect("it is explored")
}

/// Table 5.
fn relation(controller: &Controller) -> Relation {
    let mut relation = Relation::new(controller.states().len());
    for (name, output) in [
        ("ps1+", 0),
        ("ps1-", 0),
        ("ps2+", 0),
        ("ps2-", 0),
        ("Filling_done+", 1),
        ("Weight_recd+", 2),
    ] {
        let mut row = vec![None; 4];
        row[output] = Some(true);
        let event = controller.signals.event(name).expect("an event");
        for state in 0..controller.states().len() {
            let vector = controller.state_name(state);
            let at_printer = vector == "01000_0000" || vector.starts_with("01100_");
            if !(name.starts_with("ps2") && at_printer) {
                relation.set(state, event, [Row(row.clone())].into());
            }
        }
    }
    relation
}

/// Table 4, in the order in which the exploration meets its states.
#[test]
fn exploration_finds_the_twelve_states_of_table_4_at_any_period() {
    for period in [500, 100, 20] {
        let found = explored(Duration::from_millis(period));
        let controller = &found.controller;
        let mut names: Vec<String> =
            (0..controller.states().len()).map(|state| controller.state_name(state)).collect();
        names.sort();
        let mut table = [
            "00000_0000",
            "10000_1000",
            "00000_1000",
            "01000_0000",
            "01000_0100",
            "01010_0010",
            "01000_0010",
            "01001_1000",
            "01000_1000",
            "01100_0001",
            "01100_0000",
            "01100_0100",
        ];
        table.sort_unstable();
        assert_eq!(names, table, "{period} ms");
        assert_eq!(controller.move_count(), 13, "{period} ms");
        assert!(found.unseen_inputs.is_empty());
    }
}

fn prove_line(
    analysis: Analysis,
    simultaneous: usize,
    change: impl FnOnce(&mut Combined),
) -> Result<Proof, NotProved> {
    let found = explored(PERIOD);
    let relation = relation(&found.controller);
    prove_with(&found.controller, &relation, analysis, simultaneous, change)
        .expect("every state has a command")
}

/// Nothing where some states have no safe command.
fn prove_with(
    controller: &Controller,
    relation: &Relation,
    analysis: Analysis,
    simultaneous: usize,
    change: impl FnOnce(&mut Combined),
) -> Option<Result<Proof, NotProved>> {
    let ladder = program(LADDER);
    let question = Question {
        channels: vec![0, 1, 2, 3, 4],
        simultaneous,
        analysis,
        objective: Objective::Fewest,
        maximum_states: 100_000,
    };
    let mega = MegaController::build(controller, relation, &question).ok()?;
    let lost = MegaController::outputs_for_any(controller, relation, &question).ok()?;
    let mut combined =
        combine(&ladder, controller, &mega, &question, &lost).expect("not too large");
    change(&mut combined);
    let sets = |place: usize| {
        let state = &mega.states[place];
        (state.members.clone(), state.failed)
    };
    Some(prove(&Claim {
        controller,
        relation,
        alone: &ladder,
        combined: &combined.program,
        correspondence: &combined.correspondence,
        sets: &sets,
        channels: &question.channels,
        simultaneous,
        late: analysis == Analysis::Late,
        period: PERIOD,
        maximum_states: 100_000,
    }))
}

#[test]
fn module_two_is_proved() {
    let prompt = prove_line(Analysis::Prompt, 1, |_| {}).expect("proved");
    assert_eq!((prompt.states, prompt.scans), (194, 887));
    let late = prove_line(Analysis::Late, 1, |_| {}).expect("proved");
    assert_eq!((late.states, late.scans), (237, 1029));
    assert!(late.latched > prompt.latched);
}

#[test]
fn two_channels_at_once_are_proved() {
    let proof = prove_line(Analysis::Prompt, 2, |_| {}).expect("proved");
    assert!(proof.latched > 100, "{proof:?}");
}

#[test]
fn what_is_not_written_over_the_outputs_is_refuted() {
    for output in ["Motor", "Filling", "Weighing"] {
        let refuted = prove_line(Analysis::Late, 1, |combined| {
            let rungs = &mut combined.program.rungs;
            let first = combined.first_rung;
            let mut place = 0;
            rungs.retain(|rung| {
                place += 1;
                let is_off = rung.title.as_deref() == Some(&format!("module 2: {output} off"));
                place <= first || !is_off
            });
        });
        assert!(matches!(refuted, Err(NotProved::Refuted { .. })), "{output}: {refuted:?}");
    }
}

#[test]
fn a_detection_that_is_late_refutes_a_ladder_for_a_prompt_one() {
    let refuted = {
        let found = explored(PERIOD);
        let controller = &found.controller;
        let relation = relation(controller);
        let ladder = program(LADDER);
        let question = Question {
            channels: vec![3],
            simultaneous: 1,
            analysis: Analysis::Prompt,
            objective: Objective::Fewest,
            maximum_states: 100_000,
        };
        let mega = MegaController::build(controller, &relation, &question).expect("commands");
        let lost = Bits(vec![false; 4]);
        let combined = combine(&ladder, controller, &mega, &question, &lost).expect("small");
        let sets = |place: usize| (mega.states[place].members.clone(), mega.states[place].failed);
        prove(&Claim {
            controller,
            relation: &relation,
            alone: &ladder,
            combined: &combined.program,
            correspondence: &combined.correspondence,
            sets: &sets,
            channels: &question.channels,
            simultaneous: 1,
            late: true,
            period: PERIOD,
            maximum_states: 100_000,
        })
    };
    assert!(matches!(refuted, Err(NotProved::Refuted { .. })), "{refuted:?}");
}

/// No scan runs through two transitions: every rung that latches a state resets the one that it comes from and closes its phase.
#[test]
fn each_phase_makes_one_transition() {
    prove_line(Analysis::Late, 1, |combined| {
        let moved = |rung: &understudy_ladder::Rung| {
            rung.network.iter().any(|element| {
                matches!(element, Element::Contact(contact) if contact.operand.as_str() == "module_2.moved")
            })
        };
        let rungs = combined.program.rungs[combined.first_rung..].iter();
        let moving: Vec<_> = rungs.filter(|rung| moved(rung)).collect();
        assert!(!moving.is_empty(), "no rung has the phase of module 2");
        for rung in moving {
            let mut targets = rung.coils.iter().map(|coil| coil.target.as_str());
            assert!(targets.any(|target| target == "module_2.moved"), "{rung:?}");
        }
    })
    .expect("proved");
}

fn any_relation() -> impl Strategy<Value = Vec<Vec<Vec<Option<bool>>>>> {
    let entry = prop_oneof![3 => Just(None), 2 => Just(Some(true)), 1 => Just(Some(false))];
    let row = prop::collection::vec(entry, 4);
    let row = row.prop_filter("it would always hold", |row| row.iter().any(Option::is_some));
    // For each of the ten events, up to two rows; none makes it uncontrollable.
    prop::collection::vec(prop::collection::vec(row, 0..=2), 10)
}

/// Of every event the same rows in all states.
pub(crate) fn uniform(controller: &Controller, rows: Vec<Vec<Vec<Option<bool>>>>) -> Relation {
    let mut relation = Relation::new(controller.states().len());
    for (event, rows) in controller.signals.events().zip(rows) {
        let rows: Arc<[Row]> = rows.into_iter().map(Row).collect();
        for state in 0..controller.states().len() {
            relation.set(state, event, rows.clone());
        }
    }
    relation
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn whatever_the_outputs_can_prevent_what_is_generated_is_proved(
        rows in any_relation(),
        late in any::<bool>(),
    ) {
        let found = explored(PERIOD);
        let controller = &found.controller;
        let relation = uniform(controller, rows);
        let analysis = if late { Analysis::Late } else { Analysis::Prompt };
        if let Some(proof) = prove_with(controller, &relation, analysis, 1, |_| {}) {
            prop_assert!(proof.is_ok(), "{}", proof.unwrap_err());
        }
    }
}
