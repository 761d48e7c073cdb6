//! The lines of a file as rungs.

use std::ops::Range;
use std::time::Duration;

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS, shortened};

/// The largest file.
const MAXIMUM_BYTES: usize = 16 << 20;
/// The deepest nesting of PARALLEL and SERIES.
const MAXIMUM_NESTING: usize = 20;
/// The most elements of a program.
const MAXIMUM_ELEMENTS: usize = 50_000;

/// A whole file.
#[derive(Debug, Default)]
pub(super) struct File {
    pub(super) period: Option<Duration>,
    /// Names and pins, in the order of the list.
    pub(super) pins: Vec<(String, String)>,
    /// Where each of them stands.
    pub(super) pin_places: Vec<Range<usize>>,
    pub(super) rungs: Vec<Vec<Element>>,
    /// What PERSIST names, with its places.
    pub(super) persistent: Vec<(String, Range<usize>)>,
}

/// An element with its line.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) kind: Kind,
    pub(super) span: Range<usize>,
}

#[derive(Debug)]
pub(super) enum Kind {
    Comment(String),
    /// Whether it is normally closed.
    Contacts(String, bool),
    Coil(String, Coil),
    /// On where it is a short circuit.
    Wire(bool),
    Edge(Edge),
    /// A timer of the standard, by its name there.
    Timer(&'static str, String, Duration),
    /// A timer that keeps its time without power.
    Retentive(String, Duration),
    Counter(Counter, String, i64),
    Reset(String),
    Move(String, String),
    /// The sign of the operation.
    Calculate(char, String, String, String),
    /// The sign of the relation.
    Compare(&'static str, String, String),
    MasterRelay,
    Parallel(Vec<Vec<Element>>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coil {
    Plain,
    Negated,
    Set,
    Reset,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Edge {
    Rising,
    Falling,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Counter {
    Up,
    Down,
    Circular,
}

/// Elements that only a microcontroller has, or that no circuit can hold.
const REFUSED: [&str; 14] = [
    "READ_ADC",
    "SET_PWM",
    "UART_RECV",
    "UART_SEND",
    "FORMATTED_STRING",
    "LOOK_UP_TABLE",
    "PIECEWISE_LINEAR",
    "SHIFT_REGISTER",
    "PLACEHOLDER",
    "SPI",
    "I2C_RD",
    "I2C_WR",
    "RANDOM",
    "DELAY",
];

/// Timers that are those of the standard.
const DELAYS: [&str; 2] = ["TON", "TOF"];

/// Comparisons and their signs.
const COMPARISONS: [(&str, &str); 6] =
    [("EQU", "="), ("NEQ", "<>"), ("GRT", ">"), ("GEQ", ">="), ("LES", "<"), ("LEQ", "<=")];

/// Lines above the program that say how LDmicro compiles it.
const SETTINGS: [&str; 7] = ["CRYSTAL", "BAUD", "COMPILED", "MICRO", "VERSION", "RATE", "CONFIG"];

const CALCULATIONS: [(&str, char); 4] = [("ADD", '+'), ("SUB", '-'), ("MUL", '*'), ("DIV", '/')];

/// Everything that can be read, and everything that is wrong.
pub(super) fn parse(text: &str) -> (File, Vec<Diagnostic>) {
    let mut parser = Parser {
        lines: Vec::new(),
        place: 0,
        depth: 0,
        elements: 0,
        persistent: Vec::new(),
        diagnostics: Vec::new(),
    };
    if text.len() > MAXIMUM_BYTES {
        let message =
            format!("the file has {} bytes; at most {MAXIMUM_BYTES} are read", text.len());
        return (File::default(), vec![Diagnostic::error("U1070", message, 0..0)]);
    }
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let words = line.trim();
        if !words.is_empty() {
            let lead = line.len() - line.trim_start().len();
            parser.lines.push((start + lead, words));
        }
        start += line.len();
    }
    let mut file = parser.file();
    file.persistent = parser.persistent;
    (file, parser.diagnostics)
}

struct Parser<'a> {
    /// Where each line begins, and what it says.
    lines: Vec<(usize, &'a str)>,
    place: usize,
    depth: usize,
    elements: usize,
    persistent: Vec<(String, Range<usize>)>,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Parser<'a> {
    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Range<usize>) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    fn next(&mut self) -> Option<(&'a str, Range<usize>)> {
        let &(start, line) = self.lines.get(self.place)?;
        self.place += 1;
        if self.diagnostics.len() >= MAXIMUM_FINDINGS {
            self.diagnostics.push(Diagnostic::too_many(start));
            self.place = self.lines.len();
            return None;
        }
        Some((line, start..start + line.len()))
    }

    fn file(&mut self) -> File {
        let mut file = File::default();
        let is_known = self.lines.first().is_some_and(|(_, line)| line.starts_with("LDmicro"));
        if !is_known {
            let span = self.lines.first().map_or(0..0, |(start, line)| *start..start + line.len());
            self.error("U1070", "a file of LDmicro begins with `LDmicro0.1` or the like", span);
            return file;
        }
        self.place = 1;
        let mut has_program = false;
        while let Some((line, span)) = self.next() {
            if line == "IO LIST" {
                self.pins(&mut file);
            } else if line == "PROGRAM" {
                has_program = true;
                break;
            } else if let Some(cycle) = line.strip_prefix("CYCLE=") {
                file.period = self.cycle(cycle, span);
            } else if line.split_once('=').is_some_and(|(name, _)| SETTINGS.contains(&name.trim()))
            {
                // For the compiler of the microcontroller.
            } else {
                self.error(
                    "U1071",
                    format!("`{}` is not understood here", shortened(line, 60)),
                    span,
                );
            }
        }
        if !has_program {
            self.error("U1071", "the file has no line `PROGRAM`", 0..0);
        }
        while let Some((line, span)) = self.next() {
            if line == "RUNG" {
                let rung = self.series(&span);
                file.rungs.push(rung);
            } else {
                self.error(
                    "U1071",
                    format!("expected a RUNG, found `{}`", shortened(line, 60)),
                    span,
                );
            }
        }
        file
    }

    /// In microseconds, with whatever follows the number.
    fn cycle(&mut self, text: &str, span: Range<usize>) -> Option<Duration> {
        let digits = text.trim_start().find(|letter: char| !letter.is_ascii_digit());
        let digits = &text.trim_start()[..digits.unwrap_or(text.trim_start().len())];
        let period = digits.parse().ok().map(Duration::from_micros);
        let period = period.filter(|period| understudy_ladder::PERIODS.contains(period));
        if period.is_none() {
            self.error(
                "U1072",
                format!("invalid cycle time `{}`: expected microseconds", shortened(text, 60)),
                span,
            );
        }
        period
    }

    fn pins(&mut self, file: &mut File) {
        while let Some((line, span)) = self.next() {
            if line == "END" {
                return;
            }
            match line.split_once(" at ") {
                Some((name, pin)) => {
                    let (name, pin) = (name.trim(), pin.trim());
                    if file.pins.iter().any(|(known, _)| known == name) {
                        self.error("U1074", format!("`{name}` is twice in the list"), span);
                        continue;
                    }
                    file.pins.push((name.to_owned(), pin.to_owned()));
                    file.pin_places.push(span);
                }
                None => self.error(
                    "U1071",
                    format!("invalid pin `{}`: expected a name and its pin", shortened(line, 60)),
                    span,
                ),
            }
        }
        self.error("U1071", "the list of inputs and outputs does not end", 0..0);
    }

    /// Elements up to END.
    fn series(&mut self, opened: &Range<usize>) -> Vec<Element> {
        let mut series = Vec::new();
        while let Some((line, span)) = self.next() {
            match line {
                "END" => return series,
                "RUNG" => {
                    // What is open ends here, so that the next rung is read.
                    self.place -= 1;
                    break;
                }
                "PARALLEL" => {
                    let kind = Kind::Parallel(self.parallel(&span));
                    series.push(Element { kind, span });
                }
                _ => {
                    let kind = self.element(line, &span);
                    series.extend(kind.map(|kind| Element { kind, span }));
                }
            }
        }
        self.error("U1071", "this has no END", opened.clone());
        series
    }

    fn parallel(&mut self, opened: &Range<usize>) -> Vec<Vec<Element>> {
        let mut branches = Vec::new();
        self.depth += 1;
        if self.depth > MAXIMUM_NESTING {
            self.error(
                "U1070",
                format!("this nests deeper than {MAXIMUM_NESTING} levels"),
                opened.clone(),
            );
            self.place = self.lines.len();
        }
        while let Some((line, span)) = self.next() {
            match line {
                "END" => {
                    self.depth -= 1;
                    return branches;
                }
                "RUNG" => {
                    self.place -= 1;
                    break;
                }
                "SERIES" => {
                    let series = self.series(&span);
                    branches.push(series);
                }
                _ => {
                    let kind = self.element(line, &span);
                    branches.extend(kind.map(|kind| vec![Element { kind, span }]));
                }
            }
        }
        self.depth -= 1;
        self.error("U1071", "this has no END", opened.clone());
        branches
    }

    fn element(&mut self, line: &str, span: &Range<usize>) -> Option<Kind> {
        self.elements += 1;
        if self.elements > MAXIMUM_ELEMENTS {
            self.error(
                "U1070",
                format!("the program has more than {MAXIMUM_ELEMENTS} elements"),
                span.clone(),
            );
            self.place = self.lines.len();
            return None;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let own = |place: usize| words.get(place).map(|word| (*word).to_owned());
        let flag = |place: usize| match words.get(place) {
            Some(&"1") => Some(true),
            Some(&"0") => Some(false),
            _ => None,
        };
        let found = match words[0] {
            "COMMENT" => {
                let text = line["COMMENT".len()..].replace("\\r", " ").replace("\\n", " ");
                Some(Kind::Comment(text.split_whitespace().collect::<Vec<_>>().join(" ")))
            }
            "CONTACTS" => own(1).zip(flag(2)).map(|(name, negated)| Kind::Contacts(name, negated)),
            "COIL" => own(1).zip(flag(2).zip(flag(3).zip(flag(4)))).and_then(|(name, flags)| {
                let coil = match flags {
                    (true, (false, false)) => Coil::Negated,
                    (false, (true, false)) => Coil::Set,
                    (false, (false, true)) => Coil::Reset,
                    (false, (false, false)) => Coil::Plain,
                    _ => return None,
                };
                Some(Kind::Coil(name, coil))
            }),
            "SHORT" => Some(Kind::Wire(true)),
            "OPEN" => Some(Kind::Wire(false)),
            "OSR" => Some(Kind::Edge(Edge::Rising)),
            "OSF" => Some(Kind::Edge(Edge::Falling)),
            "MASTER_RELAY" => Some(Kind::MasterRelay),
            "RTO" => {
                self.delayed(own(1), own(2), span).map(|(name, delay)| Kind::Retentive(name, delay))
            }
            "CTU" => counter(Counter::Up, own(1), own(2)),
            "CTD" => counter(Counter::Down, own(1), own(2)),
            "CTC" => counter(Counter::Circular, own(1), own(2)),
            "RES" => own(1).map(Kind::Reset),
            "MOVE" => own(1).zip(own(2)).map(|(to, from)| Kind::Move(to, from)),
            "PERSIST" => {
                if let Some(what) = own(1) {
                    self.persistent.push((what, span.clone()));
                }
                return None;
            }
            word => {
                if let Some(timer) = DELAYS.iter().find(|known| **known == word) {
                    self.delayed(own(1), own(2), span)
                        .map(|(name, delay)| Kind::Timer(timer, name, delay))
                } else if let Some((_, sign)) = COMPARISONS.iter().find(|(known, _)| *known == word)
                {
                    own(1).zip(own(2)).map(|(left, right)| Kind::Compare(sign, left, right))
                } else if let Some((_, sign)) =
                    CALCULATIONS.iter().find(|(known, _)| *known == word)
                {
                    let operands = own(2).zip(own(3));
                    own(1)
                        .zip(operands)
                        .map(|(to, (left, right))| Kind::Calculate(*sign, to, left, right))
                } else {
                    let is_known = REFUSED.contains(&word);
                    let message = if is_known {
                        format!("{word} is not supported")
                    } else {
                        format!("unknown element `{}`", shortened(word, 60))
                    };
                    self.error("U1073", message, span.clone());
                    return None;
                }
            }
        };
        // Later versions have further flags; 0 is what there was before.
        let wanted = match &found {
            None | Some(Kind::Comment(_)) => usize::MAX,
            Some(Kind::Wire(_) | Kind::Edge(_) | Kind::MasterRelay | Kind::Parallel(_)) => 1,
            Some(Kind::Reset(_)) => 2,
            Some(Kind::Calculate(..)) => 4,
            Some(Kind::Coil(..)) => 5,
            Some(_) => 3,
        };
        if let Some(more) = words.iter().skip(wanted).find(|word| **word != "0") {
            let message = format!(
                "`{}` has more than its kind has: `{}`",
                shortened(line, 60),
                shortened(more, 60)
            );
            self.error("U1072", message, span.clone());
        }
        if found.is_none() {
            self.error(
                "U1072",
                format!("`{}` has not what its kind needs", shortened(line, 60)),
                span.clone(),
            );
        }
        found
    }

    /// The name and the delay of a timer.
    fn delayed(
        &mut self,
        name: Option<String>,
        delay: Option<String>,
        span: &Range<usize>,
    ) -> Option<(String, Duration)> {
        let delay = Duration::from_micros(delay?.parse().ok()?);
        if delay > understudy_ladder::MAXIMUM_PRESET_TIME {
            self.error("U1072", "a delay of more than 100 days", span.clone());
        }
        Some((name?, delay))
    }
}

fn counter(counter: Counter, name: Option<String>, value: Option<String>) -> Option<Kind> {
    let value = value?.parse().ok().filter(|value| (-0x8000..0x8000).contains(value))?;
    Some(Kind::Counter(counter, name?, value))
}
