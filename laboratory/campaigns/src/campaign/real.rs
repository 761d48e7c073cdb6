//! The same on real processes: stations are killed and started again by chance, until a program is lost.
//!
//! Each replica is a run of the laboratory with processes of its own, which all end with it. Its journal stays in the directory of the
//! campaign. A host that stands still can hold deadlines, and even bring a remote I/O to its fail-safe, with every state alive. Neither is
//! a failure of the system: it has failed only where its definition says so too. What stalls explain is said apart.

use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use understudy_cluster::Cluster;
use understudy_journal::{Happening, Record, RunDirectory, RunDirectoryError, RunEvent};
use understudy_processes::{
    Conductor, LaboratoryError, LaboratorySettings, Progress, run_conducted,
};
use understudy_scenarios::{Expectation, Scenario};
use understudy_simulator::{Action, Fault};
use understudy_wire::{Member, Time};

use super::lives::{Lives, Order, Run};
use super::seen::{Deadlines, Seen, of_station};
use super::{CampaignPlan, Measured, gathered};

/// More than any limit of time lets pass.
const ENDLESS_CYCLES: u64 = 1 << 40;

/// Where a campaign on processes is kept, and how long it may take.
#[derive(Debug, Clone)]
pub struct RealCampaign {
    /// How the members are started.
    pub laboratory: LaboratorySettings,
    /// Where runs are kept.
    pub out: PathBuf,
    /// The time, which names the directory.
    pub now: SystemTime,
    /// It ends then, whatever has come of it.
    pub limit: Duration,
}

/// What a campaign on processes left.
#[derive(Debug)]
pub struct RealCampaignRun {
    /// What was measured; nothing where not one cluster came into step.
    pub measured: Option<Measured>,
    /// Where the journals lie.
    pub directory: PathBuf,
    /// Why it ended early, where nobody asked it to.
    pub failure: Option<LaboratoryError>,
}

/// Runs `plan` on processes until it has its failures, the limit is reached, or it is interrupted.
///
/// # Errors
/// A directory that cannot be made. Everything else is in the [`RealCampaignRun`], with what was measured until then.
pub fn run_real_campaign(
    cluster: &Cluster,
    plan: &CampaignPlan,
    real: &RealCampaign,
    watch: &mut dyn FnMut(Progress),
) -> Result<RealCampaignRun, RunDirectoryError> {
    let directory = RunDirectory::create(&real.out, real.now)?;
    let give_up = Instant::now() + real.limit;
    let mut runs: Vec<Run> = Vec::new();
    let (mut failed, mut remarks, mut failure) = (0, Vec::new(), None);
    for number in 0.. {
        if failed == plan.failures {
            break;
        }
        let mut fates = Fates::new(cluster, plan, number, give_up);
        let inside = directory.inside(&format!("replica-{}", number + 1))?;
        let mut synchronised = false;
        let mut on_progress = |progress| match progress {
            Progress::Step { .. } => watch(progress),
            Progress::Cycle { cycle, .. } if !std::mem::replace(&mut synchronised, true) => {
                let what = format!("everybody is synchronised, replica {}", number + 1);
                watch(Progress::Step { cycle, what });
            }
            // The rest is told of the campaign as a whole.
            _ => {}
        };
        let settings = real.laboratory.clone();
        let scenario = endless(cluster);
        let ran =
            run_conducted(cluster, &scenario, settings, &inside, &mut fates, &mut on_progress);
        let (interrupted, error) = match ran {
            Ok(run) => (run.account.interrupted, run.failure),
            Err(error) => (false, Some(error)),
        };
        let in_time = Instant::now() < give_up;
        let run = fates.end();
        failed += u64::from(run.as_ref().is_some_and(|run| run.cause.is_some()));
        runs.extend(run);
        watch(Progress::Failure { done: failed, of: plan.failures });
        if interrupted {
            remarks.push(format!("interrupted after {failed} of {} failures", plan.failures));
            break;
        }
        if error.is_some() {
            failure = error;
            break;
        }
        if !in_time && failed < plan.failures {
            remarks.push(format!(
                "ended after {} s, as it was told to, with {failed} of {} failures",
                real.limit.as_secs(),
                plan.failures
            ));
            break;
        }
    }
    watch(Progress::Ending);
    let excused: u64 = runs.iter().map(|run| run.excused).sum();
    if excused > 0 {
        remarks.push(format!(
            "{excused} failures of stations with a deadline that was held beside a stall of the host: they are not counted"
        ));
    }
    let measured = (!runs.is_empty()).then(|| {
        let mut measured = gathered(cluster, plan, "processes", runs.into_iter());
        measured.remarks = remarks;
        measured
    });
    Ok(RealCampaignRun { measured, directory: directory.path().to_owned(), failure })
}

fn endless(cluster: &Cluster) -> Scenario {
    Scenario {
        title: format!("{} until it fails", cluster.name()),
        cycles: ENDLESS_CYCLES,
        steps: Vec::new(),
        network: None,
        network_cycles: None,
        seed: None,
        spare_after: None,
        expect: Expectation::default(),
    }
}

/// Conducts one replica.
struct Fates<'a> {
    lives: Lives<'a>,
    deadlines: Deadlines,
    period: Duration,
    /// When everybody was synchronised, by the clock of the records.
    origin: Option<Time>,
    newest: Time,
    /// The newest that was decided, counted from there.
    cycle: u64,
    /// In the order of their times.
    due: Vec<(Instant, Fault)>,
    /// Since when the system has failed.
    lost: Option<Time>,
    give_up: Instant,
}

impl<'a> Fates<'a> {
    fn new(cluster: &'a Cluster, plan: &'a CampaignPlan, number: u64, give_up: Instant) -> Self {
        Self {
            lives: Lives::new(cluster, plan, number),
            deadlines: Deadlines::new(cluster.controllers().len()),
            period: cluster.agreement().schedule.period(),
            origin: None,
            newest: Time::default(),
            cycle: 0,
            due: Vec::new(),
            lost: None,
            give_up,
        }
    }

    /// Nothing where the cluster never came into step.
    fn end(self) -> Option<Run> {
        let origin = self.origin?;
        let at = self.lost.unwrap_or(self.newest);
        let ran_ns = at.0.saturating_sub(origin.0);
        (ran_ns > 0).then(|| self.lives.end(at, ran_ns, self.lost.is_some()))
    }

    fn look(&mut self, record: &Record) -> Option<Seen> {
        let now = Time(record.at_ns);
        match (&record.event, record.member) {
            (Happening::Station(event), Some(Member::Station(station))) => {
                of_station(station, event)
            }
            (Happening::RemoteIo(event), Some(member)) => self.deadlines.look(now, member, event),
            (Happening::Run(RunEvent::Fault { action, member, .. }), _) => match (member, action) {
                (Member::Station(station), Action::Crash) => Some(Seen::Crashed(*station)),
                (Member::Station(station), Action::Restart) => Some(Seen::Restarted(*station)),
                _ => None,
            },
            _ => None,
        }
    }

    fn carry_out_orders(&mut self, now: Instant) {
        for order in self.lives.take_orders() {
            match order {
                Order::Do { member, action, after_cycles } => {
                    // A wait that no clock can hold is longer than any limit.
                    let after =
                        Duration::try_from_secs_f64(self.period.as_secs_f64() * after_cycles);
                    let at = after.ok().and_then(|after| now.checked_add(after));
                    let fault = Fault { at_cycle: 0, phase: 0.0, member, action };
                    self.due.extend(at.map(|at| (at, fault)));
                }
                Order::Forget(member) => self.due.retain(|(_, fault)| fault.member != member),
            }
        }
        self.due.sort_by_key(|(at, _)| *at);
    }
}

impl Conductor for Fates<'_> {
    fn hear(&mut self, record: &Record, now: Instant) {
        self.newest = self.newest.max(Time(record.at_ns));
        let Some(seen) = self.look(record) else {
            return;
        };
        if self.origin.is_none() || self.lost.is_some() {
            return;
        }
        if let Seen::Lost(since) = seen {
            self.lost = self.lives.has_failed().then_some(since);
        } else {
            self.lives.see(Time(record.at_ns), seen);
            self.carry_out_orders(now);
        }
    }

    fn follow(&mut self, cycle: Option<u64>, now: Instant) {
        self.cycle = cycle.unwrap_or(0);
        if cycle.is_some() && self.origin.is_none() {
            self.origin = Some(self.newest);
            self.lives.begin();
            self.carry_out_orders(now);
        }
    }

    fn next_due(&self) -> Option<Instant> {
        self.due.first().map(|(at, _)| *at)
    }

    fn take_due(&mut self, now: Instant) -> Option<Fault> {
        let due = self.next_due()?;
        let asked = self.cycle + 1;
        (due <= now).then(|| Fault { at_cycle: asked, ..self.due.remove(0).1 })
    }

    fn wait_for_time(&self) -> bool {
        !self.due.is_empty()
    }

    fn is_over(&self, now: Instant) -> bool {
        self.lost.is_some() || now >= self.give_up
    }
}
