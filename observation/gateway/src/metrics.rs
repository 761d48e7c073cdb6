//! Metrics for Prometheus, in the OpenMetrics text format. `docs/how-to/monitoring.md` lists their names and labels.
//!
//! Deadlines are counted as in the report: from the origin of the run on. Other counters begin at the first record of the journal.

mod values;

use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Metric, Registry, Unit};
use understudy_cluster::Cluster;
use understudy_journal::Members;
use understudy_view::{Model, Run};
use understudy_wire::Member;

use crate::error::GatewayError;
use crate::feed::STATES;
use crate::followed::{BOUNDS, Observation};
use crate::labels::{
    OfAlarm, OfAlarms, OfLacking, OfMember, OfNetwork, OfProgram, OfQuantile, OfRemoteIo, OfRun,
    OfSource, OfState, OfTurn,
};

/// Bounds of the buckets of times within a cycle, as shares of the time to the deadline.
const SHARES: [f64; 20] = [
    0.0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.92, 0.94, 0.96,
    0.98, 0.99, 1.0,
];

/// Bounds of the buckets of the times between cycles, as shares of the period.
const CYCLE_SHARES: [f64; 11] = [0.5, 0.9, 0.95, 0.99, 1.01, 1.05, 1.1, 1.5, 2.0, 5.0, 10.0];

/// A table of metrics: `name field: type, help;` with the unit of those in seconds.
macro_rules! metrics {
    ($($name:literal $field:ident: $of:ty, $help:literal $($unit:ident)?;)*) => {
        /// The metrics, by what they count.
        #[derive(Debug, Default)]
        struct Values {
            $($field: $of,)*
        }

        impl Values {
            fn register(&self, all: &mut Registry) {
                $(register(all, $name, $help, &self.$field, None $(.or(Some(Unit::$unit)))?);)*
            }
        }
    };
}

metrics! {
    "deadlines" deadlines: Family<OfSource, Counter>, "Deadlines of each program by the source of the applied outputs, from the origin of the run on";
    "silent_turns" silent_turns: Family<OfTurn, Counter>, "Turns of a station that a remote I/O did not receive";
    "voided_samples" voided_samples: Family<OfProgram, Counter>, "Samples that no station received, and that are void";
    "substituted_inputs" substituted_inputs: Family<OfProgram, Counter>, "Changes of the channels that a remote I/O diagnoses as failed; their last good value is used";
    "digest_differences" digest_differences: Family<OfMember, Counter>, "Equal histories with unequal states, as the member reports them";
    "value_faults" value_faults: Family<OfProgram, Counter>, "Outputs that differ in one history, or whose syndrome is not 0";
    "flagged" flagged: Family<OfMember, Counter>, "Stations that the member flagged";
    "refused_frames" refused_frames: Family<OfMember, Counter>, "Datagrams that are not frames of this cluster";
    "host_stalls" stalls: Family<OfMember, Counter>, "Late wake-ups of the member";
    "journal_records_lost" records_lost: Family<OfMember, Counter>, "Records that the member could not write";
    "late_turns" late_turns: Counter, "Cycles whose last turn came after the deadline";
    "cycle" cycle: Gauge, "The newest cycle, from the origin of the run";
    "survivable_failures" survives: Gauge, "Remaining redundancy: any further failures of stations that would be masked";
    "network_in_order" networks: Family<OfNetwork, Gauge>, "1 where each member receives over the network (1 or 2; 3 for the direct links) what it receives over another one, 0 where not";
    "open_alarms" open_alarms: Gauge, "Alarms that last or are not acknowledged";
    "alarms" alarms: Family<OfAlarms, Gauge>, "Alarms on signals by state and priority";
    "alarm_state" alarm_states: Family<OfAlarm, Gauge>, "1 for the state of the alarm on a signal, 0 for the other states";
    "run_state" run_states: Family<OfRun, Gauge>, "1 for the state of the run, 0 for the other states";
    "output_source" output_sources: Family<OfSource, Gauge>, "1 for the source of the outputs that are applied now, 0 for the other sources; 0 for all where it is not known";
    "remote_io_state" remote_io_states: Family<OfRemoteIo, Gauge>, "1 for the state of the remote I/O, 0 for the other states";
    "records_received" records_received: Family<OfMember, Gauge>, "1 where the records of the member are received, 0 where not: its state is then known from others only";
    "station_state" station_states: Family<OfState, Gauge>, "1 for the state of the station, 0 for the other states";
    "awaits_release" awaits_release: Family<OfProgram, Gauge>, "1 where the operator has to release the outputs";
    "forced_signals" forced: Family<OfProgram, Gauge>, "Forced signals";
    "protected" protected: Family<OfProgram, Gauge>, "1 where the failure of one station would be masked, 0 where not; absent before the remote I/O has reported it";
    "unprotected_since_cycle" unprotected_since: Family<OfProgram, Gauge>, "The first cycle in which the failure of one station would not be masked";
    "lacking" lacking: Family<OfLacking, Gauge>, "1 for a station that cannot prove the outputs of a program, with the reason and the broken link";
    "protection_losses" protection_losses: Family<OfProgram, Counter>, "Losses of protection of the program";
    "state_lost" state_lost: Family<OfProgram, Gauge>, "1 where no living station can prove the state of the program";
    "lost_state_age_cycles" lost_state_age: Family<OfProgram, Gauge>, "Age in cycles of the newest available state, where the state is lost";
    "state_losses" state_losses: Family<OfProgram, Counter>, "Losses of the state of the program";
    "plant_finished" finished: Family<OfProgram, Gauge>, "Parts that the simulated plant has finished";
    "plant_faults" plant_faults: Family<OfProgram, Gauge>, "Plant faults of the simulated plant";
    "journal_records" records: Gauge, "Records that were read";
    "journal_left_out" left_out: Gauge, "Records that were gone or could not be read, at least";
    "host_stall" stall_seconds: Family<OfMember, Counter<f64, AtomicU64>>, "Total delay of the late wake-ups of the member" Seconds;
    "sample_to_output" sample_to_output: Family<OfQuantile, Gauge<f64, AtomicU64>>, "From a sample to the outputs that are proved for it, since the remote I/O runs; 1 is the longest" Seconds;
    "wakeup_delay" wakeup_delay: Family<OfQuantile, Gauge<f64, AtomicU64>>, "How late the system woke the remote I/O meanwhile" Seconds;
    "journal_age" journal_age: Gauge<f64, AtomicU64>, "Age of the newest record; it grows while the journal of a live run does not" Seconds;
    "last_record_timestamp" record_time: Gauge<f64, AtomicU64>, "Time of the newest record, since 1970; NaN where there is none" Seconds;
    "newest_cycle_timestamp" cycle_time: Gauge<f64, AtomicU64>, "Time at which the newest cycle was recorded, since 1970; NaN where there is none" Seconds;
}

/// All metrics of one run.
#[derive(Debug)]
pub struct Metrics {
    registry: Mutex<Registry>,
    members: Members,
    /// The newest cycle whose times were observed.
    timed: AtomicI64,
    values: Values,
    margin: Histogram,
    token: Histogram,
    cycle_times: Histogram,
}

fn register(
    all: &mut Registry,
    name: &str,
    help: &str,
    metric: &(impl Metric + Clone),
    unit: Option<Unit>,
) {
    match unit {
        Some(unit) => all.register_with_unit(name, help, unit, metric.clone()),
        None => all.register(name, help, metric.clone()),
    }
}

impl Metrics {
    /// Metrics of a run of `cluster`, all at 0.
    pub fn new(cluster: &Cluster) -> Self {
        let schedule = &cluster.agreement().schedule;
        let (period, deadline) = (schedule.period(), schedule.deadline());
        let within = SHARES.map(|share| deadline.mul_f64(share).as_secs_f64());
        // A token that is not back at the deadline is late, and may be by a whole period.
        let token = within.into_iter().chain([period.as_secs_f64()]);
        let metrics = Self {
            registry: Mutex::default(),
            members: Members::of(cluster),
            timed: AtomicI64::new(i64::MIN),
            values: Values::default(),
            margin: Histogram::new(within),
            token: Histogram::new(token),
            cycle_times: Histogram::new(CYCLE_SHARES.map(|share| share * period.as_secs_f64())),
        };
        metrics.begin(cluster);
        metrics.registered(cluster.name())
    }

    /// Every counter is exposed at 0 before it counts.
    fn begin(&self, cluster: &Cluster) {
        for (member, name) in self.members.iter() {
            let of_member = OfMember { member: name.to_owned() };
            for family in
                [&self.values.refused_frames, &self.values.stalls, &self.values.records_lost]
            {
                let _ = family.get_or_create(&of_member);
            }
            let _ = self.values.stall_seconds.get_or_create(&of_member);
            if !matches!(member, Member::Plant(_)) {
                let _ = self.values.digest_differences.get_or_create(&of_member);
                let _ = self.values.flagged.get_or_create(&of_member);
            }
        }
        for controller in cluster.controllers() {
            let of_program = OfProgram { program: controller.name.clone() };
            for family in [
                &self.values.voided_samples,
                &self.values.substituted_inputs,
                &self.values.value_faults,
                &self.values.protection_losses,
                &self.values.state_losses,
            ] {
                let _ = family.get_or_create(&of_program);
            }
            for source in ["direct", "reconstructed", "held", "fail-safe"] {
                let of_source = OfSource { program: controller.name.clone(), source };
                let _ = self.values.deadlines.get_or_create(&of_source);
            }
        }
    }

    fn registered(mut self, cluster: &str) -> Self {
        let labels = [("cluster".into(), cluster.to_owned().into())];
        let mut all = Registry::with_prefix_and_labels("understudy", labels.into_iter());
        self.values.register(&mut all);
        let version = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        all.register("build", "Version of the gateway", version);
        let times = [
            (
                "cycle_margin",
                "Time from the last turn of a cycle to its deadline; 0 for a late turn",
                &self.margin,
            ),
            ("token", "Time from the first sample of a cycle to its last turn", &self.token),
            (
                "cycle_time",
                "Time from the start of a cycle to the start of the next",
                &self.cycle_times,
            ),
        ];
        for (name, help, times) in times {
            register(&mut all, name, help, times, Some(Unit::Seconds));
        }
        self.registry = Mutex::new(all);
        self
    }

    /// Observes the times of cycles that are new.
    pub fn times(&self, model: &Model) {
        let last = self.timed.load(Ordering::Relaxed);
        let fresh = model.timings().filter(|timing| timing.cycle > last);
        for timing in fresh {
            self.margin.observe(timing.margin_ns.max(0) as f64 / 1e9);
            if timing.margin_ns < 0 {
                self.values.late_turns.inc();
            }
            self.token.observe(timing.token_ns as f64 / 1e9);
            if let Some(cycle) = timing.cycle_ns {
                self.cycle_times.observe(cycle as f64 / 1e9);
            }
            self.timed.store(timing.cycle, Ordering::Relaxed);
        }
    }

    /// Sets what depends on the time: the state of the run, the times of the newest record, of age `age`, and of the newest cycle.
    pub(crate) fn dated(&self, observation: &Observation, age: Option<Duration>, now: Instant) {
        let current = observation.state(observation.feed(now));
        for state in STATES {
            let is_state = i64::from(state == current);
            let run_state = self.values.run_states.get_or_create(&OfRun { state });
            run_state.set(is_state);
        }
        let seconds = |time: Option<Duration>| time.map_or(f64::NAN, |time| time.as_secs_f64());
        // Since 1970.
        let today = SystemTime::now().duration_since(UNIX_EPOCH);
        let today = today.unwrap_or_default();
        let before = |age: Duration| today.saturating_sub(age);
        let cycle_age = now.saturating_duration_since(observation.advanced);
        let cycle_age = observation.snapshot.cycle.map(|_| cycle_age);
        self.values.journal_age.set(seconds(age));
        self.values.record_time.set(seconds(age.map(before)));
        self.values.cycle_time.set(seconds(cycle_age.map(before)));
    }

    /// The metrics in the OpenMetrics text format.
    pub fn exposition(&self) -> String {
        let registry = self.registry.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
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
    // Its results are there before the journal is read to its end.
    let is_finished = run.is_finished();
    let mut read = 0;
    loop {
        let taken = source.poll(&mut |found| model.take_found(found));
        metrics.times(&model);
        read += taken;
        if taken == 0 {
            break;
        }
    }
    if let (0, Some(trouble)) = (read, source.failure()) {
        return Err(GatewayError::Journal(trouble));
    }
    if is_finished {
        model.end(run.has_results());
    }
    let (snapshot, now) = (model.snapshot(), Instant::now());
    metrics.show(&model, &snapshot);
    let age = source.progress().age(now);
    let heard = age.and_then(|age| now.checked_sub(age));
    let observation = Observation::new(&model, snapshot, heard.unwrap_or(now));
    metrics.dated(&observation, age, now);
    Ok(metrics.exposition())
}
