//! A replica of one program's state, advanced with the samples that its remote I/O sends (invariant *Same inputs*).
//!
//! A lineage identifies the state of a replica. Each sample carries the lineages of the last few cycles, so a replica
//! finds its own in that history and replays the samples that it missed. A replica that is not in the history goes back
//! to a state that it had a few steps ago, or starts where the history does, cold or warm; otherwise it is
//! [`Standing::Lost`] until another station transfers a state. It never steps on a guess.

mod log;
mod remembered;
mod retaining;
mod transfer;

use std::collections::VecDeque;
use std::sync::Arc;

use understudy_cycle::{Program, Versions};
use understudy_executable::Scratch;
use understudy_wire::{
    Body, Digest, Frame, Holding, Image, Lineage, Moment, ProgramHash, ProgramId, Sample, Segment,
    StationId, StationSet, Step,
};

use self::log::Log;
use self::remembered::Remembered;
use self::retaining::Retaining;
pub(crate) use self::transfer::SEGMENTS_A_CYCLE;
use self::transfer::{Joining, Snapshot};

/// Whether the outputs of a replica may be published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Standing {
    /// There is no state, or none of the remote I/O's history.
    Lost,
    /// Adopted from another station, in shadow mode: cycles that it must still be current before its outputs are
    /// published.
    Shadow(u32),
    /// Synchronised: replayed from the initial state, or after its shadow mode.
    Proven,
    /// Found faulty by the remote I/O: it waits for the operator.
    Excluded,
}

/// A station's replica of one program.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Replica {
    id: ProgramId,
    standing: Standing,
    held: Option<Held>,
    /// States before the last steps, oldest first; at most as many as a sample's history.
    past: VecDeque<State>,
    /// The last step: a state that was transferred has no outputs until it is stepped.
    step: Stepped,
    /// While it is lost.
    joining: Joining,
    /// For other stations, of a state of several segments.
    snapshots: Vec<Snapshot>,
    remembered: Remembered,
    retaining: Retaining,
    /// Stations that were accounted for when this one gave them its state, and that may prove outputs with it from then on.
    given: StationSet,
    /// Stations that are accounted for by what they reported to this one since the newest sample.
    witnessed: StationSet,
    history: usize,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct State {
    bits: Image,
    /// The program whose state it is.
    program: ProgramHash,
    lineage: Lineage,
    stepped: Moment,
    /// Of the state before the last step.
    digest: Digest,
}

/// One step of a program: x(i)(t) and u(i)(t), from which y(i)(t) was computed.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Stepped {
    /// The program that took it.
    pub(crate) program: ProgramHash,
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
struct Held {
    born: Moment,
    state: State,
}

impl Held {
    fn holding(&self, program: ProgramId) -> Holding {
        let State { lineage, stepped, digest, .. } = self.state;
        Holding { program, born: self.born, lineage, stepped, digest, version: None }
    }
}

/// Effect of a sample on a replica.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Followed {
    /// It is current.
    Synchronised,
    /// It is current, because the history starts from the initial state, or from a retained state that it has.
    FromGenesis(Lineage),
    /// It is current, with the state of that station.
    CaughtUp(StationId),
    /// Its state is not in the history.
    Lost,
    /// The history does not lead to the lineage in the sample: the sample was changed on its way, and counts as lost.
    Changed,
    /// The history changes to a program that is not loaded here.
    NotPrepared(ProgramHash),
}

impl Replica {
    pub(crate) fn new(id: ProgramId, program: &Program, history: usize) -> Self {
        Self {
            id,
            standing: Standing::Lost,
            held: None,
            past: VecDeque::with_capacity(history),
            step: Stepped {
                program: program.hash,
                state: Image::zero(program.executable.state_count()),
                inputs: Image::zero(program.executable.input_count()),
                outputs: Image::zero(program.executable.output_count()),
                after: None,
            },
            joining: Joining::default(),
            snapshots: Vec::new(),
            remembered: Remembered::Nothing,
            retaining: Retaining::default(),
            given: StationSet::EMPTY,
            witnessed: StationSet::EMPTY,
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
        let knows = |held: &Held| {
            held.state.stepped == moment && self.step.after == Some(held.state.lineage)
        };
        !matches!(self.standing, Standing::Lost | Standing::Excluded)
            && self.held.as_ref().is_some_and(knows)
    }

    /// Whether its state and all that it can go back to are states of the program with this hash.
    pub(crate) fn is_of(&self, program: ProgramHash) -> bool {
        let held = self.held.as_ref().map(|held| &held.state);
        held.into_iter().chain(&self.past).all(|state| state.program == program)
    }

    /// Whether its outputs of `moment` may be published.
    pub(crate) fn may_publish(&self, moment: Moment) -> bool {
        self.standing == Standing::Proven && self.is_current(moment)
    }

    /// y(i) of the last step.
    pub(crate) fn outputs(&self) -> &Image {
        &self.step.outputs
    }

    /// The last step.
    pub(crate) fn last_step(&self) -> &Stepped {
        &self.step
    }

    /// Its state with its lineage.
    pub(crate) fn state(&self) -> Option<(Lineage, &Image)> {
        let state = &self.held.as_ref()?.state;
        Some((state.lineage, &state.bits))
    }

    pub(crate) fn lineage(&self) -> Option<Lineage> {
        self.held.as_ref().map(|held| held.state.lineage)
    }

    /// The state that it reports to hold; also that of a lost replica, which may be the newest available one.
    pub(crate) fn holding(&self) -> Option<Holding> {
        self.held.as_ref().map(|held| held.holding(self.id))
    }

    /// The version of the program whose state that is, where it tells the points.
    pub(crate) fn version(&self, versions: Versions<'_>) -> Option<ProgramHash> {
        versions.named(self.held.as_ref()?.state.program)
    }

    /// Follows the sample of `moment`, a frame whose body is `sample`.
    pub(crate) fn follow(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        frame: &Arc<Frame>,
        shadow_cycles: u32,
    ) -> Followed {
        let Body::Sample(sample) = &frame.body else {
            return Followed::Lost;
        };
        let moment = frame.header.moment;
        if sample.history.len() > self.history
            || sample.history.iter().any(|step| !versions.has_inputs(step.inputs.width()))
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
        if !sample.is_intact() {
            return Followed::Changed;
        }
        if self.held.as_ref().is_some_and(|held| held.state.lineage == sample.before) {
            return match self.step(versions, scratch, newest, moment) {
                Ok(()) => self.synchronised(shadow_cycles),
                Err(missing) => self.cannot_follow(missing),
            };
        }
        let lineages = lineages_of(sample);
        if lineages.last() != Some(&sample.after) {
            return Followed::Changed;
        }
        if let Some(place) = self.find(&lineages).or_else(|| self.take_up_retained(&lineages)) {
            return match self.replay(versions, scratch, sample, place, moment) {
                Ok(()) => self.synchronised(shadow_cycles),
                Err(missing) => self.cannot_follow(missing),
            };
        }
        if let Some((place, start)) = self.start_in(versions, sample, &lineages) {
            let genesis = start.lineage;
            self.past.clear();
            self.held = Some(Held { born: sample.born, state: start });
            if let Err(missing) = self.replay(versions, scratch, sample, place, moment) {
                return self.cannot_follow(missing);
            }
            self.standing = Standing::Proven;
            self.joining = Joining::default();
            return Followed::FromGenesis(self.lineage().unwrap_or(genesis));
        }
        self.standing = Standing::Lost;
        self.keep(versions, sample, moment);
        let caught_up = self.catch_up(versions, scratch, shadow_cycles);
        caught_up.map_or(Followed::Lost, Followed::CaughtUp)
    }

    /// Ends the cycle `moment`. True where the shadow mode has just ended.
    pub(crate) fn close_cycle(&mut self, moment: Moment) -> bool {
        self.close_transfers();
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

    /// Flips one bit of the state: a value fault.
    pub(crate) fn flip_state(&mut self, bit: usize) {
        if let Some(held) = &mut self.held
            && let Some(bit) = bit.checked_rem(held.state.bits.width())
        {
            let value = held.state.bits.get(bit);
            held.state.bits.set(bit, !value);
        }
    }

    /// Discards the state, which differs from that of another station.
    pub(crate) fn discard(&mut self) {
        self.held = None;
        self.forget_retained();
        self.past.clear();
        self.standing = Standing::Lost;
        self.joining = Joining::default();
        self.snapshots.clear();
    }

    /// Applies the remote I/O's exclusion of this station, or its end: it then starts again without a state. True where
    /// it changed.
    pub(crate) fn set_excluded(&mut self, excluded: bool) -> bool {
        let changed = excluded != (self.standing == Standing::Excluded);
        if changed {
            self.discard();
            if excluded {
                self.standing = Standing::Excluded;
            }
        }
        changed
    }

    /// Keeps a sample that cannot be followed: for a state of one segment, which comes at once, the newest is enough.
    fn keep(&mut self, versions: Versions<'_>, sample: &Sample, moment: Moment) {
        let one_segment = |program: &Program| Segment::count(program.executable.state_count()) == 1;
        let is_whole = versions.all().all(one_segment);
        match &mut self.joining.log {
            Some(log) if !is_whole => log.extend(sample, moment),
            log => *log = Some(Log::of(sample, moment)),
        }
    }

    fn synchronised(&mut self, shadow_cycles: u32) -> Followed {
        if self.standing == Standing::Lost {
            self.standing = Standing::Shadow(shadow_cycles);
        }
        self.joining = Joining::default();
        Followed::Synchronised
    }

    /// It keeps its last state, and is silent until the program is loaded or another station transfers a state.
    fn cannot_follow(&mut self, missing: ProgramHash) -> Followed {
        self.standing = Standing::Lost;
        Followed::NotPrepared(missing)
    }

    /// The place of the state in the history, or of the newest earlier state that is in it, to which the replica then
    /// goes back.
    fn find(&mut self, lineages: &[Lineage]) -> Option<usize> {
        let held = self.held.as_mut()?;
        let place_of = |lineage| lineages.iter().rposition(|&known| known == lineage);
        if let Some(place) = place_of(held.state.lineage) {
            return Some(place);
        }
        let (back, place) = self
            .past
            .iter()
            .enumerate()
            .rev()
            .find_map(|(back, state)| place_of(state.lineage).map(|place| (back, place)))?;
        self.past.truncate(back + 1);
        held.state = self.past.pop_back()?;
        Some(place)
    }

    /// Steps through the history from `place` on. A place past its end means that the replica has this sample already:
    /// void samples may be sent again unchanged.
    ///
    /// # Errors
    /// The program that a step changes to is not loaded: the state is the one before that step.
    fn replay(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        sample: &Sample,
        place: usize,
        moment: Moment,
    ) -> Result<(), ProgramHash> {
        for step in &sample.history[place.min(sample.history.len())..] {
            self.step(versions, scratch, step, moment)?;
        }
        if let Some(held) = &mut self.held {
            held.state.stepped = moment;
        }
        Ok(())
    }

    /// # Errors
    /// As [`Self::replay`]; so it is with inputs that are not those of the program.
    fn step(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        step: &Step,
        moment: Moment,
    ) -> Result<(), ProgramHash> {
        let Some(held) = self.held.as_mut() else {
            return Ok(());
        };
        let target = step.change.unwrap_or(held.state.program);
        let takes = |program: &&Program| program.executable.input_count() == step.inputs.width();
        let program = versions.of(target).filter(takes).ok_or(target)?;
        let converted = match target == held.state.program {
            true => None,
            false => Some(converted(versions, (&held.state, program), &step.inputs).ok_or(target)?),
        };
        let oldest = match self.past.len() < self.history {
            true => None,
            false => self.past.pop_front(),
        };
        let before = match oldest {
            Some(mut reused) => {
                reused.clone_from(&held.state);
                reused
            }
            None => held.state.clone(),
        };
        self.past.push_back(before);
        if let Some(bits) = converted {
            held.state.bits = bits;
            held.state.program = target;
        }
        held.state.digest = Digest::of(&held.state.bits);
        self.step.program = target;
        self.step.state.clone_from(&held.state.bits);
        self.step.inputs.clone_from(&step.inputs);
        let outputs = program.executable.output_count();
        if self.step.outputs.width() != outputs {
            self.step.outputs = Image::zero(outputs);
        }
        program.executable.step(
            scratch,
            held.state.bits.words_mut(),
            step.inputs.words(),
            self.step.outputs.words_mut(),
        );
        held.state.lineage = held.state.lineage.after_step(step);
        held.state.stepped = moment;
        self.step.after = Some(held.state.lineage);
        self.retaining.stepped(self.id, held, &step.inputs);
        Ok(())
    }
}

/// The first state of `program` for a state of another program, at a sample with these inputs.
fn converted(
    versions: Versions<'_>,
    (state, program): (&State, &Program),
    inputs: &Image,
) -> Option<Image> {
    let between = (state.program, program.hash);
    let words = versions.convert(between, state.bits.words(), inputs.words())?;
    Image::from_words(program.executable.state_count(), &words).ok()
}

/// The lineage before each sample of the history, and last the one after all of them.
fn lineages_of(sample: &Sample) -> smallvec::SmallVec<[Lineage; 16]> {
    let mut lineage = sample.base;
    let mut lineages = smallvec::smallvec![lineage];
    for step in &sample.history {
        lineage = lineage.after_step(step);
        lineages.push(lineage);
    }
    lineages
}

#[cfg(test)]
mod tests;
