//! How often programs run: the intervals of tasks.
//!
//! One rule for every language: the period of a file is the longest one of which the intervals of all tasks that run programs are
//! multiples, and each program runs in every n-th scan. A period from outside keeps the intervals where it divides them all.

use std::ops::Range;

use understudy_text::{Diagnostic, duration};

use crate::syntax::{Expression, File, Name, ProgramInstance, Task};

use super::Lowering;
use super::programs::Instance;

/// The intervals of the tasks that run programs of a file, in nanoseconds; of the chosen program alone, where there is one. Without
/// instances of programs nothing says which of its tasks runs them: the shortest interval counts.
pub fn intervals(file: &File, program: Option<&str>) -> Vec<i64> {
    if file.instances.is_empty() {
        return shortest(file).into_iter().collect();
    }
    let runs: Vec<&ProgramInstance> = match program {
        Some(program) => file.instances.iter().find(|run| run.of.is(program)).into_iter().collect(),
        None => file.instances.iter().collect(),
    };
    let tasks = runs.into_iter().filter_map(|run| task(file, run.task.as_ref()?));
    tasks.filter_map(interval).collect()
}

/// The period of a file in nanoseconds: the longest one of which all its [`intervals`] are multiples.
pub fn period(file: &File, program: Option<&str>) -> Option<i64> {
    intervals(file, program).into_iter().reduce(divisor)
}

/// Whether an event runs a program of a file, or the chosen one.
pub fn has_event(file: &File, program: Option<&str>) -> bool {
    let mut runs = file.instances.iter();
    runs.any(|run| program.is_none_or(|name| run.of.is(name)) && event(file, run).is_some())
}

/// The event that runs an instance of a program.
pub fn event<'a>(file: &'a File, run: &ProgramInstance) -> Option<&'a Expression> {
    task(file, run.task.as_ref()?)?.single.as_ref()
}

/// The warning on a program that runs every `found` nanoseconds in place of every `interval`, since the period does not divide the
/// interval; `fitting` is a period that does.
pub fn another_interval(
    program: (&str, Range<usize>),
    (period, found): (i64, i128),
    (interval, fitting): (i64, i64),
) -> Diagnostic {
    let (name, span) = program;
    let message = format!(
        "with a period of {} `{name}` runs every {} in place of every {}",
        shown(period.into()),
        shown(found),
        shown(interval.into())
    );
    let help = format!("give the period {}, or a divisor of it", shown(fitting.into()));
    Diagnostic::warning("U1084", message, span).with_help(help)
}

/// The task of a name.
pub(super) fn task<'a>(file: &'a File, name: &Name) -> Option<&'a Task> {
    file.tasks.iter().find(|task| task.name == *name)
}

/// The interval of a task that has one and no event.
pub(super) fn interval(task: &Task) -> Option<i64> {
    task.interval.filter(|interval| task.single.is_none() && *interval > 0)
}

/// The shortest interval of all tasks of a file.
pub(super) fn shortest(file: &File) -> Option<i64> {
    file.tasks.iter().filter_map(interval).min()
}

/// The greatest common divisor of two intervals.
fn divisor(one: i64, other: i64) -> i64 {
    let common = duration::common(nanoseconds(one), nanoseconds(other));
    i64::try_from(common.as_nanos()).unwrap_or(i64::MAX)
}

fn nanoseconds(interval: i64) -> std::time::Duration {
    std::time::Duration::from_nanos(interval.unsigned_abs())
}

/// How the intervals of tasks are counted in scans.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base {
    /// The interval of which all are multiples.
    pub(super) common: i64,
    /// From one scan to the next.
    period: i64,
}

impl Base {
    /// The number of scans from one run of a program with this interval to the next: the nearest to it that there is.
    pub(super) fn every(self, interval: i64) -> u32 {
        let rest = interval % self.period;
        let scans = interval / self.period + i64::from(rest >= self.period - rest);
        u32::try_from(scans).unwrap_or(u32::MAX).max(1)
    }
}

impl Lowering<'_> {
    /// How the intervals of all tasks are counted, where they have one. Of each that the wanted period does not divide it is said how often its program
    /// runs instead.
    pub(super) fn base(&mut self, instances: &[Instance<'_>], wanted: Option<i64>) -> Option<Base> {
        let intervals = || instances.iter().filter_map(|instance| instance.interval);
        let common = intervals().reduce(divisor)?;
        let Some(wanted) = wanted.filter(|wanted| *wanted > 0) else {
            return Some(Base { common, period: common });
        };
        let base = Base { common, period: wanted };
        for instance in instances {
            let interval = instance.interval.unwrap_or(wanted);
            if interval % wanted != 0 {
                let found = i128::from(base.every(interval)) * i128::from(wanted);
                let program = (instance.name.as_str(), instance.name.span());
                let found = another_interval(program, (wanted, found), (interval, common));
                self.report(found);
            }
        }
        Some(base)
    }
}

fn shown(nanoseconds: i128) -> String {
    format!("{} ms", nanoseconds as f64 / 1e6)
}
