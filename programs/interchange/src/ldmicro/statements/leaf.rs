//! Elements that do more than to pass power: one-shots, timers, counters, calculations.

use understudy_text::Diagnostic;

use super::super::parse::{Counter, Edge, Element, Kind};
use super::{Use, Writer};

impl Writer {
    pub(super) fn acting_leaf(
        &mut self,
        element: &Element,
        power: String,
        is_last: bool,
    ) -> String {
        let span = &element.span;
        match &element.kind {
            Kind::Edge(Edge::Rising) => {
                let block = self.helper("one_shot", "R_TRIG");
                self.line(&format!("{block}(CLK := {power});"), span);
                format!("{block}.Q")
            }
            Kind::Edge(Edge::Falling) => {
                // Unlike an F_TRIG, it does not fire in the first cycle.
                let (shot, before) =
                    (self.helper("one_shot", "BOOL"), self.helper("one_shot_before", "BOOL"));
                let power = self.held(power, span);
                self.line(&format!("{shot} := NOT {power} AND {before};"), span);
                self.line(&format!("{before} := {power};"), span);
                shot
            }
            Kind::Retentive(name, delay) => {
                let name = self.name(name, Use::Number, span);
                let scans = delay.as_nanos().div_ceil(self.period.as_nanos()).max(1);
                if scans > 0x7fff {
                    let message =
                        format!("the timer counts {scans} cycles, more than 16 bits hold");
                    self.diagnostics.push(Diagnostic::error("U1072", message, span.clone()));
                }
                let full = self.helper("full", "BOOL");
                let power = self.held(power, span);
                self.line(&format!("{full} := {name} >= {scans};"), span);
                self.line(
                    &format!("IF {power} AND {name} < {scans} THEN {name} := {name} + 1; END_IF;"),
                    span,
                );
                full
            }
            Kind::Timer(timer, name, delay) => {
                let is_new = !self.names.contains_key(name);
                let name = self.name(name, Use::Timer, span);
                if !is_new {
                    let message =
                        format!("two elements share the timer `{name}`, which is not supported");
                    self.diagnostics.push(Diagnostic::error("U1074", message, span.clone()));
                }
                self.blocks.push((name.clone(), timer));
                let delay = delay.as_micros();
                self.line(&format!("{name}(IN := {power}, PT := T#{delay}us);"), span);
                format!("{name}.Q")
            }
            Kind::Counter(counter, name, value) => {
                let limits = self.limits.get(name).copied().flatten();
                let name = self.name(name, Use::Number, span);
                let clock = self.helper("clock", "R_TRIG");
                let power = self.held(power, span);
                self.line(&format!("{clock}(CLK := {power});"), span);
                let step = match (counter, limits) {
                    (Counter::Up, Some((_, high))) => {
                        format!("IF {name} <= {high} THEN {name} := {name} + 1; END_IF;")
                    }
                    (Counter::Down, Some((low, _))) => {
                        format!("IF {name} >= {low} THEN {name} := {name} - 1; END_IF;")
                    }
                    (Counter::Up, None) => format!("{name} := {name} + 1;"),
                    (Counter::Down, None) => format!("{name} := {name} - 1;"),
                    (Counter::Circular, _) => format!(
                        "IF {name} >= {value} THEN {name} := 0; ELSE {name} := {name} + 1; END_IF;"
                    ),
                };
                self.line(&format!("IF {clock}.Q THEN {step} END_IF;"), span);
                match counter {
                    Counter::Circular => power,
                    Counter::Up | Counter::Down => format!("{name} >= {value}"),
                }
            }
            Kind::Reset(name) => {
                let power = if is_last { power } else { self.held(power, span) };
                let name = self.name(name, Use::Number, span);
                self.line(&format!("IF {power} THEN {name} := 0; END_IF;"), span);
                power
            }
            Kind::Move(to, from) => {
                let power = if is_last { power } else { self.held(power, span) };
                let (to, from) = (self.name(to, Use::Number, span), self.operand(from, span));
                self.line(&format!("IF {power} THEN {to} := {from}; END_IF;"), span);
                power
            }
            Kind::Calculate(sign, to, left, right) => {
                let power = if is_last { power } else { self.held(power, span) };
                let to = self.name(to, Use::Number, span);
                let (left, right) = (self.operand(left, span), self.operand(right, span));
                self.line(&format!("IF {power} THEN {to} := {left} {sign} {right}; END_IF;"), span);
                power
            }
            Kind::MasterRelay => {
                // It switches the rungs below it off, or on again where they are off.
                let power = self.held(power, span);
                self.line(&format!("rungs_run := NOT rungs_run OR {power};"), span);
                power
            }
            Kind::Comment(_)
            | Kind::Contacts(..)
            | Kind::Coil(..)
            | Kind::Wire(_)
            | Kind::Compare(..)
            | Kind::Parallel(_) => power,
        }
    }
}
