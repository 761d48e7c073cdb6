//! Runs as a person reads them: a row a signal, a column a scan. Where nothing changes for many scans, as while a timer runs, one column stands for them.

use std::fmt::Write as _;

use understudy_logic::Circuit;

use crate::symbolic::Trace;

/// Number of columns.
const WIDTH: usize = 30;

/// So many scans without a change are folded, and more.
const FOLDED: usize = 5;

/// A part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// One scan.
    Scan(usize),
    /// From one scan to another, both included, in which the signals are as in the scan before.
    Unchanged(usize, usize),
}

/// The run with its long unchanged parts folded.
pub(crate) fn parts(trace: &Trace) -> Vec<Part> {
    let row = |scan: usize| -> Vec<bool> {
        let signals = trace.signals.iter();
        signals.map(|&signal| trace.value(signal, scan)).collect()
    };
    let count = trace.scans.len();
    let mut parts = Vec::new();
    let mut scan = 0;
    while scan < count {
        parts.push(Part::Scan(scan));
        let first = row(scan);
        let same = (scan + 1..count).take_while(|&next| row(next) == first);
        let same = same.count();
        // What a run shows often happens in its last scan, which is always told.
        let folded = same - usize::from(scan + same + 1 == count && same > 0);
        if folded >= FOLDED {
            parts.push(Part::Unchanged(scan + 1, scan + folded));
            scan += 1 + folded;
        } else {
            parts.extend((scan..=scan + same).skip(1).map(Part::Scan));
            scan += 1 + same;
        }
    }
    parts
}

/// The run as a table, with a dot for 0; long runs go on below.
pub fn scan_table(circuit: &Circuit, trace: &Trace) -> String {
    let mut text = String::new();
    let names = trace.signals.iter().map(|signal| signal.name(circuit));
    let margin = names.map(|name| name.chars().count()).max().unwrap_or(0).max(4);
    let column = trace.scans.len().saturating_sub(1).to_string().len() + 1;
    for parts in parts(trace).chunks(WIDTH) {
        let mut line = format!("{:<margin$}", "scan");
        for part in parts {
            let _ = match part {
                Part::Scan(scan) => write!(line, "{scan:>column$}"),
                Part::Unchanged(..) => write!(line, "{:>column$}", "~"),
            };
        }
        let _ = writeln!(text, "{line}");
        for &signal in &trace.signals {
            let _ = write!(text, "{:<margin$}", signal.name(circuit));
            for part in parts {
                let mark = match *part {
                    Part::Scan(scan) if trace.value(signal, scan) => '1',
                    Part::Scan(_) => '.',
                    Part::Unchanged(..) => '~',
                };
                let _ = write!(text, "{mark:>column$}");
            }
            text.push('\n');
        }
        for part in parts {
            if let Part::Unchanged(from, to) = part {
                let _ = writeln!(text, "scans {from} to {to}: as scan {}", from - 1);
            }
        }
    }
    if let Some(again) = trace.again_from {
        let last = trace.scans.len() - 1;
        let _ = writeln!(text, "after scan {last} the run repeats from scan {again} indefinitely");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbolic::{ScanRow, Signal};

    fn check(values: &[u8], again_from: Option<usize>) -> String {
        let mut builder = understudy_logic::CircuitBuilder::new("one");
        builder.input("a");
        let circuit = builder.finish().expect("a right circuit");
        let scan = |&value: &u8| ScanRow { inputs: vec![value == 1], outputs: Vec::new() };
        let trace = Trace {
            signals: vec![Signal::Input(0)],
            scans: values.iter().map(scan).collect(),
            again_from,
        };
        scan_table(&circuit, &trace)
    }

    #[test]
    fn a_short_run_is_told_whole() {
        let table = check(&[0, 0, 0, 0, 0, 1], Some(2));
        assert_eq!(
            table,
            "scan 0 1 2 3 4 5\na    . . . . . 1\nafter scan 5 the run repeats from scan 2 indefinitely\n"
        );
    }

    #[test]
    fn a_long_part_without_a_change_is_folded() {
        let mut values = vec![0; 301];
        values[0] = 1;
        values[300] = 1;
        assert_eq!(
            check(&values, None),
            "scan   0   1   ~ 300\na      1   .   ~   1\nscans 2 to 299: as scan 1\n"
        );
        assert_eq!(
            check(&[0; 12], None),
            "scan  0  ~ 11\na     .  ~  .\nscans 1 to 10: as scan 0\n"
        );
    }
}
