//! Reduces a supervisor with progress messages and a time limit.

use std::time::Duration;

use understudy_bus::Interruption;
use understudy_supervisor::operations::{
    Reducing, compare_effects, fewest_states, supreduce_while,
};
use understudy_supervisor::{Automaton, Bounds};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::patience::Patience;

/// Default time limit: the smallest supervisor so far is the result.
pub(crate) const BUDGET: &str = "30s";

/// A supervisor of which the effect on the plant was compared with that of the given one.
pub(crate) struct Reduced {
    pub(crate) supervisor: Automaton,
    /// Where the time limit, SIGINT or SIGTERM stopped the reduction.
    pub(crate) warning: Option<String>,
    /// No supervisor with this effect has fewer states.
    pub(crate) lower_bound: usize,
}

impl Reduced {
    /// The warning, and how few states are possible.
    pub(crate) fn notes(&self) -> String {
        let warning = self.warning.as_deref().unwrap_or_default();
        format!(
            "{warning}lower bound: no supervisor with this effect has fewer than {} states\n",
            self.lower_bound
        )
    }
}

/// Reduced supervisor.
///
/// # Errors
/// If the product of the two exceeds the bounds, or the effects differ, which is a defect of the reduction.
pub(crate) fn reduced(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
    budget: Duration,
    console: &mut Console,
) -> Result<Reduced, Answer> {
    // Without the flag an interruption ends the command.
    let interruption = Interruption::expected().ok();
    let patience = Patience::new(Some(budget), console);
    let mut interrupted = false;
    let mut go_on = |at: Reducing| {
        interrupted = interruption.as_ref().is_some_and(Interruption::came);
        let goes_on = patience.goes_on_with(format_args!(
            "order {} of {}: {} of {} states tried, {} left; Ctrl-C accepts the result so far",
            at.order, at.orders, at.tried, at.states, at.left
        ));
        !interrupted && goes_on
    };
    let made = supreduce_while(plant, supervisor, bounds, &mut go_on)?;
    if let Some(other) = compare_effects(plant, supervisor, &made.supervisor, bounds)? {
        let message = format!(
            "after {} events the reduced supervisor has another effect on the plant than the given one; this is a defect of the program",
            other.word.len()
        );
        return Err(Answer::failed(Status::Failed, "U0848", message));
    }
    let warning = (!made.is_complete).then(|| {
        format!(
            "warning[U0847]: the reduction was {} after {} s at {} of {} states; the supervisor has the same effect, but may not be minimal\n",
            if interrupted { "interrupted" } else { "stopped" },
            patience.seconds(),
            made.supervisor.state_count(),
            supervisor.state_count()
        )
    });
    let lower_bound = fewest_states(plant, supervisor, bounds)?;
    Ok(Reduced { supervisor: made.supervisor, warning, lower_bound })
}
