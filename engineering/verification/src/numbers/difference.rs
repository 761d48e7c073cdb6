//! Which outputs of a program can differ after an online change: the old program and the new one are followed together on the same inputs.

use understudy_bits::{AnyValue, InTheWay, Inexact, SameNames, Switch, System};
use understudy_logic::Circuit;
use understudy_typed::{Elementary, Program};

use super::{Answer, Model};
use crate::program::Bounds;
use crate::property::{Asked, Formula};
use crate::symbolic::{Resolved, Signal};

/// Two programs, ready for the question where they differ.
pub struct Difference {
    model: Model,
    /// For each output its name, and that both programs have it alike from the change on.
    outputs: Vec<(String, Resolved)>,
}

impl Difference {
    /// A program and the one that takes its place; `same` are the inputs and outputs that both have.
    ///
    /// # Errors
    /// What of them is not followed.
    pub fn between(
        before: &Program,
        after: &Program,
        switch: Switch<'_>,
        same: &SameNames,
    ) -> Result<Self, InTheWay> {
        let system = System::of_change(before, after, switch, same)?;
        let model = Model::of(system, 0, &Asked::default())?;
        let outputs = same.compared(before, after).into_iter().filter_map(|names| {
            let of = after.outputs.find(&names[1])?.of;
            let equal = model.alike(&names, of, switch);
            let [_, name] = names;
            Some((name, equal.always()))
        });
        let outputs = outputs.collect();
        Ok(Self { model, outputs })
    }

    /// The outputs that are compared, by their names after the change.
    pub fn outputs(&self) -> impl Iterator<Item = &str> {
        self.outputs.iter().map(|(name, _)| name.as_str())
    }

    /// The circuit whose signals runs show.
    pub fn circuit(&self) -> &Circuit {
        self.model.circuit()
    }

    /// The values that the new program takes over and that may be any here: what depends on them and is not proved to be alike is undecided.
    pub fn any_values(&self) -> &[AnyValue] {
        self.model.system.any_values()
    }

    /// What is not followed bit by bit: an output that is proved to be alike all the same is.
    pub fn inexact(&self) -> Option<Inexact> {
        self.model.exact_circuit().err()
    }

    /// For each output, in the order of [`Self::outputs`], whether both programs have it alike in every run; a run that fails ends with the scan in which
    /// they differ. `answered` is told each output that was decided.
    pub fn check(&self, bounds: Bounds<'_>, answered: &mut dyn FnMut()) -> Vec<Answer> {
        let properties: Vec<Resolved> =
            self.outputs.iter().map(|(_, alike)| alike.clone()).collect();
        self.model.check(&properties, &[], bounds, answered)
    }
}

impl Model {
    /// That two programs have an output alike in a scan after the change.
    fn alike(&self, names: &[String; 2], of: Elementary, switch: Switch<'_>) -> Resolved {
        let signal = |name: String| {
            let mut outputs = self.circuit().outputs().iter();
            let found = outputs.position(|output| output.name == name);
            found.map(|place| Formula::Signal(Signal::Output(place)))
        };
        let differs = || {
            let differs = signal(System::differs(&names[1]));
            differs.unwrap_or(Formula::Constant(false)).negated()
        };
        if of != Elementary::Bool {
            return differs();
        }
        let [old, new] = System::both_of(names).map(signal);
        let (Some(old), Some(new)) = (old, new) else {
            return differs();
        };
        let alike = Formula::Same(Box::new(old), Box::new(new));
        match (switch, signal(System::CHANGED.to_owned())) {
            (Switch::AnyScan { .. }, Some(changed)) => changed.implies(alike),
            _ => alike,
        }
    }
}
