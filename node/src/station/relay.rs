//! Samples that did not reach every station: a station that has one relays it in its turn to those that lack it.
//!
//! ```text
//!   cycle t      understudy: its turn says that it lacks the sample of i           (one cycle without protection, at most)
//!   cycle t + 1  a station that has the sample of i relays it ──► the understudy, which sends last, is synchronised in t + 1
//! ```
//!
//! A relayed sample is the sample itself, with its history: a station that lacked several cycles replays them.
//! Invariant: one broken link of a remote I/O costs no replica its history, as long as any station receives the
//! samples. A sample that was changed on its way does not lead to its own lineage and is not relayed; a replica that
//! followed a forged one could not prove itself to the remote I/O.

use std::sync::Arc;

use smallvec::SmallVec;
use understudy_wire::{
    Body, Frame, Header, Holding, Member, Moment, ProgramId, ProgramSet, Recalled, Relayed,
    StationId, Turn, encode,
};

use super::{Station, replica_mut};

/// What a station knows of samples that others lack.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Relay {
    /// The samples of this cycle, from their remote I/Os or relayed.
    samples: SmallVec<[Arc<Frame>; 2]>,
    /// Programs whose samples came from their remote I/Os in this cycle.
    direct: ProgramSet,
    /// Programs whose samples other stations lack in this cycle.
    lacked: ProgramSet,
    /// Programs whose samples a station has relayed in this cycle.
    relayed: ProgramSet,
    /// Programs whose samples another station lacked in the last cycle.
    lacked_before: ProgramSet,
    /// Those of them whose samples this station had.
    awaited: ProgramSet,
}

impl Relay {
    /// A sample has come from its remote I/O.
    pub(super) fn receive(&mut self, program: ProgramId) {
        self.direct.insert(program);
    }

    /// Programs whose samples came from their remote I/Os in this cycle.
    pub(super) fn direct(&self) -> ProgramSet {
        self.direct
    }

    /// Keeps a sample of this cycle for stations that lack it.
    pub(super) fn keep(&mut self, frame: &Arc<Frame>) {
        let program = frame.header.sender.sampled_program();
        if let (Body::Sample(sample), Some(program)) = (&frame.body, program)
            && !self.has_sample(program)
            && sample.is_intact()
        {
            self.samples.push(Arc::clone(frame));
        }
    }

    /// Another station lacks samples of these programs.
    pub(super) fn lack(&mut self, programs: ProgramSet) {
        self.lacked = self.lacked.or(programs);
    }

    /// Whether it has the sample of a program in this cycle, from its remote I/O or relayed.
    pub(super) fn has_sample(&self, program: ProgramId) -> bool {
        let mut samples = self.samples.iter();
        samples.any(|frame| frame.header.sender.sampled_program() == Some(program))
    }

    /// Whether it has the samples that it relayed in the last cycle; it waits for them until its slot starts.
    pub(super) fn has_what_others_lack(&self) -> bool {
        let mut awaited = self.awaited.without(self.relayed).iter();
        awaited.all(|program| self.has_sample(program))
    }

    /// Ends a cycle: stations that lacked a sample in it are expected to lack it in the next one.
    pub(super) fn close_cycle(&mut self) {
        let samples = self.samples.iter();
        let had = samples.filter_map(|frame| frame.header.sender.sampled_program());
        let (lacked_before, awaited) = (self.lacked, self.lacked.and(had.collect()));
        *self = Self { lacked_before, awaited, ..Self::default() };
    }

    /// The samples that others lack and that no station has relayed in this cycle. The order rotates from cycle to cycle, so that samples that do not fit
    /// are sent later: a history bridges the cycles between.
    fn samples_for_others(&self, moment: Moment) -> Vec<Relayed> {
        let lacked = self.lacked_before.or(self.lacked).without(self.relayed);
        let lacking =
            |frame: &Arc<Frame>| match (frame.header.sender.sampled_program(), &frame.body) {
                (Some(program), Body::Sample(sample)) if lacked.contains(program) => {
                    Some(Relayed { program, sample: sample.clone() })
                }
                _ => None,
            };
        let mut samples: Vec<Relayed> = self.samples.iter().filter_map(lacking).collect();
        if !samples.is_empty() {
            let by = moment.cycle.0 as usize % samples.len();
            samples.rotate_left(by);
        }
        samples
    }
}

impl Station {
    /// Follows the samples that another station relays, where it lacks them.
    pub(super) fn receive_relayed(&mut self, header: &Header, turn: &Turn) {
        self.relay.lack(turn.lacks);
        for Relayed { program, sample } in &turn.relayed {
            self.relay.relayed.insert(*program);
            let in_cluster = program.index() < self.settings.agreement.schedule.controllers();
            if !in_cluster || self.relay.has_sample(*program) {
                continue;
            }
            let sender = Member::RemoteIo(*program);
            let header = Header { sender, ..*header };
            let frame = Arc::new(Frame { header, body: Body::Sample(sample.clone()) });
            self.follow(*program, &frame, sample);
        }
    }

    /// Compares the states that another station reports to hold.
    pub(super) fn receive_holdings(
        &mut self,
        station: StationId,
        holdings: &[Holding],
        recalled: &[Recalled],
    ) {
        self.cycle.receives_station = true;
        let now = self.member.moment();
        let silent_after = self.settings.agreement.flag_after;
        for holding in holdings {
            if let Some(replica) = replica_mut(&mut self.replicas, holding.program) {
                let theirs = recalled.iter().find(|it| it.program == holding.program);
                replica.receive_holding(station, holding, theirs, (now, silent_after));
            }
        }
    }

    /// Programs that it runs and whose samples did not come from their remote I/Os in this cycle.
    pub(super) fn lacks(&self) -> ProgramSet {
        let runs: ProgramSet = self.settings.runs().collect();
        runs.without(self.relay.direct)
    }

    /// The turn with as many of the samples that others lack as a frame takes.
    pub(super) fn with_relayed(&self, mut turn: Turn) -> Body {
        turn.relayed = self.relay.samples_for_others(self.member.moment());
        while !turn.relayed.is_empty() {
            let frame = self.member.frame(Body::Turn(turn.clone()));
            if encode(&frame, &mut Vec::new()).is_ok() {
                break;
            }
            turn.relayed.pop();
        }
        Body::Turn(turn)
    }
}
