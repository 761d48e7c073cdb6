//! The symbolic engine against the explicit one, and against closed forms where no list would do.

use crate::families::{line, philosophers};
use crate::models::{MODELS, Model};
use understudy_supervisor::operations::isomorph;
use understudy_supervisor::{
    Automaton, Bounds, SymbolicBounds, synthesise, synthesise_symbolically,
};

fn check(name: &str, plants: &[&Automaton], specifications: &[&Automaton]) {
    let explicit = synthesise(plants, specifications, Bounds::default()).expect("it fits");
    let symbolic = synthesise_symbolically(plants, specifications, SymbolicBounds::default())
        .expect("it fits");
    let states = explicit.supervisor.state_count() as u128;
    assert_eq!(symbolic.state_count(), Some(states), "{name}: states");
    let transitions = explicit.supervisor.transition_count() as u128;
    assert_eq!(symbolic.transition_count(), Ok(Some(transitions)), "{name}: transitions");
    let listed = symbolic.to_automaton(Bounds::default()).expect("it fits");
    assert_eq!(isomorph(&listed, &explicit.supervisor).err(), None, "{name}");
}

#[test]
fn the_reference_models() {
    for name in MODELS {
        let model = Model::read(name);
        check(name, &model.plants(), &model.specifications());
    }
}

fn references(automata: &[Automaton]) -> Vec<&Automaton> {
    automata.iter().collect()
}

/// n machines in line with buffers of capacity c between them: the supervisor has 2 (2 c + 1)^(n - 1) states.
#[test]
fn lines_have_the_states_of_their_closed_form() {
    for (machines, capacity) in [(2, 1), (3, 2), (5, 3), (8, 4)] {
        let (plants, buffers) = line(machines, capacity);
        let supervisor = synthesise_symbolically(
            &references(&plants),
            &references(&buffers),
            SymbolicBounds::default(),
        );
        let states = supervisor.expect("it fits").state_count();
        let expected = 2 * (2 * u128::from(capacity) + 1).pow(machines - 1);
        assert_eq!(states, Some(expected), "line({machines}, {capacity})");
    }
}

/// Of n philosophers and their forks only the two deadlocks are taken away, and what leads there alone.
#[test]
fn philosophers_agree_with_the_explicit_engine() {
    for count in [2, 3, 5] {
        let automata = philosophers(count);
        check("philosophers", &references(&automata), &[]);
    }
}
