//! Every operation against its definition, spelled out on tuples and words without any array.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use proptest::prelude::*;
use understudy_supervisor::operations::{
    Explanation, Violation, allevents, condat, isomorph, lift, meet, minstate, mutex, nonconflict,
    project, selfloop, supcon, supreduce, sync, trim,
};
use understudy_supervisor::{
    Automaton, Bounds, Event, Label, State, SymbolicBounds, Transition, draw_automaton_svg,
    read_ads, synthesise, synthesise_symbolically, write_ads,
};

const EVENTS: u32 = 5;

fn automaton(labels: Vec<u32>) -> impl Strategy<Value = Automaton> {
    sized(labels, 1..5)
}

/// An automaton with transitions of `labels`, and a number of states in `states`.
pub(crate) fn sized(labels: Vec<u32>, states: Range<u32>) -> impl Strategy<Value = Automaton> {
    states.prop_flat_map(move |states| {
        let labels = labels.clone();
        let cells = states as usize * labels.len();
        let target = proptest::option::weighted(0.6, 0..states);
        let targets = proptest::collection::vec(target, cells);
        let marked = proptest::collection::vec(any::<bool>(), states as usize);
        (targets, marked).prop_map(move |(targets, marked)| {
            let transitions = targets.iter().enumerate().filter_map(|(cell, target)| {
                let (source, event) = (cell / labels.len(), cell % labels.len());
                Some(Transition {
                    source: State::new(source as u32),
                    label: Label::new(labels[event]),
                    target: State::new((*target)?),
                })
            });
            let events = labels.iter().map(|&label| Event::unnamed(Label::new(label)));
            Automaton::new("A", events, marked, transitions.collect()).expect("deterministic")
        })
    })
}

fn full() -> impl Strategy<Value = Automaton> {
    automaton((0..EVENTS).collect())
}

fn some_events() -> impl Strategy<Value = Automaton> {
    proptest::sample::subsequence((0..EVENTS).collect::<Vec<_>>(), 1..=EVENTS as usize)
        .prop_flat_map(automaton)
}

type Tuple = Vec<State>;

/// The sync of `parts`, tuple by tuple.
struct Naive<'a>(&'a [&'a Automaton]);

impl Naive<'_> {
    fn next(&self, tuple: &Tuple, label: Label) -> Option<Tuple> {
        let moved = self.0.iter().zip(tuple).map(|(part, &state)| {
            if part.alphabet().contains(label) { part.step(state, label) } else { Some(state) }
        });
        moved.collect()
    }

    fn labels(&self) -> BTreeSet<Label> {
        self.0.iter().flat_map(|part| part.alphabet().labels()).collect()
    }

    fn marked(&self, tuple: &Tuple) -> bool {
        self.0.iter().zip(tuple).all(|(part, &state)| part.is_marked(state))
    }

    fn reached(&self, good: impl Fn(&Tuple) -> bool) -> BTreeSet<Tuple> {
        let initial = vec![State::INITIAL; self.0.len()];
        let mut reached = BTreeSet::new();
        let mut pending = vec![initial];
        while let Some(tuple) = pending.pop() {
            if good(&tuple) && reached.insert(tuple.clone()) {
                pending
                    .extend(self.labels().into_iter().filter_map(|label| self.next(&tuple, label)));
            }
        }
        reached
    }

    fn live(&self, within: &BTreeSet<Tuple>) -> BTreeSet<Tuple> {
        let mut live: BTreeSet<Tuple> =
            within.iter().filter(|tuple| self.marked(tuple)).cloned().collect();
        loop {
            let more: Vec<Tuple> = within
                .iter()
                .filter(|tuple| !live.contains(*tuple))
                .filter(|tuple| {
                    self.labels().iter().any(|&label| {
                        self.next(tuple, label).is_some_and(|next| live.contains(&next))
                    })
                })
                .cloned()
                .collect();
            if more.is_empty() {
                return live;
            }
            live.extend(more);
        }
    }

    /// Ramadge and Wonham's fixed point, one state at a time; the first `plants` parts are the plant.
    fn supcon(&self, plants: usize) -> BTreeSet<Tuple> {
        let plant = Naive(&self.0[..plants]);
        let mut good = self.reached(|_| true);
        loop {
            let live = self.live(&good);
            let bad: Vec<Tuple> = good
                .iter()
                .filter(|tuple| {
                    let escapes = |label: Label| {
                        let possible = plant.next(&tuple[..plants].to_vec(), label).is_some();
                        possible
                            && !self.next(tuple, label).is_some_and(|next| good.contains(&next))
                    };
                    let mut uncontrollable =
                        self.labels().into_iter().filter(|label| !label.is_controllable());
                    !live.contains(*tuple) || uncontrollable.any(escapes)
                })
                .cloned()
                .collect();
            if bad.is_empty() {
                return self.reached(|tuple| good.contains(tuple));
            }
            for tuple in &bad {
                good.remove(tuple);
            }
        }
    }

    fn listed(&self, states: &BTreeSet<Tuple>) -> Automaton {
        let initial = vec![State::INITIAL; self.0.len()];
        let mut order: Vec<&Tuple> = states.iter().collect();
        order.sort_by_key(|tuple| **tuple != initial);
        let numbers: BTreeMap<&Tuple, u32> = order.iter().copied().zip(0..).collect();
        let mut transitions = Vec::new();
        for (tuple, &number) in &numbers {
            for label in self.labels() {
                let target = self.next(tuple, label);
                if let Some(&target) = target.as_ref().and_then(|target| numbers.get(target)) {
                    transitions.push(Transition {
                        source: State::new(number),
                        label,
                        target: State::new(target),
                    });
                }
            }
        }
        let events = self.labels().into_iter().map(Event::unnamed);
        let marked = order.iter().map(|tuple| self.marked(tuple)).collect();
        Automaton::new("N", events, marked, transitions).expect("deterministic")
    }
}

/// Whether two automata have the same closed and marked languages, by words up to a length that tells them apart.
pub(crate) fn same_languages(left: &Automaton, right: &Automaton) -> bool {
    let labels: Vec<Label> = left.alphabet().labels().chain(right.alphabet().labels()).collect();
    let mut pairs = BTreeSet::new();
    let mut pending = vec![(left.initial(), right.initial())];
    while let Some(pair) = pending.pop() {
        match pair {
            (None, None) => {}
            (Some(one), Some(two)) if left.is_marked(one) == right.is_marked(two) => {
                if pairs.insert((one, two)) {
                    pending.extend(
                        labels.iter().map(|&label| (left.step(one, label), right.step(two, label))),
                    );
                }
            }
            _ => return false,
        }
    }
    true
}

fn is_isomorphic(left: &Automaton, right: &Automaton) -> bool {
    isomorph(left, right).is_ok()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn products_are_what_their_definitions_say(left in some_events(), right in some_events(), third in some_events()) {
        let bounds = Bounds::default();
        let parts = [&left, &right, &third];
        let naive = Naive(&parts);
        let expected = naive.listed(&naive.reached(|_| true));
        prop_assert!(is_isomorphic(&sync(&parts, bounds).unwrap(), &expected));
        // A meet is a sync in which all know all events.
        let alphabet = left.alphabet().union([right.alphabet(), third.alphabet()]);
        let knowing = parts.map(|part| {
            let events = alphabet.events().iter().cloned();
            let marked = part.states().map(|state| part.is_marked(state)).collect();
            Automaton::new("K", events, marked, part.transitions().collect()).unwrap()
        });
        let knowing = knowing.each_ref();
        prop_assert!(is_isomorphic(&meet(&parts, bounds).unwrap(), &sync(&knowing, bounds).unwrap()));
        // A lifted automaton restrains what it did before, and sync with ALLEVENTS lifts too.
        let lifted = lift(&left, &alphabet);
        prop_assert!(is_isomorphic(&trim(&lifted), &trim(&sync(&[&left, &allevents(&alphabet)], bounds).unwrap())));
        let unknown: Vec<Event> = alphabet.events().iter().filter(|event| !left.alphabet().contains(event.label)).cloned().collect();
        prop_assert_eq!(selfloop(&left, &unknown).unwrap(), lifted);
    }

    #[test]
    fn supervisors_are_those_of_the_naive_fixed_point(plants in proptest::collection::vec(some_events(), 1..3), specifications in proptest::collection::vec(some_events(), 0..3)) {
        let bounds = Bounds::default();
        let plants: Vec<&Automaton> = plants.iter().collect();
        let specifications: Vec<&Automaton> = specifications.iter().collect();
        let parts: Vec<&Automaton> = plants.iter().chain(&specifications).copied().collect();
        // An uncontrollable event that only a specification knows is the plant's as well: it is no plant's business.
        let naive = Naive(&parts);
        let expected = naive.listed(&naive.supcon(plants.len()));
        let explicit = synthesise(&plants, &specifications, bounds).unwrap();
        prop_assert!(is_isomorphic(&explicit.supervisor, &expected));
        prop_assert_eq!(explicit.explanation.is_some(), expected.is_empty());
        let symbolic = synthesise_symbolically(&plants, &specifications, SymbolicBounds::default()).unwrap();
        prop_assert!(is_isomorphic(&symbolic.to_automaton(bounds).unwrap(), &expected));
        prop_assert_eq!(symbolic.state_count(), Some(expected.state_count() as u128));
        prop_assert_eq!(symbolic.transition_count(), Ok(Some(expected.transition_count() as u128)));
        prop_assert_eq!(nonconflict(&[&explicit.supervisor], bounds), Ok(None));
        let why = symbolic.explanation(plants.len()).unwrap();
        prop_assert_eq!(why.is_some(), expected.is_empty());
        let length = |why: &Option<Explanation>| match why {
            Some(Explanation::Violated(violation)) => violation.word.len(),
            Some(Explanation::Blocked { word, .. }) => word.len(),
            Some(Explanation::EmptyPart { .. }) | None => 0,
        };
        // The explicit engine counts as blocked what is reached through places that are not good, too.
        prop_assert!(length(&explicit.explanation) <= length(&why));
        if let Some(Explanation::Violated(Violation { word, event, specification })) = why {
            let mut states = vec![State::INITIAL; parts.len()];
            for label in word {
                prop_assert!(!label.is_controllable());
                states = naive.next(&states, label).expect("it is possible");
            }
            let allows = |place: usize| {
                !parts[place].alphabet().contains(event) || parts[place].step(states[place], event).is_some()
            };
            prop_assert!((0..plants.len()).all(allows) && !allows(plants.len() + specification));
        }
    }

    #[test]
    fn a_reduced_supervisor_has_the_same_effect(plant in full(), specification in full()) {
        let bounds = Bounds::default();
        let supervisor = supcon(&plant, &specification, bounds).unwrap().supervisor;
        let reduced = supreduce(&plant, &supervisor, bounds).unwrap();
        prop_assert!(reduced.state_count() <= supervisor.state_count());
        let under = |supervisor| meet(&[&plant, supervisor], bounds).unwrap();
        prop_assert!(same_languages(&under(&reduced), &under(&supervisor)));
        // What is disabled is possible in the plant and not in the supervisor.
        let data = condat(&plant, &supervisor, bounds).unwrap();
        prop_assert!(data.uncontrollable.is_empty());
        for (&state, events) in &data.table {
            prop_assert!(events.iter().all(|&event| event.is_controllable() && supervisor.step(state, event).is_none()));
        }
    }

    #[test]
    fn the_fewest_states_have_the_same_languages(automaton in full()) {
        let minimal = minstate(&automaton);
        prop_assert!(same_languages(&automaton, &minimal));
        // In a minimal automaton every two states are told apart by some word.
        for one in minimal.states() {
            for two in minimal.states().filter(|&two| two > one) {
                let from = |state: State| {
                    let swap = |other: State| if other == state { State::INITIAL } else if other == State::INITIAL { state } else { other };
                    let transitions = minimal.transitions().map(|transition| Transition { source: swap(transition.source), label: transition.label, target: swap(transition.target) });
                    let mut marked: Vec<bool> = minimal.states().map(|state| minimal.is_marked(state)).collect();
                    marked.swap(0, state.index());
                    Automaton::new("F", [], marked, transitions.collect()).unwrap()
                };
                prop_assert!(!same_languages(&from(one), &from(two)));
            }
        }
    }

    #[test]
    fn a_projection_is_what_is_seen(automaton in full(), hidden in proptest::sample::subsequence((0..EVENTS).collect::<Vec<_>>(), 0..EVENTS as usize), word in proptest::collection::vec(0..EVENTS, 0..8)) {
        let hidden: Vec<Label> = hidden.into_iter().map(Label::new).collect();
        let seen = project(&automaton, &hidden, Bounds::default()).unwrap();
        prop_assert!(is_isomorphic(&minstate(&seen), &seen));
        // The states in which the automaton may be after what is seen of some word.
        let mut sets = BTreeSet::from([State::INITIAL]);
        let silent = |sets: &BTreeSet<State>| {
            let mut all = sets.clone();
            for _ in automaton.states() {
                let more: Vec<State> = all.iter().flat_map(|&state| hidden.iter().filter_map(move |&label| (state, label).into()).filter_map(|(state, label): (State, Label)| automaton.step(state, label))).collect();
                all.extend(more);
            }
            all
        };
        let mut state = seen.initial();
        sets = silent(&sets);
        for label in word.into_iter().map(Label::new).filter(|label| !hidden.contains(label)) {
            sets = silent(&sets.iter().filter_map(|&state| automaton.step(state, label)).collect());
            state = state.and_then(|state| seen.step(state, label));
            prop_assert_eq!(state.is_none(), sets.is_empty());
        }
        if let Some(state) = state {
            prop_assert_eq!(seen.is_marked(state), sets.iter().any(|&state| automaton.is_marked(state)));
        }
    }

    #[test]
    fn an_automaton_survives_its_file_and_any_numbering(automaton in full(), word in proptest::collection::vec(0..EVENTS, 0..8)) {
        let read = read_ads(&write_ads(&automaton, &[]).unwrap()).automaton.unwrap();
        let word: Vec<Label> = word.into_iter().map(Label::new).collect();
        prop_assert_eq!(read.run(&word), automaton.run(&word));
        let picture = draw_automaton_svg(&automaton).unwrap();
        prop_assert_eq!(picture.matches("<ellipse").count(), automaton.state_count() + automaton.marked().count());
        let excluded = mutex(&automaton, &automaton, &[], Bounds::default()).unwrap();
        prop_assert!(same_languages(&excluded, &automaton));
        let none = mutex(&automaton, &automaton, &[(State::INITIAL, State::INITIAL)], Bounds::default()).unwrap();
        prop_assert!(none.is_empty());
    }

    #[test]
    fn no_text_breaks_a_reader(text in "[ \\n\\t#*0-9a-zSMVT:]{0,80}", model in "[ \\n\\[\\]{}=\",a-z0-9.]{0,80}") {
        read_ads(&text);
        read_ads(&format!("A\nState size:\n3\nMarker states:\n0\nTransitions:\n{text}"));
        understudy_supervisor::read_model(&model, |_| Ok(text.clone()));
        understudy_supervisor::read_model(&format!("[events]\na = {{ controllable = true }}\n[[plant]]\n{model}"), |_| Ok(text.clone()));
    }
}
