//! Structured Text of IEC 61131-3, with numbers: text to syntax (`parser`), syntax to the program form of `understudy-typed`
//! (`lower`).

mod lexer;
pub mod parser;
pub mod syntax;

pub use parser::parse;
