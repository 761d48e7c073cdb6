//! What every coil does in a scan, as outputs of a circuit: for proofs about the order of rungs.

use std::time::Duration;

use understudy_logic::Circuit;

use understudy_bits::Shown;

use super::{LowerError, validate};
use crate::program::{Coil, CoilKind, Contact, ContactKind, Element, Name, Program, Rung, Signal};

/// One coil, and by their index the outputs of the circuit that tell what it does in a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Write {
    /// From 0.
    pub rung: usize,
    /// Among the coils of its rung, from 0.
    pub coil: usize,
    /// The power that it gets.
    pub power: usize,
    /// Its target before it.
    pub before: usize,
    /// Its target behind it.
    pub after: usize,
}

fn contact(operand: &Name) -> Element {
    Element::Contact(Contact { kind: ContactKind::NormallyOpen, operand: operand.clone() })
}

/// A rung that keeps a signal in an output of its own.
fn keep(signal: &Name, output: &Name) -> Rung {
    let coils = vec![Coil { kind: CoilKind::Plain, target: output.clone() }];
    Rung { network: vec![contact(signal)], coils, ..Rung::default() }
}

impl Program {
    /// A circuit whose outputs say what every coil does, and the coils in the order of the scan.
    ///
    /// # Errors
    /// As [`Program::lower`].
    pub fn lower_writes(&self, period: Duration) -> Result<(Circuit, Vec<Write>), LowerError> {
        validate(self, period)?;
        let mut watched = Self { rungs: Vec::new(), ..self.clone() };
        let mut writes = Vec::new();
        for (place, rung) in self.rungs.iter().enumerate() {
            let mut show = |what: String| {
                let name = Name::from(format!("rung {place} {what}"));
                watched.outputs.push(Signal::new(name.clone()));
                (name, watched.outputs.len() - 1)
            };
            let (power, powered) = show("power".into());
            let coils = vec![Coil { kind: CoilKind::Plain, target: power.clone() }];
            let mut rungs = vec![Rung { coils, ..rung.clone() }];
            for (number, coil) in rung.coils.iter().enumerate() {
                let [before, after] =
                    ["before", "after"].map(|when| show(format!("coil {number} {when}")));
                rungs.push(keep(&coil.target, &before.0));
                let coils = vec![coil.clone()];
                rungs.push(Rung { network: vec![contact(&power)], coils, ..Rung::default() });
                rungs.push(keep(&coil.target, &after.0));
                let (before, after) = (before.1, after.1);
                writes.push(Write { rung: place, coil: number, power: powered, before, after });
            }
            watched.rungs.extend(rungs);
        }
        Ok((watched.exact(period, Shown { restarts: true, ..Shown::default() })?.circuit, writes))
    }
}
