//! Random automata as ladders: what is generated is proved, and what is damaged is refuted.

use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{CoilKind, Name};
use understudy_supervisor::ladder::{
    Agent, Conversion, InputEvent, InputOutputMap, Mode, Modules, Position, Pulse, Switch, Timer,
    When, convert,
};
use understudy_supervisor::proof::{FindingKind, ProofSettings, Verdict, findings, prove};
use understudy_supervisor::{Automaton, Label, State, Transition};

/// Events 0, 2, 4 of the plant, 6 of a timer; commands 1 and 3 of a switch, 5 a pulse.
const LABELS: u32 = 7;

fn automaton(states: u32) -> impl Strategy<Value = Automaton> {
    let cells = (states * LABELS) as usize;
    proptest::collection::vec(proptest::option::weighted(0.4, 0..states), cells).prop_map(
        move |targets| {
            let transitions = targets.iter().enumerate().filter_map(|(cell, target)| {
                Some(Transition {
                    source: State::new(cell as u32 / LABELS),
                    label: Label::new(cell as u32 % LABELS),
                    target: State::new((*target)?),
                })
            });
            let marked = vec![true; states as usize];
            Automaton::new("random", [], marked, transitions.collect()).expect("deterministic")
        },
    )
}

fn map(whens: [When; 3], start: bool, modules: &Modules) -> InputOutputMap {
    let known = modules.alphabet();
    let is_known = |event: &Name| known.contains(Label::new(event.parse().expect("a number")));
    let mut inputs: Vec<InputEvent> = (0..3)
        .map(|place| InputEvent {
            event: Name::from((2 * place).to_string()),
            signal: Name::from(format!("u{place}")),
            when: whens[place],
            by: Agent::Plant,
        })
        .collect();
    inputs.retain(|input| is_known(&input.event));
    let position = Position { event: Name::from("3"), signal: Name::from("y3") };
    let mut switch =
        Switch { off: Some(Name::from("1")), positions: vec![position], memory: false };
    switch.positions.retain(|position| is_known(&position.event));
    switch.off = switch.off.filter(is_known);
    let pulse = |event: &Name| Pulse {
        event: event.clone(),
        signal: Name::from(format!("y{event}")),
        memory: false,
    };
    let mut pulses = vec![pulse(&Name::from("5"))];
    if switch.positions.is_empty() {
        pulses.extend(switch.off.take().iter().map(pulse));
    }
    pulses.retain(|pulse| is_known(&pulse.event));
    let mut timers = vec![Timer {
        event: Name::from("6"),
        name: Name::from("delay"),
        runs_while: Name::from("y3"),
        preset: Duration::from_secs(1),
    }];
    timers.retain(|timer| is_known(&timer.event));
    if switch.positions.is_empty() {
        for timer in timers.drain(..) {
            inputs.push(InputEvent {
                event: timer.event,
                signal: Name::from("u6"),
                when: When::Pulse,
                by: Agent::Plant,
            });
        }
    }
    InputOutputMap {
        program: Name::from("random"),
        start: start.then(|| Name::from("go")),
        inputs,
        switches: vec![switch],
        pulses,
        timers,
        ..InputOutputMap::default()
    }
}

fn when() -> impl Strategy<Value = When> {
    proptest::sample::select(When::WORDS.map(|(_, when)| when).to_vec())
}

fn mode() -> impl Strategy<Value = Mode> {
    proptest::sample::select(Mode::WORDS.map(|(_, mode)| mode).to_vec())
}

fn verdict(
    conversion: &Conversion,
    modules: &Modules,
    map: &InputOutputMap,
    mode: Mode,
    simultaneous: usize,
) -> Verdict {
    let settings = ProofSettings { mode, simultaneous, ..ProofSettings::default() };
    prove(&conversion.program, modules, map, &conversion.correspondence, settings)
        .expect("a verdict")
}

fn settings() -> ProptestConfig {
    ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(settings())]

    /// One event a scan is always followed. Two may be beyond any order of rungs, and then there is a finding.
    #[test]
    fn what_is_generated_is_proved(
        automaton in automaton(4),
        whens in [when(), when(), when()],
        mode in mode(),
        start in any::<bool>(),
    ) {
        let modules = Modules::supervisor(&automaton);
        let map = map(whens, start, &modules);
        let conversion = convert(&modules, &map, mode).expect("the map fits");
        let is_level = |when: &When| matches!(when, When::High | When::Low);
        if !whens.iter().any(is_level) {
            match verdict(&conversion, &modules, &map, mode, 1) {
                Verdict::Proved(_) => {}
                Verdict::Refuted(found) => prop_assert!(false, "{}\n{found}", understudy_ladder::print(&conversion.program)),
            }
        }
        if let Verdict::Refuted(found) = verdict(&conversion, &modules, &map, mode, 2) {
            let known = findings(&modules, Some(&map)).expect("small");
            prop_assert!(
                known.iter().any(|finding| finding.kind == FindingKind::Simultaneity),
                "{}\n{found}", understudy_ladder::print(&conversion.program)
            );
        }
    }

    /// Several automata that share events.
    #[test]
    fn automata_side_by_side_are_proved(
        automata in proptest::collection::vec(automaton(3), 2..4),
        plants in 0_usize..2,
        mode in mode(),
        start in any::<bool>(),
    ) {
        let (supervisors, plants) = automata.split_at(automata.len() - plants);
        let modules = Modules { supervisors, plants };
        let known = findings(&modules, None).expect("small");
        let whens = [When::Pulse, When::Rising, When::Falling];
        let map = map(whens, start, &modules);
        let conversion = convert(&modules, &map, mode).expect("the map fits");
        if let Verdict::Refuted(found) = verdict(&conversion, &modules, &map, mode, 1) {
            prop_assert!(
                known.iter().any(|finding| finding.kind == FindingKind::Controllability),
                "{}\n{found}", understudy_ladder::print(&conversion.program)
            );
        }
    }

    /// A ladder without one of its coils on states is refuted wherever the coil matters: where the run of the whole ladder
    /// uses its rung, which a proof with all states and events reached makes likely, so only these count.
    #[test]
    fn a_lost_coil_is_found(automaton in automaton(4), which in any::<prop::sample::Index>()) {
        let modules = Modules::supervisor(&automaton);
        let map = map([When::Pulse; 3], false, &modules);
        let mode = Mode::Requested;
        let mut conversion = convert(&modules, &map, mode).expect("the map fits");
        let Verdict::Proved(proof) = verdict(&conversion, &modules, &map, mode, 1) else {
            return Err(TestCaseError::reject("no ladder to damage"));
        };
        let is_full = proof.joint_states == automaton.state_count();
        let coils: Vec<(usize, usize)> = conversion
            .program
            .rungs
            .iter()
            .enumerate()
            .flat_map(|(rung, content)| (0..content.coils.len()).map(move |coil| (rung, coil)))
            .filter(|&(rung, coil)| {
                let coil = &conversion.program.rungs[rung].coils[coil];
                let is_state = conversion.correspondence.states[0].contains(&coil.target);
                // The timer's event cannot occur in every state, and what stands again is for two events in one scan.
                let title = conversion.program.rungs[rung].title.clone().unwrap_or_default();
                let is_special = title.contains("-- 6 -->") || title.contains("after another");
                is_state && coil.kind != CoilKind::Plain && !is_special
            })
            .collect();
        prop_assume!(is_full && !coils.is_empty());
        let (rung, coil) = coils[which.index(coils.len())];
        conversion.program.rungs[rung].coils.remove(coil);
        let damaged = verdict(&conversion, &modules, &map, mode, 1);
        prop_assert!(matches!(damaged, Verdict::Refuted(_)), "{}", understudy_ladder::print(&conversion.program));
    }
}
