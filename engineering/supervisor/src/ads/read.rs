use std::collections::HashMap;
use std::ops::Range;
use understudy_text::spelling::nearest;

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS, shortened};

use super::{MAXIMUM_LABEL, MAXIMUM_STATES, Vocal};
use crate::alphabet::Label;
use crate::automaton::{Automaton, AutomatonError, State, Transition};

/// What was read from an .ADS file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Read {
    /// The automaton; none where one of the diagnostics is an error.
    pub automaton: Option<Automaton>,
    /// Its vocal states.
    pub vocal: Vec<Vocal>,
    /// What is wrong with the file, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads an .ADS text and finds everything that is wrong with it (U0810 to U0819).
pub fn read_ads(text: &str) -> Read {
    let mut reader = Reader::default();
    for line in lines(text) {
        if reader.diagnostics.len() >= MAXIMUM_FINDINGS {
            reader.diagnostics.push(Diagnostic::too_many(line.start));
            break;
        }
        reader.line(text, line);
    }
    reader.finish(text)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Size,
    Marker,
    Vocal,
    Transitions,
}

impl Section {
    const ALL: [Self; 4] = [Self::Size, Self::Marker, Self::Vocal, Self::Transitions];

    fn heading(self) -> &'static str {
        match self {
            Self::Size => "State size (State set will be (0,1....,size-1)):",
            Self::Marker => "Marker states:",
            Self::Vocal => "Vocal states:",
            Self::Transitions => "Transitions:",
        }
    }

    /// The words that begin a heading, in small letters.
    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Size => &["state size", "state set size", "state set"],
            Self::Marker => &["marker state", "marked state"],
            Self::Vocal => &["vocal state"],
            Self::Transitions => &["transition"],
        }
    }

    fn of(line: &str) -> Option<Self> {
        let line = line.to_lowercase();
        let words = line.split_whitespace().collect::<Vec<_>>().join(" ");
        Self::ALL
            .into_iter()
            .find(|section| section.words().iter().any(|begin| words.starts_with(begin)))
    }

    fn nearest(line: &str) -> Option<Self> {
        let line = line.trim_end_matches(':').to_lowercase();
        let words = Self::ALL.iter().flat_map(|section| section.words());
        nearest(&line, words.copied()).and_then(Self::of)
    }
}

/// Places of what is left of each line when comment and white space are off it; nothing of a line where nothing is left.
fn lines(text: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut start = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    let body = &text[start..];
    body.split_inclusive(['\n', '\r']).filter_map(move |line| {
        let at = start;
        start += line.len();
        let said = line.split('#').next().unwrap_or_default();
        let trimmed = said.trim();
        let begin = at + (said.len() - said.trim_start().len());
        (!trimmed.is_empty()).then(|| begin..begin + trimmed.len())
    })
}

fn words(text: &str, line: Range<usize>) -> Vec<Range<usize>> {
    let said = &text[line.clone()];
    said.split_whitespace()
        .map(|word| {
            let start = line.start + (word.as_ptr() as usize - said.as_ptr() as usize);
            start..start + word.len()
        })
        .collect()
}

/// The longest line that is quoted, in characters; a heading is shorter.
const MAXIMUM_QUOTE: usize = 120;

/// A number with its position.
type Placed<T> = (T, Range<usize>);

#[derive(Default)]
struct Reader {
    name: Option<String>,
    section: Option<Section>,
    headings: Vec<Placed<Section>>,
    size: Option<Placed<u64>>,
    all_marked: bool,
    marked: Vec<Placed<u64>>,
    vocal: Vec<Placed<[u64; 2]>>,
    transitions: Vec<Placed<[u64; 3]>>,
    diagnostics: Vec<Diagnostic>,
}

impl Reader {
    fn line(&mut self, text: &str, line: Range<usize>) {
        let said = &text[line.clone()];
        let heading = Section::of(said);
        match (self.section, heading) {
            (None, Some(Section::Size)) => self.heading(Section::Size, line),
            (None, _) if self.name.is_none() => self.name = Some(said.to_owned()),
            (_, Some(section)) => self.heading(section, line),
            (None, None) => self.expected_heading(line),
            (Some(section), None) => self.entry(text, section, line),
        }
    }

    fn heading(&mut self, section: Section, line: Range<usize>) {
        let known = self.headings.iter().find(|(other, _)| *other == section);
        if let Some((_, before)) = known {
            let message = format!("the heading \"{}\" stands twice", section.heading());
            self.diagnostics.push(
                Diagnostic::error("U0811", message, line)
                    .with_related(before.clone(), "it stands here already"),
            );
        } else {
            self.headings.push((section, line));
        }
        self.section = Some(section);
    }

    fn expected_heading(&mut self, line: Range<usize>) {
        let message = "the name is one line, and then comes the number of states";
        self.diagnostics.push(
            Diagnostic::error("U0810", message, line)
                .with_label(format!("expected \"{}\"", Section::Size.heading())),
        );
    }

    fn entry(&mut self, text: &str, section: Section, line: Range<usize>) {
        let words = words(text, line.clone());
        if section == Section::Marker && &text[line.clone()] == "*" {
            self.all_marked = true;
            return;
        }
        let mut numbers = Vec::with_capacity(words.len());
        for word in &words {
            match text[word.clone()].parse::<u64>() {
                Ok(number) => numbers.push(number),
                Err(_) => {
                    self.not_a_number(&text[line.clone()], section, word.clone());
                    return;
                }
            }
        }
        match section {
            Section::Size => match (numbers.as_slice(), &self.size) {
                (&[size], None) => self.size = Some((size, line)),
                _ => self.wrong_count("one number, the number of states", line),
            },
            Section::Marker => self.marked.extend(numbers.into_iter().zip(words)),
            Section::Vocal => match numbers.as_slice() {
                &[state, output] => self.vocal.push(([state, output], line)),
                _ => self.wrong_count("a state and its output", line),
            },
            Section::Transitions => match numbers.as_slice() {
                &[source, label, target] => self.transitions.push(([source, label, target], line)),
                _ => self.wrong_count("exit state, label, entrance state", line),
            },
        }
    }

    fn not_a_number(&mut self, line: &str, section: Section, word: Range<usize>) {
        let expected = match section {
            Section::Size => "the number of states",
            Section::Marker => "a state, or * for all",
            Section::Vocal => "a state and its output",
            Section::Transitions => "exit state, label, entrance state",
        };
        let line = shortened(line, MAXIMUM_QUOTE);
        let message = format!("\"{line}\" is neither a heading nor a list of numbers from 0 up");
        let mut diagnostic =
            Diagnostic::error("U0812", message, word).with_label(format!("expected {expected}"));
        if let Some(near) = Section::nearest(&line) {
            diagnostic = diagnostic.with_help(format!("did you mean \"{}\"?", near.heading()));
            // So that what follows is not taken for what it is not.
            self.section = Some(near);
        }
        self.diagnostics.push(diagnostic);
    }

    fn wrong_count(&mut self, expected: &str, line: Range<usize>) {
        let message = "a line of this list has more or fewer numbers";
        self.diagnostics.push(
            Diagnostic::error("U0813", message, line).with_label(format!("expected {expected}")),
        );
    }

    fn state(&mut self, number: u64, place: &Range<usize>) -> Option<State> {
        let (size, size_place) = self.size.as_ref()?;
        if number < *size {
            return Some(State::new(number as u32));
        }
        let states = match *size {
            0 => "no states".to_owned(),
            1 => "only state 0".to_owned(),
            size => format!("states 0 to {}", size - 1),
        };
        let message = format!("there is no state {number}: the automaton has {states}");
        self.diagnostics.push(
            Diagnostic::error("U0814", message, place.clone())
                .with_related(size_place.clone(), "the number of states"),
        );
        None
    }

    fn label(&mut self, number: u64, place: &Range<usize>) -> Option<Label> {
        if number <= u64::from(MAXIMUM_LABEL) {
            return Some(Label::new(number as u32));
        }
        let message = format!("label {number}: the labels of this format are 0 to {MAXIMUM_LABEL}");
        self.diagnostics.push(
            Diagnostic::error("U0815", message, place.clone())
                .with_help("odd labels are controllable events, even ones are not"),
        );
        None
    }

    fn finish(mut self, text: &str) -> Read {
        self.check_headings(text);
        if let Some((size, place)) = self.size.take() {
            if size > MAXIMUM_STATES as u64 {
                let message =
                    format!("{size} states: the format has room for {MAXIMUM_STATES} states");
                self.diagnostics.push(Diagnostic::error("U0817", message, place));
            } else {
                self.size = Some((size, place));
            }
        }
        let marked = self.take_marked();
        let vocal = self.take_vocal();
        let transitions = self.take_transitions(text);
        self.diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
        let automaton = if understudy_text::has_errors(&self.diagnostics) {
            None
        } else {
            let name = self.name.take().unwrap_or_default();
            self.build(name, marked, transitions)
        };
        Read { automaton, vocal, diagnostics: self.diagnostics }
    }

    fn check_headings(&mut self, text: &str) {
        let end = text.trim_end().len();
        for section in [Section::Size, Section::Marker, Section::Transitions] {
            if !self.headings.iter().any(|(known, _)| *known == section) {
                let message = format!("the heading \"{}\" is missing", section.heading());
                self.diagnostics.push(Diagnostic::error("U0810", message, end..end));
            }
        }
        let size_heading = self.headings.iter().find(|(section, _)| *section == Section::Size);
        if let (Some((_, place)), None) = (size_heading, &self.size) {
            let message = "the number of states is missing";
            self.diagnostics.push(
                Diagnostic::error("U0812", message, place.clone())
                    .with_label("expected a number on the line below"),
            );
        }
    }

    fn take_marked(&mut self) -> Vec<bool> {
        let states = self.size.as_ref().map_or(0, |(size, _)| *size as usize);
        let mut marked = vec![self.all_marked; states];
        for (number, place) in std::mem::take(&mut self.marked) {
            if let Some(state) = self.state(number, &place) {
                marked[state.index()] = true;
            }
        }
        marked
    }

    fn take_vocal(&mut self) -> Vec<Vocal> {
        let mut vocal = Vec::new();
        for ([state, output], place) in std::mem::take(&mut self.vocal) {
            let state = self.state(state, &place);
            if !(10..=99).contains(&output) {
                let message = format!("vocal output {output}: outputs are 10 to 99");
                self.diagnostics.push(Diagnostic::error("U0816", message, place));
            } else if let Some(state) = state {
                vocal.push(Vocal { state, output: output as u8 });
            }
        }
        vocal
    }

    fn take_transitions(&mut self, text: &str) -> Vec<Transition> {
        let mut known: HashMap<(State, Label), (State, Range<usize>)> = HashMap::new();
        let mut transitions = Vec::with_capacity(self.transitions.len());
        for ([source, label, target], line) in std::mem::take(&mut self.transitions) {
            let places = words(text, line.clone());
            let source = self.state(source, &places[0]);
            let label = self.label(label, &places[1]);
            let target = self.state(target, &places[2]);
            let (Some(source), Some(label), Some(target)) = (source, label, target) else {
                continue;
            };
            match known.get(&(source, label)) {
                None => {
                    known.insert((source, label), (target, line));
                    transitions.push(Transition { source, label, target });
                }
                Some((first, before)) if *first == target => {
                    let message = format!("the transition {source} {label} {target} stands twice");
                    self.diagnostics.push(
                        Diagnostic::warning("U0819", message, line)
                            .with_related(before.clone(), "it stands here already"),
                    );
                }
                Some((first, before)) => {
                    let message = format!(
                        "from state {source} event {label} leads to state {first} and to state {target}; an automaton must be deterministic"
                    );
                    self.diagnostics.push(
                        Diagnostic::error("U0818", message, line)
                            .with_related(before.clone(), format!("here to state {first}"))
                            .with_help("give the two events labels of their own"),
                    );
                }
            }
        }
        transitions
    }

    /// All errors of `Automaton::new` were reported with their positions.
    fn build(
        &mut self,
        name: String,
        marked: Vec<bool>,
        transitions: Vec<Transition>,
    ) -> Option<Automaton> {
        let built = Automaton::new(name, [], marked, transitions);
        built
            .map_err(|error: AutomatonError| {
                self.diagnostics.push(Diagnostic::error(error.code(), error.to_string(), 0..0));
            })
            .ok()
    }
}
