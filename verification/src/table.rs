//! Runs as a person reads them: a row a signal, a column a scan.

use std::fmt::Write as _;

use understudy_logic::Circuit;

use crate::symbolic::Trace;

/// Scans beside each other.
const WIDTH: usize = 30;

/// The run as a table, with a dot for 0; long runs go on below.
pub fn scan_table(circuit: &Circuit, trace: &Trace) -> String {
    let mut text = String::new();
    let names = trace.signals.iter().map(|signal| signal.name(circuit));
    let margin = names
        .map(|name| name.chars().count())
        .max()
        .unwrap_or(0)
        .max(4);
    let column = trace.scans.len().saturating_sub(1).to_string().len() + 1;
    let mut from = 0;
    while from < trace.scans.len() {
        let to = trace.scans.len().min(from + WIDTH);
        let _ = write!(text, "{:<margin$}", "scan");
        for scan in from..to {
            let _ = write!(text, "{scan:>column$}");
        }
        text.push('\n');
        for &signal in &trace.signals {
            let _ = write!(text, "{:<margin$}", signal.name(circuit));
            for value in trace.values(signal).skip(from).take(to - from) {
                let _ = write!(text, "{:>column$}", if value { '1' } else { '.' });
            }
            text.push('\n');
        }
        from = to;
    }
    if let Some(again) = trace.again_from {
        let last = trace.scans.len() - 1;
        let _ = writeln!(
            text,
            "after scan {last} all goes on as from scan {again}, for ever"
        );
    }
    text
}
