//! How often programs run: the intervals of tasks.

use crate::syntax::{File, Name, Task};

use super::Lowering;
use super::programs::Instance;

/// The period of a file in nanoseconds: the longest one of which the intervals of all tasks that run programs are multiples. Of the
/// chosen program alone, where there is one.
pub fn period(file: &File, program: Option<&str>) -> Option<i64> {
    let named = |name: &Name| file.tasks.iter().find(|task| task.name == *name);
    let run = file.instances.iter();
    let run = run.filter(|instance| program.is_none_or(|program| instance.of.is(program)));
    let intervals = run.filter_map(|instance| interval(named(instance.task.as_ref()?)?));
    let found = intervals.reduce(divisor);
    match (file.instances.is_empty(), program) {
        (true, None) => file.tasks.iter().filter_map(interval).min(),
        _ => found,
    }
}

/// The interval of a task that has one and no event.
pub(super) fn interval(task: &Task) -> Option<i64> {
    task.interval.filter(|interval| task.single.is_none() && *interval > 0)
}

/// The greatest common divisor of two intervals.
fn divisor(one: i64, other: i64) -> i64 {
    let (mut one, mut other) = (one, other);
    while other != 0 {
        (one, other) = (other, one % other);
    }
    one
}

impl Lowering<'_> {
    /// The interval by which those of all tasks are counted.
    pub(super) fn base(&mut self, instances: &[Instance<'_>], wanted: Option<i64>) -> Option<i64> {
        let intervals = || instances.iter().filter_map(|instance| instance.interval);
        let common = intervals().reduce(divisor)?;
        let Some(wanted) = wanted.filter(|wanted| *wanted > 0 && *wanted != common) else {
            return Some(common);
        };
        let are_several = intervals().any(|interval| Some(interval) != intervals().next());
        if !are_several {
            return Some(common);
        }
        if intervals().all(|interval| interval % wanted == 0) {
            return Some(wanted);
        }
        let slowest = instances.iter().filter(|instance| instance.interval.is_some());
        if let Some(slowest) = slowest.max_by_key(|instance| instance.interval) {
            let interval = slowest.interval.unwrap_or_default();
            let found = i128::from(interval / common) * i128::from(wanted);
            let message = format!(
                "with a period of {} `{}` runs every {} in place of every {}",
                shown(wanted.into()),
                slowest.name,
                shown(found),
                shown(interval.into())
            );
            let help = format!("give the period {}, or a divisor of it", shown(common.into()));
            self.warn("U1084", message, slowest.name.span(), help);
        }
        Some(common)
    }
}

fn shown(nanoseconds: i128) -> String {
    format!("{} ms", nanoseconds as f64 / 1e6)
}
