//! Algorithm 1 from records: what was seen, scan by scan.
//!
//! A record is a CSV file with a column for each input and output by its name (others are left aside), 0 and 1, a line for each
//! scan; an empty line, or a change in the column `run`, begins another run from the initial state. Or it is the journal
//! of a cluster: the `applied` records of one remote I/O. The ladder scans along on the recorded inputs, so that a record of
//! something else is known by its first scan that differs; and where two runs have the same inputs so far and different
//! outputs, no program explains them.

use std::collections::HashMap;
use std::time::Duration;

use understudy_ladder::{Interpreter, Program};

use crate::controller::Controller;
use crate::quotient::{Seen, quotient};
use crate::signals::{Bits, Signals};

/// The longest record in scans.
pub const MAXIMUM_SCANS: usize = 5_000_000;

/// How many earlier vectors tell equal ones apart, at most.
const MAXIMUM_MEMORY: usize = 8;

/// A run: inputs and outputs of each scan.
pub type Run = Vec<(Bits, Bits)>;

/// Reason why a record is invalid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// A line that cannot be read.
    #[error("U1211: {file}, line {line}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Counted from 1.
        line: usize,
        /// Why.
        reason: String,
    },
    /// The same inputs and different outputs.
    #[error(
        "U1212: the record contradicts itself: run {first_run} has the outputs {first} in scan {scan} and run {second_run} has {second}, on the same inputs so far; no hidden state explains that"
    )]
    Contradiction {
        /// Counted from 1.
        first_run: usize,
        /// Its outputs.
        first: String,
        /// Counted from 1.
        second_run: usize,
        /// Its outputs.
        second: String,
        /// Counted from 1.
        scan: usize,
    },
    /// The record is not of this ladder.
    #[error(
        "U1213: run {run}, scan {scan}: on the inputs {inputs} the ladder gives {own}, and the record has {recorded}"
    )]
    OtherProgram {
        /// Counted from 1.
        run: usize,
        /// Counted from 1.
        scan: usize,
        /// Of that scan.
        inputs: String,
        /// What the ladder does.
        own: String,
        /// What was recorded.
        recorded: String,
    },
    /// Nothing was recorded.
    #[error("U1214: the records have no scan")]
    Empty,
}

impl RecordError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "U1211",
            Self::Contradiction { .. } => "U1212",
            Self::OtherProgram { .. } => "U1213",
            Self::Empty => "U1214",
        }
    }
}

/// The runs of a file, by its first character a journal or a table.
///
/// # Errors
/// The first line that is wrong.
pub fn read(file: &str, text: &str, signals: &Signals) -> Result<Vec<Run>, RecordError> {
    if text.trim_start().starts_with('{') {
        read_journal(file, text, signals)
    } else {
        read_csv(file, text, signals)
    }
}

fn unreadable(file: &str, line: usize, reason: impl Into<String>) -> RecordError {
    RecordError::Unreadable { file: file.to_owned(), line: line + 1, reason: reason.into() }
}

fn read_csv(file: &str, text: &str, signals: &Signals) -> Result<Vec<Run>, RecordError> {
    let mut lines = text.lines().enumerate();
    let Some((_, header)) = lines.next() else {
        return Ok(Vec::new());
    };
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let column = |name: &String| {
        let place = names.iter().position(|known| known == name);
        place.ok_or_else(|| unreadable(file, 0, format!("there is no column `{name}`")))
    };
    let inputs = signals.inputs.iter().map(column).collect::<Result<Vec<_>, _>>()?;
    let outputs = signals.outputs.iter().map(column).collect::<Result<Vec<_>, _>>()?;
    let run_column = names.iter().position(|name| *name == "run");
    let mut runs: Vec<Run> = Vec::new();
    let mut present: Option<String> = None;
    for (number, line) in lines {
        if line.trim().is_empty() {
            present = None;
            continue;
        }
        if number > MAXIMUM_SCANS {
            return Err(unreadable(file, number, format!("more than {MAXIMUM_SCANS} scans")));
        }
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let bits = |columns: &[usize]| {
            let bit = |&column: &usize| match cells.get(column) {
                Some(&"0") => Ok(false),
                Some(&"1") => Ok(true),
                Some(other) => {
                    let reason = format!("`{}` is {other:?}, not 0 or 1", names[column]);
                    Err(unreadable(file, number, reason))
                }
                None => Err(unreadable(file, number, format!("`{}` is missing", names[column]))),
            };
            columns.iter().map(bit).collect::<Result<Vec<_>, _>>().map(Bits)
        };
        let label = run_column.and_then(|column| cells.get(column)).copied().unwrap_or("");
        if present.as_deref() != Some(label) {
            runs.push(Vec::new());
            present = Some(label.to_owned());
        }
        let scan = (bits(&inputs)?, bits(&outputs)?);
        if let Some(run) = runs.last_mut() {
            run.push(scan);
        }
    }
    Ok(runs)
}

/// A run begins where a program starts cold, and ends at the first deadline with nothing true to apply: what is driven then is
/// no scan. Records of other widths are of other programs.
fn read_journal(file: &str, text: &str, signals: &Signals) -> Result<Vec<Run>, RecordError> {
    let mut runs: Vec<Run> = Vec::new();
    let mut open: HashMap<String, usize> = HashMap::new();
    for (number, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let record: serde_json::Value = serde_json::from_str(line)
            .map_err(|error| unreadable(file, number, error.to_string()))?;
        let event = &record["event"];
        let who = record["name"].as_str().unwrap_or("");
        match event["event"].as_str() {
            Some("started-cold") => {
                open.insert(who.to_owned(), runs.len());
                runs.push(Run::new());
            }
            Some("applied") => {
                let Some(&run) = open.get(who) else { continue };
                let inputs = image(&event["sampled"], signals.inputs.len());
                let outputs = image(&event["outputs"], signals.outputs.len());
                match (event["missing"].is_null(), inputs, outputs) {
                    (true, Some(inputs), Some(outputs)) => runs[run].push((inputs, outputs)),
                    _ => {
                        open.remove(who);
                    }
                }
            }
            _ => {}
        }
    }
    Ok(runs)
}

/// `{"width":5,"words":[3]}`.
fn image(value: &serde_json::Value, width: usize) -> Option<Bits> {
    let words = value["words"].as_array()?;
    if value["width"].as_u64()? != width as u64 {
        return None;
    }
    let bit = |place: usize| Some(words.get(place / 64)?.as_u64()? >> (place % 64) & 1 == 1);
    (0..width).map(bit).collect::<Option<Vec<_>>>().map(Bits)
}

/// The automaton of `runs`, and how often each of its states was seen.
///
/// # Errors
/// The runs contradict each other or the ladder, or there is nothing in them.
pub fn learn(
    runs: &[Run],
    ladder: &Program,
    period: Duration,
    signals: &Signals,
) -> Result<Controller, RecordError> {
    if runs.iter().all(Vec::is_empty) {
        return Err(RecordError::Empty);
    }
    contradictions(runs)?;
    for (number, run) in runs.iter().enumerate() {
        along(number, run, ladder, period)?;
    }
    // Each run begins at the first node of the first: all begin in x0.
    let mut nodes = Vec::new();
    let mut hidden = Vec::new();
    let mut edges = Vec::new();
    for run in runs {
        let mut history: Vec<u64> = vec![0; MAXIMUM_MEMORY];
        let mut last: Option<&(Bits, Bits)> = None;
        for scan in run {
            if last == Some(scan) {
                continue;
            }
            let place = nodes.len() as u32;
            if let Some(before) = last {
                edges.push((place - 1, place));
                history.rotate_right(1);
                history[0] = hash(before);
            }
            nodes.push(Seen { inputs: scan.0.clone(), outputs: scan.1.clone() });
            hidden.push(history.clone());
            last = Some(scan);
        }
    }
    let (controller, _) = quotient(signals.clone(), Vec::new(), &nodes, &hidden, &[], &edges);
    Ok(controller)
}

fn hash(scan: &(Bits, Bits)) -> u64 {
    use std::hash::BuildHasher as _;
    rustc_hash::FxBuildHasher.hash_one(scan)
}

/// Two runs on the same inputs so far, with different outputs.
fn contradictions(runs: &[Run]) -> Result<(), RecordError> {
    // The runs that agree so far, by the place of the first of them.
    let mut known: HashMap<(usize, &Bits), (usize, usize)> = HashMap::new();
    let mut nodes = 1;
    for (number, run) in runs.iter().enumerate() {
        let mut at = 0;
        for (scan, (inputs, outputs)) in run.iter().enumerate() {
            let next = nodes;
            let &mut (node, first) = known.entry((at, inputs)).or_insert((next, number));
            nodes += usize::from(node == next);
            if runs[first][scan].1 != *outputs {
                return Err(RecordError::Contradiction {
                    first_run: first + 1,
                    first: runs[first][scan].1.to_string(),
                    second_run: number + 1,
                    second: outputs.to_string(),
                    scan: scan + 1,
                });
            }
            at = node;
        }
    }
    Ok(())
}

/// The ladder on the recorded inputs.
fn along(number: usize, run: &Run, ladder: &Program, period: Duration) -> Result<(), RecordError> {
    let Ok(mut interpreter) = Interpreter::new(ladder, period) else {
        return Ok(());
    };
    for (scan, (inputs, outputs)) in run.iter().enumerate() {
        let own = Bits(interpreter.scan(&inputs.0));
        if own != *outputs {
            return Err(RecordError::OtherProgram {
                run: number + 1,
                scan: scan + 1,
                inputs: inputs.to_string(),
                own: own.to_string(),
                recorded: outputs.to_string(),
            });
        }
    }
    Ok(())
}

/// What a record has not seen.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Missed {
    /// States, by their names.
    pub states: Vec<String>,
    /// Moves, by the names of their ends.
    pub moves: Vec<(String, String)>,
}

/// What of `whole` a record has missed.
pub fn missed(record: &Controller, whole: &Controller) -> Missed {
    let vector = |controller: &Controller, state: usize| {
        let found = &controller.states()[state];
        (found.inputs.clone(), found.outputs.clone())
    };
    let states: Vec<_> = (0..record.states().len()).map(|state| vector(record, state)).collect();
    let moves: Vec<_> = (0..states.len())
        .flat_map(|state| record.moves(state).iter().map(move |step| (state, step.target)))
        .map(|(from, to)| (states[from].clone(), states[to].clone()))
        .collect();
    let mut missed = Missed::default();
    for state in 0..whole.states().len() {
        let here = vector(whole, state);
        if !states.contains(&here) {
            missed.states.push(whole.state_name(state));
        }
        for step in whole.moves(state) {
            let there = vector(whole, step.target);
            if here != there && !moves.contains(&(here.clone(), there)) {
                missed.moves.push((whole.state_name(state), whole.state_name(step.target)));
            }
        }
    }
    missed
}
