//! A faultload by chance. Invariant: it is a function of the cluster's schedule, the kinds and the random numbers, and everything in
//! it can be written in a scenario file and read back unchanged.
//!
//! A flipped bit comes alone in its run: beside another fault too few true words may be left to tell it from, and no code of this
//! distance can locate an error and an erasure, or two equal errors, at once.

use std::ops::Range;
use std::time::Duration;

use rand::RngExt;
use rand_pcg::Pcg64;
use understudy_cluster::Cluster;
use understudy_cycle::Schedule;
use understudy_remote_io::{OperatorInput, OperatorInputKind};
use understudy_simulator::{Action, Disturbance, Fault, Network};
use understudy_wire::{Member, PointValue, ProgramId, ProgramSet, StationId, Via};

use super::faultload::{Faultload, Injection};
use super::kind::{Kind, Role};

/// Injections of one run, at most.
const MAXIMUM_INJECTIONS: u32 = 6;

/// Cycles for which a link is broken, at most, where a station crashes after it.
const LONGEST_OUTAGE: f64 = 10_000.0;

/// Cycles for which an input is stuck, at most: several times those after which it is reported.
const LONGEST_STUCK: u64 = 600;

/// Restarts of one storm, at most.
const MAXIMUM_RESTARTS: u64 = 6;

/// What faults are drawn for.
pub(super) struct Target<'a> {
    pub(super) schedule: &'a Schedule,
    /// Inputs that operators write.
    inputs: Vec<(ProgramId, OperatorInput)>,
    /// Paths that may fail: two networks, and the direct links.
    paths: Vec<Via>,
    /// Programs with a second remote I/O.
    twins: ProgramSet,
    /// Remote I/Os with a direct link to the other one of their program.
    linked: Vec<Member>,
    /// Inputs that modules of both remote I/Os read, of one bit.
    paired: Vec<(ProgramId, u16)>,
}

impl<'a> Target<'a> {
    pub(super) fn of(cluster: &'a Cluster) -> Self {
        let programs = (0..).map(ProgramId).zip(cluster.remote_ios());
        let inputs = programs.flat_map(|(program, remote_io)| {
            let inputs = remote_io.operator_inputs();
            inputs.map(move |declared| (program, declared.input))
        });
        let programs = (0..).map(ProgramId).zip(cluster.remote_ios());
        let paired = programs.flat_map(|(program, remote_io)| {
            let inputs = remote_io.twin.iter().flat_map(|twin| &twin.paired_inputs);
            let bits = inputs.filter(|input| input.place.of.bits() == 1);
            bits.map(move |input| (program, input.place.bit))
        });
        Self {
            paired: paired.collect(),
            schedule: &cluster.agreement().schedule,
            inputs: inputs.collect(),
            paths: {
                let networks = cluster.has_two_networks().then_some(Via::NETWORKS);
                let link = (!cluster.direct_links().is_empty()).then_some(Via::Link);
                networks.into_iter().flatten().chain(link).collect()
            },
            linked: {
                let links = cluster.direct_links();
                let both = |program| [Member::RemoteIo(program), Member::Twin(program)];
                links.iter().flat_map(both).collect()
            },
            twins: cluster.twins(),
        }
    }

    /// The kinds that can be drawn: a cluster without operator inputs has no writes, one with one path none that may fail, and one where each input has
    /// one module has none that may be stuck.
    pub(super) fn kinds(&self, kinds: &[Kind]) -> Vec<Kind> {
        let kinds = kinds.iter().copied();
        let can_be = |kind: &Kind| match kind {
            Kind::Write => !self.inputs.is_empty(),
            Kind::NetworkFailure => !self.paths.is_empty(),
            Kind::StuckInput => !self.paired.is_empty(),
            _ => true,
        };
        kinds.filter(can_be).collect()
    }
}

/// Draws what happens in `cycles`, a range of the run's cycles that is not empty.
pub(super) fn draw(
    random: &mut Pcg64,
    target: &Target<'_>,
    kinds: &[Kind],
    cycles: &Range<u64>,
) -> Faultload {
    let mut drawn = Draw {
        random,
        schedule: target.schedule,
        inputs: &target.inputs,
        twins: target.twins,
        paired: &target.paired,
        paths: &target.paths,
        linked: &target.linked,
        cycles: cycles.clone(),
    };
    let mut faultload = Faultload::default();
    let (of_values, kinds): (Vec<Kind>, Vec<Kind>) =
        kinds.iter().partition(|kind| kind.is_value_fault());
    let alone = kinds.is_empty() || drawn.random.random_range(0..4) == 0;
    if !of_values.is_empty() && alone {
        let kind = drawn.one_of(&of_values);
        faultload.injections.extend(drawn.injection(kind));
        return faultload;
    }
    let (of_network, of_members): (Vec<Kind>, Vec<Kind>) =
        kinds.iter().partition(|kind| kind.roles() == [Role::Network]);
    if !of_network.is_empty() && (of_members.is_empty() || drawn.random.random_range(0..4) == 0) {
        faultload.network = Some(drawn.network(&of_network));
    }
    if of_members.is_empty() {
        return faultload;
    }
    for _ in 0..drawn.random.random_range(1..=MAXIMUM_INJECTIONS) {
        let kind = drawn.one_of(&of_members);
        if let Some(injection) = drawn.injection(kind)
            && !faultload.injections.iter().any(|other| other.collides_with(&injection))
        {
            faultload.injections.push(injection);
        }
    }
    faultload
}

struct Draw<'a> {
    random: &'a mut Pcg64,
    schedule: &'a Schedule,
    inputs: &'a [(ProgramId, OperatorInput)],
    twins: ProgramSet,
    paired: &'a [(ProgramId, u16)],
    paths: &'a [Via],
    linked: &'a [Member],
    cycles: Range<u64>,
}

impl Draw<'_> {
    fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.random.random_range(0..list.len())]
    }

    /// From when to when, and where in its cycles; short ones are as likely as long ones.
    fn span(&mut self) -> (Range<u64>, f64) {
        let from = self.random.random_range(self.cycles.clone());
        let long = self.random.random_range(0..2) == 0;
        let cycles = self.random.random_range(if long { 3..40 } else { 0..3 });
        let phase = f64::from(self.random.random_range(0..1000)) / 1000.0;
        (from..(from + cycles).min(self.cycles.end - 1), phase)
    }

    /// A remote I/O, or the second one of its program as often; operators write to the first one.
    fn or_its_twin(&mut self, member: Member, kind: Kind) -> Member {
        match member {
            Member::RemoteIo(program) if self.twins.contains(program) && kind != Kind::Write => {
                self.one_of(&[member, Member::Twin(program)])
            }
            _ => member,
        }
    }

    /// Nothing where the cluster has nobody of the role.
    fn injection(&mut self, kind: Kind) -> Option<Injection> {
        let schedule = self.schedule;
        let role = self.one_of(kind.roles());
        let members: Vec<Member> = role.members(schedule).collect();
        if members.is_empty() {
            return None;
        }
        let member = self.one_of(&members);
        let member = self.or_its_twin(member, kind);
        let (span, phase) = self.span();
        let step = |at_cycle: u64, action: Action| Fault { at_cycle, phase, member, action };
        let (from, to) = (span.start, span.end);
        let lasting = |begins, ends| vec![step(from, begins), step(to, ends)];
        let steps = match kind {
            Kind::Write => {
                let Member::RemoteIo(program) = member else {
                    return None;
                };
                let (input, value) = self.written(program)?;
                vec![step(from, Action::Write { input, value })]
            }
            Kind::Crash => lasting(Action::Crash, Action::Restart),
            Kind::Stop => lasting(Action::Stop, Action::Continue),
            Kind::RestartStorm => {
                let restarts = self.random.random_range(2..=MAXIMUM_RESTARTS);
                let between = (to - from) / restarts;
                (0..restarts)
                    .flat_map(|restart| {
                        let at = from + restart * between;
                        [step(at, Action::Crash), step(at, Action::Restart)]
                    })
                    .collect()
            }
            Kind::ClockJump => {
                // The simulated epochs are counted from 1; all clocks of one run lie around them.
                let epoch = match self.random.random_range(0..3) {
                    0 => 0,
                    1 => self.random.random_range(1..10),
                    _ => self.random.random_range(1..1 << 40),
                };
                lasting(Action::Crash, Action::RestartInEpoch { epoch })
            }
            Kind::Misconfiguration => {
                let middle = from.midpoint(to);
                vec![
                    step(from, Action::Crash),
                    step(from, Action::RestartMisconfigured),
                    step(middle, Action::Crash),
                    step(to, Action::Restart),
                ]
            }
            Kind::WrongProgram => {
                let program = member.sampled_program()?;
                let station = match Role::Understudy.members(schedule).next() {
                    Some(understudy) if self.random.random_range(0..2) == 0 => understudy,
                    _ => Member::Station(program.controller()),
                };
                // Restarted one after the other, in either order.
                let apart = self.random.random_range(0..=4);
                let first = self.random.random_range(0..2) == 0;
                let (one, other) = if first { (member, station) } else { (station, member) };
                let at = |at_cycle: u64, member: Member, action: Action| {
                    let at_cycle = at_cycle.min(self.cycles.end - 1);
                    Fault { at_cycle, phase, member, action }
                };
                vec![
                    at(from, one, Action::Crash),
                    at(from, one, Action::RestartWrongProgram),
                    at(from + apart, other, Action::Crash),
                    at(from + apart, other, Action::RestartWrongProgram),
                    at(to + apart, member, Action::Crash),
                    at(to + apart, member, Action::Restart),
                    at(to + apart, station, Action::Crash),
                    at(to + apart, station, Action::Restart),
                ]
            }
            Kind::PowerFailure => {
                let last = self.cycles.end - 1;
                let mut all = vec![member];
                all.extend(self.others(member));
                let mut steps = Vec::new();
                for member in all {
                    let mut at = |cycle: u64, most: u64, action| {
                        let cycle = (cycle + self.random.random_range(0..2)).min(most);
                        let phase = f64::from(self.random.random_range(0..1000)) / 1000.0;
                        steps.push(Fault { at_cycle: cycle, phase, member, action });
                    };
                    // It starts again after it was gone.
                    at(from, last.saturating_sub(2), Action::Crash);
                    at(to + 2, last, Action::Restart);
                }
                steps
            }
            Kind::Slow => {
                let by = schedule.period() / 20 * self.random.random_range(1..=40);
                lasting(Action::Slow { by }, Action::Slow { by: Duration::ZERO })
            }
            Kind::OneWayCut => {
                let to = self.other(member)?;
                lasting(Action::Cut { to }, Action::Heal { to })
            }
            Kind::BrokenLink => {
                let to = self.other(member)?;
                self.broken_link(member, to, phase, from)
            }
            Kind::Cut => {
                let peer = self.other(member)?;
                cuts(&[peer], member, phase, from, to)
            }
            Kind::LateLink => {
                let to = self.other(member)?;
                let by = schedule.period() / 20 * self.random.random_range(1..=40);
                let end = Duration::ZERO;
                lasting(Action::Delay { to, by }, Action::Delay { to, by: end })
            }
            Kind::Isolation => cuts(&self.others(member), member, phase, from, to),
            Kind::NetworkFailure => {
                let network = self.one_of(self.paths);
                let all = self.random.random_range(0..2) == 0;
                let struck = match (network, all) {
                    (Via::Link, true) => self.linked.to_vec(),
                    (Via::Link, false) => vec![self.one_of(self.linked)],
                    (_, true) => [vec![member], self.others(member)].concat(),
                    (_, false) => vec![member],
                };
                let steps = |at: u64, action| {
                    struck.iter().map(move |&member| Fault { at_cycle: at, phase, member, action })
                };
                let back = steps(to, Action::Plug { network });
                steps(from, Action::Unplug { network }).chain(back).collect()
            }
            Kind::StuckInput => {
                let (program, input) = self.one_of(self.paired);
                let member = self.one_of(&[Member::RemoteIo(program), Member::Twin(program)]);
                let value = self.random.random_range(0..2) == 1;
                let to = from + self.random.random_range(1..=LONGEST_STUCK);
                let at = |at_cycle, action| Fault { at_cycle, phase, member, action };
                vec![
                    at(from, Action::StickInput { input, value }),
                    at(to.min(self.cycles.end - 1), Action::FreeInput { input }),
                ]
            }
            Kind::CorruptFrames => {
                let frames = self.random.random_range(1..=8);
                vec![step(from, Action::Corrupt { frames })]
            }
            Kind::Replay => {
                let age = self.random.random_range(1..=16);
                vec![step(from, Action::Replay { age })]
            }
            Kind::Forgery => vec![step(from, Action::Forge)],
            Kind::FlippedState => {
                let program = match (role, member) {
                    (Role::Controller, Member::Station(station)) => station.controlled(),
                    _ => ProgramId(self.random.random_range(0..schedule.controllers()) as u8),
                };
                let bit = self.random.random_range(0..64);
                vec![step(from, Action::FlipState { program, bit })]
            }
            Kind::FlippedSample => {
                let (bit, frames) = self.flip();
                vec![step(from, Action::FlipSample { bit, frames })]
            }
            Kind::FlippedWord => {
                let (bit, frames) = self.flip();
                vec![step(from, Action::FlipWord { bit, frames })]
            }
            Kind::Loss | Kind::Duplication | Kind::Jitter | Kind::Corruption => return None,
        };
        Some(Injection { kind, role, steps })
    }

    /// An input that operators write, with a value for it: of a setpoint its limits and its initial value.
    fn written(&mut self, program: ProgramId) -> Option<(u16, PointValue)> {
        let inputs = self.inputs.iter().filter(|(of, _)| *of == program);
        let inputs: Vec<OperatorInput> = inputs.map(|(_, input)| *input).collect();
        if inputs.is_empty() {
            return None;
        }
        let input = self.one_of(&inputs);
        let of = input.place.of;
        let stored = match input.kind {
            OperatorInputKind::Pulse(_) => 1,
            OperatorInputKind::Level => self.random.random_range(0..2),
            OperatorInputKind::Group { .. } => self.one_of(&[0, 1, input.initial]),
            OperatorInputKind::Setpoint { low, high } => self.one_of(&[low, input.initial, high]),
        };
        Some((input.place.bit, PointValue::new(of.bits(), stored)))
    }

    /// From `from` on `to` does not receive `member`, then a station crashes, and the link is whole again about that time: short
    /// outages are as likely as long ones.
    fn broken_link(&mut self, member: Member, to: Member, phase: f64, from: u64) -> Vec<Fault> {
        let last = self.cycles.end - 1;
        let length = LONGEST_OUTAGE.powf(self.random.random_range(0.0..1.0)) as u64;
        let crashes = (from + length).min(last);
        let heals = (from + (length + self.random.random_range(0..6)).saturating_sub(3)).min(last);
        let restarts = (crashes + self.random.random_range(1..40)).min(last);
        let stations = self.schedule.stations() as u8;
        let station = Member::Station(StationId(self.random.random_range(0..stations)));
        let mut steps: Vec<Fault> = [
            (from, member, Action::Cut { to }),
            (crashes, station, Action::Crash),
            (heals, member, Action::Heal { to }),
            (restarts, station, Action::Restart),
        ]
        .map(|(at_cycle, member, action)| Fault { at_cycle, phase, member, action })
        .to_vec();
        steps.sort_by_key(|step| step.at_cycle);
        steps
    }

    fn flip(&mut self) -> (u16, u16) {
        (self.random.random_range(0..64), self.random.random_range(1..=4))
    }

    fn others(&self, member: Member) -> Vec<Member> {
        let members = Role::ALL.into_iter().flat_map(|role| role.members(self.schedule));
        members
            .chain(self.twins.iter().map(Member::Twin))
            .filter(|other| *other != member)
            .collect()
    }

    fn other(&mut self, member: Member) -> Option<Member> {
        let others = self.others(member);
        (!others.is_empty()).then(|| self.one_of(&others))
    }

    /// Another network for a while; each kind but the first is in it with an even chance.
    fn network(&mut self, kinds: &[Kind]) -> Disturbance {
        let (span, _) = self.span();
        let first = self.one_of(kinds);
        let mut network = Network::default();
        for &kind in kinds {
            if kind != first && self.random.random_range(0..2) == 0 {
                continue;
            }
            let share = f64::from(self.random.random_range(1..=200)) / 1000.0;
            match kind {
                Kind::Loss => network.loss = share,
                Kind::Duplication => network.duplicate = share,
                Kind::Corruption => network.corruption = share,
                // Up to a third of the period, in whole microseconds.
                Kind::Jitter => {
                    let most = self.schedule.period().as_micros() as f64 / 3.0;
                    let jitter = (most * share * 5.0) as u64;
                    network.jitter = Duration::from_micros(jitter.max(1));
                }
                _ => {}
            }
        }
        Disturbance { network, cycles: Some(span.start..span.end + 1) }
    }
}

/// Cuts `member` off from each peer, both ways.
fn cuts(peers: &[Member], member: Member, phase: f64, from: u64, to: u64) -> Vec<Fault> {
    let both = |at_cycle: u64, action: fn(Member) -> Action| {
        peers.iter().flat_map(move |&peer| {
            [(member, peer), (peer, member)].map(|(from, to)| Fault {
                at_cycle,
                phase,
                member: from,
                action: action(to),
            })
        })
    };
    let begins = both(from, |to| Action::Cut { to });
    begins.chain(both(to, |to| Action::Heal { to })).collect()
}
