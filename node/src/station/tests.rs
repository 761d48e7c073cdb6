//! Role, token and repair of one station, with every other member played by the test.

mod states;

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Input, Machine, Mode, Output, Program, Schedule, Turns};
use understudy_logic::{Circuit, CircuitBuilder};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
    Lineage, Member, Moment, ProgramHash, ProgramId, ProgramSet, Segment, StationId, StationSet,
    Step, Time, Word,
};

use super::Station;
use crate::{Event, Settings};

const PERIOD: Duration = Duration::from_millis(10);
const CYCLE_US: u64 = 10_000;
const CONTROLLERS: usize = 2;
const UNDERSTUDY: u8 = 2;

/// What another member sends.
#[derive(Debug, Clone, Copy)]
enum Sent {
    /// A station starts the cycle.
    Sync(u8),
    /// A remote I/O sends its sample; its history starts in the cycle that is given.
    Sample(u8, u64),
    /// A controller publishes its own output, of a history from the first cycle.
    Turn(u8),
    /// A station asks for the state of a program.
    Join(u8, u8),
    /// A station gives the state of a program after the last cycle, whose history starts in the cycle that is given.
    Transfer(u8, u8, u64),
    /// Nothing: the station runs until then.
    Nothing,
}

use Sent::*;

/// A program that counts its input modulo 2.
fn circuit() -> Circuit {
    let mut builder = CircuitBuilder::new("count");
    let u = builder.input("u");
    let (register, x) = builder.register("x", false);
    let next = builder.graph().xor(x, u);
    builder.set_next(register, next);
    builder.output("y", next);
    builder.finish().expect("a circuit")
}

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

fn hash(program: u8) -> ProgramHash {
    ProgramHash(u64::from(program) + 1)
}

/// Every input is 1.
fn input() -> Image {
    Image::from_bits([true])
}

/// L(i) of a history from cycle `born`, before the sample of `cycle`.
fn lineage(program: u8, born: u64, cycle: u64) -> Lineage {
    let genesis = Lineage::genesis(hash(program), moment(born));
    (born..cycle).fold(genesis, |lineage, _| lineage.after(&input()))
}

/// x(i) of a history from cycle `born`, before the sample of `cycle`.
fn state_before(born: u64, cycle: u64) -> Image {
    Image::from_bits([(cycle - born) % 2 == 1])
}

fn settings(rank: u8, shadow_cycles: u32, turns: Turns) -> Settings {
    let agreement = Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, CONTROLLERS, 1, 1)
            .expect("within the bounds")
            .with_turns(turns),
        mode: Mode::Full,
        history: 2,
        flag_after: 2,
        shadow_cycles,
        listen_cycles: 2,
    };
    let programs = (0..CONTROLLERS as u8)
        .map(|program| Program { hash: hash(program), executable: (&circuit()).into() });
    Settings {
        station: StationId(rank),
        agreement: Arc::new(agreement),
        programs: programs.collect(),
        generated: None,
        founds: Moment { epoch: Epoch(9), ..Moment::default() },
    }
}

/// What is sent after the samples before that of `cycle`, to the station of rank `to`, and its sender.
fn sent(what: Sent, cycle: u64, to: u8) -> Option<(Member, Body)> {
    let station = |rank| Member::Station(StationId(rank));
    Some(match what {
        Nothing => return None,
        Sync(rank) => (station(rank), Body::Sync),
        Sample(program, born) => {
            let oldest = cycle.saturating_sub(1).max(born);
            let after = lineage(program, born, cycle + 1);
            let sample = understudy_wire::Sample {
                born: moment(born),
                base: lineage(program, born, oldest),
                before: lineage(program, born, cycle),
                after,
                history: (oldest..=cycle).map(|_| Step::of(input())).collect(),
                applied: None,
                excluded: StationSet::EMPTY,
                gone: StationSet::EMPTY,
                drives: true,
                writes: Default::default(),
                pulses: Default::default(),
                unforced: None,
                version: None,
            };
            (Member::RemoteIo(ProgramId(program)), Body::Sample(sample))
        }
        Turn(rank) => {
            let program = ProgramId(rank);
            let state = state_before(1, cycle);
            let holding = Holding {
                program,
                born: moment(1),
                lineage: lineage(rank, 1, cycle + 1),
                stepped: moment(cycle),
                digest: Digest::of(&state),
                version: None,
            };
            let word =
                Word { mask: ProgramSet::only(program), sum: Image::from_bits([!state.get(0)]) };
            let turn = understudy_wire::Turn {
                heard: StationSet::EMPTY,
                holdings: [holding].into_iter().collect(),
                words: [word].into_iter().collect(),
                recalled: Vec::new(),
                lacks: ProgramSet::EMPTY,
                relayed: Vec::new(),
            };
            (station(rank), Body::Turn(turn))
        }
        Join(rank, program) => {
            let join = understudy_wire::Join {
                retained: Default::default(),
                wants: ProgramSet::only(ProgramId(program)),
                holdings: Default::default(),
                recalled: Vec::new(),
                lacks: ProgramSet::EMPTY,
                partial: Vec::new(),
            };
            (station(rank), Body::Join(join))
        }
        Transfer(rank, program, born) => {
            let transfer = understudy_wire::Transfer {
                to: StationId(to),
                program: ProgramId(program),
                hash: hash(program),
                born: moment(born),
                lineage: lineage(program, born, cycle),
                stepped: moment(cycle - 1),
                digest: Digest::of(&state_before(born, cycle - 1)),
                state: Segment::single(&state_before(born, cycle)),
            };
            (station(rank), Body::Transfer(transfer))
        }
    })
}

fn frame(moment: Moment, (sender, body): (Member, Body)) -> Arc<Frame> {
    let header = Header {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        prepared: None,
        moment,
        sender,
        alone: false,
    };
    Arc::new(Frame { header, body })
}

fn describe(output: Output<Event>) -> Option<String> {
    Some(match output {
        Output::Send(frame) => match &frame.body {
            Body::Sync => format!("sends Sync of cycle {}", frame.header.moment.cycle.0),
            Body::Turn(turn) => {
                let words = turn.words.iter();
                let words = words.map(|word| format!(" {:?} = {}", word.mask, word.sum));
                format!("publishes{}", words.collect::<String>())
            }
            Body::Join(join) => format!("joins, wants {:?}", join.wants),
            Body::Transfer(transfer) => {
                let (program, state) = (transfer.program.0, &transfer.state.part);
                format!("gives {state} of program {program} to {}", transfer.to.0)
            }
            _ => return None,
        },
        Output::Report(Event::BecameCycleMaster { .. }) => "becomes cycle master".to_owned(),
        Output::Report(Event::Flagged { station, .. }) => format!("flags {}", station.0),
        Output::Report(Event::Cleared { station, .. }) => format!("clears {}", station.0),
        Output::Report(Event::Adopted { program, from, .. }) => match from {
            Some(from) => format!("adopts program {} from {}", program.0, from.0),
            None => format!("starts program {} from its initial state", program.0),
        },
        Output::Report(Event::Synchronised { program, .. }) => {
            format!("is synchronised with program {}", program.0)
        }
        _ => return None,
    })
}

/// What the station of `rank` does, with the time in microseconds, where the others send `script`: (cycle, microseconds
/// after its start, what is sent).
fn check(rank: u8, script: &[(u64, u64, Sent)]) -> String {
    check_turns(Turns::Token, rank, script)
}

fn check_turns(turns: Turns, rank: u8, script: &[(u64, u64, Sent)]) -> String {
    let mut station = Station::new(Time(0), settings(rank, 1, turns));
    let mut text = String::new();
    let mut drain = |station: &mut Station, now: Time| {
        while let Some(output) = station.poll_output() {
            if let Some(line) = describe(output) {
                let _ = writeln!(text, "{:>6} {line}", now.0 / 1000);
            }
        }
    };
    for &(cycle, after_us, what) in script {
        let now = Time((cycle * CYCLE_US + after_us) * 1000);
        while station.wakeup() <= now {
            let due = station.wakeup();
            station.handle_input(due, Input::Wakeup);
            drain(&mut station, due);
        }
        if let Some(sent) = sent(what, cycle, rank) {
            let frame = frame(moment(cycle), sent);
            station.handle_input(now, Input::Frame(&frame));
            drain(&mut station, now);
        }
    }
    text
}

/// A station that receives no other one starts the cycles itself, after a guard time for each rank before it.
#[test]
fn each_rank_waits_a_guard_time_longer() {
    let all =
        (0..=UNDERSTUDY).map(|rank| format!("rank {rank}\n{}", check(rank, &[(3, 0, Nothing)])));
    insta::assert_snapshot!(all.collect::<String>());
}

/// The next rank takes over when the cycle master is not received.
#[test]
fn the_next_rank_takes_over() {
    let script = [
        (1, 0, Sync(0)),
        (1, 100, Sample(1, 1)),
        (1, 200, Turn(0)),
        (2, 0, Sync(0)),
        (2, 100, Sample(1, 1)),
        (2, 200, Turn(0)),
        (6, 0, Nothing),
    ];
    insta::assert_snapshot!(check(1, &script));
}

/// A controller publishes after its predecessor, in its own slot where that is not received, and at the last call where
/// its sample is not received.
#[test]
fn a_controller_publishes_after_its_predecessor_or_in_its_slot() {
    let script = [
        (1, 0, Sync(0)),
        (1, 100, Sample(1, 1)),
        (1, 200, Turn(0)),
        (2, 0, Sync(0)),
        (2, 100, Sample(1, 1)),
        (2, 900, Turn(0)),
        (3, 0, Sync(0)),
        (3, 100, Sample(1, 1)),
        (4, 0, Sync(0)),
        (4, 100, Turn(0)),
        (4, 9_000, Nothing),
    ];
    insta::assert_snapshot!(check(1, &script));
}

/// An understudy waits for all controllers, and gives each that was not received a parity word of its own.
#[test]
fn an_understudy_publishes_last() {
    let mut script = Vec::new();
    for cycle in 1..=3 {
        script.push((cycle, 0, Sync(0)));
        script.extend([(cycle, 100, Sample(0, 1)), (cycle, 200, Sample(1, 1))]);
        script.push((cycle, 300, Turn(0)));
        if cycle < 3 {
            script.push((cycle, 700, Turn(1)));
        }
    }
    script.push((3, 9_000, Nothing));
    insta::assert_snapshot!(check(UNDERSTUDY, &script));
}

/// With turns in parallel a controller publishes with its sample, once an understudy was received: in the cycle after one without an understudy it
/// waits for its predecessor.
#[test]
fn controllers_do_not_wait_where_turns_are_parallel() {
    let mut script = Vec::new();
    for cycle in 1..=4 {
        script.extend([(cycle, 0, Sync(0)), (cycle, 100, Sample(1, 1)), (cycle, 900, Turn(0))]);
        if cycle != 2 {
            script.push((cycle, 1_000, Turn(UNDERSTUDY)));
        }
    }
    script.push((4, 9_000, Nothing));
    insta::assert_snapshot!(check_turns(Turns::Parallel, 1, &script));
}

/// A station without a state asks for it, adopts it, computes in shadow mode, and then publishes.
#[test]
fn a_station_is_repaired() {
    let script = [
        (1, 0, Sync(0)),
        (2, 0, Sync(0)),
        (3, 0, Sync(0)),
        (4, 0, Sync(0)),
        (5, 0, Sync(0)),
        (6, 0, Sync(0)),
        (7, 0, Sync(0)),
        (7, 100, Sample(1, 1)),
        (8, 0, Sync(0)),
        (8, 100, Sample(1, 1)),
        (8, 7_500, Transfer(UNDERSTUDY, 1, 1)),
        (9, 0, Sync(0)),
        (9, 100, Sample(1, 1)),
        (10, 0, Sync(0)),
        (10, 100, Sample(1, 1)),
        (10, 9_000, Nothing),
    ];
    insta::assert_snapshot!(check(1, &script));
}

/// A station gives a state that another one asks for.
#[test]
fn a_state_is_given_to_the_station_that_asks() {
    let script = [
        (1, 0, Sync(0)),
        (1, 100, Sample(1, 1)),
        (1, 7_500, Join(UNDERSTUDY, 1)),
        (1, 7_600, Join(UNDERSTUDY, 1)),
    ];
    insta::assert_snapshot!(check(1, &script));
}
