//! Rungs as statements of Structured Text, in the order in which LDmicro executes their elements.
//!
//! Power is an expression while only contacts have been passed. Before something is written, power that is still needed is held
//! in a variable, since what is written may be what a contact has read.

mod leaf;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Write;
use std::ops::Range;
use std::time::Duration;

use understudy_text::Diagnostic;

use super::limits::limits;
use super::parse::{Coil, Element, File, Kind};

/// A text, and which line of the file each of its parts comes from.
pub(super) struct Written {
    pub(super) text: String,
    places: Vec<(usize, Range<usize>)>,
}

impl Written {
    /// The line behind a place of the text.
    pub(super) fn place_of(&self, offset: usize) -> Range<usize> {
        let next = self.places.partition_point(|(start, _)| *start <= offset);
        next.checked_sub(1).map_or(0..0, |place| self.places[place].1.clone())
    }
}

/// The meaning of a name of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    Bit,
    Number,
    Timer,
}

/// The whole file as one PROGRAM with a name like `name`.
pub(super) fn statements(name: &str, file: &File) -> (Written, Vec<Diagnostic>) {
    let mut writer = Writer {
        period: file.period.unwrap_or(Duration::from_millis(10)),
        body: String::new(),
        places: Vec::new(),
        names: HashMap::new(),
        uses: BTreeMap::new(),
        taken: HashSet::new(),
        bits: Vec::new(),
        blocks: Vec::new(),
        comments: Vec::new(),
        has_master: file.rungs.iter().flatten().any(has_master),
        limits: limits(&file.rungs),
        diagnostics: Vec::new(),
    };
    for (name, _) in &file.pins {
        writer.name(name, Use::Bit, &(0..0));
    }
    let program = match writer.unique(name) {
        made if made == "v_" => "program_1".to_owned(),
        made => made,
    };
    if writer.has_master {
        writer.helper("rungs_run", "BOOL");
        writer.line("rungs_run := TRUE;", &(0..0));
    }
    for rung in &file.rungs {
        let rail = if writer.has_master { "rungs_run" } else { "TRUE" };
        writer.series(rung, rail.to_owned(), true);
    }
    writer.finish(&program, file)
}

fn has_master(element: &Element) -> bool {
    match &element.kind {
        Kind::MasterRelay => true,
        Kind::Parallel(branches) => branches.iter().flatten().any(has_master),
        _ => false,
    }
}

/// Whether it does more than to pass power or not.
fn acts(element: &Element) -> bool {
    match &element.kind {
        Kind::Contacts(..) | Kind::Wire(_) | Kind::Compare(..) | Kind::Comment(_) => false,
        Kind::Parallel(branches) => branches.iter().flatten().any(acts),
        _ => true,
    }
}

struct Writer {
    period: Duration,
    body: String,
    places: Vec<(usize, Range<usize>)>,
    /// Names of the file to names of the text.
    names: HashMap<String, String>,
    /// By name of the text.
    uses: BTreeMap<String, Use>,
    /// In capitals.
    taken: HashSet<String>,
    bits: Vec<String>,
    /// Instances with their types.
    blocks: Vec<(String, &'static str)>,
    /// For the next statement.
    comments: Vec<String>,
    has_master: bool,
    limits: HashMap<String, Option<(i64, i64)>>,
    diagnostics: Vec<Diagnostic>,
}

impl Writer {
    fn line(&mut self, line: &str, span: &Range<usize>) {
        for comment in std::mem::take(&mut self.comments) {
            let harmless = comment.replace("(*", "( *").replace("*)", "* )");
            let _ = writeln!(self.body, "  (* {harmless} *)");
        }
        self.places.push((self.body.len(), span.clone()));
        let _ = writeln!(self.body, "  {line}");
    }

    fn unique(&mut self, wanted: &str) -> String {
        let mut name = String::new();
        for letter in wanted.chars().take(100) {
            let letter = if letter.is_ascii_alphanumeric() { letter } else { '_' };
            if !(letter == '_' && name.ends_with('_')) {
                name.push(letter);
            }
        }
        let name = name.trim_matches('_');
        let starts = name.starts_with(|first: char| first.is_ascii_alphabetic());
        // The words of the language, which LDmicro does not know, are no names.
        let is_word = understudy_structured_text::parser::is_keyword(name);
        let base = if starts && !is_word { name.to_owned() } else { format!("v_{name}") };
        let mut unique = base.clone();
        let mut count = 2;
        while !self.taken.insert(unique.to_ascii_uppercase()) {
            unique = format!("{base}_{count}");
            count += 1;
        }
        unique
    }

    /// The name in the text of a name in the file, which always has the same kind.
    fn name(&mut self, name: &str, wanted: Use, span: &Range<usize>) -> String {
        let known = match self.names.get(name) {
            Some(known) => known.clone(),
            None => {
                let made = self.unique(name);
                self.names.insert(name.to_owned(), made.clone());
                made
            }
        };
        let found = *self.uses.entry(known.clone()).or_insert(wanted);
        if found != wanted {
            let words = |what| match what {
                Use::Bit => "a bit",
                Use::Number => "a number",
                Use::Timer => "a timer",
            };
            let message =
                format!("`{name}` is {} elsewhere, and {} here", words(found), words(wanted));
            self.diagnostics.push(Diagnostic::error("U1074", message, span.clone()));
        }
        known
    }

    fn helper(&mut self, wanted: &str, type_name: &'static str) -> String {
        let name = self.unique(wanted);
        match type_name {
            "BOOL" => self.bits.push(name.clone()),
            _ => self.blocks.push((name.clone(), type_name)),
        }
        name
    }

    /// A variable or a literal number.
    fn operand(&mut self, text: &str, span: &Range<usize>) -> String {
        match text.parse::<i64>() {
            Ok(value) if (-0x8000..0x8000).contains(&value) => value.to_string(),
            Ok(value) => {
                let message = format!("the number {value} needs more than 16 bits");
                self.diagnostics.push(Diagnostic::error("U1072", message, span.clone()));
                "0".into()
            }
            Err(_) => self.name(text, Use::Number, span),
        }
    }

    fn held(&mut self, power: String, span: &Range<usize>) -> String {
        if matches!(power.as_str(), "TRUE" | "FALSE") {
            return power;
        }
        let name = self.helper("power", "BOOL");
        self.line(&format!("{name} := {power};"), span);
        name
    }

    /// The power behind the elements; not needed where they are `last` on their rung.
    fn series(&mut self, series: &[Element], mut power: String, last: bool) -> String {
        let acting = series.iter().rposition(acts).map_or(0, |place| place + 1);
        let behind = series[acting..].iter();
        for element in behind.filter(|element| last && !matches!(element.kind, Kind::Comment(_))) {
            let message = "it has no effect: nothing that acts is behind it";
            let found = Diagnostic::warning("U1075", message, element.span.clone());
            self.diagnostics.push(found);
        }
        for (place, element) in series.iter().enumerate() {
            let is_last = last && place + 1 == series.len();
            power = self.element(element, power, is_last);
        }
        power
    }

    fn element(&mut self, element: &Element, power: String, is_last: bool) -> String {
        let span = &element.span;
        match &element.kind {
            Kind::Comment(text) => {
                self.comments.push(text.clone());
                power
            }
            Kind::Contacts(name, negated) => {
                let name = self.name(name, Use::Bit, span);
                both(power, &if *negated { format!("NOT {name}") } else { name })
            }
            Kind::Wire(true) => power,
            Kind::Wire(false) => "FALSE".into(),
            Kind::Compare(sign, left, right) => {
                let (left, right) = (self.operand(left, span), self.operand(right, span));
                both(power, &format!("{left} {sign} {right}"))
            }
            Kind::Parallel(branches) if acts(element) => {
                self.acting(branches, power, is_last, span)
            }
            Kind::Parallel(branches) => {
                let branches =
                    branches.iter().map(|branch| self.series(branch, "TRUE".into(), false));
                let branches: Vec<String> = branches.collect();
                either(power, branches)
            }
            Kind::Coil(name, coil) => {
                let power = if is_last { power } else { self.held(power, span) };
                let name = self.name(name, Use::Bit, span);
                let line = match coil {
                    Coil::Plain => format!("{name} := {power};"),
                    Coil::Negated => format!("{name} := NOT ({power});"),
                    Coil::Set => format!("IF {power} THEN {name} := TRUE; END_IF;"),
                    Coil::Reset => format!("IF {power} THEN {name} := FALSE; END_IF;"),
                };
                self.line(&line, span);
                power
            }
            _ => self.acting_leaf(element, power, is_last),
        }
    }

    /// Branches of which some write something.
    fn acting(
        &mut self,
        branches: &[Vec<Element>],
        power: String,
        is_last: bool,
        span: &Range<usize>,
    ) -> String {
        let power = self.held(power, span);
        let mut behind = Vec::new();
        for branch in branches {
            let passed = self.series(branch, power.clone(), is_last);
            // What comes next may write what this branch has read.
            behind.push(if is_last { passed } else { self.held(passed, span) });
        }
        if is_last { power } else { either("TRUE".into(), behind) }
    }

    fn finish(mut self, program: &str, file: &File) -> (Written, Vec<Diagnostic>) {
        if !self.comments.is_empty() {
            self.line(";", &(0..0));
        }
        let mut diagnostics = self.diagnostics;
        let mut head = format!("PROGRAM {program}\n");
        let pins: HashMap<&str, &str> =
            file.pins.iter().map(|(name, pin)| (name.as_str(), pin.as_str())).collect();
        // Inputs and outputs that the list names come first, in its order.
        let mut names: Vec<(&String, &String)> = self.names.iter().collect();
        let order: HashMap<&str, usize> =
            file.pins.iter().enumerate().map(|(place, (name, _))| (name.as_str(), place)).collect();
        names.sort_by_key(|(name, _)| {
            (order.get(name.as_str()).copied().unwrap_or(usize::MAX), (*name).clone())
        });
        let persistent: HashSet<&str> =
            file.persistent.iter().map(|(name, _)| name.as_str()).collect();
        let mut kept: HashSet<&str> = HashSet::new();
        for (section, first) in [("VAR_INPUT", "X"), ("VAR_OUTPUT", "Y"), ("VAR", "")] {
            let mut is_retained = false;
            let _ = writeln!(head, "  {section}");
            for (name, made) in &names {
                let use_of = self.uses.get(*made).copied().unwrap_or(Use::Bit);
                let is_pin = name.starts_with(['X', 'Y']) && use_of == Use::Bit;
                if is_pin == first.is_empty() || !name.starts_with(first) {
                    continue;
                }
                let type_name = match use_of {
                    Use::Bit => "BOOL",
                    Use::Number => "INT",
                    Use::Timer => continue,
                };
                let pin = pins
                    .get(name.as_str())
                    .map(|pin| format!(" (* pin {} *)", pin.replace(['*', '(', ')'], " ")));
                let is_kept = section != "VAR_INPUT" && persistent.contains(name.as_str());
                if is_kept {
                    kept.insert(name.as_str());
                }
                if is_kept != is_retained {
                    is_retained = is_kept;
                    let retain = if is_kept { " RETAIN" } else { "" };
                    let _ = writeln!(head, "  END_VAR\n  {section}{retain}");
                }
                let _ = writeln!(head, "    {made} : {type_name};{}", pin.unwrap_or_default());
            }
            if is_retained {
                let _ = writeln!(head, "  END_VAR\n  {section}");
            }
            if section == "VAR" {
                for bit in &self.bits {
                    let _ = writeln!(head, "    {bit} : BOOL;");
                }
                for (name, word) in &self.blocks {
                    let _ = writeln!(head, "    {name} : {word};");
                }
            }
            head.push_str("  END_VAR\n");
        }
        let pins = file.pins.iter().zip(&file.pin_places);
        for ((name, _), place) in pins.filter(|((name, _), _)| !name.starts_with(['X', 'Y'])) {
            let message = format!(
                "`{name}` of the list is neither an input (X) nor an output (Y), and is not kept"
            );
            diagnostics.push(Diagnostic::warning("U1075", message, place.clone()));
        }
        for (name, place) in
            file.persistent.iter().filter(|(name, _)| !kept.contains(name.as_str()))
        {
            let message = format!(
                "PERSIST of `{name}` has no effect: it is no output, bit or number that the program uses"
            );
            diagnostics.push(Diagnostic::warning("U1075", message, place.clone()));
        }
        let shift = head.len();
        let places = self.places.into_iter().map(|(start, span)| (start + shift, span));
        let written =
            Written { places: places.collect(), text: format!("{head}{}END_PROGRAM\n", self.body) };
        (written, diagnostics)
    }
}

fn both(power: String, other: &str) -> String {
    match power.as_str() {
        "TRUE" => other.to_owned(),
        "FALSE" => power,
        _ => format!("{power} AND {}", bracketed(other)),
    }
}

fn either(power: String, branches: Vec<String>) -> String {
    if branches.iter().any(|branch| branch == "TRUE") {
        return power;
    }
    let branches: Vec<String> = branches.into_iter().filter(|branch| branch != "FALSE").collect();
    match branches.as_slice() {
        [] => "FALSE".into(),
        [one] => both(power, one),
        more => {
            let more: Vec<String> = more.iter().map(|branch| bracketed(branch)).collect();
            let joined = format!("({})", more.join(" OR "));
            if power == "TRUE" { joined } else { both(power, &joined) }
        }
    }
}

/// In brackets, where it is more than a name.
fn bracketed(expression: &str) -> String {
    let is_plain =
        expression.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.'));
    let is_closed = expression.starts_with("NOT ")
        && expression[4..].bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    let is_whole =
        expression.starts_with('(') && expression.ends_with(')') && !expression[1..].contains('(');
    if is_plain || is_closed || is_whole {
        expression.to_owned()
    } else {
        format!("({expression})")
    }
}
