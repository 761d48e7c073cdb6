//! A replica of one program's state, advanced with the samples that its remote I/O sends (invariant *Same inputs*).
//!
//! A lineage identifies the state of a replica. Each sample carries the lineages of the last few cycles, so a replica
//! finds its own in that history and replays the samples that it missed. A replica that is not in the history goes back
//! to a state that it had a few steps ago, or starts from the initial state where the history does; otherwise it is
//! [`Standing::Lost`] until another station transfers a state. It never steps on a guess.

mod log;
mod transfer;

use std::collections::VecDeque;
use std::sync::Arc;

use understudy_executable::Scratch;
use understudy_wire::{
    Body, Digest, Frame, Holding, Image, Lineage, Moment, ProgramId, Recalled, Sample,
    SamplesReceived, Segment, StationId, StationSet,
};

use self::log::Log;
pub(crate) use self::transfer::SEGMENTS_A_CYCLE;
use self::transfer::{Joining, Snapshot};

use crate::settings::Program;

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
    step: Step,
    /// While it is lost.
    joining: Joining,
    /// For other stations, of a state of several segments.
    snapshots: Vec<Snapshot>,
    remembered: Remembered,
    /// Stations that were accounted for when this one gave them its state, and that may prove outputs with it from then on.
    given: StationSet,
    /// Stations that are accounted for by what they reported to this one since the newest sample.
    witnessed: StationSet,
    history: usize,
}

/// The newest sample of the program that this station remembers, for a remote I/O that has lost its memory.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Remembered {
    /// None.
    Nothing,
    /// None of its own; what another station remembers.
    Relayed(Recalled),
    /// The sample that this station received last.
    Received(Recalled),
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
struct Held {
    born: Moment,
    state: State,
}

/// Effect of a sample on a replica.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Followed {
    /// It is current.
    Synchronised,
    /// It is current, because the history starts from the initial state.
    FromGenesis(Lineage),
    /// It is current, with the state of that station.
    CaughtUp(StationId),
    /// Its state is not in the history.
    Lost,
    /// The history does not lead to the lineage in the sample: the sample was changed on its way, and counts as lost.
    Changed,
}

impl Replica {
    pub(crate) fn new(id: ProgramId, program: &Program, history: usize) -> Self {
        Self {
            id,
            standing: Standing::Lost,
            held: None,
            past: VecDeque::with_capacity(history),
            step: Step {
                state: Image::zero(program.executable.state_count()),
                inputs: Image::zero(program.executable.input_count()),
                outputs: Image::zero(program.executable.output_count()),
                after: None,
            },
            joining: Joining::default(),
            snapshots: Vec::new(),
            remembered: Remembered::Nothing,
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

    /// Whether its outputs of `moment` may be published.
    pub(crate) fn may_publish(&self, moment: Moment) -> bool {
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
        self.held.as_ref().map(|held| Holding {
            program: self.id,
            born: held.born,
            lineage: held.state.lineage,
            stepped: held.state.stepped,
            digest: held.state.digest,
        })
    }

    /// Remembers the sample of `moment`, whether it can be followed or not.
    pub(crate) fn remember(
        &mut self,
        program: &Program,
        moment: Moment,
        sample: &Sample,
        received: SamplesReceived,
    ) {
        let Some(inputs) = sample.history.last() else {
            return;
        };
        if inputs.width() == program.executable.input_count() {
            if let Remembered::Received(known) = &mut self.remembered {
                // A copy of it, or of one before it, says nothing of who has been heard since.
                if moment.epoch == known.sampled.epoch && moment <= known.sampled {
                    return;
                }
                if known.sampled < moment {
                    known.received = SamplesReceived::Later;
                }
                known.sampled = moment;
                known.applied = sample.applied;
                known.excluded = sample.excluded;
                known.accounted_for = sample.gone;
                self.given = StationSet::EMPTY;
                self.witnessed = StationSet::EMPTY;
                known.writes.clone_from(&sample.writes);
                known.pulses.clone_from(&sample.pulses);
                known.inputs.clone_from(inputs);
                return;
            }
            let recalled = Recalled {
                program: self.id,
                sampled: moment,
                received,
                applied: sample.applied,
                excluded: sample.excluded,
                accounted_for: sample.gone,
                writes: sample.writes.clone(),
                pulses: sample.pulses.clone(),
                inputs: inputs.clone(),
            };
            self.remembered = Remembered::Received(recalled);
        }
    }

    /// A station reports at `now` to hold the state of the cycle `stepped`. If that is no newer than the newest sample
    /// received here, `silent_after` cycles after it, the remote I/O is not received there either. No newer output was computed from its state
    /// if that station received samples itself, as it recalls, or if it has received none since it started, or none after the one that accounts
    /// for it, and holds the state that it was given here after that; unless it is taking over another one.
    pub(crate) fn receive_holding(
        &mut self,
        station: StationId,
        stepped: Moment,
        theirs: Option<&Recalled>,
        (now, silent_after): (Moment, u32),
    ) {
        let gives_to = self.gives_to(station);
        let Remembered::Received(recalled) = &mut self.remembered else {
            return;
        };
        let was_given = self.given.contains(station);
        let theirs = theirs.filter(|theirs| match theirs.received {
            SamplesReceived::Later => true,
            SamplesReceived::First => was_given && theirs.sampled <= recalled.sampled,
            SamplesReceived::Nothing => was_given,
        });
        // With a state that the next sample's history reaches, it follows without one from another station, however long the remote I/O has not
        // received it.
        let is_fresh = now <= recalled.sampled && stepped.plus(self.history as u64) >= now;
        if stepped > recalled.sampled || is_fresh {
            recalled.accounted_for.remove(station);
            self.given.remove(station);
            self.witnessed.remove(station);
        } else if let Some(theirs) = theirs
            && now >= recalled.sampled.plus(u64::from(silent_after))
            && !gives_to
        {
            if !recalled.accounted_for.contains(station) {
                self.witnessed.insert(station);
            }
            recalled.accounted_for.insert(station);
            recalled.applied = recalled.applied.max(theirs.applied);
        }
    }

    /// A station asks for the state and has no part of it: it may have proved outputs with the one that it was given here, and have lost its memory.
    pub(crate) fn asked(&mut self, station: StationId) {
        self.given.remove(station);
    }

    /// This station has heard nobody for a cycle: meanwhile others may have proved newer outputs.
    pub(crate) fn was_isolated(&mut self) {
        if let Remembered::Received(recalled) = &mut self.remembered {
            recalled.accounted_for = recalled.accounted_for.without(self.witnessed);
        }
        self.witnessed = StationSet::EMPTY;
        self.given = StationSet::EMPTY;
    }

    /// Takes what another station remembers, where this one has received no sample.
    pub(crate) fn take_recalled(&mut self, program: &Program, recalled: &Recalled) {
        if self.remembered == Remembered::Nothing
            && recalled.inputs.width() == program.executable.input_count()
        {
            let recalled = Recalled { received: SamplesReceived::Nothing, ..recalled.clone() };
            self.remembered = Remembered::Relayed(recalled);
        }
    }

    /// What it remembers of the newest sample, where none was received in the cycle `moment`.
    pub(crate) fn recalled(&self, moment: Moment) -> Option<&Recalled> {
        match &self.remembered {
            Remembered::Nothing => None,
            Remembered::Relayed(recalled) => Some(recalled),
            Remembered::Received(recalled) => (recalled.sampled != moment).then_some(recalled),
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
            || sample.history[0].width() != program.executable.input_count()
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
        if self.held.as_ref().is_some_and(|held| held.state.lineage == sample.before) {
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
            let initial =
                Image::from_words(program.executable.state_count(), program.executable.initial());
            self.past.clear();
            self.held = Some(Held {
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
            self.joining = Joining::default();
            return Followed::FromGenesis(self.lineage().unwrap_or(genesis));
        }
        self.standing = Standing::Lost;
        self.keep(program, sample, moment);
        let caught_up = self.catch_up(program, scratch, shadow_cycles);
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
    fn keep(&mut self, program: &Program, sample: &Sample, moment: Moment) {
        let is_whole = Segment::count(program.executable.state_count()) == 1;
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
        if let Some(held) = &mut self.held {
            held.state.stepped = moment;
        }
    }

    fn step(&mut self, program: &Program, scratch: &mut Scratch, inputs: &Image, moment: Moment) {
        let Some(held) = self.held.as_mut() else {
            return;
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
        held.state.digest = Digest::of(&held.state.bits);
        self.step.state.clone_from(&held.state.bits);
        self.step.inputs.clone_from(inputs);
        program.executable.step(
            scratch,
            held.state.bits.words_mut(),
            inputs.words(),
            self.step.outputs.words_mut(),
        );
        held.state.lineage = held.state.lineage.after(inputs);
        held.state.stepped = moment;
        self.step.after = Some(held.state.lineage);
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
