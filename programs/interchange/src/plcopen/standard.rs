//! The pins of the standard function blocks, as PLCopen files name them.

use understudy_ladder::BlockKind;

/// The standard's name of an input; some tools have names of their own for the latches.
pub(crate) fn input(kind: BlockKind, pin: &str) -> Option<&'static str> {
    let other = match (kind.word(), pin.to_ascii_uppercase().as_str()) {
        ("SR", "SET1") => "S1",
        ("SR", "RESET") => "R",
        ("RS", "SET") => "S",
        ("RS", "RESET1") => "R1",
        ("CTD" | "CTUD", "LOAD") => "LD",
        ("CTU" | "CTUD", "RESET") => "R",
        _ => pin,
    };
    kind.inputs().find(|known| known.eq_ignore_ascii_case(other))
}

/// The standard's name of an output.
pub(crate) fn output(kind: BlockKind, pin: &str) -> Option<&'static str> {
    let mut outputs = kind.outputs().iter().copied().chain(kind.value_output());
    outputs.find(|known| known.eq_ignore_ascii_case(pin))
}
