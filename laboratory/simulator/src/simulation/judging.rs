//! What the referees are shown of a remote I/O, and what they say.

use understudy_remote_io::Event;
use understudy_wire::{Lineage, Member, ProgramId, Source, StationId, StationSet};

use super::{Observe, Record, Simulation};
use crate::referee::Violation;

impl Simulation {
    pub(super) fn judge(&mut self, program: ProgramId, event: &Event, observe: &mut Observe<'_>) {
        let mut holder = None;
        if let Event::Sampled { moment, before, .. } = event {
            let found = self.holder_before(program, *before);
            holder = found.map(|station| (*moment, station));
        }
        if let Event::Applied { .. } = event {
            let holders = self.holders(program);
            let [last, earlier] = &mut self.holders[program.index()];
            *earlier = std::mem::replace(last, holders);
            let [newest, last, earlier] = &mut self.arrived[program.index()];
            *earlier = std::mem::replace(last, std::mem::take(newest));
        }
        let referee = &mut self.referees[program.index()];
        let (chosen, started) = (referee.operator_may_choose(), referee.cold_starts());
        let mut found = referee.observe(event).err();
        if let (Some((moment, station)), false) = (holder, chosen)
            && referee.cold_starts() > started
        {
            found = Some(Violation::NeedlessColdStart { moment, station });
        }
        if let Event::Sampled { moment, inputs, .. } = event {
            let settings = &self.parts.remote_ios[program.index()];
            let wrong = self.signals.judge(settings, *moment, inputs);
            found = found.or(wrong);
            let referee = &self.referees[program.index()];
            self.signals.note(program, referee.truth());
        }
        if let Some(violation) = found {
            let member = Member::RemoteIo(program);
            observe(self.now, self.pace.cycle(), member, Record::Violation(&violation));
            self.violations.push(violation);
        }
        if let Event::Applied { source, heard, .. } = event {
            if *source == Source::Direct && heard.len() == self.stations.len() {
                self.ready.insert(program);
            } else {
                self.ready.remove(program);
            }
        }
        self.tallies[program.index()].count(event);
    }

    /// Of the stations that have the state of a program now, one that had it at the last two deadlines and that the remote I/O received before both:
    /// asked where a sample extends a state, `before`, that the referee does not know. Who has come back, or has taken over the state of one that has,
    /// only in the last cycle has not been able to say so.
    fn holder_before(&self, program: ProgramId, before: Lineage) -> Option<StationId> {
        if self.referees[program.index()].state_of(before).is_some() {
            return None;
        }
        let [_, last, earlier] = self.arrived[program.index()];
        let [held, held_before] = self.holders[program.index()];
        let now = self.holders(program);
        now.iter().find(|&station| {
            let sets = [last, earlier, held, held_before];
            sets.iter().all(|set| set.contains(station))
        })
    }

    /// The stations that run, that the remote I/O of a program can receive and that can receive it, with a state that its next sample could extend.
    fn holders(&self, program: ProgramId) -> StationSet {
        let remote_io = Member::RemoteIo(program);
        let Some(running) = self.remote_ios[program.index()].running() else {
            return StationSet::EMPTY;
        };
        let (own, referee) = (running.configuration(), &self.referees[program.index()]);
        let holds = |station: &StationId| {
            let admitted = self.stations[station.index()].running();
            let admitted = admitted.filter(|it| it.configuration() == own);
            let state = admitted.and_then(|it| it.state_of(program));
            let station = Member::Station(*station);
            state.is_some_and(|(lineage, _)| referee.would_be_lost(lineage))
                && self.links.reaches(station, remote_io)
                && self.links.reaches(remote_io, station)
        };
        // The others do not run the program.
        let understudies = self.remote_ios.len()..self.stations.len();
        let understudies = understudies.map(|rank| StationId(rank as u8));
        let candidates = [StationId(program.0)].into_iter().chain(understudies);
        candidates.filter(holds).collect()
    }
}
