//! A hybrid controller of our own for an assembly cell: its net, its reduced supervisor, and the ladder of both together.
//!
//! A robot puts bodies into a buffer for two; a feeder brings lids, one at a time; an assembler takes a body and a lid. The
//! steps are those of Uzam and Gelen, section 3.

use std::time::Duration;

use understudy_ladder::{ContactKind, Element, Interpreter, check, print};
use understudy_supervisor::ladder::avalanche_events;
use understudy_supervisor::operations::{condat, supreduce, sync};
use understudy_supervisor::petri::{
    HybridLadder, Net, draw_net_dot, draw_net_svg, hybrid_net, list_arcs, list_control, read_net,
    to_ladder,
};
use understudy_supervisor::proof::{
    HybridDeviation, HybridVerdict, ProofSettings, hybrid_findings, prove_hybrid,
};
use understudy_supervisor::{Automaton, Bounds, Event, Label, State, read_model, synthesise};

const DONE: u32 = 30;

const NET: &str = include_str!("../../../examples/assembly-cell/net.toml");
const MODEL: &str = include_str!("../../../examples/assembly-cell/model.toml");

struct Cell {
    net: Net,
    plant: Automaton,
    specifications: Vec<Automaton>,
    reduced: Automaton,
    ladder: HybridLadder,
}

fn cell() -> Cell {
    let net = read_net(NET).file.expect("a net").net;
    let exploration = net.explore(1_000).expect("bounded");
    assert!(exploration.bounds().iter().all(|&bound| bound == 1));
    let model = read_model(MODEL, |_| Ok(NET.to_owned()));
    let model = model.model.expect("a model");
    let plant = sync(&model.plants(), Bounds::default()).expect("small");
    let made = synthesise(&[&plant], &model.specifications(), Bounds::default());
    let made = made.expect("small").supervisor;
    let reduced = supreduce(&plant, &made, Bounds::default()).expect("small");
    let reduced = reduced.with_name("keeper");
    let ladder = to_ladder(&net, std::slice::from_ref(&reduced), 1_000).expect("a ladder");
    Cell { net, plant, specifications: model.specifications, reduced, ladder }
}

fn verdict(cell: &Cell) -> HybridVerdict {
    let supervisors = std::slice::from_ref(&cell.reduced);
    prove_hybrid(&cell.net, supervisors, &cell.ladder, ProofSettings::default()).expect("a verdict")
}

#[test]
fn the_ladder_is_proved() {
    let HybridVerdict::Proved(proof) = verdict(&cell()) else {
        panic!("the ladder is refuted");
    };
    assert_eq!(proof.markings, 8);
    assert_eq!(proof.never_fired, Vec::<String>::new());
}

/// A part of a rung, in short.
fn shown(element: &Element) -> String {
    match element {
        Element::Contact(contact) => format!("{:?} {}", contact.kind, contact.operand),
        _ => "block".to_owned(),
    }
}

/// Whatever coil or element is taken from a rung, the proof finds it, unless the ladder can do without: tokens are fresh to no
/// rung above the one that gives them, and where `placed` stands in the keeper, no rung below uses its bit once more.
#[test]
fn what_is_missing_from_the_ladder_is_found() {
    let whole = cell();
    let supervisors = std::slice::from_ref(&whole.reduced);
    let mut unnoticed = Vec::new();
    for (number, rung) in whole.ladder.program.rungs.iter().enumerate() {
        let title = rung.title.clone().unwrap_or_default();
        for part in 0..rung.coils.len() + rung.network.len() {
            let mut damaged = whole.ladder.clone();
            let rung = &mut damaged.program.rungs[number];
            let what = match part.checked_sub(rung.coils.len()) {
                None => format!("({})", rung.coils.remove(part).target),
                Some(place) => shown(&rung.network.remove(place)),
            };
            let settings = ProofSettings::default();
            // A rung without its only coil is none.
            let found = prove_hybrid(&whole.net, supervisors, &damaged, settings);
            if let Ok(HybridVerdict::Proved(_)) = found {
                unnoticed.push(format!("{title}: {what}"));
            }
        }
    }
    insta::assert_snapshot!(unnoticed.join("\n"), @r#"
    delay of done: NormallyClosed done.fired
    placed: NormallyClosed robot_busy.fresh
    keeper: 1 -- placed --> 3: (placed.keeper)
    keeper: 4 -- placed --> 5: (placed.keeper)
    keeper: 4 -- placed --> 5: NormallyOpen keeper.q4
    fed: NormallyClosed feeder_busy.fresh
    done: (done.fired)
    done: NormallyOpen assembler_busy
    done: NormallyClosed assembler_busy.fresh
    pick: (robot_busy.fresh)
    feed: (feeder_busy.fresh)
    reset events that moved no supervisor: (placed.keeper)
    "#);
}

/// A supervisor that forbids what the net does by itself is none.
#[test]
fn an_uncontrollable_supervisor_is_found() {
    let mut cell = cell();
    let steps = cell.reduced.transitions();
    let kept: Vec<_> = steps.filter(|step| step.label != Label::new(DONE)).collect();
    let marked = cell.reduced.states().map(|_| true).collect();
    let events = cell.reduced.alphabet().events().to_vec();
    cell.reduced = Automaton::new("keeper", events, marked, kept).expect("deterministic");
    let supervisors = std::slice::from_ref(&cell.reduced);
    cell.ladder = to_ladder(&cell.net, supervisors, 1_000).expect("a ladder");
    let HybridVerdict::Refuted(found) = verdict(&cell) else {
        panic!("it is proved");
    };
    assert!(matches!(found.deviation, HybridDeviation::Uncontrollable { .. }));
    insta::assert_snapshot!(found.to_string(), @r#"
scan 1: events pick feed, outputs robot_runs feeder_runs, in robot_busy feeder_busy assembler_idle keeper:0
scan 2: events placed fed pick assemble, outputs robot_runs assembler_runs, in robot_busy feeder_idle assembler_busy keeper:0
scan 3: events feed, outputs robot_runs feeder_runs assembler_runs, in robot_busy feeder_busy assembler_busy keeper:0
scan 4: events done, outputs robot_runs feeder_runs, in robot_busy feeder_busy assembler_idle keeper:0
keeper would have to forbid done, and cannot
"#);
}

#[test]
fn the_ladder_is_that_of_the_example() {
    let cell = cell();
    let data = condat(&cell.plant, &cell.reduced, Bounds::default()).expect("small");
    let avalanche: Vec<u32> =
        avalanche_events(&cell.reduced).iter().map(|label| label.number()).collect();
    insta::assert_snapshot!(format!(
        "plant {} states; reduced supervisor {} states, {} transitions, {} states with disablement; avalanche {avalanche:?}",
        cell.plant.state_count(),
        cell.reduced.state_count(),
        cell.reduced.transition_count(),
        data.states_with_disablement(),
    ), @"plant 8 states; reduced supervisor 6 states, 22 transitions, 6 states with disablement; avalanche [10]");
    assert_eq!(
        print(&cell.ladder.program),
        include_str!("../../../examples/assembly-cell/cell.ladder"),
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
    let Cell { net, specifications, reduced, ladder, .. } = cell();
    let mut run = Interpreter::new(&ladder.program, Duration::from_millis(10)).expect("a ladder");
    let mut marking = net.initial();
    let mut keeper = State::INITIAL;
    let mut stores = vec![State::INITIAL; specifications.len()];
    let mut assembled = 0;
    let mut seed = 1_u32;
    for _ in 0..20_000 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let inputs: Vec<bool> =
            (0..ladder.program.inputs.len()).map(|bit| seed >> (16 + bit) & 1 == 1).collect();
        run.scan(&inputs);
        for (step, bit) in net.transitions().iter().zip(&ladder.fires) {
            if run.value(bit) != Some(true) {
                continue;
            }
            marking = net.fire(&marking, step).expect("the net can fire what fires");
            let label = step.label.expect("every transition is an event");
            keeper = reduced.step(keeper, label).expect("the supervisor allows what fires");
            for (store, specification) in stores.iter_mut().zip(&specifications) {
                if specification.alphabet().contains(label) {
                    *store =
                        specification.step(*store, label).expect("no store runs over or empty");
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

/// What is known before the ladder is made.
#[test]
fn findings_come_before_the_ladder() {
    let cell = cell();
    let supervisors = std::slice::from_ref(&cell.reduced);
    let found = hybrid_findings(&cell.net, supervisors, 1_000).expect("bounded");
    let said: Vec<String> =
        found.iter().map(|finding| format!("{} {}", finding.code(), finding.message)).collect();
    insta::assert_snapshot!(said.join("\n"), @r#"
U0885 a PLC that generates every command at once never comes to rest in a marked state from 30 of 30 states on, such as 0
U0886 in `keeper` `placed` stands on successive transitions; its bit is reset by the rung that uses it
"#);
    assert_eq!(hybrid_findings(&cell.net, &[], 1_000), Ok(Vec::new()));
}

/// Figures 16 and 17 and Table 2: the auto-net, the net that it controls, and its control data as inhibitor arcs. The ladder has a
/// closed contact for each of these arcs and for no other state.
#[test]
fn the_controlled_net_has_the_arcs_of_the_ladder() {
    let cell = cell();
    let supervisors = std::slice::from_ref(&cell.reduced);
    let events = read_net(NET).file.expect("a net").events;
    let auto_net = hybrid_net(None, supervisors, &events).expect("an auto-net");
    assert_eq!((auto_net.places().len(), auto_net.transitions().len()), (6, 22));
    let both = hybrid_net(Some(&cell.net), supervisors, &events).expect("a net");
    assert_eq!((both.places().len(), both.transitions().len()), (12, 28));
    for (transition, of_plant) in both.transitions().iter().zip(cell.net.transitions()) {
        let inhibiting = transition.inhibitors.iter().map(|arc| arc.place - 6);
        let inhibiting: Vec<usize> = inhibiting.collect();
        let rungs = &cell.ladder.program.rungs;
        let rung = rungs.iter().find(|rung| rung.title.as_ref() == Some(&of_plant.name));
        let closed = rung.expect("a rung").network.iter().filter_map(|element| match element {
            Element::Contact(contact) if contact.kind == ContactKind::NormallyClosed => {
                cell.ladder.states[0].iter().position(|bit| *bit == contact.operand)
            }
            _ => None,
        });
        assert_eq!(inhibiting, closed.collect::<Vec<_>>(), "{}", transition.name);
    }
    assert!(draw_net_dot(&both).contains("arrowhead=odot"));
    let svg = draw_net_svg(&both).expect("small");
    assert_eq!(svg.matches("url(#circle)").count(), 9);
    insta::assert_snapshot!(format!("{}{}", list_arcs(&both), list_control(&both, supervisors)));
    let stranger =
        Automaton::new("stranger", [Event::unnamed(Label::new(99))], vec![true], Vec::new());
    let stranger = [stranger.expect("an automaton")];
    assert_eq!(
        hybrid_net(Some(&cell.net), &stranger, &events).expect_err("unknown").code(),
        "U0898"
    );
}
