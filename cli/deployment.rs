//! Commands that select controllers, issue keys, check machines and operate members.

pub(crate) mod allocate;
pub(crate) mod catalogue;
pub(crate) mod doctor;
pub(crate) mod gateway;
pub(crate) mod keys;
pub(crate) mod operate;
pub(crate) mod resources;
