//! Trimming, step 7: what it prevents, and that it takes nothing else away.

use std::path::Path;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;
use understudy_reconfiguration::command::Objective;
use understudy_reconfiguration::module_two::combine;
use understudy_reconfiguration::proof::{Claim, prove};
use understudy_reconfiguration::{
    Analysis, Bits, Controller, MegaController, MegaState, Question, Reached, Relation, Row,
    Signals, State, Trimming, analyse, project,
};

use crate::{LADDER, PERIOD, any_relation, explored, program, uniform};

pub(crate) fn question(late: bool) -> Question {
    Question {
        channels: vec![0, 1, 2, 3, 4],
        simultaneous: 1,
        analysis: if late { Analysis::Late } else { Analysis::Prompt },
        objective: Objective::Fewest,
        maximum_states: 100_000,
    }
}

/// What the outputs in force in a state let happen: members with moves, by their places.
fn let_moves(controller: &Controller, relation: &Relation, state: &MegaState) -> Vec<(u32, usize)> {
    let mut found = Vec::new();
    for &member in &state.members {
        let own = &controller.states()[member as usize].outputs;
        let outputs = state.command.as_ref().map_or(own, |command| &command.outputs);
        for (place, step) in controller.moves(member as usize).iter().enumerate() {
            let mut events = step.events.iter();
            if events.all(|&event| relation.allows(member as usize, event, outputs)) {
                found.push((member, place));
            }
        }
    }
    found
}

/// Trims, and holds the result to all that trimming promises.
fn trimmed(
    controller: &Controller,
    relation: &Relation,
    question: &Question,
) -> Option<(MegaController, Trimming)> {
    let before = MegaController::build(controller, relation, question).ok()?;
    let trimming = before.trim(controller, relation, question);
    let mut after = before.clone();
    after.apply(&trimming);
    // Every crossing is told, and a second trimming finds what the first one has left.
    let again = after.trim(controller, relation, question);
    assert_eq!(again.prevented, []);
    assert_eq!(again.kept, trimming.kept);
    assert_eq!(again.unavoidable, trimming.unavoidable);
    assert_eq!(again.stopped.len(), trimming.stopped.len() + trimming.prevented.len());
    let reached = [&before, &after].map(|mega| mega.reached(controller, relation, question));
    assert!(reached[1].states <= reached[0].states, "{reached:?}");
    assert!(reached[1].dangling <= reached[0].dangling, "{reached:?}");
    // Only what leads to a dangling state is stopped, and nothing that was kept back leads there now.
    for (place, (old, new)) in before.states.iter().zip(&after.states).enumerate() {
        assert_eq!((&old.members, old.failed), (&new.members, new.failed));
        assert_eq!(old.command.is_some(), new.command.is_some());
        let (was, is) =
            (let_moves(controller, relation, old), let_moves(controller, relation, new));
        let trimmed = new.command.iter().flat_map(|command| &command.trimmed);
        let trimmed: Vec<_> = trimmed.collect();
        for lost in was.iter().filter(|step| !is.contains(step)) {
            let events = &controller.moves(lost.0 as usize)[lost.1].events;
            let is_told = events.iter().any(|&event| trimmed.contains(&&(lost.0, event)));
            assert!(is_told, "{place}: {events:?}");
        }
    }
    Some((after, trimming))
}

/// A box with a label that may have been read or not is stopped before the gate, where a person can still take it off.
#[test]
fn the_sorter_stops_where_it_can_go_on_by_itself() {
    let read = |name: &str| {
        let path = Path::new("../../examples/filling-line").join(name);
        std::fs::read_to_string(path).map_err(|error| error.to_string())
    };
    let text = read("sorter.toml").expect("a file");
    let loaded = project::read("sorter.toml", &text, &mut |name| read(name));
    let mut project = loaded.project.expect("a project");
    let plain = analyse(&project).unwrap_or_else(|failure| panic!("{failure}"));
    project.trim = true;
    let outcome = analyse(&project).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(plain.trimmed, None);
    assert_eq!(outcome.reached, Reached { states: 19, dangling: 2 });
    assert_eq!(outcome.trimmed, Some(Reached { states: 17, dangling: 0 }));
    let controller = &outcome.controller;
    let gate = controller.signals.event("at_gate+").expect("an event");
    let sources: Vec<usize> = outcome.trimming.prevented.iter().map(|(place, _)| *place).collect();
    assert_eq!(sources.len(), 2);
    for place in sources {
        let before = plain.mega.states[place].command.as_ref().expect("a command");
        let after = outcome.mega.states[place].command.as_ref().expect("a command");
        assert!(before.going.contains(&gate) && after.stopped.contains(&gate));
        let taken = controller.signals.event("loaded-").expect("an event");
        assert!(after.going.contains(&taken));
    }
    let question = &outcome.question;
    trimmed(controller, &outcome.relation, question).expect("every state has a command");
}

/// Automata of two inputs and two outputs, with relations of their own in every state.
pub(crate) fn any_automaton() -> impl Strategy<Value = (Controller, Relation)> {
    (4_usize..=7).prop_flat_map(|count| {
        let states = prop::collection::vec((0_u8..4, 0_u8..4), count);
        let pairs = prop::collection::vec((0..count, 0..count), 1..=count);
        let rows = prop::collection::vec(0_u8..4, count * 4);
        (states, pairs, rows).prop_map(|(vectors, pairs, rows)| {
            let bits = |value: u8, width: u8| {
                Bits((0..width).map(|place| value >> place & 1 == 1).collect())
            };
            let signals = Signals {
                inputs: ["a", "b"].map(String::from).to_vec(),
                outputs: ["y", "z"].map(String::from).to_vec(),
            };
            let states: Vec<State> = vectors
                .iter()
                .enumerate()
                .map(|(sibling, &(inputs, outputs))| State {
                    inputs: bits(inputs, 2),
                    outputs: bits(outputs, 2),
                    memory: Vec::new(),
                    sibling: sibling as u32,
                })
                .collect();
            // A ring, so that every state has a way back, and more.
            let ring = (0..states.len()).map(|state| (state, (state + 1) % states.len()));
            let pairs: Vec<_> = ring.chain(pairs).collect();
            let controller = Controller::new(signals, Vec::new(), states, pairs);
            let mut relation = Relation::new(controller.states().len());
            let events: Vec<_> = controller.signals.events().collect();
            for (place, choice) in rows.into_iter().enumerate() {
                let (state, event) = (place / events.len(), events[place % events.len()]);
                let row = match choice {
                    0 => vec![Some(true), None],
                    1 => vec![None, Some(true)],
                    2 => vec![Some(true), Some(false)],
                    _ => continue,
                };
                // What happens under the outputs of a state is let by them.
                let row = Row(row);
                let is_let = row.holds(&controller.states()[state].outputs);
                if is_let || !controller.is_defined(state, event) {
                    relation.set(state, event, [row].into());
                }
            }
            (controller, relation)
        })
    })
}

/// Some of these automata have something to trim, and some keep it, so that the checks of [`trimmed`] are made.
#[test]
fn trimming_of_random_automata_stops_only_what_leads_off() {
    let mut runner = TestRunner::deterministic();
    let (mut prevented, mut kept) = (0, 0);
    for _ in 0..2000 {
        let (controller, relation) =
            any_automaton().new_tree(&mut runner).expect("a value").current();
        for late in [false, true] {
            let question = Question { channels: vec![0], ..question(late) };
            if let Some((_, trimming)) = trimmed(&controller, &relation, &question) {
                prevented += usize::from(!trimming.prevented.is_empty());
                kept += usize::from(!trimming.kept.is_empty());
            }
        }
    }
    assert!(prevented > 0 && kept > 0, "{prevented} {kept}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn what_is_trimmed_is_proved_and_takes_nothing_else_away(
        rows in any_relation(),
        late in any::<bool>(),
    ) {
        let found = explored(PERIOD);
        let controller = &found.controller;
        let relation = uniform(controller, rows);
        let question = question(late);
        if let Some((mega, _)) = trimmed(controller, &relation, &question)
            && let Ok(lost) = MegaController::outputs_for_any(controller, &relation, &question)
        {
            let ladder = program(LADDER);
            let combined = combine(&ladder, controller, &mega, &question, &lost).expect("small");
            let sets = |place: usize| (mega.states[place].members.clone(), mega.states[place].failed);
            let proof = prove(&Claim {
                controller,
                relation: &relation,
                alone: &ladder,
                combined: &combined.program,
                correspondence: &combined.correspondence,
                sets: &sets,
                channels: &question.channels,
                simultaneous: 1,
                late,
                period: PERIOD,
                maximum_states: 100_000,
            });
            prop_assert!(proof.is_ok(), "{}", proof.unwrap_err());
        }
    }
}
