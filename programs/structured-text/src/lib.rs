//! Structured Text of IEC 61131-3, with numbers: text to syntax ([`parser`]), syntax to text ([`print`](mod@print)), syntax to the
//! program form of `understudy-typed` (`lower`).

mod jumps;
mod lexer;
mod library;
pub mod lower;
pub mod parser;
pub mod print;
pub mod syntax;

pub use jumps::in_parts;
pub use library::{control as control_blocks, file as library};
pub use lower::{Lowered, Options, input_names, lower};
pub use parser::parse;
