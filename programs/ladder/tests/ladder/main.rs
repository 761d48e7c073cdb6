//! What the ladder crate promises, against references and recorded facts.

mod cell;
mod diagnostics;
mod drawing;
mod flow;
mod format;
mod generated;
mod lowering;
mod printing;
mod retention;
mod semantics;
mod structured_text_reader;
mod support;
mod vectors;
