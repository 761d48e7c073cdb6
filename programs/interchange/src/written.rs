//! A program in a form, and what of it is not in the written text.
//!
//! Invariant: what is said about a text was found in the text. It is read back, and every declaration, block and comment of the program is looked
//! for in what was read; then it is proved, or seen in scans, that every output, memory bit and output of a block is the same after every scan.

mod behaviour;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::time::Duration;

use understudy_ladder::{
    Block, LowerError, Name, PERIODS, Program, Signal, StandardNames, edge_names, print,
    structured_text,
};
use understudy_logic::Circuit;
use understudy_text::{Diagnostic, Severity};

use self::behaviour::Pair;
use crate::format::{Format, Reading, read};
use crate::{digraph, plcopen};

/// From one scan to the next, where nothing says it.
pub const USUAL_PERIOD: Duration = Duration::from_millis(10);

/// Names that one warning lists.
const MAXIMUM_LISTED: usize = 5;

/// A program in a form.
#[derive(Debug, Clone)]
pub struct Written {
    /// The text.
    pub text: String,
    /// What the text does not hold, each a warning.
    pub losses: Vec<Diagnostic>,
    /// What was compared.
    pub compared: Compared,
}

/// What was looked for in a written text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Compared {
    /// Declared inputs, outputs and memory bits: name, address, initial value, place among the others, comments.
    pub signals: usize,
    /// Blocks: name, type and preset.
    pub blocks: usize,
    /// Titles and comments of the program and its rungs.
    pub comments: usize,
    /// Scans with equal outputs, memory bits and outputs of blocks.
    pub scans: usize,
    /// These are equal in every scan, whatever the inputs are: that was proved.
    pub proved: bool,
}

/// Why a program was not written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WriteError {
    /// Nothing writes this form.
    #[error("files of LDmicro are read only; write .ladder, .xml or .st")]
    ReadOnly,
    /// The program cannot run at this period.
    #[error(transparent)]
    Program(#[from] LowerError),
    /// The form cannot hold the program, or is not written with what it has.
    #[error("{0}")]
    NotHeld(String),
    /// A defect of the writer.
    #[error("the written text is not the program, and was discarded: {0}")]
    Different(String),
}

/// `program` in the form `format`; `period` is the interval of its task, where it is known.
///
/// # Errors
/// A form that is not written, a program that cannot run, or a text that does something else than the program.
pub fn write(
    format: Format,
    program: &Program,
    period: Option<Duration>,
) -> Result<Written, WriteError> {
    let interval = period.unwrap_or(USUAL_PERIOD);
    let text = match format {
        Format::Ladder => print(program),
        Format::PlcOpen => plcopen::write(program, interval),
        Format::StructuredText => structured_text(program, interval),
        Format::Digraph => digraph::write(program),
        Format::LdMicro => return Err(WriteError::ReadOnly),
    };
    let (losses, compared) = compare(format, program, period, &text)?;
    Ok(Written { text, losses, compared })
}

/// What `text` does not hold of `program`.
fn compare(
    format: Format,
    program: &Program,
    period: Option<Duration>,
    text: &str,
) -> Result<(Vec<Diagnostic>, Compared), WriteError> {
    let interval = period.unwrap_or(USUAL_PERIOD);
    let before = program.lower_observed(interval)?;
    let reading = read(format, &program.name, text, None);
    let Some(again) = &reading.program else {
        return Err(WriteError::Different(refusal(&reading)));
    };
    let mut comparison = Comparison::new(format, program, again);
    comparison.period(period, reading.period);
    comparison.signals();
    comparison.blocks();
    comparison.retained();
    comparison.comments();
    comparison.behaviour(&before, interval)?;
    Ok((comparison.losses, comparison.compared))
}

/// Why a text was not read.
fn refusal(reading: &Reading) -> String {
    let mut found = reading.diagnostics.iter();
    let first = found.find(|found| found.severity == Severity::Error);
    first.map_or_else(
        || "it holds no program".to_owned(),
        |first| format!("{} {}", first.code, first.message),
    )
}

/// A program with what was read of its text.
struct Comparison<'a> {
    format: Format,
    program: &'a Program,
    again: &'a Program,
    /// The names in the text of what the program declares.
    names: HashMap<&'a str, String>,
    /// What the text calls what sees edges.
    edges: HashMap<String, String>,
    losses: Vec<Diagnostic>,
    compared: Compared,
}

/// What sees edges in a program, and in what was read of its text: a block there in Structured Text, else in the order of the scan.
fn edges(format: Format, program: &Program, again: &Program) -> HashMap<String, String> {
    let own = edge_names(program);
    if format == Format::StructuredText {
        return own.into_iter().collect();
    }
    let again = edge_names(again).into_iter().map(|(name, _)| name);
    own.into_iter().map(|(name, _)| name).zip(again).collect()
}

impl<'a> Comparison<'a> {
    fn new(format: Format, program: &'a Program, again: &'a Program) -> Self {
        let standard = StandardNames::of(program);
        let is_standard = matches!(format, Format::PlcOpen | Format::StructuredText);
        let name = |name: &'a Name| {
            let written =
                if is_standard { standard.signal(name).to_owned() } else { name.to_string() };
            (name.as_str(), written)
        };
        let signals = signals(program).map(|signal| name(&signal.name));
        let blocks = program.blocks().into_iter().map(|block| name(&block.name));
        Self {
            format,
            program,
            again,
            names: signals.chain(blocks).collect(),
            edges: edges(format, program, again),
            losses: Vec::new(),
            compared: Compared::default(),
        }
    }

    /// A warning about all of one kind that the text does not hold.
    fn lost(&mut self, what: &str, names: &[String], help: &str) {
        if names.is_empty() {
            return;
        }
        let listed = names.iter().take(MAXIMUM_LISTED).cloned();
        let mut listed = listed.collect::<Vec<_>>().join(", ");
        if let Some(more @ 1..) = names.len().checked_sub(MAXIMUM_LISTED) {
            listed = format!("{listed} and {more} more");
        }
        let message = format!("{} {what}: {listed}", self.format.title());
        let warning = Diagnostic::warning("U1018", message, 0..0);
        self.losses.push(match help {
            "" => warning,
            help => warning.with_help(help),
        });
    }

    fn period(&mut self, period: Option<Duration>, read: Option<Duration>) {
        if let Some(period) = period
            && read != Some(period)
        {
            let help = "write it into the cluster file, or give it with --period";
            let period = understudy_text::duration::text(period);
            self.lost("does not keep the interval of the task", &[period], help);
        }
    }

    fn signals(&mut self) {
        let (program, again) = (self.program, self.again);
        let mut missing = Vec::new();
        let mut addresses = Vec::new();
        let mut initial = Vec::new();
        let mut renamed = Vec::new();
        let mut moved = Vec::new();
        let mut silent = Vec::new();
        if !again.name.eq_ignore_ascii_case(&program.name) {
            renamed.push(format!("`{}` as `{}`", program.name, again.name));
        }
        for (before, after) in [
            (&program.inputs, &again.inputs),
            (&program.outputs, &again.outputs),
            (&program.memory, &again.memory),
        ] {
            let places: HashMap<&str, usize> = after
                .iter()
                .enumerate()
                .map(|(place, signal)| (signal.name.as_str(), place))
                .collect();
            let mut last = None;
            for signal in before {
                self.compared.signals += 1;
                let shown = format!("`{}`", signal.name);
                let written = &self.names[signal.name.as_str()];
                let Some(&place) = places.get(written.as_str()) else {
                    missing.push(shown);
                    continue;
                };
                let found = &after[place];
                if found.name != signal.name {
                    renamed.push(format!("{shown} as `{}`", found.name));
                }
                if found.address != signal.address {
                    let address = signal.address.as_ref();
                    let address = address.map_or("without one".to_owned(), ToString::to_string);
                    addresses.push(format!("{shown} {address}"));
                }
                if found.initial.unwrap_or(false) != signal.initial.unwrap_or(false) {
                    initial.push(shown.clone());
                }
                if last > Some(place) {
                    moved.push(shown.clone());
                }
                last = last.max(Some(place));
                let about = letters(&about(found));
                let texts = signal.comments.iter().chain(&signal.description);
                if !texts.into_iter().all(|text| about.contains(&letters(text))) {
                    silent.push(shown);
                }
            }
        }
        self.lost("does not keep these declarations", &missing, "");
        self.lost("does not keep these addresses", &addresses, "");
        self.lost("does not keep these initial values", &initial, "");
        self.lost("has these names otherwise", &renamed, "");
        self.lost("declares these in another order", &moved, "");
        self.lost("does not keep the comments of these", &silent, "");
    }

    fn blocks(&mut self) {
        let found = self.again.blocks();
        let found: HashMap<&str, &Block> =
            found.into_iter().map(|block| (block.name.as_str(), block)).collect();
        let (mut missing, mut renamed) = (Vec::new(), Vec::new());
        for block in self.program.blocks() {
            self.compared.blocks += 1;
            let written = &self.names[block.name.as_str()];
            match found.get(written.as_str()) {
                Some(found) if found.kind == block.kind => {
                    if *written != *block.name {
                        renamed.push(format!("`{}` as `{written}`", block.name));
                    }
                }
                _ => missing.push(format!("`{}`", block.name)),
            }
        }
        self.lost("does not keep these blocks as they are", &missing, "");
        self.lost("has these names of blocks otherwise", &renamed, "");
    }

    fn retained(&mut self) {
        let (program, again) = (self.program, self.again);
        let found: HashSet<&str> = again.retained.iter().map(Name::as_str).collect();
        let mut wanted = HashSet::new();
        let mut lost = Vec::new();
        for name in &program.retained {
            let written = self.names.get(name.as_str()).map_or("", String::as_str);
            wanted.insert(written);
            if !found.contains(written) {
                lost.push(format!("`{name}`"));
            }
        }
        let more = again.retained.iter().filter(|name| !wanted.contains(name.as_str()));
        let more: Vec<String> = more.map(|name| format!("`{name}`")).collect();
        self.lost("does not keep that these are retentive", &lost, "");
        self.lost("makes these retentive", &more, "");
    }

    fn comments(&mut self) {
        // Forms keep what is said about the program in one text.
        let head: String = head(self.again).collect();
        let head = letters(&head);
        let mut left: BTreeMap<String, usize> = BTreeMap::new();
        for line in lines(self.again) {
            *left.entry(letters(line)).or_default() += 1;
        }
        let mut missing = Vec::new();
        let (program, mut count) = (self.program, 0);
        for line in head_lines(program) {
            count += 1;
            if !head.contains(&letters(line)) {
                missing.push(format!("{:?}", shortened(line)));
            }
        }
        for line in lines(program) {
            count += 1;
            match left.get_mut(&letters(line)) {
                Some(count @ 1..) => *count -= 1,
                _ => missing.push(format!("{:?}", shortened(line))),
            }
        }
        self.compared.comments = count;
        self.lost("does not keep these comments", &missing, "");
    }

    /// Proves both equal at the period of the program, and scans them there and at one at which the longest timer ends after a few scans.
    fn behaviour(&mut self, before: &Circuit, period: Duration) -> Result<(), WriteError> {
        let blocks: HashSet<String> =
            self.program.blocks().into_iter().map(|block| block.name.to_string()).collect();
        let after = self.again.lower_observed(period)?;
        let pair = self.pair(before, &after, &blocks)?;
        self.compared.proved = pair.is_proved(|name| self.written(name, &blocks));
        self.compared.scans = equal_scans(&pair, period)?;
        let presets = self.program.blocks().into_iter();
        let longest = presets.filter_map(|block| block.kind.preset_time()).max();
        let coarse = (longest.unwrap_or_default() / 3).min(*PERIODS.end());
        if coarse > period {
            let before = self.program.lower_observed(coarse)?;
            let after = self.again.lower_observed(coarse)?;
            let pair = self.pair(&before, &after, &blocks)?;
            self.compared.scans += equal_scans(&pair, coarse)?;
        }
        Ok(())
    }

    /// The name in the text of a signal, of something that a block has, such as `pause.Q`, or of what an edge contact or coil keeps.
    fn written(&self, name: &str, blocks: &HashSet<String>) -> Option<String> {
        if let Some(written) = self.names.get(name) {
            return Some(written.clone());
        }
        if let Some((edge, keeps)) = name.rsplit_once('.')
            && let Some(written) = self.edges.get(edge)
        {
            return Some(format!("{written}.{keeps}"));
        }
        let dots = name.match_indices('.').rev();
        let mut blocks_before =
            dots.map(|(dot, _)| dot).filter(|&dot| blocks.contains(&name[..dot]));
        let dot = blocks_before.next()?;
        Some(format!("{}{}", self.names.get(&name[..dot])?, &name[dot..]))
    }

    /// Both circuits with what is the same in them; what is missing has been said.
    fn pair<'c>(
        &self,
        before: &'c Circuit,
        after: &'c Circuit,
        blocks: &HashSet<String>,
    ) -> Result<Pair<'c>, WriteError> {
        let (wanted, found) = (before.inputs().len(), after.inputs().len());
        if wanted != found {
            let message = format!("it has {found} inputs, and the program {wanted}");
            return Err(WriteError::Different(message));
        }
        let places: HashMap<&str, usize> = after
            .outputs()
            .iter()
            .enumerate()
            .map(|(place, output)| (output.name.as_str(), place))
            .collect();
        let outputs = before.outputs().iter().enumerate();
        let outputs = outputs.filter_map(|(place, output)| {
            let written = self.written(&output.name, blocks)?;
            Some((place, *places.get(written.as_str())?))
        });
        let counters = self.program.blocks().into_iter().filter_map(|block| {
            let preset = block.kind.preset_value()?;
            Some((format!("{}.CV", block.name), preset))
        });
        Ok(Pair { before, after, outputs: outputs.collect(), counters: counters.collect() })
    }
}

/// How many scans are equal; the first that is not is an error.
fn equal_scans(pair: &Pair<'_>, period: Duration) -> Result<usize, WriteError> {
    match pair.difference() {
        Err(scans) => Ok(scans),
        Ok((scan, place)) => {
            let name = &pair.before.outputs()[place].name;
            let message = format!("`{name}` differs in scan {scan} at {period:?}");
            Err(WriteError::Different(message))
        }
    }
}

fn signals(program: &Program) -> impl Iterator<Item = &Signal> {
    program.inputs.iter().chain(program.writable())
}

/// All that is said about a signal.
fn about(signal: &Signal) -> String {
    let texts = signal.comments.iter().chain(&signal.description);
    texts.map(String::as_str).collect()
}

/// What is said about the program.
fn head(program: &Program) -> impl Iterator<Item = &str> {
    let texts = program.comments.iter().chain(&program.description);
    texts.map(String::as_str)
}

fn head_lines(program: &Program) -> impl Iterator<Item = &str> {
    head(program).flat_map(str::lines).filter(|line| says(line))
}

/// Titles and comments of rungs, and the text below them, line by line.
fn lines(program: &Program) -> impl Iterator<Item = &str> {
    let rungs = program.rungs.iter();
    let rungs = rungs.flat_map(|rung| rung.title.iter().chain(&rung.comments));
    let texts = rungs.chain(&program.footer);
    texts.flat_map(|text| text.lines()).filter(|line| says(line))
}

fn says(line: &str) -> bool {
    !letters(line).is_empty()
}

/// A text without the blanks between its letters: forms break and join lines.
fn letters(text: &str) -> String {
    let is_letter = |letter: &char| !letter.is_whitespace() && !letter.is_control();
    text.chars().filter(is_letter).collect()
}

fn shortened(line: &str) -> String {
    let mut short: String = line.chars().take(40).collect();
    if short.len() < line.len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests;
