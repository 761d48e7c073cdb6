use crate::alphabet::Label;
use crate::automaton::{Automaton, State};
use crate::explicit::{
    Bounds, Joint, Predecessors, Product, TooLarge, breadth_first_word, coreachable,
};

/// A way into a place from which not all can come to their marked states together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Conflict {
    /// A shortest sequence of events that leads there.
    pub word: Vec<Label>,
    /// The state of each automaton there.
    pub states: Vec<State>,
}

/// `nonconflict` of any number of automata: whether from everything that they reach together a state can be reached in which all
/// are marked. One automaton alone is asked whether it is nonblocking. For automata over one alphabet it is TCT's.
///
/// # Errors
/// The product passes the bounds.
pub fn nonconflict(automata: &[&Automaton], bounds: Bounds) -> Result<Option<Conflict>, TooLarge> {
    let product = Product::explore(automata, &[], Joint::Synchronous, bounds)?;
    let controllable: Vec<bool> = product.alphabet.labels().map(Label::is_controllable).collect();
    let predecessors = Predecessors::new(&product.first, &product.edges, &controllable);
    let all = vec![true; product.state_count()];
    let live = coreachable(&predecessors, &product.marked, &all);
    let found = breadth_first_word(&product, |state| !live[state], |_| true);
    Ok(found.map(|(word, state)| Conflict {
        word,
        states: (0..automata.len())
            .map(|component| product.component_state(state, component))
            .collect(),
    }))
}
