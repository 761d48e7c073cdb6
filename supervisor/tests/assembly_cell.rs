//! A hybrid controller of our own for an assembly cell: its net, its reduced supervisor, and the ladder of both together.
//!
//! A robot puts bodies into a buffer for two; a feeder brings lids, one at a time; an assembler takes a body and a lid. The
//! steps are those of Uzam and Gelen, section 3.

use std::time::Duration;

use understudy_ladder::{Interpreter, Name, check, print};
use understudy_supervisor::ladder::{When, avalanche_events};
use understudy_supervisor::operations::{condat, supreduce, sync};
use understudy_supervisor::petri::{
    Action, Arc, Condition, HybridLadder, Net, NetTransition, Place, buffers, reduce, to_ladder,
};
use understudy_supervisor::{Automaton, Bounds, Event, Label, State, Transition, synthesise};

const PICK: u32 = 11;
const PLACED: u32 = 10;
const FEED: u32 = 21;
const FED: u32 = 20;
const ASSEMBLE: u32 = 31;
const DONE: u32 = 30;

/// Steps 1 and 2: three machines, each idle or busy.
fn net() -> Net {
    let place = |name: &str, initial: u32, action: Option<&str>| Place {
        name: name.into(),
        initial,
        actions: action
            .map(|signal| Action::Level(Name::from(signal)))
            .into_iter()
            .collect(),
        ..Place::default()
    };
    let places = vec![
        place("robot_idle", 1, None),
        place("robot_busy", 0, Some("robot_runs")),
        place("feeder_idle", 1, None),
        place("feeder_busy", 0, Some("feeder_runs")),
        place("assembler_idle", 1, None),
        place("assembler_busy", 0, Some("assembler_runs")),
    ];
    let step =
        |name: &str, label: u32, from: usize, to: usize, condition: Condition| NetTransition {
            name: name.into(),
            label: Some(Label::new(label)),
            takes: vec![Arc {
                place: from,
                weight: 1,
            }],
            gives: vec![Arc {
                place: to,
                weight: 1,
            }],
            condition,
            ..NetTransition::default()
        };
    let signal = |name: &str, when| Condition::Signal(Name::from(name), when);
    let transitions = vec![
        step("placed", PLACED, 1, 0, signal("body_placed", When::Rising)),
        step("fed", FED, 3, 2, signal("lid_there", When::Rising)),
        NetTransition {
            delay: Some(Duration::from_millis(30)),
            ..step("done", DONE, 5, 4, Condition::Always)
        },
        step("pick", PICK, 0, 1, signal("body_present", When::High)),
        step("feed", FEED, 2, 3, Condition::Always),
        step("assemble", ASSEMBLE, 4, 5, Condition::Always),
    ];
    Net::new("assembly_cell", places, transitions).expect("a net")
}

/// A store that `fills` fill and `empties` empties.
fn store(name: &str, fills: u32, empties: u32, room: u32) -> Automaton {
    let steps = (0..room).flat_map(|held| {
        let (source, target) = (State::new(held), State::new(held + 1));
        let label = Label::new;
        [
            Transition {
                source,
                label: label(fills),
                target,
            },
            Transition {
                source: target,
                label: label(empties),
                target: source,
            },
        ]
    });
    let marked = (0..=room).map(|held| held == 0).collect();
    Automaton::new(name, [], marked, steps.collect()).expect("deterministic")
}

struct Cell {
    net: Net,
    plant: Automaton,
    specifications: Vec<Automaton>,
    reduced: Automaton,
    ladder: HybridLadder,
}

fn cell() -> Cell {
    let (net, _) = reduce(&net());
    let exploration = net.explore(1_000).expect("bounded");
    assert!(exploration.bounds().iter().all(|&bound| bound == 1));
    let parts = buffers(&net, &exploration.bounds()).expect("an event each");
    let plant = sync(&parts.iter().collect::<Vec<_>>(), Bounds::default()).expect("small");
    let specifications = vec![
        store("bodies", PLACED, ASSEMBLE, 2),
        store("lids", FED, ASSEMBLE, 1),
    ];
    let made = synthesise(
        &[&plant],
        &specifications.iter().collect::<Vec<_>>(),
        Bounds::default(),
    )
    .expect("small")
    .supervisor;
    let reduced = supreduce(&plant, &made, Bounds::default())
        .expect("small")
        .with_name("keeper");
    let events: Vec<Event> = net
        .transitions()
        .iter()
        .filter_map(|step| {
            Some(Event {
                label: step.label?,
                name: step.name.clone(),
            })
        })
        .collect();
    let reduced = reduced.with_event_names(&understudy_supervisor::Alphabet::new(events));
    let ladder = to_ladder(&net, std::slice::from_ref(&reduced), 1_000).expect("a ladder");
    Cell {
        net,
        plant,
        specifications,
        reduced,
        ladder,
    }
}

#[test]
fn the_ladder_is_that_of_the_example() {
    let cell = cell();
    let data = condat(&cell.plant, &cell.reduced, Bounds::default()).expect("small");
    let avalanche: Vec<u32> = avalanche_events(&cell.reduced)
        .iter()
        .map(|label| label.number())
        .collect();
    insta::assert_snapshot!(format!(
        "plant {} states; reduced supervisor {} states, {} transitions, {} states with disablement; avalanche {avalanche:?}",
        cell.plant.state_count(),
        cell.reduced.state_count(),
        cell.reduced.transition_count(),
        data.states_with_disablement(),
    ), @"plant 8 states; reduced supervisor 6 states, 22 transitions, 6 states with disablement; avalanche [10]");
    assert_eq!(
        print(&cell.ladder.program),
        include_str!("../../examples/assembly-cell/cell.ladder"),
        "the ladder in examples/assembly-cell is another one"
    );
    // What fires is shown by a bit, whether a rung reads it or not.
    let found = check(&cell.ladder.program);
    assert!(found.iter().all(|found| found.code == "U0151"), "{found:?}");
}

/// All samples of three inputs, in an order that a small generator makes: every run of the ladder is one of the plant under
/// the specifications, the supervisor's bits are where its automaton is, and the cell goes on.
#[test]
fn the_ladder_keeps_the_specifications_and_goes_on() {
    let Cell {
        net,
        specifications,
        reduced,
        ladder,
        ..
    } = cell();
    let mut run = Interpreter::new(&ladder.program, Duration::from_millis(10)).expect("a ladder");
    let mut marking = net.initial();
    let mut keeper = State::INITIAL;
    let mut stores = vec![State::INITIAL; specifications.len()];
    let mut assembled = 0;
    let mut seed = 1_u32;
    for _ in 0..20_000 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let inputs: Vec<bool> = (0..ladder.program.inputs.len())
            .map(|bit| seed >> (16 + bit) & 1 == 1)
            .collect();
        run.scan(&inputs);
        for (step, bit) in net.transitions().iter().zip(&ladder.fires) {
            if run.value(bit) != Some(true) {
                continue;
            }
            marking = net
                .fire(&marking, step)
                .expect("the net can fire what fires");
            let label = step.label.expect("every transition is an event");
            keeper = reduced
                .step(keeper, label)
                .expect("the supervisor allows what fires");
            for (store, specification) in stores.iter_mut().zip(&specifications) {
                if specification.alphabet().contains(label) {
                    *store = specification
                        .step(*store, label)
                        .expect("no store runs over or empty");
                }
            }
            assembled += u32::from(label == Label::new(DONE));
        }
        for (state, bit) in reduced.states().zip(&ladder.states[0]) {
            assert_eq!(run.value(bit), Some(state == keeper), "{bit}");
        }
        for (tokens, bits) in marking.iter().zip(&ladder.places) {
            assert_eq!(run.value(&bits[0]), Some(*tokens > 0));
        }
    }
    assert!(assembled > 500, "{assembled}");
}
