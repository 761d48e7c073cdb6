//! What the referees are shown of a remote I/O, and what they say.

use std::collections::BTreeMap;

use understudy_remote_io::{Event, RemoteIo};
use understudy_wire::{
    Frame, Lineage, Member, Moment, Part, ProgramId, Source, StationId, StationSet,
};

use super::knowable::CYCLES_TO_TELL;
use super::{Observe, Record, Simulation};
use crate::referee::Violation;

/// The remote I/Os that have a wrong program. The two of one program are judged each by its own.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub(super) struct Misled(BTreeMap<Member, WrongProgram>);

impl Misled {
    /// A remote I/O starts again. With a wrong program it may go on with what its stations have started with it before.
    pub(super) fn restarts(&mut self, member: Member, has_wrong_program: bool) {
        let before = self.0.remove(&member);
        if has_wrong_program {
            self.0.insert(member, before.unwrap_or_default());
        }
    }
}

/// A remote I/O with a wrong program, as the referee knows it: by who runs and whom it can receive, and not by what it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
struct WrongProgram {
    /// Stations with another configuration that had sent something since they started and that it could receive at its last deadline, and at the
    /// one before.
    contradicted_by: [StationSet; 2],
    /// Whether the wrong program may run: the operator has chosen its cold start, or it has started where the remote I/O can receive more
    /// stations with its configuration than with another one. No member can tell then which of the two is right.
    is_permitted: bool,
}

impl WrongProgram {
    /// A deadline is over.
    fn is_contradicted_by(&mut self, others: StationSet) {
        let [last, _] = self.contradicted_by;
        self.contradicted_by = [others, last];
    }
}

impl Simulation {
    pub(super) fn judge(
        &mut self,
        member: Member,
        program: ProgramId,
        event: &Event,
        observe: &mut Observe<'_>,
    ) {
        let too_much = self.judge_sum(program, event);
        if self.may_be_misled(member, program, event) {
            self.ready.remove(program);
            self.tallies[program.index()].count(event);
            return;
        }
        let unreported = self.judge_inputs(member, program, event);
        let mut holder = None;
        let counts = self.referees[program.index()].counts(member);
        if let (Event::Sampled { moment, before, .. }, true) = (event, counts) {
            let found = self.holder_before(program, *before);
            holder = found.map(|station| (*moment, station));
        }
        if let Event::Applied { source, .. } = event {
            let with_state = self.with_state(program);
            let holders = self.received_both_ways(program, with_state);
            if matches!(source, Source::Direct | Source::Reconstructed) {
                let runs = |station: &StationId| self.stations[station.index()].running().is_some();
                let running = self.candidates(program).filter(runs).collect();
                self.knowable.applied(program, with_state, running);
            }
            let [last, earlier] = &mut self.holders[program.index()];
            *earlier = std::mem::replace(last, holders);
            let [newest, last, earlier] = &mut self.arrived[program.index()];
            *earlier = std::mem::replace(last, std::mem::take(newest));
        }
        let referee = &mut self.referees[program.index()];
        let (chosen, started) = (referee.operator_may_choose(), referee.cold_starts());
        let mut found = referee.observe_from(member, self.now, event).err();
        if let (Some((moment, station)), false) = (holder, chosen)
            && referee.cold_starts() > started
        {
            found = Some(Violation::NeedlessColdStart { moment, station });
        }
        if let Event::StateLost { moment, asks: true, .. } = event
            && let Some(station) = self.holder_in_doubt(program, *moment)
        {
            found = Some(Violation::NeedlessQuestion { moment: *moment, station });
        }
        if let (Event::Sampled { moment, inputs, .. }, true) = (event, counts) {
            let referee = &self.referees[program.index()];
            let wrong = self.signals.judge(referee.layout(), *moment, inputs);
            found = found.or(wrong).or(unreported);
            self.signals.note(program, referee.truth());
        }
        if let Some(violation) = found.or(too_much) {
            observe(self.now, self.pace.cycle(), member, Record::Violation(&violation));
            self.violations.push(violation);
        }
        if let Event::Applied { source, heard, .. } = event {
            let expected = self.parts.stations[0].agreement.schedule.expected();
            if *source == Source::Direct && expected.without(*heard).is_empty() {
                self.ready.insert(program);
            } else {
                self.ready.remove(program);
            }
        }
        self.tallies[program.index()].count(event);
    }

    /// Takes an event of a remote I/O, and tells whether it may drive a wrong program, so that nothing that it applies is judged.
    fn may_be_misled(&mut self, member: Member, program: ProgramId, event: &Event) -> bool {
        let Some(mut misled) = self.misled.0.get(&member).copied() else {
            return false;
        };
        match event {
            Event::Applied { .. } => misled.is_contradicted_by(self.contradicting(member)),
            Event::StartedCold { .. } => {
                let (own, _) = self.received_by(member);
                let [last, earlier] = misled.contradicted_by;
                let chosen = self.referees[program.index()].operator_may_choose();
                misled.is_permitted = chosen || own.len() > last.and(earlier).len();
            }
            _ => {}
        }
        self.misled.0.insert(member, misled);
        misled.is_permitted
    }

    /// A member wakes. For one of two remote I/Os that does not drive, that is its deadline, which it does not report.
    pub(super) fn note_wakeup(&mut self, member: Member) {
        let Some(mut misled) = self.misled.0.get(&member).copied() else {
            return;
        };
        let part = self.running_remote_io(member).and_then(RemoteIo::part);
        if part.is_some_and(|part| part != Part::Author) {
            misled.is_contradicted_by(self.contradicting(member));
            self.misled.0.insert(member, misled);
        }
    }

    /// Stations with another configuration that have sent something since they started, and that a remote I/O can receive.
    fn contradicting(&self, member: Member) -> StationSet {
        let (_, others) = self.received_by(member);
        others.without(self.unannounced)
    }

    /// Stations that run and that a remote I/O can receive: those with its configuration, and the others.
    fn received_by(&self, member: Member) -> (StationSet, StationSet) {
        let remote_io = self.running_remote_io(member);
        let own = remote_io.map(RemoteIo::configurations);
        let (mut equal, mut others) = (StationSet::EMPTY, StationSet::EMPTY);
        for (rank, slot) in (0..).zip(&self.stations) {
            let station = StationId(rank);
            let reaches = self.links.reaches(Member::Station(station), member);
            if let (Some(running), true) = (slot.running(), reaches) {
                let agrees = own.is_some_and(|own| own.agree(&running.configurations()));
                let set = if agrees { &mut equal } else { &mut others };
                set.insert(station);
            }
        }
        (equal, others)
    }

    /// Of the stations that have the state of a program now, one that had it at the last two deadlines and that the remote I/O received before both:
    /// asked where a sample extends a state, `before`, that the referee does not know. Who has come back, or has taken over the state of one that has,
    /// only in the last cycle has not been able to say so.
    fn holder_before(&self, program: ProgramId, before: Lineage) -> Option<StationId> {
        if self.referees[program.index()].state_of(before).is_some() {
            return None;
        }
        self.lasting_holders(program).iter().next()
    }

    /// A frame reaches a station. What a suspended one takes later tells nothing of the cycles since.
    pub(super) fn note_reached(&mut self, station: StationId, frame: &Frame) {
        if self.stations[station.index()].running().is_some() {
            self.knowable.reached(station, frame);
        }
    }

    /// A frame reaches a remote I/O.
    pub(super) fn note_arrival(&mut self, member: Member, frame: &Frame) {
        if let (Member::Station(station), Some(program)) =
            (frame.header.sender, member.sampled_program())
            && self.author(program) == Some(member)
        {
            self.arrived[program.index()][0].insert(station);
        }
    }

    /// A station loses its memory: outputs of a state that it has now may be applied yet.
    pub(super) fn note_crash(&mut self, station: StationId) {
        for program in (0..self.remote_ios.len()).map(|index| ProgramId(index as u8)) {
            let has_state = self.with_state(program).contains(station);
            self.knowable.crash(program, station, has_state);
        }
    }

    /// A station that has the state of a program, where all stations that could have another one whose outputs were applied have it too, and
    /// receive each other. Where a cluster has several programs, none is named: what a station knows by the
    /// controllers of the others is not followed here.
    fn holder_in_doubt(&self, program: ProgramId, moment: Moment) -> Option<StationId> {
        if self.remote_ios.len() > 1 {
            return None;
        }
        let agreement = &self.parts.remote_ios[program.index()].agreement;
        let known_after = agreement.flag_after + agreement.history as u32 + CYCLES_TO_TELL;
        let candidates = self.candidates(program).collect();
        let in_doubt = self.knowable.in_doubt(program, candidates, (moment, known_after));
        let holders = self.lasting_holders(program);
        let pairs = in_doubt.iter().flat_map(|from| in_doubt.iter().map(move |to| (from, to)));
        let mut pairs = pairs.filter(|(from, to)| from != to);
        let receive_each_other =
            pairs.all(|(from, to)| self.links.reaches(Member::Station(from), Member::Station(to)));
        let all_have_it = receive_each_other && in_doubt.without(holders).is_empty();
        all_have_it.then(|| in_doubt.iter().next()).flatten()
    }

    /// Stations that have the state of a program now and had it at the last two deadlines, and that the remote I/O received before both.
    fn lasting_holders(&self, program: ProgramId) -> StationSet {
        let [_, last, earlier] = self.arrived[program.index()];
        let [held, held_before] = self.holders[program.index()];
        let now = self.received_both_ways(program, self.with_state(program));
        now.and(last).and(earlier).and(held).and(held_before)
    }

    /// Those of `stations` that the remote I/O of a program can receive and that can receive it; none while it is down or has another
    /// configuration, since they refuse each other then.
    fn received_both_ways(&self, program: ProgramId, stations: StationSet) -> StationSet {
        let remote_io = self.author(program).unwrap_or(Member::RemoteIo(program));
        let running = self.running_remote_io(remote_io);
        if running.is_none_or(|it| !self.parts.are_right(it.configurations())) {
            return StationSet::EMPTY;
        }
        let reaches = |station: &StationId| {
            let station = Member::Station(*station);
            self.links.reaches(station, remote_io) && self.links.reaches(remote_io, station)
        };
        stations.iter().filter(reaches).collect()
    }

    /// The stations that run with the right configuration and a state of a program that its next sample could extend.
    fn with_state(&self, program: ProgramId) -> StationSet {
        let referee = &self.referees[program.index()];
        let holds = |station: &StationId| {
            let admitted = self.stations[station.index()].running();
            let admitted = admitted.filter(|it| self.parts.are_right(it.configurations()));
            let state = admitted.and_then(|it| it.state_of(program));
            state.is_some_and(|(lineage, _)| referee.would_be_lost(lineage))
        };
        self.candidates(program).filter(holds).collect()
    }

    /// The stations that can run a program: its controller and every understudy.
    fn candidates(&self, program: ProgramId) -> impl Iterator<Item = StationId> + use<> {
        let understudies = self.remote_ios.len()..self.stations.len();
        let understudies = understudies.map(|rank| StationId(rank as u8));
        [program.controller()].into_iter().chain(understudies)
    }
}
