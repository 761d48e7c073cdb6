//! A number that output modules of two remote I/Os drive together: their currents add up, so each drives half, and the whole while the other one drives
//! nothing.

use std::time::Duration;

use understudy_cluster::read;
use understudy_simulator::{Action, Fault, Network, Parts, Record, Simulation, Violation, parts};
use understudy_wire::{Image, Member, ProgramId, StationId};

const PROGRAM: ProgramId = ProgramId(0);
const FIRST: Member = Member::RemoteIo(PROGRAM);
const TWIN: Member = Member::Twin(PROGRAM);
const CONTROLLER: Member = Member::Station(StationId(0));
const UNDERSTUDY: Member = Member::Station(StationId(1));

/// The valve is always open this wide, or changes in every scan up to that.
const OPEN: f32 = 40.0;
const STEADY: &str = "valve := 40.0;";
const CHANGING: &str = "valve := valve + 9.0; IF valve > 40.0 THEN valve := 4.0; END_IF;";

fn cell(after: u32, body: &str) -> Parts {
    let text = format!(
        "[cluster]\nname = \"valve\"\nperiod = \"10ms\"\n\
         [[controller]]\nname = \"valve\"\nladder = \"valve.st\"\n\
         [[understudy]]\nname = \"understudy\"\n\
         [[remote_io]]\nname = \"valve-io\"\ncontroller = \"valve\"\n\
         twin = {{ name = \"valve-io-2\", wiring = \"parallel\", take_over_after = {after}, tolerance = {{ flow = 100.0 }}, share = {{ valve = \"half\" }} }}\n\
         [[plant]]\nname = \"pipe\"\ncontroller = \"valve\"\nladder = \"pipe.st\"\n"
    );
    let program = format!(
        "PROGRAM valve\n VAR_INPUT flow : REAL; END_VAR\n VAR_OUTPUT valve : REAL; END_VAR\n {body}\n IF flow < 0.0 THEN valve := 0.0; END_IF;\nEND_PROGRAM\n"
    );
    let pipe = "PROGRAM pipe\n VAR_INPUT valve : REAL; END_VAR\n VAR_OUTPUT flow : REAL; END_VAR\n flow := valve;\nEND_PROGRAM\n";
    let loaded = read("cluster.toml", &text, &mut |name| match name {
        "valve.st" => Ok(program.clone()),
        _ => Ok(pipe.to_owned()),
    });
    let reports = loaded.reports;
    parts(&loaded.cluster.unwrap_or_else(|| panic!("{reports:?}")))
}

/// The flow in each step of the plant, by the cycle, and the run at its end.
fn run(parts: Parts, faults: &[Fault], cycles: u64) -> (Vec<(u64, f32)>, Simulation) {
    let mut simulation = Simulation::new(parts, Network::default(), 1);
    faults.iter().for_each(|fault| simulation.schedule(*fault));
    let mut flows = Vec::new();
    let mut observe = |_, cycle: Option<u64>, _, record: Record<'_>| {
        if let (Some(cycle), Record::Plant(_, field)) = (cycle, record) {
            flows.push((cycle, flow(&field.sensors)));
        }
    };
    simulation.run(0, 300, &mut observe).expect("the cluster gets ready");
    simulation.go_to(cycles, 0.0, &mut observe);
    // Where frames come too late for their cycle, the operator may be asked without need.
    let is_wrong = |it: &&Violation| !matches!(it, Violation::NeedlessQuestion { .. });
    let wrong: Vec<_> = simulation.violations().iter().filter(is_wrong).collect();
    assert!(wrong.is_empty(), "{wrong:?}: {faults:?}");
    (flows, simulation)
}

fn flow(sensors: &Image) -> f32 {
    f32::from_bits((0..32).filter(|bit| sensors.get(*bit)).map(|bit| 1 << bit).sum())
}

fn fault(at_cycle: u64, phase: f64, member: Member, action: Action) -> Fault {
    Fault { at_cycle, phase, member, action }
}

/// Cycles with less than the whole from a cycle on.
fn lacking(flows: &[(u64, f32)], from: u64, to: u64) -> usize {
    flows.iter().filter(|(cycle, flow)| (from..to).contains(cycle) && *flow < OPEN).count()
}

/// Nothing fails: both modules drive half, from a bounded time after the start on.
#[test]
fn two_halves_are_the_whole() {
    for after in 1..=3 {
        let (flows, _) = run(cell(after, STEADY), &[], 300);
        let last = flows.iter().rposition(|(_, flow)| *flow != OPEN).map_or(0, |at| flows[at].0);
        assert!(last < u64::from(3 * after + 11), "{after}: {last}");
    }
}

/// At each tenth of a cycle either remote I/O fails and returns: the actuator gets half at least and never more than the whole, and the whole after a bounded
/// time.
#[test]
fn one_that_fails_leaves_half_and_then_the_whole() {
    let mut longest = [0; 3];
    for (after, tenth) in (1..=3).flat_map(|after| (0..10).map(move |tenth| (after, tenth))) {
        for lost in [FIRST, TWIN] {
            for (action, end) in
                [(Action::Crash, Action::Restart), (Action::Stop, Action::Continue)]
            {
                let phase = f64::from(tenth) / 10.0;
                let faults = [fault(100, phase, lost, action), fault(250, phase, lost, end)];
                let (flows, simulation) = run(cell(after, STEADY), &faults, 400);
                let what = format!("{after} {phase} {lost:?} {action:?}");
                assert_eq!(
                    simulation.author(PROGRAM),
                    Some(if lost == FIRST { TWIN } else { FIRST })
                );
                let late = flows.iter().filter(|(cycle, _)| *cycle >= 90);
                assert!(late.clone().all(|(_, flow)| (OPEN / 2.0..=OPEN).contains(flow)), "{what}");
                let failed = lacking(&flows, 100, 250);
                assert!(failed > 0 && failed <= 3 * after as usize + 11, "{what}: {failed}");
                let back = lacking(&flows, 250, 400);
                assert!(back <= after as usize + 6, "{what}: {back}");
                longest[after as usize - 1] = longest[after as usize - 1].max(failed);
            }
        }
    }
    assert!(longest.is_sorted(), "{longest:?}");
}

/// The author does not receive the other one, then is not received by it, and then that one is suspended: its module drives what it was sent last for as long
/// as any can, and the author drives half until then.
#[test]
fn the_whole_is_not_driven_before_the_other_module_has_given_up() {
    let cut = |from: Member, to: Member| move |cycle| fault(cycle, 0.5, from, Action::Cut { to });
    for (later, suspended) in (0..6).flat_map(|later| (0..10).map(move |it| (later, it))) {
        let faults = [
            cut(TWIN, FIRST)(100),
            cut(FIRST, TWIN)(100 + later),
            fault(100 + later + suspended, 0.7, TWIN, Action::Stop),
        ];
        let (flows, simulation) = run(cell(1, STEADY), &faults, 200);
        assert_eq!(simulation.author(PROGRAM), Some(FIRST));
        assert_eq!(flows.last().map(|(_, flow)| *flow), Some(OPEN), "{later} {suspended}");
    }
}

/// Two of all that can fail at a time, at random phases, while the number changes in every scan: never more than the whole, and the whole in the end.
#[test]
fn two_failures_never_add_up_to_more_than_the_whole() {
    let mut random = understudy_testing::random::Dice::new(36);
    for _ in 0..300 {
        let after = 1 + random.below(3) as u32;
        let mut faults = Vec::new();
        for (start, length) in [(100, 150), (300, 300)] {
            for _ in 0..2 {
                let (begin, phase) =
                    (start + random.below(30) as u64, random.below(100) as f64 / 100.0);
                let end = begin + 1 + random.below(length) as u64;
                let [member, other] =
                    [0; 2].map(|_| random.pick(&[FIRST, TWIN, CONTROLLER, UNDERSTUDY]));
                let by = Duration::from_millis(random.below(60) as u64);
                let (begins, ends) = random.pick(&[
                    (Action::Crash, Action::Restart),
                    (Action::Stop, Action::Continue),
                    (Action::Cut { to: other }, Action::Heal { to: other }),
                    (
                        Action::Delay { to: other, by },
                        Action::Delay { to: other, by: Duration::ZERO },
                    ),
                    (Action::Slow { by }, Action::Slow { by: Duration::ZERO }),
                ]);
                faults
                    .extend([fault(begin, phase, member, begins), fault(end, phase, member, ends)]);
            }
        }
        faults.sort_by_key(|fault| fault.at_cycle);
        let (flows, _) = run(cell(after, CHANGING), &faults, 1000);
        assert!(flows.iter().all(|(_, flow)| *flow <= OPEN), "{faults:?}");
    }
}

/// The two do not receive each other, and the stations receive both: they follow the author, so the operator is not asked who that is.
#[test]
fn a_cut_between_the_two_is_no_question() {
    for after in 1..=3 {
        let cuts = [(FIRST, TWIN), (TWIN, FIRST)];
        let cuts = cuts.map(|(member, to)| fault(100, 0.4, member, Action::Cut { to }));
        let (_, simulation) = run(cell(after, STEADY), &cuts, 400);
        assert_eq!(simulation.violations(), [], "{after}");
        assert!(!simulation.asking().contains(PROGRAM), "{after}");
        assert_eq!(simulation.author(PROGRAM), Some(FIRST), "{after}");
    }
}
