//! Runs that show why a formula holds: a witness, or a counterexample of its negation.
//!
//! A run is found in the sets, and then told by evaluating the circuit itself on the inputs that were found. A run without end is a
//! *lasso*: it goes on from its last scan to an earlier one.

use understudy_logic::bdd::Diagram;
use understudy_logic::{Circuit, Running, Variable, pack, unpack};

use super::Signal;
use super::check::Ring;
use super::core::Core;
use super::model::{Cone, Model};
use crate::effort::Stopped;

/// One scan of a [`Trace`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScanRow {
    /// u, in the order of the circuit.
    pub inputs: Vec<bool>,
    /// y, in the order of the circuit.
    pub outputs: Vec<bool>,
}

/// A run from the first scan on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trace {
    /// What matters for it: the property's signals, then the other inputs that they depend on.
    pub signals: Vec<Signal>,
    /// At least one.
    pub scans: Vec<ScanRow>,
    /// After the last scan everything goes on as from this one; nothing where what comes later does not matter.
    pub again_from: Option<usize>,
}

impl Trace {
    /// The values of one signal, scan by scan.
    pub fn values(&self, signal: Signal) -> impl Iterator<Item = bool> + '_ {
        (0..self.scans.len()).map(move |scan| self.value(signal, scan))
    }

    /// The value of one signal in one scan.
    pub fn value(&self, signal: Signal, scan: usize) -> bool {
        match signal {
            Signal::Output(output) => self.scans[scan].outputs[output],
            Signal::Input(input) => self.scans[scan].inputs[input],
        }
    }
}

/// Scans that a run may have; a longer one is cut and goes on anyhow.
const MAXIMUM_SCANS: usize = 100_000;

/// x before a scan, and u in it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct State {
    registers: Vec<bool>,
    inputs: Vec<bool>,
}

/// Finds runs in the sets of a model.
pub(super) struct Tracer<'m, 'c> {
    model: &'m Model<'c>,
    running: Running,
}

impl<'m, 'c> Tracer<'m, 'c> {
    pub(super) fn new(model: &'m Model<'c>) -> Self {
        Self { model, running: Running::new(model.circuit) }
    }

    /// A run from one of the states `first`, all of which start from `registers` and satisfy `formula`; nothing where `formula` speaks of
    /// every way on.
    pub(super) fn trace(
        &self,
        formula: &Core,
        registers: &[bool],
        first: &Diagram,
    ) -> Result<Option<Trace>, Stopped> {
        if matches!(formula, Core::Not(inner) if inner.is_temporal()) {
            return Ok(None);
        }
        let nearest = self.nearest(formula, first)?;
        let Some(state) = self.pick(registers.to_vec(), &nearest)? else {
            return Ok(None);
        };
        let mut run = Run { states: vec![state], again_from: None };
        self.extend(&mut run, formula)?;
        Ok(Some(self.told(run)))
    }

    /// Those of `states`, all of which satisfy `formula`, from which the fewest scans show it.
    fn nearest(&self, formula: &Core, states: &Diagram) -> Result<Diagram, Stopped> {
        let model = self.model;
        let rings = match formula {
            Core::And(left, right) => {
                let shown = if shows(left) { left } else { right };
                return self.nearest(shown, states);
            }
            Core::Until(hold, end) => {
                let end = model.fair_only(&model.states(end)?)?;
                model.rings(&model.states(hold)?, &end)?
            }
            Core::Reaches(scans, end) => {
                let end = model.fair_only(&model.states(end)?)?;
                model.within(*scans, &end)?
            }
            _ => Vec::new(),
        };
        for ring in &rings {
            let near = model.diagrams.and(states, &ring.states)?;
            if !near.is_constant(false) {
                return Ok(near);
            }
        }
        Ok(states.clone())
    }

    /// Lengthens a run whose last state satisfies `formula` until it shows that.
    fn extend(&self, run: &mut Run, formula: &Core) -> Result<(), Stopped> {
        let model = self.model;
        match formula {
            Core::Constant(_) | Core::Signal(_) | Core::Not(_) => Ok(()),
            Core::And(left, right) => {
                // One run can show only one way on; the first that has one is shown.
                let shown = if shows(left) { left } else { right };
                self.extend(run, shown)
            }
            Core::Next(inner) => {
                let states = model.fair_only(&model.states(inner)?)?;
                self.step(run, &states)?;
                self.extend(run, inner)
            }
            Core::Until(hold, end) => {
                let (hold, last) = (model.states(hold)?, model.fair_only(&model.states(end)?)?);
                let rings = model.rings(&hold, &last)?;
                self.descend(run, &rings)?;
                self.extend(run, end)
            }
            Core::Reaches(scans, end) => {
                let last = model.fair_only(&model.states(end)?)?;
                let rings = model.within(*scans, &last)?;
                self.descend(run, &rings)?;
                self.extend(run, end)
            }
            Core::Stays(scans, inner) => {
                let kept = model.stays(*scans, &model.states(inner)?)?;
                for left in (0..*scans as usize).rev() {
                    self.step(run, &kept[left.min(kept.len() - 1)])?;
                }
                Ok(())
            }
            Core::Always(inner) => {
                let inside = model.always(&model.states(inner)?)?;
                self.lasso(run, &inside)
            }
        }
    }

    /// Walks from ring to ring until the innermost.
    fn descend(&self, run: &mut Run, rings: &[Ring]) -> Result<(), Stopped> {
        let within = |rings: &[Ring], state: &State| {
            let mut places = rings.iter();
            places.position(|ring| self.contains(&ring.states, state))
        };
        let Some(mut ring) = within(rings, run.last()) else {
            return Ok(());
        };
        while ring > 0 && run.states.len() < MAXIMUM_SCANS {
            // The last scan of a ring may change the inputs, those before it do not.
            for _ in 1..rings[ring].scans {
                self.wait(run);
            }
            self.step(run, &rings[ring - 1].states)?;
            ring = within(&rings[..ring], run.last()).unwrap_or(0);
        }
        Ok(())
    }

    /// Stays `inside`, which every state of it can, meets every condition of fairness, and comes back to where it was.
    fn lasso(&self, run: &mut Run, inside: &Diagram) -> Result<(), Stopped> {
        let model = self.model;
        while run.states.len() < MAXIMUM_SCANS {
            let start = run.states.len() - 1;
            self.step(run, inside)?;
            for condition in &model.fair {
                let end = model.diagrams.and(inside, condition)?;
                self.descend(run, &model.rings(inside, &end)?)?;
            }
            let back = self.only(&run.states[start])?;
            let rings = model.rings(inside, &back)?;
            let returns = rings.iter().any(|ring| self.contains(&ring.states, run.last()));
            if returns {
                self.descend(run, &rings)?;
                run.states.pop();
                run.again_from = Some(start);
                return Ok(());
            }
            // The start lies outside of what this run can come back to; from here on fewer states are left.
        }
        Ok(())
    }

    /// One scan on, into `states`.
    fn step(&self, run: &mut Run, states: &Diagram) -> Result<(), Stopped> {
        let registers = self.next(run.last());
        if let Some(state) = self.pick(registers, states)? {
            run.states.push(state);
        }
        Ok(())
    }

    /// One scan on, with unchanged inputs.
    fn wait(&self, run: &mut Run) {
        let last = run.last();
        let next = State { registers: self.next(last), inputs: last.inputs.clone() };
        run.states.push(next);
    }

    /// One of `states` with these registers; inputs that do not matter are 0.
    fn pick(&self, registers: Vec<bool>, states: &Diagram) -> Result<Option<State>, Stopped> {
        let here = self.model.with_registers(states, &registers)?;
        let Some(chosen) = self.model.diagrams.satisfying(&here) else {
            return Ok(None);
        };
        let mut inputs = vec![false; self.model.circuit.inputs().len()];
        for (variable, value) in chosen {
            if let Variable::Input(input) = variable {
                inputs[input as usize] = value;
            }
        }
        Ok(Some(State { registers, inputs }))
    }

    fn contains(&self, states: &Diagram, state: &State) -> bool {
        self.model.diagrams.value(states, |variable| match variable {
            Variable::Input(input) => state.inputs[input as usize],
            Variable::Register(register) => state.registers[register as usize],
        })
    }

    /// The set of one state, as far as the cone sees it.
    fn only(&self, state: &State) -> Result<Diagram, Stopped> {
        let model = self.model;
        let mut states = model.with_registers(&model.diagrams.constant(true), &state.registers)?;
        for &variable in &model.cone.variables {
            if let Variable::Input(input) = variable {
                let bit = model.diagrams.variable(variable)?;
                let literal =
                    if state.inputs[input as usize] { bit } else { model.diagrams.not(&bit)? };
                states = model.diagrams.and(&states, &literal)?;
            }
        }
        Ok(states)
    }

    /// x(t+1), by the circuit itself.
    fn next(&self, state: &State) -> Vec<bool> {
        let mut running = self.running.clone();
        running.go_to(&pack(state.registers.iter().copied()));
        running.step(&state.inputs);
        unpack(running.state(), state.registers.len())
    }

    fn told(&self, run: Run) -> Trace {
        let inputs = run.states.into_iter().map(|state| state.inputs);
        Trace {
            again_from: run.again_from,
            ..rows(self.model.circuit, &self.model.cone, inputs.collect())
        }
    }
}

/// The run from the first scan on with these inputs, one list a scan.
pub(crate) fn rows(circuit: &Circuit, cone: &Cone, inputs: Vec<Vec<bool>>) -> Trace {
    let mut running = Running::new(circuit);
    let rows = inputs.into_iter().map(|inputs| ScanRow { outputs: running.step(&inputs), inputs });
    Trace { signals: cone.shown(), scans: rows.collect(), again_from: None }
}

/// States one after the other.
struct Run {
    states: Vec<State>,
    again_from: Option<usize>,
}

impl Run {
    fn last(&self) -> &State {
        &self.states[self.states.len() - 1]
    }
}

/// Whether a run can show it.
fn shows(formula: &Core) -> bool {
    match formula {
        Core::Constant(_) | Core::Signal(_) | Core::Not(_) => false,
        Core::And(left, right) => shows(left) || shows(right),
        _ => true,
    }
}
