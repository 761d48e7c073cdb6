//! Measures which period this host keeps.

use std::time::Duration;

use understudy_bus::Wakefulness;
use understudy_cluster::Cluster;

use crate::console::Console;
use crate::run::lab::RunArguments;

/// Measuring time of `demo`.
const LONG: Duration = Duration::from_secs(1);
/// Longest period of a demonstration.
const LONGEST: Duration = Duration::from_millis(200);
/// Measuring time of `lab` and `watch`.
const SHORT: Duration = Duration::from_millis(300);

/// The arguments with the shortest period that this host keeps, unless a period was given.
pub(crate) fn with_period(arguments: &RunArguments, console: &mut Console) -> RunArguments {
    if arguments.overrides.has_period() {
        return arguments.clone();
    }
    let measured = Wakefulness::measure(LONG, true);
    let period = measured.period();
    console.note(&format!(
        "{}: period {} ms{}",
        late(&measured),
        period.as_millis(),
        rights(&measured)
    ));
    RunArguments { overrides: arguments.overrides.with_period(period), ..arguments.clone() }
}

/// The arguments with twice the period, after a run for which this host was too slow.
pub(crate) fn with_longer_period(arguments: &RunArguments, console: &mut Console) -> RunArguments {
    let period = arguments.overrides.overrides().period.unwrap_or(SHORT);
    let longer = (period * 2).min(LONGEST);
    console.note(&format!(
        "this host was too slow for a period of {} ms: repeated at {} ms",
        period.as_millis(),
        longer.as_millis()
    ));
    RunArguments { overrides: arguments.overrides.with_period(longer), ..arguments.clone() }
}

/// Warns if this host cannot keep the period of a cluster.
pub(crate) fn warn(cluster: &Cluster, console: &mut Console) {
    let period = cluster.agreement().schedule.period();
    let measured = Wakefulness::measure(SHORT, true);
    if measured.keeps(period) {
        return;
    }
    console.note(&format!(
        "warning: {}, too long for a period of {} ms: outputs will be held; use --period {}ms{}",
        late(&measured),
        period.as_secs_f64() * 1e3,
        measured.period().as_millis(),
        rights(&measured)
    ));
}

fn late(measured: &Wakefulness) -> String {
    let late = measured.latest().as_secs_f64() * 1e3;
    format!("wake-up latency of this host: up to {late:.1} ms")
}

fn rights(measured: &Wakefulness) -> &'static str {
    if measured.real_time || measured.keeps(Duration::from_millis(10)) {
        ""
    } else {
        "; root or CAP_SYS_NICE may allow a shorter period"
    }
}
