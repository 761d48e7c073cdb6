//! The text of a program with numbers: its lines, its units, and the names in each line.

/// A text by lines.
#[derive(Debug, Clone)]
pub(crate) struct SourceText<'t> {
    lines: Vec<Line<'t>>,
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
    /// Names outside comments and texts, such as `pid.integral`, each with what is behind it.
    pub(crate) names: Vec<(&'t str, &'t str)>,
}

/// Words that begin a unit whose name follows.
const UNITS: [&str; 4] = ["PROGRAM", "FUNCTION_BLOCK", "FUNCTION", "METHOD"];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comment {
    None,
    Round,
    Slash,
}

impl<'t> SourceText<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        let mut comment = Comment::None;
        let (mut unit, mut is_program) = (None, false);
        let mut lines = Vec::new();
        for text in text.lines() {
            let names = names_in(text, &mut comment);
            let mut ends = false;
            for (place, (name, _)) in names.iter().enumerate() {
                let is = |word: &str| name.eq_ignore_ascii_case(word);
                if UNITS.into_iter().any(is) {
                    // Modifiers of a method, such as PUBLIC, and its name.
                    let mut behind = names[place + 1..].iter().map(|(name, _)| *name);
                    let is_modifier = |word: &&str| {
                        let modifiers = ["PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL", "FINAL"];
                        modifiers.iter().any(|it| word.eq_ignore_ascii_case(it))
                    };
                    unit = behind.find(|word| !is_modifier(word));
                    is_program = is("PROGRAM");
                }
                ends |= name
                    .get(..4)
                    .is_some_and(|head| head.eq_ignore_ascii_case("END_"))
                    && UNITS
                        .into_iter()
                        .any(|word| name[4..].eq_ignore_ascii_case(word));
            }
            lines.push(Line {
                text,
                unit,
                is_program,
                names,
            });
            if ends {
                unit = None;
            }
        }
        Self { lines }
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

/// Names with their parts, and what is behind each, outside comments and texts.
fn names_in<'t>(line: &'t str, comment: &mut Comment) -> Vec<(&'t str, &'t str)> {
    let mut names = Vec::new();
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let end = match comment {
            Comment::Round => Some("*)"),
            Comment::Slash => Some("*/"),
            Comment::None => None,
        };
        if let Some(end) = end {
            let Some(place) = rest.find(end) else {
                return names;
            };
            rest = &rest[place + end.len()..];
            *comment = Comment::None;
        } else if let Some(behind) = rest.strip_prefix("(*") {
            (*comment, rest) = (Comment::Round, behind);
        } else if let Some(behind) = rest.strip_prefix("/*") {
            (*comment, rest) = (Comment::Slash, behind);
        } else if rest.starts_with("//") {
            return names;
        } else if first == '\'' || first == '"' {
            let inside = &rest[1..];
            rest = inside.find(first).map_or("", |end| &inside[end + 1..]);
        } else if first.is_ascii_alphanumeric() || first == '_' || first == '%' {
            let is_part = |letter: char| letter.is_alphanumeric() || "_.#%".contains(letter);
            let end = rest.find(|letter| !is_part(letter)).unwrap_or(rest.len());
            let (name, behind) = rest.split_at(end);
            if !first.is_ascii_digit() && !name.contains('#') {
                names.push((name.trim_end_matches('.'), behind));
            }
            rest = behind;
        } else {
            rest = &rest[first.len_utf8()..];
        }
    }
    names
}

#[cfg(test)]
mod tests {
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
        assert_eq!(source.lines()[3].unit, Some("main"));
        assert!(source.lines()[3].is_program && !source.lines()[0].is_program);
        assert!(source.declares("LAG"));
        assert!(!source.declares("PID"));
        assert_eq!(source.line(5), Some("END_PROGRAM"));
        assert_eq!(source.line(0), None);
    }
}
