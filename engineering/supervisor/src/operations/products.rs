use crate::automaton::{Automaton, State};
use crate::explicit::{Bounds, Joint, Product, TooLarge, restrict};

/// `sync` of any number of automata: an event happens when all that know it allow it. What is reached, marked where all are.
///
/// TCT makes it two at a time and forgets an event that two of them block together; here the alphabet keeps it, see
/// [`Automaton::blocked_events`]. Of none it is the automaton that forbids nothing, for it knows no event.
///
/// # Errors
/// The product passes the bounds.
pub fn sync(automata: &[&Automaton], bounds: Bounds) -> Result<Automaton, TooLarge> {
    product(automata, Joint::Synchronous, bounds)
}

/// `meet` of any number of automata: an event happens when all know it and allow it.
///
/// # Errors
/// The product passes the bounds.
pub fn meet(automata: &[&Automaton], bounds: Bounds) -> Result<Automaton, TooLarge> {
    product(automata, Joint::Meet, bounds)
}

fn product(automata: &[&Automaton], joint: Joint, bounds: Bounds) -> Result<Automaton, TooLarge> {
    let explored = Product::explore(automata, &[], joint, bounds)?;
    let names = state_names(&explored, automata);
    let automaton = explored.into_automaton(joined_name(automata));
    Ok(match names {
        Some(names) => automaton.named_states(names),
        None => automaton,
    })
}

/// `mutex`: the sync of two automata without the pairs of states in `excluded`, as far as it is still reached.
///
/// # Errors
/// The product passes the bounds.
pub fn mutex(
    left: &Automaton,
    right: &Automaton,
    excluded: &[(State, State)],
    bounds: Bounds,
) -> Result<Automaton, TooLarge> {
    let both = [left, right];
    let product = Product::explore(&both, &[], Joint::Synchronous, bounds)?;
    let keep: Vec<bool> = (0..product.state_count())
        .map(|state| {
            let pair = (product.component_state(state, 0), product.component_state(state, 1));
            !excluded.contains(&pair)
        })
        .collect();
    let names = state_names(&product, &both);
    let automaton = product.into_automaton(joined_name(&both));
    let automaton = match names {
        Some(names) => automaton.named_states(names),
        None => automaton,
    };
    let name = automaton.name().to_owned();
    Ok(restrict(&automaton, name, &keep).0)
}

/// Maximum number of listed names.
const NAMED_STATES: usize = 20_000;

/// The names of the components' states side by side, where all components have names for them.
pub(super) fn state_names(product: &Product, parts: &[&Automaton]) -> Option<Vec<String>> {
    let named = parts.iter().all(|part| part.state_names().is_some());
    if !named || product.state_count() > NAMED_STATES {
        return None;
    }
    let name = |state: usize| {
        let locals = parts.iter().enumerate();
        let locals: Vec<_> = locals
            .map(|(number, part)| part.state_name(product.component_state(state, number)))
            .collect();
        locals.join(",")
    };
    Some((0..product.state_count()).map(name).collect())
}

pub(super) fn joined_name(parts: &[&Automaton]) -> String {
    let names: Vec<&str> = parts.iter().map(|part| part.name()).collect();
    names.join("||")
}
