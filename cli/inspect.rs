//! Commands that show a run, live or finished.

pub(crate) mod animate;
pub(crate) mod attach;
pub(crate) mod diff;
pub(crate) mod journal;
pub(crate) mod top;
pub(crate) mod view;
pub(crate) mod watch;
pub(crate) mod why;
