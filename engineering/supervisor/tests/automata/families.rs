//! Models that come in all sizes.

use understudy_supervisor::{Automaton, Label, State, Transition};

fn automaton(
    name: String,
    states: usize,
    marked: u32,
    transitions: &[(u32, u32, u32)],
) -> Automaton {
    let transitions = transitions.iter().map(|&(source, label, target)| Transition {
        source: State::new(source),
        label: Label::new(label),
        target: State::new(target),
    });
    let marked = (0..states as u32).map(|state| state == marked).collect();
    Automaton::new(name, [], marked, transitions.collect()).expect("deterministic")
}

/// Machines in line and the buffers between them: machine i starts by 2 i + 1 and ends by 2 i; buffers hold `capacity` parts.
pub(crate) fn line(machines: u32, capacity: u32) -> (Vec<Automaton>, Vec<Automaton>) {
    let machine = |number: u32| {
        let (start, end) = (2 * number + 1, 2 * number);
        automaton(format!("M{number}"), 2, 0, &[(0, start, 1), (1, end, 0)])
    };
    let buffer = |number: u32| {
        let (fill, empty) = (2 * number, 2 * number + 3);
        let steps =
            (0..capacity).flat_map(|parts| [(parts, fill, parts + 1), (parts + 1, empty, parts)]);
        automaton(format!("B{number}"), capacity as usize + 1, 0, &steps.collect::<Vec<_>>())
    };
    ((1..=machines).map(machine).collect(), (1..machines).map(buffer).collect())
}

/// Philosophers who take their forks one by one, left or right first, and put both back at once; and the forks.
pub(crate) fn philosophers(count: u32) -> Vec<Automaton> {
    let (release, left, right) = (|i| 6 * i + 1, |i| 6 * i + 3, |i| 6 * i + 5);
    let philosopher = |i: u32| {
        let moves = [
            (0, left(i), 1),
            (0, right(i), 2),
            (1, right(i), 3),
            (2, left(i), 3),
            (3, release(i), 0),
        ];
        automaton(format!("P{i}"), 4, 0, &moves)
    };
    let fork = |i: u32| {
        let neighbour = (i + 1) % count;
        let moves = [
            (0, left(i), 1),
            (0, right(neighbour), 1),
            (1, release(i), 0),
            (1, release(neighbour), 0),
        ];
        automaton(format!("F{i}"), 2, 0, &moves)
    };
    (0..count).flat_map(|i| [philosopher(i), fork(i)]).collect()
}

/// A workshop and what it must keep: machines in line make parts of several kinds, fail, and are repaired. Between two of them there is a
/// buffer of `capacity` parts for each kind, and machines share tools, one for every two kinds.
pub(crate) fn workshop(
    machines: u32,
    kinds: u32,
    capacity: u32,
) -> (Vec<Automaton>, Vec<Automaton>) {
    let events = 2 * (2 * kinds + 1);
    let start = |machine: u32, kind: u32| machine * events + 4 * kind + 1;
    let finish = |machine: u32, kind: u32| machine * events + 4 * kind + 2;
    let fail = |machine: u32, kind: u32| machine * events + 4 * kind + 4;
    let repair = |machine: u32| machine * events + 3;
    let machine = |number: u32| {
        let down = kinds + 1;
        let makes = (0..kinds).flat_map(|kind| {
            [
                (0, start(number, kind), kind + 1),
                (kind + 1, finish(number, kind), 0),
                (kind + 1, fail(number, kind), down),
            ]
        });
        let moves: Vec<_> = makes.chain([(down, repair(number), 0)]).collect();
        automaton(format!("M{number}"), down as usize + 1, 0, &moves)
    };
    let buffer = |number: u32, kind: u32| {
        let (fill, empty) = (finish(number, kind), start(number + 1, kind));
        let steps =
            (0..capacity).flat_map(|parts| [(parts, fill, parts + 1), (parts + 1, empty, parts)]);
        automaton(format!("B{number}_{kind}"), capacity as usize + 1, 0, &steps.collect::<Vec<_>>())
    };
    let tool = |tool: u32| {
        let users = (0..machines).flat_map(|machine| (0..kinds).map(move |kind| (machine, kind)));
        let users = users.filter(|(machine, kind)| (machine + kind) / 2 == tool);
        let steps = users.flat_map(|(machine, kind)| {
            [
                (0, start(machine, kind), 1),
                (1, finish(machine, kind), 0),
                (1, fail(machine, kind), 0),
            ]
        });
        let steps: Vec<_> = steps.collect();
        automaton(format!("T{tool}"), 2, 0, &steps)
    };
    let pairs = (0..machines - 1).flat_map(|number| (0..kinds).map(move |kind| (number, kind)));
    let buffers = pairs.map(|(number, kind)| buffer(number, kind));
    let tools = (0..(machines + kinds) / 2).map(tool);
    ((0..machines).map(machine).collect(), buffers.chain(tools).collect())
}
