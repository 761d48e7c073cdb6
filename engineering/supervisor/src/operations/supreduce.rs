//! Supervisor reduction, after R. Su and W. M. Wonham, *Supervisor reduction for discrete-event systems* (2004).
//!
//! Two states of a supervisor may become one when neither enables what the other disables, when they agree on marking wherever the
//! plant leaves it to them, and when the same holds for all that follows. Finding the fewest states is NP-hard; merging greedily
//! is not, and what comes out depends on the order in which pairs are tried. A few orders are tried and the smallest result is kept.

mod bound;
mod cells;
mod demands;
mod sieve;

use crate::automaton::{Automaton, State};
use crate::explicit::{Bounds, TooLarge};
pub use bound::fewest_states;
use cells::{Cells, End, Limits};
use demands::Demands;
use sieve::Sieve;

/// Pairs of cells that an order after the first may look at in any case: less than a second. A large supervisor is mostly smallest in
/// the first order, and a further order then takes at most the steps of that one.
const FURTHER_STEPS: u64 = 1 << 24;

/// How far a reduction is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reducing {
    /// The order in which pairs are tried now, from 1.
    pub order: usize,
    /// How many orders there are.
    pub orders: usize,
    /// States of which every pair was tried in this order.
    pub tried: usize,
    /// States of the supervisor.
    pub states: usize,
    /// States that are left so far.
    pub left: usize,
}

/// A reduced supervisor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reduction {
    /// With the same effect on the plant, also where the reduction was stopped.
    pub supervisor: Automaton,
    /// Whether the reduction ended by itself; otherwise it was stopped, and fewer states may do.
    pub is_complete: bool,
}

/// `supreduce`: a supervisor with no more states than `supervisor` and the same effect on `plant`; usually with far fewer, for it forgets
/// what the plant knows by itself. Its states have no names.
///
/// # Errors
/// The product of the two, or a table of all states and events, passes the bounds.
pub fn supreduce(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
) -> Result<Automaton, TooLarge> {
    supreduce_while(plant, supervisor, bounds, &mut |_| true).map(|made| made.supervisor)
}

/// As [`supreduce`], for as long as `go_on` says so, which is asked many times a second; the smallest result until then is kept.
///
/// # Errors
/// The errors of [`supreduce`].
pub fn supreduce_while(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
    go_on: &mut dyn FnMut(Reducing) -> bool,
) -> Result<Reduction, TooLarge> {
    let mut best = Reduction { supervisor: supervisor.clone(), is_complete: true };
    if supervisor.is_empty() {
        return Ok(best);
    }
    let demands = Demands::new(plant, supervisor, bounds)?;
    Cells::check_fits(supervisor, bounds)?;
    let orders = [ascending(supervisor), depth_first(supervisor)];
    let mut limits = Limits { cells: supervisor.state_count(), steps: u64::MAX };
    for (number, order) in orders.iter().enumerate() {
        let mut cells = Cells::new(supervisor, &demands);
        let mut go_on = |tried, left| {
            go_on(Reducing {
                order: number + 1,
                orders: orders.len(),
                tried,
                states: supervisor.state_count(),
                left,
            })
        };
        let mut sieve = Sieve::new(supervisor, &demands, order);
        let end = cells.merge_greedily(&mut sieve, limits, &mut go_on);
        let reduced = cells.reduced(supervisor);
        let size = |automaton: &Automaton| (automaton.state_count(), automaton.transition_count());
        if number == 0 || size(&reduced) < size(&best.supervisor) {
            best.supervisor = reduced;
        }
        if end == End::Stopped {
            best.is_complete = false;
            break;
        }
        limits.cells = best.supervisor.state_count();
        limits.steps = cells.steps().max(FURTHER_STEPS);
    }
    Ok(best)
}

fn ascending(supervisor: &Automaton) -> Vec<State> {
    supervisor.states().collect()
}

fn depth_first(supervisor: &Automaton) -> Vec<State> {
    let mut seen = vec![false; supervisor.state_count()];
    let mut order = Vec::with_capacity(seen.len());
    let mut pending: Vec<State> = supervisor.initial().into_iter().collect();
    while let Some(state) = pending.pop() {
        if std::mem::replace(&mut seen[state.index()], true) {
            continue;
        }
        order.push(state);
        pending.extend(supervisor.edges(state).iter().rev().map(|edge| edge.target));
    }
    order.extend(supervisor.states().filter(|state| !seen[state.index()]));
    order
}
