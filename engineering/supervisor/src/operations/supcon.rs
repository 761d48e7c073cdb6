use super::basic::{allevents, selfloop};
use super::products::{joined_name, state_names};
use crate::alphabet::{Alphabet, Event, Label};
use crate::automaton::{Automaton, State};
use crate::explicit::{
    Bounds, Joint, Predecessors, Product, TooLarge, breadth_first_word, coreachable, restrict,
};

/// A specification that forbids what the plant does without asking.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// A shortest sequence of events that leads there.
    pub word: Vec<Label>,
    /// The uncontrollable event that may follow and that the specification forbids.
    pub event: Label,
    /// Which of the specifications forbids it, counted from 0.
    pub specification: usize,
}

/// Why there is no supervisor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Explanation {
    /// One of the automata has no state.
    EmptyPart {
        /// Its name.
        name: String,
    },
    /// From the beginning, and by uncontrollable events alone, the plant gets to where a specification is violated.
    Violated(Violation),
    /// From the beginning, and by uncontrollable events alone, the plant gets to where no marked state can be reached any more.
    Blocked {
        /// A shortest sequence of uncontrollable events that leads there; empty where nothing marked can be reached at all.
        word: Vec<Label>,
        /// Where that is: the state of each plant and then of each specification.
        states: Vec<State>,
    },
}

/// The result of [`supcon`] and its like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Supcon {
    /// Trim recogniser of the supremal controllable sublanguage; EMPTY if that is empty.
    pub supervisor: Automaton,
    /// A nearest place where the specification as it was given is not controllable. The supervisor keeps away from it.
    pub violation: Option<Violation>,
    /// Why the supervisor is EMPTY, where it is.
    pub explanation: Option<Explanation>,
    /// Events of the plant outside of the alphabet of the specification, which the meet forbids.
    pub not_lifted: Vec<Label>,
    /// States of the product that were explored. The product may have more: behind a state in which a specification forbids what the
    /// plant does, nothing is explored.
    pub explored_states: usize,
}

impl Supcon {
    /// Whether nothing had to be forbidden beyond the specification, so that it is a supervisor as it was given.
    pub fn is_as_specified(&self) -> bool {
        self.explanation.is_none() && self.explored_states == self.supervisor.state_count()
    }
}

/// `supcon`: the supremal controllable and nonblocking sublanguage of the meet of `plant` and `specification`.
///
/// The meet forbids every event that the specification does not know: [`Supcon::not_lifted`] lists them, [`lift`] cures it.
///
/// # Errors
/// The product passes the bounds.
pub fn supcon(
    plant: &Automaton,
    specification: &Automaton,
    bounds: Bounds,
) -> Result<Supcon, TooLarge> {
    let mut result = explicit_supcon(&[plant], &[specification], Joint::Meet, bounds)?;
    let labels = plant.alphabet().labels();
    result.not_lifted = labels.filter(|&label| !specification.alphabet().contains(label)).collect();
    Ok(result)
}

/// `specification` with a self-loop of every event of `alphabet` that it does not know, as sync with ALLEVENTS makes it.
pub fn lift(specification: &Automaton, alphabet: &Alphabet) -> Automaton {
    let unknown = alphabet.events().iter();
    let unknown: Vec<Event> =
        unknown.filter(|event| !specification.alphabet().contains(event.label)).cloned().collect();
    // Only events that it does not know are added.
    selfloop(specification, &unknown).unwrap_or_else(|_| allevents(alphabet))
}

/// Why a product state is not in the supervisor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    Good,
    /// A specification forbids there what the plant may do.
    Violated,
    /// No marked state can be reached.
    Blocked,
    /// An uncontrollable event leads to one of the others.
    Drawn,
}

/// The fixed point of Ramadge and Wonham: states go from which an uncontrollable event leads out, and states from which no
/// marked state can be reached within what is left, until neither is left.
pub(crate) fn explicit_supcon(
    plants: &[&Automaton],
    specifications: &[&Automaton],
    joint: Joint,
    bounds: Bounds,
) -> Result<Supcon, TooLarge> {
    let parts: Vec<&Automaton> = plants.iter().chain(specifications).copied().collect();
    let product = Product::explore(plants, specifications, joint, bounds)?;
    let controllable: Vec<bool> = product.alphabet.labels().map(Label::is_controllable).collect();
    let predecessors = Predecessors::new(&product.first, &product.edges, &controllable);
    let fates = fates(&product, &predecessors);
    drop(predecessors);
    let violation = nearest_violation(&product, plants, specifications, joint);
    let explanation = match fates.first() {
        None => parts
            .iter()
            .find(|part| part.is_empty())
            .map(|part| Explanation::EmptyPart { name: part.name().to_owned() }),
        Some(Fate::Good) => None,
        Some(_) => explain(&product, &fates, plants, specifications, joint),
    };
    let explored_states = product.state_count();
    let names = state_names(&product, &parts);
    let keep: Vec<bool> = fates.iter().map(|&fate| fate == Fate::Good).collect();
    let automaton = product.into_automaton(joined_name(&parts));
    let automaton = match names {
        Some(names) => automaton.named_states(names),
        None => automaton,
    };
    Ok(Supcon {
        supervisor: restrict(&automaton, "SUPER".to_owned(), &keep).0,
        violation,
        explanation,
        not_lifted: Vec::new(),
        explored_states,
    })
}

fn fates(product: &Product, predecessors: &Predecessors) -> Vec<Fate> {
    let mut fates = vec![Fate::Good; product.state_count()];
    let mut good = vec![true; product.state_count()];
    let mut pending: Vec<usize> = product.violated.iter().map(|state| state.index()).collect();
    for &state in &pending {
        fates[state] = Fate::Violated;
        good[state] = false;
    }
    loop {
        while let Some(state) = pending.pop() {
            for (source, uncontrollable) in predecessors.of_state(state) {
                if uncontrollable && good[source] {
                    good[source] = false;
                    fates[source] = Fate::Drawn;
                    pending.push(source);
                }
            }
        }
        let coreachable = coreachable(predecessors, &product.marked, &good);
        for state in 0..good.len() {
            if good[state] && !coreachable[state] {
                good[state] = false;
                fates[state] = Fate::Blocked;
                pending.push(state);
            }
        }
        // Each round removes at least one state.
        if pending.is_empty() {
            return fates;
        }
    }
}

fn nearest_violation(
    product: &Product,
    plants: &[&Automaton],
    specifications: &[&Automaton],
    joint: Joint,
) -> Option<Violation> {
    product.violated.first()?;
    // Nothing leaves a violated state, and the search numbered the states in breadth-first order: the first one is nearest.
    let nearest = product.violated[0].index();
    let (word, state) = breadth_first_word(product, |state| state == nearest, |_| true)?;
    violation_at(product, word, state, plants, specifications, joint)
}

fn violation_at(
    product: &Product,
    word: Vec<Label>,
    state: usize,
    plants: &[&Automaton],
    specifications: &[&Automaton],
    joint: Joint,
) -> Option<Violation> {
    let allows = |component: usize, part: &Automaton, label: Label| {
        let passes = joint == Joint::Synchronous && !part.alphabet().contains(label);
        passes || part.step(product.component_state(state, component), label).is_some()
    };
    product.alphabet.labels().filter(|label| !label.is_controllable()).find_map(|event| {
        let mut numbered = plants.iter().enumerate();
        if !numbered.all(|(component, part)| allows(component, part, event)) {
            return None;
        }
        let mut numbered = specifications.iter().enumerate();
        let specification =
            numbered.position(|(number, part)| !allows(plants.len() + number, part, event))?;
        Some(Violation { word: word.clone(), event, specification })
    })
}

fn explain(
    product: &Product,
    fates: &[Fate],
    plants: &[&Automaton],
    specifications: &[&Automaton],
    joint: Joint,
) -> Option<Explanation> {
    // From a state that is drawn an uncontrollable event leads to one that is not good either, and so on to the cause.
    let cause = |state: usize| matches!(fates[state], Fate::Violated | Fate::Blocked);
    let (word, state) = breadth_first_word(product, cause, |label| !label.is_controllable())?;
    if fates[state] == Fate::Violated {
        return violation_at(product, word, state, plants, specifications, joint)
            .map(Explanation::Violated);
    }
    let components = 0..plants.len() + specifications.len();
    let states = components.map(|component| product.component_state(state, component)).collect();
    Some(Explanation::Blocked { word, states })
}
