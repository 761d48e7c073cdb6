//! A counterexample as a scenario of a cluster: the program starts cold, and its inputs are set scan by scan.
//!
//! A program makes some scans between its cold start and the first set input, and how many is not known. Therefore a run has a scenario only where
//! some inputs in front of it change nothing that the property names; this is tried with the program itself.

use std::collections::BTreeSet;

use understudy_cluster::{Cluster, InputSourceKind};
use understudy_journal::Members;
use understudy_scenarios::{Action, Fault, Scenario};
use understudy_typed::{Machine, Part, Program, Scratch};
use understudy_verification::numbers::Driven;
use understudy_verification::property::Property;
use understudy_wire::{Member, PointValue, ProgramId, StateChoice, StationId};

/// Numbers of scans for which the inputs before a run are tried.
const TRIED: [usize; 14] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 50, 100, 400, 1001];

/// How often the part of a run without end is repeated.
const ROUNDS: usize = 3;

/// The most scans of a run.
const LONGEST: usize = 2_000;

/// Values of all inputs of a program in a scan, in their order.
type Inputs = Vec<u64>;

/// A program of the run.
struct Driver<'a> {
    program: ProgramId,
    typed: &'a Program,
    /// Names of its inputs.
    names: Vec<&'a str>,
    /// The inputs before the run.
    before: Inputs,
    /// Those of its scans.
    scans: Vec<Inputs>,
}

/// The scenario in which a property fails as in the run with these inputs; a run without end returns to the scan `again_from`.
///
/// # Errors
/// The reason why no scenario drives the cluster so.
pub(super) fn of_run(
    cluster: &Cluster,
    property: &Property,
    run: &[Driven],
    again_from: Option<usize>,
) -> Result<Scenario, String> {
    let named = property.formula.signals().into_iter();
    let named = named.filter_map(|named| named.name.split_once('.').map(|(name, _)| name));
    let named: BTreeSet<&str> = named.collect();
    let controllers = (0..).map(ProgramId).zip(cluster.controllers());
    let programs = controllers.filter(|(_, controller)| named.contains(controller.name.as_str()));
    let drivers =
        programs.map(|(program, _)| Driver::new(cluster, program, property, (run, again_from)));
    let drivers: Result<Vec<Driver<'_>>, String> = drivers.collect();
    Ok(scenario(cluster, property, &drivers?))
}

impl<'a> Driver<'a> {
    fn new(
        cluster: &'a Cluster,
        program: ProgramId,
        property: &Property,
        (run, again_from): (&[Driven], Option<usize>),
    ) -> Result<Self, String> {
        let controller = &cluster.controllers()[program.index()];
        let remote_io = &cluster.remote_ios()[program.index()];
        let name = &controller.name;
        let mut sources = remote_io.inputs.iter();
        if sources.any(|source| matches!(source.kind, InputSourceKind::Signal(_))) {
            return Err(format!(
                "`{name}` reads signals of other programs, which may be lost in the run"
            ));
        }
        if remote_io.twin.is_some() {
            return Err(format!(
                "`{name}` has two remote I/Os, and an input is set at one of them"
            ));
        }
        let typed = controller.code.typed().as_ref();
        let values = |of: &str| {
            let driven =
                run.iter().find(|driven| driven.name.strip_prefix(name.as_str()) == Some(of));
            driven.map(|driven| driven.values.as_slice())
        };
        let is_ever = |of: &str, value| values(of).is_some_and(|values| values.contains(&value));
        if is_ever(".power.returns", 1) {
            return Err(format!("`{name}` starts warm in the run"));
        }
        if is_ever(".sampled", 0) {
            return Err(format!("`{name}` misses a sample in the run"));
        }
        let count = run.first().map_or(0, |driven| driven.values.len());
        let points: Vec<_> = typed.inputs.iter().filter(|point| point.slot != 0).collect();
        let names: Vec<&str> = points.iter().map(|point| point.name.as_str()).collect();
        let of_scan = |scan: usize| {
            let driven = points.iter().map(|point| {
                let values = values(&format!(".{}", point.name));
                values.map_or(point.initial, |values| values[scan])
            });
            driven.collect::<Inputs>()
        };
        let rounds =
            again_from.into_iter().flat_map(|from| (0..ROUNDS).flat_map(move |_| from..count));
        let scans: Vec<Inputs> = (0..count).chain(rounds).take(LONGEST).map(of_scan).collect();
        let initial: Inputs = points.iter().map(|point| point.initial).collect();
        let is_stopped = shown(typed, &[], &initial, 0, &scans).iter().any(|shown| shown[0] != 0);
        if is_stopped && is_ever(&format!(".{}", Program::RESET), 1) {
            return Err(format!("`{name}` is restarted in the run, after a program fault"));
        }
        let watched = watched(typed, name, property)?;
        let mut tried = std::iter::once(&initial).chain(&scans);
        let before = tried.find(|before| changes_nothing(typed, &watched, before, &scans)).cloned();
        let before = before.ok_or_else(|| {
            format!(
                "no inputs were found with which `{name}` could wait for the run after its start"
            )
        })?;
        Ok(Self { program, typed, names, before, scans })
    }
}

/// The variables of a program that a property names; its fault is watched in any case.
fn watched(program: &Program, name: &str, property: &Property) -> Result<Vec<Part>, String> {
    let own = |of: &str| Some(of.strip_prefix(name)?.strip_prefix('.')?.to_owned());
    let part = |of: &str| program.part(of).filter(|part| part.of.elementary().is_some());
    let mut watched = Vec::new();
    for named in property.formula.signals() {
        let Some(signal) = own(&named.name) else {
            continue;
        };
        if signal != Program::FAULT {
            watched.push(part(&signal).ok_or_else(|| format!("`{}` is no variable", named.name))?);
        }
        let other = named.compared.as_ref().and_then(|compared| own(&compared.with));
        watched.extend(other.and_then(|other| part(&other)));
    }
    Ok(watched)
}

/// The fault of a program and what is `watched` in the scans with some inputs, behind a number of scans with those `before`.
fn shown(
    program: &Program,
    watched: &[Part],
    before: &Inputs,
    first: usize,
    scans: &[Inputs],
) -> Vec<Vec<u64>> {
    let machine = Machine::new(program);
    let mut state = machine.initial().to_vec();
    let mut scratch = Scratch::default();
    let mut outputs = vec![0; machine.output_count().div_ceil(64)];
    let mut run = |inputs: &Inputs| {
        let mut image = vec![0; machine.input_count().div_ceil(64)];
        let points = program.inputs.iter().filter(|point| point.slot != 0);
        points.zip(inputs).for_each(|(point, value)| point.set(&mut image, *value));
        machine.step(&mut scratch, &mut state, &image, &mut outputs);
        let value = |part: &Part| part.stored(&state).map_or(0, |(_, stored)| stored);
        std::iter::once(state[0]).chain(watched.iter().map(value)).collect::<Vec<u64>>()
    };
    for _ in 0..first {
        run(before);
    }
    scans.iter().map(run).collect()
}

/// Whether scans with some inputs in front of those with the others change nothing that is watched there, however many they are.
fn changes_nothing(program: &Program, watched: &[Part], before: &Inputs, scans: &[Inputs]) -> bool {
    let alone = shown(program, watched, before, 0, scans);
    TRIED.iter().all(|first| shown(program, watched, before, *first, scans) == alone)
}

/// The steps: the inputs before the run are set, the stations with a state of the programs are started again, the programs start cold, and then the
/// inputs of the run follow.
fn scenario(cluster: &Cluster, property: &Property, drivers: &[Driver<'_>]) -> Scenario {
    let members = Members::of(cluster);
    let period = cluster.agreement().schedule.period().as_micros().max(1);
    // Long enough for a process to start.
    let pause = u64::try_from(1_000_000 / period).unwrap_or(u64::MAX).max(100);
    let mut steps = Vec::new();
    let mut step = |at_cycle, member, action| {
        steps.push(Fault { at_cycle, phase: 0.0, member, action });
    };
    for driver in drivers {
        driver
            .set(&members, None, &driver.before)
            .for_each(|(member, action)| step(0, member, action));
    }
    let controllers = drivers.iter().map(|driver| StationId(driver.program.0));
    let understudies = cluster.controllers().len()..;
    let understudies = understudies.zip(cluster.understudies()).filter(|(_, it)| !it.spare);
    let understudies = understudies.filter_map(|(at, _)| Some(StationId(u8::try_from(at).ok()?)));
    let stations: Vec<Member> = controllers.chain(understudies).map(Member::Station).collect();
    for &station in &stations {
        step(pause, station, Action::Crash);
        step(2 * pause, station, Action::Restart);
    }
    let begin = 6 * pause;
    for driver in drivers {
        step(
            4 * pause,
            Member::RemoteIo(driver.program),
            Action::Choose { choice: StateChoice::Cold },
        );
        let mut last = &driver.before;
        for (at, inputs) in (begin..).zip(&driver.scans) {
            driver
                .set(&members, Some(last), inputs)
                .for_each(|(member, action)| step(at, member, action));
            last = inputs;
        }
    }
    steps.sort_by_key(|step| step.at_cycle);
    let longest = drivers.iter().map(|driver| driver.scans.len() as u64).max().unwrap_or(0);
    Scenario {
        title: format!("Counterexample: {}", property.text),
        cycles: begin + longest + pause,
        steps,
        ..Scenario::default()
    }
}

impl Driver<'_> {
    /// The steps that set inputs which are not as they were.
    fn set(
        &self,
        members: &Members,
        last: Option<&Inputs>,
        inputs: &Inputs,
    ) -> impl Iterator<Item = (Member, Action)> {
        let changed =
            (0..inputs.len()).filter(|at| last.is_none_or(|last| last[*at] != inputs[*at]));
        let actions = changed.filter_map(|at| {
            let mut signals = members.inputs(self.program);
            let signal = signals.find(|signal| signal.name == self.names[at])?;
            let of = self.typed.inputs.find(self.names[at])?.of;
            let value = PointValue::new(of.bits(), inputs[at]);
            Some(Action::Set { input: signal.place.first_bit(), value })
        });
        let actions: Vec<Action> = actions.collect();
        actions.into_iter().map(|action| (Member::RemoteIo(self.program), action))
    }
}
