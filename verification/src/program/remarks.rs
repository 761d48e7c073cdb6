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

use understudy_diagnostic::Diagnostic;
use understudy_ladder::{Coil, CoilKind, Element, LowerError, Program, Write, visit};
use understudy_logic::Circuit;

use super::sampled::Sampled;
use super::{Bounds, Subject};
use crate::property::Formula;
use crate::symbolic::{Checker, Cone, Resolved, Signal, Trace, Verdict, rows};

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

/// Nodes for one question: these are many, and none of them was asked for.
const NODES: usize = 200_000;

impl Subject {
    /// What is suspicious about the order and the effect of the rungs.
    ///
    /// # Errors
    /// As [`Subject::new`].
    pub fn remarks(
        &self,
        program: &Program,
        period: Duration,
        bounds: Bounds,
    ) -> Result<Remarks, LowerError> {
        let (circuit, writes) = program.lower_writes(period)?;
        let mut search = Search {
            subject: self,
            program,
            circuit: &circuit,
            nodes: bounds.nodes.min(NODES),
            remarks: Remarks::default(),
        };
        search.effects(&writes);
        for signal in program.writable() {
            let of_target = writes.iter().copied();
            let of_target = of_target.filter(|write| coil(program, *write).target == signal.name);
            search.target(&of_target.collect::<Vec<Write>>());
        }
        let mut remarks = search.remarks;
        remarks
            .found
            .sort_by_key(|remark| remark.diagnostic.span.start);
        Ok(remarks)
    }
}

fn coil(program: &Program, write: Write) -> &Coil {
    &program.rungs[write.rung].coils[write.coil]
}

fn output(output: usize) -> Resolved {
    Formula::Signal(Signal::Output(output))
}

fn any(formulas: impl Iterator<Item = Resolved>) -> Resolved {
    formulas.fold(Formula::Constant(false), |left, right| {
        Formula::Or(Box::new(left), Box::new(right))
    })
}

fn rises(write: Write) -> Resolved {
    output(write.before).negated().and(output(write.after))
}

fn falls(write: Write) -> Resolved {
    output(write.before).and(output(write.after).negated())
}

/// What one question came to.
enum Found {
    Never,
    /// In the last of these scans.
    Yes(Vec<Vec<bool>>),
    Unknown,
}

struct Search<'a> {
    subject: &'a Subject,
    program: &'a Program,
    circuit: &'a Circuit,
    nodes: usize,
    remarks: Remarks,
}

impl Search<'_> {
    /// U0443.
    fn effects(&mut self, writes: &[Write]) {
        let rungs = self.program.rungs.len();
        let changes: Vec<Resolved> = (0..rungs)
            .map(|rung| {
                let of_rung = writes.iter().filter(|write| write.rung == rung);
                any(of_rung.map(|write| {
                    Formula::Same(
                        Box::new(output(write.before)),
                        Box::new(output(write.after)),
                    )
                    .negated()
                }))
            })
            .collect();
        let sampled = Sampled::new(self.circuit, &changes);
        for (rung, change) in changes.iter().enumerate() {
            let Some(first) = self.program.rungs[rung].coils.first() else {
                continue;
            };
            if sampled.seen(rung).is_some() {
                continue;
            }
            match self.proved(change) {
                Found::Yes(_) => {}
                Found::Unknown => self.remarks.undecided += 1,
                Found::Never => {
                    let message = format!(
                        "rung {} has no effect: no coil of it ever changes anything",
                        rung + 1
                    );
                    let diagnostic = Diagnostic::warning("U0443", message, first.target.span());
                    let help = "leave the rung out, or look for a contact that never closes";
                    self.remarks.found.push(Remark {
                        diagnostic: diagnostic.with_help(help),
                        trace: None,
                    });
                }
            }
        }
    }

    /// U0444 to U0446 of one target, whose coils these are.
    fn target(&mut self, writes: &[Write]) {
        let Some((first, last)) = writes.first().zip(writes.last()) else {
            return;
        };
        if writes.len() < 2 {
            return;
        }
        let lost = output(last.after).negated();
        for (place, &set) in writes.iter().enumerate() {
            let rises = rises(set);
            let stays = rises.clone().and(lost.clone().negated());
            let undone = any(writes[place + 1..].iter().map(|&write| falls(write)));
            let lost_now = rises.clone().and(undone).and(lost.clone());
            // It happens, and it never happens that the target stays set.
            let Found::Yes(inputs) = self.happens(&lost_now) else {
                continue;
            };
            if matches!(self.happens(&stays), Found::Never) {
                let resets = self.resets(&writes[place + 1..], &inputs);
                let message = format!(
                    "`{}` is set in rung {} and reset in rung {} of the same scan, always: it is never seen set",
                    self.name(set),
                    set.rung + 1,
                    resets.rung + 1
                );
                let help = "swap the rungs, or let the reset ask for what was so before the set, by a memory bit";
                self.remark("U0445", message, help, [set, resets], inputs);
                return;
            }
        }
        let through = output(first.before)
            .negated()
            .and(any(writes.iter().map(|&write| rises(write))))
            .and(lost);
        if let Found::Yes(inputs) = self.happens(&through) {
            let resets = self.resets(&writes[1..], &inputs);
            if self.reads_target(resets) {
                let message = format!(
                    "`{}` is set and reset in one scan: the program can run through it in one go (avalanche)",
                    self.name(resets)
                );
                let help = "turn the rungs around, so that the rung that leaves a step stands above the one that enters it";
                self.remark("U0446", message, help, [*first, resets], inputs);
                return;
            }
        }
        self.race(writes);
    }

    /// U0444: the first pair that wants different values.
    fn race(&mut self, writes: &[Write]) {
        for (place, &later) in writes.iter().enumerate() {
            for &earlier in &writes[..place] {
                if earlier.rung == later.rung && self.kind(earlier) == self.kind(later) {
                    continue;
                }
                let differ = Formula::Same(
                    Box::new(output(earlier.after)),
                    Box::new(output(later.after)),
                )
                .negated();
                let both = self.acts(earlier).and(self.acts(later)).and(differ);
                let Found::Yes(inputs) = self.happens(&both) else {
                    continue;
                };
                let message = format!(
                    "the coils of `{}` in rungs {} and {} can want different values in one scan; the order of the rungs decides, and rung {} wins",
                    self.name(later),
                    earlier.rung + 1,
                    later.rung + 1,
                    later.rung + 1
                );
                let help =
                    "write it from one rung, or close out the one condition in the other rung";
                self.remark("U0444", message, help, [earlier, later], inputs);
                return;
            }
        }
    }

    /// When a coil writes at all.
    fn acts(&self, write: Write) -> Resolved {
        if self.kind(write).is_latch() {
            output(write.power)
        } else {
            Formula::Constant(true)
        }
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

    /// The coil that resets the target in the last scan of the run.
    fn resets(&self, writes: &[Write], inputs: &[Vec<bool>]) -> Write {
        let told = rows(self.circuit, &Cone::default(), inputs.to_vec());
        let last = &told.scans[told.scans.len() - 1].outputs;
        let falling = writes
            .iter()
            .rev()
            .find(|write| last[write.before] && !last[write.after]);
        *falling.unwrap_or(&writes[writes.len() - 1])
    }

    /// A run as short as can be, or one at random where the diagrams grow too large.
    fn happens(&mut self, question: &Resolved) -> Found {
        let found = self.proved(question);
        if !matches!(found, Found::Unknown) {
            return found;
        }
        let sampled = Sampled::new(self.circuit, std::slice::from_ref(question));
        match sampled.seen(0) {
            Some(seen) => Found::Yes(sampled.inputs(seen)),
            None => {
                self.remarks.undecided += 1;
                Found::Unknown
            }
        }
    }

    fn proved(&self, question: &Resolved) -> Found {
        let mut checker = Checker::new(self.circuit, Vec::new(), self.nodes);
        // `EF` asks it of every first scan, and one is enough here.
        match checker.check(&question.clone().negated().always()) {
            Ok(Verdict::Fails(Some(trace))) => {
                Found::Yes(trace.scans.into_iter().map(|scan| scan.inputs).collect())
            }
            Ok(Verdict::Holds(_)) => Found::Never,
            Ok(Verdict::Fails(None)) | Err(_) => Found::Unknown,
        }
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
