//! Programs in and out of other tools: PLCopen XML, Structured Text, the digraph XML of the paper, LDmicro.

pub mod plcopen;
pub mod structured_text;
