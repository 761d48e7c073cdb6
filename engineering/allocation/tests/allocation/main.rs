//! What programs need, what controllers have, and which are taken.

mod additions;
mod domains;
mod files;
mod fitting;
mod instruction_list;
mod modules;
mod packing;
mod plan;
mod resources;
mod support;
