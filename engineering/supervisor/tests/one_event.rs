//! Ladders that process at most one event in a scan.

use std::time::Duration;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use understudy_ladder::{Interpreter, Name, Program, Rung, check, parse, print};
use understudy_supervisor::ladder::{
    Agent, Conversion, InputEvent, InputOutputMap, Mode, Modules, OneEvent, When, convert, read_map,
};
use understudy_supervisor::proof::{FindingKind, Proof, ProofSettings, Verdict, findings, prove};
use understudy_supervisor::{Automaton, Label, Model, State, Transition, read_model};

fn figure(number: u32) -> (Automaton, InputOutputMap) {
    let text = match number {
        4 => include_str!("../../../examples/avalanche/figure-4.toml"),
        6 => include_str!("../../../examples/avalanche/figure-6.toml"),
        _ => include_str!("../../../examples/avalanche/figure-7.toml"),
    };
    let Model { supervisors, signals, .. } =
        read_model(text, |_| Err("no other file".into())).model.expect("a model");
    let supervisor = supervisors.into_iter().next().expect("a supervisor");
    let start = read_map(include_str!("../../../examples/avalanche/start.toml"));
    let map = start.map.expect("a map").with_signals(&signals, supervisor.alphabet());
    (supervisor, map)
}

fn queued(order: &[&str]) -> Option<OneEvent> {
    Some(OneEvent::Queued(order.iter().map(|&event| Name::from(event)).collect()))
}

fn verdict(made: &Conversion, modules: &Modules, map: &InputOutputMap, mode: Mode) -> Verdict {
    let settings = ProofSettings { mode, simultaneous: 3, ..ProofSettings::default() };
    prove(&made.program, modules, map, &made.correspondence, settings).expect("a verdict")
}

fn proved(made: &Conversion, modules: &Modules, map: &InputOutputMap) -> Proof {
    match verdict(made, modules, map, Mode::Automatic) {
        Verdict::Proved(proof) => proof,
        Verdict::Refuted(found) => panic!("{}\n{found}", print(&made.program)),
    }
}

/// A program with its titles alone removed, one rung a line.
fn rungs(program: &Program) -> Vec<String> {
    let bare = |rung: &Rung| Rung { title: None, ..rung.clone() };
    let text = |rung: &Rung| {
        let program = Program { rungs: vec![bare(rung)], ..Program::default() };
        let text = print(&program);
        let (_, body) = text.split_once("rung").expect("a rung");
        body.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    program.rungs.iter().map(text).collect()
}

/// Figure 11, rung by rung.
#[test]
fn figure_11_is_the_ladder_of_figure_4() {
    let (automaton, map) = figure(4);
    let modules = Modules::supervisor(&automaton);
    let made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
    insta::assert_snapshot!(rungs(&made.program).join("\n"));
    proved(&made, &modules, &map);
}

/// Figure 12, rung by rung, and one below it.
#[test]
fn figure_12_is_the_ladder_of_figure_6() {
    let (automaton, map) = figure(6);
    let modules = Modules::supervisor(&automaton);
    let made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
    insta::assert_snapshot!(rungs(&made.program).join("\n"));
    proved(&made, &modules, &map);
}

/// Figure 13: rung 1 initialises, 2 to 4 set the bits of a, b and c, 5 to 17 are the transitions by state, 18 to 20 reset.
#[test]
fn figure_13_is_the_ladder_of_figure_7() {
    let (automaton, mut map) = figure(7);
    let modules = Modules::supervisor(&automaton);
    let all = convert(&modules, &map, Mode::Automatic).expect("the map fits");
    let Verdict::Refuted(_) = verdict(&all, &modules, &map, Mode::Automatic) else {
        panic!("an order of the groups serves every state");
    };
    map.one_event = Some(OneEvent::Assumed);
    let made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
    let lines = rungs(&made.program);
    assert_eq!(lines.len(), 20);
    insta::assert_snapshot!(lines.join("\n"));
    // In which rungs the paper resets M1, M2 and M3: as many, each within the rungs of the same states.
    let resets = |bit: &str| {
        let coil = format!("(R {bit})");
        let of = lines.iter().zip(1..).filter(|(line, _)| line.contains(&coil));
        of.map(|(_, number)| number).collect::<Vec<u32>>()
    };
    let of_state = |rungs: &[u32]| {
        let last = [6, 10, 12, 15, 17, 20];
        let state = |rung: &u32| last.iter().position(|last| rung <= last);
        rungs.iter().map(state).collect::<Vec<_>>()
    };
    assert_eq!(of_state(&resets("a")), of_state(&[5, 8, 12, 15, 18]));
    assert_eq!(of_state(&resets("b")), of_state(&[6, 7, 17, 19]));
    assert_eq!(of_state(&resets("c")), of_state(&[9, 11, 20]));
    let proof = proved(&made, &modules, &map);
    assert_eq!(proof.events.len(), 6);
    assert_eq!(check(&made.program), []);
}

#[test]
fn queued_events_are_proved_in_every_order() {
    for order in [&[][..], &["f", "a"], &["d", "e", "f", "c", "b", "a"]] {
        let (automaton, mut map) = figure(7);
        map.one_event = queued(order);
        let modules = Modules::supervisor(&automaton);
        let made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
        assert_eq!(proved(&made, &modules, &map).joint_states, 5);
        assert_eq!(check(&made.program), []);
        let again = parse(&print(&made.program)).into_result().expect("a ladder").0;
        assert_eq!(again, made.program);
    }
}

/// The bound: where no event comes twice within as many scans as there are events, none is lost and each has its turn by then.
/// Where they come faster, they are lost, and the output says so.
#[test]
fn the_bound_of_the_queue_is_kept_and_needed() {
    let (automaton, mut map) = figure(7);
    map.one_event = queued(&[]);
    let modules = Modules::supervisor(&automaton);
    let made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
    let count = made.correspondence.waiting.len();
    let lost = Name::from("event_lost");
    for (apart, loses) in [(count, false), (1, true)] {
        let mut generator = Pcg64::seed_from_u64(7);
        let period = Duration::from_millis(10);
        let mut run = Interpreter::new(&made.program, period).expect("a ladder");
        let mut rest = vec![0; made.program.inputs.len()];
        let mut waits = vec![0; count];
        for scan in 0..20_000 {
            let inputs: Vec<bool> = made
                .program
                .inputs
                .iter()
                .zip(&mut rest)
                .map(|(input, rest)| {
                    if input.name.as_str() == "init" {
                        return scan == 0;
                    }
                    let comes = *rest == 0 && generator.random_bool(0.5);
                    *rest = if comes { apart - 1 } else { rest.saturating_sub(1) };
                    comes
                })
                .collect();
            run.scan(&inputs);
            for (wait, bit) in waits.iter_mut().zip(made.correspondence.waiting.values()) {
                *wait = if run.value(bit) == Some(true) { *wait + 1 } else { 0 };
                assert!(loses || *wait < count, "{bit} waits {wait} scans");
            }
        }
        assert_eq!(run.value(&lost), Some(loses), "{apart} scans apart");
    }
}

#[test]
fn what_is_delayed_or_lost_is_said() {
    let (automaton, mut map) = figure(7);
    let modules = Modules::supervisor(&automaton);
    let mut said = Vec::new();
    for one_event in [Some(OneEvent::Assumed), queued(&["d"])] {
        map.one_event = one_event;
        let found = findings(&modules, Some(&map)).expect("small");
        said.extend(found.iter().map(|found| format!("{} {}", found.code(), found.message)));
    }
    insta::assert_snapshot!(said.join("\n"));
}

/// A level occurs in every scan, a command waits for no turn, and what nobody knows has none.
#[test]
fn what_cannot_wait_is_an_error() {
    let (automaton, mut map) = figure(7);
    map.inputs[0].when = When::High;
    map.one_event = queued(&["b", "nobody"]);
    let found = convert(&Modules::supervisor(&automaton), &map, Mode::Automatic);
    let found = found.expect_err("two errors");
    let codes: Vec<&str> = found.iter().map(|found| found.code).collect();
    assert_eq!(codes, ["U0868", "U0851"], "{found:?}");
}

/// Events 0, 2, 4 and 6 of the plant, commands 1 and 3.
fn automaton(states: u32) -> impl Strategy<Value = Automaton> {
    const LABELS: [u32; 6] = [0, 1, 2, 3, 4, 6];
    let cells = states as usize * LABELS.len();
    proptest::collection::vec(proptest::option::weighted(0.4, 0..states), cells).prop_map(
        move |targets| {
            let steps = targets.iter().enumerate().filter_map(|(cell, target)| {
                Some(Transition {
                    source: State::new((cell / LABELS.len()) as u32),
                    label: Label::new(LABELS[cell % LABELS.len()]),
                    target: State::new((*target)?),
                })
            });
            let marked = vec![true; states as usize];
            Automaton::new("random", [], marked, steps.collect()).expect("deterministic")
        },
    )
}

fn random_map(modules: &Modules, whens: [When; 4], start: bool) -> InputOutputMap {
    let alphabet = modules.alphabet();
    let mut map = InputOutputMap::direct("random", &alphabet);
    for (input, when) in map.inputs.iter_mut().zip(whens) {
        *input = InputEvent { when, by: Agent::Plant, ..input.clone() };
    }
    map.start = start.then(|| Name::from("go"));
    map
}

fn when() -> impl Strategy<Value = When> {
    proptest::sample::select(vec![When::Pulse, When::Rising, When::Falling])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// With a queue every automaton is followed, however many events come in one scan, in every order of priority.
    #[test]
    fn every_ladder_with_a_queue_is_proved(
        automaton in automaton(4),
        whens in [when(), when(), when(), when()],
        mode in proptest::sample::select(Mode::WORDS.map(|(_, mode)| mode).to_vec()),
        start in any::<bool>(),
        order in Just(["0", "2", "4", "6"].map(Name::from).to_vec()).prop_shuffle(),
    ) {
        let modules = Modules::supervisor(&automaton);
        let known = modules.alphabet();
        let mut map = random_map(&modules, whens, start);
        let is_known = |event: &Name| known.contains(Label::new(event.parse().expect("a number")));
        map.one_event = Some(OneEvent::Queued(order.into_iter().filter(is_known).collect()));
        let made = convert(&modules, &map, mode).expect("the map fits");
        if let Verdict::Refuted(found) = verdict(&made, &modules, &map, mode) {
            prop_assert!(false, "{}\n{found}", print(&made.program));
        }
        map.one_event = Some(OneEvent::Assumed);
        let made = convert(&modules, &map, mode).expect("the map fits");
        if let Verdict::Refuted(found) = verdict(&made, &modules, &map, mode) {
            prop_assert!(false, "{}\n{found}", print(&made.program));
        }
    }

    /// Several automata that share events, one of them a plant.
    #[test]
    fn automata_side_by_side_have_one_queue(
        automata in proptest::collection::vec(automaton(3), 2..4),
        plants in 0_usize..2,
        whens in [when(), when(), when(), when()],
        is_queued in any::<bool>(),
    ) {
        let (supervisors, plants) = automata.split_at(automata.len() - plants);
        let modules = Modules { supervisors, plants };
        let mut map = random_map(&modules, whens, false);
        map.one_event = if is_queued { queued(&[]) } else { Some(OneEvent::Assumed) };
        let made = convert(&modules, &map, Mode::Requested).expect("the map fits");
        if let Verdict::Refuted(found) = verdict(&made, &modules, &map, Mode::Requested) {
            let known = findings(&modules, Some(&map)).expect("small");
            prop_assert!(
                known.iter().any(|finding| finding.kind == FindingKind::Controllability),
                "{}\n{found}", print(&made.program)
            );
        }
    }

    /// The queue's proof is not blind: without a coil that sets, resets or takes a turn it is refuted.
    #[test]
    fn a_queue_without_one_of_its_coils_is_refuted(which in any::<prop::sample::Index>()) {
        let (automaton, mut map) = figure(7);
        map.one_event = queued(&[]);
        let modules = Modules::supervisor(&automaton);
        let mut made = convert(&modules, &map, Mode::Automatic).expect("the map fits");
        let waiting: Vec<&Name> = made.correspondence.waiting.values().collect();
        let places = made.program.rungs.iter().enumerate().flat_map(|(rung, content)| {
            let coils = content.coils.iter().enumerate();
            let own = coils.filter(|(_, coil)| waiting.contains(&&coil.target) || coil.target.as_str() == "taken");
            own.map(move |(coil, _)| (rung, coil)).collect::<Vec<_>>()
        });
        let places: Vec<(usize, usize)> = places.collect();
        let (rung, coil) = places[which.index(places.len())];
        let removed = made.program.rungs[rung].coils.remove(coil);
        let title = made.program.rungs[rung].title.clone().unwrap_or_default();
        // The last one in the order finds nothing else that it could take.
        prop_assume!(title != "turn of f" || removed.target.as_str() != "taken");
        let refuted = matches!(verdict(&made, &modules, &map, Mode::Automatic), Verdict::Refuted(_));
        prop_assert!(refuted, "{title}: {}", removed.target);
    }
}
