//! Commands that run a cluster: on processes of this machine, or in virtual time.

pub(crate) mod campaign;
pub(crate) mod demo;
pub(crate) mod lab;
pub(crate) mod model_check;
pub(crate) mod outcome;
pub(crate) mod simulate;
pub(crate) mod wakefulness;
