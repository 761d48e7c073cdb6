//! Commands that write, check, prove and convert the programs of a cluster.

pub(crate) mod check;
pub(crate) mod convert;
pub(crate) mod draw;
pub(crate) mod init;
pub(crate) mod parity;
pub(crate) mod verify;
