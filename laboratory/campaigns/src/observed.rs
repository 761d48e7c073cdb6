//! What the journal of a run, or of a cluster that still runs, shows of failures, repairs and masking.
//!
//! A station has failed where a member flags it (θ = 1). It failed at the step of the scenario that killed or stopped it, where the
//! journal has one, and otherwise when it last published; it is repaired when it speaks again. A flag beside a stall of the host is none.
//! The journal itself says who the members are; the observation begins when each station has published.

use std::collections::BTreeMap;

use understudy_journal::{Happening, JournalError, Process, Record, RunEvent, is_provable};
use understudy_reliability::Observed;
use understudy_wire::{Member, ProgramId, Source, StationId};

/// Nanoseconds of an hour.
const HOUR_NS: f64 = 3.6e12;

/// How long before and after a stall silence is explained by it.
const STALL_NS: u64 = 100_000_000;

/// How much later than a station's last word the step may be noted that took it away: when its process is gone.
const NOTED_NS: u64 = 50_000_000;

/// What a journal shows.
#[derive(Debug, Clone, PartialEq)]
pub struct JournalView {
    /// Programs, N.
    pub controllers: u32,
    /// Understudies, S.
    pub understudies: u32,
    /// For [`understudy_reliability::outlook`].
    pub observed: Observed,
    /// Silences that a stall of the host explains.
    pub stalls: u64,
    /// Deadlines at which a remote I/O was at its fail-safe.
    pub fail_safe: u64,
    /// Whether the last line was cut, as that of a journal that is still written may be.
    pub cut: bool,
}

/// A journal that shows nothing.
#[derive(Debug, thiserror::Error)]
pub enum ObservationError {
    /// It cannot be read.
    #[error("{}: {}", code_of(.0), .0)]
    Journal(#[from] JournalError),
    /// There is no time to observe.
    #[error(
        "U0533: the journal has no time in which every station had published; silent until its end: {silent}"
    )]
    NeverWhole {
        /// Ranks of stations, or `all`.
        silent: String,
    },
}

impl ObservationError {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Journal(error) => code_of(error),
            Self::NeverWhole { .. } => "U0533",
        }
    }
}

fn code_of(error: &JournalError) -> &'static str {
    match error {
        JournalError::Version(_) => "U0534",
        JournalError::Read(_) | JournalError::Line { .. } => "U0532",
    }
}

/// What is kept of a record.
#[derive(Debug, Clone, Copy)]
enum Sign {
    Published(StationId),
    Flagged(StationId),
    /// A step of the scenario took it away, or its process ended unexpectedly.
    Taken(StationId),
    Stalled,
    /// A deadline.
    Applied(ProgramId, Source),
}

/// Reads a journal to its end.
///
/// # Errors
/// A line before the last one that is no record, or no time to observe.
pub fn observe_journal(
    records: impl Iterator<Item = Result<Record, JournalError>>,
) -> Result<JournalView, ObservationError> {
    let mut signs = Vec::new();
    let mut broken = None;
    for record in records {
        // Only the last line of a journal may be cut.
        if let Some(error) = broken.take() {
            return Err(ObservationError::Journal(error));
        }
        match record {
            Ok(record) => signs.extend(sign(&record).map(|sign| (record.at_ns, sign))),
            Err(error @ JournalError::Line { .. }) => broken = Some(error),
            Err(error) => return Err(error.into()),
        }
    }
    // Lines of different members may be some cycles apart.
    signs.sort_by_key(|(at, _)| *at);
    let frame = frame(&signs)?;
    let mut watch = Watch::new(&frame, &signs);
    for &(at, sign) in signs.iter().filter(|(at, _)| *at >= frame.from) {
        watch.see(at, sign);
    }
    Ok(view(watch, &frame, broken.is_some()))
}

fn view(mut watch: Watch, frame: &Frame, cut: bool) -> JournalView {
    watch.close_newest(u64::MAX);
    let hours = |ns: u64| ns as f64 / HOUR_NS;
    let open: u64 = watch
        .lives
        .iter()
        .map(|life| match life {
            Life::Repaired { since } => frame.to - since,
            Life::Up { .. } => 0,
        })
        .sum();
    let repairing = watch.repairing + open;
    let undetected: u64 = watch.detections.iter().sum();
    let all = (frame.to - frame.from) * frame.stations as u64;
    let mut failures_at: Vec<f64> =
        watch.failures.iter().map(|at| hours(at.saturating_sub(frame.from))).collect();
    failures_at.sort_by(f64::total_cmp);
    let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    JournalView {
        controllers: count(frame.programs),
        understudies: count(frame.stations.saturating_sub(frame.programs)),
        observed: Observed {
            hours: hours(frame.to - frame.from),
            working_hours: hours(all.saturating_sub(repairing + undetected)),
            failures_at,
            asked: watch.asked,
            masked: watch.masked,
            repairs: watch.repairs,
            repairing_hours: hours(repairing),
            detection_hours: watch.detections.iter().map(|&ns| hours(ns)).collect(),
        },
        stalls: watch.excused,
        fail_safe: watch.fail_safe,
        cut,
    }
}

fn sign(record: &Record) -> Option<Sign> {
    use understudy_node::Event as Station;
    use understudy_remote_io::Event as RemoteIo;
    match (&record.event, record.member) {
        (Happening::Station(Station::Published { .. }), Some(Member::Station(rank))) => {
            Some(Sign::Published(rank))
        }
        (Happening::Station(Station::Flagged { station, .. }), _)
        | (Happening::RemoteIo(RemoteIo::Flagged { station, .. }), _) => {
            Some(Sign::Flagged(*station))
        }
        (Happening::Station(Station::Stalled { .. }), _)
        | (Happening::RemoteIo(RemoteIo::Stalled { .. }), _) => Some(Sign::Stalled),
        (
            Happening::RemoteIo(RemoteIo::Applied { source, .. }),
            Some(Member::RemoteIo(program) | Member::Twin(program)),
        ) => Some(Sign::Applied(program, *source)),
        (Happening::Run(RunEvent::Fault { action, member: Member::Station(rank), .. }), _)
            if Process::after(*action).is_some_and(|process| !process.is_running()) =>
        {
            Some(Sign::Taken(*rank))
        }
        (Happening::Run(RunEvent::Ended { member: Member::Station(rank), .. }), _) => {
            Some(Sign::Taken(*rank))
        }
        _ => None,
    }
}

#[derive(Debug, Clone, Copy)]
enum Life {
    /// It last published then; a step of the scenario may have taken it away since.
    Up { published: u64, taken: Option<u64> },
    /// θ = 1.
    Repaired { since: u64 },
}

/// A failure that should have been masked.
struct Newest {
    /// The first deadline that shows that it was not.
    missed: Option<u64>,
}

/// Times in nanoseconds.
struct Watch {
    lives: Vec<Life>,
    programs: usize,
    stalls: Vec<u64>,
    /// The last deadline with nothing true to apply that neither a stall nor a failure of the system explains.
    missed: Option<u64>,
    /// The newest failure, where it should have been masked.
    newest: Option<Newest>,
    failures: Vec<u64>,
    asked: u64,
    masked: u64,
    detections: Vec<u64>,
    repairs: u64,
    repairing: u64,
    excused: u64,
    fail_safe: u64,
}

/// From when to when there is something to observe, and of how many members.
struct Frame {
    stations: usize,
    programs: usize,
    from: u64,
    to: u64,
}

fn frame(signs: &[(u64, Sign)]) -> Result<Frame, ObservationError> {
    let mut first: BTreeMap<StationId, u64> = BTreeMap::new();
    let (mut stations, mut programs, mut to) = (0, 0, 0);
    for &(at, sign) in signs {
        to = to.max(at);
        match sign {
            Sign::Published(rank) => {
                stations = stations.max(rank.index() + 1);
                first.entry(rank).or_insert(at);
            }
            Sign::Flagged(rank) | Sign::Taken(rank) => stations = stations.max(rank.index() + 1),
            Sign::Applied(program, _) => programs = programs.max(program.index() + 1),
            Sign::Stalled => {}
        }
    }
    let silent: Vec<String> = (0..stations)
        .filter(|&rank| !first.contains_key(&StationId(rank as u8)))
        .map(|rank| format!("station {}", rank + 1))
        .collect();
    let from = first.values().max().copied().unwrap_or(0);
    if stations == 0 || programs == 0 || !silent.is_empty() || from >= to {
        let silent = if silent.is_empty() { "all".to_owned() } else { silent.join(", ") };
        return Err(ObservationError::NeverWhole { silent });
    }
    Ok(Frame { stations, programs, from, to })
}

impl Watch {
    fn new(frame: &Frame, signs: &[(u64, Sign)]) -> Self {
        let up = Life::Up { published: frame.from, taken: None };
        let stalls = signs.iter().filter(|(_, sign)| matches!(sign, Sign::Stalled));
        Self {
            lives: vec![up; frame.stations],
            programs: frame.programs,
            stalls: stalls.map(|(at, _)| *at).collect(),
            missed: None,
            newest: None,
            failures: Vec::new(),
            asked: 0,
            masked: 0,
            detections: Vec::new(),
            repairs: 0,
            repairing: 0,
            excused: 0,
            fail_safe: 0,
        }
    }

    fn see(&mut self, at: u64, sign: Sign) {
        match sign {
            Sign::Published(rank) => self.published(at, rank),
            Sign::Taken(rank) => {
                if let Life::Up { taken, .. } = &mut self.lives[rank.index()] {
                    *taken = Some(at);
                }
            }
            Sign::Flagged(rank) => self.flagged(at, rank),
            Sign::Stalled => {}
            Sign::Applied(_, source) if is_provable(source) => {}
            Sign::Applied(_, source) => {
                self.fail_safe += u64::from(source == Source::FailSafe);
                if !self.stands_still(at) && !self.has_failed() {
                    self.missed = Some(at);
                    if let Some(newest) = &mut self.newest {
                        newest.missed.get_or_insert(at);
                    }
                }
            }
        }
    }

    fn published(&mut self, at: u64, rank: StationId) {
        if let Life::Repaired { since } = self.lives[rank.index()] {
            self.repairs += 1;
            self.repairing += at - since;
        }
        // A last word may be read after the step that took the station away.
        let taken = match self.lives[rank.index()] {
            Life::Up { taken, .. } => taken.filter(|taken| at < *taken),
            Life::Repaired { .. } => None,
        };
        self.lives[rank.index()] = Life::Up { published: at, taken };
    }

    fn flagged(&mut self, at: u64, rank: StationId) {
        let Life::Up { published, taken } = self.lives[rank.index()] else {
            return;
        };
        if taken.is_none() && self.stands_still(at) {
            self.excused += 1;
            return;
        }
        let failed = taken.unwrap_or(published).min(at);
        let should_be_masked = !self.has_failed_with(rank);
        self.close_newest(failed);
        self.lives[rank.index()] = Life::Repaired { since: at };
        self.failures.push(failed);
        self.detections.push(at - failed);
        let missed = self.missed.filter(|missed| *missed + NOTED_NS >= failed);
        self.newest = should_be_masked.then_some(Newest { missed });
    }

    /// The next failure is of `next`: what was missed from then on is not due to this one.
    fn close_newest(&mut self, next: u64) {
        if let Some(newest) = self.newest.take() {
            self.asked += 1;
            self.masked += u64::from(newest.missed.is_none_or(|missed| missed + NOTED_NS >= next));
        }
    }

    /// Whether a stall of the host lies near.
    fn stands_still(&self, at: u64) -> bool {
        let place = self.stalls.partition_point(|stall| *stall < at.saturating_sub(STALL_NS));
        self.stalls.get(place).is_some_and(|stall| *stall <= at + STALL_NS)
    }

    fn has_failed(&self) -> bool {
        self.failed(|rank| matches!(self.lives[rank], Life::Repaired { .. }))
    }

    fn has_failed_with(&self, more: StationId) -> bool {
        self.failed(|rank| {
            rank == more.index() || matches!(self.lives[rank], Life::Repaired { .. })
        })
    }

    fn failed(&self, down: impl Fn(usize) -> bool) -> bool {
        let understudies = (self.programs..self.lives.len()).all(&down);
        understudies && (0..self.programs).any(&down)
    }
}

#[cfg(test)]
mod tests;
