//! The values of the metrics, from the model and the snapshot of a run.

use std::sync::PoisonError;
use std::sync::atomic::{AtomicU64, Ordering};

use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use understudy_bus::Quantiles;
use understudy_cluster::Priority;
use understudy_view::{
    AlarmState, Counters, Model, ProcessAlarm, ProgramSnapshot, RemoteIoState, Snapshot,
    StationState,
};
use understudy_wire::{Member, ProgramId};

use super::Metrics;
use crate::labels::{
    OfAlarm, OfAlarms, OfLacking, OfMember, OfNetwork, OfProgram, OfQuantile, OfRemoteIo, OfSource,
    OfState, OfTurn,
};

/// Times of remote I/Os, by quantiles.
type OfQuantiles = Family<OfQuantile, Gauge<f64, AtomicU64>>;

impl Metrics {
    /// Sets every metric but the times of cycles.
    pub fn show(&self, model: &Model, snapshot: &Snapshot) {
        self.values.cycle.set(snapshot.cycle.unwrap_or_default());
        self.values.survives.set(i64::from(snapshot.margin.survives));
        for network in &snapshot.networks {
            let of_network = OfNetwork { network: network.network.into() };
            let in_order = self.values.networks.get_or_create(&of_network);
            in_order.set(i64::from(network.in_order));
        }
        self.values.open_alarms.set(whole(snapshot.alarms.len() as u64));
        self.values.records.set(whole(snapshot.records));
        self.values.left_out.set(whole(snapshot.left_out));
        self.station_states(snapshot);
        self.remote_io_states(snapshot);
        self.records_received(snapshot);
        self.process_alarms(snapshot);
        self.members(model.counters());
        self.turns(model.counters());
        self.protection(snapshot);
        for (program, counted) in model.program_ids().zip(&snapshot.programs) {
            self.deadlines(counted);
            self.program_counters(model.counters(), program, counted);
            self.program(counted);
        }
    }

    fn station_states(&self, snapshot: &Snapshot) {
        for station in &snapshot.stations {
            for state in StationState::ALL {
                let of_state = OfState { station: station.name.clone(), state: state.word() };
                self.values
                    .station_states
                    .get_or_create(&of_state)
                    .set(i64::from(state == station.state));
            }
        }
    }

    fn remote_io_states(&self, snapshot: &Snapshot) {
        for remote_io in &snapshot.remote_ios {
            for state in RemoteIoState::ALL {
                let of_state =
                    OfRemoteIo { remote_io: remote_io.name.clone(), state: state.word() };
                self.values
                    .remote_io_states
                    .get_or_create(&of_state)
                    .set(i64::from(state == remote_io.state));
            }
        }
    }

    fn records_received(&self, snapshot: &Snapshot) {
        for (member, link) in snapshot.links() {
            let of_member = OfMember { member: member.to_owned() };
            self.values.records_received.get_or_create(&of_member).set(i64::from(!link.detached));
        }
    }

    fn process_alarms(&self, snapshot: &Snapshot) {
        let alarms = &snapshot.process_alarms;
        for state in AlarmState::ALL {
            for priority in Priority::ALL {
                let is_one =
                    |alarm: &&ProcessAlarm| (alarm.state, alarm.priority) == (state, priority);
                let of_alarms = OfAlarms { priority: priority.word(), state: state.word() };
                let count = alarms.iter().filter(is_one).count() as u64;
                self.values.alarms.get_or_create(&of_alarms).set(whole(count));
            }
            for alarm in alarms {
                let of_alarm = OfAlarm {
                    alarm: alarm.name.clone(),
                    priority: alarm.priority.word(),
                    state: state.word(),
                };
                self.values
                    .alarm_states
                    .get_or_create(&of_alarm)
                    .set(i64::from(alarm.state == state));
            }
        }
    }

    fn members(&self, counters: &Counters) {
        for (member, name) in self.members.iter() {
            let of_member = OfMember { member: name.to_owned() };
            let counted = counters.member(member);
            let seconds = counted.stalled.as_secs_f64();
            let stalled = self.values.stall_seconds.get_or_create(&of_member);
            stalled.inner().store(seconds.to_bits(), Ordering::Relaxed);
            drop(stalled);
            set(&self.values.stalls.get_or_create(&of_member), counted.stalls);
            let refused = self.values.refused_frames.get_or_create(&of_member);
            set(&refused, counted.refused_frames);
            drop(refused);
            let lost = self.values.records_lost.get_or_create(&of_member);
            set(&lost, counted.records_lost);
            drop(lost);
            if let Some((taken, late)) = counted.timed {
                self.timed(name, &self.values.sample_to_output, taken);
                self.timed(name, &self.values.wakeup_delay, late);
            }
            if !matches!(member, Member::Plant(_)) {
                let differences = self.values.digest_differences.get_or_create(&of_member);
                set(&differences, counted.digest_differences);
                drop(differences);
                set(&self.values.flagged.get_or_create(&of_member), counted.flagged);
            }
        }
    }

    fn timed(&self, remote_io: &str, family: &OfQuantiles, quantiles: Quantiles) {
        let Quantiles { p50_ns, p99_ns, p999_ns, maximum_ns, .. } = quantiles;
        let shares = [("0.5", p50_ns), ("0.99", p99_ns), ("0.999", p999_ns), ("1", maximum_ns)];
        for (quantile, ns) in shares {
            let of = OfQuantile { remote_io: remote_io.to_owned(), quantile };
            family.get_or_create(&of).set(ns as f64 / 1e9);
        }
    }

    fn turns(&self, counters: &Counters) {
        for (station, program, count) in counters.turns_not_received() {
            let name = |member| self.members.name(member).to_owned();
            let turn = OfTurn {
                station: name(Member::Station(station)),
                remote_io: name(Member::RemoteIo(program)),
            };
            set(&self.values.silent_turns.get_or_create(&turn), count);
        }
    }

    fn deadlines(&self, program: &ProgramSnapshot) {
        let counts = [
            ("direct", program.direct),
            ("reconstructed", program.reconstructed),
            ("held", program.held),
            ("fail-safe", program.fail_safe),
        ];
        for (source, count) in counts {
            let of_source = OfSource { program: program.program.clone(), source };
            set(&self.values.deadlines.get_or_create(&of_source), count);
            self.values
                .output_sources
                .get_or_create(&of_source)
                .set(i64::from(program.source == Some(source)));
        }
    }

    fn program_counters(&self, counters: &Counters, id: ProgramId, program: &ProgramSnapshot) {
        let of_program = of(program);
        let counted = counters.program(id);
        for (family, count) in [
            (&self.values.voided_samples, counted.voided_samples),
            (&self.values.substituted_inputs, counted.substituted_inputs),
            (&self.values.value_faults, counted.value_faults),
            (&self.values.protection_losses, counted.protection_losses),
            (&self.values.state_losses, counted.state_losses),
        ] {
            set(&family.get_or_create(&of_program), count);
        }
    }

    fn program(&self, program: &ProgramSnapshot) {
        let of_program = of(program);
        self.values
            .awaits_release
            .get_or_create(&of_program)
            .set(i64::from(program.awaits_release));
        self.values.forced.get_or_create(&of_program).set(whole(program.forced.len() as u64));
        if let Some(finished) = program.finished {
            self.values.finished.get_or_create(&of_program).set(whole(finished));
        }
        if let Some(plant_faults) = program.plant_faults {
            self.values.plant_faults.get_or_create(&of_program).set(whole(plant_faults));
        }
    }

    /// Metrics that do not apply any more are not exposed.
    fn protection(&self, snapshot: &Snapshot) {
        // No exposition is written meanwhile.
        let _registry = self.registry.lock().unwrap_or_else(PoisonError::into_inner);
        self.values.protected.clear();
        self.values.unprotected_since.clear();
        self.values.lacking.clear();
        self.values.lost_state_age.clear();
        for program in &snapshot.programs {
            self.protection_of(program);
        }
    }

    fn protection_of(&self, program: &ProgramSnapshot) {
        let of_program = of(program);
        let lost = program.lost.as_ref();
        self.values.state_lost.get_or_create(&of_program).set(i64::from(lost.is_some()));
        if let Some(age) = lost.and_then(|lost| lost.age_cycles) {
            self.values.lost_state_age.get_or_create(&of_program).set(whole(age));
        }
        let Some(protection) = &program.protection else {
            return;
        };
        self.values.protected.get_or_create(&of_program).set(i64::from(protection.protected));
        if !protection.protected {
            self.values.unprotected_since.get_or_create(&of_program).set(protection.since);
        }
        for lacking in &protection.lacking {
            let of_lacking = OfLacking {
                program: program.program.clone(),
                station: lacking.station.clone(),
                reason: lacking.reason,
                link: lacking.link.clone().unwrap_or_default(),
            };
            self.values.lacking.get_or_create(&of_lacking).set(1);
        }
    }
}

fn of(program: &ProgramSnapshot) -> OfProgram {
    OfProgram { program: program.program.clone() }
}

/// The model counts; the metric shows the count.
fn set(counter: &Counter, count: u64) {
    counter.inner().store(count, Ordering::Relaxed);
}

fn whole(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
