//! Two remote I/Os of one program, of which one at most is the author: it makes u(i) and drives y(i).
//!
//! ```text
//!                 no author for `take_over_after` deadlines, and
//!                 the other one is bound, or no station follows one
//!   Follower ────────────────────────────────────────────────────► TakingOver ── the history is known ──► Author
//!      ▲                                                               │                                    │
//!      └──── an author is received, or a station follows one ──────────┘                                    │
//!      └──── neither a station has followed it nor the other one was bound for `take_over_after` cycles ────┘
//! ```
//!
//! Invariant *One author*: outputs are driven in a cycle t only where one of the two holds.
//!
//! - A station has followed a sample of this remote I/O in one of the cycles t - `take_over_after` to t. The other one begins only where each station
//!   that could follow has reported in each of the `take_over_after` cycles before that it has received no sample of its remote I/O, or cannot hold
//!   the state (as [`Holders::gone`](crate::holders::Holders::gone) has it).
//! - The other one has answered a frame of this remote I/O that was sent less than `take_over_after` periods ago: it is bound by it for longer.
//!
//! One that has followed the author begins first. After that the two may begin in alternate cycles, so they do not begin at one time. What a switchover continues from is decided as after a restart
//! (`recovery.rs`): an author that ends to be one forgets its history, but not what it has applied.

mod exchange;
mod modules;
mod take_over;

use std::time::Duration;

use smallvec::SmallVec;
use understudy_cycle::Output;
use understudy_wire::{Moment, Pair, Part, Sample, StationId, StationSet, Time};

use modules::Modules;

use super::RemoteIo;
use super::actuation::Actuation;
use super::protection::Protection;
use super::writing::Writing;
use crate::diagnosis::Diagnosing;
use crate::event::{Event, ForceEnd, PartnerLack};
use crate::settings::{PairSettings, Settings};

/// Frames to the other one whose answer counts: those of a few deadlines.
const AWAITED_ANSWERS: usize = 8;

/// Deadlines without a followed sample before the other remote I/O is given the outputs, in `take_over_after`.
const IDLE_PATIENCE: u32 = 16;

/// Cycles in which a follower of the author may begin, and no other one may; after them the two may begin in alternate cycles.
const CHANCES: u32 = 2;

/// Time without the other remote I/O after which its loss is reported, and at least this multiple of `take_over_after`.
const LOSS_TIME: Duration = Duration::from_millis(500);
const LOSS_PATIENCE: u32 = 4;

/// The same of one that was not received yet: the two are not started at one time.
const FIRST_LOSS_TIME: Duration = Duration::from_secs(5);

/// What a remote I/O knows of the other one of its program, and of the stations that follow either.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Pairing {
    settings: PairSettings,
    part: Part,
    able: bool,
    now: Time,
    /// When the author was received last, or one that goes first.
    heard_at: Time,
    /// When the frame of the other one was sent by which this one is bound; none where nothing binds it.
    bound_by: Option<Time>,
    /// When the last frames to the other one were sent.
    sent: SmallVec<[Time; AWAITED_ANSWERS]>,
    /// The newest of them by which the other one is bound.
    promised: Option<Time>,
    /// The newest sample of this one that a station has followed: its cycle, and when it was taken.
    followed: Option<(Moment, Time)>,
    /// The cycle of its first sample since it became the author.
    first: Option<Moment>,
    /// When this one became the author, and in which cycle.
    since: (Time, Moment),
    /// What the stations that could follow report.
    reports: SmallVec<[Report; 2]>,
    /// Stations that could not follow without a state from another one, as the author had it last, and that were not received since.
    gone: StationSet,
    /// The newest applied sample that this one knows of.
    applied: Option<Moment>,
    /// The newest sample of the other one.
    received: Option<Sample>,
    /// Deadlines for which this one samples or begins to, and no station has followed it.
    idle: u32,
    /// When the other one was received, whether it was, and whether its loss was reported.
    partner: Partner,
    /// The last report of the other one.
    theirs: Option<Pair>,
    /// Deadlines for which stations are received and this one may not begin.
    refused: u32,
    /// The operator is asked because it may not begin.
    asks: bool,
    /// Whether a station that can hold the state was received at the last deadline, as [`Report::is_received`] has it.
    receives_stations: bool,
    /// Where both remote I/Os are wired to the plant.
    modules: Option<Modules>,
}

/// Whether the other remote I/O is received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Partner {
    /// When it was received last as one that could take over.
    at: Time,
    is_known: bool,
    is_lost: bool,
}

/// What a station reports of the samples of its remote I/O.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Report {
    station: StationId,
    /// Whether it lacks them in this cycle; `None` where it was not received.
    lacks: Option<bool>,
    /// Cycles in a row in which it lacked them.
    lacked_for: u32,
    /// Cycle of the newest sample that it has followed.
    stepped: Option<Moment>,
}

impl Report {
    fn note(&mut self, lacks: bool) {
        self.lacks = Some(lacks && self.lacks != Some(false));
    }

    /// The cycle is over; `skipped` where the next one was not received.
    fn close_cycle(&mut self, skipped: bool) {
        self.lacked_for = match self.lacks.take() {
            Some(true) if !skipped => self.lacked_for.saturating_add(1),
            _ => 0,
        };
    }

    /// Whether it is received: in this cycle, or in the last one that it lacked samples, since a station that joins is often received after the deadline.
    fn is_received(&self) -> bool {
        self.lacks.is_some() || self.lacked_for > 0
    }

    /// Cycles in a row in which it lacked them, with the current one as far as it was received in it.
    fn lacked_for_now(&self) -> u32 {
        match self.lacks {
            Some(true) => self.lacked_for.saturating_add(1),
            Some(false) => 0,
            None => self.lacked_for,
        }
    }
}

impl Pairing {
    pub(super) fn new(
        now: Time,
        of: &Settings,
        stations: impl Iterator<Item = StationId>,
    ) -> Option<Self> {
        let settings = of.pair?;
        let report = |station| Report { station, lacks: None, lacked_for: 0, stepped: None };
        Some(Self {
            settings,
            part: Part::Follower,
            able: true,
            now,
            heard_at: now,
            bound_by: None,
            sent: SmallVec::new(),
            promised: None,
            followed: None,
            first: None,
            since: (now, Moment::default()),
            reports: stations.map(report).collect(),
            gone: StationSet::EMPTY,
            applied: None,
            received: None,
            idle: 0,
            partner: Partner { at: now, is_known: false, is_lost: false },
            theirs: None,
            refused: 0,
            asks: false,
            receives_stations: false,
            modules: Modules::of(of),
        })
    }

    /// The newest applied sample that it knows of, of its own and of the other remote I/O.
    pub(super) fn applied(&self) -> Option<Moment> {
        self.applied
    }

    /// The newest sample of the other remote I/O.
    pub(super) fn received(&self) -> Option<&Sample> {
        self.received.as_ref()
    }

    fn is_first(&self) -> bool {
        !self.settings.is_twin
    }

    /// Whether what the other one reports binds this one: it is the author or becomes it, or it goes first.
    fn binds(&self, theirs: &Pair) -> bool {
        match theirs.part {
            Part::Author => self.part != Part::Author,
            Part::TakingOver => {
                self.part == Part::Follower || self.part == Part::TakingOver && !self.is_first()
            }
            Part::Follower => {
                let goes_first = !self.is_first() && self.received.is_none();
                // One that receives no station, and is received over a direct link, cannot begin.
                let can_begin =
                    theirs.able && (theirs.receives_stations || !self.receives_stations);
                self.part == Part::Follower && goes_first && (can_begin || !self.able)
            }
        }
    }

    /// Why the other one could not take over where this one fails, as it reports. That it receives no station says nothing where this one receives none too.
    fn lack(&self, theirs: &Pair) -> Option<PartnerLack> {
        if self.part != Part::Author {
            None
        } else if modules::are_away(theirs) {
            Some(PartnerLack::Modules)
        } else if self.receives_stations && !theirs.receives_stations {
            Some(PartnerLack::Stations)
        } else {
            None
        }
    }

    fn is_bound(&mut self, now: Time) {
        self.heard_at = now;
    }

    /// Starts to listen anew: what was received before says nothing of now.
    fn wait(&mut self, now: Time) {
        self.is_bound(now);
        self.bound_by = None;
        self.promised = None;
        self.refused = 0;
        for report in &mut self.reports {
            report.lacks = None;
            report.lacked_for = 0;
        }
    }
}

impl RemoteIo {
    /// Whether this remote I/O samples and drives: it has no second one, or is the author.
    pub(super) fn is_author(&self) -> bool {
        self.pairing.as_ref().is_none_or(|pairing| pairing.part == Part::Author)
    }

    /// Its part, of one of two remote I/Os of a program.
    pub fn part(&self) -> Option<Part> {
        self.pairing.as_ref().map(|pairing| pairing.part)
    }

    /// Whether outputs may be driven now.
    pub(super) fn may_drive(&self) -> bool {
        let Some(pairing) = &self.pairing else {
            return true;
        };
        let lasts = self.period() * pairing.settings.take_over_after + self.period() / 4;
        let is_author = pairing.part == Part::Author;
        is_author && (self.is_followed(pairing) || self.is_promised_for(pairing, lasts))
    }

    /// Whether a sample may be taken now: the other one, if it becomes the author, takes its first one later.
    pub(super) fn may_sample(&self) -> bool {
        let Some(pairing) = &self.pairing else {
            return true;
        };
        let is_new =
            pairing.followed.is_none() && pairing.first.is_none_or(|first| first == self.moment());
        let is_author = pairing.part == Part::Author;
        is_author && (is_new || self.is_followed(pairing) || self.is_promised(pairing))
    }

    /// Whether the time is over in which a station must follow a new author.
    fn is_over(&self, pairing: &Pairing) -> bool {
        let begun = pairing.now.since(pairing.since.0);
        begun > self.period() * (pairing.settings.take_over_after + 1)
    }

    /// A station has followed this author in one of the last cycles.
    fn is_followed(&self, pairing: &Pairing) -> bool {
        let Some((moment, at)) = pairing.followed else {
            return false;
        };
        let (now, after) = (self.moment(), pairing.settings.take_over_after);
        let lasts = self.period() * after + self.period() * 4 / 5;
        let is_recent = moment.epoch == now.epoch && moment.plus(u64::from(after)) >= now;
        is_recent && pairing.now.since(at) <= lasts
    }

    /// The other one is bound and does not become the author.
    fn is_promised(&self, pairing: &Pairing) -> bool {
        let lasts = self.period() * pairing.settings.take_over_after - self.period() / 10;
        self.is_promised_for(pairing, lasts)
    }

    fn is_promised_for(&self, pairing: &Pairing, lasts: Duration) -> bool {
        pairing.promised.is_some_and(|sent| pairing.now.since(sent) <= lasts)
    }

    fn period(&self) -> Duration {
        self.settings.agreement.schedule.period()
    }

    /// Before any input: an author whose time is over drives nothing more.
    pub(super) fn tend_pair(&mut self, now: Time) {
        let slept = now.since(self.member.wakeup()) > self.period();
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        pairing.now = now;
        if pairing.part != Part::Author {
            if slept {
                pairing.wait(now);
                self.follow_again(now);
                self.release_modules();
            }
            return;
        }
        let ends = |pairing: &Pairing| slept || self.is_over(pairing);
        if !self.may_drive() && self.pairing.as_ref().is_some_and(ends) {
            self.step_aside(now);
        }
    }

    /// One that takes over goes back.
    fn follow_again(&mut self, now: Time) {
        if let Some(pairing) = &mut self.pairing
            && pairing.part == Part::TakingOver
        {
            pairing.part = Part::Follower;
            pairing.wait(now);
            self.give_up_field();
            self.report_part();
        }
    }

    /// The author becomes a follower, as one that has restarted, before it drives anything more.
    fn step_aside(&mut self, now: Time) {
        let newest = self.arbiter.knowledge.floor().map(|floor| floor.moment);
        let gone = self.arbiter.holders.gone();
        let moment = self.moment();
        let Some(pairing) = &mut self.pairing else {
            return;
        };
        pairing.part = Part::Follower;
        pairing.followed = None;
        pairing.applied = pairing.applied.max(newest);
        pairing.received = None;
        pairing.gone = gone;
        pairing.wait(now);
        self.become_listening();
        self.protection = Protection::default();
        self.inputs.diagnosing = Diagnosing::new(self.settings.diagnosis.as_deref());
        let void = self.inputs.writing.lose(&self.layout.operator_inputs, moment, |_| true);
        self.report_void(&void);
        self.inputs.writing = Writing::new(&self.layout.operator_inputs);
        self.end_all_forces(ForceEnd::Handover);
        self.actuation = Actuation::default();
        self.differed.clear();
        self.give_up_field();
        self.note_distrusted();
        self.release_modules();
        self.report_part();
    }

    fn give_up_field(&mut self) {
        if !self.has_own_modules() {
            self.inputs.sensors = None;
            self.member.put(Output::Connect(false));
        }
    }

    fn connect_field(&mut self) {
        if !self.has_own_modules() {
            self.member.put(Output::Connect(true));
        }
    }

    fn report_part(&mut self) {
        let moment = self.moment();
        if let Some(part) = self.part() {
            self.report(Event::PartChanged { moment, part });
        }
    }

    /// Starts to sample: at a switchover, or as the operator has chosen.
    pub(super) fn become_author(&mut self, moment: Moment) {
        let was_connected = match &mut self.pairing {
            Some(pairing) if pairing.part != Part::Author => {
                let before = std::mem::replace(&mut pairing.part, Part::Author);
                pairing.since = (pairing.now, moment);
                pairing.followed = None;
                pairing.idle = 0;
                pairing.first = None;
                before == Part::TakingOver
            }
            _ => return,
        };
        if !was_connected {
            self.connect_field();
        }
        self.report_part();
        self.take_over_modules();
        self.send_pair();
    }

    /// For how many cycles no station can have followed another author: each that could has lacked the samples, or is gone.
    fn unfollowed_for(&self, pairing: &Pairing, lacked_for: impl Fn(&Report) -> u32) -> u32 {
        let gone = pairing.gone.and(self.arbiter.holders.accounted_for());
        let is_gone = |station| gone.contains(station) && !self.arbiter.holders.is_living(station);
        let able = pairing.reports.iter().filter(|report| !is_gone(report.station));
        able.map(lacked_for).min().unwrap_or(0)
    }

    /// Cycles up to `moment` since a station has followed an author, as the stations report alike to both remote I/Os; nothing where that was in
    /// another epoch, or never.
    fn cycles_without_author(&self, pairing: &Pairing, moment: Moment) -> Option<u64> {
        let lacking = pairing.reports.iter().filter(|report| report.lacked_for > 0);
        let stepped = lacking.filter_map(|report| report.stepped).max()?;
        (stepped.epoch == moment.epoch).then(|| moment.cycle.0.saturating_sub(stepped.cycle.0))
    }

    /// Whether the one that takes over may begin in the cycle that has just begun.
    pub(super) fn may_begin(&self, moment: Moment) -> bool {
        let Some(pairing) = &self.pairing else {
            return true;
        };
        if pairing.part == Part::Author {
            return true;
        }
        let is_silent =
            pairing.now.since(pairing.heard_at) >= self.period() * pairing.settings.take_over_after;
        let after = pairing.settings.take_over_after;
        let is_unfollowed = self.unfollowed_for(pairing, |it| it.lacked_for) >= after;
        let cycles = self.cycles_without_author(pairing, moment);
        let is_reserved = cycles.is_some_and(|cycles| cycles <= u64::from(after + CHANCES));
        let is_its_cycle = moment.cycle.0.is_multiple_of(2) == pairing.is_first();
        let is_its_turn = if is_reserved { pairing.received.is_some() } else { is_its_cycle };
        pairing.part == Part::TakingOver
            && is_silent
            && (self.is_promised(pairing) || is_unfollowed && is_its_turn)
    }

    /// A new author has taken a sample. If no station follows it in this cycle, the other one may begin in the next one.
    pub(super) fn note_own_sample(&mut self) {
        let moment = self.moment();
        if let Some(pairing) = &mut self.pairing {
            pairing.first.get_or_insert(moment);
        }
    }
}
