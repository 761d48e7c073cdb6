//! A stand-in for a plant, which moves the inputs of a program one after the other, whatever its outputs are: a ladder where all signals are BOOL,
//! else Structured Text.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::time::Duration;

use understudy_ladder::{Language, MAXIMUM_PRESET_VALUE, Namer};
use understudy_text::duration;

use super::DraftProgram;
use super::signals::Signal;
use crate::read::MARK;

/// Signals of a plant that mean something of their own.
const SPECIAL: [&str; 4] = ["part_arrives", "handed_over", "finished", "plant_fault"];

/// Cycles in which all inputs of a small program come and go once.
const ROUND_CYCLES: usize = 100;

/// An input of a program with this suffix says that its channel is failed.
const FAILED: &str = ".failed";

pub(super) struct Stub<'a> {
    pub(super) program: &'a DraftProgram,
    language: Language,
    /// The name of the program of the stub.
    pub(super) unit: String,
    /// The signals of the program with the names of their terminals.
    pub(super) inputs: Vec<Named<'a>>,
    pub(super) outputs: Vec<Named<'a>>,
    /// Names of the stub's own.
    tick: String,
    pub(super) pace: String,
    pub(super) step: String,
    /// Of Structured Text, a name for each output as it was in the scan before.
    pub(super) before: Vec<String>,
}

/// A terminal of the plant, and the signal that it stands for.
pub(super) type Named<'a> = (String, &'a Signal);

/// How the inputs move.
pub(super) struct Round {
    /// Inputs that begin at different steps.
    pub(super) half: usize,
    /// Steps, of which each input is on for half.
    pub(super) steps: usize,
    /// From one step to the next.
    pub(super) pace: Duration,
}

impl<'a> Stub<'a> {
    pub(super) fn new(program: &'a DraftProgram) -> Self {
        let language = match program.signals.are_bits() {
            true => Language::Ladder,
            false => Language::StructuredText,
        };
        let mut namer = Namer::new(language);
        for name in SPECIAL {
            namer.name(name);
        }
        let mut terminals = |signals: &'a [Signal]| -> Vec<Named<'a>> {
            let named = signals.iter().map(|signal| (namer.name(&signal.name), signal));
            named.collect()
        };
        let inputs = terminals(&program.signals.inputs);
        let outputs = terminals(&program.signals.outputs);
        let step = match language {
            Language::Ladder => "step",
            // STEP is a word of charts.
            Language::StructuredText => "stage",
        };
        let [tick, pace, step] = ["tick", "pace", step].map(|name| namer.name(name));
        let before = outputs.iter().map(|(name, _)| namer.name(&format!("{name}_before")));
        let before = before.collect();
        let unit = namer.name(&(program.name.replace('-', "_") + "_plant"));
        Self { program, language, unit, inputs, outputs, tick, pace, step, before }
    }

    pub(super) fn file(&self) -> String {
        let ending = match self.language {
            Language::Ladder => "ladder",
            Language::StructuredText => "st",
        };
        format!("{}.{ending}", self.program.plant())
    }

    /// Terminals whose signals bear other names.
    pub(super) fn renamed(&self) -> impl Iterator<Item = (&str, &str)> {
        let all = self.inputs.iter().chain(&self.outputs);
        all.map(|(terminal, signal)| (terminal.as_str(), &*signal.name))
            .filter(|(terminal, signal)| terminal != signal)
    }

    pub(super) fn text(&self, period: Duration) -> String {
        match self.language {
            Language::Ladder => self.ladder(period),
            Language::StructuredText => super::statements::text(self, period),
        }
    }

    fn ladder(&self, period: Duration) -> String {
        let name = &self.program.name;
        let mut text = format!(
            "\
-- {MARK} a stand-in for the plant of `{name}`, so that the cluster runs before there is a model of the plant. It switches the
-- inputs of the program on, one after the other, then off again, and pays no attention to the outputs.
-- To make it real, replace the rungs of the inputs by what the plant does. Where a tank fills while a valve is open:
--     inlet {{TON filling 5s}} ( full )
-- Real equipment needs no such file: it is named in [remote_io.field] of the cluster file.
program {}

",
            self.unit
        );
        for (terminal, signal) in &self.outputs {
            declare(&mut text, "input ", terminal, signal, "");
        }
        text.push('\n');
        let (well, moving) = self.channels();
        for (terminal, signal) in &moving {
            declare(&mut text, "output", terminal, signal, "");
        }
        for (terminal, signal) in &well {
            declare(&mut text, "output", terminal, signal, " = 0");
        }
        text.push_str(
            "output finished  -- counted: how often the program has switched an output on\n",
        );
        self.push_moves(&mut text, &moving, period);
        self.push_finished(&mut text);
        text
    }

    /// The inputs that say that a channel is failed, and all others.
    pub(super) fn channels(&self) -> (Vec<&Named<'_>>, Vec<&Named<'_>>) {
        let names = self.inputs.iter().map(|(_, signal)| &*signal.name);
        let names: HashSet<&str> = names.collect();
        let says_failed = |(_, signal): &&Named<'_>| {
            let base = signal.name.strip_suffix(FAILED);
            base.is_some_and(|base| names.contains(base))
        };
        self.inputs.iter().partition(says_failed)
    }

    fn push_moves(&self, text: &mut String, inputs: &[&Named<'_>], period: Duration) {
        if inputs.is_empty() {
            return;
        }
        let Self { tick, pace, step, .. } = self;
        let Round { half, steps: round, pace: time } = Round::of(inputs.len(), period);
        let time = duration::text(time);
        let _ = write!(
            text,
            "\nmemory {tick}

rung \"the next step\"
    /{tick} {{TON {pace} {time}}} ( {tick} )
rung \"the steps of a round\"
    {tick} {{CTU {step} {round} R={step}.Q}}
rung \"each input is on for half a round\"
"
        );
        for (place, (terminal, _)) in inputs.iter().enumerate() {
            let from = place % half;
            let to = from + half;
            let title = if place == 0 { "" } else { "rung\n" };
            let _ =
                writeln!(text, "{title}    {step}.CV > {from} {step}.CV <= {to} ( {terminal} )");
        }
    }

    fn push_finished(&self, text: &mut String) {
        let edges: Vec<String> =
            self.outputs.iter().map(|(terminal, _)| format!("+{terminal}")).collect();
        let power = match edges.as_slice() {
            [only] => only.clone(),
            edges => format!("[ {} ]", edges.join("\n    | ")),
        };
        let _ = write!(text, "\nrung \"count what the program does\"\n    {power} ( finished )\n");
    }
}

impl Round {
    /// The round of this number of inputs, at least one.
    pub(super) fn of(inputs: usize, period: Duration) -> Self {
        let half = inputs.min(MAXIMUM_PRESET_VALUE as usize / 2);
        let cycles = (ROUND_CYCLES / (2 * half)).clamp(2, 10);
        Self { half, steps: 2 * half, pace: period * cycles as u32 }
    }
}

fn declare(text: &mut String, kind: &str, terminal: &str, signal: &Signal, initial: &str) {
    let note = signal.note.as_ref().map(|note| format!("  -- {note}"));
    let _ = writeln!(text, "{kind} {terminal}{initial}{}", note.unwrap_or_default());
}
