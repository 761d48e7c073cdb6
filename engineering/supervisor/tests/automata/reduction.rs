//! Supervisor reduction against the same greedy merges without any of their shortcuts, and on large plants.

use std::collections::BTreeSet;

use proptest::prelude::*;
use understudy_supervisor::operations::{
    compare_effects, fewest_states, isomorph, meet, supreduce, supreduce_while, sync,
};
use understudy_supervisor::{Automaton, Bounds, Label, State, Transition, synthesise};

use crate::families::workshop;
use crate::properties::{same_languages, sized};

/// A partition of the states: the smallest state of each state's cell.
type Partition = Vec<usize>;

struct Naive<'a> {
    supervisor: &'a Automaton,
    /// Pairs of states of which one enables, or marks, what the other disables where the plant may do it.
    clashes: BTreeSet<(usize, usize)>,
}

impl<'a> Naive<'a> {
    fn new(plant: &Automaton, supervisor: &'a Automaton) -> Self {
        let mut reached = BTreeSet::new();
        let mut pending = vec![(State::INITIAL, State::INITIAL)];
        while let Some((at, state)) = pending.pop() {
            if reached.insert((at, state)) {
                let steps = plant.edges(at).iter().filter_map(|&edge| {
                    Some((edge.target, supervisor.step(state, plant.label(edge))?))
                });
                pending.extend(steps);
            }
        }
        let mut enables = BTreeSet::new();
        let mut disables = BTreeSet::new();
        for state in supervisor.states() {
            for &edge in supervisor.edges(state) {
                enables.insert((state.index(), Some(supervisor.label(edge))));
            }
        }
        for &(at, state) in &reached {
            for &edge in plant.edges(at) {
                let label = plant.label(edge);
                if supervisor.step(state, label).is_none() {
                    disables.insert((state.index(), Some(label)));
                }
            }
            if plant.is_marked(at) {
                let asked = if supervisor.is_marked(state) { &mut enables } else { &mut disables };
                asked.insert((state.index(), None::<Label>));
            }
        }
        let pairs = enables.iter().flat_map(|(one, what)| {
            let against = disables.iter().filter(move |(_, other)| other == what);
            against.map(move |(other, _)| (*one.min(other), *one.max(other)))
        });
        Self { supervisor, clashes: pairs.collect() }
    }

    /// The finest coarser partition in which `left` and `right` are together and events are deterministic; nothing where states clash.
    fn merged(&self, partition: &Partition, left: usize, right: usize) -> Option<Partition> {
        let mut partition = partition.clone();
        let mut join = Some((left, right));
        while let Some((left, right)) = join {
            let (kept, gone) =
                (partition[left].min(partition[right]), partition[left].max(partition[right]));
            for cell in &mut partition {
                if *cell == gone {
                    *cell = kept;
                }
            }
            let transitions: Vec<Transition> = self.supervisor.transitions().collect();
            let split = transitions
                .iter()
                .flat_map(|one| transitions.iter().map(move |other| (one, other)))
                .find(|(one, other)| {
                    one.label == other.label
                        && partition[one.source.index()] == partition[other.source.index()]
                        && partition[one.target.index()] != partition[other.target.index()]
                });
            join = split.map(|(one, other)| (one.target.index(), other.target.index()));
        }
        let clash = self.clashes.iter().any(|&(one, other)| partition[one] == partition[other]);
        (!clash).then_some(partition)
    }

    fn reduced(&self, order: &[usize]) -> Automaton {
        let mut partition: Partition = (0..self.supervisor.state_count()).collect();
        for (place, &state) in order.iter().enumerate() {
            if partition[state] != state {
                continue;
            }
            for &other in &order[place + 1..] {
                if partition[other] == other
                    && let Some(coarser) = self.merged(&partition, state, other)
                {
                    partition = coarser;
                }
            }
        }
        let mut cells = partition.clone();
        cells.sort_unstable();
        cells.dedup();
        let number =
            |state: State| cells.binary_search(&partition[state.index()]).expect("a cell") as u32;
        let transitions = self.supervisor.transitions().map(|transition| Transition {
            source: State::new(number(transition.source)),
            label: transition.label,
            target: State::new(number(transition.target)),
        });
        let mut marked = vec![false; cells.len()];
        for state in self.supervisor.marked() {
            marked[number(state) as usize] = true;
        }
        let events = self.supervisor.alphabet().events().iter().cloned();
        Automaton::new("N", events, marked, transitions.collect()).expect("deterministic")
    }
}

fn depth_first(supervisor: &Automaton, state: State, order: &mut Vec<usize>) {
    if !order.contains(&state.index()) {
        order.push(state.index());
        for edge in supervisor.edges(state) {
            depth_first(supervisor, edge.target, order);
        }
    }
}

fn size(automaton: &Automaton) -> (usize, usize) {
    (automaton.state_count(), automaton.transition_count())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn shortcuts_do_not_change_a_reduction(plant in sized((0..4).collect(), 1..5), specification in sized((0..4).collect(), 1..5)) {
        let bounds = Bounds::default();
        // The reduction does not ask whether the events that are disabled are controllable.
        let supervisor = meet(&[&plant, &specification], bounds).unwrap();
        let naive = Naive::new(&plant, &supervisor);
        let mut deep = Vec::new();
        depth_first(&supervisor, State::INITIAL, &mut deep);
        let ascending: Vec<usize> = (0..supervisor.state_count()).collect();
        let (first, second) = (naive.reduced(&ascending), naive.reduced(&deep));
        let expected = if size(&second) < size(&first) { second } else { first };
        let reduced = supreduce(&plant, &supervisor, bounds).unwrap();
        prop_assert_eq!(size(&reduced), size(&expected));
        prop_assert!(isomorph(&reduced, &expected).is_ok());
        prop_assert_eq!(compare_effects(&plant, &supervisor, &reduced, bounds), Ok(None));
    }

    #[test]
    fn effects_differ_where_the_products_do(plant in sized((0..3).collect(), 1..5), left in sized((0..3).collect(), 1..5), right in sized((0..3).collect(), 1..5)) {
        let bounds = Bounds::default();
        let under = |supervisor| meet(&[&plant, supervisor], bounds).unwrap();
        let (one, other) = (under(&left), under(&right));
        let found = compare_effects(&plant, &left, &right, bounds).unwrap();
        prop_assert_eq!(found.is_none(), same_languages(&one, &other));
        if let Some(difference) = found {
            let (one_at, other_at) = (one.run(&difference.word).unwrap(), other.run(&difference.word).unwrap());
            match difference.event {
                Some(event) => prop_assert!(one.step(one_at, event).is_some() != other.step(other_at, event).is_some()),
                None => prop_assert!(one.is_marked(one_at) != other.is_marked(other_at)),
            }
        }
    }
}

/// 12,807 states and 39 events; the size is that of the reduction without shortcuts.
#[test]
fn a_large_supervisor_is_reduced() {
    let bounds = Bounds::default();
    let (plants, specifications) = workshop(3, 4, 1);
    let plants: Vec<&Automaton> = plants.iter().collect();
    let specifications: Vec<&Automaton> = specifications.iter().collect();
    let supervisor = synthesise(&plants, &specifications, bounds).expect("it fits").supervisor;
    let plant = sync(&plants, bounds).expect("it fits");
    assert_eq!(size(&supervisor), (12_807, 55_825));
    let made = supreduce_while(&plant, &supervisor, bounds, &mut |_| true).expect("it fits");
    assert!(made.is_complete);
    assert_eq!(size(&made.supervisor), (1_300, 20_398));
    assert_eq!(compare_effects(&plant, &supervisor, &made.supervisor, bounds), Ok(None));
    let little = Bounds { memory_bytes: 100_000 };
    assert!(compare_effects(&plant, &supervisor, &made.supervisor, little).is_err());
    assert!(supreduce(&plant, &supervisor, little).is_err());
    let mut asked = 0;
    let stopped = supreduce_while(&plant, &supervisor, bounds, &mut |_| {
        asked += 1;
        asked < 3
    });
    let stopped = stopped.expect("it fits");
    assert!(!stopped.is_complete && stopped.supervisor.state_count() < supervisor.state_count());
    assert_eq!(compare_effects(&plant, &supervisor, &stopped.supervisor, bounds), Ok(None));
}

/// All automata of `states` states over the events 0 and 1.
fn all_of(states: u32) -> Vec<Automaton> {
    let cells = 2 * states;
    let tables = (states + 1).pow(cells);
    let of = |table: u32, marks: u32| {
        let steps = (0..cells).filter_map(|cell| {
            let target = (table / (states + 1).pow(cell) % (states + 1)).checked_sub(1)?;
            let (source, label) = (State::new(cell / 2), Label::new(cell % 2));
            Some(Transition { source, label, target: State::new(target) })
        });
        let marked = (0..states).map(|state| marks >> state & 1 == 1).collect();
        Automaton::new("small", [], marked, steps.collect()).expect("deterministic")
    };
    (0..tables).flat_map(|table| (0..1 << states).map(move |marks| of(table, marks))).collect()
}

/// No automaton with fewer states than the lower bound has the same effect; all of them are tried.
#[test]
fn no_supervisor_has_fewer_states_than_the_lower_bound() {
    let bounds = Bounds::default();
    let smaller = [all_of(1), all_of(2)];
    let plants = all_of(3);
    let mut reached = [0; 4];
    for (number, plant) in plants.iter().enumerate().step_by(977) {
        for specification in plants.iter().skip(number % 7).step_by(1_013) {
            let supervisor = meet(&[plant, specification], bounds).expect("small");
            let fewest = fewest_states(plant, &supervisor, bounds).expect("small");
            let found = supreduce(plant, &supervisor, bounds).expect("small").state_count();
            assert!(fewest <= found, "{fewest} of {found}");
            reached[fewest.min(3)] += 1;
            for small in smaller.iter().take(fewest.saturating_sub(1)).flatten() {
                let other = compare_effects(plant, &supervisor, small, bounds).expect("small");
                assert!(other.is_some(), "{} states of {fewest}", small.state_count());
            }
        }
    }
    assert!(reached[1..].iter().all(|&count| count > 0), "{reached:?}");
}

/// The published lower bound of the small factory, and that the reduction never passes a bound.
#[test]
fn lower_bounds_of_the_reference_models() {
    let bounds = Bounds::default();
    let mut said = Vec::new();
    for name in ["small_factory", "transfer_line", "guideway", "dining5", "line4_3", "agv"] {
        let model = crate::models::Model::read(name);
        let plant = sync(&model.plants(), bounds).expect("small");
        let (supervisor, of_tct) = (model.file("_SUPER"), model.file("_SIMSUP"));
        let fewest = fewest_states(&plant, &supervisor, bounds).expect("small");
        assert!(fewest <= of_tct.state_count(), "{name}");
        said.push(format!("{name} {fewest} of {}", of_tct.state_count()));
    }
    insta::assert_snapshot!(said.join("\n"));
}
