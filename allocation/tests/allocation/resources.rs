//! Counts of what programs consist of.

use understudy_allocation::Resources;

use crate::support::resources;

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
