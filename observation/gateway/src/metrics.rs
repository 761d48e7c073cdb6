//! Metrics for Prometheus, in the OpenMetrics text format. `docs/how-to/monitoring.md` lists their names and labels.
//!
//! Deadlines are counted as in the report: from the origin of the run on. Other counters begin at the first record of the journal.

mod values;

use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::Duration;

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};
use understudy_cluster::Cluster;
use understudy_journal::Members;
use understudy_view::{Model, Run};
use understudy_wire::Member;

use crate::error::GatewayError;
use crate::followed::BOUNDS;
use crate::labels::{OfLacking, OfMember, OfProgram, OfSource, OfState, OfTurn};

/// Bounds of the buckets of times, as shares of a period.
const SHARES: [f64; 12] = [
    0.0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0,
];

/// All metrics of one run.
#[derive(Debug)]
pub struct Metrics {
    registry: Mutex<Registry>,
    members: Members,
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
    /// Metrics of a run of `cluster`, all at 0.
    pub fn new(cluster: &Cluster) -> Self {
        let schedule = &cluster.agreement().schedule;
        let period = schedule.period().as_secs_f64();
        let buckets = || Histogram::new(SHARES.map(|share| share * period));
        let mut metrics = Self {
            registry: Mutex::new(Registry::default()),
            members: Members::of(cluster),
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

    /// Every counter is exposed at 0 before it counts.
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
            "deadlines" deadlines "Deadlines of each program by the source of the applied outputs, from the origin of the run on";
            "silent_turns" silent_turns "Turns of a station that a remote I/O did not receive";
            "voided_samples" voided_samples "Samples that no station received, and that are void";
            "substituted_inputs" substituted_inputs "Changes of the channels that a remote I/O diagnoses as failed; their last good value is used";
            "digest_differences" digest_differences "Equal histories with unequal states, as the member reports them";
            "value_faults" value_faults "Outputs that differ in one history, or whose syndrome is not 0";
            "flagged" flagged "Stations that the member flagged";
            "refused_frames" refused_frames "Datagrams that are not frames of this cluster";
            "host_stalls" stalls "Late wake-ups of the member";
            "journal_records_lost" records_lost "Records that the member could not write";
            "late_turns" late_turns "Cycles whose last turn came after the deadline";
            "cycle" cycle "The newest cycle, from the origin of the run";
            "survivable_failures" survives "Remaining redundancy: any further failures of stations that would be masked";
            "open_alarms" open_alarms "Alarms that last or are not acknowledged";
            "station_state" station_states "1 for the state of the station, 0 for the other states";
            "awaits_release" awaits_release "1 where the operator has to release the outputs";
            "forced_signals" forced "Forced signals";
            "protected" protected "1 where the failure of one station would be masked, 0 where not; absent before the remote I/O has reported it";
            "unprotected_since_cycle" unprotected_since "The first cycle in which the failure of one station would not be masked";
            "lacking" lacking "1 for a station that cannot prove the outputs of a program, with the reason and the broken link";
            "protection_losses" protection_losses "Losses of protection of the program";
            "state_lost" state_lost "1 where no living station can prove the state of the program";
            "lost_state_age_cycles" lost_state_age "Age in cycles of the newest available state, where the state is lost";
            "state_losses" state_losses "Losses of the state of the program";
            "plant_finished" finished "Parts that the simulated plant has finished";
            "plant_faults" plant_faults "Plant faults of the simulated plant";
            "journal_records" records "Records that were read";
            "journal_left_out" left_out "Records that were gone or could not be read, at least";
        }
        macro_rules! in_seconds {
            ($($name:literal $field:ident $help:literal;)*) => {
                $(all.register_with_unit($name, $help, Unit::Seconds, self.$field.clone());)*
            };
        }
        in_seconds! {
            "host_stall" stall_seconds "Total delay of the late wake-ups of the member";
            "cycle_margin" margin "Time from the last turn of a cycle to its deadline; 0 for a late turn";
            "token" token "Time from the first sample of a cycle to its last turn";
            "journal_age" journal_age "Age of the newest record; it grows while the journal of a live run does not";
            "cycle_time" cycle_times "Time from the start of a cycle to the start of the next";
        }
        self.registry = Mutex::new(all);
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

    /// Sets the age of the newest record.
    pub(crate) fn aged(&self, age: Option<Duration>) {
        self.journal_age.set(age.unwrap_or_default().as_secs_f64());
    }

    /// The metrics in the OpenMetrics text format.
    pub fn exposition(&self) -> String {
        let registry = self
            .registry
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut text = String::new();
        // Writing to a text does not fail.
        let _ = encode(&mut text, &registry);
        text
    }
}

/// The metrics of everything in the journal of `run`.
///
/// # Errors
/// The journal cannot be read.
pub fn exposition_of(run: &Run) -> Result<String, GatewayError> {
    let metrics = Metrics::new(run.cluster());
    let (mut source, mut model) = (run.follow(), run.model(BOUNDS));
    let mut read = 0;
    loop {
        let taken = source.poll(&mut |found| match found {
            Ok(record) => model.note(&record),
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
    metrics.show(&model, &model.snapshot());
    metrics.aged(source.progress().age(std::time::Instant::now()));
    Ok(metrics.exposition())
}
