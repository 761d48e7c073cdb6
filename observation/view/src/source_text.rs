//! The text of a program with numbers: its lines, its units, and the names in each line.
//!
//! Of a program that is drawn the text is its listing. Lines of statements are those of the file, as errors and program faults name them.

use understudy_interchange::Listing;

/// A text by lines.
#[derive(Debug, Clone)]
pub(crate) struct SourceText<'t> {
    lines: Vec<Line<'t>>,
    /// The listing that this text is of, where the file has another form.
    listing: Option<&'t Listing>,
}

/// A line of Structured Text.
#[derive(Debug, Clone)]
pub(crate) struct Line<'t> {
    /// As it is written.
    pub(crate) text: &'t str,
    /// The unit that it belongs to, where there is one.
    pub(crate) unit: Option<&'t str>,
    /// Whether that unit is a program.
    pub(crate) is_program: bool,
    /// Names outside comments and texts, such as `pid.integral`, and what each does there.
    pub(crate) names: Vec<(&'t str, Use)>,
}

/// What a name does where it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    /// It is declared.
    Declared,
    /// It stands in a declaration behind the declared names: a type, or a part of an initial value; or it is a word of the section.
    Typed,
    /// It names a unit.
    Unit,
    /// It names a parameter in a call: `PV` in `regulator(PV := level)`.
    Parameter,
    /// A value is assigned to it.
    Written,
    /// Everything else: it is read, or a word of the language.
    Read,
}

/// Words that begin a unit whose name follows.
const UNITS: [&str; 4] = ["PROGRAM", "FUNCTION_BLOCK", "FUNCTION", "METHOD"];

/// Words that begin declarations, which END_VAR ends.
const SECTIONS: [&str; 10] = [
    "VAR",
    "VAR_INPUT",
    "VAR_OUTPUT",
    "VAR_IN_OUT",
    "VAR_TEMP",
    "VAR_STAT",
    "VAR_EXTERNAL",
    "VAR_GLOBAL",
    "VAR_CONFIG",
    "VAR_ACCESS",
];

/// Words of a section that are no names.
const QUALIFIERS: [&str; 8] =
    ["AT", "CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT", "R_EDGE", "F_EDGE", "PUBLIC"];

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Comment {
    #[default]
    None,
    Round,
    Slash,
    Pragma,
}

impl<'t> SourceText<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        let mut reader = Reader::default();
        let (mut unit, mut is_program) = (None, false);
        let mut lines = Vec::new();
        for text in text.lines() {
            let mut names = reader.names_in(text);
            let stored_to = stored_to(text).unwrap_or_default();
            for (name, kind) in &mut names {
                if *kind == Use::Read && stored_to.starts_with(*name) {
                    *kind = Use::Written;
                }
            }
            let mut ends = false;
            for place in 0..names.len() {
                let name = names[place].0;
                let is = |word: &str| name.eq_ignore_ascii_case(word);
                if UNITS.into_iter().any(is) {
                    // Modifiers of a method, such as PUBLIC, and its name.
                    let mut behind = names[place + 1..].iter_mut();
                    let is_modifier = |word: &str| {
                        let modifiers = ["PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL", "FINAL"];
                        modifiers.iter().any(|it| word.eq_ignore_ascii_case(it))
                    };
                    let own = behind.find(|(word, _)| !is_modifier(word));
                    unit = own.map(|(word, kind)| {
                        *kind = Use::Unit;
                        *word
                    });
                    is_program = is("PROGRAM");
                }
                ends |= name.get(..4).is_some_and(|head| head.eq_ignore_ascii_case("END_"))
                    && UNITS.into_iter().any(|word| name[4..].eq_ignore_ascii_case(word));
            }
            lines.push(Line { text, unit, is_program, names });
            if ends {
                unit = None;
            }
        }
        Self { lines, listing: None }
    }

    /// The text of a program in another form.
    pub(crate) fn of_listing(listing: &'t Listing) -> Self {
        Self { listing: Some(listing), ..Self::new(listing.text()) }
    }

    /// Whether the file is in another form.
    pub(crate) fn is_listing(&self) -> bool {
        self.listing.is_some()
    }

    /// The line of this text with the statement in a line of the file; of several the one that assigns `target`, else that which has the others in it.
    pub(crate) fn shown_line(&self, file_line: u32, target: Option<&str>) -> Option<u32> {
        let Some(listing) = self.listing else {
            return Some(file_line).filter(|line| *line > 0);
        };
        let lines = listing.lines(file_line);
        let mut assigning =
            lines.iter().filter(|line| target.is_some_and(|it| self.assigns(**line, it)));
        match (lines, assigning.next(), assigning.next()) {
            ([only], ..) => Some(*only),
            (_, Some(one), None) => Some(*one),
            ([first, ..], ..) => Some(*first).filter(|_| listing.is_one(file_line)),
            ([], ..) => None,
        }
    }

    /// Whether a line begins with the assignment of a variable, or with the call of the instance that it is of.
    fn assigns(&self, line: u32, target: &str) -> bool {
        let begins = |head: &str, sign: &str| {
            let text = self.line(line)?;
            let own = text.get(..head.len()).filter(|own| own.eq_ignore_ascii_case(head))?;
            text[own.len()..].trim_start().strip_prefix(sign)
        };
        let instance = target.rsplit_once('.').map(|(instance, _)| instance);
        begins(target, ":=").is_some() || instance.is_some_and(|it| begins(it, "(").is_some())
    }

    /// The statement in a line of the file that assigns `target`, where it is known which.
    pub(crate) fn statement(&self, file_line: u32, target: Option<&str>) -> Option<&'t str> {
        self.line(self.shown_line(file_line, target)?)
    }

    /// What the statement in a line of the file assigns, as it is written; nothing where several do.
    pub(crate) fn assigned(&self, file_line: u32) -> Option<&'t str> {
        let lines = self.listing.map_or(std::slice::from_ref(&file_line), |it| it.lines(file_line));
        let mut targets = lines.iter().filter_map(|line| self.line(*line)?.split_once(":="));
        let (target, _) = targets.next()?;
        targets.next().is_none().then_some(target.trim())
    }

    /// The line of the file with the statement that begins in a line of this text.
    pub(crate) fn file_line(&self, line: u32) -> Option<u32> {
        self.listing.map_or(Some(line), |listing| listing.file_line(line))
    }

    pub(crate) fn lines(&self) -> &[Line<'t>] {
        &self.lines
    }

    /// A line by its number, from 1, without its indentation.
    pub(crate) fn line(&self, number: u32) -> Option<&'t str> {
        let place = usize::try_from(number).ok()?.checked_sub(1)?;
        self.lines.get(place).map(|line| line.text.trim())
    }

    /// Whether a unit of this name is in the text, and not in a library. A method stands behind its block and a dot.
    pub(crate) fn declares(&self, routine: &str) -> bool {
        let own = routine.rsplit('.').next().unwrap_or(routine);
        let mut units = self.lines.iter().filter_map(|line| line.unit);
        units.any(|unit| unit.eq_ignore_ascii_case(own))
    }
}

/// What is known at the end of a line for the next one.
#[derive(Debug, Default)]
struct Reader {
    comment: Comment,
    /// Between VAR and END_VAR.
    in_declaration: bool,
    /// Behind the colon of a declaration.
    is_typed: bool,
    /// Parentheses that are open.
    depth: usize,
    /// Behind `=>`: the variable that takes an output.
    is_taking: bool,
}

impl Reader {
    /// Names with their parts, and what each does, outside comments and texts.
    fn names_in<'t>(&mut self, line: &'t str) -> Vec<(&'t str, Use)> {
        let mut names = Vec::new();
        let mut rest = line;
        while let Some(first) = rest.chars().next() {
            let end = match self.comment {
                Comment::Round => Some("*)"),
                Comment::Slash => Some("*/"),
                Comment::Pragma => Some("}"),
                Comment::None => None,
            };
            if let Some(end) = end {
                let Some(place) = rest.find(end) else {
                    return names;
                };
                rest = &rest[place + end.len()..];
                self.comment = Comment::None;
            } else if let Some(behind) = rest.strip_prefix("(*") {
                (self.comment, rest) = (Comment::Round, behind);
            } else if let Some(behind) = rest.strip_prefix("/*") {
                (self.comment, rest) = (Comment::Slash, behind);
            } else if rest.starts_with("//") {
                return names;
            } else if let Some(behind) = rest.strip_prefix('{') {
                (self.comment, rest) = (Comment::Pragma, behind);
            } else if first == '\'' || first == '"' {
                rest = behind_text(&rest[1..], first);
            } else if first.is_ascii_alphanumeric() || first == '_' || first == '%' {
                let (name, behind) = rest.split_at(end_of_name(rest, !self.in_declaration));
                if !first.is_ascii_digit() && !name.contains('#') {
                    names.push((name.trim_end_matches('.'), self.use_of(name, behind)));
                }
                rest = behind;
            } else {
                match first {
                    '(' => self.depth += 1,
                    ')' => self.depth = self.depth.saturating_sub(1),
                    ';' => (self.depth, self.is_typed) = (0, false),
                    ':' => self.is_typed = self.in_declaration,
                    _ => {}
                }
                self.is_taking = rest.starts_with("=>") || self.is_taking && !";,)".contains(first);
                rest = &rest[first.len_utf8()..];
                if first == '.' {
                    // A part of what an index chose.
                    rest = rest.trim_start_matches(|letter: char| {
                        letter.is_alphanumeric() || letter == '_'
                    });
                }
            }
        }
        names
    }

    fn use_of(&mut self, name: &str, behind: &str) -> Use {
        let is = |word: &str| name.eq_ignore_ascii_case(word);
        if SECTIONS.into_iter().any(is) {
            (self.in_declaration, self.is_typed) = (true, false);
            return Use::Typed;
        } else if name.eq_ignore_ascii_case("END_VAR") {
            self.in_declaration = false;
        }
        let assigned = behind_parts(behind);
        let (is_assigned, is_taken) = (assigned.starts_with(":="), assigned.starts_with("=>"));
        match () {
            () if self.in_declaration && (self.is_typed || QUALIFIERS.into_iter().any(is)) => {
                Use::Typed
            }
            () if self.in_declaration => Use::Declared,
            () if self.depth > 0 && (is_assigned || is_taken) => Use::Parameter,
            () if is_assigned || std::mem::take(&mut self.is_taking) => Use::Written,
            () => Use::Read,
        }
    }
}

/// The operand that a line of an instruction list assigns: `q` in `done: ST q`.
fn stored_to(line: &str) -> Option<&str> {
    let mut words = line.split_whitespace().skip_while(|word| word.ends_with(':'));
    let operator = words.next()?;
    let stores = ["ST", "STN", "S", "R"].into_iter().any(|it| operator.eq_ignore_ascii_case(it));
    words.next().filter(|_| stores)
}

/// Where a name ends with its parts and, if it is `indexed`, with the elements that a number chooses: `a.b[2].c`.
fn end_of_name(text: &str, indexed: bool) -> usize {
    let is_part = |letter: char| letter.is_alphanumeric() || "_.#%".contains(letter);
    let end_from = |start: usize| {
        text[start..].find(|letter| !is_part(letter)).map_or(text.len(), |length| start + length)
    };
    let mut end = end_from(0);
    while indexed
        && let Some((index, _)) = text[end..].strip_prefix('[').and_then(|it| it.split_once(']'))
    {
        let number = index.strip_prefix('-').unwrap_or(index);
        if number.is_empty() || !number.bytes().all(|digit| digit.is_ascii_digit()) {
            break;
        }
        end = end_from(end + index.len() + 2);
    }
    end
}

/// What follows a text in quotes, from behind the first one on: a quote behind `$` is part of the text.
fn behind_text(inside: &str, quote: char) -> &str {
    let mut letters = inside.char_indices();
    while let Some((place, letter)) = letters.next() {
        if letter == '$' {
            letters.next();
        } else if letter == quote {
            return &inside[place + 1..];
        }
    }
    ""
}

/// What stands behind the indices and parts that follow a name: ` := 1` behind `a` in `a[2].b := 1`.
fn behind_parts(mut behind: &str) -> &str {
    loop {
        behind = behind.trim_start();
        let Some(inside) = behind.strip_prefix('[') else {
            break;
        };
        let mut depth = 1;
        let end = inside.find(|letter| {
            depth += i32::from(letter == '[') - i32::from(letter == ']');
            depth == 0
        });
        behind = end.map_or("", |end| &inside[end + 1..]);
        behind = behind
            .trim_start_matches(|letter: char| letter.is_alphanumeric() || "_.^".contains(letter));
    }
    behind.trim_start_matches('^').trim_start()
}

#[cfg(test)]
mod tests {
    use understudy_cluster::{Overrides, read_with};

    use super::*;

    #[test]
    fn names_are_found_outside_comments_and_texts() {
        let text = "FUNCTION_BLOCK lag\nEND_FUNCTION_BLOCK\nPROGRAM main (* of the\ntank *) a.b := 'x' + c; // d\nEND_PROGRAM\n";
        let source = SourceText::new(text);
        let names = |place: usize| -> Vec<&str> {
            let names = source.lines()[place].names.iter();
            names.map(|(name, _)| *name).collect()
        };
        assert_eq!(names(2), ["PROGRAM", "main"]);
        assert_eq!(names(3), ["a.b", "c"]);
        let list = "PROGRAM one\nLD a\nl: stn b[2]\nS c (* a *)\nEND_PROGRAM\n";
        let list = SourceText::new(list);
        let used = list.lines()[1..4].iter().map(|line| line.names[line.names.len() - 1]);
        let expected = [("a", Use::Read), ("b[2]", Use::Written), ("c", Use::Written)];
        assert_eq!(used.collect::<Vec<_>>(), expected);
        let text = "PROGRAM one\nVAR a : ARRAY[0..2] OF BOOL; END_VAR\na[1] := b.c[2].d; a[i] := a[2 + i]; a[ := 0\nEND_PROGRAM\n";
        assert_eq!(
            SourceText::new(text).lines()[2].names,
            [
                ("a[1]", Use::Written),
                ("b.c[2].d", Use::Read),
                ("a", Use::Written),
                ("i", Use::Read),
                ("a", Use::Read),
                ("i", Use::Read),
                ("a", Use::Read)
            ]
        );
        assert_eq!(source.lines()[3].unit, Some("main"));
        assert!(source.lines()[3].is_program && !source.lines()[0].is_program);
        assert!(source.declares("LAG"));
        assert!(!source.declares("PID"));
        assert_eq!(source.line(5), Some("END_PROGRAM"));
        assert_eq!(source.line(0), None);
    }

    /// Every declared name of the examples, once: no type and no part of an initial value is one.
    #[test]
    fn a_name_is_declared_where_the_language_declares_it() {
        let mut programs = 0;
        for example in ["heated-tank", "two-shuttles", "tennessee-eastman"] {
            let folder = format!("{}/../../examples/{example}", env!("CARGO_MANIFEST_DIR"));
            let file = |name: &str| {
                std::fs::read_to_string(format!("{folder}/{name}"))
                    .map_err(|error| error.to_string())
            };
            let text = file("cluster.toml").expect("the example is whole");
            let read =
                read_with("cluster.toml", &text, Overrides::default(), &mut |name| file(name));
            for controller in read.cluster.expect("right").controllers() {
                let code = &controller.code;
                let (typed, text) = (code.typed(), &code.source().text);
                let source = SourceText::new(text);
                let lines = source.lines().iter().filter(|line| line.is_program);
                let declared = lines
                    .flat_map(|line| &line.names)
                    .filter(|(name, kind)| *kind == Use::Declared && !name.starts_with('%'));
                let mut declared: Vec<String> =
                    declared.map(|(name, _)| name.to_lowercase()).collect();
                declared.sort();
                let variables = typed.variables.iter().map(|of| of.name.to_lowercase());
                let mut variables: Vec<String> =
                    variables.filter(|name| !name.starts_with("program.")).collect();
                variables.sort();
                // Constants are declared and no variables.
                let text = text.to_lowercase();
                declared.retain(|name| {
                    variables.contains(name) || !text.contains(&format!(" {name} : "))
                });
                assert_eq!(declared, variables, "{example}");
                programs += 1;
            }
        }
        assert!(programs > 6, "{programs}");
        let text = "PROGRAM p\nVAR RETAIN\n  {attribute 'hidden'} recipe : ARRAY [1..2] OF stage := [\n\
            (temperature := 30.0, name := 'it$'s stage', pause := T#2s),\n  (temperature := low)];\n  stage, low : INT := top; t : ton;\n\
            END_VAR\n  stage := low;\nEND_PROGRAM\n";
        let source = SourceText::new(text);
        let names = source.lines().iter().flat_map(|line| &line.names);
        let declared = names.filter(|(_, kind)| *kind == Use::Declared);
        let declared: Vec<&str> = declared.map(|(name, _)| *name).collect();
        assert_eq!(declared, ["recipe", "stage", "low", "t"]);
        assert_eq!(source.lines()[7].names, [("stage", Use::Written), ("low", Use::Read)]);
    }

    #[test]
    fn a_name_is_declared_given_written_or_read() {
        let text = "PROGRAM level\nVAR_INPUT\n  level AT %ID0, SP : REAL := top;\nEND_VAR\n\
            pid(SP := SP + a[SP], XOUT => level,\n  PV := level);\n\
            t[SP].x[b[1]] := level * (SP - 1);\np^ := a[1] = SP;\nEND_PROGRAM\n";
        let source = SourceText::new(text);
        let uses = |line: usize| source.lines()[line - 1].names.clone();
        assert_eq!(uses(1)[1], ("level", Use::Unit));
        let expected = [
            ("level", Use::Declared),
            ("AT", Use::Typed),
            ("%ID0", Use::Declared),
            ("SP", Use::Declared),
            ("REAL", Use::Typed),
            ("top", Use::Typed),
        ];
        assert_eq!(uses(3), expected);
        let expected = [
            ("pid", Use::Read),
            ("SP", Use::Parameter),
            ("SP", Use::Read),
            ("a", Use::Read),
            ("SP", Use::Read),
            ("XOUT", Use::Parameter),
            ("level", Use::Written),
        ];
        assert_eq!(uses(5), expected);
        assert_eq!(uses(6), [("PV", Use::Parameter), ("level", Use::Read)]);
        let written: Vec<_> = [uses(7), uses(8)].concat();
        let written = written.iter().filter(|(_, kind)| *kind == Use::Written);
        assert_eq!(written.map(|(name, _)| *name).collect::<Vec<_>>(), ["t", "p"]);
    }
}
