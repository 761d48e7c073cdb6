//! The standard function blocks and functions, as PLCopen files name them and their pins.

/// A standard function block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StandardBlock {
    pub(crate) word: &'static str,
    /// Inputs, the one that the wire enters first.
    pub(crate) inputs: &'static [&'static str],
    /// Outputs, the one that the wire leaves first.
    outputs: &'static [&'static str],
}

const BLOCKS: [StandardBlock; 10] = [
    StandardBlock { word: "TON", inputs: &["IN", "PT"], outputs: &["Q", "ET"] },
    StandardBlock { word: "TOF", inputs: &["IN", "PT"], outputs: &["Q", "ET"] },
    StandardBlock { word: "TP", inputs: &["IN", "PT"], outputs: &["Q", "ET"] },
    StandardBlock { word: "CTU", inputs: &["CU", "R", "PV"], outputs: &["Q", "CV"] },
    StandardBlock { word: "CTD", inputs: &["CD", "LD", "PV"], outputs: &["Q", "CV"] },
    StandardBlock {
        word: "CTUD",
        inputs: &["CU", "CD", "R", "LD", "PV"],
        outputs: &["QU", "QD", "CV"],
    },
    StandardBlock { word: "SR", inputs: &["S1", "R"], outputs: &["Q1"] },
    StandardBlock { word: "RS", inputs: &["S", "R1"], outputs: &["Q1"] },
    StandardBlock { word: "R_TRIG", inputs: &["CLK"], outputs: &["Q"] },
    StandardBlock { word: "F_TRIG", inputs: &["CLK"], outputs: &["Q"] },
];

impl StandardBlock {
    /// The block of that name, whatever its case.
    pub(crate) fn of(type_name: &str) -> Option<Self> {
        BLOCKS.into_iter().find(|block| block.word.eq_ignore_ascii_case(type_name))
    }

    pub(crate) fn wire_input(self) -> &'static str {
        self.inputs[0]
    }

    pub(crate) fn wire_output(self) -> &'static str {
        self.outputs[0]
    }

    /// The standard's name of an input; some tools have names of their own for the latches.
    pub(crate) fn input(self, pin: &str) -> Option<&'static str> {
        let other = match (self.word, pin.to_ascii_uppercase().as_str()) {
            ("SR", "SET1") => "S1",
            ("SR", "RESET") => "R",
            ("RS", "SET") => "S",
            ("RS", "RESET1") => "R1",
            ("CTD" | "CTUD", "LOAD") => "LD",
            ("CTU" | "CTUD", "RESET") => "R",
            _ => pin,
        };
        self.inputs.iter().copied().find(|known| known.eq_ignore_ascii_case(other))
    }

    pub(crate) fn output(self, pin: &str) -> Option<&'static str> {
        self.outputs.iter().copied().find(|known| known.eq_ignore_ascii_case(pin))
    }

    pub(crate) fn has_output(self, pin: &str) -> bool {
        self.output(pin).is_some()
    }
}
