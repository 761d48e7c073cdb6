//! The ladder language of IEC 61131-3: text, scan, drawing, and lowering to a circuit.
//!
//! ```text
//! program press
//! input  part_on_press  at %IX0.0  -- u20
//! input  ram_up         at %IX0.1  -- u21
//! output ram_down       at %QX0.0  -- y21
//!
//! rung "press the part until the pause is over"
//!     [ part_on_press ram_up | ram_down ] /pause.Q ( ram_down )
//! rung
//!     ram_down {TON pause 300ms}
//! ```
//!
//! [`parse`] reads such a text and finds everything that is wrong with it in one run; [`Program::typed`] is the typed program that it means, and
//! [`Program::lower`] the [`Circuit`](understudy_logic::Circuit) of it; [`Observer`] tells what the power did in a scan.
//! The format and its grammar are described in `docs/reference/ladder-format.md`.

mod check;
mod draw;
mod flow;
mod from_circuit;
mod layout;
mod lexer;
mod lower;
mod names;
mod observer;
mod parser;
mod plan;
mod print;
mod program;
mod structured_text;

pub use check::check;
pub use draw::{draw_svg, draw_svg_rungs, draw_text, draw_text_rungs};
pub use flow::{ElementFlow, Evaluation, Reading, RungFlow};
pub use from_circuit::from_circuit;
pub use lexer::{MAXIMUM_NAME_LENGTH, MAXIMUM_PRESET_TIME, parse_address};
pub use lower::{Executed, LowerError, PERIODS, Write, circuit};
pub use names::{Language, Namer, StandardNames, legal_name};
pub use observer::{Interpreter, Observer};
pub use parser::{
    KEYWORDS, MAXIMUM_NESTING, MAXIMUM_PRESET_VALUE, MAXIMUM_RUNGS, MAXIMUM_TEXT_BYTES, Parsed,
    parse,
};
pub use print::print;
pub use program::{
    Address, Area, Block, BlockKind, Coil, CoilKind, Comparison, Contact, ContactKind, Cost,
    Element, Feed, Name, Program, Relation, Rung, Series, Signal, visit,
};
pub use structured_text::{circuit_as_structured_text, edge_names, standard_time, structured_text};
