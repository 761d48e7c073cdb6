//! Places of random networks and charts: no parts overlap, no wire crosses a part, and nothing is left out.

use understudy_diagram::blocks::{Coil, Contacts, Input, Kind, Network, Output};
use understudy_diagram::chart::{Chart, Part, Step, Transition};
use understudy_diagram::{Place, Point, blocks, chart};
use understudy_testing::random::Dice;

/// A block that is fed by values and blocks, and its place.
fn block(network: &mut Network, dice: &mut Dice, depth: usize) -> usize {
    let mut inputs = Vec::new();
    for at in 0..1 + dice.below(4) {
        let from = match dice.below(4) {
            0 => None,
            1 if depth > 0 => {
                let source = block(network, dice, depth - 1);
                let outputs = network.objects[source].outputs.len();
                let used = network.objects.iter().flat_map(|object| &object.inputs);
                let used: Vec<_> = used.filter_map(|input| input.from).collect();
                let mut free = (0..outputs).map(|output| (source, output));
                free.find(|output| !used.contains(output))
            }
            _ => Some((network.value("v".repeat(1 + dice.below(12))), 0)),
        };
        inputs.push(Input { name: format!("IN{at}"), negated: dice.below(4) == 0, from });
    }
    let outputs = (0..1 + dice.below(3)).map(|at| Output {
        name: format!("Q{at}"),
        value: (dice.below(2) == 0).then(|| "12.5".to_owned()),
    });
    let outputs: Vec<Output> = outputs.collect();
    let count = outputs.len();
    let instance = (dice.below(2) == 0).then(|| "instance".to_owned());
    let of = "TYPE".to_owned();
    let object = network.add(Kind::Block { of, instance }, inputs, outputs);
    for output in 1..count {
        if dice.below(2) == 0 {
            network.target("target", (object, output));
        }
    }
    object
}

/// Contacts in series and in parallel; all branches begin at an input of `inputs`, or all at the rail.
fn contacts(dice: &mut Dice, depth: usize, is_fed: bool, inputs: &mut usize) -> Contacts {
    let several = |dice: &mut Dice, fed: [bool; 2], inputs: &mut usize| {
        let count = 2 + dice.below(2);
        let all = (0..count).map(|at| contacts(dice, depth - 1, fed[at.min(1)], inputs));
        all.collect::<Vec<_>>()
    };
    match dice.below(if depth == 0 { 1 } else { 4 }) {
        1 => Contacts::Parallel(several(dice, [is_fed, is_fed], inputs)),
        2 => Contacts::Series(several(dice, [is_fed, false], inputs)),
        _ if is_fed => {
            *inputs += 1;
            Contacts::Power(*inputs - 1)
        }
        3 => Contacts::Series(Vec::new()),
        _ => Contacts::Contact {
            name: "c".repeat(1 + dice.below(12)),
            negated: dice.below(2) == 0,
            value: None,
        },
    }
}

/// Contacts that lead to a coil, some behind blocks.
fn rung(network: &mut Network, dice: &mut Dice) {
    let mut count = 0;
    let is_fed = dice.below(2) == 0;
    // An input alone is no object.
    let first = contacts(dice, 3, is_fed, &mut count);
    let behind = contacts(dice, 1, false, &mut count);
    let contacts = Contacts::Series(vec![first, behind]);
    let inputs =
        (0..count).map(|_| Input { from: Some((block(network, dice, 2), 0)), ..Input::default() });
    let inputs = inputs.collect();
    let outputs = vec![Output::default()];
    let object = network.add(Kind::Contacts(contacts), inputs, outputs);
    network.coil("coil", Coil::Set, (object, 0));
}

/// The horizontal and vertical parts of a wire, as areas without width.
fn parts(points: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    points.windows(2).map(|ends| {
        let (from, to) = (ends[0], ends[1]);
        let least = Point { x: from.x.min(to.x), y: from.y.min(to.y) };
        let most = Point { x: from.x.max(to.x), y: from.y.max(to.y) };
        (least, most)
    })
}

/// Whether a part of a wire goes through the inside of a place.
fn crosses((least, most): (Point, Point), place: &Place) -> bool {
    least.x < place.right()
        && place.x < most.x.max(least.x + 1)
        && least.y < place.bottom()
        && place.y < most.y.max(least.y + 1)
        && !(most.x <= place.x
            || least.x >= place.right()
            || most.y <= place.y
            || least.y >= place.bottom())
}

#[test]
fn parts_of_networks_do_not_overlap_and_wires_do_not_cross() {
    for seed in 0..600 {
        let mut dice = Dice::new(seed);
        let mut network = Network::default();
        if seed % 2 == 0 {
            let root = block(&mut network, &mut dice, 4);
            network.target("result", (root, 0));
        } else {
            rung(&mut network, &mut dice);
        }
        let plan = blocks::lay_out(&network, 20);
        let places: Vec<Place> = network
            .objects
            .iter()
            .zip(&plan.objects)
            .map(|(object, placed)| match &object.kind {
                // The name of an instance is above its block.
                Kind::Block { instance: Some(_), .. } => Place {
                    y: placed.place.y - 18,
                    height: placed.place.height + 18,
                    ..placed.place
                },
                _ => placed.place,
            })
            .collect();
        for (at, place) in places.iter().enumerate() {
            assert!(place.x >= 0 && place.y >= 20, "seed {seed}: {place:?}");
            assert!(place.right() <= plan.right && place.bottom() <= plan.bottom, "seed {seed}");
            for other in &places[..at] {
                assert!(!place.overlaps(other), "seed {seed}: {place:?} {other:?}");
            }
        }
        let connected = network.objects.iter().flat_map(|object| &object.inputs);
        let connected = connected.filter(|input| input.from.is_some()).count();
        assert_eq!(plan.wires.len(), connected);
        for wire in &plan.wires {
            for part in parts(&wire.points) {
                for place in &places {
                    assert!(!crosses(part, place), "seed {seed}: {wire:?} {place:?}");
                }
            }
        }
        for (at, wire) in plan.wires.iter().enumerate() {
            for other in &plan.wires[..at] {
                for one in parts(&wire.points) {
                    for two in parts(&other.points) {
                        let apart = one.1.x < two.0.x
                            || two.1.x < one.0.x
                            || one.1.y < two.0.y
                            || two.1.y < one.0.y;
                        assert!(apart, "seed {seed}: {wire:?} {other:?}");
                    }
                }
            }
        }
    }
}

/// Steps that lead to each other at random, often to several and from several.
fn random_chart(dice: &mut Dice) -> Chart {
    let count = 1 + dice.below(9);
    let steps = (0..count).map(|at| Step {
        name: format!("S{at}"),
        is_initial: at == 0 || dice.below(12) == 0,
        actions: (0..dice.below(3)).map(|at| ("N".to_owned(), format!("action{at}"))).collect(),
        active: None,
    });
    let steps = steps.collect();
    let mut transitions = Vec::new();
    for _ in 0..dice.below(14) {
        let mut some = || {
            let several = if dice.below(4) == 0 { 1 + dice.below(3) } else { 1 };
            let mut all: Vec<usize> = (0..several).map(|_| dice.below(count)).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let (from, to) = (some(), some());
        transitions.push(Transition { condition: "a AND b".to_owned(), from, to, truth: None });
    }
    Chart { steps, transitions }
}

#[test]
fn a_value_of_the_scan_has_room_in_its_box() {
    for value in ["FALSE", "13.051045320505231"] {
        let mut network = Network::default();
        let source = network.value("drain");
        network.objects[source].outputs[0].value = Some(value.to_owned());
        network.target("outlet", (source, 0));
        let plan = blocks::lay_out(&network, 0);
        let needed = 8 * i64::try_from(format!("drain {value}").len()).expect("short");
        assert!(plan.objects[source].place.width >= needed, "{plan:?}");
        assert!(plan.objects[1].place.x >= plan.objects[source].place.right());
    }
}

#[test]
fn every_step_and_transition_of_a_chart_has_one_place_that_nothing_overlaps() {
    for seed in 0..20_000 {
        let chart = random_chart(&mut Dice::new(seed));
        let plan = chart::lay_out(&chart, 20);
        let count = |part: Part| plan.objects.iter().filter(|object| object.part == part).count();
        for step in 0..chart.steps.len() {
            assert_eq!(count(Part::Step(step)), 1, "seed {seed}: {chart:#?}");
        }
        for transition in 0..chart.transitions.len() {
            assert_eq!(count(Part::Transition(transition)), 1, "seed {seed}: {chart:#?}");
        }

        let solid = plan.objects.iter().filter_map(|object| match object.part {
            Part::Step(_) | Part::Actions(_) | Part::Jump(_) => Some(object.place),
            Part::Transition(_) => {
                Some(Place { width: object.place.width + 8 + 7 * 8, ..object.place })
            }
            _ => None,
        });
        let solid: Vec<Place> = solid.collect();
        for (at, place) in solid.iter().enumerate() {
            for other in &solid[..at] {
                assert!(!place.overlaps(other), "seed {seed}: {place:?} {other:?} {chart:#?}");
            }
        }
        for object in &plan.objects {
            for link in &object.inputs {
                for part in parts(&link.points) {
                    for place in &solid {
                        assert!(
                            !crosses(part, place),
                            "seed {seed}: {link:?} {place:?} {chart:#?}"
                        );
                    }
                }
            }
        }
        assert_eq!(meaning(&plan), wanted(&chart), "seed {seed}: {chart:#?} {plan:#?}");
    }
}

/// Which steps each transition leaves and enters, by its place.
type Meaning = Vec<(Vec<usize>, Vec<usize>)>;

fn wanted(chart: &Chart) -> Meaning {
    let transitions = chart.transitions.iter();
    transitions.map(|it| (it.from.clone(), it.to.clone())).collect()
}

/// The same, found by following the lines of a drawing backwards.
fn meaning(plan: &chart::ChartPlan) -> Meaning {
    let count = plan.objects.iter().filter(|it| matches!(it.part, Part::Transition(_))).count();
    let mut found: Meaning = vec![Default::default(); count];
    let sources = |from: usize| {
        let mut found = Vec::new();
        let mut waiting = vec![from];
        while let Some(at) = waiting.pop() {
            for link in &plan.objects[at].inputs {
                match plan.objects[link.from].part {
                    Part::Step(_) | Part::Transition(_) => found.push(plan.objects[link.from].part),
                    _ => waiting.push(link.from),
                }
            }
        }
        found
    };
    for (at, object) in plan.objects.iter().enumerate() {
        for source in sources(at) {
            match (object.part, source) {
                (Part::Transition(transition), Part::Step(step)) => found[transition].0.push(step),
                (Part::Step(step) | Part::Jump(step), Part::Transition(transition)) => {
                    found[transition].1.push(step);
                }
                _ => {}
            }
        }
    }
    for (from, to) in &mut found {
        from.sort_unstable();
        to.sort_unstable();
    }
    found
}
