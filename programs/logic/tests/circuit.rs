//! What a circuit refuses to be.

use understudy_logic::CircuitBuilder;

fn check(build: impl FnOnce(&mut CircuitBuilder), expected: Option<&str>) {
    let mut builder = CircuitBuilder::new("cell");
    build(&mut builder);
    let error = builder.finish().err().map(|error| error.to_string());
    assert_eq!(error.as_deref(), expected);
}

#[test]
fn names_are_unique_among_their_kind_and_every_register_has_a_next_state() {
    check(
        |builder| {
            let input = builder.input("a");
            let (register, _) = builder.register("a", false);
            builder.set_next(register, input);
            builder.output("a", input);
        },
        None,
    );
    check(
        |builder| {
            builder.input("a");
            builder.input("a");
        },
        Some("the input `a` of `cell` is declared twice"),
    );
    check(
        |builder| {
            let input = builder.input("a");
            builder.output("b", input);
            builder.output("b", input);
        },
        Some("the output `b` of `cell` is declared twice"),
    );
    check(
        |builder| {
            for _ in 0..2 {
                let (register, value) = builder.register("x", true);
                builder.set_next(register, value);
            }
        },
        Some("the register `x` of `cell` is declared twice"),
    );
    check(
        |builder| {
            builder.register("x", true);
        },
        Some("the register `x` of `cell` has no next-state function"),
    );
}
