//! Scans one after the other as clauses, after Tseitin: a variable an operation and scan.

use std::cell::Cell;
use std::collections::{HashMap, HashSet};

use batsat::{Callbacks, Lit, Solver, SolverInterface, SolverOpts, lbool};
use understudy_logic::{Circuit, Expression, Operation, Variable};

use crate::effort::{GoOn, Work};
use crate::property::Formula;
use crate::symbolic::{Cone, Resolved, Signal};

/// How much of its search a solver may do.
#[derive(Clone)]
pub(super) struct Patience<'g> {
    pub(super) go_on: GoOn<'g>,
    /// Number of scans so far, for the progress.
    pub(super) scans: u32,
    /// Steps of the search that are left; none after the first refusal.
    pub(super) steps: Cell<u64>,
}

impl Callbacks for Patience<'_> {
    fn stop(&self) -> bool {
        let left = self.steps.get();
        let wanted =
            left > 0 && (!left.is_multiple_of(64) || (self.go_on)(Work::Scans(self.scans)));
        self.steps.set(if wanted { left - 1 } else { 0 });
        !wanted
    }
}

/// The scans so far.
pub(super) struct Unrolling<'c> {
    circuit: &'c Circuit,
    solver: Solver<Patience<'c>>,
    one: Lit,
    /// Registers of the cone.
    registers: Vec<u32>,
    /// For each scan the registers before it, in the order of `registers`.
    before: Vec<Vec<Lit>>,
    /// For each scan the inputs and operations that were asked for.
    inputs: Vec<HashMap<u32, Lit>>,
    made: Vec<HashMap<Expression, Lit>>,
}

impl<'c> Unrolling<'c> {
    /// No scan yet; the first one starts from the initial registers, or from any.
    pub(super) fn new(
        circuit: &'c Circuit,
        cone: &Cone,
        from_start: bool,
        patience: Patience<'c>,
    ) -> Self {
        let mut solver = Solver::new(SolverOpts::default(), patience);
        let one = Lit::new(solver.new_var_default(), true);
        solver.add_clause_reuse(&mut vec![one]);
        let registers: Vec<u32> = cone.registers().collect();
        let first = registers.iter().map(|&register| {
            if !from_start {
                return Lit::new(solver.new_var_default(), true);
            }
            if circuit.registers()[register as usize].initial { one } else { !one }
        });
        let before = vec![first.collect()];
        Self { circuit, solver, one, registers, before, inputs: Vec::new(), made: Vec::new() }
    }

    /// Searches a first scan before which each of these pairs of registers is equal, added to their first values, and after which some pair is not; an
    /// absent register is the constant 0. `Some(None)` where there is no such scan, else those that are 1 after it; `None` where the search takes too long.
    pub(super) fn difference(
        &mut self,
        equal: &[(usize, Option<usize>)],
    ) -> Option<Option<HashSet<usize>>> {
        if self.made.is_empty() {
            self.begin_scan();
        }
        let mut assumed = Vec::new();
        let mut after = HashMap::new();
        let mut differ = Vec::new();
        for &(register, other) in equal {
            let (one, two) = (self.value(register), other.map(|other| self.value(other)));
            let both = [0, 1].map(|time: usize| match two {
                None => one[time],
                Some(two) => self.sum(one[time], two[time]),
            });
            assumed.push(!both[0]);
            differ.push(both[1]);
            after.insert(register, one[1]);
            after.extend(other.zip(two).map(|(other, two)| (other, two[1])));
        }
        let some = Lit::new(self.solver.new_var_default(), true);
        differ.push(!some);
        self.solver.add_clause_reuse(&mut differ);
        assumed.push(some);
        match self.solver.solve_limited(&assumed) {
            found if found == lbool::TRUE => {
                let ones = after.into_iter();
                let ones = ones.filter(|(_, one)| self.solver.value_lit(*one) == lbool::TRUE);
                Some(Some(ones.map(|(register, _)| register).collect()))
            }
            found if found == lbool::FALSE => Some(None),
            _ => None,
        }
    }

    /// A register before the first scan and after it, added to its first value.
    fn value(&mut self, register: usize) -> [Lit; 2] {
        let place = self.registers.binary_search(&(register as u32));
        let before = self.before[0][place.expect("a register of the cone")];
        let circuit = self.circuit;
        let of = &circuit.registers()[register];
        let both = [before, self.expression(of.next, 0)];
        both.map(|value| if of.initial { !value } else { value })
    }

    fn begin_scan(&mut self) {
        self.solver.cb_mut().scans += 1;
        self.inputs.push(HashMap::new());
        self.made.push(HashMap::new());
    }

    /// Adds a scan.
    pub(super) fn scan(&mut self) {
        self.begin_scan();
        let scan = self.made.len() - 1;
        let registers = self.registers.clone();
        let next = registers.into_iter().map(|register| {
            let next = self.circuit.registers()[register as usize].next;
            self.expression(next, scan)
        });
        let next = next.collect();
        self.before.push(next);
    }

    /// Requires the registers before `scan` to differ from those before each earlier one.
    pub(super) fn differ(&mut self, scan: usize) {
        for earlier in 0..scan {
            let pairs = self.before[earlier].iter().zip(&self.before[scan]);
            let pairs: Vec<(Lit, Lit)> = pairs.map(|(left, right)| (*left, *right)).collect();
            let mut some: Vec<Lit> =
                pairs.into_iter().map(|(left, right)| self.sum(left, right)).collect();
            self.solver.add_clause_reuse(&mut some);
        }
    }

    /// The truth of a formula of one scan.
    pub(super) fn literal(&mut self, formula: &Resolved, scan: usize) -> Lit {
        let mut of = |formula: &Resolved| self.literal(formula, scan);
        match formula {
            Formula::Constant(true) => self.one,
            Formula::Signal(Signal::Output(output)) => {
                let value = self.circuit.outputs()[*output].value;
                self.expression(value, scan)
            }
            Formula::Signal(Signal::Input(input)) => self.input(*input as u32, scan),
            Formula::Not(inner) => !of(inner),
            Formula::And(left, right) => {
                let (left, right) = (of(left), of(right));
                self.product(left, right)
            }
            Formula::Or(left, right) => {
                let (left, right) = (of(left), of(right));
                !self.product(!left, !right)
            }
            Formula::Implies(left, right) => {
                let (left, right) = (of(left), of(right));
                !self.product(left, !right)
            }
            Formula::Same(left, right) => {
                let (left, right) = (of(left), of(right));
                !self.sum(left, right)
            }
            // What speaks of later scans is kept out by the caller; nothing is claimed of it.
            _ => !self.one,
        }
    }

    /// Whether all that is required can hold together with `assumed`; nothing where the search was given up.
    pub(super) fn satisfiable(&mut self, assumed: Lit) -> Option<bool> {
        match self.solver.solve_limited(&[assumed]) {
            found if found == lbool::TRUE => Some(true),
            found if found == lbool::FALSE => Some(false),
            _ => None,
        }
    }

    pub(super) fn require(&mut self, literal: Lit) {
        self.solver.add_clause_reuse(&mut vec![literal]);
    }

    /// The inputs of a scan in the assignment that was found; those that do not matter are 0.
    pub(super) fn inputs(&self, scan: usize) -> Vec<bool> {
        let mut inputs = vec![false; self.circuit.inputs().len()];
        for (&input, &literal) in &self.inputs[scan] {
            inputs[input as usize] = self.solver.value_lit(literal) == lbool::TRUE;
        }
        inputs
    }

    fn input(&mut self, input: u32, scan: usize) -> Lit {
        let solver = &mut self.solver;
        let fresh = || Lit::new(solver.new_var_default(), true);
        *self.inputs[scan].entry(input).or_insert_with(fresh)
    }

    fn expression(&mut self, root: Expression, scan: usize) -> Lit {
        let circuit = self.circuit;
        let mut pending = vec![root];
        while let Some(&expression) = pending.last() {
            if self.made[scan].contains_key(&expression) {
                pending.pop();
                continue;
            }
            let operation = circuit.graph().operation(expression);
            let waiting = pending.len();
            let made = &self.made[scan];
            pending.extend(operation.operands().filter(|operand| !made.contains_key(operand)));
            if pending.len() > waiting {
                continue;
            }
            let of = |operand: Expression| self.made[scan][&operand];
            let literal = match operation {
                Operation::Constant(true) => self.one,
                Operation::Constant(false) => !self.one,
                Operation::Variable(Variable::Input(input)) => self.input(input, scan),
                Operation::Variable(Variable::Register(register)) => {
                    let place = self.registers.binary_search(&register);
                    self.before[scan][place.expect("the cone holds what its functions read")]
                }
                Operation::Not(operand) => !of(operand),
                Operation::And(left, right) => {
                    let (left, right) = (of(left), of(right));
                    self.product(left, right)
                }
                Operation::Or(left, right) => {
                    let (left, right) = (of(left), of(right));
                    !self.product(!left, !right)
                }
                Operation::Xor(left, right) => {
                    let (left, right) = (of(left), of(right));
                    self.sum(left, right)
                }
            };
            self.made[scan].insert(expression, literal);
        }
        self.made[scan][&root]
    }

    fn product(&mut self, left: Lit, right: Lit) -> Lit {
        let both = Lit::new(self.solver.new_var_default(), true);
        for clause in [&[!both, left][..], &[!both, right], &[both, !left, !right]] {
            self.solver.add_clause_reuse(&mut clause.to_vec());
        }
        both
    }

    fn sum(&mut self, left: Lit, right: Lit) -> Lit {
        let one = Lit::new(self.solver.new_var_default(), true);
        for clause in
            [[!one, left, right], [!one, !left, !right], [one, !left, right], [one, left, !right]]
        {
            self.solver.add_clause_reuse(&mut clause.to_vec());
        }
        one
    }
}
