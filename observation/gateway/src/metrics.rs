//! What Prometheus scrapes, in the OpenMetrics text format. Names and labels are listed in `docs/how-to/monitoring.md`.
//!
//! Counters count records, so they begin at the first record of the journal that is still there, and never go back.

use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::Duration;

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};
use understudy_bus::HostEvent;
use understudy_cluster::Cluster;
use understudy_journal::{Happening, Members, Record, source_word};
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Model, Run, Snapshot, StationState};
use understudy_wire::{Member, ProgramId, StationId};

use crate::error::GatewayError;
use crate::followed::BOUNDS;
use crate::labels::{OfLacking, OfMember, OfProgram, OfSource, OfState, OfTurn};

/// Shares of a period that bound the buckets of times.
const SHARES: [f64; 12] = [
    0.0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0,
];

const STATES: [(StationState, &str); 10] = [
    (StationState::NotStarted, "not-started"),
    (StationState::Speaking, "speaking"),
    (StationState::Silent, "silent"),
    (StationState::Flagged, "flagged"),
    (StationState::Joining, "joining"),
    (StationState::Shadow, "shadow"),
    (StationState::Refused, "refused"),
    (StationState::Stopped, "stopped"),
    (StationState::Killed, "killed"),
    (StationState::Ended, "ended"),
];

/// All metrics of one run.
#[derive(Debug)]
pub struct Metrics {
    registry: Mutex<Registry>,
    members: Members,
    stations: u8,
    /// The newest cycle whose times were observed.
    timed: AtomicI64,
    deadlines: Family<OfSource, Counter>,
    silent_turns: Family<OfTurn, Counter>,
    voided_samples: Family<OfProgram, Counter>,
    substituted_inputs: Family<OfProgram, Counter>,
    digest_differences: Family<OfMember, Counter>,
    value_faults: Family<OfProgram, Counter>,
    flagged: Family<OfMember, Counter>,
    refused_frames: Family<OfMember, Counter>,
    stalls: Family<OfMember, Counter>,
    stall_seconds: Family<OfMember, Counter<f64, AtomicU64>>,
    records_lost: Family<OfMember, Counter>,
    margin: Histogram,
    late_turns: Counter,
    token: Histogram,
    cycle_times: Histogram,
    cycle: Gauge,
    survives: Gauge,
    open_alarms: Gauge,
    station_states: Family<OfState, Gauge>,
    awaits_release: Family<OfProgram, Gauge>,
    forced: Family<OfProgram, Gauge>,
    protected: Family<OfProgram, Gauge>,
    unprotected_since: Family<OfProgram, Gauge>,
    lacking: Family<OfLacking, Gauge>,
    protection_losses: Family<OfProgram, Counter>,
    state_lost: Family<OfProgram, Gauge>,
    lost_state_age: Family<OfProgram, Gauge>,
    state_losses: Family<OfProgram, Counter>,
    finished: Family<OfProgram, Gauge>,
    plant_faults: Family<OfProgram, Gauge>,
    records: Gauge,
    left_out: Gauge,
    journal_age: Gauge<f64, AtomicU64>,
}

impl Metrics {
    /// Of a run of `cluster`, with everything at 0.
    pub fn new(cluster: &Cluster) -> Self {
        let schedule = &cluster.agreement().schedule;
        let period = schedule.period().as_secs_f64();
        let buckets = || Histogram::new(SHARES.map(|share| share * period));
        let mut metrics = Self {
            registry: Mutex::new(Registry::default()),
            members: Members::of(cluster),
            stations: u8::try_from(schedule.stations()).unwrap_or(u8::MAX),
            timed: AtomicI64::new(i64::MIN),
            deadlines: Family::default(),
            silent_turns: Family::default(),
            voided_samples: Family::default(),
            substituted_inputs: Family::default(),
            digest_differences: Family::default(),
            value_faults: Family::default(),
            flagged: Family::default(),
            refused_frames: Family::default(),
            stalls: Family::default(),
            stall_seconds: Family::default(),
            records_lost: Family::default(),
            margin: buckets(),
            late_turns: Counter::default(),
            token: buckets(),
            cycle_times: Histogram::new(
                [0.5, 0.9, 0.95, 0.99, 1.01, 1.05, 1.1, 1.5, 2.0, 5.0, 10.0]
                    .map(|share| share * period),
            ),
            cycle: Gauge::default(),
            survives: Gauge::default(),
            open_alarms: Gauge::default(),
            station_states: Family::default(),
            awaits_release: Family::default(),
            forced: Family::default(),
            protected: Family::default(),
            unprotected_since: Family::default(),
            lacking: Family::default(),
            protection_losses: Family::default(),
            state_lost: Family::default(),
            lost_state_age: Family::default(),
            state_losses: Family::default(),
            finished: Family::default(),
            plant_faults: Family::default(),
            records: Gauge::default(),
            left_out: Gauge::default(),
            journal_age: Gauge::default(),
        };
        metrics.register(cluster.name());
        metrics.begin(cluster);
        metrics
    }

    /// Whoever watches a counter has to see it at 0 before it counts.
    fn begin(&self, cluster: &Cluster) {
        for (member, name) in self.members.iter() {
            let of_member = OfMember {
                member: name.to_owned(),
            };
            for family in [&self.refused_frames, &self.stalls, &self.records_lost] {
                let _ = family.get_or_create(&of_member);
            }
            let _ = self.stall_seconds.get_or_create(&of_member);
            if !matches!(member, Member::Plant(_)) {
                let _ = self.digest_differences.get_or_create(&of_member);
                let _ = self.flagged.get_or_create(&of_member);
            }
        }
        for controller in cluster.controllers() {
            let of_program = OfProgram {
                program: controller.name.clone(),
            };
            for family in [
                &self.voided_samples,
                &self.substituted_inputs,
                &self.value_faults,
                &self.protection_losses,
                &self.state_losses,
            ] {
                let _ = family.get_or_create(&of_program);
            }
            for source in ["direct", "reconstructed", "held", "fail-safe"] {
                let of_source = OfSource {
                    program: controller.name.clone(),
                    source,
                };
                let _ = self.deadlines.get_or_create(&of_source);
            }
        }
    }

    fn register(&mut self, cluster: &str) {
        let labels = [("cluster".into(), cluster.to_owned().into())];
        let mut all = Registry::with_prefix_and_labels("understudy", labels.into_iter());
        macro_rules! register {
            ($($name:literal $field:ident $help:literal;)*) => {
                $(all.register($name, $help, self.$field.clone());)*
            };
        }
        register! {
            "deadlines" deadlines "Deadlines of each program by the source of what was driven";
            "silent_turns" silent_turns "Turns of a station that a remote I/O did not hear";
            "voided_samples" voided_samples "Samples that nobody heard, and that are void";
            "substituted_inputs" substituted_inputs "Changes of the channels that a remote I/O finds failed, whose last good value is used";
            "digest_differences" digest_differences "Equal histories with unequal states, as the member says";
            "value_faults" value_faults "Outputs that differ in one history, or whose sum is not 0";
            "flagged" flagged "Stations that were silent for too long, as the member says";
            "refused_frames" refused_frames "Datagrams that are no frames of this cluster";
            "host_stalls" stalls "Wake-ups of the member that came too late";
            "journal_records_lost" records_lost "Records that the member could not write";
            "late_turns" late_turns "Cycles whose last turn came after the deadline";
            "cycle" cycle "The newest cycle, from the origin of the run";
            "survivable_failures" survives "Further failures of stations that are masked whichever they are";
            "open_alarms" open_alarms "Alarms that last, or that nobody has acknowledged";
            "station_state" station_states "1 for what a station is";
            "awaits_release" awaits_release "1 where an operator has to release the outputs";
            "forced_signals" forced "Signals that are forced";
            "protected" protected "1 where the failure of one station would be masked, 0 where not; nothing before the remote I/O has reported it";
            "unprotected_since_cycle" unprotected_since "Since which cycle the failure of one station would not be masked";
            "lacking" lacking "1 for a station that cannot stand in for a program, with the reason and the broken link";
            "protection_losses" protection_losses "Times that a program lost its protection";
            "state_lost" state_lost "1 where no living station can prove the state of the program";
            "lost_state_age_cycles" lost_state_age "Cycles by which the newest available state of a lost one is too old";
            "state_losses" state_losses "Times that the state of the program was lost";
            "plant_finished" finished "Parts that the simulated plant has finished";
            "plant_faults" plant_faults "Things that must not happen to the simulated plant and did";
            "journal_records" records "Records that were read";
            "journal_left_out" left_out "Records that were gone or could not be read, at least";
        }
        macro_rules! in_seconds {
            ($($name:literal $field:ident $help:literal;)*) => {
                $(all.register_with_unit($name, $help, Unit::Seconds, self.$field.clone());)*
            };
        }
        in_seconds! {
            "host_stall" stall_seconds "By how much the wake-ups of the member came too late, in all";
            "cycle_margin" margin "From the last turn of a cycle to its deadline; 0 where it came later";
            "token" token "From the first sample of a cycle to its last turn";
            "journal_age" journal_age "Age of the newest record: a live run whose journal does not grow is not seen any more";
            "cycle_time" cycle_times "From the start of a cycle to that of the next";
        }
        self.registry = Mutex::new(all);
    }

    /// Counts a record.
    pub fn note(&self, record: &Record) {
        match (&record.event, record.member) {
            (Happening::RemoteIo(event), Some(Member::RemoteIo(program))) => {
                self.remote_io(record, program, event);
            }
            (Happening::Station(event), Some(_)) => match event {
                StationEvent::DigestDiffers { .. } => {
                    self.digest_differences.get_or_create(&of(record)).inc();
                }
                StationEvent::Flagged { .. } => {
                    self.flagged.get_or_create(&of(record)).inc();
                }
                StationEvent::Stalled { late, .. } => self.stalled(record, *late),
                _ => {}
            },
            (Happening::Host(event), Some(_)) => match event {
                HostEvent::RefusedBytes { datagrams, .. }
                | HostEvent::RefusedFrames { datagrams, .. } => {
                    self.refused_frames
                        .get_or_create(&of(record))
                        .inc_by(*datagrams);
                }
                HostEvent::JournalLost { records } => {
                    self.records_lost
                        .get_or_create(&of(record))
                        .inc_by(*records);
                }
                _ => {}
            },
            _ => {}
        }
    }

    fn remote_io(&self, record: &Record, program: ProgramId, event: &RemoteIoEvent) {
        let of_program = || OfProgram {
            program: self.program(program),
        };
        match event {
            RemoteIoEvent::Applied { source, heard, .. } => {
                let of_source = OfSource {
                    program: self.program(program),
                    source: source_word(*source),
                };
                self.deadlines.get_or_create(&of_source).inc();
                for station in (0..self.stations).map(StationId) {
                    if !heard.contains(station) {
                        let turn = OfTurn {
                            station: self.members.name(Member::Station(station)).to_owned(),
                            remote_io: record.name.clone(),
                        };
                        self.silent_turns.get_or_create(&turn).inc();
                    }
                }
            }
            RemoteIoEvent::Voided { samples, .. } => {
                self.voided_samples
                    .get_or_create(&of_program())
                    .inc_by(*samples as u64);
            }
            RemoteIoEvent::Diagnosed { .. } => {
                self.substituted_inputs.get_or_create(&of_program()).inc();
            }
            RemoteIoEvent::ValueFault { .. } | RemoteIoEvent::Syndrome { .. } => {
                self.value_faults.get_or_create(&of_program()).inc();
            }
            RemoteIoEvent::Unprotected { .. } => {
                self.protection_losses.get_or_create(&of_program()).inc();
            }
            RemoteIoEvent::StateLost { .. } => {
                self.state_losses.get_or_create(&of_program()).inc();
            }
            RemoteIoEvent::DigestDiffers { .. } => {
                self.digest_differences.get_or_create(&of(record)).inc();
            }
            RemoteIoEvent::Flagged { .. } => {
                self.flagged.get_or_create(&of(record)).inc();
            }
            RemoteIoEvent::Stalled { late, .. } => self.stalled(record, *late),
            _ => {}
        }
    }

    fn stalled(&self, record: &Record, late: std::time::Duration) {
        self.stalls.get_or_create(&of(record)).inc();
        self.stall_seconds
            .get_or_create(&of(record))
            .inc_by(late.as_secs_f64());
    }

    fn program(&self, program: ProgramId) -> String {
        self.members
            .name(Member::Station(StationId(program.0)))
            .to_owned()
    }

    /// Observes the times of cycles that are new.
    pub fn times(&self, model: &Model) {
        let last = self.timed.load(Ordering::Relaxed);
        let fresh = model.timings().filter(|timing| timing.cycle > last);
        for timing in fresh {
            self.margin.observe(timing.margin_ns.max(0) as f64 / 1e9);
            if timing.margin_ns < 0 {
                self.late_turns.inc();
            }
            self.token.observe(timing.token_ns as f64 / 1e9);
            if let Some(cycle) = timing.cycle_ns {
                self.cycle_times.observe(cycle as f64 / 1e9);
            }
            self.timed.store(timing.cycle, Ordering::Relaxed);
        }
    }

    /// Sets what is the case.
    pub fn state(&self, snapshot: &Snapshot) {
        let whole = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
        self.cycle.set(snapshot.cycle.unwrap_or_default());
        self.survives.set(i64::from(snapshot.margin.survives));
        self.open_alarms.set(whole(snapshot.alarms.len() as u64));
        self.records.set(whole(snapshot.records));
        self.left_out.set(whole(snapshot.left_out));
        for station in &snapshot.stations {
            for (state, word) in STATES {
                let of_state = OfState {
                    station: station.name.clone(),
                    state: word,
                };
                self.station_states
                    .get_or_create(&of_state)
                    .set(i64::from(state == station.state));
            }
        }
        self.protection(snapshot);
        for program in &snapshot.programs {
            let of_program = OfProgram {
                program: program.program.clone(),
            };
            self.awaits_release
                .get_or_create(&of_program)
                .set(i64::from(program.awaits_release));
            self.forced
                .get_or_create(&of_program)
                .set(whole(program.forced.len() as u64));
            if let Some(finished) = program.finished {
                self.finished
                    .get_or_create(&of_program)
                    .set(whole(finished));
            }
            if let Some(plant_faults) = program.plant_faults {
                self.plant_faults
                    .get_or_create(&of_program)
                    .set(whole(plant_faults));
            }
        }
    }

    /// What is not the case any more is not exposed.
    fn protection(&self, snapshot: &Snapshot) {
        // No exposition comes between.
        let _registry = self
            .registry
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        self.protected.clear();
        self.unprotected_since.clear();
        self.lacking.clear();
        self.lost_state_age.clear();
        for program in &snapshot.programs {
            let of_program = OfProgram {
                program: program.program.clone(),
            };
            let lost = program.lost.as_ref();
            self.state_lost
                .get_or_create(&of_program)
                .set(i64::from(lost.is_some()));
            if let Some(age) = lost.and_then(|lost| lost.age_cycles) {
                let age = i64::try_from(age).unwrap_or(i64::MAX);
                self.lost_state_age.get_or_create(&of_program).set(age);
            }
            let Some(protection) = &program.protection else {
                continue;
            };
            self.protected
                .get_or_create(&of_program)
                .set(i64::from(protection.protected));
            if !protection.protected {
                self.unprotected_since
                    .get_or_create(&of_program)
                    .set(protection.since);
            }
            for lacking in &protection.lacking {
                let of_lacking = OfLacking {
                    program: program.program.clone(),
                    station: lacking.station.clone(),
                    reason: lacking.reason,
                    link: lacking.link.clone().unwrap_or_default(),
                };
                self.lacking.get_or_create(&of_lacking).set(1);
            }
        }
    }

    /// Sets the age of the newest record.
    pub(crate) fn aged(&self, age: Option<Duration>) {
        self.journal_age.set(age.unwrap_or_default().as_secs_f64());
    }

    /// All of them in the OpenMetrics text format.
    pub fn exposition(&self) -> String {
        let registry = self
            .registry
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut text = String::new();
        // A text takes whatever is written to it.
        let _ = encode(&mut text, &registry);
        text
    }
}

fn of(record: &Record) -> OfMember {
    OfMember {
        member: record.name.clone(),
    }
}

/// The metrics of all that is in the journal of `run` now.
///
/// # Errors
/// The journal cannot be read.
pub fn exposition_of(run: &Run) -> Result<String, GatewayError> {
    let metrics = Metrics::new(run.cluster());
    let (mut source, mut model) = (run.follow(), run.model(BOUNDS));
    let mut read = 0;
    loop {
        let taken = source.poll(&mut |found| match found {
            Ok(record) => {
                metrics.note(&record);
                model.note(&record);
            }
            Err(trouble) => model.trouble(&trouble),
        });
        metrics.times(&model);
        read += taken;
        if taken == 0 {
            break;
        }
    }
    if let (0, Some(trouble)) = (read, source.failure()) {
        return Err(GatewayError::Journal(trouble));
    }
    metrics.state(&model.snapshot());
    metrics.aged(source.progress().age(std::time::Instant::now()));
    Ok(metrics.exposition())
}
