//! Commands that predict and measure the reliability of a cluster.

pub(crate) mod measure;
pub(crate) mod outlook;
pub(crate) mod prediction;
