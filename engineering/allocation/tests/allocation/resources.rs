//! Counts of what programs consist of, beside those of the paper on the deployment of controllers.

use std::collections::BTreeSet;

use understudy_allocation::Resources;
use understudy_ladder::{Element, Program, visit};

use crate::support::{program, resources};

#[test]
fn every_thing_is_counted_under_its_own_name() {
    let found = resources(
        "program all
input a
input b
input unused
output y
output z
memory m
rung [ a | b [ /m | +a ] ] {TON pause 1s} ( y ) (+ m )
rung b {CTU parts 5 R=a} ( z )
rung parts.CV > 2 {SR latch R=-b}
rung {R_TRIG edge} (S m )
",
    );
    let expected = Resources {
        inputs: 3,
        outputs: 2,
        analog_inputs: 0,
        analog_outputs: 0,
        memory_bits: 1,
        rungs: 4,
        contacts: 8,
        input_contacts: 6,
        coils: 4,
        blocks: 4,
        branches: 2,
        timers: 1,
        counters: 1,
        // m, +a, (+ m), the latch, -b, R_TRIG
        data_bits: 6,
        instructions: found.instructions,
    };
    assert_eq!(found, expected);
    assert_eq!((found.elements(), found.points()), (16, 5));
}

fn example(name: &str) -> Program {
    let path = format!("{}/../../examples/{name}", env!("CARGO_MANIFEST_DIR"));
    program(&std::fs::read_to_string(&path).expect(&path))
}

/// Different contacts, by kind and operand.
fn different_contacts(program: &Program) -> u64 {
    let mut seen = BTreeSet::new();
    for rung in &program.rungs {
        visit(&rung.network, &mut |element| {
            if let Element::Contact(contact) = element {
                seen.insert((contact.kind.sign(), contact.operand.to_string()));
            }
        });
    }
    seen.len() as u64
}

/// The painting system of the paper's section 5, which counts 25 contacts, 1 branch, 20 instructions, 360 words of program, 104 words of data, 17 inputs, 8
/// outputs and 1 timer.
#[test]
fn the_painting_system_beside_the_paper() {
    let program = example("painting-system/painting-system.ladder");
    let found = Resources::of(&program);
    // Its "Total Contacts" are contacts and coils, its inputs the contacts, its outputs the coils.
    assert_eq!((found.contacts, found.coils), (17, 8));
    assert_eq!(found.contacts + found.coils, 25);
    assert_eq!((found.branches, found.timers, found.rungs), (1, 1, 8));
    // What is wired is less, and the timer is an element of its own.
    assert_eq!((found.inputs, found.outputs, found.memory_bits), (5, 6, 2));
    assert_eq!(found.elements(), 26);
    // An instruction for each contact and each coil, and three for the timer.
    assert_eq!(found.instructions, 17 + 8 + 3);
    // Its 20 instructions are what counting equal contacts once gives, with the coils and the branch; its words are multiples.
    let counted_once = different_contacts(&program) + found.coils + found.branches;
    assert_eq!(counted_once, 20);
    assert_eq!(18 * counted_once, 360);
    assert_eq!(4 * (found.contacts + found.coils + found.branches), 104);
}

/// The vents of its section 3: the third rung is that of its appendix 1.
#[test]
fn the_vents_beside_the_paper() {
    let program = example("vents/vents.ladder");
    let found = Resources::of(&program);
    assert_eq!((found.rungs, found.inputs, found.outputs), (3, 3, 3));
    assert_eq!((found.contacts, found.coils, found.branches), (18, 3, 4));
    let third = program.rungs[2].network.iter().map(|element| match element {
        Element::Contact(contact) => format!("{}{}", contact.kind.sign(), contact.operand),
        other => panic!("{other:?} is no contact"),
    });
    assert_eq!(third.collect::<Vec<_>>(), ["/v1", "/v2", "/v3"]);
    assert_eq!(program.rungs[2].coils[0].target, "no_vent".into());
}

/// As `level AT %IW0 : INT` and `speed AT %QW2 : INT` become.
#[test]
fn a_number_is_an_analog_channel_and_not_its_bits() {
    let mut text = String::from(
        "program tank\ninput full at %IX0.0\ninput tank.7\ninput tank.9\ninput one.0\n",
    );
    for bit in 0..32 {
        text += &format!("input level.{bit}\noutput speed.{bit}\n");
    }
    for bit in 0..32 {
        text += &format!("rung full tank.7 tank.9 one.0 level.{bit} ( speed.{bit} )\n");
    }
    let found = resources(&text);
    assert_eq!((found.inputs, found.analog_inputs), (4, 1));
    assert_eq!((found.outputs, found.analog_outputs), (0, 1));
    assert_eq!(found.points(), 6);
    let table = &Resources::table(&[found])[0];
    assert!(table.contains(&("analog inputs", 1)), "{table:?}");
}
