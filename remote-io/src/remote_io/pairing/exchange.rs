//! What two remote I/Os of one program send to each other, and what stations tell of them.

use understudy_wire::{
    Body, Frame, Header, Holding, Member, Moment, Pair, Part, ProgramSet, Sample, StationId, Time,
};

use super::super::RemoteIo;
use super::{AWAITED_ANSWERS, Partner};
use crate::event::Event;

impl RemoteIo {
    /// A frame of the other remote I/O of this program; true where it is one.
    pub(in crate::remote_io) fn receive_partner(&mut self, now: Time, frame: &Frame) -> bool {
        let own = Member::RemoteIo(self.settings.program);
        let sender = frame.header.sender;
        let is_ours = self.pairing.as_ref().is_some_and(|pairing| {
            let partner = if pairing.is_first() { own.partner() } else { Some(own) };
            partner == Some(sender)
        });
        if !is_ours || !matches!(frame.body, Body::Pair(_) | Body::Sample(_)) {
            return false;
        }
        if self.member.admits(now, &frame.header) {
            match &frame.body {
                Body::Sample(sample) => self.receive_their_sample(now, sample),
                Body::Pair(pair) => self.receive_pair(now, &frame.header, pair),
                _ => {}
            }
        }
        true
    }

    fn receive_their_sample(&mut self, now: Time, sample: &Sample) {
        let width = self.layout.input_width();
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        if pairing.part == Part::Author {
            return;
        }
        pairing.applied = pairing.applied.max(sample.applied);
        pairing.gone = sample.gone;
        if sample.history.iter().all(|step| step.inputs.width() == width) {
            pairing.received = Some(sample.clone());
        }
        pairing.is_bound(now);
        self.become_answered(None);
        self.follow_again(now);
    }

    fn receive_pair(&mut self, now: Time, header: &Header, theirs: &Pair) {
        let moment = self.moment();
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        let was_lost = pairing.partner.is_lost;
        if pairing.lack(theirs).is_none() {
            pairing.partner = Partner { at: now, is_known: true, is_lost: false };
        }
        let is_back = was_lost && !pairing.partner.is_lost;
        pairing.theirs = Some(theirs.clone());
        if let Some(sent) = theirs.bound_by.filter(|sent| pairing.sent.contains(sent)) {
            pairing.promised = pairing.promised.max(Some(sent));
        }
        // A frame from before this one became the author says nothing of now.
        let is_old =
            header.moment.epoch == pairing.since.1.epoch && header.moment < pairing.since.1;
        let is_beaten = pairing.part == Part::Author
            && theirs.part == Part::Author
            && !is_old
            && pairing.settings.is_twin;
        if theirs.part == Part::Author {
            pairing.able = true;
        }
        let binds = pairing.binds(theirs);
        if binds {
            pairing.is_bound(now);
            pairing.bound_by = Some(theirs.sent);
        }
        if is_back {
            self.report(Event::PartnerReceived { moment });
        }
        if is_beaten {
            self.report(Event::SecondAuthor { moment });
            return self.step_aside(now);
        }
        if binds {
            self.become_answered(None);
            self.follow_again(now);
        }
        self.receive_modules(now, theirs);
        if binds {
            self.send_pair();
        }
    }

    /// A station has followed a sample in this cycle, or lacks it: what its turn or its join says.
    fn note_follower(
        &mut self,
        station: StationId,
        (lacks, follows): (bool, bool),
        stepped: Option<Moment>,
    ) {
        let (moment, sampled_at) = (self.moment(), self.sampled_at);
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        if follows && pairing.part == Part::Author {
            pairing.followed = Some((moment, sampled_at));
        }
        pairing.gone.remove(station);
        let mut reports = pairing.reports.iter_mut();
        if let Some(report) = reports.find(|report| report.station == station) {
            report.note(lacks);
            report.stepped = stepped;
        }
    }

    /// What a turn or a join of a station says of the samples of this program.
    pub(in crate::remote_io) fn note_sample_of(
        &mut self,
        station: StationId,
        holdings: &[Holding],
        lacks: ProgramSet,
    ) {
        let (program, moment) = (self.settings.program, self.moment());
        let holding = Holding::of(holdings, program);
        let stepped = holding.map(|holding| holding.stepped);
        let lacks = lacks.contains(program) && stepped != Some(moment);
        let run = self.arbiter.knowledge.run().filter(|run| run.sampled);
        let head = run.map(|run| run.history.head());
        let follows = holding.is_some_and(|holding| Some(holding.lineage) == head);
        self.note_follower(station, (lacks, follows), stepped);
    }

    /// A station relays a sample of this program: an author is received there.
    pub(in crate::remote_io) fn note_relayed(&mut self) {
        if let Some(pairing) = &mut self.pairing {
            pairing.reports.iter_mut().for_each(|report| report.note(false));
        }
    }

    /// A cycle is over. A station may have followed the other one in a cycle that was skipped.
    pub(in crate::remote_io) fn close_pair_cycle(&mut self, skipped: bool) {
        if let Some(pairing) = &mut self.pairing {
            pairing.reports.iter_mut().for_each(|report| report.close_cycle(skipped));
        }
    }

    pub(super) fn send_pair(&mut self) {
        let modules = self.modules_to_send();
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        if pairing.sent.len() == AWAITED_ANSWERS {
            pairing.sent.remove(0);
        }
        pairing.sent.push(pairing.now);
        let pair = Pair {
            part: pairing.part,
            able: pairing.able,
            receives_stations: pairing.receives_stations,
            sent: pairing.now,
            bound_by: pairing.bound_by.filter(|_| pairing.part != Part::Author),
            modules,
        };
        self.member.send(Body::Pair(pair));
    }
}
