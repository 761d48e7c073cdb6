//! A copy of one program's state, advanced with the very samples that its remote I/O sends (invariant *Same inputs*).
//!
//! A copy knows where it stands by its lineage alone. Each sample carries the lineages of the last few cycles, so a copy finds
//! itself in that history and replays what it missed. One that does not find itself there goes back to a state that it had a
//! few steps ago, starts from the initial state where the history does, or is [`Standing::Lost`] until somebody
//! gives it a state. It never steps on a guess.

use std::collections::VecDeque;
use std::sync::Arc;

use understudy_logic::Scratch;
use understudy_wire::{
    Body, Digest, Frame, Holding, Image, Lineage, Moment, ProgramId, Recalled, Sample, StationId,
    Transfer,
};

use crate::settings::Program;

/// How much a copy may be trusted to speak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Standing {
    /// There is no copy, or none that the program's remote I/O knows.
    Lost,
    /// Adopted from another station; takes no part in the turns for so many more cycles synchronised.
    Shadow(u32),
    /// Replayed from the initial state, or proved in shadow.
    Proven,
    /// Its remote I/O has found it faulty: it waits for the operator.
    Excluded,
}

/// A station's copy of one program.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Replica {
    id: ProgramId,
    standing: Standing,
    copy: Option<Copied>,
    /// States before the last steps, oldest first; at most as many as a sample's history.
    past: VecDeque<State>,
    /// The last step: a state that was transferred has no outputs until it is stepped.
    step: Step,
    /// The last sample that could not be followed, for replaying it onto a state that is given later.
    unfollowed: Option<Arc<Frame>>,
    remembered: Remembered,
    history: usize,
}

/// The newest sample of the program that this station remembers, for a remote I/O that has lost its memory.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Remembered {
    /// None.
    Nothing,
    /// None of its own; what another station remembers.
    Relayed(Recalled),
    /// The sample that this station received in that cycle.
    Received(Moment, Recalled),
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct State {
    bits: Image,
    lineage: Lineage,
    stepped: Moment,
    /// Of the state before the last step.
    digest: Digest,
}

/// One step of a program: x(i)(t) and u(i)(t), from which y(i)(t) was computed.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Step {
    /// x(i)(t).
    pub(crate) state: Image,
    /// u(i)(t).
    pub(crate) inputs: Image,
    /// y(i)(t).
    outputs: Image,
    /// L(i)(t+1); `None` before the first step.
    after: Option<Lineage>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Copied {
    born: Moment,
    state: State,
}

/// What a sample did to a copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Followed {
    /// It is current.
    Synchronised,
    /// It is current, and stands where it does because the history starts from the initial state.
    FromGenesis(Lineage),
    /// It does not find itself in the history.
    Lost,
    /// The history does not lead where its remote I/O says that it does: it has been changed, and says nothing.
    Changed,
}

impl Replica {
    pub(crate) fn new(id: ProgramId, program: &Program, history: usize) -> Self {
        Self {
            id,
            standing: Standing::Lost,
            copy: None,
            past: VecDeque::with_capacity(history),
            step: Step {
                state: Image::zero(program.scan.register_count()),
                inputs: Image::zero(program.scan.input_count()),
                outputs: Image::zero(program.scan.output_count()),
                after: None,
            },
            unfollowed: None,
            remembered: Remembered::Nothing,
            history,
        }
    }

    pub(crate) fn id(&self) -> ProgramId {
        self.id
    }

    pub(crate) fn standing(&self) -> Standing {
        self.standing
    }

    /// Whether it was stepped with the sample of `moment`, and so knows y(i) of that cycle.
    pub(crate) fn is_current(&self, moment: Moment) -> bool {
        let knows = |copy: &Copied| {
            copy.state.stepped == moment && self.step.after == Some(copy.state.lineage)
        };
        !matches!(self.standing, Standing::Lost | Standing::Excluded)
            && self.copy.as_ref().is_some_and(knows)
    }

    /// Whether it may speak of `moment`.
    pub(crate) fn may_speak(&self, moment: Moment) -> bool {
        self.standing == Standing::Proven && self.is_current(moment)
    }

    /// y(i) of the last step.
    pub(crate) fn outputs(&self) -> &Image {
        &self.step.outputs
    }

    /// The last step.
    pub(crate) fn last_step(&self) -> &Step {
        &self.step
    }

    /// Where it stands, and in which state.
    pub(crate) fn state(&self) -> Option<(Lineage, &Image)> {
        let state = &self.copy.as_ref()?.state;
        Some((state.lineage, &state.bits))
    }

    pub(crate) fn lineage(&self) -> Option<Lineage> {
        self.copy.as_ref().map(|copy| copy.state.lineage)
    }

    /// What it says of itself; a lost copy too, for it may be the newest that lives.
    pub(crate) fn holding(&self) -> Option<Holding> {
        self.copy.as_ref().map(|copy| Holding {
            program: self.id,
            born: copy.born,
            lineage: copy.state.lineage,
            stepped: copy.state.stepped,
            digest: copy.state.digest,
        })
    }

    /// Keeps what the sample of `moment` says, whether it can be followed or not.
    pub(crate) fn hear(&mut self, program: &Program, moment: Moment, sample: &Sample) {
        let Some(inputs) = sample.history.last() else {
            return;
        };
        if inputs.width() == program.scan.input_count() {
            // Outputs of the first sample may have been proved in this station's earlier life.
            let witnessed = match &self.remembered {
                Remembered::Received(received, known) => known.witnessed || *received < moment,
                Remembered::Nothing | Remembered::Relayed(_) => false,
            };
            let recalled = Recalled {
                program: self.id,
                witnessed,
                applied: sample.applied,
                excluded: sample.excluded,
                accounted_for: sample.gone,
                inputs: inputs.clone(),
            };
            self.remembered = Remembered::Received(moment, recalled);
        }
    }

    /// A station claims at `now` to hold the state of the cycle `stepped`. One that is no newer than the newest sample received here,
    /// `silent_after` cycles after it, means that the remote I/O is silent there too; if that station received samples itself, as it
    /// recalls, no newer output came of its state.
    pub(crate) fn hear_claim(
        &mut self,
        station: StationId,
        stepped: Moment,
        theirs: Option<&Recalled>,
        (now, silent_after): (Moment, u32),
    ) {
        let Remembered::Received(received, recalled) = &mut self.remembered else {
            return;
        };
        let theirs = theirs.filter(|theirs| theirs.witnessed);
        if stepped > *received {
            recalled.accounted_for.remove(station);
        } else if let Some(theirs) = theirs
            && now >= received.plus(u64::from(silent_after))
        {
            recalled.accounted_for.insert(station);
            recalled.applied = recalled.applied.max(theirs.applied);
        }
    }

    /// Takes what another station has heard, where this one has heard nothing.
    pub(crate) fn is_told(&mut self, program: &Program, recalled: &Recalled) {
        if self.remembered == Remembered::Nothing
            && recalled.inputs.width() == program.scan.input_count()
        {
            let recalled = Recalled {
                witnessed: false,
                ..recalled.clone()
            };
            self.remembered = Remembered::Relayed(recalled);
        }
    }

    /// What the newest sample said, where none was heard in the cycle `moment`.
    pub(crate) fn recalled(&self, moment: Moment) -> Option<&Recalled> {
        match &self.remembered {
            Remembered::Nothing => None,
            Remembered::Relayed(recalled) => Some(recalled),
            Remembered::Received(received, recalled) => (*received != moment).then_some(recalled),
        }
    }

    /// Follows the sample of `moment`, a frame whose body is `sample`.
    pub(crate) fn follow(
        &mut self,
        program: &Program,
        scratch: &mut Scratch,
        frame: &Arc<Frame>,
        shadow_cycles: u32,
    ) -> Followed {
        let Body::Sample(sample) = &frame.body else {
            return Followed::Lost;
        };
        let moment = frame.header.moment;
        if sample.history.len() > self.history
            || sample.history[0].width() != program.scan.input_count()
        {
            return Followed::Lost;
        }
        if self.standing == Standing::Excluded {
            return Followed::Lost;
        }
        if self.is_current(moment) {
            return Followed::Synchronised;
        }
        let newest = &sample.history[sample.history.len() - 1];
        if sample.before.after(newest) != sample.after {
            return Followed::Changed;
        }
        if self
            .copy
            .as_ref()
            .is_some_and(|copy| copy.state.lineage == sample.before)
        {
            self.step(program, scratch, newest, moment);
            return self.synchronised(shadow_cycles);
        }
        let lineages = lineages_of(sample);
        if lineages.last() != Some(&sample.after) {
            return Followed::Changed;
        }
        if let Some(place) = self.find(&lineages) {
            self.replay(program, scratch, sample, place, moment);
            return self.synchronised(shadow_cycles);
        }
        let genesis = Lineage::genesis(program.hash, sample.born);
        if let Some(place) = lineages.iter().position(|&lineage| lineage == genesis) {
            let initial = Image::from_words(program.scan.register_count(), program.scan.initial());
            self.past.clear();
            self.copy = Some(Copied {
                born: sample.born,
                state: State {
                    bits: initial.expect("a circuit packs its initial state"),
                    lineage: genesis,
                    stepped: sample.born,
                    digest: Digest::default(),
                },
            });
            self.replay(program, scratch, sample, place, moment);
            self.standing = Standing::Proven;
            self.unfollowed = None;
            return Followed::FromGenesis(self.lineage().unwrap_or(genesis));
        }
        self.standing = Standing::Lost;
        self.unfollowed = Some(Arc::clone(frame));
        Followed::Lost
    }

    /// Takes a state from another station if it leads to the last sample heard. True if it was taken.
    pub(crate) fn adopt(
        &mut self,
        program: &Program,
        scratch: &mut Scratch,
        transfer: &Transfer,
        shadow_cycles: u32,
    ) -> bool {
        if self.standing != Standing::Lost
            || transfer.hash != program.hash
            || transfer.state.width() != program.scan.register_count()
        {
            return false;
        }
        let unfollowed = self.unfollowed.take();
        let place = match unfollowed.as_deref() {
            Some(Frame {
                body: Body::Sample(sample),
                ..
            }) => {
                let place = lineages_of(sample)
                    .iter()
                    .position(|&lineage| lineage == transfer.lineage);
                if place.is_none() {
                    self.unfollowed = unfollowed;
                    return false;
                }
                place
            }
            // No sample was heard: its remote I/O is down, and the state is kept for when it comes back.
            _ if self.copy.is_none() => None,
            _ => return false,
        };
        self.past.clear();
        self.copy = Some(Copied {
            born: transfer.born,
            state: State {
                bits: transfer.state.clone(),
                lineage: transfer.lineage,
                stepped: transfer.stepped,
                digest: transfer.digest,
            },
        });
        self.standing = Standing::Shadow(shadow_cycles);
        if let (Some(place), Some(frame)) = (place, unfollowed)
            && let Body::Sample(sample) = &frame.body
        {
            self.replay(program, scratch, sample, place, frame.header.moment);
        }
        true
    }

    /// The state itself, for one who lacks it and can prove outputs with it from then on; none from a copy that is lost.
    pub(crate) fn transfer(&mut self, program: &Program, to: StationId) -> Option<Transfer> {
        let copy = self
            .copy
            .as_ref()
            .filter(|_| self.standing == Standing::Proven)?;
        if let Remembered::Relayed(recalled) | Remembered::Received(_, recalled) =
            &mut self.remembered
        {
            recalled.accounted_for.remove(to);
        }
        Some(Transfer {
            to,
            program: self.id,
            hash: program.hash,
            born: copy.born,
            lineage: copy.state.lineage,
            stepped: copy.state.stepped,
            digest: copy.state.digest,
            state: copy.state.bits.clone(),
        })
    }

    /// Ends the cycle `moment`. True where the copy has just proved itself.
    pub(crate) fn close_cycle(&mut self, moment: Moment) -> bool {
        match self.standing {
            Standing::Shadow(left) if self.is_current(moment) => {
                self.standing = match left {
                    0 | 1 => Standing::Proven,
                    _ => Standing::Shadow(left - 1),
                };
                self.standing == Standing::Proven
            }
            _ => false,
        }
    }

    /// A value fault: one bit of the state is another from now on.
    pub(crate) fn flip_state(&mut self, bit: usize) {
        if let Some(copy) = &mut self.copy
            && let Some(bit) = bit.checked_rem(copy.state.bits.width())
        {
            let value = copy.state.bits.get(bit);
            copy.state.bits.set(bit, !value);
        }
    }

    /// Throws the copy away: it computes otherwise than its twin.
    pub(crate) fn discard(&mut self) {
        self.copy = None;
        self.past.clear();
        self.standing = Standing::Lost;
        self.unfollowed = None;
    }

    /// Its remote I/O excludes it, or does so no more: then it begins again without a state. True where that is news.
    pub(crate) fn set_excluded(&mut self, excluded: bool) -> bool {
        let news = excluded != (self.standing == Standing::Excluded);
        if news {
            self.discard();
            if excluded {
                self.standing = Standing::Excluded;
            }
        }
        news
    }

    fn synchronised(&mut self, shadow_cycles: u32) -> Followed {
        if self.standing == Standing::Lost {
            self.standing = Standing::Shadow(shadow_cycles);
        }
        self.unfollowed = None;
        Followed::Synchronised
    }

    /// The place in the history at which this copy stands now, or stood a few steps ago; it stands there afterwards.
    fn find(&mut self, lineages: &[Lineage]) -> Option<usize> {
        let copy = self.copy.as_mut()?;
        let place_of = |lineage| lineages.iter().rposition(|&known| known == lineage);
        if let Some(place) = place_of(copy.state.lineage) {
            return Some(place);
        }
        let (back, place) = self
            .past
            .iter()
            .enumerate()
            .rev()
            .find_map(|(back, state)| place_of(state.lineage).map(|place| (back, place)))?;
        self.past.truncate(back + 1);
        copy.state = self.past.pop_back()?;
        Some(place)
    }

    /// Steps through the history from `place` on. A place past its end means that the copy has this sample already: voided
    /// samples may come again as they were.
    fn replay(
        &mut self,
        program: &Program,
        scratch: &mut Scratch,
        sample: &Sample,
        place: usize,
        moment: Moment,
    ) {
        for inputs in &sample.history[place.min(sample.history.len())..] {
            self.step(program, scratch, inputs, moment);
        }
        if let Some(copy) = &mut self.copy {
            copy.state.stepped = moment;
        }
    }

    fn step(&mut self, program: &Program, scratch: &mut Scratch, inputs: &Image, moment: Moment) {
        let Some(copy) = self.copy.as_mut() else {
            return;
        };
        let mut before = if self.past.len() < self.history {
            copy.state.clone()
        } else {
            self.past.pop_front().unwrap_or_else(|| copy.state.clone())
        };
        before.clone_from(&copy.state);
        self.past.push_back(before);
        copy.state.digest = Digest::of(&copy.state.bits);
        self.step.state.clone_from(&copy.state.bits);
        self.step.inputs.clone_from(inputs);
        program.scan.step(
            scratch,
            copy.state.bits.words_mut(),
            inputs.words(),
            self.step.outputs.words_mut(),
        );
        copy.state.lineage = copy.state.lineage.after(inputs);
        copy.state.stepped = moment;
        self.step.after = Some(copy.state.lineage);
    }
}

/// The lineage before each sample of the history, and last the one after all of them.
fn lineages_of(sample: &Sample) -> smallvec::SmallVec<[Lineage; 16]> {
    let mut lineage = sample.base;
    let mut lineages = smallvec::smallvec![lineage];
    for inputs in &sample.history {
        lineage = lineage.after(inputs);
        lineages.push(lineage);
    }
    lineages
}

#[cfg(test)]
mod tests;
