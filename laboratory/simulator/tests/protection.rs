//! Reports of protection by a remote I/O that has started: it is never silent about it, and a normal start raises no alarm.

mod press_cell;

use understudy_cycle::Mode;
use understudy_remote_io::Event;
use understudy_simulator::{Action, Fault, Network, Record, Simulation};
use understudy_wire::{Member, ProgramId, StationId};

const PROGRAM: ProgramId = ProgramId(0);
const REMOTE_IO: Member = Member::RemoteIo(PROGRAM);
/// The controllers of two programs, and the understudy.
const STATIONS: u8 = 3;
const UNDERSTUDY: u8 = 2;

struct Bench {
    simulation: Simulation,
    cycle: u64,
    /// Reports of the remote I/O, the newest last.
    protected: Vec<bool>,
}

impl Bench {
    fn new() -> Self {
        let parts = press_cell::line(2, Mode::Full, 1);
        let mut simulation = Simulation::new(parts, Network::default(), 1);
        simulation.run(3, 200, &mut |_, _, _, _| ()).expect("it gets ready");
        Self { simulation, cycle: 3, protected: Vec::new() }
    }

    fn pass(&mut self, cycles: u64) {
        self.cycle += cycles;
        let protected = &mut self.protected;
        let mut observe = |_, _, member, record: Record<'_>| {
            let (REMOTE_IO, Record::RemoteIo(event)) = (member, record) else {
                return;
            };
            match event {
                Event::Protected { .. } => protected.push(true),
                Event::Unprotected { .. } => protected.push(false),
                _ => {}
            }
        };
        self.simulation.go_on(self.cycle, &mut observe, &mut || false);
    }

    fn each(&mut self, stations: impl Iterator<Item = u8>, action: Action) {
        for station in stations {
            self.fault(Member::Station(StationId(station)), action);
        }
    }

    fn fault(&mut self, member: Member, action: Action) {
        self.simulation.schedule(Fault { at_cycle: 0, phase: 0.0, member, action });
    }
}

/// What a remote I/O reports first where these stations are alive: nothing where none of them has the program.
fn expected(alive: impl Fn(u8) -> bool) -> Vec<bool> {
    match (alive(0), alive(UNDERSTUDY)) {
        (true, true) => vec![true],
        (false, false) => Vec::new(),
        _ => vec![false],
    }
}

#[test]
fn a_remote_io_that_starts_reports_whether_its_program_is_protected() {
    for dead in 0..1_u8 << STATIONS {
        let is_dead = |station: &u8| dead >> station & 1 == 1;
        let mut bench = Bench::new();
        bench.each((0..STATIONS).filter(is_dead), Action::Crash);
        bench.pass(30);
        bench.fault(REMOTE_IO, Action::Crash);
        bench.pass(20);
        bench.protected.clear();
        bench.fault(REMOTE_IO, Action::Restart);
        bench.pass(120);
        assert_eq!(bench.protected, expected(|it| !is_dead(&it)), "dead: {dead:03b}");
    }
}

/// The whole cluster starts again, one station later than the others.
#[test]
fn a_cluster_that_starts_cold_raises_no_alarm_while_its_stations_start() {
    for late in (0..STATIONS).flat_map(|station| [0, 1, 20, 60, 120, 300].map(|by| (station, by))) {
        let (station, by) = late;
        let mut bench = Bench::new();
        for program in [PROGRAM, ProgramId(1)] {
            bench.fault(Member::RemoteIo(program), Action::Crash);
        }
        bench.each(0..STATIONS, Action::Crash);
        bench.pass(20);
        bench.protected.clear();
        bench.each((0..STATIONS).filter(|it| *it != station), Action::Restart);
        for program in [PROGRAM, ProgramId(1)] {
            bench.fault(Member::RemoteIo(program), Action::Restart);
        }
        bench.pass(by);
        bench.each(std::iter::once(station), Action::Restart);
        bench.pass(300);
        assert_eq!(bench.protected, [true], "{late:?}");
    }
}

/// A station that never starts is reported.
#[test]
fn a_cluster_that_starts_cold_without_a_station_reports_it() {
    for dead in 0..STATIONS {
        let mut bench = Bench::new();
        bench.fault(REMOTE_IO, Action::Crash);
        bench.each(0..STATIONS, Action::Crash);
        bench.pass(20);
        bench.protected.clear();
        bench.each((0..STATIONS).filter(|it| *it != dead), Action::Restart);
        bench.fault(REMOTE_IO, Action::Restart);
        bench.pass(800);
        assert_eq!(bench.protected, expected(|it| it != dead), "{dead}");
    }
}
