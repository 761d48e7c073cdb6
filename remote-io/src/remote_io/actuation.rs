//! What is driven: proven outputs, the last proven ones for `hold_cycles` deadlines, then the fail-safe ones along their ramps; and whether the program
//! runs, as its proven outputs say.
//!
//! ```text
//!   Proved ── nothing is proved ──► Held ── hold_cycles are over ──► Falling (ramps) ── the ramps end ──► Safe
//!      ▲                              │                                  │                                │
//!      └───────────── an output is proved, and released ─────────────────┴────────────────────────────────┘
//!
//!   Running ── a proved output says that a fault has stopped it ──► Stopped ── release ──► Restarting ── a proved output says that it runs ──► Running
//! ```
//!
//! The states of the outputs are drawn in `docs/pictures/driven-output.dot`.

#[cfg(test)]
mod tests;

use understudy_cycle::{Descent, Fallback};
use understudy_wire::{Image, Source, StationId};

use crate::event::Missing;
use crate::selection::Selection;

/// What a remote I/O drives.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Actuation {
    /// Deadlines in a row at which nothing true was there.
    pub(super) missed: u32,
    pub(super) applied: Option<Applied>,
    /// The outputs that were proved last, as long as they may be held.
    proved: Option<Image>,
    /// The way to the fail-safe values, until all ramps have ended.
    descent: Option<Descent>,
    pub(super) execution: Execution,
}

/// Whether the program runs, as its proven outputs say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(super) enum Execution {
    /// It runs.
    #[default]
    Running,
    /// A program fault has stopped it, in all stations at once.
    Stopped,
    /// It is stopped, and the next sample resets it.
    Restarting,
}

/// What was applied at the last deadline.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Applied {
    pub(super) source: Source,
    pub(super) outputs: Image,
    /// Why nothing was proved, where nothing was.
    pub(super) missing: Option<Missing>,
}

impl Applied {
    /// Whether no station computes the program: its outputs are fail-safe, because none was received that could prove them.
    pub(super) fn is_of_no_station(&self) -> bool {
        let unproved = matches!(
            self.missing,
            Some(
                Missing::NoCycle
                    | Missing::NotSynchronised
                    | Missing::TwoErasures
                    | Missing::SecondFailure
            )
        );
        self.source == Source::FailSafe && unproved
    }

    /// Whether its outputs were proved.
    pub(super) fn is_proved(&self) -> bool {
        matches!(self.source, Source::Direct | Source::Reconstructed)
    }
}

impl Actuation {
    /// The outputs of a deadline, and the understudy of whose word they are a part.
    pub(super) fn apply(
        &mut self,
        selection: Selection,
        fallback: &Fallback,
    ) -> (&Applied, Option<StationId>) {
        let (outputs, source, word_of, missing) = match selection {
            Selection::Direct(outputs) => (outputs, Source::Direct, None, None),
            Selection::Reconstructed(outputs, understudy) => {
                (outputs, Source::Reconstructed, Some(understudy), None)
            }
            Selection::Missing(missing) => {
                self.missed = self.missed.saturating_add(1);
                let (outputs, source) = self.without_proof(fallback);
                (outputs, source, None, Some(missing))
            }
        };
        if missing.is_none() {
            self.missed = 0;
            self.descent = None;
            self.proved = Some(outputs.clone());
        }
        (self.applied.insert(Applied { source, outputs, missing }), word_of)
    }

    /// The outputs that are held, or the next ones on the way to the fail-safe values.
    fn without_proof(&mut self, fallback: &Fallback) -> (Image, Source) {
        if let Some(outputs) = &self.proved
            && self.missed <= fallback.hold_cycles
        {
            return (outputs.clone(), Source::Held);
        }
        self.forget_proved();
        if self.applied.as_ref().is_none_or(|it| it.source != Source::FailSafe) {
            self.fall_from_here(fallback);
        }
        (self.descend(fallback), Source::FailSafe)
    }

    /// The way to the fail-safe values begins where the outputs are now; there is none without ramps.
    fn fall_from_here(&mut self, fallback: &Fallback) {
        let applied = self.applied.as_ref().filter(|_| !fallback.ramps.is_empty());
        self.descent = applied.map(|applied| Descent::new(applied.outputs.clone()));
    }

    fn descend(&mut self, Fallback { fail_safe, ramps, .. }: &Fallback) -> Image {
        let Some(descent) = &mut self.descent else {
            return fail_safe.clone();
        };
        let outputs = descent.next(fail_safe, ramps);
        if outputs == *fail_safe {
            self.descent = None;
        }
        outputs
    }

    /// There are other fail-safe values or ramps: outputs that are fail-safe go on from where they are.
    pub(super) fn take_settings(&mut self, fallback: &Fallback) {
        self.descent = None;
        if self.applied.as_ref().is_some_and(|it| it.source == Source::FailSafe) {
            self.fall_from_here(fallback);
        }
    }

    /// What was proved before is not held any more.
    pub(super) fn forget_proved(&mut self) {
        self.proved = None;
    }

    /// Outputs have other places from now on.
    pub(super) fn carry(&mut self, moved: impl Fn(&Image) -> Image) {
        self.proved = self.proved.as_ref().map(&moved);
        if let Some(applied) = &mut self.applied {
            applied.outputs = moved(&applied.outputs);
        }
    }

    /// The operator releases a program that is stopped: the next sample resets it. Whether there is one.
    pub(super) fn release(&mut self) -> bool {
        let is_stopped = self.execution == Execution::Stopped;
        if is_stopped {
            self.execution = Execution::Restarting;
        }
        is_stopped
    }

    /// A sample resets the program: until an output is proved, it is as its last one says.
    pub(super) fn note_reset(&mut self) {
        self.execution = Execution::Stopped;
    }

    /// Proved outputs say whether a fault has stopped the program.
    pub(super) fn note_execution(&mut self, is_stopped: bool) {
        self.execution = match (is_stopped, self.execution) {
            (false, _) => Execution::Running,
            (true, Execution::Restarting) => Execution::Restarting,
            (true, _) => Execution::Stopped,
        };
    }
}
