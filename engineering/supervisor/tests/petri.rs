//! Automation Petri nets: bounds, automata, reductions, and their ladders against the net itself.

use std::collections::HashSet;
use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::{Interpreter, Name};
use understudy_supervisor::ladder::When;
use understudy_supervisor::operations::{isomorph, sync};
use understudy_supervisor::petri::{
    Action, Arc, Condition, ExplorationError, Net, NetFile, NetTransition, Place, Reduction,
    buffers, read_net, reduce, to_ladder, write_net,
};
use understudy_supervisor::proof::{HybridVerdict, ProofSettings, prove_hybrid};
use understudy_supervisor::{Alphabet, Automaton, Bounds, Event, Label, State, Transition};

fn place(name: &str, initial: u32) -> Place {
    Place { name: name.into(), initial, ..Place::default() }
}

fn arcs(places: &[(usize, u32)]) -> Vec<Arc> {
    places.iter().map(|&(place, weight)| Arc { place, weight }).collect()
}

fn transition(name: &str, takes: &[(usize, u32)], gives: &[(usize, u32)]) -> NetTransition {
    NetTransition {
        name: name.into(),
        takes: arcs(takes),
        gives: arcs(gives),
        ..NetTransition::default()
    }
}

#[test]
fn bounds_are_found_or_the_run_that_shows_there_is_none() {
    let places = vec![place("free", 3), place("used", 0)];
    let take = transition("take", &[(0, 1)], &[(1, 1)]);
    let back = transition("back", &[(1, 1)], &[(0, 1)]);
    let net = Net::new("pool", places.clone(), vec![take.clone(), back.clone()]).unwrap();
    let exploration = net.explore(100).unwrap();
    assert_eq!(exploration.bounds(), [3, 3]);
    assert_eq!(exploration.markings().len(), 4);
    let more = transition("more", &[(1, 1)], &[(0, 2)]);
    let net = Net::new("pool", places.clone(), vec![take, more]).unwrap();
    assert_eq!(
        net.explore(100).unwrap_err(),
        ExplorationError::Unbounded {
            place: "free".into(),
            run: vec!["take".into(), "more".into()],
        }
    );
    let many =
        Net::new("pool", places, vec![transition("take", &[(0, 1)], &[(1, 1)]), back]).unwrap();
    assert_eq!(many.explore(2).unwrap_err(), ExplorationError::TooLarge { limit: 2 });
}

#[test]
fn everything_wrong_with_a_net_is_said_at_once() {
    let places = vec![place("a", 2), Place { capacity: Some(1), ..place("a", 2) }];
    let transitions = vec![transition("t", &[(5, 1)], &[(0, 0)])];
    let errors = Net::new("wrong", places, transitions).unwrap_err();
    let messages: Vec<String> = errors.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(messages.join("\n"), @r"
    U0891: `a` is the name of two places or two transitions
    U0892: `t` has an arc to place number 5, and there are 2 places
    U0893: `t` has an arc of weight 0 to `a`
    U0894: `a` begins with 2 tokens, its capacity is 1
    ");
}

#[test]
fn reductions_take_away_what_has_no_part_in_control() {
    let places = vec![
        place("idle", 1),
        place("prepared", 0),
        place("working", 0),
        place("shadow", 0),
        place("power", 1),
    ];
    let start = NetTransition {
        label: Some(Label::new(1)),
        ..transition("start", &[(0, 1), (4, 1)], &[(1, 1), (4, 1)])
    };
    let prepare = transition("prepare", &[(1, 1)], &[(2, 1), (3, 1)]);
    let end = NetTransition {
        label: Some(Label::new(2)),
        ..transition("end", &[(2, 1), (3, 1)], &[(0, 1)])
    };
    let net = Net::new("machine", places, vec![start, prepare, end]).unwrap();
    let (reduced, reductions) = reduce(&net);
    assert_eq!(
        reductions,
        [
            Reduction::ParallelPlace("working".into()),
            Reduction::Series { transition: "prepare".into(), place: "prepared".into() },
            Reduction::ImpliedPlace("power".into()),
        ]
    );
    assert_eq!(reduced.places().len(), 2);
    let automaton = reduced.explore(10).unwrap().automaton().unwrap();
    assert_eq!((automaton.state_count(), automaton.transition_count()), (2, 2));
}

fn condition() -> impl Strategy<Value = Condition> {
    let when = proptest::sample::select(vec![When::Rising, When::Falling, When::High, When::Low]);
    let signal = (0..3, when)
        .prop_map(|(input, when)| Condition::Signal(Name::from(format!("u{input}")), when));
    let part = prop_oneof![1 => Just(Condition::Always), 4 => signal];
    prop_oneof![
        4 => part.clone(),
        1 => proptest::collection::vec(part.clone(), 2..4).prop_map(Condition::All),
        1 => proptest::collection::vec(part, 2..4).prop_map(Condition::Any),
    ]
}

fn random_arcs(most: usize, heaviest: u32) -> impl Strategy<Value = Vec<Arc>> {
    proptest::collection::btree_map(0..4_usize, 1..=heaviest, 0..=most)
        .prop_map(|arcs| arcs.into_iter().map(|(place, weight)| Arc { place, weight }).collect())
}

fn net(heaviest: u32) -> impl Strategy<Value = Net> {
    let action = |index: usize| {
        (0..5_u32).prop_map(move |kind| match kind {
            0 => vec![Action::Level(Name::from(format!("level{index}")))],
            1 => vec![Action::Impulse(Name::from(format!("impulse{index}")))],
            _ => Vec::new(),
        })
    };
    let place =
        move |index: usize| {
            (0..3_u32, 2..4_u32, action(index)).prop_map(move |(initial, capacity, actions)| {
                Place { name: format!("p{index}"), initial, capacity: Some(capacity), actions }
            })
        };
    let places = (place(0), place(1), place(2), place(3));
    let step = (
        random_arcs(2, heaviest),
        random_arcs(2, heaviest),
        random_arcs(1, 3),
        random_arcs(1, 3),
        condition(),
    );
    let steps = proptest::collection::vec(step, 1..5);
    (places, steps).prop_map(|((a, b, c, d), steps)| {
        let transitions = steps.into_iter().enumerate();
        let transitions =
            transitions.map(|(index, (takes, gives, inhibitors, enablers, condition))| {
                NetTransition {
                    name: format!("t{index}"),
                    takes,
                    gives,
                    inhibitors,
                    enablers,
                    condition,
                    ..NetTransition::default()
                }
            });
        Net::new("random", vec![a, b, c, d], transitions.collect()).expect("a net")
    })
}

fn holds(condition: &Condition, last: &[bool], now: &[bool]) -> bool {
    match condition {
        Condition::Always => true,
        Condition::Signal(name, when) => {
            let input: usize = name[1..].parse().expect("a number");
            match when {
                When::Rising => now[input] && !last[input],
                When::Falling => !now[input] && last[input],
                When::High | When::Pulse => now[input],
                When::Low => !now[input],
            }
        }
        Condition::All(parts) => parts.iter().all(|part| holds(part, last, now)),
        Condition::Any(parts) => parts.iter().any(|part| holds(part, last, now)),
    }
}

/// Runs the ladder of a net; what fires in a scan must be able to fire in the net, one after the other as the rungs stand,
/// and what could have fired and was not held back by a token that came in this scan must have fired.
fn follow(net: &Net, samples: &[[bool; 3]]) -> Result<(), TestCaseError> {
    let ladder = to_ladder(net, &[], 10_000).expect("a bounded net");
    let mut run = Interpreter::new(&ladder.program, Duration::from_millis(10)).expect("a ladder");
    let names: Vec<String> =
        ladder.program.inputs.iter().map(|signal| signal.name.to_string()).collect();
    let mut marking = net.initial();
    let mut last = [false; 3];
    let mut counted: HashSet<usize> = HashSet::new();
    for (scan, now) in samples.iter().enumerate() {
        let inputs: Vec<bool> =
            names.iter().map(|name| now[name[1..].parse::<usize>().expect("a number")]).collect();
        run.scan(&inputs);
        let mut come: HashSet<usize> = HashSet::new();
        let mut moved: HashSet<usize> = HashSet::new();
        let is_counter = |place: usize| ladder.places[place].is_empty();
        for (transition, bit) in net.transitions().iter().zip(&ladder.fires) {
            let allowed = net.fire(&marking, transition);
            let condition = holds(&transition.condition, &last, now);
            let touched = || transition.takes.iter().chain(&transition.gives).map(|arc| arc.place);
            let read =
                || transition.inhibitors.iter().chain(&transition.enablers).map(|arc| arc.place);
            if run.value(bit).expect("a bit") {
                let next = allowed.filter(|_| condition);
                prop_assert!(
                    next.is_some(),
                    "{} fires\n{}",
                    transition.name,
                    understudy_ladder::print(&ladder.program)
                );
                marking = next.expect("it can fire");
                come.extend(transition.gives.iter().map(|arc| arc.place));
                moved.extend(touched());
            } else if allowed.is_some() && condition {
                let held = transition.takes.iter().any(|arc| come.contains(&arc.place))
                    || touched().chain(read()).any(|place| {
                        is_counter(place)
                            && (moved.contains(&place) || counted.contains(&place) || scan == 0)
                    });
                prop_assert!(
                    held,
                    "{} does not fire\n{}",
                    transition.name,
                    understudy_ladder::print(&ladder.program)
                );
            }
        }
        for (place, bits) in ladder.places.iter().enumerate() {
            for (count, bit) in (1..).zip(bits) {
                prop_assert_eq!(run.value(bit), Some(marking[place] >= count));
            }
        }
        for (place, content) in net.places().iter().enumerate() {
            for action in &content.actions {
                let (signal, expected) = match action {
                    Action::Level(signal) => (signal, marking[place] > 0),
                    Action::Impulse(signal) => (signal, come.contains(&place)),
                };
                prop_assert_eq!(
                    run.value(signal),
                    Some(expected),
                    "{}\n{}",
                    signal,
                    understudy_ladder::print(&ladder.program)
                );
            }
        }
        counted = moved;
        last = *now;
    }
    Ok(())
}

fn settings() -> ProptestConfig {
    ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(settings())]

    #[test]
    fn what_is_written_is_read_again(net in net(3)) {
        let file = NetFile { net, events: Alphabet::default(), addresses: Vec::new() };
        let text = write_net(&file);
        let read = read_net(&text);
        prop_assert_eq!(&read.diagnostics, &[]);
        let again = read.file.expect("right");
        prop_assert_eq!(again.net.places(), file.net.places());
        prop_assert_eq!(write_net(&again), text);
    }

    #[test]
    fn buffers_in_step_are_the_net(net in net(2)) {
        let exploration = net.explore(10_000).expect("bounded by its capacities");
        let buffers = buffers(&net, &exploration.bounds()).expect("every transition is an event");
        let buffers: Vec<_> = buffers.iter().collect();
        let product = sync(&buffers, Bounds::default()).expect("it fits");
        let automaton = exploration.automaton().expect("every transition is an event");
        let touched = net.transitions().iter().all(|transition| {
            !(transition.takes.is_empty() && transition.gives.is_empty()
                && transition.inhibitors.is_empty() && transition.enablers.is_empty())
        });
        // A transition without any arc is in no buffer.
        prop_assume!(touched);
        prop_assert!(isomorph(&product, &automaton).is_ok(), "{product:?}\n{automaton:?}");
    }

    #[test]
    fn ladders_pass_tokens_like_the_net(
        net in net(2),
        samples in proptest::collection::vec(any::<[bool; 3]>(), 1..40),
    ) {
        follow(&net, &samples)?;
    }

    /// Single tokens, so that places that hold several become counters.
    #[test]
    fn ladders_count_tokens_like_the_net(
        net in net(1),
        samples in proptest::collection::vec(any::<[bool; 3]>(), 1..40),
    ) {
        follow(&net, &samples)?;
    }
}

/// The same net, every transition a command that a supervisor of up to three states knows, and delays where no edge is waited
/// for.
fn supervised(net: Net, delayed: &[bool], targets: &[Option<u32>]) -> (Net, Automaton) {
    let mut transitions = net.transitions().to_vec();
    for (number, transition) in transitions.iter_mut().enumerate() {
        transition.label = Some(Label::new(2 * number as u32 + 1));
        let waits = Some(Duration::from_millis(20)).filter(|_| delayed[number]);
        let late = NetTransition { delay: waits, ..transition.clone() };
        // A condition on an edge takes no delay.
        if Net::new("one", net.places().to_vec(), vec![late.clone()]).is_ok() {
            *transition = late;
        }
    }
    let labels = transitions.iter().filter_map(|transition| transition.label);
    let events: Vec<Event> = labels.map(Event::unnamed).collect();
    let steps = (0..3).flat_map(|state| events.iter().map(move |event| (state, event.label)));
    let steps = steps.zip(targets).filter_map(|((source, label), target)| {
        Some(Transition { source: State::new(source), label, target: State::new((*target)?) })
    });
    let supervisor = Automaton::new("keeper", events.clone(), vec![true; 3], steps.collect());
    let net = Net::new(net.name(), net.places().to_vec(), transitions).expect("a net");
    (net, supervisor.expect("deterministic"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..settings() })]

    #[test]
    fn ladders_of_nets_are_proved(
        net in prop_oneof![net(1), net(2)],
        delayed in any::<[bool; 4]>(),
        targets in proptest::array::uniform12(proptest::option::weighted(0.7, 0..3_u32)),
        is_supervised in any::<bool>(),
    ) {
        let (net, keeper) = supervised(net, &delayed, &targets);
        let keepers = if is_supervised { vec![keeper] } else { Vec::new() };
        let ladder = to_ladder(&net, &keepers, 10_000).expect("a bounded net");
        let settings = ProofSettings { maximum_states: 3_000, ..ProofSettings::default() };
        match prove_hybrid(&net, &keepers, &ladder, settings) {
            Ok(HybridVerdict::Proved(proof)) => prop_assert!(proof.markings > 0),
            Ok(HybridVerdict::Refuted(found)) => {
                let printed = understudy_ladder::print(&ladder.program);
                return Err(TestCaseError::fail(format!("{found}{printed}")));
            }
            Err(error) => prop_assert_eq!(error.code(), "U0874"),
        }
    }
}

/// Figure 3: the token is reserved for the delay while the condition holds, and the delay begins anew at the next token.
#[test]
fn a_delay_holds_its_token() {
    let mut moves = transition("move", &[(0, 1)], &[(1, 1)]);
    moves.condition = Condition::Signal(Name::from("u0"), When::High);
    moves.delay = Some(Duration::from_millis(30));
    let back = transition("back", &[(1, 1)], &[(0, 1)]);
    let net = Net::new("delay", vec![place("p1", 1), place("p2", 0)], vec![moves, back]).unwrap();
    let ladder = to_ladder(&net, &[], 100).unwrap();
    let mut run = Interpreter::new(&ladder.program, Duration::from_millis(10)).unwrap();
    let mut scans = String::new();
    for input in "1101111111111111".chars() {
        run.scan(&[input == '1']);
        scans.push(if run.value("move").unwrap() { 'f' } else { '.' });
    }
    insta::assert_snapshot!(scans, @"......f....f....");
}
