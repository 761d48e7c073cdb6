//! Commands on discrete-event models: automata, Petri nets, supervisors and their ladders.

pub(crate) mod automata;
pub(crate) mod des;
pub(crate) mod petri;
pub(crate) mod reconfigure;
pub(crate) mod reduction;
pub(crate) mod supervisor_to_ladder;
pub(crate) mod synth;
