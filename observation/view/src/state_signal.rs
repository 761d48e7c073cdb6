//! The state of a program by name: its variables, and the parts of those that have some, such as `pause.ET` of a timer.
//!
//! Their values in a cycle are those after its scan, recomputed from the samples in the journal.

use std::collections::BTreeSet;

use serde_json::Value;
use understudy_cluster::Controller;
use understudy_typed::{Elementary, Enumeration, Part};
use understudy_wire::{ProgramHash, ProgramId};

use crate::error::ViewError;
use crate::history::History;
use crate::model::Model;
use crate::value::{number, shown};

/// Signals of one program that are listed, at most; the first ones.
const MAXIMUM_SIGNALS: usize = 2000;

/// A signal in the state of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateSignal {
    /// Its name, such as `pressing` or `pid.integral`.
    pub name: String,
    /// Its type, such as `BOOL`.
    pub of: String,
    /// Its address, such as `%MX0.0`.
    pub address: Option<String>,
    /// Its description.
    pub description: Option<String>,
    /// Its program.
    program: ProgramHash,
    /// The variable of the program that it is.
    part: Part,
}

impl Model {
    /// The signals in the state of the program that runs; nothing where the cluster has no such program.
    pub fn state_signals(&self, program: ProgramId) -> Vec<StateSignal> {
        let version = self.running_version(program);
        version.map_or_else(Vec::new, |version| state_signals_of(version.controller()))
    }

    /// The values of signals in the state of a program after the scan of a cycle; null where an online change had another program there, without a signal
    /// of that name and type.
    ///
    /// # Errors
    /// Where the cycle or the state is not known.
    pub fn state_values(
        &self,
        program: ProgramId,
        cycle: i64,
        signals: &[StateSignal],
    ) -> Result<Vec<Value>, ViewError> {
        let history = self.history_of(program)?;
        let place = history.place_of(cycle).ok_or_else(|| self.no_cycle(program, cycle))?;
        self.state_values_at(history, place, signals)
    }

    fn state_values_at(
        &self,
        history: &History,
        place: usize,
        signals: &[StateSignal],
    ) -> Result<Vec<Value>, ViewError> {
        let version = self.version_at(history, place)?;
        let state = self.state_after(history, place)?;
        let own = signals.iter().map(|signal| version.signal(signal));
        Ok(own.map(|own| own.map_or(Value::Null, |own| own.in_state(&state))).collect())
    }

    /// x(t+1) of the program that took the sample of a step, in the order of its variables.
    pub(crate) fn state_after(
        &self,
        history: &History,
        place: usize,
    ) -> Result<Vec<u64>, ViewError> {
        let (version, mut state) = self.typed_state_at(history, place)?;
        let sampled = self.sampled_at(history, place)?;
        let mut outputs = vec![0; sampled.outputs.words().len()];
        version.interpreter().step(&mut state, sampled.inputs.words(), &mut outputs);
        Ok(state)
    }

    /// The values of signals in the state of a program after each scan from one cycle to another, as far as they are known; the newest
    /// `most` cycles of these. It scans the program for each of them.
    pub fn state_trend(
        &self,
        program: ProgramId,
        (from, to): (i64, i64),
        signals: &[StateSignal],
        most: usize,
    ) -> Vec<(i64, Vec<Value>)> {
        let Some(history) = self.history(program) else {
            return Vec::new();
        };
        let steps = history.steps().iter().enumerate();
        let wanted = steps.filter(|(_, step)| (from..=to).contains(&step.cycle) && !step.void);
        let newest = wanted.rev().take(most);
        let values = newest.filter_map(|(place, step)| {
            let values = self.state_values_at(history, place, signals).ok()?;
            Some((step.cycle, values))
        });
        let mut values: Vec<(i64, Vec<Value>)> = values.collect();
        values.reverse();
        // Of a cycle of which several records tell, the last counts, as in all other views.
        values.dedup_by(|later, earlier| {
            let same = later.0 == earlier.0;
            if same {
                std::mem::swap(later, earlier);
            }
            same
        });
        values
    }

    /// The newest cycle of a program after which its whole state is known, and that state as stations hold it; `hash` is that of the program whose state
    /// is wanted.
    ///
    /// # Errors
    /// Where no cycle of the program has one, and where the run has another program there.
    pub fn newest_state(
        &self,
        program: ProgramId,
        hash: ProgramHash,
    ) -> Result<(i64, Vec<u64>), ViewError> {
        let history = self.history_of(program)?;
        let steps = history.steps().iter().rev().filter(|step| !step.void);
        let mut sampled = steps.filter_map(|step| Some((step.cycle, step.sampled.as_ref()?)));
        let (cycle, sampled) = sampled.next().ok_or_else(|| self.no_cycle(program, 0))?;
        let controller = self.controller_at(program, Some(cycle));
        let controller = controller.filter(|controller| controller.hash == hash);
        let code = &controller.ok_or_else(|| self.other_program(program, cycle))?.code;
        Ok((cycle, code.after_scan(sampled.state.words(), sampled.inputs.words())))
    }
}

impl StateSignal {
    /// The program whose state has it.
    pub(crate) fn program(&self) -> ProgramHash {
        self.program
    }

    /// Its names of values, where it is of an enumeration.
    pub fn values(&self) -> Option<&Enumeration> {
        self.part.values.as_deref()
    }

    /// A number of [`Model::state_values`] as [`crate::value_of`] has the value of a point.
    pub fn shown(&self, number: Value) -> Value {
        match self.part.declared().zip(number.as_i64()) {
            Some((declared, stored)) => shown(&declared, stored as u64 & declared.of.mask()),
            None => number,
        }
    }

    /// Its type; nothing where it has parts.
    pub fn elementary(&self) -> Option<Elementary> {
        self.part.of.elementary()
    }

    /// Its stored value in a state of its program, in the order of its variables.
    pub fn stored(&self, state: &[u64]) -> Option<u64> {
        self.part.stored(state).map(|(_, stored)| stored)
    }

    fn in_state(&self, state: &[u64]) -> Value {
        self.part.stored(state).map_or(Value::Null, |(of, stored)| number(of, stored))
    }
}

/// The signals in the state of the program of a controller: all that has a value of its own and is no input and no output.
pub fn state_signals_of(controller: &Controller) -> Vec<StateSignal> {
    let typed = controller.code.typed();
    let interface = &controller.interface;
    let points = interface.inputs.iter().chain(interface.outputs.iter());
    let own: BTreeSet<u64> = points.map(|point| u64::from(point.slot)).collect();
    let names: BTreeSet<&str> = interface.inputs.names().chain(interface.outputs.names()).collect();
    let is_point = |name: &str| names.contains(name);
    let mut signals = Vec::new();
    for variable in &typed.variables {
        let end = 64 * (u64::from(variable.slot) + variable.of.slots());
        let mut address = 64 * u64::from(variable.slot);
        while address < end && signals.len() < MAXIMUM_SIGNALS {
            let part = typed.part_at(address).filter(|part| part.address == address);
            let declared = part.as_ref().and_then(|part| part.declared());
            let bits = declared.as_ref().map_or(64, |declared| u64::from(declared.of.bits()));
            if let Some((part, declared)) = part.zip(declared)
                && !own.contains(&(address / 64))
                // Elements of an array of points have slots of their own besides.
                && !is_point(&part.name)
            {
                let is_whole = part.name == variable.name;
                signals.push(StateSignal {
                    name: part.name.clone(),
                    of: declared.to_string(),
                    address: variable.address.clone().filter(|_| is_whole),
                    description: variable.description.clone().filter(|_| is_whole),
                    program: controller.hash,
                    part,
                });
            }
            // Elements of an array may share a slot; all else begins at one.
            let next = address + bits;
            let shares = typed.part_at(next).is_some_and(|part| part.address == next);
            address = if shares { next } else { (address / 64 + 1) * 64 };
        }
    }
    signals
}
