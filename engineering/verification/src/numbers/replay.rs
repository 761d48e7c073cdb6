//! Runs with numbers: a run of the derivation is repeated, or one that breaks an invariant is searched.

use std::collections::BTreeSet;

use understudy_bits::{
    Derivation, Meaning, Node, System, Term, Terms, Variable, between, boundary_text, position,
};
use understudy_logic::Random;
use understudy_typed::Elementary;

use super::{Run, holds_in};
use crate::effort::{GoOn, Work};
use crate::symbolic::{Resolved, ScanRow, Signal, Trace};

/// Term evaluations of a search.
const EVALUATIONS: usize = 40_000_000;
/// Scans of a run of a search.
const SCANS: usize = 60;
/// Tries to find inputs that keep the assumptions.
const TRIES: usize = 20;
/// Numbers that a run shows.
const SHOWN: usize = 12;

/// A number in each scan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// Its values, as IEC 61131-3 writes them.
    pub values: Vec<String>,
}

/// An input in each scan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Its name; of several programs behind the name of its controller and a dot.
    pub name: String,
    /// Its values, as they are stored.
    pub values: Vec<u64>,
}

/// What came of repeating a run.
pub(super) struct Followed {
    /// The run with numbers, where every value of it is known.
    pub(super) run: Option<Run>,
    /// Whether it breaks the invariant, in its last scan.
    pub(super) is_broken: bool,
    /// The first comparison that no number was found for.
    pub(super) mismatch: Option<String>,
}

pub(super) struct Replay<'s> {
    system: &'s System,
    derivation: &'s Derivation,
    go_on: GoOn<'s>,
    /// Whether the assumptions have held so far.
    assumed: Option<Signal>,
}

/// One scan of a run with numbers.
struct Scan {
    inputs: Vec<u64>,
    values: Vec<u64>,
}

impl<'s> Replay<'s> {
    pub(super) fn new(
        system: &'s System,
        derivation: &'s Derivation,
        assumed: Option<Signal>,
        go_on: GoOn<'s>,
    ) -> Self {
        Self { system, derivation, go_on, assumed }
    }

    /// Repeats `trace`; it ends where one of `kept` is broken.
    pub(super) fn follow(&self, trace: &Trace, kept: &[&Resolved]) -> Followed {
        let relevant: BTreeSet<usize> = trace
            .signals
            .iter()
            .filter_map(|signal| match signal {
                Signal::Input(input) => Some(*input),
                Signal::Output(_) => None,
            })
            .collect();
        let mut cells = self.initial();
        let mut scans = Vec::with_capacity(trace.scans.len());
        let mut mismatch = None;
        let mut is_broken = false;
        for row in &trace.scans {
            let (scan, differs) = self.nearest(row, &relevant, &cells);
            if mismatch.is_none() {
                mismatch = differs;
            }
            cells = self.after(&scan);
            is_broken = kept.iter().any(|kept| !self.holds(kept, &scan, row));
            scans.push(scan);
            if is_broken {
                break;
            }
        }
        let run = self.is_known(&trace.signals).then(|| self.run(trace, &scans, is_broken));
        Followed { run, is_broken, mismatch }
    }

    /// Searches a run that breaks an invariant, with inputs at and between the constants of the programs.
    pub(super) fn search(&self, trace: &Trace, kept: &Resolved) -> Option<Run> {
        if !self.is_known(&trace.signals) {
            return None;
        }
        let pools: Vec<Vec<u64>> =
            (0..self.system.inputs.len()).map(|input| self.pool(input)).collect();
        let mut dice = Random(1);
        let mut left = (EVALUATIONS / self.system.terms.len().max(1)).max(SCANS);
        while left > 0 {
            if !(self.go_on)(Work::Scans(0)) {
                return None;
            }
            let mut cells = self.initial();
            let mut scans: Vec<Scan> = Vec::new();
            for _ in 0..SCANS {
                let row = ScanRow { inputs: Vec::new(), outputs: Vec::new() };
                let mut any = || {
                    left = left.saturating_sub(1);
                    let mut inputs = match scans.last() {
                        Some(last) => last.inputs.clone(),
                        None => vec![0; pools.len()],
                    };
                    for (value, pool) in inputs.iter_mut().zip(&pools) {
                        if scans.is_empty() || dice.below(3) == 0 {
                            *value = pool[dice.below(pool.len())];
                        }
                    }
                    self.scan(inputs, &cells)
                };
                let keeps = |scan: &Scan| self.assumed.is_none_or(|ok| self.value(ok, scan, &row));
                let scan = (0..TRIES).map(|_| any()).find(keeps);
                let Some(scan) = scan else { break };
                let is_broken = !self.holds(kept, &scan, &row);
                cells = self.after(&scan);
                scans.push(scan);
                if is_broken {
                    return Some(self.run(trace, &scans, true));
                }
            }
        }
        None
    }

    /// Values that matter for an input: one for each region, and the constants of its type.
    fn pool(&self, input: usize) -> Vec<u64> {
        let input = &self.system.inputs[input];
        if input.of == Elementary::Bool {
            return vec![0, 1];
        }
        let (least, greatest) = input.limits;
        let boundaries = self.derivation.boundaries.get(&input.term);
        let mut ends: Vec<i128> = boundaries.into_iter().flatten().copied().collect();
        ends.push(greatest);
        let mut above = least - 1;
        let mut pool = Vec::new();
        for end in ends {
            pool.extend(between(input.of, Some(above), Some(end)));
            above = end;
        }
        for constant in self.system.terms.constants(input.of) {
            let nearby = [constant, constant.wrapping_add(1), constant.wrapping_sub(1)];
            pool.extend(nearby.map(|value| value & input.of.mask()));
        }
        for number in [0.0, 1.0, -1.0, 0.5, 2.0, 10.0, 100.0] {
            pool.push(match input.of {
                Elementary::Real => u64::from((number as f32).to_bits()),
                Elementary::Lreal => f64::to_bits(number),
                of => number as i64 as u64 & of.mask(),
            });
        }
        let inside = |value: &u64| {
            position(input.of, *value).is_some_and(|at| least <= at && at <= greatest)
        };
        pool.retain(inside);
        pool.extend(between(input.of, Some(least - 1), Some(least)));
        pool.extend(between(input.of, Some(greatest - 1), Some(greatest)));
        if pool.is_empty() {
            pool.push(0);
        }
        pool
    }

    fn initial(&self) -> Vec<u64> {
        let cells = self.system.cells.iter();
        cells.map(|cell| cell.initial).collect()
    }

    fn scan(&self, inputs: Vec<u64>, cells: &[u64]) -> Scan {
        let values = self.system.terms.evaluate(|variable| match variable {
            Variable::Input(number) => inputs[number as usize],
            Variable::Cell(number) => cells[number as usize],
        });
        Scan { inputs, values }
    }

    fn after(&self, scan: &Scan) -> Vec<u64> {
        let cells = self.system.cells.iter();
        cells.map(|cell| scan.values[Terms::index(cell.next)]).collect()
    }

    fn holds(&self, kept: &Resolved, scan: &Scan, row: &ScanRow) -> bool {
        holds_in(kept, &|signal| self.value(signal, scan, row))
    }

    fn value(&self, signal: Signal, scan: &Scan, row: &ScanRow) -> bool {
        match signal {
            Signal::Output(output) => {
                scan.values[Terms::index(self.system.observed[output].1)] != 0
            }
            Signal::Input(input) => match self.derivation.meanings[input] {
                Meaning::Bit(number, bit) => scan.inputs[number as usize] >> bit & 1 == 1,
                _ => row.inputs.get(input).copied().unwrap_or(false),
            },
        }
    }

    /// Whether nothing that the signals depend on is a value that is not followed.
    fn is_known(&self, signals: &[Signal]) -> bool {
        let roots = signals.iter().filter_map(|signal| match signal {
            Signal::Output(output) => Some(self.system.observed[*output].1),
            Signal::Input(_) => None,
        });
        let cells = &self.system.cells;
        let terms = &self.system.terms;
        let reached = terms.reached(roots.collect(), |cell| cells[cell as usize].next);
        reached.into_iter().all(|term| !matches!(terms.node(term), Node::Unknown(_)))
    }

    /// The scan whose numbers agree with a row of the circuit, or the first one tried and a comparison that does not.
    fn nearest(
        &self,
        row: &ScanRow,
        relevant: &BTreeSet<usize>,
        cells: &[u64],
    ) -> (Scan, Option<String>) {
        let mut first = None;
        for attempt in 0..27 {
            let inputs = self.inputs(row, attempt);
            let scan = self.scan(inputs, cells);
            match self.mismatch(row, relevant, &scan) {
                None => return (scan, None),
                Some(mismatch) => {
                    first.get_or_insert((scan, Some(mismatch)));
                }
            }
        }
        first.unwrap_or_else(|| (self.scan(self.inputs(row, 0), cells), None))
    }

    /// Inputs in the regions of a row; `attempt` says where in each region.
    fn inputs(&self, row: &ScanRow, attempt: usize) -> Vec<u64> {
        let count = self.system.inputs.len();
        let mut inputs = vec![0_u64; count];
        let mut at_most: Vec<Option<i128>> = vec![None; count];
        for (input, meaning) in self.derivation.meanings.iter().enumerate() {
            let is = row.inputs.get(input).copied().unwrap_or(false);
            match *meaning {
                Meaning::Bit(number, bit) if is => inputs[number as usize] |= 1 << bit,
                Meaning::Boundary(term, boundary) if is => {
                    if let Node::Variable(Variable::Input(number)) = self.system.terms.node(term) {
                        let known = &mut at_most[*number as usize];
                        *known = Some(known.map_or(boundary, |known| known.min(boundary)));
                    }
                }
                _ => {}
            }
        }
        let mut choice = attempt;
        for (number, input) in self.system.inputs.iter().enumerate() {
            let (least, greatest) = input.limits;
            let Some(boundaries) = self.derivation.boundaries.get(&input.term) else {
                let is_followed = self.derivation.meanings.iter().any(
                    |meaning| matches!(meaning, Meaning::Bit(of, _) if *of as usize == number),
                );
                if is_followed {
                    // As the circuit does with its bits.
                    let limited = input.of.signed(inputs[number]).clamp(least, greatest);
                    inputs[number] = limited as u64 & input.of.mask();
                } else {
                    inputs[number] = some_value(input.of, least - 1, greatest, choice % 3);
                    choice /= 3;
                }
                continue;
            };
            let end = at_most[number];
            let above = match end {
                Some(end) => boundaries.range(..end).next_back(),
                None => boundaries.last(),
            };
            let above = above.copied().unwrap_or(least - 1);
            inputs[number] = some_value(input.of, above, end.unwrap_or(greatest), choice % 3);
            choice /= 3;
        }
        inputs
    }

    /// A comparison of the circuit that the numbers decide otherwise.
    fn mismatch(&self, row: &ScanRow, relevant: &BTreeSet<usize>, scan: &Scan) -> Option<String> {
        let terms = &self.system.terms;
        let mut so_far: Option<(Term, bool)> = None;
        for (input, meaning) in self.derivation.meanings.iter().enumerate() {
            let is = row.inputs.get(input).copied().unwrap_or(false);
            let (agrees, text) = match *meaning {
                Meaning::Boundary(term, boundary) => {
                    // A boundary is true where one before it is.
                    let before = so_far.is_some_and(|(known, is)| known == term && is);
                    let is = is || before;
                    so_far = Some((term, is));
                    let of = terms.of(term);
                    let at = position(of, scan.values[Terms::index(term)]);
                    let really = at.is_some_and(|at| at <= boundary);
                    let text =
                        format!("{} {}", self.system.describe(term), boundary_text(of, boundary));
                    (at.is_none() || really == is, text)
                }
                Meaning::Less(left, right) => {
                    let of = terms.of(left);
                    let place = |term| position(of, scan.values[Terms::index(term)]);
                    let really = match (place(left), place(right)) {
                        (Some(left), Some(right)) => left < right,
                        _ => is,
                    };
                    let text =
                        format!("{} < {}", self.system.describe(left), self.system.describe(right));
                    (really == is, text)
                }
                Meaning::NotANumber(term) => {
                    let of = terms.of(term);
                    let really = position(of, scan.values[Terms::index(term)]).is_none();
                    let text = format!("{} is NaN", self.system.describe(term));
                    (really == is, text)
                }
                Meaning::Bit(..) | Meaning::Equal(..) | Meaning::Free(..) => continue,
            };
            if !agrees && relevant.contains(&input) {
                return Some(text);
            }
        }
        None
    }

    fn run(&self, trace: &Trace, scans: &[Scan], is_broken: bool) -> Run {
        let is_bool = |signal: &Signal| match signal {
            Signal::Output(_) => true,
            Signal::Input(input) => match self.derivation.meanings[*input] {
                Meaning::Bit(number, _) => {
                    self.system.inputs[number as usize].of == Elementary::Bool
                }
                _ => false,
            },
        };
        let signals = trace.signals.iter().copied().filter(is_bool).collect();
        let rows = scans.iter().enumerate().map(|(place, scan)| {
            let empty = ScanRow { inputs: Vec::new(), outputs: Vec::new() };
            let row = trace.scans.get(place).unwrap_or(&empty);
            let inputs = 0..self.derivation.meanings.len();
            let outputs = 0..self.system.observed.len();
            ScanRow {
                inputs: inputs.map(|input| self.value(Signal::Input(input), scan, row)).collect(),
                outputs: outputs
                    .map(|output| self.value(Signal::Output(output), scan, row))
                    .collect(),
            }
        });
        let scans_of_trace = rows.collect();
        let inputs = self.system.inputs.iter().enumerate().map(|(place, input)| Driven {
            name: input.name.clone(),
            values: scans.iter().map(|scan| scan.inputs[place]).collect(),
        });
        Run {
            trace: Trace {
                signals,
                scans: scans_of_trace,
                again_from: trace.again_from.filter(|_| !is_broken),
            },
            numbers: self.numbers(trace, scans),
            inputs: inputs.collect(),
        }
    }

    /// Numbers that are compared, inputs that are numbers and that the run depends on, then outputs.
    fn numbers(&self, trace: &Trace, scans: &[Scan]) -> Vec<Row> {
        let mut inputs = BTreeSet::new();
        let roots = trace.signals.iter().filter_map(|signal| match signal {
            Signal::Output(output) => Some(self.system.observed[*output].1),
            Signal::Input(_) => None,
        });
        let cells = &self.system.cells;
        let terms = &self.system.terms;
        for term in terms.reached(roots.collect(), |cell| cells[cell as usize].next) {
            if let Node::Variable(Variable::Input(number)) = terms.node(term) {
                inputs.insert(*number);
            }
        }
        let inputs = inputs.into_iter().filter_map(|number| {
            let input = &self.system.inputs[number as usize];
            (input.of != Elementary::Bool).then_some((&input.name, input.term))
        });
        let shown = self.system.shown.iter().map(|(name, term)| (name, *term));
        let rows: Vec<(&String, Term)> = inputs.chain(shown).collect();
        let compared = self.system.numbers.iter().map(|(name, term)| (name, *term));
        let is_new = |(name, _): &(&String, Term)| rows.iter().all(|(known, _)| known != name);
        let compared: Vec<(&String, Term)> = compared.filter(is_new).collect();
        compared
            .into_iter()
            .chain(rows)
            .take(SHOWN)
            .map(|(name, term)| {
                let of = terms.of(term);
                let values = scans.iter();
                Row {
                    name: name.clone(),
                    values: values
                        .map(|scan| self.system.text(name, of, scan.values[Terms::index(term)]))
                        .collect(),
                }
            })
            .collect()
    }
}

/// A value above one boundary and at most at another: in the middle, at the lower or at the upper end.
fn some_value(of: Elementary, above: i128, at_most: i128, which: usize) -> u64 {
    let ends = match which {
        1 => (above, (above + 1 + i128::from(of.is_real())).min(at_most)),
        2 => ((at_most - 1 - i128::from(of.is_real())).max(above), at_most),
        _ => (above, at_most),
    };
    let value = between(of, Some(ends.0), Some(ends.1));
    value.or_else(|| between(of, Some(above), Some(at_most))).unwrap_or(0)
}
