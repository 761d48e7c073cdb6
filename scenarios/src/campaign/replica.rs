//! One replica: from a whole cluster to the failure of the system.

use std::cell::RefCell;

use rand::RngExt;
use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;
use understudy_cluster::Cluster;
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::{Action, Fault, Network, NotReady, Record, Simulation};
use understudy_wire::{Mode, Party, ProgramId, ProgramSet, Source, StationId, Time};

use super::CampaignPlan;
use crate::terms::parts;

/// Cycles that the cluster gets to come into step.
const PATIENCE_CYCLES: u64 = 10_000;

/// What one replica came to; times in nanoseconds of virtual time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Run {
    /// Until the system failed, or the replica was given up.
    pub(super) ran_ns: u64,
    /// What brought the failure about; nothing where the replica was given up.
    pub(super) cause: Option<String>,
    /// Failures of stations that the redundancy left should have masked.
    pub(super) asked: u64,
    /// Those of them that it did not.
    pub(super) unmasked: u64,
    pub(super) detections_ns: Vec<u64>,
    pub(super) repairs_ns: Vec<u64>,
    pub(super) reentries_ns: Vec<u64>,
    pub(super) violations: Vec<String>,
}

/// A station, as the model sees it.
#[derive(Debug, Clone, Copy)]
enum Life {
    InStep,
    Undetected { since: Time },
    Repaired { since: Time },
    Returning { since: Time, lacks: ProgramSet },
}

/// What the campaign has to answer, in the order in which it was seen.
#[derive(Debug, Clone)]
enum Seen {
    Done(Fault),
    Flagged(StationId),
    InStep(StationId, ProgramId),
    /// The first deadline of this remote I/O with nothing true to apply.
    Missed,
    /// Its program is lost; that deadline.
    Lost(Time),
    Violation(String),
}

/// The newest failure of a station.
#[derive(Debug)]
struct Newest {
    station: StationId,
    /// Who was not in step when it came.
    before: Vec<StationId>,
    /// Whether it should have been masked, and no deadline has shown yet that it was not.
    counts_as_masked: bool,
}

pub(super) struct Replica<'a> {
    cluster: &'a Cluster,
    plan: &'a CampaignPlan,
    random: Pcg64,
    lives: Vec<Life>,
    newest: Option<Newest>,
    run: Run,
}

impl<'a> Replica<'a> {
    pub(super) fn new(cluster: &'a Cluster, plan: &'a CampaignPlan, number: u64) -> Self {
        Self {
            cluster,
            plan,
            // A stream of its own for each replica.
            random: Pcg64::new(u128::from(plan.seed), u128::from(number)),
            lives: vec![Life::InStep; cluster.agreement().schedule.stations()],
            newest: None,
            run: Run {
                ran_ns: 0,
                cause: None,
                asked: 0,
                unmasked: 0,
                detections_ns: Vec::new(),
                repairs_ns: Vec::new(),
                reentries_ns: Vec::new(),
                violations: Vec::new(),
            },
        }
    }

    pub(super) fn run(mut self) -> Result<Run, NotReady> {
        let seed = self.random.random();
        let mut simulation = Simulation::new(parts(self.cluster), Network::default(), seed);
        simulation.run(0, PATIENCE_CYCLES, &mut |_, _, _, _| {})?;
        let origin = simulation.now();
        for rank in 0..self.lives.len() {
            let station = StationId(rank as u8);
            self.schedule(&mut simulation, station, Action::Crash);
        }
        let seen = RefCell::new(Vec::new());
        let mut missing: Vec<Option<Time>> = vec![None; self.cluster.controllers().len()];
        let mut observe = |now: Time, _: Option<u64>, party: Party, record: Record<'_>| {
            let found = look(now, party, record, &mut missing);
            seen.borrow_mut().extend(found.map(|found| (now, found)));
        };
        let mut over = || !seen.borrow().is_empty();
        while simulation.go_on(self.plan.maximum_cycles, &mut observe, &mut over) {
            for (now, found) in seen.take() {
                if let Seen::Lost(since) = found {
                    self.run.ran_ns = since.0 - origin.0;
                    self.run.cause = Some(self.cause());
                    return Ok(self.run);
                }
                self.answer(&mut simulation, now, found);
            }
        }
        self.run.ran_ns = simulation.now().0 - origin.0;
        Ok(self.run)
    }

    /// Draws when `action` comes to `station`, and has the simulation do it then.
    fn schedule(&mut self, simulation: &mut Simulation, station: StationId, action: Action) {
        let mean = match action {
            Action::Crash => self.plan.mtbf_cycles,
            _ => self.plan.mttr_cycles,
        };
        let drawn: f64 = Exp1.sample(&mut self.random);
        let at = simulation.cycle_time().unwrap_or(0.0) + mean * drawn;
        simulation.schedule(Fault {
            at_cycle: at as u64,
            phase: at.fract(),
            party: Party::Station(station),
            action,
        });
    }

    fn answer(&mut self, simulation: &mut Simulation, now: Time, seen: Seen) {
        match seen {
            Seen::Done(fault) => {
                if let Party::Station(station) = fault.party {
                    self.done(now, station, fault.action);
                }
            }
            Seen::Flagged(station) => {
                if let Life::Undetected { since } = self.lives[station.index()] {
                    self.run.detections_ns.push(now.0 - since.0);
                    self.lives[station.index()] = Life::Repaired { since: now };
                    self.schedule(simulation, station, Action::Restart);
                }
            }
            Seen::InStep(station, program) => {
                if let Life::Returning { since, lacks } = self.lives[station.index()] {
                    let lacks = lacks.without(ProgramSet::only(program));
                    self.lives[station.index()] = Life::Returning { since, lacks };
                    if lacks.is_empty() {
                        self.run.reentries_ns.push(now.0 - since.0);
                        self.lives[station.index()] = Life::InStep;
                        self.schedule(simulation, station, Action::Crash);
                    }
                }
            }
            Seen::Missed => {
                let masked = !self.has_failed();
                if let Some(newest) = &mut self.newest
                    && masked
                    && newest.counts_as_masked
                {
                    newest.counts_as_masked = false;
                    self.run.unmasked += 1;
                }
            }
            Seen::Violation(what) => self.run.violations.push(what),
            // The replica has ended with it.
            Seen::Lost(_) => {}
        }
    }

    fn done(&mut self, now: Time, station: StationId, action: Action) {
        let place = station.index();
        if action == Action::Crash {
            let before = self.not_in_step();
            self.lives[place] = Life::Undetected { since: now };
            let counts_as_masked = !self.has_failed();
            self.run.asked += u64::from(counts_as_masked);
            self.newest = Some(Newest {
                station,
                before,
                counts_as_masked,
            });
        } else if let Life::Repaired { since } = self.lives[place] {
            self.run.repairs_ns.push(now.0 - since.0);
            let programs = self.cluster.controllers().len();
            let lacks = if place < programs {
                ProgramSet::only(ProgramId(station.0))
            } else {
                ProgramSet::first(programs)
            };
            self.lives[place] = Life::Returning { since: now, lacks };
        }
    }

    fn not_in_step(&self) -> Vec<StationId> {
        let lives = self.lives.iter().enumerate();
        lives
            .filter(|(_, life)| !matches!(life, Life::InStep))
            .map(|(rank, _)| StationId(rank as u8))
            .collect()
    }

    /// Whether the system has failed by its definition, going by who is in step.
    fn has_failed(&self) -> bool {
        let programs = self.cluster.controllers().len();
        let down = self.not_in_step();
        let understudies = down.iter().filter(|station| station.index() >= programs);
        match self.cluster.agreement().mode {
            Mode::Paper => down.len() > 1,
            Mode::Full => {
                let understudies = understudies.count();
                understudies == self.cluster.understudies().len() && down.len() > understudies
            }
        }
    }

    /// Such as `robot after understudy`.
    fn cause(&self) -> String {
        let name = |station: &StationId| {
            let name = self.cluster.party_name(Party::Station(*station));
            name.unwrap_or_default().to_owned()
        };
        let Some(newest) = &self.newest else {
            return "with all stations in step".to_owned();
        };
        let before: Vec<String> = newest.before.iter().map(name).collect();
        if before.is_empty() {
            format!("{} alone", name(&newest.station))
        } else {
            format!("{} after {}", name(&newest.station), before.join(" and "))
        }
    }
}

/// What of a record concerns the campaign. `missing`: since when a remote I/O has had nothing true to apply.
fn look(now: Time, party: Party, record: Record<'_>, missing: &mut [Option<Time>]) -> Option<Seen> {
    match (party, record) {
        (_, Record::Fault(fault)) => Some(Seen::Done(*fault)),
        (_, Record::Violation(violation)) => Some(Seen::Violation(violation.to_string())),
        (_, Record::Station(StationEvent::Flagged { station, .. }))
        | (_, Record::RemoteIo(RemoteIoEvent::Flagged { station, .. })) => {
            Some(Seen::Flagged(*station))
        }
        (Party::Station(station), Record::Station(StationEvent::InStep { program, .. })) => {
            Some(Seen::InStep(station, *program))
        }
        (Party::RemoteIo(program), Record::RemoteIo(RemoteIoEvent::Applied { source, .. })) => {
            let since = &mut missing[program.index()];
            match source {
                Source::Direct | Source::Reconstructed => {
                    *since = None;
                    None
                }
                Source::Held if since.is_some() => None,
                Source::Held => {
                    *since = Some(now);
                    Some(Seen::Missed)
                }
                Source::FailSafe => Some(Seen::Lost(since.unwrap_or(now))),
            }
        }
        _ => None,
    }
}
