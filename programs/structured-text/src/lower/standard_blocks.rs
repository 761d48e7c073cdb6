//! The blocks of the standard for control, and those of this library that they may be taken for.

use crate::library;
use crate::syntax::{Argument, Span};

use super::Lowering;

/// The input that says the time between two calls.
pub(super) const CYCLE: &str = "CYCLE";

impl Lowering<'_> {
    /// What is to be said of a block of the standard where it is given what it does not take.
    pub(super) fn counterpart(&self, unit: usize) -> Option<String> {
        let entry = &self.units[unit];
        let name = entry.unit.name.as_str();
        let other = library::counterpart(name).filter(|_| entry.is_library)?;
        let meaning = match name {
            "PID" => ", with PV - SP and without limits",
            _ => "",
        };
        let differs = match name {
            "PID" => " and limits, with SP - PV",
            _ => "",
        };
        Some(format!(
            "`{name}` is the block of IEC 61131-3, in REAL{meaning}; `{other}` is the one in LREAL{differs}"
        ))
    }

    /// Keeps a call that does not say how much time has passed.
    pub(super) fn needs_cycle(&mut self, unit: usize, arguments: &[Argument], span: &Span) {
        let called = self.units[unit].unit;
        let Some(place) = called.declarations.iter().position(|found| found.name.is(CYCLE)) else {
            return;
        };
        let mut named = arguments.iter();
        let is_given =
            named.any(|argument| matches!(argument, Argument::Given(name, _) if name.is(CYCLE)));
        if !is_given && arguments.len() <= place && self.silent == 0 && !self.in_library() {
            self.without_cycle.push((unit, span.clone()));
        }
    }

    /// Reports the calls without a CYCLE, where no statement and no initial value sets one.
    pub(super) fn calls_without_cycle(&mut self) {
        if self.sets_cycle {
            return;
        }
        for (unit, span) in std::mem::take(&mut self.without_cycle) {
            let name = self.units[unit].unit.name.as_str();
            let other = library::counterpart(name).unwrap_or(name);
            let message = format!("`{name}` is not given its CYCLE: no time passes for it");
            let help = format!(
                "write CYCLE := T#10ms, the time between two calls; `{other}` measures it, and calculates in LREAL"
            );
            self.error_with("U1049", message, span, help);
        }
    }
}
