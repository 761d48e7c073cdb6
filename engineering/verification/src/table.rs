//! Runs as a person reads them: a row a signal, a column a scan. Where scans repeat those before them, as while a timer runs or a counter counts, one column
//! stands for them.

use std::fmt::Write as _;

use understudy_logic::Circuit;

use crate::symbolic::Trace;

/// Number of columns.
const WIDTH: usize = 30;

/// So many scans that repeat what was before are folded, and more.
const FOLDED: usize = 5;

/// The most scans of what is repeated; it is told once, and folded where it comes twice more.
const REPEATED: usize = 8;

/// A part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// One scan.
    Scan(usize),
    /// From one scan to another, both included, in which the signals repeat the scans before, as many as the third number, over and over.
    Again(usize, usize, usize),
}

impl Part {
    /// What stands for a part that is folded.
    pub(crate) fn told(self) -> Option<String> {
        match self {
            Self::Scan(_) => None,
            Self::Again(from, to, 1) => Some(format!("scans {from} to {to}: as scan {}", from - 1)),
            Self::Again(from, to, scans) => Some(format!(
                "scans {from} to {to}: as scans {} to {}, over and over",
                from - scans,
                from - 1
            )),
        }
    }
}

/// The run with its long repeated parts folded.
pub(crate) fn parts(trace: &Trace) -> Vec<Part> {
    let row = |scan: usize| -> Vec<bool> {
        let signals = trace.signals.iter();
        signals.map(|&signal| trace.value(signal, scan)).collect()
    };
    let rows: Vec<Vec<bool>> = (0..trace.scans.len()).map(row).collect();
    // What a run shows often happens in its last scan, which is always told.
    let end = rows.len().saturating_sub(1);
    // How many scans, in whole rounds, repeat those before them; nothing where they are few.
    let repeated = |from: usize, scans: usize| {
        let same = (from..end).take_while(|&next| rows[next] == rows[next - scans]).count();
        let whole = same / scans * scans;
        let least = if scans == 1 { FOLDED } else { FOLDED.max(2 * scans) };
        Some(whole).filter(|&whole| whole >= least)
    };
    let mut parts = Vec::new();
    let mut scan = 0;
    while scan < rows.len() {
        let rounds = |scans: usize| Some((scans, repeated(scan + scans, scans)?));
        let Some((scans, whole)) = (1..=REPEATED).find_map(rounds) else {
            parts.push(Part::Scan(scan));
            scan += 1;
            continue;
        };
        let from = scan + scans;
        parts.extend((scan..from).map(Part::Scan));
        parts.push(Part::Again(from, from + whole - 1, scans));
        scan = from + whole;
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
                Part::Again(..) => write!(line, "{:>column$}", "~"),
            };
        }
        let _ = writeln!(text, "{line}");
        for &signal in &trace.signals {
            let _ = write!(text, "{:<margin$}", signal.name(circuit));
            for part in parts {
                let mark = match *part {
                    Part::Scan(scan) if trace.value(signal, scan) => '1',
                    Part::Scan(_) => '.',
                    Part::Again(..) => '~',
                };
                let _ = write!(text, "{mark:>column$}");
            }
            text.push('\n');
        }
        for told in parts.iter().filter_map(|part| part.told()) {
            let _ = writeln!(text, "{told}");
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
    fn what_repeats_is_told_once() {
        let values: Vec<u8> = (0..200).map(|scan| u8::from(scan % 3 == 1)).collect();
        assert_eq!(
            check(&values, None),
            "scan   0   1   2   ~ 198 199\na      .   1   .   ~   .   1\nscans 3 to 197: as scans 0 to 2, over and over\n"
        );
        assert_eq!(check(&[0, 1, 0, 1, 0, 1, 1], None), "scan 0 1 2 3 4 5 6\na    . 1 . 1 . 1 1\n");
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
