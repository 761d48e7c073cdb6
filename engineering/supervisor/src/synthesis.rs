//! Synthesis from many plants and many specifications, as an engineer has them.

use crate::alphabet::{Alphabet, Label};
use crate::automaton::Automaton;
use crate::explicit::{Bounds, Joint, TooLarge};
use crate::operations::{Supcon, explicit_supcon};

/// The supremal controllable and nonblocking supervisor of the sync of `plants` under all `specifications`, each of which is lifted:
/// it restrains only the events that it knows. The product is explored at once, without the plants' or the specifications' own.
///
/// # Errors
/// The product passes the bounds.
pub fn synthesise(
    plants: &[&Automaton],
    specifications: &[&Automaton],
    bounds: Bounds,
) -> Result<Supcon, TooLarge> {
    explicit_supcon(plants, specifications, Joint::Synchronous, bounds)
}

/// For each specification the events that it names and no plant has: misspelt, or of a plant that was forgotten.
pub fn unknown_events(plants: &[&Automaton], specifications: &[&Automaton]) -> Vec<(usize, Label)> {
    let known = Alphabet::new([]).union(plants.iter().map(|plant| plant.alphabet()));
    let numbered = specifications.iter().enumerate();
    numbered
        .flat_map(|(number, specification)| {
            let labels = specification.alphabet().labels();
            labels.filter(|&label| !known.contains(label)).map(move |label| (number, label))
        })
        .collect()
}
