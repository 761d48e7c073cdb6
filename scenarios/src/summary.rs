//! `summary.json`: what a run came to, for machines; the table, the report and the command line read nothing else.

mod expectations;
mod networks;
mod outages;

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_bus::Quantiles;
use understudy_cluster::{Priority, value_text};
use understudy_journal::{JournalState, Members};
use understudy_wire::{Member, ProgramId};

use crate::account::{Account, Counts, DoneForce, Interval, Presence, Service, Stall};
use crate::scenario::{Scenario, action_text};
pub use networks::NetworkFaultSummary;

pub use outages::{OutageSummary, StartSummary};

/// The whole of `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Of this format: 1.
    pub format: u32,
    /// Whether the run was complete and every expectation was met.
    pub passed: bool,
    /// Why a run of real processes neither passed nor failed: the host woke members too late, with the numbers.
    pub inconclusive: Option<String>,
    /// The scenario's title.
    pub title: String,
    /// Where and how it was run.
    pub circumstances: Circumstances,
    /// Cycles that the scenario asked for, from the origin on.
    pub cycles_asked: u64,
    /// Cycles that were run.
    pub cycles_run: u64,
    /// The cluster's own epoch and cycle of cycle 0, as `epoch:cycle`; nothing where the cluster never was synchronised.
    pub origin: Option<String>,
    /// Time of day of cycle 0, in UTC, by the wall clock that the journal has recorded; nothing in a simulated run.
    pub origin_at: Option<String>,
    /// Whether it was asked to end early.
    pub interrupted: bool,
    /// Why fewer cycles were completed than were asked for: the remote I/Os that pass no deadlines, each with its reason, where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended_early: Option<String>,
    /// By rank.
    pub stations: Vec<StationSummary>,
    /// By program.
    pub remote_ios: Vec<RemoteIoSummary>,
    /// By program.
    pub plants: Vec<PlantSummary>,
    /// What was done to whom, in order.
    pub steps: Vec<StepSummary>,
    /// Forces of signals and refused ones, in order, at most 100 of them.
    pub forces: Vec<ForceSummary>,
    /// How many there were.
    pub force_count: u64,
    /// Members that ended unexpectedly, at most 100 of them.
    pub deaths: Vec<DeathSummary>,
    /// How many there were.
    pub death_count: u64,
    /// Times in which no station and no remote I/O ran, at most 100 of them.
    pub outages: Vec<OutageSummary>,
    /// How many there were.
    pub outage_count: u64,
    /// What must never happen and did, at most 100 of them.
    pub violations: Vec<ViolationSummary>,
    /// How many there were.
    pub violation_count: u64,
    /// Members that run another configuration.
    pub refused: Vec<RefusedSummary>,
    /// Wake-ups of the host that came too late, at most 200 of them.
    pub stalls: Vec<Stall>,
    /// Alarms of the cluster file that were raised.
    pub alarms: Vec<AlarmSummary>,
    /// Networks that were not in order and links that could not be opened, in order, at most 100 of them.
    pub network_faults: Vec<NetworkFaultSummary>,
    /// How many there were.
    pub network_fault_count: u64,
    /// What the scenario expects and what was found.
    pub expectations: Vec<ExpectationSummary>,
    /// How the journal fared.
    pub journal: JournalState,
}

/// Where and how a run was made.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Circumstances {
    /// `laboratory` or `simulator`.
    pub world: World,
    /// The simulator's seed.
    pub seed: Option<u64>,
    /// The cluster's name.
    pub cluster: String,
    /// Hash of all programs, roles and timings.
    pub configuration: String,
    /// `full` or `paper`.
    pub mode: String,
    /// Of one cycle, in microseconds.
    pub period_us: u64,
    /// What carried the frames.
    pub link: String,
    /// Of this program.
    pub version: String,
    /// The machine: system, processors, rights.
    pub machine: Vec<String>,
    /// The command that repeats it.
    pub repeat: String,
}

/// Where a run was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum World {
    /// Real processes, clocks and networks.
    Laboratory,
    /// One process and virtual time.
    Simulator,
}

/// A controller or an understudy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StationSummary {
    /// Its name.
    pub name: String,
    /// What it was when.
    pub intervals: Vec<Interval<Presence>>,
    /// Cycles in which nobody heard its turn.
    pub silent_cycles: u64,
}

/// A remote I/O.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct RemoteIoSummary {
    /// Its name.
    pub name: String,
    /// What it applied.
    pub counts: Counts,
    /// From its samples to the outputs that are proved for them, since its process runs; nothing in a simulated run. Where there are two, of the one that drove
    /// more often.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_to_output: Option<Quantiles>,
    /// How late the system woke it meanwhile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wakeups: Option<Quantiles>,
}

/// A plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PlantSummary {
    /// Its name.
    pub name: String,
    /// Name of the remote I/O that drives it.
    #[serde(skip)]
    pub remote_io: String,
    /// Whether it was served by true or held outputs throughout, and nothing happened to it that must not.
    pub functional: bool,
    /// Parts that it finished.
    pub finished: u64,
    /// Things that must not happen to it and did.
    pub plant_faults: u64,
    /// How it was served when.
    pub intervals: Vec<Interval<Service>>,
}

/// A step of the scenario as it was done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StepSummary {
    /// What.
    pub action: String,
    /// To whom.
    pub name: String,
    /// The cycle that the scenario names.
    pub asked: u64,
    /// The first cycle whose deadline came after it.
    pub measured: u64,
    /// Why the member refused it, where it did: it has no effect then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// A force of a signal: an output was driven with its value, an input was sampled with it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ForceSummary {
    /// The remote I/O.
    pub name: String,
    /// The signal.
    pub signal: String,
    /// The value.
    pub value: String,
    /// The first cycle with it; nothing where it was forced before cycle 0.
    pub from: Option<u64>,
    /// The first cycle without it; nothing where it lasts until the end.
    pub to: Option<u64>,
    /// Person who forced it.
    pub owner: String,
    /// Reason.
    pub reason: String,
    /// Why the remote I/O refused it, where it did: it has no effect then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

impl ForceSummary {
    fn new(done: &DoneForce, members: &Members) -> Self {
        let DoneForce { program, force, signal, from, to, refused } = done;
        let known = signal.as_ref();
        let known =
            known.filter(|known| known.declared.of.bits() == u32::from(force.value.width()));
        let stored = force.value.stored();
        Self {
            name: members.name(Member::RemoteIo(*program)).to_owned(),
            signal: known.map_or_else(|| format!("{:?}", force.signal), |known| known.name.clone()),
            value: known.map_or_else(
                || format!("16#{stored:X}"),
                |known| value_text(&known.declared, stored),
            ),
            from: *from,
            to: *to,
            owner: force.owner.clone(),
            reason: force.reason.clone(),
            refused: refused.map(|refusal| refusal.to_string()),
        }
    }
}

/// A member that ended unexpectedly.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct DeathSummary {
    /// Its name.
    pub name: String,
    /// The first cycle whose deadline came after it; nothing before the cluster was synchronised.
    pub cycle: Option<u64>,
    /// The signal or the exit status.
    pub how: String,
    /// Its last lines on standard error.
    pub said: Vec<String>,
}

impl fmt::Display for DeathSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, how, .. } = self;
        match self.cycle {
            Some(cycle) => write!(formatter, "{name} in cycle {cycle} ({how})"),
            None => write!(formatter, "{name} before cycle 0 ({how})"),
        }
    }
}

/// Something that must never happen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ViolationSummary {
    /// The cycle.
    pub cycle: u64,
    /// Of which remote I/O.
    pub name: String,
    /// What.
    pub what: String,
}

/// A member with another configuration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct RefusedSummary {
    /// Who.
    pub name: String,
    /// Both hashes.
    pub why: String,
}

/// An alarm of the cluster file that was raised.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct AlarmSummary {
    /// Its name.
    pub name: String,
    /// Its priority.
    pub priority: Priority,
    /// What is wrong.
    pub text: String,
    /// Times that it was raised.
    pub raised: u64,
    /// The cycle in which it was raised first; nothing before the cluster was synchronised.
    pub first: Option<u64>,
    /// Whether it is active at the end; nothing where that is unknown.
    pub active: Option<bool>,
}

impl fmt::Display for AlarmSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let priority = self.priority.word();
        write!(formatter, "{} ({priority}): {}; raised ", self.name, self.text)?;
        match self.raised {
            1 => formatter.write_str("once")?,
            times => write!(formatter, "{times} times, first")?,
        }
        match self.first {
            Some(cycle) => write!(formatter, " in cycle {cycle}")?,
            None => formatter.write_str(" before cycle 0")?,
        }
        formatter.write_str(match self.active {
            Some(true) => ", active at the end",
            Some(false) => ", over at the end",
            None => ", unknown at the end",
        })
    }
}

/// One expectation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ExpectationSummary {
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
    /// Whether that is what was expected.
    pub met: bool,
    /// Whether a host that wakes members too late can be why it was not met.
    #[serde(skip)]
    pub needs_time: bool,
}

impl Summary {
    /// Closes the account of a run.
    pub fn new(
        mut account: Account,
        scenario: &Scenario,
        circumstances: Circumstances,
        journal: JournalState,
    ) -> (Self, Account) {
        let finished = account.finish();
        let ends_early = !account.interrupted && finished.cycles_run < scenario.cycles;
        let members = &account.terms.members;
        let name = |member| members.name(member).to_owned();
        let stations = members.stations().zip(finished.presences).map(
            |((_, name), (intervals, silent_cycles))| StationSummary {
                name: name.to_owned(),
                intervals,
                silent_cycles,
            },
        );
        let services = account.services.iter().enumerate();
        let remote_ios = services.clone().map(|(program, service)| {
            let program = ProgramId(program as u8);
            let both = [Member::RemoteIo(program), Member::Twin(program)];
            let timed = both.iter().filter_map(|one| account.timed.get(one));
            let timed = timed.max_by_key(|(taken, _)| taken.count);
            RemoteIoSummary {
                name: name(Member::RemoteIo(program)),
                counts: service.counts,
                sample_to_output: timed.map(|(taken, _)| *taken),
                wakeups: timed.map(|(_, late)| *late),
            }
        });
        let plants = services.filter_map(|(program, service)| {
            let plant = Member::Plant(ProgramId(program as u8));
            let (_, name) = members.iter().find(|(member, _)| *member == plant)?;
            Some(PlantSummary {
                name: name.to_owned(),
                remote_io: members.name(Member::RemoteIo(ProgramId(program as u8))).to_owned(),
                // In a cycle that was not completed no remote I/O drove it.
                functional: service.functional() && !ends_early,
                finished: service.finished(),
                plant_faults: service.plant_faults(),
                intervals: service.intervals.clone(),
            })
        });
        let steps = account.steps.iter().map(|step| StepSummary {
            action: action_text(step.member, step.action, members),
            name: name(step.member),
            asked: step.asked,
            measured: step.measured,
            refused: step.refused.map(|refusal| refusal.to_string()),
        });
        let alarms = account.alarm_findings();
        let alarms = alarms.filter(|(_, finding, _)| finding.raised > 0);
        let alarms = alarms.map(|(alarm, finding, first)| AlarmSummary {
            name: alarm.name.clone(),
            priority: alarm.priority,
            text: alarm.text.clone(),
            raised: finding.raised,
            first,
            active: finding.active,
        });
        let (network_faults, network_fault_count) = account.network_faults();
        let network_fault = |fault| NetworkFaultSummary::new(fault, members);
        let violations = account.violations.iter();
        let mut summary = Self {
            format: 1,
            passed: false,
            inconclusive: None,
            title: scenario.title.clone(),
            circumstances,
            cycles_asked: scenario.cycles,
            cycles_run: finished.cycles_run,
            origin: account.origin().map(|origin| origin.to_string()),
            origin_at: account.origin_at().map(|at| at.to_string()),
            interrupted: account.interrupted,
            ended_early: account.absences().filter(|_| ends_early),
            stations: stations.collect(),
            remote_ios: remote_ios.collect(),
            plants: plants.collect(),
            steps: steps.collect(),
            forces: account.forces.iter().map(|done| ForceSummary::new(done, members)).collect(),
            force_count: account.force_count,
            deaths: account
                .deaths
                .iter()
                .map(|death| DeathSummary {
                    name: name(death.member),
                    cycle: death.cycle,
                    how: death.how.clone(),
                    said: death.said.clone(),
                })
                .collect(),
            death_count: account.death_count,
            outages: account
                .outages
                .listed()
                .iter()
                .map(|outage| OutageSummary::new(outage, members))
                .collect(),
            outage_count: account.outages.count,
            violations: violations
                .map(|(cycle, program, violation)| ViolationSummary {
                    cycle: *cycle,
                    name: name(Member::RemoteIo(*program)),
                    what: violation.to_string(),
                })
                .collect(),
            violation_count: account.violation_count,
            refused: account
                .refused
                .iter()
                .map(|(name, why)| RefusedSummary { name: name.clone(), why: why.clone() })
                .collect(),
            stalls: finished.stalls,
            alarms: alarms.collect(),
            network_faults: network_faults.iter().map(network_fault).collect(),
            network_fault_count,
            expectations: Vec::new(),
            journal,
        };
        summary.expectations = expectations::expectations(&summary, &account, scenario);
        let complete = summary.cycles_run == summary.cycles_asked && !summary.interrupted;
        summary.passed = complete && summary.expectations.iter().all(|expectation| expectation.met);
        if complete {
            summary.inconclusive = summary.late_host();
        }
        (summary, account)
    }

    /// What the host did that may be why the run did not pass; nothing where there is another reason, such as a wrong output.
    fn late_host(&self) -> Option<String> {
        let mut unmet = self.expectations.iter().filter(|found| !found.met);
        let may_be_host = !self.passed && unmet.all(|unmet| unmet.needs_time);
        let latest = self.stalls.iter().map(|stall| stall.late_us).max();
        let latest = latest.filter(|_| may_be_host)?;
        let period = self.circumstances.period_us;
        Some(format!(
            "the host woke members late {} times, up to {:.1} ms of a period of {:.1} ms",
            self.stalls.len(),
            latest as f64 / 1e3,
            period as f64 / 1e3
        ))
    }

    /// Counts over all remote I/Os.
    pub fn total(&self) -> Counts {
        let mut total = Counts::default();
        for remote_io in &self.remote_ios {
            let counts = &remote_io.counts;
            total.direct += counts.direct;
            total.reconstructed += counts.reconstructed;
            total.held += counts.held;
            total.held_by_stall += counts.held_by_stall;
            total.fail_safe += counts.fail_safe;
            total.fail_safe_by_stall += counts.fail_safe_by_stall;
            total.missed += counts.missed;
            total.wrong += counts.wrong;
        }
        total
    }
}
