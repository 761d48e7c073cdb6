//! The part of a circuit that a property depends on, as diagrams.

use std::cell::{Cell, OnceCell};
use std::collections::BTreeSet;

use understudy_logic::bdd::{Diagram, Diagrams, Substitution, depth_first_order};
use understudy_logic::{Circuit, Expression, Operation, Variable};

use super::core::Core;
use super::jumps::Jump;
use super::{Resolved, Signal, USUAL};
use crate::effort::{GoOn, Stopped, Work};

/// The inputs and registers that some signals depend on, now and later.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Cone {
    pub(crate) signals: BTreeSet<Signal>,
    pub(crate) variables: BTreeSet<Variable>,
}

impl Cone {
    pub(crate) fn of<'f>(
        circuit: &Circuit,
        formulas: impl IntoIterator<Item = &'f Resolved>,
    ) -> Self {
        let mut cone = Self::default();
        for formula in formulas {
            cone.signals.extend(formula.signals());
        }
        let mut pending: Vec<Expression> = Vec::new();
        for signal in &cone.signals {
            match signal {
                Signal::Output(output) => pending.push(circuit.outputs()[*output].value),
                Signal::Input(input) => {
                    cone.variables.insert(Variable::Input(*input as u32));
                }
            }
        }
        cone.follow(circuit, pending);
        cone
    }

    /// What some registers depend on, they included.
    pub(crate) fn of_registers(circuit: &Circuit, registers: &[usize]) -> Self {
        let mut cone = Self::default();
        let own = registers.iter().map(|&register| Variable::Register(register as u32));
        cone.variables.extend(own);
        let next = registers.iter().map(|&register| circuit.registers()[register].next);
        cone.follow(circuit, next.collect());
        cone
    }

    fn follow(&mut self, circuit: &Circuit, mut pending: Vec<Expression>) {
        let mut seen = BTreeSet::new();
        while let Some(expression) = pending.pop() {
            if !seen.insert(expression) {
                continue;
            }
            let operation = circuit.graph().operation(expression);
            if let Operation::Variable(variable) = operation
                && self.variables.insert(variable)
                && let Variable::Register(register) = variable
            {
                pending.push(circuit.registers()[register as usize].next);
            }
            pending.extend(operation.operands());
        }
    }

    /// Its registers, ascending.
    pub(crate) fn registers(&self) -> impl Iterator<Item = u32> {
        self.variables.iter().filter_map(|variable| match variable {
            Variable::Register(register) => Some(*register),
            Variable::Input(_) => None,
        })
    }

    /// The signals that it is about, then the other inputs that they depend on.
    pub(crate) fn shown(&self) -> Vec<Signal> {
        let inputs = self.variables.iter().filter_map(|variable| match variable {
            Variable::Input(input) => Some(Signal::Input(*input as usize)),
            Variable::Register(_) => None,
        });
        let others = inputs.filter(|input| !self.signals.contains(input));
        self.signals.iter().copied().chain(others).collect()
    }
}

/// The least steps of a search that are single scans. There are more where there are many registers: through a line of stations a part goes in about as
/// many scans as there are registers, and jumps of stations that work at the same time are large functions.
const SINGLE: usize = 64;

/// A circuit's part as diagrams over (x, u).
pub(super) struct Model<'c> {
    pub(super) circuit: &'c Circuit,
    wanted: GoOn<'c>,
    steps: Cell<u64>,
    pub(super) cone: Cone,
    pub(super) diagrams: Diagrams,
    /// u of the cone.
    inputs: Diagram,
    /// f of each register.
    pub(super) next: Vec<(Variable, Diagram)>,
    /// x := f(x, u).
    pub(super) step: Substitution,
    /// Scans of a fixed point that are single ones.
    pub(super) single: usize,
    jumps: OnceCell<Vec<Jump>>,
    signals: Vec<(Signal, Diagram)>,
    /// Each comes again and again in a fair run.
    pub(super) fair: Vec<Diagram>,
    /// From where a fair run goes on; nothing where every run is fair.
    pub(super) fair_states: Option<Diagram>,
}

impl<'c> Model<'c> {
    pub(super) fn new(
        circuit: &'c Circuit,
        cone: Cone,
        fair: &[Resolved],
        diagrams: impl FnOnce(Vec<Variable>) -> Diagrams,
        single: Option<usize>,
        go_on: GoOn<'c>,
    ) -> Result<Self, Stopped> {
        let graph = circuit.graph();
        let registers: Vec<u32> = cone.registers().collect();
        let diagrams = diagrams(order(circuit, &cone, &registers));
        // What many registers need in a good order takes longer to reorder than to compute.
        diagrams.expect(USUAL * registers.len());
        let inputs = cone.variables.iter().copied();
        let inputs = inputs.filter(|variable| matches!(variable, Variable::Input(_)));
        let inputs = diagrams.product(inputs)?;
        let mut builder = diagrams.builder(graph, |variable| variable);
        let mut pairs = Vec::with_capacity(registers.len());
        for &register in &registers {
            if !go_on(Work::Diagrams { steps: 0, nodes: diagrams.nodes() }) {
                return Err(Stopped::Time);
            }
            let next = builder.diagram(circuit.registers()[register as usize].next)?;
            pairs.push((Variable::Register(register), next));
        }
        drop(builder);
        let step = diagrams.substitution(pairs.iter().cloned())?;
        let mut model = Self {
            circuit,
            wanted: go_on,
            steps: Cell::new(0),
            cone,
            diagrams,
            inputs,
            next: pairs,
            step,
            single: single.unwrap_or(SINGLE.max(registers.len() / 4 * 5)),
            jumps: OnceCell::new(),
            signals: Vec::new(),
            fair: Vec::new(),
            fair_states: None,
        };
        model.show_signals()?;
        for condition in fair {
            let condition = model.states(&Core::of(condition))?;
            model.fair.push(condition);
        }
        if !model.fair.is_empty() {
            let everywhere = model.diagrams.constant(true);
            model.fair_states = Some(model.always(&everywhere)?);
        }
        Ok(model)
    }

    /// The same part of the circuit for a property with the signals of `cone`.
    pub(super) fn show(&mut self, cone: Cone) -> Result<(), Stopped> {
        debug_assert_eq!(self.cone.variables, cone.variables);
        self.cone = cone;
        self.show_signals()
    }

    /// Makes the diagrams of the signals, and drops those of others.
    fn show_signals(&mut self) -> Result<(), Stopped> {
        self.signals.clear();
        let mut builder = self.diagrams.builder(self.circuit.graph(), |variable| variable);
        for &signal in &self.cone.signals {
            let diagram = match signal {
                Signal::Output(output) => builder.diagram(self.circuit.outputs()[output].value)?,
                Signal::Input(input) => self.diagrams.variable(Variable::Input(input as u32))?,
            };
            self.signals.push((signal, diagram));
        }
        Ok(())
    }

    pub(super) fn signal(&self, signal: Signal) -> &Diagram {
        let found = self.signals.iter().find(|(known, _)| *known == signal);
        &found.expect("a signal of the cone").1
    }

    /// Counts a step, and ends when the caller no longer waits.
    pub(super) fn goes_on(&self) -> Result<(), Stopped> {
        self.steps.set(self.steps.get() + 1);
        let work = Work::Diagrams { steps: self.steps.get(), nodes: self.diagrams.nodes() };
        if (self.wanted)(work) { Ok(()) } else { Err(Stopped::Time) }
    }

    /// Made on first use.
    pub(super) fn jumps(&self) -> Result<&[Jump], Stopped> {
        if self.jumps.get().is_none() {
            // The cell is empty, so this cannot fail.
            let _ = self.jumps.set(Jump::all(self)?);
        }
        Ok(self.jumps.get().map_or(&[], Vec::as_slice))
    }

    /// EX `set`.
    pub(super) fn before(&self, set: &Diagram) -> Result<Diagram, Stopped> {
        self.goes_on()?;
        let some_input = self.diagrams.exists(set, &self.inputs)?;
        Ok(self.diagrams.substitute(&some_input, &self.step)?)
    }

    /// The states of `set` whose registers are `registers`, of which those of the cone count.
    pub(super) fn with_registers(
        &self,
        set: &Diagram,
        registers: &[bool],
    ) -> Result<Diagram, Stopped> {
        let mut states = set.clone();
        for &variable in self.cone.variables.iter().rev() {
            let Variable::Register(register) = variable else {
                continue;
            };
            let bit = self.diagrams.variable(variable)?;
            let literal =
                if registers[register as usize] { bit } else { self.diagrams.not(&bit)? };
            states = self.diagrams.and(&states, &literal)?;
        }
        Ok(states)
    }
}

/// What a reader meets together comes together: each register before what its function depends on, from the signals on.
fn order(circuit: &Circuit, cone: &Cone, registers: &[u32]) -> Vec<Variable> {
    let outputs = cone.signals.iter().filter_map(|signal| match signal {
        Signal::Output(output) => Some(circuit.outputs()[*output].value),
        Signal::Input(_) => None,
    });
    let next = registers.iter().map(|&register| circuit.registers()[register as usize].next);
    let roots: Vec<Expression> = outputs.chain(next).collect();
    let mut order = depth_first_order(circuit.graph(), &roots);
    let placed: BTreeSet<Variable> = order.iter().copied().collect();
    order.extend(cone.variables.difference(&placed).copied());
    order
}
