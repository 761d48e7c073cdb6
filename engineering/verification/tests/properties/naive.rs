//! The reference: CTL by lists of states, a fixed point a line.

use std::collections::HashMap;

use understudy_logic::{Circuit, Variable};
use understudy_verification::property::{Formula, Path};
use understudy_verification::symbolic::{Resolved, Signal};

/// Every state (x, u) of a circuit, by number: the bits of u above those of x.
pub(crate) struct Naive<'c> {
    circuit: &'c Circuit,
    states: usize,
    registers: usize,
    /// Where each state's scan leads: the registers, with u = 0.
    next: Vec<usize>,
    fair: Vec<Vec<bool>>,
    /// The states that there are: those that satisfy an assumption.
    there: Vec<bool>,
}

impl<'c> Naive<'c> {
    pub(crate) fn new(circuit: &'c Circuit, fair: &[Resolved]) -> Self {
        let registers = circuit.registers().len();
        let states = 1 << (registers + circuit.inputs().len());
        let mut naive = Self {
            circuit,
            states,
            registers,
            next: Vec::new(),
            fair: Vec::new(),
            there: vec![true; states],
        };
        naive.next = (0..states).map(|state| naive.scan(state)).collect();
        naive.fair = fair.iter().map(|condition| naive.satisfying(condition)).collect();
        naive
    }

    /// The same with the states alone that satisfy `assumed`.
    pub(crate) fn where_it_holds(self, assumed: &Resolved) -> Self {
        Self { there: self.satisfying(assumed), ..self }
    }

    fn bit(&self, state: usize, variable: Variable) -> bool {
        let place = match variable {
            Variable::Register(register) => register as usize,
            Variable::Input(input) => self.registers + input as usize,
        };
        state >> place & 1 == 1
    }

    fn scan(&self, state: usize) -> usize {
        let registers = self.circuit.registers().iter().enumerate();
        registers
            .map(|(place, register)| {
                let graph = self.circuit.graph();
                let bit = graph.evaluate(register.next, |variable| self.bit(state, variable));
                usize::from(bit) << place
            })
            .sum()
    }

    fn successors(&self, state: usize) -> impl Iterator<Item = usize> + '_ {
        let inputs = 0..1_usize << self.circuit.inputs().len();
        inputs.map(move |inputs| self.next[state] | inputs << self.registers)
    }

    fn before(&self, set: &[bool]) -> Vec<bool> {
        let enters = |state| self.successors(state).any(|next| set[next] && self.there[next]);
        (0..self.states).map(enters).collect()
    }

    fn until(&self, hold: &[bool], end: &[bool]) -> Vec<bool> {
        let mut set = end.to_vec();
        loop {
            let before = self.before(&set);
            let next: Vec<bool> =
                (0..self.states).map(|state| end[state] || hold[state] && before[state]).collect();
            if next == set {
                return set;
            }
            set = next;
        }
    }

    fn always(&self, hold: &[bool]) -> Vec<bool> {
        let mut set = hold.to_vec();
        let anywhere = vec![vec![true; self.states]];
        let conditions = if self.fair.is_empty() { &anywhere } else { &self.fair };
        loop {
            let mut next = set.clone();
            for condition in conditions {
                let end: Vec<bool> = set.iter().zip(condition).map(|(a, b)| *a && *b).collect();
                let reached = self.before(&self.until(hold, &end));
                for (kept, reached) in next.iter_mut().zip(reached) {
                    *kept &= reached;
                }
            }
            if next == set {
                return set;
            }
            set = next;
        }
    }

    fn fairly(&self, set: &[bool]) -> Vec<bool> {
        let fair = self.always(&vec![true; self.states]);
        set.iter().zip(fair).map(|(a, b)| *a && b).collect()
    }

    pub(crate) fn satisfying(&self, formula: &Resolved) -> Vec<bool> {
        let of = |formula: &Resolved| self.satisfying(formula);
        let not = |set: Vec<bool>| -> Vec<bool> { set.into_iter().map(|bit| !bit).collect() };
        let both = |left: &Resolved, right: &Resolved, holds: fn(bool, bool) -> bool| {
            let pairs = of(left).into_iter().zip(of(right));
            pairs.map(|(left, right)| holds(left, right)).collect()
        };
        let everywhere = vec![true; self.states];
        match formula {
            Formula::Constant(value) => vec![*value; self.states],
            Formula::Signal(signal) => (0..self.states)
                .map(|state| match signal {
                    Signal::Input(input) => self.bit(state, Variable::Input(*input as u32)),
                    Signal::Output(output) => {
                        let value = self.circuit.outputs()[*output].value;
                        let graph = self.circuit.graph();
                        graph.evaluate(value, |variable| self.bit(state, variable))
                    }
                })
                .collect(),
            Formula::Not(inner) => not(of(inner)),
            Formula::And(left, right) => both(left, right, |a, b| a && b),
            Formula::Or(left, right) => both(left, right, |a, b| a || b),
            Formula::Implies(left, right) => both(left, right, |a, b| !a || b),
            Formula::Same(left, right) => both(left, right, |a, b| a == b),
            Formula::Next(Path::Some, inner) => self.before(&self.fairly(&of(inner))),
            Formula::Next(Path::All, inner) => not(self.before(&self.fairly(&not(of(inner))))),
            Formula::Eventually(Path::Some, inner) => {
                self.until(&everywhere, &self.fairly(&of(inner)))
            }
            Formula::Eventually(Path::All, inner) => not(self.always(&not(of(inner)))),
            Formula::Always(Path::Some, inner) => self.always(&of(inner)),
            Formula::Always(Path::All, inner) => {
                not(self.until(&everywhere, &self.fairly(&not(of(inner)))))
            }
            Formula::Until(Path::Some, left, right) => {
                self.until(&of(left), &self.fairly(&of(right)))
            }
            Formula::Until(Path::All, left, right) => {
                let (not_left, not_right) = (not(of(left)), not(of(right)));
                let lost: Vec<bool> =
                    not_left.iter().zip(&not_right).map(|(a, b)| *a && *b).collect();
                let lost = self.until(&not_right, &self.fairly(&lost));
                let never = self.always(&not_right);
                lost.iter().zip(never).map(|(a, b)| !a && !b).collect()
            }
            Formula::Within(Path::Some, scans, inner) => {
                let end = self.fairly(&of(inner));
                let mut set = end.clone();
                for _ in 0..*scans {
                    let before = self.before(&set);
                    set = end.iter().zip(before).map(|(a, b)| *a || b).collect();
                }
                set
            }
            Formula::Within(Path::All, scans, inner) => {
                let missing = not(of(inner));
                let mut set = self.fairly(&missing);
                for _ in 0..*scans {
                    let before = self.before(&set);
                    set = missing.iter().zip(before).map(|(a, b)| *a && b).collect();
                }
                not(set)
            }
        }
    }

    /// Whether every first scan satisfies it.
    pub(crate) fn holds(&self, formula: &Resolved) -> bool {
        let set = self.satisfying(formula);
        let registers = self.circuit.registers().iter().enumerate();
        let initial: usize =
            registers.map(|(place, register)| usize::from(register.initial) << place).sum();
        (0..1_usize << self.circuit.inputs().len())
            .map(|inputs| initial | inputs << self.registers)
            .all(|state| set[state] || !self.there[state])
    }

    /// Signals by their numbers, for reading traces.
    pub(crate) fn names(&self) -> HashMap<Signal, &str> {
        let outputs = self.circuit.outputs().iter().enumerate();
        let outputs = outputs.map(|(place, output)| (Signal::Output(place), output.name.as_str()));
        let inputs = self.circuit.inputs().iter().enumerate();
        let inputs = inputs.map(|(place, input)| (Signal::Input(place), input.as_str()));
        outputs.chain(inputs).collect()
    }
}
