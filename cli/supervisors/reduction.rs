//! Reduces a supervisor with progress messages and a time limit.

use std::time::{Duration, Instant};

use understudy_bus::Interruption;
use understudy_supervisor::operations::{Reducing, supreduce_while};
use understudy_supervisor::{Automaton, Bounds};

use crate::answer::Answer;
use crate::console::Console;

/// Time limit: the smallest supervisor so far is the result.
const LIMIT: Duration = Duration::from_secs(30);

/// Interval of the progress messages.
const BETWEEN: Duration = Duration::from_secs(3);

/// Reduced supervisor, with a warning if the time limit, SIGINT or SIGTERM stopped the reduction.
///
/// # Errors
/// If the product of the two exceeds the bounds.
pub(crate) fn reduced(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
    console: &mut Console,
) -> Result<(Automaton, Option<String>), Answer> {
    // Without the flag an interruption ends the command.
    let interruption = Interruption::expected().ok();
    let begin = Instant::now();
    let mut told = begin;
    let mut interrupted = false;
    let mut go_on = |at: Reducing| {
        if told.elapsed() >= BETWEEN {
            told = Instant::now();
            console.note(&format!(
                "{} s: order {} of {}: {} of {} states tried, {} left; Ctrl-C accepts the result so far",
                begin.elapsed().as_secs(),
                at.order,
                at.orders,
                at.tried,
                at.states,
                at.left
            ));
        }
        interrupted = interruption.as_ref().is_some_and(Interruption::came);
        !interrupted && begin.elapsed() < LIMIT
    };
    let made = supreduce_while(plant, supervisor, bounds, &mut go_on)?;
    let warning = (!made.is_complete).then(|| {
        format!(
            "warning[U0847]: the reduction was {} after {} s at {} of {} states; the supervisor has the same effect, but may not be minimal\n",
            if interrupted { "interrupted" } else { "stopped" },
            begin.elapsed().as_secs(),
            made.supervisor.state_count(),
            supervisor.state_count()
        )
    });
    Ok((made.supervisor, warning))
}
