//! Structured Text of IEC 61131-3, with numbers: text to syntax (`parser`), syntax to the program form of `understudy-typed`
//! (`lower`).

pub mod syntax;
