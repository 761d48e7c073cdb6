//! Observers and what projections keep.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use understudy_supervisor::operations::{
    abstraction, isomorph, minstate, nonconflict, observer, project, trim,
};
use understudy_supervisor::{Automaton, Bounds, Label, State, Transition};

fn automaton(states: usize, marked: &[u32], steps: &[(u32, u32, u32)]) -> Automaton {
    let marks = (0..states as u32).map(|state| marked.contains(&state));
    let steps = steps.iter().map(|&(source, label, target)| Transition {
        source: State::new(source),
        label: Label::new(label),
        target: State::new(target),
    });
    Automaton::new("G", [], marks.collect(), steps.collect()).expect("deterministic")
}

fn labels(numbers: &[u32]) -> Vec<Label> {
    numbers.iter().map(|&number| Label::new(number)).collect()
}

#[test]
fn an_observer_is_named_after_what_may_be() {
    // After 1 the automaton may or may not have done 2.
    let system = automaton(4, &[3], &[(0, 1, 1), (1, 2, 2), (1, 3, 0), (2, 3, 3)]);
    let made = observer(&system, &labels(&[2]), Bounds::default()).expect("it fits");
    let names: Vec<_> = made.states().map(|state| made.state_name(state).into_owned()).collect();
    assert_eq!(names, ["{0}", "{1,2}", "{0,3}"]);
    assert_eq!(made.marked().map(|state| state.number()).collect::<Vec<_>>(), [2]);
    let projected = project(&system, &labels(&[2]), Bounds::default()).expect("it fits");
    isomorph(&minstate(&made), &projected).expect("the same but for the states");
    let nothing = observer(&system, &[], Bounds::default()).expect("it fits");
    isomorph(&nothing, &system).expect("all is seen");
}

#[test]
fn each_property_fails_where_the_papers_say() {
    let check = |steps: &[(u32, u32, u32)], states: usize, expected: [bool; 3]| {
        let system = automaton(states, &(0..states as u32).collect::<Vec<_>>(), steps);
        let found = abstraction(&system, &labels(&[5, 6]), Bounds::default()).expect("it fits");
        let holds = [
            found.observer.is_none(),
            found.local_control.is_none(),
            found.output_control.is_none(),
        ];
        assert_eq!(holds, expected, "{steps:?}: {found:?}");
    };
    // A hidden event only delays.
    check(&[(0, 1, 1), (1, 6, 2), (2, 2, 0)], 3, [true, true, true]);
    // A hidden event decides which of two events comes.
    check(&[(0, 6, 1), (0, 1, 2), (1, 3, 2)], 3, [false, true, true]);
    // Only a hidden controllable event leads to the uncontrollable one.
    check(&[(0, 5, 1), (1, 2, 0)], 2, [true, false, false]);
    // It can come without the controllable one too.
    check(&[(0, 5, 1), (1, 2, 0), (0, 2, 0)], 2, [true, true, false]);
}

/// A random automaton over the labels `own`.
fn random(generator: &mut Pcg64, own: &[u32]) -> Automaton {
    let states = generator.random_range(1..6_u32);
    let mut steps = Vec::new();
    for source in 0..states {
        for &label in own {
            if generator.random_bool(0.4) {
                steps.push((source, label, generator.random_range(0..states)));
            }
        }
    }
    let marked: Vec<u32> = (0..states).filter(|_| generator.random_bool(0.4)).collect();
    trim(&automaton(states as usize, &marked, &steps))
}

/// Projections with the observer property show each conflict of automata that share only visible events, and are not larger than
/// their automata (Wong; Hill and Tilbury). Without the property they may not.
#[test]
fn with_the_observer_property_projections_conflict_where_their_automata_do() {
    let mut generator = Pcg64::seed_from_u64(34);
    let bounds = Bounds::default();
    let hidden = labels(&[5, 6, 7, 8]);
    let (mut holding, mut conflicts, mut hiding) = (0, 0, 0);
    for _ in 0..4000 {
        let parts = [[1, 2, 5, 6], [1, 2, 7, 8]].map(|own| random(&mut generator, &own));
        let projected =
            [0, 1].map(|part: usize| project(&parts[part], &hidden, bounds).expect("it fits"));
        let holds = [0, 1].map(|part: usize| {
            let found = abstraction(&parts[part], &hidden, bounds).expect("it fits");
            assert_eq!(found.trimmed, 0);
            if let Some(why) = &found.observer {
                assert!(parts[part].run(&why.word).is_some(), "{why:?}");
            } else {
                assert!(projected[part].state_count() <= parts[part].state_count());
            }
            found.observer.is_none()
        });
        let of = |parts: &[Automaton; 2]| {
            let parts: Vec<&Automaton> = parts.iter().collect();
            nonconflict(&parts, bounds).expect("it fits").is_some()
        };
        let (truth, seen) = (of(&parts), of(&projected));
        if holds == [true, true] {
            assert_eq!(truth, seen, "{parts:?}");
            holding += 1;
            conflicts += usize::from(truth);
        }
        hiding += usize::from(truth && !seen);
    }
    assert!(holding > 300 && conflicts > 20 && hiding > 0, "{holding} {conflicts} {hiding}");
}
