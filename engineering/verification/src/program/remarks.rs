//! What is suspicious in any ladder, found by proof and shown by a run:
//!
//! ```text
//! U0443  no coil of a rung ever changes its target
//! U0444  two coils want different values of one target in one scan, and the order of the rungs decides
//! U0445  a coil sets its target, and always a coil further down resets it in the same scan
//! U0446  a target is set and reset in one scan, by a rung that reads it: the program runs through a step that nobody sees (avalanche)
//! ```
//!
//! A target is said once, by the most telling of the last three. The avalanche is that of Uzam and Gelen: states skipped within a scan, because
//! rungs are evaluated one after the other.

use std::time::Duration;

use understudy_ladder::{Coil, CoilKind, Element, LowerError, Program, Write, visit};
use understudy_logic::Circuit;
use understudy_text::Diagnostic;

use super::questions::{Questions, Target};
use super::search::{Found, Search};
use super::{Bounds, Subject};
use crate::property::Formula;
use crate::symbolic::{Cone, Resolved, ScanRow, Signal, Trace, rows};

/// Something suspicious.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// With its place in the ladder's text.
    pub diagnostic: Diagnostic,
    /// A run at whose end it happens, over the signals of [`Subject::circuit`]; nothing where the matter is that something never happens.
    pub trace: Option<Trace>,
}

/// All remarks, in the order of the rungs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Remarks {
    /// What was found.
    pub found: Vec<Remark>,
    /// Questions that were not decided within the bounds.
    pub undecided: usize,
}

impl Subject {
    /// What is suspicious about the order and the effect of the rungs that somebody wrote: those with a place in a text. Rungs that
    /// were made from statements have none.
    ///
    /// # Errors
    /// As [`Subject::new`].
    pub fn remarks(
        &self,
        program: &Program,
        period: Duration,
        bounds: Bounds<'_>,
    ) -> Result<Remarks, LowerError> {
        let coils = program.rungs.iter().flat_map(|rung| &rung.coils);
        if coils.map(|coil| coil.target.span()).all(|span| span.is_empty()) {
            return Ok(Remarks::default());
        }
        let (circuit, writes) = program.lower_writes(period)?;
        let questions = Questions::of(program, &circuit, &writes);
        let mut remarking = Remarking {
            subject: self,
            program,
            circuit: &circuit,
            search: Search::new(&questions.circuit, bounds),
            remarks: Remarks::default(),
        };
        for (rung, change) in questions.changes.iter().enumerate() {
            if let Some(change) = *change {
                remarking.effect(rung, change);
            }
        }
        for target in &questions.targets {
            remarking.target(target);
        }
        let mut remarks = remarking.remarks;
        remarks.found.sort_by_key(|remark| remark.diagnostic.span.start);
        Ok(remarks)
    }
}

fn coil(program: &Program, write: Write) -> &Coil {
    &program.rungs[write.rung].coils[write.coil]
}

fn output(output: usize) -> Resolved {
    Formula::Signal(Signal::Output(output))
}

struct Remarking<'a> {
    subject: &'a Subject,
    program: &'a Program,
    circuit: &'a Circuit,
    search: Search<'a>,
    remarks: Remarks,
}

impl Remarking<'_> {
    fn ask(&mut self, question: usize) -> Found {
        let found = self.search.ask(question);
        if matches!(found, Found::Unknown) {
            self.remarks.undecided += 1;
        }
        found
    }

    /// U0443.
    fn effect(&mut self, rung: usize, change: usize) {
        if self.search.is_seen(change) || !matches!(self.ask(change), Found::Never) {
            return;
        }
        let message =
            format!("rung {} has no effect: none of its coils ever changes a value", rung + 1);
        let place = self.program.rungs[rung].coils[0].target.span();
        let help = "remove the rung, or find the contact that never closes";
        self.remarks.found.push(Remark {
            diagnostic: Diagnostic::warning("U0443", message, place).with_help(help),
            trace: None,
        });
    }

    /// U0444 to U0446 of one target.
    fn target(&mut self, target: &Target) {
        let writes = &target.writes;
        for (place, &(lost_now, stays)) in target.sets.iter().enumerate() {
            if self.search.is_seen(stays) {
                continue;
            }
            // It happens, and it never happens that the target stays set.
            let Found::Yes(inputs) = self.ask(lost_now) else {
                continue;
            };
            if !matches!(self.ask(stays), Found::Never) {
                continue;
            }
            let (set, resets) =
                (writes[place], self.resets(&writes[place + 1..], &self.last(&inputs)));
            let message = format!(
                "`{}` is set in rung {} and reset in rung {} of the same scan, always: it is never set at the end of a scan",
                self.name(set),
                set.rung + 1,
                resets.rung + 1
            );
            let help = "swap the rungs, or let the reset ask for what was so before the set, by a memory bit";
            self.remark("U0445", message, help, [set, resets], inputs);
            return;
        }
        if let Found::Yes(inputs) = self.ask(target.through) {
            let resets = self.resets(&writes[1..], &self.last(&inputs));
            if self.reads_target(resets) {
                let message = format!(
                    "`{}` is set and reset in one scan: the program can run through it in one go (avalanche)",
                    self.name(resets)
                );
                let help = "reorder the rungs: the rung that leaves a step precedes the one that enters it";
                self.remark("U0446", message, help, [writes[0], resets], inputs);
                return;
            }
        }
        if let Found::Yes(inputs) = self.ask(target.race) {
            self.race(writes, inputs);
        }
    }

    /// U0444: the first pair that wants different values at the end of the run.
    fn race(&mut self, writes: &[Write], inputs: Vec<Vec<bool>>) {
        let last = self.last(&inputs);
        let acts = |write: Write| !self.kind(write).is_latch() || last.outputs[write.power];
        let after = |write: Write| last.outputs[write.after];
        let pairs = writes.iter().enumerate().flat_map(|(place, &later)| {
            let earlier = writes[..place].iter();
            earlier.map(move |&earlier| (earlier, later))
        });
        let mut differing = pairs.filter(|&(earlier, later)| {
            acts(earlier) && acts(later) && after(earlier) != after(later)
        });
        let Some((earlier, later)) = differing.next() else {
            return;
        };
        let message = format!(
            "the coils of `{}` in rungs {} and {} can assign different values in one scan; the order of the rungs decides, and rung {} wins",
            self.name(later),
            earlier.rung + 1,
            later.rung + 1,
            later.rung + 1
        );
        let help = "write it from one rung, or close out the one condition in the other rung";
        self.remark("U0444", message, help, [earlier, later], inputs);
    }

    fn kind(&self, write: Write) -> CoilKind {
        coil(self.program, write).kind
    }

    fn name(&self, write: Write) -> String {
        coil(self.program, write).target.to_string()
    }

    /// Whether the rung's network reads what its coil writes.
    fn reads_target(&self, write: Write) -> bool {
        let target = &coil(self.program, write).target;
        let mut reads = false;
        visit(&self.program.rungs[write.rung].network, &mut |element| {
            if let Element::Contact(contact) = element {
                reads |= contact.operand == *target;
            }
        });
        reads
    }

    /// What every coil does in the last scan of the run.
    fn last(&self, inputs: &[Vec<bool>]) -> ScanRow {
        let mut told = rows(self.circuit, &Cone::default(), inputs.to_vec());
        told.scans.pop().expect("a run has a scan")
    }

    /// The coil that resets the target in that scan.
    fn resets(&self, writes: &[Write], last: &ScanRow) -> Write {
        let falling = writes
            .iter()
            .rev()
            .find(|write| last.outputs[write.before] && !last.outputs[write.after]);
        *falling.unwrap_or(&writes[writes.len() - 1])
    }

    fn remark(
        &mut self,
        code: &'static str,
        message: String,
        help: &str,
        [first, second]: [Write; 2],
        inputs: Vec<Vec<bool>>,
    ) {
        let name = self.name(second);
        let [first, second] = [first, second].map(|write| coil(self.program, write).target.span());
        let diagnostic = Diagnostic::warning(code, message, second)
            .with_related(first, "the other coil")
            .with_help(help);
        let outputs = self.subject.circuit().outputs();
        let target = outputs.iter().position(|output| output.name == name);
        let trace = target.map(|index| {
            let cone = Cone::of(self.subject.circuit(), [&output(index)]);
            rows(self.subject.circuit(), &cone, inputs)
        });
        self.remarks.found.push(Remark { diagnostic, trace });
    }
}
