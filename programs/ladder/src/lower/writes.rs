//! What every coil does in a scan, as outputs of a circuit: for proofs about the order of rungs.

use std::time::Duration;

use understudy_logic::{Circuit, Expression};

use super::{LowerError, Lowering, validate};
use crate::program::Program;

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

impl Program {
    /// A circuit whose outputs say what every coil does, and the coils in the order of the scan.
    ///
    /// # Errors
    /// As [`Program::lower`].
    pub fn lower_writes(&self, period: Duration) -> Result<(Circuit, Vec<Write>), LowerError> {
        validate(self, period)?;
        let mut lowering = Lowering::new(self, period);
        let mut writes = Vec::new();
        let mut shown: Vec<(String, Expression)> = Vec::new();
        for (place, rung) in self.rungs.iter().enumerate() {
            let rail = lowering.graph.constant(true);
            let power = lowering.series(&rung.network, rail);
            for (number, coil) in rung.coils.iter().enumerate() {
                let target = lowering.places[coil.target.as_str()];
                let before = lowering.read(target);
                lowering.coil(coil.kind, &coil.target, power);
                let after = lowering.read(target);
                let mut show = |what: &str, value| {
                    shown.push((format!("rung {place} coil {number} {what}"), value));
                    shown.len() - 1
                };
                writes.push(Write {
                    rung: place,
                    coil: number,
                    power: show("power", power),
                    before: show("before", before),
                    after: show("after", after),
                });
            }
        }
        Ok((lowering.finish(self, shown), writes))
    }
}
