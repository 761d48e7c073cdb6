//! Names for generated programs: legal in their language, unique, and as near to the wanted ones as that allows.

mod standard;

use std::collections::HashSet;
use std::sync::OnceLock;

pub use self::standard::StandardNames;

use crate::lexer::{MAXIMUM_NAME_LENGTH, is_name_part, is_name_start};
use crate::parser::KEYWORDS;

/// Room for a number behind a shortened name.
const MAXIMUM_WANTED_LENGTH: usize = MAXIMUM_NAME_LENGTH - 12;

/// The language that the names are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// That of this crate.
    Ladder,
    /// IEC 61131-3: ASCII, no dots, no two underscores in a row and none at the end, case does not matter.
    StructuredText,
}

/// Gives names that it has not given before.
#[derive(Debug, Clone)]
pub struct Namer {
    language: Language,
    /// As compared, in capitals for Structured Text.
    taken: HashSet<String>,
}

impl Namer {
    /// For one program in `language`.
    pub fn new(language: Language) -> Self {
        Self { language, taken: HashSet::new() }
    }

    /// A legal name that is like `wanted`; another one each time.
    pub fn name(&mut self, wanted: &str) -> String {
        let legal = match self.language {
            Language::Ladder => legal_name(wanted),
            Language::StructuredText => structured_text_name(wanted),
        };
        let mut name = legal.clone();
        let mut count = 2;
        while !self.take(&name) {
            name = format!("{legal}_{count}");
            count += 1;
        }
        name
    }

    fn take(&mut self, name: &str) -> bool {
        match self.language {
            Language::Ladder => !KEYWORDS.contains(&name) && self.taken.insert(name.to_owned()),
            Language::StructuredText => {
                let capitals = name.to_uppercase();
                !reserved().contains(capitals.as_str()) && self.taken.insert(capitals)
            }
        }
    }
}

/// A name of a ladder that is like `wanted`, with room for a number behind it; it may be a keyword.
pub fn legal_name(wanted: &str) -> String {
    let parts: Vec<String> = wanted
        .split('.')
        .filter(|part| !part.is_empty())
        .map(|part| {
            let legal = |character| {
                if is_name_part(character) { character } else { '_' }
            };
            part.chars().map(legal).collect()
        })
        .collect();
    let mut name: String = parts.join(".");
    if !name.chars().next().is_some_and(is_name_start) {
        name.insert(0, '_');
    }
    shortened(&name, '.')
}

fn structured_text_name(wanted: &str) -> String {
    let mut name = String::new();
    for character in wanted.chars() {
        let legal = if character.is_ascii_alphanumeric() { character } else { '_' };
        if !(legal == '_' && name.ends_with('_')) {
            name.push(legal);
        }
    }
    if !name.starts_with(|first: char| first.is_ascii_alphabetic()) {
        name.insert_str(0, if name.starts_with('_') { "v" } else { "v_" });
    }
    shortened(name.trim_end_matches('_'), '_')
}

fn shortened(name: &str, separator: char) -> String {
    let short: String = name.chars().take(MAXIMUM_WANTED_LENGTH).collect();
    short.trim_end_matches(separator).to_owned()
}

fn reserved() -> &'static HashSet<&'static str> {
    static WORDS: OnceLock<HashSet<&'static str>> = OnceLock::new();
    WORDS.get_or_init(|| RESERVED.split(' ').collect())
}

/// Words of IEC 61131-3 that a variable cannot have for its name: keywords, types, standard functions and blocks, and
/// the operators of its instruction list, which some systems keep as well.
const RESERVED: &str = "\
    ABS ACOS ACTION ADD AND ANDN ANY ARRAY ASIN AT ATAN BOOL BY BYTE CAL CALC CALCN CASE CLASS CONCAT CONFIGURATION \
    CONSTANT CONTINUE COS CTD CTU CTUD DATE DATE_AND_TIME DELETE DINT DIV DO DT DWORD ELSE ELSIF EN END_ACTION \
    END_CASE END_CLASS END_CONFIGURATION END_FOR END_FUNCTION END_FUNCTION_BLOCK END_IF END_INTERFACE END_METHOD \
    END_NAMESPACE END_PROGRAM END_REPEAT END_RESOURCE END_STEP END_STRUCT END_TRANSITION END_TYPE END_VAR END_WHILE \
    ENO EQ EXIT EXP EXPT EXTENDS FALSE FIND FINAL FOR FROM FUNCTION FUNCTION_BLOCK F_EDGE F_TRIG GE GOTO GT IF \
    IMPLEMENTS INITIAL_STEP INSERT INT INTERFACE INTERNAL INTERVAL JMP JMPC JMPCN LD LDN LE LEFT LEN LIMIT LINT LN \
    LOG LREAL LT LTIME LWORD MAX METHOD MID MIN MOD MOVE MUL MUX NAMESPACE NE NON_RETAIN NOT NULL OF ON OR ORN \
    OVERLAP OVERRIDE PRIORITY PRIVATE PROGRAM PROTECTED PUBLIC R READ_ONLY READ_WRITE REAL REF REFERENCE REF_TO \
    REPEAT REPLACE RESOURCE RET RETAIN RETC RETCN RETURN RIGHT ROL ROR RS RTC R_EDGE R_TRIG S SEL SEMA SHL SHR SIN \
    SINGLE SINT SQRT SR ST STEP STN STRING STRUCT SUB SUPER TAN TASK THEN THIS TIME TIME_OF_DAY TO TOD TOF TON TP \
    TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNTIL USING USINT VAR VAR_ACCESS VAR_CONFIG VAR_EXTERNAL VAR_GLOBAL \
    VAR_INPUT VAR_IN_OUT VAR_OUTPUT VAR_TEMP WCHAR WHILE WITH WORD WSTRING XOR XORN";
