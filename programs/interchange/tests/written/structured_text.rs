//! What other compilers are given.

use std::time::Duration;

use understudy_interchange::{Format, write};
use understudy_ladder::parse;

fn text_of(ladder: &str, period: Duration) -> String {
    let (program, _) = parse(ladder).into_result().expect("a sound program");
    let written = write(Format::StructuredText, &program, Some(period));
    written.expect("it can be written").text
}

#[test]
fn every_element() {
    let ladder = include_str!("../../../ladder/tests/ladder/every-element.ladder");
    insta::assert_snapshot!(text_of(ladder, Duration::from_millis(10)));
}

/// What an element reads of a block above its call is the last scan's, wherever the call stands.
#[test]
fn blocks_that_are_read_above_their_call() {
    let ladder = "\
program order
input a
input b
output y
output z
output n
rung
    /tick.Q {TON tick 300ms} ( y )
rung
    a {CTU parts 3 R=parts.Q} ( z )
rung
    [ late.Q a | {TON late 200ms} b | /late.Q ] ( n )
rung
    b [ [ a | {R_TRIG up} ] | {SR held R=up.Q} ] /a ( y ) (S z ) (/ n )
rung
    {TP pulse 1ms500us} a
rung
    y (R y ) (S n )
rung
    ( z )
";
    insta::assert_snapshot!(text_of(ladder, Duration::from_micros(500)));
}
