//! The tables, the examples and the combined states of the paper.

mod examples;
mod filling_line;
mod tables;
