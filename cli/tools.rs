//! Commands about this program itself, and tools for its surroundings.

pub(crate) mod explain;
pub(crate) mod proxy;
pub(crate) mod schema;
pub(crate) mod shell;
