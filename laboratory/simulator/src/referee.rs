//! The reference run of one program, and whether the outputs that its remote I/O applied were true to it.
//!
//! The referee sees what was sampled (u(i), and the lineage that the sample extends) and what was applied. It follows no report
//! in which a member says what it decided. A lineage is a hash of an initial state and of all inputs since, so the referee
//! checks it against its own record instead of believing it.
//!
//! Invariants checked:
//!
//! - *No guess*: an applied output is h(x(t), u(t)) of the reference run, or the last true output for at most the configured
//!   cycles, or the configured fail-safe value.
//! - *Never back*: an applied output fixes the history. A later sample extends the state after the newest sample whose
//!   outputs were applied (the *floor*), or a state that later samples led to. A state before the floor is a violation,
//!   unless the operator has chosen it.
//!
//! ```text
//!   … ──u──► x ──u──► floor ──u──► x ──u──► x        a sample may extend the floor or any state behind it: what
//!   forgotten here is wrong     └──u──► x            was not applied may be void
//! ```
//!
//! A cold start is no violation by itself: the referee counts it, and [`crate::Simulation`], which knows the states of all
//! stations, reports one that was not necessary.

mod descent;
mod fallbacks;
mod pair;
mod points;
mod programs;
mod steps;
mod unrecorded;
mod violation;

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use understudy_cycle::{OnlineChange, Program};
use understudy_executable::{Executable, Scratch};
use understudy_remote_io::{Event, Settings};
use understudy_wire::{Image, Lineage, Moment, PointValue, ProgramHash, Source, Step};

use descent::Descent;
use fallbacks::Fallbacks;
use pair::Pair;
use points::Points;
use programs::Programs;
use unrecorded::Unrecorded;
pub use violation::Violation;

/// States that are remembered, at most, where some of them lie before the floor; the oldest are forgotten.
const REMEMBERED: usize = 1024;
/// States that are remembered from the floor on: for ten minutes of 10 ms cycles of which nothing is applied. The floor is never forgotten.
const REMEMBERED_FROM_FLOOR: usize = 65_536;

/// States that samples without a record may extend: the newest ones.
const RECENT_STATES: usize = 16;

/// Samples for which a choice of the operator is waited for.
const CHOICE_SAMPLES: u32 = 256;

/// Checks one remote I/O.
#[derive(Debug, Clone)]
pub struct Referee {
    programs: Programs,
    fallbacks: Fallbacks,
    scratch: Scratch,
    /// The states that the samples led to, newest last.
    states: VecDeque<State>,
    /// The place of the floor in `states`; those before it may not be continued from.
    floor: usize,
    /// x(t+1): the place of the state after the newest sample.
    newest: Option<usize>,
    /// h(x(t), u(t)) of the newest sample, with its cycle.
    truth: Option<(Moment, Image)>,
    last_true: Option<Image>,
    points: Points,
    descent: Descent,
    held: u32,
    /// Records are missing, and no state after them is known yet.
    blind: bool,
    /// The remote I/O has started again, and has not sampled since: the records of its last samples may be missing.
    is_new: bool,
    /// The newest sample while blind: its cycle, and the lineage that it led to.
    unjudged: Option<(Moment, Lineage)>,
    /// How often the records of a remote I/O that was killed did not suffice.
    gaps: u64,
    unrecorded: Unrecorded,
    pair: Pair,
    /// Samples for which the program may go on from a state that the operator has chosen.
    choice: u32,
    cold_starts: u64,
    /// Whether outputs were applied since the last cold start.
    applied: bool,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct State {
    lineage: Lineage,
    /// The cycle of the sample that led to it.
    stepped: Moment,
    /// The program whose state it is.
    program: ProgramHash,
    bits: Image,
}

/// By its reference run; settings and program are given.
impl Hash for Referee {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        // States before the floor only tell how far a program went back.
        self.states.range(self.floor..).for_each(|state| state.hash(hasher));
        let newest = self.newest.map(|place| place - self.floor.min(place));
        (newest, &self.truth, &self.last_true).hash(hasher);
        self.hash_fallbacks(hasher);
        (self.held, self.blind, self.choice, self.applied, &self.pair).hash(hasher);
    }
}

impl Referee {
    /// For the remote I/O of these settings, whose program is `executable`.
    pub fn new(settings: &Settings, executable: Executable) -> Self {
        Self {
            programs: Programs::new(settings.program, Program { hash: settings.hash, executable }),
            fallbacks: Fallbacks::new(settings.agreement.configuration, settings.fallback.clone()),
            scratch: Scratch::default(),
            states: VecDeque::new(),
            floor: 0,
            newest: None,
            truth: None,
            last_true: None,
            points: Points::new(settings.hash, &settings.layout),
            descent: Descent::default(),
            held: 0,
            blind: false,
            is_new: false,
            unjudged: None,
            gaps: 0,
            unrecorded: Unrecorded::new(settings.layout.sourced_bits()),
            pair: Pair::default(),
            choice: 0,
            cold_starts: 0,
            applied: false,
        }
    }

    /// Judges the program across this change too.
    #[must_use]
    pub fn with_change(mut self, change: Option<&Arc<OnlineChange>>) -> Self {
        change.into_iter().for_each(|change| self.learn(change));
        self
    }

    /// From now on the program may change by this. The programs of changes before it stay known.
    pub fn learn(&mut self, change: &Arc<OnlineChange>) {
        self.programs.learn(change);
    }

    /// The program that takes a step from the state of a lineage, and its state before the step, where they are known.
    pub fn taken(&self, before: Lineage, step: &Step) -> Option<(ProgramHash, Image)> {
        let State { program, bits, .. } = &self.states[self.place_of(before)?];
        let (program, bits) = self.programs.taken((*program, bits), step)?;
        Some((program.hash, bits))
    }

    /// The program of the state of a lineage, where it is remembered.
    pub fn program_of(&self, lineage: Lineage) -> Option<ProgramHash> {
        Some(self.states[self.place_of(lineage)?].program)
    }

    /// Whether a state is the one in which a program begins that is started cold.
    pub fn is_initial(&self, program: ProgramHash, state: &Image) -> bool {
        self.programs.of(program).is_some_and(|it| {
            it.executable.state_count() == state.width() && it.executable.initial() == state.words()
        })
    }

    /// What the plant shows, as it says itself.
    ///
    /// A remote I/O that is killed may take the record of its last samples with it. The lineage that a station then has proves
    /// which inputs they were, if only they are among those that the plant has shown.
    pub fn saw(&mut self, sensors: &Image) {
        self.unrecorded.saw(sensors);
    }

    /// An operator asks to write `value` to the input whose first bit in u(i) is `input`. Like [`Self::saw`], it says what a sample without
    /// a record may have had, and proves nothing by itself.
    pub fn asked(&mut self, input: u16, value: PointValue) {
        self.unrecorded.asked(input, value);
    }

    /// The remote I/O starts again.
    pub fn starts_again(&mut self) {
        self.is_new = true;
        self.points.is_new = true;
        self.fallbacks.starts_again();
    }

    /// How often the remote I/O was killed with more samples that left no record than can be found: what came after was not judged, until
    /// a state was known again.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// A station reports the state that it holds after the sample of `moment`, of the program with a hash, or of the first one. It counts only where
    /// nothing else is known.
    pub fn holds(
        &mut self,
        moment: Moment,
        (of, lineage): (Option<ProgramHash>, Lineage),
        state: &Image,
    ) {
        if self.unjudged == Some((moment, lineage)) && self.blind {
            self.goes_on_from((of, lineage), state.clone());
        }
    }

    /// Records of the remote I/O are missing here: nothing that it applies is judged until its program starts, or goes on from a state that is
    /// known. What is not known is not a violation, and must be said by whoever reads the records.
    pub fn misses_records(&mut self) {
        self.newest = None;
        self.truth = None;
        self.last_true = None;
        self.descent.forget();
        self.held = 0;
        self.blind = true;
        // Nor which points it has since.
        self.points.is_new = true;
    }

    /// The operator chooses the state that the program continues from: an older one, one of several, or the initial state.
    /// Allows one such step.
    pub fn operator_chooses(&mut self) {
        self.choice = CHOICE_SAMPLES;
    }

    /// Whether a choice of the operator is still waited for.
    pub fn operator_may_choose(&self) -> bool {
        self.choice > 0
    }

    /// The state after the newest sample: its lineage and x(t+1); nothing before a start that was seen.
    pub fn standing(&self) -> Option<(Lineage, &Image)> {
        let state = &self.states[self.newest?];
        Some((state.lineage, &state.bits))
    }

    /// The state of a lineage, where it is remembered.
    pub fn state_of(&self, lineage: Lineage) -> Option<&Image> {
        let place = self.place_of(lineage)?;
        Some(&self.states[place].bits)
    }

    /// Whether a cold start would lose the state of `lineage`: outputs were applied since the last one, and the program could
    /// continue from that state.
    pub fn would_be_lost(&self, lineage: Lineage) -> bool {
        let place = self.place_of(lineage);
        self.applied && place.is_some_and(|place| place >= self.floor)
    }

    /// h(x(t), u(t)) of the newest sample, with its cycle.
    pub fn truth(&self) -> Option<(Moment, &Image)> {
        self.truth.as_ref().map(|(moment, outputs)| (*moment, outputs))
    }

    /// Starts from the initial state, the first one included.
    pub fn cold_starts(&self) -> u64 {
        self.cold_starts
    }

    /// Takes one report of the remote I/O, in the order in which they were made; samples and applied outputs count.
    ///
    /// # Errors
    /// The violation that it is, if it is one; the referee goes on with what was sampled and applied.
    pub fn observe(&mut self, event: &Event) -> Result<(), Violation> {
        match event {
            Event::Sampled { moment, inputs, born, before, change } => {
                self.unrecorded.resumes(inputs);
                let continued = self.continue_from(*moment, *born, *before);
                self.is_new = false;
                let step = Step { change: *change, inputs: inputs.clone() };
                self.unjudged = self.blind.then(|| (*moment, before.after_step(&step)));
                self.step(*moment, &step);
                self.unrecorded.sampled();
                continued
            }
            Event::Written { write, .. } => {
                self.unrecorded.written(write.input, write.value);
                Ok(())
            }
            Event::Applied { moment, outputs, source, .. } => self.judge(*moment, outputs, *source),
            Event::Configured(configurations) => {
                self.configured(configurations.own);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The reference run goes on from a state that is known from elsewhere, for want of a start that was seen: of the program with a hash, or of the
    /// first one. A program that is not known here says nothing.
    pub fn goes_on_from(&mut self, (of, lineage): (Option<ProgramHash>, Lineage), bits: Image) {
        let hash = of.unwrap_or(self.programs.first.hash);
        let fits = |program: &Program| program.executable.state_count() == bits.width();
        if !self.programs.of(hash).is_some_and(fits) {
            return;
        }
        self.truth = None;
        self.remember(Moment::default(), (hash, lineage), bits);
        self.floor = self.states.len() - 1;
    }

    fn place_of(&self, lineage: Lineage) -> Option<usize> {
        self.states.iter().rposition(|state| state.lineage == lineage)
    }

    fn remember(
        &mut self,
        stepped: Moment,
        (program, lineage): (ProgramHash, Lineage),
        bits: Image,
    ) {
        if self.floor > 0 && self.states.len() >= REMEMBERED {
            self.states.pop_front();
            self.floor -= 1;
        } else if self.states.len() >= REMEMBERED_FROM_FLOOR {
            self.states.remove(1);
        }
        self.states.push_back(State { lineage, stepped, program, bits });
        self.newest = Some(self.states.len() - 1);
        self.blind = false;
    }

    /// Finds the state that a sample extends.
    fn continue_from(
        &mut self,
        moment: Moment,
        born: Moment,
        before: Lineage,
    ) -> Result<(), Violation> {
        if self.standing().is_some_and(|(newest, _)| newest == before) {
            return Ok(());
        }
        let chosen = self.choice > 0;
        self.truth = None;
        self.newest = self.place_of(before);
        if let Some(place) = self.newest {
            self.blind = false;
            if place >= self.floor {
                return Ok(());
            }
            let (from, applied) = (self.states[place].stepped, self.states[self.floor].stepped);
            self.floor = place;
            self.choice = 0;
            return if chosen {
                Ok(())
            } else {
                Err(Violation::WentBack { moment, from, applied })
            };
        }
        let started = self.programs.all().find(|it| before == Lineage::genesis(it.hash, born));
        if let Some(Program { hash, executable }) = started.cloned() {
            self.choice = 0;
            self.cold_starts += 1;
            self.applied = false;
            self.last_true = None;
            let initial = Image::from_words(executable.state_count(), executable.initial());
            let initial = initial.expect("a circuit packs its initial state");
            // The floor stays until an output is applied: a cold start of which nothing came may be undone.
            self.remember(born, (hash, before), initial);
            return Ok(());
        }
        if let Some(from) = self.warm_start_from(born, before) {
            return self.start_warm(moment, born, before, from);
        }
        if self.is_new && self.recover(before) || self.blind {
            return Ok(());
        }
        if chosen || self.is_new {
            self.gaps += u64::from(!chosen);
            self.misses_records();
            return Ok(());
        }
        Err(Violation::UnknownHistory { moment, lineage: before })
    }

    /// The place of the state whose retentive values a history begins with.
    fn warm_start_from(&self, born: Moment, start: Lineage) -> Option<usize> {
        self.states
            .iter()
            .rposition(|state| Lineage::warm(state.program, born, state.lineage) == start)
    }

    /// The program starts from its initial state with the retentive values of the state at `from`.
    fn start_warm(
        &mut self,
        moment: Moment,
        born: Moment,
        start: Lineage,
        from: usize,
    ) -> Result<(), Violation> {
        let chosen = std::mem::take(&mut self.choice) > 0;
        let state = &self.states[from];
        let (stepped, applied) = (state.stepped, self.states[self.floor].stepped);
        let program = self.programs.of(state.program).unwrap_or(&self.programs.first).clone();
        let bits = program.executable.restarted(state.bits.words());
        let bits = Image::from_words(program.executable.state_count(), &bits);
        let bits = bits.expect("a state of this program is packed");
        self.last_true = None;
        self.remember(born, (program.hash, start), bits);
        if from >= self.floor || chosen {
            return Ok(());
        }
        Err(Violation::WentBack { moment, from: stepped, applied })
    }

    /// Whether the state before the sample of a cycle is not known.
    fn is_unjudged(&self, moment: Moment) -> bool {
        self.blind || self.unjudged.is_some_and(|(of, _)| of == moment)
    }

    fn judge(&mut self, moment: Moment, driven: &Image, source: Source) -> Result<(), Violation> {
        if source != Source::FailSafe && self.has_ramps() {
            self.descent.begins_at(driven);
        }
        match source {
            Source::Held if self.blind => {
                self.held += 1;
                Ok(())
            }
            Source::Direct | Source::Reconstructed if self.is_unjudged(moment) => {
                self.held = 0;
                copy_to(&mut self.last_true, driven);
                Ok(())
            }
            Source::Direct | Source::Reconstructed => {
                self.held = 0;
                copy_to(&mut self.last_true, driven);
                let truth = self.truth.as_ref().filter(|(of, _)| *of == moment);
                let truth = truth.map(|(_, outputs)| outputs);
                if truth == Some(driven) {
                    self.floor = self.newest.unwrap_or(self.floor);
                    self.applied = true;
                    return Ok(());
                }
                Err(Violation::Wrong {
                    moment,
                    source_: source,
                    driven: driven.clone(),
                    truth: truth.cloned(),
                })
            }
            Source::Held => {
                self.held += 1;
                if self.may_hold() && self.last_true.as_ref() == Some(driven) {
                    return Ok(());
                }
                Err(Violation::WronglyHeld {
                    moment,
                    driven: driven.clone(),
                    cycles: self.held,
                    last_true: self.last_true.clone(),
                })
            }
            Source::FailSafe => {
                self.held = 0;
                self.last_true = None;
                self.descent.goes_on();
                if self.may_fall_back_to(driven) {
                    self.descent.drives(driven);
                    return Ok(());
                }
                Err(Violation::NotTheFailSafe {
                    moment,
                    driven: driven.clone(),
                    configured: self.fail_safe().unwrap_or_default(),
                })
            }
        }
    }
}

/// Copies an image into the place of another one.
fn copy_to(place: &mut Option<Image>, image: &Image) {
    match place {
        Some(place) => place.clone_from(image),
        None => *place = Some(image.clone()),
    }
}

#[cfg(test)]
mod tests;
